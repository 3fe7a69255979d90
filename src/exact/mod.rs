//! The exact renderer: the mesh itself, ray by ray, in f64. The ground truth; it shares no code with what it judges.
//!
//! In a tet the scalar is linear along a ray. Cut at the transfer function's knots, a ray is a row of segments on which extinction and
//! colour are linear, and for those emission and absorption are integrated to f64's precision: no step length, no sampling.
//!
//! ```text
//! boundary   which faces a ray enters the mesh by (bounding volume hierarchy)
//! walk       from there from tet to tet, by exact signs, over what adjacency linked
//! transfer   cut at the knots of the transfer function
//! integral   light of each piece
//! pass       surfaces of equal value, shading, and numbers in place of light
//! ```
//!
//! **Any mesh** draws right. Concave boundaries, holes and separate parts are several entries; seams of coincident points are left and
//! entered again at the same place; tets without volume or with a missing value are not there, and what they touched is boundary; so are
//! faces of three or more tets and of tets that overlap. **Where tets overlap** each place counts once: chains of tets are taken in the
//! order in which the ray enters them, and each is clipped to where the ray already is.

mod boundary;
mod integral;
mod pass;
#[cfg(test)]
pub(crate) mod test_meshes;
#[cfg(test)]
mod tests;
mod transfer;
mod walk;

use crate::geometry::Aabb;
use crate::image::Image;
use crate::mesh::adjacency::{self, Tet};
use crate::mesh::{Association, ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use crate::view::{RayFrame, RenderSettings, TransferFunction};
use boundary::Boundary;
use glam::DVec3;
pub use pass::RayNumber;
use pass::{Gathered, Look};
use rayon::prelude::*;
use std::ops::ControlFlow;
use walk::{Entry, Ray, RayPoint, Vertex};

/// A mesh and one of its fields, ready to be traced. Owns what it needs: 32 bytes a tet, 32 a point, and a
/// hierarchy over the boundary faces.
pub struct ExactScene {
    vertices: Vec<Vertex>,
    tets: Vec<Tet>,
    /// One value a tet where the field lives on cells.
    cell_values: Option<Vec<f64>>,
    boundary: Boundary,
    /// The world length of a scene unit, a power of two: positions are at most 1.
    unit: f64,
    /// The diagonal of the mesh's bounds in world units.
    diagonal: f64,
    /// Smallest and largest value of the field.
    range: [f64; 2],
}

/// The part of a ray inside one tet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Distance from the ray's origin to where it enters, in world units.
    pub t_in: f64,
    /// Distance to where it leaves; above `t_in`.
    pub t_out: f64,
    /// The field's value at `t_in`, in data units.
    pub s_in: f64,
    /// The field's value at `t_out`; linear in between.
    pub s_out: f64,
    /// Index of the tet in the mesh.
    pub tet: u32,
}

impl Segment {
    /// The part of it from `t_in` to `t_out`.
    fn part(&self, t_in: f64, t_out: f64) -> Segment {
        let value = |t: f64| self.s_in + (self.s_out - self.s_in) * ((t - self.t_in) / (self.t_out - self.t_in));
        let s_in = if t_in == self.t_in { self.s_in } else { value(t_in) };
        let s_out = if t_out == self.t_out { self.s_out } else { value(t_out) };
        Segment { t_in, t_out, s_in, s_out, tet: self.tet }
    }
}

/// What a ray meets.
enum Met {
    /// A boundary face, through which it enters the mesh.
    Enters(Crossing),
    /// The part of it in a tet.
    Passes(Segment),
    /// A boundary face, through which it leaves, unless it enters again at the same place.
    Leaves(Crossing),
}

/// Where a ray goes through a boundary face.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    /// Distance from the ray's origin in world units; below 0 behind it.
    t: f64,
    /// The value there, in data units.
    value: f64,
    /// The face's corners.
    corners: [u32; 3],
}

/// Memory that one ray hands to the next.
#[derive(Default)]
struct Scratch {
    entries: Vec<Entry>,
    stack: Vec<u32>,
}

