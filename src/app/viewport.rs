//! The pictures inside the window, `shaders/viewport.wgsl`: targets that the GPU marches into, and a paint callback that shows one or
//! compares two. Nothing is read back.

use super::slot::Slot;
use crate::gpu::{
    Context, FrameTime, GpuError, InFlight, LinePipeline, LineVertex, Lines, SlicePicture, Target, device_descriptor, shader,
};
use crate::image::Image;
use crate::render::{RenderError, Renderer, Scene};
use crate::view::View;
use egui_wgpu::wgpu;
use std::sync::{Arc, OnceLock};

/// What shows pictures of one window.
pub struct Viewport {
    context: Context,
    blitting: Blitting,
    line_pipeline: LinePipeline,
    /// Those of all slots: going from one to the other shows it at once.
    pictures: [Shown; Slot::COUNT],
    painted: Slot,
    /// What the shader reads of how two are compared.
    comparison: wgpu::Buffer,
    lines: Option<Lines>,
    in_flight: Option<InFlight>,
    refined: Option<Refined>,
    /// Width and height of what is in flight.
    marching: [u32; 2],
}

/// A picture that can be painted.
struct Shown {
    target: Target,
    filled: bool,
}

/// What is made of the pictures of two slots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compared {
    /// The first left of a divider, in pictures from the left, and the second right of it.
    Wipe([Slot; 2], f32),
    /// Their difference by channel, times a gain.
    Difference([Slot; 2], f32),
    /// The first over the second, by the first's share in [0, 1].
    Blend([Slot; 2], f32),
}

/// A picture that is marched some rows at a time, so that the window does not stand still on a slow device.
struct Refined {
    slot: Slot,
    view: View,
    picture: Target,
    rows: Target,
    /// The row that is marched next, and the one that is being marched.
    next: u32,
    marching: Option<u32>,
}

/// How eframe is to open its device: as the command does, with all the adapter's limits.
pub fn wgpu_setup() -> egui_wgpu::WgpuSetup {
    let mut setup = egui_wgpu::WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(device_descriptor);
    egui_wgpu::WgpuSetup::CreateNew(setup)
}

