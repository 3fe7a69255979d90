//! How well the tets of a mesh are shaped: the metrics of Verdict (<https://github.com/sandialabs/verdict>, the library behind VTK's
//! `vtkMeshQuality`) by their definitions, and fTetWild's energy.

mod formulas;
mod metric;
mod summary;
#[cfg(test)]
mod tests;
mod values;
mod with_values;

use super::{Association, FieldError, ScalarField, TetMesh};
use crate::progress::Progress;
pub use metric::{Acceptable, Metric, UnknownMetric, Worse};
pub use summary::{Bin, Summary, WorstCell};
pub use values::{Rule, of_tet, values, values_into};
pub use with_values::WithValues;

/// What the names of fields that are metrics begin with: `quality:shape` is one for each mesh.
pub const PREFIX: &str = "quality:";

/// The name of the field that a metric is.
pub fn field_name(metric: Metric) -> String {
    format!("{PREFIX}{metric}")
}

/// The field that a name stands for, if it is a metric's; infinite values are missing.
pub(super) fn field(mesh: &TetMesh, name: &str) -> Option<Result<ScalarField, FieldError>> {
    let metric: Result<Metric, _> = name.strip_prefix(PREFIX)?.parse();
    Some(metric.map_err(FieldError::Metric).map(|metric| {
        let values = values(mesh, metric, Rule::Definition, &Progress::new()).unwrap_or_default(); // nobody cancels it
        ScalarField::new(field_name(metric), Association::Cells, values)
    }))
}
