//! The sections `$NodeData`, `$ElementData` and `$ElementNodeData`.

use super::super::parse::{ParseError, real_numbers};
use super::element_type::ElementType;
use super::numbers::{Encoding, Numbers};
use super::{Mesh, Section, pass_over, unquoted};
use crate::mesh::{DataArray, thousands};
use std::collections::HashMap;

/// Bytes of memory that arrays may take for each byte of the file, since values that a section does not give are NaN.
const BYTES_PER_BYTE: usize = 256;

/// Where values belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Nodes,
    Elements,
    /// To the nodes of each element.
    ElementNodes,
}

/// One array.
#[derive(Debug)]
struct View {
    kind: Kind,
    name: String,
    components: usize,
    /// Its step and time.
    step: (i64, f64),
    partition: Option<i64>,
    /// NaN where there is none; of [`Kind::ElementNodes`] sums, with how many there are of each.
    values: Vec<f64>,
    counts: Vec<u32>,
    /// Values for things that the file does not have.
    strays: u64,
    /// Steps that are left out.
    later_steps: u64,
}

/// All arrays.
#[derive(Debug, Default)]
pub(super) struct Views {
    all: Vec<View>,
    places: HashMap<(Kind, String), usize>,
    /// Numbers in memory.
    taken: usize,
}

/// What stands before the values.
struct Heading {
    name: String,
    has_scheme: bool,
    step: (i64, f64),
    components: usize,
    rows: u64,
    partition: Option<i64>,
}

impl Mesh {
    /// Reads the section of a name.
    pub(super) fn read_data(&mut self, section: &mut Section<'_, '_>, section_name: &[u8]) -> Result<(), ParseError> {
        let kind = match section_name {
            b"NodeData" => Kind::Nodes,
            b"ElementData" => Kind::Elements,
            _ => Kind::ElementNodes,
        };
        let mut heading = heading(section)?;
        if heading.name.is_empty() {
            heading.name = String::from_utf8_lossy(section_name).into_owned();
        }
        if heading.has_scheme {
            self.notes.push(format!("array \"{}\" is interpolated by a scheme of its own, here as if it were not", heading.name));
        }
        let known = self.views.places.get(&(kind, heading.name.clone())).copied();
        let index = match known {
            Some(known) if self.views.all[known].is_continued_by(&heading) => known,
            Some(known) => {
                self.views.all[known].later_steps += 1;
                return leave_out(section, section_name);
            }
            None if heading.rows == 0 => {
                self.notes.push(format!("array \"{}\" has no values and was left out", heading.name));
                return leave_out(section, section_name);
            }
            None => {
                let things = if kind == Kind::Elements { self.cells.len() } else { self.points.len() };
                let len = things.saturating_mul(heading.components);
                self.views.taken = self.views.taken.saturating_add(len);
                if self.views.taken.saturating_mul(8) > BYTES_PER_BYTE.saturating_mul(self.has_room_for).saturating_add(1 << 20) {
                    let found = format!("array \"{}\" of {} components", heading.name, heading.components);
                    return Err(ParseError::invalid(section.words.place(), found, "arrays with values for most of the mesh"));
                }
                self.views.places.insert((kind, heading.name.clone()), self.views.all.len());
                self.views.all.push(View {
                    kind,
                    name: heading.name,
                    components: heading.components,
                    step: heading.step,
                    partition: heading.partition,
                    values: vec![if kind == Kind::ElementNodes { 0.0 } else { f64::NAN }; len],
                    counts: vec![0; if kind == Kind::ElementNodes { things } else { 0 }],
                    strays: 0,
                    later_steps: 0,
                });
                self.views.all.len() - 1
            }
        };
        let mut numbers = section.numbers();
        let mut last = None;
        let numbers_each = if section.encoding == Encoding::Text { 1 + heading.components } else { 1 + 2 * heading.components };
        let rows = numbers.room(heading.rows, if kind == Kind::ElementNodes { 2 } else { numbers_each }, "rows of values")?;
        for _ in 0..rows {
            numbers.check()?;
            match kind {
                Kind::ElementNodes => self.element_row(index, &mut numbers, &mut last)?,
                _ => self.row(index, &mut numbers)?,
            }
        }
        section.leave(&numbers);
        Ok(())
    }

    /// A node or element and its values.
    fn row(&mut self, view: usize, numbers: &mut Numbers<'_>) -> Result<(), ParseError> {
        let view = &mut self.views.all[view];
        let tags = if view.kind == Kind::Nodes { &self.nodes } else { &self.elements };
        let found = tags.find(numbers.tag(false, "the number of a node or element")?);
        view.strays += u64::from(found.is_none());
        for component in 0..view.components {
            let value = numbers.real("a value")?;
            if let Some(i) = found {
                view.values[i as usize * view.components + component] = value;
            }
        }
        Ok(())
    }

