//! [`VoxelSource`]: a volume that is read box by box, however large it is.

use super::{Grid, GridFrame, Samples, with_voxels};
use std::io;
use std::ops::Range;

/// The types that voxels have: those of [`Samples`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VoxelType {
    /// Unsigned 8-bit integers.
    U8,
    /// Signed 8-bit integers.
    I8,
    /// Unsigned 16-bit integers.
    U16,
    /// Signed 16-bit integers.
    I16,
    /// Unsigned 32-bit integers.
    U32,
    /// Signed 32-bit integers.
    I32,
    /// 32-bit floats.
    F32,
    /// 64-bit floats.
    F64,
}

impl VoxelType {
    /// All of them.
    pub const ALL: [VoxelType; 8] =
        [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16, VoxelType::U32, VoxelType::I32, VoxelType::F32, VoxelType::F64];

    /// The type of these numbers.
    pub fn of(samples: &Samples) -> Self {
        match samples {
            Samples::U8(_) => VoxelType::U8,
            Samples::I8(_) => VoxelType::I8,
            Samples::U16(_) => VoxelType::U16,
            Samples::I16(_) => VoxelType::I16,
            Samples::U32(_) => VoxelType::U32,
            Samples::I32(_) => VoxelType::I32,
            Samples::F32(_) => VoxelType::F32,
            Samples::F64(_) => VoxelType::F64,
        }
    }

    /// Bytes of one number.
    pub fn bytes(self) -> usize {
        match self {
            VoxelType::U8 | VoxelType::I8 => 1,
            VoxelType::U16 | VoxelType::I16 => 2,
            VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => 4,
            VoxelType::F64 => 8,
        }
    }

    /// What it is called everywhere in octetra: see [`Samples::type_name`].
    pub fn name(self) -> &'static str {
        match self {
            VoxelType::U8 => "u8",
            VoxelType::I8 => "i8",
            VoxelType::U16 => "u16",
            VoxelType::I16 => "i16",
            VoxelType::U32 => "u32",
            VoxelType::I32 => "i32",
            VoxelType::F32 => "f32",
            VoxelType::F64 => "f64",
        }
    }

    /// Whether a number may be NaN, which means missing.
    pub fn is_float(self) -> bool {
        matches!(self, VoxelType::F32 | VoxelType::F64)
    }
}

/// A volume that is read box by box. All methods may be called from several threads.
pub trait VoxelSource: Send + Sync {
    /// Where the points lie, and how many there are.
    fn frame(&self) -> &GridFrame;
    /// What the numbers are called.
    fn name(&self) -> &str;
    /// The type of the numbers.
    fn voxel_type(&self) -> VoxelType;
    /// The numbers of a box of points, x fastest, then y, then z, of type [`VoxelSource::voxel_type`]; NaN means missing. A box that does not
    /// lie within the volume is an error of kind [`io::ErrorKind::InvalidInput`].
    fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples>;
}

/// Points of a box along each axis; an error where it does not lie within a volume of `dims` points, or cannot lie in memory.
pub fn box_points(region: &[Range<u32>; 3], dims: [u32; 3]) -> io::Result<[usize; 3]> {
    let invalid = |what: &str| {
        let message = format!("points {region:?} of a volume of {} x {} x {}: {what}", dims[0], dims[1], dims[2]);
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    };
    if region.iter().zip(dims).any(|(range, n)| range.start > range.end || range.end > n) {
        return invalid("expected a box within it");
    }
    let points = [0, 1, 2].map(|axis| region[axis].len());
    match points.iter().try_fold(8usize, |bytes, &n| bytes.checked_mul(n)) {
        Some(bytes) if bytes <= isize::MAX as usize => Ok(points),
        _ => invalid("more than can lie in memory"),
    }
}

impl VoxelSource for Grid {
    fn frame(&self) -> &GridFrame {
        self.frame()
    }

    fn name(&self) -> &str {
        self.name()
    }

    fn voxel_type(&self) -> VoxelType {
        VoxelType::of(self.samples())
    }

    fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples> {
        let dims = self.frame().dims;
        let [width, height, depth] = box_points(region, dims)?;
        let (nx, ny) = (dims[0] as usize, dims[1] as usize);
        let start = |y: usize, z: usize| {
            let [i, j, k] = [0, 1, 2].map(|axis| region[axis].start as usize);
            i + nx * (j + y + ny * (k + z))
        };
        Ok(with_voxels!(self.samples(), voxels => {
            let mut values = Vec::new();
            values.try_reserve_exact(width * height * depth)?;
            for (y, z) in (0..depth).flat_map(|z| (0..height).map(move |y| (y, z))) {
                values.extend_from_slice(&voxels[start(y, z)..][..width]);
            }
            Samples::from(values)
        }))
    }
}

macro_rules! from_vector {
    ($($t:ty => $samples:ident),*) => { $(
        impl From<Vec<$t>> for Samples {
            fn from(numbers: Vec<$t>) -> Self {
                Samples::$samples(numbers.into())
            }
        }
    )* };
}
from_vector! { u8 => U8, i8 => I8, u16 => U16, i16 => I16, u32 => U32, i32 => I32, f32 => F32, f64 => F64 }

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn grid(samples: Samples) -> Grid {
        Grid::new(GridFrame::along_axes([4, 3, 2], DVec3::ZERO, DVec3::ONE), "s".into(), samples).expect("valid")
    }

    #[test]
    fn a_box_of_a_grid_has_the_numbers_of_its_points() {
        let grid = grid(Samples::I16((0..24).collect()));
        assert_eq!((VoxelSource::name(&grid), grid.voxel_type()), ("s", VoxelType::I16));
        assert_eq!(grid.read(&[1..3, 1..3, 0..2]).expect("inside"), Samples::I16(vec![5, 6, 9, 10, 17, 18, 21, 22].into()));
        assert_eq!(grid.read(&[0..4, 0..3, 0..2]).expect("all of it"), *grid.samples());
        assert_eq!(grid.read(&[2..2, 0..3, 0..2]).expect("nothing"), Samples::I16(vec![].into()));
        for beyond in [[0..5, 0..3, 0..2], [0..4, 3..4, 0..2], [0..4, 0..3, u32::MAX..u32::MAX], [Range { start: 3, end: 2 }, 0..3, 0..2]] {
            assert_eq!(grid.read(&beyond).map_err(|e| e.kind()), Err(io::ErrorKind::InvalidInput), "{beyond:?}");
        }
        assert!(box_points(&[0..u32::MAX, 0..u32::MAX, 0..u32::MAX], [u32::MAX; 3]).is_err());
    }

    #[test]
    fn a_voxel_type_is_that_of_the_samples_it_is_of() {
        let of_each = [
            Samples::from(vec![1u8; 24]),
            vec![1i8; 24].into(),
            vec![1u16; 24].into(),
            vec![1i16; 24].into(),
            vec![1u32; 24].into(),
            vec![1i32; 24].into(),
            vec![1f32; 24].into(),
            vec![1f64; 24].into(),
        ];
        for (samples, expected) in of_each.into_iter().zip(VoxelType::ALL) {
            assert_eq!((VoxelType::of(&samples), expected.name()), (expected, samples.type_name()));
            assert_eq!((expected.bytes() * 24, expected.is_float()), (samples.bytes(), samples.type_name().starts_with('f')));
            assert_eq!(grid(samples.clone()).read(&[0..4, 0..3, 0..2]).expect("all of it"), samples);
        }
    }
}
