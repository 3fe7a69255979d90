//! How fine the picture is marched while the view moves: as fine as the device manages in a moment, in full at rest.

/// Seconds that a frame may take while the view moves.
const MOVING_S: f64 = 0.033;

/// Seconds that the window may stand still for rows of the full picture at rest.
const ROWS_S: f64 = 0.1;

/// A picture that takes longer is drawn coarsely first.
const SLOW_S: f64 = 0.4;

/// Seconds that a frame of a moving view is to take as far as can be told before: views are not equally slow.
const AIM_S: f64 = 0.75 * MOVING_S;

/// What the time of the frames so far says about the next.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    /// Of whole pictures.
    s_per_pixel: Option<f64>,
    /// Of the rows that were marched last.
    s_per_pixel_of_rows: Option<f64>,
    /// Divisor of the last frame while the view moved.
    divisor: Option<u32>,
}

impl Pace {
    /// Divisors of the picture's width and height.
    const DIVISORS: [u32; 7] = [1, 2, 3, 4, 6, 8, 12];

    /// Takes the time of a picture of this size into account.
    pub fn add(&mut self, size: [u32; 2], frame_s: f64) {
        // Of one view to the next the time rises at once and falls by and by.
        self.s_per_pixel = followed(self.s_per_pixel, frame_s / pixels(size));
    }

    /// Takes the time of some rows of a picture into account, `size` of them. Rows that show nothing say nothing of the picture.
    pub fn add_rows(&mut self, size: [u32; 2], rows_s: f64) {
        self.s_per_pixel_of_rows = followed(self.s_per_pixel_of_rows, rows_s / pixels(size));
    }

    /// Whether a picture of this size takes long enough to be seen coarsely before.
    pub fn is_slow(&self, size: [u32; 2]) -> bool {
        self.s_per_pixel.is_none_or(|s| s * pixels(size) > SLOW_S)
    }

    /// How many rows of a picture of this size to march at once at rest, at least 8 or all.
    pub fn rows_at_rest(&self, size: [u32; 2]) -> u32 {
        let Some(s_per_pixel) = self.s_per_pixel_of_rows.or(self.s_per_pixel) else { return size[1] };
        let affordable = ROWS_S / (s_per_pixel * f64::from(size[0].max(1)));
        (affordable.min(f64::from(size[1])) as u32).max(8).min(size[1])
    }

    /// What to divide width and height by while the view moves. Before the first frame a device that is `slow`, a CPU, begins coarse. What
    /// was fine enough in the frame before stays as long as it is fast enough, lest the picture flickers.
    pub fn moving_divisor(&mut self, size: [u32; 2], slow: bool) -> u32 {
        let Some(s_per_pixel) = self.s_per_pixel else { return if slow { 4 } else { 1 } };
        let takes_s = |divisor: u32| s_per_pixel * pixels(divided(size, divisor));
        let coarsest = Self::DIVISORS[Self::DIVISORS.len() - 1];
        let aimed = Self::DIVISORS.into_iter().find(|&divisor| takes_s(divisor) <= AIM_S).unwrap_or(coarsest);
        let kept = self.divisor.filter(|&divisor| divisor < aimed && takes_s(divisor) <= MOVING_S);
        *self.divisor.insert(kept.unwrap_or(aimed))
    }
}

fn followed(before: Option<f64>, s_per_pixel: f64) -> Option<f64> {
    Some(before.map_or(s_per_pixel, |before| s_per_pixel.max(0.75 * before)))
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
        pace.add(size, AIM_S * 0.9);
        assert_eq!(pace.moving_divisor(size, true), 1);
        pace.add(divided(size, 4), AIM_S / 4.0 * 0.99);
        assert_eq!(pace.moving_divisor(size, true), 2);
        pace.add(divided(size, 2), AIM_S * 1.1);
        assert_eq!(pace.moving_divisor(size, true), 2, "not as fast as aimed at, but fast enough");
        pace.add(divided(size, 2), MOVING_S * 1.01);
        assert_eq!(pace.moving_divisor(size, true), 3);
        pace.add(size, 1e6);
        assert_eq!(pace.moving_divisor(size, true), 12, "the coarsest there is");
    }

    #[test]
    fn rows_that_show_nothing_do_not_make_the_next_move_slow() {
        let (size, mut pace) = ([1200, 800], Pace::default());
        pace.add(size, 10.0 * ROWS_S);
        assert_eq!(pace.rows_at_rest(size), 80, "a tenth of the rows");
        assert_eq!(pace.rows_at_rest([1200, 5]), 5);
        let before = pace.moving_divisor(size, true);
        (0..50).for_each(|_| pace.add_rows([1200, 80], 1e-4));
        assert_eq!(pace.rows_at_rest(size), 800, "all at once");
        assert_eq!(pace.moving_divisor(size, true), before);
        pace.add_rows([1200, 80], ROWS_S);
        assert_eq!(pace.rows_at_rest(size), 80);
    }
}
