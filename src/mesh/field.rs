//! One scalar field over a mesh: an array, or a component or the magnitude of a vector array.

use super::quality::{self, UnknownMetric};
use super::{DataArray, TetMesh};
use crate::geometry;
use std::fmt;
use std::str::FromStr;

/// Where an array's tuples live.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Association {
    /// One tuple a point; linear inside a tet.
    Points,
    /// One tuple a tet; constant inside it.
    Cells,
}

/// Which scalar to take from an array of several components. Arrays of one component are taken as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Component {
    /// The Euclidean length.
    #[default]
    Magnitude,
    /// One component, from 0.
    Index(usize),
}

/// Why a text names no component.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected magnitude, x, y, z or a number from 0")]
pub struct NotAComponent;

impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Component::Magnitude => f.write_str("magnitude"),
            Component::Index(i @ 0..3) => f.write_str(["x", "y", "z"][*i]),
            Component::Index(i) => write!(f, "{i}"),
        }
    }
}

impl FromStr for Component {
    type Err = NotAComponent;

    fn from_str(text: &str) -> Result<Self, NotAComponent> {
        match text {
            "magnitude" => Ok(Component::Magnitude),
            "x" => Ok(Component::Index(0)),
            "y" => Ok(Component::Index(1)),
            "z" => Ok(Component::Index(2)),
            n => n.parse().map(Component::Index).map_err(|_| NotAComponent),
        }
    }
}

/// Which field of a mesh to show.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FieldSelection {
    /// The array's name; `None` takes the file's active scalars, else the first scalar array (points before cells), else the first
    /// vector array.
    pub name: Option<String>,
    /// What to take of a vector.
    pub component: Component,
}

/// Why a selection names no field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// The mesh carries no arrays.
    #[error("the mesh has no point or cell arrays to show")]
    NoArrays,
    /// No array of this name.
    #[error("there is no array \"{name}\"; the mesh has {available}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are, as text.
        available: String,
    },
    /// No metric of this name.
    #[error(transparent)]
    Metric(UnknownMetric),
    /// The array has fewer components.
    #[error("array \"{name}\" has {components} components, there is no component {index}")]
    Component {
        /// The array.
        name: String,
        /// How many it has.
        components: usize,
        /// The one asked for, from 0.
        index: usize,
    },
    /// Every value is missing.
    #[error("array \"{name}\" leaves nothing to show: of {tets} tets, {zero_volume} have no volume and every other misses a value")]
    AllMissing {
        /// The array.
        name: String,
        /// How many tets there are.
        tets: usize,
        /// How many of them have no volume.
        zero_volume: usize,
    },
    /// Values whose range cannot be told in f64.
    #[error("array \"{name}\" ranges from {} to {}; values must stay within 1e300", .range[0], .range[1])]
    TooLarge {
        /// The array.
        name: String,
        /// Smallest and largest value.
        range: [f64; 2],
    },
}

/// A scalar on the points or cells of a mesh. Missing values are NaN.
#[derive(Debug, Clone)]
pub struct ScalarField {
    /// The array it came from.
    pub name: String,
    /// Where its values live.
    pub association: Association,
    /// One number a point or tet in data units; NaN where missing (infinite values count as missing).
    pub values: Vec<f64>,
    /// Smallest and largest of the values that are not missing, over all points (or cells).
    pub range: [f64; 2],
}

impl ScalarField {
    /// Takes a field from a mesh's arrays.
    pub fn select(mesh: &TetMesh, selection: &FieldSelection) -> Result<Self, FieldError> {
        let found = find(mesh, selection.name.as_deref());
        // An array of the file goes before a metric of the same name.
        let metric = selection.name.as_deref().filter(|_| found.is_err()).and_then(|name| quality::field(mesh, name));
        let field = match metric {
            Some(metric) => metric?,
            None => Self::of_array(found?, selection.component)?,
        };
        let all_missing =
            || FieldError::AllMissing { name: field.name.clone(), tets: mesh.tets().len(), zero_volume: mesh.zero_volume_count() };
        if field.range[0] > field.range[1] || !(0..mesh.tets().len()).any(|t| field.is_usable(mesh, t)) {
            return Err(all_missing());
        }
        if field.range.iter().any(|v| v.abs() > 1e300) {
            return Err(FieldError::TooLarge { name: field.name, range: field.range });
        }
        Ok(field)
    }

