//! Samples while the octree is built: what leaves say of their corners, before neighbours have agreed on it.

use super::brick::{LATTICE, corner_of_child, lattice_index};

/// What is known of the field at a lattice point. Leaves that share the point each say something; [`Sample::merge`] makes one of it.
///
/// Kinds, later ones win: nothing, a weighted mean of what lies around (outside the mesh, or by rule), the mean over a box, the field's
/// own value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sample {
    /// The value where `weight` is infinite, else the sum of weighted values.
    sum: f32,
    /// Infinite: the field's own value; above 0: a mean; below 0: a mean over a box, negated.
    weight: f32,
}

impl Sample {
    /// The field's own value.
    pub fn exact(value: f32) -> Self {
        Sample { sum: value, weight: f32::INFINITY }
    }

    /// A mean of values around: the sum of weighted values, and of weights, above 0.
    pub fn mean(sum: f64, weight: f64) -> Self {
        let weight32 = weight as f32;
        if weight32.is_infinite() { Self::exact((sum / weight) as f32) } else { Sample { sum: sum as f32, weight: weight32 } }
    }

    /// The sum of `count` >= 1 values in a box around the point.
    pub fn in_box(sum: f32, count: f32) -> Self {
        Sample { sum, weight: -count }
    }

    /// Whether this is the field's own value, which nothing changes any more.
    pub fn is_exact(self) -> bool {
        self.kind() == 3
    }

    fn kind(self) -> u8 {
        if self.weight == f32::INFINITY {
            3
        } else if self.weight < 0.0 {
            2
        } else {
            u8::from(self.weight > 0.0)
        }
    }

    /// Adds what another leaf says; where both know the field's own value the first stays.
    pub fn merge(&mut self, other: Sample) {
        match (self.kind(), other.kind()) {
            (a, b) if a < b => *self = other,
            (a, b) if a > b || a == 3 => {}
            _ => (self.sum, self.weight) = (self.sum + other.sum, self.weight + other.weight),
        }
    }

    /// The value, in [0, 1]; 0 where nothing is known.
    pub fn value(self) -> f32 {
        match self.kind() {
            0 => 0.0,
            3 => self.sum,
            _ => self.sum / self.weight.abs(),
        }
    }
}

/// Samples at the 3 x 3 x 3 lattice points of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lattice(pub [Sample; LATTICE]);

impl Default for Lattice {
    fn default() -> Self {
        Lattice([Sample::default(); LATTICE])
    }
}

impl Lattice {
    /// Takes what child `i` knows of its corners.
    pub fn merge_child(&mut self, i: u32, corners: &[Sample; 8]) {
        for (k, &corner) in corners.iter().enumerate() {
            self.0[corner_of_child(i, k as u32)].merge(corner);
        }
    }

    /// The samples at the corners of the block's own cell.
    pub fn corners(&self) -> [Sample; 8] {
        std::array::from_fn(|k| self.0[lattice_index(2 * (k as u32 & 1), 2 * (k as u32 >> 1 & 1), 2 * (k as u32 >> 2))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_knowledge_wins_and_equals_are_averaged() {
        let merged = |samples: &[Sample]| {
            let mut all = Sample::default();
            samples.iter().for_each(|&s| all.merge(s));
            all.value()
        };
        let (mean, in_box, exact) = (Sample::mean(2.0 * 0.25, 2.0), Sample::in_box(1.5, 2.0), Sample::exact(0.5));
        assert_eq!(merged(&[]), 0.0);
        assert_eq!(merged(&[mean, Sample::mean(2.0 * 0.75, 2.0)]), 0.5);
        assert_eq!(merged(&[mean, in_box, mean]), 0.75);
        assert_eq!(merged(&[in_box, exact, Sample::exact(0.9), mean]), 0.5);
        assert_eq!(Sample::mean(1e300, 2e300).value(), 0.5, "infinitely near is there");
    }
}
