//! The numbers of a PLOT3D file in their order: bytes, perhaps in Fortran records, or text.

use super::super::source::Source;
use super::super::vtu::number::{ByteOrder, ScalarType, append_binary};
use super::Plot3dError;
use super::layout::{Header, Layout};
use crate::mesh::Values;
use crate::progress::Progress;
use std::borrow::Cow;

/// Bytes by which text is told from binary.
const SNIFFED: u64 = 512;

/// A file of numbers.
pub(super) struct File<'a> {
    source: Source<'a>,
    /// All numbers, if they are text.
    text: Option<Vec<f64>>,
    place: String,
}

impl<'a> File<'a> {
    /// A file and what error messages call it. Text is read whole, into so many bytes at most.
    pub fn new(source: Source<'a>, place: String, memory_bytes: u64) -> Result<Self, Plot3dError> {
        let start = source.read(0, source.len().min(SNIFFED) as usize)?;
        let is_of_text = |b: &u8| b.is_ascii_whitespace() || b.is_ascii_digit() || b"+-.,*eEdD".contains(b);
        let is_text = !start.is_empty() && start.iter().all(is_of_text);
        let mut file = File { source, text: None, place };
        if is_text {
            file.text = Some(file.parse(memory_bytes / 8)?);
        }
        Ok(file)
    }

    /// Whether the numbers are text.
    pub fn is_text(&self) -> bool {
        self.text.is_some()
    }

    /// Length in bytes, or in numbers of text.
    pub fn len(&self) -> u64 {
        self.text.as_ref().map_or(self.source.len(), |numbers| numbers.len() as u64)
    }

    /// What error messages call it.
    pub fn place(&self) -> String {
        self.place.clone()
    }

    /// Integers of the header from `at` on, which then is behind them: a record of their own, if there are records. `None` if they are not
    /// there.
    pub fn integers(&self, layout: Layout, at: &mut u64, count: u64) -> Result<Option<Vec<i64>>, Plot3dError> {
        if let Some(numbers) = &self.text {
            let end = at.saturating_add(count);
            let Some(found) = numbers.get(*at as usize..end as usize) else { return Ok(None) };
            *at = end;
            return Ok(found.iter().map(|&n| (n.fract() == 0.0 && n.abs() < 1e15).then_some(n as i64)).collect());
        }
        let mark = if layout.has_records { 4 } else { 0 };
        let bytes = count.saturating_mul(4);
        if bytes.saturating_add(2 * mark) > self.source.len().saturating_sub(*at) {
            return Ok(None);
        }
        let read = self.source.read(*at, (bytes + 2 * mark) as usize)?;
        let all: Vec<i64> = read.chunks_exact(4).map(|word| i64::from(integer(word, layout.order))).collect();
        *at += bytes + 2 * mark;
        if !layout.has_records {
            return Ok(Some(all));
        }
        let is_record = all.first() == Some(&(bytes as i64)) && all.last() == Some(&(bytes as i64));
        Ok(is_record.then(|| all[1..all.len() - 1].to_vec()))
    }

    /// All numbers of text: between blanks or commas, `3*0.5` for three times 0.5, exponents with E or D.
    fn parse(&self, most: u64) -> Result<Vec<f64>, Plot3dError> {
        let bytes: Cow<'_, [u8]> = self.source.read(0, usize::try_from(self.source.len()).unwrap_or(usize::MAX))?;
        let mut numbers = Vec::new();
        let mut at = 0;
        for token in bytes.split(|b| b.is_ascii_whitespace() || *b == b',') {
            if !token.is_empty() {
                let bad = || Plot3dError::Text {
                    place: self.place.clone(),
                    found: String::from_utf8_lossy(&token[..token.len().min(40)]).into_owned(),
                    at: at as u64,
                };
                let (times, value) = match token.iter().position(|&b| b == b'*') {
                    Some(star) => (number(&token[..star]).filter(|n| n.fract() == 0.0 && (1.0..=1e9).contains(n)), &token[star + 1..]),
                    None => (Some(1.0), token),
                };
                let (times, value) = times.zip(number(value)).ok_or_else(bad)?;
                // A few letters may stand for more memory than there is.
                if (numbers.len() as u64).saturating_add(times as u64) > most || numbers.try_reserve(times as usize).is_err() {
                    return Err(Plot3dError::Memory { place: self.place.clone(), limit: most.saturating_mul(8) });
                }
                numbers.extend(std::iter::repeat_n(value, times as usize));
            }
            at += token.len() + 1;
        }
        Ok(numbers)
    }
}

