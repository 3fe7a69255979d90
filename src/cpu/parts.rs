//! The parts of a ray that hold all that is active: the twin of `shaders/intervals.wgsl` and `shaders/shared/{cuts,parts}.wgsl`.

use super::descent::{Descent, What};
use super::ray::{Cell, FAR, Ray};
use crate::octree::Split;

/// Into what rays are cut.
#[derive(Clone, Copy)]
pub(super) struct Cuts {
    pub parts: u32,
    /// The plane that halves the volume; without one, rays are cut into equal parts.
    pub split: Option<Split>,
}

/// The parts of one ray, nearest first.
pub(super) struct Parts {
    /// (begin, end); begin >= end for a part that holds nothing.
    intervals: Vec<[f32; 2]>,
    next: usize,
}

/// A part that holds nothing.
const NOTHING: [f32; 2] = [FAR, -FAR];

impl Cuts {
    /// The t at which part `i` begins, and the one before ends.
    fn cut(self, ray: &Ray, i: u32) -> f32 {
        match self.split {
            _ if i >= self.parts => ray.t_out,
            None => ray.t_out * (i as f32 / self.parts as f32),
            Some(split) => ((split.position - ray.origin[split.axis]) * ray.inverse[split.axis]).clamp(0.0, ray.t_out),
        }
    }
}

impl Parts {
    /// All of a ray at once.
    pub fn whole() -> Self {
        Parts { intervals: vec![[0.0, FAR]], next: 0 }
    }

    /// Follows a ray from leaf to leaf and notes, for each part, where the first active leaf begins and the last one ends.
    pub fn note(ray: &Ray, descent: &mut Descent, cuts: Cuts) -> Self {
        let cells = descent.cells();
        let mut intervals = vec![NOTHING; cuts.parts as usize];
        let (mut part, mut part_end) = (0, cuts.cut(ray, 1));
        let mut t = 0.0;
        let mut at = ray.cell_at(t, Cell::root(cells), cells);
        loop {
            let (word, cell) = descent.descend(at, What::Whole);
            let exits = ray.exits(cell, cells);
            let t_exit = exits.min_element();
            if word.0 != 0 {
                // What reaches over a cut is in both parts.
                let end = t_exit.min(ray.t_out);
                let mut begin: f32 = t;
                loop {
                    if begin < end.min(part_end) {
                        let [first, last] = &mut intervals[part as usize];
                        (*first, *last) = (first.min(begin), last.max(end.min(part_end)));
                    }
                    if end <= part_end || part + 1 == cuts.parts {
                        break;
                    }
                    begin = begin.max(part_end);
                    part += 1;
                    part_end = cuts.cut(ray, part + 1);
                }
            }
            if t_exit >= ray.t_out {
                break;
            }
            at = ray.step(cell, exits, t_exit, cells);
            if at.max_element() >= cells {
                break;
            }
            t = t.max(t_exit);
        }
        Parts { intervals, next: 0 }
    }

    /// The next part that holds something, joined with those that begin where it ends.
    pub fn next(&mut self) -> [f32; 2] {
        let mut part = NOTHING;
        while let Some(&[begin, end]) = self.intervals.get(self.next) {
            if begin < end {
                if part[0] < FAR && begin > part[1] {
                    break;
                }
                part = [part[0].min(begin), end];
            }
            self.next += 1;
        }
        part
    }
}
