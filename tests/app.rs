//! The window as a user meets it, without a display: a small ball is opened, looked at, rebuilt, drawn exactly and saved.

use egui::accesskit::{Role, Toggled};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
#[path = "app/linked.rs"]
mod linked;
#[path = "app/planes.rs"]
mod planes;
#[path = "app/quality.rs"]
mod quality;
mod steps;
#[path = "app/threshold.rs"]
mod threshold;
#[path = "app/time.rs"]
mod time;
#[path = "app/tools.rs"]
mod tools;

use octetra::app::{Options, Viewer, wgpu_setup};
use octetra::furniture::Parts;
use octetra::mesh::generate::{Shape, plan};
use octetra::mesh::{Component, FieldSelection, ScalarField, TetMesh, collect};
use octetra::octree::{Boundary, OctreeParams, Preset, Reconstruction, Subject};
use octetra::session::Source;
use octetra::study::{ErrorSampling, FieldError};
use octetra::view::{Camera, RenderSettings, TransferFunction, View};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

const SIZE: egui::Vec2 = egui::vec2(640.0, 420.0);

/// Points that the error is measured at: few, for tests are slow.
const POINTS: usize = 1 << 14;

/// Root mean square difference up to which pictures are the same, in levels: whether all rows or some at a time were marched, rounds apart.
const SAME: f64 = 0.3;

type Window = Harness<'static, Viewer>;

fn ball() -> TetMesh {
    collect(&*plan(Shape::Ball, Some(6 * 12 * 12 * 12)).expect("a size that can be made")).expect("a valid mesh")
}

fn options(folder: &Path) -> Options {
    let mesh = ball();
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a ball has a field");
    let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 0, 1.2);
    let transfer_function = TransferFunction::preset("viridis").expect("a preset");
    Options {
        name: "ball".into(),
        source: Source::default(),
        session: None,
        recent: None,
        subject: Subject::Mesh(Arc::new(mesh), Arc::new(field)),
        component: Component::Magnitude,
        compare_with: None,
        view: View { camera, transfer_function, settings: RenderSettings::new(64, 64) },
        params: OctreeParams { max_depth: 5, ..OctreeParams::default() },
        error: ErrorSampling { points: POINTS, ..ErrorSampling::default() },
        memory_bytes: 1 << 30,
        device: octetra::render::DeviceChoice::Gpu,
        folder: folder.to_owned(),
    }
}

fn open(folder: &Path) -> Window {
    open_sized(folder, SIZE)
}

/// One of another size: as high as what is to be clicked in it needs.
fn open_sized(folder: &Path, size: egui::Vec2) -> Window {
    open_with(options(folder), size)
}

fn open_with(options: Options, size: egui::Vec2) -> Window {
    let builder = Harness::builder().with_size(size).with_render_cursor(false).wgpu_setup(wgpu_setup());
    let mut window = builder.build_eframe(|creation| Viewer::new(creation, options).expect("a window"));
    window.state_mut().set_parts(Parts::NONE); // pictures are compared; the frame time would differ
    settle(&mut window);
    window
}

