//! Motions made up: the same seed gives the same frames.

use super::{SliceSet, Trace};
use crate::bricks::{BRICK_EDGE, SlicePlane};
use glam::DVec3;

/// Numbers that look random and are the same everywhere: SplitMix64 (Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * f64::exp2(-53.0)
    }

    /// A whole number below `n`, which is at least 1.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
}

/// How the slices of a synthetic trace move. There is one across each axis and, but for [`Motion::Paper`] and [`Motion::PaperJumps`], an
/// oblique one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// The paper's: three slices across the axes, 30 moves along each, in random order. Each move drags a slice to a random place, half a
    /// brick a frame.
    Paper,
    /// The same moves without the way there: a frame a move.
    PaperJumps,
    /// By hand: now one slice, now another is dragged to a random place, gently, and rests a while.
    Scrub,
    /// The same at one voxel a frame.
    VoxelScrub,
    /// One slice sweeps to and fro, a third of a brick a frame.
    PingPong,
    /// One slice runs from end to end, half a brick a frame, and starts again.
    Loop,
    /// Every 12th frame a slice is somewhere else.
    Jump,
    /// As `Jump`, but two of three times to one of five places that were marked.
    Bookmarks,
    /// The oblique slice is dragged along its normal and turned; the others rest.
    Oblique,
}

impl Motion {
    /// All of them but the paper's, with what they are called.
    pub const ALL: [(&str, Motion); 6] = [
        ("scrub", Motion::Scrub),
        ("ping-pong", Motion::PingPong),
        ("loop", Motion::Loop),
        ("jump", Motion::Jump),
        ("bookmarks", Motion::Bookmarks),
        ("oblique", Motion::Oblique),
    ];

    /// A trace of so many frames ([`Motion::Paper`] and [`Motion::PaperJumps`] have as many as they take).
    pub fn trace(self, dims: [u32; 3], frames: usize, seed: u64) -> Trace {
        let size = DVec3::from(dims.map(|n| f64::from(n.max(2) - 1)));
        let mut stage =
            Stage { size, random: Random::new(seed), at: [0.47; 4], turn: 0.0, moving: None, frames: Vec::new(), oblique: true };
        let name = match self {
            Motion::Paper => "paper",
            Motion::PaperJumps => "paper, jumps",
            Motion::Scrub => "scrub",
            Motion::VoxelScrub => "scrub by voxels",
            Motion::PingPong => "ping-pong",
            Motion::Loop => "loop",
            Motion::Jump => "jump",
            Motion::Bookmarks => "bookmarks",
            Motion::Oblique => "oblique",
        };
        match self {
            Motion::Paper => stage.paper(true),
            Motion::PaperJumps => stage.paper(false),
            Motion::Scrub => stage.scrub(frames, 3.0),
            // At the fastest.
            Motion::VoxelScrub => stage.scrub(frames, 1.5 * f64::from(BRICK_EDGE)),
            Motion::PingPong => stage.sweep(frames, |t| 1.0 - (t % 2.0 - 1.0).abs(), 1.0 / 3.0),
            Motion::Loop => stage.sweep(frames, f64::fract, 0.5),
            Motion::Jump => stage.jump(frames, 0),
            Motion::Bookmarks => stage.jump(frames, 5),
            Motion::Oblique => stage.turn(frames),
        }
        if !matches!(self, Motion::Paper | Motion::PaperJumps) {
            stage.frames.truncate(frames);
        }
        Trace { name: name.to_owned(), dims, frames: stage.frames }
    }
}

/// The slices while a trace is made.
struct Stage {
    size: DVec3,
    random: Random,
    /// Where each slice is, as a share of its way through the volume.
    at: [f64; 4],
    /// How far the oblique slice is turned, radians.
    turn: f64,
    moving: Option<usize>,
    frames: Vec<SliceSet>,
    oblique: bool,
}

