//! What a ray makes of the segments on its way, in f64: light, surfaces of equal value, or a number.

use super::integral::Light;
use super::transfer::{Sample, Transfer};
use super::{Crossing, ExactScene, Met, Segment};
use crate::mesh::Association;
use crate::view::{Faces, Isosurface, LightSource, Mode, Phong, Plane, PlaneUse, RayFrame, RenderSettings, Shading, TransferFunction};
use glam::DVec3;

/// What of a ray is no colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayNumber {
    /// Largest, smallest or mean value in data units, or the integral in data units times world units; NaN where there is none.
    pub value: f64,
    /// Distance along the ray to the first isosurface, world units; NaN where there is none.
    pub depth: f64,
}

/// Parts of the mesh this near to each other along a ray touch: of the mesh's diagonal.
const SEAM: f64 = 1e-9;

/// How dark an edge is.
const EDGE_INK: f64 = 0.8;

/// What all rays of an image share.
pub(super) struct Look<'a> {
    scene: &'a ExactScene,
    transfer: Transfer,
    mode: Mode,
    /// Ascending by value, with their colours.
    surfaces: Vec<(Isosurface, [f64; 3])>,
    shading: Shading,
    /// The gradient at which the volume is shaded by half: data units per world unit.
    gradient_floor: f64,
    min_transmittance: f64,
    /// What clips, and what is drawn; relative to the mesh's centre, normals of length 1.
    clips: Vec<Plane>,
    cuts: Vec<Cut>,
    /// How boundary faces are drawn, if they are.
    faces: Option<Faces>,
    /// The rays that are followed.
    frame: RayFrame,
}

/// A plane that is drawn.
struct Cut {
    plane: Plane,
    opacity: f64,
    has_edges: bool,
}

/// What a ray has made of its way so far.
pub(super) struct Gathered<'a> {
    look: &'a Look<'a>,
    /// Towards the eye.
    to_eye: DVec3,
    pub light: Light,
    value: f64,
    length: f64,
    depth: f64,
    /// The segment before.
    last: Option<Segment>,
    /// What of the ray is not clipped.
    within: [f64; 2],
    /// Where it meets each plane that is drawn, if it does and has not passed it yet.
    cuts: Vec<Option<f64>>,
    /// Where it has left the mesh, unless it goes on there.
    way_out: Option<Crossing>,
    origin: DVec3,
}

/// A part of a segment: where it begins and ends, and the values there.
#[derive(Clone, Copy)]
struct Part {
    t: [f64; 2],
    s: [f64; 2],
}

impl<'a> Look<'a> {
    pub fn new(scene: &'a ExactScene, tf: &TransferFunction, settings: &RenderSettings, frame: &RayFrame) -> Self {
        let transfer = if settings.mode == Mode::Integral {
            let range = tf.range.unwrap_or_else(|| Mode::integral_range(scene.range, scene.diagonal));
            Transfer::new(&TransferFunction { range: Some(range), ..tf.clone() }, range, scene.diagonal)
        } else {
            Transfer::new(tf, scene.range, scene.diagonal)
        };
        let colored = |surface: Isosurface| {
            let own = surface.color.map(|color| color.map(f64::from));
            (surface, own.unwrap_or_else(|| transfer.sample(transfer.normalize(surface.value)).color))
        };
        let surfaces = settings.surfaces().ascending().map(colored).collect();
        let width = scene.range[1] - scene.range[0];
        let gradient_floor = if scene.diagonal > 0.0 { Shading::GRADIENT_FLOOR * width / scene.diagonal } else { 1.0 };
        let (mode, shading, min_transmittance) = (settings.mode, settings.shading, settings.min_transmittance);
        let (mut clips, mut cuts) = (Vec::new(), Vec::new());
        for plane in frame.planes.iter() {
            let plane = Plane { normal: plane.normal.normalize(), ..plane };
            match plane.used {
                PlaneUse::Clip => clips.push(plane),
                PlaneUse::Cut { opacity, edges } => cuts.push(Cut { plane, opacity: f64::from(opacity), has_edges: edges }),
            }
        }
        let faces = settings.drawn_faces();
        Look { scene, transfer, mode, surfaces, shading, gradient_floor, min_transmittance, clips, cuts, faces, frame: *frame }
    }
}

