//! Texts with all numbers in them, and files as FEniCSx writes them.

use crate::format::{Contents, FormatError, ReadOptions, Source, contents, named, read_contents};
use crate::mesh::{CellType, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use std::path::{Path, PathBuf};

const FENICSX: &str = include_str!("../../../tests/meshes/hdf/fenicsx.xdmf");
const FENICSX_H5: &[u8] = include_bytes!("../../../tests/meshes/hdf/fenicsx.h5");
const POINTS: &str = "<Geometry GeometryType='XYZ'><DataItem Dimensions='5 3'>0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataItem></Geometry>";
const TETS: &str = "<Topology TopologyType='Tetrahedron' NumberOfElements='2'><DataItem NumberType='Int' Dimensions='2 4'>0 1 2 3 1 2 3 4\
                    </DataItem></Topology>";

fn cells_of(contents: Contents) -> UnstructuredGrid {
    match contents {
        Contents::Cells(grid) => grid,
        other => panic!("{other:?}"),
    }
}

fn read(text: &str) -> Result<UnstructuredGrid, FormatError> {
    let source = Source::Bytes(text.as_bytes());
    let found = contents(&source, Path::new("mesh.xdmf"), &ReadOptions::default(), &Progress::new());
    found.map(cells_of).map_err(|problem| named(Path::new("mesh.xdmf"), problem))
}

fn domain(inner: &str) -> String {
    format!("<?xml version='1.0'?><Xdmf Version='3.0'><Domain>{inner}</Domain></Xdmf>")
}

fn uniform(inner: &str) -> String {
    domain(&format!("<Grid>{POINTS}{TETS}{inner}</Grid>"))
}

fn array<'a>(arrays: &'a [DataArray], name: &str) -> &'a DataArray {
    arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no array {name}"))
}

fn points_of(grid: &UnstructuredGrid) -> Vec<[f64; 3]> {
    grid.points.iter().map(|point| point.to_array()).collect()
}

#[test]
fn numbers_in_the_text() {
    let arrays = "<Attribute Name='a'><DataItem Dimensions='5' Precision='8'>1 2 nan 4 .1</DataItem></Attribute>\
                  <Attribute Name='b' Center='Cell' AttributeType='Vector'><DataItem Dimensions='2 3'>1 2 3 4 5 6</DataItem></Attribute>\
                  <Attribute Name='c' Center='Grid'><DataItem Dimensions='1'>1</DataItem></Attribute>\
                  <Attribute Name='d'><DataItem Dimensions='4'>1 2 3 4</DataItem></Attribute>\
                  <Attribute Name='e'><DataItem Dimensions='5'>1 2 3 4</DataItem></Attribute>";
    let grid = read(&uniform(arrays)).expect("sound");
    assert_eq!(points_of(&grid)[4], [1.0; 3]);
    assert_eq!(grid.cells.iter().collect::<Vec<_>>(), [(CellType::TETRA, &[0, 1, 2, 3][..]), (CellType::TETRA, &[1, 2, 3, 4])]);
    let Values::F64(a) = &array(&grid.point_data, "a").values else { panic!("of 64 bits") };
    assert!(a[2].is_nan() && (a[0], a[4]) == (1.0, 0.1));
    let b = array(&grid.cell_data, "b");
    assert_eq!((b.components, &b.values), (3, &Values::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])));
    let expected = [
        "<Attribute> \"c\" has values on each grid and was left out",
        "<Attribute> \"d\" has 4 numbers [4] for 5 points and was left out",
        "<Attribute> \"e\" was left out: <DataItem>: 4 numbers, expected as many as its Dimensions [5] say",
    ];
    assert_eq!(grid.notes, expected);
}

