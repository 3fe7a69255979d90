//! [`UnstructuredGrid`]: what a file of cells of any type holds, before its cells with a volume become tets.

use super::{CellType, DataArray, MeshParts, thousands};
use glam::DVec3;
use rayon::prelude::*;

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

    /// Gives every point of every cell another number.
    fn renumber(&mut self, number: impl Fn(u32) -> u32) {
        let mut start = 0;
        for (&cell_type, &end) in self.types.iter().zip(&self.ends) {
            let nodes = &mut self.connectivity[start..end as usize];
            start = end as usize;
            if cell_type != CellType::POLYHEDRON {
                nodes.iter_mut().for_each(|node| *node = number(*node));
                continue;
            }
            // How many faces, then of each how many points and which.
            let mut next_count = 1;
            for (i, word) in nodes.iter_mut().enumerate().skip(1) {
                if i == next_count {
                    next_count = i.saturating_add(1 + *word as usize);
                } else {
                    *word = number(*word);
                }
            }
        }
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
    /// How many cells the file has, those that are not here counted; 0: as many as are here.
    pub cells_in_file: u32,
    /// Whether points at one place are one, since the file is of pieces that each have their own.
    pub merges_points: bool,
    /// What of the file is not here, one sentence each, such as `array "name" is text and was left out`.
    pub notes: Vec<String>,
}

impl UnstructuredGrid {
    /// How many cells the file has.
    fn file_count(&self) -> u32 {
        if self.cells_in_file > 0 { self.cells_in_file } else { self.cells.len() as u32 }
    }

    /// Takes points with the same coordinates for one, the first, with its values, if the file is of pieces; its notes say how many.
    pub fn merge_points(&mut self) {
        if !std::mem::take(&mut self.merges_points) || self.points.len() > u32::MAX as usize {
            return;
        }
        let key = |p: &DVec3| (*p + DVec3::ZERO).to_array().map(f64::to_bits); // -0 is 0
        let mut order: Vec<(u32, [u64; 3])> = self.points.par_iter().enumerate().map(|(i, p)| (i as u32, key(p))).collect();
        order.par_sort_unstable_by_key(|&(i, key)| (key, i));
        let mut first_at = vec![0; self.points.len()];
        for run in order.chunk_by(|a, b| a.1 == b.1) {
            run.iter().for_each(|&(i, _)| first_at[i as usize] = run[0].0);
        }
        drop(order);
        let kept: Vec<u32> = (0..self.points.len() as u32).filter(|&i| first_at[i as usize] == i).collect();
        let merged = self.points.len() - kept.len();
        if merged == 0 {
            return;
        }
        let mut place = vec![0; self.points.len()];
        kept.iter().enumerate().for_each(|(new, &old)| place[old as usize] = new as u32);
        // What is out of range stays so, to be refused with its cell.
        self.cells.renumber(|node| first_at.get(node as usize).map_or(node, |&first| place[first as usize]));
        self.points = kept.iter().map(|&i| self.points[i as usize]).collect();
        // Arrays of another length are refused later, by their names.
        let is_whole = |array: &DataArray| array.components > 0 && array.values.len() == place.len() * array.components;
        if self.point_data.iter().all(is_whole) {
            self.point_data = std::mem::take(&mut self.point_data).into_iter().map(|array| array.gathered(&kept)).collect();
        }
        self.notes
            .push(format!("{} points of several pieces lie where others do and were taken for one with them", thousands(merged as u64)));
    }

    /// Puts another grid behind this one. Arrays that one of them lacks are left out, which its notes say.
    pub fn append(&mut self, other: UnstructuredGrid) -> Result<(), TooManyCellPoints> {
        let (own_count, other_count) = (self.file_count(), other.file_count());
        let UnstructuredGrid { points, mut cells, point_data, cell_data, active_scalars, numbers, merges_points, notes, .. } = other;
        let base = u32::try_from(self.points.len()).map_err(|_| TooManyCellPoints)?;
        u32::try_from(self.points.len() + points.len()).map_err(|_| TooManyCellPoints)?;
        let all_cells = own_count.checked_add(other_count).ok_or(TooManyCellPoints)?;
        if !(self.numbers.is_empty() && numbers.is_empty() && own_count as usize == self.cells.len()) {
            if self.numbers.is_empty() {
                self.numbers = (0..self.cells.len() as u32).collect();
            }
            let more = (0..cells.len()).map(|cell| numbers.get(cell).copied().unwrap_or(cell as u32));
            self.numbers.extend(more.map(|number| own_count.saturating_add(number)));
        }
        self.cells_in_file = all_cells;
        self.notes.extend(notes);
        if cells.is_empty() && points.is_empty() {
            return Ok(());
        }
        if self.cells.is_empty() && self.points.is_empty() {
            (self.points, self.cells, self.point_data, self.cell_data) = (points, cells, point_data, cell_data);
            (self.active_scalars, self.merges_points) = (active_scalars, merges_points);
            return Ok(());
        }
        cells.renumber(|node| node.wrapping_add(base));
        cells.iter().try_for_each(|(cell_type, nodes)| self.cells.push(cell_type, nodes))?;
        let mut dropped = DataArray::append_all(&mut self.point_data, point_data);
        dropped.extend(DataArray::append_all(&mut self.cell_data, cell_data));
        self.points.extend(points);
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
