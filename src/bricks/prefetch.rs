//! The bricks that slices in motion will meet next: [`Ahead`].

use super::{BRICK_EDGE, BrickKey, KeySet, Pyramid, SlicePlane, SliceSet};

/// Looks ahead along the motion of slices, from one frame to the next.
#[derive(Debug, Clone, Default)]
pub struct Ahead {
    before: Vec<SlicePlane>,
    motions: Vec<Motion>,
}

/// How a slice moves.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    /// Voxels of level 0 in a frame, along its normal.
    speed: f64,
    /// Frames since it last moved.
    still: u32,
}

impl Ahead {
    /// How many frames of its motion a slice is looked ahead.
    const FRAMES: f64 = 60.0;
    /// How many bricks at least and at most.
    const BRICKS: [f64; 2] = [1.0, 3.0];
    /// A slice that has not moved for so many frames rests: a hand stops for a frame or two, and goes on.
    const REST: u32 = 10;

    /// The bricks of a level that the slices need here and next, where they move as they moved since the call before: those of this frame
    /// first, then by the time until they are met. A slice that rests or turns is not looked ahead. Only what `shows` says is taken; it must
    /// be true for all coarser bricks above one for which it is.
    pub fn next(&mut self, pyramid: &Pyramid, slices: &SliceSet, level: u8, shows: &dyn Fn(BrickKey) -> bool) -> Vec<BrickKey> {
        self.motions.resize(slices.planes.len(), Motion::default());
        for (i, (plane, motion)) in slices.planes.iter().zip(&mut self.motions).enumerate() {
            let step = match self.before.get(i) {
                Some(before) if before.normal.dot(plane.normal) > 1.0 - 1e-9 => before.distance(plane.point),
                _ => {
                    *motion = Motion::default();
                    continue;
                }
            };
            *motion = match (step != 0.0, motion.still + 1) {
                (true, _) => Motion { speed: step, still: 0 },
                (false, still) if still < Self::REST => Motion { still, ..*motion },
                (false, _) => Motion::default(),
            };
        }
        self.before.clone_from(&slices.planes);
        let pitch = f64::from(BRICK_EDGE) * f64::from(level).exp2();
        let mut found: Vec<(f64, BrickKey)> = Vec::new();
        for (plane, &Motion { speed, .. }) in slices.planes.iter().zip(&self.motions) {
            if speed == 0.0 {
                continue;
            }
            let reach = (speed.abs() * Self::FRAMES).clamp(Self::BRICKS[0] * pitch, Self::BRICKS[1] * pitch);
            // From where the slice is to where it will be, through the bricks that are met on the way, from the coarsest down.
            let way = |key: BrickKey| plane.distance(key.center()) * speed.signum();
            let mut open = vec![pyramid.top()];
            while let Some(key) = open.pop() {
                let half = half_width(plane, key);
                let way = way(key);
                if !(way > -half && way < reach + half && shows(key)) {
                    continue;
                }
                if key.level <= level {
                    found.push(((way - half).max(0.0) / speed.abs(), key));
                } else {
                    open.extend(pyramid.children(key));
                }
            }
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut seen = KeySet::default();
        found.into_iter().map(|found| found.1).filter(|&key| seen.insert(key)).collect()
    }
}

/// How far a brick reaches along the normal of a slice from its middle, as [`Pyramid::cut`] has it.
fn half_width(plane: &SlicePlane, key: BrickKey) -> f64 {
    (f64::from(BRICK_EDGE) + 1.0) / 2.0 * key.voxel_size() * plane.normal.abs().element_sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::wanted::meets as plane_meets;
    use glam::DVec3;

    fn ahead(places: &[f64]) -> Vec<u32> {
        let pyramid = Pyramid::new([640, 64, 64]);
        let mut ahead = Ahead::default();
        let at = |x: f64| SliceSet { planes: vec![SlicePlane::across(0, x)], moving: Some(0) };
        let found = places.iter().map(|&x| ahead.next(&pyramid, &at(x), 0, &|_| true)).last().unwrap_or_default();
        found.iter().map(|key| key.at[0]).collect()
    }

    #[test]
    fn what_lies_ahead_comes_by_the_time_until_it_is_met() {
        // A voxel a frame for 60 frames: one brick. Eight: three at most.
        assert_eq!(ahead(&[300.0, 301.0]), [4, 5]);
        assert_eq!(ahead(&[300.0, 299.0]), [4, 3]);
        assert_eq!(ahead(&[300.0, 308.0]), [4, 5, 6, 7]);
        // At the end of the volume nothing is ahead; at rest nothing is looked for, though a hand may stop for a moment.
        assert_eq!(ahead(&[620.0, 628.0]), [9]);
        assert_eq!(ahead(&[300.0]), [0; 0]);
        assert_eq!(ahead(&[300.0, 301.0, 301.0]), [4, 5]);
        assert_eq!(ahead(&[[300.0].repeat(2), [301.0].repeat(11)].concat()), [0; 0]);
    }

    #[test]
    fn of_two_slices_the_faster_one_is_served_first() {
        let pyramid = Pyramid::new([640, 640, 64]);
        let mut ahead = Ahead::default();
        let at = |x: f64, y: f64| SliceSet { planes: vec![SlicePlane::across(0, x), SlicePlane::across(1, y)], moving: None };
        ahead.next(&pyramid, &at(96.0, 96.0), 0, &|_| true);
        let found = ahead.next(&pyramid, &at(97.0, 104.0), 0, &|_| true);
        let first = |key: &BrickKey| found.iter().position(|found| found == key).expect("a brick ahead");
        // Both rows of bricks begin half a brick away: the second slice is there in 4 frames, the first in 32.
        let (x, y) = (BrickKey { level: 0, at: [2, 5, 0] }, BrickKey { level: 0, at: [5, 2, 0] });
        assert!(first(&y) < first(&x));
    }

    /// What a search through all bricks of all places on the way finds, of what is shown.
    #[test]
    fn what_is_shown_of_what_lies_ahead_is_found_from_the_top() {
        let pyramid = Pyramid::new([700, 500, 300]);
        let is_shown = |key: BrickKey| {
            let low = key.first() - key.voxel_size();
            low.x < 400.0 && low.y + 65.0 * key.voxel_size() > 100.0
        };
        for normal in [DVec3::X, -DVec3::Y, DVec3::new(0.3, -0.7, 0.2), DVec3::ONE] {
            for (level, speed) in [(0, 2.0), (0, -1.0), (1, 4.0)] {
                let at = |k: f64| {
                    let plane = SlicePlane::new(DVec3::new(350.0, 250.0, 150.0), normal).expect("a plane");
                    SlicePlane { point: plane.point + plane.normal * k, ..plane }
                };
                let mut ahead = Ahead::default();
                let slices = |k: f64| SliceSet { planes: vec![at(k)], moving: Some(0) };
                ahead.next(&pyramid, &slices(-speed), level, &is_shown);
                let mut found = ahead.next(&pyramid, &slices(0.0), level, &is_shown);
                let reach = (speed * 60.0).abs().clamp(f64::from(64 << level), f64::from(192 << level));
                assert!(found.iter().take(3).all(|&key| plane_meets(&at(0.0), key)), "{normal} {speed}");
                let mut all: Vec<BrickKey> =
                    (0..=200).flat_map(|k| pyramid.cut(&at(reach.copysign(speed) * f64::from(k) / 200.0), level)).collect();
                all.retain(|&key| is_shown(key));
                all.sort_unstable();
                all.dedup();
                found.sort_unstable();
                assert_eq!(found, all, "{normal} {speed}");
                assert!(!found.is_empty());
            }
        }
    }

    /// A picture of a few bricks of a volume of 2^36 costs what it shows.
    #[test]
    fn what_no_picture_shows_costs_nothing() {
        let pyramid = Pyramid::new([u32::MAX; 3]);
        let middle = f64::from(1u32 << 31);
        let is_shown = |key: BrickKey| {
            let (low, high) = (key.first() - key.voxel_size(), key.first() + 64.0 * key.voxel_size());
            (1..3).all(|axis| low[axis] < middle + 100.0 && high[axis] > middle)
        };
        let mut ahead = Ahead::default();
        let asked = std::cell::Cell::new(0);
        let mut next = |x: f64| {
            let slices = SliceSet { planes: vec![SlicePlane::across(0, middle + x)], moving: Some(0) };
            ahead.next(&pyramid, &slices, 0, &|key| {
                asked.set(asked.get() + 1);
                is_shown(key)
            })
        };
        next(0.0);
        let found = next(8.0);
        assert!((12..=64).contains(&found.len()) && asked.get() < 2000, "{} {}", found.len(), asked.get());
    }
}
