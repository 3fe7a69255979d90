//! Which bricks there are: [`Pyramid`] and [`BrickKey`].

use super::SlicePlane;
use glam::DVec3;
use std::ops::Range;

/// Voxels along each edge of a brick.
pub const BRICK_EDGE: u32 = 64;

/// Names one brick of a pyramid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BrickKey {
    /// 0 is the finest.
    pub level: u8,
    /// Place among the bricks of its level, along x, y, z.
    pub at: [u32; 3],
}

impl BrickKey {
    /// The brick of a coarser level that covers this one.
    pub fn ancestor(self, level: u8) -> BrickKey {
        let up = level.saturating_sub(self.level).min(31);
        BrickKey { level: self.level.max(level), at: self.at.map(|at| at >> up) }
    }

    /// Voxels of level 0 along the edge of one of its voxels.
    pub fn voxel_size(self) -> f64 {
        f64::from(self.level).exp2()
    }

    /// The middle of its first voxel, index space.
    pub fn first(self) -> DVec3 {
        let at = DVec3::from(self.at.map(|at| f64::from(at) * f64::from(BRICK_EDGE)));
        (at + 0.5) * self.voxel_size() - 0.5
    }

    /// Its middle, index space, as if it were whole.
    pub fn center(self) -> DVec3 {
        self.first() + (f64::from(BRICK_EDGE) - 1.0) / 2.0 * self.voxel_size()
    }
}

/// The levels of a volume and their bricks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pyramid {
    dims: [u32; 3],
    levels: u8,
}

impl Pyramid {
    /// The pyramid over a volume of `dims` voxels along x, y, z, each at least 1. The coarsest level is one brick.
    pub fn new(dims: [u32; 3]) -> Self {
        let dims = dims.map(|n| n.max(1));
        let longest = dims.iter().copied().max().unwrap_or(1);
        let levels = (0..32).find(|&level| longest.div_ceil(1 << level) <= BRICK_EDGE).unwrap_or(26) as u8 + 1;
        Pyramid { dims, levels }
    }

    /// How many levels there are, at least 1.
    pub fn levels(&self) -> u8 {
        self.levels
    }

    /// Voxels along each axis of a level.
    pub fn dims(&self, level: u8) -> [u32; 3] {
        self.dims.map(|n| n.div_ceil(1 << level.min(31)))
    }

    /// Bricks along each axis of a level.
    pub fn bricks(&self, level: u8) -> [u32; 3] {
        self.dims(level).map(|n| n.div_ceil(BRICK_EDGE))
    }

    /// Bricks of a level.
    pub fn brick_count(&self, level: u8) -> u64 {
        self.bricks(level).iter().map(|&n| u64::from(n)).product()
    }

