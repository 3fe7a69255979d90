//! Our own policy: the brick that is least likely to be needed soon leaves first.

use super::EvictionPolicy;
use super::motion::Course;
use crate::bricks::{BRICK_EDGE, BrickKey, KeyMap, Pyramid, SliceSet};

/// Evicts the brick that the slices are the least likely to meet soon, by how they have moved so far.
///
/// Each slice has a rate at which it is expected to meet a brick, uses a frame: how fast it moves in the long run by the way that is left to
/// the brick ([`Course::rate`]), or, where it repeats itself, one by the frames until it comes by again. The rates of all slices add up, and
/// the smallest leaves. Distance from the nearest slice alone does not see that a brick between three slices is worth more than one that is
/// near to one, nor that slices which never move bring nothing back.
///
/// The books are plain lists: the worst sixteenth is looked for once and used up before it is looked for again.
#[derive(Debug)]
pub struct Forecast {
    pyramid: Pyramid,
    frame: u64,
    courses: Vec<Course>,
    /// Resident bricks and the frame of their last use.
    bricks: Vec<(BrickKey, u64)>,
    slots: KeyMap<usize>,
    /// Candidates with the rate that they had, the worst last.
    pool: Vec<(f32, BrickKey)>,
    /// The best rate in the pool when it was made.
    bar: f32,
    /// Evictions since then.
    taken: usize,
    made: u64,
    /// The frame in which nothing may go any more; 0 is before the first.
    spent: u64,
}

/// The rate of what the current frame uses.
const NOW: f32 = 1e6;

impl Forecast {
    /// With empty books.
    pub fn new(pyramid: &Pyramid) -> Self {
        Forecast {
            pyramid: *pyramid,
            frame: 0,
            courses: Vec::new(),
            bricks: Vec::new(),
            slots: KeyMap::default(),
            pool: Vec::new(),
            bar: 0.0,
            taken: 0,
            made: 0,
            spent: 0,
        }
    }

    /// How often a brick is expected to be used, uses a frame.
    fn rate(&self, key: BrickKey, used: u64) -> f32 {
        let middle = key.center();
        let mut rate = 0.0;
        let mut is_cut = false;
        for course in &self.courses {
            let offset = course.plane().distance(middle) / f64::from(BRICK_EDGE);
            let (one, cut) = course.rate(offset, key.voxel_size());
            rate += one;
            is_cut |= cut;
        }
        if is_cut && used + 1 >= self.frame { NOW } else { rate + 1e-9 * used as f32 / self.frame as f32 }
    }

    /// Looks for the worst bricks, of those that pass.
    fn fill_pool(&mut self, share: usize, passes: impl Fn(BrickKey) -> bool) {
        let mut all: Vec<(f32, BrickKey)> =
            self.bricks.iter().filter(|brick| passes(brick.0)).map(|&(key, used)| (self.rate(key, used), key)).collect();
        let count = (all.len() / share).max(64).min(all.len());
        if count < all.len() {
            all.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            all.truncate(count);
        }
        all.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        self.bar = all.first().map_or(0.0, |best| best.0);
        self.pool = all;
        self.taken = 0;
        self.made = self.frame;
    }

    /// Takes from the pool what may go.
    fn take(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        while let Some((_, key)) = self.pool.pop() {
            let Some(&slot) = self.slots.get(&key) else { continue };
            // What has become better than all that was looked at is left.
            if self.made != self.frame && self.rate(key, self.bricks[slot].1) > self.bar {
                continue;
            }
            if may(key) {
                self.taken += 1;
                return Some(key);
            }
        }
        None
    }
}

impl EvictionPolicy for Forecast {
    fn name(&self) -> &'static str {
        "forecast"
    }

    fn frame(&mut self, slices: &SliceSet) {
        self.frame += 1;
        self.courses.truncate(slices.planes.len());
        for (i, plane) in slices.planes.iter().enumerate() {
            match self.courses.get_mut(i) {
                Some(course) => course.follow(*plane),
                None => self.courses.push(Course::new(&self.pyramid, *plane)),
            }
        }
    }

    fn reconsider(&mut self) {
        self.spent = 0;
    }

    fn hit(&mut self, key: BrickKey) {
        if let Some(&slot) = self.slots.get(&key) {
            self.bricks[slot].1 = self.frame;
        }
    }

    fn insert(&mut self, key: BrickKey) {
        self.slots.insert(key, self.bricks.len());
        self.bricks.push((key, self.frame));
        self.spent = 0;
    }

    fn remove(&mut self, key: BrickKey) {
        if let Some(slot) = self.slots.remove(&key) {
            self.bricks.swap_remove(slot);
            if let Some(moved) = self.bricks.get(slot) {
                self.slots.insert(moved.0, slot);
            }
        }
    }

    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        if self.made != self.frame && self.taken >= (self.bricks.len() / 48).max(16) {
            self.pool.clear();
        }
        if let Some(key) = self.take(may) {
            return Some(key);
        }
        if self.spent == self.frame {
            return None;
        }
        self.fill_pool(16, |_| true);
        if let Some(key) = self.take(may) {
            return Some(key);
        }
        // Nothing of the worst may go: of the others, all that may are kept at hand.
        self.fill_pool(1, may);
        let found = self.take(may);
        if found.is_none() {
            self.spent = self.frame;
        }
        found
    }
}
