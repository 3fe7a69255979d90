// Stage: activity. Which nodes of a level are active under a transfer function (maths 5): a leaf if its values reach into what is seen, an
// interior node if one below is. Levels are done from the deepest to the first, a block a lane. src/octree/activity.rs says more. Then, on
// a coarse grid, how far around each cell nothing is active, axis by axis, a cell a lane.
// #import shared/nodes
// #import shared/brick.wgsl

const INTERIOR: u32 = 255u;
const EMPTY: u32 = 0u;

// Lanes of a workgroup, and lanes along x of a dispatch.
override lanes: u32 = 64u;
override row: u32 = 4194240u;
// Whether leaves have samples at their corners.
override continuous: bool = false;

// No clearance is larger.
const MOST_CLEARANCE: i32 = 15;

// Blocks of a level. Of the grid of clearances: bits of a coordinate.
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

// The clearances, and what they are after one axis or two.
@group(0) @binding(21) var<storage, read_write> clearance: array<u32>;
@group(0) @binding(22) var<storage, read_write> half_done: array<u32>;

// Whether something in a cell of the coarse grid is active: 0 if it is, else the largest clearance.
@compute @workgroup_size(lanes)
fn occupy(@builtin(global_invocation_id) lane: vec3<u32>) {
    let bits = level.first;
    if (lane.x >= (1u << (3u * bits))) { return; }
    let at = cell_of(lane.x, bits);
    var block = block_named(0u);
    var is_active = true;
    for (var bit = i32(bits) - 1; bit >= 0; bit -= 1) {
        let offset = (at >> vec3<u32>(u32(bit))) & vec3<u32>(1u);
        let child = offset.x | (offset.y << 1u) | (offset.z << 2u);
        let mask = activity[block_number(block)] >> child;
        is_active = (mask & 1u) == 1u;
        // Nothing below, or everything.
        if (!is_active || (mask & 256u) == 256u) { break; }
        block = node(block, offset) & 0x00ffffffu;
    }
    half_done[lane.x] = select(u32(MOST_CLEARANCE), 0u, is_active);
}

// The smaller of distances along an axis and across it, from one buffer to the other: x, y and z one after the other.
@compute @workgroup_size(lanes)
fn widen_x(@builtin(global_invocation_id) lane: vec3<u32>) {
    let bits = level.first;
    if (lane.x >= (1u << (3u * bits))) { return; }
    let x = i32(lane.x & ((1u << bits) - 1u));
    var least = half_done[lane.x];
    for (var k = 1; k < MOST_CLEARANCE; k += 1) {
        if (x - k >= 0) { least = min(least, max(u32(k), half_done[lane.x - u32(k)])); }
        if (x + k < (1 << bits)) { least = min(least, max(u32(k), half_done[lane.x + u32(k)])); }
    }
    clearance[lane.x] = least;
}

@compute @workgroup_size(lanes)
fn widen_y(@builtin(global_invocation_id) lane: vec3<u32>) {
    let bits = level.first;
    if (lane.x >= (1u << (3u * bits))) { return; }
    let y = i32((lane.x >> bits) & ((1u << bits) - 1u));
    var least = clearance[lane.x];
    for (var k = 1; k < MOST_CLEARANCE; k += 1) {
        if (y - k >= 0) { least = min(least, max(u32(k), clearance[lane.x - (u32(k) << bits)])); }
        if (y + k < (1 << bits)) { least = min(least, max(u32(k), clearance[lane.x + (u32(k) << bits)])); }
    }
    half_done[lane.x] = least;
}

@compute @workgroup_size(lanes)
fn widen_z(@builtin(global_invocation_id) lane: vec3<u32>) {
    let bits = level.first;
    if (lane.x >= (1u << (3u * bits))) { return; }
    let z = i32(lane.x >> (2u * bits));
    var least = half_done[lane.x];
    for (var k = 1; k < MOST_CLEARANCE; k += 1) {
        if (z - k >= 0) { least = min(least, max(u32(k), half_done[lane.x - (u32(k) << (2u * bits))])); }
        if (z + k < (1 << bits)) { least = min(least, max(u32(k), half_done[lane.x + (u32(k) << (2u * bits))])); }
    }
    clearance[lane.x] = least;
}

fn cell_of(number: u32, bits: u32) -> vec3<u32> {
    let last = (1u << bits) - 1u;
    return vec3<u32>(number & last, (number >> bits) & last, number >> (2u * bits));
}
