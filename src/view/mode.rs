//! What a ray makes of the values on its way: light, surfaces of equal value, or a number (method 4).

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What a pixel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Emission and absorption, front to back, together with the isosurfaces there are.
    #[default]
    Composite,
    /// Isosurfaces only.
    Iso,
    /// Maximum intensity projection: the largest value on the ray, in its colour.
    Maximum,
    /// Minimum intensity projection: the smallest value on the ray, in its colour.
    Minimum,
    /// X-ray: the mean of the value over the ray's length in the data, in its colour.
    Mean,
    /// X-ray: the integral of the value over that length, in data units times world units. Its colours span
    /// [`Mode::integral_range`] unless the transfer function has a range.
    Integral,
}

/// Why a text names no mode.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected composite, iso, mip, minip, xray or xray=integral")]
pub struct NotAMode;

impl Mode {
    /// Whether a pixel shows one number of its ray.
    pub fn is_number(self) -> bool {
        !matches!(self, Mode::Composite | Mode::Iso)
    }

    /// What the colours of an integral span by default: a value all along half of the diagonal, from 0 to the farther end of the range.
    pub fn integral_range([lo, hi]: [f64; 2], diagonal: f64) -> [f64; 2] {
        [lo.min(0.0) * diagonal / 2.0, hi.max(0.0) * diagonal / 2.0]
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Mode::Composite => "composite",
            Mode::Iso => "iso",
            Mode::Maximum => "mip",
            Mode::Minimum => "minip",
            Mode::Mean => "xray",
            Mode::Integral => "xray=integral",
        })
    }
}

impl FromStr for Mode {
    type Err = NotAMode;

    fn from_str(text: &str) -> Result<Self, NotAMode> {
        let all = [Mode::Composite, Mode::Iso, Mode::Maximum, Mode::Minimum, Mode::Mean, Mode::Integral];
        let named = all.into_iter().find(|mode| mode.to_string() == text);
        named.or((text == "xray=mean").then_some(Mode::Mean)).ok_or(NotAMode)
    }
}

/// What is written to pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Output {
    /// Linear premultiplied RGBA.
    #[default]
    Colors,
    /// What of a ray is no colour, for the library to read: its number, normalised, or -1; the length over which it was found and the
    /// distance from the eye to the first isosurface, both in edges of the root cube; and 1 if there is such a surface, else 0.
    Numbers,
}

/// A surface on which the field has one value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Isosurface {
    /// The value in data units.
    pub value: f64,
    /// Linear RGB in [0, 1]; `None`: the transfer function's colour of the value.
    #[serde(default)]
    pub color: Option<[f32; 3]>,
    /// From 0 (not seen) to 1 (nothing is seen behind it).
    #[serde(default = "opaque")]
    pub opacity: f32,
}

/// The opacity of isosurfaces that have none of their own.
fn opaque() -> f32 {
    1.0
}

impl Isosurface {
    /// An opaque one in the transfer function's colour.
    pub fn at(value: f64) -> Self {
        Isosurface { value, color: None, opacity: 1.0 }
    }
}

/// Some isosurfaces, at most [`Isosurfaces::MOST`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<Isosurface>", into = "Vec<Isosurface>")]
pub struct Isosurfaces {
    list: [Option<Isosurface>; Isosurfaces::MOST],
}

/// Why isosurfaces cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IsosurfaceError {
    /// More than there is room for.
    #[error("{0} isosurfaces, expected at most {max}", max = Isosurfaces::MOST)]
    TooMany(usize),
    /// A value that is no number.
    #[error("the isosurface's value is {0}, expected a finite number")]
    Value(f64),
    /// An opacity or a colour out of range.
    #[error("the opacity and the colour of the isosurface {0} are to be in [0, 1]")]
    Look(f64),
}

impl Isosurfaces {
    /// No ray meets more of them.
    pub const MOST: usize = 8;

    /// None.
    pub const NONE: Isosurfaces = Isosurfaces { list: [None; Isosurfaces::MOST] };

    /// These.
    pub fn new(surfaces: &[Isosurface]) -> Result<Self, IsosurfaceError> {
        if surfaces.len() > Self::MOST {
            return Err(IsosurfaceError::TooMany(surfaces.len()));
        }
        for surface in surfaces {
            let in_range = |v: f32| (0.0..=1.0).contains(&v);
            if !surface.value.is_finite() {
                return Err(IsosurfaceError::Value(surface.value));
            }
            if !(in_range(surface.opacity) && surface.color.is_none_or(|c| c.into_iter().all(in_range))) {
                return Err(IsosurfaceError::Look(surface.value));
            }
        }
        let mut list = [None; Self::MOST];
        list.iter_mut().zip(surfaces).for_each(|(place, surface)| *place = Some(*surface));
        Ok(Isosurfaces { list })
    }

    /// In the order in which they were given.
    pub fn iter(&self) -> impl Iterator<Item = Isosurface> {
        self.list.into_iter().flatten()
    }

