//! Where a ray enters and leaves the mesh through its boundary surface: the twin of `shaders/shared/surface.wgsl`.
//!
//! A ray sees each vertex as a point of the plane across it, itself at the origin. A face is hit when the origin lies in its projected
//! triangle, which the signs of three cross products say, one for each edge (maths 4.2). The projected coordinates are rounded, but they
//! depend on ray and vertex only and have the same bits on every processor, and the signs are exact for them, ties included. So all faces
//! around an edge or a vertex agree on which side of it the ray passes: through a closed surface every line goes out as often as in.
//!
//! The plane is not the one perpendicular to the ray but that of the two axes along which it moves less, onto which vertices are pushed
//! along the ray (Woop, Benthin & Wald, "Watertight Ray/Triangle Intersection", JCGT 2013): two products instead of nine.

use super::ray::{FAR, Ray};
use crate::mesh::BoundarySurface;
use crate::mesh::boundary::{MAX_LEVELS, SurfaceNode, SurfaceVertex};
use crate::view::{CubePlanes, CubeRay, high_bits, mul_add};
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

/// Hits are gathered so many at a time, nearest first.
pub const MAX_HITS: usize = 16;
/// Smaller projected coordinates are taken as 0, so that no product of two underflows. 2^-36 of the cube.
pub const TINY: f32 = 1.455_191_5e-11;

/// The intervals of a ray inside the mesh as (t0, t1), t0 < t1, in order and without overlap; t counts from where the ray enters the root
/// cube, or from the eye in it, in the ray's own unit. Empty if the ray misses the cube.
pub fn surface_intervals(surface: &BoundarySurface, ray: CubeRay) -> Vec<(f32, f32)> {
    let ray = Ray::enter(ray, &CubePlanes::default());
    if ray.t_out <= 0.0 { Vec::new() } else { intervals_on(surface, &ray) }
}

/// The same of a ray that was cut to the cube, and to planes.
pub(super) fn intervals_on(surface: &BoundarySurface, ray: &Ray) -> Vec<(f32, f32)> {
    let mut way = SurfaceRay::start(surface, ray);
    std::iter::from_fn(|| Some(way.next_interval()).filter(|(t0, t1)| t0 < t1)).collect()
}

/// A ray as faces see it.
pub(super) struct Sight {
    /// The ray's origin, turned.
    origin: Vec3,
    /// What brings a point onto the plane per unit of depth.
    shear: Vec2,
    /// t per unit of depth.
    inverse: f32,
    /// The axis that the ray moves along most, and whether it moves down it.
    axis: usize,
    down: bool,
}

/// A vertex as a ray sees it: x and y across, depth along.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub at: Vec3,
    pub id: u32,
}

/// Where a ray goes through a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    pub t: f32,
    /// Twice the face's index, and 1 more if the ray leaves the mesh there.
    pub word: u32,
}

/// A ray's way through the surface: all hits of the whole line, by (t, face), and the intervals of t >= 0 inside the mesh.
pub(super) struct SurfaceRay<'a> {
    surface: &'a BoundarySurface,
    ray: &'a Ray,
    sight: Sight,
    /// The nearest hits after `after`.
    hits: [Hit; MAX_HITS],
    count: usize,
    /// The hit that comes next.
    next: usize,
    /// Whether there are more after these.
    more: bool,
    after: Hit,
    /// Where the last interval begins and ends.
    first: Hit,
    last: Hit,
    /// How often the line has entered less how often it has left.
    inside: i32,
}

impl Hit {
    /// Before all others.
    const FIRST: Hit = Hit { t: -FAR, word: 0 };

    pub fn is_exit(self) -> bool {
        self.word & 1 == 1
    }

    fn is_after(self, other: Hit) -> bool {
        self.t > other.t || (self.t == other.t && self.word > other.word)
    }
}

