//! The octree texture: the tree as a 3D texture of RGBA8 texels (method 1.3; Lefebvre, Hornus & Neyret, *Octree Textures on the GPU*,
//! GPU Gems 2, chapter 37).

use super::brick::{Brick, trilinear};
use super::{Level, Octree, Reconstruction};
use glam::{DVec3, UVec3};
use rayon::prelude::*;

/// A 3D texture of RGBA8 texels that holds an octree. Each interior cell owns a 2x2x2 *block* of texels, one texel a child.
///
/// ```text
/// one texel            R        G        B        A
/// empty                0        0        0        0        nothing of the mesh here
/// interior             x        y        z        255      the child's block in the pool, in blocks
/// leaf at depth d      high     middle   low      10 d     24-bit value: round(v (2^24 - 1)), v in [0, 1]
///
/// one block            child i = x + 2 y + 4 z at texel 2 block + (x, y, z)
///
///     z = 0:   y = 1   2 3        z = 1:   y = 1   6 7
///              y = 0   0 1                 y = 0   4 5
///
/// the pool             n x n x n blocks, block b at (b mod n, b / n mod n, b / n^2); breadth first, the root's children first;
///                      n is the smallest that holds all blocks; z layers of blocks that would stay unused are cut off.
/// ```
///
/// Worked examples: the empty cell is `00 00 00 00`; a leaf of depth 9 with value 1/2 is `80 00 00 5a` (0.5 * 16777215 rounds to
/// 0x800000); an interior cell whose block lies at (3, 0, 1) is `03 00 01 ff`.
///
/// Where the reconstruction is [`Reconstruction::Continuous`], the 27 samples at the corners of each block's children lie beside it, a
/// [`Brick`] a block.
#[derive(Debug, Clone, PartialEq)]
pub struct OctreeTexture {
    texels: Vec<[u8; 4]>,
    /// One a block in the order of their numbers, or none.
    bricks: Vec<Brick>,
    /// Blocks along x and y.
    blocks_per_axis: u32,
    /// Layers of blocks along z that are kept.
    block_layers: u32,
    depth: u8,
    /// Blocks of each level.
    level_blocks: Vec<u32>,
    root_min: DVec3,
    root_edge: f64,
    value_range: [f64; 2],
}

/// One texel, decoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Node {
    /// Nothing of the mesh.
    Empty,
    /// The children lie in this block.
    Interior {
        /// Position of the block in the pool, in blocks.
        block: UVec3,
    },
    /// A sample.
    Leaf {
        /// Depth of the leaf, 1 to 25.
        depth: u8,
        /// The normalised value, in [0, 1].
        value: f32,
    },
}

/// Where a descent ends.
struct Found {
    node: Node,
    depth: u8,
    /// The block that holds the node, and which child it is.
    block: UVec3,
    child: u32,
    /// Where in the cell the point lies, in [0, 1).
    at: DVec3,
}

/// Why a tree does not fit, or a texture is not one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TextureError {
    /// 8 bits a coordinate address 256^3 blocks.
    #[error("the octree has {blocks} interior cells, an octree texture holds at most {}; lower max_depth or raise the thresholds", 1u32 << 24)]
    TooManyBlocks {
        /// Blocks that the tree needs.
        blocks: usize,
    },
    /// The structure is broken.
    #[error("octree texture: {0}")]
    Invalid(String),
}

/// The largest 24-bit number, which stands for the value 1.
const VALUE_MAX: f64 = 16_777_215.0;

impl Node {
    /// Decodes a texel. `A` that is neither 0, 255 nor a positive multiple of 10 up to 250 is no node.
    pub fn decode(texel: [u8; 4]) -> Option<Node> {
        let [r, g, b, a] = texel.map(u32::from);
        match a {
            0 => Some(Node::Empty),
            255 => Some(Node::Interior { block: UVec3::new(r, g, b) }),
            a if a % 10 == 0 => Some(Node::Leaf { depth: (a / 10) as u8, value: (f64::from(r << 16 | g << 8 | b) / VALUE_MAX) as f32 }),
            _ => None,
        }
    }

