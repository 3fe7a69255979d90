//! The transfer function as intervals of the scalar in which extinction and colour are linear.

use crate::view::{OpacityModel, TransferFunction};

/// What the transfer function says of one scalar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// Extinction per world unit of length.
    pub extinction: f64,
    /// Linear RGB, not multiplied by anything.
    pub color: [f64; 3],
}

/// An interval between neighbouring knots; the values at its ends are the limits from inside.
#[derive(Debug, Clone, Copy)]
struct Interval {
    x: [f64; 2],
    ends: [Sample; 2],
}

/// A transfer function resolved for one field and one mesh: the knots of colour and opacity merged, opacity turned to extinction.
pub(super) struct Transfer {
    /// The data values of x = 0 and x = 1.
    range: [f64; 2],
    /// Merged knots, strictly ascending.
    knots: Vec<f64>,
    /// `intervals[i]` ends at `knots[i]`; the first and the last are unbounded and constant.
    intervals: Vec<Interval>,
}

/// The largest opacity that the exponential model tells from 1 (maths 1, B).
const MAX_OPACITY: f64 = 1.0 - 1.0 / (1 << 20) as f64;

impl Transfer {
    /// Resolves `tf` for a field with values in `field_range` on a mesh whose bounds have a diagonal of `diagonal` world units.
    pub fn new(tf: &TransferFunction, field_range: [f64; 2], diagonal: f64) -> Self {
        let tf = &*tf.in_data(field_range);
        let unit = tf.unit_distance_world(diagonal);
        let extinction = |&[x, opacity]: &[f64; 2]| match tf.opacity_model {
            OpacityModel::Linear => [x, opacity / unit],
            OpacityModel::Exponential => [x, -(-opacity.min(MAX_OPACITY)).ln_1p() / unit],
        };
        let extinction: Vec<[f64; 2]> = tf.opacity.iter().map(extinction).collect();

        let mut knots: Vec<f64> = tf.color.iter().map(|k| k[0]).chain(extinction.iter().map(|k| k[0])).collect();
        knots.sort_unstable_by(f64::total_cmp);
        knots.dedup();
        let limit = |x, side| {
            let ([extinction], color) = (one_sided(&extinction, x, side), one_sided(&tf.color, x, side));
            Sample { extinction, color }
        };
        let intervals = (0..=knots.len()).map(|i| {
            let lower = i.checked_sub(1).map(|before| (knots[before], limit(knots[before], Side::Above)));
            let upper = knots.get(i).map(|&x| (x, limit(x, Side::Below)));
            let (first, last) = (lower.or(upper), upper.or(lower));
            let ((x0, s0), (x1, s1)) = first.zip(last).expect("a valid transfer function has knots");
            Interval { x: [lower.map_or(f64::NEG_INFINITY, |_| x0), upper.map_or(f64::INFINITY, |_| x1)], ends: [s0, s1] }
        });
        Transfer { range: tf.range.unwrap_or(field_range), intervals: intervals.collect(), knots }
    }

    /// The scalar x of a value in data units; 0 for a constant field.
    pub fn normalize(&self, value: f64) -> f64 {
        let [lo, hi] = self.range;
        if hi > lo { (value - lo) / (hi - lo) } else { 0.0 }
    }

    /// Extinction and colour at a scalar x; on a step those of the upper side.
    pub fn sample(&self, x: f64) -> Sample {
        self.intervals[self.knots.partition_point(|&knot| knot <= x)].at(x)
    }

    /// Cuts a segment of `length` over which the scalar goes linearly from `front` to `back` at the knots (maths 2.6): visits the
    /// pieces from front to back as (at its front, at its back, length). On a step, a constant scalar takes the upper side.
    pub fn cut(&self, front: f64, back: f64, length: f64, mut visit: impl FnMut(&Sample, &Sample, f64)) {
        if front == back {
            let sample = self.sample(front);
            return visit(&sample, &sample, length);
        }
        let rising = front < back;
        let mut interval = self.knots.partition_point(|&knot| if rising { knot <= front } else { knot < front });
        let (mut x, mut done) = (front, 0.0);
        loop {
            let piece = &self.intervals[interval];
            let end = if rising { piece.x[1].min(back) } else { piece.x[0].max(back) };
            let next = if end == back { length } else { length * ((end - front) / (back - front)) };
            visit(&piece.at(x), &piece.at(end), next - done);
            if end == back {
                return;
            }
            (x, done) = (end, next);
            interval = if rising { interval + 1 } else { interval - 1 };
        }
    }
}

impl Interval {
    fn at(&self, x: f64) -> Sample {
        let [a, b] = &self.ends;
        if a == b {
            return *a;
        }
        let u = ((x - self.x[0]) / (self.x[1] - self.x[0])).clamp(0.0, 1.0);
        let lerp = |a: f64, b: f64| a * (1.0 - u) + b * u;
        Sample { extinction: lerp(a.extinction, b.extinction), color: [0, 1, 2].map(|c| lerp(a.color[c], b.color[c])) }
    }
}

