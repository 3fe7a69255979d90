//! Writing cells of any type as `.vtu`, in the layout of [`super::write`]. Polyhedra have their faces in `faces` and `faceoffsets`, which every
//! version of VTK reads.

use super::write::{Compression, TAIL, WriteError, finished, zlib_blocks};
use crate::image::write_atomically;
use crate::mesh::{CellType, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use quick_xml::escape::escape;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// An array as it goes into the file.
struct Stored<'a> {
    section: &'static str,
    vtk_type: &'static str,
    name: &'a str,
    components: usize,
    /// Its numbers, little-endian.
    bytes: Vec<u8>,
}

/// Writes points, cells and arrays. The file is gathered in memory before it is written.
pub fn write_grid(path: &Path, grid: &UnstructuredGrid, compression: Compression, progress: &Progress) -> Result<(), WriteError> {
    let arrays = arrays(grid);
    progress.begin("writing", arrays.iter().map(|array| array.bytes.len() as u64).sum());
    let stored = |array: &Stored<'_>| -> io::Result<Vec<u8>> {
        progress.check().map_err(io::Error::other)?;
        progress.add(array.bytes.len() as u64);
        match compression {
            Compression::Zlib => zlib_blocks(&array.bytes),
            Compression::None => Ok([&(array.bytes.len() as u64).to_le_bytes()[..], &array.bytes].concat()),
        }
    };
    let written = write_atomically(path, |out| {
        let blocks: Vec<Vec<u8>> = arrays.iter().map(stored).collect::<io::Result<_>>()?;
        out.write_all(head(grid, &arrays, &blocks, compression).as_bytes())?;
        blocks.iter().try_for_each(|block| out.write_all(block))?;
        out.write_all(TAIL)
    });
    finished(path, written)
}

fn head(grid: &UnstructuredGrid, arrays: &[Stored<'_>], blocks: &[Vec<u8>], compression: Compression) -> String {
    let compressor = if compression == Compression::Zlib { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let mut xml = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"\
         {compressor}>\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        grid.points.len(),
        grid.cells.len()
    );
    for section in ["PointData", "CellData", "Points", "Cells"] {
        let is_active = |array: &&Stored<'_>| array.section == section && Some(array.name) == grid.active_scalars.as_deref();
        let active = arrays.iter().find(is_active).filter(|_| section.ends_with("Data"));
        let scalars = active.map(|array| format!(" Scalars=\"{}\"", escape(printable(array.name).as_str()))).unwrap_or_default();
        let _ = writeln!(xml, "      <{section}{scalars}>");
        let mut offset = 0;
        for (array, block) in arrays.iter().zip(blocks) {
            if array.section == section {
                let _ = writeln!(
                    xml,
                    "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>",
                    array.vtk_type,
                    escape(printable(array.name).as_str()),
                    array.components
                );
            }
            offset += block.len();
        }
        let _ = writeln!(xml, "      </{section}>");
    }
    xml + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _"
}

/// A name as XML can have it.
fn printable(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '_' } else { c }).collect()
}

fn arrays(grid: &UnstructuredGrid) -> Vec<Stored<'_>> {
    let mut all: Vec<Stored<'_>> = Vec::new();
    for (section, data) in [("PointData", &grid.point_data), ("CellData", &grid.cell_data)] {
        all.extend(data.iter().map(|array| of_data(section, array)));
    }
    let new = |section, vtk_type, name, components, bytes| Stored { section, vtk_type, name, components, bytes };
    let points = grid.points.iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect();
    all.push(new("Points", "Float64", "Points", 3, points));
    let (mut connectivity, mut ends, mut types, mut faces, mut face_ends) = (vec![], vec![], vec![], vec![], vec![]);
    for (cell_type, nodes) in grid.cells.iter() {
        types.push(cell_type.0);
        if cell_type == CellType::POLYHEDRON {
            let mut corners = corners(nodes);
            corners.sort_unstable();
            corners.dedup();
            connectivity.extend(corners);
            faces.extend_from_slice(nodes);
            face_ends.push(faces.len() as i64);
        } else {
            connectivity.extend_from_slice(nodes);
            face_ends.push(-1);
        }
        ends.push(connectivity.len() as i64);
    }
    let indices = |numbers: &[u32]| numbers.iter().flat_map(|&n| i64::from(n).to_le_bytes()).collect::<Vec<u8>>();
    let longs = |numbers: &[i64]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    all.push(new("Cells", "Int64", "connectivity", 1, indices(&connectivity)));
    all.push(new("Cells", "Int64", "offsets", 1, longs(&ends)));
    all.push(new("Cells", "UInt8", "types", 1, types));
    if !faces.is_empty() {
        all.push(new("Cells", "Int64", "faces", 1, indices(&faces)));
        all.push(new("Cells", "Int64", "faceoffsets", 1, longs(&face_ends)));
    }
    all
}

fn of_data<'a>(section: &'static str, array: &'a DataArray) -> Stored<'a> {
    let (vtk_type, bytes) = match &array.values {
        Values::F32(values) => ("Float32", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        Values::F64(values) => ("Float64", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
    };
    Stored { section, vtk_type, name: &array.name, components: array.components, bytes }
}

/// The points in a polyhedron's stream of faces.
fn corners(stream: &[u32]) -> Vec<u32> {
    let (mut all, mut rest) = (Vec::new(), stream.get(1..).unwrap_or_default());
    while let Some((&count, behind)) = rest.split_first() {
        let (face, behind) = behind.split_at(behind.len().min(count as usize));
        all.extend_from_slice(face);
        rest = behind;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Contents, ReadOptions, read_contents};
    use crate::mesh::Cells;
    use glam::DVec3;

    #[test]
    fn what_is_written_is_read_again() {
        let mut cells = Cells::default();
        cells.push(CellType::TETRA, &[0, 1, 2, 3]).expect("few");
        cells.push(CellType::POLYHEDRON, &[4, 3, 0, 1, 2, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3]).expect("few");
        cells.push(CellType::TRIANGLE, &[0, 1, 2]).expect("few");
        let array = |name: &str, components, values| DataArray { name: name.into(), components, values };
        let grid = UnstructuredGrid {
            points: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z * 1e-7],
            cells,
            point_data: vec![array("a<b", 1, Values::F64(vec![1.0, f64::NAN, 3.0, 4.0]))],
            cell_data: vec![array("c", 2, Values::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))],
            active_scalars: Some("a<b".into()),
            ..Default::default()
        };
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.vtu");
        for compression in [Compression::None, Compression::Zlib] {
            write_grid(&path, &grid, compression, &Progress::new()).expect("written");
            let Ok(Contents::Cells(again)) = read_contents(&path, &ReadOptions::default(), &Progress::new()) else { panic!("cells") };
            assert_eq!((&again.cells, &again.points, &again.active_scalars), (&grid.cells, &grid.points, &grid.active_scalars));
            assert_eq!(again.cell_data, grid.cell_data);
            assert!(again.point_data[0].values.get(1).is_nan() && again.point_data[0].values.get(3) == 4.0);
        }
    }
}
