//! XDMF 2 and 3 (<https://www.xdmf.org>): cells, points and arrays named in XML, with their numbers there, in HDF5 or in plain files.
//!
//! Grids of cells are read; a spatial collection is read part by part, of a temporal one the first grid. Where a file has several grids at
//! the top, temporal collections come first, as solvers put the mesh beside the collections that refer to it; of the others those that
//! have the same cells and points give their arrays. Other files must lie beside the XDMF file or below. A document type is passed over,
//! since most writers name one, but what it declares is not known.

mod items;
#[cfg(test)]
mod tests;
mod topology;
mod tree;

use super::hdf::Joined;
use super::parse::all_of;
use super::{GridFile, ParseError};
use crate::mesh::UnstructuredGrid;
use crate::progress::Progress;
use glam::DVec3;
use items::Items;
use std::collections::HashSet;
use topology::Topology;
use tree::{Id, Tree};

/// Grids that may be in each other.
const NESTED_LIMIT: usize = 20;

/// Elements that a grid may include.
const MOST_ELEMENTS: usize = 1 << 12;

/// Whether a file that starts so is XDMF.
pub(super) fn recognizes(start: &[u8]) -> bool {
    String::from_utf8_lossy(start).contains("<Xdmf")
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    progress.begin("reading", file.source.len());
    let bytes = all_of(file)?;
    let tree = Tree::parse(&String::from_utf8_lossy(&bytes))?;
    drop(bytes);
    let mut reader = Reader { items: Items::new(&tree, file, progress), joined: Joined::default(), read: HashSet::new() };
    reader.document()?;
    reader.items.take(reader.joined.numbers())?;
    Ok(reader.joined.finish())
}

struct Reader<'a> {
    items: Items<'a>,
    joined: Joined,
    /// Grids that were read: references may not lead to one again and again.
    read: HashSet<Id>,
}

/// A grid that has cells itself, with its elements, those from elsewhere too.
struct Uniform {
    topology: Id,
    geometry: Id,
    attributes: Vec<Id>,
}

