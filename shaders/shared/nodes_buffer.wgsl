// The octree's texels in a buffer: the 8 children of a block lie together, in one 32-byte sector. A block is named by its number.

@group(0) @binding(1) var<storage, read> nodes: array<u32>;

fn node(block: u32, child: vec3<u32>) -> u32 {
    return nodes[8u * block + (child.x | (child.y << 1u) | (child.z << 2u))];
}
