//! Which two files can be compared, and values as grey pictures.

use super::CompareError;
use crate::image::{Image, ImageFile, PixelValues, StoredImage};

/// Two images that can be compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The reference.
    pub reference: StoredImage,
    /// The image that is judged.
    pub image: StoredImage,
    /// Where the files hold a value per pixel: the reference's range, which is 0 to 1 in both images.
    pub range: Option<[f64; 2]>,
}

/// Puts two files side by side. Values become grey, scaled by the reference's range; a pixel without a value is NaN and
/// transparent.
pub fn pair(reference: ImageFile, image: ImageFile) -> Result<Pair, CompareError> {
    const COLORS: &str = "holds colours";
    const VALUES: &str = "holds one value per pixel";
    match (reference, image) {
        (ImageFile::Colors(reference), ImageFile::Colors(image)) => Ok(Pair { reference, image, range: None }),
        (ImageFile::Values(reference), ImageFile::Values(image)) => {
            let range = finite_range(&reference.values).ok_or(CompareError::NoValue)?;
            Ok(Pair { reference: grey(&reference, range), image: grey(&image, range), range: Some(range) })
        }
        (ImageFile::Colors(_), ImageFile::Values(_)) => Err(CompareError::Kinds { reference: COLORS, image: VALUES }),
        (ImageFile::Values(_), ImageFile::Colors(_)) => Err(CompareError::Kinds { reference: VALUES, image: COLORS }),
    }
}

fn finite_range(values: &[f64]) -> Option<[f64; 2]> {
    let widen = |range: Option<[f64; 2]>, &v: &f64| range.map_or(Some([v, v]), |[lo, hi]| Some([lo.min(v), hi.max(v)]));
    values.iter().filter(|v| v.is_finite()).fold(None, widen)
}

fn grey(values: &PixelValues, [lo, hi]: [f64; 2]) -> StoredImage {
    let scale = if hi > lo { 1.0 / (hi - lo) } else { 1.0 };
    let pixel = |&v: &f64| {
        let x = ((v - lo) * scale) as f32;
        if v.is_finite() { [x, x, x, 1.0] } else { [f32::NAN, f32::NAN, f32::NAN, 0.0] }
    };
    let pixels = values.values.iter().map(pixel).collect();
    Image { width: values.width, height: values.height, pixels }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(values: &[f64]) -> ImageFile {
        ImageFile::Values(PixelValues { width: values.len() as u32, height: 1, values: values.to_vec() })
    }

    #[test]
    fn values_are_scaled_by_the_references_range() {
        let found = pair(values(&[2.0, f64::NAN, 4.0]), values(&[3.0, 2.0, f64::INFINITY])).expect("two of a kind");
        assert_eq!(found.range, Some([2.0, 4.0]));
        let is = |pixel: [f32; 4], x: f32| pixel == [x, x, x, 1.0];
        let is_missing = |pixel: [f32; 4]| pixel[..3].iter().all(|v| v.is_nan()) && pixel[3] == 0.0;
        let [reference, image] = [&found.reference, &found.image].map(|stored| &stored.image.pixels);
        assert!(is(reference[0], 0.0) && is_missing(reference[1]) && is(reference[2], 1.0), "{reference:?}");
        assert!(is(image[0], 0.5) && is(image[1], 0.0) && is_missing(image[2]), "{image:?}");
        let constant = pair(values(&[7.0]), values(&[7.25])).expect("two of a kind");
        assert_eq!(constant.image.image.pixels[0][0], 0.25, "a range of nothing scales nothing");
    }

    #[test]
    fn what_has_no_common_measure_is_refused() {
        let colors = ImageFile::Colors(Image::new(1, 1).into());
        assert!(matches!(pair(values(&[1.0]), colors.clone()), Err(CompareError::Kinds { .. })));
        assert!(matches!(pair(colors, values(&[1.0])), Err(CompareError::Kinds { .. })));
        assert_eq!(pair(values(&[f64::NAN]), values(&[1.0])).err(), Some(CompareError::NoValue));
    }
}
