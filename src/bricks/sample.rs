//! The value of a level at a position, from its voxels.

use super::BrickKey;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What lies between voxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// The value of the nearest voxel, of two as near that with the larger index.
    Nearest,
    /// Trilinear; where a voxel that has a part in it is missing, the value is.
    #[default]
    Linear,
}

impl Interpolation {
    /// The value of a level of `dims` voxels at a position in index space; `None` outside the volume, which reaches half a voxel of level 0
    /// beyond the first and last, or where `voxel` gives none.
    pub fn sample(self, at: DVec3, level: u8, dims: [[u32; 3]; 2], mut voxel: impl FnMut([u32; 3]) -> Option<f64>) -> Option<f64> {
        let [whole, dims] = dims;
        if (0..3).any(|axis| !(-0.5..f64::from(whole[axis]) - 0.5).contains(&at[axis])) {
            return None;
        }
        let size = f64::from(level).exp2();
        let last = DVec3::from(dims.map(|n| f64::from(n) - 1.0));
        let u = ((at + 0.5) / size - 0.5).clamp(DVec3::ZERO, last);
        match self {
            Interpolation::Nearest => voxel((u + 0.5).floor().min(last).to_array().map(|u| u as u32)),
            Interpolation::Linear => {
                let low = u.floor();
                let f = (u - low).to_array();
                let low = low.to_array().map(|u| u as u32);
                let mut sum = 0.0;
                for corner in 0..8u32 {
                    let bit = |axis: usize| corner >> axis & 1;
                    let weight: f64 = (0..3).map(|axis| if bit(axis) == 1 { f[axis] } else { 1.0 - f[axis] }).product();
                    if weight > 0.0 {
                        sum += weight * voxel([0, 1, 2].map(|axis| low[axis] + bit(axis)))?;
                    }
                }
                Some(sum)
            }
        }
    }
}

/// The brick of a level that holds a voxel, and the voxel's number in it.
pub fn brick_of(level: u8, voxel: [u32; 3]) -> (BrickKey, usize) {
    let edge = super::BRICK_EDGE;
    let [x, y, z] = voxel.map(|v| (v % edge) as usize);
    let edge_usize = edge as usize;
    (BrickKey { level, at: voxel.map(|v| v / edge) }, x + edge_usize * (y + edge_usize * z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_is_itself_between_voxels_of_any_level() {
        let whole = [100, 80, 60];
        let field = |p: DVec3| p.x + 2.0 * p.y - 4.0 * p.z;
        for level in 0..3u8 {
            let size = f64::from(level).exp2();
            let dims = whole.map(|n| n / size as u32);
            let voxel = |v: [u32; 3]| Some(field((DVec3::from(v.map(f64::from)) + 0.5) * size - 0.5));
            for at in [DVec3::new(10.25, 20.5, 30.75), DVec3::new(50.0, 3.0, 4.0)] {
                let found = Interpolation::Linear.sample(at, level, [whole, dims], voxel).expect("inside");
                assert!((found - field(at)).abs() < 1e-9, "level {level}: {found}");
            }
        }
    }

    #[test]
    fn the_volume_ends_half_a_voxel_beyond_its_last() {
        let dims = [[4, 4, 4]; 2];
        let sample = |how: Interpolation, x: f64| how.sample(DVec3::new(x, 1.0, 1.0), 0, dims, |v| Some(f64::from(v[0])));
        let both = [Interpolation::Nearest, Interpolation::Linear];
        assert_eq!(both.map(|how| sample(how, -0.5)), [Some(0.0); 2]);
        assert_eq!(both.map(|how| sample(how, 3.49)), [Some(3.0); 2]);
        assert_eq!(both.map(|how| sample(how, 3.5)), [None; 2]);
        assert_eq!(both.map(|how| sample(how, 1.5)), [Some(2.0), Some(1.5)]);
        // What has no part in a value is not asked for.
        let missing = |v: [u32; 3]| (v[0] != 2).then_some(7.0);
        assert_eq!(Interpolation::Linear.sample(DVec3::new(1.0, 1.0, 1.0), 0, dims, missing), Some(7.0));
        assert_eq!(Interpolation::Linear.sample(DVec3::new(1.5, 1.0, 1.0), 0, dims, missing), None);
    }

    #[test]
    fn a_voxel_has_its_place_in_a_brick() {
        assert_eq!(brick_of(2, [64, 1, 130]), (BrickKey { level: 2, at: [1, 0, 2] }, 64 + 64 * 64 * 2));
    }
}
