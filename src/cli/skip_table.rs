//! `octetra bench --skip-table`: ways to skip empty space, the paper's figures beside.

use super::args::{MeshArgs, OctreeArgs, RawArgs, ViewArgs};
use super::long_work::with_bar;
use super::render::{one_line, say_if_fallen_back};
use super::subject::{read_subject, regularized};
use crate::geometry::{Aabb, Placed};
use crate::gpu::GpuError;
use crate::octree::OctreeTexture;
use crate::render::{RenderError, Renderer, Scene};
use crate::study::{PaperSkipping, SkipFigures, compare_skipping, fixed_step, median};
use crate::view::{Intervals, RenderSettings, Skip, View};
use anyhow::{Context, Result};
use std::io::Write;
use std::time::Instant;

/// The ways, W first: it is what all are compared with.
const WAYS: [(Skip, Intervals); 11] = [
    (Skip::None, Intervals::Compute),
    (Skip::Encoding, Intervals::Compute),
    (Skip::Half, Intervals::Compute),
    (Skip::Half, Intervals::Raster),
    (Skip::Parts(1), Intervals::Compute),
    (Skip::Parts(1), Intervals::Raster),
    (Skip::Parts(2), Intervals::Compute),
    (Skip::Parts(2), Intervals::Raster),
    (Skip::Parts(8), Intervals::Compute),
    (Skip::Parts(8), Intervals::Raster),
    (Skip::Octree, Intervals::Compute),
];

/// Measures and prints, step by step.
pub fn run(mesh: &MeshArgs, volume: &RawArgs, octree: &OctreeArgs, view: &ViewArgs, repeats: u32) -> Result<()> {
    let files = view.files()?;
    let subject = read_subject(mesh, volume)?;
    let seen = view.view(&subject, files);
    seen.transfer_function.check_range(subject.range()).with_context(|| mesh.shown_name())?;
    let renderer = Renderer::new(view.device.into())?;
    say_if_fallen_back(&renderer);
    let start = Instant::now();
    let tree = regularized(mesh, &subject, &octree.params())?;
    let texture = OctreeTexture::encode(&tree)?;
    let build_s = start.elapsed().as_secs_f64();
    let leaves = tree.leaf_count();
    let (scene, _) = renderer.octree_scene(&subject, texture, subject.surface(&tree))?;

    let bounds = subject.bounds().translated(subject.center());
    let edge = bounds.size().max_element();
    let adapter = renderer.adapter().map_or("CPU".into(), |[name, backend, driver]| format!("{name} ({backend}, {driver})"));
    let mut out = std::io::stdout().lock();
    let [width, height] = view.size;
    let active = renderer.active_leaves(&scene, &seen).unwrap_or(0);
    writeln!(
        out,
        "{}: {leaves} leaves, {active} of them active; octree built in {:.1} ms on {} threads",
        mesh.stem(),
        build_s * 1e3,
        rayon::current_num_threads()
    )?;
    let update_s = median(&renderer.time_activity(&scene, &seen, 3 * repeats)?.unwrap_or_default());
    writeln!(out, "{adapter}; {width}x{height}, mean over the 12 views of the orbit, each the median of {repeats} frames")?;
    writeln!(out, "what is active, found anew after a change of the transfer function: {:.3} ms", update_s * 1e3)?;
    let bench = Bench { renderer: &renderer, scene: &scene, bounds, view: &seen, repeats };
    let has_voxels = renderer.has_voxels(&scene);
    for paper in PaperSkipping::ALL.iter().filter(|_| has_voxels) {
        let title = format!("step {:.3} of the edge, through a texture of voxels as in the paper", paper.step);
        bench.table(&mut out, &title, fixed_step(seen.settings, paper.step * edge, true), &WAYS, Some(paper))?;
    }
    if !has_voxels {
        writeln!(out, "no texture of voxels: that takes a GPU and an octree with samples at corners that ends at a surface")?;
    }
    let ways: Vec<_> = WAYS.into_iter().filter(|(skip, _)| *skip != Skip::Encoding).collect();
    for paper in PaperSkipping::ALL {
        let title = format!("step {:.3} of the edge, through the octree", paper.step);
        let beside = Some(&paper).filter(|_| !has_voxels);
        bench.table(&mut out, &title, fixed_step(seen.settings, paper.step * edge, false), &ways, beside)?;
    }
    bench.table(&mut out, "leaf by leaf", seen.settings, &ways, None)?;
    let [foot, teapot] = PaperSkipping::PREPROCESSING_MS;
    writeln!(
        out,
        "\nthe paper's preprocessing, ms: foot {} (W), {} (encoding), {} (half); teapot {}, {}, {}",
        foot[0], foot[1], foot[2], teapot[0], teapot[1], teapot[2]
    )?;
    Ok(())
}

