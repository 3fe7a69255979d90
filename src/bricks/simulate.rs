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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::{Needs, SlicePlane, SliceSet, Trace};

    /// One slice across x, moved by a voxel a frame.
    fn sweep(frames: u32) -> Demand {
        let frame = |k: u32| SliceSet { planes: vec![SlicePlane::across(0, f64::from(k))], moving: Some(0) };
        Trace { name: String::new(), dims: [640, 256, 256], frames: (0..frames).map(frame).collect() }.demand(Needs::Level(0))
    }

    #[test]
    fn a_sweep_stalls_at_every_plane_of_bricks_unless_it_is_read_ahead() {
        let demand = sweep(640);
        let run = |bandwidth, prefetch| {
            let loading = Loading { capacity: 64, bandwidth, prefetch };
            simulate_loading(&demand, loading, &mut *Policy::Forecast.build(&demand.pyramid))
        };
        // 16 bricks a plane, 9 planes to come: at 4 bricks a frame four frames each lack something.
        let without = run(4, None);
        assert_eq!((without.missing_frames, without.loads), (36, 144));
        let with = run(4, Some(0));
        assert_eq!((with.missing_frames, with.loads), (0, 144));
        // Not even looking ahead helps where less is read than passed.
        assert!(run(0, Some(0)).missing_frames > 500);
    }

    #[test]
    fn two_stages_never_wait_and_read_at_rest_only() {
        let mut demand = sweep(130);
        let resting = demand.frames[129].clone();
        demand.frames.extend((0..6).map(|_| (SliceSet { moving: None, ..resting.0.clone() }, resting.1.clone())));
        let stages = simulate_stages(&demand, 64, 4, || Policy::Lru.build(&demand.pyramid));
        // One stage reads planes 0, 1 and 2 as they come; two stages read plane 2 at rest, in four frames of six.
        assert_eq!((stages.waiting_frames, stages.single_loads, stages.longest_wait), (3, 48, 4.0));
        assert_eq!((stages.two_loads, stages.resting_frames, stages.refined_frames), (16, 6, 3));
    }

    #[test]
    fn fresh_uses_are_those_of_bricks_that_the_frame_before_did_without() {
        let demand = sweep(129);
        let outcome = simulate_policy(&demand, 100, Pinning::Pinned, Policy::Lru);
        assert_eq!((outcome.fresh, outcome.fresh_hits, outcome.misses), (48, 0, 48));
        assert_eq!(outcome.missing_frames, 3);
    }
}
