//! Time series from the command line.

mod program;
mod steps;

use octetra::session::{Session, Source};
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

/// A small picture by these flags.
fn picture(folder: &Path, flags: &[&str]) -> Vec<u8> {
    done(folder, &[&["render", "--device", "cpu", "--size", "24x16", "--max-depth", "4", "-o", "one.png"], flags].concat());
    bytes(folder.join("one.png"))
}

fn series() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    steps::write(folder.path());
    folder
}

#[test]
fn info_lists_the_steps_without_reading_them() {
    let root = series();
    let folder = root.path();
    std::fs::remove_file(folder.join("flow_10.vtu")).expect("gone");
    std::fs::write(folder.join("flow_2.vtu"), "no mesh").expect("written");
    let said = done(folder, &["info", "flow.pvd"]);
    for line in ["3, times 0 .. 2", "0        0  flow_1.vtu\n", "1        0.5  flow_2.vtu\n", "2        2  flow_10.vtu  (missing)\n"] {
        assert!(said.contains(line), "{line}: {said}");
    }
    let said = done(folder, &["info", "flow_*.vtu", "--time-step", "0"]);
    assert!(said.contains("point array   p  0 .. 1  <- shown"), "{said}");
    refused(folder, &["info", "flow.pvd", "--time", "2"], "flow_10.vtu");
    refused(folder, &["info", "flow.pvd", "--time-step", "3"], "flow.pvd: has 3 steps, times 0 to 2; there is no step 3, expected 0 to 2");
    refused(folder, &["info", "flow.pvd", "--time", "2.5"], "flow.pvd: has 3 steps, times 0 to 2; 2.5 is not among them");
    refused(folder, &["info", "flow_1.vtu", "--time", "1"], "flow_1.vtu: --time and --time-step choose a step of a series");
    refused(folder, &["info", "ebb_*.vtu"], "ebb_*.vtu: no file has a name like this");
}

#[test]
fn a_step_is_drawn_as_its_file_is() {
    let root = series();
    let folder = root.path();
    let single = picture(folder, &["flow_2.vtu"]);
    assert!(single != picture(folder, &["flow_2.vtu", "--range", "0,9"]), "pictures tell ranges apart");
    for flags in
        [["flow.pvd", "--time-step", "1"], ["flow.pvd", "--time", "0.7"], ["flow_*.vtu", "--time-step", "1"], ["flow_*.vtu", "--time", "2"]]
    {
        assert!(picture(folder, &flags) == single, "{flags:?}");
    }
    assert!(picture(folder, &["flow_10.vtu", "flow_2.vtu", "flow_1.vtu", "--time", "2"]) == single, "files one by one");
    assert!(picture(folder, &["flow.pvd"]) == picture(folder, &["flow_1.vtu"]), "the first step");
    let over_time = picture(folder, &["flow.pvd", "--range-over", "time"]);
    assert!(over_time == picture(folder, &["flow_1.vtu", "--range", "0,3"]), "the range of all");
    assert!(picture(folder, &["flow.pvd", "--range-over", "time", "--array", "q"]) == over_time, "of the array that is shown");
    let probed = done(folder, &["probe", "flow.pvd", "--time", "0.5", "--at", "0.5,0.5,0.5", "--max-depth", "3"]);
    assert!(probed.contains("1.5"), "half of 3: {probed}");

    let session = Session { data: Source { step: Some(1), ..Source::file(folder.join("flow.pvd")) }, ..Session::default() };
    session.write(&folder.join("flow.json")).expect("written");
    assert!(picture(folder, &["--session", "flow.json"]) == single);
    assert!(picture(folder, &["--session", "flow.json", "--time", "0"]) == picture(folder, &["flow_1.vtu"]), "flags go before it");
    assert!(picture(folder, &["--session", "flow.json", "flow_2.vtu"]) == single, "a file of one's own has no steps");
    refused(folder, &["render", "flow_1.vtu", "--range-over", "time"], "flow_1.vtu: --range-over is for the steps of a series");
}

#[test]
fn every_step_is_drawn_in_the_same_colours_or_its_own() {
    let root = series();
    let folder = root.path();
    let draw = |flags: &[&str]| {
        let plain = ["render", "flow.pvd", "--device", "cpu", "--size", "24x16", "--max-depth", "4", "-o", "all_{i}.png"];
        done(folder, &[&plain[..], flags].concat());
        [0, 1, 2].map(|i| bytes(folder.join(format!("all_{i}.png"))))
    };
    let files = steps::STEPS.map(|(_, file, _)| file);
    let own = draw(&["--range-over", "step"]);
    assert!(own == files.map(|file| picture(folder, &[file])));
    let same = draw(&[]);
    assert!(same == files.map(|file| picture(folder, &[file, "--range", "0,3"])));
    assert!(same[0] != own[0] && same[1] == own[1], "the second step has the widest range");
    assert!(draw(&["--range", "0,2"])[2] == own[2], "a range that is named goes before");
    done(folder, &["render", "flow.pvd", "--device", "cpu", "--size", "9", "--turntable", "2", "--time", "0.5", "-o", "turn_{i}.png"]);
    assert!(folder.join("turn_1.png").exists() && !folder.join("turn_2.png").exists(), "a turn of one step");

    refused(folder, &["render", "flow.pvd", "-o", "all_{i}.png", "--raw", "raw.npy"], "are of one picture");
    let before = files.map(|file| bytes(folder.join(file)));
    refused(folder, &["render", "flow.pvd", "-o", "flow_{i}.vtu"], "is a step of the series, an output would overwrite it");
    refused(folder, &["render", "flow.pvd", "-o", "flow.pvd"], "is the list of the steps");
    assert!(before == files.map(|file| bytes(folder.join(file))));
    std::fs::remove_file(folder.join("flow_2.vtu")).expect("gone");
    refused(folder, &["render", "flow.pvd", "-o", "gone_{i}.png"], "flow_2.vtu: is not there; the series has it at 0.5");
    assert!(!folder.join("gone_0.png").exists(), "before the first is drawn");
}
