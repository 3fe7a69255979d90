//! What of an octree a transfer function shows, found on the device: `shaders/activity.wgsl`, the twin of `octree::Activity`.

use super::context::{Context, GpuError};
use super::march::{Marcher, compute_pipeline, copy_for_reading, init_buffer, layout_of, nodes_type};
use super::shader::{self, NodeStorage};
use super::surface::storage_buffer;
use super::timing::Timestamps;
use super::volume::OctreeVolume;
use super::voxels::VoxelTexture;
use crate::octree::{ActiveBox, Activity, OctreeTexture, Split};
use crate::optics::{Classifier, Style};
use crate::view::{Intervals, RenderSettings, Skip};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Lanes of a workgroup, a block each.
const LANES: u32 = 64;
/// Workgroups along x of a dispatch, which every adapter allows.
const ROW_GROUPS: u32 = 65_535;
/// Bytes between the uniforms of two levels: the largest alignment that an adapter may ask for.
const LEVEL_STRIDE: u64 = 256;
/// Bits of a coordinate of the grid of clearances, or the octree's levels if those are fewer. The twin of `shaders/shared/clearance.wgsl`.
pub const CLEARANCE_BITS: u32 = 6;
/// No box is larger than a cell of this depth, so that those of one draw are of much the same size.
const LEAST_BOX_DEPTH: u8 = 4;

/// Which nodes of a volume are active.
#[derive(Debug)]
pub(super) struct DeviceActivity {
    /// One word a block.
    pub masks: wgpu::Buffer,
    /// How far around each cell of a coarse grid nothing is active, one word a cell.
    pub clearance: wgpu::Buffer,
    /// Clearances on their way.
    half_done: wgpu::Buffer,
    /// Bits of a coordinate of that grid.
    grid_bits: u32,
    /// First block and number of blocks of each level, and after them the bits of the coarse grid, [`LEVEL_STRIDE`] apart.
    levels: wgpu::Buffer,
    level_blocks: Vec<u32>,
    shown: Mutex<Shown>,
}

/// What the masks stand for, and what was made of them.
#[derive(Debug, Default)]
pub(super) struct Shown {
    /// The values that are seen; `None` before the first time.
    seen: Option<Vec<[f32; 2]>>,
    host: Option<Activity>,
    split: Option<Split>,
    boxes: Option<Boxes>,
    encoded: Option<VoxelTexture>,
}

/// What a march wants of what is active, besides the masks.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wants {
    pub split: bool,
    pub boxes: bool,
    pub voxels: bool,
    pub encoded: bool,
}

impl Wants {
    /// What a march through a volume with these settings wants.
    pub fn of(volume: &OctreeVolume, settings: &RenderSettings) -> Self {
        let is_through_voxels = volume.is_marched_through_voxels(settings);
        Wants {
            split: settings.skip() == Skip::Half,
            boxes: settings.skip().parts().is_some() && settings.intervals == Intervals::Raster,
            voxels: is_through_voxels && settings.skip() != Skip::Encoding,
            encoded: is_through_voxels && settings.skip() == Skip::Encoding,
        }
    }
}

/// Keeps a volume's masks as they are while it lives; none where nothing depends on them.
pub(super) type Held<'a> = Option<MutexGuard<'a, Shown>>;

/// What was asked for.
#[derive(Debug, Default)]
pub(super) struct Given<'a> {
    /// The masks stay as they are until it goes: work that needs them must be submitted before.
    pub shown: Held<'a>,
    pub split: Option<Split>,
    pub boxes: Option<Boxes>,
    pub voxels: Option<VoxelTexture>,
}

/// Boxes of all that is active, on the device.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    pub buffer: wgpu::Buffer,
    pub count: u32,
}

impl Boxes {
    fn upload(context: &Context, boxes: &[ActiveBox]) -> Result<Self, GpuError> {
        let words: Vec<[u32; 4]> = boxes.iter().map(|b| [b.low.x, b.low.y, b.low.z, b.size]).collect();
        let buffer = storage_buffer(context, "boxes", &words, || format!("{} boxes", words.len()))?;
        Ok(Boxes { buffer, count: words.len() as u32 })
    }
}

