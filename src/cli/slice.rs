//! `octetra slice`: the picture of a slice through a store of bricks.

use super::args::{check_outputs_beside, parse_bytes};
use super::long_work::with_bar;
use super::transfer::TransferArgs;
use crate::bricks::{BrickSource, Interpolation, Slice, SliceFrame, Store};
use crate::image::{Background, Image, write_png, write_values_npy};
use crate::optics::Classifier;
use crate::view::{Plane, PlaneUse, TransferFunction};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use glam::DVec3;
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::PathBuf;

/// The longest edge of a picture whose size is not named, pixels.
const LONGEST: u32 = 4096;

/// `octetra slice`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra slice survey.zarr --voxel z=100 -o inline_100.png --tf coolwarm --range -5000,5000
  octetra slice survey.zarr --plane 600,400,-900:1,1,0.2 --size 1024 -o oblique.png
  octetra slice survey.zarr --voxel x=12 -o slice.npy        the values themselves: float64, NaN where there is none

--voxel counts voxels of the finest level from 0, along the axes of the volume; of a SEG-Y survey x is the sample, y the crossline, z the
inline. Across x the picture shows y to the right and z up, across y x and z, across z x and y. octetra bricks makes stores.")]
#[command(group = clap::ArgGroup::new("where").required(true).args(["voxel", "plane"]))]
pub struct SliceCommand {
    /// The store, a folder that octetra bricks wrote
    store: PathBuf,
    /// Slice across an axis of the volume at a voxel, such as z=100; between voxels with fractions
    #[arg(long, value_name = "x|y|z=N", value_parser = parse_voxel)]
    voxel: Option<(usize, f64)>,
    /// Slice along a plane in world coordinates: x=C, or a point and a normal
    #[arg(long, value_name = "x=C|X,Y,Z:NX,NY,NZ", allow_hyphen_values = true, value_parser = |text: &str| Plane::parse(text, PlaneUse::Clip))]
    plane: Option<Plane>,
    /// Pixels along the longer edge [default: one a voxel, at most 4096]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32_768))]
    size: Option<u32>,
    /// The level to read, 0 is the finest [default: the one whose voxels are as large as pixels]
    #[arg(long, value_name = "N")]
    level: Option<u8>,
    /// Show the nearest voxel's value, with no interpolation
    #[arg(long)]
    nearest: bool,
    /// Memory for bricks, such as 512MiB
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, default_value = "1GiB")]
    memory: u64,
    #[command(flatten)]
    transfer: TransferArgs,
    /// The picture, or the values
    #[arg(short, long, value_name = "OUT.png|OUT.npy", help_heading = "Output")]
    output: PathBuf,
    /// Colour where there is no value, linear RGB in [0, 1] [default: transparent]
    #[arg(long, value_name = "R,G,B", value_parser = super::args::parse_color, help_heading = "Output")]
    background: Option<[f32; 3]>,
}

