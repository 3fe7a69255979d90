//! A pyramid of bricks on disk: [`Store`] reads it, [`build()`] writes it. It is Zarr v3 with OME-NGFF metadata, so that other programs open it.

mod block;
mod build;
mod folder;
mod layout;
mod voxel;

pub use build::{BuildOptions, Built, build};
pub use layout::Info;

use super::{BRICK_EDGE, Brick, BrickKey, BrickSource, BrickStatistics, Pyramid};
use crate::progress::Cancelled;
use crate::volume::{GridFrame, Samples, VoxelType};
use folder::Folder;
use layout::{STATISTICS, VERSION, level_array, statistics_array};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxel::StoredVoxel;
use zarrs::array::{Array, ArrayShardedReadableExt, ArrayShardedReadableExtCache, CodecOptions};
use zarrs::storage::{ReadableStorageTraits, StoreKey};

/// The file that makes a store whole.
const ROOT: &str = "zarr.json";
/// The file that says what is being written.
const BUILD: &str = "octetra-build.json";
/// Most bricks of the finest level: 4 million million voxels.
const MOST_BRICKS: u64 = 1 << 24;

/// Why a store cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file cannot be read or written, or is damaged.
    #[error("{}: {what}", path.display())]
    Failed {
        /// The store.
        path: PathBuf,
        /// What failed.
        what: String,
    },
    /// Nothing of octetra's is there.
    #[error("{}: is not a store of bricks: {found}", path.display())]
    NotAStore {
        /// Where it was looked for.
        path: PathBuf,
        /// What is there.
        found: String,
    },
    /// It was begun and not finished.
    #[error("{}: is not whole, its writing was stopped; the same octetra bricks command goes on with it", .0.display())]
    NotWhole(PathBuf),
    /// Something is there that would be lost.
    #[error("{}: exists already; --overwrite replaces a store", .0.display())]
    Exists(PathBuf),
    /// Something that is not octetra's is there.
    #[error("{}: is there already and is no store of octetra's, so it is not overwritten", .0.display())]
    Foreign(PathBuf),
    /// Somebody else writes it.
    #[error("{}: is being written by another octetra", .0.display())]
    Busy(PathBuf),
    /// It was begun with something else.
    #[error("{}: was begun from another source or with other settings ({what}); --overwrite begins anew", path.display())]
    Other {
        /// The store.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// The source cannot be read.
    #[error("{0}")]
    Source(io::Error),
    /// Writing takes more memory than it may.
    #[error("bricks of this volume take {need} bytes of memory to write, the limit is {budget}")]
    Memory {
        /// Bytes at least.
        need: u64,
        /// Bytes at most.
        budget: u64,
    },
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

type Storage = dyn ReadableStorageTraits;

/// `Err` says why a volume cannot have a store.
fn check_volume(frame: &GridFrame) -> Result<(), String> {
    frame.validate().map_err(|error| format!("the volume {error}"))?;
    match Pyramid::new(frame.dims).brick_count(0) {
        0..=MOST_BRICKS => Ok(()),
        bricks => Err(format!("the volume takes {bricks} bricks, at most {MOST_BRICKS} are possible")),
    }
}

/// One level: its voxels and what is known of its bricks.
struct Level {
    voxels: Array<Storage>,
    shards: ArrayShardedReadableExtCache,
    statistics: Vec<f64>,
}

/// A whole store, open to be read.
pub struct Store {
    path: PathBuf,
    info: Info,
    frame: GridFrame,
    voxel_type: VoxelType,
    pyramid: Pyramid,
    levels: Vec<Level>,
}

impl std::fmt::Debug for Store {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Store").field("path", &self.path).field("info", &self.info).finish()
    }
}

