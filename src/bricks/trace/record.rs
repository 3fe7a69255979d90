//! Traces as files.

use super::{SliceSet, Trace};
use crate::bricks::{BRICK_EDGE, SlicePlane};
use crate::image::write_atomically;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Why a file is no trace.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// It cannot be read or written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// It is no JSON, or not of this form.
    #[error(
        "{0}; expected {{\"dims\": [x, y, z], \"frames\": [{{\"planes\": [{{\"point\": [x, y, z], \"normal\": [x, y, z]}}], \"moving\": 0}}]}}"
    )]
    Form(String),
    /// The numbers make no sense.
    #[error("frame {frame}: {what}")]
    Frame {
        /// Which frame, from 0.
        frame: usize,
        /// What is wrong with it.
        what: String,
    },
    /// A volume without voxels.
    #[error("dims are {} x {} x {}, expected at least 1 along each axis", .0[0], .0[1], .0[2])]
    Dims([u32; 3]),
    /// Nothing to replay.
    #[error("has no frames")]
    Empty,
}

#[derive(Serialize, Deserialize)]
struct Record {
    #[serde(default)]
    name: String,
    dims: [u32; 3],
    frames: Vec<FrameRecord>,
}

#[derive(Serialize, Deserialize)]
struct FrameRecord {
    planes: Vec<PlaneRecord>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    moving: Option<usize>,
}

#[derive(Serialize, Deserialize)]
struct PlaneRecord {
    point: [f64; 3],
    normal: [f64; 3],
}

impl Trace {
    /// Reads what [`Trace::to_json`] writes. Normals may have any length; slices may lie up to a brick beside the volume.
    pub fn from_json(text: &str) -> Result<Self, TraceError> {
        let mut reader = serde_json::Deserializer::from_str(text);
        let record: Record = serde_path_to_error::deserialize(&mut reader).map_err(|error| TraceError::Form(error.to_string()))?;
        reader.end().map_err(|error| TraceError::Form(error.to_string()))?;
        if record.dims.contains(&0) {
            return Err(TraceError::Dims(record.dims));
        }
        let frames: Vec<SliceSet> =
            record.frames.iter().enumerate().map(|(i, frame)| frame.read(i, record.dims)).collect::<Result<_, _>>()?;
        if frames.is_empty() {
            return Err(TraceError::Empty);
        }
        Ok(Trace { name: record.name, dims: record.dims, frames })
    }

    /// The trace as JSON text.
    pub fn to_json(&self) -> Result<String, TraceError> {
        let plane = |plane: &SlicePlane| PlaneRecord { point: plane.point.to_array(), normal: plane.normal.to_array() };
        let frame = |frame: &SliceSet| FrameRecord { planes: frame.planes.iter().map(plane).collect(), moving: frame.moving };
        let record = Record { name: self.name.clone(), dims: self.dims, frames: self.frames.iter().map(frame).collect() };
        serde_json::to_string(&record).map_err(|error| TraceError::Io(error.into()))
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, TraceError> {
        let mut trace = Self::from_json(&std::fs::read_to_string(path)?)?;
        if trace.name.is_empty() {
            trace.name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        }
        Ok(trace)
    }

    /// Writes a file, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), TraceError> {
        let json = self.to_json()?;
        Ok(write_atomically(path, |out| out.write_all(json.as_bytes()))?)
    }
}

impl FrameRecord {
    fn read(&self, frame: usize, dims: [u32; 3]) -> Result<SliceSet, TraceError> {
        let half = DVec3::from(dims.map(f64::from)) / 2.0;
        let wrong = |what: String| TraceError::Frame { frame, what };
        let mut planes = Vec::with_capacity(self.planes.len());
        for (i, PlaneRecord { point, normal }) in self.planes.iter().enumerate() {
            let plane = SlicePlane::new(DVec3::from(*point), DVec3::from(*normal));
            let plane = plane.ok_or_else(|| wrong(format!("slice {i} is no plane: point {point:?}, normal {normal:?}")))?;
            let most = half.dot(plane.normal.abs()) + f64::from(BRICK_EDGE);
            if !(-most..=most).contains(&plane.distance(half - 0.5)) {
                return Err(wrong(format!("slice {i} lies beside the volume: point {point:?}, normal {normal:?}, {dims:?} voxels")));
            }
            planes.push(plane);
        }
        if let Some(moving) = self.moving.filter(|&moving| moving >= planes.len()) {
            return Err(wrong(format!("slice {moving} moves, but there are {}", planes.len())));
        }
        Ok(SliceSet { planes, moving: self.moving })
    }
}
