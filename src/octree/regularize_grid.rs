//! Regularization of a regular volume: the stages of [`super::regularize`] with points for vertices, and an error that is not estimated.

use super::brick::{Brick, LATTICE, corner_of_child, lattice_point, offset, trilinear};
use super::patch::{Look, PATCH_STEPS, Patch};
use super::regularize::{Cell, MAX_BLOCKS, allowed_error};
use super::resolve::resolve;
use super::voxels::{Between, Bounds, NOTHING, Voxels, point_from, snap};
use super::{Boundary, Level, Octree, OctreeParams, Reconstruction, RegularizeError, Unmet};
use crate::geometry::Placed;
use crate::mesh::BoundarySurface;
use crate::progress::Progress;
use crate::volume::{Grid, Voxel, with_voxels};
use glam::{DMat3, DVec3, UVec3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

/// Cells of this depth are shared out among threads, with all below them.
const PARALLEL_DEPTH: u8 = 3;

/// Parts of a cell or of the volume that are thinner than this, in steps, do not count.
const THIN: f64 = 1e-6;

/// No cell is divided for an error that bricks would make anyway: they round samples by up to 3.8e-6.
const ROUNDING: f32 = 2e-6;

/// Blocks are counted by so many at once.
const COUNTED: usize = 64;

/// Depths that cells may have.
const DEPTHS: usize = OctreeParams::DEPTH_LIMIT as usize + 1;

/// Cells of at most this many steps a side are looked through without asking for their range first.
const SMALL: usize = 4;

/// Regularizes a regular volume into an adaptive octree, as [`super::regularize`] does with a mesh.
///
/// V counts the points in a cell, W is the variance of their values. The field is trilinear between points, and goes on outside the
/// volume's box as it is at its sides; cells outside are empty. Samples are the field's own values at corners and centres of leaves, whatever
/// [`super::Sampling`] says. A cell that lies between eight neighbouring points is a leaf: nothing is gained below.
///
/// Where the volume's axes are the world's, the error of a cell is not estimated: on each part of it between planes of points, field and
/// reconstruction are both trilinear, so that their difference has its extremes at the parts' corners, which are all looked at (before
/// leaves agree on corners). It is, then, never missed by a coarse cell, and the uniform stage, which is there to prevent that, is left out
/// unless [`OctreeParams::initial_depth`] asks for it or there is no tolerance. Else the points in the cell and its 27 lattice points count, and cells that
/// the volume's sides cut are divided down to steps.
///
/// A cell that holds missing values is divided; at the greatest depth its centre decides whether it is full.
///
/// The root cube has a corner where the volume has one, and an edge of a power of two of steps, if the greatest depth reaches down to
/// steps: then corners of leaves are points of the volume, and the deepest leaves repeat it exactly. Else it is as that of a mesh.
pub fn regularize_grid(grid: &Grid, params: &OctreeParams, progress: &Progress) -> Result<Octree, RegularizeError> {
    params.validate()?;
    progress.begin("regularizing", Cell::ROOT.share());
    with_voxels!(grid.samples(), values => Work::new(grid, values, params, progress).run(grid))
}

/// An upper bound of the bytes that [`regularize_grid`] takes beside the volume, for leaves no smaller than steps: 80 a point.
pub fn grid_working_bytes(grid: &Grid) -> u64 {
    80 * grid.frame().points()
}

impl Octree {
    /// The box of the volume that the octree was made of, as the surface that rays are cut to, if the boundary is [`Boundary::Mesh`].
    pub fn grid_surface(&self, grid: &Grid) -> Option<Arc<BoundarySurface>> {
        let corners = grid.frame().corners().map(|corner| corner - grid.center());
        (self.params.boundary == Boundary::Mesh).then(|| Arc::new(BoundarySurface::of_box(&corners, self.root_min, self.root_edge)))
    }
}

/// The root cube: lowest corner relative to the volume's centre, and edge.
fn root_cube<V: Voxel>(grid: &Grid, voxels: &Voxels<V>, max_depth: u8) -> (DVec3, f64) {
    let longest = grid.bounds().size().max_element();
    let edge_of = |step: f64| {
        let levels = (longest / step - THIN).log2().ceil();
        (levels <= f64::from(max_depth)).then(|| step * levels.exp2())
    };
    let steps = grid.frame().spacing();
    let edges = if voxels.is_aligned { [0, 1, 2].map(|axis| edge_of(steps[axis])) } else { [None; 3] };
    match edges.into_iter().flatten().min_by(f64::total_cmp) {
        Some(edge) => (voxels.first, edge),
        None => {
            let edge = longest * (1.0 + 1e-5);
            (grid.bounds().center() - edge / 2.0, edge)
        }
    }
}

/// What a cell is.
enum Found {
    Empty,
    Leaf { value: f32, range: [f32; 2] },
    Interior,
}

/// A place along an axis where a part of a cell ends.
#[derive(Debug, Clone, Copy)]
struct Stop {
    /// Among the points.
    between: Between,
    /// In the cell, 0 to 1.
    at: f32,
}

type Stops = [Vec<Stop>; 3];

/// One thread's working memory.
#[derive(Default)]
struct Scratch {
    stops: Stops,
    patch: Patch,
    /// Blocks that are not counted yet.
    blocks: usize,
}

/// A cell in steps.
struct Region {
    low: DVec3,
    high: DVec3,
    /// The part inside the volume.
    inside: [DVec3; 2],
    /// The points that the field in it hangs on, both included.
    points: [[usize; 3]; 2],
}

struct Work<'a, V> {
    voxels: Voxels<'a, V>,
    bounds: Bounds,
    /// The root's lowest corner in steps, and what its edge along each axis of the world is in steps.
    base: DVec3,
    edges: DMat3,
    root_min: DVec3,
    root_edge: f64,
    uniform_depth: u8,
    /// The error that a cell may have, by depth, if there is a tolerance.
    allowed: Option<[f32; DEPTHS]>,
    params: &'a OctreeParams,
    progress: &'a Progress,
    blocks: AtomicUsize,
    unmet: Mutex<Option<Unmet>>,
}

