//! The numbers of a data set, whatever type the file stores them in.

use crate::format::ParseError;
use crate::mesh::Values;
use std::cell::Cell;

/// Numbers of a data set, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::format) enum Numbers {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
    /// Whole numbers, and whether every number of their type is one of f32 too.
    Whole(Vec<i64>, bool),
}

impl Numbers {
    /// From whole numbers of up to 16 bits.
    pub fn small<T: Into<i64>>(numbers: Vec<T>) -> Self {
        Numbers::Whole(numbers.into_iter().map(T::into).collect(), true)
    }

    /// From whole numbers of 32 bits.
    pub fn whole<T: Into<i64>>(numbers: Vec<T>) -> Self {
        Numbers::Whole(numbers.into_iter().map(T::into).collect(), false)
    }

    /// From whole numbers of 64 bits without a sign; as floats where one is too large for i64.
    pub fn unsigned(numbers: Vec<u64>) -> Self {
        let whole: Option<Vec<i64>> = numbers.iter().map(|&number| number.try_into().ok()).collect();
        whole.map_or_else(|| Numbers::F64(numbers.iter().map(|&number| number as f64).collect()), |whole| Numbers::Whole(whole, false))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Numbers::F32(v) => v.len(),
            Numbers::F64(v) => v.len(),
            Numbers::Whole(v, _) => v.len(),
        }
    }

    /// As values of an array.
    pub fn values(self) -> Values {
        match self {
            Numbers::F32(v) => Values::F32(v),
            Numbers::F64(v) => Values::F64(v),
            Numbers::Whole(v, true) => Values::F32(v.into_iter().map(|number| number as f32).collect()),
            Numbers::Whole(v, false) => Values::F64(v.into_iter().map(|number| number as f64).collect()),
        }
    }

    /// As 64-bit floats.
    pub fn reals(self) -> Vec<f64> {
        match self {
            Numbers::F32(v) => v.into_iter().map(f64::from).collect(),
            Numbers::F64(v) => v,
            Numbers::Whole(v, _) => v.into_iter().map(|number| number as f64).collect(),
        }
    }

    /// As whole numbers, which they must be; `place` is where they stand.
    pub fn integers(self, place: &str) -> Result<Vec<i64>, ParseError> {
        match self {
            Numbers::Whole(v, _) => Ok(v),
            _ => Err(ParseError::invalid(place, "floating-point numbers", "whole numbers")),
        }
    }

    /// As counts or offsets, from 0; `place` is where they stand.
    pub fn counts(self, place: &str) -> Result<Vec<usize>, ParseError> {
        let count =
            |number: i64| usize::try_from(number).map_err(|_| ParseError::invalid(place, number.to_string(), "counts and offsets from 0"));
        self.integers(place)?.into_iter().map(count).collect()
    }

    /// As indices of points, from 0 once `first` is taken from them; `place` is where they stand.
    pub fn points(self, first: i64, place: &str) -> Result<Vec<u32>, ParseError> {
        let expected = || format!("numbers of points from {first} to {}", i64::from(u32::MAX) + first);
        let index = |number: i64| {
            let index = number.checked_sub(first).and_then(|index| u32::try_from(index).ok());
            index.ok_or_else(|| ParseError::invalid(place, number.to_string(), expected()))
        };
        self.integers(place)?.into_iter().map(index).collect()
    }
}

/// Values that are put together piece by piece: 32-bit floats as long as all pieces are.
#[derive(Debug, Clone)]
pub(in crate::format) struct Pieces(Values);

impl Pieces {
    /// None yet.
    pub fn new() -> Self {
        Pieces(Values::F32(Vec::new()))
    }

    /// Adds numbers.
    pub fn append(&mut self, more: Values) {
        match (&mut self.0, more) {
            (Values::F32(all), Values::F32(more)) if all.is_empty() => *all = more,
            (Values::F32(all), Values::F32(more)) => all.extend_from_slice(&more),
            (Values::F64(all), Values::F64(more)) => all.extend_from_slice(&more),
            (Values::F64(all), Values::F32(more)) => all.extend(more.into_iter().map(f64::from)),
            (Values::F32(all), Values::F64(more)) => {
                let widened = all.iter().map(|&number| f64::from(number));
                self.0 = Values::F64(if all.is_empty() { more } else { widened.chain(more).collect() });
            }
        }
    }

    /// Adds numbers that are missing, until there are so many.
    pub fn fill_to(&mut self, len: usize) {
        match &mut self.0 {
            Values::F32(all) => all.resize(len, f32::NAN),
            Values::F64(all) => all.resize(len, f64::NAN),
        }
    }

    /// All of them.
    pub fn values(self) -> Values {
        self.0
    }
}

/// Bytes that may still be read from a file: a small one cannot claim, by data sets that overlap or are nearly all empty, more memory
/// than its size can account for.
#[derive(Debug)]
pub(in crate::format) struct Budget(Cell<u64>);

impl Budget {
    /// So many bytes.
    pub fn new(bytes: u64) -> Self {
        Budget(Cell::new(bytes))
    }

    /// Takes what a data set of a shape needs; `place` is which.
    pub fn take(&self, shape: &[u64], bytes_each: u64, place: &str) -> Result<(), ParseError> {
        // Numbers are held in eight bytes at most, whatever their size in the file.
        let wanted = shape.iter().try_fold(bytes_each.max(8), |product, &n| product.checked_mul(n));
        let left = wanted.and_then(|wanted| self.0.get().checked_sub(wanted));
        let found = || format!("shape {shape:?} of {bytes_each} bytes each");
        self.0.set(left.ok_or_else(|| ParseError::invalid(place, found(), "no more data than the file has room for"))?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_widen_where_they_must_and_miss_what_is_not_there() {
        let mut pieces = Pieces::new();
        pieces.append(Values::F32(vec![1.0]));
        pieces.fill_to(2);
        pieces.append(Values::F64(vec![0.1]));
        pieces.append(Values::F32(vec![3.0]));
        pieces.fill_to(5);
        let Values::F64(values) = pieces.values() else { panic!("not widened") };
        assert!(values[1].is_nan() && values[4].is_nan());
        assert_eq!((values[0], values[2], values[3]), (1.0, 0.1, 3.0));
    }

    #[test]
    fn numbers_keep_what_their_type_holds() {
        assert_eq!(Numbers::small(vec![200u8, 1]).values(), Values::F32(vec![200.0, 1.0]));
        assert_eq!(Numbers::whole(vec![i32::MAX]).values(), Values::F64(vec![2_147_483_647.0]));
        assert_eq!(Numbers::unsigned(vec![u64::MAX]), Numbers::F64(vec![u64::MAX as f64]));
        assert_eq!(Numbers::whole(vec![1, 4_000]).points(1, "here").ok(), Some(vec![0, 3_999]));
        let error = Numbers::whole(vec![1, 0]).points(1, "here").expect_err("no point 0").to_string();
        assert_eq!(error, "here: 0, expected numbers of points from 1 to 4294967296");
        assert!(Numbers::Whole(vec![i64::MIN], false).points(1, "here").is_err());
        assert!(Numbers::F32(vec![1.0]).counts("here").is_err() && Numbers::whole(vec![-1]).counts("here").is_err());
    }

    #[test]
    fn a_budget_ends() {
        let budget = Budget::new(100);
        assert!(budget.take(&[5, 2], 8, "x").is_ok() && budget.take(&[2, 1], 4, "x").is_ok() && budget.take(&[1], 1, "x").is_err());
        assert!(Budget::new(u64::MAX).take(&[u64::MAX, 2], 8, "x").is_err());
    }
}
