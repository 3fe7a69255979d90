//! Files that VTK 9.7 wrote (`vtkHDFWriter`), and one of h5py with time steps. They hold a hexahedron, a pyramid on it, a tet and the
//! pyramid once more as a polyhedron. They are mostly empty chunks, so they lie here compressed.

use crate::format::{Contents, FormatError, ReadOptions, Source, contents, named};
use crate::mesh::{CellType, UnstructuredGrid, Values};
use crate::progress::Progress;
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::Path;

const FOUR: &[u8] = include_bytes!("../../../tests/meshes/hdf/four_zlib.vtkhdf.zz");
const PARTS: &[u8] = include_bytes!("../../../tests/meshes/hdf/parts.vtkhdf.zz");
const BLOCKS: &[u8] = include_bytes!("../../../tests/meshes/hdf/multiblock.vtkhdf.zz");
const STEPS: &[u8] = include_bytes!("../../../tests/meshes/hdf/steps.vtkhdf.zz");

fn unpacked(mut bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    ZlibDecoder::new(&mut bytes).read_to_end(&mut all).expect("sound");
    all
}

fn read(bytes: &[u8]) -> Result<UnstructuredGrid, FormatError> {
    let path = Path::new("mesh.vtkhdf");
    match contents(&Source::Bytes(bytes), path, &ReadOptions::default(), &Progress::new()).map_err(|problem| named(path, problem))? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

/// The cells of the mesh, its points shifted by so many.
fn cells(shift: u32) -> [(CellType, Vec<u32>); 4] {
    let shifted = |points: &[u32]| points.iter().map(|point| point + shift).collect();
    let faces: [&[u32]; 5] = [&[4, 5, 6, 7], &[4, 5, 8], &[5, 6, 8], &[6, 7, 8], &[7, 4, 8]];
    let stream = faces.iter().flat_map(|face| std::iter::once(face.len() as u32).chain(face.iter().map(|point| point + shift)));
    [
        (CellType::HEXAHEDRON, shifted(&[0, 1, 2, 3, 4, 5, 6, 7])),
        (CellType::PYRAMID, shifted(&[4, 5, 6, 7, 8])),
        (CellType::TETRA, shifted(&[0, 1, 2, 4])),
        (CellType::POLYHEDRON, std::iter::once(5).chain(stream).collect()),
    ]
}

fn cells_of(grid: &UnstructuredGrid) -> Vec<(CellType, Vec<u32>)> {
    grid.cells.iter().map(|(cell_type, points)| (cell_type, points.to_vec())).collect()
}

#[test]
fn a_grid_of_vtk() {
    let grid = read(&unpacked(FOUR)).expect("sound");
    assert_eq!((grid.points.len(), grid.points[8].to_array()), (9, [0.5, 0.5, 2.0]));
    assert_eq!(cells_of(&grid), cells(0));
    let [t, v] = &grid.point_data[..] else { panic!("{:?}", grid.point_data) };
    assert_eq!((t.name.as_str(), t.components, &t.values), ("T", 1, &Values::F32((0..9).map(|i| i as f32).collect())));
    assert_eq!((v.name.as_str(), v.components, &v.values), ("v", 3, &Values::F64((0..27).map(f64::from).collect())));
    assert_eq!(grid.cell_data[0].values, Values::F64(vec![1.0, 2.0, 3.0, 4.0]));
    assert_eq!((grid.active_scalars.as_deref(), grid.notes.len(), grid.numbers.len()), (Some("T"), 0, 0));
}

#[test]
fn parts_are_joined_without_their_ghosts() {
    let grid = read(&unpacked(PARTS)).expect("sound");
    assert_eq!((grid.points.len(), grid.points[17].to_array()), (18, [5.5, 0.5, 2.0]));
    let second = cells(9);
    assert_eq!(cells_of(&grid), [&cells(0)[..], &second[1..3]].concat());
    assert_eq!(grid.cell_data.len(), 1);
    assert_eq!(grid.cell_data[0].values, Values::F64(vec![1.0, 2.0, 3.0, 4.0, 2.0, 3.0]));
    assert_eq!((grid.numbers, grid.notes), (vec![0, 1, 2, 3, 5, 6], vec!["2 ghost, refined or hidden cells were dropped".to_owned()]));
}

#[test]
fn blocks_that_are_no_grids_are_said() {
    let grid = read(&unpacked(BLOCKS)).expect("sound");
    assert_eq!(cells_of(&grid), cells(0));
    assert_eq!(grid.notes, ["block \"Block_2\" is of type PolyData and was left out"]);
}

/// The first step is the last in the file.
#[test]
fn of_steps_the_first_is_read() {
    let grid = read(&unpacked(STEPS)).expect("sound");
    assert_eq!(cells_of(&grid), [(CellType::TETRA, vec![0, 1, 2, 3])]);
    assert_eq!(grid.points[1].to_array(), [1.0, 12.0, 0.0]);
    assert_eq!(grid.point_data[0].values, Values::F32(vec![12.0, 13.0, 14.0, 15.0]));
    assert_eq!(grid.cell_data[0].values, Values::F64(vec![7.0]));
    let text = "array \"/VTKHDF/CellData/name\" was left out: type String, expected numbers of 8 to 64 bits";
    assert_eq!(grid.notes, ["of 2 time steps the first (time 0.25) was read", text]);
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
    let steps = unpacked(STEPS);
    for (bytes, expected) in [
        (with(&steps, "UnstructuredGrid", "ImageData\0\0\0\0\0\0\0"), "mesh.vtkhdf: is VTKHDF of type \"ImageData\", octetra reads"),
        (with(&steps, "VTKHDF\0", "VTKHDX\0"), "mesh.vtkhdf: is an HDF5 file with VTKHDX; octetra reads"),
        (with(&steps, "Types\0", "Typed\0"), "group \"/VTKHDF\": no data set \"Types\", expected one in each grid"),
        (steps[..3000].to_vec(), "mesh.vtkhdf: "),
        (steps[..50].to_vec(), "mesh.vtkhdf: the header: "),
    ] {
        let error = read(&bytes).expect_err(expected).to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
}

/// Whatever the bytes are, reading ends; what it finds is not looked at.
#[test]
fn no_damage_breaks_the_reader() {
    let sound = unpacked(STEPS);
    for i in (0..sound.len()).step_by(23) {
        let mut bytes = sound.clone();
        bytes[i] = [0, 0xff, bytes[i] ^ 1, bytes[i] ^ 0x80][i % 4];
        let _ = read(&bytes);
    }
    for len in (0..sound.len()).step_by(499) {
        let _ = read(&sound[..len]);
    }
}
