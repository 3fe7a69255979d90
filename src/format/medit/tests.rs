use super::super::parse::parsed;
use super::*;
use crate::format::{Contents, FormatError, ReadOptions, read_contents};
use crate::mesh::Values;
use std::fs;

const TEXT: &str = "MeshVersionFormatted 2\n# a comment\nDimension\n3\nVertices\n5\n0 0 0 1\n1 0 0 2\n0 1 0 3\n0 0 0.1 4\n1 1 1 5\n\
    Triangles 1\n1 2 3 9\nCorners\n2\n1\n2\nTetrahedra\n2\n1 2 3 4 7\n2 3 4 5 8\nRidges 0\nEnd\n";

/// The same mesh in binary; keywords are 4 bytes, `next` points behind each section.
fn binary(version: i32, is_big: bool) -> Vec<u8> {
    let mut out = Vec::new();
    let put = |out: &mut Vec<u8>, mut little: Vec<u8>| {
        if is_big {
            little.reverse();
        }
        out.extend(little);
    };
    let integer =
        |out: &mut Vec<u8>, n: i64| put(out, if version == 4 { n.to_le_bytes().to_vec() } else { (n as i32).to_le_bytes().to_vec() });
    let real =
        |out: &mut Vec<u8>, n: f64| put(out, if version == 1 { (n as f32).to_le_bytes().to_vec() } else { n.to_le_bytes().to_vec() });
    let small = |out: &mut Vec<u8>, n: i32| put(out, n.to_le_bytes().to_vec());
    let position_bytes = if version < 3 { 4 } else { 8 };
    let section = |out: &mut Vec<u8>, code: i32, data: Vec<u8>| {
        small(out, code);
        let next = out.len() + position_bytes + data.len();
        put(out, (next as u64).to_le_bytes()[..position_bytes].to_vec());
        out.extend(data);
    };
    let integers = |numbers: &[i64]| {
        let mut data = Vec::new();
        numbers.iter().for_each(|&n| integer(&mut data, n));
        data
    };
    small(&mut out, 1);
    small(&mut out, version);
    section(&mut out, 3, if is_big { vec![0, 0, 0, 3] } else { vec![3, 0, 0, 0] });
    let mut data = integers(&[5]);
    for (i, point) in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1], [1.0, 1.0, 1.0]].iter().enumerate() {
        point.iter().for_each(|&c| real(&mut data, c));
        integer(&mut data, i as i64 + 1);
    }
    section(&mut out, 4, data);
    section(&mut out, 6, integers(&[1, 1, 2, 3, 9]));
    section(&mut out, 13, integers(&[2, 1, 2]));
    section(&mut out, 8, integers(&[2, 1, 2, 3, 4, 7, 2, 3, 4, 5, 8]));
    small(&mut out, 54);
    put(&mut out, vec![0; position_bytes]);
    out
}

#[test]
fn text_and_all_binary_versions_are_read_alike() {
    let mut files = vec![("text".into(), TEXT.as_bytes().to_vec())];
    for version in 1..=4 {
        for is_big in [false, true] {
            files.push((format!("version {version}, big {is_big}"), binary(version, is_big)));
        }
    }
    // A PLOT3D grid of one block of 2 x 3 x 9 points begins alike.
    let plot3d: Vec<u8> = [1, 2, 3, 9].into_iter().flat_map(i32::to_le_bytes).chain([0; 64]).collect();
    assert!(!recognizes(&plot3d));
    for (name, bytes) in files {
        assert!(recognizes(&bytes), "{name}");
        let grid = parsed(read, &bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        let tenth = if name.starts_with("version 1") { f64::from(0.1f32) } else { 0.1 };
        assert_eq!((grid.points.len(), grid.points[3]), (5, DVec3::Z * tenth), "{name}");
        let cells: Vec<_> = grid.cells.iter().collect();
        let expected: [(_, &[u32]); 3] =
            [(CellType::TRIANGLE, &[0, 1, 2]), (CellType::TETRA, &[0, 1, 2, 3]), (CellType::TETRA, &[1, 2, 3, 4])];
        assert_eq!(cells, expected, "{name}");
        assert_eq!(grid.point_data[0].values, Values::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0]), "{name}");
        assert_eq!((&*grid.cell_data[0].name, &grid.cell_data[0].values), ("medit:ref", &Values::F32(vec![9.0, 7.0, 8.0])), "{name}");
        let left_out = if name == "text" { "Corners" } else { "keyword 13" };
        assert_eq!(grid.notes, [format!("sections were left out: {left_out}")]);
    }
}

#[test]
fn cells_of_higher_orders() {
    let nodes = |count: usize| (1..=count).map(|i| format!("{i} ")).collect::<String>();
    let points: String = (1..=27).map(|i| format!("{i} 0 0\n")).collect();
    let text = format!(
        "MeshVersionFormatted 1 Dimension 2 Vertices 27 {points} TetrahedraP2 1 {} 3 HexahedraQ2 1 {} 4 QuadrilateralsQ2 1 {} 5 End",
        nodes(10),
        nodes(27),
        nodes(9)
    );
    let grid = parsed(read, text.as_bytes()).expect("sound");
    assert_eq!(grid.cells.get(0), (CellType::QUADRATIC_TETRA, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9][..]));
    assert_eq!(grid.cells.get(1), (CellType::HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7][..]));
    assert_eq!(grid.cells.get(2).0, CellType::BIQUADRATIC_QUAD);
    assert_eq!(grid.notes, ["1 cells with 27 nodes are taken as hexahedra of 8"]);
}

