//! [`Surface`]: what distances are measured between.

use crate::geometry::{Aabb, FACES};
use crate::mesh::{CellType, TetMesh, UnstructuredGrid, adjacency, triangulate_face};
use glam::DVec3;
use rayon::prelude::*;

/// Triangles: the boundary of a mesh, or the faces of a file of surfaces.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Points of triangles, relative to `origin`.
    pub points: Vec<DVec3>,
    /// The world position that points are relative to.
    pub origin: DVec3,
    /// The index of each point in the mesh or file.
    pub point_ids: Vec<u32>,
    /// Indices of the corners of each triangle, of a mesh such that the normal `(b - a) x (c - a)` points out of it.
    pub triangles: Vec<[u32; 3]>,
    /// The tet or the cell of the file that each triangle is of.
    pub cells: Vec<u32>,
}

/// Why cells make no surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// There are no faces.
    #[error("it has no faces, expected triangles, quads or polygons")]
    NoFaces,
    /// A face names a point that does not exist.
    #[error("cell {cell} names point {index}, there are {points} points")]
    PointIndex {
        /// The cell, from 0.
        cell: usize,
        /// The point.
        index: u32,
        /// How many there are.
        points: usize,
    },
    /// A point of a face is not finite.
    #[error("point {index} is {point}, expected finite coordinates")]
    NonFinitePoint {
        /// The point.
        index: u32,
        /// What it is.
        point: DVec3,
    },
}

/// What a surface is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFigures {
    /// The sum of the triangles' areas.
    pub area: f64,
    /// The volume inside, by the triangles' senses; `None` unless every edge is of two triangles.
    pub volume: Option<f64>,
    /// Edges of one triangle only.
    pub open_edges: u64,
    /// Edges of three triangles or more.
    pub crowded_edges: u64,
    /// Parts that have no point in common.
    pub components: u64,
}

impl Surface {
    /// The boundary of a mesh: faces of one tet only, or that tets do not have on their two sides. Relative to the mesh's centre.
    pub fn of_mesh(mesh: &TetMesh) -> Self {
        let (tets, mut faces) = adjacency::link(mesh.tets(), |_| true);
        faces.par_sort_unstable();
        let corners = |&(tet, face): &(u32, u8)| FACES[usize::from(face)].map(|corner| tets[tet as usize].corners[corner]);
        // Faces of flat tets that close on nothing have no area, and no distance of their own.
        let has_area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| mesh.points()[i as usize]);
            (b - a).cross(c - a) != DVec3::ZERO
        };
        let kept: Vec<([u32; 3], u32)> =
            faces.par_iter().map(|face| (corners(face), face.0)).filter(|(corners, _)| has_area(corners)).collect();
        let (triangles, cells): (Vec<_>, Vec<_>) = kept.into_iter().unzip();
        Self::compact(mesh.points(), DVec3::ZERO, mesh.center(), triangles, cells)
    }

    /// The faces of a file, quads and polygons cut into triangles. Relative to the centre of the bounds of their points.
    pub fn of_grid(grid: &UnstructuredGrid) -> Result<Self, SurfaceError> {
        let (mut triangles, mut cells) = (Vec::new(), Vec::new());
        for (cell, (cell_type, corners)) in grid.cells.iter().enumerate() {
            if cell_type.dimension() != Some(2) {
                continue;
            }
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= grid.points.len()) {
                return Err(SurfaceError::PointIndex { cell, index, points: grid.points.len() });
            }
            if let Some(&index) = corners.iter().find(|&&i| !grid.points[i as usize].is_finite()) {
                return Err(SurfaceError::NonFinitePoint { index, point: grid.points[index as usize] });
            }
            cut(cell_type, corners, &grid.points, &mut triangles);
            cells.resize(triangles.len(), cell as u32);
        }
        if triangles.is_empty() {
            return Err(SurfaceError::NoFaces);
        }
        let used = triangles.iter().flatten().map(|&i| grid.points[i as usize]);
        let origin = Aabb::of_points(used).center();
        Ok(Self::compact(&grid.points, origin, origin, triangles, cells))
    }

    /// Keeps the points that triangles have, moved by `-shift`.
    fn compact(points: &[DVec3], shift: DVec3, origin: DVec3, mut triangles: Vec<[u32; 3]>, cells: Vec<u32>) -> Self {
        let mut point_ids: Vec<u32> = triangles.as_flattened().to_vec();
        point_ids.par_sort_unstable();
        point_ids.dedup();
        let mut number = vec![0u32; points.len()];
        (0..).zip(&point_ids).for_each(|(i, &point)| number[point as usize] = i);
        triangles.par_iter_mut().for_each(|corners| *corners = corners.map(|i| number[i as usize]));
        let points = point_ids.iter().map(|&i| points[i as usize] - shift).collect();
        Surface { points, origin, point_ids, triangles, cells }
    }

    /// The same with points relative to another origin.
    pub fn relative_to(mut self, origin: DVec3) -> Self {
        let shift = self.origin - origin;
        self.points.iter_mut().for_each(|p| *p += shift);
        Surface { origin, ..self }
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle];
        [self.points[a as usize], self.points[b as usize], self.points[c as usize]]
    }

    /// Bounds of the points, relative to the origin.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.points.iter().copied())
    }

    /// The area of a triangle.
    pub fn area_of(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() / 2.0
    }

    /// Area, volume, edges, parts.
    pub fn figures(&self) -> SurfaceFigures {
        let mut edges: Vec<u64> = self
            .triangles
            .par_iter()
            .flat_map_iter(|&[a, b, c]| [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| u64::from(a.min(b)) << 32 | u64::from(a.max(b))))
            .collect();
        edges.par_sort_unstable();
        let count = |is: fn(usize) -> bool| edges.chunk_by(|a, b| a == b).filter(|run| is(run.len())).count() as u64;
        let (open_edges, crowded_edges) = (count(|n| n == 1), count(|n| n > 2));
        let volume = |t: usize| {
            let [a, b, c] = self.corners(t);
            a.dot(b.cross(c)) / 6.0
        };
        let count = self.triangles.len();
        SurfaceFigures {
            area: (0..count).map(|t| self.area_of(t)).sum(),
            volume: (open_edges + crowded_edges == 0).then(|| (0..count).map(volume).sum()),
            open_edges,
            crowded_edges,
            components: components(self.points.len(), self.triangles.iter().map(|t| &t[..])),
        }
    }
}

