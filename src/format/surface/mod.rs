//! Files of surfaces, which meshes are compared with: STL, PLY, OBJ and OFF.
//!
//! All give triangles, quads and polygons as the file has them, corners of one's number and of two as points and lines. The readers are our
//! own: the crates for these formats reserve memory by what a header says, or make triangles of polygons, or know one of the encodings only.

pub(super) mod obj;
pub(super) mod off;
pub(super) mod ply;
mod ply_write;
pub(super) mod stl;

pub use ply_write::write_ply;

use super::ParseError;
use crate::mesh::{CellType, Cells};

/// Adds a face by its corners.
fn push_face(cells: &mut Cells, corners: &[u32]) -> Result<(), ParseError> {
    let cell_type = match corners.len() {
        1 => CellType::VERTEX,
        2 => CellType::LINE,
        3 => CellType::TRIANGLE,
        4 => CellType::QUAD,
        _ => CellType::POLYGON,
    };
    Ok(cells.push(cell_type, corners)?)
}

#[cfg(test)]
mod tests;
