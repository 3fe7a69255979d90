//! The scalar bar: the colours over the value at the right side of the picture, with name, unit, range and ticks.

use super::drawing::{Anchor, Drawing, Shape};
use super::ticks::{scale_ticks, short, x_at};
use crate::view::TransferFunction;
use glam::DVec2;

/// Width of the colours, distance to the picture's side, sizes of the letters; all in points.
const WIDTH: f64 = 14.0;
const MARGIN: f64 = 16.0;
const TITLE: f64 = 14.0;
const LABEL: f64 = 12.0;

/// Room for ticks' labels.
const LABELS: f64 = 64.0;

/// An array's name and the unit that it carries as `name [unit]` or `name (unit)`.
pub fn name_and_unit(array: &str) -> (&str, Option<&str>) {
    let array = array.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        let Some((name, unit)) = array.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) else { continue };
        // Without a space, round brackets are part of a name, as in f(x).
        if !name.trim().is_empty() && !unit.trim().is_empty() && (open == '[' || name.ends_with(' ')) {
            return (name.trim(), Some(unit.trim()));
        }
    }
    (array, None)
}

/// What the bar is headed with: "velocity x [m/s]".
pub fn title(array: &str, component: Option<&str>) -> String {
    let (name, unit) = name_and_unit(array);
    let component = component.map(|component| format!(" {component}")).unwrap_or_default();
    let unit = unit.map(|unit| format!(" [{unit}]")).unwrap_or_default();
    format!("{name}{component}{unit}")
}

/// Upper left and lower right corner of the colours; `None` in a picture too small for them.
fn colors_place(size: DVec2) -> Option<[DVec2; 2]> {
    let height = (0.5 * size.y).clamp(60.0, 320.0);
    let (right, top) = (size.x - MARGIN, (size.y - height) / 2.0);
    (size.x >= 150.0 && size.y >= 120.0).then(|| [DVec2::new(right - WIDTH, top), DVec2::new(right, top + height)])
}

/// What the bar covers, its letters included.
pub fn place(size: DVec2) -> Option<[DVec2; 2]> {
    let [min, max] = colors_place(size)?;
    Some([min - DVec2::new(LABELS, TITLE + 14.0), max + LABEL])
}

/// Colours over x from 0 to 1: `[x, r, g, b]`, the first at 0 and the last at 1.
fn colors(tf: &TransferFunction) -> Vec<[f64; 4]> {
    let knots = tf.stepped_color();
    let ends = [knots.first().map(|c| (0.0, c)), knots.last().map(|c| (1.0, c))];
    let end = |end: Option<(f64, &[f64; 4])>| end.map(|(x, &[_, r, g, b])| [x, r, g, b]);
    end(ends[0]).into_iter().chain(knots.iter().copied().filter(|c| (0.0..=1.0).contains(&c[0]))).chain(end(ends[1])).collect()
}

