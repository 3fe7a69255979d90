//! Which bricks a picture of slices takes, and which of them first.

use super::{BRICK_EDGE, BrickKey, BrickSource, BrickStatistics, Pyramid, SlicePlane};
use glam::DVec3;
use rayon::prelude::*;

/// When a brick of a coarse level is as good as the finer ones beneath it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetailRule {
    /// Bricks with more entropy than so many bits are refined, 0 to 8. The paper's is 0.1. Below 0, every brick is.
    pub min_entropy: f32,
    /// How far the values beneath a brick may lie apart, as a share of the range of the volume. Infinite: entropy alone
    /// decides, as in the paper, and a few voxels that stand out may be lost.
    pub tolerance: f64,
    /// Whether what is next to a brick must be within the tolerance as well. It must where values between voxels are interpolated and bricks of
    /// several levels meet; where each voxel is taken from the finest brick that is there, before any interpolation, or where pixels lie on
    /// voxels, the brick's own values are enough.
    pub margin: bool,
}

impl Default for DetailRule {
    fn default() -> Self {
        DetailRule { min_entropy: 0.1, tolerance: 1.0 / 255.0, margin: true }
    }
}

impl DetailRule {
    /// The paper's rule: entropy alone.
    pub fn entropy(min_entropy: f32) -> Self {
        DetailRule { min_entropy, tolerance: f64::INFINITY, margin: false }
    }

    /// Everything is refined.
    pub const EVERYTHING: DetailRule = DetailRule { min_entropy: -1.0, tolerance: 0.0, margin: true };
}

/// Which bricks need no finer ones.
///
/// The values beneath a brick are those of level 0 that it is the mean of. Where they, and with a margin those of the bricks of level 0 around them all lie within the tolerance, so do all means of them, the voxels next to the brick on its own level, and everything
/// interpolated from any of these: whatever a finer level would show inside the brick, it differs by no more than the tolerance. The range of
/// the means would not do: values that alternate have a mean without range. Entropy alone would not do either: one voxel in a hundred can
/// hold anything at 0.08 bits.
#[derive(Debug, Clone)]
pub struct Detail {
    pyramid: Pyramid,
    /// Per level from 1 on, x fastest.
    enough: Vec<Vec<bool>>,
}

impl Detail {
    /// Works the rule out for every brick of a pyramid whose values have a range. Where statistics are missing a brick is refined.
    pub fn new(
        pyramid: &Pyramid,
        range: [f64; 2],
        statistics: impl Fn(BrickKey) -> Option<BrickStatistics> + Sync,
        rule: DetailRule,
    ) -> Self {
        let spread = rule.tolerance * (range[1] - range[0]);
        let is_enough = |key: BrickKey| {
            let Some(own) = statistics(key).filter(|own| own.entropy <= rule.min_entropy) else { return false };
            if rule.tolerance == f64::INFINITY {
                return true;
            }
            let mut span = Span::of(own);
            span.within(spread)
                && beneath_and_around(pyramid, key, rule.margin).all(|near| {
                    let Some(near) = statistics(near) else { return false };
                    span = span.with(Span::of(near));
                    span.within(spread)
                })
        };
        let level = |level: u8| -> Vec<bool> {
            let keys: Vec<BrickKey> = pyramid.keys(level).collect();
            if rule.min_entropy < 0.0 { vec![false; keys.len()] } else { keys.into_par_iter().map(is_enough).collect() }
        };
        Detail { pyramid: *pyramid, enough: (1..pyramid.levels()).map(level).collect() }
    }

    /// The same for a source.
    pub fn of(source: &dyn BrickSource, rule: DetailRule) -> Self {
        Self::new(source.pyramid(), source.range(), |key| source.statistics(key), rule)
    }

    /// Whether finer bricks would show nothing more. Those of level 0 are always enough.
    pub fn is_enough(&self, key: BrickKey) -> bool {
        let Some(level) = usize::from(key.level).checked_sub(1) else { return true };
        let [nx, ny, _] = self.pyramid.bricks(key.level).map(|n| n as usize);
        let [x, y, z] = key.at.map(|at| at as usize);
        self.enough.get(level).and_then(|level| level.get((z * ny + y) * nx + x)).copied().unwrap_or(false)
    }
}

