//! Sections and their numbers, as text or binary.
//!
//! ```text
//! binary:  1 version | keyword next [count] data | keyword next [count] data | .. | 54 0
//!          keywords and `next`, where the next keyword stands, 4 bytes, from version 3 on `next` has 8
//!          counts and integers 4 bytes, in version 4 8; reals 4 bytes in version 1, else 8
//! ```

use super::super::parse::{Binary, ParseError, Words};
use super::super::vtu::number::ByteOrder;
use super::{Section, section_name};
use crate::progress::Progress;

/// Goes through a file section by section.
pub(super) struct Numbers<'a> {
    kind: Kind<'a>,
    progress: &'a Progress,
    /// Where `progress` knows that it is.
    reported: usize,
}

enum Kind<'a> {
    Text(Words<'a>),
    Binary {
        bytes: &'a [u8],
        at: Binary<'a>,
        order: ByteOrder,
        version: i32,
        /// Where the next section begins; 0 if the file does not say.
        next: u64,
    },
}

/// Bytes between two looks at the progress.
const PROGRESS_BYTES: usize = 1 << 18;

/// The byte order of a binary file, which begins with 1, its version, and the keyword and value of the dimension; `None` if it is none.
pub(super) fn binary_order(start: &[u8]) -> Option<ByteOrder> {
    [ByteOrder::Little, ByteOrder::Big].into_iter().find(|&order| {
        let head = Binary::new(start, 0, order).numbers::<i32>(3, "the head");
        let Ok(&[1, version @ 1..=4, 3]) = head.as_deref() else { return false };
        let dimension = Binary::new(start, if version < 3 { 16 } else { 20 }, order).number::<i32>("a dimension");
        matches!(dimension, Ok(2 | 3))
    })
}

impl<'a> Numbers<'a> {
    /// From behind the version on.
    pub fn new(bytes: &'a [u8], progress: &'a Progress) -> Result<Self, ParseError> {
        let kind = match binary_order(bytes) {
            Some(order) => {
                let mut at = Binary::new(bytes, 0, order);
                at.number::<i32>("the mark of the byte order")?;
                let version = at.number("a version")?;
                Kind::Binary { bytes, at, order, version, next: 0 }
            }
            None => {
                let mut words = Words::with_comments(bytes, b'#');
                let first = words.word("MeshVersionFormatted")?;
                if !first.eq_ignore_ascii_case(b"MeshVersionFormatted") {
                    return Err(words.bad(first, "MeshVersionFormatted, as Medit's files begin"));
                }
                words.integer::<i64>("a version")?;
                Kind::Text(words)
            }
        };
        Ok(Numbers { kind, progress, reported: 0 })
    }

