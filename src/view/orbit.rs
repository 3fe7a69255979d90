//! Moving a camera: what dragging and scrolling in a window do to it. Image positions are in image heights from the middle of the image,
//! x to the right, y up.

use super::{Camera, Projection};
use crate::geometry::Aabb;
use glam::{DQuat, DVec2, DVec3};

impl Camera {
    /// Turns the eye about the target so that what lies in front of the target seems to turn to the right by `yaw` and up by `pitch`, in
    /// radians. As on a trackball there is no pole: up turns along.
    pub fn rotated(self, yaw: f64, pitch: f64) -> Self {
        let [_, right, up] = self.axes();
        let turn = DQuat::from_scaled_axis(right * pitch - up * yaw);
        Camera { eye: self.target + turn * (self.eye - self.target), up: turn * up, ..self }
    }

    /// Moves eye and target so that what lies at the target's depth moves by `shift` in the image.
    pub fn panned(self, shift: DVec2) -> Self {
        let [_, right, up] = self.axes();
        let by = (right * shift.x + up * shift.y) * -self.view_height();
        Camera { eye: self.eye + by, target: self.target + by, ..self }
    }

    /// Makes what lies at the target's depth `factor` > 0 times as large; the point of it that is seen at `at` stays there. A camera that
    /// would no longer span a view in f64 stays as it is.
    pub fn zoomed(self, factor: f64, at: DVec2) -> Self {
        let [_, right, up] = self.axes();
        let fixed = self.target + (right * at.x + up * at.y) * self.view_height();
        let moved = |p: DVec3| fixed + (p - fixed) / factor;
        let zoomed = match self.projection {
            Projection::Perspective { .. } => Camera { eye: moved(self.eye), target: moved(self.target), ..self },
            Projection::Parallel { view_height } => {
                let by = moved(self.target) - self.target;
                let projection = Projection::Parallel { view_height: view_height / factor };
                Camera { eye: self.eye + by, target: self.target + by, projection, ..self }
            }
        };
        if zoomed.validate().is_ok() { zoomed } else { self }
    }

    /// Looks at the centre of world bounds from where their bounding sphere just fits an image of `aspect` = width / height. Keeps the
    /// direction.
    pub fn fitted(self, world_bounds: Aabb, aspect: f64) -> Self {
        let [forward, ..] = self.axes();
        let radius = world_bounds.diagonal() / 2.0;
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let narrower = aspect.min(1.0);
        let (distance, projection) = match self.projection {
            Projection::Perspective { fov_y_degrees } => {
                let half_angle = ((fov_y_degrees.to_radians() / 2.0).tan() * narrower).atan();
                (radius / half_angle.sin(), self.projection)
            }
            Projection::Parallel { .. } => (2.0 * radius, Projection::Parallel { view_height: 2.0 * radius / narrower }),
        };
        let target = world_bounds.center();
        Camera { eye: target - forward * distance, target, projection, ..self }
    }

    /// Looks along `forward` at the same target from the same distance, `up` being up in the image and not along `forward`.
    pub fn facing(self, forward: DVec3, up: DVec3) -> Self {
        let distance = self.eye.distance(self.target);
        Camera { eye: self.target - forward.normalize() * distance, up, ..self }
    }

    /// World units from the bottom to the top of the image at the target's depth.
    pub fn view_height(&self) -> f64 {
        match self.projection {
            Projection::Perspective { fov_y_degrees } => 2.0 * (fov_y_degrees.to_radians() / 2.0).tan() * self.eye.distance(self.target),
            Projection::Parallel { view_height } => view_height,
        }
    }

    /// Forward, right and up in the image: unit vectors at right angles.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        [forward, right, right.cross(forward)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 2] {
        let perspective = Camera {
            eye: DVec3::new(3.0, -4.0, 2.0),
            target: DVec3::new(0.5, 0.25, -0.125),
            up: DVec3::Z,
            projection: Projection::Perspective { fov_y_degrees: 40.0 },
        };
        [perspective, Camera { projection: Projection::Parallel { view_height: 3.0 }, ..perspective }]
    }

    fn seen_at(camera: &Camera, point: DVec3) -> DVec2 {
        camera.seen_at(point).expect("before the eye")
    }

    #[test]
    fn panning_follows_the_pointer() {
        for camera in cameras() {
            let shift = DVec2::new(0.3, -0.2);
            assert!(seen_at(&camera.panned(shift), camera.target).distance(shift) < 1e-12);
        }
    }

    #[test]
    fn zooming_keeps_the_point_under_the_pointer() {
        for camera in cameras() {
            let at = DVec2::new(-0.4, 0.25);
            let [_, right, up] = camera.axes();
            let point = camera.target + (right * at.x + up * at.y) * camera.view_height();
            let zoomed = camera.zoomed(1.7, at);
            assert!(seen_at(&zoomed, point).distance(at) < 1e-12);
            assert!((camera.view_height() / zoomed.view_height() - 1.7).abs() < 1e-12);
        }
        let camera = cameras()[0];
        assert_eq!(camera.zoomed(1e300, DVec2::ZERO), camera, "eye and target would meet");
    }

    #[test]
    fn rotating_turns_the_front_with_the_pointer() {
        for camera in cameras() {
            let [forward, ..] = camera.axes();
            let front = camera.target - forward * 0.1;
            assert!(seen_at(&camera.rotated(0.2, 0.0), front).x > 0.001, "to the right");
            assert!(seen_at(&camera.rotated(0.0, 0.2), front).y > 0.001, "up");
            let round = (0..8).fold(camera, |c, _| c.rotated(0.0, std::f64::consts::FRAC_PI_4));
            assert!(round.eye.distance(camera.eye) < 1e-12, "over the pole and back");
            assert!(seen_at(&camera.rotated(0.7, -0.4), camera.target).length() < 1e-12);
        }
    }

    #[test]
    fn fitting_touches_the_bounding_sphere() {
        let bounds = Aabb { min: DVec3::new(1.0, 2.0, 3.0), max: DVec3::new(5.0, 4.0, 7.0) };
        for (camera, aspect) in cameras().into_iter().flat_map(|c| [(c, 0.5), (c, 2.0)]) {
            let fitted = camera.fitted(bounds, aspect);
            let frame = fitted.frame(bounds.center(), (1000.0 * aspect) as u32, 1000);
            let (origin, direction) = if aspect < 1.0 { frame.ray(0, 500) } else { frame.ray(frame.width / 2, 0) };
            let miss = (origin - direction * origin.dot(direction)).length();
            assert!((miss / (bounds.diagonal() / 2.0) - 1.0).abs() < 0.01, "{miss}");
        }
    }

    #[test]
    fn facing_keeps_target_and_distance() {
        let camera = cameras()[0];
        let facing = camera.facing(-DVec3::Z, DVec3::Y);
        assert_eq!((facing.target, facing.axes()[0]), (camera.target, -DVec3::Z));
        assert!((facing.eye.distance(facing.target) - camera.eye.distance(camera.target)).abs() < 1e-12);
    }
}
