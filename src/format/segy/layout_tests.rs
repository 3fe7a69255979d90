//! Files made for the purpose: what their headers say of where the traces lie, and what is wrong with them.

use super::SegyOptions;
use super::test_file::{TestFile, error, open, value};
use super::tests::{DIMS, check, has_note, sound};

#[test]
fn revision_2_says_more_of_itself() {
    let order = 0x0102_0304;
    for is_little in [false, true] {
        let mut file = TestFile::new(16, is_little, DIMS);
        file.more = vec![(3297, 4, order), (3269, 4, 6), (3221, 2, 1234), (3273, 8, 2500.5f64.to_bits() as i64), (3507, 4, 2)];
        file.more_headers = 2;
        let volume = sound(&file);
        check(&volume, DIMS, value);
        assert_eq!(volume.frame.steps.x_axis.z, -2.5005);
        // Trailers, known by the count of traces or by their own; and the place of the first trace.
        let with = |more: &[(usize, usize, i64)]| TestFile { more: [&file.more[..], more].concat(), ..file.clone() };
        let trailed = |file: &TestFile| [file.bytes(), vec![0x40; 6400]].concat();
        let default = SegyOptions::default();
        for more in [&[(3515, 8, 20)][..], &[(3531, 4, 2)], &[(3515, 8, 20), (3531, 4, -1)]] {
            let volume = open(&trailed(&with(more)), &default).unwrap_or_else(|error| panic!("{error}"));
            check(&volume, DIMS, value);
        }
        assert!(error(&trailed(&with(&[])), &default).contains("of trace"));
        let mut placed = with(&[(3523, 8, 3610)]);
        placed.text = vec![0; 10];
        check(&sound(&placed), DIMS, value);
    }
    let mut swapped = TestFile::new(5, false, DIMS);
    swapped.more = vec![(3297, 4, 0x0201_0403)];
    assert!(swapped.error(&SegyOptions::default()).contains("swapped in pairs"));
}

#[test]
fn textual_headers_are_skipped() {
    let ascii = b"((SEG: EndText))".to_vec();
    let ebcdic = vec![0x4d, 0x4d, 0xe2, 0xc5, 0xc7, 0x7a, 0x40, 0xc5, 0x95, 0x84, 0xe3, 0x85, 0xa7, 0xa3, 0x5d, 0x5d];
    for revision in [0x0000, 0x0100, 0x0200] {
        let mut file = TestFile::new(5, false, DIMS);
        file.text = vec![0x40; 6400];
        file.more = vec![(3501, 2, revision), (3505, 2, 2)];
        check(&sound(&file), DIMS, value);
        file.more = vec![(3501, 2, revision), (3505, 2, -1)];
        for end in [&ascii, &ebcdic] {
            file.text[3200..][..16].copy_from_slice(end);
            check(&sound(&file), DIMS, value);
        }
        file.text[3200] = 0;
        assert!(file.error(&SegyOptions::default()).contains("expected one of them to begin with ((SEG: EndText))"));
        file.more = vec![(3501, 2, revision), (3505, 2, 1000)];
        file.text.clear();
        match revision {
            // The bytes meant nothing then.
            0 => check(&sound(&file), DIMS, value),
            _ => assert!(
                file.error(&SegyOptions::default()).contains("has no traces: its headers end at byte 3203600, the file at byte 8880")
            ),
        }
    }
    let mut negative = TestFile::new(5, false, DIMS);
    negative.more = vec![(3501, 2, 0x0100), (3505, 2, -2)];
    assert!(negative.error(&SegyOptions::default()).contains("has -2 extended textual headers"));
}

#[test]
fn the_number_of_samples_is_the_one_that_fits_the_file() {
    let mut file = TestFile::new(5, false, DIMS);
    file.traces[0].more = vec![(115, 2, 462)];
    check(&sound(&file), DIMS, value);
    for (stated, trace) in [(0, 6), (7, 6)] {
        file.more = vec![(3221, 2, stated)];
        file.traces[0].more = vec![(115, 2, trace)];
        let volume = sound(&file);
        check(&volume, DIMS, value);
        assert!(has_note(&volume, &format!("6 samples a trace, as the first trace says; the binary header's {stated} do not fit")));
    }
    file.traces[0].more.clear();
    assert!(file.error(&SegyOptions::default()).contains("ends after 188 of the 268 bytes of trace 20 (7 samples of 4 bytes"));
    file.more = vec![(3221, 2, 0)];
    assert!(file.error(&SegyOptions::default()).contains("0 samples a trace by its binary header (byte 3221) and 0 by"));
}

#[test]
fn a_file_that_was_cut_off_is_refused_unless_that_is_allowed() {
    let mut bytes = TestFile::new(5, false, DIMS).bytes();
    bytes.truncate(3600 + 13 * 264 + 250);
    assert!(error(&bytes, &SegyOptions::default()).contains("ends after 250 of the 264 bytes of trace 14 (6 samples of 4 bytes"));
    let options = SegyOptions { truncated: true, ..Default::default() };
    let volume = open(&bytes, &options).unwrap_or_else(|error| panic!("{error}"));
    check(&volume, [6, 5, 3], |x, y, z| if (y, z) >= (3, 0) && z == 2 { f64::NAN } else { value(x, y, z) });
    assert!(has_note(&volume, "cut off within trace 14, of which 250 bytes were left out"));
    assert!(error(&bytes[..3600 + 200], &options).contains("has no traces"));
    assert!(error(&bytes[..3600 + 250], &options).contains("of trace 1 "));
    assert!(error(&bytes[..3599], &options).contains("has 3599 bytes"));
    assert!(error(&[], &options).contains("has 0 bytes"));
}

#[test]
fn a_textual_header_is_known_by_its_line_numbers() {
    let card = |letter: u8, zero: u8, blank: u8, padded: bool| -> Vec<u8> {
        let line = |n: u8| {
            let tens = if n < 10 && padded { blank } else { zero + n / 10 };
            [vec![letter, tens, zero + n % 10], vec![blank; 77]].concat()
        };
        (1..=40).flat_map(line).collect()
    };
    for padded in [true, false] {
        assert!(super::recognizes(&card(0xc3, 0xf0, 0x40, padded)[..1024]) && super::recognizes(&card(b'C', b'0', b' ', padded)[..1024]));
        assert!(!super::recognizes(&card(b'D', b'0', b' ', padded)) && !super::recognizes(&card(b'C', b'0', b' ', padded)[..900]));
    }
    assert!(!super::recognizes(&[b'C'; 1024]) && !super::recognizes(b"C01"));
}
