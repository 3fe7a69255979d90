//! The window: what is open, what is chosen, what is shown, and what is on its way.

use super::Options;
use super::actions::Histories;
use super::camera_panel::CameraJob;
use super::dock::Docked;
use super::drawing::Drawing;
use super::files::{Dialog, Loading, SessionJob};
use super::furniture::{self, Look};
use super::jobs::{Job, Polled, discard, outcome};
use super::leaves::Leaves;
use super::model::{self, Data, Document, ExactStep, InTime};
use super::navigate;
use super::octree_stage::{Measured, OctreeStage};
use super::pace::Pace;
use super::pictures::{Pictures, Saving, absolute};
use super::plane_handles::PlaneTool;
use super::probe_tool::{Pin, ProbeTool};
use super::problem::Problem;
use super::quality::QualityTool;
use super::recent::Recent;
use super::settings::{Settings, Transfer};
use super::slot::Slot;
use super::stats::{self, Part, SharedStats, WindowStats};
use super::time_stage::TimeStage;
use super::transfer_editor::TransferEditor;
use super::tuning::Tuning;
use super::viewport::Viewport;
use super::wipe::{Wipe, WipeMode};
use crate::furniture::Parts;
use crate::geometry::Placed;
use crate::gpu::FrameTime;
use crate::mesh::FieldSelection;
use crate::octree::{ErrorBound, OctreeParams, Unmet};
use crate::progress::Progress;
use crate::render::{Renderer, Scene};
use crate::study::FieldError;
use crate::study::probe::LineSamples;
use crate::view::{Camera, Isosurfaces, Mode, Planes, RenderSettings, RendererKind, View};
use anyhow::{Context, Result};
use std::mem::{replace, take};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Why nothing is written now.
pub(super) const BUSY: &str = "something is being written already";

/// How often a bar moves.
const BAR: Duration = Duration::from_millis(100);

/// The window's state.
pub struct Viewer {
    pub(super) document: Document,
    pub(super) settings: Settings,
    pub(super) time: TimeStage,
    pub(super) octree: OctreeStage,
    pub(super) viewport: Viewport,
    pub(super) opening: Camera,
    pub(super) histories: Histories,
    pub(super) help_is_open: bool,
    pub(super) camera_job: Option<CameraJob>,
    pub(super) transfer_editor: TransferEditor,
    pub(super) plane_tool: PlaneTool,
    pub(super) probe: ProbeTool,
    pub(super) quality: QualityTool,
    pub(super) wipe: Wipe,
    pub(super) leaves: Leaves,
    pub(super) tuning: Tuning,
    /// Which plot is under the picture, and which there were in the frame before.
    pub(super) dock: Docked,
    pub(super) dock_before: Vec<Docked>,
    pub(super) exact: ExactStage,
    /// The views that the pictures were marched for, by slot; `None` if the scene is another since.
    pub(super) shown: [Option<View>; Slot::COUNT],
    /// What these pictures took.
    pub(super) frame_times: [Option<FrameTime>; Slot::COUNT],
    pub(super) loading: Option<Loading>,
    pub(super) saving: Option<Saving>,
    pub(super) session_job: Option<SessionJob>,
    pub(super) dialog: Option<Dialog>,
    pub(super) recent: Recent,
    pub(super) problem: Option<Problem>,
    pub(super) pictures: Pictures,
    /// Of the display.
    pub(super) pixels_per_point: f64,
    /// Shaders that a picture waits for.
    pub(super) compiling: Option<(Slot, Job<Result<()>>)>,
    pub(super) cutting: Option<Job<Result<()>>>,
    pub(super) drawing: Option<Drawing>,
    status: Status,
    pub(super) renderer: Arc<Renderer>,
    /// Of the pictures, by slot.
    pub(super) paces: [Pace; Slot::COUNT],
    /// What is being marched.
    pub(super) marching: Slot,
    /// Seconds that the parts of the picture being refined took so far.
    pub(super) refining_s: Option<f64>,
    /// Pixels of the picture's place in the window.
    pub(super) size: [u32; 2],
    /// What the frame before was drawn with, and when that or the octree last changed.
    seen: Seen,
    pub(super) moved: Instant,
    memory_bytes: u64,
    folder: PathBuf,
    /// What frames took so far.
    pub(super) stats: SharedStats,
}

