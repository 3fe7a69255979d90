//! Cells with flat or nearly flat faces: tets between one point and the triangles of the faces.

use super::{Splitter, face};
use crate::geometry;
use crate::mesh::{CellType, MeshError};
use glam::DVec3;

/// Faces of a cell by the numbers of its corners, each so that its normal points out.
pub(super) type Faces = &'static [&'static [u8]];

const HEXAHEDRON: Faces = &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
const WEDGE: Faces = &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const PYRAMID: Faces = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const TETRA: Faces = &[&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]];
const PENTAGONAL_PRISM: Faces =
    &[&[0, 4, 3, 2, 1], &[5, 6, 7, 8, 9], &[0, 1, 6, 5], &[1, 2, 7, 6], &[2, 3, 8, 7], &[3, 4, 9, 8], &[4, 0, 5, 9]];
const HEXAGONAL_PRISM: Faces = &[
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// How many of a cell's nodes are its corners, which come first, and its faces by them; `None` for types whose faces are not known.
pub(super) fn corners(cell_type: CellType, nodes: usize) -> Option<(usize, Faces)> {
    let (corners, faces) = match cell_type {
        CellType::VOXEL | CellType::HEXAHEDRON | CellType::LAGRANGE_HEXAHEDRON => (8, HEXAHEDRON),
        CellType::WEDGE | CellType::QUADRATIC_LINEAR_WEDGE | CellType::LAGRANGE_WEDGE => (6, WEDGE),
        CellType::PYRAMID | CellType::LAGRANGE_PYRAMID => (5, PYRAMID),
        CellType::LAGRANGE_TETRAHEDRON => (4, TETRA),
        CellType::PENTAGONAL_PRISM => (10, PENTAGONAL_PRISM),
        CellType::HEXAGONAL_PRISM => (12, HEXAGONAL_PRISM),
        CellType(64 | 78) => (4, TETRA), // of higher order, Bezier
        CellType(65 | 80) => (6, WEDGE),
        CellType(66 | 81) => (5, PYRAMID),
        CellType(67 | 79) => (8, HEXAHEDRON),
        _ => return None,
    };
    (nodes >= corners).then_some((corners, faces))
}

/// What is allocated once.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// The faces' nodes, one behind the other, and where they end.
    nodes: Vec<u32>,
    ends: Vec<usize>,
    /// The faces' triangles, and where those of each face end.
    triangles: Vec<[u32; 3]>,
    triangle_ends: Vec<usize>,
    tets: Vec<[u32; 4]>,
}

impl Splitter {
    /// A hexahedron of these corners.
    pub(super) fn hexahedron(&mut self, corners: [u32; 8]) {
        self.linear(&corners, HEXAHEDRON);
    }

    /// A wedge of these corners.
    pub(super) fn wedge(&mut self, corners: [u32; 6]) {
        self.linear(&corners, WEDGE);
    }

    /// A pyramid of these corners.
    pub(super) fn pyramid(&mut self, corners: [u32; 5]) {
        self.linear(&corners, PYRAMID);
    }

    /// A cell with linear edges.
    pub(super) fn linear(&mut self, corners: &[u32], faces: Faces) {
        self.scratch.nodes.clear();
        self.scratch.ends.clear();
        for face in faces {
            self.scratch.nodes.extend(face.iter().map(|&corner| corners[usize::from(corner)]));
            self.scratch.ends.push(self.scratch.nodes.len());
        }
        self.cone();
    }

    /// A polyhedron by its faces: how many, then of each how many points and which.
    pub(super) fn polyhedron(&mut self, cell: usize, stream: &[u32]) -> Result<(), MeshError> {
        let broken = || MeshError::Polyhedron { cell };
        let (&faces, mut rest) = stream.split_first().ok_or_else(broken)?;
        self.scratch.nodes.clear();
        self.scratch.ends.clear();
        for _ in 0..faces {
            let (&count, behind) = rest.split_first().ok_or_else(broken)?;
            let (face, behind) = behind.split_at_checked(count as usize).ok_or_else(broken)?;
            let mut nodes = std::mem::take(&mut self.scratch.nodes);
            self.push_nodes(cell, face, &mut nodes)?;
            self.scratch.ends.push(nodes.len());
            self.scratch.nodes = nodes;
            rest = behind;
        }
        if !rest.is_empty() {
            return Err(broken());
        }
        let first = self.tets.len();
        self.open += u64::from(!self.orient());
        self.cone();
        // Faces of polyhedra may go round in either sense.
        let volume: f64 = self.tets[first..].iter().map(|tet| volume(&self.points, tet)).sum();
        if volume < 0.0 {
            self.tets[first..].iter_mut().for_each(|tet| tet.swap(2, 3));
        }
        self.cells.resize(self.tets.len(), (cell as u32, CellType::POLYHEDRON));
        Ok(())
    }

