//! A box of voxels in memory: halved for the next level, cut into bricks, summed up.

use super::super::BRICK_EDGE;
use super::voxel::StoredVoxel;
use rayon::prelude::*;

/// Bins of the histogram that entropy is of.
const BINS: usize = 256;

/// Voxels of a box, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Block<T> {
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// Their values.
    pub voxels: Vec<T>,
}

impl<T: StoredVoxel> Block<T> {
    /// A box of which nothing is known.
    pub fn unknown(dims: [usize; 3]) -> Self {
        Block { dims, voxels: vec![T::FILL; dims.iter().product()] }
    }

    /// Half the resolution along each axis, rounded up: every voxel is the mean of the known of its eight, or of those there are at the end.
    pub fn halved(&self) -> Block<T> {
        let [nx, ny, nz] = self.dims;
        let dims = self.dims.map(|n| n.div_ceil(2));
        let mut voxels = vec![T::FILL; dims.iter().product()];
        voxels.par_chunks_mut(dims[0] * dims[1]).enumerate().for_each(|(z, plane)| {
            for (y, row) in plane.chunks_mut(dims[0]).enumerate() {
                let pair = |i: usize, n: usize| [2 * i, (2 * i + 1).min(n - 1)];
                let ([y0, y1], [z0, z1]) = (pair(y, ny), pair(z, nz));
                let line = |y: usize, z: usize| &self.voxels[nx * (y + ny * z)..][..nx];
                if y1 > y0 && z1 > z0 {
                    let lines = [line(y0, z0), line(y1, z0), line(y0, z1), line(y1, z1)];
                    let pairs = lines.map(|line| line.chunks(2));
                    let [a, b, c, d] = pairs;
                    for ((((to, a), b), c), d) in row.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                        *to = match (a, b, c, d) {
                            (&[a0, a1], &[b0, b1], &[c0, c1], &[d0, d1]) => T::mean([a0, a1, b0, b1, c0, c1, d0, d1].into_iter()),
                            _ => T::mean([a[0], b[0], c[0], d[0]].into_iter()),
                        };
                    }
                } else {
                    for (x, to) in row.iter_mut().enumerate() {
                        let ends = |[low, high]: [usize; 2]| low..high + 1;
                        let voxels = ends([z0, z1]).flat_map(|z| ends([y0, y1]).map(move |y| (y, z)));
                        *to = T::mean(voxels.flat_map(|(y, z)| ends(pair(x, nx)).map(move |x| line(y, z)[x])));
                    }
                }
            }
        });
        Block { dims, voxels }
    }

    /// Puts a smaller box at a place in this one.
    pub fn put(&mut self, part: &Block<T>, at: [usize; 3]) {
        let [nx, ny, _] = self.dims;
        let [width, height, _] = part.dims;
        for (row, from) in part.voxels.chunks_exact(width).enumerate() {
            let (y, z) = (at[1] + row % height, at[2] + row / height);
            self.voxels[at[0] + nx * (y + ny * z)..][..width].copy_from_slice(from);
        }
    }

    /// The same voxels in a cube of this edge. Bricks that reach beyond them have their last voxels repeated; bricks that hold none of them hold
    /// nothing.
    pub fn padded(self, edge: usize) -> Block<T> {
        if self.dims == [edge; 3] {
            return self;
        }
        let whole = self.dims.map(|n| n.next_multiple_of(BRICK_EDGE as usize));
        let [nx, ny, nz] = self.dims;
        let mut cube = Block::unknown([edge; 3]);
        for z in 0..whole[2] {
            for y in 0..whole[1] {
                let from = &self.voxels[nx * (y.min(ny - 1) + ny * z.min(nz - 1))..][..nx];
                let to = &mut cube.voxels[edge * (y + edge * z)..][..whole[0]];
                to[..nx].copy_from_slice(from);
                to[nx..].fill(from[nx - 1]);
            }
        }
        cube
    }

    /// Range, entropy and share of the known values of the brick at a place in units of bricks. Both range ends are NaN where nothing is known.
    pub fn summary(&self, brick: [usize; 3]) -> ([f64; 2], f64, f64) {
        let edge = BRICK_EDGE as usize;
        let [nx, ny, _] = self.dims;
        let ends = [0, 1, 2].map(|axis| (brick[axis] * edge, ((brick[axis] + 1) * edge).min(self.dims[axis])));
        let rows = (ends[2].0..ends[2].1).flat_map(|z| (ends[1].0..ends[1].1).map(move |y| (y, z)));
        let rows = rows.map(|(y, z)| &self.voxels[nx * (y + ny * z)..][ends[0].0..ends[0].1]);
        summary_of(rows)
    }
}

