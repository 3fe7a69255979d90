//! What a leaf holds: samples by inverse distance (method 1.2) or as means, its range; and what decides whether it is one, the variance of
//! its vertices' values or the error of the reconstruction.

use super::brick::{LATTICE, lattice_index, lattice_point, trilinear};
use super::lattice::Sample;
use super::{Boundary, OctreeParams, Reconstruction, Sampling};
use crate::geometry::{self, TetPlanes};
use crate::mesh::{Association, ScalarField, TetMesh};
use glam::{DVec3, Vec3};

/// A point within this distance of a tet counts as inside it; in half edges of the task's cell.
const INSIDE_TOLERANCE: f32 = 1e-6;

/// A leaf with at least this many tets is sampled by means if those are asked for.
const MANY_TETS: usize = 8;

/// More tets than this in a cell are not asked whether their gradients agree: they seldom do.
const FEW_TETS: usize = 16;

/// A sampled leaf: normalised value at its centre, bounds of the field inside it, and what it knows of its corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leaf {
    pub value: f32,
    pub range: [f32; 2],
    pub corners: [Sample; 8],
}

/// Points, `[x, y, z]` of N numbers each.
type Points<const N: usize> = [[f32; N]; 3];

/// Lattice points of a cell that are none of its corners.
const BETWEEN: usize = LATTICE - 8;

/// The numbers of these, filled up with the middle to what vector instructions like.
const BETWEEN_POINTS: [usize; 24] = {
    let (mut points, mut count, mut i) = ([13; 24], 0, 0);
    while i < LATTICE {
        let [x, y, z] = lattice_point(i);
        if x == 1 || y == 1 || z == 1 {
            points[count] = i;
            count += 1;
        }
        i += 1;
    }
    points
};

/// The mesh and the normalised field, as the regularizer reads them.
pub(super) struct Source<'a> {
    mesh: &'a TetMesh,
    field: &'a ScalarField,
    point_values: Vec<f32>,
    /// The longest side of the mesh's bounds: distances are weighed in it.
    extent: f64,
}

impl<'a> Source<'a> {
    pub fn new(mesh: &'a TetMesh, field: &'a ScalarField) -> Self {
        let point_values = field.at_points(mesh).into_iter().map(|v| v as f32).collect();
        Source { mesh, field, point_values, extent: mesh.bounds().size().max_element() }
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
        self.each_vertex_while(source, tets, |vertex| {
            see(vertex);
            true
        });
    }

