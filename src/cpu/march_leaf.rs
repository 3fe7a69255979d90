//! The march leaf by leaf: the twin of `shaders/march_leaf.wgsl`.

use super::Scene;
use super::descent::Descent;
use super::ray::{Cell, Ray};
use crate::optics::Light;

/// Follows a ray from leaf to leaf (method 1.4, the stricter rule): constant value from where the ray enters a leaf to where it leaves.
/// Samples placed inside a leaf at a finer step would all find that value, so one a leaf is the same picture.
/// Returns the light and the number of full leaves met.
pub(super) fn march(scene: &Scene, ray: &Ray) -> (Light, u32) {
    let mut descent = Descent::new(scene.texture);
    let cells = descent.cells();
    let mut light = Light::default();
    let mut samples = 0;
    let mut t = 0.0;
    let mut at = ray.cell_at(t, Cell::root(cells), cells);
    loop {
        let (word, cell) = descent.find(at);
        let exits = ray.exits(cell, cells);
        let t_exit = exits.min_element();
        let t_next = t_exit.min(ray.t_out).max(t);
        if word.0 != 0 {
            samples += 1;
            light.add_constant(scene.table, word.value(), (t_next - t) * ray.length);
            if light.transmittance < scene.min_transmittance {
                break;
            }
        }
        at = ray.step(cell, exits, t_exit, cells);
        if at.max_element() >= cells {
            break;
        }
        t = t_next;
    }
    (light, samples)
}
