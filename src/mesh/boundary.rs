//! The mesh's surface as rays in f32 meet it, on the CPU and the GPU: where they enter and leave the mesh.

use super::adjacency::{self, BoundaryFace, Tet};
use super::{ScalarField, TetMesh};
use crate::geometry::FACES;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;
use std::ops::Range;

/// Boxes of faces are this much too large on each side, in cube edges: more than f32 can be off along a ray through the cube.
const MARGIN: f32 = 2e-6;

/// The most faces of a leaf that a node has bits for.
const FACES_PER_LEAF: usize = 3;

/// More boxes whose centres are the same to 2^-21 of the cube are no place for a clever hierarchy.
const MOST_AT_ONE_PLACE: usize = 64;

/// How far inside the cube the corners of a box stay, in cube edges: as far as those of a mesh in its root cube.
const BOX_MARGIN: f64 = 5e-6;

/// Deepest hierarchy that rays can follow: the size of their stack.
pub const MAX_LEVELS: u32 = 32;

/// All boundary faces of a mesh in edges of its root cube ([`TetMesh::root_cube`]), which is [0, 1)^3, under a hierarchy of boxes.
///
/// A face belongs to one tet: it is the one of a face through which no other tet is linked ([`adjacency::link`]). The surface is closed, so
/// any line enters it as often as it leaves it, by [`crate::geometry::FACES`]' outward order.
#[derive(Debug, Clone, Default)]
pub struct BoundarySurface {
    vertices: Vec<SurfaceVertex>,
    faces: Vec<SurfaceFace>,
    nodes: Vec<SurfaceNode>,
    is_box: bool,
}

/// A point of the surface, 16 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SurfaceVertex {
    /// In [0, 1).
    pub position: [f32; 3],
    /// Its index among the mesh's points.
    pub point: u32,
}

/// A face of the surface, 16 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct SurfaceFace {
    /// Indices of its vertices, such that the normal `(b - a) x (c - a)` points out of the mesh.
    pub vertices: [u32; 3],
    /// The tet behind it.
    pub tet: u32,
}

/// A node of the compressed wide hierarchy (Ylitie, Karras & Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
/// BVHs", HPG 2017) as obvhs lays it out, 80 bytes; byte i of eight belongs to child i.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct SurfaceNode {
    /// Lowest corner, as bits of f32.
    pub low: [u32; 3],
    /// Biased exponents of the unit of the children's bounds along x, y, z; in the highest byte which children are nodes.
    pub scale_and_inner: u32,
    /// The first child that is a node; others follow in the order of the children.
    pub first_node: u32,
    /// The first face of children that are leaves.
    pub first_face: u32,
    /// 0: no child. A leaf has its faces' offset from `first_face` in the low 5 bits, and above them a bit for each face, 1 to 3.
    pub children: [u32; 2],
    /// Lower and upper bounds along x, y, z: x lower, x upper, y lower and so on, eight bytes each.
    pub bounds: [[u32; 2]; 6],
}

impl BoundarySurface {
    /// The surface of the tets that are [`ScalarField::is_usable`].
    pub fn new(mesh: &TetMesh, field: &ScalarField) -> Self {
        let (tets, faces) = adjacency::link(mesh.tets(), |tet| field.is_usable(mesh, tet));
        let (min, edge) = mesh.root_cube();
        Self::from_linked(mesh.points(), min, edge, &tets, faces)
    }

    /// The surface of tets that are linked already: `faces` are the boundary faces that [`adjacency::link`] gives with `tets`. Positions are
    /// relative to a cube with lowest corner `cube_min` and edge `cube_edge`, which must hold them.
    pub fn from_linked(points: &[DVec3], cube_min: DVec3, cube_edge: f64, tets: &[Tet], mut faces: Vec<BoundaryFace>) -> Self {
        faces.par_sort_unstable(); // whatever order linking gives: the hierarchy depends on it
        let corners = |&(tet, face): &BoundaryFace| FACES[face as usize].map(|corner| tets[tet as usize].corners[corner]);
        let mut used: Vec<u32> = faces.par_iter().flat_map_iter(corners).collect();
        used.par_sort_unstable();
        used.dedup();
        let vertices: Vec<SurfaceVertex> = used
            .par_iter()
            .map(|&point| SurfaceVertex { position: cube_position(points[point as usize], cube_min, cube_edge).to_array(), point })
            .collect();
        let index = |point: u32| used.binary_search(&point).expect("every corner was collected") as u32;
        let faces: Vec<SurfaceFace> =
            faces.par_iter().map(|face| SurfaceFace { vertices: corners(face).map(index), tet: face.0 }).collect();

        let boxes: Vec<Aabb> = faces
            .par_iter()
            .map(|face| {
                let [a, b, c] = face.vertices.map(|v| Vec3A::from(vertices[v as usize].position));
                Aabb { min: a.min(b).min(c) - MARGIN, max: a.max(b).max(c) + MARGIN }
            })
            .collect();
        let (nodes, order) = hierarchy(&boxes);
        let faces = order.iter().map(|&i| faces[i as usize]).collect();
        BoundarySurface { vertices, faces, nodes, is_box: false }
    }

