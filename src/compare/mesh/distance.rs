//! How far surfaces are from each other: the Hausdorff distance, and means.

use super::{Nearest, Surface};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Items that a task takes at once.
const CHUNK: usize = 1 << 10;

/// Parts of triangles that are refined at once.
const BATCH: usize = 1 << 11;

/// How distances are measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceOptions {
    /// The largest distance over a whole surface is found to this, in parts of the diagonal of A's bounds.
    pub tolerance: f64,
    /// Places of each surface, spread evenly over its area, that means are of; every triangle has one at least.
    pub samples: u64,
    /// Triangles that are divided at most to find the largest distance; when they are used up the bound says what is left open.
    pub divisions: u64,
}

impl Default for DistanceOptions {
    fn default() -> Self {
        DistanceOptions { tolerance: 1e-6, samples: 100_000, divisions: 1_000_000 }
    }
}

/// The distance of one surface from another, which is not that of the other from this one. World units.
#[derive(Debug, Clone, PartialEq)]
pub struct OneSided {
    /// The smallest at a point or sample.
    pub min: f64,
    /// The mean over the area.
    pub mean: f64,
    /// The root of the mean square over the area.
    pub rms: f64,
    /// The largest that was found anywhere on the surface.
    pub max: f64,
    /// No place of the surface, in the middle of triangles too, is further away than this; `max` but for the tolerance.
    pub bound: f64,
    /// The largest at a point of the mesh.
    pub max_at_points: f64,
    /// Where the largest is, relative to the surface's origin.
    pub max_at: DVec3,
    /// The place of the other surface that is nearest to it.
    pub max_near: DVec3,
    /// The triangle that it is on.
    pub max_triangle: u32,
    /// How many places the means are of.
    pub samples: u64,
    /// The distance at each point of the surface.
    pub at_points: Vec<f64>,
}

/// The distances of two surfaces from each other.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceDistances {
    /// Of A from B: over A's surface.
    pub a_to_b: OneSided,
    /// Of B from A: over B's surface.
    pub b_to_a: OneSided,
    /// The diagonal of A's bounds, which relative distances are parts of.
    pub diagonal: f64,
}

impl SurfaceDistances {
    /// Measures both sides. The surfaces must have triangles and one origin.
    pub fn measure(a: &Surface, b: &Surface, options: &DistanceOptions, progress: &Progress) -> Result<Self, Cancelled> {
        let (near_a, near_b) = rayon::join(|| Nearest::new(a), || Nearest::new(b));
        Self::between([a, b], [&near_a, &near_b], options, progress)
    }

    /// As [`SurfaceDistances::measure`], with the hierarchies of both at hand.
    pub fn between(
        [a, b]: [&Surface; 2],
        [near_a, near_b]: [&Nearest; 2],
        options: &DistanceOptions,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let diagonal = a.bounds().diagonal();
        progress.begin("measuring distances", (a.points.len() + a.triangles.len() + b.points.len() + b.triangles.len()) as u64);
        let a_to_b = one_sided(a, near_b, options, diagonal, progress)?;
        let b_to_a = one_sided(b, near_a, options, diagonal, progress)?;
        Ok(SurfaceDistances { a_to_b, b_to_a, diagonal })
    }

    /// The Hausdorff distance: the larger of the two sides' largest.
    pub fn hausdorff(&self) -> f64 {
        self.a_to_b.max.max(self.b_to_a.max)
    }

    /// What the Hausdorff distance is at most.
    pub fn bound(&self) -> f64 {
        self.a_to_b.bound.max(self.b_to_a.bound)
    }
}

/// A part of a triangle whose places are at most so far away.
#[derive(Clone, Copy)]
struct Part {
    upper: f64,
    /// The place of the triangle on the other side that says so.
    by: u32,
    corners: [DVec3; 3],
    /// The nearest triangle of each corner and its distance.
    near: [u32; 3],
    distances: [f64; 3],
    triangle: u32,
    /// How often it was cut since it was last divided by the middles of its sides.
    cuts: u8,
}

