//! The marcher on the CPU: what the shaders must do, written to be read, and the fallback on a machine without an adapter.
//!
//! Each file is the twin of the shader of its name: same functions, same order, f32 throughout. Lengths are in edges of the root cube.

mod descent;
mod faces;
mod leap;
mod march_fixed;
mod march_leaf;
mod march_paper;
mod parts;
mod pass;
mod pick;
#[cfg(test)]
mod pick_tests;
mod probe;
mod ray;
mod surface;
#[cfg(test)]
mod surface_tests;

use descent::{Descent, What};
pub use descent::{INTERIOR, MAX_DEPTH};
use faces::FacePlace;
pub use faces::SEAM;
pub use march_leaf::MAX_PIECES;
pub use pass::EDGE_INK;
pub use pick::{Picked, PickedWhat, pick};
pub use probe::{CLOSE, MAX_STEPS};
pub use ray::{FAR, PARALLEL};
pub use surface::{MAX_HITS, TINY, surface_intervals};

use crate::image::Image;
use crate::mesh::BoundarySurface;
use crate::octree::{Activity, CutEdges, KeptActivity, OctreeTexture, Reconstruction};
use crate::optics::{Classifier, KnotTable, Style};
use crate::progress::{Cancelled, Progress};
use crate::view::{CubeRays, Mode, Output, RayFrame, RenderSettings, Skip, Steps};
use leap::next_active;
use parts::{Cuts, Parts};
use pass::Gathered;
use ray::Ray;
use rayon::prelude::*;
use surface::SurfaceRay;

/// No ray looks up more cells: only steps far below any leaf's size could.
pub const MAX_LOOKUPS: u32 = 1 << 22;
/// The shortest step in t. With t below 2, f32 still tells apart the two ends of such a step.
pub const MIN_STEP: f32 = 1.0 / 1_048_576.0;

/// What a march gives.
#[derive(Debug, Clone, PartialEq)]
pub struct MarchOutput {
    /// Linear premultiplied RGBA, row 0 at the top.
    pub image: Image,
    /// Look-ups that found a full leaf: `leaf`, the leaves that rays pass; `paper`, all samples, those stepped back from included; `fixed`,
    /// the samples.
    pub samples: u64,
}

/// What all rays of an image share.
struct Scene<'a> {
    texture: &'a OctreeTexture,
    /// The mesh's edges on planes, where they are known.
    edges: Option<&'a CutEdges>,
    /// Where rays enter and leave the mesh; without it they march through the whole cube.
    surface: Option<&'a BoundarySurface>,
    continuous: bool,
    table: &'a KnotTable,
    mode: Mode,
    output: Output,
    style: Style,
    with_surfaces: bool,
    /// Whether boundary faces are drawn.
    with_faces: bool,
    rays: CubeRays,
    is_volume_shaded: bool,
    are_surfaces_shaded: bool,
    min_transmittance: f32,
    /// L_s in cube edges, or the step itself.
    step: f32,
    activity: &'a Activity,
    /// Whether the march leaps over what is not active.
    is_skipping: bool,
    /// Into what rays are cut, if they are.
    cuts: Option<Cuts>,
}

/// A ray's way so far, the twin of `shaders/shared/spans.wgsl`: through spans inside the surface, and parts that hold something active.
struct Way<'a> {
    descent: Descent<'a>,
    parts: Parts,
    /// The part that the ray is in, and the span; empty once a face hides what is behind.
    part: [f32; 2],
    span: [f32; 2],
    surface: Option<SurfaceRay<'a>>,
    /// Full leaves looked up.
    samples: u32,
}

