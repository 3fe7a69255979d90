//! A file of EnSight Gold: lines and numbers in text, or strings of 80 bytes and numbers of 32 bits.

use super::super::parse::{Binary, ParseError, Plain, Words, shown};
use super::super::vtu::number::ByteOrder;
use crate::progress::Progress;

/// Bytes of a string in a binary file.
const STRING: usize = 80;
/// Numbers between two looks at whether to stop.
const CHECKED: usize = 1 << 16;

/// Goes through a file.
#[derive(Debug, Clone)]
pub(super) enum Input<'a> {
    Text(Words<'a>),
    Binary(Binary<'a>),
}

impl<'a> Input<'a> {
    /// From the start of a file of geometry: its first line says whether it is binary.
    pub fn geometry(bytes: &'a [u8]) -> Result<Self, ParseError> {
        let start = &bytes[..bytes.len().min(STRING)];
        let start = String::from_utf8_lossy(start).to_lowercase();
        if start.contains("fortran binary") {
            return Err(ParseError::Unsupported("is EnSight's Fortran binary; octetra reads C binary and text".into()));
        }
        if !start.contains("c binary") {
            return Ok(Input::Text(Words::new(bytes)));
        }
        // Nothing says the order. The number behind the first "part" is small in the right one.
        let number = bytes.windows(STRING).skip(STRING).step_by(4).position(|string| string.starts_with(b"part") && is_word(string, 4));
        let at = number.map(|i| STRING + 4 * i + STRING);
        let number = at.and_then(|at| bytes.get(at..at + 4));
        let is_big = number.is_some_and(|number| u32::from_bytes(number, ByteOrder::Big) < u32::from_bytes(number, ByteOrder::Little));
        let order = if is_big { ByteOrder::Big } else { ByteOrder::Little };
        Ok(Input::Binary(Binary::new(bytes, STRING, order)))
    }

    /// From the start of a file of values, which is written as the geometry is.
    pub fn like<'b>(&self, bytes: &'b [u8]) -> Input<'b> {
        match self {
            Input::Text(_) => Input::Text(Words::new(bytes)),
            Input::Binary(binary) => Input::Binary(Binary::new(bytes, 0, binary.order())),
        }
    }

    /// Where it is, for messages.
    pub fn place(&self) -> String {
        match self {
            Input::Text(words) => words.place(),
            Input::Binary(binary) => binary.place(),
        }
    }

    /// A line as it stands, also an empty one.
    pub fn line(&mut self, what: &str) -> Result<&'a str, ParseError> {
        let bytes = match self {
            Input::Text(words) => words.rest_of_line().ok_or_else(|| ParseError::invalid(words.place(), "the end of the file", what))?,
            Input::Binary(binary) => binary.take(STRING, what)?,
        };
        let bytes = bytes.split(|&b| b == 0).next().unwrap_or_default();
        Ok(std::str::from_utf8(bytes).unwrap_or("?").trim())
    }

    /// The next line that is not empty; `None` at the end.
    pub fn keyword(&mut self) -> Result<Option<&'a str>, ParseError> {
        let is_at_end = match self {
            Input::Text(words) => words.peek().is_none(),
            Input::Binary(binary) => binary.rest().is_empty(),
        };
        if is_at_end {
            return Ok(None);
        }
        loop {
            let line = self.line("a keyword")?;
            if !line.is_empty() {
                return Ok(Some(line));
            }
        }
    }

    /// An error about a line.
    pub fn bad(&self, found: &str, expected: &str) -> ParseError {
        ParseError::invalid(self.place(), shown(found.as_bytes()), expected)
    }

    /// A count of items of so many numbers each, which the file must have room for.
    pub fn count(&mut self, numbers: usize, what: &str) -> Result<usize, ParseError> {
        match self {
            Input::Text(words) => words.count(2 * numbers, what),
            Input::Binary(binary) => {
                let place = binary.place();
                let count: i32 = binary.number(what)?;
                let fits = |&count: &usize| count.saturating_mul(4 * numbers) <= binary.rest().len();
                let found = usize::try_from(count).ok().filter(fits);
                found.ok_or_else(|| ParseError::invalid(place, format!("{count} {what}"), "no more than the file has room for"))
            }
        }
    }

    /// Whole numbers.
    pub fn integers(&mut self, count: usize, what: &str, progress: &Progress) -> Result<Vec<i32>, ParseError> {
        match self {
            Input::Text(words) => {
                let mut numbers = Vec::with_capacity(count.min(words.rest().len() / 2 + 1));
                for i in 0..count {
                    numbers.push(words.integer(what)?);
                    if i.is_multiple_of(CHECKED) {
                        progress.check()?;
                    }
                }
                Ok(numbers)
            }
            Input::Binary(binary) => binary.numbers(count, what),
        }
    }

    /// Numbers.
    pub fn reals(&mut self, count: usize, what: &str, progress: &Progress) -> Result<Vec<f32>, ParseError> {
        match self {
            Input::Text(words) => {
                let mut numbers = Vec::with_capacity(count.min(words.rest().len() / 2 + 1));
                for i in 0..count {
                    numbers.push(words.real(what)? as f32);
                    if i.is_multiple_of(CHECKED) {
                        progress.check()?;
                    }
                }
                Ok(numbers)
            }
            Input::Binary(binary) => binary.numbers(count, what),
        }
    }

    /// Goes behind what is left of a line of numbers.
    pub fn end_line(&mut self) {
        if let Input::Text(words) = self {
            words.rest_of_line();
        }
    }
}

/// Whether bytes end a word here.
fn is_word(string: &[u8], len: usize) -> bool {
    string.get(len).is_none_or(|&b| b == 0 || b.is_ascii_whitespace())
}
