//! Tetrahedra: volume, barycentric coordinates, nearest points, gradients.

use glam::{DMat3, DVec3};

/// The corners of face `i`, the one opposite corner `i`, ordered so that the normal `(b - a) x (c - a)` points out of a positive tet.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Six times the volume is the determinant; this is the signed volume, positive for VTK's corner order.
#[inline]
pub fn signed_volume(p: &[DVec3; 4]) -> f64 {
    (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6.0
}

/// Whether a tet has no volume worth dividing by: `|det| <= 1e-13 L^3`, L the largest edge component at corner 0 (maths 4.1).
pub fn is_degenerate(p: &[DVec3; 4]) -> bool {
    let longest = (1..4).map(|i| (p[i] - p[0]).abs().max_element()).fold(0.0, f64::max);
    let determinant = (signed_volume(p) * 6.0).abs();
    determinant.is_nan() || determinant <= 1e-13 * longest.powi(3)
}

/// Barycentric coordinates of `x` in a tet; they sum to 1 and are all >= 0 inside. Not finite for a zero-volume tet.
pub fn barycentric(x: DVec3, p: &[DVec3; 4]) -> [f64; 4] {
    let edges = DMat3::from_cols(p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let b = edges.inverse() * (x - p[0]);
    [1.0 - b.x - b.y - b.z, b.x, b.y, b.z]
}

/// The gradient of the linear field with values `s` at the corners. Not finite for a zero-volume tet.
#[inline]
pub fn gradient(p: &[DVec3; 4], s: &[f64; 4]) -> DVec3 {
    // The gradient of corner i's barycentric coordinate is face i's inward normal over six volumes.
    let (e1, e2, e3) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let (n1, n2, n3) = (e2.cross(e3), e3.cross(e1), e1.cross(e2));
    (n1 * (s[1] - s[0]) + n2 * (s[2] - s[0]) + n3 * (s[3] - s[0])) / e1.dot(n1)
}

/// The point of triangle `a b c` nearest to `x` (Ericson, Real-Time Collision Detection, 5.1.5), as weights of the three corners.
pub fn closest_point_on_triangle(x: DVec3, a: DVec3, b: DVec3, c: DVec3) -> [f64; 3] {
    let (ab, ac, ax) = (b - a, c - a, x - a);
    let (d1, d2) = (ab.dot(ax), ac.dot(ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bx = x - b;
    let (d3, d4) = (ab.dot(bx), ac.dot(bx));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cx = x - c;
    let (d5, d6) = (ab.dot(cx), ac.dot(cx));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && (d4 - d3) >= 0.0 && (d5 - d6) >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

/// The point of a tet nearest to `x`, as weights of the four corners, and its distance to `x` (0 inside).
pub fn closest_point(x: DVec3, p: &[DVec3; 4]) -> ([f64; 4], f64) {
    let inside = barycentric(x, p);
    if inside.iter().all(|&w| w >= 0.0) {
        return (inside, 0.0);
    }
    closest_point_beyond(x, p, 0b1111)
}

/// [`closest_point`] where `x` is known to lie outside, beyond the faces whose bits are set: the nearest point is on one of those.
pub fn closest_point_beyond(x: DVec3, p: &[DVec3; 4], faces: u8) -> ([f64; 4], f64) {
    if faces == 0 {
        return closest_point(x, p);
    }
    let mut best = ([1.0, 0.0, 0.0, 0.0], f64::INFINITY);
    for (_, [a, b, c]) in FACES.into_iter().enumerate().filter(|(i, _)| faces >> i & 1 == 1) {
        let w = closest_point_on_triangle(x, p[a], p[b], p[c]);
        let distance = (p[a] * w[0] + p[b] * w[1] + p[c] * w[2]).distance(x);
        if distance < best.1 {
            let mut weights = [0.0; 4];
            (weights[a], weights[b], weights[c]) = (w[0], w[1], w[2]);
            best = (weights, distance);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];

    #[test]
    fn unit_tet_has_a_sixth_and_faces_point_outwards() {
        assert!((signed_volume(&UNIT) - 1.0 / 6.0).abs() < 1e-16);
        for (i, [a, b, c]) in FACES.into_iter().enumerate() {
            let normal = (UNIT[b] - UNIT[a]).cross(UNIT[c] - UNIT[a]);
            assert!(normal.dot(UNIT[i] - UNIT[a]) < 0.0, "face {i} points to its opposite corner");
        }
    }

    #[test]
    fn linear_fields_come_back() {
        let g = DVec3::new(0.3, -2.0, 0.7);
        let p = [DVec3::new(1.0, 2.0, 0.5), DVec3::new(2.0, 2.1, 0.4), DVec3::new(1.2, 3.0, 0.1), DVec3::new(0.9, 2.2, 1.9)];
        let s = p.map(|q| g.dot(q) + 5.0);
        assert!((gradient(&p, &s) - g).length() < 1e-12);
        let x = DVec3::new(1.2, 2.3, 0.7);
        let w = barycentric(x, &p);
        assert!(((0..4).map(|i| w[i] * s[i]).sum::<f64>() - (g.dot(x) + 5.0)).abs() < 1e-12);
    }

    #[test]
    fn nearest_points_of_the_unit_tet() {
        for (x, nearest) in [
            (DVec3::splat(0.1), DVec3::splat(0.1)),
            (DVec3::new(-1.0, 0.25, 0.25), DVec3::new(0.0, 0.25, 0.25)),
            (DVec3::new(2.0, -1.0, -1.0), DVec3::X),
            (DVec3::splat(1.0), DVec3::splat(1.0 / 3.0)),
            (DVec3::new(0.5, -1.0, -1.0), DVec3::new(0.5, 0.0, 0.0)),
        ] {
            let (w, distance) = closest_point(x, &UNIT);
            let y = UNIT[0] * w[0] + UNIT[1] * w[1] + UNIT[2] * w[2] + UNIT[3] * w[3];
            assert!((y - nearest).length() < 1e-12, "{x} -> {y}");
            assert!((distance - x.distance(nearest)).abs() < 1e-12);
        }
    }

    #[test]
    fn flat_tets_are_degenerate_whatever_their_scale() {
        for scale in [1e-9, 1.0, 1e9] {
            assert!(is_degenerate(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y].map(|p| p * scale)));
            assert!(!is_degenerate(&UNIT.map(|p| p * scale)));
        }
    }
}
