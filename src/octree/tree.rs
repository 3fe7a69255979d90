//! The adaptive octree without pointers: per level, one pair of masks a block.

use super::brick::Brick;
use super::{OctreeParams, Reconstruction};
use glam::DVec3;
use rayon::prelude::*;

/// The blocks of one level, in breadth-first order. A *block* is the 8 children of one interior cell; child `i = x + 2 y + 4 z`.
///
/// The n-th interior child of level l, counted over blocks and children in order, owns the n-th block of level l + 1: order replaces
/// pointers. Leaf arrays hold the full leaves of the level in the same order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Level {
    /// Bit i: child i is interior. One byte a block.
    pub interior: Vec<u8>,
    /// Bit i: child i is a non-empty leaf. One byte a block; never set together with the interior bit.
    pub leaf: Vec<u8>,
    /// Normalised value of each leaf, in [0, 1].
    pub value: Vec<f32>,
    /// Smallest and largest normalised value in each leaf, of the field inside the mesh (a safe bound, not always tight).
    pub range: Vec<[f32; 2]>,
    /// Samples at the corners of the children, one brick a block; none where the reconstruction is [`Reconstruction::Leaf`].
    pub bricks: Vec<Brick>,
}

/// Leaves of the greatest depth in which the tolerance is not met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    /// How many there are.
    pub leaves: usize,
    /// The largest error that was estimated in one, relative to the field's range.
    pub worst_rel: f32,
    /// The centre of that leaf, relative to the mesh's centre.
    pub at: DVec3,
}

/// An adaptive octree over a cube. `levels[l]` holds blocks whose children have depth `l + 1`; level 0 has one block, the root's.
#[derive(Debug, Clone, PartialEq)]
pub struct Octree {
    /// Lowest corner of the root cube, relative to the mesh's centre.
    pub root_min: DVec3,
    /// Edge of the root cube, world units.
    pub root_edge: f64,
    /// What normalised 0 and 1 stand for: the array's own range.
    pub value_range: [f64; 2],
    /// Blocks by level.
    pub levels: Vec<Level>,
    /// How it was built.
    pub params: OctreeParams,
    /// Where the tolerance is not met, if there was one.
    pub unmet: Option<Unmet>,
}

impl Level {
    /// The levels of parts of a tree, given in the order of their places, as those of the whole.
    pub(super) fn joined(mut parts: Vec<Vec<Level>>) -> Vec<Level> {
        let count = parts.iter().map(Vec::len).max().unwrap_or(0);
        let level = |number: usize| {
            let mut at: Vec<&mut Level> = parts.iter_mut().filter_map(|levels| levels.get_mut(number)).collect();
            Level {
                interior: chained(at.iter_mut().map(|level| std::mem::take(&mut level.interior)).collect()),
                leaf: chained(at.iter_mut().map(|level| std::mem::take(&mut level.leaf)).collect()),
                value: chained(at.iter_mut().map(|level| std::mem::take(&mut level.value)).collect()),
                range: chained(at.iter_mut().map(|level| std::mem::take(&mut level.range)).collect()),
                bricks: chained(at.iter_mut().map(|level| std::mem::take(&mut level.bricks)).collect()),
            }
        };
        (0..count).map(level).collect()
    }
}

/// All parts one behind the other.
fn chained<T: bytemuck::Pod + Send + Sync>(parts: Vec<Vec<T>>) -> Vec<T> {
    let mut all = bytemuck::zeroed_vec(parts.iter().map(Vec::len).sum());
    let mut rest = &mut all[..];
    let mut places = Vec::with_capacity(parts.len());
    for part in &parts {
        let (place, behind) = std::mem::take(&mut rest).split_at_mut(part.len());
        places.push(place);
        rest = behind;
    }
    places.into_par_iter().zip(parts).for_each(|(place, part)| place.copy_from_slice(&part));
    all
}

impl Octree {
    /// Number of blocks, which is the number of interior cells, the root included.
    pub fn interior_count(&self) -> usize {
        self.levels.iter().map(|l| l.interior.len()).sum()
    }

    /// What the field is between samples.
    pub fn reconstruction(&self) -> Reconstruction {
        self.params.reconstruction
    }

    /// Number of non-empty leaves.
    pub fn leaf_count(&self) -> usize {
        self.levels.iter().map(|l| l.value.len()).sum()
    }

    /// Number of empty leaves.
    pub fn empty_count(&self) -> usize {
        let empty = |l: &Level| l.interior.iter().zip(&l.leaf).map(|(i, f)| (i | f).count_zeros() as usize).sum::<usize>();
        self.levels.iter().map(empty).sum()
    }

    /// Interior cells and non-empty leaves: the node count of the paper's tables.
    pub fn node_count(&self) -> usize {
        self.interior_count() + self.leaf_count()
    }

    /// Non-empty leaves by depth; index 0 is depth 0 and always 0.
    pub fn leaves_by_depth(&self) -> Vec<usize> {
        std::iter::once(0).chain(self.levels.iter().map(|l| l.value.len())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_join_level_by_level_in_order() {
        let level = |blocks: std::ops::Range<u8>| Level {
            interior: blocks.clone().collect(),
            leaf: blocks.clone().map(|b| !b).collect(),
            value: blocks.clone().map(f32::from).collect(),
            range: blocks.clone().map(|b| [f32::from(b), 9.0]).collect(),
            bricks: blocks.map(|b| Brick([u32::from(b); 15])).collect(),
        };
        let joined =
            Level::joined(vec![vec![level(0..2)], vec![], vec![level(2..3), level(0..4), level(0..1)], vec![level(3..3), level(4..6)]]);
        assert!(joined == [level(0..3), level(0..6), level(0..1)]);
    }
}
