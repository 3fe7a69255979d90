//! Boundary faces that are drawn: how many a ray meets, where, in what colours. Closed forms for the exact renderer and the octree; the GPU
//! is held against the CPU in `tests/modes.rs`, and here where parts of a mesh touch.

mod meshes;
mod views;

use glam::DVec3;
use meshes::{add_grid, mesh, point_field};
use octetra::image::Image;
use octetra::mesh::{MeshParts, ScalarField, TetMesh};
use octetra::octree::OctreeParams;
use octetra::progress::Progress;
use octetra::render::{DeviceChoice, Renderer, Scene};
use octetra::view::{Faces, LightSource, Mode, Phong, Plane, PlaneUse, Planes, RenderSettings, Shading, Steps, TransferFunction, View};
use views::{across, front, octree, volume, volume_scene};

const FLAT: Shading = Shading {
    volume: false,
    surfaces: false,
    phong: Phong { ambient: 0.0, diffuse: 1.0, specular: 0.0, shininess: 1.0, light: LightSource::Camera },
};

/// A cube [-1, 1]^3 without the cells that are not kept.
fn cube(n: u32, keep: impl FnMut([u32; 3]) -> bool) -> TetMesh {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, n, DVec3::NEG_ONE, 2.0, keep);
    mesh(parts)
}

/// The same mesh by both renderers.
fn scenes(renderer: &Renderer, mesh: &TetMesh, field: &ScalarField) -> [Scene; 2] {
    let exact = renderer.exact_scene(mesh, field, &Progress::new()).expect("fits");
    [exact, octree(renderer, mesh, field, &OctreeParams { max_depth: 5, ..OctreeParams::default() })]
}

fn draw(renderer: &Renderer, scene: &Scene, view: &View) -> Image {
    renderer.render(scene, view, &Progress::new()).expect("draws").image
}

#[test]
fn every_face_is_met_in_depth_order_with_the_volume() {
    // Two slabs with a gap between them, y in [-1, -0.5] and [0.5, 1], of extinction 2: four faces a ray.
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let slabs = cube(4, |[_, y, _]| y == 0 || y == 3);
    let field = point_field(&slabs, |p| p.y);
    let blue = TransferFunction {
        color: vec![[0.0, 0.0, 0.0, 1.0]],
        opacity: vec![[0.0, 1.0]],
        unit_distance: Some(0.5),
        ..TransferFunction::standard()
    };
    let clip = |y: f64| Planes::new(&[Plane { point: DVec3::Y * y, normal: DVec3::Y, used: PlaneUse::Clip }]).expect("valid");
    // Red faces and blue slabs, until nothing is left: an opacity for each.
    let slab = 1.0 - (-1f64).exp();
    let part = 1.0 - (-0.5f64).exp();
    for (planes, met) in [
        (Planes::NONE, vec![-1.0, slab, -1.0, -1.0, slab, -1.0]),
        (clip(-0.75), vec![part, -1.0, -1.0, slab, -1.0]),
        (clip(0.0), vec![-1.0, slab, -1.0]),
    ] {
        for opacity in [0.25, 1.0] {
            let (mut red, mut blue_light, mut through) = (0.0, 0.0, 1.0);
            for &alpha in &met {
                let is_face = alpha < 0.0;
                let alpha = if is_face { opacity } else { alpha };
                *(if is_face { &mut red } else { &mut blue_light }) += through * alpha;
                through *= 1.0 - alpha;
            }
            let faces = Some(Faces { opacity: opacity as f32, color: Some([1.0, 0.0, 0.0]), edges: false });
            for scene in &scenes(&renderer, &slabs, &field) {
                for steps in [Steps::Leaf, Steps::Fixed, Steps::Paper] {
                    let settings =
                        RenderSettings { faces, planes, steps, shading: FLAT, min_transmittance: 0.0, ..RenderSettings::new(9, 9) };
                    let picture = draw(&renderer, scene, &View { transfer_function: blue.clone(), ..front(settings) });
                    for pixel in picture.pixels {
                        let expected = [red, 0.0, blue_light, 1.0 - through];
                        let off = (0..4).map(|c| (f64::from(pixel[c]) - expected[c]).abs()).fold(0.0, f64::max);
                        assert!(off < 2e-3, "{:?} {steps:?} {opacity}: {pixel:?}, expected {expected:?}", scene.kind());
                    }
                }
            }
        }
    }
}

