//! An HDF5 file: data sets and attributes by path.

use super::{Budget, Numbers, error, limits, storage};
use crate::format::{ParseError, Source};
use crate::progress::Progress;
use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, H5Type, Hdf5File, SliceInfo, SliceInfoElem};
use std::ops::Range;

/// An open HDF5 file.
pub(in crate::format) struct Hdf<'a> {
    file: Hdf5File,
    budget: Budget,
    progress: &'a Progress,
}

/// Some rows of a data set.
#[derive(Debug)]
pub(in crate::format) struct Rows {
    /// How many numbers a row has.
    pub width: usize,
    /// The numbers, row by row.
    pub numbers: Numbers,
}

/// A data set, for messages.
pub(in crate::format) fn place(path: &str) -> String {
    format!("data set \"{path}\"")
}

impl<'a> Hdf<'a> {
    /// Reads the start of a file.
    pub fn open(source: &Source<'_>, progress: &'a Progress) -> Result<Self, ParseError> {
        let limits = limits(source.len());
        let budget = Budget::new(limits.max_read_bytes as u64);
        let file = Hdf5File::from_storage_with_options(storage(source)?, limits).map_err(|e| error("the header", e))?;
        Ok(Hdf { file, budget, progress })
    }

    /// A group, if there is one.
    pub fn group(&self, path: &str) -> Result<Option<Group>, ParseError> {
        found(self.file.group(path)).map_err(|e| error(&format!("group \"{path}\""), e))
    }

    /// The groups and the data sets in a group, none if there is no such group.
    pub fn names_in(&self, path: &str) -> Result<(Vec<String>, Vec<String>), ParseError> {
        let names = self.group(path)?.map(|group| group.member_names());
        names.transpose().map(Option::unwrap_or_default).map_err(|e| error(&format!("group \"{path}\""), e))
    }

    /// An attribute of a group that is text.
    pub fn text_of(&self, group: &str, attribute: &str) -> Result<Option<String>, ParseError> {
        let text = self.attribute(group, attribute)?.map(|attribute| attribute.read_string());
        let text = text.transpose().map_err(|e| error(&format!("attribute \"{attribute}\" of \"{group}\""), e))?;
        Ok(text.map(|text| text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned()))
    }

    /// An attribute of a group that is a number.
    pub fn number_of(&self, group: &str, attribute: &str) -> Result<Option<f64>, ParseError> {
        let number = self.attribute(group, attribute)?.map(|attribute| attribute.read_as_f64());
        number.transpose().map_err(|e| error(&format!("attribute \"{attribute}\" of \"{group}\""), e))
    }

    fn attribute(&self, group: &str, attribute: &str) -> Result<Option<Attribute>, ParseError> {
        let Some(group) = self.group(group)? else { return Ok(None) };
        found(group.attribute(attribute)).map_err(|e| error(&format!("attribute \"{attribute}\""), e))
    }

    /// A text that a data set has beside it: attribute `Attribute` of VTKHDF's arrays.
    pub fn text_beside(&self, path: &str, attribute: &str) -> Result<Option<String>, ParseError> {
        Ok(self.data_set(path)?.and_then(|set| set.attribute(attribute).ok()?.read_string().ok()))
    }

    fn data_set(&self, path: &str) -> Result<Option<Dataset>, ParseError> {
        found(self.file.dataset(path)).map_err(|e| error(&place(path), e))
    }

    /// The lengths of a data set along its dimensions; `None` if there is none at the path.
    pub fn shape(&self, path: &str) -> Result<Option<Vec<u64>>, ParseError> {
        Ok(self.data_set(path)?.map(|set| set.shape().to_vec()))
    }

    /// All rows of a data set; `None` if there is none at the path.
    pub fn all(&self, path: &str) -> Result<Option<Rows>, ParseError> {
        self.rows(path, None)
    }

