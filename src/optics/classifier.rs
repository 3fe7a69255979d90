//! A transfer function made ready for one scalar array: merged knots over the array's normalised value, extinction for opacity.

use crate::view::{Mode, OpacityModel, TransferFunction};
use bytemuck::{Pod, Zeroable};

/// Entries of the table from a value to its interval of knots.
pub const INDEX_SIZE: usize = 256;

/// Extinction is kept below this per unit of length, so that its product with a length of 0 is 0 and not NaN.
const MAX_EXTINCTION: f64 = 1e30;

/// A knot of the merged transfer function. Between two knots extinction and colour are linear, each on its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClassKnot {
    /// The scalar, normalised by the array's range: 0 to 1.
    pub value: f64,
    /// Extinction per world length.
    pub extinction: f64,
    /// Luminance: linear RGB, not multiplied by opacity or extinction.
    pub color: [f64; 3],
}

/// From an array's normalised scalar to extinction and colour.
///
/// Knots ascend from value 0 to value 1. Two knots at one value are a step: the first holds the limit from below, the second that from
/// above. A value exactly at a step belongs to the side above.
#[derive(Debug, Clone, PartialEq)]
pub struct Classifier {
    knots: Vec<ClassKnot>,
    value_range: [f64; 2],
    bounds_diagonal: f64,
    /// What the colours of an integral span.
    integral_range: [f64; 2],
}

/// A knot as the marchers read it: of [`Knot`] i and i + 1, interval i interpolates. The twin of `Knot` in `shaders/shared/classify.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Knot {
    /// Luminance: linear RGB.
    pub color: [f32; 3],
    /// Extinction per cube edge.
    pub extinction: f32,
    /// The normalised scalar.
    pub value: f32,
    /// 1 / (distance to the next knot); 0 at a step and at the last knot.
    pub inverse_width: f32,
    /// Fills the struct to 32 bytes.
    pub _pad: [f32; 2],
}

/// Knots in f32 for a unit of length, with a table that finds a value's interval in constant time.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotTable {
    /// At least two; the first at 0, the last at 1.
    pub knots: Vec<Knot>,
    /// For k: the last knot whose value is at most k / [`INDEX_SIZE`].
    pub index: Vec<u32>,
}

/// What a ray meets at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Extinction per cube edge.
    pub extinction: f32,
    /// Luminance: linear RGB.
    pub color: [f32; 3],
}

impl Classifier {
    /// Merges the knots of `tf` and maps them to the array's normalised scalar, in which 0 and 1 stand for `value_range` (data units; it
    /// may be degenerate, then all values are 0). `bounds_diagonal` is the world length that a missing unit distance refers to. The
    /// transfer function must be valid ([`TransferFunction::validate`]).
    pub fn new(tf: &TransferFunction, value_range: [f64; 2], bounds_diagonal: f64) -> Self {
        let integral_range = tf.range.unwrap_or_else(|| Mode::integral_range(value_range, bounds_diagonal));
        let tf = &*tf.in_data(value_range);
        let unit = tf.unit_distance_world(bounds_diagonal);
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let from_opacity = |opacity: f64| match tf.opacity_model {
            OpacityModel::Linear => opacity / unit,
            OpacityModel::Exponential => -(-opacity.min(1.0 - 1.0 / 1_048_576.0)).ln_1p() / unit,
        };
        // The knots are converted and extinction is interpolated between them, also where that is not the drawn ramp (maths 1).
        let extinction: Vec<[f64; 2]> = tf.opacity.iter().map(|&[x, opacity]| [x, from_opacity(opacity)]).collect();
        let limit = |x: f64, value: f64, side: Side| {
            let ([_, r, g, b], [_, extinction]) = (one_sided(&tf.color, x, side), one_sided(&extinction, x, side));
            ClassKnot { value, extinction, color: [r, g, b] }
        };

        // The transfer function's x at the array's normalised 0 and 1.
        let [x0, x1] = match tf.range {
            Some([lo, hi]) => value_range.map(|v| (v - lo) / (hi - lo)),
            None => [0.0, 1.0],
        };
        let mut knots = vec![limit(x0, 0.0, Side::Above)];
        if x1 > x0 {
            let mut inside: Vec<f64> = tf.color.iter().map(|k| k[0]).chain(tf.opacity.iter().map(|k| k[0])).collect();
            inside.retain(|&x| x0 < x && x < x1);
            inside.sort_by(f64::total_cmp);
            inside.dedup();
            let inside = inside.into_iter().map(|x| (x, (x - x0) / (x1 - x0)));
            for (x, value) in inside.chain([(x1, 1.0)]) {
                let (below, above) = (limit(x, value, Side::Below), limit(x, value, Side::Above));
                knots.push(below);
                if above != below {
                    knots.push(above);
                }
            }
        } else {
            knots.push(ClassKnot { value: 1.0, ..knots[0] });
        }
        Classifier { knots, value_range, bounds_diagonal, integral_range }
    }

