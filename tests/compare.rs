//! `octetra compare` as a user runs it: numbers with closed forms, limits and exit status, maps, errors.

use image::{ImageBuffer, Luma, Rgb, Rgba};
use octetra::image::{Image, write_npy, write_values_npy};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `octetra compare` in a folder.
fn compare(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_octetra")).current_dir(folder).arg("compare").args(args).output().expect("the program starts")
}

/// The numbers of a comparison that must succeed.
fn numbers(folder: &Path, args: &[&str]) -> Value {
    let output = compare(folder, &[args, &["--json", "-"]].concat());
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON and nothing else")
}

/// The one line of a comparison that must fail.
fn refused(folder: &Path, args: &[&str]) -> String {
    let output = compare(folder, args);
    let error = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1), "{args:?}: {error}");
    assert!(error.starts_with("octetra: ") && error.lines().count() == 1, "{error}");
    error
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// A 40 x 30 RGB picture.
fn rgb(path: &Path, rule: impl Fn(u32, u32) -> [u8; 3]) {
    ImageBuffer::from_fn(40, 30, |x, y| Rgb(rule(x, y))).save(path).expect("written");
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
}

#[test]
fn a_constant_offset_has_a_known_psnr() {
    let folder = folder();
    // A quarter of the picture is black: not covered, and equal.
    rgb(&folder.path().join("a.png"), |x, _| if x < 10 { [0; 3] } else { [100, 100, 100] });
    rgb(&folder.path().join("b.png"), |x, _| if x < 10 { [0; 3] } else { [110, 110, 110] });
    let found = numbers(folder.path(), &["a.png", "b.png"]);
    let expected = -20.0 * (10.0f64 / 255.0).log10();
    near(number(&found["covered"], "psnr_db"), expected);
    near(number(&found["all"], "psnr_db"), expected + 10.0 * (4.0f64 / 3.0).log10());
    near(number(&found["covered"], "rmse"), 10.0 / 255.0);
    near(number(&found["all"], "max_difference"), 10.0 / 255.0);
    assert_eq!((number(&found["all"], "pixels"), number(&found["covered"], "pixels")), (1200.0, 900.0));
    assert!(found["coverage"].as_str().expect("the rule").contains("not black") && found["alpha"].is_null() && found["float"].is_null());
    assert!(number(&found["covered"], "flip_mean") > number(&found["all"], "flip_mean") && number(&found["flip"], "max") <= 1.0);
    near(number(&found["flip"], "pixels_per_degree"), f64::from(67.020_64f32));
    assert!((number(&found["all"], "ssim") - 0.994_581).abs() < 1e-4, "scikit-image's");
}

#[test]
fn one_pixel_is_found_and_mapped() {
    let folder = folder();
    rgb(&folder.path().join("a.png"), |_, _| [50; 3]);
    rgb(&folder.path().join("b.png"), |x, y| if (x, y) == (20, 15) { [50, 58, 50] } else { [50; 3] });
    let found = numbers(folder.path(), &["a.png", "b.png", "--map", "abs.png", "--map-of", "abs", "--gain", "20"]);
    near(number(&found["all"], "psnr_db"), 10.0 * (3.0 * 1200.0 / (8.0f64 / 255.0).powi(2)).log10());
    near(number(&found["all"], "max_difference"), 8.0 / 255.0);
    let map = image::open(folder.path().join("abs.png")).expect("a map").into_rgb8();
    assert!(map.enumerate_pixels().all(|(x, y, p)| p.0 == if (x, y) == (20, 15) { [0, 160, 0] } else { [0; 3] }));

    numbers(folder.path(), &["a.png", "b.png", "--map", "flip.png"]);
    let map = image::open(folder.path().join("flip.png")).expect("a map").into_rgb8();
    assert_eq!((map.dimensions(), map.get_pixel(0, 0).0), ((40, 30), [0, 0, 4]), "magma begins almost black");
    assert!(map.get_pixel(20, 15).0[0] > 4, "the pixel is seen");
}

