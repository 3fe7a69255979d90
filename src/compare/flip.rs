//! FLIP: the difference that a viewer sees who flips between two pictures (Andersson et al. 2020, PACMCGIT 3(2), "FLIP: A Difference
//! Evaluator for Alternating Images"; the LDR metric, with the constants of NVIDIA's version 1.7).
//!
//! A pixel's error comes from its neighbourhood alone, so bands of rows are evaluated on their own, cut down to where the pictures differ:
//! memory stays small, and an equal background costs nothing.

use super::filter::{TILE, along, down, padded};
use rayon::prelude::*;
use std::array;

/// NVIDIA's default viewing distance: 0.7 m from a screen 0.7 m wide with 3840 pixels.
pub const DEFAULT_PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Rows that one task evaluates.
const BAND: usize = 128;

/// FLIP over a whole picture, 0 (equal) to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipFigures {
    /// Mean over all pixels: the number that is usually meant by FLIP.
    pub mean: f64,
    /// Mean over the covered pixels; `None` if there are none.
    pub covered_mean: Option<f64>,
    /// 99 % of all pixels are not above this one's.
    pub p99: f64,
    /// The worst pixel's.
    pub max: f64,
    /// Pixels per degree of visual angle that the filters were made for.
    pub pixels_per_degree: f32,
}

impl FlipFigures {
    /// Pools a map of errors.
    pub(super) fn of(errors: &[f32], covered: &[bool], pixels_per_degree: f32) -> Self {
        let mean = |sum: f64, count: usize| sum / count as f64;
        let covered_count = covered.iter().filter(|&&c| c).count();
        let covered_sum: f64 = errors.iter().zip(covered).filter(|(_, c)| **c).map(|(e, _)| f64::from(*e)).sum();
        let mut ranked = errors.to_vec();
        let rank = (errors.len() as f64 * 0.99).ceil() as usize;
        let (_, p99, above) = ranked.select_nth_unstable_by(rank.clamp(1, errors.len()) - 1, f32::total_cmp);
        let (p99, max) = (*p99, above.iter().copied().fold(*p99, f32::max));
        FlipFigures {
            mean: mean(errors.iter().map(|&e| f64::from(e)).sum(), errors.len()),
            covered_mean: (covered_count > 0).then(|| mean(covered_sum, covered_count)),
            p99: f64::from(p99),
            max: f64::from(max),
            pixels_per_degree,
        }
    }
}

/// The error of each pixel, 0 to 1. Both pictures are RGB bytes as a screen shows them (sRGB), `size` is width and height.
pub(super) fn errors(reference: &[u8], image: &[u8], size: [usize; 2], pixels_per_degree: f32) -> Vec<f32> {
    let filters = Filters::new(f64::from(pixels_per_degree));
    let linear = linear_from_srgb();
    let mut errors = vec![0.0; size[0] * size[1]];
    errors.par_chunks_mut(BAND * size[0]).enumerate().for_each(|(i, band)| {
        let rows = [i * BAND, i * BAND + band.len() / size[0]];
        if let Some(seen) = differing(reference, image, size, grown(rows, filters.reach, size[1])) {
            let columns = grown(seen, filters.reach, size[0]);
            pulp::Arch::new().dispatch(Band {
                pictures: [reference, image],
                size,
                rows,
                columns,
                filters: &filters,
                linear: &linear,
                band,
            });
        }
    });
    errors
}

/// `[from, to)` grown by `by` on both sides, within `[0, limit)`.
fn grown([from, to]: [usize; 2], by: usize, limit: usize) -> [usize; 2] {
    [from.saturating_sub(by), limit.min(to + by)]
}

