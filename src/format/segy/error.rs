//! [`SegyError`].

use super::scan::{LineBytes, Lines};
use crate::progress::Cancelled;
use crate::volume::GridError;
use std::io;

/// Names the flags that tell where line numbers are.
const OTHERS: &str = "--iline-byte and --xline-byte name other bytes";

/// Why a file is no SEG-Y that octetra can show. The texts continue the file's name and a colon.
#[derive(Debug, thiserror::Error)]
pub enum SegyError {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It has no room for headers.
    #[error("has {0} bytes, SEG-Y has 3600 of headers before the first trace")]
    Short(u64),
    /// No known format code, whatever the order of bytes.
    #[error("has format code {big} in bytes 3225-3226 ({little} if little-endian), expected SEG-Y's 1 to 12, 15 or 16")]
    Code {
        /// The code, big-endian.
        big: u16,
        /// The code, little-endian.
        little: u16,
    },
    /// A format that octetra does not read.
    #[error("has samples of format {code}, {name}, which octetra does not read; it reads 1, 2, 3, 5, 6, 7, 8, 10, 11, 15 and 16")]
    Format {
        /// The code.
        code: u16,
        /// What it stands for.
        name: &'static str,
    },
    /// Bytes of a number in an order that is neither of the two.
    #[error("has its bytes swapped in pairs (bytes 3297-3300 are {0:08x}), expected big-endian or little-endian numbers")]
    Pairs(u32),
    /// The count of extended textual headers makes no sense.
    #[error("has {found} extended textual headers by bytes 3505-3506, expected {expected}")]
    TextHeaders {
        /// The count.
        found: i16,
        /// What it should be.
        expected: &'static str,
    },
    /// Nothing follows the headers.
    #[error("has no traces: its headers end at byte {first}, the file at byte {len}")]
    NoTraces {
        /// Where the first trace should begin.
        first: u64,
        /// The file's length.
        len: u64,
    },
    /// Traces without samples.
    #[error(
        "has {binary} samples a trace by its binary header (byte 3221) and {trace} by its first trace's header (byte 115), expected at least 2"
    )]
    Samples {
        /// By the binary header.
        binary: u32,
        /// By the first trace.
        trace: u32,
    },
    /// It ends within a trace.
    #[error(
        "ends after {found} of the {stride} bytes of trace {trace} ({samples} samples of {bytes} bytes and their header): it was cut off, or its traces \
         have another number of samples than its headers say; --truncated reads the whole traces before"
    )]
    Cut {
        /// The number of the trace, from 1.
        trace: u64,
        /// Bytes of it that are there.
        found: u64,
        /// Bytes that it should have.
        stride: u64,
        /// Samples of a trace.
        samples: u32,
        /// Bytes of a sample.
        bytes: u32,
    },
    /// More traces than can be numbered.
    #[error("has {0} traces, more than octetra can number")]
    TooMany(u64),
    /// No trace that has data.
    #[error("has {0} traces, and all are dead or dummies by their headers (byte 29)")]
    AllDead(u64),
    /// No trace with the offset that was asked for.
    #[error("has no trace with offset {wanted}: offsets (byte 37) go from {} to {}", .found[0], .found[1])]
    NoOffset {
        /// The offset asked for.
        wanted: i32,
        /// Smallest and largest there are.
        found: [i32; 2],
    },
    /// Line numbers that do not differ.
    #[error("has no 3-D geometry: its {traces} traces have {lines}; expected at least 2 inlines and 2 crosslines; {OTHERS}")]
    NoGrid {
        /// Traces.
        traces: u64,
        /// The lines found.
        lines: Lines,
    },
    /// A 2-D line.
    #[error("is one 2-D line: its {traces} traces have {lines}; expected a 3-D survey of at least 2 inlines and 2 crosslines; {OTHERS}")]
    OneLine {
        /// Traces.
        traces: u64,
        /// The lines found.
        lines: Lines,
    },
    /// Far more positions than traces.
    #[error("has {lines:#}: {} x {} positions for {traces} traces, too sparse to be a survey; {OTHERS}", .positions[0], .positions[1])]
    Scattered {
        /// Traces.
        traces: u64,
        /// The lines found.
        lines: Lines,
        /// Inlines and crosslines that a grid would have.
        positions: [u64; 2],
    },
    /// An option names bytes that no header has.
    #[error("cannot have line numbers at bytes {0}: a number of 4 bytes begins at byte 1 to 237 of a trace's header")]
    Place(LineBytes),
    /// An option that is no length.
    #[error("cannot have samples {0} apart, expected a number above 0")]
    Step(f64),
    /// It would take more memory than it may.
    #[error("needs {need} bytes of memory for {what}")]
    Memory {
        /// Bytes.
        need: u64,
        /// For what.
        what: &'static str,
    },
    /// What it holds is no volume.
    #[error("the volume {0}")]
    Grid(#[from] GridError),
}
