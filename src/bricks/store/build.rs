//! Writing a store: one pass over the source, from the finest shards up, in memory of a fixed size.
//!
//! A shard of a level is put together from the halves of the eight of the finer level under it, so the pass goes depth first and holds one
//! shard a level. What is known of a shard's bricks is written after the shard itself, so that there being the one says that the other is whole:
//! a build that was stopped, in whatever way, goes on where it was, and ends in the same bytes.

use super::block::Block;
use super::folder::{Folder, UNFINISHED};
use super::layout::{Info, STATISTICS, level_array, statistics_array};
use super::voxel::StoredVoxel;
use super::{BUILD, ROOT, StoreError, check_volume};
use crate::bricks::{BRICK_EDGE, BrickKey, Pyramid};
use crate::progress::Progress;
use crate::volume::{VoxelSource, VoxelType};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;
use std::sync::Arc;
use zarrs::array::{Array, ArrayMetadataOptions, CodecOptions};
use zarrs::storage::{Bytes, ReadableWritableStorageTraits, StoreKey, WritableStorageTraits};

/// How wide shards may be, in bricks a side, the widest first: 64 MiB of f32.
pub const SHARD_BRICKS: [u32; 3] = [4, 2, 1];
/// The file that is locked by who writes a store.
const LOCK: &str = "octetra-build.lock";
/// Shards in memory beside one a level: what is read, padded and compressed.
const SHARDS_BESIDE: u64 = 4;

/// How a store is written.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildOptions {
    /// Bytes of memory that it may take.
    pub budget_bytes: u64,
    /// Whether a store that is there already, whole or not, is replaced.
    pub overwrite: bool,
    /// Names the source and what it was like, such as its path, size and time: a build that was begun goes on only if this is the same.
    pub source: Value,
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// What the store says of itself.
    pub info: Info,
    /// Shards written now.
    pub written: u64,
    /// Shards that were there from an earlier run.
    pub kept: u64,
    /// Bytes of all files.
    pub bytes: u64,
}

/// What is being written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Begun {
    info: Info,
    source: Value,
    /// What was there before is being removed, and none of it counts.
    #[serde(default)]
    removing: bool,
}

/// Writes the bricks of a volume to a folder, or goes on writing them.
pub fn build(source: &dyn VoxelSource, path: &Path, options: &BuildOptions, progress: &Progress) -> Result<Built, StoreError> {
    match source.voxel_type() {
        VoxelType::U8 => Builder::<u8>::begin(source, path, options)?.run(progress),
        VoxelType::I8 => Builder::<i8>::begin(source, path, options)?.run(progress),
        VoxelType::U16 => Builder::<u16>::begin(source, path, options)?.run(progress),
        VoxelType::I16 => Builder::<i16>::begin(source, path, options)?.run(progress),
        VoxelType::U32 => Builder::<u32>::begin(source, path, options)?.run(progress),
        VoxelType::I32 => Builder::<i32>::begin(source, path, options)?.run(progress),
        VoxelType::F32 => Builder::<f32>::begin(source, path, options)?.run(progress),
        VoxelType::F64 => Builder::<f64>::begin(source, path, options)?.run(progress),
    }
}

/// Bytes of memory that writing takes with shards of so many bricks a side.
fn need(pyramid: &Pyramid, voxel_bytes: usize, shard_bricks: u32) -> u64 {
    let shard = u64::from(shard_bricks * BRICK_EDGE).pow(3) * voxel_bytes as u64;
    shard * (u64::from(pyramid.levels()) + SHARDS_BESIDE)
}

type Files = dyn ReadableWritableStorageTraits;

struct Builder<'a, T> {
    source: &'a dyn VoxelSource,
    path: &'a Path,
    storage: Arc<Folder>,
    info: Info,
    pyramid: Pyramid,
    levels: Vec<(Array<Files>, Array<Files>)>,
    written: u64,
    kept: u64,
    /// Held as long as this store is written.
    lock: File,
    voxels: std::marker::PhantomData<T>,
}

/// A shard that is done: half of it for the next level, and the ranges of its bricks.
struct Done<T> {
    half: Option<Block<T>>,
    statistics: Vec<f64>,
}

