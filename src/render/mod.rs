//! One call for every renderer, for the window and the command alike: the same [`Scene`] and [`View`] give the same picture on the GPU
//! and on the CPU, from the octree and from the mesh itself.

mod sequence;

use crate::cpu;
use crate::exact::ExactScene;
use crate::geometry::Placed;
use crate::gpu::{self, ExactMesh, FrameTimes, GpuError, GpuSeconds, InFlight, Marched, OctreeVolume, Target};
use crate::image::Image;
use crate::mesh::{BoundarySurface, CompactMesh, ScalarField, TetMesh};
use crate::octree::{Activity, CutEdges, KeptActivity, OctreeTexture, Reconstruction};
use crate::optics::{Classifier, Style};
use crate::progress::{Cancelled, Progress};
use crate::view::{Mode, Output, PlaneUse, RayFrame, RenderSettings, RendererKind, Skip, Steps, View};
use glam::DVec3;
pub use sequence::SequenceError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Seconds for which a GPU is kept busy before its frames are timed.
const WARMUP_S: f64 = 0.3;

/// Where pictures are to be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeviceChoice {
    /// The best adapter there is, unless it computes on the CPU: there octetra's own march takes a quarter of the time; else the CPU.
    #[default]
    Auto,
    /// An adapter, or an error if there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// Why no picture was made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The device failed, or asks for more than it has.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Makes pictures, on one device.
pub struct Renderer {
    gpu: Option<Gpu>,
    unusable: Option<GpuError>,
}

struct Gpu {
    context: gpu::Context,
    marcher: gpu::Marcher,
}

/// The data of one renderer, and what of the mesh or volume a view refers to.
pub struct Scene {
    /// The world position that coordinates are relative to.
    pub center: DVec3,
    /// Length of the diagonal of the bounds, world units.
    pub diagonal: f64,
    data: Data,
    fell_back: Option<GpuError>,
    /// The mesh of an octree, for its edges on planes, and those that were asked for last.
    mesh: Option<Arc<TetMesh>>,
    edges: Mutex<Option<Arc<CutEdges>>>,
    /// What of an octree was active in the last march on the CPU.
    activity: KeptActivity,
}

enum Data {
    Octree { texture: Arc<OctreeTexture>, surface: Option<Arc<BoundarySurface>>, volume: Option<Box<OctreeVolume>> },
    Exact(ExactScene),
    ExactOnDevice { mesh: ExactMesh, value_range: [f64; 2] },
}

/// What of the rays of a view is no colour, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct RayNumbers {
    /// Pixels along x.
    pub width: u32,
    /// Pixels along y.
    pub height: u32,
    /// Of each ray the largest, smallest or mean value in data units, or the integral in data units times world units; NaN where the ray
    /// misses, or the view's mode has no such number.
    pub values: Vec<f32>,
    /// Distance along each ray from the eye to the first isosurface, world units; with a parallel camera from the view plane. NaN where there
    /// is none.
    pub depths: Vec<f32>,
}

/// A picture and what it took.
#[derive(Debug, Clone)]
pub struct Picture {
    /// The image.
    pub image: Image,
    /// Leaves or samples that rays looked up, or tets that they met; `None` for the exact renderer on the CPU.
    pub samples: Option<u64>,
    /// Seconds from the first ray to the last, on the GPU with the copy for the readback.
    pub wall_s: f64,
    /// Seconds on the GPU by its own timestamps; `None` where there are none to trust.
    pub gpu_s: Option<GpuSeconds>,
}

impl Renderer {
    /// Opens a device. With [`DeviceChoice::Auto`] a machine without an adapter that works gives the CPU, see [`Renderer::fell_back`].
    pub fn new(choice: DeviceChoice) -> Result<Self, RenderError> {
        let open = || -> Result<Gpu, GpuError> {
            let context = gpu::Context::new()?;
            Ok(Gpu { marcher: gpu::Marcher::new(&context)?, context })
        };
        match choice {
            DeviceChoice::Cpu => Ok(Renderer { gpu: None, unusable: None }),
            DeviceChoice::Gpu => Ok(Renderer { gpu: Some(open()?), unusable: None }),
            DeviceChoice::Auto => match open() {
                Ok(gpu) if gpu.context.is_software() => Ok(Renderer { gpu: None, unusable: None }),
                Ok(gpu) => Ok(Renderer { gpu: Some(gpu), unusable: None }),
                Err(e) => Ok(Renderer { gpu: None, unusable: Some(e) }),
            },
        }
    }

