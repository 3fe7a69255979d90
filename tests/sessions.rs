//! Sessions, files and turntables in the window, without a display, and that the command draws what the window shows.

mod program;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use octetra::app::{Options, PictureSize, Pin, Viewer, wgpu_setup};
use octetra::format;
use octetra::furniture::{Part, Parts};
use octetra::mesh::{Component, FieldSelection, ScalarField};
use octetra::octree::{OctreeParams, Subject};
use octetra::progress::Progress;
use octetra::session::{Session, Source};
use octetra::study::ErrorSampling;
use octetra::view::{Camera, RenderSettings, TransferFunction, View};
use program::done;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

type Window = Harness<'static, Viewer>;

/// A window on the ball of a file.
fn open(folder: &Path, recent: &Path) -> Window {
    let file = folder.join("ball.vtu");
    let mesh = format::read_mesh(&file, &Progress::new()).expect("a mesh");
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a ball has a field");
    let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 0, 1.2);
    let options = Options {
        name: "ball".into(),
        source: Source::file(&file),
        session: None,
        recent: Some(recent.to_owned()),
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
    let builder = Harness::builder().with_size([640.0, 480.0]).with_render_cursor(false).wgpu_setup(wgpu_setup());
    let mut window = builder.build_eframe(|creation| Viewer::new(creation, options).expect("a window"));
    settle(&mut window);
    window
}

