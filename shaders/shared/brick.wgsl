// The samples of a block. src/octree/brick.rs has the layout of a brick.

// The last word of a brick holds the lowest bits of all samples.
const LOWEST_BITS: u32 = 14u;
// The largest sample.
const SAMPLE_MAX: f32 = 131071.0;

// Sample i of a block, 17 bits.
fn sample(block: u32, bits: u32, i: u32) -> u32 {
    let high = (brick_word(block, i >> 1u) >> (16u * (i & 1u))) & 0xffffu;
    return (high << 1u) | ((bits >> i) & 1u);
}
