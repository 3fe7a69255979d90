//! VTK's XML format for unstructured grids, `.vtu`: every encoding, compressor, header type, byte order and number type that VTK writes.
//!
//! [`xml`] reads the markup and remembers where the numbers lie, [`data`] turns them into arrays, this file puts the pieces together.
//! The rules where the format leaves a choice:
//!
//! * Pieces are put one behind the other. An array that one of them (empty ones aside) lacks is left out, as by `vtkAppendFilter`.
//! * Ghost cells that another piece holds too, cells that were refined, and hidden cells are dropped; the ghost arrays with them.
//! * Text and bit arrays and field data are not read. Of arrays with the same name in one piece the first counts.
//! * `byte_order` defaults to little-endian, `header_type` to UInt32, `NumberOfComponents` to 1 (for points 3).

mod cells;
mod compress;
pub(super) mod data;
pub(super) mod number;
pub(super) mod parallel;
pub(super) mod structured;
#[cfg(test)]
mod tests;
pub mod write;
pub mod write_grid;
pub(super) mod xml;

pub use data::ArrayError;

use super::Found;
use super::source::Source;
use crate::mesh::{CellType, DataArray, MeshParts, TooManyCellPoints, UnstructuredGrid, Values};
use crate::progress::{Cancelled, Progress};
use data::ArrayReader;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashSet;
use std::io;
use xml::{Array, Head, Kind, Piece, Section};

/// Ghost bits (`vtkDataSetAttributes.h`) of cells that are not the piece's own: duplicate, refined, hidden.
const DROPPED_GHOSTS: u8 = 1 | 8 | 32;

/// Why a file is no mesh that octetra can read. The texts continue the file's name and a colon.
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It is something else.
    #[error("this is not a .vtu file: {0}")]
    NotVtu(String),
    /// It is something else than image data.
    #[error("this is not a .vti file: {0}")]
    NotVti(String),
    /// It is something else than a structured or rectilinear grid, or a collection.
    #[error("this is not a .{suffix} file: {reason}")]
    NotStructured {
        /// "vts", "vtr" or "pvd".
        suffix: &'static str,
        /// What it lacks.
        reason: String,
    },
    /// The points make no volume.
    #[error("holds no cell with a volume: expected at least 2 points along each axis, as far as they are not hidden")]
    NoCells,
    /// The markup is broken.
    #[error("not well-formed XML at byte {at}: {reason}")]
    Xml {
        /// Where, in bytes from the start of the file.
        at: u64,
        /// What is wrong there.
        reason: String,
    },
    /// It could define entities.
    #[error("it declares a document type (DOCTYPE), which .vtu files have no use for; refused")]
    Doctype,
    /// An attribute is missing or makes no sense.
    #[error("{element} has {attribute}=\"{found}\", expected {expected}")]
    Attribute {
        /// The element and its name.
        element: String,
        /// The attribute.
        attribute: &'static str,
        /// Its value, empty if it is missing.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// Its cells have more points than can be indexed.
    #[error("{0}")]
    CellPoints(#[from] TooManyCellPoints),
    /// Indices are u32.
    #[error("has {count} {what} in all, more than the {max} that octetra can index", max = u32::MAX - 1)]
    TooMany {
        /// "points" or "cells".
        what: &'static str,
        /// How many, as text.
        count: u128,
    },
    /// A piece lacks an array.
    #[error("{piece} has no array {array}, expected one for its {items} {of}")]
    Missing {
        /// Which piece.
        piece: String,
        /// What it lacks.
        array: String,
        /// How many points or cells there are.
        items: u64,
        /// "points" or "cells".
        of: &'static str,
    },
    /// An array cannot be read.
    #[error("{array} {reason}")]
    Array {
        /// The array, and the piece where there are several.
        array: String,
        /// What is wrong with it.
        reason: ArrayError,
    },
}

/// Reads a `.vtu` file: its tets, if it has nothing else, or cells of all types. `progress` counts the bytes of its arrays.
pub(super) fn read(source: &Source<'_>, progress: &Progress) -> Result<Found, VtuError> {
    let head = xml::read_head(source, Kind::UnstructuredGrid)?;
    progress.begin("reading", source.len());
    let mesh = Reader { arrays: ArrayReader { source, head: &head, progress }, head: &head };
    mesh.check_counts()?;
    if mesh.is_of_tets()? { mesh.assemble().map(Found::Mesh) } else { mesh.grid().map(Found::Cells) }
}

/// Puts the pieces of one file together.
struct Reader<'a> {
    arrays: ArrayReader<'a>,
    head: &'a Head,
}

