//! Gmsh's types of elements, and where their nodes stand in VTK's cells.

use super::lagrange;
use crate::mesh::CellType;

/// A type of elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ElementType {
    /// Gmsh's number.
    pub number: u8,
    /// How many nodes an element has.
    pub nodes: usize,
    /// The cell that it becomes.
    pub cell_type: CellType,
    /// Node `i` of the cell is node `order[i]` of the element; nodes of the element that are not in it are left out.
    pub order: Vec<u16>,
}

/// Node orders that differ from VTK's.
const TETRA_10: &[u16] = &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const HEXAHEDRON_20: &[u16] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15];
const HEXAHEDRON_27: &[u16] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26];
const WEDGE_15: &[u16] = &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11];
const WEDGE_18: &[u16] = &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16];
const PYRAMID_13: &[u16] = &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12];

impl ElementType {
    /// By Gmsh's number; `None` for numbers that it does not use and for polygons, polyhedra and other types without a fixed count of nodes.
    pub fn of(number: i64) -> Option<Self> {
        let number = u8::try_from(number).ok()?;
        let corners = |cell_type: CellType, nodes: usize| {
            Some(ElementType { number, nodes, cell_type, order: (0..cell_type.points()? as u16).collect() })
        };
        let ordered = |cell_type, nodes, order: &[u16]| Some(ElementType { number, nodes, cell_type, order: order.to_vec() });
        let whole = |cell_type, order: Vec<u16>| Some(ElementType { number, nodes: order.len(), cell_type, order });
        // Nodes of a complete triangle and pyramid of an order.
        let triangle = |n: usize| (n + 1) * (n + 2) / 2;
        let pyramid = |n: usize| (n + 1) * (n + 2) * (2 * n + 3) / 6;
        let n = usize::from(number);
        match number {
            1 => corners(CellType::LINE, 2),
            2 => corners(CellType::TRIANGLE, 3),
            3 => corners(CellType::QUAD, 4),
            4 => corners(CellType::TETRA, 4),
            5 => corners(CellType::HEXAHEDRON, 8),
            6 => corners(CellType::WEDGE, 6),
            7 => corners(CellType::PYRAMID, 5),
            8 => corners(CellType::QUADRATIC_EDGE, 3),
            9 => corners(CellType::QUADRATIC_TRIANGLE, 6),
            10 => corners(CellType::BIQUADRATIC_QUAD, 9),
            11 => ordered(CellType::QUADRATIC_TETRA, 10, TETRA_10),
            12 => ordered(CellType::TRIQUADRATIC_HEXAHEDRON, 27, HEXAHEDRON_27),
            13 => ordered(CellType::BIQUADRATIC_QUADRATIC_WEDGE, 18, WEDGE_18),
            14 => ordered(CellType::QUADRATIC_PYRAMID, 14, PYRAMID_13),
            15 => corners(CellType::VERTEX, 1),
            16 => corners(CellType::QUADRATIC_QUAD, 8),
            17 => ordered(CellType::QUADRATIC_HEXAHEDRON, 20, HEXAHEDRON_20),
            18 => ordered(CellType::QUADRATIC_WEDGE, 15, WEDGE_15),
            19 => ordered(CellType::QUADRATIC_PYRAMID, 13, PYRAMID_13),
            // Complete elements of a higher order.
            21 => whole(CellType::LAGRANGE_TRIANGLE, lagrange::triangle(3)),
            23 => whole(CellType::LAGRANGE_TRIANGLE, lagrange::triangle(4)),
            25 => whole(CellType::LAGRANGE_TRIANGLE, lagrange::triangle(5)),
            42..=46 => whole(CellType::LAGRANGE_TRIANGLE, lagrange::triangle(n - 36)),
            26..=28 => whole(CellType::LAGRANGE_CURVE, (0..u16::from(number) - 22).collect()),
            62..=66 => whole(CellType::LAGRANGE_CURVE, (0..u16::from(number) - 55).collect()),
            36..=38 => whole(CellType::LAGRANGE_QUADRILATERAL, lagrange::quad(n - 33)),
            47..=51 => whole(CellType::LAGRANGE_QUADRILATERAL, lagrange::quad(n - 41)),
            29..=31 => whole(CellType::LAGRANGE_TETRAHEDRON, lagrange::tetra(n - 26)),
            71..=75 => whole(CellType::LAGRANGE_TETRAHEDRON, lagrange::tetra(n - 65)),
            92..=98 => whole(CellType::LAGRANGE_HEXAHEDRON, lagrange::hexahedron(n - 89)),
            // Those of which only the corners are taken.
            90 => corners(CellType::WEDGE, 40),
            91 => corners(CellType::WEDGE, 75),
            106..=110 => corners(CellType::WEDGE, triangle(n - 101) * (n - 100)),
            118..=124 => corners(CellType::PYRAMID, pyramid(n - 115)),
            // Elements with nodes on their edges only.
            20 => corners(CellType::TRIANGLE, 9),
            22 => corners(CellType::TRIANGLE, 12),
            24 => corners(CellType::TRIANGLE, 15),
            32 => corners(CellType::TETRA, 22),
            33 => corners(CellType::TETRA, 28),
            39..=41 => corners(CellType::QUAD, 4 * (n - 36)),
            52..=56 => corners(CellType::TRIANGLE, 3 * (n - 46)),
            57..=61 => corners(CellType::QUAD, 4 * (n - 51)),
            79..=83 => corners(CellType::TETRA, 4 + 6 * (n - 74)),
            99..=105 => corners(CellType::HEXAHEDRON, 8 + 12 * (n - 97)),
            111..=117 => corners(CellType::WEDGE, 6 + 9 * (n - 109)),
            125..=131 => corners(CellType::PYRAMID, 5 + 8 * (n - 123)),
            137 => corners(CellType::TETRA, 16),
            _ => None,
        }
    }

