//! Regular volumes from file to picture: closed forms, the GPU against the CPU, and real files of other people's making.

use glam::{DMat3, DQuat, DVec3};
use octetra::format::{self, Data, ReadOptions};
use octetra::geometry::Placed;
use octetra::octree::{OctreeParams, OctreeTexture, Reconstruction, regularize_grid};
use octetra::progress::Progress;
use octetra::render::{DeviceChoice, Renderer, Scene};
use octetra::view::{Camera, Projection, RenderSettings, TransferFunction, View};
use octetra::volume::{Grid, GridFrame, Samples};
use std::path::Path;
use std::process::Command;

fn grid(frame: GridFrame, value: impl Fn(DVec3) -> f64) -> Grid {
    let [nx, ny, nz] = frame.dims;
    let at = |i: u32| frame.origin + frame.steps * DVec3::new(f64::from(i % nx), f64::from(i / nx % ny), f64::from(i / nx / ny));
    Grid::new(frame, "s".into(), Samples::F32((0..nx * ny * nz).map(|i| value(at(i)) as f32).collect())).expect("valid")
}

fn scene(renderer: &Renderer, grid: &Grid, params: &OctreeParams) -> Scene {
    let tree = regularize_grid(grid, params, &Progress::new()).expect("regularizes");
    let surface = tree.grid_surface(grid);
    renderer.octree_scene(grid, OctreeTexture::encode(&tree).expect("fits"), surface).expect("fits").0
}

/// Opacity over the normalised value, per world unit.
fn opacity(points: &[[f64; 2]]) -> TransferFunction {
    TransferFunction { opacity: points.to_vec(), unit_distance: Some(1.0), ..TransferFunction::standard() }
}

/// The alpha of one ray from `eye` along `direction`.
fn alpha(renderer: &Renderer, scene: &Scene, eye: DVec3, direction: DVec3, transfer_function: &TransferFunction) -> f64 {
    let camera = Camera {
        eye,
        target: eye + direction,
        up: direction.any_orthogonal_vector(),
        projection: Projection::Parallel { view_height: 1e-6 },
    };
    let settings = RenderSettings { min_transmittance: 0.0, ..RenderSettings::new(1, 1) };
    let view = View { camera, transfer_function: transfer_function.clone(), settings };
    f64::from(renderer.render(scene, &view, &Progress::new()).expect("renders").image.pixels[0][3])
}

/// Frames of one box, 2 x 1.5 x 1, around (10, -5, 3): along the axes, with the axes in another order and sense, and turned.
fn frames() -> [(GridFrame, DMat3); 3] {
    let steps = DMat3::from_diagonal(DVec3::new(0.1, 0.05, 0.0625));
    let other_order = DMat3::from_cols(DVec3::NEG_Z, DVec3::X, DVec3::Y);
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.8));
    [DMat3::IDENTITY, other_order, turn].map(|directions| {
        let steps = directions * steps;
        let origin = DVec3::new(10.0, -5.0, 3.0) - steps * DVec3::new(10.0, 15.0, 8.0);
        (GridFrame { dims: [21, 31, 17], origin, steps }, directions)
    })
}

#[test]
fn a_linear_field_in_a_box_has_its_closed_form_whatever_way_the_axes_go() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    for (frame, directions) in frames() {
        let along = directions * DVec3::X;
        let center = DVec3::new(10.0, -5.0, 3.0);
        let grid = grid(frame, |p| (p - center).dot(along));
        assert!(grid.center().distance(center) < 1e-9);
        for reconstruction in [Reconstruction::Continuous, Reconstruction::Leaf] {
            let params = OctreeParams { reconstruction, tolerance: Some(0.005), max_depth: 7, ..OctreeParams::default() };
            let scene = scene(&renderer, &grid, &params);
            // Along the field the opacity goes from 0 to 1 over a length of 2; across, the length is 1.5 and the opacity the middle's.
            let ramp = opacity(&[[0.0, 0.0], [1.0, 1.0]]);
            let start = center - 5.0 * along + 0.011 * (directions * DVec3::Y);
            let found = alpha(&renderer, &scene, start, along, &ramp);
            assert!((found - (1.0 - (-1.0f64).exp())).abs() < 2e-3, "{found} along {along} {reconstruction:?}");
            let across = directions * DVec3::Y;
            let found = alpha(&renderer, &scene, center - 5.0 * across + 0.25 * along, across, &ramp);
            assert!((found - (1.0 - (-1.5f64 * 0.625).exp())).abs() < 4e-3, "{found} across {across} {reconstruction:?}");
            // Beside the box there is nothing.
            let beside = alpha(&renderer, &scene, center - 5.0 * across + 1.01 * along, across, &opacity(&[[0.0, 1.0], [1.0, 1.0]]));
            assert_eq!(beside, 0.0);
        }
    }
}

