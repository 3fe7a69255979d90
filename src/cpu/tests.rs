//! The marcher against closed forms, and against dense look-ups of the texture that share no code with its walk.

use super::*;
use crate::octree::{CellKind, Node, Octree};
use crate::view::{Camera, Projection, TransferFunction};
use glam::{DVec3, UVec3};

/// A small generator of pseudo-random numbers (xorshift64*), so that failures repeat.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn unit_cube(kind: impl FnMut(UVec3, u8) -> CellKind) -> OctreeTexture {
    OctreeTexture::encode(&Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], kind)).expect("fits")
}

/// Cells split, emptied and filled at random down to `depth`.
fn random_tree(seed: u64, depth: u8) -> OctreeTexture {
    let mut random = Random(seed);
    unit_cube(move |_, d| match random.next() {
        p if p < 0.45 && d < depth => CellKind::Split,
        p if p < 0.6 => CellKind::Empty,
        _ => CellKind::Leaf(random.next() as f32),
    })
}

/// Every cell of `depth` full, its value that of `f` at the cell's centre.
fn uniform_tree(depth: u8, f: impl Fn(DVec3) -> f64) -> OctreeTexture {
    unit_cube(|at, d| {
        let center = (at.as_dvec3() + 0.5) / f64::from(1u32 << d);
        if d < depth { CellKind::Split } else { CellKind::Leaf(f(center) as f32) }
    })
}

fn grey_ramp(opacity: &[[f64; 2]], unit_distance: f64) -> Classifier {
    let tf = TransferFunction {
        color: vec![[0.0, 0.0, 0.5, 1.0], [1.0, 1.0, 0.5, 0.0]],
        opacity: opacity.to_vec(),
        unit_distance: Some(unit_distance),
        ..TransferFunction::standard()
    };
    Classifier::new(&tf, [0.0, 1.0], 1.0)
}

fn parallel(eye: DVec3, target: DVec3, view_height: f64) -> Camera {
    Camera { eye, target, up: DVec3::new(0.1, 0.2, 1.0), projection: Projection::Parallel { view_height } }
}

/// One ray through the cube.
fn one_ray(texture: &OctreeTexture, classifier: &Classifier, eye: DVec3, toward: DVec3, settings: &RenderSettings) -> [f32; 4] {
    let frame = parallel(eye, eye + toward, 1.0).frame(DVec3::ZERO, 1, 1);
    march(texture, None, &frame, classifier, settings, &Progress::new()).expect("nobody cancels").image.pixels[0]
}

fn settings(steps: Steps) -> RenderSettings {
    RenderSettings { steps, min_transmittance: 0.0, ..RenderSettings::new(1, 1) }
}

const BOTH: [Steps; 2] = [Steps::Leaf, Steps::Paper];

#[test]
fn a_constant_cube_absorbs_by_its_chord() {
    let texture = uniform_tree(3, |_| 0.25);
    let classifier = grey_ramp(&[[0.0, 1.0]], 0.4);
    for steps in BOTH {
        for (eye, toward, chord) in [
            (DVec3::new(-3.0, 0.3, 0.4), DVec3::X, 1.0),
            (DVec3::new(0.7, 0.1, 9.0), DVec3::NEG_Z, 1.0),
            (DVec3::splat(-1.0), DVec3::ONE, 3f64.sqrt()),
            (DVec3::new(-0.5, 0.0, 0.5), DVec3::new(1.0, 1.0, 0.0), 0.5 * 2f64.sqrt()),
            (DVec3::new(0.5, 0.5, 0.5), DVec3::Y, 0.5),
            (DVec3::new(-1.0, 1.5, 0.5), DVec3::X, 0.0),
            (DVec3::new(2.0, 0.5, 0.5), DVec3::X, 0.0),
        ] {
            let [r, _, b, a] = one_ray(&texture, &classifier, eye, toward, &settings(steps));
            let expected = 1.0 - (-chord / 0.4).exp();
            assert!((f64::from(a) - expected).abs() < 2e-6, "{steps:?} from {eye} towards {toward}: {a}, expected {expected}");
            assert!((r - 0.25 * a).abs() < 1e-6 && (b - 0.75 * a).abs() < 1e-6, "constant colour times opacity");
        }
    }
}

#[test]
fn the_nearer_leaf_covers_the_farther() {
    // x < 1/2 holds 0 (blue), the rest 1 (red).
    let texture = unit_cube(|at, _| CellKind::Leaf(at.x as f32));
    let classifier = grey_ramp(&[[0.0, 1.0]], 0.5);
    let half = 1.0 - (-1f32).exp();
    let (near, far) = (half, (1.0 - half) * half);
    let from_low = one_ray(&texture, &classifier, DVec3::new(-1.0, 0.3, 0.3), DVec3::X, &settings(Steps::Leaf));
    let from_high = one_ray(&texture, &classifier, DVec3::new(2.0, 0.3, 0.3), DVec3::NEG_X, &settings(Steps::Leaf));
    assert!((from_low[2] - near).abs() < 1e-6 && (from_low[0] - far).abs() < 1e-6, "{from_low:?}");
    assert!((from_high[0] - near).abs() < 1e-6 && (from_high[2] - far).abs() < 1e-6, "{from_high:?}");
}

