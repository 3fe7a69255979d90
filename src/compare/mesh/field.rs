//! How far a field on one mesh is from a field on another.

use super::{Nearest, Surface};
use crate::geometry;
use crate::mesh::{Association, Locator, ScalarField, TetMesh};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// Items that a task takes at once.
const CHUNK: usize = 1 << 12;

/// Weights of a tet's corners at the four points of a rule that integrates quadratic functions exactly, each with a quarter of the volume
/// (Hammer and Stroud, "Numerical integration over simplexes", 1956).
const RULE: [f64; 2] = [0.585_410_196_624_968_5, 0.138_196_601_125_010_5];

/// A mesh and a field on it.
#[derive(Debug, Clone, Copy)]
pub struct OnMesh<'a> {
    /// The mesh.
    pub mesh: &'a TetMesh,
    /// One of its fields.
    pub field: &'a ScalarField,
}

/// The difference a - b of two fields, where both have a value. Data units.
///
/// The other mesh's field is linear in the tet that holds a place (the lowest-numbered where there are several), or constant for cell data.
/// Meshes with equal points and tets are compared number by number.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldDifference {
    /// Over A's tets.
    pub over_a: Norms,
    /// Over B's tets.
    pub over_b: Norms,
    /// The largest value of A's field less its smallest.
    pub range: f64,
    /// Where it is largest, over points and places inside the tets of both; `None` where no place has both values.
    pub largest: Option<Largest>,
    /// At A's points, or in the middle of its tets for cell data; NaN where one has no value.
    pub on_a: Vec<f64>,
    /// B's values there.
    pub b_on_a: Vec<f64>,
    /// Whether the meshes have equal points and tets.
    pub same_mesh: bool,
}

/// The difference over one mesh's tets, weighted by their volume, by four places in each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Norms {
    /// The volume where both fields have a value.
    pub both: f64,
    /// The volume where this mesh alone has one.
    pub alone: f64,
    /// Of `both`, the volume at places beside the other mesh that took the value of its surface.
    pub snapped: f64,
    /// The mean of a - b.
    pub mean: f64,
    /// The mean of |a - b|: the L1 norm over the volume.
    pub l1: f64,
    /// The root of the mean of (a - b)^2: the L2 norm over the root of the volume.
    pub l2: f64,
    /// The largest |a - b| at this mesh's points and at the places in its tets.
    pub max: f64,
    /// This mesh's own field over `both`.
    pub own_integral: f64,
    /// The other's there.
    pub other_integral: f64,
    /// This mesh's points (or tets, for cell data) with a value of its own.
    pub places: u64,
    /// Those of them where the other has none.
    pub places_alone: u64,
}

/// Where a difference is largest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Largest {
    /// A's value.
    pub a: f64,
    /// B's value.
    pub b: f64,
    /// The place, in world coordinates.
    pub at: DVec3,
    /// Whether the tet is one of A's, else of B's.
    pub is_of_a: bool,
    /// The tet that holds the place.
    pub tet: u32,
}

impl FieldDifference {
    /// Compares two fields. A place outside a mesh, but within `snap` (world units) of its surface, takes the value of the nearest point of
    /// that; with 0 it has none.
    pub fn measure(a: OnMesh<'_>, b: OnMesh<'_>, snap: f64, progress: &Progress) -> Result<Self, Cancelled> {
        let same_mesh = a.mesh.center() == b.mesh.center() && a.mesh.points() == b.mesh.points() && a.mesh.tets() == b.mesh.tets();
        let other = |of: OnMesh<'_>| Locator::new(of.mesh, progress).map(Some);
        let locators = if same_mesh { [None, None] } else { [other(a)?, other(b)?] };
        let surface = |of: OnMesh<'_>| {
            (snap > 0.0 && !same_mesh).then(|| {
                let surface = Surface::of_mesh(of.mesh);
                (Nearest::new(&surface), surface.cells, snap)
            })
        };
        let [at_a, at_b] = locators;
        let carried_b = Carried { of: b, locator: at_b, surface: surface(b), shift: a.mesh.center() - b.mesh.center() };
        let carried_a = Carried { of: a, locator: at_a, surface: surface(a), shift: b.mesh.center() - a.mesh.center() };
        progress.begin("comparing fields", (a.mesh.tets().len() + b.mesh.tets().len()) as u64);
        let (over_a, largest_a, b_on_a) = over(a, &carried_b, true, progress)?;
        let (over_b, largest_b, _) = over(b, &carried_a, false, progress)?;
        let size = |largest: &Largest| (largest.a - largest.b).abs();
        let largest = match (largest_a, largest_b) {
            (Some(x), Some(y)) => Some(if size(&y) > size(&x) { y } else { x }),
            (x, y) => x.or(y),
        };
        let on_a = a.field.values.iter().zip(&b_on_a).map(|(x, y)| x - y).collect();
        let [low, high] = a.field.range;
        Ok(FieldDifference { over_a, over_b, range: high - low, largest, on_a, b_on_a, same_mesh })
    }

    /// A difference in parts of A's range; infinite where A is constant and B is not.
    pub fn relative(&self, difference: f64) -> f64 {
        if difference == 0.0 { 0.0 } else { difference / self.range }
    }
}