#[test]
fn a_constant_volume_is_a_slab() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    for (frame, directions) in frames() {
        let scene = scene(&renderer, &grid(frame, |_| 7.0), &OctreeParams::default());
        let full = opacity(&[[0.0, 0.8], [1.0, 0.8]]);
        for (axis, length) in [(DVec3::X, 2.0), (DVec3::Y, 1.5), (DVec3::Z, 1.0)] {
            let along = directions * axis;
            let start = DVec3::new(10.0, -5.0, 3.0) - 4.0 * along + 0.017 * (directions * DVec3::new(axis.y, axis.z, axis.x));
            let found = alpha(&renderer, &scene, start, along, &full);
            assert!((found - (1.0 - (-0.8f64 * length).exp())).abs() < 1e-4, "{found} over {length}");
        }
    }
}

#[test]
fn a_ball_has_its_chord() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let step = 2.0 / 63.0;
    let frame = GridFrame::along_axes([64; 3], DVec3::splat(-1.0), DVec3::splat(step));
    let grid = grid(frame, DVec3::length);
    let (lo, hi) = (grid.range()[0], grid.range()[1]);
    let radius = 0.7;
    let edge = (radius - lo) / (hi - lo);
    let inside = opacity(&[[0.0, 0.5], [edge - 1e-4, 0.5], [edge + 1e-4, 0.0], [1.0, 0.0]]);
    let scene = scene(&renderer, &grid, &OctreeParams { tolerance: Some(0.002), ..OctreeParams::default() });
    for off in [0.05, 0.3, 0.5, 0.65, 0.75] {
        for direction in [DVec3::X, DVec3::new(1.0, 2.0, -0.5).normalize(), DVec3::new(-1.0, 1.0, 1.0).normalize()] {
            let chord = 2.0 * f64::max(radius * radius - off * off, 0.0).sqrt();
            let start = -3.0 * direction + off * direction.any_orthonormal_vector();
            let found = alpha(&renderer, &scene, start, direction, &inside);
            let length = -(1.0 - found).ln() / 0.5;
            assert!((length - chord).abs() < 4e-3, "{length} for a chord of {chord} along {direction}");
        }
    }
}

#[test]
fn gpu_and_cpu_draw_the_same() {
    let waves = |p: DVec3| (3.0 * p.x).sin() + (2.0 * p.y + p.z).cos() + if p.z > 3.2 { f64::NAN } else { 0.0 };
    let (on_cpu, on_gpu) = (Renderer::new(DeviceChoice::Cpu).expect("the CPU"), Renderer::new(DeviceChoice::Gpu).expect("an adapter"));
    for (frame, _) in frames() {
        let grid = grid(frame, waves);
        let params = OctreeParams { max_depth: 7, ..OctreeParams::default() };
        let scenes = [&on_cpu, &on_gpu].map(|renderer| scene(renderer, &grid, &params));
        for orbit in [1, 6] {
            let camera = Camera::orbit(grid.bounds().translated(grid.center()), orbit, 1.3);
            let view = View { camera, transfer_function: TransferFunction::standard(), settings: RenderSettings::new(64, 48) };
            let draw = |renderer: &Renderer, scene| renderer.render(scene, &view, &Progress::new()).expect("renders").image;
            let (a, b) = (draw(&on_cpu, &scenes[0]), draw(&on_gpu, &scenes[1]));
            let covered = a.pixels.iter().filter(|pixel| pixel[3] > 0.1).count();
            let worst = a.pixels.iter().flatten().zip(b.pixels.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst <= 1.0 / 255.0 && covered > 400, "{worst}, {covered} covered");
        }
    }
}

