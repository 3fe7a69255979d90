//! The octree's picture against the exact one: what the default promises, where the mesh ends, and how large the octree is for it.

use octetra::cpu;
use octetra::exact::ExactScene;
use octetra::format::read_mesh;
use octetra::image::{Image, psnr};
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Association, FieldSelection, MeshParts, ScalarField, TetMesh, collect};
use octetra::octree::{Boundary, OctreeParams, OctreeTexture, Preset, regularize};
use octetra::optics::Classifier;
use octetra::progress::Progress;
use octetra::view::{Camera, RenderSettings, Steps, TransferFunction};
use std::path::PathBuf;

/// A regularized mesh and the mesh itself, ready to be drawn on the CPU.
struct Pair {
    mesh: TetMesh,
    texture: OctreeTexture,
    surface: Option<std::sync::Arc<octetra::mesh::BoundarySurface>>,
    exact: ExactScene,
}

impl Pair {
    fn new(mesh: TetMesh, field: &ScalarField, params: &OctreeParams) -> Self {
        let tree = regularize(&mesh, field, params, &Progress::new()).expect("regularizes");
        let texture = OctreeTexture::encode(&tree).expect("fits");
        let exact = ExactScene::new(&mesh, field, &Progress::new()).expect("nobody cancels");
        Pair { texture, surface: params.surface(&mesh, field), exact, mesh }
    }

    /// (octree, exact) from a view of the orbit.
    fn pictures(&self, k: u32, size: u32, tf: &TransferFunction, steps: Steps) -> (Image, Image) {
        let frame = Camera::orbit(self.mesh.bounds().translated(self.mesh.center()), k, 1.0).frame(self.mesh.center(), size, size);
        let classifier = Classifier::new(tf, self.texture.value_range(), self.mesh.bounds().diagonal());
        let settings = RenderSettings { steps, ..RenderSettings::new(size, size) };
        let octree = cpu::march(&self.texture, self.surface.as_deref(), &frame, &classifier, &settings, &Progress::new());
        let exact = self.exact.render(&frame, tf, &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new()).expect("nobody cancels");
        (octree.expect("nobody cancels").image, exact)
    }
}

fn shared(file: &str) -> PathBuf {
    PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data")).join(file)
}

fn shared_pair(file: &str, params: &OctreeParams) -> Pair {
    let mesh = read_mesh(&shared("data/tet").join(file), &Progress::new()).expect("reads");
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("has an array");
    Pair::new(mesh, &field, params)
}

/// Everything is dense fog of one colour: what is seen is where the mesh is.
fn fog() -> TransferFunction {
    TransferFunction { color: vec![[0.0, 1.0, 1.0, 1.0]], opacity: vec![[0.0, 0.5]], ..TransferFunction::standard() }
}

/// Pixels that one picture covers and the other does not, as a share of those that the exact one covers; a pixel is covered where something
/// is seen at all.
fn coverage_difference((octree, exact): &(Image, Image)) -> f64 {
    let covered = |image: &Image, i: usize| image.pixels[i][3] > 1.0 / 512.0;
    let all = (0..exact.pixels.len()).filter(|&i| covered(exact, i)).count();
    let different = (0..exact.pixels.len()).filter(|&i| covered(exact, i) != covered(octree, i)).count();
    different as f64 / all as f64
}

fn ball() -> TetMesh {
    collect(&*plan(Shape::Ball, Some(12_000)).expect("a size that can be made")).expect("valid")
}

#[test]
fn a_curved_field_is_drawn_as_the_mesh_is() {
    let mesh = ball();
    let field =
        ScalarField::new("f".into(), Association::Points, mesh.points().iter().map(|p| (5.0 * p.x).sin() * p.y + p.z * p.z).collect());
    let pair = Pair::new(mesh, &field, &OctreeParams::default());
    for (steps, least) in [(Steps::Leaf, 55.0), (Steps::Paper, 50.0)] {
        let (octree, exact) = pair.pictures(2, 96, &TransferFunction::standard(), steps);
        let (_, covered) = psnr(&exact, &octree);
        assert!(covered > least, "{steps:?}: {covered} dB");
    }
}

