//! The exact renderer on the GPU, f32, draws what the one in f64 draws. Needs an adapter; Mesa's software one will do.

mod meshes;

use glam::DVec3;
use meshes::{Random, add_grid, mesh, point_field, sponge};
use octetra::format::read_mesh;
use octetra::image::{Image, difference, psnr, read_npy};
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Association, FieldSelection, MeshParts, ScalarField, TetMesh, collect};
use octetra::progress::Progress;
use octetra::render::{DeviceChoice, Renderer};
use octetra::view::{Camera, OpacityModel, Projection, RenderSettings, RendererKind, TransferFunction, View};
use std::path::PathBuf;
use std::sync::OnceLock;

fn renderer(choice: DeviceChoice) -> &'static Renderer {
    static RENDERERS: OnceLock<[Renderer; 2]> = OnceLock::new();
    let [gpu, cpu] = RENDERERS.get_or_init(|| {
        [DeviceChoice::Gpu, DeviceChoice::Cpu]
            .map(|choice| Renderer::new(choice).expect("an adapter; on Debian: apt install mesa-vulkan-drivers"))
    });
    if choice == DeviceChoice::Gpu { gpu } else { cpu }
}

fn draw(choice: DeviceChoice, mesh: &TetMesh, field: &ScalarField, view: &View) -> Image {
    let (renderer, progress) = (renderer(choice), Progress::new());
    let scene = renderer.exact_scene(mesh, field, &progress).expect("fits");
    assert_eq!(scene.is_on_device(), choice == DeviceChoice::Gpu);
    renderer.render(&scene, view, &progress).expect("renders").image
}

fn view(camera: Camera, transfer_function: TransferFunction, width: u32, height: u32) -> View {
    let settings = RenderSettings { renderer: RendererKind::Exact, ..RenderSettings::new(width, height) };
    View { camera, transfer_function, settings }
}

/// From outside, from inside, from very far, along an axis in parallel.
fn cameras(mesh: &TetMesh) -> [Camera; 4] {
    let bounds = mesh.bounds().translated(mesh.center());
    let (middle, diagonal) = (bounds.center(), bounds.diagonal());
    let outside = Camera::orbit(bounds, 1, 1.1);
    let projection = Projection::Perspective { fov_y_degrees: 100.0 };
    let inside = Camera { eye: middle, target: middle + DVec3::new(0.3, 1.0, 0.1), projection, ..outside };
    let projection = Projection::Perspective { fov_y_degrees: 1e-4 };
    let direction = DVec3::new(0.5, -0.7, 0.4).normalize();
    let far = Camera { eye: middle + direction * (diagonal / 1e-4_f64.to_radians()), target: middle, projection, ..outside };
    let projection = Projection::Parallel { view_height: 1.05 * bounds.size().max_element() };
    let axis = Camera { eye: middle - DVec3::Y * (2.0 * diagonal), target: middle, up: DVec3::Z, projection };
    [outside, inside, far, axis]
}

/// Both draw the same from everywhere, and see something. `stray` pixels may lie anywhere: where a ray runs along a face, f32 and f64 may
/// fall on either side of it.
fn assert_same(what: &str, mesh: &TetMesh, field: &ScalarField, stray: usize) {
    let steps = TransferFunction {
        opacity: vec![[0.0, 0.0], [0.3, 0.0], [0.3, 0.5], [0.5, 0.5], [0.5, 0.1], [1.0, 0.9]],
        opacity_model: OpacityModel::Exponential,
        ..TransferFunction::standard()
    };
    for (i, camera) in cameras(mesh).into_iter().enumerate() {
        for (tf, name) in [(TransferFunction::standard(), "standard"), (steps.clone(), "steps")] {
            let view = view(camera, tf, 72, 56);
            let [gpu, cpu] = [DeviceChoice::Gpu, DeviceChoice::Cpu].map(|choice| draw(choice, mesh, field, &view));
            let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
            let mut all: Vec<f32> = gpu.pixels.iter().zip(&cpu.pixels).map(off).collect();
            all.sort_by(f32::total_cmp);
            let (worst, usual) = (all[all.len() - 1 - stray], all[all.len() * 9 / 10]);
            assert!(worst <= 2.0 / 255.0 && usual <= 2e-4, "{what}, camera {i}, {name}: worst {worst}, 90 % within {usual}");
            let seen = cpu.pixels.iter().filter(|p| p[3] > 0.05).count();
            assert!(seen > 100, "{what}, camera {i}, {name}: {seen} pixels show anything");
        }
    }
}

