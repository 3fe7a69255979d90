//! TetGen's `.node` and `.ele`, opened by either name (<https://wias-berlin.de/software/tetgen/fformats.html>).
//!
//! ```text
//! .node:  points dimension attributes markers(0 or 1)      .ele:  cells points-of-each attributes(0 or 1)
//!         number x y z  attributes  marker                        number points  attributes
//! ```
//!
//! - Points are counted from 0 or 1: the first number says. Any other numbers are taken too.
//! - Arrays are named as meshio does: `tetgen:attr1` and on for attributes of points, `tetgen:ref` for their boundary marker, and
//!   `tetgen:ref`, `tetgen:ref2` and on for attributes of cells.
//! - 10 points make quadratic tetrahedra; which edge each extra point lies on is seen from the first cell's coordinates.
//! - Triangle's files of two dimensions are the same, with triangles of 3 or 6 points.

use super::GridFile;
use super::parse::{ParseError, Tags, Words, all_of, content, real_numbers, whole_numbers};
use crate::mesh::{CellType, Cells, DataArray, UnstructuredGrid};
use crate::progress::Progress;
use glam::DVec3;
use std::iter;
use std::path::Path;

/// Numbers between two looks at the progress.
const CHECKED: usize = 4096;

/// Reads a mesh.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let own = all_of(file)?;
    let is_cells = file.path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("ele"));
    let other = other_name(file.path, if is_cells { "node" } else { "ele" });
    let named = |problem| ParseError::Other { file: other.file_name().unwrap_or_default().into(), problem: Box::new(problem) };
    let second = content(&other).map_err(named)?;
    progress.begin("reading", (own.len() + second.len()) as u64);
    let (points, cells): (&[u8], &[u8]) = if is_cells { (&second, &own) } else { (&own, &second) };
    let points = read_points(points, progress).map_err(|problem| if is_cells { named(problem) } else { problem })?;
    read_cells(points, cells, progress).map_err(|problem| if is_cells { problem } else { named(problem) })
}

/// What the two files of a mesh make, one behind the other with `cut` bytes in the first.
#[cfg(test)]
pub(super) fn read_both(bytes: &[u8], cut: usize) -> Result<UnstructuredGrid, ParseError> {
    let (points, cells) = bytes.split_at(cut.min(bytes.len()));
    read_cells(read_points(points, &Progress::new())?, cells, &Progress::new())
}

/// The name of the other file: the same, with another suffix, in capitals if the suffix was.
fn other_name(path: &Path, suffix: &str) -> std::path::PathBuf {
    let is_upper = path.extension().is_some_and(|own| own.to_string_lossy().chars().all(|c| c.is_ascii_uppercase()));
    path.with_extension(if is_upper { suffix.to_ascii_uppercase() } else { suffix.into() })
}

/// What a `.node` file holds.
struct Points {
    dimension: usize,
    points: Vec<DVec3>,
    tags: Tags,
    arrays: Vec<DataArray>,
}

fn read_points(bytes: &[u8], progress: &Progress) -> Result<Points, ParseError> {
    let mut words = Words::with_comments(bytes, b'#');
    let count: u64 = words.integer("a count of points")?;
    let dimension: usize = words.integer("a dimension")?;
    if !(2..=3).contains(&dimension) {
        return Err(ParseError::invalid(words.place(), format!("dimension {dimension}"), "2 or 3"));
    }
    let attributes: usize = words.integer("a count of attributes")?;
    let markers: usize = words.integer("a count of markers")?;
    let count = room(&words, count, [1 + dimension, attributes, markers], "points")?;
    if count == 0 {
        return Err(ParseError::invalid(words.place(), "no points", "points (those of a .poly or .smesh are not read)"));
    }
    let mut tags = Vec::with_capacity(count);
    let mut points = Vec::with_capacity(count);
    let mut values = Columns::new(attributes + markers, count);
    for i in 0..count {
        check(i, &words, progress, count)?;
        tags.push(words.integer("the number of a point")?);
        let mut point = [0.0; 3];
        for coordinate in &mut point[..dimension] {
            *coordinate = words.real("a coordinate")?;
        }
        points.push(DVec3::from_array(point));
        values.read(&mut words, "an attribute or marker of a point")?;
    }
    let mut arrays = Vec::new();
    for (i, column) in values.columns.into_iter().enumerate() {
        arrays.push(if i < attributes {
            real_numbers(&format!("tetgen:attr{}", i + 1), 1, column)
        } else {
            whole_numbers(&reference(i - attributes), &column)
        });
    }
    ended(&mut words, count, "points")?;
    Ok(Points { dimension, points, tags: Tags::new(&tags), arrays })
}

