//! How a slice has moved, and what that says of where it will be: [`Course`].

use crate::bricks::{BRICK_EDGE, Pyramid, SlicePlane};
use glam::DVec3;
use std::collections::VecDeque;

/// The way of one slice so far.
#[derive(Debug, Clone)]
pub struct Course {
    plane: SlicePlane,
    size: DVec3,
    /// Positions along the normal, bricks, since the normal last changed; the newest last.
    places: Vec<f64>,
    /// Bricks dragged in a frame, in the long run.
    mobility: f64,
    /// Jumps in a frame, in the long run.
    jumps: f64,
    /// Where jumps ended, sorted, and the same in their order.
    marks: Vec<f64>,
    recent: VecDeque<f64>,
    /// Bricks moved and frames with a move until each of the places.
    sums: Vec<(f64, u32)>,
    /// After how many frames it repeats itself, if it does.
    period: Option<usize>,
    /// If it does: frames until it is next at a place, by eighths of a brick from the place that its bin 0 stands for.
    visits: Vec<u32>,
    bin0: f64,
    /// Its way through the volume, bricks.
    way: f64,
    /// How far bricks reach along the normal, in edges of a brick.
    reach: f64,
}

/// Mobility before anything has moved, bricks a frame: as long as nothing is known, the distance decides.
const PRIOR_MOBILITY: f64 = 0.02;

/// Frames over which mobility and jumps are averaged.
const RUN: [f64; 2] = [100.0, 200.0];

/// A brick that a slice touches is as far away as this, bricks.
const NEAR: f64 = 0.5;

/// Ends of jumps that are supposed to lie anywhere, beside those that were seen.
const PRIOR_MARKS: f64 = 4.0;

/// How much what is expected without a period counts where there is one.
const DOUBT: f64 = 1e-3;

/// How far a place may be from the one a period ago, bricks.
const SLACK: f64 = 0.125;

/// Width of a bin of places, bricks.
const BIN: f64 = 0.125;

/// Bins at most: a slice that goes farther than any volume reaches is not foreseen.
const MOST_BINS: f64 = 4e6;

/// Places that are remembered, at least.
const MEMORY: usize = 4096;

/// Ends of jumps that are remembered.
const MARKS: usize = 256;

/// A slice that moves farther in a frame, in bricks, has jumped.
const JUMP: f64 = 1.5;

impl Course {
    /// A slice that has not moved yet.
    pub fn new(pyramid: &Pyramid, plane: SlicePlane) -> Self {
        let mut course = Course {
            plane,
            size: DVec3::from(pyramid.dims(0).map(f64::from)),
            places: Vec::new(),
            sums: Vec::new(),
            visits: Vec::new(),
            bin0: 0.0,
            mobility: PRIOR_MOBILITY,
            jumps: 0.0,
            marks: Vec::new(),
            recent: VecDeque::new(),
            period: None,
            way: 1.0,
            reach: 0.0,
        };
        course.start();
        course
    }

    /// Where it is.
    pub fn plane(&self) -> &SlicePlane {
        &self.plane
    }

    fn start(&mut self) {
        self.reach = (1.0 + 1.0 / f64::from(BRICK_EDGE)) / 2.0 * self.plane.normal.abs().element_sum();
        self.way = (self.size.dot(self.plane.normal.abs()) / f64::from(BRICK_EDGE)).max(1.0);
        self.places.clear();
        self.places.push(self.plane.point.dot(self.plane.normal) / f64::from(BRICK_EDGE));
        self.sums.clear();
        self.sums.push((0.0, 0));
        self.period = None;
    }

