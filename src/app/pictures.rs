//! Pictures in files: screenshots of any size, and turntables.

use super::jobs::Job;
use super::keys::{Action, tip};
use super::model;
use super::viewer::{BUSY, Viewer};
use super::widgets::{choice, rows};
use crate::furniture::{Furniture, Part, Parts, paint};
use crate::geometry::{Aabb, Placed};
use crate::image::{Background, Image, Template};
use crate::view::{Camera, RenderSettings, TransferFunction, View};
use anyhow::{Context, Result};
use egui::{DragValue, Ui};
use glam::DVec2;
use std::path::{Path, PathBuf};

/// How large pictures are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureSize {
    /// As in the window, or so many times as wide and high.
    Times(u32),
    /// So many pixels.
    Own([u32; 2]),
}

/// How pictures are written.
pub struct Pictures {
    size: PictureSize,
    /// The last size of the user's own.
    own: [u32; 2],
    /// Whether they keep their alpha.
    pub transparent: bool,
    /// Pictures of a turntable.
    frames: u32,
    turntable_is_open: bool,
}

/// Writing on its way: what it says when it is done.
pub type Saving = Job<Result<String>>;

/// What belongs into a picture besides the scene.
struct Finish {
    parts: Parts,
    title: String,
    value_range: [f64; 2],
    transfer_function: TransferFunction,
    bounds: Aabb,
    background: [f32; 3],
    transparent: bool,
    /// Pixels a point.
    scale: f64,
}

impl Default for Pictures {
    fn default() -> Self {
        Pictures { size: PictureSize::Times(1), own: [1920, 1080], transparent: false, frames: 120, turntable_is_open: false }
    }
}

impl Pictures {
    /// Takes a size and whether alpha is kept.
    pub fn take(&mut self, size: [u32; 2], transparent: bool) {
        (self.size, self.own, self.transparent) = (PictureSize::Own(size), size, transparent);
    }

    /// The size of pictures of a viewport of `window` pixels, within what a picture may have.
    fn pixels(&self, window: [u32; 2]) -> [u32; 2] {
        let pixels = match self.size {
            PictureSize::Times(times) => window.map(|side| side.saturating_mul(times)),
            PictureSize::Own(own) => own,
        };
        pixels.map(|side| side.min(RenderSettings::LONGEST_SIDE))
    }
}

impl Finish {
    /// Paints what belongs over a picture seen from here and says what lies behind it.
    fn paint(&self, image: &mut Image, camera: &Camera) -> Background {
        let size = DVec2::new(f64::from(image.width), f64::from(image.height)) / self.scale;
        let furniture = Furniture {
            parts: self.parts,
            title: self.title.clone(),
            value_range: self.value_range,
            transfer_function: &self.transfer_function,
            camera,
            bounds: self.bounds,
            background: self.background,
            frame_time: None,
        };
        paint(image, &furniture.drawing(size), self.scale);
        if self.transparent { Background::Transparent } else { Background::Color(self.background) }
    }
}

impl Viewer {
    /// The view that is measured and written to files, at their size.
    pub(super) fn picture_view(&self) -> View {
        let view = self.exact_view();
        let [width, height] = self.pictures.pixels(self.picture_size());
        View { settings: RenderSettings { width, height, ..view.settings }, ..view }
    }

    /// Pixels a point of the furniture in pictures: it takes as much of them as of the window.
    pub(super) fn furniture_scale(&self) -> f64 {
        let (window, picture) = (self.picture_size(), self.pictures.pixels(self.picture_size()));
        let times = [0, 1].map(|i| f64::from(picture[i]) / f64::from(window[i].max(1)));
        (self.pixels_per_point * times[0].min(times[1])).clamp(0.1, 100.0)
    }

    /// Chooses the size of pictures, as the widgets do.
    pub fn set_picture_size(&mut self, size: PictureSize) {
        self.pictures.size = size;
    }

    fn finish(&self) -> Finish {
        let look = self.settings.look;
        let (title, range) = self.values();
        let parts = if look.saves_furniture { look.parts.with(Part::Time, false) } else { Parts::NONE };
        Finish {
            parts: parts.with(Part::Bar, parts.has(Part::Bar) && range.is_some()),
            title,
            value_range: range.unwrap_or([0.0, 1.0]),
            transfer_function: self.picture_view().transfer_function,
            bounds: self.document.data.bounds().translated(self.document.data.center()),
            background: look.background_rgb(),
            transparent: self.pictures.transparent,
            scale: self.furniture_scale(),
        }
    }

    /// Writes the picture as `octetra render` would draw it.
    pub(super) fn save_picture(&mut self, ctx: &egui::Context) {
        let Some(scene) = self.picture_scene() else { return self.say("there is no picture yet") };
        if self.saving.is_some() {
            return self.say(BUSY);
        }
        let (view, finish) = (self.picture_view(), self.finish());
        let (renderer, folder, name) = (self.renderer().clone(), self.folder().to_owned(), self.document.name.clone());
        self.saving = Some(Job::start(ctx, move |progress, results| {
            let paint = |image: &mut Image| finish.paint(image, &view.camera);
            let saved = model::save_picture(&renderer, &scene, &view, paint, (&folder, &name), progress);
            results.give(saved.map(|path| format!("wrote {}", absolute(&path).display())));
        }));
    }

    /// Writes the pictures of a full turn into a folder.
    pub fn save_turntable(&mut self, ctx: &egui::Context, frames: u32, folder: PathBuf) {
        self.turntable(ctx, frames, async move { Some(folder) });
    }

