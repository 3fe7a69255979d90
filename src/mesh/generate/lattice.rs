//! A cube and a ball: a lattice of cells, each split into six tets around its diagonal (Kuhn), straight or blown up.

use crate::mesh::{ArrayLayout, LayeredMesh, Precision, Values};
use glam::DVec3;

/// A lattice of `cells` cells along each axis. Points run x first, then y, then z; a layer is a plane of points and the cells above it.
#[derive(Debug, Clone, Copy)]
pub struct Lattice {
    cells: u32,
    shape: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Cube,
    Ball,
}

/// The order of the axes along the six paths from a cell's lowest corner to its highest, and whether the tet along it is positive.
const PATHS: [([usize; 3], bool); 6] =
    [([0, 1, 2], true), ([1, 2, 0], true), ([2, 0, 1], true), ([0, 2, 1], false), ([2, 1, 0], false), ([1, 0, 2], false)];

impl Lattice {
    /// The unit cube, `6 cells^3` tets, with the point array `linear`, `(x + 2 y + 4 z) / 8`. `cells` is 1 at least.
    pub fn cube(cells: u32) -> Self {
        Lattice { cells: cells.max(1), shape: Shape::Cube }
    }

    /// The unit ball about the origin, `6 cells^3` tets, with the point array `radius`, the distance from the centre. `cells` is rounded up
    /// to an even number.
    ///
    /// The cube [-1, 1]^3 is blown up along rays from its centre, so that squares about the centre become spheres. The cells' diagonals
    /// point outwards in every octant: no tet then straddles the planes in which the cube's edges lie, where it would become flat.
    pub fn ball(cells: u32) -> Self {
        Lattice { cells: cells.max(2).next_multiple_of(2), shape: Shape::Ball }
    }

    /// How many tets a lattice of so many cells along each axis has.
    pub fn tets_of(cells: u32) -> u64 {
        6 * u64::from(cells).pow(3)
    }

    fn side(&self) -> u64 {
        u64::from(self.cells) + 1
    }

    /// The position of a lattice point in the straight cube: [0, 1]^3, or [-1, 1]^3 for the ball.
    fn straight(&self, x: u64, y: u64, z: u64) -> DVec3 {
        let at = |i: u64| match self.shape {
            Shape::Cube => i as f64 / f64::from(self.cells),
            Shape::Ball => (2 * i) as f64 / f64::from(self.cells) - 1.0,
        };
        DVec3::new(at(x), at(y), at(z))
    }

    /// The straight positions of a layer's points.
    fn layer(&self, layer: usize) -> impl Iterator<Item = DVec3> + '_ {
        let side = self.side();
        (0..side * side).map(move |i| self.straight(i % side, i / side, layer as u64))
    }

    /// The six tets of a cell. In the ball, paths start at the corner nearest to the centre.
    fn split_cell(&self, cell: [u64; 3]) -> [[u32; 4]; 6] {
        let mirrored = cell.map(|i| self.shape == Shape::Ball && i < u64::from(self.cells) / 2);
        let flips = mirrored.iter().filter(|&&m| m).count();
        let index = |p: [u64; 3]| ((p[2] * self.side() + p[1]) * self.side() + p[0]) as u32;
        PATHS.map(|(path, is_even)| {
            let mut corner = [0, 1, 2].map(|axis| cell[axis] + u64::from(mirrored[axis]));
            let mut tet = [index(corner); 4];
            for (step, axis) in path.into_iter().enumerate() {
                corner[axis] = cell[axis] + u64::from(!mirrored[axis]);
                tet[step + 1] = index(corner);
            }
            if is_even == (flips % 2 == 1) {
                tet.swap(2, 3);
            }
            tet
        })
    }
}

impl LayeredMesh for Lattice {
    fn point_count(&self) -> u64 {
        self.side().pow(3)
    }

    fn tet_count(&self) -> u64 {
        Self::tets_of(self.cells)
    }

    fn layer_count(&self) -> usize {
        self.side() as usize
    }

    fn position_precision(&self) -> Precision {
        Precision::F32
    }

    fn points(&self, layer: usize) -> Vec<DVec3> {
        match self.shape {
            Shape::Cube => self.layer(layer).collect(),
            // The largest coordinate becomes the radius.
            Shape::Ball => self.layer(layer).map(|p| p.normalize_or_zero() * p.abs().max_element()).collect(),
        }
    }

    fn tets(&self, layer: usize) -> Vec<[u32; 4]> {
        let (cells, z) = (u64::from(self.cells), layer as u64);
        let in_layer = if z < cells { cells * cells } else { 0 }; // above the last points are no cells
        (0..in_layer).flat_map(|i| self.split_cell([i % cells, i / cells, z])).collect()
    }

    fn point_arrays(&self) -> Vec<ArrayLayout> {
        let name = self.active_scalars().expect("a lattice has one array").to_owned();
        vec![ArrayLayout { name, components: 1, precision: Precision::F32 }]
    }

    fn point_values(&self, _array: usize, layer: usize) -> Values {
        let value = |p: DVec3| match self.shape {
            Shape::Cube => p.dot(DVec3::new(0.125, 0.25, 0.5)),
            Shape::Ball => p.abs().max_element(),
        };
        Values::F32(self.layer(layer).map(|p| value(p) as f32).collect())
    }

    fn active_scalars(&self) -> Option<&str> {
        Some(match self.shape {
            Shape::Cube => "linear",
            Shape::Ball => "radius",
        })
    }
}
