//! `octetra compare` of meshes and surfaces as a user runs it: closed forms, files written, limits, errors.

mod program;

use glam::DVec3;
use octetra::format::vtu::write::{Compression, write_mesh};
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{DataArray, MeshParts, TetMesh, Values, collect};
use octetra::progress::Progress;
use program::{done, octetra};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The unit cube in so many tets, moved, with a linear field: `s` at points, `c` the number of each tet.
fn cube(path: &Path, tets: u64, shift: DVec3, s: impl Fn(DVec3) -> f64) {
    let cube = collect(&*plan(Shape::Cube, Some(tets)).expect("a size that can be made")).expect("valid");
    let points: Vec<DVec3> = cube.points().iter().map(|&p| p + cube.center() + shift).collect();
    let array = |name: &str, values| DataArray { name: name.into(), components: 1, values: Values::F64(values) };
    let parts = MeshParts {
        point_data: vec![array("s", points.iter().map(|&p| s(p)).collect())],
        cell_data: vec![array("c", (0..cube.tets().len()).map(|i| i as f64).collect())],
        points,
        tets: cube.tets().to_vec(),
        ..MeshParts::default()
    };
    let mesh = TetMesh::new(parts).expect("valid");
    write_mesh(path, &mesh, Compression::None, &Progress::new()).expect("written");
}

/// The numbers of a comparison that must succeed, drawn small on the CPU.
fn numbers(folder: &Path, args: &[&str]) -> Value {
    let all = [&["compare"], args, &["--json", "-", "--device", "cpu", "--size", "48", "--preset", "fast"]].concat();
    serde_json::from_str(&done(folder, &all)).expect("JSON and nothing else")
}

/// The one line of a comparison that must fail.
fn refused(folder: &Path, args: &[&str]) -> String {
    let all = [&["compare"], args, &["--device", "cpu", "--size", "48", "--preset", "fast"]].concat();
    let output = octetra(folder, &all);
    let error = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1), "{args:?}: {error}");
    assert!(error.starts_with("octetra: ") && error.lines().count() == 1, "{error}");
    error
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} is a number: {value}"))
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

#[test]
fn a_mesh_differs_from_itself_nowhere_and_the_report_is_whole() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    cube(&at("a.vtu"), 800, DVec3::ZERO, |p| p.x + 2.0 * p.y);
    let files = ["--report", "r.html", "--difference", "d.vtu", "--distances", "d.ply", "--max-distance", "0", "--max-difference", "0"];
    let found = numbers(folder.path(), &[&["a.vtu", "a.vtu"], &files[..]].concat());
    for path in ["/distance/hausdorff", "/distance/hausdorff_bound", "/field/over_reference/l2", "/field/over_other/max"] {
        assert_eq!(number(&found, path), 0.0, "{path}");
    }
    assert_eq!((&found["pictures"]["identical"], &found["field"]["same_mesh"]), (&Value::Bool(true), &Value::Bool(true)));
    assert_eq!(found["octree"][0]["nodes"], found["octree"][1]["nodes"]);
    near(number(&found, "/reference/volume"), 1.0, 1e-12);
    near(number(&found, "/other/area"), 6.0, 1e-12);
    assert_eq!((number(&found, "/reference/components"), number(&found, "/reference/open_edges")), (1.0, 0.0));
    assert_eq!(found["limits"]["max_distance"]["passed"], true);

    let report = std::fs::read_to_string(at("r.html")).expect("a report");
    assert_eq!(report.matches("data:image/png;base64,").count(), 5, "two meshes, FLIP, two surfaces; no difference to see");
    for part in ["a.vtu (B) against a.vtu (A)", "tetrahedra", "Distance of surfaces", "L2 difference", "nodes", "identical"] {
        assert!(report.contains(part), "{part}");
    }
    let difference = octetra::format::read_mesh(&at("d.vtu"), &Progress::new()).expect("a mesh");
    let array = &difference.point_data()[0];
    assert!(array.name == "difference" && (0..array.values.len()).all(|i| array.values.get(i) == 0.0));
    assert!(std::fs::metadata(at("d.ply")).is_ok());
}

