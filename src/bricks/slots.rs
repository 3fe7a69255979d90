//! Which brick is in which slot of a fixed number of them: the books of the bricks on the GPU.

use super::{BrickKey, EvictionPolicy, SliceSet};
use std::collections::HashMap;

/// Bricks by slot. What the current frame uses does not leave; of the rest a policy decides.
#[derive(Debug)]
pub struct Slots {
    policy: Box<dyn EvictionPolicy>,
    entries: HashMap<BrickKey, Entry>,
    free: Vec<u32>,
    capacity: u32,
    frame: u64,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    slot: u32,
    used: u64,
    is_kept: bool,
}

/// What [`Slots::admit`] has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Admitted {
    /// Where the brick goes.
    pub slot: u32,
    /// The one that was there.
    pub evicted: Option<BrickKey>,
}

impl Slots {
    /// So many free slots, numbered from 0.
    pub fn new(capacity: u32, policy: Box<dyn EvictionPolicy>) -> Self {
        Slots { policy, entries: HashMap::new(), free: (0..capacity).rev().collect(), capacity, frame: 0 }
    }

    /// How many slots there are.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// How many bricks there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether a brick is there.
    pub fn has(&self, key: BrickKey) -> bool {
        self.entries.contains_key(&key)
    }

    /// Begins a frame, with the slices where they are in it.
    pub fn begin(&mut self, slices: &SliceSet) {
        self.frame += 1;
        self.policy.frame(slices);
    }

    /// The current frame uses a brick; whether it is there.
    pub fn touch(&mut self, key: BrickKey) -> bool {
        let Some(entry) = self.entries.get_mut(&key) else { return false };
        if entry.used != self.frame {
            entry.used = self.frame;
            if !entry.is_kept {
                self.policy.hit(key);
            }
        }
        true
    }

    /// Takes a brick that the current frame uses, or one to be kept for good, into a free slot or that of a brick that the frame does not use.
    /// `None` if it uses everything, or the brick is there.
    pub fn admit(&mut self, key: BrickKey, is_kept: bool) -> Option<Admitted> {
        if self.has(key) {
            return None;
        }
        let (slot, evicted) = match self.free.pop() {
            Some(slot) => (slot, None),
            None => {
                let (entries, frame) = (&self.entries, self.frame);
                let may = |key: BrickKey| entries.get(&key).is_some_and(|entry| !entry.is_kept && entry.used != frame);
                let evicted = self.policy.victim(&may)?;
                let entry = self.entries.remove(&evicted)?;
                self.policy.remove(evicted);
                (entry.slot, Some(evicted))
            }
        };
        self.entries.insert(key, Entry { slot, used: self.frame, is_kept });
        if !is_kept {
            self.policy.insert(key);
        }
        Some(Admitted { slot, evicted })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::policy::Ordered;

    fn key(x: u32) -> BrickKey {
        BrickKey { level: 0, at: [x, 0, 0] }
    }

    #[test]
    fn what_is_used_or_kept_stays_and_of_the_rest_the_policy_decides() {
        let mut slots = Slots::new(3, Box::new(Ordered::lru()));
        let slices = SliceSet::default();
        slots.begin(&slices);
        assert!(!slots.touch(key(0)));
        for x in 0..3 {
            assert_eq!(slots.admit(key(x), x == 2), Some(Admitted { slot: x, evicted: None }));
        }
        assert_eq!(slots.admit(key(3), false), None, "all are in use");
        assert_eq!(slots.admit(key(1), false), None, "it is there");
        slots.begin(&slices);
        assert!(slots.touch(key(0)));
        assert_eq!(slots.admit(key(3), false), Some(Admitted { slot: 1, evicted: Some(key(1)) }), "0 is used, 2 is kept");
        assert_eq!(slots.admit(key(4), false), None);
        slots.begin(&slices);
        assert_eq!(slots.admit(key(4), false), Some(Admitted { slot: 0, evicted: Some(key(0)) }), "the least recently used");
        assert_eq!(slots.admit(key(5), false), Some(Admitted { slot: 1, evicted: Some(key(3)) }));
        assert_eq!((slots.len(), slots.has(key(2)), slots.has(key(0)), slots.capacity()), (3, true, false, 3));
    }
}
