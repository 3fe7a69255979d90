//! Files made for the purpose: formats, geometry, the world, what is missing, and what is no survey.

use super::test_file::{TestFile, Trace, value};
use super::{LineBytes, SegyOptions, SegyVolume};
use crate::progress::Progress;
use crate::volume::{Samples, VoxelSource, VoxelType};
use glam::{DMat3, DVec3};
use std::ops::Range;

pub(super) const DIMS: [usize; 3] = [6, 5, 4];

fn all(volume: &SegyVolume) -> Samples {
    volume.read(&volume.frame().dims.map(|n| 0..n)).expect("read")
}

pub(super) fn sound(file: &TestFile) -> SegyVolume {
    sound_with(file, &SegyOptions::default())
}

fn sound_with(file: &TestFile, options: &SegyOptions) -> SegyVolume {
    file.open(options).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks every voxel; `expected` gives NaN for what is missing.
pub(super) fn check(volume: &SegyVolume, dims: [usize; 3], expected: impl Fn(usize, usize, usize) -> f64) {
    assert_eq!(volume.frame().dims.map(|n| n as usize), dims);
    let samples = all(volume);
    assert_eq!(samples.len(), dims.iter().product::<usize>());
    for i in 0..samples.len() {
        let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]);
        let (found, expected) = (samples.get(i), expected(x, y, z));
        assert!(found == expected || found.is_nan() && expected.is_nan(), "{found} at {x} {y} {z}, expected {expected}");
    }
}

pub(super) fn has_note(volume: &SegyVolume, text: &str) -> bool {
    volume.notes().iter().any(|note| note.contains(text))
}

#[test]
fn every_format_in_either_order_has_its_values() {
    let types = [
        (1, VoxelType::F32, VoxelType::F32),
        (2, VoxelType::I32, VoxelType::F64),
        (3, VoxelType::I16, VoxelType::F32),
        (5, VoxelType::F32, VoxelType::F32),
        (6, VoxelType::F64, VoxelType::F64),
        (7, VoxelType::I32, VoxelType::F32),
        (8, VoxelType::I8, VoxelType::F32),
        (10, VoxelType::U32, VoxelType::F64),
        (11, VoxelType::U16, VoxelType::F32),
        (15, VoxelType::U32, VoxelType::F32),
        (16, VoxelType::U8, VoxelType::F32),
    ];
    for (code, whole, holed) in types {
        for is_little in [false, true] {
            let is_signed = code < 10;
            let sign = |value: f64| if is_signed && value % 2.0 == 0.0 { -value } else { value };
            let mut file = TestFile::new(code, is_little, DIMS);
            file.traces.iter_mut().for_each(|trace| trace.values.iter_mut().for_each(|value| *value = sign(*value)));
            let volume = sound(&file);
            assert_eq!((volume.voxel_type(), VoxelType::of(&all(&volume))), (whole, whole), "{code}");
            check(&volume, DIMS, |x, y, z| sign(value(x, y, z)));
            assert!(has_note(&volume, if is_little { ", little-endian, 20 traces of 6 samples" } else { ", big-endian, 20 traces" }));
            assert_eq!(*volume.grid(&Progress::new()).expect("a grid").samples(), all(&volume));
            file.traces.remove(7);
            let volume = sound(&file);
            assert_eq!((volume.voxel_type(), VoxelType::of(&all(&volume))), (holed, holed), "{code}");
            check(&volume, DIMS, |x, y, z| if (y, z) == (2, 1) { f64::NAN } else { sign(value(x, y, z)) });
        }
    }
}

#[test]
fn values_at_the_ends_of_integers_are_kept() {
    for (code, ends) in
        [(2, [-2147483648.0, 2147483647.0]), (7, [-8388608.0, 8388607.0]), (10, [0.0, 4294967295.0]), (15, [0.0, 16777215.0])]
    {
        let mut file = TestFile::new(code, true, DIMS);
        file.traces[3].values[..2].copy_from_slice(&ends);
        let expected = |x: usize, y: usize, z: usize| if (y, z) == (3, 0) && x < 2 { ends[x] } else { value(x, y, z) };
        check(&sound(&file), DIMS, expected);
        file.traces.pop();
        check(&sound(&file), DIMS, |x, y, z| if (y, z) == (4, 3) { f64::NAN } else { expected(x, y, z) });
    }
}

#[test]
fn traces_may_come_in_any_order() {
    let mut file = TestFile::new(5, false, DIMS);
    let volume = sound(&file);
    check(&volume, DIMS, value);
    assert!(has_note(&volume, "inlines 100 to 109 (byte 189) and crosslines 20 to 28 (byte 193), in steps of 3 and 2"));
    assert_eq!((volume.line_bytes(), volume.missing_traces(), volume.bytes()), (LineBytes::STANDARD, 0, 80));
    file.traces.sort_by_key(|trace| trace.crossline);
    check(&sound(&file), DIMS, value);
    file.traces.reverse();
    check(&sound(&file), DIMS, value);
    file.traces.sort_by_key(|trace| trace.inline * trace.crossline % 101);
    check(&sound(&file), DIMS, value);
}

