//! Small files made in every way that VTK knows, and files made to do harm.

use super::compress::{Compressor, tests::deflate};
use super::number::{ByteOrder, ScalarType};
use super::*;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use proptest::prelude::*;
use std::sync::LazyLock;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Base64,
    AppendedBase64,
    AppendedRaw,
}

/// How a file is written.
#[derive(Debug, Clone, Copy)]
struct Style {
    encoding: Encoding,
    compressor: Option<(&'static str, Compressor)>,
    block_size: usize,
    header_size: usize,
    order: ByteOrder,
}

const PLAIN: Style = Style { encoding: Encoding::Ascii, compressor: None, block_size: 32768, header_size: 4, order: ByteOrder::Little };

fn styles() -> Vec<Style> {
    let compressors = [None].into_iter().chain(Compressor::NAMES.map(Some)).flat_map(|compressor| {
        let block_sizes: &[usize] = match compressor {
            None => &[32768],
            Some((_, Compressor::Lzma)) => &[40],
            Some(_) => &[40, 7, 32768],
        };
        block_sizes.iter().map(move |&block_size| (compressor, block_size))
    });
    let mut styles = Vec::new();
    for (compressor, block_size) in compressors {
        for encoding in [Encoding::Ascii, Encoding::Base64, Encoding::AppendedBase64, Encoding::AppendedRaw] {
            for (header_size, order) in [(4, ByteOrder::Little), (8, ByteOrder::Little), (4, ByteOrder::Big), (8, ByteOrder::Big)] {
                styles.push(Style { encoding, compressor, block_size, header_size, order });
            }
        }
    }
    styles
}

/// An array as (section, name, type, components, numbers).
type TestArray = (&'static str, &'static str, &'static str, Option<usize>, Vec<f64>);

/// Points, cells and arrays of a piece.
type TestPiece = (usize, usize, Vec<TestArray>);

/// Two tets on five points, every second index type another, with arrays of the given type.
fn two_tets(indices: &'static str, scalar: &'static str) -> TestPiece {
    let points = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    let arrays = vec![
        ("PointData", "s", scalar, None, vec![1.0, 2.0, 3.0, 100.0, 5.0]),
        ("PointData", "v", scalar, Some(3), (0..15).map(f64::from).collect()),
        ("CellData", "c", scalar, Some(1), vec![7.0, 8.0]),
        ("Points", "Points", "Float32", Some(3), points),
        ("Cells", "connectivity", indices, None, vec![0.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 4.0]),
        ("Cells", "offsets", indices, None, vec![4.0, 8.0]),
        ("Cells", "types", "UInt8", None, vec![10.0, 10.0]),
    ];
    (5, 2, arrays)
}

fn number_bytes(scalar: &str, v: f64, order: ByteOrder) -> Vec<u8> {
    let mut bytes = match scalar {
        "Int8" => (v as i8).to_le_bytes().to_vec(),
        "UInt8" => (v as u8).to_le_bytes().to_vec(),
        "Int16" => (v as i16).to_le_bytes().to_vec(),
        "UInt16" => (v as u16).to_le_bytes().to_vec(),
        "Int32" => (v as i32).to_le_bytes().to_vec(),
        "UInt32" => (v as u32).to_le_bytes().to_vec(),
        "Int64" => (v as i64).to_le_bytes().to_vec(),
        "UInt64" => (v as u64).to_le_bytes().to_vec(),
        "Float32" => (v as f32).to_le_bytes().to_vec(),
        _ => v.to_le_bytes().to_vec(),
    };
    if order == ByteOrder::Big {
        bytes.reverse();
    }
    bytes
}

/// One array as bytes: header words and data.
fn encode(style: Style, scalar: &str, values: &[f64], base64: bool) -> Vec<u8> {
    let word = |value: usize| number_bytes(if style.header_size == 4 { "UInt32" } else { "UInt64" }, value as f64, style.order);
    let text = |bytes: Vec<u8>| if base64 { STANDARD.encode(bytes).into_bytes() } else { bytes };
    let data: Vec<u8> = values.iter().flat_map(|&v| number_bytes(scalar, v, style.order)).collect();
    let Some((_, compressor)) = style.compressor else { return text([word(data.len()), data].concat()) };
    let blocks: Vec<Vec<u8>> = data.chunks(style.block_size).map(|block| deflate(compressor, block)).collect();
    let mut header = [word(blocks.len()), word(style.block_size), word(data.len() % style.block_size)].concat();
    blocks.iter().for_each(|block| header.extend(word(block.len())));
    [text(header), text(blocks.concat())].concat()
}

fn file(style: Style, pieces: &[TestPiece]) -> Vec<u8> {
    let order = if style.order == ByteOrder::Big { "BigEndian" } else { "LittleEndian" };
    let compressor = style.compressor.map_or(String::new(), |(name, _)| format!(" compressor=\"{name}\""));
    let header = if style.header_size == 4 { "UInt32" } else { "UInt64" };
    let mut text =
        format!("<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" header_type=\"{header}\"{compressor}>");
    text += "<UnstructuredGrid>";
    let mut appended = Vec::new();
    for (points, cells, arrays) in pieces {
        text += &format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">");
        for section in ["PointData", "CellData", "Points", "Cells"] {
            text += &format!("<{section}>");
            for (_, name, scalar, components, values) in arrays.iter().filter(|array| array.0 == section) {
                let components = components.map_or(String::new(), |n| format!(" NumberOfComponents=\"{n}\""));
                let (format, content) = match style.encoding {
                    Encoding::Ascii => ("ascii".into(), values.iter().map(|v| format!("{v} ")).collect::<String>()),
                    Encoding::Base64 => ("binary".into(), String::from_utf8_lossy(&encode(style, scalar, values, true)).into_owned()),
                    _ => (format!("appended\" offset=\"{}  ", appended.len()), String::new()),
                };
                text +=
                    &format!("<DataArray type=\"{scalar}\" Name=\"{name}\"{components} format=\"{format}\">\n  {content}\n </DataArray>");
                match style.encoding {
                    Encoding::AppendedRaw => appended.extend(encode(style, scalar, values, false)),
                    Encoding::AppendedBase64 => appended.extend(encode(style, scalar, values, true)),
                    _ => {}
                }
            }
            text += &format!("</{section}>");
        }
        text += "</Piece>";
    }
    text += "</UnstructuredGrid>";
    if !appended.is_empty() {
        let encoding = if style.encoding == Encoding::AppendedRaw { "raw" } else { "base64" };
        text += &format!("<AppendedData encoding=\"{encoding}\">\n _");
        return [text.as_bytes(), &appended, b"\n</AppendedData></VTKFile>\n"].concat();
    }
    (text + "</VTKFile>").into_bytes()
}

fn read_bytes(bytes: &[u8]) -> Result<MeshParts, VtuError> {
    read(&Source::Bytes(bytes), &Progress::new()).map(tets)
}

/// The tets of what was read; of cells as far as they are sound.
fn tets(found: Found) -> MeshParts {
    match found {
        Found::Mesh(parts) => parts,
        Found::Cells(grid) => crate::mesh::to_tets(grid).unwrap_or_default(),
        Found::Grid(_) => panic!("a volume"),
    }
}

fn grid(bytes: &[u8]) -> UnstructuredGrid {
    match read(&Source::Bytes(bytes), &Progress::new()).expect("sound") {
        Found::Cells(grid) => grid,
        other => panic!("{other:?}"),
    }
}

fn array<'a>(arrays: &'a [DataArray], name: &str) -> &'a DataArray {
    arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no array {name}"))
}