    /// The surface of a box with these corners, number `x + 2 y + 4 z` along its axes, which need not be the world's: 12 triangles. Corners
    /// at the cube's sides are moved inside by 5e-6 of its edge.
    pub fn of_box(corners: &[DVec3; 8], cube_min: DVec3, cube_edge: f64) -> Self {
        let (low, high) = (cube_min + cube_edge * BOX_MARGIN, cube_min + cube_edge * (1.0 - BOX_MARGIN));
        let mut points = corners.map(|corner| corner.clamp(low, high));
        if (points[1] - points[0]).cross(points[2] - points[0]).dot(points[4] - points[0]) < 0.0 {
            (0..8).step_by(2).for_each(|i| points.swap(i, i + 1)); // a left-handed box, seen from its other side
        }
        let tets = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
        let (tets, faces) = adjacency::link(&tets, |_| true);
        BoundarySurface { is_box: true, ..Self::from_linked(&points, cube_min, cube_edge, &tets, faces) }
    }

    /// Whether it is a volume's box, so that the edges of its triangles mean nothing.
    pub fn is_box(&self) -> bool {
        self.is_box
    }

    /// The points of the faces, by ascending index among the mesh's points.
    pub fn vertices(&self) -> &[SurfaceVertex] {
        &self.vertices
    }

    /// The faces, in the order of the hierarchy's leaves.
    pub fn faces(&self) -> &[SurfaceFace] {
        &self.faces
    }

    /// The hierarchy, root first; empty if there are no faces.
    pub fn nodes(&self) -> &[SurfaceNode] {
        &self.nodes
    }

    /// Bytes in memory, on host and device alike: at most 48 a face but for the smallest surfaces.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.faces[..]) + size_of_val(&self.nodes[..])
    }
}

/// A point in edges of a cube, as f32 renderers see it.
pub fn cube_position(point: DVec3, cube_min: DVec3, cube_edge: f64) -> Vec3 {
    ((point - cube_min) / cube_edge).as_vec3()
}

/// A hierarchy over boxes that is at most [`MAX_LEVELS`] deep, and the boxes in the order of its leaves.
fn hierarchy(boxes: &[Aabb]) -> (Vec<SurfaceNode>, Vec<u32>) {
    if boxes.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let mut codes: Vec<(u64, u32)> = (0..).zip(boxes).map(|(i, b)| (morton_code(Vec3::from((b.min + b.max) * 0.5)), i)).collect();
    codes.par_sort_unstable();
    // Many boxes at one place would become a chain, by quadratic work.
    if codes.chunk_by(|a, b| a.0 == b.0).any(|run| run.len() > MOST_AT_ONE_PLACE) {
        return balanced(boxes, codes.iter().map(|code| code.1).collect());
    }
    // As `build_cwbvh` does, which in debug builds would end the program over a deep tree.
    let params = BvhBuildParams::fast_build();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    // What follows goes down by recursion.
    if binary_levels(&binary) <= 4 * MAX_LEVELS {
        ReinsertionOptimizer::default().run(&mut binary, params.reinsertion_batch_ratio, None);
        let wide = bvh2_to_cwbvh(&binary, FACES_PER_LEAF as u32, true, false);
        let nodes: &[SurfaceNode] = bytemuck::cast_slice(&wide.nodes);
        if levels(nodes) <= MAX_LEVELS {
            return (nodes.to_vec(), wide.primitive_indices);
        }
    }
    balanced(boxes, codes.iter().map(|code| code.1).collect())
}

