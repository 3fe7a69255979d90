//! The program as a user runs it.

use std::path::Path;
use std::process::{Command, Output};

/// Runs octetra in a folder.
pub fn octetra(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_octetra")).current_dir(folder).args(args).output().expect("the program starts")
}

/// Runs octetra, which must succeed; gives what it printed.
pub fn done(folder: &Path, args: &[&str]) -> String {
    let output = octetra(folder, args);
    assert!(output.status.success(), "octetra {args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}
