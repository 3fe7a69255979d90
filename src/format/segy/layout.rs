//! Where traces and their samples lie: what the binary header says, checked against the file's length.

use super::SegyOptions;
use super::error::SegyError;
use super::input::Input;
use super::sample::{SampleFormat, by_code};

/// Bytes of the textual and the binary header.
const HEADERS: u64 = 3600;
/// Bytes of a textual header.
const TEXT: u64 = 3200;
/// Bytes of a trace's header.
pub(super) const TRACE_HEADER: u64 = 240;
/// What the order of the bytes is told by in revision 2.
const ORDER: u32 = 0x0102_0304;

/// Where the numbers of a file lie.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub is_little: bool,
    /// The revision is 1 or later.
    pub has_revision: bool,
    pub format: SampleFormat,
    /// Samples of a trace, at least 2.
    pub samples: u32,
    /// Byte of the first trace.
    pub first: u64,
    /// Bytes of the headers of a trace.
    pub trace_headers: u64,
    /// Bytes from trace to trace.
    pub stride: u64,
    /// Whole traces, at least 1.
    pub traces: u32,
    /// Microseconds from sample to sample; 0: not known.
    pub interval: f64,
}

/// Numbers by their place, counted from byte 1 as the standard does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a> {
    pub bytes: &'a [u8],
    pub is_little: bool,
}

impl Fields<'_> {
    fn array<const N: usize>(&self, byte: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.bytes[byte - 1..][..N]);
        if self.is_little {
            bytes.reverse();
        }
        bytes
    }

    pub fn i16(&self, byte: usize) -> i16 {
        i16::from_be_bytes(self.array(byte))
    }

    pub fn u16(&self, byte: usize) -> u16 {
        u16::from_be_bytes(self.array(byte))
    }

    pub fn i32(&self, byte: usize) -> i32 {
        i32::from_be_bytes(self.array(byte))
    }

    pub fn u32(&self, byte: usize) -> u32 {
        u32::from_be_bytes(self.array(byte))
    }

    pub fn u64(&self, byte: usize) -> u64 {
        u64::from_be_bytes(self.array(byte))
    }

    pub fn f64(&self, byte: usize) -> f64 {
        f64::from_be_bytes(self.array(byte))
    }
}

/// The binary header. Its places are those in the file, less the textual header.
struct Binary<'a> {
    fields: Fields<'a>,
    format: SampleFormat,
    /// Revision 2 or later.
    is_modern: bool,
    /// Revision 1 or later.
    has_revision: bool,
}

const fn place(byte: usize) -> usize {
    byte - TEXT as usize
}

impl<'a> Binary<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, SegyError> {
        let big = Fields { bytes, is_little: false };
        let order = big.u32(place(3297));
        if order == ORDER.rotate_left(16) || order == ORDER.swap_bytes().rotate_left(16) {
            return Err(SegyError::Pairs(order));
        }
        let codes = [false, true].map(|is_little| Fields { bytes, is_little }.u16(place(3225)));
        let is_little = match order {
            ORDER => false,
            _ if order == ORDER.swap_bytes() => true,
            _ => by_code(codes[0]).is_none() && by_code(codes[1]).is_some(),
        };
        let fields = Fields { bytes, is_little };
        let code = fields.u16(place(3225));
        let (name, format) = by_code(code).ok_or(SegyError::Code { big: codes[0], little: codes[1] })?;
        let format = format.ok_or(SegyError::Format { code, name })?;
        // Some write the two bytes of the revision as one number of their order of bytes.
        let [major, minor] = [bytes[place(3501) - 1], bytes[place(3502) - 1]];
        let is_modern = order == ORDER || order == ORDER.swap_bytes() || (2..16).contains(&major);
        Ok(Binary { fields, format, is_modern, has_revision: is_modern || major == 1 || (major, minor) == (0, 1) })
    }

    fn samples(&self) -> u32 {
        match self.fields.u32(place(3269)) {
            samples if self.is_modern && samples > 0 => samples,
            _ => u32::from(self.fields.u16(place(3221))),
        }
    }

    /// Microseconds from sample to sample; 0: not known.
    fn interval(&self) -> f64 {
        match self.fields.f64(place(3273)) {
            interval if self.is_modern && interval.is_finite() && interval > 0.0 => interval,
            _ => f64::from(self.fields.u16(place(3217))),
        }
    }

    /// Where the first trace may begin, the likeliest first.
    fn first(&self, input: &Input) -> Result<Vec<u64>, SegyError> {
        let stated = self.fields.u64(place(3523));
        if self.is_modern && (HEADERS..input.len()).contains(&stated) {
            return Ok(vec![stated]);
        }
        let found = self.fields.i16(place(3505));
        match found {
            0 => Ok(vec![HEADERS]),
            1.. => {
                let behind = HEADERS + found as u64 * TEXT;
                // Before revision 1 these bytes meant nothing.
                Ok(if self.has_revision { vec![behind] } else { vec![behind, HEADERS] })
            }
            -1 => Ok(vec![behind_end_text(input)?]),
            _ if !self.has_revision => Ok(vec![HEADERS]),
            _ => Err(SegyError::TextHeaders { found, expected: "a count, or -1 for as many as there are" }),
        }
    }

    /// Bytes of the headers of a trace.
    fn trace_headers(&self) -> u64 {
        let more = if self.is_modern { self.fields.u32(place(3507)) } else { 0 };
        TRACE_HEADER * (1 + u64::from(more))
    }

    /// Where the traces end: trailers may follow.
    fn end(&self, len: u64, first: u64, stride: u64) -> u64 {
        if !self.is_modern {
            return len;
        }
        let (traces, trailers) = (self.fields.u64(place(3515)), self.fields.i32(place(3531)));
        let by_count = traces.checked_mul(stride).and_then(|bytes| bytes.checked_add(first));
        match by_count {
            Some(end) if traces > 0 && end <= len && (len - end).is_multiple_of(TEXT) => end,
            _ => len.saturating_sub(u64::try_from(trailers).unwrap_or(0) * TEXT),
        }
    }
}

