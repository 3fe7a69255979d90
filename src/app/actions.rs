//! What keys and buttons do.

use super::history::History;
use super::keys::{self, Action};
use super::navigate::{AXES, image_position};
use super::settings::Settings;
use super::time_stage::Direction;
use super::viewer::Viewer;
use crate::geometry::Placed;
use crate::view::{Camera, Projection, RendererKind};
use glam::DVec3;
use std::time::Duration;

/// Seconds without a change after which what was changed is a step to undo.
const REST_S: f64 = 0.3;

/// The field of view of cameras that were never anything but parallel.
const FOV_Y_DEGREES: f64 = 30.0;

/// What can be undone, settings and camera apart.
pub struct Histories {
    settings: Watched<Settings>,
    camera: Watched<Camera>,
    /// The field of view to go back to from a parallel camera.
    fov_y_degrees: f64,
}

/// A value that is looked at once a frame.
struct Watched<T> {
    history: History<T>,
    /// What the frame before saw, and the time of the last change in it.
    seen: T,
    changed_s: f64,
}

impl<T: Clone + PartialEq> Watched<T> {
    fn new(value: T) -> Self {
        Watched { history: History::new(value.clone()), seen: value, changed_s: f64::NEG_INFINITY }
    }

    /// Looks at a value; whether it has changed lately, so that it is to be looked at again.
    fn watch(&mut self, value: &T, now_s: f64, is_held: bool) -> bool {
        if self.seen != *value {
            (self.seen, self.changed_s) = (value.clone(), now_s);
        }
        if !is_held && now_s - self.changed_s >= REST_S {
            self.history.note(value);
        }
        now_s - self.changed_s < REST_S
    }
}

impl Histories {
    /// Nothing to undo.
    pub fn new(settings: &Settings) -> Self {
        let (camera, settings) = (Watched::new(settings.camera), Watched::new(without_camera(settings)));
        Histories { settings, camera, fov_y_degrees: FOV_Y_DEGREES }
    }

    /// Looks at the settings once a frame. A drag is one step, and so is typing a number.
    pub fn watch(&mut self, ctx: &egui::Context, settings: &Settings) {
        let now_s = ctx.input(|input| input.time);
        let is_held = ctx.input(|input| input.pointer.any_down()) || ctx.text_edit_focused();
        if let Projection::Perspective { fov_y_degrees } = settings.camera.projection {
            self.fov_y_degrees = fov_y_degrees;
        }
        let is_fresh = self.settings.watch(&without_camera(settings), now_s, is_held);
        if self.camera.watch(&settings.camera, now_s, is_held) || is_fresh {
            // It is noted when it rests, and nothing else may ask for a frame then.
            ctx.request_repaint_after(Duration::from_secs_f64(REST_S));
        }
    }
}

impl Histories {
    /// Takes a change of the settings that the user did not make.
    pub fn amend(&mut self, before: &Settings, after: &Settings) {
        let (before, after) = (without_camera(before), without_camera(after));
        self.settings.history.amend(&before, &after);
        if self.settings.seen == before {
            self.settings.seen = after;
        }
    }
}

/// Settings that differ in nothing if they differ in the camera only.
fn without_camera(settings: &Settings) -> Settings {
    let camera = Camera { eye: DVec3::X, target: DVec3::ZERO, up: DVec3::Z, projection: Projection::Parallel { view_height: 1.0 } };
    Settings { camera, ..settings.clone() }
}

impl Viewer {
    /// Does what the keys of this frame ask for.
    pub(super) fn obey_keys(&mut self, ctx: &egui::Context) {
        for action in keys::pressed(ctx) {
            self.act(ctx, action);
        }
        if let Some(text) = keys::pasted(ctx) {
            self.paste_camera(&text);
        }
    }

