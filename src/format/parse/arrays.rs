//! Arrays from numbers of which a file does not say how wide they are.

use crate::mesh::{DataArray, Values};

/// An array of numbers that should be whole, NaN where there is none: f32 if they are and all of them are exact in it.
pub(in crate::format) fn whole_numbers(name: &str, numbers: &[f64]) -> DataArray {
    let is_small = numbers.iter().all(|&n| n.is_nan() || n.fract() == 0.0 && n.abs() <= f64::from(1 << 24));
    let values = if is_small { Values::F32(numbers.iter().map(|&n| n as f32).collect()) } else { Values::F64(numbers.to_vec()) };
    DataArray { name: name.into(), components: 1, values }
}

/// An array of numbers as they are.
pub(in crate::format) fn real_numbers(name: &str, components: usize, numbers: Vec<f64>) -> DataArray {
    DataArray { name: name.into(), components, values: Values::F64(numbers) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_whole_numbers_are_narrow() {
        let narrow = |numbers: &[f64]| matches!(whole_numbers("n", numbers).values, Values::F32(_));
        assert!(narrow(&[1.0, -16_777_216.0, f64::NAN]));
        assert!(!narrow(&[16_777_217.0]) && !narrow(&[0.5]) && !narrow(&[f64::INFINITY]));
    }
}
