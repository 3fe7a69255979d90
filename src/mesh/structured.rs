//! Curvilinear grids as tets: blocks of points in rows, columns and layers whose cells are hexahedra, five tets each.

use super::to_tets::{gathered, without_unused};
use super::{CellType, DataArray, FileCells, MeshError, MeshParts};
use crate::geometry;
use glam::DVec3;
use rayon::prelude::*;

/// The tets of a cell whose place along the three axes sums to an even number. Corner `i + 2 j + 4 k` lies at the upper end of the axes
/// that it counts.
const EVEN: [[usize; 4]; 5] = [[0, 1, 2, 4], [1, 3, 2, 7], [1, 7, 4, 5], [2, 4, 7, 6], [1, 2, 4, 7]];

/// The tets of the others, the mirror image: so the diagonals of a face are one, seen from the two cells that share it.
const ODD: [[usize; 4]; 5] = [[1, 3, 0, 5], [0, 3, 2, 6], [0, 5, 6, 4], [3, 6, 5, 7], [0, 3, 6, 5]];

/// A block of a curvilinear grid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructuredBlock {
    /// Points along each axis, the first fastest. With fewer than 2 along one it has no cells.
    pub dims: [usize; 3],
    /// Whether the first cell is split as one whose place along the axes sums to an odd number: set so that blocks that were cut from one have
    /// the same diagonals where they meet.
    pub starts_odd: bool,
    /// Whether a point does not count, one a point or none at all: cells with such a corner are left out.
    pub blanked: Vec<bool>,
    /// Whether a cell does not count, one a cell or none at all.
    pub blanked_cells: Vec<bool>,
}

impl StructuredBlock {
    /// A block of which all counts.
    pub fn new(dims: [usize; 3]) -> Self {
        StructuredBlock { dims, starts_odd: false, blanked: vec![], blanked_cells: vec![] }
    }

    /// How many points it has.
    pub fn points(&self) -> usize {
        self.dims.iter().product()
    }

    /// How many cells it has, blanked ones counted.
    pub fn cell_count(&self) -> usize {
        self.cells().iter().product()
    }

    /// The corners of its cells in VTK's order, and their numbers, without blanked ones; `first` is the index of its first point.
    pub fn hexahedra(&self, first: u32) -> impl Iterator<Item = ([u32; 8], u32)> {
        let ([nx, ny, _], [cx, cy, _]) = (self.dims, self.cells());
        (0..self.cell_count()).filter_map(move |cell| {
            let [i, j, k] = [cell % cx, cell / cx % cy, cell / (cx * cy)];
            let at = |x: usize, y: usize, z: usize| i + x + nx * (j + y + ny * (k + z));
            let corners = [at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)];
            let is_blanked = corners.iter().any(|&c| self.blanked.get(c) == Some(&true)) || self.blanked_cells.get(cell) == Some(&true);
            (!is_blanked).then(|| (corners.map(|corner| first + corner as u32), cell as u32))
        })
    }

    /// Cells along each axis.
    fn cells(&self) -> [usize; 3] {
        self.dims.map(|n| n.saturating_sub(1))
    }

    /// The tets, and the number of the cell that each is of. `points` are the block's own, `first` is the index of the first of them.
    ///
    /// Grids may be right- or left-handed: if most of the volume comes out negative, all tets are turned. What is still negative is folded.
    fn tets(&self, points: &[DVec3], first: u32) -> Vec<([u32; 4], u32)> {
        let ([nx, ny, _], [cx, cy, cz]) = (self.dims, self.cells());
        let layer = |k: usize| {
            let mut tets = Vec::with_capacity(5 * cx * cy);
            for (j, i) in (0..cy).flat_map(|j| (0..cx).map(move |i| (j, i))) {
                let corners: [usize; 8] = std::array::from_fn(|c| i + (c & 1) + nx * (j + (c >> 1 & 1) + ny * (k + (c >> 2))));
                let cell = i + cx * (j + cy * k);
                let is_blanked = corners.iter().any(|&c| self.blanked.get(c) == Some(&true)) || self.blanked_cells.get(cell) == Some(&true);
                if !is_blanked {
                    let split = if (i + j + k + usize::from(self.starts_odd)).is_multiple_of(2) { &EVEN } else { &ODD };
                    tets.extend(split.iter().map(|tet| (tet.map(|c| first + corners[c] as u32), cell as u32)));
                }
            }
            tets
        };
        let mut tets: Vec<([u32; 4], u32)> = (0..cz).into_par_iter().flat_map_iter(layer).collect();
        let volume = |(tet, _): &([u32; 4], u32)| geometry::signed_volume(&tet.map(|i| points[(i - first) as usize]));
        if tets.par_iter().map(volume).sum::<f64>() < 0.0 {
            tets.par_iter_mut().for_each(|(tet, _)| tet.swap(2, 3));
        }
        tets
    }
}

