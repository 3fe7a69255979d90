//! VTKHDF (<https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>): the layout of `.vtu` as data sets of HDF5.
//!
//! Unstructured grids are read, and those in collections of grids and in multi-block data sets, one behind the other. A grid may have
//! several parts. Of time steps the first is read. Ghost cells that another part holds too, cells that were refined, and hidden cells
//! are dropped, the ghost arrays with them.

use super::file::{Hdf, Rows, place};
use super::joined::Joined;
use crate::format::ParseError;
use crate::mesh::{CellType, UnstructuredGrid, Values};
use glam::DVec3;
use std::ops::Range;

/// The group that all is in.
pub(super) const ROOT: &str = "/VTKHDF";
/// Ghost bits (`vtkDataSetAttributes.h`) of cells that are not the part's own: duplicate, refined, hidden.
const NOT_OWN: u8 = 1 | 8 | 32;

/// Reads a file that has the group [`ROOT`].
pub(super) fn read(file: &Hdf<'_>) -> Result<UnstructuredGrid, ParseError> {
    let kind = file.text_of(ROOT, "Type")?.unwrap_or_default();
    let mut joined = Joined::default();
    match kind.as_str() {
        "UnstructuredGrid" => read_grid(file, ROOT, &mut joined)?,
        "MultiBlockDataSet" | "PartitionedDataSetCollection" => {
            let mut blocks = Vec::new();
            for name in file.names_in(ROOT)?.0 {
                let path = format!("{ROOT}/{name}");
                match file.text_of(&path, "Type")?.as_deref() {
                    Some("UnstructuredGrid") => blocks.push((file.number_of(&path, "Index")?.unwrap_or(f64::MAX), path)),
                    Some(other) => joined.note(format!("block \"{name}\" is of type {other} and was left out")),
                    None => {}
                }
            }
            blocks.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            if blocks.is_empty() {
                return Err(ParseError::Unsupported(format!("is VTKHDF of type {kind} without a block of type UnstructuredGrid")));
            }
            blocks.iter().try_for_each(|(_, path)| read_grid(file, path, &mut joined))?;
        }
        other => {
            let expected = "UnstructuredGrid, MultiBlockDataSet or PartitionedDataSetCollection";
            return Err(ParseError::Unsupported(format!("is VTKHDF of type \"{other}\", octetra reads {expected}")));
        }
    }
    file.take(joined.numbers(), "the arrays")?;
    Ok(joined.finish())
}

/// Where the first time step of a grid, or all of one without steps, begins in each data set.
struct Start<'a> {
    file: &'a Hdf<'a>,
    /// The group of the grid.
    path: &'a str,
    /// The group of the steps, if there is one.
    steps: Option<String>,
}

impl Start<'_> {
    fn read(&self, name: &str, range: Option<Range<usize>>) -> Result<Rows, ParseError> {
        let path = format!("{}/{name}", self.path);
        let missing = || ParseError::invalid(format!("group \"{}\"", self.path), format!("no data set \"{name}\""), "one in each grid");
        self.file.rows(&path, range)?.ok_or_else(missing)
    }

    fn counts(&self, name: &str, range: Range<usize>) -> Result<Vec<usize>, ParseError> {
        self.read(name, Some(range))?.numbers.counts(&place(&format!("{}/{name}", self.path)))
    }

    /// The number for the first step in a data set of the steps.
    fn of_step(&self, name: &str) -> Result<Option<usize>, ParseError> {
        let Some(steps) = &self.steps else { return Ok(None) };
        let path = format!("{steps}/{name}");
        if self.file.shape(&path)?.is_none_or(|shape| shape.contains(&0)) {
            return Ok(None);
        }
        let Some(rows) = self.file.rows(&path, Some(0..1))? else { return Ok(None) };
        Ok(rows.numbers.counts(&place(&path))?.first().copied())
    }
}

fn sum(counts: &[usize], path: &str) -> Result<usize, ParseError> {
    let sum = counts.iter().try_fold(0usize, |sum, &n| sum.checked_add(n));
    sum.ok_or_else(|| ParseError::invalid(place(path), "counts beyond all bounds", "counts of what the file has"))
}

