//! Where planes cut boxes.

use super::Aabb;
use glam::DVec3;

/// A plane that is nearer than this to the end of a box, in parts of its extent, counts as lying in it.
const NEAR: f64 = 1e-9;

impl Aabb {
    /// The least and the largest of `point . direction` over the box.
    pub fn extent_along(&self, direction: DVec3) -> [f64; 2] {
        let at = self.corners().map(|corner| corner.dot(direction));
        [at.into_iter().fold(f64::INFINITY, f64::min), at.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The corners of the polygon in which the plane through `point` cuts the box, 3 to 6 of them, going round the normal; none where it
    /// does not. `normal` has length 1.
    pub fn section(&self, point: DVec3, normal: DVec3) -> Vec<DVec3> {
        let [low, high] = self.extent_along(normal);
        let (at, near) = (point.dot(normal), NEAR * (high - low));
        if !(low - near..=high + near).contains(&at) || near <= 0.0 {
            return Vec::new();
        }
        let at = at.clamp(low + near, high - near);
        let corners = self.corners();
        let edges = (0..8).flat_map(|a| [1, 2, 4].map(|axis| (a, a | axis))).filter(|(a, b)| a != b);
        let cut = |(a, b): (usize, usize)| {
            let [from, to] = [a, b].map(|i| corners[i].dot(normal) - at);
            ((from < 0.0) != (to < 0.0)).then(|| corners[a] + (corners[b] - corners[a]) * (from / (from - to)))
        };
        let mut polygon: Vec<DVec3> = edges.filter_map(cut).collect();
        let middle = polygon.iter().sum::<DVec3>() / polygon.len().max(1) as f64;
        let right = normal.any_orthonormal_vector();
        let up = normal.cross(right);
        let angle = |p: &DVec3| (*p - middle).dot(up).atan2((*p - middle).dot(right));
        polygon.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        polygon
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area of a flat polygon.
    fn area(polygon: &[DVec3]) -> f64 {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(a, b)| a.cross(*b)).sum::<DVec3>().length() / 2.0
    }

    #[test]
    fn sections_of_a_box_have_their_areas() {
        let unit = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        let diagonal = DVec3::ONE.normalize();
        let hexagon = unit.section(DVec3::splat(0.5), diagonal);
        assert!(hexagon.len() == 6 && (area(&hexagon) - 0.75 * 3f64.sqrt()).abs() < 1e-12, "{hexagon:?}");
        let triangle = unit.section(DVec3::splat(0.1), diagonal);
        assert!(triangle.len() == 3 && (area(&triangle) - 0.09 * 3f64.sqrt() / 2.0).abs() < 1e-12, "{triangle:?}");
        for x in [0.0, 0.3, 1.0] {
            let square = unit.section(DVec3::new(x, 7.0, 7.0), DVec3::NEG_X);
            assert!(square.len() == 4 && (area(&square) - 1.0).abs() < 1e-6, "{x}: {square:?}");
        }
        assert!(unit.section(DVec3::splat(1.1), DVec3::X).is_empty());
        assert_eq!(unit.extent_along(DVec3::new(1.0, -2.0, 0.5)), [-2.0, 1.5]);
    }
}
