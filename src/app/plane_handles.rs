//! Planes taken by hand: an outline and an arrow over the picture, to drag.

use super::navigate::image_position;
use super::viewer::Viewer;
use crate::geometry::{Aabb, Placed};
use crate::view::{Camera, Plane, PlaneHandle, Planes, Projection};
use egui::{Color32, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, vec2};
use glam::{DVec2, DVec3};

/// Length of the arrow and width of what can be caught of it, points.
const ARROW: f32 = 84.0;
const CATCH: f32 = 16.0;

/// Where the arrow can be caught besides its ends, in parts of it.
const SHAFT: [f32; 3] = [0.25, 0.45, 0.65];

/// A point on a plane is its handle's place if it lies so far inside the bounds, in parts of their size.
const INSIDE: f64 = 0.05;

const INK: Color32 = Color32::from_rgb(255, 190, 60);

/// The handles' state.
pub struct PlaneTool {
    /// Whether they are shown.
    pub is_shown: bool,
    /// The plane that has them, by its number from 0.
    pub selected: Option<usize>,
    /// The plane whose row in the panel is under the pointer.
    pub hovered: Option<usize>,
    drag: Option<Drag>,
}

impl Default for PlaneTool {
    fn default() -> Self {
        PlaneTool { is_shown: true, selected: None, hovered: None, drag: None }
    }
}

/// What a drag does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Grip {
    /// Moves the plane along its normal.
    Move,
    /// Turns its normal.
    Turn,
}

/// A drag on its way.
struct Drag {
    grip: Grip,
    /// The plane and its arrow when it began.
    plane: Plane,
    handle: PlaneHandle,
    /// World units a point at the arrow.
    point_world: f64,
    /// Where it began, and the tip as seen from there.
    pressed: Pos2,
    to_tip: Vec2,
}

impl PlaneTool {
    /// The handles of another document: shown or not as before.
    pub fn emptied(&self) -> Self {
        PlaneTool { is_shown: self.is_shown, ..Self::default() }
    }
}

impl Viewer {
    /// The planes that clip and cut.
    pub fn planes(&self) -> Planes {
        self.settings.render.planes
    }

    /// The bounds of the data, world coordinates.
    pub(super) fn world_bounds(&self) -> Aabb {
        self.document.data.bounds().translated(self.document.data.center())
    }

    /// Lets the handles of the selected plane be dragged. Call it after the picture's own place in the window was made.
    pub(super) fn drag_planes(&mut self, ui: &Ui, rect: Rect) {
        let mut planes: Vec<Plane> = self.planes().iter().collect();
        let Some((i, plane)) = self.plane_tool.selected.and_then(|i| Some((i, *planes.get(i)?))).filter(|_| self.plane_tool.is_shown)
        else {
            self.plane_tool.drag = None;
            return;
        };
        let camera = self.settings.camera;
        let Some(seen) = Seen::new(self.arrow(i, &plane, rect), &camera, rect) else { return };
        let id = ui.scope_id().with("plane handles");
        let under_way = self.plane_tool.drag.as_ref().map(|drag| drag.grip);
        let grips = [(1.0, Grip::Turn)].into_iter().chain(SHAFT.into_iter().chain([0.0]).map(|part| (part, Grip::Move)));
        let mut dragged = None;
        for (k, (part, grip)) in grips.enumerate() {
            let at = seen.pivot + (seen.tip - seen.pivot) * part;
            // What is under way goes on wherever the pointer is.
            if !rect.contains(at) && under_way != Some(grip) {
                continue;
            }
            let response = ui.interact(Rect::from_center_size(at, Vec2::splat(CATCH)), id.with(k), Sense::drag());
            if part == 0.0 || grip == Grip::Turn {
                let name = if grip == Grip::Move { "move plane" } else { "turn plane" };
                response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, format!("{name} {}", i + 1)));
            }
            if response.hovered() || response.dragged() {
                ui.ctx().set_cursor_icon(cursor(grip, response.dragged(), seen.tip - seen.pivot));
            }
            if response.drag_started_by(PointerButton::Primary) {
                let pressed = ui.input(|input| input.pointer.press_origin()).unwrap_or(at);
                let (handle, point_world) = (seen.handle, seen.point_world);
                self.plane_tool.drag = Some(Drag { grip, plane, handle, point_world, pressed, to_tip: seen.tip - pressed });
            }
            if response.dragged_by(PointerButton::Primary) {
                dragged = response.interact_pointer_pos();
            }
            explained(response, grip);
        }
        let Some(drag) = self.plane_tool.drag.as_ref().filter(|_| dragged.is_some()) else {
            self.plane_tool.drag = None;
            return;
        };
        let moved = dragged.map_or(plane, |pointer| drag.plane_at(pointer, &camera, rect, self.world_bounds()));
        if moved != plane {
            planes[i] = moved;
            self.settings.render.planes = Planes::new(&planes).unwrap_or(self.settings.render.planes);
            ui.ctx().request_repaint();
        }
    }

    /// The arrow of a plane as it is shown.
    fn arrow(&self, i: usize, plane: &Plane, rect: Rect) -> PlaneHandle {
        let normal = plane.normal.normalize();
        let pivot = match self.plane_tool.drag.as_ref().filter(|_| self.plane_tool.selected == Some(i)) {
            // Nothing jumps while it is dragged.
            Some(Drag { grip: Grip::Turn, handle, .. }) => handle.pivot,
            Some(drag) => drag.handle.pivot + normal * (plane.point - drag.plane.point).dot(normal),
            None => pivot(plane, self.world_bounds()),
        };
        let length = f64::from(ARROW) * point_world(&self.settings.camera, pivot, rect);
        PlaneHandle { pivot, normal, length }
    }

    /// Paints outline and arrow of the selected plane, and of the one that is pointed at in the panel.
    pub(super) fn planes_over(&self, ui: &Ui, rect: Rect) {
        let PlaneTool { is_shown, selected, hovered, .. } = self.plane_tool;
        let planes: Vec<Plane> = self.planes().iter().collect();
        let painter = ui.painter().with_clip_rect(rect);
        let shown = [hovered.filter(|_| hovered != selected), selected];
        for i in shown.into_iter().flatten().filter(|_| is_shown) {
            let Some(plane) = planes.get(i) else { continue };
            let width = if Some(i) == selected { 1.5 } else { 1.0 };
            let camera = &self.settings.camera;
            let outline = self.world_bounds().section(plane.point, plane.normal.normalize());
            for (&a, &b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                if let Some(ends) = camera.seen_segment([a, b]) {
                    line(&painter, ends.map(|at| window_position(rect, at)), width);
                }
            }
            if let Some(seen) = Seen::new(self.arrow(i, plane, rect), camera, rect) {
                arrow(&painter, seen.pivot, seen.tip, width);
            }
        }
    }
}

