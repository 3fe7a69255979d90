//! The lines in which planes cut the faces of a mesh's tets: its edges on the planes.

use crate::geometry::FACES;
use crate::mesh::TetMesh;
use crate::mesh::boundary::cube_position;
use crate::view::{Plane, PlaneUse, Planes};
use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use std::fmt;
use std::sync::OnceLock;
use std::time::Duration;

/// The mesh's edges on the planes that are drawn with edges.
#[derive(Debug)]
pub struct CutEdges {
    planes: Planes,
    cuts: Vec<Cut>,
}

/// The edges on one plane.
#[derive(Default)]
pub struct Cut {
    /// In edges of the mesh's root cube, which is [0, 1)^3; each once.
    lines: Vec<[Vec3; 2]>,
    bvh: OnceLock<Bvh2>,
}

impl fmt::Debug for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cut").field("lines", &self.lines.len()).finish()
    }
}

impl CutEdges {
    /// Cuts a mesh with planes that are relative to its centre. It takes a look at every tet, a point at a time as they are stored.
    pub fn new(mesh: &TetMesh, planes: Planes) -> Self {
        let (cube_min, cube_edge) = mesh.root_cube();
        let cut = |plane: Plane| match plane.used {
            PlaneUse::Clip => None,
            PlaneUse::Cut { edges: false, .. } => Some(Cut::default()),
            PlaneUse::Cut { .. } => Some(Cut::new(mesh, plane.point, plane.normal.normalize(), cube_min, cube_edge)),
        };
        CutEdges { planes, cuts: planes.iter().filter_map(cut).collect() }
    }

    /// Whether these are the edges on the planes of `planes` that are drawn.
    pub fn are_on(&self, planes: &Planes) -> bool {
        fn drawn(planes: &Planes) -> impl Iterator<Item = Plane> {
            planes.iter().filter(|plane| plane.used != PlaneUse::Clip)
        }
        drawn(&self.planes).eq(drawn(planes))
    }

    /// Those on each plane that is drawn, in the planes' order; empty where none are asked for.
    pub fn cuts(&self) -> &[Cut] {
        &self.cuts
    }
}

impl Cut {
    fn new(mesh: &TetMesh, point: DVec3, normal: DVec3, cube_min: DVec3, cube_edge: f64) -> Self {
        let heights: Vec<f64> = mesh.points().par_iter().map(|p| (*p - point).dot(normal)).collect();
        let of_face = |corners: [u32; 3]| -> Option<([u32; 3], [Vec3; 2])> {
            // What lies in the plane counts as above it.
            let is_above = corners.map(|corner| heights[corner as usize] >= 0.0);
            let alone = (0..3).find(|&i| is_above[i] != is_above[(i + 1) % 3] && is_above[i] != is_above[(i + 2) % 3])?;
            let crossed = [1, 2].map(|k| {
                let [from, to] = [corners[alone], corners[(alone + k) % 3]].map(|corner| corner as usize);
                let part = heights[from] / (heights[from] - heights[to]);
                cube_position(mesh.points()[from].lerp(mesh.points()[to], part), cube_min, cube_edge)
            });
            let mut key = corners;
            key.sort_unstable();
            Some((key, crossed))
        };
        let of_tet = |tet: &[u32; 4]| {
            let above = tet.iter().filter(|&&corner| heights[corner as usize] >= 0.0).count();
            let faces = if above % 4 == 0 { [].iter() } else { FACES.iter() };
            faces.filter_map(|face| of_face(face.map(|corner| tet[corner]))).collect::<Vec<_>>()
        };
        let mut found: Vec<([u32; 3], [Vec3; 2])> = mesh.tets().par_iter().flat_map_iter(of_tet).collect();
        found.par_sort_unstable_by_key(|(face, _)| *face);
        found.dedup_by_key(|(face, _)| *face);
        Cut { lines: found.into_iter().map(|(_, line)| line).collect(), bvh: OnceLock::new() }
    }

    /// The lines.
    pub fn lines(&self) -> &[[Vec3; 2]] {
        &self.lines
    }

