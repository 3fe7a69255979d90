//! A real window on a display, used with the mouse and the keys: what is on the screen is what `octetra render` draws. Needs Xvfb.
#![cfg(target_os = "linux")]

#[path = "display/mod.rs"]
mod display;
mod program;

use display::{Display, OpenWindow, keys, wait};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use image::RgbImage;
use image::imageops::crop_imm;
use octetra::app::{Options, Viewer, wgpu_setup};
use octetra::format;
use octetra::furniture::Parts;
use octetra::mesh::{Component, FieldSelection, ScalarField};
use octetra::octree::{OctreeParams, Subject};
use octetra::progress::Progress;
use octetra::session::{Session, Source};
use octetra::study::ErrorSampling;
use octetra::view::{Camera, RenderSettings, View};
use program::done;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const SCREEN: [u32; 2] = [1280, 800];

/// Points of the panel's width and the status line's height.
const PANEL: u32 = 300;
const STATUS: u32 = 24;

/// A place over the panel, so that nothing is shown for the pointer, and the picture's middle.
const ASIDE: [i16; 2] = [294, 700];
const MIDDLE: [i16; 2] = [790, 388];

/// Root mean square difference up to which pictures are the same, in levels: the window stops rays a little earlier.
const SAME: f64 = 1.0;

/// The part of a screen that is the picture's, in a window of this size in its corner.
fn picture(screen: &RgbImage, [width, height]: [u32; 2]) -> RgbImage {
    crop_imm(screen, PANEL, 0, width - PANEL, height - STATUS).to_image()
}

/// Root mean square difference in levels.
fn rms(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let squares: f64 = a.iter().zip(b.iter()).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    (squares / a.len() as f64).sqrt()
}

/// Parts of the pixels of two images that differ by more than a little.
fn changed(a: &RgbImage, b: &RgbImage) -> f64 {
    let differs = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(&a, b)| a.abs_diff(b) > 12);
    a.pixels().zip(b.pixels()).filter(differs).count() as f64 / a.pixels().len() as f64
}

/// A display with the window, and what the command draws beside.
struct Bench<'a> {
    display: &'a Display,
    folder: &'a Path,
    session: Session,
}

impl Bench<'_> {
    /// Keeps what the screen shows where it can be looked at.
    fn keep(&self, name: &str, image: &RgbImage) -> PathBuf {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("display_{name}.png"));
        image.save(&path).expect("a picture");
        path
    }

    /// What `octetra render --session` draws from a camera for a window of this size.
    fn drawn(&self, camera: Camera, [width, height]: [u32; 2]) -> RgbImage {
        let render = RenderSettings { width: width - PANEL, height: height - STATUS, ..self.session.render };
        let session = Session { camera: Some(camera), render, ..self.session.clone() };
        session.write(&self.folder.join("seen.json")).expect("written");
        done(self.folder, &["render", "--session", "seen.json", "-o", "seen.png"]);
        image::open(self.folder.join("seen.png")).expect("a PNG").into_rgb8()
    }

    /// Waits until the window's picture is this one.
    fn until(&self, name: &str, window: [u32; 2], expected: &RgbImage) {
        let same = || (rms(&picture(&self.display.screen(), window), expected) < SAME).then_some(());
        wait(same, || {
            let screen = self.display.screen();
            let (kept, wanted) = (self.keep(name, &screen), self.keep(&format!("{name}_expected"), expected));
            let off = rms(&picture(&screen, window), expected);
            format!("{name}: the picture in {} is not that in {}, {off:.1} levels off", kept.display(), wanted.display())
        });
    }

    /// Waits until as much of the picture is another than in `before` as is enough.
    fn until_changed(&self, name: &str, before: &RgbImage, mut is_enough: impl FnMut(f64) -> bool) {
        let now = || changed(&picture(&self.display.screen(), SCREEN), before);
        wait(
            || is_enough(now()).then_some(()),
            || {
                let kept = self.keep(name, &self.display.screen());
                format!("{name}: {:.2} % of the picture in {} is another", 100.0 * now(), kept.display())
            },
        );
    }

    /// Waits until a frame is shown in which the pointer is aside: the buttons over the picture are gone.
    fn until_aside(&self) {
        let is_plain = |pixel: &image::Rgb<u8>| pixel.0 == self.session.background.map(|part| (part * 255.0).round() as u8);
        let corner = || crop_imm(&self.display.screen(), PANEL + 8, 8, 160, 28).to_image();
        wait(|| corner().pixels().all(is_plain).then_some(()), || "the buttons over the picture stay".into());
    }

    /// The window's camera, by the clipboard, once it is another than `before`.
    fn camera(&self, before: Camera) -> Camera {
        self.display.press(&[keys::CONTROL, keys::letter('c')]);
        wait(
            || self.display.clipboard().and_then(|text| serde_json::from_str(&text).ok()).filter(|camera| *camera != before),
            || "the camera does not come into the clipboard".into(),
        )
    }
}

