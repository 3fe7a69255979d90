//! Which bricks leave the GPU: the three areas of textures of the multi-slice paper.

use super::{BrickKey, SlicePlane};
use std::collections::HashMap;

/// Where a resident brick stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Area {
    /// Always resident: the coarse levels that everything falls back to.
    Kept,
    /// Used in several successive frames.
    Stable,
    /// Used in the current frame, for not as long.
    Active,
    /// Not used in the current frame: what may leave.
    Unused,
}

/// Bricks by slot. A brick that comes goes to [`Area::Active`]; used so many frames in a row it goes to [`Area::Stable`]; a frame that does
/// not use it takes it to [`Area::Unused`], whence a use brings it back to Active. From Unused the one of the highest score leaves. What the
/// current frame uses never does.
#[derive(Debug, Clone)]
pub struct Areas {
    entries: HashMap<BrickKey, Entry>,
    free: Vec<u32>,
    capacity: u32,
    frame: u64,
    hits_to_stable: u32,
    /// Uses of bricks that were resident, and of those that were not.
    counts: [u64; 2],
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    slot: u32,
    hits: u32,
    used: u64,
    is_kept: bool,
}

/// What [`Areas::admit`] has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Admitted {
    /// Where the brick goes.
    pub slot: u32,
    /// The one that was there.
    pub evicted: Option<BrickKey>,
}

impl Areas {
    /// Frames in a row after which a brick is stable.
    pub const HITS_TO_STABLE: u32 = 3;

    /// Areas over `capacity` free slots, numbered from 0.
    pub fn new(capacity: u32) -> Self {
        let free = (0..capacity).rev().collect();
        Areas { entries: HashMap::new(), free, capacity, frame: 0, hits_to_stable: Self::HITS_TO_STABLE, counts: [0; 2] }
    }

    /// How many slots there are.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// How many bricks are resident.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Uses of bricks that were resident, and of those that were not, since the beginning.
    pub fn counts(&self) -> [u64; 2] {
        self.counts
    }

    /// Begins a frame: what it does not use is unused.
    pub fn begin(&mut self) {
        self.frame += 1;
    }

    /// The current frame uses a brick; whether it is resident.
    pub fn touch(&mut self, key: BrickKey) -> bool {
        let Some(entry) = self.entries.get_mut(&key) else {
            self.counts[1] += 1;
            return false;
        };
        self.counts[0] += 1;
        if entry.used != self.frame {
            entry.hits = if entry.used + 1 == self.frame { entry.hits.saturating_add(1) } else { 0 };
            entry.used = self.frame;
        }
        true
    }

    /// Where a brick stands; `None` if it is not resident.
    pub fn area(&self, key: BrickKey) -> Option<Area> {
        let entry = self.entries.get(&key)?;
        Some(match entry {
            Entry { is_kept: true, .. } => Area::Kept,
            Entry { used, .. } if *used != self.frame => Area::Unused,
            Entry { hits, .. } if *hits >= self.hits_to_stable => Area::Stable,
            _ => Area::Active,
        })
    }

    /// Whether a brick is resident.
    pub fn has(&self, key: BrickKey) -> bool {
        self.entries.contains_key(&key)
    }

    /// Takes a brick that the current frame uses, or one to be kept for good, into a free slot or that of the unused one of the highest score.
    /// `None` if the current frame uses everything, or the brick is there.
    pub fn admit(&mut self, key: BrickKey, is_kept: bool, score: impl Fn(BrickKey) -> f64) -> Option<Admitted> {
        if self.has(key) {
            return None;
        }
        let (slot, evicted) = match self.free.pop() {
            Some(slot) => (slot, None),
            None => {
                let unused = self.entries.iter().filter(|(_, entry)| !entry.is_kept && entry.used != self.frame);
                // Equal scores are told apart by use and by name, so that the same moves evict the same bricks.
                let scored = unused.map(|(&key, entry)| (score(key), std::cmp::Reverse(entry.used), key, entry.slot));
                let worst = scored.max_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))))?;
                self.entries.remove(&worst.2);
                (worst.3, Some(worst.2))
            }
        };
        self.entries.insert(key, Entry { slot, hits: 0, used: self.frame, is_kept });
        Some(Admitted { slot, evicted })
    }
}