    /// Turns the faces so that neighbours go through their common edge in opposite senses; false if an edge has not two faces.
    fn orient(&mut self) -> bool {
        let Scratch { nodes, ends, .. } = &mut self.scratch;
        let faces = ends.len();
        let range = |face: usize| if face == 0 { 0..ends[0] } else { ends[face - 1]..ends[face] };
        // Edges as (lower node, higher node, face, whether the face goes from lower to higher).
        let mut edges: Vec<(u32, u32, usize, bool)> = Vec::with_capacity(nodes.len());
        for face in 0..faces {
            let ring = &nodes[range(face)];
            for i in 0..ring.len() {
                let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
                if a != b {
                    edges.push((a.min(b), a.max(b), face, a < b));
                }
            }
        }
        edges.sort_unstable();
        let mut is_closed = true;
        let mut neighbours: Vec<Vec<(usize, bool)>> = vec![vec![]; faces];
        for run in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if let [(_, _, first, up), (_, _, second, other_up)] = *run {
                neighbours[first].push((second, up == other_up));
                neighbours[second].push((first, up == other_up));
            } else {
                is_closed = false;
            }
        }
        let mut turned: Vec<Option<bool>> = vec![None; faces];
        for start in 0..faces {
            if turned[start].is_some() {
                continue;
            }
            turned[start] = Some(false);
            let mut todo = vec![start];
            while let Some(face) = todo.pop() {
                let own = turned[face].unwrap_or_default();
                for &(other, differs) in &neighbours[face] {
                    if turned[other].is_none() {
                        turned[other] = Some(own != differs);
                        todo.push(other);
                    }
                }
            }
        }
        for face in (0..faces).filter(|&face| turned[face] == Some(true)) {
            let range = range(face);
            nodes[range].reverse();
        }
        is_closed
    }

    /// The tets of the cell whose faces are in the scratch.
    fn cone(&mut self) {
        let Scratch { nodes, ends, triangles, triangle_ends, tets } = &mut self.scratch;
        let Some(&lowest) = nodes.iter().min() else { return };
        triangles.clear();
        triangle_ends.clear();
        let (mut start, mut is_fan) = (0, true);
        for &end in ends.iter() {
            let (ring, first) = (&nodes[start..end], triangles.len());
            face::triangulate(&self.points, ring, triangles);
            is_fan &= !ring.contains(&lowest) || triangles[first..].iter().all(|triangle| triangle.contains(&lowest));
            triangle_ends.push(triangles.len());
            start = end;
        }
        tets.clear();
        tets.extend(triangles.iter().filter(|triangle| !triangle.contains(&lowest)).map(|&[a, b, c]| [lowest, a, b, c]));
        let from_corner = folded(&self.points, tets);
        if is_fan && from_corner == 0.0 {
            self.tets.extend_from_slice(tets);
            return;
        }
        let mut corners = nodes.clone();
        corners.sort_unstable();
        corners.dedup();
        let weight = 1.0 / corners.len() as f64;
        let centre = corners.iter().map(|&node| self.points[node as usize] * weight).sum::<DVec3>();
        let seen = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|&i| self.points[i as usize]);
            geometry::signed_volume(&[centre, a, b, c])
        };
        let (_, folded) = signs(triangles.iter().map(seen));
        if is_fan && folded >= from_corner {
            self.tets.extend_from_slice(tets);
            return;
        }
        let triangles = std::mem::take(triangles);
        let centre = self.make(corners.iter().map(|&node| (node, weight)));
        self.tets.extend(triangles.iter().map(|&[a, b, c]| [centre, a, b, c]));
        self.scratch.triangles = triangles;
    }
}

fn volume(points: &[DVec3], tet: &[u32; 4]) -> f64 {
    geometry::signed_volume(&tet.map(|i| points[i as usize]))
}

/// Whether tets of a cell overlap others: they are not all of one sense.
pub(super) fn is_folded(points: &[DVec3], tets: &[[u32; 4]]) -> bool {
    folded(points, tets) > 0.0
}

/// How much of the volume of tets is of the other sign than their sum; 0 if that is rounding.
fn folded(points: &[DVec3], tets: &[[u32; 4]]) -> f64 {
    let (total, folded) = signs(tets.iter().map(|tet| volume(points, tet)));
    if folded <= 1e-9 * total.abs() { 0.0 } else { folded }
}

/// The sum of volumes, and how much of them has the other sign.
fn signs(volumes: impl Iterator<Item = f64>) -> (f64, f64) {
    let (up, down) = volumes.fold((0.0, 0.0), |(up, down), volume| (up + volume.max(0.0), down - volume.min(0.0)));
    (up - down, up.min(down))
}