    /// The texel of a node. Values are clamped to [0, 1].
    pub fn encode(self) -> [u8; 4] {
        match self {
            Node::Empty => [0; 4],
            Node::Interior { block } => [block.x as u8, block.y as u8, block.z as u8, 255],
            Node::Leaf { depth, value } => {
                let [_, r, g, b] = ((f64::from(value).clamp(0.0, 1.0) * VALUE_MAX + 0.5) as u32).to_be_bytes();
                [r, g, b, depth * 10]
            }
        }
    }
}

/// A place in the blocks of all levels, in order.
///
/// Blocks are numbered breadth first, so the next level's start where this level's end, in the order of its interior children.
#[derive(Clone)]
struct Reader<'a> {
    level: &'a Level,
    below: &'a [Level],
    number: usize,
    /// Number in its level.
    block: usize,
    /// The first leaf of the block, and the number of its first interior child's block in the texture.
    value: usize,
    child_block: u32,
}

impl<'a> Reader<'a> {
    /// At the first block, if there is any.
    fn new(levels: &'a [Level]) -> Option<Self> {
        let (level, below) = levels.split_first()?;
        Reader { level, below, number: 0, block: 0, value: 0, child_block: 1 }.settled()
    }

    /// The depth of the block's children.
    fn depth(&self) -> u8 {
        self.number as u8 + 1
    }

    /// At the first block of the next level that has any, if this one's are through.
    fn settled(mut self) -> Option<Self> {
        while self.block == self.level.interior.len() {
            let (level, below) = self.below.split_first()?;
            self = Reader { level, below, number: self.number + 1, block: 0, value: 0, ..self };
        }
        Some(self)
    }

    /// Further on by some blocks.
    fn skip(mut self, mut blocks: usize) -> Option<Self> {
        loop {
            let part = blocks.min(self.level.interior.len() - self.block);
            let ones = |masks: &[u8]| masks[self.block..][..part].iter().map(|mask| mask.count_ones()).sum::<u32>();
            (self.value, self.child_block) = (self.value + ones(&self.level.leaf) as usize, self.child_block + ones(&self.level.interior));
            (self.block, blocks) = (self.block + part, blocks - part);
            self = self.settled()?;
            if blocks == 0 {
                return Some(self);
            }
        }
    }
}

impl OctreeTexture {
    /// Encodes a tree.
    pub fn encode(tree: &Octree) -> Result<Self, TextureError> {
        let blocks = tree.interior_count();
        if blocks > 1 << 24 {
            return Err(TextureError::TooManyBlocks { blocks });
        }
        let blocks_per_axis = (1u32..).find(|&n| u64::from(n).pow(3) >= blocks as u64).unwrap_or(256);
        let block_layers = (blocks as u32).div_ceil(blocks_per_axis * blocks_per_axis);
        let mut texture = OctreeTexture {
            bricks: vec![],
            texels: vec![],
            blocks_per_axis,
            block_layers,
            depth: tree.levels.len() as u8,
            level_blocks: tree.levels.iter().map(|level| level.interior.len() as u32).collect(),
            root_min: tree.root_min,
            root_edge: tree.root_edge,
            value_range: tree.value_range,
        };
        let bricks = || tree.levels.iter().map(|level| &level.bricks[..]).collect::<Vec<_>>().concat();
        (texture.texels, texture.bricks) = rayon::join(|| texture.encode_texels(&tree.levels), bricks);
        debug_assert_eq!(texture.validate(), Ok(()));
        Ok(texture)
    }

    /// All texels, a layer of blocks a task.
    fn encode_texels(&self, levels: &[Level]) -> Vec<[u8; 4]> {
        let layer_blocks = self.blocks_per_axis as usize * self.blocks_per_axis as usize;
        let mut texels = vec![[0; 4]; layer_blocks * self.block_layers as usize * 8];
        if let Some(first) = Reader::new(levels) {
            let mut reader = Some(first);
            let starts: Vec<_> = (0..self.block_layers)
                .map_while(|_| {
                    let start = reader.take()?;
                    reader = start.clone().skip(layer_blocks);
                    Some(start)
                })
                .collect();
            texels.par_chunks_mut(layer_blocks * 8).zip(starts).for_each(|(texels, start)| self.encode_layer(texels, start));
        }
        texels
    }

