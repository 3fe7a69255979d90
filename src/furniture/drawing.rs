//! Lines, fills and texts: all that furniture is made of.

use glam::DVec2;

/// Red, green, blue and opacity in [0, 1], as they are displayed, not premultiplied.
pub type Color = [f32; 4];

/// Which point of a text's box lies at its place: (0, 0) the upper left corner, (1, 1) the lower right one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor(pub f64, pub f64);

impl Anchor {
    /// The upper left corner.
    pub const LEFT_TOP: Anchor = Anchor(0.0, 0.0);
    /// The middle.
    pub const CENTER: Anchor = Anchor(0.5, 0.5);
    /// The middle of the right side.
    pub const RIGHT: Anchor = Anchor(1.0, 0.5);
    /// The lower right corner.
    pub const RIGHT_BOTTOM: Anchor = Anchor(1.0, 1.0);
}

/// One thing to paint. Places are in points from the picture's upper left corner, x to the right, y down.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A straight line.
    Line {
        /// One end.
        from: DVec2,
        /// The other.
        to: DVec2,
        /// Width in points.
        width: f64,
        /// Its colour.
        color: Color,
    },
    /// A rectangle, its colour blending from top to bottom.
    Fill {
        /// Upper left corner.
        min: DVec2,
        /// Lower right corner.
        max: DVec2,
        /// Colour at the top.
        top: Color,
        /// Colour at the bottom.
        bottom: Color,
    },
    /// One line of text, with a halo in the background's colour.
    Text {
        /// Where.
        at: DVec2,
        /// Which point of the text that is.
        anchor: Anchor,
        /// Size of the font in points.
        size: f64,
        /// Its colour.
        color: Color,
        /// What is said.
        text: String,
    },
}

/// What to paint, in painting order: some of it, then the picture, then the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Seen through the picture.
    pub behind: Vec<Shape>,
    /// Over the picture.
    pub front: Vec<Shape>,
    /// Colour of letters and lines.
    pub ink: Color,
    /// Colour around letters.
    pub halo: Color,
}

impl Drawing {
    /// Nothing, on a background.
    pub fn on(background: [f32; 3]) -> Self {
        let [r, g, b] = background;
        let is_light = 0.299 * r + 0.587 * g + 0.114 * b > 0.5;
        let ink = if is_light { 0.08 } else { 0.94 };
        Drawing { behind: Vec::new(), front: Vec::new(), ink: [ink, ink, ink, 1.0], halo: [r, g, b, 0.7] }
    }

    /// The ink, as strong as told.
    pub fn faint(&self, opacity: f32) -> Color {
        [self.ink[0], self.ink[1], self.ink[2], opacity]
    }

    /// A text in ink.
    pub fn text(&self, at: DVec2, anchor: Anchor, size: f64, text: String) -> Shape {
        Shape::Text { at, anchor, size, color: self.ink, text }
    }
}

/// About what a text covers, as (upper left, lower right): letters differ, this is for keeping texts apart.
pub fn text_place(at: DVec2, anchor: Anchor, size: f64, text: &str) -> [DVec2; 2] {
    let extent = DVec2::new(0.55 * size * text.chars().count() as f64, 1.2 * size);
    let min = at - extent * DVec2::new(anchor.0, anchor.1);
    [min, min + extent]
}

/// Whether two places have points in common.
pub fn overlap(a: [DVec2; 2], b: [DVec2; 2]) -> bool {
    a[0].cmplt(b[1]).all() && b[0].cmplt(a[1]).all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_stand_out_and_places_are_kept_apart() {
        assert!(Drawing::on([0.0; 3]).ink[0] > 0.9 && Drawing::on([1.0; 3]).ink[0] < 0.1);
        let place = |x: f64| text_place(DVec2::new(x, 10.0), Anchor::RIGHT, 10.0, "1234");
        assert_eq!(place(22.0), [DVec2::new(0.0, 4.0), DVec2::new(22.0, 16.0)]);
        assert!(overlap(place(22.0), place(43.0)) && !overlap(place(22.0), place(45.0)));
    }
}