/// The columns, among these rows, between which the pictures differ; `None` if they do not.
fn differing(reference: &[u8], image: &[u8], size: [usize; 2], rows: [usize; 2]) -> Option<[usize; 2]> {
    let (mut from, mut to) = (size[0], 0);
    for row in rows[0]..rows[1] {
        let bytes = row * size[0] * 3..(row + 1) * size[0] * 3;
        let (a, b) = (&reference[bytes.clone()], &image[bytes]);
        if a != b {
            let differ = |&i: &usize| a[3 * i..3 * i + 3] != b[3 * i..3 * i + 3];
            from = (0..from).find(differ).unwrap_or(from);
            to = (to..size[0]).rev().find(differ).map_or(to, |last| last + 1);
        }
    }
    (from < to).then_some([from, to])
}

/// Gaussians of the contrast-sensitivity functions, per axis: one for Y, one for Cx, two for Cz.
const SENSITIVITIES: usize = 4;

/// One-dimensional filters, each `2 * reach + 1` long; their products are the paper's.
struct Filters {
    /// Pixels from the centre to the end.
    reach: usize,
    /// Contrast sensitivity, of which plane 0, 1, 2, 2 of Y, Cx, Cz is filtered.
    sensitivity: [Vec<f32>; SENSITIVITIES],
    /// The feature detectors' Gaussian and its first and second derivatives.
    gaussian: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Self {
        use std::f64::consts::PI;
        let sensitivity_radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil();
        // Section 4.2: the detectors' width is w = 0.082 degrees.
        let sigma = 0.5 * 0.082 * pixels_per_degree;
        let feature_radius = (3.0 * sigma).ceil();
        let reach = sensitivity_radius.max(feature_radius) as usize;
        let sampled = |radius: f64, rule: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let offsets = (0..=2 * reach).map(|i| i as f64 - reach as f64);
            offsets.map(|x| if x.abs() <= radius { rule(x) } else { 0.0 }).collect()
        };
        let rounded = |weights: &[f64], scale: f64| weights.iter().map(|w| (w * scale) as f32).collect::<Vec<f32>>();

        // Section 4.1.1, table 1: sums of a sqrt(pi / b) exp(-pi^2 d^2 / b) over a distance of d degrees, each sum normalized.
        let gaussian = |b: f64| sampled(sensitivity_radius, &|x| (-(PI * x / pixels_per_degree).powi(2) / b).exp());
        let amount = |a: f64, b: f64| a * (PI / b).sqrt();
        let channel = |terms: &[(f64, f64)]| -> Vec<Vec<f32>> {
            let squared_sum = |b: f64| gaussian(b).iter().sum::<f64>().powi(2);
            let total: f64 = terms.iter().map(|&(a, b)| amount(a, b) * squared_sum(b)).sum();
            terms.iter().map(|&(a, b)| rounded(&gaussian(b), (amount(a, b) / total).sqrt())).collect()
        };
        let mut sensitivities = [channel(&[(1.0, 0.0047)]), channel(&[(1.0, 0.0053)]), channel(&[(34.1, 0.04), (13.5, 0.025)])].concat();
        let sensitivity = array::from_fn(|i| std::mem::take(&mut sensitivities[i]));

        // Section 4.2: positive weights sum to 1, negative ones to -1.
        let feature = |rule: &dyn Fn(f64) -> f64| {
            let weights = sampled(feature_radius, &|x| rule(x) * (-x * x / (2.0 * sigma * sigma)).exp());
            let sum = |sign: f64| weights.iter().map(|w| (sign * w).max(0.0)).sum::<f64>().max(f64::MIN_POSITIVE);
            let (positive, negative) = (sum(1.0), sum(-1.0));
            weights.iter().map(|&w| (w / if w > 0.0 { positive } else { negative }) as f32).collect()
        };
        let squared = 1.0 / (sigma * sigma);
        Filters { reach, sensitivity, gaussian: feature(&|_| 1.0), edge: feature(&|x| -x), point: feature(&|x| x * x * squared - 1.0) }
    }
}

