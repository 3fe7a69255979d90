//! Bricks on the device: one texture of them, and the table that says where each is.

use super::super::context::{Context, GpuError};
use super::{SliceLevel, TINTS};
use crate::bricks::{BRICK_EDGE, Brick, BrickKey, Pyramid};
use crate::volume::Samples;
use std::borrow::Cow;
use wgpu::util::DeviceExt;

/// Of a brick that is not on the device: `ABSENT` in `shaders/slices.wgsl`.
pub const ABSENT: u32 = u32::MAX;

/// Voxels of a brick.
const VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;

/// The bricks of one volume that are on the device. Which one is in which slot is decided elsewhere.
#[derive(Debug)]
pub struct SlicePool {
    pub(super) pyramid: Pyramid,
    pub(super) atlas: wgpu::TextureView,
    pub(super) levels: wgpu::Buffer,
    pub(super) table: wgpu::Buffer,
    /// Added to numbers that are kept as unsigned integers.
    pub(super) bias: f32,
    /// Bricks along each axis of the texture.
    pub(super) across: [u32; 3],
    /// Bytes of a voxel on the device: 1, 2, or 4 for floats.
    pub(super) voxel_bytes: u32,
    texture: wgpu::Texture,
    pages: Vec<u32>,
    firsts: Vec<u32>,
    /// What of the table the device does not have yet.
    changed: Option<[usize; 2]>,
}

