//! What a file gives to draw: a field on a mesh, or a volume.

use super::args::{MeshArgs, RawArgs};
use super::long_work::with_bar;
use crate::format::{self, Data, ReadOptions, SolutionFile};
use crate::geometry::{Aabb, Placed};
use crate::mesh::{BoundarySurface, ScalarField, TetMesh};
use crate::octree::{Octree, OctreeParams, grid_working_bytes, regularize, regularize_grid};
use crate::volume::Grid;
use anyhow::Result;
use glam::DVec3;
use std::sync::Arc;

/// What is to be drawn.
#[allow(clippy::large_enum_variant)] // there is one of it
pub enum Subject {
    /// A field on a tet mesh.
    Mesh(TetMesh, ScalarField),
    /// A regular volume.
    Volume(Grid),
}

impl Subject {
    /// Reads the file that the arguments name and picks the field.
    pub fn read(args: &MeshArgs, raw: &RawArgs) -> Result<Self> {
        Ok(match read_data(args, raw, true)? {
            Data::Mesh(mesh) => {
                let field = args.field(&mesh)?;
                Subject::Mesh(mesh, field)
            }
            Data::Grid(grid) => Subject::Volume(grid),
        })
    }

    /// The array's name.
    pub fn array(&self) -> &str {
        match self {
            Subject::Mesh(_, field) => &field.name,
            Subject::Volume(grid) => grid.name(),
        }
    }

    /// Smallest and largest value.
    pub fn range(&self) -> [f64; 2] {
        match self {
            Subject::Mesh(_, field) => field.range,
            Subject::Volume(grid) => grid.range(),
        }
    }

    /// The octree, if the budget of memory allows it.
    pub fn regularize(&self, args: &MeshArgs, params: &OctreeParams) -> Result<Octree> {
        match self {
            Subject::Mesh(mesh, field) => {
                args.check_budget(mesh)?;
                with_bar(|progress| regularize(mesh, field, params, progress))
            }
            Subject::Volume(grid) => {
                args.check_bytes(&format!("{} voxels", grid.frame().points()), grid.bytes() as u64 + grid_working_bytes(grid))?;
                with_bar(|progress| regularize_grid(grid, params, progress))
            }
        }
    }

    /// The surface that rays are cut to, if they are.
    pub fn surface(&self, tree: &Octree) -> Option<Arc<BoundarySurface>> {
        match self {
            Subject::Mesh(mesh, field) => tree.params.surface(mesh, field),
            Subject::Volume(grid) => tree.grid_surface(grid),
        }
    }
}

impl Placed for Subject {
    fn center(&self) -> DVec3 {
        match self {
            Subject::Mesh(mesh, _) => mesh.center(),
            Subject::Volume(grid) => grid.center(),
        }
    }

    fn bounds(&self) -> Aabb {
        match self {
            Subject::Mesh(mesh, _) => mesh.bounds(),
            Subject::Volume(grid) => grid.bounds(),
        }
    }
}

/// Reads the file that the arguments name, or the bundled mesh. `needs_solution`: a PLOT3D grid without one is an error.
pub fn read_data(args: &MeshArgs, raw: &RawArgs, needs_solution: bool) -> Result<Data> {
    let Some(path) = &args.mesh else { return Ok(Data::Mesh(args.read()?)) };
    let mut options = ReadOptions { raw: raw.layout(), ..args.options() };
    if !needs_solution && options.solution == SolutionFile::Beside {
        options.solution = SolutionFile::IfBeside;
    }
    with_bar(|progress| format::read(path, &options, progress))
}
