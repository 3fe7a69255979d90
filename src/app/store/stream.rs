//! Bricks on their way to the pictures: which ones they ask for, from memory to the device, and what is left to do.

use crate::bricks::policy::{Areas, Policy};
use crate::bricks::screen::{Asked, SeenSlice, asked, kept_bricks, kept_level};
use crate::bricks::slots::Slots;
use crate::bricks::{
    BrickCache, BrickKey, BrickSource, CacheCounters, CacheOptions, Detail, DetailRule, Interpolation, SliceSet, Stage, sample::brick_of,
};
use crate::gpu::{Context, GpuError, SlicePool};
use anyhow::Result;
use glam::DVec3;
use std::sync::Arc;

/// Bytes that are copied to the device in a frame: while something moves, and at rest.
const UPLOADS: [u64; 2] = [4 << 20, 12 << 20];

/// The share of the device's bricks that always stay.
const KEPT: u32 = 4;

/// Bricks in memory and on the device.
pub struct Stream {
    context: Context,
    source: Arc<dyn BrickSource>,
    cache: BrickCache,
    pool: SlicePool,
    slots: Slots,
    /// Of the levels that always stay on the device, what is not there yet.
    kept_left: Vec<BrickKey>,
    kept: u8,
    detail: Option<Detail>,
    asked: Asked,
    seen: Vec<SeenSlice>,
    slices: SliceSet,
    /// The brick under the pointer.
    pointed: Option<BrickKey>,
    frame: u64,
    version: u64,
}

/// What is shown of how things are.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Bricks that the pictures wait for.
    pub left: usize,
    /// Whether the pictures stay coarser than the screen, since there is no room for more bricks.
    pub is_cut: bool,
    /// Bytes in memory, and the most there may be.
    pub memory: [u64; 2],
    /// The same on the device.
    pub device: [u64; 2],
    /// Hits, misses and the like of the memory.
    pub counters: CacheCounters,
}