    /// What `mode` needs of a transfer function: [`Classifier::new`], or for an integral the function over the integral's own range.
    pub fn for_mode(tf: &TransferFunction, mode: Mode, value_range: [f64; 2], bounds_diagonal: f64) -> Self {
        let of_values = Classifier::new(tf, value_range, bounds_diagonal);
        if mode != Mode::Integral {
            return of_values;
        }
        let range = of_values.integral_range;
        let over_its_range = TransferFunction { range: Some(range), ..tf.clone() };
        Classifier { knots: Classifier::new(&over_its_range, range, bounds_diagonal).knots, ..of_values }
    }

    /// Smallest and largest value of the array, which 0 and 1 stand for, in data units.
    pub fn value_range(&self) -> [f64; 2] {
        self.value_range
    }

    /// Length of the diagonal of the bounds in world units.
    pub fn bounds_diagonal(&self) -> f64 {
        self.bounds_diagonal
    }

    /// The integrals, in data units times world units, whose colours are the first and the last.
    pub fn integral_range(&self) -> [f64; 2] {
        self.integral_range
    }

    /// A value in data units, normalised; outside [0, 1] where the array has none such.
    pub fn normalized(&self, value: f64) -> f64 {
        let [lo, hi] = self.value_range;
        if hi > lo { (value - lo) / (hi - lo) } else { -1.0 }
    }

    /// The merged knots, ascending from value 0 to value 1.
    pub fn knots(&self) -> &[ClassKnot] {
        &self.knots
    }

    /// The knots in f32, extinction per `edge_world` world units: what lengths in edges of the root cube are multiplied with.
    pub fn table(&self, edge_world: f64) -> KnotTable {
        let mut knots: Vec<Knot> = self.knots.iter().map(|k| Knot::new(k, edge_world)).collect();
        // Interval i ends at knot i + 1, so a step at the very end needs a knot beyond it for its upper side to be found.
        if let [.., a, b] = knots[..]
            && a.value == b.value
        {
            knots.push(b);
        }
        for i in 0..knots.len() - 1 {
            let width = knots[i + 1].value - knots[i].value;
            knots[i].inverse_width = if width > 0.0 { (1.0 / width).min(f32::MAX) } else { 0.0 };
        }
        let last_at_most = |value: f32| knots.partition_point(|k| k.value <= value).saturating_sub(1) as u32;
        let index = (0..INDEX_SIZE).map(|k| last_at_most(k as f32 / INDEX_SIZE as f32)).collect();
        KnotTable { knots, index }
    }
}

/// Which limit of a step.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Below,
    Above,
}

/// The limit at `x` of a piecewise linear function `[x, values..]` that is constant outside its knots.
fn one_sided<const N: usize>(knots: &[[f64; N]], x: f64, side: Side) -> [f64; N] {
    let after = knots.partition_point(|k| if side == Side::Below { k[0] < x } else { k[0] <= x });
    let (lo, hi) = (knots[after.saturating_sub(1)], knots[after.min(knots.len() - 1)]);
    let f = if hi[0] > lo[0] { (x - lo[0]) / (hi[0] - lo[0]) } else { 0.0 };
    std::array::from_fn(|c| (1.0 - f) * lo[c] + f * hi[c])
}

impl Knot {
    fn new(knot: &ClassKnot, edge_world: f64) -> Self {
        Knot {
            color: knot.color.map(|c| c as f32),
            extinction: (knot.extinction * edge_world).min(MAX_EXTINCTION) as f32,
            value: knot.value as f32,
            inverse_width: 0.0,
            _pad: [0.0; 2],
        }
    }
}

