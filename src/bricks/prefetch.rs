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
    /// first, then by the time until they are met. A slice that rests or turns is not looked ahead.
    pub fn next(&mut self, pyramid: &Pyramid, slices: &SliceSet, level: u8) -> Vec<BrickKey> {
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
        let mut steps: Vec<(f64, SlicePlane)> = Vec::new();
        for (plane, &Motion { speed, .. }) in slices.planes.iter().zip(&self.motions) {
            if speed == 0.0 {
                continue;
            }
            let reach = (speed.abs() * Self::FRAMES).clamp(Self::BRICKS[0] * pitch, Self::BRICKS[1] * pitch);
            let half_bricks = (reach / (pitch / 2.0)).ceil() as u32;
            steps.extend((0..=half_bricks).map(|k| {
                let distance = f64::from(k) * pitch / 2.0;
                let point = plane.point + plane.normal * distance.copysign(speed);
                (distance / speed.abs(), SlicePlane { point, ..*plane })
            }));
        }
        steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut seen = KeySet::default();
        steps.iter().flat_map(|(_, plane)| pyramid.cut(plane, level)).filter(|&key| seen.insert(key)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead(places: &[f64]) -> Vec<u32> {
        let pyramid = Pyramid::new([640, 64, 64]);
        let mut ahead = Ahead::default();
        let at = |x: f64| SliceSet { planes: vec![SlicePlane::across(0, x)], moving: Some(0) };
        let found = places.iter().map(|&x| ahead.next(&pyramid, &at(x), 0)).last().unwrap_or_default();
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
        ahead.next(&pyramid, &at(96.0, 96.0), 0);
        let found = ahead.next(&pyramid, &at(97.0, 104.0), 0);
        let first = |key: &BrickKey| found.iter().position(|found| found == key).expect("a brick ahead");
        // Both rows of bricks begin half a brick away: the second slice is there in 4 frames, the first in 32.
        let (x, y) = (BrickKey { level: 0, at: [2, 5, 0] }, BrickKey { level: 0, at: [5, 2, 0] });
        assert!(first(&y) < first(&x));
    }
}
