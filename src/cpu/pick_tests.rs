//! What is seen at a pixel, in closed form.

use super::pick::{PickedWhat, pick};
use crate::mesh::generate::{Shape, plan};
use crate::mesh::{BoundarySurface, FieldSelection, ScalarField, collect};
use crate::octree::{CellKind, Octree, OctreeParams, OctreeTexture, regularize_grid};
use crate::optics::Classifier;
use crate::progress::Progress;
use crate::view::{
    Camera, Faces, Isosurface, Isosurfaces, Mode, Plane, PlaneUse, Planes, Projection, RayFrame, RenderSettings, TransferFunction,
};
use crate::volume::{Grid, GridFrame, Samples};
use glam::{DVec3, UVec3};
use std::sync::Arc;

const DEPTH: u8 = 5;

/// Leaves of one depth over [-1, 1]^3 with the value of their centre.
fn texture(value: impl Fn(DVec3) -> f32) -> OctreeTexture {
    let kind = |at: UVec3, depth: u8| match depth {
        DEPTH => CellKind::Leaf(value((at.as_dvec3() + 0.5) / f64::from(1 << (DEPTH - 1)) - 1.0)),
        _ => CellKind::Split,
    };
    OctreeTexture::encode(&Octree::from_fn(DVec3::splat(-1.0), 2.0, [0.0, 1.0], kind)).expect("fits")
}

/// The edge of a leaf.
const CELL: f64 = 2.0 / (1 << DEPTH) as f64;

/// A transfer function by opacity a unit of length.
fn classifier(opacity: &[[f64; 2]]) -> Classifier {
    let tf = TransferFunction { opacity: opacity.to_vec(), unit_distance: Some(1e-3), ..TransferFunction::standard() };
    Classifier::new(&tf, [0.0, 1.0], 1.0)
}

/// From the side along x, through (y, z) = (0.03, 0.01) in the middle.
fn frame(projection: Projection) -> RayFrame {
    let (eye, target) = (DVec3::new(-5.0, 0.03, 0.01), DVec3::new(0.0, 0.03, 0.01));
    Camera { eye, target, up: DVec3::Z, projection }.frame(DVec3::ZERO, 65, 65)
}

const PARALLEL: Projection = Projection::Parallel { view_height: 2.0 };

#[test]
fn an_opaque_slab_is_seen_at_its_face() {
    // From x = 0.25 on, four cells thick; a veil of 1/1000 of its extinction before.
    let texture = texture(|p| if (0.25..0.5).contains(&p.x) { 1.0 } else { 0.25 });
    let classifier = classifier(&[[0.0, 0.0], [0.5, 1e-5], [0.5, 1.0], [1.0, 1.0]]);
    // Oblique rays meet the face somewhere in a piece, which is seen by its middle.
    for (projection, within) in [(PARALLEL, 1e-5), (Projection::Perspective { fov_y_degrees: 20.0 }, 0.26 * CELL)] {
        let frame = frame(projection);
        for pixel in [[32, 32], [20, 40]] {
            let picked = pick(&texture, None, &frame, pixel, &classifier, &composite()).expect("the slab");
            let (origin, direction) = frame.ray(pixel[0], pixel[1]);
            let off = (picked.at - origin).reject_from(direction).length();
            // Half of the light comes from the first ln 2 of optical depth.
            let expected = 0.25 + std::f64::consts::LN_2 / 1000.0;
            assert!((picked.at.x - expected).abs() < within && off < 1e-5, "{picked:?}, {off} beside the ray");
            assert!(picked.opacity > 0.9);
        }
    }
    let nothing = classifier_of_nothing();
    assert_eq!(pick(&texture, None, &frame(PARALLEL), [32, 32], &nothing, &composite()), None);
}

fn composite() -> RenderSettings {
    RenderSettings::new(65, 65)
}

fn classifier_of_nothing() -> Classifier {
    classifier(&[[0.0, 0.0], [1.0, 0.0]])
}

