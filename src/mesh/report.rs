//! What is unusual about a mesh: what its topology and its damage are, as numbers.

use super::TetMesh;
use crate::geometry::{self, FACES};
use glam::DVec3;
use rayon::prelude::*;

/// Counts over a whole mesh. Tets of zero volume take part: their faces join others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshReport {
    /// Sum of all tets' volumes, world units cubed. Overlapping tets count twice.
    pub volume: f64,
    /// Faces of one tet only.
    pub boundary_faces: u64,
    /// Their area, world units squared.
    pub boundary_area: f64,
    /// Edges of the boundary that have not just two of its faces: it touches itself there, or is open.
    pub odd_boundary_edges: u64,
    /// Parts that are not joined by faces.
    pub components: u64,
    /// Faces of three tets or more.
    pub non_manifold_faces: u64,
    /// Faces of two tets that lie on one side of it, and so overlap.
    pub overlapping_faces: u64,
    /// Tets with the corners of one before.
    pub duplicate_tets: u64,
    /// Points at the place of one before.
    pub coincident_points: u64,
    /// Points that no tet has.
    pub unused_points: u64,
}

impl MeshReport {
    /// Bytes that finding it takes, at most.
    pub fn working_bytes(mesh: &TetMesh) -> u64 {
        mesh.tets().len() as u64 * (4 * 16 + 16 + 4) + mesh.points().len() as u64 * 25
    }

    /// Looks at every tet, face and point: time and memory of sorting all faces.
    pub fn new(mesh: &TetMesh) -> Self {
        let (points, tets) = (mesh.points(), mesh.tets());
        let mut faces: Vec<([u32; 3], u32)> = (0..tets.len())
            .into_par_iter()
            .flat_map_iter(|tet| FACES.map(|face| (sorted(face.map(|corner| tets[tet][corner])), tet as u32)))
            .collect();
        faces.par_sort_unstable();

        let mut parts = Parts::new(tets.len());
        let mut boundary: Vec<[u32; 3]> = Vec::new();
        let (mut non_manifold_faces, mut overlapping_faces) = (0, 0);
        for run in faces.chunk_by(|a, b| a.0 == b.0) {
            run.windows(2).for_each(|pair| parts.join(pair[0].1, pair[1].1));
            match run {
                [(corners, _)] => boundary.push(*corners),
                [(corners, first), (_, second)] => overlapping_faces += u64::from(is_one_side(mesh, corners, *first, *second)),
                _ => non_manifold_faces += 1,
            }
        }
        drop(faces);

        let mut edges: Vec<[u32; 2]> = boundary.par_iter().flat_map_iter(|&[a, b, c]| [[a, b], [b, c], [a, c]]).collect();
        edges.par_sort_unstable();
        let odd_boundary_edges = edges.chunk_by(|a, b| a == b).filter(|run| run.len() != 2).count() as u64;

        let mut corners: Vec<[u32; 4]> = tets.par_iter().map(|&tet| sorted(tet)).collect();
        corners.par_sort_unstable();
        let mut places: Vec<[u64; 3]> = points.par_iter().map(|&p| (p + DVec3::ZERO).to_array().map(f64::to_bits)).collect();
        places.par_sort_unstable();
        let mut is_used = vec![false; points.len()];
        tets.iter().flatten().for_each(|&i| is_used[i as usize] = true);
        let area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| points[i as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        MeshReport {
            // In order, so that every run gives the same sum.
            volume: (0..tets.len()).map(|tet| geometry::signed_volume(&mesh.corners(tet)).abs()).sum(),
            boundary_faces: boundary.len() as u64,
            boundary_area: boundary.iter().map(area).sum(),
            odd_boundary_edges,
            components: parts.count(),
            non_manifold_faces,
            overlapping_faces,
            duplicate_tets: repeats(&corners),
            coincident_points: repeats(&places),
            unused_points: is_used.iter().filter(|&&used| !used).count() as u64,
        }
    }
}

/// Whether two tets lie on one side of their face; flat ones lie on none.
fn is_one_side(mesh: &TetMesh, face: &[u32; 3], first: u32, second: u32) -> bool {
    let [a, b, c] = face.map(|i| mesh.points()[i as usize]);
    let side = |tet: u32| {
        let corner = mesh.tets()[tet as usize].into_iter().find(|corner| !face.contains(corner));
        let is_flat = mesh.is_zero_volume(tet as usize);
        corner.filter(|_| !is_flat).map_or(0.0, |corner| geometry::signed_volume(&[mesh.points()[corner as usize], a, b, c]))
    };
    side(first) * side(second) > 0.0
}

fn sorted<const N: usize>(mut numbers: [u32; N]) -> [u32; N] {
    numbers.sort_unstable();
    numbers
}

/// How many of a sorted list are like the one before.
fn repeats<T: PartialEq>(sorted: &[T]) -> u64 {
    sorted.windows(2).filter(|pair| pair[0] == pair[1]).count() as u64
}

/// Sets that are joined (union-find with path halving).
struct Parts(Vec<u32>);

impl Parts {
    fn new(len: usize) -> Self {
        Parts((0..len as u32).collect())
    }

