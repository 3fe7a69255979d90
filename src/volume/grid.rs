//! [`Grid`] and its validation.

use super::samples::{Samples, Voxel, with_voxels};
use crate::geometry::{Aabb, Placed};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Steps of a grid that are this near to being in a plane, by the volume that they span as unit vectors, make no volume.
const FLAT: f64 = 1e-6;

/// The range of no values.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Values beyond this leave no room for differences.
const LARGEST: f64 = 1e300;

/// Where the points of a grid lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridFrame {
    /// Points along each axis of the grid, each at least 2.
    pub dims: [u32; 3],
    /// World position of point (0, 0, 0).
    pub origin: DVec3,
    /// The way from a point to the next along each axis of the grid, world units: direction times spacing, one column an axis.
    pub steps: DMat3,
}

/// Why numbers make no volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// There is no space between points along some axis.
    #[error("is {} x {} x {} points, expected at least 2 along each axis", .0[0], .0[1], .0[2])]
    Dims([u64; 3]),
    /// The points cannot be indexed.
    #[error("is {} x {} x {} points, more than octetra can index", .0[0], .0[1], .0[2])]
    TooLarge([u64; 3]),
    /// Not one number a point.
    #[error("has {found} numbers for {expected} points")]
    Count {
        /// Numbers.
        found: usize,
        /// Points.
        expected: usize,
    },
    /// Steps that are not finite, zero or in a plane.
    #[error("has steps between its points of {0:?}, expected finite ones that span a volume")]
    Steps([f64; 9]),
    /// An origin that is not finite.
    #[error("has its origin at {0}, expected finite coordinates")]
    Origin(DVec3),
    /// All values are NaN or infinite.
    #[error("has no finite value")]
    AllMissing,
    /// Values whose range cannot be told in f64.
    #[error("ranges from {} to {}; values must stay within 1e300", .0[0], .0[1])]
    Values([f64; 2]),
    /// The vectors have fewer components.
    #[error("has {components} components, there is no component {index}")]
    Component {
        /// How many it has.
        components: usize,
        /// The one asked for, from 0.
        index: usize,
    },
}

impl GridFrame {
    /// A frame along the world's axes.
    pub fn along_axes(dims: [u32; 3], origin: DVec3, spacing: DVec3) -> Self {
        GridFrame { dims, origin, steps: DMat3::from_diagonal(spacing) }
    }

    /// Points in all.
    pub fn points(&self) -> u64 {
        self.dims.iter().map(|&n| u64::from(n)).product()
    }

    /// Checks that the points span a volume and can be counted.
    pub fn validate(&self) -> Result<(), GridError> {
        let dims = self.dims.map(u64::from);
        if dims.iter().any(|&n| n < 2) {
            return Err(GridError::Dims(dims));
        }
        let points = dims.iter().try_fold(1u64, |product, &n| product.checked_mul(n));
        if points.is_none_or(|points| points > 1 << 40) {
            return Err(GridError::TooLarge(dims));
        }
        if !self.origin.is_finite() {
            return Err(GridError::Origin(self.origin));
        }
        let [a, b, c] = [self.steps.x_axis, self.steps.y_axis, self.steps.z_axis];
        let span = a.normalize_or_zero().cross(b.normalize_or_zero()).dot(c.normalize_or_zero()).abs();
        if !self.steps.is_finite() || span < FLAT || span.is_nan() || !self.steps.determinant().is_normal() {
            return Err(GridError::Steps(self.steps.to_cols_array()));
        }
        Ok(())
    }

    /// Lengths of the steps.
    pub fn spacing(&self) -> DVec3 {
        DVec3::new(self.steps.x_axis.length(), self.steps.y_axis.length(), self.steps.z_axis.length())
    }

    /// The corners of the box that the points span, number `x + 2 y + 4 z` along the grid's axes, world positions.
    pub fn corners(&self) -> [DVec3; 8] {
        let last = self.dims.map(|n| f64::from(n) - 1.0);
        std::array::from_fn(|k| {
            let at = DVec3::new((k & 1) as f64 * last[0], (k >> 1 & 1) as f64 * last[1], (k >> 2) as f64 * last[2]);
            self.origin + self.steps * at
        })
    }
}

/// One scalar a point of a regular grid, trilinear between points.
#[derive(Debug, Clone)]
pub struct Grid {
    frame: GridFrame,
    name: String,
    samples: Samples,
    range: [f64; 2],
    missing: usize,
    center: DVec3,
    bounds: Aabb,
    notes: Vec<String>,
}

