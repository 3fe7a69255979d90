//! `octetra view`: the window.

use super::args::{DeviceArg, MeshArgs, OctreeArgs, RawArgs, ViewArgs};
use super::render::no_exact_volume;
use super::session::SessionArgs;
use super::subject::{check_budget, read_subject};
use crate::app::{self, Options};
use crate::octree::Subject;
use crate::study::ErrorSampling;
use crate::view::RendererKind;
use anyhow::{Context, Result, ensure};
use clap::Args;

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
}

impl ViewCommand {
    /// Reads the mesh or volume and opens the window on it.
    pub fn run(mut self) -> Result<()> {
        ensure!(!matches!(self.view.device, DeviceArg::Cpu), "the window draws on a GPU; octetra render --device cpu draws without one");
        let session = self.session.apply(&mut self.mesh, &mut self.volume, &mut self.octree, &mut self.view)?;
        self.mesh.choose_step()?;
        let files = self.view.files()?;
        let subject = read_subject(&self.mesh, &self.volume)?;
        if self.view.settings().renderer == RendererKind::Exact && matches!(subject, Subject::Volume(_)) {
            return Err(no_exact_volume(&self.mesh));
        }
        let view = self.view.view(&subject, files);
        view.transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        check_budget(&self.mesh, &subject)?;
        app::run(Options {
            name: self.mesh.stem(),
            source: self.mesh.source(self.volume.layout()),
            session,
            recent: app::recent_file(),
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
