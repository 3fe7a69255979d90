//! The octree of the window: being built, built, measured.

use super::jobs::{Job, Polled, discard, outcome};
use super::model::{self, Accuracy, Data, OctreeModel};
use crate::mesh::{BoundarySurface, FieldSelection};
use crate::octree::{OctreeParams, Preset};
use crate::render::Renderer;
use crate::study::ErrorSampling;
use anyhow::Result;
use std::sync::Arc;

/// Seconds that a build may take while a slider is held.
const HELD_S: f64 = 0.3;

/// An octree and what is on its way to it.
pub struct OctreeStage {
    /// What is shown.
    pub model: Option<Arc<OctreeModel>>,
    /// How good that is.
    pub accuracy: Measured,
    /// Whether a slider of the thresholds is held.
    pub held: bool,
    /// Whether another step of a series is soon to be shown: measuring waits.
    pub is_passing: bool,
    /// How that is measured.
    sampling: ErrorSampling,
    /// What the last build was started for, and its thresholds as they were built.
    key: Option<(FieldSelection, OctreeParams)>,
    job: Option<Job<Result<OctreeModel>>>,
    /// The mesh's surface, for octrees of this field.
    surface: Option<(FieldSelection, Arc<BoundarySurface>)>,
    /// Seconds that the last build took that was as deep as asked for.
    full_s: f64,
}

/// The accuracy of the octree that is shown.
pub enum Measured {
    /// Not yet measured: another octree is on its way, or a slider is held.
    Waiting,
    /// Being measured, and what is found so far.
    Running(Job<Result<Accuracy>>, Option<Box<Accuracy>>),
    /// What was found.
    Done(Box<Accuracy>),
    /// It could not be measured.
    Failed,
}

impl Measured {
    /// What is found so far.
    pub fn accuracy(&self) -> Option<&Accuracy> {
        match self {
            Measured::Running(_, found) => found.as_deref(),
            Measured::Done(accuracy) => Some(accuracy),
            Measured::Waiting | Measured::Failed => None,
        }
    }
}

impl OctreeStage {
    /// Nothing yet.
    pub fn new(sampling: ErrorSampling) -> Self {
        OctreeStage {
            model: None,
            accuracy: Measured::Waiting,
            held: false,
            is_passing: false,
            sampling,
            key: None,
            job: None,
            surface: None,
            full_s: 0.0,
        }
    }

    /// Nothing yet, of another mesh.
    pub fn emptied(&self) -> Self {
        Self::new(self.sampling)
    }

    /// Takes an octree that was built elsewhere, and what for.
    pub fn adopt(&mut self, model: Arc<OctreeModel>, key: (FieldSelection, OctreeParams)) {
        self.surface = model.surface.clone().map(|surface| (model.field.clone(), surface));
        discard(self.model.replace(model));
        (self.key, self.job, self.accuracy) = (Some(key), None, Measured::Waiting);
    }

    /// Takes what jobs have given and starts what is due; `Ok(true)` once the octree is another. With `build` the octree that these settings
    /// ask for is built, if it is not this one.
    pub fn run(
        &mut self,
        ctx: &egui::Context,
        renderer: &Arc<Renderer>,
        data: &Data,
        (field, params): (&FieldSelection, &OctreeParams),
        build: bool,
    ) -> Result<bool> {
        let key = (field.clone(), self.affordable(params));
        // A build that is started anew at each move of a slider would never be seen.
        let goes_on = self.held && self.job.is_some();
        if build && !goes_on && self.key.as_ref() != Some(&key) {
            self.start(ctx, renderer, data, key);
        }
        let taken = self.take(params);
        self.measure(ctx, data)?;
        taken
    }

    /// Whether the octree is the one that these settings ask for and nothing is on its way, its measurement aside.
    pub fn is_of(&self, field: &FieldSelection, params: &OctreeParams) -> bool {
        self.job.is_none() && self.key.as_ref().is_some_and(|key| key.0 == *field && key.1 == *params)
    }

    /// What a build on its way does.
    pub fn progress(&self) -> Option<(&'static str, Option<f32>)> {
        self.job.as_ref().map(Job::progress)
    }

    /// The thresholds to build with: while a slider is held, of an octree that takes long, no deeper than for a first look.
    fn affordable(&self, params: &OctreeParams) -> OctreeParams {
        let deepest = if self.held && self.full_s > HELD_S { Preset::Fast.params().max_depth } else { u8::MAX };
        OctreeParams { max_depth: params.max_depth.min(deepest), ..params.clone() }
    }

    fn start(&mut self, ctx: &egui::Context, renderer: &Arc<Renderer>, data: &Data, key: (FieldSelection, OctreeParams)) {
        if matches!(self.accuracy, Measured::Running(..)) {
            self.accuracy = Measured::Waiting;
        }
        let surface = self.surface.clone().filter(|(field, _)| *field == key.0).map(|(_, surface)| surface);
        let (renderer, data, (field, params)) = (renderer.clone(), data.clone(), key.clone());
        self.job = Some(Job::start(ctx, move |progress, results| {
            results.give(model::build_octree(&renderer, &data, &field, &params, surface, progress));
        }));
        self.key = Some(key);
    }

    fn take(&mut self, wanted: &OctreeParams) -> Result<bool> {
        let ended = match self.job.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => return Ok(false),
            Some(ended) => ended,
        };
        self.job = None;
        let model = outcome(ended)?;
        if model.params.max_depth == wanted.max_depth {
            self.full_s = model.build_s;
        }
        if let Some(surface) = &model.surface {
            self.surface = Some((model.field.clone(), surface.clone()));
        }
        discard(self.model.replace(Arc::new(model)));
        self.accuracy = Measured::Waiting;
        Ok(true)
    }

    fn measure(&mut self, ctx: &egui::Context, data: &Data) -> Result<()> {
        match &mut self.accuracy {
            Measured::Done(_) | Measured::Failed => {}
            Measured::Waiting => {
                let (Some(model), None, false) = (&self.model, &self.job, self.held || self.is_passing) else { return Ok(()) };
                let (data, model, sampling) = (data.clone(), model.clone(), self.sampling);
                let job = Job::start(ctx, move |progress, results| {
                    let measured = model::measure(&data, &model, &sampling, progress, |accuracy| results.give(Ok(accuracy)));
                    measured.unwrap_or_else(|error| results.give(Err(error)));
                });
                self.accuracy = Measured::Running(job, None);
            }
            Measured::Running(job, found) => match job.poll() {
                Polled::Pending => {}
                Polled::Result(Ok(accuracy)) if !accuracy.is_complete => *found = Some(Box::new(accuracy)),
                ended => {
                    self.accuracy = Measured::Failed; // unless it was not
                    self.accuracy = Measured::Done(Box::new(outcome(ended)?));
                }
            },
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_slider_builds_no_deeper_than_fast_what_takes_long() {
        let asked = Preset::Fine.params();
        let mut stage = OctreeStage::new(ErrorSampling::default());
        stage.full_s = 2.0 * HELD_S;
        assert_eq!(stage.affordable(&asked), asked, "at rest all that is asked for");
        stage.held = true;
        assert_eq!(stage.affordable(&asked), OctreeParams { max_depth: 7, ..asked.clone() });
        let shallow = OctreeParams { max_depth: 3, ..asked.clone() };
        assert_eq!(stage.affordable(&shallow), shallow);
        stage.full_s = 0.5 * HELD_S;
        assert_eq!(stage.affordable(&asked), asked, "quick enough in full");
    }
}
