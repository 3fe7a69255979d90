//! The value between the points of a volume.

use super::{Grid, Voxel, with_voxels};
use crate::geometry::Placed;
use glam::DVec3;

/// Points this far outside the volume, in cells, count as on its faces: more than rounding moves them.
const TOLERANCE: f64 = 1e-9;

impl Grid {
    /// The cell that holds a place, by its lowest point along the grid's axes, and the trilinear value there in data units, which is `None`
    /// where a point of the cell is missing. `at` is relative to the volume's centre; `None` outside.
    pub fn value_at(&self, at: DVec3) -> Option<([u32; 3], Option<f64>)> {
        let frame = self.frame();
        let place = frame.steps.inverse() * (at + self.center() - frame.origin);
        let last = DVec3::from_array(frame.dims.map(|n| f64::from(n) - 1.0));
        if !(place.cmpge(DVec3::splat(-TOLERANCE)).all() && place.cmple(last + TOLERANCE).all()) {
            return None;
        }
        let low = place.clamp(DVec3::ZERO, last - 1.0).floor();
        let part = (place - low).clamp(DVec3::ZERO, DVec3::ONE);
        let cell = low.as_uvec3().to_array();
        let value = with_voxels!(self.samples(), voxels => trilinear(voxels, frame.dims, cell, part));
        Some((cell, value.is_finite().then_some(value)))
    }
}

fn trilinear<V: Voxel>(voxels: &[V], [nx, ny, _]: [u32; 3], [i, j, k]: [u32; 3], part: DVec3) -> f64 {
    let [nx, ny, i, j, k] = [nx, ny, i, j, k].map(|n| n as usize);
    let value = |x: usize, y: usize, z: usize| voxels[i + x + nx * (j + y + ny * (k + z))].to_f64();
    let lerp = |a: f64, b: f64, w: f64| a + w * (b - a);
    let row = |y: usize, z: usize| lerp(value(0, y, z), value(1, y, z), part.x);
    lerp(lerp(row(0, 0), row(1, 0), part.y), lerp(row(0, 1), row(1, 1), part.y), part.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{GridFrame, Samples};
    use glam::{DMat3, DQuat};

    #[test]
    fn a_turned_volume_has_its_own_trilinear_value() {
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7));
        let steps = turn * DMat3::from_diagonal(DVec3::new(0.5, 2.0, 1.25));
        let frame = GridFrame { dims: [5, 4, 3], origin: DVec3::new(10.0, -3.0, 4.0), steps };
        // Linear along each axis: what trilinear interpolation gives back.
        let of = |p: DVec3| 1.0 + p.x - 2.0 * p.y + 3.0 * p.z + 0.5 * p.x * p.y * p.z;
        let points = (0..60).map(|n| of(DVec3::new((n % 5) as f64, (n / 5 % 4) as f64, (n / 20) as f64)));
        let grid = Grid::new(frame, "s".into(), Samples::F64(points.collect::<Vec<_>>().into())).expect("valid");
        let world = |p: DVec3| frame.origin + steps * p - grid.center();
        for p in [DVec3::new(0.3, 2.7, 1.5), DVec3::ZERO, DVec3::new(4.0, 3.0, 2.0), DVec3::new(2.0, 0.25, 1.0)] {
            let (cell, value) = grid.value_at(world(p)).expect("inside");
            assert_eq!(cell.map(f64::from), p.min(DVec3::new(3.0, 2.0, 1.0)).floor().to_array(), "{p}");
            assert!((value.expect("nothing is missing") - of(p)).abs() < 1e-9, "{value:?} at {p}");
        }
        assert!([DVec3::new(-0.01, 1.0, 1.0), DVec3::new(1.0, 3.01, 1.0), DVec3::NAN].iter().all(|&p| grid.value_at(world(p)).is_none()));
    }

    #[test]
    fn cells_at_a_missing_point_have_no_value() {
        let mut values = vec![2.0f32; 27];
        values[0] = f32::NAN;
        let grid =
            Grid::new(GridFrame::along_axes([3; 3], DVec3::ZERO, DVec3::ONE), "s".into(), Samples::F32(values.into())).expect("valid");
        assert_eq!(grid.value_at(DVec3::splat(-0.5)), Some(([0; 3], None)));
        assert_eq!(grid.value_at(DVec3::new(0.5, -0.5, -0.5)), Some(([1, 0, 0], Some(2.0))));
    }
}