    /// Draws on a device that is open already, the window's, or on the CPU: with [`DeviceChoice::Auto`] as [`Renderer::new`] would.
    pub fn on(context: gpu::Context, choice: DeviceChoice) -> Result<Self, RenderError> {
        let on_cpu = match choice {
            DeviceChoice::Auto => context.is_software(),
            DeviceChoice::Gpu => false,
            DeviceChoice::Cpu => true,
        };
        let gpu = if on_cpu { None } else { Some(Gpu { marcher: gpu::Marcher::new(&context)?, context }) };
        Ok(Renderer { gpu, unusable: None })
    }

    /// Why the CPU serves though a GPU would have been taken: there is no adapter, or none that works.
    pub fn fell_back(&self) -> Option<&GpuError> {
        self.unusable.as_ref()
    }

    /// (name, backend, driver) of the adapter; `None` on the CPU.
    pub fn adapter(&self) -> Option<[String; 3]> {
        Some(self.gpu.as_ref()?.context.adapter())
    }

    /// A scene of an octree texture of a mesh or a volume, of which rays see what lies inside the surface, if there is one
    /// ([`Boundary::Mesh`](crate::octree::Boundary)). Both are copied to the device if there is one. Gives the seconds that the copy took.
    pub fn octree_scene(
        &self,
        data: &impl Placed,
        texture: OctreeTexture,
        surface: Option<Arc<BoundarySurface>>,
    ) -> Result<(Scene, f64), RenderError> {
        let start = Instant::now();
        let texture = Arc::new(texture);
        let volume = match &self.gpu {
            Some(gpu) => Some(Box::new(OctreeVolume::upload(&gpu.context, &texture, surface.as_deref())?)),
            None => None,
        };
        let upload_s = start.elapsed().as_secs_f64();
        Ok((Scene::of(data, Data::Octree { texture, surface, volume }), upload_s))
    }

    /// A scene of the mesh itself: in f32 on the device if there is one, else in f64. A mesh that the device has no room for is drawn on
    /// the CPU, see [`Scene::fell_back`].
    pub fn exact_scene(&self, mesh: &TetMesh, field: &ScalarField, progress: &Progress) -> Result<Scene, RenderError> {
        let mut fell_back = None;
        if let Some(gpu) = &self.gpu {
            match gpu.exact_mesh(mesh, field, progress) {
                Ok(on_device) => return Ok(Scene::of(mesh, Data::ExactOnDevice { mesh: on_device, value_range: field.range })),
                Err(RenderError::Gpu(reason @ (GpuError::TooLarge { .. } | GpuError::OutOfMemory))) => fell_back = Some(reason),
                Err(error) => return Err(error),
            }
        }
        Ok(Scene { fell_back, ..Scene::of(mesh, Data::Exact(ExactScene::new(mesh, field, progress)?)) })
    }

    /// Makes the picture of a scene. The view's transfer function and camera must be valid.
    pub fn render(&self, scene: &Scene, view: &View, progress: &Progress) -> Result<Picture, RenderError> {
        let frame = scene.frame(view);
        self.cut_edges(scene, view)?;
        if let Some((gpu, marched, value_range)) = self.on_device(scene) {
            let classifier = scene.classifier(view, value_range);
            let done = gpu.marcher.render(&gpu.context, marched, &frame, &classifier, &view.settings)?;
            return Ok(Picture { image: done.image, samples: Some(done.samples), wall_s: done.wall_s, gpu_s: done.gpu_s });
        }
        let start = Instant::now();
        let (image, samples) = match &scene.data {
            Data::Octree { texture, surface, .. } => {
                let classifier = scene.classifier(view, texture.value_range());
                let edges = scene.edges.lock().unwrap_or_else(PoisonError::into_inner).clone();
                let done = cpu::march_again(
                    texture,
                    surface.as_deref(),
                    edges.as_deref(),
                    &scene.activity,
                    &frame,
                    &classifier,
                    &view.settings,
                    progress,
                )?;
                (done.image, Some(done.samples))
            }
            Data::Exact(exact) => (exact.render(&frame, &view.transfer_function, &view.settings, progress)?, None),
            Data::ExactOnDevice { .. } => return Err(GpuError::Device("the scene is of another renderer's device".into()).into()),
        };
        Ok(Picture { image, samples, wall_s: start.elapsed().as_secs_f64(), gpu_s: None })
    }

