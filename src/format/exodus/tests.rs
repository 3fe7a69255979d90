//! Files made with the netCDF4 library: two tets, elements of no known kind, a hexahedron and two polyhedra, with two time steps, in all
//! flavours of NetCDF.

use crate::format::{Contents, FormatError, ReadOptions, Source, contents, named};
use crate::mesh::{CellType, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::{Path, PathBuf};

const CDF1: &[u8] = include_bytes!("../../../tests/meshes/hdf/blocks_cdf1.e");
const CDF2: &[u8] = include_bytes!("../../../tests/meshes/hdf/blocks_cdf2.e");
const CDF5: &[u8] = include_bytes!("../../../tests/meshes/hdf/blocks_cdf5.e");
const HDF5: &[u8] = include_bytes!("../../../tests/meshes/hdf/blocks_hdf5.e.zz");

fn hdf5() -> Vec<u8> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(HDF5).read_to_end(&mut bytes).expect("sound");
    bytes
}

fn read(bytes: &[u8]) -> Result<UnstructuredGrid, FormatError> {
    let path = Path::new("mesh.e");
    match contents(&Source::Bytes(bytes), path, &ReadOptions::default(), &Progress::new()).map_err(|problem| named(path, problem))? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

fn array<'a>(arrays: &'a [DataArray], name: &str) -> &'a DataArray {
    arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no array {name}"))
}

#[test]
fn all_flavours_hold_the_same_mesh() {
    let mut texts = Vec::new();
    for bytes in [CDF1, CDF2, CDF5, &hdf5()] {
        let grid = read(bytes).expect("sound");
        assert_eq!((grid.points.len(), grid.points[8].to_array()), (9, [0.5, 0.5, 2.0]));
        let cells: Vec<(CellType, &[u32])> = grid.cells.iter().collect();
        assert_eq!(cells[..2], [(CellType::TETRA, &[0, 1, 2, 4][..]), (CellType::TETRA, &[4, 5, 6, 8])]);
        assert_eq!(cells[2], (CellType::HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7][..]));
        let pyramid = [5, 4, 4, 5, 6, 7, 3, 4, 5, 8, 3, 5, 6, 8, 3, 6, 7, 8, 3, 7, 4, 8];
        assert_eq!(cells[3], (CellType::POLYHEDRON, &pyramid[..]));
        assert_eq!((cells.len(), cells[4].1[0]), (5, 4));
        assert_eq!(array(&grid.point_data, "T").values, Values::F32((0..9).map(|i| i as f32).collect()));
        let v = array(&grid.point_data, "v");
        assert_eq!((v.components, [3, 4, 5].map(|i| v.values.get(i))), (3, [11.0, 21.0, 31.0]));
        let Values::F64(q) = &array(&grid.cell_data, "q").values else { panic!("not widened") };
        assert!(q[..2].iter().all(|q| q.is_nan()) && q[2..] == [2.5, 0.1, 0.2]);
        assert_eq!(array(&grid.cell_data, "ObjectId").values, Values::F64(vec![10.0, 10.0, 30.0, 40.0, 40.0]));
        assert_eq!(array(&grid.cell_data, "GlobalElementId").values, Values::F64(vec![7.0, 6.0, 3.0, 2.0, 1.0]));
        assert_eq!((grid.numbers, grid.active_scalars.as_deref()), (vec![0, 1, 4, 5, 6], Some("T")));
        texts.push(grid.notes);
    }
    let expected = [
        "2 elements of type \"BEX_TRI\" with 54 nodes were left out: octetra has no cells for them",
        "of 2 time steps the first (time 0.5) was read",
        "the variable \"nowhere\" on elements has no values on the cells that were read",
        "left out: 2 side sets",
    ];
    assert!(texts.iter().all(|notes| *notes == expected), "{texts:?}");
}

/// A copy with some bytes of text replaced by as many others.
fn with(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
    let at = bytes.windows(old.len()).position(|window| window == old.as_bytes()).expect("it is there");
    let mut bytes = bytes.to_vec();
    bytes[at..at + old.len()].copy_from_slice(new.as_bytes());
    bytes
}

#[test]
fn what_is_not_sound_is_said_in_one_line() {
    for (bytes, expected) in [
        (with(CDF1, "coordx", "koordx"), "mesh.e: is a NetCDF file without the coordinates of nodes"),
        (with(CDF1, "ebepecnt4", "ebepecnt9"), "no variable \"ebepecnt4\", expected one beside \"facconn4\""),
        (CDF1[..2000].to_vec(), "mesh.e: "),
        (CDF1[..40].to_vec(), "mesh.e: the header: "),
        (hdf5()[..4000].to_vec(), "mesh.e: "),
    ] {
        let error = read(&bytes).expect_err(expected).to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
    // The first tet's first node, 1, becomes 0.
    let place = CDF1.windows(16).position(|w| w == [0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5]).expect("the first tet");
    let mut bytes = CDF1.to_vec();
    bytes[place + 3] = 0;
    let error = read(&bytes).expect_err("no node 0").to_string();
    assert_eq!(error, "mesh.e: variable \"connect1\": 0, expected numbers of points from 1 to 4294967296");
}

/// Whatever the bytes are, reading ends; what it finds is not looked at.
#[test]
fn no_damage_breaks_the_reader() {
    for len in (0..CDF1.len()).step_by(31) {
        let _ = read(&CDF1[..len]);
    }
    for i in 0..CDF1.len() {
        let mut bytes = CDF1.to_vec();
        bytes[i] = [0, 0x7f, 0xff, bytes[i] ^ 1][i % 4];
        let _ = read(&bytes);
    }
    let sound = hdf5();
    for i in (0..sound.len()).step_by(997) {
        let mut bytes = sound.clone();
        bytes[i] ^= 0x55;
        let _ = read(&bytes);
    }
}

#[test]
#[ignore = "needs the shared data: set OCTETRA_SHARED"]
fn real_files() {
    let shared = PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED is set")).join("data/interop");
    for (name, points, counts) in [
        ("exodus/bad_64bit_elem_integers.e", 16, &[(9, 9)][..]),
        ("exodus/good_32bit_elem_integers.e", 16, &[(9, 9)]),
        ("exodus/box-noglom.ex2", 27, &[(10, 40)]),
        ("exodus/read_exodus_HEX20.e", 81, &[(25, 8)]),
        ("exodus/read_exodus_HEX27.e", 125, &[(29, 8)]),
        ("exodus/read_exodus_PRISM15.e", 93, &[(26, 16)]),
        ("exodus/read_exodus_PYRAMID13.e", 153, &[(27, 48)]),
        ("exodus/read_exodus_PYRAMID5.e", 35, &[(14, 48)]),
        ("exodus/read_exodus_TET4.e", 71, &[(10, 192)]),
        ("exodus/read_exodus_TET10.e", 381, &[(24, 192)]),
        ("exodus/read_exodus_TET14.e", 813, &[(24, 192)]),
        ("hex_wedge/disk_out_ref.ex2", 8499, &[(12, 7472)]),
    ] {
        let grid = read(&std::fs::read(shared.join(name)).expect(name)).expect(name);
        let expected: Vec<_> = counts.iter().map(|&(cell_type, count)| (CellType(cell_type), count)).collect();
        assert_eq!((grid.points.len(), grid.cells.counts()), (points, expected), "{name}");
    }
    let error = read(&std::fs::read(shared.join("exodus/Cube_With_Sidesets.e")).expect("there")).expect_err("no cells").to_string();
    assert_eq!(error, "mesh.e: has only elements that octetra has no cells for: 27 elements of type \"BEX_HEX\" with 54 nodes");
}
