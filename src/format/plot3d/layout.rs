//! What a PLOT3D file is made of, told by its first numbers and its length: nothing in it says so.

use super::super::vtu::number::ByteOrder;
use super::{File, Plot3dError};

/// No file has more points along an axis than this; larger numbers are those of another layout.
const LONGEST: u64 = 1 << 24;

/// No file has more blocks than this.
const MOST_BLOCKS: i64 = 1 << 16;

/// Which of the three kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Coordinates, and a number a point that says whether it counts.
    Grid,
    /// Density, momentum and energy.
    Solution,
    /// Functions of the writer's own, as many as the file says.
    Functions,
}

impl Kind {
    /// Integers of a block in the header.
    fn numbers(self) -> usize {
        if self == Kind::Functions { 4 } else { 3 }
    }
}

/// How the numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Which byte of a number comes first; of text it means nothing.
    pub order: ByteOrder,
    /// Whether floats have 8 bytes; of text it means nothing.
    pub is_double: bool,
    /// Whether Fortran's record marks stand around what was written at once.
    pub has_records: bool,
    /// Whether the number of blocks comes first.
    pub is_multi: bool,
    /// Whether the coordinates of a block are followed by a number a point that says whether it counts.
    pub has_blanks: bool,
}

/// Points along the three axes of a block.
pub(super) type Dims = [u64; 3];

/// The header of a file in one of its possible layouts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub kind: Kind,
    pub layout: Layout,
    pub blocks: Vec<Dims>,
    /// How many functions each block has.
    pub functions: Vec<u64>,
    /// Where the first block's numbers begin: bytes, or numbers of text.
    pub start: u64,
    /// How long the file should be: bytes, or numbers of text. More than any file where it cannot be counted.
    pub expected: u128,
}

impl Header {
    /// Points in all.
    pub fn points(&self) -> u128 {
        self.blocks.iter().map(points).sum()
    }

    /// The layout in words, as it matters to `expected`.
    fn in_words(&self, is_text: bool) -> String {
        let blank = if self.layout.has_blanks { " with iblank" } else { "" };
        match (is_text, self.layout.is_double) {
            (true, _) => format!("{}{blank}", self.expected),
            (false, double) => format!("{} as {}{blank}", self.expected, if double { "f64" } else { "f32" }),
        }
    }

    /// What the blocks are, the byte order and the record marks in words.
    pub fn shape_in_words(&self, is_text: bool) -> String {
        let blocks = match &self.blocks[..] {
            [[x, y, z]] => format!("{x} x {y} x {z} points"),
            all => format!("{} blocks of {} points in all", all.len(), self.points()),
        };
        let order = if self.layout.order == ByteOrder::Big { "big-endian" } else { "little-endian" };
        let records = if self.layout.has_records { ", in Fortran records" } else { "" };
        if is_text { blocks } else { format!("{blocks}, {order}{records}") }
    }
}

/// Points of a block.
fn points(dims: &Dims) -> u128 {
    dims.iter().map(|&n| u128::from(n)).product()
}

/// All headers that the start of a file may be, whatever its length.
pub(super) fn headers(file: &File<'_>, kind: Kind) -> Result<Vec<Header>, Plot3dError> {
    let mut found = Vec::new();
    let both = [false, true];
    let orders = if file.is_text() { &[ByteOrder::Little][..] } else { &[ByteOrder::Big, ByteOrder::Little] };
    for (&order, has_records, is_multi) in orders.iter().flat_map(|order| both.map(|r| both.map(|m| (order, r, m)))).flatten() {
        if file.is_text() && has_records {
            continue;
        }
        let base = Layout { order, is_double: false, has_records, is_multi, has_blanks: false };
        let Some((numbers, start)) = first_numbers(file, kind, base)? else { continue };
        let blocks: Vec<Dims> = numbers.chunks_exact(kind.numbers()).map(|block| [block[0], block[1], block[2]]).collect();
        let functions = if kind == Kind::Functions { numbers.chunks_exact(4).map(|block| block[3]).collect() } else { vec![] };
        for (is_double, has_blanks) in both.into_iter().flat_map(|d| both.map(|b| (d, b))) {
            if (is_double && file.is_text()) || (has_blanks && kind != Kind::Grid) {
                continue;
            }
            let layout = Layout { is_double, has_blanks, ..base };
            let expected = u128::from(start)
                + blocks.iter().enumerate().map(|(b, dims)| size(file, kind, layout, dims, functions.get(b))).sum::<u128>();
            found.push(Header { kind, layout, blocks: blocks.clone(), functions: functions.clone(), start, expected });
        }
    }
    Ok(found)
}

/// How long a block is.
fn size(file: &File<'_>, kind: Kind, layout: Layout, dims: &Dims, functions: Option<&u64>) -> u128 {
    let (n, float) = (points(dims), if layout.is_double { 8 } else { 4 });
    let (floats, integers, records) = match kind {
        Kind::Grid => (3 * n, if layout.has_blanks { n } else { 0 }, 1),
        Kind::Solution => (4 + 5 * n, 0, 2),
        Kind::Functions => (n * u128::from(functions.copied().unwrap_or(0)), 0, 1),
    };
    match file.is_text() {
        true => floats + integers,
        false => floats * float + integers * 4 + if layout.has_records { 8 * records } else { 0 },
    }
}

