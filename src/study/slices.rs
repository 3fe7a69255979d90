//! Caches of bricks measured: policies on motions of slices, loads ahead, the areas on the GPU, stages, entropy.

use crate::bricks::policy::Areas;
use crate::bricks::simulate::{Loading, Outcome, Pinning, simulate, simulate_loading, simulate_optimum, simulate_policy, simulate_stages};
use crate::bricks::{
    BRICK_EDGE, BrickKey, BrickStatistics, Demand, Detail, DetailRule, Motion, Needs, Policy, Pyramid, SlicePlane, Trace, wanted,
};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Bricks in the paper's cache.
pub const PAPER_CACHE: usize = 400;

/// The paper's volumes, by what they are called and the voxels along each edge; 4 bytes a voxel.
pub const PAPER_VOLUMES: [(&str, u32); 3] = [("0.5 GB", 512), ("4 GB", 1024), ("38 GB", 2168)];

/// Frame sets that a cache holds, in the tables of policies.
pub const RATIOS: [f64; 4] = [1.15, 1.5, 2.5, 4.0];

/// GPU cache by frame set, in the table of areas.
pub const AREA_RATIOS: [f64; 4] = [1.5, 2.0, 3.0, 4.0];

/// A policy on a trace.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolicyRow {
    /// What moved.
    pub trace: String,
    /// Frames, bricks of the largest, and bricks that the cache holds.
    pub frames: usize,
    /// See `frames`.
    pub frame_set: usize,
    /// See `frames`.
    pub capacity: usize,
    /// Whether the bricks of the current frame stayed.
    pub pinned: bool,
    /// Which policy; the last is the optimum.
    pub policy: &'static str,
    /// Hits among all uses, 0 to 1.
    pub hit_rate: f64,
    /// The same among the bricks that the frame before did not use.
    pub fresh_hit_rate: f64,
    /// Bricks loaded in a frame.
    pub misses_per_frame: f64,
    /// Bytes loaded in a frame.
    pub bytes_per_frame: f64,
    /// Share of the frames that missed something, 0 to 1.
    pub missing_frames: f64,
    /// Misses by those of the optimum.
    pub by_optimum: f64,
}

/// All policies on a trace through a cache of so many bricks, the optimum last.
pub fn try_policies(
    demand: &Demand,
    capacity: usize,
    pinning: Pinning,
    voxel_bytes: usize,
    progress: &Progress,
) -> Result<Vec<PolicyRow>, Cancelled> {
    let optimum = simulate_optimum(demand, capacity, pinning);
    let brick_bytes = (u64::from(BRICK_EDGE).pow(3) * voxel_bytes as u64) as f64;
    let row = |policy: &'static str, outcome: Outcome| PolicyRow {
        trace: demand.name.clone(),
        frames: demand.frames.len(),
        frame_set: demand.frame_set(),
        capacity,
        pinned: pinning == Pinning::Pinned,
        policy,
        hit_rate: outcome.hit_rate(),
        fresh_hit_rate: outcome.fresh_hit_rate(),
        misses_per_frame: outcome.misses_per_frame(),
        bytes_per_frame: outcome.misses_per_frame() * brick_bytes,
        missing_frames: outcome.missing_frames as f64 / outcome.frames.max(1) as f64,
        by_optimum: outcome.misses as f64 / optimum.misses.max(1) as f64,
    };
    let mut rows = Policy::ALL
        .into_par_iter()
        .map(|policy| {
            progress.check()?;
            let outcome = simulate_policy(demand, capacity, pinning, policy);
            progress.add(1);
            Ok(row(policy.name(), outcome))
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;
    rows.push(row("optimum", optimum));
    Ok(rows)
}

/// Working sets for the paper's scenario, bricks: one that leaves the cache some room, one that fills it.
pub const PAPER_SETS: [usize; 2] = [250, PAPER_CACHE];

/// The paper's scenario on a volume of so many voxels along each edge. A single stage fits its bricks into the cache, as the paper's did: it
/// takes at most `bricks` of them, near ones finer ([`Needs::AtMost`]).
pub fn paper_demand(edge: u32, motion: Motion, bricks: usize, seed: u64) -> Demand {
    let eye = DVec3::new(1.6, 1.4, 1.5) * f64::from(edge);
    motion.trace([edge; 3], 0, seed).demand(Needs::AtMost { bricks, eye })
}

/// Stalls on a trace at a speed of reading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StallRow {
    /// Bricks read during a frame.
    pub bandwidth: usize,
    /// Bricks that the cache holds.
    pub capacity: usize,
    /// Frames.
    pub frames: usize,
    /// Frames that had to show something coarser, without and with bricks loaded ahead.
    pub stalls: [usize; 2],
    /// Bricks read, without and with.
    pub loads: [u64; 2],
}

