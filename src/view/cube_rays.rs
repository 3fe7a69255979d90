//! The rays of an image in the units of a cube: what the marchers on the CPU and the GPU start from.

use super::{PlaneUse, Planes, RayFrame};
use glam::{DVec3, Vec3, Vec4};

/// A [`RayFrame`] in the units of a cube, which is [0, 1)^3, in f32: `origin + x right_origin + y up_origin`, direction
/// `forward + x right + y up`.
///
/// In f32 a far eye would lose what lies behind the point: 1e6 cube edges away, positions come in steps of a sixteenth of the cube.
/// Therefore rays do not start at the eye but where they cross the plane through the cube's centre that faces the eye. That plane is
/// found in f64, and the eye is where t is `-eye_distance`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeRays {
    /// Where the middle ray crosses the centre plane.
    pub origin: Vec3,
    /// Origin offset per unit of x.
    pub right_origin: Vec3,
    /// Origin offset per unit of y.
    pub up_origin: Vec3,
    /// Unit view direction.
    pub forward: Vec3,
    /// Direction added per unit of x.
    pub right: Vec3,
    /// Direction added per unit of y.
    pub up: Vec3,
    /// From the eye to the centre plane, in cube edges; 0 if the eye is beyond it.
    pub eye_distance: f32,
    /// Image width and height in pixels.
    pub size: [u32; 2],
    /// Only where `n x >= d` for each of these is drawn: n of length 1, d.
    pub clips: CubePlanes,
    /// Planes that are drawn, and of each its opacity and whether edges are drawn on it (1 or 0).
    pub cuts: CubePlanes,
    /// See `cuts`.
    pub cut_looks: [[f32; 2]; Planes::MOST],
}

/// Some planes in the units of a cube: n of length 1 and d of `n x = d`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CubePlanes {
    /// The first `count` are used.
    pub planes: [Vec4; Planes::MOST],
    /// How many there are.
    pub count: u32,
}

impl CubePlanes {
    /// Those that are used.
    pub fn used(&self) -> &[Vec4] {
        &self.planes[..self.count as usize]
    }

    fn push(&mut self, plane: Vec4) {
        self.planes[self.count as usize] = plane;
        self.count += 1;
    }
}

/// One ray in the units of a cube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeRay {
    /// The point at t = 0.
    pub origin: Vec3,
    /// Not normalised, so that no rounded square root moves the points of a ray.
    pub direction: Vec3,
    /// Length of the direction: cube edges per unit of t.
    pub length: f32,
    /// The eye's t: nothing before it is seen.
    pub t_eye: f32,
}

/// `a b + c` with the same bits on every processor. A compiler may fuse a product with a sum and so round once where another rounds
/// twice; products of 12-bit halves are exact, which leaves nothing to fuse. What is sampled then never depends on where a ray is
/// followed.
pub fn mul_add(a: Vec3, b: f32, c: Vec3) -> Vec3 {
    let (a_high, b_high) = (high_bits(a), high_bits(Vec3::splat(b)).x);
    let (a_low, b_low) = (a - a_high, b - b_high);
    c + a_high * b_high + a_high * b_low + a_low * b_high + a_low * b_low
}

/// The highest 12 bits of each number; the rest is exactly 12 bits more.
pub fn high_bits(x: Vec3) -> Vec3 {
    Vec3::from(x.to_array().map(|x| f32::from_bits(x.to_bits() & 0xffff_f000)))
}

impl CubeRays {
    /// The rays of `frame` relative to a cube with lowest corner `cube_min` (in the frame's coordinates) and edge `cube_edge` > 0.
    pub fn new(frame: &RayFrame, cube_min: DVec3, cube_edge: f64) -> Self {
        let eye = (frame.eye - cube_min) / cube_edge;
        let eye_distance = (DVec3::splat(0.5) - eye).dot(frame.forward).max(0.0);
        let (mut clips, mut cuts, mut cut_looks) = (CubePlanes::default(), CubePlanes::default(), [[0.0; 2]; Planes::MOST]);
        for plane in frame.planes.iter() {
            let normal = plane.normal.normalize();
            let in_cube = normal.as_vec3().extend(normal.dot((plane.point - cube_min) / cube_edge) as f32);
            match plane.used {
                PlaneUse::Clip => clips.push(in_cube),
                PlaneUse::Cut { opacity, edges } => {
                    cut_looks[cuts.count as usize] = [opacity, if edges { 1.0 } else { 0.0 }];
                    cuts.push(in_cube);
                }
            }
        }
        CubeRays {
            clips,
            cuts,
            cut_looks,
            origin: (eye + frame.forward * eye_distance).as_vec3(),
            right_origin: (frame.right_origin / cube_edge + frame.right * eye_distance).as_vec3(),
            up_origin: (frame.up_origin / cube_edge + frame.up * eye_distance).as_vec3(),
            forward: frame.forward.as_vec3(),
            right: frame.right.as_vec3(),
            up: frame.up.as_vec3(),
            eye_distance: eye_distance as f32,
            size: [frame.width, frame.height],
        }
    }