/// Reads a mesh with a solution beside it.
fn with_solution(name: &str, solution: &[u8]) -> Result<UnstructuredGrid, FormatError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("m.mesh"), TEXT).expect("written");
    fs::write(folder.path().join(name), solution).expect("written");
    match read_contents(&folder.path().join("m.mesh"), &ReadOptions::default(), &Progress::new())? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_solution_beside_comes_with_the_mesh() {
    let text = "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n5\n2 1 2\n1 10 11 12\n2 20 21 22\n3 0 0 0\n4 0 0 0\n5 50 51 52\n\
        SolAtTetrahedra 2 1 1 0.5 0.25 End\n";
    let grid = with_solution("m.sol", text.as_bytes()).expect("sound");
    assert_eq!(
        grid.point_data.iter().map(|a| (&*a.name, a.components)).collect::<Vec<_>>(),
        [("medit:ref", 1), ("solution", 1), ("solution 2", 3)]
    );
    assert_eq!(grid.point_data[1].values, Values::F64(vec![1.0, 2.0, 3.0, 4.0, 5.0]));
    assert_eq!((grid.point_data[2].values.get(3), grid.point_data[2].values.get(14)), (20.0, 52.0));
    let values = &grid.cell_data[1].values;
    assert!(values.get(0).is_nan(), "the triangle has none");
    assert_eq!((&*grid.cell_data[1].name, values.get(1), values.get(2)), ("solution 3", 0.5, 0.25));

    let binary: Vec<u8> = [1, 1, 3, 20, 3, 62, 0, 5, 1, 1].into_iter().flat_map(i32::to_le_bytes).collect();
    let binary: Vec<u8> = binary.into_iter().chain([1.5f32, 2.5, 3.5, 4.5, 5.5].into_iter().flat_map(f32::to_le_bytes)).collect();
    let grid = with_solution("m.solb", &binary).expect("sound");
    assert_eq!(grid.point_data[1].values, Values::F64(vec![1.5, 2.5, 3.5, 4.5, 5.5]));

    let grid = with_solution("m.sol", b"MeshVersionFormatted 2 Dimension 3 SolAtVertices 1 1 1 5 End").expect("only a note");
    assert_eq!((grid.point_data.len(), &*grid.notes[0]), (1, "a solution was left out: it has values for 1 vertices, the mesh has 5"));
    let error = with_solution("m.sol", b"MeshVersionFormatted 2 Dimension 3 SolAtVertices 5 1 7 5 End").expect_err("no such kind");
    let expected = "m.mesh: its file m.sol: line 1: an array of kind 7, expected 1 (scalar), 2 (vector)";
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let error = |text: &str| parsed(read, text.as_bytes()).expect_err("not sound").to_string();
    let mut looping = binary(2, false);
    looping[12..16].copy_from_slice(&2u32.to_le_bytes());
    assert!(parsed(read, &looping).is_ok(), "the dimension is read without its position");
    let corners = looping.windows(4).position(|w| w == [13, 0, 0, 0]).expect("corners");
    looping[corners + 4..corners + 8].copy_from_slice(&2u32.to_le_bytes());
    let backwards = parsed(read, &looping).expect_err("a position behind").to_string();
    for (found, expected) in [
        (error("MFEM mesh v1.0\n"), "line 1: \"MFEM\", expected MeshVersionFormatted, as Medit's files begin"),
        (error(&TEXT.replace("\n3\nVert", "\n4\nVert")), "line 4: dimension 4, expected 2 or 3"),
        (error(&TEXT.replace("Dimension\n3\n", "")), "line 3: no dimension so far, expected Dimension 2 or 3"),
        (error(&TEXT.replace("1 2 3 9", "0 2 3 9")), "line 13: vertex 0, expected vertices counted from 1"),
        (error(&TEXT.replace("Vertices\n5", "Vertices\n6")), "line 12: \"Triangles\", expected a coordinate"),
        (error(&TEXT.replace("Vertices\n5", "Vertices\n4")), "line 11: \"1\", expected the keyword of a section"),
        (error(&TEXT.replace("Vertices\n5", "Vertices\n-5")), "line 6: -5 vertices, expected 0 or more"),
        (error(&TEXT.replace("Tetrahedra\n2", "Tetrahedra\n2000000")), "2000000 cells, expected 0 or more, and no more than"),
        (error("MeshVersionFormatted 2 Dimension 3 SolAtVertices 1 1 1 5 End"), "the file: no section Vertices, expected one; a solution"),
        (backwards, "a section before 2, expected the position of the next"),
    ] {
        assert!(found.contains(expected), "{found}\n{expected}");
    }
    for version in 1..=4 {
        let whole = binary(version, false);
        for len in 0..whole.len() {
            let _ = parsed(read, &whole[..len]);
        }
    }
}

/// Sound files as text and of all binary versions.
pub(in crate::format) fn sound_files() -> Vec<Vec<u8>> {
    let solution = "MeshVersionFormatted 2 Dimension 3 Vertices 2 0 0 0 1 1 1 1 2 Edges 1 1 2 3 SolAtVertices 2 2 1 2 1 2 3 4 5 6 7 8\n\
        SolAtEdges 1 1 3 1 2 3 4 5 6 End\n";
    let binary = (1..=4).flat_map(|version| [binary(version, false), binary(version, true)]);
    binary.chain([TEXT.as_bytes().to_vec(), solution.as_bytes().to_vec()]).collect()
}
