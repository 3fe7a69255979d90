//! Which brick leaves a full cache: one trait, the textbook policies, the paper's, and our own.
//!
//! A policy keeps books of what is resident and proposes what to evict; the cache decides and tells it. The same policies serve the
//! simulation of traces and the cache in memory.

mod ordered;

use super::{BrickKey, SliceSet};
pub use ordered::Ordered;
use std::fmt::Debug;

/// Decides which brick leaves a cache.
pub trait EvictionPolicy: Send + Debug {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// A frame begins, with the slices where they are in it. What [`EvictionPolicy::victim`] was refused may be proposed again.
    fn frame(&mut self, slices: &SliceSet);
    /// A resident brick is used by the current frame.
    fn hit(&mut self, key: BrickKey);
    /// A brick has become resident.
    fn insert(&mut self, key: BrickKey);
    /// A brick is resident no more.
    fn remove(&mut self, key: BrickKey);
    /// The resident brick to evict, of those that `may` be evicted; it stays on the books until it is removed. What `may` refuses is not
    /// asked for again within the frame.
    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey>;
}