/// A picture of slices as egui paints it, smoothly if it is stretched. `id` is what the window's earlier picture has, which goes.
pub fn painted(
    window: &egui_wgpu::RenderState,
    picture: &SlicePicture,
    is_stretched: bool,
    id: Option<egui::TextureId>,
) -> egui::TextureId {
    let mut renderer = window.renderer.write();
    let filter = if is_stretched { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    match id {
        Some(id) => {
            renderer.update_egui_texture_from_wgpu_texture(&window.device, picture.view(), filter, id);
            id
        }
        None => renderer.register_native_texture(&window.device, picture.view(), filter),
    }
}

impl Viewport {
    /// A viewport on the window's device.
    pub fn new(window: &egui_wgpu::RenderState) -> Result<Self, GpuError> {
        let context = Context::from_parts(&window.adapter, window.device.clone(), window.queue.clone());
        let blitting = Blitting::new(&context.device, window.target_format);
        let empty = || -> Result<Shown, GpuError> { Ok(Shown { target: Target::new(&context, 1, 1)?, filled: false }) };
        let pictures = [empty()?, empty()?, empty()?];
        let comparison = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("comparison"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let line_pipeline = LinePipeline::new(&context, window.target_format);
        let (painted, marching) = (Slot::Octree, [0; 2]);
        Ok(Viewport {
            context,
            blitting,
            line_pipeline,
            pictures,
            painted,
            comparison,
            lines: None,
            in_flight: None,
            refined: None,
            marching,
        })
    }

    /// The window's device.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// The longest side that a picture can have.
    pub fn longest_side(&self) -> u32 {
        self.context.device.limits().max_texture_dimension_2d
    }

    /// Whether the adapter computes on the CPU.
    pub fn is_slow(&self) -> bool {
        self.context.is_software()
    }

    /// Whether there is a picture to show.
    pub fn is_filled(&self) -> bool {
        self.pictures[self.painted as usize].filled
    }

    /// Shows the picture of a slot, as it was last made.
    pub fn show(&mut self, slot: Slot) {
        self.painted = slot;
    }

    /// Whether a slot has a picture.
    pub fn has(&self, slot: Slot) -> bool {
        self.pictures[slot as usize].filled
    }

    /// Takes a slot's picture away.
    pub fn empty(&mut self, slot: Slot) {
        self.pictures[slot as usize].filled = false;
        self.stop_refining(slot);
    }

    /// Whether a march was submitted and is not seen to be done.
    pub fn is_marching(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Size and time of what was marched, if it has just got done.
    pub fn poll(&mut self) -> Result<Option<([u32; 2], FrameTime)>, GpuError> {
        if let Some(error) = self.context.take_error() {
            return Err(error);
        }
        let Some(in_flight) = &self.in_flight else { return Ok(None) };
        let done = in_flight.poll(&self.context);
        if !matches!(done, Ok(None)) {
            self.in_flight = None;
        }
        Ok(done?.map(|time| (self.marching, time)))
    }

    /// Starts the march of a scene on the device. Its picture replaces the slot's before.
    pub fn march(&mut self, slot: Slot, renderer: &Renderer, scene: &Scene, view: &View) -> Result<(), RenderError> {
        self.refined = None;
        self.marching = [view.settings.width, view.settings.height];
        self.resize(slot, self.marching)?;
        let picture = &mut self.pictures[slot as usize];
        self.in_flight = renderer.march(scene, view, 0, &picture.target)?;
        picture.filled = true;
        Ok(())
    }

    /// Marches the next rows of a picture, `rows` of them if it is a new one. Call it when nothing is in flight; `true` once the picture is
    /// whole and has replaced the slot's before.
    pub fn refine(&mut self, slot: Slot, renderer: &Renderer, scene: &Scene, view: &View, rows: u32) -> Result<bool, RenderError> {
        let (width, height) = (view.settings.width, view.settings.height);
        let mut refined = match self.refined.take().filter(|refined| refined.slot == slot && refined.view == *view) {
            Some(refined) => refined,
            None => Refined {
                slot,
                view: view.clone(),
                picture: Target::new(&self.context, width, height)?,
                rows: Target::new(&self.context, width, rows)?,
                next: 0,
                marching: None,
            },
        };
        if let Some(row) = refined.marching.take() {
            refined.picture.copy_rows(&self.context, &refined.rows, row)?;
        }
        if refined.next == height {
            self.pictures[slot as usize] = Shown { filled: true, target: refined.picture };
            return Ok(true);
        }
        // The last rows reach back so that they are as many.
        let row = refined.next.min(height - refined.rows.size()[1]);
        self.marching = refined.rows.size();
        self.in_flight = renderer.march(scene, view, row, &refined.rows)?;
        (refined.marching, refined.next) = (Some(row), row + refined.rows.size()[1]);
        self.refined = Some(refined);
        Ok(false)
    }

    /// Whether a part of this picture is marched.
    pub fn is_refining(&self, slot: Slot, view: &View) -> bool {
        self.refined.as_ref().is_some_and(|refined| refined.slot == slot && refined.view == *view)
    }

    /// Gives up a slot's picture that is half marched.
    pub fn stop_refining(&mut self, slot: Slot) {
        self.refined.take_if(|refined| refined.slot == slot);
    }

    /// Takes an image that was made elsewhere for a slot's picture.
    pub fn put(&mut self, slot: Slot, image: &Image) -> Result<(), GpuError> {
        self.resize(slot, [image.width, image.height])?;
        let picture = &mut self.pictures[slot as usize];
        picture.target.write(&self.context, image)?;
        picture.filled = true;
        Ok(())
    }

    fn resize(&mut self, slot: Slot, [width, height]: [u32; 2]) -> Result<(), GpuError> {
        self.pictures[slot as usize].target.resize(&self.context, width, height)?;
        Ok(())
    }

    /// Paints the picture over `rect`, which has `size` pixels, stretched if its size is another, or what is made of two.
    pub fn paint(&self, painter: &egui::Painter, rect: egui::Rect, size: [u32; 2], compared: Option<Compared>) {
        let (shown, slots, divider, gain) = match compared {
            None => return self.paint_one(painter, rect, size, self.painted),
            Some(Compared::Wipe(slots, divider)) => (1, slots, divider, 0.0),
            Some(Compared::Difference(slots, gain)) => (2, slots, 0.0, gain),
            Some(Compared::Blend(slots, share)) => (3, slots, 0.0, share),
        };
        let words = [divider.to_bits(), gain.to_bits(), 0, 0];
        self.context.queue.write_buffer(&self.comparison, 0, bytemuck::cast_slice(&words));
        self.blit(painter, rect, size, shown, slots);
    }

    /// Paints a slot's picture in the same way; nothing if it has none.
    pub fn paint_one(&self, painter: &egui::Painter, rect: egui::Rect, size: [u32; 2], slot: Slot) {
        if self.has(slot) {
            self.blit(painter, rect, size, 0, [slot; 2]);
        }
    }

    fn blit(&self, painter: &egui::Painter, rect: egui::Rect, size: [u32; 2], shown: u32, slots: [Slot; 2]) {
        let targets = slots.map(|slot| &self.pictures[slot as usize].target);
        let stretched = targets.iter().any(|target| target.size() != size);
        let (pipeline, image) = (self.blitting.pipeline(&self.context.device, shown, stretched), self.bind(targets));
        painter.add(egui_wgpu::Callback::new_paint_callback(rect, Blit { pipeline, image }));
    }

    /// What copies lines to the device, positions relative to the data's centre; nothing if there are none. Any thread may call it.
    pub fn line_uploader(&self) -> impl Fn(&[LineVertex]) -> Result<Option<Lines>, GpuError> + Send + use<> {
        let (context, pipeline) = (self.context.clone(), self.line_pipeline.clone());
        move |vertices| (!vertices.is_empty()).then(|| pipeline.upload(&context, vertices)).transpose()
    }

    /// Takes lines to be painted over the picture.
    pub fn put_lines(&mut self, lines: Option<Lines>) {
        self.lines = lines;
    }

    /// Paints the lines, if there are any, by this projection from positions to clip space.
    pub fn paint_lines(&self, painter: &egui::Painter, rect: egui::Rect, clip_from_data: [[f32; 4]; 4]) {
        if let Some(lines) = &self.lines {
            lines.aim(&self.context, clip_from_data);
            painter.add(egui_wgpu::Callback::new_paint_callback(rect, Overlay(lines.clone())));
        }
    }

    fn bind(&self, [image, other]: [&Target; 2]) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        self.context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("viewport"),
            layout: &self.blitting.layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(image.view())),
                entry(1, wgpu::BindingResource::TextureView(other.view())),
                entry(2, self.comparison.as_entire_binding()),
            ],
        })
    }
}

