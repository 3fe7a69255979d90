//! What of an octree texture a transfer function shows, and the plane that halves it best (method 2, maths 5).

use super::OctreeTexture;
use glam::{DVec3, UVec3};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Blocks that one task looks at.
const CHUNK: usize = 4096;

/// The level whose cells stand for the volume where a plane is chosen: 64 along each axis, the bits of a word.
const SPLIT_LEVEL: u8 = 6;
const SPLIT_CELLS: u32 = 1 << SPLIT_LEVEL;

/// Which nodes of an octree texture are *active*: leaves whose values reach into what is seen, and interior nodes above such leaves.
///
/// A leaf's values are those that its reconstruction takes: from the smallest to the largest of its corners.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Activity {
    /// One a block, in the order of their numbers. Bit i: child i is active; bit 8 + i: child i is an active leaf, or all leaves below it
    /// are active and none is empty.
    masks: Vec<u32>,
    leaves: usize,
}

/// A cell of which every part is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActiveBox {
    /// Its lowest corner on the grid of the deepest level.
    pub low: UVec3,
    /// Its edge there.
    pub size: u32,
}

/// A plane that halves the root cube.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// The axis that it is perpendicular to: 0, 1, 2.
    pub axis: usize,
    /// Where it crosses that axis, in edges of the root cube.
    pub position: f32,
}

/// What was active when it was asked last, so that it is not found anew for each picture of one octree. All uses must be of one texture.
#[derive(Debug, Default)]
pub struct KeptActivity(Mutex<Option<(Seen, Arc<Activity>)>>);

/// Closed intervals of normalised values.
type Seen = Vec<[f32; 2]>;

impl KeptActivity {
    /// [`Activity::new`], or what that gave before.
    pub fn of(&self, texture: &OctreeTexture, seen: &[[f32; 2]]) -> Arc<Activity> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, activity)) = &*kept()
            && of == seen
        {
            return activity.clone();
        }
        let activity = Arc::new(Activity::new(texture, seen));
        *kept() = Some((seen.to_vec(), activity.clone()));
        activity
    }
}

impl Activity {
    /// What is active where the values in `seen` are seen: closed intervals of normalised values, ascending and apart.
    pub fn new(texture: &OctreeTexture, seen: &[[f32; 2]]) -> Self {
        let blocks: usize = texture.level_blocks().iter().map(|&n| n as usize).sum();
        let mut masks = vec![0u32; blocks];
        let tasks = masks.par_chunks_mut(CHUNK).enumerate();
        let leaves = tasks.map(|(task, masks)| {
            let mut leaves = 0;
            for (block, mask) in (task * CHUNK..).zip(masks) {
                let active = active_leaves(texture, block as u32, seen);
                *mask = active | active << 8;
                leaves += active.count_ones() as usize;
            }
            leaves
        });
        let leaves = leaves.sum();
        // Children follow their parents: from the last block to the first, every block is done before the one above it asks.
        let mut child_block = blocks;
        for block in (0..blocks).rev() {
            for child in (0..8).rev() {
                if texture.is_interior(block as u32, child) {
                    child_block -= 1;
                    masks[block] |= u32::from(masks[child_block] & 0xff != 0) << child;
                    masks[block] |= u32::from(masks[child_block] >> 8 == 0xff) << (8 + child);
                }
            }
        }
        Activity { masks, leaves }
    }

    /// How many leaves are active.
    pub fn leaves(&self) -> usize {
        self.leaves
    }

    /// One word a block: bit i, child i is active; bit 8 + i, it is so as a whole.
    pub fn masks(&self) -> &[u32] {
        &self.masks
    }

    /// The largest cells that are active as a whole, none larger than those of `least_depth`, which together hold all that is active.
    pub fn boxes(&self, texture: &OctreeTexture, least_depth: u8) -> Vec<ActiveBox> {
        let depth = texture.depth();
        let mut boxes = Vec::new();
        self.visit(texture, depth, |low, level_depth, is_full| {
            let size = 1u32 << (depth - level_depth);
            if !is_full {
                return true;
            }
            // A large cell is listed in parts.
            let parts = 1u32 << least_depth.min(depth).saturating_sub(level_depth);
            for z in 0..parts {
                for y in 0..parts {
                    boxes.extend((0..parts).map(|x| ActiveBox { low: low + UVec3::new(x, y, z) * (size / parts), size: size / parts }));
                }
            }
            false
        });
        boxes
    }

