//! Thresholds hide the light of values outside a range: in closed form, for every renderer.

mod meshes;

use glam::DVec3;
use octetra::Renderer;
use octetra::mesh::{Association, MeshParts, ScalarField, TetMesh};
use octetra::octree::{OctreeParams, OctreeTexture, Reconstruction, regularize, regularize_grid};
use octetra::progress::Progress;
use octetra::render::{DeviceChoice, Scene};
use octetra::view::{Camera, Isosurface, Isosurfaces, Mode, Projection, RenderSettings, Shading, Skip, Steps, TransferFunction, View};
use octetra::volume::{Grid, GridFrame, Samples};

/// The cube [-1, 1]^3 in tets.
fn cube(n: u32) -> TetMesh {
    let mut parts = MeshParts::default();
    meshes::add_grid(&mut parts, n, DVec3::NEG_ONE, 2.0, |_| true);
    meshes::mesh(parts)
}

/// The field: from 1 to 5 along y.
fn value(p: DVec3) -> f64 {
    3.0 + 2.0 * p.y
}

/// The field in the octree of the mesh, in the mesh itself, and in the octree of a volume.
fn scenes(renderer: &Renderer) -> [(&'static str, Scene); 3] {
    let mesh = cube(4);
    let field = meshes::point_field(&mesh, value);
    let params = OctreeParams { max_depth: 5, ..OctreeParams::default() };
    let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes");
    let texture = OctreeTexture::encode(&tree).expect("fits");
    let octree = renderer.octree_scene(&mesh, texture, params.surface(&mesh, &field)).expect("fits").0;
    let exact = renderer.exact_scene(&mesh, &field, &Progress::new()).expect("fits");

    let n = 17u32;
    let at = |i: u32| DVec3::new((i % n).into(), (i / n % n).into(), (i / n / n).into()) * (2.0 / f64::from(n - 1)) - 1.0;
    let frame = GridFrame::along_axes([n; 3], DVec3::NEG_ONE, DVec3::splat(2.0 / f64::from(n - 1)));
    let grid = Grid::new(frame, "s".into(), Samples::F32((0..n * n * n).map(|i| value(at(i)) as f32).collect())).expect("valid");
    let tree = regularize_grid(&grid, &params, &Progress::new()).expect("regularizes");
    let surface = tree.grid_surface(&grid);
    let volume = renderer.octree_scene(&grid, OctreeTexture::encode(&tree).expect("fits"), surface).expect("fits").0;
    [("octree", octree), ("exact", exact), ("volume", volume)]
}

/// The alpha of rays along y, or along -y.
fn alphas(renderer: &Renderer, scene: &Scene, tf: &TransferFunction, settings: RenderSettings, from_behind: bool) -> Vec<f64> {
    let eye = DVec3::Y * if from_behind { 5.0 } else { -5.0 };
    let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Z, projection: Projection::Parallel { view_height: 1.9 } };
    let view = View { camera, transfer_function: tf.clone(), settings: settings.stopping_at(0.0) };
    tf.validate().expect("valid");
    renderer.render(scene, &view, &Progress::new()).expect("draws").image.pixels.iter().map(|pixel| f64::from(pixel[3])).collect()
}

/// Opacity from 0 to 1 over the field, per unit of length.
fn ramp(threshold: Option<[f64; 2]>) -> TransferFunction {
    let opacity = vec![[0.0, 0.0], [1.0, 1.0]];
    TransferFunction { opacity, unit_distance: Some(1.0), threshold, ..TransferFunction::standard() }
}

/// What of the cube has values in a threshold, through the ramp.
fn expected([from, to]: [f64; 2]) -> f64 {
    let [a, b] = [from, to].map(|value| ((value - 1.0) / 2.0).clamp(0.0, 2.0));
    // The integral of (y + 1) / 2.
    1.0 - (-(b * b - a * a).max(0.0) / 4.0).exp()
}

const THRESHOLDS: [[f64; 2]; 6] = [[2.0, 3.5], [2.7, 9.0], [-9.0, 2.3], [-9.0, 9.0], [6.0, 9.0], [3.0, 3.0]];