impl Stage {
    /// Writes a frame down.
    fn frame(&mut self) {
        let mut planes: Vec<SlicePlane> = (0..3).map(|axis| SlicePlane::across(axis, self.at[axis] * self.size[axis])).collect();
        if self.oblique {
            planes.extend(SlicePlane::new(self.size * self.at[3], self.oblique_normal()));
        }
        self.frames.push(SliceSet { planes, moving: self.moving });
    }

    fn oblique_normal(&self) -> DVec3 {
        let (sin, cos) = self.turn.sin_cos();
        DVec3::new(0.8 * cos, 0.8 * sin, 0.6)
    }

    /// Bricks along the way of a slice.
    fn bricks(&self, slice: usize) -> f64 {
        let way = if slice < 3 { self.size[slice] } else { self.size.dot(self.oblique_normal().abs()) };
        (way / f64::from(BRICK_EDGE)).max(1.0)
    }

    fn paper(&mut self, drag: bool) {
        self.oblique = false;
        let mut moves: Vec<usize> = (0..90).map(|i| i % 3).collect();
        for i in (1..moves.len()).rev() {
            let j = self.random.below(i + 1);
            moves.swap(i, j);
        }
        self.frame();
        for slice in moves {
            self.moving = Some(slice);
            let (from, to) = (self.at[slice], self.random.unit());
            let steps = if drag { ((to - from).abs() * self.bricks(slice) / 0.5).ceil().max(1.0) } else { 1.0 };
            for k in 1..=steps as usize {
                self.at[slice] = from + (to - from) * k as f64 / steps;
                self.frame();
            }
        }
    }

    /// `slowness`: frames a brick on average; in the middle of a move it is half as fast again.
    fn scrub(&mut self, frames: usize, slowness: f64) {
        while self.frames.len() < frames {
            let slice = self.random.below(4);
            let (from, to) = (self.at[slice], self.random.unit());
            let steps = ((to - from).abs() * self.bricks(slice) * slowness).ceil().max(4.0);
            self.moving = Some(slice);
            for k in 1..=steps as usize {
                let t = k as f64 / steps;
                self.at[slice] = from + (to - from) * t * t * (3.0 - 2.0 * t);
                self.frame();
            }
            self.moving = None;
            for _ in 0..3 + self.random.below(10) {
                self.frame();
            }
        }
    }

    /// Slice 0 goes where `place` says, by the number of ways through the volume that it has run; `speed` in bricks a frame.
    fn sweep(&mut self, frames: usize, place: impl Fn(f64) -> f64, speed: f64) {
        self.moving = Some(0);
        let step = speed / self.bricks(0);
        for k in 0..frames {
            self.at[0] = place(k as f64 * step);
            self.frame();
        }
    }

    fn jump(&mut self, frames: usize, marks: usize) {
        let marks: Vec<[f64; 4]> = (0..marks).map(|_| std::array::from_fn(|_| self.random.unit())).collect();
        for k in 0..frames {
            self.moving = None;
            if k % 12 == 0 {
                let slice = self.random.below(4);
                self.moving = Some(slice);
                let place = self.random.unit();
                let marked = self.random.below(3) > 0 && !marks.is_empty();
                self.at[slice] = if marked { marks[self.random.below(marks.len())][slice] } else { place };
            }
            self.frame();
        }
    }

    fn turn(&mut self, frames: usize) {
        self.moving = Some(3);
        while self.frames.len() < frames {
            let (from, to) = ((self.at[3], self.turn), (self.random.unit(), std::f64::consts::PI * self.random.unit()));
            let turns = self.random.below(2) == 0;
            let way = if turns { (to.1 - from.1).abs() / 0.02 } else { (to.0 - from.0).abs() * self.bricks(3) * 3.0 };
            for k in 1..=way.ceil() as usize {
                let t = k as f64 / way.ceil();
                match turns {
                    true => self.turn = from.1 + (to.1 - from.1) * t,
                    false => self.at[3] = from.0 + (to.0 - from.0) * t,
                }
                self.frame();
            }
        }
    }
}
