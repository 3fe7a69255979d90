//! Lines over a picture, `shaders/lines.wgsl`.

use super::context::{Context, GpuError};
use super::shader::{self, NodeStorage};
use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt;

/// An end of a line: two of them make one.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LineVertex {
    /// Where, relative to the data's centre.
    pub position: [f32; 3],
    /// Red, green, blue and opacity; colours not multiplied.
    pub color: [u8; 4],
}

/// What draws lines onto targets of one format.
#[derive(Debug, Clone)]
pub struct LinePipeline {
    pipeline: wgpu::RenderPipeline,
}

/// Lines on a device.
#[derive(Debug, Clone)]
pub struct Lines {
    pipeline: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    matrix: wgpu::Buffer,
    group: wgpu::BindGroup,
    count: u32,
}

impl LinePipeline {
    /// A pipeline for targets of a format.
    pub fn new(context: &Context, format: wgpu::TextureFormat) -> Self {
        let label = Some("lines");
        let source = wgpu::ShaderSource::Wgsl(shader::source("lines.wgsl", NodeStorage::Buffer).into());
        let module = context.device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<LineVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let target = wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let pipeline = context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("place"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(vertices)],
            },
            primitive: wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::LineList, ..Default::default() },
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("paint"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        });
        LinePipeline { pipeline }
    }

    /// Copies lines to the device.
    pub fn upload(&self, context: &Context, vertices: &[LineVertex]) -> Result<Lines, GpuError> {
        let size = size_of_val(vertices) as u64;
        let what = || format!("{} lines", vertices.len() / 2);
        context.check_limit(what, size, "max_buffer_size", context.device.limits().max_buffer_size)?;
        context.scoped(|| {
            let contents = bytemuck::cast_slice(vertices);
            let device = &context.device;
            let usage = wgpu::BufferUsages::VERTEX;
            let vertices_buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("lines"), contents, usage });
            let matrix = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("projection of lines"),
                size: 64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("lines"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() }],
            });
            Lines { pipeline: self.pipeline.clone(), vertices: vertices_buffer, matrix, group, count: vertices.len() as u32 }
        })
    }
}

impl Lines {
    /// Sets the projection, column by column: from positions to clip space.
    pub fn aim(&self, context: &Context, clip_from_data: [[f32; 4]; 4]) {
        context.queue.write_buffer(&self.matrix, 0, bytemuck::cast_slice(&clip_from_data));
    }

    /// Draws the lines.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.draw(0..self.count, 0..1);
    }
}
