//! The range of values that are shown at all.

use super::*;

#[test]
fn values_are_hidden_and_the_function_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut window = open_sized(folder.path(), SIZE + egui::vec2(0.0, 240.0));
    let before = picture(&mut window);
    let function = |window: &Window| window.state().transfer_function().clone();
    let threshold = |window: &Window| function(window).threshold.expect("one");
    let viridis = TransferFunction::preset("viridis").expect("a preset");
    assert_eq!(function(&window).threshold, None);
    window.get_by_label("Show values").click_accesskit();
    settle(&mut window);
    let [from, to] = threshold(&window);
    let [lo, hi] = [0.0, to]; // the field is the distance from the middle
    assert!((from - 0.25 * hi).abs() < 0.01 && (0.9..1.1).contains(&to), "{from} to {to}");

    // Ends are dragged and typed, no further than the other end.
    drag(&mut window, "show high", egui::vec2(-100.0, 0.0));
    let [from, to] = threshold(&window);
    assert!(from > lo && from < 0.3 && to < 0.75 * hi, "{from} to {to}");
    settle(&mut window);
    let hidden = picture(&mut window);
    assert!(rms(&before, &hidden) > 3.0, "the outside of the ball is gone");
    drag(&mut window, "show low", egui::vec2(300.0, 0.0));
    assert_eq!(threshold(&window), [to, to]);
    type_number(&mut window, "show from", "0.125");
    assert_eq!(threshold(&window), [0.125, to]);
    assert_eq!(TransferFunction { threshold: None, ..function(&window) }, viridis, "the function itself stays");

    window.get_by_label("Show values").click_accesskit();
    settle(&mut window);
    assert_eq!(function(&window), viridis);
    assert!(rms(&before, &picture(&mut window)) < SAME);
}
