//! The field in the eight cells of a small block, on all planes of points and of cells: between them field and reconstruction are trilinear.

use super::brick::{LATTICE, lattice_point};
use super::voxels::{Between, NOTHING, Voxels, point_from};
use crate::volume::Voxel;

/// A block of at most this many steps a side is looked at as a patch.
pub(super) const PATCH_STEPS: usize = 8;

/// The most planes along an axis: those of points inside, and three of the cells.
const MOST: usize = 12;

/// Planes along x for which short rows do.
const FEW: usize = 4;

/// What was found by looking through a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// The largest difference between reconstruction and field.
    pub worst: f32,
    /// The smallest and the largest value.
    pub range: [f32; 2],
    pub has_missing: bool,
}

impl Look {
    /// Before anything was seen.
    pub const NOTHING: Look = Look { worst: 0.0, range: NOTHING, has_missing: false };

    #[inline(always)]
    pub fn see(&mut self, value: f32, reconstructed: f32) {
        self.has_missing |= value.is_nan();
        // Neither takes NaN.
        self.worst = self.worst.max((value - reconstructed).abs());
        self.range = [self.range[0].min(value), self.range[1].max(value)];
    }
}

/// The planes across one axis.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Where the cells begin, meet and end, in steps.
    places: [f64; 3],
    /// The planes, among points and in steps.
    stops: [Between; MOST],
    steps: [f64; MOST],
    count: usize,
    /// The stops at which the cells begin, meet and end.
    marks: [usize; 3],
    /// Where in its own cell each stop lies, 0 to 1, for the lower and the upper cell.
    at: [[f32; MOST]; 2],
    /// All stops are points.
    is_whole: bool,
}

const NO_LINE: Line = Line {
    places: [0.0; 3],
    stops: [Between { point: 0, part: 0.0 }; MOST],
    steps: [0.0; MOST],
    count: 0,
    marks: [0; 3],
    at: [[0.0; MOST]; 2],
    is_whole: true,
};

impl Line {
    fn set<V: Voxel>(&mut self, voxels: &Voxels<V>, axis: usize, places: [f64; 3]) {
        let ends = places.map(|place| place.clamp(0.0, voxels.last()[axis]));
        self.places = places;
        self.count = 0;
        self.push(voxels, axis, ends[0]);
        for i in 0..2 {
            self.marks[i] = self.count - 1;
            if ends[i + 1] > ends[i] {
                for point in ends[i] as usize + 1..point_from(ends[i + 1]) {
                    self.push(voxels, axis, point as f64);
                }
                self.push(voxels, axis, ends[i + 1]);
            }
        }
        self.marks[2] = self.count - 1;
        self.is_whole = self.stops[..self.count].iter().all(|stop| stop.part == 0.0);
    }

    fn push<V: Voxel>(&mut self, voxels: &Voxels<V>, axis: usize, place: f64) {
        self.stops[self.count] = voxels.between(axis, place);
        self.steps[self.count] = place;
        self.count += 1;
    }

    /// Finds where in their cells the stops lie.
    fn measure(&mut self) {
        for i in 0..2 {
            let [low, high] = [self.places[i], self.places[i + 1]];
            for k in self.marks[i]..=self.marks[i + 1] {
                self.at[i][k] = ((self.steps[k] - low) / (high - low)) as f32;
            }
        }
    }

    /// The points that the stops lie between: the first, and how many.
    fn points(&self) -> (usize, usize) {
        let (first, last) = (self.stops[0], self.stops[self.count - 1]);
        (first.point, last.point + usize::from(last.part != 0.0) + 1 - first.point)
    }
}

/// A thread's memory for one block at a time.
pub(super) struct Patch {
    lines: [Line; 3],
    /// Rows of [`FEW`] or [`MOST`] values, by y and z.
    values: Vec<f32>,
    planes: Vec<f32>,
}

impl Default for Patch {
    fn default() -> Self {
        Patch { lines: [NO_LINE; 3], values: vec![0.0; MOST * MOST * MOST], planes: vec![0.0; MOST * MOST * MOST] }
    }
}

/// The values of a row at the stops of `x`.
#[inline(always)]
fn lerp_rows<const W: usize>(a: &[f32; W], b: &[f32; W], part: f32) -> [f32; W] {
    std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
}

#[inline(always)]
fn row<const W: usize>(rows: &[f32], y: usize, z: usize) -> &[f32; W] {
    rows[(y + MOST * z) * W..].first_chunk().unwrap_or(&[0.0; W])
}

#[inline(always)]
fn set_row<const W: usize>(rows: &mut [f32], y: usize, z: usize, values: &[f32; W]) {
    rows[(y + MOST * z) * W..][..W].copy_from_slice(values);
}

impl Patch {
    /// Takes on a block whose cells begin, meet and end at these places along each axis.
    pub fn set<V: Voxel>(&mut self, voxels: &Voxels<V>, places: [[f64; 3]; 3]) {
        for (axis, line) in self.lines.iter_mut().enumerate() {
            line.set(voxels, axis, places[axis]);
        }
        if self.is_narrow() { self.fill::<FEW, V>(voxels) } else { self.fill::<MOST, V>(voxels) }
    }

