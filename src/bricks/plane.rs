//! Where a slice lies.

use glam::DVec3;

/// A plane in index space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlicePlane {
    /// A point of it.
    pub point: DVec3,
    /// Its normal, length 1.
    pub normal: DVec3,
}

impl SlicePlane {
    /// The plane through a point; `None` where the point or the normal is not finite, or the normal has no length.
    pub fn new(point: DVec3, normal: DVec3) -> Option<Self> {
        // The square of a long or a short one may be no number.
        let normal = (normal / normal.abs().max_element()).try_normalize()?;
        point.is_finite().then_some(SlicePlane { point, normal })
    }

    /// The plane across axis 0, 1 or 2 at a position along it.
    pub fn across(axis: usize, position: f64) -> Self {
        SlicePlane { point: DVec3::AXES[axis] * position, normal: DVec3::AXES[axis] }
    }

    /// Signed distance of a point, voxels of level 0.
    pub fn distance(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.normal)
    }
}
