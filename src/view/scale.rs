//! How the values of a range are laid out over a transfer function's x.

use serde::{Deserialize, Serialize};

/// What of its range's largest magnitude is linear on a symlog scale that names no threshold.
const LINEAR_PART: f64 = 1e-3;

/// How x in [0, 1] follows the value s over a range `[lo, hi]`. In JSON: `"linear"`, `"log"`, `"symlog"` or `{"symlog": threshold}`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub enum Scale {
    /// `x = (s - lo) / (hi - lo)`.
    #[default]
    Linear,
    /// `x = log(s / lo) / log(hi / lo)`, for ranges above 0.
    Log,
    /// `x = (y(s) - y(lo)) / (y(hi) - y(lo))`, where y is `s / t` up to a threshold `|s| <= t`, and beyond it `1 + log(s / t)`, with its sign:
    /// values of both signs, smooth where the parts meet. `None`: a thousandth of the largest magnitude of the range.
    Symlog(Option<f64>),
}

/// A scale as files have it.
#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"linear\", \"log\", \"symlog\" or {\"symlog\": threshold}")]
enum Written {
    Name(String),
    Symlog { symlog: f64 },
}

impl TryFrom<Written> for Scale {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        match written {
            Written::Name(name) => name.parse(),
            Written::Symlog { symlog } => Ok(Scale::Symlog(Some(symlog))),
        }
    }
}

impl From<Scale> for Written {
    fn from(scale: Scale) -> Self {
        match scale {
            Scale::Linear => Written::Name("linear".into()),
            Scale::Log => Written::Name("log".into()),
            Scale::Symlog(None) => Written::Name("symlog".into()),
            Scale::Symlog(Some(symlog)) => Written::Symlog { symlog },
        }
    }
}

/// `linear`, `log`, `symlog` or `symlog=T` with a threshold above 0.
impl std::str::FromStr for Scale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let threshold = |t: &str| t.parse::<f64>().ok().filter(|t| t.is_finite() && *t > 0.0);
        match text.split_once('=') {
            None if text == "linear" => Ok(Scale::Linear),
            None if text == "log" => Ok(Scale::Log),
            None if text == "symlog" => Ok(Scale::Symlog(None)),
            Some(("symlog", t)) if threshold(t).is_some() => Ok(Scale::Symlog(threshold(t))),
            _ => Err(format!("the scale is \"{text}\", expected linear, log, symlog or symlog=T with a threshold T above 0")),
        }
    }
}

impl Scale {
    /// Whether values of this range have places on the scale: it ascends, and lies above 0 for a logarithm.
    pub fn fits(self, [lo, hi]: [f64; 2]) -> bool {
        let ascends = lo < hi && (hi - lo).is_finite();
        ascends && (self != Scale::Log || (lo > 0.0 && (hi / lo).is_finite()))
    }

    /// This scale if it fits a range, else the linear one.
    pub fn or_linear(self, range: [f64; 2]) -> Self {
        if self.fits(range) { self } else { Scale::Linear }
    }

    /// The threshold up to which values of a range are linear; `None` where the scale has none.
    pub fn threshold(self, [lo, hi]: [f64; 2]) -> Option<f64> {
        match self {
            Scale::Linear | Scale::Log => None,
            Scale::Symlog(given) => Some(given.unwrap_or(LINEAR_PART * lo.abs().max(hi.abs())).max(f64::MIN_POSITIVE)),
        }
    }

    /// The place x of a value; 0 and 1 are the ends of the range, which must fit ([`Scale::fits`]) or be without extent: then x is 0. On a
    /// log scale values up to 0 lie at minus infinity.
    pub fn position(self, range: [f64; 2], value: f64) -> f64 {
        let [lo, hi] = range;
        if lo >= hi {
            return 0.0;
        }
        match self {
            Scale::Linear => (value - lo) / (hi - lo),
            Scale::Log if value <= 0.0 => f64::NEG_INFINITY,
            Scale::Log => (value / lo).ln() / (hi / lo).ln(),
            Scale::Symlog(_) => {
                let [s, lo, hi] = [value, lo, hi].map(|v| self.compressed(range, v));
                (s - lo) / (hi - lo)
            }
        }
    }

