//! How much of a field has which values.

use crate::geometry::signed_volume;
use crate::mesh::{Association, ScalarField, TetMesh};
use crate::octree::Subject;
use crate::progress::{Cancelled, Progress};
use crate::view::Scale;
use crate::volume::Grid;
use rayon::prelude::*;

/// Tets or voxels that are counted at a time.
const CHUNK: usize = 1 << 14;

/// Points of a volume that are looked at; of more, every second, third and so on stands for its neighbours.
const MOST_POINTS: usize = 1 << 26;

/// Decades below the fullest bin that the logarithm of a count still shows.
const DECADES: f64 = 4.0;

/// Bins of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bins {
    /// From the first bin's lower end to the last one's upper end, data units.
    pub range: [f64; 2],
    /// How many, at least 1.
    pub count: usize,
    /// Bins have one width on this scale; one that does not fit the range counts as linear.
    pub scale: Scale,
}

/// How much of a field has values in each of some bins: volume of tets, in world units, or points of a volume. Missing values are left out,
/// as are values outside the range.
///
/// Inside a tet a field on points is linear, and each bin gets exactly the part of the tet that has its values; a field on cells is constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// The bins.
    pub bins: Bins,
    /// The amount in each.
    pub amounts: Vec<f64>,
}

impl Histogram {
    /// Counts in parallel. Of volumes of more than 2^26 points every second, third and so on is counted, and counts for its neighbours too.
    pub fn of(subject: &Subject, bins: Bins, progress: &Progress) -> Result<Histogram, Cancelled> {
        let finder = Finder::new(bins);
        let amounts = match subject {
            Subject::Mesh(mesh, field) => of_mesh(mesh, field, &finder, progress)?,
            Subject::Volume(grid) => of_grid(grid, &finder, progress)?,
        };
        Ok(Histogram { bins, amounts })
    }

    /// The height of each bin's bar in [0, 1], by the logarithm of its amount: 1 for the fullest bin, a quarter less for each decade below it,
    /// and still more than 0 for a ten-thousandth of it.
    pub fn log_heights(&self) -> Vec<f32> {
        let most = self.amounts.iter().copied().fold(0.0, f64::max);
        let scale = 10f64.powf(DECADES);
        let height = |amount: &f64| if most > 0.0 { (scale * amount / most).ln_1p() / scale.ln_1p() } else { 0.0 };
        self.amounts.iter().map(|amount| height(amount) as f32).collect()
    }
}

/// Finds the bins of values.
struct Finder {
    /// Ends of bins, ascending, one more than bins.
    edges: Vec<f64>,
    /// Bins a data unit where they have one width.
    per_unit: Option<f64>,
}

impl Finder {
    fn new(bins: Bins) -> Self {
        let [lo, hi] = bins.range;
        let (n, scale) = (bins.count.max(1), bins.scale.or_linear(bins.range));
        let edges = (0..=n).map(|k| scale.value(bins.range, k as f64 / n as f64)).collect();
        Finder { edges, per_unit: (scale == Scale::Linear && lo < hi).then(|| n as f64 / (hi - lo)) }
    }

    fn bins(&self) -> usize {
        self.edges.len() - 1
    }

    /// The bin that holds a value of the range; the range's end belongs to the last.
    fn bin(&self, value: f64) -> Option<usize> {
        let last = self.bins() - 1;
        if !(self.edges[0] <= value && value <= self.edges[last + 1]) {
            return None;
        }
        Some(match self.per_unit {
            Some(per_unit) => (((value - self.edges[0]) * per_unit) as usize).min(last),
            None => self.edges.partition_point(|&edge| edge <= value).saturating_sub(1).min(last),
        })
    }
}

/// Sums that threads have counted.
fn sum(mut a: Vec<f64>, b: Vec<f64>) -> Vec<f64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

