//! Finding the leaf that holds a cell of the grid: the twin of `shaders/shared/descent.wgsl`.

use super::ray::Cell;
use crate::octree::{Activity, OctreeTexture};
use glam::UVec3;

/// The deepest level that a texel can name.
pub const MAX_DEPTH: usize = 25;
/// The highest byte of an interior texel.
pub const INTERIOR: u32 = 255;

/// A texel as one number: A in the highest byte, then R, G, B. 0 is empty.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Word(pub u32);

impl Word {
    /// A leaf's depth.
    pub fn depth(self) -> u32 {
        (self.0 >> 24) / 10
    }

    /// A leaf's value, normalised.
    pub fn value(self) -> f32 {
        (self.0 & 0x00ff_ffff) as f32 * (1.0 / 16_777_215.0)
    }
}

/// What of the tree counts in a descent.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum What {
    /// All of it.
    All,
    /// What is active; all else is empty.
    Active,
    /// That, down to nodes that are active as a whole.
    Whole,
}

/// A place in the tree from which the next leaf is found: the blocks on the way from the root, and the level to start again from.
pub(super) struct Descent<'a> {
    texture: &'a OctreeTexture,
    activity: &'a Activity,
    /// `stack[l]` is the block at level l above the last leaf found; level 0 is the root's.
    stack: [u32; MAX_DEPTH],
    level: u32,
    last: UVec3,
}

impl<'a> Descent<'a> {
    /// Starts at the root. The texture has at least one level.
    pub fn new(texture: &'a OctreeTexture, activity: &'a Activity) -> Self {
        Descent { texture, activity, stack: [0; MAX_DEPTH], level: 0, last: UVec3::ZERO }
    }

    /// Cells along each axis of the grid.
    pub fn cells(&self) -> u32 {
        1 << self.texture.depth()
    }

    /// Begins anew at the root.
    pub fn restart(&mut self) {
        self.level = 0;
    }

    /// The leaf or empty cell that holds the finest cell `at`, starting at the lowest block that holds both `at` and the cell asked for
    /// before: neighbours share all but a few levels, so most steps cost one or two fetches. The highest bit in which the coordinates
    /// differ tells the level.
    pub fn descend(&mut self, at: UVec3, what: What) -> (Word, Cell) {
        let depth = u32::from(self.texture.depth());
        let differing = (at.x ^ self.last.x) | (at.y ^ self.last.y) | (at.z ^ self.last.z);
        let mut level = self.level.min(depth - 1 - differing.checked_ilog2().unwrap_or(0));
        self.last = at;
        let mut bit = depth - 1 - level;
        let mut word = self.visible_node(self.stack[level as usize], (at >> bit) & 1, what);
        while word.0 >> 24 == INTERIOR && bit > 0 && !(what == What::Whole && self.mask(level, (at >> bit) & 1) >> 8 & 1 == 1) {
            level += 1;
            bit -= 1;
            self.stack[level as usize] = word.0 & 0x00ff_ffff;
            word = self.visible_node(self.stack[level as usize], (at >> bit) & 1, what);
        }
        self.level = level;
        let cell = Cell { low: (at >> bit) << bit, size: 1 << bit };
        (if word.0 >> 24 == INTERIOR && what != What::Whole { Word(0) } else { word }, cell)
    }

    /// Whether the leaf found last is active.
    pub fn is_active(&self) -> bool {
        let bit = u32::from(self.texture.depth()) - 1 - self.level;
        self.mask(self.level, (self.last >> bit) & 1) & 1 == 1
    }

    /// A node, empty if it does not count.
    fn visible_node(&self, block: u32, child: UVec3, what: What) -> Word {
        if what != What::All && self.activity.masks()[self.number(block)] >> child_index(child) & 1 == 0 {
            return Word(0);
        }
        self.node(block, child)
    }

    /// The activity of a child of the block at a level of the stack: bit 0, that it is active; bit 8, as a whole.
    fn mask(&self, level: u32, child: UVec3) -> u32 {
        self.activity.masks()[self.number(self.stack[level as usize])] >> child_index(child)
    }

    /// The number of a block.
    fn number(&self, block: u32) -> usize {
        let n = self.texture.blocks_per_axis();
        ((block >> 16) + n * ((block >> 8 & 255) + n * (block & 255))) as usize
    }

    /// The samples at the corners of the leaf found last, whose texture has bricks.
    pub fn corners(&self) -> [f32; 8] {
        let bit = u32::from(self.texture.depth()) - 1 - self.level;
        let child = (self.last >> bit) & 1;
        self.texture.bricks()[self.number(self.stack[self.level as usize])].corners(child_index(child))
    }

    /// The texel of a child. A block is named by its position in the pool, x in the highest byte, as an interior texel has it.
    fn node(&self, block: u32, child: UVec3) -> Word {
        let at = UVec3::new(block >> 16, block >> 8 & 255, block & 255) * 2 + child;
        let size = self.texture.size();
        let texel = self.texture.texels()[(at.x + size.x * (at.y + size.y * at.z)) as usize];
        let [r, g, b, a] = texel.map(u32::from);
        Word(a << 24 | r << 16 | g << 8 | b)
    }
}

fn child_index(child: UVec3) -> u32 {
    child.x | child.y << 1 | child.z << 2
}
