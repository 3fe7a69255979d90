//! The samples of a block's 3 x 3 x 3 lattice points in 60 bytes, and the trilinear field between them.
//!
//! The children of an interior cell share their corners: 27 lattice points for 8 leaves. A brick keeps them as 17-bit fixed-point numbers
//! of the field's range, so that rounding moves a sample by at most 3.8e-6, and a corner that is constrained to a coarser leaf (which
//! has rounded samples of its own) by at most 7.7e-6 from any leaf that touches it.

use glam::{UVec3, Vec3};

/// Lattice points of a block.
pub const LATTICE: usize = 27;

/// Words of a brick.
pub const BRICK_WORDS: usize = 15;

/// The largest 17-bit number, which stands for the value 1.
const VALUE_MAX: f32 = 131_071.0;

/// The samples at the lattice points of a block, number `x + 3 y + 9 z` for x, y, z in 0..3.
///
/// ```text
/// words 0..14    the high 16 bits of samples 2 w (low half) and 2 w + 1 (high half); the high half of word 13 is 0
/// word 14        the lowest bit of sample i at bit i
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Brick(pub [u32; BRICK_WORDS]);

/// The 17-bit number nearest to a sample that is clamped to [0, 1]; of two the larger.
#[inline]
pub(super) fn fixed(sample: f32) -> u32 {
    // What `round` does, without a call.
    let scaled = sample.clamp(0.0, 1.0) * VALUE_MAX;
    let whole = scaled as i32;
    (whole + i32::from(scaled - whole as f32 >= 0.5)) as u32
}

/// The number of a lattice point.
#[inline]
pub const fn lattice_index(x: u32, y: u32, z: u32) -> usize {
    (x + 3 * y + 9 * z) as usize
}

/// x, y, z of a lattice point.
#[inline]
pub const fn lattice_point(index: usize) -> [u32; 3] {
    let i = index as u32;
    [i % 3, i / 3 % 3, i / 9]
}

/// The lattice point that is corner `k = x + 2 y + 4 z` of child `i`.
#[inline]
pub const fn corner_of_child(i: u32, k: u32) -> usize {
    lattice_index((i & 1) + (k & 1), (i >> 1 & 1) + (k >> 1 & 1), (i >> 2) + (k >> 2))
}

impl Brick {
    /// Encodes samples, clamped to [0, 1].
    pub fn encode(samples: &[f32; LATTICE]) -> Self {
        let mut numbers = [0; 2 * BRICK_WORDS - 2];
        for i in 0..LATTICE {
            numbers[i] = fixed(samples[i]);
        }
        let mut words = [0; BRICK_WORDS];
        for w in 0..BRICK_WORDS - 1 {
            words[w] = numbers[2 * w] >> 1 | (numbers[2 * w + 1] >> 1) << 16;
        }
        for i in 0..LATTICE {
            words[BRICK_WORDS - 1] |= (numbers[i] & 1) << i;
        }
        Brick(words)
    }

    /// Sample `i`, normalised, in [0, 1].
    #[inline]
    pub fn get(&self, i: usize) -> f32 {
        self.number(i) as f32 * (1.0 / VALUE_MAX)
    }

    /// Sample `i` as the 17-bit number that is kept.
    #[inline]
    pub(super) fn number(&self, i: usize) -> u32 {
        let high = self.0[i / 2] >> (16 * (i % 2)) & 0xffff;
        high << 1 | self.0[BRICK_WORDS - 1] >> i & 1
    }

    /// Replaces the number of sample `i`.
    #[inline]
    pub(super) fn set_number(&mut self, i: usize, number: u32) {
        let shift = 16 * (i % 2);
        self.0[i / 2] = self.0[i / 2] & !(0xffff << shift) | (number >> 1) << shift;
        self.0[BRICK_WORDS - 1] = self.0[BRICK_WORDS - 1] & !(1 << i) | (number & 1) << i;
    }

    /// The smallest and the largest sample at the corners of each child.
    pub(super) fn extremes(&self) -> [[f32; 2]; 8] {
        let mut numbers = [0; LATTICE];
        for i in 0..LATTICE {
            numbers[i] = self.number(i);
        }
        let mut extremes = [[0.0; 2]; 8];
        for end in 0..2 {
            let pick = |a: u32, b: u32| if (a < b) == (end == 0) { a } else { b };
            // Along z, then y, then x: what neighbouring children share is looked at once.
            let (mut z, mut y) = ([0; 18], [0; 12]);
            for i in 0..18 {
                z[i] = pick(numbers[i], numbers[i + 9]);
            }
            for i in 0..12 {
                y[i] = pick(z[i + i / 6 * 3], z[i + i / 6 * 3 + 3]);
            }
            for i in 0..8 {
                extremes[i][end] = pick(y[i + i / 2], y[i + i / 2 + 1]) as f32 * (1.0 / VALUE_MAX);
            }
        }
        extremes
    }

    /// The samples at the corners of child `i`, corner `k = x + 2 y + 4 z`.
    #[inline]
    pub fn corners(&self, i: u32) -> [f32; 8] {
        std::array::from_fn(|k| self.get(corner_of_child(i, k as u32)))
    }
}

