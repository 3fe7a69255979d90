// Stage: march, the paper's step rule. The step follows the depth of the leaves; back where the octree gets deeper (method 1.4).
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

// No ray looks up more cells: only steps far below any leaf's size could.
const MAX_LOOKUPS: u32 = 4194304u;

// The last sample of a run; step_depth is the depth that the step in use belongs to, 0 while there is no run.
struct Sample {
    t: f32,
    value: f32,
    step_depth: u32,
}

// Samples a stretch with the step of the leaves it meets; adds the full leaves looked up.
fn march_span(ray: Ray, stretch: vec2<f32>, light: ptr<function, Light>, samples: ptr<function, u32>) -> bool {
    let cells = grid_cells();
    let root = Cell(vec3<u32>(0u), cells);
    let step = step_along(ray);
    var last = Sample(0.0, 0.0, 0u);
    var t = stretch.x;
    var at = cell_at(ray, t, root, cells);
    for (var i = 0u; i < MAX_LOOKUPS; i++) {
        let found = find(at);
        if (found.word == EMPTY) {
            // Empty: the run ends where the ray entered this cell, and the next begins beyond it.
            if (last.step_depth != 0u) {
                let end = max(min(entry(ray, found.cell), t), last.t);
                pass_between(ray, vec2<f32>(last.t, end), vec2<f32>(last.value), light);
                last.step_depth = 0u;
            }
            forget_last();
            let leaving = exits(ray, found.cell);
            let t_exit = min(leaving.x, min(leaving.y, leaving.z));
            at = step_out(ray, found.cell, leaving, t_exit, cells);
            if (any(at >= vec3<u32>(cells)) || t_exit >= stretch.y) { return true; }
            t = max(t_exit, t);
            continue;
        }
        *samples += 1u;
        let depth = leaf_depth(found.word);
        if (last.step_depth != 0u && depth > last.step_depth) {
            // Deeper than the step: back to the last sample, and on from there with the deeper leaf's step.
            last.step_depth = depth;
        } else {
            let value = value_at(ray, found, t);
            if (last.step_depth != 0u) {
                pass_between(ray, vec2<f32>(last.t, t), vec2<f32>(last.value, value), light);
                if ((*light).transmittance < frame.min_transmittance) { return false; }
            }
            last = Sample(t, value, depth);
        }
        t = last.t + step_at(step, last.step_depth);
        if (t >= stretch.y) {
            var end = last.value;
            if (continuous) {
                let beyond = find(cell_at(ray, stretch.y, root, cells));
                if (beyond.word != EMPTY) { end = value_at(ray, beyond, stretch.y); }
            }
            pass_between(ray, vec2<f32>(last.t, stretch.y), vec2<f32>(last.value, end), light);
            return (*light).transmittance >= frame.min_transmittance;
        }
        at = cell_at(ray, t, root, cells);
    }
    return false;
}

// The field at t, in the leaf found last.
fn value_at(ray: Ray, found: Found, t: f32) -> f32 {
    if (!continuous) { return leaf_value(found.word); }
    return trilinear(leaf_corners(), within(ray, t, found.cell, grid_cells()));
}
