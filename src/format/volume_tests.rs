//! Small volumes made by hand in every way that their formats know, and files made to do harm.

use super::*;
use crate::volume::{GridFrame, Samples};
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use glam::{DMat3, DVec3};
use std::io::Write;
use tempfile::TempDir;

/// 3 x 2 x 2 numbers that need all bits of 16, but for single bytes.
const VALUES: [i64; 12] = [0, 1, 2, 3, 100, 5, 6, 7, 8, 9, 10, 127];

fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    folder
}

fn read_from(folder: &TempDir, name: &str, options: &ReadOptions) -> Result<Grid, String> {
    match read(&folder.path().join(name), options, &Progress::new()) {
        Ok(Data::Grid(grid)) => Ok(grid),
        Ok(Data::Mesh(_)) => panic!("a mesh"),
        Err(error) => Err(error.to_string()),
    }
}

fn grid(files: &[(&str, &[u8])]) -> Grid {
    read_from(&folder(files), files[0].0, &ReadOptions::default()).expect("sound")
}

/// The reason why a file is refused, which must be one line that begins with the file.
fn refused(files: &[(&str, &[u8])], options: &ReadOptions) -> String {
    let folder = folder(files);
    let error = read_from(&folder, files[0].0, options).expect_err("broken");
    let rest = error.strip_prefix(&format!("{}: ", folder.path().join(files[0].0).display()));
    assert!(!error.contains('\n'), "{error}");
    rest.unwrap_or_else(|| panic!("{error}")).to_owned()
}

fn assert_refused(files: &[(&str, &[u8])], expected: &str) {
    let error = refused(files, &ReadOptions::default());
    assert!(error.contains(expected), "\"{error}\" does not say \"{expected}\"");
}

fn numbers(grid: &Grid) -> Vec<f64> {
    (0..grid.samples().len()).map(|i| grid.samples().get(i)).collect()
}

/// The numbers as bytes of a type by its name in Rust.
fn bytes(name: &str, values: &[i64], big: bool) -> Vec<u8> {
    let one = |v: i64| {
        let mut bytes = match name {
            "u8" => (v as u8).to_le_bytes().to_vec(),
            "i8" => (v as i8).to_le_bytes().to_vec(),
            "u16" => (v as u16).to_le_bytes().to_vec(),
            "i16" => (v as i16).to_le_bytes().to_vec(),
            "u32" => (v as u32).to_le_bytes().to_vec(),
            "i32" => (v as i32).to_le_bytes().to_vec(),
            "u64" => (v as u64).to_le_bytes().to_vec(),
            "i64" => v.to_le_bytes().to_vec(),
            "f32" => (v as f32).to_le_bytes().to_vec(),
            _ => (v as f64).to_le_bytes().to_vec(),
        };
        if big {
            bytes.reverse();
        }
        bytes
    };
    values.iter().flat_map(|&v| one(v)).collect()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes everything")
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes everything")
}

fn text(values: &[i64]) -> String {
    values.iter().map(|v| format!("{v} ")).collect()
}

/// What comes back for numbers of a type: 64-bit integers become f64.
fn kept_as(name: &str) -> &str {
    if name.ends_with("64") { "f64" } else { name }
}

const PAIRS: [(&str, &str, &str); 10] = [
    ("u8", "unsigned char", "MET_UCHAR"),
    ("i8", "int8", "MET_CHAR"),
    ("u16", "ushort", "MET_USHORT"),
    ("i16", "short", "MET_SHORT"),
    ("u32", "uint32_t", "MET_UINT"),
    ("i32", "int", "MET_INT"),
    ("u64", "unsigned long long", "MET_ULONG_LONG"),
    ("i64", "longlong", "MET_LONG_LONG"),
    ("f32", "float", "MET_FLOAT"),
    ("f64", "double", "MET_DOUBLE"),
];

#[test]
fn nrrd_of_every_type_order_and_encoding_attached_and_detached() {
    let expected = VALUES.map(|v| v as f64);
    for (name, nrrd_type, _) in PAIRS {
        for (order, big) in [("little", false), ("big", true)] {
            let raw = bytes(name, &VALUES, big);
            for (encoding, data) in [("raw", raw.clone()), ("gzip", gzip(&raw)), ("ascii", text(&VALUES).into_bytes())] {
                let head = format!(
                    "NRRD0004\r\n# by hand\ntype: {nrrd_type}\ndimension: 3\nsizes: 3 2 2\nspacings: 1 2 0.5\nkey:=value: x\nendian: {order}\nencoding: {encoding}\n"
                );
                let attached = [head.as_bytes(), b"\n", &data].concat();
                let grid_attached = grid(&[("a.nrrd", &attached)]);
                let detached = format!("{head}data file: a.raw\n");
                let grid_detached = grid(&[("a.nhdr", detached.as_bytes()), ("a.raw", &data)]);
                for grid in [grid_attached, grid_detached] {
                    assert_eq!(numbers(&grid), expected, "{name} {order} {encoding}");
                    assert_eq!(grid.samples().type_name(), kept_as(name));
                    assert_eq!(*grid.frame(), GridFrame::along_axes([3, 2, 2], DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5)));
                }
            }
        }
    }
}