/// From which side a limit is taken.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Below,
    Above,
}

/// The limit of a piecewise linear curve of ascending knots `[x, values..]`, constant outside them, at `x` from one side.
fn one_sided<const N: usize, const M: usize>(knots: &[[f64; N]], x: f64, side: Side) -> [f64; M] {
    let after = knots.partition_point(|knot| if side == Side::Below { knot[0] < x } else { knot[0] <= x });
    let value = |knot: usize, i: usize| knots[knot][1 + i];
    std::array::from_fn(|i| match after {
        0 => value(0, i),
        _ if after == knots.len() => value(after - 1, i),
        _ => {
            let (x0, x1) = (knots[after - 1][0], knots[after][0]);
            let u = (x - x0) / (x1 - x0);
            value(after - 1, i) * (1.0 - u) + value(after, i) * u
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> TransferFunction {
        TransferFunction {
            color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.5, 0.0]],
            opacity: vec![[0.25, 0.2], [0.5, 0.2], [0.5, 0.6], [0.75, 1.0]],
            opacity_model: OpacityModel::Linear,
            unit_distance: Some(2.0),
            ..TransferFunction::standard()
        }
    }

    fn pieces(transfer: &Transfer, front: f64, back: f64) -> Vec<[f64; 5]> {
        let mut all = Vec::new();
        transfer.cut(front, back, 10.0, |f, b, length| all.push([f.extinction, b.extinction, f.color[0], b.color[0], length]));
        all
    }

    fn assert_close(found: &[[f64; 5]], expected: &[[f64; 5]]) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (f, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((f - e).abs() < 1e-14, "{found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn segments_are_cut_at_every_knot_with_one_sided_values() {
        let transfer = Transfer::new(&steps(), [0.0, 1.0], 1.0);
        let up = [[0.1, 0.1, 0.0, 0.25, 2.5], [0.1, 0.1, 0.25, 0.5, 2.5], [0.3, 0.5, 0.5, 0.75, 2.5], [0.5, 0.5, 0.75, 1.0, 2.5]];
        assert_close(&pieces(&transfer, 0.0, 1.0), &up);
        let down: Vec<_> = up.iter().rev().map(|&[f, b, cf, cb, l]| [b, f, cb, cf, l]).collect();
        assert_close(&pieces(&transfer, 1.0, 0.0), &down);
    }

    #[test]
    fn beyond_the_knots_it_is_constant_and_a_step_belongs_to_the_side_it_is_left_towards() {
        let transfer = Transfer::new(&steps(), [0.0, 1.0], 1.0);
        assert_close(&pieces(&transfer, 1.25, 2.0), &[[0.5, 0.5, 1.0, 1.0, 10.0]]);
        assert_close(&pieces(&transfer, -3.0, -3.0), &[[0.1, 0.1, 0.0, 0.0, 10.0]]);
        assert_close(&pieces(&transfer, 0.5, 0.625), &[[0.3, 0.4, 0.5, 0.625, 10.0]]);
        assert_close(&pieces(&transfer, 0.5, 0.375), &[[0.1, 0.1, 0.5, 0.375, 10.0]]);
        assert_close(&pieces(&transfer, 0.5, 0.5), &[[0.3, 0.3, 0.5, 0.5, 10.0]]);
    }

    #[test]
    fn one_knot_is_a_constant_and_the_exponential_model_keeps_opacity_one_finite() {
        let tf = TransferFunction {
            color: vec![[0.3, 1.0, 1.0, 1.0]],
            opacity: vec![[0.7, 1.0]],
            opacity_model: OpacityModel::Exponential,
            ..steps()
        };
        let transfer = Transfer::new(&tf, [0.0, 1.0], 1.0);
        let tau = 20.0 * std::f64::consts::LN_2 / 2.0;
        assert_close(&pieces(&transfer, 0.1, 0.2), &[[tau, tau, 1.0, 1.0, 10.0]]);
    }

    #[test]
    fn the_range_maps_data_to_scalars() {
        let transfer = |range, field_range| Transfer::new(&TransferFunction { range, ..steps() }, field_range, 1.0);
        assert_eq!(transfer(None, [2.0, 6.0]).normalize(3.0), 0.25);
        assert_eq!(transfer(Some([1.0, 3.0]), [2.0, 6.0]).normalize(3.0), 1.0);
        assert_eq!(transfer(None, [2.0, 2.0]).normalize(2.0), 0.0);
        assert_eq!(transfer(Some([0.0, 4.0]), [2.0, 2.0]).normalize(2.0), 0.5);
    }
}
