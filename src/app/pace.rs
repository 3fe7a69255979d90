//! How fine the picture is marched while the view moves: as fine as the device manages in a moment, in full at rest.

/// Seconds that a frame may take while the view moves.
const MOVING_S: f64 = 0.033;

/// Seconds that the window may stand still for rows of the full picture at rest.
const ROWS_S: f64 = 0.1;

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
        // A picture is not equally slow everywhere: a fast part lowers the estimate only by and by.
        let s_per_pixel = frame_s / pixels(size);
        self.s_per_pixel = Some(self.s_per_pixel.map_or(s_per_pixel, |before| s_per_pixel.max(0.75 * before)));
    }

    /// How many rows of a picture of this size to march at once at rest, at least 8 or all.
    pub fn rows_at_rest(&self, size: [u32; 2]) -> u32 {
        let Some(s_per_pixel) = self.s_per_pixel else { return size[1] };
        let affordable = ROWS_S / (s_per_pixel * f64::from(size[0].max(1)));
        (affordable.min(f64::from(size[1])) as u32).max(8).min(size[1])
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
        pace.add(size, 10.0 * ROWS_S);
        assert_eq!(pace.rows_at_rest(size), 80, "a tenth of the rows");
        assert_eq!(pace.rows_at_rest([1200, 5]), 5);
        pace.add(size, 1e6);
        assert_eq!(pace.moving_divisor(size, true), 12, "the coarsest there is");
    }
}