impl KnotTable {
    /// The values that are seen, those with an extinction above 0: closed intervals in [0, 1], ascending and apart.
    ///
    /// Extinction is linear between knots, so that an interval of knots is seen as a whole if it is at either end; an end without
    /// extinction is itself not seen, and the nearest f32 stands for it,
    /// of those that are not so small that a GPU may take them for 0.
    pub fn seen(&self) -> Vec<[f32; 2]> {
        let mut seen: Vec<[f32; 2]> = Vec::new();
        for pair in self.knots.windows(2).filter(|pair| pair[0].extinction > 0.0 || pair[1].extinction > 0.0) {
            let low = if pair[0].extinction > 0.0 { pair[0].value } else { pair[0].value.next_up().max(f32::MIN_POSITIVE) };
            let high = if pair[1].extinction > 0.0 { pair[1].value } else { pair[1].value.next_down() };
            match seen.last_mut() {
                // What an interval ends with, the next begins with.
                Some(last) if last[1] >= low => last[1] = last[1].max(high),
                _ if low <= high => seen.push([low, high]),
                _ => {}
            }
        }
        seen
    }

    /// The interval that holds `value` in [0, 1]: the last i with `knots[i].value <= value` that has a knot after it.
    pub fn interval(&self, value: f32) -> usize {
        let mut i = self.index[((value * INDEX_SIZE as f32) as usize).min(INDEX_SIZE - 1)] as usize;
        while i + 2 < self.knots.len() && self.knots[i + 1].value <= value {
            i += 1;
        }
        i.min(self.knots.len() - 2)
    }

    /// The interval that holds the values just below `value`: the last i with `knots[i].value < value`, or 0.
    pub fn interval_below(&self, value: f32) -> usize {
        let mut i = self.interval(value);
        while i > 0 && self.knots[i].value >= value {
            i -= 1;
        }
        i
    }

