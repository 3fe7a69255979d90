//! Which tet lies behind which face.

use crate::geometry::FACES;
use rayon::prelude::*;

/// The neighbour of a face that has none.
pub const NONE: u32 = u32::MAX;

/// The corners of a tet, positively oriented, and the tets behind its faces; face `i` is opposite corner `i`.
#[derive(Debug, Clone, Copy)]
pub struct Tet {
    /// Indices of the corners.
    pub corners: [u32; 4],
    /// The tet behind each face, or [`NONE`].
    pub neighbours: [u32; 4],
}

/// A face of the boundary, as (tet, face of that tet).
pub type BoundaryFace = (u32, u8);

/// Links the tets for which `takes_part` holds through the faces they share, and lists the faces through which nothing is linked.
///
/// Two tets are linked when they alone have a face and see it in opposite senses, that is, lie on its two sides. Every other face
/// (of one tet, of three or more, of two that overlap) is a boundary face of each of its tets, so that a ray that meets any tet at all
/// also meets the boundary faces at both ends of the chain of linked tets it belongs to.
pub fn link(corners: &[[u32; 4]], takes_part: impl Fn(usize) -> bool + Sync) -> (Vec<Tet>, Vec<BoundaryFace>) {
    let mut tets: Vec<Tet> = corners.par_iter().map(|&corners| Tet { corners, neighbours: [NONE; 4] }).collect();
    // Each face as its three points, ascending, and its tet: sorting brings the tets of a face together.
    let mut faces: Vec<[u32; 4]> = (0..corners.len())
        .into_par_iter()
        .filter(|&tet| takes_part(tet))
        .flat_map_iter(|tet| (0..4).map(move |face| face_key(&corners[tet], face, tet as u32)))
        .collect();
    // As two wide numbers, which compare faster than four.
    faces.par_sort_unstable_by_key(|&[a, b, c, tet]| (wide(a, b), wide(c, tet)));

    let mut boundary = Vec::new();
    for run in faces.chunk_by(|a, b| a[..3] == b[..3]) {
        let sides = |entry: &[u32; 4]| (entry[3], face_of(&tets[entry[3] as usize].corners, entry));
        match *run {
            [first, second] if is_odd(&tets, &first) != is_odd(&tets, &second) => {
                let ((tet, face), (other, other_face)) = (sides(&first), sides(&second));
                tets[tet as usize].neighbours[face as usize] = other;
                tets[other as usize].neighbours[other_face as usize] = tet;
            }
            _ => boundary.extend(run.iter().map(sides)),
        }
    }
    (tets, boundary)
}

fn wide(high: u32, low: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

fn face_key(corners: &[u32; 4], face: usize, tet: u32) -> [u32; 4] {
    let mut points = FACES[face].map(|corner| corners[corner]);
    points.sort_unstable();
    [points[0], points[1], points[2], tet]
}

/// The face of a tet that has the points of a key: the one opposite the corner that the key lacks.
fn face_of(corners: &[u32; 4], key: &[u32; 4]) -> u8 {
    corners.iter().position(|corner| !key[..3].contains(corner)).map_or(0, |face| face as u8)
}

/// Whether the outward order of a tet's face is an odd permutation of the ascending one: the two sides of a face differ in this.
fn is_odd(tets: &[Tet], key: &[u32; 4]) -> bool {
    let corners = &tets[key[3] as usize].corners;
    let [a, b, c] = FACES[face_of(corners, key) as usize].map(|corner| corners[corner]);
    (a > b) ^ (b > c) ^ (a > c)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Two tets on the two sides of the face 1 2 3, both positive for suitable points.
    const PAIR: [[u32; 4]; 2] = [[0, 1, 2, 3], [4, 1, 3, 2]];

    #[test]
    fn tets_on_two_sides_of_a_face_are_linked() {
        let (tets, boundary) = link(&PAIR, |_| true);
        assert_eq!((tets[0].neighbours, tets[1].neighbours), ([1, NONE, NONE, NONE], [0, NONE, NONE, NONE]));
        let mut boundary: Vec<_> = boundary;
        boundary.sort_unstable();
        assert_eq!(boundary, [(0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3)]);
    }

    #[test]
    fn tets_on_one_side_of_a_face_and_third_tets_are_not_linked() {
        let (tets, boundary) = link(&[PAIR[0], [4, 1, 2, 3]], |_| true);
        assert!(tets.iter().all(|tet| tet.neighbours == [NONE; 4]));
        assert_eq!(boundary.len(), 8);
        let (tets, boundary) = link(&[PAIR[0], PAIR[1], [5, 1, 3, 2]], |_| true);
        assert!(tets.iter().all(|tet| tet.neighbours == [NONE; 4]));
        assert_eq!(boundary.len(), 12);
    }

    #[test]
    fn tets_that_take_no_part_have_no_faces() {
        let (tets, boundary) = link(&PAIR, |tet| tet == 0);
        assert_eq!(tets[0].neighbours, [NONE; 4]);
        assert_eq!(boundary.len(), 4);
    }
}