    /// Whether the cell has all of the element's nodes.
    pub fn is_whole(&self) -> bool {
        self.order.len() == self.nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of the edges that nodes lie on, as Gmsh's manual and VTK's headers list them.
    #[test]
    fn nodes_on_edges_stand_where_vtk_wants_them() {
        let tetra: (&[_], &[_]) = (&["01", "12", "20", "03", "23", "13"], &["01", "12", "20", "03", "13", "23"]);
        let hexahedron: (&[_], &[_]) = (
            &["01", "03", "04", "12", "15", "23", "26", "37", "45", "47", "56", "67"],
            &["01", "12", "23", "03", "45", "56", "67", "47", "04", "15", "26", "37"],
        );
        let wedge: (&[_], &[_]) =
            (&["01", "02", "03", "12", "14", "25", "34", "35", "45"], &["01", "12", "02", "34", "45", "35", "03", "14", "25"]);
        let pyramid: (&[_], &[_]) = (&["01", "03", "04", "12", "14", "23", "24", "34"], &["01", "12", "23", "03", "04", "14", "24", "34"]);
        for (number, corners, (gmsh, vtk)) in
            [(11, 4, tetra), (17, 8, hexahedron), (12, 8, hexahedron), (18, 6, wedge), (13, 6, wedge), (19, 5, pyramid), (14, 5, pyramid)]
        {
            let order = ElementType::of(number).expect("known").order;
            let found: Vec<_> = order[corners..].iter().map_while(|&i| gmsh.get(usize::from(i) - corners).copied()).collect();
            assert_eq!(found, vtk, "type {number}");
        }
        // Faces by the direction they lie in: Gmsh has -z, -y, -x, +x, +y, +z behind the edges, VTK -x, +x, -y, +y, -z, +z.
        assert_eq!(ElementType::of(12).expect("known").order[20..], [22, 23, 21, 24, 20, 25, 26]);
    }

    #[test]
    fn types_have_the_nodes_that_gmsh_says() {
        let counts = [
            (1, 2),
            (2, 3),
            (3, 4),
            (4, 4),
            (5, 8),
            (6, 6),
            (7, 5),
            (8, 3),
            (9, 6),
            (10, 9),
            (11, 10),
            (12, 27),
            (13, 18),
            (14, 14),
            (15, 1),
            (16, 8),
            (17, 20),
            (18, 15),
            (19, 13),
            (20, 9),
            (21, 10),
            (22, 12),
            (23, 15),
            (24, 15),
            (25, 21),
            (26, 4),
            (28, 6),
            (29, 20),
            (30, 35),
            (31, 56),
            (32, 22),
            (33, 28),
            (36, 16),
            (38, 36),
            (39, 12),
            (40, 16),
            (41, 20),
            (42, 28),
            (46, 66),
            (47, 49),
            (51, 121),
            (52, 18),
            (56, 30),
            (57, 24),
            (61, 40),
            (62, 7),
            (66, 11),
            (71, 84),
            (75, 286),
            (79, 34),
            (83, 58),
            (90, 40),
            (91, 75),
            (92, 64),
            (98, 1000),
            (99, 32),
            (105, 104),
            (106, 126),
            (110, 550),
            (111, 24),
            (117, 78),
            (118, 30),
            (124, 385),
            (125, 21),
            (131, 69),
            (137, 16),
        ];
        for (number, nodes) in counts {
            let found = ElementType::of(number).expect("known");
            assert_eq!((found.nodes, i64::from(found.number)), (nodes, number));
            assert!(found.order.iter().all(|&i| usize::from(i) < nodes) && found.order.len() <= nodes, "type {number}");
            assert!(found.cell_type.points().is_none_or(|points| points == found.order.len()), "type {number}");
        }
        for number in [-1, 0, 34, 35, 69, 133, 138, 256 + 4] {
            assert_eq!(ElementType::of(number), None, "type {number}");
        }
    }
}