impl ExactScene {
    /// Links the mesh's tets and builds a hierarchy over its boundary. Tets that are not [`ScalarField::is_usable`] are left out.
    pub fn new(mesh: &TetMesh, field: &ScalarField, progress: &Progress) -> Result<ExactScene, Cancelled> {
        progress.begin("linking tets", 3);
        progress.check()?;
        let takes_part = |tet: usize| field.is_usable(mesh, tet);
        let used = (0..mesh.tets().len()).into_par_iter().filter(|&tet| takes_part(tet)).map(|tet| Aabb::of_points(mesh.corners(tet)));
        let bounds = used.reduce(|| Aabb::EMPTY, |a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) });
        let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
        let exponent = if extent.is_finite() { extent.log2().ceil().clamp(-1000.0, 1000.0) } else { 0.0 };
        let unit = exponent.exp2();
        let vertex = |(i, &p): (usize, &DVec3)| {
            let value = if field.association == Association::Points { field.values[i] } else { 0.0 };
            Vertex { position: p / unit, value }
        };
        let vertices: Vec<Vertex> = mesh.points().par_iter().enumerate().map(vertex).collect();
        progress.add(1);
        progress.check()?;

        let (tets, faces) = adjacency::link(mesh.tets(), takes_part);
        progress.add(1);
        progress.check()?;

        let boundary = Boundary::new(&faces, &vertices, &tets);
        let cell_values = (field.association == Association::Cells).then(|| field.values.clone());
        progress.add(1);
        progress.check()?;
        Ok(ExactScene { vertices, tets, cell_values, boundary, unit, diagonal: mesh.bounds().diagonal(), range: field.range })
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        let cells = self.cell_values.as_ref().map_or(0, |values| size_of_val(&values[..]));
        size_of_val(&self.vertices[..]) + size_of_val(&self.tets[..]) + cells + self.boundary.bytes()
    }

    /// Draws the image of `frame`, on all threads; the same bits whatever their number. Of the settings, `mode`, `isosurfaces`, `faces`, `shading` and
    /// `min_transmittance` count.
    ///
    /// A ray stops once less than `min_transmittance` of what lies behind is still seen, which changes colour and alpha by at most as
    /// much; 0 takes every ray through to its end.
    pub fn render(
        &self,
        frame: &RayFrame,
        tf: &TransferFunction,
        settings: &RenderSettings,
        progress: &Progress,
    ) -> Result<Image, Cancelled> {
        let mut image = Image::new(frame.width, frame.height);
        self.follow(frame, &Look::new(self, tf, settings, frame), &mut image.pixels, |ray| ray.pixel(), progress)?;
        Ok(image)
    }

    /// What of the rays of `frame` is no colour, row 0 at the top. Rays stop where those of [`ExactScene::render`] do.
    pub fn numbers(
        &self,
        frame: &RayFrame,
        tf: &TransferFunction,
        settings: &RenderSettings,
        progress: &Progress,
    ) -> Result<Vec<RayNumber>, Cancelled> {
        let mut numbers = vec![RayNumber { value: f64::NAN, depth: f64::NAN }; frame.width as usize * frame.height as usize];
        self.follow(frame, &Look::new(self, tf, settings, frame), &mut numbers, |ray| ray.number(), progress)?;
        Ok(numbers)
    }

    /// Follows the ray of every pixel.
    fn follow<T: Send>(
        &self,
        frame: &RayFrame,
        look: &Look,
        pixels: &mut [T],
        finish: impl Fn(&Gathered) -> T + Sync,
        progress: &Progress,
    ) -> Result<(), Cancelled> {
        progress.begin("tracing rays", u64::from(frame.height));
        let rows = pixels.par_chunks_mut(frame.width.max(1) as usize).enumerate();
        rows.try_for_each_init(Scratch::default, |scratch, (row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                progress.check()?;
                let (origin, direction) = frame.ray(column as u32, row as u32);
                let mut gathered = Gathered::new(look, origin, direction);
                let _ = self.visit(origin, direction, scratch, |met| {
                    if gathered.meet(met) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
                });
                gathered.end();
                *pixel = finish(&gathered);
            }
            progress.add(1);
            Ok(())
        })
    }

    /// The segments of the ray from `origin` (relative to the mesh's centre) along the unit vector `direction`, by distance, without
    /// overlap. What lies behind the origin is left out.
    pub fn trace(&self, origin: DVec3, direction: DVec3) -> Vec<Segment> {
        let mut segments = Vec::new();
        let _ = self.visit(origin, direction, &mut Scratch::default(), |met| {
            if let Met::Passes(segment) = met {
                segments.push(segment);
            }
            ControlFlow::Continue(())
        });
        segments
    }

    /// Visits what a ray meets from the origin on, by distance, segments without overlap.
    fn visit(
        &self,
        origin: DVec3,
        direction: DVec3,
        scratch: &mut Scratch,
        mut visit: impl FnMut(Met) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let ray = Ray::new(origin / self.unit, direction);
        self.boundary.entries(&ray, &self.vertices, &self.tets, &mut scratch.stack, &mut scratch.entries);
        let mut reached = 0.0;
        let value = |tet: u32, at: RayPoint| self.cell_values.as_ref().map_or(at.value, |values| values[tet as usize]);
        let distance = |at: RayPoint| (at.t - ray.eye) * self.unit;
        for entry in &scratch.entries {
            // Whether anything of this chain was not passed before.
            let mut is_inside = false;
            let exit = walk::walk(&ray, &self.vertices, &self.tets, entry, |tet, from, to| {
                // Distances from the eye in world units, clipped to what lies ahead and is not passed yet.
                let [start, t_out] = [from, to].map(distance);
                let t_in = start.max(reached);
                if t_out <= t_in {
                    return ControlFlow::Continue(());
                }
                reached = t_out;
                if !is_inside {
                    is_inside = true;
                    let at = entry.at;
                    visit(Met::Enters(Crossing { t: distance(at), value: value(entry.tet, at), corners: entry.corners() }))?;
                }
                let (s_in, s_out) = match &self.cell_values {
                    Some(values) => (values[tet as usize], values[tet as usize]),
                    None => (from.value + (to.value - from.value) * ((t_in - start) / (t_out - start)), to.value),
                };
                visit(Met::Passes(Segment { t_in, t_out, s_in, s_out, tet }))
            })?;
            if is_inside && distance(exit.at) >= reached {
                let at = exit.at;
                visit(Met::Leaves(Crossing { t: distance(at), value: value(exit.tet, at), corners: exit.corners }))?;
            }
        }
        ControlFlow::Continue(())
    }
}
