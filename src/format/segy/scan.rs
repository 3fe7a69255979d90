//! The headers of all traces: which line numbers they have, and which trace lies at which position.

use super::SegyOptions;
use super::error::SegyError;
use super::input::Input;
use super::layout::{Fields, Layout, TRACE_HEADER};
use crate::progress::Progress;
use rayon::prelude::*;
use std::fmt;

/// Traces whose headers one task reads.
const PART: u32 = 4096;
/// Bytes that one read takes at most.
const BLOCK: u64 = 1 << 20;
/// Traces of at most so many bytes are read whole for their headers: a disk gives what is between as fast as it skips it.
const SKIPPED: u64 = 16 << 10;
/// Positions for each trace that a survey may have: with their 4 bytes each they take no more memory than the headers on disk.
const SPARSEST: u64 = TRACE_HEADER / 4;
/// The same for line numbers at bytes that nobody named and that the standard has not.
const SPARSEST_GUESS: u64 = 4;
/// Stands for the line numbers of a trace that is left out.
const LEFT_OUT: [i32; 2] = [i32::MIN; 2];
/// Trace identification codes of dead traces and of dummies.
const NO_DATA: [i16; 2] = [2, 3];

/// Where a trace's header has its line numbers, counted from byte 1; 4 bytes each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineBytes {
    /// Byte of the inline number.
    pub inline: u32,
    /// Byte of the crossline number.
    pub crossline: u32,
}

impl LineBytes {
    /// As revision 1 of the standard has them.
    pub const STANDARD: LineBytes = LineBytes { inline: 189, crossline: 193 };
    /// Where else they are found: the numbers of field record, trace in line and ensemble.
    const OTHERS: [LineBytes; 2] = [LineBytes { inline: 9, crossline: 21 }, LineBytes { inline: 5, crossline: 21 }];
}

impl fmt::Display for LineBytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} and {}", self.inline, self.crossline)
    }
}

/// Smallest and largest number, and the first traces (from 0) that have them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Extent {
    least: (i32, u32),
    most: (i32, u32),
}

impl Extent {
    const NONE: Extent = Extent { least: (i32::MAX, 0), most: (i32::MIN, 0) };

    fn add(&mut self, value: i32, trace: u32) {
        if value < self.least.0 {
            self.least = (value, trace);
        }
        if value > self.most.0 {
            self.most = (value, trace);
        }
    }

    fn join(&mut self, later: Extent) {
        self.add(later.least.0, later.least.1);
        self.add(later.most.0, later.most.1);
    }

    fn is_one(&self) -> bool {
        self.least.0 == self.most.0
    }

    fn write(&self, f: &mut fmt::Formatter<'_>, what: &str, byte: u32) -> fmt::Result {
        let ((least, at_least), (most, at_most)) = (self.least, self.most);
        match (self.is_one(), f.alternate()) {
            (true, _) => write!(f, "{what} {least} (byte {byte})"),
            (false, false) => write!(f, "{what}s {least} to {most} (byte {byte})"),
            (false, true) => {
                write!(f, "{what}s {least} to {most} (byte {byte}, traces {} and {})", u64::from(at_least) + 1, u64::from(at_most) + 1)
            }
        }
    }
}

/// The line numbers of a file, in words; the alternate form names the traces with the smallest and the largest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lines {
    bytes: LineBytes,
    inlines: Extent,
    crosslines: Extent,
}

impl fmt::Display for Lines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inlines.write(f, "inline", self.bytes.inline)?;
        f.write_str(" and ")?;
        self.crosslines.write(f, "crossline", self.bytes.crossline)
    }
}

/// Line numbers along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LineAxis {
    pub first: i32,
    pub step: u32,
    pub count: u32,
}

impl LineAxis {
    fn index(&self, line: i32) -> usize {
        (line.abs_diff(self.first) / self.step) as usize
    }
}

/// Which trace lies where.
#[derive(Debug, PartialEq)]
pub(super) struct Survey {
    pub lines: Lines,
    pub inlines: LineAxis,
    pub crosslines: LineAxis,
    /// The number of the trace at each position, from 1, crossline fastest; 0: none.
    pub index: Vec<u32>,
    /// Positions without a trace.
    pub missing: u64,
    /// Dead traces and dummies.
    pub dead: u64,
    /// Traces at a position that another has.
    pub repeated: u64,
    /// Traces with another offset than was asked for.
    pub other_offset: u64,
    /// Smallest and largest offset.
    pub offsets: [i32; 2],
    /// Smallest and largest delay until the first sample, milliseconds as they are stored.
    pub delays: [i32; 2],
}