    /// A component of an array, or its length.
    fn of_array((association, array): (Association, &DataArray), component: Component) -> Result<Self, FieldError> {
        let values: Vec<f64> = match component {
            _ if array.components == 1 => (0..array.values.len()).map(|i| array.values.get(i)).collect(),
            Component::Magnitude => {
                let component = |t: usize, c: usize| array.values.get(t * array.components + c);
                (0..array.tuples()).map(|t| (0..array.components).fold(0.0, |length: f64, c| length.hypot(component(t, c)))).collect()
            }
            Component::Index(index) if index < array.components => {
                (0..array.tuples()).map(|t| array.values.get(t * array.components + index)).collect()
            }
            Component::Index(index) => {
                return Err(FieldError::Component { name: array.name.clone(), components: array.components, index });
            }
        };
        Ok(Self::new(array.name.clone(), association, values))
    }

    /// A field from numbers of one's own, one a point or tet. Infinite values become NaN. With no finite value the range is `[inf, -inf]`.
    pub fn new(name: String, association: Association, mut values: Vec<f64>) -> Self {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for v in &mut values {
            if v.is_finite() {
                range = [range[0].min(*v), range[1].max(*v)];
            } else {
                *v = f64::NAN;
            }
        }
        ScalarField { name, association, values, range }
    }

    /// A value in data units mapped so that the range becomes [0, 1]; 0 for a constant field, NaN where missing.
    pub fn normalize(&self, value: f64) -> f64 {
        let [lo, hi] = self.range;
        if hi > lo { (value - lo) / (hi - lo) } else { value * 0.0 }
    }

    /// The normalised values at a tet's corners: linear between them for a point field, the cell's value four times over for a cell field.
    /// Any NaN among them makes the tet missing.
    pub fn at_corners(&self, mesh: &TetMesh, tet: usize) -> [f64; 4] {
        match self.association {
            Association::Points => mesh.tets()[tet].map(|i| self.normalize(self.values[i as usize])),
            Association::Cells => [self.normalize(self.values[tet]); 4],
        }
    }

    /// The values at a tet's corners in data units; NaN where missing.
    pub fn data_at_corners(&self, mesh: &TetMesh, tet: usize) -> [f64; 4] {
        match self.association {
            Association::Points => mesh.tets()[tet].map(|i| self.values[i as usize]),
            Association::Cells => [self.values[tet]; 4],
        }
    }

    /// Whether a tet takes part in volume work: it has a volume and none of its values is missing.
    pub fn is_usable(&self, mesh: &TetMesh, tet: usize) -> bool {
        let missing = match self.association {
            Association::Points => mesh.tets()[tet].iter().any(|&i| self.values[i as usize].is_nan()),
            Association::Cells => self.values[tet].is_nan(),
        };
        !missing && !mesh.is_zero_volume(tet)
    }

    /// Normalised values at the points. A cell field's is the volume-weighted mean over the usable tets around a point (method 1.1),
    /// NaN where there is none.
    pub fn at_points(&self, mesh: &TetMesh) -> Vec<f64> {
        match self.association {
            Association::Points => self.values.iter().map(|&v| self.normalize(v)).collect(),
            Association::Cells => {
                let mut sums = vec![(0.0, 0.0); mesh.points().len()];
                for tet in (0..mesh.tets().len()).filter(|&t| self.is_usable(mesh, t)) {
                    let volume = geometry::signed_volume(&mesh.corners(tet));
                    let value = self.normalize(self.values[tet]);
                    for i in mesh.tets()[tet] {
                        let sum = &mut sums[i as usize];
                        *sum = (sum.0 + volume * value, sum.1 + volume);
                    }
                }
                sums.into_iter().map(|(weighted, volume)| weighted / volume).collect()
            }
        }
    }
}

