//! Wavefront OBJ (Wavefront, "Advanced Visualizer Manual", appendix B1; <https://paulbourke.net/dataformats/obj/>).
//!
//! Read are vertices (`v`), faces (`f`), lines (`l`) and points (`p`), numbered from 1 or, negative, back from the last vertex; a backslash
//! at the end of a line goes on in the next. Texture coordinates, normals, colours, materials and free-form curves and surfaces
//! are left out with a note; groups and objects (`g`, `o`) become a cell array `group` if there are several.

use super::push_face;
use crate::format::GridFile;
use crate::format::parse::{ParseError, Words, all_of, real, shown};
use crate::mesh::{CellType, DataArray, UnstructuredGrid, Values};
use crate::progress::Progress;
use glam::DVec3;

/// Statements that carry something which is not kept, and what that is.
const LEFT_OUT: [(&[&str], &str); 3] = [
    (&["vt", "vn", "vp"], "texture coordinates, normals or parameters of vertices"),
    (&["usemtl", "mtllib", "usemap", "maplib"], "materials"),
    (
        &["curv", "curv2", "surf", "cstype", "deg", "bmat", "step", "parm", "trim", "hole", "scrv", "sp", "con"],
        "free-form curves or surfaces",
    ),
];

/// Whether a file begins as an OBJ does: a statement that only OBJ has, for there is no keyword.
pub fn recognizes(start: &[u8]) -> bool {
    let mut words = Words::with_comments(start, b'#');
    words.next().is_some_and(|word| word == b"mtllib")
}

/// Reads an OBJ file.
pub fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let bytes = all_of(file)?;
    progress.begin("reading", bytes.len() as u64);
    let mut words = Words::with_comments(&bytes, b'#');
    let mut found = Obj::default();
    let (mut seen, mut lines, mut longer) = (0, 0u64, Vec::new());
    loop {
        let place = words.place();
        let Some(mut line) = words.rest_of_line() else { break };
        longer.clear();
        while let Some(start) = line.strip_suffix(b"\\") {
            longer.extend_from_slice(start);
            longer.push(b' ');
            line = words.rest_of_line().unwrap_or_default();
        }
        if longer.is_empty() {
            found.statement(line, &place)?;
        } else {
            longer.extend_from_slice(line);
            found.statement(&longer, &place)?;
        }
        lines += 1;
        if lines % 4096 == 0 {
            progress.check()?;
            progress.add((words.at() - seen) as u64);
            seen = words.at();
        }
    }
    found.grid()
}

/// What was read so far.
#[derive(Default)]
struct Obj {
    grid: UnstructuredGrid,
    groups: Vec<f32>,
    group: u32,
    /// Whether the group has a name but no cell yet.
    is_empty_group: bool,
    left_out: [bool; LEFT_OUT.len()],
    colors: bool,
    /// The first statement that is none of OBJ, with its place.
    unknown: Option<String>,
    corners: Vec<u32>,
}

impl Obj {
    fn statement(&mut self, line: &[u8], place: &str) -> Result<(), ParseError> {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            b"v" => {
                let mut point = [0.0; 3];
                for x in &mut point {
                    let word = words.next().unwrap_or_default();
                    *x = real(word).ok_or_else(|| ParseError::invalid(place, shown(word), "three coordinates"))?;
                }
                self.colors |= words.count() >= 3; // one more is a weight
                if u32::try_from(self.grid.points.len() + 1).is_err() {
                    return Err(ParseError::Unsupported("it has more vertices than octetra can index".into()));
                }
                self.grid.points.push(DVec3::from_array(point));
            }
            b"f" | b"fo" | b"l" | b"p" => {
                self.corners.clear();
                for word in words {
                    let corner = corner(word, self.grid.points.len());
                    let expected = "the number of a vertex, from 1, or a negative one back from the last vertex before it";
                    self.corners.push(corner.ok_or_else(|| ParseError::invalid(place, shown(word), expected))?);
                }
                self.cells(keyword, place)?;
            }
            b"g" | b"o" => {
                self.group += u32::from(!self.is_empty_group && !self.grid.cells.is_empty());
                self.is_empty_group = true;
            }
            b"s" | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj" | b"trace_obj" | b"end" | b"call" | b"csh"
            | b"ctech" | b"stech" => {}
            _ => match LEFT_OUT.iter().position(|(names, _)| names.iter().any(|name| name.as_bytes() == keyword)) {
                Some(kind) => self.left_out[kind] = true,
                None => {
                    self.unknown.get_or_insert_with(|| format!("{place}: {}", shown(keyword)));
                }
            },
        }
        Ok(())
    }

    /// Adds what a statement with `self.corners` describes.
    fn cells(&mut self, keyword: &[u8], place: &str) -> Result<(), ParseError> {
        let cells = &mut self.grid.cells;
        let before = cells.len();
        match (keyword, self.corners.len()) {
            (b"f" | b"fo", 3..) => push_face(cells, &self.corners)?,
            (b"l", 2) => cells.push(CellType::LINE, &self.corners)?,
            (b"l", 3..) => cells.push(CellType::POLY_LINE, &self.corners)?,
            (b"p", 1..) => self.corners.iter().try_for_each(|&point| cells.push(CellType::VERTEX, &[point]))?,
            (_, found) => {
                let expected = if keyword == b"l" {
                    "2 or more"
                } else if keyword == b"p" {
                    "1 or more"
                } else {
                    "3 or more"
                };
                return Err(ParseError::invalid(place, format!("{} with {found} vertices", shown(keyword)), expected));
            }
        }
        self.groups.extend(std::iter::repeat_n(self.group as f32, self.grid.cells.len() - before));
        self.is_empty_group = false;
        Ok(())
    }

    fn grid(self) -> Result<UnstructuredGrid, ParseError> {
        let mut grid = self.grid;
        if let (true, Some(unknown)) = (grid.points.is_empty(), &self.unknown) {
            return Err(ParseError::Unsupported(format!("{unknown}, expected statements of an OBJ file, such as v and f")));
        }
        if self.group > 0 {
            grid.cell_data.push(DataArray { name: "group".into(), components: 1, values: Values::F32(self.groups) });
        }
        let left_out = LEFT_OUT.iter().zip(self.left_out).filter(|(_, found)| *found);
        grid.notes.extend(left_out.map(|((_, what), _)| format!("{what} were left out")));
        if self.colors {
            grid.notes.push("colours of vertices were left out".into());
        }
        if let Some(unknown) = self.unknown {
            grid.notes.push(format!("{unknown} is no statement of OBJ and was passed over, as were others like it"));
        }
        Ok(grid)
    }
}

/// The vertex that a word such as `3/1/2` or `-1` names, from 0, if it is among so many or, counted forward, may still come.
fn corner(word: &[u8], vertices: usize) -> Option<u32> {
    let number = word.split(|&b| b == b'/').next()?;
    let number: i64 = std::str::from_utf8(number).ok()?.parse().ok()?;
    match number {
        1.. => u32::try_from(number - 1).ok(),
        0 => None,
        _ => u32::try_from(i64::try_from(vertices).ok()?.checked_add(number)?).ok(),
    }
}
