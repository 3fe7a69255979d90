//! Writing `.msh` 4.1, as text or binary (little-endian).
//!
//! - Points and cells are numbered from 1 in their order. Cells that follow each other and are alike are one block.
//! - Cell arrays `gmsh:physical` and `gmsh:geometrical`, which the reader makes, become entities and their physical groups again.
//! - Gmsh's values have 1, 3 or 9 components: a third 0 is added to 2, and of other counts each component is an array `name:0` and so on.
//! - Missing values are written as NaN.

mod out;
#[cfg(test)]
mod tests;

use super::element_type::ElementType;
use crate::image::write_atomically;
use crate::mesh::{CellType, DataArray, UnstructuredGrid, counts_in_words, thousands};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use out::Out;
use std::collections::{BTreeMap, HashMap};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Why a mesh could not be written. The file that was there, if any, is as it was.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system said no.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// It has something that the format has no place for.
    #[error("{}: {what}", path.display())]
    NoPlace {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: String,
    },
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Lines between two looks at the progress.
const CHECKED: usize = 4096;

/// Writes all points, cells and arrays. Cells that Gmsh does not have (polyhedra, polygons of more than four corners) are refused.
pub fn write_grid(path: &Path, grid: &UnstructuredGrid, is_binary: bool, progress: &Progress) -> Result<(), WriteError> {
    let no_place = |what| WriteError::NoPlace { path: path.into(), what };
    let mut file =
        MshFile { grid, is_binary, progress, cells: Vec::new(), types: Vec::new(), entities: Entities::default(), arrays: Vec::new() };
    file.plan().map_err(no_place)?;
    let rows: usize = file.arrays.iter().map(|array| array.rows()).sum();
    progress.begin("writing", (grid.points.len() + grid.cells.len() + rows) as u64);
    write_atomically(path, |out| file.write(out)).map_err(|cause| match cause.downcast::<Cancelled>() {
        Ok(cancelled) => cancelled.into(),
        Err(cause) => WriteError::Io { path: path.into(), cause },
    })
}

/// What is written.
struct MshFile<'a> {
    grid: &'a UnstructuredGrid,
    is_binary: bool,
    progress: &'a Progress,
    /// Of each cell, the place of its type in `types` and its entity.
    cells: Vec<(u16, i32)>,
    types: Vec<Written>,
    entities: Entities,
    arrays: Vec<Array<'a>>,
}

/// A type of elements for cells of a type.
struct Written {
    element: ElementType,
    dimension: usize,
    /// Element's node `i` is the cell's node `order[i]`.
    order: Vec<u16>,
}

/// Geometrical entities: their numbers by dimension, the number that cells ask for, and their physical group.
#[derive(Default)]
struct Entities {
    numbers: BTreeMap<(usize, i32, Option<i32>), i32>,
}

/// Values of an array that are written as one section.
struct Array<'a> {
    section: &'static str,
    name: String,
    array: &'a DataArray,
    /// The components, in order; `None` is 0.
    components: Vec<Option<usize>>,
}

impl Array<'_> {
    fn rows(&self) -> usize {
        self.array.tuples()
    }
}

impl<'a> MshFile<'a> {
    /// Finds out what to write; else what there is no place for.
    fn plan(&mut self) -> Result<(), String> {
        let grid = self.grid;
        if grid.points.len().max(grid.cells.len()) >= i32::MAX as usize {
            return Err("has more points or cells than Gmsh's format numbers (2,147,483,646)".into());
        }
        let groups = |name| grid.cell_data.iter().find(|array| array.name == name && array.components == 1).filter(|array| is_whole(array));
        let (physical, geometrical) = (groups("gmsh:physical"), groups("gmsh:geometrical"));
        let group = |array: Option<&DataArray>, cell: usize| {
            let value = array.filter(|array| cell < array.values.len()).map(|array| array.values.get(cell));
            value.filter(|value| !value.is_nan()).map(|value| value as i32)
        };
        let mut known: HashMap<(CellType, usize), Option<u16>> = HashMap::new();
        let mut homeless: BTreeMap<CellType, u64> = BTreeMap::new();
        let mut wanted = Vec::with_capacity(grid.cells.len());
        for (cell, (cell_type, points)) in grid.cells.iter().enumerate() {
            let types = &mut self.types;
            let index = *known.entry((cell_type, points.len())).or_insert_with(|| {
                types.push(Written::of(cell_type, points.len())?);
                Some((types.len() - 1) as u16)
            });
            let Some(index) = index else {
                *homeless.entry(cell_type).or_default() += 1;
                continue;
            };
            if let Some(point) = points.iter().find(|&&point| point as usize >= grid.points.len()) {
                return Err(format!("cell {cell} has point {point}, but there are {} points", thousands(grid.points.len() as u64)));
            }
            let entity = group(geometrical, cell).filter(|&entity| entity > 0).unwrap_or(1);
            let key = (self.types[usize::from(index)].dimension, entity, group(physical, cell).filter(|&group| group != 0));
            self.entities.numbers.insert(key, entity);
            wanted.push((index, key));
        }
        if !homeless.is_empty() {
            return Err(format!("has {}, for which Gmsh's format has no place", counts_in_words(homeless)));
        }
        self.entities.number();
        self.cells = wanted.into_iter().map(|(index, key)| (index, self.entities.numbers[&key])).collect();
        for array in &grid.point_data {
            self.plan_array("NodeData", array, grid.points.len())?;
        }
        for array in &grid.cell_data {
            let is_group = [physical, geometrical].into_iter().flatten().any(|group| std::ptr::eq(group, array));
            if !is_group {
                self.plan_array("ElementData", array, grid.cells.len())?;
            }
        }
        Ok(())
    }

