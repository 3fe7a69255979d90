//! Slices through bricks on the device, `shaders/slices.wgsl`: the pool of bricks, and what draws slices from it.

mod picture;
mod pool;

pub use picture::{SlicePainter, SlicePicture};
pub use pool::{ABSENT, SlicePool};

use crate::bricks::SlicePlane;
use crate::view::TransferFunction;
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4};

/// Colours over the range.
const COLORS: usize = 4096;

/// Colours that levels are tinted with, the finest first.
pub const TINTS: [[f32; 3]; 6] =
    [[0.1, 0.75, 0.3], [0.95, 0.85, 0.1], [0.95, 0.5, 0.1], [0.9, 0.15, 0.15], [0.65, 0.2, 0.85], [0.2, 0.4, 0.95]];

/// A level of the pyramid: `SliceLevel` in `shaders/slices.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SliceLevel {
    /// Colour that the level is tinted with.
    pub tint: [f32; 3],
    /// Where its part of the table of bricks begins.
    pub first: u32,
}

/// What all slices share: `SliceLook` in `shaders/slices.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SliceLook {
    /// Voxels of level 0 along x, y, z.
    pub dims: [u32; 3],
    /// Levels of the pyramid.
    pub level_count: u32,
    /// The value at the beginning of the colours.
    pub low: f32,
    /// 1 over their width.
    pub inverse_width: f32,
    /// 0: the nearest voxel; 1: trilinear.
    pub is_smooth: u32,
    /// Bits of a voxel: 8, 16, or 32 for floats.
    pub bits: u32,
    /// Added to numbers that are kept as unsigned integers.
    pub bias: f32,
    /// Share of the tint, in [0, 1].
    pub tint: f32,
    /// Fills to a multiple of 16 bytes.
    pub _pad: [f32; 2],
}

/// A slice of a picture: `SliceQuad` in `shaders/slices.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SliceQuad {
    /// From the plane's own (u, v, 0, 1) to clip space, column by column.
    pub clip_from_plane: [[f32; 4]; 4],
    /// Index position of (u, v) = 0.
    pub origin: [f32; 3],
    /// Added to the level that a pixel asks for before it is rounded down.
    pub detail: f32,
    /// Index step of u.
    pub along_u: [f32; 3],
    /// Pixels of the line where the slice ends.
    pub border_width: f32,
    /// Index step of v.
    pub along_v: [f32; 3],
    /// In [0, 1].
    pub opacity: f32,
    /// Colour of that line, not multiplied by opacity.
    pub border: [f32; 4],
}

/// How values become colours.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceStyle {
    /// Colours; its opacity counts for nothing. Without `nan` missing values are transparent.
    pub transfer_function: TransferFunction,
    /// What the colours span where the transfer function names no range, data units.
    pub value_range: [f64; 2],
    /// Trilinear between voxels; otherwise the nearest voxel.
    pub is_smooth: bool,
    /// Share of the tint by level, in [0, 1].
    pub tint: f32,
}

/// A slice to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnSlice {
    /// Where it lies, index space.
    pub plane: SlicePlane,
    /// From index space to clip space; z / w falls from 1 to 0 with the distance.
    pub clip_from_index: DMat4,
    /// Whether the finest resident level is drawn whatever the picture can show.
    pub is_whole: bool,
    /// Width and colour of the line where the slice ends; not multiplied by opacity.
    pub border: Option<(f32, [f32; 4])>,
    /// In [0, 1].
    pub opacity: f32,
}

impl SliceStyle {
    /// What the shader looks colours up in: below, above, missing, then evenly over the range; the range.
    fn table(&self) -> (Vec<[u8; 4]>, [f64; 2]) {
        let tf = &self.transfer_function;
        let [lo, hi] = tf.range.unwrap_or(self.value_range);
        let drawn = tf.in_data(self.value_range);
        let at = |x: f64| opaque(color_at(&drawn.color, x));
        let inside: Vec<[u8; 4]> = (0..=COLORS).map(|i| at(i as f64 / COLORS as f64)).collect();
        let (below, above) = (tf.below.map_or(inside[0], opaque), tf.above.map_or(inside[COLORS], opaque));
        let missing = tf.nan.map_or([0; 4], opaque);
        ([below, above, missing].into_iter().chain(inside).collect(), [lo, hi])
    }
}

fn opaque(color: [f64; 3]) -> [u8; 4] {
    let [r, g, b] = color.map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8);
    [r, g, b, 255]
}

/// The colour at a place of ascending knots; between two at one place the later one counts.
fn color_at(knots: &[[f64; 4]], x: f64) -> [f64; 3] {
    let after = knots.partition_point(|knot| knot[0] <= x);
    let (Some(last), Some(first)) = (knots.last(), knots.first()) else { return [0.0; 3] };
    let [_, r, g, b] = match after {
        0 => *first,
        n if n == knots.len() => *last,
        n => {
            let (a, b) = (knots[n - 1], knots[n]);
            let part = (x - a[0]) / (b[0] - a[0]);
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part)
        }
    };
    [r, g, b]
}