fn jittered(n: u32, seed: u64) -> MeshParts {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, n, DVec3::ZERO, 1.0, |_| true);
    Random(seed).jitter(&mut parts, 0.2 / f64::from(n));
    parts
}

fn waves(p: DVec3) -> f64 {
    (5.0 * p.x + 2.0 * p.y).sin() + p.z * (3.0 * p.y).cos()
}

#[test]
fn a_slab_has_one_minus_exp_of_its_depth() {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, 3, DVec3::ZERO, 1.0, |_| true);
    let slab = mesh(parts);
    let tf = TransferFunction {
        color: vec![[0.0, 0.4, 0.4, 0.4]],
        opacity: vec![[0.0, 0.7]],
        unit_distance: Some(0.25),
        ..TransferFunction::standard()
    };
    let camera = Camera {
        eye: DVec3::new(0.5, -4.0, 0.5),
        target: DVec3::splat(0.5),
        up: DVec3::Z,
        projection: Projection::Parallel { view_height: 0.98 },
    };
    let image = draw(DeviceChoice::Gpu, &slab, &point_field(&slab, |p| p.x), &view(camera, tf, 33, 33));
    let alpha = 1.0 - (-0.7f32 / 0.25).exp();
    for p in &image.pixels {
        assert!((p[3] - alpha).abs() < 1e-5 && (p[0] - 0.4 * alpha).abs() < 1e-5, "{p:?}, expected alpha {alpha}");
    }
}

#[test]
fn meshes_with_all_their_tets_are_drawn_as_in_f64() {
    let ball = collect(&*plan(Shape::Ball, Some(3000)).expect("a size")).expect("valid");
    assert_same("ball", &ball, &point_field(&ball, |p| p.length()), 0);
    let grid = mesh(jittered(6, 1));
    assert_same("jittered grid", &grid, &point_field(&grid, waves), 0);
    let mut moved = jittered(5, 2);
    moved.points.iter_mut().for_each(|p| *p = *p * 1e-6 + DVec3::new(3.0, 40.0, -2.0));
    let moved = mesh(moved);
    assert_same("tiny and far away", &moved, &point_field(&moved, |p| waves((p - DVec3::new(3.0, 40.0, -2.0)) * 1e6)), 0);
}

#[test]
fn holes_and_many_parts_are_drawn_as_in_f64() {
    let sponge = sponge(7);
    assert_same("sponge", &sponge, &point_field(&sponge, waves), 2);
    let mut slabs = MeshParts::default();
    (0..30).for_each(|i| add_grid(&mut slabs, 1, DVec3::new(0.0, f64::from(i) * 0.1, 0.0), 1.0, |_| true));
    slabs.points.iter_mut().for_each(|p| p.y = p.y.floor() + (p.y.fract() * 10.0).round() / 10.0);
    for (i, p) in slabs.points.iter_mut().enumerate() {
        p.y = (i / 8) as f64 * 0.1 + if i % 8 / 2 % 2 == 1 { 0.05 } else { 0.0 };
    }
    let slabs = mesh(slabs);
    assert_same("30 slabs", &slabs, &point_field(&slabs, waves), 2);
}

