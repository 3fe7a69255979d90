//! The numbers of an array: from text, base64 or raw bytes, compressed or not, to the items of a mesh.
//!
//! An array is decoded chunk by chunk straight into its final vector, so that the peak is the mesh and one chunk (or one block, where
//! a block is larger). Every length is checked against the one that the piece calls for before anything of that size is allocated.

use super::compress::{BlockTable, Compressor};
use super::number::{self, Item, Number, ScalarType};
use super::xml::{Array, Head, Place};
use crate::format::source::Source;
use crate::progress::{Cancelled, Progress};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io;
use std::ops::Range;

/// Bytes decoded at once. A multiple of 3 for base64's sake and of 8 for the numbers'.
const CHUNK: u64 = 6 << 20;
/// Characters of text parsed at once, and by one thread.
const TEXT_CHUNK: u64 = 2 << 20;
const TEXT_PART: usize = 1 << 15;
/// Characters that one number may have.
const TOKEN_LIMIT: usize = 1 << 12;

/// Base64 as VTK writes it, also where its writer left out the padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent).with_decode_allow_trailing_bits(true),
);

/// Why an array cannot be read. The texts continue "array X".
#[derive(Debug, thiserror::Error)]
pub enum ArrayError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error("was not read: {0}")]
    Cancelled(#[from] Cancelled),
    /// There are no appended data to find it in.
    #[error("should be in the appended data, but the file has none")]
    NoAppendedData,
    /// It reaches beyond what there is.
    #[error("reaches to byte {end}, expected it to end by byte {limit}, where the data end")]
    PastEnd {
        /// Where it would end.
        end: u64,
        /// Where its data or the file end.
        limit: u64,
    },
    /// No machine could hold it.
    #[error("should have {items} x {numbers} numbers, more than can be addressed")]
    TooLarge {
        /// Points or cells.
        items: u64,
        /// Numbers a point or cell.
        numbers: u64,
    },
    /// The system has not enough memory.
    #[error("needs {bytes} bytes of memory more than the system gives")]
    Memory {
        /// What was asked for last.
        bytes: u64,
    },
    /// Its tuples have the wrong size.
    #[error("has {found} components, expected {expected}")]
    Components {
        /// What the file states.
        found: u64,
        /// What is needed.
        expected: u64,
    },
    /// Its length word is wrong.
    #[error("has {found} bytes, expected {expected}")]
    Length {
        /// What the file states.
        found: u64,
        /// What the piece calls for.
        expected: u64,
    },
    /// It holds too few or too many numbers.
    #[error("holds {found} numbers, expected {expected}")]
    Count {
        /// What was found, as text.
        found: String,
        /// What the piece calls for.
        expected: u64,
    },
    /// One of its numbers is none, or out of range.
    #[error("has {found} as its number {index} (from 0), expected {expected}")]
    Number {
        /// Which one.
        index: u64,
        /// What it is.
        found: String,
        /// What it should be.
        expected: Cow<'static, str>,
    },
    /// Its base64 text is damaged.
    #[error("has damaged base64 text: {0}")]
    Base64(String),
    /// Its compression header does not add up.
    #[error("is said to have {} blocks of {} bytes, the last of {}, expected {expected} bytes in all", words[0], words[1], words[2])]
    Blocks {
        /// Number of blocks, bytes a block, bytes of the last one (0: full).
        words: [u64; 3],
        /// What the piece calls for.
        expected: u64,
    },
    /// A compressed block is damaged.
    #[error("has a damaged block {block}, expected {size} bytes from it: {reason}")]
    Block {
        /// Which block, from 0.
        block: u64,
        /// Its size before compression.
        size: u64,
        /// What the decoder says.
        reason: String,
    },
}

/// Reads the arrays of a file.
pub(in crate::format) struct ArrayReader<'a> {
    pub source: &'a Source<'a>,
    pub head: &'a Head,
    pub progress: &'a Progress,
}