impl Scene<'_> {
    /// L_s in a ray's t, within 2^-11 of it.
    fn step_along(&self, ray: &Ray) -> f32 {
        self.step * ray.inverse_length()
    }

    /// Whether passing a step looks up the octree at other places than the step's ends.
    fn is_probing(&self) -> bool {
        self.is_volume_shaded || self.with_surfaces
    }

    /// What of the tree is marched.
    fn what(&self) -> What {
        if self.is_skipping { What::Active } else { What::All }
    }

    /// Marches a ray; returns the pixel and the number of full leaves looked up.
    fn march(&self, ray: &Ray, steps: Steps) -> ([f32; 4], u32) {
        let mut gathered = Gathered::new(self, ray);
        let mut way = Way::start(self, ray, &mut gathered);
        let march_span = match steps {
            Steps::Leaf => march_leaf::march,
            Steps::Paper => march_paper::march,
            Steps::Fixed => {
                march_fixed::march(self, ray, &mut way, &mut gathered);
                return (gathered.pixel(self, ray), way.samples);
            }
        };
        while let Some([span, part]) = way.find_stretch(self, ray, &mut gathered) {
            let stretch = [span[0].max(part[0]), span[1].min(part[1])];
            gathered.forget_last();
            if !march_span(self, ray, &mut way, stretch, &mut gathered) {
                break;
            }
            way.leave_stretch(self, ray, &mut gathered);
        }
        (gathered.pixel(self, ray), way.samples)
    }
}

impl<'a> Way<'a> {
    /// Begins with a ray, before its first stretch.
    fn start(scene: &Scene<'a>, ray: &'a Ray, gathered: &mut Gathered) -> Self {
        let mut descent = Descent::new(scene.texture, scene.activity);
        let mut parts = match scene.cuts {
            Some(cuts) => Parts::note(ray, &mut descent, cuts),
            None => Parts::whole(),
        };
        let mut part = parts.next();
        let (mut span, mut surface) = ([0.0, ray.t_out], None);
        if let Some(of_mesh) = scene.surface {
            // Rays on which nothing is seen need not look for the surface.
            if scene.is_skipping {
                part[0] = next_active(ray, &mut descent, 0.0, ray.t_out);
            }
            if part[0] < ray.t_out {
                span = next_span(scene, ray, &mut descent, surface.insert(SurfaceRay::start(of_mesh, ray)), gathered);
            }
        }
        Way { descent, parts, part, span, surface, samples: 0 }
    }

    /// Goes on to the next stretch, or stays in the one that the ray is in: the span and the part that overlap there.
    fn find_stretch(&mut self, scene: &Scene, ray: &Ray, gathered: &mut Gathered) -> Option<[[f32; 2]; 2]> {
        while self.span[0] < self.span[1] && self.part[0] < ray.t_out {
            if self.part[0] < self.span[1] && self.span[0] < self.part[1] {
                return Some([self.span, self.part]);
            }
            self.leave_stretch(scene, ray, gathered);
        }
        None
    }

    /// What ends first makes room for the next.
    fn leave_stretch(&mut self, scene: &Scene, ray: &Ray, gathered: &mut Gathered) {
        if self.part[1] < self.span[1] {
            self.part = self.parts.next();
        } else if let Some(surface) = &mut self.surface {
            let left = surface.last();
            if scene.with_faces && left.t <= ray.t_out {
                gathered.leave_mesh(FacePlace::of_hit(scene, ray, &mut self.descent, left));
            }
            self.span = next_span(scene, ray, &mut self.descent, surface, gathered);
        } else {
            self.span = [FAR, -FAR];
        }
    }
}

/// The next interval inside the surface, cut to the cube; there is none if a face hides it.
fn next_span(scene: &Scene, ray: &Ray, descent: &mut Descent, surface: &mut SurfaceRay, gathered: &mut Gathered) -> [f32; 2] {
    let (enters, leaves) = surface.next_interval();
    let leaves = leaves.min(ray.t_out);
    if scene.with_faces {
        if enters < leaves {
            gathered.enter_mesh(scene, ray, FacePlace::of_hit(scene, ray, descent, surface.first()));
        } else {
            gathered.end_way_out(scene, ray);
        }
        if gathered.is_opaque(scene) {
            return [FAR, -FAR];
        }
    }
    [enters, leaves]
}

