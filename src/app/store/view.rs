//! One of the four pictures: its place, what is drawn in it, and when.

use super::super::projector::Projector;
use super::super::viewport::painted;
use super::cut::Cut;
use super::space::{FlatFrame, Space};
use crate::bricks::screen::SeenSlice;
use crate::gpu::{DrawnSlice, GpuError, SlicePainter, SlicePicture, SliceStyle};
use crate::view::{Camera, Projection};
use egui::{Color32, Rect, pos2, vec2};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Width of the line where a slice ends, pixels, in space.
const BORDER: f32 = 1.6;

/// Near things end at this share of the distance to what the camera looks at.
const NEAR: f64 = 1e-4;

/// The picture in space, by its number among the four; the flat ones are 0, 1, 2.
pub const SPATIAL: usize = 3;

/// The gap between pictures, points.
const GAP: f32 = 2.0;

/// The pictures' places with what is above them, by number: all four, or the one that has all the room.
pub fn places(whole: Rect, maximised: Option<usize>) -> Vec<(usize, Rect)> {
    if let Some(number) = maximised {
        return vec![(number, whole)];
    }
    let half = (whole.size() - vec2(GAP, GAP)) / 2.0;
    let at = |x: f32, y: f32| Rect::from_min_size(pos2(whole.left() + x * (half.x + GAP), whole.top() + y * (half.y + GAP)), half);
    vec![(0, at(0.0, 0.0)), (SPATIAL, at(1.0, 0.0)), (1, at(0.0, 1.0)), (2, at(1.0, 1.0))]
}

/// A picture on the device.
#[derive(Default)]
pub struct View {
    picture: Option<SlicePicture>,
    texture: Option<egui::TextureId>,
    /// What it shows.
    drawn: Option<(Vec<DrawnSlice>, SliceStyle, u64)>,
}

/// What is drawn in a picture.
pub struct Scene {
    /// Its place in the window, on whole pixels.
    pub rect: Rect,
    /// Width and height in pixels of the window.
    pub pixels: [u32; 2],
    /// What these are divided by.
    pub divisor: u32,
    /// The slices.
    pub slices: Vec<DrawnSlice>,
}

impl Scene {
    /// Of one slice, seen straight on.
    pub fn flat(frame: &FlatFrame, cut: &Cut, space: &Space, is_whole: bool, points: f32) -> Self {
        let plane = cut.plane(space.dims);
        let slice = DrawnSlice { plane, clip_from_index: frame.clip_from_index(), is_whole, border: None, opacity: 1.0 };
        Scene { rect: frame.rect, pixels: pixels(frame.rect, points), divisor: 1, slices: vec![slice] }
    }

    /// Of slices in space.
    pub fn space(rect: Rect, camera: &Camera, cuts: &[Cut], space: &Space, is_whole: bool, points: f32) -> Self {
        let clip_from_index = clip_from_shown(camera, rect, space.bounds().diagonal()) * space.matrix();
        let slices = cuts.iter().filter(|cut| cut.is_shown).map(|cut| {
            let [r, g, b, _] = cut.color().to_array().map(|v| f32::from(v) / 255.0);
            let border = Some((BORDER * points, [r, g, b, 1.0]));
            DrawnSlice { plane: cut.plane(space.dims), clip_from_index, is_whole, border, opacity: 1.0 }
        });
        Scene { rect, pixels: pixels(rect, points), divisor: 1, slices: slices.collect() }
    }

    /// The same in coarser pixels.
    pub fn coarser(mut self, divisor: u32) -> Self {
        self.divisor = divisor.max(1);
        for (width, _) in self.slices.iter_mut().filter_map(|slice| slice.border.as_mut()) {
            *width /= self.divisor as f32;
        }
        self
    }

    /// What the slices ask for, in the pixels of the window.
    pub fn seen(&self) -> impl Iterator<Item = SeenSlice> {
        let pixels = DVec2::from(self.pixels.map(f64::from));
        self.slices.iter().map(move |slice| SeenSlice {
            plane: slice.plane,
            clip_from_index: slice.clip_from_index,
            pixels,
            is_whole: slice.is_whole,
        })
    }
}

fn pixels(rect: Rect, points: f32) -> [u32; 2] {
    [rect.width(), rect.height()].map(|n| (n * points).round().clamp(1.0, 16384.0) as u32)
}

/// A camera's projection with a depth that falls from 1 near the eye to 0 far away: floats are finest near 0.
pub fn clip_from_shown(camera: &Camera, rect: Rect, diagonal: f64) -> DMat4 {
    let mut rows = Projector::new(camera, DVec3::ZERO, rect).clip_from_data().transpose();
    let distance = camera.eye.distance(camera.target);
    rows.z_axis = match camera.projection {
        Projection::Perspective { .. } => DVec4::W * (NEAR * distance),
        Projection::Parallel { .. } => {
            let [forward, ..] = camera.axes();
            let slope = -0.5 / (distance + 2.0 * diagonal);
            (forward * slope).extend(0.75 - slope * forward.dot(camera.eye))
        }
    };
    rows.transpose()
}

impl View {
    /// Draws the scene where it, the look or the bricks have changed; whether it did.
    pub fn draw(
        &mut self,
        window: &egui_wgpu::RenderState,
        painter: &mut SlicePainter,
        stream: &mut super::stream::Stream,
        style: &SliceStyle,
        scene: &Scene,
    ) -> Result<bool, GpuError> {
        let version = stream.version();
        let (context, pool) = stream.pool();
        let size = scene.pixels.map(|n| n.div_ceil(scene.divisor));
        if self.picture.as_ref().is_none_or(|picture| picture.size() != size) {
            let picture = SlicePicture::new(context, size)?;
            self.texture = Some(painted(window, &picture, scene.divisor > 1, self.texture));
            (self.picture, self.drawn) = (Some(picture), None);
        }
        let is_drawn = self.drawn.as_ref().is_some_and(|drawn| drawn.0 == scene.slices && drawn.1 == *style && drawn.2 == version);
        let Some(picture) = self.picture.as_ref().filter(|_| !is_drawn) else { return Ok(false) };
        painter.draw(context, pool, style, &scene.slices, picture)?;
        self.drawn = Some((scene.slices.clone(), style.clone(), version));
        Ok(true)
    }

    /// Paints it.
    pub fn paint(&self, painter: &egui::Painter, rect: Rect) {
        if let Some(texture) = self.texture {
            painter.image(texture, rect, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_falls_with_the_distance() {
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(200.0, 100.0));
        for projection in [Projection::Perspective { fov_y_degrees: 30.0 }, Projection::Parallel { view_height: 10.0 }] {
            let camera = Camera { eye: DVec3::X * 50.0, target: DVec3::ZERO, up: DVec3::Z, projection };
            let clip = clip_from_shown(&camera, rect, 20.0);
            let depth = |x: f64| {
                let at = clip * DVec4::new(x, 1.0, 1.0, 1.0);
                at.z / at.w
            };
            let depths = [10.0, 5.0, 0.0, -10.0].map(depth);
            assert!(depths.windows(2).all(|pair| pair[0] > pair[1] && pair[1] > 0.0) && depths[0] < 1.0, "{depths:?}");
        }
    }
}
