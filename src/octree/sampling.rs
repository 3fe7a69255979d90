//! What a leaf holds: its value by inverse distance (method 1.2), its range, and the variance that decides whether it is one.

use super::{Boundary, OctreeParams, Sampling};
use crate::geometry::{self, TetPlanes};
use crate::mesh::{Association, ScalarField, TetMesh};
use glam::{DVec3, Vec3};

/// A point within this distance of a tet counts as inside it; in half edges of the task's cell.
const INSIDE_TOLERANCE: f32 = 1e-6;

/// A sampled leaf: normalised value, and bounds of the field inside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leaf {
    pub value: f32,
    pub range: [f32; 2],
}

/// The mesh and the normalised field, as the regularizer reads them.
pub(super) struct Source<'a> {
    mesh: &'a TetMesh,
    field: &'a ScalarField,
    point_values: Vec<f32>,
}

impl<'a> Source<'a> {
    pub fn new(mesh: &'a TetMesh, field: &'a ScalarField) -> Self {
        let point_values = field.at_points(mesh).into_iter().map(|v| v as f32).collect();
        Source { mesh, field, point_values }
    }

    pub fn point_count(&self) -> usize {
        self.mesh.points().len()
    }

    #[inline]
    pub fn corners(&self, tet: u32) -> [DVec3; 4] {
        self.mesh.corners(tet as usize)
    }

    /// The corners where a cell of this center and half edge is [-1, 1]^3.
    #[inline]
    pub fn local_corners(&self, tet: u32, center: DVec3, half: f64) -> [DVec3; 4] {
        let ([a, b, c, d], scale) = (self.corners(tet), 1.0 / half);
        [(a - center) * scale, (b - center) * scale, (c - center) * scale, (d - center) * scale]
    }

    /// The linear field's values at a tet's corners.
    #[inline]
    fn values(&self, tet: u32) -> [f64; 4] {
        match self.field.association {
            Association::Points => {
                let [a, b, c, d] = self.mesh.tets()[tet as usize];
                let value = |i: u32| f64::from(self.point_values[i as usize]);
                [value(a), value(b), value(c), value(d)]
            }
            Association::Cells => self.field.at_corners(self.mesh, tet as usize),
        }
    }
}

/// One thread's working memory.
pub(super) struct Scratch {
    pub local: LocalTets,
    pub visited: Visited,
    masks: Vec<Vec<u8>>,
    lists: Vec<Vec<u32>>,
}

impl Scratch {
    pub fn new(points: usize) -> Self {
        Scratch { local: LocalTets::default(), visited: Visited { stamps: vec![0; points], stamp: 0 }, masks: vec![], lists: vec![] }
    }

    pub fn take_masks(&mut self) -> Vec<u8> {
        let mut masks = self.masks.pop().unwrap_or_default();
        masks.clear();
        masks
    }

    pub fn take_list(&mut self) -> Vec<u32> {
        self.lists.pop().unwrap_or_default()
    }

    pub fn give_back(&mut self, masks: Vec<u8>, list: Vec<u32>) {
        self.masks.push(masks);
        self.lists.push(list);
    }
}

/// Which vertices were seen already: a stamp a vertex, so that clearing costs nothing.
pub(super) struct Visited {
    stamps: Vec<u32>,
    stamp: u32,
}

impl Visited {
    /// Calls `see` once for each distinct vertex of the tets, in order of first appearance.
    fn each_vertex(&mut self, source: &Source, tets: impl Iterator<Item = u32>, mut see: impl FnMut(u32)) {
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.stamps.fill(0);
            self.stamp = 1;
        }
        for tet in tets {
            for vertex in source.mesh.tets()[tet as usize] {
                if self.stamps[vertex as usize] != self.stamp {
                    self.stamps[vertex as usize] = self.stamp;
                    see(vertex);
                }
            }
        }
    }

    /// Population variance of the normalised scalars of the tets' distinct vertices.
    pub fn variance(&mut self, source: &Source, tets: impl Iterator<Item = u32>) -> f64 {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        self.each_vertex(source, tets, |vertex| {
            let value = f64::from(source.point_values[vertex as usize]) - 0.5;
            (count, sum, squares) = (count + 1.0, sum + value, squares + value * value);
        });
        (squares / count - (sum / count).powi(2)).max(0.0)
    }
}