    fn turntable(&mut self, ctx: &egui::Context, frames: u32, folder: impl Future<Output = Option<PathBuf>> + Send + 'static) {
        let Some(scene) = self.picture_scene() else { return self.say("there is no picture yet") };
        let (view, finish) = (self.picture_view(), self.finish());
        let (renderer, name) = (self.renderer().clone(), self.document.name.clone());
        self.saving = Some(Job::start(ctx, move |progress, results| {
            let Some(folder) = pollster::block_on(folder) else { return results.give(Ok(String::new())) };
            let saved = free_template(&folder, &name).and_then(|template| {
                let views = view.camera.turntable(frames).into_iter().map(|camera| View { camera, ..view.clone() });
                let paths = template.paths(frames);
                let paint = |image: &mut Image, camera: &Camera| finish.paint(image, camera);
                Ok(renderer.write_sequence(&scene, &views.zip(paths).collect::<Vec<_>>(), paint, progress)?)
            });
            results.give(saved.map(|()| format!("wrote {frames} pictures into {}", absolute(&folder).display())));
        }));
    }

    /// The widgets beside the button Screenshot.
    pub(super) fn picture_size_widgets(&mut self, ui: &mut Ui) {
        let (window, own) = (self.picture_size(), self.pictures.own);
        let pictures = &mut self.pictures;
        rows(ui, "pictures", |ui| {
            choice(
                ui,
                "Saved size",
                "How large screenshots and turntables are",
                &mut pictures.size,
                &[
                    (PictureSize::Times(1), "1x", "As large as in the window"),
                    (PictureSize::Times(2), "2x", "Twice as wide and high"),
                    (PictureSize::Times(4), "4x", "Four times as wide and high"),
                    (PictureSize::Own(own), "own", "Any width and height; the height of the view stays"),
                ],
            );
            ui.weak("Pixels").on_hover_text("Width and height of saved pictures");
            ui.horizontal(|ui| {
                // Before the first frame the window has no size.
                let mut pixels = pictures.pixels(window);
                for (i, name) in ["width", "height"].into_iter().enumerate() {
                    if i == 1 {
                        ui.label("by");
                    }
                    let sides = 1..=RenderSettings::LONGEST_SIDE;
                    let value = DragValue::new(&mut pixels[i]).range(sides).clamp_existing_to_range(false).speed(4.0);
                    if ui.add(value).on_hover_text(format!("The {name} of saved pictures in pixels")).changed() {
                        (pictures.size, pictures.own) = (PictureSize::Own(pixels), pixels);
                    }
                }
            });
            ui.end_row();
        });
    }

    /// The button that opens the turntable's panel.
    pub(super) fn turntable_button(&mut self, ui: &mut Ui) {
        let text = "Write the pictures of a full turn about the camera's up axis into a folder";
        if ui.button("Turntable...").on_hover_text(text).clicked() {
            self.pictures.turntable_is_open = !self.pictures.turntable_is_open;
        }
    }

    /// The turntable's panel, if it is open.
    pub(super) fn turntable_panel(&mut self, ctx: &egui::Context) {
        if !self.pictures.turntable_is_open {
            return;
        }
        let (mut is_open, is_saving) = (true, self.saving.is_some());
        let [width, height] = self.pictures.pixels(self.picture_size());
        let panel = egui::Window::new("Turntable").collapsible(false).resizable(false).auto_sized().default_pos([320.0, 60.0]);
        panel.open(&mut is_open).show(ctx, |ui| {
            ui.label(format!("A full turn about the camera's up axis, {width} x {height} pixels each."));
            ui.horizontal(|ui| {
                let label = ui.label("Pictures");
                let frames = DragValue::new(&mut self.pictures.frames).range(2..=10_000);
                ui.add(frames).labelled_by(label.id).on_hover_text("How many pictures the turn has");
                let start = ui.add_enabled(!is_saving, egui::Button::new("Into folder..."));
                if start.on_hover_text("Choose the folder and write them: NAME_turn1_000.png, ...").clicked() {
                    let answer = rfd::AsyncFileDialog::new().pick_folder();
                    let folder = async move { answer.await.map(|folder| folder.path().to_owned()) };
                    self.turntable(ctx, self.pictures.frames, folder);
                }
                let stop = ui.add_enabled(is_saving, egui::Button::new("Stop"));
                if stop.on_hover_text("Stop writing; the pictures that are whole stay").clicked() {
                    self.saving = None;
                    self.say("stopped; the pictures that are whole stay");
                }
            });
        });
        self.pictures.turntable_is_open = is_open;
    }

    /// Whether saved pictures keep their alpha.
    pub(super) fn transparent_checkbox(&mut self, ui: &mut Ui) {
        let text = "Keep the alpha of saved pictures: nothing lies behind them";
        ui.checkbox(&mut self.pictures.transparent, "Transparent").on_hover_text(text);
    }

    /// The button that writes a picture.
    pub(super) fn screenshot_button(&mut self, ui: &mut Ui) {
        let text = tip("Write the picture to a PNG in the current folder", Action::Screenshot);
        if ui.button("Screenshot").on_hover_text(text).clicked() {
            self.save_picture(&ui.ctx().clone());
        }
    }
}

/// The first `NAME_turn1_{i}.png`, `NAME_turn2_{i}.png`, ... of which a folder has no picture yet.
fn free_template(folder: &Path, name: &str) -> Result<Template> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let taken: Vec<String> = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    // Braces in the name would be taken for numbers.
    let name = name.replace(['{', '}'], "_");
    let prefix = |turn: u32| format!("{name}_turn{turn}_");
    let turn = (1..).find(|&turn| !taken.iter().any(|entry| entry.starts_with(&prefix(turn)))).unwrap_or(1);
    Ok(Template::new(&folder.join(format!("{}{{i}}.png", prefix(turn))))?)
}

pub(super) fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}