#[test]
fn dead_and_absent_traces_are_missing() {
    let mut file = TestFile::new(1, false, DIMS);
    file.traces[8].more = vec![(29, 2, 2)];
    file.traces[9].more = vec![(29, 2, 3)];
    // What a dead trace says of its place is not looked at.
    file.traces.push(Trace { inline: i32::MAX, crossline: -5, values: vec![0.0; 6], more: vec![(29, 2, 2)] });
    file.traces.remove(0);
    let volume = sound(&file);
    check(&volume, DIMS, |x, y, z| if [(0, 0), (3, 1), (4, 1)].contains(&(y, z)) { f64::NAN } else { value(x, y, z) });
    assert_eq!(volume.missing_traces(), 3);
    assert!(has_note(&volume, "3 of 20 positions have no trace; 3 traces are dead"), "{:?}", volume.notes());
    // A live trace has the place of a dead one.
    file.traces.push(Trace { inline: 103, crossline: 26, values: vec![7.5; 6], more: vec![] });
    let found = sound(&file).read(&[0..6, 3..4, 1..2]).expect("read");
    assert_eq!(found, Samples::F32(vec![7.5; 6].into()));
    file.traces.iter_mut().for_each(|trace| trace.more = vec![(29, 2, 2)]);
    assert!(file.error(&SegyOptions::default()).contains("21 traces, and all are dead"));
}

#[test]
fn what_f32_cannot_hold_is_missing() {
    let mut file = TestFile::new(1, false, DIMS);
    file.traces[0].values[..3].copy_from_slice(&[1e60, -1e39, 1e-60]);
    let volume = sound(&file);
    let expected = [f64::NAN, f64::NAN, 0.0];
    check(&volume, DIMS, |x, y, z| if (y, z) == (0, 0) && x < 3 { expected[x] } else { value(x, y, z) });
    assert_eq!(volume.grid(&Progress::new()).expect("a grid").missing(), 2);
    file.code = 6;
    file.traces[0].values[0] = f64::INFINITY;
    check(&sound(&file), DIMS, |x, y, z| match (x, y, z) {
        (0, 0, 0) => f64::NAN,
        (1 | 2, 0, 0) => file.traces[0].values[x],
        _ => value(x, y, z),
    });
}

#[test]
fn line_numbers_are_where_the_options_say_or_where_they_usually_are() {
    let mut file = TestFile::new(3, false, DIMS);
    file.line_bytes = [221, 57];
    let options = SegyOptions { iline_byte: Some(221), xline_byte: Some(57), ..Default::default() };
    check(&sound_with(&file, &options), DIMS, value);
    assert!(
        file.error(&SegyOptions::default()).contains("no 3-D geometry: its 20 traces have inline 0 (byte 189) and crossline 0 (byte 193)")
    );
    let beyond = SegyOptions { iline_byte: Some(238), ..options.clone() };
    assert!(file.error(&beyond).contains("bytes 238 and 57"));
    assert!(file.error(&SegyOptions { iline_byte: Some(0), ..options }).contains("bytes 0 and 57"));
    for line_bytes in [[9, 21], [5, 21]] {
        file.line_bytes = line_bytes;
        let volume = sound(&file);
        check(&volume, DIMS, value);
        let [inline, crossline] = line_bytes;
        assert!(has_note(&volume, &format!("those at bytes {inline} and {crossline} were taken")));
    }
    // The usual place of inline numbers, another of crossline numbers.
    file.line_bytes = [189, 21];
    let options = SegyOptions { xline_byte: Some(21), ..Default::default() };
    check(&sound_with(&file, &options), DIMS, value);
    // Numbers that count the traces twice are no lines, nor are those of shots along a 2-D line.
    file.line_bytes = [9, 21];
    (1..).zip(&mut file.traces).for_each(|(n, trace)| (trace.inline, trace.crossline) = (n, 1000 + n));
    assert!(file.error(&SegyOptions::default()).contains("byte 189"));
    (0..).zip(&mut file.traces).for_each(|(n, trace)| (trace.inline, trace.crossline) = (n % 4, n % 5));
    assert!(file.error(&SegyOptions::default()).contains("byte 189"));
    (0..).zip(&mut file.traces).for_each(|(n, trace)| (trace.inline, trace.crossline) = (n / 2, 20 * (n / 2) + n % 2));
    assert!(file.error(&SegyOptions::default()).contains("byte 189"));
}