fn number(token: &[u8]) -> Option<f64> {
    fast_float2::parse(token).ok().or_else(|| {
        let text = std::str::from_utf8(token).ok()?.replace(['d', 'D'], "e");
        fast_float2::parse(text).ok()
    })
}

fn integer(word: &[u8], order: ByteOrder) -> i32 {
    let mut bytes = [0; 4];
    bytes.copy_from_slice(word);
    match order {
        ByteOrder::Little => i32::from_le_bytes(bytes),
        ByteOrder::Big => i32::from_be_bytes(bytes),
    }
}

/// Goes through the numbers behind a header, whose length has been checked.
pub(super) struct Reader<'a> {
    file: &'a File<'a>,
    layout: Layout,
    at: u64,
    /// The mark that ends the record begun.
    record: u64,
    progress: &'a Progress,
}

impl<'a> Reader<'a> {
    /// A reader of what the header describes.
    pub fn new(file: &'a File<'a>, header: &Header, progress: &'a Progress) -> Self {
        Reader { file, layout: header.layout, at: header.start, record: 0, progress }
    }

    /// Begins a record of so many floats and integers, if there are records.
    pub fn begin_record(&mut self, floats: usize, integers: usize) -> Result<(), Plot3dError> {
        self.record = floats as u64 * if self.layout.is_double { 8 } else { 4 } + integers as u64 * 4;
        self.mark()
    }

    /// Ends it.
    pub fn end_record(&mut self) -> Result<(), Plot3dError> {
        self.mark()
    }

    fn mark(&mut self) -> Result<(), Plot3dError> {
        if self.layout.has_records {
            let found = i64::from(integer(&self.file.source.read(self.at, 4)?, self.layout.order));
            if u64::try_from(found) != Ok(self.record) {
                return Err(Plot3dError::Record { place: self.file.place(), at: self.at, found, expected: self.record });
            }
            self.at += 4;
        }
        Ok(())
    }

    /// The next floats. Text gives f64.
    pub fn floats(&mut self, count: usize) -> Result<Values, Plot3dError> {
        self.progress.check()?;
        if let Some(numbers) = &self.file.text {
            return Ok(Values::F64(self.of_text(numbers, count).to_vec()));
        }
        let scalar = if self.layout.is_double { ScalarType::Float64 } else { ScalarType::Float32 };
        let bytes = self.file.source.read(self.at, count * scalar.size())?;
        self.at += bytes.len() as u64;
        self.progress.add(bytes.len() as u64);
        let fits = |result: Result<(), _>| result.unwrap_or_else(|_| unreachable!("any float is a float"));
        if self.layout.is_double {
            let mut out: Vec<f64> = Vec::new();
            fits(append_binary(&mut out, &bytes, scalar, self.layout.order));
            Ok(Values::F64(out))
        } else {
            let mut out: Vec<f32> = Vec::new();
            fits(append_binary(&mut out, &bytes, scalar, self.layout.order));
            Ok(Values::F32(out))
        }
    }

    /// The next integers.
    pub fn integers(&mut self, count: usize) -> Result<Vec<i64>, Plot3dError> {
        if let Some(numbers) = &self.file.text {
            return Ok(self.of_text(numbers, count).iter().map(|&n| n as i64).collect());
        }
        let bytes = self.file.source.read(self.at, count * 4)?;
        self.at += bytes.len() as u64;
        Ok(bytes.chunks_exact(4).map(|word| integer(word, self.layout.order).into()).collect())
    }

    fn of_text(&mut self, numbers: &'a [f64], count: usize) -> &'a [f64] {
        let start = self.at as usize;
        self.at += count as u64;
        &numbers[start..start + count]
    }
}
