//! The program: parse, run, print one error line, exit status.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match octetra::cli::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            #[expect(clippy::print_stderr, reason = "the one place where an error is said")]
            {
                eprintln!("octetra: {}", octetra::cli::one_line(&format!("{error:#}")));
            }
            octetra::cli::exit_status(&error).into()
        }
    }
}
