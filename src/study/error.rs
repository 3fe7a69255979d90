//! How far an octree texture is from the field it was made of: the error at random points of the mesh (maths 3.5) or volume.

use crate::mesh::{ScalarField, TetMesh};
use crate::octree::{OctreeTexture, Subject};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// Points that one generator draws. Fixed, so that the points are the same for any number of threads.
pub(super) const CHUNK: usize = 4096;

/// How the error is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorSampling {
    /// How many points are drawn, by volume and by tet each: 2^20 by default. Their number bounds how rare an error can be and still be
    /// seen; the root mean square needs far fewer.
    pub points: usize,
    /// What the points are drawn from: the same seed gives the same points.
    pub seed: u64,
    /// A bound whose violations are counted; relative to the field's range.
    pub tolerance: Option<f64>,
}

impl Default for ErrorSampling {
    fn default() -> Self {
        ErrorSampling { points: 1 << 20, seed: 1, tolerance: None }
    }
}

/// The measured error of an octree texture: the reconstructed value less the mesh's own (linear in a tet) or the volume's (trilinear between
/// points), both relative to the field's range. A constant field has no range: its values are 0 in both, and so is its error.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldError {
    /// How it was measured.
    pub sampling: ErrorSampling,
    /// Over points that are spread evenly over the mesh's volume: what a viewer sees.
    pub by_volume: ErrorFigures,
    /// Over points that are spread evenly over the mesh's tets: boundary layers, whose tets are small and many, count in full. Of a volume,
    /// whose cells are all of one size, the same as over the volume.
    pub by_tet: ErrorFigures,
}

/// The error over a set of points. Shares and figures of no points at all are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorFigures {
    /// Points at which the octree has a value, those that the figures are of.
    pub points: usize,
    /// Root mean square of the error.
    pub rmse_rel: f64,
    /// The largest error that was met: the true one is larger, never smaller.
    pub max_rel: f64,
    /// Where that was, in world coordinates; `None` if there is no error at all.
    pub max_at: Option<DVec3>,
    /// 99 % of the points have no larger error.
    pub p99_rel: f64,
    /// 99.9 % of the points have no larger error.
    pub p999_rel: f64,
    /// `-20 log10(rmse_rel)`, in decibels; infinite where there is no error.
    pub psnr_db: f64,
    /// Share of all points at which the octree is empty though they lie in the mesh, or between points of a volume that are not missing.
    pub uncovered: f64,
    /// Share of the points whose error is above [`ErrorSampling::tolerance`].
    pub above_tolerance: Option<f64>,
}

impl FieldError {
    /// Measures the octree of a mesh's field or of a volume: [`FieldError::measure`] or [`FieldError::measure_grid`].
    pub fn of(subject: &Subject, texture: &OctreeTexture, sampling: &ErrorSampling, progress: &Progress) -> Result<FieldError, Cancelled> {
        match subject {
            Subject::Mesh(mesh, field) => Self::measure(mesh, field, texture, sampling, progress),
            Subject::Volume(grid) => Self::measure_grid(grid, texture, sampling, progress),
        }
    }

    /// Measures at seeded random points.
    ///
    /// The points are stratified: the i-th of N is drawn from the i-th N-th of the volume (or of the tets), which gives each its share
    /// exactly and lets the points follow the order of the tets. Inside a tet they are uniform. A field without a usable tet gives no
    /// points.
    pub fn measure(
        mesh: &TetMesh,
        field: &ScalarField,
        texture: &OctreeTexture,
        sampling: &ErrorSampling,
        progress: &Progress,
    ) -> Result<FieldError, Cancelled> {
        progress.begin("measuring", 2 * sampling.points as u64);
        let tets: Vec<u32> = (0..mesh.tets().len() as u32).into_par_iter().filter(|&t| field.is_usable(mesh, t as usize)).collect();
        let probe = Probe { mesh, field, texture, sampling, progress };
        let volumes = volumes(mesh, &tets);
        let (by_volume, by_tet) = rayon::join(
            || probe.figures(&Stratified::new(&tets, volumes.into_iter())),
            || probe.figures(&Stratified::new(&tets, tets.iter().map(|_| 1.0))),
        );
        Ok(FieldError { sampling: *sampling, by_volume: by_volume?, by_tet: by_tet? })
    }
}

