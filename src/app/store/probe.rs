//! What is under the pointer.

use super::super::widgets::{position, significant};
use super::space::Space;
use super::stream::Stream;
use crate::bricks::{BrickKey, sample::brick_of};
use glam::DVec3;

/// A voxel and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probed {
    /// Its index along x, y, z.
    pub index: [u32; 3],
    /// Where it is in the world.
    pub world: DVec3,
    /// Its value from the finest level in memory, if it is not missing, and that level.
    pub value: Option<(Option<f64>, u8)>,
}

impl Probed {
    /// The voxel that is nearest to a position; `None` outside the volume.
    pub fn at(position: DVec3, space: &Space, stream: &Stream) -> Option<Self> {
        let nearest = (position + 0.5).floor();
        let dims = DVec3::from(space.dims.map(f64::from));
        if !(nearest.cmpge(DVec3::ZERO).all() && nearest.cmplt(dims).all()) {
            return None;
        }
        let value = stream.value_at(nearest);
        Some(Probed { index: nearest.as_uvec3().to_array(), world: space.world(nearest), value })
    }

    /// The brick of the finest level that holds it.
    pub fn brick(&self) -> BrickKey {
        brick_of(0, self.index).0
    }

    /// In a line.
    pub fn text(&self) -> String {
        let [x, y, z] = self.index;
        let value = match self.value {
            None => "loading".to_owned(),
            Some((None, _)) => "no data".to_owned(),
            Some((Some(value), 0)) => significant(value),
            Some((Some(value), level)) => format!("about {} (level {level})", significant(value)),
        };
        format!("{value}   at {x}, {y}, {z}   {}", position(self.world))
    }
}
