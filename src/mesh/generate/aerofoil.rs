//! A Joukowski aerofoil and the exact potential flow around it.
//!
//! The map `z = zeta + 1 / zeta` takes the circle of radius `R` around `mu` through `zeta = 1` to an aerofoil with a cusped trailing edge
//! at `z = 2`. With `w = zeta - mu`, the flow around the circle at incidence `alpha` has the complex velocity
//! `exp(-i alpha) (w - w1) (w - w2) / w^2`, where `w1` and `w2` are its stagnation points. Kutta's condition puts `w1` on the trailing edge,
//! `w1 = 1 - mu = R exp(-i beta)`; then `w2 = -R exp(i (2 alpha + beta))` and the circulation is `4 pi R sin(alpha + beta)`. Divided by
//! `dz/dzeta = (zeta - 1) (zeta + 1) / zeta^2`, the factor `w - w1 = zeta - 1` cancels exactly, and what is left,
//!
//! ```text
//! u - i v = exp(-i alpha) (w - w2) zeta^2 / (w^2 (zeta + 1)),
//! ```
//!
//! is finite everywhere outside the circle and on it, the trailing edge included (Milne-Thomson, Theoretical Aerodynamics, chapter 7).
//! Complex numbers are [`DVec2`]; their product is [`DVec2::rotate`].

use glam::DVec2;

/// A Joukowski section in its chord frame: leading edge near (0, 0), trailing edge at exactly (1, 0), lengths in chords.
#[derive(Debug, Clone)]
pub struct Aerofoil {
    /// Centre `mu` of the circle.
    center: DVec2,
    /// Its radius `R`.
    radius: f64,
    /// Length of the chord in the `z` plane.
    chord: f64,
    /// `exp(i alpha)`: where the free stream goes to.
    stream: DVec2,
    /// The stagnation point `w2` near the leading edge, relative to the circle's centre.
    nose_stagnation: DVec2,
}

impl Aerofoil {
    /// A section about `1.3 thickness` of its chord thick, its mean line rising `camber / 2` of the chord, at an angle of attack in degrees.
    pub fn new(thickness: f64, camber: f64, incidence_degrees: f64) -> Self {
        let center = DVec2::new(-thickness, camber);
        let trailing = DVec2::X - center;
        let nose = 1.0 + 2.0 * thickness; // the circle's other crossing of the real axis is at -nose
        let stream = DVec2::from_angle(incidence_degrees.to_radians());
        let radius = trailing.length();
        let nose_stagnation = -stream.rotate(stream).rotate(conjugate(trailing));
        Aerofoil { center, radius, chord: 2.0 + nose + 1.0 / nose, stream, nose_stagnation }
    }

    /// The direction of the free stream in the chord frame, a unit vector.
    pub fn stream(&self) -> DVec2 {
        self.stream
    }

    /// The circulation, clockwise positive, in chords times the speed of the free stream; the lift coefficient is twice that.
    pub fn circulation(&self) -> f64 {
        let trailing = DVec2::X - self.center;
        let sin_alpha_plus_beta = self.stream.rotate(conjugate(trailing)).y / self.radius;
        4.0 * std::f64::consts::PI * self.radius * sin_alpha_plus_beta / self.chord
    }

    /// The point of the contour that the circle's point at `turn` maps to; a turn of 0 or 1 is the trailing edge, counter-clockwise between.
    pub fn contour(&self, turn: f64) -> DVec2 {
        let w = DVec2::from_angle(turn * std::f64::consts::TAU).rotate(DVec2::X - self.center);
        let zeta = w + self.center;
        (zeta + reciprocal(zeta) - DVec2::new(2.0, 0.0)) / self.chord + DVec2::X
    }

    /// How far outside the contour a point lies, seen in the circle's plane: `|w| / R - 1`, 0 on the contour, negative inside it.
    pub fn clearance(&self, point: DVec2) -> f64 {
        (self.circle_point(point) - self.center).length() / self.radius - 1.0
    }

    /// The velocity in units of the free stream at a point outside the aerofoil or on it.
    pub fn velocity(&self, point: DVec2) -> DVec2 {
        let zeta = self.circle_point(point);
        let w = zeta - self.center;
        let numerator = conjugate(self.stream).rotate(w - self.nose_stagnation).rotate(zeta).rotate(zeta);
        let denominator = w.rotate(w).rotate(zeta + DVec2::X);
        conjugate(numerator.rotate(reciprocal(denominator)))
    }

    /// The point `zeta` of the circle's plane that maps to `point`. Of the two, `zeta` and `1 / zeta`, exactly one is not inside the circle.
    fn circle_point(&self, point: DVec2) -> DVec2 {
        let half = ((point - DVec2::X) * self.chord + DVec2::new(2.0, 0.0)) / 2.0;
        let root = square_root(half.rotate(half) - DVec2::X);
        let [near, far] = [half - root, half + root];
        if near.distance_squared(self.center) > far.distance_squared(self.center) { near } else { far }
    }
}

