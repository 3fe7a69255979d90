//! What is seen at a pixel, in every mode. No shader has a twin of this.

use super::faces::SEAM;
use super::ray::{FAR, Ray};
use super::surface::intervals_on;
use crate::mesh::BoundarySurface;
use crate::octree::OctreeTexture;
use crate::optics::{Classifier, KnotTable, Style};
use crate::view::{CubeRays, Isosurface, Mode, PlaneUse, RayFrame, RenderSettings};
use glam::DVec3;

/// A ray is looked at in at most so many pieces.
const MAX_PIECES: f32 = 4096.0;

/// Behind this nothing is seen.
const LEAST_TRANSMITTANCE: f64 = 1e-4;

/// The ends of a piece are looked at so far inside it, in parts of its length: on a face of the data there may be nothing.
const INSIDE: f32 = 1e-3;

/// Where a surface lies between two places is found by so many halvings.
const HALVINGS: u32 = 24;

/// What a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picked {
    /// Where, relative to the centre that the frame is relative to.
    pub at: DVec3,
    /// The share of the pixel that what is there makes up, above 0 and at most 1; 1 for a number.
    pub opacity: f64,
    /// What it is.
    pub what: PickedWhat,
}

/// What is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PickedWhat {
    /// Light of the volume.
    Light,
    /// A surface of this value, data units.
    Isosurface(f64),
    /// A plane that is drawn, by its number from 0 among all planes of the frame.
    Cut(usize),
    /// A boundary face.
    Face,
    /// The largest value on the ray.
    Largest,
    /// The smallest value on the ray.
    Smallest,
    /// The middle of the ray's way through the data: its mean and its integral are of all of it.
    Middle,
}

/// What the ray of pixel (column, row) sees, as `settings` draw it; `None` where it sees nothing.
///
/// With [`Mode::Composite`] it is what makes up most of the pixel: a surface, a plane or a boundary face that is drawn, or the volume around a place, which is then
/// the middle, by opacity, of the piece of the ray with the largest opacity times the transmittance before it. Pieces are half as long as the
/// finest leaves' edge; of what counts alike it is the first. With [`Mode::Iso`] it is the surface, plane or face that is met first of those that
/// are not transparent, for a maximum or minimum where that value is first met, for a mean or integral the middle of the ray's way through the data.
///
/// The ray is followed inside `surface`, where there is one, and where the frame's planes do not clip it, through the texture's
/// reconstructed field, classified piece by piece.
pub fn pick(
    texture: &OctreeTexture,
    surface: Option<&BoundarySurface>,
    frame: &RayFrame,
    [column, row]: [u32; 2],
    classifier: &Classifier,
    settings: &RenderSettings,
) -> Option<Picked> {
    let rays = CubeRays::new(frame, texture.root_min(), texture.root_edge());
    let ray = Ray::enter(rays.ray(column, row), &rays.clips);
    if ray.t_out <= 0.0 {
        return None;
    }
    let mut spans = surface.map_or_else(|| vec![(0.0, ray.t_out)], |surface| intervals_on(surface, &ray));
    spans.iter_mut().for_each(|span| span.1 = span.1.min(ray.t_out));
    spans.retain(|span| span.0 < span.1);
    // At seams the mesh goes on.
    spans.dedup_by(|next, span| {
        let touches = next.0 <= span.1 + SEAM;
        if touches {
            span.1 = span.1.max(next.1);
        }
        touches
    });
    let whole = spans.iter().map(|span| span.1 - span.0).sum::<f32>() * ray.length;
    let step = (0.5 * (-f32::from(texture.depth())).exp2()).max(whole / MAX_PIECES);
    let way = Way { texture, ray: &ray, spans, step, ends_at_faces: surface.is_some() };
    match settings.mode {
        Mode::Composite | Mode::Iso => Looked::new(&way, frame, &rays, classifier, settings).along(),
        Mode::Maximum => way.extreme(|value, best| value > best).map(|t| way.picked(t, PickedWhat::Largest, 1.0)),
        Mode::Minimum => way.extreme(|value, best| value < best).map(|t| way.picked(t, PickedWhat::Smallest, 1.0)),
        Mode::Mean | Mode::Integral => way.middle().map(|t| way.picked(t, PickedWhat::Middle, 1.0)),
    }
}

