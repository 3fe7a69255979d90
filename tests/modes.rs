//! What pixels show besides the composited volume: isosurfaces, largest, smallest and mean values, integrals, Phong's reflection. Closed
//! forms for the exact renderer and the octree, the GPU against the CPU, and references.

mod meshes;
mod views;

use glam::DVec3;
use meshes::{Random, add_grid, mesh, point_field};
use octetra::format::read_mesh;
use octetra::image::{Image, ImageFile, psnr, read_image};
use octetra::mesh::{Association, FieldSelection, MeshParts, ScalarField, TetMesh};
use octetra::octree::{OctreeParams, Preset, Reconstruction};
use octetra::progress::Progress;
use octetra::render::{DeviceChoice, RayNumbers, Renderer, Scene};
use octetra::view::{
    Camera, Faces, Intervals, Isosurface, Isosurfaces, LightSource, Mode, Phong, Projection, RenderSettings, Shading, Skip, Steps,
};
use octetra::view::{Plane, PlaneUse, Planes, TransferFunction, View};
use std::path::PathBuf;
use std::sync::Arc;
use views::{across, front, octree, volume, volume_scene};

fn surfaces(values: &[f64], opacity: f32) -> Isosurfaces {
    let list: Vec<_> = values.iter().map(|&value| Isosurface { opacity, ..Isosurface::at(value) }).collect();
    Isosurfaces::new(&list).expect("valid")
}

/// A cube [-1, 1]^3 of tets.
fn cube(n: u32) -> TetMesh {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, n, DVec3::NEG_ONE, 2.0, |_| true);
    mesh(parts)
}

fn numbers(renderer: &Renderer, scene: &Scene, view: &View) -> RayNumbers {
    renderer.numbers(scene, view, &Progress::new()).expect("draws")
}

#[test]
fn a_linear_field_has_its_numbers_in_closed_form() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(5);
    let field = point_field(&cube, |p| 7.0 + p.x + 2.0 * p.y - 0.5 * p.z);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 5, ..OctreeParams::default() });
    let size = 24;
    for (scene, tolerance) in [(&exact, 1e-6), (&octree, 1e-4)] {
        for (mode, of_middle) in [
            (Mode::Maximum, (|middle| middle + 2.0) as fn(f64) -> f64),
            (Mode::Minimum, |middle| middle - 2.0),
            (Mode::Mean, |middle| middle),
            (Mode::Integral, |middle| 2.0 * middle),
        ] {
            for steps in [Steps::Leaf, Steps::Fixed, Steps::Paper] {
                let view = front(RenderSettings { mode, steps, ..RenderSettings::new(size, size) });
                let found = numbers(&renderer, scene, &view);
                for (i, &value) in found.values.iter().enumerate() {
                    let [x, z] = across(i, size);
                    let expected = of_middle(7.0 + x - 0.5 * z);
                    assert!((f64::from(value) - expected).abs() < 8.0 * tolerance, "{mode} {steps:?} {x} {z}: {value}, {expected}");
                }
                assert!(found.depths.iter().all(|depth| depth.is_nan()));
            }
        }
        // The picture has the colour of the number: 3.5 to 10.5 is black to white; of integrals 0 to half the diagonal times 10.5.
        let grey = TransferFunction { color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]], ..TransferFunction::standard() };
        for mode in [Mode::Mean, Mode::Integral] {
            let view = View { transfer_function: grey.clone(), ..front(RenderSettings { mode, ..RenderSettings::new(size, size) }) };
            let picture = renderer.render(scene, &view, &Progress::new()).expect("draws").image;
            for (i, pixel) in picture.pixels.iter().enumerate() {
                let [x, z] = across(i, size);
                let mean = 7.0 + x - 0.5 * z;
                let expected = if mode == Mode::Mean { (mean - 3.5) / 7.0 } else { 2.0 * mean / (10.5 * 12f64.sqrt() / 2.0) };
                assert!((f64::from(pixel[1]) - expected).abs() < 1.0 / 255.0 && pixel[3] == 1.0, "{mode} {x} {z}: {pixel:?}, {expected}");
            }
        }
    }
}

