//! Slices in space: the camera, and handles that move and turn them.

use super::super::navigate::{image_position, moved};
use super::super::projector::Projector;
use super::cut::{AXES, Cut};
use super::space::Space;
use super::window::StoreWindow;
use crate::gpu::{outline, plane_axes};
use crate::view::{Camera, PlaneHandle, Projection};
use egui::{Align2, Color32, CursorIcon, FontId, Painter, PointerButton, Pos2, Rect, Sense, Stroke, Ui, Vec2, WidgetInfo};
use glam::DVec3;

/// Size of what can be caught of a handle, and length of the arrow of an oblique slice, points.
const CATCH: f32 = 18.0;
const ARROW: f64 = 70.0;

/// A handle on its way.
#[derive(Debug, Clone, Copy)]
pub struct Drag {
    number: usize,
    is_turn: bool,
    cut: Cut,
    handle: PlaneHandle,
    pressed: Pos2,
    /// From where it was pressed to the tip.
    to_tip: Vec2,
}

/// Where a slice is taken: at the corner of what it cuts out of the volume that is nearest to the eye, index space. In the middle the handles
/// of several slices would lie on each other.
fn corner_of(cut: &Cut, space: &Space, eye: DVec3) -> Option<DVec3> {
    let plane = cut.plane(space.dims);
    let [origin, u, v] = plane_axes(&plane, space.dims);
    let corners = outline(&plane, space.dims).into_iter().map(|[a, b]| origin + u * a + v * b);
    corners.min_by(|a, b| space.shown(*a).distance(eye).total_cmp(&space.shown(*b).distance(eye)))
}

/// World units a point of the window at a place.
fn point_size(camera: &Camera, at: DVec3, rect: Rect) -> f64 {
    let height = match camera.projection {
        Projection::Parallel { view_height } => view_height,
        Projection::Perspective { fov_y_degrees } => {
            2.0 * (fov_y_degrees.to_radians() / 2.0).tan() * (at - camera.eye).dot(camera.axes()[0]).max(1e-9)
        }
    };
    height / f64::from(rect.height().max(1.0))
}

fn handle(cut: &Cut, space: &Space, camera: &Camera, rect: Rect) -> Option<PlaneHandle> {
    let pivot = space.shown(corner_of(cut, space, camera.eye)?);
    let length = ARROW * point_size(camera, pivot, rect);
    (length.is_finite() && length > 0.0).then(|| PlaneHandle { pivot, normal: space.shown_normal(cut.normal), length })
}