    /// The next frame.
    pub fn follow(&mut self, plane: SlicePlane) {
        let old = std::mem::replace(&mut self.plane, plane);
        let turned = old.normal.dot(plane.normal) < 1.0 - 1e-9;
        let step = if turned {
            // The mean of how far its parts have moved, by eight points around the middle of the volume.
            let moved = |i: usize| {
                let corner = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 0.5 + 0.25;
                (plane.distance(corner * self.size) - old.distance(corner * self.size)).abs()
            };
            (0..8).map(moved).sum::<f64>() / 8.0 / f64::from(BRICK_EDGE)
        } else {
            old.distance(plane.point) / f64::from(BRICK_EDGE)
        };
        let jumped = step.abs() > JUMP && !turned;
        let dragged = if jumped { 0.0 } else { step.abs().min(self.way) };
        self.mobility += (dragged - self.mobility) / RUN[0];
        self.jumps += (f64::from(u8::from(jumped)) - self.jumps) / RUN[1];
        if turned {
            self.marks.clear();
            self.recent.clear();
            self.start();
            return;
        }
        if self.places.len() >= 2 * MEMORY {
            self.places.drain(..MEMORY);
            self.sums.drain(..MEMORY);
        }
        let place = self.plane.point.dot(self.plane.normal) / f64::from(BRICK_EDGE);
        let (way, moves) = self.sums[self.sums.len() - 1];
        self.places.push(place);
        self.sums.push((way + step.abs(), moves + u32::from(step != 0.0)));
        if jumped {
            if self.recent.len() == MARKS
                && let Some(old) = self.recent.pop_front()
            {
                self.marks.remove(self.marks.partition_point(|&mark| mark < old).min(self.marks.len() - 1));
            }
            self.recent.push_back(place);
            self.marks.insert(self.marks.partition_point(|&mark| mark < place), place);
        }
        self.find_period(step != 0.0);
        if let Some(lag) = self.period {
            self.foresee(lag);
        }
    }

    /// Looks whether the last frames are what they were some frames before: at least a quarter of that, with a way of a brick or more.
    fn find_period(&mut self, moves: bool) {
        let last = self.places.len() - 1;
        let matches = |lag: usize, back: usize, slack: f64| (self.places[last - back] - self.places[last - back - lag]).abs() <= slack;
        if let Some(lag) = self.period {
            // The memory may just have been cut.
            if last < lag || !matches(lag, 0, SLACK) {
                self.period = None;
            }
            return;
        }
        if !moves {
            return;
        }
        self.period = (2..=last).find(|&lag| {
            let window = (lag / 4).max(8);
            if last <= lag + window || !matches(lag, 0, SLACK) {
                return false;
            }
            let way = self.sums[last].0 - self.sums[last - window].0;
            let moved = self.sums[last].1 - self.sums[last - window].1;
            // Slower motion must match better, or every slow one would repeat itself at once.
            let slack = (way / window as f64 / 2.0).min(SLACK);
            way >= 1.0 && moved >= 4 && (0..=window).all(|back| matches(lag, back, slack))
        });
    }

    /// Writes down when the slice will next be where, if it goes on as it did a period ago.
    fn foresee(&mut self, lag: usize) {
        let cycle = &self.places[self.places.len() - lag..];
        let (low, high) = cycle.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        let bins = (high - low) / BIN;
        self.visits.clear();
        // Not so for places that are no numbers either.
        if !(0.0..MOST_BINS).contains(&bins) {
            self.period = None;
            return;
        }
        self.bin0 = low;
        self.visits.resize(bins as usize + 1, u32::MAX);
        for (place, k) in cycle.iter().zip(1..) {
            let bin = &mut self.visits[((place - low) / BIN) as usize];
            *bin = k.min(*bin);
        }
    }

    /// How often the slice is expected to meet a brick, times a frame, and whether it cuts it now. The brick's middle lies `offset` bricks of
    /// level 0 along the normal, and its edge is `size` of them long.
    pub fn rate(&self, offset: f64, size: f64) -> (f32, bool) {
        let reach = self.reach * size;
        let way = offset.abs() - reach;
        let mut rate = self.chance(offset, way, reach);
        if self.period.is_some() {
            let target = self.places[self.places.len() - 1] + offset - self.bin0;
            let bins =
                ((target - reach) / BIN).ceil().max(0.0) as usize..(((target + reach) / BIN).max(0.0) as usize).min(self.visits.len());
            let soonest = self.visits.get(bins).and_then(|bins| bins.iter().min()).filter(|&&k| k < u32::MAX);
            rate = DOUBT * rate + soonest.map_or(0.0, |&k| 1.0 / f64::from(k));
        }
        (rate as f32, way < 0.0)
    }

    /// The same where nothing repeats itself.
    fn chance(&self, offset: f64, way: f64, reach: f64) -> f64 {
        let dragged = self.mobility / (way.max(0.0) + NEAR);
        if self.marks.is_empty() {
            return dragged;
        }
        let target = self.places[self.places.len() - 1] + offset;
        let marked = self.marks.partition_point(|&mark| mark < target + reach) - self.marks.partition_point(|&mark| mark < target - reach);
        let anywhere = 2.0 * reach / self.way;
        let hit = (marked as f64 + PRIOR_MARKS * anywhere) / (self.marks.len() as f64 + PRIOR_MARKS);
        dragged + self.jumps * hit
    }
}
