//! The renderer against closed forms and against gathering every tet by its barycentric coordinates (maths 4.1).

use super::test_meshes::{Random, add_grid, cube, jitter, mesh, point_field};
use super::*;
use crate::geometry::{FACES, signed_volume};
use crate::image::difference;
use crate::mesh::MeshParts;
use crate::view::{Camera, OpacityModel, Planes, Projection, RenderSettings};

fn scene(mesh: &TetMesh, field: &ScalarField) -> ExactScene {
    ExactScene::new(mesh, field, &Progress::new()).expect("not cancelled")
}

fn total_length(segments: &[Segment]) -> f64 {
    segments.iter().map(|s| s.t_out - s.t_in).sum()
}

/// Length, value integral and crossings of a line by 4.1: the barycentric coordinates of every tet along it.
fn gather(mesh: &TetMesh, field: &ScalarField, origin: DVec3, direction: DVec3) -> (f64, f64, usize) {
    let mut sums = (0.0, 0.0, 0);
    for tet in (0..mesh.tets().len()).filter(|&tet| field.is_usable(mesh, tet)) {
        let p = mesh.corners(tet);
        let at = crate::geometry::barycentric(origin, &p);
        let ahead = crate::geometry::barycentric(origin + direction, &p);
        let (mut t_in, mut t_out) = (0.0f64, f64::INFINITY);
        for i in 0..4 {
            let slope = ahead[i] - at[i];
            let t = -at[i] / slope;
            if slope > 0.0 {
                t_in = t_in.max(t);
            } else {
                t_out = t_out.min(t);
            }
        }
        if t_out > t_in {
            let middle = crate::geometry::barycentric(origin + direction * ((t_in + t_out) / 2.0), &p);
            let values = mesh.tets()[tet].map(|i| field.values[i as usize]);
            let mean: f64 = (0..4).map(|i| middle[i] * values[i]).sum();
            sums = (sums.0 + t_out - t_in, sums.1 + mean * (t_out - t_in), sums.2 + 1);
        }
    }
    sums
}

/// Length, value integral and crossings of what `trace` finds; checks order on the way.
fn traced(scene: &ExactScene, origin: DVec3, direction: DVec3) -> (f64, f64, usize) {
    let segments = scene.trace(origin, direction);
    assert!(segments.iter().all(|s| s.t_in >= 0.0 && s.t_out > s.t_in));
    assert!(segments.windows(2).all(|pair| pair[0].t_out <= pair[1].t_in), "segments overlap");
    let value = segments.iter().map(|s| (s.t_out - s.t_in) * (s.s_in + s.s_out) / 2.0).sum();
    (total_length(&segments), value, segments.len())
}

fn assert_same(found: (f64, f64, usize), expected: (f64, f64, usize)) {
    let close = (found.0 - expected.0).abs() < 1e-12 && (found.1 - expected.1).abs() < 1e-12;
    assert!(close && found.2 == expected.2, "{found:?}, expected {expected:?}");
}

fn grey(opacity: Vec<[f64; 2]>, luminance: &[[f64; 2]], unit_distance: f64) -> TransferFunction {
    let color = luminance.iter().map(|&[x, l]| [x, l, l, l]).collect();
    let unit_distance = Some(unit_distance);
    TransferFunction { color, opacity, unit_distance, range: Some([0.0, 1.0]), ..TransferFunction::standard() }
}

/// One pixel that looks along a ray.
fn single_ray(origin: DVec3, direction: DVec3) -> RayFrame {
    let zero = DVec3::ZERO;
    let planes = Planes::NONE;
    RayFrame { eye: origin, forward: direction, right: zero, up: zero, right_origin: zero, up_origin: zero, width: 1, height: 1, planes }
}

fn pixel(scene: &ExactScene, tf: &TransferFunction, origin: DVec3, direction: DVec3) -> [f64; 4] {
    let image = scene
        .render(&single_ray(origin, direction), tf, &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new())
        .expect("not cancelled");
    image.pixels[0].map(f64::from)
}

/// An axis-parallel view of the unit cube in which every pixel's ray goes through it.
fn parallel_view(size: u32) -> RayFrame {
    let (eye, target, up) = (DVec3::new(0.5, -4.0, 0.5), DVec3::splat(0.5), DVec3::Z);
    Camera { eye, target, up, projection: Projection::Parallel { view_height: 1.0 } }.frame(DVec3::splat(0.5), size, size)
}

