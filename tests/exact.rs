//! The exact renderer against the reference images and on the meshes they were made from.

use glam::DVec3;
use octetra::exact::ExactScene;
use octetra::format;
use octetra::image::{self, Image};
use octetra::mesh::{FieldSelection, ScalarField, TetMesh};
use octetra::progress::Progress;
use octetra::view::{Camera, RenderSettings, TransferFunction};
use std::path::PathBuf;

/// A file or folder of the shared test data.
fn shared(path: &str) -> PathBuf {
    PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data")).join(path)
}

fn load(file: &str, array: &str) -> (TetMesh, ScalarField) {
    let mesh = format::read_mesh(&shared("data/tet").join(file), &Progress::new()).expect(file);
    let selection = FieldSelection { name: Some(array.to_owned()), ..Default::default() };
    let field = ScalarField::select(&mesh, &selection).expect(array);
    (mesh, field)
}

fn scene(mesh: &TetMesh, field: &ScalarField) -> ExactScene {
    ExactScene::new(mesh, field, &Progress::new()).expect("not cancelled")
}

/// Renders view `k` of the standard orbit with the standard transfer function.
fn orbit(mesh: &TetMesh, scene: &ExactScene, k: u32, size: u32) -> Image {
    let frame = Camera::orbit(mesh.bounds().translated(mesh.center()), k, 1.0).frame(mesh.center(), size, size);
    scene
        .render(&frame, &TransferFunction::standard(), &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new())
        .expect("not cancelled")
}

/// Holds the views of one mesh against their references, named `{name}_v{k}_{size}.npy`.
fn assert_reference(name: &str, file: &str, array: &str, views: &[(u32, u32)]) {
    let (mesh, field) = load(file, array);
    let scene = scene(&mesh, &field);
    for &(k, size) in views {
        let path = shared("reference").join(format!("{name}_v{k:02}_{size}.npy"));
        let reference = image::read_npy(&path).expect("a reference image");
        let rendered = orbit(&mesh, &scene, k, size);
        let (_, worst) = image::difference(&reference, &rendered);
        let (_, covered) = image::psnr(&reference, &rendered);
        // The bar is 1e-4 and 75 dB; both sides are exact, so hold what is reached: f32 rounding.
        assert!(worst <= 1e-6, "{name} view {k}, {size}: raw images differ by {worst}");
        assert!(covered >= 90.0, "{name} view {k}, {size}: {covered} dB over covered pixels");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn blunt_fin_is_its_reference() {
    assert_reference("blunt", "blunt_fin.vtu", "density", &[(0, 256), (3, 256), (7, 256), (0, 512)]);
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn spx_is_its_reference() {
    assert_reference("spx1", "spx1_refined_zlib.vtu", "scalars", &[(4, 256)]);
    assert_reference("spx2", "spx2_refined_zlib.vtu", "scalars", &[(0, 256)]);
}

/// Blunt Fin has tets without volume and a seam of coincident points, and the axes run along its grid lines.
#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn blunt_fin_rays_along_grid_lines_have_the_length_of_rays_beside_them() {
    let (mesh, field) = load("blunt_fin.vtu", "density");
    assert_eq!(mesh.zero_volume_count(), 77);
    let scene = scene(&mesh, &field);
    let diagonal = mesh.bounds().diagonal();
    let length = |origin: DVec3, direction| scene.trace(origin, direction).iter().map(|s| s.t_out - s.t_in).sum::<f64>();
    for (k, axis) in (0..200).flat_map(|k| DVec3::AXES.map(|axis| (k, axis))) {
        let start = mesh.points()[(k * 7919 + 13) % mesh.points().len()] - axis * (2.0 * diagonal);
        let (a, b) = axis.any_orthonormal_pair();
        // On the side that ties are broken to, so that on the boundary too both are in or both are out.
        let beside = length(start + (a + b * 1e-3) * (1e-8 * diagonal), axis);
        assert!((length(start, axis) - beside).abs() < 1e-5 * diagonal, "through {} along {axis}", start + axis * (2.0 * diagonal));
    }
}
