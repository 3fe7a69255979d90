//! EnSight Gold (<https://dav.lbl.gov/archive/NERSC/Software/ensight/doc/Manuals/UserManual.pdf>, chapter 11): a text `.case` that names
//! files of geometry and of values, which are text or C binary in either byte order.
//!
//! * All parts follow one behind the other; if there are several, the cell array `part` has each cell's number of its part.
//! * Scalars, vectors and tensors per node and per element are read, undefined and missing values become NaN; symmetric tensors get VTK's
//!   order. Constants, complex values and measured points are left out.
//! * Files that are there once for each time (`flow.****`) are read at the last time.
//! * Elements name the nodes of their part by place, whether or not the file numbers its nodes.
//! * EnSight 5 and 6, Fortran binary, structured blocks and files with all times in one are refused.

mod geometry;
mod input;
#[cfg(test)]
mod tests;

use super::GridFile;
use super::parse::{ParseError, Words, all_of, beside, content};
use crate::mesh::{DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use geometry::{Geometry, Part};
use input::Input;

/// The suffixes of the file that names the others.
pub const SUFFIXES: &[&str] = &["case", "encas"];

/// What a case names.
#[derive(Debug, Default)]
struct Case {
    is_gold: bool,
    model: Option<Named>,
    variables: Vec<Variable>,
    time_sets: Vec<TimeSet>,
    notes: Vec<String>,
}

/// A file, by a name that may have `*` where the number of a step goes.
#[derive(Debug, Clone)]
struct Named {
    time_set: Option<i64>,
    file: String,
}

#[derive(Debug)]
struct Variable {
    name: String,
    components: usize,
    is_of_nodes: bool,
    named: Named,
}

#[derive(Debug, Default)]
struct TimeSet {
    number: i64,
    steps: usize,
    start: i64,
    increment: i64,
    file_numbers: Vec<i64>,
    values: Vec<f64>,
}

/// Whether a file begins as a case does.
pub(super) fn recognizes(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.next() == Some("FORMAT") && lines.next().is_some_and(|line| line.starts_with("type:"))
}

/// Reads a case.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    let mut case = Case::parse(&bytes)?;
    let Some(model) = case.model.clone() else {
        return Err(ParseError::invalid("GEOMETRY", "no line \"model:\"", "the file of the geometry"));
    };
    if !case.is_gold {
        return Err(ParseError::Unsupported("is of EnSight 5 or 6; octetra reads EnSight Gold (type: ensight gold)".into()));
    }
    progress.begin("reading", 1 + case.variables.len() as u64);
    let bytes = case.content(file, &model)?;
    let other = |named: &Named, problem: ParseError| match problem.cancelled() {
        Some(cancelled) => cancelled.into(),
        None => ParseError::Other { file: case.file_name(named).into(), problem: Box::new(problem) },
    };
    let read = |bytes: &[u8]| -> Result<(Geometry, bool), ParseError> {
        let mut input = Input::geometry(bytes)?;
        Ok((geometry::read(&mut input, progress)?, matches!(input, Input::Binary(_))))
    };
    let geometry_bytes = bytes.len();
    let (mut geometry, _) = read(&bytes).map_err(|problem| other(&model, problem))?;
    let like = Input::geometry(&bytes)?;
    progress.add(1);
    let mut grid = UnstructuredGrid::default();
    // Values that a file leaves out are NaN: a small case cannot claim memory for them again and again.
    let mut room = (geometry_bytes as u64).saturating_mul(256) + (64 << 20);
    for variable in &case.variables {
        let bytes = case.content(file, &variable.named)?;
        let tuples = if variable.is_of_nodes { geometry.points.len() } else { geometry.cells.len() };
        room = (room + 256 * bytes.len() as u64).checked_sub(4 * (tuples * variable.components) as u64).ok_or_else(|| {
            ParseError::invalid("VARIABLE", format!("the array \"{}\"", variable.name), "no more values than the files have room for")
        })?;
        let array = values(&mut like.like(&bytes), variable, &geometry, progress).map_err(|problem| other(&variable.named, problem))?;
        if variable.is_of_nodes {
            grid.point_data.push(array)
        } else {
            grid.cell_data.push(array)
        }
        progress.add(1);
    }
    if geometry.parts.len() > 1 {
        let mut numbers = vec![f32::NAN; geometry.cells.len()];
        for part in &geometry.parts {
            part.blocks.iter().for_each(|(_, cells)| numbers[cells.clone()].fill(part.number as f32));
        }
        grid.cell_data.push(DataArray { name: "part".into(), components: 1, values: Values::F32(numbers) });
        let names: Vec<String> = geometry.parts.iter().take(10).map(|part| format!("{} {}", part.number, part.name)).collect();
        let more = if geometry.parts.len() > 10 { format!(" and {} more", geometry.parts.len() - 10) } else { String::new() };
        geometry.notes.push(format!("parts in the array part: {}{more}", names.join(", ")));
    }
    let time = case.time_sets.iter().find(|set| set.steps > 1);
    let time = time
        .map(|set| format!("the last of {} times is shown{}", set.steps, set.values.last().map_or(String::new(), |t| format!(", {t}"))));
    grid.notes = time.into_iter().chain(std::mem::take(&mut case.notes)).chain(geometry.notes).collect();
    grid.active_scalars =
        case.variables.iter().find(|variable| variable.components == 1).or(case.variables.first()).map(|v| v.name.clone());
    (grid.points, grid.cells) = (geometry.points, geometry.cells);
    Ok(grid)
}