#[test]
fn a_constant_slab_has_one_minus_exp_of_its_depth() {
    let mesh = mesh(cube(3));
    let scene = scene(&mesh, &point_field(&mesh, |_| 0.5));
    let tf = grey(vec![[0.0, 0.7]], &[[0.0, 0.4]], 0.25);
    let image =
        scene.render(&parallel_view(33), &tf, &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new()).expect("not cancelled");
    let alpha = 1.0 - (-0.7f64 / 0.25).exp();
    for p in &image.pixels {
        assert!((f64::from(p[3]) - alpha).abs() < 1e-7 && (f64::from(p[0]) - 0.4 * alpha).abs() < 1e-7, "{p:?}");
    }
}

#[test]
fn one_tet_end_to_end() {
    let parts = MeshParts { points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], tets: vec![[0, 1, 2, 3]], ..Default::default() };
    let mesh = mesh(parts);
    let scene = scene(&mesh, &ScalarField::new("s".into(), Association::Points, vec![0.1, 0.9, 0.3, 0.7]));
    let knots = |v: [f64; 4]| vec![[0.0, v[0]], [0.4, v[1]], [0.5, v[2]], [1.0, v[3]]];
    let linear = grey(knots([0.0, 0.1, 0.8, 0.2]), &knots([0.0, 1.0, 0.2, 0.6]), 0.1);
    let exponential = TransferFunction { opacity_model: OpacityModel::Exponential, ..linear.clone() };
    let forward = (DVec3::new(0.2, 0.25, -1.0) - mesh.center(), DVec3::Z);
    let reversed = (DVec3::new(0.2, 0.25, 2.0) - mesh.center(), -DVec3::Z);
    for (tf, (origin, direction), color, alpha) in [
        (&linear, forward, 0.44081815243378, 0.922213833078071),
        (&linear, reversed, 0.273133689378477, 0.922213833078071),
        (&exponential, forward, 0.534627871101574, 0.992340119130178),
        (&exponential, reversed, 0.282208182732324, 0.992340119130178),
    ] {
        let look = Look::new(&scene, tf, &RenderSettings::new(1, 1).stopping_at(0.0), &single_ray(origin, direction));
        let mut gathered = Gathered::new(&look, origin, direction);
        scene.trace(origin, direction).into_iter().for_each(|segment| _ = gathered.pass(segment));
        let light = gathered.light;
        assert!((light.color[0] - color).abs() < 1e-14 && (1.0 - light.transmittance - alpha).abs() < 1e-14, "{light:?}");
    }
}

#[test]
fn every_line_is_gathered_exactly() {
    let mut random = Random(1);
    let mut parts = cube(5);
    jitter(&mut parts, 0.05, &mut random);
    let mesh = mesh(parts);
    let field = point_field(&mesh, |p| (7.0 * p.x).sin() + p.y * p.z);
    let scene = scene(&mesh, &field);
    for _ in 0..2000 {
        let (origin, direction) = random.line(0.9);
        assert_same(traced(&scene, origin, direction), gather(&mesh, &field, origin, direction));
        // From inside, only what lies ahead counts.
        let inside = origin + direction * 1.8;
        assert_same(traced(&scene, inside, direction), gather(&mesh, &field, inside, direction));
    }
}

#[test]
fn rays_along_edges_and_faces_have_the_chord_once() {
    let mesh = mesh(cube(4));
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    let center = DVec3::splat(0.5);
    // Through every interior vertex: along the axes, along face and space diagonals (Kuhn's edges), and in the planes between.
    let directions =
        [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::ONE, DVec3::new(0.3, 1.0, 0.0)];
    for direction in directions.into_iter().flat_map(|d| [d.normalize(), -d.normalize()]) {
        for p in mesh.points().iter().filter(|p| p.abs().max_element() < 0.4) {
            let (t_in, t_out) = slab(*p, direction);
            for (origin, expected) in [(*p - direction * 5.0, t_out - t_in), (*p, t_out)] {
                let length = traced(&scene, origin, direction).0;
                assert!((length - expected).abs() < 1e-12, "{direction} through {}: {length}, expected {expected}", *p + center);
            }
        }
    }
}

/// Where the line p + t d enters and leaves the unit cube about the origin.
fn slab(p: DVec3, d: DVec3) -> (f64, f64) {
    let (mut t_in, mut t_out) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in (0..3).filter(|&axis| d[axis] != 0.0) {
        let (a, b) = ((-0.5 - p[axis]) / d[axis], (0.5 - p[axis]) / d[axis]);
        (t_in, t_out) = (t_in.max(a.min(b)), t_out.min(a.max(b)));
    }
    (t_in, t_out)
}

