//! What an image has to reach.

use super::ImageComparison;

/// Limits that decide whether an image is good enough. What is `None` decides nothing; a value equal to its limit is within it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// Highest mean of FLIP over all pixels, 0 to 1.
    pub max_flip: Option<f64>,
    /// Lowest PSNR in decibels over covered pixels, or over all if none is covered.
    pub min_psnr_db: Option<f64>,
    /// Lowest SSIM over covered pixels, or over all if no window's centre is covered.
    pub min_ssim: Option<f64>,
    /// Highest [`ImageComparison::max_difference`], peak 1.
    pub max_difference: Option<f64>,
}

/// How an image stands against one limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The limit's name: `max_flip`, `min_psnr`, `min_ssim` or `max_difference`.
    pub name: &'static str,
    /// What the limit is about, in words.
    pub of: &'static str,
    /// What was measured; `None` for the SSIM of a picture that is too small for one, which passes only if it is identical.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
    /// The value is within it.
    pub passed: bool,
}

impl Limits {
    /// One verdict for each limit that is set.
    pub fn judge(&self, comparison: &ImageComparison) -> Vec<Verdict> {
        let part = comparison.covered.unwrap_or(comparison.all);
        let ssim = part.ssim.or(comparison.all.ssim).or(comparison.all.figures.is_identical().then_some(1.0));
        let at_most = |name, of, value: f64, limit: f64| Verdict { name, of, value: Some(value), limit, passed: value <= limit };
        let at_least = |name, of, value: Option<f64>, limit| Verdict { name, of, value, limit, passed: value.is_some_and(|v| v >= limit) };
        [
            self.max_flip.map(|limit| at_most("max_flip", "mean FLIP", comparison.flip.mean, limit)),
            self.min_psnr_db.map(|limit| at_least("min_psnr", "covered PSNR", Some(part.figures.psnr_db()), limit)),
            self.min_ssim.map(|limit| at_least("min_ssim", "covered SSIM", ssim, limit)),
            self.max_difference.map(|limit| at_most("max_difference", "the largest difference", comparison.max_difference(), limit)),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}
