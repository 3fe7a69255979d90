//! Gmsh's `.msh`, versions 2.0 to 2.3, 4.0 and 4.1, as text and binary in both byte orders
//! (<https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>).
//!
//! - Numbers of nodes and elements may be any, in any order; elements keep the file's order.
//! - Elements of orders 1 and 2 become VTK's cells of the same kind, higher orders Lagrange cells; others are cut down to their corners,
//!   which a note says.
//! - `gmsh:physical` and `gmsh:geometrical` are cell arrays, as meshio names them: the first physical group of an element (NaN for none)
//!   and its entity. The names of the groups are in a note.
//! - `$NodeData` and `$ElementData` are arrays, NaN where they say nothing; of several steps of one name the first is taken.
//!   `$ElementNodeData` becomes a point array: the mean over the elements around a node.
//! - `$Periodic` and unknown sections are passed over.

mod data;
mod element_type;
mod elements;
mod entities;
mod lagrange;
mod nodes;
mod numbers;
#[cfg(test)]
pub(super) mod tests;
mod write;

pub use write::{WriteError, write_grid};

use super::GridFile;
use super::parse::{ParseError, Tags, Words, all_of, shown, whole_numbers};
use super::vtu::number::ByteOrder;
use crate::mesh::{Cells, UnstructuredGrid, thousands};
use crate::progress::Progress;
use data::Views;
use element_type::ElementType;
use entities::Entities;
use glam::DVec3;
use numbers::{Encoding, Numbers};
use std::collections::BTreeMap;

/// Whether a file begins like one of Gmsh's meshes.
pub(super) fn recognizes(start: &[u8]) -> bool {
    start.trim_ascii_start().starts_with(b"$") && start.windows(11).any(|window| window == b"$MeshFormat")
}

/// Reads a mesh.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut mesh = Mesh { has_room_for: bytes.len(), ..Mesh::default() };
    mesh.read(&bytes, progress)?;
    Ok(mesh.into_grid())
}

/// The version of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    /// 2.0 to 2.3.
    Two,
    FourZero,
    FourOne,
}

/// What was read so far.
#[derive(Default)]
struct Mesh {
    /// Bytes of the file.
    has_room_for: usize,
    points: Vec<DVec3>,
    nodes: Tags,
    cells: Cells,
    elements: Tags,
    /// Gmsh's type of each cell.
    types: Vec<u8>,
    /// The first physical group of each cell, NaN for none.
    physical: Vec<f64>,
    /// The entity of each cell, NaN for none.
    geometrical: Vec<f64>,
    entities: Entities,
    /// How many elements of each type have fewer nodes now.
    cut_down: BTreeMap<u8, u64>,
    views: Views,
    notes: Vec<String>,
}

impl Mesh {
    fn read(&mut self, bytes: &[u8], progress: &Progress) -> Result<(), ParseError> {
        let mut words = Words::new(bytes);
        let mut format = None;
        let (mut has_nodes, mut has_elements) = (false, false);
        while let Some(heading) = words.next() {
            let Some(name) = heading.strip_prefix(b"$") else {
                return Err(words.bad(heading, "a section, such as $Nodes"));
            };
            progress.check()?;
            if name == b"MeshFormat" {
                format = Some(header(bytes, &mut words)?);
                end_of(name, &mut words)?;
                continue;
            }
            let (version, encoding) = match format {
                Some(format) => format,
                None if matches!(name, b"NOD" | b"PARA" | b"NOE") => return Err(too_old("1")),
                None => {
                    pass_over(name, &mut words)?;
                    continue;
                }
            };
            if matches!(name, b"Nodes" | b"ParametricNodes") && std::mem::replace(&mut has_nodes, true)
                || name == b"Elements" && std::mem::replace(&mut has_elements, true)
            {
                return Err(words.bad(heading, "one such section"));
            }
            let mut section = Section { bytes, words: &mut words, version, encoding, progress };
            match name {
                b"PhysicalNames" => self.physical_names(&mut section)?,
                b"Entities" | b"PartitionedEntities" if version != Version::Two => {
                    self.entities.read(&mut section, name == b"PartitionedEntities")?;
                }
                b"Nodes" | b"ParametricNodes" => self.read_nodes(&mut section, name == b"ParametricNodes")?,
                b"Elements" if !has_nodes => return Err(words.bad(heading, "the section $Nodes before it")),
                b"Elements" => self.read_elements(&mut section)?,
                b"NodeData" | b"ElementData" | b"ElementNodeData" if has_nodes => self.read_data(&mut section, name)?,
                _ => {
                    pass_over(name, &mut words)?;
                    continue;
                }
            }
            end_of(name, &mut words)?;
        }
        if format.is_none() {
            return Err(ParseError::invalid("the file", "no section $MeshFormat", "one at its start"));
        }
        if !has_nodes {
            return Err(ParseError::invalid("the file", "no section $Nodes", "one"));
        }
        Ok(())
    }

    /// A note with the names of physical groups, which nothing else keeps.
    fn physical_names(&mut self, section: &mut Section<'_, '_>) -> Result<(), ParseError> {
        const MOST: usize = 20;
        let count = section.words.count(6, "a count of physical names")?;
        section.words.rest_of_line();
        let mut names = Vec::new();
        for i in 0..count {
            let dimension: usize = section.words.integer("the dimension of a physical group")?;
            let number: i64 = section.words.integer("the number of a physical group")?;
            let name = section.words.rest_of_line().unwrap_or_default();
            let kind = ["point", "curve", "surface", "volume"].get(dimension).copied().unwrap_or("group");
            if i < MOST {
                names.push(format!("{kind} {number} is {}", shown(unquoted(name))));
            }
        }
        if count > MOST {
            names.push(format!("{} more", count - MOST));
        }
        if count > 0 {
            self.notes.push(format!("the names of physical groups are not kept, only their numbers: {}", names.join(", ")));
        }
        Ok(())
    }

