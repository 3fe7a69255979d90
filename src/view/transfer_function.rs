//! Transfer functions: piecewise linear colour and opacity over the normalised scalar (`conventions.md`).

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
    /// Names that [`TransferFunction::preset`] knows. All but `standard` are colour maps over a linear ramp of opacity.
    pub const PRESETS: [&'static str; 7] = ["standard", "viridis", "inferno", "turbo", "coolwarm", "rainbow", "grey"];

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
        }
    }

    /// A preset by name; a colour map's opacity rises linearly from 0 to 0.5.
    pub fn preset(name: &str) -> Result<Self, TransferFunctionError> {
        // Samples at equal distances of the maps as their authors publish them (matplotlib's tables, Moreland's cool to warm).
        let rgb: &[[u8; 3]] = match name {
            "standard" => return Ok(Self::standard()),
            "viridis" => &[
                [68, 1, 84],
                [71, 44, 122],
                [59, 81, 139],
                [44, 113, 142],
                [33, 144, 141],
                [39, 173, 129],
                [92, 200, 99],
                [170, 220, 50],
                [253, 231, 37],
            ],
            "inferno" => &[
                [0, 0, 4],
                [31, 12, 72],
                [85, 15, 109],
                [136, 34, 106],
                [186, 54, 85],
                [227, 89, 51],
                [249, 140, 10],
                [249, 201, 50],
                [252, 255, 164],
            ],
            "turbo" => &[
                [48, 18, 59],
                [70, 107, 227],
                [40, 187, 236],
                [49, 242, 153],
                [162, 252, 60],
                [237, 208, 58],
                [251, 128, 34],
                [210, 49, 5],
                [122, 4, 3],
            ],
            "coolwarm" => &[
                [59, 76, 192],
                [98, 130, 234],
                [141, 176, 254],
                [184, 208, 249],
                [221, 221, 221],
                [245, 196, 173],
                [244, 154, 123],
                [222, 96, 77],
                [180, 4, 38],
            ],
            "rainbow" => &[[0, 0, 255], [0, 255, 255], [0, 255, 0], [255, 255, 0], [255, 0, 0]],
            "grey" => &[[0, 0, 0], [255, 255, 255]],
            other => return Err(TransferFunctionError::UnknownPreset { name: other.to_owned() }),
        };
        let last = (rgb.len() - 1) as f64;
        let color = rgb.iter().enumerate().map(|(i, c)| {
            let [r, g, b] = c.map(|v| f64::from(v) / 255.0);
            [i as f64 / last, r, g, b]
        });
        Ok(TransferFunction { color: color.collect(), opacity: vec![[0.0, 0.0], [1.0, 0.5]], ..Self::standard() })
    }

    /// Checks knots, unit distance and range.
    pub fn validate(&self) -> Result<(), TransferFunctionError> {
        check_knots("color", &self.color)?;
        check_knots("opacity", &self.opacity)?;
        match self.unit_distance {
            Some(u) if !(u.is_finite() && u > 0.0) => return Err(TransferFunctionError::UnitDistance(u)),
            _ => {}
        }
        match self.range {
            Some(r) if !(r[0].is_finite() && r[1].is_finite() && r[0] < r[1]) => Err(TransferFunctionError::Range(r)),
            _ => Ok(()),
        }
    }

    /// The unit distance in world units, given the length of the mesh bounds' diagonal.
    pub fn unit_distance_world(&self, bounds_diagonal: f64) -> f64 {
        self.unit_distance.unwrap_or(bounds_diagonal / 50.0)
    }
}

fn check_knots<const N: usize>(what: &'static str, knots: &[[f64; N]]) -> Result<(), TransferFunctionError> {
    if knots.is_empty() {
        return Err(TransferFunctionError::Empty(what));
    }
    for (index, knot) in knots.iter().enumerate() {
        let ascends = index == 0 || knots[index - 1][0] <= knot[0];
        if !(ascends && knot[0].is_finite() && knot[1..].iter().all(|v| (0.0..=1.0).contains(v))) {
            return Err(TransferFunctionError::Knot { what, index, values: knot.to_vec() });
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
        let back: TransferFunction = serde_json::from_str(&serde_json::to_string(&tf).expect("writes")).expect("reads");
        assert_eq!(back, tf);
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
    }
}
