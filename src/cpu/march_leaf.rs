//! The march leaf by leaf: the twin of `shaders/march_leaf.wgsl`.

use super::descent::{Descent, Word};
use super::pass::{Gathered, Piece};
use super::ray::{Cell, Ray};
use super::{Scene, Way, step_at};
use crate::octree::{trilinear, trilinear_gradient};
use glam::Vec3;

/// A leaf is cut into at most so many pieces.
pub const MAX_PIECES: f32 = 64.0;

/// Follows a ray from leaf to leaf (method 1.4, the stricter rule) through a stretch; adds its light and the number of full leaves met. Returns whether there may be more to see behind.
pub(super) fn march(scene: &Scene, ray: &Ray, way: &mut Way, span: [f32; 2], gathered: &mut Gathered) -> bool {
    let (descent, what) = (&mut way.descent, scene.what());
    let cells = descent.cells();
    let mut t = span[0];
    let mut at = ray.cell_at(t, Cell::root(cells), cells);
    loop {
        let (word, cell) = descent.descend(at, what);
        let exits = ray.exits(cell, cells);
        let t_exit = exits.min_element();
        let t_next = t_exit.min(span[1]).max(t);
        if word.0 != 0 {
            way.samples += 1;
            pass_leaf(scene, ray, descent, word, cell, [t, t_next], gathered);
            if gathered.is_opaque(scene) {
                return false;
            }
        } else {
            gathered.forget_last();
        }
        if t_exit >= span[1] {
            return true;
        }
        at = ray.step(cell, exits, t_exit, cells);
        if at.max_element() >= cells {
            return true;
        }
        t = t_next;
    }
}

/// Passes the part `span` of a ray, inside one leaf: with one value (samples at a finer step would all find it), or with the trilinear
/// field, linear over pieces no longer than the step of the leaf's depth.
fn pass_leaf(scene: &Scene, ray: &Ray, descent: &mut Descent, word: Word, cell: Cell, span: [f32; 2], gathered: &mut Gathered) {
    let t_length = span[1] - span[0];
    if !scene.continuous {
        gathered.pass_between(scene, ray, descent, span, [word.value(); 2]);
        return;
    }
    let corners = descent.corners();
    if gathered.is_beneath(scene, &corners) {
        return;
    }
    let cells = descent.cells();
    let (from, to) = (ray.within(span[0], cell, cells), ray.within(span[1], cell, cells));
    let pieces = (t_length / step_at(scene.step_along(ray), word.depth())).ceil().clamp(1.0, MAX_PIECES);
    let length = t_length * ray.length / pieces;
    let mut front = trilinear(&corners, from);
    let mut piece = 1.0;
    while piece <= pieces {
        let back = trilinear(&corners, from + (to - from) * (piece / pieces));
        let mut gradient = Vec3::ZERO;
        if scene.is_volume_shaded {
            let middle = from + (to - from) * ((piece - 0.5) / pieces);
            gradient = trilinear_gradient(&corners, middle) * (cells as f32 / cell.size as f32);
        }
        // The last ends where the next leaf begins, to the bit.
        let at = |p: f32| if p == pieces { span[1] } else { span[0] + t_length * (p / pieces) };
        let t = [at(piece - 1.0), at(piece)];
        let passed = Piece { span: t, ends: [front, back], length, gradient };
        gathered.pass(scene, ray, descent, passed);
        front = back;
        piece += 1.0;
    }
}
