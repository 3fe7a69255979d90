use super::*;
use crate::bricks::{BRICK_EDGE, BrickStatistics, Policy, Pyramid, SlicePlane};
use crate::volume::{GridFrame, Samples};
use glam::DVec3;
use proptest::prelude::*;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicUsize, Ordering::SeqCst};

/// u8 bricks that hold their level, and what happened to them.
#[derive(Debug)]
struct Made {
    pyramid: Pyramid,
    frame: GridFrame,
    /// Bricks that are being read or held by somebody, the cache included, are counted by the voxels.
    reading: AtomicI64,
    most: AtomicI64,
    order: Mutex<Vec<BrickKey>>,
    fails: Option<BrickKey>,
    is_mended: AtomicBool,
    slow: bool,
    /// While it is set, readers wait: all, or those of one brick.
    gate: AtomicBool,
    gated: Option<BrickKey>,
    reads: AtomicUsize,
}

impl Made {
    fn new(edge: u32) -> Self {
        let frame = GridFrame::along_axes([edge; 3], DVec3::ZERO, DVec3::ONE);
        let (reading, most, reads) = (AtomicI64::new(0), AtomicI64::new(0), AtomicUsize::new(0));
        Made {
            pyramid: Pyramid::new([edge; 3]),
            frame,
            reading,
            most,
            order: Mutex::default(),
            fails: None,
            is_mended: AtomicBool::new(false),
            slow: false,
            gate: AtomicBool::new(false),
            gated: None,
            reads,
        }
    }
}

impl BrickSource for Made {
    fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }
    fn frame(&self) -> &GridFrame {
        &self.frame
    }
    fn name(&self) -> &str {
        "made"
    }
    fn range(&self) -> [f64; 2] {
        [0.0, 1.0]
    }
    fn voxel_bytes(&self) -> usize {
        1
    }
    fn statistics(&self, _: BrickKey) -> Option<BrickStatistics> {
        None
    }
    fn load(&self, key: BrickKey) -> io::Result<Brick> {
        let reading = self.reading.fetch_add(1, SeqCst) + 1;
        self.most.fetch_max(reading, SeqCst);
        self.reads.fetch_add(1, SeqCst);
        self.order.lock().expect("no panic").push(key);
        if self.slow {
            std::thread::sleep(Duration::from_micros(200));
        }
        while self.gate.load(SeqCst) && self.gated.is_none_or(|gated| gated == key) {
            std::thread::yield_now();
        }
        self.reading.fetch_sub(1, SeqCst);
        match self.fails {
            Some(fails) if fails == key && !self.is_mended.load(SeqCst) => Err(io::Error::other("made: brick is broken")),
            Some(_) if key.at == [7, 7, 7] => panic!("a reader's bug"),
            _ => Ok(Brick { samples: Samples::U8(vec![key.level; (BRICK_EDGE as usize).pow(3)].into()) }),
        }
    }
}

const BRICK: u64 = 1 << 18;
const LONG: Duration = Duration::from_secs(60);

fn brick(x: u32, y: u32, z: u32) -> BrickKey {
    BrickKey { level: 0, at: [x, y, z] }
}

fn cache(source: &Arc<Made>, bricks: u64, threads: usize, prefetch: bool) -> BrickCache {
    cache_by(source, bricks, threads, prefetch, Policy::Lru)
}

fn cache_by(source: &Arc<Made>, bricks: u64, threads: usize, prefetch: bool, policy: Policy) -> BrickCache {
    let options = CacheOptions { budget_bytes: bricks * BRICK, threads, prefetch, ..Default::default() };
    BrickCache::with_options(source.clone(), options, policy.build(&source.pyramid)).expect("a cache")
}

