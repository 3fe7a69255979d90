//! Vectors, extremes, roots and angles without branches.

/// A vector.
pub type Vector = [f64; 3];

#[inline(always)]
pub fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub fn negative(a: Vector) -> Vector {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
pub fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

#[inline(always)]
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The larger; `b` if one is NaN.
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller; `b` if one is NaN.
#[inline(always)]
pub fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
pub fn largest<const N: usize>(values: [f64; N]) -> f64 {
    let mut found = values[0];
    let mut i = 1;
    while i < N {
        found = larger(values[i], found);
        i += 1;
    }
    found
}

#[inline(always)]
pub fn smallest<const N: usize>(values: [f64; N]) -> f64 {
    let mut found = values[0];
    let mut i = 1;
    while i < N {
        found = smaller(values[i], found);
        i += 1;
    }
    found
}

/// The cube root of a number that is not negative, to a few units in the last place; 0 below 1e-300.
#[inline(always)]
pub fn cube_root(x: f64) -> f64 {
    // A third of the exponent's and mantissa's high bits, right to 3 %; each step cubes the error.
    let high = ((x.to_bits() >> 32) * 0x5555_5556) >> 32;
    let mut root = f64::from_bits((high + 715_094_163) << 32);
    let mut step = 0;
    while step < 3 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
        step += 1;
    }
    if x > 1e-300 { root } else { 0.0 }
}

/// The angle in [0, pi] whose sine and cosine, with any common factor, these are, to a few units in the last place; NaN of 0 and 0. The
/// standard library's has branches. The polynomial is that of FDLIBM's `atan` (Sun Microsystems 1993, free to use), good to 0.4375.
#[inline(always)]
pub fn angle(sine: f64, cosine: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let size = cosine.abs();
    let is_steep = sine > size;
    let (low, high) = if is_steep { (size, sine) } else { (sine, size) };
    // tan(x - pi/4) = (tan x - 1) / (tan x + 1) above tan(pi/8).
    let is_turned = low > 0.414_213_562_373_095 * high;
    let over = if is_turned { low - high } else { low };
    let under = if is_turned { low + high } else { high };
    let x = over / under;
    let z = x * x;
    let w = z * z;
    let odd = 0.090_908_871_334_365_07 + w * (0.066_610_731_373_875_31 + w * (0.049_768_779_946_159_324 + w * 0.016_285_820_115_365_782));
    let odd = z * (0.333_333_333_333_329_3 + w * (0.142_857_142_725_034_66 + w * odd));
    let even = -0.076_918_762_050_448_3 + w * (-0.058_335_701_337_905_735 + w * -0.036_531_572_744_216_916);
    let even = w * (-0.199_999_999_998_764_83 + w * (-0.111_111_104_054_623_56 + w * even));
    let angle = x - x * (odd + even) + if is_turned { FRAC_PI_4 } else { 0.0 };
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    if cosine < 0.0 { PI - angle } else { angle }
}

/// Sine and cosine of the smallest and of the largest of some angles.
#[derive(Clone, Copy)]
pub struct Extremes {
    /// Of the smallest angle, which has the largest cosine.
    pub most: [f64; 2],
    /// Of the largest angle, which has the least cosine.
    pub least: [f64; 2],
}

impl Extremes {
    /// Of no angle yet.
    pub const NONE: Extremes = Extremes { most: [0.0, -2.0], least: [0.0, 2.0] };

    /// Those of one angle more.
    #[inline(always)]
    pub fn with(self, sine: f64, cosine: f64) -> Self {
        let (is_most, is_least) = (cosine > self.most[1], cosine < self.least[1]);
        Extremes {
            most: [if is_most { sine } else { self.most[0] }, if is_most { cosine } else { self.most[1] }],
            least: [if is_least { sine } else { self.least[0] }, if is_least { cosine } else { self.least[1] }],
        }
    }
}