#[test]
fn crossings_per_length_follow_cauchy_and_crofton() {
    let mut random = Random(2);
    let mut parts = cube(6);
    jitter(&mut parts, 0.04, &mut random);
    let mesh = mesh(parts);
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    let area = |tet: usize| {
        let p = mesh.corners(tet);
        FACES.iter().map(|&[a, b, c]| (p[b] - p[a]).cross(p[c] - p[a]).length() / 2.0).sum::<f64>()
    };
    // Each interior face is seen from its two tets, each boundary face from one: half the sum counts them once and half.
    let faces: f64 = (0..mesh.tets().len()).map(area).sum::<f64>() / 2.0;
    let volume: f64 = (0..mesh.tets().len()).map(|tet| signed_volume(&mesh.corners(tet))).sum();
    let (mut length, mut crossings) = (0.0, 0);
    for _ in 0..20_000 {
        let (origin, direction) = random.line(0.5 * 3f64.sqrt());
        let found = traced(&scene, origin, direction);
        (length, crossings) = (length + found.0, crossings + found.2);
    }
    let (measured, expected) = (crossings as f64 / length, faces / (2.0 * volume));
    assert!((measured / expected - 1.0).abs() < 0.02, "{measured} tets per length, expected {expected}");
}

#[test]
fn scaling_the_world_leaves_the_image() {
    let tf = TransferFunction::standard();
    let image = |scale: f64| {
        let mut parts = cube(4);
        jitter(&mut parts, 0.05, &mut Random(3));
        parts.points.iter_mut().for_each(|p| *p *= scale);
        let mesh = mesh(parts);
        let scene = scene(&mesh, &point_field(&mesh, |p| (p / scale).length()));
        let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 1, 1.0);
        scene
            .render(&camera.frame(mesh.center(), 40, 30), &tf, &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new())
            .expect("not cancelled")
    };
    let reference = image(1.0);
    assert!(reference.pixels.iter().any(|p| p[3] > 0.5));
    for scale in [1e-30, 1e-6, 1e-3, 1e3, 1e6, 1e30] {
        let (_, worst) = difference(&reference, &image(scale));
        assert!(worst < 1e-6, "scale {scale}: {worst}");
    }
}

#[test]
fn the_eye_may_be_inside_near_or_very_far() {
    let mut parts = cube(4);
    jitter(&mut parts, 0.05, &mut Random(4));
    let mesh = mesh(parts);
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    let direction = DVec3::new(0.4, -0.2, 1.0).normalize();
    let through = DVec3::new(0.1, 0.03, -0.04);
    let (t_in, t_out) = slab(through, direction);
    for (distance, tolerance) in [(0.0, 1e-14), (0.2, 1e-14), (1.0, 1e-14), (1e3, 1e-12), (1e9, 1e-6)] {
        let length = traced(&scene, through - direction * distance, direction).0;
        let expected = t_out - t_in.max(-distance);
        assert!((length - expected).abs() < tolerance, "{distance}: {length}, expected {expected}");
    }
    assert!(scene.trace(through + direction * 2.0, direction).is_empty(), "all lies behind");
}

#[test]
fn separate_parts_and_notches_are_entered_again() {
    // Two cubes a gap apart, and the L that remains of a cube without one quarter.
    let mut parts = cube(2);
    add_grid(&mut parts, 2, DVec3::new(3.0, 0.0, 0.0), 1.0, |_| true);
    let two = mesh(parts);
    let mut parts = MeshParts::default();
    add_grid(&mut parts, 2, DVec3::ZERO, 1.0, |[x, _, z]| !(x == 1 && z == 1));
    let l = mesh(parts);
    let along = |mesh: &TetMesh, origin: DVec3, direction: DVec3| {
        traced(&scene(mesh, &point_field(mesh, |_| 1.0)), origin - mesh.center(), direction.normalize()).0
    };
    assert!((along(&two, DVec3::new(-1.0, 0.3, 0.6), DVec3::X) - 2.0).abs() < 1e-14);
    assert!((along(&two, DVec3::new(5.0, 0.5, 0.5), -DVec3::X) - 2.0).abs() < 1e-14);
    assert!((along(&two, DVec3::new(2.0, 0.5, 0.5), DVec3::X) - 1.0).abs() < 1e-14, "from the gap only what is ahead");
    assert!((along(&l, DVec3::new(-1.0, 0.3, 0.7), DVec3::X) - 0.5).abs() < 1e-14);
    // Down the diagonal x + z = 1.2: through both legs, over the notch.
    let diagonal = along(&l, DVec3::new(-0.8, 0.3, 2.0), DVec3::new(1.0, 0.0, -1.0));
    assert!((diagonal - 2f64.sqrt() * 0.6).abs() < 1e-12, "{diagonal}");
}

