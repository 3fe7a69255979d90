//! Parts of a mesh, and how they are put together; cell zones.

use super::super::parse::ParseError;
use super::{Reader, ZONES, case};
use crate::mesh::{CellType, DataArray, UnstructuredGrid, Values};
use glam::DVec3;
use std::path::Path;

/// Entries of a list of zones that are read.
const MOST_ZONES: usize = 1 << 16;

/// The part of a mesh that a processor has.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub grid: UnstructuredGrid,
    /// The number of each point in the whole mesh.
    pub addresses: Option<Vec<u32>>,
}

/// Points from their coordinates.
pub(super) fn points(values: &Values) -> Vec<DVec3> {
    match values {
        Values::F32(values) => values.chunks_exact(3).map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())).collect(),
        Values::F64(values) => values.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2])).collect(),
    }
}

/// One grid of several: cells one behind the other, points too but for those with the same number in the whole.
pub(super) fn joined(pieces: Vec<Piece>, notes: &mut Vec<String>) -> Result<UnstructuredGrid, ParseError> {
    let counts: Vec<[usize; 2]> = pieces.iter().map(|piece| [piece.grid.points.len(), piece.grid.cells.len()]).collect();
    let all_points: usize = counts.iter().map(|[points, _]| points).sum();
    if u32::try_from(all_points).is_err() {
        return Err(ParseError::Unsupported(format!("it has {all_points} points, more than octetra can index")));
    }
    let numbers = numbers(&pieces).unwrap_or_else(|| {
        notes.push("points on the borders between processors are there once for each: files pointProcAddressing lack or do not fit".into());
        (0..all_points as u32).collect()
    });
    let points_in_all = numbers.iter().max().map_or(0, |&last| last as usize + 1);
    let mut grid = UnstructuredGrid { points: vec![DVec3::ZERO; points_in_all], ..UnstructuredGrid::default() };
    let (mut first, mut stream) = (0, Vec::new());
    for piece in &pieces {
        let own = &numbers[first..first + piece.grid.points.len()];
        first += own.len();
        own.iter().zip(&piece.grid.points).for_each(|(&number, &point)| grid.points[number as usize] = point);
        // A point that is not there stays one that is not there.
        let number = |point: u32| own.get(point as usize).copied().unwrap_or(u32::MAX);
        for (cell_type, cell) in piece.grid.cells.iter() {
            stream.clear();
            if cell_type == CellType::POLYHEDRON {
                stream.push(cell[0]);
                let mut rest = &cell[1..];
                while let [count, face @ ..] = rest {
                    let (face, after) = face.split_at(*count as usize);
                    stream.push(*count);
                    stream.extend(face.iter().map(|&point| number(point)));
                    rest = after;
                }
            } else {
                stream.extend(cell.iter().map(|&point| number(point)));
            }
            grid.cells.push(cell_type, &stream)?;
        }
    }
    let of_cells: Vec<(&UnstructuredGrid, &[DataArray])> = pieces.iter().map(|piece| (&piece.grid, &piece.grid.cell_data[..])).collect();
    let of_points: Vec<(&UnstructuredGrid, &[DataArray])> = pieces.iter().map(|piece| (&piece.grid, &piece.grid.point_data[..])).collect();
    grid.cell_data = arrays(&of_cells, |grid| grid.cells.len(), None);
    grid.point_data = arrays(&of_points, |grid| grid.points.len(), Some((&numbers, points_in_all)));
    Ok(grid)
}

/// The number of each point of all pieces in the whole, from 0 without gaps; `None` if they do not say.
fn numbers(pieces: &[Piece]) -> Option<Vec<u32>> {
    let mut all = Vec::with_capacity(pieces.iter().map(|piece| piece.grid.points.len()).sum());
    for piece in pieces {
        let addresses = piece.addresses.as_ref().filter(|addresses| addresses.len() == piece.grid.points.len())?;
        all.extend_from_slice(addresses);
    }
    let mut known = all.clone();
    known.sort_unstable();
    known.dedup();
    all.iter_mut().for_each(|address| *address = known.binary_search(address).unwrap_or(0) as u32);
    Some(all)
}

