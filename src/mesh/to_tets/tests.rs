use super::*;
use crate::geometry;
use crate::mesh::{Cells, TetMesh};

/// Cells of one type that share no point: `places` are a cell's points.
fn one(cell_type: CellType, places: &[DVec3], field: impl Fn(DVec3) -> f64) -> MeshParts {
    let order: Vec<u32> = (0..places.len() as u32).collect();
    of(places.to_vec(), &[(cell_type, &order)], field).expect("sound")
}

fn of(points: Vec<DVec3>, cells: &[(CellType, &[u32])], field: impl Fn(DVec3) -> f64) -> Result<MeshParts, MeshError> {
    let mut all = Cells::default();
    cells.iter().for_each(|(cell_type, nodes)| all.push(*cell_type, nodes).expect("few"));
    let array = |name: &str, values| DataArray { name: name.into(), components: 1, values };
    let point_data = vec![array("f", Values::F64(points.iter().map(|&p| field(p)).collect()))];
    let cell_data = vec![array("c", Values::F32((0..cells.len()).map(|i| i as f32).collect()))];
    to_tets(UnstructuredGrid { points, cells: all, point_data, cell_data, ..Default::default() })
}

fn volumes(parts: &MeshParts) -> Vec<f64> {
    parts.tets.iter().map(|tet| geometry::signed_volume(&tet.map(|i| parts.points[i as usize]))).collect()
}

/// All tets are positive and fill so much, and the field at every point is the one that was given.
fn assert_fills(parts: &MeshParts, volume: f64, field: impl Fn(DVec3) -> f64) {
    let volumes = volumes(parts);
    assert!(volumes.iter().all(|&v| v > 0.0), "{volumes:?}");
    assert!((volumes.iter().sum::<f64>() - volume).abs() <= 1e-12 * volume, "{}", volumes.iter().sum::<f64>());
    for (i, &p) in parts.points.iter().enumerate() {
        let found = parts.point_data[0].values.get(i);
        assert!((found - field(p)).abs() < 1e-12, "{found} at {p}");
    }
    assert_eq!(open_faces(parts).0, 0, "no face of two tets is seen alike from both");
}

/// Faces of three tets or more or of two on one side of it, and faces of one.
fn open_faces(parts: &MeshParts) -> (usize, usize) {
    let mut faces = HashMap::<[u32; 3], Vec<bool>>::new();
    for tet in &parts.tets {
        for face in geometry::FACES {
            let [a, b, c] = face.map(|corner| tet[corner]);
            let mut key = [a, b, c];
            key.sort_unstable();
            faces.entry(key).or_default().push((a > b) ^ (b > c) ^ (a > c));
        }
    }
    let is_odd = |sides: &&Vec<bool>| sides.len() > 2 || (sides.len() == 2 && sides[0] == sides[1]);
    (faces.values().filter(is_odd).count(), faces.values().filter(|sides| sides.len() == 1).count())
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn hexahedron() -> [DVec3; 8] {
    [v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.), v(0., 0., 1.), v(1., 0., 1.), v(1., 1., 1.), v(0., 1., 1.)]
}

fn linear(p: DVec3) -> f64 {
    1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z
}

fn middles(corners: &[DVec3], edges: &[[usize; 2]]) -> Vec<DVec3> {
    corners.iter().copied().chain(edges.iter().map(|&[a, b]| (corners[a] + corners[b]) / 2.0)).collect()
}

const HEX_EDGES: [[usize; 2]; 12] = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const WEDGE_EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
const PYRAMID_EDGES: [[usize; 2]; 8] = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];
const TETRA_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