impl ArrayReader<'_> {
    /// Appends an array, which must make `items` items, to `out`.
    pub fn append<I: Item>(&self, array: &Array, items: u64, out: &mut Vec<I>) -> Result<(), ArrayError> {
        self.decode(array, items, out, |_| Ok(()))
    }

    /// Shows an array of `items` items to `visit`, chunk by chunk, and keeps none of it.
    pub fn visit<I: Item>(
        &self,
        array: &Array,
        items: u64,
        mut visit: impl FnMut(&[I]) -> Result<(), ArrayError>,
    ) -> Result<(), ArrayError> {
        self.decode(array, items, &mut Vec::new(), |chunk| {
            visit(chunk)?;
            chunk.clear();
            Ok(())
        })
    }

    fn decode<I: Item>(
        &self,
        array: &Array,
        items: u64,
        out: &mut Vec<I>,
        after_chunk: impl FnMut(&mut Vec<I>) -> Result<(), ArrayError>,
    ) -> Result<(), ArrayError> {
        let numbers = items.checked_mul(I::NUMBERS as u64);
        let bytes = numbers.and_then(|n| n.checked_mul(array.scalar.size() as u64));
        let (Some(numbers), Some(bytes)) = (numbers, bytes) else {
            return Err(ArrayError::TooLarge { items, numbers: I::NUMBERS as u64 });
        };
        if bytes == 0 {
            return Ok(());
        }
        let collector = Collector { out, after_chunk, scalar: array.scalar, numbers, done: 0, bytes: Vec::new(), words: Vec::new() };
        match &array.place {
            Place::Ascii(text) => self.decode_text(text, collector),
            Place::Base64(text) => self.decode_binary(self.stream(text.start, text.end, true), bytes, collector),
            Place::Appended(offset) => {
                let appended = self.head.appended.ok_or(ArrayError::NoAppendedData)?;
                let (start, limit) = (appended.start.saturating_add(*offset), self.source.len());
                if start >= limit {
                    return Err(ArrayError::PastEnd { end: start.saturating_add(bytes), limit });
                }
                self.decode_binary(self.stream(start, limit, appended.base64), bytes, collector)
            }
        }
    }

    fn stream(&self, at: u64, end: u64, base64: bool) -> ByteStream<'_> {
        let base64 = base64.then(Base64::default);
        ByteStream { source: self.source, progress: self.progress, at, end, base64 }
    }

    /// Numbers as text: chunks are cut at blanks, then parsed in parts side by side.
    fn decode_text<I: Item, F>(&self, place: &Range<u64>, mut collector: Collector<'_, I, F>) -> Result<(), ArrayError>
    where
        F: FnMut(&mut Vec<I>) -> Result<(), ArrayError>,
    {
        let mut text = Vec::new();
        let mut at = place.start;
        while at < place.end {
            // Read on behind the cut-off token that the last chunk left.
            let len = TEXT_CHUNK.min(place.end - at);
            text.extend_from_slice(&self.source.read(at, len as usize)?);
            at += len;
            self.progress.add(len);
            self.progress.check()?;
            let cut = match text.iter().rposition(u8::is_ascii_whitespace) {
                _ if at == place.end => text.len(),
                last_blank => last_blank.unwrap_or(0),
            };
            if text.len() - cut > TOKEN_LIMIT && at < place.end {
                let found = format!("more than {TOKEN_LIMIT} characters");
                return Err(ArrayError::Number { index: collector.done, found, expected: I::EXPECTED.into() });
            }
            // Parse up to the cut.
            let scalar = collector.scalar;
            let parsed: Vec<_> = parts(&text[..cut])
                .par_iter()
                .map(|part| {
                    let mut numbers = Vec::new();
                    (number::append_text(&mut numbers, part, scalar), numbers)
                })
                .collect();
            for (outcome, numbers) in parsed {
                collector.push_numbers(&numbers)?;
                if let Err((_, token)) = outcome {
                    return Err(ArrayError::Number { index: collector.done, found: format!("\"{token}\""), expected: I::EXPECTED.into() });
                }
            }
            text.drain(..cut);
        }
        if collector.done == collector.numbers {
            Ok(())
        } else {
            Err(ArrayError::Count { found: collector.done.to_string(), expected: collector.numbers })
        }
    }

    /// Numbers as bytes, `expected` of them once they are decompressed.
    fn decode_binary<I: Item, F>(
        &self,
        mut stream: ByteStream<'_>,
        expected: u64,
        mut collector: Collector<'_, I, F>,
    ) -> Result<(), ArrayError>
    where
        F: FnMut(&mut Vec<I>) -> Result<(), ArrayError>,
    {
        if let Some(compressor) = self.head.compressor {
            return self.decode_blocks(compressor, stream, expected, collector);
        }
        let found = self.words(&mut stream, 1)?[0];
        if found != expected {
            return Err(ArrayError::Length { found, expected });
        }
        stream.require(expected)?;
        let mut left = expected;
        while left > 0 {
            let len = left.min(CHUNK);
            collector.push_bytes(&stream.read(len as usize)?, self.head)?;
            left -= len;
        }
        Ok(())
    }

    /// Compressed numbers: batches of blocks are read at once and inflated side by side.
    fn decode_blocks<I: Item, F>(
        &self,
        compressor: Compressor,
        mut stream: ByteStream<'_>,
        expected: u64,
        mut collector: Collector<'_, I, F>,
    ) -> Result<(), ArrayError>
    where
        F: FnMut(&mut Vec<I>) -> Result<(), ArrayError>,
    {
        // The header must agree with the array, and what it announces must be there.
        let words = self.words(&mut stream, 3)?;
        let words = [words[0], words[1], words[2]];
        let table = BlockTable::new(words, expected).ok_or(ArrayError::Blocks { words, expected })?;
        let compressed = self.words(&mut stream, table.blocks)?;
        stream.require(compressed.iter().fold(0, |sum: u64, &size| sum.saturating_add(size)))?;

        let mut first = 0;
        while first < table.blocks {
            // A batch is at least one block, and as many more as stay below the size of a chunk.
            let (mut next, mut read, mut inflated) = (first, 0, 0);
            while next < table.blocks && (next == first || (read + compressed[next as usize]).max(inflated + table.size(next)) <= CHUNK) {
                read += compressed[next as usize];
                inflated += table.size(next);
                next += 1;
            }
            let bytes = stream.read(to_usize(read)?)?;
            let mut rest = &bytes[..];
            let mut blocks = Vec::new();
            for i in first..next {
                let (block, behind) = rest.split_at(compressed[i as usize] as usize);
                blocks.push((i, block, to_usize(table.size(i))?));
                rest = behind;
            }
            let inflate = |&(block, bytes, size): &(u64, &[u8], usize)| {
                compressor.inflate(bytes, size).map_err(|reason| ArrayError::Block { block, size: size as u64, reason })
            };
            let inflated: Vec<_> = blocks.par_iter().map(inflate).collect();
            for block in inflated {
                collector.push_bytes(&block?, self.head)?;
            }
            first = next;
        }
        Ok(())
    }

    /// The next header words.
    fn words(&self, stream: &mut ByteStream<'_>, count: u64) -> Result<Vec<u64>, ArrayError> {
        let size = self.head.header_size;
        let len = count.saturating_mul(size as u64);
        stream.require(len)?;
        let bytes = stream.read(to_usize(len)?)?;
        let mut words = Vec::new();
        let scalar = if size == 4 { ScalarType::UInt32 } else { ScalarType::UInt64 };
        words.try_reserve_exact(bytes.len() / size).map_err(|_| ArrayError::Memory { bytes: len })?;
        number::append_binary(&mut words, &bytes, scalar, self.head.byte_order).expect("unsigned numbers fit into u64");
        Ok(words)
    }
}

