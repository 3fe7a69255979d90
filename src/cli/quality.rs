//! `octetra quality`: how well the tets of a mesh are shaped.

use super::args::{MeshArgs, RawArgs, check_outputs};
use super::long_work::with_bar;
use super::subject::read_data;
use crate::format::Data;
use crate::format::vtu::write::{Compression, write_mesh};
use crate::image::write_atomically;
use crate::mesh::TetMesh;
use crate::mesh::quality::{self, Metric, Rule, Summary, WithValues};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// `octetra quality`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct QualityCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    /// What to measure, several with commas or flags; all for everything [default: eight that are usual]
    #[arg(long, value_name = "NAME|all", value_delimiter = ',', value_parser = parse_wanted, help_heading = "Quality")]
    metric: Vec<Wanted>,
    /// List so many of the worst cells for each metric
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, help_heading = "Quality")]
    worst: usize,
    /// Draw how often which values are
    #[arg(long, help_heading = "Quality")]
    histogram: bool,
    /// Bins of histograms, also of those in the JSON
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=1000), help_heading = "Quality")]
    bins: u16,
    /// Measure as VTK does where it departs from the definitions (min_angle, collapse_ratio, cells that are nearly flat)
    #[arg(long, help_heading = "Quality")]
    as_vtk: bool,
    /// Write all numbers; - for stdout, instead of the table
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    json: Option<PathBuf>,
    /// Write the mesh with the metrics as cell arrays
    #[arg(long, value_name = "OUT.vtu", value_parser = parse_vtu, help_heading = "Output")]
    array_out: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  octetra quality wing.vtu                                       a table of the usual metrics
  octetra quality wing.vtu --metric all --json quality.json
  octetra quality wing.vtu --metric min_angle,amips --histogram --worst 10
  octetra render wing.vtu --array quality:shape                  a picture coloured by a metric
  octetra view wing.vtu --array quality:min_angle

Metrics are Verdict's (the library behind VTK's mesh quality), by their definitions, and the energy of fTetWild (amips). Cells are judged in
the orientation that the file gives them: in an inverted one the Jacobian, volume and what has their sign are negative, shape is 0 and
the energy infinite. Values that are not finite are counted, and kept out of the other numbers. Cells are numbered from 0 as the file has them.";

/// Values of `--metric`.
#[derive(Debug, Clone, Copy)]
enum Wanted {
    All,
    One(Metric),
}

/// A metric, what was found, and in how many seconds.
struct Judged {
    summary: Summary,
    seconds: f64,
}

impl QualityCommand {
    /// Reads, measures, prints, writes.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        let json_file = self.json.as_ref().filter(|path| path.as_os_str() != "-");
        check_outputs(&self.mesh, &[json_file, self.array_out.as_ref()])?;
        let Data::Mesh(mesh) = read_data(&self.mesh, &RawArgs::of(None), false)? else {
            bail!("{}: is a regular volume, expected a mesh of cells; those of a volume all have one shape", self.mesh.shown_name());
        };
        let rule = if self.as_vtk { Rule::Vtk } else { Rule::Definition };
        let (mut judged, mut kept, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for metric in self.metrics() {
            let start = Instant::now();
            with_bar(|progress| quality::values_into(&mut values, &mesh, metric, rule, progress))?;
            let seconds = start.elapsed().as_secs_f64();
            let summary = Summary::new(&mesh, metric, &values, self.bins.into(), self.worst);
            judged.push(Judged { summary, seconds });
            if self.array_out.is_some() {
                kept.push((metric, values.clone()));
            }
        }
        if let Some(path) = &self.array_out {
            let with_values = WithValues { mesh: &mesh, metrics: kept };
            with_bar(|progress| write_mesh(path, &with_values, Compression::Zlib, progress))?;
        }
        if let Some(path) = &self.json {
            write_json(path, &self.numbers(&mesh, &judged))?;
        }
        if self.json.is_none() || json_file.is_some() {
            self.say(&mut io::stdout().lock(), &mesh, &judged)?;
        }
        Ok(())
    }

    fn metrics(&self) -> Vec<Metric> {
        let mut metrics: Vec<Metric> = Vec::new();
        for wanted in &self.metric {
            let wanted = match wanted {
                Wanted::All => &Metric::ALL[..],
                Wanted::One(metric) => std::slice::from_ref(metric),
            };
            let new: Vec<Metric> = wanted.iter().copied().filter(|metric| !metrics.contains(metric)).collect();
            metrics.extend(new);
        }
        if metrics.is_empty() { Metric::USUAL.to_vec() } else { metrics }
    }

