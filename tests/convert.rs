//! Files of cells of any type through the program: `info`, `convert`, `formats`, a picture.

mod program;

use program::{done, octetra};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Two unit cubes side by side, a wedge on the first and a triangle; a field that is x + 2 y over points, the cell's number over cells.
const MIXED: &str = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 14 double\n\
    0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0\n0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1\n0.5 0 2 0.5 1 2\n\
    CELLS 4 29\n8 0 1 4 3 6 7 10 9\n8 1 2 5 4 7 8 11 10\n6 6 12 7 9 13 10\n3 0 1 4\nCELL_TYPES 4\n12 12 13 5\n\
    POINT_DATA 14\nSCALARS f double\nLOOKUP_TABLE default\n0 1 2 2 3 4 0 1 2 2 3 4 0.5 2.5\nCELL_DATA 4\nSCALARS number int\nLOOKUP_TABLE default\n0 1 2 3\n";

fn info(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&done(folder, &["info", file, "--json", "-"])).expect("JSON")
}

fn refused(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = octetra(folder, args);
    (output.status.code().expect("an exit status"), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_mesh_of_several_cells_is_said_written_and_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("mixed.vtk"), MIXED).expect("written");
    let first = info(folder, "mixed.vtk");
    assert_eq!(first["cells"], serde_json::json!({ "triangle": 1, "hexahedron": 2, "wedge": 1 }));
    assert_eq!((&first["points"], &first["mesh"]["tets"], &first["mesh"]["components"]), (&14.into(), &15.into(), &1.into()));
    assert!((first["mesh"]["volume"].as_f64().expect("a number") - 2.5).abs() < 1e-12);
    // Two cubes and a wedge: 10 squares and a roof of 2 rectangles with 2 gables.
    let area = 9.0 + 2.0 * (0.25f64 + 1.0).sqrt() + 1.0;
    assert!((first["mesh"]["boundary_area"].as_f64().expect("a number") - area).abs() < 1e-12);
    let text = done(folder, &["info", "mixed.vtk"]);
    assert!(text.contains("  2           hexahedra") && text.contains("note          1 triangle (type 5) set aside"), "{text}");

    // Cells stay what they are, from format to format.
    done(folder, &["convert", "mixed.vtk", "-o", "mixed.vtu"]);
    done(folder, &["convert", "mixed.vtu", "-o", "mixed.msh"]);
    done(folder, &["convert", "mixed.msh", "-o", "text.msh", "--ascii"]);
    for file in ["mixed.vtu", "mixed.msh", "text.msh"] {
        let again = info(folder, file);
        for key in ["points", "cells"] {
            assert_eq!(again[key], first[key], "{file}");
        }
        assert_eq!(again["mesh"]["volume"], first["mesh"]["volume"], "{file}");
        let range = |of: &Value, name: &str| {
            of["arrays"].as_array().and_then(|all| all.iter().find(|a| a["name"] == name)).map(|a| a["range"].clone())
        };
        for name in ["f", "number"] {
            assert_eq!(range(&again, name), range(&first, name), "{file} {name}");
        }
    }
    done(folder, &["convert", "mixed.vtk", "--tets", "--uncompressed", "-o", "tets.vtu"]);
    assert_eq!(info(folder, "tets.vtu")["cells"], serde_json::json!({ "tetrahedron": 15 }));

    done(folder, &["render", "mixed.vtk", "--preset", "fast", "--size", "64", "--device", "cpu", "-o", "mixed.png"]);
    let picture = image::open(folder.join("mixed.png")).expect("a PNG").into_rgb8();
    assert!(picture.pixels().filter(|p| p.0.iter().any(|&c| c > 20)).count() > 200, "the cells are seen");
    let probed = done(folder, &["probe", "mixed.vtk", "--at", "1.5,0.25,0.5", "--preset", "fast"]);
    assert!(probed.contains("hexahedron 1"), "{probed}");
}

#[test]
fn what_cannot_be_converted_or_drawn_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let surface = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 2\n";
    fs::write(folder.join("surface.vtk"), surface).expect("written");
    fs::write(folder.join("mixed.vtk"), MIXED).expect("written");
    fs::write(folder.join("a.raw"), [0; 8]).expect("written");
    assert!(done(folder, &["info", "surface.vtk"]).contains("no cell has a volume"));
    done(folder, &["convert", "surface.vtk", "-o", "surface.vtu"]);
    for (args, status, expected) in [
        (&["render", "surface.vtk"][..], 1, "surface.vtk: has no cell with a volume: it holds 1 triangle (type 5)"),
        (&["convert", "surface.vtk", "--tets", "-o", "out.vtu"], 1, "surface.vtk: has no cell with a volume"),
        (&["convert", "mixed.vtk", "-o", "out.stl"], 2, "expected a name with .vtu or .msh"),
        (&["convert", "mixed.vtk", "-o", "out.vtu", "--ascii"], 2, "--ascii is for .msh files"),
        (&["convert", "mixed.vtk", "-o", "mixed.vtk"], 2, "expected a name with .vtu or .msh"),
        (&["convert", "surface.vtu", "-o", "surface.vtu"], 1, "surface.vtu"),
        (&["convert", "a.raw", "--dims", "2,2,2", "--type", "u8", "-o", "out.vtu"], 1, "is a regular volume"),
    ] {
        let (found, error) = refused(folder, args);
        assert!(found == status && error.contains(expected), "octetra {args:?}: {found} {error}");
    }
    assert!(!folder.join("out.vtu").exists() && !folder.join("out.stl").exists());
    let listed = done(folder, &["formats"]);
    for suffix in [".vtu", ".pvtu", ".msh", ".meshb", ".su2", ".e ", ".vtkhdf", ".xdmf", ".inp", ".foam", ".node", ".stl"] {
        assert!(listed.contains(suffix), "{suffix}: {listed}");
    }
}
