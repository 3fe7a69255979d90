//! `octetra tune`: which thresholds to take.

use super::args::{DeviceArg, MeshArgs, RawArgs, check_outputs, parse_bytes, parse_positive, parse_size, threshold_flags};
use super::long_work::with_bar;
use super::render::say_if_fallen_back;
use super::subject::{check_budget, read_subject};
use super::transfer::TransferArgs;
use crate::geometry::Placed;
use crate::image::{Background, write_atomically, write_png};
use crate::mesh::Component;
use crate::octree::{OctreeParams, Preset, Subject};
use crate::progress::Progress;
use crate::render::Renderer;
use crate::study::tune::{Clock, Effort, Goal, Pick, Plan, Record, Row, Sweep, front, recommend};
use crate::study::{Chart, ErrorSampling};
use crate::view::{Camera, RenderSettings, View};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};

/// `octetra tune`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra tune flow.vtu                               what the settings cost and give, and three to choose from
  octetra tune flow.vtu --quick --chart flow.svg      a first impression, and the chart
  octetra tune flow.vtu --budget 8MiB                 the best picture in 8 MiB
  octetra tune flow.vtu --target-psnr 45 --json flow-tune.json
  octetra tune flow.vtu --tolerances 0.01,0.003,0.001 --depths 9,10,11
  octetra tune scan.nhdr --target-psnr 45             a volume: PSNR is of the field, by its measured error

The field error is measured at random points over the volume, relative to the field's range. PSNR is of the worst view against the exact
renderer's picture, 8 bits, over covered pixels; volumes have no exact picture, their PSNR is the field error's in decibels. A sweep that is stopped by Ctrl-C keeps what it measured; with --json the same command
goes on where it stopped, and other settings are added to what the file holds.")]
pub struct TuneCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Recommend the best picture with an octree of at most so many bytes, such as 64MiB
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    budget: Option<u64>,
    /// Recommend the smallest octree that reaches this PSNR in every view
    #[arg(long, value_name = "DB", value_parser = parse_positive)]
    target_psnr: Option<f64>,
    /// Tolerances R to sweep, each with each depth [default: 4 to 1/8 times the default tolerance]
    #[arg(long, value_name = "R,R,..", value_delimiter = ',', value_parser = parse_positive, help_heading = "Settings to sweep")]
    tolerances: Vec<f64>,
    /// Maximum depths to sweep [default: around the default depth]
    #[arg(long, value_name = "D,D,..", value_delimiter = ',', help_heading = "Settings to sweep",
          value_parser = clap::value_parser!(u8).range(1..=i64::from(OctreeParams::DEPTH_LIMIT)))]
    depths: Vec<u8>,
    /// Variances W to sweep, by V and W instead of a tolerance [default: some at the default depth; none with --tolerances or --depths]
    #[arg(long, value_name = "W,W,..", value_delimiter = ',', value_parser = parse_positive, help_heading = "Settings to sweep")]
    variances: Vec<f64>,
    /// Fewer settings, one view, one build of each, fewer points
    #[arg(long, help_heading = "Settings to sweep")]
    quick: bool,
    /// Views of the standard orbit to draw, 0 to 11 [default: 0,3,7; with --quick 0]
    #[arg(long, value_name = "K,K,..", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(0..12), help_heading = "View")]
    views: Vec<u32>,
    /// Their size in pixels
    #[arg(long, value_name = "N|WxH", default_value = "256", value_parser = parse_size, help_heading = "View")]
    size: [u32; 2],
    #[command(flatten)]
    transfer: TransferArgs,
    /// Where to draw: auto takes the best GPU, else the CPU
    #[arg(long, value_enum, default_value = "auto", help_heading = "View")]
    device: DeviceArg,
    /// Print the settings too that others beat on all counts
    #[arg(long, help_heading = "Output")]
    all: bool,
    /// Write all measurements; a file of the same mesh, field, views and machine is continued
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    json: Option<PathBuf>,
    /// Draw PSNR over bytes, frame and build time
    #[arg(long, value_name = "OUT.svg|OUT.png", value_parser = parse_chart, help_heading = "Output")]
    chart: Option<PathBuf>,
}