impl Store {
    /// Whether a path looks like a store: a folder with the root's file or a build that was begun, or one named `.zarr`.
    pub fn is_at(path: &Path) -> bool {
        let is_named = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("zarr"));
        path.is_dir() && (is_named || path.join(ROOT).is_file() || path.join(BUILD).is_file())
    }

    /// Opens the store in a folder. What is known of its bricks is read, 32 bytes a brick.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        let failed = |what: String| StoreError::Failed { path: path.to_owned(), what };
        let storage = Arc::new(Folder::new(path).map_err(|error| failed(error.to_string()))?);
        let get = |name: &str| {
            let key = StoreKey::new(name).map_err(|error| failed(error.to_string()))?;
            storage.get(&key).map_err(|error| failed(error.to_string()))
        };
        let Some(root) = get(ROOT)? else {
            return Err(match path.join(BUILD).is_file() {
                true => StoreError::NotWhole(path.to_owned()),
                false if !path.exists() => failed("no such folder".into()),
                false => StoreError::NotAStore { path: path.to_owned(), found: format!("there is no {ROOT} in it") },
            });
        };
        let foreign = |found: String| StoreError::NotAStore { path: path.to_owned(), found };
        let root: serde_json::Value = serde_json::from_slice(&root).map_err(|error| foreign(format!("{ROOT}: {error}")))?;
        let info = root.pointer("/attributes/octetra").ok_or_else(|| foreign(format!("{ROOT} does not name octetra")))?;
        let info: Info = serde_json::from_value(info.clone()).map_err(|error| foreign(format!("{ROOT}: {error}")))?;
        if info.version != VERSION {
            return Err(foreign(format!("its version is {}, this octetra reads {VERSION}", info.version)));
        }
        let frame = info.frame();
        check_volume(&frame).map_err(|error| foreign(format!("{ROOT}: {error}")))?;
        let voxel_type = info.voxel_type().ok_or_else(|| foreign(format!("{ROOT}: voxels of type {}", info.voxel_type)))?;
        if !build::SHARD_BRICKS.contains(&info.shard_bricks) {
            return Err(foreign(format!("{ROOT}: shards of {} bricks a side", info.shard_bricks)));
        }
        let pyramid = info.pyramid();
        let storage: Arc<Storage> = storage;
        let mut levels = Vec::new();
        for level in 0..pyramid.levels() {
            // What the level's own metadata say is for others: this is how it was written.
            let voxels = level_array(storage.clone(), &info, voxel_type, level).map_err(|error| failed(error.to_string()))?;
            let statistics = statistics_array(storage.clone(), &info, level).map_err(|error| failed(error.to_string()))?;
            let shards = pyramid.bricks(level).map(|n| u64::from(n.div_ceil(info.shard_bricks)));
            for place in (0..shards[2]).flat_map(|z| (0..shards[1]).flat_map(move |y| (0..shards[0]).map(move |x| [z, y, x, 0]))) {
                let key = statistics.chunk_key(&place);
                if storage.size_key(&key).map_err(|error| failed(error.to_string()))?.is_none() {
                    return Err(failed(format!("{key} is missing")));
                }
            }
            let statistics: Vec<f64> = statistics
                .retrieve_array_subset(&statistics.subset_all())
                .map_err(|error| failed(format!("statistics of level {level}: {error}")))?;
            let shards = ArrayShardedReadableExtCache::new(&voxels);
            levels.push(Level { voxels, shards, statistics });
        }
        Ok(Store { path: path.to_owned(), frame, voxel_type, pyramid, info, levels })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it says of itself.
    pub fn info(&self) -> &Info {
        &self.info
    }

    /// The type of its voxels.
    pub fn voxel_type(&self) -> VoxelType {
        self.voxel_type
    }

    fn read<T: StoredVoxel>(&self, key: BrickKey) -> Result<Samples, String> {
        let level = &self.levels[usize::from(key.level)];
        let at: Vec<u64> = key.at.iter().rev().map(|&at| u64::from(at)).collect();
        // One brick is decoded by one thread: there are others for others.
        let options = CodecOptions::default().with_concurrent_target(1);
        // A shard that is not there would be read as one of which nothing is known.
        let shard: Vec<u64> = at.iter().map(|&at| at / u64::from(self.info.shard_bricks)).collect();
        let file = level.voxels.chunk_key(&shard);
        if level.voxels.storage().size_key(&file).map_err(|error| error.to_string())?.is_none() {
            return Err(format!("{file} is missing"));
        }
        let voxels: Vec<T> = level.voxels.retrieve_subchunk_opt(&level.shards, &at, &options).map_err(|error| error.to_string())?;
        let expected = (BRICK_EDGE as usize).pow(3);
        if voxels.len() == expected { Ok(T::samples(voxels)) } else { Err(format!("{} voxels, expected {expected}", voxels.len())) }
    }
}