/// What all tables share.
struct Bench<'a> {
    renderer: &'a Renderer,
    scene: &'a Scene,
    bounds: Aabb,
    view: &'a View,
    repeats: u32,
}

impl Bench<'_> {
    /// One table.
    fn table(
        &self,
        out: &mut impl Write,
        title: &str,
        settings: RenderSettings,
        ways: &[(Skip, Intervals)],
        paper: Option<&PaperSkipping>,
    ) -> Result<()> {
        let view = View { settings, ..self.view.clone() };
        let rows = with_bar(|progress| compare_skipping(self.renderer, self.scene, self.bounds, &view, ways, self.repeats, progress));
        let rows = match rows {
            Ok(rows) => rows,
            Err(error) => match error.downcast_ref() {
                // What does not fit leaves out its table.
                Some(RenderError::Gpu(reason @ (GpuError::TooLarge { .. } | GpuError::OutOfMemory))) => {
                    writeln!(out, "\n{title}\n{}", one_line(&reason.to_string()))?;
                    return Ok(());
                }
                _ => return Err(error),
            },
        };
        let beside = if paper.is_some() { "   the paper's ms: foot, teapot" } else { "" };
        writeln!(out, "\n{title}")?;
        writeln!(out, "{:<18} frame ms  intervals  saved  taken/frame  taken/needed  prepare ms  off by{beside}", "skip")?;
        for row in &rows {
            let column = paper.zip(PaperSkipping::column(row.skip));
            let published = column.map_or(String::new(), |(paper, i)| beside_row([paper.foot_ms, paper.teapot_ms], i));
            writeln!(out, "{}{published}", in_words(row, rows[0].frame_s))?;
        }
        Ok(out.flush()?)
    }
}

/// A way's line.
fn in_words(row: &SkipFigures, by_box_s: f64) -> String {
    let name = match (row.skip, row.intervals) {
        (Skip::None, _) => "none (W)".to_owned(),
        (skip, Intervals::Raster) => format!("{skip}, raster"),
        (skip, Intervals::Compute) => skip.to_string(),
    };
    let intervals = row.intervals_s.map_or("-".into(), |s| format!("{:.4}", s * 1e3));
    format!(
        "{name:<18} {:>8.4}  {intervals:>9}  {:>4.1}%  {:>11}  {:>12.3}  {:>10.3}  {:>6.0e}",
        row.frame_s * 1e3,
        100.0 * (1.0 - row.frame_s / by_box_s),
        row.taken / 12,
        row.taken as f64 / row.needed.max(1) as f64,
        row.preparation_s * 1e3,
        row.worst_difference,
    )
}

/// The paper's kernel times in a column of its tables, and what they save.
fn beside_row(columns: [[f64; 3]; 2], column: usize) -> String {
    let cell = |ms: [f64; 3]| {
        if column == 0 { format!("{:.3}", ms[0]) } else { format!("{:.3} ({:.1} %)", ms[column], 100.0 * (1.0 - ms[column] / ms[0])) }
    };
    format!("   {}, {}", cell(columns[0]), cell(columns[1]))
}
