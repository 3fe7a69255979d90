//! What is seen at a place of the picture.

use super::model::{Data, OctreeModel};
use super::viewer::Viewer;
use super::widgets::significant;
use crate::cpu::{self, PickedWhat};
use crate::geometry::Placed;
use crate::optics::Classifier;
use crate::view::View;
use egui::{Pos2, Rect};
use glam::DVec3;

/// What is seen at a pixel of a view: where, in world coordinates, and what it is.
pub fn pick(octree: &OctreeModel, data: &Data, view: &View, pixel: [u32; 2]) -> Option<(DVec3, PickedWhat)> {
    let (center, diagonal) = (data.center(), data.bounds().diagonal());
    let classifier = Classifier::new(&view.transfer_function, octree.value_range, diagonal);
    let [width, height] = [view.settings.width.max(1), view.settings.height.max(1)];
    let frame = view.camera.frame(center, width, height).with_planes(&view.settings.planes, center);
    let texture = octree.scene.texture()?;
    let picked = cpu::pick(texture, octree.surface.as_deref(), &frame, pixel, &classifier, &view.settings)?;
    Some((picked.at + center, picked.what))
}

/// What it is, in words; nothing of the volume's light, which needs none.
pub fn in_words(what: PickedWhat) -> String {
    match what {
        PickedWhat::Light => String::new(),
        PickedWhat::Isosurface(value) => format!("isosurface {}", significant(value)),
        PickedWhat::Cut(number) => format!("cut plane {}", number + 1),
        PickedWhat::Face => "boundary face".into(),
        PickedWhat::Largest => "largest value".into(),
        PickedWhat::Smallest => "smallest value".into(),
        PickedWhat::Middle => "middle of the ray".into(),
    }
}

impl Viewer {
    /// The pixel of the picture at a place in the window.
    pub(super) fn pixel_at(&self, rect: Rect, at: Pos2) -> [u32; 2] {
        let (at, size) = ((at - rect.min) * self.pixels_per_point as f32, self.picture_size());
        [(at.x.max(0.0) as u32).min(size[0].saturating_sub(1)), (at.y.max(0.0) as u32).min(size[1].saturating_sub(1))]
    }

    /// How far along a ray in world coordinates through a place in the window lies what is seen there.
    pub(super) fn seen_along(&self, rect: Rect, at: Pos2, (origin, direction): (DVec3, DVec3)) -> Option<f64> {
        let octree = self.octree.model.as_ref()?;
        let (seen, _) = pick(octree, &self.document.data, &self.wanted(), self.pixel_at(rect, at))?;
        Some((seen - origin).dot(direction)).filter(|t| *t > 0.0)
    }
}
