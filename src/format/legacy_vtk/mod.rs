//! VTK's legacy format, `.vtk`, versions 1.0 to 5.1, text and binary (which is big-endian), every kind of array: `STRUCTURED_POINTS`, which is a
//! volume, `STRUCTURED_GRID` and `RECTILINEAR_GRID`, whose hexahedra become tets, `UNSTRUCTURED_GRID` and `POLYDATA` with cells of every type
//! (VTK File Formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>).
//!
//! The rules where the format leaves a choice: without a name the first array with one component counts, else the first, points before
//! cells; arrays over cells become a volume of the cells' centres. Arrays of text and of bits are passed over. Of arrays with the same name
//! the first counts.

mod cells;
mod walker;

use super::source::Source;
use super::voxel_data::{DataFile, Encoding, Stored, VolumeError, dims, grid};
use super::vtu::number::{ByteOrder, ScalarType};
use super::{Found, GridFile};
use crate::mesh::{CellType, Cells, DataArray, MeshParts, StructuredBlock, TooManyCellPoints, UnstructuredGrid, Values, split_into_tets};
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame, Samples, Voxel};
use glam::DVec3;
use std::borrow::Cow;
use walker::{Lines, Walker};

/// The types by name.
const TYPES: [(&str, ScalarType); 14] = [
    ("unsigned_char", ScalarType::UInt8),
    ("char", ScalarType::Int8),
    ("signed_char", ScalarType::Int8),
    ("unsigned_short", ScalarType::UInt16),
    ("short", ScalarType::Int16),
    ("unsigned_int", ScalarType::UInt32),
    ("int", ScalarType::Int32),
    ("unsigned_long", ScalarType::UInt64),
    ("long", ScalarType::Int64),
    ("vtktypeint64", ScalarType::Int64),
    ("vtktypeuint64", ScalarType::UInt64),
    ("vtkIdType", ScalarType::Int32),
    ("float", ScalarType::Float32),
    ("double", ScalarType::Float64),
];

/// Bytes that a line may have.
const LINE_LIMIT: u64 = 1 << 12;

/// Whether a file starts as VTK's legacy files do.
pub(super) fn recognizes(start: &[u8]) -> bool {
    start.starts_with(b"# vtk DataFile")
}

/// An array of a file.
struct Array {
    name: String,
    scalar: ScalarType,
    components: u64,
    tuples: u64,
    is_of_cells: bool,
    /// Its bytes of the file.
    place: std::ops::Range<u64>,
}

/// What a file holds.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Dataset {
    #[default]
    StructuredPoints,
    StructuredGrid,
    RectilinearGrid,
    UnstructuredGrid,
    PolyData,
}

