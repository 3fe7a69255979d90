//! The boundary faces in a bounding volume hierarchy: where rays enter the mesh.

use super::walk::{Entry, Ray, Vertex, enter};
use crate::geometry::FACES;
use crate::mesh::adjacency::{BoundaryFace, Tet};
use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use std::time::Duration;

/// All boundary faces. Boxes are f32 and a little too large; what a ray hits is decided in f64.
pub(super) struct Boundary {
    /// In the order of the hierarchy's leaves.
    faces: Vec<BoundaryFace>,
    bvh: Bvh2,
}

impl Boundary {
    /// Builds the hierarchy over `faces`. Positions are in scene units, at most about 1.
    pub fn new(faces: &[BoundaryFace], vertices: &[Vertex], tets: &[Tet]) -> Self {
        let boxes: Vec<Aabb> = faces
            .iter()
            .map(|&(tet, face)| {
                let corners = &tets[tet as usize].corners;
                let [a, b, c] = FACES[face as usize].map(|corner| vertices[corners[corner] as usize].position);
                let (min, max) = (a.min(b).min(c), a.max(b).max(c));
                let margin = |v: DVec3| v.abs() * 1e-6 + 1e-9; // rounding to f32 takes 6e-8
                Aabb { min: (min - margin(min)).as_vec3a(), max: (max + margin(max)).as_vec3a() }
            })
            .collect();
        if boxes.is_empty() {
            return Boundary { faces: Vec::new(), bvh: Bvh2::default() };
        }
        let mut bvh = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        let faces = bvh.primitive_indices.iter().map(|&i| faces[i as usize]).collect();
        bvh.primitive_indices = Vec::new();
        Boundary { faces, bvh }
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.faces[..]) + size_of_val(&self.bvh.nodes[..])
    }

    /// Collects every face through which the whole line of `ray` enters a tet, nearest first.
    pub fn entries(&self, ray: &Ray, vertices: &[Vertex], tets: &[Tet], stack: &mut Vec<u32>, entries: &mut Vec<Entry>) {
        entries.clear();
        stack.clear();
        if !self.faces.is_empty() {
            stack.push(0);
        }
        let inverse = ray.direction.recip();
        while let Some(index) = stack.pop() {
            let node = &self.bvh.nodes[index as usize];
            if !line_meets_box(ray.origin, inverse, node.aabb().min, node.aabb().max) {
                continue;
            }
            let first = node.first_index;
            if node.is_leaf() {
                let leaf = &self.faces[first as usize..(first + node.prim_count) as usize];
                entries.extend(leaf.iter().filter_map(|&face| enter(ray, vertices, tets, face)));
            } else {
                stack.extend([first + 1, first]);
            }
        }
        entries.sort_unstable_by(|a, b| a.at.t.total_cmp(&b.at.t).then(a.tet.cmp(&b.tet)));
    }
}

/// The slab test (Kay & Kajiya 1986) in f64 for a line that extends both ways. `inverse` is infinite along axes that the line is
/// perpendicular to.
fn line_meets_box(origin: DVec3, inverse: DVec3, min: Vec3A, max: Vec3A) -> bool {
    let (a, b) = ((min.as_dvec3() - origin) * inverse, (max.as_dvec3() - origin) * inverse);
    a.min(b).max_element() <= a.max(b).min_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_along_an_axis_meet_the_boxes_they_pass_through() {
        let (min, max) = (Vec3A::new(-1.0, -1.0, 2.0), Vec3A::new(1.0, 1.0, 3.0));
        for direction in [DVec3::Z, -DVec3::Z, DVec3::new(-0.0, 0.0, 1.0)] {
            assert!(line_meets_box(DVec3::new(0.5, -0.5, 10.0), direction.recip(), min, max));
            assert!(!line_meets_box(DVec3::new(1.5, -0.5, 10.0), direction.recip(), min, max));
        }
    }
}
