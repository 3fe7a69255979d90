//! SEG-Y among the other formats.

use super::segy::is_segy;
use super::segy::test_file::{TestFile, value};
use super::*;

fn read_from(path: &Path, options: &ReadOptions) -> Result<Grid, String> {
    match read(path, options, &Progress::new()) {
        Ok(Data::Grid(grid)) => Ok(grid),
        Ok(Data::Mesh(_)) => panic!("a mesh"),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
fn seg_y_is_told_by_content_or_suffix_and_read_as_the_options_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut file = TestFile::new(3, false, [6, 5, 4]);
    file.line_bytes = [221, 57];
    let mut bytes = file.bytes();
    let segy = SegyOptions { iline_byte: Some(221), xline_byte: Some(57), sample_step: Some(2.0), ..SegyOptions::default() };
    let options = ReadOptions { segy, ..ReadOptions::default() };
    let by_suffix = ["sgy", "SEGY", "seg"].map(|suffix| folder.path().join("survey").with_extension(suffix));
    for path in &by_suffix {
        std::fs::write(path, &bytes).expect("written");
        let grid = read_from(path, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((grid.frame().dims, grid.name(), grid.samples().get(119)), ([6, 5, 4], "amplitude", value(5, 4, 3)));
        assert_eq!((grid.frame().spacing().x, grid.notes().len() > 2), (2.0, true));
        assert!(read_from(path, &ReadOptions::default()).is_err_and(|error| error.contains("no 3-D geometry") && !error.contains('\n')));
    }
    let unknown = folder.path().join("survey.dat");
    std::fs::write(&unknown, &bytes).expect("written");
    assert!(read_from(&unknown, &options).is_err_and(|error| error.contains("its format is not known")));
    (0..40).for_each(|line| bytes[80 * line..][..3].copy_from_slice(&[0xc3, 0xf0 + (line as u8 + 1) / 10, 0xf0 + (line as u8 + 1) % 10]));
    std::fs::write(&unknown, &bytes).expect("written");
    assert_eq!(read_from(&unknown, &options).map(|grid| grid.samples().get(7)), Ok(value(1, 1, 0)));
    assert!(is_segy(&unknown).is_ok_and(|is| is) && is_segy(&by_suffix[0]).is_ok_and(|is| is));
    let mesh = folder.path().join("a.stl");
    std::fs::write(&mesh, "solid a").expect("written");
    assert!(is_segy(&mesh).is_ok_and(|is| !is) && is_segy(&folder.path().join("none.sgy")).is_err());
    let other = ReadOptions { array: Some("speed".into()), ..options.clone() };
    assert!(read_from(&unknown, &other).is_err_and(|error| error.contains("named \"speed\"; the volume has \"amplitude\"")));
    let little = ReadOptions { memory_bytes: 200, ..options };
    assert!(read_from(&unknown, &little).is_err_and(|error| error.contains("needs 240 bytes of memory for 120 voxels at once")));
    assert!(read_mesh(&unknown, &Progress::new()).is_err_and(|error| error.to_string().contains("is a regular volume (SEG-Y)")));
    let cancelled = Progress::new();
    cancelled.cancel();
    assert!(matches!(read(&unknown, &little, &cancelled), Err(FormatError::Cancelled(_))));
}
