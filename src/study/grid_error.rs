//! The error of a volume's octree at random points between those of the volume.

use super::error::{CHUNK, Found, SplitMix64, figures};
use super::{ErrorSampling, FieldError};
use crate::geometry::Placed;
use crate::octree::OctreeTexture;
use crate::progress::{Cancelled, Progress};
use crate::volume::{Grid, Voxel, with_voxels};
use glam::DVec3;

impl FieldError {
    /// Measures at seeded random points of a volume.
    ///
    /// The points are stratified: the i-th of N is drawn from the i-th N-th of the volume's cells, row by row. Inside a cell they are uniform; in
    /// those that hang on a missing value there is nothing to measure.
    pub fn measure_grid(
        grid: &Grid,
        texture: &OctreeTexture,
        sampling: &ErrorSampling,
        progress: &Progress,
    ) -> Result<FieldError, Cancelled> {
        progress.begin("measuring", sampling.points as u64);
        let probe = Probe { grid, texture, sampling, progress };
        let chunk = |k: usize, errors: &mut [f32]| with_voxels!(grid.samples(), values => probe.chunk(values, k, errors));
        let by_volume = figures(sampling, sampling.points, grid.center(), chunk)?;
        Ok(FieldError { sampling: *sampling, by_volume, by_tet: by_volume })
    }
}

/// What is measured, and how.
struct Probe<'a> {
    grid: &'a Grid,
    texture: &'a OctreeTexture,
    sampling: &'a ErrorSampling,
    progress: &'a Progress,
}

