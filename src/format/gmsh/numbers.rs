//! The numbers of a section, as text or binary.

use super::super::parse::{Binary, ParseError, Words};
use super::super::vtu::number::ByteOrder;
use crate::progress::Progress;

/// How a file's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// As words.
    Text,
    /// As bytes; `size_bytes` (4 or 8) is the width of counts and, from 4.1 on, of tags.
    Binary { order: ByteOrder, size_bytes: usize },
}

/// Goes through the numbers of a section.
pub(super) struct Numbers<'a> {
    kind: Kind<'a>,
    progress: &'a Progress,
    /// Where `progress` knows that it is.
    reported: usize,
}

enum Kind<'a> {
    Text(Words<'a>),
    Binary(Binary<'a>, usize),
}

/// Bytes between two looks at the progress.
const PROGRESS_BYTES: usize = 1 << 18;

impl<'a> Numbers<'a> {
    /// From where `words` are, in `bytes`, the whole file.
    pub fn new(bytes: &'a [u8], words: &Words<'a>, encoding: Encoding, progress: &'a Progress) -> Self {
        let kind = match encoding {
            Encoding::Text => Kind::Text(words.clone()),
            Encoding::Binary { order, size_bytes } => Kind::Binary(Binary::new(bytes, words.at(), order), size_bytes),
        };
        Numbers { kind, progress, reported: words.at() }
    }

    /// Where it is, in bytes from the start of the file.
    pub fn at(&self) -> usize {
        match &self.kind {
            Kind::Text(words) => words.at(),
            Kind::Binary(bytes, _) => bytes.at(),
        }
    }

    /// Where it is, for messages.
    pub fn place(&self) -> String {
        match &self.kind {
            Kind::Text(words) => words.place(),
            Kind::Binary(bytes, _) => bytes.place(),
        }
    }

    /// Tells how far it is, and stops if that is asked for. To be called now and then.
    pub fn check(&mut self) -> Result<(), ParseError> {
        let at = self.at();
        if at - self.reported > PROGRESS_BYTES {
            self.progress.add((at - self.reported) as u64);
            self.progress.check()?;
            self.reported = at;
        }
        Ok(())
    }

    /// A number of 32 bits.
    pub fn int(&mut self, what: &str) -> Result<i64, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => words.integer(what),
            Kind::Binary(bytes, _) => bytes.number::<i32>(what).map(i64::from),
        }
    }

    /// A number of the width of counts.
    pub fn size(&mut self, what: &str) -> Result<u64, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => words.integer(what),
            Kind::Binary(bytes, 4) => bytes.number::<u32>(what).map(u64::from),
            Kind::Binary(bytes, _) => bytes.number::<u64>(what),
        }
    }

    /// A tag: of the width of counts if `is_wide`, else of 32 bits.
    pub fn tag(&mut self, is_wide: bool, what: &str) -> Result<u64, ParseError> {
        if is_wide {
            return self.size(what);
        }
        let place = self.place();
        let tag = self.int(what)?;
        u64::try_from(tag).map_err(|_| ParseError::invalid(place, tag.to_string(), format!("{what} from 0 on")))
    }

    /// A real number.
    pub fn real(&mut self, what: &str) -> Result<f64, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => words.real(what),
            Kind::Binary(bytes, _) => bytes.number::<f64>(what),
        }
    }

    /// Checks a count of things of so many numbers each (of 32 bits at least) against what is left of the file.
    pub fn room(&self, count: u64, numbers_each: usize, what: &str) -> Result<usize, ParseError> {
        let (left, bytes_each) = match &self.kind {
            Kind::Text(words) => (words.rest().len() as u64 + 1, 2),
            Kind::Binary(bytes, _) => (bytes.rest().len() as u64, 4),
        };
        if count.saturating_mul(numbers_each as u64).saturating_mul(bytes_each) > left {
            return Err(ParseError::invalid(self.place(), format!("{count} {what}"), "no more than the file has room for"));
        }
        Ok(count as usize)
    }
}
