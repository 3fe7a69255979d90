// Stage: intervals. Follows each pixel's ray from leaf to leaf and notes, for each part of it, where the first active leaf begins and
// the last one ends (method 2.3). A ray is cut into equal parts, or in two by a plane.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/cuts.wgsl

override tile: u32 = 8u;

@group(0) @binding(16) var<storage, read_write> part_words: array<vec2<u32>>;

@compute @workgroup_size(tile, tile)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>) {
    if (!in_image(pixel.xy)) { return; }
    let first = parts * (pixel.x + frame.width * pixel.y);
    let ray = enter(pixel_ray(pixel.xy));
    var part = 0u;
    if (ray.t_out > 0.0) { part = note_active(ray, first); }
    for (; part < parts; part += 1u) { part_words[first + part] = vec2<u32>(0u); }
}

// Notes the parts of a ray; returns how many were written.
fn note_active(ray: Ray, first: u32) -> u32 {
    let cells = grid_cells();
    start_descent();
    var part = 0u;
    var part_end = cut(ray, 1u);
    var noted = vec2<u32>(0u);
    var t = 0.0;
    var at = cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells);
    loop {
        let found = descend(at, WHOLE);
        let leaving = exits(ray, found.cell);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (found.word != EMPTY) {
            // What reaches over a cut is in both parts.
            let end = min(t_exit, ray.t_out);
            var begin = t;
            loop {
                noted = max(noted, part_from(begin, min(end, part_end)));
                if (end <= part_end || part + 1u == parts) { break; }
                part_words[first + part] = noted;
                begin = max(begin, part_end);
                noted = vec2<u32>(0u);
                part += 1u;
                part_end = cut(ray, part + 1u);
            }
        }
        if (t_exit >= ray.t_out) { break; }
        at = step_out(ray, found.cell, leaving, t_exit, cells);
        if (any(at >= vec3<u32>(cells))) { break; }
        t = max(t, t_exit);
    }
    part_words[first + part] = noted;
    return part + 1u;
}

// Leaves all parts empty, for the stage `boxes` to widen.
@compute @workgroup_size(tile, tile)
fn clear(@builtin(global_invocation_id) pixel: vec3<u32>) {
    if (!in_image(pixel.xy)) { return; }
    let first = parts * (pixel.x + frame.width * pixel.y);
    for (var part = 0u; part < parts; part += 1u) { part_words[first + part] = vec2<u32>(0u); }
}
