//! Regularization: the paper's uniform and refinement stages (method 1.1), parallel over cells, the same bytes for any number of threads.

use super::lattice::{Lattice, Sample};
use super::resolve::resolve;
use super::sampling::{Leaf, Look, Scratch, Source};
use super::{Level, Octree, OctreeParams, ParamsError, Reconstruction, Unmet};
use crate::geometry::{TetPlanes, octants};
use crate::mesh::{ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use glam::{DVec3, UVec3, Vec3};
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Cells with at most this many tets are worked on by one thread, deeper cells with them.
const TASK_TETS: usize = 3000;

/// More interior cells than this cannot be addressed by an octree texture.
pub(super) const MAX_BLOCKS: usize = 1 << 24;

/// Why a mesh or a volume could not be regularized.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegularizeError {
    /// A parameter is out of range.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The thresholds ask for more than a texture can hold.
    #[error(
        "these thresholds need more than {MAX_BLOCKS} interior cells, the most that an octree texture can address; lower max_depth or initial_depth, or raise max_leaf_tets or max_leaf_variance"
    )]
    TooLarge,
}

/// Regularizes the field of a mesh into an adaptive octree.
///
/// 1. *Uniform stage*: every non-empty cell is divided down to [`OctreeParams::uniform_depth`].
/// 2. *Refinement stage*: a cell with fewer than V tets, or whose distinct vertices' scalars have a variance below W, or in which the
///    reconstruction errs by no more than the tolerance, or at the maximum depth, is a leaf; every other is divided.
/// 3. *Sampling*: each leaf gets its value by [`super::Sampling`], its range, and for [`Reconstruction::Continuous`] samples at its corners;
///    [`super::Boundary`] says which leaves count.
/// 4. Leaves agree on the corners they share, and fine ones give way to coarse ones at corners that hang.
///
/// The error in a cell is an estimate: the largest found at its 27 lattice points and at the vertices of the mesh inside it, before leaves
/// agree. [`Octree::unmet`] says where the tolerance is not met at the maximum depth.
///
/// A cell's tets are those that overlap it exactly, not by their bounds. Deterministic: the tree does not depend on the number of threads.
pub fn regularize(mesh: &TetMesh, field: &ScalarField, params: &OctreeParams, progress: &Progress) -> Result<Octree, RegularizeError> {
    params.validate()?;
    let source = Source::new(mesh, field);
    let usable: Vec<u32> = (0..mesh.tets().len() as u32).into_par_iter().filter(|&t| field.is_usable(mesh, t as usize)).collect();
    progress.begin("regularizing", Cell::ROOT.share());
    let (root_min, root_edge) = mesh.root_cube();
    let work = Regularizer {
        uniform_depth: params.uniform_depth(usable.len()),
        root_min,
        root_edge,
        source,
        params,
        progress,
        blocks: AtomicUsize::new(0),
        scratch: Mutex::default(),
        unmet: Mutex::default(),
    };
    // The root is divided whatever it holds: depth 0 has no leaf.
    let (grown, _) = work.divide(Cell::ROOT, &usable)?;
    let (levels, lattices): (Vec<_>, Vec<_>) = grown.into_iter().map(|g| (g.level, g.lattices)).unzip();
    let unmet = work.unmet.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    let unmet = unmet.filter(|_| params.tolerance.is_some());
    let mut tree = Octree { root_min: work.root_min, root_edge, value_range: field.range, levels, params: params.clone(), unmet };
    if params.reconstruction == Reconstruction::Continuous {
        progress.check()?;
        resolve(&mut tree, Some(&lattices));
    }
    Ok(tree)
}

/// An upper bound of the bytes that [`regularize`] takes beside the mesh, for thresholds whose tree is not larger than the mesh: 400 a
/// tet, and 8 a point and thread.
pub fn working_bytes(mesh: &TetMesh) -> u64 {
    400 * mesh.tets().len() as u64 + 8 * (mesh.points().len() * rayon::current_num_threads()) as u64
}

/// A cell by depth and integer position at that depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub depth: u8,
    pub index: UVec3,
}

impl Cell {
    pub const ROOT: Cell = Cell { depth: 0, index: UVec3::ZERO };

