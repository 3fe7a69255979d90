//! The command line: one file a subcommand, each a list of library calls.

mod args;
mod bench;
mod bricks;
mod colormap;
mod compare;
mod convert;
mod formats;
mod generate;
mod info;
mod long_work;
mod mode;
mod mode_table;
mod probe;
mod quality;
mod regularize;
mod render;
mod report;
mod segy;
mod sequence;
mod session;
mod skip_table;
mod slice;
mod slice_bench;
mod steps;
mod subject;
mod transfer;
mod tune;
mod usage;
mod view;

use clap::{Parser, Subcommand};
pub use render::one_line;
pub use usage::exit_status;

/// See inside tetrahedral meshes: an adaptive octree texture, ray-marched on the GPU, with an exact renderer beside it.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 110, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    view: view::ViewCommand,
}

const EXAMPLES: &str = "\
Examples:
  octetra render -o wing.png                        a picture of the bundled mesh
  octetra render flow.vtu --array pressure --orbit 3 --size 1024x768
  octetra flow.vtu                                  the window
  octetra info flow.vtu                             what a file holds
  octetra compare exact.png octree.png              how far one picture is from another

Exit status: 0 done, 1 it could not be done (one line says why), 2 wrong usage.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Draw a mesh into a PNG, without a window
    Render(render::RenderCommand),
    /// Open the window
    View(view::ViewCommand),
    /// Say what a file holds
    Info(info::InfoCommand),
    /// Build the octree and write its texture for other programs
    Regularize(regularize::RegularizeCommand),
    /// Say how far a picture is from a reference, or a mesh from another or from a surface
    Compare(compare::CompareCommand),
    /// Say what the data and the octree hold at points or along a line
    Probe(probe::ProbeCommand),
    /// Say how well the cells of a mesh are shaped: metrics, histograms, the worst cells
    Quality(quality::QualityCommand),
    /// Find the thresholds to take: sweep them, measure error, size and time, recommend
    Tune(tune::TuneCommand),
    /// Measure build and frame times, with the paper's figures beside
    Bench(bench::BenchCommand),
    /// List, convert and write colour maps and transfer functions
    Colormap(colormap::ColormapCommand),
    /// Write a mesh of any format as .vtu or .msh
    Convert(convert::ConvertCommand),
    /// Write a volume, a seismic survey or a mesh as a store of bricks, however large it is
    Bricks(bricks::BricksCommand),
    /// Draw a slice through a store of bricks, or write its values
    Slice(slice::SliceCommand),
    /// List the formats of files that octetra reads and writes
    Formats(formats::FormatsCommand),
    /// Make a mesh that carries a known field
    Generate(generate::GenerateCommand),
}

impl Cli {
    /// Does what was asked.
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            Some(Command::Render(command)) => command.run(),
            Some(Command::View(command)) => command.run(),
            Some(Command::Info(command)) => command.run(),
            Some(Command::Regularize(command)) => command.run(),
            Some(Command::Compare(command)) => command.run(),
            Some(Command::Probe(command)) => command.run(),
            Some(Command::Quality(command)) => command.run(),
            Some(Command::Tune(command)) => command.run(),
            Some(Command::Bench(command)) => command.run(),
            Some(Command::Colormap(command)) => command.run(),
            Some(Command::Convert(command)) => command.run(),
            Some(Command::Bricks(command)) => command.run(),
            Some(Command::Slice(command)) => command.run(),
            Some(Command::Formats(command)) => command.run(),
            Some(Command::Generate(command)) => command.run(),
            None => self.view.run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::CommandFactory;

    #[test]
    fn no_two_flags_of_a_command_have_one_name() {
        Cli::command().debug_assert();
    }
}
