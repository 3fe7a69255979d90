//! `octetra colormap`: transfer functions listed, converted, written.

use super::args::check_writable;
use super::transfer::{TransferChanges, read_named};
use crate::format::transfer_file::{self, to_paraview};
use crate::view::{ColorMap, TransferFunction};
use anyhow::{Context, Result};
use clap::Args;
use std::io::{self, Write};
use std::path::PathBuf;

/// `octetra colormap`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ColormapCommand {
    /// A preset, or a file as --tf takes it; without one, the presets are listed
    #[arg(value_name = "PRESET|FILE")]
    map: Option<String>,
    /// Where to write it [default: to the terminal]
    #[arg(short, long, value_name = "OUT.json", requires = "map")]
    output: Option<PathBuf>,
    /// As a colour map that ParaView imports, instead of octetra's JSON
    #[arg(long, requires = "map")]
    paraview: bool,
    #[command(flatten)]
    changes: TransferChanges,
}

const EXAMPLES: &str = "\
Examples:
  octetra colormap                                          the presets
  octetra colormap viridis -o tf.json                       one to edit, for --tf tf.json
  octetra colormap viridis --scale log --range 0.1,100 --paraview -o viridis_log.json
  octetra colormap \"maps.json:Blue Orange\" -o blue.json    one of ParaView's in octetra's JSON";

impl ColormapCommand {
    /// Lists, or reads and writes.
    pub fn run(self) -> Result<()> {
        let Some(map) = &self.map else { return list(&mut io::stdout().lock()) };
        if let Some(path) = &self.output {
            check_writable(path)?;
        }
        let named = read_named(map, &self.changes)?;
        match &self.output {
            Some(path) if self.paraview => transfer_file::write_paraview(path, &named.name, &named.function)?,
            Some(path) => transfer_file::write(path, &named.function)?,
            None => {
                let text = if self.paraview {
                    serde_json::to_string_pretty(&to_paraview(&named.name, &named.function).with_context(|| map.clone())?)?
                } else {
                    serde_json::to_string_pretty(&named.function)?
                };
                writeln!(io::stdout().lock(), "{text}")?;
            }
        }
        Ok(())
    }
}

fn list(out: &mut impl Write) -> Result<()> {
    for name in TransferFunction::PRESETS {
        let tf = TransferFunction::preset(name)?;
        let title = ColorMap::preset(name).map_or("colours and opacity of the reference images".into(), |map| map.name);
        writeln!(out, "{name:<10} {title} ({} colours, {} opacities)", tf.color.len(), tf.opacity.len())?;
    }
    Ok(())
}