/// A field that has values at places of another mesh.
struct Carried<'a> {
    of: OnMesh<'a>,
    /// `None` if the meshes are equal.
    locator: Option<Locator>,
    /// The surface, the tets behind its triangles, and how far from it places may be.
    surface: Option<(Nearest, Vec<u32>, f64)>,
    /// From the other mesh's coordinates to this one's.
    shift: DVec3,
}

impl Carried<'_> {
    /// The value at a place of the other mesh, and whether it is the surface's. `tet` and `weights` are the place as that mesh has it.
    fn value(&self, at: DVec3, tet: usize, weights: [f64; 4]) -> Option<(f64, bool)> {
        let OnMesh { mesh, field } = self.of;
        let Some(locator) = &self.locator else {
            return inside(field, mesh, tet, weights).map(|value| (value, false));
        };
        let at = at + self.shift;
        if let Some(place) = locator.find(mesh, at) {
            return inside(field, mesh, place.tet as usize, place.weights).map(|value| (value, false));
        }
        let (nearest, tets, most) = self.surface.as_ref()?;
        let hit = nearest.find(at, 0);
        if hit.squared > most * most {
            return None;
        }
        let tet = tets[nearest.number(hit.place) as usize] as usize;
        let weights = geometry::barycentric(nearest.point(at, hit.place), &mesh.corners(tet));
        inside(field, mesh, tet, weights).map(|value| (value, true))
    }
}

/// A field's value in a tet; `None` where one is missing.
fn inside(field: &ScalarField, mesh: &TetMesh, tet: usize, weights: [f64; 4]) -> Option<f64> {
    let value = match field.association {
        Association::Cells => field.values[tet],
        Association::Points => {
            let values = field.data_at_corners(mesh, tet);
            (0..4).map(|i| weights[i] * values[i]).sum()
        }
    };
    value.is_finite().then_some(value)
}

/// What one task finds.
#[derive(Default)]
struct Sums {
    norms: Norms,
    largest: Option<Largest>,
    values: Vec<f64>,
}

impl Sums {
    fn compare(&mut self, own: f64, other: f64, is_of_a: bool, at: DVec3, tet: u32) -> f64 {
        let (a, b) = if is_of_a { (own, other) } else { (other, own) };
        let size = (a - b).abs();
        if self.largest.is_none() || size > self.norms.max {
            self.largest = Some(Largest { a, b, at, is_of_a, tet });
            self.norms.max = size;
        }
        a - b
    }

    /// Adds what follows.
    fn and(mut self, other: Sums) -> Sums {
        let (x, y) = (&mut self.norms, &other.norms);
        if self.largest.is_none() || (y.max > x.max && other.largest.is_some()) {
            self.largest = other.largest;
        }
        *x = Norms {
            both: x.both + y.both,
            alone: x.alone + y.alone,
            snapped: x.snapped + y.snapped,
            mean: x.mean + y.mean,
            l1: x.l1 + y.l1,
            l2: x.l2 + y.l2,
            max: x.max.max(y.max),
            own_integral: x.own_integral + y.own_integral,
            other_integral: x.other_integral + y.other_integral,
            places: x.places + y.places,
            places_alone: x.places_alone + y.places_alone,
        };
        self.values.extend(other.values);
        self
    }
}

