//! The subdivision thresholds that users tune, and named presets of them.

use crate::mesh::{BoundarySurface, ScalarField, TetMesh};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How a leaf's value is found from its tets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Inverse distance to the leaf's tets (method 1'): the linear value of the tet that holds the centre; outside the mesh, a smooth
    /// extension of it.
    #[default]
    Tets,
    /// Inverse distance to the vertices of the leaf's tets (method 1, the paper's).
    Vertices,
    /// The mean over the box around the sample point, of a leaf's size, where a leaf holds many tets; else as [`Sampling::Tets`].
    Average,
}

/// What the field is between the samples of the octree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reconstruction {
    /// Samples at the corners of leaves, trilinear inside: without a jump across leaf faces, and exact for linear fields.
    #[default]
    Continuous,
    /// One sample a leaf, constant inside: the paper's.
    Leaf,
}

/// What a leaf is that the mesh's surface cuts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// Full if any tet overlaps it: the paper read literally.
    Cells,
    /// Full if its centre lies in the mesh.
    Centres,
    /// Full if any tet overlaps it, and rays are cut to where they are inside the mesh's surface.
    #[default]
    Mesh,
}

/// The thresholds of the regularization (method 1.1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OctreeParams {
    /// U: the uniform depth d0 is the smallest d >= 1 with `tets / 8^d < U`. Above 0; smaller gives a deeper uniform start, which costs
    /// nodes and catches detail that V and W would stop at.
    pub initial_cell_tets: f64,
    /// The uniform depth itself, overriding U.
    pub initial_depth: Option<u8>,
    /// V: a cell with fewer than V tets is a leaf; 0 leaves it to the rest. At 2 cells split until each holds one tet; around a vertex, where about 24 meet,
    /// that is down to the maximum depth.
    pub max_leaf_tets: u32,
    /// W: a cell whose distinct vertices' normalised scalars have a population variance below W is a leaf. Values are in [0, 1], so
    /// 1e-4 stands for a standard deviation of 1 % of the range; 0 leaves it to the rest.
    pub max_leaf_variance: f64,
    /// R: a cell in which the reconstruction is estimated to differ from the field by no more than this is a leaf; relative to the
    /// field's range. From depth 8 on cells are held to R, above it to a quarter of that a level. `None` leaves it to V and W.
    pub tolerance: Option<f64>,
    /// Dmax: no cell is deeper. 1 to [`OctreeParams::DEPTH_LIMIT`]; the paper uses 9.
    pub max_depth: u8,
    /// How a leaf's value is found.
    pub sampling: Sampling,
    /// What a leaf cut by the surface is.
    pub boundary: Boundary,
    /// What the field is between samples.
    pub reconstruction: Reconstruction,
}

/// Named settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The paper's: depth 9, V and W, one sample a leaf by inverse distance to vertices. It names no values for U, V and W; these give the
    /// Blunt Fin (187 k tets) 200 k nodes at depth 9, as many as in the paper.
    Paper,
    /// Depth 7: a first look.
    Fast,
    /// The default.
    Balanced,
    /// A sixth of the default's tolerance: where pictures are measured.
    Fine,
}

/// Why parameters cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParamsError {
    /// A number is out of its range.
    #[error("{name} is {value}, expected {expected}")]
    Range {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}

