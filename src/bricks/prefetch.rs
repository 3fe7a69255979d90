//! The bricks that slices in motion will meet next: [`Ahead`].

use super::{BRICK_EDGE, BrickKey, KeySet, Pyramid, SlicePlane, SliceSet};

/// Looks ahead along the motion of slices, from one frame to the next.
#[derive(Debug, Clone, Default)]
pub struct Ahead {
    before: Vec<SlicePlane>,
    /// Voxels of level 0 that each slice moves in a frame, along its normal.
    speeds: Vec<f64>,
}

impl Ahead {
    /// How many frames of its motion a slice is looked ahead.
    const FRAMES: f64 = 60.0;
    /// How many bricks at least and at most.
    const BRICKS: [f64; 2] = [1.0, 3.0];

    /// The bricks of a level that the slices need here and next, where they move as they moved since the call before: those of this frame
    /// first, then by the time until they are met. A slice that rests or turns is not looked ahead.
    pub fn next(&mut self, pyramid: &Pyramid, slices: &SliceSet, level: u8) -> Vec<BrickKey> {
        self.speeds = slices
            .planes
            .iter()
            .enumerate()
            .map(|(i, plane)| match self.before.get(i) {
                Some(before) if before.normal.dot(plane.normal) > 1.0 - 1e-9 => before.distance(plane.point),
                _ => 0.0,
            })
            .collect();
        self.before.clone_from(&slices.planes);
        let pitch = f64::from(BRICK_EDGE) * f64::from(level).exp2();
        let mut steps: Vec<(f64, SlicePlane)> = Vec::new();
        for (plane, &speed) in slices.planes.iter().zip(&self.speeds) {
            if speed == 0.0 {
                continue;
            }
            let reach = (speed.abs() * Self::FRAMES).clamp(Self::BRICKS[0] * pitch, Self::BRICKS[1] * pitch);
            let half_bricks = (reach / (pitch / 2.0)).ceil() as u32;
            steps.extend((0..=half_bricks).map(|k| {
                let distance = f64::from(k) * pitch / 2.0;
                let point = plane.point + plane.normal * distance.copysign(speed);
                (distance / speed.abs(), SlicePlane { point, ..*plane })
            }));
        }
        steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut seen = KeySet::default();
        steps.iter().flat_map(|(_, plane)| pyramid.cut(plane, level)).filter(|&key| seen.insert(key)).collect()
    }
}
