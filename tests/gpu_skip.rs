//! However empty space is skipped, the picture is the same, on the GPU and on the CPU. Needs an adapter; Mesa's software one will do.

use glam::DVec3;
use octetra::cpu;
use octetra::gpu::shader::NodeStorage;
use octetra::gpu::{Context, Marcher, OctreeVolume};
use octetra::image::difference;
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Association, BoundarySurface, ScalarField, collect};
use octetra::octree::{Activity, OctreeParams, OctreeTexture, regularize, regularize_grid};
use octetra::optics::Classifier;
use octetra::progress::Progress;
use octetra::view::{Camera, Intervals, Projection, RenderSettings, Skip, Steps, TransferFunction};
use octetra::volume::generate::shell as hollow_shell;
use std::sync::Arc;

const SIZE: [u32; 2] = [50, 41];

const WAYS: [Skip; 7] = [Skip::None, Skip::Octree, Skip::Encoding, Skip::Parts(1), Skip::Half, Skip::Parts(2), Skip::Parts(8)];

/// What is drawn: an octree, and the surface that cuts its rays.
struct Data {
    texture: Arc<OctreeTexture>,
    surface: Option<Arc<BoundarySurface>>,
    diagonal: f64,
}

/// A ball of tets with a field that rises and falls, continuous and cut at its surface, or with one value a leaf.
fn ball(base: OctreeParams) -> Data {
    let mesh = collect(&*plan(Shape::Ball, Some(6000)).expect("a size that can be made")).expect("valid");
    let values = mesh.points().iter().map(|p| (6.0 * p.x).sin() + p.y * p.z).collect();
    let field = ScalarField::new("f".into(), Association::Points, values);
    let params = OctreeParams { max_depth: 6, ..base };
    let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes");
    let texture = Arc::new(OctreeTexture::encode(&tree).expect("fits"));
    Data { texture, surface: params.surface(&mesh, &field), diagonal: mesh.bounds().diagonal() }
}

/// A hollow shell of voxels.
fn shell() -> Data {
    let grid = hollow_shell(44).expect("a size that can be made");
    let tree = regularize_grid(&grid, &OctreeParams::default(), &Progress::new()).expect("regularizes");
    let surface = tree.grid_surface(&grid);
    let diagonal = octetra::geometry::Placed::bounds(&grid).diagonal();
    Data { texture: Arc::new(OctreeTexture::encode(&tree).expect("fits")), surface, diagonal }
}

/// From outside, along an axis, and from inside; in cube coordinates.
fn cameras(data: &Data) -> [Camera; 4] {
    let (low, edge) = (data.texture.root_min(), data.texture.root_edge());
    let camera = |eye: [f64; 3], target: [f64; 3], projection| Camera {
        eye: low + DVec3::from(eye) * edge,
        target: low + DVec3::from(target) * edge,
        up: DVec3::Z,
        projection,
    };
    let perspective = |fov_y_degrees| Projection::Perspective { fov_y_degrees };
    [
        camera([3.0, 2.2, 1.9], [0.5; 3], perspective(25.0)),
        camera([0.5, -4.0, 0.5], [0.5; 3], Projection::Parallel { view_height: 1.2 * edge }),
        camera([0.47, 0.52, 0.5], [0.9, 0.55, 0.6], perspective(100.0)),
        camera([-1e5, 3e4, 2e4], [0.5; 3], perspective(6e-4)),
    ]
}

fn classifier(data: &Data) -> Classifier {
    // A window in the middle of the range: most of the ball, and what is in and outside the shell, is not seen.
    let opacity = vec![[0.0, 0.0], [0.55, 0.0], [0.65, 0.4], [0.7, 0.4], [0.8, 0.0], [1.0, 0.0]];
    Classifier::new(&TransferFunction { opacity, ..TransferFunction::standard() }, data.texture.value_range(), data.diagonal)
}

