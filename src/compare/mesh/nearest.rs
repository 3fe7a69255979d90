//! The triangle of a surface that is nearest to a point.

use super::Surface;
use crate::geometry;
use glam::DVec3;
use rayon::prelude::*;

/// Triangles below a node without children, at most.
const LEAF: usize = 4;

/// Triangles that are sorted by one task.
const TASK: usize = 1 << 12;

/// A triangle is thin if its area is this small beside its longest edge squared: weights of its corners are then not trusted.
const THIN: f64 = 1e-3;

/// Finds the nearest triangle of a surface, exactly but for rounding in f64.
///
/// A binary hierarchy of boxes, as deep as the logarithm of the number of triangles whatever the surface, without pointers: the children of
/// node n are 2 n + 1 and 2 n + 2. Each node's triangles are halved by their middles along the longest side of those. 150 bytes a triangle.
#[derive(Debug, Clone)]
pub struct Nearest {
    /// Corners of the triangles in the order of leaves.
    triangles: Vec<[DVec3; 3]>,
    /// Their numbers in the surface.
    numbers: Vec<u32>,
    boxes: Vec<[DVec3; 2]>,
    first_leaf: usize,
}

/// The nearest triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Its place in the order of leaves, to begin the next search with.
    pub place: u32,
    /// The square of its distance.
    pub squared: f64,
}

impl Nearest {
    /// A hierarchy over the triangles of a surface, which must have one.
    pub fn new(surface: &Surface) -> Self {
        let count = surface.triangles.len();
        let leaves = count.div_ceil(LEAF).max(1).next_power_of_two();
        let middle = |t: usize| surface.corners(t).into_iter().sum::<DVec3>();
        let mut items: Vec<(DVec3, u32)> = (0..count).into_par_iter().map(|t| (middle(t), t as u32)).collect();
        halve(&mut items, leaves);
        let numbers: Vec<u32> = items.par_iter().map(|item| item.1).collect();
        let triangles: Vec<[DVec3; 3]> = numbers.par_iter().map(|&t| surface.corners(t as usize)).collect();
        let first_leaf = leaves - 1;
        let mut boxes = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; first_leaf + leaves];
        let join = |x: [DVec3; 2], y: [DVec3; 2]| [x[0].min(y[0]), x[1].max(y[1])];
        boxes[first_leaf..].par_iter_mut().enumerate().for_each(|(leaf, node)| {
            let corners = triangles[leaf * count / leaves..(leaf + 1) * count / leaves].as_flattened();
            *node = corners.iter().map(|&p| [p, p]).fold(*node, join);
        });
        for node in (0..first_leaf).rev() {
            boxes[node] = join(boxes[2 * node + 1], boxes[2 * node + 2]);
        }
        Nearest { triangles, numbers, boxes, first_leaf }
    }

    /// The triangle nearest to a point, beginning with one that may be near.
    pub fn find(&self, at: DVec3, near: u32) -> Hit {
        let mut best = Hit { place: near, squared: self.squared(at, near) };
        let leaves = self.first_leaf + 1;
        let mut stack = [(0.0, 0usize); 72];
        (stack[0], stack[1]) = ((0.0, usize::MAX), (self.beyond(at, 0), 0));
        let mut height = 2;
        while height > 1 {
            height -= 1;
            let (squared, node) = stack[height];
            if squared >= best.squared {
                continue;
            }
            if node < self.first_leaf {
                let [near, far] = [2 * node + 1, 2 * node + 2].map(|child| (self.beyond(at, child), child));
                let (near, far) = if near.0 <= far.0 { (near, far) } else { (far, near) };
                for child in [far, near] {
                    if child.0 < best.squared {
                        stack[height] = child;
                        height += 1;
                    }
                }
                continue;
            }
            let (leaf, count) = (node - self.first_leaf, self.triangles.len());
            for place in leaf * count / leaves..(leaf + 1) * count / leaves {
                let squared = self.squared(at, place as u32);
                if squared < best.squared {
                    best = Hit { place: place as u32, squared };
                }
            }
        }
        best
    }

    /// The square of the distance between a point and a triangle, by its place.
    #[inline]
    pub fn squared(&self, at: DVec3, place: u32) -> f64 {
        closest(at, &self.triangles[place as usize]).distance_squared(at)
    }

    /// The point of a triangle, by its place, that is nearest to a point.
    pub fn point(&self, at: DVec3, place: u32) -> DVec3 {
        closest(at, &self.triangles[place as usize])
    }

    /// The corners of a triangle, by its place.
    pub fn corners(&self, place: u32) -> [DVec3; 3] {
        self.triangles[place as usize]
    }

    /// The number in the surface of a triangle, by its place.
    pub fn number(&self, place: u32) -> u32 {
        self.numbers[place as usize]
    }

    /// The first triangle that the ray from `origin` along `direction` meets, by its number, and how many `direction`s away.
    pub fn first_met(&self, origin: DVec3, direction: DVec3) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let inverse = direction.recip();
        // Where the ray enters a box; comparisons are such that 0 / 0 along a side of it does not lose it.
        let enters = |node: usize| {
            let [low, high] = self.boxes[node];
            let (x, y) = ((low - origin) * inverse, (high - origin) * inverse);
            let (enter, leave) = (x.min(y).max_element().max(0.0), x.max(y).min_element());
            if leave < enter || low.x > high.x { f64::INFINITY } else { enter }
        };
        let leaves = self.first_leaf + 1;
        let mut stack = vec![(enters(0), 0usize)];
        while let Some((enter, node)) = stack.pop() {
            if enter == f64::INFINITY || best.is_some_and(|best| enter > best.1) {
                continue;
            }
            if node < self.first_leaf {
                let [left, right] = [2 * node + 1, 2 * node + 2].map(|child| (enters(child), child));
                stack.extend(if left.0 <= right.0 { [right, left] } else { [left, right] });
                continue;
            }
            let (leaf, count) = (node - self.first_leaf, self.triangles.len());
            for place in leaf * count / leaves..(leaf + 1) * count / leaves {
                let distance = meets(origin, direction, &self.triangles[place]);
                if let Some(t) = distance.filter(|&t| best.is_none_or(|best| t < best.1)) {
                    best = Some((self.numbers[place], t));
                }
            }
        }
        best
    }

    /// The square of the distance between a point and a node's box.
    #[inline]
    fn beyond(&self, at: DVec3, node: usize) -> f64 {
        let [low, high] = self.boxes[node];
        (low - at).max(at - high).max(DVec3::ZERO).length_squared()
    }
}

