//! `octetra info`: what a file holds.

use super::args::{MeshArgs, RawArgs};
use super::subject::read_data;
use crate::format::{Data, Series};
use crate::geometry::Placed;
use crate::mesh::{DataArray, ScalarField, TetMesh};
use crate::octree::OctreeParams;
use crate::volume::Grid;
use anyhow::Result;
use clap::Args;
use std::io::{self, Write};

/// `octetra info`.
#[derive(Debug, Args)]
pub struct InfoCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    volume: RawArgs,
}

impl InfoCommand {
    /// Reads the mesh or volume and says what it holds; of a series of which no step is chosen, lists the steps.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        if let (Some(series), None, None) = (self.mesh.series(), self.mesh.steps.time, self.mesh.steps.time_step) {
            return Ok(list(&mut io::stdout().lock(), series)?);
        }
        let mesh = match read_data(&self.mesh, &self.volume, false)? {
            Data::Mesh(mesh) => mesh,
            Data::Grid(grid) => return Ok(describe_volume(&mut io::stdout().lock(), &grid)?),
        };
        let field = match self.mesh.array {
            Some(_) => Some(self.mesh.field(&mesh)?),
            None => ScalarField::select(&mesh, &Default::default()).ok(),
        };
        let mut out = io::stdout().lock();
        describe(&mut out, &mesh, field.as_ref())?;
        Ok(())
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

fn describe(out: &mut impl Write, mesh: &TetMesh, shown: Option<&ScalarField>) -> io::Result<()> {
    let (bounds, center) = (mesh.bounds(), mesh.center());
    let (min, max, size) = (bounds.min + center, bounds.max + center, bounds.size());
    writeln!(out, "points        {}", mesh.points().len())?;
    writeln!(out, "tets          {}", mesh.tets().len())?;
    writeln!(out, "  inverted    {} (reoriented)", mesh.inverted_count())?;
    writeln!(out, "  zero volume {} (left out of volume work)", mesh.zero_volume_count())?;
    writeln!(out, "bounds        {} .. {}, {} .. {}, {} .. {}", min.x, max.x, min.y, max.y, min.z, max.z)?;
    writeln!(out, "size          {} x {} x {}, diagonal {:.6}", size.x, size.y, size.z, bounds.diagonal())?;
    writeln!(out, "memory        {:.1} MiB", mesh.bytes() as f64 / f64::from(1 << 20))?;
    let depth = OctreeParams::default().uniform_depth(mesh.tets().len() - mesh.zero_volume_count());
    writeln!(out, "octree        uniform to depth {depth} by default")?;
    for (of, arrays) in [("point", mesh.point_data()), ("cell", mesh.cell_data())] {
        for array in arrays {
            let mark = if shown.is_some_and(|f| f.name == array.name) { "  <- shown" } else { "" };
            writeln!(out, "{of:<5} array   {}  {}{mark}", array.name, ranges(array))?;
        }
    }
    // A metric is no array of the file.
    let is_listed = |field: &&ScalarField| mesh.point_data().iter().chain(mesh.cell_data()).any(|array| array.name == field.name);
    if let Some(field) = shown.filter(|field| !is_listed(field)) {
        writeln!(out, "cell  array   {}  {} .. {}  <- shown", field.name, field.range[0], field.range[1])?;
    }
    Ok(())
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
    writeln!(out, "point array   {}  {lo} .. {hi}{missing}  <- shown", grid.name())
}

/// Ranges by component, and how many values are missing.
fn ranges(array: &DataArray) -> String {
    let mut missing = 0;
    let mut texts = Vec::new();
    for component in 0..array.components.min(9) {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for tuple in 0..array.tuples() {
            let value = array.values.get(tuple * array.components + component);
            if value.is_finite() {
                (lo, hi) = (lo.min(value), hi.max(value));
            } else {
                missing += 1;
            }
        }
        texts.push(if lo <= hi { format!("{lo} .. {hi}") } else { "no finite value".into() });
    }
    if array.components > 9 {
        texts.push(format!("and {} more components", array.components - 9));
    }
    let missing = if missing > 0 { format!("  ({missing} missing)") } else { String::new() };
    texts.join(", ") + &missing
}
