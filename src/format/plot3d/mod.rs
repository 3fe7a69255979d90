//! PLOT3D (Walatka et al., *PLOT3D User's Manual*, NASA TM 101067, 1990): a grid of curvilinear blocks and, in a file of its own, a solution on it.
//! The hexahedra become tets by [`split_into_tets`].
//!
//! Nothing in the files says how they are written. What is tried: 4- and 8-byte floats, both byte orders, with and without Fortran's
//! record marks, one block or several, with and without `iblank`, and text; what fits the length to the byte is taken. The rules where
//! the format leaves a choice are ParaView's:
//!
//! * A solution's arrays are called Density, Momentum and StagnationEnergy, a function file's Function0, Function1, ...; blocks with fewer
//!   functions than others miss values there.
//! * A point whose `iblank` is 0 does not count, and takes its cells with it; walls and points interpolated from other blocks count.
//! * Blocks of a single layer have no volume and are left out. Blocks that overlap are both drawn.
//! * Bytes behind a solution are passed over if one more array would take more.
//!
//! [`partners`] says where the solution is looked for. Files in two dimensions, whole planes at a time or with the extended solutions of
//! OVERFLOW are refused by their length.

mod layout;
mod numbers;
#[cfg(test)]
mod tests;

use super::source::Source;
use super::{GridFile, SolutionFile};
use crate::mesh::{DataArray, MeshError, MeshParts, StructuredBlock, Values, split_into_tets};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use layout::{Header, Kind, grid_header, solution_header};
use numbers::{File, Reader};
use std::io;
use std::path::{Path, PathBuf};

/// The suffixes of grids, of grids and solutions alike, and of solutions.
pub(super) const SUFFIXES: &[&str] = &["xyz", "x", "p3d", "g", "grd", "bin", "fmt", "q", "f"];

/// The suffixes that only solutions have.
const SOLUTIONS: [&str; 2] = ["q", "f"];

/// The suffixes that only grids have.
const GRIDS: [&str; 5] = ["xyz", "x", "p3d", "g", "grd"];

/// Ends of the stems of grids, and of their solutions.
const STEMS: [(&str, &[&str]); 3] = [("xyz", &["q", "f"]), ("grid", &["q", "sol", "f"]), ("x", &["q", "f"])];

/// Why a grid and its solution give no mesh. The texts continue the named file's name and a colon; `place` is which of the two.
#[derive(Debug, thiserror::Error)]
pub enum Plot3dError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The other file of the pair cannot be opened.
    #[error("{place} cannot be read: {reason}")]
    Partner {
        /// The other file.
        place: String,
        /// What the system says.
        reason: io::Error,
    },
    /// There is no solution.
    #[error("is a PLOT3D grid without a solution beside it (looked for {looked_for}); name its file with --solution")]
    NoSolution {
        /// The names that it might have.
        looked_for: String,
    },
    /// A solution was opened, and there is no grid.
    #[error("is a PLOT3D solution without a grid beside it (looked for {looked_for}); open the grid, with --solution")]
    NoGrid {
        /// The names that it might have.
        looked_for: String,
    },
    /// Its first numbers cannot be dimensions.
    #[error(
        "{place} does not begin as PLOT3D does: expected the points along three axes, or how many blocks there are and then those of each, as 4-byte integers or as text"
    )]
    NoHeader {
        /// Which file.
        place: String,
    },
    /// It is as long as no layout makes it.
    #[error("{place} has {found} {unit}, expected {expected} for {why}")]
    Length {
        /// Which file.
        place: String,
        /// Its length.
        found: u64,
        /// "bytes", or "numbers" of text.
        unit: &'static str,
        /// The lengths that it might have.
        expected: String,
        /// The blocks that call for them.
        why: String,
    },
    /// It can be read in several ways.
    #[error("{place} can be read in several ways, expected one: {ways}")]
    Ambiguous {
        /// Which file.
        place: String,
        /// The ways.
        ways: String,
    },
    /// A record mark is wrong.
    #[error("{place} has a Fortran record mark of {found} at byte {at}, expected {expected}")]
    Record {
        /// Which file.
        place: String,
        /// Where.
        at: u64,
        /// The mark.
        found: i64,
        /// What it should be.
        expected: u64,
    },
    /// Text that is no number.
    #[error("{place} has \"{found}\" among its numbers, at byte {at}")]
    Text {
        /// Which file.
        place: String,
        /// The text.
        found: String,
        /// Where.
        at: u64,
    },
    /// It would take more memory than it may.
    #[error("{place} holds more numbers than fit the budget of {limit} bytes; raise it with --memory")]
    Memory {
        /// Which file.
        place: String,
        /// Bytes that there are.
        limit: u64,
    },
    /// The solution is another grid's.
    #[error("{place} has {found}, expected the grid's {expected}")]
    OtherGrid {
        /// The solution.
        place: String,
        /// What it has.
        found: String,
        /// What the grid has.
        expected: String,
    },
    /// No block has a volume.
    #[error("holds {0}, expected a block with at least 2 points along each axis")]
    Flat(String),
    /// What is in it cannot be indexed.
    #[error("{0}")]
    Mesh(#[from] MeshError),
}

