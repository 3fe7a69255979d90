//! Meshes, fields and rays for the tests of this folder.

use crate::mesh::{Association, MeshParts, ScalarField, TetMesh};
use glam::DVec3;

/// The corners of the six Kuhn tets of a unit cube: paths from (0,0,0) to (1,1,1) along the axes, in every order.
const KUHN: [[[u32; 3]; 4]; 6] = {
    const O: [u32; 3] = [0, 0, 0];
    const I: [u32; 3] = [1, 1, 1];
    [
        [O, [1, 0, 0], [1, 1, 0], I],
        [O, [1, 0, 0], [1, 0, 1], I],
        [O, [0, 1, 0], [1, 1, 0], I],
        [O, [0, 1, 0], [0, 1, 1], I],
        [O, [0, 0, 1], [1, 0, 1], I],
        [O, [0, 0, 1], [0, 1, 1], I],
    ]
};

/// Adds to `parts` those cells of an `n` x `n` x `n` grid over the box from `min`, of edge `size`, that `keep` names, six tets each.
/// All grid points are added, used or not.
pub fn add_grid(parts: &mut MeshParts, n: u32, min: DVec3, size: f64, keep: impl Fn([u32; 3]) -> bool) {
    let first = parts.points.len() as u32;
    let index = |[x, y, z]: [u32; 3]| first + x + (n + 1) * (y + (n + 1) * z);
    for z in 0..=n {
        for y in 0..=n {
            for x in 0..=n {
                parts.points.push(min + DVec3::new(x.into(), y.into(), z.into()) * (size / f64::from(n)));
            }
        }
    }
    for cell in 0..n.pow(3) {
        let [x, y, z] = [cell % n, cell / n % n, cell / (n * n)];
        if keep([x, y, z]) {
            parts.tets.extend(KUHN.map(|path| path.map(|[i, j, k]| index([x + i, y + j, z + k]))));
        }
    }
}

/// The parts of the unit cube as an `n` x `n` x `n` grid.
pub fn cube(n: u32) -> MeshParts {
    let mut parts = MeshParts::default();
    add_grid(&mut parts, n, DVec3::ZERO, 1.0, |_| true);
    parts
}

/// Moves every point strictly inside the unit cube by up to `amount` along each axis.
pub fn jitter(parts: &mut MeshParts, amount: f64, random: &mut Random) {
    for p in &mut parts.points {
        let inside = p.min_element() > 0.0 && p.max_element() < 1.0;
        let step = DVec3::from_array(std::array::from_fn(|_| (random.uniform() * 2.0 - 1.0) * amount));
        *p += if inside { step } else { DVec3::ZERO };
    }
}

pub fn mesh(parts: MeshParts) -> TetMesh {
    TetMesh::new(parts).expect("a valid mesh")
}

/// A field on the points: `f` of the world position.
pub fn point_field(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
    let values = mesh.points().iter().map(|&p| f(p + mesh.center())).collect();
    ScalarField::new("s".into(), Association::Points, values)
}

/// Uniform numbers from a fixed seed (PCG's multiplier, high bits).
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> DVec3 {
        let (z, angle) = (self.uniform() * 2.0 - 1.0, self.uniform() * std::f64::consts::TAU);
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }

    /// A line with isotropic direction and uniform offset among those that meet the ball of this radius about the origin; the point
    /// lies outside the ball.
    pub fn line(&mut self, radius: f64) -> (DVec3, DVec3) {
        let direction = self.direction();
        let (a, b) = direction.any_orthonormal_pair();
        let (r, angle) = (radius * self.uniform().sqrt(), self.uniform() * std::f64::consts::TAU);
        (a * (r * angle.cos()) + b * (r * angle.sin()) - direction * (2.0 * radius), direction)
    }
}
