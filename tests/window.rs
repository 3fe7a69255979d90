//! Habits of the window: mouse and keys, undo, furniture, background, theme, help. One window serves several checks, for opening one is slow.

use egui::{Modifiers, PointerButton, Pos2, Vec2, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::{DVec2, DVec3};
use octetra::app::keys::{self, Action};
use octetra::app::{Options, Viewer, wgpu_setup};
use octetra::furniture::{Part, Parts};
use octetra::geometry::Aabb;
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Component, FieldSelection, ScalarField, TetMesh, collect};
use octetra::octree::{OctreeParams, Preset, Subject};
use octetra::session::Source;
use octetra::study::ErrorSampling;
use octetra::view::{Camera, Projection, RenderSettings, TransferFunction, View};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

type Window = Harness<'static, Viewer>;

const SIZE: Vec2 = vec2(900.0, 600.0);

/// Seconds of a frame, and frames after which what was changed is a step to undo.
const FRAME_S: f32 = 0.05;
const REST: usize = 9;

fn ball() -> TetMesh {
    collect(&*plan(Shape::Ball, Some(6 * 8 * 8 * 8)).expect("a size that can be made")).expect("a valid mesh")
}

fn world_bounds() -> Aabb {
    let mesh = ball();
    mesh.bounds().translated(mesh.center())
}

fn open(folder: &Path, pixels_per_point: f32) -> Window {
    let mesh = ball();
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a ball has a field");
    let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 0, 1.2);
    let options = Options {
        name: "ball".into(),
        source: Source::default(),
        session: None,
        recent: None,
        subject: Subject::Mesh(Arc::new(mesh), Arc::new(field)),
        component: Component::Magnitude,
        compare_with: None,
        view: View { camera, transfer_function: TransferFunction::standard(), settings: RenderSettings::new(64, 64) },
        params: OctreeParams { max_depth: 4, ..OctreeParams::default() },
        error: ErrorSampling { points: 1 << 10, ..ErrorSampling::default() },
        memory_bytes: 1 << 30,
        device: octetra::render::DeviceChoice::Auto,
        folder: folder.to_owned(),
    };
    let builder = Harness::builder()
        .with_size(SIZE)
        .with_pixels_per_point(pixels_per_point)
        .with_step_dt(FRAME_S)
        .with_render_cursor(false)
        .wgpu_setup(wgpu_setup());
    let mut window = builder.build_eframe(|creation| Viewer::new(creation, options).expect("a window"));
    settle(&mut window);
    window
}

