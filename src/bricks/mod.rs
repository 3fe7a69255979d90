//! Volumes larger than memory: a pyramid of bricks on disk, slices through it, and caches that know where the slices are.
//!
//! ```text
//! SEG-Y, volume, mesh ─build─▶ STORE.zarr (levels of 64^3 bricks, statistics of each) ─BrickSource─▶ memory ─▶ GPU ─▶ slices
//! ```
//!
//! # Levels and index space
//!
//! Level 0 is the volume as it came; every further level halves the resolution along each axis, rounded up, until all of it fits in one
//! brick. Positions are *index space*: voxel (i, j, k) of level 0 has its middle at (i, j, k); voxel j of level l is the mean of voxels
//! `2^l j .. 2^l (j + 1)` of level 0, and has its middle at `2^l (j + 1/2) - 1/2`. The paper counts levels the other way, from the coarsest.

pub mod brick;
pub mod cache;
pub mod keys;
pub mod memory;
pub mod plane;
pub mod policy;
pub mod prefetch;
pub mod pyramid;
pub mod sample;
pub mod screen;
pub mod simulate;
pub mod slice;
pub mod slots;
pub mod store;
pub mod trace;
pub mod wanted;

pub use brick::{Brick, BrickSource, BrickStatistics};
pub use cache::{BrickCache, CacheCounters, CacheError, CacheOptions, Stage};
pub use keys::{KeyMap, KeySet};
pub use memory::GridBricks;
pub use plane::SlicePlane;
pub use policy::{EvictionPolicy, Policy};
pub use pyramid::{BRICK_EDGE, BrickKey, Pyramid};
pub use sample::Interpolation;
pub use slice::{Slice, SliceFrame};
pub use store::{Store, StoreError};
pub use trace::{Demand, Motion, Needs, SliceSet, Trace, TraceError};
pub use wanted::{Detail, DetailRule, wanted};
