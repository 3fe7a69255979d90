//! A mesh as a GPU walks it: 20 bytes a tet and 16 a point.

use super::adjacency::{self, NONE, Tet};
use super::boundary::{cube_position, morton_code};
use super::{Association, BoundarySurface, ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// The usable tets of a mesh with their neighbours and one field, in edges of the root cube ([`TetMesh::root_cube`]), in f32.
///
/// Who walks from tet to tet knows three corners of a tet from the face that it came through; the exclusive or of all four gives the last
/// (Aman, Demirci & Gudukbay, "Compact Tetrahedralization-based Acceleration Structures for Ray Tracing", 2021).
/// So a tet needs no corners but that number, and its neighbours in an order that the corners tell: by the index of the corner that the
/// neighbour lacks. Tets lie along a Morton curve and points in the order in which tets use them, so that what a ray meets next is near.
#[derive(Debug, Clone)]
pub struct CompactMesh {
    /// For each tet the tets behind its faces, ascending by the point opposite the face; [`NONE`] where there is none.
    pub neighbours: Vec<[u32; 4]>,
    /// For each tet its four points' indices, by exclusive or.
    pub points: Vec<u32>,
    /// Position in [0, 1)^3 and the field's normalised value, 0 where values live on cells.
    pub vertices: Vec<[f32; 4]>,
    /// For each tet the field's normalised value; empty where values live on points.
    pub cell_values: Vec<f32>,
    /// The boundary; its points and tets are those of this mesh.
    pub surface: BoundarySurface,
    /// Lowest corner of the root cube, relative to the mesh's centre.
    pub cube_min: DVec3,
    /// Edge of the root cube in world units, above 0.
    pub cube_edge: f64,
}

impl CompactMesh {
    /// Sorts and links the tets that are [`ScalarField::is_usable`].
    pub fn new(mesh: &TetMesh, field: &ScalarField, progress: &Progress) -> Result<Self, Cancelled> {
        progress.begin("linking tets", 3);
        progress.check()?;
        let (cube_min, cube_edge) = mesh.root_cube();
        let cube_edge = if cube_edge > 0.0 { cube_edge } else { 1.0 };
        let order = along_curve(mesh, field, cube_min, cube_edge);
        let (corners, kept) = renumbered(mesh, &order);
        progress.add(1);
        progress.check()?;

        let (tets, faces) = adjacency::link(&corners, |_| true);
        progress.add(1);
        progress.check()?;

        let positions: Vec<DVec3> = kept.par_iter().map(|&point| mesh.points()[point as usize]).collect();
        let value = |point: u32| if field.association == Association::Points { field.normalize(field.values[point as usize]) } else { 0.0 };
        let vertex =
            |(&point, &position): (&u32, &DVec3)| cube_position(position, cube_min, cube_edge).extend(value(point) as f32).to_array();
        let on_cells = field.association == Association::Cells;
        let cell_values = order.par_iter().filter(|_| on_cells).map(|&tet| field.normalize(field.values[tet as usize]) as f32);
        let compact = CompactMesh {
            neighbours: tets.par_iter().map(by_opposite_point).collect(),
            points: corners.par_iter().map(|corners| corners.iter().fold(0, |all, point| all ^ point)).collect(),
            vertices: kept.par_iter().zip(&positions).map(vertex).collect(),
            cell_values: cell_values.collect(),
            surface: BoundarySurface::from_linked(&positions, cube_min, cube_edge, &tets, faces),
            cube_min,
            cube_edge,
        };
        progress.add(1);
        Ok(compact)
    }

    /// How many tets there are.
    pub fn tet_count(&self) -> usize {
        self.points.len()
    }

    /// Bytes in memory, on host and device alike, the surface included.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.neighbours[..])
            + size_of_val(&self.points[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.cell_values[..])
            + self.surface.bytes()
    }
}

/// The usable tets along a Morton curve through their centroids.
fn along_curve(mesh: &TetMesh, field: &ScalarField, cube_min: DVec3, cube_edge: f64) -> Vec<u32> {
    let code = |tet: u32| {
        let [a, b, c, d] = mesh.corners(tet as usize);
        (morton_code(cube_position((a + b + c + d) / 4.0, cube_min, cube_edge)), tet)
    };
    let usable = (0..mesh.tets().len() as u32).into_par_iter().filter(|&tet| field.is_usable(mesh, tet as usize));
    let mut codes: Vec<(u64, u32)> = usable.map(code).collect();
    codes.par_sort_unstable();
    codes.into_par_iter().map(|(_, tet)| tet).collect()
}

/// The corners of tets in an order, points renumbered by first use; and the mesh's index of each point kept.
fn renumbered(mesh: &TetMesh, order: &[u32]) -> (Vec<[u32; 4]>, Vec<u32>) {
    let mut number = vec![NONE; mesh.points().len()];
    let mut kept = Vec::new();
    let mut renumber = |point: u32| {
        let number = &mut number[point as usize];
        if *number == NONE {
            *number = kept.len() as u32;
            kept.push(point);
        }
        *number
    };
    let corners = order.iter().map(|&tet| mesh.tets()[tet as usize].map(&mut renumber)).collect();
    (corners, kept)
}

/// A tet's neighbours, ascending by the corner that they lack.
fn by_opposite_point(tet: &Tet) -> [u32; 4] {
    let mut faces = [0, 1, 2, 3].map(|face| (tet.corners[face], tet.neighbours[face]));
    faces.sort_unstable();
    faces.map(|(_, neighbour)| neighbour)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshParts;

    /// A row of tets, each sharing a face with the next, listed at random.
    fn row() -> TetMesh {
        let points = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
            let angle = f64::from(i) * 2.2;
            DVec3::new(angle.cos(), angle.sin(), f64::from(i) * 0.7)
        });
        TetMesh::new(MeshParts {
            points: points.to_vec(),
            tets: [3, 0, 2, 4, 1].map(|i| [i, i + 1, i + 2, i + 3]).to_vec(),
            ..Default::default()
        })
        .expect("valid")
    }

    #[test]
    fn the_last_corner_and_the_neighbours_follow_from_a_face() {
        let mesh = row();
        let field = ScalarField::new("s".into(), Association::Points, (0..8).map(f64::from).collect());
        let compact = CompactMesh::new(&mesh, &field, &Progress::new()).expect("not cancelled");
        assert_eq!((compact.tet_count(), compact.vertices.len()), (5, 8));
        // Points by their values, which are the mesh's indices.
        let original = |point: u32| (compact.vertices[point as usize][3] * 7.0).round() as u32;
        let mut met = 0;
        for face in compact.surface.faces() {
            let of_face = face.vertices.map(|v| compact.surface.vertices()[v as usize].point);
            let apex = of_face.iter().fold(compact.points[face.tet as usize], |all, point| all ^ point);
            let mut corners = [of_face[0], of_face[1], of_face[2], apex];
            corners.sort_unstable();
            let mut tet = corners.map(original);
            tet.sort_unstable();
            assert_eq!(tet, [tet[0], tet[0] + 1, tet[0] + 2, tet[0] + 3], "a tet of the row");
            for (opposite, neighbour) in corners.into_iter().zip(compact.neighbours[face.tet as usize]) {
                // Behind the first point comes the next tet of the row, behind the last the one before.
                let exists = (original(opposite) == tet[0] && tet[0] < 4) || (original(opposite) == tet[3] && tet[0] > 0);
                assert_eq!(neighbour != NONE, exists);
                if neighbour != NONE {
                    let shared = corners.iter().filter(|&&c| c != opposite).fold(compact.points[neighbour as usize], |all, c| all ^ c);
                    let expected = if original(opposite) == tet[0] { tet[0] + 4 } else { tet[0] - 1 };
                    assert_eq!(original(shared), expected);
                    met += 1;
                }
            }
        }
        assert!(met > 8);
        assert_eq!(compact.bytes(), 5 * 20 + 8 * 16 + compact.surface.bytes());
    }

    #[test]
    fn what_takes_no_part_is_left_out() {
        let mesh = row();
        let field = ScalarField::new("c".into(), Association::Cells, vec![1.0, f64::NAN, 3.0, 3.0, 2.0]);
        let compact = CompactMesh::new(&mesh, &field, &Progress::new()).expect("not cancelled");
        let mut values = compact.cell_values.clone();
        values.sort_by(f32::total_cmp);
        assert_eq!(values, [0.0, 0.5, 1.0, 1.0]);
        assert_eq!((compact.tet_count(), compact.vertices.len()), (4, 7), "tet 0 of the row and its first point are gone");
        assert!(compact.vertices.iter().all(|v| v[3] == 0.0));
    }
}
