//! The cells of `UNSTRUCTURED_GRID` and `POLYDATA`.

use super::{Array, Dataset, GridFile, Head, List, data};
use crate::format::voxel_data::VolumeError;
use crate::mesh::{CellType, Cells, UnstructuredGrid};
use crate::progress::Progress;
use glam::DVec3;

/// The lists of `POLYDATA`, in the order of its cells.
const POLYGONS: [&str; 4] = ["VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS"];

/// Points, cells and arrays.
pub(super) fn read(
    file: &GridFile<'_>,
    head: Head,
    arrays: &[Array],
    is_binary: bool,
    progress: &Progress,
) -> Result<UnstructuredGrid, VolumeError> {
    progress.begin("reading", file.source.len());
    let read = |array: &Array, said: &str| array.numbers(file, is_binary, said, progress);
    let points = match &head.places[..] {
        [array] => read(array, "POINTS")?.chunks_exact(3).map(DVec3::from_slice).collect(),
        [] => vec![],
        _ => return Err(VolumeError::key("POINTS", "in two places", "once")),
    };
    let mut cells = Cells::default();
    if head.dataset == Dataset::UnstructuredGrid {
        let list = head.lists.iter().find(|(keyword, _)| keyword == "CELLS");
        let types = match &head.types {
            Some(types) => read(types, "CELL_TYPES")?,
            None if list.is_none() => vec![],
            None => return Err(VolumeError::missing("CELL_TYPES", "the types of all cells")),
        };
        let mut types = types.iter();
        if let Some((keyword, list)) = list {
            list.each(keyword, &read, |nodes| {
                let expected = || VolumeError::key("CELL_TYPES", "fewer or other numbers", "a number from 0 to 255 for every cell");
                let found = types.next().filter(|t| (0.0..256.0).contains(*t)).ok_or_else(expected)?;
                push(&mut cells, CellType(*found as u8), nodes)
            })?;
        }
        if types.next().is_some() {
            return Err(VolumeError::key("CELL_TYPES", "more", format!("{} types, one for every cell", cells.len())));
        }
    } else {
        for (kind, name) in POLYGONS.iter().enumerate() {
            for (keyword, list) in head.lists.iter().filter(|(keyword, _)| keyword == name) {
                list.each(keyword, &read, |nodes| push(&mut cells, polygon(kind, nodes.len()), nodes))?;
            }
        }
    }
    let said = format!("POINTS {} and {} cells", points.len(), cells.len());
    let (point_data, cell_data) = data(file, arrays, [points.len() as u128, cells.len() as u128], is_binary, &said, progress)?;
    let notes = head.notes;
    Ok(UnstructuredGrid { points, cells, point_data, cell_data, notes, ..UnstructuredGrid::default() })
}

/// What a cell of one of [`POLYGONS`] is, by its number of points.
fn polygon(kind: usize, points: usize) -> CellType {
    match (kind, points) {
        (0, 1) => CellType::VERTEX,
        (0, _) => CellType::POLY_VERTEX,
        (1, 2) => CellType::LINE,
        (1, _) => CellType::POLY_LINE,
        (2, 3) => CellType::TRIANGLE,
        (2, 4) => CellType::QUAD,
        (2, _) => CellType::POLYGON,
        _ => CellType::TRIANGLE_STRIP,
    }
}

fn push(cells: &mut Cells, cell_type: CellType, nodes: &[u32]) -> Result<(), VolumeError> {
    cells.push(cell_type, nodes).map_err(|e| VolumeError::key("the cells", "too many", e.to_string()))
}

