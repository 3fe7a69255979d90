//! Damaged files of cells: whatever is done to a sound one, a reader gives a mesh or says what is wrong, within memory that the file's length
//! bounds, and never panics.

use super::parse::{ParseError, parsed};
use super::{abaqus, gmsh, medit, su2, tetgen};
use crate::mesh::UnstructuredGrid;
use proptest::prelude::*;
use std::sync::LazyLock;

/// A reader with sound files to damage.
struct Subject {
    name: &'static str,
    read: fn(&[u8]) -> Result<UnstructuredGrid, ParseError>,
    files: Vec<Vec<u8>>,
}

static SUBJECTS: LazyLock<Vec<Subject>> = LazyLock::new(|| {
    let tetgen_files = [tetgen::tests::NODE, "1 4 1\n1 1 2 3 4 7\n"].concat();
    vec![
        Subject { name: "Gmsh", read: |bytes| parsed(gmsh::read, bytes), files: gmsh::tests::sound_files() },
        Subject { name: "Medit", read: |bytes| parsed(medit::read, bytes), files: medit::tests::sound_files() },
        Subject { name: "SU2", read: |bytes| parsed(su2::read, bytes), files: vec![su2::tests::TET.into()] },
        Subject {
            name: "Abaqus",
            read: |bytes| parsed(abaqus::read, bytes),
            files: vec![abaqus::tests::TET.into(), abaqus::tests::ASSEMBLY.into()],
        },
        Subject {
            name: "TetGen",
            read: |bytes| tetgen::read_both(bytes, tetgen::tests::NODE.len()),
            files: vec![tetgen_files.into_bytes()],
        },
    ]
});

/// One thing that happens to a file; places are taken modulo its length.
#[derive(Debug, Clone)]
enum Damage {
    Flip(usize, u8),
    Cut(usize),
    Repeat(usize, usize),
    Remove(usize, usize),
    /// Bytes over what is there.
    Overwrite(usize, Vec<u8>),
    /// Text between what is there.
    Insert(usize, &'static str),
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = || any::<proptest::sample::Index>().prop_map(|index| index.index(1 << 20));
    let numbers =
        ["-1 ", "0 ", "4294967295 ", "18446744073709551615 ", "99999999999999999999999 ", "1e400 ", "nan ", "$", "*", "=", "\n", "\"", ","];
    let bytes = prop_oneof![
        Just(u32::MAX.to_le_bytes().to_vec()),
        Just(i32::MAX.to_be_bytes().to_vec()),
        Just(u64::MAX.to_le_bytes().to_vec()),
        Just((u64::MAX / 8).to_le_bytes().to_vec()),
        Just(vec![0; 8]),
        proptest::collection::vec(any::<u8>(), 1..9),
    ];
    prop_oneof![
        4 => (place(), 0..8u8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        1 => place().prop_map(Damage::Cut),
        1 => (place(), 1..64usize).prop_map(|(at, len)| Damage::Repeat(at, len)),
        1 => (place(), 1..64usize).prop_map(|(at, len)| Damage::Remove(at, len)),
        2 => (place(), bytes).prop_map(|(at, bytes)| Damage::Overwrite(at, bytes)),
        2 => (place(), proptest::sample::select(numbers.to_vec())).prop_map(|(at, text)| Damage::Insert(at, text)),
    ]
}

fn damaged(file: &[u8], all: &[Damage]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for one in all {
        if bytes.is_empty() {
            break;
        }
        let len = bytes.len();
        let end = |at: usize, count: usize| (at + count).min(len);
        match *one {
            Damage::Flip(at, bit) => bytes[at % len] ^= 1 << bit,
            Damage::Cut(at) => bytes.truncate(at % len),
            Damage::Repeat(at, count) => {
                let at = at % len;
                let part = bytes[at..end(at, count)].to_vec();
                bytes.splice(at..at, part);
            }
            Damage::Remove(at, count) => drop(bytes.drain(at % len..end(at % len, count))),
            Damage::Overwrite(at, ref new) => {
                let at = at % len;
                let until = end(at, new.len());
                bytes.splice(at..until, new.iter().copied());
            }
            Damage::Insert(at, text) => drop(bytes.splice(at % len..at % len, text.bytes())),
        }
    }
    bytes
}

/// Bytes that a mesh takes in memory.
fn bytes_of(grid: &UnstructuredGrid) -> usize {
    let arrays = grid.point_data.iter().chain(&grid.cell_data).map(|array| 8 * array.values.len()).sum::<usize>();
    let notes = grid.notes.iter().map(String::len).sum::<usize>();
    24 * grid.points.len() + grid.cells.bytes() + arrays + notes
}

fn check(subject: &Subject, bytes: &[u8]) -> Result<(), TestCaseError> {
    match (subject.read)(bytes) {
        Ok(grid) => prop_assert!(bytes_of(&grid) <= 300 * bytes.len() + (2 << 20), "{} {} bytes", subject.name, bytes_of(&grid)),
        Err(error) => prop_assert!(!error.to_string().is_empty() && error.to_string().len() < 1000, "{}: {error}", subject.name),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(2000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_read_or_refused(which in 0..5usize, file in any::<proptest::sample::Index>(), all in proptest::collection::vec(damage(), 1..5)) {
        let subject = &SUBJECTS[which];
        check(subject, &damaged(&subject.files[file.index(subject.files.len())], &all))?;
    }

    #[test]
    fn bytes_of_any_kind_are_read_or_refused(which in 0..5usize, bytes in proptest::collection::vec(any::<u8>(), 0..200), text in "[$*a-zA-Z0-9 .,=\n-]{0,200}") {
        let subject = &SUBJECTS[which];
        check(subject, &bytes)?;
        check(subject, text.as_bytes())?;
    }
}

#[test]
fn files_cut_anywhere_are_read_or_refused() {
    for subject in &*SUBJECTS {
        for file in &subject.files {
            assert!((subject.read)(file).is_ok(), "{}", subject.name);
            for len in 0..file.len() {
                check(subject, &file[..len]).unwrap_or_else(|error| panic!("{} cut at {len}: {error}", subject.name));
            }
        }
    }
}
