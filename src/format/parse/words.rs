//! A text as words and lines.

use super::{ParseError, shown};

/// Goes through a text word by word; knows the line it is in.
#[derive(Debug, Clone)]
pub(in crate::format) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The line of `at`, from 1.
    line: usize,
    /// What begins a comment that goes to the end of its line.
    comment: Option<u8>,
}

impl<'a> Words<'a> {
    /// From the start of a text.
    pub fn new(bytes: &'a [u8]) -> Self {
        Words { bytes, at: 0, line: 1, comment: None }
    }

    /// With comments, which are passed over as if they were blanks.
    pub fn with_comments(bytes: &'a [u8], start: u8) -> Self {
        Words { comment: Some(start), ..Words::new(bytes) }
    }

    /// Where it is, for messages: `line 12`.
    pub fn place(&self) -> String {
        format!("line {}", self.line)
    }

    /// The line it is in, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Bytes from the start of the text.
    pub fn at(&self) -> usize {
        self.at
    }

    /// Goes to a byte behind this one.
    pub fn skip_to(&mut self, at: usize) {
        let at = at.clamp(self.at, self.bytes.len());
        self.line += self.bytes[self.at..at].iter().filter(|&&b| b == b'\n').count();
        self.at = at;
    }

    /// What is left of the text.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next word between blanks; `None` at the end.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            match *self.bytes.get(self.at)? {
                b'\n' => (self.at, self.line) = (self.at + 1, self.line + 1),
                b if b.is_ascii_whitespace() => self.at += 1,
                b if Some(b) == self.comment => {
                    let rest = self.rest();
                    self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
                }
                _ => break,
            }
        }
        let rest = self.rest();
        let len = rest.iter().position(|&b| b.is_ascii_whitespace() || Some(b) == self.comment).unwrap_or(rest.len());
        self.at += len;
        Some(&rest[..len])
    }

    /// The next word without going on behind it.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().next()
    }

    /// What is left of the line, without blanks around it; goes to the start of the next. `None` at the end.
    pub fn rest_of_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|&b| b == b'\n');
        self.at += end.map_or(rest.len(), |end| end + 1);
        self.line += usize::from(end.is_some());
        let line = &rest[..end.unwrap_or(rest.len())];
        let line = &line[..self.comment.and_then(|start| line.iter().position(|&b| b == start)).unwrap_or(line.len())];
        Some(line.trim_ascii())
    }

    /// The next word, which must be there; `expected` says what it should be.
    pub fn word(&mut self, expected: &str) -> Result<&'a [u8], ParseError> {
        self.next().ok_or_else(|| ParseError::invalid(self.place(), "the end of the file", expected))
    }

    /// An error about the word that was read last.
    pub fn bad(&self, word: &[u8], expected: &str) -> ParseError {
        ParseError::invalid(self.place(), shown(word), expected)
    }

    /// A whole number.
    pub fn integer<T: std::str::FromStr>(&mut self, expected: &str) -> Result<T, ParseError> {
        let word = self.word(expected)?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.bad(word, expected))
    }

    /// A number, `nan` and `inf` too, the exponent after `e` or, as Fortran writes it, `d`.
    pub fn real(&mut self, expected: &str) -> Result<f64, ParseError> {
        let word = self.word(expected)?;
        real(word).ok_or_else(|| self.bad(word, expected))
    }

    /// A count of items that take at least so many bytes each, which the rest of the text must have room for: so a file cannot make its
    /// reader reserve more memory than it is long.
    pub fn count(&mut self, bytes_each: usize, expected: &str) -> Result<usize, ParseError> {
        let word = self.word(expected)?;
        let count: u64 = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()).ok_or_else(|| self.bad(word, expected))?;
        if count.saturating_mul(bytes_each as u64) > self.rest().len() as u64 + 1 {
            return Err(ParseError::invalid(self.place(), format!("{expected} {count}"), "no more than the file has room for"));
        }
        Ok(count as usize)
    }
}

/// A number in text.
pub(in crate::format) fn real(word: &[u8]) -> Option<f64> {
    fast_float2::parse(word).ok().or_else(|| {
        let fortran: Vec<u8> = word.iter().map(|&b| if matches!(b, b'd' | b'D') { b'e' } else { b }).collect();
        fast_float2::parse(&fortran).ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lines_and_numbers() {
        let mut words = Words::with_comments(b"a 12 % no\n\n-1.5d3 nan\r\nrest of it \nlast", b'%');
        assert_eq!(words.next(), Some(&b"a"[..]));
        assert_eq!(words.integer::<u32>("a number").ok(), Some(12));
        assert_eq!(words.real("a number").ok(), Some(-1500.0));
        assert!(words.real("a number").is_ok_and(f64::is_nan));
        assert_eq!((words.rest_of_line(), words.rest_of_line()), (Some(&b""[..]), Some(&b"rest of it"[..])));
        let error = words.integer::<u32>("a count").expect_err("a word").to_string();
        assert_eq!(error, "line 5: \"last\", expected a count");
        assert!(words.next().is_none() && words.word("more").is_err() && words.rest_of_line().is_none());
    }

    #[test]
    fn a_count_has_room() {
        assert_eq!(Words::new(b"3 1 2 3").count(2, "points").ok(), Some(3));
        let error = Words::new(b"4000000000 1 2 3").count(2, "points").expect_err("too many").to_string();
        assert!(error.contains("points 4000000000"), "{error}");
    }
}