    /// The plane beside which rays along its axis have the most to skip: the middle of the gap between active cells that is widest in sum
    /// over all columns of cells. Rays gain from a plane what lies, on them, between the last active leaf before and the first behind it.
    pub fn split(&self, texture: &OctreeTexture) -> Split {
        let columns = self.columns(texture);
        let mut best = (0, Split { axis: 0, position: 0.5 });
        for (axis, columns) in columns.iter().enumerate() {
            let mut gaps = [0u64; SPLIT_CELLS as usize];
            for &column in columns.iter().filter(|column| column.count_ones() > 1) {
                for position in 1..SPLIT_CELLS {
                    let (below, above) = (column & ((1 << position) - 1), column >> position);
                    if below != 0 && above != 0 {
                        let empty_below = position - 1 - below.ilog2();
                        gaps[position as usize] += u64::from(empty_below + above.trailing_zeros());
                    }
                }
            }
            // Of the first planes as good as each other the one in the middle.
            let most = gaps.iter().copied().max().unwrap_or(0);
            if most > best.0 {
                let first = gaps.iter().position(|&gap| gap == most).unwrap_or(0);
                let last = first + gaps[first..].iter().take_while(|&&gap| gap == most).count() - 1;
                best = (most, Split { axis, position: ((first + last) / 2) as f32 / SPLIT_CELLS as f32 });
            }
        }
        best.1
    }

    /// The active cells of [`SPLIT_LEVEL`], a word a column along each axis.
    fn columns(&self, texture: &OctreeTexture) -> [Vec<u64>; 3] {
        let mut columns = [0; 3].map(|_| vec![0u64; (SPLIT_CELLS * SPLIT_CELLS) as usize]);
        let mut mark = |low: UVec3, size: u32| {
            let run = if size >= SPLIT_CELLS { u64::MAX } else { (1 << size) - 1 };
            for i in 0..size {
                for j in 0..size {
                    columns[0][(low.y + i + SPLIT_CELLS * (low.z + j)) as usize] |= run << low.x;
                    columns[1][(low.x + i + SPLIT_CELLS * (low.z + j)) as usize] |= run << low.y;
                    columns[2][(low.x + i + SPLIT_CELLS * (low.y + j)) as usize] |= run << low.z;
                }
            }
        };
        let depth = texture.depth();
        self.visit(texture, SPLIT_LEVEL, |low, level_depth, is_full| {
            if level_depth < SPLIT_LEVEL && !is_full {
                return true;
            }
            let cell = 1u32 << (SPLIT_LEVEL - level_depth);
            // On the grid of the deepest level, which may be coarser than that of the split.
            let low = if depth > SPLIT_LEVEL { low >> (depth - SPLIT_LEVEL) } else { low << (SPLIT_LEVEL - depth) };
            mark(low, cell);
            false
        });
        columns
    }

    /// Visits active nodes from the root on, down to `max_depth`: lowest corner on the grid of the deepest level, depth, whether the node
    /// is active as a whole. `into` says whether its children are of interest.
    fn visit(&self, texture: &OctreeTexture, max_depth: u8, mut into: impl FnMut(UVec3, u8, bool) -> bool) {
        if self.masks.is_empty() {
            return;
        }
        let depth = texture.depth();
        let mut stack = vec![(0u32, UVec3::ZERO, 1u8)];
        while let Some((block, low, level_depth)) = stack.pop() {
            let mask = self.masks[block as usize];
            for child in (0..8).filter(|child| mask >> child & 1 == 1) {
                let low = low + (super::brick::offset(child) << (depth - level_depth));
                if into(low, level_depth, mask >> (8 + child) & 1 == 1)
                    && level_depth < max_depth
                    && let Some(next) = texture.child_block(block, child)
                {
                    stack.push((next, low, level_depth + 1));
                }
            }
        }
    }
}

impl ActiveBox {
    /// Lowest and highest corner in edges of the root cube, for a texture of so many levels.
    pub fn corners(self, depth: u8) -> [DVec3; 2] {
        let cell = (-f64::from(depth)).exp2();
        [self.low.as_dvec3() * cell, (self.low + self.size).as_dvec3() * cell]
    }
}

