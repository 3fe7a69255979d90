//! Where rays begin and end: `shaders/intervals.wgsl`, which follows each ray, and `shaders/boxes.wgsl`, which rasterises the boxes of what
//! is active.

use super::activity::Boxes;
use super::context::{Context, GpuError};
use super::march::{TILE, compute_pipeline, init_buffer, layout_of, nodes_type};
use super::shader::{self, NodeStorage};
use super::timing::Timestamps;
use super::volume::OctreeVolume;
use crate::view::RayFrame;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Mat3};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// The words of the parts of an image's rays.
#[derive(Debug, Clone)]
pub(super) struct PartWords {
    pub buffer: wgpu::Buffer,
    size: [u32; 2],
    parts: u32,
    /// What the boxes are drawn on: nothing is written to it, but a pass must have one.
    canvas: wgpu::TextureView,
}

/// Storage, numbers of parts and of planes that clip, and entry point.
type Stage = (NodeStorage, [u32; 2], &'static str);

/// The pipelines that find intervals.
#[derive(Debug)]
pub(super) struct IntervalPass {
    layouts: [wgpu::BindGroupLayout; 2],
    pipelines: Mutex<HashMap<Stage, wgpu::ComputePipeline>>,
    /// By numbers of parts and of planes that clip. Adapters that cannot write from fragment shaders do without.
    box_pipelines: Mutex<HashMap<[u32; 2], (wgpu::BindGroupLayout, wgpu::RenderPipeline)>>,
    /// Those used last: images mostly keep their size.
    words: Mutex<Option<PartWords>>,
}

/// How points of the cube lie in the image: `Placing` in `shaders/shared/placing.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Placing {
    /// Columns, each filled to 16 bytes.
    pub to_image: [[f32; 4]; 3],
    /// Of w.
    pub w: [f32; 2],
    /// A pixel's size where w is 1.
    pub pixel: f32,
    /// Fills the struct to a multiple of 16 bytes.
    pub _pad: f32,
}

const CANVAS_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

impl Placing {
    /// The places of points relative to where the middle ray crosses the cube's centre plane, in edges of the cube.
    pub fn new(frame: &RayFrame, cube_min: DVec3, cube_edge: f64) -> Self {
        let is_parallel = frame.right == DVec3::ZERO;
        let (right, up) = if is_parallel { (frame.right_origin / cube_edge, frame.up_origin / cube_edge) } else { (frame.right, frame.up) };
        let eye_distance = f64::from(crate::view::CubeRays::new(frame, cube_min, cube_edge).eye_distance);
        let columns = Mat3::from_cols_array(&DMat3::from_cols(right, up, frame.forward).inverse().to_cols_array().map(|x| x as f32));
        Placing {
            to_image: [columns.x_axis, columns.y_axis, columns.z_axis].map(|column| column.extend(0.0).to_array()),
            w: if is_parallel { [1.0, 0.0] } else { [eye_distance as f32, 1.0] },
            pixel: (2.0 * right.length() / f64::from(frame.width)).max(2.0 * up.length() / f64::from(frame.height)) as f32,
            _pad: 0.0,
        }
    }
}

