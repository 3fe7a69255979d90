// Stage: march, one step everywhere. Samples at the multiples of the step from where the ray enters the cube, and at the ends of spans;
// linear in between. Whatever is skipped, no sample moves.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/corners.wgsl
// #import shared/leap.wgsl
// #import shared/surface.wgsl
// #import shared/parts.wgsl
// #import shared/spans.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/output.wgsl

// The sample where the octree is empty.
const NOTHING: f32 = -1.0;

// Lane i of a workgroup marches pixel (i mod tile, i / tile) of a square tile.
override tile: u32 = 8u;

// The leaf that the last sample fell into, and where the ray leaves it.
var<private> leaf: Found;
var<private> leaf_exit: f32;
var<private> corners: Corners;
// Up to where the ray has been marched: parts that follow each other may share a step.
var<private> marched_to: f32;

@compute @workgroup_size(tile, tile)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var light = dark();
    var samples = 0u;
    let ray = enter(pixel_ray(pixel.xy));
    marched_to = 0.0;
    if (ray.t_out > 0.0 && in_image(pixel.xy)) {
        samples = march(ray, pixel.xy, &light);
    }
    write_pixel(pixel.xy, light);
    count_samples(samples, lane);
}

// Marches the steps of a span that touch a part; adds the samples taken in full leaves.
fn march_span(ray: Ray, span: vec2<f32>, part: vec2<f32>, light: ptr<function, Light>, samples: ptr<function, u32>) -> bool {
    let step = max(step_along(ray), MIN_STEP);
    let begin = max(span.x, marched_to);
    let end = min(span.y, part.y);
    var i = floor(max(part.x, begin) / step);
    var t = max(i * step, begin);
    if (t >= end) { return true; }
    leaf_exit = -FAR;
    var front = sample_at(ray, t, samples);
    loop {
        if (skipping && !is_leaf_active()) {
            let leaf_begin = next_active(ray, t, end);
            leaf_exit = -FAR;
            if (leaf_begin >= end) { return true; }
            let steps = floor(leaf_begin / step);
            if (steps > i) {
                i = steps;
                t = max(i * step, t);
                front = sample_at(ray, t, samples);
            }
        }
        i += 1.0;
        let next = min(i * step, span.y);
        let back = sample_at(ray, next, samples);
        add_segment(light, front, back, (next - t) * ray.length);
        marched_to = next;
        if ((*light).transmittance < frame.min_transmittance) { return false; }
        if (next >= end) { return true; }
        t = next;
        front = back;
    }
    return true;
}

// The field at t, or NOTHING.
fn sample_at(ray: Ray, t: f32, samples: ptr<function, u32>) -> f32 {
    let cells = grid_cells();
    if (t >= leaf_exit) {
        leaf = descend(cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells), ALL);
        let leaving = exits(ray, leaf.cell);
        leaf_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (continuous && leaf.word != EMPTY) { corners = leaf_corners(); }
    }
    if (leaf.word == EMPTY) { return NOTHING; }
    *samples += 1u;
    if (!continuous) { return leaf_value(leaf.word); }
    return trilinear(corners, within(ray, t, leaf.cell, cells));
}

// Whether the leaf that the last sample fell into is active.
fn is_leaf_active() -> bool {
    let child = child_index(child_of(stack_cell, frame.depth - 1u - stack_level));
    return leaf.word != EMPTY && ((activity[block_number(stack[stack_level])] >> child) & 1u) == 1u;
}

// Passes a step. Where one end is empty the other's value holds for half of it; without samples at corners the front's does for all.
fn add_segment(light: ptr<function, Light>, front: f32, back: f32, segment_length: f32) {
    if (!continuous) {
        if (front != NOTHING) { add_constant(light, front, segment_length); }
    } else if (front != NOTHING && back != NOTHING) {
        add_linear(light, front, back, segment_length);
    } else if (front != NOTHING || back != NOTHING) {
        add_constant(light, max(front, back), 0.5 * segment_length);
    }
}
