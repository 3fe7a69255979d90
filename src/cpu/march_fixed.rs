//! The march with one step everywhere: the twin of `shaders/march_fixed.wgsl`.

use super::descent::{Descent, What, Word};
use super::leap::next_active;
use super::ray::{Cell, FAR, Ray};
use super::{MIN_STEP, Scene, Way};
use crate::octree::trilinear;
use crate::optics::Light;

/// The leaf that the last sample fell into.
struct Leaf {
    word: Word,
    cell: Cell,
    corners: [f32; 8],
    /// Where the ray leaves it.
    exit: f32,
}

/// Marches the steps of a span of a ray that touch a part of it; adds their light and the samples taken in full leaves. Samples lie at the
/// multiples of the step and at the ends of spans, the field is linear in between. Returns whether there may be more to see behind.
pub(super) fn march(scene: &Scene, ray: &Ray, way: &mut Way, [span, part]: [[f32; 2]; 2], light: &mut Light) -> bool {
    let step = scene.step_along(ray).max(MIN_STEP);
    let begin = span[0].max(way.marched_to);
    let end = span[1].min(part[1]);
    let mut i = (part[0].max(begin) / step).floor();
    let mut t = (i * step).max(begin);
    if t >= end {
        return true;
    }
    let mut leaf = Leaf { word: Word(0), cell: Cell::root(way.descent.cells()), corners: [0.0; 8], exit: -FAR };
    let mut front = leaf.sample(scene, ray, way, t);
    loop {
        if scene.is_skipping && !(leaf.word.0 != 0 && way.descent.is_active()) {
            let active = next_active(ray, &mut way.descent, t, end);
            leaf.exit = -FAR;
            if active >= end {
                return true;
            }
            let steps = (active / step).floor();
            if steps > i {
                i = steps;
                t = (i * step).max(t);
                front = leaf.sample(scene, ray, way, t);
            }
        }
        i += 1.0;
        let next = (i * step).min(span[1]);
        let back = leaf.sample(scene, ray, way, next);
        add_segment(scene, light, [front, back], (next - t) * ray.length);
        way.marched_to = next;
        if light.transmittance < scene.min_transmittance {
            return false;
        }
        if next >= end {
            return true;
        }
        (t, front) = (next, back);
    }
}

impl Leaf {
    /// The field at `t`, none where the octree is empty.
    fn sample(&mut self, scene: &Scene, ray: &Ray, way: &mut Way, t: f32) -> Option<f32> {
        let descent: &mut Descent = &mut way.descent;
        let cells = descent.cells();
        if t >= self.exit {
            (self.word, self.cell) = descent.descend(ray.cell_at(t, Cell::root(cells), cells), What::All);
            self.exit = ray.exits(self.cell, cells).min_element();
            if scene.continuous && self.word.0 != 0 {
                self.corners = descent.corners();
            }
        }
        if self.word.0 == 0 {
            return None;
        }
        way.samples += 1;
        Some(if scene.continuous { trilinear(&self.corners, ray.within(t, self.cell, cells)) } else { self.word.value() })
    }
}

/// Passes a step. Where one end is empty the other's value holds for half of it; without samples at corners the front's does for all.
fn add_segment(scene: &Scene, light: &mut Light, ends: [Option<f32>; 2], length: f32) {
    match ends {
        [Some(front), _] if !scene.continuous => light.add_constant(scene.table, front, length),
        _ if !scene.continuous => {}
        [Some(front), Some(back)] => light.add_linear(scene.table, front, back, length),
        [Some(value), None] | [None, Some(value)] => light.add_constant(scene.table, value, 0.5 * length),
        [None, None] => {}
    }
}