/// The bricks of level 0 beneath a brick, and with a margin those around it: as many rows as a voxel of its level takes in.
fn beneath_and_around(pyramid: &Pyramid, key: BrickKey, margin: bool) -> impl Iterator<Item = BrickKey> {
    let rows = if margin { (1u64 << key.level).div_ceil(u64::from(BRICK_EDGE)) } else { 0 };
    let counts = pyramid.bricks(0).map(u64::from);
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let [first, end] = [0, 1].map(|more| (u64::from(key.at[axis]) + more) << key.level);
        first.saturating_sub(rows) as u32..(end + rows).min(counts[axis]) as u32
    });
    z.flat_map(move |z| {
        let x = x.clone();
        y.clone().flat_map(move |y| x.clone().map(move |x| BrickKey { level: 0, at: [x, y, z] }))
    })
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

    fn of(found: BrickStatistics) -> Self {
        let [low, high] = found.range;
        let missing = found.known < 1.0;
        if low.is_nan() || high.is_nan() { Span { missing, ..Span::NONE } } else { Span { low, high, missing } }
    }

    fn with(self, other: Span) -> Span {
        Span { low: self.low.min(other.low), high: self.high.max(other.high), missing: self.missing || other.missing }
    }

    fn within(self, spread: f64) -> bool {
        self.low > self.high || self.high - self.low <= spread && !self.missing
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::GridBricks;
    use crate::volume::{Grid, GridFrame, Samples, generate::shell};

    fn grid(dims: [u32; 3], value: impl Fn(u32, u32, u32) -> f32) -> GridBricks {
        let value = &value;
        let samples: Vec<f32> =
            (0..dims[2]).flat_map(|z| (0..dims[1]).flat_map(move |y| (0..dims[0]).map(move |x| value(x, y, z)))).collect();
        let frame = GridFrame::along_axes(dims, DVec3::ZERO, DVec3::ONE);
        GridBricks::new(&Grid::new(frame, "v".into(), Samples::F32(samples.into())).expect("a grid"))
    }

    fn keys(source: &GridBricks, plane: SlicePlane, rule: DetailRule) -> Vec<BrickKey> {
        let detail = Detail::of(source, rule);
        let mut found: Vec<BrickKey> = wanted(source.pyramid(), &[plane], DVec3::ZERO, &detail, 0).iter().map(|wanted| wanted.0).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn a_flat_volume_takes_its_coarsest_brick_and_a_full_picture_all_that_are_cut() {
        // One voxel stands out, so that there is a range; it is far from the slice but not from the coarsest brick.
        let source = grid([256, 128, 128], |x, y, z| if (x, y, z) == (255, 127, 127) { 1.0 } else { 0.0 });
        let plane = SlicePlane::across(0, 3.0);
        assert_eq!(keys(&source, plane, DetailRule::EVERYTHING), source.pyramid().cut(&plane, 0));
        // Levels of 4 x 2 x 2, 2 x 1 x 1 and 1 brick: by entropy the odd voxel is overlooked, by range the coarsest brick is refined.
        let top = source.pyramid().top();
        assert_eq!(keys(&source, plane, DetailRule::entropy(0.1)), vec![top]);
        // The odd voxel lies in brick 3 along x; brick 0 of level 1 is next to brick 2 at most.
        assert_eq!(keys(&source, plane, DetailRule::default()), vec![BrickKey { level: 1, at: [0; 3] }]);
        // A slice through brick 2: brick 1 of level 1 holds the odd voxel, brick 0 is next to brick 2, where all is flat.
        let beside = grid([256, 128, 128], |x, _, _| if x == 130 { 1.0 } else { 0.0 });
        let refined = beside.pyramid().cut(&plane, 0);
        assert_eq!(keys(&beside, plane, DetailRule::default()), refined);
        assert_eq!(keys(&beside, plane, DetailRule { margin: false, ..DetailRule::default() }), vec![BrickKey { level: 1, at: [0; 3] }]);
        let flat = grid([256, 128, 128], |_, _, _| 2.0);
        assert_eq!(keys(&flat, plane, DetailRule::default()), vec![top]);
        // Where statistics cannot be read, all is refined.
        let detail = Detail::new(flat.pyramid(), [0.0, 1.0], |_| None, DetailRule::default());
        assert_eq!(wanted(flat.pyramid(), &[plane], DVec3::ZERO, &detail, 0).len(), flat.pyramid().cut(&plane, 0).len());
    }

    /// Values that alternate have means without a range: their own range would call them flat.
    #[test]
    fn what_a_mean_hides_is_refined() {
        let source = grid([128; 3], |x, y, z| ((x + y + z) % 2) as f32);
        let top = source.statistics(source.pyramid().top()).expect("statistics");
        assert!(top.entropy < 0.01, "{top:?}");
        let plane = SlicePlane::across(2, 10.0);
        assert_eq!(keys(&source, plane, DetailRule::default()), source.pyramid().cut(&plane, 0));
        // The end of what is known is no flat region either.
        let half = grid([512, 64, 64], |x, _, _| if x < 256 { 1.0 } else { f32::NAN });
        let found = keys(&half, SlicePlane::across(2, 10.0), DetailRule::default());
        assert!(
            found.contains(&BrickKey { level: 0, at: [3, 0, 0] }) && found.contains(&BrickKey { level: 0, at: [4, 0, 0] }),
            "{found:?}"
        );
    }

    /// No voxel of level 0 is farther from what stands for it than the tolerance, and every brick that is cut is covered once.
    #[test]
    fn a_picture_of_fewer_bricks_is_within_the_tolerance() {
        // The sum of two steps along x and y, and a shell in a corner: flat far from both.
        let small = shell(100).expect("a shell");
        let source = grid([460, 320, 320], |x, y, z| match [x, y, z].map(|v| v < 100) {
            // One voxel stands out, too few to be seen in the entropy.
            _ if [x, y, z] == [350, 250, 290] => 1.0,
            [true, true, true] => small.samples().get(((z * 100 + y) * 100 + x) as usize) as f32,
            _ => 0.5 * f32::from(u8::from(x > 200)),
        });
        let spread = source.range()[1] - source.range()[0];
        let pyramid = *source.pyramid();
        let mut saved = 0;
        for (axis, place) in [(0, 40.0), (1, 150.0), (2, 288.0), (0, 400.0)] {
            let plane = SlicePlane::across(axis, place);
            let found = keys(&source, plane, DetailRule::default());
            let all = pyramid.cut(&plane, 0);
            saved += all.len() - found.len();
            for &key in &all {
                let covers: Vec<BrickKey> =
                    (0..pyramid.levels()).map(|level| key.ancestor(level)).filter(|up| found.contains(up)).collect();
                assert_eq!(covers.len(), 1, "{key:?}");
                let (fine, coarse) = (source.load(key).expect("a brick"), source.load(covers[0]).expect("a brick"));
                let ranges = pyramid.voxels(key);
                for z in ranges[2].clone() {
                    for y in ranges[1].clone() {
                        for x in ranges[0].clone() {
                            let value = |brick: &crate::bricks::Brick, key: BrickKey| {
                                let [x, y, z] = [x, y, z].map(|v| ((v >> key.level) % BRICK_EDGE) as usize);
                                brick.samples.get((z * 64 + y) * 64 + x)
                            };
                            assert!((value(&fine, key) - value(&coarse, covers[0])).abs() <= spread / 255.0 + 1e-6, "{key:?} {x} {y} {z}");
                        }
                    }
                }
            }
        }
        assert!(saved > 10, "{saved}");
    }

    #[test]
    fn nearer_to_the_eye_comes_first() {
        let source = grid([256; 3], |x, _, _| x as f32);
        let detail = Detail::of(&source, DetailRule::EVERYTHING);
        let eye = DVec3::new(0.0, 300.0, 128.0);
        let found = wanted(source.pyramid(), &[SlicePlane::across(2, 100.0)], eye, &detail, 0);
        assert_eq!((found.len(), found[0].0), (16, BrickKey { level: 0, at: [0, 3, 1] }));
        assert!(found.windows(2).all(|pair| pair[0].1 >= pair[1].1));
        let coarse = wanted(source.pyramid(), &[SlicePlane::across(2, 100.0)], eye, &detail, 1);
        assert!(coarse.len() == 4 && coarse.iter().all(|wanted| wanted.0.level == 1));
    }
}