    /// The cell's part of the work as progress counts it: its volume, in cells of depth 8.
    pub fn share(self) -> u64 {
        1 << (24 - 3 * u32::from(self.depth.min(8)))
    }

    pub fn child(self, i: u32) -> Cell {
        Cell { depth: self.depth + 1, index: self.index * 2 + UVec3::new(i & 1, i >> 1 & 1, i >> 2) }
    }
}

/// A level while the tree grows.
#[derive(Default)]
struct Growing {
    level: Level,
    /// What leaves know of the lattice points of each block; empty without [`Reconstruction::Continuous`].
    lattices: Vec<Lattice>,
}

/// What became of a cell of the upper levels.
enum Outcome {
    Empty,
    Leaf(Leaf),
    Interior(Vec<Growing>, [Sample; 8]),
}

struct Regularizer<'a> {
    source: Source<'a>,
    params: &'a OctreeParams,
    progress: &'a Progress,
    uniform_depth: u8,
    root_min: DVec3,
    root_edge: f64,
    blocks: AtomicUsize,
    scratch: Mutex<Vec<Scratch>>,
    unmet: Mutex<Option<Unmet>>,
}

impl Regularizer<'_> {
    /// Decides what a cell is; `tets` are those that overlap it.
    fn build(&self, cell: Cell, tets: &[u32]) -> Result<Outcome, RegularizeError> {
        if tets.is_empty() {
            self.progress.add(cell.share());
            return Ok(Outcome::Empty);
        }
        let settled = self.with_scratch(|scratch| {
            let is_task = tets.len() <= TASK_TETS;
            if !is_task && !self.verdict(cell, tets, scratch).is_leaf() {
                return Ok(None);
            }
            let all = self.localize(cell, tets, scratch);
            let verdict = if is_task { self.verdict_local(cell.depth, &all, Vec3::ZERO, 1.0, scratch) } else { Verdict::Leaf };
            if !verdict.is_leaf() {
                return self.divide_task(cell, &all, scratch).map(|(levels, corners)| Some(Outcome::Interior(levels, corners)));
            }
            let leaf = self.sample(verdict, &all, Vec3::ZERO, 1.0, scratch);
            self.progress.add(cell.share());
            Ok(Some(leaf.map_or(Outcome::Empty, Outcome::Leaf)))
        })?;
        match settled {
            Some(outcome) => Ok(outcome),
            None => self.divide(cell, tets).map(|(levels, corners)| Outcome::Interior(levels, corners)),
        }
    }

    /// The blocks of a cell of at most [`TASK_TETS`] tets, which the thread's working memory holds.
    fn divide_task(&self, cell: Cell, all: &[u32], scratch: &mut Scratch) -> Result<(Vec<Growing>, [Sample; 8]), RegularizeError> {
        let mut levels = Vec::new();
        let corners = self.divide_local(cell.depth, Vec3::ZERO, 1.0, all, scratch, &mut levels, 0)?;
        self.progress.add(cell.share());
        Ok((levels, corners))
    }

    /// The leaf at a place of a task's cell.
    fn sample(&self, verdict: Verdict, tets: &[u32], center: Vec3, half: f32, scratch: &mut Scratch) -> Option<Leaf> {
        if verdict == Verdict::Deepest {
            self.note_if_unmet(tets, center, half, scratch);
        }
        scratch.local.sample(&self.source, self.params, tets, center, half, &mut scratch.visited)
    }

    /// The blocks of an interior cell and all below it, and what is known of the cell's corners.
    fn divide(&self, cell: Cell, tets: &[u32]) -> Result<(Vec<Growing>, [Sample; 8]), RegularizeError> {
        if tets.len() <= TASK_TETS {
            return self.with_scratch(|scratch| {
                let all = self.localize(cell, tets, scratch);
                self.divide_task(cell, &all, scratch)
            });
        }
        self.add_block()?;
        let lists = self.distribute(cell, tets)?;
        let outcomes: Vec<Outcome> =
            (0..8u32).into_par_iter().map(|i| self.build(cell.child(i), &lists[i as usize])).collect::<Result<_, _>>()?;
        let mut block = Level { interior: vec![0], leaf: vec![0], ..Level::default() };
        let mut lattice = Lattice::default();
        let mut below: Vec<Growing> = Vec::new();
        for (i, outcome) in (0..8).zip(outcomes) {
            match outcome {
                Outcome::Empty => {}
                Outcome::Leaf(leaf) => {
                    block.leaf[0] |= 1 << i;
                    block.value.push(leaf.value);
                    block.range.push(leaf.range);
                    lattice.merge_child(i, &leaf.corners);
                }
                Outcome::Interior(levels, corners) => {
                    block.interior[0] |= 1 << i;
                    lattice.merge_child(i, &corners);
                    append(&mut below, levels);
                }
            }
        }
        let lattices = if self.keeps_lattices() { vec![lattice] } else { vec![] };
        below.insert(0, Growing { level: block, lattices });
        Ok((below, lattice.corners()))
    }

    /// Hands the tets of a large cell to its children, in parallel, keeping their order.
    fn distribute(&self, cell: Cell, tets: &[u32]) -> Result<[Vec<u32>; 8], RegularizeError> {
        let parts: Vec<[Vec<u32>; 8]> = tets
            .par_chunks(4096)
            .map(|chunk| {
                self.progress.check()?;
                let (center, half) = self.center_and_half(cell);
                let (mut planes, mut masks) = (TetPlanes::default(), Vec::new());
                let mut children: [Vec<u32>; 8] = Default::default();
                for &tet in chunk {
                    let p = self.source.local_corners(tet, center, half);
                    let (low, high) = (p[0].min(p[1]).min(p[2]).min(p[3]), p[0].max(p[1]).max(p[2]).max(p[3]));
                    let mut mask = octants(low.as_vec3(), high.as_vec3(), Vec3::ZERO);
                    if mask.count_ones() > 1 {
                        planes.clear();
                        planes.push(&p);
                        masks.clear();
                        planes.child_masks(&[0], Vec3::ZERO, 0.5, &mut masks);
                        mask = masks[0];
                    }
                    while mask != 0 {
                        children[mask.trailing_zeros() as usize].push(tet);
                        mask &= mask - 1;
                    }
                }
                Ok(children)
            })
            .collect::<Result<_, Cancelled>>()?;
        Ok(std::array::from_fn(|i| parts.iter().flat_map(|children| &children[i]).copied().collect()))
    }

    /// Divides an interior cell of a task. `tets` are local numbers of those that overlap it; `center` and `half` its place in the
    /// task cell's coordinates, where the task cell is [-1, 1]^3. Blocks go to `levels`, this cell's to `levels[level]`. Gives what is
    /// known of the cell's corners.
    fn divide_local(
        &self,
        depth: u8,
        center: Vec3,
        half: f32,
        tets: &[u32],
        scratch: &mut Scratch,
        levels: &mut Vec<Growing>,
        level: usize,
    ) -> Result<[Sample; 8], RegularizeError> {
        self.add_block()?;
        if levels.len() == level {
            levels.push(Growing::default());
        }
        let quarter = half * 0.5;
        let mut masks = scratch.take_masks();
        scratch.local.planes.child_masks(tets, center, quarter, &mut masks);
        let (mut interior, mut leaf) = (0u8, 0u8);
        let mut lattice = Lattice::default();
        let mut inside = scratch.take_list();
        for i in 0..8u32 {
            inside.clear();
            for (&tet, &mask) in tets.iter().zip(&masks) {
                if mask >> i & 1 == 1 {
                    inside.push(tet);
                }
            }
            if inside.is_empty() {
                continue;
            }
            let sign = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
            let child = center + sign * quarter;
            let verdict = self.verdict_local(depth + 1, &inside, child, quarter, scratch);
            if verdict.is_leaf() {
                if let Some(sample) = self.sample(verdict, &inside, child, quarter, scratch) {
                    leaf |= 1 << i;
                    levels[level].level.value.push(sample.value);
                    levels[level].level.range.push(sample.range);
                    lattice.merge_child(i, &sample.corners);
                }
            } else {
                interior |= 1 << i;
                let corners = self.divide_local(depth + 1, child, quarter, &inside, scratch, levels, level + 1)?;
                lattice.merge_child(i, &corners);
            }
        }
        levels[level].level.interior.push(interior);
        levels[level].level.leaf.push(leaf);
        if self.keeps_lattices() {
            levels[level].lattices.push(lattice);
        }
        scratch.give_back(masks, inside);
        Ok(lattice.corners())
    }

    fn keeps_lattices(&self) -> bool {
        self.params.reconstruction == Reconstruction::Continuous
    }

    /// The refinement stage's rule for a cell with more tets than a task takes: its error is not asked for, unless nothing varies.
    fn verdict(&self, cell: Cell, tets: &[u32], scratch: &mut Scratch) -> Verdict {
        let Scratch { visited, .. } = scratch;
        if let Some(verdict) = self.verdict_by_count(cell.depth, tets.len()) {
            return verdict;
        }
        let (max_variance, tolerance) = (self.params.max_leaf_variance, self.params.tolerance);
        if max_variance > 0.0 && visited.variance(&self.source, tets.iter().copied()) < max_variance {
            return Verdict::Leaf;
        }
        let mut spread = || {
            let [lo, hi] = visited.range(&self.source, tets.iter().copied());
            f64::from(hi - lo)
        };
        if tolerance.is_some_and(|tolerance| spread() <= f64::from(allowed_error(tolerance, cell.depth))) {
            Verdict::Leaf
        } else {
            Verdict::Interior
        }
    }

    /// The refinement stage's rule for a cell of a task.
    fn verdict_local(&self, depth: u8, tets: &[u32], center: Vec3, half: f32, scratch: &mut Scratch) -> Verdict {
        if let Some(verdict) = self.verdict_by_count(depth, tets.len()) {
            return verdict;
        }
        let Scratch { local, visited, .. } = scratch;
        let (max_variance, tolerance) = (self.params.max_leaf_variance, self.params.tolerance);
        if max_variance > 0.0 && visited.variance(&self.source, tets.iter().map(|&t| local.ids[t as usize])) < max_variance {
            return Verdict::Leaf;
        }
        let meets = |tolerance: f64| {
            let tolerance = allowed_error(tolerance, depth);
            local.error(&self.source, self.params, Look::Close, tolerance, tets, center, half, visited) <= tolerance
        };
        if tolerance.is_some_and(meets) { Verdict::Leaf } else { Verdict::Interior }
    }

    /// What depth and number of tets alone decide.
    fn verdict_by_count(&self, depth: u8, tets: usize) -> Option<Verdict> {
        if depth >= self.params.max_depth {
            Some(Verdict::Deepest)
        } else if depth < self.uniform_depth {
            Some(Verdict::Interior)
        } else {
            (tets < self.params.max_leaf_tets as usize).then_some(Verdict::Leaf)
        }
    }

    /// Notes a leaf of the greatest depth in which the tolerance is not met.
    fn note_if_unmet(&self, tets: &[u32], center: Vec3, half: f32, scratch: &mut Scratch) {
        let Some(tolerance) = self.params.tolerance else { return };
        let tolerance = f64::from(allowed_error(tolerance, self.params.max_depth));
        let Scratch { local, visited, .. } = scratch;
        let error = local.error(&self.source, self.params, Look::Quick, f32::INFINITY, tets, center, half, visited);
        if f64::from(error) <= tolerance {
            return;
        }
        let one = Unmet { leaves: 1, worst_rel: error, at: local.place(center) };
        let mut all = self.unmet.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        *all = Some(all.map_or(one, |before| before.and(one)));
    }

    fn center_and_half(&self, cell: Cell) -> (DVec3, f64) {
        let edge = self.root_edge / f64::from(1u32 << cell.depth);
        (self.root_min + (cell.index.as_dvec3() + 0.5) * edge, edge / 2.0)
    }

    /// Takes up a task's tets; gives their local numbers.
    fn localize(&self, cell: Cell, tets: &[u32], scratch: &mut Scratch) -> Vec<u32> {
        let (center, half) = self.center_and_half(cell);
        scratch.local.prepare(&self.source, tets, center, half);
        (0..tets.len() as u32).collect()
    }

    /// Counts a block; stops where there are too many, or on request.
    fn add_block(&self) -> Result<(), RegularizeError> {
        self.progress.check()?;
        if self.blocks.fetch_add(1, Relaxed) >= MAX_BLOCKS { Err(RegularizeError::TooLarge) } else { Ok(()) }
    }

    /// Lends a thread its own working memory, kept from task to task.
    fn with_scratch<R>(&self, work: impl FnOnce(&mut Scratch) -> R) -> R {
        let pool = || self.scratch.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let mut scratch = pool().pop().unwrap_or_else(|| Scratch::new(self.source.point_count()));
        let result = work(&mut scratch);
        pool().push(scratch);
        result
    }
}