#[test]
fn all_ways_to_skip_draw_the_same_picture() {
    let context = Context::new().expect("an adapter");
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let by_leaf = OctreeParams::default().by_thresholds();
    let constant = OctreeParams { reconstruction: octetra::octree::Reconstruction::Leaf, ..by_leaf };
    let data = [("ball", ball(OctreeParams::default())), ("leaves", ball(constant)), ("shell", shell())];
    for (name, data) in &data {
        let classifier = classifier(data);
        for storage in [NodeStorage::Buffer, NodeStorage::Texture] {
            // Compiling takes a software adapter longer than drawing: the texture's shaders are tried on one of the three.
            if storage == NodeStorage::Texture && *name != "ball" {
                continue;
            }
            let volume = OctreeVolume::upload_as(&context, &data.texture, data.surface.as_deref(), storage).expect("fits");
            let views = if storage == NodeStorage::Buffer { 4 } else { 1 };
            for (view, camera) in cameras(data).iter().enumerate().take(views) {
                let frame = camera.frame(DVec3::ZERO, SIZE[0], SIZE[1]);
                for (steps, voxels) in [(Steps::Leaf, false), (Steps::Fixed, false), (Steps::Fixed, true)] {
                    // One value a leaf has no voxels.
                    if voxels && *name == "leaves" {
                        continue;
                    }
                    let mut all = None;
                    let mut taken = Vec::new();
                    for skip in WAYS {
                        let from = [Intervals::Compute, Intervals::Raster];
                        for intervals in from.into_iter().take(if skip.parts().is_some() { 2 } else { 1 }) {
                            let what = format!("{name}, {storage:?}, view {view}, {steps:?}, voxels {voxels}, {skip}, {intervals:?}");
                            let settings = RenderSettings { steps, voxels, skip, intervals, ..RenderSettings::new(SIZE[0], SIZE[1]) };
                            let drawn = marcher.render(&context, &volume, &frame, &classifier, &settings).expect("renders");
                            let all = all.get_or_insert_with(|| drawn.image.clone());
                            let (_, worst) = difference(all, &drawn.image);
                            // Blocks of voxels are the octree's field, interpolated once more.
                            let tolerance = if skip == Skip::Encoding && !voxels { 1e-3 } else { 1e-5 };
                            assert!(worst <= tolerance, "{what}: off by {worst}");
                            if intervals == Intervals::Compute {
                                taken.push(drawn.samples);
                                // The CPU has no voxels.
                                if voxels || skip == Skip::Encoding {
                                    continue;
                                }
                                let surface = data.surface.as_deref();
                                let on_cpu = cpu::march(&data.texture, surface, &frame, &classifier, &settings, &Progress::new());
                                let off = on_cpu.expect("nobody cancels").samples.abs_diff(drawn.samples) as f64;
                                assert!(off <= 1e-3 * drawn.samples as f64, "{what}: {off} samples more or less than the CPU");
                            } else if let Some(&computed) = taken.last() {
                                // Boxes at whose rims a pixel's ray ends may be in one and not the other.
                                assert!(drawn.samples.abs_diff(computed) * 200 <= computed, "{what}: {} for {computed}", drawn.samples);
                            }
                        }
                    }
                    let seen = all.iter().flat_map(|image| &image.pixels).filter(|p| p[3] > 0.02).count();
                    assert!(seen > 100, "{name}, view {view}: something is seen");
                    let [none, octree, encoding, bounds, half, half_ray, k8] = taken[..] else { panic!("a number for each way") };
                    // Voxels are leapt over cell by coarse cell.
                    let order =
                        (voxels || octree <= k8.min(encoding) * 101 / 100) && k8 <= half_ray && half_ray <= bounds && half <= bounds;
                    let order = order && bounds <= none && encoding < none;
                    assert!(order && octree < none, "{name}, view {view}, {steps:?}: {taken:?}");
                }
            }
        }
    }
}

#[test]
fn device_and_host_find_the_same_leaves_active_whatever_was_seen_before() {
    let context = Context::new().expect("an adapter");
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let by_leaf = OctreeParams { reconstruction: octetra::octree::Reconstruction::Leaf, ..OctreeParams::default().by_thresholds() };
    for data in [ball(OctreeParams::default()), ball(by_leaf), shell()] {
        for storage in [NodeStorage::Buffer, NodeStorage::Texture] {
            let volume = OctreeVolume::upload_as(&context, &data.texture, None, storage).expect("fits");
            let bumps = vec![[0.0, 0.3], [0.1, 0.0], [0.3, 0.0], [0.31, 0.5], [0.31, 0.0], [0.6, 0.0], [0.7, 0.5], [0.9, 0.0]];
            for opacity in
                [vec![[0.0, 0.0], [1.0, 0.5]], vec![[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]], vec![[0.0, 0.0]], vec![[0.0, 1.0]], bumps]
            {
                let tf = TransferFunction { opacity, ..TransferFunction::standard() };
                let classifier = Classifier::new(&tf, data.texture.value_range(), data.diagonal);
                let on_device = marcher.active_masks(&context, &volume, &classifier).expect("reads back");
                let on_host = Activity::new(&data.texture, &classifier.table(data.texture.root_edge()).seen());
                assert!(on_device[..on_host.masks().len()] == *on_host.masks(), "{storage:?}, {:?}", tf.opacity);
            }
        }
    }
}

#[test]
fn a_change_of_what_is_seen_shows_at_once() {
    let context = Context::new().expect("an adapter");
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let data = shell();
    let volume = OctreeVolume::upload(&context, &data.texture, data.surface.as_deref()).expect("fits");
    let frame = cameras(&data)[0].frame(DVec3::ZERO, SIZE[0], SIZE[1]);
    let window = classifier(&data);
    let all = Classifier::new(&TransferFunction::standard(), data.texture.value_range(), data.diagonal);
    for skip in [Skip::Octree, Skip::Encoding, Skip::Half, Skip::Parts(3)] {
        for intervals in [Intervals::Compute, Intervals::Raster] {
            let settings = RenderSettings { steps: Steps::Fixed, skip, intervals, ..RenderSettings::new(SIZE[0], SIZE[1]) };
            for classifier in [&window, &all, &window] {
                let fresh = OctreeVolume::upload(&context, &data.texture, data.surface.as_deref()).expect("fits");
                let [old, new] = [&volume, &fresh].map(|v| marcher.render(&context, v, &frame, classifier, &settings).expect("renders"));
                assert!(old.image == new.image && old.samples == new.samples, "{skip}, {intervals:?}");
            }
        }
    }
}
