//! Sessions and sequences from the command line.

mod program;

use octetra::session::{Session, Source};
use octetra::view::{Camera, Isosurface, Isosurfaces, Mode, Projection, RenderSettings, Shading, TransferFunction};
use octetra::{OctreeParams, octree::Preset};
use program::{done, octetra};
use std::path::Path;

fn bytes(path: impl AsRef<Path>) -> Vec<u8> {
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.as_ref().display()))
}

fn refused(folder: &Path, args: &[&str], expected: &str) {
    let output = octetra(folder, args);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains(expected), "octetra {args:?}: {said}");
}

#[test]
fn a_session_draws_what_its_flags_draw() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path();
    done(folder, &["generate", "ball", "--tets", "3000", "-o", "ball.vtu"]);
    let camera = Camera {
        eye: [3.0, 2.0, 1.0].into(),
        target: [0.1, 0.0, 0.0].into(),
        up: [0.0, 0.1, 1.0].into(),
        projection: Projection::Parallel { view_height: 2.5 },
    };
    std::fs::write(folder.join("camera.json"), serde_json::to_string(&camera).expect("JSON")).expect("written");
    let session = Session {
        data: Source::file(folder.join("ball.vtu")),
        thresholds: OctreeParams { max_depth: 4, ..Preset::Balanced.params() },
        camera: Some(camera),
        transfer_function: TransferFunction::preset("turbo").expect("a preset"),
        render: RenderSettings {
            mode: Mode::Composite,
            isosurfaces: Isosurfaces::new(&[Isosurface { value: 0.5, color: Some([1.0, 0.5, 0.0]), opacity: 0.5 }]).expect("valid"),
            shading: Shading { volume: true, ..Shading::default() },
            ..RenderSettings::new(90, 60)
        },
        background: [0.25, 0.5, 1.0],
        furniture: "bar,axes".parse().expect("parts"),
        ..Session::default()
    };
    std::fs::create_dir(folder.join("sessions")).expect("a folder");
    session.write(&folder.join("sessions/ball.json")).expect("written");

    let plain = ["render", "ball.vtu", "--max-depth", "4", "--camera", "camera.json", "--device", "cpu", "--size", "90x60"];
    let looks = ["--iso", "0.5", "--iso-opacity", "0.5", "--iso-color", "1,0.5,0", "--shade", "phong", "--background", "0.25,0.5,1"];
    let ends = ["--tf", "turbo", "--furniture", "bar,axes", "-o", "flags.png"];
    done(folder, &[&plain[..], &looks, &ends].concat());
    let of_session = |flags: &[&str], output: &str| {
        done(folder, &[&["render", "--session", "sessions/ball.json", "--device", "cpu", "-o", output], flags].concat());
        bytes(folder.join(output))
    };
    assert!(of_session(&[], "session.png") == bytes(folder.join("flags.png")));

    // Flags beside it go before it.
    done(folder, &[&plain[..8], &["--size", "50x40", "--transparent", "--shade", "phong", "-o", "other.png"]].concat());
    let flags = ["--size", "50x40", "--transparent", "--furniture", "none", "--tf", "standard"];
    let with_iso = of_session(&flags, "with.png");
    let iso_less = Session { render: RenderSettings { isosurfaces: Isosurfaces::NONE, ..session.render }, ..session.clone() };
    iso_less.write(&folder.join("sessions/ball.json")).expect("written");
    assert!(of_session(&flags, "without.png") == bytes(folder.join("other.png")));
    assert!(with_iso != bytes(folder.join("other.png")), "isosurfaces are the session's");

    refused(folder, &["render", "--session", "camera.json"], "camera.json: not a session: there is no key \"octetra_session\"");
    refused(folder, &["render", "--session", "none.json"], "none.json");
    refused(folder, &["render", "--session", "sessions/ball.json", "-o", "sessions/ball.json"], "is the session");
    std::fs::write(folder.join("odd.json"), r#"{"octetra_session": 1, "render": {"steps": 3}}"#).expect("written");
    refused(folder, &["render", "--session", "odd.json"], "odd.json: not a session: render.steps");
    std::fs::write(folder.join("gone.json"), r#"{"octetra_session": 1, "data": {"file": "gone.vtu"}}"#).expect("written");
    refused(folder, &["render", "--session", "gone.json"], "gone.vtu");
}

#[test]
fn turntables_and_ways_are_pictures_from_their_cameras() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path();
    done(folder, &["generate", "ball", "--tets", "3000", "-o", "ball.vtu"]);
    let plain = ["render", "ball.vtu", "--max-depth", "4", "--size", "40x30", "--device", "cpu"];
    let run = |flags: &[&str]| done(folder, &[&plain[..], flags].concat());
    // The orbit's views are 30 degrees apart about the same axis.
    run(&["--turntable", "12", "-o", "turn_{i}.png", "--stats", "turn.json"]);
    let turned = |n: usize| image::load_from_memory(&bytes(folder.join(format!("turn_{n:02}.png")))).expect("a PNG").into_rgb8();
    for view in [0, 5] {
        run(&["--orbit", &view.to_string(), "-o", "one.png"]);
        let one = image::open(folder.join("one.png")).expect("a PNG").into_rgb8();
        let worst = turned(view).as_raw().iter().zip(one.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(2), "view {view}: {worst:?} levels apart");
    }
    assert!(turned(11) != turned(0) && !folder.join("turn_12.png").exists());
    run(&["--turntable", "2", "--transparent"]);
    assert!(image::open(folder.join("ball_1.png")).expect("a PNG").color().has_alpha());

    // A way begins and ends at its cameras.
    let bounds = octetra::geometry::Aabb { min: [-1.0, -1.0, -1.0].into(), max: [1.0, 1.0, 1.0].into() };
    let keys = [0, 2].map(|view| Camera::orbit(bounds, view, 1.0));
    std::fs::write(folder.join("way.json"), serde_json::to_string(&keys).expect("JSON")).expect("written");
    run(&["--camera-path", "way.json", "--frames", "3", "-o", "way_{i}.png"]);
    for (n, key) in [(0, keys[0]), (2, keys[1])] {
        std::fs::write(folder.join("key.json"), serde_json::to_string(&key).expect("JSON")).expect("written");
        run(&["--camera", "key.json", "-o", "key.png"]);
        assert!(bytes(folder.join("key.png")) == bytes(folder.join(format!("way_{n}.png"))), "key {n}");
    }

    refused(folder, &["render", "--turntable", "3", "-o", "turn.png"], "turn.png: expected {i} in the file's name");
    refused(folder, &["render", "--turntable", "0"], "--turntable");
    refused(folder, &["render", "--turntable", "3", "--raw", "raw.npy"], "--raw, --value and --depth are of one picture");
    refused(folder, &["render", "--camera-path", "way.json"], "--frames");
    std::fs::write(folder.join("short.json"), serde_json::to_string(&keys[..1]).expect("JSON")).expect("written");
    refused(folder, &["render", "--camera-path", "short.json", "--frames", "3"], "short.json: 1 cameras, expected at least 2");
}
