//! Procedural meshes that carry known fields: a cube, a ball, and a wing in potential flow.

mod aerofoil;
mod lattice;
mod section;
mod wing;

use super::LayeredMesh;
pub use aerofoil::Aerofoil;
pub use lattice::Lattice;
pub use wing::Wing;

/// The bytes of `meshes/wing.vtu`, the mesh shown when none is given: [`plan`] of [`Shape::Wing`] at its default size.
pub const WING_VTU: &[u8] = include_bytes!("../../../meshes/wing.vtu");

/// What can be generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The unit cube with a linear field, [`Lattice::cube`].
    Cube,
    /// The unit ball with a radial field, [`Lattice::ball`].
    Ball,
    /// A wing in its exact potential flow, [`Wing`].
    Wing,
}

/// Why a mesh of this size cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GenerateError {
    /// Fewer tets than the shape needs.
    #[error("{tets} tets are too few, this shape takes at least {least}")]
    TooFew {
        /// Tets asked for.
        tets: u64,
        /// The smallest number there is.
        least: u64,
    },
    /// More than can be indexed with room to spare.
    #[error("{tets} tets are too many, at most {MAX_TETS} can be generated")]
    TooMany {
        /// Tets asked for.
        tets: u64,
    },
}

/// The largest mesh that can be generated, in tets.
pub const MAX_TETS: u64 = 1_000_000_000;

impl Shape {
    /// Every shape.
    pub const ALL: [Shape; 3] = [Shape::Cube, Shape::Ball, Shape::Wing];

    /// The name that files and commands use.
    pub fn name(self) -> &'static str {
        match self {
            Shape::Cube => "cube",
            Shape::Ball => "ball",
            Shape::Wing => "wing",
        }
    }

    /// About how many tets the mesh in `meshes/` has, which is made unless another number is asked for.
    pub fn default_tets(self) -> u64 {
        match self {
            Shape::Cube => Lattice::tets_of(16),
            Shape::Ball => Lattice::tets_of(20),
            Shape::Wing => 140_000,
        }
    }

    /// The smallest mesh of this shape, in tets.
    pub fn least_tets(self) -> u64 {
        match self {
            Shape::Cube => Lattice::tets_of(1),
            Shape::Ball => Lattice::tets_of(2),
            Shape::Wing => Wing::FEWEST,
        }
    }
}

