//! The orientation axes in the lower left corner.

use super::drawing::{Anchor, Color, Drawing, Shape};
use crate::view::Camera;
use glam::{DVec2, DVec3};

/// Where they meet, from the lower left corner, and how long they are; points.
const CORNER: f64 = 50.0;
const LENGTH: f64 = 30.0;

/// Names, directions and colours.
const AXES: [(&str, DVec3, Color); 3] =
    [("x", DVec3::X, [0.93, 0.33, 0.31, 1.0]), ("y", DVec3::Y, [0.30, 0.72, 0.32, 1.0]), ("z", DVec3::Z, [0.33, 0.55, 0.97, 1.0])];

/// What they cover.
pub fn place(size: DVec2) -> Option<[DVec2; 2]> {
    let reach = DVec2::splat(LENGTH + 18.0);
    let middle = DVec2::new(CORNER, size.y - CORNER);
    (size.x >= 150.0 && size.y >= 120.0).then(|| [middle - reach, middle + reach])
}

/// Draws them, those that point away from the viewer first.
pub fn draw(drawing: &mut Drawing, size: DVec2, camera: &Camera) {
    if place(size).is_none() {
        return;
    }
    let [forward, right, up] = camera.axes();
    let middle = DVec2::new(CORNER, size.y - CORNER);
    let mut axes = AXES;
    axes.sort_by(|a, b| b.1.dot(forward).total_cmp(&a.1.dot(forward)));
    for (name, direction, color) in axes {
        let along = DVec2::new(direction.dot(right), -direction.dot(up)) * LENGTH;
        drawing.front.push(Shape::Line { from: middle, to: middle + along, width: 2.5, color });
        let beyond = along.try_normalize().unwrap_or(DVec2::new(0.7, -0.7));
        let at = middle + along + beyond * 9.0;
        drawing.front.push(Shape::Text { at, anchor: Anchor::CENTER, size: 13.0, color, text: name.into() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Projection;

    #[test]
    fn they_point_where_the_world_axes_go() {
        let projection = Projection::Perspective { fov_y_degrees: 30.0 };
        let camera = Camera { eye: DVec3::new(0.0, -9.0, 0.0), target: DVec3::ZERO, up: DVec3::Z, projection };
        let mut drawing = Drawing::on([0.0; 3]);
        draw(&mut drawing, DVec2::new(400.0, 300.0), &camera);
        let mut found = Vec::new();
        for pair in drawing.front.chunks(2) {
            let [Shape::Line { from, to, .. }, Shape::Text { text, .. }] = pair else { panic!("a line and its name") };
            found.push((text.as_str(), *to - *from));
        }
        // y goes away from the viewer and is painted first.
        assert_eq!(found[0], ("y", DVec2::ZERO));
        assert!(found.contains(&("x", DVec2::X * LENGTH)) && found.contains(&("z", DVec2::NEG_Y * LENGTH)));
    }
}
