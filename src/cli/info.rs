//! `octetra info`: what a file holds.

use super::args::{MeshArgs, RawArgs, check_outputs};
use super::subject::read_contents;
use crate::format::series::Step;
use crate::format::{Contents, Series};
use crate::geometry::Placed;
use crate::image::write_atomically;
use crate::mesh::{CellType, DataArray, MeshReport, ScalarField, TetMesh, UnstructuredGrid, to_tets};
use crate::octree::OctreeParams;
use crate::volume::Grid;
use anyhow::{Context, Result};
use clap::Args;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::PathBuf;

/// `octetra info`.
#[derive(Debug, Args)]
pub struct InfoCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Write all of it as numbers; - for stdout, instead of the text
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    json: Option<PathBuf>,
}

impl InfoCommand {
    /// Reads the mesh or volume and says what it holds; of a series of which no step is chosen, lists the steps.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        check_outputs(&self.mesh, &[self.json.as_ref().filter(|_| !self.is_json_only())])?;
        if let (Some(series), None, None) = (self.mesh.series(), self.mesh.steps.time, self.mesh.steps.time_step) {
            let step = |step: &Step| json!({ "time": step.time, "file": step.path, "exists": step.exists() });
            self.write_json(|| json!({ "steps": series.steps().iter().map(step).collect::<Vec<_>>() }))?;
            return if self.is_json_only() { Ok(()) } else { Ok(list(&mut io::stdout().lock(), series)?) };
        }
        let mut holds = match read_contents(&self.mesh, &self.volume)? {
            Contents::Grid(grid) => {
                self.write_json(|| volume_numbers(&grid))?;
                return if self.is_json_only() { Ok(()) } else { Ok(describe_volume(&mut io::stdout().lock(), &grid)?) };
            }
            Contents::Cells(grid) => Holds::cells(grid).with_context(|| self.mesh.shown_name())?,
            Contents::Tets(parts) => Holds::mesh(TetMesh::new(parts).with_context(|| self.mesh.shown_name())?),
        };
        let shown = match (&holds.mesh, &self.mesh.array) {
            (Some(mesh), Some(_)) => Some(self.mesh.field(mesh)?),
            (Some(mesh), None) => ScalarField::select(mesh, &Default::default()).ok(),
            (None, _) => None,
        };
        // Its faces are sorted, which takes more memory than the mesh.
        let fits = |mesh: &&TetMesh| self.mesh.check_bytes("info", mesh.bytes() as u64 + MeshReport::working_bytes(mesh)).is_ok();
        let report = holds.mesh.as_ref().filter(fits).map(MeshReport::new);
        if holds.mesh.is_some() && report.is_none() {
            holds.notes.push("volume, boundary, parts and damage were not looked for: that takes more than --memory".into());
        }
        self.write_json(|| holds.numbers(report.as_ref()))?;
        if !self.is_json_only() {
            holds.describe(&mut io::stdout().lock(), report.as_ref(), shown.as_ref())?;
        }
        Ok(())
    }

    fn is_json_only(&self) -> bool {
        self.json.as_ref().is_some_and(|path| path.as_os_str() == "-")
    }

    fn write_json(&self, numbers: impl Fn() -> Value) -> Result<()> {
        let Some(path) = &self.json else { return Ok(()) };
        let text = serde_json::to_string_pretty(&numbers()).context("the numbers as JSON")? + "\n";
        if self.is_json_only() {
            return Ok(io::stdout().lock().write_all(text.as_bytes())?);
        }
        write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
    }
}

/// The steps of a series, none of them read.
fn list(out: &mut impl Write, series: &Series) -> io::Result<()> {
    let (steps, [first, last]) = (series.steps(), series.span());
    writeln!(out, "steps         {}, times {first} .. {last}", steps.len())?;
    for (i, step) in steps.iter().enumerate() {
        let missing = if step.exists() { "" } else { "  (missing)" };
        writeln!(out, "step {i:<8} {}  {}{missing}", step.time, step.path.display())?;
    }
    writeln!(out, "--time T or --time-step N say what a step holds")
}

/// What a file of cells holds, as it holds it, and its tets.
struct Holds {
    points: usize,
    cells: Vec<(CellType, u64)>,
    /// Arrays of the file: over points, over cells.
    arrays: [Vec<ArrayRange>; 2],
    /// `None` if no cell has a volume.
    mesh: Option<TetMesh>,
    notes: Vec<String>,
}

/// An array and the range of each component.
struct ArrayRange {
    name: String,
    components: usize,
    /// Lowest and highest finite value, `None` where there is none.
    ranges: Vec<Option<[f64; 2]>>,
    missing: usize,
}

impl Holds {
    /// Of a file whose cells are of any type.
    fn cells(grid: UnstructuredGrid) -> Result<Self> {
        let (points, cells) = (grid.points.len(), grid.cells.counts());
        let arrays = [&grid.point_data, &grid.cell_data].map(|arrays| arrays.iter().map(ArrayRange::new).collect());
        if cells.iter().all(|(cell_type, _)| cell_type.dimension() != Some(3)) {
            return Ok(Holds { points, cells, arrays, mesh: None, notes: grid.notes });
        }
        let mesh = TetMesh::new(to_tets(grid)?)?;
        let notes = mesh.notes().to_vec();
        Ok(Holds { points, cells, arrays, mesh: Some(mesh), notes })
    }

