//! The books of a cache: what is there, what is on its way, what is wanted.

use super::options::{CacheCounters, CacheError, CacheOptions, Stage};
use crate::bricks::prefetch::Ahead;
use crate::bricks::{BRICK_EDGE, Brick, BrickKey, BrickSource, EvictionPolicy, KeyMap, KeySet, Pyramid, SliceSet};
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;

/// A brick that is there.
struct Entry {
    brick: Arc<Brick>,
    /// The frame that used it last.
    frame: Option<u64>,
}

pub(super) struct State {
    policy: Box<dyn EvictionPolicy>,
    prefetches: bool,
    brick_bytes: u64,
    pub(super) capacity: usize,
    pub(super) coarse_level: u8,
    /// Bricks that always stay and are not there yet.
    pub(super) coarse_left: u64,
    coarse: VecDeque<BrickKey>,
    /// How many bricks always stay: there is room for them, whether they are there or not.
    coarse_count: usize,
    resident: KeyMap<Entry>,
    loading: KeySet,
    /// The least wanted first.
    queue: Vec<BrickKey>,
    /// What the current frame wants, as much of it as there is room for.
    pinned: KeySet,
    ahead: Ahead,
    /// What is to be loaded ahead, the nearest first, and what of that is there or on its way.
    next: VecDeque<BrickKey>,
    fetched: KeySet,
    slices: SliceSet,
    frame: Option<u64>,
    pub(super) failed: KeySet,
    pub(super) stage: Stage,
    pub(super) closing: bool,
    pub(super) counters: CacheCounters,
}

impl State {
    pub(super) fn new(source: &dyn BrickSource, options: &CacheOptions, policy: Box<dyn EvictionPolicy>) -> Result<Self, CacheError> {
        let pyramid = source.pyramid();
        let brick_bytes = u64::from(BRICK_EDGE).pow(3) * source.voxel_bytes().max(1) as u64;
        let capacity = options.budget_bytes / brick_bytes;
        // One that stays, one that comes and goes.
        let least = if pyramid.levels() > 1 { 2 } else { 1 };
        if capacity < least {
            return Err(CacheError::Budget { budget_bytes: options.budget_bytes, least, brick_bytes });
        }
        let share = ((capacity as f64 * options.coarse_share.clamp(0.0, 1.0)) as u64).min(capacity - least + 1);
        let mut coarse_level = pyramid.levels() - 1;
        let mut coarse_left = 1;
        while coarse_level > 0 && coarse_left + pyramid.brick_count(coarse_level - 1) <= share {
            coarse_level -= 1;
            coarse_left += pyramid.brick_count(coarse_level);
        }
        let coarse = (coarse_level..pyramid.levels()).rev().flat_map(|level| pyramid.keys(level)).collect();
        Ok(State {
            policy,
            prefetches: options.prefetch,
            brick_bytes,
            capacity: usize::try_from(capacity).unwrap_or(usize::MAX),
            coarse_level,
            coarse_left,
            coarse,
            coarse_count: coarse_left as usize,
            resident: KeyMap::default(),
            loading: KeySet::default(),
            queue: Vec::new(),
            pinned: KeySet::default(),
            ahead: Ahead::default(),
            next: VecDeque::new(),
            fetched: KeySet::default(),
            slices: SliceSet::default(),
            frame: None,
            failed: KeySet::default(),
            stage: Stage::default(),
            closing: false,
            counters: CacheCounters::default(),
        })
    }

    pub(super) fn resident_bytes(&self) -> u64 {
        self.resident.len() as u64 * self.brick_bytes
    }

    pub(super) fn is_resident(&self, key: BrickKey) -> bool {
        self.resident.contains_key(&key)
    }

    pub(super) fn pending(&self) -> usize {
        let comes = |key: &&BrickKey| !self.resident.contains_key(key) && !self.failed.contains(key);
        self.queue.iter().filter(comes).count() + self.loading.iter().filter(|key| self.pinned.contains(key)).count()
    }

    pub(super) fn get(&mut self, key: BrickKey) -> Option<Arc<Brick>> {
        let entry = self.resident.get_mut(&key)?;
        if entry.frame != self.frame {
            entry.frame = self.frame;
            if key.level < self.coarse_level {
                self.policy.hit(key);
            }
        }
        Some(entry.brick.clone())
    }

    pub(super) fn follow(&mut self, pyramid: &Pyramid, slices: &SliceSet, finest: u8, shows: &dyn Fn(BrickKey) -> bool) {
        let next = if self.prefetches { self.ahead.next(pyramid, slices, finest, shows) } else { Vec::new() };
        self.slices.clone_from(slices);
        let is_there = |key: &BrickKey| self.resident.contains_key(key) || self.loading.contains(key);
        self.fetched = next.iter().copied().filter(|key| !self.pinned.contains(key) && is_there(key)).collect();
        self.next = next.into();
    }

