//! Walking from tet to tet along a ray (Garrity 1990; maths 4.2), with face tests whose signs are exact.
//!
//! A ray sees each vertex as a point of the plane perpendicular to it, itself at the origin. A face is hit when the origin lies in
//! its projected triangle, which the signs of three cross products say, one for each edge. The projected coordinates are rounded, but
//! they depend on ray and vertex only, and the signs are exact for them, ties included. So all tets around a face or an edge agree
//! on which side of it the ray passes; every tet has two hit faces or none, and no ray slips between tets or counts one twice.

use crate::geometry::FACES;
use crate::mesh::adjacency::{BoundaryFace, NONE, Tet};
use glam::DVec3;
use std::ops::ControlFlow;

/// A point of the mesh with the value there, in 32 bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    /// Position in scene units.
    pub position: DVec3,
    /// Value in data units; 0 where values live on cells.
    pub value: f64,
}

/// A ray with two axes such that (`axes[0]`, `axes[1]`, `direction`) is right-handed and orthonormal.
///
/// Its origin is the point nearest to the scene's centre, whatever the eye's distance: coordinates seen along it are then no larger than
/// the scene, and as precise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// The point nearest to (0, 0, 0), in scene units.
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    axes: [DVec3; 2],
    /// Where the eye is, as a distance from the origin along the direction; negative in front of it.
    pub eye: f64,
}

/// A vertex as a ray sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    id: u32,
    x: f64,
    y: f64,
    at: RayPoint,
}

/// A place along a ray and the scalar there.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayPoint {
    /// Distance from the ray's origin in scene units.
    pub t: f64,
    /// The value in data units.
    pub value: f64,
}

impl Ray {
    /// The ray from `eye` (scene units) along the unit vector `direction`.
    pub fn new(eye: DVec3, direction: DVec3) -> Self {
        let along = eye.dot(direction);
        let (first, second) = direction.any_orthonormal_pair();
        Ray { origin: eye - direction * along, direction, axes: [first, second], eye: along }
    }

    fn see(&self, vertices: &[Vertex], id: u32) -> Seen {
        let Vertex { position, value } = vertices[id as usize];
        let offset = position - self.origin;
        let [x, y] = self.axes.map(|axis| offset.dot(axis));
        Seen { id, x, y, at: RayPoint { t: offset.dot(self.direction), value } }
    }
}

/// Whether the edge from `p` to `q` passes the ray on its left: the exact sign of `p x q`.
///
/// On 0 the ray is taken to pass at `(e, e^2)` for an infinitely small e > 0 (maths 4.2). Coincident `p` and `q` are neither; a face
/// with such an edge is never hit whichever is said, since its other two edges then differ.
fn is_left(p: &Seen, q: &Seen) -> bool {
    let (left, right) = (p.x * q.y, p.y * q.x);
    if left != right {
        return left > right; // rounding is monotone, so the exact products differ in the same sense
    }
    let (left_rest, right_rest) = (p.x.mul_add(q.y, -left), p.y.mul_add(q.x, -right));
    if left_rest != right_rest {
        return left_rest > right_rest;
    }
    if q.y != p.y { q.y < p.y } else { q.x > p.x }
}

/// Where the ray meets a hit face. A function of the face alone, so that its two tets meet at one place with one value.
fn face_point([p, q, r]: &[Seen; 3]) -> RayPoint {
    let weight = |a: &Seen, b: &Seen| (a.x * b.y - a.y * b.x).max(0.0);
    let weights = [weight(q, r), weight(r, p), weight(p, q)];
    let sum: f64 = weights.iter().sum();
    let [u, v, w] = if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] };
    RayPoint { t: u * p.at.t + v * q.at.t + w * r.at.t, value: u * p.at.value + v * q.at.value + w * r.at.value }
}

/// A boundary face through which a ray enters a tet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Where, and with which value.
    pub at: RayPoint,
    /// The tet behind the face.
    pub tet: u32,
    /// The face's corners, each edge of the cycle passing on the left.
    triangle: [Seen; 3],
}

/// The entry of a ray through a boundary face, if it enters there (rather than leaves, or misses).
pub(super) fn enter(ray: &Ray, vertices: &[Vertex], tets: &[Tet], (tet, face): BoundaryFace) -> Option<Entry> {
    let corners = &tets[tet as usize].corners;
    let [a, b, c] = FACES[face as usize].map(|corner| ray.see(vertices, corners[corner]));
    // The order is the outward normal's: where the ray comes from outside, every edge of it passes on the right.
    let enters = !is_left(&a, &b) && !is_left(&b, &c) && !is_left(&c, &a);
    let triangle = [a, c, b];
    enters.then(|| Entry { at: face_point(&triangle), tet, triangle })
}

