//! [`TetMesh`] and its validation.

use super::to_tets::{gathered, without_unused};
use super::{CellType, FileCells, thousands};
use crate::geometry::{self, Aabb, Placed};
use glam::DVec3;
use rayon::prelude::*;

/// The numbers of an array. Integers of up to 24 bits and f32 are kept as f32, all else as f64.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
}

impl Values {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `i`, widened.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Values::F32(v) => f64::from(v[i]),
            Values::F64(v) => v[i],
        }
    }
}

/// A named array over points or cells: `values[tuple * components + component]`.
#[derive(Debug, Clone, PartialEq)]
pub struct DataArray {
    /// The name the file gives it.
    pub name: String,
    /// Numbers per point or cell, at least 1.
    pub components: usize,
    /// All numbers, tuple by tuple.
    pub values: Values,
}

impl DataArray {
    /// How many tuples (points or cells) the array covers.
    pub fn tuples(&self) -> usize {
        self.values.len() / self.components
    }
}

impl DataArray {
    /// Its tuples at these places.
    pub fn gathered(self, places: &[u32]) -> DataArray {
        gathered(self, places)
    }

    /// Adds the tuples of another, which has as many components.
    fn append(&mut self, other: DataArray) {
        match (&mut self.values, other.values) {
            (Values::F32(values), Values::F32(more)) => values.extend(more),
            (Values::F64(values), Values::F64(more)) => values.extend(more),
            (Values::F64(values), Values::F32(more)) => values.extend(more.iter().map(|&v| f64::from(v))),
            (Values::F32(values), Values::F64(more)) => {
                let wide = values.iter().map(|&v| f64::from(v)).chain(more).collect();
                self.values = Values::F64(wide);
            }
        }
    }

    /// Puts arrays behind those of the same name and size; others of either are dropped, and named.
    pub(super) fn append_all(arrays: &mut Vec<DataArray>, more: Vec<DataArray>) -> Vec<String> {
        let mut more: Vec<Option<DataArray>> = more.into_iter().map(Some).collect();
        let mut dropped = Vec::new();
        arrays.retain_mut(|array| {
            let is_it = |other: &&mut Option<DataArray>| {
                other.as_ref().is_some_and(|other| other.name == array.name && other.components == array.components)
            };
            match more.iter_mut().find(is_it).and_then(Option::take) {
                Some(other) => array.append(other),
                None => dropped.push(array.name.clone()),
            }
            dropped.last() != Some(&array.name)
        });
        dropped.extend(more.into_iter().flatten().map(|array| array.name));
        dropped
    }
}

/// What a reader hands to [`TetMesh::new`]: absolute coordinates, nothing checked yet.
#[derive(Debug, Clone, Default)]
pub struct MeshParts {
    /// Points in world coordinates.
    pub points: Vec<DVec3>,
    /// Four point indices a tet, in VTK's order or its mirror image.
    pub tets: Vec<[u32; 4]>,
    /// Arrays with one tuple a point.
    pub point_data: Vec<DataArray>,
    /// Arrays with one tuple a tet.
    pub cell_data: Vec<DataArray>,
    /// The array that the file marks as its scalars, if any.
    pub active_scalars: Option<String>,
    /// Which cell of the file each tet is of.
    pub file_cells: FileCells,
    /// What of the file is not here, or not as the file has it, one sentence each.
    pub notes: Vec<String>,
}

