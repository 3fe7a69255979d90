use super::*;
use crate::mesh::generate::{Shape, plan};
use crate::mesh::{Association, CellType, Cells, MeshParts, ScalarField, TetMesh, UnstructuredGrid, collect};
use crate::progress::Progress;
use glam::DVec3;

fn made(shape: Shape, tets: u64) -> TetMesh {
    collect(&*plan(shape, Some(tets)).expect("a size that can be made")).expect("valid")
}

/// Numbers of a small xorshift in [-1, 1).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

fn surface(points: Vec<DVec3>, faces: &[&[u32]]) -> Surface {
    let mut cells = Cells::default();
    for face in faces {
        let cell_type = if face.len() == 3 { CellType::TRIANGLE } else { CellType::POLYGON };
        cells.push(cell_type, face).expect("few");
    }
    Surface::of_grid(&UnstructuredGrid { points, cells, ..Default::default() }).expect("sound")
}

/// Triangles anywhere, some of them thin, some of them points or lines.
fn soup(count: usize, seed: usize) -> Surface {
    let mut next = numbers();
    (0..seed).for_each(|_| {
        next();
    });
    let mut points = Vec::new();
    for i in 0..count {
        let mut vector = || DVec3::new(next(), next(), next());
        let (a, u, v) = (vector(), vector() * 0.2, vector() * 0.2);
        let v = match i % 10 {
            0 => u * 0.5 + v * 1e-7,
            1 => u * 0.25,
            2 => DVec3::ZERO,
            _ => v,
        };
        points.extend([a, a + u, a + v]);
    }
    let faces: Vec<[u32; 3]> = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    surface(points, &faces.iter().map(|f| &f[..]).collect::<Vec<_>>())
}

fn measure(a: &Surface, b: &Surface, options: &DistanceOptions) -> SurfaceDistances {
    SurfaceDistances::measure(a, &b.clone().relative_to(a.origin), options, &Progress::new()).expect("nobody cancels")
}

/// The nearest point of a triangle, by trying many.
fn nearest_by_search(at: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let steps = 400;
    let mut best = f64::INFINITY;
    for i in 0..=steps {
        for j in 0..=steps - i {
            let (u, v) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
            best = best.min((a + (b - a) * u + (c - a) * v).distance(at));
        }
    }
    best
}

#[test]
fn nearest_points_of_triangles_thin_and_flat_ones_too() {
    let soup = soup(60, 0);
    let mut next = numbers();
    for t in 0..soup.triangles.len() {
        let corners = soup.corners(t);
        let at = DVec3::new(next(), next(), next());
        let (found, expected) = (nearest::closest(at, &corners), nearest_by_search(at, corners));
        let distance = found.distance(at);
        assert!(distance <= expected + 1e-12 && distance > expected - 2e-3, "{distance}, {expected}: {corners:?}");
        // It is a point of the triangle.
        assert!(nearest_by_search(found, corners) < 2e-3, "{found} is not on {corners:?}");
        corners.iter().for_each(|&corner| assert_eq!(nearest::closest(corner, &corners), corner));
    }
}

#[test]
fn the_hierarchy_agrees_with_looking_at_every_triangle() {
    for count in [1, 2, 5, 17, 1000] {
        let soup = soup(count, count);
        let nearest = Nearest::new(&soup);
        let mut next = numbers();
        for _ in 0..300 {
            let at = DVec3::new(next(), next(), next()) * 1.5;
            let found = nearest.find(at, (next().abs() * count as f64) as u32);
            let all = (0..count).map(|t| nearest::closest(at, &soup.corners(t)).distance_squared(at)).fold(f64::INFINITY, f64::min);
            assert_eq!(found.squared, all);
            assert_eq!(nearest::closest(at, &soup.corners(nearest.number(found.place) as usize)).distance_squared(at), all);
        }
    }
}