#[test]
fn linear_cells_are_filled() {
    let hex = hexahedron();
    let wedge = [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(0., 0., 2.), v(1., 0., 2.), v(0., 1., 2.)];
    let pyramid = [v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.), v(0.3, 0.4, 3.)];
    let prism = |n: usize| -> Vec<DVec3> {
        let at = |i: usize, z: f64| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            v(angle.cos(), angle.sin(), z)
        };
        (0..n).map(|i| at(i, 0.0)).chain((0..n).map(|i| at(i, 1.0))).collect()
    };
    let area = |n: f64| n / 2.0 * (std::f64::consts::TAU / n).sin();
    for (cell_type, points, volume, tets) in [
        (CellType::HEXAHEDRON, hex.to_vec(), 1.0, 6),
        (CellType::VOXEL, [0, 1, 3, 2, 4, 5, 7, 6].map(|i| hex[i]).to_vec(), 1.0, 6),
        (CellType::WEDGE, wedge.to_vec(), 1.0, 3),
        (CellType::PYRAMID, pyramid.to_vec(), 1.0, 2),
        (CellType::PENTAGONAL_PRISM, prism(5), area(5.0), 3 + 3 * 2),
        (CellType::HEXAGONAL_PRISM, prism(6), area(6.0), 4 + 4 * 2),
    ] {
        let parts = one(cell_type, &points, linear);
        assert_fills(&parts, volume, linear);
        assert_eq!((parts.tets.len(), parts.points.len(), parts.file_cells.shape), (tets, points.len(), cell_type));
        // From its mirror image inverted tets, no others.
        let mirrored: Vec<DVec3> = points.iter().map(|p| v(-p.x, p.y, p.z)).collect();
        assert!(volumes(&one(cell_type, &mirrored, linear)).iter().all(|&v| v < 0.0), "{cell_type:?}");
    }
}

#[test]
fn quadratic_cells_have_their_nodes_and_the_volume_within() {
    let quadratic = |p: DVec3| p.x * p.x + p.y * p.z - 2.0 * p.z * p.z + p.x;
    let tetra = [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(0., 0., 1.)];
    let wedge = [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(0., 0., 2.), v(1., 0., 2.), v(0., 1., 2.)];
    let pyramid = [v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.), v(0.5, 0.5, 3.)];
    let faces = |points: &[DVec3], corners: &[[usize; 4]]| -> Vec<DVec3> {
        corners.iter().map(|&face| face.map(|i| points[i]).into_iter().sum::<DVec3>() / 4.0).collect()
    };
    let hex20 = middles(&hexahedron(), &HEX_EDGES);
    let sides = [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]];
    let hex24 = [hex20.clone(), faces(&hex20, &sides[..4])].concat();
    let hex27 = [hex20.clone(), faces(&hex20, &sides), vec![DVec3::splat(0.5)]].concat();
    let wedge15 = middles(&wedge, &WEDGE_EDGES);
    let wedge18 = [wedge15.clone(), faces(&wedge15, &[[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]])].concat();
    for (cell_type, points, volume, tets, all) in [
        (CellType::QUADRATIC_TETRA, middles(&tetra, &TETRA_EDGES), 1.0 / 6.0, 8, 10),
        (CellType::LAGRANGE_TETRAHEDRON, middles(&tetra, &TETRA_EDGES), 1.0 / 6.0, 8, 10),
        (CellType::QUADRATIC_HEXAHEDRON, hex20, 1.0, 48, 27),
        (CellType::BIQUADRATIC_QUADRATIC_HEXAHEDRON, hex24, 1.0, 48, 27),
        (CellType::TRIQUADRATIC_HEXAHEDRON, hex27, 1.0, 48, 27),
        (CellType::QUADRATIC_WEDGE, wedge15, 1.0, 24, 18),
        (CellType::BIQUADRATIC_QUADRATIC_WEDGE, wedge18, 1.0, 24, 18),
        (CellType::QUADRATIC_PYRAMID, middles(&pyramid, &PYRAMID_EDGES), 1.0, 16, 14),
    ] {
        // The serendipity nodes reproduce quadratic fields.
        let parts = one(cell_type, &points, quadratic);
        assert_fills(&parts, volume, quadratic);
        assert_eq!((parts.tets.len(), parts.points.len()), (tets, all), "{cell_type:?}");
    }
}

#[test]
fn how_far_quadratic_cells_are_from_their_tets_is_said() {
    // One edge's middle is off by 0.1, and the field there by 0.4 of its range of 1: an eighth of twice that.
    let mut points = middles(&[v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(0., 0., 1.)], &TETRA_EDGES);
    points[4] -= DVec3::Y * 0.1;
    let field = |p: DVec3| if p.y < 0.0 { 0.9 } else { p.x };
    let parts = one(CellType::QUADRATIC_TETRA, &points, field);
    let diagonal = v(1.0, 1.1, 1.0).length();
    let expected = format!("places are within {:.2} % of the diagonal, and values within 10.00 % of the range of \"f\"", 2.5 / diagonal);
    assert!(parts.notes[0].contains(&expected), "{:?}", parts.notes);
}