/// Linear light of an sRGB byte.
fn linear_from_srgb() -> [f32; 256] {
    array::from_fn(|byte| {
        let v = byte as f64 / 255.0;
        (if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
    })
}

/// Planes of a row that was filtered along: four of contrast sensitivity, then the features' Gaussian, edge and point.
const PLANES: usize = SENSITIVITIES + 3;

/// The evaluation of one band of rows, between two columns.
struct Band<'a> {
    pictures: [&'a [u8]; 2],
    size: [usize; 2],
    rows: [usize; 2],
    columns: [usize; 2],
    filters: &'a Filters,
    linear: &'a [f32; 256],
    /// Whole rows of errors.
    band: &'a mut [f32],
}

impl pulp::WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let width = self.columns[1] - self.columns[0];
        let stride = padded(width);
        let planes = [self.filtered_along(self.pictures[0], stride), self.filtered_along(self.pictures[1], stride)];
        let most = greatest_distance();
        for y in self.rows[0]..self.rows[1] {
            for x in (0..width).step_by(TILE) {
                let row = y - self.rows[0];
                let errors = tile_errors(&self.filtered(&planes[0], row, x, stride), &self.filtered(&planes[1], row, x, stride), most);
                let count = TILE.min(width - x);
                let from = (y - self.rows[0]) * self.size[0] + self.columns[0] + x;
                self.band[from..from + count].copy_from_slice(&errors[..count]);
            }
        }
    }
}

/// A tile of pixels, filtered both ways.
struct Filtered {
    /// Y, Cx, Cz as seen from the viewing distance.
    seen: [[f32; TILE]; 3],
    /// Strength of edges and of points in Y.
    features: [[f32; TILE]; 2],
}

impl Band<'_> {
    /// Each row that the band's filters reach, those beyond the picture repeated, filtered along: planes of `stride` numbers.
    #[inline(always)]
    fn filtered_along(&self, picture: &[u8], stride: usize) -> Vec<f32> {
        let reach = self.filters.reach;
        let count = self.rows[1] - self.rows[0] + 2 * reach;
        let mut out = vec![0.0; count * PLANES * stride];
        let mut row = vec![[0.0f32; 3]; stride + 2 * reach];
        let mut channels = [vec![0.0; row.len()], vec![0.0; row.len()], vec![0.0; row.len()]];
        for (i, planes) in out.chunks_exact_mut(PLANES * stride).enumerate() {
            let y = (self.rows[0] + i).saturating_sub(reach).min(self.size[1] - 1);
            let bytes = picture[y * self.size[0] * 3..][..self.size[0] * 3].as_chunks::<3>().0;
            for (x, pixel) in row.iter_mut().enumerate() {
                let x = (self.columns[0] + x).saturating_sub(reach).min(self.size[0] - 1);
                let [r, g, b] = bytes[x];
                *pixel = [self.linear[usize::from(r)], self.linear[usize::from(g)], self.linear[usize::from(b)]];
            }
            for (x, &rgb) in row.iter().enumerate() {
                [channels[0][x], channels[1][x], channels[2][x]] = opponent_from_linear(rgb);
            }
            let filters = self.filters;
            let [y1, cx, cz1, cz2] = &filters.sensitivity;
            let [y, x, z] = &channels;
            let jobs = [(y, y1), (x, cx), (z, cz1), (z, cz2), (y, &filters.gaussian), (y, &filters.edge), (y, &filters.point)];
            for (plane, (channel, weights)) in planes.chunks_exact_mut(stride).zip(jobs) {
                along(channel, weights, plane);
            }
        }
        out
    }

    /// The tile at column `x` of a row of the band.
    #[inline(always)]
    fn filtered(&self, planes: &[f32], row: usize, x: usize, stride: usize) -> Filtered {
        let filters = self.filters;
        let (first, step) = (row * PLANES * stride + x, PLANES * stride);
        let [y1, cx, cz1, cz2] = &filters.sensitivity;
        let (y, cx) = (down(planes, first, step, y1), down(planes, first + stride, step, cx));
        let (mut cz, more) = (down(planes, first + 2 * stride, step, cz1), down(planes, first + 3 * stride, step, cz2));
        let (smooth, edge, point) = (first + 4 * stride, first + 5 * stride, first + 6 * stride);
        let (edge_x, edge_y) = (down(planes, edge, step, &filters.gaussian), down(planes, smooth, step, &filters.edge));
        let (point_x, point_y) = (down(planes, point, step, &filters.gaussian), down(planes, smooth, step, &filters.point));
        let (mut edges, mut points) = ([0.0; TILE], [0.0; TILE]);
        for i in 0..TILE {
            cz[i] += more[i];
            // Y is 116 y - 16; the filters do not see the 16.
            edges[i] = (edge_x[i] * edge_x[i] + edge_y[i] * edge_y[i]).sqrt() / 116.0;
            points[i] = (point_x[i] * point_x[i] + point_y[i] * point_y[i]).sqrt() / 116.0;
        }
        Filtered { seen: [y, cx, cz], features: [edges, points] }
    }
}

