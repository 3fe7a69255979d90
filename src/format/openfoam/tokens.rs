//! A file of an OpenFOAM case as tokens: header, entries, lists of numbers in text or as they lie in memory.

use super::super::parse::{Binary, ParseError, Plain, real, shown};
use super::super::vtu::number::ByteOrder;
use crate::mesh::{TooManyCellPoints, Values};
use crate::progress::Progress;

/// Numbers between two looks at whether to stop.
const CHECKED: usize = 1 << 16;

/// What the `FoamFile` entry at the start says.
#[derive(Debug, Clone)]
pub(super) struct Header {
    /// What the file holds: `faceCompactList`, `volScalarField`.
    pub class: String,
    is_binary: bool,
    order: ByteOrder,
    /// Bytes a label and a scalar may have in binary lists. Files before OpenFOAM 3 do not say; then the list's end tells.
    label: &'static [usize],
    scalar: &'static [usize],
}

/// Goes through a file token by token. Comments are blanks.
#[derive(Debug, Clone)]
pub(super) struct Tokens<'a> {
    bytes: &'a [u8],
    at: usize,
    /// What the file says of itself.
    pub header: Header,
}

impl<'a> Tokens<'a> {
    /// From the start of a file, behind its header.
    pub fn open(bytes: &'a [u8]) -> Result<Self, ParseError> {
        let header = Header { class: String::new(), is_binary: false, order: ByteOrder::Little, label: &[4, 8], scalar: &[8, 4] };
        let mut tokens = Tokens { bytes, at: 0, header };
        let word = tokens.word();
        if word != b"FoamFile" {
            return Err(tokens.bad(word, "the header FoamFile { .. }"));
        }
        tokens.expect(b'{')?;
        while !tokens.take(b'}') {
            let key = tokens.word();
            let value = tokens.value()?;
            match key {
                b"class" => tokens.header.class = String::from_utf8_lossy(value).into_owned(),
                b"format" => {
                    tokens.header.is_binary = match value {
                        b"ascii" => false,
                        b"binary" => true,
                        _ => return Err(tokens.bad(value, "the format ascii or binary")),
                    }
                }
                b"arch" => tokens.architecture(value)?,
                b"" => return Err(tokens.bad(key, "an entry of the header")),
                _ => {}
            }
        }
        Ok(tokens)
    }

    /// `"LSB;label=32;scalar=64"`.
    fn architecture(&mut self, text: &[u8]) -> Result<(), ParseError> {
        for part in text.split(|&b| b == b';' || b == b'"') {
            match part.trim_ascii() {
                b"LSB" => self.header.order = ByteOrder::Little,
                b"MSB" => self.header.order = ByteOrder::Big,
                b"label=32" => self.header.label = &[4],
                b"label=64" => self.header.label = &[8],
                b"scalar=32" => self.header.scalar = &[4],
                b"scalar=64" => self.header.scalar = &[8],
                b"" => {}
                other => return Err(self.bad(other, "LSB, MSB, label=32, label=64, scalar=32 or scalar=64")),
            }
        }
        Ok(())
    }

    /// Where it is, for messages.
    pub fn place(&self) -> String {
        if self.header.is_binary {
            return format!("byte {}", self.at);
        }
        format!("line {}", 1 + self.bytes[..self.at].iter().filter(|&&b| b == b'\n').count())
    }

    /// An error about what was found here.
    pub fn bad(&self, found: &[u8], expected: &str) -> ParseError {
        let found = if found.is_empty() { &self.bytes[self.at..] } else { found };
        let found = if found.is_empty() { "the end of the file".into() } else { shown(&found[..found.len().min(40)]) };
        ParseError::invalid(self.place(), found, expected)
    }

