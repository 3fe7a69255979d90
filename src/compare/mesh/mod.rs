//! How far meshes are from each other: their surfaces by distance, their fields by norms.

mod distance;
mod field;
mod nearest;
mod surface;
#[cfg(test)]
mod tests;

pub use distance::{DistanceOptions, OneSided, SurfaceDistances};
pub use field::{FieldDifference, Largest, Norms, OnMesh};
pub use nearest::{Hit, Nearest};
pub use surface::{Surface, SurfaceError, SurfaceFigures, components};
