//! `octetra generate`: meshes that carry known fields.

use super::args::check_writable;
use super::long_work::with_bar;
use crate::format::vtu::write::{Compression, write_mesh};
use crate::mesh::generate::{Shape, plan};
use anyhow::Result;
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::PathBuf;

/// `octetra generate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra generate wing -o wing.vtu
  octetra generate wing --tets 10000000 -o large.vtu     streamed: memory does not grow with the size
  octetra generate cube --tets 6000 --compress -o cube.vtu")]
pub struct GenerateCommand {
    /// What to make
    #[arg(value_enum)]
    shape: ShapeArg,
    /// About how many tets [default: the size of the mesh in meshes/]
    #[arg(long, value_name = "N")]
    tets: Option<u64>,
    /// Store zlib blocks instead of plain data; keeps the compressed file in memory until it is written
    #[arg(long)]
    compress: bool,
    /// The file [default: the shape's name with .vtu, in the current folder]
    #[arg(short, long, value_name = "OUT.vtu")]
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
}

impl GenerateCommand {
    /// Plans the mesh and streams it to the file.
    pub fn run(self) -> Result<()> {
        let shape = match self.shape {
            ShapeArg::Cube => Shape::Cube,
            ShapeArg::Ball => Shape::Ball,
            ShapeArg::Wing => Shape::Wing,
        };
        let output = self.output.unwrap_or_else(|| format!("{}.vtu", shape.name()).into());
        check_writable(&output)?;
        let mesh = plan(shape, self.tets)?;
        let compression = if self.compress { Compression::Zlib } else { Compression::None };
        with_bar(|progress| write_mesh(&output, &*mesh, compression, progress))?;
        writeln!(std::io::stdout(), "{}: {} tets, {} points", output.display(), mesh.tet_count(), mesh.point_count())?;
        Ok(())
    }
}