impl TuneCommand {
    /// Sweeps, prints the table and what to take, writes.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        check_outputs(&self.mesh, &[self.json.as_ref(), self.chart.as_ref()])?;
        let transfer_function = self.transfer.read(None)?;
        let subject = read_subject(&self.mesh, &self.volume)?;
        transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        let transfer_function = self.transfer.scaled(transfer_function, subject.bounds().diagonal());
        check_budget(&self.mesh, &subject)?;
        let renderer = Renderer::new(self.device.into())?;
        say_if_fallen_back(&renderer);

        let bounds = subject.bounds().translated(subject.center());
        let view = |&k: &u32| View {
            camera: Camera::orbit(bounds, k, 1.0),
            transfer_function: transfer_function.clone(),
            settings: RenderSettings::new(self.size[0], self.size[1]),
        };
        let views: Vec<View> = self.views().iter().map(view).collect();
        let sweep = Sweep { of: &subject, renderer: &renderer, views: &views, effort: self.effort() };
        let mut record = match &self.json {
            Some(path) => Record::open(path, sweep.subject())?,
            None => Record::new(sweep.subject()),
        };
        let settings = self.plan().settings();

        let mut stopped = false;
        with_bar(|progress: &Progress| -> Result<()> {
            let swept = sweep.run(&settings, &mut record, progress, |record| self.write_record(record));
            // What was measured until Ctrl-C is worth a table.
            stopped = progress.check().is_err() && !record.rows.is_empty();
            if stopped { Ok(()) } else { swept }
        })?;

