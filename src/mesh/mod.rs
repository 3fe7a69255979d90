//! The tet mesh: validated points, tets and arrays; the scalar field picked from them; neighbours and the boundary surface.

pub mod adjacency;
pub mod boundary;
mod compact;
mod field;
pub mod generate;
mod layered;
mod pick;
mod structured;
mod tet_mesh;

pub use boundary::BoundarySurface;
pub use compact::CompactMesh;
pub use field::{Association, Component, FieldError, FieldSelection, NotAComponent, ScalarField};
pub use layered::{ArrayLayout, LayeredMesh, Precision, collect};
pub use structured::{StructuredBlock, split_into_tets};
pub use tet_mesh::{DataArray, MeshError, MeshParts, TetMesh, Values};
