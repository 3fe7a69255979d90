//! Making the samples of neighbouring leaves agree, so that the reconstructed field has no jump anywhere.
//!
//! A lattice point that lies on a coarser leaf, but is none of its corners, *hangs*: whatever its own sample, the field there is the coarser
//! leaf's, so it takes that value. All other points get one sample of all leaves that touch them. Both need a block's neighbours, which are
//! carried down level by level: a cell's 26 neighbours are children of its parent's. Most blocks have no leaf beside them, and a mask of the
//! leaves around says so at once.

use super::brick::{Brick, LATTICE, corner_of_child, fixed, lattice_point, offset, trilinear};
use super::lattice::{Lattice, Sample};
use super::{Level, Octree};
use glam::{IVec3, UVec3, Vec3};
use rayon::prelude::*;

/// Cells of one depth around a cell, itself in the middle: number `(x + 1) + 3 (y + 1) + 9 (z + 1)` for offsets from -1 to 1.
type Around = [Neighbour; LATTICE];

/// The children of a block and the ring of cells of their depth around it: number `x + 4 y + 16 z`, the children at 1 and 2.
type Ring = [Neighbour; 64];

/// The number of the cell itself among [`Around`].
const SELF: usize = 13;

/// Blocks that one task takes on, at the most.
const TASK: usize = 256;

/// All lattice points of a block.
const ALL: u32 = (1 << LATTICE) - 1;

/// A cell beside another, of the same depth or, where that is a leaf, of a smaller one. In one word, for there are many:
///
/// ```text
/// bits 0..24     number of the block in its level
/// bits 24..27    which child of the block a leaf is
/// bits 27..32    level of the block whose child a leaf is; 30: interior, the block is the cell's own; 31: empty
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
struct Neighbour(u32);

impl Neighbour {
    /// Outside the root, or without anything in it.
    const EMPTY: Self = Neighbour(31 << 27);

    fn block(number: u32) -> Self {
        Neighbour(30 << 27 | number)
    }

    fn leaf(level: usize, child: u32, block: u32) -> Self {
        Neighbour((level as u32) << 27 | child << 24 | block)
    }

    fn is_leaf(self) -> bool {
        self.0 >> 27 < 30
    }

    /// The cell's own block, if it is interior.
    fn own_block(self) -> Option<u32> {
        (self.0 >> 27 == 30).then_some(self.number())
    }

    fn level(self) -> usize {
        (self.0 >> 27) as usize
    }

    fn child(self) -> u32 {
        self.0 >> 24 & 7
    }

    fn number(self) -> u32 {
        self.0 & 0xff_ffff
    }
}

/// A block of the level at hand that has blocks below it.
struct Place {
    block: u32,
    /// The block's cell, in cells of its depth.
    position: UVec3,
    around: Around,
    /// The lattice points whose samples may be others than those that the block's own leaves know, one bit each.
    changed: u32,
}

/// Some neighbouring blocks of one parent level: what of the level below is theirs.
struct Task<'a> {
    places: &'a [Place],
    /// The number of the first block, and bricks and ranges of leaves from it on.
    first: u32,
    bricks: &'a mut [Brick],
    ranges: &'a mut [[f32; 2]],
}

/// Makes the bricks of all blocks agree.
///
/// `own` is what the leaves of each block know of its lattice points, level by level. Without it bricks hold the samples already, and all
/// that touch a point hold the same.
pub(super) fn resolve(tree: &mut Octree, own: Option<&[Vec<Lattice>]>) {
    if let Some(own) = own {
        for (level, own) in tree.levels.iter_mut().zip(own) {
            level.bricks = vec![Brick::default(); own.len()];
        }
        tree.levels[0].bricks[0] = Brick::encode(&own[0][0].0.map(Sample::value));
    }
    let root = &mut tree.levels[0];
    widen_ranges(&root.leaf, &root.bricks, &mut root.range);
    let mut around = [Neighbour::EMPTY; LATTICE];
    around[SELF] = Neighbour::block(0);
    let changed = if own.is_some() { ALL } else { 0 };
    let mut places = vec![vec![Place { block: 0, position: UVec3::ZERO, around, changed }]];
    for number in 1..tree.levels.len() {
        let (above, below) = tree.levels.split_at_mut(number);
        let Level { interior, leaf, bricks, range, .. } = &mut below[0];
        let done = Above::new(above);
        let below = Below { level: number, interior, leaf, own: own.map(|own| &own[number][..]) };
        let tasks = tasks(&places, &done, leaf, bricks, range);
        places = tasks.into_par_iter().map(|task| task.run(&done, &below)).collect();
    }
}