/// The furthest place so far.
#[derive(Clone, Copy)]
struct Furthest {
    distance: f64,
    at: DVec3,
    near: u32,
    triangle: u32,
}

/// What a triangle's samples say.
struct Sampled {
    part: Part,
    area: f64,
    sum: f64,
    sum_of_squares: f64,
    min: f64,
    furthest: Furthest,
    samples: u64,
}

fn one_sided(from: &Surface, to: &Nearest, options: &DistanceOptions, diagonal: f64, progress: &Progress) -> Result<OneSided, Cancelled> {
    let points = (0..from.points.len().div_ceil(CHUNK)).into_par_iter().map(|chunk| {
        progress.check()?;
        let mut near = 0;
        let points = &from.points[chunk * CHUNK..((chunk + 1) * CHUNK).min(from.points.len())];
        progress.add(points.len() as u64);
        Ok(points
            .iter()
            .map(|&p| {
                let hit = to.find(p, near);
                near = hit.place;
                (hit.place, hit.squared.sqrt())
            })
            .collect::<Vec<_>>())
    });
    let points: Vec<(u32, f64)> = points.collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect();

    let count = from.triangles.len();
    let total: f64 = (0..count).map(|t| from.area_of(t)).sum();
    let density = if total > 0.0 { options.samples as f64 / total } else { 0.0 };
    let sampled = (0..count.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
        progress.check()?;
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
        progress.add(range.len() as u64);
        Ok(range.map(|t| sample(from, to, t, &points, density)).collect::<Vec<_>>())
    });
    let sampled: Vec<Sampled> = sampled.collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect();

    let mut furthest = Furthest { distance: -1.0, at: DVec3::ZERO, near: 0, triangle: 0 };
    let (mut min, mut sum, mut sum_of_squares, mut samples) = (f64::INFINITY, 0.0, 0.0, 0);
    for triangle in &sampled {
        (sum, sum_of_squares) = (sum + triangle.sum * triangle.area, sum_of_squares + triangle.sum_of_squares * triangle.area);
        (min, samples) = (min.min(triangle.min), samples + triangle.samples);
        if triangle.furthest.distance > furthest.distance {
            furthest = triangle.furthest;
        }
    }
    let parts = sampled.into_iter().map(|triangle| triangle.part).collect();
    let bound = refine(parts, to, &mut furthest, options.tolerance * diagonal, options.divisions, progress)?;
    let per_area = if total > 0.0 { 1.0 / total } else { 0.0 };
    Ok(OneSided {
        min,
        mean: sum * per_area,
        rms: (sum_of_squares * per_area).sqrt(),
        max: furthest.distance,
        bound,
        max_at_points: points.iter().map(|p| p.1).fold(0.0, f64::max),
        max_at: furthest.at,
        max_near: to.point(furthest.at, furthest.near),
        max_triangle: furthest.triangle,
        samples,
        at_points: points.into_iter().map(|p| p.1).collect(),
    })
}

