//! A picture of every step of a series, and colours that stand for the same values in all of them.

use super::{RenderCommand, ViewFiles, say_if_fallen_back, say_what_is_not_seen};
use crate::cli::long_work::with_bar;
use crate::cli::report::Report;
use crate::cli::subject::{read_options, read_subject};
use crate::format::series::Step;
use crate::geometry::Placed;
use crate::image::{Background, Template, write_png};
use crate::mesh::FieldSelection;
use crate::octree::Subject;
use crate::render::Renderer;
use crate::study::over_time::range_over;
use crate::view::View;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Values of `--range-over`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RangeOver {
    /// All steps: each is read.
    Time,
    /// Each step by itself.
    Step,
}

impl RenderCommand {
    /// The files of the pictures of every step, if these are asked for: the output's name has a place for their numbers, and no flag chooses
    /// a step or a way of the camera.
    pub(super) fn every_step(&self) -> Result<Option<Vec<PathBuf>>> {
        let (Some(series), Some(output)) = (self.mesh.series(), &self.output) else { return Ok(None) };
        let chooses = self.session.gives(&["time", "time_step"]) || self.sequence.turntable.is_some() || self.sequence.frames.is_some();
        let Some(template) = Template::new(output).ok().filter(|_| !chooses) else { return Ok(None) };
        if [&self.raw, &self.value, &self.depth, &self.stats].into_iter().any(Option::is_some) {
            bail!("--raw, --value, --depth and --stats are of one picture; a series has many: choose a step with --time or --time-step");
        }
        Ok(Some(template.paths(series.steps().len().try_into().context("so many steps")?).collect()))
    }

    /// Draws each step into a file of its own. The camera and all that a first step decides stay.
    pub(super) fn draw_steps(mut self, pictures: &[PathBuf], files: ViewFiles) -> Result<()> {
        let steps: Vec<Step> = self.mesh.series().map_or(vec![], |series| series.steps().to_vec());
        // Before the first is drawn.
        if let Some(step) = steps.iter().find(|step| !step.path.is_file()) {
            bail!("{}: is not there; the series has it at {}", step.path.display(), step.time);
        }
        let inputs: HashSet<PathBuf> = steps.iter().filter_map(|step| step.path.canonicalize().ok()).collect();
        if let Some(over) = pictures.iter().find(|path| path.canonicalize().is_ok_and(|path| inputs.contains(&path))) {
            bail!("{}: is a step of the series, an output would overwrite it", over.display());
        }
        let renderer = Renderer::new(self.view.device.into())?;
        say_if_fallen_back(&renderer);
        let mut view = None;
        for (written, (step, picture)) in steps.iter().zip(pictures).enumerate() {
            self.mesh.mesh = Some(step.path.clone());
            let drawn = self.draw_step(&renderer, &mut view, &files, picture);
            if drawn.is_err() && with_bar(|progress| progress.check()).is_err() {
                bail!("stopped; {written} of {} pictures are written", pictures.len());
            }
            drawn?;
        }
        Ok(())
    }

    /// Draws the step whose file is the mesh's; the first makes the view.
    fn draw_step(&mut self, renderer: &Renderer, view: &mut Option<View>, files: &ViewFiles, picture: &Path) -> Result<()> {
        let subject = read_subject(&self.mesh, &self.volume)?;
        self.mesh.array.get_or_insert_with(|| subject.array().to_owned());
        let view = match view {
            Some(view) => view,
            None => {
                let mut first = self.view.view(&subject, files.clone());
                // As much of it as of the first, whatever the bounds of the others.
                let unit = first.transfer_function.unit_distance_world(subject.bounds().diagonal());
                first.transfer_function.unit_distance = Some(unit);
                self.fix_range(&mut first, &subject, RangeOver::Time)?;
                say_what_is_not_seen(&first, &subject);
                view.insert(first)
            }
        };
        view.transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        let mut report = Report::new(&subject, 0.0);
        let scene = self.scene(renderer, &subject, &mut report)?;
        let mut drawn = with_bar(|progress| renderer.render(&scene, view, progress))?;
        self.furnish(&mut drawn.image, &subject, view);
        let background = if self.transparent { Background::Transparent } else { Background::Color(self.background) };
        Ok(write_png(picture, &drawn.image, background)?)
    }

    /// Has the colours span the values of all steps, if that is asked for, `default` if nothing is, and nothing else says what they span.
    pub(super) fn fix_range(&self, view: &mut View, subject: &Subject, default: RangeOver) -> Result<()> {
        let Some(series) = self.mesh.series() else {
            if self.range_over.is_some() {
                bail!("{}: --range-over is for the steps of a series; this is a single file", self.mesh.shown_name());
            }
            return Ok(());
        };
        if self.range_over.unwrap_or(default) == RangeOver::Time && view.transfer_function.range.is_none() {
            let files: Vec<&Path> = series.steps().iter().map(|step| step.path.as_path()).collect();
            let field = FieldSelection { name: Some(subject.array().to_owned()), component: self.mesh.component };
            let options = read_options(&self.mesh, &self.volume);
            let range = with_bar(|progress| range_over(&files, &options, &field, progress, |_, _| {}))?;
            // A field that is the same everywhere has a range that no transfer function takes; it needs none.
            let named = || self.mesh.list().map_or_else(|| self.mesh.shown_name(), |list| format!("{}, all steps", list.display()));
            view.transfer_function.check_range(range).with_context(named)?;
            view.transfer_function.range = Some(range).filter(|range| range[0] < range[1]);
        }
        Ok(())
    }
}