#[test]
fn coordinates_of_other_kinds() {
    let planar = "<Grid><Geometry GeometryType='XY'><DataItem>0 1 2 3</DataItem></Geometry><Topology Type='Polyvertex'/></Grid>";
    let grid = read(&domain(planar)).expect("sound");
    assert_eq!((points_of(&grid), grid.cells.counts()), (vec![[0.0, 1.0, 0.0], [2.0, 3.0, 0.0]], vec![(CellType::VERTEX, 2)]));
    let apart = planar
        .replace("'XY'><DataItem>0 1 2 3</DataItem>", "'X_Y_Z'><DataItem>0 1</DataItem><DataItem>2 3</DataItem><DataItem>4 5</DataItem>");
    assert_eq!(points_of(&read(&domain(&apart)).expect("sound")), [[0.0, 2.0, 4.0], [1.0, 3.0, 5.0]]);
}

#[test]
fn spatial_collections_are_joined() {
    let with = format!("<Grid Name='1'>{POINTS}{TETS}<Attribute Name='a' Center='Cell'><DataItem>1 2</DataItem></Attribute></Grid>");
    let referred = "<Grid Name='2'><Topology Reference='/Xdmf/Domain/Grid/Grid[1]/Topology'/>\
                    <Geometry Reference='XML'>//Grid[@Name=\"1\"]/Geometry</Geometry></Grid>";
    let grid = read(&domain(&format!("<Grid GridType='Collection' CollectionType='Spatial'>{with}{referred}</Grid>"))).expect("sound");
    assert_eq!((grid.points.len(), grid.cells.len(), grid.cells.get(3).1), (10, 4, &[6, 7, 8, 9][..]));
    assert_eq!(format!("{:?}", grid.cell_data[0].values), "F32([1.0, 2.0, NaN, NaN])");
}

#[test]
fn plain_bytes_lie_beside() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes: Vec<u8> = [9.0f32, 1.5, 2.5].iter().flat_map(|number| number.to_be_bytes()).collect();
    std::fs::write(folder.path().join("q.bin"), bytes).expect("written");
    let item = "<DataItem Format='Binary' Endian='Big' Seek='4' Dimensions='2'>q.bin</DataItem>";
    let text = uniform(&format!("<Attribute Name='q' Center='Cell'>{item}</Attribute>"));
    let path = folder.path().join("mesh.xdmf");
    let read = |text: &str| {
        std::fs::write(&path, text).expect("written");
        read_contents(&path, &ReadOptions::default(), &Progress::new()).map(cells_of)
    };
    assert_eq!(read(&text).expect("sound").cell_data[0].values, Values::F32(vec![1.5, 2.5]));
    let notes = |text: &str| read(text).expect("the cells are sound").notes.join("");
    assert!(
        notes(&text.replace("q.bin", "../q.bin")).contains("it names the file \"../q.bin\", expected a file in the same folder or below")
    );
    let error = read(&text.replace("Dimensions='2'>q", "Dimensions='3'>q")).expect_err("past the end").to_string();
    assert!(error.contains("its file q.bin: <DataItem>: 12 bytes, expected 12 bytes from byte 4 on"), "{error}");
    assert!(read(&text.replace("q.bin", "r.bin")).is_err_and(|e| e.to_string().contains("its file r.bin: ")));
}

/// The mesh stands before two series in time that refer to it, numbers are in HDF5.
#[test]
fn a_file_of_fenicsx() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fenicsx.xdmf");
    let read = |text: &str| {
        std::fs::write(&path, text).expect("written");
        read_contents(&path, &ReadOptions::default(), &Progress::new()).map(cells_of)
    };
    assert!(read(FENICSX).is_err_and(|e| e.to_string().contains("its file fenicsx.h5: ")));
    std::fs::write(folder.path().join("fenicsx.h5"), FENICSX_H5).expect("written");
    let grid = read(FENICSX).expect("sound");
    assert_eq!((grid.points.len(), grid.cells.get(1)), (9, (CellType::TETRA, &[5, 6, 7, 8][..])));
    let (u, p) = (array(&grid.point_data, "u"), array(&grid.point_data, "p"));
    assert_eq!((u.components, &u.values), (3, &Values::F64((0..27).map(f64::from).collect())));
    assert_eq!((p.components, p.values.get(8)), (1, 8.0));
    assert_eq!(grid.notes, ["of 2 time steps the first (time 0) was read"]);
    let error = read(&FENICSX.replace("/Mesh/mesh/topology", "/Mesh/nowhere")).expect_err("not there").to_string();
    assert!(error.ends_with("<DataItem>: no data set \"/Mesh/nowhere\" in \"fenicsx.h5\", expected one there"), "{error}");
}