fn read_grid(file: &Hdf<'_>, path: &str, joined: &mut Joined) -> Result<(), ParseError> {
    let steps = format!("{path}/Steps");
    let steps = file.group(&steps)?.is_some().then_some(steps);
    if let Some(steps) = &steps
        && let Some(count @ 2..) = file.number_of(steps, "NSteps")?.map(|n| n as u64)
    {
        let time = file.rows(&format!("{steps}/Values"), Some(0..1))?.map(|rows| rows.numbers.reals());
        let time = time.and_then(|time| time.first().map(|time| format!(" (time {time})"))).unwrap_or_default();
        joined.note(format!("of {count} time steps the first{time} was read"));
    }
    let start = Start { file, path, steps };
    let all_parts = file.shape(&format!("{path}/NumberOfPoints"))?.and_then(|shape| shape.first().copied()).unwrap_or(0) as usize;
    let first = start.of_step("PartOffsets")?.unwrap_or(0);
    let parts = start.of_step("NumberOfParts")?.unwrap_or_else(|| all_parts.saturating_sub(first));
    let parts = first..first.saturating_add(parts);
    let points_of = start.counts("NumberOfPoints", parts.clone())?;
    let cells_of = start.counts("NumberOfCells", parts.clone())?;
    let corners_of = start.counts("NumberOfConnectivityIds", parts.clone())?;
    let (points, cells, corners) = (sum(&points_of, path)?, sum(&cells_of, path)?, sum(&corners_of, path)?);
    let rows = |from: usize, count: usize| Some(from..from.saturating_add(count));

    let first_point = start.of_step("PointOffsets")?.unwrap_or(0);
    let first_cell = start.of_step("CellOffsets")?.unwrap_or(0);
    let first_corner = start.of_step("ConnectivityIdOffsets")?.unwrap_or(0);
    let coordinates = start.read("Points", rows(first_point, points))?;
    if coordinates.width != 3 {
        let found = format!("{} numbers a point", coordinates.width);
        return Err(ParseError::invalid(place(&format!("{path}/Points")), found, "3 numbers a point"));
    }
    let (base_point, base_cell) = (joined.grid.points.len(), joined.grid.cells.len());
    joined.grid.points.extend(coordinates.numbers.reals().chunks_exact(3).map(DVec3::from_slice));

    let types = start.read("Types", rows(first_cell, cells))?.numbers.counts(&place(&format!("{path}/Types")))?;
    let ends =
        start.counts("Offsets", first_cell.saturating_add(first)..first_cell.saturating_add(first).saturating_add(cells + parts.len()))?;
    let connectivity = start.read("Connectivity", rows(first_corner, corners))?.numbers;
    let connectivity = connectivity.points(0, &place(&format!("{path}/Connectivity")))?;
    let faces = if types.contains(&usize::from(CellType::POLYHEDRON.0)) { Some(Faces::read(&start, &parts)?) } else { None };
    let keep = own_cells(&start, first_cell, cells)?;

    let (mut cell, mut corner, mut point) = (0, 0, base_point);
    let mut stream = Vec::new();
    for part in 0..parts.len() {
        let ends = &ends[cell + part..][..cells_of[part] + 1];
        let corners = &connectivity[corner..][..corners_of[part]];
        let shift = |corner: u32| u32::try_from(corner as usize + point).unwrap_or(u32::MAX);
        for (i, between) in ends.windows(2).enumerate() {
            let of_cell = corners.get(between[0]..between[1]).ok_or_else(|| {
                let expected = format!("ends of cells that grow from 0 to {}", corners.len());
                ParseError::invalid(place(&format!("{path}/Offsets")), format!("{} behind {}", between[1], between[0]), expected)
            })?;
            let cell_type = u8::try_from(types[cell + i]).map(CellType);
            let cell_type = cell_type.map_err(|_| {
                ParseError::invalid(place(&format!("{path}/Types")), types[cell + i].to_string(), "types of cells from 0 to 255")
            })?;
            if !keep[cell + i] {
                continue;
            }
            stream.clear();
            match &faces {
                Some(faces) if cell_type == CellType::POLYHEDRON => {
                    faces.append(part, cell + i, i, point, &mut stream)?;
                    file.take(stream.len(), &place(&format!("{path}/PolyhedronToFaces")))?;
                }
                _ => stream.extend(of_cell.iter().map(|&corner| shift(corner))),
            }
            joined.grid.cells.push(cell_type, &stream)?;
        }
        (cell, corner, point) = (cell + cells_of[part], corner + corners_of[part], point + points_of[part]);
    }
    joined.number(base_cell, &keep);
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        joined.note(format!("{dropped} ghost, refined or hidden cells were dropped"));
    }
    arrays(&start, "PointData", first_point, points, base_point, None, joined)?;
    arrays(&start, "CellData", first_cell, cells, base_cell, Some(&keep), joined)
}

/// Which cells are the parts' own.
fn own_cells(start: &Start<'_>, first: usize, cells: usize) -> Result<Vec<bool>, ParseError> {
    let first = start.of_step("CellDataOffsets/vtkGhostType")?.unwrap_or(first);
    let ghosts = start.file.rows(&format!("{}/CellData/vtkGhostType", start.path), Some(first..first.saturating_add(cells)));
    let Some(ghosts) = ghosts? else { return Ok(vec![true; cells]) };
    let ghosts = ghosts.numbers.integers(&place("vtkGhostType"))?;
    Ok(ghosts.into_iter().map(|ghost| ghost & i64::from(NOT_OWN) == 0).collect())
}