    /// Does one thing.
    pub(super) fn act(&mut self, ctx: &egui::Context, action: Action) {
        let camera = self.settings.camera;
        let extent = self.extent();
        match action {
            Action::Open => self.choose_file(ctx),
            Action::Reload => self.reload(ctx),
            Action::OpenSession => self.choose_session(ctx),
            Action::SaveSession => self.ask_session_file(ctx),
            Action::Screenshot => self.save_picture(ctx),
            Action::Flip => self.draw_with(match self.settings.render.renderer {
                RendererKind::Octree => RendererKind::Exact,
                RendererKind::Exact => RendererKind::Octree,
            }),
            Action::Probe => self.probe.is_on = !self.probe.is_on,
            Action::Wipe => self.flip_wipe(),
            Action::Show(part) => {
                let parts = &mut self.settings.look.parts;
                *parts = parts.with(part, !parts.has(part));
            }
            Action::Theme => ctx.set_theme(if ctx.theme() == egui::Theme::Dark { egui::Theme::Light } else { egui::Theme::Dark }),
            Action::Play => self.flip_playing(),
            Action::PreviousStep => self.step_by(Direction::Back),
            Action::NextStep => self.step_by(Direction::On),
            Action::Help => self.help_is_open = !self.help_is_open,
            Action::UndoSettings | Action::RedoSettings => self.go_back_in_settings(action == Action::UndoSettings),
            Action::UndoCamera => self.settings.camera = self.histories.camera.history.undo(&camera).unwrap_or(camera),
            Action::RedoCamera => self.settings.camera = self.histories.camera.history.redo(&camera).unwrap_or(camera),
            Action::Fit => self.fit(),
            Action::Start => self.settings.camera = self.opening,
            Action::Face(axis) => self.face(AXES[axis].1, AXES[axis].2),
            Action::Isometric => self.face(DVec3::NEG_ONE, DVec3::Z),
            Action::Projection => self.settings.camera = camera.switched(self.histories.fov_y_degrees),
            Action::Turn(right, up) => self.settings.camera = camera.rotated(right.to_radians(), up.to_radians()),
            Action::Roll(degrees) => self.settings.camera = camera.rolled(degrees.to_radians()),
            Action::Zoom(factor) => self.settings.camera = camera.zoomed_through(factor, glam::DVec2::ZERO, extent),
            Action::Advance(share) => self.settings.camera = camera.advanced(share * extent),
            Action::CopyCamera => self.copy_camera(ctx),
            // The clipboard comes as an event.
            Action::PasteCamera => ctx.send_viewport_cmd(egui::ViewportCommand::RequestPaste),
        }
    }

    /// Whether there is something that an undo or redo would do.
    pub(super) fn can(&self, action: Action) -> bool {
        let Histories { settings, camera, .. } = &self.histories;
        match action {
            Action::UndoSettings => settings.history.has_past(&without_camera(&self.settings)),
            Action::RedoSettings => settings.history.has_future(&without_camera(&self.settings)),
            Action::UndoCamera => camera.history.has_past(&self.settings.camera),
            Action::RedoCamera => camera.history.has_future(&self.settings.camera),
            _ => true,
        }
    }

    fn go_back_in_settings(&mut self, undo: bool) {
        let (history, now) = (&mut self.histories.settings.history, without_camera(&self.settings));
        let found = if undo { history.undo(&now) } else { history.redo(&now) };
        if let Some(found) = found {
            self.settings = Settings { camera: self.settings.camera, ..found };
        }
    }

    /// The scene's size in world units, above 0.
    pub(super) fn extent(&self) -> f64 {
        let diagonal = self.document.data.bounds().diagonal();
        if diagonal > 0.0 { diagonal } else { 1.0 }
    }

    /// Makes what is seen at `at` the camera's target; where nothing is, the place of the data's surface there.
    pub(super) fn recentre(&mut self, picture: egui::Rect, at: egui::Pos2) {
        let (origin, direction) = self.settings.camera.ray_at(image_position(picture, at));
        let seen = self.seen_along(picture, at, (origin, direction));
        if let Some(t) = seen.or_else(|| self.surface_hit(origin, direction)) {
            self.settings.camera = self.settings.camera.recentred(origin + direction * t);
        }
    }

    /// How far along a ray in world coordinates it meets the surface that the octree is cut to; without one, the bounds. Where planes clip,
    /// what they leave of it counts.
    fn surface_hit(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (bounds, center) = (self.document.data.bounds(), self.document.data.center());
        let [begin, end] = self.settings.render.planes.unclipped(origin, direction);
        let begin = begin.max(0.0);
        if begin >= end {
            return None;
        }
        let start = origin + direction * begin - center;
        let model = self.octree.model.as_ref();
        let cut = model.and_then(|model| Some((model.surface.as_ref()?, model.scene.texture()?)));
        let hit = match cut {
            Some((surface, texture)) => {
                let edge = texture.root_edge();
                surface.nearest_hit((start - texture.root_min()) / edge, direction).map(|t| t * edge)
            }
            None => bounds.line_interval(start, direction).and_then(|ts| ts.into_iter().find(|&t| t > 0.0)),
        };
        hit.map(|t| begin + t).filter(|t| *t <= end)
    }
}
