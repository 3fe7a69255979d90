//! `octetra bench --slices` and `--synthetic`: caches of bricks on motions of slices.

use super::args::check_outputs_beside;
use super::long_work::with_bar;
use crate::bricks::simulate::Pinning;
use crate::bricks::{BrickSource, Demand, Motion, Pyramid, Store, Trace};
use crate::image::write_atomically;
use crate::progress::Progress;
use crate::study::slices::{
    AREA_RATIOS, AreaRow, DetailRow, PAPER_CACHE, PAPER_SETS, PAPER_VOLUMES, PolicyRow, RATIOS, StageRow, StallRow, by_optimum,
    paper_demand, recorded_demand, replay_dims, shell_statistics, slow_scrub, standard_demands, try_areas, try_detail, try_policies,
    try_prefetch, try_stages,
};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What `octetra bench` takes to measure caches of bricks.
#[derive(Debug, Clone, Args)]
pub struct SliceBenchArgs {
    /// Instead, what caches of bricks make of slices in motion: through a store, or as a recorded trace says
    #[arg(long, value_name = "STORE.zarr|TRACE.json", conflicts_with_all = ["mesh", "skip_table", "mode_table", "presets"])]
    slices: Option<PathBuf>,
    /// The same through a volume of so many voxels along each edge that is not there, and the paper's three
    #[arg(long, value_name = "N", conflicts_with_all = ["mesh", "slices", "skip_table", "mode_table", "presets"],
          value_parser = clap::value_parser!(u32).range(128..=8192))]
    synthetic: Option<u32>,
    /// Frames of each trace that is made up [default: 500]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(10..=100_000))]
    frames: Option<u32>,
    /// Another number, other random places [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Write the motions that are made up as traces into this folder, instead of replaying them
    #[arg(long, value_name = "FOLDER", requires = "synthetic", conflicts_with = "json", help_heading = "Output")]
    record: Option<PathBuf>,
    /// The tables of --slices and --synthetic as numbers; - for the terminal
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    json: Option<PathBuf>,
}

impl SliceBenchArgs {
    /// Whether slices are to be measured, not a mesh.
    pub fn is_asked(&self) -> bool {
        self.slices.is_some() || self.synthetic.is_some()
    }

    /// Complains of flags that would be without effect on a mesh.
    pub fn refuse_alone(&self) -> Result<()> {
        ensure!(
            self.frames.is_none() && self.seed.is_none() && self.json.is_none(),
            "--frames, --seed and --json go with --slices or --synthetic"
        );
        Ok(())
    }

    fn frames(&self) -> usize {
        self.frames.unwrap_or(500) as usize
    }

    fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    /// Replays, prints, writes.
    pub fn run(&self) -> Result<()> {
        ensure!(self.record.is_none() || self.synthetic.is_some(), "--record goes with --synthetic");
        let inputs: Vec<(&Path, &str)> = self.slices.iter().map(|path| (path.as_path(), "what is replayed")).collect();
        let is_terminal = self.json.as_ref().is_some_and(|path| path.as_os_str() == "-");
        check_outputs_beside(&inputs, &[self.json.as_ref().filter(|_| !is_terminal)])?;
        let mut report = Report { out: io::stdout(), silent: is_terminal, numbers: serde_json::Map::new() };
        match (&self.slices, self.synthetic) {
            (Some(path), _) if path.is_dir() => self.store(path, &mut report)?,
            (Some(path), _) => self.trace(path, &mut report)?,
            (None, Some(edge)) if self.record.is_some() => self.write_traces(edge)?,
            (None, Some(edge)) => {
                self.paper(&mut report)?;
                self.volume([edge; 3], size_of::<f32>(), &mut report)?;
                report.line(&format!("\nrefined slices of a hollow shell, {edge} x {edge} x {edge} voxels of 1 byte"))?;
                let known = |key| Some(shell_statistics(edge, key));
                report.detail(&try_detail(&Pyramid::new([edge; 3]), [0.0, 255.0], 1, known, 8))?;
            }
            (None, None) => bail!("one of --slices and --synthetic is needed"),
        }
        if let Some(path) = &self.json {
            let text = serde_json::to_string_pretty(&Value::Object(report.numbers)).context("the numbers as JSON")? + "\n";
            if is_terminal {
                return io::stdout().lock().write_all(text.as_bytes()).context("stdout");
            }
            write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// The motions of [`Motion::ALL`] as files.
    fn write_traces(&self, edge: u32) -> Result<()> {
        let Some(folder) = &self.record else { return Ok(()) };
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for (name, motion) in Motion::ALL {
            let path = folder.join(format!("{name}.json"));
            motion.trace([edge; 3], self.frames(), self.seed()).write(&path).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// All tables for a store.
    fn store(&self, path: &Path, report: &mut Report) -> Result<()> {
        let store = Store::open(path)?;
        self.volume(store.pyramid().dims(0), store.voxel_bytes(), report)?;
        report.line(&format!("\nrefined slices of {}", path.display()))?;
        report.detail(&try_detail(store.pyramid(), store.range(), store.voxel_bytes(), |key| store.statistics(key), 8))
    }

    /// A recorded trace, at the finest level whose frames have as many bricks as the paper's cache.
    fn trace(&self, path: &Path, report: &mut Report) -> Result<()> {
        ensure!(self.frames.is_none() && self.seed.is_none(), "--frames and --seed are for motions that are made up");
        let trace = Trace::read(path).with_context(|| path.display().to_string())?;
        let demand = recorded_demand(&trace, PAPER_CACHE);
        self.policies(&[demand], size_of::<f32>(), report)
    }

    /// The paper's scenario.
    fn paper(&self, report: &mut Report) -> Result<()> {
        report.line(&format!(
            "the paper's scenario: {PAPER_CACHE} bricks in the cache, three slices, 30 random moves along each axis, hit rate in % (of the bricks new to a frame)"
        ))?;
        let rows = with_bar(|progress| {
            progress.begin("paper", (2 * (2 * PAPER_VOLUMES.len() - 1) * 2 * 6) as u64);
            let mut rows = Vec::new();
            for motion in [Motion::PaperJumps, Motion::Paper] {
                for ((name, edge), set) in PAPER_VOLUMES.into_iter().flat_map(|volume| PAPER_SETS.map(|set| (volume, set))) {
                    let mut demand = paper_demand(edge, motion, set, self.seed());
                    if demand.frame_set() < PAPER_SETS[0] && set > PAPER_SETS[0] {
                        // The smaller set held all already.
                        continue;
                    }
                    demand.name = format!("{name}, {}", if motion == Motion::Paper { "dragged" } else { "jumps" });
                    for pinning in [Pinning::Plain, Pinning::Pinned] {
                        rows.extend(try_policies(&demand, PAPER_CACHE, pinning, size_of::<f32>(), progress)?);
                    }
                }
            }
            Ok::<_, anyhow::Error>(rows)
        })?;
        report.paper(&rows)
    }

    /// Policies, stalls, areas and stages on motions through a volume.
    fn volume(&self, dims: [u32; 3], voxel_bytes: usize, report: &mut Report) -> Result<()> {
        let frames = self.frames();
        let whole = dims;
        let dims = replay_dims(dims);
        if dims != whole {
            report.line(&format!("\nmotions through the level of {} x {} x {} voxels", dims[0], dims[1], dims[2]))?;
        }
        let demands = standard_demands(dims, frames, self.seed());
        self.policies(&demands, voxel_bytes, report)?;
        let slow = slow_scrub(dims, 4 * frames, self.seed());
        let plane = Pyramid::new(dims).brick_count(0) as f64 / f64::from(Pyramid::new(dims).bricks(0)[0]);
        // Bricks a frame with which a plane of bricks is read in a half, a quarter and so on of the time that a slice takes through it.
        let bandwidths: Vec<usize> = [2.0, 3.0, 4.0, 8.0].map(|share| (plane * share / 64.0).ceil() as usize).to_vec();
        let stalls = with_bar(|progress: &Progress| try_prefetch(&slow, &bandwidths, progress))?;
        report.stalls(&stalls)?;
        let mut areas: Vec<AreaRow> = Vec::new();
        for motion in [Motion::PaperJumps, Motion::Paper] {
            let mut demand = paper_demand(dims[0].max(dims[1]).max(dims[2]), motion, PAPER_CACHE, self.seed());
            demand.name = (if motion == Motion::Paper { "dragged" } else { "jumps" }).to_owned();
            for pinning in [Pinning::Plain, Pinning::Pinned] {
                areas.extend(AREA_RATIOS.map(|ratio| try_areas(&demand, ratio, pinning)));
            }
        }
        report.areas(&areas)?;
        let scrub = demands.iter().find(|demand| demand.name == "scrub");
        report.stages(&scrub.map_or(Vec::new(), |scrub| bandwidths.iter().map(|&bandwidth| try_stages(scrub, bandwidth)).collect()))
    }

    fn policies(&self, demands: &[Demand], voxel_bytes: usize, report: &mut Report) -> Result<()> {
        let rows = with_bar(|progress| {
            progress.begin("policies", (demands.len() * RATIOS.len() * 6) as u64);
            let mut rows = Vec::new();
            for demand in demands {
                let mut capacities = RATIOS.map(|ratio| ((demand.frame_set() as f64 * ratio) as usize).max(1)).to_vec();
                capacities.dedup();
                for capacity in capacities {
                    rows.extend(try_policies(demand, capacity, Pinning::Pinned, voxel_bytes, progress)?);
                }
            }
            Ok::<_, anyhow::Error>(rows)
        })?;
        report.policies(&rows)
    }
}

/// The tables as text, and what is kept of them for the file.
struct Report {
    out: io::Stdout,
    silent: bool,
    numbers: serde_json::Map<String, Value>,
}

impl Report {
    fn line(&mut self, text: &str) -> Result<()> {
        if !self.silent {
            writeln!(self.out.lock(), "{text}")?;
        }
        Ok(())
    }

    /// Rows of one trace and capacity, one policy each, in one line.
    fn by_trace(rows: &[PolicyRow]) -> impl Iterator<Item = &[PolicyRow]> {
        rows.chunk_by(|a, b| a.trace == b.trace && a.capacity == b.capacity && a.pinned == b.pinned)
    }

    fn head(rows: &[PolicyRow], first: &str, width: usize) -> String {
        let names: Vec<String> = rows.iter().map(|row| format!("{:>width$}", row.policy)).collect();
        format!("{first}{}", names.join(" "))
    }

    fn paper(&mut self, rows: &[PolicyRow]) -> Result<()> {
        for (i, group) in Self::by_trace(rows).enumerate() {
            if i == 0 {
                self.line(&Self::head(group, "volume, moves      bricks a frame  cache   ", 13))?;
            }
            let pinned = if group[0].pinned { "pinned" } else { "plain" };
            let rates: Vec<String> = group
                .iter()
                .map(|row| format!("{:>13}", format!("{:.1} ({:.1})", 100.0 * row.hit_rate, 100.0 * row.fresh_hit_rate)))
                .collect();
            self.line(&format!("{:<18} {:>14}  {pinned:<6}  {}", group[0].trace, group[0].frame_set, rates.join(" ")))?;
        }
        self.keep("paper", rows)
    }

    fn policies(&mut self, rows: &[PolicyRow]) -> Result<()> {
        self.line("\npolicies, the current frame pinned: bricks loaded a frame (by the optimum's)")?;
        for (i, group) in Self::by_trace(rows).enumerate() {
            if i == 0 {
                self.line(&Self::head(group, "trace       bricks a frame  cache  ", 14))?;
            }
            let misses: Vec<String> =
                group.iter().map(|row| format!("{:>14}", format!("{:.1} ({:.2})", row.misses_per_frame, row.by_optimum))).collect();
            self.line(&format!("{:<11} {:>14} {:>6}  {}", group[0].trace, group[0].frame_set, group[0].capacity, misses.join(" ")))?;
        }
        let mut names: Vec<&str> = rows.iter().map(|row| row.policy).collect();
        names.truncate(Self::by_trace(rows).next().map_or(0, <[PolicyRow]>::len));
        for name in names {
            let (mean, worst) = by_optimum(rows, name);
            self.line(&format!("{name:<9} {mean:.3} x the optimum's misses on average, {worst:.3} x at worst"))?;
        }
        self.keep("policies", rows)
    }

    fn stalls(&mut self, rows: &[StallRow]) -> Result<()> {
        self.line("\nslices dragged by a voxel a frame (60 a second), cache of 1.5 frame sets: frames that stall, bricks read")?;
        self.line("bricks read a frame   frames  without loading ahead       with it  stalls left")?;
        for row in rows {
            let [without, with] = [0, 1].map(|i| format!("{} ({})", row.stalls[i], row.loads[i]));
            let left = row.stalls[1] as f64 / row.stalls[0].max(1) as f64;
            self.line(&format!("{:>19} {:>8} {without:>22} {with:>13} {:>10.0} %", row.bandwidth, row.frames, 100.0 * left))?;
        }
        self.keep("stalls", rows)
    }

    fn areas(&mut self, rows: &[AreaRow]) -> Result<()> {
        self.line("\nareas on the GPU against LRU: hit rate in % (of the bricks new to a frame)")?;
        self.line("moves    cache   GPU cache / frame set            LRU          areas  areas by LRU")?;
        for row in rows {
            let pinned = if row.pinned { "pinned" } else { "plain" };
            let [lru, areas] = [0, 1].map(|i| format!("{:.1} ({:.1})", 100.0 * row.hit_rates[i], 100.0 * row.fresh_hit_rates[i]));
            let gain = |of: [f64; 2]| of[1] / of[0].max(1e-9);
            let gains = format!("{:.2} ({:.2})", gain(row.hit_rates), gain(row.fresh_hit_rates));
            self.line(&format!("{:<8} {pinned:<7} {:>21} {lru:>14} {areas:>14} {gains:>13}", row.trace, row.ratio))?;
        }
        self.keep("areas", rows)
    }

    fn stages(&mut self, rows: &[StageRow]) -> Result<()> {
        self.line("\none stage against two on the scrub, cache of 1.5 frame sets; waits in frames")?;
        self.line("bricks read a frame   frames  one: waiting  mean wait  longest    read  two: waiting    read  refined at rest")?;
        for row in rows {
            let refined = format!("{} of {}", row.refined_frames, row.resting_frames);
            self.line(&format!(
                "{:>19} {:>8} {:>13} {:>10.2} {:>8.1} {:>7} {:>13} {:>7} {refined:>16}",
                row.bandwidth, row.frames, row.waiting_frames, row.mean_wait, row.longest_wait, row.single_loads, 0, row.two_loads
            ))?;
        }
        self.keep("stages", rows)
    }

    fn detail(&mut self, rows: &[DetailRow]) -> Result<()> {
        self.line("rule                             bricks a slice  MiB a slice  saved")?;
        for row in rows {
            let mib = row.bytes / f64::from(1 << 20);
            self.line(&format!("{:<32} {:>14.1} {mib:>12.1} {:>4.0} %", row.rule, row.bricks, 100.0 * row.saved))?;
        }
        self.keep("detail", rows)
    }

    fn keep(&mut self, name: &str, rows: &[impl serde::Serialize]) -> Result<()> {
        self.numbers.insert(name.to_owned(), json!(rows));
        Ok(())
    }
}