/// Reads a grid with its solution, whichever of the two is named.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<MeshParts, Plot3dError> {
    progress.begin("reading", file.source.len());
    let memory_bytes = file.options.memory_bytes;
    if let Some(grid_path) = grid_of(file.path)? {
        let (opened, len) = open(&grid_path, "its grid")?;
        let grid = File::new(Source::File(&opened, len), format!("its grid {}", shown(&grid_path)), memory_bytes)?;
        let solution = File::new(file.source.again(), "it".into(), memory_bytes)?;
        return assemble(&grid, Some((&solution, is_functions(file.path))), progress);
    }
    let grid = File::new(file.source.again(), "it".into(), memory_bytes)?;
    let path = match &file.options.solution {
        SolutionFile::At(path) => Some(path.clone()),
        which => {
            let all = partners(file.path);
            let found = all.iter().find(|path| path.is_file()).cloned();
            if found.is_none() && *which == SolutionFile::Beside {
                grid_header(&grid)?; // what is no grid has no solution either
                return Err(Plot3dError::NoSolution { looked_for: in_words(&all) });
            }
            found
        }
    };
    let Some(path) = path else { return assemble(&grid, None, progress) };
    let (opened, len) = open(&path, "its solution")?;
    let solution = File::new(Source::File(&opened, len), format!("its solution {}", shown(&path)), memory_bytes)?;
    assemble(&grid, Some((&solution, is_functions(&path))), progress)
}

fn open(path: &Path, role: &str) -> Result<(std::fs::File, u64), Plot3dError> {
    let failed = |reason| Plot3dError::Partner { place: format!("{role} {}", path.display()), reason };
    let file = std::fs::File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_file() { Ok((file, metadata.len())) } else { Err(failed(io::Error::other("not a regular file"))) }
}

fn shown(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn in_words(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| shown(path)).collect::<Vec<_>>().join(", ")
}

fn parts_of(path: &Path) -> (String, String) {
    let text = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
    (text(path.file_stem()), text(path.extension()))
}

fn is_functions(path: &Path) -> bool {
    let (stem, suffix) = parts_of(path);
    suffix.eq_ignore_ascii_case("f") || (!suffix.eq_ignore_ascii_case("q") && stem.ends_with(['f', 'F']))
}

/// Where the solution of a grid is looked for, in this order: `wing.x`, `wing.xyz` and the like have theirs in `wing.q` or `wing.f`; `wingxyz.bin`,
/// `wingx.bin` and `winggrid.bin` in `wingq.bin`, and `wing.bin` in `wing.q`.
pub(super) fn partners(grid: &Path) -> Vec<PathBuf> {
    let (stem, suffix) = parts_of(grid);
    let mut all = Vec::new();
    for (end, others) in STEMS {
        if let Some(begin) = stem.strip_suffix(end) {
            all.extend(others.iter().map(|other| grid.with_file_name(format!("{begin}{other}.{suffix}"))));
            break;
        }
    }
    all.extend(SOLUTIONS.map(|suffix| grid.with_extension(suffix)));
    // Names in capitals have capital partners.
    if suffix.chars().any(|c| c.is_ascii_uppercase()) {
        all.extend(SOLUTIONS.map(|suffix| grid.with_extension(suffix.to_uppercase())));
    }
    all
}

/// The grid of a file that its name says to be a solution; `None` if it may be a grid itself.
fn grid_of(path: &Path) -> Result<Option<PathBuf>, Plot3dError> {
    let (stem, suffix) = parts_of(path);
    let is_solution = SOLUTIONS.contains(&suffix.to_lowercase().as_str());
    let mut all: Vec<PathBuf> = if is_solution { GRIDS.iter().map(|&suffix| path.with_extension(suffix)).collect() } else { vec![] };
    if is_solution {
        all.push(path.with_extension("bin"));
    }
    for (end, others) in STEMS {
        for begin in others.iter().filter_map(|other| stem.strip_suffix(other)) {
            all.push(path.with_file_name(format!("{begin}{end}.{suffix}")));
        }
    }
    let found = all.iter().find(|path| path.is_file()).cloned();
    if is_solution && found.is_none() {
        return Err(Plot3dError::NoGrid { looked_for: in_words(&all) });
    }
    Ok(found)
}

