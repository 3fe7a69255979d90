//! Exact tet-box overlap by separating axes, for the eight children of a cubic cell at once.
//!
//! Two convex bodies are apart if and only if one of these axes separates them: the box's three, the tet's four face normals, and the 18
//! products of a box axis with a tet edge (Gottschalk, Lin & Manocha 1996). A product axis lies in a coordinate plane, where it can only
//! separate if its edge is part of the outline of the tet's projection; each such edge gives one half-plane. So a tet is a list of at
//! most 22, typically 15 *half-spaces* `n . x <= d`, and a box is apart from it if it lies outside any one of them, or outside the bounds.

use super::FACES;
use glam::{DVec3, Vec3};

/// The overlap tests of many tets, in coordinates local to some cell, stored as f32.
///
/// Set up in f64 and rounded once: a decision can be wrong by 1e-6 of the coordinates' magnitude.
#[derive(Debug, Default)]
pub struct TetPlanes {
    /// Each tet's half-spaces, faces 0 to 3 with unit normals first; the last batch filled up with zeros.
    batches: Vec<Planes>,
    /// Where each tet's batches begin.
    starts: Vec<u32>,
    /// Lowest and highest corner of each tet's bounds.
    bounds: Vec<[Vec3; 2]>,
}

/// Eight half-spaces `x px + y py + z pz <= d`, side by side as vector instructions want them. Zeros hold everything.
#[derive(Debug, Clone, Copy, Default)]
struct Planes {
    x: [f32; 8],
    y: [f32; 8],
    z: [f32; 8],
    d: [f32; 8],
}

/// The edges as `[i, j, left, right]`: going from corner i to j, the faces to either side, so that i -> j is in [`FACES`]`[left]`'s order.
const EDGES: [[usize; 4]; 6] = [[1, 2, 0, 3], [2, 3, 0, 1], [3, 1, 0, 2], [0, 3, 1, 2], [0, 1, 2, 3], [0, 2, 3, 1]];

/// Children on the low side of each axis; the high side is the complement.
const LOW: [u8; 3] = [0b0101_0101, 0b0011_0011, 0b0000_1111];

impl TetPlanes {
    /// Forgets all tets and keeps the memory.
    pub fn clear(&mut self) {
        self.batches.clear();
        self.bounds.clear();
        self.starts.clear();
    }

    /// Adds a positive tet.
    pub fn push(&mut self, p: &[DVec3; 4]) {
        let mut planes = [Planes::default(); 3];
        let mut set = |at: usize, n: DVec3, on: DVec3| {
            let batch = &mut planes[at / 8];
            (batch.x[at % 8], batch.y[at % 8], batch.z[at % 8], batch.d[at % 8]) = (n.x as f32, n.y as f32, n.z as f32, n.dot(on) as f32);
        };
        let mut normals = [DVec3::ZERO; 4];
        for (i, [a, b, c]) in FACES.into_iter().enumerate() {
            normals[i] = (p[b] - p[a]).cross(p[c] - p[a]);
            set(i, normals[i].normalize_or_zero(), p[a]);
        }
        // An edge is part of the outline along an axis if one of its faces looks up that axis and the other down.
        let mut count = 4;
        for [i, j, left, right] in EDGES {
            let edge = p[j] - p[i];
            let across = [DVec3::new(0.0, edge.z, -edge.y), DVec3::new(-edge.z, 0.0, edge.x), DVec3::new(edge.y, -edge.x, 0.0)];
            for axis in 0..3 {
                let (up, down) = (normals[left][axis], normals[right][axis]);
                let (rising, falling) = (up >= 0.0 && down <= 0.0, up <= 0.0 && down >= 0.0);
                // Without a branch: what is no outline is overwritten by the next.
                set(count.min(23), if rising { across[axis] } else { -across[axis] }, p[i]);
                count += usize::from(rising || falling);
            }
        }
        if count < 24 {
            set(count, DVec3::ZERO, DVec3::ZERO);
        }
        self.starts.push(self.batches.len() as u32);
        self.batches.extend_from_slice(&planes[..count.div_ceil(8)]);
        let (low, high) = (p[0].min(p[1]).min(p[2]).min(p[3]), p[0].max(p[1]).max(p[2]).max(p[3]));
        self.bounds.push([low.as_vec3(), high.as_vec3()]);
    }

