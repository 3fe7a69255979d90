//! The surface against the exact renderer: same length inside the mesh on every ray.

use super::ray::{FAR, Ray};
use super::surface::{Hit, SurfaceRay};
use crate::exact::ExactScene;
use crate::exact::test_meshes::{Random, add_grid, cube, jitter, mesh, point_field};
use crate::mesh::generate::{Shape, plan};
use crate::mesh::{Association, BoundarySurface, MeshParts, ScalarField, TetMesh, collect};
use crate::progress::Progress;
use crate::view::{CubePlanes, CubeRay};
use glam::{DVec3, Vec3};

/// A mesh with its surface and its exact scene.
struct Case {
    mesh: TetMesh,
    surface: BoundarySurface,
    exact: ExactScene,
}

impl Case {
    fn new(mesh: TetMesh, field: &ScalarField) -> Self {
        let exact = ExactScene::new(&mesh, field, &Progress::new()).expect("not cancelled");
        Case { surface: BoundarySurface::new(&mesh, field), exact, mesh }
    }

    fn of(parts: MeshParts) -> Self {
        let mesh = mesh(parts);
        let field = point_field(&mesh, |p| p.x);
        Case::new(mesh, &field)
    }

    /// The cube ray from `origin` (relative to the mesh's centre) along `direction`, and the same ray as f32 has it in world units.
    fn ray(&self, origin: DVec3, direction: DVec3) -> (Ray, DVec3, DVec3) {
        let (min, edge) = self.mesh.root_cube();
        let (from, along) = (((origin - min) / edge).as_vec3(), direction.as_vec3());
        let ray = Ray::enter(CubeRay { origin: from, direction: along, length: along.length(), t_eye: 0.0 }, &CubePlanes::default());
        let entered = min + ray.origin.as_dvec3() * edge;
        (ray, entered, along.as_dvec3().normalize())
    }

    /// Lengths inside the mesh in cube edges: by the intervals of the surface, by the exact renderer; and the number of intervals.
    fn lengths(&self, origin: DVec3, direction: DVec3) -> (f64, f64, usize) {
        let (ray, from, along) = self.ray(origin, direction);
        let (mut way, mut length, mut count, mut last) = (SurfaceRay::start(&self.surface, &ray), 0.0, 0, 0.0);
        loop {
            let (t0, t1) = way.next_interval();
            if t0 >= t1 {
                assert_eq!((t0, t1), (FAR, -FAR));
                break;
            }
            assert!(t0 >= last, "in order, without overlap: {t0} after {last}");
            (length, count, last) = (length + f64::from(t1 - t0) * f64::from(ray.length), count + 1, t1);
        }
        assert_eq!(hits(&self.surface, &ray).iter().map(|hit| if hit.is_exit() { -1 } else { 1 }).sum::<i32>(), 0, "out as often as in");
        let exact: f64 = self.exact.trace(from, along).iter().map(|s| s.t_out - s.t_in).sum();
        (length, exact / self.mesh.root_cube().1, count)
    }

    fn assert_random_rays_agree(&self, rays: usize, seed: u64) {
        let mut random = Random(seed);
        let radius = self.mesh.bounds().diagonal() / 2.0;
        let mut met = 0;
        for i in 0..rays {
            let (mut origin, direction) = random.line(radius);
            if i % 3 == 0 {
                origin += direction * (radius * (1.0 + 2.0 * random.uniform())); // from inside, as often as not
            }
            let (found, expected, count) = self.lengths(origin, direction);
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}: {origin} {direction}");
            met += usize::from(count > 0);
        }
        assert!(met * 5 > rays, "only {met} of {rays} rays meet the mesh");
    }
}

fn hits(surface: &BoundarySurface, ray: &Ray) -> Vec<Hit> {
    let mut way = SurfaceRay::start(surface, ray);
    std::iter::from_fn(|| way.take_next()).collect()
}

fn ball() -> TetMesh {
    collect(&*plan(Shape::Ball, Some(6 * 10 * 10 * 10)).expect("a size that can be made")).expect("a valid mesh")
}

/// A ring of cells, and beside it a block with a cavity.
fn ring_and_shell() -> MeshParts {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, 5, DVec3::ZERO, 1.0, |[x, y, z]| z == 2 && !(x == 2 && y == 2));
    add_grid(&mut parts, 6, DVec3::new(1.1, 0.2, -0.3), 0.9, |cell| !cell.iter().all(|&c| (2..4).contains(&c)));
    parts
}

