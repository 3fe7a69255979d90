//! A drawing into an image, antialiased.

use super::drawing::{Color, Drawing, Shape};
use crate::image::Image;
use ab_glyph::{Font, FontRef, ScaleFont, point};
use glam::DVec2;
use std::sync::LazyLock;

/// The font of the window.
static FONT: LazyLock<Option<FontRef<'static>>> = LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// Around letters the halo reaches so far, in points.
const HALO: f64 = 1.0;

/// Paints a drawing that was made for an image of `size / scale` points. What is behind shows as far as the image is not opaque.
pub fn paint(image: &mut Image, drawing: &Drawing, scale: f64) {
    if !drawing.behind.is_empty() {
        let mut behind = Image::new(image.width, image.height);
        paint_shapes(&mut behind, &drawing.behind, drawing.halo, scale);
        for (pixel, behind) in image.pixels.iter_mut().zip(&behind.pixels) {
            let through = 1.0 - pixel[3];
            *pixel = std::array::from_fn(|c| pixel[c] + through * behind[c]);
        }
    }
    paint_shapes(image, &drawing.front, drawing.halo, scale);
}

fn paint_shapes(image: &mut Image, shapes: &[Shape], halo: Color, scale: f64) {
    for shape in shapes {
        match *shape {
            Shape::Line { from, to, width, color } => line(image, [from * scale, to * scale], (width * scale).max(1.0), color),
            Shape::Fill { min, max, top, bottom } => fill(image, [min * scale, max * scale], [top, bottom]),
            Shape::Text { at, anchor, size, color, ref text } => {
                let place = |font: &FontRef<'_>| {
                    let size = size * scale;
                    (at * scale - text_size(font, text, size) * DVec2::new(anchor.0, anchor.1), size)
                };
                let Some((corner, size, font)) = FONT.as_ref().map(|font| (place(font).0, place(font).1, font)) else { continue };
                for i in 0..8 {
                    let around = DVec2::from_angle(f64::from(i) * std::f64::consts::FRAC_PI_4) * HALO * scale;
                    letters(image, font, text, corner + around, size, [halo[0], halo[1], halo[2], 0.5 * halo[3]]);
                }
                letters(image, font, text, corner, size, color);
            }
        }
    }
}

/// Lays a colour over a pixel as far as it is covered. Outside of the image nothing happens.
fn blend(image: &mut Image, x: i64, y: i64, color: Color, coverage: f64) {
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    if coverage <= 0.0 || !(0..width).contains(&x) || !(0..height).contains(&y) {
        return;
    }
    let pixel = &mut image.pixels[(y * width + x) as usize];
    let alpha = color[3] * coverage.min(1.0) as f32;
    let over = [color[0] * alpha, color[1] * alpha, color[2] * alpha, alpha];
    *pixel = std::array::from_fn(|c| over[c] + (1.0 - alpha) * pixel[c]);
}

/// A pixel is covered as far as its middle lies inside.
fn line(image: &mut Image, [from, to]: [DVec2; 2], width: f64, color: Color) {
    let along = to - from;
    let reach = width / 2.0 + 0.5;
    let distance = |p: DVec2| {
        let t = if along == DVec2::ZERO { 0.0 } else { ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0) };
        p.distance(from + along * t)
    };
    // Row by row if it is upright, else column by column; in each the few pixels around it.
    let upright = along.y.abs() >= along.x.abs();
    let axis = usize::from(upright);
    let limit = f64::from(if upright { image.height } else { image.width });
    let ends = [from[axis].min(to[axis]) - reach, from[axis].max(to[axis]) + reach];
    let spread = (2.0 * reach).ceil() as i64 + 1;
    for i in ends[0].max(0.0).floor() as i64..ends[1].min(limit).ceil() as i64 {
        let t = if along[axis] == 0.0 { 0.0 } else { ((i as f64 + 0.5 - from[axis]) / along[axis]).clamp(0.0, 1.0) };
        let middle = (from + along * t)[1 - axis].floor() as i64;
        for j in middle - spread..=middle + spread {
            let (x, y) = if upright { (j, i) } else { (i, j) };
            blend(image, x, y, color, reach - distance(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)));
        }
    }
}

/// A pixel is covered by the share of it that lies inside.
fn fill(image: &mut Image, [min, max]: [DVec2; 2], [top, bottom]: [Color; 2]) {
    let share = |i: i64, axis: usize| (max[axis].min(i as f64 + 1.0) - min[axis].max(i as f64)).clamp(0.0, 1.0);
    let range = |axis: usize, limit: u32| min[axis].max(0.0).floor() as i64..max[axis].min(f64::from(limit)).ceil() as i64;
    for y in range(1, image.height) {
        let t = ((y as f64 + 0.5 - min.y) / (max.y - min.y)).clamp(0.0, 1.0) as f32;
        let color = std::array::from_fn(|c| top[c] + (bottom[c] - top[c]) * t);
        for x in range(0, image.width) {
            blend(image, x, y, color, share(x, 0) * share(y, 1));
        }
    }
}

/// ab_glyph's scale of a font whose em is `size` pixels.
fn em_scale(font: &FontRef<'_>, size: f64) -> f32 {
    size as f32 * font.height_unscaled() / font.units_per_em().unwrap_or(1000.0)
}

fn text_size(font: &FontRef<'_>, text: &str, size: f64) -> DVec2 {
    let scaled = font.as_scaled(em_scale(font, size));
    let ids: Vec<_> = text.chars().map(|c| font.glyph_id(c)).collect();
    let kerns: f32 = ids.windows(2).map(|pair| scaled.kern(pair[0], pair[1])).sum();
    let width: f32 = ids.iter().map(|&id| scaled.h_advance(id)).sum();
    DVec2::new(f64::from(width + kerns), f64::from(scaled.height()))
}

