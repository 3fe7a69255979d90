//! STL, text and binary (3D Systems, "StereoLithography Interface Specification", 1989; <https://www.fabbers.com/tech/STL_Format>).
//!
//! Triangles have their corners by coordinates: points that are equal to the last bit become one (0 and -0 are equal). A file is binary if
//! its length is what the count at byte 80 says, whatever it begins with, for many binary files begin with `solid`. Normals are not kept,
//! since they follow from the corners; nor are the two bytes of attributes. Several solids of a text are told apart by a cell array `solid`.

use crate::format::GridFile;
use crate::format::parse::{Binary, ParseError, Words, all_of};
use crate::format::vtu::number::ByteOrder;
use crate::mesh::{CellType, Cells, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use glam::DVec3;
use rayon::prelude::*;

/// Bytes before the triangles of a binary file, and of each triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Whether a file begins as a text does; binary ones are told by their suffix.
pub fn recognizes(start: &[u8]) -> bool {
    let mut words = Words::new(start);
    let is = |word: Option<&[u8]>, what: &str| word.is_some_and(|word| word.eq_ignore_ascii_case(what.as_bytes()));
    is(words.next(), "solid") && words.rest_of_line().is_some() && (is(words.peek(), "facet") || is(words.peek(), "endsolid"))
}

/// Reads an STL file.
pub fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let count = bytes.get(80..HEADER).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize);
    let end = count.and_then(|count| count.checked_mul(TRIANGLE)?.checked_add(HEADER));
    let is_text = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if end != Some(bytes.len()) && is_text {
        return text(&bytes, progress);
    }
    let (Some(count), Some(end)) = (count, end) else {
        return Err(ParseError::invalid("the header", format!("{} bytes in all", bytes.len()), "an STL file, of at least 84 bytes"));
    };
    if end > bytes.len() {
        let found = format!("{count} triangles, which would end at byte {end}");
        return Err(ParseError::invalid("byte 80", found, format!("no more than the file's {} bytes have room for", bytes.len())));
    }
    let mut grid = binary(&bytes[HEADER..end], progress)?;
    if end < bytes.len() {
        grid.notes.push(format!("{} bytes behind the last triangle were left out", bytes.len() - end));
    }
    Ok(grid)
}

fn binary(bytes: &[u8], progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let mut corners = Vec::with_capacity(bytes.len() / TRIANGLE * 3);
    let mut attributes = 0u64;
    for (i, triangle) in bytes.chunks_exact(TRIANGLE).enumerate() {
        if i % 4096 == 0 {
            progress.check()?;
            progress.add(4096 * TRIANGLE as u64);
        }
        let mut numbers = Binary::new(triangle, 12, ByteOrder::Little);
        for _ in 0..3 {
            let point = numbers.numbers::<f32>(3, "a corner")?;
            corners.push(DVec3::new(f64::from(point[0]), f64::from(point[1]), f64::from(point[2])));
        }
        attributes += u64::from(numbers.number::<u16>("attributes")? != 0);
    }
    let mut grid = merged(&corners)?;
    if attributes > 0 {
        grid.notes.push(format!("the attributes (colours) of {attributes} triangles were left out"));
    }
    Ok(grid)
}

fn text(bytes: &[u8], progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let mut words = Words::new(bytes);
    let (mut corners, mut solids, mut solid, mut seen) = (Vec::new(), Vec::new(), 0u32, 0);
    expect(&mut words, "solid")?;
    words.rest_of_line();
    loop {
        let word = words.word("facet or endsolid")?;
        if word.eq_ignore_ascii_case(b"endsolid") {
            words.rest_of_line();
            if words.peek().is_none() {
                break;
            }
            expect(&mut words, "solid")?;
            words.rest_of_line();
            solid += 1;
            continue;
        }
        if !word.eq_ignore_ascii_case(b"facet") {
            return Err(words.bad(word, "facet or endsolid"));
        }
        expect(&mut words, "normal")?;
        for _ in 0..3 {
            words.word("a component of the normal")?;
        }
        expect(&mut words, "outer")?;
        expect(&mut words, "loop")?;
        for _ in 0..3 {
            expect(&mut words, "vertex")?;
            let coordinate = "a coordinate";
            corners.push(DVec3::new(words.real(coordinate)?, words.real(coordinate)?, words.real(coordinate)?));
        }
        expect(&mut words, "endloop")?;
        expect(&mut words, "endfacet")?;
        solids.push(solid as f32);
        if solids.len() % 4096 == 0 {
            progress.check()?;
            progress.add((words.at() - seen) as u64);
            seen = words.at();
        }
    }
    let mut grid = merged(&corners)?;
    if solid > 0 {
        grid.cell_data.push(DataArray { name: "solid".into(), components: 1, values: Values::F32(solids) });
    }
    Ok(grid)
}

fn expect(words: &mut Words<'_>, what: &str) -> Result<(), ParseError> {
    let word = words.word(what)?;
    if word.eq_ignore_ascii_case(what.as_bytes()) { Ok(()) } else { Err(words.bad(word, what)) }
}

/// Triangles by three corners each, equal ones made one, in the order in which they come first.
fn merged(corners: &[DVec3]) -> Result<UnstructuredGrid, ParseError> {
    if u32::try_from(corners.len()).is_err() {
        return Err(ParseError::Unsupported(format!("it has {} triangles, more than octetra can index", corners.len() / 3)));
    }
    // Adding 0 turns -0 into 0.
    let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<([u64; 3], u32)> = corners.par_iter().enumerate().map(|(i, &p)| (key(p), i as u32)).collect();
    order.par_sort_unstable();
    let mut first = vec![0u32; corners.len()];
    for run in order.chunk_by(|a, b| a.0 == b.0) {
        run.iter().for_each(|&(_, i)| first[i as usize] = run[0].1);
    }
    let mut points = Vec::new();
    let mut ids = vec![0u32; corners.len()];
    for (i, &p) in corners.iter().enumerate() {
        ids[i] = if first[i] as usize == i { points.len() as u32 } else { ids[first[i] as usize] };
        if first[i] as usize == i {
            points.push(p);
        }
    }
    let mut cells = Cells::with_capacity(ids.len() / 3, ids.len());
    for triangle in ids.chunks_exact(3) {
        cells.push(CellType::TRIANGLE, triangle)?;
    }
    Ok(UnstructuredGrid { points, cells, ..UnstructuredGrid::default() })
}
