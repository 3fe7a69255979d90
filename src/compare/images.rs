//! Everything that is said about two images.

use super::{CompareError, Figures, FlipFigures, flip, ssim};
use crate::image::{Background, StoredImage};
use rayon::prelude::*;

/// The alpha above which a pixel of the reference is covered.
const COVERED_ALPHA: f32 = 1.0 / 512.0;

/// How an image differs from its reference.
#[derive(Debug, Clone)]
pub struct ImageComparison {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// No number that both files hold differs, alpha included.
    pub is_identical: bool,
    /// What tells covered pixels.
    pub coverage: CoverageRule,
    /// As 8-bit pictures over black, over all pixels.
    pub all: Part,
    /// As 8-bit pictures over black, over covered pixels; `None` if there are none.
    pub covered: Option<Part>,
    /// FLIP of the 8-bit pictures.
    pub flip: FlipFigures,
    /// Over all and over covered pixels as floats, where both files have more than 8 bits. Pixels of which one file has no value (see
    /// [`super::pair`]) are left out.
    pub raw: Option<[Option<Figures>; 2]>,
    /// Alpha on its own, where both files have it.
    pub alpha: Option<AlphaFigures>,
    /// FLIP of each pixel, row by row from the top.
    pub flip_errors: Vec<f32>,
    /// The reference's bytes, RGB over black.
    pub reference_rgb: Vec<u8>,
    /// The image's bytes, RGB over black.
    pub image_rgb: Vec<u8>,
}

/// The figures of 8-bit pictures over a set of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Differences of R, G and B, peak 1.
    pub figures: Figures,
    /// Mean SSIM of the 11 x 11 windows inside the picture that have these pixels as centres; `None` if there are none.
    pub ssim: Option<f64>,
}

/// Which pixels of the reference count as covered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoverageRule {
    /// Those with an alpha above 1/512.
    Alpha,
    /// Those that are not black, since the reference has no alpha.
    NotBlack,
}

impl CoverageRule {
    /// The rule in words.
    pub fn text(self) -> &'static str {
        match self {
            CoverageRule::Alpha => "reference alpha > 1/512",
            CoverageRule::NotBlack => "reference not black, it has no alpha",
        }
    }
}

/// How alpha differs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlphaFigures {
    /// Root of the mean squared difference over all pixels.
    pub rmse: f64,
    /// Largest difference.
    pub max_difference: f64,
    /// Largest alpha of the image where the reference is not covered: stray paint.
    pub max_outside: f64,
    /// Pixels of which alpha is 0 in one image and not in the other.
    pub only_in_one: u64,
}

impl ImageComparison {
    /// Largest difference of any channel, alpha included where both have it: of the floats where both have more than 8 bits, else of the
    /// 8-bit pictures.
    pub fn max_difference(&self) -> f64 {
        let color = match &self.raw {
            Some([all, _]) => all.map_or(0.0, |all| all.max_difference),
            None => self.all.figures.max_difference,
        };
        color.max(self.alpha.map_or(0.0, |alpha| alpha.max_difference))
    }
}

