//! Transfer functions over other scales, in steps or with colours beyond their range, as plain functions that are piecewise linear in the
//! value: what all renderers draw.

use super::{Scale, TransferFunction};
use std::borrow::Cow;

/// How far x may be from its scale's between two knots.
const TOLERANCE: f64 = 1e-3;

/// By how much of the range the colour above begins beyond its end, so that the largest value of the range has the range's colour.
const BEYOND: f64 = 1.0 / (1 << 20) as f64;

/// By how much of the data's range values may lie outside a threshold and count as inside: an octree's samples are rounded by half as
/// much.
const ROUNDED: f64 = 1.0 / (1 << 17) as f64;

impl TransferFunction {
    /// The place of a value, data units, on the scale of this transfer function; 0 and 1 are the ends of its range, or of `data_range` if
    /// it names none. A scale that does not fit the range counts as linear.
    pub fn position(&self, value: f64, data_range: [f64; 2]) -> f64 {
        let range = self.range.unwrap_or(data_range);
        self.scale.or_linear(range).position(range, value)
    }

    /// The value, data units, at a place: the inverse of [`TransferFunction::position`].
    pub fn value_at(&self, x: f64, data_range: [f64; 2]) -> f64 {
        let range = self.range.unwrap_or(data_range);
        self.scale.or_linear(range).value(range, x)
    }

    /// Colour knots in x with steps as they are drawn: of n steps, step i has the colour at `i / (n - 1)` and goes from `i / n` to
    /// `(i + 1) / n`, as in ParaView.
    pub fn stepped_color(&self) -> Cow<'_, [[f64; 4]]> {
        let Some(steps) = self.steps else { return Cow::Borrowed(&self.color) };
        let n = f64::from(steps.max(1));
        let step = |i: u32| {
            let i = f64::from(i);
            let [_, r, g, b] = at(&self.color, if steps > 1 { i / (n - 1.0) } else { 0.5 });
            [[i / n, r, g, b], [(i + 1.0) / n, r, g, b]]
        };
        Cow::Owned((0..steps.max(1)).flat_map(step).collect())
    }

    /// The same function over [0, 1], with knots at both ends and none beyond: what scales other than the linear one ask for.
    pub fn over_unit_range(&self) -> TransferFunction {
        TransferFunction { color: over_unit_range(&self.color), opacity: over_unit_range(&self.opacity), ..self.clone() }
    }

    /// The function that renderers draw for a field whose values go from `data_range[0]` to `data_range[1]`: linear in the value, without
    /// steps, threshold and colours beyond the range of their own, but with the knots that those take.
    ///
    /// Other scales are *defined* as this: piecewise linear over so many knots that x is nowhere further than 1e-3 from the scale's. Of a
    /// function that is such already nothing changes. A scale that does not fit the range counts as linear.
    pub fn in_data(&self, data_range: [f64; 2]) -> Cow<'_, TransferFunction> {
        let range = self.range.unwrap_or(data_range);
        let scale = self.scale.or_linear(range);
        let is_plain = self.steps.is_none() && self.below.is_none() && self.above.is_none() && self.threshold.is_none();
        if scale == Scale::Linear && is_plain {
            return if self.scale == scale { Cow::Borrowed(self) } else { Cow::Owned(TransferFunction { scale, ..self.clone() }) };
        }
        let (mut color, mut opacity) = (self.stepped_color().into_owned(), self.opacity.clone());
        if scale != Scale::Linear {
            // x is bent at the same values for colour and opacity.
            let knots = color.iter().map(|k| k[0]).chain(opacity.iter().map(|k| k[0]));
            let bends = bends(scale, range, knots.filter(|x| (0.0..=1.0).contains(x)));
            let linear = |x: f64| Scale::Linear.position(range, scale.value(range, x));
            color = bent(&color, &bends, linear);
            opacity = bent(&opacity, &bends, linear);
        }
        // Beyond the range there is one colour on either side.
        if let (Some([r, g, b]), Some(&first)) = (self.below, color.first()) {
            let begin = at(&color, 0.0);
            color.retain(|k| k[0] >= 0.0);
            let begins = if first[0] < 0.0 || color.first().is_none_or(|k| k[0] > 0.0) { vec![begin] } else { vec![] };
            color.splice(0..0, [[0.0, r, g, b]].into_iter().chain(begins));
        }
        if let (Some([r, g, b]), true) = (self.above, !color.is_empty()) {
            let end = 1.0 + BEYOND;
            let [_, er, eg, eb] = at(&color, end);
            color.retain(|k| k[0] <= 1.0);
            color.extend([[end, er, eg, eb], [end, r, g, b]]);
        }
        if let Some(threshold) = self.threshold {
            opacity = within(opacity, threshold, range, data_range);
        }
        let (steps, below, above, threshold) = (None, None, None, None);
        Cow::Owned(TransferFunction { color, opacity, scale: Scale::Linear, steps, below, above, threshold, ..self.clone() })
    }
}

