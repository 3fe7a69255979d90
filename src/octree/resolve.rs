//! Making the samples of neighbouring leaves agree, so that the reconstructed field has no jump anywhere.
//!
//! A lattice point that lies on a coarser leaf, but is none of its corners, *hangs*: whatever its own sample, the field there is the coarser
//! leaf's, so it takes that value. All other points get one sample of all leaves that touch them. Both need a block's neighbours, which are
//! carried down level by level: a cell's 26 neighbours are children of its parent's.

use super::brick::{Brick, LATTICE, corner_of_child, lattice_point, offset, trilinear};
use super::lattice::{Lattice, Sample};
use super::{Level, Octree};
use glam::{IVec3, UVec3, Vec3};
use rayon::prelude::*;

/// Cells of one depth around a cell, itself in the middle: number `(x + 1) + 3 (y + 1) + 9 (z + 1)` for offsets from -1 to 1.
type Around = [Neighbour; 27];

/// The number of the cell itself.
const SELF: usize = 13;

/// A cell beside another, of the same depth or, where that is a leaf, of a smaller one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Neighbour {
    /// Outside the root, or without tets.
    Empty,
    /// Interior: the number of its block in its level.
    Block(u32),
    /// A leaf: child `child` of block `block` of level `level`.
    Leaf { level: u8, child: u8, block: u32 },
}

/// A block of the level at hand.
struct Place {
    /// The block's cell, in cells of its depth.
    position: UVec3,
    around: Around,
    /// Which child of which block the cell is.
    parent: (u32, u8),
}

/// What the leaves around a lattice point know of it, before they agree.
pub(super) trait OwnSamples: Sync {
    /// What the leaves of block `block` of level `level` know of their lattice point `there`, coordinates 0 to 2. `at` is the same point in
    /// the root cube, in cells of the block's children.
    fn sample(&self, level: usize, block: u32, there: UVec3, at: UVec3) -> Sample;
}

/// Samples that were kept while the tree grew, a lattice a block, level by level.
impl OwnSamples for Vec<Vec<Lattice>> {
    fn sample(&self, level: usize, block: u32, there: UVec3, _: UVec3) -> Sample {
        self[level][block as usize].0[super::brick::lattice_index(there.x, there.y, there.z)]
    }
}

/// Gives every block of the tree its brick.
pub(super) fn resolve(tree: &mut Octree, own: &impl OwnSamples) {
    let mut around = [Neighbour::Empty; 27];
    around[SELF] = Neighbour::Block(0);
    let mut places = vec![Place { position: UVec3::ZERO, around, parent: (0, 0) }];
    for level in 0..tree.levels.len() {
        let bricks = places.par_iter().map(|place| brick(tree, own, level, place)).collect();
        let here = &mut tree.levels[level];
        here.bricks = bricks;
        widen_ranges(here);
        places = below(&tree.levels[level], level, &places);
    }
}

/// The final samples of a block.
fn brick(tree: &Octree, own: &impl OwnSamples, level: usize, place: &Place) -> Brick {
    Brick::encode(&std::array::from_fn(|i| {
        let point = UVec3::from_array(lattice_point(i));
        if level > 0 && point % 2 == UVec3::ZERO {
            // A corner of the block's cell is a lattice point of the parent's block, and settled.
            let (block, child) = place.parent;
            let corner = (point.x / 2) | (point.y / 2) << 1 | (point.z / 2) << 2;
            return tree.levels[level - 1].bricks[block as usize].get(corner_of_child(u32::from(child), corner));
        }
        let mut sample = Sample::default();
        let mut coarsest: Option<(u8, f32)> = None;
        // In the order of their places, which is the same whichever of the blocks asks.
        for (number, step) in touching(point) {
            match place.around[number] {
                Neighbour::Empty => {}
                Neighbour::Block(_) if sample.is_exact() => {}
                Neighbour::Block(block) => {
                    let there = (point.as_ivec3() - 2 * step).as_uvec3();
                    sample.merge(own.sample(level, block, there, place.position * 2 + point));
                }
                Neighbour::Leaf { level: shallow, child, block } => {
                    if coarsest.is_none_or(|(found, _)| shallow < found) {
                        let corners = tree.levels[shallow as usize].bricks[block as usize].corners(u32::from(child));
                        let cell = (place.position.as_ivec3() + step).as_uvec3();
                        coarsest = Some((shallow, trilinear(&corners, within(cell, level, shallow, place.position * 2 + point))));
                    }
                }
            }
        }
        coarsest.map_or_else(|| sample.value(), |(_, value)| value)
    }))
}

/// The cells around a block's cell that touch one of its lattice points, itself included: number and offset, z slowest.
fn touching(point: UVec3) -> impl Iterator<Item = (usize, IVec3)> {
    let steps = |c: u32| match c {
        0 => -1..=0,
        1 => 0..=0,
        _ => 0..=1,
    };
    steps(point.z).flat_map(move |z| {
        steps(point.y).flat_map(move |y| steps(point.x).map(move |x| ((x + 1 + 3 * (y + 1) + 9 * (z + 1)) as usize, IVec3::new(x, y, z))))
    })
}

