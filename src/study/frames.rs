//! Frames: times over the standard orbit.

use crate::geometry::Aabb;
use crate::progress::Progress;
use crate::render::{RenderError, Renderer, Scene};
use crate::view::{Camera, View};

/// Frame times of the 12 views of the orbit, in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Medians of each view by the clock, readback excluded.
    pub wall_s: Vec<f64>,
    /// Medians of each view by the GPU's timestamps; `None` where they cannot be trusted.
    pub gpu_s: Option<Vec<f64>>,
    /// Of these, what the passes take that find intervals.
    pub intervals_s: Option<Vec<f64>>,
}

/// Times each view of the standard orbit `repeats` times after warming up; all else is `view`'s.
pub fn orbit_frames(
    renderer: &Renderer,
    scene: &Scene,
    world_bounds: Aabb,
    view: &View,
    repeats: u32,
    progress: &Progress,
) -> Result<Frames, RenderError> {
    let views: Vec<View> = (0..12).map(|k| View { camera: Camera::orbit(world_bounds, k, 1.0), ..view.clone() }).collect();
    let times = renderer.time(scene, &views, repeats, progress)?;
    let by_view = |all: &[f64]| all.chunks(repeats.max(1) as usize).map(median).collect::<Vec<f64>>();
    let by_gpu = |all: &Option<Vec<f64>>| all.as_deref().map(by_view);
    Ok(Frames { wall_s: by_view(&times.wall_s), gpu_s: by_gpu(&times.gpu_s), intervals_s: by_gpu(&times.intervals_s) })
}

impl Frames {
    /// The mean over the views: what an orbit takes, divided by its frames.
    pub fn mean(seconds: &[f64]) -> f64 {
        seconds.iter().sum::<f64>() / seconds.len() as f64
    }

    /// (median over the views, slowest view).
    pub fn median_and_worst(seconds: &[f64]) -> (f64, f64) {
        (median(seconds), seconds.iter().copied().fold(0.0, f64::max))
    }
}

/// The value in the middle; NaN if there is none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_worst() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(Frames::median_and_worst(&[5.0, 1.0, 2.0]), (2.0, 5.0));
    }
}
