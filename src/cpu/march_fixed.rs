//! The march with one step everywhere: the twin of `shaders/march_fixed.wgsl`.

use super::descent::{Descent, What, Word};
use super::leap::next_active;
use super::pass::Gathered;
use super::ray::{Cell, FAR, Ray};
use super::{MIN_STEP, Scene, Way};
use crate::octree::trilinear;

/// The leaf that the last sample fell into.
struct Leaf {
    word: Word,
    cell: Cell,
    corners: [f32; 8],
    /// Where the ray leaves it.
    exit: f32,
}

/// Marches a ray; adds its light and the samples taken in full leaves. Samples lie at the multiples of the step and at the ends of spans,
/// the field is linear in between. Whatever is skipped, no sample moves.
pub(super) fn march(scene: &Scene, ray: &Ray, way: &mut Way, gathered: &mut Gathered) {
    let step = scene.step_along(ray).max(MIN_STEP);
    // The step that begins at t.
    let (mut i, mut t) = (0.0f32, 0.0f32);
    // The last sample, where a step begins if there is one, and where it lies.
    let mut front: Option<(Option<f32>, f32)> = None;
    let mut leaf = Leaf { word: Word(0), cell: Cell::root(way.descent.cells()), corners: [0.0; 8], exit: -FAR };
    // The present span, and where the stretch in it ends; none if another one is to be found.
    let mut stretch: Option<([f32; 2], f32)> = None;
    loop {
        let (span, end) = match stretch {
            Some(stretch) => stretch,
            None => {
                let Some([span, part]) = way.find_stretch(scene, ray, gathered) else { return };
                if scene.with_faces {
                    leaf.exit = -FAR;
                }
                let end = span[1].min(part[1]);
                let begin = span[0].max(t);
                let steps = (part[0].max(begin) / step).floor();
                let first = (steps * step).max(begin);
                if first >= end {
                    way.leave_stretch(scene, ray, gathered);
                    continue;
                }
                if front.is_some_and(|(_, last)| first <= last) {
                    // Stretches that follow each other share a step.
                    i += 1.0;
                    t = (i * step).min(span[1]);
                } else {
                    (i, t, front) = (steps, first, None);
                    leaf.exit = -FAR;
                    gathered.forget_last();
                }
                *stretch.insert((span, end))
            }
        };
        let value = leaf.sample(scene, ray, way, t);
        if let Some((front, last)) = front {
            pass_step(scene, ray, way, gathered, [last, t], [front, value]);
            if gathered.is_opaque(scene) {
                return;
            }
            if scene.is_probing() {
                // The place in the tree was lost.
                leaf.exit = -FAR;
                leaf.look(scene, ray, way, t);
            }
        }
        front = Some((value, t));
        let mut is_over = t >= end;
        if !is_over && scene.is_skipping && !(leaf.word.0 != 0 && way.descent.is_active()) {
            let next_begin = next_active(ray, &mut way.descent, t, end);
            leaf.exit = -FAR;
            is_over = next_begin >= end;
            let steps = (next_begin / step).floor();
            if !is_over && steps > i {
                i = steps;
                t = (i * step).max(t);
                front = None;
                gathered.forget_last();
                continue;
            }
        }
        if is_over {
            stretch = None;
            way.leave_stretch(scene, ray, gathered);
        } else {
            i += 1.0;
            t = (i * step).min(span[1]);
        }
    }
}

impl Leaf {
    /// Finds the leaf at `t`, if it is another than before.
    fn look(&mut self, scene: &Scene, ray: &Ray, way: &mut Way, t: f32) {
        let descent: &mut Descent = &mut way.descent;
        let cells = descent.cells();
        if t >= self.exit {
            (self.word, self.cell) = descent.descend(ray.cell_at(t, Cell::root(cells), cells), What::All);
            self.exit = ray.exits(self.cell, cells).min_element();
            if scene.continuous && self.word.0 != 0 {
                self.corners = descent.corners();
            }
        }
    }

    /// The field at `t`, none where the octree is empty.
    fn sample(&mut self, scene: &Scene, ray: &Ray, way: &mut Way, t: f32) -> Option<f32> {
        self.look(scene, ray, way, t);
        if self.word.0 == 0 {
            return None;
        }
        way.samples += 1;
        let cells = way.descent.cells();
        Some(if scene.continuous { trilinear(&self.corners, ray.within(t, self.cell, cells)) } else { self.word.value() })
    }
}

/// Passes a step. Where one end is empty the other's value holds for half of it; without samples at corners the front's does for all.
fn pass_step(scene: &Scene, ray: &Ray, way: &mut Way, gathered: &mut Gathered, span: [f32; 2], ends: [Option<f32>; 2]) {
    let descent = &mut way.descent;
    let middle = span[0] + 0.5 * (span[1] - span[0]);
    match ends {
        [Some(front), _] if !scene.continuous => gathered.pass_between(scene, ray, descent, span, [front; 2]),
        [Some(front), Some(back)] if scene.continuous => gathered.pass_between(scene, ray, descent, span, [front, back]),
        [Some(value), None] if scene.continuous => gathered.pass_between(scene, ray, descent, [span[0], middle], [value; 2]),
        [None, Some(value)] if scene.continuous => {
            gathered.forget_last();
            gathered.pass_between(scene, ray, descent, [middle, span[1]], [value; 2]);
        }
        _ => gathered.forget_last(),
    }
}