impl Sight {
    pub fn new(ray: &Ray) -> Sight {
        let d = ray.direction.abs();
        let axis = if d.z >= d.x.max(d.y) {
            2
        } else if d.y >= d.x {
            1
        } else {
            0
        };
        let down = ray.direction[axis] < 0.0;
        let turned = turn(axis, down, ray.direction);
        let inverse = ray.inverse[axis];
        Sight { origin: turn(axis, down, ray.origin), shear: -turned.xy() * inverse, inverse, axis, down }
    }

    /// A vertex onto the plane.
    pub fn see(&self, vertex: &SurfaceVertex, id: u32) -> Seen {
        let offset = turn(self.axis, self.down, Vec3::from(vertex.position)) - self.origin;
        let at = mul_add(self.shear.extend(0.0), offset.z, offset);
        let tiny = at.abs().cmplt(Vec3::splat(TINY));
        Seen { at: Vec3::select(tiny, Vec3::ZERO, at).xy().extend(offset.z), id }
    }

    /// t where the ray goes through a face that it hits.
    pub fn t_at(&self, a: &Seen, b: &Seen, c: &Seen) -> f32 {
        let weights = face_weights(a, b, c);
        weights.dot(Vec3::new(a.at.z, b.at.z, c.at.z)) * self.inverse
    }
}

/// Coordinates in an order in which z is along the ray's axis, and x, y such that what goes round to the left when seen along the ray goes
/// round so on the plane.
fn turn(axis: usize, down: bool, v: Vec3) -> Vec3 {
    let turned = match axis {
        0 => v.yzx(),
        1 => v.zxy(),
        _ => v,
    };
    if down { turned.yxz() } else { turned }
}

/// Whether the edge from `p` to `q` passes the ray on its left: the exact sign of `p x q`.
///
/// On 0 the ray is taken to pass at `(e, e^2)` for an infinitely small e > 0; coincident points follow their indices, so that no three of
/// them go round the ray.
pub(super) fn is_left(p: &Seen, q: &Seen) -> bool {
    let (left, right) = (p.at.x * q.at.y, p.at.y * q.at.x);
    if left != right {
        return left > right; // rounding is monotone, so the exact products differ in the same sense
    }
    is_left_on_tie(p, q, left)
}

fn is_left_on_tie(p: &Seen, q: &Seen, product: f32) -> bool {
    let (left, right) = (rounded_off(p.at.x, q.at.y, product), rounded_off(p.at.y, q.at.x, product));
    if left != right {
        return left > right;
    }
    if q.at.y != p.at.y {
        return q.at.y < p.at.y;
    }
    if q.at.x != p.at.x {
        return q.at.x > p.at.x;
    }
    p.id < q.id
}

/// `a b - product` exactly, `product` being `a b` rounded (Dekker 1971).
fn rounded_off(a: f32, b: f32, product: f32) -> f32 {
    let high = high_bits(Vec3::new(a, b, 0.0));
    let low = Vec3::new(a, b, 0.0) - high;
    low.x * low.y - (((product - high.x * high.y) - low.x * high.y) - high.x * low.y)
}

/// Weights of a hit face's corners where the ray goes through it. A function of the face alone, so that its two tets meet at one place.
fn face_weights(a: &Seen, b: &Seen, c: &Seen) -> Vec3 {
    let areas = Vec3::new(
        (b.at.x * c.at.y - b.at.y * c.at.x).abs(),
        (c.at.x * a.at.y - c.at.y * a.at.x).abs(),
        (a.at.x * b.at.y - a.at.y * b.at.x).abs(),
    );
    let sum = areas.x + areas.y + areas.z;
    if sum > 0.0 { areas / sum } else { Vec3::splat(1.0 / 3.0) }
}

impl<'a> SurfaceRay<'a> {
    /// Begins with the line of `ray`; nothing is gathered yet.
    pub fn start(surface: &'a BoundarySurface, ray: &'a Ray) -> Self {
        let (hits, after) = ([Hit::FIRST; MAX_HITS], Hit::FIRST);
        SurfaceRay {
            surface,
            ray,
            sight: Sight::new(ray),
            hits,
            count: 0,
            next: 0,
            more: true,
            after,
            first: after,
            last: after,
            inside: 0,
        }
    }