/// How many parts of cells have no point in common; points without a cell are none.
pub fn components<'a>(points: usize, cells: impl Iterator<Item = &'a [u32]>) -> u64 {
    let mut parents: Vec<u32> = (0..points as u32).collect();
    fn root(parents: &mut [u32], mut i: u32) -> u32 {
        while parents[i as usize] != i {
            parents[i as usize] = parents[parents[i as usize] as usize];
            i = parents[i as usize];
        }
        i
    }
    let mut used = vec![false; points];
    for cell in cells {
        used[cell[0] as usize] = true;
        let mut first = root(&mut parents, cell[0]);
        for &point in &cell[1..] {
            used[point as usize] = true;
            let other = root(&mut parents, point);
            let (low, high) = (first.min(other), first.max(other));
            parents[high as usize] = low;
            first = low;
        }
    }
    (0..points).filter(|&i| used[i] && parents[i] as usize == i).count() as u64
}

/// Cuts a cell with an area into triangles; of one with points in the middle of edges the corners count.
fn cut(cell_type: CellType, points: &[u32], at: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    match (cell_type, points.len()) {
        (CellType::TRIANGLE_STRIP, n) => {
            triangles.extend(
                (2..n).map(
                    |i| if i % 2 == 0 { [points[i - 2], points[i - 1], points[i]] } else { [points[i - 1], points[i - 2], points[i]] },
                ),
            );
        }
        (CellType::PIXEL, 4) => triangulate_face(at, &[points[0], points[1], points[3], points[2]], triangles),
        (CellType::QUADRATIC_TRIANGLE | CellType::BIQUADRATIC_TRIANGLE, 6..) => {
            let p = |i: usize| points[i];
            triangles.extend([[p(0), p(3), p(5)], [p(3), p(1), p(4)], [p(5), p(4), p(2)], [p(3), p(4), p(5)]]);
        }
        (CellType::QUADRATIC_QUAD | CellType::BIQUADRATIC_QUAD, 8..) => {
            triangulate_face(at, &[0, 4, 1, 5, 2, 6, 3, 7].map(|i| points[i]), triangles);
        }
        // A quadratic-linear quad has nodes 4 and 5 on its edges 01 and 23, a quadratic polygon those of its edges behind its corners.
        (CellType(30), 6) => triangulate_face(at, &[0, 4, 1, 2, 5, 3].map(|i| points[i]), triangles),
        (CellType(36), n) if n >= 6 && n % 2 == 0 => {
            let around: Vec<u32> = (0..n).map(|i| points[i / 2 + i % 2 * (n / 2)]).collect();
            triangulate_face(at, &around, triangles);
        }
        // Of higher orders the corners, which come first.
        (CellType::LAGRANGE_TRIANGLE | CellType(61 | 76), 3..) => triangles.push([points[0], points[1], points[2]]),
        (CellType::LAGRANGE_QUADRILATERAL | CellType(62 | 77), 4..) => triangulate_face(at, &points[..4], triangles),
        (_, 3..) => triangulate_face(at, points, triangles),
        _ => {}
    }
}