/// Volumes of tets in units of the bounds' largest edge cubed, so that neither a tiny nor a huge mesh leaves the range of f64.
fn volumes(mesh: &TetMesh, tets: &[u32]) -> Vec<f64> {
    let scale = 1.0 / mesh.bounds().size().max_element();
    let volume = |&tet: &u32| {
        let [a, b, c, d] = mesh.corners(tet as usize);
        let [u, v, w] = [b, c, d].map(|p| (p - a) * scale);
        u.cross(v).dot(w).abs() / 6.0
    };
    tets.par_iter().map(volume).collect()
}

/// Tets to draw points from.
struct Stratified<'a> {
    tets: &'a [u32],
    /// Sum of the weights up to each tet, itself included.
    cumulative: Vec<f64>,
}

impl<'a> Stratified<'a> {
    fn new(tets: &'a [u32], weights: impl Iterator<Item = f64>) -> Self {
        let sum = |sum: &mut f64, weight: f64| {
            *sum += weight;
            Some(*sum)
        };
        Stratified { tets, cumulative: weights.scan(0.0, sum).collect() }
    }

    fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// The first place from `from` on whose sum exceeds `weight`; the last place where rounding leaves none.
    fn advance(&self, mut from: usize, weight: f64) -> usize {
        while from + 1 < self.cumulative.len() && self.cumulative[from] <= weight {
            from += 1;
        }
        from
    }
}

/// What a chunk of points found.
#[derive(Default)]
pub(super) struct Found {
    squares: f64,
    covered: usize,
    above: usize,
    /// Points at which there is no field.
    pub missing: usize,
    /// The largest error, and where it is relative to the mesh's centre.
    worst: (f64, DVec3),
}

/// What is measured, and how.
struct Probe<'a> {
    mesh: &'a TetMesh,
    field: &'a ScalarField,
    texture: &'a OctreeTexture,
    sampling: &'a ErrorSampling,
    progress: &'a Progress,
}

impl Probe<'_> {
    fn figures(&self, draw: &Stratified) -> Result<ErrorFigures, Cancelled> {
        let points = if draw.total() > 0.0 { self.sampling.points } else { 0 };
        figures(self.sampling, points, self.mesh.center(), |k, errors| self.chunk(draw, k, errors))
    }

    /// Measures at the points of chunk `k` and leaves the size of each error in `errors`.
    fn chunk(&self, draw: &Stratified, k: usize, errors: &mut [f32]) -> Result<Found, Cancelled> {
        self.progress.check()?;
        let mut random = SplitMix64::of_chunk(self.sampling.seed, k as u64);
        let stratum = draw.total() / self.sampling.points as f64;
        let (root_min, scale) = (self.texture.root_min(), 1.0 / self.texture.root_edge());
        let mut place = draw.cumulative.partition_point(|&sum| sum <= (k * CHUNK) as f64 * stratum).min(draw.tets.len() - 1);
        let mut tet = self.tet(draw.tets[place]);
        let mut found = Found::default();
        for (i, size) in errors.iter_mut().enumerate() {
            let next = draw.advance(place, ((k * CHUNK + i) as f64 + random.unit()) * stratum);
            if next != place {
                (place, tet) = (next, self.tet(draw.tets[next]));
            }
            let (corners, values) = &tet;
            let b = random.barycentric();
            let at = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2] + corners[3] * b[3];
            let expected = values[0] * b[0] + values[1] * b[1] + values[2] * b[2] + values[3] * b[3];
            let Some(value) = self.texture.value_at((at - root_min) * scale) else { continue };
            *size = found.add(value, expected, at, self.sampling);
        }
        self.progress.add(errors.len() as u64);
        Ok(found)
    }

    /// A tet's corners and the field's values there.
    fn tet(&self, tet: u32) -> ([DVec3; 4], [f64; 4]) {
        (self.mesh.corners(tet as usize), self.field.at_corners(self.mesh, tet as usize))
    }
}

impl Found {
    /// Counts a point and gives the size of its error.
    #[inline]
    pub fn add(&mut self, value: f32, expected: f64, at: DVec3, sampling: &ErrorSampling) -> f32 {
        let error = (f64::from(value) - expected).abs();
        self.squares += error * error;
        self.covered += 1;
        self.above += usize::from(error > sampling.tolerance.unwrap_or(f64::INFINITY));
        if error > self.worst.0 {
            self.worst = (error, at);
        }
        error as f32
    }

