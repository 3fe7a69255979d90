//! Mouse to cameras, with ParaView's habits.

use crate::view::Camera;
use egui::{Modifiers, PointerButton};
use glam::{DVec2, DVec3};

/// Radians that a drag over the height of the picture turns by.
const TURN: f64 = 200.0 * std::f64::consts::PI / 180.0;

/// Powers of e that a drag over the height of the picture zooms by.
const DRAG_ZOOM: f64 = 3.0;

/// Powers of e that a point of scrolling zooms by; a notch of most wheels is 40 points or more.
const SCROLL_ZOOM: f64 = 0.0025;

/// Where turning becomes rolling, in halves of the picture's longer side.
const RIM: f64 = 0.9;

/// Views along the axes: button, view direction and what is up in the image.
pub const AXES: [(&str, DVec3, DVec3); 6] = [
    ("+x", DVec3::X, DVec3::Z),
    ("-x", DVec3::NEG_X, DVec3::Z),
    ("+y", DVec3::Y, DVec3::Z),
    ("-y", DVec3::NEG_Y, DVec3::Z),
    ("+z", DVec3::Z, DVec3::Y),
    ("-z", DVec3::NEG_Z, DVec3::Y),
];

/// What dragging does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Turns about the target.
    Rotate,
    /// Moves along.
    Pan,
    /// Comes closer or goes away.
    Zoom,
    /// The same towards where the drag began.
    ZoomToPointer,
    /// Turns the image about its middle.
    Roll,
    /// Turns, or rolls if the drag began at the rim.
    RotateOrRoll,
}

/// What is held down while dragging.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Nothing.
    Nothing,
    /// Shift.
    Shift,
    /// Ctrl, on a Mac Cmd.
    Ctrl,
}

/// What the mouse does: button, key held, motion, and the same in words. ParaView's defaults, and its multi-rotation with Ctrl.
pub const DRAGS: [(PointerButton, Hold, Motion, &str); 9] = [
    (PointerButton::Primary, Hold::Nothing, Motion::Rotate, "rotate"),
    (PointerButton::Middle, Hold::Nothing, Motion::Pan, "pan"),
    (PointerButton::Secondary, Hold::Nothing, Motion::Zoom, "zoom"),
    (PointerButton::Primary, Hold::Shift, Motion::Roll, "roll"),
    (PointerButton::Middle, Hold::Shift, Motion::Rotate, "rotate"),
    (PointerButton::Secondary, Hold::Shift, Motion::Pan, "pan"),
    (PointerButton::Primary, Hold::Ctrl, Motion::RotateOrRoll, "rotate, at the rim roll"),
    (PointerButton::Middle, Hold::Ctrl, Motion::Rotate, "rotate"),
    (PointerButton::Secondary, Hold::Ctrl, Motion::ZoomToPointer, "zoom to the pointer"),
];

/// The rest of what the mouse does, for the sheet.
pub const MORE: [(&str, &str); 2] = [("Wheel", "zoom to the pointer, through the data"), ("Double click", "turn about what is seen there")];

impl Hold {
    fn of(held: Modifiers) -> Self {
        match held {
            _ if held.command => Hold::Ctrl,
            _ if held.shift => Hold::Shift,
            _ => Hold::Nothing,
        }
    }

    /// "Shift+", "Ctrl+" or nothing.
    pub fn prefix(self) -> &'static str {
        match self {
            Hold::Nothing => "",
            Hold::Shift => "Shift+",
            Hold::Ctrl => "Ctrl+",
        }
    }
}

/// A button's name.
pub fn button_name(button: PointerButton) -> &'static str {
    match button {
        PointerButton::Primary => "left",
        PointerButton::Middle => "middle",
        _ => "right",
    }
}

/// A place of the picture in image heights from its middle, x to the right, y up.
pub fn image_position(picture: egui::Rect, at: egui::Pos2) -> DVec2 {
    let from_middle = at - picture.center();
    DVec2::new(f64::from(from_middle.x), -f64::from(from_middle.y)) / f64::from(picture.height().max(1.0))
}