impl List {
    /// Shows the points of one cell after the other.
    fn each(
        &self,
        keyword: &str,
        read: &impl Fn(&Array, &str) -> Result<Vec<f64>, VolumeError>,
        mut cell: impl FnMut(&[u32]) -> Result<(), VolumeError>,
    ) -> Result<(), VolumeError> {
        let index = |v: f64| (0.0..=f64::from(u32::MAX)).contains(&v).then_some(v as u32);
        let bad = |found: String, expected: &str| VolumeError::key(keyword, &found, expected);
        let mut nodes = Vec::new();
        let mut show = |numbers: &[f64]| {
            nodes.clear();
            for &v in numbers {
                nodes.push(index(v).ok_or_else(|| bad(v.to_string(), "a point's number from 0"))?);
            }
            cell(&nodes)
        };
        match self {
            List::Counted(cells, array) => {
                let numbers = read(array, keyword)?;
                let mut rest = &numbers[..];
                for i in 0..*cells {
                    let split = rest.split_first().and_then(|(&count, behind)| behind.split_at_checked(index(count)? as usize));
                    let (own, behind) =
                        split.ok_or_else(|| bad(format!("the end of its list in cell {i}"), "as many numbers as it says"))?;
                    show(own)?;
                    rest = behind;
                }
                if rest.is_empty() { Ok(()) } else { Err(bad(format!("{} numbers more than its cells need", rest.len()), "none")) }
            }
            List::Offsets(offsets, points) => {
                let (offsets, points) = (read(offsets, keyword)?, read(points, keyword)?);
                for ends in offsets.windows(2) {
                    let range = index(ends[0]).zip(index(ends[1])).map(|(start, end)| start as usize..end as usize);
                    let own = range.and_then(|range| points.get(range));
                    show(own.ok_or_else(|| bad(format!("the offsets {} and {}", ends[0], ends[1]), "ascending ones within its points"))?)?;
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::format::{Contents, ReadOptions, read_contents};
    use crate::mesh::UnstructuredGrid;
    use crate::progress::Progress;

    fn read(bytes: &[u8]) -> Result<UnstructuredGrid, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.vtk");
        std::fs::write(&path, bytes).expect("written");
        match read_contents(&path, &ReadOptions::default(), &Progress::new()).map_err(|e| e.to_string())? {
            Contents::Cells(grid) => Ok(grid),
            other => Err(format!("{other:?}")),
        }
    }

    fn cells(grid: &UnstructuredGrid) -> Vec<(u8, Vec<u32>)> {
        grid.cells.iter().map(|(t, nodes)| (t.0, nodes.to_vec())).collect()
    }

    const OLD: &str = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 2\nTime 1 1 double\n2.5\n\
        text 1 2 string\na b\nc\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0\n0 0 1\nCELLS 2 8\n4 0 1 2 3\n2 0 1\nCELL_TYPES 2\n10 3\n\
        CELL_DATA 2\nSCALARS a%20b int\nLOOKUP_TABLE default\n7 8\nPOINT_DATA 4\nVECTORS v float\n1 2 3 4 5 6 7 8 9 nan 1 2\n";

    #[test]
    fn old_lists_and_new_ones() {
        let grid = read(OLD.as_bytes()).expect("sound");
        assert_eq!(cells(&grid), [(10, vec![0, 1, 2, 3]), (3, vec![0, 1])]);
        assert_eq!((grid.cell_data[0].name.as_str(), grid.cell_data[0].values.get(1)), ("a b", 8.0));
        assert!(grid.point_data[0].values.get(9).is_nan());
        assert_eq!(grid.notes, ["array \"text\" is of the type string and was left out"]);
        let new = OLD
            .replace("CELLS 2 8\n4 0 1 2 3\n2 0 1\n", "CELLS 3 6\nOFFSETS vtktypeint64\n0 4 6\nCONNECTIVITY vtktypeint64\n0 1 2 3 0 1\n");
        assert_eq!(cells(&read(new.as_bytes()).expect("sound")), cells(&grid));
        for (from, to, expected) in [
            ("CELLS 2 8", "CELLS 2 7", "the keyword is \"1\""),
            ("CELLS 2 8", "CELLS 3 8", "CELLS is \"the end of its list in cell 2\""),
            ("4 0 1 2 3\n", "4 0 1 2 -3\n", "CELLS is \"-3\", expected a point's number from 0"),
            ("4 0 1 2 3\n2 0 1", "9 0 1 2 3\n2 0 1", "the end of its list in cell 0"),
            ("CELL_TYPES 2\n10 3", "CELL_TYPES 2\n10 300", "CELL_TYPES is"),
            ("CELL_TYPES 2\n10 3", "", "CELL_TYPES is missing"),
            ("CELL_DATA 2", "CELL_DATA 1", "expected 2, by"),
        ] {
            let text = OLD.replace(from, to);
            assert_ne!(text, OLD);
            let error = read(text.as_bytes()).expect_err(expected);
            assert!(error.contains(expected), "{error}");
        }
        for (from, to) in [("0 4 6", "0 6 4"), ("0 4 6", "0 4 7"), ("0 4 6", "-1 4 6")] {
            assert!(read(new.replace(from, to).as_bytes()).is_err_and(|e| e.contains("ascending ones")));
        }
    }

    #[test]
    fn binary_files_with_text_and_bits() {
        let ints = |numbers: &[i32]| numbers.iter().flat_map(|n| n.to_be_bytes()).collect::<Vec<u8>>();
        let floats = |numbers: &[f32]| numbers.iter().flat_map(|n| n.to_be_bytes()).collect::<Vec<u8>>();
        let long = [&[0x80, 70][..], &[b'x'; 70]].concat();
        let parts: Vec<Vec<u8>> = vec![
            b"# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\ntext 1 2 string\n".to_vec(),
            [&[0xc2, b'h', b'i'][..], &long].concat(),
            b"\nPOINTS 4 float\n".to_vec(),
            floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]),
            b"\nCELLS 1 5\n".to_vec(),
            ints(&[4, 0, 1, 2, 3]),
            b"\nCELL_TYPES 1\n".to_vec(),
            ints(&[10]),
            b"\nPOINT_DATA 4\nSCALARS b bit\nLOOKUP_TABLE default\n".to_vec(),
            vec![0xa0],
            b"\nSCALARS s float\nLOOKUP_TABLE default\n".to_vec(),
            floats(&[1., 2., 3., 4.]),
        ];
        let grid = read(&parts.concat()).expect("sound");
        assert_eq!((grid.points.len(), grid.point_data.len(), grid.point_data[0].values.get(3)), (4, 1, 4.0));
        assert_eq!(grid.notes.len(), 2, "{:?}", grid.notes);
    }

    #[test]
    fn polygons_of_four_kinds() {
        let text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 5 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 1\n\
            POLYGONS 2 9\n3 0 1 2\n4 0 1 2 3\nLINES 1 4\n3 0 1 2\nVERTICES 1 2\n1 4\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n";
        let grid = read(text.as_bytes()).expect("sound");
        assert_eq!(grid.cells.iter().map(|(t, nodes)| (t.0, nodes.len())).collect::<Vec<_>>(), [(1, 1), (4, 3), (5, 3), (9, 4), (6, 4)]);
    }
}