    fn plan_array(&mut self, section: &'static str, array: &'a DataArray, things: usize) -> Result<(), String> {
        let name: String = array.name.chars().map(|c| if c == '"' || c.is_control() { '_' } else { c }).collect();
        if array.components == 0 || array.values.len() != things * array.components {
            return Err(format!("array \"{name}\" has {} numbers for {things} points or cells", array.values.len()));
        }
        let mut add = |name, components| self.arrays.push(Array { section, name, array, components });
        match array.components {
            1 | 3 | 9 => add(name, (0..array.components).map(Some).collect()),
            2 => add(name, vec![Some(0), Some(1), None]),
            components => (0..components).for_each(|component| add(format!("{name}:{component}"), vec![Some(component)])),
        }
        Ok(())
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut out = Out::new(out, self.is_binary);
        out.text(&format!("$MeshFormat\n4.1 {} 8\n", u8::from(self.is_binary)))?;
        if self.is_binary {
            out.int(1);
        }
        out.end_line()?;
        out.text("$EndMeshFormat\n")?;
        self.write_entities(&mut out)?;
        self.write_nodes(&mut out)?;
        self.write_elements(&mut out)?;
        self.arrays.iter().try_for_each(|array| self.write_array(array, &mut out))
    }

    fn write_entities(&self, out: &mut Out<'_>) -> io::Result<()> {
        out.text("$Entities\n")?;
        let of = |dimension: usize| self.entities.numbers.iter().filter(move |((own, ..), _)| *own == dimension);
        (0..4).for_each(|dimension| out.size(of(dimension).count()));
        out.end_row()?;
        let bounds = |pick: fn(DVec3, DVec3) -> DVec3| self.grid.points.iter().copied().reduce(pick).unwrap_or_default().to_array();
        let (lowest, highest) = (bounds(DVec3::min), bounds(DVec3::max));
        for dimension in 0..4 {
            for ((_, _, physical), &number) in of(dimension) {
                out.int(number);
                lowest.iter().for_each(|&c| out.real(c));
                if dimension > 0 {
                    highest.iter().for_each(|&c| out.real(c));
                }
                out.size(usize::from(physical.is_some()));
                physical.iter().for_each(|&physical| out.int(physical));
                if dimension > 0 {
                    out.size(0);
                }
                out.end_row()?;
            }
        }
        out.end_section("Entities")
    }

    /// All points in one block, which belongs to the first entity of the highest dimension.
    fn write_nodes(&self, out: &mut Out<'_>) -> io::Result<()> {
        let points = &self.grid.points;
        let dimension = self.entities.numbers.keys().map(|&(dimension, ..)| dimension).max();
        let entity = dimension.and_then(|d| self.entities.numbers.iter().find(|((own, ..), _)| *own == d)).map_or(1, |(_, &number)| number);
        out.text("$Nodes\n")?;
        [1, points.len(), usize::from(!points.is_empty()), points.len()].into_iter().for_each(|n| out.size(n));
        out.end_row()?;
        [dimension.unwrap_or(3) as i32, entity, 0].into_iter().for_each(|n| out.int(n));
        out.size(points.len());
        out.end_row()?;
        for i in 0..points.len() {
            out.size(i + 1);
            out.end_row()?;
        }
        for (i, point) in points.iter().enumerate() {
            self.check(i)?;
            point.to_array().into_iter().for_each(|c| out.real(c));
            out.end_row()?;
        }
        out.end_section("Nodes")
    }

