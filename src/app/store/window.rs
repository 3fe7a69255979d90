//! The window: what is open, what is chosen, and what a frame does.

use super::super::stats::{Figures, Spread};
use super::StoreOptions;
use super::colors::{suitable, suited};
use super::cut::Cut;
use super::flat::Flat;
use super::play::Play;
use super::probe::Probed;
use super::space::{FlatFrame, FlatView, Space};
use super::spatial::Drag;
use super::stream::{Progress, Stream};
use super::view::{SPATIAL, Scene, View, places};
use crate::bricks::{BrickSource, SliceSet};
use crate::gpu::{Context, SlicePainter, SliceStyle};
use crate::view::{Camera, TransferFunction};
use anyhow::{Context as _, Result};
use egui::{Key, Rect, Ui};
use egui_wgpu::RenderState;
use glam::DVec3;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// After so long without a change everything rests, and the disk is asked.
const REST: Duration = Duration::from_millis(150);

/// Frames further apart than this are not of one movement, seconds.
const PAUSE_S: f64 = 0.5;

/// Bytes of bricks on the GPU: a software adapter's lie in the same memory as all else.
const DEVICE_BYTES: u64 = 1 << 30;
const SOFTWARE_BYTES: u64 = 256 << 20;

/// What width and height of pictures are divided by on a software adapter while something moves.
const COARSER: u32 = 2;

/// Height of what is above a picture, points.
const HEADER: f32 = 26.0;

/// What moves a picture when it changes.
#[derive(Debug, Clone, PartialEq)]
struct Moving {
    cuts: Vec<Cut>,
    camera: Camera,
    flats: [(usize, FlatView); 3],
    stretch: DVec3,
    rect: Rect,
}

/// The window's state.
pub struct StoreWindow {
    pub(super) name: String,
    pub(super) source: Arc<dyn BrickSource>,
    window: RenderState,
    is_software: bool,
    painter: SlicePainter,
    pub(super) stream: Stream,
    pub(super) cuts: Vec<Cut>,
    pub(super) selected: usize,
    /// The normal that was typed last.
    pub(super) typed_normal: DVec3,
    pub(super) flats: [Flat; 3],
    pub(super) camera: Camera,
    pub(super) stretch: DVec3,
    pub(super) style: SliceStyle,
    pub(super) map: String,
    pub(super) range_is_chosen: bool,
    /// Whether the full resolution is loaded whatever the screen shows.
    pub(super) is_whole: bool,
    pub(super) play: Play,
    pub(super) drag: Option<Drag>,
    /// The position under the pointer, index space.
    pub(super) pointed: Option<DVec3>,
    probed: Option<Probed>,
    views: [View; 4],
    /// The picture that has all the room.
    pub(super) maximised: Option<usize>,
    before: Option<Moving>,
    /// The slice that has moved since the frame before.
    moving: Option<usize>,
    moved: Instant,
    problem: Option<String>,
    frames: Spread,
    last_frame: Option<Instant>,
    last_frame_s: f64,
    /// What the line at the bottom said of bricks to come.
    shown_left: usize,
}

impl StoreWindow {
    /// Opens on three slices through the middle.
    pub fn new(creation: &eframe::CreationContext<'_>, options: StoreOptions) -> Result<Self> {
        let window = creation.wgpu_render_state.clone().context("the window has no GPU")?;
        let context = Context::from_parts(&window.adapter, window.device.clone(), window.queue.clone());
        let source = options.source;
        let is_software = context.is_software();
        let device_bytes = options.gpu_bytes.unwrap_or(if is_software { SOFTWARE_BYTES } else { DEVICE_BYTES });
        let painter = SlicePainter::new(&context);
        let ctx = creation.egui_ctx.clone();
        let stream = Stream::new(context, source.clone(), [options.memory_bytes, device_bytes], move || ctx.request_repaint())
            .context(options.name.clone())?;
        let dims = source.frame().dims;
        let cuts = [2, 1, 0].map(|axis| Cut::across(axis, (f64::from(dims[axis]) / 2.0).floor())).to_vec();
        let stretch = Space::first_stretch(source.frame());
        let value_range = source.range();
        let map = suitable(value_range);
        let range_is_chosen = options.transfer_function.as_ref().is_some_and(|tf| tf.range.is_some());
        let (map, mut transfer_function) = match options.transfer_function {
            Some(tf) => ("own".to_owned(), tf),
            None => (map.to_owned(), TransferFunction::preset(map)?),
        };
        let range = transfer_function.range.unwrap_or(value_range);
        transfer_function.range = Some(if range_is_chosen { range } else { suited(&map, range) });
        let camera = Camera::orbit(Space::new(source.frame(), stretch).bounds(), 1, 1.15);
        Ok(StoreWindow {
            name: options.name,
            source,
            window,
            is_software,
            painter,
            stream,
            cuts,
            selected: 0,
            typed_normal: DVec3::ZERO,
            flats: [0, 1, 2].map(Flat::new),
            camera,
            stretch,
            style: SliceStyle { transfer_function, value_range, is_smooth: true, tint: 0.0 },
            map,
            range_is_chosen,
            is_whole: false,
            play: Play::default(),
            drag: None,
            pointed: None,
            probed: None,
            views: Default::default(),
            maximised: None,
            before: None,
            moving: None,
            moved: Instant::now(),
            problem: None,
            frames: Spread::default(),
            last_frame: None,
            last_frame_s: 0.0,
            shown_left: 0,
        })
    }