    /// These rows of a data set, which must be there; `None` if there is none at the path.
    pub fn rows(&self, path: &str, range: Option<Range<usize>>) -> Result<Option<Rows>, ParseError> {
        let Some(set) = self.data_set(path)? else { return Ok(None) };
        let shape = set.shape();
        let count = shape.first().map_or(1, |&n| usize::try_from(n).unwrap_or(usize::MAX));
        let range = range.unwrap_or(0..count);
        if range.start > range.end || range.end > count {
            let found = format!("{count} rows");
            return Err(ParseError::invalid(place(path), found, format!("rows {} to {}", range.start, range.end)));
        }
        let rest = shape.get(1..).unwrap_or_default();
        let width = rest.iter().try_fold(1usize, |product, &n| product.checked_mul(usize::try_from(n).ok()?)).unwrap_or(usize::MAX);
        let size = set.raw_element_size().map_err(|e| error(&place(path), e))? as u64;
        self.budget.take(&[range.len() as u64, width as u64], size, &place(path))?;
        let numbers = if range.is_empty() || width == 0 { Numbers::Whole(Vec::new(), true) } else { numbers(&set, path, &range)? };
        self.progress.add((range.len() as u64).saturating_mul(width as u64).saturating_mul(size));
        self.progress.check()?;
        let expected = range.len().saturating_mul(width);
        if numbers.len() == expected {
            Ok(Some(Rows { width, numbers }))
        } else {
            Err(ParseError::invalid(place(path), format!("{} numbers", numbers.len()), format!("{expected} numbers")))
        }
    }

    /// Takes memory for so many numbers that are not in the file.
    pub fn take(&self, numbers: usize, place: &str) -> Result<(), ParseError> {
        self.budget.take(&[numbers as u64], 8, place)
    }
}

/// `None` for what is not there.
fn found<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    fn is_missing(error: &Error) -> bool {
        match error {
            Error::GroupNotFound(_) | Error::DatasetNotFound(_) | Error::AttributeNotFound(_) => true,
            Error::Context { source, .. } => is_missing(source),
            _ => false,
        }
    }
    match result {
        Ok(found) => Ok(Some(found)),
        Err(error) if is_missing(&error) => Ok(None),
        Err(error) => Err(error),
    }
}

fn numbers(set: &Dataset, path: &str, range: &Range<usize>) -> Result<Numbers, ParseError> {
    let numbers = match set.dtype() {
        Datatype::FixedPoint { size: 1, signed: true, .. } => typed(set, range).map(Numbers::small::<i8>),
        Datatype::FixedPoint { size: 1, signed: false, .. } => typed(set, range).map(Numbers::small::<u8>),
        Datatype::FixedPoint { size: 2, signed: true, .. } => typed(set, range).map(Numbers::small::<i16>),
        Datatype::FixedPoint { size: 2, signed: false, .. } => typed(set, range).map(Numbers::small::<u16>),
        Datatype::FixedPoint { size: 4, signed: true, .. } => typed(set, range).map(Numbers::whole::<i32>),
        Datatype::FixedPoint { size: 4, signed: false, .. } => typed(set, range).map(Numbers::whole::<u32>),
        Datatype::FixedPoint { size: 8, signed: true, .. } => typed(set, range).map(|v| Numbers::Whole(v, false)),
        Datatype::FixedPoint { size: 8, signed: false, .. } => typed(set, range).map(Numbers::unsigned),
        Datatype::FloatingPoint { size: 4, .. } => typed(set, range).map(Numbers::F32),
        Datatype::FloatingPoint { size: 8, .. } => typed(set, range).map(Numbers::F64),
        other => return Err(ParseError::invalid(place(path), type_name(other), "numbers of 8 to 64 bits")),
    };
    numbers.map_err(|e| error(&place(path), e))
}

fn type_name(datatype: &Datatype) -> String {
    let text = format!("{datatype:?}");
    format!("type {}", text.split([' ', '(', '{']).next().unwrap_or_default())
}

fn typed<T: H5Type>(set: &Dataset, range: &Range<usize>) -> Result<Vec<T>, Error> {
    let dimensions = set.ndim();
    if dimensions == 0 {
        return Ok(set.read_array::<T>()?.into_raw_vec_and_offset().0);
    }
    let first = SliceInfoElem::Slice { start: range.start as u64, end: range.end as u64, step: 1 };
    let all = SliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 };
    let selections = std::iter::once(first).chain(vec![all; dimensions - 1]).collect();
    Ok(set.read_slice::<T>(&SliceInfo { selections })?.into_raw_vec_and_offset().0)
}
