//! The march over the octree texture, `shaders/march_leaf.wgsl`, `march_paper.wgsl`, `march_fixed.wgsl` and
//! `march_voxels.wgsl`: the twin of `cpu::march`. And that through
//! the mesh itself, `shaders/march_exact.wgsl`.
//!
//! It is a compute pass: on some GPUs only a few multiprocessors run fragment shaders (maths 8).

use super::activity::{ActivityPass, Given, Held, Wants};
use super::context::{Context, GpuError};
use super::cut_edges::EdgePass;
use super::exact_mesh::ExactMesh;
use super::intervals::{IntervalPass, PartWords, Placing};
use super::layout::{Counter, Frame};
use super::shader::{self, NodeStorage};
use super::surface::GpuSurface;
use super::target::Target;
use super::timing::Timestamps;
use super::volume::OctreeVolume;
use crate::image::Image;
use crate::optics::{Classifier, Style, psi_table};
use crate::view::{Mode, Output, RayFrame, RenderSettings, Skip, Steps};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use wgpu::util::DeviceExt;

/// Pixels along each side of the square that a workgroup marches.
pub(super) const TILE: u32 = 8;

/// The pipelines of the march.
#[derive(Debug)]
pub struct Marcher {
    /// Layouts by [`Data`].
    layouts: [wgpu::BindGroupLayout; 5],
    /// Each is made when it is first needed.
    pipelines: Mutex<HashMap<Variant, wgpu::ComputePipeline>>,
    psi: wgpu::Buffer,
    pub(super) activity: ActivityPass,
    intervals: IntervalPass,
    edges: EdgePass,
}

/// What a march goes through.
#[derive(Debug, Clone, Copy)]
pub enum Marched<'a> {
    /// An octree texture.
    Octree(&'a OctreeVolume),
    /// The mesh itself.
    Exact(&'a ExactMesh),
}

/// What a pipeline is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    through: Through,
    mode: Mode,
    output: Output,
    with_surfaces: bool,
    shade_volume: bool,
    shade_surfaces: bool,
    faces: bool,
    /// How many planes clip, and how many are drawn.
    planes: [u32; 2],
    isosurfaces: u32,
}

/// What of it is about the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Through {
    Octree { steps: Steps, storage: NodeStorage, continuous: bool, clipped: bool, voxels: bool, skip: Skip },
    Exact { on_cells: bool },
}

impl<'a> From<&'a OctreeVolume> for Marched<'a> {
    fn from(volume: &'a OctreeVolume) -> Self {
        Marched::Octree(volume)
    }
}

impl<'a> From<&'a ExactMesh> for Marched<'a> {
    fn from(mesh: &'a ExactMesh) -> Self {
        Marched::Exact(mesh)
    }
}

impl<'a> Marched<'a> {
    /// Lowest corner and edge of the root cube, and the levels of an octree in it.
    fn cube(self) -> (DVec3, f64, u8) {
        match self {
            Marched::Octree(volume) => (volume.root_min, volume.root_edge, volume.depth),
            Marched::Exact(mesh) => (mesh.cube_min, mesh.cube_edge, 1),
        }
    }

    /// The settings as they are taken.
    fn settings(self, settings: &RenderSettings) -> RenderSettings {
        match self {
            Marched::Octree(volume) => settings.for_octree(volume.continuous).with_edges(!volume.surface.is_box),
            Marched::Exact(_) => *settings,
        }
    }

    fn variant(self, settings: &RenderSettings) -> Variant {
        let settings = &self.settings(settings);
        let with_surfaces = settings.with_surfaces();
        let ends_at_surface = matches!(self, Marched::Exact(_) | Marched::Octree(OctreeVolume { clipped: true, .. }));
        let faces = settings.drawn_faces().is_some() && ends_at_surface;
        Variant {
            faces,
            through: self.through(settings),
            mode: settings.mode,
            output: settings.output,
            with_surfaces,
            shade_volume: settings.is_volume_shaded(),
            shade_surfaces: (with_surfaces || faces) && settings.shading.surfaces,
            planes: settings.planes.counts(),
            isosurfaces: settings.surfaces().iter().count() as u32,
        }
    }

