//! The marcher on the CPU: what the shaders must do, written to be read, and the fallback on a machine without an adapter.
//!
//! Each file is the twin of the shader of its name: same functions, same order, f32 throughout. Lengths are in edges of the root cube.

mod descent;
mod march_leaf;
mod march_paper;
mod ray;
mod surface;
#[cfg(test)]
mod surface_tests;

use descent::Descent;
pub use descent::{INTERIOR, MAX_DEPTH};
pub use march_leaf::MAX_PIECES;
pub use ray::{FAR, PARALLEL};
pub use surface::{MAX_HITS, TINY, surface_intervals};

use crate::image::Image;
use crate::mesh::BoundarySurface;
use crate::octree::{OctreeTexture, Reconstruction};
use crate::optics::{Classifier, KnotTable, Light};
use crate::progress::{Cancelled, Progress};
use crate::view::{CubeRays, RayFrame, RenderSettings, Steps};
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
    /// Look-ups that found a full leaf: `leaf`, the leaves that rays pass; `paper`, all samples, those stepped back from included.
    pub samples: u64,
}

/// What all rays of an image share.
struct Scene<'a> {
    texture: &'a OctreeTexture,
    /// Where rays enter and leave the mesh; without it they march through the whole cube.
    surface: Option<&'a BoundarySurface>,
    continuous: bool,
    table: &'a KnotTable,
    min_transmittance: f32,
    /// L_s in cube edges.
    step: f32,
}

impl Scene<'_> {
    /// L_s in a ray's t, within 2^-11 of it.
    fn step_along(&self, ray: &Ray) -> f32 {
        self.step * ray.inverse_length()
    }

    /// Marches a ray through the cube, or through the parts of it that the surface leaves. Returns the light and the number of full leaves
    /// looked up.
    fn march(&self, ray: &Ray, steps: Steps) -> (Light, u32) {
        let march = match steps {
            Steps::Leaf => march_leaf::march,
            Steps::Paper => march_paper::march,
        };
        let mut descent = Descent::new(self.texture);
        let (mut light, mut samples) = (Light::default(), 0);
        let Some(surface) = self.surface else {
            march(self, ray, &mut descent, [0.0, ray.t_out], &mut light, &mut samples);
            return (light, samples);
        };
        let mut way = SurfaceRay::start(surface, ray);
        loop {
            let (enters, leaves) = way.next_interval();
            let leaves = leaves.min(ray.t_out);
            // Rays that pass behind the cube's far side have nothing left to meet.
            if enters >= leaves || !march(self, ray, &mut descent, [enters, leaves], &mut light, &mut samples) {
                return (light, samples);
            }
        }
    }
}

/// The step at a depth, `L(d) = L_s / 2^(d-1)`, equation (2) of method 1.4.
fn step_at(step: f32, depth: u32) -> f32 {
    (step / (1u32 << (depth - 1)) as f32).max(MIN_STEP)
}

/// Marches the octree texture along every ray of `frame` by the rule `settings.steps`, row by row on all threads; the result does not
/// depend on their number. With a surface, only what lies inside it is marched. Of the settings, `steps`, `step_world` and `min_transmittance` count; the size is the frame's.
pub fn march(
    texture: &OctreeTexture,
    surface: Option<&BoundarySurface>,
    frame: &RayFrame,
    classifier: &Classifier,
    settings: &RenderSettings,
    progress: &Progress,
) -> Result<MarchOutput, Cancelled> {
    let mut image = Image::new(frame.width, frame.height);
    progress.begin("march", u64::from(frame.height));
    if texture.depth() == 0 || image.pixels.is_empty() {
        return Ok(MarchOutput { image, samples: 0 });
    }
    let rays = CubeRays::new(frame, texture.root_min(), texture.root_edge());
    let table = classifier.table(texture.root_edge());
    let scene = Scene {
        texture,
        surface,
        continuous: texture.reconstruction() == Reconstruction::Continuous,
        table: &table,
        min_transmittance: settings.min_transmittance as f32,
        step: settings.step_world.map_or(0.5, |step| step / texture.root_edge()) as f32,
    };
    let march_row = |(row, pixels): (usize, &mut [[f32; 4]])| {
        progress.check()?;
        let mut samples = 0;
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let ray = Ray::enter(rays.ray(column as u32, row as u32));
            if ray.t_out > 0.0 {
                let (light, met) = scene.march(&ray, settings.steps);
                *pixel = light.rgba();
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
