//! Meshes that come layer by layer: what generators make and writers consume, so that a mesh larger than memory can reach a file.

use super::{DataArray, MeshError, MeshParts, TetMesh, Values};
use glam::DVec3;

/// How an array's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floats.
    F32,
    /// 64-bit floats.
    F64,
}

impl Precision {
    /// Bytes a number takes.
    pub fn bytes(self) -> u64 {
        match self {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }
}

/// The shape of an array, known before any of its numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArrayLayout {
    /// The array's name.
    pub name: String,
    /// Numbers per point or tet, at least 1.
    pub components: usize,
    /// How each number is stored.
    pub precision: Precision,
}

/// A tet mesh made one layer at a time. All layers together give every point, tet and tuple once, in index order; any layer may be
/// asked for at any time and always gives the same, so that memory holds one layer only.
pub trait LayeredMesh: Send + Sync {
    /// Points in all layers.
    fn point_count(&self) -> u64;

    /// Tets in all layers.
    fn tet_count(&self) -> u64;

    /// How many layers there are. A layer may have points only, or tets only.
    fn layer_count(&self) -> usize;

    /// How positions are worth storing.
    fn position_precision(&self) -> Precision;

    /// A layer's points in world coordinates.
    fn points(&self, layer: usize) -> Vec<DVec3>;

    /// A layer's tets, positive in VTK's order, as indices into the points of the whole mesh.
    fn tets(&self, layer: usize) -> Vec<[u32; 4]>;

    /// The point arrays.
    fn point_arrays(&self) -> Vec<ArrayLayout>;

    /// A layer's part of point array `array`, in that array's precision.
    fn point_values(&self, array: usize, layer: usize) -> Values;

    /// The cell arrays; none unless a mesh says otherwise.
    fn cell_arrays(&self) -> Vec<ArrayLayout> {
        Vec::new()
    }

    /// A layer's part of cell array `array`, in that array's precision.
    fn cell_values(&self, array: usize, layer: usize) -> Values {
        unreachable!("cell array {array}, layer {layer}: this mesh lists no cell arrays")
    }

    /// The array to show unless another is asked for.
    fn active_scalars(&self) -> Option<&str>;
}

/// Brings all layers together in memory.
pub fn collect(mesh: &dyn LayeredMesh) -> Result<TetMesh, MeshError> {
    for (what, count) in [("points", mesh.point_count()), ("tets", mesh.tet_count())] {
        if count >= u64::from(u32::MAX) {
            return Err(MeshError::TooMany { what, count: count as usize });
        }
    }
    let layers = 0..mesh.layer_count();
    let gather = |layout: ArrayLayout, part: &dyn Fn(usize) -> Values| {
        let values = match layout.precision {
            Precision::F32 => Values::F32(layers.clone().flat_map(|layer| to_f32(part(layer))).collect()),
            Precision::F64 => Values::F64(layers.clone().flat_map(|layer| to_f64(part(layer))).collect()),
        };
        DataArray { name: layout.name, components: layout.components, values }
    };
    let gather_all = |layouts: Vec<ArrayLayout>, part: &dyn Fn(usize, usize) -> Values| {
        layouts.into_iter().enumerate().map(|(array, layout)| gather(layout, &|layer| part(array, layer))).collect()
    };
    TetMesh::new(MeshParts {
        points: layers.clone().flat_map(|layer| mesh.points(layer)).collect(),
        tets: layers.clone().flat_map(|layer| mesh.tets(layer)).collect(),
        point_data: gather_all(mesh.point_arrays(), &|array, layer| mesh.point_values(array, layer)),
        cell_data: gather_all(mesh.cell_arrays(), &|array, layer| mesh.cell_values(array, layer)),
        active_scalars: mesh.active_scalars().map(str::to_owned),
        ..MeshParts::default()
    })
}

fn to_f32(values: Values) -> Vec<f32> {
    match values {
        Values::F32(values) => values,
        Values::F64(values) => values.into_iter().map(|v| v as f32).collect(),
    }
}

