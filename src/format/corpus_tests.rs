//! Real files of cells, against what VTK 9.7, meshio 5.3 and Gmsh 4.15 say of them: points, cells by type, ranges of arrays.

use super::{Contents, ReadOptions, read_contents};
use crate::mesh::UnstructuredGrid;
use crate::progress::Progress;
use std::env;
use std::path::PathBuf;

/// A file, how many points it has, how many cells of each of VTK's types, and the range of each array.
type Row = (&'static str, usize, &'static [(u8, u64)], &'static [(&'static str, f64, f64)]);

const SPX: &[(u8, u64)] = &[(10, 12_936)];
const GROUPS: [&str; 2] = ["gmsh:physical", "gmsh:geometrical"];

#[rustfmt::skip]
const FILES: &[Row] = &[
    ("interop/gmsh/libigl_hand.msh", 7234, &[(5, 9556), (10, 29_998)], &[("E", 0.019_727, 1.0193), (GROUPS[0], 1.0, 1.0), (GROUPS[1], 1.0, 1.0)]),
    ("interop/gmsh/libmesh_horn.msh", 10_754, &[(21, 127), (22, 5239)], &[(GROUPS[0], 1.0, 6.0), (GROUPS[1], 1.0, 13.0)]),
    ("interop/gmsh/mfem_nested_cubes.msh", 138, &[(5, 240), (10, 520)], &[(GROUPS[0], 1.0, 12.0), (GROUPS[1], 1.0, 12.0)]),
    ("interop/gmsh/mfem_periodic-torus-sector.msh", 1210, &[(70, 48), (72, 36)], &[(GROUPS[0], 1.0, 3.0), (GROUPS[1], 1.0, 315.0)]),
    ("interop/gmsh/mshio_test_2.2_ascii.msh", 6, &[(9, 2)], &[("A scalar view", 0.0, 0.4), (GROUPS[0], 99.0, 99.0), (GROUPS[1], 2.0, 2.0)]),
    ("interop/gmsh/mshio_test_2.2_bin.msh", 6, &[(9, 2)], &[("A scalar view", 0.0, 0.4)]),
    ("interop/gmsh/mshio_test_4.1_ascii.msh", 6, &[(9, 2)], &[("A scalar view", 0.0, 0.4), (GROUPS[1], 2.0, 2.0)]),
    ("interop/gmsh/mshio_test_4.1_bin.msh", 6, &[(9, 2)], &[(GROUPS[1], 2.0, 2.0)]),
    ("interop/gmsh/pytetwild_test_tets.msh", 1373, &[(10, 6285)], &[("color", 3.0051, 5.2209)]),
    ("interop/spx_variants/spx_gmsh2.2_ascii.msh", 2896, SPX, &[("scalars", 0.0, 2.254), (GROUPS[0], 0.0, 0.0), (GROUPS[1], 1.0, 1.0)]),
    ("interop/spx_variants/spx_gmsh2.2_bin.msh", 2896, SPX, &[("scalars", 0.0, 2.254), (GROUPS[0], 0.0, 0.0), (GROUPS[1], 1.0, 1.0)]),
    ("interop/spx_variants/spx_gmsh4.0_ascii.msh", 2896, SPX, &[("scalars", 0.0, 2.254), (GROUPS[1], 1.0, 1.0)]),
    ("interop/spx_variants/spx_gmsh4.1_ascii.msh", 2896, SPX, &[("scalars", 0.0, 2.254), (GROUPS[1], 1.0, 1.0)]),
    ("interop/spx_variants/spx_gmsh4.1_bin.msh", 2896, SPX, &[("scalars", 0.0, 2.254), (GROUPS[1], 1.0, 1.0)]),
    ("interop/spx_variants/spx.mesh", 2896, SPX, &[("medit:ref", 1.0, 1.0), ("medit:ref", 1.0, 1.0)]),
    ("interop/spx_variants/spx.meshb", 2896, SPX, &[("medit:ref", 1.0, 1.0), ("medit:ref", 1.0, 1.0)]),
    ("interop/tetgen/Cube21.node", 9261, &[(10, 48_000)], &[("tetgen:ref", 0.0, 0.0)]),
    ("interop/tetgen/Cube21.ele", 9261, &[(10, 48_000)], &[("tetgen:ref", 0.0, 0.0)]),
    ("tet/libigl_bunny.mesh", 5433, &[(5, 6966), (10, 34_055)], &[("medit:ref", 0.0, 0.0), ("medit:ref", 0.0, 0.0)]),
    ("tet/sfepy_elbow.mesh", 1823, &[(10, 8161)], &[("medit:ref", 0.0, 0.0), ("medit:ref", 6.0, 6.0)]),
    ("tet/su2_brick_tets_ffd.su2", 11_703, &[(5, 7372), (10, 59_156)], &[("su2:tag", 0.0, 6.0)]),
];

fn opened(file: &str) -> Result<UnstructuredGrid, String> {
    let folder = PathBuf::from(env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data"));
    match read_contents(&folder.join("data").join(file), &ReadOptions::default(), &Progress::new()) {
        Ok(Contents::Cells(grid)) => Ok(grid),
        Ok(_) => Err(format!("{file} is no file of cells")),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn real_files_are_read_as_other_programs_do() {
    for &(file, points, cells, arrays) in FILES {
        let grid = opened(file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(grid.points.len(), points, "{file}");
        let counts: Vec<(u8, u64)> = grid.cells.counts().into_iter().map(|(cell_type, count)| (cell_type.0, count)).collect();
        assert_eq!(counts, cells, "{file}");
        let all: Vec<_> = grid.point_data.iter().chain(&grid.cell_data).collect();
        assert_eq!(all.len(), arrays.len(), "{file}");
        for (array, &(name, lowest, highest)) in all.into_iter().zip(arrays) {
            let values = (0..array.values.len()).map(|i| array.values.get(i));
            let [found_lowest, found_highest] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
            assert_eq!(array.name, name, "{file}");
            // The other programs' numbers have five digits.
            let is_close = |a: f64, b: f64| (a - b).abs() <= 5e-5 * b.abs().max(1e-12);
            assert!(is_close(found_lowest, lowest) && is_close(found_highest, highest), "{file} {name}: {found_lowest}..{found_highest}");
        }
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn a_broken_file_is_refused_with_its_line() {
    let error = opened("interop/spx_variants/spx_msh22_ascii_BROKEN_meshio_numpy2.msh").expect_err("broken");
    assert!(error.contains("line 15851: \"np.float32(0.044499)\", expected a value"), "{error}");
}
