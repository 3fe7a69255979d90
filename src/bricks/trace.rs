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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::BRICK_EDGE;

    const DIMS: [u32; 3] = [640, 300, 500];

    #[test]
    fn a_trace_comes_back_from_its_file() {
        for (_, motion) in Motion::ALL {
            let trace = motion.trace(DIMS, 30, 4);
            assert_eq!(trace.frames.len(), 30);
            let back = Trace::from_json(&trace.to_json().expect("text")).expect("what was written");
            assert_eq!((back.dims, &back.name, back.frames.len()), (trace.dims, &trace.name, 30));
            for (a, b) in trace.frames.iter().zip(&back.frames) {
                assert_eq!(a.moving, b.moving);
                let far = |(a, b): (&SlicePlane, &SlicePlane)| (a.point - b.point).length() + (a.normal - b.normal).length();
                assert!(a.planes.len() == b.planes.len() && a.planes.iter().zip(&b.planes).map(far).fold(0.0, f64::max) < 1e-12);
            }
            assert_eq!(motion.trace(DIMS, 30, 4), trace);
        }
        assert_ne!(Motion::Scrub.trace(DIMS, 30, 5), Motion::Scrub.trace(DIMS, 30, 4));
    }

    #[test]
    fn bad_files_say_what_is_wrong() {
        let frame = |planes: &str, more: &str| format!("{{\"dims\": [9, 9, 9], \"frames\": [{{\"planes\": [{planes}]{more}}}]}}");
        let plane = "{\"point\": [0, 0, 0], \"normal\": [0, 0, 2]}";
        let read = |text: String| Trace::from_json(&text).map_err(|error| error.to_string());
        assert_eq!(read(frame(plane, "")).expect("a trace").frames[0].planes[0].normal, DVec3::Z);
        let long = "{\"point\": [70, 0, 0], \"normal\": [1e200, 0, 0]}, {\"point\": [0, 0, 0], \"normal\": [0, -1e-200, 0]}";
        let normals: Vec<DVec3> = read(frame(long, "")).expect("a trace").frames[0].planes.iter().map(|plane| plane.normal).collect();
        assert_eq!(normals, [DVec3::X, -DVec3::Y]);
        for (text, expected) in [
            ("[1]".to_owned(), "expected"),
            ("{\"dims\": [9, 9], \"frames\": []}".to_owned(), "dims"),
            ("{\"dims\": [9, 9, 9], \"frames\": []}".to_owned(), "no frames"),
            ("{\"dims\": [9, 0, 9], \"frames\": []}".to_owned(), "9 x 0 x 9"),
            (frame("{\"point\": [0, 0, 0], \"normal\": [0, 0, 0]}", ""), "frame 0: slice 0 is no plane"),
            (frame("{\"point\": [0, 0], \"normal\": [0, 0, 1]}", ""), "frames[0].planes[0].point"),
            (frame("{\"point\": [80, 0, 0], \"normal\": [1, 0, 0]}", ""), "frame 0: slice 0 lies beside the volume"),
            (frame("{\"point\": [0, 0, -1e300], \"normal\": [0, 1, 1]}", ""), "frame 0: slice 0 lies beside the volume"),
            (frame("{\"point\": [1e308, 1e308, 1e308], \"normal\": [1, 1, -1]}", ""), "beside the volume"),
            (frame(plane, ", \"moving\": 1"), "slice 1 moves, but there are 1"),
            (frame(plane, "") + "x", "trailing"),
        ] {
            let error = read(text.clone()).expect_err(&text);
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_trace_is_a_file_as_any_other_and_links_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let [plain, link, target] = ["plain", "link.json", "target.json"].map(|name| folder.path().join(name));
        std::fs::write(&plain, "").expect("a file");
        std::os::unix::fs::symlink(&target, &link).expect("a link");
        std::fs::write(&target, "old").expect("a file");
        Motion::Loop.trace(DIMS, 5, 1).write(&link).expect("written");
        assert!(std::fs::symlink_metadata(&link).expect("a link").is_symlink());
        assert_eq!(Trace::read(&target).expect("a trace").frames.len(), 5);
        let mode = |path: &std::path::Path| std::fs::metadata(path).expect("a file").permissions().mode();
        assert_eq!(mode(&target), mode(&plain));
    }

    #[test]
    fn motions_are_what_they_are_called() {
        let at = |trace: &Trace, slice: usize| -> Vec<f64> {
            trace.frames.iter().map(|f| f.planes[slice].point.dot(f.planes[slice].normal)).collect()
        };
        let steps = |trace: &Trace| {
            (0..4).flat_map(|slice| at(trace, slice).windows(2).map(|w| (w[1] - w[0]).abs()).collect::<Vec<_>>()).fold(0.0, f64::max)
        };
        assert!(steps(&Motion::VoxelScrub.trace(DIMS, 2000, 1)) <= 1.0);
        let brick = f64::from(BRICK_EDGE);
        assert!(steps(&Motion::Scrub.trace(DIMS, 500, 1)) <= 0.51 * brick);
        assert!(steps(&Motion::Jump.trace(DIMS, 500, 1)) > 2.0 * brick);
        let sweep = at(&Motion::PingPong.trace(DIMS, 200, 1), 0);
        assert!(sweep.windows(2).all(|w| (w[1] - w[0]).abs() <= brick / 3.0 + 1e-9));
        // 639 / 64 bricks at half a brick a frame: every 20 frames, less a little.
        let ends = at(&Motion::Loop.trace(DIMS, 200, 1), 0).windows(2).filter(|w| w[1] < w[0]).count();
        assert_eq!(ends, 9);
        let paper = Motion::PaperJumps.trace(DIMS, 0, 1);
        let moves: Vec<usize> = (0..3).map(|slice| paper.frames.iter().filter(|f| f.moving == Some(slice)).count()).collect();
        assert_eq!((moves, paper.frames.len(), paper.frames[0].planes.len()), (vec![30; 3], 91, 3));
    }

    #[test]
    fn a_working_set_covers_the_slices_once_and_is_no_larger_than_told() {
        let pyramid = Pyramid::new(DIMS);
        let slices = &Motion::Scrub.trace(DIMS, 20, 2).frames[19];
        let eye = DVec3::new(900.0, 700.0, 800.0);
        let all = Needs::Level(0).of(&pyramid, slices);
        for bricks in [1, 10, 37, 100, 10_000] {
            let found = Needs::AtMost { bricks, eye }.of(&pyramid, slices);
            assert!(found.len() <= bricks, "{} of {bricks}", found.len());
            for key in &all {
                let covers = (0..pyramid.levels()).filter(|&level| found.contains(&key.ancestor(level))).count();
                assert_eq!(covers, 1, "{key:?}");
            }
        }
        assert_eq!(Needs::AtMost { bricks: 10_000, eye }.of(&pyramid, slices), all);
    }
}
