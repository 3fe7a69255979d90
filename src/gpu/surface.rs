//! The mesh's boundary surface on the device: what `shaders/shared/surface.wgsl` binds.

use super::context::{Context, GpuError};
use crate::mesh::BoundarySurface;
use bytemuck::Pod;

/// A [`BoundarySurface`] in three storage buffers, for bindings 8 to 10: nodes, faces, vertices.
#[derive(Debug)]
pub struct GpuSurface {
    nodes: wgpu::Buffer,
    faces: wgpu::Buffer,
    vertices: wgpu::Buffer,
    bytes: u64,
    pub(super) is_box: bool,
}

impl GpuSurface {
    /// The number of the first binding.
    pub const FIRST_BINDING: u32 = 8;

    /// Copies a surface to the device. One without faces becomes a node without children.
    pub fn upload(context: &Context, surface: &BoundarySurface) -> Result<Self, GpuError> {
        let what = || format!("a boundary surface of {} faces", surface.faces().len());
        Ok(GpuSurface {
            nodes: storage_buffer(context, "surface nodes", surface.nodes(), what)?,
            faces: storage_buffer(context, "surface faces", surface.faces(), what)?,
            vertices: storage_buffer(context, "surface vertices", surface.vertices(), what)?,
            bytes: surface.bytes() as u64,
            is_box: surface.is_box(),
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// What to bind from [`GpuSurface::FIRST_BINDING`] on.
    pub fn bindings(&self) -> [wgpu::BindingResource<'_>; 3] {
        [&self.nodes, &self.faces, &self.vertices].map(wgpu::Buffer::as_entire_binding)
    }
}

/// A read-only storage buffer of `elements`, or of one of zeros if there are none: a binding must not be empty.
pub(super) fn storage_buffer<T: Pod>(
    context: &Context,
    label: &str,
    elements: &[T],
    what: impl Fn() -> String,
) -> Result<wgpu::Buffer, GpuError> {
    use wgpu::util::DeviceExt;
    let limits = context.device.limits();
    let need = size_of_val(elements) as u64;
    context.check_limit(&what, need, "max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size)?;
    context.check_limit(&what, need, "max_buffer_size", limits.max_buffer_size)?;
    let nothing = [T::zeroed()];
    let contents = bytemuck::cast_slice(if elements.is_empty() { &nothing } else { elements });
    let descriptor = wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage: wgpu::BufferUsages::STORAGE };
    context.scoped(|| context.device.create_buffer_init(&descriptor))
}
