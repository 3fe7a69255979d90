use super::super::super::parse::parsed;
use super::super::read;
use super::*;
use crate::mesh::{Cells, Values};

fn array(name: &str, components: usize, values: &[f64]) -> DataArray {
    DataArray { name: name.into(), components, values: Values::F64(values.to_vec()) }
}

fn written(grid: &UnstructuredGrid, is_binary: bool) -> Result<Vec<u8>, WriteError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("m.msh");
    write_grid(&path, grid, is_binary, &Progress::new())?;
    Ok(std::fs::read(&path).expect("written"))
}

/// One cell of each type that Gmsh has, points with values that decimals do not end for.
fn zoo() -> UnstructuredGrid {
    let mut cells = Cells::default();
    let all: Vec<u32> = (0..64).rev().collect();
    for number in 1..=u8::MAX {
        let Some(element) = ElementType::of(i64::from(number)).filter(|t| t.is_whole() && t.nodes <= 64) else { continue };
        cells.push(element.cell_type, &all[..element.nodes]).expect("few");
    }
    let points: Vec<DVec3> = (0..64).map(|i| DVec3::new(f64::from(i) / 3.0, 1e-300, -1e10 / f64::from(i + 1))).collect();
    let count = cells.len();
    let numbers = |len: usize, scale: f64| (0..len).map(|i| (i as f64).sqrt() * scale).collect::<Vec<f64>>();
    let mut missing = numbers(count, 2.0);
    missing[1] = f64::NAN;
    let physical: Vec<f64> = (0..count).map(|i| if i % 3 == 0 { f64::NAN } else { (i % 2 + 5) as f64 }).collect();
    UnstructuredGrid {
        points,
        cells,
        point_data: vec![array("p", 1, &numbers(64, 0.1)), array("tensor", 9, &numbers(576, -0.1))],
        cell_data: vec![array("v w", 3, &numbers(3 * count, 1e200)), array("m", 1, &missing), array("gmsh:physical", 1, &physical)],
        ..UnstructuredGrid::default()
    }
}

#[test]
fn what_is_written_is_read_again() {
    let grid = zoo();
    for is_binary in [false, true] {
        let found = parsed(read, &written(&grid, is_binary).expect("written")).expect("sound");
        assert_eq!(found.points, grid.points);
        assert_eq!(found.cells, grid.cells);
        assert_eq!(found.point_data, grid.point_data);
        let shown = |arrays: &[DataArray]| arrays.iter().map(|a| format!("{} {} {:?}", a.name, a.components, a.values)).collect::<Vec<_>>();
        assert_eq!(shown(&found.cell_data)[..2], shown(&grid.cell_data)[..2]);
        let physical = &found.cell_data[2];
        assert_eq!(physical.name, "gmsh:physical");
        for cell in 0..grid.cells.len() {
            let (found, expected) = (physical.values.get(cell), grid.cell_data[2].values.get(cell));
            assert!(found == expected || found.is_nan() && expected.is_nan(), "cell {cell}: {found} {expected}");
        }
        assert_eq!(found.cell_data[3].name, "gmsh:geometrical");
    }
}

#[test]
fn voxels_and_odd_arrays_find_a_place() {
    let points: Vec<DVec3> = (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
    let mut cells = Cells::default();
    cells.push(CellType::VOXEL, &[0, 1, 2, 3, 4, 5, 6, 7]).expect("few");
    let cell_data = vec![array("a\"b", 2, &[1.0, 2.0]), array("six", 6, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])];
    let grid = UnstructuredGrid { points, cells, cell_data, ..UnstructuredGrid::default() };
    let found = parsed(read, &written(&grid, true).expect("written")).expect("sound");
    assert_eq!(found.cells.get(0), (CellType::HEXAHEDRON, &[0, 1, 3, 2, 4, 5, 7, 6][..]));
    assert_eq!(found.cell_data[0], array("a_b", 3, &[1.0, 2.0, 0.0]));
    assert_eq!(
        found.cell_data[1..7].iter().map(|a| a.name.as_str()).collect::<Vec<_>>(),
        ["six:0", "six:1", "six:2", "six:3", "six:4", "six:5"]
    );
    assert_eq!(found.cell_data[6], array("six:5", 1, &[6.0]));
}

#[test]
fn entities_keep_their_numbers_and_groups() {
    let mut cells = Cells::default();
    for _ in 0..4 {
        cells.push(CellType::TETRA, &[0, 1, 2, 3]).expect("few");
    }
    let cell_data = vec![array("gmsh:physical", 1, &[7.0, 8.0, 7.0, f64::NAN]), array("gmsh:geometrical", 1, &[2.0, 2.0, 5.0, 2.0])];
    let grid = UnstructuredGrid { points: vec![DVec3::ONE; 4], cells, cell_data, ..UnstructuredGrid::default() };
    let found = parsed(read, &written(&grid, false).expect("written")).expect("sound");
    let values = |i: usize| (0..4).map(|cell| found.cell_data[i].values.get(cell)).collect::<Vec<_>>();
    let physical = values(0);
    assert!(physical[..3] == [7.0, 8.0, 7.0] && physical[3].is_nan(), "{physical:?}");
    let mut entities = values(1);
    assert_eq!(entities[2], 5.0);
    entities.sort_by(f64::total_cmp);
    entities.dedup();
    assert_eq!(entities, [2.0, 5.0, 6.0, 7.0], "one for each group");
}

#[test]
fn what_has_no_place_is_said_and_leaves_the_old_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("m.msh");
    std::fs::write(&path, "old").expect("written");
    let grid_of = |cell_type, points: &[u32]| {
        let mut cells = Cells::default();
        cells.push(cell_type, points).expect("few");
        UnstructuredGrid { points: vec![DVec3::ZERO; 5], cells, ..UnstructuredGrid::default() }
    };
    let error = |grid: &UnstructuredGrid| write_grid(&path, grid, true, &Progress::new()).expect_err("no place").to_string();
    let polygon = error(&grid_of(CellType::POLYGON, &[0, 1, 2, 3, 4]));
    assert!(polygon.ends_with("m.msh: has 1 polygon (type 7), for which Gmsh's format has no place"), "{polygon}");
    let beyond = error(&grid_of(CellType::LINE, &[0, 5]));
    assert!(beyond.ends_with("cell 0 has point 5, but there are 5 points"), "{beyond}");
    let mut short = grid_of(CellType::LINE, &[0, 1]);
    short.point_data.push(array("s", 1, &[1.0]));
    assert!(error(&short).ends_with("array \"s\" has 1 numbers for 5 points or cells"));
    let progress = Progress::new();
    progress.cancel();
    assert!(matches!(write_grid(&path, &zoo(), false, &progress), Err(WriteError::Cancelled(_))));
    assert_eq!(std::fs::read(&path).expect("there"), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 1);
}