/// The tets of one task, in coordinates where the task's cell is [-1, 1]^3.
#[derive(Default)]
pub(super) struct LocalTets {
    /// Mesh numbers of the tets.
    pub ids: Vec<u32>,
    pub planes: TetPlanes,
    /// `[gx, gy, gz, c]`: the value at local x is `g . x + c`.
    linear: Vec<[f64; 4]>,
    /// Smallest and largest corner value.
    ranges: Vec<[f64; 2]>,
    center: DVec3,
    half: f64,
}

impl LocalTets {
    /// Takes up the tets of a new task.
    pub fn prepare(&mut self, source: &Source, tets: &[u32], center: DVec3, half: f64) {
        (self.center, self.half) = (center, half);
        self.ids.clear();
        self.ids.extend_from_slice(tets);
        self.planes.clear();
        self.linear.clear();
        self.ranges.clear();
        for &tet in tets {
            let p = source.local_corners(tet, center, half);
            let s = source.values(tet);
            self.planes.push(&p);
            let g = geometry::gradient(&p, &s);
            self.linear.push([g.x, g.y, g.z, s[0] - g.dot(p[0])]);
            self.ranges.push([s[0].min(s[1]).min(s[2]).min(s[3]), s[0].max(s[1]).max(s[2]).max(s[3])]);
        }
    }

    /// The leaf at a local place whose tets (local numbers) these are, or nothing if the boundary rule leaves it out.
    pub fn sample(
        &self,
        source: &Source,
        params: &OctreeParams,
        tets: &[u32],
        center: Vec3,
        half: f32,
        visited: &mut Visited,
    ) -> Option<Leaf> {
        let holder = self.holder(tets, center);
        if params.boundary == Boundary::Centres && holder.is_none() {
            return None;
        }
        let value = match (params.sampling, holder) {
            (Sampling::Vertices, _) => self.inverse_distance_to_vertices(source, tets, center, half, visited),
            (Sampling::Tets | Sampling::Average, Some(tet)) => self.value_in(tet, center.as_dvec3()),
            (Sampling::Tets | Sampling::Average, None) => self.inverse_distance_to_tets(source, tets, center),
        };
        let value = value.clamp(0.0, 1.0) as f32;
        let [lo, hi] = self.range(tets, center.as_dvec3(), f64::from(half));
        Some(Leaf { value, range: [lo.min(value), hi.max(value)] })
    }

    /// The tet that holds a point: of those whose faces all have it inside (or within the tolerance) the one that holds it deepest.
    fn holder(&self, tets: &[u32], x: Vec3) -> Option<u32> {
        let mut best = (INSIDE_TOLERANCE, None);
        for &tet in tets {
            let distance = self.planes.distance_outside(tet as usize, x);
            if distance <= best.0 {
                if distance < -INSIDE_TOLERANCE {
                    return Some(tet);
                }
                best = (distance, Some(tet));
            }
        }
        best.1
    }

    /// The linear field of a tet at a local point, kept within the tet's own values.
    fn value_in(&self, tet: u32, x: DVec3) -> f64 {
        let [gx, gy, gz, c] = self.linear[tet as usize];
        let [lo, hi] = self.ranges[tet as usize];
        (gx * x.x + gy * x.y + gz * x.z + c).clamp(lo, hi)
    }

    /// Equation (1): the mean of the vertices' values weighted by 1 / distance; the value of a vertex that is hit.
    fn inverse_distance_to_vertices(&self, source: &Source, tets: &[u32], center: Vec3, half: f32, visited: &mut Visited) -> f64 {
        let x = self.center + center.as_dvec3() * self.half;
        let hit = 1e-6 * 2.0 * f64::from(half) * self.half;
        let (mut weights, mut sum, mut exact) = (0.0, 0.0, None);
        visited.each_vertex(source, tets.iter().map(|&t| self.ids[t as usize]), |vertex| {
            let distance = x.distance(source.mesh.points()[vertex as usize]);
            let value = f64::from(source.point_values[vertex as usize]);
            if distance < hit {
                exact = exact.or(Some(value));
            }
            (weights, sum) = (weights + 1.0 / distance, sum + value / distance);
        });
        exact.unwrap_or(sum / weights)
    }