/// Goes on until the picture is the one asked for.
fn settle(window: &mut Window) {
    window.step();
    window.remove_cursor(); // its tooltip would lie over the picture
    let start = Instant::now();
    loop {
        window.step();
        window.step();
        if window.state().is_settled() {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(180), "the window never comes to rest: {}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The picture's bytes, row by row.
fn picture(window: &mut Window) -> Vec<[u8; 3]> {
    let image = window.render().expect("a frame");
    let [width, height] = window.state().picture_size();
    let columns = image.width() - width..image.width();
    (0..height)
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .map(|(x, y)| image.get_pixel(x, y).0)
        .map(|[r, g, b, _]| [r, g, b])
        .collect()
}

/// Root mean square difference of two pictures, in levels of 255.
fn rms(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let squares = a.as_flattened().iter().zip(b.as_flattened()).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2));
    (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

fn nodes(window: &Window) -> usize {
    window.state().octree_numbers().expect("an octree").nodes
}

/// Goes on until the octree's error is measured and bounded too.
fn measured(window: &mut Window) -> FieldError {
    let start = Instant::now();
    loop {
        settle(window);
        let numbers = window.state().octree_numbers().expect("an octree");
        if let (Some(error), Some(_)) = (numbers.error, numbers.bound) {
            return error;
        }
        assert!(start.elapsed() < Duration::from_secs(180), "the error is never measured");
    }
}

/// Presses a key once on a slider.
fn nudge(window: &mut Window, slider: &str, key: egui::Key) {
    window.get_by_role_and_label(Role::Slider, slider).focus();
    window.step();
    window.key_press(key);
}

#[test]
fn it_opens_on_a_picture_and_its_numbers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let shown = picture(&mut window);
    let [width, height] = window.state().picture_size().map(|n| n as usize);
    assert!(shown[width * (height / 2) + width / 2].iter().any(|&v| v > 40), "the middle of the ball is not black");
    assert_eq!(shown[3], [0; 3], "beside the ball there is nothing");
    let nodes = nodes(&window);
    let label = if nodes < 1000 { nodes.to_string() } else { format!("{} {:03}", nodes / 1000, nodes % 1000) };
    window.get_by_role_and_label(Role::Label, &label);
    window.get_by_label("Leaves by depth");
}

#[test]
fn a_threshold_rebuilds_the_octree() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = nodes(&window);
    nudge(&mut window, "Max depth", egui::Key::ArrowRight);
    settle(&mut window);
    assert!(nodes(&window) > before, "depth 6 has more nodes than depth 5's {before}");
}

#[test]
fn a_tolerance_decides_until_v_and_w_do() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = nodes(&window);
    window.state_mut().set_params(OctreeParams { max_depth: 5, tolerance: Some(0.5), ..OctreeParams::default() });
    settle(&mut window);
    let loose = nodes(&window);
    assert!(loose < before, "a larger tolerance has fewer nodes than {before}: {loose}");
    for _ in 0..8 {
        nudge(&mut window, "Tolerance R", egui::Key::ArrowLeft);
    }
    settle(&mut window);
    assert!(window.state().params().tolerance < Some(0.5), "the slider moves it");
    assert!(nodes(&window) >= loose, "a smaller tolerance has no fewer nodes than {loose}");
    assert!(window.query_by_label("Max tets V").is_none(), "V decides nothing");

    window.get_by_label("V and W").click_accesskit();
    settle(&mut window);
    let params = window.state().params().clone();
    assert_eq!(params, OctreeParams { max_depth: 5, ..OctreeParams::default() }.by_thresholds());
    assert!(window.query_by_label("Tolerance R").is_none());
    let by_thresholds = nodes(&window);
    for _ in 0..8 {
        nudge(&mut window, "Max tets V", egui::Key::ArrowRight);
    }
    settle(&mut window);
    assert!(nodes(&window) < by_thresholds, "cells of more tets are leaves: fewer than {by_thresholds}");

    window.get_by_label("tolerance").click_accesskit();
    settle(&mut window);
    assert_eq!(nodes(&window), before, "the default tolerance again");
}

#[test]
fn presets_are_marked_while_they_hold() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.get_by_label("fast").click_accesskit();
    window.run_steps(2); // what they build is of no interest here
    assert_eq!(*window.state().params(), Preset::Fast.params());
    let marked = |window: &Window| {
        Preset::ALL
            .map(|(name, _)| window.get_all_by_label(name).last().expect("a preset").accesskit_node().toggled() == Some(Toggled::True))
    };
    assert_eq!(marked(&window), [false, true, false, false]);
    window.get_by_label("cells").click_accesskit();
    window.run_steps(2);
    assert_eq!(marked(&window), [false; 4]);
}

/// Drags what has this name by so many points.
fn drag(window: &mut Window, name: &str, by: egui::Vec2) {
    let from = window.get_by_label(name).rect().center();
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
    window.run_steps(3); // the first two clicks of a drag value could be the beginning of a drag
    window.event(egui::Event::Text(text.to_owned()));
    window.step();
    window.key_press(egui::Key::Enter);
    window.run_steps(2);
}

