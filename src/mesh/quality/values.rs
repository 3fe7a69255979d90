//! The values of a metric over a mesh.

use super::formulas::{Extremes, Tet, Vector, angle, larger};
use super::metric::{Metric, REGULAR_DEGREES};
use crate::mesh::TetMesh;
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// Whose rules hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// The definitions.
    #[default]
    Definition,
    /// VTK's, its faults included (see [`Metric::vtk_differs`]), and tets that are nearly flat are taken as they are.
    Vtk,
}

/// Tets of which a metric is taken at a time, as many as keep vector units busy and stay in the first cache.
const BLOCK: usize = 64;

/// Tets of a piece of parallel work.
const CHUNK: usize = 1 << 14;

/// A metric of each tet, in the orientation that the file gives it. Lengths are in units of the mesh, angles in degrees, the solid angle in
/// steradians. Where the definition divides by 0 the value is infinite or NaN; a tet that counts as without volume
/// ([`TetMesh::is_zero_volume`]) is given the limit of metrics that divide by the volume: infinite, but for two.
pub fn values(mesh: &TetMesh, metric: Metric, rule: Rule, progress: &Progress) -> Result<Vec<f64>, Cancelled> {
    let mut values = Vec::new();
    values_into(&mut values, mesh, metric, rule, progress)?;
    Ok(values)
}

/// The same into a vector that was used before: memory that is new costs more than most metrics.
pub fn values_into(values: &mut Vec<f64>, mesh: &TetMesh, metric: Metric, rule: Rule, progress: &Progress) -> Result<(), Cancelled> {
    let task = Task { mesh, scale: scale(mesh), metric, rule, mean_jacobian: 0.0 };
    values.resize(mesh.tets().len(), 0.0);
    let mut mean_jacobian = 0.0;
    if matches!(metric, Metric::RelativeSizeSquared | Metric::ShapeAndSize) {
        Task { metric: Metric::Jacobian, ..task }.fill(values, progress)?;
        // Through fixed pieces, so that the sum is the same for any number of threads.
        let sums: Vec<f64> = values.par_chunks(CHUNK).map(|chunk| chunk.iter().sum()).collect();
        mean_jacobian = sums.iter().sum::<f64>() / values.len() as f64;
    }
    Task { mean_jacobian, ..task }.fill(values, progress)?;
    // A power of two: nothing is rounded, and what is too large or small for an f64 becomes so once.
    let dimension = match metric {
        Metric::Inradius => 1,
        Metric::Jacobian | Metric::Volume => 3,
        _ => 0,
    };
    if dimension > 0 && task.scale != 1.0 {
        values.par_iter_mut().with_min_len(CHUNK).for_each(|value| (0..dimension).for_each(|_| *value /= task.scale));
    }
    if let (Some(value), Rule::Definition) = (metric.of_flat(), rule) {
        let flat = (0..values.len()).filter(|&tet| mesh.zero_volume_count() > 0 && mesh.is_zero_volume(tet));
        flat.for_each(|tet| values[tet] = value);
    }
    Ok(())
}

/// A metric of one tet by itself, as [`values`] gives it; [`Metric::RelativeSizeSquared`] then is that of a mesh of this tet.
pub fn of_tet(corners: [DVec3; 4], metric: Metric, rule: Rule) -> f64 {
    let p = corners.map(|p| p.to_array());
    let mut out = [0.0; BLOCK];
    let mut block = Block::new();
    block.fill(|_| p, 1);
    block.judge(metric, rule, Tet::new(p).jacobian(), &mut out);
    out[0]
}

/// A power of two that brings the mesh to a size of about 1, so that no product of its lengths is too large or small for an f64.
fn scale(mesh: &TetMesh) -> f64 {
    let size = mesh.bounds().size().max_element();
    if !(size > 0.0 && size.is_finite()) {
        return 1.0;
    }
    let exponent = size.log2().floor().clamp(-1000.0, 1000.0) as i32;
    2f64.powi(-exponent)
}

