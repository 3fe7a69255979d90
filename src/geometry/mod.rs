//! Pure mathematics on points: boxes, tets, tet-box overlap; where data lie.
//!
//! Conventions held everywhere: a tet with corners 0..3 is *positive* when `(p1 - p0) x (p2 - p0) . (p3 - p0) > 0` (VTK's order),
//! and **face `i` is the face opposite corner `i`**.

mod aabb;
mod overlap;
mod placed;
mod section;
mod tet;

pub use aabb::Aabb;
pub use overlap::{TetPlanes, octants};
pub use placed::Placed;
pub use tet::{FACES, barycentric, closest_point, closest_point_beyond, closest_point_on_triangle, gradient, is_degenerate, signed_volume};
