//! The bricks of a volume that is in memory: [`GridBricks`].

use super::{BRICK_EDGE, Brick, BrickKey, BrickSource, BrickStatistics, Pyramid};
use crate::volume::{Grid, GridFrame, Samples};

/// A regular volume as a source of bricks, all its levels in memory as f32. For volumes that are small: others belong into a store.
#[derive(Debug, Clone)]
pub struct GridBricks {
    frame: GridFrame,
    name: String,
    range: [f64; 2],
    pyramid: Pyramid,
    /// The voxels of each level, x fastest. NaN means missing.
    levels: Vec<Vec<f32>>,
    /// Of each level's bricks, x fastest.
    statistics: Vec<Vec<BrickStatistics>>,
}

impl GridBricks {
    /// Works out all levels. Values that are not finite are missing.
    pub fn new(grid: &Grid) -> Self {
        let pyramid = Pyramid::new(grid.frame().dims);
        let finite = |v: f64| if v.is_finite() { v as f32 } else { f32::NAN };
        let mut levels = vec![(0..grid.samples().len()).map(|i| finite(grid.samples().get(i))).collect::<Vec<f32>>()];
        let known = |v: f32| if v.is_nan() { (0.0, 0) } else { (f64::from(v), 1u32) };
        let mut sums: Vec<(f64, u32)> = levels[0].iter().map(|&v| known(v)).collect();
        for level in 1..pyramid.levels() {
            let (fine, coarse) = (pyramid.dims(level - 1).map(|n| n as usize), pyramid.dims(level).map(|n| n as usize));
            let mut halved = vec![(0.0, 0); coarse.iter().product()];
            for (i, &(sum, count)) in sums.iter().enumerate() {
                let (x, y, z) = (i % fine[0], i / fine[0] % fine[1], i / fine[0] / fine[1]);
                let to: &mut (f64, u32) = &mut halved[(z / 2 * coarse[1] + y / 2) * coarse[0] + x / 2];
                *to = (to.0 + sum, to.1 + count);
            }
            levels.push(halved.iter().map(|&(sum, count)| if count == 0 { f32::NAN } else { (sum / f64::from(count)) as f32 }).collect());
            sums = halved;
        }
        let mut bricks =
            GridBricks { frame: *grid.frame(), name: grid.name().to_owned(), range: grid.range(), pyramid, levels, statistics: Vec::new() };
        for level in 0..pyramid.levels() {
            let found = pyramid.keys(level).map(|key| bricks.measure(key)).collect();
            bricks.statistics.push(found);
        }
        bricks
    }

    /// The known voxels of a brick, those beyond the end of the volume left out.
    fn known(&self, key: BrickKey) -> impl Iterator<Item = f64> {
        let [nx, ny, _] = self.pyramid.dims(key.level).map(|n| n as usize);
        let [x, y, z] = self.pyramid.voxels(key).map(|range| range.start as usize..range.end as usize);
        let voxels = &self.levels[usize::from(key.level)];
        let rows = z.flat_map(move |z| y.clone().map(move |y| (z * ny + y) * nx));
        rows.flat_map(move |row| &voxels[row + x.start..row + x.end]).filter(|v| !v.is_nan()).map(|&v| f64::from(v))
    }

    /// The share of the voxels of level 0 beneath a brick that are known.
    fn known_beneath(&self, key: BrickKey) -> f32 {
        let [nx, ny, _] = self.pyramid.dims(0).map(|n| n as usize);
        let [x, y, z] = self.pyramid.beneath(key).map(|range| range.start as usize..range.end as usize);
        let all = x.len() * y.len() * z.len();
        let rows = z.flat_map(|z| y.clone().map(move |y| (z * ny + y) * nx));
        let known = rows.flat_map(|row| &self.levels[0][row + x.start..row + x.end]).filter(|v| !v.is_nan()).count();
        known as f32 / all as f32
    }

    fn measure(&self, key: BrickKey) -> BrickStatistics {
        let span = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        let nothing = [f64::NAN; 2];
        let own = self.known(key).fold(nothing, span);
        // Of the children, as they lie in level 0.
        let range = match key.level {
            0 => own,
            _ => self
                .pyramid
                .children(key)
                .filter_map(|child| self.statistics(child))
                .fold(nothing, |r, s| span(span(r, s.range[0]), s.range[1])),
        };
        let mut bins = [0u32; 256];
        let scale = if own[1] > own[0] { 256.0 / (own[1] - own[0]) } else { 0.0 };
        self.known(key).for_each(|v| bins[(((v - own[0]) * scale) as usize).min(255)] += 1);
        let all = f64::from(bins.iter().sum::<u32>());
        let entropy: f64 = bins.iter().filter(|&&n| n > 0).map(|&n| f64::from(n) / all).map(|p| -p * p.log2()).sum();
        BrickStatistics { range, entropy: entropy as f32, known: self.known_beneath(key) }
    }
}

impl BrickSource for GridBricks {
    fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    fn frame(&self) -> &GridFrame {
        &self.frame
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn range(&self) -> [f64; 2] {
        self.range
    }

    fn voxel_bytes(&self) -> usize {
        size_of::<f32>()
    }

    fn statistics(&self, key: BrickKey) -> Option<BrickStatistics> {
        let [nx, ny, _] = self.pyramid.bricks(key.level).map(|n| n as usize);
        let [x, y, z] = key.at.map(|at| at as usize);
        let level = self.statistics.get(usize::from(key.level)).filter(|_| self.pyramid.has(key))?;
        level.get((z * ny + y) * nx + x).copied()
    }

    fn load(&self, key: BrickKey) -> std::io::Result<Brick> {
        if !self.pyramid.has(key) {
            return Err(std::io::Error::other(format!("{} has no brick {key:?}", self.name)));
        }
        let dims = self.pyramid.dims(key.level);
        let voxels = &self.levels[usize::from(key.level)];
        let place = |axis: usize, i: u32| (key.at[axis] * BRICK_EDGE + i).min(dims[axis] - 1) as usize;
        let mut samples = Vec::with_capacity((BRICK_EDGE as usize).pow(3));
        for z in 0..BRICK_EDGE {
            for y in 0..BRICK_EDGE {
                let row = (place(2, z) * dims[1] as usize + place(1, y)) * dims[0] as usize;
                samples.extend((0..BRICK_EDGE).map(|x| voxels[row + place(0, x)]));
            }
        }
        Ok(Brick { samples: Samples::F32(samples.into()) })
    }
}
