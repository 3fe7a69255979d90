//! The program as a user runs it: pictures, files, errors, exit status.

mod program;

use program::{done, octetra};
use serde_json::Value;
use std::path::Path;

/// Runs octetra, which must fail with one line on stderr; gives the line.
fn refused(folder: &Path, args: &[&str]) -> String {
    refused_with(1, folder, args)
}

/// The same with another exit status.
fn refused_with(status: i32, folder: &Path, args: &[&str]) -> String {
    let output = octetra(folder, args);
    let error = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(status), "octetra {args:?}: {error}");
    // Mesa says on its own that XDG_RUNTIME_DIR is not set.
    let said: Vec<&str> = error.lines().filter(|line| !line.contains("XDG_RUNTIME_DIR")).collect();
    assert!(matches!(said[..], [line] if line.starts_with("octetra: ")), "{error}");
    assert_eq!(
        std::fs::read_dir(folder).expect("folder").filter(|e| is_output(e.as_ref().expect("an entry"))).count(),
        0,
        "a file was left"
    );
    error
}

fn is_output(entry: &std::fs::DirEntry) -> bool {
    let name = entry.file_name().to_string_lossy().into_owned();
    name.starts_with(".octetra") || name.ends_with(".png") || name.ends_with(".npy")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
}

#[test]
fn render_draws_the_bundled_mesh_and_says_what_it_measured() {
    let folder = folder();
    done(folder.path(), &["render", "--preset", "fast", "--size", "96x64", "--raw", "raw.npy", "--stats", "stats.json"]);
    let picture = image::open(folder.path().join("wing.png")).expect("a PNG").into_rgb8();
    assert_eq!(picture.dimensions(), (96, 64));
    assert!(picture.pixels().filter(|p| p.0.iter().any(|&c| c > 40)).count() > 300, "the wing is seen");
    assert!(picture.get_pixel(0, 0).0 == [0; 3], "the background is black");
    let raw = octetra::image::read_npy(&folder.path().join("raw.npy")).expect("NPY");
    assert_eq!(&raw.to_bytes(octetra::image::Background::Color([0.0; 3])), picture.as_raw());

    let stats = json(&folder.path().join("stats.json"));
    let number = |group: &str, key: &str| stats[group][key].as_f64().unwrap_or_else(|| panic!("{group}.{key} is a number"));
    assert!(number("mesh", "tets") > 20_000.0 && number("mesh", "points") > 4_000.0);
    let by_depth = stats["octree"]["leaves_by_depth"].as_array().expect("an array");
    assert_eq!(by_depth.iter().filter_map(Value::as_f64).sum::<f64>(), number("octree", "leaves"));
    assert!(number("octree", "nodes") > number("octree", "leaves") && number("octree", "bytes") > 0.0);
    assert!(["load", "regularize", "upload", "frame"].iter().all(|key| number("time", key) > 0.0));
    assert!(number("samples", "taken") > 1000.0);
    let (rmse, max) = (number("error", "rmse_rel"), number("error", "max_rel"));
    assert!(0.0 < rmse && rmse < number("error", "p99_rel") && number("error", "p99_rel") < max && max < 1.0, "{rmse}, {max}");
    assert!((number("error", "psnr_db") + 20.0 * rmse.log10()).abs() < 1e-9 && number("error", "uncovered") < 0.2);
    assert!(stats["error"]["by_tet"]["rmse_rel"].as_f64().is_some_and(|by_tet| by_tet > 0.0));
    assert_eq!(stats["params"]["max_depth"], 7);
    let error = |key: &str| stats["error"][key].as_f64().unwrap_or_else(|| panic!("error.{key} is a number"));
    assert!(0.0 < error("rmse_rel") && error("rmse_rel") < error("max_rel") && error("max_rel") <= error("bound_rel"));
    assert!(stats["boundary"]["bytes"].as_f64().expect("a number") > 0.0);
}

