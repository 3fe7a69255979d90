//! The numbers of a trace: their formats by code, and IBM's floats.

use crate::volume::VoxelType;

/// A sample format by its code in bytes 3225-3226.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SampleFormat {
    Ibm,
    I32,
    I16,
    F32,
    F64,
    I24,
    I8,
    U32,
    U16,
    U24,
    U8,
}

/// The codes that the standard names, what they stand for, and what octetra makes of them.
const CODES: [(u16, &str, Option<SampleFormat>); 14] = [
    (1, "IBM floats of 4 bytes", Some(SampleFormat::Ibm)),
    (2, "integers of 4 bytes", Some(SampleFormat::I32)),
    (3, "integers of 2 bytes", Some(SampleFormat::I16)),
    (4, "fixed-point numbers with gain", None),
    (5, "IEEE floats of 4 bytes", Some(SampleFormat::F32)),
    (6, "IEEE floats of 8 bytes", Some(SampleFormat::F64)),
    (7, "integers of 3 bytes", Some(SampleFormat::I24)),
    (8, "integers of 1 byte", Some(SampleFormat::I8)),
    (9, "integers of 8 bytes", None),
    (10, "unsigned integers of 4 bytes", Some(SampleFormat::U32)),
    (11, "unsigned integers of 2 bytes", Some(SampleFormat::U16)),
    (12, "unsigned integers of 8 bytes", None),
    (15, "unsigned integers of 3 bytes", Some(SampleFormat::U24)),
    (16, "unsigned integers of 1 byte", Some(SampleFormat::U8)),
];

/// What a format code stands for, and the format if octetra reads it; `None` for codes that the standard has not.
pub(super) fn by_code(code: u16) -> Option<(&'static str, Option<SampleFormat>)> {
    CODES.iter().find(|entry| entry.0 == code).map(|&(_, name, format)| (name, format))
}

impl SampleFormat {
    /// Bytes of a sample.
    pub fn bytes(self) -> u32 {
        match self {
            SampleFormat::I8 | SampleFormat::U8 => 1,
            SampleFormat::I16 | SampleFormat::U16 => 2,
            SampleFormat::I24 | SampleFormat::U24 => 3,
            SampleFormat::Ibm | SampleFormat::I32 | SampleFormat::F32 | SampleFormat::U32 => 4,
            SampleFormat::F64 => 8,
        }
    }

    /// What it is, as the standard says it.
    pub fn name(self) -> &'static str {
        CODES.iter().find(|entry| entry.2 == Some(self)).map_or("", |entry| entry.1)
    }

    /// The type of the voxels: the smallest that holds every sample, and NaN too where some voxels are missing.
    pub fn voxel_type(self, some_missing: bool) -> VoxelType {
        match (self, some_missing) {
            (SampleFormat::Ibm | SampleFormat::F32, _) => VoxelType::F32,
            (SampleFormat::F64, _) | (SampleFormat::I32 | SampleFormat::U32, true) => VoxelType::F64,
            (_, true) => VoxelType::F32,
            (SampleFormat::I32 | SampleFormat::I24, false) => VoxelType::I32,
            (SampleFormat::U32 | SampleFormat::U24, false) => VoxelType::U32,
            (SampleFormat::I16, false) => VoxelType::I16,
            (SampleFormat::U16, false) => VoxelType::U16,
            (SampleFormat::I8, false) => VoxelType::I8,
            (SampleFormat::U8, false) => VoxelType::U8,
        }
    }
}

/// The value of an IBM float: sign, exponent of 16 above 64, and 24 bits of fraction. Its at most 24 bits fit an f32; what is beyond the range of
/// one becomes infinite, and what is below it is rounded to the nearest f32.
#[inline]
pub(super) fn ibm(bits: u32) -> f32 {
    let exponent = u64::from(bits >> 24 & 0x7f);
    // 16^(exponent - 64) 2^-24, always a normal f64.
    let scale = f64::from_bits((4 * exponent + 1023 - 256 - 24) << 52);
    let value = f64::from(bits & 0x00ff_ffff) * scale;
    (if bits >> 31 == 1 { -value } else { value }) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ibm_floats_have_their_values() {
        // From the definition and from IBM's own examples.
        let known = [
            (0, 0.0),
            (0xc276a000, -118.625),
            (0x41100000, 1.0),
            (0x40800000, 0.5),
            (0x42640000, 100.0),
            (0x41133333, 1.199_999_8),
            (0x00ffffff, 0.0),
            (0x7fffffff, f32::INFINITY),
            (0xffffffff, f32::NEG_INFINITY),
            (0x60ffffff, f32::MAX),
            (0x61100000, f32::INFINITY),
            (0x21100000, 2f32.powi(-128)),
            (0x1b800000, 2f32.powi(-149)),
            (0x46000001, 1.0),
        ];
        for (bits, value) in known {
            assert_eq!(ibm(bits), value, "{bits:08x}");
        }
        assert!(ibm(0x80000000).is_sign_negative() && ibm(0x80000000) == 0.0);
    }

    #[test]
    fn every_fraction_is_exact() {
        for (exponent, fraction) in (0x30..0x58u32).flat_map(|e| (0..24).map(move |bit| (e, 0x00ff_ffff >> bit))) {
            let exact = f64::from(fraction) * 16f64.powi(exponent as i32 - 64) / f64::from(1 << 24);
            assert_eq!(f64::from(ibm(exponent << 24 | fraction)), exact, "{exponent:x} {fraction:x}");
        }
    }

    #[test]
    fn codes_have_names_and_types() {
        assert_eq!(by_code(4), Some(("fixed-point numbers with gain", None)));
        assert!([0, 13, 14, 17, 256].into_iter().all(|code| by_code(code).is_none()));
        for (_, name, format) in CODES {
            let Some(format) = format else { continue };
            let (whole, holed) = (format.voxel_type(false), format.voxel_type(true));
            assert_eq!(format.name(), name);
            assert!(holed.is_float() && whole.bytes() >= format.bytes() as usize, "{name}");
            assert_eq!(whole.is_float(), name.contains("floats"), "{name}");
            assert!(format.bytes() < 4 || whole.is_float() || holed == VoxelType::F64, "{name}");
        }
    }
}
