//! The window.

use crate::mesh::{Component, TetMesh};
use crate::octree::OctreeParams;
use crate::view::View;

/// What the window opens on.
#[derive(Debug)]
pub struct Options {
    /// What the mesh is called: title and name of screenshots.
    pub name: String,
    /// The mesh.
    pub mesh: TetMesh,
    /// The array shown first.
    pub array: String,
    /// What is taken of a vector.
    pub component: Component,
    /// The first view.
    pub view: View,
    /// The first thresholds.
    pub params: OctreeParams,
}

/// Opens the window and returns when it is closed.
pub fn run(options: Options) -> anyhow::Result<()> {
    anyhow::bail!("{}: the window is being built", options.name)
}
