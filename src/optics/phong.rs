//! Phong's reflection: the twin of `shaders/shared/phong.wgsl`.

use super::{Light, Style};
use glam::Vec3;

/// How much of a place's own colour is seen, and how much white is added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    /// Factor of the colour.
    pub own: f32,
    /// Added to every channel.
    pub white: f32,
}

impl Lit {
    /// A place that is not shaded.
    pub const PLAIN: Lit = Lit { own: 1.0, white: 0.0 };

    /// A place that faces along `normal`, or against it; of length 1, as is `to_eye`.
    pub fn facing(style: &Style, normal: Vec3, to_eye: Vec3) -> Lit {
        let from = Vec3::from(style.to_light);
        let to_light = if from == Vec3::ZERO { to_eye } else { from };
        let along = normal.dot(to_light);
        let reflected = (2.0 * along * normal - to_light).dot(to_eye).clamp(0.0, 1.0);
        // On the side away from the eye the light is seen through, without a highlight.
        let is_lit = along * normal.dot(to_eye) > 0.0;
        let white = if is_lit && reflected > 0.0 { style.specular * reflected.powf(style.shininess) } else { 0.0 };
        Lit { own: style.ambient + style.diffuse * along.abs(), white }
    }

    /// A place in the volume with this gradient (normalised values per cube edge): facing nothing as far as that is small.
    pub fn of_gradient(style: &Style, gradient: Vec3, to_eye: Vec3) -> Lit {
        let squared = gradient.dot(gradient);
        if squared <= 0.0 {
            return Lit::PLAIN;
        }
        let lit = Lit::facing(style, gradient / squared.sqrt(), to_eye);
        let share = squared / (squared + style.gradient_floor * style.gradient_floor);
        Lit { own: 1.0 + share * (lit.own - 1.0), white: share * lit.white }
    }

    /// The light after a stretch that was passed as if it were not shaded; `before` it was as told.
    pub fn relit(self, before: Light, after: Light) -> Light {
        let alpha = before.transmittance - after.transmittance;
        let color = [0, 1, 2].map(|c| before.color[c] + self.own * (after.color[c] - before.color[c]) + self.white * alpha);
        Light { color, ..after }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn style(to_light: [f32; 3]) -> Style {
        Style { to_light, ambient: 0.25, diffuse: 0.5, specular: 0.125, shininess: 4.0, gradient_floor: 2.0, ..Style::default() }
    }

    #[test]
    fn reflection_has_its_closed_form() {
        let slanted = |degrees: f32| Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
        for (degrees, sign) in [(0.0f32, 1.0), (30.0, 1.0), (30.0, -1.0), (60.0, 1.0), (90.0, 1.0)] {
            // With the light at the eye the reflection leaves it at twice the angle.
            let lit = Lit::facing(&style([0.0; 3]), sign * slanted(degrees), Vec3::Z);
            let (cos, twice) = (degrees.to_radians().cos(), (2.0 * degrees.to_radians()).cos().max(0.0));
            assert!((lit.own - (0.25 + 0.5 * cos)).abs() < 1e-6, "{degrees}: {lit:?}");
            assert!((lit.white - 0.125 * twice.powi(4)).abs() < 1e-6, "{degrees}: {lit:?}");
        }
        // Light from the side, the eye in the middle between them.
        let lit = Lit::facing(&style([1.0, 0.0, 0.0]), slanted(45.0), Vec3::Z);
        assert!((lit.own - (0.25 + 0.5 * 0.5f32.sqrt())).abs() < 1e-6 && (lit.white - 0.125).abs() < 1e-6, "{lit:?}");
        // From behind it shines through.
        let lit = Lit::facing(&style([0.0, 0.0, -1.0]), Vec3::Z, Vec3::Z);
        assert_eq!(lit, Lit { own: 0.75, white: 0.0 });
    }

    #[test]
    fn a_small_gradient_shades_little() {
        let lit = |size: f32| Lit::of_gradient(&style([0.0; 3]), Vec3::X * size, Vec3::Z);
        assert_eq!(lit(0.0), Lit::PLAIN);
        assert!((lit(2.0).own - (1.0 - 0.5 * 0.75)).abs() < 1e-6, "half of it at the floor");
        assert!((lit(2e3).own - 0.25).abs() < 1e-5, "all of it far above");
    }

    #[test]
    fn what_was_passed_is_shaded_afterwards() {
        let (before, after) = (Light { color: [0.1, 0.2, 0.3], transmittance: 0.8 }, Light { color: [0.3, 0.2, 0.5], transmittance: 0.5 });
        assert_eq!(Lit::PLAIN.relit(before, after), after);
        let relit = Lit { own: 0.5, white: 0.1 }.relit(before, after);
        for (found, expected) in relit.color.into_iter().zip([0.1 + 0.1 + 0.03, 0.2 + 0.03, 0.3 + 0.1 + 0.03]) {
            assert!((found - expected).abs() < 1e-6);
        }
        assert_eq!(relit.transmittance, 0.5);
    }
}