impl Case {
    fn parse(bytes: &[u8]) -> Result<Case, ParseError> {
        let mut case = Case::default();
        let mut words = Words::with_comments(bytes, b'#');
        let mut section = String::new();
        // Lines without a key go on with the numbers of the line before.
        let mut key = String::new();
        while words.peek().is_some() {
            let place = words.place();
            let line = words.rest_of_line().unwrap_or_default();
            let line = String::from_utf8_lossy(line).into_owned();
            let bad =
                |expected: &str| ParseError::invalid(place.clone(), format!("\"{}\"", line.chars().take(60).collect::<String>()), expected);
            match line.split_once(':') {
                None if line.is_empty() => {}
                None if line.chars().all(|c| c.is_ascii_uppercase()) => (section, key) = (line, String::new()),
                None if key.is_empty() => return Err(bad("a section such as GEOMETRY, or a name and a colon")),
                None => case.entry(&section, &key, &line).ok_or_else(|| bad("more numbers"))?,
                Some((name, value)) => {
                    key = name.split_whitespace().collect::<Vec<_>>().join(" ");
                    case.entry(&section, &key, value.trim()).ok_or_else(|| bad("what the key needs"))?;
                }
            }
        }
        Ok(case)
    }

    /// `None` if the value does not suit the key.
    fn entry(&mut self, section: &str, key: &str, value: &str) -> Option<()> {
        let words: Vec<&str> = value.split_whitespace().collect();
        let numbers = || words.iter().map(|word| word.parse().ok()).collect::<Option<Vec<i64>>>();
        match (section, key) {
            ("FORMAT", "type") => self.is_gold = value == "ensight gold",
            ("GEOMETRY", "model") => {
                let words: Vec<&str> = words.into_iter().filter(|word| !matches!(*word, "change_coords_only" | "cstep")).collect();
                let (sets, file) = named(&words);
                self.model = Some(Named { time_set: sets, file: file.first()?.trim_matches('"').to_owned() });
            }
            ("GEOMETRY", _) => self.notes.push(format!("{key} was left out")),
            ("VARIABLE", _) => {
                let (kind, place) = key.split_once(" per ").unwrap_or((key, ""));
                let components = match kind {
                    "scalar" => 1,
                    "vector" => 3,
                    "tensor symm" => 6,
                    "tensor asym" => 9,
                    _ => 0,
                };
                let (time_set, rest) = named(&words);
                let name = rest.first().map_or("", |name| name);
                if components == 0 || !matches!(place, "node" | "element") {
                    self.notes.push(format!("{key} {name} was left out"));
                    return Some(());
                }
                let file = rest.get(1)?.trim_matches('"').to_owned();
                let variable =
                    Variable { name: name.to_owned(), components, is_of_nodes: place == "node", named: Named { time_set, file } };
                self.variables.push(variable);
            }
            ("TIME", "time set") => {
                self.time_sets.push(TimeSet { number: words.first()?.parse().ok()?, increment: 1, ..TimeSet::default() })
            }
            ("TIME", _) => {
                let set = self.time_sets.last_mut()?;
                match key {
                    "number of steps" => set.steps = value.parse().ok()?,
                    "filename start number" => set.start = value.parse().ok()?,
                    "filename increment" => set.increment = value.parse().ok()?,
                    "filename numbers" => set.file_numbers.extend(numbers()?),
                    "time values" => set.values.extend(words.iter().map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>()?),
                    _ => {}
                }
            }
            _ => {}
        }
        Some(())
    }

