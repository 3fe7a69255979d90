//! Everything of a view that is neither camera nor transfer function.

use super::{Camera, TransferFunction};

/// Which data a picture is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RendererKind {
    /// The octree texture, marched.
    #[default]
    Octree,
    /// The mesh itself, every ray through every tet.
    Exact,
}

/// Where the march over the octree places its samples (method 1.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Steps {
    /// Leaf by leaf: constant value from a leaf's entry to its exit. Misses nothing.
    #[default]
    Leaf,
    /// The paper's rule: the step of the current depth, stepping back where the octree gets deeper.
    Paper,
}

/// Size and quality of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderSettings {
    /// Image width in pixels, at least 1.
    pub width: u32,
    /// Image height in pixels, at least 1.
    pub height: u32,
    /// Octree or exact.
    pub renderer: RendererKind,
    /// Where octree samples lie.
    pub steps: Steps,
    /// The initial step L_s at depth 1 in world units; `None` is half the root's edge. Depth d has `L_s / 2^(d-1)`.
    pub step_world: Option<f64>,
    /// A ray stops when its transmittance falls below this: 1/4096 where images are measured, 1/512 interactively.
    pub min_transmittance: f64,
}

impl RenderSettings {
    /// A measured image of this size: octree, leaf by leaf, stopping at 1/4096.
    pub fn new(width: u32, height: u32) -> Self {
        RenderSettings {
            width,
            height,
            renderer: RendererKind::default(),
            steps: Steps::default(),
            step_world: None,
            min_transmittance: 1.0 / 4096.0,
        }
    }
}

/// All that decides an image besides the data.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Where from.
    pub camera: Camera,
    /// Scalar to colour and opacity.
    pub transfer_function: TransferFunction,
    /// Size, renderer, steps.
    pub settings: RenderSettings,
}
