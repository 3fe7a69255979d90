//! Planes moved and turned by hand: what a ray through the pointer makes of one.

use glam::DVec3;

/// Rays that go along the normal more than this, by the cosine between the two, do not move a plane.
const ALONG: f64 = 0.985;

/// The arrow on a plane: from a place on it along its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneHandle {
    /// Where it begins.
    pub pivot: DVec3,
    /// The plane's normal, of length 1.
    pub normal: DVec3,
    /// The arrow's length, world units, above 0.
    pub length: f64,
}

impl PlaneHandle {
    /// The arrow's tip.
    pub fn tip(&self) -> DVec3 {
        self.pivot + self.normal * self.length
    }

    /// How far along the normal, from the pivot, the line of the arrow comes nearest to a ray of origin and unit direction. `None` for rays
    /// that go along the normal within 10 degrees: they say little of it.
    pub fn along(&self, (origin, direction): (DVec3, DVec3)) -> Option<f64> {
        let cos = direction.dot(self.normal);
        if cos.abs() > ALONG {
            return None;
        }
        let to_pivot = self.pivot - origin;
        Some((cos * to_pivot.dot(direction) - to_pivot.dot(self.normal)) / (1.0 - cos * cos))
    }

    /// Whether the tip lies on the half of its sphere about the pivot that is turned away from a ray's origin.
    pub fn is_averted(&self, (_, direction): (DVec3, DVec3)) -> bool {
        direction.dot(self.normal) > 0.0
    }

    /// The normal with which the tip lies on a ray: where that meets the sphere about the pivot, on its near half, or on the averted one.
    /// Rays beside the sphere roll it on, over its rim to the other half; at twice its radius it shows straight to or from the eye.
    pub fn turned(&self, (origin, direction): (DVec3, DVec3), is_averted: bool) -> DVec3 {
        let to_pivot = self.pivot - origin;
        // From the pivot to where the ray passes it.
        let beside = direction * to_pivot.dot(direction) - to_pivot;
        let off = beside.length() / self.length;
        let (across, is_averted) = if off > 1.0 { ((2.0 - off).max(0.0), !is_averted) } else { (off, is_averted) };
        let depth = (1.0 - across * across).max(0.0).sqrt();
        let across = beside.normalize_or_zero() * across;
        (across + direction * if is_averted { depth } else { -depth }).normalize_or(self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Camera, Projection};
    use glam::DVec2;

    fn cameras() -> [Camera; 2] {
        let (eye, target) = (DVec3::new(4.0, -5.0, 3.0), DVec3::new(1.0, 0.5, 0.0));
        let camera = Camera { eye, target, up: DVec3::Z, projection: Projection::Perspective { fov_y_degrees: 40.0 } };
        [camera, Camera { projection: Projection::Parallel { view_height: 5.0 }, ..camera }]
    }

    #[test]
    fn a_plane_moves_to_where_its_arrow_is_pointed_at() {
        let handle = PlaneHandle { pivot: DVec3::new(1.2, 0.4, -0.3), normal: DVec3::new(0.2, 0.3, 1.0).normalize(), length: 0.5 };
        for camera in cameras() {
            for s in [-0.7, 0.0, 0.5, 2.0] {
                let at = camera.seen_at(handle.pivot + handle.normal * s).expect("before the eye");
                let along = handle.along(camera.ray_at(at)).expect("seen from aside");
                assert!((along - s).abs() < 1e-9, "{along}, expected {s}");
            }
            let [forward, ..] = camera.axes();
            assert_eq!(PlaneHandle { normal: forward, ..handle }.along(camera.ray_at(DVec2::ZERO)), None, "seen from the end");
        }
    }

    #[test]
    fn the_tip_stays_under_the_pointer_and_rolls_over_the_rim() {
        for camera in cameras() {
            let [forward, right, up] = camera.axes();
            let handle = PlaneHandle { pivot: camera.target, normal: -forward, length: 0.5 };
            for normal in [DVec3::new(0.3, 0.4, -0.5), DVec3::new(-0.6, 0.1, 0.8), DVec3::new(0.1, 0.0, 0.9)].map(DVec3::normalize) {
                let normal = right * normal.x + up * normal.y + forward * normal.z;
                let wanted = PlaneHandle { normal, ..handle };
                let ray = camera.ray_at(camera.seen_at(wanted.tip()).expect("before the eye"));
                let turned = handle.turned(ray, wanted.is_averted(ray));
                assert!(turned.distance(normal) < 1e-9, "{turned}, expected {normal}");
            }
            // Along a line from the middle to twice the radius the tip goes once over the sphere, without a jump.
            let to = |off: f64| handle.turned((handle.pivot + right * (off * 0.5) - forward * 9.0, forward), false);
            let angles: Vec<f64> = (0..=20).map(|i| to(f64::from(i) / 10.0).dot(-forward).clamp(-1.0, 1.0).acos()).collect();
            assert!(angles.windows(2).all(|pair| pair[0] < pair[1] && pair[1] - pair[0] < 0.5), "{angles:?}");
            assert!(angles[0] < 1e-6 && (angles[10] - std::f64::consts::FRAC_PI_2).abs() < 1e-6 && angles[20] > 3.1, "{angles:?}");
        }
    }
}
