//! Whatever is done to a sound file, it is read or refused, within memory that its length bounds.

use super::test_file::{TestFile, open};
use super::{SegyOptions, SegyVolume};
use crate::volume::VoxelSource;
use proptest::prelude::*;

/// Sound files of several kinds.
fn files() -> Vec<Vec<u8>> {
    let mut modern = TestFile::new(16, true, [5, 4, 3]);
    modern.more = vec![(3297, 4, 0x0102_0304), (3269, 4, 5), (3507, 4, 1), (3515, 8, 12)];
    modern.more_headers = 1;
    let mut texts = TestFile::new(1, false, [5, 4, 3]);
    texts.more = vec![(3501, 2, 0x0100), (3505, 2, -1)];
    texts.text = [b"((SEG: EndText))".to_vec(), vec![b' '; 3184]].concat();
    texts.traces.remove(5);
    vec![modern.bytes(), texts.bytes(), TestFile::new(3, false, [5, 4, 3]).bytes()]
}

fn check(bytes: &[u8], options: &SegyOptions) -> Result<(), TestCaseError> {
    match open(bytes, options) {
        Ok(volume) => {
            prop_assert!(volume.bytes() <= bytes.len(), "{} bytes for a file of {}", volume.bytes(), bytes.len());
            read_some(&volume, bytes.len())?;
        }
        Err(error) => prop_assert!(!error.to_string().is_empty() && error.to_string().len() < 500, "{error}"),
    }
    Ok(())
}

fn read_some(volume: &SegyVolume, len: usize) -> Result<(), TestCaseError> {
    let [nx, ny, nz] = volume.frame().dims;
    prop_assert!(nx as usize <= len && u64::from(ny) * u64::from(nz) <= len as u64);
    let region = [nx / 2..nx, 0..ny.min(64), nz - nz.min(64)..nz];
    let expected = (nx - nx / 2) as usize * (ny.min(64) * nz.min(64)) as usize;
    prop_assert_eq!(volume.read(&region).map(|samples| samples.len()).ok(), Some(expected));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(3000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_read_or_refused(
        which in 0..3usize,
        flips in proptest::collection::vec((prop_oneof![3200..3600usize, 3600..8000usize], 0..8u8), 0..6),
        over in proptest::option::of((prop_oneof![3200..3600usize, 3600..8000usize], proptest::collection::vec(prop_oneof![Just(0u8), Just(255), any::<u8>()], 1..9))),
        cut in proptest::option::of(0..9000usize),
        truncated in any::<bool>(),
        offset in proptest::option::of(Just(0)),
    ) {
        let mut bytes = files().swap_remove(which);
        let len = bytes.len();
        flips.iter().for_each(|&(at, bit)| bytes[at % len] ^= 1 << bit);
        if let Some((at, new)) = over {
            let at = at % (len - 8);
            bytes[at..at + new.len()].copy_from_slice(&new);
        }
        if let Some(cut) = cut {
            bytes.truncate(cut);
        }
        check(&bytes, &SegyOptions { truncated, offset, ..Default::default() })?;
    }

    #[test]
    fn bytes_of_any_kind_are_read_or_refused(head in proptest::collection::vec(any::<u8>(), 400), code in 1..17u8, rest in proptest::collection::vec(any::<u8>(), 0..3000)) {
        let mut bytes = [vec![0; 3200], head, rest].concat();
        check(&bytes, &SegyOptions::default())?;
        (bytes[3224], bytes[3225]) = (0, code);
        check(&bytes, &SegyOptions { truncated: true, ..Default::default() })?;
    }
}

#[test]
fn files_cut_anywhere_are_read_or_refused() {
    for bytes in files() {
        assert!(open(&bytes, &SegyOptions::default()).is_ok());
        for len in (0..bytes.len()).filter(|len| len % 7 == 0 || *len > 3500) {
            for truncated in [false, true] {
                let options = SegyOptions { truncated, ..Default::default() };
                check(&bytes[..len], &options).unwrap_or_else(|error| panic!("cut at {len}: {error}"));
            }
        }
    }
}
