//! Regular volumes: one number a point of a regular grid.

pub mod generate;
mod grid;
mod samples;

pub use grid::{Grid, GridError, GridFrame, pick_component};
pub(crate) use samples::with_voxels;
pub use samples::{Samples, Voxel};