/// Letters from the upper left corner of their box.
fn letters(image: &mut Image, font: &FontRef<'_>, text: &str, corner: DVec2, size: f64, color: Color) {
    let scaled = font.as_scaled(em_scale(font, size));
    let (mut x, y) = (corner.x as f32, corner.y as f32 + scaled.ascent());
    let mut before = None;
    for c in text.chars() {
        let id = font.glyph_id(c);
        x += before.map_or(0.0, |before| scaled.kern(before, id));
        if let Some(outline) = font.outline_glyph(id.with_scale_and_position(em_scale(font, size), point(x, y))) {
            let bounds = outline.px_bounds();
            let (left, top) = (bounds.min.x.floor() as i64, bounds.min.y.floor() as i64);
            outline.draw(|i, j, coverage| blend(image, left + i64::from(i), top + i64::from(j), color, f64::from(coverage)));
        }
        x += scaled.h_advance(id);
        before = Some(id);
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Anchor;
    use super::*;

    const RED: Color = [1.0, 0.0, 0.0, 1.0];

    fn painted(shapes: Vec<Shape>, scale: f64) -> Image {
        let mut image = Image::new(40, 30);
        paint(&mut image, &Drawing { front: shapes, ..Drawing::on([0.0; 3]) }, scale);
        image
    }

    fn alpha(image: &Image) -> f64 {
        image.pixels.iter().map(|p| f64::from(p[3])).sum()
    }

    #[test]
    fn fills_cover_their_area_and_blend_downwards() {
        let blue = [0.0, 0.0, 1.0, 1.0];
        let shape = Shape::Fill { min: DVec2::new(5.25, 4.0), max: DVec2::new(10.75, 12.0), top: RED, bottom: blue };
        let image = painted(vec![shape.clone()], 1.0);
        assert!((alpha(&image) - 5.5 * 8.0).abs() < 1e-4);
        assert!((alpha(&painted(vec![shape], 2.0)) - 4.0 * 5.5 * 8.0).abs() < 1e-3, "twice as large");
        let middle = image.pixels[7 * 40 + 8];
        assert!((middle[0] - (1.0 - 3.5 / 8.0)).abs() < 1e-6 && (middle[2] - 3.5 / 8.0).abs() < 1e-6, "{middle:?}");
    }

    #[test]
    fn lines_are_as_wide_as_told_in_any_direction() {
        let (a, b) = (DVec2::new(6.5, 5.0), DVec2::new(31.0, 21.0));
        for (from, to) in [(a, b), (b, a), (a, DVec2::new(9.0, 25.0)), (a, DVec2::new(6.5, 25.0))] {
            let area = alpha(&painted(vec![Shape::Line { from, to, width: 3.0, color: RED }], 1.0));
            // Rounded ends add about half a width each.
            let expected = 3.0 * (from.distance(to) + 0.25 * 3.0 * std::f64::consts::PI);
            assert!((area / expected - 1.0).abs() < 0.04, "{area}, expected {expected}");
        }
        let hairline = painted(vec![Shape::Line { from: DVec2::new(0.0, 10.5), to: DVec2::new(40.0, 10.5), width: 0.2, color: RED }], 1.0);
        assert!(hairline.pixels[10 * 40..11 * 40].iter().all(|p| *p == [1.0, 0.0, 0.0, 1.0]), "never thinner than a pixel");
        assert_eq!(alpha(&hairline), 40.0);
    }

    #[test]
    fn texts_hang_on_their_anchors() {
        let text = |anchor, text: &str| Shape::Text { at: DVec2::new(20.0, 15.0), anchor, size: 12.0, color: RED, text: text.into() };
        let extent = |shape: Shape| {
            let image = painted(vec![shape], 1.0);
            let lit = |i: &usize| image.pixels[*i][0] > 0.3;
            let all: Vec<usize> = (0..image.pixels.len()).filter(lit).collect();
            let x = all.iter().map(|i| i % 40);
            let y = all.iter().map(|i| i / 40);
            [x.clone().min(), x.max(), y.clone().min(), y.max()].map(|v| v.expect("something is written"))
        };
        let [left, right, top, bottom] = extent(text(Anchor::CENTER, "H0"));
        assert!((left + right).abs_diff(39) <= 2 && (top + bottom).abs_diff(30) <= 4, "{left} {right} {top} {bottom}");
        assert!(extent(text(Anchor::LEFT_TOP, "H0"))[0] >= 20 && extent(text(Anchor::LEFT_TOP, "H0"))[2] >= 15);
        assert!(extent(text(Anchor::RIGHT_BOTTOM, "H0"))[1] <= 20 && extent(text(Anchor::RIGHT_BOTTOM, "H0"))[3] <= 15);
        assert!(extent(text(Anchor::CENTER, "H00"))[0] < left);
    }

    #[test]
    fn what_is_behind_shows_through() {
        let mut image = Image::new(2, 1);
        image.pixels[0] = [0.25, 0.25, 0.25, 0.75];
        let behind = vec![Shape::Fill { min: DVec2::ZERO, max: DVec2::new(2.0, 1.0), top: RED, bottom: RED }];
        paint(&mut image, &Drawing { behind, ..Drawing::on([0.0; 3]) }, 1.0);
        assert_eq!(image.pixels, [[0.5, 0.25, 0.25, 1.0], [1.0, 0.0, 0.0, 1.0]]);
    }
}
