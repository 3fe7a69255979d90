//! Transfer functions: piecewise linear colour and opacity over the normalised scalar (`conventions.md`).

use super::{ColorMap, Scale};
use serde::{Deserialize, Serialize};

/// How opacity becomes extinction (maths 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OpacityModel {
    /// `tau = a / unit_distance` (VTK's unstructured mappers).
    #[default]
    Linear,
    /// `tau = -ln(1 - a) / unit_distance`, so that a slab of the unit distance has opacity a (VTK's regular-grid mappers).
    Exponential,
}

/// A transfer function as its file states it. Knots are ascending in x; two knots at one x make a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferFunction {
    /// `[x, r, g, b]`, linear RGB in [0, 1], not multiplied by opacity.
    pub color: Vec<[f64; 4]>,
    /// `[x, opacity]`, opacity in [0, 1].
    pub opacity: Vec<[f64; 2]>,
    /// What opacity means.
    #[serde(default)]
    pub opacity_model: OpacityModel,
    /// World length that opacity refers to; `None`: the bounds' diagonal / 50.
    #[serde(default)]
    pub unit_distance: Option<f64>,
    /// `[lo, hi]` in data units that x = 0 and x = 1 stand for; `None`: the array's own range.
    #[serde(default)]
    pub range: Option<[f64; 2]>,
    /// How x follows the value over the range.
    #[serde(default, skip_serializing_if = "is_linear")]
    pub scale: Scale,
    /// So many discrete colours, at least 1, in place of continuous ones; opacity stays as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// Colour of values below the range; `None`: the range's colours go on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<[f64; 3]>,
    /// Colour of values above the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<[f64; 3]>,
    /// `[from, to]` in data units: values outside are transparent, whatever their opacity. It is of the volume's light only: surfaces, planes
    /// and numbers stay as they are. `None`: none are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub threshold: Option<[f64; 2]>,
    /// Colour of missing values on surfaces; in a volume they are transparent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nan: Option<[f64; 3]>,
}

/// Most discrete colours that make sense.
const MOST_STEPS: u32 = 1024;

fn is_linear(scale: &Scale) -> bool {
    *scale == Scale::Linear
}

/// Why a transfer function cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TransferFunctionError {
    /// Colour or opacity has no knots.
    #[error("the transfer function has no {0} knots")]
    Empty(&'static str),
    /// Knots must ascend and hold finite numbers in range.
    #[error("{what} knot {index} is {values:?}: expected finite numbers, x not below the knot before, values in [0, 1]")]
    Knot {
        /// "color" or "opacity".
        what: &'static str,
        /// From 0.
        index: usize,
        /// The knot.
        values: Vec<f64>,
    },
    /// unit_distance must be positive.
    #[error("unit_distance is {0}, expected a finite number above 0 or null")]
    UnitDistance(f64),
    /// range must ascend.
    #[error("range is [{}, {}], expected two finite numbers with the first below the second, or null", .0[0], .0[1])]
    Range([f64; 2]),
    /// A threshold must not descend.
    #[error("threshold is [{}, {}], expected two finite numbers with the first not above the second, or null", .0[0], .0[1])]
    Thresholds([f64; 2]),
    /// A logarithm of what has none.
    #[error("scale \"log\" needs a range above 0, and that of the {of} is {} to {}; name another range, or take \"symlog\"", .range[0], .range[1])]
    Log {
        /// "transfer function" or "data".
        of: &'static str,
        /// It.
        range: [f64; 2],
    },
    /// The symlog threshold must be positive.
    #[error("the threshold of scale \"symlog\" is {0}, expected a finite number above 0")]
    Threshold(f64),
    /// On other scales than the linear one knots lie in the range.
    #[error("{what} knot {index} lies at {x}; on a scale that is not linear x must be in [0, 1]")]
    KnotBeyond {
        /// "color" or "opacity".
        what: &'static str,
        /// From 0.
        index: usize,
        /// Its place.
        x: f64,
    },
    /// A number of discrete colours that is none.
    #[error("steps is {0}, expected 1 to {MOST_STEPS}, or null")]
    Steps(u32),
    /// A colour that is none.
    #[error("{what} is {color:?}, expected three numbers in [0, 1], or null")]
    Color {
        /// "below", "above" or "nan".
        what: &'static str,
        /// It.
        color: [f64; 3],
    },
    /// No preset of that name.
    #[error("there is no transfer function \"{name}\"; presets are {}", TransferFunction::PRESETS.join(", "))]
    UnknownPreset {
        /// The name asked for.
        name: String,
    },
}