fn nrrd(fields: &str) -> Vec<u8> {
    [format!("NRRD0005\ntype: uint8\nencoding: raw\n{fields}\n\n").as_bytes(), &bytes("u8", &VALUES, false)].concat()
}

#[test]
fn nrrd_directions_origins_and_vectors() {
    let directed = "dimension: 3\nsizes: 3 2 2\nspace: left-posterior-superior\nspace directions: (0,2,0) (-1, 0, 0) (0,0,3.5)\nspace origin: (1,2,-3)";
    let steps = DMat3::from_cols(DVec3::new(0.0, 2.0, 0.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 3.5));
    assert_eq!(*grid(&[("a.nrrd", &nrrd(directed))]).frame(), GridFrame { dims: [3, 2, 2], origin: DVec3::new(1.0, 2.0, -3.0), steps });
    let mins = "dimension: 3\nsizes: 3 2 2\nspacings: 2 2 2\naxis mins: 1 nan -1";
    assert_eq!(grid(&[("a.nrrd", &nrrd(mins))]).frame().origin, DVec3::new(1.0, 0.0, -1.0));

    // 2 x 2 x 2 vectors of one and a half numbers do not exist: six along x are three of two.
    let twelve = |fields: &str, component| {
        let mut data = nrrd(fields);
        data.extend([3, 4, 0, 0]);
        let options = ReadOptions { component, ..Default::default() };
        read_from(&folder(&[("a.nrrd", &data)]), "a.nrrd", &options)
    };
    let first = "dimension: 4\nsizes: 2 2 2 2\nkinds: vector domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)";
    assert_eq!(numbers(&twelve(first, Some(1)).expect("sound")), [1.0, 3.0, 5.0, 7.0, 9.0, 127.0, 4.0, 0.0]);
    let last = "dimension: 4\nsizes: 2 2 2 2\nspacings: 1 1 1 nan\nkinds: domain domain domain list";
    assert_eq!(numbers(&twelve(last, Some(1)).expect("sound")), [8.0, 9.0, 10.0, 127.0, 3.0, 4.0, 0.0, 0.0]);
    let length = numbers(&twelve(first, None).expect("sound"));
    assert_eq!((length[6], length[0]), (5.0, 1.0));
    assert!(twelve(first, Some(2)).expect_err("two components").contains("no component 2"));
}

#[test]
fn what_is_written_as_nrrd_comes_back() {
    let steps = DMat3::from_cols(DVec3::new(0.0, 2.0, 0.1), DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 3.5));
    let frame = GridFrame { dims: [3, 2, 2], origin: DVec3::new(0.1, -1e-9, 3e7), steps };
    for samples in
        [Samples::I16(VALUES.map(|v| v as i16 - 300).to_vec().into()), Samples::F64(VALUES.map(|v| v as f64 / 7.0).to_vec().into())]
    {
        let written = Grid::new(frame, "a\nb".into(), samples).expect("valid");
        for name in ["a.nrrd", "b.nhdr"] {
            let folder = folder(&[]);
            nrrd::write(&folder.path().join(name), &written, &Progress::new()).expect("written");
            let back = read_from(&folder, name, &ReadOptions::default()).expect("sound");
            assert!(back.frame() == written.frame() && back.samples() == written.samples(), "{name}");
        }
    }
}

#[test]
fn nrrd_lines_and_bytes_may_be_skipped() {
    let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n";
    let data = bytes("u8", &VALUES, false);
    let with = |skip: &str, before: &[u8], behind: &[u8]| {
        let header = format!("{head}{skip}\ndatafile: ./a.raw\n");
        let raw = [before, &data, behind].concat();
        numbers(&grid(&[("a.nhdr", header.as_bytes()), ("a.raw", &raw)]))
    };
    let expected = VALUES.map(|v| v as f64);
    assert_eq!(with("line skip: 2\nbyte skip: 3", b"one\ntwo\nxyz", b""), expected);
    assert_eq!(with("byte skip: -1", b"whatever this is", b""), expected);
}

