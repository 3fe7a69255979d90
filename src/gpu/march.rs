//! The march over the octree texture, `shaders/march_leaf.wgsl` and `shaders/march_paper.wgsl`: the twin of `cpu::march`.
//!
//! It is a compute pass: on some GPUs only a few multiprocessors run fragment shaders (maths 8).

use super::context::{Context, GpuError};
use super::layout::{Counter, Frame};
use super::shader::{self, NodeStorage};
use super::target::Target;
use super::timing::Timestamps;
use super::volume::{Nodes, OctreeVolume};
use crate::image::Image;
use crate::optics::{Classifier, psi_table};
use crate::view::{RayFrame, RenderSettings, Steps};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use wgpu::util::DeviceExt;

/// Pixels along each side of the square that a workgroup marches.
const TILE: u32 = 8;

/// The pipelines of the march.
#[derive(Debug)]
pub struct Marcher {
    /// Layouts for a volume of buffers, and of textures.
    layouts: [wgpu::BindGroupLayout; 2],
    /// Each is made when it is first needed.
    pipelines: Mutex<HashMap<Variant, wgpu::ComputePipeline>>,
    psi: wgpu::Buffer,
}

/// What a pipeline is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    steps: Steps,
    storage: NodeStorage,
    continuous: bool,
    clipped: bool,
}

/// An image made on the GPU.
#[derive(Debug, Clone, PartialEq)]
pub struct GpuFrame {
    /// Linear premultiplied RGBA, row 0 at the top.
    pub image: Image,
    /// Look-ups that found a full leaf, counted as `cpu::march` does.
    pub samples: u64,
    /// Seconds on the GPU by its timestamps round the pass; `None` where they cannot be trusted.
    pub gpu_s: Option<f64>,
    /// Seconds from submission to the end of the work on the GPU, the copy for the readback included.
    pub wall_s: f64,
}

impl Marcher {
    /// Makes what all frames share; shaders are compiled when they are first needed.
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        context.scoped(|| Marcher {
            layouts: [NodeStorage::Buffer, NodeStorage::Texture].map(|storage| layout(&context.device, storage)),
            pipelines: Mutex::default(),
            psi: init_buffer(&context.device, "psi", bytemuck::cast_slice(psi_table()), wgpu::BufferUsages::STORAGE),
        })
    }

    /// Records the march of one frame into `target`, which must have the frame's size. Nothing is read back: the window samples the
    /// target in a later pass. Errors of the submission itself are the caller's to find ([`Context::take_error`]).
    pub fn encode(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        volume: &OctreeVolume,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
        target: &Target,
    ) -> Result<(), GpuError> {
        self.encode_timed(context, encoder, volume, frame, classifier, settings, target, None).map(drop)
    }

    /// [`Marcher::encode`] with timestamps round the pass; gives the buffer that will hold the [`Counter`].
    pub(super) fn encode_timed(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        volume: &OctreeVolume,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
        target: &Target,
        timestamps: Option<&Timestamps>,
    ) -> Result<wgpu::Buffer, GpuError> {
        if target.size() != [frame.width, frame.height] {
            return Err(GpuError::TargetSize { image: [frame.width, frame.height], target: target.size() });
        }
        let groups = [frame.width.div_ceil(TILE), frame.height.div_ceil(TILE)];
        let limit = context.device.limits().max_compute_workgroups_per_dimension;
        let what = || format!("marching {}x{} pixels", frame.width, frame.height);
        let need = u64::from(groups[0].max(groups[1]));
        context.check_limit(what, need, "max_compute_workgroups_per_dimension", u64::from(limit))?;

        let uniforms = Frame::new(frame, volume.root_min, volume.root_edge, volume.depth, settings);
        let table = classifier.table(volume.root_edge);
        let (storage, continuous, clipped) = (volume.storage(), volume.continuous, volume.clipped);
        let variant = Variant { steps: settings.steps, storage, continuous, clipped };
        let (nodes, bricks) = match &volume.nodes {
            Nodes::Buffer(nodes, bricks) => (nodes.as_entire_binding(), bricks.as_entire_binding()),
            Nodes::Texture(nodes, bricks) => {
                (wgpu::BindingResource::TextureView(nodes), wgpu::BindingResource::TextureView(bricks))
            }
        };
        let [surface_nodes, surface_faces, surface_vertices] = volume.surface.bindings();
        context.scoped(|| {
            let device = &context.device;
            let layout = self.layout(storage);
            let pipeline = self.pipeline(device, variant);
            let init = |label, contents, usage| init_buffer(device, label, contents, usage);
            let storage = wgpu::BufferUsages::STORAGE;
            let uniforms = init("frame", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
            let knots = init("knots", bytemuck::cast_slice(&table.knots), storage);
            let knot_index = init("knot index", bytemuck::cast_slice(&table.index), storage);
            let counter = init("counter", bytemuck::bytes_of(&Counter::default()), storage | wgpu::BufferUsages::COPY_SRC);
            let resources = [
                uniforms.as_entire_binding(),
                nodes,
                knots.as_entire_binding(),
                knot_index.as_entire_binding(),
                self.psi.as_entire_binding(),
                wgpu::BindingResource::TextureView(target.view()),
                counter.as_entire_binding(),
                bricks,
                surface_nodes,
                surface_faces,
                surface_vertices,
            ];
            let entries: Vec<_> = (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("march"), layout, entries: &entries });
            let timestamp_writes = timestamps.map(Timestamps::round_pass);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("march"), timestamp_writes });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            drop(pass);
            counter
        })
    }

    /// Marches one frame and reads it back.
    pub fn render(
        &self,
        context: &Context,
        volume: &OctreeVolume,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
    ) -> Result<GpuFrame, GpuError> {
        let target = Target::new(context, frame.width, frame.height)?;
        let pixels = target.readback_buffer(context)?;
        let timestamps = Timestamps::new(context)?;
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let counter = self.encode_timed(context, &mut encoder, volume, frame, classifier, settings, &target, timestamps.as_ref())?;
        let samples = context.scoped(|| {
            target.copy_to(&mut encoder, &pixels);
            if let Some(timestamps) = &timestamps {
                timestamps.resolve(&mut encoder);
            }
            copy_for_reading(&context.device, &mut encoder, &counter)
        })?;
        let start = Instant::now();
        context.scoped(|| context.queue.submit([encoder.finish()]))?;
        context.wait()?;
        let wall_s = start.elapsed().as_secs_f64();
        Ok(GpuFrame {
            image: target.image(&context.read(&pixels)?),
            samples: bytemuck::pod_read_unaligned::<Counter>(&context.read(&samples)?).total(),
            gpu_s: timestamps.map(|t| t.read_s(context)).transpose()?,
            wall_s,
        })
    }
}

