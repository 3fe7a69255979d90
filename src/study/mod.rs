//! What runs the rest many times and reports: builds and frames measured.

mod builds;
mod frames;

pub use builds::{Build, BuildError, PaperTable, thresholds_for};
pub use frames::{Frames, orbit_frames};
