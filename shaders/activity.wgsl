// Stage: activity. Which nodes of a level are active under a transfer function (maths 5): a leaf if its values reach into what is seen, an
// interior node if one below is. Levels are done from the deepest to the first, a block a lane. src/octree/activity.rs says more.
// #import shared/nodes
// #import shared/brick.wgsl

const INTERIOR: u32 = 255u;
const EMPTY: u32 = 0u;

// Lanes of a workgroup, and lanes along x of a dispatch.
override lanes: u32 = 64u;
override row: u32 = 4194240u;
// Whether leaves have samples at their corners.
override continuous: bool = false;

// Blocks of the level.
struct Level {
    first: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> level: Level;
// The values that are seen: closed intervals, ascending and apart. The first says how many there are.
@group(0) @binding(2) var<storage, read> seen: array<vec2<f32>>;
// One word a block. Bit i: child i is active; bit 8 + i: it is so as a whole.
@group(0) @binding(15) var<storage, read_write> activity: array<u32>;

@compute @workgroup_size(lanes)
fn main(@builtin(global_invocation_id) lane: vec3<u32>) {
    let number = lane.x + row * lane.y;
    if (number >= level.count) { return; }
    let block = block_named(level.first + number);
    var mask = 0u;
    for (var child = 0u; child < 8u; child += 1u) {
        let offset = (vec3<u32>(child) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let word = node(block, offset);
        if ((word >> 24u) == INTERIOR) {
            let below = activity[block_number(word & 0x00ffffffu)];
            mask |= select(0u, 1u, (below & 255u) != 0u) << child;
            mask |= select(0u, 256u, ((below >> 8u) & 255u) == 255u) << child;
        } else if (word != EMPTY && is_seen(values(block, offset, word))) {
            mask |= 257u << child;
        }
    }
    activity[level.first + number] = mask;
}

// The smallest and largest value of a leaf.
fn values(block: u32, child: vec3<u32>, word: u32) -> vec2<f32> {
    if (!continuous) { return vec2<f32>(f32(word & 0x00ffffffu) * (1.0 / 16777215.0)); }
    let first = child.x + 3u * child.y + 9u * child.z;
    let bits = brick_word(block, LOWEST_BITS);
    var least = 131071u;
    var most = 0u;
    for (var corner = 0u; corner < 8u; corner += 1u) {
        let value = sample(block, bits, first + (corner & 1u) + 3u * ((corner >> 1u) & 1u) + 9u * (corner >> 2u));
        least = min(least, value);
        most = max(most, value);
    }
    return vec2<f32>(f32(least), f32(most)) * (1.0 / SAMPLE_MAX);
}

// Whether something between two values is seen.
fn is_seen(range: vec2<f32>) -> bool {
    // The first interval that does not end below the values.
    var low = 1u;
    var high = 1u + u32(seen[0].x);
    let end = high;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (seen[middle].y < range.x) { low = middle + 1u; } else { high = middle; }
    }
    return low < end && seen[min(low, end - 1u)].x <= range.y;
}