/// The middle of a button of the panel, by the same window without a display.
fn button(session: &Session, label: &str) -> [i16; 2] {
    let file = session.data.file.clone().expect("a file");
    let mesh = format::read_mesh(&file, &Progress::new()).expect("a mesh");
    let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a field");
    let options = Options {
        name: session.data.stem(),
        source: session.data.clone(),
        session: Some(session.clone()),
        recent: None,
        subject: Subject::Mesh(Arc::new(mesh), Arc::new(field)),
        component: Component::Magnitude,
        compare_with: None,
        view: View {
            camera: session.camera.expect("a camera"),
            transfer_function: session.transfer_function.clone(),
            settings: session.render,
        },
        params: session.thresholds.clone(),
        error: ErrorSampling::default(),
        memory_bytes: 1 << 30,
        device: octetra::render::DeviceChoice::Auto,
        folder: ".".into(),
    };
    let builder = Harness::builder().with_size(SCREEN.map(|n| n as f32)).wgpu_setup(wgpu_setup());
    let mut window = builder.build_eframe(|creation| Viewer::new(creation, options).expect("a window"));
    window.run_steps(2);
    let center = window.get_by_label(label).rect().center();
    [center.x as i16, center.y as i16]
}

/// That the panel is left, the status line below the picture, and both say something.
fn check_layout(screen: &RgbImage) {
    let fill = *screen.get_pixel(1, SCREEN[1] - 1);
    let is_plain = |x: u32, y: u32| *screen.get_pixel(x, y) == fill;
    assert!((0..SCREEN[1]).all(|y| is_plain(1, y)), "the panel reaches from the top to the bottom");
    assert!((PANEL + 2..SCREEN[0]).all(|x| is_plain(x, SCREEN[1] - 2)), "the status line lies below the picture");
    assert!((PANEL + 2..SCREEN[0]).all(|x| !is_plain(x, 2)), "the picture reaches to the top");
    let written = |left: u32, top: u32, width: u32, height: u32| {
        let part = crop_imm(screen, left, top, width, height).to_image();
        part.pixels().filter(|pixel| pixel.0.iter().all(|&level| level > 70)).count()
    };
    assert!(written(0, 0, PANEL, SCREEN[1]) > 3000, "the panel has widgets");
    assert!(written(SCREEN[0] - 600, SCREEN[1] - STATUS, 600, STATUS) > 200, "the status line says what draws");
}