/// How many nodes lie on the longest way down.
fn levels(nodes: &[SurfaceNode]) -> u32 {
    deepest(|node| {
        let SurfaceNode { first_node, scale_and_inner, .. } = nodes[node as usize];
        first_node..first_node + (scale_and_inner >> 24).count_ones()
    })
}

fn binary_levels(bvh: &Bvh2) -> u32 {
    deepest(|node| {
        let node = &bvh.nodes[node as usize];
        if node.is_leaf() { 0..0 } else { node.first_index..node.first_index + 2 }
    })
}

fn deepest(children: impl Fn(u32) -> Range<u32>) -> u32 {
    let (mut deepest, mut stack) = (0, vec![(0, 1)]);
    while let Some((node, level)) = stack.pop() {
        deepest = deepest.max(level);
        stack.extend(children(node).map(|child| (child, level + 1)));
    }
    deepest
}

/// A hierarchy as shallow as can be: boxes along a curve, cut into eight by number.
fn balanced(boxes: &[Aabb], order: Vec<u32>) -> (Vec<SurfaceNode>, Vec<u32>) {
    let mut nodes = vec![SurfaceNode::zeroed()];
    let mut todo = vec![(0, 0..order.len())];
    while let Some((at, faces)) = todo.pop() {
        // Either all children are leaves or all are nodes.
        let (count, leaves) = (faces.len(), faces.len() <= 8 * FACES_PER_LEAF);
        let parts = if leaves { count.div_ceil(FACES_PER_LEAF) } else { (count / (FACES_PER_LEAF + 1)).min(8) };
        let part = |i: usize| faces.start + count * i / parts..faces.start + count * (i + 1) / parts;
        let around = |part: Range<usize>| order[part].iter().fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]));
        let mut node = SurfaceNode::around(&(0..parts).map(|i| around(part(i))).collect::<Vec<_>>());
        (node.first_node, node.first_face) = (nodes.len() as u32, faces.start as u32);
        for child in 0..parts {
            let meta = if leaves {
                ((1 << part(child).len()) - 1) << 5 | (part(child).start - faces.start) as u32
            } else {
                node.scale_and_inner |= 1 << (24 + child);
                todo.push((nodes.len(), part(child)));
                nodes.push(SurfaceNode::zeroed());
                1 << 5 | (24 + child as u32)
            };
            node.children[child / 4] |= meta << (8 * (child % 4));
        }
        nodes[at] = node;
    }
    (nodes, order)
}

