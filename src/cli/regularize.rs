//! `octetra regularize`: the octree texture for other programs.

use super::args::{MeshArgs, OctreeArgs, RawArgs, check_outputs};
use super::render::{measure_error, unmet_in_words};
use super::report::Report;
use super::subject::{read_subject, regularized};
use crate::geometry::Placed;
use crate::image::{write_atomically, write_values_npy};
use crate::octree::{LATTICE, OctreeTexture};
use crate::study::FieldError;
use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// `octetra regularize`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  octetra regularize flow.vtu --texture flow.npy --max-depth 8

OUT.npy is uint8 of shape (z, y, x, 4); OUT.json beside it holds root origin and edge in world units, what the values 0 and 1 stand for,
the depth and the parameters. README describes the texels.")]
pub struct RegularizeCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    octree: OctreeArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Write the octree texture, and its description as JSON under the same name
    #[arg(long, value_name = "OUT.npy", help_heading = "Output")]
    texture: Option<PathBuf>,
    /// Write the samples at the children's corners: float32 of shape (blocks, 3, 3, 3), z slowest, in the texture's order of blocks
    #[arg(long, value_name = "OUT.npy", help_heading = "Output")]
    corners: Option<PathBuf>,
    /// Write what was measured
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    stats: Option<PathBuf>,
}

impl RegularizeCommand {
    /// Reads, regularizes, writes, and says what came out.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        let description = self.texture.as_ref().map(|path| path.with_extension("json"));
        check_outputs(&self.mesh, &[self.texture.as_ref(), description.as_ref(), self.corners.as_ref(), self.stats.as_ref()])?;
        let start = Instant::now();
        let subject = read_subject(&self.mesh, &self.volume)?;
        let mut report = Report::new(&subject, start.elapsed().as_secs_f64());
        report.params(&self.mesh, subject.array(), &self.octree, None)?;

        let start = Instant::now();
        let tree = regularized(&self.mesh, &subject, &self.octree.params())?;
        let texture = OctreeTexture::encode(&tree)?;
        let seconds = start.elapsed().as_secs_f64();
        report.set("time", "regularize", seconds);
        report.octree(&tree, &texture, subject.center());
        let (error, bound) = measure_error(&subject, &texture, tree.params.tolerance, &mut report)?;

        if let (Some(path), Some(description)) = (&self.texture, &description) {
            let size = texture.size();
            let shape = [size.z, size.y, size.x, 4].map(u64::from);
            write_values_npy(path, &shape, texture.texels().as_flattened()).with_context(|| path.display().to_string())?;
            let origin = texture.root_min() + subject.center();
            let about = json!({
                "root_origin": origin.to_array(), "root_edge": texture.root_edge(), "value_range": texture.value_range(),
                "array": subject.array(), "depth": texture.depth(), "params": tree.params,
            });
            let text = serde_json::to_string_pretty(&about).context("the description as JSON")? + "\n";
            write_atomically(description, |out| out.write_all(text.as_bytes())).with_context(|| description.display().to_string())?;
        }
        if let Some(path) = &self.corners {
            ensure!(!texture.bricks().is_empty(), "there are no samples at corners with --reconstruction leaf");
            let samples: Vec<f32> = texture.bricks().iter().flat_map(|brick| (0..LATTICE).map(|i| brick.get(i))).collect();
            let shape = [texture.bricks().len() as u64, 3, 3, 3];
            write_values_npy(path, &shape, &samples).with_context(|| path.display().to_string())?;
        }
        self.stats.as_deref().map(|path| report.write(path)).transpose()?;
        let mut out = std::io::stdout().lock();
        writeln!(
            out,
            "nodes    {} ({} interior, {} leaves), {} empty",
            tree.node_count(),
            tree.interior_count(),
            tree.leaf_count(),
            tree.empty_count()
        )?;
        writeln!(out, "texture  {} texels, {:.2} MiB", texture.size(), texture.bytes() as f64 / f64::from(1 << 20))?;
        writeln!(out, "error    {}", in_words(&error))?;
        if let Some(bound) = bound {
            writeln!(out, "bound    {} nowhere exceeded", percent(bound.bound_rel))?;
        }
        if let Some(unmet) = &tree.unmet {
            writeln!(out, "unmet    {}", unmet_in_words(unmet, subject.center()))?;
        }
        writeln!(out, "time     {seconds:.3} s")?;
        Ok(())
    }
}

/// The measured error as one line.
fn in_words(error: &FieldError) -> String {
    let f = error.by_volume;
    if f.points == 0 {
        return "not measured: the octree is empty".into();
    }
    let at = f.max_at.map_or(String::new(), |at| format!(" at ({:.4}, {:.4}, {:.4})", at.x, at.y, at.z));
    let uncovered = if f.uncovered > 0.0 { format!(", {} of the volume empty", percent(f.uncovered)) } else { String::new() };
    let above = f.above_tolerance.filter(|&share| share > 0.0);
    let above = above.map_or(String::new(), |share| format!(", {} of the volume above the tolerance", percent(share)));
    format!("rmse {}, max {}{at}, PSNR {:.1} dB{above}{uncovered}", percent(f.rmse_rel), percent(f.max_rel), f.psnr_db)
}

/// A share in percent, with two digits that count.
fn percent(share: f64) -> String {
    let percent = share * 100.0;
    let digits = if percent > 0.0 { (1.0 - percent.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{percent:.digits$} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_keep_two_digits() {
        let said = [0.0, 0.5, 0.031, 0.00124, 1.0, 5.2e-8].map(percent);
        assert_eq!(said, ["0 %", "50 %", "3.1 %", "0.12 %", "100 %", "0.0000052 %"]);
    }
}
