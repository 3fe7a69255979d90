//! Goes through a legacy file by its keywords.

use super::{Array, Dataset, Head, LINE_LIMIT, List, TYPES};
use crate::format::source::Source;
use crate::format::voxel_data::{VolumeError, numbers};
use crate::format::vtu::number::ScalarType;
use glam::DVec3;

/// The lines of a file.
pub(super) struct Lines<'a> {
    pub source: &'a Source<'a>,
    pub at: u64,
}

impl Lines<'_> {
    /// The next line; `None` at the end.
    pub fn next(&mut self) -> Result<Option<String>, VolumeError> {
        let len = (self.source.len() - self.at).min(LINE_LIMIT) as usize;
        let bytes = self.source.read(self.at, len)?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let end = bytes.iter().position(|&b| b == b'\n');
        if end.is_none() && bytes.len() as u64 == LINE_LIMIT {
            let start = String::from_utf8_lossy(&bytes[..40]).into_owned();
            return Err(VolumeError::key(&format!("the line at byte {}", self.at), &start, format!("at most {LINE_LIMIT} characters")));
        }
        self.at += end.map_or(bytes.len(), |end| end + 1) as u64;
        Ok(Some(String::from_utf8_lossy(&bytes[..end.unwrap_or(bytes.len())]).trim().to_owned()))
    }

    /// Passes over `count` words between blanks.
    fn skip_words(&mut self, count: u64, array: &str) -> Result<(), VolumeError> {
        let (mut left, mut in_word) = (count, false);
        while left > 0 || in_word {
            let bytes = self.source.read(self.at, (self.source.len() - self.at).min(1 << 20) as usize)?;
            if bytes.is_empty() {
                let (found, expected) = (count - left, format!("{count} numbers"));
                return if left == 0 {
                    Ok(())
                } else {
                    Err(VolumeError::key(&format!("array \"{array}\""), &format!("{found} numbers"), expected))
                };
            }
            let mut used = 0;
            for &b in bytes.iter() {
                match (b.is_ascii_whitespace(), in_word) {
                    (false, false) if left == 0 => break,
                    (false, false) => (in_word, left) = (true, left - 1),
                    (true, true) => in_word = false,
                    _ => {}
                }
                used += 1;
                if left == 0 && !in_word {
                    break;
                }
            }
            self.at += used;
        }
        Ok(())
    }
}

/// Goes through a file by its keywords and notes where arrays lie.
pub(super) struct Walker<'a> {
    pub lines: Lines<'a>,
    pub is_binary: bool,
    pub head: Head,
    pub arrays: Vec<Array>,
}