#[test]
fn neighbours_of_every_type_share_their_faces() {
    // A hexahedron, a wedge on it, a pyramid under it, a tet at its side, in all orders of the points' numbers.
    let places = [&hexahedron()[..], &[v(0.5, 0.0, 2.0), v(0.5, 1.0, 2.0), v(0.5, 0.5, -1.0), v(2.0, 0.5, 0.5)]].concat();
    let cells: [(CellType, &[usize]); 5] = [
        (CellType::HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7]),
        (CellType::WEDGE, &[4, 8, 5, 7, 9, 6]),
        (CellType::PYRAMID, &[3, 2, 1, 0, 10]),
        (CellType::PYRAMID, &[1, 2, 6, 5, 11]),
        (CellType::TETRA, &[1, 2, 11, 10]),
    ];
    for seed in 0..200u64 {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&i| (i as u64 + 1).wrapping_mul(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1).rotate_left(17));
        let mut points = vec![DVec3::ZERO; places.len()];
        order.iter().zip(&places).for_each(|(&i, &p)| points[i] = p);
        let renumbered: Vec<(CellType, Vec<u32>)> =
            cells.iter().map(|(t, nodes)| (*t, nodes.iter().map(|&i| order[i] as u32).collect())).collect();
        let cells: Vec<(CellType, &[u32])> = renumbered.iter().map(|(t, nodes)| (*t, &nodes[..])).collect();
        let parts = of(points, &cells, linear).expect("sound");
        assert!(volumes(&parts).iter().all(|&v| v > 0.0));
        let total = 1.0 + 0.5 + 1.0 / 3.0 + 1.0 / 3.0 + geometry::signed_volume(&[1, 2, 11, 10].map(|i| places[i]));
        assert!((volumes(&parts).iter().sum::<f64>() - total).abs() < 1e-12);
        // Outside: 3 faces of the hexahedron, 2 triangles and 2 quads of the wedge, 3 and 3 of the pyramids, 2 of the tet.
        assert_eq!(open_faces(&parts), (0, 6 + 2 + 4 + 3 + 3 + 2), "numbers in the order {order:?}");
        assert_eq!(parts.cell_data[0].values.get(parts.tets.len() - 1), 4.0);
    }
}

/// The faces of a box with a notch, extruded along z: concave, planar.
fn notched() -> (Vec<DVec3>, Vec<u32>) {
    let outline = [(0., 0.), (3., 0.), (3., 2.), (2., 2.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)];
    let points: Vec<DVec3> = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| v(x, y, z))).collect();
    let n = outline.len() as u32;
    let mut stream = vec![n + 2, n];
    stream.extend(0..n); // in the sense of the upper face: senses may differ
    stream.push(n);
    stream.extend(n..2 * n);
    for i in 0..n {
        stream.extend([4, i, (i + 1) % n, n + (i + 1) % n, n + i]);
    }
    (points, stream)
}

#[test]
fn concave_polyhedra_keep_their_volume() {
    let (points, stream) = notched();
    let parts = of(points, &[(CellType::POLYHEDRON, &stream)], linear).expect("sound");
    let sum: f64 = volumes(&parts).iter().sum();
    assert!((sum - 5.0).abs() < 1e-12, "{sum}");
    assert_eq!(open_faces(&parts).0, 0);
    // A cube as a polyhedron, its faces in any sense.
    let faces: [[u32; 4]; 6] = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 1, 5, 4], [1, 2, 6, 5], [7, 6, 2, 3], [3, 0, 4, 7]];
    let stream: Vec<u32> = std::iter::once(6).chain(faces.iter().flat_map(|face| std::iter::once(4).chain(*face))).collect();
    let parts = of(hexahedron().to_vec(), &[(CellType::POLYHEDRON, &stream)], linear).expect("sound");
    assert_fills(&parts, 1.0, linear);
    let open = of(hexahedron().to_vec(), &[(CellType::POLYHEDRON, &[&[5][..], &stream[1..26]].concat())], linear).expect("some tets");
    assert!(open.notes.iter().any(|note| note.contains("do not close")), "{:?}", open.notes);
}