/// Where in the leaf of level `shallow` that holds `cell` (of the depth of `level`'s cells) a lattice point lies, in [0, 1]^3. `point` is in
/// half cells of that depth.
fn within(cell: UVec3, level: usize, shallow: u8, point: UVec3) -> Vec3 {
    // Children of level l have depth l + 1, the cells of its blocks depth l.
    let up = level as u32 - (u32::from(shallow) + 1);
    let low = (cell >> up) << (up + 1);
    (point - low).as_vec3() / (2u32 << up) as f32
}

/// The blocks of the next level, with their neighbours.
fn below(level: &Level, number: usize, places: &[Place]) -> Vec<Place> {
    let mut first = 0;
    let first_child: Vec<u32> = level.interior.iter().map(|mask| (first, first += mask.count_ones()).0).collect();
    let child_at = |neighbour: Neighbour, child: u32| match neighbour {
        Neighbour::Block(block) => {
            let (interior, leaf) = (level.interior[block as usize], level.leaf[block as usize]);
            if interior >> child & 1 == 1 {
                let before = interior & ((1 << child) - 1);
                Neighbour::Block(first_child[block as usize] + before.count_ones())
            } else if leaf >> child & 1 == 1 {
                Neighbour::Leaf { level: number as u8, child: child as u8, block }
            } else {
                Neighbour::Empty
            }
        }
        other => other,
    };
    let children = |(block, place): (usize, &Place)| {
        let interior = level.interior[block];
        let position = place.position;
        let around = place.around;
        (0..8u32).filter(move |i| interior >> i & 1 == 1).map(move |i| {
            let child = offset(i);
            let at = |number: usize| {
                let step = UVec3::from_array(lattice_point(number)).as_ivec3() - 1;
                let beside = child.as_ivec3() + step; // -1 to 2 in children of the block
                let cell = beside.div_euclid(IVec3::splat(2)) + 1;
                let inside = beside.rem_euclid(IVec3::splat(2));
                child_at(around[(cell.x + 3 * cell.y + 9 * cell.z) as usize], (inside.x + 2 * inside.y + 4 * inside.z) as u32)
            };
            Place { position: position * 2 + child, around: std::array::from_fn(at), parent: (block as u32, i as u8) }
        })
    };
    places.par_iter().enumerate().flat_map_iter(children).collect()
}

/// Extends the ranges of leaves to what the reconstruction takes in them: its extremes lie at corners.
fn widen_ranges(level: &mut Level) {
    let mut leaf = 0;
    for (&mask, brick) in level.leaf.iter().zip(&level.bricks) {
        for i in (0..8).filter(|i| mask >> i & 1 == 1) {
            let range = &mut level.range[leaf];
            for corner in brick.corners(i) {
                *range = [range[0].min(corner), range[1].max(corner)];
            }
            leaf += 1;
        }
    }
}

const _: () = assert!(LATTICE == 27, "neighbours are numbered as lattice points are");

