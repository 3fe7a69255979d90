//! Builds: the paper's table of build times and node counts.

use crate::mesh::{ScalarField, TetMesh};
use crate::octree::{Octree, OctreeParams, OctreeTexture, RegularizeError, Subject, TextureError, regularize};
use crate::progress::Progress;
use std::time::Instant;

/// What the paper measured on a mesh (Tong & Xu 2014, table 2; i5-2310, 2.9 GHz).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperTable {
    /// The mesh.
    pub name: &'static str,
    /// How the mesh is told: its number of tets.
    pub tets: usize,
    /// (depth, seconds, nodes), nodes being interior cells and non-empty leaves.
    pub rows: [(u8, f64, usize); 3],
}

impl PaperTable {
    /// The two meshes of the paper.
    pub const ALL: [PaperTable; 2] = [
        PaperTable { name: "Blunt Fin", tets: 187_395, rows: [(8, 24.13, 138_000), (9, 35.34, 208_000), (10, 43.77, 251_000)] },
        PaperTable { name: "SPX2", tets: 827_904, rows: [(8, 81.64, 247_000), (9, 122.65, 376_000), (10, 154.12, 452_000)] },
    ];

    /// The table of a mesh, if it is one of the two.
    pub fn of(mesh: &TetMesh) -> Option<PaperTable> {
        Self::ALL.into_iter().find(|table| table.tets == mesh.tets().len())
    }
}

/// Why a build failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// Regularization failed or was cancelled.
    #[error(transparent)]
    Regularize(#[from] RegularizeError),
    /// The tree does not fit a texture.
    #[error(transparent)]
    Texture(#[from] TextureError),
}

/// A measured build.
#[derive(Debug)]
pub struct Build {
    /// The tree.
    pub tree: Octree,
    /// Its texture.
    pub texture: OctreeTexture,
    /// Seconds from the mesh in memory to the encoded texture, each repeat.
    pub seconds: Vec<f64>,
}

impl Build {
    /// Builds `repeats` times, at least once.
    pub fn measure(
        mesh: &TetMesh,
        field: &ScalarField,
        params: &OctreeParams,
        repeats: usize,
        progress: &Progress,
    ) -> Result<Build, BuildError> {
        Self::repeated(repeats, || regularize(mesh, field, params, progress))
    }

    /// The same of a mesh's field or a volume.
    pub fn measure_subject(subject: &Subject, params: &OctreeParams, repeats: usize, progress: &Progress) -> Result<Build, BuildError> {
        Self::repeated(repeats, || subject.regularize(params, progress))
    }

    fn repeated(repeats: usize, regularized: impl Fn() -> Result<Octree, RegularizeError>) -> Result<Build, BuildError> {
        let mut seconds = Vec::new();
        loop {
            let start = Instant::now();
            let tree = regularized()?;
            let texture = OctreeTexture::encode(&tree)?;
            seconds.push(start.elapsed().as_secs_f64());
            if seconds.len() >= repeats {
                return Ok(Build { tree, texture, seconds });
            }
        }
    }

    /// The fastest repeat.
    pub fn best_s(&self) -> f64 {
        self.seconds.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The middle repeat.
    pub fn median_s(&self) -> f64 {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }
}

/// The thresholds that come closest to `nodes` from below: W is bisected (on a logarithmic scale, to a hundredth), the rest is kept. If
/// even W = 0 gives fewer nodes, that is the answer.
pub fn thresholds_for(
    mesh: &TetMesh,
    field: &ScalarField,
    params: &OctreeParams,
    nodes: usize,
    progress: &Progress,
) -> Result<OctreeParams, RegularizeError> {
    let with = |w: f64| OctreeParams { max_leaf_variance: w, ..params.clone() };
    let count = |w: f64| match regularize(mesh, field, &with(w), progress) {
        Err(RegularizeError::TooLarge) => Ok(usize::MAX),
        built => built.map(|tree| tree.node_count()),
    };
    if count(0.0)? <= nodes {
        return Ok(with(0.0));
    }
    let (mut few, mut many) = (0.25f64.log10(), -8.0f64);
    while few - many > 0.01 {
        let middle = (few + many) / 2.0;
        if count(10f64.powf(middle))? <= nodes {
            few = middle;
        } else {
            many = middle;
        }
    }
    Ok(with(10f64.powf(few)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{FieldSelection, collect};

    #[test]
    fn thresholds_meet_a_node_count_from_below() {
        let mesh = collect(&*plan(Shape::Ball, Some(6000)).expect("a size that can be made")).expect("valid");
        let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a field");
        let params = OctreeParams { max_depth: 6, max_leaf_tets: 2, ..OctreeParams::default() };
        let nodes = |w| {
            let params = OctreeParams { max_leaf_variance: w, ..params.clone() };
            regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes").node_count()
        };
        let (least, most) = (nodes(0.25), nodes(0.0));
        let target = (least + most) / 2;
        let found = thresholds_for(&mesh, &field, &params, target, &Progress::new()).expect("finds");
        let reached = nodes(found.max_leaf_variance);
        assert!(reached <= target && reached > least, "{reached} of {target}, between {least} and {most}");
        assert_eq!(thresholds_for(&mesh, &field, &params, most + 1, &Progress::new()).expect("finds").max_leaf_variance, 0.0);
    }
}