    fn through(self, settings: &RenderSettings) -> Through {
        match self {
            Marched::Octree(volume) => Through::Octree {
                steps: settings.steps,
                storage: volume.storage(),
                continuous: volume.continuous,
                clipped: volume.clipped,
                voxels: volume.is_marched_through_voxels(settings),
                skip: match settings.skip() {
                    Skip::Encoding if !volume.is_marched_through_voxels(settings) => Skip::Octree,
                    // What a ray is cut into is all that matters to the march.
                    skip => skip.parts().map_or(skip, Skip::Parts),
                },
            },
            Marched::Exact(mesh) => Through::Exact { on_cells: mesh.on_cells },
        }
    }

    /// The data's own bindings.
    fn bindings(self) -> Vec<(u32, wgpu::BindingResource<'a>)> {
        match self {
            Marched::Octree(volume) => {
                let [nodes, bricks] = volume.node_bindings();
                let masks = volume.activity.masks.as_entire_binding();
                let surface = (GpuSurface::FIRST_BINDING..).zip(volume.surface.bindings());
                [(1, nodes), (7, bricks), (15, masks)].into_iter().chain(surface).collect()
            }
            Marched::Exact(mesh) => mesh.bindings(),
        }
    }
}

/// What a frame takes on the GPU, by its timestamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GpuSeconds {
    /// Seconds of all of it.
    pub frame: f64,
    /// Of these, the seconds of the passes that find intervals; 0 if there are none.
    pub intervals: f64,
}

/// An image made on the GPU.
#[derive(Debug, Clone, PartialEq)]
pub struct GpuFrame {
    /// Linear premultiplied RGBA, row 0 at the top.
    pub image: Image,
    /// Look-ups that found a full leaf, counted as `cpu::march` does; of an exact march the tets met, of one through
    /// voxels all samples.
    pub samples: u64,
    /// Seconds on the GPU by its timestamps round the passes; `None` where they cannot be trusted.
    pub gpu_s: Option<GpuSeconds>,
    /// Seconds from submission to the end of the work on the GPU, the copy for the readback included.
    pub wall_s: f64,
}

