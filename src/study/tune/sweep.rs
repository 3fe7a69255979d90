//! Builds, measures and draws settings one after the other.

use super::{Record, RecordSubject};
use crate::exact::ExactScene;
use crate::gpu::GpuError;
use crate::image::{Image, psnr};
use crate::mesh::BoundarySurface;
use crate::octree::{Boundary, OctreeParams, RegularizeError, Subject};
use crate::progress::{Cancelled, Progress};
use crate::render::{RenderError, Renderer};
use crate::study::{Build, BuildError, ErrorSampling, FieldError, Frames};
use crate::view::View;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::sync::Arc;

/// How thoroughly a setting is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Builds of each setting, at least 1; their median counts.
    pub builds: usize,
    /// Frames of each view, at least 1; the median over all counts.
    pub frames: u32,
    /// The field error's points. The tolerance is each setting's own.
    pub error: ErrorSampling,
    /// Settings that need more are dropped: bytes of host memory for the mesh, the build and the octree.
    pub memory_bytes: u64,
}

/// PSNR of a field without any error: JSON has no infinity.
pub const BEST_DB: f64 = 300.0;

/// What a frame's time was taken by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// The GPU's own timestamps.
    Gpu,
    /// The clock, from submission to completion.
    Wall,
}

/// A measured setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The setting.
    pub params: OctreeParams,
    /// Levels of the tree; below the maximum depth where the thresholds stopped earlier.
    pub depth: u8,
    /// Interior cells and non-empty leaves.
    pub nodes: usize,
    /// Non-empty leaves.
    pub leaves: usize,
    /// Bytes of the octree.
    pub bytes: u64,
    /// Median seconds from the mesh in memory to the encoded octree.
    pub build_s: f64,
    /// Root mean square of the field error over the volume, relative to the field's range.
    pub rmse_rel: f64,
    /// Largest field error that was met, relative to the field's range.
    pub max_rel: f64,
    /// Share of the volume at which the octree is empty.
    pub uncovered: f64,
    /// What settings are compared by, decibels: PSNR of the worst view against the exact renderer's picture, 8 bits, covered pixels. Of a volume,
    /// which has no exact picture, PSNR of the field: -20 log10 of `rmse_rel`, at most [`BEST_DB`].
    pub psnr_db: f64,
    /// PSNR of each view; none of a volume.
    pub psnr_db_by_view: Vec<f64>,
    /// Median seconds of a frame, over all views.
    pub frame_s: f64,
    /// What timed it.
    pub frame_by: Clock,
}

/// A setting that was not measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// The setting.
    pub params: OctreeParams,
    /// Why, in words.
    pub reason: String,
    /// Whether it was for its size, which finer settings share.
    pub too_large: bool,
}

/// Why a sweep ended early.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TuneError {
    /// A build failed.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The device failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A view that shows nothing says nothing.
    #[error("view {view} shows nothing of the mesh with this transfer function, so that no picture can be compared")]
    Unseen {
        /// Which of the views, from 0.
        view: usize,
    },
}

/// A mesh's field or a volume, and views to measure settings on.
#[derive(Clone, Copy)]
pub struct Sweep<'a> {
    /// What octrees are made of.
    pub of: &'a Subject,
    /// What draws.
    pub renderer: &'a Renderer,
    /// At least one view; all of one size, transfer function and settings.
    pub views: &'a [View],
    /// How thoroughly.
    pub effort: Effort,
}

/// What became of a setting.
enum Outcome {
    Row(Row),
    TooLarge(String),
    Empty,
}

