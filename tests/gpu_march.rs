//! The GPU draws what the CPU draws. Needs an adapter; Mesa's software one will do.

use glam::DVec3;
use octetra::cpu;
use octetra::gpu::shader::NodeStorage;
use octetra::gpu::{Context, GpuError, Marcher, OctreeVolume, Target};
use octetra::image::difference;
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Association, ScalarField, collect};
use octetra::octree::{CellKind, Octree, OctreeParams, OctreeTexture, regularize};
use octetra::optics::Classifier;
use octetra::progress::Progress;
use octetra::view::{Camera, OpacityModel, Projection, RayFrame, RenderSettings, Steps, TransferFunction};
use std::sync::Arc;

fn context() -> Context {
    Context::new().expect("an adapter; on Debian: apt install mesa-vulkan-drivers")
}

/// Cells split, emptied and filled at random (xorshift64*) with a smooth field and noise, root cube of edge 3 away from the origin.
fn random_tree(seed: u64, depth: u8) -> Arc<OctreeTexture> {
    let mut state = seed;
    let mut random = move || {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    };
    let kind = |at: glam::UVec3, d: u8| match random() {
        p if p < 0.6 && d < depth => CellKind::Split,
        p if p < 0.7 => CellKind::Empty,
        _ => CellKind::Leaf((at.as_vec3().length() / (1u32 << d) as f32 / 1.8 + 0.05 * random() as f32).min(1.0)),
    };
    Arc::new(OctreeTexture::encode(&Octree::from_fn(DVec3::new(-1.0, -2.0, 0.5), 3.0, [-1.0, 4.0], kind)).expect("fits"))
}

fn cameras() -> [Camera; 5] {
    let target = DVec3::new(0.5, -0.5, 2.0);
    let camera = |eye: [f64; 3], projection| Camera { eye: DVec3::from(eye), target, up: DVec3::Z, projection };
    let perspective = |fov_y_degrees| Projection::Perspective { fov_y_degrees };
    [
        camera([9.0, 5.0, 6.0], perspective(25.0)),
        camera([-6e5, 2e5, 3e5], perspective(4e-4)),
        camera([0.6, -0.4, 2.3], perspective(110.0)),
        camera([0.5, -12.0, 2.0], Projection::Parallel { view_height: 3.5 }),
        camera([-4.0, -7.0, 8.0], Projection::Parallel { view_height: 4.0 }),
    ]
}

fn classifiers() -> [Classifier; 2] {
    let exponential =
        TransferFunction { opacity_model: OpacityModel::Exponential, range: Some([0.0, 3.0]), ..TransferFunction::standard() };
    [TransferFunction::standard(), exponential].map(|tf| Classifier::new(&tf, [-1.0, 4.0], 5.0))
}

fn frame(camera: &Camera, size: [u32; 2]) -> RayFrame {
    camera.frame(DVec3::ZERO, size[0], size[1])
}

#[test]
fn gpu_and_cpu_draw_the_same() {
    let context = context();
    let marcher = Marcher::new(&context).expect("the shaders compile");
    for (seed, storage) in [(1, NodeStorage::Buffer), (2, NodeStorage::Texture)] {
        let texture = random_tree(seed, 6);
        let volume = OctreeVolume::upload_as(&context, &texture, None, storage).expect("fits");
        for (view, camera) in cameras().iter().enumerate() {
            for steps in [Steps::Leaf, Steps::Paper, Steps::Fixed] {
                let frame = frame(camera, [75, 61]);
                let classifier = &classifiers()[view % 2];
                let settings = RenderSettings { steps, ..RenderSettings::new(75, 61) };
                let on_cpu = cpu::march(&texture, None, &frame, classifier, &settings, &Progress::new()).expect("nobody cancels");
                let on_gpu = marcher.render(&context, &volume, &frame, classifier, &settings).expect("renders");
                let (p999, worst) = difference(&on_cpu.image, &on_gpu.image);
                let what = format!("{storage:?}, view {view}, {steps:?}");
                // Positions agree to the last bit, so only exp and quotients of shading may differ: far below a level of 255.
                assert!(p999 <= 1e-5 && worst <= 4.0 / 255.0, "{what}: 99.9 % within {p999}, worst {worst}");
                let off = on_cpu.samples.abs_diff(on_gpu.samples) as f64 / on_cpu.samples as f64;
                assert!(off < 1e-3, "{what}: {} samples on the CPU, {} on the GPU", on_cpu.samples, on_gpu.samples);
                assert!(on_cpu.image.pixels.iter().filter(|p| p[3] > 0.1).count() > 500, "{what}: something is seen");
            }
        }
    }
}

