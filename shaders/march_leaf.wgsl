// Stage: march, leaf by leaf. From leaf to leaf along each pixel's ray; one value inside a leaf, or the trilinear field, linear over pieces
// no longer than the step of the leaf's depth (method 1.4, the stricter rule).
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/corners.wgsl
// #import shared/leap.wgsl
// #import shared/surface.wgsl
// #import shared/parts.wgsl
// #import shared/spans.wgsl
// #import shared/march.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/pass.wgsl
// #import shared/probe.wgsl
// #import shared/output.wgsl
// #import shared/main.wgsl

// A leaf is cut into at most so many pieces.
const MAX_PIECES: f32 = 64.0;

// Follows a ray from leaf to leaf through a stretch; adds the full leaves met.
fn march_span(ray: Ray, stretch: vec2<f32>, light: ptr<function, Light>, samples: ptr<function, u32>) -> bool {
    let cells = grid_cells();
    var step = 0.0;
    if (continuous) { step = step_along(ray); }
    var t = stretch.x;
    var at = cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells);
    loop {
        let found = find(at);
        let leaving = exits(ray, found.cell);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        let t_next = max(min(t_exit, stretch.y), t);
        if (found.word != EMPTY) {
            *samples += 1u;
            if (continuous) {
                pass_leaf(ray, found, vec2<f32>(t, t_next), step_at(step, leaf_depth(found.word)), light);
            } else {
                pass_between(ray, vec2<f32>(t, t_next), vec2<f32>(leaf_value(found.word)), light);
            }
            if ((*light).transmittance < frame.min_transmittance) { return false; }
        } else {
            forget_last();
        }
        if (t_exit >= stretch.y) { return true; }
        at = step_out(ray, found.cell, leaving, t_exit, cells);
        if (any(at >= vec3<u32>(cells))) { return true; }
        t = t_next;
    }
    return true;
}

// Passes the part of a ray inside the leaf found last.
fn pass_leaf(ray: Ray, found: Found, span: vec2<f32>, step: f32, light: ptr<function, Light>) {
    let corners = leaf_corners();
    if (mode == MAXIMUM || mode == MINIMUM) {
        let least = min(corners.low, corners.high);
        let most = max(corners.low, corners.high);
        if (is_beneath(min(min(least.x, least.y), min(least.z, least.w)), max(max(most.x, most.y), max(most.z, most.w)))) { return; }
    }
    let cells = grid_cells();
    let origin = within(ray, span.x, found.cell, cells);
    let path = within(ray, span.y, found.cell, cells) - origin;
    let t_length = span.y - span.x;
    let pieces = clamp(ceil(t_length / step), 1.0, MAX_PIECES);
    let piece_length = t_length * ray.length / pieces;
    var front = trilinear(corners, origin);
    for (var piece = 1.0; piece <= pieces; piece += 1.0) {
        let back = trilinear(corners, origin + path * (piece / pieces));
        var gradient = vec3<f32>(0.0);
        if (shade_volume) {
            let middle = origin + path * ((piece - 0.5) / pieces);
            gradient = trilinear_gradient(corners, middle) * (f32(cells) / f32(found.cell.size));
        }
        // The last ends where the next leaf begins, to the bit.
        let ends = span.x + t_length * (vec2<f32>(piece - 1.0, piece) / pieces);
        let t = vec2<f32>(ends.x, select(ends.y, span.y, piece == pieces));
        pass_piece(ray, Piece(t, vec2<f32>(front, back), piece_length, gradient), light);
        front = back;
    }
}