/// Goes on until the picture is the one asked for.
fn settle(window: &mut Window) {
    window.step();
    window.remove_cursor();
    let start = Instant::now();
    loop {
        window.run_steps(2);
        if window.state().is_settled() {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(180), "the window never comes to rest: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The picture's upper left corner and size in points.
fn place(window: &Window) -> (Pos2, Vec2) {
    let [width, height] = window.state().picture_size().map(|n| n as f32 / window.ctx.pixels_per_point());
    (pos2(SIZE.x - width, 0.0), vec2(width, height))
}

/// The picture's bytes in rows.
fn picture(window: &mut Window) -> image::RgbImage {
    let shown = window.render().expect("a frame");
    let [width, height] = window.state().picture_size();
    let (left, _) = (shown.width() - width, height);
    image::imageops::crop_imm(&image::DynamicImage::ImageRgba8(shown).into_rgb8(), left, 0, width, height).to_image()
}

fn press(window: &mut Window, chord: keys::Chord) {
    window.key_press_modifiers(chord.modifiers(), chord.key);
    window.run_steps(3);
}

fn act(window: &mut Window, action: Action) {
    let binding = keys::all().find(|binding| binding.action == action).expect("a key for it");
    press(window, binding.chords[0]);
}

fn same(a: Camera, b: Camera) -> bool {
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1e-9 * (1.0 + a.length());
    near(a.eye, b.eye) && near(a.target, b.target) && near(a.up, b.up) && a.projection == b.projection
}

/// Drags over the picture in one move.
fn drag(window: &mut Window, button: PointerButton, modifiers: Modifiers, [from, to]: [Pos2; 2]) {
    let click = |pos, pressed| egui::Event::PointerButton { pos, button, pressed, modifiers };
    window.event_modifiers(egui::Event::PointerMoved(from), modifiers);
    window.step();
    window.event_modifiers(click(from, true), modifiers);
    window.step();
    for i in 1..=4 {
        window.event_modifiers(egui::Event::PointerMoved(from + (to - from) * (i as f32 / 4.0)), modifiers);
        window.step();
    }
    window.event_modifiers(click(to, false), modifiers);
    window.run_steps(REST);
    window.remove_cursor();
    window.step();
}

#[test]
fn every_key_does_what_the_table_says() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path(), 1.0);
    let start = window.state().camera();
    let bounds = world_bounds();
    for binding in keys::all() {
        for &chord in binding.chords {
            window.state_mut().set_camera(start);
            window.run_steps(REST); // at rest: a step to undo
            let (before, parts, theme) = (window.state().camera(), window.state().parts(), window.ctx.theme());
            let what = format!("{}: {}", chord.name(), binding.text);
            match binding.action {
                // The dialog is the system's; that the key asks for it is tested beside the table.
                Action::Open => continue,
                // With files, in tests/sessions.rs.
                Action::Reload | Action::OpenSession | Action::SaveSession => continue,
                // Prepared below, in tests of their own.
                Action::UndoSettings | Action::RedoSettings | Action::UndoCamera | Action::RedoCamera => continue,
                Action::PasteCamera => continue,
                Action::Start => window.state_mut().set_camera(start.rolled(1.0).advanced(1.0)),
                Action::Fit => window.state_mut().set_camera(start.panned(DVec2::X)),
                _ => {}
            }
            press(&mut window, chord);
            let after = window.state().camera();
            let [forward, right, up] = after.axes();
            match binding.action {
                Action::Screenshot => {
                    settle(&mut window);
                    assert!(window.state().status().ends_with("ball_00.png") && folder.path().join("ball_00.png").exists(), "{what}");
                }
                Action::Flip => {
                    settle(&mut window);
                    let exact = window.get_by_label("exact").accesskit_node().toggled();
                    assert_eq!(exact, Some(egui::accesskit::Toggled::True), "{what}");
                    press(&mut window, chord);
                }
                Action::Probe => {
                    assert!(window.state().is_probing(), "{what}");
                    press(&mut window, chord);
                    assert!(!window.state().is_probing(), "{what}");
                    settle(&mut window); // what it began ends
                }
                Action::Wipe => {
                    assert!(window.state().is_comparing(), "{what}");
                    press(&mut window, chord);
                    assert!(!window.state().is_comparing(), "{what}");
                }
                Action::Show(part) => {
                    assert_eq!(window.state().parts(), parts.with(part, !parts.has(part)), "{what}");
                    press(&mut window, chord);
                    assert_eq!(window.state().parts(), parts, "{what}");
                }
                Action::Theme => {
                    assert_ne!(window.ctx.theme(), theme, "{what}");
                    press(&mut window, chord);
                    assert_eq!(window.ctx.theme(), theme, "{what}");
                }
                Action::Help => {
                    window.get_by_label("Keys and mouse");
                    press(&mut window, chord);
                    assert!(window.query_by_label("Keys and mouse").is_none(), "{what}");
                }
                // With a series, in tests/app/time.rs.
                Action::Play | Action::PreviousStep | Action::NextStep => {
                    assert!(window.state().status().contains("no series"), "{what}: {}", window.state().status());
                }
                Action::Fit => {
                    assert!(after.target.distance(bounds.center()) < 1e-9 && forward.distance(before.axes()[0]) < 1e-9, "{what}")
                }
                Action::Start => assert!(same(after, start), "{what}"),
                Action::Face(axis) => {
                    let expected = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z][axis];
                    assert!(
                        forward.distance(expected) < 1e-9 && binding.text.ends_with(["+x", "-x", "+y", "-y", "+z", "-z"][axis]),
                        "{what}"
                    );
                }
                Action::Isometric => {
                    let shortened = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| DVec2::new(axis.dot(right), axis.dot(up)).length());
                    assert!(shortened.iter().all(|length| (length - (2.0f64 / 3.0).sqrt()).abs() < 1e-9), "{what}: {shortened:?}");
                }
                Action::Projection => {
                    assert!(matches!(after.projection, Projection::Parallel { .. }), "{what}");
                    assert!((after.view_height() - before.view_height()).abs() < 1e-9, "{what}");
                    press(&mut window, chord);
                    assert!(same(window.state().camera(), before), "{what}, and back");
                }
                Action::Turn(x, y) => {
                    // What lies before the target goes the way that is named.
                    let moved = after.seen_at(before.target - before.axes()[0] * 0.1).expect("seen");
                    assert!(moved.dot(DVec2::new(x, y)) > 0.0 && moved.perp_dot(DVec2::new(x, y).normalize()).abs() < 1e-9, "{what}");
                    let angle = before.axes()[0].angle_between(forward).to_degrees();
                    assert!((angle - 15.0).abs() < 1e-6, "{what}: {angle}");
                }
                Action::Roll(degrees) => {
                    let seen = after.seen_at(before.target + before.axes()[2]).expect("seen");
                    assert!(((-seen.x).atan2(seen.y).to_degrees() - degrees).abs() < 1e-6, "{what}");
                }
                Action::Zoom(factor) => assert!((before.view_height() / after.view_height() - factor).abs() < 1e-9, "{what}"),
                Action::Advance(share) => {
                    let ahead = (after.eye - before.eye).dot(forward) / bounds.diagonal();
                    assert!(
                        (ahead - share).abs() < 1e-9
                            && (after.eye.distance(after.target) - before.eye.distance(before.target)).abs() < 1e-9
                    );
                }
                Action::CopyCamera => {
                    assert!(window.state().status().contains("clipboard"), "{what}: {}", window.state().status());
                    window.event(egui::Event::Copy); // as systems say it
                    window.step();
                    let text = |command: &egui::OutputCommand| match command {
                        egui::OutputCommand::CopyText(text) => Some(text.clone()),
                        _ => None,
                    };
                    let copied = window.output().platform_output.commands.iter().find_map(text).expect("a text");
                    assert_eq!(serde_json::from_str::<Camera>(&copied).expect("a camera"), after, "{what}");
                }
                Action::Open
                | Action::Reload
                | Action::OpenSession
                | Action::SaveSession
                | Action::UndoSettings
                | Action::RedoSettings
                | Action::UndoCamera
                | Action::RedoCamera
                | Action::PasteCamera => {
                    unreachable!("left out above")
                }
            }
        }
    }

    // A camera through the clipboard, and what is none.
    let camera = start.rolled(0.5).panned(DVec2::new(0.1, 0.2));
    window.event(egui::Event::Paste(serde_json::to_string(&camera).expect("JSON")));
    window.run_steps(2);
    assert_eq!(window.state().camera(), camera, "to the last bit");
    window.event(egui::Event::Paste("{\"eye\": [0, 0, 1]}".into()));
    window.run_steps(2);
    assert_eq!(window.state().camera(), camera);
    assert!(window.state().status().contains("not a camera"), "{}", window.state().status());
}