fn to_f64(values: Values) -> Vec<f64> {
    match values {
        Values::F32(values) => values.into_iter().map(f64::from).collect(),
        Values::F64(values) => values,
    }
}

/// Points, and tets, per layer of a mesh that lies in memory.
pub(super) const CHUNK: usize = 1 << 16;

/// The part of `items` that belongs to a layer, `stride` items a point or tet.
fn chunk<T>(items: &[T], layer: usize, stride: usize) -> &[T] {
    let at = |layer: usize| (layer * CHUNK * stride).min(items.len());
    &items[at(layer)..at(layer + 1)]
}

fn array_chunk(array: &DataArray, layer: usize) -> Values {
    match &array.values {
        Values::F32(values) => Values::F32(chunk(values, layer, array.components).to_vec()),
        Values::F64(values) => Values::F64(chunk(values, layer, array.components).to_vec()),
    }
}

fn layouts(arrays: &[DataArray]) -> Vec<ArrayLayout> {
    let precision = |values: &Values| if matches!(values, Values::F32(_)) { Precision::F32 } else { Precision::F64 };
    arrays.iter().map(|a| ArrayLayout { name: a.name.clone(), components: a.components, precision: precision(&a.values) }).collect()
}

/// A mesh in memory, handed on in chunks of equal size.
impl LayeredMesh for TetMesh {
    fn point_count(&self) -> u64 {
        TetMesh::points(self).len() as u64
    }

    fn tet_count(&self) -> u64 {
        TetMesh::tets(self).len() as u64
    }

    fn layer_count(&self) -> usize {
        TetMesh::points(self).len().max(TetMesh::tets(self).len()).div_ceil(CHUNK)
    }

    fn position_precision(&self) -> Precision {
        Precision::F64
    }

    fn points(&self, layer: usize) -> Vec<DVec3> {
        chunk(TetMesh::points(self), layer, 1).iter().map(|&p| p + self.center()).collect()
    }

    fn tets(&self, layer: usize) -> Vec<[u32; 4]> {
        chunk(TetMesh::tets(self), layer, 1).to_vec()
    }

    fn point_arrays(&self) -> Vec<ArrayLayout> {
        layouts(self.point_data())
    }

    fn point_values(&self, array: usize, layer: usize) -> Values {
        array_chunk(&self.point_data()[array], layer)
    }

    fn cell_arrays(&self) -> Vec<ArrayLayout> {
        layouts(self.cell_data())
    }

    fn cell_values(&self, array: usize, layer: usize) -> Values {
        array_chunk(&self.cell_data()[array], layer)
    }

    fn active_scalars(&self) -> Option<&str> {
        TetMesh::active_scalars(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_in_memory_survives_its_layers() {
        let count = CHUNK + 7;
        let points: Vec<DVec3> = (0..count).map(|i| DVec3::new(i as f64, (i % 3) as f64, (i % 7 / 3) as f64)).collect();
        let tets = (0..count as u32 - 3).map(|i| [i, i + 1, i + 2, i + 3]).collect::<Vec<_>>();
        let array = |name: &str, components, values| DataArray { name: name.into(), components, values };
        let point_data = vec![array("v", 2, Values::F64((0..2 * count).map(|i| i as f64).collect()))];
        let cell_data = vec![array("c", 1, Values::F32((0..tets.len()).map(|i| i as f32).collect()))];
        let mesh = TetMesh::new(MeshParts { points, tets, point_data, cell_data, active_scalars: Some("c".into()), ..Default::default() })
            .expect("valid");
        assert_eq!(mesh.layer_count(), 2);
        let again = collect(&mesh).expect("valid");
        assert_eq!((again.points(), again.tets(), again.center()), (mesh.points(), mesh.tets(), mesh.center()));
        assert_eq!((again.point_data(), again.cell_data()), (mesh.point_data(), mesh.cell_data()));
        assert_eq!(again.active_scalars(), Some("c"));
    }
}
