//! Axis-aligned boxes in f64.

use glam::DVec3;

/// An axis-aligned box, `min <= max` on each axis unless it is [`Aabb::EMPTY`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// The lowest corner.
    pub min: DVec3,
    /// The highest corner.
    pub max: DVec3,
}

impl Aabb {
    /// The box of no points; extending it by a point gives that point's box.
    pub const EMPTY: Aabb = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box that holds `points`.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Aabb { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The middle of the box.
    pub fn center(&self) -> DVec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// The edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The length of the space diagonal.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// The box moved by `offset`.
    pub fn translated(&self, offset: DVec3) -> Self {
        Aabb { min: self.min + offset, max: self.max + offset }
    }
}