#[test]
fn drags_are_paraviews_and_single_steps_to_undo() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path(), 1.0);
    let start = window.state().camera();
    let (corner, size) = place(&window);
    let middle = corner + size / 2.0;
    let seen = |window: &Window, point: DVec3| {
        let seen = window.state().camera().seen_at(point).expect("seen") * f64::from(size.y);
        middle + vec2(seen.x as f32, -seen.y as f32)
    };
    let ends = [middle + vec2(90.0, 40.0), middle + vec2(60.0, -50.0)];
    let (none, shift, ctrl) = (Modifiers::NONE, Modifiers::SHIFT, Modifiers { ctrl: true, command: true, ..Modifiers::NONE });
    let under = |at: Pos2| {
        let (origin, direction) = start.ray_at(DVec2::new(f64::from(at.x - middle.x), -f64::from(at.y - middle.y)) / f64::from(size.y));
        origin + direction * ((start.target - origin).dot(start.axes()[0]) / direction.dot(start.axes()[0]))
    };
    let held = under(ends[0]); // at the target's depth
    let steps = [
        (PointerButton::Primary, none, "rotate"),
        (PointerButton::Middle, shift, "rotate"),
        (PointerButton::Middle, ctrl, "rotate"),
        (PointerButton::Primary, ctrl, "rotate"),
        (PointerButton::Middle, none, "pan"),
        (PointerButton::Secondary, shift, "pan"),
        (PointerButton::Secondary, none, "zoom"),
        (PointerButton::Secondary, ctrl, "zoom to"),
        (PointerButton::Primary, shift, "roll"),
    ];
    for (button, modifiers, what) in steps {
        drag(&mut window, button, modifiers, ends);
        let after = window.state().camera();
        assert!(!same(after, start), "{button:?} {modifiers:?}");
        let (kept, distance) =
            (after.target.distance(start.target) < 1e-9, after.eye.distance(after.target) / start.eye.distance(start.target));
        let parallel = after.axes()[0].distance(start.axes()[0]) < 1e-9;
        match what {
            "rotate" => assert!(kept && !parallel && (distance - 1.0).abs() < 1e-9, "{button:?} {modifiers:?} rotates"),
            "pan" => assert!(seen(&window, held).distance(ends[1]) < 0.01 && parallel, "{button:?} {modifiers:?} pans"),
            "zoom" => assert!(kept && distance > 1.1 && parallel, "{button:?} {modifiers:?} zooms: up goes away"),
            "zoom to" => assert!(!kept && distance > 1.1 && parallel && seen(&window, held).distance(ends[0]) < 0.01, "to the pointer"),
            _ => {
                let turned = (ends[0] - middle).angle() - (ends[1] - middle).angle();
                assert!(kept && parallel, "rolls");
                assert!((start.axes()[2].angle_between(after.axes()[2]) - f64::from(turned)).abs() < 1e-3, "by {turned}");
            }
        }
        act(&mut window, Action::UndoCamera);
        assert!(same(window.state().camera(), start), "one step back: {button:?} {modifiers:?}");
        act(&mut window, Action::RedoCamera);
        assert!(same(window.state().camera(), after));
        act(&mut window, Action::UndoCamera);
    }
    // At the rim Ctrl+left rolls.
    let rim = middle + vec2(0.47 * size.x, 0.0);
    drag(&mut window, PointerButton::Primary, ctrl, [rim, rim - vec2(0.0, 120.0)]);
    assert!(window.state().camera().axes()[0].distance(start.axes()[0]) < 1e-9 && !same(window.state().camera(), start));
    act(&mut window, Action::UndoCamera);

    // A double click makes the place of the surface that is seen there the centre: on a ball of radius 1 around its middle.
    let at = middle + vec2(50.0, 20.0);
    window.event(egui::Event::PointerMoved(at));
    for pressed in [true, false, true, false] {
        window.event(egui::Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers: none });
    }
    window.run_steps(3);
    let centred = window.state().camera();
    let bounds = world_bounds();
    let radius = centred.target.distance(bounds.center()) / (bounds.size().x / 2.0);
    assert!((0.9..=1.001).contains(&radius), "on the ball: {radius}");
    assert!(centred.target.distance(centred.eye) < start.target.distance(start.eye), "on the near side");
    let (origin, direction) = start.ray_at(DVec2::new(50.0, -20.0) / f64::from(size.y));
    assert!((centred.target - origin).cross(direction).length() < 1e-4, "under the pointer");

    // Wheel: through the ball and out behind it.
    window.event(egui::Event::PointerMoved(middle));
    for _ in 0..80 {
        window.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: vec2(0.0, 120.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
            modifiers: none,
        });
        window.step();
    }
    let through = window.state().camera();
    assert!((through.eye - bounds.center()).dot(centred.axes()[0]) > bounds.size().x / 2.0, "behind the ball");

    // Settings have their own past.
    window.get_by_label("fast").click_accesskit();
    window.run_steps(REST);
    window.get_by_label("fine").click_accesskit();
    window.run_steps(REST);
    let camera = window.state().camera();
    act(&mut window, Action::UndoSettings);
    assert_eq!(*window.state().params(), Preset::Fast.params());
    act(&mut window, Action::UndoSettings);
    assert_eq!(*window.state().params(), OctreeParams { max_depth: 4, ..OctreeParams::default() });
    for chord in keys::all().find(|binding| binding.action == Action::RedoSettings).expect("a key").chords {
        press(&mut window, *chord);
    }
    assert_ne!(*window.state().params(), Preset::Fast.params(), "both ways to redo");
    assert!(same(window.state().camera(), camera), "the camera stays");
}