    /// Ascending by value, as rays that rise meet them.
    pub fn ascending(&self) -> impl Iterator<Item = Isosurface> {
        let mut list = self.list;
        list.sort_by(|a, b| a.map_or(f64::INFINITY, |a| a.value).total_cmp(&b.map_or(f64::INFINITY, |b| b.value)));
        list.into_iter().flatten()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list[0].is_none()
    }
}

impl TryFrom<Vec<Isosurface>> for Isosurfaces {
    type Error = IsosurfaceError;

    fn try_from(surfaces: Vec<Isosurface>) -> Result<Self, IsosurfaceError> {
        Isosurfaces::new(&surfaces)
    }
}

impl From<Isosurfaces> for Vec<Isosurface> {
    fn from(surfaces: Isosurfaces) -> Self {
        surfaces.iter().collect()
    }
}

/// Where light comes from: a direction, so that it is the same everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "LightFile", into = "LightFile")]
pub enum LightSource {
    /// From the eye, along each ray.
    #[default]
    Camera,
    /// From this direction in the world, of any length that can be told from 0 and infinity when squared.
    From(DVec3),
}

/// A light as files have it: `"camera"` or `{"from": [x, y, z]}`.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum LightFile {
    Camera,
    From([f64; 3]),
}

impl TryFrom<LightFile> for LightSource {
    type Error = &'static str;

    fn try_from(file: LightFile) -> Result<Self, &'static str> {
        match file {
            LightFile::Camera => Ok(LightSource::Camera),
            LightFile::From(from) => {
                let from = DVec3::from_array(from);
                if from.try_normalize().is_some() { Ok(LightSource::From(from)) } else { Err("expected a direction that is not 0") }
            }
        }
    }
}

impl From<LightSource> for LightFile {
    fn from(light: LightSource) -> Self {
        match light {
            LightSource::Camera => LightFile::Camera,
            LightSource::From(from) => LightFile::From(from.to_array()),
        }
    }
}

/// Phong's reflection, from both sides: of a place that faces along `n`, with the light `l` and the eye `v` (units), of colour `c`,
/// `c (ambient + diffuse |n l|) + specular max(r v, 0)^shininess`, r being l reflected by n (method 4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Phong {
    /// K_a, from 0.
    pub ambient: f32,
    /// K_d, from 0.
    pub diffuse: f32,
    /// K_s, from 0.
    pub specular: f32,
    /// n, at least 1.
    pub shininess: f32,
    /// Where light comes from.
    pub light: LightSource,
}

impl Default for Phong {
    fn default() -> Self {
        Phong { ambient: 0.3, diffuse: 0.7, specular: 0.2, shininess: 20.0, light: LightSource::Camera }
    }
}

/// What is shaded by Phong's reflection; by default isosurfaces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shading {
    /// The volume, by the field's gradient. A place counts as facing nothing, and is not shaded, as far as the gradient is small against
    /// [`Shading::GRADIENT_FLOOR`].
    pub volume: bool,
    /// Isosurfaces.
    pub surfaces: bool,
    /// How.
    pub phong: Phong,
}

impl Default for Shading {
    fn default() -> Self {
        Shading { volume: false, surfaces: true, phong: Phong::default() }
    }
}

impl Shading {
    /// The gradient at which a place in the volume is shaded by half: ranges of the field per diagonal of the bounds.
    pub const GRADIENT_FLOOR: f64 = 0.02;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for mode in [Mode::Composite, Mode::Iso, Mode::Maximum, Mode::Minimum, Mode::Mean, Mode::Integral] {
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        assert_eq!("xray=mean".parse(), Ok(Mode::Mean));
        assert_eq!("max".parse::<Mode>(), Err(NotAMode));
    }

    #[test]
    fn isosurfaces_are_sorted_and_checked() {
        let [two, one] = [2.0, 1.0].map(Isosurface::at);
        let both = Isosurfaces::new(&[two, one]).expect("valid");
        assert_eq!(both.iter().collect::<Vec<_>>(), [two, one]);
        assert_eq!(both.ascending().collect::<Vec<_>>(), [one, two]);
        assert!(!both.is_empty() && Isosurfaces::NONE.is_empty());
        assert_eq!(Isosurfaces::new(&[one; 9]), Err(IsosurfaceError::TooMany(9)));
        assert!(matches!(Isosurfaces::new(&[Isosurface::at(f64::NAN)]), Err(IsosurfaceError::Value(_))));
        assert_eq!(Isosurfaces::new(&[Isosurface { opacity: 1.5, ..one }]), Err(IsosurfaceError::Look(1.0)));
    }

    #[test]
    fn integrals_span_from_nothing_to_half_a_diagonal() {
        assert_eq!(Mode::integral_range([1.0, 5.0], 4.0), [0.0, 10.0]);
        assert_eq!(Mode::integral_range([-3.0, -1.0], 4.0), [-6.0, 0.0]);
    }
}