/// Goes on until nothing is on its way.
fn settle(window: &mut Window) {
    let start = Instant::now();
    window.run_steps(2);
    while !window.state().is_settled() {
        window.run_steps(2);
        assert!(start.elapsed() < Duration::from_secs(200), "the window never comes to rest: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn screenshot(window: &mut Window) -> Vec<u8> {
    window.get_by_label("Screenshot").click_accesskit();
    settle(window);
    let said = window.state().status().to_owned();
    std::fs::read(said.strip_prefix("wrote ").unwrap_or_else(|| panic!("{said}"))).expect("a picture")
}

/// A file dropped on the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

fn drop_file(window: &mut Window, path: &Path) {
    window.input_mut().dropped_files.push(Arc::new(Dropped(path.to_owned())));
    window.step();
    window.input_mut().dropped_files.clear();
    settle(window);
}

fn nodes(window: &Window) -> usize {
    window.state().octree_numbers().expect("an octree").nodes
}

/// Goes on until the pin has values.
fn wait_for_pin(window: &mut Window) -> Pin {
    let start = Instant::now();
    loop {
        window.run_steps(2);
        if let Some(pin) = window.state().pins().first().filter(|pin| pin.sample.is_some()) {
            return pin.clone();
        }
        assert!(start.elapsed() < Duration::from_secs(180), "the pin is never read: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Pins what is seen in the middle of the picture.
fn pin_the_middle(window: &mut Window) -> Pin {
    window.key_press(egui::Key::P);
    window.step();
    let [width, height] = window.state().picture_size().map(|side| side as f32);
    let middle = egui::pos2(640.0 - width / 2.0, height / 2.0);
    let start = Instant::now();
    while window.state().pins().is_empty() {
        window.hover_at(middle);
        window.step();
        window.drag_at(middle);
        window.step();
        window.drop_at(middle);
        window.run_steps(2);
        assert!(start.elapsed() < Duration::from_secs(180), "a click does nothing: {}", window.state().status());
    }
    let pin = wait_for_pin(window);
    window.key_press(egui::Key::P);
    window.remove_cursor();
    window.run_steps(2);
    pin
}

#[test]
fn sessions_files_and_turntables() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path();
    let recent = folder.join("settings/recent.json");
    done(folder, &["generate", "ball", "--tets", "3000", "-o", "ball.vtu"]);
    let mut window = open(folder, &recent);

    // A session stands for the picture: in the command, and opened again in the window.
    let first = window.state().camera();
    let window_size = window.state().picture_size();
    let size = |session: Session| [session.render.width, session.render.height];
    assert_eq!(size(window.state().session()), window_size, "pictures are as large as in the window unless told otherwise");
    let camera = first.rolled(0.3).rotated(0.4, -0.2);
    window.state_mut().set_camera(camera);
    window.state_mut().set_parts(Parts::of(&[Part::Bar, Part::Axes, Part::Bounds]));
    window.state_mut().set_picture_size(PictureSize::Own([210, 150]));
    settle(&mut window);
    let (shown, built) = (screenshot(&mut window), nodes(&window));
    let ctx = window.ctx.clone();
    window.state_mut().save_session(&ctx, folder.join("seen.json"));
    settle(&mut window);
    assert!(window.state().status().ends_with("seen.json"), "{}", window.state().status());
    let written = std::fs::read_to_string(folder.join("seen.json")).expect("a session");
    assert!(written.contains(r#""file": "ball.vtu""#), "the path is as seen from the session: {written}");
    done(folder, &["render", "--session", "seen.json", "-o", "command.png"]);
    assert!(std::fs::read(folder.join("command.png")).expect("a picture") == shown, "the command draws what the window does");

    window.state_mut().set_camera(first);
    window.state_mut().set_parts(Parts::NONE);
    window.state_mut().set_params(OctreeParams { max_depth: 3, ..OctreeParams::default() });
    window.state_mut().set_picture_size(PictureSize::Times(2));
    settle(&mut window);
    assert!(nodes(&window) < built);
    let large = image::load_from_memory(&screenshot(&mut window)).expect("a PNG");
    assert_eq!([large.width(), large.height()], window.state().picture_size().map(|side| 2 * side));
    drop_file(&mut window, &folder.join("seen.json"));
    assert_eq!((window.state().camera(), nodes(&window)), (camera, built));
    assert!(screenshot(&mut window) == shown, "the picture of the session");
    assert_eq!(Session { data: Source::default(), ..window.state().session() }, {
        let read = Session::read(&folder.join("seen.json")).expect("a session");
        Session { data: Source::default(), ..read }
    });

    // A dialog that is given up leaves alone what is being read.
    window.input_mut().dropped_files.push(Arc::new(Dropped(folder.join("seen.json"))));
    window.state_mut().set_camera(first);
    window.step();
    window.input_mut().dropped_files.clear();
    window.state_mut().open_chosen(&ctx, async { None });
    settle(&mut window);
    assert_eq!(window.state().camera(), camera, "the session is open");

    // The file changes and is read again; marks and what can be undone stay. What cannot be read leaves everything as it is.
    let before = pin_the_middle(&mut window);
    let params = window.state().params().clone();
    window.state_mut().set_params(OctreeParams { max_depth: 3, ..OctreeParams::default() });
    settle(&mut window);
    window.run_steps(4); // at rest: a step to undo
    done(folder, &["generate", "ball", "--tets", "400", "-o", "ball.vtu"]);
    window.key_press(egui::Key::F5);
    settle(&mut window);
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    settle(&mut window);
    assert_eq!(*window.state().params(), params, "undone");
    let after = wait_for_pin(&mut window);
    assert!(after.at == before.at && after.sample != before.sample, "read anew: {after:?}, before {before:?}");
    assert!(nodes(&window) != built && window.state().status().contains("again"), "{}", window.state().status());
    assert_eq!(window.state().camera(), camera);
    let built = nodes(&window);
    let whole = std::fs::read(folder.join("ball.vtu")).expect("a mesh");
    std::fs::write(folder.join("ball.vtu"), &whole[..whole.len() / 2]).expect("written");
    window.key_press(egui::Key::F5);
    settle(&mut window);
    window.get_by_label_contains("ball is still open");
    assert_eq!((nodes(&window), window.state().camera()), (built, camera));
    window.get_by_label("Close").click_accesskit();
    window.run_steps(2);
    assert!(window.query_by_label_contains("is still open").is_none());
    std::fs::write(folder.join("ball.vtu"), &whole).expect("written");
    std::fs::write(folder.join("odd.json"), r#"{"octetra_session": 1, "render": {"bright": 1}}"#).expect("written");
    drop_file(&mut window, &folder.join("odd.json"));
    assert!(window.query_all_by_label_contains("render.bright").count() > 0, "the key is named");
    window.key_press(egui::Key::Escape);
    window.run_steps(2);

    // Recent files: the last one first; one that is missing says so and takes nothing away.
    std::fs::rename(folder.join("seen.json"), folder.join("moved.json")).expect("moved");
    window.get_by_label("Recent").click_accesskit();
    let start = Instant::now();
    while window.query_by_label("seen.json (missing)").is_none() {
        window.run_steps(2);
        assert!(start.elapsed() < Duration::from_secs(60), "the menu never says what is missing");
    }
    window.get_by_label("ball.vtu");
    window.get_by_label("seen.json (missing)").click_accesskit();
    window.run_steps(2);
    settle(&mut window);
    window.get_by_label_contains("ball is still open");
    assert_eq!(nodes(&window), built);
    window.key_press(egui::Key::Escape);
    let kept = std::fs::read_to_string(&recent).expect("the list is kept");
    assert!(kept.find("seen.json") < kept.find("ball.vtu") && !kept.contains("odd.json"), "{kept}");

    // A turntable begins with the picture, without its back if so told.
    window.get_by_label("Transparent").click_accesskit();
    let first = screenshot(&mut window);
    assert!(image::load_from_memory(&first).expect("a PNG").color().has_alpha());
    window.get_by_label("Turntable...").click_accesskit();
    window.run_steps(2);
    window.get_by_label("Into folder...");
    let turn = folder.join("turn");
    std::fs::create_dir(&turn).expect("a folder");
    let ctx = window.ctx.clone();
    for _ in 0..2 {
        window.state_mut().save_turntable(&ctx, 3, turn.clone());
        settle(&mut window);
    }
    let mut names: Vec<String> =
        std::fs::read_dir(&turn).expect("a folder").flatten().map(|e| e.file_name().to_string_lossy().into()).collect();
    names.sort();
    assert_eq!(names, [1, 2].map(|turn| [0, 1, 2].map(|n| format!("ball_turn{turn}_{n}.png"))).as_flattened());
    let pictures = [0, 1, 2].map(|n| std::fs::read(turn.join(format!("ball_turn1_{n}.png"))).expect("a picture"));
    assert!(pictures[0] == first && pictures[1] != first && pictures[2] != pictures[1]);
}