fn of_mesh(mesh: &TetMesh, field: &ScalarField, finder: &Finder, progress: &Progress) -> Result<Vec<f64>, Cancelled> {
    let tets = mesh.tets().len();
    progress.begin("counting values", tets as u64);
    // Chunks are few and their order fixed, so that sums are the same for any number of threads.
    let chunk = CHUNK.max(tets.div_ceil(256));
    let count = |first: usize| {
        progress.check()?;
        let mut amounts = vec![0.0; finder.bins()];
        let of_chunk = first..(first + chunk).min(tets);
        progress.add(of_chunk.len() as u64);
        for tet in of_chunk.filter(|&tet| field.is_usable(mesh, tet)) {
            let volume = signed_volume(&mesh.corners(tet)).abs();
            match field.association {
                Association::Cells => {
                    if let Some(bin) = finder.bin(field.values[tet]) {
                        amounts[bin] += volume;
                    }
                }
                Association::Points => add_tet(finder, mesh.tets()[tet].map(|i| field.values[i as usize]), volume, &mut amounts),
            }
        }
        Ok(amounts)
    };
    let parts: Vec<Vec<f64>> = (0..tets.div_ceil(chunk)).into_par_iter().map(|i| count(i * chunk)).collect::<Result<_, _>>()?;
    Ok(parts.into_iter().fold(vec![0.0; finder.bins()], sum))
}

/// Adds a tet of a volume with these values at its corners to the bins that it has values in.
fn add_tet(finder: &Finder, mut v: [f64; 4], volume: f64, amounts: &mut [f64]) {
    v.sort_unstable_by(f64::total_cmp);
    let (edges, last) = (&finder.edges, finder.bins() - 1);
    if v[3] < edges[0] || v[0] > edges[last + 1] {
        return;
    }
    if v[0] == v[3] {
        if let Some(bin) = finder.bin(v[0]) {
            amounts[bin] += volume;
        }
        return;
    }
    let slopes = slopes(&v);
    let mut bin = finder.bin(v[0].max(edges[0])).unwrap_or(0);
    let mut below = if v[0] < edges[0] { part_below(&v, &slopes, edges[0]) } else { 0.0 };
    loop {
        let is_end = v[3] <= edges[bin + 1];
        let upto = if is_end { 1.0 } else { part_below(&v, &slopes, edges[bin + 1]) };
        amounts[bin] += volume * (upto - below).max(0.0);
        if is_end || bin == last {
            return;
        }
        (below, bin) = (upto, bin + 1);
    }
}

/// 1 / (difference) of the values at the corners 0 1, 0 2, 0 3, 1 2, 1 3, 2 3 of a tet, ascending; infinite where they are equal.
fn slopes(v: &[f64; 4]) -> [f64; 6] {
    [v[1] - v[0], v[2] - v[0], v[3] - v[0], v[2] - v[1], v[3] - v[1], v[3] - v[2]].map(|width| 1.0 / width)
}

/// The part of a tet in which a linear field with these values at its corners, ascending and not all equal, is below `t`.
///
/// Where the level cuts off one corner that is a smaller tet; where it cuts off an edge, three tets, which are summed by the places at which
/// it cuts the four edges between the corners below and those above. Nothing is subtracted, so that equal values do no harm: an edge is
/// looked at only if the level lies strictly between its ends, or at one of two that differ.
fn part_below(v: &[f64; 4], slopes: &[f64; 6], t: f64) -> f64 {
    let cut = |from: usize, edge: usize| ((t - v[from]) * slopes[edge]).min(1.0);
    if t <= v[0] {
        0.0
    } else if t >= v[3] {
        1.0
    } else if t <= v[1] {
        cut(0, 0) * cut(0, 1) * cut(0, 2)
    } else if t >= v[2] {
        1.0 - (1.0 - cut(0, 2)) * (1.0 - cut(1, 4)) * (1.0 - cut(2, 5))
    } else {
        let (a, b, c, d) = (cut(0, 1), cut(0, 2), cut(1, 3), cut(1, 4));
        a * b + a * (1.0 - b) * d + (1.0 - a) * c * d
    }
}

