//! What a leaf holds: samples by inverse distance (method 1.2) or as means, its range; and what decides whether it is one, the variance of
//! its vertices' values or the error of the reconstruction.

use super::brick::{LATTICE, lattice_index, lattice_point, trilinear};
use super::lattice::Sample;
use super::{Boundary, OctreeParams, Reconstruction, Sampling};
use crate::geometry::{self, TetPlanes};
use crate::mesh::{Association, ScalarField, TetMesh};
use glam::{DVec3, Vec3};
use std::cell::Cell;

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

/// How closely a cell is looked at for errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// At every place that is known to matter.
    Close,
    /// At some of them, where nothing depends on it but what is said.
    Quick,
}

/// The middle of a cell and of its faces, filled up with the middle.
const MIDDLES: [usize; 8] = [13, 4, 10, 12, 14, 16, 22, 13];

/// The lattice points of a cell, filled up with the middle to what vector instructions like.
const ALL_POINTS: [usize; 32] = {
    let (mut points, mut i) = ([13; 32], 0);
    while i < LATTICE {
        points[i] = i;
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
    /// The samples of the cell at this place that an error was last asked for, where those took long to find.
    known_corners: Cell<Option<(Vec3, [Sample; 8])>>,
}

impl LocalTets {
    /// Takes up the tets of a new task.
    pub fn prepare(&mut self, source: &Source, tets: &[u32], center: DVec3, half: f64) {
        (self.center, self.half) = (center, half);
        self.known_corners.set(None);
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
        let value = match (params.sampling, holder) {
            (Sampling::Vertices, _) => self.inverse_distance_to_vertices(source, tets, center, half, visited).value(),
            (Sampling::Average, _) if tets.len() >= MANY_TETS => self.means(tets, center, half).0.value(),
            (_, Some(tet)) => self.value_in(tet, center.as_dvec3()) as f32,
            (_, None) => self.inverse_distance_to_tets(source, tets, center).value(),
        };
        let value = value.clamp(0.0, 1.0);
        let corners = match params.reconstruction {
            Reconstruction::Continuous => match self.known_corners.take() {
                Some((of, corners)) if of == center => corners,
                _ => self.corners(source, params.sampling, tets, center, half, visited),
            },
            Reconstruction::Leaf => Default::default(),
        };
        let [lo, hi] = self.range(tets, center.as_dvec3(), f64::from(half));
        Some(Leaf { value, range: [lo.min(value), hi.max(value)], corners })
    }

    /// What a leaf knows of its corners.
    fn corners(&self, source: &Source, sampling: Sampling, tets: &[u32], center: Vec3, half: f32, visited: &mut Visited) -> [Sample; 8] {
        let points = lattice_points(center, half, CORNERS);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let average = sampling == Sampling::Average && tets.len() >= MANY_TETS;
        let mut corners = if average { self.means(tets, center, half).1 } else { Default::default() };
        for (k, corner) in corners.iter_mut().enumerate() {
            let at = place(&points, k);
            if sampling == Sampling::Vertices {
                *corner = self.inverse_distance_to_vertices(source, tets, at, half, visited);
            } else if outside[k] > INSIDE_TOLERANCE {
                corner.merge(self.inverse_distance_to_nearest(source, tets, deepest[k], at));
            } else if !average {
                *corner = Sample::exact(self.value_in(deepest[k], at.as_dvec3()) as f32);
            }
        }
        corners
    }

    /// The largest difference between the reconstruction and the field that is found in a cell: at lattice points, at vertices of the mesh
    /// inside it, and where the surface cuts it, at points of the surface; normalised. Stops at the first above `enough`. Where the linear
    /// functions of few tets nearly agree, a bound instead. A quick look sees vertices and the middles of the cell and its faces.
    ///
    /// Samples are taken as [`Sampling::Tets`] has them whatever the parameters say: what equation (1) or a mean errs by is not mended by
    /// dividing, and would divide everything to the greatest depth.
    pub fn error(
        &self,
        source: &Source,
        params: &OctreeParams,
        look: Look,
        enough: f32,
        tets: &[u32],
        center: Vec3,
        half: f32,
        visited: &mut Visited,
    ) -> f32 {
        self.known_corners.set(None);
        let is_sample = params.sampling == Sampling::Tets;
        let params = &OctreeParams { sampling: Sampling::Tets, boundary: Boundary::Cells, ..params.clone() };
        let points = lattice_points(center, half, CORNERS);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let filled = outside.iter().all(|&d| d <= INSIDE_TOLERANCE);
        let continuous = params.reconstruction == Reconstruction::Continuous;
        if continuous && filled && tets.len() <= FEW_TETS {
            let bound = 2.0 * self.disagreement(tets, center.as_dvec3(), f64::from(half)) as f32;
            if bound <= enough && enough.is_finite() {
                return bound;
            }
        }
        let mut corners: [f32; 8] = if continuous {
            // Outside the mesh that is only near to what the leaf would take, but soon found; see below.
            std::array::from_fn(|k| self.value_in(deepest[k], place(&points, k).as_dvec3()) as f32)
        } else {
            let leaf = self.sample(source, params, tets, center, half, visited);
            [leaf.map_or(0.0, |leaf| leaf.value); 8]
        };
        let mut worst = 0f32;
        // Vertices, where the field bends most.
        let (low, size) = (center - half, 2.0 * half);
        let in_cell = |x: DVec3| ((x - self.center) / self.half).as_vec3() - low;
        if source.field.association == Association::Points {
            visited.each_vertex_while(source, tets.iter().map(|&t| self.ids[t as usize]), |vertex| {
                let unit = in_cell(source.mesh.points()[vertex as usize]) / size;
                if unit.min_element() > 0.0 && unit.max_element() < 1.0 {
                    worst = worst.max((trilinear(&corners, unit) - source.point_values[vertex as usize]).abs());
                }
                worst <= enough
            });
        }
        if worst > enough {
            return worst;
        }
        // Then where a curved field is missed by most.
        let points = lattice_points(center, half, MIDDLES);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        for k in (0..MIDDLES.len()).filter(|&k| outside[k] <= INSIDE_TOLERANCE) {
            let [x, y, z] = lattice_point(MIDDLES[k]).map(|c| c as f32 * 0.5);
            worst =
                worst.max((trilinear(&corners, Vec3::new(x, y, z)) - self.value_in(deepest[k], place(&points, k).as_dvec3()) as f32).abs());
        }
        if worst > enough || look == Look::Quick {
            return worst;
        }
        let points = lattice_points(center, half, ALL_POINTS);
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let at_lattice = |corners: &[f32; 8]| {
            let inside = (0..LATTICE).filter(|&i| outside[i] <= INSIDE_TOLERANCE);
            let error = |i: usize| {
                let [x, y, z] = lattice_point(i).map(|c| c as f32 * 0.5);
                (trilinear(corners, Vec3::new(x, y, z)) - self.value_in(deepest[i], place(&points, i).as_dvec3()) as f32).abs()
            };
            inside.map(error).fold(0.0, f32::max)
        };
        worst = worst.max(at_lattice(&corners));
        if worst > enough || outside[..LATTICE].iter().all(|&d| d <= INSIDE_TOLERANCE) {
            return worst;
        }
        // The surface cuts the cell: the leaf's own samples, also at points just inside the surface before lattice points outside.
        if continuous {
            let samples = self.corners(source, params.sampling, tets, center, half, visited);
            corners = samples.map(Sample::value);
            self.known_corners.set(is_sample.then_some((center, samples)));
            worst = worst.max(at_lattice(&corners));
        }
        if worst > enough {
            return worst;
        }
        let mut near = points;
        for i in (0..LATTICE).filter(|&i| outside[i] > INSIDE_TOLERANCE) {
            let at = self.planes.moved_inside(deepest[i] as usize, place(&points, i), 1e-3 * half);
            (near[0][i], near[1][i], near[2][i]) = at.into();
        }
        let (holders, distance) = self.planes.deepest(tets, &near);
        for i in (0..LATTICE).filter(|&i| outside[i] > INSIDE_TOLERANCE) {
            let (at, value) = if distance[i] <= INSIDE_TOLERANCE {
                (place(&near, i), self.value_in(holders[i], place(&near, i).as_dvec3()))
            } else {
                // Beside the face; the nearest point of the tet is on its rim.
                let (value, _, x) = self.nearest_point(source, deepest[i], place(&points, i));
                (((x - self.center) / self.half).as_vec3(), value)
            };
            let unit = (at - low) / size;
            if unit.min_element() >= 0.0 && unit.max_element() <= 1.0 {
                worst = worst.max((trilinear(&corners, unit) - value as f32).abs());
            }
            if worst > enough {
                break;
            }
        }
        worst
    }

    /// The largest distance in a box of a tet's linear function from the mean of all.
    fn disagreement(&self, tets: &[u32], center: DVec3, half: f64) -> f64 {
        let mut mean = [0.0; 4];
        for &tet in tets {
            for (sum, part) in mean.iter_mut().zip(self.linear[tet as usize]) {
                *sum += part / tets.len() as f64;
            }
        }
        let distance = |&tet: &u32| {
            let [x, y, z, c]: [f64; 4] = std::array::from_fn(|i| self.linear[tet as usize][i] - mean[i]);
            (x * center.x + y * center.y + z * center.z + c).abs() + (x.abs() + y.abs() + z.abs()) * half
        };
        tets.iter().map(distance).fold(0.0, f64::max)
    }

    /// Means over the box (4 x 4 x 4 points) and over each corner's eighth of it, of what lies in the mesh.
    fn means(&self, tets: &[u32], center: Vec3, half: f32) -> (Sample, [Sample; 8]) {
        let mut points: Points<64> = [[0.0; 64]; 3];
        for i in 0..64 {
            let at = |shift: usize| (i >> shift & 3) as f32 * 0.5 - 0.75;
            (points[0][i], points[1][i], points[2][i]) = (center.x + half * at(0), center.y + half * at(2), center.z + half * at(4));
        }
        let (deepest, outside) = self.planes.deepest(tets, &points);
        let (mut all, mut corners) = (Sample::default(), [Sample::default(); 8]);
        for i in (0..64).filter(|&i| outside[i] <= INSIDE_TOLERANCE) {
            let one = Sample::in_box(self.value_in(deepest[i], place(&points, i).as_dvec3()) as f32, 1.0);
            all.merge(one);
            corners[i >> 1 & 1 | i >> 2 & 2 | i >> 3 & 4].merge(one);
        }
        if all == Sample::default() {
            // No such point meets the mesh.
            all = Sample::exact(self.value_in(deepest[0], center.as_dvec3()) as f32);
        }
        (all, corners)
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

    /// Equation (1') outside every tet: the mean of the values at each tet's nearest point, weighted by 1 / distance.
    fn inverse_distance_to_tets(&self, source: &Source, tets: &[u32], at: Vec3) -> Sample {
        let (mut weights, mut sum) = (0.0, 0.0);
        for &tet in tets {
            let (value, distance, _) = self.nearest_point(source, tet, at);
            if distance == 0.0 {
                return Sample::exact(value as f32);
            }
            (weights, sum) = (weights + source.extent / distance, sum + value * source.extent / distance);
        }
        Sample::mean(sum, weights)
    }

    /// What a leaf says of a corner outside every tet: the value at the nearest point of all, with the weight 1 / distance, so that the
    /// leaves that share the corner make equation (1') of it, each with its nearest tet. `near` is the tet that comes nearest to holding it.
    fn inverse_distance_to_nearest(&self, source: &Source, tets: &[u32], near: u32, at: Vec3) -> Sample {
        let (mut value, mut distance, _) = self.nearest_point(source, near, at);
        for &tet in tets {
            // No tet is nearer than the plane of a face that the point is beyond.
            if tet != near && f64::from(self.planes.distance_outside(tet as usize, at)) * self.half < distance {
                let other = self.nearest_point(source, tet, at);
                if other.1 < distance {
                    (value, distance) = (other.0, other.1);
                }
            }
        }
        if distance == 0.0 { Sample::exact(value as f32) } else { Sample::mean(value * source.extent / distance, source.extent / distance) }
    }

    /// The value at the point of a tet that is nearest to a place outside, how far that is, and where.
    fn nearest_point(&self, source: &Source, tet: u32, at: Vec3) -> (f64, f64, DVec3) {
        let x = self.center + at.as_dvec3() * self.half;
        let (faces, tet) = (self.planes.faces_outside(tet as usize, at), self.ids[tet as usize]);
        let p = source.corners(tet);
        let (w, distance) = geometry::closest_point_beyond(x, &p, faces);
        let nearest = (0..4).map(|i| p[i] * w[i]).sum();
        (w.iter().zip(source.values(tet)).map(|(w, s)| w * s).sum(), distance, nearest)
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

/// Point k of many.
fn place<const N: usize>(points: &Points<N>, k: usize) -> Vec3 {
    Vec3::new(points[0][k], points[1][k], points[2][k])
}

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
