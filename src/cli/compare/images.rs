//! `octetra compare` of two pictures: how far one is from a reference.

use super::super::args::{check_outputs_beside, parse_not_negative, parse_number};
use crate::compare::{
    self, DEFAULT_PIXELS_PER_DEGREE, DifferenceMap, Figures, ImageComparison, Limits, Pair, Part, Verdict, compare_images, difference_map,
};
use crate::image::{read_image, write_atomically, write_bytes_png};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Flags for pictures.
#[derive(Debug, Args)]
#[command(next_help_heading = "Pictures")]
pub struct ImageArgs {
    /// Write a picture of where they differ
    #[arg(long, value_name = "OUT.png")]
    map: Option<PathBuf>,
    /// What the map shows
    #[arg(long, value_enum, default_value = "flip", requires = "map")]
    map_of: MapArg,
    /// Factor on the differences of an `abs` map
    #[arg(long, value_name = "G", default_value_t = 10.0, value_parser = parse_gain, requires = "map")]
    gain: f64,
    /// Viewing distance of FLIP [default: 67.0206, a screen 0.7 m and 3840 pixels wide seen from 0.7 m]
    #[arg(long, value_name = "P", default_value_t = DEFAULT_PIXELS_PER_DEGREE, hide_default_value = true, value_parser = parse_pixels_per_degree)]
    pub pixels_per_degree: f32,
    #[command(flatten)]
    limits: LimitArgs,
}

impl ImageArgs {
    /// A flag that only pictures have and that was given.
    pub fn named(&self) -> Option<&'static str> {
        let limits = &self.limits;
        let given = [
            ("map", self.map.is_some()),
            ("map-of", !matches!(self.map_of, MapArg::Flip)),
            ("gain", self.gain != 10.0),
            ("pixels-per-degree", self.pixels_per_degree != DEFAULT_PIXELS_PER_DEGREE),
            ("max-flip", limits.max_flip.is_some()),
            ("min-psnr", limits.min_psnr.is_some()),
            ("min-ssim", limits.min_ssim.is_some()),
        ];
        given.into_iter().find(|flag| flag.1).map(|flag| flag.0)
    }
}

/// Two pictures and what is to be said of them.
pub struct Images<'a> {
    pub reference: &'a PathBuf,
    pub image: &'a PathBuf,
    pub json: Option<&'a PathBuf>,
    pub max_difference: Option<f64>,
    pub args: &'a ImageArgs,
}

/// Limits that decide the exit status.
#[derive(Debug, Args)]
#[command(next_help_heading = "Limits for pictures (exit status 1 when one is missed)")]
struct LimitArgs {
    /// Highest mean FLIP over all pixels, 0 to 1
    #[arg(long, value_name = "X", value_parser = parse_not_negative)]
    max_flip: Option<f64>,
    /// Lowest PSNR over covered pixels, of the 8-bit pictures; over all if none is covered
    #[arg(long, value_name = "DB", value_parser = parse_not_negative)]
    min_psnr: Option<f64>,
    /// Lowest SSIM over covered pixels, up to 1
    #[arg(long, value_name = "X", value_parser = parse_ssim, allow_negative_numbers = true)]
    min_ssim: Option<f64>,
}

/// Values of `--map-of`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum MapArg {
    /// FLIP in magma colours, black 0 to pale yellow 1
    Flip,
    /// The absolute difference of each channel times the gain
    Abs,
}

