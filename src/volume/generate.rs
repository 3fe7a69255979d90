//! Volumes that carry known fields.

use super::{Grid, GridError, GridFrame, Samples};
use glam::DVec3;
use rayon::prelude::*;

/// Radius of the middle of the shell's wall, half the volume's edge being 1.
const SHELL_RADIUS: f64 = 0.78;
/// Half the wall's thickness: where the density has fallen to 1/e.
const SHELL_HALF_WIDTH: f64 = 0.045;

/// A hollow shell in the cube [-1, 1]^3: `n` points a side (at least 2), u8. With r the distance from the centre and R = 0.78 + 0.07 sin(5 a) cos(b)^5,
/// a the longitude and b the latitude, the value is 255 exp(-((r - R) / 0.045)^2), 0 in most of the volume.
pub fn shell(n: u32) -> Result<Grid, GridError> {
    let step = 2.0 / (f64::from(n.max(2)) - 1.0);
    let frame = GridFrame::along_axes([n; 3], DVec3::splat(-1.0), DVec3::splat(step));
    frame.validate()?;
    let n = n as usize;
    let mut values = vec![0u8; n * n * n];
    values.par_chunks_mut(n).enumerate().for_each(|(row, values)| {
        let (y, z) = ((row % n) as f64 * step - 1.0, (row / n) as f64 * step - 1.0);
        for (x, value) in values.iter_mut().enumerate() {
            *value = (255.0 * density(DVec3::new(x as f64 * step - 1.0, y, z))).round() as u8;
        }
    });
    Grid::new(frame, "density".into(), Samples::U8(values.into()))
}

fn density(p: DVec3) -> f64 {
    let r = p.length();
    let (longitude, latitude) = (p.y.atan2(p.x), p.z.atan2(p.x.hypot(p.y)));
    let middle = SHELL_RADIUS + 0.07 * (5.0 * longitude).sin() * latitude.cos().powi(5);
    (-((r - middle) / SHELL_HALF_WIDTH).powi(2)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shell_is_hollow() {
        let grid = shell(33).expect("valid");
        let at = |x: usize, y: usize, z: usize| grid.samples().get(x + 33 * (y + 33 * z));
        assert_eq!((at(16, 16, 16), at(0, 0, 0)), (0.0, 0.0));
        let along: Vec<f64> = (16..33).map(|x| at(x, 16, 16)).collect();
        let peak = (0..along.len()).max_by(|&a, &b| along[a].total_cmp(&along[b])).expect("values");
        assert!((peak as f64 / 16.0 - SHELL_RADIUS).abs() <= 1.0 / 16.0 && along[peak] > 150.0, "{along:?}");
        let empty = (0..grid.samples().len()).filter(|&i| grid.samples().get(i) == 0.0).count();
        assert!(empty * 10 > grid.samples().len() * 6, "{empty} of {}", grid.samples().len());
        assert!(shell(1).is_err());
    }
}
