//! Ways of cameras: a turn about what they look at, and from one camera to the next.

use super::{Camera, CameraError, Projection};
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::TAU;

/// Cameras that a way leads through.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    keys: Vec<Camera>,
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PathError {
    /// One camera leads nowhere.
    #[error("{0} cameras, expected at least 2")]
    TooFew(usize),
    /// Parallel and perspective cameras have nothing between them.
    #[error("camera {0} is parallel and the one before is not, or the other way round; expected one projection for all")]
    Mixed(usize),
    /// A camera that sees nothing.
    #[error("camera {index}: {cause}")]
    Camera {
        /// Its place, from 0.
        index: usize,
        /// What is wrong.
        cause: CameraError,
    },
}

impl Camera {
    /// Turns the eye about the axis through the target that is up in the image's sense, counter-clockwise seen from above, by `angle`
    /// radians.
    pub fn turned(self, angle: f64) -> Self {
        let turn = DQuat::from_axis_angle(self.up.normalize(), angle);
        Camera { eye: self.target + turn * (self.eye - self.target), ..self }
    }

    /// `count` cameras of a full turn, this one first, at equal angles.
    pub fn turntable(self, count: u32) -> Vec<Camera> {
        let at = |i: u32| if i == 0 { self } else { self.turned(TAU * f64::from(i) / f64::from(count)) };
        (0..count).map(at).collect()
    }

    /// Right, up and backwards as a rotation.
    fn orientation(&self) -> DQuat {
        let [forward, right, up] = self.axes();
        DQuat::from_mat3(&DMat3::from_cols(right, up, -forward))
    }

    /// Between this camera (`t` = 0) and another of the same projection (1): it turns evenly the shorter way, the target moves evenly, and
    /// distance and view change by even factors.
    fn between(&self, other: &Camera, t: f64) -> Camera {
        let even = |a: f64, b: f64| (a.ln() * (1.0 - t) + b.ln() * t).exp();
        let (from, mut to) = (self.orientation(), other.orientation());
        if from.dot(to) < 0.0 {
            to = -to;
        }
        let turn = from.slerp(to, t);
        let target = self.target.lerp(other.target, t);
        let distance = even(self.eye.distance(self.target), other.eye.distance(other.target));
        let projection = match (self.projection, other.projection) {
            (Projection::Perspective { fov_y_degrees: a }, Projection::Perspective { fov_y_degrees: b }) => {
                // The height that is seen at distance 1 changes by even factors.
                let half = |degrees: f64| (degrees.to_radians() / 2.0).tan();
                Projection::Perspective { fov_y_degrees: 2.0 * even(half(a), half(b)).atan().to_degrees() }
            }
            (Projection::Parallel { view_height: a }, Projection::Parallel { view_height: b }) => {
                Projection::Parallel { view_height: even(a, b) }
            }
            (projection, _) => projection,
        };
        Camera { eye: target + turn * DVec3::Z * distance, target, up: turn * DVec3::Y, projection }
    }
}

impl CameraPath {
    /// A way through these cameras, at least 2, all parallel or all in perspective.
    pub fn new(keys: Vec<Camera>) -> Result<Self, PathError> {
        if keys.len() < 2 {
            return Err(PathError::TooFew(keys.len()));
        }
        for (index, key) in keys.iter().enumerate() {
            key.validate().map_err(|cause| PathError::Camera { index, cause })?;
            let is_parallel = |camera: &Camera| matches!(camera.projection, Projection::Parallel { .. });
            if is_parallel(key) != is_parallel(&keys[0]) {
                return Err(PathError::Mixed(index));
            }
        }
        Ok(CameraPath { keys })
    }

    /// The camera at `at` in [0, 1]; the keys are equally far apart, and at them it is they to the bit.
    pub fn at(&self, at: f64) -> Camera {
        let last = self.keys.len() - 1;
        let place = at.clamp(0.0, 1.0) * last as f64;
        let before = (place.floor() as usize).min(last - 1);
        match place - before as f64 {
            0.0 => self.keys[before],
            1.0 => self.keys[last],
            t => self.keys[before].between(&self.keys[before + 1], t),
        }
    }