    /// An element, how many nodes it has, and the values of each. `last` is the type of the one before.
    fn element_row(&mut self, view: usize, numbers: &mut Numbers<'_>, last: &mut Option<ElementType>) -> Result<(), ParseError> {
        let view = &mut self.views.all[view];
        let element = self.elements.find(numbers.tag(false, "the number of an element")?);
        let nodes = numbers.tag(false, "a count of nodes")?;
        let nodes = numbers.room(nodes, view.components, "nodes of an element")?;
        view.strays += u64::from(element.is_none());
        let element = element.map(|i| i as usize);
        let number = element.map(|i| self.types[i]);
        if last.as_ref().map(|last| last.number) != number {
            *last = number.and_then(|number| ElementType::of(i64::from(number)));
        }
        let order: &[u16] = last.as_ref().map_or(&[], |last| &last.order);
        let cell = element.map_or(&[][..], |i| self.cells.get(i).1);
        for node in 0..nodes {
            let place = order.iter().position(|&i| usize::from(i) == node);
            let point = place.and_then(|place| cell.get(place)).map(|&point| point as usize);
            for component in 0..view.components {
                let value = numbers.real("a value")?;
                if let Some(point) = point {
                    view.values[point * view.components + component] += value;
                }
            }
            if let Some(point) = point {
                view.counts[point] += 1;
            }
        }
        Ok(())
    }
}

impl View {
    /// Whether a section has more of the same step: another partition's values.
    fn is_continued_by(&self, heading: &Heading) -> bool {
        let is_same_step = self.step.0 == heading.step.0 && self.step.1.total_cmp(&heading.step.1).is_eq();
        is_same_step && self.components == heading.components && self.partition != heading.partition
    }
}

impl Views {
    /// Arrays of points and of cells.
    pub fn into_arrays(self, notes: &mut Vec<String>) -> (Vec<DataArray>, Vec<DataArray>) {
        let (mut point_data, mut cell_data): (Vec<DataArray>, Vec<DataArray>) = Default::default();
        for mut view in self.all {
            let name = &view.name;
            if view.later_steps > 0 {
                notes.push(format!("array \"{name}\" has more steps: the first was taken, {} left out", thousands(view.later_steps)));
            }
            if view.strays > 0 {
                notes.push(format!("{} rows of array \"{name}\" are of nodes or elements that are not there", thousands(view.strays)));
            }
            if view.kind == Kind::ElementNodes {
                notes.push(format!("array \"{name}\" has values for each node of each element; here is their mean at each node"));
                for (values, &count) in view.values.chunks_exact_mut(view.components).zip(&view.counts) {
                    values.iter_mut().for_each(|value| *value /= f64::from(count));
                }
                if self.places.contains_key(&(Kind::Nodes, name.clone())) {
                    view.name += " (mean of elements)";
                }
            }
            let arrays = if view.kind == Kind::Elements { &mut cell_data } else { &mut point_data };
            arrays.push(real_numbers(&view.name, view.components, view.values));
        }
        (point_data, cell_data)
    }
}

/// Reads what stands before the values: names, times, and step, components, rows and perhaps a partition.
fn heading(section: &mut Section<'_, '_>) -> Result<Heading, ParseError> {
    let words = &mut *section.words;
    let strings = words.count(1, "a count of names")?;
    words.rest_of_line();
    let mut name = String::new();
    for i in 0..strings {
        let line = words.rest_of_line().unwrap_or_default();
        if i == 0 {
            name = String::from_utf8_lossy(unquoted(line)).into_owned();
        }
    }
    let mut time = 0.0;
    for i in 0..words.count(1, "a count of times")? {
        let number = words.real("a time")?;
        if i == 0 {
            time = number;
        }
    }
    let integers = words.count(1, "a count of whole numbers")?;
    if integers < 3 {
        return Err(ParseError::invalid(words.place(), format!("{integers} whole numbers"), "step, components and rows at least"));
    }
    let step = words.integer("a step")?;
    let components = words.count(1, "a count of components")?;
    let rows = words.integer("a count of rows")?;
    let mut partition = None;
    for i in 3..integers {
        let number = words.integer("a partition")?;
        if i == 3 {
            partition = Some(number);
        }
    }
    if components == 0 {
        return Err(ParseError::invalid(words.place(), "0 components", "1 or more"));
    }
    Ok(Heading { name, has_scheme: strings > 1, step: (step, time), components, rows, partition })
}

/// Goes to the end of the section, which stays to be read.
fn leave_out(section: &mut Section<'_, '_>, name: &[u8]) -> Result<(), ParseError> {
    let mut ahead = section.words.clone();
    pass_over(name, &mut ahead)?;
    section.words.skip_to(ahead.at() - name.len() - b"$End".len());
    Ok(())
}
