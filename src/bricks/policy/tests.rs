use super::*;
use crate::bricks::simulate::{Pinning, simulate, simulate_optimum, simulate_policy};
use crate::bricks::trace::Random;
use crate::bricks::{Demand, KeySet, Motion, Needs, SlicePlane};
use proptest::prelude::*;

fn brick(x: u32) -> BrickKey {
    BrickKey { level: 0, at: [x, 0, 0] }
}

/// Frames that need the named bricks of a row, no slices.
fn demand(frames: &[&[u32]]) -> Demand {
    let frame = |needs: &&[u32]| (SliceSet::default(), needs.iter().map(|&x| brick(x)).collect());
    Demand { name: String::new(), pyramid: Pyramid::new([64 * 32, 64, 64]), frames: frames.iter().map(frame).collect() }
}

#[test]
fn a_loop_longer_than_the_cache_misses_always_under_lru_and_the_textbooks_share_under_the_optimum() {
    // n bricks in turn through a cache of c: the optimum misses n - c + (c - 1) ... (n - c) / (n - 1) of the uses, once it is full.
    let (n, c, rounds) = (10u32, 6usize, 90usize);
    let each: Vec<[u32; 1]> = (0..n).cycle().take(n as usize * rounds).map(|x| [x]).collect();
    let frames: Vec<&[u32]> = each.iter().map(|x| &x[..]).collect();
    let demand = demand(&frames);
    for policy in [Policy::Lru, Policy::Fifo] {
        assert_eq!(simulate_policy(&demand, c, Pinning::Plain, policy).hits, 0, "{policy:?}");
    }
    let optimum = simulate_optimum(&demand, c, Pinning::Plain);
    let share = (optimum.misses as f64 - f64::from(n)) / (f64::from(n) * (rounds as f64 - 1.0));
    assert!((share - (10.0 - 6.0) / 9.0).abs() < 0.01, "{share}");
}

#[test]
fn the_textbook_policies_evict_what_the_textbook_says() {
    // The cache holds 0, 1, 2; 0 is used again, and again; 1 once more; what leaves for 3?
    let frames: [&[u32]; 7] = [&[0], &[1], &[2], &[0], &[0], &[1], &[3]];
    let left = |policy: Policy| {
        let mut policy = policy.build(&Pyramid::new([64 * 32, 64, 64]));
        let mut seen = KeySet::default();
        for frame in &frames[..6] {
            policy.frame(&SliceSet::default());
            let key = brick(frame[0]);
            if seen.insert(key) { policy.insert(key) } else { policy.hit(key) }
        }
        policy.frame(&SliceSet::default());
        policy.victim(&|_| true).map(|key| key.at[0])
    };
    assert_eq!((left(Policy::Lru), left(Policy::Lfu), left(Policy::Fifo)), (Some(2), Some(2), Some(0)));
}

#[test]
fn equation_3_with_the_papers_constants() {
    let pyramid = Pyramid::new([64 * 16; 3]);
    let slices = SliceSet { planes: vec![SlicePlane::across(0, 31.5), SlicePlane::across(1, 31.5)], moving: Some(1) };
    let params = MdfoParams::default();
    // Middle at 31.5 + 64 (5, 8, 0), level 4 of the paper's: 5 min(1.5 x 5, 8) + 10 x 4 + 7.
    let key = BrickKey { level: 0, at: [5, 8, 0] };
    assert_eq!(params.priority(&pyramid, &slices, key, 7), 37.5 + 40.0 + 7.0);
    // The middle of the brick of level 1 lies half a brick of level 0 farther: 5 min(1.5 x 4.5, 8.5) + 30.
    let coarse = BrickKey { level: 1, at: [2, 4, 0] };
    assert_eq!(params.priority(&pyramid, &slices, coarse, 0), 33.75 + 30.0);
    assert_eq!(MdfoParams::GPU.priority(&pyramid, &slices, key, 7), 7.5 + 8.0);
}