/// An arrow in the window.
struct Seen {
    handle: PlaneHandle,
    point_world: f64,
    pivot: Pos2,
    tip: Pos2,
}

impl Seen {
    fn new(handle: PlaneHandle, camera: &Camera, rect: Rect) -> Option<Self> {
        let point_world = handle.length / f64::from(ARROW);
        let is_seen = point_world.is_finite() && point_world > 0.0;
        let [pivot, tip] = [handle.pivot, handle.tip()].map(|at| camera.seen_at(at).map(|at| window_position(rect, at)));
        let (pivot, tip) = pivot.zip(tip).filter(|_| is_seen)?;
        Some(Seen { handle, point_world, pivot, tip })
    }
}

impl Drag {
    /// The plane with the pointer at a place.
    fn plane_at(&self, pointer: Pos2, camera: &Camera, rect: Rect, bounds: Aabb) -> Plane {
        let ray = |at: Pos2| camera.ray_at(image_position(rect, at));
        let (handle, plane) = (&self.handle, self.plane);
        match self.grip {
            Grip::Turn if pointer == self.pressed => plane,
            Grip::Turn => {
                let is_averted = handle.is_averted(ray(self.pressed + self.to_tip));
                Plane { point: handle.pivot, normal: handle.turned(ray(pointer + self.to_tip), is_averted), ..plane }
            }
            Grip::Move => {
                let by = match (handle.along(ray(self.pressed)), handle.along(ray(pointer))) {
                    (Some(from), Some(to)) => to - from,
                    // Where the arrow is seen from its end, up is along it.
                    _ => f64::from(self.pressed.y - pointer.y) * self.point_world,
                };
                // No further than the data, where it still cuts something.
                let [low, high] = bounds.extent_along(handle.normal);
                let at = plane.point.dot(handle.normal);
                let to = (at + by).clamp(low.min(at), high.max(at));
                Plane { point: plane.point + handle.normal * (to - at), ..plane }
            }
        }
    }
}

/// Where a plane's arrow begins: its point if that lies well inside the bounds, else what of the plane is nearest to their middle.
fn pivot(plane: &Plane, bounds: Aabb) -> DVec3 {
    let (normal, margin) = (plane.normal.normalize(), bounds.size() * INSIDE);
    let is_inside = plane.point.cmpge(bounds.min + margin).all() && plane.point.cmple(bounds.max - margin).all();
    if is_inside { plane.point } else { bounds.center() + normal * (plane.point - bounds.center()).dot(normal) }
}

/// A plane that is perpendicular to something else: through where its arrow begins, if that lies in the bounds.
pub fn facing(plane: &Plane, normal: DVec3, bounds: Aabb) -> Plane {
    let pivot = pivot(plane, bounds);
    let is_inside = pivot.cmpge(bounds.min).all() && pivot.cmple(bounds.max).all();
    Plane { normal, point: if is_inside { pivot } else { bounds.center() }, ..*plane }
}

/// World units a point of the window at a place.
fn point_world(camera: &Camera, at: DVec3, rect: Rect) -> f64 {
    let height = match camera.projection {
        Projection::Parallel { view_height } => view_height,
        Projection::Perspective { fov_y_degrees } => {
            let [forward, ..] = camera.axes();
            2.0 * (fov_y_degrees.to_radians() / 2.0).tan() * (at - camera.eye).dot(forward)
        }
    };
    height / f64::from(rect.height().max(1.0))
}

