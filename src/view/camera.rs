//! Cameras and the rays through pixel centres.

use super::Planes;
use crate::geometry::Aabb;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// How rays leave the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Rays through the eye; the vertical field of view in degrees, in (0, 180).
    Perspective {
        /// Vertical field of view in degrees.
        fov_y_degrees: f64,
    },
    /// Rays parallel to the view direction; the world height of the image.
    Parallel {
        /// World units from the bottom to the top of the image.
        view_height: f64,
    },
}

/// A camera in world coordinates; right-handed, +z up on the standard orbit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "CameraFile", into = "CameraFile")]
pub struct Camera {
    /// Where the eye is.
    pub eye: DVec3,
    /// What it looks at.
    pub target: DVec3,
    /// A direction that is up in the image, not parallel to the view direction.
    pub up: DVec3,
    /// Perspective or parallel.
    pub projection: Projection,
}

/// Why a camera cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// Eye, target and up do not span a view.
    #[error("the camera's eye, target and up must be finite, eye and target apart, and up not along the view direction")]
    Degenerate,
    /// Field of view or height out of range.
    #[error("the camera's {what} is {value}, expected {expected}")]
    Range {
        /// The quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Something else is wrong with the file's content.
    #[error("the camera's projection is \"{0}\", expected \"perspective\" or \"parallel\"")]
    Projection(String),
}

/// The camera file of `conventions.md`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    projection: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fov_y_degrees: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view_height: Option<f64>,
}

impl TryFrom<CameraFile> for Camera {
    type Error = CameraError;

    fn try_from(file: CameraFile) -> Result<Self, CameraError> {
        let projection = match file.projection.as_deref() {
            None | Some("perspective") => Projection::Perspective { fov_y_degrees: file.fov_y_degrees.unwrap_or(30.0) },
            Some("parallel") => Projection::Parallel { view_height: file.view_height.unwrap_or(f64::NAN) },
            Some(other) => return Err(CameraError::Projection(other.to_owned())),
        };
        let camera = Camera { eye: file.eye.into(), target: file.target.into(), up: file.up.into(), projection };
        camera.validate()?;
        Ok(camera)
    }
}

impl From<Camera> for CameraFile {
    fn from(camera: Camera) -> Self {
        let (projection, fov_y_degrees, view_height) = match camera.projection {
            Projection::Perspective { fov_y_degrees } => (None, Some(fov_y_degrees), None),
            Projection::Parallel { view_height } => (Some("parallel".to_owned()), None, Some(view_height)),
        };
        let (eye, target, up) = (camera.eye.into(), camera.target.into(), camera.up.into());
        CameraFile { eye, target, up, projection, fov_y_degrees, view_height }
    }
}

/// The rays of an image: pixel (i from the left, j from the *top*) has
/// `origin = eye + x right_origin + y up_origin` and `direction = normalize(forward + x right + y up)` with
/// `x = 2 (i + 0.5) / width - 1`, `y = 1 - 2 (j + 0.5) / height`. A perspective camera has zero `*_origin`, a parallel one zero `right`
/// and `up`. Coordinates are relative to the mesh's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayFrame {
    /// The eye, relative to the mesh's centre.
    pub eye: DVec3,
    /// Direction through the middle: of a whole image the view direction, of length 1.
    pub forward: DVec3,
    /// Direction added per unit of x.
    pub right: DVec3,
    /// Direction added per unit of y.
    pub up: DVec3,
    /// Origin offset per unit of x.
    pub right_origin: DVec3,
    /// Origin offset per unit of y.
    pub up_origin: DVec3,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// What clips the rays, and what is drawn where it cuts the data; relative to the mesh's centre.
    pub planes: Planes,
}

impl RayFrame {
    /// The same rays with these planes, given in the world, in which the mesh's centre lies at `center`.
    pub fn with_planes(self, planes: &Planes, center: DVec3) -> RayFrame {
        RayFrame { planes: planes.translated(-center), ..self }
    }

    /// Rows `first..first + count` of the image as an image of their own. Rows beyond the image are those of a higher one.
    pub fn rows(&self, first: u32, count: u32) -> RayFrame {
        let height = f64::from(self.height);
        let (middle, share) = (1.0 - f64::from(2 * first + count) / height, f64::from(count) / height);
        RayFrame {
            eye: self.eye + self.up_origin * middle,
            forward: self.forward + self.up * middle,
            up: self.up * share,
            up_origin: self.up_origin * share,
            height: count,
            ..*self
        }
    }

    /// Origin and unit direction of the ray through the centre of pixel (column, row), row 0 at the top.
    pub fn ray(&self, column: u32, row: u32) -> (DVec3, DVec3) {
        let x = 2.0 * (f64::from(column) + 0.5) / f64::from(self.width) - 1.0;
        let y = 1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(self.height);
        let origin = self.eye + self.right_origin * x + self.up_origin * y;
        (origin, (self.forward + self.right * x + self.up * y).normalize())
    }
}