impl Stream {
    /// With nothing loaded. `memory_bytes` and `device_bytes` are the most that bricks may take; `arrival` is called, from any thread, when a
    /// brick has come.
    pub fn new(
        context: Context,
        source: Arc<dyn BrickSource>,
        [memory_bytes, device_bytes]: [u64; 2],
        arrival: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self> {
        let pyramid = *source.pyramid();
        // Half of the processors are left to the pictures.
        let threads = std::thread::available_parallelism().map_or(1, |n| (n.get() / 2).clamp(1, 8));
        let options = CacheOptions { budget_bytes: memory_bytes, threads, ..Default::default() };
        let cache = BrickCache::with_options(source.clone(), options, Policy::default().build(&pyramid))?;
        cache.on_arrival(arrival);
        let pool = SlicePool::new(&context, &pyramid, source.voxel_bytes(), device_bytes)?;
        let kept = kept_level(&pyramid, u64::from(pool.capacity() / KEPT)).max(cache.resident_level());
        let mut kept_left = kept_bricks(&pyramid, kept);
        kept_left.truncate(pool.capacity() as usize);
        Ok(Stream {
            slots: Slots::new(pool.capacity(), Box::new(Areas::new(&pyramid, pool.capacity() as usize))),
            context,
            source,
            cache,
            pool,
            kept_left,
            kept,
            detail: None,
            asked: Asked::default(),
            seen: Vec::new(),
            slices: SliceSet::default(),
            pointed: None,
            frame: 0,
            version: 0,
        })
    }

    /// Whether bricks that would show nothing more are left out.
    pub fn leaves_out_flat(&self) -> bool {
        self.detail.is_some()
    }

    /// Leaves them out, or not.
    pub fn leave_out_flat(&mut self, is_on: bool) {
        self.detail = is_on.then(|| Detail::of(&*self.source, DetailRule::default()));
        self.seen.clear();
    }

    /// The device's bricks, to draw from.
    pub fn pool(&mut self) -> (&Context, &mut SlicePool) {
        (&self.context, &mut self.pool)
    }

    /// Rises when what the device has changes.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Takes note of what the pictures show and where the slices are, and copies what has come to the device, up to a number of bytes. While
    /// something moves only what lies ahead of it is asked of the disk. Reads nothing itself, and waits for nothing.
    pub fn update(&mut self, seen: &[SeenSlice], slices: &SliceSet, is_moving: bool, pointed: Option<BrickKey>) {
        let levels = self.source.pyramid().levels();
        self.cache.stage(if is_moving { Stage::Interaction } else { Stage::Refinement });
        let is_new = self.seen != seen || self.slices != *slices;
        if is_new {
            let kept = kept_count(&self.source, self.kept);
            let cached = kept_count(&self.source, self.cache.resident_level());
            let room =
                (u64::from(self.pool.capacity()).saturating_sub(kept)).min((self.cache.capacity() as u64).saturating_sub(cached + 1));
            let detail = self.detail.as_ref();
            let enough = |key: BrickKey| detail.is_some_and(|detail| detail.is_enough(key));
            self.asked = asked(self.source.pyramid(), seen, self.kept, room as usize, enough);
            (self.seen, self.slices) = (seen.to_vec(), slices.clone());
            self.frame += 1;
            self.slots.begin(slices);
            for &key in &self.asked.bricks {
                self.slots.touch(key);
            }
            let finest = self.asked.bricks.last().map_or(levels - 1, |key| key.level);
            self.cache.follow(slices, finest, &|key| seen.iter().any(|slice| slice.shows(key)));
        }
        if is_new || self.pointed != pointed {
            self.pointed = pointed;
            let wanted = self.asked.bricks.iter().copied().chain(pointed);
            let wanted: Vec<(BrickKey, f32)> = wanted.zip(0..).map(|(key, i)| (key, -(i as f32))).collect();
            self.cache.request(self.frame, &wanted);
        }
        self.upload(UPLOADS[usize::from(!is_moving)]);
    }

    fn upload(&mut self, bytes: u64) {
        let mut room = (bytes / self.pool.brick_bytes()).max(1);
        let kept: Vec<BrickKey> = self.kept_left.clone();
        let wanted = kept.into_iter().map(|key| (key, true)).chain(self.asked.bricks.iter().map(|&key| (key, false)));
        let wanted: Vec<(BrickKey, bool)> = wanted.filter(|(key, _)| !self.slots.has(*key)).collect();
        for (key, is_kept) in wanted {
            if room == 0 {
                break;
            }
            let Some(brick) = self.cache.is_resident(key).then(|| self.cache.get(key)).flatten() else { continue };
            let Some(admitted) = self.slots.admit(key, is_kept) else { continue };
            if let Some(evicted) = admitted.evicted {
                self.pool.remove(evicted);
            }
            self.pool.put(&self.context, admitted.slot, key, &brick);
            self.kept_left.retain(|left| *left != key);
            self.version += 1;
            room -= 1;
        }
    }

    /// Whether something has come that is not on the device yet, so that the next frame has something to do.
    pub fn has_more(&self) -> bool {
        let wanted = self.kept_left.iter().chain(&self.asked.bricks);
        wanted.filter(|key| !self.slots.has(**key)).any(|&key| self.cache.is_resident(key))
    }

    /// How things are.
    pub fn progress(&self) -> Progress {
        let is_left = |key: &&BrickKey| !self.slots.has(**key);
        let is_here = |key: &&BrickKey| self.cache.is_resident(**key);
        // What could not be read does not come.
        let coming = self.cache.pending() + self.asked.bricks.iter().filter(is_left).filter(is_here).count();
        let is_ready = self.cache.is_ready();
        let kept = self.kept_left.iter().filter(|key| !is_ready || is_here(key)).count();
        let left = self.asked.bricks.iter().filter(is_left).count().min(coming) + kept;
        let brick = self.pool.brick_bytes();
        Progress {
            left,
            is_cut: self.asked.is_cut,
            memory: [self.cache.resident_bytes(), self.cache.capacity() as u64 * memory_brick(&self.source)],
            device: [self.slots.len() as u64 * brick, u64::from(self.pool.capacity()) * brick],
            counters: self.cache.counters(),
        }
    }

    /// Whether the levels that always stay in memory are there.
    pub fn is_ready(&self) -> bool {
        self.cache.is_ready()
    }

    /// The finest level that the pictures ask for.
    pub fn finest(&self) -> u8 {
        self.asked.bricks.last().map_or(self.kept, |key| key.level)
    }

    /// The value of the nearest voxel to a position from the finest level in memory, missing or not, with that level.
    pub fn value_at(&self, at: DVec3) -> Option<(Option<f64>, u8)> {
        let pyramid = self.source.pyramid();
        (0..pyramid.levels()).find_map(|level| {
            let mut is_there = true;
            let value = Interpolation::Nearest.sample(at, level, [pyramid.dims(0), pyramid.dims(level)], |voxel| {
                let (key, i) = brick_of(level, voxel);
                let brick = self.cache.is_resident(key).then(|| self.cache.get(key)).flatten();
                is_there = brick.is_some();
                brick.map(|brick| brick.samples.get(i)).filter(|value| !value.is_nan())
            });
            is_there.then_some((value, level))
        })
    }

    /// Values that the middle part of all lies between, of those of a coarse level: so much is left out at either end. `None` before that
    /// level has come, or where all is missing.
    pub fn quantiles(&self, share: f64) -> Option<[f64; 2]> {
        /// So many values tell where the ends are.
        const ENOUGH: u64 = 1_000_000;
        let pyramid = self.source.pyramid();
        let level = self.cache.resident_level();
        let voxels: u64 = pyramid.dims(level).iter().map(|&n| u64::from(n)).product();
        let step = (voxels / ENOUGH).max(1) as usize | 1;
        let edge = crate::bricks::BRICK_EDGE;
        let mut values = Vec::new();
        for key in kept_bricks(pyramid, level).into_iter().filter(|key| key.level == level) {
            let brick = self.cache.get(key)?;
            // What is repeated beyond the end of the volume does not count.
            let [x, y, z] = pyramid.voxels(key).map(|range| range.len() as u32);
            let inside = (0..z).flat_map(|z| (0..y).flat_map(move |y| (0..x).map(move |x| (x + edge * (y + edge * z)) as usize)));
            values.extend(inside.step_by(step).map(|i| brick.samples.get(i)).filter(|value| value.is_finite()));
        }
        if values.is_empty() {
            return None;
        }
        let last = values.len() - 1;
        let mut at = |share: f64| *values.select_nth_unstable_by((share * last as f64).round() as usize, f64::total_cmp).1;
        Some([at(share), at(1.0 - share)])
    }

    /// The first error of the device that no call has given.
    pub fn take_error(&self) -> Option<GpuError> {
        self.context.take_error()
    }
}

fn kept_count(source: &Arc<dyn BrickSource>, level: u8) -> u64 {
    (level..source.pyramid().levels()).map(|level| source.pyramid().brick_count(level)).sum()
}

fn memory_brick(source: &Arc<dyn BrickSource>) -> u64 {
    source.voxel_bytes() as u64 * u64::from(crate::bricks::BRICK_EDGE).pow(3)
}