/// The middles of equal parts of a triangle, n along each side, as many as its area needs, and what its places are at most.
fn sample(from: &Surface, to: &Nearest, t: usize, points: &[(u32, f64)], density: f64) -> Sampled {
    let (corners, ids, area) = (from.corners(t), from.triangles[t], from.area_of(t));
    let (near, distances) = (ids.map(|i| points[i as usize].0), ids.map(|i| points[i as usize].1));
    let middle = to.find(corners.into_iter().sum::<DVec3>() / 3.0, near[0]);
    let mut part = Part { upper: f64::INFINITY, by: middle.place, corners, near, distances, triangle: t as u32, cuts: 0 };
    part.bound_by(to, [middle.place, near[0], near[1], near[2]]);

    let furthest = (0..3).max_by(|&i, &j| distances[i].total_cmp(&distances[j])).unwrap_or(0);
    let furthest = Furthest { distance: distances[furthest], at: corners[furthest], near: near[furthest], triangle: t as u32 };
    let min = distances.into_iter().fold(f64::INFINITY, f64::min);
    let mut found = Sampled { part, area, sum: 0.0, sum_of_squares: 0.0, min, furthest, samples: 0 };
    let side = (area * density).sqrt().round().max(1.0) as u64;
    let mut near = middle.place;
    let mut take = |u: f64, v: f64| {
        let at = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
        let hit = if side == 1 { middle } else { to.find(at, near) };
        near = hit.place;
        // What a bound of 0 says is more than what rounding leaves.
        let distance = hit.squared.sqrt().min(part.upper);
        found.sum += distance;
        found.sum_of_squares += distance * distance;
        found.min = found.min.min(distance);
        found.samples += 1;
        if distance > found.furthest.distance {
            found.furthest = Furthest { distance, at, near: hit.place, triangle: t as u32 };
        }
    };
    let scale = 1.0 / side as f64;
    for i in 0..side {
        for j in 0..side - i {
            take((i as f64 + 1.0 / 3.0) * scale, (j as f64 + 1.0 / 3.0) * scale);
            if j + 1 < side - i {
                take((i as f64 + 2.0 / 3.0) * scale, (j as f64 + 2.0 / 3.0) * scale);
            }
        }
    }
    let per_sample = 1.0 / found.samples as f64;
    (found.sum, found.sum_of_squares) = (found.sum * per_sample, found.sum_of_squares * per_sample);
    found
}

/// Divides parts that may hold a place further away than the furthest known, the most promising first, until none does by more than the
/// tolerance, and returns what no place exceeds.
///
/// Distance from one triangle is a convex function, so that over a part it is largest at a corner; no place of the part is further from the
/// whole surface. The smallest such number over the triangles nearest to the corners bounds the part (after Guthe, Borodin and Klein, "Fast
/// and accurate Hausdorff distance calculation between meshes", 2005; Tang, Lee and Kim, "Interactive Hausdorff distance computation for
/// general polygonal models", 2009). Where a part reaches beyond the triangle that bounds it, it is cut along that one's side, so that what
/// lies in one plane on both sides needs a few cuts only; else, and after three cuts, it is divided by the middles of its sides.
fn refine(
    parts: Vec<Part>,
    to: &Nearest,
    furthest: &mut Furthest,
    tolerance: f64,
    mut divisions: u64,
    progress: &Progress,
) -> Result<f64, Cancelled> {
    let mut left_out = furthest.distance;
    let mut heap = BinaryHeap::new();
    let mut keep = |parts: &mut dyn Iterator<Item = Part>, heap: &mut BinaryHeap<Part>, limit: f64| {
        for part in parts {
            if part.upper > limit { heap.push(part) } else { left_out = left_out.max(part.upper) }
        }
    };
    keep(&mut parts.into_iter(), &mut heap, furthest.distance + tolerance);
    while divisions > 0 && heap.peek().is_some_and(|part| part.upper > furthest.distance + tolerance) {
        progress.check()?;
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH.min(divisions as usize) && heap.peek().is_some_and(|part| part.upper > furthest.distance + tolerance) {
            batch.extend(heap.pop());
        }
        divisions -= batch.len() as u64;
        let cut_from = tolerance / 4.0;
        let divided: Vec<Vec<Part>> =
            batch.par_iter().map(|part| part.cut(to, cut_from).unwrap_or_else(|| part.divided(to).to_vec())).collect();
        for part in divided.iter().flatten() {
            for i in 0..3 {
                let distance = part.distances[i].min(part.upper);
                if distance > furthest.distance {
                    *furthest = Furthest { distance, at: part.corners[i], near: part.near[i], triangle: part.triangle };
                }
            }
        }
        keep(&mut divided.into_iter().flatten(), &mut heap, furthest.distance + tolerance);
    }
    let open = heap.peek().map_or(0.0, |part| part.upper);
    Ok(left_out.max(open).max(furthest.distance))
}

