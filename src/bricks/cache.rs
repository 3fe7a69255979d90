//! Bricks in memory: [`BrickCache`].

mod options;
mod state;

use super::{Brick, BrickKey, BrickSource, EvictionPolicy, SliceSet};
pub use options::{CacheCounters, CacheError, CacheOptions, Stage};
use state::State;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Bricks of a source in memory: as many as a budget holds, loaded by threads of its own, most wanted first.
///
/// The levels that fit into a share of the budget are loaded first and always stay, so that there is something to show everywhere
/// ([`BrickCache::best`]). Everything else comes and goes: each frame says with [`BrickCache::follow`] where its slices are and with
/// [`BrickCache::request`] which bricks it wants, draws what [`BrickCache::get`] and [`BrickCache::best`] have, and is told through
/// [`BrickCache::on_arrival`] that there is more. None of these ever reads anything or waits for what does.
///
/// What the current frame requested, and what a caller still holds, is not evicted; what it has only drawn, or what was loaded ahead, leaves
/// for what it requested where nothing else can. Bricks that are being loaded count as if they were there already: the budget is never
/// exceeded.
pub struct BrickCache {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// What the cache and its threads share.
struct Shared {
    source: Arc<dyn BrickSource>,
    state: Mutex<State>,
    /// Told when there may be something to load, or the end has come.
    work: Condvar,
    /// Told when a load has ended.
    done: Condvar,
    arrival: Mutex<Option<Arc<dyn Fn() + Send + Sync>>>,
}

impl BrickCache {
    /// An empty cache that holds at most so many bytes of bricks. It begins to load the coarsest levels at once.
    pub fn new(source: Arc<dyn BrickSource>, budget_bytes: u64, policy: Box<dyn EvictionPolicy>) -> Result<Self, CacheError> {
        Self::with_options(source, CacheOptions { budget_bytes, ..Default::default() }, policy)
    }

    /// The same with all options.
    pub fn with_options(source: Arc<dyn BrickSource>, options: CacheOptions, policy: Box<dyn EvictionPolicy>) -> Result<Self, CacheError> {
        let state = State::new(&*source, &options, policy)?;
        let shared =
            Arc::new(Shared { source, state: Mutex::new(state), work: Condvar::new(), done: Condvar::new(), arrival: Mutex::new(None) });
        let mut cache = BrickCache { shared: shared.clone(), threads: Vec::new() };
        for i in 0..options.threads.max(1) {
            let shared = shared.clone();
            let name = format!("bricks {i}");
            // If this fails, dropping `cache` ends the threads that were started.
            cache.threads.push(std::thread::Builder::new().name(name).spawn(move || shared.load_all()).map_err(CacheError::Thread)?);
        }
        Ok(cache)
    }

    /// Where the bricks come from.
    pub fn source(&self) -> &Arc<dyn BrickSource> {
        &self.shared.source
    }

    /// The finest level that is always there: it and all coarser ones stay in memory once loaded.
    pub fn resident_level(&self) -> u8 {
        self.shared.lock().coarse_level
    }

    /// Whether all bricks of the levels that always stay have been loaded, or have failed.
    pub fn is_ready(&self) -> bool {
        self.shared.lock().coarse_left == 0
    }

    /// Waits until [`BrickCache::is_ready`], at most so long; whether it is.
    pub fn wait_ready(&self, timeout: Duration) -> bool {
        self.wait(timeout, |state| state.coarse_left == 0)
    }

    /// How many bricks the budget holds.
    pub fn capacity(&self) -> usize {
        self.shared.lock().capacity
    }

    /// Bytes that the resident bricks take.
    pub fn resident_bytes(&self) -> u64 {
        self.shared.lock().resident_bytes()
    }

    /// Says where the slices are now, and up to which level they are wanted. The policy learns from it, and the bricks that the moving slices
    /// will meet next are loaded ahead, nearest first, below everything that is requested: those that `shows` says some picture shows. It must
    /// be true for all coarser bricks above one for which it is. Call it once a frame, before [`BrickCache::request`].
    pub fn follow(&self, slices: &SliceSet, finest: u8, shows: &dyn Fn(BrickKey) -> bool) {
        let mut state = self.shared.lock();
        state.follow(self.shared.source.pyramid(), slices, finest, shows);
        self.shared.work.notify_all();
    }

