//! `octetra formats`: what files octetra reads and writes.

use crate::format::FORMATS;
use anyhow::Result;
use clap::Args;
use std::io::{self, Write};

/// `octetra formats`.
#[derive(Debug, Args)]
pub struct FormatsCommand {}

impl FormatsCommand {
    /// Prints the table.
    pub fn run(self) -> Result<()> {
        let mut out = io::stdout().lock();
        writeln!(out, "{:<36}{:<40}holds", "format", "suffixes")?;
        for format in FORMATS {
            let suffixes = format.suffixes.iter().map(|suffix| format!(".{suffix}")).collect::<Vec<_>>().join(" ");
            let writes = if ["vtu", "msh"].iter().any(|suffix| format.suffixes.contains(suffix)) { ", written too" } else { "" };
            writeln!(out, "{:<36}{suffixes:<40}{}{writes}", format.name, format.holds())?;
        }
        writeln!(out, "{:<36}{:<40}a volume, with --dims and --type", "plain bytes", "any")?;
        Ok(writeln!(out, "A file is told by its content, or else by its suffix; \"octetra convert\" writes .vtu and .msh.")?)
    }
}
