//! Numbers as text or binary.

use std::io::{self, Write};

/// Numbers as text or binary.
pub(super) struct Out<'a> {
    out: &'a mut dyn Write,
    is_binary: bool,
    /// What is not written yet.
    line: Vec<u8>,
}

impl<'a> Out<'a> {
    /// Text, or binary numbers with the least significant byte first.
    pub fn new(out: &'a mut dyn Write, is_binary: bool) -> Self {
        Out { out, is_binary, line: Vec::new() }
    }

    /// Text as it is.
    pub fn text(&mut self, text: &str) -> io::Result<()> {
        self.out.write_all(text.as_bytes())
    }

    /// A number of 32 bits.
    pub fn int(&mut self, n: i32) {
        if self.is_binary {
            self.line.extend(n.to_le_bytes());
        } else {
            let _ = write!(self.line, "{n} ");
        }
    }

    /// A number of the width of counts.
    pub fn size(&mut self, n: usize) {
        if self.is_binary {
            self.line.extend((n as u64).to_le_bytes());
        } else {
            let _ = write!(self.line, "{n} ");
        }
    }

    /// A real number.
    pub fn real(&mut self, n: f64) {
        if self.is_binary {
            self.line.extend(n.to_le_bytes());
        } else {
            let _ = write!(self.line, "{n:e} ");
        }
    }

    /// Writes what was put together: as text, a line.
    pub fn end_row(&mut self) -> io::Result<()> {
        if !self.is_binary && self.line.last() == Some(&b' ') {
            self.line.pop();
            self.line.push(b'\n');
        }
        self.out.write_all(&self.line)?;
        self.line.clear();
        Ok(())
    }

    /// Ends a line after binary numbers.
    pub fn end_line(&mut self) -> io::Result<()> {
        if self.is_binary {
            self.line.push(b'\n');
        }
        self.end_row()
    }

    /// Ends a section.
    pub fn end_section(&mut self, name: &str) -> io::Result<()> {
        self.end_line()?;
        self.text(&format!("$End{name}\n"))
    }
}