    fn say(&self, out: &mut impl Write, mesh: &TetMesh, judged: &[Judged]) -> io::Result<()> {
        writeln!(out, "tets          {}", mesh.tets().len())?;
        if !mesh.file_cells().is_tets() {
            writeln!(out, "cells         cut into tets, which are judged each")?;
        }
        writeln!(out, "  inverted    {}", mesh.inverted_count())?;
        writeln!(out, "  zero volume {}", mesh.zero_volume_count())?;
        writeln!(out)?;
        let names = ["metric", "min", "q1", "median", "mean", "q3", "max", "not finite", "acceptable", "outside"];
        let rows: Vec<Vec<String>> =
            std::iter::once(names.map(str::to_owned).to_vec()).chain(judged.iter().map(|judged| row(&judged.summary))).collect();
        table(out, &rows)?;
        for metric in judged.iter().map(|judged| judged.summary.metric) {
            if let Some(how) = metric.vtk_differs() {
                let whose = if self.as_vtk { "this is VTK's value" } else { "this is by the definition, --as-vtk gives VTK's" };
                writeln!(out, "note          {metric}: {how}; {whose}")?;
            }
        }
        for Judged { summary, .. } in judged {
            if self.histogram {
                writeln!(out, "\n{}: {}", summary.metric, summary.metric.formula())?;
                histogram(out, summary)?;
            }
            if self.worst > 0 {
                writeln!(out, "\n{}, worst", summary.metric)?;
                worst(out, mesh, summary)?;
            }
        }
        Ok(())
    }

    fn numbers(&self, mesh: &TetMesh, judged: &[Judged]) -> Value {
        json!({
            "file": self.mesh.mesh,
            "points": mesh.points().len(),
            "tets": mesh.tets().len(),
            "inverted": mesh.inverted_count(),
            "zero_volume": mesh.zero_volume_count(),
            "cell_shape": mesh.file_cells().types.is_empty().then(|| mesh.file_cells().shape.key()),
            "rule": if self.as_vtk { "VTK" } else { "definition" },
            "metrics": judged.iter().map(in_json).collect::<Vec<_>>(),
        })
    }
}

/// What a row of the table has.
fn row(s: &Summary) -> Vec<String> {
    let numbers = [s.min, s.q1, s.median, s.mean, s.q3, s.max].map(|value| if value.is_finite() { short(value) } else { "-".into() });
    let (acceptable, outside) = match (s.metric.acceptable(), s.outside) {
        (Some(acceptable), Some(outside)) => {
            let [low, high] = acceptable.range.map(|end| if end.is_infinite() { String::new() } else { short(end) });
            let range = if high.is_empty() { format!("from {low}") } else { format!("{low} .. {high}") };
            (range, format!("{outside} ({:.2} %)", 100.0 * outside as f64 / s.tets as f64))
        }
        _ => ("-".into(), "-".into()),
    };
    std::iter::once(s.metric.to_string()).chain(numbers).chain([s.infinite.to_string(), acceptable, outside]).collect()
}

/// Rows with columns as wide as what they hold.
fn table(out: &mut impl Write, rows: &[Vec<String>]) -> io::Result<()> {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let cells = row.iter().zip(&widths).map(|(text, &width)| format!("{text:<width$}")).collect::<Vec<_>>();
        writeln!(out, "{}", cells.join("  ").trim_end())?;
    }
    Ok(())
}

/// Bars whose length is the number of tets.
fn histogram(out: &mut impl Write, summary: &Summary) -> io::Result<()> {
    const LONGEST: usize = 50;
    let outside = [summary.below, summary.above, summary.infinite];
    let most = summary.bins.iter().map(|bin| bin.count).chain(outside).max().unwrap_or(0).max(1);
    let mut rows = Vec::new();
    let mut add = |range: String, count: usize| {
        let length = (count * LONGEST).div_ceil(most).min(LONGEST);
        rows.push(vec![range, "#".repeat(length) + if length > 0 { " " } else { "" } + &count.to_string()]);
    };
    let (first, last) = (summary.bins.first(), summary.bins.last());
    if let (Some(first), true) = (first, summary.below > 0) {
        add(format!("below {}", short(first.low)), summary.below);
    }
    for bin in &summary.bins {
        add(format!("{} .. {}", short(bin.low), short(bin.high)), bin.count);
    }
    if let (Some(last), true) = (last, summary.above > 0) {
        add(format!("above {}", short(last.high)), summary.above);
    }
    if summary.infinite > 0 {
        add("not finite".into(), summary.infinite);
    }
    table(out, &rows)
}