    /// What of the view's rays is no colour: the numbers that its mode shows, and where they meet the first isosurface.
    pub fn numbers(&self, scene: &Scene, view: &View, progress: &Progress) -> Result<RayNumbers, RenderError> {
        let [width, height] = [view.settings.width, view.settings.height];
        let mode = view.settings.mode;
        if let Data::Exact(exact) = &scene.data {
            let numbers = exact.numbers(&scene.frame(view), &view.transfer_function, &view.settings, progress)?;
            let values = numbers.iter().map(|number| number.value as f32).collect();
            let depths = numbers.iter().map(|number| number.depth as f32).collect();
            return Ok(RayNumbers { width, height, values, depths });
        }
        let settings = RenderSettings { output: Output::Numbers, ..view.settings };
        let image = self.render(scene, &View { settings, ..view.clone() }, progress)?.image;
        let (edge, [lo, hi]) = scene.cube();
        let value = |&[number, length, _, _]: &[f32; 4]| {
            let mean = lo + (hi - lo) * f64::from(number);
            match mode {
                Mode::Composite | Mode::Iso => f32::NAN,
                _ if number < 0.0 => f32::NAN,
                Mode::Maximum | Mode::Minimum => mean as f32,
                Mode::Mean | Mode::Integral if length <= 0.0 => f32::NAN,
                Mode::Mean => mean as f32,
                Mode::Integral => (mean * f64::from(length) * edge) as f32,
            }
        };
        let depth = |&[_, _, distance, is_hit]: &[f32; 4]| if is_hit > 0.0 { (f64::from(distance) * edge) as f32 } else { f32::NAN };
        let (values, depths) = (image.pixels.iter().map(value).collect(), image.pixels.iter().map(depth).collect());
        Ok(RayNumbers { width, height, values, depths })
    }

    /// What of a scene lies on this renderer's device, and the values that its 0 and 1 stand for.
    fn on_device<'a>(&'a self, scene: &'a Scene) -> Option<(&'a Gpu, Marched<'a>, [f64; 2])> {
        let gpu = self.gpu.as_ref()?;
        match &scene.data {
            Data::Octree { texture, volume, .. } => Some((gpu, volume.as_deref()?.into(), texture.value_range())),
            Data::ExactOnDevice { mesh, value_range } => Some((gpu, mesh.into(), *value_range)),
            Data::Exact(_) => None,
        }
    }

    /// Whether the mesh's edges that this view draws on planes of an octree are at hand, or there are none to draw. Without them
    /// [`Renderer::march`] draws the planes without edges.
    pub fn has_cut_edges(&self, scene: &Scene, view: &View) -> bool {
        let planes = scene.frame(view).planes;
        let asked = view.settings.with_surfaces() && planes.iter().any(|plane| matches!(plane.used, PlaneUse::Cut { edges: true, .. }));
        let is_cut = || scene.edges.lock().unwrap_or_else(PoisonError::into_inner).as_ref().is_some_and(|edges| edges.are_on(&planes));
        !asked || scene.mesh.is_none() || scene.kind() == RendererKind::Exact || is_cut()
    }

    /// Cuts the scene's mesh with the planes on which this view draws edges, unless that was done last: a look at every tet, on whatever
    /// thread it is called.
    pub fn cut_edges(&self, scene: &Scene, view: &View) -> Result<(), RenderError> {
        let (Some(mesh), false) = (&scene.mesh, self.has_cut_edges(scene, view)) else { return Ok(()) };
        let planes = scene.frame(view).planes;
        let edges = Arc::new(CutEdges::new(mesh, planes));
        // Held, so that host and device have those of the same planes.
        let mut kept = scene.edges.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(gpu), Some(volume)) = (&self.gpu, scene.volume()) {
            volume.set_cut_edges(&gpu.context, &edges, &planes)?;
        }
        *kept = Some(edges);
        Ok(())
    }

    /// Whether [`Renderer::march`] of this view can begin at once; else its shaders are to be compiled ([`Renderer::prepare`]).
    pub fn is_ready(&self, scene: &Scene, view: &View) -> bool {
        self.on_device(scene).is_none_or(|(gpu, marched, _)| gpu.marcher.is_ready(marched, &view.settings))
    }

    /// Compiles the shaders that this view needs, on whatever thread it is called.
    pub fn prepare(&self, scene: &Scene, view: &View) -> Result<(), RenderError> {
        let Some((gpu, marched, _)) = self.on_device(scene) else { return Ok(()) };
        Ok(gpu.marcher.prepare(&gpu.context, marched, &view.settings)?)
    }

    /// Starts the march of the view's rows from `first_row` on, as many as `target` has, and waits for nothing. The target must have the
    /// view's width. `None` if the scene is not on the device: [`Renderer::render`] draws it.
    pub fn march(&self, scene: &Scene, view: &View, first_row: u32, target: &Target) -> Result<Option<InFlight>, RenderError> {
        let Some((gpu, marched, value_range)) = self.on_device(scene) else { return Ok(None) };
        let classifier = scene.classifier(view, value_range);
        let rows = scene.frame(view).rows(first_row, target.size()[1]);
        Ok(Some(gpu.marcher.start(&gpu.context, marched, &rows, &classifier, &view.settings, target)?))
    }

    /// Times each view `repeats` times after warming up, nothing read back. All views have the first one's size, transfer
    /// function and settings.
    pub fn time(&self, scene: &Scene, views: &[View], repeats: u32, progress: &Progress) -> Result<FrameTimes, RenderError> {
        let Some(first) = views.first() else { return Ok(FrameTimes { gpu_s: None, intervals_s: None, wall_s: vec![] }) };
        self.cut_edges(scene, first)?;
        if let Some((gpu, marched, value_range)) = self.on_device(scene) {
            let classifier = scene.classifier(first, value_range);
            let frames: Vec<RayFrame> = views.iter().map(|view| scene.frame(view)).collect();
            return Ok(gpu.marcher.time(&gpu.context, marched, &frames, &classifier, &first.settings, WARMUP_S, repeats)?);
        }
        let mut wall_s = Vec::new();
        for view in views {
            for _ in 0..repeats {
                wall_s.push(self.render(scene, view, progress)?.wall_s);
            }
        }
        Ok(FrameTimes { gpu_s: None, intervals_s: None, wall_s })
    }
}

