//! Samples of a box of positions.

use super::SegyVolume;
use super::error::SegyError;
use super::sample::{SampleFormat, ibm};
use crate::progress::Progress;
use crate::volume::{GridFrame, Samples, Voxel, VoxelSource, VoxelType, box_points};
use rayon::prelude::*;
use std::io;
use std::ops::Range;

/// Bytes that one read takes at most, if they are of several traces.
const BLOCK: u64 = 1 << 20;
/// What lies between the wanted samples of two traces is read along if it is so few bytes: cheaper than to read twice.
const GAP: u64 = 512;
/// Voxels that one task reads, about.
const TASK: usize = 1 << 18;

impl VoxelSource for SegyVolume {
    fn frame(&self) -> &GridFrame {
        &self.frame
    }

    fn name(&self) -> &str {
        "amplitude"
    }

    fn voxel_type(&self) -> VoxelType {
        self.voxel_type
    }

    fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples> {
        self.samples(region, None).map_err(|error| match error {
            SegyError::Io(error) => io::Error::new(error.kind(), format!("{}: {error}", self.path.display())),
            other => io::Error::other(format!("{}: {other}", self.path.display())),
        })
    }
}

impl SegyVolume {
    /// The voxels of a box, see [`VoxelSource::read`].
    pub(super) fn samples(&self, region: &[Range<u32>; 3], progress: Option<&Progress>) -> Result<Samples, SegyError> {
        // `decode` makes a voxel of the bytes of a sample, the most significant one first.
        macro_rules! rows {
            ($missing:expr, $decode:expr) => {{
                let decode = $decode;
                match self.layout.is_little {
                    false => self.rows(region, $missing, decode, progress)?.into(),
                    true => {
                        let reversed = |mut bytes| {
                            reverse(&mut bytes);
                            decode(bytes)
                        };
                        self.rows(region, $missing, reversed, progress)?.into()
                    }
                }
            }};
        }
        let holed = self.survey.missing > 0;
        Ok(match (self.layout.format, holed) {
            (SampleFormat::Ibm, _) => rows!(f32::NAN, |bytes: [u8; 4]| finite(ibm(u32::from_be_bytes(bytes)))),
            (SampleFormat::F32, _) => rows!(f32::NAN, |bytes: [u8; 4]| finite(f32::from_be_bytes(bytes))),
            (SampleFormat::F64, _) => rows!(f64::NAN, |bytes: [u8; 8]| {
                let value = f64::from_be_bytes(bytes);
                if value.is_finite() { value } else { f64::NAN }
            }),
            (SampleFormat::I32, false) => rows!(0, i32::from_be_bytes),
            (SampleFormat::I32, true) => rows!(f64::NAN, |bytes: [u8; 4]| f64::from(i32::from_be_bytes(bytes))),
            (SampleFormat::U32, false) => rows!(0, u32::from_be_bytes),
            (SampleFormat::U32, true) => rows!(f64::NAN, |bytes: [u8; 4]| f64::from(u32::from_be_bytes(bytes))),
            (SampleFormat::I24, false) => rows!(0, i24),
            (SampleFormat::I24, true) => rows!(f32::NAN, |bytes: [u8; 3]| i24(bytes) as f32),
            (SampleFormat::U24, false) => rows!(0, u24),
            (SampleFormat::U24, true) => rows!(f32::NAN, |bytes: [u8; 3]| u24(bytes) as f32),
            (SampleFormat::I16, false) => rows!(0, i16::from_be_bytes),
            (SampleFormat::I16, true) => rows!(f32::NAN, |bytes: [u8; 2]| f32::from(i16::from_be_bytes(bytes))),
            (SampleFormat::U16, false) => rows!(0, u16::from_be_bytes),
            (SampleFormat::U16, true) => rows!(f32::NAN, |bytes: [u8; 2]| f32::from(u16::from_be_bytes(bytes))),
            (SampleFormat::I8, false) => rows!(0, i8::from_be_bytes),
            (SampleFormat::I8, true) => rows!(f32::NAN, |bytes: [u8; 1]| f32::from(i8::from_be_bytes(bytes))),
            (SampleFormat::U8, false) => rows!(0, u8::from_be_bytes),
            (SampleFormat::U8, true) => rows!(f32::NAN, |bytes: [u8; 1]| f32::from(u8::from_be_bytes(bytes))),
        })
    }