/// Cells of this depth and deeper are held to the tolerance itself.
const EVEN_DEPTH: u8 = 8;

/// No cell is divided for less: bricks round samples by up to twice as much.
const ROUNDING: f64 = 2e-6;

/// The error that a cell may have under a tolerance: a quarter for each level above [`EVEN_DEPTH`].
///
/// What is seen of an error is its integral along rays and over pixels: a cell of edge h and error e adds about (e h)^2 to each of h^2 / pixel
/// area squares. Splitting costs eight leaves whatever h is, so the picture gains most for its bytes where e h^2 is the same in all leaves. Held
/// to one tolerance at all sizes, the few large cells, whose small errors have one sign over long ways, would spoil the picture.
pub(super) fn allowed_error(tolerance: f64, depth: u8) -> f32 {
    (tolerance * 0.25f64.powi(i32::from(EVEN_DEPTH.saturating_sub(depth)))).max(ROUNDING) as f32
}

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Interior,
    /// A leaf by some threshold.
    Leaf,
    /// A leaf because no cell is deeper.
    Deepest,
}

impl Verdict {
    fn is_leaf(self) -> bool {
        self != Verdict::Interior
    }
}

impl Unmet {
    /// Both together; of equal errors the place that comes first along x, y, z counts, whichever thread finds it first.
    pub(super) fn and(self, other: Unmet) -> Unmet {
        let key = |u: &Unmet| (u.worst_rel, -u.at.x, -u.at.y, -u.at.z);
        let worse = if key(&other) > key(&self) { other } else { self };
        Unmet { leaves: self.leaves + other.leaves, ..worse }
    }
}

