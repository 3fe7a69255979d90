//! Which pictures are marched, and when: coarsely while the view moves, in parts at rest where the device is slow.

use super::jobs::{Job, Polled, outcome};
use super::pace::divided;
use super::slot::Slot;
use super::stats;
use super::viewer::Viewer;
use crate::gpu::FrameTime;
use crate::render::Scene;
use crate::view::{RenderSettings, RendererKind, View};
use std::sync::Arc;
use std::time::Duration;

/// How long the view counts as moving after its last change.
const MOVING: Duration = Duration::from_millis(250);

/// What width and height of a picture are divided by that the CPU draws before it draws one in full, where that takes long.
const BETWEEN: u32 = 2;

impl Viewer {
    /// The pictures that are to be shown: that of the renderer chosen, and those that are compared.
    pub(super) fn slots(&self) -> Vec<Slot> {
        let chosen = Slot::from(self.kind());
        match self.wipe.slots() {
            Some(slots) => slots.to_vec(),
            None => vec![chosen],
        }
    }

    /// The view of a picture that fills the viewport.
    fn wanted_of(&self, slot: Slot) -> View {
        let view = self.wanted();
        View { settings: RenderSettings { renderer: slot.renderer(), ..view.settings }, ..view }
    }

    /// The view of the octree's picture, as it is measured.
    pub(super) fn view_of_octree(&self) -> View {
        let view = self.exact_view();
        View { settings: RenderSettings { renderer: RendererKind::Octree, ..view.settings }, ..view }
    }

    /// The scene that the device marches for a picture.
    pub(super) fn scene_of(&self, slot: Slot) -> Option<Arc<Scene>> {
        match slot {
            Slot::Octree => self.octree.model.as_ref().map(|model| model.scene.clone()),
            Slot::Kept => self.wipe.kept.as_ref().map(|kept| kept.model.scene.clone()),
            Slot::Exact => self.exact.scene.as_ref().map(|(_, scene)| scene.clone()).filter(|scene| scene.is_on_device()),
        }
    }

    /// Whether a picture is the one asked for, in full.
    pub(super) fn is_shown(&self, slot: Slot) -> bool {
        let marched = self.shown[slot as usize].as_ref() == Some(&self.wanted_of(slot));
        let settings = &self.settings;
        match (slot, &self.exact.scene) {
            (Slot::Octree, _) => marched && self.octree.is_of(&settings.field, &settings.params),
            (Slot::Kept, _) => marched,
            (Slot::Exact, Some((field, scene))) if scene.is_on_device() => marched && *field == settings.field,
            (Slot::Exact, _) => self.exact.complete && self.exact.key == Some((settings.field.clone(), self.exact_view())),
        }
    }

    /// Marches what is not as it is wanted, one picture at a time.
    pub(super) fn march(&mut self, ctx: &egui::Context) {
        match self.viewport.poll() {
            Ok(Some((size, time))) => {
                let marched = self.marching as usize;
                stats::lock(&self.stats).marched(time);
                let (pace, s) = (&mut self.paces[marched], time.gpu_s.unwrap_or(time.wall_s));
                if self.refining_s.is_some() {
                    pace.add_rows(size, s)
                } else {
                    pace.add(size, s)
                }
                // Of a picture marched in parts the sum is shown.
                let before = self.refining_s.unwrap_or(0.0);
                self.frame_times[marched] = Some(FrameTime { wall_s: before + time.wall_s, gpu_s: time.gpu_s.map(|s| before + s) });
                self.refining_s = self.refining_s.map(|before| before + s);
            }
            Ok(None) => {}
            Err(error) => self.fail(error.into()),
        }
        self.take_compiled();
        self.take_drawn(ctx);
        self.take_cut(ctx);
        if self.viewport.is_marching() {
            return ctx.request_repaint();
        }
        let slots = self.slots();
        Slot::ALL.into_iter().filter(|slot| !slots.contains(slot)).for_each(|slot| self.viewport.stop_refining(slot));
        for slot in slots {
            if self.march_slot(ctx, slot) {
                return;
            }
        }
    }