#[test]
fn rays_along_cell_faces_belong_to_the_cells_above() {
    let texture = unit_cube(|at, _| CellKind::Leaf(at.y as f32));
    let classifier = grey_ramp(&[[0.0, 1.0]], 0.5);
    for steps in BOTH {
        let [r, _, b, a] = one_ray(&texture, &classifier, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, &settings(steps));
        assert!(r == a && b == 0.0 && (a - (1.0 - (-2f32).exp())).abs() < 1e-6, "{steps:?}: {r} {b} {a}");
    }
}

/// Error of the opacity that a ray along x finds under the paper's rule where the leaves of `depth` sample `f(x)`.
fn paper_error(depth: u8, opacity: &[[f64; 2]], unit_distance: f64, f: impl Fn(f64) -> f64, optical_depth: f64) -> f64 {
    let texture = uniform_tree(depth, |p| f(p.x));
    let classifier = grey_ramp(opacity, unit_distance);
    let [_, _, _, a] = one_ray(&texture, &classifier, DVec3::new(-1.0, 0.51, 0.52), DVec3::X, &settings(Steps::Paper));
    (f64::from(a) - (1.0 - (-optical_depth).exp())).abs()
}

#[test]
fn paper_steps_split_at_a_peak_narrower_than_a_step() {
    // Extinction rises to 20 and falls again while s = x goes from 0.47 to 0.53: no sample of step 1/16 sees its top.
    let peak = [[0.0, 0.0], [0.47, 0.0], [0.5, 1.0], [0.53, 0.0], [1.0, 0.0]];
    let error = paper_error(4, &peak, 0.05, |x| x, 0.03 / 0.05);
    assert!(error < 1e-5, "{error}");
}

#[test]
fn paper_steps_converge_at_second_order() {
    // s = 4 x (1 - x) is the same at both ends; elsewhere the half leaf by which samples at faces are late adds a first-order term.
    let error = |depth| paper_error(depth, &[[0.0, 0.0], [1.0, 1.0]], 1.0, |x| 4.0 * x * (1.0 - x), 2.0 / 3.0);
    for depth in 3..6 {
        let order = (error(depth) / error(depth + 1)).log2();
        assert!((order - 2.0).abs() < 0.2, "order {order} from depth {depth}: {} {}", error(depth), error(depth + 1));
    }
}

#[test]
fn finer_paper_steps_come_to_the_leaf_picture() {
    let texture = random_tree(7, 4);
    let classifier = grey_ramp(&[[0.0, 0.0], [1.0, 1.0]], 0.3);
    let frame = parallel(DVec3::new(-2.0, -1.3, 1.9), DVec3::splat(0.5), 1.6).frame(DVec3::ZERO, 24, 24);
    let image = |settings| march(&texture, None, &frame, &classifier, &settings, &Progress::new()).expect("nobody cancels").image;
    let leaf = image(settings(Steps::Leaf));
    let mean_difference = |step: f64| {
        let paper = image(RenderSettings { step_world: Some(step), ..settings(Steps::Paper) });
        let sum: f32 = leaf.pixels.iter().zip(&paper.pixels).map(|(p, q)| (p[3] - q[3]).abs()).sum();
        f64::from(sum) / leaf.pixels.len() as f64
    };
    let (coarse, fine) = (mean_difference(0.04), mean_difference(0.0025));
    assert!(coarse < 0.02 && fine < coarse / 4.0, "{coarse} {fine}");
}

/// Marches by looking up the texture at the middle of many short steps.
fn dense(texture: &OctreeTexture, classifier: &Classifier, origin: DVec3, direction: DVec3, steps: u32) -> [f64; 4] {
    let table = classifier.table(1.0);
    let (mut color, mut transmittance) = ([0.0; 3], 1.0);
    let length = 8.0 / f64::from(steps);
    for k in 0..steps {
        let (node, _) = texture.lookup(origin + direction * (length * (f64::from(k) + 0.5)));
        if let Node::Leaf { value, .. } = node {
            let medium = table.classify(table.interval(value), value);
            let alpha = -(-f64::from(medium.extinction) * length).exp_m1();
            for c in 0..3 {
                color[c] += transmittance * alpha * f64::from(medium.color[c]);
            }
            transmittance *= 1.0 - alpha;
        }
    }
    [color[0], color[1], color[2], 1.0 - transmittance]
}

