//! The window for a volume of bricks as a user meets it, without a display.

#[path = "slices/made_up.rs"]
mod made_up;

use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use made_up::MadeUp;
use octetra::app::store::{StoreOptions, StoreWindow};
use octetra::app::wgpu_setup;
use std::sync::Arc;
use std::time::{Duration, Instant};

const DIMS: [u32; 3] = [330, 260, 210];

/// Layers that dip, with a body of no data; coarse levels have the value at the middle of what they stand for.
fn value(level: u8, voxel: [u32; 3]) -> f32 {
    let size = (1u32 << level) as f32;
    let [x, y, z] = voxel.map(|v| (v as f32 + 0.5) * size - 0.5);
    let [dx, dy, dz] = [x - 240.0, y - 70.0, z - 60.0];
    if dx * dx + dy * dy + dz * dz < 900.0 {
        return f32::NAN;
    }
    let fold = 12.0 * (x / 60.0).sin() + 9.0 * (y / 45.0).cos();
    ((z + fold + 0.1 * x) / 7.0).sin() * (0.4 + 0.6 * (z / 210.0)) + 0.2 * ((z + fold) / 2.3).sin()
}

type Window = Harness<'static, StoreWindow>;

fn open(source: MadeUp, memory_bytes: u64) -> Window {
    let options = StoreOptions { name: "survey".into(), source: Arc::new(source), memory_bytes, gpu_bytes: None, transfer_function: None };
    let builder = Harness::builder().with_size(egui::vec2(1280.0, 800.0)).with_render_cursor(false).wgpu_setup(wgpu_setup());
    builder.build_eframe(|creation| StoreWindow::new(creation, options).expect("a window"))
}

fn settle(window: &mut Window) {
    window.step();
    let start = Instant::now();
    loop {
        window.step();
        if window.state().is_settled() {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "it never comes to rest: {:?}", window.state().progress());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn positions(window: &Window) -> Vec<f64> {
    window.state().cuts().iter().map(|cut| cut.position).collect()
}

/// Drags what has this name by so many points.
fn drag(window: &mut Window, name: &str, by: egui::Vec2) {
    let from = window.get_by_label(name).rect().center();
    drag_from(window, from, by);
}

fn drag_from(window: &mut Window, from: egui::Pos2, by: egui::Vec2) {
    window.hover_at(from);
    window.step();
    window.drag_at(from);
    window.step();
    for part in [0.5, 1.0] {
        window.hover_at(from + by * part);
        window.step();
    }
    window.drop_at(from + by);
    window.step();
}

/// Types a number where one is shown.
fn type_number(window: &mut Window, name: &str, text: &str) {
    window.get_by_label(name).click();
    window.run_steps(3);
    window.event(egui::Event::Text(text.to_owned()));
    window.step();
    window.key_press(egui::Key::Enter);
    window.run_steps(2);
}

fn scroll(window: &mut Window, at: egui::Pos2, by: f32) {
    window.hover_at(at);
    window.step();
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, by),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: egui::Modifiers::NONE,
    });
    window.run_steps(40);
}

fn save(window: &mut Window, name: &str) {
    let Some(folder) = std::env::var_os("OCTETRA_PICTURES") else { return };
    window.render().expect("a frame").save(std::path::Path::new(&folder).join(name)).expect("written");
}

