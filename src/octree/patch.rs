//! The field in the eight cells of a small block, on all planes of points and of cells: between them field and reconstruction are trilinear.

use super::brick::{LATTICE, lattice_index};
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
        self.places = places;
        let last = voxels.last()[axis];
        if places[0] >= 0.0 && places[2] < last && places.iter().all(|&place| place == place as i64 as f64) {
            let first = places[0] as usize;
            self.marks = places.map(|place| place as usize - first);
            self.count = self.marks[2] + 1;
            for (k, (stop, step)) in self.stops.iter_mut().zip(&mut self.steps).take(self.count).enumerate() {
                *stop = Between { point: first + k, part: 0.0 };
                *step = (first + k) as f64;
            }
            self.is_whole = true;
            return;
        }
        let ends = places.map(|place| place.clamp(0.0, last));
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

    #[inline(always)]
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

/// What lies at part of the way between two rows.
#[inline(always)]
fn lerp_rows<const W: usize>(a: &[f32; W], b: &[f32; W], part: f32) -> [f32; W] {
    let mut made = [0f32; W];
    for i in 0..W {
        made[i] = a[i] + part * (b[i] - a[i]);
    }
    made
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
                if y.is_whole {
                    set_row(target, py, pz, &rows[py]);
                }
            }
            if y.is_whole {
                continue;
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
        let x = x.map(|mark| mark.min(W - 1));
        let mut lattice = [0f32; LATTICE];
        for k in 0..3 {
            for j in 0..3 {
                let row = row::<W>(&self.values, y[j], z[k]);
                for i in 0..3 {
                    lattice[lattice_index(i as u32, j as u32, k as u32)] = row[x[i]];
                }
            }
        }
        lattice
    }

    /// Looks through cell `i`, which has these values at its corners, until an error above `enough` is found.
    pub fn look(&self, i: u32, corners: &[f32; 8], enough: f32) -> Look {
        if self.is_narrow() { self.look_at::<FEW>(i, corners, enough) } else { self.look_at::<MOST>(i, corners, enough) }
    }

    #[inline(always)]
    fn look_at<const W: usize>(&self, i: u32, corners: &[f32; 8], enough: f32) -> Look {
        let [x, y, z] = &self.lines;
        let upper = [i & 1, i >> 1 & 1, i >> 2].map(|c| c as usize);
        let (first, last) = (x.marks[upper[0]], x.marks[upper[0] + 1]);
        // Planes of other cells are put in the place of this one's first, which is seen anyway.
        let (mut mask, mut at) = ([0u32; W], [x.at[upper[0]][first]; W]);
        for k in first..=last.min(W - 1) {
            (mask[k], at[k]) = (u32::MAX, x.at[upper[0]][k]);
        }
        // The reconstruction along the cell's four edges across y and z, for each y.
        let mut edges = [[0f32; 4]; MOST];
        for py in y.marks[upper[1]]..=y.marks[upper[1] + 1] {
            let below = [corners[0], corners[1], corners[4], corners[5]];
            edges[py] = lerp_rows(&below, &[corners[2], corners[3], corners[6], corners[7]], y.at[upper[1]][py]);
        }
        let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
        let (mut worst, mut low, mut high, mut sum) = ([0f32; W], [f32::INFINITY; W], [f32::NEG_INFINITY; W], [0f32; W]);
        for pz in z.marks[upper[2]]..=z.marks[upper[2] + 1] {
            let at_z = z.at[upper[2]][pz];
            for py in y.marks[upper[1]]..=y.marks[upper[1] + 1] {
                let edges = &edges[py];
                let (left, right) = (lerp(edges[0], edges[2], at_z), lerp(edges[1], edges[3], at_z));
                let values = row::<W>(&self.values, py, pz);
                let at_first = values[first].to_bits();
                for k in 0..W {
                    let value = f32::from_bits(values[k].to_bits() & mask[k] | at_first & !mask[k]);
                    let error = (value - lerp(left, right, at[k])).abs();
                    // None of these takes NaN, but the sum.
                    worst[k] = if error > worst[k] { error } else { worst[k] };
                    low[k] = if value < low[k] { value } else { low[k] };
                    high[k] = if value > high[k] { value } else { high[k] };
                    sum[k] += value;
                }
            }
            if worst.iter().any(|&error| error > enough) {
                break;
            }
        }
        Look {
            worst: worst.into_iter().fold(0.0, f32::max),
            range: [low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max)],
            has_missing: sum.iter().any(|sum| sum.is_nan()),
        }
    }
}

