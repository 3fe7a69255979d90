//! NRRD (<https://teem.sourceforge.net/nrrd/format.html>): attached (`.nrrd`) and detached (`.nhdr`), raw, gzip and text.
//!
//! The rules where the format leaves a choice: fields that say nothing of shape, place or numbers are not read, so are key/value pairs.
//! `byte skip` may be -1 in raw files. One axis of four may hold the components of vectors: an axis whose kind is none of space, or that has
//! no direction, or the first. Coordinates are taken as they are, whatever anatomical directions `space` names. Data lie in one file
//! that is named without folders above the header's; lists and patterns of files are refused.

use super::GridFile;
use super::voxel_data::{DataFile, Encoding, Stored, VolumeError, dims, grid, head_of, numbers};
use super::vtu::number::{ByteOrder, ScalarType};
use crate::image::write_atomically;
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame, Samples, with_voxels};
use glam::{DMat3, DVec3};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The types by all their names.
const TYPES: [(&[&str], ScalarType); 10] = [
    (&["signed char", "int8", "int8_t"], ScalarType::Int8),
    (&["uchar", "unsigned char", "uint8", "uint8_t"], ScalarType::UInt8),
    (&["short", "short int", "signed short", "signed short int", "int16", "int16_t"], ScalarType::Int16),
    (&["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"], ScalarType::UInt16),
    (&["int", "signed int", "int32", "int32_t"], ScalarType::Int32),
    (&["uint", "unsigned int", "uint32", "uint32_t"], ScalarType::UInt32),
    (&["longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"], ScalarType::Int64),
    (&["ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"], ScalarType::UInt64),
    (&["float"], ScalarType::Float32),
    (&["double"], ScalarType::Float64),
];

/// Whether a file starts as NRRD does.
pub(super) fn recognizes(start: &[u8]) -> bool {
    start.starts_with(b"NRRD00")
}

/// The fields of a header, names in lower case and without blanks.
struct Header {
    fields: Vec<(String, String)>,
    /// Where the data of an attached header begin.
    end: u64,
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<Grid, VolumeError> {
    let name = file.default_name()?;
    let head = head_of(file.source)?;
    let header = Header::parse(&head)?;
    let axes = header.axes()?;
    let frame = header.frame(&axes)?;
    frame.validate()?;

    let type_name = header.required("type", "a type of numbers")?;
    let scalar = TYPES.iter().find(|(names, _)| names.contains(&type_name)).map(|&(_, scalar)| scalar);
    let scalar = scalar.ok_or_else(|| VolumeError::key("type", type_name, "int8 to uint64, float or double, by any of their names"))?;
    let encoding = match header.required("encoding", "raw, gzip or text")? {
        "raw" => Encoding::Raw,
        "gzip" | "gz" => Encoding::Gzip,
        "text" | "txt" | "ascii" => Encoding::Text,
        other => return Err(VolumeError::key("encoding", other, "raw, gzip or text")),
    };
    let order = match header.get("endian") {
        Some("little") => ByteOrder::Little,
        Some("big") => ByteOrder::Big,
        Some(other) => return Err(VolumeError::key("endian", other, "little or big")),
        None if scalar.size() == 1 || encoding == Encoding::Text => ByteOrder::Little,
        None => return Err(VolumeError::missing("endian", "little or big, for numbers of several bytes")),
    };
    let count = axes.sizes.iter().try_fold(1u64, |product, &size| product.checked_mul(size));
    let count = count.ok_or_else(|| VolumeError::key("sizes", &format!("{:?}", axes.sizes), "a number of voxels that can be counted"))?;
    let sizes = axes.sizes.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
    let stored = Stored { scalar, order, encoding, numbers: count, why: format!("sizes: {sizes}, type: {type_name}") };

    let (data, start) = match header.get("datafile") {
        None => (DataFile::Own(file.source), header.end),
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(VolumeError::key("data file", name, "one file with all data"));
        }
        Some(name) => (DataFile::beside(file, "data file", name)?, 0),
    };
    let at = header.data_start(&data, start, &stored)?;
    let samples = data.read(at, &stored, file, progress)?;
    let inner = axes.components.map_or(1, |axis| axes.sizes[..axis].iter().product::<u64>());
    let components = axes.components.map_or(1, |axis| axes.sizes[axis]);
    grid(file, frame, name, samples, inner as usize, components as usize)
}

/// The axes of an array.
struct Axes {
    /// Fastest first.
    sizes: Vec<u64>,
    /// Which axis holds the components of vectors.
    components: Option<usize>,
}