#[test]
fn planes_are_met_where_they_are_and_lit_as_they_face() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4);
    let normal = DVec3::new(0.3, 1.0, -0.2);
    let field = point_field(&cube, |p| p.dot(normal));
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 5, ..OctreeParams::default() });
    let phong = Phong { ambient: 0.1, diffuse: 0.6, specular: 0.2, shininess: 8.0, light: LightSource::From(DVec3::new(0.5, -1.0, 0.7)) };
    let (to_light, to_eye, unit) = (DVec3::new(0.5, -1.0, 0.7).normalize(), DVec3::NEG_Y, -normal.normalize());
    let cos = unit.dot(to_light);
    let highlight = (2.0 * cos * unit - to_light).dot(to_eye).max(0.0).powi(8);
    let lit = 0.1 + 0.6 * cos.abs() + 0.2 * highlight;
    let size = 20;
    for (scene, tolerance) in [(&exact, 1e-6), (&octree, 2e-4)] {
        for steps in [Steps::Leaf, Steps::Fixed, Steps::Paper] {
            for skip in [Skip::Octree, Skip::None, Skip::Half] {
                let shading = Shading { volume: false, surfaces: true, phong };
                let settings = RenderSettings { mode: Mode::Iso, steps, skip, shading, ..RenderSettings::new(size, size) };
                let view = front(RenderSettings { isosurfaces: surfaces(&[-0.3, 0.4], 0.5), ..settings });
                let (found, picture) = (numbers(&renderer, scene, &view), renderer.render(scene, &view, &Progress::new()).expect("draws"));
                for (i, pixel) in picture.image.pixels.iter().enumerate() {
                    let [x, z] = across(i, size);
                    // y where the value is v.
                    let hits = [-0.3, 0.4].map(|v| v - 0.3 * x + 0.2 * z).into_iter().filter(|y| y.abs() < 1.0);
                    let hits: Vec<f64> = hits.collect();
                    let near_edge = [-0.3, 0.4].iter().any(|v| ((v - 0.3 * x + 0.2 * z).abs() - 1.0).abs() < 1e-3);
                    if near_edge {
                        continue;
                    }
                    let alpha = 1.0 - 0.5f64.powi(hits.len() as i32);
                    let what = format!("{steps:?} {skip} {x} {z}: {pixel:?}");
                    assert!((f64::from(pixel[3]) - alpha).abs() < 1e-6, "{what}, {alpha}");
                    assert!((f64::from(pixel[0]) - alpha * lit).abs() < 20.0 * tolerance, "{what}, {}", alpha * lit);
                    match hits.first() {
                        Some(y) => assert!((f64::from(found.depths[i]) - (5.0 + y)).abs() < 2.0 * tolerance, "{what}: {}", found.depths[i]),
                        None => assert!(found.depths[i].is_nan()),
                    }
                }
            }
        }
    }
}

#[test]
fn the_surface_of_a_radial_field_is_a_ball_that_is_lit_as_one() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let scene = volume_scene(&renderer, &volume(97, DVec3::length));
    let (radius, size) = (0.8, 160);
    let phong = Phong { ambient: 0.0, diffuse: 1.0, specular: 0.0, ..Phong::default() };
    let shading = Shading { volume: false, surfaces: true, phong };
    let settings = RenderSettings { mode: Mode::Iso, isosurfaces: surfaces(&[radius], 1.0), shading, ..RenderSettings::new(size, size) };
    let view = front(settings);
    let found = numbers(&renderer, &scene, &view);
    let picture = renderer.render(&scene, &view, &Progress::new()).expect("draws").image;
    let pixel = 2.0 / f64::from(size);
    let mut hits = 0;
    for (i, color) in picture.pixels.iter().enumerate() {
        let [x, z] = across(i, size);
        let off_axis = x.hypot(z);
        // The outline to half a pixel.
        assert!(color[3] == 1.0 || off_axis > radius - 0.5 * pixel, "{x} {z}");
        assert!(color[3] == 0.0 || off_axis < radius + 0.5 * pixel, "{x} {z}");
        if color[3] == 0.0 || off_axis > 0.95 * radius {
            continue;
        }
        hits += 1;
        // The place to a tenth of a pixel; that it faces the eye by |cos|, the normal to a degree.
        let cos = (radius * radius - off_axis * off_axis).sqrt() / radius;
        assert!((f64::from(found.depths[i]) - (5.0 - radius * cos)).abs() < 0.1 * pixel, "{x} {z}: {}", found.depths[i]);
        let degrees = (f64::from(color[0]).min(1.0).acos() - cos.acos()).abs().to_degrees();
        assert!(degrees < 1.0 || cos > 0.9995, "{x} {z}: off by {degrees} degrees");
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
fn the_surface_of_the_largest_coordinate_is_a_cube_with_flat_faces() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let scene = volume_scene(&renderer, &volume(65, |p| p.abs().max_element()));
    let size = 96;
    let shading = Shading { volume: false, surfaces: true, phong: Phong { ambient: 0.0, diffuse: 1.0, specular: 0.0, ..Phong::default() } };
    let settings = RenderSettings { mode: Mode::Iso, isosurfaces: surfaces(&[0.7], 1.0), shading, ..RenderSettings::new(size, size) };
    // From aside, so that three faces are seen.
    let eye = DVec3::new(3.0, -4.0, 2.5);
    let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Z, projection: Projection::Parallel { view_height: 2.6 } };
    let view = View { camera, ..front(settings) };
    let found = numbers(&renderer, &scene, &view);
    let picture = renderer.render(&scene, &view, &Progress::new()).expect("draws").image;
    let frame = camera.frame(DVec3::ZERO, size, size);
    let mut by_axis = [0; 3];
    for (i, color) in picture.pixels.iter().enumerate() {
        let (origin, direction) = frame.ray(i as u32 % size, i as u32 / size);
        let p = origin + direction * f64::from(found.depths[i]);
        let axis = (0..3).max_by(|&a, &b| p[a].abs().total_cmp(&p[b].abs())).expect("three");
        let second = (0..3).filter(|&a| a != axis).map(|a| p[a].abs()).fold(0.0, f64::max);
        if color[3] == 0.0 || second > 0.66 {
            continue;
        }
        by_axis[axis] += 1;
        assert!((p[axis].abs() - 0.7).abs() < 1e-4, "{p}");
        let degrees = (f64::from(color[0]).min(1.0).acos() - direction[axis].abs().acos()).abs().to_degrees();
        assert!(degrees < 1.0, "{p}: off by {degrees} degrees");
    }
    assert!(by_axis.iter().all(|&n| n > 500), "{by_axis:?}");
}