    /// Of a file that was read as tets.
    fn mesh(mesh: TetMesh) -> Self {
        let cells = mesh.file_cells();
        let mut counts = std::collections::BTreeMap::<CellType, u64>::new();
        for tet in 0..mesh.tets().len() {
            let is_first = tet == 0 || cells.number(tet - 1) != cells.number(tet);
            *counts.entry(cells.cell_type(tet)).or_default() += u64::from(is_first);
        }
        let arrays = [mesh.point_data(), mesh.cell_data()].map(|arrays| arrays.iter().map(ArrayRange::new).collect());
        Holds { points: mesh.points().len(), cells: counts.into_iter().collect(), arrays, notes: mesh.notes().to_vec(), mesh: Some(mesh) }
    }

    fn describe(&self, out: &mut impl Write, report: Option<&MeshReport>, shown: Option<&ScalarField>) -> io::Result<()> {
        writeln!(out, "points        {}", self.points)?;
        let is_tets = self.cells.iter().all(|&(cell_type, _)| cell_type == CellType::TETRA);
        if !is_tets || self.mesh.is_none() {
            writeln!(out, "cells         {}", self.cells.iter().map(|(_, count)| count).sum::<u64>())?;
            for &(cell_type, count) in &self.cells {
                let (one, several) = cell_type.name();
                writeln!(out, "  {count:<11} {}", if count == 1 { one } else { several })?;
            }
        }
        match (&self.mesh, report) {
            (Some(mesh), report) => self.describe_mesh(out, mesh, report)?,
            (None, _) => writeln!(out, "tets          0: no cell has a volume; octetra compare measures distances to surfaces")?,
        }
        for (of, arrays) in ["point", "cell"].into_iter().zip(&self.arrays) {
            for array in arrays {
                let mark = if shown.is_some_and(|f| f.name == array.name) { "  <- shown" } else { "" };
                writeln!(out, "{of:<5} array   {}  {}{mark}", array.name, array.in_words())?;
            }
        }
        // A metric is no array of the file.
        let is_listed = |field: &&ScalarField| self.arrays.iter().flatten().any(|array| array.name == field.name);
        if let Some(field) = shown.filter(|field| !is_listed(field)) {
            writeln!(out, "cell  array   {}  {} .. {}  <- shown", field.name, field.range[0], field.range[1])?;
        }
        self.notes.iter().try_for_each(|note| writeln!(out, "note          {note}"))
    }

    fn describe_mesh(&self, out: &mut impl Write, mesh: &TetMesh, report: Option<&MeshReport>) -> io::Result<()> {
        let (bounds, center) = (mesh.bounds(), mesh.center());
        let (min, max, size) = (bounds.min + center, bounds.max + center, bounds.size());
        writeln!(out, "tets          {}", mesh.tets().len())?;
        writeln!(out, "  inverted    {} (reoriented)", mesh.inverted_count())?;
        writeln!(out, "  zero volume {} (left out of volume work)", mesh.zero_volume_count())?;
        let damage = report.map_or(vec![], |report| {
            vec![
                (report.duplicate_tets, "duplicate   {} (with the corners of another)"),
                (report.overlapping_faces, "overlapping {} faces have both tets on one side"),
                (report.non_manifold_faces, "shared      {} faces have three tets or more"),
                (report.coincident_points, "coincident  {} points lie where another does"),
                (report.unused_points, "unused      {} points are of no tet"),
                (report.odd_boundary_edges, "touching    {} edges of the boundary have not two of its faces"),
            ]
        });
        for (count, what) in damage {
            if count > 0 {
                writeln!(out, "  {}", what.replace("{}", &count.to_string()))?;
            }
        }
        writeln!(out, "bounds        {} .. {}, {} .. {}, {} .. {}", min.x, max.x, min.y, max.y, min.z, max.z)?;
        writeln!(out, "size          {} x {} x {}, diagonal {:.6}", size.x, size.y, size.z, bounds.diagonal())?;
        if let Some(report) = report {
            writeln!(out, "volume        {}", report.volume)?;
            writeln!(out, "boundary      {} faces, area {}", report.boundary_faces, report.boundary_area)?;
            writeln!(out, "parts         {}", report.components)?;
        }
        writeln!(out, "memory        {:.1} MiB", mesh.bytes() as f64 / f64::from(1 << 20))?;
        let depth = OctreeParams::default().uniform_depth(mesh.tets().len() - mesh.zero_volume_count());
        writeln!(out, "octree        uniform to depth {depth} by default")
    }

