//! `octetra probe`: values at places.

use super::args::{MeshArgs, OctreeArgs, RawArgs, check_outputs};
use super::long_work::with_bar;
use super::subject::{read_subject, regularized};
use crate::mesh::Locator;
use crate::octree::{OctreeTexture, Subject};
use crate::study::probe::{LineSamples, Probe, Sample, write_csv, write_json};
use anyhow::{Context, Result};
use clap::Args;
use glam::DVec3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// `octetra probe`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra probe flow.vtu --at 0.5,0.2,0.1 --at 0.6,0.2,0.1    the values of mesh and octree, cell and leaf
  octetra probe flow.vtu --line 0,0,0:1,0.5,0.2 --samples 1001 -o line.csv
  octetra probe scan.nhdr --at 12,40,7 --tolerance 0.01

Positions are world coordinates. Cells are numbered from 0 as the file has them, through all its pieces or blocks; `data` is linear in a
tet, trilinear in a volume. Where there is no value the table has -, the file NaN (CSV) or null (JSON).")]
#[command(group = clap::ArgGroup::new("places").required(true).args(["at", "line"]))]
pub struct ProbeCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    /// A point; can be given several times
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true, help_heading = "Places")]
    at: Vec<DVec3>,
    /// A line by its two ends
    #[arg(long, value_name = "X,Y,Z:X,Y,Z", value_parser = parse_line, allow_hyphen_values = true, help_heading = "Places",
          conflicts_with = "at")]
    line: Option<[DVec3; 2]>,
    /// How many places along the line, its ends included [default: 101]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000_000), conflicts_with = "at", help_heading = "Places")]
    samples: Option<u32>,
    #[command(flatten)]
    octree: OctreeArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Write the table to a file too
    #[arg(short, long, value_name = "OUT.csv|OUT.json", value_parser = parse_output)]
    output: Option<PathBuf>,
}

impl ProbeCommand {
    /// Reads, regularizes, looks, prints, writes.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        check_outputs(&self.mesh, &[self.output.as_ref()])?;
        let subject = read_subject(&self.mesh, &self.volume)?;
        let tree = regularized(&self.mesh, &subject, &self.octree.params())?;
        let texture = OctreeTexture::encode(&tree)?;
        let locator = match &subject {
            Subject::Mesh(mesh, _) => Some(with_bar(|progress| Locator::new(mesh, progress))?),
            Subject::Volume(_) => None,
        };
        let probe = Probe { subject: &subject, locator: locator.as_ref(), texture: &texture, boundary: tree.params.boundary };
        let (samples, arc_length) = match self.line {
            Some(ends) => {
                let count = self.samples.unwrap_or(101) as usize;
                let LineSamples { arc_length, samples } = with_bar(|progress| probe.along(ends, count, progress))?;
                (samples, Some(arc_length))
            }
            None => (self.at.iter().map(|&at| probe.at(at)).collect(), None),
        };
        if let Some(path) = &self.output {
            let write = if has_suffix(path, "json") { write_json } else { write_csv };
            write(path, &samples, arc_length.as_deref()).with_context(|| path.display().to_string())?;
        }
        Ok(print(&mut io::stdout().lock(), subject.array(), &samples, arc_length.as_deref())?)
    }
}

/// The table, columns as wide as what they hold.
fn print(out: &mut impl Write, array: &str, samples: &[Sample], arc_length: Option<&[f64]>) -> io::Result<()> {
    let number = |value: Option<f64>| value.map_or("-".into(), in_short);
    let row = |(i, sample): (usize, &Sample)| {
        let place = arc_length.map(|arc_length| in_short(arc_length[i])).into_iter().chain(sample.at.to_array().map(in_short));
        let values = [sample.own, sample.octree, sample.difference()].map(number);
        let cell = sample.cell.map_or("-".into(), |cell| format!("{} {}", cell.shape, cell.number));
        let leaf = sample.leaf.map_or("-".into(), |leaf| format!("depth {}, edge {}", leaf.depth, in_short(leaf.edge)));
        place.chain(values).chain([cell, leaf]).collect::<Vec<String>>()
    };
    let place = arc_length.map(|_| "along").into_iter().chain(["x", "y", "z"]);
    let names: Vec<String> = place.chain([array, "octree", "difference", "cell", "leaf"]).map(str::to_owned).collect();
    let rows: Vec<Vec<String>> = std::iter::once(names).chain(samples.iter().enumerate().map(row)).collect();
    let widths: Vec<usize> = (0..rows[0].len()).map(|c| rows.iter().map(|row| row[c].chars().count()).max().unwrap_or(0)).collect();
    for row in &rows {
        let cells = row.iter().zip(&widths).map(|(text, &width)| format!("{text:<width$}")).collect::<Vec<_>>();
        writeln!(out, "{}", cells.join("  ").trim_end())?;
    }
    Ok(())
}

/// Seven digits that count, without zeros that say nothing.
fn in_short(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        return format!("{value:.6e}");
    }
    let before_point = if value.abs() >= 1.0 { value.abs().log10().floor() as usize + 1 } else { 1 };
    let text = format!("{value:.*}", 7usize.saturating_sub(before_point));
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.to_owned() }
}

fn parse_point(text: &str) -> Result<DVec3, String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let parts: Option<[f64; 3]> = parts.and_then(|parts| parts.try_into().ok());
    parts.map(DVec3::from).ok_or_else(|| "expected X,Y,Z, three finite numbers".into())
}

fn parse_line(text: &str) -> Result<[DVec3; 2], String> {
    let ends = text.split_once(':').and_then(|(a, b)| Some([parse_point(a).ok()?, parse_point(b).ok()?]));
    let ends = ends.ok_or("expected X,Y,Z:X,Y,Z, two points")?;
    match ends[0].distance(ends[1]) {
        0.0 => Err("expected two different points".into()),
        length if length.is_finite() => Ok(ends),
        _ => Err("expected a line whose length is a finite number".into()),
    }
}

fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(suffix))
}

fn parse_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_suffix(&path, "csv") || has_suffix(&path, "json") { Ok(path) } else { Err("expected a name that ends in .csv or .json".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_lines_are_read_and_numbers_are_short() {
        assert_eq!(parse_point("-1, 2.5,3e-2"), Ok(DVec3::new(-1.0, 2.5, 0.03)));
        assert_eq!(parse_line("0,0,0:-1,2,3"), Ok([DVec3::ZERO, DVec3::new(-1.0, 2.0, 3.0)]));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan"] {
            assert!(parse_point(bad).is_err() && parse_line(&format!("{bad}:0,0,0")).is_err(), "{bad}");
        }
        assert!(parse_line("1,2,3").is_err() && parse_line("1,2,3:1,2,3").is_err());
        assert!(parse_line("0,0,0:1e200,0,0").is_err(), "its length squared is none");
        assert!(parse_output("a.csv").is_ok() && parse_output("a.JSON").is_ok() && parse_output("a.txt").is_err());
        assert_eq!([0.0, -0.25, 1234567.0, 3.0e-7, -1e-300 * 1e-300].map(in_short), ["0", "-0.25", "1234567", "3.000000e-7", "0"]);
    }
}