/// Parts the work on a level among tasks: blocks below neighbouring places are neighbours too.
fn tasks<'a>(
    places: &'a [Vec<Place>],
    above: &Above,
    leaf: &[u8],
    mut bricks: &'a mut [Brick],
    mut ranges: &'a mut [[f32; 2]],
) -> Vec<Task<'a>> {
    let mut tasks = Vec::new();
    let mut first = 0;
    for places in places.iter().flat_map(|places| places.chunks(TASK)) {
        let blocks: u32 = places.iter().map(|place| above.last().interior[place.block as usize].count_ones()).sum();
        let leaves: u32 = leaf[first as usize..][..blocks as usize].iter().map(|mask| mask.count_ones()).sum();
        let (here, rest) = bricks.split_at_mut(blocks as usize);
        let (here_ranges, rest_ranges) = ranges.split_at_mut(leaves as usize);
        tasks.push(Task { places, first, bricks: here, ranges: here_ranges });
        (first, bricks, ranges) = (first + blocks, rest, rest_ranges);
    }
    tasks
}

/// The levels that are settled.
struct Above<'a> {
    levels: &'a [Level],
    /// Of the last of them, the number of each block's first interior child in the level below.
    first_child: Vec<u32>,
}

/// The level at hand.
struct Below<'a> {
    level: usize,
    interior: &'a [u8],
    leaf: &'a [u8],
    own: Option<&'a [Lattice]>,
}

impl<'a> Above<'a> {
    fn new(levels: &'a [Level]) -> Self {
        let mut first = 0;
        let last = levels.last().map_or(&[][..], |level| &level.interior);
        let first_child = last.iter().map(|mask| (first, first += mask.count_ones()).0).collect();
        Above { levels, first_child }
    }

    fn last(&self) -> &'a Level {
        &self.levels[self.levels.len() - 1]
    }

    /// The children of a block and what lies around them, and which of that are leaves.
    fn ring(&self, place: &Place) -> (Ring, u64) {
        let number = self.levels.len() - 1;
        let level = self.last();
        let mut ring = [Neighbour::EMPTY; 64];
        let mut leaves = 0;
        for (i, cell) in ring.iter_mut().enumerate() {
            let (x, y, z) = ((i & 3) + 1, (i >> 2 & 3) + 1, (i >> 4) + 1);
            let beside = place.around[x / 2 + 3 * (y / 2) + 9 * (z / 2)];
            let child = (x & 1 | (y & 1) << 1 | (z & 1) << 2) as u32;
            *cell = match beside.own_block() {
                None => beside,
                Some(block) => {
                    let (interior, leaf) = (level.interior[block as usize], level.leaf[block as usize]);
                    if interior >> child & 1 == 1 {
                        let before = interior & ((1 << child) - 1);
                        Neighbour::block(self.first_child[block as usize] + before.count_ones())
                    } else if leaf >> child & 1 == 1 {
                        Neighbour::leaf(number, child, block)
                    } else {
                        Neighbour::EMPTY
                    }
                }
            };
            leaves |= u64::from(cell.is_leaf()) << i;
        }
        (ring, leaves)
    }
}

impl Task<'_> {
    /// Settles the blocks below the places; returns those of them that have blocks below in their turn.
    fn run(self, above: &Above, below: &Below) -> Vec<Place> {
        let mut next = Vec::new();
        let mut number = self.first;
        for place in self.places {
            let (ring, leaves) = above.ring(place);
            let interior = above.last().interior[place.block as usize];
            let parent = &above.last().bricks[place.block as usize];
            for i in (0..8).filter(|&i| interior >> i & 1 == 1) {
                let position = place.position * 2 + offset(i);
                let brick = &mut self.bricks[(number - self.first) as usize];
                let child = Child { i, position, ring: &ring, leaves };
                let changed = child.settle(brick, place.changed, parent, above, below);
                if below.interior[number as usize] != 0 {
                    next.push(Place { block: number, position, around: child.around(), changed });
                }
                number += 1;
            }
        }
        widen_ranges(&below.leaf[self.first as usize..number as usize], self.bricks, self.ranges);
        next
    }
}

/// An interior child of a block: what its own block's lattice points touch.
struct Child<'a> {
    /// Which child.
    i: u32,
    /// The cell, in cells of its depth.
    position: UVec3,
    /// Around its parent's block.
    ring: &'a Ring,
    /// Which of the ring are leaves.
    leaves: u64,
}