/// Bounds that are worked out lazily find what a search through all finds.
#[test]
fn mdfo_evicts_the_largest_priority_of_all() {
    let pyramid = Pyramid::new([64 * 8; 3]);
    for (params, motion) in
        [(MdfoParams::default(), Motion::Scrub), (MdfoParams::DISTANCE, Motion::Jump), (MdfoParams::default(), Motion::Oblique)]
    {
        let trace = motion.trace([64 * 8; 3], 120, 3);
        let mut policy = Mdfo::new(&pyramid, params);
        let mut random = Random::new(5);
        let mut used: Vec<(BrickKey, u64)> = Vec::new();
        for (frame, slices) in (1u64..).zip(&trace.frames) {
            policy.frame(slices);
            for _ in 0..6 {
                let key =
                    BrickKey { level: random.below(2) as u8, at: [random.below(4) as u32, random.below(4) as u32, random.below(4) as u32] };
                match used.iter_mut().find(|entry| entry.0 == key) {
                    Some(entry) => {
                        entry.1 = frame;
                        policy.hit(key);
                    }
                    None => {
                        used.push((key, frame));
                        policy.insert(key);
                    }
                }
            }
            while used.len() > 40 {
                let victim = policy.victim(&|key| key.at[0] != 3).expect("one that may leave");
                let priority = |&(key, last): &(BrickKey, u64)| params.priority(&pyramid, slices, key, frame - last);
                let most = used.iter().filter(|entry| entry.0.at[0] != 3).map(priority).fold(f64::NEG_INFINITY, f64::max);
                let i = used.iter().position(|entry| entry.0 == victim).expect("a resident brick");
                assert!((priority(&used[i]) - most).abs() < 1e-6, "{motion:?}, frame {frame}: {} of {most}", priority(&used[i]));
                policy.remove(victim);
                used.swap_remove(i);
            }
        }
    }
}

/// Planes far beside the volume, as no picture has them: nothing panics, and nothing is worse afterwards.
#[test]
fn a_slice_far_outside_breaks_no_policy() {
    let pyramid = Pyramid::new([256; 3]);
    let oblique = |at: f64| SlicePlane { point: glam::DVec3::splat(at), normal: glam::DVec3::ONE.normalize() };
    for far in [1e13, -1e19, 1e300, f64::MAX] {
        for policy in Policy::ALL {
            let mut policy = policy.build(&pyramid);
            for frame in 0..80u32 {
                let plane = |at: f64| if frame < 40 { SlicePlane::across(0, at) } else { oblique(at) };
                let at = plane(if frame % 2 == 0 { 10.0 } else { far });
                policy.frame(&SliceSet { planes: vec![at, SlicePlane::across(1, 0.0)], moving: Some(0) });
                policy.insert(brick(frame % 4));
                policy.victim(&|key| key != brick(1));
                policy.remove(brick(frame % 4));
            }
            for x in 0..4 {
                policy.insert(brick(x));
                policy.frame(&SliceSet { planes: vec![oblique(10.0), SlicePlane::across(1, 0.0)], moving: Some(0) });
            }
            let left = std::iter::from_fn(|| policy.victim(&|_| true).inspect(|&key| policy.remove(key))).count();
            assert_eq!(left, 4, "{} {far}", policy.name());
        }
    }
}

#[test]
fn a_drag_beyond_reason_leaves_the_distance_as_it_was() {
    let pyramid = Pyramid::new([64 * 32, 64, 64]);
    let mut policy = Mdfo::distance(&pyramid);
    let at = |x: f64| SliceSet { planes: vec![SlicePlane::across(0, x)], moving: Some(0) };
    for x in [10.0, 1e300, 10.0] {
        policy.frame(&at(x));
    }
    (0..32).for_each(|x| policy.insert(brick(x)));
    policy.frame(&at(0.0));
    assert_eq!(policy.victim(&|_| true), Some(brick(31)));
}

/// What has left long ago does not stay in the heap for good.
#[test]
fn the_books_are_no_longer_than_what_is_resident() {
    let pyramid = Pyramid::new([64 * 32, 64, 64]);
    let mut policy = Mdfo::new(&pyramid, MdfoParams::default());
    for frame in 0..2000 {
        let slices = SliceSet { planes: vec![SlicePlane::across(0, f64::from(frame % 7))], moving: Some(0) };
        policy.frame(&slices);
        for x in 0..8 {
            policy.insert(brick(x));
            if x > 1 {
                policy.remove(brick(x));
            }
        }
    }
    assert!(policy.entries() < 1100, "{}", policy.entries());
    assert_eq!(policy.victim(&|_| true), Some(brick(1)));
}

