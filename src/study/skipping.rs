//! Skipping: the tables of Yu et al. 2016, for any data.

use crate::geometry::Aabb;
use crate::progress::Progress;
use crate::render::{RenderError, Renderer, Scene};
use crate::study::{Frames, orbit_frames};
use crate::view::{Camera, Intervals, RenderSettings, Skip, Steps, View};

/// What the paper measured at one step (GT 635M, volumes of 256^3): kernel milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperSkipping {
    /// The step in parts of the volume's edge.
    pub step: f64,
    /// The foot, a solid CT: bounding box (W), octree encoding, half-splitting.
    pub foot_ms: [f64; 3],
    /// The Boston teapot, hollow: the same.
    pub teapot_ms: [f64; 3],
}

impl PaperSkipping {
    /// The paper's two tables.
    pub const ALL: [PaperSkipping; 3] = [
        PaperSkipping { step: 0.002, foot_ms: [4.629, 4.250, 4.210], teapot_ms: [6.439, 4.545, 3.628] },
        PaperSkipping { step: 0.005, foot_ms: [2.973, 2.732, 2.748], teapot_ms: [2.943, 2.240, 1.807] },
        PaperSkipping { step: 0.010, foot_ms: [1.728, 1.688, 1.646], teapot_ms: [1.685, 1.335, 1.147] },
    ];
    /// Its preprocessing, ms: foot, teapot.
    pub const PREPROCESSING_MS: [[f64; 3]; 2] = [[205.0, 830.0, 800.0], [200.0, 820.0, 785.0]];

    /// Which of the paper's columns a way to skip stands in.
    pub fn column(skip: Skip) -> Option<usize> {
        match skip {
            Skip::None => Some(0),
            Skip::Encoding => Some(1),
            Skip::Half => Some(2),
            Skip::Octree | Skip::Parts(_) => None,
        }
    }
}

/// One way to skip, measured over the 12 views of the orbit.
#[derive(Debug, Clone, PartialEq)]
pub struct SkipFigures {
    /// The way.
    pub skip: Skip,
    /// Where its intervals come from.
    pub intervals: Intervals,
    /// Seconds a frame, the passes that find intervals included: the mean of the views' medians.
    pub frame_s: f64,
    /// Of these, the seconds of the passes that find intervals; `None` without timestamps.
    pub intervals_s: Option<f64>,
    /// Whether the seconds are the GPU's own.
    pub by_gpu: bool,
    /// Seconds by the clock of what the way needs to be made anew when another transfer function shows other values: the least of three.
    pub preparation_s: f64,
    /// Samples of all 12 frames.
    pub taken: u64,
    /// Samples that those frames need: what a march takes that knows every active leaf.
    pub needed: u64,
    /// The largest difference of a channel from the picture of the first way that was measured, over all views.
    pub worst_difference: f32,
}

/// Measures `ways` one after the other with the view's transfer function and steps, `repeats` frames of each view.
pub fn compare_skipping(
    renderer: &Renderer,
    scene: &Scene,
    world_bounds: Aabb,
    view: &View,
    ways: &[(Skip, Intervals)],
    repeats: u32,
    progress: &Progress,
) -> Result<Vec<SkipFigures>, RenderError> {
    let views: Vec<View> = (0..12).map(|k| View { camera: Camera::orbit(world_bounds, k, 1.0), ..view.clone() }).collect();
    let by = |view: &View, skip, intervals| View { settings: RenderSettings { skip, intervals, ..view.settings }, ..view.clone() };
    let mut needed = 0;
    let mut first = Vec::new();
    for view in &views {
        needed += renderer.samples_needed(scene, view, progress)?.unwrap_or(0);
    }
    let mut figures = Vec::new();
    for &(skip, intervals) in ways {
        let (mut taken, mut worst_difference) = (0, 0f32);
        for (k, view) in views.iter().enumerate() {
            let picture = renderer.render(scene, &by(view, skip, intervals), progress)?;
            taken += picture.samples.unwrap_or(0);
            match first.get(k) {
                None => first.push(picture.image),
                Some(image) => worst_difference = worst_difference.max(crate::image::difference(image, &picture.image).1),
            }
        }
        let frames = orbit_frames(renderer, scene, world_bounds, &by(view, skip, intervals), repeats, progress)?;
        let prepare = |_| Ok(renderer.time_preparation(scene, &by(view, skip, intervals))?.unwrap_or(0.0));
        let preparations: Vec<f64> = (0..3).map(prepare).collect::<Result<_, RenderError>>()?;
        let seconds = frames.gpu_s.as_ref().unwrap_or(&frames.wall_s);
        figures.push(SkipFigures {
            skip,
            intervals,
            frame_s: Frames::mean(seconds),
            intervals_s: frames.intervals_s.as_deref().map(Frames::mean),
            preparation_s: preparations.into_iter().fold(f64::INFINITY, f64::min),
            by_gpu: frames.gpu_s.is_some(),
            taken,
            needed,
            worst_difference,
        });
    }
    Ok(figures)
}

/// The settings of the paper's measurements: one step everywhere, so long in world units, through the octree or through voxels.
pub fn fixed_step(settings: RenderSettings, step_world: f64, voxels: bool) -> RenderSettings {
    RenderSettings { steps: Steps::Fixed, step_world: Some(step_world), voxels, ..settings }
}