/// Bit i: child i of a block is a leaf whose values reach into what is seen.
fn active_leaves(texture: &OctreeTexture, block: u32, seen: &[[f32; 2]]) -> u32 {
    let first = texture.block_texel(block);
    let mut active = 0;
    for child in 0..8 {
        let texel = texture.texels()[first + texture.child_offset(child)];
        let [r, g, b, a] = texel.map(u32::from);
        if a == 0 || a == 255 {
            continue;
        }
        // As marchers decode it.
        let value = (r << 16 | g << 8 | b) as f32 * (1.0 / 16_777_215.0);
        let [mut low, mut high] = [value; 2];
        if let Some(brick) = texture.bricks().get(block as usize) {
            let corners = brick.corners(child);
            low = corners.iter().copied().fold(f32::INFINITY, f32::min);
            high = corners.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
        // The first interval that does not end below the leaf's values.
        let next = seen.partition_point(|interval| interval[1] < low);
        active |= u32::from(seen.get(next).is_some_and(|interval| interval[0] <= high)) << child;
    }
    active
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{CellKind, Node, Octree};

    /// A tree of `depth` levels whose cells are full where `value` gives one; uniform cells are not divided.
    fn shell(depth: u8) -> OctreeTexture {
        let value = |at: UVec3, d: u8| {
            let center = (at.as_dvec3() + 0.5) / f64::from(1u32 << d) - 0.5;
            let half = 0.5 * 3f64.sqrt() / f64::from(1u32 << d);
            let r = center.length();
            if d < depth && (r - 0.3).abs() < half + 0.05 {
                CellKind::Split
            } else if r > 0.45 {
                CellKind::Empty
            } else {
                CellKind::Leaf(if (r - 0.3).abs() < 0.05 { 0.75 } else { 0.25 })
            }
        };
        OctreeTexture::encode(&Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], value)).expect("fits")
    }

    /// Every cell of the deepest level, active or not by looking it up.
    fn brute(texture: &OctreeTexture, seen: &[[f32; 2]]) -> Vec<bool> {
        let n = 1u32 << texture.depth();
        let cells = (0..n * n * n).map(|i| UVec3::new(i % n, i / n % n, i / (n * n)));
        let is_active = |at: UVec3| match texture.lookup((at.as_dvec3() + 0.5) / f64::from(n)).0 {
            Node::Leaf { value, .. } => seen.iter().any(|[low, high]| (*low..=*high).contains(&value)),
            _ => false,
        };
        cells.map(is_active).collect()
    }

    #[test]
    fn boxes_are_what_is_active_and_do_not_overlap() {
        let texture = shell(5);
        let n = 1u32 << texture.depth();
        for seen in [vec![[0.5, 1.0]], vec![[0.0, 0.3]], vec![[0.0, 0.25], [0.75, 0.75]], vec![[0.3, 0.7]], vec![]] {
            let activity = Activity::new(&texture, &seen);
            let expected = brute(&texture, &seen);
            for least_depth in [0, 3, 5] {
                let mut times = vec![0u32; expected.len()];
                for ActiveBox { low, size } in activity.boxes(&texture, least_depth) {
                    assert!(size <= n >> least_depth, "{size}");
                    for i in 0..size * size * size {
                        let at = low + UVec3::new(i % size, i / size % size, i / (size * size));
                        times[(at.x + n * (at.y + n * at.z)) as usize] += 1;
                    }
                }
                assert!(times.iter().zip(&expected).all(|(&times, &is_active)| times == u32::from(is_active)), "{seen:?}");
            }
            let leaves = texture.texels().iter().filter(|t| match Node::decode(**t) {
                Some(Node::Leaf { value, .. }) => seen.iter().any(|[low, high]| (*low..=*high).contains(&value)),
                _ => false,
            });
            assert_eq!(activity.leaves(), leaves.count());
        }
    }

    #[test]
    fn leaves_are_active_by_their_corners() {
        // A field that rises along x: corner values are what counts, not those at centres.
        let mut samples = [0.0f32; crate::octree::LATTICE];
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample = (i % 3) as f32 * 0.5;
        }
        let level = crate::octree::Level {
            interior: vec![0],
            leaf: vec![0xff],
            value: vec![0.25; 8],
            range: vec![[0.0, 1.0]; 8],
            bricks: vec![super::super::Brick::encode(&samples)],
        };
        let tree = Octree {
            levels: vec![level],
            params: Default::default(),
            ..Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], |_, _| CellKind::Empty)
        };
        let texture = OctreeTexture::encode(&tree).expect("fits");
        for (seen, expected) in [([0.6, 0.7], 0b1010_1010), ([0.1, 0.2], 0b0101_0101), ([0.49, 0.51], 0xff), ([0.2, 0.9], 0xff)] {
            assert_eq!(Activity::new(&texture, &[seen]).masks(), [expected | expected << 8], "{seen:?}");
        }
    }

    #[test]
    fn a_plane_goes_through_the_widest_gap() {
        // Two slabs across y, nearer to one end; and a hollow shell, which any middle plane halves.
        let slabs = Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], |at, depth| match depth {
            1..6 => CellKind::Split,
            _ if (at.y == 4) || (at.y == 40) => CellKind::Leaf(1.0),
            _ => CellKind::Empty,
        });
        let slabs = OctreeTexture::encode(&slabs).expect("fits");
        let split = Activity::new(&slabs, &[[0.5, 1.0]]).split(&slabs);
        assert!(split.axis == 1 && split.position > 5.0 / 64.0 && split.position < 40.0 / 64.0, "{split:?}");
        let shell = shell(5);
        let split = Activity::new(&shell, &[[0.5, 1.0]]).split(&shell);
        assert!((split.position - 0.5).abs() < 0.1, "{split:?}");
        assert_eq!(Activity::new(&shell, &[]).split(&shell), Split { axis: 0, position: 0.5 });
    }

    #[test]
    fn an_octree_without_levels_has_nothing_active() {
        let texture = OctreeTexture::encode(&Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], |_, _| CellKind::Empty)).expect("fits");
        assert!(Activity::new(&texture, &[[0.0, 1.0]]).boxes(&texture, 0).is_empty());
    }
}