/// A ray's way through the data.
struct Way<'a> {
    texture: &'a OctreeTexture,
    ray: &'a Ray,
    /// Where it is inside, in t.
    spans: Vec<(f32, f32)>,
    /// The longest piece, in cube edges.
    step: f32,
    /// Whether it enters and leaves by boundary faces.
    ends_at_faces: bool,
}

/// A piece of it, in t.
#[derive(Clone, Copy)]
struct Piece {
    begin: f32,
    end: f32,
    /// Whether it does not go on from the piece before.
    is_first: bool,
    /// Whether no piece goes on from it.
    is_last: bool,
}

impl Piece {
    /// Places in it: just inside its beginning, in the middle, just inside its end.
    fn places(&self) -> [f32; 3] {
        [INSIDE, 0.5, 1.0 - INSIDE].map(|part| self.begin + (self.end - self.begin) * part)
    }
}

impl Way<'_> {
    fn pieces(&self) -> impl Iterator<Item = Piece> {
        self.spans.iter().flat_map(|&(begin, end)| {
            let pieces = ((end - begin) * self.ray.length / self.step).ceil().max(1.0);
            let at = move |k: u32| begin + (end - begin) * (k as f32 / pieces);
            (0..pieces as u32).map(move |k| Piece { begin: at(k), end: at(k + 1), is_first: k == 0, is_last: k + 1 == pieces as u32 })
        })
    }

    /// The normalised value at t; `None` where there is none.
    fn value(&self, t: f32) -> Option<f32> {
        self.texture.value_at((self.ray.origin + self.ray.direction * t).as_dvec3())
    }

    fn picked(&self, t: f32, what: PickedWhat, opacity: f64) -> Picked {
        let unit = (self.ray.origin + self.ray.direction * t).as_dvec3();
        Picked { at: self.texture.root_min() + unit * self.texture.root_edge(), opacity, what }
    }

    /// Where the value is first met that is better than all others.
    fn extreme(&self, is_better: impl Fn(f32, f32) -> bool) -> Option<f32> {
        let places = self.pieces().flat_map(|piece| piece.places()).filter_map(|t| Some((t, self.value(t)?)));
        places.reduce(|best, at| if is_better(at.1, best.1) { at } else { best }).map(|(t, _)| t)
    }

    /// Half of the way through what has values.
    fn middle(&self) -> Option<f32> {
        let full: Vec<Piece> = self.pieces().filter(|piece| self.value(piece.places()[1]).is_some()).collect();
        let mut rest = full.iter().map(|piece| piece.end - piece.begin).sum::<f32>() / 2.0;
        for piece in full {
            let length = piece.end - piece.begin;
            if rest <= length {
                return Some(piece.begin + rest);
            }
            rest -= length;
        }
        None
    }

    /// Where, between two places with values on either side of it, the field passes a value.
    fn meet(&self, [mut low, mut high]: [f32; 2], front: f32, value: f32) -> f32 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let Some(here) = self.value(middle) else { break };
            if (here < value) == (front < value) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// Something thin that a ray meets.
#[derive(Clone, Copy)]
struct Met {
    t: f32,
    what: PickedWhat,
    opacity: f64,
}

/// What a ray looks for where it sees light and surfaces.
struct Looked<'a> {
    way: &'a Way<'a>,
    table: KnotTable,
    is_lit: bool,
    /// Surfaces with their normalised values.
    surfaces: Vec<(Isosurface, f32)>,
    cuts: Vec<Met>,
    /// The opacity of boundary faces, where there are any.
    faces: f64,
    transmittance: f64,
    best: Option<Picked>,
}

