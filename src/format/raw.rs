//! Volumes of plain bytes: what a header would say comes from the caller.

use super::GridFile;
use super::voxel_data::{DataFile, Encoding, Stored, VolumeError, grid};
use super::vtu::number::{ByteOrder, ScalarType};
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame};
use glam::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// The types of voxels by the names that the command line gives them.
const TYPES: [(&str, ScalarType); 10] = [
    ("u8", ScalarType::UInt8),
    ("i8", ScalarType::Int8),
    ("u16", ScalarType::UInt16),
    ("i16", ScalarType::Int16),
    ("u32", ScalarType::UInt32),
    ("i32", ScalarType::Int32),
    ("u64", ScalarType::UInt64),
    ("i64", ScalarType::Int64),
    ("f32", ScalarType::Float32),
    ("f64", ScalarType::Float64),
];

/// How the bytes of a raw volume are to be read: x fastest, then y, then z.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(into = "RawKeys")]
pub struct RawLayout {
    /// Points along x, y, z.
    pub dims: [u32; 3],
    /// Type of a voxel, one of [`RawLayout::TYPES`].
    pub voxel: &'static str,
    /// Distance between points, world units.
    pub spacing: [f64; 3],
    /// Whether the most significant byte comes first.
    pub is_big_endian: bool,
}

impl RawLayout {
    /// The names of the types.
    pub const TYPES: [&'static str; 10] = ["u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"];
}

/// A layout as JSON has it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawKeys {
    dims: [u32; 3],
    #[serde(rename = "type")]
    voxel: String,
    #[serde(default = "unit_spacing")]
    spacing: [f64; 3],
    #[serde(default)]
    big_endian: bool,
}

fn unit_spacing() -> [f64; 3] {
    [1.0; 3]
}

impl<'de> Deserialize<'de> for RawLayout {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        RawLayout::try_from(RawKeys::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

impl TryFrom<RawKeys> for RawLayout {
    type Error = String;

    fn try_from(keys: RawKeys) -> Result<Self, String> {
        let voxel = RawLayout::TYPES.into_iter().find(|name| *name == keys.voxel);
        let voxel = voxel.ok_or_else(|| format!("type is \"{}\", expected one of {}", keys.voxel, RawLayout::TYPES.join(", ")))?;
        if keys.dims.iter().any(|&n| n < 2) {
            return Err(format!("dims are {:?}, expected integers from 2", keys.dims));
        }
        if keys.spacing.iter().any(|&s| !(s.is_finite() && s > 0.0)) {
            return Err(format!("spacing is {:?}, expected numbers above 0", keys.spacing));
        }
        Ok(RawLayout { dims: keys.dims, voxel, spacing: keys.spacing, is_big_endian: keys.big_endian })
    }
}

impl From<RawLayout> for RawKeys {
    fn from(layout: RawLayout) -> Self {
        RawKeys { dims: layout.dims, voxel: layout.voxel.to_owned(), spacing: layout.spacing, big_endian: layout.is_big_endian }
    }
}

/// Reads a file of nothing but voxels.
pub(super) fn read(file: &GridFile<'_>, layout: &RawLayout, progress: &Progress) -> Result<Grid, VolumeError> {
    let name = file.default_name()?;
    let scalar = TYPES.iter().find(|(name, _)| *name == layout.voxel).map(|&(_, scalar)| scalar);
    let scalar = scalar.ok_or_else(|| VolumeError::key("type", layout.voxel, format!("one of {}", RawLayout::TYPES.join(", "))))?;
    let frame = GridFrame::along_axes(layout.dims, DVec3::ZERO, DVec3::from_array(layout.spacing));
    frame.validate()?;
    let [x, y, z] = layout.dims;
    let stored = Stored {
        scalar,
        order: if layout.is_big_endian { ByteOrder::Big } else { ByteOrder::Little },
        encoding: Encoding::Raw,
        numbers: frame.points(),
        why: format!("--dims {x},{y},{z} --type {}", layout.voxel),
    };
    let samples = DataFile::Own(file.source).read(0, &stored, file, progress)?;
    grid(file, frame, name, samples, 1, 1)
}
