// The octree's texels in a 3D texture, for trees too large for one storage binding. A block is named by its position in the pool.

@group(0) @binding(1) var nodes: texture_3d<u32>;

fn node(block: u32, child: vec3<u32>) -> u32 {
    let texel = textureLoad(nodes, 2u * position(block) + child, 0);
    return (texel.a << 24u) | (texel.r << 16u) | (texel.g << 8u) | texel.b;
}

fn position(block: u32) -> vec3<u32> {
    return vec3<u32>(block >> 16u, (block >> 8u) & 255u, block & 255u);
}

fn block_number(block: u32) -> u32 {
    let n = textureDimensions(nodes).x / 2u;
    let at = position(block);
    return at.x + n * (at.y + n * at.z);
}

// The name of a block.
fn block_named(number: u32) -> u32 {
    let n = textureDimensions(nodes).x / 2u;
    return ((number % n) << 16u) | (((number / n) % n) << 8u) | (number / (n * n));
}

// Samples at the corners of the children, 5 x 3 texels a block.
@group(0) @binding(7) var bricks: texture_3d<u32>;

fn brick_word(block: u32, i: u32) -> u32 {
    let at = position(block);
    return textureLoad(bricks, vec3<u32>(5u * at.x + i % 5u, 3u * at.y + i / 5u, at.z), 0).r;
}
