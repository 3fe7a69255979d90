//! Planes: in the panel, and by hand in the picture.

use super::*;
use egui::{Modifiers, Vec2, vec2};
use glam::DVec3;
use octetra::view::{Plane, PlaneUse};

fn plane(window: &Window) -> Plane {
    window.state().planes().iter().next().expect("a plane")
}

fn undo(window: &mut Window) {
    window.run_steps(4); // at rest: a step to undo
    window.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    window.run_steps(4);
}

/// Moves and turns the plane by its arrow, undoing each.
fn by_hand(window: &mut Window, points: f32, turn_by: Vec2) {
    let (camera, before, shown) = (window.state().camera(), plane(window), picture(window));
    let height = f64::from(window.state().picture_size()[1]);
    let at = |p: DVec3| {
        let seen = camera.seen_at(p).expect("before the eye") * height;
        vec2(seen.x as f32, -seen.y as f32)
    };
    let move_by = (at(before.point + before.normal * 0.1) - at(before.point)).normalized() * points;
    drag(window, "move plane 1", move_by);
    let moved = plane(window);
    let along = (moved.point - before.point).dot(before.normal);
    assert!(along.abs() > 0.05, "{moved:?}");
    assert!((moved.point - before.point - before.normal * along).length() < 1e-9 && moved.normal == before.normal, "{moved:?}");
    let slider = window.get_by_label("plane 1 at").accesskit_node().numeric_value().expect("a number");
    let axis = before.normal.abs();
    assert!((slider - moved.point.dot(axis)).abs() < 1e-6, "{slider} in the panel, {moved:?}");
    let way = at(moved.point) - at(before.point);
    assert!((way - move_by).length() < 2.0, "moved by {way}, dragged by {move_by}");
    assert_eq!(window.state().camera(), camera, "the camera stays");
    settle(window);
    assert!(rms(&shown, &picture(window)) > SAME, "the picture follows");
    undo(window);
    assert_eq!(plane(window), before, "one step");

    drag(window, "turn plane 1", turn_by);
    let turned = plane(window);
    assert!(turned.normal.angle_between(before.normal) > 0.2 && (turned.normal.length() - 1.0).abs() < 1e-12, "{turned:?}");
    assert_eq!((turned.point, turned.used), (before.point, before.used));
    let typed = window.get_by_label("plane 1 normal y").accesskit_node().numeric_value().expect("a number");
    assert!((typed - turned.normal.y).abs() < 1e-6);
    assert_eq!(window.state().camera(), camera, "the camera stays");
    undo(window);
    assert_eq!(plane(window), before, "one step");
    settle(window);
}

#[test]
fn planes_are_moved_and_turned_by_their_arrow() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_sized(folder.path(), vec2(760.0, 460.0));
    let camera = window.state().camera();
    window.get_by_label("Add clip").click_accesskit();
    settle(&mut window);
    let Plane { point, normal, used } = plane(&window);
    let [forward, ..] = camera.axes();
    assert!(used == PlaneUse::Clip && point.length() < 1e-9, "through the middle of the ball: {point}");
    assert!(normal.abs().max_element() == 1.0 && normal.dot(forward) == forward.abs().max_element(), "away from the eye: {normal}");

    by_hand(&mut window, 30.0, vec2(-10.0, -40.0));
    window.state_mut().set_camera(camera.switched(30.0));
    settle(&mut window);
    by_hand(&mut window, -25.0, vec2(40.0, 10.0));

    // Normals by buttons, through the same place.
    for (button, expected) in [("plane 1 along z", DVec3::Z), ("flip", DVec3::NEG_Z), ("plane 1 along y", DVec3::Y)] {
        window.get_by_label(button).click_accesskit();
        window.run_steps(2);
        assert_eq!((plane(&window).normal, plane(&window).point), (expected, point), "{button}");
    }

    // Screenshots are without handles, as the window is when they are hidden.
    settle(&mut window);
    let with = picture(&mut window);
    window.get_by_label("Screenshot").click_accesskit();
    settle(&mut window);
    window.get_by_label("handles").click_accesskit();
    settle(&mut window);
    assert!(window.query_by_label("move plane 1").is_none());
    let without = picture(&mut window);
    assert!(rms(&with, &without) > 1.0);
    let saved = image::open(folder.path().join("ball_00.png")).expect("a PNG").into_rgb8();
    let saved: Vec<[u8; 3]> = saved.pixels().map(|pixel| pixel.0).collect();
    assert!(rms(&saved, &without) < SAME, "{}", rms(&saved, &without));

    // Another plane is selected as it is added; its row's name selects the first again, or none.
    window.get_by_label("handles").click_accesskit();
    window.get_by_label("Add cut").click_accesskit();
    window.run_steps(3);
    window.get_by_label("move plane 2");
    window.get_by_label("1 clip").click_accesskit();
    window.run_steps(3);
    assert!(window.query_by_label("move plane 2").is_none());
    window.get_by_label("move plane 1");
    window.get_by_label("1 clip").click_accesskit();
    window.run_steps(3);
    assert!(window.query_by_label("move plane 1").is_none());
}