/// Why parts do not make a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing to draw.
    #[error("the mesh has no tetrahedra")]
    NoTets,
    /// Its cells are points, lines and surfaces.
    #[error("has no cell with a volume: it holds {0}")]
    NoVolume(String),
    /// Every cell has a point that is nowhere.
    #[error("none of its cells has finite coordinates")]
    NoFinite,
    /// A cell has not the points that its type has.
    #[error("cell {cell}, a {} (type {}), has {found} points, expected {expected}", cell_type.name().0, cell_type.0)]
    CellPoints {
        /// The first such cell.
        cell: usize,
        /// Its type.
        cell_type: CellType,
        /// Points it has.
        found: usize,
        /// Points of its type.
        expected: usize,
    },
    /// A cell names a point that does not exist.
    #[error("cell {cell} uses point {index}, but there are only {points} points")]
    CellPoint {
        /// The first such cell.
        cell: usize,
        /// The index it holds.
        index: u32,
        /// The number of points.
        points: usize,
    },
    /// A polyhedron's list of faces ends too early or too late.
    #[error("the faces of polyhedron {cell} are not as many as it says")]
    Polyhedron {
        /// The first such cell.
        cell: usize,
    },
    /// Indices are u32.
    #[error("the mesh has {count} {what}, more than the {max} that octetra can index", max = u32::MAX - 1)]
    TooMany {
        /// "points" or "tets".
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A tet names a point that does not exist.
    #[error("tet {tet} uses point {index}, but there are only {points} points")]
    PointIndex {
        /// The first such tet.
        tet: usize,
        /// The index it holds.
        index: u32,
        /// The number of points.
        points: usize,
    },
    /// An array does not fit the mesh.
    #[error("array \"{name}\" has {found} numbers, expected {tuples} x {components} (one tuple for each of the {tuples} {of})")]
    ArrayLength {
        /// The array.
        name: String,
        /// Numbers it has.
        found: usize,
        /// Tuples it should have.
        tuples: usize,
        /// Components a tuple.
        components: usize,
        /// "points" or "tets".
        of: &'static str,
    },
}

/// A valid tetrahedral mesh. Every index is in range, every point finite, every tet positive or marked as of zero volume.
///
/// Points are stored relative to [`TetMesh::center`], subtracted in f64, so that a mesh far from the origin keeps its precision when
/// coordinates become f32 on the GPU.
#[derive(Debug, Clone)]
pub struct TetMesh {
    points: Vec<DVec3>,
    center: DVec3,
    bounds: Aabb,
    tets: Vec<[u32; 4]>,
    zero_volume: Vec<bool>,
    zero_volume_count: usize,
    inverted_count: usize,
    /// Which tets were reoriented; nothing where none was.
    inverted: Vec<bool>,
    point_data: Vec<DataArray>,
    cell_data: Vec<DataArray>,
    active_scalars: Option<String>,
    file_cells: FileCells,
    notes: Vec<String>,
}

impl TetMesh {
    /// Validates parts: checks indices and array lengths, leaves out points that are not finite with their tets, reorients inverted tets,
    /// marks those without volume.
    pub fn new(parts: MeshParts) -> Result<Self, MeshError> {
        let MeshParts { points, tets, point_data, cell_data, file_cells, .. } = &parts;
        let limit = u32::MAX as usize - 1;
        for (what, count) in [("points", points.len()), ("tets", tets.len())] {
            if count > limit {
                return Err(MeshError::TooMany { what, count });
            }
        }
        if tets.is_empty() {
            return Err(MeshError::NoTets);
        }
        if let Some((tet, index)) = tets
            .par_iter()
            .enumerate()
            .find_map_first(|(tet, corners)| corners.iter().find(|&&index| index as usize >= points.len()).map(|&index| (tet, index)))
        {
            return Err(MeshError::PointIndex { tet, index, points: points.len() });
        }
        for (arrays, tuples, of) in [(point_data, points.len(), "points"), (cell_data, tets.len(), "tets")] {
            for a in arrays {
                if a.components == 0 || Some(a.values.len()) != tuples.checked_mul(a.components) {
                    let (name, found, components) = (a.name.clone(), a.values.len(), a.components);
                    return Err(MeshError::ArrayLength { name, found, tuples, components, of });
                }
            }
        }
        if !file_cells.numbers.is_empty() && file_cells.numbers.len() != tets.len() {
            let (found, tuples) = (file_cells.numbers.len(), tets.len());
            return Err(MeshError::ArrayLength { name: "file cells".into(), found, tuples, components: 1, of: "tets" });
        }
        let parts = if points.par_iter().all(|p| p.is_finite()) { parts } else { without_broken(parts)? };
        let MeshParts { mut points, mut tets, point_data, cell_data, active_scalars, file_cells, notes } = parts;
        let world = Aabb::of_points(points.iter().copied());
        let center = world.center();
        points.par_iter_mut().for_each(|p| *p -= center);
        let inverted_and_flat: Vec<(bool, bool)> = tets
            .par_iter_mut()
            .map(|corners| {
                let p = corners.map(|i| points[i as usize]);
                if geometry::is_degenerate(&p) {
                    return (false, true);
                }
                let inverted = geometry::signed_volume(&p) < 0.0;
                if inverted {
                    corners.swap(2, 3);
                }
                (inverted, false)
            })
            .collect();
        let zero_volume: Vec<bool> = inverted_and_flat.iter().map(|&(_, flat)| flat).collect();
        let inverted_count = inverted_and_flat.iter().filter(|&&(inverted, _)| inverted).count();
        let listed = if inverted_count > 0 { &inverted_and_flat[..] } else { &[] };
        Ok(TetMesh {
            inverted: listed.iter().map(|&(inverted, _)| inverted).collect(),
            zero_volume_count: zero_volume.iter().filter(|&&flat| flat).count(),
            inverted_count,
            bounds: world.translated(-center),
            points,
            center,
            tets,
            zero_volume,
            point_data,
            cell_data,
            active_scalars,
            file_cells,
            notes,
        })
    }

