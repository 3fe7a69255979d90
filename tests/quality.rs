//! `octetra quality`, and metrics as arrays; against VTK where its numbers are known.

mod program;

use octetra::format::read_mesh;
use octetra::mesh::quality::{Metric, Rule, Summary, values};
use octetra::progress::Progress;
use program::{done, octetra};
use serde_json::Value;
use std::path::Path;

#[test]
fn quality_says_how_cells_are_shaped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let table = done(folder, &["quality", "--metric", "shape,min-angle", "--histogram", "--worst", "2"]);
    let line = |start: &str| table.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{start} in {table}"));
    assert!(line("shape ").contains("0.3 .. 1") && line("min_angle ").contains("40 .. 70.529"), "{table}");
    assert!(line("note ").contains("180 degrees") && line("shape, worst").len() > 10 && table.matches('#').count() > 50, "{table}");

    let text = done(folder, &["quality", "--metric", "all", "--json", "-", "--worst", "3", "--array-out", "judged.vtu"]);
    let numbers: Value = serde_json::from_str(&text).expect("JSON");
    let metrics = numbers["metrics"].as_array().expect("a list");
    assert_eq!(metrics.len(), Metric::ALL.len());
    let of = |name: &str| metrics.iter().find(|metric| metric["name"] == name).expect("listed");
    let (shape, energy) = (of("shape"), of("amips"));
    let number = |metric: &Value, key: &str| metric[key].as_f64().expect("a number");
    assert!((number(shape, "min") * number(energy, "max") - 3.0).abs() < 1e-12, "the energy is 3 by the shape");
    assert_eq!(
        (shape["worst"][0]["cell"].as_u64(), shape["worst"].as_array().map(Vec::len)),
        (energy["worst"][0]["cell"].as_u64(), Some(3))
    );
    assert_eq!(shape["histogram"]["counts"].as_array().expect("bins").iter().filter_map(Value::as_u64).sum::<u64>(), numbers["tets"]);

    // What is written holds the same.
    let written = read_mesh(&folder.join("judged.vtu"), &Progress::new()).expect("a mesh");
    let array = written.cell_data().iter().find(|array| array.name == "quality:shape").expect("an array");
    let least = (0..written.tets().len()).map(|tet| array.values.get(tet)).fold(f64::INFINITY, f64::min);
    assert_eq!(least, number(shape, "min"));
    let info = done(folder, &["info", "--array", "quality:volume"]);
    assert!(info.lines().any(|line| line.contains("quality:volume") && line.ends_with("<- shown")), "{info}");
    done(folder, &["generate", "ball", "--tets", "1000", "-o", "ball.vtu"]);
    let flags = ["--array", "quality:shape", "--max-depth", "3", "--size", "64", "--device", "cpu", "-o", "shape.png"];
    done(folder, &[&["render", "ball.vtu"][..], &flags].concat());
    let picture = image::open(folder.join("shape.png")).expect("a PNG").into_rgb8();
    assert!(picture.pixels().filter(|p| p.0.iter().any(|&c| c > 40)).count() > 100, "the ball is seen");
}

#[test]
fn what_quality_cannot_judge_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |status: i32, args: &[&str]| {
        let output = octetra(folder.path(), args);
        let error = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(status), "octetra {args:?}: {error}");
        error
    };
    assert!(refused(2, &["quality", "--metric", "beauty"]).contains("there is no metric \"beauty\""));
    assert!(refused(2, &["quality", "--array-out", "judged.txt"]).contains(".vtu"));
    assert!(refused(1, &["quality", "missing.vtu"]).contains("missing.vtu"));
    assert!(refused(1, &["render", "--array", "quality:beauty"]).contains("there is no metric \"beauty\""));
    std::fs::write(folder.path().join("scan.nrrd"), "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n12345678")
        .expect("written");
    let error = refused(1, &["quality", "scan.nrrd"]);
    assert!(error.contains("scan.nrrd: is a regular volume, expected a mesh"), "{error}");
}

/// Least, mean and largest value of each metric, by VTK 9.7.2 (`tests/peers/quality.py` compares tet by tet).
#[rustfmt::skip]
const ROCKER_ARM: [(&str, [f64; 3]); 21] = [
    ("scaled_jacobian", [1.202835128790e-01, 5.568983341737e-01, 9.644474760141e-01]),
    ("shape", [3.451265894707e-01, 7.918709873809e-01, 9.985966457480e-01]),
    ("aspect_ratio", [1.029690524950e+00, 1.616437065706e+00, 4.766238630602e+00]),
    ("radius_ratio", [1.001618165898e+00, 1.432308390532e+00, 1.291366649822e+01]),
    ("edge_ratio", [1.048143808763e+00, 1.834935864536e+00, 5.272253127030e+00]),
    ("aspect_gamma", [1.002108730064e+00, 1.483424043143e+00, 4.932105642463e+00]),
    ("aspect_frobenius", [1.001405326423e+00, 1.292012190759e+00, 2.897487561111e+00]),
    ("condition", [1.001390103364e+00, 1.319449544212e+00, 4.283847326806e+00]),
    ("mean_ratio", [2.027531590951e-01, 7.098644421499e-01, 9.978957073211e-01]),
    ("collapse_ratio", [9.015828634494e-02, 4.307745898960e-01, 7.809642623403e-01]),
    ("min_angle", [1.103607118752e+01, 4.825960270257e+01, 8.360114834153e+01]),
    ("equiangle_skew", [4.302443859133e-02, 4.344658477391e-01, 8.651862340268e-01]),
    ("equivolume_skew", [3.090349435743e-03, 4.240008283423e-01, 9.952527421647e-01]),
    ("squish_index", [1.683572486287e-03, 2.271157377235e-01, 7.797200760397e-01]),
    ("normalized_inradius", [5.408346570512e-02, 6.793359875128e-01, 9.928583179685e-01]),
    ("relative_size_squared", [9.702968730076e-05, 2.971656071136e-01, 9.997932729729e-01]),
    ("shape_and_size", [3.379480323647e-05, 2.421878577142e-01, 9.637883071899e-01]),
    ("distortion", [1.000000000000e+00, 1.000000000000e+00, 1.000000000000e+00]),
    ("inradius", [6.169406740484e-04, 5.076735536308e-03, 1.242522547457e-02]),
    ("jacobian", [1.995830221718e-07, 2.026148529512e-05, 1.756156331778e-04]),
    ("volume", [3.326383702863e-08, 3.376914215854e-06, 2.926927219629e-05]),
];

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn metrics_are_those_of_vtk() {
    let shared = std::env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED is the folder of shared test data");
    let mesh = read_mesh(&Path::new(&shared).join("data/surface/tetwild/rocker-arm_e0.1_eps0.002.vtu"), &Progress::new()).expect("sound");
    for (name, expected) in ROCKER_ARM {
        let metric: Metric = name.parse().expect("a metric");
        let found = |rule| Summary::new(&mesh, metric, &values(&mesh, metric, rule, &Progress::new()).expect("not cancelled"), 10, 0);
        let (vtk, defined) = (found(Rule::Vtk), found(Rule::Definition));
        for (found, expected) in [vtk.min, vtk.mean, vtk.max].into_iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{metric}: {found}, VTK has {expected}");
        }
        assert_eq!(vtk == defined, metric.vtk_differs().is_none(), "{metric}: only where it is said");
    }
}