#[test]
fn random_rays_have_the_exact_length() {
    let mut random = Random(1);
    let mut jittered = cube(4);
    jitter(&mut jittered, 0.06, &mut random);
    Case::of(jittered).assert_random_rays_agree(3000, 2);
    Case::of(ring_and_shell()).assert_random_rays_agree(6000, 3);
    let ball = ball();
    let field = point_field(&ball, |p| p.x);
    Case::new(ball, &field).assert_random_rays_agree(4000, 4);
}

#[test]
fn missing_tets_overlaps_and_seams_have_the_exact_length() {
    // Missing values at random: cavities, pits, faces that meet at an edge or a vertex only.
    let mut random = Random(5);
    let mut parts = cube(4);
    jitter(&mut parts, 0.06, &mut random);
    let holed = mesh(parts);
    let values = (0..holed.tets().len()).map(|_| if random.uniform() < 0.4 { f64::NAN } else { 1.0 }).collect();
    Case::new(holed, &ScalarField::new("c".into(), Association::Cells, values)).assert_random_rays_agree(3000, 6);
    // A grid through another, and one on top of it.
    let mut parts = cube(3);
    add_grid(&mut parts, 2, DVec3::splat(0.15), 0.7, |_| true);
    add_grid(&mut parts, 2, DVec3::new(0.0, 0.0, 1.0), 1.0, |_| true);
    let twice: Vec<_> = parts.tets.iter().step_by(5).map(|&[a, b, c, d]| [b, a, c, d]).collect();
    parts.tets.extend(twice);
    Case::of(parts).assert_random_rays_agree(3000, 7);
}

#[test]
fn rays_through_vertices_and_along_edges_go_out_as_often_as_in() {
    let case = Case::of(ring_and_shell());
    let (min, edge) = case.mesh.root_cube();
    let diagonals = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, -1.0), DVec3::ONE, DVec3::new(1.0, -1.0, 1.0)];
    let vertices: Vec<DVec3> = case.surface.vertices().iter().map(|v| min + Vec3::from(v.position).as_dvec3() * edge).collect();
    for &vertex in &vertices {
        for direction in DVec3::AXES.into_iter().chain(diagonals).flat_map(|d| [d, -d]) {
            // Balance is asserted there; on the surface itself f32 and f64 may fall on either side.
            case.lengths(vertex - direction * 3.0, direction);
            case.lengths(vertex, direction);
        }
    }
    // To vertices, so that the line passes through them up to rounding.
    let mut random = Random(8);
    for &vertex in &vertices {
        let direction = random.direction();
        let (found, expected, _) = case.lengths(vertex - direction * 2.0, direction);
        assert!((found - expected).abs() < 1e-4, "{found}, expected {expected} through {vertex} along {direction}");
    }
}

#[test]
fn along_an_axis_lengths_are_those_of_cells() {
    // Rays through the middle of cells, where faces are parallel to the ray and edges are crossed.
    let case = Case::of(ring_and_shell());
    let ring = DVec3::splat(-0.0) - case.mesh.center();
    for (at, direction, expected, intervals) in [
        (DVec3::new(0.5, 0.5, 0.5), DVec3::Z, 0.0, 0),
        (DVec3::new(0.3, 0.5, 0.5), DVec3::Z, 0.2, 1),
        (DVec3::new(0.5, 0.5, 0.5), DVec3::Y, 0.8, 2),
        (DVec3::new(1.55, 0.65, 0.15), DVec3::Z, 0.6, 2),
        (DVec3::new(1.55, 0.65, 0.15), -DVec3::X, 0.6, 2),
    ] {
        let (found, exact, count) = case.lengths(ring + at - direction * 4.0, direction);
        let expected = expected / case.mesh.root_cube().1;
        assert!((found - expected).abs() < 1e-6 && (exact - expected).abs() < 1e-6, "{at}: {found}, {exact}, expected {expected}");
        assert_eq!(count, intervals, "{at}");
    }
}

/// Slabs of one cell, a gap as thick between them.
fn comb(slabs: u32) -> Case {
    let mut parts = MeshParts::default();
    for slab in 0..slabs {
        add_grid(&mut parts, 1, DVec3::new(0.0, 0.0, f64::from(2 * slab)), 1.0, |_| true);
    }
    Case::of(parts)
}

