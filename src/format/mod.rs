//! Files to meshes and volumes: one file a format, one registry line each.

mod abaqus;
#[cfg(test)]
mod corpus_tests;
#[cfg(test)]
mod damage_tests;
mod ensight;
mod exodus;
pub mod gmsh;
mod hdf;
mod legacy_vtk;
mod medit;
mod meta_image;
pub mod nrrd;
mod openfoam;
mod parse;
mod plot3d;
mod raw;
pub mod segy;
#[cfg(test)]
mod segy_tests;
pub mod series;
mod source;
mod su2;
mod surface;
mod tetgen;
pub mod transfer_file;
#[cfg(test)]
mod volume_tests;
mod voxel_data;
mod vti;
pub mod vtu;
mod xdmf;

use crate::mesh::{MeshError, MeshParts, TetMesh, UnstructuredGrid, to_tets};
use crate::progress::{Cancelled, Progress};
use crate::volume::Grid;
pub use parse::ParseError;
pub use plot3d::Plot3dError;
pub use raw::RawLayout;
use segy::SegyOptions;
pub use series::Series;
use source::Source;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
pub use surface::write_ply;
pub use voxel_data::VolumeError;
use vtu::VtuError;

/// The formats that [`read`] knows, one line each.
#[rustfmt::skip]
pub const FORMATS: &[Format] = &[
    Format { name: "VTK XML unstructured grid", suffixes: &["vtu"], recognizes: |start| vtu::is_of_type(start, "UnstructuredGrid"), reader: Reader::Vtk(vtu::read) },
    Format { name: "VTK XML surface", suffixes: &["vtp"], recognizes: vtu::recognizes_surface, reader: Reader::Vtk(vtu::read_surface) },
    Format { name: "VTK XML pieces in several files", suffixes: &["pvtu", "pvts", "pvtr", "pvtp"], recognizes: vtu::parallel::recognizes, reader: Reader::Cells(vtu::parallel::read) },
    Format { name: "VTK XML image data", suffixes: &["vti"], recognizes: vti::recognizes, reader: Reader::Grid(vti::read) },
    Format { name: "VTK XML structured grid", suffixes: &["vts"], recognizes: vtu::structured::recognizes_structured, reader: Reader::Mesh(vtu::structured::read_structured) },
    Format { name: "VTK XML rectilinear grid", suffixes: &["vtr"], recognizes: vtu::structured::recognizes_rectilinear, reader: Reader::Mesh(vtu::structured::read_rectilinear) },
    Format { name: "VTK legacy", suffixes: &["vtk"], recognizes: legacy_vtk::recognizes, reader: Reader::Either(legacy_vtk::read) },
    Format { name: "Gmsh mesh", suffixes: &["msh"], recognizes: gmsh::recognizes, reader: Reader::Cells(gmsh::read) },
    Format { name: "Exodus II", suffixes: exodus::SUFFIXES, recognizes: exodus::recognizes, reader: Reader::Cells(exodus::read) },
    Format { name: "VTKHDF", suffixes: &["vtkhdf", "hdf"], recognizes: hdf::recognizes, reader: Reader::Cells(hdf::read) },
    Format { name: "Medit mesh", suffixes: &["mesh", "meshb"], recognizes: medit::recognizes, reader: Reader::Cells(medit::read) },
    Format { name: "SU2 mesh", suffixes: &["su2"], recognizes: |_| false, reader: Reader::Cells(su2::read) },
    Format { name: "TetGen mesh", suffixes: &["node", "ele"], recognizes: |_| false, reader: Reader::Cells(tetgen::read) },
    Format { name: "Abaqus or CalculiX mesh", suffixes: &["inp"], recognizes: abaqus::recognizes, reader: Reader::Cells(abaqus::read) },
    Format { name: "XDMF", suffixes: &["xdmf", "xmf"], recognizes: xdmf::recognizes, reader: Reader::Cells(xdmf::read) },
    Format { name: "NRRD", suffixes: &["nrrd", "nhdr"], recognizes: nrrd::recognizes, reader: Reader::Grid(nrrd::read) },
    Format { name: "PLOT3D", suffixes: plot3d::SUFFIXES, recognizes: |_| false, reader: Reader::Structured(plot3d::read) },
    Format { name: "OpenFOAM case", suffixes: openfoam::SUFFIXES, recognizes: |_| false, reader: Reader::Cells(openfoam::read) },
    Format { name: "EnSight Gold", suffixes: ensight::SUFFIXES, recognizes: ensight::recognizes, reader: Reader::Cells(ensight::read) },
    Format { name: "MetaImage", suffixes: &["mhd", "mha"], recognizes: meta_image::recognizes, reader: Reader::Grid(meta_image::read) },
    Format { name: "SEG-Y", suffixes: segy::SUFFIXES, recognizes: segy::recognizes, reader: Reader::Grid(segy::read) },
    Format { name: "STL", suffixes: &["stl"], recognizes: surface::stl::recognizes, reader: Reader::Cells(surface::stl::read) },
    Format { name: "PLY", suffixes: &["ply"], recognizes: surface::ply::recognizes, reader: Reader::Cells(surface::ply::read) },
    Format { name: "Wavefront OBJ", suffixes: &["obj"], recognizes: surface::obj::recognizes, reader: Reader::Cells(surface::obj::read) },
    Format { name: "OFF", suffixes: &["off"], recognizes: surface::off::recognizes, reader: Reader::Cells(surface::off::read) },
];

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
    reader: Reader,
}