impl Part {
    /// Lowers the bound by some triangles of the other side.
    fn bound_by(&mut self, to: &Nearest, places: [u32; 4]) {
        for (i, &place) in places.iter().enumerate() {
            if places[..i].contains(&place) {
                continue;
            }
            let squared = self.corners.iter().map(|&p| to.squared(p, place)).fold(0.0, f64::max);
            if squared.sqrt() < self.upper {
                (self.upper, self.by) = (squared.sqrt(), place);
            }
        }
    }

    /// A part of three places and what is nearest to them.
    fn of(&self, to: &Nearest, three: [Place; 3], cuts: u8) -> Part {
        let (corners, near, distances) = (three.map(|p| p.at), three.map(|p| p.near), three.map(|p| p.distance));
        let mut part = Part { corners, near, distances, cuts, ..*self };
        part.bound_by(to, [self.by, near[0], near[1], near[2]]);
        part
    }

    fn corner(&self, i: usize) -> Place {
        Place { at: self.corners[i], near: self.near[i], distance: self.distances[i] }
    }

    /// The place between two corners, by how far it is from the first.
    fn between(&self, to: &Nearest, [i, j]: [usize; 2], share: f64) -> Place {
        let at = self.corners[i] + (self.corners[j] - self.corners[i]) * share;
        let near = if self.distances[i] <= self.distances[j] { self.near[i] } else { self.near[j] };
        let hit = to.find(at, near);
        Place { at, near: hit.place, distance: hit.squared.sqrt() }
    }

    /// The part on both sides of a plane through a side of the triangle that bounds it, square to that one; of three planes the one beyond
    /// which the part reaches furthest. `None` if it reaches nowhere further than `least`, or was cut three times.
    fn cut(&self, to: &Nearest, least: f64) -> Option<Vec<Part>> {
        if self.cuts == 3 {
            return None;
        }
        let [a, b, c] = to.corners(self.by);
        let normal = (b - a).cross(c - a);
        let inside = |(from, along): (DVec3, DVec3)| {
            let inwards = normal.cross(along).normalize_or_zero();
            self.corners.map(|corner| (corner - from).dot(inwards))
        };
        let reach = |s: &[f64; 3]| (-s[0].min(s[1]).min(s[2])).min(s[0].max(s[1]).max(s[2]));
        let sides = [(a, b - a), (b, c - b), (c, a - c)].map(inside);
        let side = sides.into_iter().max_by(|x, y| reach(x).total_cmp(&reach(y))).filter(|side| reach(side) > least)?;
        // The corner that is alone on its side, and the two others in order round the part.
        let is_inside = side.map(|s| s > 0.0);
        let alone = (0..3).find(|&i| is_inside[i] != is_inside[(i + 1) % 3] && is_inside[i] != is_inside[(i + 2) % 3])?;
        let (next, last) = ((alone + 1) % 3, (alone + 2) % 3);
        let share = |other: usize| side[alone] / (side[alone] - side[other]);
        let (on_next, on_last) = (self.between(to, [alone, next], share(next)), self.between(to, [alone, last], share(last)));
        let threes = [
            [self.corner(alone), on_next, on_last],
            [on_next, self.corner(next), self.corner(last)],
            [on_next, self.corner(last), on_last],
        ];
        Some(threes.map(|three| self.of(to, three, self.cuts + 1)).to_vec())
    }

    /// Four parts by the middles of the sides.
    fn divided(&self, to: &Nearest) -> [Part; 4] {
        let middles = [[0, 1], [1, 2], [2, 0]].map(|ends| self.between(to, ends, 0.5));
        [
            [self.corner(0), middles[0], middles[2]],
            [middles[0], self.corner(1), middles[1]],
            [middles[2], middles[1], self.corner(2)],
            [middles[0], middles[1], middles[2]],
        ]
        .map(|three| self.of(to, three, 0))
    }
}

/// A place and what is nearest to it.
#[derive(Clone, Copy)]
struct Place {
    at: DVec3,
    near: u32,
    distance: f64,
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.upper.total_cmp(&other.upper)
    }
}
