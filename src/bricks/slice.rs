//! The picture of a slice on the CPU: values at the pixels, read brick by brick within a budget of memory.

use super::sample::{Interpolation, brick_of};
use super::{BRICK_EDGE, Brick, BrickKey, BrickSource, SlicePlane};
use crate::progress::{Cancelled, Progress};
use crate::volume::GridFrame;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Pixels along the edge of what one thread draws at a time.
const TILE: u32 = 64;

/// Where the pixels of a slice lie, in index space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceFrame {
    /// The middle of the pixel at the left of the top row.
    pub first: DVec3,
    /// From a pixel to the one at its right.
    pub right: DVec3,
    /// From a pixel to the one below.
    pub down: DVec3,
    /// Pixels along both edges.
    pub size: [u32; 2],
}

impl SliceFrame {
    /// All of the slice across an axis, one pixel a voxel of a level. Across z it shows x to the right and y up, across y x and z, across x y and z.
    pub fn across(dims: [u32; 3], axis: usize, position: f64, level: u8) -> Self {
        let [u, v] = [[1, 2], [0, 2], [0, 1]][axis.min(2)];
        let pixel = f64::from(level).exp2();
        let size = [u, v].map(|axis| dims[axis].div_ceil(1 << level.min(31)));
        let mut first = DVec3::splat((pixel - 1.0) / 2.0);
        first[v] += pixel * (f64::from(size[1]) - 1.0);
        first[axis.min(2)] = position;
        SliceFrame { first, right: DVec3::AXES[u] * pixel, down: -DVec3::AXES[v] * pixel, size }
    }

    /// The part of any plane that lies in a volume, through a point and across a normal in the world: `longest` pixels along its longer edge,
    /// which are squares in the world. `up` is the direction that is up as nearly as it can be. `None` where the plane misses the volume or
    /// is none.
    pub fn oblique(frame: &GridFrame, point: DVec3, normal: DVec3, up: DVec3, longest: u32) -> Option<Self> {
        let plane = SlicePlane::new(point, normal)?;
        let up = [up, DVec3::Y, DVec3::X].into_iter().find_map(|up| up.reject_from_normalized(plane.normal).try_normalize())?;
        let right = up.cross(plane.normal);
        let corner = |i: usize| {
            let end = |axis: usize| if i >> axis & 1 == 1 { f64::from(frame.dims[axis]) - 0.5 } else { -0.5 };
            frame.origin + frame.steps * DVec3::new(end(0), end(1), end(2))
        };
        let edges = (0..8usize).flat_map(|i| (0..3).filter(move |axis| i >> axis & 1 == 0).map(move |axis| (i, i | 1 << axis)));
        let mut bounds: Option<[[f64; 2]; 2]> = None;
        for (a, b) in edges {
            let (a, b) = (corner(a), corner(b));
            let (da, db) = (plane.distance(a), plane.distance(b));
            if da * db > 0.0 {
                continue;
            }
            let p = if da == db { a } else { a + (b - a) * (da / (da - db)) } - plane.point;
            let at = [p.dot(right), p.dot(up)];
            let old = bounds.unwrap_or([[at[0]; 2], [at[1]; 2]]);
            bounds = Some([0, 1].map(|k| [old[k][0].min(at[k]), old[k][1].max(at[k])]));
        }
        let [[left, end], [bottom, top]] = bounds?;
        let extent = (end - left).max(top - bottom);
        if extent.is_nan() || extent <= 0.0 {
            return None;
        }
        let pixel = extent / f64::from(longest.max(1));
        let size = [end - left, top - bottom].map(|length| ((length / pixel).round() as u32).clamp(1, longest.max(1)));
        let first = plane.point + right * (left + pixel / 2.0) + up * (top - pixel / 2.0);
        let index = frame.steps.inverse();
        Some(SliceFrame { first: index * (first - frame.origin), right: index * right * pixel, down: index * -up * pixel, size })
    }

    /// The same slice with this many times the pixels along each edge.
    pub fn scaled(&self, factor: f64) -> Self {
        let size = self.size.map(|n| ((f64::from(n) * factor).round() as u32).max(1));
        let steps = [f64::from(self.size[0]) / f64::from(size[0]), f64::from(self.size[1]) / f64::from(size[1])];
        let corner = self.first - (self.right + self.down) / 2.0;
        let (right, down) = (self.right * steps[0], self.down * steps[1]);
        SliceFrame { first: corner + (right + down) / 2.0, right, down, size }
    }