#[test]
fn cells_that_are_not_convex_are_split_about_their_middle() {
    let mut points = hexahedron();
    // Over a dart, whose diagonal is not that of the corner with the lowest number.
    (points[1], points[5]) = (v(0.4, 0.55, 0.0), v(0.4, 0.55, 1.0));
    let parts = one(CellType::HEXAHEDRON, &points, linear);
    assert!(volumes(&parts).iter().all(|&v| v > 0.0));
    assert_eq!(parts.points.len(), 9);
    assert!((parts.point_data[0].values.get(8) - linear(parts.points[8])).abs() < 1e-12);
    assert_eq!(TetMesh::new(parts).expect("valid").inverted_count(), 0);
}

#[test]
fn concave_faces_are_cut_alike_from_both_sides() {
    let points = [v(0., 0., 0.), v(2., 0., 0.), v(0.5, 0.5, 0.), v(0., 2., 0.), v(3., 3., 0.)];
    for ring in [&[0u32, 1, 2, 3][..], &[1, 4, 3, 0], &[3, 2, 1, 4], &[0, 1, 2, 3, 3]] {
        let cut = |ring: &[u32]| {
            let mut out = vec![];
            face::triangulate(&points, ring, &mut out);
            out
        };
        let sorted = |triangles: Vec<[u32; 3]>| {
            let mut all = triangles;
            all.iter_mut().for_each(|t| t.sort_unstable());
            all.sort_unstable();
            all
        };
        let first = cut(ring);
        for turn in 0..ring.len() {
            let mut other = ring.to_vec();
            other.rotate_left(turn);
            assert_eq!(sorted(cut(&other)), sorted(first.clone()));
            other.reverse();
            let mirrored = cut(&other);
            let area =
                |t: &[u32; 3]| (points[t[1] as usize] - points[t[0] as usize]).cross(points[t[2] as usize] - points[t[0] as usize]).z;
            let (a, b): (f64, f64) = (first.iter().map(area).sum(), mirrored.iter().map(area).sum());
            assert!((a + b).abs() < 1e-12 && first.iter().all(|t| area(t) * a >= 0.0), "{ring:?}");
            assert_eq!(sorted(mirrored), sorted(first.clone()));
        }
    }
}

#[test]
fn what_is_left_out_is_said_and_what_is_broken_is_named() {
    let points = [&hexahedron()[..], &[v(9., 9., 9.)]].concat();
    let cells: [(CellType, &[u32]); 4] = [
        (CellType::TRIANGLE, &[0, 1, 2]),
        (CellType::TETRA, &[0, 1, 3, 4]),
        (CellType::VERTEX, &[8]),
        (CellType::LAGRANGE_HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7]),
    ];
    let parts = of(points.clone(), &cells, linear).expect("sound");
    assert_eq!((parts.points.len(), parts.tets.len(), parts.file_cells.number(0), parts.file_cells.number(3)), (8, 7, 1, 3));
    assert_eq!(parts.file_cells.cell_type(0), CellType::TETRA);
    assert_eq!(parts.notes[0], "1 vertex (type 1) and 1 triangle (type 5) set aside: they have no volume");
    assert_eq!(parts.notes[1], "1 points are of no cell with a volume and were left out");
    for (cells, expected) in [
        (&[(CellType::TRIANGLE, &[0u32, 1, 2][..])][..], "has no cell with a volume: it holds 1 triangle (type 5)"),
        (&[(CellType::TETRA, &[0, 1, 2])], "cell 0, a tetrahedron (type 10), has 3 points, expected 4"),
        (&[(CellType::WEDGE, &[0, 1, 2, 3, 4, 9])], "cell 0 uses point 9, but there are only 9 points"),
        (&[(CellType::POLYHEDRON, &[2, 3, 0, 1, 2, 3, 0, 1])], "the faces of polyhedron 0"),
        (&[(CellType::POLYHEDRON, &[u32::MAX, 3, 0, 1, 2])], "the faces of polyhedron 0"),
        (&[(CellType::POLYHEDRON, &[])], "the faces of polyhedron 0"),
    ] {
        let error = of(points.clone(), cells, linear).expect_err("broken").to_string();
        assert!(error.contains(expected), "{error}");
    }
}