impl Preset {
    /// All presets by name.
    pub const ALL: [(&'static str, Preset); 4] =
        [("paper", Preset::Paper), ("fast", Preset::Fast), ("balanced", Preset::Balanced), ("fine", Preset::Fine)];

    /// The settings that a preset stands for.
    pub fn params(self) -> OctreeParams {
        let balanced = OctreeParams {
            initial_cell_tets: 512.0,
            initial_depth: None,
            max_leaf_tets: 0,
            max_leaf_variance: 0.0,
            tolerance: Some(0.03),
            max_depth: 9,
            sampling: Sampling::Tets,
            boundary: Boundary::Mesh,
            reconstruction: Reconstruction::Continuous,
        };
        match self {
            Preset::Paper => OctreeParams {
                sampling: Sampling::Vertices,
                boundary: Boundary::Centres,
                reconstruction: Reconstruction::Leaf,
                ..balanced.by_thresholds()
            },
            Preset::Fast => OctreeParams { max_depth: 7, tolerance: Some(0.1), ..balanced },
            Preset::Balanced => balanced,
            Preset::Fine => OctreeParams { tolerance: Some(0.005), ..balanced },
        }
    }
}

impl Default for OctreeParams {
    fn default() -> Self {
        Preset::Balanced.params()
    }
}

impl OctreeParams {
    /// The deepest tree that the texture's alpha channel can name (`10 * 25 = 250`).
    pub const DEPTH_LIMIT: u8 = 25;

    /// These settings with U, V and W of the paper's rule instead of a tolerance, as [`Preset::Paper`] has them.
    pub fn by_thresholds(self) -> Self {
        if self.tolerance.is_none() {
            return self;
        }
        OctreeParams { tolerance: None, initial_cell_tets: 4.0, max_leaf_tets: 12, max_leaf_variance: 5e-4, ..self }
    }

    /// These settings with a tolerance instead of V and W, as the default has it.
    pub fn by_tolerance(self) -> Self {
        if self.tolerance.is_some() {
            return self;
        }
        let OctreeParams { tolerance, initial_cell_tets, max_leaf_tets, max_leaf_variance, .. } = Self::default();
        OctreeParams { tolerance, initial_cell_tets, max_leaf_tets, max_leaf_variance, ..self }
    }

    /// The surface that rays are cut to, if the boundary is [`Boundary::Mesh`]. It depends on the mesh and on where the field has values.
    pub fn surface(&self, mesh: &TetMesh, field: &ScalarField) -> Option<Arc<BoundarySurface>> {
        (self.boundary == Boundary::Mesh).then(|| Arc::new(BoundarySurface::new(mesh, field)))
    }

    /// Checks every number.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let depth = |d: u8| (1..=Self::DEPTH_LIMIT).contains(&d);
        let initial_depth = self.initial_depth.unwrap_or(1);
        let checks = [
            (
                "initial_cell_tets",
                self.initial_cell_tets,
                "a finite number above 0",
                self.initial_cell_tets.is_finite() && self.initial_cell_tets > 0.0,
            ),
            ("initial_depth", f64::from(initial_depth), "1 to 25", depth(initial_depth)),
            ("tolerance", self.tolerance.unwrap_or(0.0), "a number from 0", self.tolerance.unwrap_or(0.0) >= 0.0),
            ("max_leaf_variance", self.max_leaf_variance, "a number from 0", self.max_leaf_variance >= 0.0),
            ("max_depth", f64::from(self.max_depth), "1 to 25", depth(self.max_depth)),
        ];
        match checks.into_iter().find(|&(.., valid)| !valid) {
            Some((name, value, expected, _)) => Err(ParamsError::Range { name, value, expected }),
            None => Ok(()),
        }
    }

    /// The uniform depth d0 for a mesh of `tets` tets: at least 1, at most `max_depth`.
    pub fn uniform_depth(&self, tets: usize) -> u8 {
        let by_count = || (1..self.max_depth).find(|&d| tets as f64 / 8f64.powi(i32::from(d)) < self.initial_cell_tets);
        self.initial_depth.or_else(by_count).unwrap_or(self.max_depth).min(self.max_depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_depth_is_the_smallest_below_u() {
        let params = OctreeParams { initial_cell_tets: 32.0, ..Default::default() };
        assert_eq!(params.uniform_depth(187_395), 5); // 45.7 at depth 4, 5.7 at depth 5
        assert_eq!(params.uniform_depth(1), 1);
        assert_eq!(OctreeParams { max_depth: 3, ..params.clone() }.uniform_depth(187_395), 3);
        assert_eq!(OctreeParams { initial_depth: Some(7), ..params }.uniform_depth(187_395), 7);
    }

    #[test]
    fn either_rule_is_left_for_the_other_and_found_again() {
        let [paper, fast] = [Preset::Paper, Preset::Fast].map(Preset::params);
        assert_eq!(paper.clone().by_tolerance().by_thresholds(), paper);
        assert_eq!(paper.clone().by_thresholds(), paper);
        assert_eq!(fast.clone().by_tolerance(), fast, "its own tolerance stays");
        let back = fast.clone().by_thresholds().by_tolerance();
        assert_eq!(back, OctreeParams { tolerance: OctreeParams::default().tolerance, ..fast });
    }

    #[test]
    fn every_preset_is_valid_and_bad_numbers_are_named() {
        for (name, preset) in Preset::ALL {
            preset.params().validate().expect(name);
        }
        for bad in [
            OctreeParams { max_depth: 0, ..Default::default() },
            OctreeParams { max_depth: 26, ..Default::default() },
            OctreeParams { initial_cell_tets: 0.0, ..Default::default() },
            OctreeParams { max_leaf_variance: f64::NAN, ..Default::default() },
        ] {
            assert!(bad.validate().is_err());
        }
    }
}