#[test]
fn opacity_and_colours_are_edited() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_sized(folder.path(), SIZE + egui::vec2(0.0, 200.0));
    let before = picture(&mut window);
    let function = |window: &Window| window.state().transfer_function().clone();
    let viridis = TransferFunction::preset("viridis").expect("a preset");
    assert_eq!(function(&window), viridis);

    // A knot is dragged: more opacity, from a smaller value on.
    drag(&mut window, "opacity knot 2", egui::vec2(-60.0, -20.0));
    let [x, opacity] = function(&window).opacity[1];
    assert!((0.6..0.9).contains(&x) && (0.7..0.8).contains(&opacity), "{x}, {opacity}");
    settle(&mut window);
    assert!(rms(&before, &picture(&mut window)) > 3.0, "the picture follows");
    // Its numbers are typed.
    type_number(&mut window, "knot opacity", "0.25");
    assert_eq!(function(&window).opacity[1], [x, 0.25]);
    // A click adds one, a right click takes one away, Delete the chosen one; the last stays.
    window.get_by_label("opacity over the value").click();
    window.run_steps(2);
    assert_eq!(function(&window).opacity.len(), 3);
    window.get_by_label("opacity knot 3").click_secondary();
    window.run_steps(2);
    assert_eq!(function(&window).opacity.len(), 2);
    for _ in 0..2 {
        window.get_by_label("opacity knot 1").click();
        window.run_steps(2);
        window.key_press(egui::Key::Delete);
        window.run_steps(2);
    }
    assert_eq!(function(&window).opacity.len(), 1);

    // Colours: their knots move too, and turn around.
    drag(&mut window, "colour knot 8", egui::vec2(12.0, 0.0));
    let moved = function(&window).color[7][0] - viridis.color[7][0];
    assert!((0.03..0.06).contains(&moved), "by {moved}");
    window.get_by_label("Invert").click();
    window.run_steps(2);
    assert_eq!(function(&window).color[0][1..], viridis.color[viridis.color.len() - 1][1..]);

    // A double click on a knot opens the choice of its colour.
    let at = window.get_by_label("colour knot 8").rect().center();
    window.hover_at(at);
    window.step();
    let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
    let press = |pressed| egui::Event::PointerButton { pos: at, button, pressed, modifiers };
    window.input_mut().events.extend([true, false, true, false].map(press));
    window.run_steps(2);
    assert!(egui::Popup::is_any_open(&window.ctx), "the colour is being chosen");
    let before = function(&window).color[7];
    window.get_by_label("hue").click();
    window.run_steps(2);
    assert_ne!(function(&window).color[7], before);
    window.key_press(egui::Key::Escape);
    window.run_steps(2);
    assert!(!egui::Popup::is_any_open(&window.ctx));

    // Another map keeps the opacity, which is the user's own now.
    let opacity = function(&window).opacity;
    window.get_by_role_and_label(Role::ComboBox, "Colour map").click();
    window.run_steps(3);
    window.get_by_label("inferno").click();
    window.run_steps(2);
    let inferno = TransferFunction::preset("inferno").expect("a preset");
    assert_eq!((function(&window).color, function(&window).opacity), (inferno.color, opacity));
}