    fn root(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            let above = self.0[of as usize];
            self.0[of as usize] = self.0[above as usize];
            of = above;
        }
        of
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    fn count(&self) -> u64 {
        self.0.iter().enumerate().filter(|&(i, &above)| i as u32 == above).count() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{MeshParts, collect};

    fn report(points: Vec<DVec3>, tets: &[[u32; 4]]) -> MeshReport {
        MeshReport::new(&TetMesh::new(MeshParts { points, tets: tets.to_vec(), ..Default::default() }).expect("valid"))
    }

    fn corners() -> Vec<DVec3> {
        vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]
    }

    #[test]
    fn a_cube_is_sound() {
        let cube = collect(&*plan(Shape::Cube, Some(3000)).expect("a size")).expect("valid");
        let report = MeshReport::new(&cube);
        assert!((report.volume - 1.0).abs() < 1e-12 && (report.boundary_area - 6.0).abs() < 1e-12, "{report:?}");
        assert_eq!((report.components, report.odd_boundary_edges, report.non_manifold_faces, report.overlapping_faces), (1, 0, 0, 0));
        assert_eq!((report.duplicate_tets, report.coincident_points, report.unused_points), (0, 0, 0));
        assert_eq!(report.boundary_faces % 6, 0);
    }

    #[test]
    fn damage_is_counted() {
        let pair = report(corners(), &[[0, 1, 2, 3], [1, 2, 3, 4]]);
        assert_eq!((pair.components, pair.boundary_faces, pair.overlapping_faces), (1, 6, 0));
        assert!((pair.volume - (1.0 + 2.0) / 6.0).abs() < 1e-15);
        // The same tet twice: all faces have two tets on one side.
        let twice = report(corners()[..4].to_vec(), &[[0, 1, 2, 3], [2, 1, 0, 3]]);
        assert_eq!((twice.duplicate_tets, twice.overlapping_faces, twice.boundary_faces), (1, 4, 0));
        let three = report([corners(), vec![DVec3::ONE * 2.0]].concat(), &[[0, 1, 2, 3], [1, 2, 3, 4], [1, 2, 3, 5]]);
        assert_eq!((three.non_manifold_faces, three.overlapping_faces, three.components), (1, 0, 1));
        // Two tets that meet in an edge only, with points of their own at its ends, and one point of none.
        let apart = [corners(), vec![DVec3::ZERO, DVec3::X, -DVec3::Y, -DVec3::Z]].concat();
        let apart = report(apart, &[[0, 1, 2, 3], [5, 6, 7, 8]]);
        assert_eq!((apart.components, apart.coincident_points, apart.unused_points, apart.odd_boundary_edges), (2, 2, 1, 0));
        let touching = [corners(), vec![-DVec3::Y, -DVec3::Z]].concat();
        assert_eq!(report(touching, &[[0, 1, 2, 3], [0, 1, 5, 6]]).odd_boundary_edges, 1);
    }
}