#[test]
fn missing_values_and_cell_fields_are_drawn_as_in_f64() {
    let grid = mesh(jittered(5, 3));
    let mut field = point_field(&grid, waves);
    field.values.iter_mut().step_by(11).for_each(|v| *v = f64::NAN);
    assert_same("missing points", &grid, &ScalarField::new("s".into(), Association::Points, field.values), 2);
    let mut random = Random(4);
    let mut value = || if random.uniform() < 0.2 { f64::NAN } else { random.uniform() };
    let values = (0..grid.tets().len()).map(|_| value()).collect();
    assert_same("cells", &grid, &ScalarField::new("c".into(), Association::Cells, values), 4);
}

#[test]
fn what_is_no_proper_mesh_is_drawn_as_in_f64() {
    // Inverted, listed twice, overlapping.
    let mut parts = jittered(4, 5);
    let mut twice: Vec<_> = parts.tets.iter().step_by(5).map(|&[a, b, c, d]| [b, a, c, d]).collect();
    parts.tets.append(&mut twice);
    add_grid(&mut parts, 3, DVec3::splat(0.3), 1.1, |_| true);
    let overlapping = mesh(parts);
    assert_same("overlapping", &overlapping, &point_field(&overlapping, waves), 4);
    // Flat and nearly flat tets, of points that almost coincide.
    let mut parts = jittered(4, 6);
    let count = parts.points.len() as u32;
    for i in 0..40 {
        let [a, b, c, _] = parts.tets[i * 7];
        let flat = (parts.points[a as usize] + parts.points[b as usize]) / 2.0;
        parts.points.push(flat + DVec3::splat(if i % 2 == 0 { 0.0 } else { 1e-9 }));
        parts.tets.push([a, b, c, count + i as u32]);
    }
    let flat = mesh(parts);
    assert_same("flat", &flat, &point_field(&flat, waves), 4);
    // Every tet with points of its own, each squeezed by a little.
    let joined = jittered(3, 7);
    let mut seams = MeshParts::default();
    for tet in &joined.tets {
        let first = seams.points.len() as u32;
        seams.points.extend(tet.map(|i| joined.points[i as usize]));
        seams.tets.push([0, 1, 2, 3].map(|i| first + i));
    }
    let seams = mesh(seams);
    assert_same("seams", &seams, &point_field(&seams, waves), 4);
}

#[test]
fn layers_far_thinner_than_f32_tells_apart_end() {
    // Cells down to 1e-12 of the mesh: their points coincide in f32.
    let mut parts = MeshParts::default();
    add_grid(&mut parts, 6, DVec3::ZERO, 1.0, |_| true);
    parts.points.iter_mut().for_each(|p| p.z = if p.z > 0.0 { 100f64.powf((p.z - 1.0) * 7.0) } else { 0.0 });
    let layers = mesh(parts);
    assert_same("layers", &layers, &point_field(&layers, |p| p.z.max(1e-12).ln()), 4);
}

#[test]
fn without_usable_tets_the_picture_is_empty() {
    let flat = mesh(MeshParts {
        points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y],
        tets: vec![[0, 1, 2, 3]],
        ..MeshParts::default()
    });
    let camera = cameras(&flat)[0];
    let view = view(camera, TransferFunction::standard(), 9, 9);
    let image = draw(DeviceChoice::Gpu, &flat, &point_field(&flat, |p| p.x), &view);
    assert!(image.pixels.iter().all(|p| *p == [0.0; 4]));
}

#[test]
fn it_counts_tets_and_says_what_it_takes() {
    let grid = mesh(jittered(12, 8));
    let field = point_field(&grid, waves);
    let (renderer, progress) = (renderer(DeviceChoice::Gpu), Progress::new());
    let scene = renderer.exact_scene(&grid, &field, &progress).expect("fits");
    let (bytes, tets, points) = (scene.exact_bytes().expect("exact"), grid.tets().len() as u64, grid.points().len() as u64);
    let faces = 12 * 12 * 6 * 2;
    assert!(bytes > 20 * tets + 16 * points && bytes <= 20 * tets + 16 * points + 48 * faces, "{bytes}");
    let mut view = view(cameras(&grid)[0], TransferFunction::standard(), 40, 40);
    view.settings.min_transmittance = 0.0;
    let picture = renderer.render(&scene, &view, &progress).expect("renders");
    let covered = picture.image.pixels.iter().filter(|p| p[3] > 0.0).count() as u64;
    let steps = picture.samples.expect("counted") / covered;
    assert!((12..60).contains(&steps), "{steps} tets a ray");
    let times = renderer.time(&scene, &[view.clone(), view], 2, &progress).expect("renders");
    assert_eq!(times.wall_s.len(), 4);
}

