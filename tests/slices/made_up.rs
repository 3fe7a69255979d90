//! A volume of bricks whose numbers are computed, of any size.

use glam::DVec3;
use octetra::bricks::{BRICK_EDGE, Brick, BrickKey, BrickSource, BrickStatistics, Pyramid};
use octetra::volume::{GridFrame, Samples};

/// A voxel of a level.
pub type Value = fn(u8, [u32; 3]) -> f32;

#[derive(Debug)]
pub struct MadeUp {
    pyramid: Pyramid,
    frame: GridFrame,
    pub value: Value,
    range: [f64; 2],
}

impl MadeUp {
    pub fn new(dims: [u32; 3], spacing: DVec3, range: [f64; 2], value: Value) -> Self {
        MadeUp { pyramid: Pyramid::new(dims), frame: GridFrame::along_axes(dims, DVec3::new(1000.0, 2000.0, 0.0), spacing), value, range }
    }
}

impl BrickSource for MadeUp {
    fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    fn frame(&self) -> &GridFrame {
        &self.frame
    }

    fn name(&self) -> &str {
        "made up"
    }

    fn range(&self) -> [f64; 2] {
        self.range
    }

    fn voxel_bytes(&self) -> usize {
        4
    }

    fn statistics(&self, _: BrickKey) -> Option<BrickStatistics> {
        None
    }

    fn load(&self, key: BrickKey) -> std::io::Result<Brick> {
        let last = self.pyramid.dims(key.level).map(|n| n - 1);
        let mut values = Vec::with_capacity((BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize);
        let [x0, y0, z0] = key.at.map(|at| at * BRICK_EDGE);
        for z in z0..z0 + BRICK_EDGE {
            for y in y0..y0 + BRICK_EDGE {
                for x in x0..x0 + BRICK_EDGE {
                    values.push((self.value)(key.level, [x.min(last[0]), y.min(last[1]), z.min(last[2])]));
                }
            }
        }
        Ok(Brick { samples: Samples::F32(values.into()) })
    }
}
