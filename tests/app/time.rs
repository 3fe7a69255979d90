//! A series in the window: its steps, what stays, what its colours span.

use super::steps;
use super::tools::wait_for;
use super::*;
use octetra::format::Data;
use octetra::progress::Progress;

/// Opens the window on the small series.
fn open_series(folder: &Path) -> Window {
    steps::write(folder);
    let data = octetra::format::read(&folder.join(steps::STEPS[0].1), &Default::default(), &Progress::new()).expect("sound");
    let Data::Mesh(mesh) = data else { panic!("a mesh") };
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("p");
    let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 0, 1.2);
    let options = Options {
        name: "flow_1".into(),
        source: Source::file(folder.join("flow.pvd")),
        subject: Subject::Mesh(Arc::new(mesh), Arc::new(field)),
        view: View { camera, ..options(folder).view },
        params: OctreeParams { max_depth: 4, ..OctreeParams::default() },
        ..options(folder)
    };
    open_with(options, SIZE)
}

fn step(window: &Window) -> Option<(usize, usize)> {
    window.state().step()
}

fn range(window: &Window) -> Option<[f64; 2]> {
    window.state().transfer_function().range
}

/// Waits for the range that colours span.
fn wait_for_range(window: &mut Window, expected: Option<[f64; 2]>) {
    wait_for(window, &format!("{expected:?}"), |viewer| (viewer.transfer_function().range == expected).then_some(()));
    settle(window);
}

#[test]
fn steps_are_gone_through_and_all_that_is_chosen_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_series(folder.path());
    assert_eq!(step(&window), Some((0, 3)));
    wait_for_range(&mut window, Some([0.0, 3.0]));
    window.get_by_label("of 2, time 0");
    let camera = Camera { eye: [3.0, 2.0, 1.5].into(), ..window.state().camera() };
    window.state_mut().set_camera(camera);
    window.get_by_label("Add clip").click_accesskit();
    settle(&mut window);
    let chosen = window.state().session();
    let first = picture(&mut window);

    // Forth by the button, the key and the slider, and back.
    window.get_by_label("Next step").click_accesskit();
    settle(&mut window);
    assert_eq!(step(&window), Some((1, 3)));
    window.get_by_label("of 2, time 0.5");
    let second = picture(&mut window);
    assert!(rms(&first, &second) > 3.0, "larger values have other colours");
    let stayed = window.state().session();
    assert_eq!((stayed.camera, stayed.render, stayed.array.clone()), (Some(camera), chosen.render, Some("p".into())));
    assert_eq!(stayed.transfer_function, chosen.transfer_function);
    assert_eq!(stayed.data, Source { step: Some(1), ..Source::file(folder.path().join("flow.pvd")) });
    assert!(stayed.render.planes != Default::default(), "the plane is still there");
    window.key_press(egui::Key::Period);
    settle(&mut window);
    assert_eq!(step(&window), Some((2, 3)));
    window.key_press(egui::Key::Comma);
    settle(&mut window);
    assert_eq!(step(&window), Some((1, 3)));
    assert!(rms(&second, &picture(&mut window)) < SAME, "the same step is the same picture");
    nudge(&mut window, "Step", egui::Key::ArrowLeft);
    settle(&mut window);
    assert_eq!(step(&window), Some((0, 3)));
    assert!(rms(&first, &picture(&mut window)) < SAME);
    assert_eq!(range(&window), Some([0.0, 3.0]));

    // A step's own range makes all of these equal; the user's own stays.
    window.get_by_label("each step").click_accesskit();
    settle(&mut window);
    assert_eq!(range(&window), None);
    let own = picture(&mut window);
    window.key_press(egui::Key::Period);
    settle(&mut window);
    assert!(rms(&own, &picture(&mut window)) < SAME, "the same share of another range");
    window.get_by_label("all steps").click_accesskit();
    settle(&mut window);
    assert_eq!(range(&window), Some([0.0, 3.0]));

    // Another array has a range of its own over time; the view stays.
    window.get_by_role_and_label(Role::ComboBox, "Array").click();
    window.run_steps(3);
    window.get_by_label("q (points)").click();
    settle(&mut window);
    wait_for_range(&mut window, Some([0.0, 30.0]));
    let switched = window.state().session();
    assert_eq!((switched.camera, switched.render, switched.array), (Some(camera), chosen.render, Some("q".into())));
    window.key_press(egui::Key::Period);
    settle(&mut window);
    assert_eq!((step(&window), window.state().session().array), (Some((2, 3)), Some("q".into())), "the array stays");

    // A change that is not the user's is no step to undo.
    let before = window.state().session();
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    settle(&mut window);
    assert_eq!(window.state().session().array, Some("p".into()), "the array is what was chosen last");
    wait_for_range(&mut window, Some([0.0, 3.0]));
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Y);
    settle(&mut window);
    assert_eq!(window.state().session().array, before.array);

    // A step without the array is not shown, and says so. (The first, which follows the last, is read already.)
    std::fs::write(folder.path().join(steps::STEPS[1].1), steps::cube(&[("heat", 1.0)])).expect("written");
    window.state_mut().go_to_step(1);
    settle(&mut window);
    let said = window.state().status().to_owned();
    assert!(said.contains("flow_2.vtu: there is no array \"q\"; the mesh has"), "{said}");
    assert_eq!(step(&window), Some((2, 3)), "what was shown stays");
}

#[test]
fn it_plays_to_the_end_and_numbered_files_can_be_opened_as_a_series() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_series(folder.path());
    let ctx = window.ctx.clone();
    window.get_by_label("Loop").click_accesskit();
    window.step();
    window.key_press(egui::Key::Space);
    window.step();
    window.get_by_label("Pause");
    wait_for(&mut window, "it plays", |viewer| (viewer.step() == Some((2, 3))).then_some(()));
    wait_for(&mut window, "it stops", |viewer| (!viewer.is_playing()).then_some(()));
    settle(&mut window);
    assert_eq!(step(&window), Some((2, 3)), "the last is not left");

    // One of the files by itself is no series until it is asked to be.
    let second = folder.path().join(steps::STEPS[1].1);
    window.state_mut().open(&ctx, second.clone());
    settle(&mut window);
    assert_eq!(step(&window), None);
    assert!(window.query_by_label("Play").is_none());
    let camera = Camera { eye: [3.0, 2.0, 1.5].into(), ..window.state().camera() };
    window.state_mut().set_camera(camera);
    window.get_by_label("Open as series of 3 steps").click_accesskit();
    settle(&mut window);
    assert_eq!((step(&window), window.state().camera()), (Some((1, 3)), camera));
    assert!(window.state().status().contains("series of 3 steps"), "{}", window.state().status());
    window.get_by_label("of 2, time 2"); // by its number

    // What a session holds is opened at its step.
    let path = folder.path().join("flow.json");
    window.state_mut().go_to_step(2);
    settle(&mut window);
    window.state_mut().save_session(&ctx, path.clone());
    settle(&mut window);
    window.state_mut().open(&ctx, second);
    settle(&mut window);
    window.state_mut().open(&ctx, path);
    settle(&mut window);
    assert_eq!((step(&window), window.state().camera()), (Some((2, 3)), camera));
}
