//! SU2's `.su2` (<https://su2code.github.io/docs_v7/Mesh-File/>).
//!
//! - `su2:tag` is 0 for the cells of `NELEM` and counts markers from 1 for those of `MARKER_ELEMS`, as meshio does; a marker whose tag is a
//!   whole number has that. Their names are in a note.
//! - Behind the points of a line, its own number may stand, which is passed over: cells and points are counted from 0 as they stand.
//! - Cells are of VTK's types, the quadratic ones that Gmsh writes too.
//! - Zones (`NZONE`) follow each other, each with points of its own.
//! - Other keywords (periodicity, FFD boxes) are passed over, with a note.

use super::GridFile;
use super::parse::{ParseError, Words, all_of, shown, whole_numbers};
use crate::mesh::{CellType, Cells, UnstructuredGrid};
use crate::progress::Progress;
use glam::DVec3;

/// Lines between two looks at the progress.
const CHECKED: usize = 4096;

/// Names that a note lists at most.
const MOST_NAMED: usize = 40;

/// Reads a mesh.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut mesh = Mesh::new(&bytes, progress);
    mesh.read()?;
    Ok(mesh.into_grid())
}

/// What was read so far.
struct Mesh<'a> {
    words: Words<'a>,
    progress: &'a Progress,
    /// 0 as long as it is not known.
    dimension: usize,
    points: Vec<DVec3>,
    /// The first point of the zone.
    first_point: u32,
    cells: Cells,
    tags: Vec<f64>,
    /// The tag of the marker's cells that follow.
    marker: i64,
    markers: Vec<String>,
    passed_over: Vec<String>,
    /// Lines where a keyword should stand.
    stray: u64,
}

impl<'a> Mesh<'a> {
    fn new(bytes: &'a [u8], progress: &'a Progress) -> Self {
        Mesh {
            words: Words::with_comments(bytes, b'%'),
            progress,
            dimension: 0,
            points: Vec::new(),
            first_point: 0,
            cells: Cells::default(),
            tags: Vec::new(),
            marker: 0,
            markers: Vec::new(),
            passed_over: Vec::new(),
            stray: 0,
        }
    }