impl StoreWindow {
    /// Lets the picture in space be worked on.
    pub(super) fn work_spatial(&mut self, ui: &Ui, rect: Rect) {
        let space = self.space();
        let picture = ui.interact(rect, ui.scope_id().with("space"), Sense::click_and_drag());
        picture.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "slices in space"));
        self.camera = moved(self.camera, &picture, ui, space.bounds().diagonal());
        let camera = self.camera;
        let projector = Projector::new(&camera, DVec3::ZERO, rect);
        let mut dragged = None;
        for i in 0..self.cuts.len() {
            let cut = self.cuts[i];
            let Some(handle) = handle(&cut, &space, &camera, rect).filter(|_| cut.is_shown) else { continue };
            let (Some(pivot), Some(tip)) = (projector.place(handle.pivot), projector.place(handle.tip())) else { continue };
            let turns = cut.axis().is_none() && i == self.selected;
            for (is_turn, at) in [(true, tip), (false, pivot)].into_iter().skip(usize::from(!turns)) {
                let under_way = self.drag.is_some_and(|drag| drag.number == i && drag.is_turn == is_turn);
                if !(rect.contains(at) || under_way) {
                    continue;
                }
                let id = picture.id.with((i, is_turn));
                let response = ui.interact(Rect::from_center_size(at, Vec2::splat(CATCH)), id, Sense::click_and_drag());
                let verb = if is_turn { "turn" } else { "move" };
                response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, format!("{verb} {}", self.title(i))));
                if response.hovered() || response.dragged() {
                    ui.ctx().set_cursor_icon(if response.dragged() { CursorIcon::Grabbing } else { CursorIcon::Grab });
                }
                if response.drag_started_by(PointerButton::Primary) {
                    let pressed = ui.input(|input| input.pointer.press_origin()).unwrap_or(at);
                    self.drag = Some(Drag { number: i, is_turn, cut, handle, pressed, to_tip: tip - pressed });
                }
                if response.dragged_by(PointerButton::Primary) {
                    dragged = response.interact_pointer_pos().or(dragged);
                }
                if response.clicked() {
                    self.selected = i;
                }
                response.on_hover_text(if is_turn { "Drag: turns the slice" } else { "Drag: moves the slice along its normal" });
            }
        }
        match (self.drag, dragged) {
            (Some(drag), Some(pointer)) => {
                if let Some(cut) = drag.cut_at(pointer, &camera, rect, &space) {
                    self.cuts[drag.number] = Cut { is_shown: self.cuts[drag.number].is_shown, ..cut };
                }
                self.selected = drag.number;
            }
            _ => self.drag = None,
        }
        if let Some(at) = picture.hover_pos() {
            self.pointed = self.seen_in_space(at, rect);
        }
    }

    /// Where the ray of a place of the window meets the nearest slice, index space.
    fn seen_in_space(&self, at: Pos2, rect: Rect) -> Option<DVec3> {
        let space = self.space();
        let (origin, direction) = self.camera.ray_at(image_position(rect, at));
        let (from, to) = (space.index(origin), space.index(origin + direction));
        let ray = to - from;
        let high = DVec3::from(space.dims.map(|n| f64::from(n) - 0.5));
        let hits = self.cuts.iter().filter(|cut| cut.is_shown).filter_map(|cut| {
            let plane = cut.plane(space.dims);
            let t = -plane.distance(from) / ray.dot(plane.normal);
            let mut point = from + ray * t;
            if let Some(axis) = cut.axis() {
                point[axis] = cut.position;
            }
            let is_inside = point.cmpgt(DVec3::splat(-0.5)).all() && point.cmplt(high).all();
            (t > 0.0 && is_inside).then_some((t, point))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
    }

    /// Paints the edges of the volume's box that lie behind the slices, or those before them.
    pub(super) fn paint_box(&self, painter: &Painter, rect: Rect, is_front: bool) {
        let space = self.space();
        let projector = Projector::new(&self.camera, DVec3::ZERO, rect);
        let corners = space.corners();
        let painter = painter.with_clip_rect(rect);
        // Edges at the farthest corner have everything before them.
        let [forward, ..] = self.camera.axes();
        let farthest = (0..8).max_by(|&a, &b| corners[a].dot(forward).total_cmp(&corners[b].dot(forward))).unwrap_or(0);
        let shade = if is_front { 150 } else { 90 };
        for i in 0..8usize {
            for axis in (0..3).filter(|axis| i >> axis & 1 == 0) {
                let j = i | 1 << axis;
                if (i == farthest || j == farthest) == is_front {
                    continue;
                }
                if let (Some(a), Some(b)) = (projector.place(corners[i]), projector.place(corners[j])) {
                    painter.line_segment([a, b], Stroke::new(1.0, Color32::from_gray(shade)));
                }
            }
        }
        if is_front {
            self.paint_names(&painter, &projector, &corners, rect);
        }
    }

    /// Names of the axes with their length in voxels, at the edges of the box that are outlines.
    fn paint_names(&self, painter: &Painter, projector: &Projector, corners: &[DVec3; 8], rect: Rect) {
        let Some(middle) = projector.place(DVec3::ZERO) else { return };
        for axis in 0..3 {
            let edges = (0..8usize).filter(|i| i >> axis & 1 == 0).filter_map(|i| {
                let [a, b] = [projector.place(corners[i])?, projector.place(corners[i | 1 << axis])?];
                Some(a + (b - a) / 2.0)
            });
            // The lowest edge's middle, moved outwards.
            let Some(at) = edges.filter(|at| rect.contains(*at)).max_by(|a, b| (a.y + 0.3 * a.x).total_cmp(&(b.y + 0.3 * b.x))) else {
                continue;
            };
            let out = (at - middle).normalized() * 14.0;
            let text = format!("{} {}", AXES[axis], self.space().dims[axis]);
            painter.text(at + out, Align2::CENTER_CENTER, text, FontId::proportional(12.0), Cut::across(axis, 0.0).color());
        }
    }

    /// Paints the handles.
    pub(super) fn paint_handles(&self, painter: &Painter, rect: Rect) {
        let space = self.space();
        let projector = Projector::new(&self.camera, DVec3::ZERO, rect);
        let painter = painter.with_clip_rect(rect);
        for (i, cut) in self.cuts.iter().enumerate().filter(|(_, cut)| cut.is_shown) {
            let Some(handle) = handle(cut, &space, &self.camera, rect) else { continue };
            let (Some(pivot), Some(tip)) = (projector.place(handle.pivot), projector.place(handle.tip())) else { continue };
            let (color, outline) = (cut.color(), Stroke::new(1.0, Color32::BLACK));
            if i == self.selected {
                painter.line_segment([pivot, tip], Stroke::new(3.5, Color32::from_black_alpha(140)));
                painter.line_segment([pivot, tip], Stroke::new(2.0, color));
                if cut.axis().is_none() {
                    painter.circle(tip, 5.0, Color32::WHITE, outline);
                }
            }
            painter.circle(pivot, if i == self.selected { 6.0 } else { 4.5 }, color, outline);
        }
    }
}

impl Drag {
    /// The slice with the pointer at a place.
    fn cut_at(&self, pointer: Pos2, camera: &Camera, rect: Rect, space: &Space) -> Option<Cut> {
        let ray = |at: Pos2| camera.ray_at(image_position(rect, at));
        if self.is_turn {
            if pointer == self.pressed {
                return None;
            }
            let is_averted = self.handle.is_averted(ray(self.pressed + self.to_tip));
            let normal = self.handle.turned(ray(pointer + self.to_tip), is_averted);
            let turned = self.cut.turned(space.index_normal(normal), space.dims)?;
            let pivot = space.index(self.handle.pivot);
            let [low, high] = turned.range(space.dims);
            let position = turned.position_through(pivot, space.dims).clamp(low, high);
            return Some(Cut { position, ..turned });
        }
        let by = match (self.handle.along(ray(self.pressed)), self.handle.along(ray(pointer))) {
            (Some(from), Some(to)) => to - from,
            // Where the normal goes towards the eye, up is along it.
            _ => f64::from(self.pressed.y - pointer.y) * point_size(camera, self.handle.pivot, rect),
        };
        let through = space.index(self.handle.pivot + self.handle.normal * by);
        Some(self.cut.at(self.cut.position_through(through, space.dims), space.dims))
    }
}