    /// The texels of a layer of blocks, from where a reader stands.
    fn encode_layer(&self, texels: &mut [[u8; 4]], reader: Reader) {
        let offsets: [usize; 8] = std::array::from_fn(|i| self.child_offset(i as u32));
        let layer_blocks = self.blocks_per_axis * self.blocks_per_axis;
        let mut reader = Some(reader);
        for block in 0..layer_blocks {
            let Some(mut here) = reader.take() else { return };
            let (interior, leaf, depth) = (here.level.interior[here.block], here.level.leaf[here.block], here.depth());
            let (mut value, mut child_block) = (here.value, here.child_block);
            let first = self.block_texel(block);
            for i in 0..8 {
                let node = if interior >> i & 1 == 1 {
                    child_block += 1;
                    Node::Interior { block: self.block_position(child_block - 1) }
                } else if leaf >> i & 1 == 1 {
                    value += 1;
                    Node::Leaf { depth, value: here.level.value[value - 1] }
                } else {
                    continue;
                };
                texels[first + offsets[i]] = node.encode();
            }
            (here.value, here.child_block, here.block) = (value, child_block, here.block + 1);
            reader = here.settled();
        }
    }

    /// Where block `b` lies in the pool, in blocks.
    fn block_position(&self, b: u32) -> UVec3 {
        let n = self.blocks_per_axis;
        UVec3::new(b % n, b / n % n, b / (n * n))
    }

    /// Whether child `i` of block `b` is an interior node.
    pub(super) fn is_interior(&self, b: u32, i: u32) -> bool {
        self.texels[self.block_texel(b) + self.child_offset(i)][3] == 255
    }

    /// The number of the block of child `i` of block `b`, if that is an interior node.
    pub(super) fn child_block(&self, b: u32, i: u32) -> Option<u32> {
        match Node::decode(self.texels[self.block_texel(b) + self.child_offset(i)]) {
            Some(Node::Interior { block }) => Some(self.block_number(block) as u32),
            _ => None,
        }
    }

    /// Index of the first texel of block `b`.
    pub(super) fn block_texel(&self, b: u32) -> usize {
        self.texel_index(self.block_position(b) * 2)
    }

    /// Distance in texels from a block's first texel to that of child `i = x + 2 y + 4 z`.
    pub(super) fn child_offset(&self, i: u32) -> usize {
        let row = 2 * self.blocks_per_axis as usize;
        (i & 1) as usize + (i >> 1 & 1) as usize * row + (i >> 2) as usize * row * row
    }

    fn texel_index(&self, at: UVec3) -> usize {
        let row = 2 * self.blocks_per_axis as usize;
        at.x as usize + row * (at.y as usize + row * at.z as usize)
    }

    /// Texels along x, y, z.
    pub fn size(&self) -> UVec3 {
        UVec3::new(self.blocks_per_axis, self.blocks_per_axis, self.block_layers) * 2
    }

    /// All texels, x fastest, then y, then z.
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// The samples at the corners of the children, one brick a block; none where the reconstruction is [`Reconstruction::Leaf`].
    pub fn bricks(&self) -> &[Brick] {
        &self.bricks
    }

    /// What the field is between samples.
    pub fn reconstruction(&self) -> Reconstruction {
        if self.bricks.is_empty() { Reconstruction::Leaf } else { Reconstruction::Continuous }
    }

    /// Blocks along x and y of the pool.
    pub fn blocks_per_axis(&self) -> u32 {
        self.blocks_per_axis
    }