/// Section 4.3: the colour difference, raised to a power that the feature difference decides.
#[inline(always)]
fn tile_errors(a: &Filtered, b: &Filtered, most: f32) -> [f32; TILE] {
    let mut errors = [0.0; TILE];
    for i in 0..TILE {
        let p = hunt_lab_from_linear(linear_from_opponent([a.seen[0][i], a.seen[1][i], a.seen[2][i]]));
        let q = hunt_lab_from_linear(linear_from_opponent([b.seen[0][i], b.seen[1][i], b.seen[2][i]]));
        let color = redistributed(power(hyab(p, q), 0.7), most);
        let (edge, point) = ((a.features[0][i] - b.features[0][i]).abs(), (a.features[1][i] - b.features[1][i]).abs());
        let feature = (if edge > point { edge } else { point } * std::f32::consts::FRAC_1_SQRT_2).sqrt();
        errors[i] = power(color, 1.0 - feature);
    }
    errors
}

/// Section 4.1.3: 0 to 40 % of the greatest distance becomes 0 to 0.95, the rest what remains.
#[inline(always)]
fn redistributed(distance: f32, most: f32) -> f32 {
    const SHARE: f32 = 0.4;
    const BECOMES: f32 = 0.95;
    let bend = SHARE * most;
    let (low, high) = (distance / bend * BECOMES, BECOMES + (distance - bend) / (most - bend) * (1.0 - BECOMES));
    if distance < bend { low } else { high }
}

/// The greatest distance of two colours, between green and blue.
fn greatest_distance() -> f32 {
    power(hyab(hunt_lab_from_linear([0.0, 1.0, 0.0]), hunt_lab_from_linear([0.0, 0.0, 1.0])), 0.7)
}

/// The distance of large colour differences (equation 3).
#[inline(always)]
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let (l, a, b) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    l.abs() + (a * a + b * b).sqrt()
}

/// X and Z of white (D65), whose Y is 1.
const WHITE_X: f32 = 0.950_428_55;
const WHITE_Z: f32 = 1.088_900_4;

/// XYZ of linear RGB (sRGB's primaries), each relative to white.
#[inline(always)]
fn relative_xyz_from_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (0.412_386_56 * r + 0.357_591_5 * g + 0.180_450_5 * b) / WHITE_X,
        0.212_636_82 * r + 0.715_183 * g + 0.072_180_2 * b,
        (0.019_330_62 * r + 0.119_197_17 * g + 0.950_372_6 * b) / WHITE_Z,
    ]
}

