//! The texture that a frame is marched into.

use super::context::{Context, GpuError};
use crate::image::Image;

/// A texture of linear premultiplied RGBA in f32, row 0 at the top. The window samples it (it cannot be filtered everywhere: use
/// `textureLoad`), the command reads it back.
#[derive(Debug)]
pub struct Target {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl Target {
    /// A target of `width` x `height` pixels, each at least 1.
    pub fn new(context: &Context, width: u32, height: u32) -> Result<Self, GpuError> {
        let limit = context.device.limits().max_texture_dimension_2d;
        let what = || format!("an image of {width}x{height} pixels");
        context.check_limit(what, u64::from(width.max(height)), "max_texture_dimension_2d", u64::from(limit))?;
        let descriptor = wgpu::TextureDescriptor {
            label: Some("image"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        };
        context.scoped(|| {
            let texture = context.device.create_texture(&descriptor);
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            Target { texture, view }
        })
    }

    /// Makes this a target of another size; whether it changed, so that bind groups with its view must be made anew.
    pub fn resize(&mut self, context: &Context, width: u32, height: u32) -> Result<bool, GpuError> {
        if self.size() == [width, height] {
            return Ok(false);
        }
        *self = Target::new(context, width, height)?;
        Ok(true)
    }

    /// Puts an image made elsewhere into this target, which must have its size.
    pub fn write(&self, context: &Context, image: &Image) -> Result<(), GpuError> {
        let size = [image.width, image.height];
        if self.size() != size {
            return Err(GpuError::TargetSize { image: size, target: self.size() });
        }
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * image.width), rows_per_image: Some(image.height) };
        let pixels = bytemuck::cast_slice(&image.pixels);
        context.scoped(|| context.queue.write_texture(self.texture.as_image_copy(), pixels, layout, self.texture.size()))
    }

    /// Copies all of `rows`, a target of the same width, to the rows from `first_row` on.
    pub fn copy_rows(&self, context: &Context, rows: &Target, first_row: u32) -> Result<(), GpuError> {
        context.scoped(|| {
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut to = self.texture.as_image_copy();
            to.origin.y = first_row;
            encoder.copy_texture_to_texture(rows.texture.as_image_copy(), to, rows.texture.size());
            context.queue.submit([encoder.finish()]);
        })
    }

    /// Records the copy of a texture of the same size and format to this one.
    pub(super) fn copy_from(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) {
        encoder.copy_texture_to_texture(texture.as_image_copy(), self.texture.as_image_copy(), self.texture.size());
    }

    /// The view to bind.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.texture.width(), self.texture.height()]
    }

    /// A buffer that can take the target's content, rows padded as copies want it.
    pub(super) fn readback_buffer(&self, context: &Context) -> Result<wgpu::Buffer, GpuError> {
        let [width, height] = self.size();
        let size = u64::from(padded_row(width)) * u64::from(height);
        let what = || format!("reading back an image of {width}x{height} pixels");
        context.check_limit(what, size, "max_buffer_size", context.device.limits().max_buffer_size)?;
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let descriptor = wgpu::BufferDescriptor { label: Some("image readback"), size, usage, mapped_at_creation: false };
        context.scoped(|| context.device.create_buffer(&descriptor))
    }

    /// Records the copy to such a buffer.
    pub(super) fn copy_to(&self, encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) {
        let [width, height] = self.size();
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded_row(width)), rows_per_image: Some(height) };
        let destination = wgpu::TexelCopyBufferInfo { buffer, layout };
        encoder.copy_texture_to_buffer(self.texture.as_image_copy(), destination, self.texture.size());
    }

    /// The image in such a buffer's bytes.
    pub(super) fn image(&self, bytes: &[u8]) -> Image {
        let [width, height] = self.size();
        let rows = bytes.chunks_exact(padded_row(width) as usize);
        let pixels = rows.flat_map(|row| bytemuck::cast_slice::<u8, [f32; 4]>(&row[..16 * width as usize]).to_vec()).collect();
        Image { width, height, pixels }
    }
}

/// Bytes from one row to the next in a copy.
fn padded_row(width: u32) -> u32 {
    (16 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
