//! How XDMF lists cells. Nodes are in VTK's order.

use crate::format::ParseError;
use crate::mesh::{CellType, Cells};

/// What the list of an element `<Topology>` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topology {
    /// Cells of one type with so many points.
    Uniform(CellType, usize),
    /// Cells of one type, whose number of points stands in `NodesPerElement`.
    Poly(CellType),
    /// Each cell with its type before it.
    Mixed,
    /// A regular grid.
    Structured,
}

impl Topology {
    /// By the name in the file, in which case and underscores do not count.
    pub fn named(name: &str) -> Option<Self> {
        let name: String = name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
        let of = |id: usize| cell_type(id).and_then(|cell_type| Some(Topology::Uniform(cell_type, cell_type.points()?)));
        match name.as_str() {
            "polyvertex" => Some(Topology::Poly(CellType::POLY_VERTEX)),
            "polyline" => Some(Topology::Poly(CellType::POLY_LINE)),
            "polygon" => Some(Topology::Poly(CellType::POLYGON)),
            "triangle" => of(4),
            "quadrilateral" | "quad" => of(5),
            "tetrahedron" | "tet" => of(6),
            "pyramid" => of(7),
            "wedge" => of(8),
            "hexahedron" | "hex" => of(9),
            "edge3" => of(34),
            "quad9" | "quadrilateral9" => of(35),
            "tri6" | "triangle6" => of(36),
            "quad8" | "quadrilateral8" => of(37),
            "tet10" | "tetrahedron10" => of(38),
            "pyramid13" => of(39),
            "wedge15" => of(40),
            "wedge18" => of(41),
            "hex20" | "hexahedron20" => of(48),
            "hex24" | "hexahedron24" => of(49),
            "hex27" | "hexahedron27" => of(50),
            "mixed" => Some(Topology::Mixed),
            name if name.ends_with("mesh") => Some(Topology::Structured),
            _ => None,
        }
    }

    /// Adds its cells, by points from `base` on; `nodes` is `NodesPerElement`. Numbers of points count from `first` in the file.
    pub fn append(
        self,
        numbers: &[i64],
        nodes: Option<usize>,
        [first, base]: [i64; 2],
        place: &str,
        cells: &mut Cells,
    ) -> Result<(), ParseError> {
        let mut points = Vec::new();
        let (cell_type, each) = match self {
            Topology::Uniform(cell_type, each) => (cell_type, each),
            Topology::Poly(cell_type) => {
                let each = nodes.or(Some(1).filter(|_| cell_type == CellType::POLY_VERTEX)).filter(|&each| each > 0);
                let no_count = || ParseError::invalid(place, "no NodesPerElement", "how many points each of its cells has");
                (one_point_is_a_vertex(cell_type, each), each.ok_or_else(no_count)?)
            }
            Topology::Mixed => return mixed(numbers, [first, base], place, cells),
            Topology::Structured => {
                return Err(ParseError::Unsupported(format!("{place} is a regular grid, octetra reads lists of cells")));
            }
        };
        if !numbers.len().is_multiple_of(each) {
            return Err(ParseError::invalid(place, format!("{} numbers", numbers.len()), format!("a multiple of {each} for its cells")));
        }
        for cell in numbers.chunks_exact(each) {
            points.clear();
            append_points(cell, [first, base], place, &mut points)?;
            cells.push(cell_type, &points)?;
        }
        Ok(())
    }
}

fn one_point_is_a_vertex(cell_type: CellType, points: Option<usize>) -> CellType {
    match (cell_type, points) {
        (CellType::POLY_VERTEX, Some(1)) => CellType::VERTEX,
        (CellType::POLY_LINE, Some(2)) => CellType::LINE,
        _ => cell_type,
    }
}

/// The number before a cell in a mixed list, as a type of a fixed number of points.
fn cell_type(id: usize) -> Option<CellType> {
    Some(match id {
        4 => CellType::TRIANGLE,
        5 => CellType::QUAD,
        6 => CellType::TETRA,
        7 => CellType::PYRAMID,
        8 => CellType::WEDGE,
        9 => CellType::HEXAHEDRON,
        34 => CellType::QUADRATIC_EDGE,
        35 => CellType::BIQUADRATIC_QUAD,
        36 => CellType::QUADRATIC_TRIANGLE,
        37 => CellType::QUADRATIC_QUAD,
        38 => CellType::QUADRATIC_TETRA,
        39 => CellType::QUADRATIC_PYRAMID,
        40 => CellType::QUADRATIC_WEDGE,
        41 => CellType::BIQUADRATIC_QUADRATIC_WEDGE,
        48 => CellType::QUADRATIC_HEXAHEDRON,
        49 => CellType::BIQUADRATIC_QUADRATIC_HEXAHEDRON,
        50 => CellType::TRIQUADRATIC_HEXAHEDRON,
        _ => return None,
    })
}

fn append_points(numbers: &[i64], [first, base]: [i64; 2], place: &str, points: &mut Vec<u32>) -> Result<(), ParseError> {
    for &number in numbers {
        let index = number.checked_sub(first).filter(|&index| index >= 0);
        let index = index.and_then(|index| u32::try_from(index.checked_add(base)?).ok());
        points.push(index.ok_or_else(|| ParseError::invalid(place, number.to_string(), format!("numbers of points from {first}")))?);
    }
    Ok(())
}