impl Marcher {
    fn layout(&self, storage: NodeStorage) -> &wgpu::BindGroupLayout {
        &self.layouts[usize::from(storage == NodeStorage::Texture)]
    }

    fn pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::ComputePipeline {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        pipelines.entry(variant).or_insert_with(|| pipeline(device, self.layout(variant.storage), variant)).clone()
    }
}

fn layout(device: &wgpu::Device, storage: NodeStorage) -> wgpu::BindGroupLayout {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    let nodes = match storage {
        NodeStorage::Buffer => read,
        NodeStorage::Texture => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D3,
            multisampled: false,
        },
    };
    let image = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: wgpu::TextureFormat::Rgba32Float,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    // In the order of their numbers: frame, nodes, knots, knot_index, psi_table, image, counter, bricks, surface_nodes, surface_faces,
    // surface_vertices.
    let types = [
        buffer(wgpu::BufferBindingType::Uniform),
        nodes,
        read,
        read,
        read,
        image,
        buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        nodes,
        read,
        read,
        read,
    ];
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("march"), entries: &entries })
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, variant: Variant) -> wgpu::ComputePipeline {
    let stage = match variant.steps {
        Steps::Leaf => "march_leaf.wgsl",
        Steps::Paper => "march_paper.wgsl",
    };
    let source = wgpu::ShaderSource::Wgsl(shader::source(stage, variant.storage).into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(stage), source });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(stage),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let flag = |set: bool| f64::from(u8::from(set));
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(stage),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &[("tile", f64::from(TILE)), ("continuous", flag(variant.continuous)), ("clipped", flag(variant.clipped))],
            zero_initialize_workgroup_memory: true,
        },
        cache: None,
    })
}

fn init_buffer(device: &wgpu::Device, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
}

/// Records a copy of all of `buffer` to one that can be mapped.
pub(super) fn copy_for_reading(device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let descriptor = wgpu::BufferDescriptor { label: Some("readback"), size: buffer.size(), usage, mapped_at_creation: false };
    let mappable = device.create_buffer(&descriptor);
    encoder.copy_buffer_to_buffer(buffer, 0, &mappable, 0, buffer.size());
    mappable
}
