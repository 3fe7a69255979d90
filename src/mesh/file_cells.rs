//! Which cell of the file a tet is, or is a part of.

use super::CellType;

/// From tets to cells as the file numbers them: from 0, through all its pieces or blocks, those that were left out (ghosts, blanked ones,
/// surfaces) counted too.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileCells {
    /// What the cells are, if they all are of one type.
    pub shape: CellType,
    /// How many tets a cell is split into, where `numbers` is empty.
    pub tets_per_cell: usize,
    /// The cell of each tet; nothing where none was left out, since the cells then follow each other as the tets do. 4 bytes a tet otherwise.
    pub numbers: Vec<u32>,
    /// The type of the cell of each tet; nothing where all are alike.
    pub types: Vec<CellType>,
}

impl Default for FileCells {
    fn default() -> Self {
        FileCells { shape: CellType::TETRA, tets_per_cell: 1, numbers: vec![], types: vec![] }
    }
}

impl FileCells {
    /// The number in the file of the cell that a tet is, or is a part of.
    pub fn number(&self, tet: usize) -> usize {
        self.numbers.get(tet).map_or(tet / self.tets_per_cell, |&cell| cell as usize)
    }

    /// The type of that cell.
    pub fn cell_type(&self, tet: usize) -> CellType {
        self.types.get(tet).copied().unwrap_or(self.shape)
    }

    /// Whether every tet is a cell of its own.
    pub fn is_tets(&self) -> bool {
        self.types.is_empty() && self.shape == CellType::TETRA
    }
}
