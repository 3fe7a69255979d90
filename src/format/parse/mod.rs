//! What readers of meshes share: words of a text, numbers of a binary file, files beside the one named, and how all of them say what is wrong.

mod arrays;
mod binary;
mod tags;
mod words;

pub(super) use arrays::{real_numbers, whole_numbers};
pub(super) use binary::{Binary, Plain};
pub(super) use tags::Tags;
pub(super) use words::{Words, real};

use super::GridFile;
use super::vtu::VtuError;
use crate::mesh::{MeshError, TooManyCellPoints};
use crate::progress::Cancelled;
use std::borrow::Cow;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Why a file is no mesh that octetra can read. The texts continue the file's name and a colon.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Something in it is not what it should be.
    #[error("{place}: {found}, expected {expected}")]
    Invalid {
        /// Where: a line, a section, a byte.
        place: String,
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// One of VTK's files is not sound.
    #[error("{0}")]
    Vtk(#[from] VtuError),
    /// It is sound, but of a kind that octetra does not read.
    #[error("{0}")]
    Unsupported(String),
    /// A file that it names cannot be read.
    #[error("its file {}: {problem}", file.display())]
    Other {
        /// The file, as it is named.
        file: PathBuf,
        /// What is wrong with it.
        problem: Box<ParseError>,
    },
    /// It has more than can be indexed.
    #[error("{0}")]
    TooMany(#[from] TooManyCellPoints),
    /// Its cells make no mesh.
    #[error("{0}")]
    Mesh(#[from] MeshError),
}

impl ParseError {
    /// Something that is not what it should be: `place` is where (`line 12`), `found` what stands there.
    pub(super) fn invalid(place: impl Into<String>, found: impl Into<String>, expected: impl Into<String>) -> Self {
        ParseError::Invalid { place: place.into(), found: found.into(), expected: expected.into() }
    }

    /// The request to stop, if that is why.
    pub(super) fn cancelled(&self) -> Option<Cancelled> {
        match self {
            ParseError::Cancelled(cancelled) | ParseError::Vtk(VtuError::Cancelled(cancelled)) => Some(*cancelled),
            ParseError::Other { problem, .. } => problem.cancelled(),
            _ => None,
        }
    }
}

/// All bytes of a file.
pub(super) fn all_of<'a>(file: &'a GridFile<'_>) -> Result<Cow<'a, [u8]>, ParseError> {
    let len = usize::try_from(file.source.len()).map_err(|_| ParseError::Io(io::ErrorKind::OutOfMemory.into()))?;
    Ok(file.source.read(0, len)?)
}

/// The path of a file that another names, which must lie in that one's folder or below.
pub(super) fn beside(file: &GridFile<'_>, name: &str) -> Result<PathBuf, ParseError> {
    let relative = Path::new(name.trim());
    let is_below = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !is_below || name.trim().is_empty() {
        let found = format!("it names the file \"{}\"", name.trim());
        return Err(ParseError::invalid("a reference", found, "a file in the same folder or below"));
    }
    Ok(file.path.parent().unwrap_or(Path::new("")).join(relative))
}

/// All bytes of another file, which must be a regular one: a pipe would not end.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, ParseError> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(ParseError::Unsupported("not a regular file".into()));
    }
    Ok(std::fs::read(path)?)
}

/// What stands in a file, short enough for a message.
pub(super) fn shown(bytes: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(bytes).trim().chars().take(40).collect();
    format!("\"{}\"", text.escape_debug())
}

/// What a reader makes of bytes in memory, for tests.
#[cfg(test)]
pub(super) fn parsed(
    read: fn(&GridFile<'_>, &crate::progress::Progress) -> Result<crate::mesh::UnstructuredGrid, ParseError>,
    bytes: &[u8],
) -> Result<crate::mesh::UnstructuredGrid, ParseError> {
    let source = super::Source::Bytes(bytes);
    let file = GridFile { source: &source, path: Path::new("a mesh"), options: &super::ReadOptions::default() };
    read(&file, &crate::progress::Progress::new())
}