#[test]
fn a_shell_is_seen_before_the_core_only_if_it_counts_for_more() {
    // A shell of radii 0.7 to 0.8 and a core of 0.3 in an empty ball.
    let texture = texture(|p| match p.length() {
        r if r < 0.3 => 1.0,
        r if (0.7..0.8).contains(&r) => 0.5,
        _ => 0.0,
    });
    // Extinction 0.3 per unit in the shell: pieces of half a cell have less than 1 % of opacity; the core is opaque.
    let seen = |shell: f64| {
        let knots = [[0.0, 0.0], [0.25, 0.0], [0.25, shell], [0.75, shell], [0.75, 1.0], [1.0, 1.0]];
        pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier(&knots), &composite()).expect("something").at.length()
    };
    assert!((seen(3e-4) - 0.3).abs() < CELL, "the core through a thin shell: {}", seen(3e-4));
    assert!((seen(1.0) - 0.8).abs() < CELL, "the outside of an opaque shell: {}", seen(1.0));
}

#[test]
fn what_lies_behind_counts_for_what_gets_through() {
    // Two slabs of one cell, two pieces each: of opacity `front` and 0.7 a piece.
    let texture = texture(|p| match p.x {
        x if (-0.5..-0.4375).contains(&x) => 0.5,
        x if (0.25..0.3125).contains(&x) => 1.0,
        _ => 0.0,
    });
    // Opacity of a thousandth of a unit that makes that of a piece.
    let thin = |piece: f64| -(-piece).ln_1p() / (0.5 * CELL) * 1e-3;
    let seen = |front: f64| {
        let (front, back) = (thin(front), thin(0.7));
        let knots = [[0.0, 0.0], [0.25, 0.0], [0.25, front], [0.75, front], [0.75, back], [1.0, back]];
        pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier(&knots), &composite()).expect("something")
    };
    // 0.35 before 0.65^2 0.7 = 0.296, and 0.2 before 0.8^2 0.7 = 0.448.
    let (front, back) = (seen(0.35), seen(0.2));
    assert!((-0.5..-0.5 + CELL / 2.0).contains(&front.at.x) && (front.opacity - 0.35).abs() < 1e-4, "{front:?}");
    assert!((0.25..0.25 + CELL / 2.0).contains(&back.at.x) && (back.opacity - 0.448).abs() < 1e-4, "{back:?}");
}

#[test]
fn rays_see_what_lies_inside_the_surface() {
    let ball = collect(&*plan(Shape::Ball, Some(6 * 20 * 20 * 20)).expect("a size")).expect("valid");
    let field = ScalarField::select(&ball, &FieldSelection::default()).expect("a field");
    let surface = BoundarySurface::new(&ball, &field);
    let (low, edge) = ball.root_cube();
    let kind = |_: UVec3, depth: u8| if depth == 4 { CellKind::Leaf(0.5) } else { CellKind::Split };
    let texture = OctreeTexture::encode(&Octree::from_fn(low, edge, [0.0, 1.0], kind)).expect("fits");
    let opaque = classifier(&[[0.0, 1.0]]);
    let radius = ball.bounds().size().x / 2.0;
    let picked = pick(&texture, Some(&surface), &frame(PARALLEL), [32, 32], &opaque, &composite()).expect("the ball").at;
    assert!((picked.length() / radius - 1.0).abs() < 0.01 && picked.x < 0.0, "{picked}");
    assert_eq!(
        pick(&texture, Some(&surface), &frame(PARALLEL), [1, 1], &opaque, &composite()),
        None,
        "a corner of the cube beside the ball"
    );
    let through = pick(&texture, None, &frame(PARALLEL), [1, 1], &opaque, &composite()).expect("the cube").at;
    assert!((through.x - low.x).abs() < 0.01 * edge, "{through}");
}