/// The paper's priority of leaving the GPU: `min(1.5 d_stand, d_mov) + 2 L`. The distances of the brick's middle to the nearest resting slice
/// and to the moving one are in bricks of level 0; L is 0 at the coarsest level.
pub fn score(key: BrickKey, levels: u8, planes: &[SlicePlane], moving: Option<usize>) -> f64 {
    const RESTING: f64 = 1.5;
    const LEVEL: f64 = 2.0;
    let center = key.center();
    let distances = planes.iter().enumerate().map(|(i, plane)| {
        let distance = plane.distance(center).abs() / f64::from(super::BRICK_EDGE);
        if moving == Some(i) { distance } else { RESTING * distance }
    });
    let nearest = distances.fold(f64::INFINITY, f64::min);
    let nearest = if nearest.is_finite() { nearest } else { 0.0 };
    nearest + LEVEL * f64::from(levels.saturating_sub(1).saturating_sub(key.level))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(x: u32) -> BrickKey {
        BrickKey { level: 0, at: [x, 0, 0] }
    }

    #[test]
    fn uses_in_a_row_make_stable_and_a_miss_makes_unused() {
        let mut areas = Areas::new(2);
        areas.begin();
        assert!(!areas.touch(key(0)));
        assert_eq!(areas.admit(key(0), false, |_| 0.0), Some(Admitted { slot: 0, evicted: None }));
        assert_eq!(areas.area(key(0)), Some(Area::Active));
        for _ in 0..Areas::HITS_TO_STABLE {
            areas.begin();
            assert_eq!(areas.area(key(0)), Some(Area::Unused), "until it is used");
            assert!(areas.touch(key(0)) && areas.touch(key(0)), "twice in a frame counts once");
        }
        assert_eq!(areas.area(key(0)), Some(Area::Stable));
        areas.begin();
        areas.begin();
        areas.touch(key(0));
        assert_eq!(areas.area(key(0)), Some(Area::Active), "a frame without it begins anew");
        assert_eq!(areas.counts(), [2 * u64::from(Areas::HITS_TO_STABLE) + 1, 1]);
    }

    #[test]
    fn the_unused_brick_of_the_highest_score_leaves_and_used_ones_never() {
        let mut areas = Areas::new(3);
        areas.begin();
        for x in 0..3 {
            areas.admit(key(x), x == 2, |_| 0.0).expect("room");
        }
        assert_eq!(areas.admit(key(3), false, |_| 0.0), None, "all are in use");
        areas.begin();
        areas.touch(key(0));
        let by_place = |key: BrickKey| f64::from(key.at[0]);
        assert_eq!(areas.admit(key(3), false, by_place), Some(Admitted { slot: 1, evicted: Some(key(1)) }), "2 is kept, 0 is used");
        assert_eq!(areas.admit(key(4), false, by_place), None);
        assert_eq!(areas.admit(key(3), false, by_place), None, "it is there");
        areas.begin();
        assert_eq!(areas.admit(key(4), false, by_place).and_then(|a| a.evicted), Some(key(3)));
        assert_eq!((areas.len(), areas.area(key(2)), areas.area(key(1))), (3, Some(Area::Kept), None));
    }

    #[test]
    fn what_is_far_and_fine_leaves_first() {
        let planes = [SlicePlane::across(0, 0.0), SlicePlane::across(0, 640.0)];
        let near = |x, level, moving| score(BrickKey { level, at: [x, 0, 0] }, 3, &planes, moving);
        // The middles of the bricks lie half a brick, less half a voxel, beyond their beginnings.
        let half = 31.5 / 64.0;
        assert_eq!(near(1, 0, None), 1.5 * (1.0 + half) + 4.0);
        assert_eq!(near(1, 0, Some(0)), 1.0 + half + 4.0);
        assert_eq!(near(9, 0, Some(1)), 0.5 + 0.5 / 64.0 + 4.0);
        assert_eq!(near(0, 2, None), 1.5 * (127.5 / 64.0), "no share for the coarsest level");
        assert_eq!(score(key(5), 1, &[], None), 0.0);
    }
}
