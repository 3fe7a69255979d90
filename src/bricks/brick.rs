//! One brick, what is known of it beforehand, and where bricks come from.

use super::{BrickKey, Pyramid};
use crate::volume::{GridFrame, Samples};
use std::fmt::Debug;

/// The voxels of one brick: [`super::BRICK_EDGE`]^3 of them, x fastest, then y, then z. Beyond the end of the volume the last voxel is
/// repeated.
#[derive(Debug, Clone, PartialEq)]
pub struct Brick {
    /// The voxels, in the volume's type. NaN means missing.
    pub samples: Samples,
}

/// What the values of a brick are like, known without loading it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrickStatistics {
    /// Smallest and largest known value of level 0 in the brick's part of the volume; both NaN where none is known.
    pub range: [f64; 2],
    /// Entropy in bits, 0 to 8, of the brick's own known voxels: of a histogram of 256 bins over their range, or of one bin a value where integers
    /// span fewer than 256 (Shannon; used as the third paper does).
    pub entropy: f32,
    /// Share of the voxels of level 0 in the brick's part of the volume that are known, 0 to 1.
    pub known: f32,
}

/// Where bricks come from: a store, or numbers made up. All methods may be called from several threads.
pub trait BrickSource: Send + Sync + Debug {
    /// Which bricks there are.
    fn pyramid(&self) -> &Pyramid;
    /// Where voxel (0, 0, 0) of level 0 lies in the world, and the steps to the next ones.
    fn frame(&self) -> &GridFrame;
    /// What the numbers are called.
    fn name(&self) -> &str;
    /// Smallest and largest value of the volume.
    fn range(&self) -> [f64; 2];
    /// Bytes of one voxel in memory.
    fn voxel_bytes(&self) -> usize;
    /// What is known of a brick; `None` where that cannot be read.
    fn statistics(&self, key: BrickKey) -> Option<BrickStatistics>;
    /// Reads a brick. The error says which file or object failed.
    fn load(&self, key: BrickKey) -> std::io::Result<Brick>;
}