#[cfg(test)]
mod tests {
    use super::super::{Boundary, OctreeParams, OctreeTexture, Reconstruction, Sampling, regularize};
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{Association, ScalarField, TetMesh, collect};
    use crate::progress::Progress;
    use glam::DVec3;

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn point(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    fn ball(tets: u64) -> TetMesh {
        collect(&*plan(Shape::Ball, Some(tets)).expect("a size that can be made")).expect("valid")
    }

    fn field(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
        ScalarField::new("f".into(), Association::Points, mesh.points().iter().map(|&p| f(p)).collect())
    }

    /// Thin waves along one axis on one side, hardly anything on the other: leaves of many depths beside each other.
    fn waves(p: DVec3) -> f64 {
        p.y + (30.0 * p.x).sin() * (p.x + p.z).max(0.0).powi(2)
    }

    fn texture(mesh: &TetMesh, field: &ScalarField, params: &OctreeParams) -> OctreeTexture {
        OctreeTexture::encode(&regularize(mesh, field, params, &Progress::new()).expect("regularizes")).expect("fits")
    }

    fn params(max_depth: u8, tolerance: f64) -> OctreeParams {
        OctreeParams {
            max_depth,
            tolerance: Some(tolerance),
            initial_depth: Some(2),
            max_leaf_tets: 0,
            max_leaf_variance: 0.0,
            boundary: Boundary::Mesh,
            reconstruction: Reconstruction::Continuous,
            ..OctreeParams::default()
        }
    }

    #[test]
    fn there_is_no_jump_across_faces_edges_and_corners() {
        let mesh = ball(12_000);
        let field = field(&mesh, waves);
        for sampling in [Sampling::Tets, Sampling::Vertices, Sampling::Average] {
            let texture = texture(&mesh, &field, &OctreeParams { sampling, ..params(8, 0.1) });
            let (mut random, mut checked, mut mixed) = (Random(1), 0, 0);
            while checked < 60_000 {
                let mut at = random.point();
                let Some((_, depth)) = texture.corners_at(at) else { continue };
                // Onto one, two or three of the leaf's faces.
                let cells = f64::from(1 << depth);
                let axes = 1 + (random.next() * 3.0) as usize;
                for axis in (0..3).cycle().skip((random.next() * 3.0) as usize).take(axes) {
                    at[axis] = (at[axis] * cells).round() / cells;
                }
                let (mut lo, mut hi) = (f32::INFINITY, f32::NEG_INFINITY);
                let mut depths = [u8::MAX, 0];
                for i in 0..8 {
                    let beside = at + (super::offset(i).as_dvec3() - 0.5) * 1e-9;
                    if let (Some(value), Some((_, depth))) = (texture.value_at(beside), texture.corners_at(beside)) {
                        (lo, hi) = (lo.min(value), hi.max(value));
                        depths = [depths[0].min(depth), depths[1].max(depth)];
                    }
                }
                assert!(hi - lo <= 1e-5, "{sampling:?}: a jump of {} at {at}, between depths {depths:?}", hi - lo);
                checked += 1;
                mixed += usize::from(depths[0] < depths[1]);
            }
            assert!(mixed > 10_000, "{mixed} points between leaves of different depths");
        }
    }

    #[test]
    fn a_sampling_that_does_not_converge_divides_no_further() {
        let mesh = ball(6000);
        let field = field(&mesh, |p| p.x + p.y * p.z);
        let nodes = |sampling| {
            let params = OctreeParams { sampling, ..params(7, 0.05) };
            regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes").node_count()
        };
        assert_eq!(nodes(Sampling::Vertices), nodes(Sampling::Tets));
        assert_eq!(nodes(Sampling::Average), nodes(Sampling::Tets));
    }

    #[test]
    fn leaves_by_tolerance_have_the_samples_of_leaves_by_depth() {
        let mesh = ball(6000);
        let field = field(&mesh, |p| p.x + p.y * p.z);
        for sampling in [Sampling::Tets, Sampling::Vertices, Sampling::Average] {
            let at_once = OctreeParams { sampling, initial_depth: Some(3), tolerance: Some(1e6), ..params(4, 0.0) };
            let deepest = OctreeParams { max_depth: 3, tolerance: None, ..at_once.clone() };
            let levels = |params| regularize(&mesh, &field, params, &Progress::new()).expect("regularizes").levels;
            assert!(levels(&at_once) == levels(&deepest), "{sampling:?}");
        }
    }

    #[test]
    fn a_linear_field_comes_back_everywhere_inside() {
        let mesh = ball(6000);
        let field = field(&mesh, |p| 3.0 * p.x - 2.0 * p.y + p.z);
        let uneven = OctreeParams { tolerance: None, max_leaf_tets: 6, initial_depth: Some(1), ..params(6, 0.0) };
        let texture = texture(&mesh, &field, &uneven);
        let (mut random, mut checked) = (Random(2), 0);
        while checked < 20_000 {
            let unit = random.point();
            let at = texture.root_min() + unit * texture.root_edge();
            // Well inside, so that no corner lies outside the mesh.
            if at.length() > 0.6 {
                continue;
            }
            let value = texture.value_at(unit).expect("a leaf");
            let expected = field.normalize(3.0 * at.x - 2.0 * at.y + at.z);
            assert!((f64::from(value) - expected).abs() <= 1e-5, "{value} at {at}, expected {expected}");
            checked += 1;
        }
    }

    #[test]
    fn a_smaller_tolerance_brings_the_field_nearer() {
        let mesh = ball(6000);
        let field = field(&mesh, waves);
        let worst = |tolerance| {
            let tree = regularize(&mesh, &field, &params(8, tolerance), &Progress::new()).expect("regularizes");
            assert!(tree.unmet.is_none_or(|unmet| unmet.worst_rel < 0.1), "{:?}", tree.unmet);
            let texture = OctreeTexture::encode(&tree).expect("fits");
            let (mut random, mut worst) = (Random(3), 0f64);
            for tet in 0..mesh.tets().len() {
                let w = [(); 4].map(|()| -random.next().ln());
                let sum: f64 = w.iter().sum();
                let (p, v) = (mesh.corners(tet), mesh.tets()[tet].map(|i| field.normalize(field.values[i as usize])));
                let at: DVec3 = (0..4).map(|i| p[i] * (w[i] / sum)).sum();
                let expected: f64 = (0..4).map(|i| v[i] * w[i] / sum).sum();
                // Not at the surface, where samples outside the mesh limit what can be met.
                if at.length() < 0.75 * mesh.bounds().max.x {
                    let value = texture.value_at((at - texture.root_min()) / texture.root_edge()).expect("a leaf");
                    worst = worst.max((f64::from(value) - expected).abs());
                }
            }
            worst
        };
        let (coarse, fine) = (worst(0.8), worst(0.05));
        assert!(coarse < 0.2 && fine < 0.05 && fine < coarse / 2.0, "{coarse} {fine}");
        let shallow = regularize(&mesh, &field, &params(4, 0.01), &Progress::new()).expect("regularizes");
        let unmet = shallow.unmet.expect("depth 4 is too coarse");
        assert!(unmet.leaves > 10 && unmet.worst_rel > 0.01 && unmet.at.x + unmet.at.z > 0.0, "{unmet:?}");
    }
}
