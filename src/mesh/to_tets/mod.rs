//! Cells of any type to tets: linear cells by cones over their triangulated faces, quadratic ones by linear cells between all their nodes.
//!
//! * A face with four corners or more is cut by fans from its corner with the lowest index, so that the two cells of a face cut it alike
//!   (Dompierre et al., "How to subdivide pyramids, prisms, and hexahedra into tetrahedra", 1999); a concave one otherwise, but by the same
//!   rule from both sides ([`face`]).
//! * The tets of a cell join its corner of the lowest index to the triangles of the faces that do not have it. Where one of them would be
//!   turned inside out, since the cell is not convex, they join the mean of the corners instead, a new point with the mean of their values
//!   ([`cone`]). The volume is that within the triangles of the faces.
//! * Quadratic cells become linear ones between their nodes, where values are exact; nodes that the type lacks at the middle of faces and
//!   cells are interpolated ([`quadratic`]).
//! * Points, lines and surfaces are set aside; points that no tet uses are left out. Both are counted in the notes.

mod cone;
mod face;
pub(crate) use face::triangulate as triangulate_face;
mod quadratic;
#[cfg(test)]
mod tests;

use super::{CellType, DataArray, FileCells, MeshError, MeshParts, UnstructuredGrid, Values, counts_in_words, thousands};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// The tets of the cells that have a volume, with the arrays of those cells.
pub fn to_tets(mut grid: UnstructuredGrid) -> Result<MeshParts, MeshError> {
    grid.merge_points();
    let UnstructuredGrid { points, cells, point_data, cell_data, active_scalars, numbers, mut notes, .. } = grid;
    if points.len() >= u32::MAX as usize {
        return Err(MeshError::TooMany { what: "points", count: points.len() });
    }
    let mut splitter = Splitter::new(points);
    for (cell, (cell_type, nodes)) in cells.iter().enumerate() {
        splitter.cell(cell, cell_type, nodes)?;
    }
    let counts = cells.counts();
    if splitter.point_arrays_fit(&point_data) {
        notes.extend(quadratic::deviation(&splitter.points[..splitter.own_points], &cells, &point_data));
    }
    drop(cells);
    if splitter.tets.is_empty() {
        let why = if splitter.without_faces > 0 { ", whose faces octetra does not know" } else { "" };
        return Err(MeshError::NoVolume(counts_in_words(counts) + why));
    }
    splitter.finish(counts, point_data, cell_data, active_scalars, &numbers, notes)
}

/// Collects tets, and the points that are made for them.
struct Splitter {
    points: Vec<DVec3>,
    /// Points of the file.
    own_points: usize,
    /// Of each point that was made the nodes whose weighted mean it is, one behind the other, and where they end.
    sources: Vec<(u32, f64)>,
    source_ends: Vec<usize>,
    /// Points that were made at the middle of faces, by the face's four corners in ascending order.
    face_centres: HashMap<[u32; 4], u32>,
    tets: Vec<[u32; 4]>,
    /// The cell and its type of each tet.
    cells: Vec<(u32, CellType)>,
    /// Cells that have a volume but gave no tet, by what is the matter.
    without_faces: u64,
    corners_only: u64,
    folded: u64,
    skipped_nodes: u64,
    open: u64,
    /// What is allocated once: a cell's nodes, and what cones need.
    nodes: Vec<u32>,
    scratch: cone::Scratch,
}

impl Splitter {
    fn new(points: Vec<DVec3>) -> Self {
        Splitter {
            own_points: points.len(),
            points,
            sources: vec![],
            source_ends: vec![],
            face_centres: HashMap::new(),
            tets: vec![],
            cells: vec![],
            without_faces: 0,
            corners_only: 0,
            folded: 0,
            skipped_nodes: 0,
            open: 0,
            nodes: vec![],
            scratch: cone::Scratch::default(),
        }
    }

