//! Round numbers along an axis, and how they are written.

use crate::view::TransferFunction;

/// Marks may lie this many times farther apart in one place than in another; beyond, they go by powers of ten.
const MOST_UNEVEN: f64 = 3.0;

/// A mark on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Where, in data units.
    pub value: f64,
    /// The same in writing.
    pub label: String,
}

/// The multiples of 1, 2 or 5 times a power of ten in a range, at most `most` >= 1 of them, as many as that allows. None if the range
/// has no extent.
pub fn round_ticks([lo, hi]: [f64; 2], most: usize) -> Vec<Tick> {
    let extent = hi - lo;
    if !(extent > 0.0 && extent.is_finite()) || extent < 1e-12 * lo.abs().max(hi.abs()) {
        return Vec::new();
    }
    let exponent = (extent / (most + 1) as f64).log10().floor() as i32;
    let steps = (exponent..exponent + 4).flat_map(|e| [1.0, 2.0, 5.0].map(|m| (m, e)));
    for (mantissa, exponent) in steps {
        // Powers of ten below 1 are not exact, their inverses are.
        let at = |n: f64| if exponent < 0 { n * mantissa / 10f64.powi(-exponent) } else { n * mantissa * 10f64.powi(exponent) };
        let step = at(1.0);
        let (first, last) = ((lo / step - 1e-9).ceil(), (hi / step + 1e-9).floor());
        if last - first < most as f64 {
            let count = (last - first + 1.0).max(0.0) as usize;
            return (0..count).map(|i| at(first + i as f64)).map(|value| Tick { value, label: label(value, exponent) }).collect();
        }
    }
    Vec::new()
}

/// A multiple of `10^exponent` as it is written: with as many decimals as that has, or with a power of ten.
fn label(value: f64, exponent: i32) -> String {
    let value = if value == 0.0 { 0.0 } else { value }; // no -0
    if exponent < -5 || value.abs() >= 1e6 {
        let digits = if value == 0.0 { 0 } else { (value.abs().log10().floor() as i32 - exponent).max(0) as usize };
        let text = format!("{value:.digits$e}");
        return if value == 0.0 { "0".into() } else { text };
    }
    format!("{value:.*}", (-exponent).max(0) as usize)
}

