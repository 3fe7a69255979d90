use super::super::parse::parsed;
use super::*;
use crate::format::{Contents, FormatError, ReadOptions, read_contents};
use crate::mesh::Values;
use std::fs;

/// Two instances of a part and another part.
pub(in crate::format) const ASSEMBLY: &str = "*PART, NAME=a\n*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n\
    *ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n*END PART\n*ASSEMBLY\n*INSTANCE, NAME=i, PART=a\n*END INSTANCE\n\
    *INSTANCE, NAME=j, PART=a\n1, 0, 0\n1, 0, 0, 1, 0, 2, 90\n*END INSTANCE\n*END ASSEMBLY\n";

pub(in crate::format) const TET: &str = "*Heading\n a tet and a shell\n** a comment\n*Element, type=C3D4, elset=Solid\n 7, 11, 12,\n 13, 14\n*Node, nset=all\n\
    11, 0., 0., 0.\n12, 1.d0, 0, 0\n13, 0., 1.\n14, 0., 0., 1.5,\n\n*NSET, NSET=a, GENERATE\n11, 14, 1\n*ELEMENT,\nTYPE=S3R\n8, 11, 12, 13\n\
    *ELEMENT, TYPE=SPRINGA\n9, 11, 12\n*MATERIAL, NAME=steel\n*ELASTIC\n1, 2\n*ELGEN\n7, 2, 3, 4\n";

#[test]
fn nodes_elements_and_sets() {
    let grid = parsed(read, TET.as_bytes()).expect("sound");
    assert!(recognizes(TET.as_bytes()) && !recognizes(b"3 1 0 0 0\n"));
    assert_eq!(grid.points, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z * 1.5]);
    assert_eq!(grid.cells.get(0), (CellType::TETRA, &[0, 1, 2, 3][..]));
    assert_eq!(grid.cells.get(1), (CellType::TRIANGLE, &[0, 1, 2][..]));
    assert_eq!((grid.cells.len(), &grid.cell_data[0].values), (2, &Values::F32(vec![1.0, 0.0])));
    assert_eq!(
        grid.notes,
        [
            "1 lines of elements of type \"SPRINGA\" were left out: they are no cells or not known",
            "*ELGEN was left out (1 times), and with it the nodes or elements that it makes",
            "the names of element sets are not kept, only their numbers in abaqus:elset: 1 is \"Solid\"",
            "other sets (*NSET, *ELSET) were left out"
        ]
    );
}

#[test]
fn parts_have_numbers_of_their_own() {
    let part = |name: &str, x: u32| {
        format!(
            "*PART, NAME={name}\n*NODE\n1, {x}, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n*END PART\n"
        )
    };
    let grid = parsed(read, (part("a", 5) + &part("b", 6)).as_bytes()).expect("sound");
    assert_eq!(grid.cells.get(1), (CellType::TETRA, &[4, 5, 6, 7][..]));
    assert_eq!((grid.points.len(), grid.points[4].x), (8, 6.0));
    assert!(grid.notes.is_empty(), "{:?}", grid.notes);

    // The second instance of a is shifted by 1 along x, then turned by 90 degrees about the line x = 1, y = 0 along z.
    let assembly = "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=i, PART=A\n0, 0, 10\n*END INSTANCE\n\
        *INSTANCE, NAME=j, PART=a\n1, 0, 0\n1, 0, 0, 1, 0, 2, 90\n*END INSTANCE\n*INSTANCE, NAME=k, PART=c\n*END INSTANCE\n\
        *NODE\n1, 9, 9, 9\n*END ASSEMBLY\n";
    let grid = parsed(read, (part("a", 5) + &part("b", 6) + assembly).as_bytes()).expect("sound");
    assert_eq!((grid.points.len(), grid.cells.len()), (13, 3));
    assert_eq!((grid.points[0], grid.points[4]), (DVec3::new(5.0, 0.0, 10.0), DVec3::X * 6.0));
    assert_eq!(grid.cells.get(2), (CellType::TETRA, &[9, 10, 11, 12][..]));
    assert!(grid.points[9].distance(DVec3::new(1.0, 5.0, 0.0)) < 1e-12, "{:?}", grid.points[9]);
    assert!(grid.points[11].distance(DVec3::ZERO) < 1e-12, "{:?}", grid.points[11]);
    let notes = ["1 instances are of parts that are not in the file", "1 parts have no instance; they are where they are defined"];
    assert_eq!(grid.notes, notes);
    let many = "*INSTANCE, NAME=i, PART=A\n*END INSTANCE\n".repeat(3);
    assert_eq!(parsed(read, (part("a", 5) + &many).as_bytes()).expect("sound").cells.len(), 3);
    let error = parsed(read, (part("a", 5) + &assembly.replace("0, 0, 10", "0, 0, up")).as_bytes()).expect_err("no shift").to_string();
    assert!(error.contains("\"up\", expected a shift or a rotation"), "{error}");
}

