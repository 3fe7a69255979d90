// The samples at a leaf's corners, and the trilinear field between them.
// #import shared/brick.wgsl

// Corners x + 2 y + 4 z: those with z = 0, and those with z = 1.
struct Corners {
    low: vec4<f32>,
    high: vec4<f32>,
}

// The corners of the leaf found last.
fn leaf_corners() -> Corners {
    let block = stack[stack_level];
    let child = child_of(stack_cell, frame.depth - 1u - stack_level);
    let first = child.x + 3u * child.y + 9u * child.z;
    let bits = brick_word(block, LOWEST_BITS);
    let low = vec4<u32>(sample(block, bits, first), sample(block, bits, first + 1u), sample(block, bits, first + 3u), sample(block, bits, first + 4u));
    let high = vec4<u32>(sample(block, bits, first + 9u), sample(block, bits, first + 10u), sample(block, bits, first + 12u), sample(block, bits, first + 13u));
    return Corners(vec4<f32>(low) * (1.0 / SAMPLE_MAX), vec4<f32>(high) * (1.0 / SAMPLE_MAX));
}

// The gradient of the field at a place in the leaf, per edge of the leaf.
fn trilinear_gradient(corners: Corners, at: vec3<f32>) -> vec3<f32> {
    // Along x: the edges' differences at (y, z) = (0, 0), (1, 0), (0, 1), (1, 1); so along y by (x, z), along z by (x, y).
    let along_x = vec4<f32>(corners.low.yw - corners.low.xz, corners.high.yw - corners.high.xz);
    let along_y = vec4<f32>(corners.low.zw - corners.low.xy, corners.high.zw - corners.high.xy);
    let along_z = corners.high - corners.low;
    return vec3<f32>(blended(along_x, at.yz), blended(along_y, at.xz), blended(along_z, at.xy));
}

fn blended(edges: vec4<f32>, at: vec2<f32>) -> f32 {
    let both = edges.xz + at.x * (edges.yw - edges.xz);
    return both.x + at.y * (both.y - both.x);
}

// The field at a place in the leaf, in cells from corner 0.
fn trilinear(corners: Corners, at: vec3<f32>) -> f32 {
    let low = corners.low.xz + at.x * (corners.low.yw - corners.low.xz);
    let high = corners.high.xz + at.x * (corners.high.yw - corners.high.xz);
    let near = low.x + at.y * (low.y - low.x);
    let far = high.x + at.y * (high.y - high.x);
    return near + at.z * (far - near);
}
