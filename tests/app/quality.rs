//! The window's judgement of cells.

use super::tools::wait_for;
use super::*;
use octetra::mesh::quality::{self, Metric};

#[test]
fn the_worst_cells_are_listed_flown_to_marked_and_seen_in_colour() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open(folder.path());
    let before = picture(&mut window);
    assert!(window.state().quality_summary().is_none(), "nothing is measured until it is looked at");
    window.get_by_label("Quality").click_accesskit();
    let summary = wait_for(&mut window, "the quality is measured", |viewer| viewer.quality_summary().cloned());
    window.run_steps(2);
    assert_eq!((summary.metric, summary.tets, summary.infinite), (Metric::ScaledJacobian, ball().tets().len(), 0));
    window.get_by_label("histogram of the quality");
    assert!(rms(&before, &picture(&mut window)) < SAME, "the picture stays");

    let worst = summary.worst[0];
    assert_eq!(worst.value, summary.min);
    window.get_all_by_label_contains(&format!("cell {}", worst.cell)).next().expect("in the list").click_accesskit();
    settle(&mut window);
    assert_eq!(window.state().marked_cell(), Some(worst));
    let camera = window.state().camera();
    assert!((camera.target - worst.center).length() < 1e-9, "{} is looked at, expected {}", camera.target, worst.center);
    assert!(camera.view_height() < 1.5, "it is near: {}", camera.view_height());
    let marked = picture(&mut window);
    // Its edges are yellow, which nothing else is in these colours so near.
    let is_yellow = |p: &&[u8; 3]| p[0] > 230 && p[1] > 200 && (60..120).contains(&p[2]);
    let yellow = marked.iter().filter(is_yellow).count();
    assert!(yellow > 100, "{yellow} pixels of the edges");
    window.get_by_label("Unmark").click_accesskit();
    settle(&mut window);
    let unmarked = picture(&mut window);
    let still = unmarked.iter().filter(is_yellow).count();
    assert!(window.state().marked_cell().is_none() && still * 4 < yellow, "{still} pixels stay");

    window.get_by_label("Colour by this").click_accesskit();
    settle(&mut window);
    let name = quality::field_name(Metric::ScaledJacobian);
    assert_eq!(window.state().array(), Some(name.as_str()));
    assert!(rms(&unmarked, &picture(&mut window)) > 1.0, "other colours are seen");
}
