//! Exodus II: meshes of finite elements in NetCDF, classic or NetCDF-4 (<https://sandialabs.github.io/seacas-docs/exodusII-new.pdf>).
//!
//! All nodes of the file are points, whether elements use them or not (VTK copies them block by block). Elements become cells of VTK's
//! types in VTK's order, block after block; blocks of elements that VTK has no cell for are left out. Of the time steps the first is
//! read; displacements are an array and move no points. Variables that end in x, y and z and follow each other are one vector, as in VTK.
//! Beside the variables there are VTK's arrays of numbers: `ObjectId` (the block), `GlobalElementId`, `GlobalNodeId`.

mod blocks;
mod cells;
mod netcdf;
#[cfg(test)]
mod tests;

use super::hdf::Pieces;
use super::{GridFile, ParseError};
use crate::mesh::{DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use blocks::{Block, read_blocks};
use glam::DVec3;
use netcdf::NetCdf;
use std::collections::BTreeMap;

/// Suffixes of its files.
pub(super) const SUFFIXES: &[&str] = &["e", "exo", "ex2", "exii", "gen"];

/// Whether a file that starts so is classic NetCDF; those in HDF5 are told by [`hdf::read`](super::hdf::read).
pub(super) fn recognizes(start: &[u8]) -> bool {
    matches!(start, [b'C', b'D', b'F', 1 | 2 | 5, ..])
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    progress.begin("reading", file.source.len());
    let file = NetCdf::open(file.source, progress)?;
    let points = read_points(&file)?;
    let mut grid = UnstructuredGrid::default();
    let blocks = read_blocks(&file, &mut grid)?;
    time_note(&file, &mut grid.notes)?;
    grid.point_data = node_arrays(&file, points.len(), &mut grid.notes)?;
    grid.cell_data = element_arrays(&file, &blocks, grid.cells.len(), &mut grid.notes)?;
    let ids = number_arrays(&file, points.len(), &blocks)?;
    let first = grid.point_data.first().or(grid.cell_data.first()).map(|array| array.name.clone());
    grid.active_scalars = first.or_else(|| Some("ObjectId".into()));
    grid.point_data.extend(ids.0);
    grid.cell_data.extend(ids.1);
    left_out(&file, &mut grid.notes);
    grid.points = points;
    Ok(grid)
}

fn read_points(file: &NetCdf<'_>) -> Result<Vec<DVec3>, ParseError> {
    let shape = |name: &str| file.variable(name).map(|variable| variable.shape());
    let together = shape("coord");
    let nodes = match (&together, shape("coordx")) {
        (Some(shape), _) if shape.len() == 2 => shape[1],
        (_, Some(shape)) if shape.len() == 1 => shape[0],
        _ if file.dimension("num_nodes") == 0 && file.dimension("num_dim") > 0 => 0,
        _ => {
            return Err(ParseError::Unsupported(
                "is a NetCDF file without the coordinates of nodes (coordx or coord) that Exodus II files have".into(),
            ));
        }
    };
    let nodes = usize::try_from(nodes).unwrap_or(usize::MAX);
    let axis = |k: usize| {
        let found = match &together {
            Some(shape) if shape.len() == 2 => (k as u64) < shape[0],
            _ => false,
        };
        let numbers = if found { file.part("coord", &[k], nodes)? } else { file.all(["coordx", "coordy", "coordz"][k], nodes)? };
        Ok::<_, ParseError>(numbers.map(|numbers| numbers.reals()))
    };
    let (x, y, z) = (axis(0)?, axis(1)?, axis(2)?);
    let count = x.as_ref().map_or(0, Vec::len);
    let at = |axis: &Option<Vec<f64>>, i: usize| axis.as_ref().map_or(0.0, |axis| axis[i]);
    Ok((0..count).map(|i| DVec3::new(at(&x, i), at(&y, i), at(&z, i))).collect())
}

/// Says which time step is read, if there are several.
fn time_note(file: &NetCdf<'_>, notes: &mut Vec<String>) -> Result<(), ParseError> {
    let steps = file.dimension("time_step");
    if steps > 1 {
        let time = file.part("time_whole", &[0], 1)?.map(|time| format!(" (time {})", time.reals()[0])).unwrap_or_default();
        notes.push(format!("of {steps} time steps the first{time} was read"));
    }
    Ok(())
}

/// The arrays of variables on nodes.
fn node_arrays(file: &NetCdf<'_>, nodes: usize, notes: &mut Vec<String>) -> Result<Vec<DataArray>, ParseError> {
    let names = file.texts("name_nod_var")?;
    if file.dimension("time_step") == 0 {
        return Ok(no_values("name_nod_var", names.len(), notes));
    }
    let mut arrays = Vec::new();
    for (i, name) in names.into_iter().enumerate() {
        let numbers = match file.variable("vals_nod_var") {
            Some(_) => file.part("vals_nod_var", &[0, i], nodes)?,
            _ => file.part(&format!("vals_nod_var{}", i + 1), &[0], nodes)?,
        };
        match numbers {
            Some(numbers) => arrays.push(DataArray { name, components: 1, values: numbers.values() }),
            None => notes.push(format!("the variable \"{name}\" on nodes has no values")),
        }
    }
    Ok(glued(arrays, file.dimension("num_dim")))
}

/// The arrays of variables on elements.
fn element_arrays(file: &NetCdf<'_>, blocks: &[Block], cells: usize, notes: &mut Vec<String>) -> Result<Vec<DataArray>, ParseError> {
    let names = file.texts("name_elem_var")?;
    if file.dimension("time_step") == 0 {
        return Ok(no_values("name_elem_var", names.len(), notes));
    }
    let mut on_blocks: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for name in file.names() {
        let numbers = name.strip_prefix("vals_elem_var").and_then(|rest| rest.split_once("eb"));
        if let Some((variable, block)) = numbers.and_then(|(v, b)| Some((v.parse::<usize>().ok()?, b.parse::<usize>().ok()?))) {
            on_blocks.entry(variable).or_default().push(block);
        }
    }
    let mut arrays = Vec::new();
    for (i, name) in names.into_iter().enumerate() {
        let mut on = on_blocks.remove(&(i + 1)).unwrap_or_default();
        on.sort_unstable();
        let on: Vec<&Block> = blocks.iter().filter(|block| on.binary_search(&block.number).is_ok()).collect();
        if on.is_empty() {
            notes.push(format!("the variable \"{name}\" on elements has no values on the cells that were read"));
            continue;
        }
        let mut pieces = Pieces::new();
        file.take(cells, &format!("variable \"{name}\" on elements"))?;
        for block in on {
            pieces.fill_to(block.cells.start);
            let variable = format!("vals_elem_var{}eb{}", i + 1, block.number);
            if let Some(numbers) = file.part(&variable, &[0], block.cells.len())? {
                pieces.append(numbers.values());
            }
        }
        pieces.fill_to(cells);
        arrays.push(DataArray { name, components: 1, values: pieces.values() });
    }
    Ok(glued(arrays, file.dimension("num_dim")))
}

fn no_values(of: &str, count: usize, notes: &mut Vec<String>) -> Vec<DataArray> {
    if count > 0 {
        let on = if of == "name_nod_var" { "nodes" } else { "elements" };
        notes.push(format!("{count} variables on {on} have no values: the file has no time step"));
    }
    Vec::new()
}

/// The numbers that the file gives nodes and elements, and blocks.
fn number_arrays(file: &NetCdf<'_>, nodes: usize, blocks: &[Block]) -> Result<(Option<DataArray>, Vec<DataArray>), ParseError> {
    let one = |name: &str, values: Values| DataArray { name: name.into(), components: 1, values };
    let on_nodes = file.all("node_num_map", nodes)?.map(|numbers| one("GlobalNodeId", numbers.values()));
    let mut ids = Vec::new();
    for block in blocks {
        ids.resize(block.cells.end, block.id as f64);
    }
    let mut on_cells = vec![one("ObjectId", Values::F64(ids))];
    if let Some(numbers) = file.all_flat("elem_num_map")? {
        let numbers = numbers.reals();
        let places = blocks.iter().flat_map(|block| (0..block.cells.len()).map(|i| block.first.saturating_add(i)));
        let of_cells = places.map(|place| numbers.get(place).copied().unwrap_or(f64::NAN)).collect();
        on_cells.push(one("GlobalElementId", Values::F64(of_cells)));
    }
    Ok((on_nodes, on_cells))
}

/// Says what else the file has.
fn left_out(file: &NetCdf<'_>, notes: &mut Vec<String>) {
    let kinds = [
        ("num_node_sets", "node set", "node sets"),
        ("num_side_sets", "side set", "side sets"),
        ("num_ed_blk", "block of edges", "blocks of edges"),
        ("num_glo_var", "global variable", "global variables"),
    ];
    let counted = kinds.iter().map(|&(dimension, one, several)| (file.dimension(dimension), one, several)).filter(|(n, ..)| *n > 0);
    let words: Vec<String> = counted.map(|(n, one, several)| format!("{n} {}", if n == 1 { one } else { several })).collect();
    if !words.is_empty() {
        notes.push(format!("left out: {}", words.join(", ")));
    }
}

/// Variables that are components of a vector become one array.
fn glued(arrays: Vec<DataArray>, dimensions: usize) -> Vec<DataArray> {
    let mut glued = Vec::new();
    let mut rest = arrays.into_iter().peekable();
    while let Some(first) = rest.next() {
        let Some(stem) = stem(&first.name, 'x').map(str::to_owned) else {
            glued.push(first);
            continue;
        };
        let mut parts = vec![first];
        for axis in ['y', 'z'].into_iter().take(dimensions.saturating_sub(1)) {
            parts.extend(rest.next_if(|array| self::stem(&array.name, axis) == Some(&stem)));
        }
        if parts.len() == dimensions && dimensions > 1 { glued.push(vector(stem, parts)) } else { glued.extend(parts) }
    }
    glued
}

/// A name without the axis at its end.
fn stem(name: &str, axis: char) -> Option<&str> {
    let rest = name.strip_suffix(axis).or_else(|| name.strip_suffix(axis.to_ascii_uppercase()))?;
    Some(rest.trim_end_matches(['_', ' '])).filter(|stem| !stem.is_empty())
}

fn vector(name: String, parts: Vec<DataArray>) -> DataArray {
    let components = parts.len();
    let singles: Option<Vec<&Vec<f32>>> = parts.iter().map(|part| if let Values::F32(v) = &part.values { Some(v) } else { None }).collect();
    let tuples = parts[0].values.len();
    let values = match singles {
        Some(parts) => Values::F32((0..tuples).flat_map(|i| parts.iter().map(move |part| part[i])).collect()),
        None => Values::F64((0..tuples).flat_map(|i| parts.iter().map(move |part| part.values.get(i))).collect()),
    };
    DataArray { name, components, values }
}
