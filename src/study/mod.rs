//! What runs the rest many times and reports: the error of an octree, builds and frames measured, thresholds tuned, values
//! counted; values at places.

mod builds;
mod chart;
mod error;
mod frames;
mod grid_error;
mod histogram;
pub mod over_time;
pub mod probe;
mod skipping;
pub mod slices;
pub mod tune;

pub use builds::{Build, BuildError, PaperTable, thresholds_for};
pub use chart::{Chart, ChartError};
pub use error::{ErrorFigures, ErrorSampling, FieldError};
pub use frames::{Frames, median, orbit_frames};
pub use histogram::{Bins, Histogram};
pub use skipping::{PaperSkipping, SkipFigures, compare_skipping, fixed_step};