/// The integers of the blocks and where the data begin, if the start of the file is a header of this layout.
fn first_numbers(file: &File<'_>, kind: Kind, layout: Layout) -> Result<Option<(Vec<u64>, u64)>, Plot3dError> {
    let mut at = 0;
    let mut take = |count: u64| file.integers(layout, &mut at, count);
    let blocks = match layout.is_multi {
        false => 1,
        true => match take(1)?.as_deref() {
            Some(&[n]) if (1..=MOST_BLOCKS).contains(&n) => n as u64,
            _ => return Ok(None),
        },
    };
    let Some(numbers) = take(blocks * kind.numbers() as u64)? else { return Ok(None) };
    let numbers: Option<Vec<u64>> = numbers.iter().map(|&n| u64::try_from(n).ok().filter(|&n| (1..LONGEST).contains(&n))).collect();
    Ok(numbers.map(|numbers| (numbers, at)))
}

/// The header whose length is the file's. Where record marks are as they should be, they are no dimensions that happen to fit too: the marks of
/// a number of blocks, 4 and 4, are also a block of 4 x n x 4 points.
pub(super) fn grid_header(file: &File<'_>) -> Result<Header, Plot3dError> {
    let all = headers(file, Kind::Grid)?;
    let mut fitting: Vec<Header> = all.iter().filter(|header| header.expected == u128::from(file.len())).cloned().collect();
    if fitting.iter().any(|header| header.layout.has_records) {
        fitting.retain(|header| header.layout.has_records);
    }
    match fitting.len() {
        1 => Ok(fitting.remove(0)),
        0 => Err(misfit(file, &all)),
        _ => {
            let ways = fitting.iter().map(|h| format!("{} ({})", h.shape_in_words(file.is_text()), h.in_words(file.is_text())));
            Err(Plot3dError::Ambiguous { place: file.place(), ways: ways.collect::<Vec<_>>().join("; ") })
        }
    }
}

/// The header of a solution of this grid: of the grid's blocks, and as long as the file. Bytes behind a solution of the grid's own layout,
/// fewer than one more array would take, do not count.
pub(super) fn solution_header(file: &File<'_>, grid: &Header, prefers_functions: bool) -> Result<Header, Plot3dError> {
    let kinds = if prefers_functions { [Kind::Functions, Kind::Solution] } else { [Kind::Solution, Kind::Functions] };
    let (mut of_grid, mut others) = (Vec::new(), Vec::new());
    for kind in kinds {
        let all = headers(file, kind)?;
        others.extend(all.iter().filter(|header| kind == kinds[0] && is_plausible(header)).cloned());
        of_grid.extend(all.into_iter().filter(|header| header.blocks == grid.blocks));
    }
    let len = u128::from(file.len());
    if let Some(exact) = of_grid.iter().find(|header| header.expected == len) {
        return Ok(exact.clone());
    }
    let as_grid = Layout { has_blanks: false, ..grid.layout };
    let array = |header: &Header| {
        header.points()
            * if file.is_text() {
                1
            } else if header.layout.is_double {
                8
            } else {
                4
            }
    };
    let behind = |header: &&Header| header.layout == as_grid && (header.expected..header.expected + array(header)).contains(&len);
    if let Some(long) = of_grid.iter().find(behind) {
        return Ok(long.clone());
    }
    match (of_grid.is_empty(), others.first()) {
        (true, Some(other)) => {
            Err(Plot3dError::OtherGrid { place: file.place(), found: other.shape_in_words(true), expected: grid.shape_in_words(true) })
        }
        _ => Err(misfit(file, &of_grid)),
    }
}

fn is_plausible(header: &Header) -> bool {
    header.blocks.iter().any(|dims| dims.iter().all(|&n| n >= 2)) && header.expected < 1 << 50
}

/// What the length should be, by the header that comes nearest.
fn misfit(file: &File<'_>, all: &[Header]) -> Plot3dError {
    let is_text = file.is_text();
    let off = |header: &&Header| header.expected.abs_diff(u128::from(file.len()));
    let Some(nearest) = all.iter().filter(|header| is_plausible(header)).min_by_key(off) else {
        return Plot3dError::NoHeader { place: file.place() };
    };
    let alike = |header: &&Header| header.blocks == nearest.blocks && header.layout.order == nearest.layout.order;
    let alike = all.iter().filter(alike).filter(|header| header.layout.has_records == nearest.layout.has_records);
    let mut sizes: Vec<String> = alike.map(|header| header.in_words(is_text)).collect();
    sizes.dedup();
    let last = sizes.pop().unwrap_or_default();
    let sizes = if sizes.is_empty() { last } else { format!("{} or {last}", sizes.join(", ")) };
    Plot3dError::Length {
        place: file.place(),
        found: file.len(),
        unit: if is_text { "numbers" } else { "bytes" },
        expected: sizes,
        why: nearest.shape_in_words(is_text),
    }
}