/// Reads a `.vtp` file.
pub(super) fn read_surface(source: &Source<'_>, progress: &Progress) -> Result<Found, VtuError> {
    let head = xml::read_head(source, Kind::PolyData)?;
    progress.begin("reading", source.len());
    let mesh = Reader { arrays: ArrayReader { source, head: &head, progress }, head: &head };
    mesh.check_counts()?;
    mesh.grid().map(Found::Cells)
}

/// Whether a file starts as a `.vtp` does.
pub(super) fn recognizes_surface(start: &[u8]) -> bool {
    is_of_type(start, "PolyData")
}

/// Whether a file starts as VTK's XML of a type, such as `UnstructuredGrid`, does.
pub(super) fn is_of_type(start: &[u8], name: &str) -> bool {
    let text = String::from_utf8_lossy(start);
    text.contains("<VTKFile") && ['"', '\''].iter().any(|quote| text.contains(&format!("{quote}{name}{quote}")))
}

/// What the arrays of a section belong to.
#[derive(Clone, Copy)]
enum Of {
    Points,
    Cells,
}

impl Of {
    fn section(self, piece: &Piece) -> &Section {
        match self {
            Of::Points => &piece.point_data,
            Of::Cells => &piece.cell_data,
        }
    }

    fn count(self, piece: &Piece) -> u64 {
        match self {
            Of::Points => piece.points,
            Of::Cells => piece.cells,
        }
    }

    fn array(self, name: &str) -> String {
        match self {
            Of::Points => format!("point array \"{name}\""),
            Of::Cells => format!("cell array \"{name}\""),
        }
    }
}

