//! Medit's `.mesh` (text) and `.meshb` (binary, versions 1 to 4, both byte orders), with the solution in a `.sol` or `.solb` of the same name
//! beside, if there is one (<https://github.com/LoicMarechal/libMeshb>, `libmeshb7.pdf`).
//!
//! - `medit:ref` is the reference of points and of cells, as meshio names it.
//! - Solutions have no names: the first is `solution`, the others `solution 2` and so on.
//! - Quadratic edges, triangles, quadrilaterals and tetrahedra are whole; of other cells of higher order there are the corners, if any.
//! - Sections that say nothing about cells and values (corners, ridges, tangents) are left out, with a note.

mod numbers;
mod solution;
#[cfg(test)]
pub(super) mod tests;

use super::GridFile;
use super::parse::{ParseError, all_of, content, shown, whole_numbers};
use super::source::Source;
use crate::mesh::{CellType, Cells, UnstructuredGrid, thousands};
use crate::progress::Progress;
use glam::DVec3;
use numbers::Numbers;
use solution::Solution;
use std::collections::BTreeMap;
use std::iter;
use std::ops::Range;

/// A section of cells.
struct Shape {
    /// Its keyword as text, in lower case.
    keyword: &'static str,
    /// Its keyword in binary.
    code: i64,
    cell_type: CellType,
    /// Nodes in the file, of which the cell type's are the first.
    nodes: usize,
    /// The keyword of its solutions.
    solution: &'static str,
    solution_code: i64,
}

const fn shape(
    (keyword, code): (&'static str, i64),
    cell_type: CellType,
    nodes: usize,
    (solution, solution_code): (&'static str, i64),
) -> Shape {
    Shape { keyword, code, cell_type, nodes, solution, solution_code }
}

/// A keyword that no file has.
const NO: (&str, i64) = ("", -1);

const SHAPES: &[Shape] = &[
    shape(("edges", 5), CellType::LINE, 2, ("solatedges", 63)),
    shape(("triangles", 6), CellType::TRIANGLE, 3, ("solattriangles", 64)),
    shape(("quadrilaterals", 7), CellType::QUAD, 4, ("solatquadrilaterals", 65)),
    shape(("tetrahedra", 8), CellType::TETRA, 4, ("solattetrahedra", 66)),
    shape(("prisms", 9), CellType::WEDGE, 6, ("solatprisms", 67)),
    shape(("hexahedra", 10), CellType::HEXAHEDRON, 8, ("solathexahedra", 68)),
    shape(("hexaedra", -1), CellType::HEXAHEDRON, 8, NO),
    shape(("pyramids", 49), CellType::PYRAMID, 5, ("solatpyramids", 26)),
    shape(("edgesp2", 25), CellType::QUADRATIC_EDGE, 3, NO),
    shape(("trianglesp2", 24), CellType::QUADRATIC_TRIANGLE, 6, NO),
    shape(("quadrilateralsq2", 27), CellType::BIQUADRATIC_QUAD, 9, NO),
    shape(("tetrahedrap2", 30), CellType::QUADRATIC_TETRA, 10, NO),
    shape(("hexahedraq2", 33), CellType::HEXAHEDRON, 27, NO),
    shape(("prismsp2", 86), CellType::WEDGE, 18, NO),
    shape(("pyramidsp2", 87), CellType::PYRAMID, 14, NO),
];

/// Sections left out that a note names.
const MOST_NAMED: usize = 40;

/// Whether a file begins like Medit's.
pub(super) fn recognizes(start: &[u8]) -> bool {
    let text = start.trim_ascii_start();
    let is_text = text.get(..20).is_some_and(|word| word.eq_ignore_ascii_case(b"MeshVersionFormatted"));
    is_text || numbers::binary_order(start).is_some()
}

/// Reads a mesh.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut mesh = Mesh::default();
    mesh.read(&bytes, progress)?;
    if mesh.points.is_none() {
        let expected = "one; a solution (.sol, .solb) is read with the mesh of its name beside it";
        return Err(ParseError::invalid("the file", "no section Vertices", expected));
    }
    if matches!(file.source, Source::File(..)) {
        mesh.read_solution_beside(file, progress)?;
    }
    Ok(mesh.into_grid())
}

/// What was read so far.
#[derive(Default)]
struct Mesh {
    dimension: usize,
    points: Option<Vec<DVec3>>,
    point_references: Vec<f64>,
    cells: Cells,
    cell_references: Vec<f64>,
    /// The cells of each shape.
    ranges: BTreeMap<usize, Vec<Range<usize>>>,
    solutions: Vec<Solution>,
    /// Sections that are not read.
    left_out: Vec<String>,
    notes: Vec<String>,
}

/// What a section is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Dimension,
    Vertices,
    /// By index in [`SHAPES`].
    Cells(usize),
    /// Of points, or of cells of a shape.
    Solution(Option<usize>),
    End,
    Other,
}

impl Section {
    fn of_name(name: &[u8]) -> Section {
        let name = String::from_utf8_lossy(name).to_ascii_lowercase();
        let shape = SHAPES.iter().position(|shape| shape.keyword == name).map(Section::Cells);
        let solution = SHAPES.iter().position(|shape| shape.solution == name).map(|shape| Section::Solution(Some(shape)));
        match name.as_str() {
            "dimension" => Section::Dimension,
            "vertices" => Section::Vertices,
            "solatvertices" => Section::Solution(None),
            "end" => Section::End,
            _ => shape.or(solution).unwrap_or(Section::Other),
        }
    }

