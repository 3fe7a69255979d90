// Stage: march, one step everywhere, through a 3D texture of voxels, or through an encoded volume (Kang 2012): the blocks of voxels that
// hold something active, packed into one 3D texture, and an index that says where each of them is. src/gpu/voxels.rs says more.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/nodes
// #import shared/descent.wgsl
// #import shared/corners.wgsl
// #import shared/clearance.wgsl
// #import shared/surface.wgsl
// #import shared/parts.wgsl
// #import shared/spans.wgsl
// #import shared/steps.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/pass.wgsl
// #import shared/probe.wgsl
// #import shared/output.wgsl
// #import shared/main.wgsl

// Cells along each axis of a block, which has one sample more.
const BLOCK_CELLS: u32 = 8u;

// 1 + the number of each block that is kept, 0 for those that were dropped.
@group(0) @binding(19) var block_index: texture_3d<u32>;
// The samples of the blocks that are kept, or of all voxels.
@group(0) @binding(20) var block_samples: texture_3d<f32>;

// Whether blocks were dropped.
override encoded: bool = false;

// The cell that the last sample fell into, and its block, 0 if that was dropped.
var<private> last_cell: vec3<u32>;
var<private> block_here: u32;

// The cell of the grid in which the ray is at t.
fn cell_here(ray: Ray, t: f32) -> vec3<u32> {
    let cells = grid_cells();
    return cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells);
}

fn block_at(cell: vec3<u32>) -> u32 {
    return textureLoad(block_index, cell / BLOCK_CELLS, 0).r;
}

fn sample_at(ray: Ray, t: f32, samples: ptr<function, u32>) -> f32 {
    let cell = cell_here(ray, t);
    last_cell = cell;
    *samples += 1u;
    var lowest = cell;
    if (encoded) {
        block_here = block_at(cell);
        // A step begins or ends in a block that was dropped: what was there is seen in the other one only.
        if (block_here == 0u) { return octree_sample(ray, t); }
        let per_axis = textureDimensions(block_samples).x / (BLOCK_CELLS + 1u);
        let number = block_here - 1u;
        let place = vec3<u32>(number % per_axis, (number / per_axis) % per_axis, number / (per_axis * per_axis));
        lowest = place * (BLOCK_CELLS + 1u) + cell % BLOCK_CELLS;
    }
    let at = within(ray, t, Cell(cell, 1u), grid_cells());
    let low = vec4<f32>(fetch(lowest, 0u), fetch(lowest, 1u), fetch(lowest, 2u), fetch(lowest, 3u));
    let high = vec4<f32>(fetch(lowest, 4u), fetch(lowest, 5u), fetch(lowest, 6u), fetch(lowest, 7u));
    return trilinear(Corners(low, high), at);
}

// The octree, which other places were looked up in, serves only where a block was dropped.
fn regain_place(ray: Ray, t: f32) {
    forget_place();
}

fn fetch(lowest: vec3<u32>, corner: u32) -> f32 {
    return textureLoad(block_samples, lowest + vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u), 0).r;
}

// Whether a block, or a cell of the grid of clearances, has something active.
fn is_active_here() -> bool {
    if (encoded) { return block_here != 0u; }
    return !clearance_at(last_cell).is_clear;
}

// The t, from t_begin on, at which the ray enters such a one; FAR if there is none before t_end.
fn next_active(ray: Ray, t_begin: f32, t_end: f32) -> f32 {
    let cells = grid_cells();
    var t = t_begin;
    var at = cell_here(ray, t);
    loop {
        var clear = Clear(at / BLOCK_CELLS * BLOCK_CELLS, min((at / BLOCK_CELLS + 1u) * BLOCK_CELLS, vec3<u32>(cells)), false);
        if (encoded) {
            clear.is_clear = block_at(at) == 0u;
        } else {
            clear = clearance_at(at);
        }
        if (!clear.is_clear) { return t; }
        let leaving = exits_of(ray, clear.low, clear.high);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (t_exit >= t_end) { return FAR; }
        at = step_out_of(ray, clear.low, clear.high, leaving, t_exit, cells);
        if (any(at >= vec3<u32>(cells))) { return FAR; }
        t = max(t, t_exit);
    }
    return FAR;
}
