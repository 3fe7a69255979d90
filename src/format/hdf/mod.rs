//! HDF5 files: data sets by path, with limits on what a damaged file can ask for; and [`read`], which tells the formats apart that live
//! in such files.
//!
//! The file is read by `hdf5-reader`. Links to other files and raw data outside the file are refused.

mod file;
mod joined;
mod numbers;
#[cfg(test)]
mod tests;
mod vtkhdf;

pub(super) use file::Hdf;
pub(super) use joined::Joined;
pub(super) use numbers::{Budget, Numbers, Pieces};

use super::source::Source;
use super::{GridFile, ParseError};
use crate::mesh::UnstructuredGrid;
use crate::progress::Progress;
use hdf5_reader::OpenOptions;
use hdf5_reader::error::Error;
use hdf5_reader::storage::{BytesStorage, DynStorage, FileStorage};
use std::sync::Arc;

/// What every HDF5 file starts with, unless it has a block of the user's before it.
const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Deflate makes at most 1,032 bytes of one.
const LARGEST_RATIO: u64 = 1_040;

/// Whether a file that starts so is HDF5.
pub(super) fn recognizes(start: &[u8]) -> bool {
    start.starts_with(MAGIC) || start.get(512..).is_some_and(|rest| rest.starts_with(MAGIC))
}

/// Reads a mesh from an HDF5 file: VTKHDF or Exodus II.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    progress.begin("reading", file.source.len());
    let opened = Hdf::open(file.source, progress)?;
    if opened.group(vtkhdf::ROOT)?.is_some() {
        return vtkhdf::read(&opened);
    }
    let (groups, sets) = opened.names_in("/")?;
    if sets.iter().any(|name| name == "coordx" || name == "coord" || name == "connect1") {
        return super::exodus::read(file, progress);
    }
    let has: Vec<String> = groups.into_iter().chain(sets).take(8).collect();
    let has = if has.is_empty() { "nothing".into() } else { has.join(", ") };
    Err(ParseError::Unsupported(format!(
        "is an HDF5 file with {has}; octetra reads VTKHDF (a group VTKHDF), Exodus II (data sets coordx and connect1), and the files of an XDMF file, \
         which is the one to open"
    )))
}

/// Where the crates find the bytes of a file.
pub(super) fn storage(source: &Source<'_>) -> Result<DynStorage, ParseError> {
    Ok(match source {
        Source::Bytes(bytes) => Arc::new(BytesStorage::new(bytes.to_vec())),
        Source::File(file, _) => Arc::new(FileStorage::from_file(file.try_clone()?).map_err(|e| error("the file", e))?),
    })
}

/// The limits for a file of so many bytes.
pub(super) fn limits(len: u64) -> OpenOptions {
    let bytes = usize::try_from(len.saturating_mul(LARGEST_RATIO).saturating_add(1 << 20)).unwrap_or(usize::MAX);
    let header = OpenOptions::default().max_object_header_bytes.min(bytes);
    // Nothing is read twice, so that nothing is kept.
    let options = OpenOptions::default().with_chunk_cache_bytes(0);
    options.with_max_chunk_bytes(bytes).with_max_read_bytes(bytes).with_max_object_header_bytes(header)
}

/// What the crate says, at a place.
pub(super) fn error(place: &str, error: Error) -> ParseError {
    match error {
        Error::Io(error) => ParseError::Io(error),
        error => ParseError::invalid(place, error.to_string(), "sound HDF5"),
    }
}
