//! FLIP: the difference that a viewer sees who flips between two pictures (Andersson et al. 2020, LDR; NVIDIA's version 1.7, of which
//! the crate `flip_rs` is a port).

use super::CompareError;
use flip_rs::{FlipError, RgbImage, ldr_flip};
use rayon::prelude::*;

/// NVIDIA's default viewing distance: 0.7 m from a screen 0.7 m wide with 3840 pixels.
pub const DEFAULT_PIXELS_PER_DEGREE: f32 = flip_rs::DEFAULT_PPD;

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
///
/// A pixel's error comes from its neighbourhood alone, so bands of rows are evaluated on their own, cut down to where the pictures differ:
/// memory stays small, and an equal background costs nothing.
pub(super) fn errors(reference: &[u8], image: &[u8], size: [usize; 2], pixels_per_degree: f32) -> Result<Vec<f32>, CompareError> {
    let reach = reach(pixels_per_degree);
    let mut errors = vec![0.0; size[0] * size[1]];
    let bands = errors.par_chunks_mut(BAND * size[0]).enumerate();
    bands
        .try_for_each(|(i, band)| {
            let rows = [i * BAND, i * BAND + band.len() / size[0]];
            let Some(seen) = Rect::differing(reference, image, size, grown(rows, reach, size[1])) else { return Ok(()) };
            // Errors lie within reach of a difference, and what they are made of within reach of them.
            let wanted = Rect { x: grown(seen.x, reach, size[0]), y: rows };
            let cut = Rect { x: grown(wanted.x, reach, size[0]), y: grown(rows, reach, size[1]) };
            let found = ldr_flip(&cut.of(reference, size[0])?, &cut.of(image, size[0])?, pixels_per_degree)?;
            for (y, row) in band.chunks_exact_mut(size[0]).enumerate() {
                let from = (rows[0] + y - cut.y[0]) * cut.width() + wanted.x[0] - cut.x[0];
                row[wanted.x[0]..wanted.x[1]].copy_from_slice(&found.pixels()[from..from + wanted.width()]);
            }
            Ok(())
        })
        .map_err(|cause: FlipError| CompareError::Flip { pixels_per_degree, cause: cause.to_string() })?;
    Ok(errors)
}

/// Radius in pixels of the largest filter: three standard deviations of the widest of the contrast-sensitivity functions (b = 0.04,
/// table 1), against which the feature detector's (w = 0.082 degrees) is smaller.
fn reach(pixels_per_degree: f32) -> usize {
    let degrees = 3.0 * (0.04 / 2.0f32).sqrt() / std::f32::consts::PI;
    (degrees * pixels_per_degree).ceil() as usize + 1
}

/// `[from, to)` grown by `by` on both sides, within `[0, limit)`.
fn grown([from, to]: [usize; 2], by: usize, limit: usize) -> [usize; 2] {
    [from.saturating_sub(by), limit.min(to + by)]
}

/// Columns and rows, each from and up to.
struct Rect {
    x: [usize; 2],
    y: [usize; 2],
}

impl Rect {
    /// The columns, among these rows, between which the pictures differ; `None` if they do not.
    fn differing(reference: &[u8], image: &[u8], size: [usize; 2], y: [usize; 2]) -> Option<Self> {
        let (mut from, mut to) = (size[0], 0);
        for row in y[0]..y[1] {
            let bytes = row * size[0] * 3..(row + 1) * size[0] * 3;
            let (a, b) = (&reference[bytes.clone()], &image[bytes]);
            if a != b {
                let differ = |&i: &usize| a[3 * i..3 * i + 3] != b[3 * i..3 * i + 3];
                from = (0..from).find(differ).unwrap_or(from);
                to = (to..size[0]).rev().find(differ).map_or(to, |last| last + 1);
            }
        }
        (from < to).then_some(Rect { x: [from, to], y })
    }

    fn width(&self) -> usize {
        self.x[1] - self.x[0]
    }

    /// This part of a picture `width` wide.
    fn of(&self, rgb: &[u8], width: usize) -> Result<RgbImage<u8>, FlipError> {
        let rows = (self.y[0]..self.y[1]).flat_map(|y| &rgb[(y * width + self.x[0]) * 3..(y * width + self.x[1]) * 3]);
        RgbImage::new(self.width(), self.y[1] - self.y[0], rows.copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{SIZE, pairs, picture};
    use super::*;

    #[test]
    fn bands_and_cuts_change_nothing() {
        let size = [150, 400];
        let reference = picture(size, |x, y| [(x * y) as u8, (x ^ y) as u8, (3 * x) as u8]);
        for (from, to) in [((60, 120), (64, 140)), ((0, 0), (150, 400)), ((149, 399), (150, 400)), ((3, 250), (4, 256))] {
            let inside = |x, y| (from.0..to.0).contains(&x) && (from.1..to.1).contains(&y);
            let image = picture(size, |x, y| if inside(x, y) { [y as u8, 0, 9] } else { [(x * y) as u8, (x ^ y) as u8, (3 * x) as u8] });
            for pixels_per_degree in [DEFAULT_PIXELS_PER_DEGREE, 20.0] {
                let whole = |rgb: &[u8]| RgbImage::new(size[0], size[1], rgb.to_vec()).expect("sizes agree");
                let expected = ldr_flip(&whole(&reference), &whole(&image), pixels_per_degree).expect("evaluated");
                let found = errors(&reference, &image, size, pixels_per_degree).expect("evaluated");
                assert!(expected.pixels().iter().any(|&e| e > 0.1));
                assert_eq!(found, expected.pixels(), "{from:?} to {to:?} at {pixels_per_degree}");
            }
        }
    }

    /// Means by NVIDIA's own `flip_evaluator` 1.7: `evaluate(a, b, "LDR", applyMagma=False)`.
    #[test]
    fn nvidias_evaluator_gives_the_same() {
        let means = [0.6559098, 0.8922892, 0.9673883, 0.9539752, 0.1583148];
        for ([a, b], expected) in pairs().iter().zip(means) {
            let found = mean(&errors(a, b, SIZE, DEFAULT_PIXELS_PER_DEGREE).expect("evaluated"));
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}");
        }
        let [a, b] = &pairs()[4];
        assert!((mean(&errors(a, b, SIZE, 30.0).expect("evaluated")) - 0.1605192).abs() < 1e-5, "at 30 pixels per degree");
    }

    fn mean(errors: &[f32]) -> f64 {
        FlipFigures::of(errors, &vec![true; errors.len()], DEFAULT_PIXELS_PER_DEGREE).mean
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
