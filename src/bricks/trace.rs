//! Slices in motion: where they are in one frame ([`SliceSet`]), and in a run of frames ([`Trace`]).

mod record;
mod synthetic;

use super::{BrickKey, Pyramid, SlicePlane};
use glam::DVec3;
pub use record::TraceError;
pub use synthetic::{Motion, Random};

/// The slices of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SliceSet {
    /// The planes. A slice keeps its place in the list from frame to frame.
    pub planes: Vec<SlicePlane>,
    /// Which of them moves, by place in the list; `None` where none does.
    pub moving: Option<usize>,
}

/// Slices through a volume, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// What it is called.
    pub name: String,
    /// Voxels of the volume along x, y, z.
    pub dims: [u32; 3],
    /// The frames.
    pub frames: Vec<SliceSet>,
}

/// Which bricks a frame needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Needs {
    /// All that its slices cut at one level.
    Level(u8),
    /// At most so many: from the coarsest level on, the brick nearest to the eye (index space) is replaced by its parts as long as they are
    /// no more. This is how a single stage fits its working set into a cache.
    AtMost {
        /// How many bricks.
        bricks: usize,
        /// Where the eye is.
        eye: DVec3,
    },
}

/// What each frame of a trace needs: what policies are tried on.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// What it is called.
    pub name: String,
    /// The bricks that there are.
    pub pyramid: Pyramid,
    /// The slices of each frame, and the bricks, sorted, none twice.
    pub frames: Vec<(SliceSet, Vec<BrickKey>)>,
}

impl Trace {
    /// The bricks that the frames need.
    pub fn demand(&self, needs: Needs) -> Demand {
        let pyramid = Pyramid::new(self.dims);
        let mut frames: Vec<(SliceSet, Vec<BrickKey>)> = Vec::with_capacity(self.frames.len());
        for slices in &self.frames {
            let found = match frames.last() {
                Some((before, found)) if before.planes == slices.planes => found.clone(),
                _ => needs.of(&pyramid, slices),
            };
            frames.push((slices.clone(), found));
        }
        Demand { name: self.name.clone(), pyramid, frames }
    }
}

impl Needs {
    /// The bricks that slices need, sorted.
    pub fn of(self, pyramid: &Pyramid, slices: &SliceSet) -> Vec<BrickKey> {
        let mut found: Vec<BrickKey> = match self {
            Needs::Level(level) => slices.planes.iter().flat_map(|plane| pyramid.cut(plane, level)).collect(),
            Needs::AtMost { bricks, eye } => nearest(pyramid, slices, bricks, eye),
        };
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// See [`Needs::AtMost`].
fn nearest(pyramid: &Pyramid, slices: &SliceSet, most: usize, eye: DVec3) -> Vec<BrickKey> {
    let mut found = vec![pyramid.top()];
    // Coarse bricks first, then near ones: one level of difference counts as much as doubling the distance.
    let worth = |key: &BrickKey| key.voxel_size() / (eye.distance(key.center()) + 1.0);
    let mut done = Vec::new();
    while let Some(i) = (0..found.len()).max_by(|&a, &b| worth(&found[a]).total_cmp(&worth(&found[b]))) {
        let key = found.swap_remove(i);
        let parts: Vec<BrickKey> =
            pyramid.children(key).filter(|&part| slices.planes.iter().any(|plane| super::wanted::meets(plane, part))).collect();
        if key.level == 0 || found.len() + done.len() + parts.len() > most {
            done.push(key);
        } else {
            found.extend(parts);
        }
    }
    done
}

impl Demand {
    /// Bricks of the largest frame.
    pub fn frame_set(&self) -> usize {
        self.frames.iter().map(|frame| frame.1.len()).max().unwrap_or(0)
    }

    /// Mean number of bricks of a frame.
    pub fn mean_set(&self) -> f64 {
        self.frames.iter().map(|frame| frame.1.len()).sum::<usize>() as f64 / self.frames.len().max(1) as f64
    }
}