impl Walker<'_> {
    pub fn walk(mut self) -> Result<(Head, Vec<Array>), VolumeError> {
        let (mut tuples, mut is_of_cells) = (None, false);
        while let Some(line) = self.lines.next()? {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let Some(keyword) = words.first().map(|word| word.to_uppercase()) else { continue };
            let rest = line[words[0].len()..].trim();
            match (keyword.as_str(), tuples) {
                ("DATASET", _) => {
                    let known = Dataset::NAMES.iter().find(|(name, _)| rest.eq_ignore_ascii_case(name));
                    let expected = || format!("{}, which octetra reads in .vtk files", Dataset::NAMES.map(|(name, _)| name).join(", "));
                    self.head.dataset = known.ok_or_else(|| VolumeError::key("DATASET", rest, expected()))?.1;
                }
                ("POINTS" | "X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES", _) if self.head.dataset != Dataset::StructuredPoints => {
                    let (components, bad) =
                        (if keyword == "POINTS" { 3 } else { 1 }, || VolumeError::key(&keyword, rest, "a count and a type"));
                    let count = words.get(1).and_then(|n| n.parse().ok()).ok_or_else(bad)?;
                    self.array(&keyword, words.get(2).ok_or_else(bad)?, components, count, false)?;
                    self.head.places.extend(self.arrays.pop());
                }
                ("CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS", _) => self.list(keyword, &words)?,
                ("CELL_TYPES", _) => {
                    let [count] = numbers::<u64, 1>(&keyword, rest, "an integer from 0")?;
                    self.array(&keyword, "int", 1, count, false)?;
                    self.head.types = self.arrays.pop();
                }
                ("DIMENSIONS", _) => self.head.dims = Some(numbers("DIMENSIONS", rest, "3 integers from 2")?),
                ("ORIGIN", _) => self.head.origin = Some(DVec3::from_array(numbers("ORIGIN", rest, "3 numbers")?)),
                ("SPACING" | "ASPECT_RATIO", _) => self.head.spacing = Some(DVec3::from_array(numbers("SPACING", rest, "3 numbers")?)),
                ("POINT_DATA" | "CELL_DATA", _) => {
                    let [count] = numbers::<u64, 1>(&keyword, rest, "an integer from 0")?;
                    (tuples, is_of_cells) = (Some(count), keyword == "CELL_DATA");
                }
                ("METADATA", _) => while self.lines.next()?.is_some_and(|line| !line.is_empty()) {},
                ("FIELD", tuples) => self.field(&words, tuples.is_some(), is_of_cells)?,
                (_, Some(tuples)) => {
                    if !self.attribute(&keyword, &words, tuples, is_of_cells)? {
                        self.head.notes.push(format!("\"{line}\" is not known: it and what stands behind it were left out"));
                        break;
                    }
                }
                _ => {
                    let (name, _) = Dataset::NAMES.iter().find(|(_, dataset)| *dataset == self.head.dataset).unwrap_or(&Dataset::NAMES[0]);
                    return Err(VolumeError::key("the keyword", &line, format!("one of {name}")));
                }
            }
        }
        Ok((self.head, self.arrays))
    }

    /// A list of cells, as `NAME cells numbers` and then counted lists, or, from version 5, as `NAME offsets points` and two arrays.
    fn list(&mut self, keyword: String, words: &[&str]) -> Result<(), VolumeError> {
        let bad = || VolumeError::key(&keyword, &words.join(" "), "two counts");
        let count = |i: usize| words.get(i).and_then(|n| n.parse::<u64>().ok()).ok_or_else(bad);
        let (first, second) = (count(1)?, count(2)?);
        let start = self.lines.source.read(self.lines.at, (self.lines.source.len() - self.lines.at).min(7) as usize)?;
        let has_offsets = start.eq_ignore_ascii_case(b"OFFSETS");
        let typed = |walker: &mut Self, line: &str, name: &str, count: u64| {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                [found, type_name] if found.eq_ignore_ascii_case(name) => walker.array(name, type_name, 1, count, false),
                _ => Err(VolumeError::key(&keyword, line, format!("{name} and a type"))),
            }
        };
        let list = if has_offsets {
            let line = self.lines.next()?.unwrap_or_default();
            typed(self, &line, "OFFSETS", first)?;
            let line = loop {
                match self.lines.next()? {
                    Some(line) if line.is_empty() => {}
                    line => break line.unwrap_or_default(),
                }
            };
            typed(self, &line, "CONNECTIVITY", second)?;
            self.arrays.pop().zip(self.arrays.pop()).map(|(points, offsets)| List::Offsets(offsets, points))
        } else {
            self.array(&keyword, "int", 1, second, false)?;
            self.arrays.pop().map(|array| List::Counted(first, array))
        };
        self.head.lists.extend(list.map(|list| (keyword, list)));
        Ok(())
    }

    /// An array by its keyword; false if nothing is known of its size.
    fn attribute(&mut self, keyword: &str, words: &[&str], tuples: u64, is_of_cells: bool) -> Result<bool, VolumeError> {
        let word = |i: usize| words.get(i).copied().unwrap_or_default();
        let count = |i: usize| word(i).parse::<u64>().ok().filter(|n| (1..=1 << 20).contains(n));
        let (type_name, components) = match keyword {
            "SCALARS" if words.len() < 4 => (word(2), Some(1)),
            "SCALARS" => (word(2), count(3)),
            "VECTORS" | "NORMALS" => (word(2), Some(3)),
            "TENSORS" => (word(2), Some(9)),
            "TENSORS6" => (word(2), Some(6)),
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => (word(2), Some(1)),
            "TEXTURE_COORDINATES" => (word(3), count(2)),
            "COLOR_SCALARS" => (if self.is_binary { "unsigned_char" } else { "float" }, count(2)),
            "LOOKUP_TABLE" => {
                let size = count(2).ok_or_else(|| VolumeError::key(keyword, word(2), "a size"))?;
                self.pass(word(1), if self.is_binary { ScalarType::UInt8 } else { ScalarType::Float32 }, size * 4)?;
                return Ok(true);
            }
            _ => return Ok(false),
        };
        let components = components.ok_or_else(|| VolumeError::key(keyword, &words.join(" "), "a number of components"))?;
        if keyword == "SCALARS" {
            // The name of its table may follow.
            let at = self.lines.at;
            if !self.lines.next()?.is_some_and(|line| line.to_uppercase().starts_with("LOOKUP_TABLE")) {
                self.lines.at = at;
            }
        }
        self.array(word(1), type_name, components, tuples, is_of_cells)?;
        Ok(true)
    }

    /// `FIELD name count`, and that many arrays; those that belong to nothing are passed over.
    fn field(&mut self, words: &[&str], is_data: bool, is_of_cells: bool) -> Result<(), VolumeError> {
        let count = words.get(2).and_then(|n| n.parse::<u32>().ok());
        for _ in 0..count.ok_or_else(|| VolumeError::key("FIELD", &words.join(" "), "a name and a number of arrays"))? {
            let line = loop {
                match self.lines.next()? {
                    Some(line) if line.is_empty() => {}
                    Some(line) if line == "METADATA" => while self.lines.next()?.is_some_and(|line| !line.is_empty()) {},
                    Some(line) => break line,
                    None => return Err(VolumeError::key("FIELD", "at the end of the file", "as many arrays as it says")),
                }
            };
            let bad = || VolumeError::key("an array of FIELD", &line, "a name, a number of components and one of tuples, and a type");
            let [name, components, tuples, type_name] = line.split_ascii_whitespace().collect::<Vec<_>>().try_into().map_err(|_| bad())?;
            let (components, tuples) = components.parse().ok().zip(tuples.parse().ok()).ok_or_else(bad)?;
            let before = self.arrays.len();
            self.array(name, type_name, components, tuples, is_of_cells)?;
            if !is_data {
                self.arrays.truncate(before);
            }
        }
        Ok(())
    }

    /// Notes an array that begins here, and goes on behind it.
    fn array(&mut self, name: &str, type_name: &str, components: u64, tuples: u64, is_of_cells: bool) -> Result<(), VolumeError> {
        let name = &decoded(name);
        let start = self.lines.at;
        let count = components.checked_mul(tuples);
        let count = count.ok_or_else(|| VolumeError::key(&format!("the size of array \"{name}\""), &tuples.to_string(), "a count"))?;
        if self.pass_unread(name, &type_name.to_lowercase(), count)? {
            return Ok(());
        }
        let known = TYPES.iter().find(|(known, _)| known.eq_ignore_ascii_case(type_name));
        let expected = || TYPES.map(|(name, _)| name).join(", ");
        let &(_, scalar) = known.ok_or_else(|| VolumeError::key(&format!("the type of array \"{name}\""), type_name, expected()))?;
        self.pass(name, scalar, count)?;
        self.arrays.push(Array { name: name.to_owned(), scalar, components, tuples, is_of_cells, place: start..self.lines.at });
        Ok(())
    }

    /// Goes on behind text or bits, which are not read; false if it is neither.
    fn pass_unread(&mut self, name: &str, type_name: &str, count: u64) -> Result<bool, VolumeError> {
        match (type_name, self.is_binary) {
            ("bit", true) => self.skip(name, count.div_ceil(8))?,
            ("bit", false) => self.lines.skip_words(count, name)?,
            ("string", true) => {
                for _ in 0..count {
                    let length = self.string_length(name)?;
                    self.skip(name, length)?;
                }
            }
            ("string", false) => {
                for _ in 0..count {
                    let missing = || VolumeError::key(&format!("array \"{name}\""), "the end of the file", format!("{count} lines"));
                    self.lines.next()?.ok_or_else(missing)?;
                }
            }
            _ => return Ok(false),
        }
        self.head.notes.push(format!("array \"{name}\" is of the type {type_name} and was left out"));
        Ok(true)
    }

    /// The length of a text in bytes, as VTK writes it before the text: two bits say how many bytes it takes itself.
    fn string_length(&mut self, name: &str) -> Result<u64, VolumeError> {
        let first = self.bytes(name, 1)?[0];
        let more = match first >> 6 {
            3 => 0,
            2 => 1,
            1 => 3,
            _ => 7,
        };
        let rest = self.bytes(name, more)?;
        Ok(rest.iter().fold(u64::from(first & 63), |length, &byte| length << 8 | u64::from(byte)))
    }

    fn bytes(&mut self, name: &str, count: usize) -> Result<Vec<u8>, VolumeError> {
        let at = self.lines.at;
        self.skip(name, count as u64)?;
        Ok(self.lines.source.read(at, count)?.into_owned())
    }

    fn skip(&mut self, name: &str, bytes: u64) -> Result<(), VolumeError> {
        let left = self.lines.source.len() - self.lines.at;
        if bytes > left {
            return Err(VolumeError::key(&format!("array \"{name}\""), &format!("{left} bytes of data"), format!("{bytes}")));
        }
        self.lines.at += bytes;
        Ok(())
    }

    /// Goes on behind numbers.
    fn pass(&mut self, name: &str, scalar: ScalarType, count: u64) -> Result<(), VolumeError> {
        if !self.is_binary {
            return self.lines.skip_words(count, name);
        }
        self.skip(name, count.saturating_mul(scalar.size() as u64))
    }
}

/// A name as it is, where the file has `%20` for a blank and the like.
fn decoded(name: &str) -> String {
    let (mut bytes, mut rest) = (Vec::with_capacity(name.len()), name.as_bytes());
    while let Some((&byte, behind)) = rest.split_first() {
        let code = behind.get(..2).filter(|_| byte == b'%').and_then(|code| std::str::from_utf8(code).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(code) => (rest, _) = (&behind[2..], bytes.push(code)),
            None => (rest, _) = (behind, bytes.push(byte)),
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| name.to_owned())
}