impl Marcher {
    /// Makes what all frames share; shaders are compiled when they are first needed.
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        context.scoped(|| Marcher {
            layouts: [Data::Buffer, Data::Texture, Data::Exact, Data::BufferAndVoxels, Data::TextureAndVoxels]
                .map(|data| layout(&context.device, data)),
            pipelines: Mutex::default(),
            activity: ActivityPass::new(&context.device),
            intervals: IntervalPass::new(&context.device),
            edges: EdgePass::new(context),
            psi: init_buffer(&context.device, "psi", bytemuck::cast_slice(psi_table()), wgpu::BufferUsages::STORAGE),
        })
    }

    /// Records the march of one frame into `target`, which must have the frame's size. Nothing is read back: the window samples the
    /// target in a later pass. Errors of the submission itself are the caller's to find ([`Context::take_error`]). Where something is skipped,
    /// the work must be submitted before the volume is marched with another transfer function.
    pub fn encode<'a>(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        volume: impl Into<Marched<'a>>,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
        target: &Target,
    ) -> Result<(), GpuError> {
        self.encode_timed(context, encoder, volume.into(), frame, classifier, settings, target, None).map(drop)
    }

    /// [`Marcher::encode`] with timestamps round the passes; gives the buffer that will hold the [`Counter`], and what keeps the octree's
    /// masks as they are until the work is submitted.
    pub(super) fn encode_timed<'a>(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        volume: Marched<'a>,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
        target: &Target,
        timestamps: Option<&Timestamps>,
    ) -> Result<(wgpu::Buffer, Held<'a>), GpuError> {
        if target.size() != [frame.width, frame.height] {
            return Err(GpuError::TargetSize { image: [frame.width, frame.height], target: target.size() });
        }
        let groups = [frame.width.div_ceil(TILE), frame.height.div_ceil(TILE)];
        let limit = context.device.limits().max_compute_workgroups_per_dimension;
        let what = || format!("marching {}x{} pixels", frame.width, frame.height);
        let need = u64::from(groups[0].max(groups[1]));
        context.check_limit(what, need, "max_compute_workgroups_per_dimension", u64::from(limit))?;

        let (cube_min, cube_edge, depth) = volume.cube();
        let table = classifier.table(cube_edge);
        let settings = &volume.settings(&RenderSettings { planes: frame.planes, ..*settings });
        let style = Style::new(settings, classifier, &table, cube_edge);
        let variant = volume.variant(settings);
        let (mut given, mut words) = (Given::default(), None);
        if let (Marched::Octree(volume), true) = (volume, settings.skip() != Skip::None || settings.is_through_voxels()) {
            let parts = settings.skip().parts();
            given = self.activity.show(context, volume, style.seen(settings.mode, &table), Wants::of(volume, settings))?;
            words = parts.map(|parts| self.intervals.words(context, target.size(), parts)).transpose()?;
        }
        let uniforms = Frame::new(frame, cube_min, cube_edge, depth, settings, given.split);
        let counter = context.scoped(|| {
            let device = &context.device;
            let layout = self.layout(variant);
            let pipeline = self.pipeline(device, variant);
            let init = |label, contents, usage| init_buffer(device, label, contents, usage);
            let storage = wgpu::BufferUsages::STORAGE;
            let uniforms = init("frame", bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
            let style = init("style", bytemuck::bytes_of(&style), wgpu::BufferUsages::UNIFORM);
            let knots = init("knots", bytemuck::cast_slice(&table.knots), storage);
            let knot_index = init("knot index", bytemuck::cast_slice(&table.index), storage);
            let counter = init("counter", bytemuck::bytes_of(&Counter::default()), storage | wgpu::BufferUsages::COPY_SRC);
            let shared = [
                (0, uniforms.as_entire_binding()),
                (2, knots.as_entire_binding()),
                (3, knot_index.as_entire_binding()),
                (4, self.psi.as_entire_binding()),
                (5, wgpu::BindingResource::TextureView(target.view())),
                (6, counter.as_entire_binding()),
                (23, style.as_entire_binding()),
            ];
            if let (Marched::Octree(octree), Some(words)) = (volume, &words) {
                let boxes = given.boxes.as_ref().map(|boxes| (boxes, Placing::new(frame, cube_min, cube_edge)));
                self.intervals.encode(context, encoder, octree, &uniforms, variant.planes[0], words, boxes, timestamps);
            }
            let edges = match volume {
                Marched::Octree(octree) => octree.cut_lines_on(&frame.planes),
                Marched::Exact(_) => None,
            };
            let edges = edges.map(|lines| {
                let placing = Placing::new(frame, cube_min, cube_edge);
                self.edges.encode(context, encoder, &lines, &uniforms, placing, target.size())
            });
            let mut bindings: Vec<_> = shared.into_iter().chain(volume.bindings()).collect();
            if let Marched::Octree(octree) = volume {
                // Without parts the words are not read.
                let unread = &octree.activity.masks;
                bindings.push((24, wgpu::BindingResource::TextureView(edges.as_ref().unwrap_or(self.edges.nothing()))));
                bindings.push((16, words.as_ref().map_or(unread, |words: &PartWords| &words.buffer).as_entire_binding()));
            }
            if let Some(voxels) = &given.voxels {
                bindings.extend([(19, wgpu::BindingResource::TextureView(&voxels.index))]);
                bindings.extend([(20, wgpu::BindingResource::TextureView(&voxels.samples))]);
                if let Marched::Octree(octree) = volume {
                    bindings.push((21, octree.activity.clearance.as_entire_binding()));
                }
            }
            let entries: Vec<_> = bindings.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("march"), layout, entries: &entries });
            let timestamp_writes = timestamps.map(|t| t.compute(words.is_none(), true));
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("march"), timestamp_writes });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            drop(pass);
            counter
        })?;
        Ok((counter, given.shown))
    }

    /// Marches one frame and reads it back.
    pub fn render<'a>(
        &self,
        context: &Context,
        volume: impl Into<Marched<'a>>,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
    ) -> Result<GpuFrame, GpuError> {
        let target = Target::new(context, frame.width, frame.height)?;
        let pixels = target.readback_buffer(context)?;
        let timestamps = Timestamps::new(context)?;
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (counter, held) =
            self.encode_timed(context, &mut encoder, volume.into(), frame, classifier, settings, &target, timestamps.as_ref())?;
        let samples = context.scoped(|| {
            target.copy_to(&mut encoder, &pixels);
            if let Some(timestamps) = &timestamps {
                timestamps.resolve(&mut encoder);
            }
            copy_for_reading(&context.device, &mut encoder, &counter)
        })?;
        let start = Instant::now();
        context.scoped(|| context.queue.submit([encoder.finish()]))?;
        drop(held);
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
    fn layout(&self, variant: Variant) -> &wgpu::BindGroupLayout {
        &self.layouts[match variant.through {
            Through::Octree { storage: NodeStorage::Buffer, voxels: true, .. } => Data::BufferAndVoxels,
            Through::Octree { storage: NodeStorage::Texture, voxels: true, .. } => Data::TextureAndVoxels,
            Through::Octree { storage: NodeStorage::Buffer, .. } => Data::Buffer,
            Through::Octree { storage: NodeStorage::Texture, .. } => Data::Texture,
            Through::Exact { .. } => Data::Exact,
        } as usize]
    }

    fn pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::ComputePipeline {
        let made = || self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made().get(&variant) {
            return pipeline.clone();
        }
        // Compiling takes long: nobody who wants another one waits.
        let pipeline = pipeline(device, self.layout(variant), variant);
        made().entry(variant).or_insert(pipeline).clone()
    }

    /// Whether the shaders of a march with these settings are compiled.
    pub fn is_ready<'a>(&self, volume: impl Into<Marched<'a>>, settings: &RenderSettings) -> bool {
        let volume = volume.into();
        let variant = volume.variant(settings);
        let is_made = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&variant);
        let Marched::Octree(octree) = volume else { return is_made };
        let settings = &volume.settings(settings);
        let finds_active = settings.skip() != Skip::None || settings.is_through_voxels();
        let of_parts = |parts| self.intervals.is_ready(octree.storage(), [parts, variant.planes[0]], Wants::of(octree, settings).boxes);
        is_made && (!finds_active || self.activity.is_ready(octree)) && settings.skip().parts().is_none_or(of_parts)
    }

    /// Compiles the shaders of marches with these settings, which may take a second: on another thread than the one that draws.
    pub fn prepare<'a>(&self, context: &Context, volume: impl Into<Marched<'a>>, settings: &RenderSettings) -> Result<(), GpuError> {
        let volume = volume.into();
        let variant = volume.variant(settings);
        context.scoped(|| {
            let device = &context.device;
            drop(self.pipeline(device, variant));
            let Marched::Octree(octree) = volume else { return };
            let settings = &volume.settings(settings);
            if settings.skip() != Skip::None || settings.is_through_voxels() {
                self.activity.prepare(device, octree);
            }
            if let Some(parts) = settings.skip().parts() {
                self.intervals.prepare(device, octree.storage(), [parts, variant.planes[0]], Wants::of(octree, settings).boxes);
            }
        })
    }
}

