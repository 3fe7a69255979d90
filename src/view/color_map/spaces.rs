//! Colour spaces in which colours are interpolated: CIELAB, HSV, and Moreland's Msh for diverging maps.

use std::f64::consts::PI;

/// An sRGB or Lab or HSV or Msh triple.
pub type Triple = [f64; 3];

/// The white of CIE XYZ, D65, as VTK has it.
const WHITE: Triple = [0.9505, 1.0, 1.089];

/// Below this saturation (an angle of Msh) a colour has no hue.
const GREY: f64 = 0.05;

/// Linear interpolation, number by number.
pub fn mix<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
    std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t)
}

/// CIELAB of an sRGB colour in [0, 1].
pub fn lab_from_rgb(rgb: Triple) -> Triple {
    let [r, g, b] = rgb.map(|v| if v > 0.04045 { ((v + 0.055) / 1.055).powf(2.4) } else { v / 12.92 });
    let xyz = [0.4124 * r + 0.3576 * g + 0.1805 * b, 0.2126 * r + 0.7152 * g + 0.0722 * b, 0.0193 * r + 0.1192 * g + 0.9505 * b];
    let cube_root = |v: f64| if v > 0.008856 { v.cbrt() } else { 7.787 * v + 16.0 / 116.0 };
    let [x, y, z]: Triple = std::array::from_fn(|i| cube_root(xyz[i] / WHITE[i]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The sRGB colour of CIELAB, the nearest in [0, 1] channel by channel.
pub fn rgb_from_lab([l, a, b]: Triple) -> Triple {
    let y = (l + 16.0) / 116.0;
    let cube = |v: f64| if v.powi(3) > 0.008856 { v.powi(3) } else { (v - 16.0 / 116.0) / 7.787 };
    let [x, y, z] = [WHITE[0] * cube(a / 500.0 + y), WHITE[1] * cube(y), WHITE[2] * cube(y - b / 200.0)];
    let rgb = [3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z, 0.0557 * x - 0.2040 * y + 1.0570 * z];
    rgb.map(|v| if v > 0.0031308 { 1.055 * v.powf(1.0 / 2.4) - 0.055 } else { 12.92 * v }.clamp(0.0, 1.0))
}

/// Hue, saturation and value in [0, 1].
pub fn hsv_from_rgb([r, g, b]: Triple) -> Triple {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let spread = most - least;
    if spread <= 0.0 {
        return [0.0, 0.0, most];
    }
    let sixths = if most == r {
        (g - b) / spread
    } else if most == g {
        2.0 + (b - r) / spread
    } else {
        4.0 + (r - g) / spread
    };
    [(sixths / 6.0).rem_euclid(1.0), spread / most, most]
}

/// The colour of hue (of any turn), saturation and value.
pub fn rgb_from_hsv([h, s, v]: Triple) -> Triple {
    [5.0, 3.0, 1.0].map(|n: f64| {
        let k = (n + 6.0 * h).rem_euclid(6.0);
        v - v * s * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Between two colours in HSV; `wraps`: the shorter way around the circle of hues.
pub fn mix_hsv(from: Triple, to: Triple, t: f64, wraps: bool) -> Triple {
    let ([mut h0, s0, v0], [mut h1, s1, v1]) = (hsv_from_rgb(from), hsv_from_rgb(to));
    if wraps && (h0 - h1).abs() > 0.5 {
        (h0, h1) = if h0 > h1 { (h0 - 1.0, h1) } else { (h0, h1 - 1.0) };
    }
    rgb_from_hsv(mix([h0, s0, v0], [h1, s1, v1], t))
}

/// Between two colours in CIELAB.
pub fn mix_lab(from: Triple, to: Triple, t: f64) -> Triple {
    rgb_from_lab(mix(lab_from_rgb(from), lab_from_rgb(to), t))
}

/// Between two colours of a diverging map, through white where they are saturated and of different hue (Moreland, *Diverging Color Maps for
/// Scientific Visualization*, 2009).
pub fn mix_diverging(from: Triple, to: Triple, t: f64) -> Triple {
    let (mut one, mut other, mut t) = (msh_from_lab(lab_from_rgb(from)), msh_from_lab(lab_from_rgb(to)), t);
    let is_colored = |msh: Triple| msh[1] > GREY;
    if is_colored(one) && is_colored(other) && angle_between(one[2], other[2]) > 0.33 * PI {
        let white = [one[0].max(other[0]).max(88.0), 0.0, 0.0];
        if t < 0.5 {
            (other, t) = (white, 2.0 * t);
        } else {
            (one, t) = (white, 2.0 * t - 1.0);
        }
    }
    // Where one has no hue it takes the other's, turned so that the colour changes evenly.
    if !is_colored(one) && is_colored(other) {
        one[2] = hue_towards(other, one[0]);
    } else if !is_colored(other) && is_colored(one) {
        other[2] = hue_towards(one, other[0]);
    }
    rgb_from_lab(lab_from_msh(mix(one, other, t)))
}

/// Magnitude, saturation (an angle) and hue of CIELAB.
fn msh_from_lab([l, a, b]: Triple) -> Triple {
    let m = (l * l + a * a + b * b).sqrt();
    let s = if m > 1e-3 { (l / m).clamp(-1.0, 1.0).acos() } else { 0.0 };
    [m, s, if s > 1e-3 { b.atan2(a) } else { 0.0 }]
}

fn lab_from_msh([m, s, h]: Triple) -> Triple {
    [m * s.cos(), m * s.sin() * h.cos(), m * s.sin() * h.sin()]
}

/// The smaller angle between two directions.
fn angle_between(a: f64, b: f64) -> f64 {
    let turn = (a - b).abs().rem_euclid(2.0 * PI);
    turn.min(2.0 * PI - turn)
}

/// The hue of a grey of magnitude `m` beside a colour.
fn hue_towards([colored, s, h]: Triple, m: f64) -> f64 {
    if colored >= m - 0.1 {
        return h;
    }
    let spin = s * (m * m - colored * colored).sqrt() / (colored * s.sin());
    if h > -0.3 * PI { h + spin } else { h - spin }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: Triple, expected: Triple, within: f64) {
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= within), "{found:?}, expected {expected:?}");
    }

    #[test]
    fn spaces_are_left_as_they_were_entered() {
        for k in 0..1000 {
            let rgb = [k % 10, k / 10 % 10, k / 100].map(|v| f64::from(v) / 9.0);
            assert_near(rgb_from_lab(lab_from_rgb(rgb)), rgb, 5e-4);
            assert_near(rgb_from_hsv(hsv_from_rgb(rgb)), rgb, 1e-14);
            assert_near(lab_from_msh(msh_from_lab(lab_from_rgb(rgb))), lab_from_rgb(rgb), 0.02);
        }
    }

    #[test]
    fn known_colours() {
        // Of the CIE's formulas: white, and sRGB's red.
        assert_near(lab_from_rgb([1.0; 3]), [100.0, 0.0, 0.0], 0.02);
        assert_near(lab_from_rgb([1.0, 0.0, 0.0]), [53.24, 80.09, 67.20], 0.05);
        assert_near(hsv_from_rgb([0.0, 0.5, 0.5]), [0.5, 1.0, 0.5], 1e-15);
        assert_near(mix_hsv([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.5, false), [0.0, 1.0, 0.0], 1e-12);
        assert_near(mix_hsv([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.5, true), [1.0, 0.0, 1.0], 1e-12);
        // Moreland's blue to red has a middle of 221, 221, 221.
        let (blue, red) = ([59.0, 76.0, 192.0].map(|v| v / 255.0), [180.0, 4.0, 38.0].map(|v| v / 255.0));
        assert_near(mix_diverging(blue, red, 0.5), [221.0 / 255.0; 3], 1.5 / 255.0);
        // A quarter of the way his table has 141, 176, 254 (8 bits, of 257 rows).
        assert_near(mix_diverging(blue, red, 0.25), [141.0, 176.0, 254.0].map(|v| v / 255.0), 1.5 / 255.0);
    }
}