#[test]
fn of_several_traces_at_a_position_one_is_taken() {
    let mut file = TestFile::new(2, true, DIMS);
    let with_offset = |trace: &Trace, offset: i64| Trace {
        values: trace.values.iter().map(|value| value + 1000.0 * offset as f64).collect(),
        more: vec![(37, 4, offset)],
        ..trace.clone()
    };
    file.traces = file.traces.iter().flat_map(|trace| [3, 5, -2].map(|offset| with_offset(trace, offset))).collect();
    let volume = sound(&file);
    check(&volume, DIMS, |x, y, z| 3000.0 + value(x, y, z));
    assert!(has_note(&volume, "40 traces were left out: the position of each has an earlier one (offsets -2 to 5; --offset takes one)"));
    let of = |offset: i32| SegyOptions { offset: Some(offset), ..Default::default() };
    for offset in [3, 5, -2] {
        let volume = sound_with(&file, &of(offset));
        check(&volume, DIMS, |x, y, z| 1000.0 * f64::from(offset) + value(x, y, z));
        assert!(has_note(&volume, &format!("40 traces with another offset than {offset} were left out")));
    }
    assert!(file.error(&of(4)).contains("no trace with offset 4: offsets (byte 37) go from -2 to 5"));
}

/// Coordinates in centimetres at the given bytes.
fn with_coordinates(bytes: [usize; 2], place: impl Fn(f64, f64) -> [f64; 2]) -> TestFile {
    let mut file = TestFile::new(5, false, DIMS);
    for (n, trace) in file.traces.iter_mut().enumerate() {
        let [x, y] = place((n % DIMS[1]) as f64, (n / DIMS[1]) as f64).map(|v| (100.0 * v).round() as i64);
        trace.more = vec![(71, 2, -100), (bytes[0], 4, x), (bytes[1], 4, y), (109, 2, 500)];
    }
    file
}

#[test]
fn a_survey_lies_where_its_coordinates_say() {
    let place = |y: f64, z: f64| [620_000.0 + 20.0 * y - 7.5 * z, 6_070_000.0 + 15.0 * y + 10.0 * z];
    for bytes in [[181, 185], [73, 77]] {
        let file = with_coordinates(bytes, place);
        let volume = sound(&file);
        let frame = volume.frame();
        let steps = DMat3::from_cols(DVec3::new(0.0, 0.0, -4.0), DVec3::new(20.0, 15.0, 0.0), DVec3::new(-7.5, 10.0, 0.0));
        assert!(
            frame.steps.abs_diff_eq(steps, 1e-9) && frame.origin.abs_diff_eq(DVec3::new(620_000.0, 6_070_000.0, -500.0), 1e-6),
            "{frame:?}"
        );
        assert!(has_note(&volume, "samples are 4 ms apart (1 ms is 1 world unit), the first at 500 ms"));
        assert!(has_note(
            &volume,
            &format!("coordinates from bytes {} and {}: crosslines 25.000 and inlines 12.500 world", bytes[0], bytes[1])
        ));
        // Time and space have no common measure; a trace without coordinates has no say.
        let mut file = file;
        file.traces[7].more = vec![(109, 2, 480)];
        let volume = sound_with(&file, &SegyOptions { sample_step: Some(10.0), ..Default::default() });
        assert!(
            volume.frame().steps.x_axis == DVec3::NEG_Z * 10.0
                && volume.frame().origin.abs_diff_eq(DVec3::new(620_000.0, 6_070_000.0, -1250.0), 1e-6)
        );
        assert!(has_note(&volume, "the first sample is at 480 to 500 ms"));
    }
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = SegyOptions { sample_step: Some(step), ..Default::default() };
        assert!(with_coordinates([181, 185], place).error(&options).contains("expected a number above 0"));
    }
}

#[test]
fn without_sound_coordinates_a_survey_lies_by_its_line_numbers() {
    let steps = DMat3::from_cols(DVec3::new(0.0, 0.0, -4.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0));
    let check = |file: &TestFile, why: &str| {
        let volume = sound(file);
        assert_eq!((volume.frame().steps, volume.frame().origin.truncate()), (steps, glam::DVec2::new(20.0, 100.0)), "{why}");
        assert!(has_note(&volume, "x and y are crossline and inline numbers") && has_note(&volume, why), "{:?}", volume.notes());
    };
    check(&TestFile::new(5, false, DIMS), "there are no coordinates");
    check(&with_coordinates([181, 185], |_, _| [1234.5, 77.25]), "there are no coordinates");
    check(&with_coordinates([181, 185], |y, _| [20.0 * y, 15.0 * y]), "do not lie on a regular grid");
    check(&with_coordinates([181, 185], |y, z| [100.0 + 20.0 * y * y, 15.0 * z]), "do not lie on a regular grid");
    let mut angles = with_coordinates([181, 185], |y, z| [20.0 * y + 1.0, 15.0 * z]);
    angles.traces.iter_mut().for_each(|trace| trace.more.push((89, 2, 3)));
    check(&angles, "the coordinates are angles");
    // Too large to be degrees.
    let mut metres = with_coordinates([181, 185], |y, z| [20.0 * y + 1000.0, 15.0 * z]);
    metres.traces.iter_mut().for_each(|trace| trace.more.push((89, 2, 3)));
    assert_eq!(sound(&metres).frame().steps.y_axis.x.round(), 20.0);
}

