//! The numbers of a volume in the type that the file has them in.

use super::Numbers;
use bytemuck::Pod;

/// A type that the voxels of a volume may have.
pub trait Voxel: Pod + Default + PartialOrd + Send + Sync {
    /// The number, without loss.
    fn to_f64(self) -> f64;
}

/// Voxels of one type, x fastest, then y, then z.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Unsigned 8-bit integers.
    U8(Numbers<u8>),
    /// Signed 8-bit integers.
    I8(Numbers<i8>),
    /// Unsigned 16-bit integers.
    U16(Numbers<u16>),
    /// Signed 16-bit integers.
    I16(Numbers<i16>),
    /// Unsigned 32-bit integers.
    U32(Numbers<u32>),
    /// Signed 32-bit integers.
    I32(Numbers<i32>),
    /// 32-bit floats.
    F32(Numbers<f32>),
    /// 64-bit floats; 64-bit integers are kept so too.
    F64(Numbers<f64>),
}

/// Evaluates an expression for the vector of a [`Samples`], whatever its type is.
macro_rules! with_voxels {
    ($samples:expr, $voxels:ident => $result:expr) => {
        match $samples {
            $crate::volume::Samples::U8($voxels) => $result,
            $crate::volume::Samples::I8($voxels) => $result,
            $crate::volume::Samples::U16($voxels) => $result,
            $crate::volume::Samples::I16($voxels) => $result,
            $crate::volume::Samples::U32($voxels) => $result,
            $crate::volume::Samples::I32($voxels) => $result,
            $crate::volume::Samples::F32($voxels) => $result,
            $crate::volume::Samples::F64($voxels) => $result,
        }
    };
}
pub(crate) use with_voxels;

macro_rules! voxel {
    ($($t:ty)*) => { $(
        impl Voxel for $t {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.into()
            }
        }
    )* };
}
voxel! { u8 i8 u16 i16 u32 i32 f32 f64 }

impl Samples {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        with_voxels!(self, voxels => voxels.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `i`.
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        with_voxels!(self, voxels => voxels[i].to_f64())
    }

    /// Visits every `step`-th number of a range, from its first on.
    #[inline]
    pub fn each(&self, range: std::ops::Range<usize>, step: usize, mut visit: impl FnMut(f64)) {
        with_voxels!(self, voxels => voxels[range].iter().step_by(step).for_each(|voxel| visit(voxel.to_f64())));
    }

    /// Bytes that the numbers take, in memory or in a mapped file.
    pub fn bytes(&self) -> usize {
        with_voxels!(self, voxels => size_of_val(&voxels[..]))
    }

    /// Whether the numbers lie in a mapped file, and take memory only as long as the system has no other use for it.
    pub fn is_mapped(&self) -> bool {
        with_voxels!(self, voxels => voxels.is_mapped())
    }

    /// What the type is called in Rust, `--type` and everywhere else in octetra: `u8`, `f32` and so on.
    pub fn type_name(&self) -> &'static str {
        match self {
            Samples::U8(_) => "u8",
            Samples::I8(_) => "i8",
            Samples::U16(_) => "u16",
            Samples::I16(_) => "i16",
            Samples::U32(_) => "u32",
            Samples::I32(_) => "i32",
            Samples::F32(_) => "f32",
            Samples::F64(_) => "f64",
        }
    }

    /// Takes component `index` of vectors. `inner` numbers lie between one component of a vector and its next: 1 where they are side by
    /// side, the number of vectors where they lie one behind the other; `components` is how many a vector has.
    pub(super) fn component(self, inner: usize, components: usize, index: usize) -> Samples {
        fn take<T: Copy>(all: &[T], inner: usize, components: usize, index: usize) -> Vec<T> {
            all.chunks_exact(inner * components).flat_map(|chunk| &chunk[inner * index..][..inner]).copied().collect()
        }
        match self {
            Samples::U8(all) => Samples::U8(take(&all, inner, components, index).into()),
            Samples::I8(all) => Samples::I8(take(&all, inner, components, index).into()),
            Samples::U16(all) => Samples::U16(take(&all, inner, components, index).into()),
            Samples::I16(all) => Samples::I16(take(&all, inner, components, index).into()),
            Samples::U32(all) => Samples::U32(take(&all, inner, components, index).into()),
            Samples::I32(all) => Samples::I32(take(&all, inner, components, index).into()),
            Samples::F32(all) => Samples::F32(take(&all, inner, components, index).into()),
            Samples::F64(all) => Samples::F64(take(&all, inner, components, index).into()),
        }
    }

    /// The lengths of vectors, as f32; layout as in [`Samples::component`].
    pub(super) fn magnitude(&self, inner: usize, components: usize) -> Samples {
        fn lengths<T: Voxel>(all: &[T], inner: usize, components: usize) -> Vec<f32> {
            let length = |chunk: &[T], i: usize| (0..components).fold(0f64, |length, c| length.hypot(chunk[i + inner * c].to_f64())) as f32;
            all.chunks_exact(inner * components).flat_map(|chunk| (0..inner).map(move |i| length(chunk, i))).collect()
        }
        Samples::F32(with_voxels!(self, all => lengths(all, inner, components)).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_side_by_side_and_one_behind_the_other() {
        let interleaved = Samples::I16(vec![3, 4, 0, -5, 6, 8].into());
        assert_eq!(interleaved.clone().component(1, 2, 1), Samples::I16(vec![4, -5, 8].into()));
        assert_eq!(interleaved.magnitude(1, 2), Samples::F32(vec![5.0, 5.0, 10.0].into()));
        let planar = Samples::U8(vec![3, 0, 6, 4, 5, 8].into());
        assert_eq!(planar.clone().component(3, 2, 1), Samples::U8(vec![4, 5, 8].into()));
        assert_eq!(planar.magnitude(3, 2), Samples::F32(vec![5.0, 5.0, 10.0].into()));
    }
}
