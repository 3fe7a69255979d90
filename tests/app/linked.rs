//! Two meshes in one window.

use super::*;
use glam::DVec3;
use octetra::format::vtu::write::{Compression, write_mesh};
use octetra::mesh::{DataArray, MeshParts, Values};
use octetra::progress::Progress;

/// What the second file's values are of the first one's: up to the middle of its range, which in viridis is blue-green.
const PART: f64 = 0.5;

/// Writes the ball elsewhere, its values smaller, and an array before them that the ball has not.
fn write_second(path: &Path, by: DVec3) {
    let ball = ball();
    let array = &ball.point_data()[0];
    let values: Vec<f64> = (0..array.values.len()).map(|i| array.values.get(i) * PART).collect();
    let arrays = [("another", vec![0.0; values.len()]), (array.name.as_str(), values)];
    let parts = MeshParts {
        points: ball.points().iter().map(|point| *point + ball.center() + by).collect(),
        tets: ball.tets().to_vec(),
        point_data: arrays.map(|(name, values)| DataArray { name: name.into(), components: 1, values: Values::F64(values) }).to_vec(),
        ..MeshParts::default()
    };
    write_mesh(path, &TetMesh::new(parts).expect("valid"), Compression::None, &Progress::new()).expect("written");
}

/// The two halves of the window's picture side by side, above the names at the bottom.
fn halves(window: &mut Window) -> [Vec<[u8; 3]>; 2] {
    let [width, height] = window.state().picture_size();
    let image = window.render().expect("a frame");
    [300, image.width() - width].map(|left| {
        let at = |i: u32| image.get_pixel(left + i % width, i / width).0;
        (0..width * (height - 40)).map(at).map(|[r, g, b, _]| [r, g, b]).collect()
    })
}

/// The middle of what is not black, in columns, and the mean colour there.
fn seen(half: &[[u8; 3]], width: usize) -> (f64, [f64; 3]) {
    let lit: Vec<(usize, [u8; 3])> = half.iter().copied().enumerate().filter(|(_, pixel)| pixel.iter().any(|&level| level > 40)).collect();
    assert!(lit.len() > 100, "{} pixels", lit.len());
    let count = lit.len() as f64;
    let column = lit.iter().map(|(i, _)| (i % width) as f64 + 0.5).sum::<f64>() / count;
    (column, std::array::from_fn(|c| lit.iter().map(|(_, pixel)| f64::from(pixel[c])).sum::<f64>() / count))
}

#[test]
fn a_second_file_is_seen_beside_the_first_with_one_camera_and_one_range() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("second.vtu");
    let mut first = options(folder.path());
    first.view.camera = Camera::orbit(ball().bounds().translated(ball().center()), 0, 0.5);
    let (seen_from, by) = (first.view.camera, first.view.camera.axes()[1] * 0.4);
    write_second(&path, by);
    first.compare_with = Some(path);
    let mut window = open_with(first, SIZE);
    assert!(window.state().is_comparing(), "{}", window.state().status());
    window.get_by_label("side by side").click_accesskit();
    settle(&mut window);
    let camera = window.state().camera();
    assert_eq!(camera, seen_from, "that of the first");
    let [width, height] = window.state().picture_size().map(f64::from);
    assert!(width < f64::from(SIZE.x - 300.0) / 2.0, "half of the place");

    let [a, b] = halves(&mut window);
    let [(column_a, color_a), (column_b, color_b)] = [&a, &b].map(|half| seen(half, width as usize));
    let column = |at: DVec3| width / 2.0 + camera.seen_at(at).expect("before the eye").x * height;
    // A ball aside is no circle.
    assert!((column_a - column(DVec3::ZERO)).abs() < 1.5, "{column_a} of {width}");
    assert!((column_b - column(by)).abs() < 3.0 && column(by) - column(DVec3::ZERO) > 10.0, "{column_b}, expected {}", column(by));
    // One range: A's values span it, B's do not reach the yellow.
    assert!(color_b[2] > 1.2 * color_b[0] && color_a[0] > color_a[2], "{color_a:?} {color_b:?}");

    window.get_by_label("Swap").click_accesskit();
    settle(&mut window);
    let [c, d] = halves(&mut window);
    assert!(rms(&a, &d) < SAME && rms(&b, &c) < SAME, "A and B changed places, and nothing else: {} {}", rms(&a, &d), rms(&b, &c));
    assert_eq!(window.state().camera(), camera);

    // A drag over the left half turns both.
    let middle = egui::pos2(300.0 + 0.25 * (SIZE.x - 300.0), 0.4 * SIZE.y);
    window.drag_at(middle);
    window.step();
    window.hover_at(middle + egui::vec2(30.0, 0.0));
    window.step();
    window.drop_at(middle + egui::vec2(30.0, 0.0));
    settle(&mut window);
    assert!(window.state().camera() != camera);
    let [e, f] = halves(&mut window);
    assert!(rms(&e, &c) > 1.0 && rms(&f, &d) > SAME);

    // A clip is of both.
    window.get_by_label("Add clip").click_accesskit();
    settle(&mut window);
    let [clipped_e, clipped_f] = halves(&mut window);
    assert!(rms(&clipped_e, &e) > 1.0 && rms(&clipped_f, &f) > 1.0);

    // Half of each, in one place.
    window.get_by_label("blend").click_accesskit();
    settle(&mut window);
    let blend = picture(&mut window);
    window.get_by_label("wipe").click_accesskit();
    settle(&mut window);
    let wipe = picture(&mut window);
    assert!(rms(&blend, &wipe) > 1.0);
    let brightest = |picture: &[[u8; 3]]| picture.iter().map(|pixel| pixel[0]).max();
    assert!(brightest(&blend) <= brightest(&wipe));

    // Another file by itself is compared with nothing.
    let ctx = window.ctx.clone();
    window.state_mut().open(&ctx, folder.path().join("second.vtu"));
    settle(&mut window);
    assert!(!window.state().is_comparing());
}
