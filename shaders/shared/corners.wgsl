// The samples at a leaf's corners, and the trilinear field between them. src/octree/brick.rs has the layout of a brick.

// Corners x + 2 y + 4 z: those with z = 0, and those with z = 1.
struct Corners {
    low: vec4<f32>,
    high: vec4<f32>,
}

// The last word of a brick holds the lowest bits of all samples.
const LOWEST_BITS: u32 = 14u;

// The corners of the leaf found last.
fn leaf_corners() -> Corners {
    let block = stack[stack_level];
    let child = child_of(stack_cell, frame.depth - 1u - stack_level);
    let first = child.x + 3u * child.y + 9u * child.z;
    let bits = brick_word(block, LOWEST_BITS);
    let low = vec4<u32>(sample(block, bits, first), sample(block, bits, first + 1u), sample(block, bits, first + 3u), sample(block, bits, first + 4u));
    let high = vec4<u32>(sample(block, bits, first + 9u), sample(block, bits, first + 10u), sample(block, bits, first + 12u), sample(block, bits, first + 13u));
    return Corners(vec4<f32>(low) * (1.0 / 131071.0), vec4<f32>(high) * (1.0 / 131071.0));
}

// Sample i of a block, 17 bits.
fn sample(block: u32, bits: u32, i: u32) -> u32 {
    let high = (brick_word(block, i >> 1u) >> (16u * (i & 1u))) & 0xffffu;
    return (high << 1u) | ((bits >> i) & 1u);
}

// The field at a place in the leaf, in cells from corner 0.
fn trilinear(corners: Corners, at: vec3<f32>) -> f32 {
    let low = corners.low.xz + at.x * (corners.low.yw - corners.low.xz);
    let high = corners.high.xz + at.x * (corners.high.yw - corners.high.xz);
    let near = low.x + at.y * (low.y - low.x);
    let far = high.x + at.y * (high.y - high.x);
    return near + at.z * (far - near);
}
