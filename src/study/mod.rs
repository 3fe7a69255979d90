//! What runs the rest many times and reports: the error of an octree, builds and frames measured, thresholds tuned.

mod builds;
mod error;
mod frames;
pub mod tune;

pub use builds::{Build, BuildError, PaperTable, thresholds_for};
pub use error::{ErrorFigures, ErrorSampling, FieldError};
pub use frames::{Frames, orbit_frames};