    /// The next interval of t >= 0 inside the mesh as (t0, t1), t0 < t1; ([`FAR`], -[`FAR`]) if there are no more. Parts of the mesh that
    /// overlap or touch are one interval. The last may reach beyond the cube.
    pub fn next_interval(&mut self) -> (f32, f32) {
        let (mut start, mut end) = (FAR, -FAR);
        while let Some(hit) = self.peek() {
            // The mesh is left; what is entered at the same place goes on.
            if self.inside == 0 && end > start.max(0.0) && (hit.is_exit() || hit.t > end) {
                break;
            }
            self.next += 1;
            let before = self.inside;
            self.inside += if hit.is_exit() { -1 } else { 1 };
            if before == 0 && self.inside == 1 && hit.t > end {
                start = hit.t;
                self.first = hit;
            }
            if before == 1 && self.inside == 0 {
                end = hit.t;
                self.last = hit;
            }
        }
        let start = start.max(0.0);
        if end > start { (start, end) } else { (FAR, -FAR) }
    }

    /// Where the ray entered by the last interval.
    pub fn first(&self) -> Hit {
        self.first
    }

    /// Where it left.
    pub fn last(&self) -> Hit {
        self.last
    }

    /// Takes the next hit, behind t = 0 too.
    #[cfg(test)]
    pub fn take_next(&mut self) -> Option<Hit> {
        let hit = self.peek()?;
        self.next += 1;
        Some(hit)
    }

    /// The hit that comes next, gathered if need be.
    pub fn peek(&mut self) -> Option<Hit> {
        if self.next == self.count && self.more {
            self.gather();
        }
        (self.next < self.count).then(|| self.hits[self.next])
    }

    /// Finds the nearest hits after those gathered before, as many as there is room for.
    fn gather(&mut self) {
        if self.count > 0 {
            self.after = self.hits[self.count - 1];
        }
        (self.count, self.next, self.more) = (0, 0, false);
        if self.surface.faces().is_empty() {
            return;
        }
        // A group of nodes: the first of its family, then which are children to visit and which are nodes at all, 8 bits each.
        let mut stack = [UVec2::ZERO; MAX_LEVELS as usize];
        let mut level = 0;
        let mut group = UVec2::new(0, 1);
        loop {
            if group.y & 255 == 0 {
                if level == 0 {
                    return;
                }
                level -= 1;
                group = stack[level];
            }
            let child = group.y.trailing_zeros();
            let before = (group.y >> 8) & ((1 << child) - 1);
            let node = &self.surface.nodes()[(group.x + before.count_ones()) as usize];
            group.y &= !(1 << child);
            if group.y & 255 != 0 {
                stack[level] = group;
                level += 1;
            }
            let (inner, mut faces) = self.visit_node(node);
            while faces != 0 {
                let face = node.first_face + faces.trailing_zeros();
                faces &= faces - 1;
                self.test_face(face);
            }
            group = UVec2::new(node.first_node, inner | (node.scale_and_inner >> 24) << 8);
        }
    }

    /// Which children of a node that are nodes, and which faces of those that are leaves, have boxes that the line meets where hits count.
    fn visit_node(&mut self, node: &SurfaceNode) -> (u32, u32) {
        let exponents = node.scale_and_inner;
        let scale = Vec3::from([0, 8, 16].map(|shift| f32::from_bits(((exponents >> shift) & 255) << 23))) * self.ray.inverse;
        let low = (Vec3::from(node.low.map(f32::from_bits)) - self.ray.origin) * self.ray.inverse;
        let limit = if self.count == MAX_HITS { self.hits[MAX_HITS - 1].t } else { FAR };
        let (mut inner, mut faces) = (0, 0);
        for child in 0..8 {
            let (word, shift) = (child / 4, 8 * (child % 4));
            let byte = |bounds: [u32; 2]| ((bounds[word] >> shift) & 255) as f32;
            let kind = (node.children[word] >> shift) & 255;
            let [x, y, z] = [0, 2, 4].map(|axis| [byte(node.bounds[axis]), byte(node.bounds[axis + 1])]);
            let a = Vec3::new(x[0], y[0], z[0]) * scale + low;
            let b = Vec3::new(x[1], y[1], z[1]) * scale + low;
            let near = a.min(b).max_element();
            let far = a.max(b).min_element();
            if kind == 0 || near > far || far < self.after.t {
                continue;
            }
            if near > limit {
                self.more = true;
                continue;
            }
            if (exponents >> (24 + child)) & 1 == 1 {
                inner |= 1 << child;
            } else {
                faces |= (kind >> 5) << (kind & 31);
            }
        }
        (inner, faces)
    }