impl Grid {
    /// A grid of `samples`, x fastest, then y, then z; `name` is what the numbers are called. Infinite values become NaN, which means missing.
    pub fn new(frame: GridFrame, name: String, mut samples: Samples) -> Result<Self, GridError> {
        frame.validate()?;
        if samples.len() as u64 != frame.points() {
            return Err(GridError::Count { found: samples.len(), expected: frame.points() as usize });
        }
        let (mut range, mut missing) = with_voxels!(&samples, voxels => extremes(voxels));
        // Of what has no infinite value nothing is to be changed, so that it may stay in its file.
        if range != NOTHING && range.iter().any(|v| v.is_infinite()) {
            match &mut samples {
                Samples::F32(values) => values.to_mut().par_iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = f32::NAN),
                Samples::F64(values) => values.to_mut().par_iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = f64::NAN),
                _ => {}
            }
            (range, missing) = with_voxels!(&samples, voxels => extremes(voxels));
        }
        if range[0] > range[1] {
            return Err(GridError::AllMissing);
        }
        if range.iter().any(|v| v.abs() > LARGEST) {
            return Err(GridError::Values(range));
        }
        let bounds = Aabb::of_points(frame.corners());
        let center = bounds.center();
        if !bounds.size().is_finite() || !center.is_finite() {
            return Err(GridError::Steps(frame.steps.to_cols_array()));
        }
        Ok(Grid { frame, name, samples, range, missing, center, bounds: bounds.translated(-center), notes: vec![] })
    }

    /// The same with notes of what its file says or lacks, a sentence each.
    pub fn with_notes(self, notes: Vec<String>) -> Self {
        Grid { notes, ..self }
    }

    /// What the user should know of its file.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Where the points lie.
    pub fn frame(&self) -> &GridFrame {
        &self.frame
    }

    /// What the numbers are called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The numbers, x fastest, then y, then z.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Smallest and largest of the values that are not missing.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// How many values are missing.
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// Bytes in memory; none for numbers that lie in a mapped file.
    pub fn bytes(&self) -> usize {
        if self.samples.is_mapped() { 0 } else { self.samples.bytes() }
    }
}

impl Placed for Grid {
    fn center(&self) -> DVec3 {
        self.center
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// Smallest and largest value, and how many are NaN.
fn extremes<T: Voxel>(voxels: &[T]) -> ([f64; 2], usize) {
    #[allow(clippy::eq_op)] // only NaN differs from itself, and integers have none
    let of_part = |part: &[T]| {
        let mut known = part.iter().copied().filter(|v| *v == *v);
        let Some(first) = known.next() else { return (NOTHING, part.len()) };
        let (mut lo, mut hi, mut missing) = (first, first, 0);
        for &v in part {
            lo = if v < lo { v } else { lo };
            hi = if v > hi { v } else { hi };
            missing += usize::from(v != v);
        }
        ([lo.to_f64(), hi.to_f64()], missing)
    };
    let both = |a: ([f64; 2], usize), b: ([f64; 2], usize)| ([a.0[0].min(b.0[0]), a.0[1].max(b.0[1])], a.1 + b.1);
    voxels.par_chunks(1 << 16).map(of_part).reduce(|| (NOTHING, 0), both)
}

/// One number a point from vectors: the component of this number, or the length. `inner` numbers lie between one component of a vector and
/// its next, see [`Samples`]; vectors of one component are taken as they are.
pub fn pick_component(samples: Samples, inner: usize, components: usize, index: Option<usize>) -> Result<Samples, GridError> {
    match index {
        _ if components == 1 => Ok(samples),
        None => Ok(samples.magnitude(inner, components)),
        Some(index) if index < components => Ok(samples.component(inner, components, index)),
        Some(index) => Err(GridError::Component { components, index }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(dims: [u32; 3]) -> GridFrame {
        GridFrame::along_axes(dims, DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 4.0))
    }

    #[test]
    fn bounds_are_those_of_the_points_whatever_way_the_axes_go() {
        let grid = Grid::new(frame([2, 3, 4]), "s".into(), Samples::U8((0..24).collect())).expect("valid");
        assert_eq!((grid.center(), grid.bounds().size()), (DVec3::new(1.5, 4.0, 9.0), DVec3::new(1.0, 4.0, 12.0)));
        assert_eq!((grid.range(), grid.missing()), ([0.0, 23.0], 0));
        let turned = GridFrame { steps: DMat3::from_cols(DVec3::Y, -DVec3::X, DVec3::Z), ..frame([2, 3, 4]) };
        let grid = Grid::new(turned, "s".into(), Samples::U8((0..24).collect())).expect("valid");
        assert_eq!(grid.bounds().translated(grid.center()).min, DVec3::new(-1.0, 2.0, 3.0));
    }

    #[test]
    fn values_that_are_not_finite_are_missing() {
        let mut values = vec![1.0; 8];
        (values[0], values[3], values[5]) = (f32::NAN, f32::INFINITY, -2.0);
        let grid = Grid::new(frame([2, 2, 2]), "s".into(), Samples::F32(values.into())).expect("some are finite");
        assert_eq!((grid.range(), grid.missing()), ([-2.0, 1.0], 2));
        let infinite = [f64::INFINITY, f64::NEG_INFINITY].repeat(4);
        assert_eq!(Grid::new(frame([2, 2, 2]), "s".into(), Samples::F64(infinite.into())).err(), Some(GridError::AllMissing));
        assert_eq!(Grid::new(frame([2, 2, 2]), "s".into(), Samples::F64(vec![f64::NAN; 8].into())).err(), Some(GridError::AllMissing));
    }

    #[test]
    fn what_spans_no_volume_is_refused() {
        let bytes = |n| Samples::U8(vec![0; n].into());
        assert_eq!(Grid::new(frame([2, 1, 4]), "s".into(), bytes(8)).err(), Some(GridError::Dims([2, 1, 4])));
        assert!(matches!(Grid::new(frame([2, 2, 2]), "s".into(), bytes(9)), Err(GridError::Count { found: 9, expected: 8 })));
        assert!(matches!(Grid::new(frame([u32::MAX; 3]), "s".into(), bytes(9)), Err(GridError::TooLarge(_))));
        for steps in [DMat3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0)), DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z)] {
            let flat = GridFrame { steps, ..frame([2, 2, 2]) };
            assert!(matches!(Grid::new(flat, "s".into(), bytes(8)), Err(GridError::Steps(_))));
        }
    }
}
