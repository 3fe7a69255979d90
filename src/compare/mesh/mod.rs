//! How far meshes are from each other: their surfaces by distance, their fields by norms.

mod distance;
mod field;
mod nearest;
mod painting;
mod surface;
#[cfg(test)]
mod tests;

pub use distance::{DistanceOptions, OneSided, SurfaceDistances};
pub use field::{FieldDifference, Largest, Norms, OnMesh};
pub use nearest::{Hit, Nearest};
pub use painting::paint_surface;
pub use surface::{Surface, SurfaceError, SurfaceFigures, components};