    /// Points relative to [`TetMesh::center`].
    #[inline]
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The world position that points are relative to: the centre of the bounds of all points.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Bounds of all points, relative to [`TetMesh::center`].
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The cube that octrees of the mesh divide and f32 coordinates refer to, as (lowest corner relative to [`TetMesh::center`], edge): the
    /// bounds' centre, and (1 + 1e-5) times their longest side (method 1.1).
    pub fn root_cube(&self) -> (DVec3, f64) {
        let edge = self.bounds.size().max_element() * (1.0 + 1e-5);
        (self.bounds.center() - DVec3::splat(edge / 2.0), edge)
    }

    /// Point indices of each tet, positively oriented (or of zero volume).
    #[inline]
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// The corners of a tet, relative to [`TetMesh::center`].
    #[inline]
    pub fn corners(&self, tet: usize) -> [DVec3; 4] {
        // Written out: `map` on arrays is not always inlined, and this is called for every tet of every cell.
        let [a, b, c, d] = self.tets[tet];
        [self.points[a as usize], self.points[b as usize], self.points[c as usize], self.points[d as usize]]
    }

    /// Whether a tet has no volume; such tets are kept (their faces join others) but take no part in volume work.
    pub fn is_zero_volume(&self, tet: usize) -> bool {
        self.zero_volume[tet]
    }

    /// How many tets have no volume.
    pub fn zero_volume_count(&self) -> usize {
        self.zero_volume_count
    }

    /// How many tets were listed in mirror order and reoriented.
    pub fn inverted_count(&self) -> usize {
        self.inverted_count
    }

    /// Whether a tet was listed in mirror order: its third and fourth corner are the file's fourth and third.
    #[inline]
    pub fn is_inverted(&self, tet: usize) -> bool {
        self.inverted.get(tet).is_some_and(|&inverted| inverted)
    }

    /// Arrays over points.
    pub fn point_data(&self) -> &[DataArray] {
        &self.point_data
    }

    /// Arrays over tets.
    pub fn cell_data(&self) -> &[DataArray] {
        &self.cell_data
    }

    /// The array that the file marks as its scalars.
    pub fn active_scalars(&self) -> Option<&str> {
        self.active_scalars.as_deref()
    }

    /// Which cell of the file each tet is of.
    pub fn file_cells(&self) -> &FileCells {
        &self.file_cells
    }

    /// What of the file is not here, or not as the file has it, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Bytes that the mesh takes in memory, arrays included.
    pub fn bytes(&self) -> usize {
        let arrays = self.point_data.iter().chain(&self.cell_data);
        let array_bytes: usize = arrays.map(|a| a.values.len() * if matches!(a.values, Values::F32(_)) { 4 } else { 8 }).sum();
        size_of_val(&self.points[..])
            + size_of_val(&self.tets[..])
            + self.zero_volume.len()
            + self.inverted.len()
            + size_of_val(&self.file_cells.numbers[..])
            + self.file_cells.types.len()
            + array_bytes
    }
}

