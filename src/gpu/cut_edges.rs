//! The mesh's edges on planes, drawn for a march to read: `shaders/cut_edges.wgsl`.

use super::context::{Context, GpuError};
use super::intervals::Placing;
use super::march::{init_buffer, layout_of};
use super::shader::{self, NodeStorage};
use super::surface::storage_buffer;
use crate::octree::{Cut, CutEdges};
use crate::view::{PlaneUse, Planes};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// The lines on each plane that is drawn, on the device.
#[derive(Debug)]
pub(super) struct CutLines {
    edges: Arc<CutEdges>,
    /// Lines and how many; none where a plane has none.
    planes: Vec<Option<(wgpu::Buffer, u32)>>,
}

/// What draws them.
#[derive(Debug)]
pub(super) struct EdgePass {
    layout: wgpu::BindGroupLayout,
    pipeline: OnceLock<wgpu::RenderPipeline>,
    /// Those drawn last: images mostly keep their size.
    layers: Mutex<Option<Layers>>,
    nothing: wgpu::TextureView,
}

/// How much of each pixel edges cover, a layer a plane.
#[derive(Debug, Clone)]
struct Layers {
    size: [u32; 2],
    each: Vec<wgpu::TextureView>,
    all: wgpu::TextureView,
}

impl CutLines {
    /// Copies lines to the device, on planes that are relative to the data's centre.
    pub fn upload(context: &Context, edges: Arc<CutEdges>, planes: &Planes) -> Result<Self, GpuError> {
        let normals = planes.iter().filter(|plane| plane.used != PlaneUse::Clip).map(|plane| plane.normal.normalize().as_vec3());
        let one = |(cut, normal): (&Cut, glam::Vec3)| {
            if cut.lines().is_empty() {
                return Ok(None);
            }
            let lines = cut.lines().iter().map(|line| line.map(|end| end.extend(0.0).to_array()));
            let all: Vec<[[f32; 4]; 2]> = std::iter::once([normal.extend(0.0).to_array(); 2]).chain(lines).collect();
            let what = || format!("{} edges on a plane", cut.lines().len());
            Ok(Some((storage_buffer(context, "edges", &all, what)?, cut.lines().len() as u32)))
        };
        let planes = edges.cuts().iter().zip(normals).map(one).collect::<Result<_, GpuError>>()?;
        Ok(CutLines { edges, planes })
    }

    /// Whether these are the edges on the planes of `planes` that are drawn.
    pub fn are_on(&self, planes: &Planes) -> bool {
        self.edges.are_on(planes)
    }
}

impl EdgePass {
    /// The pipeline is made when it is first needed.
    pub fn new(context: &Context) -> Self {
        let device = &context.device;
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let (uniform, read) = (buffer(wgpu::BufferBindingType::Uniform), buffer(wgpu::BufferBindingType::Storage { read_only: true }));
        let types = [(0, uniform), (18, uniform), (25, read)];
        let layout = layout_of("edges", device, wgpu::ShaderStages::VERTEX_FRAGMENT, &types);
        let nothing = layers(device, [1, 1], 1).all;
        EdgePass { layout, pipeline: OnceLock::new(), layers: Mutex::default(), nothing }
    }

    /// What a march without edges binds.
    pub fn nothing(&self) -> &wgpu::TextureView {
        &self.nothing
    }

    /// Records what draws the lines for an image of `size` pixels; gives what the march reads.
    pub fn encode(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        lines: &CutLines,
        frame: &wgpu::Buffer,
        placing: Placing,
        size: [u32; 2],
    ) -> wgpu::TextureView {
        let device = &context.device;
        let mut last = self.layers.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |layers: &Layers| layers.size == size && layers.each.len() == lines.planes.len();
        let layers = match last.take().filter(fits) {
            Some(layers) => layers,
            None => layers(device, size, lines.planes.len() as u32),
        };
        let pipeline = self.pipeline.get_or_init(|| pipeline(device, &self.layout));
        let placing = init_buffer(device, "placing", bytemuck::bytes_of(&placing), wgpu::BufferUsages::UNIFORM);
        for (view, plane) in layers.each.iter().zip(&lines.planes) {
            let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
            let layer = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
            let descriptor = wgpu::RenderPassDescriptor { label: Some("edges"), color_attachments: &[Some(layer)], ..Default::default() };
            let mut pass = encoder.begin_render_pass(&descriptor);
            let Some((buffer, count)) = plane else { continue };
            let bindings = [(0, frame.as_entire_binding()), (18, placing.as_entire_binding()), (25, buffer.as_entire_binding())];
            let entries = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
            let descriptor = wgpu::BindGroupDescriptor { label: Some("edges"), layout: &self.layout, entries: &entries };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &device.create_bind_group(&descriptor), &[]);
            pass.draw(0..6, 0..*count);
        }
        last.insert(layers).all.clone()
    }
}

fn layers(device: &wgpu::Device, size: [u32; 2], count: u32) -> Layers {
    // GL takes one layer for a plain texture, and six square ones for a cube.
    let made = match count {
        1 => 2,
        6 => 7,
        count => count,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("edges"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: made },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = |dimension, base_array_layer, array_layer_count| {
        let (dimension, array_layer_count) = (Some(dimension), Some(array_layer_count));
        texture.create_view(&wgpu::TextureViewDescriptor { dimension, base_array_layer, array_layer_count, ..Default::default() })
    };
    let each = (0..count).map(|layer| view(wgpu::TextureViewDimension::D2, layer, 1)).collect();
    Layers { size, each, all: view(wgpu::TextureViewDimension::D2Array, 0, count) }
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let label = Some("cut_edges.wgsl");
    let source = wgpu::ShaderSource::Wgsl(shader::source("cut_edges.wgsl", NodeStorage::Buffer).into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
    let layout =
        device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor { label, bind_group_layouts: &[Some(layout)], immediate_size: 0 });
    let most = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Max,
    };
    let blend = Some(wgpu::BlendState { color: most, alpha: most });
    let target = wgpu::ColorTargetState { format: FORMAT, blend, write_mask: wgpu::ColorWrites::ALL };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState { module: &module, entry_point: Some("place"), compilation_options: Default::default(), buffers: &[] },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("cover"),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