/// Opacity, x being linear over `range`, with none outside a threshold. Where a field has no values there is no step: its smallest and its
/// largest are inside if the threshold has them.
fn within(mut opacity: Vec<[f64; 2]>, [from, to]: [f64; 2], range: [f64; 2], [lo, hi]: [f64; 2]) -> Vec<[f64; 2]> {
    let rounded = ROUNDED * (hi - lo);
    let (from, to) = (from - rounded, to + rounded);
    if from > hi || to < lo {
        return vec![[0.0, 0.0]];
    }
    if lo >= hi {
        return opacity;
    }
    if from > lo {
        let x = Scale::Linear.position(range, from);
        let begin = at(&opacity, x);
        opacity.retain(|k| k[0] > x);
        opacity.splice(0..0, [[x, 0.0], begin]);
    }
    if to < hi {
        let x = Scale::Linear.position(range, to);
        // As it is when x is neared from below, also at a step there.
        let end = opacity.partition_point(|k| k[0] < x);
        let (a, b) = (opacity[end.saturating_sub(1)], opacity[end.min(opacity.len() - 1)]);
        let f = if b[0] > a[0] { (x - a[0]) / (b[0] - a[0]) } else { 0.0 };
        opacity.truncate(end);
        opacity.extend([[x, (1.0 - f) * a[1] + f * b[1]], [x, 0.0]]);
    }
    opacity
}

/// Places in [0, 1], ascending, between which x is linear in the value: the knots given, and others where the scale asks for them.
fn bends(scale: Scale, range: [f64; 2], knots: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut ends: Vec<f64> = knots.chain([0.0, 1.0]).collect();
    // Where a symlog scale goes from linear to logarithmic.
    let thresholds = scale.threshold(range).into_iter().flat_map(|t| [-t, t]).map(|t| scale.position(range, t));
    ends.extend(thresholds.filter(|x| (0.0..=1.0).contains(x)));
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut bends = vec![ends[0]];
    for pair in ends.windows(2) {
        // Halved in x until the middle is near enough: on a piece of a logarithm the error is largest near it.
        let mut open = vec![pair[1]];
        while let Some(&to) = open.last() {
            let from = bends[bends.len() - 1];
            let middle = 0.5 * (from + to);
            let [a, m, b] = [from, middle, to].map(|x| scale.value(range, x));
            let off = (from + (to - from) * ((m - a) / (b - a)) - middle).abs();
            // The true largest error is at another value, at most an eighth more while pieces are this short.
            if off > TOLERANCE * 0.8 && middle > from && middle < to {
                open.push(middle);
            } else {
                bends.push(to);
                open.pop();
            }
        }
    }
    bends
}

/// A function's knots with all bends among them, each moved to where `linear` says its x lies.
fn bent<const N: usize>(knots: &[[f64; N]], bends: &[f64], linear: impl Fn(f64) -> f64) -> Vec<[f64; N]> {
    let (Some(first), Some(last)) = (knots.first(), knots.last()) else { return vec![] };
    let between = bends.iter().filter(|&&x| first[0] < x && x < last[0] && !knots.iter().any(|k| k[0] == x));
    let mut all: Vec<[f64; N]> = knots.iter().copied().chain(between.map(|&x| at(knots, x))).collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0])); // stable: the sides of a step keep their order
    for knot in &mut all {
        knot[0] = linear(knot[0]);
    }
    all
}

/// The part over [0, 1] of a function that is constant outside its knots, with knots at both ends.
fn over_unit_range<const N: usize>(knots: &[[f64; N]]) -> Vec<[f64; N]> {
    if knots.is_empty() {
        return vec![];
    }
    let mut inside: Vec<[f64; N]> = knots.iter().copied().filter(|k| (0.0..=1.0).contains(&k[0])).collect();
    if inside.first().is_none_or(|k| k[0] > 0.0) {
        inside.insert(0, at(knots, 0.0));
    }
    if inside.last().is_none_or(|k| k[0] < 1.0) {
        inside.push(at(knots, 1.0));
    }
    inside
}