fn numbers(array: &DataArray) -> Vec<f64> {
    (0..array.values.len()).map(|i| array.values.get(i)).collect()
}

#[test]
fn every_encoding_compressor_header_byte_order_and_type() {
    let types = ScalarType::NAMES.map(|(name, scalar)| (name, scalar.fits_f32()));
    let indices = ["Int64", "Int32", "UInt8", "UInt64"];
    for (i, style) in styles().into_iter().enumerate() {
        for (scalar, fits_f32) in types {
            let (_, _, arrays) = two_tets(indices[i % 4], scalar);
            let parts = read_bytes(&file(style, &[(5, 2, arrays.clone())])).unwrap_or_else(|e| panic!("{style:?} {scalar}: {e}"));
            assert_eq!(parts.tets, [[0, 1, 2, 3], [1, 2, 3, 4]], "{style:?}");
            assert_eq!(parts.points[4], DVec3::ONE, "{style:?}");
            assert_eq!(parts.points[1], DVec3::X, "{style:?}");
            let found = [array(&parts.point_data, "s"), array(&parts.point_data, "v"), array(&parts.cell_data, "c")];
            for (found, (_, _, _, components, expected)) in found.into_iter().zip(&arrays) {
                assert_eq!((found.components, &numbers(found)), (components.unwrap_or(1), expected), "{style:?} {scalar}");
                assert_eq!(matches!(found.values, Values::F32(_)), fits_f32, "{scalar}");
            }
        }
    }
}