/// Draws it.
pub fn draw(drawing: &mut Drawing, size: DVec2, title: &str, tf: &TransferFunction, field_range: [f64; 2]) {
    let Some([min, max]) = colors_place(size) else { return };
    let height = max.y - min.y;
    let y = |x: f64| max.y - height * x;

    // Where fills meet within a pixel, what is below would show through.
    for &[x, r, g, b] in tf.stepped_color().iter().filter(|c| c[0] > 0.0 && c[0] < 1.0) {
        let color = [r as f32, g as f32, b as f32, 1.0];
        let (min, max) = (DVec2::new(min.x, y(x) - 1.0), DVec2::new(max.x, y(x) + 1.0));
        drawing.front.push(Shape::Fill { min, max, top: color, bottom: color });
    }
    // The colours, from one knot to the next.
    for pair in colors(tf).windows(2).filter(|pair| pair[1][0] > pair[0][0]) {
        let color = |c: [f64; 4]| [c[1] as f32, c[2] as f32, c[3] as f32, 1.0];
        let (min, max) = (DVec2::new(min.x, y(pair[1][0])), DVec2::new(max.x, y(pair[0][0])));
        drawing.front.push(Shape::Fill { min, max, top: color(pair[1]), bottom: color(pair[0]) });
    }
    let corners = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
    for i in 0..4 {
        drawing.front.push(Shape::Line { from: corners[i], to: corners[(i + 1) % 4], width: 1.0, color: drawing.faint(0.7) });
    }

    // Both ends of the range as they are, between them round numbers.
    let range = tf.range.unwrap_or(field_range);
    let mark = |drawing: &mut Drawing, x: f64, label: String, strength: f32| {
        let at = DVec2::new(min.x, y(x));
        drawing.front.push(Shape::Line { from: at - DVec2::X * 5.0, to: at, width: 1.0, color: drawing.faint(0.9) });
        let color = drawing.faint(strength);
        drawing.front.push(Shape::Text { at: at - DVec2::X * 9.0, anchor: Anchor::RIGHT, size: LABEL, color, text: label });
    };
    mark(drawing, 0.0, short(range[0]), 0.75);
    mark(drawing, 1.0, short(range[1]), 0.75);
    let place = |value: f64| x_at(tf, field_range, value);
    let room = 1.2 * LABEL / height;
    for tick in scale_ticks(range, (height / 34.0) as usize, place) {
        let x = place(tick.value);
        if (room..=1.0 - room).contains(&x) {
            mark(drawing, x, tick.label, 1.0);
        }
    }

    let most = ((size.x - 2.0 * MARGIN) / (0.55 * TITLE)) as usize;
    let shown: String = if title.chars().count() > most {
        title.chars().take(most.saturating_sub(1)).chain(['\u{2026}']).collect()
    } else {
        title.to_owned()
    };
    drawing.front.push(drawing.text(DVec2::new(max.x, min.y - 11.0), Anchor::RIGHT_BOTTOM, TITLE, shown));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_told_from_names() {
        assert_eq!(name_and_unit("velocity [m/s]"), ("velocity", Some("m/s")));
        assert_eq!(name_and_unit("p[Pa]"), ("p", Some("Pa")));
        assert_eq!(name_and_unit("Temperature (K) "), ("Temperature", Some("K")));
        for plain in ["density", "f(x)", "[m]", "velocity [m/s] mean", "p []", ""] {
            assert_eq!(name_and_unit(plain), (plain, None));
        }
        assert_eq!(title("velocity (m/s)", Some("x")), "velocity x [m/s]");
        assert_eq!(title("density", None), "density");
    }

    #[test]
    fn ticks_stand_at_their_values() {
        let (size, range) = (DVec2::new(600.0, 400.0), [0.5, 4.5]);
        let tf = TransferFunction { range: Some([1.0, 5.0]), ..TransferFunction::standard() };
        for (tf, range) in [(TransferFunction::standard(), range), (tf, [1.0, 5.0])] {
            let mut drawing = Drawing::on([0.0; 3]);
            draw(&mut drawing, size, "s", &tf, [0.5, 4.5]);
            let place = |label: &str| {
                let at = |shape: &Shape| match shape {
                    Shape::Text { text, at, .. } if text == label => Some(*at),
                    _ => None,
                };
                drawing.front.iter().find_map(at).unwrap_or_else(|| panic!("{label} is written")).y
            };
            // The bar is 200 points high in the middle of 400.
            assert_eq!((place(&short(range[0])), place(&short(range[1]))), (300.0, 100.0));
            for value in ["2", "3", "4"] {
                let expected = 300.0 - 200.0 * (value.parse::<f64>().expect("a number") - range[0]) / 4.0;
                assert!((place(value) - expected).abs() < 1e-9, "{value} at {}", place(value));
            }
        }
    }

    #[test]
    fn colours_are_those_of_the_knots_from_end_to_end() {
        let tf = TransferFunction {
            color: vec![[0.2, 1.0, 0.0, 0.0], [0.6, 0.0, 1.0, 0.0], [0.6, 0.0, 0.0, 1.0]],
            ..TransferFunction::standard()
        };
        let mut drawing = Drawing::on([0.0; 3]);
        draw(&mut drawing, DVec2::new(600.0, 400.0), "s", &tf, [0.0, 1.0]);
        let fills: Vec<_> = drawing
            .front
            .iter()
            .filter_map(|s| if let Shape::Fill { min, max, top, bottom } = s { Some((min.y, max.y, *top, *bottom)) } else { None })
            .filter(|(top, bottom, ..)| bottom - top > 2.5) // less lies under the seams
            .collect();
        let (red, green, blue) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(fills, [(260.0, 300.0, red, red), (180.0, 260.0, green, red), (100.0, 180.0, blue, blue)]);
    }
}