    /// The slices.
    pub fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// Which slice is selected.
    pub fn selected(&self) -> usize {
        self.selected
    }

    /// How things are with the bricks.
    pub fn progress(&self) -> Progress {
        self.stream.progress()
    }

    /// The finest level that the pictures ask for.
    pub fn finest(&self) -> u8 {
        self.stream.finest()
    }

    /// What is under the pointer.
    pub fn probed(&self) -> Option<Probed> {
        self.probed
    }

    /// How colours follow values.
    pub fn style(&self) -> &SliceStyle {
        &self.style
    }

    /// Sets what the colours span, data units.
    pub fn set_range(&mut self, range: [f64; 2]) {
        (self.style.transfer_function.range, self.range_is_chosen) = (Some(range), true);
    }

    /// Whether a slice plays.
    pub fn is_playing(&self) -> bool {
        self.play.playing.is_some()
    }

    /// Whether nothing moves, and all that the pictures ask for is drawn.
    pub fn is_settled(&self) -> bool {
        let is_asked = self.before.is_some() && self.stream.is_ready();
        is_asked && !self.is_moving() && self.stream.progress().left == 0 && !self.stream.has_more()
    }

    /// Seconds from one frame to the next while something moved.
    pub fn frame_times(&self) -> Option<Figures> {
        self.frames.figures()
    }