#[test]
fn meta_image_of_every_type_order_and_encoding() {
    for (name, _, meta_type) in PAIRS {
        for big in [false, true] {
            let raw = bytes(name, &VALUES, big);
            let text = text(&VALUES).into_bytes();
            for (keys, data) in [("", raw.clone()), ("CompressedData = True\n", zlib(&raw)), ("BinaryData = False\n", text)] {
                let order = if big { "True" } else { "False" };
                let head = format!(
                    "ObjectType = Image\nNDims = 3\n{keys}BinaryDataByteOrderMSB = {order}\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 4 5 6\n\
                     ElementSpacing = 1 2 3\nDimSize = 3 2 2\nElementType = {meta_type}\n"
                );
                let own = [format!("{head}ElementDataFile = LOCAL\n").as_bytes(), &data].concat();
                let beside = format!("{head}ElementDataFile = a.zraw\n");
                for grid in [grid(&[("a.mha", &own)]), grid(&[("a.mhd", beside.as_bytes()), ("a.zraw", &data)])] {
                    assert_eq!(numbers(&grid), VALUES.map(|v| v as f64), "{name} {big} {keys}");
                    assert_eq!(grid.samples().type_name(), kept_as(name));
                    let steps = DMat3::from_cols(DVec3::Y, -2.0 * DVec3::X, 3.0 * DVec3::Z);
                    assert_eq!(*grid.frame(), GridFrame { dims: [3, 2, 2], origin: DVec3::new(4.0, 5.0, 6.0), steps });
                }
            }
        }
    }
    let head =
        "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementNumberOfChannels = 2\nHeaderSize = 3\nElementDataFile = a.raw\n";
    let data: Vec<u8> = [b"abc".to_vec(), (0..16).collect()].concat();
    let options = ReadOptions { component: Some(1), ..Default::default() };
    let grid = read_from(&folder(&[("a.mhd", head.as_bytes()), ("a.raw", &data)]), "a.mhd", &options).expect("sound");
    assert_eq!(numbers(&grid), [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0]);
}

#[test]
fn legacy_structured_points_as_text_and_binary() {
    let head = |mode: &str| {
        format!("# vtk DataFile Version 3.0\ntitle\n{mode}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 1 2 3\nSPACING 1 1 2\n")
    };
    let big = |name: &str, values: &[i64]| bytes(name, values, true);
    let twelve_vectors: Vec<i64> = (0..36).collect();
    let in_text = format!(
        "{}CELL_DATA 2\nSCALARS c int\nLOOKUP_TABLE default\n1 2\nPOINT_DATA 12\nVECTORS v float\n{}\nSCALARS s unsigned_char 1\nLOOKUP_TABLE default\n{}\n\
         FIELD FieldData 1\nf 1 12 double\n{}",
        head("ASCII"),
        text(&twelve_vectors),
        text(&VALUES),
        text(&VALUES.map(|v| 2 * v))
    );
    let binary = [
        head("BINARY").as_bytes(),
        b"CELL_DATA 2\nSCALARS c int\nLOOKUP_TABLE default\n",
        &big("i32", &[1, 2]),
        b"\nPOINT_DATA 12\nVECTORS v float\n",
        &big("f32", &twelve_vectors),
        b"\nSCALARS s unsigned_char\nLOOKUP_TABLE default\n",
        &big("u8", &VALUES),
        b"\nFIELD FieldData 1\nf 1 12 double\n",
        &big("f64", &VALUES.map(|v| 2 * v)),
        b"\nMETADATA\nINFORMATION 0\n\n",
    ]
    .concat();
    for file in [in_text.as_bytes(), &binary] {
        let named = |name: &str, component| {
            let options = ReadOptions { array: Some(name.into()), component, ..Default::default() };
            read_from(&folder(&[("a.vtk", file)]), "a.vtk", &options)
        };
        let s = named("s", None).expect("sound");
        assert_eq!((numbers(&s), s.samples().type_name()), (VALUES.map(|v| v as f64).to_vec(), "u8"));
        assert_eq!(*s.frame(), GridFrame::along_axes([3, 2, 2], DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 1.0, 2.0)));
        assert_eq!(numbers(&named("f", None).expect("sound")), VALUES.map(|v| 2.0 * v as f64));
        assert_eq!(numbers(&named("v", Some(2)).expect("sound"))[..3], [2.0, 5.0, 8.0]);
        assert!(named("c", None).expect_err("one layer of cells").contains("DIMENSIONS is \"2 1 1\", expected 2 to"));
        let unknown = named("t", None).expect_err("unknown");
        assert!(unknown.ends_with("no array to show named \"t\"; the volume has \"c\", \"v\", \"s\", \"f\""), "{unknown}");
    }
}