    fn of_code(code: i64) -> Section {
        let shape = SHAPES.iter().position(|shape| shape.code == code).map(Section::Cells);
        let solution = SHAPES.iter().position(|shape| shape.solution_code == code).map(|shape| Section::Solution(Some(shape)));
        match code {
            3 => Section::Dimension,
            4 => Section::Vertices,
            62 => Section::Solution(None),
            54 => Section::End,
            i64::MIN..0 => Section::Other,
            _ => shape.or(solution).unwrap_or(Section::Other),
        }
    }
}

impl Mesh {
    /// Reads a mesh or a solution.
    fn read(&mut self, bytes: &[u8], progress: &Progress) -> Result<(), ParseError> {
        let mut numbers = Numbers::new(bytes, progress)?;
        while let Some((section, name)) = numbers.next_section()? {
            progress.check()?;
            match section {
                Section::End => break,
                Section::Dimension => {
                    self.dimension = match numbers.small("a dimension")? {
                        2 => 2,
                        3 => 3,
                        other => return Err(ParseError::invalid(numbers.place(), format!("dimension {other}"), "2 or 3")),
                    }
                }
                Section::Other => {
                    let name = numbers.pass_over(name)?;
                    if let Some(name) = name.filter(|name| self.left_out.len() < MOST_NAMED && !self.left_out.contains(name)) {
                        self.left_out.push(name);
                    }
                    continue;
                }
                _ if self.dimension == 0 => return Err(ParseError::invalid(numbers.place(), "no dimension so far", "Dimension 2 or 3")),
                Section::Vertices if self.points.is_some() => {
                    return Err(ParseError::invalid(numbers.place(), "more Vertices", "one section"));
                }
                Section::Vertices => self.read_vertices(&mut numbers)?,
                Section::Cells(shape) => self.read_cells(shape, &mut numbers)?,
                Section::Solution(shape) => self.solutions.push(Solution::read(shape, self.dimension, &mut numbers)?),
            }
            numbers.leave()?;
        }
        Ok(())
    }

    fn read_vertices(&mut self, numbers: &mut Numbers<'_>) -> Result<(), ParseError> {
        let count = numbers.count(1, self.dimension, "vertices")?;
        let mut points = Vec::with_capacity(count);
        self.point_references.reserve(count);
        for _ in 0..count {
            numbers.check()?;
            let mut point = [0.0; 3];
            for coordinate in &mut point[..self.dimension] {
                *coordinate = numbers.real("a coordinate")?;
            }
            points.push(DVec3::from_array(point));
            self.point_references.push(numbers.integer("the reference of a vertex")? as f64);
        }
        self.points = Some(points);
        Ok(())
    }

    fn read_cells(&mut self, index: usize, numbers: &mut Numbers<'_>) -> Result<(), ParseError> {
        let shape = &SHAPES[index];
        let kept = shape.cell_type.points().unwrap_or(shape.nodes);
        let count = numbers.count(shape.nodes + 1, 0, "cells")?;
        let first = self.cells.len();
        let mut nodes = [0; 27];
        for _ in 0..count {
            numbers.check()?;
            for node in &mut nodes[..shape.nodes] {
                let number = numbers.integer("a vertex of a cell")?;
                let index = number.checked_sub(1).and_then(|index| u32::try_from(index).ok());
                *node = index.ok_or_else(|| ParseError::invalid(numbers.place(), format!("vertex {number}"), "vertices counted from 1"))?;
            }
            self.cells.push(shape.cell_type, &nodes[..kept])?;
            self.cell_references.push(numbers.integer("the reference of a cell")? as f64);
        }
        if kept < shape.nodes && count > 0 {
            let (count, name) = (thousands(count as u64), shape.cell_type.name().1);
            self.notes.push(format!("{count} cells with {} nodes are taken as {name} of {kept}", shape.nodes));
        }
        self.ranges.entry(index).or_default().push(first..self.cells.len());
        Ok(())
    }

    /// The solution in the file of the same name.
    fn read_solution_beside(&mut self, file: &GridFile<'_>, progress: &Progress) -> Result<(), ParseError> {
        for suffix in ["sol", "solb"] {
            let path = file.path.with_extension(suffix);
            if !path.is_file() {
                continue;
            }
            let named = |problem| ParseError::Other { file: path.file_name().unwrap_or_default().into(), problem: Box::new(problem) };
            let bytes = content(&path).map_err(named)?;
            progress.begin("reading", bytes.len() as u64);
            let mut other = Mesh::default();
            other.read(&bytes, progress).map_err(named)?;
            self.solutions.append(&mut other.solutions);
            return Ok(());
        }
        Ok(())
    }

    fn into_grid(mut self) -> UnstructuredGrid {
        let points = self.points.take().unwrap_or_default();
        let mut point_data = vec![whole_numbers("medit:ref", &self.point_references)];
        let mut cell_data = vec![whole_numbers("medit:ref", &self.cell_references)];
        let mut named = 0;
        for solution in std::mem::take(&mut self.solutions) {
            let ranges = match solution.shape {
                None => iter::once(0..points.len()).collect(),
                Some(shape) => self.ranges.remove(&shape).unwrap_or_default(),
            };
            let arrays = if solution.shape.is_none() { &mut point_data } else { &mut cell_data };
            let things = if solution.shape.is_none() { points.len() } else { self.cells.len() };
            match solution.into_arrays(things, &ranges, &mut named) {
                Ok(found) => arrays.extend(found),
                Err(note) => self.notes.push(note),
            }
        }
        if !self.left_out.is_empty() {
            self.notes.push(format!("sections were left out: {}", self.left_out.join(", ")));
        }
        if self.cells.is_empty() {
            cell_data.clear();
        }
        UnstructuredGrid { points, cells: self.cells, point_data, cell_data, notes: self.notes, ..UnstructuredGrid::default() }
    }
}

/// The name of a section for a note.
fn section_name(name: &[u8]) -> String {
    shown(name).trim_matches('"').to_owned()
}
