//! SSIM: structural similarity (Wang et al. 2004, IEEE TIP 13(4)) as scikit-image computes it with `gaussian_weights=True, sigma=1.5,
//! use_sample_covariance=False, channel_axis=-1`.

use super::filter::{TILE, along, down, padded};
use rayon::prelude::*;

/// Pixels from a window's centre to its edge: windows are 11 x 11.
pub(super) const RADIUS: usize = 5;

const TAPS: usize = 2 * RADIUS + 1;

/// Standard deviation of the window's Gaussian, pixels.
const SIGMA: f64 = 1.5;

/// (K1 L)^2 and (K2 L)^2 with K1 = 0.01, K2 = 0.03 and peak L = 1.
const C1: f32 = 1e-4;
const C2: f32 = 9e-4;

/// Rows of windows that one task evaluates.
const BAND: usize = 64;

/// What is averaged over a window: both images, their squares, their product.
const MOMENTS: usize = 5;

/// SSIM of every 11 x 11 window that lies wholly in the picture, mean over R, G, B: `width - 10` by `height - 10` values, row by row from
/// the top, 1 where the windows are equal. Empty for a picture of fewer than 11 pixels a side. Both pictures are RGB bytes.
pub(super) fn windows(reference: &[u8], image: &[u8], [width, height]: [usize; 2]) -> Vec<f32> {
    if width < TAPS || height < TAPS {
        return Vec::new();
    }
    let across = width - 2 * RADIUS;
    let mut windows = vec![1.0; across * (height - 2 * RADIUS)];
    let weights = weights();
    windows.par_chunks_mut(BAND * across).enumerate().for_each(|(i, out)| {
        let rows = out.len() / across + 2 * RADIUS;
        let bytes = i * BAND * width * 3..(i * BAND + rows) * width * 3;
        let (a, b) = (&reference[bytes.clone()], &image[bytes]);
        if a != b {
            pulp::Arch::new().dispatch(Band { a, b, width, weights: &weights, out });
        }
    });
    windows
}

/// The Gaussian's weights along one axis; they sum to 1.
fn weights() -> [f32; TAPS] {
    let raw: [f64; TAPS] = std::array::from_fn(|i| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp());
    let sum: f64 = raw.iter().sum();
    raw.map(|w| (w / sum) as f32)
}

/// The evaluation of one band: `out` has a row of windows for each row of pixels but the outer ten.
struct Band<'a> {
    a: &'a [u8],
    b: &'a [u8],
    width: usize,
    weights: &'a [f32; TAPS],
    out: &'a mut [f32],
}

impl pulp::WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let across = self.width - 2 * RADIUS;
        let stride = padded(across);
        let rows = self.a.len() / (3 * self.width);
        // The moments of each row of pixels, averaged along the row.
        let mut averaged = vec![0.0; rows * MOMENTS * stride];
        let mut pixels = vec![0.0; MOMENTS * (stride + 2 * RADIUS)];
        self.out.fill(0.0);
        for channel in 0..3 {
            for (row, averaged) in averaged.chunks_exact_mut(MOMENTS * stride).enumerate() {
                let bytes = row * self.width * 3..(row + 1) * self.width * 3;
                moments(self.a[bytes.clone()].as_chunks::<3>().0, self.b[bytes].as_chunks::<3>().0, channel, &mut pixels);
                for (pixels, averaged) in pixels.chunks_exact(stride + 2 * RADIUS).zip(averaged.chunks_exact_mut(stride)) {
                    along(pixels, self.weights, averaged);
                }
            }
            for (row, out) in self.out.chunks_exact_mut(across).enumerate() {
                for (tile, out) in out.chunks_mut(TILE).enumerate() {
                    let (first, step) = (row * MOMENTS * stride + tile * TILE, MOMENTS * stride);
                    let similarities = similarity([
                        down(&averaged, first, step, self.weights),
                        down(&averaged, first + stride, step, self.weights),
                        down(&averaged, first + 2 * stride, step, self.weights),
                        down(&averaged, first + 3 * stride, step, self.weights),
                        down(&averaged, first + 4 * stride, step, self.weights),
                    ]);
                    out.iter_mut().zip(similarities).for_each(|(out, similarity)| *out += similarity / 3.0);
                }
            }
        }
    }
}

