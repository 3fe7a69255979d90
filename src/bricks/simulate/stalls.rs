//! Loads that take time: frames that stall, with and without looking ahead.

use super::Outcome;
use crate::bricks::policy::EvictionPolicy;
use crate::bricks::prefetch::Ahead;
use crate::bricks::{BrickKey, Demand, KeySet};

/// How loads are simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loading {
    /// Bricks that the cache holds.
    pub capacity: usize,
    /// Bricks that can be read during a frame.
    pub bandwidth: usize,
    /// Whether the bricks along the motion of slices are read ahead, at this level, when nothing visible is left to be read.
    pub prefetch: Option<u8>,
}

/// Replays what a trace needs through a cache that reads so many bricks a frame, those of the current frame first. A frame shows what was there
/// when it began: one that lacks a brick stalls (`missing_frames`). What was not begun in its frame is dropped. The bricks of the first frame
/// are there at the beginning. A brick counts as missed in every frame that lacks it.
pub fn simulate_loading(demand: &Demand, loading: Loading, policy: &mut dyn EvictionPolicy) -> Outcome {
    let Loading { capacity, bandwidth, prefetch } = loading;
    let mut resident = KeySet::default();
    let mut ahead = Ahead::default();
    let mut outcome = Outcome { frames: demand.frames.len(), ..Outcome::default() };
    for (i, (slices, needs)) in demand.frames.iter().enumerate() {
        policy.frame(slices);
        if i == 0 {
            for &key in needs.iter().take(capacity) {
                resident.insert(key);
                policy.insert(key);
            }
        }
        let needed: KeySet = needs.iter().copied().collect();
        let mut queue: Vec<BrickKey> = Vec::new();
        for &key in needs {
            match resident.contains(&key) {
                true => policy.hit(key),
                false => queue.push(key),
            }
        }
        outcome.misses += queue.len() as u64;
        outcome.hits += (needs.len() - queue.len()) as u64;
        outcome.missing_frames += usize::from(!queue.is_empty());
        let next = prefetch.map_or(Vec::new(), |level| ahead.next(&demand.pyramid, slices, level, &|_| true));
        // As in the cache: what is read ahead takes no more than half of what the frame leaves.
        let room = capacity.saturating_sub(needs.len()) / 2;
        let coming: KeySet = next.iter().filter(|key| !needed.contains(key)).take(room).copied().collect();
        queue.extend(next.into_iter().filter(|key| coming.contains(key) && !resident.contains(key)));
        for key in queue.into_iter().take(bandwidth) {
            if resident.len() >= capacity {
                let Some(victim) = policy.victim(&|key| !needed.contains(&key) && !coming.contains(&key)) else { continue };
                policy.remove(victim);
                resident.remove(&victim);
            }
            resident.insert(key);
            policy.insert(key);
            outcome.loads += 1;
        }
    }
    outcome
}

/// What one stage and two stages make of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stages {
    /// One stage: frames that wait for bricks, and how long they wait: on average over all frames, and the longest, in frames.
    pub waiting_frames: usize,
    /// Mean wait of a frame.
    pub mean_wait: f64,
    /// Longest wait of a frame.
    pub longest_wait: f64,
    /// Bricks that one stage reads.
    pub single_loads: u64,
    /// Bricks that two stages read: nothing while a slice moves, what fits into the time while all rest.
    pub two_loads: u64,
    /// Frames at rest, and those of them that were refined in full.
    pub resting_frames: usize,
    /// Frames at rest that show all that they need.
    pub refined_frames: usize,
}

/// Compares one stage, where every frame waits for the bricks that it needs, with two, where frames never wait and bricks are read only while
/// all slices rest; at so many bricks in the time of a frame, through caches of the same capacity.
pub fn simulate_stages(demand: &Demand, capacity: usize, bandwidth: usize, policy: impl Fn() -> Box<dyn EvictionPolicy>) -> Stages {
    let mut stages = Stages::default();
    let mut caches = [(KeySet::default(), policy()), (KeySet::default(), policy())];
    for (slices, needs) in &demand.frames {
        let needed: KeySet = needs.iter().copied().collect();
        let rests = slices.moving.is_none();
        for (i, (resident, policy)) in caches.iter_mut().enumerate() {
            policy.frame(slices);
            let missing: Vec<BrickKey> = needs.iter().copied().filter(|key| !resident.contains(key)).collect();
            needs.iter().filter(|key| resident.contains(key)).for_each(|&key| policy.hit(key));
            let loads = match (i, rests) {
                (0, _) => missing.len(),
                (_, true) => missing.len().min(bandwidth),
                (_, false) => 0,
            };
            for &key in &missing[..loads] {
                if resident.len() >= capacity {
                    let Some(victim) = policy.victim(&|key| !needed.contains(&key)) else { continue };
                    policy.remove(victim);
                    resident.remove(&victim);
                }
                resident.insert(key);
                policy.insert(key);
            }
            if i == 0 {
                let wait = loads as f64 / bandwidth.max(1) as f64;
                stages.waiting_frames += usize::from(loads > 0);
                stages.mean_wait += wait / demand.frames.len() as f64;
                stages.longest_wait = stages.longest_wait.max(wait);
                stages.single_loads += loads as u64;
            } else {
                stages.two_loads += loads as u64;
                stages.resting_frames += usize::from(rests);
                stages.refined_frames += usize::from(rests && missing.len() == loads);
            }
        }
    }
    stages
}
