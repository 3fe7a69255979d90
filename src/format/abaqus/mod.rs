//! Abaqus' and CalculiX's `.inp`: nodes and elements
//! (<https://docs.software.vt.edu/abaqusv2024/English/SIMACAEKEYRefMap/simakey-c-ov.htm>, CalculiX CrunchiX manual, chapter 7).
//!
//! - Read are `*NODE` (Cartesian and cylindrical), `*ELEMENT` and `*INCLUDE` (files in the same folder or below); continuum elements are
//!   cells, shells, membranes and plane elements surfaces, trusses and beams lines. Other elements are left out, with a note.
//! - A part (`*PART`) has numbers of its own, and is as often and where the instances in the assembly say.
//! - `abaqus:elset` counts the element sets that `*ELEMENT` names, from 1; 0 is none. Other sets, and nodes and elements that the file
//!   generates (`*NGEN`, `*ELGEN`), are left out, with a note.

mod assembly;
mod element_type;
#[cfg(test)]
pub(super) mod tests;

use super::GridFile;
use super::parse::{ParseError, Tags, Words, all_of, beside, content, real, shown, whole_numbers};
use crate::mesh::{CellType, Cells, UnstructuredGrid, thousands};
use crate::progress::Progress;
use assembly::Assembly;
use element_type::{ElementType, HEXAHEDRON_27};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Files within files within files.
const MOST_DEEP: usize = 8;

/// Files that a file names, in all.
const MOST_FILES: usize = 256;

/// Names that a note lists at most.
const MOST_NAMED: usize = 40;

/// Lines between two looks at the progress.
const CHECKED: usize = 4096;

/// Whether a file begins like Abaqus'.
pub(super) fn recognizes(start: &[u8]) -> bool {
    let text = start.trim_ascii_start().to_ascii_uppercase();
    let has = |keyword: &[u8]| text.windows(keyword.len()).any(|window| window == keyword);
    text.starts_with(b"*") && [&b"*NODE"[..], b"*HEADING", b"*PART", b"*INCLUDE", b"*ELEMENT"].into_iter().any(has)
}

/// Reads a mesh.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut mesh = Mesh { file, progress, model: Model::default(), bytes_read: 0 };
    mesh.read(&bytes, 0)?;
    let Mesh { mut model, bytes_read, .. } = mesh;
    model.end_scope()?;
    let mut notes = Vec::new();
    model.assemble(bytes_read, &mut notes)?;
    if model.points.is_empty() {
        return Err(ParseError::invalid("the file", "no nodes", "a keyword *NODE with some"));
    }
    Ok(model.into_grid(notes))
}

/// The file that is being read, and what was read so far.
struct Mesh<'a> {
    file: &'a GridFile<'a>,
    progress: &'a Progress,
    model: Model,
    /// Length of all files.
    bytes_read: usize,
}

/// What the lines that follow are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Data {
    /// Nothing yet: there was no keyword.
    #[default]
    Start,
    /// Of no interest.
    Other,
    Nodes {
        is_cylindrical: bool,
    },
    /// Elements of a type and their set.
    Elements(ElementType, f64),
    /// Elements that are no cells, by the index of their name.
    LeftOut(usize),
    /// Where an instance lies.
    Instance,
    /// Where a coordinate system lies.
    System,
}

#[derive(Default)]
struct Model {
    data: Data,
    points: Vec<DVec3>,
    cells: Cells,
    sets: Vec<f64>,
    set_names: Vec<String>,
    /// The number of each set, by its name in capitals.
    set_numbers: HashMap<String, f64>,
    /// The nodes and elements of the part that is being read: an element's nodes are found at its end.
    first_point: usize,
    tags: Vec<u64>,
    elements: Vec<(ElementType, u64, f64)>,
    nodes: Vec<u64>,
    /// The element that is not complete yet, its number first, and the line it began in.
    open: Vec<u64>,
    open_line: usize,
    files: usize,
    repeated: usize,
    /// How many lines of elements are left out, by type, and where each type's are.
    left_out: Vec<(String, u64)>,
    left_out_places: HashMap<String, usize>,
    /// Keywords that would make more of the mesh.
    generating: BTreeMap<String, u64>,
    has_sets: bool,
    assembly: Assembly,
}