impl DeviceActivity {
    /// Room for the masks of a texture.
    pub fn new(context: &Context, texture: &OctreeTexture) -> Result<Self, GpuError> {
        let level_blocks = texture.level_blocks().to_vec();
        let grid_bits = u32::from(texture.depth()).min(CLEARANCE_BITS);
        let mut levels = vec![0u8; LEVEL_STRIDE as usize * level_blocks.len() + 8];
        levels[LEVEL_STRIDE as usize * level_blocks.len()..].copy_from_slice(bytemuck::bytes_of(&[grid_bits, 0]));
        let mut first = 0;
        for (&count, bytes) in level_blocks.iter().zip(levels.chunks_mut(LEVEL_STRIDE as usize)) {
            bytes[..8].copy_from_slice(bytemuck::bytes_of(&[first, count]));
            first += count;
        }
        // A marcher that is given no parts binds the masks in their place: they have room for one.
        let size = (4 * u64::from(first)).max(8);
        let what = || format!("what is active of an octree of {first} blocks");
        let limits = context.device.limits();
        context.check_limit(what, size, "max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let masks = wgpu::BufferDescriptor { label: Some("activity"), size, usage, mapped_at_creation: false };
        let grid = wgpu::BufferDescriptor { label: Some("clearance"), size: 4 << (3 * grid_bits), ..masks.clone() };
        context.scoped(|| DeviceActivity {
            masks: context.device.create_buffer(&masks),
            clearance: context.device.create_buffer(&grid),
            half_done: context.device.create_buffer(&grid),
            grid_bits,
            levels: init_buffer(&context.device, "levels", &levels, wgpu::BufferUsages::UNIFORM),
            level_blocks,
            shown: Mutex::default(),
        })
    }

    /// Has the next march find anew what is active. None begins before the guard goes.
    pub fn forget(&self) -> MutexGuard<'_, Shown> {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        *shown = Shown::default();
        shown
    }

    /// Bytes of masks and clearances.
    pub fn bytes(&self) -> u64 {
        self.masks.size() + 2 * self.clearance.size()
    }
}

/// The pipelines that find what is active.
#[derive(Debug)]
pub(super) struct ActivityPass {
    layouts: [wgpu::BindGroupLayout; 2],
    /// By storage and by whether leaves have samples at their corners; each is made when it is first needed.
    pipelines: Mutex<HashMap<(NodeStorage, bool), Pipelines>>,
}

/// Those of one form of volume.
#[derive(Debug, Clone)]
struct Pipelines {
    level: wgpu::ComputePipeline,
    /// What is occupied of the coarse grid, and clearances along x, y, z.
    grid: [wgpu::ComputePipeline; 4],
}

impl ActivityPass {
    /// Nothing is compiled yet.
    pub fn new(device: &wgpu::Device) -> Self {
        let layouts = [NodeStorage::Buffer, NodeStorage::Texture].map(|storage| layout(device, storage));
        ActivityPass { layouts, pipelines: Mutex::default() }
    }

    /// Sees to it that the masks of a volume are those of the values in `seen` for work that is submitted while what is given lives. What is asked
    /// for besides is made on the host when it is first asked for.
    pub fn show<'a>(&self, context: &Context, volume: &'a OctreeVolume, seen: Vec<[f32; 2]>, wants: Wants) -> Result<Given<'a>, GpuError> {
        let mut guard = volume.activity.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let shown = &mut *guard;
        if shown.seen.as_ref() != Some(&seen) {
            self.submit(context, volume, &seen, None)?;
            *shown = Shown { seen: Some(seen.clone()), ..Shown::default() };
        }
        let texture = &volume.texture;
        let mut given = Given::default();
        if wants.voxels {
            given.voxels = Some(volume.voxels(context)?);
        }
        if !(wants.split || wants.boxes || wants.encoded) {
            return Ok(Given { shown: Some(guard), ..given });
        }
        let activity = shown.host.get_or_insert_with(|| Activity::new(texture, &seen));
        if wants.split {
            given.split = Some(*shown.split.get_or_insert_with(|| activity.split(texture)));
        }
        if wants.boxes {
            let boxes = match shown.boxes.take() {
                Some(boxes) => boxes,
                None => Boxes::upload(context, &activity.boxes(texture, LEAST_BOX_DEPTH))?,
            };
            given.boxes = Some(shown.boxes.insert(boxes).clone());
        }
        if wants.encoded {
            let encoded = match shown.encoded.take() {
                Some(encoded) => encoded,
                None => VoxelTexture::encoded(context, texture, activity)?,
            };
            given.voxels = Some(shown.encoded.insert(encoded).clone());
        }
        Ok(Given { shown: Some(guard), ..given })
    }

    /// Submits the work that finds what is active, with timestamps round it if they are given.
    pub fn submit(
        &self,
        context: &Context,
        volume: &OctreeVolume,
        seen: &[[f32; 2]],
        timestamps: Option<&Timestamps>,
    ) -> Result<(), GpuError> {
        let activity = &volume.activity;
        let mut words = vec![[seen.len() as f32, 0.0]];
        words.extend_from_slice(seen);
        context.scoped(|| {
            let device = &context.device;
            let storage = volume.storage() as usize;
            let seen = init_buffer(device, "seen", bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE);
            let level = wgpu::BufferBinding { buffer: &activity.levels, offset: 0, size: wgpu::BufferSize::new(8) };
            let [nodes, bricks] = volume.node_bindings();
            let bindings = [
                (0, wgpu::BindingResource::Buffer(level)),
                (1, nodes),
                (2, seen.as_entire_binding()),
                (7, bricks),
                (15, activity.masks.as_entire_binding()),
                (21, activity.clearance.as_entire_binding()),
                (22, activity.half_done.as_entire_binding()),
            ];
            let entries = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
            let layout = &self.layouts[storage];
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("activity"), layout, entries: &entries });
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let timestamp_writes = timestamps.map(|t| t.compute(true, true));
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("activity"), timestamp_writes });
            let pipelines = self.pipelines(device, volume.storage(), volume.continuous);
            pass.set_pipeline(&pipelines.level);
            for (level, &blocks) in activity.level_blocks.iter().enumerate().rev() {
                pass.set_bind_group(0, &bind_group, &[level as u32 * LEVEL_STRIDE as u32]);
                let groups = blocks.div_ceil(LANES);
                pass.dispatch_workgroups(groups.min(ROW_GROUPS), groups.div_ceil(ROW_GROUPS), 1);
            }
            pass.set_bind_group(0, &bind_group, &[activity.level_blocks.len() as u32 * LEVEL_STRIDE as u32]);
            for pipeline in &pipelines.grid {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups((1u32 << (3 * activity.grid_bits)).div_ceil(LANES), 1, 1);
            }
            drop(pass);
            if let Some(timestamps) = timestamps {
                timestamps.resolve(&mut encoder);
            }
            context.queue.submit([encoder.finish()]);
        })
    }
}

