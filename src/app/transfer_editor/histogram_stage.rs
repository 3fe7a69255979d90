//! How often values occur, counted in the background.

use super::super::jobs::{Job, Polled, outcome};
use super::super::model::{self, Data};
use crate::mesh::FieldSelection;
use crate::study::{Bins, Histogram};
use crate::view::Scale;
use anyhow::Result;

/// Bins over the range of the transfer function, and over all of the data.
const COUNTS: [usize; 2] = [138, 138];

/// Of what there are histograms.
type Key = (FieldSelection, [Bins; 2]);

/// Histograms and what is on its way to them.
#[derive(Default)]
pub struct HistogramStage {
    key: Option<Key>,
    job: Option<Job<Result<[Histogram; 2]>>>,
    /// Heights of bars in [0, 1] over the range, on its scale, and over all of the data.
    heights: [Vec<f32>; 2],
}

impl HistogramStage {
    /// Heights of bars in [0, 1], of equal widths over the transfer function's x.
    pub fn over_range(&self) -> &[f32] {
        &self.heights[0]
    }

    /// Heights of bars in [0, 1], of equal widths over the data's range.
    pub fn over_all(&self) -> &[f32] {
        &self.heights[1]
    }

    /// Counts the same anew: the data are others.
    pub fn recount(&mut self) {
        self.key = None;
    }

    /// Takes what was counted, and counts anew if the field or the range is another. While it counts the old bars stay.
    pub fn run(
        &mut self,
        ctx: &egui::Context,
        data: &Data,
        field: &FieldSelection,
        range: [f64; 2],
        scale: Scale,
        data_range: [f64; 2],
    ) -> Result<()> {
        match self.job.as_ref().map(Job::poll) {
            Some(Polled::Pending) => return Ok(()), // a range that is being dragged is not to be counted from the beginning at each step
            Some(ended) => {
                self.job = None;
                self.heights = outcome(ended)?.map(|histogram| histogram.log_heights());
            }
            None => {}
        }
        let bins = [Bins { range, count: COUNTS[0], scale }, Bins { range: data_range, count: COUNTS[1], scale: Scale::Linear }];
        let key = (field.clone(), bins);
        if self.key.as_ref() != Some(&key) {
            let (data, field) = (data.clone(), field.clone());
            self.job = Some(Job::start(ctx, move |progress, results| results.give(model::histograms(&data, &field, bins, progress))));
            self.key = Some(key);
        }
        Ok(())
    }
}
