//! What the window's frames take: for `octetra view --stats`.

use crate::gpu::FrameTime;
use serde::{Serialize, Serializer};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Ratio of the ends of a bin.
const BIN: f64 = 1.01;

/// The lower end of the first bin.
const LEAST: f64 = 1e-7;

/// How often a positive number occurred, however often that was: its median and the like to within a percent.
#[derive(Debug, Clone, Default)]
pub struct Spread {
    counts: Vec<u64>,
    largest: f64,
}

/// What is said of such a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Half are no larger.
    pub median: f64,
    /// 95 % are no larger.
    pub p95: f64,
    /// None is larger.
    pub max: f64,
}

impl Spread {
    /// Counts one.
    pub fn add(&mut self, value: f64) {
        let bin = ((value / LEAST).max(1.0).ln() / BIN.ln()) as usize;
        if self.counts.len() <= bin {
            self.counts.resize(bin + 1, 0);
        }
        self.counts[bin] += 1;
        self.largest = self.largest.max(value);
    }

    /// How many there were.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The figures, if there were any.
    pub fn figures(&self) -> Option<Figures> {
        let count = self.count();
        let below = |share: f64| {
            let rank = (share * count as f64).ceil().max(1.0) as u64;
            let mut seen = 0;
            let bin = self.counts.iter().position(|n| {
                seen += n;
                seen >= rank
            })?;
            Some((LEAST * BIN.powf(bin as f64 + 0.5)).min(self.largest))
        };
        Some(Figures { median: below(0.5)?, p95: below(0.95)?, max: self.largest })
    }
}

impl Serialize for Spread {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.figures().serialize(serializer)
    }
}

fn whole_numbers<S: Serializer>(spread: &Spread, serializer: S) -> Result<S::Ok, S::Error> {
    let rounded = |f: Figures| Figures { median: f.median.round(), p95: f.p95.round(), max: f.max };
    spread.figures().map(rounded).serialize(serializer)
}

/// A part of what the window does for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Keys and files that were dropped.
    Input,
    /// The widgets beside and under the picture.
    Panels,
    /// Taking what jobs have given and starting them.
    Jobs,
    /// The picture: the mouse on it, handing its march to the device, what lies over it.
    Picture,
    /// Panels over all.
    Sheets,
}

/// Seconds of the parts of a frame.
#[derive(Debug, Clone, Default, Serialize)]
struct Parts {
    input: Spread,
    panels: Spread,
    jobs: Spread,
    picture: Spread,
    sheets: Spread,
}

/// The window's own thread.
#[derive(Debug, Clone, Default, Serialize)]
struct Thread {
    /// How many frames were painted.
    frames: u64,
    /// Seconds of work for a frame until its shapes are known.
    work: Spread,
    /// Seconds of the same with cutting the shapes into triangles and handing them to the device, waiting for the display left out.
    whole: Spread,
    parts: Parts,
}

/// Pictures that were marched while the view or what is seen changed.
#[derive(Debug, Clone, Default, Serialize)]
struct Moving {
    pictures: u64,
    /// Seconds of one: by the GPU's timestamps, or by the clock where these cannot be trusted.
    picture: Spread,
    /// Seconds from one to the next.
    interval: Spread,
    /// What their width and height were divided by.
    #[serde(serialize_with = "whole_numbers")]
    divisor: Spread,
}

/// What paints the window, and draws the pictures unless it computes on the CPU.
#[derive(Debug, Clone, Serialize)]
struct Adapter {
    name: String,
    backend: String,
    driver: String,
}

/// What the frames of a window took, in seconds.
#[derive(Debug, Clone, Serialize)]
pub struct WindowStats {
    /// Seconds that the window was open.
    seconds: f64,
    /// Width and height of the picture's place in pixels, at last.
    size: [u32; 2],
    ui: Thread,
    moving: Moving,
    adapter: Adapter,
    #[serde(skip)]
    log: Log,
}

/// Those of a window that is open.
pub type SharedStats = Arc<Mutex<WindowStats>>;

/// Lends them.
pub fn lock(stats: &SharedStats) -> MutexGuard<'_, WindowStats> {
    stats.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is on its way.