/// The arrays in a group, over `count` points or cells from the file's `first`; those that are kept go behind the `base` there are.
fn arrays(
    start: &Start<'_>,
    group: &str,
    first: usize,
    count: usize,
    base: usize,
    keep: Option<&[bool]>,
    joined: &mut Joined,
) -> Result<(), ParseError> {
    let path = format!("{}/{group}", start.path);
    for name in start.file.names_in(&path)?.1 {
        if name == "vtkGhostType" {
            continue;
        }
        let first = start.of_step(&format!("{group}Offsets/{name}"))?.unwrap_or(first);
        let array = format!("{path}/{name}");
        let rows = match start.file.rows(&array, Some(first..first.saturating_add(count))) {
            Ok(Some(rows)) => rows,
            Ok(None) => continue,
            Err(ParseError::Invalid { found, expected, .. }) => {
                joined.note(format!("array \"{array}\" was left out: {found}, expected {expected}"));
                continue;
            }
            Err(error) => return Err(error),
        };
        if rows.width == 0 {
            continue;
        }
        let values = match keep {
            Some(keep) if keep.contains(&false) => kept(rows.numbers.values(), rows.width, keep),
            _ => rows.numbers.values(),
        };
        let columns = if group == "PointData" { &mut joined.point_data } else { &mut joined.cell_data };
        if let Err(note) = columns.add(&name, rows.width, base, values) {
            joined.note(note);
        }
        let is_active = start.file.text_beside(&array, "Attribute")?.is_some_and(|kind| kind.starts_with("Scalars"));
        if is_active && joined.grid.active_scalars.is_none() {
            joined.grid.active_scalars = Some(name);
        }
    }
    Ok(())
}

fn kept(values: Values, width: usize, keep: &[bool]) -> Values {
    fn of<T: Copy>(values: Vec<T>, width: usize, keep: &[bool]) -> Vec<T> {
        values.chunks_exact(width).zip(keep).filter(|(_, keep)| **keep).flat_map(|(tuple, _)| tuple).copied().collect()
    }
    match values {
        Values::F32(values) => Values::F32(of(values, width, keep)),
        Values::F64(values) => Values::F64(of(values, width, keep)),
    }
}

/// The faces of polyhedra, all parts one behind the other; numbers within a part count from its start.
struct Faces {
    /// Where the faces of each cell end in `to_faces`, from 0 in each part.
    cell_ends: Vec<usize>,
    to_faces: Vec<usize>,
    /// Where the corners of each face end in `corners`, from 0 in each part.
    face_ends: Vec<usize>,
    corners: Vec<u32>,
    /// Where each part begins in the four.
    starts: Vec<[usize; 4]>,
}

impl Faces {
    fn read(start: &Start<'_>, parts: &Range<usize>) -> Result<Self, ParseError> {
        let upto = 0..parts.end;
        let [cells, faces, to_faces, corners] =
            ["NumberOfCells", "NumberOfFaces", "NumberOfPolyhedronToFaceIds", "NumberOfFaceConnectivityIds"]
                .map(|name| start.counts(name, upto.clone()));
        let (cells, faces, to_faces, corners) = (cells?, faces?, to_faces?, corners?);
        let mut starts = vec![[0usize; 4]];
        for part in upto {
            let more = [cells[part].saturating_add(1), to_faces[part], faces[part].saturating_add(1), corners[part]];
            let last = starts[part];
            starts.push(std::array::from_fn(|k| last[k].saturating_add(more[k])));
        }
        let (from, to) = (starts[parts.start], starts[parts.end]);
        let place_of = |name: &str| place(&format!("{}/{name}", start.path));
        let found = Faces {
            cell_ends: start.counts("PolyhedronOffsets", from[0]..to[0])?,
            to_faces: start.counts("PolyhedronToFaces", from[1]..to[1])?,
            face_ends: start.counts("FaceOffsets", from[2]..to[2])?,
            corners: start.read("FaceConnectivity", Some(from[3]..to[3]))?.numbers.points(0, &place_of("FaceConnectivity"))?,
            starts: starts[parts.start..].iter().map(|start| std::array::from_fn(|k| start[k] - from[k])).collect(),
        };
        Ok(found)
    }

    /// The faces of a cell of a part as a stream; `point` is the part's first point.
    fn append(&self, part: usize, cell: usize, in_part: usize, point: usize, stream: &mut Vec<u32>) -> Result<(), ParseError> {
        let wrong = || ParseError::invalid(format!("polyhedron {cell}"), "faces or corners that are not there", "some of its part");
        let [ends, to_faces, face_ends, corners] = self.starts[part];
        let [next_ends, next_to_faces, next_face_ends, next_corners] = self.starts[part + 1];
        let (ends, to_faces) = (&self.cell_ends[ends..next_ends], &self.to_faces[to_faces..next_to_faces]);
        let (face_ends, corners) = (&self.face_ends[face_ends..next_face_ends], &self.corners[corners..next_corners]);
        let range = ends.get(in_part).zip(ends.get(in_part + 1)).ok_or_else(wrong)?;
        let faces = to_faces.get(*range.0..*range.1).ok_or_else(wrong)?;
        stream.push(faces.len() as u32);
        for &face in faces {
            let range = face_ends.get(face).zip(face_ends.get(face.saturating_add(1))).ok_or_else(wrong)?;
            let of_face = corners.get(*range.0..*range.1).ok_or_else(wrong)?;
            stream.push(of_face.len() as u32);
            stream.extend(of_face.iter().map(|&corner| u32::try_from(corner as usize + point).unwrap_or(u32::MAX)));
        }
        Ok(())
    }
}
