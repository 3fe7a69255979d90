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
    /// The eight corners: number `x + 2 y + 4 z`, where 0 is the lower and 1 the higher side along each axis.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), self.max, self.min))
    }

    /// The t at which the line `origin + t direction` enters and leaves the box; `None` if it misses.
    pub fn line_interval(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let sides = [self.min[axis] - origin[axis], self.max[axis] - origin[axis]];
            if direction[axis] == 0.0 {
                if sides[0] > 0.0 || sides[1] < 0.0 {
                    return None;
                }
                continue;
            }
            let [a, b] = sides.map(|side| side / direction[axis]);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        (enter <= leave).then_some([enter, leave])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_cross_a_box_where_its_sides_are() {
        let b = Aabb { min: DVec3::new(-1.0, 0.0, 2.0), max: DVec3::new(3.0, 2.0, 4.0) };
        assert_eq!(b.line_interval(DVec3::new(-5.0, 1.0, 3.0), DVec3::X * 2.0), Some([2.0, 4.0]));
        assert_eq!(b.line_interval(DVec3::new(0.0, 1.0, 3.0), DVec3::NEG_Z), Some([-1.0, 1.0]), "from inside");
        assert_eq!(b.line_interval(DVec3::new(-5.0, 3.0, 3.0), DVec3::X), None);
        assert_eq!(b.line_interval(DVec3::new(-5.0, 0.0, 3.0), DVec3::new(1.0, 1.0, 0.0)), None, "past the edge");
        assert_eq!(b.corners()[5], DVec3::new(3.0, 0.0, 4.0));
    }
}