    /// Equation (1') outside every tet: the mean of the values at each tet's nearest point, weighted by 1 / distance.
    fn inverse_distance_to_tets(&self, source: &Source, tets: &[u32], center: Vec3) -> f64 {
        let x = self.center + center.as_dvec3() * self.half;
        let (mut weights, mut sum) = (0.0, 0.0);
        for &tet in tets {
            let tet = self.ids[tet as usize];
            let (w, distance) = geometry::closest_point(x, &source.corners(tet));
            let value: f64 = w.iter().zip(source.values(tet)).map(|(w, s)| w * s).sum();
            if distance == 0.0 {
                return value;
            }
            (weights, sum) = (weights + 1.0 / distance, sum + value / distance);
        }
        sum / weights
    }

    /// Bounds of the field in a box: per tet, the linear field's over the box cut to the tet's own values.
    fn range(&self, tets: &[u32], center: DVec3, half: f64) -> [f32; 2] {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for &tet in tets {
            let [gx, gy, gz, c] = self.linear[tet as usize];
            let middle = gx * center.x + gy * center.y + gz * center.z + c;
            let spread = (gx.abs() + gy.abs() + gz.abs()) * half;
            let [tet_lo, tet_hi] = self.ranges[tet as usize];
            lo = lo.min((middle - spread).clamp(tet_lo, tet_hi));
            hi = hi.max((middle + spread).clamp(tet_lo, tet_hi));
        }
        [lo as f32, hi as f32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshParts;

    /// The single tet of maths 2.4 with a point that lifts the bounds' values to [0, 1], so that normalising changes nothing.
    fn tet() -> (TetMesh, ScalarField) {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::ONE];
        let mesh = TetMesh::new(MeshParts { points, tets: vec![[0, 1, 2, 3]], ..Default::default() }).expect("valid");
        let field = ScalarField::new("s".into(), Association::Points, vec![0.1, 0.9, 0.3, 0.7, 0.0, 1.0]);
        (mesh, field)
    }

    fn sample(at: DVec3, sampling: Sampling, boundary: Boundary) -> Option<Leaf> {
        let (mesh, field) = tet();
        let source = Source::new(&mesh, &field);
        let mut scratch = Scratch::new(mesh.points().len());
        scratch.local.prepare(&source, &[0], at - mesh.center(), 0.01);
        let params = OctreeParams { sampling, boundary, ..OctreeParams::default() };
        scratch.local.sample(&source, &params, &[0], Vec3::ZERO, 1.0, &mut scratch.visited)
    }

    #[test]
    fn both_samplings_give_the_test_vectors() {
        let inside = DVec3::new(0.2, 0.25, 0.2);
        for (sampling, expected) in [(Sampling::Vertices, 0.401437545658344), (Sampling::Tets, 0.43)] {
            let leaf = sample(inside, sampling, Boundary::Centres).expect("inside");
            assert!((f64::from(leaf.value) - expected).abs() < 1e-6, "{sampling:?}: {}", leaf.value);
        }
        let vertex = sample(DVec3::X, Sampling::Vertices, Boundary::Cells).expect("full");
        assert!((vertex.value - 0.9).abs() < 1e-6, "at a vertex its value is the answer");
    }

    #[test]
    fn outside_the_mesh_the_rule_decides() {
        let outside = DVec3::new(0.2, 0.3, -0.005);
        assert_eq!(sample(outside, Sampling::Tets, Boundary::Centres), None);
        let leaf = sample(outside, Sampling::Tets, Boundary::Cells).expect("full");
        assert!((leaf.value - (0.1 + 0.8 * 0.2 + 0.2 * 0.3)).abs() < 1e-6, "the value at the nearest point: {}", leaf.value);
    }

    #[test]
    fn the_range_is_that_of_the_linear_field_in_the_box() {
        let leaf = sample(DVec3::new(0.2, 0.25, 0.2), Sampling::Tets, Boundary::Centres).expect("inside");
        let spread = 0.01 * (0.8 + 0.2 + 0.6);
        assert!((leaf.range[0] - (0.43 - spread)).abs() < 1e-6 && (leaf.range[1] - (0.43 + spread)).abs() < 1e-6, "{:?}", leaf.range);
    }
}
