//! The program: parse, run, print one error line, exit status.

fn main() {}