impl Mesh<'_> {
    fn read(&mut self, bytes: &[u8], depth: usize) -> Result<(), ParseError> {
        self.bytes_read += bytes.len();
        let mut words = Words::new(bytes);
        let mut count = 0;
        let mut reported = 0;
        loop {
            let line_number = words.line();
            let Some(line) = words.rest_of_line() else { break };
            count += 1;
            if count % CHECKED == 0 {
                self.progress.add((words.at() - reported) as u64);
                self.progress.check()?;
                reported = words.at();
            }
            if line.is_empty() || line.starts_with(b"**") {
                continue;
            }
            let at = |problem: Problem| ParseError::invalid(format!("line {line_number}"), problem.found, problem.expected);
            if !line.starts_with(b"*") {
                self.model.data_line(line, line_number).map_err(at)?;
                continue;
            }
            let mut all = line.to_vec();
            while all.ends_with(b",") {
                match words.rest_of_line() {
                    Some(more) => all.extend_from_slice(more),
                    None => break,
                }
            }
            self.model.end_element()?;
            let keyword = Keyword::new(&all);
            if let Some(name) = self.model.keyword(&keyword).map_err(at)? {
                self.read_other(&name, depth)?;
            }
        }
        Ok(())
    }

    /// Reads a file as if it stood where it is named.
    fn read_other(&mut self, name: &str, depth: usize) -> Result<(), ParseError> {
        self.model.files += 1;
        if depth >= MOST_DEEP || self.model.files > MOST_FILES {
            let found = format!("it names the file \"{name}\", after {} others", self.model.files - 1);
            let expected = format!("at most {MOST_FILES} files, at most {MOST_DEEP} within each other");
            return Err(ParseError::invalid("a reference", found, expected));
        }
        let path = beside(self.file, name)?;
        let named = |problem| ParseError::Other { file: name.into(), problem: Box::new(problem) };
        let bytes = content(&path).map_err(named)?;
        self.read(&bytes, depth + 1).map_err(named)
    }
}

/// What is wrong with a line.
struct Problem {
    found: String,
    expected: String,
}

fn problem(found: impl Into<String>, expected: impl Into<String>) -> Problem {
    Problem { found: found.into(), expected: expected.into() }
}

/// A keyword line: `*NAME, PARAMETER=VALUE, PARAMETER`.
struct Keyword {
    name: String,
    parameters: Vec<(String, String)>,
}

impl Keyword {
    fn new(line: &[u8]) -> Self {
        let text = String::from_utf8_lossy(&line[1..]);
        let mut parts = text.split(',');
        // Blanks within a name do not count.
        let name = parts.next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ").to_ascii_uppercase();
        let parameter = |part: &str| {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            (name.trim().to_ascii_uppercase(), value.trim().trim_matches('"').to_owned())
        };
        Keyword { name, parameters: parts.map(parameter).collect() }
    }

    fn parameter(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }
}

