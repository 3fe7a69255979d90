//! Blocks of elements, polygons and polyhedra too.

use super::cells::element;
use super::netcdf::{NetCdf, place};
use crate::format::ParseError;
use crate::mesh::{CellType, Cells, UnstructuredGrid};
use std::ops::Range;

/// A block whose elements are cells of the grid.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Its place in the file, from 1, which its variables have in their names.
    pub number: usize,
    /// The number that the file gives it.
    pub id: i64,
    /// The first of its elements among all of the file, from 0.
    pub first: usize,
    /// Its cells.
    pub cells: Range<usize>,
}

/// The cells of all blocks go to the grid.
pub(super) fn read_blocks(file: &NetCdf<'_>, grid: &mut UnstructuredGrid) -> Result<Vec<Block>, ParseError> {
    let ids = file.all_flat("eb_prop1")?.map(|ids| ids.integers(&place("eb_prop1"))).transpose()?;
    let ids = ids.unwrap_or_else(|| (1..=file.dimension("num_el_blk").min(file.names().count()) as i64).collect());
    let (mut blocks, mut first, mut unknown) = (Vec::new(), 0usize, Vec::new());
    for (i, id) in ids.into_iter().enumerate() {
        let number = i + 1;
        let Some(connect) = file.variable(&format!("connect{number}")) else {
            first = first.saturating_add(file.dimension(&format!("num_el_in_blk{number}")));
            continue;
        };
        let name = file.text_of(connect, "elem_type");
        let start = grid.cells.len();
        let elements = match name.to_ascii_uppercase().as_str() {
            "NSIDED" => polygons(file, number, &mut grid.cells)?,
            "NFACED" => polyhedra(file, number, &mut grid.cells)?,
            _ => known(file, number, &name, &mut grid.cells)?,
        };
        grid.notes.extend(elements.note.filter(|note| !grid.notes.contains(note)));
        if let Some(what) = elements.left_out {
            unknown.push(what);
        }
        if grid.cells.len() > start {
            blocks.push(Block { number, id, first, cells: start..grid.cells.len() });
        }
        first = first.saturating_add(elements.count);
    }
    if blocks.is_empty() && !unknown.is_empty() {
        return Err(ParseError::Unsupported(format!("has only elements that octetra has no cells for: {}", unknown.join(", "))));
    }
    if !unknown.is_empty() || blocks.last().is_some_and(|last| last.first != last.cells.start) {
        let places = blocks.iter().flat_map(|block| (0..block.cells.len()).map(|i| block.first.saturating_add(i)));
        grid.numbers = places.map(|place| u32::try_from(place).unwrap_or(u32::MAX)).collect();
    }
    grid.notes.extend(unknown.into_iter().map(|what| format!("{what} were left out: octetra has no cells for them")));
    Ok(blocks)
}

/// How many elements a block has, and what they are if they are no cells.
struct Elements {
    count: usize,
    left_out: Option<String>,
    /// A sentence about nodes that are left out of its cells.
    note: Option<String>,
}

/// Elements of one type.
fn known(file: &NetCdf<'_>, number: usize, name: &str, cells: &mut Cells) -> Result<Elements, ParseError> {
    let variable = format!("connect{number}");
    let shape: Vec<usize> = file.variable(&variable).map(|v| v.shape()).unwrap_or_default().iter().map(|&n| n as usize).collect();
    let &[count, nodes] = &shape[..] else {
        return Err(ParseError::invalid(place(&variable), format!("shape {shape:?}"), "elements and nodes of each"));
    };
    let Some(element) = element(name, nodes) else {
        let left_out = Some(format!("{count} elements of type \"{name}\" with {nodes} nodes"));
        return Ok(Elements { count, left_out: left_out.filter(|_| count > 0), note: None });
    };
    let Some(numbers) = file.all(&variable, count.saturating_mul(nodes))? else {
        return Ok(Elements { count: 0, left_out: None, note: None });
    };
    let numbers = numbers.points(1, &place(&variable))?;
    let mut points = Vec::with_capacity(element.order.len());
    for corners in numbers.chunks_exact(nodes) {
        points.clear();
        points.extend(element.order.iter().map(|&node| corners[usize::from(node)]));
        cells.push(element.cell_type, &points)?;
    }
    let used = element.order.len();
    let note = format!("elements of type \"{name}\": only {used} of the {nodes} nodes of each are in its cell");
    Ok(Elements { count, left_out: None, note: Some(note).filter(|_| used < nodes && count > 0) })
}