    /// Prepares for [`Patch::look`].
    pub fn measure(&mut self) {
        self.lines.iter_mut().for_each(Line::measure);
    }

    fn is_narrow(&self) -> bool {
        self.lines[0].count <= FEW
    }

    /// First x, then y, then z, as [`Voxels::at`] does.
    #[inline(always)]
    fn fill<const W: usize, V: Voxel>(&mut self, voxels: &Voxels<V>) {
        let Patch { lines: [x, y, z], values, planes } = self;
        let ((first_y, count_y), (first_z, count_z)) = (y.points(), z.points());
        let first_x = x.points();
        let mut rows = [[0f32; W]; MOST];
        let target = if z.is_whole { &mut *values } else { &mut *planes };
        for pz in 0..count_z {
            for py in 0..count_y {
                rows[py] = x.row(voxels, first_x, first_y + py, first_z + pz);
            }
            for (k, stop) in y.stops[..y.count].iter().enumerate() {
                let p = stop.point - first_y;
                let made = if stop.part == 0.0 { rows[p] } else { lerp_rows(&rows[p], &rows[p + 1], stop.part) };
                set_row(target, k, pz, &made);
            }
        }
        if z.is_whole {
            return;
        }
        for (k, stop) in z.stops[..z.count].iter().enumerate() {
            let p = stop.point - first_z;
            for y in 0..y.count {
                let below = row::<W>(planes, y, p);
                let made = if stop.part == 0.0 { *below } else { lerp_rows(below, row(planes, y, p + 1), stop.part) };
                set_row(values, y, k, &made);
            }
        }
    }

    /// The values at the 27 corners of the cells; NaN where something that they hang on is missing.
    pub fn lattice(&self) -> [f32; LATTICE] {
        if self.is_narrow() { self.lattice_of::<FEW>() } else { self.lattice_of::<MOST>() }
    }

    #[inline(always)]
    fn lattice_of<const W: usize>(&self) -> [f32; LATTICE] {
        let [x, y, z] = [0, 1, 2].map(|axis| self.lines[axis].marks);
        std::array::from_fn(|i| {
            let [i, j, k] = lattice_point(i).map(|c| c as usize);
            row::<W>(&self.values, y[j], z[k])[x[i]]
        })
    }

    /// Looks through cell `i`, which has these values at its corners, until an error above `enough` is found.
    pub fn look(&self, i: u32, corners: &[f32; 8], enough: f32) -> Look {
        if self.is_narrow() { self.look_at::<FEW>(i, corners, enough) } else { self.look_at::<MOST>(i, corners, enough) }
    }

    #[inline(always)]
    #[allow(clippy::eq_op)] // only NaN differs from itself
    fn look_at<const W: usize>(&self, i: u32, corners: &[f32; 8], enough: f32) -> Look {
        let [x, y, z] = &self.lines;
        let upper = [i & 1, i >> 1 & 1, i >> 2].map(|c| c as usize);
        let (first, last) = (x.marks[upper[0]], x.marks[upper[0] + 1]);
        let is_in: [bool; W] = std::array::from_fn(|k| first <= k && k <= last);
        let at: [f32; W] = std::array::from_fn(|k| x.at[upper[0]][if is_in[k] { k } else { first }]);
        let (mut worst, mut low, mut high, mut missing) = ([0f32; W], [f32::INFINITY; W], [f32::NEG_INFINITY; W], [false; W]);
        for pz in z.marks[upper[2]]..=z.marks[upper[2] + 1] {
            let at_z = z.at[upper[2]][pz];
            for py in y.marks[upper[1]]..=y.marks[upper[1] + 1] {
                let at_y = y.at[upper[1]][py];
                let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
                let end = |k: usize| lerp(lerp(corners[k], corners[k + 2], at_y), lerp(corners[k + 4], corners[k + 6], at_y), at_z);
                let (left, right) = (end(0), end(1));
                let values = row::<W>(&self.values, py, pz);
                for k in 0..W {
                    let value = if is_in[k] { values[k] } else { values[first] };
                    let error = (value - lerp(left, right, at[k])).abs();
                    // None of these takes NaN.
                    worst[k] = if error > worst[k] { error } else { worst[k] };
                    low[k] = if value < low[k] { value } else { low[k] };
                    high[k] = if value > high[k] { value } else { high[k] };
                    missing[k] |= value != value;
                }
            }
            if worst.iter().any(|&error| error > enough) {
                break;
            }
        }
        Look {
            worst: worst.into_iter().fold(0.0, f32::max),
            range: [low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max)],
            has_missing: missing.contains(&true),
        }
    }
}

impl Line {
    /// The values at the stops in one row of points.
    #[inline(always)]
    fn row<const W: usize, V: Voxel>(&self, voxels: &Voxels<V>, (first, count): (usize, usize), y: usize, z: usize) -> [f32; W] {
        let mut points = [0f32; W];
        voxels.copy_row([first, y, z], &mut points[..count]);
        if self.is_whole {
            return points;
        }
        let mut values = [0f32; W];
        for (value, stop) in values.iter_mut().zip(&self.stops[..self.count]) {
            let p = stop.point - first;
            *value = if stop.part == 0.0 { points[p] } else { points[p] + stop.part * (points[p + 1] - points[p]) };
        }
        values
    }
}