fn layout(device: &wgpu::Device, storage: NodeStorage) -> wgpu::BindGroupLayout {
    let buffer = |ty, has_dynamic_offset| wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
    let read = buffer(wgpu::BufferBindingType::Storage { read_only: true }, false);
    let nodes = nodes_type(storage);
    let write = buffer(wgpu::BufferBindingType::Storage { read_only: false }, false);
    let level = buffer(wgpu::BufferBindingType::Uniform, true);
    // level, nodes, seen, bricks, activity, clearance, half_done.
    let types = [(0, level), (1, nodes), (2, read), (7, nodes), (15, write), (21, write), (22, write)];
    layout_of("activity", device, wgpu::ShaderStages::COMPUTE, &types)
}

impl ActivityPass {
    fn pipelines(&self, device: &wgpu::Device, storage: NodeStorage, continuous: bool) -> Pipelines {
        let made = || self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipelines) = made().get(&(storage, continuous)) {
            return pipelines.clone();
        }
        // Nobody who asks whether they are there waits until they are.
        let row = f64::from(LANES * ROW_GROUPS);
        let constants = [("lanes", f64::from(LANES)), ("row", row), ("continuous", f64::from(u8::from(continuous)))];
        let source = shader::source("activity.wgsl", storage);
        let layout = &self.layouts[storage as usize];
        let pipeline = |entry: &str| compute_pipeline(device, layout, &source, "activity.wgsl", entry, &constants);
        let pipelines = Pipelines { level: pipeline("main"), grid: ["occupy", "widen_x", "widen_y", "widen_z"].map(pipeline) };
        made().entry((storage, continuous)).or_insert(pipelines).clone()
    }

    /// Whether the shaders for a volume of this form are compiled.
    pub fn is_ready(&self, volume: &OctreeVolume) -> bool {
        self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&(volume.storage(), volume.continuous))
    }

    /// Compiles them.
    pub fn prepare(&self, device: &wgpu::Device, volume: &OctreeVolume) {
        drop(self.pipelines(device, volume.storage(), volume.continuous));
    }
}

impl Marcher {
    /// Seconds by the clock of all that a march with these settings needs to be made anew when another transfer function shows other
    /// values: what is active, the plane, the boxes or the encoded volume.
    pub fn time_preparation(
        &self,
        context: &Context,
        volume: &OctreeVolume,
        classifier: &Classifier,
        settings: &RenderSettings,
    ) -> Result<f64, GpuError> {
        drop(volume.activity.forget());
        let settings = &settings.for_octree(volume.continuous);
        let start = Instant::now();
        if settings.skip() != Skip::None {
            let seen = Style::seen_with(settings, classifier, volume.root_edge);
            drop(self.activity.show(context, volume, seen, Wants::of(volume, settings))?);
            context.wait()?;
        }
        Ok(start.elapsed().as_secs_f64())
    }

    /// What a transfer function makes active of a volume: the masks of [`Activity`], found on the device and read back.
    pub fn active_masks(&self, context: &Context, volume: &OctreeVolume, classifier: &Classifier) -> Result<Vec<u32>, GpuError> {
        let _given = self.activity.show(context, volume, classifier.table(volume.root_edge).seen(), Wants::default())?;
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let copy = context.scoped(|| copy_for_reading(&context.device, &mut encoder, &volume.activity.masks))?;
        context.scoped(|| context.queue.submit([encoder.finish()]))?;
        Ok(bytemuck::pod_collect_to_vec(&context.read(&copy)?))
    }
}