impl BrickSource for Store {
    fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    fn frame(&self) -> &GridFrame {
        &self.frame
    }

    fn name(&self) -> &str {
        &self.info.name
    }

    fn range(&self) -> [f64; 2] {
        self.info.range.unwrap_or([0.0, 1.0])
    }

    fn voxel_bytes(&self) -> usize {
        self.voxel_type.bytes()
    }

    fn statistics(&self, key: BrickKey) -> Option<BrickStatistics> {
        if !self.pyramid.has(key) {
            return None;
        }
        let [nx, ny, _] = self.pyramid.bricks(key.level).map(|n| n as usize);
        let [x, y, z] = key.at.map(|at| at as usize);
        let numbers = self.levels[usize::from(key.level)].statistics.get(STATISTICS * (x + nx * (y + ny * z))..)?;
        let [low, high, entropy, known] = *numbers.first_chunk::<STATISTICS>()?;
        Some(BrickStatistics { range: [low, high], entropy: entropy as f32, known: known as f32 })
    }

    fn load(&self, key: BrickKey) -> io::Result<Brick> {
        if !self.pyramid.has(key) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{}: there is no brick {key:?}", self.path.display())));
        }
        let read = match self.voxel_type {
            VoxelType::U8 => self.read::<u8>(key),
            VoxelType::I8 => self.read::<i8>(key),
            VoxelType::U16 => self.read::<u16>(key),
            VoxelType::I16 => self.read::<i16>(key),
            VoxelType::U32 => self.read::<u32>(key),
            VoxelType::I32 => self.read::<i32>(key),
            VoxelType::F32 => self.read::<f32>(key),
            VoxelType::F64 => self.read::<f64>(key),
        };
        let named = |what| io::Error::other(format!("{}: level {}, brick {:?}: {what}", self.path.display(), key.level, key.at));
        Ok(Brick { samples: read.map_err(named)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Progress;
    use crate::volume::{Grid, VoxelSource};
    use glam::DVec3;
    use serde_json::json;
    use std::collections::BTreeMap;
    use std::ops::Range;
    use std::sync::atomic::{AtomicU64, Ordering};

    fn options() -> BuildOptions {
        BuildOptions { budget_bytes: 1 << 30, overwrite: false, source: json!("made up") }
    }

    fn grid(dims: [u32; 3], value: impl Fn([u32; 3]) -> f32) -> Grid {
        let [nx, ny, nz] = dims;
        let at = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let frame = GridFrame::along_axes(dims, DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.5, 1.0, 2.0));
        Grid::new(frame, "s".into(), Samples::from(at.map(value).collect::<Vec<f32>>())).expect("valid")
    }

    /// Waves, nothing known in one corner, constant in another.
    fn waves(dims: [u32; 3]) -> Grid {
        grid(dims, |[x, y, z]| match (x, y, z) {
            _ if x < 70 && y < 70 && z < 70 => f32::NAN,
            _ if x > 128 => 3.0,
            _ => (x as f32 * 0.3).sin() + (y as f32 * 0.1).cos() * z as f32,
        })
    }

    fn files(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut found = BTreeMap::new();
        let mut folders = vec![path.to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let entry = entry.expect("an entry").path();
                match entry.is_dir() {
                    true => folders.push(entry),
                    false => drop(found.insert(entry.strip_prefix(path).expect("below").to_owned(), std::fs::read(&entry).expect("read"))),
                }
            }
        }
        found
    }

