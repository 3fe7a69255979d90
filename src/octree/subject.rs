//! What an octree is made of: a field on a mesh, or a volume.

use super::{
    ErrorBound, Octree, OctreeParams, OctreeTexture, RegularizeError, error_bound, grid_error_bound, grid_working_bytes, regularize,
    regularize_grid, working_bytes,
};
use crate::geometry::{Aabb, Placed};
use crate::mesh::{BoundarySurface, ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use crate::volume::Grid;
use glam::DVec3;
use std::sync::Arc;

/// What is to be drawn. Copies share the data.
#[derive(Debug, Clone)]
pub enum Subject {
    /// A field on a tet mesh.
    Mesh(Arc<TetMesh>, Arc<ScalarField>),
    /// A regular volume.
    Volume(Arc<Grid>),
}

impl Subject {
    /// The mesh, if it is one.
    pub fn mesh(&self) -> Option<&Arc<TetMesh>> {
        match self {
            Subject::Mesh(mesh, _) => Some(mesh),
            Subject::Volume(_) => None,
        }
    }

    /// The array's name.
    pub fn array(&self) -> &str {
        match self {
            Subject::Mesh(_, field) => &field.name,
            Subject::Volume(grid) => grid.name(),
        }
    }

    /// Smallest and largest value, data units.
    pub fn range(&self) -> [f64; 2] {
        match self {
            Subject::Mesh(_, field) => field.range,
            Subject::Volume(grid) => grid.range(),
        }
    }

    /// How much it is: "187395 tets", "2097152 voxels".
    pub fn size_in_words(&self) -> String {
        match self {
            Subject::Mesh(mesh, _) => format!("{} tets", mesh.tets().len()),
            Subject::Volume(grid) => format!("{} voxels", grid.frame().points()),
        }
    }

    /// An upper bound of the bytes that it and the making of an octree take.
    pub fn working_bytes(&self) -> u64 {
        match self {
            Subject::Mesh(mesh, _) => mesh.bytes() as u64 + working_bytes(mesh),
            Subject::Volume(grid) => grid.bytes() as u64 + grid_working_bytes(grid),
        }
    }

    /// The octree: [`regularize`] or [`regularize_grid`].
    pub fn regularize(&self, params: &OctreeParams, progress: &Progress) -> Result<Octree, RegularizeError> {
        match self {
            Subject::Mesh(mesh, field) => regularize(mesh, field, params, progress),
            Subject::Volume(grid) => regularize_grid(grid, params, progress),
        }
    }

    /// The surface that rays through an octree of it are cut to, if they are.
    pub fn surface(&self, tree: &Octree) -> Option<Arc<BoundarySurface>> {
        match self {
            Subject::Mesh(mesh, field) => tree.params.surface(mesh, field),
            Subject::Volume(grid) => tree.grid_surface(grid),
        }
    }

    /// A bound of an octree's error: [`error_bound`], or [`grid_error_bound`] where there is one.
    pub fn error_bound(&self, texture: &OctreeTexture, progress: &Progress) -> Result<Option<ErrorBound>, Cancelled> {
        match self {
            Subject::Mesh(mesh, field) => error_bound(mesh, field, texture, progress).map(Some),
            Subject::Volume(grid) => grid_error_bound(grid, texture, progress),
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
