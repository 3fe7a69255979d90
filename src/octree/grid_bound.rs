//! A certified bound of the error of a volume's octree: what no point of the volume exceeds.

use super::bound::{ErrorBound, ROUNDING, larger};
use super::brick::offset;
use super::texture::{Node, OctreeTexture};
use super::voxels::{Between, Voxels, point_from, snap};
use crate::geometry::Placed;
use crate::progress::{Cancelled, Progress};
use crate::volume::{Grid, Voxel, with_voxels};
use glam::{DVec3, UVec3};
use rayon::prelude::*;

/// Parts at this depth are looked through in parallel.
const PARALLEL_DEPTH: u8 = 4;

/// Bounds the error of a texture everywhere in a volume whose axes are the world's; `None` for one that is turned.
///
/// On each part of a leaf between planes of points the leaf's field and the volume's are both trilinear, and so is their difference, which has
/// its extremes at the part's corners. All of these are looked at: but for rounding, the bound is the largest error itself. Where values are
/// missing there is no error.
pub fn grid_error_bound(grid: &Grid, texture: &OctreeTexture, progress: &Progress) -> Result<Option<ErrorBound>, Cancelled> {
    with_voxels!(grid.samples(), values => bound_of(grid, values, texture, progress))
}

/// A cell of the octree.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Its texel's position: block and child.
    block: UVec3,
    child: u32,
    /// Its lowest corner in the root cube, and its edge.
    low: DVec3,
    edge: f64,
    depth: u8,
}

impl Cell {
    fn children(block: UVec3, low: DVec3, edge: f64, depth: u8) -> impl Iterator<Item = Cell> {
        let edge = edge / 2.0;
        (0..8).map(move |child| Cell { block, child, low: low + offset(child).as_dvec3() * edge, edge, depth: depth + 1 })
    }

    fn node(&self, texture: &OctreeTexture) -> Node {
        texture.node(self.block * 2 + offset(self.child))
    }
}

/// Where a part of a leaf ends along an axis: among the points, and in the leaf, 0 to 1.
type Stop = (Between, f32);

struct Look<'a, V> {
    voxels: Voxels<'a, V>,
    texture: &'a OctreeTexture,
    /// Where the root cube begins in steps, and its edge in steps along each axis.
    base: DVec3,
    edges: DVec3,
}

fn bound_of<V: Voxel>(grid: &Grid, values: &[V], texture: &OctreeTexture, progress: &Progress) -> Result<Option<ErrorBound>, Cancelled> {
    let voxels = Voxels::new(grid, values);
    if !voxels.is_aligned {
        return Ok(None);
    }
    let per_unit = DVec3::new(voxels.to_steps.x_axis.x, voxels.to_steps.y_axis.y, voxels.to_steps.z_axis.z);
    let base = (texture.root_min() - voxels.first) * per_unit;
    let look = Look { base, edges: per_unit * texture.root_edge(), voxels, texture };
    // Leaves above the depth of parallel work are work of their own.
    let mut work: Vec<Cell> = Cell::children(UVec3::ZERO, DVec3::ZERO, 1.0, 0).collect();
    for _ in 1..PARALLEL_DEPTH {
        let divided = |cell: Cell| match cell.node(texture) {
            Node::Interior { block } => Cell::children(block, cell.low, cell.edge, cell.depth).collect(),
            Node::Empty => vec![],
            Node::Leaf { .. } => vec![cell],
        };
        work = work.into_iter().flat_map(divided).collect();
    }
    progress.begin("bounding the error", work.len() as u64);
    let worst_of = |cell: &Cell| {
        progress.check()?;
        let mut worst = (0.0, DVec3::splat(0.5));
        look.descend(*cell, &mut worst, &mut Default::default());
        progress.add(1);
        Ok(worst)
    };
    let (bound, at) = work.par_iter().map(worst_of).try_reduce(|| (0.0, DVec3::splat(0.5)), |a, b| Ok(larger(a, b)))?;
    let at = if bound > 0.0 { texture.root_min() + at * texture.root_edge() } else { grid.bounds().center() };
    Ok(Some(ErrorBound { bound_rel: bound + ROUNDING, at }))
}