#[test]
fn what_was_refused_is_proposed_again_when_told_so_and_what_is_new_is_at_once() {
    let pyramid = Pyramid::new([64 * 32, 64, 64]);
    let mut policies: Vec<Box<dyn EvictionPolicy>> = Policy::ALL.iter().map(|policy| policy.build(&pyramid)).collect();
    policies.push(Box::new(Areas::new(&pyramid, 10)));
    policies.push(Box::new(Optimum::new(&demand(&[&[0], &[1], &[2]]))));
    for mut policy in policies {
        policy.frame(&SliceSet { planes: vec![SlicePlane::across(0, 10.0)], moving: None });
        policy.insert(brick(0));
        policy.insert(brick(1));
        assert_eq!(policy.victim(&|_| false), None);
        policy.insert(brick(2));
        assert_eq!(policy.victim(&|key| key == brick(2)), Some(brick(2)), "{}", policy.name());
        policy.reconsider();
        assert_eq!(policy.victim(&|key| key == brick(0)), Some(brick(0)), "{}", policy.name());
    }
}

/// Fewest misses of all ways to evict, tried one after the other.
fn fewest(frames: &[Vec<u32>], capacity: usize, pinned: bool) -> u64 {
    fn go(uses: &[(usize, u32)], frames: &[Vec<u32>], resident: &mut Vec<u32>, capacity: usize, pinned: bool) -> u64 {
        let Some(&(frame, brick)) = uses.first() else { return 0 };
        if resident.contains(&brick) {
            return go(&uses[1..], frames, resident, capacity, pinned);
        }
        if resident.len() < capacity {
            resident.push(brick);
            let rest = go(&uses[1..], frames, resident, capacity, pinned);
            resident.pop();
            return 1 + rest;
        }
        let may = |other: u32| !(pinned && frames[frame].contains(&other));
        let mut best = u64::MAX;
        for i in 0..resident.len() {
            if may(resident[i]) {
                let old = std::mem::replace(&mut resident[i], brick);
                best = best.min(1 + go(&uses[1..], frames, resident, capacity, pinned));
                resident[i] = old;
            }
        }
        best
    }
    let uses: Vec<(usize, u32)> = frames.iter().enumerate().flat_map(|(i, frame)| frame.iter().map(move |&brick| (i, brick))).collect();
    go(&uses, frames, &mut Vec::new(), capacity, pinned)
}

#[test]
fn the_optimum_is_what_trying_everything_finds() {
    let mut random = Random::new(9);
    for _ in 0..60 {
        let capacity = 3;
        let frames: Vec<Vec<u32>> = (0..7)
            .map(|_| {
                let mut needs: Vec<u32> = (0..1 + random.below(3)).map(|_| random.below(6) as u32).collect();
                needs.sort_unstable();
                needs.dedup();
                needs
            })
            .collect();
        let views: Vec<&[u32]> = frames.iter().map(|frame| &frame[..]).collect();
        let demand = demand(&views);
        for (pinning, pinned) in [(Pinning::Plain, false), (Pinning::Pinned, true)] {
            assert_eq!(simulate_optimum(&demand, capacity, pinning).misses, fewest(&frames, capacity, pinned), "{frames:?} {pinning:?}");
        }
    }
}

#[test]
fn a_loop_that_has_been_seen_is_foreseen() {
    let demand = Motion::Loop.trace([64 * 10; 3], 400, 1).demand(Needs::Level(0));
    let capacity = demand.frame_set() * 6 / 5;
    let optimum = simulate_optimum(&demand, capacity, Pinning::Pinned).misses as f64;
    let by = |policy| simulate_policy(&demand, capacity, Pinning::Pinned, policy).misses as f64 / optimum;
    assert!(by(Policy::Forecast) < 1.06, "{}", by(Policy::Forecast));
    assert!(by(Policy::Lru) > 1.15, "{}", by(Policy::Lru));
}