/// The numbers of a built octree.
#[derive(Debug, Clone, PartialEq)]
pub struct OctreeNumbers {
    /// Interior cells and full leaves.
    pub nodes: usize,
    /// Full leaves by depth, from depth 0.
    pub leaves_by_depth: Vec<usize>,
    /// Bytes of the texture.
    pub bytes: usize,
    /// Bytes of the mesh's surface, if rays are cut to it.
    pub surface_bytes: Option<usize>,
    /// Where the tolerance is not met, if there is one.
    pub unmet: Option<Unmet>,
    /// The error, once it is measured.
    pub error: Option<FieldError>,
    /// What it exceeds nowhere, once that is found.
    pub bound: Option<ErrorBound>,
}

/// One line for the user.
#[derive(Default)]
struct Status {
    text: String,
    is_error: bool,
}

/// The settings that change the picture of the same octree.
#[derive(PartialEq)]
struct Seen(Camera, Transfer, RenderSettings);

impl Seen {
    fn of(settings: &Settings) -> Self {
        Seen(settings.camera, settings.transfer.clone(), settings.render)
    }
}

/// What an exact picture is made from.
pub(super) type ExactKey = (FieldSelection, View);

/// The mesh itself: being linked; where the device has no room for it, being drawn in the background too.
#[derive(Default)]
pub(super) struct ExactStage {
    /// What the last job was started for.
    pub(super) key: Option<ExactKey>,
    pub(super) job: Option<Job<Result<ExactStep>>>,
    /// Whether the job has given a picture, and whether that was the last.
    pub(super) given: bool,
    pub(super) complete: bool,
    /// The linked mesh, for views of this field.
    pub(super) scene: Option<(FieldSelection, Arc<Scene>)>,
}

impl Viewer {
    /// The window's state before its first frame.
    pub fn new(creation: &eframe::CreationContext<'_>, options: Options) -> Result<Self> {
        let window = creation.wgpu_render_state.as_ref().context("the window has no GPU device")?;
        creation.egui_ctx.set_theme(egui::Theme::Dark);
        let viewport = Viewport::new(window)?;
        let renderer = Arc::new(Renderer::on(viewport.context().clone(), options.device)?);
        let stats = SharedStats::new(WindowStats::new(viewport.context().adapter()).into());
        let field = FieldSelection { name: Some(options.subject.array().to_owned()), component: options.component };
        let settings = Settings {
            field: field.clone(),
            params: options.params,
            camera: options.view.camera,
            transfer: Transfer::new(options.view.transfer_function),
            render: RenderSettings { min_transmittance: RenderSettings::INTERACTIVE, ..options.view.settings },
            look: Look::default(),
        };
        let (data, time) = (Data::of(&options.subject), InTime::of(&options.source)?.0);
        let mut viewer = Viewer {
            time: TimeStage::new(&time, data.bounds().diagonal()),
            document: Document { name: options.name, source: options.source, data, field, time },
            opening: settings.camera,
            histories: Histories::new(&settings),
            help_is_open: false,
            camera_job: None,
            transfer_editor: TransferEditor::new(),
            octree: OctreeStage::new(options.error),
            exact: ExactStage::default(),
            shown: Default::default(),
            frame_times: Default::default(),
            plane_tool: PlaneTool::default(),
            probe: ProbeTool::default(),
            quality: QualityTool::default(),
            wipe: Wipe::default(),
            leaves: Leaves::default(),
            tuning: Tuning::default(),
            dock: Docked::Profile,
            dock_before: vec![],
            viewport,
            loading: None,
            saving: None,
            session_job: None,
            dialog: None,
            recent: Recent::of(options.recent),
            problem: None,
            pictures: Pictures::default(),
            pixels_per_point: 1.0,
            compiling: None,
            cutting: None,
            drawing: None,
            status: Status::default(),
            renderer,
            paces: Default::default(),
            marching: Slot::Octree,
            refining_s: None,
            size: [0; 2],
            seen: Seen::of(&settings),
            settings,
            moved: Instant::now(),
            memory_bytes: options.memory_bytes,
            folder: options.folder,
            stats,
        };
        if let Some(session) = &options.session {
            viewer.take_look(session);
            viewer.histories = Histories::new(&viewer.settings);
        }
        viewer.recent.note(&viewer.document.source);
        if let Some(path) = options.compare_with {
            viewer.compare_with(&creation.egui_ctx, path);
        }
        Ok(viewer)
    }

