//! An octree texture as a regular volume that is read box by box.

use super::OctreeTexture;
use crate::geometry::Placed;
use crate::volume::{GridFrame, Samples, VoxelSource, VoxelType};
use glam::DVec3;
use rayon::prelude::*;
use std::io;
use std::ops::Range;

/// The octree of a subject, sampled at the middles of equal cubes over the subject's bounds. Where the octree is empty nothing is known.
#[derive(Debug)]
pub struct OctreeVolume {
    texture: OctreeTexture,
    frame: GridFrame,
    name: String,
    /// Position of the first voxel in the root cube, and the way to the next, root edges.
    first: DVec3,
    step: f64,
}

impl OctreeVolume {
    /// `longest` voxels along the longest edge of the subject's bounds, at least 2 along each.
    pub fn new(texture: OctreeTexture, subject: &impl Placed, name: String, longest: u32) -> Self {
        let bounds = subject.bounds();
        let size = bounds.size();
        let step = size.max_element() / f64::from(longest.max(2));
        let dims = size.to_array().map(|length| ((length / step - 1e-9).ceil() as u32).max(2));
        // The cubes stand evenly about the bounds' middle.
        let first = bounds.center() - (DVec3::from(dims.map(f64::from)) - 1.0) * step / 2.0;
        let frame = GridFrame::along_axes(dims, first + subject.center(), DVec3::splat(step));
        let edge = texture.root_edge();
        let first = (first - texture.root_min()) / edge;
        OctreeVolume { frame, name, first, step: step / edge, texture }
    }

    /// Voxels along the longest edge that are as large as the smallest leaves.
    pub fn finest(texture: &OctreeTexture, subject: &impl Placed) -> u32 {
        let leaf = texture.root_edge() / f64::from(texture.depth()).exp2();
        (subject.bounds().size().max_element() / leaf).ceil().clamp(2.0, f64::from(1 << 24)) as u32
    }
}

impl VoxelSource for OctreeVolume {
    fn frame(&self) -> &GridFrame {
        &self.frame
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn voxel_type(&self) -> VoxelType {
        VoxelType::F32
    }

    fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples> {
        let [width, height, depth] = crate::volume::box_points(region, self.frame.dims)?;
        let [low, high] = self.texture.value_range();
        let mut values = Vec::new();
        values.try_reserve_exact(width * height * depth)?;
        values.resize(width * height * depth, f32::NAN);
        let rows = values.par_chunks_mut(width.max(1)).enumerate();
        rows.for_each(|(row, values)| {
            let (y, z) = (region[1].start as usize + row % height, region[2].start as usize + row / height);
            for (value, x) in values.iter_mut().zip(region[0].clone()) {
                let unit = self.first + DVec3::new(f64::from(x), y as f64, z as f64) * self.step;
                if unit.min_element() >= 0.0 && unit.max_element() < 1.0 {
                    *value = self.texture.value_at(unit).map_or(f32::NAN, |v| (low + f64::from(v) * (high - low)) as f32);
                }
            }
        });
        Ok(Samples::from(values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ScalarField, generate};
    use crate::octree::{OctreeParams, regularize};
    use crate::progress::Progress;

    #[test]
    fn a_linear_field_is_itself_at_the_voxels() {
        let layers = generate::plan(generate::Shape::Cube, Some(3000)).expect("a plan");
        let mesh = crate::mesh::collect(&*layers).expect("a mesh");
        let field = ScalarField::select(&mesh, &Default::default()).expect("a field");
        let params = OctreeParams { max_depth: 6, ..Default::default() };
        let tree = regularize(&mesh, &field, &params, &Progress::new()).expect("regularized");
        let texture = OctreeTexture::encode(&tree).expect("it fits");
        let longest = OctreeVolume::finest(&texture, &mesh);
        let volume = OctreeVolume::new(texture, &mesh, "linear".into(), longest);
        let frame = *volume.frame();
        let samples = volume.read(&frame.dims.map(|n| 0..n)).expect("read");
        let scale = (field.range[1] - field.range[0]).abs();
        let mut known = 0;
        for i in 0..samples.len() {
            let at = [
                i % frame.dims[0] as usize,
                i / frame.dims[0] as usize % frame.dims[1] as usize,
                i / (frame.dims[0] * frame.dims[1]) as usize,
            ];
            let world = frame.origin + frame.steps * DVec3::from(at.map(|v| v as f64));
            let expected = world.dot(DVec3::new(1.0, 2.0, 4.0)) / 8.0;
            let value = samples.get(i);
            known += usize::from(!value.is_nan());
            assert!(value.is_nan() || (value - expected).abs() < 1e-4 * scale, "{value} {expected}");
        }
        assert!(known * 10 > samples.len() * 9, "{known} of {}", samples.len());
        let part = volume.read(&[1..3, 0..2, 1..2]).expect("read");
        assert_eq!((part.len(), part.get(0).to_bits()), (4, samples.get(1 + (frame.dims[0] * frame.dims[1]) as usize).to_bits()));
    }
}
