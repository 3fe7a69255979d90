//! How a slice has moved, and what that says of where it will be: [`Course`].

use crate::bricks::{BRICK_EDGE, Pyramid, SlicePlane};
use glam::DVec3;

/// The way of one slice so far.
#[derive(Debug, Clone)]
pub struct Course {
    plane: SlicePlane,
    size: DVec3,
    /// Positions along the normal, bricks, since the normal last changed; the newest last.
    places: Vec<f64>,
    /// Bricks moved in a frame, in the long run.
    pub mobility: f64,
    /// Direction of the last move.
    heading: f64,
    /// After how many frames it repeats itself, if it does.
    period: Option<usize>,
    /// How far bricks reach along the normal, in edges of a brick.
    reach: f64,
}

/// Places that are remembered.
const MEMORY: usize = 4096;

fn param(i: usize, default: f64) -> f64 {
    use std::sync::OnceLock;
    static P: OnceLock<Vec<f64>> = OnceLock::new();
    P.get_or_init(|| std::env::var("P").map(|s| s.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect()).unwrap_or_default())
        .get(i)
        .copied()
        .filter(|x| !x.is_nan())
        .unwrap_or(default)
}

impl Course {
    /// A slice that has not moved yet.
    pub fn new(pyramid: &Pyramid, plane: SlicePlane) -> Self {
        let mut course = Course {
            plane,
            size: DVec3::from(pyramid.dims(0).map(f64::from)),
            places: Vec::new(),
            mobility: param(0, 0.02),
            heading: 0.0,
            period: None,
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
        self.places.clear();
        self.places.push(self.plane.point.dot(self.plane.normal) / f64::from(BRICK_EDGE));
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
        self.mobility += (step.abs().min(param(1, 1.0)) - self.mobility) / param(2, 100.0);
        if turned {
            self.start();
            self.heading = 0.0;
            return;
        }
        if step != 0.0 {
            self.heading = step.signum();
        }
        if self.places.len() >= 2 * MEMORY {
            self.places.drain(..MEMORY);
        }
        self.places.push(self.places[self.places.len() - 1] + step);
        self.find_period(step != 0.0);
    }

    fn find_period(&mut self, moves: bool) {
        let last = self.places.len() - 1;
        let matches = |lag: usize, back: usize, slack: f64| {
            last >= back + lag && (self.places[last - back] - self.places[last - back - lag]).abs() <= slack
        };
        if let Some(lag) = self.period {
            if !matches(lag, 0, 0.125) {
                self.period = None;
            }
            return;
        }
        if !moves {
            return;
        }
        self.period = (2..=last).find(|&lag| {
            if !matches(lag, 0, 0.125) {
                return false;
            }
            let window = (lag / 4).max(8);
            if last < lag + window {
                return false;
            }
            let way: f64 = (0..window).map(|back| (self.places[last - back] - self.places[last - back - 1]).abs()).sum();
            let slack = (way / window as f64 / 2.0).min(0.125);
            way >= 1.0 && (0..=window).all(|back| matches(lag, back, slack))
        });
    }

    /// How often the slice is expected to meet a brick, times a frame, and whether it cuts it now. The brick's middle lies `offset` bricks of
    /// level 0 along the normal, and its edge is `size` of them long.
    pub fn rate(&self, offset: f64, size: f64) -> (f32, bool) {
        let reach = self.reach * size;
        let way = offset.abs() - reach;
        if let Some(lag) = self.period {
            let last = self.places.len() - 1;
            let here = self.places[last];
            let target = here + offset;
            let first = (1..=lag).find(|k| (self.places[last + k - lag] - target).abs() < reach);
            return (first.map_or(0.0, |k| 1.0 / k as f32), way < 0.0);
        }
        let behind = if offset * self.heading < 0.0 { param(3, 1.0) } else { 1.0 };
        let far = way.max(0.0) * behind + param(4, 0.5);
        ((self.mobility / far.powf(param(5, 1.0))) as f32, way < 0.0)
    }
}
