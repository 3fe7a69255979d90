//! OFF, text (Geomview's Object File Format, <http://www.geomview.org/docs/html/OFF.html>).
//!
//! `OFF` may stand alone or have letters before it that announce more numbers a vertex: `ST`, `C`, `N`. Those, and colours behind a face,
//! are left out with a note. A vertex of plain `OFF` is three numbers wherever they stand; with letters it is a line.

use super::push_face;
use crate::format::GridFile;
use crate::format::parse::{ParseError, Words, all_of};
use crate::mesh::{Cells, UnstructuredGrid};
use crate::progress::Progress;
use glam::DVec3;

/// Whether a file begins as OFF does.
pub fn recognizes(start: &[u8]) -> bool {
    Words::with_comments(start, b'#').next().is_some_and(is_keyword)
}

/// `OFF` with the letters that may stand before it.
fn is_keyword(word: &[u8]) -> bool {
    word.strip_suffix(b"OFF").is_some_and(|letters| {
        let letters = letters.strip_prefix(b"ST").unwrap_or(letters);
        let letters = letters.strip_prefix(b"C").unwrap_or(letters);
        let letters = letters.strip_prefix(b"N").unwrap_or(letters);
        matches!(letters, b"" | b"4" | b"n" | b"4n")
    })
}

/// Reads an OFF file.
pub fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut words = Words::with_comments(&bytes, b'#');
    let mut has_more = false;
    if let Some(word) = words.peek().filter(|word| is_keyword(word) || !word[0].is_ascii_digit()) {
        words.next();
        if !is_keyword(word) {
            return Err(words.bad(word, "OFF"));
        }
        if word.contains(&b'4') || word.contains(&b'n') {
            return Err(ParseError::Unsupported("it has points of four or n dimensions; octetra reads OFF in three".into()));
        }
        has_more = word.len() > 3;
        if words.peek().is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
            return Err(ParseError::Unsupported("it is binary OFF; octetra reads OFF as text".into()));
        }
    }
    let vertices = words.count(6, "count of vertices")?;
    let faces = words.count(4, "count of faces")?;
    words.integer::<u64>("the count of edges")?;
    if u32::try_from(vertices).is_err() {
        return Err(ParseError::Unsupported(format!("it has {vertices} vertices, more than octetra can index")));
    }
    let mut grid = UnstructuredGrid { points: Vec::with_capacity(vertices), ..UnstructuredGrid::default() };
    let mut seen = words.at();
    let mut advance = |i: usize, at: usize| -> Result<(), ParseError> {
        if i.is_multiple_of(4096) {
            progress.check()?;
            progress.add((at - seen) as u64);
            seen = at;
        }
        Ok(())
    };
    for i in 0..vertices {
        advance(i, words.at())?;
        let what = "a coordinate";
        grid.points.push(DVec3::new(words.real(what)?, words.real(what)?, words.real(what)?));
        if has_more {
            words.rest_of_line();
        }
    }
    grid.cells = Cells::with_capacity(faces, 3 * faces);
    let (mut corners, mut colored) = (Vec::new(), 0u64);
    for i in 0..faces {
        advance(i, words.at())?;
        let count = words.count(2, "count of corners")?;
        corners.clear();
        for _ in 0..count {
            corners.push(words.integer::<u32>("the number of a vertex, from 0")?);
        }
        push_face(&mut grid.cells, &corners)?;
        colored += u64::from(words.rest_of_line().is_some_and(|rest| !rest.is_empty()));
    }
    if has_more {
        grid.notes.push("colours, normals or texture coordinates of vertices were left out".into());
    }
    if colored > 0 {
        grid.notes.push(format!("the colours of {colored} faces were left out"));
    }
    Ok(grid)
}
