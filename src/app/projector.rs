//! From the world to the window: where places of the data are in the picture.

use crate::view::{Camera, RayFrame};
use egui::{Pos2, Rect, pos2};
use glam::{DMat4, DVec3, DVec4};

/// Nearer than this share of the distance to the target nothing is shown.
const NEAR: f64 = 1e-4;

/// The projection of one view.
#[derive(Debug, Clone, Copy)]
pub struct Projector {
    /// From positions relative to the data's centre to clip space: x and y in [-1, 1] after division, y up.
    clip_from_data: DMat4,
    center: DVec3,
    rect: Rect,
}

impl Projector {
    /// The projection of a camera onto the picture's place in the window; `center` is the data's.
    pub fn new(camera: &Camera, center: DVec3, rect: Rect) -> Self {
        let [width, height] = [rect.width(), rect.height()].map(|n| n.max(1.0).round() as u32);
        let frame = camera.frame(center, width, height);
        Projector { clip_from_data: clip_from_data(&frame, camera.eye.distance(camera.target)), center, rect }
    }

    /// Where a place in world coordinates is in the window; `None` behind the eye.
    pub fn place(&self, world: DVec3) -> Option<Pos2> {
        let clip = self.clip_from_data * (world - self.center).extend(1.0);
        if clip.w <= 0.0 || clip.z < 0.0 {
            return None;
        }
        let at = clip / clip.w;
        let x = self.rect.left() + self.rect.width() * (0.5 + 0.5 * at.x as f32);
        Some(pos2(x, self.rect.top() + self.rect.height() * (0.5 - 0.5 * at.y as f32)))
    }

    /// From positions relative to the data's centre to clip space.
    pub fn clip_from_data(&self) -> DMat4 {
        self.clip_from_data
    }

    /// The same for a shader, column by column.
    pub fn matrix(&self) -> [[f32; 4]; 4] {
        self.clip_from_data.as_mat4().to_cols_array_2d()
    }
}

/// The matrix whose result has x / w and y / w in [-1, 1] over the image, and z / w above 0 in front of the eye.
fn clip_from_data(frame: &RayFrame, distance: f64) -> DMat4 {
    // Along an axis of the image a unit is either an angle's tangent or a length.
    let parallel = frame.right == DVec3::ZERO;
    let (right, up) = if parallel { (frame.right_origin, frame.up_origin) } else { (frame.right, frame.up) };
    let row = |v: DVec3, offset: f64| DVec4::new(v.x, v.y, v.z, offset - v.dot(frame.eye));
    let (x, y) = (row(right / right.length_squared(), 0.0), row(up / up.length_squared(), 0.0));
    let depth = row(frame.forward, 0.0);
    let near = NEAR * distance;
    // z = w - near: above 0 beyond the nearest, and z / w below 1.
    let (z, w) = if parallel { (depth * 0.0 + DVec4::W * 0.5, DVec4::W) } else { (depth - DVec4::W * near, depth) };
    DMat4::from_cols(x, y, z, w).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Projection;
    use egui::vec2;

    #[test]
    fn places_on_a_pixels_ray_are_at_the_pixel() {
        let rect = Rect::from_min_size(pos2(300.0, 20.0), vec2(120.0, 90.0));
        for projection in [Projection::Perspective { fov_y_degrees: 40.0 }, Projection::Parallel { view_height: 3.0 }] {
            let camera = Camera { eye: DVec3::new(5.0, 2.0, 9.0), target: DVec3::new(3.0, 3.0, 3.0), up: DVec3::Z, projection };
            let center = DVec3::new(3.0, 2.0, 1.0);
            let projector = Projector::new(&camera, center, rect);
            let frame = camera.frame(center, 120, 90);
            for (column, row) in [(0, 0), (119, 89), (20, 70), (60, 44)] {
                let (origin, direction) = frame.ray(column, row);
                for t in [1.0, 4.0, 50.0] {
                    let at = projector.place(origin + direction * t + center).expect("before the eye");
                    let expected = rect.min + vec2(column as f32 + 0.5, row as f32 + 0.5);
                    assert!((at - expected).length() < 1e-3, "{projection:?}: {at}, expected {expected}");
                }
            }
        }
        let camera =
            Camera { eye: DVec3::ZERO, target: DVec3::X, up: DVec3::Z, projection: Projection::Perspective { fov_y_degrees: 40.0 } };
        assert_eq!(Projector::new(&camera, DVec3::ZERO, rect).place(DVec3::NEG_X), None, "behind the eye");
    }
}
