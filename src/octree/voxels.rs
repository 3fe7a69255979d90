//! A volume as the regularizer reads it: values at places between its points, and bounds of the values in boxes of it.
//!
//! Places are in *steps* from the point with the lowest coordinates. Where the volume's axes are the world's, in whatever order and sense,
//! the axes of steps are the world's in theirs; else they are the volume's own.

use super::lattice::Sample;
use crate::geometry::Placed;
use crate::volume::{Grid, Voxel};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::borrow::Cow;

/// A place this near to a point, in steps, is that point.
const AT_POINT: f64 = 1e-6;

/// A direction whose other components are below this part of its length goes along an axis.
const ALONG_AXIS: f64 = 1e-9;

/// Values that are normalised together.
const LANES: usize = 4;

/// Steps along each side of a block of the finest level of [`Bounds`].
const BLOCK: usize = 4;

/// The values of a grid by place.
pub(super) struct Voxels<'a, V> {
    values: &'a [V],
    /// Points along each axis of steps.
    pub dims: [usize; 3],
    start: isize,
    strides: [isize; 3],
    /// Where point (0, 0, 0) lies, relative to the grid's centre.
    pub first: DVec3,
    /// From world to steps, without the offset.
    pub to_steps: DMat3,
    /// Whether the axes of steps are the world's.
    pub is_aligned: bool,
    low: f64,
    scale: f64,
}

/// A place between two points along one axis: the lower one's number, and how far on to the next it is, in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Between {
    pub point: usize,
    pub part: f32,
}

impl<'a, V: Voxel> Voxels<'a, V> {
    pub fn new(grid: &Grid, values: &'a [V]) -> Self {
        let frame = grid.frame();
        let dims = frame.dims.map(|n| n as usize);
        let strides = [1, dims[0] as isize, (dims[0] * dims[1]) as isize];
        let [low, high] = grid.range();
        let scale = if high > low { 1.0 / (high - low) } else { 0.0 };
        let first = frame.origin - grid.center();
        let mut voxels = Voxels { values, dims, start: 0, strides, first, to_steps: frame.steps.inverse(), is_aligned: false, low, scale };
        if let Some(axes) = axes(&frame.steps) {
            voxels.align(&frame.steps, axes);
        }
        voxels
    }

    /// Turns the axes of steps to the world's: axis `i` of the grid goes along axis `axes[i]`.
    fn align(&mut self, steps: &DMat3, axes: [usize; 3]) {
        let (dims, strides) = (self.dims, self.strides);
        let mut spacing = DVec3::ZERO;
        for (i, axis) in axes.into_iter().enumerate() {
            let step = steps.col(i)[axis];
            (self.dims[axis], self.strides[axis], spacing[axis]) = (dims[i], strides[i], step.abs());
            if step < 0.0 {
                let last = dims[i] as isize - 1;
                self.start += strides[i] * last;
                self.strides[axis] = -strides[i];
                self.first[axis] += step * last as f64;
            }
        }
        self.to_steps = DMat3::from_diagonal(spacing.recip());
        self.is_aligned = true;
    }

    /// The last point along each axis.
    pub fn last(&self) -> DVec3 {
        DVec3::from_array(self.dims.map(|n| n as f64 - 1.0))
    }