    /// How far a place is from the nearest line, if that is at most `reach`, in the cube's edges.
    pub fn distance(&self, at: Vec3, reach: f32) -> Option<f32> {
        if self.lines.is_empty() {
            return None;
        }
        let bvh = self.bvh.get_or_init(|| {
            let boxes = self.lines.iter().map(|[a, b]| Aabb { min: a.min(*b).into(), max: a.max(*b).into() });
            build_bvh2(&boxes.collect::<Vec<_>>(), BvhBuildParams::fast_build(), &mut Duration::default())
        });
        let mut nearest = f32::INFINITY;
        let around = Aabb { min: (at - reach).into(), max: (at + reach).into() };
        bvh.aabb_traverse(around, |bvh, node| {
            let node = &bvh.nodes[node as usize];
            for i in node.first_index..node.first_index + node.prim_count {
                let [a, b] = self.lines[bvh.primitive_indices[i as usize] as usize];
                nearest = nearest.min(distance_to_line(at, a, b));
            }
            true
        });
        Some(nearest).filter(|distance| *distance <= reach)
    }
}

/// How far a place is from a line's nearest point.
fn distance_to_line(at: Vec3, a: Vec3, b: Vec3) -> f32 {
    let along = b - a;
    let squared = along.length_squared();
    let part = if squared > 0.0 { ((at - a).dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (at - (a + along * part)).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshParts;

    #[test]
    fn a_tet_is_cut_in_three_lines_or_four() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mesh = TetMesh::new(MeshParts { points, tets: vec![[0, 1, 2, 3]], ..MeshParts::default() }).expect("valid");
        let (cube_min, cube_edge) = mesh.root_cube();
        let cut = |point: DVec3, normal: DVec3, edges: bool| {
            let plane = Plane { point: point - mesh.center(), normal, used: PlaneUse::Cut { opacity: 1.0, edges } };
            CutEdges::new(&mesh, Planes::new(&[plane]).expect("valid"))
        };
        let lengths = |cut: &CutEdges| {
            let mut lengths: Vec<f64> = cut.cuts()[0].lines().iter().map(|[a, b]| f64::from((*a - *b).length()) * cube_edge).collect();
            lengths.sort_by(f64::total_cmp);
            lengths
        };
        let near = |found: Vec<f64>, expected: &[f64]| {
            assert!(found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        };
        near(lengths(&cut(DVec3::Z * 0.5, DVec3::Z, true)), &[0.5, 0.5, 0.5f64.sqrt()]);
        // Between the edges 0-1 and 2-3.
        let middle = cut(DVec3::new(0.25, 0.25, 0.25), DVec3::new(0.0, 1.0, 1.0), true);
        near(lengths(&middle), &[0.5, 0.5, 0.5f64.sqrt(), 0.5f64.sqrt()]);
        near(lengths(&cut(DVec3::Z * 2.0, DVec3::Z, true)), &[]);
        near(lengths(&cut(DVec3::Z * 0.5, DVec3::Z, false)), &[]);
        // How far places are from it.
        let flat = cut(DVec3::Z * 0.5, DVec3::Z, true);
        let place = |x: f64, y: f64| cube_position(DVec3::new(x, y, 0.5) - mesh.center(), cube_min, cube_edge);
        let reach = 0.2 / cube_edge as f32;
        let found = flat.cuts()[0].distance(place(0.1, 0.15), reach).map(|d| f64::from(d) * cube_edge);
        assert!(found.is_some_and(|d| (d - 0.1).abs() < 1e-6), "{found:?}");
        assert_eq!(flat.cuts()[0].distance(place(1.0, 1.0), reach), None);
        // Planes that clip do not matter to it, those that are drawn do.
        let planes: Vec<Plane> = flat.planes.iter().collect();
        let clip = Plane { used: PlaneUse::Clip, ..planes[0] };
        assert!(flat.are_on(&Planes::new(&[clip, planes[0]]).expect("valid")));
        assert!(!flat.are_on(&Planes::new(&[Plane { point: DVec3::ZERO, ..planes[0] }]).expect("valid")) && !flat.are_on(&Planes::NONE));
    }
}
