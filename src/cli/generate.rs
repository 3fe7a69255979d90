//! `octetra generate`: meshes and volumes that carry known fields.

use super::args::check_writable;
use super::long_work::with_bar;
use crate::format::nrrd;
use crate::format::vtu::write::{Compression, write_mesh};
use crate::mesh::generate::{Shape, plan};
use crate::volume::generate::shell;
use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::PathBuf;

/// `octetra generate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra generate wing -o wing.vtu
  octetra generate wing --tets 10000000 -o large.vtu     streamed: memory does not grow with the size
  octetra generate cube --tets 6000 --compress -o cube.vtu
  octetra generate shell --dims 128 -o shell.nhdr         a volume, its data in shell.raw beside it")]
pub struct GenerateCommand {
    /// What to make
    #[arg(value_enum)]
    shape: ShapeArg,
    /// About how many tets [default: the size of the mesh in meshes/]
    #[arg(long, value_name = "N")]
    tets: Option<u64>,
    /// Points along each side of a volume, 2 to 1024 [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1024))]
    dims: Option<u32>,
    /// Store zlib blocks instead of plain data; keeps the compressed file in memory until it is written
    #[arg(long)]
    compress: bool,
    /// The file: .vtu for meshes; .nrrd, or .nhdr with its data beside it, for volumes [default: the shape's name, in the current folder]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
}

/// Values of `SHAPE`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShapeArg {
    /// The unit cube with a linear field
    Cube,
    /// The unit ball with a radial field
    Ball,
    /// A wing in its exact potential flow
    Wing,
    /// A volume: a hollow shell
    Shell,
}

impl GenerateCommand {
    /// Plans the mesh and streams it to the file.
    pub fn run(self) -> Result<()> {
        let shape = match self.shape {
            ShapeArg::Cube => Shape::Cube,
            ShapeArg::Ball => Shape::Ball,
            ShapeArg::Wing => Shape::Wing,
            ShapeArg::Shell => return self.volume(),
        };
        ensure!(self.dims.is_none(), "--dims is for volumes; --tets says how large a mesh is");
        let output = self.output.unwrap_or_else(|| format!("{}.vtu", shape.name()).into());
        check_writable(&output)?;
        let mesh = plan(shape, self.tets)?;
        let compression = if self.compress { Compression::Zlib } else { Compression::None };
        with_bar(|progress| write_mesh(&output, &*mesh, compression, progress))?;
        writeln!(std::io::stdout(), "{}: {} tets, {} points", output.display(), mesh.tet_count(), mesh.point_count())?;
        Ok(())
    }

    /// Makes the volume and writes it.
    fn volume(self) -> Result<()> {
        ensure!(self.tets.is_none(), "--tets is for meshes; --dims says how large a volume is");
        ensure!(!self.compress, "--compress is for meshes; volumes are written as plain bytes");
        let output = self.output.unwrap_or_else(|| "shell.nhdr".into());
        let suffix = output.extension().map(|suffix| suffix.to_string_lossy().to_lowercase());
        ensure!(matches!(suffix.as_deref(), Some("nrrd" | "nhdr")), "{}: expected a name with .nrrd or .nhdr", output.display());
        check_writable(&output)?;
        let grid = shell(self.dims.unwrap_or(128))?;
        with_bar(|progress| nrrd::write(&output, &grid, progress)).with_context(|| output.display().to_string())?;
        let [x, y, z] = grid.frame().dims;
        writeln!(std::io::stdout(), "{}: {x} x {y} x {z} points", output.display())?;
        Ok(())
    }
}