impl<'a> Looked<'a> {
    fn new(way: &'a Way<'a>, frame: &RayFrame, rays: &CubeRays, classifier: &Classifier, settings: &RenderSettings) -> Self {
        let edge = way.texture.root_edge();
        let table = classifier.table(edge);
        let style = Style::new(settings, classifier, &table, edge);
        let surfaces = settings.surfaces().ascending().zip(style.surfaces()).map(|(surface, styled)| (surface, styled.value)).collect();
        let numbers = frame.planes.iter().enumerate().filter(|(_, plane)| plane.used != PlaneUse::Clip).map(|(i, _)| i);
        let cuts = rays.cuts.used().iter().zip(rays.cut_looks).zip(numbers).map(|((plane, [opacity, _]), number)| {
            let (along, before) = (plane.truncate().dot(way.ray.direction), plane.w - plane.truncate().dot(way.ray.origin));
            let t = if along == 0.0 { FAR } else { before / along };
            Met { t, what: PickedWhat::Cut(number), opacity: opacity.into() }
        });
        let cuts = cuts.collect();
        let faces = settings.drawn_faces().filter(|_| way.ends_at_faces).map_or(0.0, |faces| faces.opacity.into());
        Looked { way, table, is_lit: settings.mode == Mode::Composite, surfaces, cuts, faces, transmittance: 1.0, best: None }
    }

    /// What counts most.
    fn along(mut self) -> Option<Picked> {
        let way = self.way;
        let mut last: Option<(f32, f32)> = None;
        for piece in way.pieces() {
            if piece.is_first {
                last = None;
                // Where a ray begins inside the data, or a plane clips, there is no face.
                if piece.begin > 0.0 {
                    self.pass(piece.begin, PickedWhat::Face, self.faces);
                }
            }
            let mut begin = piece.begin;
            for met in self.met_in(&piece, &mut last) {
                self.pass_light(begin, met.t);
                self.pass(met.t, met.what, met.opacity);
                begin = met.t;
            }
            self.pass_light(begin, piece.end);
            if piece.is_last && piece.end < way.ray.t_out {
                self.pass(piece.end, PickedWhat::Face, self.faces);
            }
            let share = self.best.map_or(0.0, |best| best.opacity);
            // Behind the first surface there may be nothing that counts for as much.
            if self.transmittance < share.max(LEAST_TRANSMITTANCE) || (!self.is_lit && self.best.is_some()) {
                break;
            }
        }
        self.best
    }

    /// Surfaces and planes in a piece, in the order of the ray; `last` is the place before and its value.
    fn met_in(&self, piece: &Piece, last: &mut Option<(f32, f32)>) -> Vec<Met> {
        if self.surfaces.is_empty() && self.cuts.is_empty() {
            return Vec::new();
        }
        let is_in = |t: f32| (piece.begin..piece.end).contains(&t);
        let mut all: Vec<Met> = self.cuts.iter().filter(|met| is_in(met.t) && self.way.value(met.t).is_some()).copied().collect();
        for t in piece.places() {
            let here = self.way.value(t).map(|value| (t, value));
            if let (Some((t0, front)), Some((t1, back))) = (*last, here) {
                let passed = self.surfaces.iter().filter(|(_, value)| (front < *value) != (back < *value));
                all.extend(passed.map(|&(surface, value)| {
                    let t = self.way.meet([t0, t1], front, value).clamp(piece.begin, piece.end);
                    Met { t, what: PickedWhat::Isosurface(surface.value), opacity: surface.opacity.into() }
                }));
            }
            *last = here;
        }
        all.sort_by(|a, b| a.t.total_cmp(&b.t));
        all
    }

    /// Passes something of this opacity; what counts for more than all before it is remembered.
    fn pass(&mut self, t: f32, what: PickedWhat, opacity: f64) {
        let share = self.transmittance * opacity;
        let is_first = self.is_lit || self.best.is_none();
        if is_first && share > self.best.map_or(0.0, |best| best.opacity) {
            self.best = Some(self.way.picked(t, what, share));
        }
        self.transmittance *= 1.0 - opacity;
    }

    /// Passes the light of a part of a piece.
    fn pass_light(&mut self, begin: f32, end: f32) {
        let Some(value) = self.way.value(0.5 * (begin + end)).filter(|_| self.is_lit && end > begin) else { return };
        let extinction = self.table.classify(self.table.interval(value), value).extinction;
        let depth = f64::from(extinction * ((end - begin) * self.way.ray.length));
        let alpha = -(-depth).exp_m1();
        // Where half of the part's opacity lies before it.
        let part = if depth > 1e-6 { -(-0.5 * alpha).ln_1p() / depth } else { 0.5 };
        self.pass(begin + (end - begin) * part as f32, PickedWhat::Light, alpha);
    }
}
