//! VTK's cell types by number (`vtkCellType.h`).

/// What kind of cell one is, by VTK's number, which every reader translates its own names into. Node orders are VTK's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellType(pub u8);

#[allow(missing_docs)] // the names say all
impl CellType {
    pub const VERTEX: CellType = CellType(1);
    pub const POLY_VERTEX: CellType = CellType(2);
    pub const LINE: CellType = CellType(3);
    pub const POLY_LINE: CellType = CellType(4);
    pub const TRIANGLE: CellType = CellType(5);
    pub const TRIANGLE_STRIP: CellType = CellType(6);
    pub const POLYGON: CellType = CellType(7);
    pub const PIXEL: CellType = CellType(8);
    pub const QUAD: CellType = CellType(9);
    pub const TETRA: CellType = CellType(10);
    pub const VOXEL: CellType = CellType(11);
    pub const HEXAHEDRON: CellType = CellType(12);
    pub const WEDGE: CellType = CellType(13);
    pub const PYRAMID: CellType = CellType(14);
    pub const PENTAGONAL_PRISM: CellType = CellType(15);
    pub const HEXAGONAL_PRISM: CellType = CellType(16);
    pub const QUADRATIC_EDGE: CellType = CellType(21);
    pub const QUADRATIC_TRIANGLE: CellType = CellType(22);
    pub const QUADRATIC_QUAD: CellType = CellType(23);
    pub const QUADRATIC_TETRA: CellType = CellType(24);
    pub const QUADRATIC_HEXAHEDRON: CellType = CellType(25);
    pub const QUADRATIC_WEDGE: CellType = CellType(26);
    pub const QUADRATIC_PYRAMID: CellType = CellType(27);
    pub const BIQUADRATIC_QUAD: CellType = CellType(28);
    pub const TRIQUADRATIC_HEXAHEDRON: CellType = CellType(29);
    pub const QUADRATIC_LINEAR_WEDGE: CellType = CellType(31);
    pub const BIQUADRATIC_QUADRATIC_WEDGE: CellType = CellType(32);
    pub const BIQUADRATIC_QUADRATIC_HEXAHEDRON: CellType = CellType(33);
    pub const BIQUADRATIC_TRIANGLE: CellType = CellType(34);
    pub const CUBIC_LINE: CellType = CellType(35);
    pub const TRIQUADRATIC_PYRAMID: CellType = CellType(37);
    pub const CONVEX_POINT_SET: CellType = CellType(41);
    /// Its points in [`Cells`](super::Cells) are a stream of faces: how many faces, then of each how many points and which.
    pub const POLYHEDRON: CellType = CellType(42);
    pub const LAGRANGE_CURVE: CellType = CellType(68);
    pub const LAGRANGE_TRIANGLE: CellType = CellType(69);
    pub const LAGRANGE_QUADRILATERAL: CellType = CellType(70);
    pub const LAGRANGE_TETRAHEDRON: CellType = CellType(71);
    pub const LAGRANGE_HEXAHEDRON: CellType = CellType(72);
    pub const LAGRANGE_WEDGE: CellType = CellType(73);
    pub const LAGRANGE_PYRAMID: CellType = CellType(74);
}

impl CellType {
    /// VTK's name in words, (one, several).
    pub fn name(self) -> (&'static str, &'static str) {
        name(self.0).unwrap_or(("cell unknown to VTK", "cells unknown to VTK"))
    }

    /// A name that no other type has.
    pub fn key(self) -> String {
        name(self.0).map_or_else(|| format!("type {}", self.0), |(one, _)| one.to_owned())
    }

    /// How many points such a cell has; `None` where cells of the type differ in it, and for types that VTK does not know.
    pub fn points(self) -> Option<usize> {
        Some(match self.0 {
            0 => 0,
            1 => 1,
            3 => 2,
            5 | 21 => 3,
            8..=10 | 35 => 4,
            14 => 5,
            13 | 22 => 6,
            34 => 7,
            11 | 12 | 23 => 8,
            28 => 9,
            15 | 24 => 10,
            16 | 31 => 12,
            27 => 13,
            26 => 15,
            32 => 18,
            37 => 19,
            25 => 20,
            33 => 24,
            29 => 27,
            30 => 6,
            _ => return None,
        })
    }

    /// How many dimensions such a cell has, 0 to 3; `None` for types that VTK does not know or that have none of their own.
    pub fn dimension(self) -> Option<usize> {
        Some(match self.0 {
            1 | 2 => 0,
            3 | 4 | 21 | 35 | 51 | 60 | 68 | 75 => 1,
            5..=9 | 22 | 23 | 28 | 30 | 34 | 36 | 52..=54 | 61..=63 | 69 | 70 | 76 | 77 => 2,
            10..=16 | 24..=27 | 29 | 31..=33 | 37 | 41 | 42 | 55 | 56 | 64..=67 | 71..=74 | 78..=81 => 3,
            _ => return None,
        })
    }
}

