//! What is to be said of the values of a metric: quartiles, a histogram, the worst cells.

use super::metric::{Metric, Worse};
use crate::mesh::TetMesh;
use glam::DVec3;
use rayon::prelude::*;

/// What rounding may add to an acceptable range, in parts of its end.
const ROUNDING: f64 = 1e-9;

/// A bin of a histogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// From where, included.
    pub low: f64,
    /// To where; included in the last bin only.
    pub high: f64,
    /// How many tets have a value there.
    pub count: usize,
}

/// One of the worst tets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstCell {
    /// The tet.
    pub tet: usize,
    /// The cell of the file that it is, or is a part of, from 0.
    pub cell: usize,
    /// The mean of its corners, world coordinates.
    pub center: DVec3,
    /// Its value; infinite or NaN where the definition divides by 0.
    pub value: f64,
}

/// The values of a metric over a mesh in short. Numbers are of the finite values, NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Of what.
    pub metric: Metric,
    /// How many tets there are.
    pub tets: usize,
    /// How many of them have no finite value: degenerate ones, and where the metric has none for inverted tets, those.
    pub infinite: usize,
    /// The least.
    pub min: f64,
    /// A quarter is not above it; between two values by linear interpolation.
    pub q1: f64,
    /// Half of them are not above it.
    pub median: f64,
    /// Three quarters are not above it.
    pub q3: f64,
    /// The largest.
    pub max: f64,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub std: f64,
    /// How many tets are outside the acceptable range, those without a finite value included; `None` where there is no such range.
    pub outside: Option<usize>,
    /// Bins of one width over the metric's own range ([`Metric::bins`]), else from the least value to the largest.
    pub bins: Vec<Bin>,
    /// Finite values below the first bin.
    pub below: usize,
    /// Finite values above the last bin.
    pub above: usize,
    /// The worst tets, the worst first.
    pub worst: Vec<WorstCell>,
}

impl Summary {
    /// Sums up the values of a metric, one a tet. `bins`: how many, at least 1; `worst`: how many of the worst are listed at most.
    pub fn new(mesh: &TetMesh, metric: Metric, values: &[f64], bins: usize, worst: usize) -> Self {
        let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        let (count, mean) = (finite.len() as f64, mean(&finite));
        let variance = finite.par_chunks(1 << 14).map(|chunk| chunk.iter().map(|v| (v - mean).powi(2)).sum::<f64>()).collect::<Vec<_>>();
        let outside = metric.acceptable().map(|acceptable| {
            let [low, high] = acceptable.range;
            let (low, high) = (low - ROUNDING * low.abs(), high + ROUNDING * high.abs());
            values.iter().filter(|value| !(value.is_finite() && (low..=high).contains(*value))).count()
        });
        let [min, q1, median, q3, max] = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| quantile(&mut finite, part));
        let range = metric.bins().unwrap_or([min, max]);
        let (bins, below, above) = histogram(&finite, range, bins.max(1));
        Summary {
            metric,
            tets: values.len(),
            infinite: values.len() - finite.len(),
            min,
            q1,
            median,
            q3,
            max,
            mean,
            std: (variance.iter().sum::<f64>() / count).sqrt(),
            outside,
            bins,
            below,
            above,
            worst: worst_cells(mesh, metric, values, worst),
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    // Through pieces, which loses less to rounding, and in parts of their number, which cannot overflow.
    let count = values.len() as f64;
    let sums: Vec<f64> = values.par_chunks(1 << 14).map(|chunk| chunk.iter().map(|v| v / count).sum()).collect();
    if values.is_empty() { f64::NAN } else { sums.iter().sum() }
}

/// The value below which this part of them lies, by linear interpolation; NaN of none.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
    let place = part * last as f64;
    let below = (place.floor() as usize).min(last);
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    let share = place - below as f64;
    if share == 0.0 {
        return low;
    }
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + share * (high - low)
}

fn histogram(values: &[f64], [low, high]: [f64; 2], bins: usize) -> (Vec<Bin>, usize, usize) {
    let edge = |k: usize| low + (high - low) * (k as f64 / bins as f64);
    let width = (high - low) / bins as f64;
    let (mut counts, mut below, mut above) = (vec![0; bins], 0, 0);
    for &value in values {
        if value < low - ROUNDING * low.abs() {
            below += 1;
        } else if value > high + ROUNDING * high.abs() {
            above += 1;
        } else {
            // Values of one size have bins without a width: the division's NaN counts as the first.
            counts[(((value - low) / width) as usize).min(bins - 1)] += 1;
        }
    }
    let bins = counts.into_iter().enumerate().map(|(k, count)| Bin { low: edge(k), high: edge(k + 1), count }).collect();
    (bins, below, above)
}

fn worst_cells(mesh: &TetMesh, metric: Metric, values: &[f64], most: usize) -> Vec<WorstCell> {
    let badness = |value: f64| match metric.worse() {
        _ if !value.is_finite() => f64::INFINITY,
        // The sign is that of the volume.
        Worse::High if metric == Metric::Condition && value < 0.0 => f64::MAX,
        Worse::High => value,
        Worse::Low => -value,
    };
    let worse_first = |&a: &u32, &b: &u32| badness(values[b as usize]).total_cmp(&badness(values[a as usize])).then(a.cmp(&b));
    let mut order: Vec<u32> = (0..values.len() as u32).collect();
    if most == 0 {
        return Vec::new();
    }
    if most < order.len() {
        order.select_nth_unstable_by(most, worse_first);
        order.truncate(most);
    }
    order.sort_unstable_by(worse_first);
    let cell = |tet: u32| {
        let (tet, value) = (tet as usize, values[tet as usize]);
        let center = mesh.corners(tet).iter().sum::<DVec3>() / 4.0 + mesh.center();
        WorstCell { tet, cell: mesh.file_cells().number(tet), center, value }
    };
    order.into_iter().map(cell).collect()
}