    fn and(self, next: Found) -> Found {
        Found {
            squares: self.squares + next.squares,
            covered: self.covered + next.covered,
            above: self.above + next.above,
            missing: self.missing + next.missing,
            worst: if next.worst.0 > self.worst.0 { next.worst } else { self.worst },
        }
    }
}

/// Measures at so many points, chunk by chunk: `chunk` has the number of one and leaves the size of each error; `center` is what places are
/// relative to.
pub(super) fn figures(
    sampling: &ErrorSampling,
    points: usize,
    center: DVec3,
    chunk: impl Fn(usize, &mut [f32]) -> Result<Found, Cancelled> + Sync,
) -> Result<ErrorFigures, Cancelled> {
    let mut errors = vec![UNCOVERED; points];
    let found: Vec<Found> = errors.par_chunks_mut(CHUNK).enumerate().map(|(k, errors)| chunk(k, errors)).collect::<Result<_, _>>()?;
    // Chunks are added in their order: floating-point sums depend on it.
    let all = found.into_iter().fold(Found::default(), Found::and);
    let [p99_rel, p999_rel] = percentiles(&mut errors, all.covered, [0.99, 0.999]);
    let share = |count: usize, of: usize| if of > 0 { count as f64 / of as f64 } else { f64::NAN };
    let rmse_rel = (all.squares / all.covered as f64).sqrt();
    Ok(ErrorFigures {
        points: all.covered,
        rmse_rel,
        max_rel: if all.covered > 0 { all.worst.0 } else { f64::NAN },
        max_at: (all.worst.0 > 0.0).then_some(all.worst.1 + center),
        p99_rel,
        p999_rel,
        psnr_db: -20.0 * rmse_rel.log10(),
        uncovered: share(points - all.missing - all.covered, points - all.missing),
        above_tolerance: sampling.tolerance.map(|_| share(all.above, all.covered)),
    })
}

/// Stands in for the error of a point where the octree is empty: below every error.
const UNCOVERED: f32 = -1.0;

/// The smallest errors that at least these ascending shares of the `covered` points do not exceed; sorts `errors` a little.
fn percentiles<const N: usize>(errors: &mut [f32], covered: usize, shares: [f64; N]) -> [f64; N] {
    if covered == 0 {
        return [f64::NAN; N];
    }
    let uncovered = errors.len() - covered;
    let mut rest = errors;
    let mut found = [0.0; N];
    // From the largest down: what lies below one percentile holds the next.
    for (share, figure) in shares.into_iter().zip(&mut found).rev() {
        let rank = uncovered + ((share * covered as f64).ceil() as usize).clamp(1, covered) - 1;
        let (_, &mut value, _) = rest.select_nth_unstable_by(rank, f32::total_cmp);
        *figure = f64::from(value);
        rest = &mut rest[..=rank];
    }
    found
}

/// SplitMix64 (Steele, Lea & Flood, *Fast Splittable Pseudorandom Number Generators*, 2014).
pub(super) struct SplitMix64(u64);

impl SplitMix64 {
    /// The generator of one chunk of points.
    pub fn of_chunk(seed: u64, chunk: u64) -> Self {
        let first = SplitMix64(seed).next();
        SplitMix64(SplitMix64(first ^ chunk).next())
    }

    #[inline]
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    #[inline]
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Barycentric coordinates of a point that is uniform in a tet: the gaps that three uniform numbers leave in [0, 1], which are
    /// distributed as four exponential numbers over their sum (Devroye, *Non-Uniform Random Variate Generation*, 1986, V.2).
    #[inline]
    fn barycentric(&mut self) -> [f64; 4] {
        let [a, b, c] = [self.unit(), self.unit(), self.unit()];
        let (low, high) = (a.min(b), a.max(b));
        let (first, last) = (low.min(c), high.max(c));
        let middle = low.max(high.min(c));
        [first, middle - first, last - middle, 1.0 - last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Association, MeshParts};
    use crate::octree::{CellKind, Octree, OctreeParams, Sampling, regularize};
    use glam::UVec3;

    /// The six tets of the box from (x0, 0, 0) to (x1, 1, 1) around its diagonal; its points are appended.
    fn push_box(parts: &mut MeshParts, [x0, x1]: [f64; 2]) {
        let first = parts.points.len() as u32;
        parts.points.extend((0..8).map(|i| DVec3::new(if i & 1 == 0 { x0 } else { x1 }, f64::from(i >> 1 & 1), f64::from(i >> 2))));
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            parts.tets.push([0, a, b, 7].map(|i| first + i));
        }
    }