    /// What went wrong last.
    pub fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }

    fn is_moving(&self) -> bool {
        self.play.playing.is_some() || self.moved.elapsed() < REST
    }

    /// From voxels to the window.
    pub(super) fn space(&self) -> Space {
        Space::new(self.source.frame(), self.stretch)
    }

    /// What a slice is called: its kind, with a number from the second of a kind on.
    pub(super) fn title(&self, number: usize) -> String {
        let Some(cut) = self.cuts.get(number) else { return String::new() };
        match self.cuts[..number].iter().filter(|other| other.name() == cut.name()).count() {
            0 => cut.name().to_owned(),
            before => format!("{} {}", cut.name(), before + 1),
        }
    }

    /// Moves a slice by so many voxels.
    pub(super) fn step(&mut self, number: usize, by: f64) {
        let dims = self.source.frame().dims;
        if let Some(cut) = self.cuts.get_mut(number) {
            *cut = cut.at(cut.position + by, dims);
        }
    }

    /// Takes a slice away; the last one stays.
    pub(super) fn remove(&mut self, number: usize) {
        if self.cuts.len() < 2 || number >= self.cuts.len() {
            return;
        }
        self.cuts.remove(number);
        (self.drag, self.play.playing) = (None, None);
        let after = |i: usize| if i > number { i - 1 } else { i };
        self.selected = after(self.selected).min(self.cuts.len() - 1);
        for flat in &mut self.flats {
            flat.cut = after(flat.cut).min(self.cuts.len() - 1);
        }
    }

    fn obey_keys(&mut self, ctx: &egui::Context) {
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let steps = [(Key::ArrowLeft, -1.0), (Key::ArrowDown, -1.0), (Key::ArrowRight, 1.0), (Key::ArrowUp, 1.0)];
        let steps = steps.into_iter().chain([(Key::PageDown, -10.0), (Key::PageUp, 10.0)]);
        let by: f64 = ctx.input(|input| steps.map(|(key, by)| by * input.num_presses(key) as f64).sum());
        if by != 0.0 {
            self.step(self.selected, by);
        }
        if ctx.input(|input| input.key_pressed(Key::Space)) {
            self.play.flip(self.selected);
        }
        if ctx.input(|input| input.key_pressed(Key::Escape)) {
            self.maximised = None;
        }
    }

    fn advance(&mut self, ctx: &egui::Context) {
        let dims = self.source.frame().dims;
        let Some(number) = self.play.playing else { return };
        let Some(cut) = self.cuts.get(number).copied() else {
            self.play.playing = None;
            return;
        };
        let position = self.play.advance(Instant::now(), cut.position, cut.range(dims));
        self.cuts[number] = Cut { position, ..cut };
        ctx.request_repaint();
    }

    /// The four pictures: input, bricks, drawing.
    fn pictures(&mut self, ui: &mut Ui) {
        let whole = ui.available_rect_before_wrap();
        let points = ui.ctx().pixels_per_point();
        ui.painter().rect_filled(whole, 0.0, ui.visuals().extreme_bg_color);
        let mut pictures = Vec::new();
        for (number, place) in places(whole, self.maximised) {
            let (header, rect) = place.split_top_bottom_at_y(place.top() + HEADER);
            ui.scope_builder(egui::UiBuilder::new().max_rect(header), |ui| self.header(ui, number, header));
            let rect = egui::emath::GuiRounding::round_to_pixels(rect, points);
            if rect.is_positive() {
                pictures.push((number, rect));
            }
        }
        self.pointed = None;
        for &(number, rect) in &pictures {
            if number == SPATIAL { self.work_spatial(ui, rect) } else { self.work_flat(ui, number, rect) }
        }
        self.note_motion(whole);
        let scenes: Vec<(usize, Scene)> =
            pictures.iter().filter_map(|&(number, rect)| Some((number, self.scene(number, rect, points)?))).collect();
        let seen: Vec<_> = scenes.iter().flat_map(|(_, scene)| scene.seen()).collect();
        let slices = self.slice_set();
        let is_moving = self.is_moving();
        let divisor = if is_moving && self.is_software { COARSER } else { 1 };
        let scenes: Vec<(usize, Scene)> = scenes.into_iter().map(|(number, scene)| (number, scene.coarser(divisor))).collect();
        self.probed = self.pointed.and_then(|at| Probed::at(at, &self.space(), &self.stream));
        self.stream.update(&seen, &slices, is_moving, self.probed.filter(|_| !is_moving).map(|probed| probed.brick()));
        for (number, scene) in &scenes {
            let drawn = self.views[*number].draw(&self.window, &mut self.painter, &mut self.stream, &self.style, scene);
            if let Err(error) = drawn {
                self.problem = Some(error.to_string());
            }
        }
        for (number, scene) in &scenes {
            self.paint(ui.painter(), *number, scene.rect);
        }
        if let Some(error) = self.stream.take_error() {
            self.problem = Some(error.to_string());
        }
        if !self.range_is_chosen && self.stream.is_ready() {
            self.suit_range();
            self.range_is_chosen = true;
        }
        if self.stream.has_more() || self.stream.progress().left != self.shown_left {
            ui.ctx().request_repaint();
        } else if is_moving {
            ui.ctx().request_repaint_after(REST + Duration::from_millis(10));
        }
    }

    fn scene(&self, number: usize, rect: Rect, points: f32) -> Option<Scene> {
        let space = self.space();
        if number == SPATIAL {
            return Some(Scene::space(rect, &self.camera, &self.cuts, &space, self.is_whole, points));
        }
        let flat = &self.flats[number];
        let cut = self.cuts.get(flat.cut)?;
        Some(Scene::flat(&FlatFrame::new(&space, cut, &flat.view, rect), cut, &space, self.is_whole, points))
    }

    fn paint(&self, painter: &egui::Painter, number: usize, rect: Rect) {
        if number == SPATIAL {
            self.paint_box(painter, rect, false);
            self.views[number].paint(painter, rect);
            self.paint_box(painter, rect, true);
            self.paint_handles(painter, rect);
        } else {
            self.views[number].paint(painter, rect);
            self.paint_lines(painter, number, rect);
        }
    }

    /// The slices, and which of them has moved since the frame before.
    fn slice_set(&self) -> SliceSet {
        let dims = self.source.frame().dims;
        let planes: Vec<_> = self.cuts.iter().map(|cut| cut.plane(dims)).collect();
        SliceSet { moving: self.moving, planes }
    }

    /// Takes note of the time if something has changed.
    fn note_motion(&mut self, rect: Rect) {
        let flats = [0, 1, 2].map(|i| (self.flats[i].cut, self.flats[i].view));
        let now = Moving { cuts: self.cuts.clone(), camera: self.camera, flats, stretch: self.stretch, rect };
        let is_another = |before: &Cut, now: &Cut| (before.normal, before.position) != (now.normal, now.position);
        let before = self.before.as_ref().map_or(&[][..], |before| &before.cuts[..]);
        self.moving = before.iter().zip(&now.cuts).position(|(before, now)| is_another(before, now));
        if self.before.as_ref() != Some(&now) {
            self.before = Some(now);
            self.moved = Instant::now();
        }
    }

    fn note_frame(&mut self) {
        let now = Instant::now();
        if let Some(last) = self.last_frame.replace(now).filter(|_| self.is_moving()) {
            let seconds = (now - last).as_secs_f64();
            if seconds < PAUSE_S {
                self.last_frame_s = seconds;
                self.frames.add(seconds);
            }
        }
    }

    pub(super) fn last_frame_ms(&self) -> f64 {
        self.last_frame_s * 1e3
    }
}

impl eframe::App for StoreWindow {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.note_frame();
        self.obey_keys(&ctx);
        self.advance(&ctx);
        egui::Panel::left("controls").exact_size(300.0).resizable(false).show(ui, |ui| {
            egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                ui.set_max_width(ui.available_width() - 8.0);
                self.panel(ui);
            });
        });
        egui::Panel::bottom("status").exact_size(24.0).resizable(false).show(ui, |ui| self.shown_left = self.status_line(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.pictures(ui));
    }
}