/// In what form data are bound.
#[derive(Clone, Copy, PartialEq)]
enum Data {
    Buffer,
    Texture,
    Exact,
    BufferAndVoxels,
    TextureAndVoxels,
}

fn layout(device: &wgpu::Device, data: Data) -> wgpu::BindGroupLayout {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    let image = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: wgpu::TextureFormat::Rgba32Float,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let counter = buffer(wgpu::BufferBindingType::Storage { read_only: false });
    // frame, knots, knot_index, psi_table, image, counter, surface_nodes, surface_faces, surface_vertices, style.
    let uniform = buffer(wgpu::BufferBindingType::Uniform);
    let mut types =
        vec![(23, uniform), (0, uniform), (2, read), (3, read), (4, read), (5, image), (6, counter), (8, read), (9, read), (10, read)];
    // nodes, bricks, activity, part_words, cut_edges.
    let edges = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let octree = |storage| vec![(1, nodes_type(storage)), (7, nodes_type(storage)), (15, read), (16, read), (24, edges)];
    types.extend(match data {
        Data::Buffer => octree(NodeStorage::Buffer),
        Data::Texture => octree(NodeStorage::Texture),
        Data::BufferAndVoxels => octree(NodeStorage::Buffer),
        Data::TextureAndVoxels => octree(NodeStorage::Texture),
        // neighbours, tet_points, vertices, cell_values.
        Data::Exact => vec![(11, read), (12, read), (13, read), (14, read)],
    });
    if matches!(data, Data::BufferAndVoxels | Data::TextureAndVoxels) {
        // block_index, block_samples, and clearance.
        types.push((21, read));
        let sample_types = [wgpu::TextureSampleType::Uint, wgpu::TextureSampleType::Float { filterable: false }];
        let texture =
            |sample_type| wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D3, multisampled: false };
        types.extend((19..).zip(sample_types.map(texture)));
    }
    layout_of("march", device, wgpu::ShaderStages::COMPUTE, &types)
}

