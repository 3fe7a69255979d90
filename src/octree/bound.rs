//! A certified bound of the error of an octree: what no point of the mesh exceeds.

use super::texture::{Node, OctreeTexture};
use super::trilinear;
use crate::geometry::{self, Aabb, FACES};
use crate::mesh::{ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use glam::{DVec3, UVec3, Vec3};
use rayon::prelude::*;

/// What rounding to f32 may add to an error, relative to the field's range.
pub(super) const ROUNDING: f64 = 2e-6;

/// A bound of the difference between the reconstructed field and the mesh's own, relative to the field's range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// No point of the mesh at which the octree has a value differs by more.
    pub bound_rel: f64,
    /// The centre of a leaf that may differ so much, relative to the mesh's centre; the mesh's centre if nothing differs.
    pub at: DVec3,
}

/// A linear function `g . x + c` on the root cube, [0, 1]^3, with what bounds the tet that it belongs to.
struct Linear {
    gradient: DVec3,
    constant: f64,
    range: [f64; 2],
    corners: [DVec3; 4],
    bounds: Aabb,
    /// The planes of the faces, `n . x <= d` inside.
    faces: [(DVec3, f64); 4],
}

/// Bounds the error of a texture everywhere in the mesh.
///
/// On the part of a leaf that a tet covers, the error is the leaf's trilinear field less the tet's linear one: a trilinear function, which
/// on a box takes its extremes at corners. So its largest size at the corners of the bounds of that part bounds it, and so does what the
/// ranges of both allow; the smaller counts. Nothing is assumed of the samples: hanging corners, corners outside the
/// mesh and rounding are all in it, and leaves inside one tet, or of a linear field, have a bound of nothing but rounding. This is sharper
/// than `(h / 4)` times the sum of the jumps of the gradient (maths 3.3), and holds for every kind of sample.
pub fn error_bound(mesh: &TetMesh, field: &ScalarField, texture: &OctreeTexture, progress: &Progress) -> Result<ErrorBound, Cancelled> {
    progress.begin("bounding the error", mesh.tets().len() as u64);
    const CHUNK: usize = 1024;
    let chunks = mesh.tets().len().div_ceil(CHUNK);
    let worst_of = |chunk: usize| {
        progress.check()?;
        let tets = chunk * CHUNK..((chunk + 1) * CHUNK).min(mesh.tets().len());
        progress.add(tets.len() as u64);
        let mut worst = (0.0, DVec3::splat(0.5));
        for tet in tets.filter(|&tet| field.is_usable(mesh, tet)) {
            Linear::of(mesh, field, texture, tet).descend(texture, UVec3::ZERO, DVec3::ZERO, 1.0, &mut worst);
        }
        Ok(worst)
    };
    let (bound, at) = (0..chunks).into_par_iter().map(worst_of).try_reduce(|| (0.0, DVec3::splat(0.5)), |a, b| Ok(larger(a, b)))?;
    let at = if bound > 0.0 { texture.root_min() + at * texture.root_edge() } else { DVec3::ZERO };
    Ok(ErrorBound { bound_rel: bound + ROUNDING, at })
}

/// The larger of two errors; of equals the one that comes first along x, y, z.
pub(super) fn larger(a: (f64, DVec3), b: (f64, DVec3)) -> (f64, DVec3) {
    let key = |e: &(f64, DVec3)| (e.0, -e.1.x, -e.1.y, -e.1.z);
    if key(&b) > key(&a) { b } else { a }
}

impl Linear {
    fn of(mesh: &TetMesh, field: &ScalarField, texture: &OctreeTexture, tet: usize) -> Self {
        let p = mesh.corners(tet).map(|p| (p - texture.root_min()) / texture.root_edge());
        let s = field.at_corners(mesh, tet);
        let gradient = geometry::gradient(&p, &s);
        let face = |[a, b, c]: [usize; 3]| {
            let normal = (p[b] - p[a]).cross(p[c] - p[a]).normalize_or_zero();
            (normal, normal.dot(p[a]))
        };
        let range = [s.iter().copied().fold(f64::INFINITY, f64::min), s.iter().copied().fold(f64::NEG_INFINITY, f64::max)];
        Linear { gradient, constant: s[0] - gradient.dot(p[0]), range, corners: p, bounds: Aabb::of_points(p), faces: FACES.map(face) }
    }

