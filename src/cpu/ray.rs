//! A ray through the root cube and the cells it crosses, in integer coordinates: the twin of `shaders/shared/ray.wgsl`.
//!
//! Cells are addressed on the grid of the deepest level, `cells` along each axis; a cell of `size` begins at a multiple of it. From a
//! cell the ray goes to the neighbour beyond the face where it leaves, by integer arithmetic: whatever rounding does to positions, no
//! cell is missed or visited twice, and each step leaves another face behind, so the walk ends.

use crate::view::{CubePlanes, CubeRay, high_bits, mul_add};
use glam::{UVec3, Vec3};

/// Direction components smaller than this are taken as 0: over the cube they move a ray by less than f32 can tell.
pub const PARALLEL: f32 = 1e-12;
/// Stands for infinity, which WGSL has not.
pub const FAR: f32 = 1e30;

/// A ray inside the root cube [0, 1)^3, from t = 0 where it enters the cube, or at the eye, to `t_out`.
pub(super) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    /// Cube edges per unit of t.
    pub length: f32,
    /// 1 / direction; [`FAR`] where that is 0.
    pub inverse: Vec3,
    /// Where it leaves the cube; 0 if it misses.
    pub t_out: f32,
    /// Where the eye is, at most 0.
    pub t_eye: f32,
}

/// The cell that a ray is in: lowest corner and edge on the grid of the deepest level.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub low: UVec3,
    pub size: u32,
}

/// 1 / x after a step of Newton's method, which makes of a GPU's approximate quotient the nearest f32.
fn reciprocal(x: Vec3) -> Vec3 {
    let r = 1.0 / x;
    let error = |x: f32, r: f32| mul_add(Vec3::splat(-x), r, Vec3::ONE).x;
    r + r * Vec3::new(error(x.x, r.x), error(x.y, r.y), error(x.z, r.z))
}

impl Ray {
    /// Cuts a ray to the root cube and to the planes that clip.
    pub fn enter(ray: CubeRay, clips: &CubePlanes) -> Ray {
        let parallel = ray.direction.abs().cmplt(Vec3::splat(PARALLEL));
        let direction = Vec3::select(parallel, Vec3::ZERO, ray.direction);
        let inverse = reciprocal(Vec3::select(parallel, Vec3::splat(1.0 / FAR), direction));

        let (to_low, to_high) = (-ray.origin * inverse, (1.0 - ray.origin) * inverse);
        let mut near = Vec3::select(parallel, Vec3::splat(-FAR), to_low.min(to_high)).max_element().max(ray.t_eye);
        let mut far = Vec3::select(parallel, Vec3::splat(FAR), to_low.max(to_high)).min_element();
        for plane in clips.used() {
            let along = plane.truncate().dot(direction);
            let before = plane.w - plane.truncate().dot(ray.origin);
            if along > 0.0 {
                near = near.max(before / along);
            } else if along < 0.0 {
                far = far.min(before / along);
            } else if before > 0.0 {
                far = -FAR;
            }
        }
        let beside = parallel & (ray.origin.cmplt(Vec3::ZERO) | ray.origin.cmpge(Vec3::ONE));
        let misses = beside.any() || near >= far;

        // From here on t counts from the entry: it keeps its precision however far the eye is.
        let origin = mul_add(direction, near, ray.origin);
        let side = Vec3::select(direction.cmpge(Vec3::ZERO), Vec3::ONE, Vec3::ZERO);
        let t_out = ((side - origin) * inverse).min_element();
        let t_out = if misses { 0.0 } else { t_out.max(0.0) };
        let t_out = if clips.count > 0 { t_out.min((far - near).max(0.0)) } else { t_out };
        Ray { origin, direction, length: ray.length, inverse, t_out, t_eye: ray.t_eye - near }
    }

    /// The unit vector towards the eye.
    pub fn to_eye(&self) -> Vec3 {
        -self.direction / self.length
    }

    /// 1 / |direction| within 2^-11, the same on every processor: the largest number of 12 bits that is at most the one asked for, of the
    /// direction's highest 12 bits. All products are exact; an approximate square root would place all samples of a ray differently.
    pub fn inverse_length(&self) -> f32 {
        const LAST_BIT: u32 = 0x1000;
        let d = high_bits(self.direction);
        let squared = d.x * d.x + d.y * d.y + d.z * d.z;
        let low = (1.0 / squared.sqrt()).to_bits() & !(LAST_BIT - 1);
        let fits = |bits: u32| {
            let k = f32::from_bits(bits);
            mul_add(Vec3::splat(k * k), squared, Vec3::NEG_ONE).x <= 0.0
        };
        f32::from_bits(if fits(low + LAST_BIT) {
            low + LAST_BIT
        } else if fits(low) {
            low
        } else {
            low - LAST_BIT
        })
    }

    /// Coordinates of the finest cell at `t`, clamped to a cell.
    pub fn cell_at(&self, t: f32, within: Cell, cells: u32) -> UVec3 {
        let position = mul_add(self.direction, t, self.origin) * cells as f32;
        position.max(Vec3::ZERO).as_uvec3().clamp(within.low, within.low + (within.size - 1))
    }

    /// Where in a cell the ray is at `t`, in cells from its lowest corner.
    pub fn within(&self, t: f32, cell: Cell, cells: u32) -> Vec3 {
        let position = (self.origin + self.direction * t) * cells as f32;
        ((position - cell.low.as_vec3()) / cell.size as f32).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// t of the planes through which the ray enters a cell, the last of them.
    pub fn entry(&self, cell: Cell, cells: u32) -> f32 {
        let low = Vec3::select(self.direction.cmpge(Vec3::ZERO), cell.low.as_vec3(), (cell.low + cell.size).as_vec3());
        let t = (low / cells as f32 - self.origin) * self.inverse;
        Vec3::select(self.direction.cmpeq(Vec3::ZERO), Vec3::splat(-FAR), t).max_element()
    }

    /// t of the planes through which the ray leaves a cell, per axis.
    pub fn exits(&self, cell: Cell, cells: u32) -> Vec3 {
        let high = Vec3::select(self.direction.cmpge(Vec3::ZERO), (cell.low + cell.size).as_vec3(), cell.low.as_vec3());
        (high / cells as f32 - self.origin) * self.inverse
    }

    /// Coordinates of the finest cell beyond the face through which the ray leaves `cell`; at `cells` or wrapped below 0 once outside.
    /// `exits` are the cell's, `t` the smallest of them.
    pub fn step(&self, cell: Cell, exits: Vec3, t: f32, cells: u32) -> UVec3 {
        let mut next = self.cell_at(t, cell, cells);
        let axis = if exits.x <= t {
            0
        } else if exits.y <= t {
            1
        } else {
            2
        };
        next[axis] = if self.direction[axis] >= 0.0 { cell.low[axis] + cell.size } else { cell.low[axis].wrapping_sub(1) };
        next
    }
}

impl Cell {
    /// The root cube of a grid of `cells` per axis.
    pub fn root(cells: u32) -> Self {
        Cell { low: UVec3::ZERO, size: cells }
    }
}