/// The mesh of a grid, with the arrays of a solution.
fn assemble(grid: &File<'_>, solution: Option<(&File<'_>, bool)>, progress: &Progress) -> Result<MeshParts, Plot3dError> {
    let header = grid_header(grid)?;
    if !header.blocks.iter().any(|dims| dims.iter().all(|&n| n >= 2)) {
        return Err(Plot3dError::Flat(header.shape_in_words(true)));
    }
    let solution =
        solution.map(|(file, prefers_functions)| Ok::<_, Plot3dError>((file, solution_header(file, &header, prefers_functions)?)));
    let solution = solution.transpose()?;
    let (blocks, points) = read_grid(grid, &header, progress)?;
    let point_data = solution.map(|(file, header)| read_solution(file, &header, progress)).transpose()?.unwrap_or_default();
    let active = point_data.first().map(|array| array.name.clone());
    Ok(split_into_tets(&blocks, points, point_data, vec![], active)?)
}

fn read_grid(file: &File<'_>, header: &Header, progress: &Progress) -> Result<(Vec<StructuredBlock>, Vec<DVec3>), Plot3dError> {
    let mut reader = Reader::new(file, header, progress);
    let (mut blocks, mut points) = (Vec::new(), Vec::new());
    for dims in &header.blocks {
        let mut block = StructuredBlock::new(dims.map(|n| n as usize));
        let count = block.points();
        let integers = if header.layout.has_blanks { count } else { 0 };
        reader.begin_record(3 * count, integers)?;
        let [x, y, z] = [reader.floats(count)?, reader.floats(count)?, reader.floats(count)?];
        points.extend((0..count).map(|i| DVec3::new(x.get(i), y.get(i), z.get(i))));
        if header.layout.has_blanks {
            block.blanked = reader.integers(count)?.into_iter().map(|n| n == 0).collect();
        }
        reader.end_record()?;
        blocks.push(block);
    }
    Ok((blocks, points))
}

fn read_solution(file: &File<'_>, header: &Header, progress: &Progress) -> Result<Vec<DataArray>, Plot3dError> {
    let mut reader = Reader::new(file, header, progress);
    let most = header.functions.iter().copied().max().unwrap_or(0) as usize;
    let names = match header.kind {
        Kind::Functions => (0..most).map(|n| (format!("Function{n}"), 1)).collect(),
        _ => vec![("Density".to_owned(), 1), ("Momentum".to_owned(), 3), ("StagnationEnergy".to_owned(), 1)],
    };
    let mut all: Vec<Vec<Values>> = vec![vec![]; names.len()];
    for (b, dims) in header.blocks.iter().enumerate() {
        let count = dims.iter().product::<u64>() as usize;
        if header.kind == Kind::Solution {
            reader.begin_record(4, 0)?;
            reader.floats(4)?; // Mach number, angle of attack, Reynolds number, time
            reader.end_record()?;
        }
        let present = header.functions.get(b).map_or(names.len(), |&n| n as usize);
        reader.begin_record(count * header.functions.get(b).map_or(5, |&n| n as usize), 0)?;
        for (i, &(_, components)) in names.iter().enumerate() {
            let parts = if i < present {
                (0..components).map(|_| reader.floats(count)).collect::<Result<Vec<_>, _>>()?
            } else {
                vec![Values::F32(vec![f32::NAN; count])]
            };
            all[i].push(side_by_side(parts));
        }
        reader.end_record()?;
    }
    let array = |((name, components), parts)| DataArray { name, components, values: joined(parts) };
    Ok(names.into_iter().zip(all).map(array).collect())
}

/// Components that came one behind the other, tuple by tuple.
fn side_by_side(mut parts: Vec<Values>) -> Values {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    let tuples = 0..parts.first().map_or(0, Values::len);
    if parts.iter().all(|part| matches!(part, Values::F32(_))) {
        Values::F32(tuples.flat_map(|i| parts.iter().map(move |part| part.get(i) as f32)).collect())
    } else {
        Values::F64(tuples.flat_map(|i| parts.iter().map(move |part| part.get(i))).collect())
    }
}

/// The values of several blocks, one behind the other.
fn joined(mut parts: Vec<Values>) -> Values {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    if parts.iter().all(|part| matches!(part, Values::F32(_))) {
        Values::F32(parts.iter().flat_map(|part| (0..part.len()).map(|i| part.get(i) as f32)).collect())
    } else {
        Values::F64(parts.iter().flat_map(|part| (0..part.len()).map(|i| part.get(i))).collect())
    }
}
