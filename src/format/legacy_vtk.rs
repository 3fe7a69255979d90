//! VTK's legacy format, `.vtk`, with `DATASET STRUCTURED_POINTS`, which is a volume, and `STRUCTURED_GRID` or `RECTILINEAR_GRID`, whose hexahedra
//! become tets: text and binary (which is big-endian), every kind of array
//! (VTK File Formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>).
//!
//! The rules where the format leaves a choice: without a name the first array with one component counts, else the first, points before
//! cells; arrays over cells become a volume of the cells' centres. Text and bit arrays cannot be passed over in binary files and end the
//! reading there. Of arrays with the same name the first counts.

use super::source::Source;
use super::voxel_data::{DataFile, Encoding, Stored, VolumeError, dims, grid, numbers};
use super::vtu::number::{ByteOrder, ScalarType};
use super::{Found, GridFile};
use crate::mesh::{DataArray, MeshParts, StructuredBlock, Values, split_into_tets};
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame, Samples, Voxel};
use glam::DVec3;
use std::borrow::Cow;

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
}

impl Dataset {
    /// All of them by name.
    const NAMES: [(&'static str, Dataset); 3] = [
        ("STRUCTURED_POINTS", Dataset::StructuredPoints),
        ("STRUCTURED_GRID", Dataset::StructuredGrid),
        ("RECTILINEAR_GRID", Dataset::RectilinearGrid),
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
        _ => mesh(file, &head, &arrays, is_binary, progress).map(Found::Mesh),
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

    /// An error unless it has so many tuples.
    fn expect_tuples(&self, expected: u128, dims: &str) -> Result<(), VolumeError> {
        if u128::from(self.tuples) == expected {
            return Ok(());
        }
        let key = format!("the size of array \"{}\"", self.name);
        Err(VolumeError::key(&key, &self.tuples.to_string(), format!("{expected}, by DIMENSIONS {dims}")))
    }
}

/// The tets of a structured or rectilinear grid, with all arrays.
fn mesh(file: &GridFile<'_>, head: &Head, arrays: &[Array], is_binary: bool, progress: &Progress) -> Result<MeshParts, VolumeError> {
    let dims = head.dims.ok_or_else(|| VolumeError::missing("DIMENSIONS", "3 integers from 2"))?;
    let said = in_words(dims);
    let (points, cells) = (product(dims), product(dims.map(|n| n.saturating_sub(1))));
    if dims.iter().any(|&n| n < 2) || points >= u128::from(u32::MAX) {
        return Err(VolumeError::key("DIMENSIONS", &said, format!("2 points or more along each axis, fewer than {} in all", u32::MAX)));
    }
    let numbers = |array: &Array| {
        array.read(file, is_binary, &said, progress).map(|samples| (0..samples.len()).map(|i| samples.get(i)).collect::<Vec<f64>>())
    };
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
    let (mut point_data, mut cell_data) = (Vec::new(), Vec::new());
    for array in arrays {
        let (data, expected) = if array.is_of_cells { (&mut cell_data, cells) } else { (&mut point_data, points) };
        array.expect_tuples(expected, &said)?;
        let is_new = data.iter().all(|other: &DataArray| other.name != array.name);
        if is_new {
            let values = values(array.read(file, is_binary, &said, progress)?);
            data.push(DataArray { name: array.name.clone(), components: array.components as usize, values });
        }
    }
    let block = StructuredBlock::new(dims.map(|n| n as usize));
    split_into_tets(&[block], places, point_data, cell_data, None).map_err(|e| VolumeError::key("DIMENSIONS", &said, e.to_string()))
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

/// The lines of a file.
struct Lines<'a> {
    source: &'a Source<'a>,
    at: u64,
}

impl Lines<'_> {
    /// The next line; `None` at the end.
    fn next(&mut self) -> Result<Option<String>, VolumeError> {
        let len = (self.source.len() - self.at).min(LINE_LIMIT) as usize;
        let bytes = self.source.read(self.at, len)?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let end = bytes.iter().position(|&b| b == b'\n');
        if end.is_none() && bytes.len() as u64 == LINE_LIMIT {
            let start = String::from_utf8_lossy(&bytes[..40]).into_owned();
            return Err(VolumeError::key(&format!("the line at byte {}", self.at), &start, format!("at most {LINE_LIMIT} characters")));
        }
        self.at += end.map_or(bytes.len(), |end| end + 1) as u64;
        Ok(Some(String::from_utf8_lossy(&bytes[..end.unwrap_or(bytes.len())]).trim().to_owned()))
    }

    /// Passes over `count` words between blanks.
    fn skip_words(&mut self, count: u64, array: &str) -> Result<(), VolumeError> {
        let (mut left, mut in_word) = (count, false);
        while left > 0 || in_word {
            let bytes = self.source.read(self.at, (self.source.len() - self.at).min(1 << 20) as usize)?;
            if bytes.is_empty() {
                let (found, expected) = (count - left, format!("{count} numbers"));
                return if left == 0 {
                    Ok(())
                } else {
                    Err(VolumeError::key(&format!("array \"{array}\""), &format!("{found} numbers"), expected))
                };
            }
            let mut used = 0;
            for &b in bytes.iter() {
                match (b.is_ascii_whitespace(), in_word) {
                    (false, false) if left == 0 => break,
                    (false, false) => (in_word, left) = (true, left - 1),
                    (true, true) => in_word = false,
                    _ => {}
                }
                used += 1;
                if left == 0 && !in_word {
                    break;
                }
            }
            self.at += used;
        }
        Ok(())
    }
}

/// Goes through a file by its keywords and notes where arrays lie.
struct Walker<'a> {
    lines: Lines<'a>,
    is_binary: bool,
    head: Head,
    arrays: Vec<Array>,
}

