//! What draws slices, and what it draws into.

use super::super::context::{Context, GpuError};
use super::super::shader::{self, NodeStorage};
use super::super::target::Target;
use super::{DrawnSlice, SliceLook, SlicePool, SliceQuad, SliceStyle, outline};
use crate::image::Image;
use std::sync::OnceLock;
use wgpu::util::DeviceExt;

/// What a picture is made of: colours as the window shows them, premultiplied.
const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The pipelines; each is made when it is first needed.
#[derive(Debug)]
pub struct SlicePainter {
    module: wgpu::ShaderModule,
    shared: wgpu::BindGroupLayout,
    own: wgpu::BindGroupLayout,
    paint: OnceLock<wgpu::RenderPipeline>,
    measure: OnceLock<wgpu::RenderPipeline>,
    look: wgpu::Buffer,
    colors: wgpu::Buffer,
    /// What the buffer of colours holds.
    style: Option<SliceStyle>,
}

/// Pixels that slices are drawn into.
#[derive(Debug)]
pub struct SlicePicture {
    color: wgpu::Texture,
    view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

/// The corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Corner {
    uv: [f32; 2],
    quad: u32,
}

impl SlicePicture {
    /// A picture of `width` x `height` pixels, each at least 1.
    pub fn new(context: &Context, [width, height]: [u32; 2]) -> Result<Self, GpuError> {
        let limit = context.device.limits().max_texture_dimension_2d;
        let what = || format!("a picture of {width}x{height} pixels");
        context.check_limit(what, u64::from(width.max(height)), "max_texture_dimension_2d", u64::from(limit))?;
        context.scoped(|| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
            let color = texture(context, [width, height], COLOR, usage);
            let depth = texture(context, [width, height], DEPTH, wgpu::TextureUsages::RENDER_ATTACHMENT);
            let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
            SlicePicture { view: view(&color), depth: view(&depth), color }
        })
    }

    /// The colours.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        [self.color.width(), self.color.height()]
    }
}

