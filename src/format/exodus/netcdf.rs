//! The variables of a NetCDF file by name: classic ones (CDF-1, 2 and 5) and those of NetCDF-4, which are HDF5.

use crate::format::ParseError;
use crate::format::hdf::{self, Budget, Numbers};
use crate::format::source::Source;
use crate::progress::Progress;
use netcdf_reader::classic::data::NcReadType;
use netcdf_reader::{Error, NcFile, NcFormat, NcOpenOptions, NcSliceInfo, NcSliceInfoElem, NcType, NcVariable};
use std::collections::HashMap;

/// Bytes of memory that a byte of a classic file may claim: it is not compressed, but an array may be missing on most cells.
const CLASSIC_RATIO: u64 = 32;

/// An open NetCDF file.
pub(super) struct NetCdf<'a> {
    file: NcFile,
    /// Where in the file's list of variables each is.
    places: HashMap<String, usize>,
    budget: Budget,
    progress: &'a Progress,
}

impl<'a> NetCdf<'a> {
    /// Reads the header.
    pub fn open(source: &Source<'_>, progress: &'a Progress) -> Result<Self, ParseError> {
        let limits = hdf::limits(source.len());
        let options = NcOpenOptions {
            chunk_cache_bytes: limits.chunk_cache_bytes,
            max_chunk_bytes: limits.max_chunk_bytes,
            max_read_bytes: limits.max_read_bytes,
            max_object_header_bytes: limits.max_object_header_bytes,
            ..Default::default()
        };
        let file = NcFile::from_storage_with_options(hdf::storage(source)?, options).map_err(|e| error("the header", e))?;
        let is_classic = matches!(file.format(), NcFormat::Classic | NcFormat::Offset64 | NcFormat::Cdf5);
        let budget =
            if is_classic { source.len().saturating_mul(CLASSIC_RATIO).saturating_add(64 << 20) } else { limits.max_read_bytes as u64 };
        let variables = file.variables().map_err(|e| error("the header", e))?;
        let places = variables.iter().enumerate().map(|(i, variable)| (variable.name.clone(), i)).collect();
        Ok(NetCdf { file, places, budget: Budget::new(budget), progress })
    }