/// Any number with four digits that count.
pub fn short(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || !(1e-4..1e6).contains(&magnitude) {
        return if value == 0.0 { "0".into() } else { format!("{value:.3e}") };
    }
    let decimals = (3 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Where on the scalar bar a value stands, 0 at its lower end and 1 at its upper one. `range` is the field's, data units.
pub fn x_at(tf: &TransferFunction, range: [f64; 2], value: f64) -> f64 {
    tf.position(value, range)
}

/// Marks for the values from `range[0]` to `range[1]` whose places on [0, 1] are `x_at`: round numbers if these come at about equal
/// distances, else powers of ten, as on a logarithmic scale.
pub fn scale_ticks(range: [f64; 2], most: usize, x_at: impl Fn(f64) -> f64) -> Vec<Tick> {
    let linear = round_ticks(range, most);
    let gaps = |ticks: &[Tick]| ticks.windows(2).map(|pair| x_at(pair[1].value) - x_at(pair[0].value)).collect::<Vec<_>>();
    let [least, largest] = gaps(&linear).iter().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], &gap| [a.min(gap), b.max(gap)]);
    // The places before the first and after the last count as well: a scale may crowd all marks at one end.
    let before = linear.first().map_or(0.0, |tick| x_at(tick.value));
    if linear.len() < 2 || largest.max(before) <= MOST_UNEVEN * least {
        return linear;
    }
    let [lo, hi] = range;
    let top = lo.abs().max(hi.abs()).log10().floor() as i32;
    let bottom = if lo * hi > 0.0 {
        lo.abs().min(hi.abs()).log10().floor() as i32
    } else {
        // The least power of ten that is told apart from the one before.
        let sign = if hi >= -lo { 1.0 } else { -1.0 };
        let x = |e: i32| x_at(sign * 10f64.powi(e));
        (top - 18..=top).find(|&e| (x(e) - x(e - 1)).abs() > 0.3 / most as f64).unwrap_or(top)
    };
    let of = |mantissas: &[f64], every: i32| -> Vec<Tick> {
        let exponents = (bottom..=top).filter(|e| e.rem_euclid(every) == 0);
        let positive = exponents.flat_map(|e| mantissas.iter().map(move |m| (m * 10f64.powi(e), e)));
        let both = positive.flat_map(|(v, e)| [(v, e), (-v, e)]).chain([(0.0, 0)]);
        let inside = both.filter(|(v, _)| (lo..=hi).contains(v));
        let mut ticks: Vec<Tick> = inside.map(|(value, _)| Tick { value, label: short(value) }).collect();
        ticks.sort_by(|a, b| a.value.total_cmp(&b.value));
        ticks
    };
    let choices = [of(&[1.0, 2.0, 5.0], 1), of(&[1.0], 1), of(&[1.0], 2), of(&[1.0], 3), of(&[1.0], 6)];
    let chosen = choices.iter().find(|ticks| ticks.len() <= most).unwrap_or(&choices[4]);
    chosen.clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_as_many_as_fit() {
        assert_eq!(labels(&round_ticks([0.1926, 4.9775], 6)), ["1", "2", "3", "4"]);
        assert_eq!(labels(&round_ticks([-0.21, 0.3], 6)), ["-0.2", "-0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(&round_ticks([0.0, 1.0], 3)), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(&round_ticks([101_300.0, 101_900.0], 5)), ["101400", "101600", "101800"]);
        assert_eq!(labels(&round_ticks([0.0, 3e7], 4)), ["0", "1e7", "2e7", "3e7"]);
        assert_eq!(labels(&round_ticks([0.0, 2.4e-7], 4)), ["0", "1e-7", "2e-7"]);
        for range in [[1.0, 1.0], [2.0, 1.0], [0.0, f64::INFINITY], [f64::NAN, 1.0], [1.0, 1.0 + 1e-15]] {
            assert_eq!(round_ticks(range, 5), [], "{range:?}");
        }
        for most in 1..12 {
            for range in [[0.0, 1.0], [-3.7, 1e3], [1e-9, 3e-9]] {
                let count = round_ticks(range, most).len();
                assert!(count <= most && (most < 2 || 3 * count >= most), "{count} of {most} in {range:?}");
            }
        }
    }

    #[test]
    fn a_logarithmic_scale_has_powers_of_ten() {
        let log = |range: [f64; 2]| move |v: f64| (v / range[0]).ln() / (range[1] / range[0]).ln();
        let decades = [1e-2, 1e4];
        assert_eq!(labels(&scale_ticks(decades, 7, log(decades))), ["0.01", "0.1", "1", "10", "100", "1000", "10000"]);
        assert_eq!(labels(&scale_ticks(decades, 4, log(decades))), ["0.01", "1", "100", "10000"]);
        let short = [0.5, 40.0];
        assert_eq!(labels(&scale_ticks(short, 7, log(short))), ["0.5", "1", "2", "5", "10", "20"]);
        let nearly_even = [10.0, 14.0];
        assert_eq!(labels(&scale_ticks(nearly_even, 5, log(nearly_even))), ["10", "11", "12", "13", "14"]);
        // Linear up to 1, logarithmic beyond, on both sides.
        let symlog = |v: f64| 0.5 + 0.5 * v.signum() * (1.0 + v.abs()).ln() / 1001f64.ln();
        assert_eq!(labels(&scale_ticks([-1000.0, 1000.0], 9, symlog)), ["-1000", "-100", "-10", "-1", "0", "1", "10", "100", "1000"]);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.0, 0.1926, 4.9776, -1234.56, 2.5e-7, 7e8].map(short), ["0", "0.1926", "4.978", "-1235", "2.500e-7", "7.000e8"]);
    }
}
