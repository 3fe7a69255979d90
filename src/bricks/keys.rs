//! Maps and sets of bricks.

use super::BrickKey;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// Mixes the numbers of a [`BrickKey`] by multiplications: books of bricks are read a million times a second.
#[derive(Debug, Clone, Copy, Default)]
pub struct KeyHasher(u64);

/// A map from bricks.
pub type KeyMap<V> = HashMap<BrickKey, V, BuildHasherDefault<KeyHasher>>;

/// A set of bricks.
pub type KeySet = HashSet<BrickKey, BuildHasherDefault<KeyHasher>>;

impl KeyHasher {
    fn mix(&mut self, n: u64) {
        self.0 = (self.0.rotate_left(23) ^ n).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..part.len()].copy_from_slice(part);
            self.mix(u64::from_le_bytes(word));
        }
    }

    fn write_u8(&mut self, n: u8) {
        self.mix(n.into());
    }

    fn write_u32(&mut self, n: u32) {
        self.mix(n.into());
    }

    fn write_usize(&mut self, n: usize) {
        self.mix(n as u64);
    }
}