impl Reader<'_> {
    /// Refuses more points or cells than can be indexed.
    fn check_counts(&self) -> Result<(), VtuError> {
        for (what, of) in [("points", Of::Points), ("cells", Of::Cells)] {
            let count = self.head.pieces.iter().map(|piece| u128::from(of.count(piece))).sum();
            if count > u128::from(u32::MAX - 1) {
                return Err(VtuError::TooMany { what, count });
            }
        }
        Ok(())
    }

    /// Whether all cells are linear tets.
    fn is_of_tets(&self) -> Result<bool, VtuError> {
        let mut others = 0;
        for (index, piece) in self.head.pieces.iter().enumerate().filter(|(_, piece)| piece.cells > 0) {
            let types = self.topology(index, "types")?;
            let count = |chunk: &[u8]| {
                others += chunk.iter().filter(|&&cell_type| CellType(cell_type) != CellType::TETRA).count();
                Ok(())
            };
            self.arrays.visit(types, piece.cells, count).map_err(|e| self.error(index, "cells array \"types\"", e))?;
        }
        Ok(others == 0)
    }

    fn assemble(&self) -> Result<MeshParts, VtuError> {
        let mut parts =
            MeshParts { point_data: self.common_arrays(Of::Points)?, cell_data: self.common_arrays(Of::Cells)?, ..MeshParts::default() };
        let (mut first_cell, mut is_numbered) = (0, false);
        for (index, piece) in self.head.pieces.iter().enumerate() {
            let kept = self.kept(index, Of::Cells, DROPPED_GHOSTS)?;
            let cells = first_cell..first_cell + piece.cells as u32; // all cells were counted
            if kept.is_some() && !is_numbered {
                (is_numbered, parts.file_cells.numbers) = (true, (0..first_cell).collect());
            }
            if is_numbered {
                let is_kept = |cell: &u32| kept.as_ref().is_none_or(|kept| kept[(cell - first_cell) as usize]);
                parts.file_cells.numbers.extend(cells.clone().filter(is_kept));
            }
            first_cell = cells.end;
            self.append_tets(index, &mut parts, kept.as_deref())?;
            self.append_points(index, &mut parts.points)?;
            for (of, arrays, kept) in [(Of::Points, &mut parts.point_data, None), (Of::Cells, &mut parts.cell_data, kept.as_deref())] {
                self.append_arrays(index, of, arrays, kept, &mut parts.notes)?;
            }
        }
        if parts.tets.len() as u64 == u64::from(first_cell) {
            parts.file_cells.numbers = vec![]; // cells and tets are numbered alike
        }
        parts.active_scalars = self.active_scalars(&parts.point_data, &parts.cell_data);
        Ok(parts)
    }

    /// The arrays that every piece has (those without points or cells aside), still empty. They are stored as f32 if every piece's type
    /// allows it.
    fn common_arrays(&self, of: Of) -> Result<Vec<DataArray>, VtuError> {
        let mut pieces = self.head.pieces.iter().enumerate().filter(|(_, piece)| of.count(piece) > 0);
        let Some((_, first)) = pieces.next() else { return Ok(Vec::new()) };
        let mut seen = HashSet::new();
        let wanted =
            of.section(first).arrays.iter().filter(|a| a.components != Some(0) && !is_ghost_array(&a.name) && seen.insert(&a.name));
        let mut common: Vec<_> = wanted.map(|array| (array, array.scalar.fits_f32())).collect();
        for (index, piece) in pieces {
            let by_name = of.section(piece).by_name();
            common.retain(|(array, _)| by_name.contains_key(array.name.as_str()));
            for (array, fits_f32) in &mut common {
                let other = by_name[array.name.as_str()];
                *fits_f32 &= other.scalar.fits_f32();
                let (found, expected) = (components(other), components(array));
                if found != expected {
                    return Err(self.error(index, &of.array(&array.name), ArrayError::Components { found, expected }));
                }
            }
        }
        let empty = |(array, fits_f32): (&Array, bool)| {
            let values = if fits_f32 { Values::F32(Vec::new()) } else { Values::F64(Vec::new()) };
            let too_large =
                |_| self.error(0, &of.array(&array.name), ArrayError::TooLarge { items: of.count(first), numbers: components(array) });
            Ok(DataArray { name: array.name.clone(), components: usize::try_from(components(array)).map_err(too_large)?, values })
        };
        common.into_iter().map(empty).collect()
    }

    /// Which cells or points of a piece have none of some ghost bits; `None` if all count. Former ghost levels are all bits.
    fn kept(&self, index: usize, of: Of, bits: u8) -> Result<Option<Vec<bool>>, VtuError> {
        let piece = &self.head.pieces[index];
        let Some(ghosts) = of.section(piece).arrays.iter().find(|a| is_ghost_array(&a.name)) else { return Ok(None) };
        let dropped = if ghosts.name == "vtkGhostType" { bits } else { u8::MAX };
        let mut kept = Vec::new();
        let keep = |chunk: &[u8]| {
            kept.extend(chunk.iter().map(|bits| bits & dropped == 0));
            Ok(())
        };
        self.arrays.visit(ghosts, of.count(piece), keep).map_err(|e| self.error(index, &of.array(&ghosts.name), e))?;
        Ok(Some(kept))
    }

    /// Appends a piece's tets, its point indices moved behind the points of the pieces before.
    fn append_tets(&self, index: usize, parts: &mut MeshParts, kept: Option<&[bool]>) -> Result<(), VtuError> {
        let piece = &self.head.pieces[index];
        if piece.cells == 0 {
            return Ok(());
        }
        // The ends of the cells must be those of tets.
        let mut end = 0;
        let check = |chunk: &[u64]| {
            for &found in chunk {
                end += 4;
                if found != end {
                    let expected = format!("{end}, four points a tet").into();
                    return Err(ArrayError::Number { index: end / 4 - 1, found: found.to_string(), expected });
                }
            }
            Ok(())
        };
        let offsets = self.topology(index, "offsets")?;
        self.arrays.visit(offsets, piece.cells, check).map_err(|e| self.error(index, "cells array \"offsets\"", e))?;

        let start = parts.tets.len();
        let connectivity = self.topology(index, "connectivity")?;
        let failed = |e| self.error(index, "cells array \"connectivity\"", e);
        self.arrays.append(connectivity, piece.cells, &mut parts.tets).map_err(failed)?;
        let tets = &mut parts.tets[start..];
        let outside = |corner: &u32| u64::from(*corner) >= piece.points;
        if let Some(place) = tets.as_flattened().par_iter().position_first(outside) {
            let found = tets.as_flattened()[place].to_string();
            let expected = format!("a point index from 0 to {}", i128::from(piece.points) - 1).into();
            return Err(failed(ArrayError::Number { index: place as u64, found, expected }));
        }
        let base = u32::try_from(parts.points.len()).expect("the points of all pieces were counted");
        if base > 0 {
            tets.as_flattened_mut().par_iter_mut().for_each(|corner| *corner += base);
        }
        drop_unkept(&mut parts.tets, start, 1, kept);
        Ok(())
    }

    fn append_points(&self, index: usize, points: &mut Vec<DVec3>) -> Result<(), VtuError> {
        let piece = &self.head.pieces[index];
        if piece.points == 0 {
            return Ok(());
        }
        let missing =
            || VtuError::Missing { piece: self.piece_name(index), array: "in <Points>".into(), items: piece.points, of: "points" };
        let array = piece.coordinates.first().ok_or_else(missing)?;
        let failed = |e| self.error(index, "the array in <Points>", e);
        match array.components {
            None | Some(3) => self.arrays.append(array, piece.points, points).map_err(failed),
            Some(found) => Err(failed(ArrayError::Components { found, expected: 3 })),
        }
    }

    /// Appends a piece's share of all arrays over points or cells. One that is stored longer than it should be, as some writers leave them, is
    /// left out, and noted.
    fn append_arrays(
        &self,
        index: usize,
        of: Of,
        arrays: &mut Vec<DataArray>,
        kept: Option<&[bool]>,
        notes: &mut Vec<String>,
    ) -> Result<(), VtuError> {
        let piece = &self.head.pieces[index];
        if of.count(piece) == 0 {
            return Ok(());
        }
        let by_name = of.section(piece).by_name();
        let mut failed = None;
        arrays.retain_mut(|array| match self.append_data(index, of, by_name[array.name.as_str()], array, kept) {
            Ok(()) => true,
            Err(VtuError::Array { array, reason: ArrayError::Length { found, expected } })
                if found > expected && found <= self.arrays.source.len() =>
            {
                notes.push(format!("{array} has {found} bytes, expected {expected}, and was left out"));
                false
            }
            Err(error) => {
                failed.get_or_insert(error);
                true
            }
        });
        failed.map_or(Ok(()), Err)
    }

    /// Appends a piece's share of a point or cell array.
    fn append_data(&self, index: usize, of: Of, array: &Array, data: &mut DataArray, kept: Option<&[bool]>) -> Result<(), VtuError> {
        let (tuples, width) = (of.count(&self.head.pieces[index]), data.components);
        let failed = |e| self.error(index, &of.array(&data.name), e);
        let numbers =
            tuples.checked_mul(width as u64).ok_or(ArrayError::TooLarge { items: tuples, numbers: width as u64 }).map_err(failed)?;
        match &mut data.values {
            Values::F32(values) => {
                let start = values.len();
                self.arrays.append(array, numbers, values).map_err(failed)?;
                drop_unkept(values, start, width, kept);
            }
            Values::F64(values) => {
                let start = values.len();
                self.arrays.append(array, numbers, values).map_err(failed)?;
                drop_unkept(values, start, width, kept);
            }
        }
        Ok(())
    }

    /// The array that the first piece to say so marks as its scalars, points before cells.
    fn active_scalars(&self, point_data: &[DataArray], cell_data: &[DataArray]) -> Option<String> {
        let marked = |of: Of| self.head.pieces.iter().find_map(move |piece| of.section(piece).scalars.as_ref());
        [(Of::Points, point_data), (Of::Cells, cell_data)]
            .into_iter()
            .find_map(|(of, arrays)| marked(of).filter(|name| arrays.iter().any(|array| array.name == **name)).cloned())
    }

    fn topology(&self, index: usize, name: &'static str) -> Result<&Array, VtuError> {
        let piece = &self.head.pieces[index];
        self.named(&piece.topology, "Cells", index, name, piece.cells)
    }

    fn piece_name(&self, index: usize) -> String {
        format!("piece {} of {}", index + 1, self.head.pieces.len())
    }

    fn error(&self, index: usize, array: &str, reason: ArrayError) -> VtuError {
        match reason {
            ArrayError::Cancelled(cancelled) => VtuError::Cancelled(cancelled),
            reason if self.head.pieces.len() == 1 => VtuError::Array { array: array.to_owned(), reason },
            reason => VtuError::Array { array: format!("{}: {array}", self.piece_name(index)), reason },
        }
    }
}

/// Numbers a tuple of a point or cell array.
fn components(array: &Array) -> u64 {
    array.components.unwrap_or(1)
}

/// Whether an array marks ghosts, under its present or its former name.
fn is_ghost_array(name: &str) -> bool {
    matches!(name, "vtkGhostType" | "vtkGhostLevels")
}

/// Drops those tuples of `width` values from value `start` on that are not kept.
fn drop_unkept<T: Copy>(values: &mut Vec<T>, start: usize, width: usize, kept: Option<&[bool]>) {
    let Some(kept) = kept else { return };
    let mut end = start;
    for (tuple, _) in kept.iter().enumerate().filter(|(_, kept)| **kept) {
        let from = start + tuple * width;
        values.copy_within(from..from + width, end);
        end += width;
    }
    values.truncate(end);
}