#[test]
fn rays_meet_the_first_triangle() {
    let soup = soup(400, 3);
    let nearest = Nearest::new(&soup);
    let mut next = numbers();
    let mut met = 0;
    for i in (0..400).filter(|i| i % 10 > 2) {
        let target = soup.corners(i).into_iter().sum::<DVec3>() / 3.0;
        let origin = DVec3::new(next(), next(), next()) * 3.0;
        let Some((t, distance)) = nearest.first_met(origin, target - origin) else { continue };
        let at = origin + (target - origin) * distance;
        assert!(nearest::closest(at, &soup.corners(t as usize)).distance(at) < 1e-9);
        assert!(distance < 1.0 + 1e-9);
        met += 1;
    }
    assert!(met > 250, "{met} rays met a triangle");
}

#[test]
fn a_surface_is_nowhere_away_from_itself() {
    for surface in [Surface::of_mesh(&made(Shape::Ball, 6000)), soup(500, 1)] {
        let found = measure(&surface, &surface, &DistanceOptions::default());
        for side in [&found.a_to_b, &found.b_to_a] {
            assert_eq!([side.min, side.mean, side.rms, side.max, side.bound, side.max_at_points], [0.0; 6]);
            assert!(side.at_points.iter().all(|&d| d == 0.0));
        }
    }
}

#[test]
fn a_moved_box_is_as_far_as_it_was_moved() {
    let a = Surface::of_mesh(&made(Shape::Cube, 3000));
    let b = Surface::of_mesh(&made(Shape::Cube, 700));
    for shift in [DVec3::X * 0.125, DVec3::new(0.01, -0.02, 0.005)] {
        let mut moved = b.clone();
        moved.points.iter_mut().for_each(|p| *p += shift);
        let found = measure(&a, &moved, &DistanceOptions::default());
        // The corner or the side that moves furthest.
        let expected = if shift.y == 0.0 { 0.125 } else { shift.length() };
        assert!((found.hausdorff() - expected).abs() < 1e-12, "{}, expected {expected}", found.hausdorff());
        assert!(found.bound() >= found.hausdorff() && found.bound() < expected + 2e-6 * found.diagonal, "{}", found.bound());
        let swapped = measure(&moved, &a, &DistanceOptions::default());
        for (x, y) in [(&found.a_to_b, &swapped.b_to_a), (&found.b_to_a, &swapped.a_to_b)] {
            assert!((x.max - y.max).abs() < 2e-6 && (x.mean - y.mean).abs() < 1e-12, "{x:?} {y:?}");
        }
    }
}

#[test]
fn planes_that_are_cut_otherwise_need_few_divisions() {
    let a = Surface::of_mesh(&made(Shape::Cube, 3000));
    let faces: [&[u32]; 6] = [&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let b = surface((0..8).map(corner).collect(), &faces);
    let found = measure(&a, &b, &DistanceOptions { divisions: 60_000, ..Default::default() });
    assert!(found.hausdorff() < 1e-12 && found.bound() < 1.1e-6 * found.diagonal, "{} {}", found.hausdorff(), found.bound());
}

#[test]
fn means_of_a_plane_over_another_are_those_of_its_height() {
    // Height x over a plane from x = 0 to 1: mean 1/2, mean square 1/3.
    let square = |height: f64| [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, height * x));
    let ground: Vec<DVec3> = square(0.0).iter().map(|p| (*p - DVec3::new(0.5, 0.5, 0.0)) * 20.0).collect();
    let (slope, ground) = (surface(square(1.0).to_vec(), &[&[0, 1, 2, 3]]), surface(ground, &[&[0, 1, 2], &[0, 2, 3]]));
    let found = measure(&slope, &ground, &DistanceOptions::default()).a_to_b;
    assert!((found.mean - 0.5).abs() < 1e-9 && (found.rms - (1f64 / 3.0).sqrt()).abs() < 1e-5, "{} {}", found.mean, found.rms);
    assert!(found.samples >= 100_000 && found.min == 0.0 && found.max == 1.0, "{found:?}");
}