#[test]
fn equal_pictures_are_identical() {
    let folder = folder();
    rgb(&folder.path().join("a.png"), |x, y| [x as u8, y as u8, 7]);
    let strict = ["a.png", "a.png", "--min-psnr", "90", "--max-flip", "0", "--min-ssim", "1", "--max-difference", "0"];
    let found = numbers(folder.path(), &strict);
    assert!(found["identical"] == true && found["all"]["identical"] == true && found["all"]["psnr_db"].is_null());
    assert_eq!((number(&found["all"], "ssim"), number(&found["flip"], "max")), (1.0, 0.0));
    assert!(found["limits"].as_object().expect("four").values().all(|limit| limit["passed"] == true));
    let said = String::from_utf8(compare(folder.path(), &["a.png", "a.png"]).stdout).expect("text");
    assert!(said.contains("PSNR          identical     identical"), "{said}");
}

#[test]
fn limits_decide_the_exit_status() {
    let folder = folder();
    rgb(&folder.path().join("a.png"), |_, _| [100; 3]);
    rgb(&folder.path().join("b.png"), |_, _| [151; 3]);
    let within = ["a.png", "b.png", "--min-psnr", "13.9", "--max-difference", "0.2", "--max-flip", "0.9", "--min-ssim", "0.5"];
    assert!(compare(folder.path(), &within).status.success(), "a difference of 51 of 255 is 0.2, 13.98 dB");
    let missed = |flag: &str, limit: &str| refused(folder.path(), &["a.png", "b.png", flag, limit]);
    let psnr = missed("--min-psnr", "14");
    assert!(psnr.contains("b.png: covered PSNR is 13.9794 dB, below --min-psnr 14"), "{psnr}");
    let largest = missed("--max-difference", "0.19");
    assert!(largest.contains("the largest difference is 0.2, above --max-difference 0.19"), "{largest}");
    assert!(missed("--max-flip", "0.01").contains("above --max-flip 0.01"));
    assert!(missed("--min-ssim", "0.999").contains("below --min-ssim 0.999"));
    let both = refused(folder.path(), &["a.png", "b.png", "--min-psnr", "14", "--max-flip", "0.01", "--json", "n.json"]);
    assert!(both.contains("--min-psnr") && both.contains("--max-flip"), "{both}");
    let written: Value = serde_json::from_str(&std::fs::read_to_string(folder.path().join("n.json")).expect("written")).expect("JSON");
    assert_eq!(written["limits"]["min_psnr"]["passed"], false);
}

#[test]
fn floats_are_compared_as_floats_too() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let mut image = Image { width: 16, height: 12, pixels: vec![[0.25, 0.25, 0.25, 0.5]; 192] };
    image.pixels[5] = [0.0; 4];
    write_npy(&at("a.npy"), &image).expect("written");
    image.pixels.iter_mut().skip(6).for_each(|p| p[0] += 1e-4);
    image.pixels[5][3] = 0.125;
    write_npy(&at("b.npy"), &image).expect("written");
    let found = numbers(folder.path(), &["a.npy", "b.npy"]);
    assert!(found["all"]["identical"] == true && found["identical"] == false, "equal as 8-bit pictures, not as floats");
    near(number(&found["float"]["all"], "max_difference"), f64::from(0.25f32 + 1e-4) - 0.25);
    assert_eq!(number(&found["covered"], "pixels"), 191.0);
    near(number(&found["alpha"], "max_outside"), 0.125);
    near(number(&found["alpha"], "rmse"), 0.125 / 192f64.sqrt());
    assert_eq!(number(&found["alpha"], "only_in_one"), 1.0);
    assert!(refused(folder.path(), &["a.npy", "b.npy", "--max-difference", "0.1"]).contains("0.125"), "alpha counts");

    // A PNG of 8 bits beside it: as 8-bit pictures.
    let bytes = image.to_bytes(octetra::image::Background::Color([0.0; 3]));
    image::save_buffer(at("a.png"), &bytes, 16, 12, image::ExtendedColorType::Rgb8).expect("written");
    let mixed = numbers(folder.path(), &["a.npy", "a.png"]);
    assert!(mixed["all"]["identical"] == true && mixed["float"].is_null() && mixed["alpha"].is_null());
    let float64: Vec<f64> = image.pixels.iter().flat_map(|p| p[..3].to_vec()).map(f64::from).collect();
    write_values_npy(&at("c.npy"), &[12, 16, 3], &float64).expect("written");
    assert_eq!(numbers(folder.path(), &["c.npy", "b.npy"])["identical"], true, "float64 without alpha");
}

