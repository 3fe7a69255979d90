use super::*;
use crate::format::source::Source;
use crate::format::{GridFile, ReadOptions};
use crate::mesh::{UnstructuredGrid, Values};
use crate::progress::Progress;
use glam::DVec3;
use std::path::Path;

type Read = fn(&GridFile<'_>, &Progress) -> Result<UnstructuredGrid, ParseError>;

fn of(read: Read, bytes: &[u8]) -> Result<UnstructuredGrid, ParseError> {
    let file = GridFile { source: &Source::Bytes(bytes), path: Path::new("a"), options: &ReadOptions::default() };
    read(&file, &Progress::new())
}

fn good(read: Read, bytes: &[u8]) -> UnstructuredGrid {
    of(read, bytes).expect("sound")
}

fn error(read: Read, bytes: &[u8]) -> String {
    of(read, bytes).expect_err("not sound").to_string()
}

fn binary_stl(triangles: &[[[f32; 3]; 3]], attribute: u16) -> Vec<u8> {
    let mut bytes = vec![b's', b'o', b'l', b'i', b'd'];
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
    }
    bytes
}

const TEXT_STL: &str = "solid a b
 facet normal 0 0 1
  outer loop
   vertex 0 0 0
   vertex 1 0 0
   vertex 0 1 0
  endloop
 endfacet
endsolid a b
SOLID second
 facet normal 0 0 1
  outer loop
   vertex 1 0 0
   vertex 1 1 0
   vertex -0 1e0 0
  endloop
 endfacet
endsolid
";

#[test]
fn stl_points_are_merged_and_solids_told_apart() {
    let grid = good(stl::read, TEXT_STL.as_bytes());
    assert_eq!(grid.points, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)]);
    let cells: Vec<_> = grid.cells.iter().map(|(_, points)| points.to_vec()).collect();
    assert_eq!(cells, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(grid.cell_data[0].values, Values::F32(vec![0.0, 1.0]));

    let triangles = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, -0.0]]];
    let binary = good(stl::read, &binary_stl(&triangles, 0));
    assert_eq!((&binary.points, &binary.cells), (&grid.points, &grid.cells));
    assert!(binary.notes.is_empty() && binary.cell_data.is_empty());
    assert!(good(stl::read, &binary_stl(&triangles, 7)).notes[0].contains("2 triangles"));
    assert!(stl::recognizes(TEXT_STL.as_bytes()) && !stl::recognizes(&binary_stl(&triangles, 0)));
}

#[test]
fn stl_that_is_not_sound_is_refused_with_its_place() {
    let mut bytes = binary_stl(&[[[0.0; 3]; 3]; 3], 0);
    bytes[..5].fill(b' ');
    bytes.truncate(200);
    assert_eq!(
        error(stl::read, &bytes),
        "byte 80: 3 triangles, which would end at byte 234, expected no more than the file's 200 bytes have room for"
    );
    bytes[80..84].fill(255);
    assert!(error(stl::read, &bytes).starts_with("byte 80: 4294967295 triangles"));
    assert!(error(stl::read, b"").contains("at least 84 bytes"));
    assert_eq!(error(stl::read, TEXT_STL.replace("vertex 1 1 0", "vertex 1 one 0").as_bytes()), "line 14: \"one\", expected a coordinate");
    assert!(error(stl::read, &TEXT_STL.as_bytes()[..100]).contains("the end of the file"));
}

#[test]
fn off_faces_of_all_sizes_comments_and_colours() {
    let text = "OFF # a comment\n5 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0 # last but one\n0.5 2 0\n3 0 1 2\n4 0 1 2 3 255 0 0\n5 0 1 2 4 3\n";
    let grid = good(off::read, text.as_bytes());
    let types: Vec<_> = grid.cells.iter().map(|(t, points)| (t, points.len())).collect();
    assert_eq!(types, [(CellType::TRIANGLE, 3), (CellType::QUAD, 4), (CellType::POLYGON, 5)]);
    assert_eq!((grid.points[4], grid.notes.len()), (DVec3::new(0.5, 2.0, 0.0), 1));
    let colored = good(off::read, b"COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n1 1 0 1 0 0 1\n3 0 1 2\n");
    assert_eq!((colored.points.len(), colored.cells.len(), colored.notes.len()), (3, 1, 1));
    assert!(off::recognizes(b"# x\nSTCNOFF\n") && off::recognizes(b"OFF 3 1 0\n") && !off::recognizes(b"DOFF"));
    assert!(error(off::read, b"OFF 4000000000 1 0 0 0 0").contains("count of vertices 4000000000"));
    assert!(error(off::read, b"OFF 1 1 0 0 0 0 4000000000 0").contains("count of corners"));
    assert_eq!(error(off::read, b"OFF 1 1 0 0 0 0 3 0 -1 0"), "line 1: \"-1\", expected the number of a vertex, from 0");
    assert!(error(off::read, b"4OFF 1 1 0").contains("four"));
}