/// YCxCz, a linear form of CIELAB.
#[inline(always)]
fn opponent_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_xyz_from_linear(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Linear RGB, held in [0, 1].
#[inline(always)]
fn linear_from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let (x, z) = ((y + cx / 500.0) * WHITE_X, (y - cz / 200.0) * WHITE_Z);
    [
        (3.241_003_3 * x - 1.537_399 * y - 0.498_615_86 * z).clamp(0.0, 1.0),
        (-0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z).clamp(0.0, 1.0),
        (0.055_639_423 * x - 0.204_011_2 * y + 1.057_149 * z).clamp(0.0, 1.0),
    ]
}

/// CIELAB of linear RGB in [0, 1], a and b adjusted for the Hunt effect: less chroma in the dark (section 4.1.2).
#[inline(always)]
fn hunt_lab_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_xyz_from_linear(rgb);
    let (x, y, z) = (lab_root(x), lab_root(y), lab_root(z));
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// CIELAB's cube root, which is straight near 0.
#[inline(always)]
fn lab_root(v: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    let (root, straight) = (cube_root(v), v / (3.0 * DELTA * DELTA) + 4.0 / 29.0);
    if v > DELTA * DELTA * DELTA { root } else { straight }
}

/// Cube root of a number in [1e-3, 2], to 3e-7: a guess from the exponent, then three steps of Newton's method. Vectors have no cube root.
#[inline(always)]
fn cube_root(v: f32) -> f32 {
    let mut root = f32::from_bits(((v.to_bits() as i32 as f32) * (1.0 / 3.0)) as i32 as u32 + 0x2a51_37a0);
    for _ in 0..3 {
        root = (2.0 * root + v / (root * root)) / 3.0;
    }
    root
}

/// `base` to a power, to 2e-6 for bases in [1e-6, 1e3] and powers in [0, 1]; 0 for a base of 0. Branches only by selection, as vectors want it.
#[inline(always)]
fn power(base: f32, exponent: f32) -> f32 {
    let raised = exp2(exponent * log2(base.max(f32::MIN_POSITIVE)));
    if base > 0.0 { raised } else { 0.0 }
}

/// log2 of a positive normal number: its exponent, and 2 atanh((m - 1) / (m + 1)) / ln 2 of its mantissa m in [1 / sqrt 2, sqrt 2].
#[inline(always)]
fn log2(v: f32) -> f32 {
    let shifted = v.to_bits().wrapping_sub(0x3f35_04f3) as i32; // 1 / sqrt 2
    let exponent = shifted >> 23;
    let mantissa = f32::from_bits(v.to_bits().wrapping_sub((exponent << 23) as u32));
    let t = (mantissa - 1.0) / (mantissa + 1.0);
    let s = t * t;
    let series = 1.0 + s * (1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s / 9.0)));
    exponent as f32 + 2.0 * std::f32::consts::LOG2_E * t * series
}