    #[inline(always)]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [sx, sy, sz] = self.strides;
        (self.start + x as isize * sx + y as isize * sy + z as isize * sz) as usize
    }

    /// The normalised value at a point, NaN where it is missing.
    #[inline(always)]
    pub fn at_point(&self, point: [usize; 3]) -> f32 {
        self.normalize(self.values[self.index(point)])
    }

    /// Copies the normalised values at `count` points from one on along x. What comes behind them in `to` may be anything.
    #[inline(always)]
    pub fn copy_row<const W: usize>(&self, first: [usize; 3], count: usize, to: &mut [f32; W]) {
        let start = self.index(first);
        let wide = count.next_multiple_of(LANES).min(W);
        if self.strides[0] != 1 {
            let place = |x: usize| (start as isize + x as isize * self.strides[0]) as usize;
            to.iter_mut().take(count).enumerate().for_each(|(x, to)| *to = self.normalize(self.values[place(x)]));
        } else if let Some(from) = self.values.get(start..start + wide) {
            // A fixed number at a time, though some are not asked for.
            for (to, from) in to.as_chunks_mut::<LANES>().0.iter_mut().zip(from.as_chunks::<LANES>().0) {
                for i in 0..LANES {
                    to[i] = self.normalize(from[i]);
                }
            }
        } else {
            let from = &self.values[start..start + count];
            to.iter_mut().zip(from).for_each(|(to, &value)| *to = self.normalize(value));
        }
    }

    #[inline(always)]
    fn normalize(&self, value: V) -> f32 {
        ((value.to_f64() - self.low) * self.scale) as f32
    }

    /// A place along an axis, moved into the volume.
    #[inline]
    pub fn between(&self, axis: usize, place: f64) -> Between {
        let place = snap(place).clamp(0.0, self.dims[axis] as f64 - 1.0);
        let point = (place as usize).min(self.dims[axis] - 2);
        Between { point, part: (place - point as f64) as f32 }
    }

    /// The normalised values at the points around a place, and their weights; points without weight left out.
    #[inline]
    fn around(&self, at: [Between; 3]) -> impl Iterator<Item = (f32, f32)> {
        let weight = move |axis: usize, upper: usize| if upper == 1 { at[axis].part } else { 1.0 - at[axis].part };
        (0..8usize).filter_map(move |k| {
            let upper = [k & 1, k >> 1 & 1, k >> 2];
            let weight = weight(0, upper[0]) * weight(1, upper[1]) * weight(2, upper[2]);
            (weight > 0.0).then(|| (weight, self.at_point([0, 1, 2].map(|a| at[a].point + upper[a]))))
        })
    }

    /// The trilinear value at a place moved into the volume; NaN where a point that it hangs on is missing.
    #[inline]
    pub fn at(&self, place: DVec3) -> f32 {
        self.at_between([self.between(0, place.x), self.between(1, place.y), self.between(2, place.z)])
    }

    /// The same at a place found already.
    #[inline]
    pub fn at_between(&self, at: [Between; 3]) -> f32 {
        if at.iter().all(|b| b.part == 0.0) {
            return self.at_point(at.map(|b| b.point));
        }
        let row = |y: usize, z: usize| self.in_row(at[0], at[1].point + y, at[2].point + z);
        let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
        let plane = |z: usize| if at[1].part == 0.0 { row(0, z) } else { lerp(row(0, z), row(1, z), at[1].part) };
        if at[2].part == 0.0 { plane(0) } else { lerp(plane(0), plane(1), at[2].part) }
    }

    /// The value between two points of a row.
    #[inline(always)]
    fn in_row(&self, x: Between, y: usize, z: usize) -> f32 {
        let a = self.at_point([x.point, y, z]);
        if x.part == 0.0 { a } else { a + x.part * (self.at_point([x.point + 1, y, z]) - a) }
    }

    /// Calls `see` with the trilinear value at each of some places along x, at one along y and z, and the place's number.
    #[inline(always)]
    pub fn along_row(&self, xs: impl Iterator<Item = Between>, y: Between, z: Between, mut see: impl FnMut(usize, f32)) {
        if y.part == 0.0 && z.part == 0.0 {
            xs.enumerate().for_each(|(i, x)| see(i, self.in_row(x, y.point, z.point)));
        } else {
            let lerp = |a: f32, b: f32, w: f32| if w == 0.0 { a } else { a + w * (b - a) };
            for (i, x) in xs.enumerate() {
                let row = |up_y: usize, up_z: usize| self.in_row(x, y.point + up_y, z.point + up_z);
                let plane = |up_z: usize| if y.part == 0.0 { row(0, up_z) } else { lerp(row(0, up_z), row(1, up_z), y.part) };
                see(i, if z.part == 0.0 { plane(0) } else { lerp(plane(0), plane(1), z.part) });
            }
        }
    }

    /// What is known of the value at a place: the trilinear one, or a mean of those around it that are not missing.
    pub fn sample(&self, place: DVec3) -> Sample {
        let value = self.at(place);
        if !value.is_nan() {
            return Sample::exact(value);
        }
        let at = [0, 1, 2].map(|axis| self.between(axis, place[axis]));
        let known = self.around(at).filter(|(_, value)| !value.is_nan());
        let (sum, weight) = known.fold((0f64, 0f64), |(sum, all), (w, v)| (sum + f64::from(w * v), all + f64::from(w)));
        if weight > 0.0 { Sample::mean(sum, weight) } else { Sample::default() }
    }

    /// All values along x at one y and z.
    fn row(&self, y: usize, z: usize) -> Cow<'a, [V]> {
        let start = self.index([0, y, z]);
        if self.strides[0] == 1 {
            Cow::Borrowed(&self.values[start..start + self.dims[0]])
        } else {
            Cow::Owned((0..self.dims[0]).map(|x| self.values[self.index([x, y, z])]).collect())
        }
    }
}

/// Which axis of the world each column goes along; `None` unless each goes along one of its own.
fn axes(steps: &DMat3) -> Option<[usize; 3]> {
    let axis = |column: DVec3| (0..3).find(|&axis| (column.length() - column[axis].abs()) <= ALONG_AXIS.powi(2) * column.length());
    let strict = |column: DVec3, axis: usize| (0..3).all(|a| a == axis || column[a].abs() <= ALONG_AXIS * column.length());
    let found = [steps.x_axis, steps.y_axis, steps.z_axis].map(|c| axis(c).filter(|&a| strict(c, a)));
    let found = [found[0]?, found[1]?, found[2]?];
    (found[0] != found[1] && found[1] != found[2] && found[0] != found[2]).then_some(found)
}

