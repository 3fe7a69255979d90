//! Wrong usage that shows only when flags are looked at together: the program ends as where clap refuses one.

use anyhow::{Error, Result};

/// Flags that contradict each other.
#[derive(Debug, thiserror::Error)]
#[error("{0:#}")]
struct WrongUsage(Error);

/// Has what is wrong count as wrong usage.
pub fn usage<T>(result: Result<T>) -> Result<T> {
    result.map_err(|error| WrongUsage(error).into())
}

/// The exit status of an error: 2 for wrong usage, else 1.
pub fn exit_status(error: &Error) -> u8 {
    if error.is::<WrongUsage>() { 2 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn wrong_usage_is_told_from_other_errors_and_says_the_same() {
        let wrong = usage::<()>(Err(anyhow!("cause")).context("--skip")).context("render").expect_err("wrong");
        assert_eq!((exit_status(&wrong), format!("{wrong:#}")), (2, "render: --skip: cause".into()));
        assert_eq!(exit_status(&anyhow!("no such file")), 1);
    }
}
