//! Traces tried on policies: what each would have had to load.

mod stalls;

use super::policy::{Optimum, Policy};
use super::{BrickKey, Demand, EvictionPolicy, KeySet};
pub use stalls::{Loading, Stages, simulate_loading, simulate_stages};

/// What a policy made of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outcome {
    /// Frames.
    pub frames: usize,
    /// Bricks that were there when a frame needed them.
    pub hits: u64,
    /// Bricks that had to be loaded.
    pub misses: u64,
    /// Bricks used that the frame before did not use, and those of them that were there.
    pub fresh: u64,
    /// See [`Outcome::fresh`].
    pub fresh_hits: u64,
    /// Bricks read.
    pub loads: u64,
    /// Frames that missed at least one brick.
    pub missing_frames: usize,
}

impl Outcome {
    /// Hits among all uses, 0 to 1.
    pub fn hit_rate(&self) -> f64 {
        self.hits as f64 / (self.hits + self.misses).max(1) as f64
    }

    /// Hits among the uses of bricks that the frame before did not use: what keeping the frame before would not bring.
    pub fn fresh_hit_rate(&self) -> f64 {
        self.fresh_hits as f64 / self.fresh.max(1) as f64
    }

    /// Mean number of bricks loaded in a frame.
    pub fn misses_per_frame(&self) -> f64 {
        self.misses as f64 / self.frames.max(1) as f64
    }
}

/// Whether bricks of the current frame may be evicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pinning {
    /// They may: the textbook's cache, which sees one brick after the other.
    Plain,
    /// They may not. What does not fit beside them is loaded, drawn and forgotten.
    Pinned,
}

/// Replays what a trace needs through a cache of so many bricks that is empty at first.
pub fn simulate(demand: &Demand, capacity: usize, pinning: Pinning, policy: &mut dyn EvictionPolicy) -> Outcome {
    let mut resident: KeySet = KeySet::default();
    let mut pinned: KeySet = KeySet::default();
    let mut outcome = Outcome { frames: demand.frames.len(), ..Outcome::default() };
    let mut last: &[BrickKey] = &[];
    for (slices, needs) in &demand.frames {
        policy.frame(slices);
        if pinning == Pinning::Pinned {
            pinned.clear();
            pinned.extend(needs);
        }
        let before = outcome.misses;
        for &key in needs {
            let is_fresh = last.binary_search(&key).is_err();
            outcome.fresh += u64::from(is_fresh);
            if resident.contains(&key) {
                outcome.hits += 1;
                outcome.fresh_hits += u64::from(is_fresh);
                policy.hit(key);
                continue;
            }
            outcome.misses += 1;
            outcome.loads += 1;
            if resident.len() >= capacity {
                let Some(victim) = policy.victim(&|key| !pinned.contains(&key)) else { continue };
                policy.remove(victim);
                resident.remove(&victim);
            }
            if resident.len() < capacity {
                resident.insert(key);
                policy.insert(key);
            }
        }
        outcome.missing_frames += usize::from(outcome.misses > before);
        last = needs;
    }
    outcome
}

/// The same with a policy by its name.
pub fn simulate_policy(demand: &Demand, capacity: usize, pinning: Pinning, policy: Policy) -> Outcome {
    simulate(demand, capacity, pinning, &mut *policy.build(&demand.pyramid))
}

/// The same with the policy that knows what comes: the fewest misses that are possible.
pub fn simulate_optimum(demand: &Demand, capacity: usize, pinning: Pinning) -> Outcome {
    simulate(demand, capacity, pinning, &mut Optimum::new(demand))
}
