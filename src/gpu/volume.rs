//! The octree texture on the device.

use super::activity::DeviceActivity;
use super::context::{Context, GpuError};
use super::cut_edges::CutLines;
use super::shader::NodeStorage;
use super::surface::{GpuSurface, storage_buffer};
use super::voxels::VoxelTexture;
use crate::mesh::BoundarySurface;
use crate::octree::{BRICK_WORDS, Brick, CutEdges, Node, OctreeTexture, Reconstruction};
use crate::view::{Planes, RenderSettings};
use glam::DVec3;
use std::sync::{Arc, Mutex, PoisonError};

/// An octree texture on the device, ready to be marched.
///
/// Its nodes lie in a storage buffer, the 8 of a block in one 32-byte sector, so that a descent touches one sector a level; a tree too
/// large for the adapter's storage bindings (128 MiB on software adapters: 4 Mi blocks, 2 Mi with bricks) stays the 3D texture that it is,
/// its bricks in another.
#[derive(Debug)]
pub struct OctreeVolume {
    /// What was copied.
    pub(super) texture: Arc<OctreeTexture>,
    pub(super) nodes: Nodes,
    pub(super) activity: DeviceActivity,
    /// The mesh's edges on planes, those that were asked for last.
    cut_lines: Mutex<Option<Arc<CutLines>>>,
    /// Made when it is first asked for.
    voxels: Mutex<Option<VoxelTexture>>,
    pub(super) continuous: bool,
    /// Where rays enter and leave the mesh. Without it `clipped` is false, and nothing but a place to bind is here.
    pub(super) surface: GpuSurface,
    pub(super) clipped: bool,
    pub(super) depth: u8,
    pub(super) root_min: DVec3,
    pub(super) root_edge: f64,
    bytes: u64,
}

/// Nodes and bricks.
#[derive(Debug)]
pub(super) enum Nodes {
    Buffer(wgpu::Buffer, wgpu::Buffer),
    Texture(wgpu::TextureView, wgpu::TextureView),
}

impl OctreeVolume {
    /// Copies a texture to the device, as a buffer if the adapter can bind one that large, and the surface that rays are cut to, if any.
    pub fn upload(context: &Context, texture: &Arc<OctreeTexture>, surface: Option<&BoundarySurface>) -> Result<Self, GpuError> {
        let limits = context.device.limits();
        let need = size_of_val(texture.texels()).max(size_of_val(texture.bricks())) as u64;
        let fits = need <= limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        Self::upload_as(context, texture, surface, if fits { NodeStorage::Buffer } else { NodeStorage::Texture })
    }

    /// Copies a texture to the device in the form asked for.
    pub fn upload_as(
        context: &Context,
        texture: &Arc<OctreeTexture>,
        surface: Option<&BoundarySurface>,
        storage: NodeStorage,
    ) -> Result<Self, GpuError> {
        let nodes = match storage {
            NodeStorage::Buffer => Nodes::Buffer(upload_buffer(context, texture)?, upload_bricks(context, texture)?),
            NodeStorage::Texture => Nodes::Texture(upload_texture(context, texture)?, upload_brick_texture(context, texture)?),
        };
        let (root_min, root_edge) = (texture.root_min(), texture.root_edge());
        let continuous = texture.reconstruction() == Reconstruction::Continuous;
        let nothing = BoundarySurface::default();
        Ok(OctreeVolume {
            activity: DeviceActivity::new(context, texture)?,
            texture: texture.clone(),
            cut_lines: Mutex::default(),
            voxels: Mutex::default(),
            nodes,
            continuous,
            surface: GpuSurface::upload(context, surface.unwrap_or(&nothing))?,
            clipped: surface.is_some(),
            depth: texture.depth(),
            root_min,
            root_edge,
            bytes: texture.bytes() as u64,
        })
    }