/// Compares an image with a reference of the same size. `pixels_per_degree` is FLIP's viewing distance, usually
/// [`super::DEFAULT_PIXELS_PER_DEGREE`].
pub fn compare_images(reference: &StoredImage, image: &StoredImage, pixels_per_degree: f32) -> Result<ImageComparison, CompareError> {
    let (a, b) = (&reference.image, &image.image);
    let (width, height) = (a.width, a.height);
    if (width, height) != (b.width, b.height) {
        return Err(CompareError::Sizes { reference: [width, height], image: [b.width, b.height] });
    }
    let (reference_rgb, image_rgb) = rayon::join(|| over_black(reference), || over_black(image));
    let coverage = if reference.has_alpha { CoverageRule::Alpha } else { CoverageRule::NotBlack };
    let covered: Vec<bool> = match coverage {
        CoverageRule::Alpha => a.pixels.par_iter().map(|p| p[3] > COVERED_ALPHA).collect(),
        CoverageRule::NotBlack => reference_rgb.par_chunks_exact(3).map(|p| p != [0; 3]).collect(),
    };
    let size = [width as usize, height as usize];
    let flip_errors = flip::errors(&reference_rgb, &image_rgb, size, pixels_per_degree);
    let flip = FlipFigures::of(&flip_errors, &covered, pixels_per_degree);
    let [all, covered_part] = parts(&reference_rgb, &image_rgb, size, &covered);
    let raw = (reference.is_deep && image.is_deep).then(|| raw_figures(&a.pixels, &b.pixels, &covered));
    let alpha = (reference.has_alpha && image.has_alpha).then(|| alpha_figures(&a.pixels, &b.pixels, &covered));
    let all = all.expect("an image has pixels");
    let is_identical = all.figures.is_identical()
        && raw.is_none_or(|[all, _]| all.is_none_or(|all| all.is_identical()))
        && alpha.is_none_or(|alpha| alpha.max_difference == 0.0);
    let covered = covered_part;
    Ok(ImageComparison { width, height, is_identical, coverage, all, covered, flip, raw, alpha, flip_errors, reference_rgb, image_rgb })
}

/// The bytes that a screen shows.
fn over_black(stored: &StoredImage) -> Vec<u8> {
    stored.image.to_bytes(Background::Color([0.0; 3]))
}

/// Over all pixels and over the covered ones.
fn parts(a: &[u8], b: &[u8], size: [usize; 2], covered: &[bool]) -> [Option<Part>; 2] {
    let difference = |i: usize| [0, 1, 2].map(|c| (f64::from(a[3 * i + c]) - f64::from(b[3 * i + c])) / 255.0);
    let windows = ssim::windows(a, b, size);
    let centre_covered = |window: usize| {
        let across = size[0] - 2 * ssim::RADIUS;
        covered[(window / across + ssim::RADIUS) * size[0] + window % across + ssim::RADIUS]
    };
    [false, true].map(|only_covered| {
        let figures = Figures::of(covered.len(), |i| (!only_covered || covered[i]).then(|| difference(i)))?;
        let counted = windows.iter().enumerate().filter(|&(i, _)| !only_covered || centre_covered(i));
        let (sum, count) = counted.fold((0.0, 0u64), |(sum, count), (_, &s)| (sum + f64::from(s), count + 1));
        Some(Part { figures, ssim: (count > 0).then(|| sum / count as f64) })
    })
}

fn raw_figures(a: &[[f32; 4]], b: &[[f32; 4]], covered: &[bool]) -> [Option<Figures>; 2] {
    let difference = |i: usize| [0, 1, 2].map(|c| f64::from(a[i][c]) - f64::from(b[i][c]));
    let counted = |i: usize| Some(difference(i)).filter(|d| d.iter().all(|d| d.is_finite()));
    [false, true].map(|only_covered| Figures::of(a.len(), |i| if !only_covered || covered[i] { counted(i) } else { None }))
}

fn alpha_figures(a: &[[f32; 4]], b: &[[f32; 4]], covered: &[bool]) -> AlphaFigures {
    let difference = |i: usize| f64::from(a[i][3]) - f64::from(b[i][3]);
    let figures = Figures::of(a.len(), |i| Some([difference(i); 3])).expect("an image has pixels");
    let outside = b.iter().zip(covered).filter(|(_, covered)| !**covered).map(|(p, _)| f64::from(p[3]));
    AlphaFigures {
        rmse: figures.rmse,
        max_difference: figures.max_difference,
        max_outside: outside.fold(0.0, f64::max),
        only_in_one: a.iter().zip(b).filter(|(p, q)| (p[3] == 0.0) != (q[3] == 0.0)).count() as u64,
    }
}