    /// Adds a cell's tets.
    fn cell(&mut self, cell: usize, cell_type: CellType, nodes: &[u32]) -> Result<(), MeshError> {
        if cell_type.dimension() != Some(3) {
            return Ok(());
        }
        let first = self.tets.len();
        if cell_type == CellType::POLYHEDRON {
            self.polyhedron(cell, nodes)?;
            self.folded += u64::from(cone::is_folded(&self.points, &self.tets[first..]));
            return Ok(());
        }
        if let Some(expected) = cell_type.points().filter(|&expected| expected != nodes.len()) {
            return Err(MeshError::CellPoints { cell, cell_type, found: nodes.len(), expected });
        }
        let mut own = std::mem::take(&mut self.nodes);
        own.clear();
        self.push_nodes(cell, nodes, &mut own)?;
        match (cell_type, &own[..]) {
            (CellType::TETRA, &[a, b, c, d]) => self.tets.push([a, b, c, d]),
            (CellType::VOXEL, &[a, b, c, d, e, f, g, h]) => self.hexahedron([a, b, d, c, e, f, h, g]),
            (CellType::QUADRATIC_TETRA, nodes) => self.quadratic_tetra(nodes),
            (CellType::LAGRANGE_TETRAHEDRON, nodes) if nodes.len() == 10 => self.quadratic_tetra(nodes),
            (CellType::QUADRATIC_PYRAMID | CellType::TRIQUADRATIC_PYRAMID, nodes) => self.quadratic_pyramid(nodes),
            (CellType::QUADRATIC_WEDGE | CellType::BIQUADRATIC_QUADRATIC_WEDGE, nodes) => self.quadratic_wedge(nodes),
            (CellType::QUADRATIC_HEXAHEDRON | CellType::BIQUADRATIC_QUADRATIC_HEXAHEDRON | CellType::TRIQUADRATIC_HEXAHEDRON, nodes) => {
                self.quadratic_hexahedron(nodes)
            }
            (cell_type, nodes) => match cone::corners(cell_type, nodes.len()) {
                Some((corners, faces)) => {
                    self.corners_only += u64::from(corners < nodes.len());
                    self.linear(&nodes[..corners], faces);
                }
                None => self.without_faces += 1,
            },
        }
        self.nodes = own;
        self.folded += u64::from(cone::is_folded(&self.points, &self.tets[first..]));
        self.skipped_nodes += u64::from(cell_type == CellType::TRIQUADRATIC_PYRAMID);
        self.cells.resize(self.tets.len(), (cell as u32, cell_type));
        Ok(())
    }

    /// Whether arrays have a tuple for every point of the file; if not, they are refused in the end.
    fn point_arrays_fit(&self, arrays: &[DataArray]) -> bool {
        arrays.iter().all(|a| a.components > 0 && Some(a.values.len()) == self.own_points.checked_mul(a.components))
    }

    /// Adds the points that a cell names, which must exist.
    fn push_nodes(&self, cell: usize, nodes: &[u32], out: &mut Vec<u32>) -> Result<(), MeshError> {
        if let Some(&index) = nodes.iter().find(|&&node| node as usize >= self.own_points) {
            return Err(MeshError::CellPoint { cell, index, points: self.own_points });
        }
        out.extend_from_slice(nodes);
        Ok(())
    }

    /// A new point, the weighted mean of nodes.
    fn make(&mut self, nodes: impl Iterator<Item = (u32, f64)> + Clone) -> u32 {
        let at = nodes.clone().map(|(node, weight)| self.points[node as usize] * weight).sum();
        self.sources.extend(nodes);
        self.source_ends.push(self.sources.len());
        self.points.push(at);
        (self.points.len() - 1) as u32
    }