/// A place, or the point that it stands for if it is at one but for rounding.
#[inline]
pub(super) fn snap(place: f64) -> f64 {
    // Rounds what is not negative; all else is outside the volume. Without a call, which `round` is on plain x86-64.
    let point = (place + 0.5) as i64 as f64;
    if (place - point).abs() < AT_POINT { point } else { place }
}

/// The first point at or behind a place that is not negative.
#[inline]
pub(super) fn point_from(place: f64) -> usize {
    let point = place as usize;
    point + usize::from((point as f64) < place)
}

/// Smallest and largest normalised values in boxes of a volume.
///
/// Level 0 has a range for each block of [`BLOCK`] steps a side, the points of its upper sides included, so that the field between them is
/// in it too; each further level one for eight of the level before.
pub(super) struct Bounds {
    levels: Vec<BoundsLevel>,
}

struct BoundsLevel {
    dims: [usize; 3],
    ranges: Vec<[f32; 2]>,
}

/// The range of nothing, or of missing values only.
pub(super) const NOTHING: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// The range where some values are missing and others are not.
pub(super) const SOME_MISSING: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// The range of two that both have values, or none.
fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    if (a == NOTHING) == (b == NOTHING) { [a[0].min(b[0]), a[1].max(b[1])] } else { SOME_MISSING }
}

impl Bounds {
    pub fn new<V: Voxel>(voxels: &Voxels<V>) -> Self {
        let mut levels = vec![BoundsLevel::finest(voxels)];
        while let Some(below) = levels.last().filter(|level| level.dims.iter().any(|&n| n > 1)) {
            let next = below.halved();
            levels.push(next);
        }
        Bounds { levels }
    }

    /// A range that holds all values between points `low` and `high`, both included. [`NOTHING`] if all are missing, [`SOME_MISSING`] if
    /// some may be.
    pub fn range(&self, low: [usize; 3], high: [usize; 3]) -> [f32; 2] {
        let side = (0..3).map(|a| high[a] - low[a]).max().unwrap_or(0);
        let number = ((side / BLOCK).max(1).ilog2() as usize).min(self.levels.len() - 1);
        let (level, edge) = (&self.levels[number], BLOCK << number);
        let span = |a: usize| low[a] / edge..high[a].div_ceil(edge).clamp(low[a] / edge + 1, level.dims[a].max(low[a] / edge + 1));
        let mut all: Option<[f32; 2]> = None;
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let range = level.at([x, y, z]);
                    all = Some(all.map_or(range, |all| union(all, range)));
                }
            }
        }
        all.unwrap_or(SOME_MISSING)
    }
}

impl BoundsLevel {
    fn at(&self, at: [usize; 3]) -> [f32; 2] {
        let [x, y, z] = [0, 1, 2].map(|a| at[a].min(self.dims[a] - 1));
        self.ranges[x + self.dims[0] * (y + self.dims[1] * z)]
    }

    #[allow(clippy::eq_op)] // only NaN differs from itself
    fn finest<V: Voxel>(voxels: &Voxels<V>) -> Self {
        let dims = voxels.dims.map(|n| (n - 1).div_ceil(BLOCK));
        let last = voxels.dims.map(|n| n - 1);
        let mut ranges = vec![NOTHING; dims.iter().product()];
        ranges.par_chunks_mut(dims[0]).enumerate().for_each(|(i, ranges)| {
            let (y, z) = (i % dims[1] * BLOCK, i / dims[1] * BLOCK);
            // Over the rows first, which vector instructions like.
            let first = voxels.row(y, z);
            let (mut low, mut high) = (first.to_vec(), first.to_vec());
            let (mut missing, mut known) = (vec![false; low.len()], vec![false; low.len()]);
            for z in z..=(z + BLOCK).min(last[2]) {
                for y in y..=(y + BLOCK).min(last[1]) {
                    for (x, &v) in voxels.row(y, z).iter().enumerate() {
                        low[x] = if v < low[x] || low[x] != low[x] { v } else { low[x] };
                        high[x] = if v > high[x] || high[x] != high[x] { v } else { high[x] };
                        missing[x] |= v != v;
                        known[x] |= v == v;
                    }
                }
            }
            for (block, range) in ranges.iter_mut().enumerate() {
                let points = block * BLOCK..=(block * BLOCK + BLOCK).min(last[0]);
                *range = match (missing[points.clone()].contains(&true), known[points.clone()].contains(&true)) {
                    (true, true) => SOME_MISSING,
                    (true, false) => NOTHING,
                    _ => points.fold(NOTHING, |range, x| [range[0].min(voxels.normalize(low[x])), range[1].max(voxels.normalize(high[x]))]),
                };
            }
        });
        BoundsLevel { dims, ranges }
    }