#[test]
fn the_screen_shows_what_the_command_draws_and_mouse_and_keys_work() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path().canonicalize().expect("its path");
    done(&folder, &["generate", "wing", "--tets", "20000", "-o", "wing.vtu"]);
    let mesh = format::read_mesh(&folder.join("wing.vtu"), &Progress::new()).expect("a mesh");
    let bounds = mesh.bounds().translated(mesh.center());
    let start = Camera::orbit(bounds, 0, 1.3);
    let session = Session {
        data: Source::file(folder.join("wing.vtu")),
        camera: Some(start),
        thresholds: OctreeParams { max_depth: 6, ..OctreeParams::default() },
        background: [0.2; 3],
        furniture: Parts::NONE,
        render: RenderSettings { width: SCREEN[0] - PANEL, height: SCREEN[1] - STATUS, ..RenderSettings::default() },
        ..Session::default()
    };
    session.write(&folder.join("session.json")).expect("written");
    let display = Display::start(SCREEN);
    let bench = Bench { display: &display, folder: &folder, session };
    let window = display.open(&folder, &["view", "--session", "session.json", "--stats", "stats.json"], "wing - octetra");
    display.point(ASIDE);
    display.press(&[keys::letter('t')]); // the frame time is not in files

    let first = bench.drawn(start, SCREEN);
    bench.until("opened", SCREEN, &first);
    bench.keep("opened", &display.screen());
    check_layout(&display.screen());

    // A drag: the picture follows while the button is held, and is sharp when it rests.
    display.point(MIDDLE);
    display.button(1, true);
    let mut step = 0;
    bench.until_changed("dragged", &first, |share| {
        step = (step + 1).min(60); // a hand that moves until it sees what it wants
        display.point([MIDDLE[0] + 4 * step, MIDDLE[1] + step]);
        share > 0.05
    });
    display.button(1, false);
    display.point(ASIDE);
    bench.until_aside();
    let turned = bench.camera(start);
    assert!(turned.target.distance(start.target) < 1e-9 && turned.axes()[0].angle_between(start.axes()[0]) > 0.1, "{turned:?}");
    bench.until("turned", SCREEN, &bench.drawn(turned, SCREEN));

    // Keys: along +x, the help sheet, the probe.
    display.press(&[keys::letter('1')]);
    let aspect = f64::from(SCREEN[0] - PANEL) / f64::from(SCREEN[1] - STATUS);
    let ahead = turned.facing(glam::DVec3::X, glam::DVec3::Z).fitted(bounds, aspect);
    let expected = bench.drawn(ahead, SCREEN);
    bench.until("along_x", SCREEN, &expected);
    display.press(&[keys::F1]);
    bench.until_changed("help", &expected, |share| share > 0.2);
    display.press(&[keys::F1]);
    bench.until("help_closed", SCREEN, &expected);
    display.press(&[keys::letter('p')]);
    display.point(MIDDLE);
    bench.until_changed("probe", &expected, |share| share > 0.01);
    display.press(&[keys::letter('p')]);
    display.point(ASIDE);
    bench.until("probe_off", SCREEN, &expected);

    // Buttons of the panel: the sheet, and a screenshot, which is the command's to the byte.
    display.click(button(&bench.session, "Keys"));
    bench.until_changed("keys", &expected, |share| share > 0.2);
    display.press(&[keys::F1]);
    bench.until("keys_closed", SCREEN, &expected);
    display.click(button(&bench.session, "Screenshot"));
    let file = folder.join("wing_00.png");
    wait(|| file.exists().then_some(()), || "there is no screenshot".into());
    let written = image::open(&file).expect("a PNG").into_rgb8();
    assert!(written == expected, "{} is not what the command draws", bench.keep("screenshot", &written).display());
    display.point(ASIDE);

    // Another size.
    let smaller = [1000, 640];
    window.resize(smaller);
    bench.until("resized", smaller, &bench.drawn(ahead, smaller));
    closed(window, &folder);
}

/// Closes the window and looks at what it says of its frames.
fn closed(window: OpenWindow<'_>, folder: &Path) {
    assert_eq!(window.close().code(), Some(0));
    let text = std::fs::read_to_string(folder.join("stats.json")).expect("the window's times");
    let stats: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |at: &str| stats.pointer(at).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{at} is a number: {text}"));
    assert!(number("/ui/frames") > 20.0 && number("/moving/pictures") > 0.0, "{text}");
    for spread in ["ui/work", "ui/whole", "ui/parts/picture", "moving/picture", "moving/divisor"] {
        let [median, p95, max] = ["median", "p95", "max"].map(|key| number(&format!("/{spread}/{key}")));
        assert!(0.0 < median && median <= p95 && p95 <= max, "{spread}: {text}");
    }
    assert!(
        number("/ui/work/max") < number("/seconds") && stats["adapter"]["name"].as_str().is_some_and(|name| !name.is_empty()),
        "{text}"
    );
}
