//! Images: linear premultiplied RGBA in f32, to and from PNG and NPY.

mod files;
mod template;

pub use files::{
    ImageError, ImageFile, PixelValues, StoredImage, bytes_png, read_image, read_npy, read_png, write_atomically, write_bytes_png,
    write_npy, write_png, write_values_npy,
};
pub use template::{NoNumber, Template};

/// An image of linear premultiplied RGBA, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels, row by row from the top.
    pub pixels: Vec<[f32; 4]>,
}

/// What lies behind the volume in an 8-bit picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Background {
    /// A colour, linear RGB in [0, 1].
    Color([f32; 3]),
    /// Nothing: the picture keeps its alpha.
    Transparent,
}

impl Image {
    /// A transparent image.
    pub fn new(width: u32, height: u32) -> Self {
        Image { width, height, pixels: vec![[0.0; 4]; width as usize * height as usize] }
    }

    /// `round(255 clip(rgb, 0, 1))` over the background: 3 bytes a pixel, or 4 (straight alpha, as PNG wants it) when transparent.
    pub fn to_bytes(&self, background: Background) -> Vec<u8> {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        match background {
            Background::Color(bg) => {
                let over = |p: &[f32; 4]| [0, 1, 2].map(|c| byte(p[c] + (1.0 - p[3]) * bg[c]));
                self.pixels.iter().flat_map(over).collect()
            }
            Background::Transparent => {
                let straight = |p: &[f32; 4]| {
                    let [r, g, b] = [0, 1, 2].map(|c| byte(if p[3] > 0.0 { p[c] / p[3] } else { 0.0 }));
                    [r, g, b, byte(p[3])]
                };
                self.pixels.iter().flat_map(straight).collect()
            }
        }
    }
}

/// Largest channel difference of two images of the same size as (99.9th percentile over pixels, maximum), in [0, 1]-units.
pub fn difference(a: &Image, b: &Image) -> (f32, f32) {
    assert_eq!((a.width, a.height), (b.width, b.height), "images of one size");
    let pixel =
        |(p, q): (&[f32; 4], &[f32; 4])| (0..4).map(|c| (p[c] - q[c]).abs()).fold(0.0, |m: f32, d| if d > m || d.is_nan() { d } else { m });
    let mut all: Vec<f32> = a.pixels.iter().zip(&b.pixels).map(pixel).collect();
    all.sort_by(f32::total_cmp);
    let rank = (all.len() as f64 * 0.999).ceil() as usize;
    (all[rank.clamp(1, all.len()) - 1], all[all.len() - 1])
}

/// PSNR in decibels of 8-bit images over black, peak 1: (over all pixels, over pixels where the reference's alpha exceeds 1/512).
/// 99 where the images are equal (`conventions.md`).
pub fn psnr(reference: &Image, image: &Image) -> (f64, f64) {
    assert_eq!((reference.width, reference.height), (image.width, image.height), "images of one size");
    let quantized = |i: &Image| i.to_bytes(Background::Color([0.0; 3]));
    let (a, b) = (quantized(reference), quantized(image));
    let decibels = |covered_only: bool| {
        let counted = |i: usize| !covered_only || reference.pixels[i][3] > 1.0 / 512.0;
        let (mut sum, mut count) = (0.0, 0u64);
        for i in (0..reference.pixels.len()).filter(|&i| counted(i)) {
            for c in 3 * i..3 * i + 3 {
                sum += ((f64::from(a[c]) - f64::from(b[c])) / 255.0).powi(2);
                count += 1;
            }
        }
        if sum == 0.0 { 99.0 } else { -10.0 * (sum / count as f64).log10() }
    };
    (decibels(false), decibels(true))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_rounded_over_the_background() {
        let image = Image { width: 2, height: 1, pixels: vec![[0.25, 0.0, 0.0, 0.5], [0.0; 4]] };
        assert_eq!(image.to_bytes(Background::Color([0.0, 1.0, 0.0])), [64, 128, 0, 0, 255, 0]);
        assert_eq!(image.to_bytes(Background::Transparent), [128, 0, 0, 128, 0, 0, 0, 0]);
    }

    #[test]
    fn psnr_counts_covered_pixels_apart() {
        let mut a = Image::new(10, 10);
        a.pixels[0] = [1.0; 4];
        let mut b = a.clone();
        b.pixels[0][0] = 0.0;
        let (all, covered) = psnr(&a, &b);
        assert!((covered - 10.0 * 3f64.log10()).abs() < 1e-9);
        assert!((all - covered - 20.0).abs() < 1e-9, "a hundredth of the pixels is covered");
        assert_eq!(psnr(&a, &a), (99.0, 99.0));
    }

    #[test]
    fn difference_finds_the_worst_pixel() {
        let a = Image::new(40, 50);
        let mut b = a.clone();
        b.pixels[7][3] = 0.5;
        assert_eq!(difference(&a, &b), (0.0, 0.5));
    }
}