impl<'a, T: StoredVoxel> Builder<'a, T> {
    /// Opens what was begun, or begins.
    fn begin(source: &'a dyn VoxelSource, path: &'a Path, options: &BuildOptions) -> Result<Self, StoreError> {
        let failed = |error: &dyn std::fmt::Display| StoreError::Failed { path: path.to_owned(), what: error.to_string() };
        check_volume(source.frame()).map_err(|error| failed(&error))?;
        let pyramid = Pyramid::new(source.frame().dims);
        let need = |bricks: u32| need(&pyramid, size_of::<T>(), bricks);
        let too_small = |need: u64| StoreError::Memory { need, budget: options.budget_bytes };
        let widest = SHARD_BRICKS.into_iter().find(|&bricks| need(bricks) <= options.budget_bytes).ok_or_else(|| too_small(need(1)))?;
        let mut begun = Begun {
            info: Info::new(source.frame(), source.name(), source.voxel_type(), widest),
            source: options.source.clone(),
            removing: false,
        };
        if let Found::Foreign = Found::at(path)? {
            return Err(StoreError::Foreign(path.to_owned()));
        }
        fs::create_dir_all(path).map_err(|error| failed(&error))?;
        let lock = File::create(path.join(LOCK)).map_err(|error| failed(&error))?;
        // Where files cannot be locked, nobody is kept out.
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(StoreError::Busy(path.to_owned()));
        }
        let storage = Arc::new(Folder::new(path).map_err(|error| failed(&error))?);
        let write = |begun: &Begun| {
            let text = serde_json::to_vec_pretty(begun).map_err(|error| failed(&error))?;
            storage.set(&key(BUILD), Bytes::from(text)).map_err(|error| failed(&error))
        };
        let is_kept = match Found::at(path)? {
            Found::Nothing => true,
            Found::Foreign => return Err(StoreError::Foreign(path.to_owned())),
            Found::Whole if options.overwrite => false,
            Found::Whole => {
                // A run that was killed between its last steps leaves these.
                [BUILD, LOCK].into_iter().for_each(|name| drop(fs::remove_file(path.join(name))));
                return Err(StoreError::Exists(path.to_owned()));
            }
            Found::Begun(found) if found.removing => false,
            Found::Begun(found) => {
                // The budget may be another now; the shards are what they were.
                begun.info.shard_bricks = found.info.shard_bricks;
                let differs = match () {
                    _ if begun.info != found.info => Some(format!("{} of {:?} voxels", found.info.name, found.info.dims)),
                    _ if begun.source != found.source => Some(found.source.to_string()),
                    _ => None,
                };
                match differs {
                    Some(what) if !options.overwrite => return Err(StoreError::Other { path: path.to_owned(), what }),
                    Some(_) => {
                        begun.info.shard_bricks = widest;
                        false
                    }
                    None if need(begun.info.shard_bricks) > options.budget_bytes => return Err(too_small(need(begun.info.shard_bricks))),
                    None => true,
                }
            }
        };
        if !is_kept {
            write(&Begun { info: begun.info.clone(), source: Value::Null, removing: true })?;
            remove(path).map_err(|error| failed(&error))?;
        }
        write(&begun)?;
        let Begun { info, .. } = begun;
        let files: Arc<Files> = storage.clone();
        let mut levels = Vec::new();
        for level in 0..pyramid.levels() {
            let voxels = level_array(files.clone(), &info, source.voxel_type(), level).map_err(|error| failed(&error))?;
            let statistics = statistics_array(files.clone(), &info, level).map_err(|error| failed(&error))?;
            let plain = ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
            voxels.store_metadata_opt(&plain).and_then(|()| statistics.store_metadata_opt(&plain)).map_err(|error| failed(&error))?;
            levels.push((voxels, statistics));
        }
        let group = json!({"zarr_format": 3, "node_type": "group", "attributes": {}});
        storage.set(&key("statistics/zarr.json"), Bytes::from(group.to_string())).map_err(|error| failed(&error))?;
        Ok(Builder { source, path, storage, info, pyramid, levels, written: 0, kept: 0, lock, voxels: std::marker::PhantomData })
    }

    fn run(mut self, progress: &Progress) -> Result<Built, StoreError> {
        let voxels: u64 = self.info.dims.iter().map(|&n| u64::from(n)).product();
        progress.begin("writing bricks", voxels);
        let top = self.pyramid.levels() - 1;
        let done = self.shard(top, [0; 3], progress)?;
        let range = [done.statistics[0], done.statistics[1]];
        if range[0].is_nan() {
            return Err(self.failed("the volume has no finite value"));
        }
        self.info.range = Some(range);
        let root = json!({"zarr_format": 3, "node_type": "group", "attributes": self.info.root_attributes()});
        let root = serde_json::to_vec_pretty(&root).map_err(|error| self.failed(error))?;
        self.storage.set(&key(ROOT), Bytes::from(root)).map_err(|error| self.failed(error))?;
        self.storage.erase(&key(BUILD)).map_err(|error| self.failed(error))?;
        let _ = self.lock.unlock();
        let _ = fs::remove_file(self.path.join(LOCK));
        let bytes = bytes_below(self.path).map_err(|error| self.failed(error))?;
        Ok(Built { info: self.info, written: self.written, kept: self.kept, bytes })
    }

    fn failed(&self, error: impl std::fmt::Display) -> StoreError {
        StoreError::Failed { path: self.path.to_owned(), what: error.to_string() }
    }

    /// Writes a shard and all that it is made from.
    fn shard(&mut self, level: u8, at: [u32; 3], progress: &Progress) -> Result<Done<T>, StoreError> {
        progress.check()?;
        let edge = self.info.shard_edge();
        let dims = self.pyramid.dims(level);
        let region = [0, 1, 2].map(|axis| at[axis] * edge..((at[axis] + 1).saturating_mul(edge)).min(dims[axis]));
        let size = region.clone().map(|range| range.len());
        if let Some(done) = self.done_before(level, at, size)? {
            self.kept += 1;
            let voxels = (0..3).map(|axis| {
                let ends = [region[axis].start, region[axis].end].map(|end| (u64::from(end) << level).min(u64::from(self.info.dims[axis])));
                ends[1] - ends[0]
            });
            progress.add(voxels.product());
            return Ok(done);
        }
        let mut below: Vec<([u32; 3], Vec<f64>)> = Vec::new();
        let block = if level == 0 {
            let read = self.source.read(&region).map_err(StoreError::Source)?;
            let voxels = T::take(read).filter(|voxels| voxels.len() == size.iter().product::<usize>());
            let voxels = voxels.ok_or_else(|| self.failed("the source gave other voxels than were asked for"))?;
            progress.add(voxels.len() as u64);
            Block { dims: size, voxels }
        } else {
            let mut block = Block::unknown(size);
            for part in 0..8u32 {
                let child = [0, 1, 2].map(|axis| 2 * at[axis] + (part >> axis & 1));
                let fine = self.pyramid.dims(level - 1);
                if (0..3).any(|axis| child[axis].checked_mul(edge).is_none_or(|first| first >= fine[axis])) {
                    continue;
                }
                let done = self.shard(level - 1, child, progress)?;
                if let Some(half) = done.half {
                    block.put(&half, [0, 1, 2].map(|axis| ((part >> axis & 1) * edge / 2) as usize));
                }
                below.push((child, done.statistics));
            }
            block
        };
        let statistics = self.statistics(&block, level, at, &below);
        let half = (level + 1 < self.pyramid.levels()).then(|| block.halved());
        self.write(level, at, block.padded(edge as usize), &statistics)?;
        self.written += 1;
        Ok(Done { half, statistics })
    }

    /// Smallest, largest value, entropy and share known of each brick of a shard, NaN for those beyond the end.
    fn statistics(&self, block: &Block<T>, level: u8, at: [u32; 3], below: &[([u32; 3], Vec<f64>)]) -> Vec<f64> {
        let side = self.info.shard_bricks as usize;
        let bricks = block.dims.map(|n| n.div_ceil(BRICK_EDGE as usize));
        let of_brick = |index: usize| {
            let brick = [index % side, index / side % side, index / (side * side)];
            if (0..3).any(|axis| brick[axis] >= bricks[axis]) {
                return [f64::NAN; STATISTICS];
            }
            let (mut range, entropy, mut known) = block.summary(brick);
            if level > 0 {
                range = [f64::NAN; 2];
                let mut sums = [0.0; 2];
                for part in 0..8 {
                    // The brick of the finer level, and where its shard has it.
                    let fine = [0, 1, 2].map(|axis| 2 * (at[axis] as usize * side + brick[axis]) + (part >> axis & 1));
                    let Some((_, found)) = below.iter().find(|(shard, _)| (0..3).all(|axis| shard[axis] as usize == fine[axis] / side))
                    else {
                        continue;
                    };
                    let place = fine.map(|fine| fine % side);
                    let found = &found[STATISTICS * (place[0] + side * (place[1] + side * place[2]))..];
                    let key = BrickKey { level: level - 1, at: fine.map(|at| at as u32) };
                    if !self.pyramid.has(key) {
                        continue;
                    }
                    range = [range[0].min(found[0]), range[1].max(found[1])];
                    let voxels: f64 = self.pyramid.beneath(key).map(|range| range.len() as f64).iter().product();
                    sums = [sums[0] + voxels * found[3], sums[1] + voxels];
                }
                known = sums[0] / sums[1];
            }
            [range[0], range[1], entropy, known]
        };
        (0..side.pow(3)).into_par_iter().flat_map_iter(of_brick).collect()
    }

    /// What was written of a shard by an earlier run, if it was.
    fn done_before(&self, level: u8, at: [u32; 3], size: [usize; 3]) -> Result<Option<Done<T>>, StoreError> {
        let (voxels, statistics) = &self.levels[usize::from(level)];
        let place: Vec<u64> = at.iter().rev().map(|&at| u64::from(at)).collect();
        let of_statistics: Vec<u64> = place.iter().copied().chain([0]).collect();
        let known: Option<Vec<f64>> = statistics.retrieve_chunk_if_exists(&of_statistics).map_err(|error| self.failed(error))?;
        let Some(known) = known else { return Ok(None) };
        if level + 1 == self.pyramid.levels() {
            return Ok(Some(Done { half: None, statistics: known }));
        }
        let cube: Vec<T> = voxels.retrieve_chunk(&place).map_err(|error| self.failed(error))?;
        let edge = self.info.shard_edge() as usize;
        let rows = (0..size[2]).flat_map(|z| (0..size[1]).map(move |y| (y, z)));
        let part = rows.flat_map(|(y, z)| &cube[edge * (y + edge * z)..][..size[0]]).copied().collect();
        let half = Block { dims: size, voxels: part }.halved();
        Ok(Some(Done { half: Some(half), statistics: known }))
    }

    fn write(&self, level: u8, at: [u32; 3], cube: Block<T>, known: &[f64]) -> Result<(), StoreError> {
        let (voxels, statistics) = &self.levels[usize::from(level)];
        let place: Vec<u64> = at.iter().rev().map(|&at| u64::from(at)).collect();
        // What is missing is damage, not emptiness.
        let always = CodecOptions::default().with_store_empty_chunks(true);
        voxels.store_chunk_opt(&place, cube.voxels, &always).map_err(|error| self.failed(error))?;
        let of_statistics: Vec<u64> = place.iter().copied().chain([0]).collect();
        statistics.store_chunk_opt(&of_statistics, known, &always).map_err(|error| self.failed(error))
    }
}

