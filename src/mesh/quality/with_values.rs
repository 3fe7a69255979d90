//! A mesh with metrics of its tets as arrays.

use super::{Metric, field_name};
use crate::mesh::layered::CHUNK;
use crate::mesh::{ArrayLayout, LayeredMesh, Precision, TetMesh, Values};
use glam::DVec3;

/// A mesh and metrics of its tets, to be written: tets stand as the file had them, inverted or not.
pub struct WithValues<'a> {
    /// The mesh.
    pub mesh: &'a TetMesh,
    /// Metrics with a value for each tet.
    pub metrics: Vec<(Metric, Vec<f64>)>,
}

impl LayeredMesh for WithValues<'_> {
    fn point_count(&self) -> u64 {
        self.mesh.point_count()
    }

    fn tet_count(&self) -> u64 {
        self.mesh.tet_count()
    }

    fn layer_count(&self) -> usize {
        self.mesh.layer_count()
    }

    fn position_precision(&self) -> Precision {
        self.mesh.position_precision()
    }

    fn points(&self, layer: usize) -> Vec<DVec3> {
        LayeredMesh::points(self.mesh, layer)
    }

    fn tets(&self, layer: usize) -> Vec<[u32; 4]> {
        let mut tets = LayeredMesh::tets(self.mesh, layer);
        let first = layer * CHUNK;
        if self.mesh.inverted_count() > 0 {
            tets.iter_mut().enumerate().filter(|(i, _)| self.mesh.is_inverted(first + i)).for_each(|(_, tet)| tet.swap(2, 3));
        }
        tets
    }

    fn point_arrays(&self) -> Vec<ArrayLayout> {
        self.mesh.point_arrays()
    }

    fn point_values(&self, array: usize, layer: usize) -> Values {
        self.mesh.point_values(array, layer)
    }

    fn cell_arrays(&self) -> Vec<ArrayLayout> {
        let layout = |metric: Metric| ArrayLayout { name: field_name(metric), components: 1, precision: Precision::F64 };
        let own = self.mesh.cell_arrays().into_iter();
        own.chain(self.metrics.iter().map(|(metric, _)| layout(*metric))).collect()
    }

    fn cell_values(&self, array: usize, layer: usize) -> Values {
        let own = self.mesh.cell_data().len();
        let Some(metric) = array.checked_sub(own) else { return self.mesh.cell_values(array, layer) };
        let values = &self.metrics[metric].1;
        let at = |layer: usize| (layer * CHUNK).min(values.len());
        Values::F64(values[at(layer)..at(layer + 1)].to_vec())
    }

    fn active_scalars(&self) -> Option<&str> {
        LayeredMesh::active_scalars(self.mesh)
    }
}