impl Axes {
    /// The axes of space.
    fn of_space<T: Copy>(&self, of_all: &[T]) -> Vec<T> {
        (0..of_all.len()).filter(|&axis| Some(axis) != self.components).map(|axis| of_all[axis]).collect()
    }
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, VolumeError> {
        let (mut fields, mut at) = (Vec::new(), 0);
        while at < bytes.len() {
            let end = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |n| at + n);
            let line = String::from_utf8_lossy(&bytes[at..end]);
            let line = line.trim_end_matches('\r');
            let is_first = at == 0;
            at = (end + 1).min(bytes.len());
            if line.is_empty() {
                break; // data follow
            }
            if is_first || line.starts_with('#') || line.find(":=").is_some_and(|pair| line.find(": ").is_none_or(|field| pair < field)) {
                continue;
            }
            let expected = "a line \"field: value\"";
            let (name, value) = line.split_once(':').ok_or_else(|| VolumeError::key("a line of the header", line, expected))?;
            let name: String = name.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_lowercase();
            fields.push((name, value.trim().to_owned()));
        }
        Ok(Header { fields, end: at as u64 })
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|(field, _)| field == name).map(|(_, value)| value.as_str())
    }

    fn required(&self, name: &str, expected: &str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| VolumeError::missing(name, expected))
    }

    fn axes(&self) -> Result<Axes, VolumeError> {
        let dimension: usize = match self.required("dimension", "3, or 4 with an axis of components")? {
            "3" => 3,
            "4" => 4,
            other => return Err(VolumeError::key("dimension", other, "3, or 4 with an axis of components")),
        };
        let text = self.required("sizes", "a size an axis")?;
        let sizes: Option<Vec<u64>> = text.split_ascii_whitespace().map(|n| n.parse().ok().filter(|&n| n > 0)).collect();
        let sizes = sizes.filter(|sizes| sizes.len() == dimension);
        let sizes = sizes.ok_or_else(|| VolumeError::key("sizes", text, format!("{dimension} integers from 1")))?;
        Ok(Axes { components: if dimension == 4 { Some(self.component_axis()?) } else { None }, sizes })
    }

    /// Which axis of four is none of space.
    fn component_axis(&self) -> Result<usize, VolumeError> {
        let Some(text) = self.get("kinds") else {
            let no_direction = self.get("spacedirections").and_then(|t| vectors(t).ok()).and_then(|v| v.iter().position(Option::is_none));
            return Ok(no_direction.unwrap_or(0));
        };
        let kinds: Vec<&str> = text.split_ascii_whitespace().collect();
        let is_space = |kind: &str| matches!(kind.to_lowercase().as_str(), "domain" | "space" | "time" | "???" | "none");
        let found: Vec<usize> = (0..kinds.len()).filter(|&axis| !is_space(kinds[axis])).collect();
        match (kinds.len(), &found[..]) {
            (4, &[axis]) => Ok(axis),
            (4, []) => Ok(0),
            _ => Err(VolumeError::key("kinds", text, "four kinds, one of them of components")),
        }
    }

    fn frame(&self, axes: &Axes) -> Result<GridFrame, VolumeError> {
        let of_space = axes.of_space(&axes.sizes);
        let dims = dims("sizes", [of_space[0], of_space[1], of_space[2]])?;
        let steps = match self.get("spacedirections") {
            Some(text) => {
                let bad = || VolumeError::key("space directions", text, "a vector (x,y,z) for each axis of space");
                let all = vectors(text)?;
                if all.len() != axes.sizes.len() {
                    return Err(bad());
                }
                let of_space: Option<Vec<DVec3>> = axes.of_space(&all).into_iter().collect();
                let of_space = of_space.ok_or_else(bad)?;
                DMat3::from_cols(of_space[0], of_space[1], of_space[2])
            }
            None => DMat3::from_diagonal(self.per_axis("spacings", axes, 1.0)?),
        };
        let origin = match self.get("spaceorigin") {
            Some(text) => match vectors(text)?[..] {
                [Some(origin)] => origin,
                _ => return Err(VolumeError::key("space origin", text, "one vector (x,y,z)")),
            },
            None => self.per_axis("axismins", axes, 0.0)?,
        };
        Ok(GridFrame { dims, origin, steps })
    }

    /// A number for each axis of space; `absent` where there is none or NaN.
    fn per_axis(&self, name: &str, axes: &Axes, absent: f64) -> Result<DVec3, VolumeError> {
        let Some(text) = self.get(name) else { return Ok(DVec3::splat(absent)) };
        let all: Vec<f64> = match axes.sizes.len() {
            3 => numbers::<f64, 3>(name, text, "3 numbers")?.to_vec(),
            _ => numbers::<f64, 4>(name, text, "4 numbers")?.to_vec(),
        };
        let of_space: Vec<f64> = axes.of_space(&all).into_iter().map(|v| if v.is_nan() { absent } else { v }).collect();
        Ok(DVec3::new(of_space[0], of_space[1], of_space[2]))
    }

    /// Where the data begin, behind the lines and bytes to skip.
    fn data_start(&self, data: &DataFile<'_>, start: u64, stored: &Stored) -> Result<u64, VolumeError> {
        let lines = match self.get("lineskip") {
            None => 0,
            Some(text) => text.parse().map_err(|_| VolumeError::key("line skip", text, "an integer from 0"))?,
        };
        let at = data.skip_lines(start, lines, "line skip")?;
        let bytes = stored.numbers.saturating_mul(stored.scalar.size() as u64);
        let Some(text) = self.get("byteskip") else { return Ok(at) };
        match text.parse() {
            Ok(-1) if stored.encoding == Encoding::Raw => Ok(data.len().saturating_sub(bytes).max(start)),
            Ok(skip @ 0..) if stored.encoding != Encoding::Gzip || skip == 0 => Ok(at.saturating_add(skip as u64).min(data.len())),
            Ok(0i64..) => Err(VolumeError::key("byte skip", text, "0 where data are compressed")),
            _ => Err(VolumeError::key("byte skip", text, "an integer from 0, or -1 with raw data")),
        }
    }
}