/// What lies at the place of a store to be written.
enum Found {
    Nothing,
    Begun(Box<Begun>),
    Whole,
    Foreign,
}

impl Found {
    fn at(path: &Path) -> Result<Self, StoreError> {
        let failed = |error: io::Error| StoreError::Failed { path: path.to_owned(), what: error.to_string() };
        if !path.is_dir() {
            return Ok(if path.exists() { Found::Foreign } else { Found::Nothing });
        }
        let read = |name: &str| match fs::read(path.join(name)) {
            Ok(text) => Ok(Some(serde_json::from_slice::<Value>(&text).unwrap_or_default())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed(error)),
        };
        let begun = read(BUILD)?.map(|value| serde_json::from_value::<Begun>(value).ok());
        if let Some(Some(begun)) = &begun
            && begun.removing
        {
            return Ok(Found::Begun(Box::new(begun.clone())));
        }
        if let Some(root) = read(ROOT)? {
            return Ok(if root.pointer("/attributes/octetra").is_some() { Found::Whole } else { Found::Foreign });
        }
        match begun {
            Some(Some(begun)) if SHARD_BRICKS.contains(&begun.info.shard_bricks) => Ok(Found::Begun(Box::new(begun))),
            Some(_) => Ok(Found::Foreign),
            None => {
                // What a run leaves that was killed before it wrote anything.
                let leavings = [LOCK.to_owned(), format!("{BUILD}{UNFINISHED}")];
                let names: io::Result<Vec<_>> = fs::read_dir(path).map_err(failed)?.map(|entry| Ok(entry?.file_name())).collect();
                let is_ours = names.map_err(failed)?.iter().all(|name| leavings.iter().any(|leaving| *name == **leaving));
                Ok(if is_ours { Found::Nothing } else { Found::Foreign })
            }
        }
    }
}

/// Removes a store, and nothing that is not its own. That it is being removed has been written before.
fn remove(path: &Path) -> io::Result<()> {
    let gone = |result: io::Result<()>| match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    };
    gone(fs::remove_file(path.join(ROOT)))?;
    for folder in std::iter::once("statistics".to_owned()).chain((0..=32).map(|level| level.to_string())) {
        gone(fs::remove_dir_all(path.join(folder)))?;
    }
    Ok(())
}

#[expect(clippy::expect_used, reason = "the names are constants")]
fn key(name: &str) -> StoreKey {
    StoreKey::new(name).expect("a name of ours is a key")
}

/// Bytes of all files in a folder and those below.
fn bytes_below(path: &Path) -> io::Result<u64> {
    let mut bytes = 0;
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        let metadata = entry.metadata()?;
        bytes += if metadata.is_dir() { bytes_below(&entry.path())? } else { metadata.len() };
    }
    Ok(bytes)
}
