//! The octree texture on the device.

use super::context::{Context, GpuError};
use super::shader::NodeStorage;
use crate::octree::{Node, OctreeTexture};
use glam::DVec3;
use wgpu::util::DeviceExt;

/// An octree texture on the device, ready to be marched.
///
/// Its nodes lie in a storage buffer, the 8 of a block in one 32-byte sector, so that a descent touches one sector a level; a tree too
/// large for the adapter's storage bindings (128 MiB on software adapters: 4 Mi blocks) stays the 3D texture that it is.
#[derive(Debug)]
pub struct OctreeVolume {
    pub(super) nodes: Nodes,
    pub(super) depth: u8,
    pub(super) root_min: DVec3,
    pub(super) root_edge: f64,
    bytes: u64,
}

#[derive(Debug)]
pub(super) enum Nodes {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
}

impl OctreeVolume {
    /// Copies a texture to the device, as a buffer if the adapter can bind one that large.
    pub fn upload(context: &Context, texture: &OctreeTexture) -> Result<Self, GpuError> {
        let limits = context.device.limits();
        let fits = texture.bytes() as u64 <= limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        Self::upload_as(context, texture, if fits { NodeStorage::Buffer } else { NodeStorage::Texture })
    }

    /// Copies a texture to the device in the form asked for.
    pub fn upload_as(context: &Context, texture: &OctreeTexture, storage: NodeStorage) -> Result<Self, GpuError> {
        let nodes = match storage {
            NodeStorage::Buffer => Nodes::Buffer(upload_buffer(context, texture)?),
            NodeStorage::Texture => Nodes::Texture(upload_texture(context, texture)?),
        };
        let (root_min, root_edge) = (texture.root_min(), texture.root_edge());
        Ok(OctreeVolume { nodes, depth: texture.depth(), root_min, root_edge, bytes: texture.bytes() as u64 })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// How the nodes are stored.
    pub fn storage(&self) -> NodeStorage {
        match self.nodes {
            Nodes::Buffer(_) => NodeStorage::Buffer,
            Nodes::Texture(_) => NodeStorage::Texture,
        }
    }
}

/// The nodes block by block: child `i = x + 2 y + 4 z` of block b at `8 b + i`, A in the highest byte, then R, G, B; of an interior node
/// the lower 24 bits are its block's number. An octree without levels is one empty block.
fn blocks(texture: &OctreeTexture) -> Vec<u32> {
    let (size, texels) = (texture.size(), texture.texels());
    let (row, layer) = (size.x as usize, size.x as usize * size.y as usize);
    let (per_row, per_layer) = (row / 2, layer / 4);
    let mut nodes = Vec::with_capacity(texels.len().max(8));
    for block in 0..texels.len() / 8 {
        let (x, y, z) = (block % per_row, block % per_layer / per_row, block / per_layer);
        let first = 2 * x + 2 * y * row + 2 * z * layer;
        for child in [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1] {
            let [r, g, b, a] = texels[first + child].map(u32::from);
            nodes.push(match Node::decode([r, g, b, a].map(|v| v as u8)) {
                Some(Node::Interior { block }) => a << 24 | (block.x + per_row as u32 * block.y + per_layer as u32 * block.z),
                _ => a << 24 | r << 16 | g << 8 | b,
            });
        }
    }
    nodes.resize(nodes.len().max(8), 0);
    nodes
}

fn upload_buffer(context: &Context, texture: &OctreeTexture) -> Result<wgpu::Buffer, GpuError> {
    let limits = context.device.limits();
    let need = texture.bytes() as u64;
    let what = || format!("an octree of {} blocks", need / 32);
    context.check_limit(what, need, "max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size)?;
    context.check_limit(what, need, "max_buffer_size", limits.max_buffer_size)?;
    let nodes = blocks(texture);
    let contents = bytemuck::cast_slice(&nodes);
    let descriptor = wgpu::util::BufferInitDescriptor { label: Some("octree"), contents, usage: wgpu::BufferUsages::STORAGE };
    context.scoped(|| context.device.create_buffer_init(&descriptor))
}

fn upload_texture(context: &Context, texture: &OctreeTexture) -> Result<wgpu::TextureView, GpuError> {
    let size = texture.size().max(glam::UVec3::splat(2));
    let what = || format!("an octree of {size} texels");
    let limit = context.device.limits().max_texture_dimension_3d;
    context.check_limit(what, u64::from(size.max_element()), "max_texture_dimension_3d", u64::from(limit))?;
    let extent = wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z };
    let descriptor = wgpu::TextureDescriptor {
        label: Some("octree"),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba8Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    context.scoped(|| {
        let device_texture = context.device.create_texture(&descriptor);
        if !texture.texels().is_empty() {
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * size.x), rows_per_image: Some(size.y) };
            context.queue.write_texture(device_texture.as_image_copy(), texture.texels().as_flattened(), layout, extent);
        }
        device_texture.create_view(&wgpu::TextureViewDescriptor::default())
    })
}