/// The camera after this frame's dragging and scrolling over the picture. `extent` is the scene's size in world units.
pub fn moved(camera: Camera, picture: &egui::Response, ui: &egui::Ui, extent: f64) -> Camera {
    let place = |at| image_position(picture.rect, at);
    let (held, origin) = ui.input(|input| (Hold::of(input.modifiers), input.pointer.press_origin()));
    let mut camera = camera;
    let drag = DRAGS.iter().find(|drag| drag.1 == held && picture.dragged_by(drag.0));
    if let (Some((_, _, motion, _)), Some(now)) = (drag, picture.interact_pointer_pos()) {
        let (from, to) = (place(now - picture.drag_delta()), place(now));
        camera = dragged(camera, *motion, [place(origin.unwrap_or(now)), from, to], f64::from(picture.rect.aspect_ratio()), extent);
    }
    // Also where a handle lies over the picture.
    let is_free = ui.ctx().dragged_id().is_none_or(|id| id == picture.id);
    let hovered = ui.input(|input| input.pointer.hover_pos()).filter(|_| picture.contains_pointer() && is_free);
    if let Some(at) = hovered {
        let (scroll, pinch) = ui.input(|input| (f64::from(input.smooth_scroll_delta().y), f64::from(input.zoom_delta())));
        let factor = (scroll * SCROLL_ZOOM).exp() * pinch;
        if factor != 1.0 {
            camera = camera.zoomed_through(factor, place(at), extent);
        }
    }
    camera
}

/// The camera after a piece of a drag that began at `origin`, in image positions. `aspect` is the picture's width over its height.
fn dragged(camera: Camera, motion: Motion, [origin, from, to]: [DVec2; 3], aspect: f64, extent: f64) -> Camera {
    let by = to - from;
    let factor = (-by.y * DRAG_ZOOM).exp(); // as in ParaView, down comes closer
    let is_at_rim = origin.length() > RIM * aspect.max(1.0) / 2.0;
    match motion {
        Motion::RotateOrRoll if is_at_rim => dragged(camera, Motion::Roll, [origin, from, to], aspect, extent),
        Motion::Rotate | Motion::RotateOrRoll => camera.rotated(by.x * TURN, by.y * TURN),
        Motion::Pan => camera.panned(by),
        Motion::Zoom => camera.zoomed_through(factor, DVec2::ZERO, extent),
        Motion::ZoomToPointer => camera.zoomed_through(factor, origin, extent),
        Motion::Roll if from.length() * to.length() > 0.0 => camera.rolled(from.perp_dot(to).atan2(from.dot(to))),
        Motion::Roll => camera,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Projection;

    #[test]
    fn what_is_dragged_follows_the_pointer() {
        let projection = Projection::Perspective { fov_y_degrees: 30.0 };
        let camera = Camera { eye: DVec3::new(0.0, -10.0, 0.0), target: DVec3::ZERO, up: DVec3::Z, projection };
        let (from, to) = (DVec2::new(0.2, 0.1), DVec2::new(0.1, 0.25));
        let point = camera.target + camera.axes()[1] * (from.x * camera.view_height()) + camera.axes()[2] * (from.y * camera.view_height());
        let seen = |camera: Camera| camera.seen_at(point).expect("before the eye");
        let drag = |motion| dragged(camera, motion, [from, from, to], 1.5, 1.0);
        assert!(seen(drag(Motion::Pan)).distance(to) < 1e-12);
        assert!(
            seen(drag(Motion::Roll)).normalize().distance(to.normalize()) < 1e-12
                && (seen(drag(Motion::Roll)).length() - from.length()).abs() < 1e-12
        );
        assert!(seen(drag(Motion::ZoomToPointer)).distance(from) < 1e-12, "stays, the rest goes apart");
        assert!(drag(Motion::Zoom).eye.distance(drag(Motion::Zoom).target) > 10.0, "up goes away");
        assert_eq!(drag(Motion::RotateOrRoll), drag(Motion::Rotate));
        let rim = |x: f64| dragged(camera, Motion::RotateOrRoll, [DVec2::new(x, 0.0), from, to], 1.5, 1.0);
        assert_eq!((rim(0.67), rim(0.68)), (drag(Motion::Rotate), drag(Motion::Roll)), "0.9 of half of 1.5");
    }

    #[test]
    fn every_button_does_one_thing_with_every_key_held() {
        for (i, drag) in DRAGS.iter().enumerate() {
            assert!(DRAGS[..i].iter().all(|other| (other.0, other.1) != (drag.0, drag.1)));
        }
    }
}
