//! Quadratic cells as linear ones between their nodes.
//!
//! A field that is quadratic along an edge of length L is met at both ends and in the middle; between, half an edge is off by an eighth of
//! the second difference `a - 2 m + b` at most. Nodes that a type lacks at the middle of a face or cell are those of the serendipity element.

use super::Splitter;
use crate::geometry::Aabb;
use crate::mesh::{CellType, Cells, DataArray};
use glam::DVec3;
use rayon::prelude::*;

/// Corners of the hexahedron's faces, in the order of the 27-node cell's face nodes 20 to 25: -x, +x, -y, +y, -z, +z; with the edge nodes.
const HEX_FACES: [([usize; 4], [usize; 4]); 6] = [
    ([0, 3, 7, 4], [11, 19, 15, 16]),
    ([1, 2, 6, 5], [9, 18, 13, 17]),
    ([0, 1, 5, 4], [8, 17, 12, 16]),
    ([3, 2, 6, 7], [10, 18, 14, 19]),
    ([0, 1, 2, 3], [8, 9, 10, 11]),
    ([4, 5, 6, 7], [12, 13, 14, 15]),
];

/// The nodes of the 27-node hexahedron by place, x fastest.
const HEX_LATTICE: [usize; 27] = [0, 8, 1, 11, 24, 9, 3, 10, 2, 16, 22, 17, 20, 26, 21, 19, 23, 18, 4, 12, 5, 15, 25, 13, 7, 14, 6];

/// The corners of each edge, whose middle is node `corners + i`.
fn edges(cell_type: CellType, nodes: usize) -> (usize, &'static [[usize; 2]]) {
    match cell_type {
        CellType::QUADRATIC_TETRA => (4, &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]),
        CellType::LAGRANGE_TETRAHEDRON if nodes == 10 => edges(CellType::QUADRATIC_TETRA, nodes),
        CellType::QUADRATIC_PYRAMID | CellType::TRIQUADRATIC_PYRAMID => {
            (5, &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]])
        }
        CellType::QUADRATIC_WEDGE | CellType::BIQUADRATIC_QUADRATIC_WEDGE => {
            (6, &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]])
        }
        CellType::QUADRATIC_HEXAHEDRON | CellType::BIQUADRATIC_QUADRATIC_HEXAHEDRON | CellType::TRIQUADRATIC_HEXAHEDRON => {
            (8, &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
        }
        _ => (0, &[]),
    }
}

/// How far the tets between the nodes of quadratic cells are from the cells, along their edges: an eighth of the second differences. In
/// words, `None` if no cell is quadratic.
pub(super) fn deviation(points: &[DVec3], cells: &Cells, point_data: &[DataArray]) -> Option<String> {
    // The two corners and the middle of every edge.
    let of_cell = |cell: usize| {
        let (cell_type, nodes) = cells.get(cell);
        let (corners, edges) = edges(cell_type, nodes.len());
        edges.iter().enumerate().map(move |(i, &[a, b])| [nodes[a], nodes[corners + i], nodes[b]].map(|node| node as usize))
    };
    let largest = |second: &(dyn Fn([usize; 3]) -> f64 + Sync)| {
        (0..cells.len()).into_par_iter().flat_map_iter(of_cell).map(second).reduce(|| -1.0, f64::max) / 8.0
    };
    let bend = largest(&|[a, m, b]| (points[a] - 2.0 * points[m] + points[b]).length());
    if bend < 0.0 {
        return None;
    }
    let diagonal = Aabb::of_points(points.iter().copied()).diagonal();
    let of_array = |array: &DataArray| {
        let values = |component: usize| (0..array.tuples()).map(move |i| array.values.get(i * array.components + component));
        let of_component = |component: usize| {
            let (lo, hi) =
                values(component).filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
            let value = |i: usize| array.values.get(i * array.components + component);
            let second =
                |[a, m, b]: [usize; 3]| Some((value(a) - 2.0 * value(m) + value(b)).abs()).filter(|v| v.is_finite()).unwrap_or(0.0);
            if hi > lo { largest(&second) / (hi - lo) } else { 0.0 }
        };
        (0..array.components).map(of_component).fold(0.0, f64::max)
    };
    let percent = |part: f64| format!("{:.2} %", part * 100.0);
    let worst = point_data.iter().map(|array| (of_array(array), &array.name)).max_by(|a, b| a.0.total_cmp(&b.0));
    let values = worst.map_or(String::new(), |(part, name)| format!(", and values within {} of the range of \"{name}\"", percent(part)));
    let place = if diagonal > 0.0 { bend / diagonal } else { 0.0 };
    Some(format!("quadratic cells are cut at their nodes: along edges places are within {} of the diagonal{values}", percent(place)))
}