#[test]
fn the_command_says_how_far_the_octree_is_from_a_volume() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let octetra = |args: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_octetra")).current_dir(folder.path()).args(args).output().expect("the program starts")
    };
    let done = |args: &[&str]| {
        let output = octetra(args);
        assert!(output.status.success(), "octetra {args:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    done(&["generate", "shell", "--dims", "40", "-o", "shell.nhdr"]);
    let said = done(&["regularize", "shell.nhdr", "--max-depth", "5", "--stats", "s.json"]);
    assert!(said.contains("error    rmse ") && said.contains("bound    "), "{said}");
    done(&["render", "shell.nhdr", "--max-depth", "5", "--size", "32", "--device", "cpu", "--stats", "r.json"]);
    let stats = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(folder.path().join(name)).expect("a file")).expect("JSON")
    };
    for stats in [stats("s.json"), stats("r.json")] {
        let error = |key: &str| stats["error"][key].as_f64().unwrap_or_else(|| panic!("error.{key} is a number"));
        assert!(0.0 < error("rmse_rel") && error("rmse_rel") < error("p99_rel") && error("max_rel") <= error("bound_rel"));
        // Leaves of two steps cannot follow the wall. The bound is the largest error itself.
        assert!(error("bound_rel") < 1.2 * error("max_rel") && error("max_rel") > 0.1, "{}", stats["error"]);
        assert_eq!((error("points"), error("uncovered")), (f64::from(1 << 20), 0.0));
        assert!(stats["time"]["error"].is_number() && stats["time"]["bound"].is_number() && stats["volume"]["mapped"] == false);
    }

    let tuned = done(&["tune", "shell.nhdr", "--quick", "--depths", "4,5", "--size", "24", "--device", "cpu", "--json", "t.json"]);
    assert!(tuned.contains("field dB") && tuned.contains("64000 voxels") && tuned.contains("octetra render shell.nhdr"), "{tuned}");
    assert!(stats("t.json")["rows"].as_array().is_some_and(|rows| rows.iter().all(|row| row["psnr_db_by_view"] == serde_json::json!([]))));
    let raw = ["shell.raw", "--dims", "40,40,40", "--type", "u8", "--spacing", "0.5,0.5,0.5"];
    let tuned = done(&[&["tune", "--quick", "--depths", "4", "--size", "24", "--device", "cpu"], &raw[..]].concat());
    assert!(tuned.contains("octetra render shell.raw --dims 40,40,40 --type u8 --spacing 0.5,0.5,0.5 --max-depth 4"), "{tuned}");

    for (args, expected) in [
        (&["render", "shell.nhdr", "--renderer", "exact"][..], "--renderer exact draws tetrahedral meshes"),
        (&["view", "shell.nhdr", "--renderer", "exact"], "--renderer exact draws tetrahedral meshes"),
        (&["bench", "shell.nhdr"], "is a regular volume (NRRD), expected a tetrahedral mesh"),
        (&["render", "shell.nhdr", "--solution", "shell.raw"], "a solution belongs to a PLOT3D grid"),
        (&["render", "shell.nhdr", "--memory", "100KiB"], "raise it with --memory"),
    ] {
        let output = octetra(args);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && error.contains("shell.nhdr") | error.contains("64000 voxels"), "{args:?}: {error}");
        assert!(error.contains(expected), "{args:?}: {error}");
    }
    // 64 000 bytes do not fit the budget, so that they stay in their file.
    assert!(done(&["info", "shell.nhdr", "--memory", "60KiB"]).contains("mapped from the file"));
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn real_volumes_hold_what_others_find_in_them() {
    let shared = std::env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED is the folder of shared test data");
    for (file, dims, name, range, spacing) in [
        ("volume/HeadMRVolume.mhd", [48, 62, 42], "values", [0.0, 255.0], [4.0, 4.0, 4.0]),
        ("volume/cranium_ct_256x256x108.nhdr", [256, 256, 108], "values", [-1024.0, 2986.0], [0.957_031, 0.957_031, 1.5]),
        ("volume/hydrogen.vti", [64, 64, 64], "probability_density", [0.0, 1.0], [1.0, 1.0, 1.0]),
        ("volume/teapot_256x256x178.nhdr", [256, 256, 178], "values", [0.0, 255.0], [1.0, 1.0, 1.0]),
        ("volume/vistrails_head.120.vtk", [120, 120, 130], "nrrd94920", [0.0, 255.0], [2.26448, 2.26448, 2.27132]),
        ("interop/vtkio/volume_complex.vti", [3, 4, 6], "volume_scalars", [0.0, 50.0], [1.0, 1.0, 1.0]),
    ] {
        let path = Path::new(&shared).join("data").join(file);
        let grid = match format::read(&path, &ReadOptions::default(), &Progress::new()) {
            Ok(Data::Grid(grid)) => grid,
            Ok(Data::Mesh(_)) => panic!("{file} is no mesh"),
            Err(error) => panic!("{error}"),
        };
        assert_eq!((grid.frame().dims, grid.name(), grid.range()), (dims, name, range), "{file}");
        if file != "interop/vtkio/volume_complex.vti" {
            assert!(grid.frame().spacing().distance(DVec3::from_array(spacing)) < 1e-9, "{file}");
        }
    }
}
