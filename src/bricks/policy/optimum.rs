//! What no policy can beat: [`Optimum`].

use super::EvictionPolicy;
use crate::bricks::{BrickKey, Demand, KeyMap, SliceSet};
use std::collections::BTreeSet;

/// Evicts the brick that is used again the latest (Belady 1966): it knows the frames to come, so it serves recorded traces only.
#[derive(Debug)]
pub struct Optimum {
    /// The frames that use each brick.
    uses: KeyMap<Vec<u32>>,
    /// The current frame and one more; 0 before the first.
    frame: u32,
    next: KeyMap<u32>,
    order: BTreeSet<(u32, BrickKey)>,
    aside: Vec<BrickKey>,
}

impl Optimum {
    /// The optimum for what is about to be replayed from its first frame.
    pub fn new(demand: &Demand) -> Self {
        let mut uses: KeyMap<Vec<u32>> = KeyMap::default();
        for (frame, (_, needs)) in (1..).zip(&demand.frames) {
            for &key in needs {
                uses.entry(key).or_default().push(frame);
            }
        }
        Optimum { uses, frame: 0, next: KeyMap::default(), order: BTreeSet::new(), aside: Vec::new() }
    }

    fn used(&mut self, key: BrickKey) {
        let uses = self.uses.get(&key).map_or(&[][..], |uses| uses);
        let next = uses.get(uses.partition_point(|&frame| frame <= self.frame)).copied().unwrap_or(u32::MAX);
        if let Some(old) = self.next.insert(key, next) {
            // What was put aside stays there until the next frame.
            if !self.order.remove(&(old, key)) {
                return;
            }
        }
        self.order.insert((next, key));
    }
}

impl EvictionPolicy for Optimum {
    fn name(&self) -> &'static str {
        "optimum"
    }

    fn frame(&mut self, _: &SliceSet) {
        self.frame += 1;
        self.reconsider();
    }

    fn reconsider(&mut self) {
        for key in self.aside.drain(..) {
            if let Some(&next) = self.next.get(&key) {
                self.order.insert((next, key));
            }
        }
    }

    fn hit(&mut self, key: BrickKey) {
        self.used(key);
    }

    fn insert(&mut self, key: BrickKey) {
        self.used(key);
    }

    fn remove(&mut self, key: BrickKey) {
        if let Some(next) = self.next.remove(&key) {
            self.order.remove(&(next, key));
        }
    }

    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        while let Some(&(next, key)) = self.order.last() {
            if may(key) {
                return Some(key);
            }
            self.order.remove(&(next, key));
            self.aside.push(key);
        }
        None
    }
}
