//! Mean squared and largest difference.

use rayon::prelude::*;

/// Pixels that one task sums. Fixed, so that the sums do not depend on the number of threads.
const CHUNK: usize = 1 << 15;

/// How far two images are apart over a set of pixels, R, G and B, peak 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// How many pixels were counted.
    pub pixels: u64,
    /// Root of the mean squared difference over pixels and channels.
    pub rmse: f64,
    /// Largest difference of a channel.
    pub max_difference: f64,
}

impl Figures {
    /// The figures of the pixels below `count` that have differences; `None` if none has.
    pub(super) fn of(count: usize, differences: impl Fn(usize) -> Option<[f64; 3]> + Sync) -> Option<Self> {
        let sum = |chunk: usize| {
            let (mut pixels, mut squares, mut largest) = (0, 0.0, 0f64);
            for d in (chunk * CHUNK..count.min((chunk + 1) * CHUNK)).filter_map(&differences) {
                pixels += 1;
                squares += d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                largest = largest.max(d[0].abs()).max(d[1].abs()).max(d[2].abs());
            }
            (pixels, squares, largest)
        };
        let sums: Vec<(u64, f64, f64)> = (0..count.div_ceil(CHUNK)).into_par_iter().map(sum).collect();
        let (pixels, squares, largest) = sums.iter().fold((0, 0.0, 0f64), |a, b| (a.0 + b.0, a.1 + b.1, a.2.max(b.2)));
        (pixels > 0).then(|| Figures { pixels, rmse: (squares / (3.0 * pixels as f64)).sqrt(), max_difference: largest })
    }

    /// Peak signal-to-noise ratio in decibels, -20 log10(RMSE); infinite where nothing differs.
    pub fn psnr_db(&self) -> f64 {
        0.0 - 20.0 * self.rmse.log10() // 0, not -0, for black against white
    }

    /// Nothing differs.
    pub fn is_identical(&self) -> bool {
        self.max_difference == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_difference_has_a_known_psnr() {
        let all = Figures::of(100_000, |_| Some([0.1; 3])).expect("pixels");
        assert!((all.psnr_db() - 20.0).abs() < 1e-9 && (all.rmse - 0.1).abs() < 1e-12 && all.max_difference == 0.1);
        let one = Figures::of(100_000, |i| Some([if i == 99_999 { -0.5 } else { 0.0 }, 0.0, 0.0])).expect("pixels");
        assert!((one.psnr_db() - 10.0 * (300_000.0f64 / 0.25).log10()).abs() < 1e-9 && one.max_difference == 0.5);
    }

    #[test]
    fn only_counted_pixels_count() {
        let even = Figures::of(10, |i| (i % 2 == 0).then_some([0.0; 3])).expect("five");
        assert!(even.pixels == 5 && even.is_identical() && even.psnr_db() == f64::INFINITY);
        assert_eq!(Figures::of(10, |_| None), None);
    }
}
