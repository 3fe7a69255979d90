//! What a ray has gathered, front to back: the twin of `shaders/shared/light.wgsl`.

use super::{KnotTable, em1, segment};

/// Premultiplied colour gathered so far, and what is let through of whatever lies behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Linear RGB, premultiplied.
    pub color: [f32; 3],
    /// Transmittance from 1 (nothing met) to 0 (opaque).
    pub transmittance: f32,
}

impl Default for Light {
    fn default() -> Self {
        Light { color: [0.0; 3], transmittance: 1.0 }
    }
}

impl Light {
    /// The pixel: premultiplied RGBA.
    pub fn rgba(self) -> [f32; 4] {
        let [r, g, b] = self.color;
        [r, g, b, 1.0 - self.transmittance]
    }

    /// Passes a segment of constant `value` and of `length` cube edges.
    pub fn add_constant(&mut self, table: &KnotTable, value: f32, length: f32) {
        let medium = table.classify(table.interval(value), value);
        let alpha = em1(medium.extinction * length);
        let weight = self.transmittance * alpha;
        for c in 0..3 {
            self.color[c] += weight * medium.color[c];
        }
        self.transmittance *= 1.0 - alpha;
    }

    /// Passes a segment whose value goes linearly from `front` to `back` over `length` cube edges: cut at each knot between, in the
    /// order of the ray, with the knots' one-sided limits (maths 2.6).
    pub fn add_linear(&mut self, table: &KnotTable, front: f32, back: f32, length: f32) {
        if front == back {
            self.add_constant(table, front, length);
            return;
        }
        let rising = back > front;
        let mut interval = if rising { table.interval(front) } else { table.interval_below(front) };
        let (mut value, mut part) = (front, 0.0);
        loop {
            // The piece ends at the interval's far knot, or with the segment. `part` is the part of the length before it.
            let knot = table.knots[if rising { interval + 1 } else { interval }].value;
            let last = if rising { back <= knot || interval + 2 >= table.knots.len() } else { back >= knot || interval == 0 };
            let end = if last { back } else { knot };
            let end_part = if last { 1.0 } else { ((knot - front) / (back - front)).clamp(part, 1.0) };
            self.add_piece(table, interval, value, end, length * (end_part - part));
            if last {
                return;
            }
            (value, part) = (end, end_part);
            interval = if rising { interval + 1 } else { interval - 1 };
        }
    }

