//! Meshes for tests, of grid cells of six tets each.

use glam::DVec3;
use octetra::mesh::{Association, MeshParts, ScalarField, TetMesh};

/// Adds to `parts` those cells of an `n` x `n` x `n` grid over the box from `min`, of edge `size`, that `keep` names.
pub fn add_grid(parts: &mut MeshParts, n: u32, min: DVec3, size: f64, mut keep: impl FnMut([u32; 3]) -> bool) {
    let first = parts.points.len() as u32;
    let row = n + 1;
    let point = |i: u32| min + DVec3::new((i % row).into(), (i / row % row).into(), (i / row / row).into()) * (size / f64::from(n));
    parts.points.extend((0..row.pow(3)).map(point));
    for cell in 0..n.pow(3) {
        let [x, y, z] = [cell % n, cell / n % n, cell / (n * n)];
        let corner = |i: u32| first + x + (i & 1) + row * (y + (i >> 1 & 1) + row * (z + (i >> 2)));
        if keep([x, y, z]) {
            parts.tets.extend([[1, 3], [1, 5], [2, 3], [2, 6], [4, 5], [4, 6]].map(|[a, b]| [0, a, b, 7].map(corner)));
        }
    }
}

/// Uniform numbers in [0, 1) from a seed.
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Moves every point by up to `amount` along each axis.
    pub fn jitter(&mut self, parts: &mut MeshParts, amount: f64) {
        for p in &mut parts.points {
            *p += DVec3::new(self.uniform() - 0.5, self.uniform() - 0.5, self.uniform() - 0.5) * (2.0 * amount);
        }
    }
}

#[allow(dead_code)] // not every test that has this module draws it
/// A grid of `n`^3 cells over the unit cube, each there with a chance of 60 %, points moved at random.
pub fn sponge(n: u32) -> TetMesh {
    let mut random = Random(7);
    let mut parts = MeshParts::default();
    add_grid(&mut parts, n, DVec3::ZERO, 1.0, |_| random.uniform() < 0.6);
    random.jitter(&mut parts, 0.2 / f64::from(n));
    mesh(parts)
}

pub fn mesh(parts: MeshParts) -> TetMesh {
    TetMesh::new(parts).expect("a valid mesh")
}

/// A field on the points: `f` of the world position.
pub fn point_field(mesh: &TetMesh, f: impl Fn(DVec3) -> f64) -> ScalarField {
    let values = mesh.points().iter().map(|&p| f(p + mesh.center())).collect();
    ScalarField::new("s".into(), Association::Points, values)
}