/// VTK's name for a cell type, (one, several); `None` for a number that VTK gives to no cell.
fn name(cell_type: u8) -> Option<(&'static str, &'static str)> {
    Some(match cell_type {
        0 => ("empty cell", "empty cells"),
        1 => ("vertex", "vertices"),
        2 => ("poly-vertex", "poly-vertices"),
        3 => ("line", "lines"),
        4 => ("poly-line", "poly-lines"),
        5 => ("triangle", "triangles"),
        6 => ("triangle strip", "triangle strips"),
        7 => ("polygon", "polygons"),
        8 => ("pixel", "pixels"),
        9 => ("quad", "quads"),
        10 => ("tetrahedron", "tetrahedra"),
        11 => ("voxel", "voxels"),
        12 => ("hexahedron", "hexahedra"),
        13 => ("wedge", "wedges"),
        14 => ("pyramid", "pyramids"),
        15 => ("pentagonal prism", "pentagonal prisms"),
        16 => ("hexagonal prism", "hexagonal prisms"),
        21 => ("quadratic edge", "quadratic edges"),
        22 => ("quadratic triangle", "quadratic triangles"),
        23 => ("quadratic quad", "quadratic quads"),
        24 => ("quadratic tetrahedron", "quadratic tetrahedra"),
        25 => ("quadratic hexahedron", "quadratic hexahedra"),
        26 => ("quadratic wedge", "quadratic wedges"),
        27 => ("quadratic pyramid", "quadratic pyramids"),
        28 => ("biquadratic quad", "biquadratic quads"),
        29 => ("triquadratic hexahedron", "triquadratic hexahedra"),
        30 => ("quadratic-linear quad", "quadratic-linear quads"),
        31 => ("quadratic-linear wedge", "quadratic-linear wedges"),
        32 => ("biquadratic-quadratic wedge", "biquadratic-quadratic wedges"),
        33 => ("biquadratic-quadratic hexahedron", "biquadratic-quadratic hexahedra"),
        34 => ("biquadratic triangle", "biquadratic triangles"),
        35 => ("cubic line", "cubic lines"),
        36 => ("quadratic polygon", "quadratic polygons"),
        37 => ("triquadratic pyramid", "triquadratic pyramids"),
        41 => ("convex point set", "convex point sets"),
        42 => ("polyhedron", "polyhedra"),
        51 => ("parametric curve", "parametric curves"),
        52 => ("parametric surface", "parametric surfaces"),
        53 => ("parametric triangle surface", "parametric triangle surfaces"),
        54 => ("parametric quad surface", "parametric quad surfaces"),
        55 => ("parametric tetrahedron region", "parametric tetrahedron regions"),
        56 => ("parametric hexahedron region", "parametric hexahedron regions"),
        60 => ("higher-order edge", "higher-order edges"),
        61 => ("higher-order triangle", "higher-order triangles"),
        62 => ("higher-order quad", "higher-order quads"),
        63 => ("higher-order polygon", "higher-order polygons"),
        64 => ("higher-order tetrahedron", "higher-order tetrahedra"),
        65 => ("higher-order wedge", "higher-order wedges"),
        66 => ("higher-order pyramid", "higher-order pyramids"),
        67 => ("higher-order hexahedron", "higher-order hexahedra"),
        68 => ("Lagrange curve", "Lagrange curves"),
        69 => ("Lagrange triangle", "Lagrange triangles"),
        70 => ("Lagrange quadrilateral", "Lagrange quadrilaterals"),
        71 => ("Lagrange tetrahedron", "Lagrange tetrahedra"),
        72 => ("Lagrange hexahedron", "Lagrange hexahedra"),
        73 => ("Lagrange wedge", "Lagrange wedges"),
        74 => ("Lagrange pyramid", "Lagrange pyramids"),
        75 => ("Bezier curve", "Bezier curves"),
        76 => ("Bezier triangle", "Bezier triangles"),
        77 => ("Bezier quadrilateral", "Bezier quadrilaterals"),
        78 => ("Bezier tetrahedron", "Bezier tetrahedra"),
        79 => ("Bezier hexahedron", "Bezier hexahedra"),
        80 => ("Bezier wedge", "Bezier wedges"),
        81 => ("Bezier pyramid", "Bezier pyramids"),
        _ => return None,
    })
}

/// Cells by type in words, such as `1,204 hexahedra (type 12) and 30 wedges (type 13)`.
pub fn counts_in_words(counts: impl IntoIterator<Item = (CellType, u64)>) -> String {
    let one = |(cell_type, count): (CellType, u64)| {
        let (one, several) = cell_type.name();
        format!("{} {} (type {})", thousands(count), if count == 1 { one } else { several }, cell_type.0)
    };
    let all: Vec<String> = counts.into_iter().map(one).collect();
    match all.split_last() {
        None => "no cells".into(),
        Some((last, [])) => last.clone(),
        Some((last, first)) => format!("{} and {last}", first.join(", ")),
    }
}

/// A count with a comma every three digits.
pub fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_named_and_counted() {
        let text = |counts: &[(u8, u64)]| counts_in_words(counts.iter().map(|&(t, n)| (CellType(t), n)));
        assert_eq!(text(&[]), "no cells");
        assert_eq!(text(&[(12, 1204)]), "1,204 hexahedra (type 12)");
        let expected = "1,204 hexahedra (type 12), 1 wedge (type 13) and 1,000,000 cells unknown to VTK (type 200)";
        assert_eq!(text(&[(12, 1204), (13, 1), (200, 1_000_000)]), expected);
    }

    #[test]
    fn types_with_points_have_a_name_and_a_dimension() {
        for cell_type in (0..=u8::MAX).map(CellType) {
            assert!(cell_type.dimension().is_none() || name(cell_type.0).is_some(), "{cell_type:?}");
            assert!(cell_type.points().is_none_or(|n| n == 0) || cell_type.dimension().is_some(), "{cell_type:?}");
        }
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
    }
}
