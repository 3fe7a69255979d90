//! What a ray makes of the values on its way: the twin of `shaders/shared/pass.wgsl`.

use super::descent::Descent;
use super::faces::FacePlace;
use super::probe::{meet, probe};
use super::ray::{FAR, Ray};
use super::{Scene, is_between};
use crate::optics::{Light, Lit};
use crate::view::{Mode, Output, Planes};
use glam::Vec3;

/// How dark an edge is.
pub const EDGE_INK: f32 = 0.8;
/// How far from an edge pixels may be that it covers, in pixels.
const EDGE_REACH: f32 = 1.5;

/// What a ray has made of its way so far.
pub(super) struct Gathered {
    pub light: Light,
    /// The largest value, the smallest, or the integral; below 0 before anything was met.
    number: f32,
    /// The length of what was passed, in cube edges.
    length: f32,
    /// Where the first surface is; [`FAR`] before there is one.
    surface_t: f32,
    /// The last value, where what comes next continues it.
    last: Option<f32>,
    /// Where the ray meets each plane that is drawn, still ahead; [`FAR`] for others.
    cuts: [f32; Planes::MOST],
    /// Where the ray has left the mesh, unless it goes on there.
    pub way_out: Option<FacePlace>,
}

/// A stretch of a ray over which the field goes linearly from one value to another.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    /// Where it begins and ends, in t.
    pub span: [f32; 2],
    /// The values there.
    pub ends: [f32; 2],
    /// In cube edges.
    pub length: f32,
    /// The field's gradient where the volume is shaded: normalised values per cube edge.
    pub gradient: Vec3,
}

impl Gathered {
    /// Nothing yet.
    pub fn new(scene: &Scene, ray: &Ray) -> Self {
        let mut cuts = [FAR; Planes::MOST];
        for (t, plane) in cuts.iter_mut().zip(scene.rays.cuts.used()) {
            let along = plane.truncate().dot(ray.direction);
            if along != 0.0 {
                *t = (plane.w - plane.truncate().dot(ray.origin)) / along;
            }
        }
        Gathered { light: Light::default(), number: -1.0, length: 0.0, surface_t: FAR, last: None, cuts, way_out: None }
    }

    /// What comes next does not continue what was passed last.
    pub fn forget_last(&mut self) {
        self.last = None;
    }

    /// Whether too little is seen of what lies behind.
    pub fn is_opaque(&self, scene: &Scene) -> bool {
        self.light.transmittance < scene.min_transmittance
    }

    /// Whether a leaf with these values adds nothing.
    pub fn is_beneath(&self, scene: &Scene, corners: &[f32; 8]) -> bool {
        match scene.mode {
            Mode::Maximum => corners.iter().all(|&value| value <= self.number),
            Mode::Minimum => self.number >= 0.0 && corners.iter().all(|&value| value >= self.number),
            _ => false,
        }
    }

    /// Passes a piece. The march's place in the tree is lost where something is probed.
    pub fn pass(&mut self, scene: &Scene, ray: &Ray, descent: &mut Descent, piece: Piece) {
        let [front, back] = piece.ends;
        match scene.mode {
            Mode::Maximum => self.number = self.number.max(front).max(back),
            Mode::Minimum => {
                let least = front.min(back);
                self.number = if self.number < 0.0 { least } else { self.number.min(least) };
            }
            Mode::Mean | Mode::Integral => {
                self.number = self.number.max(0.0) + 0.5 * (front + back) * piece.length;
                self.length += piece.length;
            }
            Mode::Composite | Mode::Iso if scene.with_surfaces => self.pass_cuts(scene, ray, descent, piece),
            Mode::Composite => self.add_part(scene, ray, piece),
            Mode::Iso => {}
        }
    }

    /// Passes what lies between two places.
    pub fn pass_between(&mut self, scene: &Scene, ray: &Ray, descent: &mut Descent, span: [f32; 2], ends: [f32; 2]) {
        let mut gradient = Vec3::ZERO;
        if scene.is_volume_shaded {
            gradient = probe(scene, ray, descent, 0.5 * (span[0] + span[1])).map_or(Vec3::ZERO, |found| found.gradient);
        }
        self.pass(scene, ray, descent, Piece { span, ends, length: (span[1] - span[0]) * ray.length, gradient })
    }

    /// Passes a piece, cut at each plane in it that is drawn, in the order of the ray.
    fn pass_cuts(&mut self, scene: &Scene, ray: &Ray, descent: &mut Descent, piece: Piece) {
        let mut rest = piece;
        loop {
            let [begin, end] = rest.span;
            let ahead = |t: f32| begin <= t && t < end;
            let Some(i) = (0..Planes::MOST).filter(|&i| ahead(self.cuts[i])).min_by(|&a, &b| self.cuts[a].total_cmp(&self.cuts[b])) else {
                return self.pass_surfaces(scene, ray, descent, rest);
            };
            let t = std::mem::replace(&mut self.cuts[i], FAR);
            let [front, back] = rest.ends;
            let value = front + (back - front) * ((t - begin) / (end - begin));
            self.pass_surfaces(scene, ray, descent, rest.part([begin, t], [front, value]));
            self.add_cut(scene, ray, i, t, value);
            if self.is_opaque(scene) {
                return;
            }
            rest = rest.part([t, end], [value, back]);
        }
    }

