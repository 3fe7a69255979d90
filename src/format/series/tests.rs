use super::*;

fn written(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    }
    folder
}

/// Times and names, as seen from the folder.
fn steps(folder: &Path, name: &str) -> Vec<(f64, String)> {
    let series = Series::open(&folder.join(name), &[]).expect("sound").expect("a series");
    let relative = |path: &Path| path.strip_prefix(folder).expect("in the folder").to_string_lossy().replace('\\', "/");
    series.steps().iter().map(|step| (step.time, relative(&step.path))).collect()
}

fn pvd(data_sets: &str) -> String {
    format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\"><Collection>{data_sets}</Collection></VTKFile>\n")
}

fn refused(name: &str, text: &str) -> String {
    let folder = written(&[(name, text)]);
    let error = Series::open(&folder.path().join(name), &[]).expect_err(text).to_string();
    assert!(error.contains(name), "{error}");
    error
}

fn named(pairs: &[(f64, &str)]) -> Vec<(f64, String)> {
    pairs.iter().map(|(time, name)| (*time, (*name).to_owned())).collect()
}

#[test]
fn a_collection_is_listed_by_time_without_its_files() {
    let text = pvd("<!-- as ParaView and others write it -->
         <DataSet timestep=\"1e1\" group=\"\" part=\"0\" file=\"late.vtu\"/>
         <DataSet timestep=\" -0.5 \" part='0' file='run/a&amp;b.vtu'></DataSet>
         <DataSet timestep=\"2\" file=\"./middle.vtu\"/>");
    let folder = written(&[("flow.pvd", &text)]);
    assert_eq!(steps(folder.path(), "flow.pvd"), named(&[(-0.5, "run/a&b.vtu"), (2.0, "middle.vtu"), (10.0, "late.vtu")]));
}

#[test]
fn broken_collections_say_what_was_expected() {
    let entry = |time: &str, file: &str| format!("<DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>");
    for (text, expected) in [
        (pvd(""), "lists no file"),
        (pvd(&entry("soon", "a.vtu")), "entry 1 has the time \"soon\", expected a finite number"),
        (pvd(&(entry("0", "a.vtu") + &entry("inf", "b.vtu"))), "entry 2 has the time \"inf\""),
        (pvd("<DataSet file=\"a.vtu\"/>"), "entry 1 has the time \"\""),
        (pvd("<DataSet timestep=\"0\"/>"), "entry 1 has the file \"\", expected one in the list's folder"),
        (pvd(&entry("0", "../a.vtu")), "entry 1 has the file \"../a.vtu\", expected one in the list's folder"),
        (pvd(&entry("0", "run/../../a.vtu")), "expected one in the list's folder"),
        (pvd(&entry("0", "/etc/a.vtu")), "entry 1 has the file \"/etc/a.vtu\""),
        (
            pvd(&(entry("0.5", "a.vtu") + &entry("1", "c.vtu") + &entry("0.5", "b.vtu"))),
            "2 files for the time 0.5 (a.vtu, b.vtu), expected one",
        ),
        ("<VTKFile type=\"UnstructuredGrid\"></VTKFile>".into(), "not a .pvd file"),
        ("<VTKFile type=\"Collection\"></VTKFile>".into(), "no element <Collection>"),
        ("<VTKFile type=\"Collection\"><Collection>".into(), "the file ends within <Collection>"),
        ("<!DOCTYPE x [<!ENTITY a \"b\">]><VTKFile type=\"Collection\"/>".into(), "DOCTYPE"),
        ("timestep, file\n".into(), "not a .pvd file"),
        (String::new(), "not a .pvd file"),
    ] {
        let said = refused("flow.pvd", &text);
        assert!(said.contains(expected), "{text}: {said}");
    }
    let missing = Series::open(Path::new("no-such.pvd"), &[]).expect_err("no file").to_string();
    assert!(missing.starts_with("no-such.pvd: "), "{missing}");
    let folder = written(&[("flow.pvd/a", "")]);
    let said = Series::open(&folder.path().join("flow.pvd"), &[]).expect_err("a folder").to_string();
    assert!(said.contains("not a regular file") || said.contains("flow.pvd"), "{said}");
}

