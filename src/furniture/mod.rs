//! What stands around the picture to read it by: scalar bar, orientation axes, bounding box with ticks, frame time.
//!
//! [`Furniture::drawing`] describes it once, as lines, fills and texts in points from the picture's upper left corner. The window paints
//! them with its own means; [`paint`] draws them into an [`Image`](crate::image::Image).
//!
//! ```text
//! drawing   the description
//! ticks     round numbers along an axis, and how they are written
//! bar       the scalar bar
//! axes      the orientation axes
//! bounds    the bounding box
//! paint     into an image
//! ```

mod axes;
mod bar;
mod bounds;
mod drawing;
mod paint;
mod ticks;

use crate::geometry::Aabb;
use crate::view::{Camera, TransferFunction};
pub use bar::{name_and_unit, title};
pub use drawing::{Anchor, Color, Drawing, Shape};
use glam::DVec2;
pub use paint::paint;
use std::fmt;
use std::str::FromStr;

/// A piece of furniture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The colours over the value, with the array's name and ticks.
    Bar,
    /// Which way x, y and z go.
    Axes,
    /// The bounding box with ticks.
    Bounds,
    /// What the frame took. It has no place in a file.
    Time,
}

/// Which pieces are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts([bool; 4]);

/// Why a text names no pieces.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected all, none, or some of bar, axes, box with commas between them")]
pub struct NotParts;

impl Parts {
    /// Nothing.
    pub const NONE: Parts = Parts([false; 4]);
    /// What the window opens with: bar, axes and time.
    pub const OPENING: Parts = Parts([true, true, false, true]);

    /// These pieces.
    pub fn of(parts: &[Part]) -> Self {
        parts.iter().fold(Parts::NONE, |all, &part| all.with(part, true))
    }

    /// The same with a piece shown or not.
    pub fn with(mut self, part: Part, shown: bool) -> Self {
        self.0[part as usize] = shown;
        self
    }

    /// Whether a piece is shown.
    pub fn has(self, part: Part) -> bool {
        self.0[part as usize]
    }
}

impl FromStr for Parts {
    type Err = NotParts;

    /// As `--furniture` has it.
    fn from_str(text: &str) -> Result<Self, NotParts> {
        let part = |name: &str| match name.trim() {
            "bar" => Ok(Part::Bar),
            "axes" => Ok(Part::Axes),
            "box" => Ok(Part::Bounds),
            _ => Err(NotParts),
        };
        match text {
            "none" => Ok(Parts::NONE),
            "all" => Ok(Parts::of(&[Part::Bar, Part::Axes, Part::Bounds])),
            some => some.split(',').map(part).collect::<Result<Vec<_>, _>>().map(|parts| Parts::of(&parts)),
        }
    }
}

impl fmt::Display for Parts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = [(Part::Bar, "bar"), (Part::Axes, "axes"), (Part::Bounds, "box")];
        let names: Vec<&str> = names.into_iter().filter(|&(part, _)| self.has(part)).map(|(_, name)| name).collect();
        f.write_str(if names.is_empty() { "none".to_owned() } else { names.join(",") }.as_str())
    }
}

/// What furniture is made for.
#[derive(Debug, Clone)]
pub struct Furniture<'a> {
    /// What of it is shown.
    pub parts: Parts,
    /// What the values are, as [`title`] writes it.
    pub title: String,
    /// Smallest and largest value, data units; the transfer function's own range goes before it.
    pub value_range: [f64; 2],
    /// The colours.
    pub transfer_function: &'a TransferFunction,
    /// From where.
    pub camera: &'a Camera,
    /// Bounds in world coordinates.
    pub bounds: Aabb,
    /// What lies behind the picture, RGB in [0, 1]: letters are light on dark and dark on light.
    pub background: [f32; 3],
    /// What the frame took, in words.
    pub frame_time: Option<String>,
}

impl Furniture<'_> {
    /// All of it for a picture of `size` points.
    pub fn drawing(&self, size: DVec2) -> Drawing {
        let mut drawing = Drawing::on(self.background);
        let shows = |part| self.parts.has(part);
        let taken = [bar::place(size).filter(|_| shows(Part::Bar)), axes::place(size).filter(|_| shows(Part::Axes))];
        if shows(Part::Bounds) {
            bounds::draw(&mut drawing, size, self.camera, self.bounds, taken.iter().flatten().copied().collect());
        }
        if shows(Part::Bar) {
            bar::draw(&mut drawing, size, &self.title, self.transfer_function, self.value_range);
        }
        if shows(Part::Axes) {
            axes::draw(&mut drawing, size, self.camera);
        }
        if let Some(time) = self.frame_time.as_ref().filter(|_| shows(Part::Time)) {
            drawing.front.push(drawing.text(DVec2::new(12.0, 10.0), Anchor::LEFT_TOP, 12.0, time.clone()));
        }
        drawing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn parts_are_read_as_they_are_written() {
        for text in ["none", "bar", "axes,box", "bar,axes,box"] {
            assert_eq!(text.parse::<Parts>().map(|parts| parts.to_string()), Ok(text.to_owned()));
        }
        assert_eq!("all".parse::<Parts>(), "box, bar,axes".parse());
        assert!(["", "bar,", "time", "Bar", "bar;axes"].iter().all(|text| text.parse::<Parts>() == Err(NotParts)));
    }

    #[test]
    fn each_part_is_drawn_if_it_is_asked_for() {
        let bounds = Aabb { min: DVec3::NEG_ONE, max: DVec3::ONE };
        let (camera, tf) = (Camera::orbit(bounds, 0, 1.0), TransferFunction::standard());
        let drawn = |parts: &[Part]| {
            let furniture = Furniture {
                parts: Parts::of(parts),
                title: "pressure [Pa]".into(),
                value_range: [0.0, 4.0],
                transfer_function: &tf,
                camera: &camera,
                bounds,
                background: [0.0; 3],
                frame_time: Some("7 ms".into()),
            };
            let drawing = furniture.drawing(DVec2::new(400.0, 300.0));
            let texts =
                drawing.front.iter().filter_map(|shape| if let Shape::Text { text, .. } = shape { Some(text.clone()) } else { None });
            (drawing.behind.len(), texts.collect::<Vec<_>>())
        };
        assert_eq!(drawn(&[]), (0, vec![]));
        assert_eq!(drawn(&[Part::Time]), (0, vec!["7 ms".into()]));
        assert!(drawn(&[Part::Bar]).1.contains(&"pressure [Pa]".into()));
        assert!(["x", "y", "z"].iter().all(|name| drawn(&[Part::Axes]).1.contains(&(*name).into())));
        assert!(drawn(&[Part::Bounds]).0 > 8, "edges behind the volume");
    }
}