    /// Marches a picture if it is not the one wanted; whether it did.
    fn march_slot(&mut self, ctx: &egui::Context, slot: Slot) -> bool {
        let Some(scene) = self.scene_of(slot).filter(|_| !self.size.contains(&0)) else {
            self.shown[slot as usize] = None;
            if slot == Slot::Exact && self.exact.given {
                self.viewport.show(slot);
            }
            return false;
        };
        let pace = &mut self.paces[slot as usize];
        let moving_for = MOVING.saturating_sub(self.moved.elapsed());
        let divisor =
            if moving_for.is_zero() { 1 } else { pace.moving_divisor(self.size, self.viewport.is_slow() || !scene.is_on_device()) };
        let view = self.wanted_of(slot);
        if divisor > 1 {
            ctx.request_repaint_after(moving_for);
        }
        if self.shown[slot as usize].as_ref().is_some_and(|shown| is_fine_enough(shown, &view, divisor)) {
            self.viewport.show(slot);
            if self.marching == slot
                && let Some(s) = self.refining_s.take()
            {
                self.paces[slot as usize].add(self.size, s);
            }
            return false;
        }
        if !scene.is_on_device() {
            // At rest something finer than what moved is seen before all of it.
            let is_rough = |shown: &View| !is_fine_enough(shown, &view, BETWEEN);
            let first = self.shown[slot as usize].as_ref().is_none_or(is_rough) && self.paces[slot as usize].is_slow(self.size);
            self.draw(ctx, slot, &scene, &view, if divisor == 1 && first { BETWEEN } else { divisor }, !moving_for.is_zero());
            return true;
        }
        if !self.is_compiled(ctx, slot, &scene, &view) {
            return true;
        }
        self.cut(ctx, &scene, &view);
        self.marching = slot;
        stats::lock(&self.stats).march((!moving_for.is_zero()).then_some(divisor));
        let (rows, refining) = (self.paces[slot as usize].rows_at_rest(self.size), self.viewport.is_refining(slot, &view));
        let marched = if divisor > 1 || (rows == self.size[1] && !refining) {
            let mut coarse = view;
            [coarse.settings.width, coarse.settings.height] = divided(self.size, divisor);
            self.refining_s = None;
            self.viewport.march(slot, &self.renderer, &scene, &coarse).map(|()| Some(coarse))
        } else {
            if !refining {
                self.refining_s = Some(0.0);
            }
            self.viewport.refine(slot, &self.renderer, &scene, &view, rows).map(|whole| whole.then_some(view))
        };
        match marched {
            Ok(Some(drawn)) => {
                self.shown[slot as usize] = Some(drawn);
                self.viewport.show(slot);
            }
            Ok(None) => {}
            Err(error) => {
                self.fail(error.into());
                // The same march would only fail again.
                self.shown[slot as usize] = Some(self.wanted_of(slot));
            }
        }
        ctx.request_repaint();
        true
    }

    /// Has the mesh's edges on planes made in the background that a picture is to show; until they are there it is drawn without.
    fn cut(&mut self, ctx: &egui::Context, scene: &Arc<Scene>, view: &View) {
        if self.cutting.is_none() && !self.renderer.has_cut_edges(scene, view) {
            let (renderer, scene, view) = (self.renderer.clone(), scene.clone(), view.clone());
            self.cutting = Some(Job::start(ctx, move |progress, results| {
                progress.begin("cutting the mesh", 0);
                results.give(renderer.cut_edges(&scene, &view).map_err(Into::into));
            }));
        }
    }

    /// Takes note of edges that are made by now: pictures are drawn anew with them.
    fn take_cut(&mut self, ctx: &egui::Context) {
        let Some(ended) = self.cutting.as_ref().map(Job::poll).filter(|ended| !matches!(ended, Polled::Pending)) else { return };
        self.cutting = None;
        match outcome(ended) {
            Ok(_) => {
                for slot in [Slot::Octree, Slot::Kept] {
                    self.shown[slot as usize] = None;
                    self.viewport.stop_refining(slot);
                }
            }
            Err(error) => self.fail(error),
        }
        ctx.request_repaint();
    }

    /// Whether the shaders of a picture are compiled. If not they are, in the background: the picture before stays.
    fn is_compiled(&mut self, ctx: &egui::Context, slot: Slot, scene: &Arc<Scene>, view: &View) -> bool {
        let is_ready = self.renderer.is_ready(scene, view);
        if !is_ready && self.compiling.is_none() {
            let (renderer, scene, view) = (self.renderer.clone(), scene.clone(), view.clone());
            let job = Job::start(ctx, move |progress, results| {
                progress.begin("compiling shaders", 0);
                results.give(renderer.prepare(&scene, &view).map_err(Into::into));
            });
            self.compiling = Some((slot, job));
        }
        is_ready
    }

    /// Takes note of shaders that are compiled by now.
    fn take_compiled(&mut self) {
        let Some((slot, job)) = &self.compiling else { return };
        let (slot, ended) = (*slot, job.poll());
        if matches!(ended, Polled::Pending) {
            return;
        }
        self.compiling = None;
        if let Err(error) = outcome(ended) {
            self.fail(error);
            // The same shaders would only fail again.
            self.shown[slot as usize] = Some(self.wanted_of(slot));
        }
    }
}

/// Whether a picture shown is the one wanted, at the size wanted divided by at most `divisor`.
fn is_fine_enough(shown: &View, wanted: &View, divisor: u32) -> bool {
    let [width, height] = divided([wanted.settings.width, wanted.settings.height], divisor);
    let large = shown.settings.width >= width && shown.settings.height >= height;
    let settings = RenderSettings { width: wanted.settings.width, height: wanted.settings.height, ..shown.settings };
    let full = divisor > 1 || (shown.settings.width, shown.settings.height) == (width, height);
    large && full && settings == wanted.settings && shown.camera == wanted.camera && shown.transfer_function == wanted.transfer_function
}