    /// `count` cameras at equal steps, from the first key to the last.
    pub fn cameras(&self, count: u32) -> Vec<Camera> {
        let steps = f64::from(count.max(2) - 1);
        (0..count).map(|i| self.at(f64::from(i) / steps)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn camera(eye: DVec3, target: DVec3) -> Camera {
        Camera { eye, target, up: DVec3::Z, projection: Projection::Perspective { fov_y_degrees: 30.0 } }
    }

    #[test]
    fn a_turntable_goes_once_round_the_axis() {
        let start = camera(DVec3::new(3.0, 1.0, 2.0), DVec3::new(1.0, 1.0, 1.0));
        let cameras = start.turntable(4);
        let eyes = [(3.0, 1.0), (1.0, 3.0), (-1.0, 1.0), (1.0, -1.0)].map(|(x, y)| DVec3::new(x, y, 2.0));
        assert_eq!(cameras[0], start);
        for (camera, eye) in cameras.iter().zip(eyes) {
            assert!(camera.eye.distance(eye) < 1e-12, "{} instead of {eye}", camera.eye);
            assert_eq!((camera.target, camera.up), (start.target, DVec3::Z));
        }
        assert_eq!(cameras.len(), 4);
    }

    #[test]
    fn a_way_turns_evenly_and_comes_closer_by_even_factors() {
        let (target, last) = (DVec3::new(1.0, 0.0, 0.0), DVec3::new(3.0, 0.0, 0.0));
        let path = CameraPath::new(vec![camera(target + DVec3::X * 8.0, target), camera(last + DVec3::Y * 2.0, last)]).expect("two");
        for t in [0.25, 0.5, 0.75] {
            let (seen, angle) = (path.at(t), FRAC_PI_2 * t);
            let middle = target.lerp(last, t);
            let eye = middle + DVec3::new(angle.cos(), angle.sin(), 0.0) * 8.0 * 0.25f64.powf(t);
            assert!(seen.eye.distance(eye) < 1e-12 && seen.target.distance(middle) < 1e-12, "{t}: {seen:?}");
            assert!(seen.up.distance(DVec3::Z) < 1e-12);
        }
    }

    #[test]
    fn keys_are_met_to_the_bit_and_ends_are_reached() {
        let keys: Vec<Camera> =
            [DVec3::X, DVec3::new(0.1, 2.0, 0.3), DVec3::new(-3.0, 0.2, 1.0)].map(|eye| camera(eye, DVec3::ZERO)).into();
        let cameras = CameraPath::new(keys.clone()).expect("three").cameras(5);
        assert_eq!([cameras[0], cameras[2], cameras[4]].to_vec(), keys);
        assert!(cameras.iter().all(|camera| camera.validate().is_ok()));
        assert_eq!(CameraPath::new(keys.clone()).expect("three").cameras(1), [keys[0]]);
    }

    #[test]
    fn views_change_by_even_factors() {
        let parallel = |view_height| Camera { projection: Projection::Parallel { view_height }, ..camera(DVec3::X, DVec3::ZERO) };
        let middle = CameraPath::new(vec![parallel(1.0), parallel(4.0)]).expect("two").at(0.5);
        assert!(matches!(middle.projection, Projection::Parallel { view_height } if (view_height - 2.0).abs() < 1e-12));
    }

    #[test]
    fn what_leads_nowhere_is_refused() {
        let one = camera(DVec3::X, DVec3::ZERO);
        assert_eq!(CameraPath::new(vec![one]), Err(PathError::TooFew(1)));
        let parallel = Camera { projection: Projection::Parallel { view_height: 1.0 }, ..one };
        assert_eq!(CameraPath::new(vec![one, parallel]), Err(PathError::Mixed(1)));
        assert!(matches!(CameraPath::new(vec![one, Camera { up: DVec3::X, ..one }]), Err(PathError::Camera { index: 1, .. })));
    }
}
