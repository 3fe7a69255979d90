//! A surface in colours of numbers at its points, for reports.

use super::{Nearest, Surface};
use crate::image::Image;
use crate::view::Camera;
use glam::DVec3;
use rayon::prelude::*;

/// Rays of a pixel along each side.
const RAYS: u32 = 2;

/// Draws a surface: the colour of the number at each place, linear in a triangle, darker the more the triangle turns away from the eye.
/// `colors` are knots `[x, r, g, b]` over [0, 1], which `range` becomes; what is not finite is grey.
pub fn paint_surface(
    surface: &Surface,
    nearest: &Nearest,
    values: &[f64],
    range: [f64; 2],
    colors: &[[f64; 4]],
    camera: &Camera,
    [width, height]: [u32; 2],
) -> Image {
    let frame = camera.frame(surface.origin, width * RAYS, height * RAYS);
    let scale = if range[1] > range[0] { 1.0 / (range[1] - range[0]) } else { 0.0 };
    let ray = |column: u32, row: u32| -> [f32; 4] {
        let (origin, direction) = frame.ray(column, row);
        let Some((triangle, distance)) = nearest.first_met(origin, direction) else { return [0.0; 4] };
        let ([a, b, c], ids) = (surface.corners(triangle as usize), surface.triangles[triangle as usize]);
        let (at, normal) = (origin + direction * distance, (b - a).cross(c - a));
        let area = normal.length_squared();
        let part = |p: DVec3, q: DVec3| (p - at).cross(q - at).dot(normal) / area;
        let value: f64 = [part(b, c), part(c, a), part(a, b)].iter().zip(ids).map(|(w, i)| w * values[i as usize]).sum();
        let light = 0.35 + 0.65 * direction.dot(normal / area.sqrt()).abs();
        let color = if value.is_finite() { color_at(colors, (value - range[0]) * scale) } else { [0.5; 3] };
        let [r, g, b] = color.map(|c| (c * light) as f32);
        [r, g, b, 1.0]
    };
    let pixels = (0..width * height).into_par_iter().map(|pixel| {
        let (column, row) = (pixel % width * RAYS, pixel / width * RAYS);
        let mut sum = [0.0; 4];
        for (x, y) in (0..RAYS).flat_map(|y| (0..RAYS).map(move |x| (x, y))) {
            let color = ray(column + x, row + y);
            sum.iter_mut().zip(color).for_each(|(sum, c)| *sum += c / (RAYS * RAYS) as f32);
        }
        sum
    });
    Image { width, height, pixels: pixels.collect() }
}

/// The colour at a place in [0, 1].
fn color_at(colors: &[[f64; 4]], x: f64) -> [f64; 3] {
    let x = x.clamp(0.0, 1.0);
    let after = colors.partition_point(|knot| knot[0] <= x).clamp(1, colors.len().max(2) - 1);
    let (Some(from), Some(to)) = (colors.get(after - 1), colors.get(after).or(colors.last())) else { return [0.5; 3] };
    let share = if to[0] > from[0] { ((x - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0) } else { 0.0 };
    [1, 2, 3].map(|c| from[c] + (to[c] - from[c]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::ColorMap;

    #[test]
    fn colours_lie_between_their_knots() {
        let colors = [[0.0, 0.0, 0.0, 1.0], [0.5, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]];
        assert_eq!([-1.0, 0.25, 0.5, 0.75, 2.0].map(|x| color_at(&colors, x)[1]), [0.0, 0.0, 0.0, 0.5, 1.0]);
        assert_eq!((color_at(&colors[..1], 0.7), color_at(&[], 0.5)), ([0.0, 0.0, 1.0], [0.5; 3]));
    }

    #[test]
    fn a_square_is_seen_in_the_colours_of_its_numbers() {
        let points = vec![DVec3::new(0.0, -1.0, -1.0), DVec3::new(0.0, 1.0, -1.0), DVec3::new(0.0, 1.0, 1.0), DVec3::new(0.0, -1.0, 1.0)];
        let values: Vec<f64> = points.iter().map(|p| p.y).collect();
        let surface = Surface { points, triangles: vec![[0, 1, 2], [0, 2, 3]], cells: vec![0, 1], ..Default::default() };
        let projection = crate::view::Projection::Parallel { view_height: 4.0 };
        let camera = Camera { eye: DVec3::X * 5.0, target: DVec3::ZERO, up: DVec3::Z, projection };
        let grey = ColorMap::preset("grey").expect("a preset").bake();
        let image = paint_surface(&surface, &Nearest::new(&surface), &values, [-1.0, 1.0], &grey, &camera, [40, 40]);
        for (i, pixel) in image.pixels.iter().enumerate() {
            // From x = 5 along -x with z up, y grows to the right.
            let (y, z) = (((i % 40) as f32 + 0.5) / 10.0 - 2.0, 2.0 - ((i / 40) as f32 + 0.5) / 10.0);
            let expected = if y.abs() < 1.0 && z.abs() < 1.0 { (y + 1.0) / 2.0 } else { 0.0 };
            assert!((pixel[0] - expected).abs() < 1e-5 && pixel[3] == f32::from(y.abs() < 1.0 && z.abs() < 1.0), "{pixel:?} at {y}, {z}");
        }
    }
}
