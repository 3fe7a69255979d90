//! How SEG-Y is read, as flags.

use crate::format::segy::SegyOptions;
use clap::Args;

/// What a SEG-Y file may not say of itself.
#[derive(Debug, Clone, Default, PartialEq, Args)]
#[command(next_help_heading = "SEG-Y")]
pub struct SegyArgs {
    /// Byte of the inline number in a trace's header, from 1 [default: 189, or where else it is found]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=237))]
    pub iline_byte: Option<u32>,
    /// Byte of the crossline number in a trace's header, from 1 [default: 193, or where else it is found]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=237))]
    pub xline_byte: Option<u32>,
    /// Of prestack data take the traces with this offset [default: the first trace of each position]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub offset: Option<i32>,
    /// World units from sample to sample [default: the milliseconds between them]
    #[arg(long, value_name = "X", value_parser = super::args::parse_positive)]
    pub sample_step: Option<f64>,
    /// Read a file that was cut off as far as it goes
    #[arg(long)]
    pub truncated: bool,
}

/// The flags' names to clap.
pub const SEGY: [&str; 5] = ["iline_byte", "xline_byte", "offset", "sample_step", "truncated"];

impl SegyArgs {
    /// The flags that stand for options.
    pub fn of(options: &SegyOptions) -> Self {
        let SegyOptions { iline_byte, xline_byte, offset, sample_step, truncated } = *options;
        SegyArgs { iline_byte, xline_byte, offset, sample_step, truncated }
    }

    /// The options.
    pub fn options(&self) -> SegyOptions {
        let SegyArgs { iline_byte, xline_byte, offset, sample_step, truncated } = *self;
        SegyOptions { iline_byte, xline_byte, offset, sample_step, truncated }
    }

    /// The flags again.
    pub fn flags(&self) -> Vec<String> {
        let flags = [
            ("--iline-byte", self.iline_byte.map(|n| n.to_string())),
            ("--xline-byte", self.xline_byte.map(|n| n.to_string())),
            ("--offset", self.offset.map(|n| n.to_string())),
            ("--sample-step", self.sample_step.map(|n| n.to_string())),
        ];
        let with_values = flags.into_iter().filter_map(|(flag, value)| Some([flag.to_owned(), value?])).flatten();
        with_values.chain(self.truncated.then(|| "--truncated".to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Flags {
        #[command(flatten)]
        segy: SegyArgs,
    }

    #[test]
    fn flags_are_read_as_they_are_written() {
        let options = SegyOptions { iline_byte: Some(9), xline_byte: Some(21), offset: Some(-5), sample_step: Some(2.5), truncated: true };
        for options in [options, SegyOptions::default()] {
            let args = SegyArgs::of(&options);
            let parsed = Flags::try_parse_from(["x".to_owned()].into_iter().chain(args.flags())).expect("sound");
            assert_eq!((&parsed.segy, parsed.segy.options()), (&args, options));
        }
        for wrong in [["--iline-byte", "238"], ["--xline-byte", "0"], ["--sample-step", "0"], ["--sample-step", "nan"], ["--offset", "1.5"]]
        {
            assert!(Flags::try_parse_from(["x", wrong[0], wrong[1]]).is_err(), "{wrong:?}");
        }
    }
}