#[test]
fn surfaces_and_volume_cover_each_other_in_depth_order() {
    // Extinction 1 in the whole cube, and a half opaque red plane at y = 0: light from before it, the plane, light from behind it.
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4);
    let field = point_field(&cube, |p| p.y);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 4, ..OctreeParams::default() });
    let red = Isosurface { value: 0.0, color: Some([1.0, 0.0, 0.0]), opacity: 0.5 };
    let isosurfaces = Isosurfaces::new(&[red]).expect("valid");
    let blue = TransferFunction {
        color: vec![[0.0, 0.0, 0.0, 1.0]],
        opacity: vec![[0.0, 1.0]],
        unit_distance: Some(1.0),
        ..TransferFunction::standard()
    };
    let through = (-1f64).exp();
    let expected = [0.5 * through, 0.0, (1.0 - through) * (1.0 + 0.5 * through), 1.0 - 0.5 * through * through];
    for scene in [&exact, &octree] {
        for steps in [Steps::Leaf, Steps::Fixed, Steps::Paper] {
            let shading = Shading { surfaces: false, ..Shading::default() };
            let settings = RenderSettings { isosurfaces, steps, shading, ..RenderSettings::new(8, 8) };
            let view = View { transfer_function: blue.clone(), ..front(settings) };
            for pixel in renderer.render(scene, &view, &Progress::new()).expect("draws").image.pixels {
                let off = (0..4).map(|c| (f64::from(pixel[c]) - expected[c]).abs()).fold(0.0, f64::max);
                assert!(off < 2e-3, "{steps:?}: {pixel:?}, expected {expected:?}");
            }
        }
    }
}

#[test]
fn how_far_surfaces_are_goes_by_the_views_own_opacity() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(3);
    let field = point_field(&cube, |p| p.y);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 4, ..OctreeParams::default() });
    for (opacity, is_seen) in [(0.0, true), (1.0, false)] {
        for surface_opacity in [1.0, 0.0] {
            let settings = RenderSettings { isosurfaces: surfaces(&[0.75], surface_opacity), ..RenderSettings::new(4, 4) };
            let view = front(settings);
            let tf = TransferFunction { opacity: vec![[0.0, opacity]], unit_distance: Some(0.01), ..view.transfer_function.clone() };
            let view = View { transfer_function: tf, ..view };
            for scene in [&exact, &octree] {
                let depth = numbers(&renderer, scene, &view).depths[5];
                assert_eq!((depth - 5.75).abs() < 1e-3, is_seen, "{depth} at opacity {opacity}");
            }
        }
    }
}

#[test]
fn values_beyond_the_range_have_the_colours_for_them() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(3);
    let field = point_field(&cube, |p| p.y);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 4, ..OctreeParams::default() });
    let view = front(RenderSettings { mode: Mode::Maximum, ..RenderSettings::new(4, 4) });
    let tf = TransferFunction { range: Some([-0.5, 0.5]), above: Some([1.0, 0.0, 0.0]), ..view.transfer_function.clone() };
    for scene in [&exact, &octree] {
        let view = View { transfer_function: tf.clone(), ..view.clone() };
        assert_eq!(renderer.render(scene, &view, &Progress::new()).expect("draws").image.pixels[5], [1.0, 0.0, 0.0, 1.0]);
    }
}