impl<'a, V: Voxel> Work<'a, V> {
    fn new(grid: &Grid, values: &'a [V], params: &'a OctreeParams, progress: &'a Progress) -> Self {
        let voxels = Voxels::new(grid, values);
        let (root_min, root_edge) = root_cube(grid, &voxels, params.max_depth);
        let is_exact = params.tolerance.is_some() && params.initial_depth.is_none() && voxels.is_aligned;
        let edges = voxels.to_steps * root_edge;
        let allowed = |tolerance: f64| std::array::from_fn(|depth| allowed_error_in_steps(tolerance, depth as u8, &edges));
        Work {
            bounds: Bounds::new(&voxels),
            base: voxels.to_steps * (root_min - voxels.first),
            allowed: params.tolerance.map(allowed),
            edges,
            root_min,
            root_edge,
            uniform_depth: if is_exact { 1 } else { params.uniform_depth(values.len()) },
            voxels,
            params,
            progress,
            blocks: AtomicUsize::new(0),
            unmet: Mutex::default(),
        }
    }

    fn run(self, grid: &Grid) -> Result<Octree, RegularizeError> {
        let levels = self.divide()?;
        let mut tree = Octree {
            root_min: self.root_min,
            root_edge: self.root_edge,
            value_range: grid.range(),
            levels,
            params: self.params.clone(),
            unmet: self.unmet.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()),
        };
        if self.params.reconstruction == Reconstruction::Continuous {
            self.progress.check()?;
            resolve(&mut tree, None);
        }
        Ok(tree)
    }

    /// All levels.
    fn divide(&self) -> Result<Vec<Level>, RegularizeError> {
        let mut levels = Vec::new();
        let mut cells = vec![Cell::ROOT];
        for _ in 0..PARALLEL_DEPTH {
            let children: Vec<Cell> = cells.iter().flat_map(|cell| (0..8).map(|i| cell.child(i))).collect();
            let found: Vec<Found> =
                children.par_iter().map_init(Scratch::default, |scratch, &cell| self.classify(cell, None, scratch)).collect();
            let mut level = Level::default();
            for (cell, found) in cells.iter().zip(found.chunks(8)) {
                push_block(&mut level, found, self.brick(*cell));
            }
            levels.push(level);
            self.add_blocks(cells.len())?;
            let is_interior = |found: &Found| matches!(found, Found::Interior);
            self.progress.add(children.iter().zip(&found).filter(|(_, found)| !is_interior(found)).map(|(cell, _)| cell.share()).sum());
            cells = children.iter().zip(&found).filter(|(_, found)| is_interior(found)).map(|(cell, _)| *cell).collect();
            if cells.is_empty() {
                return Ok(levels);
            }
        }
        let grow = |scratch: &mut Scratch, cell: &Cell| -> Result<Vec<Level>, RegularizeError> {
            let mut levels = Vec::new();
            self.divide_alone(*cell, 0, &mut levels, scratch)?;
            self.add_blocks(std::mem::take(&mut scratch.blocks))?;
            self.progress.add(cell.share());
            Ok(levels)
        };
        let grown: Vec<Vec<Level>> = cells.par_iter().with_max_len(1).map_init(Scratch::default, grow).collect::<Result<_, _>>()?;
        levels.extend(Level::joined(grown));
        Ok(levels)
    }

    /// The blocks of an interior cell and all below it, by one thread; the cell's own goes to `levels[level]`.
    fn divide_alone(&self, cell: Cell, level: usize, levels: &mut Vec<Level>, scratch: &mut Scratch) -> Result<(), RegularizeError> {
        scratch.blocks += 1;
        if scratch.blocks >= COUNTED {
            self.add_blocks(std::mem::take(&mut scratch.blocks))?;
        }
        if levels.len() == level {
            levels.push(Level::default());
        }
        let interior = match self.patch_places(cell) {
            Some(places) => self.divide_patch(cell, places, &mut levels[level], scratch),
            None => {
                let found: [Found; 8] = std::array::from_fn(|i| self.classify(cell.child(i as u32), None, scratch));
                push_block(&mut levels[level], &found, self.brick(cell))
            }
        };
        for i in (0..8).filter(|&i| interior >> i & 1 == 1) {
            self.divide_alone(cell.child(i), level + 1, levels, scratch)?;
        }
        Ok(())
    }

    /// Where the children of a cell begin, meet and end along each axis in steps, if they are to be looked at as a [`Patch`].
    fn patch_places(&self, cell: Cell) -> Option<[[f64; 3]; 3]> {
        if !self.voxels.is_aligned {
            return None;
        }
        let places = [0.0, 0.5, 1.0].map(|at| self.place(cell, DVec3::splat(at)).map(snap));
        let [low, _, high] = places;
        let [low, high] = [low.max(DVec3::ZERO), high.min(self.voxels.last())];
        let is_small = (0..3).all(|a| high[a] > low[a] && point_from(high[a]) - low[a] as usize <= PATCH_STEPS);
        is_small.then(|| [0, 1, 2].map(|a| [places[0][a], places[1][a], places[2][a]]))
    }

    /// Decides what the children of a cell are that make a patch; returns which are interior.
    fn divide_patch(&self, cell: Cell, places: [[f64; 3]; 3], level: &mut Level, scratch: &mut Scratch) -> u8 {
        scratch.patch.set(&self.voxels, places);
        let lattice = scratch.patch.lattice();
        let continuous = self.params.reconstruction == Reconstruction::Continuous;
        let has_missing = lattice.iter().any(|value| value.is_nan());
        let brick = continuous.then(|| if has_missing { self.sampled(cell) } else { Brick::encode(&lattice) });
        let depth = cell.depth + 1;
        // Cells between neighbouring points are trilinear: leaves, and their centres have the mean of their corners.
        let is_between = |a: usize| {
            let [low, middle, high] = places[a];
            let is_between = |low: f64, high: f64| point_from(high) - low as usize <= 1;
            low >= 0.0 && high <= self.voxels.last()[a] && is_between(low, middle) && is_between(middle, high)
        };
        if continuous && !has_missing && (depth >= self.uniform_depth || depth >= self.params.max_depth) && (0..3).all(is_between) {
            push_trilinear(level, &lattice);
            level.interior.push(0);
            level.leaf.push(0xff);
            level.bricks.extend(brick);
            return 0;
        }
        scratch.patch.measure();
        let found: [Found; 8] = std::array::from_fn(|i| {
            let i = i as u32;
            let corners = std::array::from_fn(|k| lattice[corner_of_child(i, k as u32)]);
            self.classify(cell.child(i), Some((i, places, corners)), scratch)
        });
        push_block(level, &found, brick)
    }

    /// The samples at the corners of a cell's children.
    fn sampled(&self, cell: Cell) -> Brick {
        let samples: [f32; LATTICE] = std::array::from_fn(|i| {
            let at = UVec3::from_array(lattice_point(i)).as_dvec3();
            self.voxels.sample(self.place(cell, at / 2.0)).value()
        });
        Brick::encode(&samples)
    }

    /// The same, where the reconstruction asks for it.
    fn brick(&self, cell: Cell) -> Option<Brick> {
        (self.params.reconstruction == Reconstruction::Continuous).then(|| self.sampled(cell))
    }

    /// Decides what a cell is. If it is in the patch at hand: which of its cells, where they begin, meet and end, and the field at the
    /// cell's corners.
    fn classify(&self, cell: Cell, in_patch: Option<(u32, [[f64; 3]; 3], [f32; 8])>, scratch: &mut Scratch) -> Found {
        let region = match &in_patch {
            Some((i, places, _)) => {
                let end = |upper: u32| DVec3::from_array([0, 1, 2].map(|a| places[a][((i >> a & 1) + upper) as usize]));
                self.region_between(end(0), end(1))
            }
            None => self.region(cell),
        };
        let Some(region) = region else { return Found::Empty };
        let depth = cell.depth;
        let is_deepest = depth >= self.params.max_depth;
        let side = (0..3).map(|a| region.points[1][a] - region.points[0][a]).max().unwrap_or(0);
        let bounds = (side > SMALL).then(|| self.bounds.range(region.points[0], region.points[1]));
        if bounds == Some(NOTHING) {
            return Found::Empty;
        }
        if depth < self.uniform_depth && !is_deepest {
            return Found::Interior;
        }
        let value = || self.voxels.at(self.place(cell, DVec3::splat(0.5)));
        if self.params.boundary == Boundary::Centres && !self.is_inside(cell) {
            // Its children may have their centres inside.
            let may_hold = !is_deepest && !self.is_settled_by_count(&region);
            return if may_hold { Found::Interior } else { Found::Empty };
        }
        // What hardly varies needs no look.
        let allowed = self.allowed.map(|allowed| allowed[usize::from(depth)]);
        if let Some(range) = bounds.filter(|[lo, hi]| hi - lo <= allowed.unwrap_or(0.0)) {
            return Found::Leaf { value: value(), range };
        }
        let continuous = self.params.reconstruction == Reconstruction::Continuous;
        let corners = || in_patch.map_or_else(|| self.corners(cell, &region), |(_, _, corners)| corners);
        if continuous && side <= 1 && self.voxels.is_aligned && region.inside == [region.low, region.high] {
            // Trilinear between its corners, so that the centre has their mean.
            let corners = corners();
            let value = corners.iter().sum::<f32>() / 8.0;
            if !value.is_nan() {
                return Found::Leaf { value, range: corners.iter().fold(NOTHING, |[lo, hi], c| [lo.min(*c), hi.max(*c)]) };
            }
        }
        let corners = if continuous { corners() } else { [value(); 8] };
        let mut look = |enough: f32| match in_patch {
            Some((i, ..)) => scratch.patch.look(i, &corners, enough),
            None => self.look(cell, &region, &corners, enough, &mut scratch.stops),
        };
        let settled = is_deepest || self.is_settled_by_count(&region) || self.is_settled_by_variance(&region);
        if settled {
            let look = look(f32::INFINITY);
            let value = value();
            if look.range == NOTHING || value.is_nan() && is_deepest {
                return Found::Empty;
            }
            if is_deepest {
                self.note_if_unmet(cell, look.worst);
            }
            return if is_deepest || !look.has_missing { Found::Leaf { value, range: look.range } } else { Found::Interior };
        }
        // A part of the volume in a cell that is turned against it may have none of the places that are looked at.
        let is_cut = !self.voxels.is_aligned && region.inside != [region.low, region.high];
        if is_cut && !self.is_fine(cell) {
            return Found::Interior;
        }
        match allowed.map(|allowed| (allowed, look(allowed))) {
            Some((_, look)) if look.range == NOTHING && look.has_missing => Found::Empty,
            Some((allowed, look)) if look.worst <= allowed && !look.has_missing => Found::Leaf { value: value(), range: look.range },
            _ => Found::Interior,
        }
    }

    /// A place in a cell, `unit` in [0, 1]^3, in steps.
    fn place(&self, cell: Cell, unit: DVec3) -> DVec3 {
        self.base + self.edges * ((cell.index.as_dvec3() + unit) / f64::from(1u32 << cell.depth))
    }

    /// The cell in steps; nothing if no part of it that counts lies in the volume.
    fn region(&self, cell: Cell) -> Option<Region> {
        let (low, high) = if self.voxels.is_aligned {
            (self.place(cell, DVec3::ZERO), self.place(cell, DVec3::ONE))
        } else {
            let corners = (0..8).map(|k| self.place(cell, offset(k).as_dvec3()));
            corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)))
        };
        self.region_between(low.map(snap), high.map(snap))
    }

    /// The same by a cell's ends.
    fn region_between(&self, low: DVec3, high: DVec3) -> Option<Region> {
        let inside = [low.max(DVec3::ZERO), high.min(self.voxels.last())];
        if (inside[1] - inside[0]).min_element() <= THIN {
            return None;
        }
        let points = [inside[0].to_array().map(|c| c as usize), inside[1].to_array().map(point_from)];
        Some(Region { low, high, inside, points })
    }

    fn is_inside(&self, cell: Cell) -> bool {
        let center = self.place(cell, DVec3::splat(0.5));
        center.cmpge(DVec3::ZERO).all() && center.cmple(self.voxels.last()).all()
    }

    /// The field at the cell's corners.
    fn corners(&self, cell: Cell, region: &Region) -> [f32; 8] {
        if !self.voxels.is_aligned {
            return std::array::from_fn(|k| self.voxels.at(self.place(cell, offset(k as u32).as_dvec3())));
        }
        let ends = [0, 1, 2].map(|a| [self.voxels.between(a, region.low[a]), self.voxels.between(a, region.high[a])]);
        std::array::from_fn(|k| self.voxels.at_between([ends[0][k & 1], ends[1][k >> 1 & 1], ends[2][k >> 2]]))
    }

    /// V: fewer points in the cell.
    fn is_settled_by_count(&self, region: &Region) -> bool {
        let most = self.params.max_leaf_tets as usize;
        most > 0 && points_inside(region).map(|(low, high)| (high + 1).saturating_sub(low)).iter().product::<usize>() < most
    }

    /// W: a smaller variance of the values at the points in the cell.
    fn is_settled_by_variance(&self, region: &Region) -> bool {
        if self.params.max_leaf_variance <= 0.0 {
            return false;
        }
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let [x, y, z] = points_inside(region);
        for z in z.0..=z.1 {
            for y in y.0..=y.1 {
                for x in x.0..=x.1 {
                    let value = f64::from(self.voxels.at_point([x, y, z])) - 0.5;
                    if !value.is_nan() {
                        (count, sum, squares) = (count + 1.0, sum + value, squares + value * value);
                    }
                }
            }
        }
        count == 0.0 || squares / count - (sum / count).powi(2) < self.params.max_leaf_variance
    }

    /// Looks through a cell that has these values at its corners, until an error above `enough` is found.
    fn look(&self, cell: Cell, region: &Region, corners: &[f32; 8], enough: f32, stops: &mut Stops) -> Look {
        if self.voxels.is_aligned { self.look_aligned(region, corners, enough, stops) } else { self.look_turned(cell, region, corners) }
    }

    fn look_aligned(&self, region: &Region, corners: &[f32; 8], enough: f32, stops: &mut Stops) -> Look {
        for (axis, stops) in stops.iter_mut().enumerate() {
            let (low, high) = (region.inside[0][axis], region.inside[1][axis]);
            let stop = |place: f64| {
                let at = (place - region.low[axis]) / (region.high[axis] - region.low[axis]);
                Stop { between: self.voxels.between(axis, place), at: at as f32 }
            };
            stops.clear();
            stops.push(stop(low));
            stops.extend((low as usize + 1..point_from(high)).map(|point| stop(point as f64)));
            stops.push(stop(high));
        }
        let mut look = Look::NOTHING;
        let [xs, ys, zs] = stops;
        for z in zs.iter() {
            for y in ys.iter() {
                let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
                let end = |k: usize| lerp(lerp(corners[k], corners[k + 2], y.at), lerp(corners[k + 4], corners[k + 6], y.at), z.at);
                let (left, right) = (end(0), end(1));
                self.voxels.along_row(xs.iter().map(|x| x.between), y.between, z.between, |i, value| {
                    look.see(value, lerp(left, right, xs[i].at));
                });
                if look.worst > enough {
                    return look;
                }
            }
        }
        look
    }

    /// The same where the cell is none of the volume's boxes: the error at points inside and lattice points, the range over all points that
    /// the field in the cell may hang on.
    fn look_turned(&self, cell: Cell, region: &Region, corners: &[f32; 8]) -> Look {
        let mut look = Look::NOTHING;
        let [low, high] = region.points;
        let (corner, to_unit) = (self.place(cell, DVec3::ZERO), self.edges.inverse() * f64::from(1u32 << cell.depth));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let value = self.voxels.at_point([x, y, z]);
                    let unit = to_unit * (DVec3::new(x as f64, y as f64, z as f64) - corner);
                    let is_in = unit.cmpge(DVec3::ZERO).all() && unit.cmple(DVec3::ONE).all();
                    look.see(value, if is_in { trilinear(corners, unit.as_vec3()) } else { value });
                }
            }
        }
        for i in 0..27u32 {
            let unit = Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32) * 0.5;
            let place = self.place(cell, unit.as_dvec3());
            if place.cmpge(DVec3::ZERO).all() && place.cmple(self.voxels.last()).all() {
                look.see(self.voxels.at(place), trilinear(corners, unit));
            }
        }
        look
    }

    /// Whether a cell's edges are no longer than steps.
    fn is_fine(&self, cell: Cell) -> bool {
        is_fine(cell.depth, &self.edges)
    }

    /// Notes a leaf of the greatest depth in which the tolerance is not met.
    fn note_if_unmet(&self, cell: Cell, error: f32) {
        let allowed = self.allowed.map(|allowed| allowed[usize::from(cell.depth)]);
        if allowed.is_none_or(|allowed| error <= allowed) {
            return;
        }
        let center = (cell.index.as_dvec3() + 0.5) / f64::from(1u32 << cell.depth);
        let one = Unmet { leaves: 1, worst_rel: error, at: self.root_min + center * self.root_edge };
        let mut all = self.unmet.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        *all = Some(all.map_or(one, |before| before.and(one)));
    }

    /// Counts blocks; stops where there are too many, or on request.
    fn add_blocks(&self, count: usize) -> Result<(), RegularizeError> {
        self.progress.check()?;
        if self.blocks.fetch_add(count, Relaxed) + count > MAX_BLOCKS { Err(RegularizeError::TooLarge) } else { Ok(()) }
    }
}