#[test]
fn gpu_and_cpu_draw_the_same_continuous_field_inside_the_same_surface() {
    let context = context();
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let mesh = collect(&*plan(Shape::Ball, Some(6000)).expect("a size that can be made")).expect("valid");
    let values = mesh.points().iter().map(|p| (4.0 * p.x).sin() + p.y * p.z).collect();
    let field = ScalarField::new("f".into(), Association::Points, values);
    let params = OctreeParams { max_depth: 7, ..OctreeParams::default() };
    let texture =
        Arc::new(OctreeTexture::encode(&regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes")).expect("fits"));
    let surface = params.surface(&mesh, &field);
    let classifier = Classifier::new(&TransferFunction::standard(), texture.value_range(), mesh.bounds().diagonal());
    let inside = Camera {
        eye: DVec3::new(0.1, 0.2, -0.1),
        target: DVec3::X,
        up: DVec3::Z,
        projection: Projection::Perspective { fov_y_degrees: 100.0 },
    };
    for storage in [NodeStorage::Buffer, NodeStorage::Texture] {
        for surface in [None, surface.as_deref()] {
            let volume = OctreeVolume::upload_as(&context, &texture, surface, storage).expect("fits");
            for camera in [Camera::orbit(mesh.bounds(), 4, 1.3), inside] {
                for steps in [Steps::Leaf, Steps::Paper, Steps::Fixed] {
                    let frame = frame(&camera, [75, 61]);
                    let settings = RenderSettings { steps, ..RenderSettings::new(75, 61) };
                    let on_cpu = cpu::march(&texture, surface, &frame, &classifier, &settings, &Progress::new()).expect("nobody cancels");
                    let on_gpu = marcher.render(&context, &volume, &frame, &classifier, &settings).expect("renders");
                    let (p999, worst) = difference(&on_cpu.image, &on_gpu.image);
                    let what = format!("{storage:?}, surface {}, {steps:?}", surface.is_some());
                    assert!(p999 <= 1e-4 && worst <= 1.0 / 255.0, "{what}: 99.9 % within {p999}, worst {worst}");
                    assert!(on_cpu.image.pixels.iter().filter(|p| p[3] > 0.1).count() > 500, "{what}: something is seen");
                }
            }
        }
    }
}

#[test]
fn an_octree_without_leaves_is_transparent() {
    let context = context();
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let texture = OctreeTexture::encode(&Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], |_, _| CellKind::Empty)).expect("fits");
    let texture = Arc::new(texture);
    let volume = OctreeVolume::upload(&context, &texture, None).expect("fits");
    for steps in [Steps::Leaf, Steps::Paper, Steps::Fixed] {
        let settings = RenderSettings { steps, ..RenderSettings::new(9, 9) };
        let image = marcher.render(&context, &volume, &frame(&cameras()[0], [9, 9]), &classifiers()[0], &settings).expect("renders");
        assert!(image.samples == 0 && image.image.pixels.iter().all(|p| *p == [0.0; 4]));
    }
}

#[test]
fn what_the_adapter_cannot_take_is_an_error_that_names_the_limit() {
    let context = context();
    let error = Target::new(&context, 1 << 20, 1).expect_err("no adapter has textures that wide");
    assert!(matches!(error, GpuError::TooLarge { need: 1_048_576, limit_name: "max_texture_dimension_2d", .. }), "{error}");
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let volume = OctreeVolume::upload(&context, &random_tree(3, 2), None).expect("fits");
    let target = Target::new(&context, 8, 8).expect("fits");
    let mut encoder = context.device.create_command_encoder(&Default::default());
    let frame = frame(&cameras()[0], [8, 9]);
    let error = marcher.encode(&context, &mut encoder, &volume, &frame, &classifiers()[0], &RenderSettings::new(8, 9), &target);
    assert_eq!(error, Err(GpuError::TargetSize { image: [8, 9], target: [8, 8] }));
}

#[test]
fn a_target_is_made_anew_only_for_another_size() {
    let context = context();
    let mut target = Target::new(&context, 8, 8).expect("fits");
    assert_eq!(target.resize(&context, 8, 8), Ok(false));
    assert_eq!(target.resize(&context, 300, 200), Ok(true));
    assert_eq!(target.size(), [300, 200]);
}

#[test]
fn every_frame_is_timed() {
    let context = context();
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let volume = OctreeVolume::upload(&context, &random_tree(3, 4), None).expect("fits");
    let frames = cameras().map(|camera| frame(&camera, [32, 32]));
    let times = marcher.time(&context, &volume, &frames, &classifiers()[0], &RenderSettings::new(32, 32), 0.01, 3).expect("renders");
    assert_eq!(times.wall_s.len(), 15);
    assert!(times.wall_s.iter().all(|s| *s > 0.0));
    assert_eq!(times.gpu_s.is_some(), context.timestamps);
}

#[test]
fn a_frame_that_nobody_waits_for_gets_done_and_says_what_it_took() {
    let mut context = context();
    // Worthless on a software adapter, but there to be read.
    context.timestamps = context.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let volume = OctreeVolume::upload(&context, &random_tree(3, 5), None).expect("fits");
    let (frame, classifier, settings) = (frame(&cameras()[0], [40, 30]), &classifiers()[0], RenderSettings::new(40, 30));
    let target = Target::new(&context, 40, 30).expect("fits");
    let started = marcher.start(&context, &volume, &frame, classifier, &settings, &target).expect("starts");
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    let time = loop {
        if let Some(time) = started.poll(&context).expect("the device works") {
            break time;
        }
        assert!(std::time::Instant::now() < deadline, "the frame never gets done");
    };
    assert!(time.wall_s > 0.0);
    assert_eq!(time.gpu_s.is_some(), context.timestamps);
}

#[test]
fn rows_are_marched_as_in_the_whole_image() {
    let context = context();
    let marcher = Marcher::new(&context).expect("the shaders compile");
    let volume = OctreeVolume::upload(&context, &random_tree(3, 6), None).expect("fits");
    for camera in cameras() {
        let (whole, settings) = (frame(&camera, [60, 40]), RenderSettings::new(60, 40));
        let march = |frame: &RayFrame| marcher.render(&context, &volume, frame, &classifiers()[0], &settings).expect("renders").image;
        let mut expected = march(&whole);
        expected.pixels = expected.pixels[60 * 17..60 * 25].to_vec();
        expected.height = 8;
        let (p999, worst) = difference(&expected, &march(&whole.rows(17, 8)));
        assert!(p999 <= 1.0 / 255.0 && worst <= 4.0 / 255.0, "99.9 % within {p999}, worst {worst}");
    }
}