fn vti(root: &str, image: &str, pieces: &str) -> Vec<u8> {
    format!("<?xml version='1.0'?><VTKFile type='ImageData' {root}><ImageData {image}>{pieces}</ImageData></VTKFile>").into_bytes()
}

#[test]
fn image_data_with_directions_pieces_and_cells() {
    let array = |values: &[i64]| format!("<DataArray type='Int16' Name='s' format='ascii'>{}</DataArray>", text(values));
    let one = format!("<Piece Extent='1 3 0 1 0 1'><PointData Scalars='s'>{}</PointData></Piece>", array(&VALUES));
    let image = "WholeExtent='1 3 0 1 0 1' Origin='1 0 0' Spacing='2 1 1' Direction='0 -1 0 1 0 0 0 0 1'";
    let whole = grid(&[("a.vti", &vti("", image, &one))]);
    assert_eq!((numbers(&whole), whole.samples().type_name(), whole.name()), (VALUES.map(|v| v as f64).to_vec(), "i16", "s"));
    // x of the grid goes along y; its first point has index 1.
    let steps = DMat3::from_cols(DVec3::new(0.0, 2.0, 0.0), DVec3::new(-1.0, 0.0, 0.0), DVec3::Z);
    assert_eq!(*whole.frame(), GridFrame { dims: [3, 2, 2], origin: DVec3::new(1.0, 2.0, 0.0), steps });

    let left = format!("<Piece Extent='0 1 0 1 0 1'><PointData>{}</PointData></Piece>", array(&[0, 1, 3, 4, 6, 7, 9, 10]));
    let right = format!("<Piece Extent='1 2 0 1 0 1'><PointData>{}</PointData></Piece>", array(&[1, 2, 4, 5, 7, 8, 10, 11]));
    let image = "WholeExtent='0 2 0 1 0 1'";
    let both = grid(&[("a.vti", &vti("", image, &(left.clone() + &right)))]);
    assert_eq!(numbers(&both), (0..12).map(f64::from).collect::<Vec<_>>());
    assert_refused(&[("a.vti", &vti("", image, &left))], "pieces that fill WholeExtent");
    assert_refused(&[("a.vti", &vti("", "WholeExtent='0 1 0 1 0 1'", &right))], "an extent within WholeExtent");

    let cells = format!("<Piece Extent='0 3 0 2 0 2'><CellData>{}</CellData></Piece>", array(&VALUES));
    let cells = grid(&[("a.vti", &vti("", "WholeExtent='0 3 0 2 0 2' Spacing='2 1 1'", &cells))]);
    assert_eq!(*cells.frame(), GridFrame::along_axes([3, 2, 2], DVec3::new(1.0, 0.5, 0.5), DVec3::new(2.0, 1.0, 1.0)));
    assert_eq!(numbers(&cells), VALUES.map(|v| v as f64));
}

#[test]
fn raw_bytes_by_their_layout() {
    for voxel in RawLayout::TYPES {
        for is_big_endian in [false, true] {
            let layout = RawLayout { dims: [3, 2, 2], voxel, spacing: [1.0, 2.0, 3.0], is_big_endian };
            let options = ReadOptions { raw: Some(layout), ..Default::default() };
            let data = bytes(voxel, &VALUES, is_big_endian);
            let grid = read_from(&folder(&[("a.raw", &data)]), "a.raw", &options).expect("sound");
            assert_eq!((numbers(&grid), grid.samples().type_name()), (VALUES.map(|v| v as f64).to_vec(), kept_as(voxel)));
            let short = refused(&[("a.raw", &data[1..])], &options);
            let (found, expected) = (data.len() - 1, data.len());
            let said = format!("it has {found} bytes of data, expected {expected}: --dims 3,2,2 --type {voxel}");
            assert_eq!(short, said);
        }
    }
}