    /// The numbers of the octree, once there is one.
    pub fn octree_numbers(&self) -> Option<OctreeNumbers> {
        let model = self.octree.model.as_ref()?;
        let accuracy = self.octree.accuracy.accuracy();
        Some(OctreeNumbers {
            nodes: model.nodes,
            leaves_by_depth: model.leaves_by_depth.clone(),
            bytes: model.bytes,
            surface_bytes: model.surface.as_ref().map(|surface| surface.bytes()),
            unmet: model.unmet,
            error: accuracy.map(|accuracy| accuracy.error.clone()),
            bound: accuracy.and_then(|accuracy| accuracy.bound),
        })
    }

    /// Whether the picture is the one asked for, in full, and nothing is on its way; the octree's error may still be measured.
    pub fn is_settled(&self) -> bool {
        self.slots().into_iter().all(|slot| self.is_shown(slot))
            && !self.viewport.is_marching()
            && self.drawing.is_none()
            && self.activity().is_none()
            && !self.recent.is_noting()
    }

    /// Width and height of the picture in pixels. It lies in the window's upper right corner.
    pub fn picture_size(&self) -> [u32; 2] {
        self.size
    }

    /// The labels that the probe has pinned.
    pub fn pins(&self) -> &[Pin] {
        &self.probe.pins
    }

    /// How many ends of the probe's line are set.
    pub fn probe_ends(&self) -> usize {
        self.probe.ends.len()
    }

    /// How many leaves are drawn over the picture, and of how many.
    pub fn leaves_drawn(&self) -> Option<(usize, usize)> {
        self.leaves.drawn
    }

    /// What is along the probe's line, once it is known.
    pub fn profile_samples(&self) -> Option<&LineSamples> {
        self.probe.profile.as_ref()
    }

    /// The thresholds chosen.
    pub fn params(&self) -> &OctreeParams {
        &self.settings.params
    }

    /// Takes other thresholds, as moving their sliders does.
    pub fn set_params(&mut self, params: OctreeParams) {
        self.settings.params = params;
    }

    /// From where the picture is seen.
    pub fn camera(&self) -> Camera {
        self.settings.camera
    }

    /// Sees it from elsewhere, as navigating does.
    pub fn set_camera(&mut self, camera: Camera) {
        self.settings.camera = camera;
    }

    /// What of the furniture is shown.
    pub fn parts(&self) -> Parts {
        self.settings.look.parts
    }

    /// Shows these pieces of furniture, as their checkboxes do.
    pub fn set_parts(&mut self, parts: Parts) {
        self.settings.look.parts = parts;
    }

    /// Whether what is under the pointer is said.
    pub fn is_probing(&self) -> bool {
        self.probe.is_on
    }

    /// Whether two pictures are shown in one.
    pub fn is_comparing(&self) -> bool {
        self.wipe.mode != WipeMode::Off
    }

    /// The line at the bottom of the window.
    pub fn status(&self) -> &str {
        &self.status.text
    }

    /// What the window's frames took so far.
    pub fn stats(&self) -> WindowStats {
        stats::lock(&self.stats).clone()
    }

    fn did(&self, part: Part) {
        stats::lock(&self.stats).did(part);
    }

