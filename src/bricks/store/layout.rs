//! What lies where in a store, and the metadata that say so.
//!
//! ```text
//! STORE.zarr/
//!   zarr.json              the root: OME-NGFF 0.5 multiscales, and "octetra": what Info holds. Written last: without it a store is not whole.
//!   0/ 1/ 2/ ..            the levels, from the finest: arrays along z, y, x in shards of bricks of 64^3 voxels, zstd
//!   statistics/0/ 1/ ..    for each level an array along z, y, x of bricks: smallest, largest value, entropy, share known
//!   octetra-build.json     what is being written, while it is
//! ```

use super::voxel::array_of;
use crate::bricks::{BRICK_EDGE, Pyramid};
use crate::volume::{GridFrame, VoxelType};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::sync::Arc;
use zarrs::array::codec::ZstdCodec;
use zarrs::array::codec::array_to_bytes::sharding::{ShardingCodecOptions, SubchunkWriteOrder};
use zarrs::array::{Array, ArrayBuilder, ArrayCreateError, CodecSpecificOptions, data_type};

/// The version of [`Info`] that this program writes, and reads.
pub const VERSION: u32 = 1;
/// The compression level of zstd: fast, and hardly worse on measured data than slow ones.
const ZSTD_LEVEL: i32 = 1;
/// Numbers that are kept of a brick.
pub const STATISTICS: usize = 4;

/// What a store says of itself, beside what OME-NGFF has a place for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`VERSION`].
    pub version: u32,
    /// What the numbers are called.
    pub name: String,
    /// The type of the voxels: `u8` to `f64`.
    pub voxel_type: String,
    /// Voxels along x, y, z.
    pub dims: [u32; 3],
    /// World position of voxel (0, 0, 0).
    pub origin: [f64; 3],
    /// The ways to the next voxels along x, y, z.
    pub steps: [[f64; 3]; 3],
    /// Smallest and largest value; absent while the store is being written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Bricks along the edge of a shard.
    pub shard_bricks: u32,
}

impl Info {
    /// What is known of a volume before it is read.
    pub fn new(frame: &GridFrame, name: &str, voxel_type: VoxelType, shard_bricks: u32) -> Self {
        Info {
            version: VERSION,
            name: name.to_owned(),
            voxel_type: voxel_type.name().to_owned(),
            dims: frame.dims,
            origin: frame.origin.to_array(),
            steps: frame.steps.to_cols_array_2d(),
            range: None,
            shard_bricks,
        }
    }

    /// Where the voxels lie.
    pub fn frame(&self) -> GridFrame {
        GridFrame { dims: self.dims, origin: DVec3::from(self.origin), steps: DMat3::from_cols_array_2d(&self.steps) }
    }

    /// The type of the voxels; `None` if it is none that there is.
    pub fn voxel_type(&self) -> Option<VoxelType> {
        VoxelType::ALL.into_iter().find(|voxel_type| voxel_type.name() == self.voxel_type)
    }

    /// The levels.
    pub fn pyramid(&self) -> Pyramid {
        Pyramid::new(self.dims)
    }

    /// Voxels along the edge of a shard.
    pub fn shard_edge(&self) -> u32 {
        self.shard_bricks * BRICK_EDGE
    }

    /// The attributes of the root. Other programs find the levels, their scale and place by OME-NGFF 0.5, for volumes along the world's axes; of
    /// others they find the lengths of the steps, from 0.
    pub fn root_attributes(&self) -> Value {
        let frame = self.frame();
        let spacing = frame.spacing();
        let is_along_axes = frame.steps == DMat3::from_diagonal(spacing);
        let origin = if is_along_axes { frame.origin } else { DVec3::ZERO };
        let backwards = |v: DVec3| json!([v.z, v.y, v.x]);
        let dataset = |level: u8| {
            let size = f64::from(level).exp2();
            json!({"path": level.to_string(), "coordinateTransformations": [
                {"type": "scale", "scale": backwards(spacing * size)},
                {"type": "translation", "translation": backwards(origin + spacing * (size - 1.0) / 2.0)},
            ]})
        };
        let axes = ["z", "y", "x"].map(|name| json!({"name": name, "type": "space"}));
        let datasets: Vec<Value> = (0..self.pyramid().levels()).map(dataset).collect();
        json!({
            "ome": {"version": "0.5", "multiscales": [{"name": self.name, "axes": axes, "datasets": datasets}]},
            "octetra": self,
        })
    }
}

/// Numbers along x, y, z as Zarr has them.
pub fn along_zyx(of: [u32; 3]) -> Vec<u64> {
    of.iter().rev().map(|&n| u64::from(n)).collect()
}

/// The array of a level.
pub fn level_array<S: ?Sized>(storage: Arc<S>, info: &Info, voxel_type: VoxelType, level: u8) -> Result<Array<S>, ArrayCreateError> {
    let mut builder = array_of(voxel_type, along_zyx(info.pyramid().dims(level)), vec![u64::from(info.shard_edge()); 3]);
    builder.subchunk_shape(vec![u64::from(BRICK_EDGE); 3]).bytes_to_bytes_codecs(vec![Arc::new(ZstdCodec::new(ZSTD_LEVEL, false))]);
    builder.dimension_names(["z", "y", "x"].into());
    // The same bytes for any number of threads.
    let in_order = ShardingCodecOptions::default().with_subchunk_write_order(SubchunkWriteOrder::C);
    builder.codec_specific_options(CodecSpecificOptions::default().with_option(in_order));
    builder.build(storage, &format!("/{level}"))
}

/// The array of what is known of the bricks of a level.
pub fn statistics_array<S: ?Sized>(storage: Arc<S>, info: &Info, level: u8) -> Result<Array<S>, ArrayCreateError> {
    let mut shape = along_zyx(info.pyramid().bricks(level));
    shape.push(STATISTICS as u64);
    let mut shard = vec![u64::from(info.shard_bricks); 3];
    shard.push(STATISTICS as u64);
    let mut builder = ArrayBuilder::new(shape, shard, data_type::float64(), f64::NAN);
    let names: [Option<&str>; 4] = [Some("z"), Some("y"), Some("x"), Some("min, max, entropy, known")];
    builder.dimension_names(names.into());
    builder.build(storage, &format!("/statistics/{level}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_lie_where_their_voxels_have_their_middles() {
        let frame = GridFrame::along_axes([200, 100, 64], DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.5, 1.0, 2.0));
        let attributes = Info::new(&frame, "s", VoxelType::F32, 4).root_attributes();
        let datasets = &attributes["ome"]["multiscales"][0]["datasets"];
        assert_eq!(datasets.as_array().map(Vec::len), Some(3));
        assert_eq!(datasets[0]["coordinateTransformations"][1]["translation"], json!([3.0, 2.0, 1.0]));
        assert_eq!(datasets[2]["coordinateTransformations"][0]["scale"], json!([8.0, 4.0, 2.0]));
        assert_eq!(datasets[2]["coordinateTransformations"][1]["translation"], json!([6.0, 3.5, 1.75]));
        let info: Info = serde_json::from_value(attributes["octetra"].clone()).expect("what was written");
        assert_eq!((info.frame(), info.voxel_type()), (frame, Some(VoxelType::F32)));
    }
}
