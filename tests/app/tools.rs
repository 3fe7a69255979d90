//! The window's tools: probe, comparison, leaves, the chart of settings.

use super::*;
use octetra::app::Pin;

/// Where a part of the picture is in the window; it lies in the upper right corner.
fn place(window: &Window, x: f32, y: f32) -> egui::Pos2 {
    let [width, height] = window.state().picture_size().map(|n| n as f32);
    egui::pos2(SIZE.x - width + x * width, y * height)
}

/// Goes on, the pointer where it is, until something is there.
pub fn wait_for<T>(window: &mut Window, what: &str, found: impl Fn(&Viewer) -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        window.step();
        if let Some(found) = found(window.state()) {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(180), "{what}: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Clicks at a part of the picture until `is_done`: values cannot be read at once.
fn click_at(window: &mut Window, [x, y]: [f32; 2], is_done: impl Fn(&Viewer) -> bool) {
    let start = Instant::now();
    while !is_done(window.state()) {
        let at = place(window, x, y);
        window.hover_at(at);
        window.step();
        window.drag_at(at);
        window.step();
        window.drop_at(at);
        window.step();
        window.step();
        assert!(start.elapsed() < Duration::from_secs(180), "a click does nothing: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_probe_pins_labels_and_plots_a_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = picture(&mut window);
    window.key_press(egui::Key::P);
    window.step();
    click_at(&mut window, [0.5, 0.5], |viewer| viewer.pins().len() == 1);
    let pin: Pin = wait_for(&mut window, "the pin has values", |viewer| viewer.pins().first().filter(|pin| pin.sample.is_some()).cloned());
    let sample = pin.sample.expect("waited for");
    let (own, octree) = (sample.own.expect("on the ball"), sample.octree.expect("in the octree"));
    // The field is the distance from the centre, linear in tets: a little more inside them.
    assert!((own - pin.at.length()).abs() < 0.05 && (octree - own).abs() < 0.05, "{sample:?}");
    assert!(sample.cell.is_some_and(|cell| cell.shape == "tetrahedron") && sample.leaf.is_some_and(|leaf| leaf.depth <= 5));
    window.get_by_label_contains("1  ");
    window.get_by_label("x").click_accesskit();
    window.step();
    assert!(window.state().pins().is_empty());

    window.get_by_label("line").click_accesskit();
    window.step();
    click_at(&mut window, [0.35, 0.5], |viewer| viewer.probe_ends() == 1);
    click_at(&mut window, [0.65, 0.45], |viewer| viewer.probe_ends() == 2);
    let profile = wait_for(&mut window, "the line is read", |viewer| viewer.profile_samples().cloned());
    assert_eq!(profile.samples.len(), 1001);
    let [a, b] = [0, 1000].map(|i: usize| profile.samples[i].at);
    assert!((profile.arc_length[1000] - a.distance(b)).abs() < 1e-12 && a.distance(b) > 0.2);
    assert!(profile.samples[500].own.is_some_and(|own| (own - ((a + b) / 2.0).length()).abs() < 0.05));
    window.step();
    window.get_by_label("Export CSV").click_accesskit();
    settle(&mut window);
    assert!(window.state().status().ends_with("ball_line_00.csv"), "{}", window.state().status());
    let written = std::fs::read_to_string(folder.path().join("ball_line_00.csv")).expect("a file");
    assert!(written.starts_with("arc_length,x,y,z,data,octree,difference") && written.lines().count() == 1002);

    window.get_by_label("Close").click_accesskit();
    window.key_press(egui::Key::P);
    settle(&mut window);
    assert!(rms(&before, &picture(&mut window)) < SAME, "all marks are gone");
}

#[test]
fn the_probe_says_what_of_a_number_it_points_at() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.key_press(egui::Key::P);
    window.step();
    let mut modes = vec![];
    for (mode, said) in [("largest (MIP)", "largest value"), ("smallest (MinIP)", "smallest value"), ("X-ray: mean", "middle of the ray")] {
        window.get_by_role_and_label(Role::ComboBox, "Mode").click_accesskit();
        window.run_steps(3);
        window.get_by_label(mode).click_accesskit();
        window.run_steps(3);
        let pins = window.state().pins().len() + 1;
        click_at(&mut window, [0.5, 0.5], |viewer| viewer.pins().len() == pins);
        window.hover_at(place(&window, 0.5, 0.5));
        window.run_steps(2);
        window.get_by_label_contains(&format!("picture: {said}"));
        modes.push(window.state().pins()[pins - 1].at.length());
    }
    // The field is the distance from the centre: largest on the surface, smallest in the middle, which is that of the ray.
    let [largest, smallest, middle] = modes[..] else { panic!("three modes") };
    assert!((0.9..1.01).contains(&largest) && smallest < 0.1 && middle < 0.1, "{modes:?}");
}

#[test]
fn two_pictures_stand_beside_each_other_and_their_difference_is_shown() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.state_mut().set_params(OctreeParams { max_depth: 3, ..OctreeParams::default() });
    settle(&mut window);
    let octree = picture(&mut window);
    window.key_press(egui::Key::E);
    settle(&mut window);
    let exact = picture(&mut window);
    window.key_press(egui::Key::W);
    settle(&mut window);
    let width = window.state().picture_size()[0] as usize;
    // Columns away from the divider, rows above the names.
    let columns = |picture: &[[u8; 3]], from: usize, to: usize| -> Vec<[u8; 3]> {
        let rows = picture.chunks(width).take(picture.len() / width - 40);
        rows.flat_map(|row| row[from..to].to_vec()).collect()
    };
    let both = picture(&mut window);
    let half = width / 2;
    assert!(rms(&columns(&both, 0, half - 8), &columns(&octree, 0, half - 8)) < SAME, "the octree on the left");
    assert!(rms(&columns(&both, half + 8, width), &columns(&exact, half + 8, width)) < SAME, "the mesh on the right");
    assert!(rms(&columns(&both, half + 8, width), &columns(&octree, half + 8, width)) > 1.0);

    let (from, to) = (place(&window, 0.5, 0.2), place(&window, 0.8, 0.2));
    window.drag_at(from);
    window.step();
    window.hover_at(to);
    window.step();
    window.drop_at(to);
    settle(&mut window);
    let dragged = picture(&mut window);
    assert!(
        rms(&columns(&dragged, 0, width * 3 / 4), &columns(&octree, 0, width * 3 / 4)) < SAME,
        "more of the octree, and it did not turn"
    );

    window.get_by_label("difference").click_accesskit();
    settle(&mut window);
    let shown = picture(&mut window);
    let expected: Vec<[u8; 3]> =
        octree.iter().zip(&exact).map(|(a, b)| std::array::from_fn(|c| (u32::from(a[c].abs_diff(b[c])) * 20).min(255) as u8)).collect();
    // The pictures shown are rounded to levels, which 20 times the difference of what they are of is not.
    let off = rms(&columns(&shown, 0, width), &columns(&expected, 0, width));
    assert!(off < 12.0, "{off} levels from the difference of the pictures");
    assert!(rms(&columns(&shown, 0, width), &columns(&octree, 0, width)) > 20.0);

    window.get_by_label("Keep as A").click_accesskit();
    window.get_by_label("wipe").click_accesskit();
    window.state_mut().set_params(OctreeParams { max_depth: 5, ..OctreeParams::default() });
    settle(&mut window);
    let kept = picture(&mut window);
    assert!(rms(&columns(&kept, 0, half), &columns(&octree, 0, half)) < SAME, "A as it was kept");
    assert!(rms(&columns(&kept, width * 17 / 20, width), &columns(&octree, width * 17 / 20, width)) > SAME / 10.0, "B is another");
}

#[test]
fn leaves_are_drawn_over_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = picture(&mut window);
    window.get_by_label("Leaves").click_accesskit();
    window.step();
    window.step();
    for (show, said) in [("on a plane", "on the plane are drawn"), ("nearest", "in all are drawn")] {
        window.get_by_label(show).click_accesskit();
        wait_for(&mut window, "leaves are drawn", |viewer| viewer.leaves_drawn().filter(|(drawn, of)| *drawn > 0 && drawn <= of));
        settle(&mut window);
        window.get_by_label_contains(said);
        let with = picture(&mut window);
        let changed = before.iter().zip(&with).filter(|(a, b)| a != b).count();
        assert!(changed * 50 > before.len(), "{show}: {changed} pixels of {}", before.len());
    }
    window.get_all_by_label("off").last().expect("after that of the comparison").click_accesskit();
    settle(&mut window);
    assert!(rms(&before, &picture(&mut window)) < SAME);
}

#[test]
fn a_click_in_the_chart_takes_the_setting() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let at = place(&window, 0.5, 0.5);
    window.hover_at(at);
    window.step();
    window.get_by_label("Tune").click();
    window.run_steps(3);
    window.get_by_label("Sweep").click_accesskit();
    let rows = wait_for(&mut window, "settings are measured", |viewer| {
        let rows: Vec<_> = viewer.tuning_points().map(|(row, _)| row.clone()).collect();
        (rows.len() > 2).then_some(rows)
    });
    window.get_by_label("Stop").click_accesskit();
    wait_for(&mut window, "the sweep stops", |viewer| (!viewer.is_tuning()).then_some(()));
    assert!(rows.iter().all(|row| row.rmse_rel > 0.0 && row.bytes > 0 && row.frame_s > 0.0), "{rows:?}");
    window.run_steps(3);
    let (row, at) = window.state().tuning_points().next().map(|(row, at)| (row.clone(), at)).expect("a point");
    assert_ne!(*window.state().params(), row.params);
    window.hover_at(at);
    window.step();
    window.drag_at(at);
    window.step();
    window.drop_at(at);
    window.run_steps(2);
    assert_eq!(*window.state().params(), row.params);
}