/// How nodes and bricks are bound.
pub(super) fn nodes_type(storage: NodeStorage) -> wgpu::BindingType {
    match storage {
        NodeStorage::Buffer => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        NodeStorage::Texture => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D3,
            multisampled: false,
        },
    }
}

/// A layout of bindings that the same stages see.
pub(super) fn layout_of(
    label: &str,
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    types: &[(u32, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entry = |&(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = types.iter().map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, variant: Variant) -> wgpu::ComputePipeline {
    let flag = |set: bool| f64::from(u8::from(set));
    let mode = match variant.mode {
        Mode::Composite => 0.0,
        Mode::Iso => 1.0,
        Mode::Maximum => 2.0,
        Mode::Minimum => 3.0,
        Mode::Mean => 4.0,
        Mode::Integral => 5.0,
    };
    let mut constants = vec![
        ("tile", f64::from(TILE)),
        ("mode", mode),
        ("as_numbers", flag(variant.output == Output::Numbers)),
        ("with_surfaces", flag(variant.with_surfaces)),
        ("shade_volume", flag(variant.shade_volume)),
        ("shade_surfaces", flag(variant.shade_surfaces)),
        ("boundary_faces", flag(variant.faces)),
        ("isosurfaces", f64::from(variant.isosurfaces)),
        ("clip_planes", f64::from(variant.planes[0])),
        ("cut_planes", f64::from(variant.planes[1])),
    ];
    let (stage, storage) = match variant.through {
        Through::Octree { steps, storage, continuous, clipped, voxels, skip } => {
            constants.extend([("continuous", flag(continuous)), ("clipped", flag(clipped)), ("skipping", flag(skip.is_in_march()))]);
            constants.push(("parts", f64::from(skip.parts().unwrap_or(0))));
            if voxels {
                constants.push(("encoded", flag(skip == Skip::Encoding)));
            }
            let stage = match steps {
                Steps::Leaf => "march_leaf.wgsl",
                Steps::Paper => "march_paper.wgsl",
                Steps::Fixed if voxels => "march_voxels.wgsl",
                Steps::Fixed => "march_fixed.wgsl",
            };
            (stage, storage)
        }
        Through::Exact { on_cells } => {
            constants.push(("on_cells", flag(on_cells)));
            ("march_exact.wgsl", NodeStorage::Buffer)
        }
    };
    compute_pipeline(device, layout, &shader::source(stage, storage), stage, "main", &constants)
}

/// The pipeline of one compute stage.
pub(super) fn compute_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    source: &str,
    label: &str,
    entry_point: &str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions { constants, zero_initialize_workgroup_memory: true },
        cache: None,
    })
}

pub(super) fn init_buffer(device: &wgpu::Device, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
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
