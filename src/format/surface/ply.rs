//! PLY, text and binary in both orders (Greg Turk, "The PLY Polygon File Format", 1998; <https://paulbourke.net/dataformats/ply/>).
//!
//! Element `vertex` gives points by its properties `x y z` and arrays by the others: `nx ny nz` become `normal`, `red green blue` (with
//! `alpha`) become `color`, the rest keep their names. Element `face` gives cells by its list `vertex_indices` or `vertex_index` and cell
//! arrays by its plain properties; `tristrips` gives strips, parted by -1. Other elements and lists are passed over with a note.

use super::push_face;
use crate::format::GridFile;
use crate::format::parse::{Binary, ParseError, Words, all_of, shown};
use crate::format::vtu::number::ByteOrder;
use crate::mesh::{CellType, Cells, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use glam::DVec3;

/// Properties that become one array.
const VECTORS: [(&[&str], &str); 3] =
    [(&["nx", "ny", "nz"], "normal"), (&["red", "green", "blue", "alpha"], "color"), (&["red", "green", "blue"], "color")];

/// Whether a file begins as PLY does.
pub fn recognizes(start: &[u8]) -> bool {
    start.starts_with(b"ply\n") || start.starts_with(b"ply\r\n")
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Debug)]
struct Property {
    name: String,
    kind: Kind,
    /// The type of the count in front of a list.
    list: Option<Kind>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// Where numbers come from.
enum Body<'a> {
    Text(Words<'a>),
    Binary(Binary<'a>),
}

/// Reads a PLY file.
pub fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let (elements, mut body) = header(&bytes)?;
    let mut grid = UnstructuredGrid::default();
    for element in &elements {
        let seen = body.at();
        element.check_room(&body)?;
        match element.name.as_str() {
            "vertex" if grid.points.is_empty() => vertices(element, &mut body, &mut grid, progress)?,
            "face" | "tristrips" => faces(element, &mut body, &mut grid, progress)?,
            _ => {
                element.each(&mut body, progress, |_, _| {}, |_, _, _| Ok(()))?;
                if element.count > 0 {
                    grid.notes.push(format!("{} elements \"{}\" were left out", element.count, element.name));
                }
            }
        }
        progress.add((body.at() - seen) as u64);
    }
    if grid.cell_data.iter().any(|array| array.tuples() != grid.cells.len()) {
        grid.cell_data.clear();
        grid.notes.push("properties of faces were left out, since there are strips or several elements of faces".into());
    }
    Ok(grid)
}

fn vertices(element: &Element, body: &mut Body<'_>, grid: &mut UnstructuredGrid, progress: &Progress) -> Result<(), ParseError> {
    if u32::try_from(element.count).is_err() {
        return Err(ParseError::Unsupported(format!("it has {} vertices, more than octetra can index", element.count)));
    }
    let position = |name: &str| element.properties.iter().position(|p| p.name == name && p.list.is_none());
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(position) else {
        return Err(ParseError::invalid("the header", "element vertex without x, y and z", "properties x, y and z"));
    };
    let mut columns = element.columns();
    element.each(body, progress, |property, value| columns[property].push(value), |_, _, _| Ok(()))?;
    let point = |i: usize| DVec3::new(columns[x].get(i), columns[y].get(i), columns[z].get(i));
    grid.points = (0..columns[x].len()).map(point).collect();
    grid.point_data = element.arrays(columns, &[x, y, z]);
    grid.notes.extend(element.lists_left_out(None));
    Ok(())
}

fn faces(element: &Element, body: &mut Body<'_>, grid: &mut UnstructuredGrid, progress: &Progress) -> Result<(), ParseError> {
    let is_corners = |p: &Property| p.list.is_some() && (p.name == "vertex_indices" || p.name == "vertex_index");
    let Some(corners) = element.properties.iter().position(is_corners) else {
        let found = format!("element {} without vertex_indices", element.name);
        return Err(ParseError::invalid("the header", found, "a list vertex_indices or vertex_index"));
    };
    let is_strips = element.name == "tristrips";
    let mut columns = element.columns();
    let mut cells = std::mem::take(&mut grid.cells);
    if cells.is_empty() {
        cells = Cells::with_capacity(element.count, 3 * element.count);
    }
    let mut ids: Vec<u32> = Vec::new();
    let list = |property: usize, values: &[f64], place: &dyn Fn() -> String| {
        if property != corners {
            return Ok(());
        }
        for part in values.split(|&v| is_strips && v == -1.0) {
            ids.clear();
            for &v in part {
                if !(0.0..4294967296.0).contains(&v) || v.fract() != 0.0 {
                    return Err(ParseError::invalid(place(), v.to_string(), "the number of a vertex, from 0"));
                }
                ids.push(v as u32);
            }
            match is_strips {
                true if ids.len() < 3 => {}
                true => cells.push(CellType::TRIANGLE_STRIP, &ids)?,
                false => push_face(&mut cells, &ids)?,
            }
        }
        Ok(())
    };
    element.each(body, progress, |property, value| columns[property].push(value), list)?;
    grid.cells = cells;
    grid.cell_data.extend(element.arrays(columns, &[]));
    grid.notes.extend(element.lists_left_out(Some(corners)));
    Ok(())
}

impl Element {
    /// `Err` if the rest of the file has no room for so many.
    fn check_room(&self, body: &Body<'_>) -> Result<(), ParseError> {
        let (rest, each) = match body {
            // A number is a digit and a blank at least.
            Body::Text(words) => (words.rest().len() + 1, 2 * self.properties.len()),
            Body::Binary(numbers) => (numbers.rest().len(), self.properties.iter().map(|p| p.list.unwrap_or(p.kind).size()).sum()),
        };
        if each.saturating_mul(self.count) > rest {
            let found = format!("{} elements \"{}\"", self.count, self.name);
            return Err(ParseError::invalid(body.place(), found, format!("no more than the {rest} bytes that are left have room for")));
        }
        Ok(())
    }

