//! Which settings a sweep goes through.

use crate::octree::{OctreeParams, Preset, Reconstruction};

/// A sweep: tolerances times depths, variances with each reconstruction, and the presets. What is not swept is the default's.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// R, relative to the field's range; with each of `depths`.
    pub tolerances: Vec<f64>,
    /// Dmax; presets deeper than the deepest are left out.
    pub depths: Vec<u8>,
    /// W, by V and W instead of a tolerance; with both reconstructions and each of `variance_depths`.
    pub variances: Vec<f64>,
    /// Dmax for `variances`.
    pub variance_depths: Vec<u8>,
}

/// What decides about a setting's leaves, and what the field is between its samples: settings of one kind make one curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A tolerance, continuous.
    Tolerance,
    /// A tolerance, one sample a leaf.
    ToleranceLeaf,
    /// V and W, continuous.
    Thresholds,
    /// V and W, one sample a leaf: the paper's.
    ThresholdsLeaf,
}

impl Kind {
    /// All kinds with their names.
    pub const ALL: [(Kind, &'static str); 4] = [
        (Kind::Tolerance, "tolerance"),
        (Kind::ToleranceLeaf, "tolerance, leaf"),
        (Kind::Thresholds, "V and W"),
        (Kind::ThresholdsLeaf, "V and W, leaf"),
    ];

    /// The kind of a setting.
    pub fn of(params: &OctreeParams) -> Kind {
        match (params.tolerance, params.reconstruction) {
            (Some(_), Reconstruction::Continuous) => Kind::Tolerance,
            (Some(_), Reconstruction::Leaf) => Kind::ToleranceLeaf,
            (None, Reconstruction::Continuous) => Kind::Thresholds,
            (None, Reconstruction::Leaf) => Kind::ThresholdsLeaf,
        }
    }
}

impl Plan {
    /// The sweep that serves most meshes: about 30 settings around the default.
    pub fn full() -> Self {
        let depth = OctreeParams::default().max_depth;
        Plan {
            tolerances: around_default(&[4.0, 2.0, 1.0, 0.5, 0.25, 0.125]),
            depths: (depth.saturating_sub(2).max(1)..=(depth + 1).min(OctreeParams::DEPTH_LIMIT)).collect(),
            variances: vec![4e-3, 1e-3, 2.5e-4, 6e-5],
            variance_depths: vec![depth],
        }
    }

    /// A first impression: about 10 settings.
    pub fn quick() -> Self {
        let depth = OctreeParams::default().max_depth;
        Plan {
            tolerances: around_default(&[4.0, 1.0]),
            depths: vec![depth.saturating_sub(2).max(1), depth],
            variances: vec![1e-3],
            variance_depths: vec![depth],
        }
    }

    /// The settings, each once: shallow before deep and coarse before fine, so that a sweep that is stopped has the cheap ones and one that
    /// runs out of memory knows what needs more.
    pub fn settings(&self) -> Vec<OctreeParams> {
        let (base, deepest) = (OctreeParams::default(), self.depths.iter().copied().max().unwrap_or(0));
        let mut settings: Vec<OctreeParams> = Vec::new();
        let mut add = |params: OctreeParams| {
            if !settings.contains(&params) {
                settings.push(params);
            }
        };
        for &max_depth in &ascending(&self.depths) {
            for &tolerance in ascending(&self.tolerances).iter().rev() {
                add(OctreeParams { tolerance: Some(tolerance), max_depth, ..base.clone() });
            }
        }
        for &max_depth in &ascending(&self.variance_depths) {
            for reconstruction in [Reconstruction::Leaf, Reconstruction::Continuous] {
                for &max_leaf_variance in ascending(&self.variances).iter().rev() {
                    add(OctreeParams { max_leaf_variance, max_depth, reconstruction, ..base.clone().by_thresholds() });
                }
            }
        }
        Preset::ALL.map(|(_, preset)| preset.params()).into_iter().filter(|p| p.max_depth <= deepest).for_each(add);
        settings
    }
}

/// These multiples of the default's tolerance; of 0.01 if it has none.
fn around_default(factors: &[f64]) -> Vec<f64> {
    let tolerance = OctreeParams::default().tolerance.unwrap_or(0.01);
    factors.iter().map(|factor| factor * tolerance).collect()
}

fn ascending<T: Copy + PartialOrd>(values: &[T]) -> Vec<T> {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).expect("thresholds are numbers"));
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_hold_each_valid_setting_once() {
        for plan in [Plan::full(), Plan::quick()] {
            let settings = plan.settings();
            assert!(settings.iter().enumerate().all(|(i, s)| !settings[..i].contains(s) && s.validate().is_ok()));
            assert!(settings.contains(&OctreeParams::default()), "the default is among them");
            assert!(Kind::ALL.iter().filter(|(kind, _)| settings.iter().any(|s| Kind::of(s) == *kind)).count() >= 3);
        }
        assert!(Plan::quick().settings().len() < Plan::full().settings().len() / 2);
    }

    #[test]
    fn what_was_chosen_is_swept_from_coarse_to_fine() {
        let plan = Plan { tolerances: vec![0.01, 0.1], depths: vec![3, 2], variances: vec![], variance_depths: vec![] };
        let found: Vec<_> = plan.settings().iter().map(|s| (s.max_depth, s.tolerance)).collect();
        assert_eq!(found, [(2, Some(0.1)), (2, Some(0.01)), (3, Some(0.1)), (3, Some(0.01))], "no preset is as shallow");
    }
}
