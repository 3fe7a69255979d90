// Stage: march, the paper's step rule. The step follows the depth of the leaves; back where the octree gets deeper (method 1.4).
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/output.wgsl

// No ray looks up more cells: only steps far below any leaf's size could.
const MAX_LOOKUPS: u32 = 4194304u;
// The shortest step in t. With t below 2, f32 still tells apart the two ends of such a step.
const MIN_STEP: f32 = 9.5367431640625e-7;

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

// The last sample of a run; step_depth is the depth that the step in use belongs to, 0 while there is no run.
struct Sample {
    t: f32,
    value: f32,
    step_depth: u32,
}

// L_s in a ray's t, within 2^-11 of it.
fn step_along(ray: Ray) -> f32 {
    return frame.step * inverse_length(ray);
}

// The step at a depth, L(d) = L_s / 2^(d-1).
fn step_at(step: f32, depth: u32) -> f32 {
    return max(ldexp(step, 1 - i32(depth)), MIN_STEP);
}

// Samples a ray with the step of the leaves it meets; returns the number of full leaves looked up.
fn march(ray: Ray, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    let cells = grid_cells();
    let root = Cell(vec3<u32>(0u), cells);
    let step = step_along(ray);
    start_descent();
    var last = Sample(0.0, 0.0, 0u);
    var t = 0.0;
    var at = cell_at(ray, t, root, cells);
    for (var i = 0u; i < MAX_LOOKUPS; i++) {
        let found = find(at);
        if (found.word == EMPTY) {
            // Empty: the run ends where the ray entered this cell, and the next begins beyond it.
            if (last.step_depth != 0u) {
                let end = max(min(entry(ray, found.cell), t), last.t);
                add_constant(light, last.value, (end - last.t) * ray.length);
                last.step_depth = 0u;
            }
            let leaving = exits(ray, found.cell);
            let t_exit = min(leaving.x, min(leaving.y, leaving.z));
            at = step_out(ray, found.cell, leaving, t_exit, cells);
            if (any(at >= vec3<u32>(cells))) { break; }
            t = max(min(t_exit, ray.t_out), t);
            continue;
        }
        samples += 1u;
        let depth = leaf_depth(found.word);
        let value = leaf_value(found.word);
        if (last.step_depth != 0u && depth > last.step_depth) {
            // Deeper than the step: back to the last sample, and on from there with the deeper leaf's step.
            last.step_depth = depth;
        } else {
            if (last.step_depth != 0u) {
                add_linear(light, last.value, value, (t - last.t) * ray.length);
                if ((*light).transmittance < frame.min_transmittance) { break; }
            }
            last = Sample(t, value, depth);
        }
        t = last.t + step_at(step, last.step_depth);
        if (t >= ray.t_out) {
            add_constant(light, last.value, (ray.t_out - last.t) * ray.length);
            break;
        }
        at = cell_at(ray, t, root, cells);
    }
    return samples;
}