#[test]
fn random_trees_look_as_dense_look_ups_see_them() {
    let classifier = grey_ramp(&[[0.0, 0.0], [0.3, 0.1], [0.31, 1.0], [1.0, 0.4]], 0.2);
    for seed in 1..=4 {
        let texture = random_tree(seed, 6);
        let mut random = Random(seed + 100);
        let eye = DVec3::new(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5).normalize() * 3.0 + 0.5;
        let camera = Camera { eye, target: DVec3::splat(0.5), up: DVec3::Z, projection: Projection::Perspective { fov_y_degrees: 30.0 } };
        let inside = Camera { eye: DVec3::new(0.4, 0.3, 0.6), projection: Projection::Perspective { fov_y_degrees: 100.0 }, ..camera };
        for camera in [camera, inside, parallel(eye, DVec3::splat(0.5), 1.5)] {
            let frame = camera.frame(DVec3::ZERO, 9, 7);
            let image = march(&texture, None, &frame, &classifier, &settings(Steps::Leaf), &Progress::new()).expect("nobody cancels").image;
            for (i, pixel) in image.pixels.iter().enumerate() {
                let (origin, direction) = frame.ray(i as u32 % 9, i as u32 / 9);
                let expected = dense(&texture, &classifier, origin, direction, 100_000);
                for c in 0..4 {
                    let off = (f64::from(pixel[c]) - expected[c]).abs();
                    assert!(off < 1e-3, "seed {seed}, {camera:?}, pixel {i}: {pixel:?}, expected {expected:?}");
                }
            }
        }
    }
}

#[test]
fn scale_and_distance_do_not_change_the_picture() {
    let kind = |at: UVec3, d: u8| if d < 3 { CellKind::Split } else { CellKind::Leaf((at.x * at.y % 5) as f32 / 5.0) };
    let image = |edge: f64, distance: f64, steps| {
        let tree = Octree::from_fn(DVec3::splat(-edge / 2.0), edge, [0.0, 1.0], kind);
        let texture = OctreeTexture::encode(&tree).expect("fits");
        let eye = DVec3::new(0.6, -0.48, 0.64) * distance * edge;
        let frame = parallel(eye, DVec3::ZERO, 1.2 * edge).frame(DVec3::ZERO, 32, 32);
        let classifier = grey_ramp(&[[0.0, 0.1], [1.0, 1.0]], 0.2 * edge);
        march(&texture, None, &frame, &classifier, &settings(steps), &Progress::new()).expect("nobody cancels").image
    };
    for steps in BOTH {
        let reference = image(1.0, 3.0, steps);
        for (edge, distance) in [(1e-12, 3.0), (1e9, 3.0), (1.0, 1e7)] {
            let (_, worst) = crate::image::difference(&reference, &image(edge, distance, steps));
            let bound = if steps == Steps::Leaf { 1e-4 } else { 0.05 };
            assert!(worst < bound, "edge {edge}, distance {distance}, {steps:?}: {worst}");
        }
    }
}

#[test]
fn the_deepest_trees_end() {
    // The cells below the centre are split down to depth 25, where cells are finer than f32 positions.
    let texture = unit_cube(|at, d| match d {
        d if at == UVec3::splat((1 << (d - 1)) - 1) && d < 25 => CellKind::Split,
        d => CellKind::Leaf(f32::from(d) / 25.0),
    });
    let classifier = grey_ramp(&[[0.0, 0.0], [1.0, 1.0]], 0.5);
    for steps in BOTH {
        for toward in [DVec3::ONE, DVec3::NEG_ONE, DVec3::new(1.0, 1.0 + 1e-7, 1.0), DVec3::X] {
            let eye = DVec3::splat(0.5) - toward * 2.0;
            let [_, _, _, a] = one_ray(&texture, &classifier, eye, toward, &settings(steps));
            assert!(a > 0.01 && a < 1.0, "{steps:?} towards {toward}: {a}");
        }
    }
    assert_eq!(texture.depth(), 25);
}

#[test]
fn opaque_rays_stop_early() {
    let texture = uniform_tree(5, |_| 1.0);
    let classifier = grey_ramp(&[[0.0, 1.0]], 0.01);
    let frame = parallel(DVec3::new(-1.0, 0.3, 0.3), DVec3::new(0.0, 0.3, 0.3), 0.1).frame(DVec3::ZERO, 4, 4);
    for steps in BOTH {
        let samples = |min_transmittance| {
            let settings = RenderSettings { min_transmittance, ..settings(steps) };
            march(&texture, None, &frame, &classifier, &settings, &Progress::new()).expect("nobody cancels").samples
        };
        assert!(samples(0.0) >= 16 * 32 && samples(1.0 / 512.0) <= 16 * 5, "{steps:?}: {} {}", samples(0.0), samples(1.0 / 512.0));
    }
}

#[test]
fn a_cancelled_march_says_so() {
    let texture = uniform_tree(2, |_| 1.0);
    let frame = parallel(DVec3::splat(-1.0), DVec3::ZERO, 1.0).frame(DVec3::ZERO, 8, 8);
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(march(&texture, None, &frame, &grey_ramp(&[[0.0, 1.0]], 1.0), &settings(Steps::Leaf), &progress), Err(Cancelled));
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let texture = random_tree(3, 5);
    let frame = parallel(DVec3::new(2.0, 1.7, 1.1), DVec3::splat(0.5), 1.5).frame(DVec3::ZERO, 40, 30);
    let classifier = grey_ramp(&[[0.0, 0.0], [1.0, 1.0]], 0.2);
    let output = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        pool.install(|| march(&texture, None, &frame, &classifier, &settings(Steps::Paper), &Progress::new()))
    };
    assert_eq!(output(1), output(4));
}