/// The trilinear field with values `corners` (number `x + 2 y + 4 z`) at `at`, in cells from corner 0.
#[inline]
pub fn trilinear(corners: &[f32; 8], at: Vec3) -> f32 {
    let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
    let x = |k: usize| lerp(corners[k], corners[k + 1], at.x);
    lerp(lerp(x(0), x(2), at.y), lerp(x(4), x(6), at.y), at.z)
}

/// The gradient of the trilinear field at a place in a leaf, per edge of the leaf.
#[inline]
pub fn trilinear_gradient(corners: &[f32; 8], at: Vec3) -> Vec3 {
    let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
    // Along each axis the four edges' differences, blended by the other two coordinates.
    let along = |step: usize, [a, b, c, d]: [usize; 4], u: f32, v: f32| {
        let edge = |k: usize| corners[k + step] - corners[k];
        lerp(lerp(edge(a), edge(b), u), lerp(edge(c), edge(d), u), v)
    };
    Vec3::new(along(1, [0, 2, 4, 6], at.y, at.z), along(2, [0, 1, 4, 5], at.x, at.z), along(4, [0, 1, 2, 3], at.x, at.y))
}

/// The offset of child or corner `k = x + 2 y + 4 z`.
#[inline]
pub(super) fn offset(k: u32) -> UVec3 {
    UVec3::new(k & 1, k >> 1 & 1, k >> 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_is_the_fields() {
        let corners: [f32; 8] = std::array::from_fn(|k| (k as f32 * 0.618_034) % 1.0);
        for at in [Vec3::new(0.3, 0.6, 0.1), Vec3::new(0.9, 0.2, 0.8)] {
            let gradient = trilinear_gradient(&corners, at);
            for (axis, unit) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
                // Along an axis the field is linear.
                let difference = trilinear(&corners, at + 0.05 * unit) - trilinear(&corners, at - 0.05 * unit);
                assert!((difference / 0.1 - gradient[axis]).abs() < 1e-5, "{at} {axis}");
            }
        }
    }

    #[test]
    fn samples_survive_to_17_bits() {
        let samples: [f32; LATTICE] = std::array::from_fn(|i| (i as f32 * 0.381_966) % 1.0);
        let brick = Brick::encode(&samples);
        for (i, sample) in samples.iter().enumerate() {
            assert!((brick.get(i) - sample).abs() <= 0.5 / VALUE_MAX + 1e-7, "{i}: {sample} -> {}", brick.get(i));
        }
        let ends: [f32; LATTICE] = std::array::from_fn(|i| if i % 2 == 0 { 1.5 } else { -1.0 });
        assert_eq!((Brick::encode(&ends).get(4), Brick::encode(&ends).get(5)), (1.0, 0.0), "clamped");
        assert_eq!(size_of::<Brick>(), 60);
    }

    #[test]
    fn numbers_are_rounded_and_replaced_alone() {
        for sample in (0..200_000).map(|i| i as f32 * 5.1e-6 - 0.01).chain([0.499_999_97 / VALUE_MAX, 0.5 / VALUE_MAX, f32::NAN]) {
            assert_eq!(fixed(sample), (sample.clamp(0.0, 1.0) * VALUE_MAX).round() as u32, "{sample}");
        }
        let samples: [f32; LATTICE] = std::array::from_fn(|i| (i as f32 * 0.381_966) % 1.0);
        for i in 0..LATTICE {
            for number in [0, 1, 0xffff, 0x10000, 0x1ffff] {
                let mut brick = Brick::encode(&samples);
                brick.set_number(i, number);
                for k in 0..LATTICE {
                    assert_eq!(brick.number(k), if k == i { number } else { fixed(samples[k]) }, "{k} after {number} at {i}");
                }
            }
        }
    }

    #[test]
    fn extremes_are_those_of_the_corners() {
        let brick = Brick::encode(&std::array::from_fn(|i| (i as f32 * 0.381_966) % 1.0));
        for (i, [low, high]) in brick.extremes().into_iter().enumerate() {
            let corners = brick.corners(i as u32);
            assert_eq!(low, corners.into_iter().fold(1.0, f32::min), "child {i}");
            assert_eq!(high, corners.into_iter().fold(0.0, f32::max), "child {i}");
        }
    }

    #[test]
    fn packing_is_bit_for_bit_as_documented() {
        let mut samples = [0.0; LATTICE];
        (samples[0], samples[3], samples[26]) = (1.0, 2.0 / VALUE_MAX, 1.0 / VALUE_MAX);
        let mut expected = [0; BRICK_WORDS];
        (expected[0], expected[1], expected[14]) = (0xffff, 1 << 16, 1 | 1 << 26);
        assert_eq!(Brick::encode(&samples).0, expected);
    }

    #[test]
    fn children_meet_in_the_lattice() {
        let samples: [f32; LATTICE] = std::array::from_fn(|i| {
            let [x, y, z] = lattice_point(i);
            (x as f32 + 2.0 * y as f32 + 4.0 * z as f32) / 14.0
        });
        let brick = Brick::encode(&samples);
        for child in 0..8 {
            let corners = brick.corners(child);
            let low = offset(child).as_vec3();
            for at in [Vec3::ZERO, Vec3::new(0.3, 0.9, 0.5), Vec3::ONE] {
                let expected = (low + at).dot(Vec3::new(1.0, 2.0, 4.0)) / 14.0;
                assert!((trilinear(&corners, at) - expected).abs() < 1e-5, "child {child} at {at}");
            }
        }
    }
}