#[test]
fn broken_headers_are_named_by_key_and_expectation() {
    let nrrd_head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n";
    let twelve = bytes("u8", &VALUES, false);
    let attached = |from: &str, to: &str| [nrrd_head.replace(from, to).as_bytes(), b"\n", &twelve].concat();
    for (from, to, expected) in [
        ("uchar", "block", "type is \"block\", expected int8 to uint64, float or double"),
        ("type: uchar\n", "", "type is missing, expected a type"),
        ("uchar", "short", "endian is missing, expected little or big"),
        ("dimension: 3", "dimension: 2", "dimension is \"2\", expected 3, or 4"),
        ("sizes: 3 2 2", "sizes: 3 2", "sizes is \"3 2\", expected 3 integers from 1"),
        ("sizes: 3 2 2", "sizes: 3 0 2", "sizes is \"3 0 2\", expected 3 integers from 1"),
        ("sizes: 3 2 2", "sizes: 12 1 1", "sizes is \"12 1 1\", expected 2 to 4294967295 points along each axis"),
        ("sizes: 3 2 2", "sizes: 99999999999999999999 2 2", "expected 3 integers from 1"),
        ("sizes: 3 2 2", "sizes: 4000000000 4000000000 4000000000", "more than octetra can index"),
        ("sizes: 3 2 2", "sizes: 100000 1000 1000", "it has 12 bytes of data, expected 100000000000: sizes: 100000 1000 1000, type: uchar"),
        ("sizes: 3 2 2", "sizes: 3 2 3", "it has 12 bytes of data, expected 18"),
        ("sizes: 3 2 2", "sizes: 2 2 2", "it has 12 bytes of data, expected 8"),
        ("encoding: raw", "encoding: bzip2", "encoding is \"bzip2\", expected raw, gzip or text"),
        ("encoding: raw", "encoding: gzip", "it cannot be inflated"),
        ("encoding: raw", "encoding: text", "it has 12 bytes of data, expected 23: at the least, for so many numbers as text"),
        ("encoding: raw", "encoding: raw\nspacings: 1 x 1", "spacings is \"1 x 1\", expected 3 numbers"),
        ("encoding: raw", "encoding: raw\nspacings: 1 0 1", "expected finite ones that span a volume"),
        ("encoding: raw", "encoding: raw\nspace directions: (1,0,0) (1,0,0) (0,0,1)", "expected finite ones that span a volume"),
        ("encoding: raw", "encoding: raw\nspace directions: (1,0) (1,0,0)", "expected (x,y,z)"),
        ("encoding: raw", "encoding: raw\nspace origin: (nan,0,0)", "origin"),
        ("encoding: raw", "encoding: raw\nbyte skip: -2", "byte skip is \"-2\""),
        ("encoding: raw", "encoding: raw\nline skip: 5", "line skip is \"5\""),
        ("encoding: raw", "encoding: raw\nwhat is this", "a line \"field: value\""),
        ("encoding: raw", "encoding: raw\ndata file: missing.raw", "its data file missing.raw cannot be read"),
        ("encoding: raw", "encoding: raw\ndata file: ../a.raw", "data file is \"../a.raw\", expected a file beside the header"),
        ("encoding: raw", "encoding: raw\ndata file: /etc/passwd", "data file is \"/etc/passwd\", expected a file beside the header"),
        ("encoding: raw", "encoding: raw\ndata file: LIST", "expected one file with all data"),
    ] {
        assert_refused(&[("a.nrrd", &attached(from, to))], expected);
    }
    let meta = "NDims = 3\nDimSize = 3 2 2\nElementType = MET_UCHAR\nElementDataFile = a.raw\n";
    for (from, to, expected) in [
        ("NDims = 3", "NDims = 4", "NDims is \"4\", expected 3"),
        ("DimSize = 3 2 2", "DimSize = 3 -2 2", "DimSize is \"3 -2 2\", expected 3 integers from 1"),
        ("DimSize = 3 2 2", "DimSize = 3 2 7", "its data file a.raw has 12 bytes of data, expected 42: DimSize = 3 2 7"),
        ("MET_UCHAR", "MET_WHAT", "ElementType is \"MET_WHAT\", expected MET_CHAR"),
        ("a.raw", "b.raw", "its data file b.raw cannot be read"),
        ("a.raw", "LIST", "expected one file with all data"),
        ("ElementDataFile = a.raw\n", "", "ElementDataFile is missing"),
        ("NDims = 3\n", "NDims = 3\nCompressedData = maybe\n", "CompressedData is \"maybe\", expected True or False"),
        ("NDims = 3\n", "NDims = 3\nCompressedData = True\n", "its data file a.raw cannot be inflated"),
    ] {
        assert_refused(&[("a.mhd", meta.replace(from, to).as_bytes()), ("a.raw", &twelve)], expected);
    }
    let legacy = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nPOINT_DATA 12\nSCALARS s int\n0 1 2 3 4 5 6 7 8 9 10 11\n";
    for (from, to, expected) in [
        ("ASCII", "EBCDIC", "line 3 is \"EBCDIC\", expected ASCII or BINARY"),
        (
            "STRUCTURED_POINTS",
            "HYPER_TREE",
            "DATASET is \"HYPER_TREE\", expected STRUCTURED_POINTS, STRUCTURED_GRID, RECTILINEAR_GRID, UNSTRUCTURED_GRID, POLYDATA, which",
        ),
        ("DIMENSIONS 3 2 2\n", "", "DIMENSIONS is missing"),
        ("DIMENSIONS 3 2 2", "DIMENSIONS 3 2 9", "the size of array \"s\" is \"12\", expected 54, by DIMENSIONS 3 2 9"),
        ("SCALARS s int", "SCALARS s text", "the type of array \"s\" is \"text\""),
        (" 11\n", "\n", "array \"s\" is \"11 numbers\", expected 12 numbers"),
        ("10 11", "10 x", "has \"x\" as its number 11"),
        ("ASCII", "BINARY", "expected 48"),
        ("SCALARS s int\n0 1 2 3 4 5 6 7 8 9 10 11\n", "", "there is no array to show"),
    ] {
        assert_refused(&[("a.vtk", legacy.replace(from, to).as_bytes())], expected);
    }
    let array = format!(
        "<Piece Extent='0 2 0 1 0 1'><PointData><DataArray type='UInt8' Name='s'>{}</DataArray></PointData></Piece>",
        text(&VALUES)
    );
    for (root, image, from, to, expected) in [
        ("", "WholeExtent='0 2 0 1'", "", "", "WholeExtent=\"0 2 0 1\", expected 6 numbers"),
        ("", "", "", "", "WholeExtent=\"\", expected first and last point"),
        ("", "WholeExtent='0 2 0 1 0 0'", "", "", "WholeExtent is \"3 2 1\", expected 2 to"),
        ("", "WholeExtent='0 2 0 1 0 1' Spacing='1 1'", "", "", "Spacing=\"1 1\", expected 3 numbers"),
        ("", "WholeExtent='0 2 0 1 0 1'", "127", "", "point array \"s\" holds 11 numbers, expected 12"),
        ("byte_order='Middle'", "WholeExtent='0 2 0 1 0 1'", "", "", "byte_order=\"Middle\""),
        ("", "WholeExtent='0 2 0 1 0 1'", "UInt8", "Float16", "type=\"Float16\""),
    ] {
        assert_refused(&[("a.vti", &vti(root, image, &array.replace(from, to)))], expected);
    }
}