impl Sweep<'_> {
    /// What a record of this sweep is of.
    pub fn subject(&self) -> RecordSubject {
        RecordSubject::new(self.of, self.views, &self.effort, self.renderer)
    }

    /// Measures the settings that the record does not hold yet and adds them to it, calling `each` after every one; what was measured
    /// stays in the record however this ends.
    ///
    /// Two kinds of settings are not built: those whose tree is known to be one that the record holds, because that ended before its
    /// maximum depth, and those that surely need more memory than one that did not fit.
    pub fn run<E: From<TuneError>>(
        &self,
        settings: &[OctreeParams],
        record: &mut Record,
        progress: &Progress,
        mut each: impl FnMut(&Record) -> Result<(), E>,
    ) -> Result<(), E> {
        let is_known =
            |record: &Record, params: &OctreeParams| record.rows.iter().any(|row| row.params == *params || is_same_tree(row, params));
        record.dropped.clear();
        if settings.iter().all(|params| is_known(record, params)) {
            return Ok(());
        }
        let (exact, surface) = (self.exact_pictures(progress)?, OnceCell::new());
        progress.begin("tuning", settings.len() as u64);
        for params in settings {
            progress.check().map_err(TuneError::from)?;
            if !is_known(record, params) {
                let larger = record.dropped.iter().find(|dropped| dropped.too_large && is_finer(params, &dropped.params));
                let outcome = match larger {
                    Some(_) => Outcome::TooLarge("a coarser setting takes too much already".into()),
                    None => self.measure(params, &exact, &surface, &progress.part())?,
                };
                let dropped = |reason, too_large| Dropped { params: params.clone(), reason, too_large };
                match outcome {
                    Outcome::Row(row) => record.rows.push(row),
                    Outcome::TooLarge(reason) => record.dropped.push(dropped(reason, true)),
                    Outcome::Empty => record.dropped.push(dropped("its octree is empty".into(), false)),
                }
                each(record)?;
            }
            progress.add(1);
        }
        Ok(())
    }

    /// The views as the mesh itself looks, in f64 whatever device draws the rest; none of a volume.
    fn exact_pictures(&self, progress: &Progress) -> Result<Vec<Image>, TuneError> {
        let Subject::Mesh(mesh, field) = self.of else { return Ok(vec![]) };
        let scene = ExactScene::new(mesh, field, progress)?;
        let picture = |(k, view): (usize, &View)| {
            let frame = view.camera.frame(mesh.center(), view.settings.width, view.settings.height);
            let frame = frame.with_planes(&view.settings.planes, mesh.center());
            let settings = view.settings.stopping_at(0.0);
            let image = scene.render(&frame, &view.transfer_function, &settings, progress)?;
            let is_seen = image.pixels.iter().any(|p| p[3] > 1.0 / 512.0);
            if is_seen { Ok(image) } else { Err(TuneError::Unseen { view: k }) }
        };
        self.views.iter().enumerate().map(picture).collect()
    }

    /// Builds, measures and draws one setting.
    fn measure(
        &self,
        params: &OctreeParams,
        exact: &[Image],
        surface: &OnceCell<Arc<BoundarySurface>>,
        progress: &Progress,
    ) -> Result<Outcome, TuneError> {
        let build = match Build::measure_subject(self.of, params, self.effort.builds, progress) {
            Err(e @ (BuildError::Regularize(RegularizeError::TooLarge) | BuildError::Texture(_))) => {
                return Ok(Outcome::TooLarge(e.to_string()));
            }
            build => build?,
        };
        let (nodes, leaves, build_s) = (build.tree.node_count(), build.tree.leaf_count(), build.median_s());
        let bytes = build.texture.bytes() as u64;
        let tree_bytes = (2 * build.tree.interior_count() + 12 * leaves) as u64 + size_of_val(build.texture.bricks()) as u64;
        let need = self.of.working_bytes() + tree_bytes + bytes;
        if need > self.effort.memory_bytes {
            let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
            let reason = format!("it takes {:.0} MiB, the budget is {:.0} MiB", mib(need), mib(self.effort.memory_bytes));
            return Ok(Outcome::TooLarge(reason));
        }
        let sampling = ErrorSampling { tolerance: params.tolerance, ..self.effort.error };
        let error = FieldError::of(self.of, &build.texture, &sampling, progress)?.by_volume;
        if error.points == 0 {
            return Ok(Outcome::Empty);
        }
        let depth = build.texture.depth();
        // A mesh's surface is the same for all; a volume's hangs on the root cube.
        let cut = match self.of {
            Subject::Mesh(mesh, field) => {
                let new_surface = || Arc::new(BoundarySurface::new(mesh, field));
                (params.boundary == Boundary::Mesh).then(|| surface.get_or_init(new_surface).clone())
            }
            Subject::Volume(_) => self.of.surface(&build.tree),
        };
        let (scene, _) = match self.renderer.octree_scene(self.of, build.texture, cut) {
            Err(RenderError::Gpu(e @ (GpuError::TooLarge { .. } | GpuError::OutOfMemory))) => {
                return Ok(Outcome::TooLarge(e.to_string()));
            }
            scene => scene?,
        };
        let scene = scene.with_mesh(self.of.mesh().cloned());
        let mut psnr_db_by_view = Vec::new();
        for (view, exact) in self.views.iter().zip(exact) {
            psnr_db_by_view.push(psnr(exact, &self.renderer.render(&scene, view, progress)?.image).1);
        }
        let times = self.renderer.time(&scene, self.views, self.effort.frames, progress)?;
        let (frame_by, seconds) = times.gpu_s.as_ref().map_or((Clock::Wall, &times.wall_s), |gpu_s| (Clock::Gpu, gpu_s));
        Ok(Outcome::Row(Row {
            params: params.clone(),
            depth,
            nodes,
            leaves,
            bytes,
            build_s,
            rmse_rel: error.rmse_rel,
            max_rel: error.max_rel,
            uncovered: error.uncovered,
            psnr_db: match self.of {
                Subject::Mesh(..) => psnr_db_by_view.iter().copied().fold(f64::INFINITY, f64::min),
                Subject::Volume(_) => error.psnr_db.min(BEST_DB),
            },
            psnr_db_by_view,
            frame_s: Frames::median_and_worst(seconds).0,
            frame_by,
        }))
    }
}