/// Whether the edges of cells are no longer than steps. `edges` are the root's, in steps.
fn is_fine(depth: u8, edges: &DMat3) -> bool {
    let longest = edges.x_axis.abs().max(edges.y_axis.abs()).max(edges.z_axis.abs()).max_element();
    longest / f64::from(1u32 << depth) <= 1.0 + THIN
}

/// The error that a cell may have. What is below the distance of points is held to the tolerance itself: there is nothing to be resolved
/// in it but the edges of the field between points.
fn allowed_error_in_steps(tolerance: f64, depth: u8, edges: &DMat3) -> f32 {
    let allowed = if is_fine(depth, edges) { tolerance as f32 } else { allowed_error(tolerance, depth) };
    allowed.max(ROUNDING)
}

/// First and last point along each axis that lie in the cell; the last is before the first if none does.
fn points_inside(region: &Region) -> [(usize, usize); 3] {
    [0, 1, 2].map(|a| (point_from(region.inside[0][a]), region.inside[1][a] as usize))
}

/// Adds a block; returns which of its children are interior.
fn push_block(level: &mut Level, children: &[Found], brick: Option<Brick>) -> u8 {
    let (mut interior, mut leaf) = (0, 0);
    for (i, child) in children.iter().enumerate() {
        match *child {
            Found::Empty => {}
            Found::Interior => interior |= 1 << i,
            Found::Leaf { value, range } => {
                leaf |= 1 << i;
                level.value.push(value);
                level.range.push([range[0].min(value), range[1].max(value)]);
            }
        }
    }
    level.interior.push(interior);
    level.leaf.push(leaf);
    level.bricks.extend(brick);
    interior
}