#[test]
fn our_policy_is_near_the_optimum_on_every_motion() {
    let (mut sum, mut count) = (0.0, 0.0);
    for (name, motion) in Motion::ALL {
        let demand = motion.trace([64 * 12; 3], 300, 1).demand(Needs::Level(0));
        for ratio in [1.15, 1.5] {
            let capacity = (demand.frame_set() as f64 * ratio) as usize;
            let optimum = simulate_optimum(&demand, capacity, Pinning::Pinned).misses as f64;
            let by = simulate_policy(&demand, capacity, Pinning::Pinned, Policy::Forecast).misses as f64 / optimum;
            assert!(by < 1.6, "{name} {ratio}: {by}");
            (sum, count) = (sum + by, count + 1.0);
        }
    }
    assert!(sum / count < 1.25, "{}", sum / count);
}

#[test]
fn what_is_used_often_becomes_stable_and_what_is_not_is_freed_first() {
    let pyramid = Pyramid::new([64 * 32, 64, 64]);
    let slices = SliceSet { planes: vec![SlicePlane::across(0, 0.0)], moving: Some(0) };
    let mut areas = Areas::with_shares(&pyramid, 5, [0.4, 0.4], 2);
    areas.frame(&slices);
    areas.insert(brick(9));
    areas.insert(brick(1));
    for _ in 0..2 {
        areas.frame(&slices);
        areas.hit(brick(9));
    }
    // 9 is stable by now, 1 unused: far as 9 is, 1 is freed first.
    assert_eq!(areas.victim(&|_| true), Some(brick(1)));
    areas.remove(brick(1));
    assert_eq!(areas.victim(&|_| true), Some(brick(9)));
    // Active holds two: the third sends the farthest of the others to Unused, and that one is freed first.
    areas.frame(&slices);
    [3, 20, 4].into_iter().for_each(|x| areas.insert(brick(x)));
    assert_eq!(areas.victim(&|_| true), Some(brick(20)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    /// Whatever is asked for: the cache never holds more than it may, and only what is resident and may leave does.
    #[test]
    fn no_policy_evicts_what_it_must_not(seed in any::<u64>(), capacity in 1usize..60, motion in 0usize..6) {
        let trace = Motion::ALL[motion].1.trace([64 * 5; 3], 60, seed);
        let mut random = Random::new(seed);
        let pyramid = Pyramid::new(trace.dims);
        let mut policies: Vec<Box<dyn EvictionPolicy>> = Policy::ALL.iter().map(|policy| policy.build(&pyramid)).collect();
        policies.push(Box::new(Areas::new(&pyramid, capacity)));
        for policy in &mut policies {
            let mut resident = KeySet::default();
            for slices in &trace.frames {
                policy.frame(slices);
                let pinned: KeySet = (0..random.below(capacity + 3)).map(|_| brick_of(&mut random)).collect();
                for &key in &pinned {
                    if resident.contains(&key) {
                        policy.hit(key);
                        continue;
                    }
                    if resident.len() == capacity {
                        let victim = policy.victim(&|key| !pinned.contains(&key));
                        prop_assert_eq!(victim.is_none(), resident.iter().all(|key| pinned.contains(key)), "{}", policy.name());
                        let Some(victim) = victim else { continue };
                        prop_assert!(resident.remove(&victim) && !pinned.contains(&victim), "{}", policy.name());
                        policy.remove(victim);
                    }
                    resident.insert(key);
                    policy.insert(key);
                    // Sometimes a brick leaves without having been chosen.
                    if random.below(16) == 0 {
                        resident.remove(&key);
                        policy.remove(key);
                    }
                }
            }
        }
    }
}

fn brick_of(random: &mut Random) -> BrickKey {
    let level = random.below(3) as u8;
    let n = 5usize.div_ceil(1 << level);
    BrickKey { level, at: std::array::from_fn(|_| random.below(n) as u32) }
}

#[test]
fn areas_in_a_simulation_hold_what_they_may() {
    let demand = Motion::Paper.trace([64 * 6; 3], 0, 2).demand(Needs::Level(0));
    let capacity = demand.frame_set() * 3 / 2;
    let outcome = simulate(&demand, capacity, Pinning::Pinned, &mut Areas::new(&demand.pyramid, capacity));
    let lru = simulate_policy(&demand, capacity, Pinning::Pinned, Policy::Lru);
    assert_eq!(outcome.hits + outcome.misses, lru.hits + lru.misses);
    assert!(outcome.fresh_hits > 0);
}
