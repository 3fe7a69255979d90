//! To the next active leaf: the twin of `shaders/shared/leap.wgsl`.

use super::descent::{Descent, What};
use super::ray::{Cell, FAR, Ray};

/// The t, from `t_begin` on, at which the ray enters an active leaf; [`FAR`] if there is none before `t_end`.
pub(super) fn next_active(ray: &Ray, descent: &mut Descent, t_begin: f32, t_end: f32) -> f32 {
    let cells = descent.cells();
    // The largest cell without anything active may lie above the leaf found last.
    descent.restart();
    let mut t = t_begin;
    let mut at = ray.cell_at(t, Cell::root(cells), cells);
    loop {
        let (word, cell) = descent.descend(at, What::Active);
        if word.0 != 0 {
            return t;
        }
        let exits = ray.exits(cell, cells);
        let t_exit = exits.min_element();
        if t_exit >= t_end {
            return FAR;
        }
        at = ray.step(cell, exits, t_exit, cells);
        if at.max_element() >= cells {
            return FAR;
        }
        t = t.max(t_exit);
    }
}