    /// Passes a piece of a segment inside one interval of knots, where extinction and colour are linear.
    fn add_piece(&mut self, table: &KnotTable, interval: usize, front: f32, back: f32, length: f32) {
        if length <= 0.0 {
            return;
        }
        let (f, b) = (table.classify(interval, front), table.classify(interval, back));
        if f.extinction + b.extinction <= 0.0 {
            return;
        }
        let w = segment(f.extinction * length, b.extinction * length);
        for c in 0..3 {
            self.color[c] += self.transmittance * (w.front * f.color[c] + w.back * b.color[c]);
        }
        self.transmittance *= 1.0 - w.alpha;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{Classifier, psi};
    use crate::view::{OpacityModel, TransferFunction};
    use proptest::prelude::*;

    /// The transfer function of maths 2.4, end to end: grey, knots at 0, 0.4, 0.5, 1.
    fn narrow_peak(opacity_model: OpacityModel) -> KnotTable {
        let grey = [[0.0, 0.0], [0.4, 1.0], [0.5, 0.2], [1.0, 0.6]];
        let tf = TransferFunction {
            color: grey.map(|[x, l]| [x, l, l, l]).to_vec(),
            opacity: vec![[0.0, 0.0], [0.4, 0.1], [0.5, 0.8], [1.0, 0.2]],
            opacity_model,
            unit_distance: Some(0.1),
            ..TransferFunction::standard()
        };
        Classifier::new(&tf, [0.0, 1.0], 1.0).table(1.0)
    }

    #[test]
    fn a_tet_with_a_narrow_peak_meets_the_reference_both_ways() {
        for (model, front, back, color, alpha) in [
            (OpacityModel::Linear, 0.31, 0.64, 0.44081815243378, 0.922213833078071),
            (OpacityModel::Linear, 0.64, 0.31, 0.273133689378477, 0.922213833078071),
            (OpacityModel::Exponential, 0.31, 0.64, 0.534627871101574, 0.992340119130178),
            (OpacityModel::Exponential, 0.64, 0.31, 0.282208182732324, 0.992340119130178),
        ] {
            let mut light = Light::default();
            light.add_linear(&narrow_peak(model), front, back, 0.55);
            let [r, g, b, a] = light.rgba().map(f64::from);
            assert_eq!((r, g), (g, b));
            assert!(
                (r - color).abs() < 1.2e-4 && (a - alpha).abs() < 1e-6,
                "{model:?} {front} to {back}: {r} {a}, expected {color} {alpha}"
            );
        }
    }

    #[test]
    fn constant_colour_gives_colour_times_opacity() {
        let tf = TransferFunction { color: vec![[0.0, 0.2, 0.5, 1.0]], unit_distance: Some(0.3), ..TransferFunction::standard() };
        let table = Classifier::new(&tf, [0.0, 1.0], 1.0).table(1.0);
        let mut light = Light::default();
        for (front, back) in [(0.1, 0.9), (0.9, 0.2), (0.2, 0.2), (0.2, 0.6)] {
            light.add_linear(&table, front, back, 0.2);
        }
        let [r, g, b, a] = light.rgba();
        for (channel, luminance) in [(r, 0.2), (g, 0.5), (b, 1.0)] {
            assert!((channel - luminance * a).abs() < 2e-6, "{channel} of {luminance} at alpha {a}");
        }
    }

    #[test]
    fn a_step_is_met_with_the_side_the_ray_comes_from() {
        // Transparent below 1/2, extinction 1 above: half of the segment absorbs, whichever way the ray goes.
        let opacity = vec![[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [1.0, 1.0]];
        let tf = TransferFunction { color: vec![[0.0, 1.0, 1.0, 1.0]], opacity, unit_distance: Some(1.0), ..TransferFunction::standard() };
        let table = Classifier::new(&tf, [0.0, 1.0], 1.0).table(1.0);
        for (front, back) in [(0.25, 0.75), (0.75, 0.25), (0.0, 1.0), (0.5, 0.0), (0.5, 1.0), (1.0, 0.5)] {
            let mut light = Light::default();
            light.add_linear(&table, front, back, 0.8);
            let absorbing = (front.max(back) - 0.5) / (front - back).abs();
            let expected = 1.0 - (-0.8 * absorbing).exp();
            assert!((light.rgba()[3] - expected).abs() < 1e-6, "{front} to {back}: {:?}, expected {expected}", light.rgba());
        }
    }

    proptest! {
        /// A segment cut anywhere is the same segment; the table's error is all that may differ.
        #[test]
        fn a_segment_is_the_sum_of_its_parts(front in 0.0..1.0f32, back in 0.0..1.0f32, cut in 0.05..0.95f32, length in 1e-4..1.0f32) {
            let table = narrow_peak(OpacityModel::Linear);
            let (mut whole, mut parts) = (Light::default(), Light::default());
            whole.add_linear(&table, front, back, length);
            let middle = front + (back - front) * cut;
            parts.add_linear(&table, front, middle, length * cut);
            parts.add_linear(&table, middle, back, length * (1.0 - cut));
            for (w, p) in whole.rgba().into_iter().zip(parts.rgba()) {
                prop_assert!((w - p).abs() < 3e-4);
            }
            prop_assert!((whole.transmittance - parts.transmittance).abs() < 2e-6);
        }

        /// Inside one interval the light is that of the exact Psi.
        #[test]
        fn one_interval_is_exact(front in 0.5..1.0f32, back in 0.5..1.0f32, length in 1e-3..1.0f32) {
            let table = narrow_peak(OpacityModel::Linear);
            let mut light = Light::default();
            light.add_linear(&table, front, back, length);
            let at = |v: f32| { let m = table.classify(2, v); (f64::from(m.extinction * length), f64::from(m.color[0])) };
            let ((a, lf), (b, lb)) = (at(front), at(back));
            let (p, zeta) = (psi(a, b), (-(a + b) / 2.0).exp());
            prop_assert!((f64::from(light.color[0]) - ((1.0 - p) * lf + (p - zeta) * lb)).abs() < 1e-4);
        }
    }
}
