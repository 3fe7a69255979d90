//! The sections `SolAtVertices`, `SolAtTetrahedra` and so on.

use super::super::parse::{ParseError, real_numbers};
use super::SHAPES;
use super::numbers::Numbers;
use crate::mesh::{DataArray, thousands};
use std::ops::Range;

/// Values of points, or of cells of a shape.
pub(super) struct Solution {
    /// The shape by its index; `None` for points.
    pub shape: Option<usize>,
    /// How many numbers each of its arrays has.
    components: Vec<usize>,
    /// All numbers of the first thing, of the second and so on.
    values: Vec<f64>,
}

/// Values that a thing may have in all.
const MOST_VALUES: usize = 1 << 16;

/// Numbers in memory for each in the file, since cells without a value have NaN.
const MOST_SPREAD: usize = 256;

impl Solution {
    /// Reads a section. A file says 1 for a scalar, 2 for a vector, 3 for a symmetric matrix, 4 for a matrix.
    pub fn read(shape: Option<usize>, dimension: usize, numbers: &mut Numbers<'_>) -> Result<Self, ParseError> {
        let count = numbers.count(0, 1, "lines of values")?;
        let arrays = numbers.small("a count of arrays")?;
        let arrays = numbers.room(arrays, 1, 0, "arrays")?;
        let mut components = Vec::new();
        for _ in 0..arrays {
            components.push(match numbers.small("a kind of array")? {
                1 => 1,
                2 => dimension,
                3 => dimension * (dimension + 1) / 2,
                4 => dimension * dimension,
                other => {
                    let expected = "1 (scalar), 2 (vector), 3 (symmetric matrix) or 4 (matrix)";
                    return Err(ParseError::invalid(numbers.place(), format!("an array of kind {other}"), expected));
                }
            });
        }
        let each: usize = components.iter().sum();
        if each == 0 || each > MOST_VALUES {
            return Err(ParseError::invalid(numbers.place(), format!("{each} numbers a line"), format!("1 to {MOST_VALUES}")));
        }
        let count = numbers.room(count as i64, 0, each, "lines of values")?;
        let mut values = Vec::with_capacity(count * each);
        for _ in 0..count {
            numbers.check()?;
            for _ in 0..each {
                values.push(numbers.real("a value")?);
            }
        }
        Ok(Solution { shape, components, values })
    }

    /// Its arrays over so many points or cells, of which those in `ranges` have values; else why there are none. `named` counts arrays.
    pub fn into_arrays(self, things: usize, ranges: &[Range<usize>], named: &mut usize) -> Result<Vec<DataArray>, String> {
        let each: usize = self.components.iter().sum();
        let lines = self.values.len() / each;
        let expected: usize = ranges.iter().map(Range::len).sum();
        if lines != expected {
            let what = self.shape.map_or("vertices", |shape| SHAPES[shape].keyword);
            let (lines, expected) = (thousands(lines as u64), thousands(expected as u64));
            return Err(format!("a solution was left out: it has values for {lines} {what}, the mesh has {expected}"));
        }
        if things.saturating_mul(each) > MOST_SPREAD * self.values.len() + (1 << 17) {
            let what = self.shape.map_or("vertices", |shape| SHAPES[shape].keyword);
            return Err(format!("a solution was left out: its {each} numbers for a few {what} would fill too much memory"));
        }
        let mut arrays = Vec::new();
        let mut first = 0;
        for &components in &self.components {
            let mut values = vec![f64::NAN; things * components];
            for (line, thing) in ranges.iter().cloned().flatten().enumerate() {
                let found = &self.values[line * each + first..][..components];
                values[thing * components..][..components].copy_from_slice(found);
            }
            first += components;
            *named += 1;
            let name = if *named == 1 { "solution".into() } else { format!("solution {named}") };
            arrays.push(real_numbers(&name, components, values));
        }
        Ok(arrays)
    }
}