/// The same mesh without points whose coordinates are not finite, and without their tets.
fn without_broken(mut parts: MeshParts) -> Result<MeshParts, MeshError> {
    let is_whole = |tet: &[u32; 4]| tet.iter().all(|&corner| parts.points[corner as usize].is_finite());
    let kept: Vec<u32> = (0..parts.tets.len() as u32).filter(|&tet| is_whole(&parts.tets[tet as usize])).collect();
    if kept.is_empty() {
        return Err(MeshError::NoFinite);
    }
    let (points, tets) = (parts.points.iter().filter(|p| !p.is_finite()).count(), parts.tets.len() - kept.len());
    parts.notes.push(format!(
        "{} points have no finite coordinates and were left out, with {} tets",
        thousands(points as u64),
        thousands(tets as u64)
    ));
    if tets > 0 {
        let cells = &parts.file_cells;
        parts.file_cells = FileCells {
            numbers: kept.iter().map(|&tet| cells.number(tet as usize) as u32).collect(),
            types: if cells.types.is_empty() { vec![] } else { kept.iter().map(|&tet| cells.cell_type(tet as usize)).collect() },
            ..*cells
        };
        parts.cell_data = parts.cell_data.into_iter().map(|array| gathered(array, &kept)).collect();
        parts.tets = kept.iter().map(|&tet| parts.tets[tet as usize]).collect();
    }
    Ok(without_unused(parts))
}

impl Placed for TetMesh {
    fn center(&self) -> DVec3 {
        self.center
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> MeshParts {
        MeshParts { points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], tets: vec![[0, 1, 2, 3]], ..Default::default() }
    }

    #[test]
    fn inverted_tets_are_turned_and_counted() {
        let mut parts = unit();
        parts.tets.push([0, 2, 1, 3]);
        let mesh = TetMesh::new(parts).expect("valid");
        assert_eq!((mesh.inverted_count(), [0, 1].map(|tet| mesh.is_inverted(tet))), (1, [false, true]));
        assert!((0..2).all(|t| geometry::signed_volume(&mesh.corners(t)) > 0.0));
    }

    #[test]
    fn flat_tets_are_kept_and_marked() {
        let mut parts = unit();
        parts.tets.push([0, 1, 2, 2]);
        let mesh = TetMesh::new(parts).expect("valid");
        assert_eq!((mesh.tets().len(), mesh.zero_volume_count()), (2, 1));
        assert!(mesh.is_zero_volume(1) && !mesh.is_zero_volume(0));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let mut parts = unit();
        parts.tets[0][3] = 9;
        assert_eq!(TetMesh::new(parts).err(), Some(MeshError::PointIndex { tet: 0, index: 9, points: 4 }));
        let mut parts = unit();
        parts.points[2].y = f64::NAN;
        assert_eq!(TetMesh::new(parts).err(), Some(MeshError::NoFinite));
        let mut parts = unit();
        parts.point_data.push(DataArray { name: "s".into(), components: 1, values: Values::F32(vec![0.0; 3]) });
        assert!(TetMesh::new(parts).is_err_and(|e| e.to_string().contains("\"s\" has 3 numbers, expected 4 x 1")));
        assert_eq!(TetMesh::new(MeshParts::default()).err(), Some(MeshError::NoTets));
    }

    #[test]
    fn points_that_are_nowhere_go_with_their_tets() {
        let array =
            |name: &str, n: usize| DataArray { name: name.into(), components: 1, values: Values::F64((0..n).map(|i| i as f64).collect()) };
        let mut parts = unit();
        parts.points.insert(0, DVec3::NAN);
        parts.points.push(DVec3::splat(f64::INFINITY));
        parts.tets = vec![[1, 2, 3, 5], [1, 2, 3, 4]];
        (parts.point_data, parts.cell_data) = (vec![array("p", 6)], vec![array("c", 2)]);
        let mesh = TetMesh::new(parts).expect("one tet is whole");
        assert_eq!((mesh.points().len(), mesh.tets(), mesh.file_cells().number(0)), (4, &[[0, 1, 2, 3]][..], 1));
        assert_eq!((mesh.point_data()[0].values.get(3), mesh.cell_data()[0].values.get(0)), (4.0, 1.0));
        assert_eq!(mesh.notes(), ["2 points have no finite coordinates and were left out, with 1 tets"]);
    }

    #[test]
    fn a_mesh_moved_far_away_keeps_its_shape() {
        let mut parts = unit();
        parts.points.iter_mut().for_each(|p| *p += DVec3::splat(1e6));
        let (far, near) = (TetMesh::new(parts).expect("valid"), TetMesh::new(unit()).expect("valid"));
        assert_eq!(far.points(), near.points());
        assert_eq!(far.center() - near.center(), DVec3::splat(1e6));
    }
}