    /// The job on its way: what it does and how much is done.
    pub(super) fn activity(&self) -> Option<(&'static str, Option<f32>)> {
        let named = |(stage, done): (&'static str, Option<f32>)| (if stage.is_empty() { "working" } else { stage }, done);
        let jobs = [
            self.loading.as_ref().map(Job::progress),
            self.time_progress(),
            self.octree.progress(),
            self.exact.job.as_ref().map(Job::progress),
            self.saving.as_ref().map(Job::progress),
            self.session_job.as_ref().map(Job::progress),
            self.compiling.as_ref().map(|(_, job)| job.progress()),
            self.cutting.as_ref().map(Job::progress),
            self.probe.progress(),
            self.quality.progress(),
            self.tuning.progress(),
        ];
        jobs.into_iter().flatten().next().map(named)
    }

    pub(super) fn is_error(&self) -> bool {
        self.status.is_error
    }

    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.status = Status { text: text.into(), is_error: false };
    }

    pub(super) fn fail(&mut self, error: anyhow::Error) {
        let text = format!("{error:#}").lines().collect::<Vec<_>>().join(" ");
        self.status = Status { text, is_error: true };
    }

    /// Chooses a renderer. A volume has none but the octree's.
    pub(super) fn draw_with(&mut self, kind: RendererKind) {
        let has_exact = self.document.data.mesh().is_some();
        if kind == RendererKind::Exact && !has_exact {
            return self.say("the exact renderer draws tetrahedral meshes; this is a volume, of which there is the octree's picture only");
        }
        self.settings.render.renderer = kind;
    }

    /// Has the picture of a renderer marched anew, since its scene is another.
    pub(super) fn show_anew(&mut self, slot: Slot) {
        self.shown[slot as usize] = None;
        self.viewport.stop_refining(slot);
        self.clear_error();
        if self.slots().contains(&slot) {
            self.moved = Instant::now();
        }
    }

    /// The renderer chosen.
    pub(super) fn kind(&self) -> RendererKind {
        self.settings.render.renderer
    }

    /// The view that fills the viewport.
    pub(super) fn wanted(&self) -> View {
        let shown = self.document.data.bounds().diagonal();
        // Steps of a series are equally opaque, whatever their bounds.
        let of_series = self.time.unit_diagonal(shown);
        let mut view = self.settings.view(self.size, of_series.unwrap_or(shown));
        let tf = &mut view.transfer_function;
        tf.unit_distance = tf.unit_distance.or(of_series.map(|diagonal| tf.unit_distance_world(diagonal)));
        view
    }

    /// The same view as it is measured and saved.
    pub(super) fn exact_view(&self) -> View {
        let view = self.wanted();
        View { settings: RenderSettings { min_transmittance: RenderSettings::new(1, 1).min_transmittance, ..view.settings }, ..view }
    }