#[test]
fn the_mesh_ends_where_its_surface_does() {
    // Two balls with a gap thinner than a leaf, the field linear: nothing is left to differ but the surface.
    let one = ball();
    let mut parts = MeshParts::default();
    for shift in [-1.01, 1.01] {
        let first = parts.points.len() as u32;
        let radius = one.bounds().max.x;
        parts.points.extend(one.points().iter().map(|p| p / radius + glam::DVec3::X * shift));
        parts.tets.extend(one.tets().iter().map(|tet| tet.map(|i| i + first)));
    }
    let mesh = TetMesh::new(parts).expect("valid");
    let field = ScalarField::new("f".into(), Association::Points, mesh.points().iter().map(|p| p.x + p.y + p.z).collect());
    let params = OctreeParams { max_depth: 5, ..OctreeParams::default() };
    let pair = Pair::new(mesh, &field, &params);
    for k in 0..3 {
        let pictures = pair.pictures(k, 128, &fog(), Steps::Leaf);
        let worst = octetra::image::difference(&pictures.0, &pictures.1).1;
        assert!(worst < 1e-3, "view {k}: fog differs by {worst}");
        assert_eq!(coverage_difference(&pictures), 0.0, "view {k}");
    }
    let by_centres = OctreeParams { boundary: Boundary::Centres, ..params };
    let frayed = Pair::new(pair.mesh.clone(), &field, &by_centres).pictures(0, 128, &fog(), Steps::Leaf);
    assert!(coverage_difference(&frayed) > 0.005, "without the surface the edge frays");
}

/// The bars of the default and the presets on the paper's meshes: (preset, covered PSNR in dB at least, MiB of the octree at most).
fn assert_presets(file: &str, size: u32, bars: &[(Preset, f64, f64)]) {
    for &(preset, least, most) in bars {
        let pair = shared_pair(file, &preset.params());
        let mebibytes = pair.texture.bytes() as f64 / f64::from(1 << 20);
        let (octree, exact) = pair.pictures(0, size, &TransferFunction::standard(), Steps::Leaf);
        let (_, covered) = psnr(&exact, &octree);
        assert!(covered >= least && mebibytes <= most, "{file}, {preset:?}: {covered} dB in {mebibytes} MiB");
        let surface = pair.surface.as_ref().expect("presets are cut at the surface");
        assert!(surface.bytes() <= 48 * surface.faces().len(), "{} bytes for {} faces", surface.bytes(), surface.faces().len());
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn presets_keep_their_promises() {
    assert_presets("blunt_fin.vtu", 512, &[(Preset::Fast, 51.5, 0.9), (Preset::Balanced, 55.5, 3.0), (Preset::Fine, 60.0, 18.0)]);
    assert_presets("spx2_refined_zlib.vtu", 256, &[(Preset::Balanced, 54.2, 4.5)]);
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn every_view_of_the_blunt_fin_is_good_and_covers_what_the_mesh_does() {
    let pair = shared_pair("blunt_fin.vtu", &OctreeParams::default());
    for k in 0..12 {
        let (octree, exact) = pair.pictures(k, 200, &TransferFunction::standard(), Steps::Leaf);
        let (_, covered) = psnr(&exact, &octree);
        assert!(covered >= 54.0, "view {k}: {covered} dB");
        let difference = coverage_difference(&pair.pictures(k, 200, &fog(), Steps::Leaf));
        assert!(difference <= 0.0005, "view {k}: coverage differs in {difference}");
    }
}

/// An old ascii file of tets with one scalar a point: keywords, then numbers.
fn legacy(file: &str) -> (TetMesh, ScalarField) {
    let text = std::fs::read_to_string(shared("data/tet").join(file)).expect("reads");
    let after = |keyword: &str| {
        let start = text.find(&format!("\n{keyword} ")).unwrap_or_else(|| panic!("{file} has {keyword}"));
        let lines = text[start + 1..].lines().skip(1);
        lines.flat_map(str::split_whitespace).map_while(|word| word.parse::<f64>().ok()).collect::<Vec<f64>>()
    };
    let points = after("POINTS").chunks_exact(3).map(glam::DVec3::from_slice).collect();
    let tets = after("CELLS").chunks_exact(5).map(|cell| [1, 2, 3, 4].map(|i| cell[i] as u32)).collect();
    let values = after("LOOKUP_TABLE");
    let mesh = TetMesh::new(MeshParts { points, tets, ..Default::default() }).expect("valid");
    (mesh, ScalarField::new("scalars".into(), Association::Points, values))
}

/// Meshes with inverted tets, tets without volume, and concave parts.
#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn damaged_and_concave_meshes_look_alike() {
    for (file, inverted, zero_volume) in [("torus.vtk", 4000, 30), ("tetraMesh.vtk", 80, 0), ("spx.vtk", 0, 0)] {
        let (mesh, field) = legacy(file);
        assert!(mesh.inverted_count() >= inverted && mesh.zero_volume_count() >= zero_volume, "{file} is damaged as it should be");
        let pair = Pair::new(mesh, &field, &OctreeParams::default());
        for k in [1, 5] {
            let (octree, exact) = pair.pictures(k, 160, &TransferFunction::preset("viridis").expect("a preset"), Steps::Leaf);
            let (_, covered) = psnr(&exact, &octree);
            let difference = coverage_difference(&pair.pictures(k, 160, &fog(), Steps::Leaf));
            assert!(covered > 45.0 && difference <= 0.001, "{file}, view {k}: {covered} dB, coverage differs in {difference}");
        }
    }
}