/// Orders items so that each leaf's lie together: leaf k of so many has items k n / leaves to (k + 1) n / leaves.
fn halve(items: &mut [(DVec3, u32)], leaves: usize) {
    // `first` items of `all` lie before these; cuts fall where the whole array's leaves begin.
    fn go(items: &mut [(DVec3, u32)], first: usize, all: usize, [from, to]: [usize; 2], leaves: usize) {
        if to - from < 2 || items.len() < 2 {
            return;
        }
        let half = (from + to) / 2;
        let cut = half * all / leaves - first;
        let (low, high) = items.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), i| (low.min(i.0), high.max(i.0)));
        let axis = (high - low).max_position();
        if cut < items.len() {
            items.select_nth_unstable_by(cut, |a, b| a.0[axis].total_cmp(&b.0[axis]));
        }
        let is_large = items.len() > TASK;
        let (left, right) = items.split_at_mut(cut);
        let mut both = (|| go(left, first, all, [from, half], leaves), || go(right, first + cut, all, [half, to], leaves));
        if is_large {
            rayon::join(both.0, both.1);
        } else {
            both.0();
            both.1();
        }
    }
    let count = items.len();
    go(items, 0, count, [0, leaves], leaves);
}

/// The point of a triangle nearest to another, of thin triangles too.
pub fn closest(at: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let longest = ab.length_squared().max(ac.length_squared()).max(b.distance_squared(c));
    if normal.length_squared() > THIN * THIN * longest * longest {
        let [wa, wb, wc] = geometry::closest_point_on_triangle(at, a, b, c);
        return a * wa + b * wb + c * wc;
    }
    if at == a || at == b || at == c {
        return at;
    }
    // Without weights: the foot of the perpendicular if it is inside, else the nearest point of the edges.
    let foot = at - normal * ((at - a).dot(normal) / normal.length_squared());
    let is_inside = [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| (to - from).cross(foot - from).dot(normal) >= 0.0);
    if is_inside && foot.is_finite() {
        return foot;
    }
    let on_edge = |(from, to): (DVec3, DVec3)| {
        let edge = to - from;
        let t = (at - from).dot(edge) / edge.length_squared();
        if t >= 1.0 {
            to
        } else if t > 0.0 {
            from + edge * t
        } else {
            from
        }
    };
    let candidates = [(a, b), (b, c), (a, c)].map(on_edge);
    candidates.into_iter().min_by(|p, q| p.distance_squared(at).total_cmp(&q.distance_squared(at))).unwrap_or(a)
}

/// Where a ray meets a triangle (Möller and Trumbore 1997), in front of its origin.
fn meets(origin: DVec3, direction: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(ab);
    let v = direction.dot(q) / determinant;
    let t = ac.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}