#[test]
fn a_shaded_volume_is_as_bright_as_its_gradient_faces() {
    // All of the volume faces one way, and a constant one faces nothing.
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(3);
    let shading = Shading { volume: true, surfaces: true, phong: Phong { ambient: 0.2, diffuse: 0.8, specular: 0.0, ..Phong::default() } };
    for (field, expected) in [
        (point_field(&cube, |p| p.y + p.x), 0.2 + 0.8 * 0.5f64.sqrt()),
        (point_field(&cube, |p| p.x), 0.2),
        // A range is needed, for 0 to be small against: one corner far from the rays.
        (point_field(&cube, |p| if p.min_element() > 0.9 { 1.0 } else { 0.5 }), 1.0),
    ] {
        let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
        let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 5, ..OctreeParams::default() });
        for scene in [&exact, &octree] {
            let view = front(RenderSettings { shading, ..RenderSettings::new(16, 16) });
            let opaque = TransferFunction { opacity: vec![[0.0, 0.5]], unit_distance: Some(1.0), ..view.transfer_function.clone() };
            let picture = renderer.render(scene, &View { transfer_function: opaque, ..view }, &Progress::new()).expect("draws").image;
            // The lower left quarter: the corner with another value is far.
            for i in (0..256).filter(|i| i % 16 < 8 && i / 16 >= 8) {
                let [r, _, _, a] = picture.pixels[i].map(f64::from);
                assert!((r / a - expected).abs() < 2e-3, "{r} of {a}, expected {expected}");
            }
        }
    }
}

#[test]
fn clipped_rays_see_what_is_left_and_planes_the_values_on_them() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4);
    let field = point_field(&cube, |p| p.x + 0.5 * p.y);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 5, ..OctreeParams::default() });
    let normal = DVec3::new(0.25, 1.0, 0.5);
    let clip = |point, normal| Plane { point, normal, used: PlaneUse::Clip };
    let cut = Plane { point: DVec3::new(0.0, 0.25, 0.0), normal, used: PlaneUse::Cut { opacity: 0.75, edges: false } };
    // y of a plane at (x, z).
    let height = |plane: &Plane, x: f64, z: f64| {
        plane.point.y - ((x - plane.point.x) * plane.normal.x + (z - plane.point.z) * plane.normal.z) / plane.normal.y
    };
    let from_below = clip(DVec3::new(0.0, -0.5, 0.1), DVec3::new(-0.3, 2.0, 0.1));
    let from_above = clip(DVec3::new(0.0, 0.75, 0.0), DVec3::new(0.1, -1.0, -0.2));
    let beside = clip(DVec3::new(0.4, 0.0, 0.0), DVec3::NEG_X);
    let size = 24;
    let grey = TransferFunction {
        color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]],
        opacity: vec![[0.0, 1.0]],
        unit_distance: Some(2.0),
        ..TransferFunction::standard()
    };
    for (scene, tolerance) in [(&exact, 1e-5), (&octree, 2e-3)] {
        for steps in [Steps::Leaf, Steps::Fixed, Steps::Paper] {
            for skip in [Skip::Octree, Skip::Parts(3)] {
                // The mean of what is left: the field at the middle of the part of each ray.
                let planes = Planes::new(&[from_below, from_above, beside]).expect("valid");
                let settings = RenderSettings { steps, skip, planes, ..RenderSettings::new(size, size) };
                let view = front(RenderSettings { mode: Mode::Mean, ..settings });
                for (i, &mean) in numbers(&renderer, scene, &view).values.iter().enumerate() {
                    let [x, z] = across(i, size);
                    let (low, high) = (height(&from_below, x, z), height(&from_above, x, z));
                    if x > 0.4 {
                        assert!(mean.is_nan(), "{x} {z}: clipped away");
                    } else {
                        let expected = x + 0.25 * (low + high);
                        assert!((f64::from(mean) - expected).abs() < tolerance, "{steps:?} {skip} {x} {z}: {mean}, {expected}");
                    }
                }
                // Extinction 1/2 before the plane, and the plane itself.
                let planes = Planes::new(&[from_below, cut]).expect("valid");
                let view = View { transfer_function: grey.clone(), ..front(RenderSettings { planes, ..settings }) };
                let alone = View { settings: RenderSettings { mode: Mode::Iso, ..view.settings }, ..view.clone() };
                let [with, without] = [&view, &alone].map(|view| renderer.render(scene, view, &Progress::new()).expect("draws").image);
                for i in 0..(size * size) as usize {
                    let [x, z] = across(i, size);
                    let (low, y) = (height(&from_below, x, z), height(&cut, x, z));
                    let is_met = (low + 1e-3..0.999).contains(&y);
                    if !is_met {
                        continue;
                    }
                    let value = (x + 0.5 * y + 1.5) / 3.0;
                    let [r, _, _, a] = without.pixels[i].map(f64::from);
                    assert!((a - 0.75).abs() < 1e-6 && (r - 0.75 * value).abs() < tolerance, "{steps:?} {x} {z}: {r} {a}, {value}");
                    let through = 0.25 * (-(1.0 - low) / 2.0).exp();
                    let alpha = f64::from(with.pixels[i][3]);
                    assert!((alpha - (1.0 - through)).abs() < tolerance, "{steps:?} {skip} {x} {z}: {alpha}, {}", 1.0 - through);
                }
            }
        }
    }
}

