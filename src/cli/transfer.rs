//! Flags for transfer functions, and the files that they name.

use super::args::{parse_number, parse_positive};
use crate::format::transfer_file::{self, NamedTransfer};
use crate::view::{Scale, TransferFunction};
use anyhow::{Context, Result};
use clap::Args;
use std::path::Path;

/// A transfer function and what is changed of it.
#[derive(Debug, Clone, Args)]
pub struct TransferArgs {
    /// A preset (octetra colormap lists them), or a file: octetra's JSON or ParaView's; FILE.json:NAME of a file of many colour maps
    #[arg(long, help_heading = "Transfer function", value_name = "FILE|PRESET", default_value = "standard")]
    pub tf: String,
    #[command(flatten)]
    pub changes: TransferChanges,
    /// Multiply all extinction by this
    #[arg(long, help_heading = "Transfer function", value_name = "F", default_value_t = 1.0, value_parser = parse_positive)]
    pub opacity_scale: f64,
}

/// Changes of a transfer function; what is not named stays as its file has it.
#[derive(Debug, Clone, Default, Args)]
pub struct TransferChanges {
    /// The values that its ends stand for, data units [default: the file's, else the array's smallest and largest]
    #[arg(long, help_heading = "Transfer function", value_name = "LO,HI", allow_hyphen_values = true, value_parser = parse_range)]
    pub range: Option<[f64; 2]>,
    /// Show only values from LO to HI, data units, LO and HI included; of the volume's light, whatever its opacity is
    #[arg(long, help_heading = "Transfer function", value_name = "LO,HI", allow_hyphen_values = true, value_parser = parse_threshold)]
    pub threshold: Option<[f64; 2]>,
    /// How it follows the value: linear, log, symlog (linear up to a thousandth of the range's largest magnitude) or symlog=T (up to T)
    #[arg(long, help_heading = "Transfer function", value_name = "SCALE")]
    pub scale: Option<Scale>,
    /// World length that opacity refers to [default: the file's, else the diagonal of the bounds / 50]
    #[arg(long, help_heading = "Transfer function", value_name = "U", value_parser = parse_positive)]
    pub unit_distance: Option<f64>,
    /// So many discrete colours
    #[arg(long, help_heading = "Transfer function", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub discrete: Option<u32>,
}

impl TransferChanges {
    /// A transfer function with the changes, checked.
    fn applied(&self, mut tf: TransferFunction) -> Result<TransferFunction> {
        tf.range = self.range.or(tf.range);
        tf.threshold = self.threshold.or(tf.threshold);
        tf.scale = self.scale.unwrap_or(tf.scale);
        tf.unit_distance = self.unit_distance.or(tf.unit_distance);
        tf.steps = self.discrete.or(tf.steps);
        tf.validate()?;
        Ok(tf)
    }
}

impl TransferArgs {
    /// Reads what `--tf` names, changes and checks it; a session's function goes before it.
    pub fn read(&self, session: Option<&TransferFunction>) -> Result<TransferFunction> {
        match session {
            Some(function) => self.changes.applied(function.clone()).context("the session's transfer function"),
            None => Ok(read_named(&self.tf, &self.changes)?.function),
        }
    }

    /// With `--opacity-scale` applied, given the diagonal of the bounds.
    pub fn scaled(&self, tf: TransferFunction, diagonal: f64) -> TransferFunction {
        if self.opacity_scale == 1.0 {
            return tf;
        }
        TransferFunction { unit_distance: Some(tf.unit_distance_world(diagonal) / self.opacity_scale), ..tf }
    }

    /// The flags again, those that differ from the default.
    pub fn flags(&self) -> Vec<String> {
        let changes = &self.changes;
        let scale = changes.scale.map(|scale| match scale {
            Scale::Linear => "linear".to_owned(),
            Scale::Log => "log".to_owned(),
            Scale::Symlog(None) => "symlog".to_owned(),
            Scale::Symlog(Some(threshold)) => format!("symlog={threshold}"),
        });
        let flags = [
            ("--tf", (self.tf != "standard").then(|| self.tf.clone())),
            ("--range", changes.range.map(|[lo, hi]| format!("{lo},{hi}"))),
            ("--threshold", changes.threshold.map(|[lo, hi]| format!("{lo},{hi}"))),
            ("--scale", scale),
            ("--unit-distance", changes.unit_distance.map(|u| u.to_string())),
            ("--discrete", changes.discrete.map(|n| n.to_string())),
            ("--opacity-scale", (self.opacity_scale != 1.0).then(|| self.opacity_scale.to_string())),
        ];
        flags.into_iter().filter_map(|(flag, value)| Some([flag.to_owned(), value?])).flatten().collect()
    }
}