    fn read(&mut self) -> Result<(), ParseError> {
        let (mut has_points, mut has_cells) = (false, false);
        loop {
            let place = self.words.place();
            let Some(line) = self.words.rest_of_line() else { break };
            let Some(equals) = line.iter().position(|&b| b == b'=') else {
                self.stray += u64::from(!line.is_empty());
                continue;
            };
            let keyword = String::from_utf8_lossy(line[..equals].trim_ascii()).to_ascii_uppercase();
            let value = line[equals + 1..].trim_ascii();
            let number = || {
                let word = value.split(u8::is_ascii_whitespace).next().unwrap_or_default();
                let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<u64>().ok());
                number.ok_or_else(|| ParseError::invalid(&place, format!("{keyword}= {}", shown(value)), "a number"))
            };
            match keyword.as_str() {
                "NDIME" => match number()? {
                    dimension @ 2..=3 => self.dimension = dimension as usize,
                    other => return Err(ParseError::invalid(place, format!("NDIME= {other}"), "2 or 3")),
                },
                "NELEM" => {
                    has_cells = true;
                    self.read_cells(number()?, 0)?;
                }
                "NPOIN" => {
                    has_points = true;
                    self.read_points(number()?)?;
                }
                "MARKER_TAG" => {
                    let tag = std::str::from_utf8(value).ok().and_then(|tag| tag.parse().ok());
                    self.marker = tag.unwrap_or(self.marker.saturating_add(1));
                    if tag.is_none() && self.markers.len() < MOST_NAMED {
                        self.markers.push(format!("{} is {}", self.marker, shown(value)));
                    }
                }
                "MARKER_ELEMS" => self.read_cells(number()?, self.marker)?,
                "IZONE" => {
                    let first = u32::try_from(self.points.len());
                    self.first_point = first.map_err(|_| ParseError::invalid(place, "too many points", "fewer than 2^32"))?;
                    self.marker = 0;
                }
                "NMARK" | "NZONE" => {}
                _ if self.passed_over.len() < MOST_NAMED && !self.passed_over.contains(&keyword) => self.passed_over.push(keyword),
                _ => {}
            }
        }
        for (is_there, name) in [(has_points, "NPOIN="), (has_cells, "NELEM=")] {
            if !is_there {
                return Err(ParseError::invalid("the file", format!("no {name}"), "one"));
            }
        }
        Ok(())
    }

    /// Lines of a VTK type, the points, and perhaps a number of the cell.
    fn read_cells(&mut self, count: u64, tag: i64) -> Result<(), ParseError> {
        let count = self.room(count, "cells")?;
        for i in 0..count {
            self.check(i)?;
            let number = self.words.integer("a type of cells")?;
            let line = self.words.line();
            let cell_type = match number {
                1 | 3 | 5 | 9 | 10 | 12..=14 | 21..=29 | 32 => CellType(number),
                _ => {
                    let found = format!("a cell of type {number}");
                    let expected = "VTK's 1, 3, 5, 9, 10, 12, 13, 14 or a quadratic one";
                    return Err(ParseError::invalid(self.words.place(), found, expected));
                }
            };
            let mut cell = [0; 27];
            let points = cell_type.points().unwrap_or_default();
            for place in &mut cell[..points] {
                let point: u32 = self.words.integer("a point of a cell")?;
                let beyond = || ParseError::invalid(self.words.place(), format!("point {point}"), "fewer than 2^32 points");
                *place = point.checked_add(self.first_point).ok_or_else(beyond)?;
            }
            self.end_line(line, "points of a cell")?;
            self.cells.push(cell_type, &cell[..points])?;
            self.tags.push(tag as f64);
        }
        Ok(())
    }

    fn read_points(&mut self, count: u64) -> Result<(), ParseError> {
        if self.dimension == 0 {
            return Err(ParseError::invalid(self.words.place(), "NPOIN= without NDIME= before it", "NDIME= 2 or 3"));
        }
        let count = self.room(count, "points")?;
        self.points.reserve(count);
        for i in 0..count {
            self.check(i)?;
            let mut point = [0.0; 3];
            let mut line = 0;
            for (axis, coordinate) in point[..self.dimension].iter_mut().enumerate() {
                *coordinate = self.words.real("a coordinate")?;
                if axis == 0 {
                    line = self.words.line();
                }
            }
            self.end_line(line, "coordinates")?;
            self.points.push(DVec3::from_array(point));
        }
        Ok(())
    }

    /// Passes over what is left of a line, which must be the one that its numbers began in.
    fn end_line(&mut self, line: usize, what: &str) -> Result<(), ParseError> {
        if self.words.line() != line {
            return Err(ParseError::invalid(format!("line {line}"), format!("too few {what}"), "all of them in one line"));
        }
        self.words.rest_of_line();
        Ok(())
    }

    /// Checks a count of lines against what is left of the file.
    fn room(&self, count: u64, what: &str) -> Result<usize, ParseError> {
        if count.saturating_mul(4) > self.words.rest().len() as u64 + 1 {
            return Err(ParseError::invalid(self.words.place(), format!("{count} {what}"), "no more than the file has room for"));
        }
        Ok(count as usize)
    }

    /// Tells how far it is, now and then.
    fn check(&mut self, i: usize) -> Result<(), ParseError> {
        if i.is_multiple_of(CHECKED) {
            self.progress.check()?;
            let (_, done, _) = self.progress.snapshot();
            self.progress.add((self.words.at() as u64).saturating_sub(done));
        }
        Ok(())
    }

    fn into_grid(self) -> UnstructuredGrid {
        let mut notes = Vec::new();
        if !self.markers.is_empty() {
            notes.push(format!("the names of markers are not kept, only their numbers in su2:tag: {}", self.markers.join(", ")));
        }
        if !self.passed_over.is_empty() {
            notes.push(format!("keywords were passed over: {}", self.passed_over.join(", ")));
        }
        let cell_data = vec![whole_numbers("su2:tag", &self.tags)];
        if self.stray > 0 {
            notes.push(format!("lines that belong to no keyword were passed over: {}", self.stray));
        }
        UnstructuredGrid { points: self.points, cells: self.cells, cell_data, notes, ..UnstructuredGrid::default() }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::parse::parsed;
    use super::*;
    use crate::mesh::Values;

    pub(in crate::format) const TET: &str = "% a tet\nNDIME= 3\nNELEM=1\n10 0 1 2 3 0\nNPOIN= 4 4\n0 0 0 0\n1 0 0\t1\n0 1 0 2\n\n0 0 1.5e0 3\n\
        NMARK= 2\nMARKER_TAG= wall\nMARKER_ELEMS= 1\n5 0 1 2 % one\nMARKER_TAG= far\nMARKER_ELEMS= 2\n5 0 1 3\n5 1 2 3\nFFD_NBOX= 1\n";

    #[test]
    fn cells_markers_and_points() {
        let grid = parsed(read, TET.as_bytes()).expect("sound");
        assert_eq!((grid.points.len(), grid.points[3]), (4, DVec3::Z * 1.5));
        assert_eq!(grid.cells.get(0), (CellType::TETRA, &[0, 1, 2, 3][..]));
        assert_eq!(grid.cells.get(3), (CellType::TRIANGLE, &[1, 2, 3][..]));
        assert_eq!(grid.cell_data[0].values, Values::F32(vec![0.0, 1.0, 2.0, 2.0]));
        assert_eq!(grid.notes[0], "the names of markers are not kept, only their numbers in su2:tag: 1 is \"wall\", 2 is \"far\"");
        assert_eq!(grid.notes[1], "keywords were passed over: FFD_NBOX");
    }

    #[test]
    fn zones_have_points_of_their_own() {
        let zone = "NDIME= 2\nNELEM= 1\n5 0 1 2\nNPOIN= 3\n0 0\n1 0\n0 1\nNMARK= 1\nMARKER_TAG= 7\nMARKER_ELEMS= 1\n3 0 1\n";
        let grid = parsed(read, format!("NZONE= 2\nIZONE= 1\n{zone}IZONE= 2\n{zone}").as_bytes()).expect("sound");
        assert_eq!(grid.cells.iter().map(|(_, points)| points[0]).collect::<Vec<_>>(), [0, 0, 3, 3]);
        assert_eq!(grid.cell_data[0].values, Values::F32(vec![0.0, 7.0, 0.0, 7.0]));
        assert!(grid.notes.is_empty() && grid.points[5] == DVec3::Y);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let error = |text: &str| parsed(read, text.as_bytes()).expect_err("not sound").to_string();
        for (found, expected) in [
            (error("hello"), "the file: no NPOIN=, expected one"),
            (error(&TET.replace("5 0 1 3", "5 0 1")), "line 17: too few points of a cell, expected all of them in one line"),
            (error(&TET.replace("10 0 1 2 3 0", "11 0 1 2 3 0")), "line 4: a cell of type 11, expected VTK's 1, 3"),
            (error(&TET.replace("10 0 1 2 3 0", "10 0 1 -2 3 0")), "line 4: \"-2\", expected a point of a cell"),
            (error(&TET.replace("1 0 0\t1", "1 0")), "line 7: too few coordinates, expected all of them in one line"),
            (error(&TET.replace("NPOIN= 4 4", "NPOIN= 4000")), "line 6: 4000 points, expected no more than the file has room for"),
            (error(&TET.replace("NDIME= 3", "NDIME= 4")), "line 2: NDIME= 4, expected 2 or 3"),
            (error(&TET.replace("NELEM=1", "NELEM=x")), "line 3: NELEM= \"x\", expected a number"),
            (error("NELEM= 0\nNPOIN= 0\n"), "line 3: NPOIN= without NDIME= before it, expected NDIME= 2 or 3"),
        ] {
            assert!(found.contains(expected), "{found}\n{expected}");
        }
    }
}
