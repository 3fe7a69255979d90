//! What the metrics are of one tet, in a form without branches, so that loops over tets become vector instructions.
//!
//! With vertices 0 to 3, edges `L`, `J` the determinant of the edges at vertex 0 (six volumes), `n` the normals of the faces, two areas
//! long, outward in a positive tet, and `a` their lengths, the inradius is `J / sum a`; the map `M` from the regular tet has
//! `|M|^2 = sum L^2 / 2`, `|M^-1|^2 = sum a^2 / (2 J^2)`, `det M = sqrt 2 J`; the dihedral angle at an edge of length `L` between faces i
//! and j has `cos = - ni . nj / (ai aj)`, `sin = |J| L / (ai aj)`.

/// A vector.
pub type Vector = [f64; 3];

#[inline(always)]
fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn negative(a: Vector) -> Vector {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

#[inline(always)]
fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The larger; `b` if one is NaN.
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller; `b` if one is NaN.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn largest<const N: usize>(values: [f64; N]) -> f64 {
    let mut found = values[0];
    let mut i = 1;
    while i < N {
        found = larger(values[i], found);
        i += 1;
    }
    found
}

#[inline(always)]
fn smallest<const N: usize>(values: [f64; N]) -> f64 {
    let mut found = values[0];
    let mut i = 1;
    while i < N {
        found = smaller(values[i], found);
        i += 1;
    }
    found
}

/// The cube root of a number that is not negative, to a few units in the last place; 0 below 1e-300.
#[inline(always)]
pub fn cube_root(x: f64) -> f64 {
    // A third of the exponent's and mantissa's high bits, right to 3 %; each step cubes the error.
    let high = ((x.to_bits() >> 32) * 0x5555_5556) >> 32;
    let mut root = f64::from_bits((high + 715_094_163) << 32);
    let mut step = 0;
    while step < 3 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
        step += 1;
    }
    if x > 1e-300 { root } else { 0.0 }
}

/// The angle in [0, pi] whose sine and cosine, with any common factor, these are, to a few units in the last place; NaN of 0 and 0. The
/// standard library's has branches. The polynomial is that of FDLIBM's `atan` (Sun Microsystems 1993, free to use), good to 0.4375.
#[inline(always)]
#[allow(clippy::excessive_precision)] // as the source has them
pub fn angle(sine: f64, cosine: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let size = cosine.abs();
    let is_steep = sine > size;
    let (low, high) = if is_steep { (size, sine) } else { (sine, size) };
    // tan(x - pi/4) = (tan x - 1) / (tan x + 1) above tan(pi/8).
    let is_turned = low > 0.414_213_562_373_095 * high;
    let over = if is_turned { low - high } else { low };
    let under = if is_turned { low + high } else { high };
    let x = over / under;
    let z = x * x;
    let w = z * z;
    let odd = 0.090_908_871_334_365_07 + w * (0.066_610_731_373_875_31 + w * (0.049_768_779_946_159_324 + w * 0.016_285_820_115_365_782));
    let odd = z * (0.333_333_333_333_329_3 + w * (0.142_857_142_725_034_66 + w * odd));
    let even = -0.076_918_762_050_448_3 + w * (-0.058_335_701_337_905_735 + w * -0.036_531_572_744_216_916);
    let even = w * (-0.199_999_999_998_764_83 + w * (-0.111_111_104_054_623_56 + w * even));
    let angle = x - x * (odd + even) + if is_turned { FRAC_PI_4 } else { 0.0 };
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    if cosine < 0.0 { PI - angle } else { angle }
}

/// What the determinant of three edges that leave a vertex, or all reach it, is divided by to make the tangent of half the solid angle.
#[inline(always)]
fn solid_angle(a: Vector, b: Vector, c: Vector, la: f64, lb: f64, lc: f64) -> f64 {
    la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
}

/// Sine and cosine of the smallest and of the largest of some angles.
#[derive(Clone, Copy)]
pub struct Extremes {
    /// Of the smallest angle, which has the largest cosine.
    pub most: [f64; 2],
    /// Of the largest angle, which has the least cosine.
    pub least: [f64; 2],
}

impl Extremes {
    const NONE: Extremes = Extremes { most: [0.0, -2.0], least: [0.0, 2.0] };

    /// Those of one angle more.
    #[inline(always)]
    fn with(self, sine: f64, cosine: f64) -> Self {
        let (is_most, is_least) = (cosine > self.most[1], cosine < self.least[1]);
        Extremes {
            most: [if is_most { sine } else { self.most[0] }, if is_most { cosine } else { self.most[1] }],
            least: [if is_least { sine } else { self.least[0] }, if is_least { cosine } else { self.least[1] }],
        }
    }
}