/// The transfer function that a preset's name or a file stands for, with changes; read and checked.
pub fn read_named(name: &str, changes: &TransferChanges) -> Result<NamedTransfer> {
    let is_path = name.contains(['.', '/', '\\']);
    let mut named = match TransferFunction::preset(name) {
        Ok(function) if !is_path => NamedTransfer { name: name.to_owned(), function },
        Err(unknown) if !is_path && !Path::new(name).exists() => return Err(unknown.into()),
        _ => transfer_file::read_one(name)?,
    };
    named.function = changes.applied(named.function).with_context(|| name.to_owned())?;
    Ok(named)
}

/// Two numbers that ascend.
fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let ascends = parse_two(text).filter(|[lo, hi]| lo < hi);
    ascends.ok_or_else(|| "expected LO,HI, two numbers with the first below the second".into())
}

/// Two numbers that do not descend.
fn parse_threshold(text: &str) -> Result<[f64; 2], String> {
    let ascends = parse_two(text).filter(|[lo, hi]| lo <= hi);
    ascends.ok_or_else(|| "expected LO,HI, two numbers with the first not above the second".into())
}

fn parse_two(text: &str) -> Option<[f64; 2]> {
    let (lo, hi) = text.split_once(',')?;
    let number = |text: &str| parse_number(text.trim(), |_| true, "").ok();
    Some([number(lo)?, number(hi)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        transfer: TransferArgs,
    }

    fn parsed(flags: &[&str]) -> TransferArgs {
        Flags::try_parse_from(["x"].iter().chain(flags)).expect("valid").transfer
    }

    #[test]
    fn flags_override_and_are_written_again() {
        let all = [
            "--tf",
            "viridis",
            "--range",
            "-2,5",
            "--threshold",
            "-1,-1",
            "--scale",
            "symlog=0.5",
            "--unit-distance",
            "3",
            "--discrete",
            "7",
            "--opacity-scale",
            "2",
        ];
        let args = parsed(&all);
        assert_eq!(args.flags(), all);
        let tf = args.read(None).expect("a preset");
        assert_eq!((tf.range, tf.scale, tf.unit_distance, tf.steps), (Some([-2.0, 5.0]), Scale::Symlog(Some(0.5)), Some(3.0), Some(7)));
        assert_eq!(tf.threshold, Some([-1.0, -1.0]));
        assert_eq!(args.scaled(tf, 100.0).unit_distance, Some(1.5));
        let plain = parsed(&[]);
        assert!(plain.flags().is_empty());
        assert_eq!(plain.scaled(plain.read(None).expect("standard"), 100.0), TransferFunction::standard());
        assert_eq!(
            parsed(&["--tf", "Cool to Warm"]).read(None).expect("ParaView's name"),
            TransferFunction::preset("coolwarm").expect("it")
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for flags in [
            ["--range", "2"],
            ["--range", "2,1"],
            ["--range", "a,b"],
            ["--threshold", "2,1"],
            ["--threshold", "1,inf"],
            ["--scale", "cubic"],
            ["--unit-distance", "0"],
            ["--discrete", "0"],
        ] {
            assert!(Flags::try_parse_from(["x"].iter().chain(&flags)).is_err(), "{flags:?}");
        }
        let error = format!("{:#}", parsed(&["--scale", "log", "--range", "-1,2"]).read(None).expect_err("no logarithm"));
        assert!(error.contains("-1 to 2"), "{error}");
        assert!(parsed(&["--tf", "jet"]).read(None).expect_err("unknown").to_string().contains("presets are"));
        assert!(parsed(&["--tf", "no/such.json"]).read(None).expect_err("missing").to_string().starts_with("no/such.json"));
    }
}