/// Text cut at blanks into parts for several threads.
fn parts(mut text: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    while text.len() > TEXT_PART {
        let end = text[TEXT_PART..].iter().position(u8::is_ascii_whitespace).map_or(text.len(), |i| TEXT_PART + i);
        let (part, rest) = text.split_at(end);
        parts.push(part);
        text = rest;
    }
    parts.push(text);
    parts
}

fn to_usize(bytes: u64) -> Result<usize, ArrayError> {
    usize::try_from(bytes).map_err(|_| ArrayError::Memory { bytes })
}

/// Gathers the numbers of one array into items.
struct Collector<'o, I, F> {
    out: &'o mut Vec<I>,
    after_chunk: F,
    scalar: ScalarType,
    /// Numbers that the array must have, and those that came so far.
    numbers: u64,
    done: u64,
    /// What came of an item that is not complete yet.
    bytes: Vec<u8>,
    words: Vec<Number>,
}

impl<I: Item, F: FnMut(&mut Vec<I>) -> Result<(), ArrayError>> Collector<'_, I, F> {
    fn push_bytes(&mut self, mut bytes: &[u8], head: &Head) -> Result<(), ArrayError> {
        let item_size = I::NUMBERS * self.scalar.size();
        if !self.bytes.is_empty() {
            let (missing, rest) = bytes.split_at(bytes.len().min(item_size - self.bytes.len()));
            self.bytes.extend_from_slice(missing);
            bytes = rest;
            if self.bytes.len() == item_size {
                let item = std::mem::take(&mut self.bytes);
                self.convert(&item, head)?;
            }
        }
        let (whole, rest) = bytes.split_at(bytes.len() - bytes.len() % item_size);
        self.bytes.extend_from_slice(rest);
        self.convert(whole, head)
    }

    /// Takes bytes that spell whole items.
    fn convert(&mut self, bytes: &[u8], head: &Head) -> Result<(), ArrayError> {
        let numbers = bytes.len() / self.scalar.size();
        self.reserve(numbers / I::NUMBERS)?;
        number::append_binary(self.out, bytes, self.scalar, head.byte_order).map_err(|(place, number)| ArrayError::Number {
            index: self.done + place as u64,
            found: number.to_string(),
            expected: I::EXPECTED.into(),
        })?;
        self.done += numbers as u64;
        (self.after_chunk)(self.out)
    }

    fn push_numbers(&mut self, numbers: &[Number]) -> Result<(), ArrayError> {
        if numbers.len() as u64 > self.numbers - self.done {
            return Err(ArrayError::Count { found: format!("more than {}", self.numbers), expected: self.numbers });
        }
        self.words.extend_from_slice(numbers);
        self.reserve(self.words.len() / I::NUMBERS)?;
        let words = std::mem::take(&mut self.words);
        let mut items = words.chunks_exact(I::NUMBERS);
        for item in &mut items {
            self.out.push(I::from_numbers(|k| item[k]).ok_or_else(|| self.misfit(item))?);
            self.done += I::NUMBERS as u64;
        }
        self.words.extend_from_slice(items.remainder());
        (self.after_chunk)(self.out)
    }

    fn misfit(&self, item: &[Number]) -> ArrayError {
        let place = item.iter().position(|&number| I::from_numbers(|_| number).is_none()).expect("an item fails by one of its numbers");
        ArrayError::Number { index: self.done + place as u64, found: item[place].to_string(), expected: I::EXPECTED.into() }
    }

    /// Makes room for items that have really arrived: doubles, but never beyond what the array must have in the end.
    fn reserve(&mut self, items: usize) -> Result<(), ArrayError> {
        if self.out.capacity() - self.out.len() >= items {
            return Ok(());
        }
        let left = to_usize((self.numbers - self.done) / I::NUMBERS as u64)?;
        let room = items.max(self.out.len().min(left));
        self.out.try_reserve_exact(room).map_err(|_| ArrayError::Memory { bytes: (room * size_of::<I>()) as u64 })
    }
}

