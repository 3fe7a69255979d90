//! The GPU draws what the CPU draws on real meshes too: every view that has a reference image, both step rules, both forms of the volume.

use octetra::cpu;
use octetra::format::read_mesh;
use octetra::gpu::shader::NodeStorage;
use octetra::gpu::{Context, Marcher, OctreeVolume};
use octetra::image::{difference, psnr, read_npy};
use octetra::mesh::{FieldSelection, ScalarField};
use octetra::octree::{OctreeParams, OctreeTexture, regularize};
use octetra::optics::Classifier;
use octetra::progress::Progress;
use octetra::view::{Camera, RenderSettings, Steps, TransferFunction};
use std::path::PathBuf;

/// A mesh of `data/tet`, and its reference images as (view, size).
fn check(mesh_file: &str, reference: &str, views: &[(u32, u32)]) {
    let shared = PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data"));
    let progress = Progress::new();
    let mesh = read_mesh(&shared.join("data/tet").join(mesh_file), &progress).expect("reads");
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("has an array");
    let params = OctreeParams::default();
    let tree = regularize(&mesh, &field, &params, &progress).expect("regularizes");
    let surface = params.surface(&mesh, &field);
    let texture = std::sync::Arc::new(OctreeTexture::encode(&tree).expect("fits"));
    let classifier = Classifier::new(&TransferFunction::standard(), texture.value_range(), mesh.bounds().diagonal());
    let context = Context::new().expect("an adapter");
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let volumes = [NodeStorage::Buffer, NodeStorage::Texture]
        .map(|s| OctreeVolume::upload_as(&context, &texture, surface.as_deref(), s).expect("fits"));
    for &(view, size) in views {
        let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), view, 1.0);
        let frame = camera.frame(mesh.center(), size, size);
        let exact = read_npy(&shared.join(format!("reference/{reference}_v{view:02}_{size}.npy"))).expect("reads");
        for steps in [Steps::Leaf, Steps::Paper] {
            let settings = RenderSettings { steps, ..RenderSettings::new(size, size) };
            let on_cpu = cpu::march(&texture, surface.as_deref(), &frame, &classifier, &settings, &progress).expect("nobody cancels").image;
            let (_, decibels) = psnr(&exact, &on_cpu);
            assert!(decibels > 50.0, "{reference}, view {view}, {steps:?}: {decibels} dB against the exact image");
            for volume in &volumes {
                let on_gpu = marcher.render(&context, volume, &frame, &classifier, &settings).expect("renders").image;
                let (p999, worst) = difference(&on_cpu, &on_gpu);
                let what = format!("{reference}, view {view}, {size}, {steps:?}, {:?}", volume.storage());
                assert!(p999 <= 1.0 / 255.0 && worst <= 4.0 / 255.0, "{what}: 99.9 % within {p999}, worst {worst}");
            }
        }
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn blunt_fin() {
    check("blunt_fin.vtu", "blunt", &[(0, 256), (3, 256), (7, 256), (0, 512)]);
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn spx() {
    check("spx1_refined_zlib.vtu", "spx1", &[(4, 256)]);
    check("spx2_refined_zlib.vtu", "spx2", &[(0, 256)]);
}