/// 2 to a power in [-126, 126]: a whole power from the bits, the rest of at most a half by its series.
#[inline(always)]
fn exp2(v: f32) -> f32 {
    const HALF_UP: f32 = 12_582_912.0; // 1.5 * 2^23: adding and subtracting it rounds to a whole number
    let shifted = v + HALF_UP;
    let whole = shifted - HALF_UP;
    let t = (v - whole) * std::f32::consts::LN_2;
    let series = 1.0 + t * (1.0 + t * (1.0 / 2.0 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t * (1.0 / 120.0 + t / 720.0)))));
    f32::from_bits((shifted.to_bits() << 23).wrapping_add(1.0f32.to_bits())) * series
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{SIZE, pairs, picture};
    use super::*;

    /// Means by NVIDIA's own `flip_evaluator` 1.7: `evaluate(a, b, "LDR", applyMagma=False)`.
    #[test]
    fn nvidias_evaluator_gives_the_same() {
        let means = [0.6559098, 0.8922892, 0.9673883, 0.9539752, 0.1583148];
        for ([a, b], expected) in pairs().iter().zip(means) {
            let found = mean(&errors(a, b, SIZE, DEFAULT_PIXELS_PER_DEGREE));
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}");
        }
        let [a, b] = &pairs()[4];
        assert!((mean(&errors(a, b, SIZE, 30.0)) - 0.1605192).abs() < 1e-5, "at 30 pixels per degree");
    }

    fn mean(errors: &[f32]) -> f64 {
        FlipFigures::of(errors, &vec![true; errors.len()], DEFAULT_PIXELS_PER_DEGREE).mean
    }

    /// A difference has the same error wherever it lies: at the seams of bands, tiles and cuts as in the middle of one.
    #[test]
    fn bands_and_cuts_change_nothing() {
        let size = [150, 400];
        // A square of 6 x 6 pixels on a gradient that moves with it; the errors of the 50 x 50 around it.
        let around = |[at_x, at_y]: [usize; 2], ends_differ: bool| {
            let under = |x: usize, y: usize, blue: u8| [(x + 150 - at_x) as u8, (y + 400 - at_y) as u8, blue];
            let image = picture(size, |x, y| {
                let in_square = (at_x..at_x + 6).contains(&(x + 3)) && (at_y..at_y + 6).contains(&(y + 3));
                under(x, y, if in_square || ends_differ && (x == 0 || x == 149) { 200 } else { 90 })
            });
            let found = errors(&picture(size, |x, y| under(x, y, 90)), &image, size, DEFAULT_PIXELS_PER_DEGREE);
            let places = (0..50).flat_map(|y| (0..50).map(move |x| [at_x + x - 25, at_y + y - 25]));
            places.map(|[x, y]| found[y * 150 + x]).collect::<Vec<f32>>()
        };
        // Where columns at both ends differ too, nothing is cut.
        let whole = around([75, 200], true);
        assert!(whole.iter().any(|&e| e > 0.1) && whole[..50].iter().all(|&e| e == 0.0));
        for at in [[75, 200], [75, 128], [64, 130], [70, 256], [97, 250], [100, 140]] {
            assert!(around(at, false).iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-6), "{at:?}");
        }
    }

    #[test]
    fn equal_pictures_have_no_error_and_one_pixel_has_one() {
        let a = picture([300, 300], |x, y| [(x * y) as u8, x as u8, y as u8]);
        assert!(errors(&a, &a, [300, 300], 67.0).iter().all(|&e| e == 0.0));
        // A pixel on its own is a field of its colour: no features, the colours' distance redistributed.
        let found = errors(&[0, 255, 0], &[0, 0, 255], [1, 1], 67.0)[0];
        assert!((found - 1.0).abs() < 1e-5, "green to blue is the greatest distance: {found}");
    }

    #[test]
    fn functions_for_vectors_agree_with_the_standard_ones() {
        for i in 0..=20_000 {
            let v = 0.001f32 * 1.0004f32.powi(i);
            assert!((cube_root(v) / v.cbrt() - 1.0).abs() < 4e-7 || v > 2.0, "cube root of {v}");
            let exponent = (i % 101) as f32 / 100.0;
            assert!((power(v, exponent) / v.powf(exponent) - 1.0).abs() < 2e-6, "{v} to {exponent}");
        }
        assert_eq!((power(0.0, 0.7), power(1.0, 0.5), power(1e-6, 0.0)), (0.0, 1.0, 1.0));
    }

    #[test]
    fn pooling_ranks_pixels() {
        let errors: Vec<f32> = (0..200).map(|i| i as f32 / 200.0).rev().collect();
        let covered: Vec<bool> = (0..200).map(|i| i < 2).collect();
        let pooled = FlipFigures::of(&errors, &covered, 67.0);
        assert_eq!((pooled.p99 as f32, pooled.max as f32), (197.0 / 200.0, 199.0 / 200.0));
        assert!((pooled.mean - 0.4975).abs() < 1e-6 && (pooled.covered_mean.expect("two") - 0.9925).abs() < 1e-6);
        assert_eq!(FlipFigures::of(&[0.0], &[false], 67.0).covered_mean, None);
    }
}