#[test]
fn arrays_of_many_chunks_and_blocks() {
    let values: Vec<f64> = (0..1_000_000).map(|i| f64::from(i) * 0.37).collect();
    for encoding in [Encoding::Ascii, Encoding::Base64, Encoding::AppendedBase64, Encoding::AppendedRaw] {
        for compressor in [None, Some(Compressor::NAMES[0])] {
            let style = Style { encoding, compressor, block_size: 32_767, ..PLAIN };
            let mut piece = two_tets("Int32", "Float32");
            piece.2.push(("CellData", "long", "Float64", Some(500_000), values.clone()));
            let parts = read_bytes(&file(style, &[piece])).unwrap_or_else(|e| panic!("{style:?}: {e}"));
            assert!(numbers(array(&parts.cell_data, "long")) == values, "{style:?}");
        }
    }
}

#[test]
fn a_file_on_disk_reads_like_one_in_memory() {
    for style in styles() {
        let bytes = file(style, &[two_tets("Int64", "Float64")]);
        let on_disk = tempfile::tempfile().expect("a temporary file");
        io::Write::write_all(&mut &on_disk, &bytes).expect("written");
        let parts = tets(read(&Source::File(&on_disk, bytes.len() as u64), &Progress::new()).expect("sound"));
        let expected = read_bytes(&bytes).expect("sound");
        assert_eq!((parts.points, parts.tets, parts.point_data), (expected.points, expected.tets, expected.point_data));
    }
}

#[test]
fn pieces_are_joined_and_empty_ones_passed_over() {
    let empty = (0, 0, vec![("Points", "Points", "Float32", Some(3), vec![])]);
    let mut second = two_tets("Int64", "Float64");
    second.2.retain(|array| array.1 != "v");
    second.2.push(("PointData", "w", "Float32", None, vec![0.0; 5]));
    for style in styles() {
        let parts = read_bytes(&file(style, &[empty.clone(), two_tets("Int32", "Float32"), empty.clone(), second.clone()])).expect("sound");
        assert_eq!(parts.tets, [[0, 1, 2, 3], [1, 2, 3, 4], [5, 6, 7, 8], [6, 7, 8, 9]]);
        assert_eq!((parts.points.len(), parts.points[9]), (10, DVec3::ONE));
        assert_eq!(parts.point_data.len(), 1, "v and w are not in both pieces");
        assert_eq!(parts.point_data[0].values, Values::F64(vec![1.0, 2.0, 3.0, 100.0, 5.0, 1.0, 2.0, 3.0, 100.0, 5.0]));
        assert_eq!(parts.cell_data[0].values, Values::F64(vec![7.0, 8.0, 7.0, 8.0]));
    }
}