/// What is to be known of the tets of a mesh.
#[derive(Clone, Copy)]
struct Task<'a> {
    mesh: &'a TetMesh,
    scale: f64,
    metric: Metric,
    rule: Rule,
    /// Of the scaled mesh.
    mean_jacobian: f64,
}

impl Task<'_> {
    /// The values of the scaled mesh.
    fn fill(self, values: &mut [f64], progress: &Progress) -> Result<(), Cancelled> {
        progress.begin("judging tets", values.len() as u64);
        values.par_chunks_mut(CHUNK).enumerate().try_for_each(|(i, out)| {
            progress.check()?;
            progress.add(out.len() as u64);
            pulp::Arch::new().dispatch(Kernel { task: self, first: i * CHUNK, out });
            Ok(())
        })
    }
}

/// Some tets that follow each other, compiled for the widest vectors that the processor may have.
struct Kernel<'a> {
    task: Task<'a>,
    first: usize,
    out: &'a mut [f64],
}

impl pulp::WithSimd for Kernel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Task { mesh, scale, metric, rule, mean_jacobian } = self.task;
        let (tets, points, turns) = (mesh.tets(), mesh.points(), mesh.inverted_count() > 0);
        let mut block = Block::new();
        for (i, out) in self.out.chunks_mut(BLOCK).enumerate() {
            let first = self.first + i * BLOCK;
            let corners = |k: usize| {
                let tet = first + k;
                let [a, b, mut c, mut d] = tets[tet];
                if turns && mesh.is_inverted(tet) {
                    (c, d) = (d, c);
                }
                let point = |i: u32| {
                    let p = points[i as usize];
                    [p.x * scale, p.y * scale, p.z * scale]
                };
                [point(a), point(b), point(c), point(d)]
            };
            block.fill(corners, out.len());
            match out.try_into() {
                Ok(out) => block.judge(metric, rule, mean_jacobian, out),
                Err(_) => {
                    let mut all = [0.0; BLOCK];
                    block.judge(metric, rule, mean_jacobian, &mut all);
                    out.copy_from_slice(&all[..out.len()]);
                }
            }
        }
    }
}

/// Corners of tets: `coordinates[3 * corner + axis][tet]`.
struct Block {
    coordinates: [[f64; BLOCK]; 12],
}

impl Block {
    fn new() -> Self {
        Block { coordinates: [[0.0; BLOCK]; 12] }
    }

    /// Takes the first `count` tets, at least 1; the rest are as the first.
    #[inline(always)]
    fn fill(&mut self, corners: impl Fn(usize) -> [Vector; 4], count: usize) {
        for i in 0..BLOCK {
            let p = corners(if i < count { i } else { 0 });
            let [[ax, ay, az], [bx, by, bz], [cx, cy, cz], [dx, dy, dz]] = p;
            for (place, coordinate) in self.coordinates.iter_mut().zip([ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz]) {
                place[i] = coordinate;
            }
        }
    }

    #[inline(always)]
    fn each<const N: usize>(&self, out: &mut [[f64; BLOCK]; N], f: impl Fn(&Tet) -> [f64; N]) {
        let c = &self.coordinates;
        for i in 0..BLOCK {
            let p = [[c[0][i], c[1][i], c[2][i]], [c[3][i], c[4][i], c[5][i]], [c[6][i], c[7][i], c[8][i]], [c[9][i], c[10][i], c[11][i]]];
            let found = f(&Tet::new(p));
            for n in 0..N {
                out[n][i] = found[n];
            }
        }
    }

    #[inline(always)]
    fn one(&self, out: &mut [f64; BLOCK], f: impl Fn(&Tet) -> f64) {
        self.each(
            std::array::from_mut(out),
            #[inline(always)]
            |tet| [f(tet)],
        );
    }