    /// The plane it lies in.
    pub fn plane(&self) -> Option<SlicePlane> {
        SlicePlane::new(self.first, self.right.cross(self.down))
    }

    /// Where a pixel lies.
    pub fn at(&self, x: u32, y: u32) -> DVec3 {
        self.first + self.right * f64::from(x) + self.down * f64::from(y)
    }

    /// The level whose voxels are as large as the pixels, or the next finer one.
    pub fn level(&self, levels: u8) -> u8 {
        let pixel = self.right.length().min(self.down.length());
        (pixel.max(1.0).log2() + 1e-9).floor().min(f64::from(levels) - 1.0) as u8
    }
}

/// Values of a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Pixels along both edges.
    pub size: [u32; 2],
    /// The values, row by row from the top. NaN where there is none.
    pub values: Vec<f64>,
    /// Bricks that were read.
    pub bricks: usize,
}

/// Why a slice was not drawn.
#[derive(Debug, thiserror::Error)]
pub enum SliceError {
    /// A brick cannot be read.
    #[error("{0}")]
    Brick(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Slice {
    /// Draws a slice of a level. Bricks that were read are kept as long as the budget allows, at least those of the tiles at hand.
    pub fn draw(
        source: &dyn BrickSource,
        frame: &SliceFrame,
        level: u8,
        interpolation: Interpolation,
        budget_bytes: u64,
        progress: &Progress,
    ) -> Result<Slice, SliceError> {
        let pyramid = source.pyramid();
        let dims = [pyramid.dims(0), pyramid.dims(level)];
        let [width, height] = frame.size;
        let tiles: Vec<[u32; 2]> =
            (0..height.div_ceil(TILE)).flat_map(|y| (0..width.div_ceil(TILE)).map(move |x| [x * TILE, y * TILE])).collect();
        progress.begin("slicing", tiles.len() as u64);
        let shelf = Shelf::new(source, budget_bytes);
        let draw = |&[left, top]: &[u32; 2]| -> Result<Vec<f64>, SliceError> {
            progress.check()?;
            let mut at_hand: HashMap<BrickKey, Arc<Brick>> = HashMap::new();
            let most = (shelf.room / rayon::current_num_threads()).max(8);
            let mut failure = None;
            let mut values = Vec::new();
            for y in top..(top + TILE).min(height) {
                for x in left..(left + TILE).min(width) {
                    let mut last: Option<(BrickKey, Arc<Brick>)> = None;
                    let voxel = |voxel: [u32; 3]| {
                        let (key, number) = brick_of(level, voxel);
                        if last.as_ref().is_none_or(|(held, _)| *held != key) {
                            let brick = match at_hand.get(&key) {
                                Some(brick) => brick.clone(),
                                None => match shelf.get(key) {
                                    Ok(brick) => {
                                        if at_hand.len() >= most {
                                            at_hand.clear();
                                        }
                                        at_hand.entry(key).insert_entry(brick).get().clone()
                                    }
                                    Err(error) => {
                                        failure = Some(error);
                                        return None;
                                    }
                                },
                            };
                            last = Some((key, brick));
                        }
                        last.as_ref().map(|(_, brick)| brick.samples.get(number))
                    };
                    values.push(interpolation.sample(frame.at(x, y), level, dims, voxel).unwrap_or(f64::NAN));
                    if let Some(error) = failure.take() {
                        return Err(error.into());
                    }
                }
            }
            progress.add(1);
            Ok(values)
        };
        let drawn: Result<Vec<Vec<f64>>, SliceError> = tiles.par_iter().map(draw).collect();
        let mut values = vec![f64::NAN; width as usize * height as usize];
        for ([left, top], tile) in tiles.iter().zip(drawn?) {
            let columns = TILE.min(width - left) as usize;
            for (row, part) in tile.chunks_exact(columns).enumerate() {
                values[width as usize * (*top as usize + row) + *left as usize..][..columns].copy_from_slice(part);
            }
        }
        Ok(Slice { size: frame.size, values, bricks: shelf.read() })
    }
}

/// A brick that is read by whoever comes first, while others wait for it.
type Slot = Arc<OnceLock<Result<Arc<Brick>, (io::ErrorKind, String)>>>;

/// Bricks and when they were last asked for, on a clock that ticks with each question.
#[derive(Default)]
struct Kept {
    bricks: HashMap<BrickKey, (Slot, u64)>,
    clock: u64,
}

/// Bricks that were read, the oldest of which leave.
struct Shelf<'a> {
    source: &'a dyn BrickSource,
    room: usize,
    kept: Mutex<Kept>,
    read: AtomicUsize,
}

impl<'a> Shelf<'a> {
    fn new(source: &'a dyn BrickSource, budget_bytes: u64) -> Self {
        let brick = u64::from(BRICK_EDGE).pow(3) * source.voxel_bytes() as u64;
        let room = (budget_bytes / brick.max(1)).clamp(1, 1 << 32) as usize;
        Shelf { source, room, kept: Mutex::default(), read: Default::default() }
    }