#[test]
fn every_kind_of_png_is_read() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    ImageBuffer::from_fn(12, 12, |x, _| Luma([20 * x as u8])).save(at("grey8.png")).expect("written");
    ImageBuffer::from_fn(12, 12, |x, _| Luma([257 * 20 * x as u16])).save(at("grey16.png")).expect("written");
    ImageBuffer::from_fn(12, 12, |x, _| Rgb([20 * x as u8; 3])).save(at("rgb8.png")).expect("written");
    ImageBuffer::from_fn(12, 12, |x, _| Rgba([257 * 20 * x as u16, 257 * 20 * x as u16, 257 * 20 * x as u16, 65535]))
        .save(at("rgba16.png"))
        .expect("written");
    for other in ["grey16.png", "rgb8.png", "rgba16.png"] {
        let found = numbers(folder.path(), &["grey8.png", other]);
        assert!(found["identical"] == true && found["coverage"].as_str().is_some_and(|rule| rule.contains("no alpha")), "{other}: {found}");
    }
    assert_eq!(numbers(folder.path(), &["grey16.png", "rgba16.png"])["float"]["all"]["identical"], true, "16 bits are compared as such");
    // Straight alpha is multiplied in: half-transparent 200 over black is 100, and its alpha tells what is covered.
    ImageBuffer::from_fn(12, 12, |x, _| Rgba([200, 200, 200, if x < 6 { 51u8 } else { 0 }])).save(at("half.png")).expect("written");
    ImageBuffer::from_fn(12, 12, |x, _| Rgb([if x < 6 { 40u8 } else { 0 }; 3])).save(at("over.png")).expect("written");
    let found = numbers(folder.path(), &["half.png", "over.png"]);
    assert!(found["all"]["identical"] == true && number(&found["covered"], "pixels") == 72.0, "{found}");
}

#[test]
fn values_are_compared_in_parts_of_their_range() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let a: Vec<f32> = (0..144).map(|i| if i == 0 { f32::NAN } else { i as f32 }).collect();
    let b: Vec<f32> = (0..144).map(|i| if i == 143 { f32::NAN } else { i as f32 + 1.42 }).collect();
    write_values_npy(&at("a.npy"), &[12, 12], &a).expect("written");
    write_values_npy(&at("b.npy"), &[12, 12], &b).expect("written");
    let found = numbers(folder.path(), &["a.npy", "b.npy"]);
    assert_eq!(found["value_range"], serde_json::json!([1.0, 143.0]));
    assert!((number(&found["float"]["all"], "rmse") - 0.01).abs() < 1e-6, "142 to a whole: {found}");
    assert_eq!((number(&found["float"]["all"], "pixels"), number(&found["alpha"], "only_in_one")), (142.0, 2.0));
}

#[test]
fn small_pictures_are_compared_as_far_as_that_goes() {
    let folder = folder();
    let save = |name: &str, size: [u32; 2], v: u8| {
        ImageBuffer::from_pixel(size[0], size[1], Rgb([v; 3])).save(folder.path().join(name)).expect("written");
    };
    for size in [[1, 1], [1, 200], [200, 1], [10, 40]] {
        save("a.png", size, 0);
        save("b.png", size, 255);
        let found = numbers(folder.path(), &["a.png", "b.png", "--map", "map.png", "--map-of", "abs"]);
        assert!(found["covered"].is_null() && found["all"]["ssim"].is_null(), "black covers nothing: {found}");
        near(number(&found["all"], "psnr_db"), 0.0);
        assert!(number(&found["flip"], "mean") > 0.9);
        assert!(refused(folder.path(), &["a.png", "b.png", "--min-ssim", "0.5"]).contains("11 x 11"));
        assert!(refused(folder.path(), &["a.png", "b.png", "--min-psnr", "10"]).contains("PSNR is 0 dB"), "all pixels count then");
    }
}