    /// The value at a place x, the inverse of [`Scale::position`]; at 0 and 1 the ends of the range to the bit.
    pub fn value(self, range: [f64; 2], x: f64) -> f64 {
        let [lo, hi] = range;
        if x == 0.0 || x == 1.0 || lo >= hi {
            return if x == 1.0 { hi } else { lo };
        }
        match self {
            Scale::Linear => lo * (1.0 - x) + hi * x,
            Scale::Log => lo * (hi / lo).powf(x),
            Scale::Symlog(_) => {
                let t = self.threshold(range).unwrap_or(1.0);
                let [lo, hi] = range.map(|v| self.compressed(range, v));
                let y = lo * (1.0 - x) + hi * x;
                t * if y.abs() <= 1.0 { y } else { (y.abs() - 1.0).exp().copysign(y) }
            }
        }
    }

    /// y of the symlog scale.
    fn compressed(self, range: [f64; 2], value: f64) -> f64 {
        let y = value / self.threshold(range).unwrap_or(1.0);
        if y.abs() <= 1.0 { y } else { (1.0 + y.abs().ln()).copysign(y) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_the_formulas() {
        assert_eq!(Scale::Linear.position([2.0, 6.0], 3.0), 0.25);
        assert!((Scale::Log.position([1e-3, 1e3], 1.0) - 0.5).abs() < 1e-15);
        assert!((Scale::Log.position([1.0, 1000.0], 10.0) - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(Scale::Log.position([1.0, 1000.0], -1.0), f64::NEG_INFINITY);
        let symlog = Scale::Symlog(Some(0.5));
        let e = std::f64::consts::E;
        // y goes from -2 to 2.
        for (value, x) in [(-0.5 * e, 0.0), (-0.5, 0.25), (0.0, 0.5), (0.25, 0.625), (0.5, 0.75), (0.5 * e, 1.0)] {
            assert!((symlog.position([-0.5 * e, 0.5 * e], value) - x).abs() < 1e-15, "{value}");
        }
        assert_eq!(Scale::Symlog(None).threshold([-5.0, 2.0]), Some(0.005));
        assert_eq!(Scale::Log.position([3.0, 3.0], 7.0), 0.0, "a range without extent");
    }

    #[test]
    fn values_are_found_again() {
        for (scale, range) in [
            (Scale::Linear, [-3.0, 5.0]),
            (Scale::Log, [1e-12, 4e7]),
            (Scale::Symlog(None), [-3.0, 5.0]),
            (Scale::Symlog(Some(1e-9)), [-1e3, 7.0]),
            (Scale::Symlog(Some(10.0)), [0.5, 7.0]),
        ] {
            let size = f64::abs(range[0]).max(f64::abs(range[1]));
            for k in 0..=64 {
                let x = f64::from(k) / 64.0;
                let value = scale.value(range, x);
                assert!((scale.position(range, value) - x).abs() < 1e-13, "{scale:?} at {x}");
                assert!((scale.value(range, scale.position(range, value)) - value).abs() <= 1e-12 * size);
            }
            assert_eq!([scale.value(range, 0.0), scale.value(range, 1.0)], range);
        }
    }

    #[test]
    fn a_logarithm_needs_what_it_is_of() {
        assert!(Scale::Log.fits([1e-300, 1.0]) && !Scale::Log.fits([0.0, 1.0]) && !Scale::Log.fits([-1.0, 1.0]));
        assert!(Scale::Symlog(None).fits([-1.0, 1.0]) && !Scale::Linear.fits([1.0, 1.0]));
        assert_eq!(Scale::Log.or_linear([-1.0, 1.0]), Scale::Linear);
    }

    #[test]
    fn scales_are_read_as_written() {
        for (scale, text) in [
            (Scale::Linear, "\"linear\""),
            (Scale::Log, "\"log\""),
            (Scale::Symlog(None), "\"symlog\""),
            (Scale::Symlog(Some(0.5)), "{\"symlog\":0.5}"),
        ] {
            assert_eq!(serde_json::to_string(&scale).expect("writes"), text);
            assert_eq!(serde_json::from_str::<Scale>(text).expect("reads"), scale);
        }
        assert_eq!("symlog=2".parse(), Ok(Scale::Symlog(Some(2.0))));
        assert!("symlog=-2".parse::<Scale>().is_err() && "log=2".parse::<Scale>().is_err());
        let error = serde_json::from_str::<Scale>("\"cubic\"").expect_err("unknown").to_string();
        assert!(error.contains("symlog"), "{error}");
    }
}
