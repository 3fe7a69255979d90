//! [`UnstructuredGrid`]: what a file of cells of any type holds, before its cells with a volume become tets.

use super::{CellType, DataArray, MeshParts};
use glam::DVec3;

/// Cells of any type, one behind the other, with their points.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cells {
    types: Vec<CellType>,
    /// Where the points of each cell end in `connectivity`.
    ends: Vec<u32>,
    connectivity: Vec<u32>,
}

/// More points of cells in all than u32 counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("its cells have more than {} points in all, which octetra cannot index", u32::MAX)]
pub struct TooManyCellPoints;

impl Cells {
    /// No cells, with room for so many and their points.
    pub fn with_capacity(cells: usize, points: usize) -> Self {
        Cells { types: Vec::with_capacity(cells), ends: Vec::with_capacity(cells), connectivity: Vec::with_capacity(points) }
    }

    /// Adds a cell. Of a polyhedron, `points` are its faces: how many, then of each how many points and which.
    pub fn push(&mut self, cell_type: CellType, points: &[u32]) -> Result<(), TooManyCellPoints> {
        let end = u32::try_from(self.connectivity.len() + points.len()).map_err(|_| TooManyCellPoints)?;
        self.types.push(cell_type);
        self.connectivity.extend_from_slice(points);
        self.ends.push(end);
        Ok(())
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.types.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.types.is_empty()
    }

    /// A cell's type and its points, of a polyhedron its faces.
    pub fn get(&self, cell: usize) -> (CellType, &[u32]) {
        let start = if cell == 0 { 0 } else { self.ends[cell - 1] as usize };
        (self.types[cell], &self.connectivity[start..self.ends[cell] as usize])
    }

    /// All cells in order.
    pub fn iter(&self) -> impl Iterator<Item = (CellType, &[u32])> {
        (0..self.len()).map(|cell| self.get(cell))
    }

    /// How many cells there are of each type, by type.
    pub fn counts(&self) -> Vec<(CellType, u64)> {
        let mut counts = [0u64; 256];
        self.types.iter().for_each(|cell_type| counts[usize::from(cell_type.0)] += 1);
        (0..=u8::MAX).map(|t| (CellType(t), counts[usize::from(t)])).filter(|&(_, count)| count > 0).collect()
    }

    /// Bytes that it takes in memory.
    pub fn bytes(&self) -> usize {
        self.types.len() + size_of_val(&self.ends[..]) + size_of_val(&self.connectivity[..])
    }
}

/// Points, cells of any type and arrays, as a file has them; nothing is checked yet. Cells are of VTK's types with VTK's order of nodes,
/// whatever the format; those without a volume are there too.
#[derive(Debug, Clone, Default)]
pub struct UnstructuredGrid {
    /// Points in world coordinates.
    pub points: Vec<DVec3>,
    /// Cells, by indices of points.
    pub cells: Cells,
    /// Arrays with one tuple a point; NaN where the file has no value.
    pub point_data: Vec<DataArray>,
    /// Arrays with one tuple a cell, those without a volume included; NaN where the file has no value.
    pub cell_data: Vec<DataArray>,
    /// The array that the file marks as its scalars, if any.
    pub active_scalars: Option<String>,
    /// The number in the file of each cell, from 0; empty if cells are numbered as they follow each other here.
    pub numbers: Vec<u32>,
    /// Whether points at one place are one, since the file is of pieces that each have their own.
    pub merges_points: bool,
    /// What of the file is not here, one sentence each, such as `array "name" is text and was left out`.
    pub notes: Vec<String>,
}

impl UnstructuredGrid {
    /// Puts another grid behind this one. Arrays that one of them lacks are left out, which its notes say.
    pub fn append(&mut self, other: UnstructuredGrid) -> Result<(), TooManyCellPoints> {
        let UnstructuredGrid { points, cells, point_data, cell_data, active_scalars, numbers, merges_points, notes } = other;
        let base = u32::try_from(self.points.len()).map_err(|_| TooManyCellPoints)?;
        u32::try_from(self.points.len() + points.len()).map_err(|_| TooManyCellPoints)?;
        if cells.is_empty() && points.is_empty() {
            return Ok(());
        }
        if self.cells.is_empty() && self.points.is_empty() {
            *self = UnstructuredGrid { points, cells, point_data, cell_data, active_scalars, numbers, merges_points, notes };
            return Ok(());
        }
        if !(self.numbers.is_empty() && numbers.is_empty()) {
            let own = self.cells.len() as u32;
            if self.numbers.is_empty() {
                self.numbers = (0..own).collect();
            }
            let first = self.numbers.last().map_or(0, |&last| last + 1);
            let more = (0..cells.len()).map(|cell| numbers.get(cell).copied().unwrap_or(cell as u32));
            self.numbers.extend(more.map(|number| first.saturating_add(number)));
        }
        let mut moved = Vec::new();
        for (cell_type, nodes) in cells.iter() {
            moved.clear();
            if cell_type == CellType::POLYHEDRON {
                // How many faces, then of each how many points and which.
                let mut next_count = 1;
                for (i, &word) in nodes.iter().enumerate() {
                    let is_count = i == 0 || i == next_count;
                    if i == next_count {
                        next_count = i.saturating_add(1 + word as usize);
                    }
                    moved.push(if is_count { word } else { word.wrapping_add(base) });
                }
            } else {
                moved.extend(nodes.iter().map(|node| node.wrapping_add(base)));
            }
            self.cells.push(cell_type, &moved)?;
        }
        let mut dropped = DataArray::append_all(&mut self.point_data, point_data);
        dropped.extend(DataArray::append_all(&mut self.cell_data, cell_data));
        self.points.extend(points);
        self.notes.extend(notes);
        self.notes.extend(dropped.iter().map(|name| format!("array \"{name}\" is not in all pieces and was left out")));
        self.merges_points |= merges_points;
        if self.active_scalars.is_none() {
            self.active_scalars = active_scalars;
        }
        Ok(())
    }
}

impl TryFrom<MeshParts> for UnstructuredGrid {
    type Error = TooManyCellPoints;

    /// Tets as cells. Cells that were cut into tets stay cut.
    fn try_from(parts: MeshParts) -> Result<Self, TooManyCellPoints> {
        let MeshParts { points, tets, point_data, cell_data, active_scalars, notes, .. } = parts;
        let mut cells = Cells::with_capacity(tets.len(), 4 * tets.len());
        tets.iter().try_for_each(|tet| cells.push(CellType::TETRA, tet))?;
        Ok(UnstructuredGrid { points, cells, point_data, cell_data, active_scalars, notes, ..UnstructuredGrid::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_found_again_and_counted() {
        let mut cells = Cells::with_capacity(3, 13);
        cells.push(CellType::TETRA, &[0, 1, 2, 3]).expect("few");
        cells.push(CellType::VERTEX, &[7]).expect("few");
        cells.push(CellType::HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7]).expect("few");
        assert_eq!(cells.get(1), (CellType::VERTEX, &[7][..]));
        assert_eq!(cells.iter().map(|(_, points)| points.len()).collect::<Vec<_>>(), [4, 1, 8]);
        assert_eq!(cells.counts(), [(CellType::VERTEX, 1), (CellType::TETRA, 1), (CellType::HEXAHEDRON, 1)]);
        assert!(Cells::default().is_empty() && Cells::default().counts().is_empty());
    }
}
