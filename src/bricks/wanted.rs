//! Which bricks a picture of slices takes, and which of them first.

use super::{BRICK_EDGE, BrickKey, BrickSource, BrickStatistics, Pyramid, SlicePlane};
use glam::DVec3;

/// When a brick of a coarse level is as good as the finer ones beneath it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetailRule {
    /// Bricks with more entropy than so many bits are refined, 0 to 8. The paper's is 0.1. Below 0, every brick is.
    pub min_entropy: f32,
    /// How far the values beneath a brick and its neighbours may lie apart, as a share of the range of the volume. Infinite: entropy alone
    /// decides, as in the paper, and a few voxels that stand out may be lost.
    pub tolerance: f64,
}

impl Default for DetailRule {
    fn default() -> Self {
        DetailRule { min_entropy: 0.1, tolerance: 1.0 / 255.0 }
    }
}

impl DetailRule {
    /// The paper's rule: entropy alone.
    pub fn entropy(min_entropy: f32) -> Self {
        DetailRule { min_entropy, tolerance: f64::INFINITY }
    }

    /// Everything is refined.
    pub const EVERYTHING: DetailRule = DetailRule { min_entropy: -1.0, tolerance: 0.0 };
}

/// Which bricks need no finer ones.
///
/// The values beneath a brick are those of level 0 that it is the mean of. Where those of a brick and its 26 neighbours all lie within the
/// tolerance, so do all means of them and everything interpolated from them: whatever a finer level would show inside the brick, it differs
/// by no more than the tolerance. A brick's own range would not do: values that alternate have a mean without range. Its own entropy would
/// not do either: one voxel in a hundred can hold anything at 0.08 bits.
#[derive(Debug, Clone)]
pub struct Detail {
    pyramid: Pyramid,
    /// Per level, x fastest.
    enough: Vec<Vec<bool>>,
}

impl Detail {
    /// Works the rule out for every brick of a pyramid. Where statistics are missing a brick is refined. Asks for those of each brick once.
    pub fn new(pyramid: &Pyramid, range: [f64; 2], statistics: impl Fn(BrickKey) -> Option<BrickStatistics>, rule: DetailRule) -> Self {
        let levels = usize::from(pyramid.levels());
        let mut enough = vec![Vec::new(); levels];
        if rule.min_entropy < 0.0 {
            enough.iter_mut().zip(0..).for_each(|(flags, level)| flags.resize(pyramid.brick_count(level) as usize, false));
            return Detail { pyramid: *pyramid, enough };
        }
        let spread = rule.tolerance * (range[1] - range[0]);
        // The values beneath, from the finest level up.
        let mut beneath: Vec<Span> = Vec::new();
        for level in 0..pyramid.levels() {
            let [nx, ny, nz] = pyramid.bricks(level).map(|n| n as usize);
            let found: Vec<Option<BrickStatistics>> = pyramid.keys(level).map(&statistics).collect();
            if level == 0 {
                enough[0] = vec![true; found.len()];
                beneath = found.iter().map(|found| found.map_or(Span::UNREADABLE, |found| Span::of(found))).collect();
                continue;
            }
            let finer = pyramid.bricks(level - 1).map(|n| n as usize);
            let mut spans = vec![Span::NONE; nx * ny * nz];
            for (i, span) in beneath.iter().enumerate() {
                let (x, y, z) = (i % finer[0], i / finer[0] % finer[1], i / finer[0] / finer[1]);
                let parent = (z / 2 * ny + y / 2) * nx + x / 2;
                spans[parent] = spans[parent].with(*span);
            }
            beneath = spans;
            let around = grown(&beneath, [nx, ny, nz]);
            enough[usize::from(level)] = found
                .iter()
                .zip(&around)
                .map(|(found, span)| found.is_some_and(|found| found.entropy <= rule.min_entropy) && span.within(spread))
                .collect();
        }
        Detail { pyramid: *pyramid, enough }
    }

    /// The same for a source.
    pub fn of(source: &dyn BrickSource, rule: DetailRule) -> Self {
        Self::new(source.pyramid(), source.range(), |key| source.statistics(key), rule)
    }

    /// Whether finer bricks would show nothing more. Those of level 0 are always enough.
    pub fn is_enough(&self, key: BrickKey) -> bool {
        let [nx, ny, _] = self.pyramid.bricks(key.level).map(|n| n as usize);
        let [x, y, z] = key.at.map(|at| at as usize);
        self.enough.get(usize::from(key.level)).and_then(|level| level.get((z * ny + y) * nx + x)).copied().unwrap_or(false)
    }
}

/// Smallest and largest known value, and whether there are voxels without one: where known ends, nothing is within a tolerance.
#[derive(Debug, Clone, Copy)]
struct Span {
    low: f64,
    high: f64,
    missing: bool,
}

impl Span {
    const NONE: Span = Span { low: f64::INFINITY, high: f64::NEG_INFINITY, missing: false };
    const UNREADABLE: Span = Span { low: f64::NEG_INFINITY, high: f64::INFINITY, missing: true };

    fn of(found: BrickStatistics) -> Self {
        let [low, high] = found.range;
        let missing = found.known < 1.0;
        if low.is_nan() || high.is_nan() { Span { missing, ..Span::NONE } } else { Span { low, high, missing } }
    }

    fn with(self, other: Span) -> Span {
        Span { low: self.low.min(other.low), high: self.high.max(other.high), missing: self.missing || other.missing }
    }

    fn within(self, spread: f64) -> bool {
        self.low > self.high || self.high - self.low <= spread && (!self.missing || spread == f64::INFINITY)
    }
}

/// Each span with those of its neighbours: one axis after the other.
fn grown(spans: &[Span], counts: [usize; 3]) -> Vec<Span> {
    let mut spans = spans.to_vec();
    let mut stride = 1;
    for count in counts {
        let old = spans.clone();
        for (i, span) in spans.iter_mut().enumerate() {
            let at = i / stride % count;
            if at > 0 {
                *span = span.with(old[i - stride]);
            }
            if at + 1 < count {
                *span = span.with(old[i + stride]);
            }
        }
        stride *= count;
    }
    spans
}

/// The bricks that a refined picture of slices takes, most wanted first, with their priority: the bigger the sooner. From the coarsest level
/// down, a brick is taken if it is of the finest level asked for or if finer ones would show nothing more; otherwise those of the next level
/// beneath it are looked at. No brick is beneath another. Nearer to the eye (index space) comes first.
pub fn wanted(pyramid: &Pyramid, planes: &[SlicePlane], eye: DVec3, detail: &Detail, finest: u8) -> Vec<(BrickKey, f32)> {
    let finest = finest.min(pyramid.levels() - 1);
    let mut found = Vec::new();
    let mut open = vec![pyramid.top()];
    while let Some(key) = open.pop() {
        if !planes.iter().any(|plane| meets(plane, key)) {
            continue;
        }
        if key.level == finest || detail.is_enough(key) {
            found.push((key, -eye.distance(key.center()) as f32));
            continue;
        }
        open.extend(pyramid.children(key));
    }
    found.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found
}

/// Whether a slice needs a brick, as [`Pyramid::cut`] has it.
pub fn meets(plane: &SlicePlane, key: BrickKey) -> bool {
    let half = (f64::from(BRICK_EDGE) + 1.0) / 2.0 * key.voxel_size() * plane.normal.abs().element_sum();
    plane.distance(key.center()).abs() < half
}