    /// The names of all variables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.places.keys().map(String::as_str)
    }

    /// Takes memory for so many numbers that are not in the file.
    pub fn take(&self, numbers: usize, place: &str) -> Result<(), ParseError> {
        self.budget.take(&[numbers as u64], 8, place)
    }

    /// A variable, if there is one of the name.
    pub fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.file.variables().ok()?.get(*self.places.get(name)?)
    }

    /// The length of a dimension; 0 if there is none of the name.
    pub fn dimension(&self, name: &str) -> usize {
        self.file.dimension(name).map_or(0, |dimension| usize::try_from(dimension.size).unwrap_or(usize::MAX))
    }

    /// An attribute of a variable that is text.
    pub fn text_of(&self, variable: &NcVariable, attribute: &str) -> String {
        let value = variable.attribute(attribute).and_then(|attribute| attribute.value.as_string());
        value.unwrap_or_default().trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned()
    }

    /// Texts, such as names of other variables; none if there is no such variable.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, ParseError> {
        let Some(variable) = self.variable(name) else { return Ok(Vec::new()) };
        self.budget.take(&variable.shape(), 1, &place(name))?;
        let texts = self.file.read_variable_as_strings(name).map_err(|e| error(&place(name), e))?;
        let trimmed = |text: String| text.split('\0').next().unwrap_or_default().trim().to_owned();
        Ok(texts.into_iter().map(trimmed).collect())
    }

    /// All numbers of a variable that must have so many; `None` if there is no such variable.
    pub fn all(&self, name: &str, len: usize) -> Result<Option<Numbers>, ParseError> {
        self.part(name, &[], len)
    }

    /// All numbers of a variable of any shape; `None` if there is no such variable.
    pub fn all_flat(&self, name: &str) -> Result<Option<Numbers>, ParseError> {
        let Some(variable) = self.variable(name) else { return Ok(None) };
        let len = variable.shape().iter().try_fold(1u64, |product, &n| product.checked_mul(n));
        self.all(name, len.and_then(|len| usize::try_from(len).ok()).unwrap_or(usize::MAX))
    }

    /// The numbers of a variable at these first indices, which must be so many; `None` if there is no such variable.
    pub fn part(&self, name: &str, at: &[usize], len: usize) -> Result<Option<Numbers>, ParseError> {
        let Some(variable) = self.variable(name) else { return Ok(None) };
        let (place, shape) = (place(name), variable.shape());
        let is_inside = at.len() <= shape.len() && at.iter().zip(&shape).all(|(&i, &n)| (i as u64) < n);
        let rest = shape.get(at.len()..).unwrap_or_default();
        let found = rest.iter().try_fold(1u64, |product, &n| product.checked_mul(n));
        if !is_inside || found != Some(len as u64) {
            let expected = format!("{len} numbers{}", if at.is_empty() { "" } else { " of one time step" });
            return Err(ParseError::invalid(place, format!("shape {shape:?}"), expected));
        }
        let bytes = variable.dtype.size().unwrap_or(1) as u64;
        self.budget.take(rest, bytes, &place)?;
        let all = NcSliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 };
        let first = at.iter().map(|&i| NcSliceInfoElem::Index(i as u64));
        let selection = NcSliceInfo { selections: first.chain(vec![all; rest.len()]).collect() };
        let numbers = if len == 0 { Numbers::Whole(Vec::new(), true) } else { self.numbers(variable, &selection)? };
        self.progress.add(bytes * len as u64);
        self.progress.check()?;
        if numbers.len() == len {
            Ok(Some(numbers))
        } else {
            Err(ParseError::invalid(place, format!("{} numbers", numbers.len()), format!("{len} numbers")))
        }
    }

    fn numbers(&self, variable: &NcVariable, selection: &NcSliceInfo) -> Result<Numbers, ParseError> {
        let name = variable.name();
        Ok(match &variable.dtype {
            NcType::Byte => Numbers::small(self.typed::<i8>(name, selection)?),
            NcType::UByte => Numbers::small(self.typed::<u8>(name, selection)?),
            NcType::Short => Numbers::small(self.typed::<i16>(name, selection)?),
            NcType::UShort => Numbers::small(self.typed::<u16>(name, selection)?),
            NcType::Int => Numbers::whole(self.typed::<i32>(name, selection)?),
            NcType::UInt => Numbers::whole(self.typed::<u32>(name, selection)?),
            NcType::Int64 => Numbers::Whole(self.typed::<i64>(name, selection)?, false),
            NcType::UInt64 => Numbers::unsigned(self.typed::<u64>(name, selection)?),
            NcType::Float => Numbers::F32(self.typed::<f32>(name, selection)?),
            NcType::Double => Numbers::F64(self.typed::<f64>(name, selection)?),
            other => return Err(ParseError::invalid(place(name), format!("type {other:?}"), "numbers")),
        })
    }

    fn typed<T: NcReadType + hdf5_reader::H5Type>(&self, name: &str, selection: &NcSliceInfo) -> Result<Vec<T>, ParseError> {
        let array = self.file.read_variable_slice::<T>(name, selection).map_err(|e| error(&place(name), e))?;
        Ok(array.into_raw_vec_and_offset().0)
    }
}

/// A variable, for messages.
pub(super) fn place(variable: &str) -> String {
    format!("variable \"{variable}\"")
}

fn error(place: &str, error: Error) -> ParseError {
    match error {
        Error::Io(error) => ParseError::Io(error),
        Error::Hdf5(error) => hdf::error(place, error),
        error => ParseError::invalid(place, error.to_string(), "a sound NetCDF file"),
    }
}
