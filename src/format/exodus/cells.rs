//! Elements of Exodus II as cells of VTK.

use crate::mesh::CellType;

/// What an element becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Element {
    /// The cell.
    pub cell_type: CellType,
    /// Which of the element's nodes are its points, in VTK's order.
    pub order: &'static [u8],
}

const ORDER: [u8; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19];
/// VTK has the edges of the top before the vertical ones, Exodus behind them.
const HEX20: [u8; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];
/// Exodus has the centre first, then the faces -z, +z, -x, +x, -y, +y; VTK the faces -x, +x, -y, +y, -z, +z, then the centre.
const HEX27: [u8; 27] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15, 23, 24, 25, 26, 21, 22, 20];
const WEDGE18: [u8; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11, 15, 16, 17];

/// The cell of an element by its type's name and number of nodes. As in VTK only the first three letters count: `TETRA`, `TET4` and
/// `tetra4` are one. Nodes in the middle of faces that VTK has no cell for are left out.
pub(super) fn element(name: &str, nodes: usize) -> Option<Element> {
    let family: String = name.chars().take(3).map(|c| c.to_ascii_uppercase()).collect();
    let first = |cell_type: CellType, n: usize| Some(Element { cell_type, order: &ORDER[..n] });
    let ordered = |cell_type: CellType, order: &'static [u8]| Some(Element { cell_type, order });
    match (family.as_str(), nodes) {
        ("TET", 4 | 5 | 8) => first(CellType::TETRA, 4),
        ("TET", 10 | 11 | 14 | 15) => first(CellType::QUADRATIC_TETRA, 10),
        ("HEX", 8 | 9) => first(CellType::HEXAHEDRON, 8),
        ("HEX", 20 | 21) => ordered(CellType::QUADRATIC_HEXAHEDRON, &HEX20),
        ("HEX", 27) => ordered(CellType::TRIQUADRATIC_HEXAHEDRON, &HEX27),
        ("WED" | "PRI", 6 | 7) => first(CellType::WEDGE, 6),
        ("WED" | "PRI", 15 | 16 | 20 | 21) => ordered(CellType::QUADRATIC_WEDGE, &WEDGE18[..15]),
        ("WED" | "PRI", 18) => ordered(CellType::BIQUADRATIC_QUADRATIC_WEDGE, &WEDGE18),
        ("PYR", 5 | 6) => first(CellType::PYRAMID, 5),
        ("PYR", 13 | 14 | 18 | 19) => first(CellType::QUADRATIC_PYRAMID, 13),
        ("QUA" | "SHE", 4 | 5) => first(CellType::QUAD, 4),
        ("QUA" | "SHE", 8) => first(CellType::QUADRATIC_QUAD, 8),
        ("QUA" | "SHE", 9) => first(CellType::BIQUADRATIC_QUAD, 9),
        ("TRI" | "SHE", 3) | ("TRI", 4) => first(CellType::TRIANGLE, 3),
        ("TRI" | "SHE", 6) => first(CellType::QUADRATIC_TRIANGLE, 6),
        ("TRI" | "SHE", 7) => first(CellType::BIQUADRATIC_TRIANGLE, 7),
        ("BAR" | "BEA" | "TRU" | "ROD" | "EDG" | "LIN" | "SPR", 2) => first(CellType::LINE, 2),
        ("BAR" | "BEA" | "TRU" | "ROD" | "EDG" | "LIN" | "SPR", 3) => first(CellType::QUADRATIC_EDGE, 3),
        ("SPH" | "CIR" | "POI" | "VER" | "NOD", 1) => first(CellType::VERTEX, 1),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nodes of a hexahedron of 27 on the unit cube as the Exodus manual draws them.
    fn hex27() -> [[f64; 3]; 27] {
        let corners = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]];
        let edges = [
            [1, 0, 0],
            [2, 1, 0],
            [1, 2, 0],
            [0, 1, 0],
            [0, 0, 1],
            [2, 0, 1],
            [2, 2, 1],
            [0, 2, 1],
            [1, 0, 2],
            [2, 1, 2],
            [1, 2, 2],
            [0, 1, 2],
        ];
        let faces = [[1, 1, 1], [1, 1, 0], [1, 1, 2], [0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1]];
        let all = corners.iter().chain(&edges).chain(&faces).map(|p| p.map(|x| f64::from(x) / 2.0));
        all.collect::<Vec<_>>().try_into().expect("27")
    }

    #[test]
    fn nodes_come_to_lie_where_vtk_has_them() {
        let order = element("HEX27", 27).expect("known").order;
        let at = |i: usize| hex27()[usize::from(order[i])];
        let middle = |a: usize, b: usize| std::array::from_fn(|k| (at(a)[k] + at(b)[k]) / 2.0);
        let edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)];
        for (i, (a, b)) in edges.into_iter().enumerate() {
            assert_eq!(at(8 + i), middle(a, b), "edge {i}");
        }
        let faces = [(0, 7), (1, 6), (0, 5), (3, 6), (0, 2), (4, 6), (0, 6)];
        for (i, (a, b)) in faces.into_iter().enumerate() {
            assert_eq!(at(20 + i), middle(a, b), "face {i}");
        }
        assert_eq!(element("hex20", 20).expect("known").order, &order[..20]);
    }

    #[test]
    fn a_cell_has_as_many_points_as_its_type() {
        for family in ["TET", "HEX", "WEDGE", "prism", "PYRAMID", "QUAD", "SHELL", "TRI", "BAR", "SPHERE", "BEX_HEX", ""] {
            for nodes in 0..65 {
                let Some(element) = element(family, nodes) else { continue };
                assert_eq!(element.cell_type.points(), Some(element.order.len()), "{family} {nodes}");
                assert!(element.order.iter().all(|&node| usize::from(node) < nodes), "{family} {nodes}");
            }
        }
        assert_eq!(element("TETRA10", 10).map(|e| e.cell_type), Some(CellType::QUADRATIC_TETRA));
        assert!(element("BEX_HEX", 54).is_none());
    }
}
