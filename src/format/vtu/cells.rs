//! Cells of any type in `.vtu` and `.vtp` files.
//!
//! Polyhedra have their faces in arrays of their own, in one of two layouts: `faces` with `faceoffsets`, or, from version 2.3,
//! `face_connectivity`, `face_offsets`, `polyhedron_to_faces` and `polyhedron_offsets`; told by which of them are there.

use super::number::Item;
use super::xml::{Array, Piece};
use super::{ArrayError, DROPPED_GHOSTS, Of, Reader, UnstructuredGrid, VtuError};
use crate::mesh::{CellType, Cells};

/// The faces of a piece's polyhedra.
enum Faces {
    /// One stream, and where that of each cell ends in it; -1 for other cells.
    Stream(Vec<u32>, Vec<i64>),
    /// Points, where those of each face end; faces, where those of each cell end.
    Lists { points: Vec<u32>, face_ends: Vec<u64>, faces: Vec<u64>, cell_ends: Vec<u64> },
}

impl Reader<'_> {
    /// All pieces, one behind the other.
    pub(super) fn grid(&self) -> Result<UnstructuredGrid, VtuError> {
        let (mut point_data, mut cell_data) = (self.common_arrays(Of::Points)?, self.common_arrays(Of::Cells)?);
        let mut grid = UnstructuredGrid { merges_points: self.head.pieces.len() > 1, ..UnstructuredGrid::default() };
        let (mut first_cell, mut is_numbered) = (0u32, false);
        for (index, piece) in self.head.pieces.iter().enumerate() {
            let kept = if piece.cells > 0 { self.kept(index, Of::Cells, DROPPED_GHOSTS)? } else { None };
            let cells = first_cell..first_cell + piece.cells as u32; // all cells were counted
            if kept.is_some() && !is_numbered {
                (is_numbered, grid.numbers) = (true, (0..first_cell).collect());
            }
            if is_numbered {
                let is_kept = |cell: &u32| kept.as_ref().is_none_or(|kept| kept[(cell - first_cell) as usize]);
                grid.numbers.extend(cells.clone().filter(is_kept));
            }
            first_cell = cells.end;
            let base = grid.points.len() as u32; // all points were counted
            if piece.topology.is_empty() && piece.groups.iter().any(|group| group.cells > 0) {
                self.append_groups(index, base, &mut grid.cells, kept.as_deref())?;
            } else if piece.cells > 0 {
                self.append_cells(index, base, &mut grid.cells, kept.as_deref())?;
            }
            self.append_points(index, &mut grid.points)?;
            for (of, arrays, kept) in [(Of::Points, &mut point_data, None), (Of::Cells, &mut cell_data, kept.as_deref())] {
                self.append_arrays(index, of, arrays, kept, &mut grid.notes)?;
            }
        }
        grid.cells_in_file = first_cell;
        grid.active_scalars = self.active_scalars(&point_data, &cell_data);
        (grid.point_data, grid.cell_data) = (point_data, cell_data);
        Ok(grid)
    }

    /// The vertices, lines, polygons and strips of a `.vtp` piece.
    fn append_groups(&self, index: usize, base: u32, cells: &mut Cells, kept: Option<&[bool]>) -> Result<(), VtuError> {
        let (mut cell, mut moved) = (0, Vec::new());
        for (kind, group) in self.head.pieces[index].groups.iter().enumerate().filter(|(_, group)| group.cells > 0) {
            let element = ["Verts", "Lines", "Polys", "Strips"][kind];
            let array = |name| self.named(&group.topology, element, index, name, group.cells);
            let ends: Vec<u64> = self.all(index, array("offsets")?, group.cells)?;
            let connectivity: Vec<u32> = self.all(index, array("connectivity")?, last(&ends))?;
            let mut start = 0;
            for &end in &ends {
                let points = self.slice(index, "offsets", &connectivity, &mut start, end)?;
                let cell_type = match (kind, points.len()) {
                    (0, 1) => CellType::VERTEX,
                    (0, _) => CellType::POLY_VERTEX,
                    (1, 2) => CellType::LINE,
                    (1, _) => CellType::POLY_LINE,
                    (2, 3) => CellType::TRIANGLE,
                    (2, 4) => CellType::QUAD,
                    (2, _) => CellType::POLYGON,
                    _ => CellType::TRIANGLE_STRIP,
                };
                if kept.is_none_or(|kept| kept[cell]) {
                    moved.clear();
                    self.push_moved(index, points, base, &mut moved)?;
                    cells.push(cell_type, &moved)?;
                }
                cell += 1;
            }
        }
        Ok(())
    }

    /// The cells of a `.vtu` piece.
    fn append_cells(&self, index: usize, base: u32, cells: &mut Cells, kept: Option<&[bool]>) -> Result<(), VtuError> {
        let piece = &self.head.pieces[index];
        let types: Vec<u8> = self.all(index, self.topology(index, "types")?, piece.cells)?;
        let ends: Vec<u64> = self.all(index, self.topology(index, "offsets")?, piece.cells)?;
        let connectivity: Vec<u32> = match last(&ends) {
            0 => vec![],
            points => self.all(index, self.topology(index, "connectivity")?, points)?,
        };
        let faces = if types.contains(&CellType::POLYHEDRON.0) { Some(self.faces(index, piece)?) } else { None };
        let (mut start, mut faces_start, mut moved, mut named) = (0, 0, Vec::new(), 0u64);
        for (cell, (&cell_type, &end)) in types.iter().zip(&ends).enumerate() {
            let (cell_type, points) = (CellType(cell_type), self.slice(index, "offsets", &connectivity, &mut start, end)?);
            moved.clear();
            match (&faces, cell_type) {
                (Some(Faces::Stream(stream, ends)), CellType::POLYHEDRON) => {
                    let end = u64::try_from(ends[cell]).unwrap_or(0);
                    self.push_stream(index, self.slice(index, "faceoffsets", stream, &mut faces_start, end)?, base, &mut moved)?;
                }
                (Some(Faces::Lists { points, face_ends, faces, cell_ends }), CellType::POLYHEDRON) => {
                    let own = self.slice(index, "polyhedron_offsets", faces, &mut faces_start, cell_ends[cell])?;
                    moved.push(own.len() as u32);
                    for &face in own {
                        let end = face_ends[face as usize]; // as many as the highest names
                        let mut start = if face == 0 { 0 } else { face_ends[face as usize - 1] };
                        let ring = self.slice(index, "face_offsets", points, &mut start, end)?;
                        // A face has two cells: a file cannot have its reader copy one again and again.
                        named += ring.len() as u64 + 1;
                        if named > 16 * (points.len() + faces.len()) as u64 + 1024 {
                            let expected = "faces of two cells each".into();
                            let error = ArrayError::Number { index: cell as u64, found: format!("{named} corners so far"), expected };
                            return Err(self.error(index, "cells array \"polyhedron_to_faces\"", error));
                        }
                        moved.push(ring.len() as u32);
                        self.push_moved(index, ring, base, &mut moved)?;
                    }
                }
                _ => self.push_moved(index, points, base, &mut moved)?,
            }
            if kept.is_none_or(|kept| kept[cell]) {
                cells.push(cell_type, &moved)?;
            }
        }
        Ok(())
    }

    /// The faces of a piece that has polyhedra.
    fn faces(&self, index: usize, piece: &Piece) -> Result<Faces, VtuError> {
        let array = |name| self.topology(index, name);
        if piece.topology.iter().any(|array| array.name == "faceoffsets") {
            let ends: Vec<i64> = self.all(index, array("faceoffsets")?, piece.cells)?;
            let len = ends.iter().copied().max().unwrap_or(0).max(0) as u64;
            return Ok(Faces::Stream(self.all(index, array("faces")?, len)?, ends));
        }
        let cell_ends: Vec<u64> = self.all(index, array("polyhedron_offsets")?, piece.cells)?;
        let faces: Vec<u64> = self.all(index, array("polyhedron_to_faces")?, last(&cell_ends))?;
        let count = faces.iter().max().map_or(0, |&face| face.saturating_add(1));
        let face_ends: Vec<u64> = self.all(index, array("face_offsets")?, count)?;
        let points = self.all(index, array("face_connectivity")?, last(&face_ends))?;
        Ok(Faces::Lists { points, face_ends, faces, cell_ends })
    }

    /// All items of an array.
    fn all<I: Item>(&self, index: usize, array: &Array, items: u64) -> Result<Vec<I>, VtuError> {
        let mut all = Vec::new();
        self.arrays.append(array, items, &mut all).map_err(|e| self.error(index, &format!("cells array \"{}\"", array.name), e))?;
        Ok(all)
    }

    /// The items from `start` to `end`, which becomes the new start; `array` is the one that says where they end.
    fn slice<'a, T>(&self, index: usize, array: &str, all: &'a [T], start: &mut u64, end: u64) -> Result<&'a [T], VtuError> {
        let range = (*start).min(usize::MAX as u64) as usize..end.min(usize::MAX as u64) as usize;
        let found = all.get(range).ok_or_else(|| {
            let expected = format!("one from {start} to {}", all.len()).into();
            self.error(index, &format!("cells array \"{array}\""), ArrayError::Number { index: 0, found: end.to_string(), expected })
        })?;
        *start = end;
        Ok(found)
    }

    /// Adds points, whose numbers in the piece begin at `base` in the mesh.
    fn push_moved(&self, index: usize, points: &[u32], base: u32, out: &mut Vec<u32>) -> Result<(), VtuError> {
        let count = self.head.pieces[index].points;
        match points.iter().position(|&point| u64::from(point) >= count) {
            None => out.extend(points.iter().map(|point| point + base)),
            Some(place) => {
                let expected = format!("a point index from 0 to {}", i128::from(count) - 1).into();
                let error = ArrayError::Number { index: place as u64, found: points[place].to_string(), expected };
                return Err(self.error(index, "the list of a cell's points", error));
            }
        }
        Ok(())
    }

    /// Adds a stream of faces.
    fn push_stream(&self, index: usize, stream: &[u32], base: u32, out: &mut Vec<u32>) -> Result<(), VtuError> {
        let Some((&faces, mut rest)) = stream.split_first() else { return Ok(()) };
        out.push(faces);
        while let Some((&count, behind)) = rest.split_first() {
            let (ring, behind) = behind.split_at(behind.len().min(count as usize)); // one that is cut off is refused with its cell
            out.push(count);
            self.push_moved(index, ring, base, out)?;
            rest = behind;
        }
        Ok(())
    }

    /// An array in an element of cells.
    pub(super) fn named<'a>(
        &self,
        arrays: &'a [Array],
        element: &str,
        index: usize,
        name: &str,
        cells: u64,
    ) -> Result<&'a Array, VtuError> {
        let array = || format!("\"{name}\" in <{element}>");
        let missing = || VtuError::Missing { piece: self.piece_name(index), array: array(), items: cells, of: "cells" };
        arrays.iter().find(|array| array.name == name).ok_or_else(missing)
    }
}

fn last(ends: &[u64]) -> u64 {
    ends.last().copied().unwrap_or(0)
}