/// One painting of the picture.
struct Blit {
    pipeline: wgpu::RenderPipeline,
    image: wgpu::BindGroup,
}

impl egui_wgpu::CallbackTrait for Blit {
    fn paint(&self, _: egui::PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &egui_wgpu::CallbackResources) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.image, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// One painting of lines.
struct Overlay(Lines);

impl egui_wgpu::CallbackTrait for Overlay {
    fn paint(&self, _: egui::PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &egui_wgpu::CallbackResources) {
        self.0.draw(pass);
    }
}

/// Pipelines that paint pictures, each made when it is first needed.
struct Blitting {
    layout: wgpu::BindGroupLayout,
    module: wgpu::ShaderModule,
    format: wgpu::TextureFormat,
    /// One picture, a wipe, a difference, a mixture; texel for pixel, then stretched.
    pipelines: [OnceLock<wgpu::RenderPipeline>; 8],
}

impl Blitting {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let label = Some("viewport");
        let source = wgpu::ShaderSource::Wgsl(shader::source("viewport.wgsl", shader::NodeStorage::Buffer).into());
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None };
        let entries = [entry(0, texture), entry(1, texture), entry(2, uniform)];
        Blitting {
            layout: device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries }),
            module: device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source }),
            format,
            pipelines: Default::default(),
        }
    }

    /// What paints so: 0 one picture, 1 a wipe, 2 a difference, 3 a mixture.
    fn pipeline(&self, device: &wgpu::Device, shown: u32, stretched: bool) -> wgpu::RenderPipeline {
        let constants = [("shown", f64::from(shown)), ("stretched", f64::from(u8::from(stretched)))];
        let make = || self.make(device, &constants);
        self.pipelines[2 * shown as usize + usize::from(stretched)].get_or_init(make).clone()
    }

    fn make(&self, device: &wgpu::Device, constants: &[(&str, f64)]) -> wgpu::RenderPipeline {
        let label = Some("viewport");
        let layouts = [Some(&self.layout)];
        let layout =
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor { label, bind_group_layouts: &layouts, immediate_size: 0 });
        let blend = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let target = wgpu::ColorTargetState { format: self.format, blend, write_mask: wgpu::ColorWrites::ALL };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("cover"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some("show"),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
