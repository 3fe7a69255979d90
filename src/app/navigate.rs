//! Mouse and keys to cameras, with ParaView's habits: the left button rotates, the middle one pans, the right one and the wheel zoom.

use crate::view::Camera;
use egui::{Key, PointerButton};
use glam::{DVec2, DVec3};

/// Radians that a drag over the height of the picture turns by.
const TURN: f64 = 200.0 * std::f64::consts::PI / 180.0;

/// Powers of e that a drag over the height of the picture zooms by.
const DRAG_ZOOM: f64 = 3.0;

/// Powers of e that a point of scrolling zooms by; a notch of most wheels is 40 points or more.
const SCROLL_ZOOM: f64 = 0.0025;

/// Views along the axes: button, key, view direction and what is up in the image.
pub const AXES: [(&str, Key, DVec3, DVec3); 6] = [
    ("+x", Key::Num1, DVec3::X, DVec3::Z),
    ("-x", Key::Num2, DVec3::NEG_X, DVec3::Z),
    ("+y", Key::Num3, DVec3::Y, DVec3::Z),
    ("-y", Key::Num4, DVec3::NEG_Y, DVec3::Z),
    ("+z", Key::Num5, DVec3::Z, DVec3::Y),
    ("-z", Key::Num6, DVec3::NEG_Z, DVec3::Y),
];

/// The camera after this frame's dragging and scrolling over the picture.
pub fn moved(camera: Camera, picture: &egui::Response, ui: &egui::Ui) -> Camera {
    let height = f64::from(picture.rect.height().max(1.0));
    let shift = |v: egui::Vec2| DVec2::new(f64::from(v.x), -f64::from(v.y)) / height;
    let drag = shift(picture.drag_delta());
    let mut camera = camera;
    if picture.dragged_by(PointerButton::Primary) {
        camera = camera.rotated(drag.x * TURN, drag.y * TURN);
    } else if picture.dragged_by(PointerButton::Middle) {
        camera = camera.panned(drag);
    } else if picture.dragged_by(PointerButton::Secondary) {
        // As in ParaView, down comes closer.
        camera = camera.zoomed((-drag.y * DRAG_ZOOM).exp(), DVec2::ZERO);
    }
    if let Some(at) = picture.hover_pos() {
        let (scroll, pinch) = ui.input(|input| (f64::from(input.smooth_scroll_delta().y), f64::from(input.zoom_delta())));
        let factor = (scroll * SCROLL_ZOOM).exp() * pinch;
        if factor != 1.0 {
            camera = camera.zoomed(factor, shift(at - picture.rect.center()));
        }
    }
    camera
}