#[test]
fn memory_is_bounded_by_file_and_budget_before_it_is_taken() {
    let head = |size: u64| format!("NRRD0004\ntype: double\nendian: little\ndimension: 3\nsizes: {size} 1000 1000\nencoding: gzip\n\n");
    let bomb = [head(100_000).as_bytes(), &gzip(&vec![0; 1 << 20])].concat();
    assert_refused(&[("a.nrrd", &bomb)], "encoded bytes of data, expected 800000000000");
    let small = ReadOptions { memory_bytes: 40, ..Default::default() };
    let error = refused(&[("a.nrrd", &nrrd("dimension: 3\nsizes: 3 2 2").replace_all())], &small);
    assert_eq!(error, "needs 96 bytes of memory for 12 voxels, the budget is 40 bytes; raise it with --memory");
}

trait ReplaceAll {
    fn replace_all(self) -> Vec<u8>;
}

impl ReplaceAll for Vec<u8> {
    /// The same header with numbers of eight bytes.
    fn replace_all(self) -> Vec<u8> {
        let text = String::from_utf8(self[..self.len() - 12].to_vec()).expect("a header");
        [text.replace("uint8", "double\nendian: big").as_bytes(), &bytes("f64", &VALUES, true)].concat()
    }
}

#[test]
fn formats_are_told_by_content_whatever_the_suffix() {
    let data = nrrd("dimension: 3\nsizes: 3 2 2");
    assert_eq!(grid(&[("a.data", &data)]).samples(), &Samples::U8(VALUES.map(|v| v as u8).to_vec().into()));
    let folder = folder(&[("a.nrrd", &data)]);
    let error = read_mesh(&folder.path().join("a.nrrd"), &Progress::new()).expect_err("no mesh").to_string();
    assert!(error.contains("is a regular volume (NRRD), expected a tetrahedral mesh"), "{error}");
}

