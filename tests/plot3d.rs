//! PLOT3D from file to picture: a pair as a user opens it, and the Blunt Fin against the tets that others made of it.

mod program;

use octetra::format::{self, Data, ReadOptions, read_mesh};
use octetra::geometry::signed_volume;
use octetra::progress::Progress;
use octetra::view::{Camera, RenderSettings, RendererKind, TransferFunction, View};
use octetra::{Renderer, ScalarField, TetMesh, render::DeviceChoice};
use program::{done, octetra};
use std::path::Path;

fn refused(folder: &Path, args: &[&str]) -> String {
    let output = octetra(folder, args);
    assert_eq!(output.status.code(), Some(1), "octetra {args:?}");
    String::from_utf8(output.stderr).expect("text")
}

/// A sector of a thick pipe, 9 x 13 x 7 points, little-endian in Fortran records; density is the radius.
fn pair() -> (Vec<u8>, Vec<u8>) {
    let dims = [9u32, 13, 7];
    let at = |i: u32| {
        let (r, a, z) = (1.0 + (i % 9) as f32 / 8.0, (i / 9 % 13) as f32 / 6.0, (i / 117) as f32 / 3.0);
        [r * a.cos(), r * a.sin(), z, r]
    };
    let count = dims.iter().product::<u32>();
    let plane = |k: usize| (0..count).flat_map(move |i| at(i)[k].to_le_bytes());
    let record = |bytes: Vec<u8>| [&(bytes.len() as u32).to_le_bytes()[..], &bytes, &(bytes.len() as u32).to_le_bytes()].concat();
    let header = || record(dims.iter().flat_map(|n| n.to_le_bytes()).collect());
    let grid = [header(), record(plane(0).chain(plane(1)).chain(plane(2)).collect())].concat();
    let values = plane(3).chain(plane(0)).chain(plane(1)).chain(plane(2)).chain(plane(3)).collect();
    (grid, [header(), record(vec![0; 16]), record(values)].concat())
}

#[test]
fn a_grid_is_drawn_with_the_solution_beside_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (grid, solution) = pair();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    put("pipe.xyz", &grid);
    let alone = done(folder.path(), &["info", "pipe.xyz"]);
    assert!(alone.contains("points        819") && alone.contains("tets          2880") && !alone.contains("array"), "{alone}");
    let error = refused(folder.path(), &["render", "pipe.xyz"]);
    assert!(error.contains("pipe.xyz: is a PLOT3D grid without a solution beside it (looked for pipe.q, pipe.f)"), "{error}");
    put("other.dat", &solution);
    let named = done(folder.path(), &["info", "pipe.xyz", "--solution", "other.dat"]);
    assert!(named.contains("point array   Density  1 .. 2  <- shown") && named.contains("Momentum"), "{named}");
    let error = refused(folder.path(), &["render", "pipe.xyz", "--solution", "other.dat", "--stats", "other.dat"]);
    assert!(error.contains("other.dat: is its solution, an output would overwrite it"), "{error}");
    let error = refused(folder.path(), &["render", concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/ball.vtu"), "--solution", "other.dat"]);
    assert!(error.contains("a solution belongs to a PLOT3D grid"), "{error}");

    put("pipe.q", &solution);
    let small = ["--size", "48", "--device", "cpu", "--array", "Momentum", "--component", "z"];
    done(folder.path(), &[&["render", "pipe.xyz", "--raw", "octree.npy"], &small[..]].concat());
    done(folder.path(), &[&["render", "pipe.q", "--renderer", "exact", "--raw", "exact.npy", "-o", "e.png"], &small[..]].concat());
    let [octree, exact] = ["octree.npy", "exact.npy"].map(|name| octetra::image::read_npy(&folder.path().join(name)).expect("NPY"));
    let (_, covered) = octetra::image::psnr(&exact, &octree);
    assert!(covered > 40.0 && exact.pixels.iter().filter(|p| p[3] > 0.1).count() > 100, "{covered} dB");
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn the_blunt_fin_is_the_mesh_that_others_made_of_it() {
    let shared = std::env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED is the folder of shared test data");
    let data = Path::new(&shared).join("data");
    let Ok(Data::Mesh(own)) = format::read(&data.join("plot3d/bluntfinxyz.bin"), &ReadOptions::default(), &Progress::new()) else {
        panic!("the pair loads");
    };
    let others = read_mesh(&data.join("tet/blunt_fin.vtu"), &Progress::new()).expect("reads");
    assert_eq!((own.tets().len(), own.points(), own.center()), (187_395, others.points(), others.center()));
    assert_eq!((own.inverted_count(), own.zero_volume_count()), (0, others.zero_volume_count()));
    for (a, b) in own.point_data().iter().zip(others.point_data()) {
        assert_eq!(a.values, b.values, "{} and {}", a.name, b.name);
    }
    let volume = |mesh: &TetMesh| (0..mesh.tets().len()).map(|tet| signed_volume(&mesh.corners(tet))).sum::<f64>();
    assert!((volume(&own) / volume(&others) - 1.0).abs() < 1e-6, "{} and {}", volume(&own), volume(&others));
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let draw = |mesh: &TetMesh| {
        let field = ScalarField::select(mesh, &Default::default()).expect("a field");
        let settings = RenderSettings { renderer: RendererKind::Exact, ..RenderSettings::new(96, 64) };
        let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 4, 1.0);
        let view = View { camera, transfer_function: TransferFunction::standard(), settings };
        let scene = renderer.exact_scene(mesh, &field, &Progress::new()).expect("a scene");
        renderer.render(&scene, &view, &Progress::new()).expect("a picture").image
    };
    let (most, worst) = octetra::image::difference(&draw(&own), &draw(&others));
    assert!(worst < 1e-4, "{most}, {worst}");
}
