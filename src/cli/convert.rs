//! `octetra convert`: a mesh of any format as `.vtu` or `.msh`.

use super::args::{MeshArgs, RawArgs, check_outputs_beside};
use super::long_work::with_bar;
use super::subject::read_contents;
use super::usage::usage;
use crate::format::Contents;
use crate::format::gmsh::write_grid as write_msh;
use crate::format::vtu::write::Compression;
use crate::format::vtu::write_grid::write_grid as write_vtu;
use crate::mesh::{counts_in_words, to_tets};
use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use std::io::{self, Write};
use std::path::PathBuf;

/// `octetra convert`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra convert result.e -o result.vtu                  any format that \"octetra formats\" lists
  octetra convert flow.foam --time 0.5 -o flow.vtu        a step of a series
  octetra convert bracket.vtu -o bracket.msh              Gmsh 4.1, binary; --ascii for text
  octetra convert hexes.vtk --tets -o tets.vtu            the tets that octetra draws

Cells stay what they are, unless --tets is given; all arrays are kept. Curvilinear grids become tets.")]
pub struct ConvertCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// The file to write, .vtu or .msh
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Write the tets that cells are cut into, and no other cells
    #[arg(long)]
    tets: bool,
    /// A .msh as text
    #[arg(long)]
    ascii: bool,
    /// A .vtu without compression
    #[arg(long)]
    uncompressed: bool,
}

impl ConvertCommand {
    /// Reads, cuts if wanted, writes, says what was written.
    pub fn run(mut self) -> Result<()> {
        let suffix = self.output.extension().map(|suffix| suffix.to_string_lossy().to_lowercase());
        let is_msh = match suffix.as_deref() {
            Some("msh") => true,
            Some("vtu") => false,
            _ => return usage(Err(anyhow!("{}: expected a name with .vtu or .msh", self.output.display()))),
        };
        if self.ascii && !is_msh {
            return usage(Err(anyhow!("--ascii is for .msh files; a .vtu is written in binary")));
        }
        if self.uncompressed && is_msh {
            return usage(Err(anyhow!("--uncompressed is for .vtu files; a .msh has no compression")));
        }
        self.mesh.choose_step()?;
        if let Some(path) = &self.mesh.mesh {
            check_outputs_beside(&[(path, "the mesh")], &[Some(&self.output)])?;
        }
        let grid = match read_contents(&self.mesh, &self.volume)? {
            Contents::Grid(_) => bail!("{}: is a regular volume; octetra converts meshes", self.mesh.shown_name()),
            Contents::Cells(grid) if self.tets => to_tets(grid).with_context(|| self.mesh.shown_name())?.try_into()?,
            Contents::Cells(mut grid) => {
                grid.merge_points();
                grid
            }
            Contents::Tets(mut parts) => {
                if !parts.file_cells.is_tets() && !self.tets {
                    parts.notes.push("the hexahedra of its grid were written as tets".into());
                }
                parts.try_into()?
            }
        };
        match is_msh {
            true => with_bar(|progress| write_msh(&self.output, &grid, !self.ascii, progress))?,
            false => {
                let compression = if self.uncompressed { Compression::None } else { Compression::Zlib };
                with_bar(|progress| write_vtu(&self.output, &grid, compression, progress))?;
            }
        }
        let mut out = io::stdout().lock();
        writeln!(out, "{}: {} points, {}", self.output.display(), grid.points.len(), counts_in_words(grid.cells.counts()))?;
        grid.notes.iter().try_for_each(|note| writeln!(out, "note: {note}"))?;
        Ok(())
    }
}