    /// Boxes side by side along x in the unit cube, and the field x on them.
    fn boxes(cuts: &[f64], scale: f64) -> (TetMesh, ScalarField) {
        let mut parts = MeshParts::default();
        cuts.windows(2).for_each(|cut| push_box(&mut parts, [cut[0], cut[1]]));
        parts.points.iter_mut().for_each(|p| *p *= scale);
        let mesh = TetMesh::new(parts).expect("valid");
        let x = mesh.points().iter().map(|p| (p.x + mesh.center().x) / scale).collect();
        (mesh, ScalarField::new("x".into(), Association::Points, x))
    }

    /// Leaves of one depth over the mesh's cube with the value that `value` gives for their number along x.
    fn leaves(mesh: &TetMesh, depth: u8, value: impl Fn(u32) -> Option<f32>) -> OctreeTexture {
        let kind = |at: UVec3, d: u8| match value(at.x) {
            _ if d < depth => CellKind::Split,
            Some(value) => CellKind::Leaf(value),
            None => CellKind::Empty,
        };
        let tree = Octree::from_fn(mesh.bounds().min, mesh.bounds().size().x, [0.0, 1.0], kind);
        OctreeTexture::encode(&tree).expect("fits")
    }

    fn measure(mesh: &TetMesh, field: &ScalarField, texture: &OctreeTexture, tolerance: Option<f64>) -> FieldError {
        let sampling = ErrorSampling { points: 1 << 16, seed: 7, tolerance };
        FieldError::measure(mesh, field, texture, &sampling, &Progress::new()).expect("nobody cancels")
    }

    fn close(found: f64, expected: f64, relative: f64) {
        assert!((found / expected - 1.0).abs() < relative, "{found}, expected {expected}");
    }

    #[test]
    fn constants_against_a_linear_field_have_a_uniform_error() {
        for scale in [1.0, 1e-80, 1e80] {
            let (mesh, field) = boxes(&[0.0, 1.0], scale);
            let h = 1.0 / 8.0;
            let texture = leaves(&mesh, 3, |i| Some((i as f32 + 0.5) / 8.0));
            let error = measure(&mesh, &field, &texture, Some(h / 10.0));
            for figures in [error.by_volume, error.by_tet] {
                close(figures.rmse_rel, h / 12f64.sqrt(), 0.005);
                close(figures.psnr_db, -20.0 * (h / 12f64.sqrt()).log10(), 0.005);
                close(figures.p99_rel, 0.99 * h / 2.0, 0.005);
                close(figures.p999_rel, 0.999 * h / 2.0, 0.001);
                close(figures.max_rel, h / 2.0, 0.001);
                assert!(figures.max_rel <= h / 2.0 + 1e-6, "24-bit values");
                close(figures.above_tolerance.expect("a tolerance was given"), 0.8, 0.01);
                assert_eq!((figures.points, figures.uncovered), (1 << 16, 0.0));
                let at = figures.max_at.expect("there is an error") / scale;
                let from_face = (at.x / h - (at.x / h).round()).abs();
                assert!(from_face < 1e-3 && at.min_element() > 0.0 && at.max_element() < 1.0, "{at} is at a leaf's face");
            }
        }
    }

    #[test]
    fn what_is_not_covered_counts_apart_and_small_tets_count_by_tet() {
        // A quarter of the volume is half of the tets; there the octree is empty.
        let (mesh, field) = boxes(&[0.0, 0.25, 1.0], 1.0);
        let texture = leaves(&mesh, 2, |i| (i > 0).then_some((i as f32 + 0.5) / 4.0));
        let error = measure(&mesh, &field, &texture, None);
        close(error.by_volume.uncovered, 0.25, 1e-4);
        close(error.by_tet.uncovered, 0.5, 1e-4);
        close(error.by_tet.rmse_rel, 0.25 / 12f64.sqrt(), 0.01);
        close(error.by_tet.p99_rel, 0.99 * 0.125, 0.005);
        assert_eq!(error.by_volume.above_tolerance, None);
        assert_eq!(error.by_volume.points, (1 << 16) - (error.by_volume.uncovered * 65536.0) as usize);
    }

