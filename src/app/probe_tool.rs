//! The probe of the window: what is under the pointer, pinned labels, a line, and what they are read from.

use super::jobs::{Job, Polled, outcome};
use super::model::{Data, OctreeModel};
use super::picked::pick;
use crate::cpu::PickedWhat;
use crate::mesh::{FieldSelection, Locator};
use crate::octree::Subject;
use crate::progress::Progress;
use crate::study::probe::{LineSamples, Probe, Sample};
use crate::view::View;
use anyhow::{Context, Result};
use glam::DVec3;
use std::sync::Arc;

/// Samples along a line.
pub const LINE_SAMPLES: usize = 1001;

/// What a click does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProbeKind {
    /// Pins a label.
    #[default]
    Point,
    /// Sets an end of the line.
    Line,
}

/// A label that stays.
#[derive(Debug, Clone, PartialEq)]
pub struct Pin {
    /// What it is called.
    pub number: usize,
    /// Its place, world coordinates.
    pub at: DVec3,
    /// What is there, once it is known.
    pub sample: Option<Sample>,
}

/// The state of the probe.
#[derive(Default)]
pub struct ProbeTool {
    /// Whether the pointer probes.
    pub is_on: bool,
    /// What a click does.
    pub kind: ProbeKind,
    /// Pinned labels, in the order of their numbers.
    pub pins: Vec<Pin>,
    /// The ends of the line as far as they are set.
    pub ends: Vec<DVec3>,
    /// What is along the line.
    pub profile: Option<LineSamples>,
    /// What is under the pointer, and for what that was found.
    hovered: Option<(Hover, Option<Hovered>)>,
    source: Option<Arc<Source>>,
    preparing: Option<Job<Result<Source>>>,
    measuring: Option<Job<Result<LineSamples>>>,
    /// What the profile is of, and what the pins were read from.
    profile_of: Option<(Vec<DVec3>, Reading)>,
    pins_of: Option<(usize, Reading)>,
    last_number: usize,
}

/// The field that is read, and what finds its cells.
struct Source {
    field: FieldSelection,
    subject: Subject,
    locator: Option<Arc<Locator>>,
}

/// A source and an octree, by where they lie: what was read from them is read anew when either is another.
type Reading = (usize, usize);

/// What is under the pointer: its values, and what of the picture it is.
pub type Hovered = (Sample, PickedWhat);

/// What decides what is under the pointer.
#[derive(PartialEq)]
struct Hover {
    pixel: [u32; 2],
    view: View,
    reading: Reading,
}

impl ProbeTool {
    /// The probe of another document: on or off as before, without marks.
    pub fn emptied(&self) -> Self {
        ProbeTool { is_on: self.is_on, kind: self.kind, ..Self::default() }
    }

    /// The data are others: what is marked is read anew.
    pub fn read_anew(&mut self) {
        (self.source, self.preparing, self.measuring, self.hovered) = (None, None, None, None);
        (self.pins_of, self.profile_of) = (None, None);
    }

    /// The same marks, whose values are to be read anew from data that have changed.
    pub fn of_new_data(self) -> Self {
        let pins = self.pins.into_iter().map(|pin| Pin { sample: None, ..pin }).collect();
        let (is_on, kind, ends, last_number) = (self.is_on, self.kind, self.ends, self.last_number);
        ProbeTool { is_on, kind, pins, ends, last_number, ..Self::default() }
    }

    /// Whether there is anything to read.
    fn is_needed(&self) -> bool {
        self.is_on || !self.pins.is_empty() || self.ends.len() == 2
    }

    /// What is on its way.
    pub fn progress(&self) -> Option<(&'static str, Option<f32>)> {
        self.preparing.as_ref().map(Job::progress).or_else(|| self.measuring.as_ref().map(Job::progress))
    }

    /// Whether values can be read yet.
    pub fn is_ready(&self) -> bool {
        self.source.is_some()
    }