#[test]
fn ghost_cells_are_dropped_with_their_data() {
    for (ghosts, name, kept) in [
        ([0.0, 1.0], "vtkGhostType", vec![7.0]),
        ([8.0, 0.0], "vtkGhostType", vec![8.0]),
        ([32.0, 2.0], "vtkGhostType", vec![8.0]),
        ([16.0, 4.0], "vtkGhostType", vec![7.0, 8.0]),
        ([0.0, 3.0], "vtkGhostLevels", vec![7.0]),
    ] {
        let mut piece = two_tets("Int64", "Float64");
        piece.2.push(("CellData", name, "UInt8", None, ghosts.to_vec()));
        let parts = read_bytes(&file(PLAIN, &[piece.clone(), piece])).expect("sound");
        assert_eq!(numbers(array(&parts.cell_data, "c")), [kept.clone(), kept.clone()].concat());
        assert_eq!((parts.tets.len(), parts.cell_data.len()), (2 * kept.len(), 1));
        let first = if kept[0] == 7.0 { [5, 6, 7, 8] } else { [6, 7, 8, 9] };
        assert_eq!(parts.tets[kept.len()], first);
        // The arrays' values tell the cells of both pieces by their number in the file.
        let expected: Vec<usize> = kept.iter().map(|&c| c as usize - 7).chain(kept.iter().map(|&c| c as usize - 5)).collect();
        assert_eq!((0..parts.tets.len()).map(|tet| parts.file_cells.number(tet)).collect::<Vec<_>>(), expected);
    }
}