/// A plane with directions of its own: where (u, v) = 0 lies and the steps of u and v, index space. For planes across an axis they are the
/// other two axes, and the position along the axis is kept to the bit.
pub fn plane_axes(plane: &SlicePlane, dims: [u32; 3]) -> [DVec3; 3] {
    let middle = DVec3::from(dims.map(|n| (f64::from(n) / 2.0).floor()));
    let normal = plane.normal;
    let axis = (0..3).find(|&axis| normal[axis].abs() == 1.0);
    if let Some(axis) = axis {
        let mut origin = middle;
        origin[axis] = plane.point[axis];
        return [origin, DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
    }
    let u = normal.any_orthonormal_vector();
    [middle - normal * plane.distance(middle), u, normal.cross(u)]
}

/// The corners of what a plane cuts out of the volume's box, which reaches half a voxel beyond the outermost voxels' middles, in (u, v) of
/// [`plane_axes`] and in order; none where it cuts nothing.
pub fn outline(plane: &SlicePlane, dims: [u32; 3]) -> Vec<[f64; 2]> {
    let [origin, u, v] = plane_axes(plane, dims);
    let high = DVec3::from(dims.map(|n| f64::from(n) - 0.5));
    let corner = |i: usize| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, DVec3::splat(-0.5));
    let mut found: Vec<[f64; 2]> = Vec::new();
    for i in 0..8usize {
        for axis in (0..3).filter(|axis| i >> axis & 1 == 0) {
            let (a, b) = (corner(i), corner(i | 1 << axis));
            let (da, db) = (plane.distance(a), plane.distance(b));
            if (da < 0.0) == (db < 0.0) {
                continue;
            }
            let at = a + (b - a) * (da / (da - db)) - origin;
            found.push([at.dot(u), at.dot(v)]);
        }
    }
    let count = found.len().max(1) as f64;
    let middle: [f64; 2] = std::array::from_fn(|i| found.iter().map(|at| at[i]).sum::<f64>() / count);
    let angle = |at: &[f64; 2]| (at[1] - middle[1]).atan2(at[0] - middle[0]);
    found.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    if found.len() < 3 { Vec::new() } else { found }
}

/// The projection of a picture that looks straight at a slice, from index space to clip space: `center` is in its middle, and a step `p` from
/// there goes `p . right` and `p . up` halves of the picture to the right and up.
pub fn flat_projection(center: DVec3, right: DVec3, up: DVec3) -> DMat4 {
    let row = |v: DVec3| v.extend(-v.dot(center));
    DMat4::from_cols(row(right), row(up), DVec4::W * 0.5, DVec4::W).transpose()
}

impl DrawnSlice {
    /// As the shader reads it.
    fn quad(&self, dims: [u32; 3]) -> SliceQuad {
        let [origin, u, v] = plane_axes(&self.plane, dims);
        let plane = DMat4::from_cols(u.extend(0.0), v.extend(0.0), DVec4::ZERO, origin.extend(1.0));
        let (border_width, border) = self.border.unwrap_or((0.0, [0.0; 4]));
        SliceQuad {
            clip_from_plane: (self.clip_from_index * plane).as_mat4().to_cols_array_2d(),
            origin: origin.as_vec3().to_array(),
            detail: if self.is_whole { -1000.0 } else { 0.5 },
            along_u: u.as_vec3().to_array(),
            border_width,
            along_v: v.as_vec3().to_array(),
            opacity: self.opacity,
            border,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_are_what_planes_cut_out_of_the_box() {
        let dims = [10, 20, 30];
        let area = |points: &[[f64; 2]]| {
            let next = points.iter().cycle().skip(1);
            points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs() / 2.0
        };
        for (axis, expected) in [600.0, 300.0, 200.0].into_iter().enumerate() {
            let points = outline(&SlicePlane::across(axis, 3.0), dims);
            assert_eq!((points.len(), area(&points)), (4, expected), "axis {axis}");
        }
        let diagonal = SlicePlane::new(DVec3::new(4.5, 9.5, 14.5), DVec3::new(2.0, 1.0, 0.0)).expect("a plane");
        assert!((area(&outline(&diagonal, dims)) - 30.0 * 500f64.sqrt()).abs() < 1e-9);
        let through = SlicePlane::new(DVec3::splat(4.5), DVec3::ONE).expect("a plane");
        assert_eq!(outline(&through, [10; 3]).len(), 6, "a hexagon");
        assert_eq!(outline(&SlicePlane::across(0, 9.6), dims), Vec::<[f64; 2]>::new(), "beside the volume");
    }

    #[test]
    fn colours_are_those_of_the_knots() {
        let mut tf = TransferFunction::of_color(vec![[0.0, 0.0, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]);
        tf.range = Some([-1.0, 3.0]);
        tf.below = Some([0.0, 0.0, 1.0]);
        let style = SliceStyle { transfer_function: tf, value_range: [0.0, 9.0], is_smooth: false, tint: 0.0 };
        let (table, range) = style.table();
        assert_eq!((table.len(), range), (COLORS + 4, [-1.0, 3.0]));
        assert_eq!(table[..3], [[0, 0, 255, 255], [255; 4], [0; 4]]);
        assert_eq!((table[3 + COLORS / 4], table[3 + COLORS / 2]), ([128, 0, 0, 255], [255, 0, 0, 255]));
    }
}