#[test]
fn coarse_levels_come_first_and_stay() {
    let source = Arc::new(Made::new(512));
    // 0.2 x 60 bricks: 1 and 8 fit, 64 do not.
    let cache = cache(&source, 60, 2, false);
    assert!(cache.wait_ready(LONG));
    assert_eq!((cache.resident_level(), cache.resident_bytes()), (2, 9 * BRICK));
    // Everything asked for in turn: the coarse ones are still there, and stand for what is not.
    for frame in 0..8 {
        let wanted: Vec<(BrickKey, f32)> = (0..40).map(|i| (brick(i % 8, i / 8, frame as u32), -(i as f32))).collect();
        cache.request(frame, &wanted);
        assert!(cache.wait_refined(LONG));
        assert!(wanted.iter().all(|wanted| cache.is_resident(wanted.0)));
    }
    assert!(source.pyramid.keys(2).chain(source.pyramid.keys(3)).all(|key| cache.is_resident(key)));
    assert_eq!(cache.best(brick(7, 7, 0)).map(|(key, brick)| (key, brick.samples.get(0))), Some((brick(7, 7, 0).ancestor(2), 2.0)));
    assert_eq!(cache.best(brick(3, 3, 7)).map(|found| found.0), Some(brick(3, 3, 7)));
    assert!(cache.resident_bytes() <= 60 * BRICK);
    let counters = cache.counters();
    assert_eq!((counters.frames, counters.misses, counters.stalls, counters.loads), (8, 320, 8, 329));
}

#[test]
fn the_most_wanted_comes_first_and_what_is_stale_is_dropped() {
    let source = Arc::new(Made::new(512));
    let cache = cache(&source, 60, 1, false);
    assert!(cache.wait_ready(LONG));
    source.gate.store(true, SeqCst);
    let before = source.reads.load(SeqCst);
    cache.request(0, &[(brick(0, 0, 0), 1.0), (brick(1, 0, 0), 3.0), (brick(2, 0, 0), 2.0)]);
    while source.reads.load(SeqCst) == before {
        std::thread::yield_now();
    }
    // The first is being read; of the other two one is not wanted any more.
    cache.request(1, &[(brick(5, 0, 0), 1.0), (brick(0, 0, 0), 2.0)]);
    source.gate.store(false, SeqCst);
    assert!(cache.wait_refined(LONG));
    let order = source.order.lock().expect("no panic")[9..].to_vec();
    assert_eq!(order, vec![brick(1, 0, 0), brick(0, 0, 0), brick(5, 0, 0)]);
    assert_eq!(cache.counters().dropped, 1);
}

#[test]
fn nothing_requested_is_read_while_something_moves() {
    let source = Arc::new(Made::new(512));
    let cache = cache(&source, 60, 2, false);
    assert!(cache.wait_ready(LONG));
    cache.stage(Stage::Interaction);
    cache.request(0, &[(brick(0, 0, 0), 1.0)]);
    assert!(!cache.wait_refined(Duration::from_millis(50)));
    assert_eq!((source.reads.load(SeqCst), cache.pending()), (9, 1));
    cache.stage(Stage::Refinement);
    assert!(cache.wait_refined(LONG) && cache.is_resident(brick(0, 0, 0)));
}

#[test]
fn a_failure_is_said_once_and_hangs_nothing() {
    let mut made = Made::new(512);
    made.fails = Some(brick(1, 0, 0));
    let source = Arc::new(made);
    let cache = cache(&source, 60, 2, false);
    let told = Arc::new(AtomicUsize::new(0));
    let tell = told.clone();
    cache.on_arrival(move || {
        tell.fetch_add(1, SeqCst);
    });
    for frame in 0..5 {
        cache.request(frame, &[(brick(0, 0, 0), 1.0), (brick(1, 0, 0), 2.0), (brick(7, 7, 7), 3.0)]);
        assert!(cache.wait_ready(LONG) && cache.wait_refined(LONG));
    }
    let counters = cache.counters();
    assert_eq!((counters.errors, counters.loads), (2, 10));
    assert!(counters.last_error.is_some_and(|error| error.contains("broke")), "the message is kept");
    assert_eq!(source.reads.load(SeqCst), 12);
    // Trying again is possible.
    cache.retry();
    cache.request(9, &[(brick(1, 0, 0), 2.0)]);
    assert!(cache.wait_refined(LONG));
    assert_eq!(cache.counters().errors, 3);
    drop(cache);
    assert!(told.load(SeqCst) >= 4, "{told:?}");
}

#[test]
fn what_always_stays_is_tried_again_and_has_its_room() {
    let fails = BrickKey { level: 2, at: [1, 0, 1] };
    let source = Arc::new(Made { fails: Some(fails), ..Made::new(512) });
    let cache = cache(&source, 60, 2, false);
    assert!(cache.wait_ready(LONG) && !cache.is_resident(fails));
    // Everything else is full.
    cache.request(0, &block(0, 52));
    assert!(cache.wait_refined(LONG));
    assert_eq!((cache.counters().refused, cache.resident_bytes()), (1, 59 * BRICK));
    source.is_mended.store(true, SeqCst);
    cache.retry();
    assert!(cache.wait_ready(LONG) && cache.is_resident(fails));
    let counters = cache.counters();
    assert_eq!((counters.errors, counters.evictions, counters.peak_bytes), (1, 0, 60 * BRICK));
}