#[test]
fn damaged_files_give_errors_and_no_panic() {
    let legacy = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nPOINT_DATA 12\nSCALARS s int\n0 1 2 3 4 5 6 7 8 9 10 11\n";
    let meta = "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nOffset = 1 2 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let piece = format!(
        "<Piece Extent='0 2 0 1 0 1'><PointData><DataArray type='UInt8' Name='s'>{}</DataArray></PointData></Piece>",
        text(&VALUES)
    );
    let files = [
        ("a.nrrd", nrrd("dimension: 3\nsizes: 3 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)")),
        ("a.vtk", legacy.as_bytes().to_vec()),
        ("a.mha", [meta.as_bytes(), &bytes("u8", &VALUES, false)].concat()),
        ("a.vti", vti("", "WholeExtent='0 2 0 1 0 1'", &piece)),
    ];
    let mut seed = 1u64;
    let mut random = |n: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % n
    };
    let options = ReadOptions { memory_bytes: 1 << 30, ..Default::default() };
    for (name, sound) in files {
        for _ in 0..400 {
            let mut damaged = sound.clone();
            for _ in 0..=random(3) {
                let at = random(damaged.len());
                match random(4) {
                    0 => damaged[at] = b"0123456789 -.()\n:=<>"[random(20)],
                    1 => damaged[at] = random(256) as u8,
                    2 => damaged.truncate(at.max(1)),
                    _ => damaged.insert(at, b"0123456789 \n"[random(12)]),
                }
            }
            let source = Source::Bytes(&damaged);
            // Whatever comes of it, it comes back.
            let _ = read_source(&source, Path::new(name), &options, &Progress::new());
        }
    }
}

#[test]
fn raw_numbers_stay_in_their_file_where_they_can() {
    let head = |type_name: &str, endian: &str| {
        format!("NRRD0004\ntype: {type_name}\nendian: {endian}\ndimension: 3\nsizes: 3 2 2\nencoding: raw\ndata file: a.raw\n")
    };
    let floats = |big: bool| bytes("f32", &VALUES, big);
    let all = ReadOptions { map_from_bytes: 0, ..Default::default() };
    let mapped = |files: &[(&str, &[u8])], options: &ReadOptions| {
        let folder = folder(files);
        let grid = read_from(&folder, files[0].0, options).expect("sound");
        assert_eq!(numbers(&grid), VALUES.map(|v| v as f64));
        (grid.samples().is_mapped(), grid.bytes())
    };
    let (native, other) = if cfg!(target_endian = "big") { ("big", "little") } else { ("little", "big") };
    let own = |endian: &str| floats(endian == "big");
    assert_eq!(mapped(&[("a.nhdr", head("float", native).as_bytes()), ("a.raw", &own(native))], &all), (true, 0));
    assert_eq!(mapped(&[("a.nhdr", head("float", other).as_bytes()), ("a.raw", &own(other))], &all), (false, 48), "another byte order");
    assert_eq!(mapped(&[("a.nhdr", head("uint8", other).as_bytes()), ("a.raw", &bytes("u8", &VALUES, true))], &all), (true, 0));
    assert!(!mapped(&[("a.nhdr", head("int64", native).as_bytes()), ("a.raw", &bytes("i64", &VALUES, native == "big"))], &all).0);
    let sound = [("a.nhdr", head("float", native)), ("a.raw", String::new())];
    let files = [(sound[0].0, sound[0].1.as_bytes()), ("a.raw", &own(native)[..])];
    assert!(!mapped(&files, &ReadOptions::default()).0, "a small file is read");
    let budget = ReadOptions { memory_bytes: 40, ..Default::default() };
    assert_eq!(mapped(&files, &budget), (true, 0), "but for want of memory");

    // Behind a header numbers may lie askew.
    for padding in ["", " ", "  ", "   "] {
        let head = format!("NRRD0004\n#{padding}\ntype: float\nendian: {native}\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n\n");
        let file = [head.as_bytes(), &own(native)].concat();
        assert_eq!(mapped(&[("a.nrrd", &file)], &all).0, head.len().is_multiple_of(4), "{padding:?}");
    }
    let layout = RawLayout { dims: [3, 2, 2], voxel: "f32", spacing: [1.0; 3], is_big_endian: native == "big" };
    assert!(mapped(&[("a.raw", &own(native))], &ReadOptions { raw: Some(layout), ..all.clone() }).0);
    let meta = format!(
        "NDims = 3\nDimSize = 3 2 2\nBinaryDataByteOrderMSB = {}\nElementType = MET_FLOAT\nElementDataFile = a.raw\n",
        native == "big"
    );
    assert!(mapped(&[("a.mhd", meta.as_bytes()), ("a.raw", &own(native))], &all).0);

    let mut infinite = own(native);
    infinite[4..8].copy_from_slice(&f32::INFINITY.to_ne_bytes());
    let folder = folder(&[("a.nhdr", head("float", native).as_bytes()), ("a.raw", &infinite)]);
    let grid = read_from(&folder, "a.nhdr", &all).expect("sound");
    assert!(!grid.samples().is_mapped() && grid.missing() == 1, "what must be changed is copied");
    drop(grid);
    assert_eq!(std::fs::read(folder.path().join("a.raw")).expect("there"), infinite, "and the file is left alone");
}

