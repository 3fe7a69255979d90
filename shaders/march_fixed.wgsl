// Stage: march, one step everywhere, through the octree.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/corners.wgsl
// #import shared/leap.wgsl
// #import shared/surface.wgsl
// #import shared/parts.wgsl
// #import shared/spans.wgsl
// #import shared/steps.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/pass.wgsl
// #import shared/probe.wgsl
// #import shared/output.wgsl
// #import shared/main.wgsl

fn sample_at(ray: Ray, t: f32, samples: ptr<function, u32>) -> f32 {
    let value = octree_sample(ray, t);
    *samples += select(0u, 1u, value != NOTHING);
    return value;
}

// Finds the leaf at t again after others were looked at.
fn regain_place(ray: Ray, t: f32) {
    forget_place();
    look(ray, t);
}

// Whether the leaf that the last sample fell into is active.
fn is_active_here() -> bool {
    let child = child_index(child_of(stack_cell, frame.depth - 1u - stack_level));
    return leaf.word != EMPTY && ((activity[block_number(stack[stack_level])] >> child) & 1u) == 1u;
}