#[test]
fn what_is_not_sound_is_said_in_one_line() {
    let regular = "<Grid><Topology TopologyType='3DCoRectMesh' Dimensions='2 2 2'/><Geometry/></Grid>";
    let itself = "<Grid GridType='Tree' Name='a'><Grid Reference='/Xdmf/Domain/Grid'/></Grid>";
    let circle = "<Grid GridType='Tree'><Grid Reference='/Xdmf/Domain/Grid/Grid'/></Grid>";
    for (text, expected) in [
        ("<Xdmf>".to_owned(), "mesh.xdmf: byte 6: the end of the file within <Xdmf>, expected well-formed XML"),
        (domain(""), "mesh.xdmf: is an XDMF file without a <Grid> in a <Domain>"),
        (domain("<Grid/>"), "<Grid>: no <Topology> or no <Geometry>"),
        (domain(regular), "has a regular grid (3DCoRectMesh), octetra reads XDMF files with lists of cells"),
        (domain(itself), "<Grid> \"a\": a grid in itself, or in too many others"),
        (domain(circle), "<Grid>: references in a circle"),
        (uniform("").replace("Tetrahedron", "Tetrahedral"), "has cells of type \"Tetrahedral\", which octetra does not know"),
        (uniform("").replace("NumberOfElements='2'", "NumberOfElements='3'"), "<Topology>: 2 cells, expected 3 as NumberOfElements says"),
        (uniform("").replace("'2 4'", "'2 5'"), "<DataItem>: 8 numbers, expected as many as its Dimensions [2, 5] say"),
        (uniform("").replace("1 2 3 4<", "1 2 x 4<"), "<DataItem>: \"x\", expected a whole number"),
        (uniform("").replace("1 2 3 4<", "1 2 -3 4<"), "<Topology>: -3, expected numbers of points from 0"),
        (uniform("").replace("'5 3'", "'99999999999 99999999999'"), "<DataItem>: 15 numbers, expected as many as its Dimensions"),
        (uniform("").replace("<DataItem Dim", "<DataItem Format='HDF' Dim"), "expected a file and a path in it, as in mesh.h5:/points"),
        (uniform("<include xpointer='xpointer(//Nothing)'/>"), "<include>: the path \"xpointer(//Nothing)\" to nothing"),
        (uniform("<include href='other.xdmf'/>"), "includes elements of the file \"other.xdmf\""),
    ] {
        let error = read(&text).expect_err(expected).to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn no_damage_breaks_the_reader() {
    let text = uniform(
        "<Attribute Name='a'><DataItem ItemType='HyperSlab'><DataItem NumberType='Int'>0 1 5</DataItem><DataItem>1 2 3 4 5</DataItem></DataItem></Attribute>",
    );
    assert_eq!(read(&text).expect("sound").point_data[0].values.len(), 5);
    for i in 0..text.len() {
        for byte in [b'<', b'9', b' ', b'/', b'&', b'-'] {
            let mut bytes = text.clone().into_bytes();
            bytes[i] = byte;
            let _ = read(&String::from_utf8_lossy(&bytes));
        }
        let _ = read(&text[..i]);
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn real_files() {
    let shared = PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED is set")).join("data/interop");
    for (name, points, counts, arrays) in [
        ("spx_variants/spx.xdmf", 2896, [(CellType::TETRA, 12936)], (1, 0)),
        ("xdmf/meshio_out.xdmf", 4, [(CellType::TRIANGLE, 2)], (2, 1)),
    ] {
        let grid = cells_of(read_contents(&shared.join(name), &ReadOptions::default(), &Progress::new()).expect(name));
        assert_eq!((grid.points.len(), grid.cells.counts()), (points, counts.to_vec()), "{name}");
        assert_eq!((grid.point_data.len(), grid.cell_data.len()), arrays, "{name}");
    }
}
