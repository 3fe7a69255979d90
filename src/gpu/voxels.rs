//! The octree's field as a 3D texture of voxels, as other renderers of regular volumes have it; and octree encoding (Kang 2012), which
//! keeps the blocks of it that hold something active. What half-splitting was measured on, and against.

use super::context::{Context, GpuError};
use super::volume::texture_3d;
use crate::octree::{ActiveBox, Activity, OctreeTexture};
use glam::UVec3;
use rayon::prelude::*;

/// Cells along each axis of a block, which has one sample more, so that it can be interpolated without its neighbours. The twin of
/// `BLOCK_CELLS` in `shaders/march_voxels.wgsl`.
pub const BLOCK_CELLS: u32 = 8;
const BLOCK_SAMPLES: u32 = BLOCK_CELLS + 1;

/// The octree's field at the corners of all cells of its deepest level: all of them, or in blocks of which those without anything active
/// are dropped.
#[derive(Debug, Clone)]
pub(super) struct VoxelTexture {
    /// 1 + the number of each block, 0 where it was dropped. One 0 if there are no blocks.
    pub index: wgpu::TextureView,
    /// The samples, x fastest; those of blocks in the order of their numbers.
    pub samples: wgpu::TextureView,
}

impl VoxelTexture {
    /// Samples all of an octree.
    pub fn dense(context: &Context, texture: &OctreeTexture) -> Result<Self, GpuError> {
        let cells = 1u32 << texture.depth();
        let size = UVec3::splat(cells + 1);
        let what = || format!("a texture of {} voxels a side", cells + 1);
        check_room(context, what, size)?;
        let mut samples = vec![0f32; size.element_product() as usize];
        let row = size.x as usize;
        samples.par_chunks_mut(row).enumerate().for_each(|(i, values)| {
            let (y, z) = ((i % row) as u32, (i / row) as u32);
            for (x, value) in (0..).zip(values) {
                *value = sample(texture, UVec3::new(x, y, z));
            }
        });
        Ok(VoxelTexture {
            index: texture_3d(context, "block index", UVec3::ONE, wgpu::TextureFormat::R32Uint, &[0; 4])?,
            samples: texture_3d(context, "voxels", size, wgpu::TextureFormat::R32Float, bytemuck::cast_slice(&samples))?,
        })
    }

    /// Samples what is active of an octree.
    pub fn encoded(context: &Context, texture: &OctreeTexture, activity: &Activity) -> Result<Self, GpuError> {
        let cells = 1u32 << texture.depth();
        let per_axis = cells.div_ceil(BLOCK_CELLS);
        check_room(context, || format!("an index of {per_axis}^3 blocks"), UVec3::splat(per_axis))?;
        let mut index = vec![0u32; (per_axis as usize).pow(3)];
        for ActiveBox { low, size } in activity.boxes(texture, 0) {
            let (first, last) = (low / BLOCK_CELLS, (low + (size - 1)) / BLOCK_CELLS);
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        index[(x + per_axis * (y + per_axis * z)) as usize] = 1;
                    }
                }
            }
        }
        let kept: Vec<usize> = (0..index.len()).filter(|&i| index[i] != 0).collect();
        for (number, &i) in (1..).zip(&kept) {
            index[i] = number;
        }
        // Blocks along each axis of the texture that holds them, as few as there is room in.
        let packed = (1u32..).find(|&n| n.pow(3) as usize >= kept.len()).unwrap_or(u32::MAX);
        let layers = (kept.len() as u32).div_ceil(packed * packed).max(1);
        let size = UVec3::new(packed, packed, layers) * BLOCK_SAMPLES;
        check_room(context, || format!("an encoded volume of {} blocks", kept.len()), size)?;
        let blocks: Vec<Vec<f32>> = kept.par_iter().map(|&i| block(texture, i as u32, per_axis)).collect();
        let mut samples = vec![0f32; (size.x * size.y * size.z) as usize];
        let row = BLOCK_SAMPLES as usize;
        for (number, block) in (0u32..).zip(&blocks) {
            let place = UVec3::new(number % packed, number / packed % packed, number / (packed * packed)) * BLOCK_SAMPLES;
            for (i, values) in (0u32..).zip(block.chunks(row)) {
                let at = place.x + size.x * (place.y + i % BLOCK_SAMPLES + size.y * (place.z + i / BLOCK_SAMPLES));
                samples[at as usize..at as usize + row].copy_from_slice(values);
            }
        }
        let r32 = wgpu::TextureFormat::R32Uint;
        Ok(VoxelTexture {
            index: texture_3d(context, "block index", UVec3::splat(per_axis), r32, bytemuck::cast_slice(&index))?,
            samples: texture_3d(context, "block samples", size, wgpu::TextureFormat::R32Float, bytemuck::cast_slice(&samples))?,
        })
    }
}

/// `Err` if the adapter has no 3D texture of so many samples.
fn check_room(context: &Context, what: impl Fn() -> String, size: UVec3) -> Result<(), GpuError> {
    let limits = context.device.limits();
    let bytes = 4 * u64::from(size.x) * u64::from(size.y) * u64::from(size.z);
    context.check_limit(&what, u64::from(size.max_element()), "max_texture_dimension_3d", u64::from(limits.max_texture_dimension_3d))?;
    context.check_limit(&what, bytes, "max_buffer_size", limits.max_buffer_size)
}

/// The samples of block `i` of `per_axis`^3, x fastest.
fn block(texture: &OctreeTexture, i: u32, per_axis: u32) -> Vec<f32> {
    let lowest = UVec3::new(i % per_axis, i / per_axis % per_axis, i / (per_axis * per_axis)) * BLOCK_CELLS;
    let n = BLOCK_SAMPLES;
    (0..n.pow(3)).map(|k| sample(texture, lowest + UVec3::new(k % n, k / n % n, k / (n * n)))).collect()
}

/// The field at a corner of finest cells, by any of the cells around it that is not empty; 0 if all are.
fn sample(texture: &OctreeTexture, corner: UVec3) -> f32 {
    let cells = f64::from(1u32 << texture.depth());
    // Far less than a cell.
    let nudge = 1.0 / 256.0;
    let mut around = (0..8u32).map(|k| (corner.as_dvec3() - UVec3::new(k & 1, k >> 1 & 1, k >> 2).as_dvec3() * nudge) / cells);
    around.find_map(|at| texture.value_at(at)).unwrap_or(0.0)
}
