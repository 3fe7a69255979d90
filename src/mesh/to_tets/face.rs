//! A face into triangles, alike from its two sides.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// Cuts a face (3 points or more in order around it) into triangles with its sense, by its points alone: whichever of them it begins with
/// and in whichever sense it goes round, the triangles have the same corners. Points that are named twice in a row are one.
pub(crate) fn triangulate(points: &[DVec3], face: &[u32], out: &mut Vec<[u32; 3]>) {
    let mut ring: Vec<u32> = Vec::with_capacity(face.len());
    face.iter().for_each(|&node| {
        if ring.last() != Some(&node) {
            ring.push(node)
        }
    });
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    if ring.len() < 3 {
        return;
    }
    // From the lowest index on, towards the lower of its neighbours.
    let lowest = (0..ring.len()).min_by_key(|&i| ring[i]).unwrap_or(0);
    ring.rotate_left(lowest);
    let is_turned = ring[1] > ring[ring.len() - 1];
    if is_turned {
        ring[1..].reverse();
    }
    let start = out.len();
    out.extend(fan(&ring, 0));
    if ring.len() > 3 && !is_sound(points, &ring, &out[start..]) {
        let other = if ring.len() == 4 { Some(fan(&ring, 1).collect()) } else { delaunay(points, &ring) };
        if let Some(other) = other.filter(|triangles: &Vec<_>| is_sound(points, &ring, triangles)) {
            out.truncate(start);
            out.extend(other);
        }
    }
    if is_turned {
        out[start..].iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
}

/// All triangles of one corner of a ring with the edges that do not have it.
fn fan(ring: &[u32], from: usize) -> impl Iterator<Item = [u32; 3]> + '_ {
    let at = move |i: usize| ring[(from + i) % ring.len()];
    (1..ring.len() - 1).map(move |i| [at(0), at(i), at(i + 1)])
}

/// Twice the area of a polygon, along its normal (Newell).
fn normal(points: &[DVec3], ring: &[u32]) -> DVec3 {
    let origin = points[ring[0] as usize];
    let at = |i: usize| points[ring[i % ring.len()] as usize] - origin;
    (1..ring.len() - 1).map(|i| at(i).cross(at(i + 1))).sum()
}

/// Whether triangles look the way their face does: none is turned over.
fn is_sound(points: &[DVec3], ring: &[u32], triangles: &[[u32; 3]]) -> bool {
    let normal = normal(points, ring);
    let tolerance = 1e-9 * normal.length_squared();
    triangles.len() == ring.len() - 2
        && triangles.iter().all(|triangle| {
            let [a, b, c] = triangle.map(|i| points[i as usize]);
            (b - a).cross(c - a).dot(normal) >= -tolerance
        })
}

/// The triangles of a concave face, from a constrained Delaunay triangulation in the plane that it is widest in.
fn delaunay(points: &[DVec3], ring: &[u32]) -> Option<Vec<[u32; 3]>> {
    let normal = normal(points, ring);
    let flat = |node: u32| {
        let p = points[node as usize] - points[ring[0] as usize];
        match normal.abs().to_array() {
            [x, y, z] if z >= x && z >= y => DVec2::new(p.x, p.y) * DVec2::new(normal.z.signum(), 1.0),
            [x, y, _] if y >= x => DVec2::new(p.z, p.x) * DVec2::new(normal.y.signum(), 1.0),
            _ => DVec2::new(p.y, p.z) * DVec2::new(normal.x.signum(), 1.0),
        }
    };
    let mut triangulation = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(ring.len());
    for &node in ring {
        let at = flat(node);
        handles.push(triangulation.insert(Point2::new(at.x, at.y)).ok()?);
    }
    if triangulation.num_vertices() != ring.len() {
        return None; // corners that coincide
    }
    for i in 0..ring.len() {
        let (from, to) = (handles[i], handles[(i + 1) % ring.len()]);
        if !triangulation.can_add_constraint(from, to) {
            return None; // it crosses itself
        }
        triangulation.add_constraint(from, to);
    }
    let mut node_of = vec![0; ring.len()];
    handles.iter().zip(ring).for_each(|(handle, &node)| node_of[handle.index()] = node);
    // From outside in: what is behind an edge of the polygon is inside, behind the next outside again.
    let mut is_inside: Vec<Option<bool>> = vec![None; triangulation.num_all_faces()];
    let hull = triangulation.convex_hull().flat_map(|edge| [edge, edge.rev()]);
    let mut todo: Vec<_> = hull.filter_map(|edge| Some((edge.face().as_inner()?, edge.is_constraint_edge()))).collect();
    while let Some((face, inside)) = todo.pop() {
        if is_inside[face.fix().index()].is_some() {
            continue;
        }
        is_inside[face.fix().index()] = Some(inside);
        let behind = face.adjacent_edges().into_iter();
        todo.extend(behind.filter_map(|edge| Some((edge.rev().face().as_inner()?, inside ^ edge.is_constraint_edge()))));
    }
    let inner = triangulation.inner_faces().filter(|face| is_inside[face.fix().index()] == Some(true));
    Some(inner.map(|face| face.vertices().map(|vertex| node_of[vertex.fix().index()])).collect())
}