    /// The same until `see` says no.
    fn each_vertex_while(&mut self, source: &Source, tets: impl Iterator<Item = u32>, mut see: impl FnMut(u32) -> bool) {
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.stamps.fill(0);
            self.stamp = 1;
        }
        for tet in tets {
            for vertex in source.mesh.tets()[tet as usize] {
                if self.stamps[vertex as usize] != self.stamp {
                    self.stamps[vertex as usize] = self.stamp;
                    if !see(vertex) {
                        return;
                    }
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

impl Visited {
    /// Smallest and largest normalised scalar of the tets' vertices.
    pub fn range(&mut self, source: &Source, tets: impl Iterator<Item = u32>) -> [f32; 2] {
        let (mut lo, mut hi) = (f32::INFINITY, f32::NEG_INFINITY);
        self.each_vertex(source, tets, |vertex| {
            let value = source.point_values[vertex as usize];
            (lo, hi) = (lo.min(value), hi.max(value));
        });
        [lo, hi]
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

    /// Where a local place is, relative to the mesh's centre.
    pub fn place(&self, local: Vec3) -> DVec3 {
        self.center + local.as_dvec3() * self.half
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
        let average = params.sampling == Sampling::Average && tets.len() >= MANY_TETS;
        let (mut value, mut corners) = (None, [Sample::default(); 8]);
        if average {
            (value, corners) = self.means(tets, center, half);
        }
        let value = value.unwrap_or_else(|| match (params.sampling, holder) {
            (Sampling::Vertices, _) => self.inverse_distance_to_vertices(source, tets, center, half, visited).value().into(),
            (_, Some(tet)) => self.value_in(tet, center.as_dvec3()),
            (_, None) => {
                let ([near], _) = self.planes.deepest(tets, &[[center.x], [center.y], [center.z]]);
                self.inverse_distance_to_tets(source, tets, near, center).value().into()
            }
        });
        let value = value.clamp(0.0, 1.0) as f32;
        if params.reconstruction == Reconstruction::Continuous {
            let points = lattice_points(center, half, CORNERS);
            let (deepest, outside) = self.planes.deepest(tets, &points);
            for (k, corner) in corners.iter_mut().enumerate() {
                let at = Vec3::new(points[0][k], points[1][k], points[2][k]);
                if params.sampling == Sampling::Vertices {
                    *corner = self.inverse_distance_to_vertices(source, tets, at, half, visited);
                } else if outside[k] > INSIDE_TOLERANCE {
                    corner.merge(self.inverse_distance_to_tets(source, tets, deepest[k], at));
                } else if !average {
                    *corner = Sample::exact(self.value_in(deepest[k], at.as_dvec3()) as f32);
                }
            }
        }
        let [lo, hi] = self.range(tets, center.as_dvec3(), f64::from(half));
        Some(Leaf { value, range: [lo.min(value), hi.max(value)], corners })
    }

    /// The largest difference between the reconstruction and the field that is found in a cell: at lattice points and vertices of the mesh
    /// inside it; normalised. Stops at the first above `enough`. Where few tets with like gradients fill the cell, a bound instead.
    pub fn error(
        &self,
        source: &Source,
        reconstruction: Reconstruction,
        enough: f32,
        tets: &[u32],
        center: Vec3,
        half: f32,
        visited: &mut Visited,
    ) -> f32 {
        let points = lattice_points(center, half, CORNERS);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let at = |k: usize| DVec3::new(points[0][k].into(), points[1][k].into(), points[2][k].into());
        let mut corners: [f32; 8] = std::array::from_fn(|k| self.value_in(deepest[k], at(k)) as f32);
        let mut worst = 0f32;
        if reconstruction == Reconstruction::Continuous {
            let filled = outside.iter().all(|&d| d <= INSIDE_TOLERANCE);
            if filled && tets.len() <= FEW_TETS {
                let bound = self.gradient_spread(tets) * 3f64.sqrt() * f64::from(half);
                if bound <= f64::from(enough) {
                    return bound as f32;
                }
            }
        } else {
            let middle = self.holder(tets, center).map_or(0.5 * (corners[0] + corners[7]), |t| self.value_in(t, center.as_dvec3()) as f32);
            for (corner, outside) in corners.iter().zip(outside) {
                worst = if outside <= INSIDE_TOLERANCE { worst.max((corner - middle).abs()) } else { worst };
            }
            corners = [middle; 8];
        }
        // Vertices, where the field bends most.
        if source.field.association == Association::Points {
            let (low, size) = (center - half, 2.0 * half);
            visited.each_vertex_while(source, tets.iter().map(|&t| self.ids[t as usize]), |vertex| {
                let local = ((source.mesh.points()[vertex as usize] - self.center) / self.half).as_vec3();
                let unit = (local - low) / size;
                if unit.min_element() > 0.0 && unit.max_element() < 1.0 {
                    worst = worst.max((trilinear(&corners, unit) - source.point_values[vertex as usize]).abs());
                }
                worst <= enough
            });
        }
        if worst > enough {
            return worst;
        }
        let points = lattice_points(center, half, BETWEEN_POINTS);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        for (k, &point) in BETWEEN_POINTS[..BETWEEN].iter().enumerate() {
            if outside[k] <= INSIDE_TOLERANCE {
                let at = DVec3::new(points[0][k].into(), points[1][k].into(), points[2][k].into());
                let [x, y, z] = lattice_point(point).map(|c| c as f32 * 0.5);
                worst = worst.max((trilinear(&corners, Vec3::new(x, y, z)) - self.value_in(deepest[k], at) as f32).abs());
            }
        }
        worst
    }

    /// The largest distance of a tet's gradient from their mean, per unit of local length.
    fn gradient_spread(&self, tets: &[u32]) -> f64 {
        let gradient = |&tet: &u32| {
            let [x, y, z, _] = self.linear[tet as usize];
            DVec3::new(x, y, z)
        };
        let mean = tets.iter().map(gradient).sum::<DVec3>() / tets.len() as f64;
        tets.iter().map(|tet| gradient(tet).distance(mean)).fold(0.0, f64::max)
    }

    /// Means over the box (4 x 4 x 4 points) and over each corner's eighth of it, of what lies in the mesh.
    fn means(&self, tets: &[u32], center: Vec3, half: f32) -> (Option<f64>, [Sample; 8]) {
        let mut points: Points<64> = [[0.0; 64]; 3];
        for i in 0..64 {
            let at = |shift: usize| (i >> shift & 3) as f32 * 0.5 - 0.75;
            (points[0][i], points[1][i], points[2][i]) = (center.x + half * at(0), center.y + half * at(2), center.z + half * at(4));
        }
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let (mut corners, mut sum, mut count) = ([Sample::default(); 8], 0.0, 0.0);
        for i in (0..64).filter(|&i| outside[i] <= INSIDE_TOLERANCE) {
            let value = self.value_in(deepest[i], DVec3::new(points[0][i].into(), points[1][i].into(), points[2][i].into()));
            (sum, count) = (sum + value, count + 1.0);
            corners[i >> 1 & 1 | i >> 2 & 2 | i >> 3 & 4].merge(Sample::in_box(value as f32, 1.0));
        }
        ((count > 0.0).then(|| sum / count), corners)
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
    fn inverse_distance_to_vertices(&self, source: &Source, tets: &[u32], at: Vec3, half: f32, visited: &mut Visited) -> Sample {
        let x = self.center + at.as_dvec3() * self.half;
        let hit = 1e-6 * 2.0 * f64::from(half) * self.half / source.extent;
        let (mut weights, mut sum, mut exact) = (0.0, 0.0, None);
        visited.each_vertex(source, tets.iter().map(|&t| self.ids[t as usize]), |vertex| {
            let distance = x.distance(source.mesh.points()[vertex as usize]) / source.extent;
            let value = f64::from(source.point_values[vertex as usize]);
            if distance < hit {
                exact = exact.or(Some(value));
            }
            (weights, sum) = (weights + 1.0 / distance, sum + value / distance);
        });
        exact.map_or_else(|| Sample::mean(sum, weights), |value| Sample::exact(value as f32))
    }

    /// Equation (1') outside every tet: the mean of the values at each tet's nearest point, weighted by inverse distance. As in Franke &
    /// Nielson's modification of Shepard's method, the weights `1 / D - 1 / R` end at a radius R, here twice the distance of the tet `near`
    /// that nearly holds the point: what is far has little to say, and most of a leaf's tets need no closer look.
    fn inverse_distance_to_tets(&self, source: &Source, tets: &[u32], near: u32, at: Vec3) -> Sample {
        let x = self.center + at.as_dvec3() * self.half;
        let nearest = |local: u32| {
            let tet = self.ids[local as usize];
            let (w, distance) = geometry::closest_point_beyond(x, &source.corners(tet), self.planes.faces_outside(local as usize, at));
            let value: f64 = w.iter().zip(source.values(tet)).map(|(w, s)| w * s).sum();
            (value, distance)
        };
        let (value, distance) = nearest(near);
        if distance == 0.0 {
            return Sample::exact(value as f32);
        }
        let radius = 2.0 * distance;
        let (mut weights, mut sum) = (0.0, 0.0);
        for &local in tets {
            // A face plane is never farther than the tet.
            if f64::from(self.planes.distance_outside(local as usize, at)) * self.half >= radius {
                continue;
            }
            let (value, distance) = nearest(local);
            if distance == 0.0 {
                return Sample::exact(value as f32);
            }
            let weight = (source.extent / distance - source.extent / radius).max(0.0);
            (weights, sum) = (weights + weight, sum + value * weight);
        }
        Sample::mean(sum, weights)
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

/// The corners among a cell's lattice points.
const CORNERS: [usize; 8] = {
    let (mut points, mut k) = ([0; 8], 0);
    while k < 8 {
        points[k] = lattice_index(2 * (k as u32 & 1), 2 * (k as u32 >> 1 & 1), 2 * (k as u32 >> 2));
        k += 1;
    }
    points
};

/// Places of lattice points of a cell.
fn lattice_points<const N: usize>(center: Vec3, half: f32, numbers: [usize; N]) -> Points<N> {
    let mut points = [[0.0; N]; 3];
    for (k, &number) in numbers.iter().enumerate() {
        for (axis, c) in lattice_point(number).into_iter().enumerate() {
            points[axis][k] = center[axis] + half * (c as f32 - 1.0);
        }
    }
    points
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