    /// Goes down to all leaves that the tet may overlap, and takes the largest error and its leaf's centre.
    fn descend(&self, texture: &OctreeTexture, block: UVec3, low: DVec3, edge: f64, worst: &mut (f64, DVec3)) {
        let half = edge / 2.0;
        for i in 0..8u32 {
            let child = super::brick::offset(i);
            let corner = low + child.as_dvec3() * half;
            if self.is_apart(corner, half) {
                continue;
            }
            match texture.node(block * 2 + child) {
                Node::Empty => {}
                Node::Interior { block } => self.descend(texture, block, corner, half, worst),
                Node::Leaf { value, .. } => {
                    let corners = texture.leaf_corners(block, i, value);
                    // A closer look only where it may matter.
                    if self.error(&corners, corner, half, &self.bounds) >= worst.0 {
                        let shared = self.shared(corner, half);
                        *worst = larger(*worst, (self.error(&corners, corner, half, &shared), corner + half / 2.0));
                    }
                }
            }
        }
    }

    /// Whether the tet surely does not reach into a cell.
    fn is_apart(&self, low: DVec3, edge: f64) -> bool {
        const SLACK: f64 = 1e-12;
        let Aabb { min, max } = self.bounds;
        if !(min.cmple(low + edge + SLACK).all() && max.cmpge(low - SLACK).all()) {
            return true;
        }
        let (half, center) = (edge / 2.0, low + edge / 2.0);
        self.faces.iter().any(|(normal, d)| normal.dot(center) - half * normal.abs().element_sum() > d + SLACK)
    }

    /// The bounds of what the tet and a cell share: of the tet's faces, cut to the cell, and of the cell's corners inside the tet.
    /// [`Aabb::EMPTY`] if they share nothing.
    fn shared(&self, low: DVec3, edge: f64) -> Aabb {
        const SLACK: f64 = 1e-12;
        let mut bounds = Aabb::EMPTY;
        let mut add = |p: DVec3| bounds = Aabb { min: bounds.min.min(p - SLACK), max: bounds.max.max(p + SLACK) };
        for [a, b, c] in FACES {
            let mut polygon = vec![self.corners[a], self.corners[b], self.corners[c]];
            for (axis, plane, sign) in (0..3).flat_map(|axis| [(axis, low[axis], 1.0), (axis, low[axis] + edge, -1.0)]) {
                let depth = |p: &DVec3| sign * (p[axis] - plane) + SLACK;
                let mut cut = Vec::with_capacity(polygon.len() + 1);
                for (i, p) in polygon.iter().enumerate() {
                    let next = &polygon[(i + 1) % polygon.len()];
                    let (here, there) = (depth(p), depth(next));
                    if here >= 0.0 {
                        cut.push(*p);
                    }
                    if (here >= 0.0) != (there >= 0.0) {
                        cut.push(p + (next - p) * (here / (here - there)));
                    }
                }
                polygon = cut;
            }
            polygon.into_iter().for_each(&mut add);
        }
        for i in 0..8 {
            let p = low + super::brick::offset(i).as_dvec3() * edge;
            if self.faces.iter().all(|(normal, d)| normal.dot(p) <= d + SLACK) {
                add(p);
            }
        }
        bounds
    }