#[test]
fn the_largest_distance_may_be_in_the_middle_of_a_triangle() {
    // A flat triangle over three that dip below it and share its corners.
    let flat = surface(vec![DVec3::new(-3.0, -3.0, 0.0), DVec3::new(3.0, -3.0, 0.0), DVec3::new(0.0, 3.0, 0.0)], &[&[0, 1, 2]]);
    let dip = vec![DVec3::new(-3.0, -3.0, 0.0), DVec3::new(3.0, -3.0, 0.0), DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 0.0, -1.0)];
    let dip = surface(dip, &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3]]);
    let found = measure(&flat, &dip, &DistanceOptions { samples: 1, ..Default::default() }).a_to_b;
    // By trying many places of the flat triangle.
    let nearest = Nearest::new(&dip.clone().relative_to(flat.origin));
    let [a, b, c] = flat.corners(0);
    let mut expected: f64 = 0.0;
    for i in 0..=600 {
        for j in 0..=600 - i {
            let at = a + (b - a) * (f64::from(i) / 600.0) + (c - a) * (f64::from(j) / 600.0);
            expected = expected.max(nearest.find(at, 0).squared.sqrt());
        }
    }
    assert_eq!(found.max_at_points, 0.0);
    assert!(found.max >= expected - 1e-5 && found.max < expected + 5e-3 && expected > 0.5, "{} {expected}", found.max);
    assert!(found.bound >= found.max && found.bound < found.max + 2e-5, "{} {}", found.max, found.bound);
    // Few divisions leave it open, and say so.
    let few = measure(&flat, &dip, &DistanceOptions { samples: 1, divisions: 3, ..Default::default() }).a_to_b;
    assert!(few.bound > few.max + 1e-3 && few.bound >= found.max, "{} {}", few.max, few.bound);
}

#[test]
fn distances_of_boundaries_agree_with_brute_force() {
    let (a, b) = (Surface::of_mesh(&made(Shape::Ball, 2000)), Surface::of_mesh(&made(Shape::Ball, 5000)));
    let b = b.relative_to(a.origin);
    let found = SurfaceDistances::measure(&a, &b, &DistanceOptions::default(), &Progress::new()).expect("nobody cancels");
    for (side, from, to) in [(&found.a_to_b, &a, &b), (&found.b_to_a, &b, &a)] {
        for (i, &p) in from.points.iter().enumerate() {
            let all = (0..to.triangles.len()).map(|t| nearest::closest(p, &to.corners(t)).distance(p)).fold(f64::INFINITY, f64::min);
            assert!((side.at_points[i] - all).abs() < 1e-12, "point {i}: {} instead of {all}", side.at_points[i]);
        }
        let at = from.corners(side.max_triangle as usize);
        assert!(nearest::closest(side.max_at, &at).distance(side.max_at) < 1e-12);
        assert!((side.max_at.distance(side.max_near) - side.max).abs() < 1e-12);
        assert!(side.max >= side.max_at_points && side.bound - side.max <= 1.1e-6 * found.diagonal, "{} {}", side.max, side.bound);
    }
    let progress = Progress::new();
    progress.cancel();
    assert!(SurfaceDistances::measure(&a, &b, &DistanceOptions::default(), &progress).is_err());
}

#[test]
fn faces_are_cut_and_figures_are_those_of_a_cube() {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) + 1e6;
    let faces: [&[u32]; 6] = [&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
    let cube = surface((0..8).map(corner).collect(), &faces);
    let figures = cube.figures();
    assert_eq!((cube.triangles.len(), figures.open_edges, figures.crowded_edges, figures.components), (12, 0, 0, 1));
    assert!((figures.area - 6.0).abs() < 1e-12 && figures.volume.is_some_and(|v| (v - 1.0).abs() < 1e-12));
    assert_eq!(cube.origin, DVec3::splat(1e6 + 0.5));

    let open = surface((0..8).map(corner).collect(), &faces[..5]).figures();
    assert_eq!((open.open_edges, open.volume), (4, None));
    // A concave polygon: a dart, whose fan from the first corner would turn over.
    let dart = [(1.0, -1.0), (0.5, 0.0), (1.0, 1.0), (-2.0, 0.0)];
    let flat = surface(dart.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect(), &[&[0, 1, 2, 3]]);
    assert!((flat.figures().area - 2.5).abs() < 1e-12, "{}", flat.figures().area);

    let ball = made(Shape::Ball, 3000);
    let volume: f64 = (0..ball.tets().len()).map(|t| crate::geometry::signed_volume(&ball.corners(t))).sum();
    let figures = Surface::of_mesh(&ball).figures();
    assert!(figures.volume.is_some_and(|v| (v / volume - 1.0).abs() < 1e-12), "{figures:?} {volume}");
    assert_eq!(figures.components, 1);
}