    fn numbers(&self, report: Option<&MeshReport>) -> Value {
        let cells: serde_json::Map<_, _> = self.cells.iter().map(|(cell_type, count)| (cell_type.key(), json!(count))).collect();
        let arrays: Vec<Value> = ["points", "cells"]
            .into_iter()
            .zip(&self.arrays)
            .flat_map(|(of, arrays)| arrays.iter().map(move |array| (of, array)))
            .map(|(of, a)| json!({ "name": a.name, "of": of, "components": a.components, "range": a.ranges, "missing": a.missing }))
            .collect();
        let mesh = self.mesh.as_ref().map(|mesh| {
            let (bounds, center) = (mesh.bounds(), mesh.center());
            let mut numbers = json!({
                "tets": mesh.tets().len(), "inverted": mesh.inverted_count(), "zero_volume": mesh.zero_volume_count(),
                "bounds": [(bounds.min + center).to_array(), (bounds.max + center).to_array()],
                "bytes": mesh.bytes(),
            });
            if let Some(report) = report {
                for (key, number) in [
                    ("volume", json!(report.volume)),
                    ("boundary_faces", json!(report.boundary_faces)),
                    ("boundary_area", json!(report.boundary_area)),
                    ("odd_boundary_edges", json!(report.odd_boundary_edges)),
                    ("components", json!(report.components)),
                    ("non_manifold_faces", json!(report.non_manifold_faces)),
                    ("overlapping_faces", json!(report.overlapping_faces)),
                    ("duplicate_tets", json!(report.duplicate_tets)),
                    ("coincident_points", json!(report.coincident_points)),
                    ("unused_points", json!(report.unused_points)),
                ] {
                    numbers[key] = number;
                }
            }
            numbers
        });
        json!({ "points": self.points, "cells": cells, "arrays": arrays, "mesh": mesh, "notes": self.notes })
    }
}

fn volume_numbers(grid: &Grid) -> Value {
    let (frame, bounds) = (grid.frame(), grid.bounds().translated(grid.center()));
    json!({
        "points": frame.points(),
        "volume": {
            "dims": frame.dims, "spacing": frame.spacing().to_array(), "origin": frame.origin.to_array(), "type": grid.samples().type_name(),
            "bounds": [bounds.min.to_array(), bounds.max.to_array()],
        },
        "arrays": [{ "name": grid.name(), "of": "points", "components": 1, "range": [grid.range()], "missing": grid.missing() }],
        "notes": grid.notes(),
    })
}

fn describe_volume(out: &mut impl Write, grid: &Grid) -> io::Result<()> {
    let (frame, bounds) = (grid.frame(), grid.bounds().translated(grid.center()));
    let ([x, y, z], spacing, size, [lo, hi]) = (frame.dims, frame.spacing(), bounds.size(), grid.range());
    let missing = if grid.missing() > 0 { format!("  ({} missing)", grid.missing()) } else { String::new() };
    writeln!(out, "volume        {x} x {y} x {z} points, {} voxels of {}", frame.points(), grid.samples().type_name())?;
    writeln!(out, "spacing       {} x {} x {}", spacing.x, spacing.y, spacing.z)?;
    writeln!(out, "origin        {}, {}, {}", frame.origin.x, frame.origin.y, frame.origin.z)?;
    for (name, step, length) in
        [("x", frame.steps.x_axis, spacing.x), ("y", frame.steps.y_axis, spacing.y), ("z", frame.steps.z_axis, spacing.z)]
    {
        let direction = step / length;
        writeln!(out, "axis {name}        {:.6}, {:.6}, {:.6}", direction.x, direction.y, direction.z)?;
    }
    let (min, max) = (bounds.min, bounds.max);
    writeln!(out, "bounds        {} .. {}, {} .. {}, {} .. {}", min.x, max.x, min.y, max.y, min.z, max.z)?;
    writeln!(out, "size          {} x {} x {}, diagonal {:.6}", size.x, size.y, size.z, bounds.diagonal())?;
    let mapped = if grid.samples().is_mapped() { ", mapped from the file" } else { "" };
    writeln!(out, "memory        {:.1} MiB{mapped}", grid.samples().bytes() as f64 / f64::from(1 << 20))?;
    writeln!(out, "point array   {}  {lo} .. {hi}{missing}  <- shown", grid.name())?;
    grid.notes().iter().try_for_each(|note| writeln!(out, "note          {note}"))
}

impl ArrayRange {
    fn new(array: &DataArray) -> Self {
        let mut missing = 0;
        let range = |component: usize| {
            let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
            for tuple in 0..array.tuples() {
                let value = array.values.get(tuple * array.components + component);
                if value.is_finite() {
                    (lo, hi) = (lo.min(value), hi.max(value));
                } else {
                    missing += 1;
                }
            }
            (lo <= hi).then_some([lo, hi])
        };
        let ranges = (0..array.components).map(range).collect();
        ArrayRange { name: array.name.clone(), components: array.components, ranges, missing }
    }

    /// Ranges by component, at most nine, and how many values are missing.
    fn in_words(&self) -> String {
        let range = |range: &Option<[f64; 2]>| range.map_or("no finite value".into(), |[lo, hi]| format!("{lo} .. {hi}"));
        let mut texts: Vec<String> = self.ranges.iter().take(9).map(range).collect();
        if self.components > 9 {
            texts.push(format!("and {} more components", self.components - 9));
        }
        let missing = if self.missing > 0 { format!("  ({} missing)", self.missing) } else { String::new() };
        texts.join(", ") + &missing
    }
}
