//! The program: parse, run, print one error line, exit status.

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match octetra::cli::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Where even this cannot be said, the exit status says it.
            let _ = writeln!(std::io::stderr(), "octetra: {}", octetra::cli::one_line(&format!("{error:#}")));
            octetra::cli::exit_status(&error).into()
        }
    }
}