    /// Goes through all numbers: plain ones by their property, lists whole.
    fn each(
        &self,
        body: &mut Body<'_>,
        progress: &Progress,
        mut plain: impl FnMut(usize, f64),
        mut list: impl FnMut(usize, &[f64], &dyn Fn() -> String) -> Result<(), ParseError>,
    ) -> Result<(), ParseError> {
        let mut values = Vec::new();
        let count = if self.properties.is_empty() { 0 } else { self.count };
        for i in 0..count {
            if i % 4096 == 0 {
                progress.check()?;
            }
            for (index, property) in self.properties.iter().enumerate() {
                let Some(kind) = property.list else {
                    plain(index, body.number(property.kind, &property.name)?);
                    continue;
                };
                let len = body.number(kind, "the count of a list")?;
                let room = body.room() / if body.is_text() { 2 } else { property.kind.size() } + 1;
                if !(0.0..=room as f64).contains(&len) || len.fract() != 0.0 {
                    return Err(ParseError::invalid(
                        body.place(),
                        format!("a list of {len} numbers"),
                        "no more than the file has room for",
                    ));
                }
                values.clear();
                for _ in 0..len as usize {
                    values.push(body.number(property.kind, &property.name)?);
                }
                let place = body.place_of();
                list(index, &values, &place)?;
            }
        }
        Ok(())
    }

    /// Room for each property's numbers; nothing is stored in those of lists.
    fn columns(&self) -> Vec<Column> {
        let of = |p: &Property| match (p.list, p.kind) {
            (Some(_), _) => Column::Single(Vec::new()),
            (None, Kind::F64 | Kind::I32 | Kind::U32) => Column::Double(Vec::with_capacity(self.count)),
            (None, _) => Column::Single(Vec::with_capacity(self.count)),
        };
        self.properties.iter().map(of).collect()
    }

    /// Arrays of the plain properties but for some.
    fn arrays(&self, columns: Vec<Column>, but: &[usize]) -> Vec<DataArray> {
        let mut columns: Vec<Option<Column>> = columns.into_iter().map(Some).collect();
        let mut arrays = Vec::new();
        for i in 0..columns.len() {
            if but.contains(&i) || self.properties[i].list.is_some() || columns[i].is_none() {
                continue;
            }
            let starts = |names: &[&str]| {
                self.properties[i..].iter().zip(names).filter(|(p, name)| p.name == **name && p.list.is_none()).count() == names.len()
            };
            let (components, name) = VECTORS
                .iter()
                .find(|(names, _)| starts(names))
                .map_or((1, self.properties[i].name.clone()), |(names, name)| (names.len(), (*name).to_owned()));
            let parts: Vec<Column> = columns[i..i + components].iter_mut().filter_map(Option::take).collect();
            arrays.push(DataArray { name, components, values: interleaved(parts) });
        }
        arrays
    }

    fn lists_left_out(&self, but: Option<usize>) -> Vec<String> {
        let lists = self.properties.iter().enumerate().filter(|&(i, p)| p.list.is_some() && Some(i) != but);
        lists.map(|(_, p)| format!("the list \"{}\" of element \"{}\" was left out", p.name, self.name)).collect()
    }
}

/// The numbers of a property.
enum Column {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Column {
    fn push(&mut self, value: f64) {
        match self {
            Column::Single(values) => values.push(value as f32),
            Column::Double(values) => values.push(value),
        }
    }

    fn get(&self, i: usize) -> f64 {
        match self {
            Column::Single(values) => f64::from(values[i]),
            Column::Double(values) => values[i],
        }
    }