    /// The voxels of a box, `N` bytes a sample.
    fn rows<T: Voxel, const N: usize>(
        &self,
        region: &[Range<u32>; 3],
        missing: T,
        decode: impl Fn([u8; N]) -> T + Sync,
        progress: Option<&Progress>,
    ) -> Result<Vec<T>, SegyError> {
        let [width, height, depth] = box_points(region, self.frame.dims)?;
        let mut voxels = Vec::new();
        let count = width * height * depth;
        let memory = |_| SegyError::Memory { need: (count * size_of::<T>()) as u64, what: "the voxels" };
        voxels.try_reserve_exact(count).map_err(memory)?;
        voxels.resize(count, missing);
        if count == 0 {
            return Ok(voxels);
        }
        let (first_row, columns) = (region[2].start as usize, self.frame.dims[1] as usize);
        let trace_of = |row: usize| {
            let (z, y) = (first_row + row / height, region[1].start as usize + row % height);
            self.survey.index[z * columns + y]
        };
        let rows = (TASK / width).clamp(1, height);
        voxels.par_chunks_mut(width * rows).enumerate().try_for_each_init(Vec::new, |block, (task, voxels)| {
            if let Some(progress) = progress {
                progress.check()?;
            }
            let of_task = (voxels.len() / width) as u64;
            self.read_rows(region[0].start, voxels, width, |row| trace_of(task * rows + row), &decode, block)?;
            if let Some(progress) = progress {
                progress.add(of_task);
            }
            Ok::<(), SegyError>(())
        })?;
        Ok(voxels)
    }

    /// Reads rows of `width` voxels from sample `first` of their traces on, rows of neighbouring traces together. Trace numbers count from 1, 0: none.
    fn read_rows<T: Voxel, const N: usize>(
        &self,
        first: u32,
        voxels: &mut [T],
        width: usize,
        trace_of: impl Fn(usize) -> u32,
        decode: impl Fn([u8; N]) -> T,
        block: &mut Vec<u8>,
    ) -> io::Result<()> {
        let (stride, row_bytes) = (self.layout.stride, (width * N) as u64);
        let together = if stride - row_bytes <= GAP { (BLOCK / stride).max(1) as usize } else { 1 };
        let rows = voxels.len() / width;
        let mut row = 0;
        while row < rows {
            let trace = trace_of(row);
            if trace == 0 {
                row += 1;
                continue;
            }
            let follows = |more: &usize| u64::from(trace_of(row + more)) == u64::from(trace) + *more as u64;
            let count = 1 + (1..together.min(rows - row)).take_while(follows).count();
            block.resize(((count as u64 - 1) * stride + row_bytes) as usize, 0);
            let at = self.layout.first + u64::from(trace - 1) * stride + self.layout.trace_headers + u64::from(first) * N as u64;
            self.input.read_at(at, block)?;
            let samples = block.chunks(stride as usize).map(|bytes| bytes[..width * N].as_chunks::<N>().0);
            for (voxels, samples) in voxels[row * width..].chunks_mut(width).zip(samples) {
                voxels.iter_mut().zip(samples).for_each(|(voxel, bytes)| *voxel = decode(*bytes));
            }
            row += count;
        }
        Ok(())
    }
}

fn reverse<const N: usize>(bytes: &mut [u8; N]) {
    bytes.reverse();
}

fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { f32::NAN }
}

fn u24([a, b, c]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, a, b, c])
}

fn i24([a, b, c]: [u8; 3]) -> i32 {
    i32::from_be_bytes([a, b, c, 0]) >> 8
}
