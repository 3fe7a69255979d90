//! SEG-Y: the volume of a seismic survey, of any size, read trace by trace.
//!
//! A file is headers and traces: a textual header of 3200 bytes, a binary one of 400, perhaps more textual ones, and for each trace a header of
//! 240 bytes and its samples, all as many. Bytes of headers are counted from 1 as the standard does (SEG-Y revisions 0, 1, 2 of 1975, 2002, 2017).
//!
//! * *Samples*: IBM and IEEE floats and integers of 1 to 4 bytes, in either order of bytes, which the format code tells, or the constant of
//!   revision 2. Voxels have the samples' type, see [`SegyVolume`] for what is missing.
//! * *Geometry*: the inline and the crossline number of each trace, at the bytes that [`SegyOptions`] names, else at 189 and 193, else at others
//!   that are in use. Traces may come in any order and with any step between lines. Dead traces and dummies (byte 29 is 2 or 3) and positions that
//!   no trace has are missing. Where several traces have one position (prestack data) the first of the file is taken.
//! * *The grid*: x is the sample, y the crossline, z the inline.
//! * *The world*: x and y are the coordinates of the ensembles (bytes 181 and 185, else 73 and 77, scaled by 71) if these lie on a regular grid,
//!   else the crossline and the inline number. z is the negative of time or depth: a millisecond is a world unit, unless the options say how far
//!   samples are apart, for time and metres have no common measure.

#[cfg(test)]
mod damage_tests;
mod error;
mod input;
mod layout;
#[cfg(test)]
mod layout_tests;
mod place;
mod read;
mod reader;
mod sample;
mod scan;
#[cfg(test)]
mod shared_tests;
#[cfg(test)]
pub(super) mod test_file;
#[cfg(test)]
mod tests;

use crate::progress::Progress;
use crate::volume::{GridFrame, VoxelType};
pub use error::SegyError;
pub(super) use input::Input;
use layout::Layout;
pub use reader::is_segy;
pub(super) use reader::{SUFFIXES, read, recognizes};
use scan::Survey;
pub use scan::{LineBytes, Lines};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How a file is to be read where it does not say so itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegyOptions {
    /// The byte of a trace's header where its inline number begins, from 1; `None`: 189, or where else it is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iline_byte: Option<u32>,
    /// The same of its crossline number; `None`: 193, or where else it is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xline_byte: Option<u32>,
    /// Only traces with this distance from source to receiver (byte 37); `None`: the first trace of each position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<i32>,
    /// World units from sample to sample, above 0; `None`: as many as there are milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_step: Option<f64>,
    /// A file that ends within a trace is read up to there; else that is an error.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub truncated: bool,
}

impl SegyOptions {
    /// Whether they say nothing.
    pub fn is_default(&self) -> bool {
        *self == SegyOptions::default()
    }
}

/// A survey in a file whose trace headers have been read, and whose samples are read box by box: a [`VoxelSource`](crate::volume::VoxelSource).
/// It takes 4 bytes of memory for each position, and 8 more for each trace while it is opened.
///
/// # Missing values
///
/// Samples at positions without a trace are NaN. Integers are kept in the smallest of `f32` and `f64` that holds them all where some are missing. Samples
/// that are infinite or NaN are missing too, and so are IBM floats beyond the range of `f32` (3.4e38; they reach 7.2e75); those below it are rounded.
///
/// # Reading
///
/// A read takes of each trace only the samples of the box, in parallel, and many traces at once where they lie one behind the other in the file and
/// the box has nearly all of them. So boxes that are long along x (the sample) cost the fewest reads.
#[derive(Debug)]
pub struct SegyVolume {
    input: Input,
    path: PathBuf,
    layout: Layout,
    survey: Survey,
    frame: GridFrame,
    voxel_type: VoxelType,
    notes: Vec<String>,
}

impl SegyVolume {
    /// Reads the headers of all traces.
    pub(super) fn new(input: Input, path: PathBuf, options: &SegyOptions, progress: &Progress) -> Result<Self, SegyError> {
        let mut notes = Vec::new();
        let layout = Layout::of(&input, options, &mut notes)?;
        let survey = scan::survey(&input, &layout, options, progress)?;
        note_geometry(&layout, &survey, options, &mut notes);
        let frame = place::frame(&input, &layout, &survey, options, &mut notes)?;
        let voxel_type = layout.format.voxel_type(survey.missing > 0);
        Ok(SegyVolume { input, path, layout, survey, frame, voxel_type, notes })
    }

    /// What was found, and what was done with what is not as it should be, a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Where the line numbers are.
    pub fn line_bytes(&self) -> LineBytes {
        self.survey.bytes()
    }

    /// Positions that no trace has.
    pub fn missing_traces(&self) -> u64 {
        self.survey.missing
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.survey.index[..])
    }
}

/// What was found out about the traces.
fn note_geometry(layout: &Layout, survey: &Survey, options: &SegyOptions, notes: &mut Vec<String>) {
    let order = if layout.is_little { "little-endian" } else { "big-endian" };
    notes.push(format!("{}, {order}, {} traces of {} samples", layout.format.name(), layout.traces, layout.samples));
    let (inline_step, crossline_step) = (survey.inlines.step, survey.crosslines.step);
    let steps = match (inline_step, crossline_step) {
        (1, 1) => String::new(),
        _ => format!(", in steps of {inline_step} and {crossline_step}"),
    };
    notes.push(format!("{}{steps}", survey.lines));
    if survey.bytes() != LineBytes::STANDARD && options.iline_byte.is_none() && options.xline_byte.is_none() {
        notes.push(format!("bytes 189 and 193 have no line numbers, so those at bytes {} were taken", survey.bytes()));
    }
    let [least, most] = survey.offsets;
    if survey.repeated > 0 {
        let offsets = if least == most { String::new() } else { format!(" (offsets {least} to {most}; --offset takes one)") };
        notes.push(format!("{} traces were left out: the position of each has an earlier one{offsets}", survey.repeated));
    }
    if let Some(offset) = options.offset {
        notes.push(format!("{} traces with another offset than {offset} were left out", survey.other_offset));
    }
    if survey.missing > 0 {
        let positions = survey.index.len();
        notes.push(format!("{} of {positions} positions have no trace; {} traces are dead or dummies", survey.missing, survey.dead));
    }
}
