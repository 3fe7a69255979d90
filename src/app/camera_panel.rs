//! The camera: its buttons, and itself as numbers, in the clipboard and in files.

use super::jobs::{Job, Polled, outcome};
use super::keys::{Action, tip};
use super::navigate::AXES;
use super::viewer::Viewer;
use crate::image::write_atomically;
use crate::view::{Camera, Projection};
use anyhow::{Context, Result};
use egui::Ui;
use std::path::{Path, PathBuf};

/// What came of a file dialog.
pub enum CameraFile {
    /// The camera that was read, and from where.
    Read(Camera, PathBuf),
    /// Where it was written.
    Written(PathBuf),
}

/// Dialogs and files on their way; `None` if the user gave up.
pub type CameraJob = Job<Result<Option<CameraFile>>>;

impl Viewer {
    /// The section of the panel.
    pub(super) fn camera_section(&mut self, ui: &mut Ui) {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().button_padding.x = 5.0;
        ui.horizontal(|ui| {
            self.button(ui, "Fit", "Show all from this direction", Action::Fit);
            self.button(ui, "Start", "The first view", Action::Start);
            self.button(ui, "Undo move", "The camera before its last move", Action::UndoCamera);
            self.button(ui, "Redo move", "Take the undo back", Action::RedoCamera);
        });
        ui.horizontal(|ui| {
            for (index, (name, ..)) in AXES.into_iter().enumerate() {
                self.button(ui, name, &format!("Look along {name}"), Action::Face(index));
            }
            self.button(ui, "Iso", "Look at a corner of the bounds, x, y and z equally short", Action::Isometric);
        });
        ui.horizontal(|ui| {
            self.button(ui, "Roll left", "Turn the picture by 90\u{b0}", Action::Roll(90.0));
            self.button(ui, "Roll right", "Turn the picture by 90\u{b0}", Action::Roll(-90.0));
            let mut is_parallel = matches!(self.settings.camera.projection, Projection::Parallel { .. });
            let text = tip("Without perspective; what lies at the camera's target keeps its size", Action::Projection);
            if ui.checkbox(&mut is_parallel, "Parallel").on_hover_text(text).changed() {
                self.act(&ui.ctx().clone(), Action::Projection);
            }
        });
        ui.horizontal(|ui| {
            self.button(ui, "Copy", "Copy the camera as JSON, as octetra render --camera reads it from a file", Action::CopyCamera);
            self.button(ui, "Paste", "Take the camera that the clipboard holds as JSON", Action::PasteCamera);
            if ui.button("Save...").on_hover_text("Write the camera to a file").clicked() {
                self.ask_camera_file(ui.ctx(), true);
            }
            if ui.button("Load...").on_hover_text("Take the camera of a file").clicked() {
                self.ask_camera_file(ui.ctx(), false);
            }
        });
        ui.weak(
            "Drag: left rotates, middle pans, right zooms. The wheel zooms to the pointer. Double click: turn about what is seen there.",
        );
    }

    /// A button that does what a key does, too; grey if there is nothing to do.
    pub(super) fn button(&mut self, ui: &mut Ui, name: &str, text: &str, action: Action) {
        let button = ui.add_enabled(self.can(action), egui::Button::new(name));
        if button.on_hover_text(tip(text, action)).on_disabled_hover_text(tip(text, action)).clicked() {
            self.act(&ui.ctx().clone(), action);
        }
    }

    pub(super) fn copy_camera(&mut self, ctx: &egui::Context) {
        match json(&self.settings.camera) {
            Ok(text) => {
                ctx.copy_text(text);
                self.say("the camera is in the clipboard");
            }
            Err(error) => self.fail(error),
        }
    }

    /// Takes the camera that a text holds.
    pub(super) fn paste_camera(&mut self, text: &str) {
        match serde_json::from_str(text).context("the clipboard: not a camera") {
            Ok(camera) => {
                self.settings.camera = camera;
                self.say("took the camera from the clipboard");
            }
            Err(error) => self.fail(error),
        }
    }

    fn ask_camera_file(&mut self, ctx: &egui::Context, write: bool) {
        let dialog = rfd::AsyncFileDialog::new().add_filter("Cameras", &["json"]);
        if write {
            let name = format!("{}-camera.json", self.document.name);
            let (answer, camera) = (dialog.set_file_name(name).save_file(), self.settings.camera);
            self.camera_job = Some(Job::start(ctx, move |_, results| {
                let path = pollster::block_on(answer).map(|file| file.path().to_owned());
                results.give(path.map(|path| write_camera(&path, &camera).map(|()| CameraFile::Written(path))).transpose());
            }));
        } else {
            let answer = dialog.pick_file();
            self.camera_job = Some(Job::start(ctx, move |_, results| {
                let path = pollster::block_on(answer).map(|file| file.path().to_owned());
                results.give(path.map(|path| read_camera(&path).map(|camera| CameraFile::Read(camera, path))).transpose());
            }));
        }
    }

    /// Takes what came of a dialog.
    pub(super) fn run_camera_job(&mut self) {
        let ended = match self.camera_job.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => return,
            Some(ended) => ended,
        };
        self.camera_job = None;
        match outcome(ended) {
            Ok(Some(CameraFile::Read(camera, path))) => {
                self.settings.camera = camera;
                self.say(format!("took the camera of {}", path.display()));
            }
            Ok(Some(CameraFile::Written(path))) => self.say(format!("wrote {}", path.display())),
            Ok(None) => {}
            Err(error) => self.fail(error),
        }
    }
}

fn json(camera: &Camera) -> Result<String> {
    serde_json::to_string(camera).context("the camera could not be written as JSON")
}

/// Reads a camera file.
pub fn read_camera(path: &Path) -> Result<Camera> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| format!("{}: not a camera", path.display()))
}

/// Writes a camera file.
pub fn write_camera(path: &Path, camera: &Camera) -> Result<()> {
    let text = json(camera)? + "\n";
    write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn files_hold_cameras_to_the_last_bit_and_what_is_none_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("camera.json");
        for projection in [Projection::Perspective { fov_y_degrees: 100.0 / 3.0 }, Projection::Parallel { view_height: 0.1 }] {
            let camera = Camera { eye: DVec3::new(0.1, 1e-17, 3.0), target: DVec3::splat(1.0 / 7.0), up: DVec3::Z, projection };
            write_camera(&path, &camera).expect("written");
            assert_eq!(read_camera(&path).expect("read"), camera);
        }
        std::fs::write(&path, r#"{"eye": [0, 0, 0], "target": [0, 0, 0], "up": [0, 0, 1]}"#).expect("written");
        let said = format!("{:#}", read_camera(&path).expect_err("no camera"));
        assert!(said.contains("camera.json: not a camera") && said.contains("apart"), "{said}");
        let missing = folder.path().join("none.json");
        assert!(format!("{:#}", read_camera(&missing).expect_err("no file")).contains("none.json"));
    }
}