fn read_cells(points: Points, bytes: &[u8], progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let mut words = Words::with_comments(bytes, b'#');
    let count: u64 = words.integer("a count of cells")?;
    let corners: usize = words.integer("a count of points of each cell")?;
    let attributes: usize = words.integer("a count of attributes")?;
    let cell_type = match (points.dimension, corners) {
        (3, 4) => CellType::TETRA,
        (3, 10) => CellType::QUADRATIC_TETRA,
        (2, 3) => CellType::TRIANGLE,
        (2, 6) => CellType::QUADRATIC_TRIANGLE,
        (dimension, corners) => {
            let found = format!("cells of {corners} points in {dimension} dimensions");
            return Err(ParseError::invalid(words.place(), found, "4 or 10 points in 3 dimensions, 3 or 6 in 2"));
        }
    };
    let count = room(&words, count, [1 + corners, attributes, 0], "cells")?;
    let mut notes = Vec::new();
    let mut cells = Cells::with_capacity(count, count * corners);
    let mut values = Columns::new(attributes, count);
    let mut order = None;
    let mut cell_type = cell_type;
    for i in 0..count {
        check(i, &words, progress, count)?;
        let number: u64 = words.integer("the number of a cell")?;
        let mut found = [0; 10];
        for place in &mut found[..corners] {
            let point = words.integer("a point of a cell")?;
            let missing =
                || ParseError::invalid(format!("{}, cell {number}", words.place()), format!("point {point}"), "a point of the .node file");
            *place = points.tags.find(point).ok_or_else(missing)?;
        }
        let order = order.get_or_insert_with(|| edge_order(&points.points, &found[..corners]));
        if order.is_empty() {
            cell_type = if corners == 10 { CellType::TETRA } else { CellType::TRIANGLE };
            *order = (0..if corners == 10 { 4 } else { 3 }).collect();
            notes.push(format!("cells of {corners} points have only their corners here: it is not clear on which edges the others lie"));
        }
        let mut cell = [0; 10];
        cell.iter_mut().zip(&*order).for_each(|(place, &i)| *place = found[i]);
        cells.push(cell_type, &cell[..order.len()])?;
        values.read(&mut words, "an attribute of a cell")?;
    }
    ended(&mut words, count, "cells")?;
    let repeated = points.tags.repeated();
    if repeated > 0 {
        notes.push(format!("{repeated} points have a number that another has; cells use the first"));
    }
    let cell_data = values.columns.iter().enumerate().map(|(i, column)| whole_numbers(&reference(i), column)).collect();
    Ok(UnstructuredGrid { points: points.points, cells, point_data: points.arrays, cell_data, notes, ..UnstructuredGrid::default() })
}

/// Where the points of a cell in VTK's order stand in the file's, from where a cell's points lie; nothing if that is not clear.
fn edge_order(points: &[DVec3], cell: &[u32]) -> Vec<usize> {
    const EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)];
    let corners = if cell.len() > 6 { 4 } else { 3 };
    let mut order: Vec<usize> = (0..corners).collect();
    let at = |i: usize| points[cell[i] as usize];
    for &(a, b) in &EDGES[..cell.len() - corners] {
        let middle = (at(a) + at(b)) / 2.0;
        let nearest = (corners..cell.len()).min_by(|&i, &j| at(i).distance(middle).total_cmp(&at(j).distance(middle)));
        match nearest {
            Some(nearest) if !order.contains(&nearest) => order.push(nearest),
            _ => return Vec::new(),
        }
    }
    order
}

/// Columns of numbers behind what comes first on each line.
struct Columns {
    columns: Vec<Vec<f64>>,
}

impl Columns {
    fn new(count: usize, lines: usize) -> Self {
        Columns { columns: iter::repeat_with(|| Vec::with_capacity(lines)).take(count).collect() }
    }

    fn read(&mut self, words: &mut Words<'_>, what: &str) -> Result<(), ParseError> {
        for column in &mut self.columns {
            column.push(words.real(what)?);
        }
        Ok(())
    }
}

/// meshio's name of a marker or an attribute of cells.
fn reference(i: usize) -> String {
    if i == 0 { "tetgen:ref".into() } else { format!("tetgen:ref{}", i + 1) }
}

/// Checks a count of lines of so many numbers against what is left of the text.
fn room(words: &Words<'_>, count: u64, numbers: [usize; 3], what: &str) -> Result<usize, ParseError> {
    let each = numbers.into_iter().fold(0u64, |sum, n| sum.saturating_add(n as u64));
    if count.max(1).saturating_mul(each).saturating_mul(2) > words.rest().len() as u64 + 1 {
        let found = format!("{count} {what} of {each} numbers");
        return Err(ParseError::invalid(words.place(), found, "no more than the file has room for"));
    }
    Ok(count as usize)
}

/// Refuses numbers behind the last line, which mean that lines have more of them than the first line says.
fn ended(words: &mut Words<'_>, count: usize, what: &str) -> Result<(), ParseError> {
    match words.next() {
        None => Ok(()),
        Some(word) => Err(words.bad(word, &format!("the end of the file behind {count} {what}"))),
    }
}