fn conjugate(z: DVec2) -> DVec2 {
    DVec2::new(z.x, -z.y)
}

fn reciprocal(z: DVec2) -> DVec2 {
    conjugate(z) / z.length_squared()
}

/// A square root of a complex number by real square roots alone, which every machine rounds alike.
fn square_root(z: DVec2) -> DVec2 {
    let modulus = z.length();
    let (re, im) = (((modulus + z.x) / 2.0).max(0.0).sqrt(), ((modulus - z.x) / 2.0).max(0.0).sqrt());
    // The smaller part by division, so that it loses no digits.
    match () {
        _ if modulus == 0.0 => DVec2::ZERO,
        _ if z.x >= 0.0 => DVec2::new(re, z.y / (2.0 * re)),
        _ => DVec2::new(z.y.abs() / (2.0 * im), im.copysign(z.y)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aerofoil() -> Aerofoil {
        Aerofoil::new(0.1, 0.08, 8.0)
    }

    #[test]
    fn no_flow_crosses_the_surface() {
        let foil = aerofoil();
        for k in 1..400 {
            let turn = k as f64 / 400.0;
            let tangent = (foil.contour(turn + 1e-6) - foil.contour(turn - 1e-6)).normalize();
            let across = foil.velocity(foil.contour(turn)).perp_dot(tangent);
            assert!(across.abs() < 1e-6, "{across} at {turn}");
        }
    }

    #[test]
    fn the_flow_leaves_the_trailing_edge_smoothly() {
        let foil = aerofoil();
        assert_eq!(foil.contour(0.0).distance(DVec2::X), 0.0);
        let (at, above, below) = (foil.velocity(DVec2::X), foil.velocity(foil.contour(1e-4)), foil.velocity(foil.contour(1.0 - 1e-4)));
        assert!(at.length() > 0.5 && at.length() < 1.2, "{at}");
        assert!((at - above).length() < 2e-3 && (at - below).length() < 2e-3, "{at} {above} {below}");
    }

    #[test]
    fn far_away_is_the_free_stream_and_a_vortex() {
        let foil = aerofoil();
        for k in 0..8 {
            let direction = DVec2::from_angle(k as f64);
            let far = (foil.velocity(direction * 1e4) - foil.stream()) * 1e4;
            let vortex = -direction.perp() * foil.circulation() / std::f64::consts::TAU; // clockwise
            assert!((far - vortex).length() < 1e-3, "{far} {vortex}");
        }
    }

    #[test]
    fn the_circulation_is_the_contour_integral() {
        let foil = aerofoil();
        let integral = |radius: f64| -> f64 {
            let n = 2000;
            let term = |k: usize| {
                let out = DVec2::from_angle(std::f64::consts::TAU * k as f64 / n as f64);
                foil.velocity(DVec2::new(0.5, 0.0) + out * radius).dot(-out.perp()) * radius * std::f64::consts::TAU / n as f64
            };
            (0..n).map(term).sum()
        };
        assert!((integral(0.8) - foil.circulation()).abs() < 1e-9);
        assert!((integral(5.0) - foil.circulation()).abs() < 1e-9);
        let alpha_plus_beta = 8f64.to_radians() + (0.08f64 / (1.1f64.powi(2) + 0.08f64.powi(2)).sqrt()).asin();
        let textbook = 4.0 * std::f64::consts::PI * (1.1f64.powi(2) + 0.08f64.powi(2)).sqrt() * alpha_plus_beta.sin() / foil.chord;
        assert!((foil.circulation() - textbook).abs() < 1e-12);
    }

    #[test]
    fn the_flow_has_no_divergence_and_no_curl() {
        let foil = aerofoil();
        let h = 1e-5;
        for k in 0..200 {
            let turn = k as f64 / 200.0;
            let point = DVec2::new(0.5, 0.0) + DVec2::from_angle(turn * 6.3) * DVec2::new(0.62, 0.15 + turn);
            let dx = (foil.velocity(point + DVec2::X * h) - foil.velocity(point - DVec2::X * h)) / (2.0 * h);
            let dy = (foil.velocity(point + DVec2::Y * h) - foil.velocity(point - DVec2::Y * h)) / (2.0 * h);
            assert!((dx.x + dy.y).abs() < 1e-6 && (dx.y - dy.x).abs() < 1e-6, "{point}: {dx} {dy}");
        }
    }

    #[test]
    fn clearance_tells_outside_from_contour() {
        let foil = aerofoil();
        for k in 0..100 {
            let on = foil.contour(k as f64 / 100.0);
            assert!(foil.clearance(on).abs() < 1e-7, "{on}");
        }
        assert!((1..20).all(|k| foil.clearance((foil.contour(k as f64 / 40.0) + foil.contour(1.0 - k as f64 / 40.0)) / 2.0) < 0.0));
        assert!(foil.clearance(DVec2::new(0.5, 0.2)) > 0.1 && foil.clearance(DVec2::new(0.9, -0.01)) > 0.0);
    }
}