impl<V: Voxel> Look<'_, V> {
    /// Goes down to all leaves and takes the largest error and its leaf's centre.
    fn descend(&self, cell: Cell, worst: &mut (f64, DVec3), stops: &mut [Vec<Stop>; 3]) {
        match cell.node(self.texture) {
            Node::Empty => {}
            Node::Interior { block } => {
                Cell::children(block, cell.low, cell.edge, cell.depth).for_each(|child| self.descend(child, worst, stops));
            }
            Node::Leaf { value, .. } => {
                let corners = self.texture.leaf_corners(cell.block, cell.child, value);
                let error = self.error(&cell, &corners, stops);
                *worst = larger(*worst, (f64::from(error), cell.low + cell.edge / 2.0));
            }
        }
    }

    /// The largest error in the part of a leaf that lies in the volume.
    fn error(&self, cell: &Cell, corners: &[f32; 8], stops: &mut [Vec<Stop>; 3]) -> f32 {
        let (low, high) = (self.base + self.edges * cell.low, self.base + self.edges * (cell.low + cell.edge));
        let last = self.voxels.last();
        for (axis, stops) in stops.iter_mut().enumerate() {
            let (from, to) = (snap(low[axis].max(0.0)), snap(high[axis].min(last[axis])));
            stops.clear();
            if from > to {
                return 0.0;
            }
            let stop = |place: f64| {
                let at = (place - low[axis]) / (high[axis] - low[axis]);
                (self.voxels.between(axis, place), at.clamp(0.0, 1.0) as f32)
            };
            stops.push(stop(from));
            stops.extend((from as usize + 1..point_from(to)).map(|point| stop(point as f64)));
            stops.push(stop(to));
        }
        let [xs, ys, zs] = stops;
        let mut worst = 0f32;
        for &(z, at_z) in zs.iter() {
            for &(y, at_y) in ys.iter() {
                // The leaf's field along the row, by its ends.
                let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
                let end = |k: usize| lerp(lerp(corners[k], corners[k + 2], at_y), lerp(corners[k + 4], corners[k + 6], at_y), at_z);
                let (left, right) = (end(0), end(1));
                self.voxels.along_row(xs.iter().map(|&(x, _)| x), y, z, |i, value| {
                    // What is missing is no error: a maximum passes over NaN.
                    worst = worst.max((value - lerp(left, right, xs[i].1)).abs());
                });
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::super::{OctreeParams, Reconstruction, regularize_grid};
    use super::*;
    use crate::volume::{GridFrame, Samples};
    use glam::DMat3;

    fn waves(dims: [u32; 3], steps: DMat3) -> Grid {
        let frame = GridFrame { dims, origin: DVec3::new(3.0, -2.0, 1.0), steps };
        let [nx, ny, nz] = dims;
        let value = |i: u32| {
            let p = DVec3::new(f64::from(i % nx), f64::from(i / nx % ny), f64::from(i / nx / ny));
            if i == 77 { f64::NAN } else { (0.4 * p.x).sin() + (0.3 * p.y + 0.5 * p.z).cos() }
        };
        Grid::new(frame, "s".into(), Samples::F64((0..nx * ny * nz).map(value).collect())).expect("valid")
    }

    fn texture(grid: &Grid, params: &OctreeParams) -> OctreeTexture {
        OctreeTexture::encode(&regularize_grid(grid, params, &Progress::new()).expect("regularizes")).expect("fits")
    }

    /// The field and its place in the world from the points' own numbers, without any of what the octree uses.
    fn trilinear_of(grid: &Grid, place: DVec3) -> f64 {
        let [lo, hi] = grid.range();
        let dims = grid.frame().dims.map(|n| n as usize);
        let low: [usize; 3] = std::array::from_fn(|a| (place[a] as usize).min(dims[a] - 2));
        (0..8)
            .map(|k| {
                let point: [usize; 3] = std::array::from_fn(|a| low[a] + (k >> a & 1));
                let weight: f64 =
                    (0..3).map(|a| if k >> a & 1 == 1 { place[a] - low[a] as f64 } else { 1.0 - (place[a] - low[a] as f64) }).product();
                weight * (grid.samples().get(point[0] + dims[0] * (point[1] + dims[1] * point[2])) - lo) / (hi - lo)
            })
            .sum()
    }

    #[test]
    fn nothing_exceeds_the_bound_and_something_reaches_it() {
        let plain = DMat3::from_diagonal(DVec3::new(0.5, 1.0, 0.7));
        let turned_axes = DMat3::from_cols(DVec3::Z * -0.5, DVec3::X, DVec3::Y * 0.7);
        for (steps, reconstruction) in
            [(plain, Reconstruction::Continuous), (turned_axes, Reconstruction::Continuous), (plain, Reconstruction::Leaf)]
        {
            let grid = waves([19, 14, 11], steps);
            let params = OctreeParams { tolerance: Some(0.05), max_depth: 5, reconstruction, ..OctreeParams::default() };
            let texture = texture(&grid, &params);
            let bound = grid_error_bound(&grid, &texture, &Progress::new()).expect("nobody cancels").expect("its axes are the world's");
            let mut seed = 1u64;
            let mut random = || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (seed >> 11) as f64 / (1u64 << 53) as f64
            };
            let mut worst = 0f64;
            for i in 0..200_000 {
                let last = DVec3::new(18.0, 13.0, 10.0);
                let place = DVec3::new(random(), random(), random()) * last;
                // Every other one next to a point of the volume, where the extremes are.
                let near = (place.round() + 1e-3 * (DVec3::new(random(), random(), random()) - 0.5)).clamp(DVec3::splat(1e-9), last - 1e-9);
                let place = if i % 2 == 0 { near } else { place };
                let expected = trilinear_of(&grid, place);
                let world = grid.frame().origin - grid.center() + grid.frame().steps * place;
                let found = texture.value_at((world - texture.root_min()) / texture.root_edge());
                if let (Some(found), false) = (found, expected.is_nan()) {
                    worst = worst.max((f64::from(found) - expected).abs());
                }
            }
            assert!(worst <= bound.bound_rel, "{worst} is more than {bound:?}");
            assert!(worst > 0.75 * bound.bound_rel && bound.bound_rel > 0.01, "{worst} is far below {bound:?}, {reconstruction:?}");
        }
    }

    #[test]
    fn what_repeats_the_points_has_no_error_but_rounding() {
        let grid = waves([9, 9, 9], DMat3::IDENTITY);
        let params = OctreeParams { tolerance: Some(0.0), max_depth: 3, ..OctreeParams::default() };
        let bound = grid_error_bound(&grid, &texture(&grid, &params), &Progress::new()).expect("nobody cancels").expect("aligned");
        assert!(bound.bound_rel < 1e-5, "{bound:?}");
        let askew = DMat3::from_cols(DVec3::new(1.0, 0.2, 0.0), DVec3::new(-0.2, 1.0, 0.0), DVec3::Z);
        let turned = waves([9, 9, 9], askew);
        assert_eq!(grid_error_bound(&turned, &texture(&turned, &params), &Progress::new()), Ok(None));
    }
}
