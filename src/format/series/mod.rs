//! Time series: the files of the steps, listed without reading them.
//!
//! * `.pvd`, ParaView's collection: `<DataSet timestep="0.5" file="flow_3.vtu"/>`, one file a step.
//! * `.series`, ParaView's list: `{"files": [{"name": "flow_3.vtu", "time": 0.5}]}`.
//! * A path with `*` in its file name, `flow_*.vtu`: the files of the folder with a number there, which is the time.
//! * An OpenFOAM case of several times, by its folder or `case.foam` in it: the folders of the times. The last is shown first.
//! * Files one by one: their last numbers are the times, where no two are the same; else the steps are counted from 0.

mod lists;
mod numbered;
#[cfg(test)]
mod tests;

use super::openfoam;
use super::vtu::VtuError;
pub use numbered::siblings;
use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

/// The suffixes of files that list steps, in lower case, without the dot.
pub const SUFFIXES: [&str; 2] = ["pvd", "series"];

/// The steps of a series, by rising time; there is at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    steps: Vec<Step>,
    /// The step to show if none is chosen.
    shown: usize,
}

/// A step of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Its time, finite: the list's, the number in the file's name, or the step's number.
    pub time: f64,
    /// Its file, of an OpenFOAM case its folder.
    pub path: PathBuf,
}

impl Step {
    /// Whether its file is there.
    pub fn exists(&self) -> bool {
        self.path.is_file() || openfoam::is_folder(&self.path)
    }
}

/// What is wrong with a series, its name aside.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is a directory or a device.
    #[error("not a regular file")]
    NotAFile,
    /// It is larger than a list is.
    #[error("has {0} bytes, expected at most {MOST_BYTES} of a list of files")]
    TooLarge(u64),
    /// It is no sound `.pvd` file.
    #[error("{0}")]
    Xml(Box<VtuError>),
    /// It is no sound `.series` file.
    #[error("expected {{\"files\": [{{\"name\": .., \"time\": ..}}, ..]}}: {0}")]
    Json(serde_json::Error),
    /// It has no steps.
    #[error("lists no file")]
    Empty,
    /// A time is no number.
    #[error("entry {entry} has the time \"{found}\", expected a finite number")]
    Time {
        /// Which entry, from 1.
        entry: usize,
        /// What it has, empty if it has none.
        found: String,
    },
    /// A file lies elsewhere.
    #[error("entry {entry} has the file \"{found}\", expected one in the list's folder or below, named without folders above it")]
    Outside {
        /// Which entry, from 1.
        entry: usize,
        /// What it has, empty if it has none.
        found: String,
    },
    /// A step has several files.
    #[error("lists {} files for the time {time} ({}{}), expected one a step; write the parts of a step into one .vtu file",
        files.len(), files[..files.len().min(3)].join(", "), if files.len() > 3 { ", .." } else { "" })]
    Parts {
        /// The time.
        time: f64,
        /// The files.
        files: Vec<String>,
    },
    /// A `*` where none can be, or several.
    #[error("expected one * in the file's name, for the steps' numbers, as in flow_*.vtu")]
    Pattern,
    /// No file has such a name.
    #[error("no file has a name like this with a number in place of *")]
    NoMatch,
    /// A file is there twice.
    #[error("is named twice")]
    Twice,
}

/// Why there is no list of steps.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct SeriesError {
    /// The list, pattern or file.
    pub path: PathBuf,
    /// What is wrong.
    pub problem: Box<Problem>,
}

/// Bytes that a list of files may have.
const MOST_BYTES: u64 = 1 << 28;

impl Series {
    /// The steps that a path stands for, and more files beside it; `None` if it is a single file of data. Whether the steps' files are there
    /// is not looked at.
    pub fn open(path: &Path, more: &[PathBuf]) -> Result<Option<Series>, SeriesError> {
        let named = |problem| SeriesError { path: path.to_owned(), problem: Box::new(problem) };
        let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !more.is_empty() {
            return numbered::files(path, more).map(Some);
        }
        if let Some(steps) = openfoam::steps(path) {
            let last = steps.len() - 1;
            return Series::new(steps).map(|series| Some(Series { shown: last, ..series })).map_err(named);
        }
        let steps = match suffix.as_str() {
            "pvd" => lists::pvd(path),
            "series" => lists::json(path),
            _ if is_pattern(path) => numbered::matching(path),
            _ => return Ok(None),
        };
        steps.and_then(Series::new).map(Some).map_err(named)
    }

    /// Steps in any order.
    fn new(mut steps: Vec<Step>) -> Result<Series, Problem> {
        steps.sort_by(|a, b| a.time.total_cmp(&b.time));
        if steps.is_empty() { Err(Problem::Empty) } else { Ok(Series { steps, shown: 0 }) }
    }

    /// The steps by rising time, at least one.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The step to show if none is chosen, by its number: the first, of an OpenFOAM case the last, since its first is what its solver began with.
    pub fn shown_first(&self) -> usize {
        self.shown
    }

    /// First and last time.
    pub fn span(&self) -> [f64; 2] {
        [self.steps[0].time, self.steps[self.steps.len() - 1].time]
    }

    /// The step whose time is the nearest, the earlier of two; `None` beyond the first and the last.
    pub fn nearest(&self, time: f64) -> Option<usize> {
        let [first, last] = self.span();
        let away = |step: &Step| (step.time - time).abs();
        let nearest = || (0..self.steps.len()).min_by(|&a, &b| away(&self.steps[a]).total_cmp(&away(&self.steps[b])));
        if (first..=last).contains(&time) { nearest() } else { None }
    }
}

/// Whether a file's name is a pattern: it has a `*`, and there is no such file.
pub fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains('*') && !path.exists()
}

/// Which of these files is there twice.
fn repeated(paths: &[PathBuf]) -> Option<&PathBuf> {
    let mut seen = HashSet::new();
    paths.iter().find(|path| !seen.insert(*path))
}