    fn read(&self) -> usize {
        self.read.load(Relaxed)
    }

    fn get(&self, key: BrickKey) -> io::Result<Arc<Brick>> {
        let slot = {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            let Kept { bricks, clock } = &mut *kept;
            *clock += 1;
            if !bricks.contains_key(&key) && bricks.len() >= self.room {
                let oldest = bricks.iter().min_by_key(|(_, (_, used))| *used).map(|(key, _)| *key);
                oldest.map(|oldest| bricks.remove(&oldest));
            }
            let (slot, used) = bricks.entry(key).or_insert_with(|| (Slot::default(), 0));
            *used = *clock;
            slot.clone()
        };
        let read = slot.get_or_init(|| {
            self.read.fetch_add(1, Relaxed);
            self.source.load(key).map(Arc::new).map_err(|error| (error.kind(), error.to_string()))
        });
        read.clone().map_err(|(kind, what)| io::Error::new(kind, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bricks::{BrickStatistics, Pyramid};
    use crate::volume::Samples;

    /// A source whose voxels say where they are.
    #[derive(Debug)]
    struct Places(Pyramid, GridFrame);

    fn places(dims: [u32; 3]) -> Places {
        Places(Pyramid::new(dims), GridFrame::along_axes(dims, DVec3::ZERO, DVec3::ONE))
    }

    fn value(p: DVec3) -> f64 {
        p.x + 1000.0 * p.y + 1e6 * p.z
    }

    impl BrickSource for Places {
        fn pyramid(&self) -> &Pyramid {
            &self.0
        }
        fn frame(&self) -> &GridFrame {
            &self.1
        }
        fn name(&self) -> &str {
            "place"
        }
        fn range(&self) -> [f64; 2] {
            [0.0, 1e9]
        }
        fn voxel_bytes(&self) -> usize {
            8
        }
        fn statistics(&self, _: BrickKey) -> Option<BrickStatistics> {
            None
        }
        fn load(&self, key: BrickKey) -> io::Result<Brick> {
            if key.at == [9, 9, 9] {
                return Err(io::Error::other("damaged"));
            }
            let place = |i: usize| key.first() + DVec3::new((i % 64) as f64, (i / 64 % 64) as f64, (i / 4096) as f64) * key.voxel_size();
            Ok(Brick { samples: Samples::from((0..64usize.pow(3)).map(|i| value(place(i))).collect::<Vec<f64>>()) })
        }
    }

    #[test]
    fn a_slice_across_an_axis_has_the_voxels_themselves() {
        let source = places([130, 70, 90]);
        for (axis, position) in [(0, 64.0), (1, 3.0), (2, 89.0)] {
            for interpolation in [Interpolation::Nearest, Interpolation::Linear] {
                let frame = SliceFrame::across([130, 70, 90], axis, position, 0);
                // Room for one brick only.
                let slice = Slice::draw(&source, &frame, 0, interpolation, 1, &Progress::new()).expect("drawn");
                for y in 0..slice.size[1] {
                    for x in 0..slice.size[0] {
                        let mut at = DVec3::splat(position);
                        let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
                        (at[u], at[v]) = (f64::from(x), f64::from(slice.size[1] - 1 - y));
                        assert_eq!(slice.values[(x + slice.size[0] * y) as usize], value(at));
                    }
                }
            }
        }
    }

    #[test]
    fn an_oblique_slice_of_any_level_lies_where_it_should() {
        let dims = [128, 128, 128];
        let source = places(dims);
        let plane = SlicePlane::new(DVec3::new(60.0, 50.0, 40.0), DVec3::new(1.0, 2.0, -0.5)).expect("a plane");
        let frame = SliceFrame::oblique(source.frame(), plane.point, plane.normal, DVec3::Z, 200).expect("it meets the volume");
        assert_eq!(frame.size[0].max(frame.size[1]), 200);
        assert!((frame.plane().expect("a plane").normal.dot(plane.normal).abs() - 1.0).abs() < 1e-12);
        assert!(plane.distance(frame.at(17, 80)).abs() < 1e-9 && frame.down.z < 0.0);
        let enough = 1 << 30;
        let fine = Slice::draw(&source, &frame, 0, Interpolation::Linear, enough, &Progress::new()).expect("drawn");
        let coarse = Slice::draw(&source, &frame, 1, Interpolation::Linear, enough, &Progress::new()).expect("drawn");
        assert_eq!((fine.bricks, coarse.bricks), (source.pyramid().cut(&plane, 0).len(), 1));
        let mut inside = 0;
        for y in 0..frame.size[1] {
            for x in 0..frame.size[0] {
                let (at, i) = (frame.at(x, y), (x + frame.size[0] * y) as usize);
                let is_inside = at.min_element() >= 1.0 && at.max_element() <= 126.0;
                inside += usize::from(is_inside);
                if is_inside {
                    assert!((fine.values[i] - value(at)).abs() < 1e-3 && (coarse.values[i] - value(at)).abs() < 1e-3);
                }
                assert_eq!(fine.values[i].is_nan(), (0..3).any(|axis| !(-0.5..127.5).contains(&at[axis])));
            }
        }
        assert!(inside > 10_000, "{inside}");
        let beside = |normal| SliceFrame::oblique(source.frame(), DVec3::splat(500.0), normal, DVec3::Z, 200);
        assert_eq!([beside(DVec3::X), beside(DVec3::ZERO)], [None, None]);
        // Pixels are squares in the world, whatever voxels are.
        let flat = GridFrame::along_axes([100, 100, 100], DVec3::new(5.0, 0.0, 0.0), DVec3::new(1.0, 2.0, -8.0));
        let frame =
            SliceFrame::oblique(&flat, DVec3::new(50.0, 100.0, -400.0), DVec3::new(1.0, 1.0, 0.3), DVec3::Z, 100).expect("meets it");
        let [right, down] = [flat.steps * frame.right, flat.steps * frame.down];
        assert!((right.length() - down.length()).abs() < 1e-9 && right.dot(down).abs() < 1e-9 && down.z < 0.0);
        assert!(
            (flat.origin + flat.steps * frame.at(30, 40) - DVec3::new(50.0, 100.0, -400.0)).dot(DVec3::new(1.0, 1.0, 0.3)).abs() < 1e-9
        );
    }

    #[test]
    fn pixels_choose_the_level_and_errors_come_through() {
        let frame = SliceFrame::across([640; 3], 2, 600.0, 0);
        assert_eq!(frame.level(5), 0);
        assert_eq!((frame.scaled(0.25).size, frame.scaled(0.25).level(5), frame.scaled(0.01).level(4)), ([160, 160], 2, 3));
        assert_eq!(frame.scaled(0.25).at(0, 0), DVec3::new(1.5, 637.5, 600.0));
        assert_eq!(SliceFrame::across([640; 3], 2, 600.0, 2).at(0, 0), DVec3::new(1.5, 637.5, 600.0));
        let drawn = Slice::draw(&places([640; 3]), &frame, 0, Interpolation::Nearest, 1 << 30, &Progress::new());
        assert_eq!(drawn.expect_err("a damaged brick").to_string(), "damaged");
        let progress = Progress::new();
        progress.cancel();
        let drawn = Slice::draw(&places([640; 3]), &frame, 0, Interpolation::Nearest, 1 << 30, &progress);
        assert!(matches!(drawn, Err(SliceError::Cancelled(_))));
    }
}
