//! From voxels to where the window shows them: the world, stretched along the volume's axes if the user wants that, with the middle of the
//! volume at the origin.

use super::cut::{Cut, middle};
use crate::geometry::Aabb;
use crate::gpu::flat_projection;
use crate::volume::GridFrame;
use egui::{Pos2, Rect, pos2};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// An axis that is shorter than the longest by more than this is stretched at first.
const FLATTEST: f64 = 8.0;

/// Index space, the world, and the space that is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// Voxels along x, y, z.
    pub dims: [u32; 3],
    frame: GridFrame,
    shown_from_index: DMat3,
    index_from_shown: DMat3,
}

impl Space {
    /// That of a volume, stretched.
    pub fn new(frame: &GridFrame, stretch: DVec3) -> Self {
        let shown_from_index = frame.steps * DMat3::from_diagonal(stretch);
        Space { dims: frame.dims, frame: *frame, shown_from_index, index_from_shown: shown_from_index.inverse() }
    }

    /// A stretch that makes no volume a sheet or a needle.
    pub fn first_stretch(frame: &GridFrame) -> DVec3 {
        let lengths = frame.spacing() * DVec3::from(frame.dims.map(f64::from));
        let least = lengths.max_element() / FLATTEST;
        DVec3::from(lengths.to_array().map(|length| if length < least { least / length } else { 1.0 }))
    }

    /// Where a position of index space is shown.
    pub fn shown(&self, index: DVec3) -> DVec3 {
        self.shown_from_index * (index - middle(self.dims))
    }

    /// The inverse.
    pub fn index(&self, shown: DVec3) -> DVec3 {
        self.index_from_shown * shown + middle(self.dims)
    }

    /// Where a position of index space is in the world.
    pub fn world(&self, index: DVec3) -> DVec3 {
        self.frame.origin + self.frame.steps * index
    }

    /// The normal, as it is shown, of planes with a normal of index space; of length 1.
    pub fn shown_normal(&self, normal: DVec3) -> DVec3 {
        (self.index_from_shown.transpose() * normal).normalize_or(DVec3::Z)
    }

    /// The inverse; not of length 1.
    pub fn index_normal(&self, normal: DVec3) -> DVec3 {
        self.shown_from_index.transpose() * normal
    }

    /// The corners of the volume's box as they are shown, number `x + 2 y + 4 z`.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let end = |axis: usize| if i >> axis & 1 == 1 { f64::from(self.dims[axis]) - 0.5 } else { -0.5 };
            self.shown(DVec3::new(end(0), end(1), end(2)))
        })
    }

    /// The bounds of what is shown.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.corners())
    }

    /// From index space to what is shown, as a matrix.
    pub fn matrix(&self) -> DMat4 {
        DMat4::from_mat3(self.shown_from_index) * DMat4::from_translation(-middle(self.dims))
    }

    /// What goes right and up, as shown and of length 1, when one looks straight at a slice: up is what goes up in the world, else y; to the
    /// right is what goes along x, else y.
    pub fn flat_axes(&self, cut: &Cut) -> [DVec3; 2] {
        let normal = self.shown_normal(cut.normal);
        let flattened = |v: DVec3| v.reject_from_normalized(normal).try_normalize();
        let up = match cut.axis() {
            Some(axis) => {
                let ways = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| self.shown_from_index.col(axis).normalize_or_zero());
                // The steeper one; of two level ones that which goes along y.
                let steepness = |v: DVec3| v.z.abs() * 1e3 + v.y.abs();
                let up = if steepness(ways[0]) > steepness(ways[1]) { ways[0] } else { ways[1] };
                let sign = if up.z.abs() > 1e-3 { up.z } else { up.y };
                Some(up * sign.signum())
            }
            None => flattened(DVec3::Z).filter(|_| normal.z.abs() < 0.999).or_else(|| flattened(DVec3::Y)),
        };
        let up = up.and_then(flattened).unwrap_or_else(|| normal.any_orthonormal_vector());
        let right = up.cross(normal);
        let main = right.abs().max_position();
        [right * right[main].signum(), up]
    }
}