    /// Copies the mesh's edges on planes (relative to its centre) to the device, for marches with these planes; others have none.
    pub fn set_cut_edges(&self, context: &Context, edges: &Arc<CutEdges>, planes: &Planes) -> Result<(), GpuError> {
        let lines = CutLines::upload(context, edges.clone(), planes)?;
        *self.cut_lines.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(lines));
        Ok(())
    }

    /// The edges on these planes, if they are here.
    pub(super) fn cut_lines_on(&self, planes: &Planes) -> Option<Arc<CutLines>> {
        self.cut_lines.lock().unwrap_or_else(PoisonError::into_inner).clone().filter(|lines| lines.are_on(planes))
    }

    /// Bytes of the surface on the device.
    pub fn surface_bytes(&self) -> u64 {
        if self.clipped { self.surface.bytes() } else { 0 }
    }

    /// Bytes of nodes and bricks on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes on the device of what says which nodes are active, 4 a block, and how far around nothing is: two grids of at most 1 MiB.
    pub fn activity_bytes(&self) -> u64 {
        self.activity.bytes()
    }

    /// Whether the octree can be marched as voxels: it has the samples at corners that they are made of, and a surface that keeps rays from
    /// where it is empty.
    pub fn has_voxels(&self) -> bool {
        self.continuous && self.clipped
    }

    /// Whether these settings ask for voxels, and there are any.
    pub(super) fn is_marched_through_voxels(&self, settings: &RenderSettings) -> bool {
        self.has_voxels() && settings.is_through_voxels()
    }

    /// The octree's field as a texture of voxels, made and copied to the device when it is first asked for.
    pub(super) fn voxels(&self, context: &Context) -> Result<VoxelTexture, GpuError> {
        let mut voxels = self.voxels.lock().unwrap_or_else(PoisonError::into_inner);
        let made = match voxels.take() {
            Some(made) => made,
            None => VoxelTexture::dense(context, &self.texture)?,
        };
        Ok(voxels.insert(made).clone())
    }

    /// Nodes and bricks as shaders bind them.
    pub(super) fn node_bindings(&self) -> [wgpu::BindingResource<'_>; 2] {
        match &self.nodes {
            Nodes::Buffer(nodes, bricks) => [nodes.as_entire_binding(), bricks.as_entire_binding()],
            Nodes::Texture(nodes, bricks) => [wgpu::BindingResource::TextureView(nodes), wgpu::BindingResource::TextureView(bricks)],
        }
    }

    /// How the nodes are stored.
    pub fn storage(&self) -> NodeStorage {
        match self.nodes {
            Nodes::Buffer(..) => NodeStorage::Buffer,
            Nodes::Texture(..) => NodeStorage::Texture,
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
    let blocks = blocks(texture);
    storage_buffer(context, "octree", &blocks, || format!("an octree of {} blocks", blocks.len() / 8))
}

fn upload_bricks(context: &Context, texture: &OctreeTexture) -> Result<wgpu::Buffer, GpuError> {
    let bricks = texture.bricks();
    storage_buffer(context, "bricks", bricks, || format!("an octree of {} bricks", bricks.len()))
}

/// Brick texels of a block, [5, 3] of them: [`BRICK_WORDS`] words.
const BRICK_TEXELS: [u32; 2] = [5, 3];
const _: () = assert!(BRICK_TEXELS[0] * BRICK_TEXELS[1] == BRICK_WORDS as u32);

fn upload_brick_texture(context: &Context, texture: &OctreeTexture) -> Result<wgpu::TextureView, GpuError> {
    let blocks = texture.size().max(glam::UVec3::splat(2)) / 2;
    let [width, height] = BRICK_TEXELS;
    let size = if texture.bricks().is_empty() { glam::UVec3::ONE } else { blocks * glam::UVec3::new(width, height, 1) };
    let mut words = vec![0u32; size.element_product() as usize];
    for (number, Brick(brick)) in texture.bricks().iter().enumerate() {
        let number = number as u32;
        let (x, y, z) = (number % blocks.x, number / blocks.x % blocks.y, number / (blocks.x * blocks.y));
        for (row, texels) in (0..).zip(brick.chunks(width as usize)) {
            let at = (width * x + size.x * (height * y + row + size.y * z)) as usize;
            words[at..at + texels.len()].copy_from_slice(texels);
        }
    }
    texture_3d(context, "bricks", size, wgpu::TextureFormat::R32Uint, bytemuck::cast_slice(&words))
}

fn upload_texture(context: &Context, texture: &OctreeTexture) -> Result<wgpu::TextureView, GpuError> {
    let size = texture.size().max(glam::UVec3::splat(2));
    texture_3d(context, "octree", size, wgpu::TextureFormat::Rgba8Uint, texture.texels().as_flattened())
}

/// A 3D texture with texels of 4 bytes; none at all leaves zeros.
pub(super) fn texture_3d(
    context: &Context,
    label: &str,
    size: glam::UVec3,
    format: wgpu::TextureFormat,
    texels: &[u8],
) -> Result<wgpu::TextureView, GpuError> {
    let what = || format!("an octree of {size} texels");
    let limit = context.device.limits().max_texture_dimension_3d;
    context.check_limit(what, u64::from(size.max_element()), "max_texture_dimension_3d", u64::from(limit))?;
    let extent = wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z };
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    context.scoped(|| {
        let texture = context.device.create_texture(&descriptor);
        if !texels.is_empty() {
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * size.x), rows_per_image: Some(size.y) };
            context.queue.write_texture(texture.as_image_copy(), texels, layout, extent);
        }
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    })
}