    /// The batches of a tet.
    #[inline(always)]
    fn batches(&self, tet: usize) -> &[Planes] {
        let end = self.starts.get(tet + 1).map_or(self.batches.len(), |&end| end as usize);
        &self.batches[self.starts[tet] as usize..end]
    }

    /// Signed distance of a point to the tet's farthest face plane: at most 0 inside.
    pub fn distance_outside(&self, tet: usize, p: Vec3) -> f32 {
        let faces = &self.batches[self.starts[tet] as usize];
        let distance = |i: usize| faces.x[i] * p.x + faces.y[i] * p.y + faces.z[i] * p.z - faces.d[i];
        distance(0).max(distance(1)).max(distance(2)).max(distance(3))
    }

    /// For each of N points (`[x, y, z]`, N numbers each) the tet of `tets` that holds it deepest, or comes nearest to holding it: that
    /// whose farthest face plane is the least outside, and how far that is (at most 0 inside, and never more than the distance to the tet
    /// outside). The first of equals; `u32::MAX` and infinity where there are no tets.
    pub fn deepest<const N: usize>(&self, tets: &[u32], points: &[[f32; N]; 3]) -> ([u32; N], [f32; N]) {
        pulp::Arch::new().dispatch(Deepest { planes: self, tets, points })
    }

    /// A point moved straight through the face plane of a tet that it is farthest outside of, to `depth` within.
    pub fn moved_inside(&self, tet: usize, p: Vec3, depth: f32) -> Vec3 {
        let faces = &self.batches[self.starts[tet] as usize];
        let normal = |i: usize| Vec3::new(faces.x[i], faces.y[i], faces.z[i]);
        let (distance, normal) = (0..4)
            .map(|i| (normal(i).dot(p) - faces.d[i], normal(i)))
            .fold((f32::NEG_INFINITY, Vec3::ZERO), |a, b| if b.0 > a.0 { b } else { a });
        p - normal * (distance + depth)
    }

    /// Faces 0 to 3 of a tet that have a point on their outer side, as bits.
    pub fn faces_outside(&self, tet: usize, p: Vec3) -> u8 {
        let faces = &self.batches[self.starts[tet] as usize];
        (0..4).fold(0, |all, i| {
            let distance = faces.x[i] * p.x + faces.y[i] * p.y + faces.z[i] * p.z - faces.d[i];
            all | u8::from(distance > 0.0) << i
        })
    }

    /// For each of `tets`, the children of a cell that it overlaps, bit `i = x + 2 y + 4 z`, appended to `masks`. The cell has this
    /// center and its children's half edge is `quarter`; each tet must overlap the cell itself.
    pub fn child_masks(&self, tets: &[u32], center: Vec3, quarter: f32, masks: &mut Vec<u8>) {
        let start = masks.len();
        masks.resize(start + tets.len(), 0);
        pulp::Arch::new().dispatch(ChildMasks { planes: self, tets, center, quarter, masks: &mut masks[start..] });
    }

    #[inline(always)]
    fn child_mask(&self, tet: usize, center: Vec3, quarter: f32) -> u8 {
        let [low, high] = self.bounds[tet];
        let candidates = octants(low, high, center);
        if candidates.count_ones() <= 1 {
            return candidates;
        }
        // Every half-space against the corner of each child that lies deepest inside it; eight half-spaces a vector.
        let mut apart = 0;
        for planes in self.batches(tet) {
            let (mut base, mut x, mut y, mut z) = ([0f32; 8], [0f32; 8], [0f32; 8], [0f32; 8]);
            for k in 0..8 {
                (x[k], y[k], z[k]) = (planes.x[k] * quarter, planes.y[k] * quarter, planes.z[k] * quarter);
                base[k] = planes.x[k] * center.x + planes.y[k] * center.y + planes.z[k] * center.z - planes.d[k];
                base[k] -= x[k].abs() + y[k].abs() + z[k].abs();
            }
            let (low, high) = (sub(&base, &z), add(&base, &z));
            let rows = [sub(&low, &y), add(&low, &y), sub(&high, &y), add(&high, &y)];
            for (i, row) in rows.iter().enumerate() {
                apart |= u8::from(any_positive(&sub(row, &x))) << (2 * i);
                apart |= u8::from(any_positive(&add(row, &x))) << (2 * i + 1);
            }
        }
        candidates & !apart
    }
}