    /// The bound in the part of the leaf at `low` that lies in `bounds`; 0 if nothing does.
    fn error(&self, corners: &[f32; 8], low: DVec3, edge: f64, bounds: &Aabb) -> f64 {
        if bounds.min.x > bounds.max.x {
            return 0.0;
        }
        let (from, to) = (bounds.min.max(low).min(low + edge), bounds.max.min(low + edge).max(low));
        let (mut difference, mut lowest, mut highest) = (0f64, f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..8 {
            let at = DVec3::select(glam::BVec3::new(k & 1 == 1, k >> 1 & 1 == 1, k >> 2 == 1), to, from);
            let unit: Vec3 = ((at - low) / edge).as_vec3();
            let value = f64::from(trilinear(corners, unit));
            difference = difference.max((value - self.gradient.dot(at) - self.constant).abs());
            (lowest, highest) = (lowest.min(value), highest.max(value));
        }
        let by_ranges = (highest - self.range[0]).max(self.range[1] - lowest);
        difference.min(by_ranges)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Boundary, OctreeParams, Reconstruction, Sampling, regularize};
    use super::*;
    use crate::mesh::{Association, MeshParts};

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Tets of five a cube on n^3 points that are moved about, with a hole, and stretched along z.
    fn mesh(random: &mut Random, n: u32) -> TetMesh {
        let (jitter, stretch) = (0.6 * random.next(), 0.2 + 2.0 * random.next());
        lattice(random, n, jitter, stretch, true)
    }

    fn lattice(random: &mut Random, n: u32, jitter: f64, stretch: f64, has_hole: bool) -> TetMesh {
        let mut parts = MeshParts::default();
        for i in 0..n.pow(3) {
            let at = UVec3::new(i % n, i / n % n, i / (n * n)).as_dvec3();
            let moved = at + DVec3::new(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5) * jitter;
            parts.points.push(moved * DVec3::new(1.0, 1.0, stretch));
        }
        let cells = n - 1;
        for i in 0..cells.pow(3) {
            let at = UVec3::new(i % cells, i / cells % cells, i / (cells * cells));
            if has_hole && at == UVec3::splat(cells / 2) {
                continue;
            }
            let odd = at.element_sum() % 2;
            let corner = |k: u32| {
                let at = at + UVec3::new((k & 1) ^ odd, k >> 1 & 1, k >> 2);
                at.x + n * (at.y + n * at.z)
            };
            parts.tets.extend([[0, 1, 2, 4], [3, 1, 2, 7], [5, 1, 4, 7], [6, 2, 4, 7], [1, 2, 4, 7]].map(|t| t.map(corner)));
        }
        TetMesh::new(parts).expect("valid")
    }

    /// The largest error at points of every tet.
    fn measured(mesh: &TetMesh, field: &ScalarField, texture: &OctreeTexture, random: &mut Random) -> f64 {
        let mut worst = 0f64;
        for tet in (0..mesh.tets().len()).filter(|&tet| field.is_usable(mesh, tet)) {
            for _ in 0..40 {
                let w = [(); 4].map(|()| -random.next().ln() * if random.next() < 0.3 { 0.02 } else { 1.0 });
                let sum: f64 = w.iter().sum();
                let (p, s) = (mesh.corners(tet), field.at_corners(mesh, tet));
                let at: DVec3 = (0..4).map(|i| p[i] * (w[i] / sum)).sum();
                let value: f64 = (0..4).map(|i| s[i] * w[i] / sum).sum();
                if let Some(found) = texture.value_at((at - texture.root_min()) / texture.root_edge()) {
                    worst = worst.max((f64::from(found) - value).abs());
                }
            }
        }
        worst
    }

    #[test]
    fn no_error_exceeds_the_bound_on_random_fields_and_meshes() {
        let mut random = Random(7);
        let mut ratios = Vec::new();
        for case in 0..20 {
            let mesh = mesh(&mut random, 4 + case % 4);
            let frequency = 1.0 + 3.0 * random.next();
            let value = |p: &DVec3, random: &mut Random| match case % 3 {
                0 => random.next(),
                1 => (p.x * frequency).sin() + p.y * p.z,
                _ => p.length() + 0.2 * random.next(),
            };
            let (association, values) = if case % 7 == 6 {
                (Association::Cells, (0..mesh.tets().len()).map(|_| random.next()).collect())
            } else {
                (Association::Points, mesh.points().iter().map(|p| value(p, &mut random)).collect())
            };
            let field = ScalarField::new("f".into(), association, values);
            let params = OctreeParams {
                tolerance: Some([0.2, 0.05, 0.01][case as usize % 3]),
                max_depth: 3 + (case % 4) as u8,
                reconstruction: if case % 5 == 4 { Reconstruction::Leaf } else { Reconstruction::Continuous },
                boundary: if case % 6 == 5 { Boundary::Centres } else { Boundary::Mesh },
                sampling: [Sampling::Tets, Sampling::Vertices, Sampling::Average][case as usize / 2 % 3],
                ..OctreeParams::default()
            };
            let texture = OctreeTexture::encode(&regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes")).expect("fits");
            let bound = error_bound(&mesh, &field, &texture, &Progress::new()).expect("nobody cancels").bound_rel;
            let found = measured(&mesh, &field, &texture, &mut random);
            assert!(found <= bound && bound <= 1.0 + 1e-5, "case {case}: {found} found, bound {bound}, {params:?}");
            ratios.push(found / bound);
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[10] > 0.3, "the bound says something: {ratios:?}");
    }

    #[test]
    fn what_a_tet_and_a_cell_share_is_bounded_tightly() {
        let mut random = Random(11);
        let (mut inside, mut nothing) = (0, 0);
        for _ in 0..200 {
            let corners = [(); 4].map(|()| DVec3::new(random.next(), random.next(), random.next()));
            let (low, edge) = (DVec3::new(random.next(), random.next(), random.next()) * 0.8, 0.05 + 0.5 * random.next());
            if geometry::is_degenerate(&corners) {
                continue;
            }
            let mut p = corners;
            if geometry::signed_volume(&p) < 0.0 {
                p.swap(2, 3);
            }
            let faces = FACES.map(|[a, b, c]| {
                let normal = (p[b] - p[a]).cross(p[c] - p[a]).normalize();
                (normal, normal.dot(p[a]))
            });
            let tet = Linear { gradient: DVec3::ZERO, constant: 0.0, range: [0.0; 2], corners: p, bounds: Aabb::of_points(p), faces };
            let shared = tet.shared(low, edge);
            for _ in 0..2000 {
                let at = low + DVec3::new(random.next(), random.next(), random.next()) * edge;
                if geometry::barycentric(at, &p).iter().all(|&w| w >= 0.0) {
                    assert!(shared.min.cmple(at).all() && shared.max.cmpge(at).all(), "{at} is in both, not in {shared:?}");
                    inside += 1;
                }
            }
            nothing += usize::from(shared == Aabb::EMPTY);
            if shared != Aabb::EMPTY {
                assert!(shared.min.cmpge(low - 1e-9).all() && shared.max.cmple(low + edge + 1e-9).all(), "not beyond the cell");
                assert!(shared.min.cmpge(tet.bounds.min - 1e-9).all() && shared.max.cmple(tet.bounds.max + 1e-9).all(), "nor the tet");
            }
        }
        assert!(inside > 5_000 && nothing > 10, "{inside} points in both, {nothing} pairs apart");
    }

    #[test]
    fn a_linear_field_has_a_bound_of_little_but_rounding() {
        let bound = |mesh: TetMesh| {
            let field =
                ScalarField::new("f".into(), Association::Points, mesh.points().iter().map(|p| p.x + 2.0 * p.y + 3.0 * p.z).collect());
            let params = OctreeParams { max_depth: 4, initial_depth: Some(2), ..OctreeParams::default() };
            let texture = OctreeTexture::encode(&regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes")).expect("fits");
            error_bound(&mesh, &field, &texture, &Progress::new()).expect("nobody cancels").bound_rel
        };
        // The root cube is a few millionths larger than the mesh, and outside it the field does not go on.
        let cube = bound(lattice(&mut Random(3), 5, 0.0, 1.0, false));
        assert!(cube > 0.0 && cube < 5e-5, "{cube}");
        let cut = bound(lattice(&mut Random(3), 5, 0.0, 0.7, false));
        assert!(cut > 0.001 && cut < 0.2, "leaves that the surface cuts are not exact: {cut}");
    }
}