    /// The next section and its keyword; `None` at the end.
    pub fn next_section(&mut self) -> Result<Option<(Section, Vec<u8>)>, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => {
                let Some(word) = words.next() else { return Ok(None) };
                if !is_keyword(word) {
                    return Err(words.bad(word, "the keyword of a section, such as Vertices or End"));
                }
                Ok(Some((Section::of_name(word), word.to_vec())))
            }
            Kind::Binary { at, version, next, .. } => {
                if at.rest().is_empty() {
                    return Ok(None);
                }
                let code: i32 = at.number("a keyword")?;
                *next = if *version < 3 { u64::from(at.number::<u32>("a position")?) } else { at.number("a position")? };
                Ok(Some((Section::of_code(i64::from(code)), format!("keyword {code}").into_bytes())))
            }
        }
    }

    /// Goes to the next section behind one that was read.
    pub fn leave(&mut self) -> Result<(), ParseError> {
        match &mut self.kind {
            Kind::Binary { next, at, .. } if *next > at.at() as u64 => self.skip_to_next(),
            _ => Ok(()),
        }
    }

    /// Goes to the next section; gives the name of this one if it has lines.
    pub fn pass_over(&mut self, name: Vec<u8>) -> Result<Option<String>, ParseError> {
        let mut has_lines = true;
        match &mut self.kind {
            Kind::Text(words) => {
                let first = words.peek();
                while words.peek().is_some_and(|word| !is_keyword(word)) {
                    words.next();
                }
                has_lines = first != Some(b"0");
            }
            Kind::Binary { .. } => self.skip_to_next()?,
        }
        Ok(has_lines.then(|| section_name(&name)))
    }

    fn skip_to_next(&mut self) -> Result<(), ParseError> {
        let Kind::Binary { bytes, at, order, next, .. } = &mut self.kind else { return Ok(()) };
        // Only onwards, so that it ends.
        match usize::try_from(*next).ok().filter(|&next| next >= at.at() && next <= bytes.len()) {
            Some(next) => *at = Binary::new(bytes, next, *order),
            None => {
                let expected = format!("the position of the next, {} to {}", at.at(), bytes.len());
                return Err(ParseError::invalid(at.place(), format!("a section before {next}"), expected));
            }
        }
        Ok(())
    }

    /// Where it is, for messages.
    pub fn place(&self) -> String {
        match &self.kind {
            Kind::Text(words) => words.place(),
            Kind::Binary { at, .. } => at.place(),
        }
    }

    /// Tells how far it is, and stops if that is asked for. To be called now and then.
    pub fn check(&mut self) -> Result<(), ParseError> {
        let at = match &self.kind {
            Kind::Text(words) => words.at(),
            Kind::Binary { at, .. } => at.at(),
        };
        if at > self.reported + PROGRESS_BYTES {
            self.progress.add((at - self.reported) as u64);
            self.progress.check()?;
            self.reported = at;
        }
        Ok(())
    }

    /// A number of 32 bits in every version.
    pub fn small(&mut self, what: &str) -> Result<i64, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => words.integer(what),
            Kind::Binary { at, .. } => at.number::<i32>(what).map(i64::from),
        }
    }

    /// A whole number.
    pub fn integer(&mut self, what: &str) -> Result<i64, ParseError> {
        match &mut self.kind {
            Kind::Binary { at, version: 4, .. } => at.number(what),
            _ => self.small(what),
        }
    }

    /// A real number.
    pub fn real(&mut self, what: &str) -> Result<f64, ParseError> {
        match &mut self.kind {
            Kind::Text(words) => words.real(what),
            Kind::Binary { at, version: 1, .. } => at.number::<f32>(what).map(f64::from),
            Kind::Binary { at, .. } => at.number(what),
        }
    }

    /// How many lines of so many numbers a section has, which the file must have room for.
    pub fn count(&mut self, integers: usize, reals: usize, what: &str) -> Result<usize, ParseError> {
        let count = self.integer(what)?;
        self.room(count, integers, reals, what)
    }

    /// Checks a count of lines of so many numbers each against what is left of the file.
    pub fn room(&self, count: i64, integers: usize, reals: usize, what: &str) -> Result<usize, ParseError> {
        let (left, integer_bytes, real_bytes) = match &self.kind {
            Kind::Text(words) => (words.rest().len() as u64 + 1, 2, 2),
            Kind::Binary { at, version, .. } => {
                (at.rest().len() as u64, if *version == 4 { 8 } else { 4 }, if *version == 1 { 4 } else { 8 })
            }
        };
        let bytes_each = integers as u64 * integer_bytes + reals as u64 * real_bytes;
        match u64::try_from(count) {
            Ok(found) if found.saturating_mul(bytes_each) <= left => Ok(found as usize),
            _ => Err(ParseError::invalid(self.place(), format!("{count} {what}"), "0 or more, and no more than the file has room for")),
        }
    }
}

/// Whether a word is no number, quoted text or sign.
fn is_keyword(word: &[u8]) -> bool {
    let is_number = |name: &[u8]| word.eq_ignore_ascii_case(name);
    word.first().is_some_and(u8::is_ascii_alphabetic) && !is_number(b"nan") && !is_number(b"inf") && !is_number(b"infinity")
}