fn mixed(numbers: &[i64], from: [i64; 2], place: &str, cells: &mut Cells) -> Result<(), ParseError> {
    let (mut rest, mut points) = (numbers, Vec::new());
    while !rest.is_empty() {
        let at = numbers.len() - rest.len();
        let ends = || ParseError::invalid(place, format!("the end of the list in the cell at number {at}"), "the rest of it");
        let mut take = |count: i64| {
            let split = usize::try_from(count).ok().and_then(|count| rest.split_at_checked(count));
            let (taken, behind) = split.ok_or_else(ends)?;
            rest = behind;
            Ok::<_, ParseError>(taken)
        };
        let id = take(1)?[0];
        points.clear();
        let cell_type = match id {
            1..=3 => {
                let count = take(1)?[0];
                append_points(take(count)?, from, place, &mut points)?;
                let of = [CellType::POLY_VERTEX, CellType::POLY_LINE, CellType::POLYGON][id as usize - 1];
                one_point_is_a_vertex(of, Some(points.len()))
            }
            16 => {
                let faces = take(1)?[0];
                points.push(u32::try_from(faces).map_err(|_| ends())?);
                for _ in 0..faces {
                    let count = take(1)?[0];
                    points.push(u32::try_from(count).map_err(|_| ends())?);
                    append_points(take(count)?, from, place, &mut points)?;
                }
                CellType::POLYHEDRON
            }
            _ => {
                let found = usize::try_from(id).ok().and_then(cell_type).and_then(|cell_type| Some((cell_type, cell_type.points()?)));
                let unknown = || ParseError::invalid(place, format!("a cell of type {id} at number {at}"), "a type that XDMF knows");
                let (cell_type, count) = found.ok_or_else(unknown)?;
                append_points(take(count as i64)?, from, place, &mut points)?;
                cell_type
            }
        };
        cells.push(cell_type, &points)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(topology: &str, numbers: &[i64], nodes: Option<usize>, from: [i64; 2]) -> Result<Vec<(u8, Vec<u32>)>, String> {
        let mut cells = Cells::default();
        let topology = Topology::named(topology).expect("known");
        topology.append(numbers, nodes, from, "here", &mut cells).map_err(|e| e.to_string())?;
        Ok(cells.iter().map(|(cell_type, points)| (cell_type.0, points.to_vec())).collect())
    }

    #[test]
    fn lists_of_cells() {
        assert_eq!(cells("Tetrahedron", &[1, 2, 3, 4], None, [1, 10]), Ok(vec![(10, vec![10, 11, 12, 13])]));
        assert_eq!(cells("Polyvertex", &[5, 6], None, [0, 0]), Ok(vec![(1, vec![5]), (1, vec![6])]));
        assert_eq!(cells("POLYGON", &[5, 6, 7, 8, 9], Some(5), [0, 0]), Ok(vec![(7, vec![5, 6, 7, 8, 9])]));
        let mixed = [1, 1, 7, 2, 2, 1, 2, 3, 3, 0, 1, 2, 6, 0, 1, 2, 3, 16, 2, 3, 0, 1, 2, 3, 2, 1, 4];
        let expected =
            vec![(1, vec![7]), (3, vec![1, 2]), (7, vec![0, 1, 2]), (10, vec![0, 1, 2, 3]), (42, vec![2, 3, 0, 1, 2, 3, 2, 1, 4])];
        assert_eq!(cells("Mixed", &mixed, None, [0, 0]), Ok(expected));
        for name in
            ["Tet_10", "Tetrahedron_10", "HEX_20", "Hexahedron_27", "Wedge_15", "Pyramid_13", "Tri_6", "Quad_8", "Edge_3", "3DCORECTMesh"]
        {
            assert!(Topology::named(name).is_some(), "{name}");
        }
    }

    #[test]
    fn lists_that_do_not_add_up() {
        for (name, numbers, nodes, expected) in [
            ("Tetrahedron", &[0, 1, 2, 3, 4][..], None, "here: 5 numbers, expected a multiple of 4 for its cells"),
            ("Tetrahedron", &[0, 1, 2, -3], None, "here: -3, expected numbers of points from 0"),
            ("Triangle", &[0, 1, i64::MAX], None, "here: 9223372036854775807, expected numbers of points from 0"),
            ("Polygon", &[0, 1, 2], None, "here: no NodesPerElement"),
            ("Mixed", &[6, 0, 1, 2], None, "here: the end of the list in the cell at number 0"),
            ("Mixed", &[4, 0, 1, 2, 99], None, "here: a cell of type 99 at number 4"),
            ("Mixed", &[3, i64::MAX, 1], None, "the end of the list"),
            ("Mixed", &[16, i64::MAX, 1], None, "the end of the list"),
            ("Mixed", &[16, 2, -1], None, "the end of the list"),
            ("2DSMesh", &[], None, "here is a regular grid"),
        ] {
            let error = cells(name, numbers, nodes, [0, 0]).expect_err(expected);
            assert!(error.contains(expected), "{error}");
        }
    }
}