#[test]
fn transfer_functions_are_listed_written_and_drawn_with() {
    let folder = folder();
    let list = done(folder.path(), &["colormap"]);
    assert!(list.starts_with("standard") && list.contains("Black-Body Radiation"), "{list}");
    done(folder.path(), &["colormap", "viridis", "--scale", "symlog=0.5", "--range=-0.5,2", "-o", "own.json"]);
    assert_eq!(json(&folder.path().join("own.json"))["scale"]["symlog"], 0.5);
    done(folder.path(), &["colormap", "own.json", "--paraview", "-o", "map.json"]);
    assert_eq!(json(&folder.path().join("map.json"))[0]["RGBPoints"][0], -0.5);
    let draw = |name: &str, more: &[&str]| {
        let common = ["render", "--preset", "fast", "--device", "cpu", "--size", "24", "-o", "a.png", "--raw", name];
        done(folder.path(), &[&common, more].concat());
        octetra::image::read_npy(&folder.path().join(name)).expect("NPY")
    };
    // ParaView's form of it is the same over the same range, but for the ends of the opacity.
    let (own, map) = (draw("own.npy", &["--tf", "own.json"]), draw("map.npy", &["--tf", "map.json:own", "--range=-0.5,2"]));
    assert!(octetra::image::difference(&own, &map).1 < 0.01, "{:?}", octetra::image::difference(&own, &map));
    let thin = draw("thin.npy", &["--tf", "own.json", "--opacity-scale", "0.1"]);
    let alpha = |image: &octetra::Image| image.pixels.iter().map(|p| f64::from(p[3])).sum::<f64>();
    assert!(alpha(&thin) < 0.5 * alpha(&own), "a tenth of the extinction");

    std::fs::remove_file(folder.path().join("a.png")).expect("there");
    for name in ["own.npy", "map.npy", "thin.npy"] {
        std::fs::remove_file(folder.path().join(name)).expect("there");
    }
    let log = refused(folder.path(), &["render", "--scale", "log"]);
    assert!(log.contains("bundled mesh") && log.contains("a range above 0"), "{log}");
    std::fs::write(folder.path().join("many.json"), r#"[{"Name": "A", "RGBPoints": [0,0,0,0]}, {"Name": "B", "RGBPoints": [0,0,0,0]}]"#)
        .expect("written");
    let many = refused(folder.path(), &["render", "--tf", "many.json"]);
    assert!(many.contains("many.json") && many.contains("A, B"), "{many}");
}

#[test]
fn octree_and_exact_show_the_same_and_the_device_does_not_matter() {
    let folder = folder();
    let shot = |name: &str, more: &[&str]| {
        done(folder.path(), &[&["render", "--preset", "fast", "--size", "64", "-o", "a.png", "--raw", name], more].concat());
        octetra::image::read_npy(&folder.path().join(name)).expect("NPY")
    };
    let (gpu, cpu) = (shot("gpu.npy", &["--device", "gpu"]), shot("cpu.npy", &["--device", "cpu"]));
    let (most, worst) = octetra::image::difference(&gpu, &cpu);
    assert!(most <= 1.0 / 255.0 && worst <= 4.0 / 255.0, "GPU and CPU differ by {most}, {worst}");
    let exact = shot("exact.npy", &["--renderer", "exact"]);
    let (_, covered) = octetra::image::psnr(&exact, &cpu);
    assert!(covered > 44.0, "octree against exact: {covered} dB");
}

#[test]
fn regularize_writes_a_texture_that_others_can_read() {
    let folder = folder();
    let said = done(folder.path(), &["regularize", "--texture", "t.npy", "--max-depth", "6"]);
    assert!(said.contains("nodes") && said.contains("texels"), "{said}");
    assert!(said.contains("error    rmse ") && said.contains(" dB"), "{said}");
    let about = json(&folder.path().join("t.json"));
    let npy = npyz::NpyFile::new(std::fs::File::open(folder.path().join("t.npy")).expect("a file")).expect("NPY");
    assert_eq!((npy.shape().len(), npy.shape()[3]), (4, 4));
    let texels: Vec<u8> = npy.into_vec().expect("uint8");
    let leaves = texels.chunks(4).filter(|t| t[3] != 0 && t[3] != 255).count();
    assert!(leaves > 1000 && texels.chunks(4).all(|t| t[3] == 255 || t[3] % 10 == 0 && t[3] <= 60));
    assert!(about["root_edge"].as_f64().expect("a number") > 0.0 && about["root_origin"].as_array().expect("three").len() == 3);
}

#[test]
fn tune_measures_recommends_and_goes_on_where_it_stopped() {
    let folder = folder();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/ball.vtu");
    let swept = ["--depths", "3,4", "--tolerances", "0.05,0.01", "--size", "48", "--device", "cpu", "--json", "t.json"];
    let tune = |more: &[&str]| done(folder.path(), &[&["tune", mesh, "--quick"], &swept[..], more].concat());
    let said = tune(&["--chart", "t.svg"]);
    assert!(said.contains("PSNR dB") && said.contains("octetra render"), "{said}");
    let record = json(&folder.path().join("t.json"));
    let rows = record["rows"].as_array().expect("rows").clone();
    assert!(rows.len() >= 2 && rows.iter().all(|row| row["psnr_db"].as_f64().is_some_and(|db| db > 10.0)), "{record:#}");
    assert!(record["front"].as_array().is_some_and(|front| !front.is_empty()) && record["subject"]["machine"]["threads"].is_number());
    assert!(std::fs::read_to_string(folder.path().join("t.svg")).expect("a file").starts_with("<svg"));

    // The line to paste gives the octree that was measured.
    let line = said.lines().rev().find_map(|line| line.split_once("octetra render ")).expect("a recommendation").1;
    let args: Vec<&str> = ["render"].into_iter().chain(line.split(' ')).chain(["--size", "8", "--stats", "s.json"]).collect();
    done(folder.path(), &args);
    let bytes = &json(&folder.path().join("s.json"))["octree"]["bytes"];
    let picked = record["recommended"].as_array().and_then(|picks| picks.last()).and_then(|pick| pick["row"].as_u64()).expect("a row");
    assert_eq!(&rows[picked as usize]["bytes"], bytes, "{line}");

    // The same again measures nothing, other settings are added, another mesh is refused.
    let said = tune(&["--chart", "t.png", "--all", "--target-psnr", "98"]);
    assert!(said.contains("No setting measured reaches 98 dB"), "{said}");
    assert_eq!(json(&folder.path().join("t.json"))["rows"], record["rows"]);
    assert_eq!(image::open(folder.path().join("t.png")).expect("a PNG").width(), 1200);
    tune(&["--variances", "0.01"]);
    let more = json(&folder.path().join("t.json"))["rows"].as_array().expect("rows").clone();
    assert!(more.len() > rows.len() && more[..rows.len()] == rows[..]);
    let other = octetra(folder.path(), &[&["tune", "--quick"], &swept[..]].concat());
    let error = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(other.status.code() == Some(1) && error.contains("t.json: holds measurements of another mesh"), "{error}");
}

#[test]
fn ways_to_skip_draw_one_picture_and_are_compared() {
    let folder = folder();
    done(folder.path(), &["generate", "shell", "--dims", "32", "-o", "shell.nhdr"]);
    let drawn = |more: &[&str]| {
        let base = ["render", "shell.nhdr", "--tf", "coolwarm", "--size", "32", "--raw", "raw.npy", "--stats", "stats.json"];
        done(folder.path(), &[&base[..], more].concat());
        let stats = json(&folder.path().join("stats.json"));
        let count = |key: &str| stats["samples"][key].as_u64().unwrap_or_else(|| panic!("samples.{key} is a number"));
        let image = octetra::image::read_npy(&folder.path().join("raw.npy")).expect("NPY");
        (image, count("taken"), count("needed"), stats["params"]["skip"].as_str().expect("a way").to_owned())
    };
    for steps in ["leaf", "fixed"] {
        for device in ["cpu", "gpu"] {
            let (all, most, needed, _) = drawn(&["--steps", steps, "--device", device, "--skip", "none"]);
            assert!(needed * 3 < most * 2, "{needed} of {most}: the shell is hollow");
            for skip in ["octree", "bounds", "half", "half=ray", "k=5"] {
                let (image, taken, _, said) = drawn(&["--steps", steps, "--device", device, "--skip", skip]);
                let (_, worst) = octetra::image::difference(&all, &image);
                assert!(worst <= 1e-5, "{skip}, {steps} on {device}: off by {worst}");
                assert!(said == skip && taken < most && taken * 100 >= needed * 99, "{said}: {taken} samples, {needed} needed");
            }
        }
    }
    let table = done(
        folder.path(),
        &[
            "bench",
            "shell.nhdr",
            "--skip-table",
            "--initial-depth",
            "1",
            "--tolerance",
            "1",
            "--size",
            "12",
            "--repeats",
            "1",
            "--device",
            "cpu",
        ],
    );
    for row in ["none (W)", "half ", "half, raster", "half=ray", "k=8", "octree", "6.439", "3.628 (43.7 %)", "leaf by leaf"] {
        assert!(table.contains(row), "{row} is in the table:\n{table}");
    }
}

#[test]
fn flags_of_the_march_that_contradict_each_other_are_refused() {
    let folder = folder();
    for (flags, said) in [
        (&["--steps", "paper", "--skip", "half"][..], "--steps leaf or fixed"),
        (&["--skip", "encoding"], "--steps fixed"),
        (&["--voxels"], "--steps fixed"),
        (&["--mode", "iso"], "--iso V"),
        (&["--mode", "mip", "--cut", "x=0"], "--cut is drawn with"),
        (&["--value", "value.npy"], "the mode is composite"),
        (&["--turntable", "3", "--raw", "raw.npy"], "of one picture"),
    ] {
        assert!(refused_with(2, folder.path(), &[&["render"][..], flags].concat()).contains(said), "{flags:?}");
    }
}

#[test]
fn generated_meshes_are_read_back() {
    let folder = folder();
    done(folder.path(), &["generate", "ball", "--tets", "5000", "-o", "ball.vtu"]);
    done(folder.path(), &["generate", "cube", "--compress"]);
    let info = done(folder.path(), &["info", "ball.vtu"]);
    assert!(info.contains("point array   radius") && info.contains("<- shown"), "{info}");
    done(folder.path(), &["render", "cube.vtu", "--size", "32", "--tf", "viridis", "--orbit", "11", "--transparent"]);
    assert!(folder.path().join("cube.png").exists());
}

#[test]
fn what_cannot_be_done_is_said_in_one_line() {
    let folder = folder();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    file("broken.vtu", "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>");
    file("notes.txt", "nothing");
    file("tf.json", "{\"color\": [[0, 1, 1, 1]], \"opacity\": [[0, 0], [1, 7]]}");
    file("camera.json", "{\"eye\": [0, 0, 0], \"target\": [0, 0, 0], \"up\": [0, 0, 1]}");
    let fails = |args: &[&str]| refused(folder.path(), args);
    assert!(fails(&["render", "missing.vtu"]).contains("missing.vtu"));
    assert!(fails(&["render", "broken.vtu"]).contains("broken.vtu"));
    assert!(fails(&["render", "notes.txt"]).contains("notes.txt"));
    assert!(fails(&["render", "--array", "temperature"]).contains("\"suction\""), "the arrays there are");
    assert!(fails(&["render", "--tf", "tf.json"]).contains("opacity knot 1"));
    assert!(fails(&["render", "--tf", "jet"]).contains("viridis"));
    assert!(fails(&["render", "--camera", "camera.json"]).contains("camera.json"));
    assert!(fails(&["render", "-o", "no/such/folder/a.png"]).contains("no/such/folder"));
    file("mesh.vtu", "");
    assert!(fails(&["render", "mesh.vtu", "-o", "./mesh.vtu"]).contains("is the mesh"));
    assert!(fails(&["render", "-o", "same", "--stats", "same"]).contains("two outputs"));
    assert!(fails(&["view", "mesh.vtu", "--stats", "./mesh.vtu"]).contains("is the mesh"));
    assert!(fails(&["view", "--camera", "camera.json", "--stats", "camera.json"]).contains("is the camera"));
    assert!(fails(&["render", "--memory", "1MiB"]).contains("--memory"));
    assert!(fails(&["info", "--array", "temperature"]).contains("\"suction\""));
    assert!(fails(&["bench", "--max-depth", "5"]).contains("--depths"));
    assert!(fails(&["bench", "--renderer", "exact"]).contains("octree"));
    assert!(fails(&["view", "--device", "cpu"]).contains("octetra render"));
    assert!(fails(&["generate", "wing", "--tets", "3"]).contains("too few"));
}

#[test]
fn wrong_usage_has_its_own_status() {
    let folder = folder();
    for args in [
        &["render", "--size", "0"][..],
        &["render", "--orbit", "12"],
        &["render", "--max-depth", "26"],
        &["render", "--mode", "best"],
        &["render", "--time", "1", "--time-step", "2"],
        &["tune", "--chart", "a.jpg"],
        &["tune", "--budget", "much"],
        &["render", "--clip", "0,0,0:1e300,0,0"],
        &["render", "--turntable", "3", "--frames", "3", "-o", "a_{i}.png"],
        &["bench", "--mode-table", "--shade", "none"],
    ] {
        assert_eq!(octetra(folder.path(), args).status.code(), Some(2), "{args:?}");
    }
}

#[test]
fn furniture_stands_in_the_picture_and_not_in_the_raw_image() {
    let folder = folder();
    let shot = |name: &str, more: &[&str]| {
        let raw = name.replace(".png", ".npy");
        done(folder.path(), &[&["render", "--preset", "fast", "--size", "300x200", "-o", name, "--raw", &raw], more].concat());
        let pixels = image::open(folder.path().join(name)).expect("a PNG").into_rgb8();
        (pixels, octetra::image::read_npy(&folder.path().join(&raw)).expect("NPY"))
    };
    let (plain, raw) = shot("plain.png", &["--device", "cpu"]);
    let (furnished, same) = shot("all.png", &["--device", "cpu", "--furniture", "all"]);
    assert_eq!(raw, same);
    // The bar ends 16 pixels from the right side; it is 100 of 200 pixels high and has the knots' colours at its ends.
    let at = |x: u32, y: u32| furnished.get_pixel(x, y).0;
    let (top, bottom) = (at(277, 52), at(277, 147));
    assert!(top[0] > 220 && top[2] < 30 && bottom[2] > 140 && bottom[0] < 40, "{top:?}, {bottom:?}");
    let changed = plain.pixels().zip(furnished.pixels()).filter(|(a, b)| a != b).count();
    assert!((2000..20_000).contains(&changed), "{changed} pixels");
    let wrong = octetra(folder.path(), &["render", "--furniture", "bar,legs"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("bar, axes, box"));
}

#[test]
fn probe_says_what_is_at_places_in_a_table_and_in_files() {
    let folder = folder();
    done(folder.path(), &["generate", "cube", "-o", "cube.vtu"]);
    let probe = |args: &[&str]| done(folder.path(), &[&["probe", "cube.vtu", "--max-depth", "4"], args].concat());
    let table = probe(&["--at", "0.5,0.25,0.125", "--at", "-1,2,3", "-o", "points.json"]);
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines.len() == 3 && lines[0].starts_with("x ") && lines[1].contains("tetrahedron") && lines[1].contains("depth"), "{table}");
    assert!(lines[2].starts_with("-1 ") && lines[2].split_whitespace().skip(3).all(|word| word == "-"), "{table}");
    let points = json(&folder.path().join("points.json"));
    let (data, octree) = (points[0]["data"].as_f64().expect("a number"), points[0]["octree"].as_f64().expect("a number"));
    assert!((data - octree).abs() < 1e-4 * data.abs().max(1.0), "linear: {data}, {octree}");
    assert!(points[1]["data"].is_null() && points[1]["cell"].is_null());

    probe(&["--line", "0,0,0:1,1,1", "--samples", "11", "-o", "line.csv"]);
    let text = std::fs::read_to_string(folder.path().join("line.csv")).expect("a file");
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|row| row.split(',').take(6).map(|v| v.parse().expect("a number")).collect()).collect();
    assert!(rows.len() == 11 && (rows[10][0] - 3f64.sqrt()).abs() < 1e-12 && rows[5][1] == 0.5, "{text}");
    let mean = (rows[0][4] + rows[10][4]) / 2.0;
    assert!((rows[5][4] - mean).abs() < 1e-9, "linear along the diagonal: {text}");

    for wrong in
        [&["probe", "cube.vtu"][..], &["probe", "cube.vtu", "--at", "1,2"], &["probe", "cube.vtu", "--at", "1,2,3", "--samples", "5"]]
    {
        assert_eq!(octetra(folder.path(), wrong).status.code(), Some(2), "{wrong:?}");
    }
}