/// A mesh of all blocks: each hexahedron becomes five tets, those of neighbours in a block share their faces whole. Points that no tet uses
/// are left out, with their values. Blocks are not joined to each other: where two meet, each has points of its own.
///
/// `points` are those of all blocks, one behind the other, as are the tuples of the `point_data`; `cell_data` have one a hexahedron. More
/// points than can be indexed are an error.
pub fn split_into_tets(
    blocks: &[StructuredBlock],
    points: Vec<DVec3>,
    point_data: Vec<DataArray>,
    cell_data: Vec<DataArray>,
    active_scalars: Option<String>,
) -> Result<MeshParts, MeshError> {
    if points.len() >= u32::MAX as usize {
        return Err(MeshError::TooMany { what: "points", count: points.len() });
    }
    let (mut tets, mut cells, mut first, mut first_cell) = (Vec::new(), Vec::new(), 0usize, 0usize);
    for block in blocks {
        let end = first + block.points();
        for (tet, cell) in block.tets(&points[first..end], first as u32) {
            tets.push(tet);
            cells.push((first_cell + cell as usize) as u32);
        }
        (first, first_cell) = (end, first_cell + block.cells().iter().product::<usize>());
    }
    let cell_data = cell_data.into_iter().map(|array| gathered(array, &cells)).collect();
    let tets_per_cell = EVEN.len();
    let numbers = if tets.len() == tets_per_cell * first_cell { vec![] } else { cells };
    let file_cells = FileCells { shape: CellType::HEXAHEDRON, tets_per_cell, numbers, types: vec![] };
    Ok(without_unused(MeshParts { points, tets, point_data, cell_data, active_scalars, file_cells, notes: vec![] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TetMesh, Values};
    use std::collections::HashMap;

    /// Points of a block, placed by a map of their indices.
    fn points([nx, ny, nz]: [usize; 3], place: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let at = |i: usize| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
        (0..nx * ny * nz).map(|i| place(at(i))).collect()
    }

    fn split(block: StructuredBlock, place: impl Fn(DVec3) -> DVec3) -> MeshParts {
        let points = points(block.dims, place);
        split_into_tets(&[block], points, vec![], vec![], None).expect("few points")
    }

    fn volume(parts: &MeshParts) -> f64 {
        parts.tets.iter().map(|tet| geometry::signed_volume(&tet.map(|i| parts.points[i as usize]))).sum()
    }

    /// How many faces have one tet, and how many two; more is not allowed.
    fn faces(tets: &[[u32; 4]]) -> [usize; 2] {
        let mut uses: HashMap<[u32; 3], usize> = HashMap::new();
        for tet in tets {
            for face in geometry::FACES {
                let mut key = face.map(|c| tet[c]);
                key.sort_unstable();
                *uses.entry(key).or_default() += 1;
            }
        }
        let count = |n: usize| uses.values().filter(|&&uses| uses == n).count();
        assert_eq!(count(1) + count(2), uses.len(), "a face of more than two tets");
        [count(1), count(2)]
    }

    #[test]
    fn neighbours_share_their_faces_and_volumes_sum_up() {
        let dims = [4, 3, 5];
        // Sheared and stretched: a parallelepiped's volume is its determinant's.
        let affine = |p: DVec3| DVec3::new(2.0 * p.x + 0.5 * p.y, p.y - 0.25 * p.z, 0.5 * p.z) + 7.0;
        let mirrored = |p: DVec3| affine(p) * DVec3::new(1.0, -1.0, 1.0);
        for parts in [split(StructuredBlock::new(dims), affine), split(StructuredBlock::new(dims), mirrored)] {
            assert_eq!((parts.points.len(), parts.tets.len()), (60, 5 * 3 * 2 * 4));
            // Each side of a boundary hexahedron is two triangles: 2 (3 2 + 2 4 + 3 4) of them.
            assert_eq!(faces(&parts.tets), [2 * 2 * 26, (5 * 4 * 24 - 2 * 2 * 26) / 2]);
            assert!((volume(&parts) - 24.0).abs() < 1e-12, "{}", volume(&parts));
            let mesh = TetMesh::new(parts).expect("valid");
            assert_eq!((mesh.inverted_count(), mesh.zero_volume_count()), (0, 0), "whatever hand the grid has");
        }
    }

    #[test]
    fn a_collapsed_axis_leaves_flat_tets_and_all_of_the_volume() {
        // A cylinder's wedge of 3 x 5 x 4 points, its axis all of the first row of points: cells there are prisms.
        let angle = 0.2f64;
        let wedge = |p: DVec3| {
            let (r, a) = (p.x, p.y * angle);
            DVec3::new(r * a.cos(), r * a.sin(), p.z)
        };
        let parts = split(StructuredBlock::new([3, 5, 4]), wedge);
        // Each of the 4 sectors is a triangle of sides 2 with the angle between, 3 high; chords make it exact.
        let exact = 4.0 * 3.0 * 0.5 * 2.0 * 2.0 * angle.sin();
        assert!((volume(&parts) - exact).abs() < 1e-12, "{} of {exact}", volume(&parts));
        let mesh = TetMesh::new(parts).expect("valid");
        assert_eq!(mesh.inverted_count(), 0);
        assert!(mesh.zero_volume_count() > 0 && mesh.zero_volume_count() <= 2 * 12, "{}", mesh.zero_volume_count());
    }

    #[test]
    fn blanked_points_and_cells_take_their_own_with_them() {
        let mut block = StructuredBlock::new([4, 3, 3]);
        block.blanked = vec![false; 36];
        block.blanked[0] = true; // a corner: one cell, and no other point
        let values = DataArray { name: "n".into(), components: 1, values: Values::F32((0..36).map(|i| i as f32).collect()) };
        let cells = DataArray { name: "c".into(), components: 2, values: Values::F64((0..24).map(f64::from).collect()) };
        let parts = split_into_tets(&[block.clone()], points(block.dims, |p| p), vec![values], vec![cells], None).expect("few points");
        assert_eq!((parts.points.len(), parts.tets.len()), (35, 5 * 11));
        assert_eq!(parts.point_data[0].values.get(0), 1.0, "values go with their points");
        assert!(parts.points.iter().enumerate().all(|(i, p)| p.x + 4.0 * (p.y + 3.0 * p.z) == parts.point_data[0].values.get(i)));
        assert_eq!((parts.cell_data[0].tuples(), parts.cell_data[0].values.get(1)), (55, 3.0), "and with their cells");
        assert_eq!([0, 4, 5, 54].map(|tet| parts.file_cells.number(tet)), [1, 1, 2, 11], "the first was left out");
        block.blanked_cells = vec![true; 12];
        block.blanked_cells[7] = false;
        let one = split(block, |p| p);
        assert_eq!((one.tets.len(), one.points.len(), one.file_cells.number(3)), (5, 8, 7));
    }

    #[test]
    fn blocks_stand_beside_each_other() {
        let blocks = [StructuredBlock::new([2, 2, 2]), StructuredBlock::new([3, 1, 2]), StructuredBlock::new([2, 2, 3])];
        let points = [points([2, 2, 2], |p| p), points([3, 1, 2], |p| p), points([2, 2, 3], |p| p + 9.0)].concat();
        let parts = split_into_tets(&blocks, points, vec![], vec![], None).expect("few points");
        assert_eq!((parts.points.len(), parts.tets.len()), (20, 15), "a sheet has no cells, its points are not used");
        assert!((volume(&parts) - 3.0).abs() < 1e-12);
        assert!(parts.file_cells.numbers.is_empty() && parts.file_cells.number(14) == 2, "numbers that follow each other are not kept");
    }
}
