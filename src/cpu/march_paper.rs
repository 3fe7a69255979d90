//! The march by the paper's step rule: the twin of `shaders/march_paper.wgsl`.

use super::descent::Descent;
use super::ray::{Cell, Ray};
use super::{MAX_LOOKUPS, Scene, step_at};
use crate::optics::Light;

/// The last sample of a run.
struct Sample {
    t: f32,
    value: f32,
    /// Depth that the step in use belongs to.
    step_depth: u32,
}

/// Samples a ray with the step of the leaves it meets (method 1.4): `L(d) = L_s / 2^(d-1)`; back to the last sample where a leaf is
/// deeper than the step's depth; linear between the samples of a run; a run ends at the face where the volume does, and empty cells are
/// leapt over. Returns the light and the number of full leaves looked up, those that were stepped back from included.
pub(super) fn march(scene: &Scene, ray: &Ray) -> (Light, u32) {
    let mut descent = Descent::new(scene.texture);
    let cells = descent.cells();
    let step = scene.step_along(ray);
    let mut light = Light::default();
    let mut samples = 0;
    let mut run: Option<Sample> = None;
    let mut t = 0.0;
    let mut at = ray.cell_at(t, Cell::root(cells), cells);
    for _ in 0..MAX_LOOKUPS {
        let (word, cell) = descent.find(at);
        if word.0 == 0 {
            // Empty: the run ends where the ray entered this cell, and the next begins beyond it.
            if let Some(last) = run.take() {
                let end = ray.entry(cell, cells).min(t).max(last.t);
                light.add_constant(scene.table, last.value, (end - last.t) * ray.length);
            }
            let exits = ray.exits(cell, cells);
            let t_exit = exits.min_element();
            at = ray.step(cell, exits, t_exit, cells);
            if at.max_element() >= cells {
                return (light, samples);
            }
            t = t_exit.min(ray.t_out).max(t);
            continue;
        }
        samples += 1;
        let (depth, value) = (word.depth(), word.value());
        run = match run {
            // Deeper than the step: back to the last sample, and on from there with the deeper leaf's step.
            Some(last) if depth > last.step_depth => Some(Sample { step_depth: depth, ..last }),
            last => {
                if let Some(last) = last {
                    light.add_linear(scene.table, last.value, value, (t - last.t) * ray.length);
                    if light.transmittance < scene.min_transmittance {
                        return (light, samples);
                    }
                }
                Some(Sample { t, value, step_depth: depth })
            }
        };
        if let Some(last) = &run {
            t = last.t + step_at(step, last.step_depth);
            if t >= ray.t_out {
                light.add_constant(scene.table, last.value, (ray.t_out - last.t) * ray.length);
                return (light, samples);
            }
        }
        at = ray.cell_at(t, Cell::root(cells), cells);
    }
    (light, samples)
}
