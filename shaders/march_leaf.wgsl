// Stage: march, leaf by leaf. From leaf to leaf along each pixel's ray; constant value inside a leaf (method 1.4, the stricter rule).
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/output.wgsl

// Lane i of a workgroup marches pixel (i mod tile, i / tile) of a square tile.
override tile: u32 = 8u;

@compute @workgroup_size(tile, tile)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var light = dark();
    var samples = 0u;
    let ray = enter(pixel_ray(pixel.xy));
    if (ray.t_out > 0.0 && in_image(pixel.xy)) {
        samples = march(ray, &light);
    }
    write_pixel(pixel.xy, light);
    count_samples(samples, lane);
}

// Follows a ray from leaf to leaf; returns the number of full leaves met.
fn march(ray: Ray, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    let cells = grid_cells();
    start_descent();
    var t = 0.0;
    var at = cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells);
    loop {
        let found = find(at);
        let leaving = exits(ray, found.cell);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        let t_next = max(min(t_exit, ray.t_out), t);
        if (found.word != EMPTY) {
            samples += 1u;
            add_constant(light, leaf_value(found.word), (t_next - t) * ray.length);
            if ((*light).transmittance < frame.min_transmittance) { break; }
        }
        at = step_out(ray, found.cell, leaving, t_exit, cells);
        if (any(at >= vec3<u32>(cells))) { break; }
        t = t_next;
    }
    return samples;
}