/// The edges by the vertices at their ends.
const ENDS: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// The faces at each edge, by the vertices opposite to them.
const FACES_AT: [[usize; 2]; 6] = [[2, 3], [0, 3], [1, 3], [1, 2], [0, 2], [0, 1]];

/// A tet and what its metrics are made of. What a metric does not need is not computed, since all of it is inlined.
pub struct Tet {
    /// Along [`ENDS`].
    edges: [Vector; 6],
    /// Their lengths squared.
    lengths2: [f64; 6],
    /// By the vertex opposite.
    normals: [Vector; 4],
    /// Their lengths squared.
    areas2: [f64; 4],
    /// Six volumes.
    jacobian: f64,
}

impl Tet {
    #[inline(always)]
    pub fn new(p: [Vector; 4]) -> Self {
        let edge = |i: usize| minus(p[ENDS[i][1]], p[ENDS[i][0]]);
        let edges = [edge(0), edge(1), edge(2), edge(3), edge(4), edge(5)];
        let [e01, e12, e02, e03, e13, _] = edges;
        let normals = [cross(e12, e13), cross(e03, e02), cross(e01, e03), cross(e02, e01)];
        let square = |v: Vector| dot(v, v);
        Tet {
            edges,
            lengths2: [square(edges[0]), square(edges[1]), square(edges[2]), square(edges[3]), square(edges[4]), square(edges[5])],
            normals,
            areas2: [square(normals[0]), square(normals[1]), square(normals[2]), square(normals[3])],
            jacobian: -dot(normals[3], e03),
        }
    }

    #[inline(always)]
    pub fn jacobian(&self) -> f64 {
        self.jacobian
    }

    #[inline(always)]
    pub fn volume(&self) -> f64 {
        self.jacobian / 6.0
    }

    #[inline(always)]
    fn sum_lengths2(&self) -> f64 {
        let l = self.lengths2;
        (l[0] + l[1]) + (l[2] + l[3]) + (l[4] + l[5])
    }

    #[inline(always)]
    fn areas(&self) -> [f64; 4] {
        let a = self.areas2;
        [a[0].sqrt(), a[1].sqrt(), a[2].sqrt(), a[3].sqrt()]
    }

    #[inline(always)]
    fn sum_areas(&self) -> f64 {
        let a = self.areas();
        (a[0] + a[1]) + (a[2] + a[3])
    }

    /// 2 |J| times the vector from vertex 0 to the centre of the circumsphere: its length.
    #[inline(always)]
    fn circumradius_by_jacobian(&self) -> f64 {
        let (l, n) = (self.lengths2, self.normals);
        let component = |k: usize| l[0] * n[1][k] + l[2] * n[2][k] + l[3] * n[3][k];
        length([component(0), component(1), component(2)])
    }

    #[inline(always)]
    pub fn edge_ratio(&self) -> f64 {
        (largest(self.lengths2) / smallest(self.lengths2)).sqrt()
    }

    #[inline(always)]
    pub fn aspect_ratio(&self) -> f64 {
        const BY_REGULAR: f64 = 0.204_124_145_231_931_5; // 1 / (2 sqrt 6)
        BY_REGULAR * largest(self.lengths2).sqrt() * self.sum_areas() / self.jacobian.abs()
    }

    #[inline(always)]
    pub fn radius_ratio(&self) -> f64 {
        self.circumradius_by_jacobian() * self.sum_areas() / (6.0 * self.jacobian * self.jacobian)
    }

    #[inline(always)]
    pub fn aspect_gamma(&self) -> f64 {
        1.0 / self.mean_ratio().abs()
    }

    /// The cube of the root mean square of the edges is what this divides by.
    #[inline(always)]
    pub fn mean_ratio(&self) -> f64 {
        let mean = self.sum_lengths2() / 6.0;
        std::f64::consts::SQRT_2 * self.jacobian / (mean * mean.sqrt())
    }

    #[inline(always)]
    pub fn aspect_frobenius(&self) -> f64 {
        let root = cube_root(std::f64::consts::SQRT_2 * self.jacobian.abs());
        self.sum_lengths2() / (6.0 * root * root)
    }

    #[inline(always)]
    pub fn shape(&self) -> f64 {
        let root = cube_root(std::f64::consts::SQRT_2 * self.jacobian.abs());
        let shape = 6.0 * root * root / self.sum_lengths2();
        if self.jacobian > 0.0 { shape } else { 0.0 }
    }

    #[inline(always)]
    pub fn amips(&self) -> f64 {
        if self.jacobian > 0.0 { 3.0 * self.aspect_frobenius() } else { f64::INFINITY }
    }

    #[inline(always)]
    pub fn condition(&self) -> f64 {
        let a = self.areas2;
        (self.sum_lengths2() * ((a[0] + a[1]) + (a[2] + a[3]))).sqrt() / (6.0 * self.jacobian)
    }