fn texture(context: &Context, [width, height]: [u32; 2], format: wgpu::TextureFormat, usage: wgpu::TextureUsages) -> wgpu::Texture {
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("slices"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

impl SlicePainter {
    /// Ready to draw.
    pub fn new(context: &Context) -> Self {
        let device = &context.device;
        let label = Some("slices");
        let source = wgpu::ShaderSource::Wgsl(shader::source("slices.wgsl", NodeStorage::Buffer).into());
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
        let atlas = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D3,
            multisampled: false,
        };
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let shared = [
            entry(0, fragment, buffer(wgpu::BufferBindingType::Uniform)),
            entry(1, fragment, read),
            entry(2, fragment, read),
            entry(3, fragment, atlas),
            entry(4, fragment, read),
        ];
        let own = [entry(0, wgpu::ShaderStages::VERTEX, read)];
        let layout = |entries: &[_]| device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries });
        let made = |label, size, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        SlicePainter {
            module: device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source }),
            shared: layout(&shared),
            own: layout(&own),
            paint: OnceLock::new(),
            measure: OnceLock::new(),
            look: made("look of slices", size_of::<SliceLook>() as u64, wgpu::BufferUsages::UNIFORM),
            colors: made("colours of slices", 4 * (super::COLORS as u64 + 4), wgpu::BufferUsages::STORAGE),
            style: None,
        }
    }

    /// Draws slices over nothing: each pixel holds what is nearest to the eye.
    pub fn draw(
        &mut self,
        context: &Context,
        pool: &mut SlicePool,
        style: &SliceStyle,
        slices: &[DrawnSlice],
        picture: &SlicePicture,
    ) -> Result<(), GpuError> {
        context.scoped(|| {
            self.prepare(context, pool, style);
            let pipeline = self.paint.get_or_init(|| self.pipeline(context, "paint", COLOR));
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.pass(context, pool, slices, pipeline, [&picture.view, &picture.depth], &mut encoder);
            context.queue.submit([encoder.finish()]);
        })
    }

    /// Waits for a picture and reads it.
    pub fn read(&self, context: &Context, picture: &SlicePicture) -> Result<Vec<[u8; 4]>, GpuError> {
        let [width, height] = picture.size();
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let size = u64::from(row) * u64::from(height);
        let buffer = context.scoped(|| {
            let descriptor = wgpu::BufferDescriptor { label: Some("slices"), size, usage, mapped_at_creation: false };
            let buffer = context.device.create_buffer(&descriptor);
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) };
            let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
            encoder.copy_texture_to_buffer(picture.color.as_image_copy(), to, picture.color.size());
            context.queue.submit([encoder.finish()]);
            buffer
        })?;
        let bytes = context.read(&buffer)?;
        let rows = bytes.chunks_exact(row as usize);
        Ok(rows.flat_map(|row| bytemuck::cast_slice::<u8, [u8; 4]>(&row[..4 * width as usize]).to_vec()).collect())
    }

    /// The numbers that a picture of `width` x `height` pixels shows: value, level that it is from (-1 where nothing is resident), whether it
    /// is known (1) or missing (0), and whether there is a slice (1) or not (0).
    pub fn measure(
        &mut self,
        context: &Context,
        pool: &mut SlicePool,
        style: &SliceStyle,
        slices: &[DrawnSlice],
        [width, height]: [u32; 2],
    ) -> Result<Image, GpuError> {
        let format = wgpu::TextureFormat::Rgba32Float;
        let target = Target::new(context, width, height)?;
        let buffer = target.readback_buffer(context)?;
        context.scoped(|| {
            self.prepare(context, pool, style);
            let pipeline = self.measure.get_or_init(|| self.pipeline(context, "measure", format));
            let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
            let color = texture(context, [width, height], format, attachment | wgpu::TextureUsages::COPY_SRC);
            let depth = texture(context, [width, height], DEPTH, attachment);
            let views = [&color, &depth].map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.pass(context, pool, slices, pipeline, [&views[0], &views[1]], &mut encoder);
            target.copy_from(&mut encoder, &color);
            target.copy_to(&mut encoder, &buffer);
            context.queue.submit([encoder.finish()]);
        })?;
        Ok(target.image(&context.read(&buffer)?))
    }

    /// Sends the look, the colours and the table to the device where they have changed.
    fn prepare(&mut self, context: &Context, pool: &mut SlicePool, style: &SliceStyle) {
        pool.flush(context);
        let [low, high] = style.transfer_function.range.unwrap_or(style.value_range);
        if self.style.as_ref() != Some(style) {
            context.queue.write_buffer(&self.colors, 0, bytemuck::cast_slice(&style.table().0));
            self.style = Some(style.clone());
        }
        let look = SliceLook {
            dims: pool.pyramid.dims(0),
            level_count: pool.pyramid.levels().into(),
            low: low as f32,
            inverse_width: if high > low { (1.0 / (high - low)) as f32 } else { 0.0 },
            is_smooth: style.is_smooth.into(),
            bits: 8 * pool.voxel_bytes,
            bias: pool.bias,
            tint: style.tint,
            _pad: [0.0; 2],
        };
        context.queue.write_buffer(&self.look, 0, bytemuck::bytes_of(&look));
    }

    fn pass(
        &self,
        context: &Context,
        pool: &SlicePool,
        slices: &[DrawnSlice],
        pipeline: &wgpu::RenderPipeline,
        [color, depth]: [&wgpu::TextureView; 2],
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let device = &context.device;
        let dims = pool.pyramid.dims(0);
        let quads: Vec<SliceQuad> = slices.iter().map(|slice| slice.quad(dims)).collect();
        let mut corners = Vec::new();
        for (slice, quad) in slices.iter().zip(0..) {
            let points: Vec<Corner> = outline(&slice.plane, dims).iter().map(|uv| Corner { uv: uv.map(|v| v as f32), quad }).collect();
            let fan = points.windows(2).skip(1).flat_map(|pair| [points[0], pair[0], pair[1]]);
            corners.extend(fan);
        }
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("slices"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: color,
                depth_slice: None,
                resolve_target: None,
                ops: clear,
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        if corners.is_empty() {
            return;
        }
        let made = |usage, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("slices"), contents, usage })
        };
        let quads = made(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&quads));
        let vertices = made(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&corners));
        let group = |layout, entries: &[_]| device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("slices"), layout, entries });
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let shared = group(
            &self.shared,
            &[
                entry(0, self.look.as_entire_binding()),
                entry(1, pool.levels.as_entire_binding()),
                entry(2, pool.table.as_entire_binding()),
                entry(3, wgpu::BindingResource::TextureView(&pool.atlas)),
                entry(4, self.colors.as_entire_binding()),
            ],
        );
        let own = group(&self.own, &[entry(0, quads.as_entire_binding())]);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &shared, &[]);
        pass.set_bind_group(1, &own, &[]);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.draw(0..corners.len() as u32, 0..1);
    }

    fn pipeline(&self, context: &Context, fragment: &str, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
        let label = Some("slices");
        let layouts = [Some(&self.shared), Some(&self.own)];
        let layout = context.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let attributes = wgpu::vertex_attr_array![0 => Float32x2, 1 => Uint32];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Corner>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let target = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL };
        context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("place"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(vertices)],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
