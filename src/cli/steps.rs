//! Flags for time series, and the step that they choose.

use super::args::{MeshArgs, RawArgs, parse_number};
use super::render::note;
use crate::format::Series;
use crate::session::Source;
use anyhow::{Result, bail};
use clap::Args;
use std::path::Path;

/// Which step of a series.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Time series")]
pub struct StepArgs {
    /// The step of a series whose time is the nearest [default: the first step, of an OpenFOAM case the last]
    #[arg(long, value_name = "T", value_parser = parse_time, allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// The step of a series by its number, from 0
    #[arg(long, value_name = "N", conflicts_with = "time")]
    pub time_step: Option<usize>,
    /// The series, once a step is chosen.
    #[arg(skip)]
    pub chosen: Option<Chosen>,
}

/// A series and a step of it.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// All steps.
    pub series: Series,
    /// The number of the one chosen.
    pub step: usize,
    /// What the series was named by.
    source: Source,
}

impl MeshArgs {
    /// If a series is named, chooses its step: from here on the mesh is that step's file.
    pub fn choose_step(&mut self) -> Result<()> {
        let named = Source { file: self.mesh.clone(), more: std::mem::take(&mut self.more), ..Source::default() };
        let Some(series) = named.series()? else {
            if self.steps.time.is_some() || self.steps.time_step.is_some() {
                bail!("{}: --time and --time-step choose a step of a series; this is a single file", self.shown_name());
            }
            return Ok(());
        };
        if let Some(solution) = &self.solution {
            bail!(
                "{}: each step of a series has a solution of its own, beside its grid; name the series of the solutions",
                solution.display()
            );
        }
        let step = self.step_of(&series)?;
        self.mesh = Some(series.steps()[step].path.clone());
        self.steps.chosen = Some(Chosen { series, step, source: named });
        Ok(())
    }

    fn step_of(&self, series: &Series) -> Result<usize> {
        let (count, [first, last]) = (series.steps().len(), series.span());
        let has = || format!("{}: has {count} steps, times {first} to {last}", self.shown_name());
        match (self.steps.time_step, self.steps.time) {
            (Some(step), _) if step >= count => bail!("{}; there is no step {step}, expected 0 to {}", has(), count - 1),
            (Some(step), _) => Ok(step),
            (None, Some(time)) => {
                let Some(step) = series.nearest(time) else { bail!("{}; {time} is not among them", has()) };
                let nearest = series.steps()[step].time;
                if nearest != time {
                    note(&format!("there is no step at {time}; the nearest is step {step} at {nearest}"));
                }
                Ok(step)
            }
            (None, None) => Ok(series.shown_first()),
        }
    }

    /// The series, if one is named and its step was chosen.
    pub fn series(&self) -> Option<&Series> {
        self.steps.chosen.as_ref().map(|chosen| &chosen.series)
    }

    /// What the series was named by, if that is a file.
    pub fn list(&self) -> Option<&Path> {
        self.steps.chosen.as_ref()?.source.file.as_deref()
    }

    /// Where the data comes from, as a session has it.
    pub fn source(&self, volume: &RawArgs) -> Source {
        let (raw, segy) = (volume.layout(), volume.segy.options());
        match &self.steps.chosen {
            Some(Chosen { step, source, .. }) => Source { step: Some(*step), raw, segy, ..source.clone() },
            None => Source { file: self.mesh.clone(), solution: self.solution.clone(), raw, segy, ..Source::default() },
        }
    }
}

fn parse_time(text: &str) -> Result<f64, String> {
    parse_number(text, |_| true, "a number")
}