#[test]
fn clipped_rays_look_the_same_however_empty_space_is_skipped() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(5);
    let field = point_field(&cube, |p| (3.0 * p.x).sin() + p.y * p.z);
    let scene = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 5, ..OctreeParams::default() });
    let clip = |point, normal| Plane { point, normal, used: PlaneUse::Clip };
    let planes = [clip(DVec3::new(0.0, -0.4, 0.1), DVec3::new(-0.3, 2.0, 0.1)), clip(DVec3::X * 0.3, DVec3::new(-1.0, -0.5, 0.2))];
    let planes = Planes::new(&planes).expect("valid");
    // Of the values only a band is seen.
    let opacity = vec![[0.0, 0.0], [0.4, 0.0], [0.5, 0.9], [0.6, 0.0], [1.0, 0.0]];
    for steps in [Steps::Leaf, Steps::Fixed] {
        let draw = |skip, planes| {
            let view = front(RenderSettings { steps, skip, planes, ..RenderSettings::new(40, 40) });
            let transfer_function =
                TransferFunction { opacity: opacity.clone(), unit_distance: Some(0.2), ..view.transfer_function.clone() };
            let picture = renderer.render(&scene, &View { transfer_function, ..view }, &Progress::new()).expect("draws");
            (picture.image, picture.samples.expect("an octree"))
        };
        let ((all, samples), (whole, _)) = (draw(Skip::None, planes), draw(Skip::None, Planes::NONE));
        let seen = all.pixels.iter().filter(|p| p[3] > 0.05).count();
        assert!((200..1400).contains(&seen) && all != whole, "{seen} pixels show anything");
        for skip in [Skip::Octree, Skip::Half, Skip::Parts(1), Skip::Parts(3)] {
            let (image, taken) = draw(skip, planes);
            let off = all.pixels.as_flattened().iter().zip(image.pixels.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-5 && taken < samples, "{steps:?} {skip}: off by {off}, {taken} of {samples} samples");
        }
    }
}

#[test]
fn edges_are_drawn_where_a_plane_cuts_faces() {
    // Grid lines at multiples of 1/2 and diagonals: a plane just above a layer of points is cut into the squares' triangles.
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let cube = cube(4);
    let field = point_field(&cube, |p| p.y);
    let exact = renderer.exact_scene(&cube, &field, &Progress::new()).expect("fits");
    let octree = octree(&renderer, &cube, &field, &OctreeParams { max_depth: 4, ..OctreeParams::default() });
    let octree = octree.with_mesh(Some(Arc::new(cube.clone())));
    let used = PlaneUse::Cut { opacity: 1.0, edges: true };
    let planes = Planes::new(&[Plane { point: DVec3::Y * 0.001, normal: DVec3::Y, used }]).expect("valid");
    let size = 240;
    let view = front(RenderSettings { mode: Mode::Iso, planes, ..RenderSettings::new(size, size) });
    for scene in [&exact, &octree] {
        let picture = renderer.render(scene, &view, &Progress::new()).expect("draws").image;
        let pixel = 2.0 / f64::from(size);
        let (mut dark, mut light) = (0, 0);
        for (i, color) in picture.pixels.iter().enumerate() {
            let [u, v] = across(i, size).map(|c| (c + 1.0) * 2.0 % 1.0 / 2.0);
            let to_line = |c: f64| c.min(0.5 - c);
            let distance = to_line(u).min(to_line(v)).min((u - v).abs() / 2f64.sqrt());
            if distance < 0.55 * pixel {
                assert!(color[0] < 0.25, "{u} {v}: {color:?} is on an edge");
                dark += 1;
            } else if distance > 2.0 * pixel {
                assert_eq!(color[0], 1.0, "{u} {v}: {color:?} is not");
                light += 1;
            }
        }
        assert!(dark > 2000 && light > 20_000, "{dark} {light}");
    }
}