#[test]
fn what_is_no_survey_is_refused_in_words() {
    let error = |change: &dyn Fn(&mut TestFile)| {
        let mut file = TestFile::new(5, false, DIMS);
        change(&mut file);
        file.error(&SegyOptions::default())
    };
    let line = error(&|file| file.traces.iter_mut().for_each(|trace| trace.inline = 7));
    assert!(line.contains("is one 2-D line: its 20 traces have inline 7 (byte 189) and crosslines 20 to 28 (byte 193)"), "{line}");
    let far = error(&|file| file.traces[3].inline = -2_000_000_000);
    assert!(
        far.contains("inlines -2000000000 to 109 (byte 189, traces 4 and 16) and crosslines 20 to 28") && far.contains("too sparse"),
        "{far}"
    );
    let none = error(&|file| file.traces.clear());
    assert!(none.contains("has no traces: its headers end at byte 3600, the file at byte 3600"), "{none}");
    for (code, name) in [(4, "fixed-point numbers with gain"), (9, "integers of 8 bytes"), (12, "unsigned integers of 8 bytes")] {
        assert!(error(&|file| file.code = code).contains(&format!("samples of format {code}, {name}, which octetra does not read")));
    }
    assert!(error(&|file| file.code = 0).contains("has format code 0 in bytes 3225-3226 (0 if little-endian)"));
    assert!(error(&|file| file.code = 0x0d00).contains("has format code 3328 in bytes 3225-3226 (13 if little-endian)"));
}

#[test]
fn boxes_have_what_all_has_there() {
    // Traces are read together, or one by one where they are long; some are missing, and the order is no order of the grid.
    for dims in [[9, 71, 80], [5000, 3, 4]] {
        let mut file = TestFile::new(3, false, dims);
        file.traces.swap(1, 7);
        file.traces.remove(4);
        let volume = sound(&file);
        let expected = |x: usize, y: usize, z: usize| {
            if z * dims[1] + y == 4 { f64::NAN } else { value(x, y, z) }
        };
        check(&volume, dims, expected);
        let samples = all(&volume);
        let [nx, ny, nz] = volume.frame().dims;
        let boxes: [[Range<u32>; 3]; 6] = [
            [0..nx, 1..2, 0..nz],
            [3..4, 0..ny, 1..3],
            [nx - 1..nx, ny - 1..ny, nz - 1..nz],
            [1..nx - 1, 1..ny, 0..2],
            [0..nx, 0..0, 0..nz],
            [2..2, 0..ny, 0..nz],
        ];
        for region in boxes {
            let found = volume.read(&region).expect("read");
            let [xs, ys, zs] = region.clone();
            let places = zs.flat_map(|z| ys.clone().flat_map(move |y| (0..1).map(move |_| (y, z))));
            let expected: Vec<f64> = places
                .flat_map(|(y, z)| xs.clone().map(move |x| x as usize + nx as usize * (y + ny * z) as usize))
                .map(|i| samples.get(i))
                .collect();
            assert_eq!(found.len(), expected.len(), "{region:?}");
            assert!((0..found.len()).all(|i| found.get(i) == expected[i] || found.get(i).is_nan() && expected[i].is_nan()), "{region:?}");
        }
        assert!(volume.read(&[0..nx + 1, 0..ny, 0..nz]).is_err());
    }
}

#[test]
fn a_file_on_disk_is_read_and_named_in_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("survey.sgy");
    let bytes = TestFile::new(1, true, DIMS).bytes();
    std::fs::write(&path, &bytes).expect("written");
    let volume = SegyVolume::open(&path, &SegyOptions::default(), &Progress::new()).expect("sound");
    check(&volume, DIMS, value);
    // It becomes shorter while it is open.
    std::fs::File::options().write(true).open(&path).and_then(|file| file.set_len(5000)).expect("cut");
    let error = volume.read(&[0..6, 0..5, 0..4]).expect_err("cut").to_string();
    assert!(error.contains("survey.sgy"), "{error}");
    let error = SegyVolume::open(&path, &SegyOptions::default(), &Progress::new()).expect_err("cut").to_string();
    assert!(error.contains("survey.sgy: ends after"), "{error}");
    let cancelled = Progress::new();
    cancelled.cancel();
    std::fs::write(&path, &bytes).expect("written");
    assert!(SegyVolume::open(&path, &SegyOptions::default(), &cancelled).is_err());
}
