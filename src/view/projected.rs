//! Where things are seen: from points of the world to places in the image, and back along rays. Image positions are in image heights from
//! the middle of the image, x to the right, y up.

use super::{Camera, Projection};
use glam::{DVec2, DVec3};

/// Segments are cut where they come this near to a perspective eye, in parts of its distance to the target.
const NEAR: f64 = 1e-6;

impl Camera {
    /// Where a point is seen; `None` beside or behind the eye of a perspective camera. A parallel camera sees what lies behind it, too.
    pub fn seen_at(&self, point: DVec3) -> Option<DVec2> {
        let [forward, right, up] = self.axes();
        let from_eye = point - self.eye;
        let across = DVec2::new(from_eye.dot(right), from_eye.dot(up));
        match self.projection {
            Projection::Parallel { view_height } => Some(across / view_height),
            Projection::Perspective { fov_y_degrees } => {
                let depth = from_eye.dot(forward);
                (depth > 0.0).then(|| across / (2.0 * (fov_y_degrees.to_radians() / 2.0).tan() * depth))
            }
        }
    }

    /// The ends of a segment as they are seen; cut short where it passes the eye, `None` if nothing is left.
    pub fn seen_segment(&self, [a, b]: [DVec3; 2]) -> Option<[DVec2; 2]> {
        if matches!(self.projection, Projection::Parallel { .. }) {
            return Some([self.seen_at(a)?, self.seen_at(b)?]);
        }
        let [forward, ..] = self.axes();
        let near = NEAR * self.eye.distance(self.target);
        let [da, db] = [a, b].map(|p| (p - self.eye).dot(forward));
        if da.max(db) <= near {
            return None;
        }
        let cut = |from: DVec3, d: f64, to: DVec3, e: f64| if d < near { to + (from - to) * ((e - near) / (e - d)) } else { from };
        Some([self.seen_at(cut(a, da, b, db))?, self.seen_at(cut(b, db, a, da))?])
    }

    /// The ray of an image position: origin and unit direction in world coordinates.
    pub fn ray_at(&self, at: DVec2) -> (DVec3, DVec3) {
        let [forward, right, up] = self.axes();
        let across = right * at.x + up * at.y;
        match self.projection {
            Projection::Parallel { view_height } => (self.eye + across * view_height, forward),
            Projection::Perspective { fov_y_degrees } => {
                (self.eye, (forward + across * (2.0 * (fov_y_degrees.to_radians() / 2.0).tan())).normalize())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 2] {
        let perspective = Camera {
            eye: DVec3::new(3.0, -4.0, 2.0),
            target: DVec3::new(0.5, 0.25, -0.125),
            up: DVec3::new(0.1, 0.2, 1.0),
            projection: Projection::Perspective { fov_y_degrees: 50.0 },
        };
        [perspective, Camera { projection: Projection::Parallel { view_height: 3.0 }, ..perspective }]
    }

    #[test]
    fn points_are_seen_where_their_rays_are_marched() {
        let (width, height) = (300, 200);
        for camera in cameras() {
            let frame = camera.frame(DVec3::ZERO, width, height);
            for (column, row) in [(0, 0), (299, 0), (150, 100), (7, 180)] {
                let (origin, direction) = frame.ray(column, row);
                let seen = camera.seen_at(origin + direction * 3.0).expect("before the eye") * f64::from(height);
                let at = DVec2::new(150.0 + seen.x, 100.0 - seen.y);
                assert!(at.distance(DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5)) < 1e-9, "{at}");
                let (o, d) = camera.ray_at(seen / f64::from(height));
                assert!(o.distance(origin) < 1e-12 && d.distance(direction) < 1e-12);
            }
        }
    }

    #[test]
    fn segments_end_before_the_eye() {
        let camera =
            Camera { eye: DVec3::ZERO, target: DVec3::X, up: DVec3::Z, projection: Projection::Perspective { fov_y_degrees: 90.0 } };
        let [a, b] = camera.seen_segment([DVec3::new(2.0, 1.0, 0.0), DVec3::new(-2.0, 1.0, 1.0)]).expect("half of it");
        assert!(a.distance(DVec2::new(-0.25, 0.0)) < 1e-12, "to the left, a quarter of the height: {a}");
        assert!((b.x / b.y + 2.0).abs() < 1e-5 && b.x < -1e4, "towards where the segment passes beside the eye: {b}");
        assert_eq!(camera.seen_segment([DVec3::new(-1.0, 0.0, 0.0), DVec3::new(-2.0, 5.0, 0.0)]), None);
        assert_eq!(camera.seen_at(-DVec3::X), None);
    }
}