#[test]
fn cylindrical_nodes_and_cells_of_higher_orders() {
    let nodes: String = (1..=27).map(|i| format!("{i}, 2, {}, 3\n", 90 * (i - 1))).collect();
    let all: String = (1..=27).map(|i| format!(", {i}")).collect();
    let grid = parsed(read, format!("*NODE, SYSTEM=C\n{nodes}*ELEMENT, TYPE=C3D27\n1{all}\n").as_bytes()).expect("sound");
    assert!(grid.points[1].distance(DVec3::new(0.0, 2.0, 3.0)) < 1e-12, "{:?}", grid.points[1]);
    let (cell_type, nodes) = grid.cells.get(0);
    assert_eq!((cell_type, &nodes[18..]), (CellType::TRIQUADRATIC_HEXAHEDRON, &[18, 19, 26, 24, 23, 25, 21, 22, 20][..]));
}

/// Reads `m.inp` beside other files.
fn opened(files: &[(&str, &str)]) -> Result<UnstructuredGrid, FormatError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("written");
    }
    match read_contents(&folder.path().join("m.inp"), &ReadOptions::default(), &Progress::new())? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_that_it_names_are_read_in_place() {
    let nodes = "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
    let grid = opened(&[
        ("m.inp", "*INCLUDE, INPUT=a.inp\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n*ELEMENT, TYPE=S3, INPUT=e.txt\n"),
        ("a.inp", "*NODE, INPUT=n.txt\n"),
        ("n.txt", nodes),
        ("e.txt", "2, 1, 2, 3\n"),
    ]);
    let grid = grid.expect("sound");
    assert_eq!((grid.points.len(), grid.cells.len()), (4, 2));
    let error = |files: &[(&str, &str)]| opened(files).expect_err("refused").to_string();
    let outside = error(&[("m.inp", "*INCLUDE, INPUT=../x.inp\n*NODE\n")]);
    assert!(outside.contains("it names the file \"../x.inp\", expected a file in the same folder or below"), "{outside}");
    let endless = error(&[("m.inp", "*NODE\n1, 0, 0, 0\n*INCLUDE, INPUT=m.inp\n")]);
    assert!(endless.contains("expected at most 256 files, at most 8 within each other"), "{endless}");
    let missing = error(&[("m.inp", "*NODE\n*INCLUDE, INPUT=none.inp\n")]);
    assert!(missing.contains("m.inp: its file none.inp: "), "{missing}");
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let error = |text: &str| parsed(read, text.as_bytes()).expect_err("not sound").to_string();
    for (found, expected) in [
        (error("4 1 0 0 0\n1 0 0 0\n"), "line 1: \"4 1 0 0 0\", expected a keyword, such as *NODE"),
        (error("*HEADING\n"), "the file: no nodes, expected a keyword *NODE with some"),
        (error(&TET.replace("13, 14\n", "13\n")), "line 5: an element of 3 nodes, expected 4 nodes"),
        (error(&TET.replace("13, 14\n", "13, 14, 12\n")), "line 6: an element of 5 nodes, expected 4 nodes"),
        (error(&TET.replace("13, 14\n", "13, 15\n")), "element 7: node 15, expected a node of the same part or file"),
        (error(&TET.replace("13, 14\n", "13, a.14\n")), "line 6: \"a.14\", expected the number of an element or node"),
        (error(&TET.replace("1.d0", "one")), "line 9: \"one\", expected a coordinate"),
        (error(&TET.replace(", type=C3D4", "")), "line 4: *ELEMENT without a type, expected *ELEMENT, TYPE=.."),
        (error(&TET.replace("nset=all", "SYSTEM=S")), "line 7: *NODE, SYSTEM=S, expected R (Cartesian) or C (cylindrical)"),
        (error(&format!("*SYSTEM\n1, 0, 0\n{TET}")), "line 2: a coordinate system of its own (*SYSTEM), expected"),
        (error("*INCLUDE\n"), "line 1: *INCLUDE without a file, expected *INCLUDE, INPUT=.."),
    ] {
        assert!(found.contains(expected), "{found}\n{expected}");
    }
}