#[test]
fn a_length_word_may_be_padded_like_a_text_of_its_own() {
    let style = Style { encoding: Encoding::Base64, ..PLAIN };
    let text = String::from_utf8(file(style, &[two_tets("Int32", "Float32")])).expect("text");
    let data: Vec<u8> = [7.0_f32, 8.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let whole = STANDARD.encode([&8_u32.to_le_bytes()[..], &data].concat());
    let separate = STANDARD.encode(8_u32.to_le_bytes()) + &STANDARD.encode(&data);
    let broken_lines = whole.as_bytes().chunks(5).map(|line| String::from_utf8_lossy(line) + "\r\n").collect::<String>();
    assert!(text.contains(&whole));
    for other in [separate, broken_lines, whole.trim_end_matches('=').to_owned()] {
        let parts = read_bytes(text.replace(&whole, &other).as_bytes()).unwrap_or_else(|e| panic!("{other}: {e}"));
        assert_eq!(numbers(&parts.cell_data[0]), [7.0, 8.0]);
    }
}

#[test]
fn numbers_that_are_none_are_kept_for_the_mesh_to_see() {
    let text = String::from_utf8(file(PLAIN, &[two_tets("Int32", "Float32")])).expect("text");
    let parts = read_bytes(text.replace("1 2 3 100 5", "nan -inf 3 INF -NaN").as_bytes()).expect("sound");
    let found = numbers(&parts.point_data[0]);
    assert!(found[0].is_nan() && found[4].is_nan());
    assert_eq!(found[1..4], [f64::NEG_INFINITY, 3.0, f64::INFINITY]);
}

#[test]
fn active_scalars_are_the_marked_array_if_it_is_there() {
    let text = String::from_utf8(file(PLAIN, &[two_tets("Int32", "Float32")])).expect("text");
    for (point, cell, expected) in [("s", "c", Some("s")), ("", "c", Some("c")), ("gone", "c", Some("c")), ("gone", "", None)] {
        let marked = text.replace("<PointData>", &format!("<PointData Scalars=\"{point}\">"));
        let marked = marked.replace("<CellData>", &format!("<CellData Scalars=\"{cell}\">"));
        assert_eq!(read_bytes(marked.as_bytes()).expect("sound").active_scalars.as_deref(), expected);
    }
}

/// A piece with cells of other types: its points, types, ends and connectivity, and more arrays of cells.
fn other_piece(points: usize, types: &[f64], ends: &[f64], connectivity: &[f64], more: &[(&'static str, &[f64])]) -> TestPiece {
    let places = (0..3 * points).map(|i| f64::from(1 << (i % 20))).collect();
    let mut arrays = vec![
        ("Points", "Points", "Float64", Some(3), places),
        ("Cells", "connectivity", "Int32", None, connectivity.to_vec()),
        ("Cells", "offsets", "Int64", None, ends.to_vec()),
        ("Cells", "types", "UInt8", None, types.to_vec()),
        ("CellData", "c", "Float32", None, (0..types.len()).map(|i| i as f64).collect()),
    ];
    arrays.extend(more.iter().map(|&(name, values)| ("Cells", name, "Int64", None, values.to_vec())));
    (points, types.len(), arrays)
}

#[test]
fn cells_of_every_type_and_their_pieces() {
    let first = other_piece(6, &[13.0, 1.0, 10.0], &[6.0, 7.0, 11.0], &[0., 1., 2., 3., 4., 5., 2., 0., 1., 2., 3.], &[]);
    let second = other_piece(4, &[10.0, 5.0], &[4.0, 7.0], &[0., 1., 2., 3., 1., 2., 3.], &[]);
    for style in styles() {
        let grid = grid(&file(style, &[first.clone(), second.clone()]));
        let cells: Vec<(u8, Vec<u32>)> = grid.cells.iter().map(|(t, nodes)| (t.0, nodes.to_vec())).collect();
        let expected = [(13, vec![0, 1, 2, 3, 4, 5]), (1, vec![2]), (10, vec![0, 1, 2, 3]), (10, vec![6, 7, 8, 9]), (5, vec![7, 8, 9])];
        assert_eq!(cells, expected, "{style:?}");
        assert_eq!((grid.points.len(), numbers(&grid.cell_data[0])), (10, vec![0.0, 1.0, 2.0, 0.0, 1.0]));
        assert!(grid.merges_points);
    }
}

#[test]
fn polyhedra_in_both_layouts() {
    let tet = [4., 3., 0., 1., 2., 3., 0., 1., 3., 3., 0., 2., 3., 3., 1., 2., 3.];
    let old =
        other_piece(4, &[10.0, 42.0], &[4.0, 8.0], &[0., 1., 2., 3., 0., 1., 2., 3.], &[("faces", &tet), ("faceoffsets", &[-1.0, 17.0])]);
    let new = other_piece(
        4,
        &[42.0, 10.0],
        &[4.0, 8.0],
        &[0., 1., 2., 3., 0., 1., 2., 3.],
        &[
            ("face_connectivity", &[0., 1., 2., 0., 1., 3., 0., 2., 3., 1., 2., 3.]),
            ("face_offsets", &[3., 6., 9., 12.]),
            ("polyhedron_to_faces", &[0., 1., 2., 3.]),
            ("polyhedron_offsets", &[4.0, 4.0]),
        ],
    );
    let stream: Vec<u32> = tet.iter().map(|&v| v as u32).collect();
    let moved: Vec<u32> = tet.iter().enumerate().map(|(i, &v)| v as u32 + if i % 4 == 1 || i == 0 { 0 } else { 4 }).collect();
    let grid = grid(&file(PLAIN, &[old.clone(), new]));
    assert_eq!(grid.cells.get(1), (CellType::POLYHEDRON, &stream[..]));
    assert_eq!(grid.cells.get(2), (CellType::POLYHEDRON, &moved[..]));
    // What does not fit is refused, or left to be refused with its cell.
    let text = String::from_utf8(file(PLAIN, &[old])).expect("text");
    for (from, to) in [("-1 17 ", "-1 18 "), ("-1 17 ", "-1 -5 "), ("4 8 ", "4 3 "), ("4 3 0 1 2 3 0 1 3", "4 3 0 9 2 3 0 1 3")] {
        assert!(text.contains(from));
        let found = read(&Source::Bytes(text.replace(from, to).as_bytes()), &Progress::new());
        assert!(!matches!(found.map(tets), Ok(parts) if parts.tets.len() > 1), "{to}");
    }
}

#[test]
fn surfaces_are_polygons_of_four_kinds() {
    let array = |name: &str, values: &str| format!("<DataArray type='Int32' Name='{name}' format='ascii'>{values}</DataArray>");
    let group = |name: &str, connectivity: &str, ends: &str| {
        format!("<{name}>{}{}</{name}>", array("connectivity", connectivity), array("offsets", ends))
    };
    let text = format!(
        "<VTKFile type=\"PolyData\" version=\"0.1\"><PolyData><Piece NumberOfPoints='5' NumberOfVerts='1' NumberOfLines='2' NumberOfStrips='1' \
         NumberOfPolys='3'><Points><DataArray type='Float32' NumberOfComponents='3' format='ascii'>{}</DataArray></Points>{}{}{}{}\
         <CellData>{}</CellData></Piece></PolyData></VTKFile>",
        "0 1 2 ".repeat(5),
        group("Strips", "0 1 2 3", "4"),
        group("Polys", "0 1 2 0 1 2 3 0 1 2 3 4", "3 7 12"),
        group("Lines", "0 1 1 2 3", "2 5"),
        group("Verts", "4", "1"),
        array("c", "0 1 2 3 4 5 6")
    );
    assert!(recognizes_surface(text.as_bytes()));
    let Ok(Found::Cells(grid)) = read_surface(&Source::Bytes(text.as_bytes()), &Progress::new()) else { panic!("sound") };
    assert_eq!(
        grid.cells.iter().map(|(t, nodes)| (t.0, nodes.len())).collect::<Vec<_>>(),
        [(1, 1), (3, 2), (4, 3), (5, 3), (9, 4), (7, 5), (6, 4)]
    );
}

#[test]
fn a_cancelled_read_says_so() {
    let progress = Progress::new();
    progress.cancel();
    for style in styles() {
        let bytes = file(style, &[two_tets("Int32", "Float32")]);
        let outcome = read(&Source::Bytes(&bytes), &progress);
        assert!(matches!(outcome, Err(VtuError::Cancelled(_))), "{style:?}");
    }
}

/// A file in text form with one thing changed, and what the error must say.
#[track_caller]
fn refused(style: Style, change: impl Fn(String) -> String, expected: &str) {
    let bytes = file(style, &[two_tets("Int32", "Float32")]);
    let text = bytes.iter().map(|&b| char::from(b)).collect::<String>();
    let changed: Vec<u8> = change(text.clone()).chars().map(|c| c as u8).collect();
    assert_ne!(bytes, changed, "nothing was changed");
    let error = read_bytes(&changed).expect_err(expected).to_string();
    assert!(error.contains(expected), "\"{error}\" does not say \"{expected}\"");
}

#[test]
fn inconsistent_text_is_refused_by_name() {
    let change = |from: &'static str, to: &'static str| move |text: String| text.replacen(from, to, 1);
    let points = |count: &'static str| change("NumberOfPoints=\"5\"", count);
    refused(PLAIN, points("NumberOfPoints=\"1000000000000000000\""), "1000000000000000000 points in all, more than the 4294967294");
    refused(PLAIN, points("NumberOfPoints=\"-5\""), "<Piece> has NumberOfPoints=\"-5\", expected an integer from 0");
    refused(PLAIN, points("NumberOfPoints=\"4000000000\""), "the array in <Points> holds 15 numbers, expected 12000000000");
    refused(
        PLAIN,
        change("NumberOfCells=\"2\"", "NumberOfCells=\"4000000000\""),
        "cells array \"types\" holds 2 numbers, expected 4000000000",
    );
    refused(PLAIN, points("NumberOfPoints=\"4\""), "connectivity\" has 4 as its number 7 (from 0), expected a point index from 0 to 3");
    refused(
        PLAIN,
        change("0 1 2 3 1 2 3 4 ", "0 1 2 3 1 2 3 -4 "),
        "connectivity\" has -4 as its number 7 (from 0), expected a point index from 0",
    );
    refused(PLAIN, change("0 1 2 3 1 2 3 4 ", "0 1 2 3 1 2 3 4294967296 "), "has 4294967296 as its number 7");
    refused(PLAIN, change("4 8 ", "8 4 "), "offsets\" has 8 as its number 0 (from 0), expected 4, four points a tet");
    refused(PLAIN, change("1 2 3 100 5 ", "1 2 x3y 100 5 "), "point array \"s\" has \"x3y\" as its number 2 (from 0), expected a number");
    refused(PLAIN, change("1 2 3 100 5 ", "1 2 3 100 "), "point array \"s\" holds 4 numbers, expected 5");
    refused(PLAIN, change("1 2 3 100 5 ", "1 2 3 100 5 6 "), "point array \"s\" holds more than 5 numbers, expected 5");
    refused(PLAIN, change("10 10 ", "10 300 "), "types\" has 300 as its number 1 (from 0), expected an integer from 0 to 255");
    refused(
        PLAIN,
        change("\"Points\" NumberOfComponents=\"3\"", "\"Points\" NumberOfComponents=\"2\""),
        "<Points> has 2 components, expected 3",
    );
    refused(
        PLAIN,
        change("\"v\" NumberOfComponents=\"3\"", "\"v\" NumberOfComponents=\"9999999999999999999\""),
        "\"v\" should have 5 x 9999999999999999999 numbers",
    );
    refused(
        PLAIN,
        change("Name=\"offsets\"", "Name=\"ends\""),
        "piece 1 of 1 has no array \"offsets\" in <Cells>, expected one for its 2 cells",
    );
    refused(PLAIN, change("format=\"ascii\"", "format=\"appended\" offset=\"0\""), "should be in the appended data, but the file has none");
}

#[test]
fn hostile_binary_data_are_refused_by_name() {
    let zlib = Some(Compressor::NAMES[0]);
    let raw = Style { encoding: Encoding::AppendedRaw, header_size: 8, ..PLAIN };
    let packed = Style { compressor: zlib, ..raw };
    let offset = |from: &str, to: &str| {
        let (from, to) = (format!("offset=\"{from}  \""), format!("offset=\"{to}\""));
        move |text: String| text.replacen(&from, &to, 1)
    };
    refused(raw, offset("0", "18446744073709551615"), "point array \"s\" reaches to byte 18446744073709551615, expected it to end by byte");
    refused(raw, offset("0", "5000"), "point array \"s\" reaches to byte");
    refused(raw, offset("0", "-1"), "<DataArray> of \"s\" has offset=\"-1\", expected an integer from 0");

    // Words of the first array's header.
    let word = |index: usize, value: u64| {
        move |text: String| {
            let (xml, data) = text.split_once("\n _").expect("appended data");
            let mut data: Vec<char> = data.chars().collect();
            data.splice(index * 8..index * 8 + 8, value.to_le_bytes().map(char::from));
            format!("{xml}\n _{}", data.into_iter().collect::<String>())
        }
    };
    refused(raw, word(0, 1 << 60), "point array \"s\" has 1152921504606846976 bytes, expected 20");
    refused(
        packed,
        word(0, 1 << 60),
        "is said to have 1152921504606846976 blocks of 32768 bytes, the last of 20, expected 20 bytes in all",
    );
    refused(packed, word(1, 3), "point array \"s\" is said to have 1 blocks of 3 bytes, the last of 20, expected 20 bytes in all");
    refused(packed, word(2, 1 << 40), "expected 20 bytes in all");
    refused(packed, word(3, u64::MAX), "point array \"s\" reaches to byte 18446744073709551615");
    refused(packed, word(3, 5), "has a damaged block 0, expected 20 bytes from it");

    // Many points, and few bytes to back them.
    let many = |text: String| text.replacen("NumberOfPoints=\"5\"", "NumberOfPoints=\"4000000000\"", 1);
    refused(raw, many, "the array in <Points> has 60 bytes, expected 48000000000");
    refused(
        packed,
        many,
        "the array in <Points> is said to have 1 blocks of 32768 bytes, the last of 60, expected 48000000000 bytes in all",
    );

    let inline = Style { encoding: Encoding::Base64, ..PLAIN };
    let text = |bytes: &[f32]| {
        STANDARD.encode([&8_u32.to_le_bytes()[..], &bytes.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>()].concat())
    };
    let good = text(&[7.0, 8.0]);
    refused(inline, |t| t.replace(&good, "!!!! garbage"), "cell array \"c\" has damaged base64 text");
    refused(inline, |t| t.replace(&good, &good[..8]), "cell array \"c\" reaches to byte");
    refused(inline, |t| t.replace(&good, ""), "cell array \"c\" reaches to byte");
}

#[test]
fn an_array_that_is_too_long_is_left_out_and_noted() {
    let raw = Style { encoding: Encoding::AppendedRaw, header_size: 8, ..PLAIN };
    let bytes = file(raw, &[two_tets("Int32", "Float32")]);
    let (from, to) = (b"offset=\"0  \"", b"offset=\"28 \"");
    let at = bytes.windows(from.len()).position(|w| w == from).expect("the first array");
    let changed = [&bytes[..at], to, &bytes[at + from.len()..]].concat();
    let parts = read_bytes(&changed).expect("the rest is sound");
    assert_eq!(parts.notes, ["point array \"s\" has 60 bytes, expected 20, and was left out"]);
    assert_eq!(parts.point_data.len() + 1, read_bytes(&bytes).expect("sound").point_data.len());
}

#[test]
fn bombs_are_cut_at_the_size_they_state() {
    for compressor in Compressor::NAMES {
        // 64 MiB of zeros where the 8 bytes of the offsets should be.
        let style = Style { encoding: Encoding::AppendedRaw, compressor: Some(compressor), header_size: 8, ..PLAIN };
        let mut bytes = file(style, &[two_tets("Int32", "Float32")]);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let data = text.find("\n _").expect("appended data") + 3;
        let offset = text.find("Name=\"offsets\"").and_then(|at| text[at..].find("offset=").map(|more| at + more + 8)).expect("an offset");
        let digits = text[offset..].find(' ').expect("padded");
        let place = data + text[offset..offset + digits].parse::<usize>().expect("a number");
        let bomb = deflate(compressor.1, &vec![0; 64 << 20]);
        bytes.truncate(place);
        for word in [1, 32768, 8, bomb.len() as u64] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(&bomb);
        bytes.extend([0; 200]);
        // The types lie behind the bomb now.
        let types = encode(style, "UInt8", &[10.0, 10.0], false);
        let from = text.find("Name=\"types\"").and_then(|at| text[at..].find("offset=").map(|more| at + more + 8)).expect("an offset");
        let digits = text[from..].find('"').expect("quoted");
        let target = format!("{:<digits$}", bytes.len() - data + 1);
        let shift = target.len() - digits;
        let target = format!("{:<digits$}", bytes.len() - data);
        bytes.extend(types);
        bytes.splice(from..from + digits, target.bytes());
        assert_eq!(shift, target.len() - digits);
        let error = read_bytes(&bytes).expect_err("a bomb").to_string();
        assert!(error.contains("\"offsets\" has a damaged block 0, expected 8 bytes from it"), "{error}");
    }
}

#[test]
fn no_truncation_gives_a_mesh() {
    for style in styles() {
        let bytes = file(style, &[two_tets("Int32", "Float32")]);
        // Behind the last number (two signs of base64 padding may be missing too) nothing is missed.
        let end = bytes.len() - b"==\n</AppendedData></VTKFile>\n".len();
        for len in 0..end {
            assert!(read_bytes(&bytes[..len]).is_err(), "{style:?} cut at {len}");
        }
    }
}

/// A file of two pieces in every style.
static SAMPLES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let pieces = [two_tets("Int64", "Int16"), two_tets("UInt16", "Float64")];
    styles().into_iter().map(|style| file(style, &pieces)).collect()
});

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    /// Whatever happens to a file's bytes, reading it ends in a mesh or an error.
    #[test]
    fn damaged_files_never_panic(
        sample in any::<prop::sample::Index>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 1..8),
    ) {
        let mut bytes = sample.get(&SAMPLES[..]).clone();
        for (place, byte, how) in changes {
            let place = place.index(bytes.len());
            match how {
                0 => bytes[place] = byte,
                1 => bytes[place] ^= 1 << (byte % 8),
                2 => bytes.insert(place, byte),
                _ => { bytes.remove(place); }
            }
        }
        if let Ok(parts) = read_bytes(&bytes) {
            prop_assert!(parts.tets.iter().flatten().all(|&corner| (corner as usize) < parts.points.len()));
            let _ = crate::mesh::TetMesh::new(parts);
        }
    }
}