    /// Every voxel of every level by the definition, from the level below.
    #[test]
    fn every_brick_of_every_level_is_what_its_definition_says() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let dims = [201, 130, 66];
        let grid = waves(dims);
        for budget_bytes in [1 << 30, 20 << 20] {
            let path = folder.path().join(format!("{budget_bytes}.zarr"));
            let built = build(&grid, &path, &BuildOptions { budget_bytes, ..options() }, &Progress::new()).expect("built");
            let store = Store::open(&path).expect("whole");
            assert_eq!((store.pyramid().levels(), store.range(), store.name()), (3, grid.range(), "s"));
            assert_eq!(built.info.shard_bricks, if budget_bytes == 1 << 30 { 4 } else { 1 });
            let mut below: Vec<f64> = (0..grid.samples().len()).map(|i| grid.samples().get(i)).collect();
            let mut size = dims;
            for level in 0..3 {
                if level > 0 {
                    (below, size) = halved(&below, size);
                }
                assert_eq!(store.pyramid().dims(level), size);
                let [bx, by, bz] = store.pyramid().bricks(level);
                for at in (0..bx).flat_map(|x| (0..by).flat_map(move |y| (0..bz).map(move |z| [x, y, z]))) {
                    let key = BrickKey { level, at };
                    let brick = store.load(key).expect("a brick").samples;
                    let mut range = [f64::NAN; 2];
                    for [x, y, z] in points(store.pyramid().voxels(key)) {
                        let expected = below[(x + size[0] * (y + size[1] * z)) as usize];
                        let found = brick.get((x % 64 + 64 * (y % 64 + 64 * (z % 64))) as usize);
                        // Means were rounded to f32 level by level.
                        assert!(
                            (found - expected).abs() <= 1e-5 * expected.abs().max(1.0) || found.is_nan() && expected.is_nan(),
                            "{key:?}"
                        );
                        range = [range[0].min(expected), range[1].max(expected)];
                    }
                    let known = store.statistics(key).expect("known");
                    if level == 0 {
                        assert_eq!(known.range.map(f64::to_bits), range.map(f64::to_bits), "{key:?}");
                    } else {
                        assert!(range[0].is_nan() || known.range[0] <= range[0] + 1e-5 && known.range[1] >= range[1] - 1e-5, "{key:?}");
                    }
                }
            }
            let top = store.statistics(store.pyramid().top()).expect("known");
            let share = 1.0 - grid.missing() as f32 / grid.samples().len() as f32;
            assert!(top.range == grid.range() && (top.known - share).abs() < 1e-6, "{top:?}, {share}");
            assert_eq!(store.statistics(BrickKey { level: 0, at: [3, 0, 0] }).expect("known").entropy, 0.0);
            assert!(store.load(BrickKey { level: 0, at: [4, 0, 0] }).is_err() && store.load(BrickKey { level: 3, at: [0; 3] }).is_err());
        }
    }

    fn points([x, y, z]: [Range<u32>; 3]) -> impl Iterator<Item = [u32; 3]> {
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| [x, y, z]))
        })
    }

    fn halved(fine: &[f64], size: [u32; 3]) -> (Vec<f64>, [u32; 3]) {
        let half = size.map(|n| n.div_ceil(2));
        let mean = |[x, y, z]: [u32; 3]| {
            let all = (0..8).map(|part| [2 * x + (part & 1), 2 * y + (part >> 1 & 1), 2 * z + (part >> 2)]);
            let there = all.filter(|at| (0..3).all(|axis| at[axis] < size[axis]));
            let values = there.map(|[x, y, z]| fine[(x + size[0] * (y + size[1] * z)) as usize]);
            let known: Vec<f64> = values.filter(|v| !v.is_nan()).collect();
            if known.is_empty() { f64::NAN } else { known.iter().sum::<f64>() / known.len() as f64 }
        };
        (points(half.map(|n| 0..n)).map(mean).collect(), half)
    }

    /// A volume whose reading fails after some boxes.
    struct Failing<'a>(&'a Grid, AtomicU64);

    impl VoxelSource for Failing<'_> {
        fn frame(&self) -> &GridFrame {
            self.0.frame()
        }
        fn name(&self) -> &str {
            self.0.name()
        }
        fn voxel_type(&self) -> VoxelType {
            self.0.voxel_type()
        }
        fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples> {
            match self.1.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)) {
                Ok(_) => self.0.read(region),
                Err(_) => Err(io::Error::other("stopped")),
            }
        }
    }

    #[test]
    fn what_was_stopped_goes_on_and_ends_in_the_same_bytes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let grid = waves([150, 140, 130]);
        let whole = folder.path().join("whole.zarr");
        let small = BuildOptions { budget_bytes: 20 << 20, ..options() };
        build(&grid, &whole, &small, &Progress::new()).expect("built");
        let path = folder.path().join("stopped.zarr");
        let mut runs = 0;
        let built = loop {
            runs += 1;
            let error = match build(&Failing(&grid, AtomicU64::new(5)), &path, &small, &Progress::new()) {
                Ok(built) => break built,
                Err(error) => error,
            };
            assert!(matches!(error, StoreError::Source(_)), "{error}");
            assert!(matches!(Store::open(&path), Err(StoreError::NotWhole(_))));
            // What a killed run leaves of a file does no harm.
            std::fs::write(path.join("0/c.unfinished"), b"half").expect("written");
        };
        assert!(runs > 4 && built.kept > 0, "{runs} runs, {built:?}");
        std::fs::remove_file(path.join("0/c.unfinished")).expect("removed");
        assert_eq!(files(&path), files(&whole));
    }

    #[test]
    fn a_store_is_the_same_bytes_for_any_number_of_threads() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let grid = waves([250, 200, 130]);
        let built = [1, 8, 8].into_iter().enumerate().map(|(i, threads)| {
            let path = folder.path().join(format!("{i}.zarr"));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let built = pool.install(|| build(&grid, &path, &options(), &Progress::new())).expect("built");
            assert_eq!(built.info.shard_bricks, 4);
            files(&path)
        });
        let built: Vec<_> = built.collect();
        assert!(built[0] == built[1] && built[0] == built[2]);
    }

    #[test]
    fn nothing_is_lost_and_nothing_foreign_is_taken_for_a_store() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let small = grid([3, 2, 2], |[x, _, _]| x as f32);
        let path = folder.path().join("a.zarr");
        let progress = Progress::new();
        build(&small, &path, &options(), &progress).expect("built");
        let whole = files(&path);
        assert!(matches!(build(&small, &path, &options(), &progress), Err(StoreError::Exists(_))));
        assert!(files(&path) == whole);
        build(&small, &path, &BuildOptions { overwrite: true, ..options() }, &progress).expect("replaced");
        assert_eq!(Store::open(&path).expect("whole").range(), [0.0, 2.0]);

        // Begun with another source.
        let begun = folder.path().join("b.zarr");
        assert!(build(&Failing(&small, AtomicU64::new(0)), &begun, &options(), &progress).is_err());
        let other = BuildOptions { source: json!("another"), ..options() };
        assert!(matches!(build(&small, &begun, &other, &progress), Err(StoreError::Other { .. })));
        assert!(matches!(build(&grid([3, 3, 2], |_| 1.0), &begun, &options(), &progress), Err(StoreError::Other { .. })));

        // A folder of something else is left alone, even if it may be overwritten.
        let foreign = folder.path().join("foreign");
        std::fs::create_dir(&foreign).expect("made");
        std::fs::write(foreign.join("letter.txt"), "dear").expect("written");
        for overwrite in [false, true] {
            let options = BuildOptions { overwrite, ..options() };
            assert!(matches!(build(&small, &foreign, &options, &progress), Err(StoreError::Foreign(_))));
        }
        assert!(foreign.join("letter.txt").is_file());
        assert!(matches!(Store::open(&foreign), Err(StoreError::NotAStore { .. })));
        std::fs::write(foreign.join(ROOT), "{\"zarr_format\": 3}").expect("written");
        assert!(Store::open(&foreign).expect_err("not ours").to_string().ends_with("zarr.json does not name octetra"));
        assert!(Store::open(&folder.path().join("missing")).is_err());

        // What is not octetra's stays, even where a store is replaced; a removal that was stopped is ended.
        std::fs::write(path.join("notes.txt"), "mine").expect("written");
        let replace = BuildOptions { overwrite: true, ..options() };
        build(&grid([3, 3, 2], |_| 1.0), &path, &replace, &progress).expect("replaced");
        assert_eq!(Store::open(&path).expect("whole").pyramid().dims(0), [3, 3, 2]);
        let text = std::fs::read_to_string(begun.join(BUILD)).expect("begun").replace("\"removing\": false", "\"removing\": true");
        assert!(text.contains("\"removing\": true"), "{text}");
        std::fs::remove_file(path.join(ROOT)).expect("there");
        std::fs::write(path.join(BUILD), text).expect("written");
        build(&small, &path, &options(), &progress).expect("begun anew");
        assert_eq!(Store::open(&path).expect("whole").pyramid().dims(0), [3, 2, 2]);
        assert!(path.join("notes.txt").is_file() && !path.join(BUILD).exists() && !path.join("octetra-build.lock").exists());

        // Two at once.
        let held = std::fs::File::create(begun.join("octetra-build.lock")).expect("a file");
        held.lock().expect("locked");
        assert!(matches!(build(&small, &begun, &options(), &progress), Err(StoreError::Busy(_))));
        held.unlock().expect("free");

        // A run that was killed as it began; the same command goes on with what was begun even if it may overwrite.
        let killed = folder.path().join("killed.zarr");
        std::fs::create_dir(&killed).expect("made");
        std::fs::write(killed.join("octetra-build.json.unfinished"), "{").expect("written");
        build(&small, &killed, &options(), &progress).expect("built");
        let long = waves([150, 140, 130]);
        let few = BuildOptions { budget_bytes: 20 << 20, ..replace };
        let going = folder.path().join("going.zarr");
        assert!(build(&Failing(&long, AtomicU64::new(5)), &going, &few, &progress).is_err());
        assert!(build(&long, &going, &few, &progress).expect("built").kept > 0);
        // What was begun of another source is no part of what replaces it.
        let replaced = folder.path().join("replaced.zarr");
        assert!(build(&Failing(&long, AtomicU64::new(5)), &replaced, &few, &progress).is_err());
        let flat = grid([150, 140, 130], |_| 7.0);
        let other = BuildOptions { source: json!("another"), ..few };
        assert_eq!(build(&flat, &replaced, &other, &progress).expect("built").kept, 0);
        assert_eq!(Store::open(&replaced).expect("whole").range(), [7.0, 7.0]);
        let tiny = BuildOptions { budget_bytes: 8 << 20, ..options() };
        let wide = folder.path().join("wide.zarr");
        assert!(build(&Failing(&small, AtomicU64::new(0)), &wide, &options(), &progress).is_err());
        assert!(matches!(build(&small, &wide, &tiny, &progress), Err(StoreError::Memory { .. })));

        // Damage.
        let lost = folder.path().join("lost.zarr");
        build(&small, &lost, &options(), &progress).expect("built");
        std::fs::remove_file(lost.join("0/c/0/0/0")).expect("there");
        let error =
            Store::open(&lost).expect("the metadata are whole").load(BrickKey { level: 0, at: [0; 3] }).expect_err("lost").to_string();
        assert!(error.ends_with("level 0, brick [0, 0, 0]: 0/c/0/0/0 is missing"), "{error}");
        std::fs::remove_file(lost.join("statistics/0/c/0/0/0/0")).expect("there");
        assert!(Store::open(&lost).expect_err("lost").to_string().ends_with("statistics/0/c/0/0/0/0 is missing"));
        let hostile =
            std::fs::read_to_string(killed.join(ROOT)).expect("read").replacen("\"shard_bricks\": 4", "\"shard_bricks\": 4000", 1);
        std::fs::write(killed.join(ROOT), hostile).expect("written");
        assert!(matches!(Store::open(&killed), Err(StoreError::NotAStore { .. })));
        let shard = path.join("0/c/0/0/0");
        let bytes = std::fs::read(&shard).expect("a shard");
        std::fs::write(&shard, &bytes[..bytes.len() / 2]).expect("written");
        let error =
            Store::open(&path).expect("the metadata are whole").load(BrickKey { level: 0, at: [0; 3] }).expect_err("damaged").to_string();
        assert!(error.starts_with(&format!("{}: level 0, brick [0, 0, 0]: ", path.display())), "{error}");
        let none = BuildOptions { budget_bytes: 1000, ..options() };
        assert!(matches!(build(&small, &folder.path().join("c"), &none, &progress), Err(StoreError::Memory { .. })));
    }
}