impl Dataset {
    /// All of them by name.
    const NAMES: [(&'static str, Dataset); 5] = [
        ("STRUCTURED_POINTS", Dataset::StructuredPoints),
        ("STRUCTURED_GRID", Dataset::StructuredGrid),
        ("RECTILINEAR_GRID", Dataset::RectilinearGrid),
        ("UNSTRUCTURED_GRID", Dataset::UnstructuredGrid),
        ("POLYDATA", Dataset::PolyData),
    ];
}

/// What stands before the arrays.
#[derive(Default)]
struct Head {
    dataset: Dataset,
    /// The points of a grid, or the coordinates along each axis.
    places: Vec<Array>,
    dims: Option<[u64; 3]>,
    origin: Option<DVec3>,
    spacing: Option<DVec3>,
    /// Lists of cells by their keyword, `CELLS` or what polygons are.
    lists: Vec<(String, List)>,
    types: Option<Array>,
    /// Arrays that were passed over.
    notes: Vec<String>,
}

/// A list of cells.
enum List {
    /// How many cells, and of each how many points and which.
    Counted(u64, Array),
    /// Where the points of each cell begin, and of the last end; the points.
    Offsets(Array, Array),
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<Found, VolumeError> {
    let mut lines = Lines { source: file.source, at: 0 };
    lines.next()?;
    lines.next()?; // the title
    let is_binary = match lines.next()?.unwrap_or_default().trim() {
        "BINARY" => true,
        "ASCII" => false,
        other => return Err(VolumeError::key("line 3", other, "ASCII or BINARY")),
    };
    let (head, arrays) = Walker { lines, is_binary, head: Head::default(), arrays: vec![] }.walk()?;
    match head.dataset {
        Dataset::StructuredPoints => volume(file, &head, &arrays, is_binary, progress).map(Found::Grid),
        Dataset::UnstructuredGrid | Dataset::PolyData => cells::read(file, head, &arrays, is_binary, progress).map(Found::Cells),
        _ => mesh(file, &head, &arrays, is_binary, progress),
    }
}

fn volume(file: &GridFile<'_>, head: &Head, arrays: &[Array], is_binary: bool, progress: &Progress) -> Result<Grid, VolumeError> {
    let array = choose(arrays, file.options.array.as_deref())?;
    let found = head.dims.ok_or_else(|| VolumeError::missing("DIMENSIONS", "3 integers from 2"))?;
    let less = u64::from(array.is_of_cells);
    let dims = dims("DIMENSIONS", found.map(|n| n.saturating_sub(less)))?;
    let spacing = head.spacing.unwrap_or(DVec3::ONE);
    let origin = head.origin.unwrap_or(DVec3::ZERO) + if array.is_of_cells { spacing * 0.5 } else { DVec3::ZERO };
    let frame = GridFrame::along_axes(dims, origin, spacing);
    frame.validate()?;
    array.expect_tuples(u128::from(frame.points()), &in_words(found))?;
    let samples = array.read(file, is_binary, &in_words(found), progress)?;
    grid(file, frame, &array.name, samples, 1, array.components as usize)
}

impl Array {
    /// Its numbers; `dims` is what calls for so many, in words.
    fn read(&self, file: &GridFile<'_>, is_binary: bool, dims: &str, progress: &Progress) -> Result<Samples, VolumeError> {
        let stored = Stored {
            scalar: self.scalar,
            order: ByteOrder::Big,
            encoding: if is_binary { Encoding::Raw } else { Encoding::Text },
            numbers: self.tuples.saturating_mul(self.components),
            why: format!("DIMENSIONS {dims}, {} components", self.components),
        };
        // The array alone, as if it were all of a file.
        let len = usize::try_from(self.place.end - self.place.start).unwrap_or(usize::MAX);
        let bytes: Cow<'_, [u8]> = file.source.read(self.place.start, len)?;
        let own = Source::Bytes(&bytes);
        DataFile::Own(&own).read(0, &stored, file, progress)
    }

    /// Its numbers as f64.
    fn numbers(&self, file: &GridFile<'_>, is_binary: bool, dims: &str, progress: &Progress) -> Result<Vec<f64>, VolumeError> {
        self.read(file, is_binary, dims, progress).map(|samples| (0..samples.len()).map(|i| samples.get(i)).collect())
    }