impl Model {
    /// Takes a keyword; gives the name of a file whose lines follow it, if there is one.
    fn keyword(&mut self, keyword: &Keyword) -> Result<Option<String>, Problem> {
        self.data = Data::Other;
        match keyword.name.as_str() {
            "NODE" => {
                let is_cylindrical = match keyword.parameter("SYSTEM").map(str::to_ascii_uppercase).as_deref() {
                    None | Some("R" | "") => false,
                    Some("C") => true,
                    Some(other) => return Err(problem(format!("*NODE, SYSTEM={other}"), "R (Cartesian) or C (cylindrical)")),
                };
                self.data = Data::Nodes { is_cylindrical };
            }
            "ELEMENT" => {
                let name = keyword.parameter("TYPE").ok_or_else(|| problem("*ELEMENT without a type", "*ELEMENT, TYPE=.."))?;
                let name = name.to_ascii_uppercase();
                self.data = match ElementType::of(&name) {
                    Some(element_type) => Data::Elements(element_type, self.set(keyword.parameter("ELSET"))),
                    None => {
                        let left_out = &mut self.left_out;
                        Data::LeftOut(*self.left_out_places.entry(name).or_insert_with_key(|name| {
                            left_out.push((name.clone(), 0));
                            left_out.len() - 1
                        }))
                    }
                };
            }
            "INCLUDE" => {
                let name = keyword.parameter("INPUT").filter(|name| !name.is_empty());
                return name.map(|name| Some(name.to_owned())).ok_or_else(|| problem("*INCLUDE without a file", "*INCLUDE, INPUT=.."));
            }
            "PART" | "END PART" | "ASSEMBLY" | "END ASSEMBLY" | "INSTANCE" | "END INSTANCE" => {
                self.end_scope().map_err(|error| match error {
                    ParseError::Invalid { place, found, expected } => problem(format!("{place}: {found}"), expected),
                    other => problem(other.to_string(), "less"),
                })?;
                self.assembly.end_part(self.points.len(), self.cells.len());
                match (keyword.name.as_str(), keyword.parameter("NAME"), keyword.parameter("PART")) {
                    ("PART", Some(name), _) => self.assembly.begin_part(name, self.points.len(), self.cells.len()),
                    ("INSTANCE", _, Some(part)) => {
                        self.assembly.begin_instance(part);
                        self.data = Data::Instance;
                    }
                    _ => {}
                }
            }
            "SYSTEM" => self.data = Data::System,
            "NSET" | "ELSET" => self.has_sets = true,
            "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" => *self.generating.entry(keyword.name.clone()).or_default() += 1,
            _ => {}
        }
        let takes_file = matches!(self.data, Data::Nodes { .. } | Data::Elements(..) | Data::LeftOut(_));
        Ok(keyword.parameter("INPUT").filter(|name| takes_file && !name.is_empty()).map(str::to_owned))
    }

    /// The number of a set of elements.
    fn set(&mut self, name: Option<&str>) -> f64 {
        let Some(name) = name.filter(|name| !name.is_empty()) else { return 0.0 };
        *self.set_numbers.entry(name.to_ascii_uppercase()).or_insert_with(|| {
            self.set_names.push(name.to_owned());
            self.set_names.len() as f64
        })
    }

    fn data_line(&mut self, line: &[u8], line_number: usize) -> Result<(), Problem> {
        match self.data {
            Data::Start => return Err(problem(shown(line), "a keyword, such as *NODE")),
            Data::Other => {}
            Data::Nodes { is_cylindrical } => {
                let mut fields = line.split(|&b| b == b',').map(<[u8]>::trim_ascii);
                let tag = fields.next().unwrap_or_default();
                self.tags.push(integer(tag).ok_or_else(|| problem(shown(tag), "the number of a node"))?);
                let mut point = [0.0; 3];
                for coordinate in &mut point {
                    let field = fields.next().filter(|field| !field.is_empty());
                    *coordinate = match field {
                        Some(field) => real(field).ok_or_else(|| problem(shown(field), "a coordinate"))?,
                        None => 0.0,
                    };
                }
                if is_cylindrical {
                    let (sin, cos) = point[1].to_radians().sin_cos();
                    point = [point[0] * cos, point[0] * sin, point[2]];
                }
                self.points.push(DVec3::from_array(point));
            }
            Data::Elements(element_type, set) => {
                if self.open.is_empty() {
                    self.open_line = line_number;
                }
                for field in line.split(|&b| b == b',').map(<[u8]>::trim_ascii).filter(|field| !field.is_empty()) {
                    self.open.push(integer(field).ok_or_else(|| problem(shown(field), "the number of an element or node"))?);
                }
                let expected = 1 + element_type.nodes;
                if self.open.len() > expected {
                    return Err(problem(format!("an element of {} nodes", self.open.len() - 1), format!("{} nodes", element_type.nodes)));
                }
                if self.open.len() == expected {
                    self.elements.push((element_type, self.open[0], set));
                    self.nodes.extend_from_slice(&self.open[1..]);
                    self.open.clear();
                }
            }
            Data::LeftOut(index) => self.left_out[index].1 += 1,
            Data::Instance => {
                let mut numbers = Vec::new();
                for field in line.split(|&b| b == b',').map(<[u8]>::trim_ascii).filter(|field| !field.is_empty()) {
                    numbers.push(real(field).ok_or_else(|| problem(shown(field), "a shift or a rotation"))?);
                }
                if !self.assembly.place(&numbers) {
                    return Err(problem(shown(line), "a shift of 3 numbers and a rotation of 7"));
                }
            }
            Data::System => return Err(problem("a coordinate system of its own (*SYSTEM)", "coordinates in the global system")),
        }
        Ok(())
    }