/// A row of pixels of one channel: a, b, a^2, b^2, ab, one after the other.
#[inline(always)]
fn moments(a: &[[u8; 3]], b: &[[u8; 3]], channel: usize, out: &mut [f32]) {
    let stride = out.len() / MOMENTS;
    for x in 0..a.len() {
        let (a, b) = (f32::from(a[x][channel]) / 255.0, f32::from(b[x][channel]) / 255.0);
        (out[x], out[stride + x]) = (a, b);
        (out[2 * stride + x], out[3 * stride + x], out[4 * stride + x]) = (a * a, b * b, a * b);
    }
}

/// A channel's SSIM (equation 13) of windows side by side.
#[inline(always)]
fn similarity(averages: [[f32; TILE]; MOMENTS]) -> [f32; TILE] {
    let mut similarities = [0.0; TILE];
    for x in 0..TILE {
        let (a, b) = (averages[0][x], averages[1][x]);
        let (aa, bb, ab) = (averages[2][x], averages[3][x], averages[4][x]);
        let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
        let numerator = (2.0 * a * b + C1) * (2.0 * covariance + C2);
        similarities[x] = numerator / ((a * a + b * b + C1) * (variance_a + variance_b + C2));
    }
    similarities
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{SIZE, pairs, picture};
    use super::*;

    fn mean(windows: &[f32]) -> f64 {
        windows.iter().map(|&v| f64::from(v)).sum::<f64>() / windows.len() as f64
    }

    /// Values by scikit-image 0.26: `structural_similarity(a, b, channel_axis=-1, gaussian_weights=True, sigma=1.5,
    /// use_sample_covariance=False, data_range=255)`.
    #[test]
    fn scikit_image_gives_the_same() {
        let similarities = [0.8718198, 0.0040658, 0.0001, 2.2e-6, 0.7522246];
        for ([a, b], expected) in pairs().iter().zip(similarities) {
            let found = mean(&windows(a, b, SIZE));
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}");
        }
    }

    /// Two constant pictures have no structure: the luminance term alone is left.
    #[test]
    fn constant_pictures_have_a_closed_form() {
        let [a, b] = [51, 102].map(|v| picture([20, 90], |_, _| [v; 3]));
        let expected = (2.0 * 0.2 * 0.4 + 1e-4) / (0.2 * 0.2 + 0.4 * 0.4 + 1e-4);
        let found = windows(&a, &b, [20, 90]);
        assert_eq!(found.len(), 10 * 80);
        assert!(found.iter().all(|v| (v - expected).abs() < 1e-3), "{:?}", &found[..3]);
    }

    #[test]
    fn a_pixel_reaches_the_windows_around_it_and_no_other() {
        let size = [40, 150];
        let a = picture(size, |x, y| [(x * y) as u8, x as u8, y as u8]);
        let mut b = a.clone();
        b[(70 * 40 + 20) * 3] ^= 0x80;
        for (i, &similarity) in windows(&a, &b, size).iter().enumerate() {
            let near = (i % 30 + RADIUS).abs_diff(20) <= RADIUS && (i / 30 + RADIUS).abs_diff(70) <= RADIUS;
            assert!(if near { similarity < 1.0 } else { (similarity - 1.0).abs() < 1e-6 }, "window {i}: {similarity}");
        }
        assert!(windows(&a, &a, size).iter().all(|&s| s == 1.0));
        assert!(windows(&a[..10 * 40 * 3], &b[..10 * 40 * 3], [40, 10]).is_empty(), "too low for a window");
    }
}
