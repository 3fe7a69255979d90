//! Progress and cancellation of long work: one object shared by the worker that advances it and the caller that shows or stops it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

/// The work was stopped by [`Progress::cancel`]. What it had allocated is freed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// How far a piece of long work is. Cheap enough to touch once per few hundred items from any thread.
#[derive(Debug, Default)]
pub struct Progress {
    stage: Mutex<&'static str>,
    done: AtomicU64,
    total: AtomicU64,
    cancelled: Arc<AtomicBool>,
}

impl Progress {
    /// A progress that nobody looks at and nobody cancels.
    pub fn new() -> Self {
        Self::default()
    }

    /// A progress of its own that is cancelled together with this one: for a part of work whose whole is shown as one stage.
    pub fn part(&self) -> Self {
        Progress { cancelled: self.cancelled.clone(), ..Self::default() }
    }

    /// Starts a named stage of `total` steps (0: unknown).
    pub fn begin(&self, stage: &'static str, total: u64) {
        *self.stage.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = stage;
        self.done.store(0, Relaxed);
        self.total.store(total, Relaxed);
    }

    /// Advances the current stage by `steps`.
    pub fn add(&self, steps: u64) {
        self.done.fetch_add(steps, Relaxed);
    }

    /// Asks the worker to stop at its next [`Progress::check`].
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// `Err(Cancelled)` once [`Progress::cancel`] was called.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled.load(Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// (stage, steps done, steps in all); 0 in all means that the total is not known.
    pub fn snapshot(&self) -> (&'static str, u64, u64) {
        let stage = *self.stage.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        (stage, self.done.load(Relaxed), self.total.load(Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_its_steps_and_is_cancelled_with_the_whole() {
        let whole = Progress::new();
        whole.begin("whole", 3);
        let part = whole.part();
        part.begin("part", 5);
        part.add(2);
        assert_eq!((whole.snapshot(), part.snapshot()), (("whole", 0, 3), ("part", 2, 5)));
        whole.cancel();
        assert_eq!(part.check(), Err(Cancelled));
    }
}