/// Slices dragged by one voxel a frame, at 60 frames a second 60 slices a second, through caches of 1.5 frame sets, read at each of the
/// bandwidths (bricks a frame), at level 0, by our own policy.
pub fn try_prefetch(demand: &Demand, bandwidths: &[usize], progress: &Progress) -> Result<Vec<StallRow>, Cancelled> {
    let capacity = demand.frame_set() * 3 / 2;
    bandwidths
        .par_iter()
        .map(|&bandwidth| {
            let run = |prefetch| -> Result<Outcome, Cancelled> {
                progress.check()?;
                let loading = Loading { capacity, bandwidth, prefetch };
                Ok(simulate_loading(demand, loading, &mut *Policy::Forecast.build(&demand.pyramid)))
            };
            let (without, with) = (run(None)?, run(Some(0))?);
            Ok(StallRow {
                bandwidth,
                capacity,
                frames: without.frames,
                stalls: [without.missing_frames, with.missing_frames],
                loads: [without.loads, with.loads],
            })
        })
        .collect()
}

/// The areas on the GPU against LRU.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AreaRow {
    /// What moved.
    pub trace: String,
    /// GPU cache by frame set.
    pub ratio: f64,
    /// Whether the bricks of the current frame stayed.
    pub pinned: bool,
    /// Hit rates of LRU and of the areas, of all uses.
    pub hit_rates: [f64; 2],
    /// The same of the bricks that the frame before did not use.
    pub fresh_hit_rates: [f64; 2],
}

/// The areas on the GPU against LRU on a trace.
pub fn try_areas(demand: &Demand, ratio: f64, pinning: Pinning) -> AreaRow {
    let capacity = (demand.frame_set() as f64 * ratio) as usize;
    let lru = simulate_policy(demand, capacity, pinning, Policy::Lru);
    let areas = simulate(demand, capacity, pinning, &mut Areas::new(&demand.pyramid, capacity));
    AreaRow {
        trace: demand.name.clone(),
        ratio,
        pinned: pinning == Pinning::Pinned,
        hit_rates: [lru.hit_rate(), areas.hit_rate()],
        fresh_hit_rates: [lru.fresh_hit_rate(), areas.fresh_hit_rate()],
    }
}

/// One stage against two.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageRow {
    /// Bricks read during a frame.
    pub bandwidth: usize,
    /// Frames.
    pub frames: usize,
    /// One stage: frames that waited, the mean and the longest wait, in frames, and bricks read.
    pub waiting_frames: usize,
    /// See `waiting_frames`.
    pub mean_wait: f64,
    /// See `waiting_frames`.
    pub longest_wait: f64,
    /// See `waiting_frames`.
    pub single_loads: u64,
    /// Two stages: bricks read, frames at rest, and those that showed all in full.
    pub two_loads: u64,
    /// See `two_loads`.
    pub resting_frames: usize,
    /// See `two_loads`.
    pub refined_frames: usize,
}

/// One stage against two on a trace, by our own policy through a cache of 1.5 frame sets.
pub fn try_stages(demand: &Demand, bandwidth: usize) -> StageRow {
    let capacity = demand.frame_set() * 3 / 2;
    let stages = simulate_stages(demand, capacity, bandwidth, || Policy::Forecast.build(&demand.pyramid));
    StageRow {
        bandwidth,
        frames: demand.frames.len(),
        waiting_frames: stages.waiting_frames,
        mean_wait: stages.mean_wait,
        longest_wait: stages.longest_wait,
        single_loads: stages.single_loads,
        two_loads: stages.two_loads,
        resting_frames: stages.resting_frames,
        refined_frames: stages.refined_frames,
    }
}

/// What a rule of detail saves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetailRow {
    /// What the rule is called.
    pub rule: &'static str,
    /// Bricks that slices take on average, those of the levels that a slice does without its rule included.
    pub bricks: f64,
    /// Bytes of them.
    pub bytes: f64,
    /// Bytes saved against refining everything, 0 to 1.
    pub saved: f64,
}