    /// An element must be complete where its lines end.
    fn end_element(&mut self) -> Result<(), ParseError> {
        if self.open.is_empty() {
            return Ok(());
        }
        let Data::Elements(element_type, _) = self.data else { return Ok(()) };
        let found = format!("an element of {} nodes", self.open.len() - 1);
        Err(ParseError::invalid(format!("line {}", self.open_line), found, format!("{} nodes", element_type.nodes)))
    }

    /// Finds the nodes of all elements of a part; what follows has numbers of its own.
    fn end_scope(&mut self) -> Result<(), ParseError> {
        self.end_element()?;
        let first = u32::try_from(self.first_point).ok().filter(|_| u32::try_from(self.points.len()).is_ok());
        let first = first.ok_or_else(|| ParseError::invalid("the file", "too many nodes", "fewer than 2^32"))?;
        let tags = Tags::new(&self.tags);
        self.repeated += tags.repeated();
        let mut at = 0;
        for &(element_type, tag, set) in &self.elements {
            let mut cell = [0; 27];
            for (place, &node) in cell.iter_mut().zip(&self.nodes[at..at + element_type.nodes]) {
                let missing = || ParseError::invalid(format!("element {tag}"), format!("node {node}"), "a node of the same part or file");
                *place = first + tags.find(node).ok_or_else(missing)?;
            }
            at += element_type.nodes;
            if element_type.cell_type == CellType::TRIQUADRATIC_HEXAHEDRON {
                cell = HEXAHEDRON_27.map(|i| cell[i]);
            }
            if element_type.cell_type == CellType::QUADRATIC_EDGE {
                cell.swap(1, 2); // the middle is the second node here, VTK's third
            }
            self.cells.push(element_type.cell_type, &cell[..element_type.nodes])?;
            self.sets.push(set);
        }
        self.first_point = self.points.len();
        self.tags.clear();
        self.elements.clear();
        self.nodes.clear();
        Ok(())
    }

    fn into_grid(self, mut notes: Vec<String>) -> UnstructuredGrid {
        for (name, count) in self.left_out.iter().filter(|(_, count)| *count > 0).take(MOST_NAMED) {
            let name = shown(name.as_bytes());
            notes.push(format!("{} lines of elements of type {name} were left out: they are no cells or not known", thousands(*count)));
        }
        for (name, count) in &self.generating {
            notes.push(format!("*{name} was left out ({} times), and with it the nodes or elements that it makes", thousands(*count)));
        }
        if self.repeated > 0 {
            let count = thousands(self.repeated as u64);
            notes.push(format!("{count} nodes have a number that another of their part has; elements use the first"));
        }
        if !self.set_names.is_empty() {
            let names: Vec<String> = (1..).zip(&self.set_names).take(MOST_NAMED).map(|(i, name)| format!("{i} is \"{name}\"")).collect();
            notes.push(format!("the names of element sets are not kept, only their numbers in abaqus:elset: {}", names.join(", ")));
        }
        if self.has_sets {
            notes.push("other sets (*NSET, *ELSET) were left out".into());
        }
        let cell_data = if self.set_names.is_empty() { Vec::new() } else { vec![whole_numbers("abaqus:elset", &self.sets)] };
        UnstructuredGrid { points: self.points, cells: self.cells, cell_data, notes, ..UnstructuredGrid::default() }
    }
}

fn integer(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}