/// A legacy file of a dataset: lines, and numbers in between as text or big-endian floats.
fn legacy(binary: bool, dataset: &str, parts: &[(&str, &[f64])]) -> Vec<u8> {
    let mode = if binary { "BINARY" } else { "ASCII" };
    let mut file = format!("# vtk DataFile Version 3.0\ntitle\n{mode}\nDATASET {dataset}\n").into_bytes();
    for (line, numbers) in parts {
        file.extend(format!("{line}\n").bytes());
        match binary {
            true => file.extend(numbers.iter().flat_map(|&n| (n as f32).to_be_bytes())),
            false => file.extend(numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ").bytes()),
        }
        file.extend(b"\n");
    }
    file
}

fn legacy_mesh(file: &[u8]) -> Result<TetMesh, String> {
    let folder = folder(&[("a.vtk", file)]);
    match read(&folder.path().join("a.vtk"), &ReadOptions::default(), &Progress::new()) {
        Ok(Data::Mesh(mesh)) => Ok(mesh),
        Ok(Data::Grid(_)) => panic!("a volume"),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
fn legacy_structured_and_rectilinear_grids_are_meshes() {
    let values: Vec<f64> = (0..12).map(f64::from).collect();
    let points: Vec<f64> = (0..12).flat_map(|i| [f64::from(i % 3) * 2.0, f64::from(i / 3 % 2), -f64::from(i / 6)]).collect();
    let (xs, ys, zs) = ([0.0, 2.0, 4.0], [0.0, 1.0], [-1.0, 0.0]);
    let volume = |mesh: &TetMesh| (0..mesh.tets().len()).map(|t| crate::geometry::signed_volume(&mesh.corners(t))).sum::<f64>();
    for binary in [false, true] {
        let data = [
            ("POINT_DATA 12\nSCALARS n float 1\nLOOKUP_TABLE default", &values[..]),
            ("CELL_DATA 2\nSCALARS c float\nLOOKUP_TABLE default", &[5.0, 7.0]),
        ];
        let curved = legacy(binary, "STRUCTURED_GRID", &[&[("DIMENSIONS 3 2 2\nPOINTS 12 float", &points[..])], &data[..]].concat());
        let axes = [("DIMENSIONS 3 2 2\nX_COORDINATES 3 float", &xs[..]), ("Y_COORDINATES 2 float", &ys), ("Z_COORDINATES 2 float", &zs)];
        for (file, first) in [(curved, DVec3::ZERO), (legacy(binary, "RECTILINEAR_GRID", &[&axes[..], &data[..]].concat()), DVec3::NEG_Z)] {
            let mesh = legacy_mesh(&file).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((mesh.points().len(), mesh.tets().len(), mesh.inverted_count()), (12, 10, 0));
            assert!((volume(&mesh) - 4.0).abs() < 1e-12 && mesh.points()[0] + mesh.center() == first);
            let (n, c) = (&mesh.point_data()[0], &mesh.cell_data()[0]);
            assert_eq!((n.name.as_str(), n.values.get(11), c.values.get(4), c.values.get(5)), ("n", 11.0, 5.0, 7.0));
        }
    }
    let broken = |dataset: &str, parts: &[(&str, &[f64])], expected: &str| {
        let error = legacy_mesh(&legacy(false, dataset, parts)).expect_err("broken");
        assert!(error.contains(expected) && !error.contains('\n'), "\"{error}\" does not say \"{expected}\"");
    };
    broken("STRUCTURED_GRID", &[("DIMENSIONS 3 2 2", &[])], "POINTS is missing");
    broken("STRUCTURED_GRID", &[("DIMENSIONS 3 2 3\nPOINTS 12 float", &points)], "the size of array \"POINTS\" is \"12\", expected 18");
    broken("STRUCTURED_GRID", &[("DIMENSIONS 3 2 2\nPOINTS 12 float", &points[..30])], "array \"POINTS\"");
    broken("STRUCTURED_GRID", &[("DIMENSIONS 3 4 1\nPOINTS 12 float", &points)], "has no cell with a volume: it holds 6 quads (type 9)");
    broken("STRUCTURED_GRID", &[("DIMENSIONS 9999999 9999999 9999999\nPOINTS 12 float", &points)], "fewer than 4294967295 in all");
    broken(
        "RECTILINEAR_GRID",
        &[("DIMENSIONS 3 2 2\nX_COORDINATES 3 float", &xs), ("Y_COORDINATES 2 float", &ys)],
        "Z_COORDINATES is missing",
    );
    let short = [("DIMENSIONS 3 2 2\nX_COORDINATES 2 float", &xs[..2]), ("Y_COORDINATES 2 float", &ys), ("Z_COORDINATES 2 float", &zs)];
    broken("RECTILINEAR_GRID", &short, "\"X_COORDINATES\" is \"2\", expected 3");
}