/// A picture that looks straight at a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatFrame {
    /// Its place in the window.
    pub rect: Rect,
    /// To the right and up, as shown.
    pub axes: [DVec3; 2],
    /// Where the slice lies along its normal, as shown.
    on_normal: DVec3,
    /// What is in the middle, along the axes.
    pub center: DVec2,
    /// Points of the window a unit as shown.
    pub scale: f64,
    cut: Cut,
    space: Space,
}

/// How a flat picture is moved and magnified.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlatView {
    /// What is in the middle, along the picture's axes.
    pub center: DVec2,
    /// Magnification, by powers of e; 0 shows all.
    pub zoom: f64,
}

impl FlatFrame {
    /// The picture of a slice at a place in the window.
    pub fn new(space: &Space, cut: &Cut, view: &FlatView, rect: Rect) -> Self {
        let axes = space.flat_axes(cut);
        let normal = space.shown_normal(cut.normal);
        let on_normal = normal * normal.dot(space.shown(cut.plane(space.dims).point));
        let corners = space.corners();
        let extent = |axis: DVec3| corners.iter().map(|corner| 2.0 * corner.dot(axis).abs()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let fit = (f64::from(rect.width()) / extent(axes[0])).min(f64::from(rect.height()) / extent(axes[1])) * 0.94;
        FlatFrame { rect, axes, on_normal, center: view.center, scale: fit * view.zoom.exp(), cut: *cut, space: *space }
    }

    /// The position on the slice at a place of the window, index space.
    pub fn index_at(&self, at: Pos2) -> DVec3 {
        let by = at - self.rect.center();
        let flat = self.center + DVec2::new(f64::from(by.x), -f64::from(by.y)) / self.scale;
        let mut index = self.space.index(self.axes[0] * flat.x + self.axes[1] * flat.y + self.on_normal);
        if let Some(axis) = self.cut.axis() {
            index[axis] = self.cut.position;
        }
        index
    }

    /// Where a position of index space is in the window.
    #[cfg(test)]
    pub fn place(&self, index: DVec3) -> Pos2 {
        let shown = self.space.shown(index);
        let flat = (DVec2::new(shown.dot(self.axes[0]), shown.dot(self.axes[1])) - self.center) * self.scale;
        self.rect.center() + egui::vec2(flat.x as f32, -flat.y as f32)
    }

    /// From index space to clip space.
    pub fn clip_from_index(&self) -> DMat4 {
        let halves = DVec2::new(f64::from(self.rect.width()), f64::from(self.rect.height())) / 2.0;
        let center = self.space.index(self.axes[0] * self.center.x + self.axes[1] * self.center.y + self.on_normal);
        let along = |axis: usize| self.space.index_normal(self.axes[axis]) * self.scale / halves[axis];
        flat_projection(center, along(0), along(1))
    }

    /// The ends of the line where another slice crosses this one, at the edges of the picture; `None` where it does not.
    pub fn line(&self, other: &Cut) -> Option<[Pos2; 2]> {
        let normal = self.space.shown_normal(other.normal);
        let offset = normal.dot(self.space.shown(other.plane(self.space.dims).point) - self.on_normal);
        let across = DVec2::new(normal.dot(self.axes[0]), normal.dot(self.axes[1]));
        let length = across.length();
        if length < 1e-6 {
            return None;
        }
        // The point of the line that is nearest to the middle, and its direction, in points of the window with y up.
        let (across, offset) = (across / length, offset / length);
        let nearest = across * (offset - across.dot(self.center)) * self.scale;
        let along = across.perp();
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        let halves = [f64::from(self.rect.width()) / 2.0, f64::from(self.rect.height()) / 2.0];
        for axis in 0..2 {
            if along[axis].abs() < 1e-9 {
                if nearest[axis].abs() > halves[axis] {
                    return None;
                }
                continue;
            }
            let ends = [-halves[axis], halves[axis]].map(|end| (end - nearest[axis]) / along[axis]);
            (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
        }
        let place = |t: f64| {
            let at = nearest + along * t;
            let center = self.rect.center();
            pos2(center.x + at.x as f32, center.y - at.y as f32)
        };
        (from < to).then(|| [place(from), place(to)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::vec2;

    fn frame() -> GridFrame {
        GridFrame { dims: [100, 60, 40], origin: DVec3::new(5.0, 6.0, 7.0), steps: DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.5)) }
    }

    #[test]
    fn positions_come_back_from_the_window_and_axes_go_the_usual_ways() {
        let space = Space::new(&frame(), DVec3::new(1.0, 1.0, 3.0));
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(300.0, 200.0));
        let view = FlatView { center: DVec2::new(3.0, -4.0), zoom: 0.7 };
        let oblique = Cut::across(0, 50.0).turned(DVec3::new(1.0, 0.5, -0.3), space.dims).expect("a normal");
        for cut in [Cut::across(0, 12.0), Cut::across(1, 3.0), Cut::across(2, 39.0), oblique] {
            let flat = FlatFrame::new(&space, &cut, &view, rect);
            let at = pos2(33.0, 170.0);
            let index = flat.index_at(at);
            assert!(cut.plane(space.dims).distance(index).abs() < 1e-9);
            assert!(flat.place(index).distance(at) < 1e-3);
            let clip = flat.clip_from_index() * index.extend(1.0);
            let expected = [(33.0 - 160.0) / 150.0, (120.0 - 170.0) / 100.0];
            assert!((clip.x - expected[0]).abs() < 1e-6 && (clip.y - expected[1]).abs() < 1e-6, "{clip}");
        }
        let axes = |axis| space.flat_axes(&Cut::across(axis, 1.0));
        assert_eq!([axes(0), axes(1), axes(2)], [[DVec3::Y, DVec3::Z], [DVec3::X, DVec3::Z], [DVec3::X, DVec3::Y]]);
        // A survey: samples go down, crosslines along x, inlines along y.
        let steps = DMat3::from_cols(DVec3::NEG_Z * 4.0, DVec3::X * 25.0, DVec3::Y * 25.0);
        let survey = Space::new(&GridFrame { steps, ..frame() }, DVec3::ONE);
        assert_eq!(survey.flat_axes(&Cut::across(1, 1.0)), [DVec3::Y, DVec3::Z]);
        assert_eq!(survey.flat_axes(&Cut::across(0, 1.0)), [DVec3::X, DVec3::Y]);
        assert_eq!(space.world(DVec3::new(1.0, 2.0, 4.0)), DVec3::new(6.0, 10.0, 9.0));
    }

    #[test]
    fn lines_are_where_slices_cross() {
        let space = Space::new(&frame(), DVec3::ONE);
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(300.0, 200.0));
        let flat = FlatFrame::new(&space, &Cut::across(2, 10.0), &FlatView::default(), rect);
        let [a, b] = flat.line(&Cut::across(0, 30.0)).expect("they cross");
        let expected = flat.place(DVec3::new(30.0, 0.0, 10.0)).x;
        assert!((a.x - expected).abs() < 1e-3 && (b.x - expected).abs() < 1e-3);
        assert_eq!([a.y.min(b.y), a.y.max(b.y)], [20.0, 220.0]);
        assert_eq!(flat.line(&Cut::across(2, 5.0)), None, "parallel");
        let oblique = Cut::across(0, 50.0).turned(DVec3::new(1.0, 1.0, 0.2), space.dims).expect("a normal");
        for end in flat.line(&oblique).expect("they cross") {
            assert!(oblique.plane(space.dims).distance(flat.index_at(end)).abs() < 1e-3);
        }
    }

    #[test]
    fn sheets_are_stretched() {
        let sheet = GridFrame { dims: [1000, 1000, 10], ..GridFrame::along_axes([2; 3], DVec3::ZERO, DVec3::ONE) };
        assert_eq!(Space::first_stretch(&sheet), DVec3::new(1.0, 1.0, 12.5));
        assert_eq!(Space::first_stretch(&frame()), DVec3::ONE);
    }
}
