//! What a file holds does not break its reader: damaged copies of real files are read until a number of executions is reached. `tests/fuzz` runs
//! it optimised, for long, and within a limit of memory; `.ci/run` for a moment. Formats of several files (OpenFOAM, EnSight, TetGen, XDMF with
//! HDF5) come no further than the first here; they have tests of damage of their own in `src/format/`.
//!
//! * `OCTETRA_SHARED`: the folder of shared test data, whose small files are the seeds.
//! * `OCTETRA_FUZZ`: how many executions in all, by default 20 000.
//! * `OCTETRA_FUZZ_SEED`: another number gives other damage.
//!
//! An input that makes a reader panic, or takes it longer than ten seconds, is kept in the folder of temporary files and named.

#![allow(clippy::print_stdout)] // what it did is said, and what made it fail

use octetra::format::{Contents, embedded_contents};
use octetra::mesh::{TetMesh, to_tets};
use octetra::progress::Progress;
use std::env;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// Larger files are no seeds: they would only be slow.
const SEED_BYTES: u64 = 48 << 10;

/// Seeds of one suffix, so that formats of which there are many files do not crowd out the others.
const SEEDS_A_SUFFIX: usize = 24;

/// An execution that takes longer has failed.
const LIMIT: Duration = Duration::from_secs(10);

/// What a thread reads, and since when: the time, the seed's index, the bytes.
type Running = Mutex<Option<(Instant, usize, Vec<u8>)>>;

/// A file to damage.
struct Seed {
    suffix: String,
    bytes: Vec<u8>,
}

/// Small, fast and the same everywhere (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() >> 11) as usize % end.max(1)
    }
}

fn collect(folder: &Path, seeds: &mut Vec<Seed>) {
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, seeds);
            continue;
        }
        let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
        let is_wanted = fs::metadata(&path).is_ok_and(|file| (1..=SEED_BYTES).contains(&file.len()));
        if is_wanted && seeds.iter().filter(|seed| seed.suffix == suffix).count() < SEEDS_A_SUFFIX {
            seeds.push(Seed { suffix, bytes: fs::read(&path).expect("a readable file") });
        }
    }
}

/// Numbers that readers trip over.
const NUMBERS: [u64; 12] = [0, 1, 2, 127, 255, 65_535, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 1 << 40, i64::MAX as u64, u64::MAX];
const WORDS: [&str; 14] =
    ["0", "-1", "1", "4294967295", "4294967296", "2147483648", "18446744073709551615", "1e999", "nan", "-0", "", "999999999", "\n", "\""];

fn damage(random: &mut Random, bytes: &mut Vec<u8>, other: &[u8]) {
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        let len = 1 + random.below(16.min(bytes.len() - at));
        match random.below(10) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = [0, 1, 32, 48, 127, 128, 255][random.below(7)],
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..at + len)),
            4 => {
                let copy = bytes[at..at + len].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            5 | 6 => {
                let number = NUMBERS[random.below(NUMBERS.len())];
                let width = [1, 2, 4, 8][random.below(4)];
                let (little, big) = (number.to_le_bytes(), number.to_be_bytes());
                let value = if random.below(2) == 0 { &little[..width] } else { &big[8 - width..] };
                bytes.iter_mut().skip(at).zip(value).for_each(|(byte, &value)| *byte = value);
            }
            7 | 8 => {
                // A number of a text becomes another.
                let is_number = |byte: &u8| byte.is_ascii_digit() || *byte == b'-' || *byte == b'.';
                let Some(start) = bytes[at..].iter().position(is_number).map(|offset| at + offset) else { continue };
                let end = start + bytes[start..].iter().position(|byte| !is_number(byte)).unwrap_or(bytes.len() - start);
                bytes.splice(start..end, WORDS[random.below(WORDS.len())].bytes());
            }
            _ => {
                let from = random.below(other.len());
                let piece = &other[from..other.len().min(from + 1 + random.below(64))];
                bytes.splice(at..at + len, piece.iter().copied());
            }
        }
    }
}