#[derive(Debug, Clone)]
struct Log {
    opened: Instant,
    frame: Instant,
    part: Instant,
    /// The divisor of the picture that is marched, if it is one of a moving view.
    marched: Option<u32>,
    /// When the last such picture was done.
    moved: Option<Instant>,
}

/// Pictures further apart than this are not of one movement.
const PAUSE_S: f64 = 0.5;

impl WindowStats {
    /// Nothing yet, of a window on this adapter.
    pub fn new([name, backend, driver]: [String; 3]) -> Self {
        let now = Instant::now();
        let log = Log { opened: now, frame: now, part: now, marched: None, moved: None };
        let adapter = Adapter { name, backend, driver };
        WindowStats { seconds: 0.0, size: [0; 2], ui: Thread::default(), moving: Moving::default(), adapter, log }
    }

    /// A frame begins. `before_s` is what eframe says of the whole of the one before.
    pub fn begin(&mut self, before_s: Option<f32>) {
        if let Some(s) = before_s.filter(|_| self.ui.frames > 0) {
            self.ui.whole.add(s.into());
        }
        (self.log.frame, self.log.part) = (Instant::now(), Instant::now());
    }

    /// This part of it is done.
    pub fn did(&mut self, part: Part) {
        let parts = &mut self.ui.parts;
        let spread = match part {
            Part::Input => &mut parts.input,
            Part::Panels => &mut parts.panels,
            Part::Jobs => &mut parts.jobs,
            Part::Picture => &mut parts.picture,
            Part::Sheets => &mut parts.sheets,
        };
        let now = Instant::now();
        spread.add((now - self.log.part).as_secs_f64());
        self.log.part = now;
    }

    /// The frame is described.
    pub fn end(&mut self, size: [u32; 2]) {
        self.ui.frames += 1;
        self.ui.work.add(self.log.frame.elapsed().as_secs_f64());
        (self.seconds, self.size) = (self.log.opened.elapsed().as_secs_f64(), size);
    }

    /// A picture is handed to the device: of a moving view, with its width and height divided by this, or of one at rest.
    pub fn march(&mut self, divisor: Option<u32>) {
        self.log.marched = divisor;
    }

    /// It is done.
    pub fn marched(&mut self, time: FrameTime) {
        let Some(divisor) = self.log.marched.take() else { return };
        let now = Instant::now();
        self.moving.pictures += 1;
        self.moving.picture.add(time.gpu_s.unwrap_or(time.wall_s));
        self.moving.divisor.add(divisor.into());
        let interval_s = self.log.moved.map(|before| (now - before).as_secs_f64()).filter(|s| *s < PAUSE_S);
        interval_s.into_iter().for_each(|s| self.moving.interval.add(s));
        self.log.moved = Some(now);
    }

    /// Seconds of the window's own work for a frame.
    pub fn work(&self) -> Option<Figures> {
        self.ui.work.figures()
    }

    /// How many pictures of a moving view there were, and seconds of one.
    pub fn moving(&self) -> (u64, Option<Figures>) {
        (self.moving.pictures, self.moving.picture.figures())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_right_to_a_percent_and_the_largest_exactly() {
        assert_eq!(Spread::default().figures(), None);
        let mut spread = Spread::default();
        (1..=1000).rev().for_each(|ms| spread.add(f64::from(ms) * 1e-3));
        let Figures { median, p95, max } = spread.figures().expect("some");
        assert!((median / 0.5 - 1.0).abs() < 0.01 && (p95 / 0.95 - 1.0).abs() < 0.01 && max == 1.0, "{median} {p95} {max}");
        let mut one = Spread::default();
        one.add(0.0);
        assert_eq!(one.figures(), Some(Figures { median: 0.0, p95: 0.0, max: 0.0 }));
    }

    #[test]
    fn only_pictures_of_moving_views_count() {
        let mut stats = WindowStats::new(Default::default());
        let time = FrameTime { wall_s: 0.02, gpu_s: None };
        for divisor in [Some(4), None, Some(2)] {
            stats.march(divisor);
            stats.marched(time);
            stats.marched(time); // of nothing that was handed over
        }
        assert_eq!((stats.moving.pictures, stats.moving.divisor.figures().map(|f| f.max)), (2, Some(4.0)));
        assert_eq!((stats.moving.interval.count(), stats.moving.picture.figures().map(|f| f.max)), (1, Some(0.02)));
    }
}