impl Child<'_> {
    /// The number of the child in the ring, less that of child 0.
    fn shift(&self) -> u32 {
        (self.i & 1) + (self.i >> 1 & 1) * 4 + (self.i >> 2) * 16
    }

    /// Makes the child's brick final; returns which lattice points may be others than its own leaves know.
    fn settle(&self, brick: &mut Brick, parent_changed: u32, parent: &Brick, above: &Above, below: &Below) -> u32 {
        let mut changed = 0;
        // A corner of the child is a lattice point of the parent's block, and settled.
        for k in 0..8 {
            let there = corner_of_child(self.i, k);
            if parent_changed >> there & 1 == 1 {
                let here = lattice_corner(k);
                brick.set_number(here, parent.number(there));
                changed |= 1 << here;
            }
        }
        if below.own.is_none() && self.leaves == 0 {
            return changed;
        }
        for point in (0..LATTICE).filter(|&point| CORNERS >> point & 1 == 0) {
            let touched = self.leaves & TOUCHED[point] << self.shift();
            let value = if touched != 0 {
                self.on_coarsest(point, touched, above, below.level)
            } else if let Some(own) = below.own {
                self.merged(point, own)
            } else {
                continue;
            };
            brick.set_number(point, fixed(value));
            changed |= 1 << point;
        }
        changed
    }

    /// The reconstruction at a lattice point in the coarsest of the leaves that touch it.
    fn on_coarsest(&self, point: usize, touched: u64, above: &Above, level: usize) -> f32 {
        // Of equals the first in the order of their places, which is the same whichever of the blocks asks.
        let leaf = |number: usize| (self.ring[number].level(), number);
        let mut coarsest = leaf(touched.trailing_zeros() as usize);
        let mut rest = touched & (touched - 1);
        while rest != 0 {
            coarsest = coarsest.min(leaf(rest.trailing_zeros() as usize));
            rest &= rest - 1;
        }
        let (shallow, number) = coarsest;
        let leaf = self.ring[number];
        let corners = above.levels[shallow].bricks[leaf.number() as usize].corners(leaf.child());
        let place = UVec3::new(number as u32 & 3, number as u32 >> 2 & 3, number as u32 >> 4).as_ivec3() - 1;
        let cell = ((self.position - offset(self.i)).as_ivec3() + place).as_uvec3();
        let at = within(cell, level, shallow, self.position * 2 + UVec3::from_array(lattice_point(point)));
        trilinear(&corners, at)
    }

    /// What all blocks that touch a lattice point know of it together.
    fn merged(&self, point: usize, own: &[Lattice]) -> f32 {
        let mut sample = Sample::default();
        let at = UVec3::from_array(lattice_point(point)).as_ivec3();
        let mut touched = TOUCHED[point] << self.shift();
        while touched != 0 && !sample.is_exact() {
            let number = touched.trailing_zeros();
            if let Some(block) = self.ring[number as usize].own_block() {
                let step = IVec3::new((number & 3) as i32, (number >> 2 & 3) as i32, (number >> 4) as i32) - offset(self.i).as_ivec3() - 1;
                let there = (at - 2 * step).as_uvec3();
                sample.merge(own[block as usize].0[super::brick::lattice_index(there.x, there.y, there.z)]);
            }
            touched &= touched - 1;
        }
        sample.value()
    }

    /// The cells around the child.
    fn around(&self) -> Around {
        let shift = self.shift() as usize;
        let mut around = [Neighbour::EMPTY; LATTICE];
        for i in 0..LATTICE {
            around[i] = self.ring[i % 3 + i / 3 % 3 * 4 + i / 9 * 16 + shift];
        }
        around
    }
}

/// The lattice point that is corner `k` of the block's own cell.
const fn lattice_corner(k: u32) -> usize {
    (2 * (k & 1) + 6 * (k >> 1 & 1) + 18 * (k >> 2)) as usize
}

/// The lattice points that are corners of the block's own cell.
const CORNERS: u32 = {
    let (mut all, mut k) = (0, 0);
    while k < 8 {
        all |= 1 << lattice_corner(k);
        k += 1;
    }
    all
};

/// Whether a cell's ends hold a lattice point of child 0's block, along one axis of the ring.
const fn touches(point: u32, cell: u32) -> bool {
    2 * cell <= point + 2 && point <= 2 * cell
}

/// Which cells of the ring touch each lattice point of child 0's block.
const TOUCHED: [u64; LATTICE] = {
    let mut all = [0; LATTICE];
    let mut i = 0;
    while i < LATTICE * 64 {
        let (point, cell) = (lattice_point(i / 64), i % 64);
        let cell = [cell as u32 & 3, cell as u32 >> 2 & 3, cell as u32 >> 4];
        // The child's own cell is at 1, its block's lattice point c at 1 + c / 2.
        if touches(point[0], cell[0]) && touches(point[1], cell[1]) && touches(point[2], cell[2]) {
            all[i / 64] |= 1 << (i % 64);
        }
        i += 1;
    }
    all
};

/// Where in the leaf of level `shallow` that holds `cell` (of the depth of `level`'s cells) a lattice point lies, in [0, 1]^3. `point` is in
/// half cells of that depth.
fn within(cell: UVec3, level: usize, shallow: usize, point: UVec3) -> Vec3 {
    // Children of level l have depth l + 1, the cells of its blocks depth l.
    let up = (level - (shallow + 1)) as u32;
    let low = (cell >> up) << (up + 1);
    (point - low).as_vec3() / (2u32 << up) as f32
}

/// Extends the ranges of blocks' leaves to what the reconstruction takes in them: its extremes lie at corners.
fn widen_ranges(leaf: &[u8], bricks: &[Brick], ranges: &mut [[f32; 2]]) {
    let mut next = 0;
    for (&mask, brick) in leaf.iter().zip(bricks).filter(|(mask, _)| **mask != 0) {
        let extremes = brick.extremes();
        for i in (0..8).filter(|i| mask >> i & 1 == 1) {
            let range = &mut ranges[next];
            *range = [range[0].min(extremes[i][0]), range[1].max(extremes[i][1])];
            next += 1;
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