impl Walker<'_> {
    fn walk(mut self) -> Result<(Head, Vec<Array>), VolumeError> {
        let (mut tuples, mut is_of_cells) = (None, false);
        while let Some(line) = self.lines.next()? {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let Some(keyword) = words.first().map(|word| word.to_uppercase()) else { continue };
            let rest = line[words[0].len()..].trim();
            match (keyword.as_str(), tuples) {
                ("DATASET", _) => {
                    let known = Dataset::NAMES.iter().find(|(name, _)| rest.eq_ignore_ascii_case(name));
                    let expected = || format!("{}, which octetra reads in .vtk files", Dataset::NAMES.map(|(name, _)| name).join(", "));
                    self.head.dataset = known.ok_or_else(|| VolumeError::key("DATASET", rest, expected()))?.1;
                }
                ("POINTS" | "X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES", _) if self.head.dataset != Dataset::StructuredPoints => {
                    let (components, bad) =
                        (if keyword == "POINTS" { 3 } else { 1 }, || VolumeError::key(&keyword, rest, "a count and a type"));
                    let count = words.get(1).and_then(|n| n.parse().ok()).ok_or_else(bad)?;
                    self.array(&keyword, words.get(2).ok_or_else(bad)?, components, count, false)?;
                    self.head.places.extend(self.arrays.pop());
                }
                ("DIMENSIONS", _) => self.head.dims = Some(numbers("DIMENSIONS", rest, "3 integers from 2")?),
                ("ORIGIN", _) => self.head.origin = Some(DVec3::from_array(numbers("ORIGIN", rest, "3 numbers")?)),
                ("SPACING" | "ASPECT_RATIO", _) => self.head.spacing = Some(DVec3::from_array(numbers("SPACING", rest, "3 numbers")?)),
                ("POINT_DATA" | "CELL_DATA", _) => {
                    let [count] = numbers::<u64, 1>(&keyword, rest, "an integer from 0")?;
                    (tuples, is_of_cells) = (Some(count), keyword == "CELL_DATA");
                }
                ("METADATA", _) => while self.lines.next()?.is_some_and(|line| !line.is_empty()) {},
                ("FIELD", tuples) => self.field(&words, tuples.is_some(), is_of_cells)?,
                (_, Some(tuples)) => {
                    if !self.attribute(&keyword, &words, tuples, is_of_cells)? {
                        break;
                    }
                }
                _ => {
                    let (name, _) = Dataset::NAMES.iter().find(|(_, dataset)| *dataset == self.head.dataset).unwrap_or(&Dataset::NAMES[0]);
                    return Err(VolumeError::key("the keyword", &line, format!("one of {name}")));
                }
            }
        }
        Ok((self.head, self.arrays))
    }

    /// An array by its keyword; false if nothing is known of its size.
    fn attribute(&mut self, keyword: &str, words: &[&str], tuples: u64, is_of_cells: bool) -> Result<bool, VolumeError> {
        let word = |i: usize| words.get(i).copied().unwrap_or_default();
        let count = |i: usize| word(i).parse::<u64>().ok().filter(|n| (1..=1 << 20).contains(n));
        let (type_name, components) = match keyword {
            "SCALARS" if words.len() < 4 => (word(2), Some(1)),
            "SCALARS" => (word(2), count(3)),
            "VECTORS" | "NORMALS" => (word(2), Some(3)),
            "TENSORS" => (word(2), Some(9)),
            "TENSORS6" => (word(2), Some(6)),
            "TEXTURE_COORDINATES" => (word(3), count(2)),
            "COLOR_SCALARS" => (if self.is_binary { "unsigned_char" } else { "float" }, count(2)),
            "LOOKUP_TABLE" => {
                let size = count(2).ok_or_else(|| VolumeError::key(keyword, word(2), "a size"))?;
                self.pass(word(1), if self.is_binary { ScalarType::UInt8 } else { ScalarType::Float32 }, size * 4)?;
                return Ok(true);
            }
            _ => return Ok(false),
        };
        let components = components.ok_or_else(|| VolumeError::key(keyword, &words.join(" "), "a number of components"))?;
        if keyword == "SCALARS" {
            // The name of its table may follow.
            let at = self.lines.at;
            if !self.lines.next()?.is_some_and(|line| line.to_uppercase().starts_with("LOOKUP_TABLE")) {
                self.lines.at = at;
            }
        }
        self.array(word(1), type_name, components, tuples, is_of_cells)?;
        Ok(true)
    }

    /// `FIELD name count`, and that many arrays; those that belong to nothing are passed over.
    fn field(&mut self, words: &[&str], is_data: bool, is_of_cells: bool) -> Result<(), VolumeError> {
        let count = words.get(2).and_then(|n| n.parse::<u32>().ok());
        for _ in 0..count.ok_or_else(|| VolumeError::key("FIELD", &words.join(" "), "a name and a number of arrays"))? {
            let line = loop {
                match self.lines.next()? {
                    Some(line) if line.is_empty() => {}
                    Some(line) if line == "METADATA" => while self.lines.next()?.is_some_and(|line| !line.is_empty()) {},
                    Some(line) => break line,
                    None => return Err(VolumeError::key("FIELD", "at the end of the file", "as many arrays as it says")),
                }
            };
            let bad = || VolumeError::key("an array of FIELD", &line, "a name, a number of components and one of tuples, and a type");
            let [name, components, tuples, type_name] = line.split_ascii_whitespace().collect::<Vec<_>>().try_into().map_err(|_| bad())?;
            let (components, tuples) = components.parse().ok().zip(tuples.parse().ok()).ok_or_else(bad)?;
            self.array(name, type_name, components, tuples, is_of_cells)?;
            if !is_data {
                self.arrays.pop();
            }
        }
        Ok(())
    }

    /// Notes an array that begins here, and goes on behind it.
    fn array(&mut self, name: &str, type_name: &str, components: u64, tuples: u64, is_of_cells: bool) -> Result<(), VolumeError> {
        let known = TYPES.iter().find(|(known, _)| known.eq_ignore_ascii_case(type_name));
        let expected = || TYPES.map(|(name, _)| name).join(", ");
        let &(_, scalar) = known.ok_or_else(|| VolumeError::key(&format!("the type of array \"{name}\""), type_name, expected()))?;
        let start = self.lines.at;
        let count = components.checked_mul(tuples);
        let count = count.ok_or_else(|| VolumeError::key(&format!("the size of array \"{name}\""), &tuples.to_string(), "a count"))?;
        self.pass(name, scalar, count)?;
        self.arrays.push(Array { name: name.to_owned(), scalar, components, tuples, is_of_cells, place: start..self.lines.at });
        Ok(())
    }

    /// Goes on behind numbers.
    fn pass(&mut self, name: &str, scalar: ScalarType, count: u64) -> Result<(), VolumeError> {
        if !self.is_binary {
            return self.lines.skip_words(count, name);
        }
        let (left, bytes) = (self.lines.source.len() - self.lines.at, count.saturating_mul(scalar.size() as u64));
        if bytes > left {
            return Err(VolumeError::key(&format!("array \"{name}\""), &format!("{left} bytes of data"), format!("{bytes}")));
        }
        self.lines.at += bytes;
        Ok(())
    }
}
