//! Cells of any type to tets.

use super::{CellType, DataArray, FileCells, MeshError, MeshParts, UnstructuredGrid, Values};

/// The tets of the cells that have a volume, with the arrays of those cells; all points are kept.
pub fn to_tets(grid: UnstructuredGrid) -> Result<MeshParts, MeshError> {
    let UnstructuredGrid { points, cells, point_data, cell_data, active_scalars, numbers, .. } = grid;
    let (mut tets, mut sources) = (Vec::new(), Vec::new());
    for (cell, (cell_type, corners)) in cells.iter().enumerate() {
        if let (CellType::TETRA, &[a, b, c, d]) = (cell_type, corners) {
            tets.push([a, b, c, d]);
            sources.push(cell as u32);
        }
    }
    let cell_data = cell_data.into_iter().map(|array| gathered(array, &sources)).collect();
    let numbers = sources.iter().map(|&cell| numbers.get(cell as usize).copied().unwrap_or(cell)).collect();
    let file_cells = FileCells { numbers, ..FileCells::default() };
    Ok(MeshParts { points, tets, point_data, cell_data, active_scalars, file_cells })
}

/// The tuples of an array at these places.
pub(super) fn gathered(array: DataArray, places: &[u32]) -> DataArray {
    fn take<T: Copy>(values: &[T], components: usize, places: &[u32]) -> Vec<T> {
        places.iter().flat_map(|&i| &values[i as usize * components..][..components]).copied().collect()
    }
    let values = match &array.values {
        Values::F32(values) => Values::F32(take(values, array.components, places)),
        Values::F64(values) => Values::F64(take(values, array.components, places)),
    };
    DataArray { values, ..array }
}