#[test]
fn slices_are_moved_in_every_way_and_refined_at_rest() {
    let mut window = open(MadeUp::new(DIMS, DVec3::new(12.5, 12.5, 8.0), [-1.3, 1.3], value), 512 << 20);
    settle(&mut window);
    save(&mut window, "opened.png");
    assert_eq!(positions(&window), [105.0, 130.0, 165.0], "z, y and x in the middle");
    assert_eq!((window.state().finest(), window.state().progress().left), (0, 0), "voxels are larger than pixels");

    // The value under the pointer is that of the voxel, from the finest level.
    let flat = window.get_by_role_and_label(Role::Image, "slice z").rect();
    for by in [egui::vec2(-80.0, 33.0), egui::vec2(110.0, -41.0)] {
        window.hover_at(flat.center() + by);
        settle(&mut window);
        let probed = window.state().probed().expect("inside");
        assert_eq!(probed.index[2], 105);
        let expected = value(0, probed.index);
        assert_eq!(probed.value, Some((Some(f64::from(expected)), 0)), "{probed:?}");
        let world = DVec3::new(1000.0, 2000.0, 0.0) + DVec3::from(probed.index.map(f64::from)) * DVec3::new(12.5, 12.5, 8.0);
        assert_eq!(probed.world, world);
    }

    // Numbers, lines, handles, wheel and keys.
    type_number(&mut window, "position of z", "60");
    assert_eq!(positions(&window)[0], 60.0);
    window.get_by_role_and_label(Role::Slider, "slice z").focus();
    window.step();
    window.key_press(egui::Key::ArrowRight);
    window.step();
    assert_eq!(positions(&window)[0], 61.0);
    let before = positions(&window);
    drag(&mut window, "line x in z", egui::vec2(40.0, 0.0));
    let after = positions(&window);
    assert!(after[2] > before[2] + 10.0 && after[..2] == before[..2], "{before:?} {after:?}");
    drag(&mut window, "line y in z", egui::vec2(0.0, 30.0));
    let before = positions(&window);
    assert!(before[1] < 125.0, "down is back along y: {before:?}");
    // The line itself, away from its knob.
    let x_line = window.get_by_label("line x in z").rect().center().x;
    drag_from(&mut window, egui::pos2(x_line, flat.bottom() - 30.0), egui::vec2(-25.0, 0.0));
    assert!(positions(&window)[2] < before[2] - 5.0, "{before:?} {:?}", positions(&window));
    let before = positions(&window);
    drag(&mut window, "move z", egui::vec2(0.0, -30.0));
    assert!(positions(&window)[0] > before[0] + 3.0, "up in space: {before:?} {:?}", positions(&window));
    let before = positions(&window);
    scroll(&mut window, flat.center() + egui::vec2(20.0, 20.0), 120.0);
    assert_eq!(positions(&window)[0], before[0] + 3.0, "three notches");
    settle(&mut window);
    save(&mut window, "moved.png");

    oblique_slices(&mut window);
    tints(&mut window);
    playing(&mut window);
}

fn oblique_slices(window: &mut Window) {
    window.get_by_label("+ oblique").click();
    settle(window);
    assert_eq!((window.state().cuts().len(), window.state().selected()), (4, 3));
    save(window, "oblique.png");
    type_number(window, "normal x", "0");
    type_number(window, "normal y", "1");
    type_number(window, "normal z", "1");
    let normal = window.state().cuts()[3].normal;
    assert!(normal.distance(DVec3::new(0.0, 1.0, 1.0).normalize()) < 1e-9, "{normal}");
    drag(window, "turn oblique", egui::vec2(25.0, 5.0));
    let turned = window.state().cuts()[3].normal;
    assert!(turned.distance(normal) > 0.05, "{turned}");
    window.get_by_label("remove oblique").click();
    window.run_steps(2);
    assert_eq!(window.state().cuts().len(), 3);
}

fn tints(window: &mut Window) {
    settle(window);
    let at = window.get_by_role_and_label(Role::Image, "slice z").rect().center() + egui::vec2(-60.0, 50.0);
    let color = |window: &mut Window| window.render().expect("a frame").get_pixel(at.x as u32, at.y as u32).0;
    let before = color(window);
    window.get_by_label("Tint levels").click();
    window.hover_at(egui::pos2(1270.0, 795.0));
    settle(window);
    save(window, "tinted.png");
    // Green by 45 %: level 0.
    let expected = [0.1, 0.75, 0.3].map(|v: f32| v * 255.0 * 0.45);
    let after = color(window);
    for i in 0..3 {
        assert!((f32::from(after[i]) - (f32::from(before[i]) * 0.55 + expected[i])).abs() < 3.0, "{before:?} {after:?}");
    }
    window.get_by_label("Tint levels").click();
    settle(window);
}

fn playing(window: &mut Window) {
    let number = window.state().selected();
    let before = positions(window)[number];
    let name = window.state().cuts()[number].name();
    window.get_by_label(&format!("Play {name}")).click();
    window.step();
    let start = Instant::now();
    while positions(window)[number] == before {
        assert!(window.state().is_playing() && start.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
        window.step();
    }
    window.get_by_label("Stop").click();
    settle(window);
    assert!(!window.state().is_playing());
    // One picture has all the room, and gives it back.
    window.get_by_label("enlarge space").click();
    settle(window);
    save(window, "space.png");
    assert!(window.query_by_role_and_label(Role::Image, "slice z").is_none());
    window.key_press(egui::Key::Escape);
    window.run_steps(2);
    assert!(window.get_by_role_and_label(Role::Image, "slice z").rect().width() < 600.0);
}