fn worst(out: &mut impl Write, mesh: &TetMesh, summary: &Summary) -> io::Result<()> {
    let is_part = !mesh.file_cells().is_tets();
    let mut rows = vec![["value", "cell", "tet", "centre"].map(str::to_owned).to_vec()];
    for cell in &summary.worst {
        let value = if cell.value.is_finite() { short(cell.value) } else { not_finite(cell.value).into() };
        let center = cell.center.to_array().map(short).join(",");
        rows.push(vec![value, cell.cell.to_string(), cell.tet.to_string(), center]);
    }
    if !is_part && summary.worst.iter().all(|cell| cell.cell == cell.tet) {
        rows.iter_mut().for_each(|row| drop(row.remove(2)));
    }
    table(out, &rows)
}

fn in_json(Judged { summary, seconds }: &Judged) -> Value {
    let Summary { metric, tets, infinite, min, q1, median, q3, max, mean, std, outside, .. } = *summary;
    let edges: Vec<f64> = summary.bins.iter().map(|bin| bin.low).chain(summary.bins.last().map(|bin| bin.high)).collect();
    let counts: Vec<usize> = summary.bins.iter().map(|bin| bin.count).collect();
    let worst =
        |cell: &quality::WorstCell| json!({ "cell": cell.cell, "tet": cell.tet, "value": cell.value, "center": cell.center.to_array() });
    json!({
        "name": metric.name(), "label": metric.label(), "formula": metric.formula(), "vtk_differs": metric.vtk_differs(),
        "min": min, "q1": q1, "median": median, "q3": q3, "max": max, "mean": mean, "std": std, "not_finite": infinite,
        "acceptable": metric.acceptable().map(|a| json!({ "range": a.range, "source": a.source })),
        "outside": outside, "outside_share": outside.map(|outside| outside as f64 / tets as f64),
        "histogram": { "edges": edges, "counts": counts, "below": summary.below, "above": summary.above },
        "worst": summary.worst.iter().map(worst).collect::<Vec<_>>(),
        "seconds": seconds,
    })
}

fn write_json(path: &Path, value: &Value) -> Result<()> {
    let text = serde_json::to_string_pretty(value).context("the numbers as JSON")? + "\n";
    if path.as_os_str() == "-" {
        return io::stdout().lock().write_all(text.as_bytes()).context("stdout");
    }
    write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
}

/// What is not a finite value, in a word: an angle of a face without an area is none at all.
fn not_finite(value: f64) -> &'static str {
    if value.is_nan() { "none" } else { "infinite" }
}

/// Five digits that count.
fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.3e}");
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let text = format!("{value:.*}", (4 - magnitude).max(0) as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.to_owned() }
}

fn parse_wanted(text: &str) -> Result<Wanted, String> {
    if text == "all" { Ok(Wanted::All) } else { text.parse().map(Wanted::One).map_err(|error: quality::UnknownMetric| error.to_string()) }
}

fn parse_vtu(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_vtu = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("vtu"));
    if is_vtu { Ok(path) } else { Err("expected a name that ends in .vtu".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let found = [0.0, -0.25, 12.3456789, 1234567.0, 3.0e-7, 70.52877936, 1.0, 0.0049689787, 123456.7].map(short);
        assert_eq!(found, ["0", "-0.25", "12.346", "1.235e6", "3.000e-7", "70.529", "1", "0.004969", "123457"]);
    }

    #[test]
    fn metrics_are_named_and_a_file_of_arrays_is_a_vtu() {
        assert!(matches!(parse_wanted("shape"), Ok(Wanted::One(Metric::Shape))) && matches!(parse_wanted("all"), Ok(Wanted::All)));
        assert!(parse_wanted("beauty").is_err_and(|error| error.contains("scaled_jacobian")));
        assert!(parse_vtu("a.VTU").is_ok() && parse_vtu("a.vtk").is_err());
    }
}