/// The bytes of one array, in order.
struct ByteStream<'a> {
    source: &'a Source<'a>,
    progress: &'a Progress,
    at: u64,
    end: u64,
    base64: Option<Base64>,
}

/// What was read of base64 text ahead of need. A group that ends in `=` may be followed by more: VTK writes the compression header as a
/// text of its own, and some writers do so with the length word.
#[derive(Default)]
struct Base64 {
    chars: Vec<u8>,
    bytes: Vec<u8>,
}

impl<'a> ByteStream<'a> {
    /// An error unless `len` more bytes can be there.
    fn require(&self, len: u64) -> Result<(), ArrayError> {
        let left = self.end - self.at;
        let (available, place) = match &self.base64 {
            None => (left, len),
            Some(ahead) => (((left + ahead.chars.len() as u64) / 4 + 1) * 3 + ahead.bytes.len() as u64, len.saturating_mul(4) / 3),
        };
        if len <= available { Ok(()) } else { Err(ArrayError::PastEnd { end: self.at.saturating_add(place), limit: self.end }) }
    }

    /// The next `len` bytes.
    fn read(&mut self, len: usize) -> Result<Cow<'a, [u8]>, ArrayError> {
        match self.base64.take() {
            None => self.read_raw(len),
            Some(mut ahead) => {
                let bytes = self.read_base64(&mut ahead, len)?;
                self.base64 = Some(ahead);
                Ok(Cow::Owned(bytes))
            }
        }
    }

    fn read_raw(&mut self, len: usize) -> Result<Cow<'a, [u8]>, ArrayError> {
        self.progress.check()?;
        let end = self.at.saturating_add(len as u64);
        if end > self.end {
            return Err(ArrayError::PastEnd { end, limit: self.end });
        }
        let bytes = self.source.read(self.at, len)?;
        self.at = end;
        self.progress.add(len as u64);
        Ok(bytes)
    }

    fn read_base64(&mut self, ahead: &mut Base64, len: usize) -> Result<Vec<u8>, ArrayError> {
        while ahead.bytes.len() < len {
            let chars = (len - ahead.bytes.len()).div_ceil(3).saturating_mul(4);
            while ahead.chars.len() < chars && self.at < self.end {
                let text = self.read_raw((self.end - self.at).min((chars - ahead.chars.len()) as u64) as usize)?;
                ahead.chars.extend(text.iter().filter(|c| !c.is_ascii_whitespace()));
            }
            if ahead.chars.is_empty() {
                return Err(ArrayError::Base64(format!("it ends {} bytes early", len - ahead.bytes.len())));
            }
            let text = &ahead.chars[..chars.min(ahead.chars.len())];
            let end = text.iter().position(|&c| c == b'=').map_or(text.len(), |i| text.len().min((i / 4 + 1) * 4));
            BASE64.decode_vec(&text[..end], &mut ahead.bytes).map_err(|e| ArrayError::Base64(e.to_string()))?;
            ahead.chars.drain(..end);
        }
        let rest = ahead.bytes.split_off(len);
        Ok(std::mem::replace(&mut ahead.bytes, rest))
    }
}
