//! The leaves of an octree as boxes: those that a plane cuts, and those next to a place.

use super::texture::{Node, OctreeTexture};
use glam::{DVec3, UVec3};

/// A full leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafBox {
    /// Its lowest corner in the root cube, which is [0, 1)^3.
    pub low: DVec3,
    /// Its edge there.
    pub edge: f64,
    /// Its depth, from 1.
    pub depth: u8,
}

impl OctreeTexture {
    /// Calls `each` with the full leaves, depth first. Cells, lowest corner and edge in the root cube, for which `is_wanted` does not hold are
    /// left out with all that is in them.
    pub fn each_leaf(&self, is_wanted: impl Fn(DVec3, f64) -> bool, mut each: impl FnMut(LeafBox)) {
        let mut blocks = if self.depth() == 0 { vec![] } else { vec![(UVec3::ZERO, DVec3::ZERO, 1u8)] };
        while let Some((block, low, depth)) = blocks.pop() {
            let edge = (-f64::from(depth)).exp2();
            for i in 0..8 {
                let child = UVec3::new(i & 1, i >> 1 & 1, i >> 2);
                let low = low + child.as_dvec3() * edge;
                match self.node(block * 2 + child) {
                    Node::Empty => {}
                    _ if !is_wanted(low, edge) => {}
                    Node::Interior { block } => blocks.push((block, low, depth + 1)),
                    Node::Leaf { depth, .. } => each(LeafBox { low, edge, depth }),
                }
            }
        }
    }

    /// The full leaves that the plane across an axis (0, 1, 2) at a position in the root cube cuts. A leaf has its lower face and not its
    /// upper one, so that each point of the plane is in one leaf at most.
    pub fn leaves_cut(&self, axis: usize, position: f64) -> Vec<LeafBox> {
        let mut leaves = Vec::new();
        self.each_leaf(|low, edge| low[axis] <= position && position < low[axis] + edge, |leaf| leaves.push(leaf));
        leaves
    }

    /// Of the full leaves the `limit` ones whose centres are nearest to a place in the root cube's coordinates, and how many there are in all.
    pub fn nearest_leaves(&self, place: DVec3, limit: usize) -> (Vec<LeafBox>, usize) {
        let mut leaves = Vec::new();
        self.each_leaf(|_, _| true, |leaf| leaves.push(leaf));
        let all = leaves.len();
        let distance = |leaf: &LeafBox| (leaf.low + leaf.edge / 2.0).distance_squared(place);
        if limit < all {
            leaves.select_nth_unstable_by(limit, |a, b| distance(a).total_cmp(&distance(b)));
            leaves.truncate(limit);
        }
        (leaves, all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{CellKind, Octree};

    /// Deep towards the origin; beyond x = 3/4 there is nothing.
    fn texture() -> OctreeTexture {
        let kind = |at: UVec3, depth: u8| {
            let low = at.as_dvec3() / f64::from(1u32 << depth);
            match depth {
                d if low.x >= 0.75 && d >= 2 => CellKind::Empty,
                d if d < 2 || (low.max_element() == 0.0 && d < 6) => CellKind::Split,
                d => CellKind::Leaf(f32::from(d) / 10.0),
            }
        };
        OctreeTexture::encode(&Octree::from_fn(DVec3::ZERO, 1.0, [0.0, 1.0], kind)).expect("fits")
    }

    #[test]
    fn the_leaves_on_a_plane_fill_it_once() {
        let texture = texture();
        for (position, axis, area) in [(0.001, 0, 1.0), (0.3, 0, 1.0), (0.5, 0, 1.0), (0.8, 0, 0.0), (0.001, 1, 0.75), (0.999, 2, 0.75)] {
            let leaves = texture.leaves_cut(axis, position);
            let found: f64 = leaves.iter().map(|leaf| leaf.edge * leaf.edge).sum();
            assert_eq!(found, area, "at {position} of axis {axis}");
            assert!(leaves.iter().all(|leaf| leaf.edge == (-f64::from(leaf.depth)).exp2()));
        }
        assert_eq!(texture.leaves_cut(2, 0.0001).iter().map(|leaf| leaf.depth).max(), Some(6));
        assert!(texture.leaves_cut(0, -0.1).is_empty());
    }

    #[test]
    fn the_nearest_are_nearer_than_the_rest() {
        let texture = texture();
        let (all, count) = texture.nearest_leaves(DVec3::ZERO, usize::MAX);
        assert_eq!((all.len(), all.iter().map(|leaf| leaf.edge.powi(3)).sum::<f64>()), (count, 0.75));
        let place = DVec3::new(-0.2, 0.4, 0.1);
        let distance = |leaf: &LeafBox| (leaf.low + leaf.edge / 2.0).distance(place);
        let (near, of) = texture.nearest_leaves(place, 20);
        let farthest = near.iter().map(distance).fold(0.0, f64::max);
        assert_eq!((near.len(), of), (20, count));
        assert!(all.iter().filter(|leaf| !near.contains(leaf)).all(|leaf| distance(leaf) >= farthest));
    }
}