#[test]
fn asking_again_in_a_frame_counts_nothing_again() {
    let source = Arc::new(Made::new(512));
    let cache = cache(&source, 60, 2, false);
    for (frame, expected) in [(0, (0, 5)), (0, (0, 5)), (1, (5, 5)), (1, (5, 5))] {
        cache.request(frame, &block(0, 5));
        assert!(cache.wait_ready(LONG) && cache.wait_refined(LONG));
        assert_eq!((cache.counters().hits, cache.counters().misses), expected);
    }
}

#[test]
fn what_a_slice_will_meet_is_read_ahead() {
    let source = Arc::new(Made::new(512));
    let cache = cache(&source, 400, 2, true);
    assert!(cache.wait_ready(LONG));
    cache.stage(Stage::Interaction);
    let at = |x: f64| SliceSet { planes: vec![SlicePlane::across(0, x)], moving: Some(0) };
    cache.follow(&at(100.0), 0, &|_| true);
    assert!(!cache.is_resident(brick(2, 0, 0)));
    cache.follow(&at(101.0), 0, &|_| true);
    let end = Instant::now() + LONG;
    while !(0..8).all(|y| (0..8).all(|z| cache.is_resident(brick(2, y, z)))) {
        assert!(Instant::now() < end);
        std::thread::yield_now();
    }
    assert!(!cache.is_resident(brick(0, 0, 0)), "nothing is behind");
    assert!(cache.counters().prefetches >= 128);
}

#[test]
fn what_is_held_or_shown_stays_and_too_small_a_budget_is_refused() {
    let source = Arc::new(Made::new(256));
    let policy = || Policy::Mdfo.build(&source.pyramid);
    let error = BrickCache::new(source.clone(), BRICK, policy()).expect_err("one brick is too few").to_string();
    assert_eq!(error, "a cache of 262144 bytes is too small: 2 bricks of 262144 bytes are the least");
    let cache = BrickCache::new(source.clone(), 3 * BRICK, policy()).expect("a cache");
    cache.request(0, &[(brick(0, 0, 0), 1.0), (brick(1, 0, 0), 0.0)]);
    assert!(cache.wait_ready(LONG) && cache.wait_refined(LONG));
    let held = cache.get(brick(0, 0, 0)).expect("it came");
    cache.request(1, &[(brick(2, 0, 0), 1.0), (brick(3, 0, 0), 0.0)]);
    assert!(cache.wait_refined(LONG));
    assert!(cache.is_resident(brick(0, 0, 0)) && cache.is_resident(brick(2, 0, 0)) && !cache.is_resident(brick(3, 0, 0)));
    assert_eq!((cache.counters().refused, held.samples.get(0)), (1, 0.0));
    drop(held);
    cache.request(2, &[(brick(2, 0, 0), 1.0), (brick(3, 0, 0), 0.0)]);
    assert!(cache.wait_refined(LONG) && cache.is_resident(brick(3, 0, 0)));
}

#[test]
fn dropping_a_cache_ends_its_threads() {
    let source = Arc::new(Made::new(512));
    let cache = cache(&source, 60, 3, true);
    cache.request(0, &[(brick(0, 0, 0), 1.0)]);
    drop(cache);
    assert_eq!(Arc::strong_count(&source), 1);
}

fn until(is_so: impl Fn() -> bool) {
    let end = Instant::now() + LONG;
    while !is_so() {
        assert!(Instant::now() < end);
        std::thread::yield_now();
    }
}

/// A slice across x, seen on its way.
fn drag(cache: &BrickCache, places: [f64; 2]) {
    for x in places {
        cache.follow(&SliceSet { planes: vec![SlicePlane::across(0, x)], moving: Some(0) }, 0, &|_| true);
    }
}

fn block(x: u32, count: u32) -> Vec<(BrickKey, f32)> {
    (0..count).map(|i| (brick(x + i / 64, i / 8 % 8, i % 8), -(i as f32))).collect()
}

