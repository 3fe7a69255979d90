//! Colour maps: colours at places, and the space in which to go from one to the next, baked to what a transfer function has.

mod presets;
mod spaces;

use spaces::{Triple, mix, mix_diverging, mix_hsv, mix_lab};

/// Most knots of a baked map.
pub const MOST_KNOTS: usize = 256;

/// Knots up to which none is left out.
const FEW_KNOTS: usize = 64;

/// How far a baked map may be from its colours between knots, in parts of full brightness.
const TOLERANCE: f64 = 1.0 / 512.0;

/// In which space colours between two points are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorSpace {
    /// Red, green and blue.
    #[default]
    Rgb,
    /// CIELAB, D65.
    Lab,
    /// Hue, saturation and value; `wraps`: the shorter way around the circle of hues.
    Hsv {
        /// Whether hues go the shorter way.
        wraps: bool,
    },
    /// Moreland's Msh, through white.
    Diverging,
    /// None: up to a point, the colour of that point.
    Step,
}

/// A colour map.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorMap {
    /// What people call it, as ParaView does where it has it.
    pub name: String,
    /// What lies between points.
    pub space: ColorSpace,
    /// `[x, r, g, b]`: at least one, x ascending over any range, colours in [0, 1].
    pub points: Vec<[f64; 4]>,
}

impl ColorMap {
    /// Colours over x in [0, 1], as a transfer function has them: at most 256 knots, unless steps alone are more, linear in RGB between them, within 1/512 of
    /// the map's own colours unless that takes more.
    pub fn bake(&self) -> Vec<[f64; 4]> {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return vec![] };
        let width = last[0] - first[0];
        let place = |x: f64| {
            if x == last[0] && width > 0.0 {
                1.0
            } else if width > 0.0 {
                (x - first[0]) / width
            } else {
                0.0
            }
        };
        let points: Vec<[f64; 4]> = self.points.iter().map(|&[x, r, g, b]| [place(x), r, g, b]).collect();
        let mut dense = vec![points[0]];
        for pair in points.windows(2) {
            let ([x0, from @ ..], [x1, to @ ..]) = (pair[0], pair[1]);
            // Halves and so on of pieces of no space of its own are of no use.
            let parts =
                if matches!(self.space, ColorSpace::Rgb | ColorSpace::Step) { 1 } else { (512.0 * (x1 - x0)).ceil().max(1.0) as u32 };
            if self.space == ColorSpace::Step {
                dense.push([x0, to[0], to[1], to[2]]);
            }
            for part in 1..=parts {
                let t = f64::from(part) / f64::from(parts);
                let [r, g, b] = if part == parts { to } else { self.between(from, to, t) };
                dense.push([if part == parts { x1 } else { x0 + t * (x1 - x0) }, r, g, b]);
            }
        }
        if self.space == ColorSpace::Step && dense.len() > 1 {
            dense.remove(0); // the first colour has no extent
        }
        // A few points stay as their author set them.
        if matches!(self.space, ColorSpace::Rgb | ColorSpace::Step) && dense.len() <= FEW_KNOTS {
            return dense;
        }
        let mut tolerance = TOLERANCE;
        loop {
            let kept = thinned(&dense, tolerance);
            // Beyond a tolerance of 1 nothing is left but steps, which all stay.
            if kept.len() <= MOST_KNOTS || tolerance > 1.0 {
                return kept;
            }
            tolerance *= 2.0;
        }
    }

    fn between(&self, from: Triple, to: Triple, t: f64) -> Triple {
        match self.space {
            ColorSpace::Rgb => mix(from, to, t),
            ColorSpace::Lab => mix_lab(from, to, t),
            ColorSpace::Hsv { wraps } => mix_hsv(from, to, t, wraps),
            ColorSpace::Diverging => mix_diverging(from, to, t),
            ColorSpace::Step => to,
        }
    }
}