#[test]
fn what_cannot_be_compared_is_said_in_one_line() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    rgb(&at("a.png"), |_, _| [9; 3]);
    let png = std::fs::read(at("a.png")).expect("a file");
    ImageBuffer::from_pixel(3, 2, Rgb([1u8; 3])).save(at("small.png")).expect("written");
    std::fs::write(at("cut.png"), &png[..png.len() / 2]).expect("written");
    std::fs::write(at("text.png"), "no picture").expect("written");
    std::fs::write(at("empty.npy"), "").expect("written");
    let mut huge = png.clone();
    huge[16..24].copy_from_slice(&[0, 1, 0x86, 0xa0, 0, 1, 0x86, 0xa0]);
    let crc = crc32(&huge[12..29]);
    huge[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(at("huge.png"), huge).expect("written");
    write_values_npy(&at("four.npy"), &[1, 2, 3, 4], &[0f32; 24]).expect("written");
    write_values_npy(&at("whole.npy"), &[2, 2], &[1u8; 4]).expect("written");
    write_values_npy(&at("none.npy"), &[0, 5, 3], &[0f32; 0]).expect("written");
    write_values_npy(&at("nan.npy"), &[1, 2, 4], &[0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 0.0, 1.0]).expect("written");
    write_values_npy(&at("values.npy"), &[30, 40], &[1f32; 1200]).expect("written");
    let npy = std::fs::read(at("values.npy")).expect("a file");
    std::fs::write(at("cut.npy"), &npy[..npy.len() - 10]).expect("written");
    std::fs::create_dir(at("folder.png")).expect("made");
    let says = |args: &[&str], parts: &[&str]| {
        let error = refused(folder.path(), args);
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    says(&["a.png", "small.png"], &["small.png", "3 x 2", "40 x 30"]);
    says(&["a.png", "missing.png"], &["missing.png", "No such file"]);
    says(&["a.png", "folder.png"], &["folder.png", "is a folder"]);
    says(&["text.png", "a.png"], &["text.png", "neither a PNG nor an NPY"]);
    says(&["empty.npy", "a.png"], &["empty.npy", "neither"]);
    says(&["a.png", "cut.png"], &["cut.png"]);
    says(&["a.png", "cut.npy"], &["cut.npy", "1197 numbers, expected 1200"]);
    says(&["huge.png", "a.png"], &["huge.png", "100000 x 100000 pixels"]);
    says(&["a.png", "four.npy"], &["four.npy", "[1, 2, 3, 4]", "(height, width, 4)"]);
    says(&["a.png", "whole.npy"], &["whole.npy", "u1", "float32"]);
    says(&["a.png", "none.npy"], &["none.npy", "5 x 0 pixels"]);
    says(&["nan.npy", "nan.npy"], &["nan.npy", "1 of 2 pixels", "finite"]);
    says(&["a.png", "values.npy"], &["values.npy", "one value per pixel", "colours"]);
    says(&["flow.vtu", "a.png"], &["flow.vtu", "a mesh", "PNG or NPY"]);
    says(&["a.png", "a.png", "--map", "./a.png"], &["a.png", "is the reference"]);
    says(&["small.png", "a.png", "--json", "a.png"], &["a.png", "is the image"]);
    says(&["a.png", "a.png", "--map", "m", "--json", "m"], &["two outputs"]);
    says(&["a.png", "a.png", "--map", "no/folder/m.png"], &["no/folder"]);
    assert_eq!(std::fs::read(at("a.png")).expect("a file"), png, "the reference stays whole");
}

/// The check sum of PNG chunks, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _: u32| (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
    !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn wrong_usage_has_its_own_status() {
    let folder = folder();
    for args in [
        &["a.png"][..],
        &["a.png", "b.png", "--max-flip", "-1"],
        &["a.png", "b.png", "--min-ssim", "2"],
        &["a.png", "b.png", "--map-of", "abs"],
        &["a.png", "b.png", "--map", "m.png", "--gain", "0"],
        &["a.png", "b.png", "--pixels-per-degree", "0"],
    ] {
        assert_eq!(compare(folder.path(), args).status.code(), Some(2), "{args:?}");
    }
}