    /// Takes the hit of a face, if there is one.
    fn test_face(&mut self, face: u32) {
        let vertices = self.surface.faces()[face as usize].vertices;
        let [a, b, c] = vertices.map(|id| self.sight.see(&self.surface.vertices()[id as usize], id));
        // The order is the outward normal's: where the ray leaves the mesh, every edge of it passes on the left.
        let leaves = is_left(&a, &b);
        if is_left(&b, &c) == leaves && is_left(&c, &a) == leaves {
            self.take_hit(Hit { t: self.sight.t_at(&a, &b, &c), word: 2 * face + u32::from(leaves) });
        }
    }

    /// Sorts a hit in; the farthest gives way if there is no room.
    fn take_hit(&mut self, hit: Hit) {
        if !hit.is_after(self.after) {
            return;
        }
        let mut place = self.count;
        if place == MAX_HITS {
            self.more = true;
            place -= 1;
            if hit.is_after(self.hits[place]) {
                return;
            }
        } else {
            self.count += 1;
        }
        while place > 0 && self.hits[place - 1].is_after(hit) {
            self.hits[place] = self.hits[place - 1];
            place -= 1;
        }
        self.hits[place] = hit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(x: f32, y: f32, id: u32) -> Seen {
        Seen { at: Vec3::new(x, y, 0.0), id }
    }

    #[test]
    fn sides_are_exact_where_rounded_products_are_equal() {
        let e = f32::EPSILON;
        // (1 + e)(1 - e) = 1 - e^2 rounds to 1.
        let (p, q) = (seen(1.0 + e, 1.0, 0), seen(1.0, 1.0 - e, 1));
        assert!(!is_left(&p, &q) && is_left(&q, &p));
        let (p, q) = (seen(TINY, 0.3, 0), seen(0.7 * TINY, 0.7 * 0.3, 1));
        let exact = f64::from(p.at.x) * f64::from(q.at.y) - f64::from(p.at.y) * f64::from(q.at.x);
        assert!(exact != 0.0 && is_left(&p, &q) == (exact > 0.0) && is_left(&q, &p) == (exact < 0.0));
    }

    #[test]
    fn ties_are_broken_as_if_the_ray_had_moved() {
        let grid: Vec<Seen> = (-2..=2i8).flat_map(|x| (-2..=2i8).map(move |y| seen(x.into(), y.into(), 0))).collect();
        for p in &grid {
            for q in grid.iter().filter(|q| q.at != p.at) {
                let (x, y) = (1e-4, 1e-8);
                let [px, py, qx, qy] = [p.at.x, p.at.y, q.at.x, q.at.y].map(f64::from);
                assert_eq!(is_left(p, q), (px - x) * (qy - y) - (py - y) * (qx - x) > 0.0, "{} {}", p.at, q.at);
            }
        }
    }

    #[test]
    fn coincident_points_do_not_go_round_the_ray() {
        let [a, b, c] = [4, 7, 2].map(|id| seen(0.0, 0.0, id));
        for [p, q, r] in [[&a, &b, &c], [&a, &c, &b]] {
            let sides = [is_left(p, q), is_left(q, r), is_left(r, p)];
            assert!(sides != [true; 3] && sides != [false; 3]);
        }
    }
}
