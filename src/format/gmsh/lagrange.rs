//! The nodes of cells of any order on their lattice, in Gmsh's order and in VTK's.
//!
//! Both begin with the corners, then come the nodes of each edge, of each face and of the inside. They differ in the order and direction of
//! edges and faces, and in how nodes of faces and insides follow each other: as in a smaller cell of the same kind, or (VTK's quads and
//! hexahedra) row by row.

/// A node by its place on the lattice: 0 to the order in each direction.
type Node = [i32; 3];

/// A kind of cells with an order of nodes.
struct Scheme {
    corners: &'static [Node],
    edges: &'static [[usize; 2]],
    /// Three corners of a triangle, four of a quad.
    faces: &'static [&'static [usize]],
    dimension: usize,
    is_simplex: bool,
    /// Whether the nodes inside quads and hexahedra follow each other row by row.
    has_rows: bool,
}

const TRIANGLE: Scheme = Scheme {
    corners: &[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
    edges: &[[0, 1], [1, 2], [2, 0]],
    faces: &[],
    dimension: 2,
    is_simplex: true,
    has_rows: false,
};
const GMSH_QUAD: Scheme = Scheme {
    corners: &[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    is_simplex: false,
    ..TRIANGLE
};
const VTK_QUAD: Scheme = Scheme { edges: &[[0, 1], [1, 2], [3, 2], [0, 3]], has_rows: true, ..GMSH_QUAD };
const GMSH_TETRA: Scheme = Scheme {
    corners: &[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    edges: &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
    faces: &[&[0, 2, 1], &[0, 1, 3], &[0, 3, 2], &[3, 1, 2]],
    dimension: 3,
    ..TRIANGLE
};
const VTK_TETRA: Scheme = Scheme {
    edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
    faces: &[&[0, 1, 3], &[2, 3, 1], &[0, 3, 2], &[0, 2, 1]],
    ..GMSH_TETRA
};
const GMSH_HEXAHEDRON: Scheme = Scheme {
    corners: &[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    edges: &[[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]],
    faces: &[&[0, 3, 2, 1], &[0, 1, 5, 4], &[0, 4, 7, 3], &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 5, 6, 7]],
    dimension: 3,
    is_simplex: false,
    has_rows: false,
};
const VTK_HEXAHEDRON: Scheme = Scheme {
    edges: &[[0, 1], [1, 2], [3, 2], [0, 3], [4, 5], [5, 6], [7, 6], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7]],
    faces: &[&[0, 3, 7, 4], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 2, 6, 7], &[0, 1, 2, 3], &[4, 5, 6, 7]],
    has_rows: true,
    ..GMSH_HEXAHEDRON
};

/// Where the nodes of VTK's triangle stand in Gmsh's: in the same order.
pub(super) fn triangle(order: usize) -> Vec<u16> {
    places(&TRIANGLE, &TRIANGLE, order)
}

/// Where the nodes of VTK's quad stand in Gmsh's.
pub(super) fn quad(order: usize) -> Vec<u16> {
    places(&VTK_QUAD, &GMSH_QUAD, order)
}

/// Where the nodes of VTK's tetrahedron stand in Gmsh's.
pub(super) fn tetra(order: usize) -> Vec<u16> {
    places(&VTK_TETRA, &GMSH_TETRA, order)
}

/// Where the nodes of VTK's hexahedron stand in Gmsh's.
pub(super) fn hexahedron(order: usize) -> Vec<u16> {
    places(&VTK_HEXAHEDRON, &GMSH_HEXAHEDRON, order)
}

fn places(of: &Scheme, within: &Scheme, order: usize) -> Vec<u16> {
    let order = order as i32;
    let mut sorted: Vec<(Node, u16)> = nodes(within, order).into_iter().zip(0..).collect();
    sorted.sort_unstable();
    let place = |node: Node| sorted.binary_search_by_key(&node, |(node, _)| *node).map_or(0, |i| sorted[i].1);
    nodes(of, order).into_iter().map(place).collect()
}

/// All nodes in the scheme's order; none for an order below 0.
fn nodes(scheme: &Scheme, order: i32) -> Vec<Node> {
    match order {
        ..0 => return Vec::new(),
        0 => return vec![[0; 3]],
        _ => {}
    }
    let mut all: Vec<Node> = scheme.corners.iter().map(|corner| corner.map(|c| c * order)).collect();
    for &[a, b] in scheme.edges {
        let (a, b) = (scheme.corners[a], scheme.corners[b]);
        all.extend((1..order).map(|s| [0, 1, 2].map(|axis| a[axis] * (order - s) + b[axis] * s)));
    }
    for face in scheme.faces {
        let [a, b, c] = [face[0], face[1], face[face.len() - 1]].map(|corner| scheme.corners[corner]);
        let quad = if scheme.has_rows { &VTK_QUAD } else { &GMSH_QUAD };
        let inside = if face.len() == 3 { inside(&TRIANGLE, order) } else { inside(quad, order) };
        let place = |[u, v, _]: Node| [0, 1, 2].map(|axis| a[axis] * order + (b[axis] - a[axis]) * u + (c[axis] - a[axis]) * v);
        all.extend(inside.into_iter().map(place));
    }
    all.extend(inside(scheme, order));
    all
}

/// The nodes that lie on no edge and face.
fn inside(scheme: &Scheme, order: i32) -> Vec<Node> {
    let is_flat = scheme.dimension == 2;
    if scheme.is_simplex || !scheme.has_rows {
        let smaller = if scheme.is_simplex { order - scheme.dimension as i32 - 1 } else { order - 2 };
        return nodes(scheme, smaller).into_iter().map(|[i, j, k]| [i + 1, j + 1, if is_flat { 0 } else { k + 1 }]).collect();
    }
    let layers = if is_flat { 0..1 } else { 1..order };
    layers.flat_map(|k| (1..order).flat_map(move |j| (1..order).map(move |i| [i, j, k]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orders that VTK (vtkLagrangeTetra and others, GetParametricCoords) and Gmsh (getElementProperties) say.
    #[test]
    fn nodes_stand_where_gmsh_and_vtk_say() {
        assert_eq!(triangle(4), (0..15).collect::<Vec<_>>());
        assert_eq!(quad(3), [0, 1, 2, 3, 4, 5, 6, 7, 9, 8, 11, 10, 12, 13, 15, 14]);
        let tetra_3 = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 10, 15, 14, 13, 12, 17, 19, 18, 16];
        assert_eq!(tetra(3), tetra_3);
        let on_edges = [8, 9, 14, 15, 19, 18, 10, 11, 24, 25, 28, 29, 31, 30, 26, 27, 12, 13, 16, 17, 20, 21, 22, 23];
        assert_eq!(hexahedron(3)[8..32], on_edges);
        let on_faces = [40, 43, 41, 42, 44, 45, 47, 46, 36, 37, 39, 38, 49, 48, 50, 51, 32, 35, 33, 34, 52, 53, 55, 54];
        assert_eq!(hexahedron(3)[32..56], on_faces);
        for (order, count) in [(3, 64), (5, 216), (9, 1000)] {
            let mut found = hexahedron(order);
            assert_eq!(found[..8], [0, 1, 2, 3, 4, 5, 6, 7]);
            found.sort_unstable();
            assert_eq!(found, (0..count).collect::<Vec<_>>(), "each node once");
        }
        let mut found = tetra(7);
        found.sort_unstable();
        assert_eq!(found, (0..120).collect::<Vec<_>>(), "each node once");
    }

    #[test]
    fn the_smallest_orders_are_those_of_quadratic_cells() {
        assert_eq!(tetra(2), [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]);
        let triquadratic = [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26];
        assert_eq!(hexahedron(2), triquadratic);
        assert_eq!(quad(1), [0, 1, 2, 3]);
    }
}
