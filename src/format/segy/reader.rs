//! SEG-Y among the other formats: from a file to a [`Grid`] or a [`SegyVolume`].

use super::{Input, SegyError, SegyOptions, SegyVolume};
use crate::format::source::Source;
use crate::format::voxel_data::VolumeError;
use crate::format::{FormatError, GridFile, Problem, format_of, named, open, opened};
use crate::progress::Progress;
use crate::volume::{Grid, VoxelSource};
use std::path::Path;

/// The suffixes that its files have.
pub(in crate::format) const SUFFIXES: &[&str] = &["sgy", "segy", "seg"];

/// Whether a textual header begins like that of SEG-Y: lines of 80 characters without ends, each with a C and its number, in EBCDIC or ASCII.
pub(in crate::format) fn recognizes(start: &[u8]) -> bool {
    // The letter C, the digit 0, the blank.
    [[0xc3, 0xf0, 0x40], *b"C0 "].into_iter().any(|[letter, zero, blank]| {
        let digit = |n: usize| zero + n as u8;
        let is_numbered = |(n, line): (usize, &[u8])| {
            let (tens, units) = (digit((n + 1) / 10), digit((n + 1) % 10));
            let number = [line[1], line[2]];
            let is_short = n < 9 && [[blank, units], [units, blank]].contains(&number);
            line[0] == letter && (number == [tens, units] || is_short)
        };
        start.len() >= 960 && start.chunks_exact(80).take(12).enumerate().all(is_numbered)
    })
}

/// Whether a file is SEG-Y, by its content or else its suffix. A file of no known format is an error.
pub fn is_segy(path: &Path) -> Result<bool, FormatError> {
    opened(path, |source| Ok(format_of(source, path)?.suffixes == SUFFIXES))
}

/// Reads a whole survey into memory.
pub(in crate::format) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<Grid, VolumeError> {
    let input = match file.source {
        Source::File(file, len) => Input::File(file.try_clone()?, *len),
        Source::Bytes(bytes) => Input::Bytes(bytes.to_vec()),
    };
    let volume = SegyVolume::new(input, file.path.to_owned(), &file.options.segy, progress)?;
    match &file.options.array {
        Some(name) if name != volume.name() => {
            return Err(VolumeError::NoArray(Some(format!(" named \"{name}\"; the volume has \"{}\"", volume.name()))));
        }
        _ => {}
    }
    let points = volume.frame.points();
    let need = points.saturating_mul(volume.voxel_type.bytes() as u64);
    file.check_memory(need, format!("{points} voxels at once (octetra bricks makes a store of them within any budget)"))?;
    Ok(volume.grid(progress)?)
}

impl SegyVolume {
    /// Reads the headers of a file. Errors begin with its name.
    pub fn open(path: &Path, options: &SegyOptions, progress: &Progress) -> Result<Self, FormatError> {
        let opened = open(path).and_then(|(file, len)| {
            let volume = SegyVolume::new(Input::File(file, len), path.to_owned(), options, progress);
            volume.map_err(|error| Problem::Volume(error.into()))
        });
        opened.map_err(|problem| named(path, problem))
    }

    /// All of it in memory.
    pub(super) fn grid(&self, progress: &Progress) -> Result<Grid, SegyError> {
        let dims = self.frame.dims;
        progress.begin("reading traces", u64::from(dims[1]) * u64::from(dims[2]));
        let samples = self.samples(&dims.map(|n| 0..n), Some(progress))?;
        Ok(Grid::new(self.frame, self.name().to_owned(), samples)?.with_notes(self.notes.clone()))
    }
}