    /// The name of a file at the last step.
    fn file_name(&self, named: &Named) -> String {
        let Some(first) = named.file.find('*') else { return named.file.clone() };
        let width = named.file[first..].chars().take_while(|&c| c == '*').count();
        let set = self.time_sets.iter().find(|set| Some(set.number) == named.time_set).or(self.time_sets.first());
        let number = set.map_or(0, |set| {
            let last = set.steps.saturating_sub(1);
            let counted = i64::try_from(last).ok().and_then(|last| last.checked_mul(set.increment)?.checked_add(set.start));
            set.file_numbers.get(last).copied().or(counted).unwrap_or(0)
        });
        format!("{}{number:0width$}{}", &named.file[..first], &named.file[first + width..])
    }

    fn content(&self, file: &GridFile<'_>, named: &Named) -> Result<Vec<u8>, ParseError> {
        let name = self.file_name(named);
        let path = beside(file, &name)?;
        content(&path).map_err(|problem| ParseError::Other { file: name.into(), problem: Box::new(problem) })
    }
}

/// The time set of a line, which numbers before a name are the sets of times and files, and the words behind.
fn named<'a, 'b>(words: &'b [&'a str]) -> (Option<i64>, &'b [&'a str]) {
    let sets = words.iter().take(2).take_while(|word| word.parse::<i64>().is_ok()).count().min(words.len().saturating_sub(1));
    (words[..sets].first().and_then(|word| word.parse().ok()), &words[sets..])
}

/// The values of a variable.
fn values(input: &mut Input<'_>, variable: &Variable, geometry: &Geometry, progress: &Progress) -> Result<DataArray, ParseError> {
    let components = variable.components;
    let tuples = if variable.is_of_nodes { geometry.points.len() } else { geometry.cells.len() };
    let mut values = vec![f32::NAN; tuples * components];
    let first = input.line("a description")?;
    if first.eq_ignore_ascii_case("BEGIN TIME STEP") {
        return Err(ParseError::Unsupported("has all times in one file, which octetra does not read".into()));
    }
    let mut part: Option<&Part> = None;
    while let Some(line) = input.keyword()? {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap_or_default();
        if name == "part" {
            let number = input.integers(1, "the number of a part", progress)?[0];
            let found = geometry.parts.iter().find(|part| part.number == number);
            part = Some(found.ok_or_else(|| input.bad(&number.to_string(), "the number of a part of the geometry"))?);
            input.end_line();
            continue;
        }
        if let Some((_, count)) = part.and_then(|part| part.ghosts.iter().find(|(ghosts, _)| ghosts == name)) {
            input.reals(count * components, "a value", progress)?;
            continue;
        }
        let range = match (part, variable.is_of_nodes) {
            (Some(part), true) if name == "coordinates" => Some(part.points.clone()),
            (Some(part), false) => part.blocks.iter().find(|(block, _)| block == name).map(|(_, cells)| cells.clone()),
            _ => None,
        };
        let range = range.ok_or_else(|| input.bad(line, "part, or elements or coordinates that the part has"))?;
        let (mut undefined, mut places) = (None, None);
        match words.next() {
            None => {}
            Some("undef") => undefined = Some(input.reals(1, "the value that is undefined", progress)?[0]),
            Some("partial") => {
                let count = input.count(1 + components, "values")?;
                places = Some(input.integers(count, "where a value is", progress)?);
            }
            Some(_) => return Err(input.bad(line, "undef, partial or nothing more")),
        }
        let count = places.as_ref().map_or(range.len(), Vec::len);
        for component in 0..components {
            // Symmetric tensors are xx yy zz xy xz yz here, and with VTK xx yy zz xy yz xz.
            let to = if components == 6 { [0, 1, 2, 3, 5, 4][component] } else { component };
            let numbers = input.reals(count, "a value", progress)?;
            for (i, value) in numbers.into_iter().enumerate() {
                let place = match &places {
                    None => i,
                    Some(places) => {
                        let place = usize::try_from(places[i]).ok().filter(|place| (1..=range.len()).contains(place));
                        place.ok_or_else(|| input.bad(&places[i].to_string(), &format!("a place from 1 to {}", range.len())))? - 1
                    }
                };
                if Some(value) != undefined {
                    values[(range.start + place) * components + to] = value;
                }
            }
        }
    }
    Ok(DataArray { name: variable.name.clone(), components, values: Values::F32(values) })
}