/// Cells of any number of points, or faces: how many each has, and all of them one behind the other.
fn ragged(file: &NetCdf<'_>, counts: &str, connect: &str) -> Result<(Vec<usize>, Vec<u32>), ParseError> {
    let read = |name: &str| {
        let numbers = file.all_flat(name)?;
        numbers.ok_or_else(|| ParseError::invalid("the header", format!("no variable \"{name}\""), format!("one beside \"{connect}\"")))
    };
    let numbers = read(connect)?.points(1, &place(connect))?;
    let counts_of = read(counts)?.counts(&place(counts))?;
    let sum = counts_of.iter().try_fold(0usize, |sum, &n| sum.checked_add(n));
    if sum != Some(numbers.len()) {
        let expected = format!("numbers with the sum {}, as many as \"{connect}\" has", numbers.len());
        return Err(ParseError::invalid(place(counts), "another sum", expected));
    }
    Ok((counts_of, numbers))
}

fn polygons(file: &NetCdf<'_>, number: usize, cells: &mut Cells) -> Result<Elements, ParseError> {
    let (counts, numbers) = ragged(file, &format!("ebepecnt{number}"), &format!("connect{number}"))?;
    let mut rest = &numbers[..];
    for &count in &counts {
        let (points, behind) = rest.split_at(count);
        cells.push(CellType::POLYGON, points)?;
        rest = behind;
    }
    Ok(Elements { count: counts.len(), left_out: None, note: None })
}

/// Polyhedra by the numbers of faces that blocks of faces have.
fn polyhedra(file: &NetCdf<'_>, number: usize, cells: &mut Cells) -> Result<Elements, ParseError> {
    let connect = if file.variable(&format!("facconn{number}")).is_some() { "facconn" } else { "connect" };
    let connect = format!("{connect}{number}");
    let (mut starts, mut corners) = (vec![0usize], Vec::new());
    for block in 1..=file.dimension("num_fa_blk").min(file.names().count()) {
        if file.variable(&format!("fbconn{block}")).is_none() {
            continue;
        }
        let (counts, numbers) = ragged(file, &format!("fbepecnt{block}"), &format!("fbconn{block}"))?;
        let start = corners.len();
        starts.extend(counts.iter().scan(start, |end, &n| {
            *end += n;
            Some(*end)
        }));
        corners.extend(numbers);
    }
    let (counts, faces) = ragged(file, &format!("ebepecnt{number}"), &connect)?;
    let (mut rest, mut stream) = (&faces[..], Vec::new());
    for &count in &counts {
        let (of_cell, behind) = rest.split_at(count);
        rest = behind;
        stream.clear();
        stream.push(count as u32);
        for &face in of_cell {
            let range = starts.get(face as usize).zip(starts.get(face as usize + 1));
            let Some((&start, &end)) = range else {
                let expected = format!("numbers of the {} faces from 1", starts.len() - 1);
                return Err(ParseError::invalid(place(&connect), format!("face {}", u64::from(face) + 1), expected));
            };
            stream.push((end - start) as u32);
            stream.extend_from_slice(&corners[start..end]);
        }
        file.take(stream.len(), &place(&connect))?;
        cells.push(CellType::POLYHEDRON, &stream)?;
    }
    Ok(Elements { count: counts.len(), left_out: None, note: None })
}