#[test]
fn range_scale_and_files_of_the_transfer_function() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_sized(folder.path(), SIZE + egui::vec2(0.0, 200.0));
    let before = picture(&mut window);
    let function = |window: &Window| window.state().transfer_function().clone();
    // The ball's field goes from 0 to 1: no logarithm, until the range is above 0.
    let is_disabled = |window: &Window| window.get_by_label("log").accesskit_node().is_disabled();
    assert!(is_disabled(&window));
    type_number(&mut window, "range from", "0.01");
    let [lo, hi] = function(&window).range.expect("typed");
    assert!(lo == 0.01 && (0.5..2.0).contains(&hi), "{lo} to {hi}");
    assert!(!is_disabled(&window));
    window.get_by_label("log").click_accesskit();
    settle(&mut window);
    assert_eq!(function(&window).scale, octetra::view::Scale::Log);
    let log = picture(&mut window);
    assert!(rms(&before, &log) > 3.0, "a logarithm is another picture");
    drag(&mut window, "range high", egui::vec2(-80.0, 0.0));
    let [_, shorter] = function(&window).range.expect("dragged");
    assert!(shorter < 0.9 * hi && shorter > 0.3 * hi, "{shorter} of {hi}");
    window.get_by_label("Whole range").click_accesskit();
    window.run_steps(2);
    assert_eq!(function(&window).range, None);
    window.get_by_label_contains("drawn linear");
    window.get_by_label("linear").click_accesskit();
    window.get_by_label("Discrete").click_accesskit();
    window.get_by_label("above").click_accesskit();
    window.run_steps(2);
    assert_eq!((function(&window).steps, function(&window).above.is_some()), (Some(8), true));

    // ParaView's colour maps are read, the first is shown, the others can be chosen; what is no map changes nothing.
    let path = folder.path().join("maps.json");
    let maps = r#"[{"Name": "One", "RGBPoints": [0,1,0,0, 1,1,0,0]}, {"Name": "Two", "RGBPoints": [5,0,1,0, 9,0,0,1],},]"#;
    std::fs::write(&path, maps).expect("written");
    let ctx = window.ctx.clone();
    window.state_mut().open_transfer(&ctx, path.clone());
    while !window.state().status().contains("read 2") {
        assert!(window.state().status().is_empty(), "{}", window.state().status());
        window.step();
    }
    assert_eq!(function(&window).color, [[0.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]]);
    window.get_by_role_and_label(Role::ComboBox, "Colour map").click();
    window.run_steps(3);
    window.get_by_label("Two").click_accesskit();
    window.run_steps(2);
    assert_eq!(function(&window).color, [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 1.0]]);
    let kept = function(&window);
    std::fs::write(&path, "[1, 2]").expect("written");
    window.state_mut().open_transfer(&ctx, path);
    while !window.state().status().contains("maps.json: not a transfer function") {
        window.step();
    }
    assert_eq!(function(&window), kept);
}

#[test]
fn boundary_and_reconstruction_rebuild_the_octree() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = window.state().octree_numbers().expect("an octree");
    let shown = picture(&mut window);
    assert!(before.surface_bytes.is_some_and(|bytes| bytes > 0), "rays are cut to the ball");

    window.get_by_label("cells").click_accesskit();
    settle(&mut window);
    assert_eq!(window.state().params().boundary, Boundary::Cells);
    assert_eq!(window.state().octree_numbers().expect("an octree").surface_bytes, None);
    let cells = picture(&mut window);
    assert!(rms(&shown, &cells) > 3.0, "the ball is larger by parts of leaves");

    let leaf = window.get_all_by_label("leaf").last().expect("beside the steps' a reconstruction");
    leaf.click_accesskit();
    settle(&mut window);
    assert_eq!(window.state().params().reconstruction, Reconstruction::Leaf);
    let after = window.state().octree_numbers().expect("an octree");
    assert!(after.bytes < before.bytes, "leaves without bricks are smaller than {}: {}", before.bytes, after.bytes);
    let blocks = rms(&cells, &picture(&mut window));
    assert!(blocks > SAME, "blocks are seen: {blocks} levels");

    window.get_by_label("mesh").click_accesskit();
    window.get_by_label("continuous").click_accesskit();
    settle(&mut window);
    let back = rms(&shown, &picture(&mut window));
    assert!(back < SAME, "the surface that was kept cuts as before: {back} levels");
}

