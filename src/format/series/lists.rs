//! Files that list steps: ParaView's `.pvd` and `.series`.

use super::super::source::Source;
use super::super::vtu::{VtuError, xml};
use super::{MOST_BYTES, Problem, Step};
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The content of a list.
fn content(path: &Path) -> Result<Vec<u8>, Problem> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(Problem::NotAFile);
    }
    if metadata.len() > MOST_BYTES {
        return Err(Problem::TooLarge(metadata.len()));
    }
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The steps of a `.pvd` file (<https://www.paraview.org/Wiki/ParaView/Data_formats#PVD_File_Format>).
pub fn pvd(path: &Path) -> Result<Vec<Step>, Problem> {
    let bytes = content(path)?;
    let data_sets = xml::read_collection(&Source::Bytes(&bytes)).map_err(|error| match error {
        VtuError::Io(error) => Problem::Io(error),
        error => Problem::Xml(Box::new(error)),
    })?;
    let mut steps = Vec::with_capacity(data_sets.len());
    for (i, data_set) in data_sets.iter().enumerate() {
        let written = data_set.timestep.clone().unwrap_or_default();
        let time = written.parse::<f64>().ok().filter(|time| time.is_finite());
        let time = time.ok_or(Problem::Time { entry: i + 1, found: written })?;
        steps.push(Step { time, path: beside(path, data_set.file.as_deref().unwrap_or_default(), i + 1)? });
    }
    one_a_time(path, steps)
}

/// The steps of a `.series` file (<https://www.paraview.org/Wiki/ParaView/Data_formats#File_series>); without times they are counted.
pub fn json(path: &Path) -> Result<Vec<Step>, Problem> {
    #[derive(Deserialize)]
    struct List {
        files: Vec<Entry>,
    }
    #[derive(Deserialize)]
    struct Entry {
        name: String,
        time: Option<f64>,
    }
    let List { files } = serde_json::from_slice(&content(path)?).map_err(Problem::Json)?;
    let is_timed = files.iter().any(|entry| entry.time.is_some());
    let mut steps = Vec::with_capacity(files.len());
    for (i, entry) in files.iter().enumerate() {
        let time = if is_timed { entry.time } else { Some(i as f64) };
        let time = time.ok_or(Problem::Time { entry: i + 1, found: String::new() })?;
        steps.push(Step { time, path: beside(path, &entry.name, i + 1)? });
    }
    one_a_time(path, steps)
}

/// A file that a list names, which must lie in its folder or below.
fn beside(list: &Path, name: &str, entry: usize) -> Result<PathBuf, Problem> {
    let relative = Path::new(name.trim());
    let is_below = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if name.trim().is_empty() || !is_below {
        return Err(Problem::Outside { entry, found: name.chars().take(100).collect() });
    }
    Ok(list.parent().unwrap_or(Path::new("")).join(relative))
}

/// `Err` if a time has several files.
fn one_a_time(list: &Path, mut steps: Vec<Step>) -> Result<Vec<Step>, Problem> {
    steps.sort_by(|a, b| a.time.total_cmp(&b.time));
    match steps.chunk_by(|a, b| a.time == b.time).find(|same| same.len() > 1) {
        None => Ok(steps),
        Some(same) => {
            let folder = list.parent().unwrap_or(Path::new(""));
            let name = |step: &Step| step.path.strip_prefix(folder).unwrap_or(&step.path).display().to_string();
            Err(Problem::Parts { time: same[0].time, files: same.iter().map(name).collect() })
        }
    }
}