    fn len(&self) -> usize {
        match self {
            Column::Single(values) => values.len(),
            Column::Double(values) => values.len(),
        }
    }
}

/// Columns of one length as tuples.
fn interleaved(mut columns: Vec<Column>) -> Values {
    if let [one] = &mut columns[..] {
        return match one {
            Column::Single(values) => Values::F32(std::mem::take(values)),
            Column::Double(values) => Values::F64(std::mem::take(values)),
        };
    }
    let tuples = columns.first().map_or(0, Column::len);
    let all = (0..tuples).flat_map(|i| columns.iter().map(move |column| column.get(i)));
    if columns.iter().all(|column| matches!(column, Column::Single(_))) {
        Values::F32(all.map(|v| v as f32).collect())
    } else {
        Values::F64(all.collect())
    }
}

impl Kind {
    fn of(name: &[u8]) -> Option<Kind> {
        Some(match name {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }
}

impl Body<'_> {
    fn number(&mut self, kind: Kind, what: &str) -> Result<f64, ParseError> {
        Ok(match self {
            Body::Text(words) => words.real(what)?,
            Body::Binary(numbers) => match kind {
                Kind::I8 => f64::from(numbers.number::<i8>(what)?),
                Kind::U8 => f64::from(numbers.number::<u8>(what)?),
                Kind::I16 => f64::from(numbers.number::<i16>(what)?),
                Kind::U16 => f64::from(numbers.number::<u16>(what)?),
                Kind::I32 => f64::from(numbers.number::<i32>(what)?),
                Kind::U32 => f64::from(numbers.number::<u32>(what)?),
                Kind::F32 => f64::from(numbers.number::<f32>(what)?),
                Kind::F64 => numbers.number::<f64>(what)?,
            },
        })
    }

    fn is_text(&self) -> bool {
        matches!(self, Body::Text(_))
    }

    /// Bytes that are left.
    fn room(&self) -> usize {
        match self {
            Body::Text(words) => words.rest().len(),
            Body::Binary(numbers) => numbers.rest().len(),
        }
    }

    fn at(&self) -> usize {
        match self {
            Body::Text(words) => words.at(),
            Body::Binary(numbers) => numbers.at(),
        }
    }

    fn place(&self) -> String {
        match self {
            Body::Text(words) => words.place(),
            Body::Binary(numbers) => numbers.place(),
        }
    }

    fn place_of(&self) -> impl Fn() -> String + '_ {
        || self.place()
    }
}

/// The elements that the header announces, and what follows it.
fn header(bytes: &[u8]) -> Result<(Vec<Element>, Body<'_>), ParseError> {
    let mut lines = Words::new(bytes);
    if lines.rest_of_line() != Some(b"ply") {
        return Err(ParseError::invalid("line 1", shown(&bytes[..bytes.len().min(40)]), "ply"));
    }
    let mut elements: Vec<Element> = Vec::new();
    let mut format = None;
    loop {
        let place = lines.place();
        let line = lines.rest_of_line().ok_or_else(|| ParseError::invalid(&place, "the end of the file", "end_header"))?;
        let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).take(6).collect();
        let bad = |expected: &str| ParseError::invalid(&place, shown(line), expected);
        let text = |word: &[u8]| String::from_utf8_lossy(word).into_owned();
        let kind = |word: &[u8]| Kind::of(word).ok_or_else(|| bad("one of PLY's types, such as float or uchar"));
        match words[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"end_header"] => break,
            [b"format", b"ascii", ..] => format = Some(None),
            [b"format", b"binary_little_endian", ..] => format = Some(Some(ByteOrder::Little)),
            [b"format", b"binary_big_endian", ..] => format = Some(Some(ByteOrder::Big)),
            [b"element", name, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok());
                let count = count.ok_or_else(|| bad("element, a name and a count"))?;
                elements.push(Element { name: text(name), count, properties: Vec::new() });
            }
            [b"property", ..] => {
                let element = elements.last_mut().ok_or_else(|| bad("an element before its properties"))?;
                let property = match words[1..] {
                    [b"list", count, of, name] => Property { name: text(name), kind: kind(of)?, list: Some(kind(count)?) },
                    [of, name] => Property { name: text(name), kind: kind(of)?, list: None },
                    _ => return Err(bad("property, a type and a name, or property list, two types and a name")),
                };
                element.properties.push(property);
            }
            _ => return Err(bad("format, element, property, comment or end_header")),
        }
    }
    let body = match format {
        None => return Err(ParseError::invalid("the header", "no format", "format ascii, binary_little_endian or binary_big_endian")),
        Some(None) => Body::Text(lines),
        Some(Some(order)) => Body::Binary(Binary::new(bytes, lines.at(), order)),
    };
    Ok((elements, body))
}
