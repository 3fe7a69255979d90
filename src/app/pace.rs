//! How fine the picture is marched while the view moves: as fine as the device manages in a moment, in full at rest.

/// Seconds that a frame may take while the view moves.
const MOVING_S: f64 = 0.033;

/// What the time of the frames so far says about the next.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    s_per_pixel: Option<f64>,
}

impl Pace {
    /// Divisors of the picture's width and height.
    const DIVISORS: [u32; 7] = [1, 2, 3, 4, 6, 8, 12];

    /// Takes the time of a frame of this size into account.
    pub fn add(&mut self, size: [u32; 2], frame_s: f64) {
        self.s_per_pixel = Some(frame_s / pixels(size));
    }

    /// What to divide width and height by while the view moves. Before the first frame a device that is `slow`, a CPU, begins coarse.
    pub fn moving_divisor(&self, size: [u32; 2], slow: bool) -> u32 {
        let Some(s_per_pixel) = self.s_per_pixel else { return if slow { 4 } else { 1 } };
        let fits = |&divisor: &u32| s_per_pixel * pixels(divided(size, divisor)) <= MOVING_S;
        Self::DIVISORS.into_iter().find(fits).unwrap_or(Self::DIVISORS[Self::DIVISORS.len() - 1])
    }
}

/// Width and height divided, rounded up.
pub fn divided(size: [u32; 2], divisor: u32) -> [u32; 2] {
    size.map(|n| n.div_ceil(divisor).max(1))
}

fn pixels(size: [u32; 2]) -> f64 {
    f64::from(size[0]) * f64::from(size[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_divisor_is_the_smallest_that_is_fast_enough() {
        let (size, mut pace) = ([1200, 800], Pace::default());
        assert_eq!((pace.moving_divisor(size, true), pace.moving_divisor(size, false)), (4, 1));
        pace.add(size, MOVING_S * 0.9);
        assert_eq!(pace.moving_divisor(size, true), 1);
        pace.add(divided(size, 4), MOVING_S / 4.0 * 0.99);
        assert_eq!(pace.moving_divisor(size, true), 2);
        pace.add(size, 1e6);
        assert_eq!(pace.moving_divisor(size, true), 12, "the coarsest there is");
    }
}