impl Splitter {
    /// Eight tets: four at the corners, four in the octahedron between, about its shortest diagonal.
    pub(super) fn quadratic_tetra(&mut self, n: &[u32]) {
        let (e01, e12, e20, e03, e13, e23) = (n[4], n[5], n[6], n[7], n[8], n[9]);
        self.tets.extend([[n[0], e01, e20, e03], [e01, n[1], e12, e13], [e20, e12, n[2], e23], [e03, e13, e23, n[3]]]);
        // Each diagonal with the ring around it, in the sense that makes positive tets.
        let diagonals = [(e01, e23, [e20, e03, e13, e12]), (e12, e03, [e01, e13, e23, e20]), (e20, e13, [e12, e23, e03, e01])];
        let length = |&(a, b, _): &(u32, u32, [u32; 4])| self.points[a as usize].distance_squared(self.points[b as usize]);
        let shortest = diagonals.iter().min_by(|a, b| length(a).total_cmp(&length(b)));
        if let Some(&(a, b, ring)) = shortest {
            self.tets.extend((0..4).map(|i| [a, b, ring[i], ring[(i + 1) % 4]]));
        }
    }

    /// Six pyramids and four tets.
    pub(super) fn quadratic_pyramid(&mut self, n: &[u32]) {
        let base = match n.get(13) {
            Some(&centre) => centre,
            None => self.face_centre([n[0], n[1], n[2], n[3]], [n[5], n[6], n[7], n[8]]),
        };
        let (edge, rise) = (|i: usize| n[5 + i % 4], |i: usize| n[9 + i % 4]);
        for i in 0..4 {
            self.pyramid([n[i], edge(i), base, edge(i + 3), rise(i)]);
            self.tets.push([edge(i), base, rise(i), rise(i + 1)]);
        }
        self.pyramid([rise(0), rise(1), rise(2), rise(3), n[4]]);
        self.pyramid([rise(3), rise(2), rise(1), rise(0), base]);
    }

    /// Eight wedges.
    pub(super) fn quadratic_wedge(&mut self, n: &[u32]) {
        let sides = [([0, 1, 4, 3], [6, 13, 9, 12]), ([1, 2, 5, 4], [7, 14, 10, 13]), ([2, 0, 3, 5], [8, 12, 11, 14])];
        let mut centre = [0; 3];
        for (i, (corners, edges)) in sides.into_iter().enumerate() {
            centre[i] = match n.get(15 + i) {
                Some(&given) => given,
                None => self.face_centre(corners.map(|c| n[c]), edges.map(|e| n[e])),
            };
        }
        // Three layers of six nodes: the corners, then the middles of 01, 12, 20.
        let layers = [
            [n[0], n[1], n[2], n[6], n[7], n[8]],
            [n[12], n[13], n[14], centre[0], centre[1], centre[2]],
            [n[3], n[4], n[5], n[9], n[10], n[11]],
        ];
        for (low, high) in [(0, 1), (1, 2)] {
            for [a, b, c] in [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]] {
                let (low, high) = (layers[low], layers[high]);
                self.wedge([low[a], low[b], low[c], high[a], high[b], high[c]]);
            }
        }
    }

    /// Eight hexahedra, from 20, 24 or 27 nodes.
    pub(super) fn quadratic_hexahedron(&mut self, n: &[u32]) {
        let mut nodes = [0; 27];
        nodes[..n.len()].copy_from_slice(n);
        for (i, (corners, edges)) in HEX_FACES.into_iter().enumerate() {
            // The 24-node cell has the four faces at the sides: its numbers 20 to 23.
            if n.len() <= 20 + i {
                nodes[20 + i] = self.face_centre(corners.map(|c| n[c]), edges.map(|e| n[e]));
            }
        }
        if n.len() < 27 {
            let edges = n[8..20].iter().map(|&node| (node, 0.25));
            nodes[26] = self.make(n[..8].iter().map(|&node| (node, -0.25)).chain(edges));
        }
        let at = |x: usize, y: usize, z: usize| nodes[HEX_LATTICE[x + 3 * (y + 3 * z)]];
        let lower = |i: usize| (i & 1, i >> 1 & 1, i >> 2);
        let corner = |(x, y, z): (usize, usize, usize)| {
            [
                at(x, y, z),
                at(x + 1, y, z),
                at(x + 1, y + 1, z),
                at(x, y + 1, z),
                at(x, y, z + 1),
                at(x + 1, y, z + 1),
                at(x + 1, y + 1, z + 1),
                at(x, y + 1, z + 1),
            ]
        };
        for hexahedron in std::array::from_fn::<_, 8, _>(|i| corner(lower(i))) {
            self.hexahedron(hexahedron);
        }
    }

    /// The middle of a face with four corners, the same point for both its cells.
    fn face_centre(&mut self, corners: [u32; 4], edges: [u32; 4]) -> u32 {
        let mut key = corners;
        key.sort_unstable();
        if let Some(&made) = self.face_centres.get(&key) {
            return made;
        }
        let nodes = corners.map(|node| (node, -0.25)).into_iter().chain(edges.map(|node| (node, 0.5)));
        let made = self.make(nodes);
        self.face_centres.insert(key, made);
        made
    }
}