#[test]
fn a_missing_vertex_is_transparent_on_exactly_its_tets() {
    let mut random = Random(5);
    let mut parts = cube(4);
    jitter(&mut parts, 0.05, &mut random);
    let mesh = mesh(parts);
    let mut field = point_field(&mesh, |p| p.y);
    let missing = mesh.points().iter().position(|p| p.abs().max_element() < 0.1).expect("a vertex in the middle");
    field.values[missing] = f64::NAN;
    let scene = scene(&mesh, &field);
    for _ in 0..500 {
        let (origin, direction) = random.line(0.9);
        let found = traced(&scene, origin, direction);
        assert!(found.1.is_finite());
        assert_same(found, gather(&mesh, &field, origin, direction));
    }
    let unusable = scene.tets.iter().zip(mesh.tets()).filter(|(_, corners)| corners.contains(&(missing as u32)));
    assert!(unusable.clone().count() > 0 && unusable.clone().all(|(tet, _)| tet.neighbours == [adjacency::NONE; 4]));
}

#[test]
fn tets_without_volume_open_no_cracks() {
    // Flat tets between two blocks whose common face is cut along different diagonals: 4 points in a plane, and collapsed ones.
    let square = [DVec3::ZERO, DVec3::X, DVec3::ONE - DVec3::Z, DVec3::Y];
    let mut parts = MeshParts { points: square.to_vec(), ..Default::default() };
    parts.points.extend([DVec3::new(0.4, 0.5, 1.0), DVec3::new(0.5, 0.4, -1.0)]);
    parts.tets = vec![[0, 1, 2, 4], [0, 2, 3, 4], [0, 1, 3, 5], [1, 2, 3, 5], [0, 1, 2, 3], [0, 1, 1, 2]];
    let mesh = mesh(parts);
    assert_eq!(mesh.zero_volume_count(), 2);
    let field = point_field(&mesh, |p| p.x);
    let scene = scene(&mesh, &field);
    let mut random = Random(6);
    for _ in 0..3000 {
        let at = DVec3::new(random.uniform() * 0.8 + 0.1, random.uniform() * 0.8 + 0.1, 0.0) - mesh.center();
        let direction = random.direction();
        let segments = scene.trace(at - direction * 5.0, direction);
        assert_same(traced(&scene, at - direction * 5.0, direction), gather(&mesh, &field, at - direction * 5.0, direction));
        assert!(segments.windows(2).all(|pair| pair[1].t_in - pair[0].t_out < 1e-13), "a crack");
    }
}

#[test]
fn seams_duplicates_and_overlaps_count_each_place_once() {
    let assert_chords = |parts: MeshParts| {
        let mesh = mesh(parts);
        let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
        let mut random = Random(7);
        for _ in 0..500 {
            let (origin, direction) = random.line(0.8);
            let (t_in, t_out) = slab(origin, direction);
            let length = traced(&scene, origin, direction).0;
            assert!((length - (t_out - t_in).max(0.0)).abs() < 1e-12, "{length}");
        }
    };
    // Every tet with points of its own: all faces are seams.
    let joined = cube(3);
    let mut seams = MeshParts::default();
    for tet in &joined.tets {
        let first = seams.points.len() as u32;
        seams.points.extend(tet.map(|i| joined.points[i as usize]));
        seams.tets.push([0, 1, 2, 3].map(|i| first + i));
    }
    assert_chords(seams);
    // Some tets listed twice, once the other way round.
    let mut twice = cube(3);
    let copies: Vec<_> = twice.tets.iter().step_by(5).map(|&[a, b, c, d]| [b, a, c, d]).collect();
    twice.tets.extend(copies);
    assert_chords(twice);
    // A second grid through the first.
    let mut overlapping = cube(3);
    add_grid(&mut overlapping, 2, DVec3::splat(0.15), 0.7, |_| true);
    assert_chords(overlapping);
}