#[test]
fn what_is_no_surface_is_refused() {
    assert_eq!(Surface::of_grid(&UnstructuredGrid::default()).err(), Some(SurfaceError::NoFaces));
    let mut cells = Cells::default();
    cells.push(CellType::TRIANGLE, &[0, 1, 2]).expect("few");
    let mut grid = UnstructuredGrid { points: vec![DVec3::ZERO, DVec3::X], cells, ..Default::default() };
    assert_eq!(Surface::of_grid(&grid).err(), Some(SurfaceError::PointIndex { cell: 0, index: 2, points: 2 }));
    grid.points.push(DVec3::NAN);
    assert!(matches!(Surface::of_grid(&grid), Err(SurfaceError::NonFinitePoint { index: 2, .. })));
}

fn on_points(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
    ScalarField::new("s".into(), Association::Points, mesh.points().iter().map(|&p| f(p + mesh.center())).collect())
}

fn on_cells(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
    let middle = |tet| mesh.corners(tet).into_iter().sum::<DVec3>() / 4.0 + mesh.center();
    ScalarField::new("s".into(), Association::Cells, (0..mesh.tets().len()).map(|tet| f(middle(tet))).collect())
}

fn difference(a: (&TetMesh, &ScalarField), b: (&TetMesh, &ScalarField), snap: f64) -> FieldDifference {
    let of = |(mesh, field)| OnMesh { mesh, field };
    FieldDifference::measure(of(a), of(b), snap, &Progress::new()).expect("nobody cancels")
}

/// A mesh with its points elsewhere.
fn mapped(mesh: &TetMesh, f: impl Fn(DVec3) -> DVec3) -> TetMesh {
    let points = mesh.points().iter().map(|&p| f(p + mesh.center())).collect();
    TetMesh::new(MeshParts { points, tets: mesh.tets().to_vec(), ..Default::default() }).expect("valid")
}

#[test]
fn a_field_differs_from_itself_nowhere() {
    let mesh = made(Shape::Ball, 3000);
    for field in [on_points(&mesh, |p| (5.0 * p.x).sin() + p.y), on_cells(&mesh, |p| (5.0 * p.x).sin() + p.y)] {
        let found = difference((&mesh, &field), (&mesh, &field), 0.0);
        assert!(found.same_mesh && found.on_a.iter().all(|&d| d == 0.0));
        for norms in [found.over_a, found.over_b] {
            assert_eq!([norms.l1, norms.l2, norms.max, norms.mean, norms.alone], [0.0; 5]);
            assert_eq!((norms.places, norms.places_alone, norms.own_integral), (field.values.len() as u64, 0, norms.other_integral));
        }
    }
}

