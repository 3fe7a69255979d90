//! The bounding box with ticks in data units. Edges at its back are drawn behind the volume, which then covers them as far as it is
//! opaque; those at its front faintly over it. Ticks stand at its outline, so that the volume is not behind them.

use super::drawing::{Anchor, Drawing, Shape, overlap, text_place};
use super::ticks::round_ticks;
use crate::geometry::Aabb;
use crate::view::{Camera, Projection};
use glam::{DVec2, DVec3};

/// Size of the letters, length of ticks, and where letters begin; points.
const LABEL: f64 = 11.0;
const TICK: f64 = 5.0;
const AWAY: f64 = 9.0;

/// Shortest edge that has ticks, and the distance from one to the next; points.
const SHORTEST: f64 = 50.0;
const SPACING: f64 = 56.0;

/// An edge: the axis that it lies along, its corners as numbered by [`Aabb::corners`], and the faces on both sides as (axis, is the upper one).
struct Edge {
    axis: usize,
    ends: [usize; 2],
    faces: [(usize, bool); 2],
}

fn edges() -> impl Iterator<Item = Edge> {
    (0..12).map(|i| {
        let (axis, sides) = (i / 4, [i & 1 > 0, i & 2 > 0]);
        let faces = [((axis + 1) % 3, sides[0]), ((axis + 2) % 3, sides[1])];
        let first = faces.iter().map(|&(axis, upper)| usize::from(upper) << axis).sum();
        Edge { axis, ends: [first, first | 1 << axis], faces }
    })
}

/// Whether a face is seen from its outer side.
fn is_front(camera: &Camera, bounds: &Aabb, (axis, upper): (usize, bool)) -> bool {
    let sign = if upper { 1.0 } else { -1.0 };
    match camera.projection {
        Projection::Parallel { .. } => camera.axes()[0][axis] * sign < 0.0,
        Projection::Perspective { .. } => (camera.eye[axis] - if upper { bounds.max[axis] } else { bounds.min[axis] }) * sign > 0.0,
    }
}

/// The part of a segment inside a rectangle around the picture, so that no painter meets huge numbers.
fn clipped([a, b]: [DVec2; 2], size: DVec2) -> Option<[DVec2; 2]> {
    let flat = |v: DVec2| DVec3::new(v.x, v.y, 0.0);
    let around = Aabb { min: flat(DVec2::splat(-20.0)), max: flat(size + 20.0) };
    let [t, u] = around.line_interval(flat(a), flat(b - a))?;
    let (t, u) = (t.max(0.0), u.min(1.0));
    (t < u).then(|| [a + (b - a) * t, a + (b - a) * u])
}

/// Draws it. `taken` are places where no letters may stand.
pub fn draw(drawing: &mut Drawing, size: DVec2, camera: &Camera, bounds: Aabb, mut taken: Vec<[DVec2; 2]>) {
    let point = |seen: DVec2| size / 2.0 + DVec2::new(seen.x, -seen.y) * size.y;
    let corners = bounds.corners();
    let segment = |edge: &Edge| {
        let seen = camera.seen_segment(edge.ends.map(|end| corners[end]))?.map(point);
        clipped(seen, size)
    };
    for edge in edges() {
        let Some([from, to]) = segment(&edge) else { continue };
        if edge.faces.iter().all(|&face| is_front(camera, &bounds, face)) {
            drawing.front.push(Shape::Line { from, to, width: 1.0, color: drawing.faint(0.3) });
        } else {
            drawing.behind.push(Shape::Line { from, to, width: 1.2, color: drawing.faint(0.75) });
        }
    }

    let Some(middle) = camera.seen_at(bounds.center()).map(point) else { return };
    for axis in 0..3 {
        // Of the edges of the outline the lowest, of upright ones the leftmost.
        let is_outline = |edge: &Edge| edge.faces.iter().filter(|&&face| is_front(camera, &bounds, face)).count() == 1;
        let of_axis = edges().filter(|edge| edge.axis == axis && is_outline(edge));
        let seen = of_axis.filter_map(|edge| Some((segment(&edge)?, edge)));
        let is_upright = |[a, b]: [DVec2; 2]| (b - a).y.abs() > (b - a).x.abs();
        let rank = |ends: [DVec2; 2]| if is_upright(ends) { -(ends[0].x + ends[1].x) } else { ends[0].y + ends[1].y };
        let Some(([from, to], edge)) = seen.max_by(|a, b| rank(a.0).total_cmp(&rank(b.0))) else { continue };
        let length = from.distance(to);
        if length < SHORTEST {
            continue;
        }
        let outward = (to - from).perp().normalize();
        let outward = if outward.dot((from + to) / 2.0 - middle) < 0.0 { -outward } else { outward };
        let anchor = Anchor(0.5 - 0.5 * outward.x, 0.5 - 0.5 * outward.y);
        let mut widest: f64 = 0.0;
        for tick in round_ticks([bounds.min[axis], bounds.max[axis]], ((length / SPACING) as usize).clamp(2, 12)) {
            let mut place = corners[edge.ends[0]];
            place[axis] = tick.value;
            let Some(at) = camera.seen_at(place).map(point) else { continue };
            if at.cmplt(DVec2::ZERO).any() || at.cmpgt(size).any() {
                continue;
            }
            drawing.front.push(Shape::Line { from: at, to: at + outward * TICK, width: 1.0, color: drawing.faint(0.9) });
            let text = at + outward * AWAY;
            if put(drawing, size, &mut taken, text, anchor, tick.label.clone()) {
                widest = widest
                    .max(text_place(text, anchor, LABEL, &tick.label).map(|p| (p - text).dot(outward)).into_iter().fold(0.0, f64::max));
            }
        }
        let name = ["x", "y", "z"][axis].to_owned();
        put(drawing, size, &mut taken, (from + to) / 2.0 + outward * (AWAY + widest + 8.0), anchor, name);
    }
}

