//! MetaImage (<https://itk.org/Wiki/MetaIO/Documentation>): `.mhd` with its data beside it and `.mha` with its data behind the header.
//!
//! The rules where the format leaves a choice: `ElementSize` stands in for a missing `ElementSpacing`; `Position` and `Origin` are other
//! names of `Offset`, `Rotation` and `Orientation` of `TransformMatrix`, whose first three numbers are the direction of the first axis.
//! Lists and patterns of files are refused.

use super::GridFile;
use super::voxel_data::{DataFile, Encoding, Stored, VolumeError, dims, grid, head_of, numbers};
use super::vtu::number::{ByteOrder, ScalarType};
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame};
use glam::{DMat3, DVec3};

/// The types by name.
const TYPES: [(&str, ScalarType); 12] = [
    ("MET_CHAR", ScalarType::Int8),
    ("MET_UCHAR", ScalarType::UInt8),
    ("MET_SHORT", ScalarType::Int16),
    ("MET_USHORT", ScalarType::UInt16),
    ("MET_INT", ScalarType::Int32),
    ("MET_UINT", ScalarType::UInt32),
    ("MET_LONG", ScalarType::Int32),
    ("MET_ULONG", ScalarType::UInt32),
    ("MET_LONG_LONG", ScalarType::Int64),
    ("MET_ULONG_LONG", ScalarType::UInt64),
    ("MET_FLOAT", ScalarType::Float32),
    ("MET_DOUBLE", ScalarType::Float64),
];

/// Whether a file starts as MetaImage does.
pub(super) fn recognizes(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let first = text.lines().next().unwrap_or_default();
    let key = first.split_once('=').map(|(key, _)| key.trim());
    matches!(key, Some("ObjectType" | "NDims" | "Comment" | "ObjectSubType")) && (text.contains("DimSize") || first.contains("Image"))
}

/// The keys of a header.
struct Header {
    keys: Vec<(String, String)>,
    /// Where the data behind it begin.
    end: u64,
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<Grid, VolumeError> {
    let name = file.default_name()?;
    let head = head_of(file.source)?;
    let header = Header::parse(&head)?;
    match header.get("NDims") {
        Some("3") => {}
        Some(other) => return Err(VolumeError::key("NDims", other, "3")),
        None => return Err(VolumeError::missing("NDims", "3")),
    }
    let sizes = header.required("DimSize", "3 integers")?;
    let dims = dims("DimSize", numbers("DimSize", sizes, "3 integers from 1")?)?;
    let frame = header.frame(dims)?;
    frame.validate()?;

    let type_name = header.required("ElementType", "MET_UCHAR or another type")?;
    let scalar = TYPES.iter().find(|(name, _)| *name == type_name.trim_end_matches("_ARRAY")).map(|&(_, scalar)| scalar);
    let scalar = scalar.ok_or_else(|| VolumeError::key("ElementType", type_name, TYPES.map(|(name, _)| name).join(", ")))?;
    let components: u64 = match header.get("ElementNumberOfChannels") {
        None => 1,
        Some(text) => {
            let bad = || VolumeError::key("ElementNumberOfChannels", text, "an integer from 1");
            text.parse().ok().filter(|n| (1..=1 << 20).contains(n)).ok_or_else(bad)?
        }
    };
    let encoding = match (header.flag("BinaryData", true)?, header.flag("CompressedData", false)?) {
        (false, _) => Encoding::Text,
        (true, true) => Encoding::Zlib,
        (true, false) => Encoding::Raw,
    };
    let is_big = header.flag("BinaryDataByteOrderMSB", header.flag("ElementByteOrderMSB", false)?)?;
    let stored = Stored {
        scalar,
        order: if is_big { ByteOrder::Big } else { ByteOrder::Little },
        encoding,
        numbers: frame.points().saturating_mul(components),
        why: format!("DimSize = {sizes}, ElementType = {type_name}"),
    };
    let (data, start) = match header.required("ElementDataFile", "LOCAL or a file beside the header")? {
        "LOCAL" | "Local" | "local" => (DataFile::Own(file.source), header.end),
        name if name.starts_with("LIST") || name.contains('%') => {
            return Err(VolumeError::key("ElementDataFile", name, "one file with all data"));
        }
        name => (DataFile::beside(file, "ElementDataFile", name)?, 0),
    };
    let at = header.data_start(&data, start, &stored)?;
    let samples = data.read(at, &stored, file, progress)?;
    grid(file, frame, name, samples, 1, components as usize)
}

impl Header {
    /// All lines up to that of `ElementDataFile`, which is the last.
    fn parse(bytes: &[u8]) -> Result<Self, VolumeError> {
        let (mut keys, mut at) = (Vec::new(), 0);
        while at < bytes.len() {
            let end = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |n| at + n);
            let line = String::from_utf8_lossy(&bytes[at..end]).into_owned();
            at = (end + 1).min(bytes.len());
            if line.trim().is_empty() {
                continue;
            }
            let split = line.split_once('=');
            let (key, value) = split.ok_or_else(|| VolumeError::key("a line of the header", &line, "a line \"Key = value\""))?;
            keys.push((key.trim().to_owned(), value.trim().to_owned()));
            if key.trim() == "ElementDataFile" {
                break;
            }
        }
        Ok(Header { keys, end: at as u64 })
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.keys.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }

    fn required(&self, key: &str, expected: &str) -> Result<&str, VolumeError> {
        self.get(key).ok_or_else(|| VolumeError::missing(key, expected))
    }

    fn flag(&self, key: &str, absent: bool) -> Result<bool, VolumeError> {
        match self.get(key).map(str::to_lowercase).as_deref() {
            None => Ok(absent),
            Some("true" | "1" | "t") => Ok(true),
            Some("false" | "0" | "f") => Ok(false),
            Some(other) => Err(VolumeError::key(key, other, "True or False")),
        }
    }

    /// Numbers under the first of several keys that is there.
    fn first_of<const N: usize>(&self, keys: &[&str], absent: [f64; N]) -> Result<[f64; N], VolumeError> {
        match keys.iter().find_map(|&key| Some((key, self.get(key)?))) {
            Some((key, text)) => numbers(key, text, &format!("{N} numbers")),
            None => Ok(absent),
        }
    }

    fn frame(&self, dims: [u32; 3]) -> Result<GridFrame, VolumeError> {
        let spacing = DVec3::from_array(self.first_of(&["ElementSpacing", "ElementSize"], [1.0; 3])?);
        let unit = DMat3::IDENTITY.to_cols_array();
        let directions = DMat3::from_cols_array(&self.first_of(&["TransformMatrix", "Rotation", "Orientation"], unit)?);
        let origin = DVec3::from_array(self.first_of(&["Offset", "Position", "Origin"], [0.0; 3])?);
        Ok(GridFrame { dims, origin, steps: directions * DMat3::from_diagonal(spacing) })
    }

    fn data_start(&self, data: &DataFile<'_>, start: u64, stored: &Stored) -> Result<u64, VolumeError> {
        let Some(text) = self.get("HeaderSize") else { return Ok(start) };
        let bytes = stored.numbers.saturating_mul(stored.scalar.size() as u64);
        match text.parse::<i64>() {
            Ok(-1) if stored.encoding == Encoding::Raw => Ok(data.len().saturating_sub(bytes).max(start)),
            Ok(skip @ 0..) => Ok(start.saturating_add(skip as u64).min(data.len())),
            _ => Err(VolumeError::key("HeaderSize", text, "an integer from 0, or -1 with raw data")),
        }
    }
}