/// `(x,y,z)` or `none`, several of them.
fn vectors(text: &str) -> Result<Vec<Option<DVec3>>, VolumeError> {
    let bad = || VolumeError::key("a vector", text, "(x,y,z)");
    let (mut found, mut rest) = (Vec::new(), text.trim());
    while !rest.is_empty() {
        if let Some(behind) = rest.strip_prefix("none") {
            found.push(None);
            rest = behind.trim_start();
            continue;
        }
        let (inside, behind) = rest.strip_prefix('(').and_then(|t| t.split_once(')')).ok_or_else(bad)?;
        let numbers: Option<Vec<f64>> = inside.split(',').map(|n| n.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, z]) if x.is_nan() && y.is_nan() && z.is_nan() => found.push(None),
            Some(&[x, y, z]) => found.push(Some(DVec3::new(x, y, z))),
            _ => return Err(bad()),
        }
        rest = behind.trim_start();
    }
    Ok(found)
}

/// Writes a volume: `.nrrd` as one file, any other suffix as a header with its data, raw and little-endian, in a file of the same name with
/// `.raw` beside it. Files are written under a temporary name and renamed.
pub fn write(path: &Path, grid: &Grid, progress: &Progress) -> io::Result<()> {
    let is_attached = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("nrrd"));
    let (type_name, size) = match grid.samples() {
        Samples::U8(_) => ("uint8", 1),
        Samples::I8(_) => ("int8", 1),
        Samples::U16(_) => ("uint16", 2),
        Samples::I16(_) => ("int16", 2),
        Samples::U32(_) => ("uint32", 4),
        Samples::I32(_) => ("int32", 4),
        Samples::F32(_) => ("float", 4),
        Samples::F64(_) => ("double", 8),
    };
    let (frame, vector) = (grid.frame(), |v: DVec3| format!("({},{},{})", v.x, v.y, v.z));
    let ([x, y, z], steps) = (frame.dims, [frame.steps.x_axis, frame.steps.y_axis, frame.steps.z_axis].map(vector).join(" "));
    let mut head = format!(
        "NRRD0004\n# {}\ntype: {type_name}\ndimension: 3\nspace dimension: 3\nsizes: {x} {y} {z}\nspace directions: {steps}\nspace origin: {}\nendian: little\nencoding: raw\n",
        grid.name().replace(['\n', '\r'], " "),
        vector(frame.origin)
    );
    progress.begin("writing", frame.points() * size);
    let put = |out: &mut dyn Write| put_values(out, grid.samples(), progress);
    if is_attached {
        head.push('\n');
        return write_atomically(path, |out| {
            out.write_all(head.as_bytes())?;
            put(out)
        });
    }
    let data = data_path(path);
    let name = data.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    head += &format!("data file: {name}\n");
    write_atomically(&data, |out| put(out))?;
    write_atomically(path, |out| out.write_all(head.as_bytes()))
}

/// Where [`write()`] puts the data of a header.
pub fn data_path(path: &Path) -> PathBuf {
    path.with_extension("raw")
}

fn put_values(out: &mut dyn Write, samples: &Samples, progress: &Progress) -> io::Result<()> {
    macro_rules! put {
        ($values:expr) => {
            for chunk in $values.chunks(1 << 16) {
                progress.check().map_err(io::Error::other)?;
                let bytes: Vec<u8> = chunk.iter().flat_map(|v| v.to_le_bytes()).collect();
                out.write_all(&bytes)?;
                progress.add(bytes.len() as u64);
            }
        };
    }
    with_voxels!(samples, values => put!(values));
    Ok(())
}