    /// Bytes of all texels and bricks.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.texels[..]) + size_of_val(&self.bricks[..])
    }

    /// The deepest level that has leaves or could have: the tree's number of levels.
    pub fn depth(&self) -> u8 {
        self.depth
    }

    /// Blocks of each level, the root's first. Blocks are numbered level by level.
    pub fn level_blocks(&self) -> &[u32] {
        &self.level_blocks
    }

    /// Lowest corner of the root cube, relative to the mesh's centre.
    pub fn root_min(&self) -> DVec3 {
        self.root_min
    }

    /// Edge of the root cube in world units.
    pub fn root_edge(&self) -> f64 {
        self.root_edge
    }

    /// What the values 0 and 1 stand for, in data units.
    pub fn value_range(&self) -> [f64; 2] {
        self.value_range
    }

    /// Fetches and decodes the texel at a position in texels. Positions outside the texture read as empty.
    pub fn node(&self, at: UVec3) -> Node {
        let inside = at.cmplt(self.size()).all();
        let texel = if inside { self.texels[self.texel_index(at)] } else { [0; 4] };
        Node::decode(texel).unwrap_or(Node::Empty)
    }

    /// Finds the cell that holds a point: at most one dependent fetch a level. `unit` is the position in the root cube, each
    /// coordinate in [0, 1); returns the node (never interior) and the cell's depth.
    pub fn lookup(&self, unit: DVec3) -> (Node, u8) {
        let found = self.find(unit);
        (found.node, found.depth)
    }

    fn find(&self, unit: DVec3) -> Found {
        let mut found = Found { node: Node::Empty, depth: 0, block: UVec3::ZERO, child: 0, at: unit };
        if !(unit.cmpge(DVec3::ZERO).all() && unit.cmplt(DVec3::ONE).all()) {
            return found;
        }
        // The binary digits of the position name the child at each level.
        let position = unit * f64::from(1u32 << self.depth);
        let digits = position.as_uvec3();
        for depth in 1..=self.depth {
            let shift = u32::from(self.depth - depth);
            let child = (digits >> shift) & 1;
            found.depth = depth;
            match Node::decode(self.texels[self.texel_index(found.block * 2 + child)]).unwrap_or(Node::Empty) {
                Node::Interior { block: next } => found.block = next,
                node => {
                    let cell = f64::from(1u32 << shift);
                    let at = position / cell - (digits >> shift).as_dvec3();
                    return Found { node, child: child.x | child.y << 1 | child.z << 2, at, ..found };
                }
            }
        }
        found
    }

    /// The normalised value of the reconstructed field at `unit`, a position in the root cube with coordinates in [0, 1); `None` where the
    /// octree is empty.
    pub fn value_at(&self, unit: DVec3) -> Option<f32> {
        let Found { node, block, child, at, .. } = self.find(unit);
        let Node::Leaf { value, .. } = node else { return None };
        Some(trilinear(&self.leaf_corners(block, child, value), at.as_vec3()))
    }

    /// The samples at the corners of the leaf that holds `unit` and the leaf's depth: what [`OctreeTexture::value_at`] interpolates between.
    /// All corners have the value of a leaf without bricks. `None` where the octree is empty.
    pub fn corners_at(&self, unit: DVec3) -> Option<([f32; 8], u8)> {
        let Found { node, depth, block, child, .. } = self.find(unit);
        let Node::Leaf { value, .. } = node else { return None };
        Some((self.leaf_corners(block, child, value), depth))
    }

    /// The samples at the corners of a leaf, child `i` of a block; all its value without bricks.
    pub(super) fn leaf_corners(&self, block: UVec3, i: u32, value: f32) -> [f32; 8] {
        if self.bricks.is_empty() { [value; 8] } else { self.bricks[self.block_number(block)].corners(i) }
    }

    /// The number of the block at a position in the pool.
    fn block_number(&self, block: UVec3) -> usize {
        let n = self.blocks_per_axis as usize;
        block.x as usize + n * (block.y as usize + n * block.z as usize)
    }

    /// Walks the whole structure: every block is reached exactly once in breadth-first order, every leaf names its own depth, and
    /// texels that no cell owns are empty.
    pub fn validate(&self) -> Result<(), TextureError> {
        let invalid = |text: String| Err(TextureError::Invalid(text));
        let size = self.size();
        if self.texels.len() != size.x as usize * size.y as usize * size.z as usize {
            return invalid(format!("{} texels for a size of {size}", self.texels.len()));
        }
        if self.depth == 0 {
            return Ok(()); // an octree without levels has no block
        }
        if self.bricks.len() > self.texels.len() / 8 {
            return invalid(format!("{} bricks for {} blocks", self.bricks.len(), self.texels.len() / 8));
        }
        let (mut level, mut next, mut depth) = (0..1u32, 1u32, 1u8);
        while !level.is_empty() {
            for block in level.clone() {
                for i in 0..8 {
                    let texel = self.texels[self.block_texel(block) + self.child_offset(i)];
                    match Node::decode(texel) {
                        None => return invalid(format!("child {i} of block {block} is {texel:?}, which is no node")),
                        Some(Node::Leaf { depth: stated, .. }) if stated != depth => {
                            return invalid(format!("child {i} of block {block} at depth {depth} is a leaf of depth {stated}"));
                        }
                        Some(Node::Interior { block: child }) if child != self.block_position(next) => {
                            return invalid(format!(
                                "child {i} of block {block} points to {child}, expected {}",
                                self.block_position(next)
                            ));
                        }
                        Some(Node::Interior { .. }) => next += 1,
                        Some(_) => {}
                    }
                }
                if u64::from(next) * 8 > self.texels.len() as u64 {
                    return invalid(format!("block {next} lies outside the pool"));
                }
            }
            (level, depth) = (level.end..next, depth + 1);
        }
        if depth - 2 > self.depth {
            return invalid(format!("{} levels in a texture of depth {}", depth - 2, self.depth));
        }
        let blocks = self.texels.len() as u32 / 8;
        match (next..blocks).find(|&b| (0..8).any(|i| self.texels[self.block_texel(b) + self.child_offset(i)] != [0; 4])) {
            Some(b) => invalid(format!("block {b} belongs to no cell but is not empty")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{Level, OctreeParams, Reconstruction};

    /// The root's child 5 is interior (its child 2 a leaf of value 1/2), child 0 a leaf of value 1, the rest empty.
    fn small() -> OctreeTexture {
        let levels = vec![
            Level { interior: vec![1 << 5], leaf: vec![1], value: vec![1.0], range: vec![[1.0, 1.0]], bricks: vec![] },
            Level { interior: vec![0], leaf: vec![1 << 2], value: vec![0.5], range: vec![[0.5, 0.5]], bricks: vec![] },
        ];
        let params = OctreeParams { reconstruction: Reconstruction::Leaf, ..OctreeParams::default() };
        let tree = Octree { root_min: DVec3::ZERO, root_edge: 1.0, value_range: [0.0, 1.0], levels, params, unmet: None };
        assert_eq!((tree.node_count(), tree.empty_count()), (4, 13));
        OctreeTexture::encode(&tree).expect("fits")
    }

    #[test]
    fn packing_is_bit_for_bit_as_documented() {
        let texture = small();
        assert_eq!(texture.size(), UVec3::new(4, 4, 2), "two blocks: n = 2, one layer of blocks kept");
        let mut expected = vec![[0; 4]; 32];
        expected[0] = [255, 255, 255, 10]; // child 0 of block 0 at texel (0, 0, 0)
        expected[16 + 1] = [1, 0, 0, 255]; // child 5 = (1, 0, 1)
        expected[2 + 4] = [0x80, 0, 0, 20]; // child 2 = (0, 1, 0) of block 1, which begins at texel (2, 0, 0)
        assert_eq!(texture.texels(), expected);
        assert_eq!(Node::Leaf { depth: 9, value: 0.5 }.encode(), [0x80, 0, 0, 0x5a]);
        assert_eq!(Node::Interior { block: UVec3::new(3, 0, 1) }.encode(), [3, 0, 1, 255]);
    }

    #[test]
    fn layers_go_on_where_levels_end() {
        // Levels of 1, 8, 20 and 40 blocks: layers of 5 x 5 blocks begin in the middle of some.
        let leaves = |count: usize| (0..count).map(|i| (i * 7 % 101) as f32 / 101.0).collect::<Vec<_>>();
        let mut levels = Vec::new();
        for (blocks, interior) in [(1, 0xffu8), (8, 0), (20, 0b11), (40, 0)] {
            let mut level = Level { interior: vec![interior; blocks], ..Level::default() };
            if blocks == 8 {
                (0..8).for_each(|i| level.interior[i] = if i < 4 { 0b10101 } else { 0b10000001 });
            }
            level.leaf = level.interior.iter().enumerate().map(|(i, interior)| !interior & (0x6f << (i % 3))).collect();
            let count = level.leaf.iter().map(|mask| mask.count_ones() as usize).sum();
            (level.value, level.range) = (leaves(count), vec![[0.0, 1.0]; count]);
            levels.push(level);
        }
        let params = OctreeParams { reconstruction: Reconstruction::Leaf, ..OctreeParams::default() };
        let tree = Octree { root_min: DVec3::ZERO, root_edge: 1.0, value_range: [0.0, 1.0], levels, params, unmet: None };
        let texture = OctreeTexture::encode(&tree).expect("fits");
        assert_eq!((tree.interior_count(), texture.size()), (69, UVec3::new(10, 10, 6)));
        assert_eq!(texture.validate(), Ok(()));
        let mut block = 0;
        for level in &tree.levels {
            let mut values = level.value.iter();
            for (&interior, &leaf) in level.interior.iter().zip(&level.leaf) {
                for i in 0..8 {
                    match Node::decode(texture.texels[texture.block_texel(block) + texture.child_offset(i)]) {
                        Some(Node::Interior { .. }) => assert_eq!(interior >> i & 1, 1, "child {i} of {block}"),
                        Some(Node::Leaf { value, .. }) => {
                            assert_eq!(leaf >> i & 1, 1, "child {i} of {block}");
                            assert!((value - values.next().expect("as many as bits")).abs() < 1e-6, "child {i} of {block}");
                        }
                        _ => assert_eq!((interior | leaf) >> i & 1, 0, "child {i} of {block}"),
                    }
                }
                block += 1;
            }
        }
    }

    #[test]
    fn lookup_descends_by_binary_digits() {
        let texture = small();
        assert_eq!(texture.lookup(DVec3::splat(0.49)), (Node::Leaf { depth: 1, value: 1.0 }, 1));
        let (node, depth) = texture.lookup(DVec3::new(0.5, 0.25, 0.74));
        assert_eq!((node, depth), (Node::decode([0x80, 0, 0, 20]).expect("a leaf"), 2));
        assert_eq!(texture.lookup(DVec3::new(0.75, 0.25, 0.74)), (Node::Empty, 2));
        assert_eq!(texture.lookup(DVec3::new(0.0, 0.5, 0.0)), (Node::Empty, 1));
        assert_eq!(texture.lookup(DVec3::splat(1.0)), (Node::Empty, 0), "cells are half open");
    }

    #[test]
    fn values_survive_to_24_bits() {
        for value in [0.0, 1e-7, 0.1, 0.3333333, 0.9999999, 1.0f32] {
            let Some(Node::Leaf { value: back, depth: 25 }) = Node::decode(Node::Leaf { depth: 25, value }.encode()) else { panic!() };
            assert!((back - value).abs() <= 0.5 / 16_777_215.0 + f32::EPSILON * value, "{value} -> {back}");
        }
    }

    #[test]
    fn validate_sees_damage() {
        for (at, texel) in [(0, [0, 0, 0, 20]), (0, [0, 0, 0, 7]), (17, [0, 0, 0, 255]), (17, [1, 1, 0, 255]), (17, [0; 4])] {
            let mut texture = small();
            texture.texels[at] = texel;
            assert!(texture.validate().is_err(), "{texel:?} at {at}");
        }
    }
}