impl SliceCommand {
    /// Opens the store, draws, writes, says what was drawn.
    pub fn run(self) -> Result<()> {
        check_outputs_beside(&[(&self.store, "the store")], &[Some(&self.output)])?;
        let suffix = self.output.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !matches!(suffix.as_str(), "png" | "npy") {
            bail!("{}: expected the suffix .png or .npy", self.output.display());
        }
        let changes = &self.transfer.changes;
        let is_of_opacity = self.transfer.opacity_scale != 1.0 || changes.unit_distance.is_some() || changes.threshold.is_some();
        ensure!(!is_of_opacity, "a slice is opaque: --opacity-scale, --unit-distance and --threshold have no effect on it");
        let is_of_color = self.background.is_some() || !self.transfer.flags().is_empty();
        ensure!(suffix == "png" || !is_of_color, "values have no colours: --background, --tf, --range and the like go with a .png");
        let tf = self.transfer.read(None)?;
        let store = Store::open(&self.store)?;
        let levels = store.pyramid().levels();
        if let Some(level) = self.level.filter(|&level| level >= levels) {
            bail!("--level {level}: {} has levels 0 to {}", self.store.display(), levels - 1);
        }
        let frame = self.frame(&store)?;
        let level = self.level.unwrap_or_else(|| frame.level(levels));
        let interpolation = if self.nearest { Interpolation::Nearest } else { Interpolation::Linear };
        let slice = with_bar(|progress| Slice::draw(&store, &frame, level, interpolation, self.memory, progress))?;
        if suffix == "npy" {
            let shape = [u64::from(slice.size[1]), u64::from(slice.size[0])];
            write_values_npy(&self.output, &shape, &slice.values).with_context(|| self.output.display().to_string())?;
        } else {
            let background = self.background.map_or(Background::Transparent, Background::Color);
            write_png(&self.output, &colored(&slice, &tf, store.range()), background)?;
        }
        let known = slice.values.iter().filter(|value| !value.is_nan());
        let [low, high] = known.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
        let mut out = io::stdout().lock();
        writeln!(out, "slice         {} x {} pixels of level {level}, {} bricks read", slice.size[0], slice.size[1], slice.bricks)?;
        match low <= high {
            true => writeln!(out, "values        {low} to {high}")?,
            false => writeln!(out, "values        none, the slice is empty")?,
        }
        Ok(())
    }

    /// Where the pixels lie.
    fn frame(&self, store: &Store) -> Result<SliceFrame> {
        let dims = store.pyramid().dims(0);
        if let Some((axis, position)) = self.voxel {
            let last = f64::from(dims[axis]) - 1.0;
            if !(0.0..=last).contains(&position) {
                bail!("--voxel {}={position}: expected 0 to {last}", ["x", "y", "z"][axis]);
            }
            let frame = SliceFrame::across(dims, axis, position, 0);
            let longest = frame.size[0].max(frame.size[1]);
            return Ok(match self.size.unwrap_or(longest.min(LONGEST)) {
                wanted if wanted == longest => frame,
                wanted => frame.scaled(f64::from(wanted) / f64::from(longest)),
            });
        }
        let Some(plane) = self.plane else { bail!("one of --voxel and --plane is needed") };
        let longest = self.size.unwrap_or_else(|| {
            let diagonal = DVec3::from(dims.map(f64::from)).length();
            (diagonal as u32).clamp(1, LONGEST)
        });
        SliceFrame::oblique(store.frame(), plane.point, plane.normal, DVec3::Z, longest)
            .with_context(|| format!("--plane: misses {}", self.store.display()))
    }
}

/// The values in the colours of a transfer function; opacity has no part in it.
fn colored(slice: &Slice, tf: &TransferFunction, range: [f64; 2]) -> Image {
    let classifier = Classifier::new(&tf.in_data(range), range, 1.0);
    let table = classifier.table(1.0);
    let color = |&value: &f64| {
        if value.is_nan() {
            return tf.nan.map_or([0.0; 4], |[r, g, b]| [r as f32, g as f32, b as f32, 1.0]);
        }
        let value = classifier.normalized(value).clamp(0.0, 1.0) as f32;
        let [r, g, b] = table.classify(table.interval(value), value).color;
        [r, g, b, 1.0]
    };
    Image { width: slice.size[0], height: slice.size[1], pixels: slice.values.par_iter().map(color).collect() }
}

fn parse_voxel(text: &str) -> Result<(usize, f64), String> {
    let expected = || "expected x=N, y=N or z=N".to_owned();
    let (axis, number) = text.split_once('=').ok_or_else(expected)?;
    let axis = ["x", "y", "z"].iter().position(|name| *name == axis.trim().to_lowercase()).ok_or_else(expected)?;
    let number: f64 = number.trim().parse().map_err(|_| expected())?;
    if number.is_finite() { Ok((axis, number)) } else { Err(expected()) }
}