/// Writes a text if its place is in the picture and free; then it is taken.
fn put(drawing: &mut Drawing, size: DVec2, taken: &mut Vec<[DVec2; 2]>, at: DVec2, anchor: Anchor, text: String) -> bool {
    let place = text_place(at, anchor, LABEL, &text);
    let is_inside = place[0].cmpge(DVec2::ZERO).all() && place[1].cmple(size).all();
    let is_free = is_inside && taken.iter().all(|other| !overlap(place, *other));
    if is_free {
        drawing.front.push(drawing.text(at, anchor, LABEL, text));
        taken.push(place);
    }
    is_free
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec2 = DVec2::new(800.0, 600.0);

    fn bounds() -> Aabb {
        Aabb { min: DVec3::new(10.0, -2.0, 0.0), max: DVec3::new(14.0, 2.0, 3.0) }
    }

    fn drawn(camera: &Camera) -> Drawing {
        let mut drawing = Drawing::on([0.0; 3]);
        draw(&mut drawing, SIZE, camera, bounds(), Vec::new());
        drawing
    }

    fn texts(drawing: &Drawing) -> Vec<(&str, DVec2)> {
        let text = |shape| if let &Shape::Text { ref text, at, .. } = shape { Some((text.as_str(), at)) } else { None };
        drawing.front.iter().filter_map(text).collect()
    }

    #[test]
    fn corners_are_where_they_are_seen_and_nine_edges_lie_behind() {
        let camera = Camera::orbit(bounds(), 1, 1.0);
        let drawing = drawn(&camera);
        let lines = |shapes: &[Shape]| -> Vec<[DVec2; 2]> {
            shapes
                .iter()
                .filter_map(|s| {
                    if let Shape::Line { from, to, width, .. } = s {
                        (*width != 1.0 || from.distance(*to) > 6.0).then_some([*from, *to])
                    } else {
                        None
                    }
                })
                .collect()
        };
        assert_eq!((lines(&drawing.behind).len(), lines(&drawing.front).len()), (9, 3));
        // The three edges at the front meet at the corner that is nearest to the eye.
        let nearest =
            bounds().corners().into_iter().min_by(|a, b| a.distance(camera.eye).total_cmp(&b.distance(camera.eye))).expect("eight");
        let frame = camera.frame(DVec3::ZERO, 800, 600);
        let pixel = |x: f64, y: f64| frame.eye + (frame.forward + frame.right * (x / 400.0 - 1.0) + frame.up * (1.0 - y / 300.0)) * 1.0;
        for ends in lines(&drawing.front) {
            let at = ends
                .into_iter()
                .min_by(|a, b| miss(*a, nearest, &frame.eye, &pixel).total_cmp(&miss(*b, nearest, &frame.eye, &pixel)))
                .expect("two");
            assert!(miss(at, nearest, &frame.eye, &pixel) < 1e-9);
        }
    }

    /// How far the ray through a place of the picture passes a point.
    fn miss(at: DVec2, point: DVec3, eye: &DVec3, pixel: &impl Fn(f64, f64) -> DVec3) -> f64 {
        let direction = (pixel(at.x, at.y) - *eye).normalize();
        (point - *eye).cross(direction).length()
    }

    #[test]
    fn ticks_stand_at_their_coordinates() {
        // Along y, parallel, 6 units high: 100 points a unit; the middle of the box in the middle of the picture.
        let target = bounds().center();
        let projection = Projection::Parallel { view_height: 6.0 };
        let camera = Camera { eye: target - DVec3::Y * 20.0, target, up: DVec3::Z, projection };
        let drawing = drawn(&camera);
        let x = |value: f64| 400.0 + 100.0 * (value - 12.0);
        let z = |value: f64| 300.0 - 100.0 * (value - 1.5);
        let (bottom, left) = (z(0.0) + AWAY, x(10.0) - AWAY);
        for (label, at) in [("11", DVec2::new(x(11.0), bottom)), ("13", DVec2::new(x(13.0), bottom)), ("2", DVec2::new(left, z(2.0)))] {
            assert!(
                texts(&drawing).iter().any(|(text, place)| *text == label && place.distance(at) < 1e-9),
                "{label}: {:?}",
                texts(&drawing)
            );
        }
        assert!(texts(&drawing).iter().all(|(text, _)| *text != "y"), "y goes away from the viewer");
    }

    #[test]
    fn labels_keep_apart_and_nothing_is_far_outside() {
        for k in 0..12 {
            let near = Camera { eye: bounds().center() + DVec3::new(0.1, 0.2, 0.3), ..Camera::orbit(bounds(), k, 1.0) };
            for camera in [Camera::orbit(bounds(), k, 1.2), Camera::orbit(bounds(), k, 6.0), near] {
                let drawing = drawn(&camera);
                let places: Vec<_> = texts(&drawing).iter().map(|(text, at)| (*text, *at)).collect();
                for (i, (_, a)) in places.iter().enumerate() {
                    assert!(places[..i].iter().all(|(_, b)| a.distance(*b) > 3.0), "{places:?}");
                }
                for shape in drawing.behind.iter().chain(&drawing.front) {
                    if let Shape::Line { from, to, .. } = shape {
                        assert!([from, to].iter().all(|p| p.is_finite() && p.length() < 1100.0), "{shape:?}");
                    }
                }
            }
        }
    }
}
