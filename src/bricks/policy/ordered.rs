//! The textbook policies, which look at times and counts of uses only.

use super::EvictionPolicy;
use crate::bricks::{BrickKey, KeyMap, SliceSet};
use std::collections::BTreeSet;

/// LRU, LFU or FIFO: bricks in the order of a pair of numbers, the smallest leaves first.
#[derive(Debug)]
pub struct Ordered {
    rule: Rule,
    clock: u64,
    ranks: KeyMap<Rank>,
    order: BTreeSet<(Rank, BrickKey)>,
    aside: Vec<BrickKey>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    Lru,
    Lfu,
    Fifo,
}

/// Uses, where they count, and the time of the use or the loading.
type Rank = (u64, u64);

impl Ordered {
    fn new(rule: Rule) -> Self {
        Ordered { rule, clock: 0, ranks: KeyMap::default(), order: BTreeSet::new(), aside: Vec::new() }
    }

    /// Least recently used first.
    pub fn lru() -> Self {
        Self::new(Rule::Lru)
    }

    /// Least frequently used first, counted while resident; the least recently used of equals.
    pub fn lfu() -> Self {
        Self::new(Rule::Lfu)
    }

    /// First in, first out.
    pub fn fifo() -> Self {
        Self::new(Rule::Fifo)
    }
}

impl EvictionPolicy for Ordered {
    fn name(&self) -> &'static str {
        match self.rule {
            Rule::Lru => "LRU",
            Rule::Lfu => "LFU",
            Rule::Fifo => "FIFO",
        }
    }

    fn frame(&mut self, _: &SliceSet) {
        self.reconsider();
    }

    fn reconsider(&mut self) {
        for key in self.aside.drain(..) {
            if let Some(&rank) = self.ranks.get(&key) {
                self.order.insert((rank, key));
            }
        }
    }

    fn hit(&mut self, key: BrickKey) {
        self.clock += 1;
        let Some(rank) = self.ranks.get_mut(&key) else { return };
        let old = *rank;
        *rank = match self.rule {
            Rule::Lru => (0, self.clock),
            Rule::Lfu => (old.0 + 1, self.clock),
            Rule::Fifo => old,
        };
        let new = *rank;
        // What was put aside stays there until the next frame.
        if new != old && self.order.remove(&(old, key)) {
            self.order.insert((new, key));
        }
    }

    fn insert(&mut self, key: BrickKey) {
        self.clock += 1;
        let rank = (u64::from(self.rule == Rule::Lfu), self.clock);
        if let Some(old) = self.ranks.insert(key, rank) {
            self.order.remove(&(old, key));
        }
        self.order.insert((rank, key));
    }

    fn remove(&mut self, key: BrickKey) {
        if let Some(rank) = self.ranks.remove(&key) {
            self.order.remove(&(rank, key));
        }
    }

    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        while let Some(&(rank, key)) = self.order.first() {
            if may(key) {
                return Some(key);
            }
            self.order.remove(&(rank, key));
            self.aside.push(key);
        }
        None
    }
}
