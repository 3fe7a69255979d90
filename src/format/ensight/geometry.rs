//! Parts with their points and cells.

use super::super::parse::ParseError;
use super::input::Input;
use crate::mesh::{CellType, Cells, TooManyCellPoints};
use crate::progress::Progress;
use glam::DVec3;
use std::ops::Range;

/// EnSight's elements with a fixed number of nodes: name, VTK's type, and where each of VTK's nodes is in EnSight's order if it differs.
#[rustfmt::skip]
const ELEMENTS: [(&str, CellType, &[usize]); 15] = [
    ("point", CellType::VERTEX, &[]), ("bar2", CellType::LINE, &[]), ("bar3", CellType::QUADRATIC_EDGE, &[0, 2, 1]),
    ("tria3", CellType::TRIANGLE, &[]), ("tria6", CellType::QUADRATIC_TRIANGLE, &[]),
    ("quad4", CellType::QUAD, &[]), ("quad8", CellType::QUADRATIC_QUAD, &[]),
    ("tetra4", CellType::TETRA, &[]), ("tetra10", CellType::QUADRATIC_TETRA, &[]),
    ("pyramid5", CellType::PYRAMID, &[]), ("pyramid13", CellType::QUADRATIC_PYRAMID, &[]),
    ("penta6", CellType::WEDGE, &[]), ("penta15", CellType::QUADRATIC_WEDGE, &[]),
    ("hexa8", CellType::HEXAHEDRON, &[]), ("hexa20", CellType::QUADRATIC_HEXAHEDRON, &[]),
];

/// A part.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub number: i32,
    pub name: String,
    pub points: Range<usize>,
    /// Its cells by EnSight's name of their type.
    pub blocks: Vec<(String, Range<usize>)>,
    /// How many ghost cells it has of a type: other files' parts have them too, so they are passed over.
    pub ghosts: Vec<(String, usize)>,
}

/// What a file of geometry holds.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub points: Vec<DVec3>,
    pub cells: Cells,
    pub parts: Vec<Part>,
    pub notes: Vec<String>,
}

/// Whether numbers of nodes or elements stand in the file.
fn has_ids(input: &mut Input<'_>, what: &str) -> Result<bool, ParseError> {
    let expected = format!("\"{what} id\" and off, given, assign or ignore");
    let line = input.line(&expected)?;
    match line.strip_prefix(what).and_then(|rest| rest.trim().strip_prefix("id")).map(str::trim) {
        Some("given" | "ignore") => Ok(true),
        Some("off" | "assign") => Ok(false),
        _ => Err(input.bad(line, &expected)),
    }
}

/// Reads a file of geometry.
pub(super) fn read(input: &mut Input<'_>, progress: &Progress) -> Result<Geometry, ParseError> {
    let mut geometry = Geometry::default();
    for _ in 0..2 {
        let line = input.line("a description")?;
        if line.eq_ignore_ascii_case("BEGIN TIME STEP") {
            return Err(ParseError::Unsupported("has all times in one file, which octetra does not read".into()));
        }
    }
    let ids = [has_ids(input, "node")?, has_ids(input, "element")?];
    while let Some(line) = input.keyword()? {
        progress.check()?;
        match line.split_whitespace().next().unwrap_or_default() {
            "extents" => _ = input.reals(6, "the extents", progress)?,
            "part" => {
                let number = input.integers(1, "the number of a part", progress)?[0];
                input.end_line();
                let name = input.line("the name of a part")?.to_owned();
                let at = geometry.points.len();
                geometry.parts.push(Part { number, name, points: at..at, ..Part::default() });
            }
            "coordinates" => geometry.coordinates(input, ids[0], progress)?,
            "block" => {
                return Err(ParseError::Unsupported(format!("{} is a structured block, which octetra does not read", input.place())));
            }
            name => geometry.elements(input, name, ids[1], progress)?,
        }
    }
    Ok(geometry)
}

impl Geometry {
    fn coordinates(&mut self, input: &mut Input<'_>, has_ids: bool, progress: &Progress) -> Result<(), ParseError> {
        let count = input.count(3, "points")?;
        if has_ids {
            input.integers(count, "the number of a node", progress)?;
        }
        let mut axes = || input.reals(count, "a coordinate", progress);
        let (x, y, z) = (axes()?, axes()?, axes()?);
        self.points.extend((0..count).map(|i| DVec3::new(x[i].into(), y[i].into(), z[i].into())));
        u32::try_from(self.points.len()).map_err(|_| TooManyCellPoints)?;
        match self.parts.last_mut() {
            Some(part) if part.points.is_empty() && part.blocks.is_empty() => part.points.end = self.points.len(),
            _ => return Err(input.bad("coordinates", "them once in a part, before its elements")),
        }
        Ok(())
    }

