//! The octree's field and its gradient anywhere on a ray: the twin of `shaders/shared/probe.wgsl`.

use super::Scene;
use super::descent::{Descent, What};
use super::pass::Piece;
use super::ray::{Cell, Ray};
use crate::octree::{trilinear, trilinear_gradient};
use glam::{IVec3, Vec3};

/// A surface is looked for in at most so many steps.
pub const MAX_STEPS: u32 = 6;
/// Values so near to a surface's are its.
pub const CLOSE: f32 = 1e-6;

/// The field at a place.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    pub value: f32,
    /// Normalised values per cube edge.
    pub gradient: Vec3,
}

/// Where a ray meets a surface, and the field's gradient there.
pub(super) struct Meeting {
    pub t: f32,
    pub gradient: Vec3,
}

/// The field at `t`; none where the octree is empty. The march's own place in the tree is lost.
pub(super) fn probe(scene: &Scene, ray: &Ray, descent: &mut Descent, t: f32) -> Option<Probe> {
    let cells = descent.cells();
    let (word, cell) = descent.descend(ray.cell_at(t, Cell::root(cells), cells), What::All);
    if word.0 == 0 {
        return None;
    }
    if !scene.continuous {
        return Some(Probe { value: word.value(), gradient: differences(descent, cell, word.value()) });
    }
    let (corners, at) = (descent.corners(), ray.within(t, cell, cells));
    let gradient = trilinear_gradient(&corners, at) * (cells as f32 / cell.size as f32);
    Some(Probe { value: trilinear(&corners, at), gradient })
}

/// The gradient where leaves have one value each: by the leaves on either side.
fn differences(descent: &mut Descent, cell: Cell, value: f32) -> Vec3 {
    let cells = descent.cells();
    let middle = |cell: Cell, axis: usize| cell.low[axis] as f32 + 0.5 * cell.size as f32;
    let mut gradient = Vec3::ZERO;
    for axis in 0..3 {
        let (mut rise, mut run) = (0.0, 0.0);
        for side in [-1, 1] {
            let mut at = (cell.low + cell.size / 2).as_ivec3();
            at[axis] = if side < 0 { cell.low[axis] as i32 - 1 } else { (cell.low[axis] + cell.size) as i32 };
            if at.cmplt(IVec3::ZERO).any() || at.max_element() >= cells as i32 {
                continue;
            }
            let (word, beyond) = descent.descend(at.as_uvec3(), What::All);
            if word.0 != 0 {
                rise += side as f32 * (word.value() - value);
                run += (middle(beyond, axis) - middle(cell, axis)).abs();
            }
        }
        gradient[axis] = if run > 0.0 { rise * cells as f32 / run } else { 0.0 };
    }
    gradient
}

/// Where in a piece the field has a value that lies between those at its ends: by false position, in which an end that stays a second
/// time counts for half (the Illinois method).
pub(super) fn meet(scene: &Scene, ray: &Ray, descent: &mut Descent, piece: Piece, value: f32) -> Meeting {
    let ([mut low, mut high], [front, back]) = (piece.span, piece.ends);
    let (mut below, mut above) = (front - value, back - value);
    // Which end the last step moved: -1 the first, 1 the second.
    let mut side = 0;
    let mut found = Meeting { t: low + (high - low) * (below / (below - above)), gradient: Vec3::ZERO };
    for step in 0..MAX_STEPS {
        let Some(Probe { value: here, gradient }) = probe(scene, ray, descent, found.t) else { break };
        found.gradient = gradient;
        let off = here - value;
        if !scene.continuous || off.abs() <= CLOSE || step + 1 == MAX_STEPS {
            break;
        }
        if (off < 0.0) == (below < 0.0) {
            (low, below) = (found.t, off);
            above *= if side < 0 { 0.5 } else { 1.0 };
            side = -1;
        } else {
            (high, above) = (found.t, off);
            below *= if side > 0 { 0.5 } else { 1.0 };
            side = 1;
        }
        let t = low + (high - low) * (below / (below - above));
        found.t = t.clamp(piece.span[0], piece.span[1]);
    }
    found
}