    /// Extinction and colour at `value` by the linear functions of an interval, so that at a step the interval picks the side.
    pub fn classify(&self, interval: usize, value: f32) -> Medium {
        let (k, next) = (&self.knots[interval], &self.knots[interval + 1]);
        let f = ((value - k.value) * k.inverse_width).clamp(0.0, 1.0);
        Medium {
            extinction: k.extinction + f * (next.extinction - k.extinction),
            color: [0, 1, 2].map(|c| k.color[c] + f * (next.color[c] - k.color[c])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classified(tf: &TransferFunction, value_range: [f64; 2], value: f32) -> Medium {
        let table = Classifier::new(tf, value_range, 50.0).table(1.0);
        table.classify(table.interval(value), value)
    }

    #[test]
    fn color_and_opacity_knots_are_merged() {
        let classifier = Classifier::new(&TransferFunction::standard(), [0.0, 1.0], 100.0);
        let values: Vec<f64> = classifier.knots().iter().map(|k| k.value).collect();
        assert_eq!(values, [0.0, 0.14, 0.15, 0.20, 0.30, 0.35, 0.55, 0.60, 1.0]);
        let knot = classifier.knots()[3];
        assert!((knot.extinction - 0.06 / 2.0).abs() < 1e-15, "opacity over diagonal / 50");
        assert!((knot.color[0] - (0.10 + 0.10 / 3.0)).abs() < 1e-15, "a third of the way between the colours at 0.15 and 0.30");
    }

    #[test]
    fn every_value_finds_its_interval() {
        for preset in TransferFunction::PRESETS {
            let tf = TransferFunction::preset(preset).expect("exists");
            let table = Classifier::new(&tf, [-3.0, 5.0], 2.0).table(7.0);
            for k in 0..=10_000 {
                let value = k as f32 / 10_000.0;
                let i = table.interval(value);
                assert!(table.knots[i].value <= value && value <= table.knots[i + 1].value, "{preset}: {value} in interval {i}");
                let below = table.interval_below(value);
                assert!(table.knots[below].value < value || below == 0);
                let (at, limit) = (table.classify(i, value), table.classify(below, value));
                assert!((at.extinction - limit.extinction).abs() < 1e-5, "continuous presets agree from both sides");
            }
        }
    }

    #[test]
    fn steps_keep_their_sides() {
        let opacity = vec![[0.0, 0.0], [0.5, 0.25], [0.5, 0.75], [1.0, 0.5], [1.0, 1.0]];
        let tf = TransferFunction { color: vec![[0.0, 1.0, 1.0, 1.0]], opacity, ..TransferFunction::standard() };
        let table = Classifier::new(&tf, [0.0, 1.0], 50.0).table(1.0);
        let extinction = |i, value| table.classify(i, value).extinction;
        assert_eq!(extinction(table.interval(0.5), 0.5), 0.75, "a value at the step lies above it");
        assert_eq!(extinction(table.interval_below(0.5), 0.5), 0.25);
        assert_eq!(extinction(table.interval(1.0), 1.0), 1.0, "also at the end of the range");
        assert_eq!(extinction(table.interval_below(1.0), 1.0), 0.5);
    }

    #[test]
    fn seen_is_what_has_extinction() {
        let seen = |opacity: &[[f64; 2]]| {
            let tf = TransferFunction { opacity: opacity.to_vec(), ..TransferFunction::standard() };
            let table = Classifier::new(&tf, [0.0, 1.0], 50.0).table(1.0);
            let seen = table.seen();
            for k in 0..=4096 {
                let value = k as f32 / 4096.0;
                let is_seen = table.classify(table.interval(value), value).extinction > 0.0;
                let listed = seen.iter().any(|[low, high]| (*low..=*high).contains(&value));
                assert!(listed || !is_seen, "{value} is seen but not in {seen:?}");
                // At a step the side below may be seen at the same value.
                assert!(is_seen || !listed || opacity.iter().any(|k| k[0] as f32 == value), "{value} is in {seen:?} but not seen");
            }
            assert!(seen.windows(2).all(|pair| pair[0][1] < pair[1][0]), "{seen:?}");
            seen
        };
        assert!(seen(&[[0.0, 0.0], [1.0, 0.0]]).is_empty());
        assert_eq!(seen(&[[0.0, 0.5]]), [[0.0, 1.0]]);
        assert_eq!(seen(&[[0.0, 0.0], [0.25, 0.0], [0.5, 1.0], [0.75, 0.0], [1.0, 0.0]]), [[0.25f32.next_up(), 0.75f32.next_down()]]);
        // Two peaks that touch at 0 in between; a step up and one down.
        let touching = [[0.0, 0.0], [0.25, 1.0], [0.5, 0.0], [0.75, 1.0], [1.0, 0.0]];
        assert_eq!(seen(&touching), [[f32::MIN_POSITIVE, 0.5f32.next_down()], [0.5f32.next_up(), 1f32.next_down()]]);
        assert_eq!(seen(&[[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.75, 1.0], [0.75, 0.0]]), [[0.5, 0.75]]);
    }

    #[test]
    fn a_range_of_its_own_moves_the_knots() {
        let ramp = TransferFunction { opacity: vec![[0.0, 0.0], [1.0, 1.0]], range: Some([10.0, 20.0]), ..TransferFunction::standard() };
        // The array spans 0 to 40: normalised 1/4 and 1/2 are the transfer function's 0 and 1.
        for (value, expected) in [(0.0, 0.0), (0.25, 0.0), (0.375, 0.5), (0.5, 1.0), (1.0, 1.0)] {
            assert!((classified(&ramp, [0.0, 40.0], value).extinction - expected).abs() < 1e-6, "{value}");
        }
        // It spans only 14 to 16.
        assert!((classified(&ramp, [14.0, 16.0], 0.0).extinction - 0.4).abs() < 1e-6);
        assert!((classified(&ramp, [14.0, 16.0], 1.0).extinction - 0.6).abs() < 1e-6);
    }

    #[test]
    fn constant_fields_have_one_colour() {
        let ramp = TransferFunction { opacity: vec![[0.0, 0.0], [1.0, 1.0]], range: Some([0.0, 4.0]), ..TransferFunction::standard() };
        assert!((classified(&ramp, [3.0, 3.0], 0.0).extinction - 0.75).abs() < 1e-6);
        let own_range = TransferFunction { range: None, ..ramp };
        assert_eq!(classified(&own_range, [3.0, 3.0], 0.0).extinction, 0.0);
    }

    #[test]
    fn exponential_opacity_is_the_opacity_of_a_unit_slab() {
        let opacity = vec![[0.0, 0.5], [1.0, 1.0]];
        let tf = TransferFunction {
            opacity,
            opacity_model: OpacityModel::Exponential,
            unit_distance: Some(2.0),
            ..TransferFunction::standard()
        };
        let half = classified(&tf, [0.0, 1.0], 0.0).extinction;
        assert!((1.0 - (-2.0 * half).exp() - 0.5).abs() < 1e-6);
        assert!((classified(&tf, [0.0, 1.0], 1.0).extinction * 2.0 - 13.863).abs() < 1e-2, "opaque is clamped");
    }
}
