//! The tet mesh: validated points, tets and arrays; the scalar field picked from them; neighbours, the boundary surface, and the
//! tet at a point; how well its tets are shaped.

pub mod adjacency;
pub mod boundary;
mod cell_type;
mod compact;
mod field;
mod file_cells;
pub mod generate;
mod layered;
mod locator;
mod pick;
pub mod quality;
mod report;
mod structured;
mod tet_mesh;
mod to_tets;
mod unstructured;

pub use boundary::BoundarySurface;
pub use cell_type::{CellType, counts_in_words, thousands};
pub use compact::CompactMesh;
pub use field::{Association, Component, FieldError, FieldSelection, NotAComponent, ScalarField};
pub use file_cells::FileCells;
pub use layered::{ArrayLayout, LayeredMesh, Precision, collect};
pub use locator::{Locator, Place};
pub use report::MeshReport;
pub use structured::{StructuredBlock, split_into_tets};
pub use tet_mesh::{DataArray, MeshError, MeshParts, TetMesh, Values};
pub use to_tets::to_tets;
pub(crate) use to_tets::triangulate_face;
pub use unstructured::{Cells, TooManyCellPoints, UnstructuredGrid};