/// Reads bytes as a file with a suffix, and makes a mesh of what they hold.
fn read(suffix: &str, bytes: &[u8]) -> bool {
    let progress = Progress::new();
    match embedded_contents(&format!("fuzz.{suffix}"), bytes, &progress) {
        Ok(Contents::Cells(grid)) => to_tets(grid).is_ok_and(|parts| TetMesh::new(parts).is_ok()),
        Ok(Contents::Tets(parts)) => TetMesh::new(parts).is_ok(),
        Ok(Contents::Grid(_)) => true,
        Err(error) => {
            assert!(!error.to_string().contains('\n'), "an error of one line: {error}");
            false
        }
    }
}

fn number(name: &str, default: u64) -> u64 {
    env::var(name).ok().map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text}: expected a number")))
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn damaged_files_are_read_or_refused() {
    let shared = PathBuf::from(env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED"));
    let mut seeds = Vec::new();
    ["interop", "tet", "surface", "volume"].iter().for_each(|folder| collect(&shared.join("data").join(folder), &mut seeds));
    assert!(seeds.len() > 50, "the small files of the shared data");
    let sound = seeds.iter().filter(|seed| read(&seed.suffix, &seed.bytes)).count();

    let (wanted, first) = (number("OCTETRA_FUZZ", 20_000), number("OCTETRA_FUZZ_SEED", 1));
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    let (done, accepted) = (AtomicU64::new(0), AtomicU64::new(0));
    let failures = Mutex::new(Vec::<String>::new());
    // What each thread reads, and since when, so that one that never ends is named too.
    let running: Vec<Running> = (0..threads).map(|_| Mutex::new(None)).collect();
    let keep = |suffix: &str, bytes: &[u8], why: &str| {
        let path = env::temp_dir().join(format!("octetra-fuzz-{}-{}.{suffix}", bytes.len(), done.load(Relaxed)));
        fs::write(&path, bytes).expect("written");
        format!("{}: {why}", path.display())
    };
    std::panic::set_hook(Box::new(|_| {}));
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let (seeds, running, done, accepted, failures, keep) = (&seeds, &running, &done, &accepted, &failures, &keep);
            scope.spawn(move || {
                let mut random =
                    Random((first.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (thread as u64 + 1).wrapping_mul(0xd1b5_4a32_d192_ed03)) | 1);
                while done.fetch_add(1, Relaxed) < wanted && failures.lock().expect("no panic while locked").len() < 10 {
                    let seed = random.below(seeds.len());
                    let mut bytes = seeds[seed].bytes.clone();
                    let other = random.below(seeds.len());
                    damage(&mut random, &mut bytes, &seeds[other].bytes);
                    let (suffix, start) = (&seeds[seed].suffix, Instant::now());
                    *running[thread].lock().expect("no panic while locked") = Some((start, seed, bytes.clone()));
                    match catch_unwind(AssertUnwindSafe(|| read(suffix, &bytes))) {
                        Ok(is_sound) => drop(accepted.fetch_add(u64::from(is_sound), Relaxed)),
                        Err(panic) => {
                            let text = panic.downcast_ref::<String>().cloned();
                            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|&text| text.to_owned())).unwrap_or_default();
                            failures.lock().expect("no panic while locked").push(keep(suffix, &bytes, &format!("panic: {text}")));
                        }
                    }
                    *running[thread].lock().expect("no panic while locked") = None;
                    if start.elapsed() > LIMIT {
                        failures.lock().expect("no panic while locked").push(keep(suffix, &bytes, &format!("took {:?}", start.elapsed())));
                    }
                }
            });
        }
        // Watches for one that hangs; the program ends with it, since a thread cannot be stopped.
        while done.load(Relaxed) < wanted + threads as u64 && failures.lock().expect("no panic while locked").len() < 10 {
            std::thread::sleep(Duration::from_millis(100));
            for state in &running {
                if let Some((start, seed, bytes)) = &*state.lock().expect("no panic while locked")
                    && start.elapsed() > 6 * LIMIT
                {
                    println!("{}", keep(&seeds[*seed].suffix, bytes, "does not end"));
                    std::process::exit(1);
                }
            }
        }
    });
    drop(std::panic::take_hook());
    let failures = failures.into_inner().expect("no panic while locked");
    println!(
        "{} seeds, {sound} of them sound; {} executions, {} gave a mesh or volume all the same",
        seeds.len(),
        done.load(Relaxed).min(wanted),
        accepted.load(Relaxed)
    );
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