#[test]
fn obj_faces_by_all_kinds_of_numbers() {
    let text = "# x\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0 \\\n 1\ng one\nf 1/1/1 2//2 3\nv 0 1 0 0.1 0.2 0.3\ng two\nf -4 -3 -2 -1\nf 1 2 3 4 1\nl 1 2\nl 1 2 3\np 1 2\n";
    let grid = good(obj::read, text.as_bytes());
    let cells: Vec<_> = grid.cells.iter().map(|(t, points)| (t.0, points.to_vec())).collect();
    let expected: [(u8, &[u32]); 7] =
        [(5, &[0, 1, 2]), (9, &[0, 1, 2, 3]), (7, &[0, 1, 2, 3, 0]), (3, &[0, 1]), (4, &[0, 1, 2]), (1, &[0]), (1, &[1])];
    assert_eq!(cells, expected.map(|(t, points)| (t, points.to_vec())));
    assert_eq!(grid.cell_data[0].values, Values::F32(vec![0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]));
    assert_eq!(grid.notes.len(), 2, "{:?}", grid.notes);
    assert!(error(obj::read, b"v 0 0 0\nf 0 1 2").starts_with("line 2: \"0\", expected the number"));
    assert!(error(obj::read, b"v 0 0 0\nf -2 1 1").starts_with("line 2: \"-2\""));
    assert!(error(obj::read, b"v 0 0\n").starts_with("line 1: \"\", expected three coordinates"));
    assert!(error(obj::read, b"v 0 0 0\nf 1 1\n").contains("3 or more"));
    assert!(error(obj::read, b"hello there\n").contains("statements of an OBJ file"));
}

const PLY: &str = "ply
format ascii 1.0
comment made by hand
element vertex 4
property float x
property float y
property double z
property float nx
property float ny
property float nz
property uchar quality
element face 2
property list uchar int vertex_indices
property int region
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 0 0 1 10
1 0 0 0 0 1 20
1 1 0 0 0 1 30
0 1 0.1 0 0 1 40
3 0 1 2 7
4 0 1 2 3 16777217
0 1
";

/// The same in binary.
fn binary_ply(big: bool) -> Vec<u8> {
    let (head, body) = PLY.split_once("end_header\n").expect("a header");
    let order = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!("{}end_header\n", head.replace("ascii", order)).into_bytes();
    let mut put = |number: &str, kind: char| {
        let v: f64 = number.parse().expect("a number");
        let mut raw = match kind {
            'f' => (v as f32).to_le_bytes().to_vec(),
            'd' => v.to_le_bytes().to_vec(),
            'i' => (v as i32).to_le_bytes().to_vec(),
            _ => vec![v as u8],
        };
        if big {
            raw.reverse();
        }
        bytes.extend(raw);
    };
    for (line, kinds) in body.lines().zip(["ffdfffu", "ffdfffu", "ffdfffu", "ffdfffu", "uiiii", "uiiiii", "ii"]) {
        line.split(' ').zip(kinds.chars()).for_each(|(number, kind)| put(number, kind));
    }
    bytes
}

#[test]
fn ply_reads_alike_in_all_three_encodings() {
    let text = good(ply::read, PLY.as_bytes());
    assert_eq!((text.points[3], text.points.len()), (DVec3::new(0.0, 1.0, 0.1), 4));
    let cells: Vec<_> = text.cells.iter().map(|(t, points)| (t.0, points.to_vec())).collect();
    assert_eq!(cells, [(5, vec![0, 1, 2]), (9, vec![0, 1, 2, 3])]);
    let arrays: Vec<_> = text.point_data.iter().map(|a| (a.name.as_str(), a.components)).collect();
    assert_eq!(arrays, [("normal", 3), ("quality", 1)]);
    assert_eq!(text.cell_data[0].values, Values::F64(vec![7.0, 16777217.0]));
    assert_eq!(text.notes, ["1 elements \"edge\" were left out"]);
    for big in [false, true] {
        let binary = good(ply::read, &binary_ply(big));
        assert_eq!((&binary.points, &binary.cells), (&text.points, &text.cells));
        assert_eq!((&binary.point_data, &binary.cell_data), (&text.point_data, &text.cell_data));
    }
    let crlf = good(ply::read, PLY.replace('\n', "\r\n").as_bytes());
    assert_eq!(crlf.cells, text.cells);
}

#[test]
fn ply_strips_are_parted_and_unsound_files_refused() {
    let strips = PLY.split("element face").next().expect("a start").to_owned()
        + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        + &"0 0 0 0 0 1 1\n".repeat(4)
        + "8 0 1 2 3 -1 0 2 3\n";
    let grid = good(ply::read, strips.as_bytes());
    let cells: Vec<_> = grid.cells.iter().map(|(t, points)| (t.0, points.to_vec())).collect();
    assert_eq!(cells, [(6, vec![0, 1, 2, 3]), (6, vec![0, 2, 3])]);
    assert!(error(ply::read, PLY.replace("vertex 4", "vertex 4000000000").as_bytes()).contains("have room for"));
    assert!(error(ply::read, PLY.replace("\n3 0 1 2 7", "\n3 0 -1 2 7").as_bytes()).contains("-1, expected the number of a vertex"));
    assert!(error(ply::read, PLY.replace("\n3 0 1 2 7", "\n1e9 0 1 2 7").as_bytes()).contains("a list of 1000000000 numbers"));
    assert!(error(ply::read, PLY.replace("property float y\n", "").as_bytes()).contains("without x, y and z"));
    assert!(error(ply::read, b"ply\nformat ascii 1.0\nelement face 1\nproperty quad a\n").starts_with("line 4"));
    assert!(error(ply::read, b"ply\n").contains("end_header"));
    let binary = binary_ply(true);
    assert!(error(ply::read, &binary[..binary.len() - 9]).contains("bytes"));
}

#[test]
fn what_is_written_as_ply_reads_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.ply");
    let points = [DVec3::new(0.1, 0.0, 0.0), DVec3::X, DVec3::Y, DVec3::Z * 1e6];
    write_ply(&path, &points, &[[0, 1, 2], [3, 2, 1]], "distance", &[0.1, 0.2, 0.3, f64::NAN]).expect("written");
    let grid = good(ply::read, &std::fs::read(&path).expect("a file"));
    assert_eq!((&grid.points[..], grid.cells.get(1).1), (&points[..], &[3, 2, 1][..]));
    assert_eq!((grid.point_data[0].name.as_str(), grid.point_data[0].values.get(2)), ("distance", 0.3));
}
