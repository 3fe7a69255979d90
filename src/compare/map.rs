//! A picture of where two images differ.

use super::ImageComparison;
use rayon::prelude::*;

/// What a difference map shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DifferenceMap {
    /// FLIP's error in the magma colours that NVIDIA's tool uses: black is 0, pale yellow 1.
    Flip,
    /// The absolute difference of each channel of the 8-bit pictures, times this gain, cut off at white.
    Absolute(f64),
}

/// RGB bytes of the map, row by row from the top.
pub fn difference_map(comparison: &ImageComparison, map: DifferenceMap) -> Vec<u8> {
    match map {
        DifferenceMap::Flip => {
            let magma = flip_rs::MAGMA.map(|rgb| rgb.map(|v| (v * 255.0).round() as u8));
            comparison.flip_errors.par_iter().flat_map_iter(|e| magma[(e.clamp(0.0, 1.0) * 255.0).round() as usize]).collect()
        }
        DifferenceMap::Absolute(gain) => {
            let amplified = |(a, b): (&u8, &u8)| (f64::from(a.abs_diff(*b)) * gain).round() as u8;
            comparison.reference_rgb.par_iter().zip(&comparison.image_rgb).map(amplified).collect()
        }
    }
}
