//! A slice that moves by itself.

use std::time::Instant;

/// Steps of a slice that are made up for at once when a frame takes long.
const MOST: f64 = 8.0;

/// What comes after the last position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// The first one.
    Loop,
    /// The way back.
    BackAndForth,
}

/// How slices play, and whether one does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    /// The slice that plays, by its number.
    pub playing: Option<usize>,
    /// What comes after the last position.
    pub turn: Turn,
    /// Positions a second.
    pub per_second: f64,
    forward: f64,
    part: f64,
    last: Option<Instant>,
}

impl Default for Play {
    fn default() -> Self {
        Play { playing: None, turn: Turn::BackAndForth, per_second: 30.0, forward: 1.0, part: 0.0, last: None }
    }
}

impl Play {
    /// Starts or stops a slice.
    pub fn flip(&mut self, cut: usize) {
        self.playing = if self.playing == Some(cut) { None } else { Some(cut) };
        (self.part, self.last) = (0.0, None);
    }

    /// Where a slice is now that was at a position between these two.
    pub fn advance(&mut self, now: Instant, position: f64, range: [f64; 2]) -> f64 {
        let seconds = self.last.map_or(0.0, |last| now.saturating_duration_since(last).as_secs_f64());
        self.last = Some(now);
        self.stepped(seconds, position, range)
    }

    fn stepped(&mut self, seconds: f64, position: f64, [low, high]: [f64; 2]) -> f64 {
        self.part = (self.part + seconds * self.per_second).min(MOST);
        let steps = self.part.floor();
        self.part -= steps;
        let (length, mut at) = (high - low, position - low);
        if length <= 0.0 {
            return low;
        }
        match self.turn {
            Turn::Loop => {
                self.forward = 1.0;
                at += steps;
                if at > length {
                    at = (at - length - 1.0).max(0.0);
                }
            }
            Turn::BackAndForth => {
                at += steps * self.forward;
                if at > length {
                    (at, self.forward) = ((2.0 * length - at).max(0.0), -1.0);
                } else if at < 0.0 {
                    (at, self.forward) = ((-at).min(length), 1.0);
                }
            }
        }
        low + at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_turn_back_or_begin_anew() {
        let run = |turn| {
            let mut play = Play { turn, per_second: 10.0, ..Play::default() };
            let mut at = 6.0;
            let mut step = || {
                at = play.stepped(0.2, at, [0.0, 9.0]);
                at
            };
            [step(), step(), step(), step()]
        };
        assert_eq!(run(Turn::BackAndForth), [8.0, 8.0, 6.0, 4.0]);
        assert_eq!(run(Turn::Loop), [8.0, 0.0, 2.0, 4.0]);
        let mut play = Play { per_second: 10.0, ..Play::default() };
        assert_eq!([play.stepped(0.06, 3.0, [0.0, 9.0]), play.stepped(0.06, 3.0, [0.0, 9.0])], [3.0, 4.0], "parts add up");
        assert_eq!(play.stepped(100.0, 0.0, [0.0, 100.0]), 8.0, "no leaps after a pause");
    }
}