    /// An error unless it has so many tuples.
    fn expect_tuples(&self, expected: u128, dims: &str) -> Result<(), VolumeError> {
        if u128::from(self.tuples) == expected {
            return Ok(());
        }
        let key = format!("the size of array \"{}\"", self.name);
        Err(VolumeError::key(&key, &self.tuples.to_string(), format!("{expected}, by DIMENSIONS {dims}")))
    }
}

/// The tets of a structured or rectilinear grid, with all arrays; of a flat one its faces.
fn mesh(file: &GridFile<'_>, head: &Head, arrays: &[Array], is_binary: bool, progress: &Progress) -> Result<Found, VolumeError> {
    let dims = head.dims.ok_or_else(|| VolumeError::missing("DIMENSIONS", "3 integers from 2"))?;
    let said = in_words(dims);
    // A grid of one layer has faces for cells.
    let is_flat = dims.iter().filter(|&&n| n == 1).count() == 1;
    let (points, cells) = (product(dims), product(dims.map(|n| if is_flat && n == 1 { 1 } else { n.saturating_sub(1) })));
    if dims.iter().any(|&n| n < 2 && !(is_flat && n == 1)) || points >= u128::from(u32::MAX) {
        return Err(VolumeError::key("DIMENSIONS", &said, format!("2 points or more along each axis, fewer than {} in all", u32::MAX)));
    }
    let numbers = |array: &Array| array.numbers(file, is_binary, &said, progress);
    let places = match (head.dataset, &head.places[..]) {
        (Dataset::RectilinearGrid, [x, y, z]) => {
            (0..3).zip([x, y, z]).try_for_each(|(axis, array)| array.expect_tuples(u128::from(dims[axis]), &said))?;
            let [xs, ys, zs] = [numbers(x)?, numbers(y)?, numbers(z)?];
            zs.iter()
                .flat_map(|&z| ys.iter().map(move |&y| (y, z)))
                .flat_map(|(y, z)| xs.iter().map(move |&x| DVec3::new(x, y, z)))
                .collect()
        }
        (Dataset::StructuredGrid, [array]) => {
            array.expect_tuples(points, &said)?;
            numbers(array)?.chunks_exact(3).map(DVec3::from_slice).collect()
        }
        (Dataset::RectilinearGrid, _) => {
            return Err(VolumeError::missing("X_COORDINATES, Y_COORDINATES or Z_COORDINATES", "each of them once"));
        }
        _ => return Err(VolumeError::missing("POINTS", "the coordinates of all points")),
    };
    let (point_data, cell_data) = data(file, arrays, [points, cells], is_binary, &said, progress)?;
    if is_flat {
        let cells = faces(dims.map(|n| n as u32)).map_err(|e| VolumeError::key("DIMENSIONS", &said, e.to_string()))?;
        return Ok(Found::Cells(UnstructuredGrid {
            points: places,
            cells,
            point_data,
            cell_data,
            notes: head.notes.clone(),
            ..UnstructuredGrid::default()
        }));
    }
    let block = StructuredBlock::new(dims.map(|n| n as usize));
    let with_notes = |mut parts: MeshParts| {
        parts.notes.extend(head.notes.iter().cloned());
        Found::Mesh(parts)
    };
    split_into_tets(&[block], places, point_data, cell_data, None)
        .map(with_notes)
        .map_err(|e| VolumeError::key("DIMENSIONS", &said, e.to_string()))
}

/// The quads of a grid that is one point thick along one axis.
fn faces([nx, ny, nz]: [u32; 3]) -> Result<Cells, TooManyCellPoints> {
    let (first, second) = match (nx, ny, nz) {
        (1, ny, nz) => (ny, nz),
        (nx, 1, nz) => (nx, nz),
        (nx, ny, _) => (nx, ny),
    };
    let mut cells = Cells::default();
    for j in 0..second - 1 {
        for i in 0..first - 1 {
            let corner = i + first * j;
            cells.push(CellType::QUAD, &[corner, corner + 1, corner + 1 + first, corner + first])?;
        }
    }
    Ok(cells)
}

/// All arrays over points and over cells, of which there are `counts`.
fn data(
    file: &GridFile<'_>,
    arrays: &[Array],
    counts: [u128; 2],
    is_binary: bool,
    said: &str,
    progress: &Progress,
) -> Result<(Vec<DataArray>, Vec<DataArray>), VolumeError> {
    let (mut point_data, mut cell_data) = (Vec::new(), Vec::new());
    for array in arrays {
        let (data, expected) = if array.is_of_cells { (&mut cell_data, counts[1]) } else { (&mut point_data, counts[0]) };
        array.expect_tuples(expected, said)?;
        let is_new = data.iter().all(|other: &DataArray| other.name != array.name);
        if is_new {
            let values = values(array.read(file, is_binary, said, progress)?);
            data.push(DataArray { name: array.name.clone(), components: array.components as usize, values });
        }
    }
    Ok((point_data, cell_data))
}

fn product(dims: [u64; 3]) -> u128 {
    dims.iter().fold(1u128, |product, &n| product.saturating_mul(u128::from(n)))
}

/// Numbers as a mesh keeps them.
fn values(samples: Samples) -> Values {
    fn narrow<T: Voxel>(numbers: &[T]) -> Values {
        Values::F32(numbers.iter().map(|v| v.to_f64() as f32).collect())
    }
    match &samples {
        Samples::U8(numbers) => narrow(numbers),
        Samples::I8(numbers) => narrow(numbers),
        Samples::U16(numbers) => narrow(numbers),
        Samples::I16(numbers) => narrow(numbers),
        Samples::F32(numbers) => Values::F32(numbers.to_vec()),
        _ => Values::F64((0..samples.len()).map(|i| samples.get(i)).collect()),
    }
}

fn in_words([x, y, z]: [u64; 3]) -> String {
    format!("{x} {y} {z}")
}

fn choose<'a>(arrays: &'a [Array], name: Option<&str>) -> Result<&'a Array, VolumeError> {
    let found = match name {
        Some(name) => arrays.iter().find(|array| array.name == name),
        None => arrays.iter().find(|array| array.components == 1).or(arrays.first()),
    };
    found.ok_or_else(|| {
        let names = arrays.iter().map(|array| format!("\"{}\"", array.name)).collect::<Vec<_>>().join(", ");
        VolumeError::NoArray(
            name.map(|name| format!(" named \"{name}\"; the volume has {}", if names.is_empty() { "none" } else { &names })),
        )
    })
}