#[test]
fn the_error_is_stated_and_falls_with_the_tolerance() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let coarse = measured(&mut window);
    assert_eq!(coarse.sampling.points, POINTS);
    let said = format!("{:.1} dB", coarse.by_volume.psnr_db);
    window.get_by_role_and_label(Role::Label, &said);
    window.get_by_role_and_label(Role::Label, "Largest error");
    let bound = window.state().octree_numbers().and_then(|numbers| numbers.bound).expect("found with the error").bound_rel;
    assert!(bound >= coarse.by_volume.max_rel.max(coarse.by_tet.max_rel), "{bound} bounds what was met");
    window.get_by_role_and_label(Role::Label, "Bound");

    window.state_mut().set_params(OctreeParams { max_depth: 6, tolerance: Some(0.01), ..OctreeParams::default() });
    settle(&mut window);
    let fine = measured(&mut window);
    assert!(fine.by_volume.rmse_rel < 0.5 * coarse.by_volume.rmse_rel, "{fine:?}, before {coarse:?}");
    assert_eq!(fine.sampling.tolerance, Some(0.01), "it is the new octree's");
}

#[test]
fn what_the_depth_leaves_undone_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.state_mut().set_params(OctreeParams { max_depth: 2, tolerance: Some(1e-3), ..OctreeParams::default() });
    settle(&mut window);
    let unmet = window.state().octree_numbers().expect("an octree").unmet.expect("depth 2 is too little");
    window.get_by_role_and_label(Role::Label, "Not met in");
    window.get_by_label_contains(&format!("{} leaves, worst", unmet.leaves));
    window.get_by_label("V and W").click_accesskit();
    settle(&mut window);
    assert!(window.query_by_label("Not met in").is_none(), "no tolerance, nothing to meet");
}

#[test]
fn e_flips_at_once_between_pictures_that_are_there() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.state_mut().set_params(OctreeParams { max_depth: 3, ..OctreeParams::default() });
    settle(&mut window);
    let octree = picture(&mut window);
    window.key_press(egui::Key::E);
    settle(&mut window);
    let exact = picture(&mut window);
    assert!(rms(&octree, &exact) > 1.0, "depth 3 is not the mesh");
    for expected in [&octree, &exact, &octree] {
        window.key_press(egui::Key::E);
        window.step();
        window.step();
        assert_eq!(rms(expected, &picture(&mut window)), 0.0, "the very picture, without a march");
        assert!(window.state().is_settled());
    }
}

#[test]
fn thresholds_count_beside_the_exact_picture_too() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = nodes(&window);
    window.key_press(egui::Key::E);
    settle(&mut window);
    let exact = picture(&mut window);
    nudge(&mut window, "Max depth", egui::Key::ArrowRight);
    settle(&mut window);
    assert!(nodes(&window) > before);
    assert_eq!(rms(&exact, &picture(&mut window)), 0.0, "the mesh is as before");
}

#[test]
fn exact_looks_like_the_octree() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    window.state_mut().set_params(OctreeParams { max_depth: 6, tolerance: Some(0.01), ..OctreeParams::default() });
    settle(&mut window);
    let octree = picture(&mut window);
    window.get_by_label("exact").click_accesskit(); // it may be scrolled out of sight
    settle(&mut window);
    let exact = picture(&mut window);
    let difference = rms(&octree, &exact);
    assert!(difference > 0.0 && difference < 3.0, "{difference} levels");
    window.get_by_label("octree").click_accesskit();
    settle(&mut window);
    let back = rms(&octree, &picture(&mut window));
    assert!(back < SAME, "and back again: {back} levels");
}

#[test]
fn every_way_to_skip_looks_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    const WAYS: [&str; 4] = ["half", "k = 8", "none", "active"];
    let active = picture(&mut window);
    for way in WAYS {
        window.get_by_label(way).click_accesskit();
        settle(&mut window);
        let is_chosen = |way: &&&str| window.get_by_label(way).accesskit_node().toggled() == Some(Toggled::True);
        assert_eq!(WAYS.iter().filter(is_chosen).collect::<Vec<_>>(), [&way], "one is chosen");
        let off = rms(&active, &picture(&mut window));
        assert!(off < SAME, "{way}: {off} levels");
    }
}

#[test]
fn dragging_turns_and_start_turns_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = picture(&mut window);
    window.drag_at(egui::pos2(500.0, 200.0));
    window.step();
    window.hover_at(egui::pos2(560.0, 150.0));
    window.step();
    window.drop_at(egui::pos2(560.0, 150.0));
    settle(&mut window);
    let turned = picture(&mut window);
    let turn = rms(&before, &turned);
    assert!(turn > 5.0 * SAME, "the lattice of the ball turns: {turn} levels");
    window.get_by_label("Start").click_accesskit(); // it may be scrolled out of sight
    settle(&mut window);
    let back = rms(&before, &picture(&mut window));
    assert!(back < SAME, "{back} levels");
}

