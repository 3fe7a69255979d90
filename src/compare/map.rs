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
            comparison.flip_errors.par_iter().flat_map_iter(|e| magma((e.clamp(0.0, 1.0) * 255.0).round() as usize)).collect()
        }
        DifferenceMap::Absolute(gain) => {
            let amplified = |(a, b): (&u8, &u8)| (f64::from(a.abs_diff(*b)) * gain).round() as u8;
            comparison.reference_rgb.par_iter().zip(&comparison.image_rgb).map(amplified).collect()
        }
    }
}

/// Colour 0 to 255 of matplotlib's magma (CC0), RGB.
fn magma(level: usize) -> [u8; 3] {
    let digit = |i: usize| char::from(MAGMA.as_bytes()[6 * level + i]).to_digit(16).expect("hexadecimal") as u8;
    [0, 2, 4].map(|i| 16 * digit(i) + digit(i + 1))
}

/// Six hexadecimal digits a colour.
const MAGMA: &str = "\
    00000401000501010601010802010902020b02020d03030f03031204041405041606051806051a07061c08071e0907200a08220b09240c09260d0a290e0b2b10\
    0b2d110c2f120d31130d34140e36150e38160f3b180f3d19103f1a10421c10441d11471e114920114b21114e22115024125325125527125829115a2a115c2c11\
    5f2d11612f116331116533106734106936106b38106c390f6e3b0f703d0f713f0f72400f74420f75440f764510774710784910784a10794c117a4e117b4f127b\
    51127c52137c54137d56147d57157e59157e5a167e5c167f5d177f5f187f601880621980641a80651a80671b80681c816a1c816b1d816d1d816e1e81701f8172\
    1f817320817521817621817822817922827b23827c23827e24828025828125818326818426818627818827818928818b29818c29818e2a81902a81912b81932b\
    80942c80962c80982d80992d809b2e7f9c2e7f9e2f7fa02f7fa1307ea3307ea5317ea6317da8327daa337dab337cad347cae347bb0357bb2357bb3367ab5367a\
    b73779b83779ba3878bc3978bd3977bf3a77c03a76c23b75c43c75c53c74c73d73c83e73ca3e72cc3f71cd4071cf4070d0416fd2426fd3436ed5446dd6456cd8\
    456cd9466bdb476adc4869de4968df4a68e04c67e24d66e34e65e44f64e55064e75263e85362e95462ea5661eb5760ec5860ed5a5fee5b5eef5d5ef05f5ef160\
    5df2625df2645cf3655cf4675cf4695cf56b5cf66c5cf66e5cf7705cf7725cf8745cf8765cf9785df9795df97b5dfa7d5efa7f5efa815ffb835ffb8560fb8761\
    fc8961fc8a62fc8c63fc8e64fc9065fd9266fd9467fd9668fd9869fd9a6afd9b6bfe9d6cfe9f6dfea16efea36ffea571fea772fea973feaa74feac76feae77fe\
    b078feb27afeb47bfeb67cfeb77efeb97ffebb81febd82febf84fec185fec287fec488fec68afec88cfeca8dfecc8ffecd90fecf92fed194fed395fed597fed7\
    99fed89afdda9cfddc9efddea0fde0a1fde2a3fde3a5fde5a7fde7a9fde9aafdebacfcecaefceeb0fcf0b2fcf2b4fcf4b6fcf6b8fcf7b9fcf9bbfcfbbdfcfdbf";
