//! Structs that the CPU writes and shaders read; `tests/shaders.rs` compares them with their WGSL by name, offset and size.

use crate::octree::Split;
use crate::view::{CubeRays, Planes, RayFrame, RenderSettings};
use bytemuck::{Pod, Zeroable};

pub use crate::optics::{Knot, Style, Surface};

/// What all rays of an image share: `Frame` in `shaders/shared/frame.wgsl`. Lengths are in edges of the root cube.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// Where the middle ray crosses the plane through the cube's centre.
    pub origin: [f32; 3],
    /// From the eye to that plane.
    pub eye_distance: f32,
    /// Origin offset per unit of x.
    pub right_origin: [f32; 3],
    /// Pixels along x.
    pub width: u32,
    /// Origin offset per unit of y.
    pub up_origin: [f32; 3],
    /// Pixels along y.
    pub height: u32,
    /// Unit view direction.
    pub forward: [f32; 3],
    /// A ray stops below it.
    pub min_transmittance: f32,
    /// Direction added per unit of x.
    pub right: [f32; 3],
    /// L_s, the step at depth 1.
    pub step: f32,
    /// Direction added per unit of y.
    pub up: [f32; 3],
    /// Levels of the octree, at least 1.
    pub depth: u32,
    /// Units of x and y per pixel.
    pub pixel_size: [f32; 2],
    /// Edge of a cell of the deepest level.
    pub cell_edge: f32,
    /// The axis that the halving plane is perpendicular to; 3 if rays are cut into equal parts.
    pub split_axis: u32,
    /// Where the plane crosses it.
    pub split_position: f32,
    /// How many planes clip.
    pub clip_count: u32,
    /// How many are drawn.
    pub cut_count: u32,
    /// Fills to a multiple of 16 bytes.
    pub _pad: f32,
    /// Normal and offset of what clips.
    pub clips: [[f32; 4]; Planes::MOST],
    /// Of what is drawn.
    pub cuts: [[f32; 4]; Planes::MOST],
    /// Opacity, and whether edges are drawn.
    pub cut_looks: [[f32; 4]; Planes::MOST],
}

/// The number of samples of an image: `Counter` in `shaders/shared/output.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Counter {
    /// Low 32 bits.
    pub low: u32,
    /// High 32 bits.
    pub high: u32,
}

impl Frame {
    /// The rays of `frame` through a root cube, and the settings that count in the march. `depth` is the octree's, `split` the plane that
    /// halves it, if one does.
    pub fn new(
        frame: &RayFrame,
        root_min: glam::DVec3,
        root_edge: f64,
        depth: u8,
        settings: &RenderSettings,
        split: Option<Split>,
    ) -> Self {
        let rays = CubeRays::new(frame, root_min, root_edge);
        Frame {
            origin: rays.origin.to_array(),
            eye_distance: rays.eye_distance,
            right_origin: rays.right_origin.to_array(),
            width: rays.size[0],
            up_origin: rays.up_origin.to_array(),
            height: rays.size[1],
            forward: rays.forward.to_array(),
            min_transmittance: settings.min_transmittance as f32,
            right: rays.right.to_array(),
            step: settings.step_in_cubes(root_edge, depth.max(1)),
            up: rays.up.to_array(),
            depth: u32::from(depth).max(1),
            pixel_size: rays.pixel_size(),
            cell_edge: 1.0 / (1u32 << depth.max(1)) as f32,
            split_axis: split.map_or(3, |split| split.axis as u32),
            split_position: split.map_or(0.0, |split| split.position),
            clip_count: rays.clips.count,
            cut_count: rays.cuts.count,
            _pad: 0.0,
            clips: rays.clips.planes.map(|plane| plane.to_array()),
            cuts: rays.cuts.planes.map(|plane| plane.to_array()),
            cut_looks: rays.cut_looks.map(|[opacity, edges]| [opacity, edges, 0.0, 0.0]),
        }
    }
}

impl Counter {
    /// The number.
    pub fn total(self) -> u64 {
        u64::from(self.high) << 32 | u64::from(self.low)
    }
}