/// Tells how far it is, now and then.
fn check(i: usize, words: &Words<'_>, progress: &Progress, count: usize) -> Result<(), ParseError> {
    if i.is_multiple_of(CHECKED) {
        progress.check()?;
        progress.add((words.rest().len() / count.div_ceil(CHECKED).max(1)) as u64 / 2);
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::format::{Contents, FormatError, ReadOptions, read_contents};
    use crate::mesh::Values;
    use std::fs;

    /// Reads two files, by the name of one.
    fn opened(node: &str, ele: &str, by: &str) -> Result<UnstructuredGrid, FormatError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("m.1.node"), node).expect("written");
        fs::write(folder.path().join("m.1.ele"), ele).expect("written");
        match read_contents(&folder.path().join(by), &ReadOptions::default(), &Progress::new())? {
            Contents::Cells(grid) => Ok(grid),
            other => panic!("{other:?}"),
        }
    }

    pub(in crate::format) const NODE: &str =
        "# a comment\n4 3 1 1\n1 0 0 0 0.5 -1\n2 1 0 0 1.5 2\n3 0 1 0 2.5 3 # and one\n\n4 0 0 1 3.5 4\n";

    #[test]
    fn either_name_opens_both_files() {
        for by in ["m.1.node", "m.1.ele"] {
            let grid = opened(NODE, "1 4 1\n1 1 2 3 4 7\n", by).expect("sound");
            assert_eq!((grid.points.len(), grid.points[3]), (4, DVec3::Z));
            assert_eq!(grid.cells.get(0), (CellType::TETRA, &[0, 1, 2, 3][..]));
            assert_eq!((&*grid.point_data[0].name, &grid.point_data[0].values), ("tetgen:attr1", &Values::F64(vec![0.5, 1.5, 2.5, 3.5])));
            assert_eq!((&*grid.point_data[1].name, &grid.point_data[1].values), ("tetgen:ref", &Values::F32(vec![-1.0, 2.0, 3.0, 4.0])));
            assert_eq!((&*grid.cell_data[0].name, &grid.cell_data[0].values), ("tetgen:ref", &Values::F32(vec![7.0])));
        }
    }

    #[test]
    fn points_of_quadratic_tets_are_put_in_order() {
        let corners = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]];
        let edges = [[0, 1, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1], [0, 0, 1]];
        let lines = corners.iter().chain(&edges).enumerate().map(|(i, p)| format!("{i} {} {} {}\n", p[0], p[1], p[2]));
        let node = format!("10 3 0 0\n{}", lines.collect::<String>());
        let grid = opened(&node, "1 10 0\n0 0 1 2 3 4 5 6 7 8 9\n", "m.1.ele").expect("sound");
        assert_eq!(grid.cells.get(0), (CellType::QUADRATIC_TETRA, &[0, 1, 2, 3, 5, 6, 7, 9, 8, 4][..]));
        let node = node.replace("\n9 0 0 1", "\n9 1 0 0");
        let grid = opened(&node, "1 10 0\n0 0 1 2 3 4 5 6 7 8 9\n", "m.1.ele").expect("sound");
        assert_eq!((grid.cells.get(0), grid.notes.len()), ((CellType::TETRA, &[0, 1, 2, 3][..]), 1));
    }

    #[test]
    fn files_of_triangle_are_flat() {
        let grid = opened("3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n", "1 3 0\n0 0 1 2\n", "m.1.node").expect("sound");
        assert_eq!((grid.cells.get(0), grid.points[2]), ((CellType::TRIANGLE, &[0, 1, 2][..]), DVec3::Y));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_file() {
        let refused = |node: &str, ele: &str, by: &str| opened(node, ele, by).expect_err("not sound").to_string();
        let ele = "1 4 0\n1 1 2 3 4\n";
        for (error, expected) in [
            (refused(NODE, "1 4 0\n1 1 2 3 5\n", "m.1.node"), "m.1.node: its file m.1.ele: line 2, cell 1: point 5, expected a point of"),
            (refused("4 3 0 0\n1 0 0", ele, "m.1.ele"), "m.1.ele: its file m.1.node: line 1: 4 points of 4 numbers, expected no more than"),
            (refused(NODE, "1 5 0\n1 1 2 3 4 5\n", "m.1.ele"), "m.1.ele: line 1: cells of 5 points in 3 dimensions, expected 4 or 10"),
            (refused(&format!("{NODE}5 "), ele, "m.1.node"), "m.1.node: line 8: \"5\", expected the end of the file behind 4 points"),
            (refused(&NODE.replace("0.5", "x"), ele, "m.1.node"), "m.1.node: line 3: \"x\", expected an attribute or marker"),
            (refused("0 3 0 0\n", ele, "m.1.node"), "m.1.node: line 1: "),
            (refused("1 3 99999999999999999 0\n1 0 0 0", ele, "m.1.node"), "numbers, expected no more than the file has room for"),
        ] {
            assert!(error.contains(expected), "{error}\n{expected}");
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("alone.node"), NODE).expect("written");
        let error = read_contents(&folder.path().join("alone.node"), &ReadOptions::default(), &Progress::new()).expect_err("no cells");
        assert!(error.to_string().contains("alone.node: its file alone.ele: "), "{error}");
    }
}
