//! OpenFOAM cases (<https://doc.openfoam.com/2312/fundamentals/case-structure/>): a folder with the mesh in `constant/polyMesh` and the
//! fields of each time in a folder named by it.
//!
//! * A case is named by its folder, by an empty file beside its folders (`case.foam`, as ParaView has it), or by the folder of a time.
//! * Files are text or binary, with labels and scalars of 32 or 64 bits in either byte order, and may be packed by gzip.
//! * Without a time the last one is read. A mesh that moves or changes is read as of that time: from `TIME/polyMesh`, the latest before
//!   it, or `constant/polyMesh`.
//! * A decomposed case without a mesh of its own is put together from its folders `processor0`, `processor1` and so on: where they have
//!   `pointProcAddressing`, points that processors share become one.
//! * Cells are VTK's tets, pyramids, wedges and hexahedra where their faces make one, else polyhedra. `vol` fields become cell arrays,
//!   `point` fields point arrays; symmetric tensors get VTK's order. Of cell zones the array `cellZone` has the number of a cell's zone,
//!   from 0, unless one zone has all cells. Values of patches and fields on faces (`phi`) are left out, as are fields of several regions.

mod case;
mod cells;
mod fields;
mod pieces;
#[cfg(test)]
mod tests;
mod tokens;

use super::GridFile;
use super::parse::ParseError;
use super::series::Step;
use crate::mesh::{Association, UnstructuredGrid};
use crate::progress::Progress;
use case::{Place, Time};
use cells::Faces;
use fields::Kind;
use pieces::Piece;
use std::path::{Path, PathBuf};
use tokens::Tokens;

/// The suffixes of the empty file that stands for a case.
pub const SUFFIXES: &[&str] = &["foam", "openfoam"];

/// Bytes that show what a file holds.
const HEADER: u64 = 4096;

/// The array of the zones of cells.
const ZONES: &str = "cellZone";

/// Whether a path is a folder that is read as a case: the case's or a time's.
pub fn is_folder(path: &Path) -> bool {
    !path.is_file() && case::locate(path).is_some()
}

/// The times of a case as steps, if it has several.
pub fn steps(path: &Path) -> Option<Vec<Step>> {
    let Place { folder, time: None } = case::locate(path)? else { return None };
    let times = case::times(case::pieces(&folder).ok()?.first()?).ok()?;
    let step = |time: Time| Step { time: time.value, path: folder.join(time.name) };
    (times.len() > 1).then(|| times.into_iter().map(step).collect())
}

/// A case while it is read.
struct Reader<'a> {
    folder: PathBuf,
    progress: &'a Progress,
    notes: Vec<String>,
}

/// Reads a case.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<UnstructuredGrid, ParseError> {
    let place = case::locate(file.path).filter(|place| place.folder.is_dir());
    let Place { folder, time } =
        place.ok_or_else(|| ParseError::invalid("the case", "no folder constant/polyMesh beside it", "the folders of an OpenFOAM case"))?;
    let folders = case::pieces(&folder)?;
    if folders.is_empty() {
        let found = match folder.join("processors").exists() || has_collated(&folder) {
            true => "its processors' files are collated; reconstructPar makes one case of them",
            false => "it has no folder constant/polyMesh",
        };
        return Err(ParseError::invalid("the case", found, "constant/polyMesh or processor0, processor1 .."));
    }
    let mut reader = Reader { folder, progress, notes: vec![] };
    let times = case::times(&folders[0])?;
    let time = match time {
        Some(name) => Some(
            times
                .iter()
                .position(|time| time.name == name)
                .ok_or_else(|| ParseError::invalid("the case", format!("no time {name}"), "the name of the folder of one of its times"))?,
        ),
        None => times.len().checked_sub(1),
    };
    reader.note_times(&times, time, folders[0] == reader.folder);
    let upto = &times[..time.map_or(0, |time| time + 1)];
    progress.begin("reading", folders.len() as u64);
    let mut read = Vec::with_capacity(folders.len());
    for folder in &folders {
        read.push(reader.piece(folder, upto, time.is_some())?);
        progress.add(1);
    }
    let mut grid = if read.len() == 1 { read.swap_remove(0).grid } else { pieces::joined(read, &mut reader.notes)? };
    let fields = || grid.cell_data.iter().chain(&grid.point_data).filter(|array| array.name != ZONES);
    let shown = fields().find(|array| array.components == 1).or_else(|| fields().next());
    grid.active_scalars = shown.map(|array| array.name.clone());
    grid.notes = reader.notes;
    Ok(grid)
}

/// Whether the case was written with all processors' values in one file.
fn has_collated(folder: &Path) -> bool {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return false };
    entries.any(|entry| entry.is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with("processors")))
}