impl Line {
    /// The values at the stops in one row of points.
    #[inline(always)]
    fn row<const W: usize, V: Voxel>(&self, voxels: &Voxels<V>, (first, count): (usize, usize), y: usize, z: usize) -> [f32; W] {
        let mut points = [0f32; W];
        voxels.copy_row([first, y, z], count, &mut points);
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

#[cfg(test)]
mod tests {
    use super::super::brick::{corner_of_child, trilinear};
    use super::*;
    use crate::volume::{Grid, GridFrame, Samples};
    use glam::DVec3;

    /// Noise with a value missing here and there.
    fn noise(dims: [u32; 3], missing: usize) -> Grid {
        let frame = GridFrame::along_axes(dims, DVec3::ZERO, DVec3::ONE);
        let value = |i: usize| if missing > 0 && i % missing == 1 { f64::NAN } else { ((i * 2_654_435_761) % 1009) as f64 };
        Grid::new(frame, "s".into(), Samples::F64((0..dims.iter().product::<u32>() as usize).map(value).collect())).expect("valid")
    }

    fn values(grid: &Grid) -> &[f64] {
        match grid.samples() {
            Samples::F64(values) => values,
            _ => unreachable!("made of f64"),
        }
    }

    /// Blocks between points, at points, of one plane and of many, up to the volume's sides and beyond.
    const BLOCKS: [[[f64; 3]; 3]; 6] = [
        [[4.0, 5.0, 6.0], [2.0, 3.0, 4.0], [1.0, 2.0, 3.0]],
        [[4.0, 8.0, 12.0], [2.0, 6.0, 10.0], [0.0, 4.0, 8.0]],
        [[3.0, 4.0, 5.0], [3.0, 4.0, 5.0], [1.3, 1.95, 2.6]],
        [[3.0, 3.5, 4.0], [3.0, 3.5, 4.0], [1.7, 2.1, 2.5]],
        [[9.4, 11.3, 13.2], [0.2, 3.9, 7.6], [4.0, 6.5, 9.0]],
        [[12.0, 14.0, 16.0], [8.0, 12.0, 16.0], [-1.0, 1.0, 3.0]],
    ];

    #[test]
    fn the_corners_of_cells_have_the_fields_own_values() {
        for missing in [0, 23] {
            let grid = noise([16, 13, 10], missing);
            let voxels = Voxels::new(&grid, values(&grid));
            let mut patch = Patch::default();
            for places in BLOCKS {
                patch.set(&voxels, places);
                for (i, value) in patch.lattice().into_iter().enumerate() {
                    let [x, y, z] = super::super::brick::lattice_point(i).map(|c| c as usize);
                    let expected = voxels.at(DVec3::new(places[0][x], places[1][y], places[2][z]));
                    assert!(value == expected || value.is_nan() && expected.is_nan(), "{value} is not {expected} at {i} of {places:?}");
                }
            }
        }
    }

    #[test]
    fn a_look_finds_the_worst_of_all_places_in_a_cell() {
        let grid = noise([16, 13, 10], 0);
        let voxels = Voxels::new(&grid, values(&grid));
        let mut patch = Patch::default();
        for places in BLOCKS {
            patch.set(&voxels, places);
            patch.measure();
            let lattice = patch.lattice();
            for i in 0..8 {
                let corners: [f32; 8] = std::array::from_fn(|k| lattice[corner_of_child(i, k as u32)]);
                let look = patch.look(i, &corners, f32::INFINITY);
                // Places all over the cell, as far as it lies in the volume: none may be worse or outside the range.
                let low = DVec3::from_array([0, 1, 2].map(|a| places[a][(i >> a & 1) as usize]));
                let size = DVec3::from_array([0, 1, 2].map(|a| places[a][(i >> a & 1) as usize + 1])) - low;
                let mut found = Look::NOTHING;
                for n in 0..33 * 33 * 33 {
                    let unit = DVec3::new(f64::from(n % 33), f64::from(n / 33 % 33), f64::from(n / 33 / 33)) / 32.0;
                    let place = low + unit * size;
                    if place.cmpge(DVec3::ZERO).all() && place.cmple(voxels.last()).all() {
                        found.see(voxels.at(place), trilinear(&corners, unit.as_vec3()));
                    }
                }
                if found.range == NOTHING {
                    continue; // nothing of it in the volume
                }
                assert!(found.worst <= look.worst + 1e-5, "{} over {} in cell {i} of {places:?}", found.worst, look.worst);
                assert!(look.range[0] <= found.range[0] + 1e-5 && found.range[1] <= look.range[1] + 1e-5, "cell {i} of {places:?}");
                // And where planes are at points of the 33, the worst is found.
                if size.cmple(DVec3::splat(4.0)).all() && low.fract() == DVec3::ZERO && size.fract() == DVec3::ZERO {
                    assert!((found.worst - look.worst).abs() < 1e-5 && !look.has_missing, "{} {}", found.worst, look.worst);
                }
            }
        }
    }

    #[test]
    fn missing_values_are_seen_and_do_not_hide_errors() {
        let grid = noise([16, 13, 10], 23);
        let voxels = Voxels::new(&grid, values(&grid));
        let mut patch = Patch::default();
        patch.set(&voxels, BLOCKS[1]);
        patch.measure();
        let look = patch.look(0, &[0.5; 8], f32::INFINITY);
        assert!(look.has_missing && look.worst > 0.3 && look.range[0] < 0.2 && look.range[1] > 0.8, "{look:?}");
        let enough = patch.look(0, &[0.5; 8], 0.1);
        assert!(enough.worst > 0.1 && enough.worst <= look.worst, "{enough:?}");
    }
}