/// The array that a name, or no name, stands for.
fn find<'a>(mesh: &'a TetMesh, name: Option<&str>) -> Result<(Association, &'a DataArray), FieldError> {
    let points = mesh.point_data().iter().map(|a| (Association::Points, a));
    let all: Vec<_> = points.chain(mesh.cell_data().iter().map(|a| (Association::Cells, a))).collect();
    let by_name = |name: &str| all.iter().find(|(_, a)| a.name == name).copied();
    match name {
        Some(name) => by_name(name).ok_or_else(|| FieldError::Unknown {
            name: name.to_owned(),
            available: if all.is_empty() {
                "none".into()
            } else {
                all.iter().map(|(_, a)| format!("\"{}\"", a.name)).collect::<Vec<_>>().join(", ")
            },
        }),
        None => mesh
            .active_scalars()
            .and_then(by_name)
            .or_else(|| all.iter().find(|(_, a)| a.components == 1).copied())
            .or_else(|| all.first().copied())
            .ok_or(FieldError::NoArrays),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshParts, Values};
    use glam::DVec3;

    fn two_tets(point_data: Vec<DataArray>, cell_data: Vec<DataArray>) -> TetMesh {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE * 2.0];
        let tets = vec![[0, 1, 2, 3], [1, 2, 3, 4]];
        TetMesh::new(MeshParts { points, tets, point_data, cell_data, active_scalars: None, ..Default::default() }).expect("valid")
    }

    fn array(name: &str, components: usize, values: &[f64]) -> DataArray {
        DataArray { name: name.into(), components, values: Values::F64(values.to_vec()) }
    }

    #[test]
    fn a_missing_vertex_takes_exactly_its_tets_with_it() {
        let mesh = two_tets(vec![array("s", 1, &[f64::NAN, 1.0, 2.0, 3.0, f64::INFINITY])], vec![]);
        let field = ScalarField::new("s".into(), Association::Points, vec![f64::NAN, 1.0, 2.0, 3.0, 4.0]);
        assert!(!field.is_usable(&mesh, 0) && field.is_usable(&mesh, 1));
        assert_eq!(field.range, [1.0, 4.0]);
        assert!(ScalarField::select(&mesh, &FieldSelection::default()).is_err(), "both tets miss a value");
    }

    #[test]
    fn vectors_by_magnitude_or_component() {
        let mesh = two_tets(vec![array("v", 3, &[3.0, 4.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 6.0])], vec![]);
        let select = |component| ScalarField::select(&mesh, &FieldSelection { name: Some("v".into()), component });
        assert_eq!(select(Component::Magnitude).expect("magnitude").values, [5.0, 1.0, 2.0, 0.0, 6.0]);
        assert_eq!(select(Component::Index(1)).expect("y").values, [4.0, 0.0, 2.0, 0.0, 0.0]);
        assert!(matches!(select(Component::Index(3)), Err(FieldError::Component { components: 3, .. })));
    }

    #[test]
    fn cell_values_reach_points_by_volume_weighted_mean() {
        let mesh = two_tets(vec![], vec![array("c", 1, &[0.0, 1.0])]);
        let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("the only array");
        let (v0, v1) = (geometry::signed_volume(&mesh.corners(0)), geometry::signed_volume(&mesh.corners(1)));
        let points = field.at_points(&mesh);
        assert_eq!((points[0], points[4]), (0.0, 1.0));
        assert!((points[1] - v1 / (v0 + v1)).abs() < 1e-15);
    }

    #[test]
    fn values_beyond_arithmetic_are_refused() {
        let mesh = two_tets(vec![array("s", 1, &[-1.2e308, 1.2e308, 0.0, 0.0, 0.0])], vec![]);
        assert!(matches!(ScalarField::select(&mesh, &FieldSelection::default()), Err(FieldError::TooLarge { .. })));
        let long = two_tets(vec![array("v", 2, &[3e200, 4e200, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])], vec![]);
        let length = ScalarField::select(&long, &FieldSelection::default()).expect("a magnitude").values[0];
        assert!((length / 5e200 - 1.0).abs() < 1e-12, "{length}");
    }

    #[test]
    fn an_unknown_name_lists_those_there_are() {
        let mesh = two_tets(vec![array("density", 1, &[0.0; 5])], vec![]);
        let error = ScalarField::select(&mesh, &FieldSelection { name: Some("rho".into()), ..Default::default() }).expect_err("unknown");
        assert_eq!(error.to_string(), "there is no array \"rho\"; the mesh has \"density\"");
    }
}
