// The octree's texels in a 3D texture, for trees too large for one storage binding. A block is named by its position in the pool.

@group(0) @binding(1) var nodes: texture_3d<u32>;

fn node(block: u32, child: vec3<u32>) -> u32 {
    let position = vec3<u32>(block >> 16u, (block >> 8u) & 255u, block & 255u);
    let texel = textureLoad(nodes, 2u * position + child, 0);
    return (texel.a << 24u) | (texel.r << 16u) | (texel.g << 8u) | texel.b;
}