/// Fields on points and on cells, in a mesh whose surface is no box's.
fn lumpy() -> (TetMesh, [ScalarField; 2]) {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, 6, DVec3::NEG_ONE, 2.0, |[x, y, z]| (x + 2 * y + z) % 7 != 0);
    Random(3).jitter(&mut parts, 0.05);
    let lumpy = mesh(parts);
    let on_points = point_field(&lumpy, |p| (3.0 * p.x).sin() + p.y * p.z);
    let of_cell = |tet: usize| lumpy.corners(tet).iter().map(|p| (3.0 * p.x).sin() + p.y * p.z).sum::<f64>() / 4.0;
    let on_cells = ScalarField::new("c".into(), Association::Cells, (0..lumpy.tets().len()).map(of_cell).collect());
    (lumpy, [on_points, on_cells])
}

/// What is drawn in the comparisons of one renderer with another.
fn looks() -> Vec<(&'static str, RenderSettings)> {
    let plain = RenderSettings::new(64, 48);
    let light = LightSource::From(DVec3::new(1.0, -2.0, 3.0));
    let shading = Shading { volume: true, surfaces: true, phong: Phong { light, ..Phong::default() } };
    let isosurfaces = surfaces(&[-0.5, 0.2, 0.6], 0.4);
    let clip = Plane { point: DVec3::new(0.1, 0.2, 0.0), normal: DVec3::new(-1.0, 2.0, 0.5), used: PlaneUse::Clip };
    let cut = Plane { normal: DVec3::new(0.5, 0.3, 1.0), used: PlaneUse::Cut { opacity: 0.5, edges: true }, ..clip };
    let planes = Planes::new(&[clip, cut]).expect("valid");
    let faces = Some(Faces { opacity: 0.3, color: None, edges: true });
    vec![
        ("faces", RenderSettings { mode: Mode::Iso, faces, ..plain }),
        ("mip", RenderSettings { mode: Mode::Maximum, ..plain }),
        ("minip", RenderSettings { mode: Mode::Minimum, ..plain }),
        ("integral", RenderSettings { mode: Mode::Integral, ..plain }),
        ("iso", RenderSettings { mode: Mode::Iso, isosurfaces, shading, ..plain }),
        (
            "clipped, intervals",
            RenderSettings { planes: Planes::new(&[clip]).expect("valid"), skip: Skip::Parts(3), intervals: Intervals::Raster, ..plain },
        ),
        ("shaded, with surfaces, planes and faces", RenderSettings { isosurfaces, shading, planes, faces, ..plain }),
    ]
}

fn assert_alike(what: &str, [one, other]: [&Image; 2], usual: f32, stray: usize) {
    let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    let mut all: Vec<f32> = one.pixels.iter().zip(&other.pixels).map(off).collect();
    all.sort_by(f32::total_cmp);
    let worst = all[all.len() - 1 - stray];
    assert!(worst <= usual, "{what}: all but {stray} pixels within {worst}");
    let seen = one.pixels.iter().filter(|p| p[3] > 0.05).count();
    assert!(seen > 300, "{what}: {seen} pixels show anything");
}