impl Reader<'_> {
    fn note_times(&mut self, times: &[Time], time: Option<usize>, is_whole: bool) {
        match (times, time) {
            ([first, .., last], Some(time)) => {
                let (name, count) = (&times[time].name, times.len());
                self.notes.push(format!("time {name} is shown, of {count} from {} to {}", first.name, last.name));
            }
            ([only], _) => self.notes.push(format!("time {}", only.name)),
            _ => self.notes.push("there are no folders of times, so the mesh has no fields".into()),
        }
        match case::processors(&self.folder).len() {
            0 => {}
            count if is_whole => self.notes.push(format!("the parts of {count} processors were left out: the case has a mesh of its own")),
            count => self.notes.push(format!("the mesh is put together from {count} processors")),
        }
    }

    /// Reads a file by a function, and says which file an error is in.
    fn with<T>(&self, path: &Path, most: u64, read: impl FnOnce(&mut Tokens<'_>) -> Result<T, ParseError>) -> Result<T, ParseError> {
        self.progress.check()?;
        let named = |problem: ParseError| match problem.cancelled() {
            Some(cancelled) => cancelled.into(),
            None => {
                let file = path.strip_prefix(&self.folder).unwrap_or(path).to_owned();
                ParseError::Other { file, problem: Box::new(problem) }
            }
        };
        let found = case::find(path).ok_or_else(|| named(std::io::Error::from(std::io::ErrorKind::NotFound).into()))?;
        let bytes = case::content(&found, most).map_err(|error| named(error.into()))?;
        Tokens::open(&bytes).and_then(|mut tokens| read(&mut tokens)).map_err(named)
    }

    /// The mesh and fields of a folder at the last of these times.
    fn piece(&mut self, folder: &Path, times: &[Time], has_time: bool) -> Result<Piece, ParseError> {
        let progress = self.progress;
        let instance = |name: &str, times: &[Time]| {
            let at = times.iter().rposition(|time| case::find(&folder.join(&time.name).join("polyMesh").join(name)).is_some());
            (at.map_or(folder.join("constant"), |at| folder.join(&times[at].name)).join("polyMesh"), at.unwrap_or(0))
        };
        let (mesh, since) = instance("faces", times);
        let (moved, _) = instance("points", &times[since.min(times.len())..]);
        let at = if case::find(&moved.join("points")).is_some() { &moved } else { &mesh };
        let points = self.with(&at.join("points"), u64::MAX, |tokens| {
            let most = tokens.room(3);
            tokens.scalars(3, most, "points", progress)
        })?;
        let (ends, face_points) = self.with(&mesh.join("faces"), u64::MAX, |tokens| tokens.faces(progress))?;
        let most = ends.len();
        let [owner, neighbour] = ["owner", "neighbour"].map(|name| {
            let expected = if name == "owner" { "owners of faces" } else { "neighbours of faces" };
            self.with(&mesh.join(name), u64::MAX, |tokens| tokens.labels(most, expected, progress))
        });
        let faces = Faces { ends, points: face_points, owner: owner?, neighbour: neighbour? };
        let mut piece = Piece::default();
        piece.grid.points = pieces::points(&points);
        piece.grid.cells = faces.cells(progress)?;
        drop((points, faces));
        if case::find(&mesh.join("pointProcAddressing")).is_some() {
            let most = piece.grid.points.len();
            let path = mesh.join("pointProcAddressing");
            piece.addresses = Some(self.with(&path, u64::MAX, |tokens| tokens.labels(most, "points of the whole", progress))?);
        }
        if let (true, Some(time)) = (has_time, times.last()) {
            self.fields(&folder.join(&time.name), &mut piece.grid)?;
        }
        // Behind the fields, so that it is not what is shown first.
        if let Some(zones) = self.zones(&mesh, piece.grid.cells.len())? {
            piece.grid.cell_data.push(zones);
        }
        Ok(piece)
    }

    /// The fields of a time.
    fn fields(&mut self, folder: &Path, grid: &mut UnstructuredGrid) -> Result<(), ParseError> {
        let mut names = Vec::new();
        for entry in std::fs::read_dir(folder)? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            match entry.path().is_file() {
                true if [".orig", ".bak", ".old", "~"].iter().any(|end| name.ends_with(end)) => {}
                true => names.push(name.strip_suffix(".gz").map(str::to_owned).unwrap_or(name)),
                false if name == "lagrangian" => self.note("the particles in lagrangian were left out".into()),
                false => {}
            }
        }
        names.sort();
        names.dedup();
        for name in names {
            let path = folder.join(&name);
            let class = match self.with(&path, HEADER, |tokens| Ok(tokens.header.class.clone())) {
                Ok(class) => class,
                Err(problem) if problem.cancelled().is_some() => return Err(problem),
                Err(problem) => {
                    self.note(format!("{name} was left out: {problem}"));
                    continue;
                }
            };
            match fields::kind(&class) {
                Kind::Field(of, components) => {
                    let tuples = if of == Association::Points { grid.points.len() } else { grid.cells.len() };
                    let field =
                        self.with(&path, u64::MAX, |tokens| match fields::read(tokens, (components, tuples), &name, self.progress) {
                            Err(ParseError::Unsupported(why)) => Ok(Err(why)),
                            field => field.map(Ok),
                        });
                    match (field?, of) {
                        (Ok(field), Association::Points) => grid.point_data.push(field),
                        (Ok(field), Association::Cells) => grid.cell_data.push(field),
                        (Err(why), _) => self.note(format!("{name} was left out: {why}")),
                    }
                }
                Kind::OnFaces => self.note(format!("{name} is a field on faces ({class}) and was left out")),
                Kind::None => self.note(format!("{name} is no field ({class}) and was left out")),
            }
        }
        Ok(())
    }

    /// Adds a note, once.
    fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