    fn elements(&mut self, input: &mut Input<'_>, name: &str, has_ids: bool, progress: &Progress) -> Result<(), ParseError> {
        let plain = name.strip_prefix("g_").unwrap_or(name);
        let known = ELEMENTS.iter().find(|(element, ..)| *element == plain);
        let fixed = known.and_then(|&(_, cell_type, order)| Some((cell_type, cell_type.points()?, order)));
        if fixed.is_none() && !["nsided", "nfaced"].contains(&plain) {
            return Err(input.bad(name, "part, coordinates or a kind of elements, such as tetra4"));
        }
        let Some(part) = self.parts.last_mut() else { return Err(input.bad(name, "a part before its elements")) };
        let (base, points) = (part.points.start as u32, part.points.len());
        let count = input.count(fixed.map_or(2, |(_, corners, _)| corners), "elements")?;
        if has_ids {
            input.integers(count, "the number of an element", progress)?;
        }
        let first = self.cells.len();
        let mut cells = Cells::default();
        let kept = if name == plain { &mut self.cells } else { &mut cells };
        let own = |input: &mut Input<'_>, numbers: Vec<i32>| -> Result<Vec<u32>, ParseError> {
            let point = |number: i32| {
                let index = usize::try_from(number).ok().filter(|number| (1..=points).contains(number));
                index
                    .map(|index| base + index as u32 - 1)
                    .ok_or_else(|| input.bad(&number.to_string(), &format!("a node from 1 to {points}")))
            };
            numbers.into_iter().map(point).collect()
        };
        if let Some((cell_type, corners, order)) = fixed {
            let numbers = input.integers(count * corners, "a node", progress)?;
            let mut ordered = vec![0; corners];
            for cell in own(input, numbers)?.chunks_exact(corners) {
                (0..corners).for_each(|i| ordered[i] = cell[order.get(i).copied().unwrap_or(i)]);
                kept.push(cell_type, &ordered)?;
            }
        } else {
            let sides = sizes(input, count, progress)?;
            let faces = sides.iter().sum::<usize>();
            let rounds = if plain == "nfaced" { sizes(input, faces, progress)? } else { vec![] };
            let numbers = input.integers(if plain == "nfaced" { rounds.iter().sum() } else { faces }, "a node", progress)?;
            let mut rest = &own(input, numbers)?[..];
            let (mut rounds, mut stream) = (rounds.into_iter(), Vec::new());
            for &sides in &sides {
                stream.clear();
                if plain == "nsided" {
                    stream.extend_from_slice(&rest[..sides]);
                    rest = &rest[sides..];
                } else {
                    stream.push(sides as u32);
                    for round in rounds.by_ref().take(sides) {
                        stream.push(round as u32);
                        stream.extend_from_slice(&rest[..round]);
                        rest = &rest[round..];
                    }
                }
                kept.push(if plain == "nsided" { CellType::POLYGON } else { CellType::POLYHEDRON }, &stream)?;
            }
        }
        if name == plain {
            part.blocks.push((name.to_owned(), first..self.cells.len()));
        } else {
            part.ghosts.push((name.to_owned(), count));
            self.notes.push(format!("{count} ghost cells ({name}) were left out"));
        }
        Ok(())
    }
}

/// How many sides or points each of some have, in all no more than the file has room for.
fn sizes(input: &mut Input<'_>, count: usize, progress: &Progress) -> Result<Vec<usize>, ParseError> {
    let room = match &*input {
        Input::Text(words) => words.rest().len(),
        Input::Binary(binary) => binary.rest().len(),
    };
    let numbers = input.integers(count, "how many there are", progress)?;
    let mut left = room;
    let size = |number: i32| {
        let size = usize::try_from(number).ok().filter(|&size| size <= left);
        left -= size.unwrap_or(0);
        size.ok_or_else(|| input.bad(&number.to_string(), "a count that the file has room for"))
    };
    numbers.into_iter().map(size).collect()
}
