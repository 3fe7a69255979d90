//! Stores of bricks, as commands write and read them.

mod program;

use program::{done, octetra};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// A volume of waves as plain bytes.
fn waves(path: &Path, [nx, ny, nz]: [u32; 3]) {
    let mut bytes = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let value = (x as f32 * 0.11).sin() * 50.0 + (y as f32 * 0.07).cos() * 30.0 + z as f32;
                bytes.push(value.clamp(0.0, 255.0) as u8);
            }
        }
    }
    std::fs::write(path, bytes).expect("written");
}

const DIMS: [u32; 3] = [300, 200, 260];
const RAW: [&str; 4] = ["--dims", "300,200,260", "--type", "u8"];

/// The arguments of a command that writes a store of the waves in shards of one brick.
fn bricks<'a>(store: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["bricks", "waves.raw", "-o", store, "--memory", "3MiB"], &RAW[..], more].concat()
}

fn files(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![path.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let entry = entry.expect("an entry").path();
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.extension().is_none_or(|suffix| suffix != "unfinished") {
                found.insert(entry.strip_prefix(path).expect("below").to_owned(), std::fs::read(&entry).expect("read"));
            }
        }
    }
    found
}

fn refused(folder: &Path, args: &[&str]) -> String {
    let output = octetra(folder, args);
    assert_eq!(output.status.code(), Some(1), "{args:?}");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

#[test]
fn a_store_that_was_killed_twenty_times_ends_in_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    waves(&folder.join("waves.raw"), DIMS);
    let text = done(folder, &bricks("whole.zarr", &[]));
    assert!(text.contains("levels        4") && text.contains("of 64 voxels a side"), "{text}");
    let (mut state, mut resumed) = (12345u64, 0);
    let shards =
        || std::fs::read_dir(folder.join("killed.zarr/statistics/0/c")).map_or(0, |_| files(&folder.join("killed.zarr/statistics")).len());
    for _ in 0..20 {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        // Killed some microseconds after it has gone on by some shards.
        let goal = shards() + (state >> 40 & 3) as usize;
        resumed += usize::from(shards() > 0);
        let mut run = Command::new(env!("CARGO_BIN_EXE_octetra"))
            .current_dir(folder)
            .args(bricks("killed.zarr", &[]))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        while shards() < goal && run.try_wait().expect("it runs").is_none() {
            std::thread::sleep(Duration::from_micros(300));
        }
        std::thread::sleep(Duration::from_micros(state >> 20 & 4095));
        run.kill().expect("killed");
        run.wait().expect("ended");
        if folder.join("killed.zarr/zarr.json").is_file() {
            // Killed in its last steps; what it left of them is tidied up.
            assert!(refused(folder, &bricks("killed.zarr", &[])).contains("exists already"));
            break;
        }
        if folder.join("killed.zarr/octetra-build.json").is_file() {
            let error = refused(folder, &["slice", "killed.zarr", "--voxel", "z=1", "-o", "s.png"]);
            assert!(error.contains("killed.zarr: is not whole, its writing was stopped"), "{error}");
        }
    }
    // A fast machine may have ended before the last kill.
    if folder.join("killed.zarr/octetra-build.json").is_file() {
        let text = done(folder, &bricks("killed.zarr", &[]));
        assert!(text.contains(" were there"), "{text}");
    }
    assert!(resumed > 0, "no run went on with what another had written");
    let (killed, whole) = (files(&folder.join("killed.zarr")), files(&folder.join("whole.zarr")));
    assert!(whole.len() > 100 && killed.keys().eq(whole.keys()), "{} files, {}", killed.len(), whole.len());
    for (name, bytes) in &whole {
        assert!(killed[name] == *bytes, "{} differs", name.display());
    }
}