fn check(choice: DeviceChoice, settings: &[RenderSettings]) {
    let renderer = Renderer::new(choice).expect("an adapter; on Debian: apt install mesa-vulkan-drivers");
    for (name, scene) in scenes(&renderer) {
        for settings in settings {
            for threshold in THRESHOLDS {
                for from_behind in [false, true] {
                    let expected = expected(threshold);
                    for alpha in alphas(&renderer, &scene, &ramp(Some(threshold)), *settings, from_behind) {
                        let what = format!("{name}, {:?}, {}: {threshold:?}", settings.steps, settings.skip);
                        assert!((alpha - expected).abs() < 1e-3, "{what}: {alpha}, expected {expected}");
                    }
                }
            }
        }
    }
}

#[test]
fn light_is_where_values_are_inside() {
    let settings = |steps, skip| RenderSettings { steps, skip, ..RenderSettings::new(6, 6) };
    let all =
        [Steps::Leaf, Steps::Paper, Steps::Fixed].map(|steps| [Skip::Octree, Skip::None, Skip::Half].map(|skip| settings(steps, skip)));
    check(DeviceChoice::Cpu, all.as_flattened());
}

#[test]
fn the_gpu_hides_the_same() {
    check(DeviceChoice::Gpu, &[RenderSettings::new(6, 6)]);
}

#[test]
fn a_threshold_goes_with_any_function_and_leaves_surfaces_and_numbers() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    for (name, scene) in scenes(&renderer) {
        // A range of its own with steps of opacity, beyond which it goes on: 0.25 below 3, 1 above.
        let stepped = TransferFunction {
            opacity: vec![[0.0, 0.25], [0.5, 0.25], [0.5, 1.0], [1.0, 1.0]],
            range: Some([2.0, 4.0]),
            steps: Some(3),
            ..ramp(Some([1.5, 3.5]))
        };
        let expected = 1.0 - (-0.25f64 * 0.75 - 0.25).exp();
        for alpha in alphas(&renderer, &scene, &stepped, RenderSettings::new(4, 4), false) {
            assert!((alpha - expected).abs() < 1e-3, "{name}: {alpha}, expected {expected}");
        }
        // Surfaces and numbers are of hidden values too.
        let isosurfaces = Isosurfaces::new(&[Isosurface { opacity: 0.5, ..Isosurface::at(4.5) }]).expect("valid");
        let shading = Shading { surfaces: false, ..Shading::default() };
        let hidden = ramp(Some([1.5, 1.6]));
        for mode in [Mode::Iso, Mode::Maximum, Mode::Integral] {
            let settings = RenderSettings { mode, isosurfaces, shading, ..RenderSettings::new(4, 4) };
            let [with, without] = [&hidden, &ramp(None)].map(|tf| alphas(&renderer, &scene, tf, settings, false));
            assert!(with == without && with[0] >= 0.5, "{name}, {mode}: {with:?}");
        }
    }
}

#[test]
fn the_ends_of_a_threshold_are_shown() {
    // Cells of the values 0 to 3, a quarter of the cube each.
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let mesh = cube(4);
    let label = |tet: usize| (mesh.corners(tet).iter().map(|p| p.y).sum::<f64>() / 2.0 + 2.0).floor();
    let field = ScalarField::new("label".into(), Association::Cells, (0..mesh.tets().len()).map(label).collect());
    let params = OctreeParams { max_depth: 6, reconstruction: Reconstruction::Leaf, ..OctreeParams::default() };
    let texture = OctreeTexture::encode(&regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes")).expect("fits");
    let octree = renderer.octree_scene(&mesh, texture, params.surface(&mesh, &field)).expect("fits").0;
    let exact = renderer.exact_scene(&mesh, &field, &Progress::new()).expect("fits");
    let one = |threshold| TransferFunction { opacity: vec![[0.0, 1.0]], ..ramp(Some(threshold)) };
    for (name, scene, tolerance) in [("exact", exact, 1e-6), ("octree", octree, 0.05)] {
        for (threshold, slabs) in [([1.0, 2.0], 2.0), ([0.0, 0.0], 1.0), ([3.0, 3.0], 1.0), ([0.5, 0.9], 0.0), ([1.0, 1.0], 1.0)] {
            let expected = 1.0 - (-0.5f64 * slabs).exp();
            for alpha in alphas(&renderer, &scene, &one(threshold), RenderSettings::new(5, 5), false) {
                assert!((alpha - expected).abs() < tolerance, "{name} {threshold:?}: {alpha}, expected {expected}");
            }
        }
    }
}
