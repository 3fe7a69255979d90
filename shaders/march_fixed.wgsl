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
// #import shared/output.wgsl

// Lane i of a workgroup marches pixel (i mod tile, i / tile) of a square tile.
override tile: u32 = 8u;

@compute @workgroup_size(tile, tile)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var light = dark();
    var samples = 0u;
    let ray = enter(pixel_ray(pixel.xy));
    if (ray.t_out > 0.0 && in_image(pixel.xy)) {
        samples = march(ray, pixel.xy, &light);
    }
    write_pixel(pixel.xy, light);
    count_samples(samples, lane);
}

fn sample_at(ray: Ray, t: f32, samples: ptr<function, u32>) -> f32 {
    let value = octree_sample(ray, t);
    *samples += select(0u, 1u, value != NOTHING);
    return value;
}

// Whether the leaf that the last sample fell into is active.
fn is_active_here() -> bool {
    let child = child_index(child_of(stack_cell, frame.depth - 1u - stack_level));
    return leaf.word != EMPTY && ((activity[block_number(stack[stack_level])] >> child) & 1u) == 1u;
}
