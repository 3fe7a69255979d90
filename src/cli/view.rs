//! `octetra view`: the window.

use super::args::{DeviceArg, MeshArgs, OctreeArgs, RawArgs, ViewArgs, check_outputs, check_outputs_beside};
use super::render::no_exact_volume;
use super::session::SessionArgs;
use super::subject::{check_budget, read_subject};
use crate::app::store::{self, StoreOptions};
use crate::app::{self, Options, WindowStats};
use crate::bricks::Store;
use crate::image::write_atomically;
use crate::octree::Subject;
use crate::session::Source;
use crate::study::ErrorSampling;
use crate::view::{RendererKind, TransferFunction};
use anyhow::{Context, Result, ensure};
use clap::{Args, Parser};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `octetra view`, and plain `octetra`.
#[derive(Debug, Args)]
pub struct ViewCommand {
    #[command(flatten)]
    session: SessionArgs,
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    octree: OctreeArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Also open a second file, to compare: the first is A and this is B, with the same camera, colours, range and thresholds
    #[arg(long, value_name = "FILE", help_heading = "Compare")]
    compare_with: Option<PathBuf>,
    /// When the window is closed, also write what its frames took; - for standard output
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    stats: Option<PathBuf>,
}

impl ViewCommand {
    /// Reads the mesh or volume and opens the window on it.
    pub fn run(mut self) -> Result<()> {
        ensure!(!matches!(self.view.device, DeviceArg::Cpu), "the window draws on a GPU; octetra render --device cpu draws without one");
        if let Some(path) = self.mesh.mesh.clone().filter(|path| Store::is_at(path)) {
            return self.run_store(&path);
        }
        let session = self.session.apply(&mut self.mesh, &mut self.volume, &mut self.octree, &mut self.view)?;
        self.mesh.choose_step()?;
        let outputs = [self.stats.as_ref().filter(|path| !is_stdout(path))];
        check_outputs(&self.mesh, &outputs)?;
        let tf = Some(Path::new(self.view.transfer.tf.as_str())).filter(|tf| tf.is_file());
        let inputs = [
            (self.session.file().map(PathBuf::as_path), "the session"),
            (self.compare_with.as_deref(), "the file to compare with"),
            (self.view.camera.as_deref(), "the camera"),
            (tf, "the transfer function"),
        ];
        let inputs: Vec<(&Path, &str)> = inputs.into_iter().filter_map(|(path, what)| Some((path?, what))).collect();
        check_outputs_beside(&inputs, &outputs)?;
        if let Some(path) = &self.compare_with {
            check_second(path)?;
        }
        let files = self.view.files()?;
        let subject = read_subject(&self.mesh, &self.volume)?;
        if self.view.settings().renderer == RendererKind::Exact && matches!(subject, Subject::Volume(_)) {
            return Err(no_exact_volume(&self.mesh));
        }
        let view = self.view.view(&subject, files);
        view.transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        check_budget(&self.mesh, &subject)?;
        let stats = app::run(Options {
            name: self.mesh.stem(),
            source: self.mesh.source(&self.volume),
            session,
            recent: app::recent_file(),
            subject,
            component: self.mesh.component,
            compare_with: self.compare_with,
            view,
            params: self.octree.params(),
            error: ErrorSampling::default(),
            memory_bytes: self.mesh.budget_bytes(),
            device: self.view.device.into(),
            folder: ".".into(),
        })?;
        self.stats.as_deref().map(|path| write_stats(path, &stats)).transpose().map(drop)
    }
}

impl ViewCommand {
    /// Opens the window for a store of bricks.
    fn run_store(&self, path: &Path) -> Result<()> {
        ensure!(self.compare_with.is_none(), "{}: a store of bricks is compared with nothing", path.display());
        ensure!(self.stats.is_none(), "{}: there are no --stats of the window for a store of bricks", path.display());
        ensure!(self.mesh.more.is_empty(), "{}: a store of bricks is opened alone", path.display());
        ensure!(self.session.file().is_none(), "{}: a store of bricks has no session", path.display());
        let plain = super::Cli::parse_from(["octetra"]).view;
        let changes = &self.view.transfer.changes;
        let is_plain = self.view.settings() == plain.view.settings()
            && self.octree.params() == plain.octree.params()
            && self.view.camera.is_none()
            && self.mesh.array.is_none()
            && self.mesh.solution.is_none()
            && self.volume.flags().is_empty()
            && self.view.transfer.opacity_scale == 1.0
            && changes.threshold.is_none()
            && changes.unit_distance.is_none();
        ensure!(
            is_plain,
            "{}: of a store of bricks slices are shown; what has an effect on them is --memory, --tf, --range, --scale and --discrete",
            path.display()
        );
        let store = Store::open(path)?;
        let transfer_function = Some(self.view.transfer.read(None)?).filter(|tf| *tf != TransferFunction::standard());
        store::run_store(StoreOptions {
            name: self.mesh.stem(),
            source: Arc::new(store),
            // Bricks on their way, the window and the GPU's share need room, too.
            memory_bytes: self.mesh.memory.unwrap_or_else(|| self.mesh.budget_bytes() / 3),
            gpu_bytes: None,
            transfer_function,
        })
    }
}

/// Fails early if there is no such file or series.
fn check_second(path: &Path) -> Result<()> {
    if Source::file(path).series()?.is_none() {
        path.metadata().with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Writes what the frames of a window took, as JSON.
fn write_stats(path: &Path, stats: &WindowStats) -> Result<()> {
    let text = serde_json::to_string_pretty(stats).context("the window's times as JSON")? + "\n";
    if is_stdout(path) {
        return std::io::stdout().lock().write_all(text.as_bytes()).context("standard output");
    }
    write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}
