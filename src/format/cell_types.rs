//! VTK's cell types by number (`vtkCellType.h`).

/// The cell type of a linear tetrahedron, the only one that octetra reads.
pub(super) const TETRA: u8 = 10;

/// VTK's name for a cell type, (one, several); `None` for a number that VTK gives to no cell.
pub(super) fn name(cell_type: u8) -> Option<(&'static str, &'static str)> {
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

/// What a reader says when cells are not all linear tets: every other type with its number and how many there are, such as
/// `1,204 hexahedra (type 12) and 30 wedges (type 13)`. `None` when all are tets.
pub(super) fn others(counts: &[u64; 256]) -> Option<String> {
    let others: Vec<String> = (0..=u8::MAX)
        .filter(|&cell_type| cell_type != TETRA && counts[usize::from(cell_type)] > 0)
        .map(|cell_type| {
            let count = counts[usize::from(cell_type)];
            let (one, several) = name(cell_type).unwrap_or(("cell unknown to VTK", "cells unknown to VTK"));
            format!("{} {} (type {cell_type})", thousands(count), if count == 1 { one } else { several })
        })
        .collect();
    let (last, first) = others.split_last()?;
    Some(if first.is_empty() { last.clone() } else { format!("{} and {last}", first.join(", ")) })
}

/// A count with a comma every three digits.
pub(super) fn thousands(count: u64) -> String {
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
    fn other_cells_are_named_and_counted() {
        let mut counts = [0; 256];
        counts[10] = 5;
        assert_eq!(others(&counts), None);
        counts[12] = 1204;
        assert_eq!(others(&counts).as_deref(), Some("1,204 hexahedra (type 12)"));
        counts[13] = 1;
        counts[200] = 1_000_000;
        let text = "1,204 hexahedra (type 12), 1 wedge (type 13) and 1,000,000 cells unknown to VTK (type 200)";
        assert_eq!(others(&counts).as_deref(), Some(text));
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1,000", "1,234,567"]);
    }
}