    /// `VTK`: the edges 12 and 13 stand for each other in the faces opposite vertices 3 and 2.
    #[inline(always)]
    pub fn collapse_ratio<const VTK: bool>(&self) -> f64 {
        let l = self.lengths2;
        let [l1, l4] = if VTK { [l[4], l[1]] } else { [l[1], l[4]] };
        let base = |face: usize, edges: [f64; 3]| (self.areas2[face] * largest(edges)).sqrt();
        // The largest makes the smallest ratio; of an inverted tet the smallest makes the one that is furthest below 0.
        let bases = [base(0, [l[1], l[4], l[5]]), base(1, [l[2], l[3], l[5]]), base(2, [l[0], l[3], l4]), base(3, [l[0], l1, l[2]])];
        let base = if self.jacobian < 0.0 { smallest(bases) } else { largest(bases) };
        self.jacobian / base
    }

    #[inline(always)]
    pub fn scaled_jacobian(&self) -> f64 {
        let l = self.lengths2;
        let products = [l[0] * l[2] * l[3], l[0] * l[1] * l[4], l[1] * l[2] * l[5], l[3] * l[4] * l[5]];
        let most = larger(largest(products).sqrt(), self.jacobian.abs());
        std::f64::consts::SQRT_2 * self.jacobian / most
    }

    #[inline(always)]
    pub fn relative_size_squared(&self, mean_jacobian: f64) -> f64 {
        let ratio = self.jacobian / mean_jacobian;
        let least = smaller(ratio, 1.0 / ratio);
        let squared = if self.jacobian > 0.0 { least * least } else { 0.0 };
        // Inverted tets may outweigh the others.
        if mean_jacobian > 0.0 { squared } else { f64::INFINITY }
    }

    #[inline(always)]
    pub fn equivolume_skew(&self) -> f64 {
        // V / V0 = sqrt 2 J (3/8)^1.5 / R^3, and R = circumradius_by_jacobian / (2 J).
        let by_radius = 2.0 * self.jacobian / self.circumradius_by_jacobian();
        let by_volume = std::f64::consts::SQRT_2 * (0.375 * self.jacobian) * 0.612_372_435_695_794_5; // sqrt(3/8)
        1.0 - by_volume * by_radius * by_radius * by_radius
    }

    #[inline(always)]
    pub fn squish_index(&self) -> f64 {
        // From a vertex to the centre of the other three: the direction from the tet's centre to the centre of the face opposite it.
        let e = self.edges;
        let toward =
            [plus(plus(e[0], e[2]), e[3]), plus(minus(e[1], e[0]), e[4]), minus(minus(e[5], e[1]), e[2]), plus(plus(e[3], e[4]), e[5])];
        // Its product with the normal is 3 J for each face.
        let cosine = |i: usize| 3.0 * self.jacobian / (self.areas2[i] * dot(toward[i], toward[i])).sqrt();
        1.0 - smallest([cosine(0), cosine(1), cosine(2), cosine(3)])
    }

    #[inline(always)]
    pub fn inradius(&self) -> f64 {
        self.jacobian / self.sum_areas()
    }

    /// The corner parts have half the tet's inradius. The inner ones are the eighths of the octahedron between the middles of the edges: each
    /// a sixteenth of the volume, over a quarter of a face, with three sides that all of them share in parallels.
    #[inline(always)]
    pub fn normalized_inradius(&self) -> f64 {
        let [e01, _, e02, _, e13, e23] = self.edges;
        // Four times the way from the centre to the middles of edges 01, 02, 03, with signs that do not matter: p0 + p1 - p2 - p3 and so on.
        let (u, v, w) = (plus(e02, e13), plus(e01, e23), minus(e23, e01));
        let sides = length(cross(u, v)) + length(cross(u, w)) + length(cross(v, w));
        const INNER: f64 = 8.196_152_422_706_632; // 3 (1 + sqrt 3)
        // The least of negative radii is the one furthest below 0.
        let is_inverted = self.jacobian < 0.0;
        let face = if is_inverted { smallest(self.areas2) } else { largest(self.areas2) };
        let (corner, inner) = (3.0 / self.sum_areas(), INNER / (4.0 * face.sqrt() + sides));
        let radius = if is_inverted { larger(corner, inner) } else { smaller(corner, inner) };
        2.0 * self.jacobian * self.jacobian.abs() * radius / self.circumradius_by_jacobian()
    }

    /// Sine and cosine of the smallest dihedral angle. `VTK`: the angles at edges 02 and 13 are taken from 180 degrees.
    #[inline(always)]
    pub fn min_dihedral<const VTK: bool>(&self) -> [f64; 2] {
        self.dihedrals::<VTK>().most
    }

