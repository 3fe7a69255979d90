//! VTK's XML formats for structured and rectilinear grids, `.vts` and `.vtr`: their hexahedra become tets ([`split_into_tets`]).
//!
//! The rules where the format leaves a choice, besides those of [`super`]: cells with a hidden point are left out (ghost bit 2), pieces are put
//! beside each other, each with points of its own on the faces where they meet.

use super::xml::{self, Kind};
use super::{ArrayError, ArrayReader, DROPPED_GHOSTS, Of, Reader, Source, VtuError};
use crate::mesh::{CellType, DataArray, MeshParts, StructuredBlock, UnstructuredGrid, split_into_tets};
use crate::progress::Progress;
use glam::DVec3;

/// The ghost bit of points that do not count.
const HIDDEN_POINT: u8 = 2;

/// Whether a file starts as a `.vts` does.
pub(in crate::format) fn recognizes_structured(start: &[u8]) -> bool {
    super::is_of_type(start, "StructuredGrid")
}

/// Whether a file starts as a `.vtr` does.
pub(in crate::format) fn recognizes_rectilinear(start: &[u8]) -> bool {
    super::is_of_type(start, "RectilinearGrid")
}

/// Reads a `.vts` file.
pub(in crate::format) fn read_structured(source: &Source<'_>, progress: &Progress) -> Result<MeshParts, VtuError> {
    read(source, Kind::StructuredGrid, progress)
}

/// Reads a `.vtr` file.
pub(in crate::format) fn read_rectilinear(source: &Source<'_>, progress: &Progress) -> Result<MeshParts, VtuError> {
    read(source, Kind::RectilinearGrid, progress)
}

/// The hexahedra of a `.vts` or `.vtr` file, as cells of their own.
pub(super) fn read_cells(source: &Source<'_>, kind: Kind, progress: &Progress) -> Result<UnstructuredGrid, VtuError> {
    let Blocks { blocks, points, point_data, cell_data, active_scalars } = read_blocks(source, kind, progress)?;
    let mut grid = UnstructuredGrid { points, point_data, active_scalars, ..UnstructuredGrid::default() };
    let (mut first, mut kept) = (0, vec![]);
    let mut first_cell = 0;
    for block in &blocks {
        for (corners, cell) in block.hexahedra(first) {
            grid.cells.push(CellType::HEXAHEDRON, &corners)?;
            kept.push(first_cell + cell);
        }
        (first, first_cell) = (first + block.points() as u32, first_cell + block.cell_count() as u32);
    }
    grid.cell_data = cell_data.into_iter().map(|array| array.gathered(&kept)).collect();
    grid.numbers = kept;
    Ok(grid)
}

/// What such a file holds.
struct Blocks {
    blocks: Vec<StructuredBlock>,
    points: Vec<DVec3>,
    point_data: Vec<DataArray>,
    cell_data: Vec<DataArray>,
    active_scalars: Option<String>,
}

fn read(source: &Source<'_>, kind: Kind, progress: &Progress) -> Result<MeshParts, VtuError> {
    let Blocks { blocks, points, point_data, cell_data, active_scalars } = read_blocks(source, kind, progress)?;
    match split_into_tets(&blocks, points, point_data, cell_data, active_scalars) {
        Ok(parts) if !parts.tets.is_empty() => Ok(parts),
        _ => Err(VtuError::NoCells),
    }
}

fn read_blocks(source: &Source<'_>, kind: Kind, progress: &Progress) -> Result<Blocks, VtuError> {
    let head = xml::read_head(source, kind)?;
    progress.begin("reading", source.len());
    let reader = Reader { arrays: ArrayReader { source, head: &head, progress }, head: &head };
    reader.check_counts()?;
    let (mut blocks, mut points) = (Vec::new(), Vec::new());
    let (mut point_data, mut cell_data) = (reader.common_arrays(Of::Points)?, reader.common_arrays(Of::Cells)?);
    for (index, piece) in head.pieces.iter().enumerate() {
        match kind {
            Kind::RectilinearGrid => reader.append_lattice(index, &mut points)?,
            _ => reader.append_points(index, &mut points)?,
        }
        let [x0, x1, y0, y1, z0, z1] = piece.extent;
        let mut block = StructuredBlock::new([x1 - x0, y1 - y0, z1 - z0].map(|n| n as usize + 1));
        block.starts_odd = (x0 + y0 + z0).rem_euclid(2) == 1;
        let blanked = |kept: Option<Vec<bool>>| kept.unwrap_or_default().iter().map(|kept| !kept).collect();
        block.blanked = blanked(reader.kept(index, Of::Points, HIDDEN_POINT)?);
        block.blanked_cells = if piece.cells > 0 { blanked(reader.kept(index, Of::Cells, DROPPED_GHOSTS)?) } else { vec![] };
        blocks.push(block);
        for (of, arrays) in [(Of::Points, &mut point_data), (Of::Cells, &mut cell_data)] {
            if of.count(piece) > 0 {
                let by_name = of.section(piece).by_name();
                arrays.iter_mut().try_for_each(|array| reader.append_data(index, of, by_name[array.name.as_str()], array, None))?;
            }
        }
    }
    let active_scalars = reader.active_scalars(&point_data, &cell_data);
    Ok(Blocks { blocks, points, point_data, cell_data, active_scalars })
}