#[test]
fn a_screenshot_has_the_bytes_of_the_window() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    for name in ["ball_00.png", "ball_01.png"] {
        window.get_by_label("Screenshot").click();
        settle(&mut window);
        assert!(window.state().status().ends_with(name), "{}", window.state().status());
    }
    let saved = image::open(folder.path().join("ball_01.png")).expect("a PNG").into_rgb8();
    let shown = picture(&mut window);
    assert_eq!([saved.width(), saved.height()], window.state().picture_size());
    let worst = saved.pixels().zip(&shown).map(|(a, b)| (0..3).map(|c| a.0[c].abs_diff(b[c])).max()).max().flatten();
    assert!(worst.is_some_and(|w| w <= 1), "rays stop at 1/4096 in the file and at 1/512 in the window: {worst:?}");
}

#[test]
fn what_cannot_be_opened_is_said_and_the_mesh_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("broken.vtu");
    std::fs::write(&path, "<VTKFile type=\"UnstructuredGrid\">").expect("written");
    let mut window = open(folder.path());
    let before = picture(&mut window);
    let ctx = window.ctx.clone();
    window.state_mut().open(&ctx, path);
    settle(&mut window);
    assert!(window.state().status().contains("broken.vtu"), "{}", window.state().status());
    window.key_press(egui::Key::Escape); // closes what says why
    settle(&mut window);
    let back = rms(&before, &picture(&mut window));
    assert!(back < SAME, "{back} levels");
}

#[test]
fn a_volume_takes_the_meshes_place_and_has_no_exact_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("shell.nhdr");
    let shell = octetra::volume::generate::shell(33).expect("valid");
    octetra::format::nrrd::write(&path, &shell, &octetra::progress::Progress::new()).expect("written");
    let mut window = open(folder.path());
    window.key_press(egui::Key::E); // from the exact picture of the mesh
    settle(&mut window);
    let ctx = window.ctx.clone();
    window.state_mut().open(&ctx, path);
    let error = measured(&mut window);
    assert!(window.state().status().contains("shell"), "{}", window.state().status());
    window.get_by_role_and_label(Role::Label, "33 x 33 x 33 of u8");
    assert!(window.query_by_label("Sampling").is_none(), "a volume's samples are its own values");
    let shown = picture(&mut window);
    let lit = shown.iter().filter(|pixel| pixel.iter().any(|&v| v > 20)).count();
    assert!(lit * 20 > shown.len(), "{lit} of {} pixels", shown.len());

    window.key_press(egui::Key::E);
    settle(&mut window);
    assert!(window.state().status().contains("this is a volume"), "{}", window.state().status());
    assert!(rms(&shown, &picture(&mut window)) < SAME, "the octree's picture stays");

    window.state_mut().set_params(OctreeParams { max_depth: 3, ..OctreeParams::default() });
    settle(&mut window);
    let coarse = measured(&mut window);
    assert!(coarse.by_volume.rmse_rel > 2.0 * error.by_volume.rmse_rel, "{coarse:?}, before {error:?}");
}

#[test]
fn surfaces_and_planes_are_added_in_the_panel() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let mut before = picture(&mut window);
    for button in ["Add clip", "Add isosurface", "Add cut"] {
        window.get_by_label(button).click_accesskit();
        settle(&mut window);
        let after = picture(&mut window);
        let change = rms(&before, &after);
        assert!(change > SAME, "{button} shows: {change} levels");
        before = after;
    }
    assert_eq!(window.get_all_by_label("x").count(), 3, "each can be removed");
    for _ in 0..3 {
        window.get_all_by_label("x").next().expect("one more").click_accesskit();
        window.run_steps(2);
    }
    settle(&mut window);
    assert!(rms(&before, &picture(&mut window)) > SAME, "and is gone then");
}