    /// Takes what jobs have given and starts those that the settings ask for.
    fn run_jobs(&mut self, ctx: &egui::Context) {
        self.run_files(ctx);
        self.run_time(ctx);
        self.run_octree(ctx);
        self.run_exact(ctx);
        self.run_camera_job();
        self.run_transfer_files();
        match self.saving.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => {}
            Some(ended) => {
                self.saving = None;
                match outcome(ended) {
                    Ok(done) => self.say(done),
                    Err(error) => self.fail(error),
                }
            }
        }
        if let Err(error) = self.probe.run(ctx, &self.document.data, &self.settings.field, self.octree.model.as_ref()) {
            self.fail(error);
        }
        if let Err(error) = self.run_leaves(ctx).and_then(|()| self.run_tuning()).and_then(|()| self.run_quality(ctx)) {
            self.fail(error);
        }
        if self.activity().is_some() || self.tuning.is_running() || matches!(self.octree.accuracy, Measured::Running(..)) {
            ctx.request_repaint_after(BAR);
        }
    }

    /// What pictures are drawn from at their best, for the renderer chosen.
    pub(super) fn picture_scene(&self) -> Option<Arc<Scene>> {
        let field = &self.settings.field;
        match self.kind() {
            RendererKind::Octree => self.octree.model.as_ref().filter(|model| model.field == *field).map(|model| model.scene.clone()),
            RendererKind::Exact => self.exact.scene.as_ref().filter(|(of, _)| of == field).map(|(_, scene)| scene.clone()),
        }
    }

    /// A volume is drawn from its octree only.
    pub(super) fn settle_renderer(&mut self) {
        if self.document.data.mesh().is_none() {
            self.settings.render.renderer = RendererKind::Octree;
        }
    }

    /// Puts another document in the place of the one that is open.
    pub(super) fn show_document(&mut self, document: Document) {
        self.opening = Camera::orbit(document.data.bounds().translated(document.data.center()), 0, 1.0);
        self.settings.camera = self.opening;
        self.settings.field = document.field.clone();
        // Values and places of the data before mean nothing in these.
        let render = &mut self.settings.render;
        (render.planes, render.isosurfaces) = (Planes::NONE, Isosurfaces::NONE);
        if render.mode == Mode::Iso {
            render.mode = Mode::Composite;
        }
        render.step_world = None;
        self.settings.transfer.forget_data();
        self.settings.transfer.base.unit_distance = None;
        self.time = self.time.renewed(&document);
        let octree = self.octree.emptied();
        let before = (replace(&mut self.document, document), replace(&mut self.octree, octree), take(&mut self.exact));
        let probe = self.probe.emptied();
        discard((before, replace(&mut self.probe, probe), take(&mut self.wipe)));
        self.transfer_editor.forget_data();
        self.plane_tool = self.plane_tool.emptied();
        self.tuning = self.tuning.emptied();
        (self.shown, self.drawing) = (Default::default(), None);
        Slot::ALL.into_iter().for_each(|slot| self.viewport.stop_refining(slot));
        self.viewport.empty(Slot::Kept);
        self.moved = Instant::now();
    }

    fn run_octree(&mut self, ctx: &egui::Context) {
        let Settings { field, params, .. } = &self.settings;
        // Beside the exact picture the octree is built for its numbers, and to be there when it is wanted: after that picture.
        let linked = self.exact.job.is_none() && self.exact.scene.as_ref().is_some_and(|(of, _)| of == field);
        let build = self.slots().contains(&Slot::Octree) || linked || self.wipe.awaits;
        match self.octree.run(ctx, &self.renderer, &self.document.data, (field, params), build) {
            Ok(true) => self.show_anew(Slot::Octree),
            Ok(false) => {}
            Err(error) => self.fail(error),
        }
    }

    fn run_exact(&mut self, ctx: &egui::Context) {
        self.take_exact();
        let mesh = self.document.data.mesh().filter(|_| self.slots().contains(&Slot::Exact)).cloned();
        let Some(mesh) = mesh else { return self.rest_exact() };
        let key = (self.settings.field.clone(), self.exact_view());
        let is_on_device = self.exact.scene.as_ref().is_some_and(|(field, scene)| *field == key.0 && scene.is_on_device());
        if self.size.contains(&0) || self.exact.key.as_ref() == Some(&key) || is_on_device {
            return;
        }
        // A job that has drawn nothing yet goes on, lest a moving view never be seen; one for another field is of no use.
        let other_field = self.exact.key.as_ref().is_some_and(|(field, _)| *field != key.0);
        if self.exact.job.is_none() || self.exact.given || other_field {
            let scene = self.exact.scene.clone().filter(|(field, _)| *field == key.0).map(|(_, scene)| scene);
            let (renderer, (field, view)) = (self.renderer.clone(), key.clone());
            self.exact.job = Some(Job::start(ctx, move |progress, results| {
                let drawn = model::draw_exact(&renderer, &mesh, &field, scene, &view, progress, |step| results.give(Ok(step)));
                drawn.unwrap_or_else(|error| results.give(Err(error)));
            }));
            (self.exact.key, self.exact.given, self.exact.complete) = (Some(key), false, false);
        }
    }

    /// Leaves off what is of no use while the octree is looked at: a mesh half linked is wanted soon again.
    fn rest_exact(&mut self) {
        let of_field = |field: &FieldSelection| *field == self.settings.field;
        let linked = self.exact.scene.as_ref().is_some_and(|(field, _)| of_field(field));
        let linking = self.exact.job.is_some() && !linked && self.exact.key.as_ref().is_some_and(|(field, _)| of_field(field));
        if !linking {
            self.exact.job = None;
            if !self.exact.complete {
                self.exact.key = None;
            }
        }
    }

    fn take_exact(&mut self) {
        while let Some(polled) = self.exact.job.as_ref().map(Job::poll) {
            match polled {
                Polled::Pending => return,
                Polled::Ended => {
                    self.exact.job = None;
                    let marched = self.exact.scene.as_ref().is_some_and(|(_, scene)| scene.is_on_device());
                    if !(self.exact.complete || marched || self.is_error()) {
                        self.fail(outcome::<()>(Polled::Ended).expect_err("an end without result"));
                    }
                }
                Polled::Result(Err(error)) => self.fail(error),
                Polled::Result(Ok(ExactStep::Linked(scene))) => {
                    if let Some(reason) = scene.fell_back() {
                        self.say(format!("{reason}; drawing on the CPU"));
                    }
                    self.exact.scene = self.exact.key.as_ref().map(|(field, _)| (field.clone(), scene));
                    if self.exact.scene.as_ref().is_some_and(|(_, scene)| scene.is_on_device()) {
                        self.show_anew(Slot::Exact);
                    }
                }
                Polled::Result(Ok(ExactStep::Picture { picture, complete })) => {
                    (self.exact.given, self.exact.complete) = (true, complete);
                    self.frame_times[RendererKind::Exact as usize] = Some(FrameTime { wall_s: picture.wall_s, gpu_s: None });
                    match self.viewport.put(Slot::Exact, &picture.image) {
                        Ok(()) => self.clear_error(),
                        Err(error) => self.fail(error.into()),
                    }
                }
            }
        }
    }

    fn clear_error(&mut self) {
        if self.status.is_error {
            self.status = Status::default();
        }
    }

    /// The picture's place: input, marching, painting.
    fn picture(&mut self, ui: &mut egui::Ui) {
        let whole = ui.available_rect_before_wrap();
        let places = self.places(whole);
        let rect = places.map_or(whole, |[_, rect]| rect);
        let picture = ui.interact(rect, ui.scope_id().with("picture"), egui::Sense::click_and_drag());
        picture.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "picture"));
        let screen = ui.ctx().viewport_rect().size() * ui.ctx().pixels_per_point();
        let screen = [screen.x.round() as u32, screen.y.round() as u32];
        let pixels = egui::epaint::ViewportInPixels::from_points(&rect, ui.ctx().pixels_per_point(), screen);
        self.size = [pixels.width_px, pixels.height_px].map(|n| (n.max(0) as u32).min(self.viewport.longest_side()));

        self.settings.camera = navigate::moved(self.settings.camera, &picture, ui, self.extent());
        if let Some([beside, _]) = places {
            self.picture_beside(ui, beside);
        }
        if let Some(at) = picture.interact_pointer_pos().filter(|_| picture.double_clicked() && !self.probe.is_on) {
            self.recentre(rect, at);
        }
        self.drag_planes(ui, rect);
        self.histories.watch(ui.ctx(), &self.settings);
        let seen = Seen::of(&self.settings);
        if self.seen != seen {
            self.seen = seen;
            self.moved = Instant::now();
        }
        self.march(ui.ctx());
        let [r, g, b] = self.settings.look.background();
        ui.painter().rect_filled(whole, 0.0, egui::Color32::from_rgb(r, g, b));
        let drawing = self.furniture(rect.size(), self.settings.look.parts);
        furniture::paint(ui.painter(), rect, &drawing.behind, drawing.halo);
        match places {
            Some(places) => self.paint_beside(ui.painter(), places),
            None if self.viewport.is_filled() => self.viewport.paint(ui.painter(), rect, self.size, self.compared()),
            None => {}
        }
        furniture::paint(ui.painter(), rect, &drawing.front, drawing.halo);
        self.leaves_over(ui, rect);
        self.planes_over(ui, rect);
        self.quality_over(ui, rect);
        self.wipe_over(ui, whole);
        self.probe_over(ui, rect, &picture);
        self.tools_over(ui, whole);
    }

    /// The line at the bottom.
    fn status_line(&self, ui: &mut egui::Ui) {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let device = &self.viewport.context().info;
            if ui.available_width() > 700.0 {
                let draws = if self.renderer.adapter().is_some() { "" } else { ", the CPU draws" };
                ui.weak(format!("{} ({}){draws}", device.name, device.backend));
                ui.separator();
            }
            ui.weak(self.frame_label());
            ui.separator();
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                if let Some((stage, done)) = self.activity() {
                    let bar = egui::ProgressBar::new(done.unwrap_or(0.0)).desired_width(100.0).desired_height(12.0);
                    ui.add(bar).widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, stage));
                    ui.add(egui::Label::new(stage).truncate());
                }
                let text = egui::RichText::new(self.status());
                let text = if self.is_error() { text.color(ui.visuals().error_fg_color) } else { text };
                ui.add(egui::Label::new(text).truncate()).on_hover_text(self.status());
            });
        });
    }

    pub(super) fn frame_label(&self) -> String {
        match self.frame_times[Slot::from(self.kind()) as usize] {
            Some(FrameTime { gpu_s: Some(s), .. }) => format!("frame {:.2} ms on the GPU", s * 1e3),
            Some(FrameTime { wall_s, gpu_s: None }) => format!("frame {:.0} ms", wall_s * 1e3),
            None => "no frame yet".into(),
        }
    }

    /// Writes a file in the background and says where.
    pub(super) fn save(&mut self, ctx: &egui::Context, write: impl FnOnce(&Progress) -> Result<PathBuf> + Send + 'static) {
        if self.saving.is_some() {
            return self.say(BUSY);
        }
        self.saving = Some(Job::start(ctx, move |progress, results| {
            results.give(write(progress).map(|path| format!("wrote {}", absolute(&path).display())));
        }));
    }

    /// Where files are written.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// What draws.
    pub(super) fn renderer(&self) -> &Arc<Renderer> {
        &self.renderer
    }

    /// Budget for mesh and octree in bytes.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Shows all of the mesh from the same direction.
    pub(super) fn fit(&mut self) {
        let data = &self.document.data;
        let aspect = f64::from(self.size[0].max(1)) / f64::from(self.size[1].max(1));
        self.settings.camera = self.settings.camera.fitted(data.bounds().translated(data.center()), aspect);
    }

    /// Looks along an axis at all of the mesh.
    pub(super) fn face(&mut self, forward: glam::DVec3, up: glam::DVec3) {
        self.settings.camera = self.settings.camera.facing(forward, up);
        self.fit();
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        stats::lock(&self.stats).begin(frame.info().cpu_usage);
        self.pixels_per_point = f64::from(ctx.pixels_per_point());
        self.obey_keys(&ctx);
        self.take_dropped(&ctx);
        self.did(Part::Input);
        egui::Panel::left("controls").exact_size(300.0).resizable(false).show(ui, |ui| {
            egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                // The scroll bar floats over the rest.
                ui.set_max_width(ui.available_width() - 8.0);
                self.panel(ui);
            });
        });
        egui::Panel::bottom("status").exact_size(24.0).resizable(false).show(ui, |ui| self.status_line(ui));
        self.time_bar(ui);
        self.dock(ui);
        self.did(Part::Panels);
        self.run_jobs(&ctx);
        self.did(Part::Jobs);
        egui::CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        self.did(Part::Picture);
        self.help_sheet(&ctx);
        self.turntable_panel(&ctx);
        self.problem_panel(&ctx);
        self.did(Part::Sheets);
        stats::lock(&self.stats).end(self.size);
    }
}