#[test]
fn where_the_mesh_goes_on_there_is_no_face() {
    // Two blocks whose points on y = 0 are there twice, and two that overlap.
    let [cpu, gpu] = [DeviceChoice::Cpu, DeviceChoice::Gpu]
        .map(|choice| Renderer::new(choice).expect("an adapter; on Debian: apt install mesa-vulkan-drivers"));
    for shift in [0.0, -0.125] {
        let mut parts = MeshParts::default();
        add_grid(&mut parts, 4, DVec3::NEG_ONE, 2.0, |[_, y, _]| y < 2);
        add_grid(&mut parts, 4, DVec3::new(-1.0, -1.0 + shift, -1.0), 2.0, |[_, y, _]| y >= 2);
        let blocks = mesh(parts);
        let field = point_field(&blocks, |p| p.x);
        let faces = Some(Faces { opacity: 0.5, color: Some([1.0; 3]), edges: false });
        for renderer in [&cpu, &gpu] {
            for scene in &scenes(renderer, &blocks, &field) {
                let view = front(RenderSettings { mode: Mode::Iso, faces, shading: FLAT, ..RenderSettings::new(16, 16) });
                for pixel in draw(renderer, scene, &view).pixels {
                    assert!((pixel[3] - 0.75).abs() < 1e-6, "{:?} {shift}: {pixel:?} is not of two faces", scene.kind());
                }
            }
        }
    }
}

#[test]
fn faces_have_the_colour_of_their_value_and_are_lit_as_they_face() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4, |_| true);
    let field = point_field(&cube, |p| p.x + 0.5 * p.z);
    let grey = TransferFunction { color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]], ..TransferFunction::standard() };
    let light = LightSource::From(DVec3::new(0.0, -3.0, 4.0));
    let phong = Phong { ambient: 0.1, diffuse: 0.5, specular: 0.0, shininess: 1.0, light };
    let faces = Some(Faces::default());
    for (scene, tolerance) in scenes(&renderer, &cube, &field).iter().zip([1e-6, 2e-3]) {
        for (shading, lit) in [(FLAT, 1.0), (Shading { volume: false, surfaces: true, phong }, 0.1 + 0.5 * 0.6)] {
            let settings = RenderSettings { mode: Mode::Iso, faces, shading, ..RenderSettings::new(32, 32) };
            let picture = draw(&renderer, scene, &View { transfer_function: grey.clone(), ..front(settings) });
            for (i, pixel) in picture.pixels.iter().enumerate() {
                let [x, z] = across(i, 32);
                let expected = lit * ((x + 0.5 * z) / 3.0 + 0.5);
                assert!((f64::from(pixel[0]) - expected).abs() < tolerance && pixel[3] == 1.0, "{x} {z}: {pixel:?}, {expected}");
            }
        }
    }
    // Numbers of rays have no surfaces.
    let mip = RenderSettings { mode: Mode::Maximum, ..RenderSettings::new(8, 8) };
    let [without, with] = [None, faces].map(|faces| {
        let scene = &scenes(&renderer, &cube, &field)[1];
        draw(&renderer, scene, &front(RenderSettings { faces, ..mip }))
    });
    assert_eq!(without, with);
}

#[test]
fn edges_of_a_mesh_are_drawn_and_those_of_a_box_are_not() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4, |_| true);
    let field = point_field(&cube, |p| p.y);
    let size = 240;
    let faces = Some(Faces { color: Some([1.0; 3]), edges: true, ..Faces::default() });
    let view = front(RenderSettings { mode: Mode::Iso, faces, shading: FLAT, ..RenderSettings::new(size, size) });
    let pixel = 2.0 / f64::from(size);
    for scene in &scenes(&renderer, &cube, &field) {
        let (mut dark, mut light) = (0, 0);
        for (i, color) in draw(&renderer, scene, &view).pixels.iter().enumerate() {
            // Grid lines at multiples of 1/2, and a diagonal in each square.
            let [u, v] = across(i, size).map(|c| (c + 1.0) % 0.5);
            let to_line = |c: f64| c.min(0.5 - c);
            let distance = to_line(u).min(to_line(v)).min((u - v).abs() / 2f64.sqrt());
            if distance < 0.45 * pixel {
                assert!(color[0] < 0.25, "{u} {v}: {color:?} is on an edge");
                dark += 1;
            } else if distance > 2.0 * pixel {
                assert_eq!(color[0], 1.0, "{u} {v}: {color:?} is not");
                light += 1;
            }
        }
        assert!(dark > 900 && light > 20_000, "{dark} {light}");
    }
    let scene = volume_scene(&renderer, &volume(9, |p| p.x));
    let picture = draw(&renderer, &scene, &view);
    let inside = |i: usize| across(i, size).iter().all(|c| c.abs() < 0.99);
    assert!((0..picture.pixels.len()).filter(|&i| inside(i)).all(|i| picture.pixels[i] == [1.0; 4]), "triangles of a volume's box show");
}