/// The inverse of [`image_position`].
fn window_position(rect: Rect, at: DVec2) -> Pos2 {
    rect.center() + vec2(at.x as f32, -at.y as f32) * rect.height().max(1.0)
}

/// What the pointer looks like over a grip; `along` is where the arrow goes in the window.
fn cursor(grip: Grip, is_dragged: bool, along: Vec2) -> CursorIcon {
    match grip {
        Grip::Turn if is_dragged => CursorIcon::Grabbing,
        Grip::Turn => CursorIcon::Grab,
        Grip::Move => {
            let steep = along.y.abs() / along.x.abs().max(1e-6);
            match steep {
                s if s > 2.4 || along.length() < 0.2 * ARROW => CursorIcon::ResizeVertical,
                s if s < 0.41 => CursorIcon::ResizeHorizontal,
                _ if along.x * along.y > 0.0 => CursorIcon::ResizeNwSe,
                _ => CursorIcon::ResizeNeSw,
            }
        }
    }
}

fn explained(response: Response, grip: Grip) {
    response.on_hover_text(match grip {
        Grip::Move => "Drag: moves the plane along its normal",
        Grip::Turn => "Drag: turns the plane",
    });
}

/// A line that is seen over any picture.
fn line(painter: &Painter, ends: [Pos2; 2], width: f32) {
    painter.line_segment(ends, Stroke::new(width + 2.0, Color32::from_black_alpha(160)));
    painter.line_segment(ends, Stroke::new(width, INK));
}

fn arrow(painter: &Painter, pivot: Pos2, tip: Pos2, width: f32) {
    let outline = Stroke::new(1.0, Color32::BLACK);
    line(painter, [pivot, tip], width);
    let along = (tip - pivot).normalized();
    if (tip - pivot).length() > 12.0 {
        let (base, across) = (tip - along * 12.0, vec2(-along.y, along.x) * 5.0);
        painter.add(Shape::convex_polygon(vec![tip, base + across, base - across], INK, outline));
    } else {
        painter.circle(tip, 3.0, INK, outline);
    }
    painter.circle(pivot, 5.0, INK, outline);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::PlaneUse;
    use egui::pos2;

    const RECT: Rect = Rect { min: pos2(300.0, 20.0), max: pos2(700.0, 420.0) };

    #[test]
    fn places_in_the_window_are_found_again() {
        for at in [DVec2::ZERO, DVec2::new(0.3, -0.4), DVec2::new(-0.5, 0.5)] {
            assert!(image_position(RECT, window_position(RECT, at)).distance(at) < 1e-6);
        }
    }

    #[test]
    fn the_arrow_begins_on_the_plane_and_in_the_data_where_it_can() {
        let bounds = Aabb { min: DVec3::splat(10.0), max: DVec3::splat(20.0) };
        let plane = |point, normal| Plane { point, normal, used: PlaneUse::Clip };
        assert_eq!(pivot(&plane(DVec3::new(12.0, 0.0, 0.0), DVec3::X * 3.0), bounds), DVec3::new(12.0, 15.0, 15.0));
        let inside = DVec3::new(11.0, 12.0, 18.0);
        assert_eq!(pivot(&plane(inside, DVec3::X), bounds), inside);
        assert_eq!(facing(&plane(inside, DVec3::X), DVec3::Y, bounds), plane(inside, DVec3::Y));
        assert_eq!(facing(&plane(DVec3::ZERO, DVec3::X), DVec3::Y, bounds).point, bounds.center(), "the plane lay beside the data");
    }

    #[test]
    fn a_plane_seen_from_its_end_goes_up_with_the_pointer_and_no_further_than_the_data() {
        let bounds = Aabb { min: DVec3::NEG_ONE, max: DVec3::ONE };
        let projection = Projection::Parallel { view_height: 4.0 };
        let camera = Camera { eye: DVec3::NEG_Y * 5.0, target: DVec3::ZERO, up: DVec3::Z, projection };
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::Y, used: PlaneUse::Clip };
        let handle = PlaneHandle { pivot: DVec3::ZERO, normal: DVec3::Y, length: 1.0 };
        let pressed = RECT.center();
        let drag =
            Drag { grip: Grip::Move, plane, handle, point_world: point_world(&camera, DVec3::ZERO, RECT), pressed, to_tip: Vec2::ZERO };
        let by = |x: f32, y: f32| drag.plane_at(pressed + vec2(x, y), &camera, RECT, bounds);
        assert!(by(30.0, -50.0).point.distance(DVec3::Y * 0.5) < 1e-6, "{:?}", by(30.0, -50.0));
        assert_eq!(by(0.0, -500.0).point, DVec3::Y);
        let across = Drag { handle: PlaneHandle { normal: DVec3::X, ..handle }, plane: Plane { normal: DVec3::X, ..plane }, ..drag };
        let moved = across.plane_at(pressed + vec2(-30.0, 77.0), &camera, RECT, bounds);
        assert!(moved.point.distance(DVec3::X * -0.3) < 1e-6 && moved.normal == DVec3::X, "{moved:?}");
    }
}