/// The value at `x` of a function `[x, values..]` that is piecewise linear, constant outside its knots and belongs to the side above at steps.
pub(super) fn at<const N: usize>(knots: &[[f64; N]], x: f64) -> [f64; N] {
    let after = knots.partition_point(|k| k[0] <= x);
    let (lo, hi) = (knots[after.saturating_sub(1)], knots[after.min(knots.len() - 1)]);
    let f = if hi[0] > lo[0] { (x - lo[0]) / (hi[0] - lo[0]) } else { 0.0 };
    let mut value: [f64; N] = std::array::from_fn(|c| (1.0 - f) * lo[c] + f * hi[c]);
    value[0] = x;
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(scale: Scale, range: [f64; 2]) -> TransferFunction {
        TransferFunction {
            color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]],
            opacity: vec![[0.0, 0.0], [1.0, 1.0]],
            range: Some(range),
            scale,
            ..TransferFunction::standard()
        }
    }

    #[test]
    fn a_threshold_takes_opacity_from_what_lies_outside() {
        let scales = [(Scale::Linear, [0.0, 10.0]), (Scale::Log, [1.0, 10.0]), (Scale::Symlog(Some(0.5)), [-10.0, 10.0])];
        for (scale, range) in scales {
            for threshold in [[2.0, 7.5], [-20.0, 7.5], [2.0, 20.0], [3.0, 3.0], [-20.0, 20.0], [11.0, 12.0], [-20.0, -15.0]] {
                // The colours span a part of the data only.
                let data = [range[0] * 1.2, 12.0];
                let whole = TransferFunction { opacity: vec![[0.0, 0.2], [0.5, 1.0], [1.0, 0.4]], ..ramp(scale, range) };
                let cut = TransferFunction { threshold: Some(threshold), ..whole.clone() };
                let (whole, cut) = (whole.in_data(data), cut.in_data(data));
                cut.validate().expect("knots ascend");
                assert_eq!((cut.threshold, &cut.color), (None, &whole.color));
                for k in 0..=4000 {
                    let value = data[0] + (data[1] - data[0]) * f64::from(k) / 4000.0;
                    let opacity = |tf: &TransferFunction| at(&tf.opacity, Scale::Linear.position(range, value))[1];
                    let expected = if (threshold[0]..=threshold[1]).contains(&value) { opacity(&whole) } else { 0.0 };
                    assert!((opacity(&cut) - expected).abs() < 1e-9, "{scale:?} {threshold:?} at {value}: {}", opacity(&cut));
                }
            }
        }
        // Of a field of one value all is inside or nothing.
        let one = |threshold| TransferFunction { threshold: Some(threshold), ..ramp(Scale::Linear, [0.0, 1.0]) };
        let one = |threshold| TransferFunction { range: None, ..one(threshold) }.in_data([5.0, 5.0]).opacity.clone();
        assert_eq!((one([4.0, 5.0]), one([5.5, 6.0])), (vec![[0.0, 0.0], [1.0, 1.0]], vec![[0.0, 0.0]]));
    }

    #[test]
    fn plain_functions_are_left_alone() {
        let tf = TransferFunction::standard();
        assert!(matches!(tf.in_data([0.0, 7.0]), Cow::Borrowed(same) if *same == tf));
        // A logarithm that cannot be is linear, and says so before (`check_range`).
        let tf = TransferFunction { scale: Scale::Log, ..tf };
        assert_eq!(*tf.in_data([-1.0, 7.0]), TransferFunction::standard());
    }

    #[test]
    fn a_scale_is_met_within_a_thousandth() {
        for (scale, range) in [
            (Scale::Log, [1e-3, 1e3]),
            (Scale::Log, [1.0, 1.1]),
            (Scale::Log, [1e-200, 1e100]),
            (Scale::Symlog(None), [-2.0, 3.0]),
            (Scale::Symlog(Some(1e-6)), [-1.0, 1e6]),
        ] {
            let tf = ramp(scale, range);
            let linear = tf.in_data([0.0, 1.0]);
            linear.validate().expect("valid");
            assert_eq!((linear.scale, linear.range), (Scale::Linear, Some(range)));
            assert!(linear.opacity.len() < 1000, "{scale:?} takes {} knots", linear.opacity.len());
            let mut worst = 0f64;
            for k in 0..=20_000 {
                let x = f64::from(k) / 20_000.0;
                let s = Scale::Linear.position(range, scale.value(range, x));
                let [_, opacity] = at(&linear.opacity, s);
                worst = worst.max((opacity - x).abs());
                assert!((at(&linear.color, s)[1] - opacity).abs() < 1e-12, "colour and opacity bend alike");
            }
            assert!(worst <= 1e-3, "{scale:?} over {range:?}: {worst}");
        }
    }

    #[test]
    fn knots_and_steps_stay_where_they_are() {
        let opacity = vec![[0.25, 0.1], [0.5, 0.2], [0.5, 0.8], [0.75, 0.4]];
        let tf = TransferFunction { opacity, ..ramp(Scale::Log, [1.0, 10_000.0]) };
        let linear = tf.in_data([0.0, 1.0]);
        let s = |value: f64| (value - 1.0) / 9999.0;
        let near = |x: f64| linear.opacity.iter().filter(|k| (k[0] / x - 1.0).abs() < 1e-12).map(|k| k[1]).collect::<Vec<_>>();
        assert_eq!((near(s(10.0)), near(s(100.0)), near(s(1000.0))), (vec![0.1], vec![0.2, 0.8], vec![0.4]));
        assert_eq!((linear.opacity[0][1], linear.opacity[linear.opacity.len() - 1][1]), (0.1, 0.4), "constant beyond, as before");
    }

    #[test]
    fn steps_have_paraviews_colours_and_leave_opacity() {
        let tf = TransferFunction { steps: Some(4), ..ramp(Scale::Linear, [0.0, 8.0]) };
        let drawn = tf.in_data([0.0, 1.0]);
        assert_eq!(drawn.opacity, tf.opacity);
        for (value, red) in [(0.0, 0.0), (1.9, 0.0), (2.0, 1.0 / 3.0), (5.9, 2.0 / 3.0), (6.1, 1.0), (8.0, 1.0)] {
            assert!((at(&drawn.color, value / 8.0)[1] - red).abs() < 1e-15, "{value}");
        }
        let one = TransferFunction { steps: Some(1), ..tf.clone() };
        assert_eq!(at(&one.in_data([0.0, 1.0]).color, 0.9)[1], 0.5);
        // On a log scale steps are equal in x.
        let log = TransferFunction { scale: Scale::Log, range: Some([1.0, 10_000.0]), ..tf };
        let drawn = log.in_data([0.0, 1.0]);
        for (value, red) in [(9.0, 0.0), (11.0, 1.0 / 3.0), (99.0, 1.0 / 3.0), (101.0, 2.0 / 3.0), (1001.0, 1.0)] {
            assert!((at(&drawn.color, (value - 1.0) / 9999.0)[1] - red).abs() < 1e-12, "{value}");
        }
    }

    #[test]
    fn colours_beyond_the_range_begin_at_its_ends() {
        let beyond = TransferFunction { below: Some([0.25, 0.0, 0.0]), above: Some([0.75, 0.0, 0.0]), ..ramp(Scale::Linear, [2.0, 4.0]) };
        let drawn = beyond.in_data([0.0, 10.0]);
        drawn.validate().expect("valid");
        for (x, red) in [(-3.0, 0.25), (-1e-9, 0.25), (0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (1.00001, 0.75), (9.0, 0.75)] {
            assert!((at(&drawn.color, x)[1] - red).abs() < 1e-6, "{x}: {:?}", at(&drawn.color, x));
        }
        assert_eq!(drawn.opacity, beyond.opacity, "opacity goes on");
        // Also where the map's own knots do not reach the ends, or go beyond them.
        for color in [vec![[0.5, 0.5, 0.5, 0.5]], vec![[-1.0, 0.0, 0.0, 0.0], [3.0, 1.0, 1.0, 1.0]]] {
            let inside = TransferFunction { below: None, above: None, color: color.clone(), ..beyond.clone() };
            let tf = TransferFunction { color, ..beyond.clone() };
            let drawn = tf.in_data([0.0, 10.0]);
            drawn.validate().expect("valid");
            for x in [0.0, 0.3, 1.0] {
                assert!((at(&drawn.color, x)[1] - at(&inside.color, x)[1]).abs() < 1e-6, "{x}");
            }
            assert_eq!((at(&drawn.color, -0.1)[1], at(&drawn.color, 1.1)[1]), (0.25, 0.75));
        }
    }
}