/// Goes through one mesh; the values are the other's at its points or in the middle of its tets.
fn over(own: OnMesh<'_>, other: &Carried<'_>, is_of_a: bool, progress: &Progress) -> Result<(Norms, Option<Largest>, Vec<f64>), Cancelled> {
    let OnMesh { mesh, field } = own;
    let center = mesh.center();
    let chunks = |count: usize| (0..count.div_ceil(CHUNK)).into_par_iter().map(move |c| c * CHUNK..((c + 1) * CHUNK).min(count));
    let add = |parts: Vec<Sums>| parts.into_iter().fold(Sums::default(), Sums::and);

    let tets = chunks(mesh.tets().len()).map(|range| {
        progress.check()?;
        progress.add(range.len() as u64);
        let mut sums = Sums::default();
        for tet in range.filter(|&tet| field.is_usable(mesh, tet)) {
            let corners = mesh.corners(tet);
            let volume = geometry::signed_volume(&corners) / 4.0;
            for corner in 0..4 {
                let weights: [f64; 4] = std::array::from_fn(|i| RULE[usize::from(i != corner)]);
                let at = (0..4).map(|i| corners[i] * weights[i]).sum::<DVec3>();
                let Some(value) = inside(field, mesh, tet, weights) else { continue };
                let Some((found, is_snapped)) = other.value(at, tet, weights) else {
                    sums.norms.alone += volume;
                    continue;
                };
                let difference = sums.compare(value, found, is_of_a, at + center, tet as u32);
                let norms = &mut sums.norms;
                norms.both += volume;
                norms.snapped += if is_snapped { volume } else { 0.0 };
                norms.mean += volume * difference;
                norms.l1 += volume * difference.abs();
                norms.l2 += volume * difference * difference;
                norms.own_integral += volume * value;
                norms.other_integral += volume * found;
            }
        }
        Ok(sums)
    });
    let inner = add(tets.collect::<Result<Vec<_>, Cancelled>>()?);

    // A tet of each point: the lowest, and which of its corners the point is.
    let mut tet_of = Vec::new();
    if field.association == Association::Points {
        tet_of = vec![(u32::MAX, 0u8); mesh.points().len()];
        for (tet, corners) in mesh.tets().iter().enumerate().rev().filter(|(tet, _)| field.is_usable(mesh, *tet)) {
            (0..).zip(corners).for_each(|(corner, &point)| tet_of[point as usize] = (tet as u32, corner));
        }
    }
    let places = chunks(field.values.len()).map(|range| {
        progress.check()?;
        let mut sums = Sums::default();
        for i in range {
            let (at, tet, weights) = match field.association {
                Association::Cells => (mesh.corners(i).into_iter().sum::<DVec3>() / 4.0, i as u32, [0.25; 4]),
                Association::Points => {
                    let (tet, corner) = tet_of[i];
                    (mesh.points()[i], tet, std::array::from_fn(|k| if k == usize::from(corner) { 1.0 } else { 0.0 }))
                }
            };
            let value = field.values[i];
            let counts = match field.association {
                Association::Cells => field.is_usable(mesh, i),
                Association::Points => tet != u32::MAX && value.is_finite(),
            };
            let found = if !counts {
                None
            } else if other.locator.is_none() && field.association == Association::Points {
                // Equal meshes: the corner's value alone, so that a missing one beside it does not matter.
                other.at_point(i, tet as usize)
            } else {
                other.value(at, tet as usize, weights).map(|found| found.0)
            };
            sums.norms.places += u64::from(counts);
            sums.norms.places_alone += u64::from(counts && found.is_none());
            if let Some(found) = found {
                sums.compare(value, found, is_of_a, at + center, tet);
            }
            sums.values.push(found.unwrap_or(f64::NAN));
        }
        Ok(sums)
    });
    let at_places = add(places.collect::<Result<Vec<_>, Cancelled>>()?);
    // Places first: of equal differences the one at a point is said.
    let Sums { mut norms, largest, values } = at_places.and(inner);
    let per_volume = if norms.both > 0.0 { 1.0 / norms.both } else { f64::NAN };
    (norms.mean, norms.l1, norms.l2) = (norms.mean * per_volume, norms.l1 * per_volume, (norms.l2 * per_volume).sqrt());
    Ok((norms, largest, values))
}

impl Carried<'_> {
    /// The value at a point of an equal mesh, of cell data in a tet that has it.
    fn at_point(&self, point: usize, tet: usize) -> Option<f64> {
        let field = self.of.field;
        let value = field.values[if field.association == Association::Points { point } else { tet }];
        value.is_finite().then_some(value)
    }
}
