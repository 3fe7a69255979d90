//! More ways to move a camera: rolling, flying through, other projections, a new centre. Image positions are as in [`super::orbit`].

use super::{Camera, Projection};
use glam::{DQuat, DVec2, DVec3};

/// Zooming brings the eye as near to the target as this, in parts of the scene's extent; then the target goes ahead.
const NEAREST: f64 = 0.01;

/// How far ahead it goes, in parts of the scene's extent.
const AHEAD: f64 = 0.2;

impl Camera {
    /// Turns the image about its middle by `angle` radians, counter-clockwise where that is above 0.
    pub fn rolled(self, angle: f64) -> Self {
        let [forward, ..] = self.axes();
        Camera { up: DQuat::from_axis_angle(forward, angle) * self.up, ..self }
    }

    /// Moves eye and target along the view direction by `distance` world units, backwards where that is below 0.
    pub fn advanced(self, distance: f64) -> Self {
        let [forward, ..] = self.axes();
        Camera { eye: self.eye + forward * distance, target: self.target + forward * distance, ..self }
    }

    /// As [`Camera::zoomed`], but the eye does not stop before the target: once it is near, the target goes ahead, which is not seen, so
    /// that further zooming leads through. `extent` is the scene's size in world units, above 0.
    pub fn zoomed_through(self, factor: f64, at: DVec2, extent: f64) -> Self {
        let zoomed = self.zoomed(factor, at);
        let is_near = zoomed.eye.distance(zoomed.target) < NEAREST * extent;
        if matches!(self.projection, Projection::Parallel { .. }) || factor <= 1.0 || !is_near {
            return zoomed;
        }
        let [forward, ..] = zoomed.axes();
        Camera { target: zoomed.eye + forward * (AHEAD * extent), ..zoomed }
    }

    /// Parallel in place of perspective and back. What lies at the target's depth keeps its size; a perspective camera gets this vertical
    /// field of view, in (0, 180).
    pub fn switched(self, fov_y_degrees: f64) -> Self {
        let view_height = self.view_height();
        match self.projection {
            Projection::Perspective { .. } => Camera { projection: Projection::Parallel { view_height }, ..self },
            Projection::Parallel { .. } => {
                let [forward, ..] = self.axes();
                let distance = view_height / 2.0 / (fov_y_degrees.to_radians() / 2.0).tan();
                Camera { eye: self.target - forward * distance, projection: Projection::Perspective { fov_y_degrees }, ..self }
            }
        }
    }

    /// Moves sideways until `point` is in the middle, and makes it the target. What is seen at its depth keeps its size. A camera that has
    /// it beside or behind the eye stays as it is.
    pub fn recentred(self, point: DVec3) -> Self {
        let [forward, ..] = self.axes();
        let depth = (point - self.eye).dot(forward);
        let centred = Camera { eye: point - forward * depth, target: point, ..self };
        if depth > 0.0 && centred.validate().is_ok() { centred } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn cameras() -> [Camera; 2] {
        let perspective = Camera {
            eye: DVec3::new(3.0, -4.0, 2.0),
            target: DVec3::new(0.5, 0.25, -0.125),
            up: DVec3::Z,
            projection: Projection::Perspective { fov_y_degrees: 40.0 },
        };
        [perspective, Camera { projection: Projection::Parallel { view_height: 3.0 }, ..perspective }]
    }

    fn beside(camera: &Camera) -> DVec3 {
        let [forward, right, up] = camera.axes();
        camera.target + right * 0.4 + up * 0.3 + forward * 0.7
    }

    #[test]
    fn rolling_turns_the_image_counter_clockwise() {
        for camera in cameras() {
            let before = camera.seen_at(beside(&camera)).expect("seen");
            let after = camera.rolled(FRAC_PI_2).seen_at(beside(&camera)).expect("seen");
            assert!(after.distance(before.perp()) < 1e-12, "{before} became {after}");
            let back = camera.rolled(0.3).rolled(-0.3);
            assert!(back.up.distance(camera.up) < 1e-12 && back.eye == camera.eye);
        }
    }

    #[test]
    fn zooming_leads_through_the_target_without_a_jump() {
        let mut camera = cameras()[0];
        let ([forward, ..], target) = (camera.axes(), camera.target);
        let mut passed = f64::NEG_INFINITY;
        for _ in 0..200 {
            let next = camera.zoomed_through(1.2, DVec2::ZERO, 1.0);
            let beyond = (next.eye - target).dot(forward);
            assert!(beyond > passed, "always ahead: {beyond} after {passed}");
            assert!(next.axes()[0].distance(forward) < 1e-9 && next.eye.distance(next.target) > NEAREST / 1.2);
            (camera, passed) = (next, beyond);
        }
        assert!(passed > 1.5, "far beyond the target: {passed}");
        // The step that takes the target ahead moves the eye as one that does not.
        let near = Camera { eye: target - forward * NEAREST, ..cameras()[0] };
        let (plain, through) = (near.zoomed(1.1, DVec2::X * 0.1), near.zoomed_through(1.1, DVec2::X * 0.1, 1.0));
        assert_eq!(plain.eye, through.eye);
        assert!((through.eye.distance(through.target) - AHEAD).abs() < 1e-12);
        let parallel = cameras()[1];
        assert_eq!(parallel.zoomed_through(1.5, DVec2::X, 1e9), parallel.zoomed(1.5, DVec2::X));
    }

    #[test]
    fn advancing_keeps_the_distance_to_the_target() {
        for camera in cameras() {
            let [forward, ..] = camera.axes();
            let there = camera.advanced(7.0);
            assert!((there.eye - camera.eye).distance(forward * 7.0) < 1e-12 && there.axes()[0].distance(forward) < 1e-12);
            assert!(there.advanced(-7.0).target.distance(camera.target) < 1e-12);
        }
    }

    #[test]
    fn the_other_projection_keeps_sizes_at_the_target() {
        for camera in cameras() {
            let switched = camera.switched(40.0);
            let [_, right, _] = camera.axes();
            let at_target = camera.target + right * 0.3;
            assert!(switched.seen_at(at_target).expect("seen").distance(camera.seen_at(at_target).expect("seen")) < 1e-12);
            assert_ne!(std::mem::discriminant(&switched.projection), std::mem::discriminant(&camera.projection));
        }
        let (camera, there_and_back) = (cameras()[0], cameras()[0].switched(12.0).switched(40.0));
        assert!(there_and_back.eye.distance(camera.eye) < 1e-12 && there_and_back.projection == camera.projection);
    }

    #[test]
    fn a_new_centre_is_in_the_middle_at_its_size() {
        for camera in cameras() {
            let point = beside(&camera);
            let [forward, right, _] = camera.axes();
            let centred = camera.recentred(point);
            assert!(centred.seen_at(point).expect("seen").length() < 1e-12 && centred.axes()[0].distance(forward) < 1e-12);
            let width = |c: &Camera| c.seen_at(point + right * 0.1).expect("seen").distance(c.seen_at(point).expect("seen"));
            assert!((width(&centred) / width(&camera) - 1.0).abs() < 1e-12);
            assert_eq!(camera.recentred(camera.eye - forward), camera, "behind the eye");
        }
    }
}