    /// Sine and cosine of the largest dihedral angle.
    #[inline(always)]
    pub fn max_dihedral(&self) -> [f64; 2] {
        self.dihedrals::<false>().least
    }

    /// The dihedral angles with the largest and the least cosine. Sines are NaN where a face has no area.
    #[inline(always)]
    pub fn dihedrals<const VTK: bool>(&self) -> Extremes {
        let a = self.areas();
        let inverse = [1.0 / a[0], 1.0 / a[1], 1.0 / a[2], 1.0 / a[3]];
        // Loops as long as this one are not unrolled, and what has loops inside does not become vector instructions.
        let found = self.at_edge::<0, VTK>(inverse, Extremes::NONE);
        let found = self.at_edge::<1, VTK>(inverse, found);
        let found = self.at_edge::<2, VTK>(inverse, found);
        let found = self.at_edge::<3, VTK>(inverse, found);
        let found = self.at_edge::<4, VTK>(inverse, found);
        let found = self.at_edge::<5, VTK>(inverse, found);
        let jacobian = if smallest(self.areas2) > 0.0 { self.jacobian.abs() } else { f64::NAN };
        let sine = |[square, cosine]: [f64; 2]| [jacobian * square.sqrt(), cosine];
        Extremes { most: sine(found.most), least: sine(found.least) }
    }

    /// Takes in the angle at an edge; its sine is squared, and lacks the Jacobian.
    #[inline(always)]
    fn at_edge<const EDGE: usize, const VTK: bool>(&self, inverse: [f64; 4], found: Extremes) -> Extremes {
        let [i, j] = FACES_AT[EDGE];
        let by = inverse[i] * inverse[j];
        let cosine = -dot(self.normals[i], self.normals[j]) * by;
        found.with(self.lengths2[EDGE] * by * by, if VTK && (EDGE == 2 || EDGE == 4) { -cosine } else { cosine })
    }

    /// The angles of faces with the largest and the least cosine.
    #[inline(always)]
    pub fn face_angles(&self) -> Extremes {
        let (l, a) = (self.lengths2, self.areas());
        let inverse = [1.0 / l[0].sqrt(), 1.0 / l[1].sqrt(), 1.0 / l[2].sqrt(), 1.0 / l[3].sqrt(), 1.0 / l[4].sqrt(), 1.0 / l[5].sqrt()];
        // Between edges that both leave a vertex, or both reach it; or else the sign is another.
        let found = self.between::<1, 4>(a[0], 1.0, inverse, Extremes::NONE);
        let found = self.between::<1, 5>(a[0], -1.0, inverse, found);
        let found = self.between::<4, 5>(a[0], 1.0, inverse, found);
        let found = self.between::<2, 3>(a[1], 1.0, inverse, found);
        let found = self.between::<2, 5>(a[1], -1.0, inverse, found);
        let found = self.between::<3, 5>(a[1], 1.0, inverse, found);
        let found = self.between::<0, 3>(a[2], 1.0, inverse, found);
        let found = self.between::<0, 4>(a[2], -1.0, inverse, found);
        let found = self.between::<3, 4>(a[2], 1.0, inverse, found);
        let found = self.between::<0, 1>(a[3], -1.0, inverse, found);
        let found = self.between::<0, 2>(a[3], 1.0, inverse, found);
        self.between::<1, 2>(a[3], 1.0, inverse, found)
    }

    /// Takes in the angle between two edges of a face of this area (doubled).
    #[inline(always)]
    fn between<const I: usize, const J: usize>(&self, area: f64, sign: f64, inverse: [f64; 6], found: Extremes) -> Extremes {
        let by = inverse[I] * inverse[J];
        found.with(area * by, sign * dot(self.edges[I], self.edges[J]) * by)
    }

    /// Sine and cosine (with a common factor) of half the smallest solid angle: `tan = |J| / (abc + (a.b) c + ..)` at each vertex.
    #[inline(always)]
    pub fn half_solid_angle(&self) -> [f64; 2] {
        let (e, l) = (self.edges, self.lengths2);
        let [l0, l1, l2, l3, l4, l5] = [l[0].sqrt(), l[1].sqrt(), l[2].sqrt(), l[3].sqrt(), l[4].sqrt(), l[5].sqrt()];
        let most = larger(
            larger(solid_angle(e[0], e[2], e[3], l0, l2, l3), solid_angle(negative(e[0]), e[1], e[4], l0, l1, l4)),
            larger(solid_angle(e[1], e[2], negative(e[5]), l1, l2, l5), solid_angle(e[3], e[4], e[5], l3, l4, l5)),
        );
        [self.jacobian.abs(), most]
    }
}