impl Images<'_> {
    /// Reads, compares, writes, judges.
    pub fn run(self) -> Result<()> {
        let json_file = self.json.filter(|path| !is_stdout(path));
        check_outputs_beside(&[(self.reference, "the reference"), (self.image, "the image")], &[self.args.map.as_ref(), json_file])?;

        let named = || self.image.display().to_string();
        let (reference, image) = rayon::join(|| read_image(self.reference), || read_image(self.image));
        let pair = compare::pair(reference?, image?).with_context(named)?;
        let found = compare_images(&pair.reference, &pair.image, self.args.pixels_per_degree).with_context(named)?;
        let verdicts = self.limits().judge(&found);

        if let Some(path) = &self.args.map {
            write_bytes_png(path, &difference_map(&found, self.shown()), [found.width, found.height])?;
        }
        if let Some(path) = self.json {
            write_json(path, &self.numbers(&pair, &found, &verdicts))?;
        }
        if self.json.is_none() || json_file.is_some() {
            self.say(&mut io::stdout().lock(), &pair, &found)?;
        }
        let missed: Vec<String> = verdicts.iter().filter(|verdict| !verdict.passed).map(missed).collect();
        if !missed.is_empty() {
            bail!("{}: {}", self.image.display(), missed.join("; "));
        }
        Ok(())
    }

    fn shown(&self) -> DifferenceMap {
        match self.args.map_of {
            MapArg::Flip => DifferenceMap::Flip,
            MapArg::Abs => DifferenceMap::Absolute(self.args.gain),
        }
    }

    /// The table.
    fn say(&self, out: &mut impl Write, pair: &Pair, found: &ImageComparison) -> io::Result<()> {
        let covered = found.covered.map_or(0, |part| part.figures.pixels);
        writeln!(out, "reference     {}", self.reference.display())?;
        writeln!(out, "image         {}", self.image.display())?;
        writeln!(out, "pixels        {} x {}, {covered} covered ({})", found.width, found.height, found.coverage.text())?;
        if let Some([lo, hi]) = pair.range {
            writeln!(out, "values        {lo} .. {hi} in the reference; differences are in parts of this range")?;
        }
        let row = |out: &mut dyn Write, name: &str, [all, covered]: [String; 2]| writeln!(out, "{name:<14}{all:<14}{covered}");
        let parts = [Some(found.all), found.covered];
        writeln!(out)?;
        row(out, "", ["all pixels".into(), "covered".into()])?;
        say_figures(out, "", parts.map(|part| part.map(|part| part.figures)))?;
        row(out, "SSIM", parts.map(|part| text(part.and_then(|part| part.ssim), |v| format!("{v:.5}"))))?;
        row(out, "FLIP", [Some(found.flip.mean), found.flip.covered_mean].map(|mean| text(mean, |v| format!("{v:.5}"))))?;
        if let Some(raw) = found.raw {
            say_figures(out, "float ", raw)?;
        }
        writeln!(out)?;
        let flip = &found.flip;
        writeln!(out, "FLIP          p99 {:.5}, max {:.5}, at {:.4} pixels per degree", flip.p99, flip.max, flip.pixels_per_degree)?;
        if let Some(alpha) = found.alpha {
            writeln!(
                out,
                "alpha         RMSE {:.3e}, largest difference {:.3e}, largest outside the covered pixels {:.3e}, {} pixels in one only",
                alpha.rmse, alpha.max_difference, alpha.max_outside, alpha.only_in_one
            )?;
        }
        if let (Some(path), DifferenceMap::Absolute(gain)) = (&self.args.map, self.shown()) {
            writeln!(out, "map           {}, absolute differences times {gain}", path.display())?;
        }
        Ok(())
    }

    /// Everything as JSON.
    fn numbers(&self, pair: &Pair, found: &ImageComparison, verdicts: &[Verdict]) -> Value {
        let part = |part: Part, flip: Option<f64>| {
            let mut all = figures(part.figures);
            all["ssim"] = json!(part.ssim);
            all["flip_mean"] = json!(flip);
            all
        };
        let limit = |v: &Verdict| json!({ "value": v.value.filter(|v| v.is_finite()), "limit": v.limit, "passed": v.passed });
        let map = self.args.map.as_ref().map(|path| match self.shown() {
            DifferenceMap::Flip => json!({ "file": path, "of": "flip" }),
            DifferenceMap::Absolute(gain) => json!({ "file": path, "of": "abs", "gain": gain }),
        });
        json!({
            "reference": self.reference.display().to_string(), "image": self.image.display().to_string(),
            "width": found.width, "height": found.height, "identical": found.is_identical,
            "coverage": found.coverage.text(), "value_range": pair.range,
            "all": part(found.all, Some(found.flip.mean)),
            "covered": found.covered.map(|covered| part(covered, found.flip.covered_mean)),
            "flip": {
                "mean": found.flip.mean, "p99": found.flip.p99, "max": found.flip.max, "pixels_per_degree": found.flip.pixels_per_degree,
            },
            "float": found.raw.map(|[all, covered]| json!({ "all": all.map(figures), "covered": covered.map(figures) })),
            "alpha": found.alpha.map(|alpha| json!({
                "rmse": alpha.rmse, "max_difference": alpha.max_difference, "max_outside": alpha.max_outside, "only_in_one": alpha.only_in_one,
            })),
            "map": map,
            "limits": verdicts.iter().map(|verdict| (verdict.name.to_owned(), limit(verdict))).collect::<serde_json::Map<_, _>>(),
        })
    }
}