impl Renderer {
    /// Seconds that finding anew takes what of an octree the view's transfer function shows, each time of `repeats`: on the device by its
    /// timestamps where there are any, else by the clock. `None` for the exact renderer, which skips nothing.
    pub fn time_activity(&self, scene: &Scene, view: &View, repeats: u32) -> Result<Option<Vec<f64>>, RenderError> {
        let Data::Octree { texture, volume, .. } = &scene.data else { return Ok(None) };
        let classifier = scene.classifier(view, texture.value_range());
        if let (Some(gpu), Some(volume)) = (&self.gpu, volume) {
            return Ok(Some(gpu.marcher.time_activity(&gpu.context, volume, &classifier, &view.settings, repeats)?));
        }
        let seen = Style::seen_with(&view.settings, &classifier, texture.root_edge());
        let once = |_| {
            let start = Instant::now();
            std::hint::black_box(Activity::new(texture, &seen));
            start.elapsed().as_secs_f64()
        };
        Ok(Some((0..repeats).map(once).collect()))
    }

    /// Seconds by the clock of what the view's way to skip needs to be made anew when another transfer function shows other values. `None`
    /// for the exact renderer.
    pub fn time_preparation(&self, scene: &Scene, view: &View) -> Result<Option<f64>, RenderError> {
        let Data::Octree { texture, volume, .. } = &scene.data else { return Ok(None) };
        let classifier = scene.classifier(view, texture.value_range());
        if let (Some(gpu), Some(volume)) = (&self.gpu, volume) {
            return Ok(Some(gpu.marcher.time_preparation(&gpu.context, volume, &classifier, &view.settings)?));
        }
        let start = Instant::now();
        let settings = view.settings.for_octree(texture.reconstruction() == Reconstruction::Continuous);
        if settings.skip() != Skip::None {
            let activity = Activity::new(texture, &Style::seen_with(&view.settings, &classifier, texture.root_edge()));
            if settings.skip() == Skip::Half {
                std::hint::black_box(activity.split(texture));
            }
        }
        Ok(Some(start.elapsed().as_secs_f64()))
    }

    /// Whether a view can be marched through voxels: on a device, and the octree is such that it has them.
    pub fn has_voxels(&self, scene: &Scene) -> bool {
        self.gpu.is_some() && scene.volume().is_some_and(OctreeVolume::has_voxels)
    }

