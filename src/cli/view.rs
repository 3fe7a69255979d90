//! `octetra view`: the window.

use super::args::{DeviceArg, MeshArgs, OctreeArgs, ViewArgs};
use crate::app::{self, Options};
use crate::study::ErrorSampling;
use anyhow::{Result, ensure};
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
}

impl ViewCommand {
    /// Reads the mesh and opens the window on it.
    pub fn run(self) -> Result<()> {
        ensure!(!matches!(self.view.device, DeviceArg::Cpu), "the window draws on a GPU; octetra render --device cpu draws without one");
        let mesh = self.mesh.read()?;
        let field = self.mesh.field(&mesh)?;
        let view = self.view.view(&mesh, self.view.files()?);
        self.mesh.check_budget(&mesh)?;
        app::run(Options {
            name: self.mesh.stem(),
            mesh,
            array: field.name,
            component: self.mesh.component,
            view,
            params: self.octree.params(),
            error: ErrorSampling::default(),
            memory_bytes: self.mesh.budget_bytes(),
            folder: ".".into(),
        })
    }
}