/// Writes numbers to a file, or to stdout for `-`.
pub fn write_json(path: &Path, numbers: &Value) -> Result<()> {
    let text = serde_json::to_string_pretty(numbers).context("the numbers as JSON")? + "\n";
    if is_stdout(path) {
        return Ok(io::stdout().lock().write_all(text.as_bytes())?);
    }
    write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
}

impl Images<'_> {
    fn limits(&self) -> Limits {
        let limits = &self.args.limits;
        let max_difference = self.max_difference;
        Limits { max_flip: limits.max_flip, min_psnr_db: limits.min_psnr, min_ssim: limits.min_ssim, max_difference }
    }
}

pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// A limit that was missed, in words.
fn missed(verdict: &Verdict) -> String {
    let flag = verdict.name.replace('_', "-");
    let (side, unit) = if flag.starts_with("max") { ("above", "") } else { ("below", if flag == "min-psnr" { " dB" } else { "" }) };
    match verdict.value {
        Some(value) => format!("{} is {}{unit}, {side} --{flag} {}", verdict.of, significant(value), verdict.limit),
        None => format!("--{flag} needs images of at least 11 x 11 pixels"),
    }
}

/// Six significant digits at most, as few as say the same.
pub fn significant(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    rounded.to_string()
}

fn text(value: Option<f64>, say: impl Fn(f64) -> String) -> String {
    value.map_or("-".into(), say)
}

/// The rows of PSNR, RMSE and largest difference, over all and over covered pixels.
fn say_figures(out: &mut dyn Write, prefix: &str, parts: [Option<Figures>; 2]) -> io::Result<()> {
    let psnr = |f: Figures| if f.is_identical() { "identical".into() } else { format!("{:.2} dB", f.psnr_db()) };
    let rows: [(&str, &dyn Fn(Figures) -> String); 3] =
        [("PSNR", &psnr), ("RMSE", &|f| format!("{:.3e}", f.rmse)), ("largest", &|f| format!("{:.3e}", f.max_difference))];
    for (name, say) in rows {
        let [all, covered] = parts.map(|part| part.map_or("-".into(), say));
        writeln!(out, "{:<14}{all:<14}{covered}", format!("{prefix}{name}"))?;
    }
    Ok(())
}

fn figures(figures: Figures) -> Value {
    let psnr = figures.psnr_db();
    json!({
        "pixels": figures.pixels, "identical": figures.is_identical(), "psnr_db": psnr.is_finite().then_some(psnr),
        "rmse": figures.rmse, "max_difference": figures.max_difference,
    })
}

fn parse_gain(text: &str) -> Result<f64, String> {
    parse_number(text, |v| v > 0.0, "a number above 0")
}

fn parse_ssim(text: &str) -> Result<f64, String> {
    parse_number(text, |v| (-1.0..=1.0).contains(&v), "a number from -1 to 1")
}

fn parse_pixels_per_degree(text: &str) -> Result<f32, String> {
    parse_number(text, |v| (1.0..=1000.0).contains(&v), "a number from 1 to 1000").map(|v| v as f32)
}
