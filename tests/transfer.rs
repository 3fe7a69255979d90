//! Transfer functions over other scales, in steps and with colours beyond their range, as the renderers draw them.

mod meshes;

use glam::DVec3;
use octetra::mesh::{MeshParts, ScalarField, TetMesh};
use octetra::octree::{OctreeParams, OctreeTexture, regularize};
use octetra::progress::Progress;
use octetra::render::DeviceChoice;
use octetra::view::{Camera, Projection, RenderSettings, RendererKind, Scale, TransferFunction, View};
use octetra::{ExactScene, Renderer};

/// The unit cube with the field z mapped to `values[0]` to `values[1]`.
fn cube(values: [f64; 2]) -> (TetMesh, ScalarField) {
    let mut parts = MeshParts::default();
    meshes::add_grid(&mut parts, 1, DVec3::ZERO, 1.0, |_| true);
    let mesh = meshes::mesh(parts);
    let field = meshes::point_field(&mesh, |p| values[0] + (values[1] - values[0]) * p.z);
    (mesh, field)
}

/// Colour and alpha of a ray that goes up through the middle of the cube, premultiplied.
fn up(values: [f64; 2], tf: &TransferFunction) -> [f64; 4] {
    tf.validate().expect("valid");
    let (mesh, field) = cube(values);
    let scene = ExactScene::new(&mesh, &field, &Progress::new()).expect("nobody cancels");
    let (eye, target) = (DVec3::new(0.4, 0.3, -2.0), DVec3::new(0.4, 0.3, 1.0));
    let camera = Camera { eye, target, up: DVec3::Y, projection: Projection::Parallel { view_height: 1e-3 } };
    let image = scene
        .render(&camera.frame(mesh.center(), 1, 1), tf, &RenderSettings::new(1, 1).stopping_at(0.0), &Progress::new())
        .expect("nobody cancels");
    image.pixels[0].map(f64::from)
}

/// Grey opacity and colour over x, both from 0 to 1.
fn ramp(scale: Scale) -> TransferFunction {
    TransferFunction {
        color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]],
        opacity: vec![[0.0, 0.0], [1.0, 1.0]],
        unit_distance: Some(0.5),
        scale,
        ..TransferFunction::standard()
    }
}

