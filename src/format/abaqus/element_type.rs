//! Abaqus' and CalculiX's types of elements by name.

use crate::mesh::CellType;

/// A type of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ElementType {
    /// The cell that it becomes.
    pub cell_type: CellType,
    /// How many nodes an element has: all of them are the cell's.
    pub nodes: usize,
}

/// Families of solids, surfaces and lines: a name is one of these, how many nodes, and letters for what else is special.
const SOLIDS: &[&str] = &["C3D", "DC3D", "DCC3D", "AC3D", "Q3D", "F3D", "COH3D", "SC"];
const SURFACES: &[&str] =
    &["S", "DS", "M3D", "SFM3D", "R3D", "CPS", "CPE", "CPEG", "CAX", "CGAX", "DC2D", "DCAX", "DCC2D", "DCCAX", "AC2D", "ACAX", "F2D"];
const LINES: &[&str] = &["T2D", "T3D", "R2D", "RAX", "DC1D", "AC1D", "FRAME2D", "FRAME3D"];
/// Names that do not say how many nodes there are.
const OTHERS: &[(&str, CellType)] = &[
    ("STRI3", CellType::TRIANGLE),
    ("STRI65", CellType::QUADRATIC_TRIANGLE),
    ("B21", CellType::LINE),
    ("B22", CellType::QUADRATIC_EDGE),
    ("B23", CellType::LINE),
    ("B31", CellType::LINE),
    ("B32", CellType::QUADRATIC_EDGE),
    ("B33", CellType::LINE),
    ("PIPE21", CellType::LINE),
    ("PIPE22", CellType::QUADRATIC_EDGE),
    ("PIPE31", CellType::LINE),
    ("PIPE32", CellType::QUADRATIC_EDGE),
];

/// Where the nodes of a triquadratic hexahedron in VTK's order stand in that of C3D27, which has its centre first, then the faces -z, +z,
/// -y, +x, +y, -x.
pub(super) const HEXAHEDRON_27: [usize; 27] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 26, 24, 23, 25, 21, 22, 20];

impl ElementType {
    /// By its name in capitals; `None` for names of elements that are no cells (springs, masses, connectors) or not known.
    pub fn of(name: &str) -> Option<Self> {
        let of = |cell_type: CellType| Some(ElementType { cell_type, nodes: cell_type.points()? });
        if let Some((_, cell_type)) = OTHERS.iter().find(|(other, _)| name.strip_prefix(other).is_some_and(is_variant)) {
            return of(*cell_type);
        }
        let nodes = |families: &[&str]| {
            families.iter().find_map(|family| {
                let rest = name.strip_prefix(family)?;
                let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
                let (nodes, variant) = rest.split_at(digits);
                if is_variant(variant) { nodes.parse::<usize>().ok() } else { None }
            })
        };
        let solid = nodes(SOLIDS).and_then(|nodes| match nodes {
            4 => Some(CellType::TETRA),
            5 => Some(CellType::PYRAMID),
            6 => Some(CellType::WEDGE),
            8 => Some(CellType::HEXAHEDRON),
            10 => Some(CellType::QUADRATIC_TETRA),
            13 => Some(CellType::QUADRATIC_PYRAMID),
            15 => Some(CellType::QUADRATIC_WEDGE),
            20 => Some(CellType::QUADRATIC_HEXAHEDRON),
            27 => Some(CellType::TRIQUADRATIC_HEXAHEDRON),
            _ => None,
        });
        let surface = || {
            nodes(SURFACES).and_then(|nodes| match nodes {
                3 => Some(CellType::TRIANGLE),
                4 => Some(CellType::QUAD),
                6 => Some(CellType::QUADRATIC_TRIANGLE),
                8 => Some(CellType::QUADRATIC_QUAD),
                9 => Some(CellType::BIQUADRATIC_QUAD),
                _ => None,
            })
        };
        let line = || {
            nodes(LINES).and_then(|nodes| match nodes {
                2 => Some(CellType::LINE),
                3 => Some(CellType::QUADRATIC_EDGE),
                _ => None,
            })
        };
        of(solid.or_else(surface).or_else(line)?)
    }
}

/// Whether what follows a name's nodes says a variant of it, such as `R`, `H`, `RT` or `R5`, and not more nodes.
fn is_variant(rest: &str) -> bool {
    rest.is_empty() || rest.len() <= 5 && rest.as_bytes()[0].is_ascii_alphabetic() && rest.bytes().all(|b| b.is_ascii_alphanumeric())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_cell_it_is() {
        for (names, cell_type) in [
            (&["C3D4", "C3D4H", "DC3D4", "F3D4"][..], CellType::TETRA),
            (&["C3D5"], CellType::PYRAMID),
            (&["C3D6", "COH3D6", "SC6R"], CellType::WEDGE),
            (&["C3D8", "C3D8R", "C3D8RH", "C3D8IH", "SC8R", "C3D8RHT"], CellType::HEXAHEDRON),
            (&["C3D10", "C3D10M", "C3D10MHT", "DC3D10"], CellType::QUADRATIC_TETRA),
            (&["C3D15", "C3D15V"], CellType::QUADRATIC_WEDGE),
            (&["C3D20", "C3D20R", "C3D20RHT"], CellType::QUADRATIC_HEXAHEDRON),
            (&["C3D27"], CellType::TRIQUADRATIC_HEXAHEDRON),
            (&["S3", "S3R", "CPS3", "CPE3", "CAX3", "M3D3", "R3D3", "STRI3", "DS3"], CellType::TRIANGLE),
            (&["S4", "S4R", "S4R5", "S4RSW", "CPEG4", "CAX4P", "R3D4"], CellType::QUAD),
            (&["S6", "STRI65", "CPE6M"], CellType::QUADRATIC_TRIANGLE),
            (&["S8", "S8R", "S8R5", "CPS8R"], CellType::QUADRATIC_QUAD),
            (&["S9R5", "M3D9R"], CellType::BIQUADRATIC_QUAD),
            (&["T3D2", "B31", "B31H", "B33", "R2D2"], CellType::LINE),
            (&["T3D3", "B32", "B32R"], CellType::QUADRATIC_EDGE),
        ] {
            for name in names {
                assert_eq!(ElementType::of(name), Some(ElementType { cell_type, nodes: cell_type.points().unwrap_or(0) }), "{name}");
            }
        }
        for name in ["", "C3D", "C3D7", "C3D4_X", "SPRINGA", "MASS", "CONN3D2", "U1", "S99999999999999999999", "D"] {
            assert_eq!(ElementType::of(name), None, "{name}");
        }
    }
}