impl Survey {
    pub fn bytes(&self) -> LineBytes {
        self.lines.bytes
    }
}

/// What a part of the traces has.
struct Part {
    lines: Vec<[i32; 2]>,
    inlines: Extent,
    crosslines: Extent,
    offsets: Extent,
    delays: Extent,
    dead: u64,
    other_offset: u64,
}

impl Part {
    const NONE: Part = Part {
        lines: vec![],
        inlines: Extent::NONE,
        crosslines: Extent::NONE,
        offsets: Extent::NONE,
        delays: Extent::NONE,
        dead: 0,
        other_offset: 0,
    };

    fn join(&mut self, later: &Part) {
        self.inlines.join(later.inlines);
        self.crosslines.join(later.crosslines);
        self.offsets.join(later.offsets);
        self.delays.join(later.delays);
        self.dead += later.dead;
        self.other_offset += later.other_offset;
    }

    fn add(&mut self, trace: u32, header: Fields<'_>, bytes: LineBytes, offset: Option<i32>) {
        if is_dead(header) {
            self.dead += 1;
            return self.lines.push(LEFT_OUT);
        }
        let own_offset = header.i32(37);
        self.offsets.add(own_offset, trace);
        if offset.is_some_and(|offset| offset != own_offset) {
            self.other_offset += 1;
            return self.lines.push(LEFT_OUT);
        }
        let [inline, crossline] = lines_of(header, bytes);
        self.inlines.add(inline, trace);
        self.crosslines.add(crossline, trace);
        self.delays.add(header.i16(109).into(), trace);
        self.lines.push([inline, crossline]);
    }
}

pub(super) fn is_dead(header: Fields<'_>) -> bool {
    NO_DATA.contains(&header.i16(29))
}

fn lines_of(header: Fields<'_>, bytes: LineBytes) -> [i32; 2] {
    [bytes.inline, bytes.crossline].map(|byte| header.i32(byte as usize))
}

