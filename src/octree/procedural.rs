//! Octrees from a function instead of a mesh: closed forms and random trees for tests and measurements.

use super::{Level, Octree, OctreeParams, Reconstruction};
use glam::{DVec3, UVec3};

/// What a cell of a procedural octree is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CellKind {
    /// Nothing there.
    Empty,
    /// A leaf with this normalised value, in [0, 1].
    Leaf(f32),
    /// Eight children. At depth 25, the deepest that the texture knows, this counts as empty.
    Split,
}

impl Octree {
    /// Grows an octree over the cube at `root_min` with edge `root_edge`: `kind(position, depth)` says what the cell at `position` is, in
    /// cells of its depth (0 to `2^depth - 1` along each axis). It is asked breadth first, children x fastest, from depth 1 on.
    pub fn from_fn(root_min: DVec3, root_edge: f64, value_range: [f64; 2], mut kind: impl FnMut(UVec3, u8) -> CellKind) -> Self {
        let mut levels = Vec::new();
        let mut parents = vec![UVec3::ZERO];
        while !parents.is_empty() {
            let depth = levels.len() as u8 + 1;
            let (mut level, mut next) = (Level::default(), Vec::new());
            for parent in parents {
                let (mut interior, mut leaf) = (0u8, 0u8);
                for i in 0..8 {
                    let position = parent * 2 + UVec3::new(i & 1, i >> 1 & 1, i >> 2);
                    match kind(position, depth) {
                        CellKind::Split if depth < 25 => {
                            interior |= 1 << i;
                            next.push(position);
                        }
                        CellKind::Leaf(value) => {
                            leaf |= 1 << i;
                            level.value.push(value);
                            level.range.push([value; 2]);
                        }
                        _ => {}
                    }
                }
                level.interior.push(interior);
                level.leaf.push(leaf);
            }
            levels.push(level);
            parents = next;
        }
        let params = OctreeParams { reconstruction: Reconstruction::Leaf, ..OctreeParams::default() };
        Octree { root_min, root_edge, value_range, levels, params, unmet: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{Node, OctreeTexture};

    #[test]
    fn cells_lie_where_they_were_asked_for() {
        // Split towards the far corner; the value names the depth.
        let kind = |at: UVec3, depth: u8| {
            let corner = at == UVec3::splat((1 << depth) - 1);
            if corner && depth < 4 { CellKind::Split } else { CellKind::Leaf(f32::from(depth) / 8.0) }
        };
        let tree = Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], kind);
        assert_eq!(tree.leaves_by_depth(), [0, 7, 7, 7, 8]);
        let texture = OctreeTexture::encode(&tree).expect("fits");
        for (unit, expected) in [(0.1, 1), (0.74, 1), (0.76, 3), (0.9, 4), (0.999, 4)] {
            let (node, depth) = texture.lookup(DVec3::new(0.999, 0.999, unit));
            let expected = if unit < 0.5 {
                1
            } else if unit < 0.75 {
                2
            } else {
                expected
            };
            assert!(matches!(node, Node::Leaf { .. }) && depth == expected, "{unit}: depth {depth}");
        }
    }
}
