// How far around a place nothing is active (Deakin & Knoll 2020: distances of Chebyshev).

// Cells of the grid of clearances along each axis, 2^6, or as many as the octree's finest if those are fewer.
const CLEARANCE_BITS: u32 = 6u;

// How many cells around each, itself counted, hold nothing active; 0 where something is. x fastest.
@group(0) @binding(21) var<storage, read> clearance: array<u32>;

// The finest cells of a cube around a place, cut to the root cube, high not included; whether nothing in it is active.
struct Clear {
    low: vec3<u32>,
    high: vec3<u32>,
    is_clear: bool,
}

fn clearance_at(at: vec3<u32>) -> Clear {
    let bits = min(frame.depth, CLEARANCE_BITS);
    let shift = vec3<u32>(frame.depth - bits);
    let cell = at >> shift;
    let distance = clearance[cell.x | (cell.y << bits) | (cell.z << (2u * bits))];
    let low = max(cell + 1u, vec3<u32>(distance)) - distance;
    let high = min(cell + distance, vec3<u32>(1u << bits));
    return Clear(low << shift, high << shift, distance != 0u);
}