/// Fewer knots of the same line: each is the furthest from the one before with which all between are within `tolerance`. Steps and the ends stay.
fn thinned(line: &[[f64; 4]], tolerance: f64) -> Vec<[f64; 4]> {
    let near = |a: &[f64; 4], b: &[f64; 4], at: &[f64; 4]| {
        let on_line = mix(*a, *b, (at[0] - a[0]) / (b[0] - a[0]));
        (1..4).all(|c| (on_line[c] - at[c]).abs() <= tolerance)
    };
    let mut kept = vec![line[0]];
    let mut from = 0;
    while from + 1 < line.len() {
        let mut to = from + 1;
        while line[to][0] > line[from][0]
            && to + 1 < line.len()
            && line[to + 1][0] > line[to][0]
            && line[from + 1..=to].iter().all(|at| near(&line[from], &line[to + 1], at))
        {
            to += 1;
        }
        kept.push(line[to]);
        from = to;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::tabulate::at;

    fn map(space: ColorSpace, points: &[[f64; 4]]) -> Vec<[f64; 4]> {
        ColorMap { name: "m".into(), space, points: points.to_vec() }.bake()
    }

    #[test]
    fn any_range_becomes_the_unit_one() {
        let baked = map(ColorSpace::Rgb, &[[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [3.0, 1.0, 1.0, 1.0]]);
        assert_eq!(baked, [[0.0, 0.0, 0.0, 0.0], [0.25, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]);
        assert_eq!(map(ColorSpace::Lab, &[[7.0, 0.1, 0.2, 0.3]]), [[0.0, 0.1, 0.2, 0.3]]);
    }

    #[test]
    fn every_space_is_met_within_its_tolerance() {
        let points = [[0.0, 0.1, 0.2, 0.8], [0.3, 0.9, 0.9, 0.85], [1.0, 0.7, 0.0, 0.1]];
        for space in [ColorSpace::Lab, ColorSpace::Hsv { wraps: true }, ColorSpace::Hsv { wraps: false }, ColorSpace::Diverging] {
            let map = ColorMap { name: "m".into(), space, points: points.to_vec() };
            let baked = map.bake();
            assert!(baked.len() < 128, "{space:?} takes {} knots", baked.len());
            for k in 0..=1000 {
                let x = f64::from(k) / 1000.0;
                let (i, width) = if x < 0.3 { (0, 0.3) } else { (1, 0.7) };
                let colors = |k: usize| [points[k][1], points[k][2], points[k][3]];
                let exact = map.between(colors(i), colors(i + 1), (x - points[i][0]) / width);
                let found = at(&baked, x);
                assert!((0..3).all(|c| (found[c + 1] - exact[c]).abs() < 1.5 * TOLERANCE), "{space:?} at {x}: {found:?}, {exact:?}");
            }
            let rgb = at(&self::map(ColorSpace::Rgb, &points), 0.65);
            assert!((1..4).any(|c| (rgb[c] - at(&baked, 0.65)[c]).abs() > 0.02), "{space:?} is not RGB");
        }
    }

    #[test]
    fn steps_have_the_colour_of_their_right_end() {
        let baked = map(ColorSpace::Step, &[[0.0, 0.1, 0.0, 0.0], [2.0, 0.5, 0.0, 0.0], [8.0, 0.9, 0.0, 0.0]]);
        assert_eq!(baked, [[0.0, 0.5, 0.0, 0.0], [0.25, 0.5, 0.0, 0.0], [0.25, 0.9, 0.0, 0.0], [1.0, 0.9, 0.0, 0.0]]);
    }

    #[test]
    fn long_tables_are_thinned_and_steps_kept() {
        let waves = |k: u32| [f64::from(k), (f64::from(k) * 0.9).sin() * 0.5 + 0.5, 0.0, 0.0];
        assert!(map(ColorSpace::Rgb, &(0..2000).map(waves).collect::<Vec<_>>()).len() <= MOST_KNOTS);
        let ramp: Vec<_> = (0..500).map(|k| [f64::from(k), f64::from(k) / 499.0, 0.0, 1.0]).collect();
        assert_eq!(map(ColorSpace::Rgb, &ramp).len(), 2);
        let step = [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]];
        assert_eq!(map(ColorSpace::Rgb, &step), step);
        // More steps than there is room for otherwise.
        let bands: Vec<_> = (0..300).map(|k| [f64::from(k), f64::from(k % 2), 0.0, 0.0]).collect();
        assert!(map(ColorSpace::Step, &bands).len() >= 2 * 299);
    }
}