impl<'a> Gathered<'a> {
    /// A ray along `direction`, of length 1, before it meets anything.
    pub fn new(look: &'a Look<'a>, origin: DVec3, direction: DVec3) -> Self {
        // Where it meets a plane, and how fast it nears the side that the normal points to.
        let meets = |plane: &Plane| ((plane.point - origin).dot(plane.normal), direction.dot(plane.normal));
        let mut within = [0.0, f64::INFINITY];
        for plane in &look.clips {
            match meets(plane) {
                (before, along) if along > 0.0 => within[0] = f64::max(within[0], before / along),
                (before, along) if along < 0.0 => within[1] = f64::min(within[1], before / along),
                (before, _) if before > 0.0 => within[1] = f64::NEG_INFINITY,
                _ => {}
            }
        }
        let cut = |cut: &Cut| match meets(&cut.plane) {
            (before, along) if along != 0.0 => Some(before / along),
            _ => None,
        };
        let cuts = look.cuts.iter().map(cut).collect();
        let (light, value, depth) = (Light::NONE, f64::NAN, f64::NAN);
        Gathered { look, to_eye: -direction, light, value, length: 0.0, depth, last: None, within, cuts, way_out: None, origin }
    }

    /// Passes what the ray meets; whether there may be more to see behind.
    pub fn meet(&mut self, met: Met) -> bool {
        match met {
            Met::Passes(segment) => return self.pass(segment),
            Met::Leaves(crossing) => self.way_out = Some(crossing),
            Met::Enters(crossing) => {
                // At seams the mesh goes on.
                let seam = SEAM * self.look.scene.diagonal;
                if self.way_out.take_if(|out| crossing.t <= out.t + seam).is_none() {
                    self.end();
                    self.add_face(&crossing);
                }
            }
        }
        self.light.transmittance >= self.look.min_transmittance
    }

    /// Ends the ray, or its way up to where it enters the mesh again.
    pub fn end(&mut self) {
        if let Some(crossing) = self.way_out.take() {
            self.add_face(&crossing);
        }
    }

    /// Adds a boundary face.
    fn add_face(&mut self, crossing: &Crossing) {
        let Look { transfer, scene, shading, faces: Some(faces), .. } = self.look else { return };
        let [begin, end] = self.within;
        if !(begin.max(0.0) < crossing.t && crossing.t <= end) {
            return;
        }
        let [a, b, c] = crossing.corners.map(|corner| scene.vertices[corner as usize].position * scene.unit);
        let color = faces.color.map_or_else(|| transfer.sample(transfer.normalize(crossing.value)).color, |own| own.map(f64::from));
        let (own, white) = if shading.surfaces { self.reflected(&shading.phong, (b - a).cross(c - a)) } else { (1.0, 0.0) };
        let mut ink = f64::from(faces.opacity) * self.light.transmittance;
        if faces.edges {
            let distance = [(a, b), (b, c), (c, a)].map(|(p, q)| self.distance_to_line(p, q)).into_iter().fold(f64::INFINITY, f64::min);
            ink *= 1.0 - EDGE_INK * self.covered(distance, crossing.t);
        }
        for (light, own_color) in self.light.color.iter_mut().zip(color) {
            *light += ink * (own_color * own + white);
        }
        self.light.transmittance *= 1.0 - f64::from(faces.opacity);
    }

    /// How far the ray passes by a line.
    fn distance_to_line(&self, a: DVec3, b: DVec3) -> f64 {
        let across = self.to_eye.cross(b - a);
        if across == DVec3::ZERO { f64::INFINITY } else { (a - self.origin).dot(across).abs() / across.length() }
    }

    /// How much of the pixel a line covers that lies so far beside the ray at a distance from the eye.
    fn covered(&self, distance: f64, t: f64) -> f64 {
        let frame = &self.look.frame;
        // Perspective pixels widen with the distance along the view direction, parallel ones do not.
        let ahead = t * -self.to_eye.dot(frame.forward.normalize());
        let pixel = (frame.right_origin + frame.right * ahead).length() * 2.0 / f64::from(frame.width);
        (1.0 - (distance / pixel - 0.5)).clamp(0.0, 1.0)
    }

    /// Passes a segment, as much of it as is not clipped; whether there may be more to see behind.
    pub fn pass(&mut self, segment: Segment) -> bool {
        let [begin, end] = [segment.t_in.max(self.within[0]), segment.t_out.min(self.within[1])];
        if begin >= end {
            return segment.t_in < self.within[1];
        }
        let segment = segment.part(begin, end);
        let Segment { t_in, t_out, s_in, s_out, .. } = segment;
        match self.look.mode {
            Mode::Maximum => self.value = self.value.max(s_in).max(s_out),
            Mode::Minimum => self.value = self.value.min(s_in).min(s_out),
            Mode::Mean | Mode::Integral => {
                self.length += t_out - t_in;
                self.value = if self.value.is_nan() { 0.0 } else { self.value } + 0.5 * (s_in + s_out) * (t_out - t_in);
            }
            Mode::Composite | Mode::Iso => self.pass_cuts(segment),
        }
        self.light.transmittance >= self.look.min_transmittance
    }