#[test]
fn cell_values_are_constant_in_their_tets_and_missing_ones_transparent() {
    let mesh = mesh(cube(2));
    let half = |tet: usize| mesh.corners(tet).iter().map(|p| p.x).sum::<f64>() > 0.0;
    let values = (0..mesh.tets().len()).map(|tet| if half(tet) { f64::NAN } else { 0.5 }).collect();
    let scene = scene(&mesh, &ScalarField::new("c".into(), Association::Cells, values));
    let segments = scene.trace(DVec3::new(-3.0, 0.11, 0.17), DVec3::X);
    assert!(segments.iter().all(|s| (s.s_in, s.s_out) == (0.5, 0.5)));
    assert!((total_length(&segments) - 0.5).abs() < 1e-14);
    let tf = grey(vec![[0.0, 0.0], [0.5, 0.0], [0.5, 1.0]], &[[0.0, 1.0]], 1.0);
    let alpha = pixel(&scene, &tf, DVec3::new(-3.0, 0.11, 0.17), DVec3::X)[3];
    assert!((alpha - (1.0 - (-0.5f64).exp())).abs() < 1e-7, "{alpha}");
}

#[test]
fn a_step_is_sharp_wherever_it_falls() {
    let mesh = mesh(cube(3));
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    for step in [0.1, 1.0 / 3.0, 0.5, 0.77] {
        let tf = grey(vec![[0.0, 0.0], [step, 0.0], [step, 0.8]], &[[0.0, 0.0], [step, 0.0], [step, 1.0]], 0.5);
        let expected = 1.0 - (-(1.0 - step) * 0.8 / 0.5).exp();
        for direction in [DVec3::X, -DVec3::X] {
            let [r, _, _, alpha] = pixel(&scene, &tf, DVec3::new(0.0, 0.21, 0.03) - direction * 2.0, direction);
            assert!((alpha - expected).abs() < 1e-7 && (r - expected).abs() < 1e-7, "{step}: {r}, {alpha}, expected {expected}");
        }
    }
}

#[test]
fn a_ray_stops_when_it_is_opaque_and_the_error_is_bounded() {
    let mesh = mesh(cube(6));
    let scene = scene(&mesh, &point_field(&mesh, |p| p.y));
    let tf = TransferFunction { unit_distance: Some(0.05), ..TransferFunction::standard() };
    let render = |least| {
        scene.render(&parallel_view(16), &tf, &RenderSettings::new(1, 1).stopping_at(least), &Progress::new()).expect("not cancelled")
    };
    let (_, worst) = difference(&render(0.0), &render(1e-3));
    assert!(worst > 0.0 && worst <= 1e-3, "{worst}");
}

#[test]
fn images_do_not_depend_on_threads_and_rendering_can_be_cancelled() {
    let mut parts = cube(4);
    jitter(&mut parts, 0.05, &mut Random(8));
    let mesh = mesh(parts);
    let field = point_field(&mesh, |p| p.length());
    let image = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let frame = Camera::orbit(mesh.bounds(), 2, 1.0).frame(DVec3::ZERO, 24, 20);
            scene(&mesh, &field).render(
                &frame,
                &TransferFunction::standard(),
                &RenderSettings::new(1, 1).stopping_at(0.0),
                &Progress::new(),
            )
        })
    };
    assert_eq!(image(1), image(3));
    let cancelled = Progress::new();
    cancelled.cancel();
    assert!(ExactScene::new(&mesh, &field, &cancelled).is_err());
    assert_eq!(
        scene(&mesh, &field).render(
            &parallel_view(4),
            &TransferFunction::standard(),
            &RenderSettings::new(1, 1).stopping_at(0.0),
            &cancelled
        ),
        Err(Cancelled)
    );
}

#[test]
fn a_mesh_without_volume_is_empty_space() {
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
    let mesh = mesh(MeshParts { points, tets: vec![[0, 1, 2, 3]], ..Default::default() });
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    assert!(scene.trace(DVec3::new(0.0, 0.0, -3.0), DVec3::Z).is_empty());
    assert_eq!(pixel(&scene, &TransferFunction::standard(), DVec3::new(0.0, 0.0, -3.0), DVec3::Z), [0.0; 4]);
}

#[test]
fn memory_is_modest() {
    let mesh = mesh(cube(16));
    let scene = scene(&mesh, &point_field(&mesh, |p| p.x));
    let (tets, points, faces) = (mesh.tets().len(), mesh.points().len(), 16 * 16 * 12);
    assert!(scene.bytes() <= 32 * tets + 32 * points + 110 * faces, "{}", scene.bytes());
}
