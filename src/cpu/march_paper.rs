//! The march by the paper's step rule: the twin of `shaders/march_paper.wgsl`.

use super::descent::{Descent, Word};
use super::pass::Gathered;
use super::ray::{Cell, Ray};
use super::{MAX_LOOKUPS, Scene, Way, step_at};
use crate::octree::trilinear;

/// The last sample of a run.
struct Sample {
    t: f32,
    value: f32,
    /// Depth that the step in use belongs to.
    step_depth: u32,
}

/// Samples a stretch of a ray with the step of the leaves it meets (method 1.4): `L(d) = L_s / 2^(d-1)`; back to the last
/// sample where a leaf is deeper than the step's depth; linear between the samples of a run; a run ends at the face where the volume does,
/// and empty cells are leapt over. Adds the light and the number of full leaves looked up, those that were stepped back from included.
/// Returns whether there may be more to see behind.
pub(super) fn march(scene: &Scene, ray: &Ray, way: &mut Way, span: [f32; 2], gathered: &mut Gathered) -> bool {
    let (descent, what) = (&mut way.descent, scene.what());
    let cells = descent.cells();
    let root = Cell::root(cells);
    let step = scene.step_along(ray);
    let mut run: Option<Sample> = None;
    let mut t = span[0];
    let mut at = ray.cell_at(t, root, cells);
    for _ in 0..MAX_LOOKUPS {
        let (word, cell) = descent.descend(at, what);
        if word.0 == 0 {
            // Empty: the run ends where the ray entered this cell, and the next begins beyond it.
            if let Some(last) = run.take() {
                let end = ray.entry(cell, cells).min(t).max(last.t);
                gathered.pass_between(scene, ray, descent, [last.t, end], [last.value; 2]);
            }
            gathered.forget_last();
            let exits = ray.exits(cell, cells);
            let t_exit = exits.min_element();
            at = ray.step(cell, exits, t_exit, cells);
            if at.max_element() >= cells || t_exit >= span[1] {
                return true;
            }
            t = t_exit.max(t);
            continue;
        }
        way.samples += 1;
        let depth = word.depth();
        run = match run {
            // Deeper than the step: back to the last sample, and on from there with the deeper leaf's step.
            Some(last) if depth > last.step_depth => Some(Sample { step_depth: depth, ..last }),
            last => {
                let value = value(scene, ray, descent, word, cell, t);
                if let Some(last) = last {
                    gathered.pass_between(scene, ray, descent, [last.t, t], [last.value, value]);
                    if gathered.is_opaque(scene) {
                        return false;
                    }
                }
                Some(Sample { t, value, step_depth: depth })
            }
        };
        if let Some(last) = &run {
            t = last.t + step_at(step, last.step_depth);
            if t >= span[1] {
                let mut end = last.value;
                if scene.continuous {
                    let (word, cell) = descent.descend(ray.cell_at(span[1], root, cells), what);
                    end = if word.0 == 0 { end } else { value(scene, ray, descent, word, cell, span[1]) };
                }
                gathered.pass_between(scene, ray, descent, [last.t, span[1]], [last.value, end]);
                return !gathered.is_opaque(scene);
            }
        }
        at = ray.cell_at(t, root, cells);
    }
    false
}

/// The field at `t`, in the leaf found last.
fn value(scene: &Scene, ray: &Ray, descent: &Descent, word: Word, cell: Cell, t: f32) -> f32 {
    if scene.continuous { trilinear(&descent.corners(), ray.within(t, cell, descent.cells())) } else { word.value() }
}
