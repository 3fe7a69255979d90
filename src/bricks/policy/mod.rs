//! Which brick leaves a full cache: one trait, the textbook policies, the paper's, and our own.
//!
//! A policy keeps books of what is resident and proposes what to evict; the cache decides and tells it. The same policies serve the
//! simulation of traces and the cache in memory.

mod areas;
mod distance;
mod forecast;
mod motion;
mod optimum;
mod ordered;

use super::{BrickKey, Pyramid, SliceSet};
pub use areas::Areas;
pub use distance::{Mdfo, MdfoParams};
pub use forecast::Forecast;
pub use optimum::Optimum;
pub use ordered::Ordered;
use std::fmt::Debug;

/// Decides which brick leaves a cache.
pub trait EvictionPolicy: Send + Debug {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// A frame begins, with the slices where they are in it. What [`EvictionPolicy::victim`] was refused may be proposed again.
    fn frame(&mut self, slices: &SliceSet);
    /// What [`EvictionPolicy::victim`] was refused may be proposed again, within the frame.
    fn reconsider(&mut self);
    /// A resident brick is used by the current frame.
    fn hit(&mut self, key: BrickKey);
    /// A brick has become resident.
    fn insert(&mut self, key: BrickKey);
    /// A brick is resident no more.
    fn remove(&mut self, key: BrickKey);
    /// The resident brick to evict, of those that `may` be evicted; it stays on the books until it is removed. What `may` refuses is not
    /// asked for again within the frame, but for [`EvictionPolicy::reconsider`].
    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey>;
}

/// The policies that need to know nothing of the future, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Policy {
    /// Least recently used first.
    Lru,
    /// Least frequently used first.
    Lfu,
    /// First in, first out.
    Fifo,
    /// Equation (3) with the paper's constants.
    Mdfo,
    /// Farthest from all slices first.
    Distance,
    /// Our own: least likely to be needed soon, by how the slices have moved.
    #[default]
    Forecast,
}

impl Policy {
    /// All of them.
    pub const ALL: [Policy; 6] = [Policy::Lru, Policy::Lfu, Policy::Fifo, Policy::Mdfo, Policy::Distance, Policy::Forecast];

    /// What it is called, as its [`EvictionPolicy::name`].
    pub fn name(self) -> &'static str {
        match self {
            Policy::Lru => "LRU",
            Policy::Lfu => "LFU",
            Policy::Fifo => "FIFO",
            Policy::Mdfo => "MDFO",
            Policy::Distance => "distance",
            Policy::Forecast => "forecast",
        }
    }

    /// The policy with empty books.
    pub fn build(self, pyramid: &Pyramid) -> Box<dyn EvictionPolicy> {
        match self {
            Policy::Lru => Box::new(Ordered::lru()),
            Policy::Lfu => Box::new(Ordered::lfu()),
            Policy::Fifo => Box::new(Ordered::fifo()),
            Policy::Mdfo => Box::new(Mdfo::new(pyramid, MdfoParams::default())),
            Policy::Distance => Box::new(Mdfo::distance(pyramid)),
            Policy::Forecast => Box::new(Forecast::new(pyramid)),
        }
    }
}

#[cfg(test)]
mod tests;