/// Bricks read to the refined pictures of slices across each axis of a volume, at so many places evenly, by several rules. Each picture counts
/// for itself, as if the cache were empty.
pub fn try_detail(
    pyramid: &Pyramid,
    range: [f64; 2],
    voxel_bytes: usize,
    statistics: impl Fn(BrickKey) -> Option<BrickStatistics> + Sync,
    places: usize,
) -> Vec<DetailRow> {
    let sound = DetailRule::default();
    let rules = [
        ("everything", DetailRule::EVERYTHING),
        ("within 1/255 everywhere", sound),
        ("within 1/255 at every voxel", DetailRule { margin: false, ..sound }),
        ("the same, whatever the entropy", DetailRule { margin: false, min_entropy: 8.0, ..sound }),
        ("entropy alone, the paper's", DetailRule::entropy(0.1)),
    ];
    let size = DVec3::from(pyramid.dims(0).map(|n| f64::from(n) - 1.0));
    let brick_bytes = (u64::from(BRICK_EDGE).pow(3) * voxel_bytes as u64) as f64;
    let mut rows: Vec<DetailRow> = Vec::new();
    for (rule, of) in rules {
        let detail = Detail::new(pyramid, range, &statistics, of);
        let mut bricks = 0;
        for axis in 0..3 {
            for k in 0..places {
                let plane = SlicePlane::across(axis, (size[axis] * (k as f64 + 0.5) / places as f64).round());
                bricks += wanted(pyramid, &[plane], size * 1.5, &detail, 0).len();
            }
        }
        let bricks = bricks as f64 / (3 * places).max(1) as f64;
        let all = rows.first().map_or(bricks, |first| first.bricks);
        rows.push(DetailRow { rule, bricks, bytes: bricks * brick_bytes, saved: 1.0 - bricks / all });
    }
    rows
}

/// What is known of the bricks of the hollow shell of [`crate::volume::generate::shell`] with `edge` voxels a side without making it: its wall ends
/// where the value rounds to 0, and lies between two spheres. A brick that may meet the wall counts as if it held everything.
pub fn shell_statistics(edge: u32, key: BrickKey) -> BrickStatistics {
    const WALL: [f64; 2] = [0.78 - 0.07 - 0.1125, 0.78 + 0.07 + 0.1125];
    let to_shell = 2.0 / (f64::from(edge) - 1.0);
    let first = (DVec3::from(key.at.map(f64::from)) * key.voxel_size() * f64::from(BRICK_EDGE)) * to_shell - 1.0;
    let last = (first + (key.voxel_size() * f64::from(BRICK_EDGE) - 1.0) * to_shell).min(DVec3::ONE);
    let nearest = DVec3::ZERO.clamp(first, last).length();
    let farthest = first.abs().max(last.abs()).length();
    match farthest < WALL[0] || nearest > WALL[1] {
        true => BrickStatistics { range: [0.0; 2], entropy: 0.0, known: 1.0 },
        false => BrickStatistics { range: [0.0, 255.0], entropy: 8.0, known: 1.0 },
    }
}

/// Slices dragged by one voxel a frame to random places, for [`try_prefetch`].
pub fn slow_scrub(dims: [u32; 3], frames: usize, seed: u64) -> Demand {
    Motion::VoxelScrub.trace(dims, frames, seed).demand(Needs::Level(0))
}

/// Each trace with the capacities of [`RATIOS`], pinned: what [`try_policies`] is asked for.
pub fn standard_demands(dims: [u32; 3], frames: usize, seed: u64) -> Vec<Demand> {
    Motion::ALL.into_par_iter().map(|(_, motion)| motion.trace(dims, frames, seed).demand(Needs::Level(0))).collect()
}

/// The voxels along each axis of the finest level whose slices take a manageable number of bricks: what motions through a volume are tried on.
pub fn replay_dims(dims: [u32; 3]) -> [u32; 3] {
    const MOST: u64 = 2500;
    let pyramid = Pyramid::new(dims);
    let largest = |level: u8| {
        let [x, y, z] = pyramid.bricks(level).map(u64::from);
        (x * y).max(y * z).max(z * x)
    };
    pyramid.dims((0..pyramid.levels()).find(|&level| largest(level) <= MOST).unwrap_or(pyramid.levels() - 1))
}

