//! Where data lie in the world.

use super::Aabb;
use glam::DVec3;

/// Data that lie somewhere: a mesh or a volume. Renderers take coordinates relative to the centre, so that data far from the origin keep
/// their precision.
pub trait Placed {
    /// The world position that all coordinates are relative to: the middle of the bounds.
    fn center(&self) -> DVec3;

    /// Bounds of all points, relative to the centre.
    fn bounds(&self) -> Aabb;
}