/// Where the traces begin behind textual headers of which the last says that it is.
fn behind_end_text(input: &Input) -> Result<u64, SegyError> {
    // "((SEG: EndText))" in ASCII and in EBCDIC, blanks and case aside.
    const ASCII: &[u8] = b"((seg:endtext))";
    const EBCDIC: &[u8] = &[0x4d, 0x4d, 0xa2, 0x85, 0x87, 0x7a, 0x85, 0x95, 0x84, 0xa3, 0x85, 0xa7, 0xa3, 0x5d, 0x5d];
    let lower_ebcdic = |b: u8| if matches!(b, 0xc1..=0xc9 | 0xd1..=0xd9 | 0xe2..=0xe9) { b - 0x40 } else { b };
    let mut at = HEADERS;
    while at + TEXT <= input.len() {
        let start: [u8; 80] = input.array_at(at)?;
        let without = |blank: u8, lower: &dyn Fn(u8) -> u8| start.iter().filter(|&&b| b != blank).map(|&b| lower(b)).collect::<Vec<_>>();
        at += TEXT;
        if without(b' ', &|b| b.to_ascii_lowercase()).starts_with(ASCII) || without(0x40, &lower_ebcdic).starts_with(EBCDIC) {
            return Ok(at);
        }
    }
    Err(SegyError::TextHeaders { found: -1, expected: "one of them to begin with ((SEG: EndText))" })
}

impl Layout {
    /// Finds out where the traces of a file lie. Notes say what was not as it should be.
    pub fn of(input: &Input, options: &SegyOptions, notes: &mut Vec<String>) -> Result<Layout, SegyError> {
        let len = input.len();
        if len < HEADERS {
            return Err(SegyError::Short(len));
        }
        let bytes: [u8; 400] = input.array_at(TEXT)?;
        let binary = Binary::new(&bytes)?;
        let (trace_headers, size) = (binary.trace_headers(), u64::from(binary.format.bytes()));
        let firsts = binary.first(input)?;
        let mut likely: Option<Candidate> = None;
        for &first in &firsts {
            if first + TRACE_HEADER > len {
                continue;
            }
            let header: [u8; TRACE_HEADER as usize] = input.array_at(first)?;
            let header = Fields { bytes: &header, ..binary.fields };
            let counts = [binary.samples(), u32::from(header.u16(115))];
            for samples in counts {
                let stride = trace_headers + u64::from(samples) * size;
                let end = binary.end(len, first, stride);
                let found = Candidate { first, stride, samples, end, counts, interval: f64::from(header.u16(117)) };
                if samples >= 2 && found.is_whole() {
                    return found.layout(&binary, notes);
                }
                if samples >= 2 {
                    likely.get_or_insert(found);
                } else if samples == counts[1] && likely.is_none() {
                    return Err(SegyError::Samples { binary: counts[0], trace: counts[1] });
                }
            }
        }
        let Some(found) = likely else { return Err(SegyError::NoTraces { first: firsts[0], len }) };
        let left = found.end.saturating_sub(found.first);
        let (whole, found_bytes) = (left / found.stride, left % found.stride);
        if options.truncated && whole > 0 {
            notes.push(format!("cut off within trace {}, of which {found_bytes} bytes were left out", whole + 1));
            return found.layout(&binary, notes);
        }
        let (stride, samples, bytes) = (found.stride, found.samples, binary.format.bytes());
        Err(SegyError::Cut { trace: whole + 1, found: found_bytes, stride, samples, bytes })
    }
}

/// What may be the layout.
struct Candidate {
    first: u64,
    stride: u64,
    samples: u32,
    end: u64,
    /// Samples of a trace by the binary header and by the first trace.
    counts: [u32; 2],
    /// Microseconds from sample to sample by the first trace.
    interval: f64,
}

impl Candidate {
    fn is_whole(&self) -> bool {
        self.end > self.first && (self.end - self.first).is_multiple_of(self.stride)
    }

    fn layout(self, binary: &Binary<'_>, notes: &mut Vec<String>) -> Result<Layout, SegyError> {
        let traces = (self.end - self.first) / self.stride;
        let traces = u32::try_from(traces).ok().filter(|&traces| traces < u32::MAX).ok_or(SegyError::TooMany(traces))?;
        if self.samples != self.counts[0] {
            let [stated, _] = self.counts;
            notes.push(format!(
                "{} samples a trace, as the first trace says; the binary header's {stated} do not fit the file",
                self.samples
            ));
        }
        let interval = if binary.interval() > 0.0 { binary.interval() } else { self.interval };
        Ok(Layout {
            is_little: binary.fields.is_little,
            has_revision: binary.has_revision,
            format: binary.format,
            samples: self.samples,
            first: self.first,
            trace_headers: binary.trace_headers(),
            stride: self.stride,
            traces,
            interval,
        })
    }
}
