//! A mesh on the device, for `shaders/march_exact.wgsl` to walk through.

use super::context::{Context, GpuError};
use super::surface::{GpuSurface, storage_buffer};
use crate::mesh::CompactMesh;
use glam::DVec3;

/// A [`CompactMesh`] in storage buffers.
#[derive(Debug)]
pub struct ExactMesh {
    neighbours: wgpu::Buffer,
    points: wgpu::Buffer,
    vertices: wgpu::Buffer,
    cell_values: wgpu::Buffer,
    surface: GpuSurface,
    pub(super) on_cells: bool,
    pub(super) cube_min: DVec3,
    /// Edge of the cube that rays are followed in, world units.
    pub cube_edge: f64,
    bytes: u64,
}

impl ExactMesh {
    /// Whether the adapter can bind a mesh of so many tets, before one is sorted and linked in vain: its largest binding.
    pub fn check_room(context: &Context, tets: usize) -> Result<(), GpuError> {
        let what = || format!("a mesh of {tets} tets");
        let limit = context.device.limits().max_storage_buffer_binding_size;
        context.check_limit(what, 16 * tets as u64, "max_storage_buffer_binding_size", limit)
    }

    /// Copies a mesh to the device. The largest binding is 16 bytes a tet: a software adapter's 128 MiB hold 8 million tets.
    pub fn upload(context: &Context, mesh: &CompactMesh) -> Result<Self, GpuError> {
        let what = || format!("a mesh of {} tets", mesh.tet_count());
        Ok(ExactMesh {
            neighbours: storage_buffer(context, "neighbours", &mesh.neighbours, what)?,
            points: storage_buffer(context, "tet points", &mesh.points, what)?,
            vertices: storage_buffer(context, "vertices", &mesh.vertices, what)?,
            cell_values: storage_buffer(context, "cell values", &mesh.cell_values, what)?,
            surface: GpuSurface::upload(context, &mesh.surface)?,
            on_cells: !mesh.cell_values.is_empty(),
            cube_min: mesh.cube_min,
            cube_edge: mesh.cube_edge,
            bytes: mesh.bytes() as u64,
        })
    }

    /// Bytes on the device, the surface included.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn bindings(&self) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        let own = [&self.neighbours, &self.points, &self.vertices, &self.cell_values].map(wgpu::Buffer::as_entire_binding);
        (GpuSurface::FIRST_BINDING..).zip(self.surface.bindings().into_iter().chain(own)).collect()
    }
}