fn of_grid(grid: &Grid, finder: &Finder, progress: &Progress) -> Result<Vec<f64>, Cancelled> {
    let samples = grid.samples();
    progress.begin("counting values", samples.len() as u64);
    let step = samples.len().div_ceil(MOST_POINTS).max(1);
    let chunk = (CHUNK * 4).max(samples.len().div_ceil(256));
    let count = |first: usize| {
        progress.check()?;
        let mut counts = vec![0usize; finder.bins()];
        let of_chunk = first..(first + chunk).min(samples.len());
        progress.add(of_chunk.len() as u64);
        samples.each(of_chunk, step, |value| {
            if let Some(bin) = finder.bin(value) {
                counts[bin] += 1;
            }
        });
        Ok(counts.into_iter().map(|n| (n * step) as f64).collect())
    };
    let parts: Vec<Vec<f64>> = (0..samples.len().div_ceil(chunk)).into_par_iter().map(|i| count(i * chunk)).collect::<Result<_, _>>()?;
    Ok(parts.into_iter().fold(vec![0.0; finder.bins()], sum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshParts;
    use crate::volume::{GridFrame, Samples};
    use glam::{DMat3, DVec3};
    use std::sync::Arc;

    fn bins(range: [f64; 2], count: usize, scale: Scale) -> Bins {
        Bins { range, count, scale }
    }

    /// A cube of edge 2 as six tets with values at its corners and cells by world position.
    fn cube(association: Association, value: impl Fn(DVec3) -> f64) -> Subject {
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64) * 2.0).collect();
        let tets: Vec<[u32; 4]> = [[1, 3], [1, 5], [2, 3], [2, 6], [4, 5], [4, 6]].map(|[a, b]| [0, a, b, 7]).to_vec();
        let mesh = TetMesh::new(MeshParts { points, tets, ..Default::default() }).expect("valid");
        let values = match association {
            Association::Points => mesh.points().iter().map(|&p| value(p + mesh.center())).collect(),
            Association::Cells => (0..6).map(|t| value(DVec3::splat(f64::from(t)))).collect(),
        };
        Subject::Mesh(Arc::new(mesh), Arc::new(ScalarField::new("s".into(), association, values)))
    }

    fn amounts(subject: &Subject, bins: Bins) -> Vec<f64> {
        Histogram::of(subject, bins, &Progress::new()).expect("nobody cancels").amounts
    }

    fn assert_near(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-12), "{found:?}, expected {expected:?}");
    }

    #[test]
    fn a_linear_field_fills_bins_by_volume() {
        // z is spread evenly over the cube of volume 8.
        let z = cube(Association::Points, |p| p.z);
        assert_near(&amounts(&z, bins([0.0, 2.0], 5, Scale::Linear)), &[1.6; 5]);
        assert_near(&amounts(&z, bins([0.5, 1.5], 2, Scale::Linear)), &[2.0; 2]);
        assert_near(&amounts(&z, bins([-1.0, 0.5], 3, Scale::Linear)), &[0.0, 0.0, 2.0]);
        assert_near(&amounts(&z, bins([3.0, 4.0], 2, Scale::Linear)), &[0.0; 2]);
        // Equal bins of a log scale hold equal decades.
        assert_near(&amounts(&z, bins([0.002, 2.0], 3, Scale::Log)), &[0.072, 0.72, 7.2]);
        // x + y + z: below t <= 2 lies a tet of volume t^3 / 6.
        let sum = cube(Association::Points, |p| p.x + p.y + p.z);
        let below = |t: f64| if t <= 2.0 { t.powi(3) / 6.0 } else { t.powi(3) / 6.0 - 3.0 * (t - 2.0).powi(3) / 6.0 };
        assert_near(&amounts(&sum, bins([0.0, 3.0], 3, Scale::Linear)), &[below(1.0), below(2.0) - below(1.0), below(3.0) - below(2.0)]);
        // Parts add up whatever the edges are.
        let odd = amounts(&sum, bins([-1.0, 7.0], 97, Scale::Linear)).iter().sum::<f64>();
        assert!((odd - 8.0).abs() < 1e-12, "{odd}");
    }

    #[test]
    fn the_part_below_a_level_is_that_of_many_points() {
        // Against counting a lattice of barycentric coordinates.
        for v in [
            [0.0, 0.2, 0.7, 1.0],
            [0.0, 0.0, 0.5, 1.0],
            [0.0, 0.5, 0.5, 1.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0, 1.0],
            [0.0, 0.0, 1.0, 1.0],
        ] {
            for t in [0.1, 0.2, 0.4, 0.5, 0.65, 0.7, 0.9] {
                let (n, mut all, mut below) = (60, 0.0, 0.0);
                for (i, j, k) in (0..n).flat_map(|i| (0..n - i).flat_map(move |j| (0..n - i - j).map(move |k| (i, j, k)))) {
                    let b = [i, j, k].map(|i| (f64::from(i) + 0.25) / f64::from(n));
                    let value = v[0] * (1.0 - b[0] - b[1] - b[2]) + v[1] * b[0] + v[2] * b[1] + v[3] * b[2];
                    (all, below) = (all + 1.0, below + f64::from(u8::from(value < t)));
                }
                let part = part_below(&v, &slopes(&v), t);
                assert!((part - below / all).abs() < 0.03, "{v:?} below {t}: {part}, counted {}", below / all);
            }
        }
    }

    #[test]
    fn cells_count_by_volume_and_missing_values_do_not() {
        let cells = cube(Association::Cells, |p| if p.x == 2.0 { f64::NAN } else { p.x });
        assert_near(&amounts(&cells, bins([0.0, 5.0], 5, Scale::Linear)), &[8.0 / 6.0, 8.0 / 6.0, 0.0, 8.0 / 6.0, 16.0 / 6.0]);
        let points = cube(Association::Points, |p| if p == DVec3::new(2.0, 0.0, 0.0) { f64::NAN } else { 1.0 });
        assert_near(&amounts(&points, bins([0.0, 2.0], 2, Scale::Linear)), &[0.0, 8.0 * 4.0 / 6.0]);
    }

    #[test]
    fn voxels_are_counted() {
        let frame = GridFrame { dims: [2, 2, 2], origin: DVec3::ZERO, steps: DMat3::IDENTITY };
        let grid = |samples| Subject::Volume(Arc::new(Grid::new(frame, "s".into(), samples).expect("valid")));
        let bytes = grid(Samples::U8(vec![0, 1, 1, 2, 3, 4, 4, 4].into()));
        assert_eq!(amounts(&bytes, bins([0.0, 4.0], 4, Scale::Linear)), [1.0, 2.0, 1.0, 4.0]);
        assert_eq!(amounts(&bytes, bins([1.0, 2.0], 2, Scale::Linear)), [2.0, 1.0]);
        let floats = grid(Samples::F32(vec![1.0, 10.0, 100.0, 99.0, f32::NAN, 1000.0, -5.0, 0.0].into()));
        assert_eq!(amounts(&floats, bins([1.0, 1000.0], 3, Scale::Log)), [1.0, 2.0, 2.0]);
        let one = grid(Samples::U8(vec![7; 8].into()));
        assert_eq!(amounts(&one, bins([7.0, 7.0], 2, Scale::Linear)).iter().sum::<f64>(), 8.0);
    }

    #[test]
    fn bars_are_logarithms() {
        let histogram = Histogram { bins: bins([0.0, 1.0], 4, Scale::Linear), amounts: vec![0.0, 1.0, 100.0, 1e4] };
        let heights = histogram.log_heights();
        assert_eq!((heights[0], heights[3]), (0.0, 1.0));
        assert!((heights[2] - 0.5).abs() < 2e-3 && heights[1] > 0.05, "{heights:?}");
        let nothing = Histogram { amounts: vec![0.0; 4], ..histogram };
        assert_eq!(nothing.log_heights(), [0.0; 4]);
    }
}