/// The arrays of the pieces as arrays of the whole, NaN where a piece lacks one; `numbers` are where the tuples go, and how many there are.
fn arrays(
    pieces: &[(&UnstructuredGrid, &[DataArray])],
    tuples: impl Fn(&UnstructuredGrid) -> usize,
    numbers: Option<(&[u32], usize)>,
) -> Vec<DataArray> {
    let mut names: Vec<(&str, usize)> = Vec::new();
    for array in pieces.iter().flat_map(|(_, arrays)| arrays.iter()) {
        if !names.contains(&(&array.name, array.components)) {
            names.push((&array.name, array.components));
        }
    }
    let in_all = numbers.map_or_else(|| pieces.iter().map(|(grid, _)| tuples(grid)).sum(), |(_, in_all)| in_all);
    let whole = |(name, components): (&str, usize)| {
        let (mut values, mut first, mut are_f32) = (vec![f64::NAN; in_all * components], 0, true);
        for (grid, arrays) in pieces {
            let count = tuples(grid);
            if let Some(array) = arrays.iter().find(|array| array.name == name && array.components == components) {
                are_f32 &= matches!(array.values, Values::F32(_));
                for i in 0..count {
                    let to = numbers.map_or(first + i, |(numbers, _)| numbers[first + i] as usize);
                    (0..components).for_each(|k| values[to * components + k] = array.values.get(i * components + k));
                }
            }
            first += count;
        }
        let values = if are_f32 { Values::F32(values.iter().map(|&value| value as f32).collect()) } else { Values::F64(values) };
        DataArray { name: name.to_owned(), components, values }
    };
    names.into_iter().map(whole).collect()
}

impl Reader<'_> {
    /// The number of each cell's zone, if the mesh has zones of cells.
    pub(super) fn zones(&mut self, mesh: &Path, cells: usize) -> Result<Option<DataArray>, ParseError> {
        let path = mesh.join("cellZones");
        if case::find(&path).is_none() {
            return Ok(None);
        }
        let progress = self.progress;
        let (values, names) = self.with(&path, u64::MAX, |tokens| {
            let (mut values, mut names) = (vec![f32::NAN; cells], Vec::new());
            if tokens.peek().is_ascii_digit() {
                _ = tokens.word(); // how many
            }
            if tokens.peek() != b'(' {
                return Ok((values, names));
            }
            tokens.expect(b'(')?;
            while !tokens.take(b')') {
                if names.len() == MOST_ZONES {
                    return Err(tokens.bad(b"", &format!("at most {MOST_ZONES} zones")));
                }
                let name = tokens.word();
                if name.is_empty() {
                    return Err(tokens.bad(b"", "the name of a zone"));
                }
                tokens.expect(b'{')?;
                while !tokens.take(b'}') {
                    if tokens.word() != b"cellLabels" {
                        tokens.skip_value()?;
                        continue;
                    }
                    if tokens.peek().is_ascii_alphabetic() {
                        _ = tokens.word(); // List<label>
                    }
                    for cell in tokens.labels(cells, "cells of a zone", progress)? {
                        let value = values.get_mut(cell as usize);
                        *value.ok_or_else(|| tokens.bad(cell.to_string().as_bytes(), &format!("a cell below {cells}")))? =
                            names.len() as f32;
                    }
                    tokens.expect(b';')?;
                }
                names.push(String::from_utf8_lossy(name).into_owned());
            }
            Ok((values, names))
        })?;
        if values.iter().all(|value| value.is_nan()) {
            return Ok(None);
        }
        if names.len() == 1 && values.iter().all(|value| !value.is_nan()) {
            self.note(format!("all cells are in the zone {}", names[0]));
            return Ok(None);
        }
        let listed: Vec<String> = names.iter().take(10).enumerate().map(|(i, name)| format!("{i} {name}")).collect();
        let more = if names.len() > 10 { format!(" and {} more", names.len() - 10) } else { String::new() };
        self.note(format!("zones in the array {ZONES}: {}{more}", listed.join(", ")));
        Ok(Some(DataArray { name: ZONES.into(), components: 1, values: Values::F32(values) }))
    }
}