#[test]
fn a_moved_cube_is_as_far_as_it_was_moved_and_limits_decide() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    cube(&at("a.vtu"), 800, DVec3::ZERO, |p| p.y);
    cube(&at("b.vtu"), 3000, DVec3::X * 0.125, |p| p.y + 0.25);
    let found = numbers(folder.path(), &["a.vtu", "b.vtu"]);
    near(number(&found, "/distance/hausdorff"), 0.125, 1e-9);
    near(number(&found, "/distance/hausdorff_relative"), 0.125 / 3f64.sqrt(), 1e-9);
    assert!(number(&found, "/distance/hausdorff_bound") < 0.125 + 2e-6 * 3f64.sqrt());
    for side in ["over_reference", "over_other"] {
        near(number(&found, &format!("/field/{side}/l2")), 0.25, 1e-9);
        near(number(&found, &format!("/field/{side}/relative/max")), 0.25, 1e-9);
        near(number(&found, &format!("/field/{side}/mean")), -0.25, 1e-9);
        // A quarter of the tets' places at the side that sticks out, as far as their size tells.
        near(number(&found, &format!("/field/{side}/volume_alone")), 0.125, 0.04);
    }
    let beside = numbers(folder.path(), &["a.vtu", "b.vtu", "--snap", "0.1"]);
    assert_eq!(number(&beside, "/field/over_reference/volume_alone"), 0.0);
    near(number(&beside, "/field/over_reference/l2"), 0.25, 1e-9);
    // Cells are carried too, under another name.
    assert!(
        number(&numbers(folder.path(), &["a.vtu", "b.vtu", "--array", "s", "--other-array", "c"]), "/field/over_reference/max") > 100.0
    );

    let error = refused(folder.path(), &["a.vtu", "b.vtu", "--max-distance", "0.07", "--max-difference", "0.3", "--report", "r.md"]);
    assert!(error.contains("b.vtu: the Hausdorff distance is 0.072169 of the diagonal, above --max-distance 0.07"), "{error}");
    assert!(!error.contains("max-difference"), "that limit holds: {error}");
    let report = std::fs::read_to_string(at("r.md")).expect("a report");
    for name in ["reference", "other", "flip", "difference", "distance_reference", "distance_other"] {
        assert!(report.contains(&format!("(r_{name}.png)")) && at(&format!("r_{name}.png")).is_file(), "{name}");
    }
    assert!(refused(folder.path(), &["a.vtu", "b.vtu", "--max-difference", "0.2"]).contains("the largest difference is 0.25 of the range"));
    assert!(refused(folder.path(), &["a.vtu", "b.vtu", "--surface", "--envelope", "0.05"]).contains("envelope 0.05 not kept"));
    done(folder.path(), &["compare", "a.vtu", "b.vtu", "--surface", "--envelope", "0.08"]);
}

/// The unit cube as a surface of quads.
const CUBE_OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn a_mesh_is_compared_with_its_surface() {
    let folder = folder();
    cube(&folder.path().join("a.vtu"), 800, DVec3::ZERO, |p| p.y);
    std::fs::write(folder.path().join("a.obj"), CUBE_OBJ).expect("written");
    for files in [["a.obj", "a.vtu"], ["a.vtu", "a.obj"]] {
        let found = numbers(folder.path(), &[&files[..], &["--envelope", "0.001", "--report", "r.html"]].concat());
        assert!(number(&found, "/distance/hausdorff") < 1e-15 && found["field"].is_null() && found["octree"].is_null());
        assert_eq!(found["limits"]["envelope"]["passed"], true);
        let surface = &found[if files[0] == "a.obj" { "reference" } else { "other" }];
        assert_eq!((&surface["kind"], number(surface, "/triangles"), number(surface, "/cells/quad")), (&"surface".into(), 12.0, 6.0));
        near(number(surface, "/volume"), 1.0, 1e-12);
        let report = std::fs::read_to_string(folder.path().join("r.html")).expect("a report");
        assert!(report.matches("base64,").count() == 2 && report.contains("a.obj is a surface") && report.contains("envelope 0.001 kept"));
    }
    let both = done(folder.path(), &["compare", "a.obj", "a.obj"]);
    assert!(both.contains("Hausdorff distance 0, 0 % of the diagonal"), "{both}");
    let error = refused(folder.path(), &["a.vtu", "a.obj", "--difference", "d.vtu"]);
    assert!(error.contains("--difference needs a field on both meshes, and a.obj is a surface"), "{error}");
}

