//! How far an image is from a reference: PSNR, SSIM, FLIP, and a map of where they differ; and how far a mesh is from another or from a
//! surface.
//!
//! Two images are compared as the 8-bit pictures over black that a screen shows, and as floats too where both have more than 8 bits. Every
//! number is given over all pixels and over the *covered* ones, for an empty background flatters: with a share c of the picture covered
//! and an exact background, PSNR over all pixels is higher by 10 log10(1 / c).

mod figures;
mod filter;
mod flip;
mod images;
mod limits;
mod map;
mod mesh;
mod ssim;
#[cfg(test)]
mod test_pictures;
mod values;

pub use figures::Figures;
pub use flip::{DEFAULT_PIXELS_PER_DEGREE, FlipFigures};
pub use images::{AlphaFigures, CoverageRule, ImageComparison, Part, compare_images};
pub use limits::{Limits, Verdict};
pub use map::{DifferenceMap, difference_map};
pub use mesh::{
    DistanceOptions, FieldDifference, Hit, Largest, Nearest, Norms, OnMesh, OneSided, Surface, SurfaceDistances, SurfaceError,
    SurfaceFigures, components, paint_surface,
};
pub use values::{Pair, pair};

/// Why two images cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// They are not of one size.
    #[error("{} x {} pixels, the reference has {} x {}; expected images of one size", image[0], image[1], reference[0], reference[1])]
    Sizes {
        /// Width and height of the reference.
        reference: [u32; 2],
        /// Width and height of the image.
        image: [u32; 2],
    },
    /// One holds a number per pixel, the other colours.
    #[error("{image}, the reference {reference}; expected two of a kind")]
    Kinds {
        /// What the reference holds.
        reference: &'static str,
        /// What the image holds.
        image: &'static str,
    },
    /// No pixel of a reference of values has one.
    #[error("the reference has no finite value")]
    NoValue,
}
