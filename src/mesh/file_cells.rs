//! Which cell of the file a tet is, or is a part of.

/// What kind of cells a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CellShape {
    /// Linear tetrahedra: a tet is a cell.
    #[default]
    Tetrahedron,
    /// Hexahedra of a structured grid, five tets each.
    Hexahedron,
}

impl CellShape {
    /// The name in words.
    pub fn name(self) -> &'static str {
        match self {
            CellShape::Tetrahedron => "tetrahedron",
            CellShape::Hexahedron => "hexahedron",
        }
    }

    /// Tets that a cell is split into.
    pub fn tets(self) -> usize {
        match self {
            CellShape::Tetrahedron => 1,
            CellShape::Hexahedron => 5,
        }
    }
}

/// From tets to cells as the file numbers them: from 0, through all its pieces or blocks, those that were left out (ghosts, blanked ones)
/// counted too.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FileCells {
    /// What the cells are.
    pub shape: CellShape,
    /// The cell of each tet; nothing where none was left out, since the cells then follow each other as the tets do. 4 bytes a tet otherwise.
    pub numbers: Vec<u32>,
}

impl FileCells {
    /// The number in the file of the cell that a tet is, or is a part of.
    pub fn number(&self, tet: usize) -> usize {
        self.numbers.get(tet).map_or(tet / self.shape.tets(), |&cell| cell as usize)
    }
}