impl Camera {
    /// View `k` of the standard orbit about world bounds: 12 views 30 degrees apart, elevation 20 degrees, field of view 30 degrees
    /// (`conventions.md`). `k` beyond 11 goes round again; `zoom` > 0 divides the distance.
    pub fn orbit(world_bounds: Aabb, k: u32, zoom: f64) -> Self {
        let (center, radius) = (world_bounds.center(), world_bounds.diagonal() / 2.0);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let distance = radius / 15f64.to_radians().sin() / zoom;
        let (azimuth, elevation) = ((15.0 + 30.0 * f64::from(k % 12)).to_radians(), 20f64.to_radians());
        let direction = DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
        let projection = Projection::Perspective { fov_y_degrees: 30.0 };
        Camera { eye: center + direction * distance, target: center, up: DVec3::Z, projection }
    }

    /// Checks that the camera spans a view.
    pub fn validate(&self) -> Result<(), CameraError> {
        let forward = self.target - self.eye;
        let spans = forward.normalize_or_zero().cross(self.up.normalize_or_zero()).length();
        if !(self.eye.is_finite() && self.target.is_finite() && self.up.is_finite() && spans > 1e-9) {
            return Err(CameraError::Degenerate);
        }
        let (what, value, expected, valid) = match self.projection {
            Projection::Perspective { fov_y_degrees: v } => ("fov_y_degrees", v, "a number above 0 and below 180", v > 0.0 && v < 180.0),
            Projection::Parallel { view_height: v } => ("view_height", v, "a finite number above 0", v > 0.0 && v.is_finite()),
        };
        if valid { Ok(()) } else { Err(CameraError::Range { what, value, expected }) }
    }

    /// The rays of a `width` x `height` image, relative to `center` (the mesh's).
    pub fn frame(&self, center: DVec3, width: u32, height: u32) -> RayFrame {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let aspect = f64::from(width) / f64::from(height);
        let zero = DVec3::ZERO;
        let eye = self.eye - center;
        match self.projection {
            Projection::Perspective { fov_y_degrees } => {
                let t = (fov_y_degrees.to_radians() / 2.0).tan();
                let (right, up) = (right * (t * aspect), up * t);
                RayFrame { eye, forward, right, up, right_origin: zero, up_origin: zero, width, height, planes: Planes::NONE }
            }
            Projection::Parallel { view_height } => {
                let (right_origin, up_origin) = (right * (view_height / 2.0 * aspect), up * (view_height / 2.0));
                RayFrame { eye, forward, right: zero, up: zero, right_origin, up_origin, width, height, planes: Planes::NONE }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orbit_looks_at_the_centre_from_the_stated_distance() {
        let bounds = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(3.0, 2.0, 4.0) };
        let camera = Camera::orbit(bounds, 3, 2.0);
        let d = bounds.diagonal() / 2.0 / 15f64.to_radians().sin() / 2.0;
        assert!((camera.eye.distance(bounds.center()) - d).abs() < 1e-12);
        assert!(((camera.eye - bounds.center()).z / d - 20f64.to_radians().sin()).abs() < 1e-12);
        let frame = camera.frame(bounds.center(), 101, 101);
        let (origin, direction) = frame.ray(50, 50);
        assert!((origin + direction * d).length() < 1e-12, "the middle pixel's ray meets the centre");
        let (_, above) = frame.ray(50, 0);
        assert!(above.z > direction.z, "row 0 is at the top");
    }

    #[test]
    fn parallel_rays_are_parallel() {
        let json = r#"{"eye": [0, -5, 0], "target": [0, 0, 0], "up": [0, 0, 1], "projection": "parallel", "view_height": 4.0}"#;
        let camera: Camera = serde_json::from_str(json).expect("a valid camera");
        let frame = camera.frame(DVec3::ZERO, 2, 2);
        let ((o, d), (p, e)) = (frame.ray(0, 0), frame.ray(1, 1));
        assert_eq!((d, e), (DVec3::Y, DVec3::Y));
        assert!((o - DVec3::new(-1.0, -5.0, 1.0)).length() < 1e-12 && (p - DVec3::new(1.0, -5.0, -1.0)).length() < 1e-12);
    }

    #[test]
    fn rows_have_the_rays_of_the_image() {
        for projection in [Projection::Perspective { fov_y_degrees: 50.0 }, Projection::Parallel { view_height: 3.0 }] {
            let camera = Camera { eye: DVec3::new(3.0, 2.0, 1.0), target: DVec3::ZERO, up: DVec3::Z, projection };
            let frame = camera.frame(DVec3::ZERO, 30, 20);
            assert_eq!(frame.rows(0, 20), frame);
            let rows = frame.rows(13, 5);
            for (column, row) in [(0, 0), (7, 4), (29, 2)] {
                let ((o, d), (p, e)) = (frame.ray(column, 13 + row), rows.ray(column, row));
                assert!(o.distance(p) < 1e-14 && d.distance(e) < 1e-14);
            }
        }
    }

    #[test]
    fn cameras_that_span_no_view_are_refused() {
        for json in [
            r#"{"eye": [0,0,1], "target": [0,0,0], "up": [0,0,1]}"#,
            r#"{"eye": [0,0,0], "target": [0,0,0], "up": [0,0,1]}"#,
            r#"{"eye": [1,0,0], "target": [0,0,0], "up": [0,0,1], "fov_y_degrees": 180}"#,
            r#"{"eye": [1,0,0], "target": [0,0,0], "up": [0,0,1], "projection": "parallel"}"#,
            r#"{"eye": [1,0,0], "target": [0,0,0], "up": [0,0,1], "projection": "fisheye"}"#,
        ] {
            assert!(serde_json::from_str::<Camera>(json).is_err(), "{json}");
        }
    }
}