#[test]
fn the_gpu_draws_every_mode_as_the_cpu_does() {
    let [gpu, cpu] = [DeviceChoice::Gpu, DeviceChoice::Cpu]
        .map(|choice| Renderer::new(choice).expect("an adapter; on Debian: apt install mesa-vulkan-drivers"));
    let (lumpy, [on_points, on_cells]) = lumpy();
    let params = OctreeParams { max_depth: 5, ..OctreeParams::default() };
    let leaf = OctreeParams { reconstruction: Reconstruction::Leaf, ..params.clone() };
    let exact = |renderer: &Renderer, field| renderer.exact_scene(&lumpy, field, &Progress::new()).expect("fits");
    let shared = Arc::new(lumpy.clone());
    let octree = |renderer: &Renderer, params| octree(renderer, &lumpy, &on_points, params).with_mesh(Some(shared.clone()));
    let all = ["faces", "clipped, intervals", "mip", "minip", "integral", "iso", "shaded, with surfaces, planes and faces"];
    // Compiling shaders takes long on a software adapter: where only the march is another, one look that uses all of it.
    let pairs = [
        ("octree", [&gpu, &cpu].map(|renderer| octree(renderer, &params)), Steps::Leaf, &all[..]),
        ("octree, fixed steps", [&gpu, &cpu].map(|renderer| octree(renderer, &params)), Steps::Fixed, &all[6..]),
        ("octree of one value a leaf", [&gpu, &cpu].map(|renderer| octree(renderer, &leaf)), Steps::Leaf, &all[6..]),
        ("exact", [&gpu, &cpu].map(|renderer| exact(renderer, &on_points)), Steps::Leaf, &all[4..]),
        ("exact, on cells", [&gpu, &cpu].map(|renderer| exact(renderer, &on_cells)), Steps::Leaf, &all[5..6]),
    ];
    for (of, [on_gpu, on_cpu], steps, names) in &pairs {
        for (name, settings) in looks().into_iter().filter(|(name, _)| names.contains(name)) {
            let camera = Camera::orbit(lumpy.bounds().translated(lumpy.center()), 2, 1.2);
            let settings = RenderSettings { steps: *steps, ..settings };
            let view = View { camera, transfer_function: TransferFunction::standard(), settings };
            let draw = |renderer: &Renderer, scene| renderer.render(scene, &view, &Progress::new()).expect("draws").image;
            // A ray along a face or past an edge may fall on either side of it.
            assert_alike(&format!("{of}, {name}"), [&draw(&gpu, on_gpu), &draw(&cpu, on_cpu)], 1.0 / 255.0, 6);
        }
    }
    // The numbers themselves, in data units.
    let view = View {
        camera: Camera::orbit(lumpy.bounds().translated(lumpy.center()), 2, 1.2),
        transfer_function: TransferFunction::standard(),
        settings: RenderSettings { mode: Mode::Integral, ..RenderSettings::new(64, 48) },
    };
    let [a, b] = [numbers(&gpu, &pairs[3].1[0], &view), numbers(&cpu, &pairs[3].1[1], &view)];
    let off = a.values.iter().zip(&b.values).filter(|(a, b)| !((*a - *b).abs() < 1e-3 || (a.is_nan() && b.is_nan()))).count();
    assert!(off <= 3, "{off} integrals differ");
}