impl Reader<'_> {
    /// Appends the points of a rectilinear piece: all combinations of the coordinates along three axes.
    fn append_lattice(&self, index: usize, points: &mut Vec<DVec3>) -> Result<(), VtuError> {
        let piece = &self.head.pieces[index];
        let missing =
            || VtuError::Missing { piece: self.piece_name(index), array: "in <Coordinates> for each axis".into(), items: 3, of: "axes" };
        let mut along: [Vec<f64>; 3] = Default::default();
        for (axis, coordinates) in along.iter_mut().enumerate() {
            let array = piece.coordinates.get(axis).ok_or_else(missing)?;
            let failed = |e: ArrayError| self.error(index, &format!("array {} in <Coordinates>", axis + 1), e);
            if let Some(found) = array.components.filter(|&found| found != 1) {
                return Err(failed(ArrayError::Components { found, expected: 1 }));
            }
            let count = (piece.extent[2 * axis + 1] - piece.extent[2 * axis]) as u64 + 1;
            self.arrays.append(array, count, coordinates).map_err(failed)?;
        }
        let [xs, ys, zs] = &along;
        points.extend(zs.iter().flat_map(|&z| ys.iter().flat_map(move |&y| xs.iter().map(move |&x| DVec3::new(x, y, z)))));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry;

    fn text(numbers: impl IntoIterator<Item = f64>) -> String {
        numbers.into_iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" ")
    }

    fn array(name: &str, components: usize, numbers: impl IntoIterator<Item = f64>) -> String {
        format!("<DataArray type='Float64' Name='{name}' NumberOfComponents='{components}' format='ascii'>{}</DataArray>", text(numbers))
    }

    /// A piece of a sheared grid of i, j, k from `first` to `last`; point data are i + 10 j + 100 k, cell data their number.
    fn piece(first: [i64; 3], last: [i64; 3], ghosts: &str) -> String {
        let all = |last: [i64; 3]| {
            (first[2]..=last[2])
                .flat_map(move |k| (first[1]..=last[1]).flat_map(move |j| (first[0]..=last[0]).map(move |i| [i, j, k].map(|n| n as f64))))
        };
        let points = all(last).flat_map(|[i, j, k]| [i + 0.5 * j, j - 0.25 * k, -k]);
        let cells = all(last.map(|n| n - 1)).count();
        format!(
            "<Piece Extent='{} {} {} {} {} {}'><PointData>{}{ghosts}</PointData><CellData>{}</CellData><Points>{}</Points></Piece>",
            first[0],
            last[0],
            first[1],
            last[1],
            first[2],
            last[2],
            array("n", 1, all(last).map(|[i, j, k]| i + 10.0 * j + 100.0 * k)),
            array("c", 1, (0..cells).map(|n| n as f64)),
            array("", 3, points)
        )
    }

    fn file(kind: &str, pieces: &str) -> String {
        format!("<VTKFile type=\"{kind}\" version=\"1.0\"><{kind} WholeExtent='0 4 0 3 0 2'>{pieces}</{kind}></VTKFile>")
    }

    fn structured(pieces: &str) -> Result<MeshParts, VtuError> {
        read_structured(&Source::Bytes(file("StructuredGrid", pieces).as_bytes()), &Progress::new())
    }

    fn volume(parts: &MeshParts) -> f64 {
        parts.tets.iter().map(|tet| geometry::signed_volume(&tet.map(|i| parts.points[i as usize]))).sum()
    }

    #[test]
    fn hexahedra_become_tets_with_their_arrays() {
        let parts = structured(&piece([0; 3], [4, 3, 2], "")).expect("sound");
        assert_eq!((parts.points.len(), parts.tets.len()), (60, 5 * 24));
        assert!((volume(&parts) - 24.0).abs() < 1e-12, "a parallelepiped of the left hand");
        assert_eq!((parts.point_data[0].values.get(59), parts.cell_data[0].values.get(119)), (234.0, 23.0));
    }

    #[test]
    fn pieces_meet_in_the_same_diagonals() {
        // Cut between i = 1 and 2, where a split by each piece's own numbers would turn its diagonals round.
        let parts = structured(&(piece([0; 3], [1, 3, 2], "") + &piece([1, 0, 0], [4, 3, 2], ""))).expect("sound");
        assert_eq!((parts.points.len(), parts.tets.len()), (24 + 48, 5 * 24));
        let mut faces = std::collections::HashMap::new();
        for tet in &parts.tets {
            for face in geometry::FACES {
                let mut key = face.map(|c| parts.points[tet[c] as usize].to_array().map(f64::to_bits));
                key.sort_unstable();
                *faces.entry(key).or_insert(0) += 1;
            }
        }
        assert_eq!(faces.values().filter(|&&uses| uses == 1).count(), 2 * 2 * (12 + 8 + 6), "only the outside is open");
    }

    #[test]
    fn hidden_points_take_their_cells_with_them() {
        let ghosts = format!("<DataArray type='UInt8' Name='vtkGhostType' format='ascii'>2 {}</DataArray>", "0 ".repeat(59));
        let parts = structured(&piece([0; 3], [4, 3, 2], &ghosts)).expect("sound");
        assert_eq!((parts.points.len(), parts.tets.len(), parts.point_data.len()), (59, 5 * 23, 1));
        let all = format!("<DataArray type='UInt8' Name='vtkGhostType' format='ascii'>{}</DataArray>", "2 ".repeat(60));
        assert!(structured(&piece([0; 3], [4, 3, 2], &all)).is_err_and(|e| e.to_string().contains("no cell with a volume")));
    }

    #[test]
    fn rectilinear_grids_are_lattices() {
        let coordinates =
            |z: &str| format!("<Coordinates>{}{}{z}</Coordinates>", array("x", 1, [0.0, 1.0, 4.0]), array("y", 1, [5.0, 7.0]));
        let of = |coordinates: &str| {
            let piece = format!(
                "<Piece Extent='0 2 0 1 0 1'><PointData>{}</PointData>{coordinates}</Piece>",
                array("n", 1, (0..12).map(f64::from))
            );
            read_rectilinear(&Source::Bytes(file("RectilinearGrid", &piece).as_bytes()), &Progress::new())
        };
        let parts = of(&coordinates(&array("z", 1, [-1.0, 2.0]))).expect("sound");
        assert_eq!((parts.points[5], parts.points[11], parts.tets.len()), (DVec3::new(4.0, 7.0, -1.0), DVec3::new(4.0, 7.0, 2.0), 10));
        assert!((volume(&parts) - 24.0).abs() < 1e-12);
        for (broken, expected) in [
            (coordinates(""), "no array in <Coordinates> for each axis"),
            (coordinates(&array("z", 1, [1.0])), "array 3 in <Coordinates> holds 1 numbers, expected 2"),
            (coordinates(&array("z", 3, [1.0; 6])), "array 3 in <Coordinates>"),
        ] {
            let error = of(&broken).expect_err("broken").to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn what_is_broken_is_named() {
        for (pieces, expected) in [
            ("<Piece Extent='0 4 0 3 0'></Piece>".to_owned(), "Extent"),
            ("<Piece Extent='0 4 0 3 0 2'></Piece>".to_owned(), "no array in <Points>"),
            ("<Piece Extent='0 4000000 0 4000000 0 4000000'></Piece>".to_owned(), "more than the"),
            (piece([0; 3], [4, 3, 2], "").replace("Extent='0 4", "Extent='0 5"), "expected"),
            (piece([0, 0, 1], [4, 3, 1], ""), "no cell with a volume"),
            (String::new(), "no cell with a volume"),
        ] {
            let error = structured(&pieces).expect_err("broken").to_string();
            assert!(error.contains(expected), "\"{error}\" does not say \"{expected}\"");
        }
        let other = file("RectilinearGrid", "");
        let error = read_structured(&Source::Bytes(other.as_bytes()), &Progress::new()).expect_err("another kind").to_string();
        assert!(error.contains("this is not a .vts file"), "{error}");
        assert!(recognizes_rectilinear(other.as_bytes()) && !recognizes_structured(other.as_bytes()));
        assert!(recognizes_structured(file("StructuredGrid", "").as_bytes()));
        assert!(!recognizes_structured(b"<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>"));
    }
}