/// Whether a setting gives the tree of a measured one: all but the maximum depth is the same, and the tree ended before it.
fn is_same_tree(row: &Row, params: &OctreeParams) -> bool {
    let at_depth = OctreeParams { max_depth: params.max_depth, ..row.params.clone() };
    at_depth == *params && row.depth < row.params.max_depth.min(params.max_depth)
}

/// Whether a setting surely divides wherever another does: the same but deeper, or with a smaller tolerance or variance.
fn is_finer(params: &OctreeParams, than: &OctreeParams) -> bool {
    let OctreeParams { max_depth, tolerance, max_leaf_variance, .. } = *params;
    let same_else = OctreeParams { max_depth, tolerance, max_leaf_variance, ..than.clone() } == *params;
    let tolerance_is_finer = match (tolerance, than.tolerance) {
        (Some(a), Some(b)) => a <= b,
        (a, b) => a == b,
    };
    same_else && max_depth >= than.max_depth && max_leaf_variance <= than.max_leaf_variance && tolerance_is_finer
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row by (bytes, PSNR, build, frame); its field error follows the PSNR.
    pub fn row(bytes: u64, psnr_db: f64, build_s: f64, frame_s: f64) -> Row {
        Row {
            params: OctreeParams { max_leaf_tets: bytes as u32, ..OctreeParams::default() },
            depth: 9,
            nodes: bytes as usize / 4,
            leaves: bytes as usize / 5,
            bytes,
            build_s,
            rmse_rel: 10f64.powf(-psnr_db / 20.0),
            max_rel: 0.1,
            uncovered: 0.0,
            psnr_db,
            psnr_db_by_view: vec![psnr_db],
            frame_s,
            frame_by: Clock::Wall,
        }
    }

    #[test]
    fn a_tree_that_ended_early_is_not_built_again() {
        let mut row = row(100, 40.0, 0.1, 0.01);
        row.params.max_depth = 9;
        let with = |max_depth| OctreeParams { max_depth, ..row.params.clone() };
        assert!(!is_same_tree(&row, &with(10)), "it may have been cut off at 9");
        let ended = Row { depth: 7, ..row.clone() };
        assert!(is_same_tree(&ended, &with(10)) && is_same_tree(&ended, &with(8)));
        assert!(!is_same_tree(&ended, &with(7)), "at depth 7 an estimate may decide otherwise");
        assert!(!is_same_tree(&ended, &OctreeParams { max_leaf_tets: 3, ..with(10) }));
    }

    #[test]
    fn finer_is_deeper_or_stricter_and_nothing_else() {
        let base = OctreeParams { tolerance: Some(0.01), max_depth: 8, max_leaf_variance: 1e-3, ..OctreeParams::default() };
        let finer = |params: OctreeParams| is_finer(&params, &base);
        assert!(finer(base.clone()));
        assert!(finer(OctreeParams { max_depth: 9, tolerance: Some(0.005), ..base.clone() }));
        assert!(!finer(OctreeParams { max_depth: 9, tolerance: Some(0.02), ..base.clone() }));
        assert!(!finer(OctreeParams { max_depth: 7, ..base.clone() }));
        assert!(!finer(OctreeParams { tolerance: None, ..base.clone() }));
        assert!(!finer(OctreeParams { max_leaf_tets: 1, ..base.clone() }));
    }
}
