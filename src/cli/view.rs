//! `octetra view`: the window.

use super::args::{DeviceArg, MeshArgs, OctreeArgs, RawArgs, RendererArg, ViewArgs};
use super::render::no_exact_volume;
use super::subject::{check_budget, read_subject};
use crate::app::{self, Options};
use crate::octree::Subject;
use crate::study::ErrorSampling;
use anyhow::{Context, Result, ensure};
use clap::Args;

/// `octetra view`, and plain `octetra`.
#[derive(Debug, Args)]
pub struct ViewCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    octree: OctreeArgs,
    #[command(flatten)]
    volume: RawArgs,
}

impl ViewCommand {
    /// Reads the mesh or volume and opens the window on it.
    pub fn run(self) -> Result<()> {
        ensure!(!matches!(self.view.device, DeviceArg::Cpu), "the window draws on a GPU; octetra render --device cpu draws without one");
        let files = self.view.files()?;
        let subject = read_subject(&self.mesh, &self.volume)?;
        if self.view.renderer == RendererArg::Exact && matches!(subject, Subject::Volume(_)) {
            return Err(no_exact_volume(&self.mesh));
        }
        let view = self.view.view(&subject, files);
        view.transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        check_budget(&self.mesh, &subject)?;
        app::run(Options {
            name: self.mesh.stem(),
            subject,
            component: self.mesh.component,
            view,
            params: self.octree.params(),
            error: ErrorSampling::default(),
            memory_bytes: self.mesh.budget_bytes(),
            folder: ".".into(),
        })
    }
}