/// A point of [0, 1)^3 as a number that is near for near points: the bits of its coordinates in turn (Morton 1966).
pub fn morton_code(position: Vec3) -> u64 {
    let spread = |x: f32| {
        let x = (x.clamp(0.0, 1.0) * 2_097_151.0) as u64;
        let x = (x | x << 32) & 0x001f_0000_0000_ffff;
        let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(position.x) | spread(position.y) << 1 | spread(position.z) << 2
}

impl SurfaceNode {
    /// A node whose children have these boxes, at most 8, and are nothing yet.
    fn around(children: &[Aabb]) -> Self {
        let all = children.iter().fold(Aabb::empty(), |all, child| all.union(child));
        let low = all.min.to_array();
        let exponent = |axis: usize| (f64::from(all.max[axis] - all.min[axis]) / 255.0).log2().ceil().clamp(-126.0, 126.0) as i32;
        let exponents = [0, 1, 2].map(exponent);
        let mut node = SurfaceNode { low: low.map(f32::to_bits), ..SurfaceNode::zeroed() };
        for axis in 0..3 {
            node.scale_and_inner |= ((exponents[axis] + 127) as u32) << (8 * axis);
            for (i, child) in children.iter().enumerate() {
                let units = |x: f32| (f64::from(x) - f64::from(low[axis])) / f64::from(exponents[axis]).exp2();
                let byte = |x: f64| (x.clamp(0.0, 255.0) as u32) << (8 * (i % 4));
                node.bounds[2 * axis][i / 4] |= byte(units(child.min[axis]).floor());
                node.bounds[2 * axis + 1][i / 4] |= byte(units(child.max[axis]).ceil());
            }
        }
        node
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every box lies in the boxes of the leaf and the nodes above it, and is there once.
    fn assert_holds(boxes: &[Aabb], (nodes, order): &(Vec<SurfaceNode>, Vec<u32>)) {
        let mut seen = vec![0; boxes.len()];
        let mut todo = vec![(0u32, Vec::<Aabb>::new())];
        while let Some((at, above)) = todo.pop() {
            let node = nodes[at as usize];
            let mut inner = node.first_node;
            for child in 0..8usize {
                let meta = node.children[child / 4] >> (8 * (child % 4)) & 255;
                let byte = |i: usize| ((node.bounds[i][child / 4] >> (8 * (child % 4))) & 255) as f32;
                let corner = |upper: usize| {
                    let scale = |axis: usize| f32::from_bits((node.scale_and_inner >> (8 * axis) & 255) << 23);
                    Vec3A::from([0, 1, 2].map(|axis| f32::from_bits(node.low[axis]) + byte(2 * axis + upper) * scale(axis)))
                };
                let mut around = above.clone();
                around.push(Aabb { min: corner(0) - 1e-6, max: corner(1) + 1e-6 });
                if node.scale_and_inner >> (24 + child) & 1 == 1 {
                    todo.push((inner, around));
                    inner += 1;
                } else {
                    for i in 0..(meta >> 5).count_ones() {
                        let face = order[(node.first_face + (meta & 31) + i) as usize] as usize;
                        let holds = |b: &Aabb| b.min.cmple(boxes[face].min).all() && b.max.cmpge(boxes[face].max).all();
                        assert!(around.iter().all(holds), "{:?} is not inside {around:?}", boxes[face]);
                        seen[face] += 1;
                    }
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }

    fn boxes(count: usize) -> Vec<Aabb> {
        let at = |i: usize, k: usize| ((i * k) as f32 * 0.618_034).fract();
        let corner = |i: usize| Vec3A::new(at(i, 1), at(i, 7), at(i, 13));
        (0..count).map(|i| Aabb { min: corner(i), max: corner(i) + Vec3A::new(at(i, 3), 0.0, at(i, 5)) * 0.01 }).collect()
    }

    #[test]
    fn a_box_has_twelve_faces_that_point_out_of_it() {
        for mirrored in [1.0, -1.0] {
            let corner = |k: usize| DVec3::new(mirrored * (k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            let surface = BoundarySurface::of_box(&std::array::from_fn(corner), DVec3::new(mirrored.min(0.0), 0.0, 0.0), 1.0);
            assert_eq!((surface.faces().len(), surface.vertices().len()), (12, 8));
            let mut volume = 0.0;
            for face in surface.faces() {
                let [a, b, c] = face.vertices.map(|v| Vec3::from(surface.vertices()[v as usize].position));
                assert!((b - a).cross(c - a).dot((a + b + c) / 3.0 - 0.5) > 0.0, "{a} {b} {c}");
                volume += a.dot(b.cross(c)) / 6.0;
            }
            assert!((volume - 1.0).abs() < 1e-4 && volume < 1.0, "{volume}");
        }
    }

    #[test]
    fn hierarchies_hold_every_box_once() {
        for count in [1, 2, 3, 4, 24, 25, 31, 32, 33, 200, 5000] {
            let boxes = boxes(count);
            assert_holds(&boxes, &hierarchy(&boxes));
            let balanced = balanced(&boxes, (0..count as u32).rev().collect());
            assert_holds(&boxes, &balanced);
            let most = 1 + (count as f64 / 4.0).max(1.0).log(8.0).ceil() as u32;
            assert!(levels(&balanced.0) <= most + 1, "{count} boxes are {} levels", levels(&balanced.0));
        }
    }

    #[test]
    fn equal_boxes_are_no_deep_chain() {
        let boxes = vec![boxes(2)[1]; 20_000];
        let found = hierarchy(&boxes);
        assert!(levels(&found.0) <= MAX_LEVELS);
        assert_holds(&boxes, &found);
    }

    #[test]
    fn morton_codes_follow_the_cubes_octants() {
        let codes = [[0.1, 0.1, 0.1], [0.6, 0.1, 0.1], [0.1, 0.6, 0.1], [0.6, 0.6, 0.1], [0.1, 0.1, 0.6], [0.9, 0.9, 0.9]];
        let codes = codes.map(|p| morton_code(Vec3::from(p)) >> 60);
        assert_eq!(codes, [0, 1, 2, 3, 4, 7]);
        assert!(morton_code(Vec3::splat(0.3)) < morton_code(Vec3::new(0.3, 0.3, 0.300_1)));
    }
}