/// Range, entropy in bits and share of the known values of some rows. The histogram has 256 bins over that range, or over the 256 values from its lower end
/// on where values are integers of a smaller range.
fn summary_of<'a, T: StoredVoxel>(rows: impl Iterator<Item = &'a [T]> + Clone) -> ([f64; 2], f64, f64) {
    let mut range: Option<[T; 2]> = None;
    let (mut all, mut count) = (0usize, 0usize);
    for row in rows.clone() {
        #[allow(clippy::eq_op)] // only NaN differs from itself
        let known = row.iter().copied().filter(|v| *v == *v);
        all += row.len();
        let Some(first) = range.map(|[low, _]| low).or_else(|| known.clone().next()) else { continue };
        let [mut low, mut high] = range.unwrap_or([first; 2]);
        for value in known {
            count += 1;
            low = if value < low { value } else { low };
            high = if value > high { value } else { high };
        }
        range = Some([low, high]);
    }
    let Some([low, high]) = range.map(|ends| ends.map(T::to_f64)) else { return ([f64::NAN; 2], 0.0, 0.0) };
    let known = count as f64 / all as f64;
    if low == high {
        return ([low, high], 0.0, known);
    }
    let is_whole = T::FILL.partial_cmp(&T::FILL).is_some();
    let scale = if is_whole && high - low < BINS as f64 { 1.0 } else { BINS as f64 / (high - low) };
    let mut counts = [0u32; BINS];
    for row in rows {
        for value in row {
            let value = value.to_f64();
            if !value.is_nan() {
                counts[(((value - low) * scale) as usize).min(BINS - 1)] += 1;
            }
        }
    }
    let total: f64 = counts.iter().map(|&count| f64::from(count)).sum();
    let share = |count: u32| f64::from(count) / total;
    let entropy = counts.iter().filter(|&&count| count > 0).map(|&count| -share(count) * share(count).log2()).sum::<f64>();
    ([low, high], entropy.max(0.0), known)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block<T: StoredVoxel>(dims: [usize; 3], value: impl Fn(usize, usize, usize) -> T) -> Block<T> {
        let [nx, ny, nz] = dims;
        let voxels = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (x, y, z)))).map(|(x, y, z)| value(x, y, z));
        Block { dims, voxels: voxels.collect() }
    }

    #[test]
    fn halving_a_linear_field_gives_it_between_the_voxels() {
        let fine = block([6, 4, 8], |x, y, z| (x + 10 * y + 100 * z) as f64);
        assert_eq!(
            fine.halved(),
            block([3, 2, 4], |x, y, z| (2 * x) as f64 + 0.5 + 10.0 * ((2 * y) as f64 + 0.5) + 100.0 * ((2 * z) as f64 + 0.5))
        );
    }

    #[test]
    fn what_is_left_over_at_the_end_is_the_mean_of_what_there_is() {
        let odd = block([3, 1, 5], |x, _, z| (x + 10 * z) as f64);
        assert_eq!(odd.halved(), Block { dims: [2, 1, 3], voxels: vec![5.5, 7.0, 25.5, 27.0, 40.5, 42.0] });
        let mut missing = block([2, 2, 2], |x, _, _| x as f32);
        missing.voxels[0] = f32::NAN;
        assert_eq!(missing.halved().voxels, [4.0 / 7.0]);
        assert!(Block::<f32>::unknown([2, 2, 2]).halved().voxels[0].is_nan());
        assert_eq!(block([2, 2, 2], |x, y, z| (x + y + z) as u8).halved().voxels, [2]);
    }

    #[test]
    fn padding_repeats_the_last_voxels_of_bricks_that_are_begun() {
        let part = block([65, 2, 1], |x, y, _| (1 + x + 100 * y) as u16);
        let cube = part.clone().padded(192);
        let at = |x: usize, y: usize, z: usize| cube.voxels[x + 192 * (y + 192 * z)];
        assert_eq!([at(64, 1, 0), at(127, 63, 63), at(128, 0, 0), at(0, 64, 0), at(0, 0, 64)], [165, 165, 0, 0, 0]);
        let mut again = Block::unknown([65, 2, 1]);
        again.put(&part, [0; 3]);
        assert_eq!(again, part);
    }

    #[test]
    fn entropy_is_that_of_its_definition() {
        let even = block([64, 64, 64], |x, _, _| (x % 4) as u8);
        assert_eq!(even.summary([0; 3]), ([0.0, 3.0], 2.0, 1.0));
        let constant = block([64, 64, 64], |_, _, _| 7.5f32);
        assert_eq!(constant.summary([0; 3]), ([7.5, 7.5], 0.0, 1.0));
        let uniform = block([64, 64, 64], |x, y, _| (x + 64 * y) as f32);
        let (range, entropy, _) = uniform.summary([0; 3]);
        assert_eq!(range, [0.0, 4095.0]);
        assert!((entropy - 8.0).abs() < 1e-3, "{entropy}");
        let (range, entropy, known) = Block::<f32>::unknown([64; 3]).summary([0; 3]);
        assert!(range[0].is_nan() && range[1].is_nan() && entropy == 0.0 && known == 0.0);
        let mut half = block([64, 1, 2], |_, _, z| z as f32);
        half.voxels[..64].fill(f32::NAN);
        assert_eq!(half.summary([0; 3]), ([1.0, 1.0], 0.0, 0.5));
        // The second brick is cut short.
        let two = block([66, 1, 1], |x, _, _| x as i16);
        assert_eq!(two.summary([1, 0, 0]), ([64.0, 65.0], 1.0, 1.0));
        // One voxel in a thousand differs.
        let rare = block([100, 10, 1], |x, y, _| u8::from(x + y == 0) * 200);
        let expected = -(0.001f64 * 0.001f64.log2() + 0.999 * 0.999f64.log2());
        assert!((summary_of(rare.voxels.chunks(100)).1 - expected).abs() < 1e-12);
    }
}