impl Default for TransferFunction {
    fn default() -> Self {
        Self::standard()
    }
}

impl TransferFunction {
    /// Names that [`TransferFunction::preset`] knows. All but `standard` are [`ColorMap::PRESETS`] over a linear ramp of opacity.
    pub const PRESETS: [&'static str; 10] =
        ["standard", "fast", "coolwarm", "viridis", "inferno", "turbo", "grey", "xray", "blackbody", "rainbow"];

    /// The standard transfer function, the one of the reference images.
    pub fn standard() -> Self {
        TransferFunction {
            color: vec![
                [0.00, 0.05, 0.10, 0.60],
                [0.15, 0.10, 0.60, 0.90],
                [0.30, 0.20, 0.85, 0.30],
                [0.55, 0.95, 0.85, 0.10],
                [1.00, 0.90, 0.10, 0.05],
            ],
            opacity: vec![[0.00, 0.00], [0.14, 0.00], [0.20, 0.06], [0.35, 0.20], [0.60, 0.60], [1.00, 0.95]],
            opacity_model: OpacityModel::Linear,
            unit_distance: None,
            range: None,
            scale: Scale::Linear,
            steps: None,
            below: None,
            above: None,
            threshold: None,
            nan: None,
        }
    }

    /// A preset by its name, or by ParaView's ("Cool to Warm"); a colour map's opacity rises linearly from 0 to 0.5.
    pub fn preset(name: &str) -> Result<Self, TransferFunctionError> {
        if name == "standard" {
            return Ok(Self::standard());
        }
        let map = ColorMap::preset(name).ok_or_else(|| TransferFunctionError::UnknownPreset { name: name.to_owned() })?;
        Ok(Self::of_color(map.bake()))
    }

    /// Colours over the usual ramp of opacity, from 0 to 0.5.
    pub fn of_color(color: Vec<[f64; 4]>) -> Self {
        TransferFunction { color, opacity: vec![[0.0, 0.0], [1.0, 0.5]], ..Self::standard() }
    }

    /// Checks everything but what depends on the data ([`TransferFunction::check_range`]).
    pub fn validate(&self) -> Result<(), TransferFunctionError> {
        check_knots("color", &self.color, self.scale)?;
        check_knots("opacity", &self.opacity, self.scale)?;
        match self.unit_distance {
            Some(u) if !(u.is_finite() && u > 0.0) => return Err(TransferFunctionError::UnitDistance(u)),
            _ => {}
        }
        if let Some(range) = self.range {
            if !(range[0].is_finite() && range[1].is_finite() && range[0] < range[1]) {
                return Err(TransferFunctionError::Range(range));
            }
            if !self.scale.fits(range) && self.scale == Scale::Log {
                return Err(TransferFunctionError::Log { of: "transfer function", range });
            }
        }
        if let Some([from, to]) = self.threshold.filter(|[from, to]| !(from.is_finite() && to.is_finite() && from <= to)) {
            return Err(TransferFunctionError::Thresholds([from, to]));
        }
        match self.scale {
            Scale::Symlog(Some(t)) if !(t.is_finite() && t > 0.0) => return Err(TransferFunctionError::Threshold(t)),
            _ => {}
        }
        if let Some(steps) = self.steps.filter(|steps| !(1..=MOST_STEPS).contains(steps)) {
            return Err(TransferFunctionError::Steps(steps));
        }
        for (what, color) in [("below", self.below), ("above", self.above), ("nan", self.nan)] {
            if let Some(color) = color.filter(|color| !color.iter().all(|v| (0.0..=1.0).contains(v))) {
                return Err(TransferFunctionError::Color { what, color });
            }
        }
        Ok(())
    }

    /// `Err` if the scale does not fit a field with these smallest and largest values, data units. Such a function would be drawn as a
    /// linear one.
    pub fn check_range(&self, data_range: [f64; 2]) -> Result<(), TransferFunctionError> {
        let [lo, hi] = data_range;
        let taken = self.range.is_none() && self.scale == Scale::Log && !(lo > 0.0 && (hi / lo).is_finite());
        if taken { Err(TransferFunctionError::Log { of: "data", range: data_range }) } else { Ok(()) }
    }

    /// The unit distance in world units, given the length of the mesh bounds' diagonal.
    pub fn unit_distance_world(&self, bounds_diagonal: f64) -> f64 {
        self.unit_distance.unwrap_or(bounds_diagonal / 50.0)
    }
}

fn check_knots<const N: usize>(what: &'static str, knots: &[[f64; N]], scale: Scale) -> Result<(), TransferFunctionError> {
    if knots.is_empty() {
        return Err(TransferFunctionError::Empty(what));
    }
    for (index, knot) in knots.iter().enumerate() {
        let ascends = index == 0 || knots[index - 1][0] <= knot[0];
        if !(ascends && knot[0].is_finite() && knot[1..].iter().all(|v| (0.0..=1.0).contains(v))) {
            return Err(TransferFunctionError::Knot { what, index, values: knot.to_vec() });
        }
        if scale != Scale::Linear && !(0.0..=1.0).contains(&knot[0]) {
            return Err(TransferFunctionError::KnotBeyond { what, index, x: knot[0] });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_valid_and_spans_the_range() {
        for name in TransferFunction::PRESETS {
            let tf = TransferFunction::preset(name).expect(name);
            tf.validate().expect(name);
            assert_eq!((tf.color[0][0], tf.color[tf.color.len() - 1][0]), (0.0, 1.0), "{name}");
        }
        assert!(TransferFunction::preset("jet2").is_err_and(|e| e.to_string().contains("viridis")));
    }

    #[test]
    fn a_file_may_leave_out_what_has_a_default() {
        let tf: TransferFunction = serde_json::from_str(r#"{"color": [[0,1,1,1]], "opacity": [[0,0],[1,1]]}"#).expect("minimal");
        assert_eq!((tf.opacity_model, tf.unit_distance, tf.range), (OpacityModel::Linear, None, None));
        let written = serde_json::to_string(&tf).expect("writes");
        assert!(!["scale", "steps", "below", "above", "threshold", "nan"].iter().any(|key| written.contains(key)), "{written}");
        assert_eq!(serde_json::from_str::<TransferFunction>(&written).expect("reads"), tf);
        let full = TransferFunction {
            scale: Scale::Symlog(Some(0.25)),
            steps: Some(7),
            below: Some([0.0, 0.5, 1.0]),
            above: Some([1.0; 3]),
            threshold: Some([-0.1, 0.7]),
            nan: Some([1.0, 1.0, 0.0]),
            ..tf
        };
        let written = serde_json::to_string(&full).expect("writes");
        assert_eq!(serde_json::from_str::<TransferFunction>(&written).expect("reads"), full);
    }

    #[test]
    fn a_logarithm_asks_for_a_range_above_zero() {
        let log = TransferFunction { scale: Scale::Log, ..TransferFunction::standard() };
        log.validate().expect("the data may be above 0");
        log.check_range([0.5, 2.0]).expect("they are");
        let error = log.check_range([-0.5, 2.0]).expect_err("they are not").to_string();
        assert!(error.contains("-0.5 to 2") && error.contains("data") && error.contains("symlog"), "{error}");
        let ranged = TransferFunction { range: Some([0.1, 2.0]), ..log.clone() };
        ranged.check_range([-0.5, 2.0]).expect("its own range counts");
        assert!(matches!(TransferFunction { range: Some([0.0, 2.0]), ..log }.validate(), Err(TransferFunctionError::Log { .. })));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let mut tf = TransferFunction::standard();
        tf.opacity[2][1] = 1.5;
        assert!(matches!(tf.validate(), Err(TransferFunctionError::Knot { what: "opacity", index: 2, .. })));
        let mut tf = TransferFunction::standard();
        tf.color.swap(1, 2);
        assert!(matches!(tf.validate(), Err(TransferFunctionError::Knot { what: "color", index: 2, .. })));
        let tf = TransferFunction { range: Some([2.0, 1.0]), ..TransferFunction::standard() };
        assert_eq!(tf.validate(), Err(TransferFunctionError::Range([2.0, 1.0])));
        let of = |change: fn(&mut TransferFunction)| {
            let mut tf = TransferFunction::standard();
            change(&mut tf);
            tf.validate().expect_err("wrong").to_string()
        };
        assert!(of(|tf| tf.steps = Some(0)).contains("steps is 0"));
        assert!(of(|tf| tf.threshold = Some([2.0, 1.0])).contains("threshold is [2, 1]"));
        TransferFunction { threshold: Some([1.0, 1.0]), ..TransferFunction::standard() }.validate().expect("one value");
        assert!(of(|tf| tf.above = Some([0.0, 2.0, 0.0])).contains("above is [0.0, 2.0, 0.0]"));
        assert!(of(|tf| tf.scale = Scale::Symlog(Some(0.0))).contains("threshold"));
        let beyond = of(|tf| (tf.scale, tf.opacity[5][0]) = (Scale::Symlog(None), 1.5));
        assert!(beyond.contains("opacity knot 5 lies at 1.5"), "{beyond}");
    }
}