    fn into_grid(mut self) -> UnstructuredGrid {
        for (number, count) in std::mem::take(&mut self.cut_down) {
            let element = ElementType::of(i64::from(number));
            let (nodes, kept, name) = element.map_or((0, 0, ""), |t| (t.nodes, t.order.len(), t.cell_type.name().1));
            let count = thousands(count);
            self.notes.push(format!("{count} elements of Gmsh's type {number} with {nodes} nodes are taken as {name} of {kept}"));
        }
        for (tags, what) in [(&self.nodes, "nodes"), (&self.elements, "elements")] {
            if tags.repeated() > 0 {
                let count = thousands(tags.repeated() as u64);
                self.notes.push(format!("{count} {what} have a number that another has; the first of a number is meant where it is used"));
            }
        }
        if self.entities.has_several_groups {
            self.notes.push("some entities are in several physical groups; gmsh:physical has the first".into());
        }
        let (point_data, mut cell_data) = std::mem::take(&mut self.views).into_arrays(&mut self.notes);
        for (name, numbers) in [("gmsh:physical", &self.physical), ("gmsh:geometrical", &self.geometrical)] {
            if !numbers.iter().all(|n| n.is_nan()) {
                cell_data.push(whole_numbers(name, numbers));
            }
        }
        let Mesh { points, cells, notes, .. } = self;
        UnstructuredGrid { points, cells, point_data, cell_data, notes, ..UnstructuredGrid::default() }
    }
}

/// A section that is being read: `words` are behind its heading.
struct Section<'s, 'a> {
    bytes: &'a [u8],
    words: &'s mut Words<'a>,
    version: Version,
    encoding: Encoding,
    progress: &'a Progress,
}

impl<'a> Section<'_, 'a> {
    /// The numbers that begin on the next line.
    fn numbers(&mut self) -> Numbers<'a> {
        if self.encoding != Encoding::Text {
            self.words.rest_of_line();
        }
        Numbers::new(self.bytes, self.words, self.encoding, self.progress)
    }

    /// Goes behind numbers that were read.
    fn leave(&mut self, numbers: &Numbers<'_>) {
        self.words.skip_to(numbers.at());
    }
}

/// The version and how numbers are stored.
fn header(bytes: &[u8], words: &mut Words<'_>) -> Result<(Version, Encoding), ParseError> {
    let version = words.word("a version")?;
    let version = match version {
        b"2" | b"2.0" | b"2.1" | b"2.2" | b"2.3" => Version::Two,
        b"4" | b"4.0" => Version::FourZero,
        b"4.1" => Version::FourOne,
        other => return Err(too_old(&String::from_utf8_lossy(other).chars().take(8).collect::<String>())),
    };
    let is_binary = match words.word("0 for text or 1 for binary")? {
        b"0" => false,
        b"1" => true,
        other => return Err(words.bad(other, "0 for text or 1 for binary")),
    };
    let size_bytes = match words.word("the size of numbers, 4 or 8")? {
        b"4" => 4,
        b"8" => 8,
        other => return Err(words.bad(other, "the size of numbers, 4 or 8")),
    };
    if !is_binary {
        return Ok((version, Encoding::Text));
    }
    words.rest_of_line();
    let order = match bytes.get(words.at()..words.at() + 4) {
        Some([1, 0, 0, 0]) => ByteOrder::Little,
        Some([0, 0, 0, 1]) => ByteOrder::Big,
        _ => return Err(ParseError::invalid(format!("byte {}", words.at()), "something else", "1 in 4 bytes, in either order")),
    };
    words.skip_to(words.at() + 4);
    Ok((version, Encoding::Binary { order, size_bytes }))
}

fn too_old(version: &str) -> ParseError {
    ParseError::Unsupported(format!(
        "is Gmsh's format in version {version}; octetra reads versions 2.0 to 2.3, 4.0 and 4.1 (`gmsh FILE -save -format msh41 -o NEW.msh` \
         converts it)"
    ))
}

/// The end of a section.
fn end_of(name: &[u8], words: &mut Words<'_>) -> Result<(), ParseError> {
    let expected = format!("$End{}", String::from_utf8_lossy(name));
    let found = words.word(&expected)?;
    if found == expected.as_bytes() { Ok(()) } else { Err(words.bad(found, &expected)) }
}

/// Goes behind a section that is not read.
fn pass_over(name: &[u8], words: &mut Words<'_>) -> Result<(), ParseError> {
    let end = [b"$End", name].concat();
    match words.rest().windows(end.len()).position(|window| window == end) {
        Some(at) => {
            words.skip_to(words.at() + at + end.len());
            Ok(())
        }
        None => Err(ParseError::invalid(words.place(), "the end of the file", String::from_utf8_lossy(&end))),
    }
}

/// A text without the quotes around it.
fn unquoted(text: &[u8]) -> &[u8] {
    let text = text.trim_ascii();
    let inner = text.strip_prefix(b"\"").and_then(|text| text.strip_suffix(b"\""));
    inner.unwrap_or(text)
}