    /// Passes a segment, cut at the planes in it that are drawn.
    fn pass_cuts(&mut self, segment: Segment) {
        let mut rest = segment;
        loop {
            let ahead = |t: Option<f64>| t.filter(|t| rest.t_in <= *t && *t < rest.t_out);
            let next = (0..self.cuts.len()).filter_map(|i| Some((i, ahead(self.cuts[i])?))).min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((i, t)) = next else { return self.pass_surfaces(rest) };
            self.cuts[i] = None;
            let before = rest.part(rest.t_in, t);
            self.pass_surfaces(before);
            self.add_cut(i, t, &before);
            if self.light.transmittance < self.look.min_transmittance {
                return;
            }
            rest = rest.part(t, rest.t_out);
        }
    }

    /// Adds a plane that is drawn, at the end of a segment.
    fn add_cut(&mut self, i: usize, t: f64, before: &Segment) {
        let Look { transfer, cuts, scene, .. } = self.look;
        let mut color = transfer.sample(transfer.normalize(before.s_out)).color;
        if cuts[i].has_edges {
            let direction = -self.to_eye;
            let distance = scene.distance_to_edge(before.tet, self.origin + direction * t, cuts[i].plane.normal);
            let covered = self.covered(distance, t);
            color = color.map(|c| c * (1.0 - EDGE_INK * covered));
        }
        for (light, own) in self.light.color.iter_mut().zip(color) {
            *light += self.light.transmittance * cuts[i].opacity * own;
        }
        self.light.transmittance *= 1.0 - cuts[i].opacity;
    }

    /// Passes a segment, cut at the surfaces in it.
    fn pass_surfaces(&mut self, segment: Segment) {
        let surfaces = &self.look.surfaces;
        let in_order = |rises: bool, k: usize| if rises { k } else { surfaces.len() - 1 - k };
        let passes = |from: f64, to: f64, i: usize| (from < surfaces[i].0.value) != (to < surfaces[i].0.value);
        // Values jump at faces where they live on cells.
        let touches = |last: &Segment| segment.t_in - last.t_out <= SEAM * self.look.scene.diagonal;
        if let Some(last) = self.last.filter(touches) {
            for k in 0..surfaces.len() {
                let i = in_order(segment.s_in > last.s_out, k);
                if passes(last.s_out, segment.s_in, i) {
                    self.add_surface(i, segment.t_in, self.look.scene.common_face(last.tet, segment.tet));
                }
            }
        }
        self.last = Some(segment);
        let Segment { t_in, t_out, s_in, s_out, tet } = segment;
        let (mut t, mut s) = (t_in, s_in);
        for k in 0..surfaces.len() {
            let i = in_order(s_out > s_in, k);
            if passes(s_in, s_out, i) {
                let value = surfaces[i].0.value;
                let hit = (t_in + (t_out - t_in) * ((value - s_in) / (s_out - s_in))).clamp(t, t_out);
                self.add_part(tet, Part { t: [t, hit], s: [s, value] });
                self.add_surface(i, hit, self.look.scene.gradient(tet));
                if self.light.transmittance < self.look.min_transmittance {
                    return;
                }
                (t, s) = (hit, value);
            }
        }
        self.add_part(tet, Part { t: [t, t_out], s: [s, s_out] });
    }

    /// Adds the light of a part of a segment in a tet, in which the gradient is the same everywhere.
    fn add_part(&mut self, tet: u32, part: Part) {
        let Look { transfer, mode, shading, .. } = self.look;
        if *mode != Mode::Composite || part.t[1] <= part.t[0] {
            return;
        }
        let [front, back] = part.s.map(|s| transfer.normalize(s));
        let before = self.light;
        transfer.cut(front, back, part.t[1] - part.t[0], |front, back, length| self.light.add(front, back, length));
        if shading.volume {
            let gradient = self.look.scene.gradient(tet);
            let squared = gradient.length_squared();
            let (own, white) = self.reflected(&shading.phong, gradient);
            let share = squared / (squared + self.look.gradient_floor.powi(2));
            let share = if squared > 0.0 { share } else { 0.0 };
            let opacity = before.transmittance - self.light.transmittance;
            for c in 0..3 {
                let added = self.light.color[c] - before.color[c];
                self.light.color[c] = before.color[c] + added * (1.0 + share * (own - 1.0)) + opacity * share * white;
            }
        }
    }