/// The field y - x + 5 over [-1, 1]^3, from 3 to 7, continuous.
fn slope() -> (OctreeTexture, Option<Arc<BoundarySurface>>) {
    let n = 17u32;
    let at = |i: u32| DVec3::new((i % n).into(), (i / n % n).into(), (i / n / n).into()) * (2.0 / f64::from(n - 1)) - 1.0;
    let frame = GridFrame::along_axes([n; 3], DVec3::NEG_ONE, DVec3::splat(2.0 / f64::from(n - 1)));
    let values = (0..n * n * n).map(|i| (at(i).y - at(i).x + 5.0) as f32).collect();
    let grid = Grid::new(frame, "s".into(), Samples::F32(values)).expect("valid");
    let all = OctreeParams { max_leaf_tets: 0, max_leaf_variance: 0.0, max_depth: 4, ..OctreeParams::default().by_thresholds() };
    let tree = regularize_grid(&grid, &all, &Progress::new()).expect("room");
    (OctreeTexture::encode(&tree).expect("fits"), tree.grid_surface(&grid))
}

/// What the middle ray along x, on which y is 0.03, sees of it: x, and what it is.
fn seen(settings: RenderSettings, planes: &[Plane], opacity: f64) -> Option<(f64, PickedWhat, f64)> {
    let (texture, surface) = slope();
    let tf = TransferFunction { opacity: vec![[0.0, opacity]], unit_distance: Some(1.0), ..TransferFunction::standard() };
    let planes = Planes::new(planes).expect("valid");
    let frame = RayFrame { planes, ..frame(PARALLEL) };
    let settings = RenderSettings { planes, ..settings };
    let picked = pick(&texture, surface.as_deref(), &frame, [32, 32], &Classifier::new(&tf, [3.0, 7.0], 1.0), &settings)?;
    assert!((picked.at.y - 0.03).abs() < 1e-6 && (picked.at.z - 0.01).abs() < 1e-6, "{picked:?}");
    Some((picked.at.x, picked.what, picked.opacity))
}

fn iso(list: &[(f64, f32)]) -> Isosurfaces {
    let surfaces: Vec<_> = list.iter().map(|&(value, opacity)| Isosurface { opacity, ..Isosurface::at(value) }).collect();
    Isosurfaces::new(&surfaces).expect("valid")
}

fn clip(x: f64) -> Plane {
    Plane { point: DVec3::X * x, normal: DVec3::X, used: PlaneUse::Clip }
}

fn cut(x: f64, opacity: f32) -> Plane {
    Plane { used: PlaneUse::Cut { opacity, edges: false }, ..clip(x) }
}

fn assert_seen(found: Option<(f64, PickedWhat, f64)>, x: f64, what: PickedWhat) {
    let (at, is, _) = found.expect("something");
    assert!((at - x).abs() < 1e-3 && is == what, "{is:?} at {at}, expected {what:?} at {x}");
}

#[test]
fn numbers_are_seen_where_they_are() {
    let of = |mode| RenderSettings { mode, ..composite() };
    // Along x the values fall from 6.03 to 4.03.
    assert_seen(seen(of(Mode::Maximum), &[], 0.0), -1.0, PickedWhat::Largest);
    assert_seen(seen(of(Mode::Minimum), &[], 0.0), 1.0, PickedWhat::Smallest);
    assert_seen(seen(of(Mode::Maximum), &[clip(0.25)], 0.0), 0.25, PickedWhat::Largest);
    for mode in [Mode::Mean, Mode::Integral] {
        assert_seen(seen(of(mode), &[], 0.0), 0.0, PickedWhat::Middle);
        assert_seen(seen(of(mode), &[clip(-0.5)], 0.0), 0.25, PickedWhat::Middle);
    }
    assert_eq!(seen(of(Mode::Mean), &[clip(1.5)], 0.0), None);
    // A bump in the middle of the ray.
    let texture = texture(|p| if (0.25..0.3125).contains(&p.x) { 0.75 } else { 0.5 });
    let middle = pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier_of_nothing(), &of(Mode::Maximum)).expect("the bump");
    assert!((middle.at.x - 0.25).abs() < 1e-3, "{middle:?}");
}

