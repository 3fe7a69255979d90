//! Pictures of octrees that the CPU draws in the background, where the adapter computes on the CPU as well and takes longer.

use super::jobs::{Job, Polled, outcome};
use super::pace::divided;
use super::slot::Slot;
use super::stats;
use super::viewer::Viewer;
use crate::gpu::FrameTime;
use crate::render::{Picture, Scene};
use crate::view::View;
use anyhow::Result;
use std::sync::Arc;

/// A picture on its way.
pub(super) struct Drawing {
    slot: Slot,
    scene: Arc<Scene>,
    view: View,
    /// Whether it takes longer than a moving view waits.
    is_long: bool,
    job: Job<Result<Picture>>,
}

impl Drawing {
    fn is_of(&self, slot: Slot, scene: &Arc<Scene>) -> bool {
        self.slot == slot && Arc::ptr_eq(&self.scene, scene)
    }
}

impl Viewer {
    /// Draws a picture with width and height divided, unless one is drawn.
    pub(super) fn draw(&mut self, ctx: &egui::Context, slot: Slot, scene: &Arc<Scene>, wanted: &View, divisor: u32, is_moving: bool) {
        let mut view = wanted.clone();
        [view.settings.width, view.settings.height] = divided(self.size, divisor);
        // A quick one is seen even if the view moves on, lest a moving view never be; another one is given up.
        let goes_on = |drawing: &Drawing| drawing.is_of(slot, scene) && (!drawing.is_long || drawing.view == view);
        if self.drawing.as_ref().is_some_and(goes_on) {
            return;
        }
        stats::lock(&self.stats).march(is_moving.then_some(divisor));
        let (renderer, of, drawn) = (self.renderer.clone(), scene.clone(), view.clone());
        let job = Job::start(ctx, move |progress, results| results.give(renderer.render(&of, &drawn, progress).map_err(Into::into)));
        let is_long = divisor < self.paces[slot as usize].moving_divisor(self.size, true);
        self.drawing = Some(Drawing { slot, scene: scene.clone(), view, is_long, job });
    }

    /// Shows a picture that was drawn.
    pub(super) fn take_drawn(&mut self, ctx: &egui::Context) {
        let Some(ended) = self.drawing.as_ref().map(|drawing| drawing.job.poll()).filter(|ended| !matches!(ended, Polled::Pending)) else {
            return;
        };
        let Some(drawing) = self.drawing.take() else { return };
        // Of another octree since.
        if !self.scene_of(drawing.slot).is_some_and(|scene| drawing.is_of(drawing.slot, &scene)) {
            return;
        }
        let Drawing { slot, view, .. } = drawing;
        let shown = outcome(ended).and_then(|picture| {
            let time = FrameTime { wall_s: picture.wall_s, gpu_s: None };
            stats::lock(&self.stats).marched(time);
            self.paces[slot as usize].add([view.settings.width, view.settings.height], picture.wall_s);
            self.frame_times[slot as usize] = Some(time);
            Ok(self.viewport.put(slot, &picture.image)?)
        });
        // A view that cannot be drawn would only fail again.
        self.shown[slot as usize] = Some(view);
        match shown {
            Ok(()) if self.slots().contains(&slot) => self.viewport.show(slot),
            Ok(()) => {}
            Err(error) => self.fail(error),
        }
        ctx.request_repaint();
    }
}
