//! Files to meshes: one file a format, one registry line each.

mod cell_types;
mod source;
pub mod vtu;

use crate::mesh::{MeshError, MeshParts, TetMesh};
use crate::progress::{Cancelled, Progress};
use source::Source;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use vtu::VtuError;

/// The formats that [`read_mesh`] knows, one line each.
pub const FORMATS: &[Format] = &[Format {
    name: "VTK XML unstructured grid",
    suffixes: &["vtu"],
    recognizes: is_vtu,
    read: |source, progress| Ok(vtu::read(source, progress)?),
}];

/// Bytes at the start of a file that a format is recognized by.
const SNIFFED: u64 = 1024;

/// A file format.
#[derive(Debug)]
pub struct Format {
    /// What people call it.
    pub name: &'static str,
    /// The suffixes its files have, in lower case, without the dot.
    pub suffixes: &'static [&'static str],
    recognizes: fn(&[u8]) -> bool,
    read: fn(&Source<'_>, &Progress) -> Result<MeshParts, Problem>,
}

/// What is wrong with a file, its name aside.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is a directory or a device.
    #[error("not a regular file")]
    NotAFile,
    /// Neither its suffix nor its content is known.
    #[error("its format is not known; octetra reads {}", known())]
    Unknown,
    /// It is not sound `.vtu`.
    #[error("{0}")]
    Vtu(#[from] VtuError),
    /// What it holds is not a mesh.
    #[error("{0}")]
    Mesh(#[from] MeshError),
}

/// Why a file gives no mesh.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// Something is wrong with the file.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: Box<Problem>,
    },
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Reads a mesh from a file of any format in [`FORMATS`], told by its content or else by its suffix. The file is read piece by piece: the
/// peak of memory is the mesh and a few MiB, or the largest compressed block.
pub fn read_mesh(path: &Path, progress: &Progress) -> Result<TetMesh, FormatError> {
    let open = || -> Result<(File, u64), Problem> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        if metadata.is_file() { Ok((file, metadata.len())) } else { Err(Problem::NotAFile) }
    };
    let found = open().and_then(|(file, len)| read_source(&Source::File(&file, len), path, progress));
    found.map_err(|problem| named(path, problem))
}

/// Reads a mesh from a file that is in memory. `name` stands for its path: its suffix tells the format if its content does not, and
/// errors begin with it.
pub fn read_embedded(name: &str, bytes: &[u8], progress: &Progress) -> Result<TetMesh, FormatError> {
    let path = Path::new(name);
    read_source(&Source::Bytes(bytes), path, progress).map_err(|problem| named(path, problem))
}

fn named(path: &Path, problem: Problem) -> FormatError {
    match problem {
        Problem::Vtu(VtuError::Cancelled(cancelled)) => FormatError::Cancelled(cancelled),
        problem => FormatError::File { path: path.to_owned(), problem: Box::new(problem) },
    }
}

fn read_source(source: &Source<'_>, path: &Path, progress: &Progress) -> Result<TetMesh, Problem> {
    let start = source.read(0, source.len().min(SNIFFED) as usize)?;
    let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
    let by_content = || FORMATS.iter().find(|format| (format.recognizes)(&start));
    let by_suffix = || FORMATS.iter().find(|format| format.suffixes.contains(&suffix.as_str()));
    let format = by_content().or_else(by_suffix).ok_or(Problem::Unknown)?;
    Ok(TetMesh::new((format.read)(source, progress)?)?)
}

/// The known formats as text.
fn known() -> String {
    let one = |format: &Format| format!("{} (.{})", format.name, format.suffixes.join(", ."));
    FORMATS.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn is_vtu(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    text.contains("<VTKFile") && text.contains("UnstructuredGrid")
}