        ensure!(!record.rows.is_empty(), "none of {} settings could be measured: {}", settings.len(), record.dropped[0].reason);
        self.write_record(&record)?;
        let picks = recommend(&record.rows, self.goal());
        self.draw_chart(&record, &subject, &picks)?;
        self.print(&record, &subject, &picks)?;
        if stopped {
            let again = if self.json.is_some() { "; the same command goes on" } else { "" };
            bail!("stopped after {} of {} settings{again}", record.rows.len() + record.dropped.len(), settings.len());
        }
        Ok(())
    }

    fn goal(&self) -> Goal {
        Goal { budget_bytes: self.budget, target_psnr_db: self.target_psnr }
    }

    fn plan(&self) -> Plan {
        let mut plan = if self.quick { Plan::quick() } else { Plan::full() };
        if !(self.tolerances.is_empty() && self.depths.is_empty()) {
            plan.variances.clear();
        }
        for (swept, chosen) in [(&mut plan.tolerances, &self.tolerances), (&mut plan.variances, &self.variances)] {
            if !chosen.is_empty() {
                *swept = chosen.clone();
            }
        }
        if !self.depths.is_empty() {
            plan.depths = self.depths.clone();
            plan.variance_depths = self.depths.clone();
        }
        plan
    }

    fn views(&self) -> Vec<u32> {
        match (&self.views[..], self.quick) {
            ([], true) => vec![0],
            ([], false) => vec![0, 3, 7],
            (chosen, _) => chosen.to_vec(),
        }
    }

    fn effort(&self) -> Effort {
        let (builds, frames, points) = if self.quick { (1, 3, 1 << 17) } else { (3, 5, ErrorSampling::default().points) };
        let error = ErrorSampling { points, ..Default::default() };
        Effort { builds, frames, error, memory_bytes: self.mesh.budget_bytes() }
    }

    fn write_record(&self, record: &Record) -> Result<()> {
        let picks = recommend(&record.rows, self.goal());
        Ok(self.json.as_deref().map(|path| record.write(path, &picks)).transpose().map(drop)?)
    }

    fn draw_chart(&self, record: &Record, subject: &Subject, picks: &[Pick]) -> Result<()> {
        let Some(path) = &self.chart else { return Ok(()) };
        let title = format!("{}, {}", self.mesh.stem(), self.subject_in_words(record, subject));
        let chart = Chart { title: &title, rows: &record.rows, picks };
        if is_svg(path) {
            let svg = chart.svg()?;
            write_atomically(path, |out| out.write_all(svg.as_bytes())).with_context(|| path.display().to_string())
        } else {
            Ok(write_png(path, &chart.image()?, Background::Color([1.0; 3]))?)
        }
    }

    /// What was measured and on what, in one line.
    fn subject_in_words(&self, record: &Record, subject: &Subject) -> String {
        let views: Vec<String> = self.views().iter().map(u32::to_string).collect();
        let adapter = &record.subject.machine["adapter"][0];
        format!(
            "{}, {}, views {} at {}x{}, {}",
            subject.size_in_words(),
            subject.array(),
            views.join(" "),
            self.size[0],
            self.size[1],
            adapter.as_str().unwrap_or("CPU")
        )
    }

    fn print(&self, record: &Record, subject: &Subject, picks: &[Pick]) -> Result<()> {
        let rows = &record.rows;
        let front = front(rows);
        let mut shown = if self.all { (0..rows.len()).collect() } else { front.clone() };
        shown.sort_by_key(|&i| rows[i].bytes);
        let mut out = std::io::stdout().lock();
        writeln!(out, "{}, {}", self.mesh.stem(), self.subject_in_words(record, subject))?;
        let beside =
            if self.all { "; * marks those that no other beats on all counts" } else { ", those that no other beats on all counts" };
        writeln!(out, "{} of {} settings measured{beside}\n", shown.len(), rows.len())?;
        let by = if rows.iter().all(|row| row.frame_by == Clock::Gpu) { "(GPU)" } else { "(clock)" };
        let psnr = if matches!(subject, Subject::Volume(_)) { "field dB" } else { " PSNR dB" };
        writeln!(out, "       MiB     nodes  depth  build s   rmse %    max % {psnr}  frame ms {by:<7}  setting")?;
        for i in shown {
            let mark = if self.all && front.contains(&i) { '*' } else { ' ' };
            writeln!(out, "{mark} {}", line(&rows[i]))?;
        }
        for dropped in &record.dropped {
            writeln!(out, "dropped  {}: {}", setting(&dropped.params), dropped.reason)?;
        }
        writeln!(out)?;
        for pick in picks {
            let row = &rows[pick.row];
            if !pick.meets_goal {
                writeln!(out, "No setting measured {}; the nearest:", self.goal_in_words())?;
            }
            let (mib, ms) = (row.bytes as f64 / f64::from(1 << 20), row.frame_s * 1e3);
            let name = pick.name;
            writeln!(out, "{name:<8}  {mib:>7.2} MiB  {:>5.1} dB  {ms:>7.3} ms   {}", row.psnr_db, self.command(&row.params))?;
        }
        Ok(())
    }

    fn goal_in_words(&self) -> String {
        let target = self.target_psnr.map(|db| format!("reaches {db} dB"));
        let budget = self.budget.map(|bytes| format!("fits {:.3} MiB", bytes as f64 / f64::from(1 << 20)));
        [target, budget].into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }

    /// The line to paste that draws with a setting.
    fn command(&self, params: &OctreeParams) -> String {
        let mut words = vec!["octetra".to_owned(), "render".to_owned()];
        words.extend(self.mesh.mesh.as_ref().map(|path| path.display().to_string()));
        words.extend(self.mesh.solution.iter().flat_map(|path| ["--solution".to_owned(), path.display().to_string()]));
        words.extend(self.mesh.array.iter().flat_map(|name| ["--array".to_owned(), name.clone()]));
        match self.mesh.component {
            Component::Magnitude => {}
            Component::Index(i) => words.extend(["--component".to_owned(), i.to_string()]),
        }
        words.extend(self.transfer.flags());
        words.extend(self.volume.flags());
        words.extend(threshold_flags(params));
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }
}

/// A row of the table.
fn line(row: &Row) -> String {
    format!(
        "{:>8.3} {:>9}  {:>5}  {:>7.3}  {:>7.3}  {:>7.2}  {:>7.2}  {:>8.3}          {}",
        row.bytes as f64 / f64::from(1 << 20),
        row.nodes,
        row.depth,
        row.build_s,
        row.rmse_rel * 100.0,
        row.max_rel * 100.0,
        row.psnr_db,
        row.frame_s * 1e3,
        setting(&row.params)
    )
}

/// The flags of a setting, behind the name of the preset if it is one.
fn setting(params: &OctreeParams) -> String {
    let flags = threshold_flags(params).join(" ");
    match Preset::ALL.iter().find(|(_, preset)| preset.params() == *params) {
        Some((name, _)) if !flags.ends_with(name) => format!("{flags} ({name})"),
        _ => flags,
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

fn is_svg(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"))
}

fn parse_chart(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let known = is_svg(&path) || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if known { Ok(path) } else { Err("expected a name that ends in .svg or .png".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!([quoted("a.vtu"), quoted("my mesh.vtu"), quoted("it's"), quoted("")], ["a.vtu", "'my mesh.vtu'", "'it'\\''s'", "''"]);
    }
}