#[test]
fn the_first_surface_that_is_not_transparent_is_seen_alone() {
    let of = |list: &[(f64, f32)]| RenderSettings { mode: Mode::Iso, isosurfaces: iso(list), ..composite() };
    // y - x + 5 = v at x = 5.03 - v.
    assert_seen(seen(of(&[(4.5, 1.0), (5.5, 0.1)]), &[], 1.0), -0.47, PickedWhat::Isosurface(5.5));
    assert_seen(seen(of(&[(4.5, 1.0), (5.5, 0.0)]), &[], 1.0), 0.53, PickedWhat::Isosurface(4.5));
    assert_seen(seen(of(&[(4.5, 1.0), (5.5, 1.0)]), &[clip(0.0)], 1.0), 0.53, PickedWhat::Isosurface(4.5));
    assert_seen(seen(of(&[(4.5, 1.0)]), &[clip(-0.75), cut(0.1, 0.2)], 1.0), 0.1, PickedWhat::Cut(1));
    assert_eq!(seen(of(&[(4.5, 1.0)]), &[clip(0.75)], 1.0), None);
    // Where values jump, between leaves of one value each.
    let texture = texture(|p| if p.x < 0.25 { 0.2 } else { 0.8 });
    let between = RenderSettings { mode: Mode::Iso, isosurfaces: iso(&[(0.5, 1.0)]), ..composite() };
    let picked = pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier_of_nothing(), &between).expect("the jump");
    assert!((picked.at.x - 0.25).abs() < 1e-3, "{picked:?}");
}

#[test]
fn a_surface_in_light_is_seen_if_it_counts_for_more() {
    let of = |list: &[(f64, f32)]| RenderSettings { isosurfaces: iso(list), ..composite() };
    // Extinction 1 in all: half a leaf of the depth 4 or less has less than a tenth of opacity.
    let (x, what, share) = seen(of(&[(5.03, 0.5)]), &[], 1.0).expect("the surface");
    assert!(x.abs() < 1e-3 && what == PickedWhat::Isosurface(5.03), "{what:?} at {x}");
    assert!((share - 0.5 * (-1f64).exp()).abs() < 1e-3, "half of what comes through 1: {share}");
    assert_seen(seen(of(&[(5.03, 0.5)]), &[cut(-0.9, 0.3)], 1.0), -0.9, PickedWhat::Cut(0));
    assert_eq!(seen(of(&[(5.03, 0.01)]), &[], 1.0).expect("light").1, PickedWhat::Light);
    assert_seen(seen(of(&[(5.5, 0.3), (4.5, 1.0)]), &[], 0.0), 0.53, PickedWhat::Isosurface(4.5));
}

#[test]
fn boundary_faces_are_seen_where_rays_enter_and_leave() {
    let of = |mode, opacity| RenderSettings { mode, faces: Some(Faces { opacity, ..Faces::default() }), ..composite() };
    assert_seen(seen(of(Mode::Iso, 1.0), &[], 0.0), -1.0, PickedWhat::Face);
    assert_seen(seen(of(Mode::Composite, 0.4), &[], 0.0), -1.0, PickedWhat::Face);
    // What a plane clips off takes its face along: the ray sees that behind the data.
    assert_seen(seen(of(Mode::Iso, 1.0), &[clip(0.0)], 0.0), 1.0, PickedWhat::Face);
    // Of two alike the first covers a part of the second.
    let (_, what, opacity) = seen(of(Mode::Composite, 0.2), &[], 0.0).expect("a face");
    assert!(what == PickedWhat::Face && (opacity - 0.2).abs() < 1e-6);
    assert_eq!(seen(of(Mode::Iso, 0.0), &[], 0.0), None);
}
