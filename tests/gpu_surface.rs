//! The boundary surface has the same intervals on the GPU as on the CPU. Needs an adapter; Mesa's software one will do.

mod meshes;

use glam::DVec3;
use meshes::{point_field, sponge};
use octetra::cpu::surface_intervals;
use octetra::gpu::layout::Frame;
use octetra::gpu::shader::FILES;
use octetra::gpu::{Context, GpuSurface};
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{BoundarySurface, FieldSelection, ScalarField, TetMesh, collect};
use octetra::view::{Camera, CubeRays, Projection, RayFrame, RenderSettings};
use wgpu::util::DeviceExt;

/// Pixels along each side of the images.
const SIZE: u32 = 96;
/// Intervals that the shader writes for each pixel.
const SLOTS: usize = 24;

/// Writes each pixel's intervals.
const STAGE: &str = "
@group(0) @binding(1) var<storage, read_write> found: array<vec2<f32>>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>) {
    let ray = enter(pixel_ray(pixel.xy));
    if (ray.t_out <= 0.0 || !in_image(pixel.xy)) { return; }
    start_surface(ray);
    for (var slot = 0u; slot < 24u; slot += 1u) {
        let interval = next_interval();
        found[24u * (pixel.x + frame.width * pixel.y) + slot] = interval;
        if (interval.x >= interval.y) { break; }
    }
}
";

/// The intervals of every pixel, row by row, found on the GPU.
fn intervals(context: &Context, surface: &BoundarySurface, uniforms: Frame) -> Vec<Vec<(f32, f32)>> {
    let file = |name: &str| FILES.iter().find(|(n, _)| *n == name).expect("a shader").1;
    let source = STAGE.to_owned() + file("shared/frame.wgsl") + file("shared/ray.wgsl") + file("shared/surface.wgsl");
    let device = &context.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source: wgpu::ShaderSource::Wgsl(source.into()) });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let contents = bytemuck::bytes_of(&uniforms);
    let uniforms =
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage: wgpu::BufferUsages::UNIFORM });
    let size = u64::from(SIZE * SIZE) * SLOTS as u64 * 8;
    let buffer = |usage| device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let found = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let mappable = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
    let on_device = GpuSurface::upload(context, surface).expect("fits");
    let bindings = [(0, uniforms.as_entire_binding()), (1, found.as_entire_binding())];
    let bindings = bindings.into_iter().chain((GpuSurface::FIRST_BINDING..).zip(on_device.bindings()));
    let entries: Vec<_> = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let layout = pipeline.get_bind_group_layout(0);
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(SIZE / 8, SIZE / 8, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&found, 0, &mappable, 0, size);
    context.queue.submit([encoder.finish()]);
    mappable.map_async(wgpu::MapMode::Read, .., |result| result.expect("maps"));
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device works");
    assert_eq!(context.take_error(), None);
    let bytes = mappable.get_mapped_range(..).expect("mapped").to_vec();
    let pixels = bytemuck::cast_slice::<u8, [f32; 2]>(&bytes).chunks_exact(SLOTS);
    pixels.map(|slots| slots.iter().map(|&[t0, t1]| (t0, t1)).take_while(|(t0, t1)| t0 < t1).collect()).collect()
}

fn frames(mesh: &TetMesh) -> [RayFrame; 4] {
    let (bounds, center) = (mesh.bounds(), mesh.center());
    let [near, far] = [0.0, 60.0].map(|k| Camera::orbit(bounds.translated(center), k as u32 % 12, 1.0 + k / 60.0));
    let middle = center + bounds.center();
    let inside = Camera { eye: middle, target: middle + DVec3::new(0.3, 1.0, 0.1), ..near };
    let inside = Camera { projection: Projection::Perspective { fov_y_degrees: 100.0 }, ..inside };
    // Along an axis, rays go through vertices and along faces.
    let axis = Camera { eye: middle - DVec3::Y * 9.0 * bounds.diagonal(), target: middle, up: DVec3::Z, ..near };
    let axis = Camera { projection: Projection::Parallel { view_height: bounds.size().max_element() * 96.0 / 90.0 }, ..axis };
    [near, far, inside, axis].map(|camera| camera.frame(center, SIZE, SIZE))
}

/// Intervals less than `gap` apart as one.
fn joined(intervals: &[(f32, f32)], gap: f32) -> Vec<(f32, f32)> {
    let mut all: Vec<(f32, f32)> = Vec::new();
    for &(t0, t1) in intervals.iter().filter(|(t0, t1)| t1 - t0 > gap) {
        match all.last_mut() {
            Some(last) if t0 - last.1 < gap => last.1 = t1,
            _ => all.push((t0, t1)),
        }
    }
    all
}

#[test]
fn gpu_and_cpu_find_the_same_intervals() {
    let context = Context::new().expect("an adapter; on Debian: apt install mesa-vulkan-drivers");
    let ball = collect(&*plan(Shape::Ball, Some(6000)).expect("a size")).expect("valid");
    let wing = collect(&*plan(Shape::Wing, None).expect("a size")).expect("valid");
    let mut most = 0;
    for mesh in [ball, wing, sponge(12)] {
        let field = ScalarField::select(&mesh, &FieldSelection::default()).unwrap_or_else(|_| point_field(&mesh, |p| p.x));
        let surface = BoundarySurface::new(&mesh, &field);
        let (min, edge) = mesh.root_cube();
        for (view, frame) in frames(&mesh).into_iter().enumerate() {
            let rays = CubeRays::new(&frame, min, edge);
            let found = intervals(&context, &surface, Frame::new(&frame, min, edge, 1, &RenderSettings::new(SIZE, SIZE)));
            let mut met = 0;
            for (i, found) in found.iter().enumerate() {
                let expected = surface_intervals(&surface, rays.ray(i as u32 % SIZE, i as u32 / SIZE));
                let (found, expected) = (joined(found, 1e-6), joined(&expected, 1e-6));
                (met, most) = (met + found.len(), most.max(found.len()));
                let close = |((a0, a1), (b0, b1)): (&(f32, f32), &(f32, f32))| (a0 - b0).abs() < 1e-6 && (a1 - b1).abs() < 1e-6;
                let same = found.len() == expected.len() && found.iter().zip(&expected).all(close);
                assert!(same, "view {view}, pixel {i}: {found:?} on the GPU, {expected:?} on the CPU");
            }
            assert!(met > 1000, "view {view}: only {met} intervals");
        }
    }
    assert!(most >= 4, "at most {most} intervals on a ray");
}

#[test]
fn a_surface_without_faces_has_no_intervals() {
    let context = Context::new().expect("an adapter");
    let frame = Camera::orbit(sponge(2).bounds(), 0, 1.0).frame(DVec3::ZERO, SIZE, SIZE);
    let uniforms = Frame::new(&frame, DVec3::splat(-1.5), 3.0, 1, &RenderSettings::new(SIZE, SIZE));
    assert!(intervals(&context, &BoundarySurface::default(), uniforms).iter().all(Vec::is_empty));
}