#[test]
fn what_cannot_be_compared_is_said_in_one_line() {
    let folder = folder();
    cube(&folder.path().join("a.vtu"), 200, DVec3::ZERO, |p| p.y);
    std::fs::write(folder.path().join("a.obj"), CUBE_OBJ).expect("written");
    std::fs::write(folder.path().join("points.obj"), "v 0 0 0\np 1\n").expect("written");
    let says = |args: &[&str], parts: &[&str]| {
        let error = refused(folder.path(), args);
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    says(&["a.vtu", "b.png"], &["a.vtu: a mesh", "b.png is a picture"]);
    says(&["a.vtu", "missing.vtu"], &["missing.vtu", "No such file"]);
    says(&["a.vtu", "points.obj"], &["points.obj: it has no faces"]);
    says(&["a.vtu", "a.vtu", "--array", "t"], &["a.vtu", "there is no array \"t\"", "\"s\""]);
    says(&["a.vtu", "a.vtu", "--report", "a.vtu"], &["a.vtu: is the reference"]);
    says(&["a.vtu", "a.obj", "--distances", "x", "--report", "x"], &["two outputs"]);
    says(&["a.vtu", "a.vtu", "--max-flip", "1"], &["--max-flip is of pictures"]);
    // Flags of meshes are refused with pictures, the ones of all these calls too.
    says(&["b.png", "c.png", "--surface"], &["is of meshes; these are pictures"]);
    says(&["a.vtu", "a.obj", "--max-difference", "1"], &["--max-difference needs a field"]);
}

/// A file of the shared folder, which is no part of the project.
fn shared(name: &str) -> PathBuf {
    PathBuf::from(std::env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared data")).join("data").join(name)
}

#[test]
#[ignore = "needs OCTETRA_SHARED"]
fn meshes_of_pytetwild_keep_to_the_envelope_of_their_surface() {
    let folder = folder();
    let text = |name: &str| shared(name).display().to_string();
    let surface = text("surface/rocker-arm.obj");
    let meshes = ["surface/tetwild/rocker-arm_e0.05_eps0.001.vtu", "surface/tetwild/rocker-arm_e0.1_eps0.002.vtu"].map(text);
    let mut mean = vec![];
    for (mesh, epsilon) in meshes.iter().zip(["0.001", "0.002"]) {
        let found = numbers(folder.path(), &[&surface, mesh, "--envelope", epsilon]);
        assert_eq!(found["reference"]["cells"]["triangle"], 20_088);
        assert_eq!(found["limits"]["envelope"]["passed"], true, "{found}");
        let sides = ["reference", "other"].map(|side| number(&found, &format!("/{side}/volume")));
        near(sides[1] / sides[0], 1.0, 0.01);
        mean.push(number(&found, "/distance/other_to_reference/mean"));
    }
    assert!(0.0 < mean[0] && mean[0] < mean[1], "the finer one is nearer: {mean:?}");
    let found = numbers(folder.path(), &[&meshes[0], &meshes[1], "--report", "r.html"]);
    assert!(number(&found, "/distance/hausdorff_relative") < 0.003 + 1e-6, "{found}");
    assert!(number(&found, "/field/over_reference/relative/l2") < 0.1, "{found}");
    near(number(&found, "/field/over_reference/volume_both") / number(&found, "/reference/volume"), 1.0, 0.02);
}
