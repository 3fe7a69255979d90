//! The nearest place where a ray meets a surface.

use super::BoundarySurface;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

impl BoundarySurface {
    /// The least t >= 0 at which `origin + t direction` meets a face, in the surface's own coordinates (edges of the root cube). Looks at every
    /// face, a million in some milliseconds: for a click, not for pictures.
    pub fn nearest_hit(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let corner = |vertex: u32| Vec3::from(self.vertices()[vertex as usize].position).as_dvec3() - origin;
        let hits = self.faces().par_iter().filter_map(|face| {
            // Möller & Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
            let [a, b, c] = face.vertices.map(corner);
            let (ab, ac) = (b - a, c - a);
            let p = direction.cross(ac);
            let determinant = ab.dot(p);
            let u = (-a).dot(p) / determinant;
            let q = (-a).cross(ab);
            let (v, t) = (direction.dot(q) / determinant, ac.dot(q) / determinant);
            (determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
        });
        hits.min_by(f64::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_the_near_side_of_a_box_and_from_inside_the_far_one() {
        let corner = |k: usize| DVec3::new(0.2 + 0.5 * (k & 1) as f64, 0.25 + 0.5 * (k >> 1 & 1) as f64, 0.1 + 0.3 * (k >> 2) as f64);
        let surface = BoundarySurface::of_box(&std::array::from_fn(corner), DVec3::ZERO, 1.0);
        let direction = DVec3::new(1.0, 0.1, 0.05).normalize();
        let at = |origin: DVec3| surface.nearest_hit(origin, direction).map(|t| origin + direction * t);
        let outside = DVec3::new(-3.0, 0.1, 0.1);
        assert!(at(outside).is_some_and(|p| (p.x - 0.2).abs() < 1e-6), "{:?}", at(outside));
        let inside = DVec3::new(0.4, 0.4, 0.2);
        assert!(at(inside).is_some_and(|p| (p.x - 0.7).abs() < 1e-6), "{:?}", at(inside));
        assert_eq!(at(DVec3::new(0.9, 0.4, 0.2)), None, "nothing ahead");
        assert_eq!(at(DVec3::new(-3.0, 2.0, 0.2)), None, "beside it");
    }
}