impl SlicePool {
    /// Room for bricks of a volume whose voxels take so many bytes: what fits in `budget_bytes` and the adapter's limits, at least one brick.
    /// Whole numbers of up to two bytes are kept as they are, others as 32-bit floats.
    pub fn new(context: &Context, pyramid: &Pyramid, voxel_bytes: usize, budget_bytes: u64) -> Result<Self, GpuError> {
        let limits = context.device.limits();
        let voxel_bytes = if voxel_bytes > 2 { 4 } else { voxel_bytes.max(1) as u32 };
        // A place is named by ten bits an axis.
        let most = u64::from(limits.max_texture_dimension_3d / BRICK_EDGE).clamp(1, 1023);
        let brick_bytes = u64::from(voxel_bytes) * VOXELS as u64;
        // Near to a cube, since no side can be longer than the limit.
        let affordable = budget_bytes / brick_bytes;
        let wanted = affordable.min(pyramid_bricks(pyramid)).clamp(1, most * most * most);
        let x = ((wanted as f64).cbrt().ceil() as u64).clamp(1, most);
        let y = wanted.div_ceil(x).isqrt().clamp(1, most);
        let rounded_up = wanted.div_ceil(x * y);
        let z = if x * y * rounded_up <= affordable { rounded_up } else { wanted / (x * y) }.clamp(1, most);
        let across = [x, y, z].map(|n| n as u32);

        let count: u64 = (0..pyramid.levels()).map(|level| pyramid.brick_count(level)).sum();
        let what = || format!("a table of {count} bricks");
        context.check_limit(what, 4 * count, "max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size)?;
        let mut firsts = Vec::new();
        let mut first = 0;
        for level in 0..pyramid.levels() {
            firsts.push(first);
            first += pyramid.brick_count(level) as u32;
        }
        let pages = vec![ABSENT; count as usize];
        let format = match voxel_bytes {
            1 => wgpu::TextureFormat::R8Uint,
            2 => wgpu::TextureFormat::R16Uint,
            _ => wgpu::TextureFormat::R32Uint,
        };
        let [width, height, depth_or_array_layers] = across.map(|n| n * BRICK_EDGE);
        let descriptor = wgpu::TextureDescriptor {
            label: Some("bricks"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        };
        let (texture, atlas, levels, table) = context.scoped(|| {
            let texture = context.device.create_texture(&descriptor);
            let atlas = texture.create_view(&wgpu::TextureViewDescriptor::default());
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer = |label, contents: &[u8]| {
                context.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
            };
            let levels = buffer("levels", bytemuck::cast_slice(&levels(&firsts)));
            (texture, atlas, levels, buffer("table of bricks", bytemuck::cast_slice(&pages)))
        })?;
        Ok(SlicePool { pyramid: *pyramid, atlas, levels, table, bias: 0.0, across, voxel_bytes, texture, pages, firsts, changed: None })
    }

    /// How many bricks there is room for.
    pub fn capacity(&self) -> u32 {
        self.across.iter().product()
    }

    /// Bytes of one brick on the device.
    pub fn brick_bytes(&self) -> u64 {
        u64::from(self.voxel_bytes) * VOXELS as u64
    }

    /// Copies a brick to a slot, below [`SlicePool::capacity`]. What was there before must have been taken out.
    pub fn put(&mut self, context: &Context, slot: u32, key: BrickKey, brick: &Brick) {
        let Some(page) = self.page(key).filter(|_| slot < self.capacity() && brick.samples.len() == VOXELS) else { return };
        let (bytes, bias) = packed(&brick.samples, self.voxel_bytes);
        self.bias = bias;
        let [nx, ny, _] = self.across;
        let place = [slot % nx, slot / nx % ny, slot / (nx * ny)];
        let [x, y, z] = place.map(|n| n * BRICK_EDGE);
        let mut to = self.texture.as_image_copy();
        to.origin = wgpu::Origin3d { x, y, z };
        let bytes_per_row = Some(BRICK_EDGE * self.voxel_bytes);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: Some(BRICK_EDGE) };
        let size = wgpu::Extent3d { width: BRICK_EDGE, height: BRICK_EDGE, depth_or_array_layers: BRICK_EDGE };
        context.queue.write_texture(to, &bytes, layout, size);
        self.set(page, place[0] | place[1] << 10 | place[2] << 20);
    }

    /// Takes a brick out: pictures fall back to coarser ones.
    pub fn remove(&mut self, key: BrickKey) {
        if let Some(page) = self.page(key) {
            self.set(page, ABSENT);
        }
    }

    /// Sends what has changed of the table to the device.
    pub(super) fn flush(&mut self, context: &Context) {
        if let Some([from, to]) = self.changed.take() {
            context.queue.write_buffer(&self.table, 4 * from as u64, bytemuck::cast_slice(&self.pages[from..to]));
        }
    }

    fn page(&self, key: BrickKey) -> Option<usize> {
        let [nx, ny, _] = self.pyramid.bricks(key.level).map(|n| n as usize);
        let [x, y, z] = key.at.map(|at| at as usize);
        self.pyramid.has(key).then(|| self.firsts[usize::from(key.level)] as usize + (z * ny + y) * nx + x)
    }

    fn set(&mut self, page: usize, place: u32) {
        self.pages[page] = place;
        let [from, to] = self.changed.unwrap_or([page, page]);
        self.changed = Some([from.min(page), to.max(page + 1)]);
    }
}

fn pyramid_bricks(pyramid: &Pyramid) -> u64 {
    (0..pyramid.levels()).map(|level| pyramid.brick_count(level)).sum()
}

fn levels(firsts: &[u32]) -> Vec<SliceLevel> {
    let tint = |level: usize| TINTS[level.min(TINTS.len() - 1)];
    firsts.iter().enumerate().map(|(level, &first)| SliceLevel { tint: tint(level), first }).collect()
}

/// Voxels as the device keeps them, and what is added there to those kept as unsigned integers.
fn packed(samples: &Samples, voxel_bytes: u32) -> (Cow<'_, [u8]>, f32) {
    match (samples, voxel_bytes) {
        (Samples::U8(all), 1) => (Cow::Borrowed(&all[..]), 0.0),
        (Samples::I8(all), 1) => (all.iter().map(|v| (v.cast_unsigned()) ^ 0x80).collect(), -128.0),
        (Samples::U16(all), 2) => (Cow::Borrowed(bytemuck::cast_slice(&all[..])), 0.0),
        (Samples::I16(all), 2) => {
            let unsigned: Vec<u16> = all.iter().map(|v| v.cast_unsigned() ^ 0x8000).collect();
            (Cow::Owned(bytemuck::cast_slice(&unsigned).to_vec()), -32768.0)
        }
        (Samples::F32(all), 4) => (Cow::Borrowed(bytemuck::cast_slice(&all[..])), 0.0),
        // A volume whose bricks have types of their own loses what does not fit.
        (_, 1) => ((0..samples.len()).map(|i| samples.get(i) as u8).collect(), 0.0),
        (_, 2) => {
            let all: Vec<u16> = (0..samples.len()).map(|i| samples.get(i) as u16).collect();
            (Cow::Owned(bytemuck::cast_slice(&all).to_vec()), 0.0)
        }
        _ => {
            let all: Vec<f32> = (0..samples.len()).map(|i| samples.get(i) as f32).collect();
            (Cow::Owned(bytemuck::cast_slice(&all).to_vec()), 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_numbers_come_back_from_unsigned_ones() {
        let samples = Samples::I8(vec![-128, -1, 0, 127].into());
        let (bytes, bias) = packed(&samples, 1);
        assert_eq!(bytes.iter().map(|&b| f32::from(b) + bias).collect::<Vec<_>>(), [-128.0, -1.0, 0.0, 127.0]);
        let samples = Samples::I16(vec![-32768, -1, 32767].into());
        let (bytes, bias) = packed(&samples, 2);
        let words: Vec<u16> = bytemuck::pod_collect_to_vec(&bytes);
        assert_eq!(words.iter().map(|&w| f32::from(w) + bias).collect::<Vec<_>>(), [-32768.0, -1.0, 32767.0]);
        let samples = Samples::F64(vec![0.5, f64::NAN].into());
        let (bytes, _) = packed(&samples, 4);
        let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        assert!(floats[0] == 0.5 && floats[1].is_nan());
    }
}