impl Reader<'_> {
    fn tree(&self) -> &Tree {
        self.items.tree
    }

    fn document(&mut self) -> Result<(), ParseError> {
        let tree = self.items.tree;
        let domains: Vec<Id> = tree.children(Tree::DOCUMENT, "Xdmf").flat_map(|root| tree.children(root, "Domain")).collect();
        let grids: Vec<Id> = domains.iter().flat_map(|&domain| tree.children(domain, "Grid")).collect();
        let (temporal, others): (Vec<Id>, Vec<Id>) = grids.iter().partition(|&&grid| self.is_temporal(grid));
        let grids = if temporal.is_empty() { others.clone() } else { temporal.clone() };
        let &[first, ref rest @ ..] = &grids[..] else {
            return Err(ParseError::Unsupported("is an XDMF file without a <Grid> in a <Domain>".into()));
        };
        self.grid(first, 0)?;
        let of_first = self.first_uniform(first)?;
        for &grid in rest {
            let uniform = self.first_uniform(grid)?;
            match (&of_first, uniform) {
                (Some(first), Some(same)) if (first.topology, first.geometry) == (same.topology, same.geometry) => {
                    if self.is_temporal(grid) {
                        self.note_steps(grid);
                    }
                    let sizes = [self.joined.grid.points.len(), self.joined.grid.cells.len()];
                    same.attributes.iter().try_for_each(|&attribute| self.attribute(attribute, [0, 0], sizes))?;
                }
                _ => self.joined.note(format!("{} has cells or points of its own and was left out", self.tree().place(grid))),
            }
        }
        let unused = if temporal.is_empty() { Vec::new() } else { others };
        let has_arrays = |&&grid: &&Id| tree.children(grid, "Attribute").next().is_some();
        let unused: Vec<String> = unused.iter().filter(has_arrays).map(|&grid| tree.place(grid)).collect();
        unused.into_iter().for_each(|place| self.joined.note(format!("{place} is beside a series in time and was left out")));
        Ok(())
    }

    fn is_temporal(&self, grid: Id) -> bool {
        self.kind(grid) == "collection" && self.tree().get(grid, "CollectionType").is_some_and(|kind| kind.eq_ignore_ascii_case("Temporal"))
    }

    fn kind(&self, grid: Id) -> String {
        self.tree().get(grid, "GridType").unwrap_or("Uniform").to_ascii_lowercase()
    }

    /// The grids in a collection, references followed.
    fn grids_in(&self, grid: Id) -> Result<Vec<Id>, ParseError> {
        self.tree().children(grid, "Grid").map(|grid| self.items.referred(grid)).collect()
    }

    fn note_steps(&mut self, grid: Id) {
        let steps = self.tree().children(grid, "Grid").count();
        if steps > 1 {
            let first = self.tree().children(grid, "Grid").next();
            let time = first.and_then(|first| self.tree().children(first, "Time").next()).and_then(|time| self.tree().get(time, "Value"));
            let time = time.map_or_else(String::new, |time| format!(" (time {time})"));
            self.joined.note(format!("of {steps} time steps the first{time} was read"));
        }
    }

    /// Reads a grid and those in it.
    fn grid(&mut self, grid: Id, depth: usize) -> Result<(), ParseError> {
        let place = self.tree().place(grid);
        if depth > NESTED_LIMIT || !self.read.insert(grid) {
            return Err(ParseError::invalid(place, "a grid in itself, or in too many others", "grids that are told one by one"));
        }
        match self.kind(grid).as_str() {
            "uniform" => {
                let uniform = self
                    .uniform(grid)?
                    .ok_or_else(|| ParseError::invalid(place, "no <Topology> or no <Geometry>", "both in a grid that is no collection"))?;
                self.read_uniform(&uniform)
            }
            "collection" if self.is_temporal(grid) => {
                self.note_steps(grid);
                let first = self.grids_in(grid)?.first().copied();
                let first = first.ok_or_else(|| ParseError::invalid(place, "no <Grid>", "one a time step"))?;
                self.grid(first, depth + 1)
            }
            "collection" | "tree" => self.grids_in(grid)?.into_iter().try_for_each(|grid| self.grid(grid, depth + 1)),
            other => Err(ParseError::Unsupported(format!("has a grid of type \"{other}\", octetra reads Uniform, Collection and Tree"))),
        }
    }

    /// The first grid with cells of its own in a grid.
    fn first_uniform(&self, mut grid: Id) -> Result<Option<Uniform>, ParseError> {
        for _ in 0..NESTED_LIMIT {
            if self.kind(grid) == "uniform" {
                return self.uniform(grid);
            }
            let Some(&first) = self.grids_in(grid)?.first() else { return Ok(None) };
            grid = first;
        }
        Ok(None)
    }

    /// The elements of a grid, those that it includes too; `None` if there are no cells or no points.
    fn uniform(&self, grid: Id) -> Result<Option<Uniform>, ParseError> {
        let tree = self.items.tree;
        let mut elements: Vec<Id> = ["Topology", "Geometry", "Attribute"].iter().flat_map(|name| tree.children(grid, name)).collect();
        for include in tree.children(grid, "include") {
            if let Some(file) = tree.get(include, "href") {
                return Err(ParseError::Unsupported(format!("includes elements of the file \"{file}\", octetra reads one XDMF file")));
            }
            if let Some(path) = tree.get(include, "xpointer") {
                elements.extend(self.items.all(path, include)?);
                if elements.len() > MOST_ELEMENTS {
                    let found = format!("more than {MOST_ELEMENTS} elements included in one grid");
                    return Err(ParseError::invalid("xi:include", found, "as many as a grid has"));
                }
            }
        }
        let elements: Vec<Id> = elements.into_iter().map(|id| self.items.referred(id)).collect::<Result<_, _>>()?;
        let named = |name: &str| elements.iter().copied().find(|&id| tree.name(id) == name);
        let attributes = elements.iter().copied().filter(|&id| tree.name(id) == "Attribute").collect();
        let parts = named("Topology").zip(named("Geometry"));
        Ok(parts.map(|(topology, geometry)| Uniform { topology, geometry, attributes }))
    }

    fn read_uniform(&mut self, uniform: &Uniform) -> Result<(), ParseError> {
        let bases = [self.joined.grid.points.len(), self.joined.grid.cells.len()];
        let topology = self.topology_of(uniform.topology)?;
        self.points(uniform.geometry)?;
        self.cells(uniform.topology, topology, bases[0])?;
        let sizes = [self.joined.grid.points.len() - bases[0], self.joined.grid.cells.len() - bases[1]];
        uniform.attributes.iter().try_for_each(|&attribute| self.attribute(attribute, bases, sizes))
    }

    fn topology_of(&self, id: Id) -> Result<Topology, ParseError> {
        let name = self.tree().get(id, "TopologyType").or(self.tree().get(id, "Type")).unwrap_or_default();
        match Topology::named(name) {
            Some(Topology::Structured) => {
                Err(ParseError::Unsupported(format!("has a regular grid ({name}), octetra reads XDMF files with lists of cells")))
            }
            Some(topology) => Ok(topology),
            None => Err(ParseError::Unsupported(format!("has cells of type \"{name}\", which octetra does not know"))),
        }
    }

    fn points(&mut self, geometry: Id) -> Result<(), ParseError> {
        let place = self.tree().place(geometry);
        let kind = self.tree().get(geometry, "GeometryType").or(self.tree().get(geometry, "Type")).unwrap_or("XYZ").to_ascii_uppercase();
        let mut axes: Vec<Vec<f64>> = self.items.in_element(geometry)?.into_iter().map(|item| item.numbers.reals()).collect();
        let wrong = |found: String, expected: &str| Err(ParseError::invalid(place.clone(), found, expected));
        let width = match (kind.as_str(), axes.len()) {
            ("XYZ", 1) => 3,
            ("XY", 1) => 2,
            ("X_Y_Z" | "X_Y", 2 | 3) => 1,
            (kind, count) => return wrong(format!("coordinates of kind {kind} in {count} data items"), "XYZ or XY in one, X_Y_Z in three"),
        };
        if axes.iter().any(|axis| !axis.len().is_multiple_of(width) || axis.len() != axes[0].len()) {
            return wrong(format!("{} numbers", axes[0].len()), &format!("as many of each axis, or a multiple of {width}"));
        }
        let points = &mut self.joined.grid.points;
        match width {
            1 => {
                axes.resize(3, vec![0.0; axes[0].len()]);
                points.extend((0..axes[0].len()).map(|i| DVec3::new(axes[0][i], axes[1][i], axes[2][i])));
            }
            2 => points.extend(axes[0].chunks_exact(2).map(|p| DVec3::new(p[0], p[1], 0.0))),
            _ => points.extend(axes[0].chunks_exact(3).map(DVec3::from_slice)),
        }
        Ok(())
    }

    fn cells(&mut self, id: Id, topology: Topology, base: usize) -> Result<(), ParseError> {
        let place = self.tree().place(id);
        let count = |attribute: &str| self.tree().get(id, attribute).and_then(|text| text.parse::<usize>().ok());
        let (elements, nodes) = (count("NumberOfElements").or(count("Dimensions")), count("NodesPerElement"));
        let first = self.tree().get(id, "BaseOffset").and_then(|text| text.parse::<i64>().ok()).unwrap_or(0);
        let before = self.joined.grid.cells.len();
        let numbers = match self.items.in_element(id)?.into_iter().next() {
            Some(item) => item.numbers.integers(&place)?,
            None if topology == Topology::Poly(crate::mesh::CellType::POLY_VERTEX) => {
                (first..).take(self.joined.grid.points.len() - base).collect()
            }
            None => return Err(ParseError::invalid(place, "no <DataItem>", "the points of its cells")),
        };
        topology.append(&numbers, nodes, [first, base as i64], &place, &mut self.joined.grid.cells)?;
        let found = self.joined.grid.cells.len() - before;
        if elements.is_some_and(|elements| elements != found) {
            let expected = format!("{} as NumberOfElements says", elements.unwrap_or(0));
            return Err(ParseError::invalid(place, format!("{found} cells"), expected));
        }
        Ok(())
    }

    /// Reads an array over the points and cells from `bases` on, of which there are `sizes`.
    fn attribute(&mut self, id: Id, bases: [usize; 2], sizes: [usize; 2]) -> Result<(), ParseError> {
        let place = self.tree().place(id);
        let center = self.tree().get(id, "Center").unwrap_or("Node").to_ascii_lowercase();
        let on = match center.as_str() {
            "node" => 0,
            "cell" => 1,
            other => {
                self.joined.note(format!("{place} has values on each {other} and was left out"));
                return Ok(());
            }
        };
        if let Some(kind) = self.tree().get(id, "ItemType").filter(|kind| !kind.eq_ignore_ascii_case("Uniform")) {
            self.joined.note(format!("{place} is a {kind} and was left out"));
            return Ok(());
        }
        let item = match self.items.in_element(id) {
            Ok(items) => items.into_iter().next(),
            Err(problem @ (ParseError::Invalid { .. } | ParseError::Unsupported(_))) => {
                self.joined.note(format!("{place} was left out: {problem}"));
                return Ok(());
            }
            Err(problem) => return Err(problem),
        };
        let Some(item) = item else {
            self.joined.note(format!("{place} has no numbers and was left out"));
            return Ok(());
        };
        let (count, len) = (sizes[on], item.numbers.len());
        if count == 0 {
            return Ok(());
        }
        if len == 0 || !len.is_multiple_of(count) {
            let what = ["points", "cells"][on];
            self.joined.note(format!("{place} has {len} numbers {:?} for {count} {what} and was left out", item.shape));
            return Ok(());
        }
        let name = self.tree().get(id, "Name").unwrap_or("unnamed").to_owned();
        let columns = if on == 0 { &mut self.joined.point_data } else { &mut self.joined.cell_data };
        if let Err(note) = columns.add(&name, len / count, bases[on], item.numbers.values()) {
            self.joined.note(note);
        }
        Ok(())
    }
}