/// The cache holds 60 bricks, 9 of which always stay, so a frame of 51 fits; half of what a frame leaves is read ahead.
#[test]
fn what_was_read_ahead_makes_room_for_what_is_requested() {
    for policy in Policy::ALL {
        let source = Arc::new(Made::new(512));
        let cache = cache_by(&source, 60, 2, true, policy);
        assert!(cache.wait_ready(LONG));
        cache.stage(Stage::Interaction);
        drag(&cache, [100.0, 101.0]);
        until(|| cache.counters().loads == 39);
        cache.stage(Stage::Refinement);
        let wanted = block(4, 51);
        cache.request(0, &wanted);
        assert!(cache.wait_refined(LONG));
        assert!(wanted.iter().all(|wanted| cache.is_resident(wanted.0)), "{policy:?}");
        assert_eq!((cache.counters().refused, cache.resident_bytes()), (0, 60 * BRICK));
    }
}

#[test]
fn what_a_policy_could_not_propose_for_reading_ahead_it_proposes_for_a_request() {
    for policy in Policy::ALL {
        let source = Arc::new(Made::new(512));
        let cache = cache_by(&source, 60, 1, true, policy);
        assert!(cache.wait_ready(LONG));
        // All are used by the frame, or were read ahead: the policy is refused them all.
        cache.request(0, &block(6, 51));
        assert!(cache.wait_refined(LONG));
        cache.request(1, &[]);
        let held: Vec<_> = block(6, 51).iter().filter_map(|wanted| cache.get(wanted.0)).collect();
        drop(held);
        drag(&cache, [100.0, 101.0]);
        let wanted = block(4, 51);
        cache.request(1, &wanted);
        assert!(cache.wait_refined(LONG));
        assert!(wanted.iter().all(|wanted| cache.is_resident(wanted.0)), "{policy:?}: {}", cache.counters().refused);
    }
}

#[test]
fn a_request_waits_for_the_room_of_what_is_being_read() {
    for policy in Policy::ALL {
        let source = Arc::new(Made { gate: AtomicBool::new(true), gated: Some(brick(1, 0, 0)), ..Made::new(512) });
        let cache = cache_by(&source, 60, 2, true, policy);
        assert!(cache.wait_ready(LONG));
        cache.stage(Stage::Interaction);
        drag(&cache, [100.0, 101.0]);
        until(|| cache.counters().loads == 38);
        cache.stage(Stage::Refinement);
        let wanted = block(4, 51);
        cache.request(0, &wanted);
        // The last one has no room as long as one that nobody wants is being read.
        until(|| cache.counters().loads == 88);
        assert!(!cache.wait_refined(Duration::from_millis(20)) && cache.pending() == 1, "{policy:?}");
        source.gate.store(false, SeqCst);
        assert!(cache.wait_refined(LONG));
        assert!(wanted.iter().all(|wanted| cache.is_resident(wanted.0)), "{policy:?}");
        assert_eq!(cache.counters().peak_bytes, 60 * BRICK);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// Whatever is asked for by several threads at once: what is resident and what is being read never exceed the budget.
    #[test]
    fn the_budget_holds(requests in prop::collection::vec((prop::collection::vec((0u32..8, 0u32..8, 0u32..2), 0..50), any::<bool>()), 1..25)) {
        let source = Arc::new(Made { slow: true, ..Made::new(512) });
        let cache = cache(&source, 30, 4, true);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for frame in 0..requests.len() as u64 * 20 {
                    let slices = SliceSet { planes: vec![SlicePlane::across(0, frame as f64 * 7.0 % 512.0)], moving: Some(0) };
                    cache.follow(&slices, 0, &|_| true);
                    std::thread::yield_now();
                }
            });
            for (frame, (wanted, rests)) in (0..).zip(&requests) {
                cache.stage(if *rests { Stage::Refinement } else { Stage::Interaction });
                let wanted: Vec<(BrickKey, f32)> = wanted.iter().map(|&(x, y, z)| (brick(x, y, z), x as f32)).collect();
                cache.request(frame, &wanted);
                let held: Vec<_> = wanted.iter().filter_map(|wanted| cache.get(wanted.0)).collect();
                assert!(cache.resident_bytes() <= 30 * BRICK, "{} held", held.len());
            }
        });
        cache.stage(Stage::Refinement);
        prop_assert!(cache.wait_ready(LONG) && cache.wait_refined(LONG));
        let peak = cache.counters().peak_bytes;
        prop_assert!(peak <= 30 * BRICK, "{} bricks", peak / BRICK);
        prop_assert!(source.most.load(SeqCst) <= 4);
    }
}