fn assert_reference(name: &str, file: &str, views: &[(u32, u32)]) {
    let shared = PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data"));
    let progress = Progress::new();
    let mesh = read_mesh(&shared.join("data/tet").join(file), &progress).expect("reads");
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("has an array");
    let scenes = [DeviceChoice::Gpu, DeviceChoice::Cpu].map(|c| renderer(c).exact_scene(&mesh, &field, &progress).expect("fits"));
    let bytes_a_tet = scenes[0].exact_bytes().expect("exact") as f64 / mesh.tets().len() as f64;
    assert!(bytes_a_tet <= 40.0, "{name}: {bytes_a_tet} bytes a tet");
    for &(k, size) in views {
        let view = view(Camera::orbit(mesh.bounds().translated(mesh.center()), k, 1.0), TransferFunction::standard(), size, size);
        let picture = |i: usize, choice| renderer(choice).render(&scenes[i], &view, &progress).expect("renders").image;
        let (gpu, cpu) = (picture(0, DeviceChoice::Gpu), picture(1, DeviceChoice::Cpu));
        let reference = read_npy(&shared.join(format!("reference/{name}_v{k:02}_{size}.npy"))).expect("reads");
        let (_, covered) = psnr(&reference, &gpu);
        let (_, worst) = difference(&cpu, &gpu);
        // The bars are 60 dB and 2/255; hold what is reached: f32.
        assert!(covered >= 80.0, "{name} view {k}, {size}: {covered} dB over covered pixels");
        assert!(worst <= 1e-4, "{name} view {k}, {size}: {worst} off the f64 renderer");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn blunt_fin_is_its_reference() {
    assert_reference("blunt", "blunt_fin.vtu", &[(0, 256), (3, 256), (7, 256), (0, 512)]);
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn spx_is_its_reference() {
    assert_reference("spx1", "spx1_refined_zlib.vtu", &[(4, 256)]);
    assert_reference("spx2", "spx2_refined_zlib.vtu", &[(0, 256)]);
}

/// The adapter as one that binds no more than 128 KiB.
fn small_device() -> Renderer {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let adapter = adapters.first().expect("an adapter");
    let mut descriptor = octetra::gpu::device_descriptor(adapter);
    descriptor.required_limits.max_storage_buffer_binding_size = 128 << 10;
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    Renderer::on(octetra::gpu::Context::from_parts(adapter, device, queue), DeviceChoice::Gpu).expect("a renderer")
}

#[test]
fn a_mesh_that_the_device_has_no_room_for_is_drawn_on_the_cpu() {
    let (renderer, progress) = (small_device(), Progress::new());
    let [small, large] = [4, 12].map(|n| mesh(jittered(n, 9)));
    let scene = |mesh: &TetMesh| renderer.exact_scene(mesh, &point_field(mesh, waves), &progress).expect("a scene");
    assert!(scene(&small).is_on_device() && scene(&small).fell_back().is_none());
    let scene = scene(&large);
    assert!(!scene.is_on_device());
    let reason = scene.fell_back().expect("a reason").to_string();
    assert!(reason.contains("10368 tets needs 165888") && reason.contains("max_storage_buffer_binding_size is 131072"), "{reason}");
    let view = view(cameras(&large)[0], TransferFunction::standard(), 24, 24);
    let picture = renderer.render(&scene, &view, &progress).expect("renders");
    assert_eq!(picture.image, draw(DeviceChoice::Cpu, &large, &point_field(&large, waves), &view));
}