impl Probe<'_> {
    /// Measures at the points of chunk `k` and leaves the size of each error in `errors`.
    fn chunk<V: Voxel>(&self, values: &[V], k: usize, errors: &mut [f32]) -> Result<Found, Cancelled> {
        self.progress.check()?;
        let (frame, [lo, hi]) = (self.grid.frame(), self.grid.range());
        let scale = if hi > lo { 1.0 / (hi - lo) } else { 0.0 };
        let [nx, ny, _] = frame.dims.map(|n| n as usize);
        let cells = frame.dims.map(|n| n as usize - 1);
        let count = cells.iter().product::<usize>();
        let stratum = count as f64 / self.sampling.points as f64;
        let (origin, root_min, per_edge) = (frame.origin - self.grid.center(), self.texture.root_min(), 1.0 / self.texture.root_edge());
        let mut random = SplitMix64::of_chunk(self.sampling.seed, k as u64);
        let mut found = Found::default();
        for (i, size) in errors.iter_mut().enumerate() {
            let number = ((((k * CHUNK + i) as f64 + random.unit()) * stratum) as usize).min(count - 1);
            let low = [number % cells[0], number / cells[0] % cells[1], number / (cells[0] * cells[1])];
            let part = DVec3::new(random.unit(), random.unit(), random.unit());
            let value = |x: usize, y: usize, z: usize| (values[low[0] + x + nx * (low[1] + y + ny * (low[2] + z))].to_f64() - lo) * scale;
            let lerp = |a: f64, b: f64, w: f64| a + w * (b - a);
            let row = |y: usize, z: usize| lerp(value(0, y, z), value(1, y, z), part.x);
            let expected = lerp(lerp(row(0, 0), row(1, 0), part.y), lerp(row(0, 1), row(1, 1), part.y), part.z);
            if expected.is_nan() {
                found.missing += 1;
                continue;
            }
            let at = origin + frame.steps * (DVec3::from_array(low.map(|n| n as f64)) + part);
            // Rounding must not put a point out of the root cube.
            let unit = ((at - root_min) * per_edge).clamp(DVec3::ZERO, DVec3::splat(1.0 - f64::EPSILON));
            if let Some(value) = self.texture.value_at(unit) {
                *size = found.add(value, expected, at, self.sampling);
            }
        }
        self.progress.add(errors.len() as u64);
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{CellKind, Octree, OctreeParams, regularize_grid};
    use crate::volume::{GridFrame, Samples};
    use glam::{DMat3, DQuat, UVec3};

    fn measure(grid: &Grid, texture: &OctreeTexture, tolerance: Option<f64>) -> FieldError {
        let sampling = ErrorSampling { points: 1 << 16, seed: 7, tolerance };
        FieldError::measure_grid(grid, texture, &sampling, &Progress::new()).expect("nobody cancels")
    }

    fn close(found: f64, expected: f64, relative: f64) {
        assert!((found / expected - 1.0).abs() < relative, "{found}, expected {expected}");
    }

    /// 17 points a side in a cube of edge 1, x as the field.
    fn ramp(missing: impl Fn(usize) -> bool) -> Grid {
        let frame = GridFrame::along_axes([17; 3], DVec3::new(5.0, 6.0, 7.0), DVec3::splat(1.0 / 16.0));
        let value = |i: usize| if missing(i) { f32::NAN } else { (i % 17) as f32 };
        Grid::new(frame, "x".into(), Samples::F32((0..17 * 17 * 17).map(value).collect())).expect("valid")
    }

    /// Leaves of depth 3 over the cube with the value that `value` gives for their number along x.
    fn leaves(grid: &Grid, value: impl Fn(u32) -> Option<f32>) -> OctreeTexture {
        let kind = |at: UVec3, depth: u8| match value(at.x) {
            _ if depth < 3 => CellKind::Split,
            Some(value) => CellKind::Leaf(value),
            None => CellKind::Empty,
        };
        OctreeTexture::encode(&Octree::from_fn(grid.bounds().min, 1.0, [0.0, 16.0], kind)).expect("fits")
    }

    #[test]
    fn constants_against_a_linear_field_have_a_uniform_error() {
        let (grid, h) = (ramp(|_| false), 1.0 / 8.0);
        let error = measure(&grid, &leaves(&grid, |i| Some((i as f32 + 0.5) / 8.0)), Some(h / 10.0));
        let figures = error.by_volume;
        close(figures.rmse_rel, h / 12f64.sqrt(), 0.005);
        close(figures.p99_rel, 0.99 * h / 2.0, 0.005);
        close(figures.max_rel, h / 2.0, 0.001);
        close(figures.above_tolerance.expect("a tolerance was given"), 0.8, 0.01);
        assert_eq!((figures.points, figures.uncovered, error.by_tet == figures), (1 << 16, 0.0, true));
        let at = figures.max_at.expect("there is an error") - DVec3::new(5.0, 6.0, 7.0);
        let from_face = (at.x / h - (at.x / h).round()).abs();
        assert!(from_face < 0.01 && at.min_element() >= 0.0 && at.max_element() <= 1.0, "{at} is next to a face between leaves");
    }

    #[test]
    fn what_is_empty_is_counted_and_what_is_missing_is_not() {
        let grid = ramp(|_| false);
        let half = measure(&grid, &leaves(&grid, |i| (i < 6).then_some((i as f32 + 0.5) / 8.0)), None).by_volume;
        close(half.uncovered, 0.25, 0.01);
        close(half.points as f64, 0.75 * f64::from(1 << 16), 0.01);
        // Without the last quarter of the points there is nothing to cover there.
        let part = ramp(|i| i % 17 > 12);
        let texture = leaves(&part, |i| (i < 6).then_some((i as f32 + 0.5) / 8.0 * 16.0 / 12.0));
        let found = measure(&part, &texture, None).by_volume;
        assert_eq!(found.uncovered, 0.0);
        close(found.points as f64, 0.75 * f64::from(1 << 16), 0.01);
        close(found.rmse_rel, 16.0 / 12.0 / 8.0 / 12f64.sqrt(), 0.005);
    }

    #[test]
    fn a_linear_field_is_without_error_whatever_way_the_axes_go() {
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.8));
        for directions in [DMat3::from_cols(DVec3::NEG_Z, DVec3::X, DVec3::Y), turn] {
            let steps = directions * DMat3::from_diagonal(DVec3::new(0.1, 0.05, 0.0625));
            let frame = GridFrame { dims: [12, 9, 7], origin: DVec3::new(1e3, -5.0, 3.0), steps };
            let value = |i: u32| f64::from(i % 12) + 2.0 * f64::from(i / 12 % 9) - f64::from(i / 108);
            let grid = Grid::new(frame, "s".into(), Samples::F64((0..756).map(value).collect())).expect("valid");
            // Cut cells of a turned volume take values from its sides, so that only small leaves there are exact.
            let params = OctreeParams { max_depth: 7, tolerance: Some(1e-3), ..OctreeParams::default() };
            let tree = regularize_grid(&grid, &params, &Progress::new()).expect("regularizes");
            let error = measure(&grid, &OctreeTexture::encode(&tree).expect("fits"), None).by_volume;
            assert!(error.rmse_rel < 2e-3 && error.uncovered == 0.0, "{error:?}");
        }
    }
}