    /// Samples that a view of an octree needs: those that a march takes which knows every active leaf. `None` for the exact renderer and
    /// under [`Steps::Paper`], where each sample depends on the one before.
    pub fn samples_needed(&self, scene: &Scene, view: &View, progress: &Progress) -> Result<Option<u64>, RenderError> {
        if scene.kind() == RendererKind::Exact || view.settings.steps == Steps::Paper {
            return Ok(None);
        }
        let settings = RenderSettings { voxels: false, skip: Skip::Octree, ..view.settings };
        Ok(self.render(scene, &View { settings, ..view.clone() }, progress)?.samples)
    }

    /// How many leaves of an octree the view's transfer function shows; `None` for the exact renderer.
    pub fn active_leaves(&self, scene: &Scene, view: &View) -> Option<usize> {
        let Data::Octree { texture, .. } = &scene.data else { return None };
        let classifier = scene.classifier(view, texture.value_range());
        Some(Activity::new(texture, &Style::seen_with(&view.settings, &classifier, texture.root_edge())).leaves())
    }
}

impl Gpu {
    fn exact_mesh(&self, mesh: &TetMesh, field: &ScalarField, progress: &Progress) -> Result<ExactMesh, RenderError> {
        ExactMesh::check_room(&self.context, mesh.tets().len())?;
        Ok(ExactMesh::upload(&self.context, &CompactMesh::new(mesh, field, progress)?)?)
    }
}

impl Scene {
    fn of(placed: &impl Placed, data: Data) -> Self {
        Scene {
            center: placed.center(),
            diagonal: placed.bounds().diagonal(),
            data,
            fell_back: None,
            mesh: None,
            edges: Mutex::default(),
            activity: KeptActivity::default(),
        }
    }

    /// The same with the mesh that the octree is of, so that its edges can be drawn on planes.
    pub fn with_mesh(self, mesh: Option<Arc<TetMesh>>) -> Self {
        Scene { mesh, ..self }
    }

    /// Which renderer the scene is for.
    pub fn kind(&self) -> RendererKind {
        match self.data {
            Data::Octree { .. } => RendererKind::Octree,
            Data::Exact(_) | Data::ExactOnDevice { .. } => RendererKind::Exact,
        }
    }

    /// Why the CPU draws this scene though its renderer has a device: the device has no room for it.
    pub fn fell_back(&self) -> Option<&GpuError> {
        self.fell_back.as_ref()
    }

    /// Whether the scene lies on a device, which then draws it.
    pub fn is_on_device(&self) -> bool {
        match &self.data {
            Data::Octree { volume, .. } => volume.is_some(),
            Data::Exact(_) => false,
            Data::ExactOnDevice { .. } => true,
        }
    }

    /// Bytes that the exact renderer's data take, on the device or the host; `None` for an octree.
    pub fn exact_bytes(&self) -> Option<u64> {
        match &self.data {
            Data::Octree { .. } => None,
            Data::Exact(exact) => Some(exact.bytes() as u64),
            Data::ExactOnDevice { mesh, .. } => Some(mesh.bytes()),
        }
    }

    /// The octree texture on the host; `None` for the exact renderer.
    pub fn texture(&self) -> Option<&OctreeTexture> {
        match &self.data {
            Data::Octree { texture, .. } => Some(texture),
            Data::Exact(_) | Data::ExactOnDevice { .. } => None,
        }
    }

    /// The octree texture on the device, where there is one.
    pub fn volume(&self) -> Option<&OctreeVolume> {
        match &self.data {
            Data::Octree { volume, .. } => volume.as_deref(),
            Data::Exact(_) | Data::ExactOnDevice { .. } => None,
        }
    }

    /// Edge of the cube that rays are marched in, world units, and the values that 0 and 1 stand for.
    fn cube(&self) -> (f64, [f64; 2]) {
        match &self.data {
            Data::Octree { texture, .. } => (texture.root_edge(), texture.value_range()),
            Data::ExactOnDevice { mesh, value_range } => (mesh.cube_edge, *value_range),
            Data::Exact(_) => (1.0, [0.0, 1.0]),
        }
    }

    fn classifier(&self, view: &View, value_range: [f64; 2]) -> Classifier {
        Classifier::for_mode(&view.transfer_function, view.settings.mode, value_range, self.diagonal)
    }

    fn frame(&self, view: &View) -> RayFrame {
        let frame = view.camera.frame(self.center, view.settings.width, view.settings.height);
        frame.with_planes(&view.settings.planes, self.center)
    }
}