    /// The bricks of a level, x fastest.
    pub fn keys(&self, level: u8) -> impl Iterator<Item = BrickKey> + use<> {
        let [nx, ny, nz] = self.bricks(level);
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| BrickKey { level, at: [x, y, z] })))
    }

    /// The bricks of the next finer level beneath a brick; none beneath those of level 0.
    pub fn children(&self, key: BrickKey) -> impl Iterator<Item = BrickKey> + use<'_> {
        (0..if key.level == 0 { 0 } else { 8 })
            .map(move |i| BrickKey { level: key.level - 1, at: std::array::from_fn(|axis| key.at[axis] * 2 + (i >> axis & 1)) })
            .filter(|&child| self.has(child))
    }

    /// Whether there is such a brick.
    pub fn has(&self, key: BrickKey) -> bool {
        key.level < self.levels && (0..3).all(|axis| key.at[axis] < self.bricks(key.level)[axis])
    }

    /// The one brick of the coarsest level.
    pub fn top(&self) -> BrickKey {
        BrickKey { level: self.levels - 1, at: [0; 3] }
    }

    /// The voxels of its level that a brick holds, along each axis: fewer than [`BRICK_EDGE`] at the end of the volume.
    pub fn voxels(&self, key: BrickKey) -> [Range<u32>; 3] {
        let dims = self.dims(key.level);
        std::array::from_fn(|axis| {
            let first = key.at[axis] * BRICK_EDGE;
            first..first.saturating_add(BRICK_EDGE).min(dims[axis])
        })
    }

    /// The voxels of level 0 that a brick's are means of, along each axis.
    pub fn beneath(&self, key: BrickKey) -> [Range<u32>; 3] {
        let voxels = self.voxels(key);
        std::array::from_fn(|axis| {
            let end = |voxel: u32| (u64::from(voxel) << key.level).min(u64::from(self.dims[axis])) as u32;
            end(voxels[axis].start)..end(voxels[axis].end)
        })
    }

    /// The bricks of a level that a slice needs: those with a voxel that interpolation on the plane takes in. Sorted.
    pub fn cut(&self, plane: &SlicePlane, level: u8) -> Vec<BrickKey> {
        let [nx, ny, nz] = self.bricks(level);
        let size = f64::from(level).exp2();
        let normal = plane.normal;
        let reach = (f64::from(BRICK_EDGE) + 1.0) / 2.0 * size;
        // The slab of brick rows along the normal's longest axis that each column of bricks can meet is found, not searched.
        let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
        let counts = [nx, ny, nz];
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let half = reach * (normal.x.abs() + normal.y.abs() + normal.z.abs());
        let pitch = f64::from(BRICK_EDGE) * size;
        let mut found = Vec::new();
        for j in 0..counts[v] {
            for i in 0..counts[u] {
                let mut at = [0; 3];
                (at[u], at[v]) = (i, j);
                let offset = plane.distance(BrickKey { level, at }.center());
                // |offset + k pitch normal[axis]| < half
                let (a, b) = ((-half - offset) / (pitch * normal[axis]), (half - offset) / (pitch * normal[axis]));
                let (low, high) = (a.min(b).floor().max(0.0), a.max(b).ceil().min(f64::from(counts[axis]) - 1.0));
                if low > high || low.is_nan() || high.is_nan() {
                    continue;
                }
                for k in low as u32..=high as u32 {
                    at[axis] = k;
                    let key = BrickKey { level, at };
                    if plane.distance(key.center()).abs() < half {
                        found.push(key);
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_until_one_brick_is_left() {
        let pyramid = Pyramid::new([1000, 65, 64]);
        assert_eq!(pyramid.levels(), 5);
        assert_eq!((pyramid.dims(0), pyramid.dims(1), pyramid.dims(4)), ([1000, 65, 64], [500, 33, 32], [63, 5, 4]));
        assert_eq!((pyramid.bricks(0), pyramid.bricks(4)), ([16, 2, 1], [1, 1, 1]));
        assert_eq!(pyramid.voxels(BrickKey { level: 0, at: [15, 1, 0] }), [960..1000, 64..65, 0..64]);
        assert_eq!(pyramid.beneath(BrickKey { level: 1, at: [7, 0, 0] }), [896..1000, 0..65, 0..64]);
        assert_eq!(Pyramid::new([64; 3]).levels(), 1);
        assert_eq!(Pyramid::new([u32::MAX, 1, 1]).levels(), 27);
    }

    #[test]
    fn coarse_voxels_have_their_middles_where_their_parts_have_theirs() {
        let fine = BrickKey { level: 0, at: [2, 0, 1] };
        assert_eq!((fine.first(), fine.center()), (DVec3::new(128.0, 0.0, 64.0), DVec3::new(159.5, 31.5, 95.5)));
        let coarse = fine.ancestor(1);
        assert_eq!(coarse, BrickKey { level: 1, at: [1, 0, 0] });
        assert_eq!((coarse.first(), coarse.center()), (DVec3::new(128.5, 0.5, 0.5), DVec3::new(191.5, 63.5, 63.5)));
        assert_eq!(coarse.ancestor(0), coarse);
    }

    /// Every brick tried against the definition: a voxel whose trilinear hat, open, meets the plane.
    #[test]
    fn a_cut_is_what_a_search_through_all_bricks_finds() {
        let pyramid = Pyramid::new([300, 200, 130]);
        let normals = [DVec3::X, -DVec3::Y, DVec3::Z, DVec3::new(0.3, -0.7, 0.2), DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.0, 1.0, 1e-9)];
        for level in 0..pyramid.levels() {
            for normal in normals {
                for k in [-5.0, 0.0, 63.0, 63.5, 64.0, 100.25, 150.0] {
                    let plane = SlicePlane::new(DVec3::splat(k), normal).expect("a plane");
                    let [nx, ny, nz] = pyramid.bricks(level);
                    let mut all = Vec::new();
                    for at in (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| [x, y, z]))) {
                        let key = BrickKey { level, at };
                        let corner = |i: usize| {
                            let end = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
                            key.first() + (end * 65.0 - 1.0) * key.voxel_size()
                        };
                        let distances: Vec<f64> = (0..8).map(|i| plane.distance(corner(i))).collect();
                        if distances.iter().any(|&d| d > 0.0) && distances.iter().any(|&d| d < 0.0) {
                            all.push(key);
                        }
                    }
                    all.sort_unstable();
                    let found = pyramid.cut(&plane, level);
                    let differ = all.iter().filter(|key| !found.contains(key)).chain(found.iter().filter(|key| !all.contains(key)));
                    // Rounding may decide about a corner that lies in the plane.
                    for key in differ {
                        let half = 32.5 * key.voxel_size() * plane.normal.abs().dot(DVec3::ONE);
                        assert!((plane.distance(key.center()).abs() - half).abs() < 1e-9, "{key:?} {plane:?}");
                    }
                }
            }
        }
        // A slice on voxel 63 needs no voxel 64.
        let on = |k: f64| pyramid.cut(&SlicePlane::new(DVec3::splat(k), DVec3::X).expect("a plane"), 0).len();
        assert_eq!((on(63.0), on(63.5), on(64.0)), (12, 24, 12));
    }
}