/// Prepares a mesh of about `tets` tets (within 3 % for the wing, the nearest lattice for cube and ball), or of the shape's default size.
/// What it keeps in memory is one section or less; its layers are made when asked for.
pub fn plan(shape: Shape, tets: Option<u64>) -> Result<Box<dyn LayeredMesh>, GenerateError> {
    let tets = tets.unwrap_or(shape.default_tets());
    let least = shape.least_tets();
    if tets < least {
        return Err(GenerateError::TooFew { tets, least });
    }
    if tets > MAX_TETS {
        return Err(GenerateError::TooMany { tets });
    }
    let cells = (tets as f64 / 6.0).cbrt();
    Ok(match shape {
        Shape::Cube => Box::new(Lattice::cube(cells.round() as u32)),
        Shape::Ball => Box::new(Lattice::ball(2 * (cells / 2.0).round() as u32)),
        Shape::Wing => Box::new(Wing::new(tets)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::signed_volume;
    use crate::mesh::{TetMesh, Values, collect};
    use glam::DVec3;
    use std::collections::BTreeMap;

    fn mesh(shape: Shape, tets: u64) -> TetMesh {
        collect(&*plan(shape, Some(tets)).expect("a size that can be made")).expect("a valid mesh")
    }

    fn volume(mesh: &TetMesh) -> f64 {
        (0..mesh.tets().len()).map(|t| signed_volume(&mesh.corners(t))).sum()
    }

    /// How many faces have one tet; every other must have two.
    fn boundary_faces(mesh: &TetMesh) -> Vec<[u32; 3]> {
        let mut tets_of_face = BTreeMap::new();
        for tet in mesh.tets() {
            for face in crate::geometry::FACES {
                let mut corners = face.map(|i| tet[i]);
                corners.sort_unstable();
                *tets_of_face.entry(corners).or_insert(0) += 1;
            }
        }
        assert!(tets_of_face.values().all(|&count| count <= 2), "a face with more than two tets");
        tets_of_face.into_iter().filter(|&(_, count)| count == 1).map(|(face, _)| face).collect()
    }

    #[test]
    fn meshes_are_positive_conforming_and_closed() {
        for (shape, tets) in [(Shape::Cube, 700), (Shape::Ball, 6000), (Shape::Wing, 9000)] {
            let layered = plan(shape, Some(tets)).expect("a size that can be made");
            let mesh = mesh(shape, tets);
            assert_eq!((mesh.points().len() as u64, mesh.tets().len() as u64), (layered.point_count(), layered.tet_count()));
            assert_eq!((mesh.inverted_count(), mesh.zero_volume_count()), (0, 0), "{shape:?}");
            let faces = boundary_faces(&mesh);
            let mut edges = BTreeMap::new();
            for [a, b, c] in &faces {
                [(a, b), (b, c), (a, c)].into_iter().for_each(|edge| *edges.entry(edge).or_insert(0) += 1);
            }
            assert!(edges.values().all(|&count| count == 2), "the boundary of {shape:?} is closed");
            // V - E + F: 2 for the surface of a cube or a ball, 0 for a box with a hole through it.
            let vertices: std::collections::BTreeSet<_> = faces.iter().flatten().collect();
            let euler = vertices.len() as i64 - edges.len() as i64 + faces.len() as i64;
            assert_eq!(euler, if shape == Shape::Wing { 0 } else { 2 }, "{shape:?}");
        }
    }

    #[test]
    fn volumes_are_those_of_the_bodies() {
        assert!((volume(&mesh(Shape::Cube, 6 * 125)) - 1.0).abs() < 1e-13);
        // The error of the ball falls with the square of the cell size.
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        let errors = [8, 16].map(|cells| 1.0 - volume(&mesh(Shape::Ball, Lattice::tets_of(cells))) / ball);
        assert!(errors[0] > 0.0 && errors[0] < 0.05 && errors[1] < 0.27 * errors[0], "{errors:?}");
    }

    fn values<'a>(mesh: &'a TetMesh, name: &str) -> &'a Values {
        &mesh.point_data().iter().find(|a| a.name == name).expect("the array").values
    }

    #[test]
    fn lattices_carry_their_fields() {
        let (cube, ball) = (mesh(Shape::Cube, 6 * 512), mesh(Shape::Ball, 6000));
        for (mesh, name, field) in
            [(&cube, "linear", (|p: DVec3| (p.x + 2.0 * p.y + 4.0 * p.z) / 8.0) as fn(DVec3) -> f64), (&ball, "radius", DVec3::length)]
        {
            let array = values(mesh, name);
            let worst = |(i, &p): (usize, &DVec3)| (array.get(i) - field(p + mesh.center())).abs();
            let worst = mesh.points().iter().enumerate().map(worst).fold(0.0, f64::max);
            assert!(worst < 1e-7, "{name}: {worst}");
            assert_eq!(mesh.active_scalars(), Some(name));
        }
    }

    #[test]
    fn sizes_are_met_or_refused() {
        for tets in [5_000, 30_000, 200_000, 1_000_000] {
            let found = plan(Shape::Wing, Some(tets)).expect("a size that can be made").tet_count() as f64;
            assert!((found / tets as f64 - 1.0).abs() < 0.03, "{found} for {tets}");
        }
        let error = |tets| plan(Shape::Wing, Some(tets)).err();
        assert_eq!(error(100), Some(GenerateError::TooFew { tets: 100, least: Wing::FEWEST }));
        assert_eq!(error(MAX_TETS + 1), Some(GenerateError::TooMany { tets: MAX_TETS + 1 }));
    }
}
