//! One segment with linear extinction and luminance, in f32: the twin of `shaders/shared/segment.wgsl`.

use super::{PSI_SIZE, psi_table};

/// How much of the front's and the back's luminance a segment adds, and its opacity; `front + back = alpha`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight of the luminance at the front.
    pub front: f32,
    /// Weight of the luminance at the back.
    pub back: f32,
    /// Opacity of the segment.
    pub alpha: f32,
}

/// `1 - exp(-g)` for g >= 0 without cancellation: f32 has no expm1 on the GPU, so below 1/2 this is the series in nested form.
pub fn em1(g: f32) -> f32 {
    if g >= 0.5 {
        return 1.0 - (-g).exp();
    }
    let tail = 1.0 - g * (1.0 / 6.0) * (1.0 - g * (1.0 / 7.0) * (1.0 - g * (1.0 / 8.0)));
    g * (1.0 - g * (1.0 / 2.0) * (1.0 - g * (1.0 / 3.0) * (1.0 - g * (1.0 / 4.0) * (1.0 - g * (1.0 / 5.0) * tail))))
}

/// The weights of a segment whose extinction times length goes linearly from `a` >= 0 at the front to `b` >= 0 at the back (maths 2.5).
/// Thin segments integrate `1 - exp` directly, since 1 - Psi would cancel; thick ones read the table.
pub fn segment(a: f32, b: f32) -> Weights {
    let mean = 0.5 * (a + b);
    let alpha = em1(mean);
    let front = if mean <= 0.5 {
        // 4-point Gauss-Legendre on [0, 1].
        const U: [f32; 4] = [0.069_431_84, 0.330_009_5, 0.669_990_5, 0.930_568_16];
        const W: [f32; 4] = [0.173_927_42, 0.326_072_58, 0.326_072_58, 0.173_927_42];
        let part = |i: usize| W[i] * em1(depth_to(U[i], a, b));
        part(0) + part(1) + part(2) + part(3)
    } else {
        1.0 - psi_lookup(1.0 / (1.0 + 0.5 * a).sqrt(), 1.0 / (1.0 + 0.5 * b).sqrt())
    };
    Weights { front, back: (alpha - front).max(0.0), alpha }
}

/// Optical depth from the front of a segment to its part u.
fn depth_to(u: f32, a: f32, b: f32) -> f32 {
    u * (a + (b - a) * 0.5 * u)
}

/// Bilinear look-up in [`psi_table`] at axis positions in [0, 1].
fn psi_lookup(s_a: f32, s_b: f32) -> f32 {
    const LAST: f32 = (PSI_SIZE - 1) as f32;
    let (x, y) = (s_a * LAST, s_b * LAST);
    let (i, j) = ((x as usize).min(PSI_SIZE - 2), (y as usize).min(PSI_SIZE - 2));
    let (fx, fy) = (x - i as f32, y - j as f32);
    let table = psi_table();
    let at = i + PSI_SIZE * j;
    let low = table[at] + fx * (table[at + 1] - table[at]);
    let high = table[at + PSI_SIZE] + fx * (table[at + PSI_SIZE + 1] - table[at + PSI_SIZE]);
    low + fy * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::psi;
    use proptest::prelude::*;

    #[test]
    fn thin_segments_are_accurate_relatively() {
        // (a, b, w_f, w_b, zeta) of maths 2.4.
        for (a, b, front, back, zeta) in [
            (1e-6, 3e-6, 8.33332816666915e-7, 1.16666518333442e-6, 0.999998000002),
            (2e-4, 0.0, 6.66640000761888e-5, 3.33310000904737e-5, 0.999900004999833),
            (0.01, 0.01, 4.98337491680536e-3, 4.96679133402659e-3, 0.990049833749168),
            (0.0, 0.1, 0.016419614157041, 0.032350961342245, 0.951229424500714),
            (0.4, 0.1, 0.136972260237587, 0.084226956691008, 0.778800783071405f64),
        ] {
            let w = segment(a, b);
            let relative = |value: f32, expected: f64| (f64::from(value) / expected - 1.0).abs();
            assert!(relative(w.front, front) < 2e-6 && relative(w.back, back) < 4e-6, "({a}, {b}): {w:?}");
            assert!(relative(w.alpha, 1.0 - zeta) < 1e-5, "({a}, {b}): {w:?}");
        }
    }

    #[test]
    fn em1_has_no_seam() {
        for g in [0.0f32, 1e-20, 1e-6, 0.1, 0.499_999_97, 0.5, 3.0, 100.0, 1e30] {
            let expected = -(-f64::from(g)).exp_m1();
            assert!((f64::from(em1(g)) - expected).abs() <= 3e-7 * expected, "em1({g}) = {}", em1(g));
        }
    }

    proptest! {
        #[test]
        fn weights_follow_psi(a in 0.0..1e4f64, b in 0.0..1e4f64, scale in -6.0..0.0f64) {
            let (a, b) = (a * 10f64.powf(scale), b * 10f64.powf(scale));
            let w = segment(a as f32, b as f32);
            prop_assert!((f64::from(w.front) - (1.0 - psi(a, b))).abs() < 1.3e-4, "the table's bound");
            prop_assert!(w.back >= 0.0 && w.front >= 0.0 && (w.front + w.back - w.alpha).abs() < 1.3e-4);
        }
    }
}