impl IntervalPass {
    /// Pipelines are made when they are first needed.
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
        let write = buffer(wgpu::BufferBindingType::Storage { read_only: false });
        let uniform = buffer(wgpu::BufferBindingType::Uniform);
        let layouts = [NodeStorage::Buffer, NodeStorage::Texture].map(|storage| {
            // frame, nodes, activity, part_words.
            let types = [(0, uniform), (1, nodes_type(storage)), (15, read), (16, write)];
            layout_of("intervals", device, wgpu::ShaderStages::COMPUTE, &types)
        });
        IntervalPass { layouts, pipelines: Mutex::default(), box_pipelines: Mutex::default(), words: Mutex::default() }
    }

    /// Room for the parts of each pixel's ray, 8 bytes a part.
    pub fn words(&self, context: &Context, size: [u32; 2], parts: u32) -> Result<PartWords, GpuError> {
        let mut words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(words) = words.as_ref().filter(|words| words.size == size && words.parts == parts) {
            return Ok(words.clone());
        }
        let bytes = 8 * u64::from(size[0]) * u64::from(size[1]) * u64::from(parts);
        let limits = context.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let what = || format!("{parts} parts of the rays of {}x{} pixels", size[0], size[1]);
        context.check_limit(what, bytes, "max_storage_buffer_binding_size", limit)?;
        let usage = wgpu::BufferUsages::STORAGE;
        let descriptor = wgpu::BufferDescriptor { label: Some("parts"), size: bytes, usage, mapped_at_creation: false };
        let canvas = wgpu::TextureDescriptor {
            label: Some("canvas"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: CANVAS_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        };
        let made = context.scoped(|| PartWords {
            buffer: context.device.create_buffer(&descriptor),
            size,
            parts,
            canvas: context.device.create_texture(&canvas).create_view(&wgpu::TextureViewDescriptor::default()),
        })?;
        Ok(words.insert(made).clone())
    }

    /// Records the passes that fill the words: by the boxes, if there are any to draw, else ray by ray.
    pub fn encode(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        volume: &OctreeVolume,
        frame: &wgpu::Buffer,
        clip_planes: u32,
        words: &PartWords,
        boxes: Option<(&Boxes, Placing)>,
        timestamps: Option<&Timestamps>,
    ) {
        let device = &context.device;
        let pipeline = self.compute(device, volume.storage(), [words.parts, clip_planes], entry_point(boxes.is_some()));
        let bindings = [
            (0, frame.as_entire_binding()),
            (1, volume.node_bindings()[0].clone()),
            (15, volume.activity.masks.as_entire_binding()),
            (16, words.buffer.as_entire_binding()),
        ];
        let entries = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        let layout = &self.layouts[volume.storage() as usize];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("intervals"), layout, entries: &entries });
        let timestamp_writes = timestamps.map(|t| t.intervals(true, boxes.is_none()));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("intervals"), timestamp_writes });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(words.size[0].div_ceil(TILE), words.size[1].div_ceil(TILE), 1);
        drop(pass);
        if let Some((boxes, placing)) = boxes {
            self.draw(context, encoder, frame, clip_planes, words, boxes, placing, timestamps);
        }
    }

    fn draw(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::Buffer,
        clip_planes: u32,
        words: &PartWords,
        boxes: &Boxes,
        placing: Placing,
        timestamps: Option<&Timestamps>,
    ) {
        let device = &context.device;
        let (layout, pipeline) = self.boxes(device, [words.parts, clip_planes]);
        let placing = init_buffer(device, "placing", bytemuck::bytes_of(&placing), wgpu::BufferUsages::UNIFORM);
        let bindings = [
            (0, frame.as_entire_binding()),
            (16, words.buffer.as_entire_binding()),
            (17, boxes.buffer.as_entire_binding()),
            (18, placing.as_entire_binding()),
        ];
        let entries = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("boxes"), layout: &layout, entries: &entries });
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard };
        let canvas = wgpu::RenderPassColorAttachment { view: &words.canvas, depth_slice: None, resolve_target: None, ops };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("boxes"),
            color_attachments: &[Some(canvas)],
            timestamp_writes: timestamps.map(Timestamps::boxes),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..36, 0..boxes.count);
    }

    fn compute(
        &self,
        device: &wgpu::Device,
        storage: NodeStorage,
        [parts, clip_planes]: [u32; 2],
        entry: &'static str,
    ) -> wgpu::ComputePipeline {
        let made = || self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let stage = (storage, [parts, clip_planes], entry);
        if let Some(pipeline) = made().get(&stage) {
            return pipeline.clone();
        }
        let constants = [("tile", f64::from(TILE)), ("parts", f64::from(parts)), ("clip_planes", f64::from(clip_planes))];
        let source = shader::source("intervals.wgsl", storage);
        let pipeline = compute_pipeline(device, &self.layouts[storage as usize], &source, "intervals.wgsl", entry, &constants);
        made().entry(stage).or_insert(pipeline).clone()
    }

    fn boxes(&self, device: &wgpu::Device, of: [u32; 2]) -> (wgpu::BindGroupLayout, wgpu::RenderPipeline) {
        let made = || self.box_pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made().get(&of) {
            return pipeline.clone();
        }
        let pipeline = box_pipeline(device, of);
        made().entry(of).or_insert(pipeline).clone()
    }

    /// Whether the shaders are compiled that find this many parts, from boxes or ray by ray.
    pub fn is_ready(&self, storage: NodeStorage, of: [u32; 2], from_boxes: bool) -> bool {
        let is_made = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&(storage, of, entry_point(from_boxes)));
        is_made && (!from_boxes || self.box_pipelines.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&of))
    }

    /// Compiles them.
    pub fn prepare(&self, device: &wgpu::Device, storage: NodeStorage, of: [u32; 2], from_boxes: bool) {
        drop(self.compute(device, storage, of, entry_point(from_boxes)));
        if from_boxes {
            drop(self.boxes(device, of));
        }
    }
}

/// Where the shader begins that clears the words for boxes, or finds parts ray by ray.
fn entry_point(from_boxes: bool) -> &'static str {
    if from_boxes { "clear" } else { "main" }
}

fn box_pipeline(device: &wgpu::Device, [parts, clip_planes]: [u32; 2]) -> (wgpu::BindGroupLayout, wgpu::RenderPipeline) {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    let write = buffer(wgpu::BufferBindingType::Storage { read_only: false });
    let uniform = buffer(wgpu::BufferBindingType::Uniform);
    // Vertex shaders may not write, and all of these are seen by both stages but the words.
    let visible = |binding, ty, visibility| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let both = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let entries = [
        visible(0, uniform, both),
        visible(16, write, wgpu::ShaderStages::FRAGMENT),
        visible(17, read, both),
        visible(18, uniform, wgpu::ShaderStages::VERTEX),
    ];
    let box_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("boxes"), entries: &entries });
    let source = wgpu::ShaderSource::Wgsl(shader::source("boxes.wgsl", NodeStorage::Buffer).into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("boxes.wgsl"), source });
    let layouts = [Some(&box_layout)];
    let descriptor = wgpu::PipelineLayoutDescriptor { label: Some("boxes"), bind_group_layouts: &layouts, immediate_size: 0 };
    let layout = device.create_pipeline_layout(&descriptor);
    let constants = [("parts", f64::from(parts)), ("clip_planes", f64::from(clip_planes))];
    let compilation_options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
    let target = wgpu::ColorTargetState { format: CANVAS_FORMAT, blend: None, write_mask: wgpu::ColorWrites::empty() };
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("boxes"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("place"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Front), ..Default::default() },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState { module: &module, entry_point: Some("widen"), compilation_options, targets: &[Some(target)] }),
        multiview_mask: None,
        cache: None,
    });
    (box_layout, pipeline)
}
