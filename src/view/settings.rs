//! Everything of a view that is neither camera nor transfer function.

use super::{Camera, Intervals, Isosurfaces, Mode, Output, Planes, Shading, Skip, TransferFunction};

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
    /// One step everywhere: samples at its multiples from where the ray enters the cube, as in a march through a regular volume.
    Fixed,
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
    /// What a pixel shows.
    pub mode: Mode,
    /// What is written to pixels.
    pub output: Output,
    /// Surfaces of equal value, drawn with [`Mode::Composite`] and [`Mode::Iso`].
    pub isosurfaces: Isosurfaces,
    /// What clips the picture, and what is drawn where it cuts the data; world coordinates. Drawn planes are in [`Mode::Composite`] and
    /// [`Mode::Iso`] only.
    pub planes: Planes,
    /// What is shaded.
    pub shading: Shading,
    /// Where octree samples lie.
    pub steps: Steps,
    /// The initial step L_s at depth 1 in world units; `None` is half the root's edge. Depth d has `L_s / 2^(d-1)`. With
    /// [`Steps::Fixed`] the step itself; `None` is the edge of the finest cell.
    pub step_world: Option<f64>,
    /// With [`Steps::Fixed`], whether a GPU samples a 3D texture of voxels, as fine as the octree's finest cells, in place of the octree, if that
    /// has samples at corners and ends at a surface. The field is the same but for rounding.
    pub voxels: bool,
    /// What of a ray is marched. With [`Steps::Paper`] it is all of it: there each sample depends on the one before, from the ray's
    /// beginning on. So it is for a number ([`RenderSettings::skip`]).
    pub skip: Skip,
    /// Where the intervals come from that some ways to skip need.
    pub intervals: Intervals,
    /// A ray stops when its transmittance falls below this: 1/4096 where images are measured, 1/512 interactively.
    pub min_transmittance: f64,
}

impl RenderSettings {
    /// The transmittance at which rays stop in the window.
    pub const INTERACTIVE: f64 = 1.0 / 512.0;

    /// What of a ray is marched, given where samples lie and what is shown: all of it counts for a number.
    pub fn skip(&self) -> Skip {
        if self.steps == Steps::Paper || self.mode.is_number() { Skip::None } else { self.skip }
    }

    /// The isosurfaces that are drawn.
    pub fn surfaces(&self) -> Isosurfaces {
        if self.mode.is_number() { Isosurfaces::NONE } else { self.isosurfaces }
    }

    /// Whether surfaces are drawn: isosurfaces or planes.
    pub fn with_surfaces(&self) -> bool {
        !self.mode.is_number() && !(self.isosurfaces.is_empty() && !self.planes.are_drawn())
    }

    /// Whether the volume is shaded: where it is drawn.
    pub fn is_volume_shaded(&self) -> bool {
        self.shading.volume && self.mode == Mode::Composite
    }

    /// The same for an octree with or without samples at its leaves' corners: without them an isosurface lies between leaves, none of
    /// which it would make active; and planes are drawn also where nothing is.
    pub fn for_octree(&self, is_continuous: bool) -> RenderSettings {
        let jumps = !is_continuous && !self.surfaces().is_empty();
        let cuts = self.with_surfaces() && self.planes.are_drawn();
        RenderSettings { skip: if jumps || cuts { Skip::None } else { self.skip }, ..*self }
    }

    /// Whether a GPU samples voxels: they are asked for, or blocks of them are, and steps are of one length.
    pub fn is_through_voxels(&self) -> bool {
        self.steps == Steps::Fixed && (self.voxels || self.skip() == Skip::Encoding)
    }

    /// The step in edges of a root cube of edge `root_edge` (world units) with `depth` levels: L_s, or the step itself.
    pub fn step_in_cubes(&self, root_edge: f64, depth: u8) -> f32 {
        let default = if self.steps == Steps::Fixed { (-f64::from(depth)).exp2() } else { 0.5 };
        (self.step_world.map_or(default, |step| step / root_edge) as f32).min(1e6)
    }

    /// The same, with rays that stop at another transmittance; at 0 they go through to their end.
    pub fn stopping_at(self, min_transmittance: f64) -> Self {
        RenderSettings { min_transmittance, ..self }
    }

    /// A measured image of this size: octree, leaf by leaf, past what is not seen, stopping at 1/4096.
    pub fn new(width: u32, height: u32) -> Self {
        RenderSettings {
            width,
            height,
            renderer: RendererKind::default(),
            mode: Mode::default(),
            output: Output::default(),
            isosurfaces: Isosurfaces::NONE,
            planes: Planes::NONE,
            shading: Shading::default(),
            steps: Steps::default(),
            step_world: None,
            voxels: false,
            skip: Skip::default(),
            intervals: Intervals::default(),
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