/// Appends the levels of a later sibling to those of the earlier ones.
fn append(levels: &mut Vec<Growing>, later: Vec<Growing>) {
    for (l, Growing { level: from, lattices }) in later.into_iter().enumerate() {
        match levels.get_mut(l) {
            None => levels.push(Growing { level: from, lattices }),
            Some(Growing { level: to, lattices: all }) => {
                to.interior.extend(from.interior);
                to.leaf.extend(from.leaf);
                to.value.extend(from.value);
                to.range.extend(from.range);
                all.extend(lattices);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Boundary, OctreeTexture, Preset, Sampling};
    use super::*;
    use crate::geometry;
    use crate::mesh::{Association, MeshParts};

    /// n^3 cubes of six tets each on [0, 1]^3, points displaced by up to `jitter` of a cube's edge.
    fn cube(n: u32, jitter: f64) -> TetMesh {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / (1u64 << 24) as f64 - 0.5
        };
        let index = |x: u32, y: u32, z: u32| x + (n + 1) * (y + (n + 1) * z);
        let mut parts = MeshParts::default();
        for (z, y, x) in (0..=n).flat_map(|z| (0..=n).flat_map(move |y| (0..=n).map(move |x| (z, y, x)))) {
            let moved = DVec3::new(random(), random(), random()) * jitter;
            parts.points.push((DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + moved) / f64::from(n));
        }
        for (z, y, x) in (0..n).flat_map(|z| (0..n).flat_map(move |y| (0..n).map(move |x| (z, y, x)))) {
            for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                let mut at = [x, y, z];
                let corner = || index(at[0], at[1], at[2]);
                let mut tet = [corner(); 4];
                for (k, axis) in order.into_iter().enumerate() {
                    at[axis] += 1;
                    tet[k + 1] = index(at[0], at[1], at[2]);
                }
                parts.tets.push(tet);
            }
        }
        TetMesh::new(parts).expect("a valid cube")
    }

    fn field(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
        ScalarField::new("f".into(), Association::Points, mesh.points().iter().map(|&p| f(p)).collect())
    }

    fn params(max_depth: u8) -> OctreeParams {
        let paper = OctreeParams { sampling: Sampling::Tets, ..Preset::Paper.params() };
        OctreeParams { max_depth, initial_cell_tets: 32.0, max_leaf_tets: 8, max_leaf_variance: 8e-4, ..paper }
    }

    /// Calls `see` with (level, leaf number in the level, depth, center) for each full leaf.
    fn each_leaf(tree: &Octree, mut see: impl FnMut(usize, usize, u8, DVec3)) {
        let mut cells = vec![Cell::ROOT];
        for (l, level) in tree.levels.iter().enumerate() {
            let (mut next, mut leaf) = (Vec::new(), 0);
            for (block, cell) in cells.iter().enumerate() {
                for i in 0..8 {
                    let child = cell.child(i);
                    if level.interior[block] >> i & 1 == 1 {
                        next.push(child);
                    } else if level.leaf[block] >> i & 1 == 1 {
                        let edge = tree.root_edge / f64::from(1 << child.depth);
                        see(l, leaf, child.depth, tree.root_min + (child.index.as_dvec3() + 0.5) * edge);
                        leaf += 1;
                    }
                }
            }
            assert_eq!(leaf, level.value.len());
            cells = next;
        }
    }

    #[test]
    fn a_linear_field_is_exact_at_leaf_centres_and_within_each_range() {
        let mesh = cube(3, 0.4);
        let f = |p: DVec3| 1.0 + 2.0 * p.x - p.y + 0.5 * p.z;
        let field = field(&mesh, f);
        let params = OctreeParams { initial_depth: Some(2), max_leaf_tets: 3, max_leaf_variance: 1e-4, ..params(5) };
        let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes");
        let mut depths = [0; 6];
        each_leaf(&tree, |l, leaf, depth, center| {
            let (value, range) = (tree.levels[l].value[leaf], tree.levels[l].range[leaf]);
            assert!((f64::from(value) - field.normalize(f(center))).abs() < 1e-6, "at {center}");
            // Another point of the leaf, towards the middle of the mesh.
            let there = field.normalize(f(center * 0.99)) as f32;
            assert!(range[0] <= value && value <= range[1] && range[0] - 1e-6 <= there && there <= range[1] + 1e-6);
            depths[depth as usize] += 1;
        });
        assert!(depths[3..].iter().filter(|&&n| n > 0).count() >= 2, "leaves of several depths: {depths:?}");
        OctreeTexture::encode(&tree).expect("fits").validate().expect("valid");
    }

    #[test]
    fn uniform_depth_fills_the_cube_and_thresholds_stop_refinement() {
        let mesh = cube(2, 0.0);
        let ramp = field(&mesh, |p| p.x);
        let uniform = OctreeParams { initial_depth: Some(4), ..params(4) };
        assert_eq!(regularize(&mesh, &ramp, &uniform, &Progress::new()).expect("regularizes").leaves_by_depth(), [0, 0, 0, 0, 4096]);
        // 48 tets, U = 32: d0 = 1. A constant field has no variance, a large V stops at once.
        let flat = field(&mesh, |_| 3.0);
        assert_eq!(regularize(&mesh, &flat, &params(4), &Progress::new()).expect("regularizes").leaves_by_depth(), [0, 8]);
        let few = OctreeParams { max_leaf_tets: 49, ..params(4) };
        assert_eq!(regularize(&mesh, &ramp, &few, &Progress::new()).expect("regularizes").leaves_by_depth(), [0, 8]);
        let all = OctreeParams { max_leaf_tets: 0, max_leaf_variance: 0.0, ..params(3) };
        assert_eq!(regularize(&mesh, &ramp, &all, &Progress::new()).expect("regularizes").leaves_by_depth(), [0, 0, 0, 512]);
    }

    #[test]
    fn the_same_bytes_for_any_number_of_threads() {
        let mesh = cube(9, 0.5); // 4374 tets: more than one task
        let field = field(&mesh, |p| (7.0 * p.x).sin() * p.y + p.z * p.z);
        let by_thresholds = OctreeParams {
            max_leaf_tets: 4,
            max_leaf_variance: 1e-4,
            sampling: Sampling::Vertices,
            boundary: Boundary::Cells,
            ..params(6)
        };
        let by_tolerance = OctreeParams { tolerance: Some(0.02), max_depth: 6, ..OctreeParams::default() };
        for params in [by_thresholds, by_tolerance] {
            same_for_any_number_of_threads(&mesh, &field, &params);
        }
    }

    fn same_for_any_number_of_threads(mesh: &TetMesh, field: &ScalarField, params: &OctreeParams) {
        let with_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
            pool.install(|| regularize(mesh, field, params, &Progress::new()).expect("regularizes"))
        };
        let one = with_threads(1);
        assert!(one.node_count() > 3000);
        for threads in [2, 5] {
            assert_eq!(with_threads(threads), one);
        }
    }

    #[test]
    fn the_tree_is_the_papers_by_brute_force() {
        let mesh = cube(3, 0.6);
        let field = field(&mesh, |p| (5.0 * p.x).sin() + p.y * p.z);
        let params = OctreeParams { boundary: Boundary::Cells, max_leaf_tets: 12, max_leaf_variance: 3e-3, ..params(4) };
        let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes");
        let mut leaves = vec![0; 5];
        let root = mesh.bounds().center();
        brute_force(&mesh, &field, &params, root, tree.root_edge / 2.0, 0, &mut leaves);
        assert_eq!(tree.leaves_by_depth(), leaves);
        assert!(leaves[2] > 0 && leaves[3] > 0 && leaves[4] > 0, "{leaves:?}");
    }

    /// The rules of method 1.1 on all tets, with every separating axis spelled out.
    fn brute_force(mesh: &TetMesh, field: &ScalarField, params: &OctreeParams, center: DVec3, half: f64, depth: u8, leaves: &mut [usize]) {
        let overlaps = |p: [DVec3; 4]| {
            let edges = [p[1] - p[0], p[2] - p[0], p[3] - p[0], p[2] - p[1], p[3] - p[1], p[3] - p[2]];
            let mut axes = vec![DVec3::X, DVec3::Y, DVec3::Z];
            axes.extend(geometry::FACES.map(|[a, b, c]| (p[b] - p[a]).cross(p[c] - p[a])));
            axes.extend(edges.iter().flat_map(|e| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis.cross(*e))));
            axes.iter().all(|n| {
                let reach = half * (n.x.abs() + n.y.abs() + n.z.abs());
                let along = p.map(|q| n.dot(q - center));
                let (lo, hi) = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &d| (lo.min(d), hi.max(d)));
                lo <= reach && hi >= -reach
            })
        };
        let tets: Vec<usize> = (0..mesh.tets().len()).filter(|&t| overlaps(mesh.corners(t))).collect();
        if tets.is_empty() {
            return;
        }
        let mut vertices: Vec<u32> = tets.iter().flat_map(|&t| mesh.tets()[t]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let values: Vec<f64> = vertices.iter().map(|&v| field.normalize(field.values[v as usize])).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        let uniform = params.uniform_depth(mesh.tets().len());
        let small = tets.len() < params.max_leaf_tets as usize || variance < params.max_leaf_variance;
        if depth == params.max_depth || depth >= uniform && small {
            leaves[depth as usize] += 1;
            return;
        }
        for i in 0..8 {
            let sign = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 2.0 - 1.0;
            brute_force(mesh, field, params, center + sign * half / 2.0, half / 2.0, depth + 1, leaves);
        }
    }

    #[test]
    fn missing_values_leave_their_tets_out() {
        let mesh = cube(1, 0.0);
        let mut field = field(&mesh, |p| p.x);
        field.values[0] = f64::NAN; // the corner that all six tets share
        let tree = regularize(&mesh, &field, &params(3), &Progress::new()).expect("regularizes");
        assert_eq!(tree.leaf_count(), 0);
        field.values[0] = 0.0;
        field.values[1] = f64::NAN; // (1, 0, 0): of two tets
        let params = OctreeParams { initial_depth: Some(5), ..params(5) };
        let leaves = regularize(&mesh, &field, &params, &Progress::new()).expect("regularizes").leaf_count() as f64;
        assert!((leaves / 32768.0 - 4.0 / 6.0).abs() < 0.02, "{leaves} of 32768 leaves");
    }

    #[test]
    fn cancelling_stops_the_work() {
        let mesh = cube(2, 0.0);
        let progress = Progress::new();
        progress.cancel();
        let result = regularize(&mesh, &field(&mesh, |p| p.x), &params(6), &progress);
        assert_eq!(result.err(), Some(RegularizeError::Cancelled(Cancelled)));
    }
}