    /// Says which bricks frame number `frame` wants, with their priority, the bigger the sooner; what [`super::wanted()`] returns is right. It
    /// replaces what was requested before; requests not yet begun are dropped. Asking again with the same number counts as the same frame.
    /// Bricks beyond the budget, by priority, are not loaded.
    pub fn request(&self, frame: u64, wanted: &[(BrickKey, f32)]) {
        let mut state = self.shared.lock();
        state.request(frame, wanted);
        self.shared.work.notify_all();
    }

    /// Chooses the stage. [`Stage::Interaction`] stops refinement at once: what is being read ends, nothing that was requested is begun.
    pub fn stage(&self, stage: Stage) {
        let mut state = self.shared.lock();
        state.stage = stage;
        self.shared.work.notify_all();
    }

    /// A brick, if it is resident. It stays while it is held; hold it no longer than a frame.
    pub fn get(&self, key: BrickKey) -> Option<Arc<Brick>> {
        self.shared.lock().get(key)
    }

    /// The finest resident brick that covers a brick: itself or one of a coarser level. `None` only before the coarsest level has come.
    pub fn best(&self, key: BrickKey) -> Option<(BrickKey, Arc<Brick>)> {
        let levels = self.shared.source.pyramid().levels();
        let mut state = self.shared.lock();
        (key.level..levels).map(|level| key.ancestor(level)).find_map(|key| Some((key, state.get(key)?)))
    }

    /// Whether a brick is resident.
    pub fn is_resident(&self, key: BrickKey) -> bool {
        self.shared.lock().is_resident(key)
    }

    /// How many of the requested bricks are still to come. Failed ones do not count.
    pub fn pending(&self) -> usize {
        self.shared.lock().pending()
    }

    /// Waits until nothing that was requested is still to come, at most so long; whether that is so. In [`Stage::Interaction`] nothing comes.
    pub fn wait_refined(&self, timeout: Duration) -> bool {
        self.wait(timeout, |state| state.coarse_left == 0 && state.pending() == 0)
    }

    /// Called, from a thread of the cache, each time a brick has arrived or has failed. Replaces the one before.
    pub fn on_arrival(&self, call: impl Fn() + Send + Sync + 'static) {
        *self.shared.arrival.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(call));
    }

    /// What has happened so far.
    pub fn counters(&self) -> CacheCounters {
        self.shared.lock().counters.clone()
    }

    /// Forgets which bricks failed: those of the levels that always stay are tried again at once, others when next requested.
    pub fn retry(&self) {
        self.shared.lock().retry();
        self.shared.work.notify_all();
    }

    fn wait(&self, timeout: Duration, is_done: impl Fn(&State) -> bool) -> bool {
        let end = Instant::now() + timeout;
        let mut state = self.shared.lock();
        while !is_done(&state) {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            state = self.shared.done.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }
}

impl std::fmt::Debug for BrickCache {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("BrickCache").field("source", &self.shared.source).field("threads", &self.threads.len()).finish_non_exhaustive()
    }
}

impl Drop for BrickCache {
    fn drop(&mut self) {
        self.shared.lock().closing = true;
        self.shared.work.notify_all();
        for thread in self.threads.drain(..) {
            // It cannot have panicked but for a bug, and then there is nothing to do about it here.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a thread does until the end.
    fn load_all(&self) {
        let mut state = self.lock();
        while !state.closing {
            let Some(key) = state.next_load() else {
                // What was left of the requests may have been refused.
                self.done.notify_all();
                state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            drop(state);
            let loaded = catch_unwind(AssertUnwindSafe(|| self.source.load(key)))
                .unwrap_or_else(|_| Err(std::io::Error::other("the reader of bricks broke off")));
            self.lock().loaded(key, loaded);
            self.done.notify_all();
            let arrival = self.arrival.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Some(call) = arrival {
                call();
            }
            state = self.lock();
        }
    }
}

#[cfg(test)]
mod tests;