/// The integral from 0 to 1 by Simpson's rule.
fn integral(f: impl Fn(f64) -> f64) -> f64 {
    const N: u32 = 200_000;
    let at = |i: u32| {
        f(f64::from(i) / f64::from(N))
            * if i == 0 || i == N {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
    };
    (0..=N).map(at).sum::<f64>() / f64::from(3 * N)
}

#[test]
fn the_opacity_of_a_slab_is_that_of_the_scales_integral() {
    for (scale, [lo, hi]) in [
        (Scale::Log, [1.0, 1000.0]),
        (Scale::Log, [1e-3, 2.0]),
        (Scale::Symlog(Some(0.01)), [-2.0, 3.0]),
        (Scale::Symlog(None), [0.0, 5.0]),
        (Scale::Linear, [-1.0, 1.0]),
    ] {
        let alpha = up([lo, hi], &ramp(scale))[3];
        let depth = integral(|z| scale.position([lo, hi], lo + (hi - lo) * z)) / 0.5;
        let expected = 1.0 - (-depth).exp();
        // x is within a thousandth of the scale's, and so is its mean.
        assert!((alpha - expected).abs() < 2e-3 * (-depth).exp() + 1e-6, "{scale:?} over {lo} to {hi}: {alpha}, expected {expected}");
    }
    // The mean of log(s) / log(b) over 1 to b is 1 / (1 - 1/b) - 1 / log(b), in closed form.
    let alpha = up([1.0, 1000.0], &ramp(Scale::Log))[3];
    let mean = 1.0 / (1.0 - 1e-3) - 1.0 / 1000f64.ln();
    assert!((alpha - (1.0 - (-2.0 * mean).exp())).abs() < 1e-3);
    assert!((alpha - up([1.0, 1000.0], &ramp(Scale::Linear))[3]).abs() > 0.05, "a linear scale is another");
}

#[test]
fn octree_and_exact_agree_on_a_log_scale() {
    let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
    let mesh = meshes::sponge(4);
    let field = meshes::point_field(&mesh, |p| (4.0 * p.x).sin() + p.y * p.z);
    let params = OctreeParams { max_depth: 6, tolerance: Some(1e-3), ..OctreeParams::default() };
    let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularized");
    let texture = OctreeTexture::encode(&tree).expect("encoded");
    let (octree, _) = renderer.octree_scene(&mesh, texture, params.surface(&mesh, &field)).expect("a scene");
    let exact = renderer.exact_scene(&mesh, &field, &Progress::new()).expect("a scene");
    let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 1, 1.3);
    let [lo, hi] = field.range;
    let psnr = |tf: TransferFunction| {
        tf.validate().expect("valid");
        let draw = |scene, renderer_kind| {
            let settings = RenderSettings { renderer: renderer_kind, ..RenderSettings::new(48, 48) };
            let view = View { camera, transfer_function: tf.clone(), settings };
            renderer.render(scene, &view, &Progress::new()).expect("drawn").image
        };
        let (octree, exact) = (draw(&octree, RendererKind::Octree), draw(&exact, RendererKind::Exact));
        assert!(exact.pixels.iter().any(|p| p[3] > 0.5), "something is seen");
        octetra::image::psnr(&exact, &octree).1
    };
    let width = hi - lo;
    let standard = TransferFunction { range: Some([lo - 0.1 * width, hi]), ..TransferFunction::standard() };
    let linear = psnr(standard.clone());
    assert!(linear > 55.0, "linear: {linear} dB");
    for (what, tf) in [
        ("symlog", TransferFunction { scale: Scale::Symlog(Some(0.05 * width)), ..standard.clone() }),
        ("steps", TransferFunction { steps: Some(5), ..standard.clone() }),
        (
            "beyond",
            TransferFunction {
                range: Some([lo + 0.3 * width, hi - 0.3 * width]),
                below: Some([1.0, 0.0, 1.0]),
                above: Some([0.0, 1.0, 1.0]),
                ..standard.clone()
            },
        ),
    ] {
        let found = psnr(tf);
        assert!(found > 52.0, "{what}: {found} dB, linear {linear} dB");
    }
    // The field moved above 0, for a logarithm.
    let values = field.values.iter().map(|v| v - lo + 0.05 * width).collect();
    let above = ScalarField::new("s".into(), field.association, values);
    let tree = regularize(&mesh, &above, &params, &Progress::new()).expect("regularized");
    let texture = OctreeTexture::encode(&tree).expect("encoded");
    let (octree, _) = renderer.octree_scene(&mesh, texture, params.surface(&mesh, &above)).expect("a scene");
    let exact = renderer.exact_scene(&mesh, &above, &Progress::new()).expect("a scene");
    let tf = TransferFunction { scale: Scale::Log, ..TransferFunction::standard() };
    let draw = |scene, kind| {
        let view =
            View { camera, transfer_function: tf.clone(), settings: RenderSettings { renderer: kind, ..RenderSettings::new(48, 48) } };
        renderer.render(scene, &view, &Progress::new()).expect("drawn").image
    };
    let log = octetra::image::psnr(&draw(&exact, RendererKind::Exact), &draw(&octree, RendererKind::Octree)).1;
    assert!(log > 52.0, "log: {log} dB, linear {linear} dB");
}

#[test]
fn steps_and_colours_beyond_the_range_are_seen() {
    // Values -1 to 3 through a range of 0 to 2: a quarter of the way below, a half inside, a quarter above.
    let opaque = TransferFunction {
        color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0]],
        opacity: vec![[0.0, 1.0]],
        unit_distance: Some(1.0),
        range: Some([0.0, 2.0]),
        ..TransferFunction::standard()
    };
    let weight = |from: f64, to: f64| (-from).exp() - (-to).exp();
    let beyond = TransferFunction { below: Some([1.0, 0.0, 0.0]), above: Some([0.0, 0.0, 1.0]), ..opaque.clone() };
    let [r, g, b, alpha] = up([-1.0, 3.0], &beyond);
    assert!((r - weight(0.0, 0.25)).abs() < 1e-6 && (b - weight(0.75, 1.0)).abs() < 2e-6 && (alpha - weight(0.0, 1.0)).abs() < 1e-6);
    let inside = g;
    let [r, g, b, same] = up([-1.0, 3.0], &opaque);
    assert!(r == 0.0 && b == 0.0 && (same - alpha).abs() < 1e-6, "opacity is the same");
    assert!((g - inside - weight(0.75, 1.0)).abs() < 2e-6, "the last colour goes on above");
    // Two steps: black, then green.
    let stepped = TransferFunction { steps: Some(2), range: None, ..opaque };
    let [_, g, _, _] = up([-1.0, 3.0], &stepped);
    assert!((g - weight(0.5, 1.0)).abs() < 1e-6, "{g}");
}