/// A boundary face through which a ray leaves the mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    /// Where, and with which value.
    pub at: RayPoint,
    /// The tet in front of the face.
    pub tet: u32,
    /// Its corners.
    pub corners: [u32; 3],
}

impl Entry {
    /// The face's corners.
    pub fn corners(&self) -> [u32; 3] {
        self.triangle.map(|seen| seen.id)
    }
}

/// Visits the tets from an entry to the boundary: `visit(tet, from, to)` in the order they are met. Gives where it ends.
///
/// It ends: the entry face of a tet is unique, so no tet of the chain comes twice, and the first has nothing before it.
pub(super) fn walk(
    ray: &Ray,
    vertices: &[Vertex],
    tets: &[Tet],
    entry: &Entry,
    mut visit: impl FnMut(u32, RayPoint, RayPoint) -> ControlFlow<()>,
) -> ControlFlow<(), Exit> {
    let Entry { at: mut from, mut tet, mut triangle } = *entry;
    loop {
        let Tet { corners, neighbours } = &tets[tet as usize];
        // The corner that the entry face lacks.
        let apex_id = corners.iter().fold(0, |all, id| all ^ id) ^ triangle.iter().fold(0, |all, seen| all ^ seen.id);
        let apex = ray.see(vertices, apex_id);
        // Leave by the face whose edges to the apex pass on either side; the corner opposite it is replaced by the apex.
        let replaced = match [0, 1, 2].map(|i| is_left(&triangle[i], &apex)) {
            [false, true, _] => 2,
            [_, false, true] => 0,
            [true, _, false] => 1,
            _ => return ControlFlow::Continue(Exit { at: from, tet, corners: triangle.map(|seen| seen.id) }), // all on one side: impossible while signs are exact
        };
        let opposite = triangle[replaced].id;
        triangle[replaced] = apex;
        let to = face_point(&triangle);
        visit(tet, from, to)?;
        from = to;
        let next = (0..4).find(|&i| corners[i] == opposite).map_or(NONE, |face| neighbours[face]);
        if next == NONE {
            return ControlFlow::Continue(Exit { at: to, tet, corners: triangle.map(|seen| seen.id) });
        }
        tet = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(x: f64, y: f64) -> Seen {
        Seen { id: 0, x, y, at: RayPoint { t: 0.0, value: 0.0 } }
    }

    #[test]
    fn sides_are_exact_where_rounded_products_are_equal() {
        let e = f64::EPSILON;
        // (1 + e)(1 - e) = 1 - e^2 rounds to 1.
        let (p, q) = (seen(1.0 + e, 1.0), seen(1.0, 1.0 - e));
        assert!(!is_left(&p, &q) && is_left(&q, &p));
        let (p, q) = (seen(1.0, 1.0), seen(1.0 + e, 1.0 - e + e));
        assert!(!is_left(&p, &q) && is_left(&q, &p));
    }

    #[test]
    fn ties_are_broken_as_if_the_ray_had_moved() {
        // All orders of points on lines through the origin, against the ray really moved by a small (e, e^2).
        let grid: Vec<Seen> = (-2..=2).flat_map(|x| (-2..=2).map(move |y| seen(f64::from(x), f64::from(y)))).collect();
        for p in &grid {
            for q in grid.iter().filter(|q| (q.x, q.y) != (p.x, p.y)) {
                let (x, y) = (1e-4, 1e-8);
                let moved = (p.x - x) * (q.y - y) - (p.y - y) * (q.x - x);
                assert_eq!(is_left(p, q), moved > 0.0, "({}, {}) ({}, {})", p.x, p.y, q.x, q.y);
            }
        }
    }

    #[test]
    fn axes_are_right_handed_and_the_origin_is_near_the_centre() {
        for direction in [DVec3::X, -DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(0.3, -0.5, 0.8).normalize()] {
            let ray = Ray::new(DVec3::new(1e9, 2.0, 3.0), direction);
            assert!((ray.axes[0].cross(ray.axes[1]) - direction).length() < 1e-15);
            assert!(ray.origin.dot(direction).abs() < 1e-6);
        }
    }
}
