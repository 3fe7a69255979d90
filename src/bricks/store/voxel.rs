//! The types of voxels as Zarr has them, and their means.

use crate::volume::{Samples, Voxel, VoxelType};
use zarrs::array::{ArrayBuilder, Element, ElementOwned, data_type};

/// A type that the voxels of a store may have.
pub trait StoredVoxel: Voxel + Element + ElementOwned {
    /// What stands for a voxel that is not stored: NaN or 0.
    const FILL: Self;
    /// The mean of those that are known, rounded to the nearest where the type has no fractions; [`StoredVoxel::FILL`] where none is.
    fn mean(voxels: impl Iterator<Item = Self>) -> Self;
    /// The numbers of samples of this type; `None` for another.
    fn take(samples: Samples) -> Option<Vec<Self>>;
    /// Samples of these numbers.
    fn samples(numbers: Vec<Self>) -> Samples;
}

macro_rules! stored {
    ($($t:ty, $variant:ident, $fill:expr, $round:expr;)*) => { $(
        impl StoredVoxel for $t {
            const FILL: Self = $fill;

            #[inline]
            fn mean(voxels: impl Iterator<Item = Self>) -> Self {
                let (mut sum, mut count) = (0f64, 0f64);
                for voxel in voxels {
                    let value = voxel.to_f64();
                    let known = !value.is_nan();
                    sum += if known { value } else { 0.0 };
                    count += f64::from(u8::from(known));
                }
                #[allow(clippy::redundant_closure_call)]
                if count > 0.0 { $round(sum / count) as $t } else { Self::FILL }
            }

            fn take(samples: Samples) -> Option<Vec<Self>> {
                match samples {
                    Samples::$variant(numbers) => Some(numbers.into_vec()),
                    _ => None,
                }
            }

            fn samples(numbers: Vec<Self>) -> Samples {
                Samples::$variant(numbers.into())
            }
        }
    )* };
}
stored! {
    u8, U8, 0, f64::round;
    i8, I8, 0, f64::round;
    u16, U16, 0, f64::round;
    i16, I16, 0, f64::round;
    u32, U32, 0, f64::round;
    i32, I32, 0, f64::round;
    f32, F32, f32::NAN, std::convert::identity;
    f64, F64, f64::NAN, std::convert::identity;
}

/// Starts an array of this type: `shape` and `shard` along z, y, x.
pub fn array_of(voxel_type: VoxelType, shape: Vec<u64>, shard: Vec<u64>) -> ArrayBuilder {
    match voxel_type {
        VoxelType::U8 => ArrayBuilder::new(shape, shard, data_type::uint8(), u8::FILL),
        VoxelType::I8 => ArrayBuilder::new(shape, shard, data_type::int8(), i8::FILL),
        VoxelType::U16 => ArrayBuilder::new(shape, shard, data_type::uint16(), u16::FILL),
        VoxelType::I16 => ArrayBuilder::new(shape, shard, data_type::int16(), i16::FILL),
        VoxelType::U32 => ArrayBuilder::new(shape, shard, data_type::uint32(), u32::FILL),
        VoxelType::I32 => ArrayBuilder::new(shape, shard, data_type::int32(), i32::FILL),
        VoxelType::F32 => ArrayBuilder::new(shape, shard, data_type::float32(), f32::FILL),
        VoxelType::F64 => ArrayBuilder::new(shape, shard, data_type::float64(), f64::FILL),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_what_is_known() {
        assert_eq!(u8::mean([1, 2, 2, 2].into_iter()), 2);
        assert_eq!(i16::mean([-1, -2, -2, -2].into_iter()), -2);
        assert_eq!(u32::mean([u32::MAX; 8].into_iter()), u32::MAX);
        assert_eq!(f32::mean([1.0, f32::NAN, 2.0].into_iter()), 1.5);
        assert!(f64::mean([f64::NAN; 8].into_iter()).is_nan());
    }
}