/// What a recorded trace needs: the finest level whose frames have at most so many bricks, of those that have at most 2^20 along two axes.
pub fn recorded_demand(trace: &Trace, most: usize) -> Demand {
    let pyramid = Pyramid::new(trace.dims);
    let levels = pyramid.levels();
    let mut demand = trace.demand(Needs::Level(levels - 1));
    for level in (0..levels - 1).rev() {
        let [x, y, z] = pyramid.bricks(level).map(u64::from);
        if (x * y).max(y * z).max(z * x) > 1 << 20 {
            break;
        }
        let finer = trace.demand(Needs::Level(level));
        if finer.frame_set() > most {
            break;
        }
        demand = finer;
    }
    demand
}

/// Misses by the optimum's on average and at worst, over rows of a policy.
pub fn by_optimum(rows: &[PolicyRow], policy: &str) -> (f64, f64) {
    let of: Vec<f64> = rows.iter().filter(|row| row.policy == policy).map(|row| row.by_optimum).collect();
    (of.iter().sum::<f64>() / of.len().max(1) as f64, of.iter().copied().fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::{BrickSource, GridBricks};
    use crate::volume::generate::shell;

    #[test]
    fn what_is_said_of_the_shell_holds() {
        let edge = 300;
        let source = GridBricks::new(&shell(edge).expect("a shell"));
        let mut flat = 0;
        for level in 0..source.pyramid().levels() {
            for key in source.pyramid().keys(level) {
                let (said, found) = (shell_statistics(edge, key), source.statistics(key).expect("statistics"));
                assert!(
                    said.range[0] <= found.range[0] && said.range[1] >= found.range[1] && said.entropy >= found.entropy,
                    "{key:?} {found:?}"
                );
                flat += u32::from(said.entropy == 0.0);
            }
        }
        assert!(flat > 5, "{flat}");
    }

    #[test]
    fn flat_regions_save_bricks_and_entropy_alone_saves_no_fewer() {
        let pyramid = Pyramid::new([2048; 3]);
        let rows = try_detail(&pyramid, [0.0, 255.0], 1, |key| Some(shell_statistics(2048, key)), 4);
        assert_eq!((rows[0].bricks, rows[0].saved), (1024.0, 0.0));
        assert!(rows[1].saved > 0.15 && rows.windows(2).all(|rows| rows[1].saved >= rows[0].saved) && rows[2].saved > 0.25, "{rows:?}");
    }

    #[test]
    fn every_policy_has_a_row_and_the_optimum_is_the_last() {
        let demand = Motion::Scrub.trace([320; 3], 40, 1).demand(Needs::Level(0));
        let capacity = demand.frame_set() * 3 / 2;
        let rows = try_policies(&demand, capacity, Pinning::Pinned, 4, &Progress::new()).expect("not cancelled");
        assert_eq!((rows.len(), rows[6].policy, rows[6].by_optimum), (7, "optimum", 1.0));
        assert!(rows.iter().all(|row| row.by_optimum >= 1.0 && row.bytes_per_frame == row.misses_per_frame * f64::from(1 << 20)));
        let cancelled = Progress::new();
        cancelled.cancel();
        assert!(try_policies(&demand, capacity, Pinning::Pinned, 4, &cancelled).is_err());
        assert_eq!((replay_dims([3200, 64, 3200]), replay_dims([3300, 64, 3300])), ([3200, 64, 3200], [1650, 32, 1650]));
        let recorded = recorded_demand(&Motion::Scrub.trace([1000; 3], 20, 1), 300);
        assert!(recorded.frame_set() <= 300 && recorded.frames[0].1.iter().all(|key| key.level == 1));
    }

    /// A slice through a corner takes few bricks of any level, but looking for them takes a while where there are 2^52 columns of them.
    #[test]
    fn what_a_trace_through_a_huge_volume_needs_is_found_soon() {
        let plane = SlicePlane::new(DVec3::ZERO, DVec3::ONE).expect("a plane");
        let frames = vec![crate::bricks::SliceSet { planes: vec![plane], moving: None }];
        let demand = recorded_demand(&Trace { name: String::new(), dims: [u32::MAX; 3], frames }, 300);
        assert!(demand.frames[0].1.iter().all(|key| key.level == 16), "{:?}", demand.frames[0].1);
    }
}
