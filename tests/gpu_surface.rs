//! The boundary surface has the same intervals on the GPU as on the CPU. Needs an adapter; Mesa's software one will do.

mod meshes;

use glam::DVec3;
use meshes::{Random, point_field, sponge};
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

/// Tells for pairs of seen points which passes on the left; equal pairs of x, y have their places in the list as indices.
const SIDES: &str = "
@group(0) @binding(1) var<storage, read_write> found: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> pairs: array<vec4<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) index: vec3<u32>) {
    let pair = pairs[index.x];
    let p = Seen(vec3<f32>(pair.xy, 0.0), 2u * index.x);
    let q = Seen(vec3<f32>(pair.zw, 0.0), 2u * index.x + 1u);
    found[index.x] = vec2<f32>(select(0.0, 1.0, is_left(p, q)), select(0.0, 1.0, is_left(q, p)));
    if (frame.width == 0u) { found[0] = vec2<f32>(next_interval()); }
}
";

/// Runs a stage on the surface's functions and gives what it has found.
fn run(context: &Context, stage: &str, groups: [u32; 2], found: usize, own: &[(u32, wgpu::Buffer)], surface: &GpuSurface) -> Vec<[f32; 2]> {
    let file = |name: &str| FILES.iter().find(|(n, _)| *n == name).expect("a shader").1;
    let source = stage.to_owned() + file("shared/frame.wgsl") + file("shared/ray.wgsl") + file("shared/surface.wgsl");
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
    let size = 8 * found as u64;
    let buffer = |usage| device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let found = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let mappable = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
    let own = own.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding())).chain([(1, found.as_entire_binding())]);
    let bindings = own.chain((GpuSurface::FIRST_BINDING..).zip(surface.bindings()));
    let entries: Vec<_> = bindings.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let layout = pipeline.get_bind_group_layout(0);
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(groups[0], groups[1], 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&found, 0, &mappable, 0, size);
    context.queue.submit([encoder.finish()]);
    mappable.map_async(wgpu::MapMode::Read, .., |result| result.expect("maps"));
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device works");
    assert_eq!(context.take_error(), None);
    bytemuck::cast_slice(&mappable.get_mapped_range(..).expect("mapped")).to_vec()
}

fn buffer(context: &Context, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    context.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
}

/// The intervals of every pixel, row by row, found on the GPU.
fn intervals(context: &Context, surface: &BoundarySurface, uniforms: Frame) -> Vec<Vec<(f32, f32)>> {
    let uniforms = buffer(context, bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
    let surface = GpuSurface::upload(context, surface).expect("fits");
    let found = run(context, STAGE, [SIZE / 8; 2], (SIZE * SIZE) as usize * SLOTS, &[(0, uniforms)], &surface);
    let pixels = found.chunks_exact(SLOTS);
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
            let found = intervals(&context, &surface, Frame::new(&frame, min, edge, 1, &RenderSettings::new(SIZE, SIZE), None));
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
    let uniforms = Frame::new(&frame, DVec3::splat(-1.5), 3.0, 1, &RenderSettings::new(SIZE, SIZE), None);
    assert!(intervals(&context, &BoundarySurface::default(), uniforms).iter().all(Vec::is_empty));
}

#[test]
fn sides_are_exact_and_ties_are_those_of_a_ray_that_moved() {
    let mut random = Random(3);
    let mut pairs: Vec<[f32; 4]> = Vec::new();
    // Nearly on one line through the ray: products that differ in their last bits, or not at all.
    for i in 0..4032u32 {
        let [x, y, k] = [random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() * 2.0].map(|v| v as f32);
        let moved = |v: f32, by: u32| f32::from_bits(v.to_bits() + by);
        pairs.push([x, y, moved(x * k, i % 3), moved(y * k, i / 3 % 3)]);
    }
    // On a grid, where crosses are 0 and points coincide.
    pairs.extend((0..625).map(|i| [i % 5, i / 5 % 5, i / 25 % 5, i / 125].map(|v| v as f32 - 2.0)));
    pairs.resize(pairs.len().next_multiple_of(64), [1.0; 4]);

    let context = Context::new().expect("an adapter");
    let surface = GpuSurface::upload(&context, &BoundarySurface::default()).expect("fits");
    let frame = Camera::orbit(sponge(2).bounds(), 0, 1.0).frame(DVec3::ZERO, SIZE, SIZE);
    let uniforms = Frame::new(&frame, DVec3::ZERO, 1.0, 1, &RenderSettings::new(SIZE, SIZE), None);
    let uniforms = buffer(&context, bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
    let list = buffer(&context, bytemuck::cast_slice(&pairs), wgpu::BufferUsages::STORAGE);
    let found = run(&context, SIDES, [pairs.len() as u32 / 64, 1], pairs.len(), &[(0, uniforms), (2, list)], &surface);
    let (mut ties, mut close) = (0, 0);
    for (&[px, py, qx, qy], &[left, right]) in pairs.iter().zip(&found) {
        let (a, b) = (f64::from(px) * f64::from(qy), f64::from(py) * f64::from(qx)); // exact
        close += usize::from(a != b && a as f32 == b as f32);
        ties += usize::from(a == b);
        let expected = if a != b {
            a > b
        } else if py != qy {
            qy < py
        } else if px != qx {
            qx > px
        } else {
            true // by their indices
        };
        assert_eq!([left == 1.0, right == 1.0], [expected, !expected], "({px}, {py}) ({qx}, {qy})");
    }
    assert!(ties > 100 && close > 100, "{ties} ties, {close} close ones");
}
