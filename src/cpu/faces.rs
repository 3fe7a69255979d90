//! The mesh's boundary faces as they are drawn, where rays enter and leave the mesh: the twin of `shaders/shared/faces.wgsl`.
//!
//! A face by which a ray leaves the mesh waits until it is known that the ray does not enter again at the same place, as at a seam of
//! coincident points: then neither face is drawn.

use super::Scene;
use super::descent::Descent;
use super::pass::{EDGE_INK, Gathered};
use super::probe::probe;
use super::ray::{FAR, Ray};
use super::surface::Hit;
use crate::optics::Lit;
use glam::Vec3;

/// Parts of the mesh this near to each other along a ray touch.
pub const SEAM: f32 = 1e-6;

/// Where a ray goes through a face.
#[derive(Clone, Copy)]
pub(super) struct FacePlace {
    pub t: f32,
    /// Of any length.
    normal: Vec3,
    value: f32,
    /// How much of the pixel an edge covers.
    edge: f32,
}

impl FacePlace {
    /// Where the ray goes through a face of the surface. The octree may be empty there by rounding: then what is a little farther inside
    /// counts.
    pub fn of_hit(scene: &Scene, ray: &Ray, descent: &mut Descent, hit: Hit) -> Self {
        let corners = scene.surface.map_or([Vec3::ZERO; 3], |surface| {
            surface.faces()[(hit.word >> 1) as usize].vertices.map(|v| Vec3::from(surface.vertices()[v as usize].position))
        });
        let cell_edge = 1.0 / descent.cells() as f32;
        let farther = if hit.is_exit() { -0.5 } else { 0.5 } * cell_edge / ray.length;
        let found = probe(scene, ray, descent, hit.t).or_else(|| probe(scene, ray, descent, hit.t + farther));
        let [a, b, c] = corners;
        let mut edge = 0.0;
        if scene.style.face_edges > 0.0 {
            let distance = [(a, b), (b, c), (c, a)].map(|(p, q)| distance_to_line(ray, p, q)).into_iter().fold(FAR, f32::min);
            edge = (1.0 - (distance / scene.rays.pixel_width(hit.t - ray.t_eye) - 0.5)).clamp(0.0, 1.0);
        }
        FacePlace { t: hit.t, normal: (b - a).cross(c - a), value: found.map_or(-1.0, |found| found.value), edge }
    }
}

/// How far the ray passes by a line.
fn distance_to_line(ray: &Ray, a: Vec3, b: Vec3) -> f32 {
    let across = ray.direction.cross(b - a);
    let size = across.length();
    if size <= 0.0 { FAR } else { (a - ray.origin).dot(across).abs() / size }
}

impl Gathered {
    /// The ray leaves the mesh by a face.
    pub fn leave_mesh(&mut self, place: FacePlace) {
        self.way_out = Some(place);
    }

    /// The ray enters the mesh by a face.
    pub fn enter_mesh(&mut self, scene: &Scene, ray: &Ray, place: FacePlace) {
        if self.way_out.is_some_and(|out| place.t <= out.t + SEAM) {
            self.way_out = None;
            return;
        }
        self.end_way_out(scene, ray);
        // What lies before the ray's beginning is not seen.
        if place.t > 0.0 {
            self.add_face(scene, ray, place);
        }
    }

    /// Adds the face by which the ray has left the mesh.
    pub fn end_way_out(&mut self, scene: &Scene, ray: &Ray) {
        if let Some(place) = self.way_out.take() {
            self.add_face(scene, ray, place);
        }
    }

    fn add_face(&mut self, scene: &Scene, ray: &Ray, place: FacePlace) {
        let style = &scene.style;
        let value = place.value.clamp(0.0, 1.0);
        let by_value = style.face_values > 0.0;
        let color = if by_value { scene.table.classify(scene.table.interval(value), value).color } else { style.face_color };
        let mut lit = Lit::PLAIN;
        if scene.are_surfaces_shaded && place.normal.dot(place.normal) > 0.0 {
            lit = Lit::facing(style, place.normal.normalize(), ray.to_eye());
        }
        let ink = (1.0 - EDGE_INK * place.edge) * style.face_opacity * self.light.transmittance;
        for c in 0..3 {
            self.light.color[c] += ink * (color[c] * lit.own + lit.white);
        }
        self.light.transmittance *= 1.0 - style.face_opacity;
    }
}