/// Adds the values and ranges of eight leaves in each of which the field is trilinear between its corners.
fn push_trilinear(level: &mut Level, lattice: &[f32; LATTICE]) {
    // All eight side by side, corner by corner: none is NaN.
    let (mut sums, mut low, mut high) = ([0f32; 8], [f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
    for k in 0..8 {
        for i in 0..8 {
            let value = lattice[corner_of_child(i as u32, k)];
            sums[i] += value;
            low[i] = if value < low[i] { value } else { low[i] };
            high[i] = if value > high[i] { value } else { high[i] };
        }
    }
    let mut ranges = [[0f32; 2]; 8];
    for i in 0..8 {
        sums[i] /= 8.0;
        ranges[i] = [low[i].min(sums[i]), high[i].max(sums[i])];
    }
    level.value.extend_from_slice(&sums);
    level.range.extend_from_slice(&ranges);
}

#[cfg(test)]
mod tests {
    use super::super::{OctreeTexture, Preset};
    use super::*;
    use crate::volume::{GridFrame, Samples};

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

    fn grid(frame: GridFrame, value: impl Fn(DVec3) -> f64) -> Grid {
        let [nx, ny, nz] = frame.dims;
        let at = |i: u32| frame.origin + frame.steps * DVec3::new(f64::from(i % nx), f64::from(i / nx % ny), f64::from(i / nx / ny));
        Grid::new(frame, "s".into(), Samples::F64((0..nx * ny * nz).map(|i| value(at(i))).collect())).expect("valid")
    }

    fn isotropic(dims: [u32; 3]) -> GridFrame {
        GridFrame::along_axes(dims, DVec3::new(-3.0, 5.0, 1.0), DVec3::splat(0.5))
    }

    fn tree(grid: &Grid, params: &OctreeParams) -> Octree {
        regularize_grid(grid, params, &Progress::new()).expect("regularizes")
    }

    /// The largest difference at random places in the volume, and how many of them the octree has nothing at.
    fn worst(grid: &Grid, tree: &Octree, random: &mut Random) -> (f32, usize) {
        let Samples::F64(values) = grid.samples() else { panic!("made of f64") };
        let (texture, voxels) = (OctreeTexture::encode(tree).expect("fits"), Voxels::new(grid, values));
        let (mut worst, mut empty) = (0f32, 0);
        for _ in 0..20_000 {
            let steps = random.point() * voxels.last();
            let at = voxels.first + voxels.to_steps.inverse() * steps;
            match texture.value_at((at - tree.root_min) / tree.root_edge) {
                Some(found) => worst = worst.max((found - voxels.at(steps)).abs()),
                None => empty += 1,
            }
        }
        (worst, empty)
    }

    fn turned(dims: [u32; 3]) -> GridFrame {
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.7);
        GridFrame { steps: DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::new(0.5, 0.6, 0.4)), ..isotropic(dims) }
    }

    #[test]
    fn a_linear_field_comes_back_in_every_leaf_that_the_sides_do_not_cut() {
        let linear = |p: DVec3| 3.0 * p.x - p.y + 0.25 * p.z;
        let grid = grid(isotropic([33, 33, 33]), linear);
        let tree = tree(&grid, &OctreeParams { tolerance: Some(1e-6), ..OctreeParams::default() });
        assert_eq!((worst(&grid, &tree, &mut Random(1)).1, tree.unmet), (0, None));
        assert!(worst(&grid, &tree, &mut Random(1)).0 <= 1e-5);
        assert_eq!(tree.leaf_count(), 8, "one level holds it");
    }

    #[test]
    fn leaves_between_neighbouring_points_repeat_the_volume() {
        // A tolerance of nothing, noise, and sides that leaves do not meet.
        let noise = |p: DVec3| (p.dot(DVec3::new(12.9898, 78.233, 37.719)).sin() * 43_758.545_3).fract();
        let grid = grid(isotropic([20, 17, 9]), noise);
        let tree = tree(&grid, &OctreeParams { tolerance: Some(0.0), ..OctreeParams::default() });
        assert_eq!(tree.levels.len(), 5, "32 steps a side: no cell is smaller than one");
        let (worst, empty) = worst(&grid, &tree, &mut Random(2));
        assert!(worst <= 1e-5 && empty == 0, "{worst} {empty}");
        assert_eq!(tree.leaf_count(), 19 * 16 * 8, "one a step");
    }

    #[test]
    fn the_error_keeps_within_the_tolerance_whatever_the_frame() {
        let waves = |p: DVec3| (1.3 * p.x).sin() + (0.9 * p.y).cos() * p.z * 0.2;
        let flipped = GridFrame { steps: DMat3::from_cols(-DVec3::Z, DVec3::X * 0.7, DVec3::Y), ..isotropic([40, 30, 20]) };
        let odd = GridFrame::along_axes([40, 30, 20], DVec3::ZERO, DVec3::new(0.3, 0.4, 0.61));
        for frame in [isotropic([40, 30, 20]), flipped, odd, turned([40, 30, 20])] {
            let grid = grid(frame, waves);
            let params = OctreeParams { tolerance: Some(0.02), max_depth: 9, ..OctreeParams::default() };
            let tree = tree(&grid, &params);
            let (worst, empty) = worst(&grid, &tree, &mut Random(3));
            assert!(empty == 0 && tree.unmet.is_none(), "{empty} empty, {:?}", tree.unmet);
            // Agreement at corners adds to the error of one leaf that of a coarser neighbour.
            assert!(worst <= 0.03, "{worst} for {frame:?}");
            let leaves: usize = tree.leaf_count();
            assert!(leaves < 20 * grid.samples().len(), "{leaves}");
        }
    }

    #[test]
    fn ranges_hold_the_field_and_say_something() {
        let waves = |p: DVec3| (1.3 * p.x).sin() + (0.9 * p.y).cos();
        for frame in [isotropic([33, 30, 20]), turned([20, 30, 20])] {
            let grid = grid(frame, waves);
            for reconstruction in [Reconstruction::Continuous, Reconstruction::Leaf] {
                let params = OctreeParams { tolerance: Some(0.05), max_depth: 6, reconstruction, ..OctreeParams::default() };
                let tree = tree(&grid, &params);
                let Samples::F64(values) = grid.samples() else { panic!("made of f64") };
                let voxels = Voxels::new(&grid, values);
                let progress = Progress::new();
                let work = Work::new(&grid, values, &params, &progress);
                let (mut sum, mut random) = (0.0, Random(4));
                each_leaf(&tree, |cell, range| {
                    sum += range[1] - range[0];
                    for _ in 0..10 {
                        let place = work.place(cell, random.point());
                        if place.cmpge(DVec3::ZERO).all() && place.cmple(voxels.last()).all() {
                            let value = voxels.at(place);
                            assert!(range[0] - 1e-5 <= value && value <= range[1] + 1e-5, "{value} in {range:?}");
                        }
                    }
                });
                let mean = sum / tree.leaf_count() as f32;
                assert!(mean < if voxels.is_aligned { 0.2 } else { 0.6 }, "{mean}");
            }
        }
    }

    /// Calls `see` with the cell and the range of each leaf.
    fn each_leaf(tree: &Octree, mut see: impl FnMut(Cell, [f32; 2])) {
        let mut cells = vec![Cell::ROOT];
        for level in &tree.levels {
            let (mut next, mut leaf) = (Vec::new(), 0);
            for (block, cell) in cells.iter().enumerate() {
                for i in 0..8 {
                    if level.interior[block] >> i & 1 == 1 {
                        next.push(cell.child(i));
                    } else if level.leaf[block] >> i & 1 == 1 {
                        see(cell.child(i), level.range[leaf]);
                        leaf += 1;
                    }
                }
            }
            cells = next;
        }
    }

    #[test]
    fn the_same_tree_for_any_number_of_threads() {
        let grid = grid(isotropic([40, 30, 20]), |p| (3.0 * p.x).sin() * p.y + p.z);
        let by_tolerance = OctreeParams { tolerance: Some(0.01), ..OctreeParams::default() };
        for params in [by_tolerance, Preset::Paper.params()] {
            let with_threads = |n| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
                pool.install(|| tree(&grid, &params))
            };
            let one = with_threads(1);
            assert!(one.node_count() > 1000, "{}", one.node_count());
            assert!(one == with_threads(4));
        }
    }

    #[test]
    fn thresholds_stop_where_they_say() {
        // Hardly anything on one side, noise on the other.
        let grid = grid(isotropic([33, 33, 33]), |p| {
            if p.x < 2.0 { 0.1 + 0.01 * (9.0 * p.y).sin() } else { (p.x * 91.7 + p.y * 53.1 + p.z * 17.9).sin().abs() }
        });
        let base = OctreeParams { max_depth: 9, initial_depth: Some(1), reconstruction: Reconstruction::Leaf, ..Preset::Paper.params() };
        let by_count = tree(&grid, &OctreeParams { max_leaf_tets: 100, max_leaf_variance: 0.0, ..base.clone() });
        let leaves = by_count.leaves_by_depth();
        assert!(leaves[4] > 3000 && leaves.len() == 5, "a cell of depth 3 has 5^3 = 125 points, one of depth 4 has 27: {leaves:?}");
        let by_variance = tree(&grid, &OctreeParams { max_leaf_tets: 2, max_leaf_variance: 1e-3, ..base });
        let leaves = by_variance.leaves_by_depth();
        assert!(leaves[1] == 0 && leaves[2] > 0 && leaves[6] > 10_000 && leaves.len() == 7, "single points at the most: {leaves:?}");
    }

    #[test]
    fn missing_values_leave_holes_of_their_size() {
        let middle = DVec3::new(-3.0, 5.0, 1.0) + 8.0;
        let grid = grid(isotropic([33, 33, 33]), |p| if p.distance(middle) < 4.0 { f64::NAN } else { 1.0 + p.x });
        let params = OctreeParams { max_depth: 6, ..OctreeParams::default() };
        let texture = OctreeTexture::encode(&tree(&grid, &params)).expect("fits");
        let mut random = Random(5);
        let (mut holes, mut wrong) = (0, 0);
        for _ in 0..20_000 {
            let unit = random.point();
            let distance = (unit * 16.0 - 8.0).length();
            let is_empty = texture.value_at(unit).is_none();
            holes += usize::from(is_empty);
            // The cubes of points around a missing one are missing.
            wrong += usize::from(is_empty && distance > 4.0 + 0.9 || !is_empty && distance < 4.0 - 0.9);
        }
        let share = holes as f64 / 20_000.0 * 16f64.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * 64.0);
        assert!(wrong == 0 && (1.0..1.4).contains(&share), "{wrong} {share}");
    }
}