#[test]
fn any_number_of_slabs_is_crossed_in_order() {
    let slabs = 50;
    let case = comb(slabs);
    let edge = case.mesh.root_cube().1;
    for direction in [DVec3::Z, -DVec3::Z, DVec3::new(0.002, -0.001, 1.0)] {
        let (found, expected, count) = case.lengths(DVec3::new(0.1, 0.02, 0.0) - direction * 60.0, direction);
        assert!((found - expected).abs() < 1e-5 && (found - f64::from(slabs) / edge).abs() < 1e-3, "{found}, expected {expected}");
        assert_eq!(count, slabs as usize);
        // From the middle of a slab: what is behind only counts.
        let (found, expected, count) = case.lengths(DVec3::new(0.1, 0.02, 1.0), direction);
        assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}");
        assert_eq!(count, if direction.z > 0.0 { 25 } else { 26 });
    }
    let (ray, ..) = case.ray(DVec3::new(0.1, 0.02, -60.0), DVec3::Z);
    let hits = hits(&case.surface, &ray);
    assert_eq!(hits.len(), 2 * slabs as usize);
    assert!(hits.windows(2).all(|pair| pair[0].t < pair[1].t && pair[0].is_exit() != pair[1].is_exit()));
}

#[test]
fn what_touches_is_one_interval() {
    // Two cubes that share a side of points of their own.
    let mut parts = cube(2);
    add_grid(&mut parts, 3, DVec3::new(1.0, 0.0, 0.0), 1.0, |_| true);
    let case = Case::of(parts);
    let (found, _, count) = case.lengths(DVec3::new(-4.0, 0.11, 0.23), DVec3::X);
    assert!((found - 2.0 / case.mesh.root_cube().1).abs() < 1e-6, "{found}");
    assert_eq!(count, 1);
}

#[test]
fn without_faces_there_is_no_interval() {
    let flat =
        MeshParts { points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y], tets: vec![[0, 1, 2, 3]], ..Default::default() };
    let case = Case::of(flat);
    assert_eq!((case.surface.bytes(), case.surface.nodes().len()), (0, 0));
    assert_eq!(case.lengths(DVec3::new(0.1, 0.1, -2.0), DVec3::Z), (0.0, 0.0, 0));
}

#[test]
fn faces_that_lie_on_top_of_each_other_are_all_found() {
    // Many tets at one place: a hierarchy of equal boxes must stay shallow enough, and every face be hit.
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let parts = MeshParts { points, tets: vec![[0, 1, 2, 3]; 3000], ..Default::default() };
    let case = Case::of(parts);
    let (ray, ..) = case.ray(DVec3::new(0.1, 0.15, -3.0) - case.mesh.center(), DVec3::Z);
    assert_eq!(hits(&case.surface, &ray).len(), 6000);
    assert_eq!(case.lengths(DVec3::new(0.1, 0.15, -3.0) - case.mesh.center(), DVec3::Z).2, 1);
}

#[test]
fn points_and_faces_are_those_of_the_mesh() {
    let case = Case::of(ring_and_shell());
    let vertices = case.surface.vertices();
    assert!(vertices.windows(2).all(|pair| pair[0].point < pair[1].point));
    for face in case.surface.faces() {
        let tet = case.mesh.tets()[face.tet as usize];
        assert!(face.vertices.iter().all(|&v| tet.contains(&vertices[v as usize].point)));
    }
    let mut used = vec![false; vertices.len()];
    case.surface.faces().iter().flat_map(|face| face.vertices).for_each(|v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u));
    let faces = case.surface.faces().len();
    assert!(case.surface.bytes() <= 48 * faces, "{} bytes a face", case.surface.bytes() / faces);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
    let field = point_field(&case.mesh, |p| p.x);
    let again = pool.install(|| BoundarySurface::new(&case.mesh, &field));
    assert_eq!((again.faces(), again.nodes()), (case.surface.faces(), case.surface.nodes()));
}

/// The mesh has tets without volume and a seam of coincident points, and the axes run along its grid lines.
#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn blunt_fin_has_the_exact_length() {
    let shared = std::path::PathBuf::from(std::env::var_os("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data"));
    for file in ["blunt_fin.vtu", "spx2_refined_zlib.vtu"] {
        let mesh = crate::format::read_mesh(&shared.join("data/tet").join(file), &Progress::new()).expect("reads");
        let field = ScalarField::select(&mesh, &Default::default()).expect("has an array");
        let (min, edge) = mesh.root_cube();
        let (tets, faces) = crate::mesh::adjacency::link(mesh.tets(), |tet| field.is_usable(&mesh, tet));
        let surface = BoundarySurface::from_linked(mesh.points(), min, edge, &tets, faces);
        let count = surface.faces().len();
        assert!(surface.bytes() <= 33 * count, "{} bytes, {count} faces", surface.bytes());
        let case = Case::new(mesh, &field);
        case.assert_random_rays_agree(20_000, 9);
        for (k, axis) in (0..300).flat_map(|k| DVec3::AXES.map(|axis| (k, axis))) {
            let vertex = case.mesh.points()[(k * 7919 + 13) % case.mesh.points().len()];
            case.lengths(vertex - axis * (2.0 * case.mesh.bounds().diagonal()), axis);
        }
    }
}