    fn skip_blanks(&mut self) {
        loop {
            let rest = &self.bytes[self.at..];
            match rest {
                [b, ..] if b.is_ascii_whitespace() => self.at += 1,
                [b'/', b'/', ..] => self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len()),
                [b'/', b'*', ..] => self.at += rest[2..].windows(2).position(|pair| pair == b"*/").map_or(rest.len(), |end| end + 4),
                _ => return,
            }
        }
    }

    /// The byte that the next token begins with; 0 at the end.
    pub fn peek(&mut self) -> u8 {
        self.skip_blanks();
        self.bytes.get(self.at).copied().unwrap_or(0)
    }

    /// Whether the next token is this sign, which it then goes behind.
    pub fn take(&mut self, sign: u8) -> bool {
        let is_next = self.peek() == sign;
        self.at += usize::from(is_next);
        is_next
    }

    /// Goes behind a sign, which must be next.
    pub fn expect(&mut self, sign: u8) -> Result<(), ParseError> {
        if self.take(sign) { Ok(()) } else { Err(self.bad(b"", &format!("\"{}\"", char::from(sign)))) }
    }

    /// The next word, which signs and blanks end; empty if a sign is next.
    pub fn word(&mut self) -> &'a [u8] {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let len = match rest {
            [b'"', ..] => rest[1..].iter().position(|&b| b == b'"').map_or(rest.len(), |end| end + 2),
            _ => rest.iter().position(|&b| b.is_ascii_whitespace() || b"(){};\"".contains(&b)).unwrap_or(rest.len()),
        };
        self.at += len;
        &rest[..len]
    }

    /// What stands up to the `;` that ends an entry.
    fn value(&mut self) -> Result<&'a [u8], ParseError> {
        self.skip_blanks();
        let start = self.at;
        let mut depth = 0_usize;
        loop {
            match self.peek() {
                b';' if depth == 0 => break,
                0 if self.at >= self.bytes.len() => return Err(self.bad(b"", "\";\"")),
                b'(' | b'{' => (self.at, depth) = (self.at + 1, depth + 1),
                b')' | b'}' if depth == 0 => return Err(self.bad(b"", "\";\"")),
                b')' | b'}' => (self.at, depth) = (self.at + 1, depth - 1),
                b';' => self.at += 1,
                _ => _ = self.word(),
            }
        }
        let value = self.bytes[start..self.at].trim_ascii();
        self.at += 1;
        Ok(value)
    }

    /// Goes behind the `;` of an entry whose name was read.
    pub fn skip_value(&mut self) -> Result<(), ParseError> {
        self.value().map(|_| ())
    }

    /// Goes to the value of an entry of the file, past those before it; whether there is such an entry.
    pub fn find(&mut self, key: &[u8]) -> Result<bool, ParseError> {
        loop {
            let found = self.word();
            match found {
                found if found == key => return Ok(true),
                b"" if self.at >= self.bytes.len() => return Ok(false),
                b"" => return Err(self.bad(b"", "an entry")),
                [b'#', ..] => {
                    let rest = &self.bytes[self.at..];
                    self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
                }
                _ if self.peek() == b'{' => self.skip_block()?,
                _ => _ = self.value()?,
            }
        }
    }

    /// Goes behind a block in braces.
    fn skip_block(&mut self) -> Result<(), ParseError> {
        let mut depth = 0_usize;
        loop {
            match self.peek() {
                b'{' => depth += 1,
                b'}' => depth = depth.saturating_sub(1),
                0 if self.at >= self.bytes.len() => return Err(self.bad(b"", "\"}\"")),
                b'(' | b')' | b';' => {}
                _ => {
                    _ = self.word();
                    continue;
                }
            }
            self.at += 1;
            if depth == 0 {
                return Ok(());
            }
        }
    }

    /// A whole number in text.
    fn integer(&mut self, expected: &str) -> Result<i64, ParseError> {
        let word = self.word();
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.bad(word, expected))
    }

    /// A number in text.
    pub fn real(&mut self, expected: &str) -> Result<f64, ParseError> {
        let word = self.word();
        real(word).ok_or_else(|| self.bad(word, expected))
    }

    /// A tuple in text, in parentheses if it has several components, added to `values`.
    fn tuple(&mut self, components: usize, what: &str, values: &mut Vec<f64>) -> Result<(), ParseError> {
        let has_parentheses = components > 1 || self.peek() == b'(';
        if has_parentheses {
            self.expect(b'(')?;
        }
        for _ in 0..components {
            values.push(self.real(what)?);
        }
        if has_parentheses { self.expect(b')') } else { Ok(()) }
    }

    /// A value in text that stands for `count` tuples.
    pub fn uniform(&mut self, components: usize, count: usize, what: &str) -> Result<Values, ParseError> {
        let mut one = Vec::with_capacity(components);
        self.tuple(components, what, &mut one)?;
        Ok(Values::F64(one.repeat(count)))
    }

    /// How many items a list has, at most `most`; `None` if it does not say.
    fn count(&mut self, most: usize, what: &str) -> Result<Option<usize>, ParseError> {
        if self.peek() == b'(' {
            return Ok(None);
        }
        let count = self.integer(&format!("a count of {what}"))?;
        let found = usize::try_from(count).ok().filter(|&count| count <= most);
        found.map(Some).ok_or_else(|| ParseError::invalid(self.place(), format!("{count} {what}"), format!("at most {most}")))
    }

    /// How many items a list of `least` bytes an item can have.
    pub fn room(&self, least: usize) -> usize {
        (self.bytes.len() - self.at) / least
    }

    /// The numbers of a binary list, and the bytes that each has.
    fn block(&mut self, count: usize, sizes: &[usize], what: &str) -> Result<(&'a [u8], usize), ParseError> {
        self.expect(b'(')?;
        let rest = &self.bytes[self.at..];
        let fits = |size: usize| count.checked_mul(size).is_some_and(|len| rest.get(len) == Some(&b')'));
        let Some(size) = sizes.iter().copied().find(|&size| fits(size)) else {
            let sizes: Vec<String> = sizes.iter().map(usize::to_string).collect();
            let expected = format!("{count} {what} of {} bytes each and then \")\"", sizes.join(" or "));
            return Err(ParseError::invalid(self.place(), format!("{} bytes to the end of the file", rest.len()), expected));
        };
        self.at += count * size + 1;
        Ok((&rest[..count * size], size))
    }

    /// A list of labels, at most `most`; -1 becomes [`u32::MAX`].
    pub fn labels(&mut self, most: usize, what: &str, progress: &Progress) -> Result<Vec<u32>, ParseError> {
        let count = self.count(most, what)?;
        if self.header.is_binary {
            // A list without items may have no parentheses.
            let Some(count) = count.filter(|&count| count > 0 || self.peek() == b'(') else { return Ok(vec![]) };
            let (bytes, size) = self.block(count, self.header.label, what)?;
            let order = self.header.order;
            let label = |bytes: &[u8]| if size == 4 { i64::from(i32::from_bytes(bytes, order)) } else { i64::from_bytes(bytes, order) };
            return bytes.chunks_exact(size).map(|bytes| self.label(label(bytes), what)).collect();
        }
        if let (Some(count), b'{') = (count, self.peek()) {
            self.expect(b'{')?;
            let value = self.integer(what)?;
            self.expect(b'}')?;
            return Ok(vec![self.label(value, what)?; count]);
        }
        let mut labels = Vec::with_capacity(count.unwrap_or(0).min(self.room(2)));
        self.expect(b'(')?;
        while !self.take(b')') {
            if labels.len() == most {
                return Err(self.bad(b"", &format!("\")\" after {most} {what}")));
            }
            let value = self.integer(what)?;
            labels.push(self.label(value, what)?);
            if labels.len().is_multiple_of(CHECKED) {
                progress.check()?;
            }
        }
        self.as_counted(count, labels.len(), what)?;
        Ok(labels)
    }

    fn label(&self, value: i64, what: &str) -> Result<u32, ParseError> {
        let label = if value == -1 { Some(u32::MAX) } else { u32::try_from(value).ok().filter(|&label| label < u32::MAX) };
        label.ok_or_else(|| ParseError::invalid(self.place(), format!("{what} {value}"), format!("0 to {}", u32::MAX - 1)))
    }

    fn as_counted(&self, count: Option<usize>, found: usize, what: &str) -> Result<(), ParseError> {
        match count {
            Some(count) if count != found => {
                Err(ParseError::invalid(self.place(), format!("a list of {found} {what}"), format!("{count}, as it says")))
            }
            _ => Ok(()),
        }
    }

    /// A list of tuples of numbers, at most `most` tuples.
    pub fn scalars(&mut self, components: usize, most: usize, what: &str, progress: &Progress) -> Result<Values, ParseError> {
        let count = self.count(most, what)?;
        if self.header.is_binary {
            let Some(count) = count.filter(|&count| count > 0 || self.peek() == b'(') else { return Ok(Values::F64(vec![])) };
            if self.peek() == b'(' {
                let numbers = count.saturating_mul(components);
                let (bytes, size) = self.block(numbers, self.header.scalar, what)?;
                let mut binary = Binary::new(bytes, 0, self.header.order);
                let values =
                    if size == 4 { Values::F32(binary.numbers(numbers, what)?) } else { Values::F64(binary.numbers(numbers, what)?) };
                return Ok(values);
            }
        }
        if let (Some(count), b'{') = (count, self.peek()) {
            self.expect(b'{')?;
            let values = self.uniform(components, count, what)?;
            self.expect(b'}')?;
            return Ok(values);
        }
        let mut values = Vec::with_capacity(count.unwrap_or(0).min(self.room(2 * components)) * components);
        self.expect(b'(')?;
        let mut tuples = 0_usize;
        while !self.take(b')') {
            if tuples == most {
                return Err(self.bad(b"", &format!("\")\" after {most} {what}")));
            }
            self.tuple(components, what, &mut values)?;
            tuples += 1;
            if tuples.is_multiple_of(CHECKED) {
                progress.check()?;
            }
        }
        self.as_counted(count, tuples, what)?;
        Ok(Values::F64(values))
    }

    /// The faces of a mesh: where each ends in the points of all, and these.
    pub fn faces(&mut self, progress: &Progress) -> Result<(Vec<u32>, Vec<u32>), ParseError> {
        if self.header.class == "faceCompactList" {
            let starts = self.labels(self.room(1), "ends of faces", progress)?;
            let points = self.labels(self.room(1), "points of faces", progress)?;
            let is_sound = starts.first().is_none_or(|&first| first == 0)
                && starts.is_sorted()
                && starts.last().is_none_or(|&last| last as usize == points.len());
            if !is_sound {
                let expected = format!("numbers that rise from 0 to {}, how many points the faces have", points.len());
                return Err(ParseError::invalid("its first list", "other numbers", expected));
            }
            return Ok((starts.get(1..).unwrap_or_default().to_vec(), points));
        }
        let count = self.count(self.room(2), "faces")?;
        let (mut ends, mut points) = (Vec::with_capacity(count.unwrap_or(0)), Vec::new());
        self.expect(b'(')?;
        while !self.take(b')') {
            points.extend(self.labels(self.room(1), "points of a face", progress)?);
            // Short forms of equal numbers could name more points than the file is long.
            let end = u32::try_from(points.len()).ok().filter(|_| points.len() <= self.bytes.len());
            ends.push(end.ok_or(TooManyCellPoints)?);
            if ends.len().is_multiple_of(CHECKED) {
                progress.check()?;
            }
        }
        self.as_counted(count, ends.len(), "faces")?;
        Ok((ends, points))
    }
}