    /// Image units per pixel along x and y: the image spans [-1, 1].
    pub fn pixel_size(&self) -> [f32; 2] {
        self.size.map(|n| 2.0 / n as f32)
    }

    /// The width of a pixel so far along a ray from the eye, in its t.
    pub fn pixel_width(&self, t: f32) -> f32 {
        (self.right_origin + self.right * (t - self.eye_distance)).length() * self.pixel_size()[0]
    }

    /// The ray through the centre of pixel (column, row), row 0 at the top.
    pub fn ray(&self, column: u32, row: u32) -> CubeRay {
        let [width, height] = self.pixel_size();
        let pixel = Vec3::new(column as f32 + 0.5, row as f32 + 0.5, 0.0);
        let x = mul_add(pixel, width, Vec3::NEG_ONE).x;
        let y = mul_add(pixel, -height, Vec3::ONE).y;
        let direction = mul_add(self.up, y, mul_add(self.right, x, self.forward));
        let origin = mul_add(self.up_origin, y, mul_add(self.right_origin, x, self.origin));
        CubeRay { origin, direction, length: direction.length(), t_eye: -self.eye_distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Camera, Projection};

    /// The distance between the f32 ray and the frame's own f64 ray, in cube edges, at the cube's centre plane.
    fn deviation(camera: Camera, cube_min: DVec3, cube_edge: f64) -> f64 {
        let frame = camera.frame(DVec3::ZERO, 64, 48);
        let rays = CubeRays::new(&frame, cube_min, cube_edge);
        let mut worst = 0.0f64;
        for (column, row) in [(0, 0), (63, 47), (20, 31), (32, 24)] {
            let (origin, direction) = frame.ray(column, row);
            let ray = rays.ray(column, row);
            for t in [-0.5, 0.0, 0.7] {
                let point = (ray.origin + ray.direction * t).as_dvec3() * cube_edge + cube_min;
                let off = (point - origin) - direction * (point - origin).dot(direction);
                worst = worst.max(off.length() / cube_edge);
            }
        }
        worst
    }

    #[test]
    fn far_cameras_and_tiny_cubes_keep_their_rays() {
        for (edge, distance) in [(1.0, 4.0), (1e-12, 4e-12), (1e9, 4e9), (2.0, 2e6), (1e-3, 1e3)] {
            let half_view: f64 = edge / distance;
            for projection in [
                Projection::Perspective { fov_y_degrees: 2.0 * half_view.atan().to_degrees() },
                Projection::Parallel { view_height: 2.0 * edge },
            ] {
                let eye = DVec3::new(0.6, -0.48, 0.64) * distance;
                let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Z, projection };
                let off = deviation(camera, DVec3::splat(-0.5 * edge), edge);
                assert!(off < 1e-6, "edge {edge}, distance {distance}, {projection:?}: off by {off} edges");
            }
        }
    }

    #[test]
    fn the_eye_is_where_the_frame_has_it() {
        let camera = Camera {
            eye: DVec3::new(-2.0, 0.5, 0.5),
            target: DVec3::splat(0.5),
            up: DVec3::Z,
            projection: Projection::Perspective { fov_y_degrees: 60.0 },
        };
        let ray = CubeRays::new(&camera.frame(DVec3::ZERO, 9, 9), DVec3::ZERO, 1.0).ray(0, 0);
        assert!((ray.origin + ray.direction * ray.t_eye - camera.eye.as_vec3()).length() < 1e-6);
        let inside = Camera { eye: DVec3::new(0.9, 0.5, 0.5), target: DVec3::new(2.0, 0.5, 0.5), ..camera };
        assert_eq!(CubeRays::new(&inside.frame(DVec3::ZERO, 9, 9), DVec3::ZERO, 1.0).ray(3, 5).t_eye, 0.0, "beyond the centre plane");
    }
}
