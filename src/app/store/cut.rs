//! A slice as it is chosen.

use crate::bricks::SlicePlane;
use egui::Color32;
use glam::DVec3;

/// What the axes of the volume are called.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Colours of slices across x, y and z, and of oblique ones.
const COLORS: [[u8; 3]; 4] = [[235, 95, 90], [110, 200, 100], [95, 155, 255], [245, 190, 70]];

/// A slice as it is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Of length 1, index space. Exactly an axis for slices across one.
    pub normal: DVec3,
    /// Of slices across an axis the index along it; of others the distance from the middle of the volume along the normal, voxels.
    pub position: f64,
    /// Whether it is drawn in space.
    pub is_shown: bool,
}

impl Cut {
    /// The slice across an axis.
    pub fn across(axis: usize, position: f64) -> Self {
        Cut { normal: DVec3::AXES[axis], position, is_shown: true }
    }

    /// The axis that it lies across, if it does.
    pub fn axis(&self) -> Option<usize> {
        (0..3).find(|&axis| self.normal == DVec3::AXES[axis])
    }

    /// Where it lies.
    pub fn plane(&self, dims: [u32; 3]) -> SlicePlane {
        match self.axis() {
            Some(axis) => SlicePlane::across(axis, self.position),
            None => SlicePlane { point: middle(dims) + self.normal * self.position, normal: self.normal },
        }
    }

    /// The least and the largest position.
    pub fn range(&self, dims: [u32; 3]) -> [f64; 2] {
        match self.axis() {
            Some(axis) => [0.0, f64::from(dims[axis]) - 1.0],
            None => {
                let half = self.normal.abs().dot(DVec3::from(dims.map(f64::from))) / 2.0;
                [-half.floor(), half.floor()]
            }
        }
    }

    /// The position that puts it through a point, index space.
    pub fn position_through(&self, point: DVec3, dims: [u32; 3]) -> f64 {
        match self.axis() {
            Some(axis) => point[axis],
            None => self.normal.dot(point - middle(dims)),
        }
    }

    /// At the whole position that is nearest to another, within the volume.
    pub fn at(&self, position: f64, dims: [u32; 3]) -> Self {
        let [low, high] = self.range(dims);
        Cut { position: position.round().clamp(low, high), ..*self }
    }

    /// With another normal, through the same point of its middle as nearly as can be; `None` for one without length.
    pub fn turned(&self, normal: DVec3, dims: [u32; 3]) -> Option<Self> {
        let mut normal = normal.try_normalize()?;
        // Along an axis it is a slice across that.
        for axis in DVec3::AXES {
            if normal.dot(axis).abs() > 1.0 - 1e-12 {
                normal = axis;
            }
        }
        let plane = self.plane(dims);
        let pivot = middle(dims) - plane.normal * plane.distance(middle(dims));
        let turned = Cut { normal, ..*self };
        let [low, high] = turned.range(dims);
        let through = turned.position_through(pivot, dims);
        let position = if turned.axis().is_some() { through.round() } else { through };
        Some(Cut { position: position.clamp(low, high), ..turned })
    }

    /// What it is called.
    pub fn name(&self) -> &'static str {
        self.axis().map_or("oblique", |axis| AXES[axis])
    }

    /// Its colour.
    pub fn color(&self) -> Color32 {
        let [r, g, b] = COLORS[self.axis().unwrap_or(3)];
        Color32::from_rgb(r, g, b)
    }
}

/// The middle of a volume, index space.
pub fn middle(dims: [u32; 3]) -> DVec3 {
    (DVec3::from(dims.map(f64::from)) - 1.0) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIMS: [u32; 3] = [100, 50, 20];

    #[test]
    fn slices_stay_in_the_volume_on_whole_voxels() {
        let cut = Cut::across(1, 7.0);
        assert_eq!((cut.plane(DIMS), cut.axis(), cut.range(DIMS)), (SlicePlane::across(1, 7.0), Some(1), [0.0, 49.0]));
        assert_eq!([-3.0, 7.4, 80.0].map(|at| cut.at(at, DIMS).position), [0.0, 7.0, 49.0]);
    }

    #[test]
    fn a_turned_slice_keeps_its_middle_and_an_axis_is_an_axis() {
        let cut = Cut::across(0, 30.0).turned(DVec3::new(1.0, 1.0, 0.0), DIMS).expect("a normal");
        let pivot = DVec3::new(30.0, 24.5, 9.5);
        assert!(cut.axis().is_none() && cut.plane(DIMS).distance(pivot).abs() < 1e-9);
        assert!((cut.position_through(pivot, DIMS) - cut.position).abs() < 1e-9);
        let back = cut.turned(DVec3::new(0.0, 0.0, -2.0), DIMS).expect("a normal");
        assert_eq!((back.axis(), back.name(), back.position.fract()), (Some(2), "z", 0.0));
        assert_eq!(cut.turned(DVec3::ZERO, DIMS), None);
    }
}