    fn halved(&self) -> Self {
        let dims = self.dims.map(|n| n.div_ceil(2));
        let of_eight = |i: usize| {
            let low = [i % dims[0] * 2, i / dims[0] % dims[1] * 2, i / (dims[0] * dims[1]) * 2];
            let child = |k: usize| self.at([low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)]);
            (1..8).map(child).fold(child(0), union)
        };
        BoundsLevel { dims, ranges: (0..dims.iter().product()).into_par_iter().map(of_eight).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{GridFrame, Samples};

    fn grid(dims: [u32; 3], steps: DMat3, value: impl Fn(usize) -> f32) -> Grid {
        let count = dims.iter().product::<u32>() as usize;
        Grid::new(GridFrame { dims, origin: DVec3::ZERO, steps }, "s".into(), Samples::F32((0..count).map(value).collect())).expect("valid")
    }

    fn values(grid: &Grid) -> &[f32] {
        match grid.samples() {
            Samples::F32(values) => values,
            _ => unreachable!("made of f32"),
        }
    }

    #[test]
    fn places_follow_the_world_whatever_way_the_grid_goes() {
        // x of the grid goes down the world's z, y along x, z along y.
        let steps = DMat3::from_cols(-2.0 * DVec3::Z, DVec3::X, 3.0 * DVec3::Y);
        let grid = grid([5, 3, 4], steps, |i| i as f32);
        let voxels = Voxels::new(&grid, values(&grid));
        assert!(voxels.is_aligned);
        assert_eq!(voxels.dims, [3, 4, 5]);
        for (index, expected) in [([0, 0, 4], 0.0), ([0, 0, 3], 1.0), ([1, 0, 4], 5.0), ([0, 1, 4], 15.0), ([2, 3, 0], 59.0)] {
            assert!((voxels.at_point(index) * 59.0 - expected).abs() < 1e-4, "{index:?}");
            let world = voxels.first + voxels.to_steps.inverse() * DVec3::from_array(index.map(|i| i as f64)) + grid.center();
            let own = steps.inverse() * world;
            assert!((own.dot(DVec3::new(1.0, 5.0, 15.0)) - expected as f64).abs() < 1e-9, "{index:?} lies at {world}");
        }
        assert!((voxels.at(DVec3::new(0.5, 1.25, 3.5)) * 59.0 - (2.5 + 15.0 * 1.25 + 0.5)).abs() < 1e-4);
        assert_eq!(voxels.at(DVec3::new(-3.0, -1.0, 9.0)), 0.0, "moved into the volume");
    }

    #[test]
    fn bounds_hold_what_lies_in_a_box() {
        let noise = |i: usize| ((i * 2_654_435_761) % 1009) as f32;
        let grid = grid([23, 17, 9], DMat3::IDENTITY, noise);
        let voxels = Voxels::new(&grid, values(&grid));
        let bounds = Bounds::new(&voxels);
        for (low, high) in [([0, 0, 0], [22, 16, 8]), ([4, 4, 4], [8, 8, 8]), ([3, 7, 2], [9, 8, 3]), ([21, 15, 7], [22, 16, 8])] {
            let range = bounds.range(low, high);
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    for x in low[0]..=high[0] {
                        let value = voxels.at_point([x, y, z]);
                        assert!(range[0] <= value && value <= range[1], "{value} in {range:?}");
                    }
                }
            }
        }
        assert!(bounds.range([4, 4, 4], [8, 8, 8])[0] > 0.0, "a block's range is its own");
    }

    #[test]
    fn missing_values_are_told_from_known_ones() {
        let grid = grid([17, 9, 9], DMat3::IDENTITY, |i| if i % 17 < 9 { f32::NAN } else { 1.0 });
        let voxels = Voxels::new(&grid, values(&grid));
        let bounds = Bounds::new(&voxels);
        assert_eq!(bounds.range([0, 0, 0], [8, 8, 8]), NOTHING);
        assert_eq!(bounds.range([0, 0, 0], [16, 8, 8]), SOME_MISSING);
        assert_eq!(bounds.range([12, 0, 0], [16, 4, 4]), [0.0, 0.0]);
        assert!(voxels.at(DVec3::new(8.5, 2.0, 2.0)).is_nan() && !voxels.at(DVec3::new(9.0, 2.0, 2.0)).is_nan());
        assert_eq!(voxels.sample(DVec3::new(8.5, 2.0, 2.0)).value(), 0.0);
    }
}
