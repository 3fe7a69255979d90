//! VTK's parallel XML formats, `.pvtu`, `.pvtp`, `.pvts` and `.pvtr`: a list of files of which each holds pieces. They are put one behind the
//! other, and points at one place become one. Arrays that a piece lacks are left out.

use super::xml::{self, Kind};
use super::{ArrayReader, Reader, Source, VtuError, recognizes_surface, structured};
use crate::format::parse::{ParseError, beside};
use crate::format::{GridFile, open};
use crate::mesh::UnstructuredGrid;
use crate::progress::Progress;
use std::path::Path;

/// Whether a file starts as one of these does.
pub(in crate::format) fn recognizes(start: &[u8]) -> bool {
    ["PUnstructuredGrid", "PPolyData", "PStructuredGrid", "PRectilinearGrid"].iter().any(|name| super::is_of_type(start, name))
}

/// Reads the files that one lists.
pub(in crate::format) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let mut grid: Option<UnstructuredGrid> = None;
    let files = xml::read_parallel(file.source)?;
    for name in &files {
        let path = beside(file, name)?;
        let of_piece = |problem: ParseError| match problem {
            ParseError::Vtk(VtuError::Cancelled(cancelled)) => cancelled.into(),
            problem => ParseError::Other { file: Path::new(name).to_owned(), problem: Box::new(problem) },
        };
        let (opened, len) = open(&path).map_err(|problem| of_piece(ParseError::Unsupported(problem.to_string())))?;
        let piece = read_piece(&Source::File(&opened, len), progress).map_err(|e| of_piece(e.into()))?;
        match &mut grid {
            None => grid = Some(piece),
            Some(grid) => grid.append(piece)?,
        }
    }
    let mut grid = grid.ok_or_else(|| ParseError::invalid("its list of pieces", "none", "the name of a file"))?;
    grid.merges_points |= files.len() > 1;
    Ok(grid)
}

fn read_piece(source: &Source<'_>, progress: &Progress) -> Result<UnstructuredGrid, VtuError> {
    let start = source.read(0, source.len().min(1024) as usize)?;
    if structured::recognizes_structured(&start) {
        return structured::read_cells(source, Kind::StructuredGrid, progress);
    }
    if structured::recognizes_rectilinear(&start) {
        return structured::read_cells(source, Kind::RectilinearGrid, progress);
    }
    let kind = if recognizes_surface(&start) { Kind::PolyData } else { Kind::UnstructuredGrid };
    let head = xml::read_head(source, kind)?;
    progress.begin("reading", source.len());
    let reader = Reader { arrays: ArrayReader { source, head: &head, progress }, head: &head };
    reader.check_counts()?;
    reader.grid()
}
