//! Emission and absorption over segments on which extinction and colour are linear: partial pre-integration (Moreland & Angel 2004;
//! maths 2), by quadrature in f64 without tables.

use super::transfer::Sample;

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1], 4 points.
const GAUSS_4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_8),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_2),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_2),
    (0.930_568_155_797_026_2, 0.173_927_422_568_726_8),
];

/// The same with 10 points.
const GAUSS_10: [(f64, f64); 10] = [
    (0.013_046_735_741_414_13, 0.033_335_672_154_344_07),
    (0.067_468_316_655_507_73, 0.074_725_674_575_290_2),
    (0.160_295_215_850_487_78, 0.109_543_181_257_991),
    (0.283_302_302_935_376_4, 0.134_633_359_654_998_26),
    (0.425_562_830_509_184_4, 0.147_762_112_357_376_4),
    (0.574_437_169_490_815_6, 0.147_762_112_357_376_4),
    (0.716_697_697_064_623_6, 0.134_633_359_654_998_26),
    (0.839_704_784_149_512_2, 0.109_543_181_257_991),
    (0.932_531_683_344_492_3, 0.074_725_674_575_290_2),
    (0.986_953_264_258_585_9, 0.033_335_672_154_344_07),
];

/// Up to this depth 4 points give f64's precision.
const THIN: f64 = 0.02;

/// Beyond this depth nothing is seen: e^-40 is 4e-18.
const OPAQUE: f64 = 40.0;

/// Psi(a, b), the mean over u in [0, 1] of exp(-(a u + (b - a) u^2 / 2)), for a, b >= 0 (maths 2.3; error 3e-16).
///
/// `a` and `b` are the optical depths that the whole segment would have with the extinction at its front and at its back.
fn psi(a: f64, b: f64) -> f64 {
    let (depth, slope) = ((a + b) / 2.0, b - a);
    let quadrature = |rule: &[(f64, f64)], from: f64, to: f64| {
        let value = |&(node, weight): &(f64, f64)| {
            let u = from + (to - from) * node;
            weight * (-(a + slope * u / 2.0) * u).exp()
        };
        (to - from) * rule.iter().map(value).sum::<f64>()
    };
    if depth <= THIN {
        return quadrature(&GAUSS_4, 0.0, 1.0);
    }
    // Parts of equal optical depth, at most 1 each.
    let top = depth.min(OPAQUE);
    let parts = top.ceil();
    let (mut sum, mut from) = (0.0, 0.0);
    for part in 1..=parts as u32 {
        let g = top * f64::from(part) / parts;
        let whole = depth <= OPAQUE && f64::from(part) == parts;
        let to = if whole { 1.0 } else { 2.0 * g / (a + (a * a + 2.0 * slope * g).max(0.0).sqrt()) };
        sum += quadrature(&GAUSS_10, from, to);
        from = to;
    }
    sum
}

/// What a ray has gathered so far, front to back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Light {
    /// Premultiplied RGB.
    pub color: [f64; 3],
    /// The share of what lies behind that is still seen.
    pub transmittance: f64,
}

impl Light {
    /// Nothing gathered, all still seen.
    pub const NONE: Light = Light { color: [0.0; 3], transmittance: 1.0 };

    /// Adds a segment of `length` world units behind what there is; extinction and colour are linear between its ends.
    pub fn add(&mut self, front: &Sample, back: &Sample, length: f64) {
        let (a, b) = (front.extinction * length, back.extinction * length);
        if a + b <= 0.0 {
            return;
        }
        let through = (-(a + b) / 2.0).exp();
        if front.color == back.color {
            let opacity = self.transmittance * -(-(a + b) / 2.0).exp_m1();
            (0..3).for_each(|c| self.color[c] += opacity * front.color[c]);
        } else {
            let psi = psi(a, b);
            let (front_weight, back_weight) = (self.transmittance * (1.0 - psi), self.transmittance * (psi - through));
            (0..3).for_each(|c| self.color[c] += front_weight * front.color[c] + back_weight * back.color[c]);
        }
        self.transmittance *= through;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (a, b, psi, weight of the front, weight of the back, transmittance), computed with 60 digits (maths 2.4).
    const VECTORS: [[f64; 6]; 12] = [
        [1e-6, 3e-6, 0.999999166667183, 8.33332816666915e-7, 1.16666518333442e-6, 0.999998000002],
        [2e-4, 0.0, 0.999933335999924, 6.66640000761888e-5, 3.33310000904737e-5, 0.999900004999833],
        [0.01, 0.01, 0.995016625083195, 4.98337491680536e-3, 4.96679133402659e-3, 0.990049833749168],
        [0.0, 0.1, 0.983580385842959, 0.016419614157041, 0.032350961342245, 0.951229424500714],
        [0.4, 0.1, 0.863027739762413, 0.136972260237587, 0.084226956691008, 0.778800783071405],
        [0.3, 2.0, 0.683989275603929, 0.316010724396071, 0.367352506224876, 0.316636769379053],
        [2.0, 0.3, 0.518382811413964, 0.481617188586036, 0.201746042034911, 0.316636769379053],
        [1.0, 1.0, 0.632120558828558, 0.367879441171442, 0.264241117657115, 0.367879441171442],
        [5.0, 5.0001, 0.19865171032717, 0.80134828967283, 0.191914100217012, 6.73761011015781e-3],
        [0.0, 50.0, 0.177245385090279, 0.822754614909721, 0.177245385076391, 1.3887943864964e-11],
        [40.0, 0.001, 0.0256790708675541, 0.974320929132446, 0.0256790688074308, 2.06012330322861e-9],
        [100.0, 900.0, 9.3411137943891e-3, 0.990658886205611, 9.3411137943891e-3, 7.12457640674129e-218],
    ];

    #[test]
    fn psi_and_the_weights_have_their_tabulated_values() {
        for [a, b, expected, front_weight, back_weight, transmittance] in VECTORS {
            assert!((psi(a, b) - expected).abs() < 2e-15, "psi({a}, {b}) = {}", psi(a, b));
            let mut light = Light::NONE;
            let sample = |extinction, color| Sample { extinction, color };
            light.add(&sample(a, [1.0, 0.0, 1.0]), &sample(b, [0.0, 1.0, 1.0]), 1.0);
            let expected = [front_weight, back_weight, front_weight + back_weight];
            assert!((0..3).all(|c| (light.color[c] - expected[c]).abs() < 2e-15), "{:?}, expected {expected:?}", light.color);
            assert!((light.transmittance / transmittance - 1.0).abs() < 1e-13);
        }
        assert_eq!(psi(0.0, 0.0), 1.0);
    }

    #[test]
    fn a_segment_equals_its_two_halves() {
        let (a, b) = (Sample { extinction: 0.3, color: [0.1, 0.9, 0.4] }, Sample { extinction: 70.0, color: [1.0, 0.0, 0.4] });
        let v = 0.37;
        let at = |v: f64| Sample {
            extinction: a.extinction + v * (b.extinction - a.extinction),
            color: [0, 1, 2].map(|c| a.color[c] + v * (b.color[c] - a.color[c])),
        };
        for length in [1e-9, 1e-4, 1e-3, 0.02, 0.5, 3.0, 100.0] {
            let (mut whole, mut halves) = (Light::NONE, Light::NONE);
            whole.add(&a, &b, length);
            halves.add(&a, &at(v), v * length);
            halves.add(&at(v), &b, (1.0 - v) * length);
            assert!((0..3).all(|c| (whole.color[c] - halves.color[c]).abs() < 1e-15), "length {length}");
            assert!((whole.transmittance - halves.transmittance).abs() < 1e-15);
        }
    }
}