/// Visits the headers of traces `from..to`.
fn visit(input: &Input, layout: &Layout, from: u32, to: u32, mut each: impl FnMut(u32, Fields<'_>)) -> Result<(), SegyError> {
    let stride = layout.stride;
    let together = if stride <= SKIPPED { (BLOCK / stride).clamp(1, PART.into()) as u32 } else { 1 };
    let mut block = Vec::new();
    let mut trace = from;
    while trace < to {
        let count = together.min(to - trace);
        block.resize((u64::from(count - 1) * stride + TRACE_HEADER) as usize, 0);
        input.read_at(layout.first + u64::from(trace) * stride, &mut block)?;
        for (n, bytes) in block.chunks(stride as usize).enumerate() {
            each(trace + n as u32, Fields { bytes, is_little: layout.is_little });
        }
        trace += count;
    }
    Ok(())
}

/// Finds the survey of a file: by the bytes that the options name, else by those of the standard, else by others that are in use.
pub(super) fn survey(input: &Input, layout: &Layout, options: &SegyOptions, progress: &Progress) -> Result<Survey, SegyError> {
    let standard = LineBytes::STANDARD;
    if options.iline_byte.is_some() || options.xline_byte.is_some() {
        let bytes = LineBytes {
            inline: options.iline_byte.unwrap_or(standard.inline),
            crossline: options.xline_byte.unwrap_or(standard.crossline),
        };
        if [bytes.inline, bytes.crossline].iter().any(|byte| !(1..=TRACE_HEADER as u32 - 3).contains(byte)) {
            return Err(SegyError::Place(bytes));
        }
        return survey_by(input, layout, options, bytes, SPARSEST, progress);
    }
    let of_standard = survey_by(input, layout, options, standard, SPARSEST, progress);
    let Err(SegyError::NoGrid { .. } | SegyError::OneLine { .. } | SegyError::Scattered { .. }) = of_standard else { return of_standard };
    for bytes in LineBytes::OTHERS {
        if is_likely(input, layout, bytes)? {
            let found = survey_by(input, layout, options, bytes, SPARSEST_GUESS, progress);
            if found.is_ok() {
                return found;
            }
            progress.check()?;
        }
    }
    of_standard
}

/// Whether numbers at these bytes look like those of a survey's lines: from most traces to the next one of them stays.
fn is_likely(input: &Input, layout: &Layout, bytes: LineBytes) -> Result<bool, SegyError> {
    let (mut pairs, mut both) = (0, 0);
    let run = 64.min(layout.traces);
    let runs = (layout.traces / run).min(64);
    for n in 0..runs {
        let from = (u64::from(n) * u64::from(layout.traces - run) / u64::from(runs)) as u32;
        let mut last = None;
        visit(input, layout, from, from + run, |_, header| {
            let lines = lines_of(header, bytes);
            if let Some([inline, crossline]) = last.replace(lines) {
                pairs += 1;
                both += u32::from(inline != lines[0] && crossline != lines[1]);
            }
        })?;
    }
    Ok(both * 2 <= pairs)
}

fn survey_by(
    input: &Input,
    layout: &Layout,
    options: &SegyOptions,
    bytes: LineBytes,
    sparsest: u64,
    progress: &Progress,
) -> Result<Survey, SegyError> {
    let traces = u64::from(layout.traces);
    progress.begin("reading trace headers", traces);
    let read_part = |part: u32| {
        progress.check()?;
        let (from, to) = (part * PART, (part + 1).saturating_mul(PART).min(layout.traces));
        let mut found = Part { lines: Vec::with_capacity((to - from) as usize), ..Part::NONE };
        visit(input, layout, from, to, |trace, header| found.add(trace, header, bytes, options.offset))?;
        progress.add(u64::from(to - from));
        Ok(found)
    };
    let parts: Vec<Part> = (0..layout.traces.div_ceil(PART)).into_par_iter().map(read_part).collect::<Result<_, SegyError>>()?;
    let mut all = Part::NONE;
    parts.iter().for_each(|part| all.join(part));
    let offsets = [all.offsets.least.0, all.offsets.most.0];
    match options.offset {
        _ if all.dead == traces => return Err(SegyError::AllDead(traces)),
        Some(wanted) if all.dead + all.other_offset == traces => return Err(SegyError::NoOffset { wanted, found: offsets }),
        _ => {}
    }
    let lines = Lines { bytes, inlines: all.inlines, crosslines: all.crosslines };
    match (all.inlines.is_one(), all.crosslines.is_one()) {
        (false, false) => {}
        (true, true) => return Err(SegyError::NoGrid { traces, lines }),
        _ => return Err(SegyError::OneLine { traces, lines }),
    }
    let shown = || parts.iter().flat_map(|part| &part.lines).filter(|&&lines| lines != LEFT_OUT);
    let axis = |of: usize, extent: Extent| {
        let (first, last) = (extent.least.0, extent.most.0);
        let step = shown().fold(0, |step, lines| gcd(lines[of].abs_diff(first), step)).max(1);
        (LineAxis { first, step, count: 0 }, u64::from(last.abs_diff(first) / step) + 1)
    };
    let ((mut inlines, rows), (mut crosslines, columns)) = (axis(0, all.inlines), axis(1, all.crosslines));
    let positions = rows.checked_mul(columns).filter(|&positions| positions <= traces * sparsest);
    let (Some(positions), Ok(row_count), Ok(column_count)) = (positions, u32::try_from(rows), u32::try_from(columns)) else {
        return Err(SegyError::Scattered { traces, lines, positions: [rows, columns] });
    };
    (inlines.count, crosslines.count) = (row_count, column_count);
    let mut index = Vec::new();
    let memory = |_| SegyError::Memory { need: 4 * positions, what: "the places of its traces" };
    index.try_reserve_exact(positions as usize).map_err(memory)?;
    index.resize(positions as usize, 0u32);
    let (mut placed, mut repeated) = (0u64, 0u64);
    for (trace, lines) in (1u32..).zip(parts.iter().flat_map(|part| &part.lines)) {
        if *lines != LEFT_OUT {
            let place = &mut index[inlines.index(lines[0]) * column_count as usize + crosslines.index(lines[1])];
            if *place == 0 {
                (*place, placed) = (trace, placed + 1);
            } else {
                repeated += 1;
            }
        }
    }
    Ok(Survey {
        lines,
        inlines,
        crosslines,
        index,
        missing: positions - placed,
        dead: all.dead,
        repeated,
        other_offset: all.other_offset,
        offsets,
        delays: [all.delays.least.0, all.delays.most.0],
    })
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
