//! What a cache is told beforehand, and what it tells afterwards.

/// What a [`super::BrickCache`] may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CacheOptions {
    /// Bytes of bricks at most, those being loaded included. Default 512 MiB.
    pub budget_bytes: u64,
    /// The share of the budget for the levels that always stay, 0 to 1. The coarsest level stays in any case. Default 0.2, as in the paper.
    pub coarse_share: f64,
    /// Threads that load, at least 1. Default 2.
    pub threads: usize,
    /// Whether the bricks that a moving slice will meet are loaded ahead. Default yes.
    pub prefetch: bool,
}

impl Default for CacheOptions {
    fn default() -> Self {
        CacheOptions { budget_bytes: 512 << 20, coarse_share: 0.2, threads: 2, prefetch: true }
    }
}

/// What the cache loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stage {
    /// Something moves: nothing that is requested is loaded, only what always stays and what lies ahead of a moving slice, in the background.
    Interaction,
    /// Everything rests: what is requested is loaded, most wanted first.
    #[default]
    Refinement,
}

/// What has happened in a cache.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CacheCounters {
    /// Frames that requested something.
    pub frames: u64,
    /// Bricks that were resident when a frame requested them.
    pub hits: u64,
    /// Bricks that were not.
    pub misses: u64,
    /// Frames with at least one miss: they had to show something coarser.
    pub stalls: u64,
    /// Bricks read.
    pub loads: u64,
    /// Of those, the ones read ahead of a moving slice.
    pub prefetches: u64,
    /// Bytes of the bricks read.
    pub bytes: u64,
    /// Bricks that left.
    pub evictions: u64,
    /// Requests that were replaced before they were begun.
    pub dropped: u64,
    /// Requests for which the budget had no room beside the bricks of the same frame.
    pub refused: u64,
    /// Bricks that could not be read. They are not tried again.
    pub errors: u64,
    /// What the latest of those errors said.
    pub last_error: Option<String>,
}

/// Why there is no cache.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// Too few bytes.
    #[error("a cache of {budget_bytes} bytes is too small: {least} bricks of {brick_bytes} bytes are the least")]
    Budget {
        /// What was given.
        budget_bytes: u64,
        /// Bricks that it must hold.
        least: u64,
        /// Bytes of one.
        brick_bytes: u64,
    },
    /// The system gave no thread.
    #[error("no thread to load bricks with: {0}")]
    Thread(#[source] std::io::Error),
}