    fn write_elements(&self, out: &mut Out<'_>) -> io::Result<()> {
        let count = self.cells.len();
        out.text("$Elements\n")?;
        let blocks = self.cells.chunk_by(PartialEq::eq);
        [blocks.clone().count(), count, usize::from(count > 0), count].into_iter().for_each(|n| out.size(n));
        out.end_row()?;
        let mut cell = 0;
        for block in blocks {
            let (index, entity) = block[0];
            let written = &self.types[usize::from(index)];
            [written.dimension as i32, entity, i32::from(written.element.number)].into_iter().for_each(|n| out.int(n));
            out.size(block.len());
            out.end_row()?;
            for _ in block {
                self.check(cell)?;
                let (_, points) = self.grid.cells.get(cell);
                out.size(cell + 1);
                written.order.iter().for_each(|&i| out.size(points[usize::from(i)] as usize + 1));
                out.end_row()?;
                cell += 1;
            }
        }
        out.end_section("Elements")
    }

    fn write_array(&self, array: &Array<'_>, out: &mut Out<'_>) -> io::Result<()> {
        let (section, name, components, rows) = (array.section, &array.name, array.components.len(), array.rows());
        out.text(&format!("${section}\n1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{rows}\n"))?;
        for row in 0..rows {
            self.check(row)?;
            out.int(row as i32 + 1);
            let value = |component: Option<usize>| component.map_or(0.0, |c| array.array.values.get(row * array.array.components + c));
            array.components.iter().for_each(|&component| out.real(value(component)));
            out.end_row()?;
        }
        out.end_section(section)
    }

    /// Tells how far it is, now and then.
    fn check(&self, i: usize) -> io::Result<()> {
        if i.is_multiple_of(CHECKED) {
            self.progress.check().map_err(io::Error::other)?;
            self.progress.add(CHECKED as u64);
        }
        Ok(())
    }
}

impl Written {
    /// The elements for cells of a type with so many points, if Gmsh has some.
    fn of(cell_type: CellType, points: usize) -> Option<Self> {
        // Types that are another by another name, and where its points stand in theirs.
        let (same, places): (CellType, &[u16]) = match (cell_type, points) {
            (CellType::VOXEL, _) => (CellType::HEXAHEDRON, &[0, 1, 3, 2, 4, 5, 7, 6]),
            (CellType::PIXEL, _) => (CellType::QUAD, &[0, 1, 3, 2]),
            (CellType::POLY_VERTEX, 1) => (CellType::VERTEX, &[]),
            (CellType::POLY_LINE | CellType::LAGRANGE_CURVE, 2) => (CellType::LINE, &[]),
            (CellType::LAGRANGE_CURVE, 3) => (CellType::QUADRATIC_EDGE, &[]),
            (CellType::POLYGON | CellType::TRIANGLE_STRIP | CellType::LAGRANGE_TRIANGLE, 3) => (CellType::TRIANGLE, &[]),
            (CellType::LAGRANGE_TRIANGLE, 6) => (CellType::QUADRATIC_TRIANGLE, &[]),
            (CellType::POLYGON | CellType::LAGRANGE_QUADRILATERAL, 4) => (CellType::QUAD, &[]),
            (CellType::LAGRANGE_QUADRILATERAL, 9) => (CellType::BIQUADRATIC_QUAD, &[]),
            (CellType::LAGRANGE_TETRAHEDRON, 4) => (CellType::TETRA, &[]),
            (CellType::LAGRANGE_TETRAHEDRON, 10) => (CellType::QUADRATIC_TETRA, &[]),
            (CellType::LAGRANGE_HEXAHEDRON, 8) => (CellType::HEXAHEDRON, &[]),
            (CellType::LAGRANGE_HEXAHEDRON, 27) => (CellType::TRIQUADRATIC_HEXAHEDRON, &[]),
            _ => (cell_type, &[]),
        };
        let element = (1..=u8::MAX).filter_map(|number| ElementType::of(i64::from(number)));
        let element = element.into_iter().find(|t| t.cell_type == same && t.is_whole() && t.nodes == points)?;
        let mut order = vec![0; points];
        for (cell_node, &element_node) in (0..).zip(&element.order) {
            order[usize::from(element_node)] = places.get(usize::from(cell_node)).copied().unwrap_or(cell_node);
        }
        Some(Written { dimension: same.dimension()?, element, order })
    }
}

impl Entities {
    /// Gives each a number of its own in its dimension: the one asked for to the first, others above all.
    fn number(&mut self) {
        let mut next = [0; 4];
        for &(dimension, wanted, _) in self.numbers.keys() {
            next[dimension] = next[dimension].max(wanted.saturating_add(1));
        }
        let mut last = None;
        for (&(dimension, wanted, _), number) in &mut self.numbers {
            if last == Some((dimension, wanted)) {
                *number = next[dimension];
                next[dimension] = next[dimension].saturating_add(1);
            }
            last = Some((dimension, wanted));
        }
    }
}

/// Whether all numbers of an array are missing or whole numbers of 32 bits.
fn is_whole(array: &DataArray) -> bool {
    let is_whole = |n: f64| n.is_nan() || n.fract() == 0.0 && n.abs() < f64::from(i32::MAX);
    (0..array.values.len()).all(|i| is_whole(array.values.get(i)))
}
