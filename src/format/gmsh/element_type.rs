//! Gmsh's types of elements, and where their nodes stand in VTK's cells.

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
        // Nodes of a complete triangle, tetrahedron and pyramid of an order.
        let triangle = |n: usize| (n + 1) * (n + 2) / 2;
        let tetra = |n: usize| triangle(n) * (n + 3) / 3;
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
            21 => corners(CellType::TRIANGLE, 10),
            23 => corners(CellType::TRIANGLE, 15),
            25 => corners(CellType::TRIANGLE, 21),
            26..=28 => corners(CellType::LINE, n - 22),
            29..=31 => corners(CellType::TETRA, tetra(n - 26)),
            36..=38 => corners(CellType::QUAD, (n - 32) * (n - 32)),
            42..=46 => corners(CellType::TRIANGLE, triangle(n - 36)),
            47..=51 => corners(CellType::QUAD, (n - 40) * (n - 40)),
            62..=66 => corners(CellType::LINE, n - 55),
            71..=75 => corners(CellType::TETRA, tetra(n - 65)),
            90 => corners(CellType::WEDGE, 40),
            91 => corners(CellType::WEDGE, 75),
            92..=98 => corners(CellType::HEXAHEDRON, (n - 88).pow(3)),
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
