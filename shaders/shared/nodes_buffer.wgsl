// The octree's texels in a buffer: the 8 children of a block lie together, in one 32-byte sector. A block is named by its number.

@group(0) @binding(1) var<storage, read> nodes: array<u32>;

fn node(block: u32, child: vec3<u32>) -> u32 {
    return nodes[8u * block + (child.x | (child.y << 1u) | (child.z << 2u))];
}

fn block_number(block: u32) -> u32 {
    return block;
}

// The name of a block.
fn block_named(number: u32) -> u32 {
    return number;
}

// Samples at the corners of the children, 15 words a block.
@group(0) @binding(7) var<storage, read> bricks: array<u32>;

fn brick_word(block: u32, i: u32) -> u32 {
    return bricks[15u * block + i];
}
