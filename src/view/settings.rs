//! Everything of a view that is neither camera nor transfer function.

use super::{Camera, Faces, Intervals, Isosurfaces, Mode, Output, Planes, Shading, Skip, TransferFunction};
use serde::{Deserialize, Serialize};

/// Which data a picture is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RendererKind {
    /// The octree texture, marched.
    #[default]
    Octree,
    /// The mesh itself, every ray through every tet.
    Exact,
}

/// Where the march over the octree places its samples (method 1.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Steps {
    /// Leaf by leaf: constant value from a leaf's entry to its exit. Misses nothing.
    #[default]
    Leaf,
    /// The paper's rule: the step of the current depth, stepping back where the octree gets deeper.
    Paper,
    /// One step everywhere: samples at its multiples from where the ray enters the cube, as in a march through a regular volume.
    Fixed,
}

/// Size and quality of an image. In JSON what is left out has the value of [`RenderSettings::default`], and what is unknown is refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSettings {
    /// Image width in pixels, at least 1.
    pub width: u32,
    /// Image height in pixels, at least 1.
    pub height: u32,
    /// Octree or exact.
    pub renderer: RendererKind,
    /// What a pixel shows.
    #[serde(with = "crate::words")]
    pub mode: Mode,
    /// What is written to pixels.
    #[serde(skip)]
    pub output: Output,
    /// Surfaces of equal value, drawn with [`Mode::Composite`] and [`Mode::Iso`].
    pub isosurfaces: Isosurfaces,
    /// What clips the picture, and what is drawn where it cuts the data; world coordinates. Drawn planes are in [`Mode::Composite`] and
    /// [`Mode::Iso`] only.
    pub planes: Planes,
    /// The mesh's boundary faces, if they are drawn: with [`Mode::Composite`] and [`Mode::Iso`]; from an octree where rays end at the mesh's
    /// surface ([`Boundary::Mesh`](crate::octree::Boundary)).
    pub faces: Option<Faces>,
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
    #[serde(with = "crate::words")]
    pub skip: Skip,
    /// Where the intervals come from that some ways to skip need.
    pub intervals: Intervals,
    /// A ray stops when its transmittance falls below this: 1/4096 where images are measured, 1/512 interactively.
    pub min_transmittance: f64,
}

/// Why settings cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} is {value}, expected {expected}")]
pub struct SettingsError {
    /// The setting.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What it must be.
    pub expected: &'static str,
}

impl Default for RenderSettings {
    /// A measured image of 512 x 512 pixels.
    fn default() -> Self {
        RenderSettings::new(512, 512)
    }
}

impl RenderSettings {
    /// The transmittance at which rays stop in the window.
    pub const INTERACTIVE: f64 = 1.0 / 512.0;

    /// No picture is wider or higher, in pixels.
    pub const LONGEST_SIDE: u32 = 32768;

    /// Checks every number.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let sides = 1.0..=f64::from(Self::LONGEST_SIDE);
        let phong = self.shading.phong;
        let (from_0, step) = ("a number from 0 to 100", self.step_world.unwrap_or(1.0));
        let is_from_0 = |v: f32| (0.0..=100.0).contains(&v);
        let [width, height] = [self.width, self.height].map(f64::from);
        let faces = self.faces.unwrap_or_default();
        let are_shares = |values: &[f32]| values.iter().all(|v| (0.0..=1.0).contains(v));
        let faces_color = faces.color.unwrap_or_default();
        let checks = [
            ("faces.opacity", f64::from(faces.opacity), "a number in [0, 1]", are_shares(&[faces.opacity])),
            ("faces.color", f64::from(faces_color[0]), "three numbers in [0, 1]", are_shares(&faces_color)),
            ("width", width, "1 to 32768 pixels", sides.contains(&width)),
            ("height", height, "1 to 32768 pixels", sides.contains(&height)),
            ("step_world", step, "a number above 0 or null", step.is_finite() && step > 0.0),
            ("min_transmittance", self.min_transmittance, "a number from 0 below 1", (0.0..1.0).contains(&self.min_transmittance)),
            ("shading.phong.ambient", f64::from(phong.ambient), from_0, is_from_0(phong.ambient)),
            ("shading.phong.diffuse", f64::from(phong.diffuse), from_0, is_from_0(phong.diffuse)),
            ("shading.phong.specular", f64::from(phong.specular), from_0, is_from_0(phong.specular)),
            (
                "shading.phong.shininess",
                f64::from(phong.shininess),
                "a number from 1 to 10000",
                (1.0..=10_000.0).contains(&phong.shininess),
            ),
        ];
        let wrong = checks.into_iter().find(|&(.., valid)| !valid);
        wrong.map_or(Ok(()), |(key, value, expected, _)| Err(SettingsError { key, value, expected }))
    }

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
        !self.mode.is_number() && (!self.isosurfaces.is_empty() || self.planes.are_drawn())
    }

    /// The boundary faces, if they are drawn.
    pub fn drawn_faces(&self) -> Option<Faces> {
        self.faces.filter(|_| !self.mode.is_number())
    }

    /// The same for data of which edges are known or not.
    pub fn with_edges(self, are_known: bool) -> RenderSettings {
        RenderSettings { faces: self.faces.map(|faces| Faces { edges: faces.edges && are_known, ..faces }), ..self }
    }

    /// Whether the volume is shaded: where it is drawn.
    pub fn is_volume_shaded(&self) -> bool {
        self.shading.volume && self.mode == Mode::Composite
    }

    /// The same for an octree with or without samples at its leaves' corners: without them an isosurface lies between leaves, none of
    /// which it would make active; and planes and boundary faces are drawn also where nothing is.
    pub fn for_octree(&self, is_continuous: bool) -> RenderSettings {
        let jumps = !is_continuous && !self.surfaces().is_empty();
        let cuts = self.with_surfaces() && self.planes.are_drawn();
        RenderSettings { skip: if jumps || cuts || self.drawn_faces().is_some() { Skip::None } else { self.skip }, ..*self }
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
            faces: None,
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