    /// Adds a plane that is drawn, in the colour of the value on it.
    fn add_cut(&mut self, scene: &Scene, ray: &Ray, i: usize, t: f32, value: f32) {
        let color = scene.table.classify(scene.table.interval(value), value).color;
        let [opacity, has_edges] = scene.rays.cut_looks[i];
        let mut ink = self.light.transmittance * opacity;
        if let (Some(edges), true) = (scene.edges, has_edges > 0.0) {
            let pixel = scene.rays.pixel_width(t - ray.t_eye);
            let distance = edges.cuts()[i].distance(ray.origin + ray.direction * t, EDGE_REACH * pixel);
            ink *= 1.0 - EDGE_INK * distance.map_or(0.0, |distance| (1.0 - (distance / pixel - 0.5)).clamp(0.0, 1.0));
        }
        for c in 0..3 {
            self.light.color[c] += ink * color[c];
        }
        self.light.transmittance *= 1.0 - opacity;
    }

    /// Passes a piece, cut at each surface in it, in the order of the ray.
    fn pass_surfaces(&mut self, scene: &Scene, ray: &Ray, descent: &mut Descent, piece: Piece) {
        let surfaces = scene.style.surfaces();
        let ([front, back], [begin, end]) = (piece.ends, piece.span);
        // Where the value jumps: at faces between leaves of one value each, and by rounding.
        if let Some(last) = self.last {
            for k in 0..surfaces.len() {
                let i = if front > last { k } else { surfaces.len() - 1 - k };
                if is_between(last, front, surfaces[i].value) {
                    let gradient = probe(scene, ray, descent, begin).map_or(Vec3::ZERO, |found| found.gradient);
                    self.add_surface(scene, ray, i, begin, gradient);
                }
            }
        }
        self.last = Some(back);
        let (mut t, mut value) = (begin, front);
        for k in 0..surfaces.len() {
            let i = if back > front { k } else { surfaces.len() - 1 - k };
            if is_between(front, back, surfaces[i].value) {
                let found = meet(scene, ray, descent, piece, surfaces[i].value);
                let t_hit = found.t.clamp(t, end);
                self.add_part(scene, ray, piece.part([t, t_hit], [value, surfaces[i].value]));
                self.add_surface(scene, ray, i, t_hit, found.gradient);
                if self.is_opaque(scene) {
                    return;
                }
                (t, value) = (t_hit, surfaces[i].value);
            }
        }
        self.add_part(scene, ray, if t > begin { piece.part([t, end], [value, back]) } else { Piece { ends: [value, back], ..piece } });
    }

    /// Adds the light of a piece.
    fn add_part(&mut self, scene: &Scene, ray: &Ray, piece: Piece) {
        if scene.mode != Mode::Composite || piece.length <= 0.0 {
            return;
        }
        let before = self.light;
        self.light.add_linear(scene.table, piece.ends[0], piece.ends[1], piece.length);
        if scene.is_volume_shaded {
            self.light = Lit::of_gradient(&scene.style, piece.gradient, ray.to_eye()).relit(before, self.light);
        }
    }

    /// Adds a surface at `t`, where the field has this gradient.
    fn add_surface(&mut self, scene: &Scene, ray: &Ray, i: usize, t: f32, gradient: Vec3) {
        let surface = &scene.style.surfaces()[i];
        let mut lit = Lit::PLAIN;
        if scene.are_surfaces_shaded && gradient.dot(gradient) > 0.0 {
            lit = Lit::facing(&scene.style, gradient.normalize(), ray.to_eye());
        }
        let weight = self.light.transmittance * surface.opacity;
        for c in 0..3 {
            self.light.color[c] += weight * (surface.color[c] * lit.own + lit.white);
        }
        self.light.transmittance *= 1.0 - surface.opacity;
        self.surface_t = self.surface_t.min(t);
    }

    /// The pixel.
    pub fn pixel(&self, scene: &Scene, ray: &Ray) -> [f32; 4] {
        let is_sum = matches!(scene.mode, Mode::Mean | Mode::Integral);
        let number = if is_sum && self.length > 0.0 { self.number / self.length } else { self.number };
        if scene.output == Output::Numbers {
            let is_hit = self.surface_t < FAR;
            let distance = if is_hit { (self.surface_t - ray.t_eye) * ray.length } else { 0.0 };
            return [number, self.length, distance, if is_hit { 1.0 } else { 0.0 }];
        }
        if !scene.mode.is_number() {
            return self.light.rgba();
        }
        if number < 0.0 || (is_sum && self.length <= 0.0) {
            return [0.0; 4];
        }
        let value = scene.style.colored(number, self.length);
        let [r, g, b] = scene.table.classify(scene.table.interval(value), value).color;
        [r, g, b, 1.0]
    }
}

impl Piece {
    /// A part of it.
    fn part(self, span: [f32; 2], ends: [f32; 2]) -> Piece {
        let whole = self.span[1] - self.span[0];
        let share = if whole > 0.0 { (span[1] - span[0]) / whole } else { 0.0 };
        Piece { span, ends, length: self.length * share, ..self }
    }
}
