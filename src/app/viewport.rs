//! The picture inside the window, `shaders/viewport.wgsl`: a target that the GPU marches into, and a paint callback that shows it. Nothing
//! is read back.

use crate::gpu::{Context, FrameTime, GpuError, InFlight, Target, device_descriptor, shader};
use crate::image::Image;
use crate::render::{RenderError, Renderer, Scene};
use crate::view::{RendererKind, View};
use egui_wgpu::wgpu;
use std::sync::Arc;

/// What shows pictures of one window.
pub struct Viewport {
    context: Context,
    pipeline: wgpu::RenderPipeline,
    /// The octree's and the exact one: going from one to the other shows it at once.
    pictures: [Shown; 2],
    painted: RendererKind,
    in_flight: Option<InFlight>,
    refined: Option<Refined>,
    /// Width and height of what is in flight.
    marching: [u32; 2],
}

/// A picture that can be painted.
struct Shown {
    target: Target,
    image: wgpu::BindGroup,
    filled: bool,
}

/// A picture that is marched some rows at a time, so that the window does not stand still on a slow device.
struct Refined {
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

impl Viewport {
    /// A viewport on the window's device.
    pub fn new(window: &egui_wgpu::RenderState) -> Result<Self, GpuError> {
        let context = Context::from_parts(&window.adapter, window.device.clone(), window.queue.clone());
        let pipeline = pipeline(&context.device, window.target_format);
        let empty = || -> Result<Shown, GpuError> { Ok(Shown::new(&context, &pipeline, Target::new(&context, 1, 1)?)) };
        let pictures = [empty()?, empty()?];
        let painted = RendererKind::Octree;
        Ok(Viewport { context, pipeline, pictures, painted, in_flight: None, refined: None, marching: [0; 2] })
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
        self.context.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether there is a picture to show.
    pub fn is_filled(&self) -> bool {
        self.pictures[self.painted as usize].filled
    }

    /// Shows the picture of a renderer, as it was last made.
    pub fn show(&mut self, kind: RendererKind) {
        self.painted = kind;
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

    /// Starts the march of a scene on the device. Its picture replaces that renderer's before, and is shown.
    pub fn march(&mut self, renderer: &Renderer, scene: &Scene, view: &View) -> Result<(), RenderError> {
        self.refined = None;
        let kind = view.settings.renderer;
        self.marching = [view.settings.width, view.settings.height];
        self.resize(kind, self.marching)?;
        let picture = &mut self.pictures[kind as usize];
        self.in_flight = renderer.march(scene, view, 0, &picture.target)?;
        (picture.filled, self.painted) = (true, kind);
        Ok(())
    }

    /// Marches the next rows of a picture, `rows` of them if it is a new one. Call it when nothing is in flight; `true` once the picture is
    /// whole and has replaced that renderer's before.
    pub fn refine(&mut self, renderer: &Renderer, scene: &Scene, view: &View, rows: u32) -> Result<bool, RenderError> {
        let (width, height) = (view.settings.width, view.settings.height);
        let mut refined = match self.refined.take().filter(|refined| refined.view == *view) {
            Some(refined) => refined,
            None => Refined {
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
            let kind = view.settings.renderer;
            self.pictures[kind as usize] = Shown { filled: true, ..Shown::new(&self.context, &self.pipeline, refined.picture) };
            self.painted = kind;
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
    pub fn is_refining(&self, view: &View) -> bool {
        self.refined.as_ref().is_some_and(|refined| refined.view == *view)
    }

    /// Gives up a renderer's picture that is half marched.
    pub fn stop_refining(&mut self, kind: RendererKind) {
        self.refined.take_if(|refined| refined.view.settings.renderer == kind);
    }

    /// Takes an image that was made elsewhere for a renderer's picture.
    pub fn put(&mut self, kind: RendererKind, image: &Image) -> Result<(), GpuError> {
        self.resize(kind, [image.width, image.height])?;
        let picture = &mut self.pictures[kind as usize];
        picture.target.write(&self.context, image)?;
        picture.filled = true;
        Ok(())
    }

    fn resize(&mut self, kind: RendererKind, [width, height]: [u32; 2]) -> Result<(), GpuError> {
        let picture = &mut self.pictures[kind as usize];
        if picture.target.resize(&self.context, width, height)? {
            picture.image = bind(&self.context.device, &self.pipeline, &picture.target);
        }
        Ok(())
    }

    /// Paints the picture over `rect`, stretched if its size is another.
    pub fn paint(&self, painter: &egui::Painter, rect: egui::Rect) {
        let blit = Blit { pipeline: self.pipeline.clone(), image: self.pictures[self.painted as usize].image.clone() };
        painter.add(egui_wgpu::Callback::new_paint_callback(rect, blit));
    }
}

impl Shown {
    fn new(context: &Context, pipeline: &wgpu::RenderPipeline, target: Target) -> Self {
        Shown { image: bind(&context.device, pipeline, &target), target, filled: false }
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

fn pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let label = Some("viewport");
    let source = wgpu::ShaderSource::Wgsl(shader::source("viewport.wgsl", shader::NodeStorage::Buffer).into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    });
    let layout =
        device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor { label, bind_group_layouts: &[Some(&layout)], immediate_size: 0 });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("cover"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("show"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn bind(device: &wgpu::Device, pipeline: &wgpu::RenderPipeline, target: &Target) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("viewport"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(target.view()) }],
    })
}
