//! Regular volumes: one number a point of a regular grid.

pub mod generate;
mod grid;
mod interpolate;
mod numbers;
mod samples;
mod voxel_source;

pub use grid::{Grid, GridError, GridFrame, pick_component};
pub use numbers::Numbers;
pub(crate) use samples::with_voxels;
pub use samples::{Samples, Voxel};
pub use voxel_source::{VoxelSource, VoxelType, box_points};