#[inline(always)]
fn add(a: &[f32; 8], b: &[f32; 8]) -> [f32; 8] {
    let mut sum = [0.0; 8];
    for k in 0..8 {
        sum[k] = a[k] + b[k];
    }
    sum
}

#[inline(always)]
fn sub(a: &[f32; 8], b: &[f32; 8]) -> [f32; 8] {
    let mut difference = [0.0; 8];
    for k in 0..8 {
        difference[k] = a[k] - b[k];
    }
    difference
}

#[inline(always)]
fn any_positive(v: &[f32; 8]) -> bool {
    let mut any = false;
    for k in 0..8 {
        any |= v[k] > 0.0;
    }
    any
}

/// [`TetPlanes::child_masks`] as a kernel that is compiled for the widest vectors that the processor may have.
struct ChildMasks<'a> {
    planes: &'a TetPlanes,
    tets: &'a [u32],
    center: Vec3,
    quarter: f32,
    masks: &'a mut [u8],
}

impl pulp::WithSimd for ChildMasks<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for (mask, &tet) in self.masks.iter_mut().zip(self.tets) {
            *mask = self.planes.child_mask(tet as usize, self.center, self.quarter);
        }
    }
}

/// [`TetPlanes::deepest`] as a kernel that is compiled for the widest vectors that the processor may have.
struct Deepest<'a, const N: usize> {
    planes: &'a TetPlanes,
    tets: &'a [u32],
    points: &'a [[f32; N]; 3],
}

impl<const N: usize> pulp::WithSimd for Deepest<'_, N> {
    type Output = ([u32; N], [f32; N]);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        let [x, y, z] = self.points;
        let (mut tets, mut distances) = ([u32::MAX; N], [f32::INFINITY; N]);
        for &tet in self.tets {
            let faces = &self.planes.batches[self.planes.starts[tet as usize] as usize];
            let mut outside = [f32::NEG_INFINITY; N];
            for i in 0..4 {
                for k in 0..N {
                    let distance = faces.x[i] * x[k] + faces.y[i] * y[k] + faces.z[i] * z[k] - faces.d[i];
                    outside[k] = if distance > outside[k] { distance } else { outside[k] };
                }
            }
            for k in 0..N {
                let nearer = outside[k] < distances[k];
                distances[k] = if nearer { outside[k] } else { distances[k] };
                tets[k] = if nearer { tet } else { tets[k] };
            }
        }
        (tets, distances)
    }
}