#[test]
fn linear_fields_agree_on_different_meshes_and_swapping_negates() {
    let (a, b) = (made(Shape::Cube, 3000), made(Shape::Cube, 900));
    let linear = |p: DVec3| 3.0 * p.x - 2.0 * p.y + p.z + 10.0;
    let (fa, fb) = (on_points(&a, linear), on_points(&b, linear));
    let found = difference((&a, &fa), (&b, &fb), 0.0);
    assert!(!found.same_mesh);
    for norms in [found.over_a, found.over_b] {
        assert!(norms.max < 1e-12 && norms.l2 <= norms.max && norms.alone == 0.0 && norms.places_alone == 0, "{norms:?}");
        assert!((norms.own_integral / 11.0 - 1.0).abs() < 1e-12 && (norms.both - 1.0).abs() < 1e-12, "{norms:?}");
    }
    // They differ by 2 x - 1 over [0, 1]: mean 0, L1 1/2, L2 sqrt(1/3), largest 1 at the ends.
    let fc = on_points(&b, |p| linear(p) - 2.0 * p.x + 1.0);
    let found = difference((&a, &fa), (&b, &fc), 0.0);
    for norms in [found.over_a, found.over_b] {
        assert!(norms.mean.abs() < 1e-12 && (norms.l2 - (1f64 / 3.0).sqrt()).abs() < 1e-12 && (norms.max - 1.0).abs() < 1e-12, "{norms:?}");
        assert!((norms.l1 - 0.5).abs() < 5e-3, "{norms:?}");
    }
    let largest = found.largest.expect("both have values");
    assert!(((largest.at.x - 0.5).abs() - 0.5).abs() < 1e-12 && ((largest.a - largest.b).abs() - 1.0).abs() < 1e-12, "{largest:?}");
    let mesh = if largest.is_of_a { &a } else { &b };
    let corners = mesh.corners(largest.tet as usize);
    assert!(crate::geometry::barycentric(largest.at - mesh.center(), &corners).iter().all(|&w| w > -1e-9));
    assert!((found.relative(0.6) - 0.6 / found.range).abs() < 1e-15 && (found.range - 6.0).abs() < 1e-12);
    let swapped = difference((&b, &fc), (&a, &fa), 0.0);
    assert!((found.over_a.l1 - swapped.over_b.l1).abs() < 1e-15 && (found.over_a.mean + swapped.over_b.mean).abs() < 1e-15);
    // Carried cell data are the tet's.
    let cells = on_cells(&b, |p| p.x);
    let found = difference((&a, &fa), (&b, &cells), 0.0);
    assert!(found.b_on_a.iter().all(|v| cells.values.contains(v)));
}

#[test]
fn where_only_one_has_a_value_is_said() {
    let a = made(Shape::Cube, 3000);
    let b = mapped(&a, |p| p + DVec3::X * 0.25);
    let (fa, fb) = (on_points(&a, |p| p.y), on_points(&b, |p| p.y));
    let found = difference((&a, &fa), (&b, &fb), 0.0);
    for norms in [found.over_a, found.over_b] {
        assert!((norms.both - 0.75).abs() < 0.03 && (norms.both + norms.alone - 1.0).abs() < 1e-12 && norms.max < 1e-12, "{norms:?}");
    }
    let beside = a.points().iter().zip(&found.on_a).filter(|(p, _)| p.x < -0.25 - 1e-6);
    assert!(beside.clone().count() > 20 && beside.clone().all(|(_, d)| d.is_nan()));
    assert_eq!(found.over_a.places_alone, found.on_a.iter().filter(|d| d.is_nan()).count() as u64);
    // Near enough, the surface's value: y is the same there.
    let found = difference((&a, &fa), (&b, &fb), 0.26);
    assert!(found.over_a.alone == 0.0 && found.over_a.max < 1e-12 && (found.over_a.snapped - 0.25).abs() < 0.03, "{:?}", found.over_a);
    // A missing value takes its tets with it.
    let mut holed = fa.clone();
    holed.values[0] = f64::NAN;
    let found = difference((&a, &fa), (&a, &holed), 0.0);
    assert!(found.on_a[0].is_nan() && found.over_a.places_alone == 1 && found.over_a.alone > 0.0 && found.over_b.alone == 0.0);
    let far = mapped(&a, |p| p + DVec3::X * 9.0);
    let found = difference((&a, &fa), (&far, &on_points(&far, |p| p.y)), 0.0);
    assert!(found.largest.is_none() && found.over_a.both == 0.0 && found.over_a.l2.is_nan());
}