    #[test]
    fn no_octree_and_no_range() {
        let (mesh, field) = boxes(&[0.0, 1.0], 1.0);
        let nothing = measure(&mesh, &field, &leaves(&mesh, 1, |_| None), Some(0.1)).by_volume;
        assert!((nothing.points, nothing.uncovered) == (0, 1.0) && nothing.rmse_rel.is_nan() && nothing.max_at.is_none());
        let constant = ScalarField::new("c".into(), Association::Points, vec![3.0; 8]);
        let tree = regularize(&mesh, &constant, &OctreeParams::default(), &Progress::new()).expect("regularizes");
        let error = measure(&mesh, &constant, &OctreeTexture::encode(&tree).expect("fits"), None).by_volume;
        assert_eq!((error.rmse_rel, error.max_rel, error.p999_rel, error.psnr_db), (0.0, 0.0, 0.0, f64::INFINITY));
        let missing = ScalarField::new("m".into(), Association::Points, vec![f64::NAN; 8]);
        let unusable = measure(&mesh, &missing, &leaves(&mesh, 1, |_| Some(0.5)), None).by_tet;
        assert!(unusable.points == 0 && unusable.uncovered.is_nan());
    }

    #[test]
    fn cell_fields_are_compared_with_their_own_value() {
        let (mesh, _) = boxes(&[0.0, 0.5, 1.0], 1.0);
        let field = ScalarField::new("c".into(), Association::Cells, (0..12).map(|t| if t < 6 { 2.0 } else { 4.0 }).collect());
        let exact = leaves(&mesh, 1, |i| Some(i as f32));
        assert_eq!(measure(&mesh, &field, &exact, None).by_volume.max_rel, 0.0);
        let half = leaves(&mesh, 1, |_| Some(0.5));
        close(measure(&mesh, &field, &half, None).by_volume.rmse_rel, 0.5, 1e-6);
    }

    #[test]
    fn the_numbers_do_not_depend_on_threads_but_on_the_seed() {
        let (mesh, field) = boxes(&[0.0, 0.3, 1.0], 1.0);
        let params = OctreeParams { max_depth: 4, sampling: Sampling::Vertices, ..OctreeParams::default() };
        let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes");
        let texture = OctreeTexture::encode(&tree).expect("fits");
        let with = |threads, seed| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let sampling = ErrorSampling { points: 50_000, seed, tolerance: None };
            pool.install(|| FieldError::measure(&mesh, &field, &texture, &sampling, &Progress::new())).expect("nobody cancels")
        };
        assert_eq!(with(1, 5), with(4, 5));
        assert_ne!(with(4, 5).by_volume.rmse_rel, with(4, 6).by_volume.rmse_rel);
        let cancelled = Progress::new();
        cancelled.cancel();
        assert_eq!(FieldError::measure(&mesh, &field, &texture, &ErrorSampling::default(), &cancelled), Err(Cancelled));
    }

    #[test]
    fn points_are_uniform_in_a_tet() {
        // Dirichlet(1, 1, 1, 1): each coordinate has the mean 1/4 and the variance 3/80, two of them the covariance -1/80.
        let mut random = SplitMix64::of_chunk(3, 0);
        let drawn: Vec<[f64; 4]> = (0..100_000).map(|_| random.barycentric()).collect();
        assert!(drawn.iter().all(|b| b.iter().all(|&w| w >= 0.0) && (b.iter().sum::<f64>() - 1.0).abs() < 1e-15));
        for i in 0..4 {
            for j in 0..4 {
                let mean = drawn.iter().map(|b| (b[i] - 0.25) * (b[j] - 0.25)).sum::<f64>() / drawn.len() as f64;
                let expected = if i == j { 3.0 / 80.0 } else { -1.0 / 80.0 };
                assert!((mean - expected).abs() < 5e-4, "{i}, {j}: {mean}");
            }
        }
    }
}