#[test]
fn furniture_and_background_are_in_the_window_and_in_its_screenshot() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for scale in [1u32, 2] {
        let mut window = open(folder.path(), scale as f32);
        assert_eq!(window.state().parts(), Parts::OPENING);
        let (_, size) = place(&window);
        assert_eq!(window.state().picture_size()[1], (size.y * scale as f32) as u32);
        let with = picture(&mut window);
        // The bar's upper end has the last knot's colour: 23 points from the right side, half the height, in points of any size.
        let height = (0.5 * size.y).clamp(60.0, 320.0);
        let pixel = |x: f32, y: f32| [(x * scale as f32) as u32, (y * scale as f32) as u32];
        let at = |picture: &image::RgbImage, [x, y]: [u32; 2]| picture.get_pixel(x, y).0;
        let top = pixel(size.x - 23.0, size.y / 2.0 - height / 2.0 + 3.0);
        let [r, g, b] = at(&with, top);
        assert!(r > 220 && g < 40 && b < 30, "{:?}", at(&with, top));
        if scale == 1 {
            for part in [Part::Bar, Part::Axes, Part::Time] {
                act(&mut window, Action::Show(part));
            }
            let without = picture(&mut window);
            assert_eq!(at(&without, top), [0; 3]);
            act(&mut window, Action::Show(Part::Bounds));
            let boxed = picture(&mut window);
            let changed = without.pixels().zip(boxed.pixels()).filter(|(a, b)| a != b).count();
            assert!(changed > 1000, "edges and ticks: {changed} pixels");
            act(&mut window, Action::Show(Part::Bar));
        }

        window.get_by_label("white").click_accesskit();
        settle(&mut window);
        let white = picture(&mut window);
        assert_eq!(at(&white, pixel(size.x / 2.0, 3.0)), [255; 3]);
        let middle = pixel(size.x / 2.0, size.y / 2.0);
        assert!((0..3).all(|c| at(&white, middle)[c] >= at(&with, middle)[c]), "white shines through the volume");

        act(&mut window, Action::Screenshot);
        settle(&mut window);
        act(&mut window, Action::Show(Part::Time)); // files have none
        if scale == 2 {
            act(&mut window, Action::Show(Part::Axes));
            act(&mut window, Action::Show(Part::Axes));
        }
        let name = format!("ball_0{}.png", scale - 1);
        let saved = image::open(folder.path().join(&name)).expect("a PNG").into_rgb8();
        if scale == 1 {
            act(&mut window, Action::Show(Part::Time));
        }
        let shown = picture(&mut window);
        assert_eq!(saved.dimensions(), shown.dimensions());
        // Two painters: the same but for the smoothing of edges and the shape of letters.
        let differ = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 60);
        let share = saved.pixels().zip(shown.pixels()).filter(differ).count() as f64 / (saved.width() * saved.height()) as f64;
        assert!(share < 0.01, "scale {scale}: {share} of the pixels differ");
        for (place, what) in [(middle, "the volume"), (top, "the bar")] {
            let (saved, shown) = (at(&saved, place), at(&shown, place));
            assert!(
                (0..3).all(|c| saved[c].abs_diff(shown[c]) <= 3),
                "scale {scale}: {what} is {saved:?} in the file, {shown:?} in the window"
            );
        }
    }
}