    pub(super) fn request(&mut self, frame: u64, wanted: &[(BrickKey, f32)]) {
        let is_new = self.frame != Some(frame);
        self.frame = Some(frame);
        if is_new {
            self.policy.frame(&self.slices);
        }
        let mut wanted: Vec<(BrickKey, f32)> = wanted.iter().copied().filter(|wanted| wanted.0.level < self.coarse_level).collect();
        wanted.sort_by(|a, b| b.1.total_cmp(&a.1));
        let room = self.capacity.saturating_sub(self.coarse_count);
        self.counters.refused += wanted.len().saturating_sub(room) as u64;
        wanted.truncate(room);
        let old = std::mem::take(&mut self.queue);
        self.pinned = wanted.iter().map(|wanted| wanted.0).collect();
        self.counters.dropped += old.iter().filter(|key| !self.pinned.contains(key)).count() as u64;
        let mut missing = 0;
        for &(key, _) in &wanted {
            match self.resident.get_mut(&key) {
                Some(entry) => {
                    if entry.frame != self.frame {
                        entry.frame = self.frame;
                        self.policy.hit(key);
                        // What came since this frame was counted is one of its misses.
                        self.counters.hits += u64::from(is_new);
                    }
                }
                None => {
                    missing += 1;
                    if !self.loading.contains(&key) && !self.failed.contains(&key) {
                        self.queue.push(key);
                    }
                }
            }
        }
        self.queue.reverse();
        if is_new {
            self.counters.frames += 1;
            self.counters.misses += missing;
            self.counters.stalls += u64::from(missing > 0);
        }
    }

    /// The next brick to read. There is room for it, and it is marked as being loaded.
    pub(super) fn next_load(&mut self) -> Option<BrickKey> {
        let key = self.choose()?;
        self.loading.insert(key);
        let taken = (self.resident.len() + self.loading.len()) as u64 * self.brick_bytes;
        self.counters.peak_bytes = self.counters.peak_bytes.max(taken);
        Some(key)
    }

    fn choose(&mut self) -> Option<BrickKey> {
        if let Some(key) = self.coarse.pop_front() {
            return Some(key);
        }
        while self.stage == Stage::Refinement
            && let Some(key) = self.queue.pop()
        {
            if self.is_open(key) {
                if self.make_room(false) {
                    return Some(key);
                }
                // What is being read and not wanted leaves when it is there; who reads it comes here again.
                if self.loading.iter().any(|key| !self.pinned.contains(key)) {
                    self.queue.push(key);
                    return None;
                }
                self.counters.refused += 1;
            }
        }
        while let Some(key) = self.next.pop_front() {
            // What is loaded ahead takes no more than half of what the frame leaves.
            let room = self.capacity.saturating_sub(self.pinned.len()) / 2;
            if self.is_open(key) && self.fetched.len() < room && self.make_room(true) {
                self.fetched.insert(key);
                self.counters.prefetches += 1;
                return Some(key);
            }
        }
        None
    }

    /// Forgets what failed; what always stays is to be read again.
    pub(super) fn retry(&mut self) {
        let mut coarse: Vec<BrickKey> = self.failed.drain().filter(|key| key.level >= self.coarse_level).collect();
        coarse.sort_unstable_by(|a, b| b.level.cmp(&a.level).then(a.cmp(b)));
        self.coarse_left += coarse.len() as u64;
        self.coarse.extend(coarse);
    }

    fn is_open(&self, key: BrickKey) -> bool {
        !self.resident.contains_key(&key) && !self.loading.contains(&key) && !self.failed.contains(&key)
    }

    /// Whether one more brick fits, after evicting one if need be. What the frame has used or what was read ahead makes no room for reading
    /// ahead, and for what is requested only where nothing else does.
    fn make_room(&mut self, is_ahead: bool) -> bool {
        let is_failed_coarse = |key: &&BrickKey| key.level >= self.coarse_level;
        let away = self.coarse.len() + self.failed.iter().filter(is_failed_coarse).count();
        let State { policy, resident, loading, pinned, fetched, frame, counters, capacity, .. } = self;
        while resident.len() + loading.len() + away >= *capacity {
            let may_for_request =
                |key: BrickKey| !pinned.contains(&key) && resident.get(&key).is_some_and(|entry| Arc::strong_count(&entry.brick) == 1);
            let may = |key: BrickKey| {
                let is_used = || frame.is_some() && resident.get(&key).is_some_and(|entry| entry.frame == *frame);
                may_for_request(key) && !fetched.contains(&key) && !is_used()
            };
            let mut victim = policy.victim(&may);
            if victim.is_none() && !is_ahead {
                policy.reconsider();
                victim = policy.victim(&may_for_request);
            }
            let Some(key) = victim else { return false };
            policy.remove(key);
            resident.remove(&key);
            fetched.remove(&key);
            counters.evictions += 1;
        }
        true
    }

    /// A read has ended.
    pub(super) fn loaded(&mut self, key: BrickKey, loaded: io::Result<Brick>) {
        self.loading.remove(&key);
        let is_coarse = key.level >= self.coarse_level;
        self.coarse_left -= u64::from(is_coarse);
        let loaded = loaded.and_then(|brick| {
            let bytes = brick.samples.bytes() as u64;
            if bytes > self.brick_bytes {
                return Err(io::Error::other(format!("brick {key:?} has {bytes} bytes, {} were expected", self.brick_bytes)));
            }
            Ok(brick)
        });
        match loaded {
            Ok(brick) => {
                self.counters.loads += 1;
                self.counters.bytes += brick.samples.bytes() as u64;
                self.resident.insert(key, Entry { brick: Arc::new(brick), frame: None });
                if !is_coarse {
                    self.policy.insert(key);
                }
            }
            Err(error) => {
                self.failed.insert(key);
                self.fetched.remove(&key);
                self.counters.errors += 1;
                self.counters.last_error = Some(error.to_string());
            }
        }
    }
}