    /// Adds a surface that faces along `normal`, of any length.
    fn add_surface(&mut self, i: usize, t: f64, normal: DVec3) {
        let (surface, color) = &self.look.surfaces[i];
        let Shading { surfaces: is_shaded, phong, .. } = &self.look.shading;
        let (own, white) = if *is_shaded { self.reflected(phong, normal) } else { (1.0, 0.0) };
        let opacity = f64::from(surface.opacity);
        for c in 0..3 {
            self.light.color[c] += self.light.transmittance * opacity * (color[c] * own + white);
        }
        self.light.transmittance *= 1.0 - opacity;
        self.depth = self.depth.min(t);
    }

    /// How much of its own colour a place that faces along or against `normal` sends to the eye, and how much white (method 4).
    fn reflected(&self, phong: &Phong, normal: DVec3) -> (f64, f64) {
        let Some(normal) = normal.try_normalize() else { return (1.0, 0.0) };
        let to_light = match phong.light {
            LightSource::Camera => self.to_eye,
            LightSource::From(direction) => direction.normalize_or_zero(),
        };
        let (cos, cos_eye) = (normal.dot(to_light), normal.dot(self.to_eye));
        let mirrored = 2.0 * cos * normal - to_light;
        let highlight = mirrored.dot(self.to_eye).clamp(0.0, 1.0);
        let is_same_side = cos * cos_eye > 0.0;
        let white = if is_same_side { f64::from(phong.specular) * highlight.powf(f64::from(phong.shininess)) } else { 0.0 };
        (f64::from(phong.ambient) + f64::from(phong.diffuse) * cos.abs(), white)
    }

    /// The number of the ray.
    pub fn number(&self) -> RayNumber {
        let value = if self.look.mode == Mode::Mean { self.value / self.length } else { self.value };
        RayNumber { value, depth: self.depth }
    }

    /// The pixel: linear premultiplied RGBA.
    pub fn pixel(&self) -> [f32; 4] {
        if !self.look.mode.is_number() {
            let Light { color: [r, g, b], transmittance } = self.light;
            return [r, g, b, 1.0 - transmittance].map(|v| v as f32);
        }
        let value = self.number().value;
        if value.is_nan() {
            return [0.0; 4];
        }
        let x = self.look.transfer.normalize(value);
        // Values have the colours beyond the range too; of an integral these are the ends'.
        let x = if self.look.mode == Mode::Integral { x.clamp(0.0, 1.0) } else { x };
        let Sample { color: [r, g, b], .. } = self.look.transfer.sample(x);
        [r, g, b, 1.0].map(|v| v as f32)
    }
}

impl ExactScene {
    /// The gradient in a tet, data units per world unit; 0 where values live on cells or the tet has no volume.
    fn gradient(&self, tet: u32) -> DVec3 {
        if self.association() == Association::Cells {
            return DVec3::ZERO;
        }
        let [a, b, c, d] = self.tets[tet as usize].corners.map(|corner| &self.vertices[corner as usize]);
        let [e, f, g] = [b, c, d].map(|v| v.position - a.position);
        let [u, v, w] = [b, c, d].map(|v| v.value - a.value);
        let volume = e.dot(f.cross(g));
        if volume == 0.0 {
            return DVec3::ZERO;
        }
        (u * f.cross(g) + v * g.cross(e) + w * e.cross(f)) / (volume * self.unit)
    }

    /// How far a place in a tet is from the nearest of its faces, along a plane with this normal: where they cut it are edges.
    fn distance_to_edge(&self, tet: u32, at: DVec3, normal: DVec3) -> f64 {
        let corners = self.tets[tet as usize].corners.map(|corner| self.vertices[corner as usize].position * self.unit);
        let of_face = |i: usize| {
            let [a, b, c] = [1, 2, 3].map(|k| corners[(i + k) % 4]);
            let face = (b - a).cross(c - a);
            let steepness = face.reject_from_normalized(normal).length();
            if steepness > 0.0 { face.dot(at - a).abs() / steepness } else { f64::INFINITY }
        };
        (0..4).map(of_face).fold(f64::INFINITY, f64::min)
    }

    /// A normal of the face that two tets share; 0 if they do not.
    fn common_face(&self, first: u32, second: u32) -> DVec3 {
        let [first, second] = [first, second].map(|tet| self.tets[tet as usize].corners);
        let common: Vec<DVec3> =
            first.iter().filter(|corner| second.contains(corner)).map(|&corner| self.vertices[corner as usize].position).collect();
        let &[a, b, c] = &common[..] else { return DVec3::ZERO };
        (b - a).cross(c - a)
    }

    fn association(&self) -> Association {
        if self.cell_values.is_some() { Association::Cells } else { Association::Points }
    }
}