/// The box's own axes: the octants about a center, bit `i = x + 2 y + 4 z`, that bounds reach into. Exact if it is only one and the tet
/// overlaps the cell that the octants divide.
#[inline(always)]
pub fn octants(low: Vec3, high: Vec3, center: Vec3) -> u8 {
    let mut reached = 0xff;
    for axis in 0..3 {
        let reaches_low = if low[axis] < center[axis] { LOW[axis] } else { 0 };
        let reaches_high = if high[axis] >= center[axis] { !LOW[axis] } else { 0 };
        reached &= reaches_low | reaches_high;
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small xorshift in [-1, 1).
    struct Random(u64);
    impl Random {
        fn next(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
        fn point(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    /// Clips the tet's faces against the box, the other way to decide: overlap if a face meets the box or one holds the other.
    fn overlaps_by_clipping(p: &[DVec3; 4], center: DVec3, half: f64) -> bool {
        let clipped_face = |[a, b, c]: [usize; 3]| {
            let mut polygon = vec![p[a], p[b], p[c]];
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let inside = |q: &DVec3| half - sign * (q[axis] - center[axis]);
                    let mut kept = Vec::new();
                    for k in 0..polygon.len() {
                        let (q, r) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                        let (dq, dr) = (inside(&q), inside(&r));
                        if dq >= 0.0 {
                            kept.push(q);
                        }
                        if (dq > 0.0) != (dr > 0.0) && dq != dr {
                            kept.push(q + (r - q) * (dq / (dq - dr)));
                        }
                    }
                    polygon = kept;
                }
            }
            !polygon.is_empty()
        };
        FACES.into_iter().any(clipped_face) || super::super::barycentric(center, p).iter().all(|&w| w >= 0.0)
    }

    #[test]
    fn masks_agree_with_clipping_on_random_tets() {
        let mut random = Random(0x9E37_79B9_7F4A_7C15);
        let (mut checked, mut several) = (0, 0);
        for round in 0..4000 {
            let scale = [0.3, 1.0, 4.0, 0.02][round % 4];
            let at = random.point();
            let mut p = [(); 4].map(|()| at + random.point() * scale);
            if round % 3 == 0 {
                p[3] = p[0] + (p[1] - p[0]) * 0.4 + (p[2] - p[0]) * 0.3 + random.point() * 1e-3; // a sliver
            }
            if round % 5 == 0 {
                p = p.map(|q| (q * 3.0).round() * 0.26); // faces and edges along the axes, off the cells' own planes
            }
            if super::super::is_degenerate(&p) {
                continue;
            }
            if super::super::signed_volume(&p) < 0.0 {
                p.swap(2, 3);
            }
            if !overlaps_by_clipping(&p, DVec3::ZERO, 1.0) {
                continue;
            }
            let mut planes = TetPlanes::default();
            planes.push(&p);
            let mut masks = Vec::new();
            planes.child_masks(&[0], Vec3::ZERO, 0.5, &mut masks);
            for i in 0..8 {
                let center = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) - 0.5;
                let (surely, perhaps) = (overlaps_by_clipping(&p, center, 0.5 - 1e-5), overlaps_by_clipping(&p, center, 0.5 + 1e-5));
                if surely == perhaps {
                    assert_eq!(masks[0] >> i & 1 == 1, surely, "child {i} of {p:?}");
                    checked += 1;
                }
            }
            several += u32::from(masks[0].count_ones() > 1);
        }
        assert!(checked > 10_000 && several > 500, "{checked} decisions, {several} tets across children");
    }

    #[test]
    fn deepest_finds_the_holder_or_the_nearest() {
        let mut planes = TetPlanes::default();
        planes.push(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
        planes.push(&[DVec3::ZERO, DVec3::Y, DVec3::X, -DVec3::Z]);
        let points = [[0.1, 0.1, -2.0, 0.2], [0.1, 0.1, 0.1, 0.2], [0.1, -0.2, 0.2, 3.0]];
        let (tets, distances) = planes.deepest(&[0, 1], &points);
        assert_eq!(tets, [0, 1, 0, 0]);
        assert!(distances[0] < 0.0 && distances[1] < 0.0 && (distances[2] - 2.0).abs() < 1e-6 && distances[3] > 1.0, "{distances:?}");
        assert_eq!(planes.deepest::<1>(&[], &[[0.0]; 3]), ([u32::MAX], [f32::INFINITY]));
        assert!(planes.moved_inside(0, Vec3::new(0.2, 0.3, -1.0), 0.1).distance(Vec3::new(0.2, 0.3, 0.1)) < 1e-6);
        assert_eq!((planes.faces_outside(0, Vec3::new(-0.5, 0.2, 0.2)), planes.faces_outside(0, Vec3::splat(0.1))), (2, 0));
    }

    #[test]
    fn distance_outside_is_negative_inside() {
        let mut planes = TetPlanes::default();
        planes.push(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
        assert!(planes.distance_outside(0, Vec3::splat(0.1)) < 0.0);
        assert!((planes.distance_outside(0, Vec3::new(-0.5, 0.2, 0.2)) - 0.5).abs() < 1e-6);
    }
}