#[test]
fn slices_are_those_of_the_volume_and_errors_say_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    waves(&folder.join("waves.raw"), DIMS);
    done(folder, &bricks("w.zarr", &["--spacing", "0.5,1,2"]));
    let volume = std::fs::read(folder.join("waves.raw")).expect("read");
    let values = |args: &[&str]| {
        done(folder, &[&["slice", "w.zarr", "-o", "s.npy"], args].concat());
        let bytes = std::fs::read(folder.join("s.npy")).expect("read");
        let file = npyz::NpyFile::new(&bytes[..]).expect("an array");
        (file.shape().to_vec(), file.into_vec::<f64>().expect("float64"))
    };
    let at = |x: u64, y: u64, z: u64| f64::from(volume[(x + 300 * (y + 200 * z)) as usize]);
    // By voxel and by world coordinates, interpolated and not, it is the same where voxels are.
    let (shape, by_voxel) = values(&["--voxel", "z=131"]);
    assert_eq!(shape, [200, 300]);
    for (i, &value) in by_voxel.iter().enumerate() {
        assert_eq!(value, at(i as u64 % 300, 199 - i as u64 / 300, 131));
    }
    assert_eq!(values(&["--voxel", "z=131", "--nearest"]).1, by_voxel);
    let (shape, along_x) = values(&["--voxel", "x=299"]);
    assert_eq!((shape, along_x[0]), (vec![260, 200], at(299, 0, 259)));
    // A quarter of the pixels come from a coarser level.
    let text = done(folder, &["slice", "w.zarr", "--voxel", "z=131", "--size", "150", "-o", "s.png"]);
    assert!(text.contains("150 x 100 pixels of level 1"), "{text}");
    let (shape, oblique) = values(&["--plane", "75,100,260:1,1,0.3", "--size", "64", "--nearest"]);
    assert_eq!(shape.iter().max(), Some(&64));
    assert!(oblique.iter().any(|v| v.is_nan()) && oblique.iter().filter(|v| !v.is_nan()).all(|v| (0.0..=255.0).contains(v)));
    let png = done(folder, &["slice", "w.zarr", "--plane", "z=262", "-o", "s.png", "--tf", "viridis", "--background", "1,1,1"]);
    assert!(png.contains("values        ") && folder.join("s.png").is_file(), "{png}");

    for (args, expected) in [
        (&["slice", "w.zarr", "--voxel", "z=260", "-o", "s.png"][..], "--voxel z=260: expected 0 to 259"),
        (&["slice", "w.zarr", "--voxel", "z=1", "--level", "4", "-o", "s.png"], "--level 4: w.zarr has levels 0 to 3"),
        (&["slice", "w.zarr", "--plane", "x=900", "-o", "s.png"], "--plane: misses w.zarr"),
        (&["slice", "w.zarr", "--voxel", "z=1", "-o", "s.jpg"], "s.jpg: expected the suffix .png or .npy"),
        (&["slice", "w.zarr", "--voxel", "z=1", "--opacity-scale", "2", "-o", "s.png"], "a slice is opaque: "),
        (&["slice", "w.zarr", "--voxel", "z=1", "--tf", "viridis", "-o", "s.npy"], "values have no colours: "),
        (&["slice", "waves.raw", "--voxel", "z=1", "-o", "s.png"], "waves.raw: "),
        (&["slice", "missing.zarr", "--voxel", "z=1", "-o", "s.png"], "missing.zarr: no such folder"),
        (&bricks("w.zarr", &[]), "w.zarr: exists already; --overwrite replaces a store"),
        (&bricks("waves.raw", &[]), "waves.raw: is the source or lies in the store, which would overwrite it"),
        (&["bricks", "waves.raw", "-o", "x.zarr"], "waves.raw: its format is not known"),
    ] {
        let error = refused(folder, args);
        assert!(error.contains(expected), "{args:?}: {error}");
    }
    done(folder, &bricks("w.zarr", &["--overwrite"]));
}

#[test]
fn a_mesh_becomes_bricks_through_its_octree() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    done(folder, &["generate", "ball", "--tets", "5000", "-o", "ball.vtu"]);
    let text = done(folder, &["bricks", "ball.vtu", "--resolution", "100", "--max-depth", "6", "-o", "ball.zarr"]);
    assert!(text.contains("100 x 100 x 100 f32, radius"), "{text}");
    done(folder, &["slice", "ball.zarr", "--plane", "z=0.005", "-o", "s.npy", "--size", "100", "--nearest"]);
    let bytes = std::fs::read(folder.join("s.npy")).expect("read");
    let file = npyz::NpyFile::new(&bytes[..]).expect("an array");
    let values = file.into_vec::<f64>().expect("float64");
    let middle = values[50 * 100 + 50];
    assert!(middle < 0.1 && values[0].is_nan(), "{middle} {}", values[0]);
}