impl Format {
    /// What its files hold, in words.
    pub fn holds(&self) -> &'static str {
        match self.reader {
            Reader::Grid(_) => "a volume",
            Reader::Either(_) => "a mesh or a volume",
            Reader::Structured(_) | Reader::Mesh(_) => "a curvilinear grid",
            Reader::Vtk(_) | Reader::Cells(_) => "a mesh",
        }
    }
}

/// What reads a format.
#[derive(Debug)]
enum Reader {
    Vtk(fn(&Source<'_>, &Progress) -> Result<Found, VtuError>),
    Mesh(fn(&Source<'_>, &Progress) -> Result<MeshParts, VtuError>),
    Grid(fn(&GridFile<'_>, &Progress) -> Result<Grid, VolumeError>),
    Structured(fn(&GridFile<'_>, &Progress) -> Result<MeshParts, Plot3dError>),
    Either(fn(&GridFile<'_>, &Progress) -> Result<Found, VolumeError>),
    Cells(fn(&GridFile<'_>, &Progress) -> Result<UnstructuredGrid, ParseError>),
}

/// What a reader found.
#[derive(Debug)]
enum Found {
    Cells(UnstructuredGrid),
    Mesh(MeshParts),
    Grid(Grid),
}

/// What a file holds.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // there is one of it
pub enum Data {
    /// A mesh with all its arrays.
    Mesh(TetMesh),
    /// A volume of one of its arrays.
    Grid(Grid),
}

/// What a file holds, as it holds it.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // there is one of it
pub enum Contents {
    /// Cells of any type.
    Cells(UnstructuredGrid),
    /// Tets.
    Tets(MeshParts),
    /// A volume of one of its arrays.
    Grid(Grid),
}

/// What is wanted of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// The array of a volume; `None` takes the file's active scalars, else the first. Meshes are read with all their arrays.
    pub array: Option<String>,
    /// The component of a volume's vectors, from 0; `None` takes their length.
    pub component: Option<usize>,
    /// The file is a volume of plain bytes, whatever it looks like.
    pub raw: Option<RawLayout>,
    /// Bytes that the values of a volume may take in memory.
    pub memory_bytes: u64,
    /// Raw numbers of a volume that take so many bytes or more stay in their file, which is mapped, if they can: see
    /// [`Numbers`](crate::volume::Numbers). Fewer do only if memory lacks.
    pub map_from_bytes: u64,
    /// Where the solution of a PLOT3D grid lies.
    pub solution: SolutionFile,
    /// How SEG-Y is read where the file does not say so itself.
    pub segy: SegyOptions,
}

/// Where the solution of a PLOT3D grid lies.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum SolutionFile {
    /// Beside the grid, under one of the usual names; without it there is nothing to show, which is an error.
    #[default]
    Beside,
    /// Beside the grid if it is there; else the mesh has no arrays.
    IfBeside,
    /// Here.
    At(PathBuf),
}

impl Default for ReadOptions {
    fn default() -> Self {
        let map_from_bytes = 64 << 20;
        ReadOptions {
            array: None,
            component: None,
            raw: None,
            memory_bytes: u64::MAX,
            map_from_bytes,
            solution: SolutionFile::Beside,
            segy: SegyOptions::default(),
        }
    }
}

/// A file that a reader works on that may need others.
struct GridFile<'a> {
    source: &'a Source<'a>,
    /// Where it lies: other files are looked for beside it.
    path: &'a Path,
    options: &'a ReadOptions,
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
    /// It is no sound volume.
    #[error("{0}")]
    Volume(#[from] VolumeError),
    /// It is no sound PLOT3D grid, or its solution is not.
    #[error("{0}")]
    Plot3d(#[from] Plot3dError),
    /// It is no sound file of cells.
    #[error("{0}")]
    Parse(#[from] ParseError),
    /// A solution was named for a file of another format.
    #[error("is {0}, which has its arrays in itself; a solution belongs to a PLOT3D grid")]
    NoUseForSolution(&'static str),
    /// It is a volume where a mesh is needed.
    #[error("is a regular volume ({0}), expected a tetrahedral mesh; octetra render, view, tune, regularize and info take volumes")]
    IsVolume(&'static str),
}

/// Why a file gives no mesh or volume.
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

/// Reads a mesh or a volume from a file of any format in [`FORMATS`], told by its content or else by its suffix. The file is read piece by
/// piece: the peak of memory is what it holds and a few MiB, or the largest compressed block. A volume may have its numbers in another
/// file, which must lie beside the first or in a folder below.
pub fn read(path: &Path, options: &ReadOptions, progress: &Progress) -> Result<Data, FormatError> {
    opened(path, |source| read_source(source, path, options, progress))
}

/// Reads a file as [`read`] does, and leaves its cells as they are.
pub fn read_contents(path: &Path, options: &ReadOptions, progress: &Progress) -> Result<Contents, FormatError> {
    opened(path, |source| contents(source, path, options, progress))
}

/// Reads a mesh, as [`read`] does with default options; a volume is refused.
pub fn read_mesh(path: &Path, progress: &Progress) -> Result<TetMesh, FormatError> {
    read_mesh_with(path, &ReadOptions::default(), progress)
}

/// Reads a mesh, as [`read`] does; a volume is refused before its numbers are read.
pub fn read_mesh_with(path: &Path, options: &ReadOptions, progress: &Progress) -> Result<TetMesh, FormatError> {
    opened(path, |source| read_mesh_source(source, path, options, progress))
}

/// Reads a mesh from a file that is in memory. `name` stands for its path: its suffix tells the format if its content does not, and
/// errors begin with it.
pub fn read_embedded(name: &str, bytes: &[u8], progress: &Progress) -> Result<TetMesh, FormatError> {
    let path = Path::new(name);
    read_mesh_source(&Source::Bytes(bytes), path, &ReadOptions::default(), progress).map_err(|problem| named(path, problem))
}

/// Reads what lies at a path. A folder that is read as one file has no bytes of its own.
fn opened<T>(path: &Path, read: impl FnOnce(&Source<'_>) -> Result<T, Problem>) -> Result<T, FormatError> {
    let found = match openfoam::is_folder(path) {
        true => read(&Source::Bytes(&[])),
        false => open(path).and_then(|(file, len)| read(&Source::File(&file, len))),
    };
    found.map_err(|problem| named(path, problem))
}

/// What a file that is in memory holds, as [`read_embedded`] reads it.
pub fn embedded_contents(name: &str, bytes: &[u8], progress: &Progress) -> Result<Contents, FormatError> {
    let path = Path::new(name);
    contents(&Source::Bytes(bytes), path, &ReadOptions::default(), progress).map_err(|problem| named(path, problem))
}

fn open(path: &Path) -> Result<(File, u64), Problem> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_file() { Ok((file, metadata.len())) } else { Err(Problem::NotAFile) }
}

fn named(path: &Path, problem: Problem) -> FormatError {
    match problem {
        Problem::Vtu(VtuError::Cancelled(cancelled)) | Problem::Plot3d(Plot3dError::Cancelled(cancelled)) => {
            FormatError::Cancelled(cancelled)
        }
        Problem::Parse(problem) if problem.cancelled().is_some() => FormatError::Cancelled(Cancelled),
        Problem::Volume(volume) if volume.cancelled().is_some() => FormatError::Cancelled(Cancelled),
        problem => FormatError::File { path: path.to_owned(), problem: Box::new(problem) },
    }
}

fn read_source(source: &Source<'_>, path: &Path, options: &ReadOptions, progress: &Progress) -> Result<Data, Problem> {
    Ok(match contents(source, path, options, progress)? {
        Contents::Cells(grid) => Data::Mesh(TetMesh::new(to_tets(grid)?)?),
        Contents::Tets(parts) => Data::Mesh(TetMesh::new(parts)?),
        Contents::Grid(grid) => Data::Grid(grid),
    })
}

fn contents(source: &Source<'_>, path: &Path, options: &ReadOptions, progress: &Progress) -> Result<Contents, Problem> {
    let file = GridFile { source, path, options };
    if let Some(layout) = &options.raw {
        return Ok(Contents::Grid(raw::read(&file, layout, progress)?));
    }
    let format = format_of(source, path)?;
    check_solution(format, options)?;
    let found = match format.reader {
        Reader::Grid(read) => Found::Grid(read(&file, progress)?),
        Reader::Vtk(read) => read(source, progress)?,
        Reader::Mesh(read) => Found::Mesh(read(source, progress)?),
        Reader::Structured(read) => Found::Mesh(read(&file, progress)?),
        Reader::Either(read) => read(&file, progress)?,
        Reader::Cells(read) => Found::Cells(read(&file, progress)?),
    };
    Ok(match found {
        Found::Cells(grid) => Contents::Cells(grid),
        Found::Grid(grid) => Contents::Grid(grid),
        Found::Mesh(parts) => Contents::Tets(parts),
    })
}

fn read_mesh_source(source: &Source<'_>, path: &Path, options: &ReadOptions, progress: &Progress) -> Result<TetMesh, Problem> {
    let format = format_of(source, path)?;
    if matches!(format.reader, Reader::Grid(_)) {
        return Err(Problem::IsVolume(format.name));
    }
    match read_source(source, path, &ReadOptions { raw: None, ..options.clone() }, progress)? {
        Data::Mesh(mesh) => Ok(mesh),
        Data::Grid(_) => Err(Problem::IsVolume(format.name)),
    }
}

/// Only PLOT3D has its arrays in a second file.
fn check_solution(format: &Format, options: &ReadOptions) -> Result<(), Problem> {
    let has_use = matches!(format.reader, Reader::Structured(_)) || !matches!(options.solution, SolutionFile::At(_));
    if has_use { Ok(()) } else { Err(Problem::NoUseForSolution(format.name)) }
}

fn format_of(source: &Source<'_>, path: &Path) -> Result<&'static Format, Problem> {
    let start = source.read(0, source.len().min(SNIFFED) as usize)?;
    let suffix = match openfoam::is_folder(path) {
        true => openfoam::SUFFIXES[0].to_owned(),
        false => path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default(),
    };
    let by_content = || FORMATS.iter().find(|format| (format.recognizes)(&start));
    let by_suffix = || FORMATS.iter().find(|format| format.suffixes.contains(&suffix.as_str()));
    by_content().or_else(by_suffix).ok_or(Problem::Unknown)
}

/// The known formats as text.
fn known() -> String {
    let one = |format: &Format| format!("{} (.{})", format.name, format.suffixes.join(", ."));
    FORMATS.iter().map(one).collect::<Vec<_>>().join(", ")
}