    /// An angle from its sine and cosine, times a factor.
    #[inline(always)]
    fn angle(&self, out: &mut [f64; BLOCK], f: impl Fn(&Tet) -> [f64; 2], factor: f64) {
        self.one(
            out,
            #[inline(always)]
            |tet| {
                let [sine, cosine] = f(tet);
                angle(sine, cosine) * factor
            },
        );
    }

    #[inline(always)]
    fn judge(&self, metric: Metric, rule: Rule, mean_jacobian: f64, out: &mut [f64; BLOCK]) {
        let vtk = rule == Rule::Vtk;
        let degrees = 1f64.to_degrees();
        match metric {
            Metric::EdgeRatio => self.one(out, Tet::edge_ratio),
            Metric::AspectRatio => self.one(out, Tet::aspect_ratio),
            Metric::RadiusRatio => self.one(out, Tet::radius_ratio),
            Metric::AspectGamma => self.one(out, Tet::aspect_gamma),
            Metric::AspectFrobenius => self.one(out, Tet::aspect_frobenius),
            Metric::Condition => self.one(out, Tet::condition),
            Metric::CollapseRatio if vtk => self.one(out, Tet::collapse_ratio::<true>),
            Metric::CollapseRatio => self.one(out, Tet::collapse_ratio::<false>),
            Metric::Jacobian => self.one(out, Tet::jacobian),
            Metric::ScaledJacobian => self.one(out, Tet::scaled_jacobian),
            Metric::Shape => self.one(out, Tet::shape),
            Metric::RelativeSizeSquared => self.one(
                out,
                #[inline(always)]
                |tet| tet.relative_size_squared(mean_jacobian),
            ),
            Metric::ShapeAndSize => self.one(
                out,
                #[inline(always)]
                |tet| tet.shape() * tet.relative_size_squared(mean_jacobian),
            ),
            Metric::MeanRatio => self.one(out, Tet::mean_ratio),
            Metric::MinAngle if vtk => self.angle(out, Tet::min_dihedral::<true>, degrees),
            Metric::MinAngle => self.angle(out, Tet::min_dihedral::<false>, degrees),
            Metric::MaxAngle => self.angle(out, Tet::max_dihedral, degrees),
            Metric::SolidAngle => self.angle(out, Tet::half_solid_angle, 2.0),
            Metric::EquiangleSkew => self.equiangle_skew(out),
            Metric::EquivolumeSkew => self.one(out, Tet::equivolume_skew),
            Metric::SquishIndex => self.one(out, Tet::squish_index),
            Metric::Inradius => self.one(out, Tet::inradius),
            Metric::NormalizedInradius => self.one(out, Tet::normalized_inradius),
            Metric::Distortion => *out = [1.0; BLOCK],
            Metric::Volume => self.one(out, Tet::volume),
            Metric::Amips => self.one(out, Tet::amips),
        }
    }

    /// In two passes: one of all of it is too much for the compiler to make vector instructions of.
    #[inline(always)]
    fn equiangle_skew(&self, out: &mut [f64; BLOCK]) {
        let mut in_faces = [0.0; BLOCK];
        self.one(
            &mut in_faces,
            #[inline(always)]
            |tet| skew(tet.face_angles(), 60.0),
        );
        self.one(
            out,
            #[inline(always)]
            |tet| skew(tet.dihedrals::<false>(), REGULAR_DEGREES),
        );
        for (out, in_faces) in out.iter_mut().zip(in_faces) {
            *out = if in_faces > *out { in_faces } else { *out };
        }
    }
}

/// The larger deviation of two angles in degrees from that of the regular tet, in parts of what is possible.
#[inline(always)]
fn skew(angles: Extremes, regular: f64) -> f64 {
    let degrees = 1f64.to_degrees();
    let (min, max) = (angle(angles.most[0], angles.most[1]) * degrees, angle(angles.least[0], angles.least[1]) * degrees);
    larger((max - regular) / (180.0 - regular), (regular - min) / regular) + 0.0 * max // NaN stays
}