/// The step at a depth, `L(d) = L_s / 2^(d-1)`, equation (2) of method 1.4.
fn step_at(step: f32, depth: u32) -> f32 {
    (step / (1u32 << (depth - 1)) as f32).max(MIN_STEP)
}

/// The pixel of a ray without numbers ([`Output::Numbers`]).
pub const NO_NUMBERS: [f32; 4] = [-1.0, 0.0, 0.0, 0.0];

/// Whether a value is passed on the way from one to another.
fn is_between(front: f32, back: f32, value: f32) -> bool {
    (front < value) != (back < value)
}

/// Marches the octree texture along every ray of `frame` by the rule `settings.steps`, row by row on all threads; the result does not
/// depend on their number. With a surface, only what lies inside it is marched. Of the
/// settings, all count but the size, which is the frame's, and those of the GPU.
pub fn march(
    texture: &OctreeTexture,
    surface: Option<&BoundarySurface>,
    frame: &RayFrame,
    classifier: &Classifier,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<MarchOutput, Cancelled> {
    march_again(texture, surface, None, &KeptActivity::default(), frame, classifier, settings, progress)
}

/// [`march`] with the mesh's edges on the frame's planes (on other planes there are none), and with what was active in the march before.
pub fn march_again(
    texture: &OctreeTexture,
    surface: Option<&BoundarySurface>,
    edges: Option<&CutEdges>,
    kept: &KeptActivity,
    frame: &RayFrame,
    classifier: &Classifier,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<MarchOutput, Cancelled> {
    let is_mesh = surface.is_some_and(|surface| !surface.is_box());
    let settings = &settings.for_octree(texture.reconstruction() == Reconstruction::Continuous).with_edges(is_mesh);
    let mut image = Image::new(frame.width, frame.height);
    if settings.output == Output::Numbers {
        image.pixels.fill(NO_NUMBERS);
    }
    progress.begin("march", u64::from(frame.height));
    if texture.depth() == 0 || image.pixels.is_empty() {
        return Ok(MarchOutput { image, samples: 0 });
    }
    let rays = CubeRays::new(frame, texture.root_min(), texture.root_edge());
    let table = classifier.table(texture.root_edge());
    // Without skipping everything counts.
    let style = Style::new(settings, classifier, &table, texture.root_edge());
    let seen = if settings.skip() == Skip::None { vec![[0.0, 1.0]] } else { style.seen(settings.mode, &table) };
    let activity = kept.of(texture, &seen);
    let split = (settings.skip() == Skip::Half).then(|| activity.split(texture));
    let scene = Scene {
        texture,
        edges: edges.filter(|edges| edges.are_on(&frame.planes)),
        surface,
        continuous: texture.reconstruction() == Reconstruction::Continuous,
        table: &table,
        mode: settings.mode,
        output: settings.output,
        style,
        with_surfaces: settings.with_surfaces(),
        with_faces: settings.drawn_faces().is_some() && surface.is_some(),
        rays,
        is_volume_shaded: settings.is_volume_shaded(),
        are_surfaces_shaded: settings.shading.surfaces,
        min_transmittance: settings.min_transmittance as f32,
        activity: &activity,
        is_skipping: settings.skip().is_in_march(),
        cuts: settings.skip().parts().map(|parts| Cuts { parts, split }),
        step: settings.step_in_cubes(texture.root_edge(), texture.depth()),
    };
    let march_row = |(row, pixels): (usize, &mut [[f32; 4]])| {
        progress.check()?;
        let mut samples = 0;
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let ray = Ray::enter(rays.ray(column as u32, row as u32), &rays.clips);
            if ray.t_out > 0.0 {
                let (marched, met) = scene.march(&ray, settings.steps);
                *pixel = marched;
                samples += u64::from(met);
            }
        }
        progress.add(1);
        Ok(samples)
    };
    let rows = image.pixels.par_chunks_mut(frame.width as usize).enumerate();
    let samples = rows.map(march_row).try_reduce(|| 0, |a, b| Ok(a + b))?;
    Ok(MarchOutput { image, samples })
}

#[cfg(test)]
mod tests;