#[test]
fn paraviews_list_is_read_with_and_without_times() {
    let timed = r#"{"file-series-version": "1.0", "files": [{"name": "b.vtk", "time": 0.5}, {"name": "a.vtk", "time": 0}]}"#;
    let counted = r#"{"file-series-version": "1.0", "files": [{"name": "b.vtk"}, {"name": "a.vtk"}]}"#;
    let folder = written(&[("timed.vtk.series", timed), ("counted.vtk.series", counted)]);
    assert_eq!(steps(folder.path(), "timed.vtk.series"), named(&[(0.0, "a.vtk"), (0.5, "b.vtk")]));
    assert_eq!(steps(folder.path(), "counted.vtk.series"), named(&[(0.0, "b.vtk"), (1.0, "a.vtk")]));
    for (text, expected) in [
        (r#"{"files": []}"#, "lists no file"),
        (r#"{"files": [{"name": "../a.vtk", "time": 0}]}"#, "\"../a.vtk\", expected one in the list's folder"),
        (r#"{"files": [{"name": "a.vtk", "time": 0}, {"name": "b.vtk"}]}"#, "entry 2 has the time \"\""),
        (r#"{"files": [{"name": "a.vtk", "time": 0}, {"name": "b.vtk", "time": 0}]}"#, "2 files for the time 0"),
        (r#"{"files": [{"name": "a.vtk", "time": "x"}]}"#, "expected {\"files\""),
        (r#"{"steps": []}"#, "expected {\"files\""),
        ("", "expected {\"files\""),
    ] {
        let said = refused("flow.vtk.series", text);
        assert!(said.contains(expected), "{text}: {said}");
    }
}

#[test]
fn patterns_go_by_the_number() {
    let names = ["flow_10.vtu", "flow_9.vtu", "flow_0.25.vtu", "flow_mean.vtu", "flow_.vtu", "flow_1e3.vtu", "flow_11.vtk", "xflow_1.vtu"];
    let folder = written(&names.map(|name| (name, "")));
    let expected = named(&[(0.25, "flow_0.25.vtu"), (9.0, "flow_9.vtu"), (10.0, "flow_10.vtu")]);
    assert_eq!(steps(folder.path(), "flow_*.vtu"), expected);
    for (pattern, expected) in [("f*w_*.vtu", "expected one *"), ("*/flow_1.vtu", "expected one *"), ("wing_*.vtu", "no file has a name")] {
        let said = Series::open(&folder.path().join(pattern), &[]).expect_err(pattern).to_string();
        assert!(said.contains(expected) && said.contains(pattern), "{pattern}: {said}");
    }
    assert_eq!(Series::open(&folder.path().join("flow_9.vtu"), &[]).expect("no list is read"), None, "a single file");
    assert_eq!(siblings(&folder.path().join("flow_9.vtu")), Some((folder.path().join("flow_*.vtu"), 3)));
    assert_eq!(siblings(&folder.path().join("flow_11.vtk")), None, "there is no other");
    assert_eq!(siblings(&folder.path().join("flow_0.25.vtu")), Some((folder.path().join("flow_*.vtu"), 3)), "the whole number");
    assert_eq!(siblings(&folder.path().join("flow_mean.vtu")), None);
}

#[test]
fn files_one_by_one_go_by_their_last_number_or_as_they_stand() {
    let open = |names: &[&str]| {
        let more: Vec<PathBuf> = names[1..].iter().map(PathBuf::from).collect();
        Series::open(Path::new(names[0]), &more)
    };
    let times = |names: &[&str]| -> Vec<(f64, String)> {
        let series = open(names).expect("sound").expect("a series");
        series.steps().iter().map(|step| (step.time, step.path.display().to_string())).collect()
    };
    assert_eq!(times(&["a/u2_10.vtu", "b/u2_9.vtu"]), named(&[(9.0, "b/u2_9.vtu"), (10.0, "a/u2_10.vtu")]));
    assert_eq!(times(&["flow.vtu", "ebb.vtu"]), named(&[(0.0, "flow.vtu"), (1.0, "ebb.vtu")]));
    assert_eq!(times(&["t9_p1.vtu", "t8_p1.vtu"]), named(&[(0.0, "t9_p1.vtu"), (1.0, "t8_p1.vtu")]));
    assert_eq!(times(&["flow_1.0.vtu", "flow_0.25.vtu"]), named(&[(0.25, "flow_0.25.vtu"), (1.0, "flow_1.0.vtu")]));
    assert_eq!(times(&["run1.10.vtu", "run1.9.vtu"]), named(&[(9.0, "run1.9.vtu"), (10.0, "run1.10.vtu")]));
    assert!(open(&["a1.vtu", "a2.vtu", "a1.vtu"]).is_err_and(|error| error.to_string() == "a1.vtu: is named twice"));
}

#[test]
fn the_nearest_step_is_found_within_the_span() {
    let step = |time: f64| Step { time, path: PathBuf::new() };
    let series = Series::new([2.0, 0.0, 1.0].map(step).to_vec()).expect("steps");
    assert_eq!([0.0, 0.4, 0.5, 0.6, 2.0].map(|time| series.nearest(time)), [0, 0, 0, 1, 2].map(Some));
    assert_eq!([-0.1, 2.1, f64::NAN].map(|time| series.nearest(time)), [None; 3]);
    assert_eq!(series.span(), [0.0, 2.0]);
}