    /// The mesh of all tets.
    fn finish(
        self,
        counts: Vec<(CellType, u64)>,
        mut point_data: Vec<DataArray>,
        cell_data: Vec<DataArray>,
        active_scalars: Option<String>,
        numbers: &[u32],
        mut notes: Vec<String>,
    ) -> Result<MeshParts, MeshError> {
        for (arrays, tuples, of) in
            [(&point_data, self.own_points, "points"), (&cell_data, counts.iter().map(|&(_, count)| count as usize).sum(), "cells")]
        {
            if let Some(array) = arrays.iter().find(|a| a.components == 0 || Some(a.values.len()) != tuples.checked_mul(a.components)) {
                let (name, found, components) = (array.name.clone(), array.values.len(), array.components);
                return Err(MeshError::ArrayLength { name, found, tuples, components, of });
            }
        }
        point_data.par_iter_mut().for_each(|array| self.extend(array));
        let sources: Vec<u32> = self.cells.iter().map(|&(cell, _)| cell).collect();
        let cell_data = cell_data.into_par_iter().map(|array| gathered(array, &sources)).collect();
        let (unknown, aside): (Vec<_>, Vec<_>) =
            counts.iter().filter(|count| count.0.dimension() != Some(3)).copied().partition(|count| count.0.dimension().is_none());
        for (cells, why) in [(aside, "set aside: they have no volume"), (unknown, "left out: their type is not known")] {
            if !cells.is_empty() {
                notes.push(format!("{} {why}", counts_in_words(cells)));
            }
        }
        let made = self.points.len() - self.own_points;
        for (count, what) in [
            (self.without_faces, "cells are of a type whose faces octetra does not know and were left out"),
            (self.corners_only, "cells of a higher order are taken by their corners"),
            (self.skipped_nodes, "triquadratic pyramids are met at all nodes but those within their triangles and inside"),
            (self.folded, "cells are folded: some of their tets overlap others"),
            (self.open, "polyhedra have faces that do not close them"),
            (made as u64, "points were made in the middle of cells and faces"),
        ] {
            if count > 0 {
                notes.push(format!("{} {what}", thousands(count)));
            }
        }
        let shape = uniform_type(&self.cells);
        let is_plain = numbers.is_empty() && shape == Some(CellType::TETRA) && counts.len() == 1;
        let numbers = match is_plain {
            true => vec![],
            false => sources.iter().map(|&cell| numbers.get(cell as usize).copied().unwrap_or(cell)).collect(),
        };
        let types = if shape.is_some() { vec![] } else { self.cells.iter().map(|&(_, cell_type)| cell_type).collect() };
        let file_cells = FileCells { shape: shape.unwrap_or(CellType::TETRA), tets_per_cell: 1, numbers, types };
        let parts = MeshParts { points: self.points, tets: self.tets, point_data, cell_data, active_scalars, file_cells, notes };
        let points = parts.points.len();
        let mut parts = without_unused(parts);
        if parts.points.len() < points {
            parts
                .notes
                .push(format!("{} points are of no cell with a volume and were left out", thousands((points - parts.points.len()) as u64)));
        }
        Ok(parts)
    }

    /// Adds the tuples of points that were made.
    fn extend(&self, array: &mut DataArray) {
        let mut start = 0;
        for &end in &self.source_ends {
            for component in 0..array.components {
                let value = |&(node, weight): &(u32, f64)| array.values.get(node as usize * array.components + component) * weight;
                let value: f64 = self.sources[start..end].iter().map(value).sum();
                match &mut array.values {
                    Values::F32(values) => values.push(value as f32),
                    Values::F64(values) => values.push(value),
                }
            }
            start = end;
        }
    }
}

/// The type of all of them.
fn uniform_type(cells: &[(u32, CellType)]) -> Option<CellType> {
    let (_, first) = *cells.first()?;
    cells.iter().all(|&(_, cell_type)| cell_type == first).then_some(first)
}

/// The same mesh without points that no tet uses.
pub(super) fn without_unused(mut parts: MeshParts) -> MeshParts {
    let mut place = vec![u32::MAX; parts.points.len()];
    parts.tets.iter().flatten().for_each(|&i| place[i as usize] = 0);
    let used: Vec<u32> = (0..place.len() as u32).filter(|&i| place[i as usize] == 0).collect();
    if used.len() == place.len() {
        return parts;
    }
    used.iter().enumerate().for_each(|(new, &old)| place[old as usize] = new as u32);
    parts.tets.par_iter_mut().for_each(|tet| *tet = tet.map(|i| place[i as usize]));
    parts.points = used.iter().map(|&i| parts.points[i as usize]).collect();
    parts.point_data = parts.point_data.into_iter().map(|array| gathered(array, &used)).collect();
    parts
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