fn shared(path: &str) -> PathBuf {
    PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data")).join(path)
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
#[allow(clippy::print_stdout, reason = "the figures are of use where it passes, too")]
fn real_meshes_have_the_reference_numbers() {
    let cpu = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let gpu = Renderer::new(DeviceChoice::Gpu).expect("an adapter");
    for (file, array, references) in [
        (
            "blunt_fin.vtu",
            "density",
            &[
                ("blunt_max_v00_256", 0, Mode::Maximum, 0.0),
                ("blunt_mean_v03_256", 3, Mode::Mean, 0.0),
                ("blunt_iso1.4_v07_256", 7, Mode::Iso, 1.4),
            ][..],
        ),
        ("spx2_refined_zlib.vtu", "scalars", &[("spx2_max_v00_256", 0, Mode::Maximum, 0.0), ("spx2_iso0.8_v00_256", 0, Mode::Iso, 0.8)]),
    ] {
        let mesh = read_mesh(&shared("data/tet").join(file), &Progress::new()).expect("reads");
        let selection = FieldSelection { name: Some(array.to_owned()), ..Default::default() };
        let field = ScalarField::select(&mesh, &selection).expect("is there");
        let (range, diagonal) = (field.range[1] - field.range[0], mesh.bounds().diagonal());
        let [exact, on_gpu] = [&cpu, &gpu].map(|renderer| renderer.exact_scene(&mesh, &field, &Progress::new()).expect("fits"));
        let octree = octree(&cpu, &mesh, &field, &Preset::Fine.params());
        for &(name, orbit, mode, value) in references {
            let path = shared("reference").join(format!("{name}.npy"));
            let ImageFile::Values(reference) = read_image(&path).expect("reads") else { panic!("{name} holds values") };
            let is_iso = mode == Mode::Iso;
            let isosurfaces = if is_iso { surfaces(&[value], 1.0) } else { Isosurfaces::NONE };
            let settings = RenderSettings { mode, isosurfaces, ..RenderSettings::new(256, 256) };
            let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), orbit, 1.0);
            let view = View { camera, transfer_function: TransferFunction::standard(), settings };
            let unit = if is_iso { diagonal } else { range };
            let frame = camera.frame(mesh.center(), 256, 256);
            // Half the edge of the leaf in which the reference's surface lies.
            let half_leaf = |pixel: usize, depth: f64| {
                let texture = octree.texture().expect("an octree");
                let (origin, direction) = frame.ray(pixel as u32 % 256, pixel as u32 / 256);
                let (_, level) = texture.lookup((origin + direction * depth - texture.root_min()) / texture.root_edge());
                0.5 * texture.root_edge() / f64::from(1u32 << level)
            };
            for (of, renderer, scene) in [("f64", &cpu, &exact), ("f32", &gpu, &on_gpu), ("octree", &cpu, &octree)] {
                let found = numbers(renderer, scene, &view);
                let found = if is_iso { &found.depths } else { &found.values };
                let pairs = || reference.values.iter().zip(found).map(|(&a, &b)| (a, f64::from(b))).enumerate();
                let both: Vec<(usize, f64, f64)> =
                    pairs().filter(|(_, (a, b))| a.is_finite() && b.is_finite()).map(|(i, (a, b))| (i, a, (a - b).abs())).collect();
                let alone = pairs().filter(|(_, (a, b))| a.is_finite() != b.is_finite()).count() as f64 / both.len() as f64;
                let share = |limit: &dyn Fn(usize, f64) -> f64| {
                    both.iter().filter(|&&(i, a, off)| off <= limit(i, a)).count() as f64 / both.len() as f64
                };
                let exactly = share(&|_, _| 1e-5 * unit);
                let rms = (both.iter().map(|(_, _, off)| off * off).sum::<f64>() / both.len() as f64).sqrt() / unit;
                let within = if is_iso { share(&half_leaf) } else { 1.0 };
                println!(
                    "{name} {of}: {} pixels, in one only {alone:.4}, RMSE {rms:.2e}, within 1e-5 {exactly:.4}, half a leaf {within:.4}",
                    both.len()
                );
                match of {
                    "octree" => assert!(if is_iso { within >= 0.9 && alone <= 0.06 } else { rms <= 0.005 }, "{name}, octree"),
                    _ => assert!(alone <= 1e-3 && exactly >= 0.999, "{name}, {of}"),
                }
            }
        }
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
#[allow(clippy::print_stdout, reason = "the figures are of use where it passes, too")]
fn the_octree_looks_like_the_mesh_in_every_mode() {
    let cpu = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let mut all_fine = true;
    for (file, array, values) in [("blunt_fin.vtu", "density", [1.4, 3.0]), ("spx2_refined_zlib.vtu", "scalars", [0.4, 0.8])] {
        let mesh = read_mesh(&shared("data/tet").join(file), &Progress::new()).expect("reads");
        let selection = FieldSelection { name: Some(array.to_owned()), ..Default::default() };
        let field = ScalarField::select(&mesh, &selection).expect("is there");
        let exact = cpu.exact_scene(&mesh, &field, &Progress::new()).expect("fits");
        let octree = octree(&cpu, &mesh, &field, &Preset::Balanced.params());
        let plain = RenderSettings::new(160, 160).stopping_at(0.0);
        let shading = Shading { volume: true, surfaces: true, ..Shading::default() };
        let (opaque, clear) = (surfaces(&values, 1.0), surfaces(&values, 0.4));
        // What differs in isosurfaces is how they face: the octree's gradient is that of several tets where these are smaller than a leaf.
        for (name, settings, least) in [
            ("mip", RenderSettings { mode: Mode::Maximum, ..plain }, 38.0),
            ("minip", RenderSettings { mode: Mode::Minimum, ..plain }, 31.0),
            ("mean", RenderSettings { mode: Mode::Mean, ..plain }, 48.0),
            ("integral", RenderSettings { mode: Mode::Integral, ..plain }, 55.0),
            ("iso", RenderSettings { mode: Mode::Iso, isosurfaces: opaque, shading, ..plain }, 18.0),
            ("composite", plain, 52.0),
            ("phong", RenderSettings { shading, ..plain }, 38.0),
            ("phong, iso", RenderSettings { isosurfaces: clear, shading, ..plain }, 27.0),
        ] {
            let worst = [7].into_iter().map(|k| {
                let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), k, 1.0);
                let view = View { camera, transfer_function: TransferFunction::standard(), settings };
                let [a, b] = [&exact, &octree].map(|scene| cpu.render(scene, &view, &Progress::new()).expect("draws").image);
                let (_, covered) = psnr(&a, &b);
                covered
            });
            let worst = worst.fold(f64::INFINITY, f64::min);
            println!("{file} {name}: {worst:.1} dB over covered pixels, view 7");
            all_fine &= worst >= least;
        }
    }
    assert!(all_fine);
}