    /// Takes what jobs have given and starts what is due.
    pub fn run(&mut self, ctx: &egui::Context, data: &Data, field: &FieldSelection, octree: Option<&Arc<OctreeModel>>) -> Result<()> {
        if let Some(ended) = ended(&mut self.preparing) {
            match outcome(ended) {
                Ok(source) => self.source = Some(Arc::new(source)),
                Err(error) => {
                    *self = Self::default(); // the same would only fail again
                    return Err(error);
                }
            }
        }
        if let Some(ended) = ended(&mut self.measuring) {
            self.profile = Some(outcome(ended)?);
        }
        // What is on its way is taken also where it is of no use any more.
        if !self.is_needed() {
            return Ok(());
        }
        let is_right = |of: &FieldSelection| of == field;
        if !self.source.as_ref().is_some_and(|source| is_right(&source.field)) {
            if self.preparing.is_none() {
                self.prepare(ctx, data.clone(), field.clone());
            }
            return Ok(());
        }
        let (Some(source), Some(octree)) = (self.source.clone(), octree) else { return Ok(()) };
        if octree.field != *field {
            return Ok(()); // another is on its way
        }
        let reading = reading(&source, octree);
        if self.pins_of != Some((self.last_number, reading)) {
            let probe = source.probe(octree)?;
            self.pins.iter_mut().for_each(|pin| pin.sample = Some(probe.at(pin.at)));
            self.pins_of = Some((self.last_number, reading));
        }
        if self.ends.len() == 2 && self.profile_of.as_ref() != Some(&(self.ends.clone(), reading)) {
            let (ends, octree) = ([self.ends[0], self.ends[1]], octree.clone());
            self.profile_of = Some((self.ends.clone(), reading));
            self.measuring = Some(Job::start(ctx, move |progress, results| {
                let along = || Ok(source.probe(&octree)?.along(ends, LINE_SAMPLES, progress)?);
                results.give(along());
            }));
        }
        Ok(())
    }

    fn prepare(&mut self, ctx: &egui::Context, data: Data, field: FieldSelection) {
        let locator = self.source.take().and_then(|source| source.locator.clone());
        self.preparing = Some(Job::start(ctx, move |progress, results| results.give(Source::new(&data, field, locator, progress))));
    }

    /// What is seen at a pixel of a view; `None` where nothing is, and before values can be read.
    pub fn hover(&mut self, pixel: [u32; 2], view: &View, data: &Data, octree: &Arc<OctreeModel>) -> Option<Hovered> {
        let source = self.source.clone().filter(|source| source.field == octree.field)?;
        let reading = reading(&source, octree);
        let hover = Hover { pixel, view: view.clone(), reading };
        if let Some((of, hovered)) = &self.hovered
            && *of == hover
        {
            return *hovered;
        }
        let picked = pick(octree, data, view, pixel);
        let hovered = picked.and_then(|(at, what)| Some((source.probe(octree).ok()?.at(at), what)));
        self.hovered = Some((hover, hovered));
        hovered
    }

    /// A click on what is at a place: pins it or sets an end of the line; a third end begins a new line.
    pub fn click(&mut self, at: DVec3) {
        match self.kind {
            ProbeKind::Point => {
                self.last_number += 1;
                self.pins.push(Pin { number: self.last_number, at, sample: None });
            }
            ProbeKind::Line if self.ends.len() < 2 => self.ends.push(at),
            ProbeKind::Line => {
                self.clear_line();
                self.ends.push(at);
            }
        }
    }

    /// Takes the line away.
    pub fn clear_line(&mut self) {
        (self.ends, self.profile, self.profile_of, self.measuring) = (vec![], None, None, None);
    }
}

impl Source {
    fn new(data: &Data, field: FieldSelection, locator: Option<Arc<Locator>>, progress: &Progress) -> Result<Self> {
        let subject = data.subject(&field)?;
        let locator = match (&subject, locator) {
            (_, Some(locator)) => Some(locator),
            (Subject::Mesh(mesh, _), None) => Some(Arc::new(Locator::new(mesh, progress)?)),
            (Subject::Volume(_), None) => None,
        };
        Ok(Source { field, subject, locator })
    }

    fn probe<'a>(&'a self, octree: &'a OctreeModel) -> Result<Probe<'a>> {
        let texture = octree.scene.texture().context("the scene is no octree's")?;
        Ok(Probe { subject: &self.subject, locator: self.locator.as_deref(), texture, boundary: octree.params.boundary })
    }
}

fn reading(source: &Arc<Source>, octree: &Arc<OctreeModel>) -> Reading {
    (Arc::as_ptr(source) as usize, Arc::as_ptr(octree) as usize)
}

/// What a job has given, if it has; the job is then over.
fn ended<T>(job: &mut Option<Job<T>>) -> Option<Polled<T>> {
    match job.as_ref()?.poll() {
        Polled::Pending => None,
        ended => {
            *job = None;
            Some(ended)
        }
    }
}
