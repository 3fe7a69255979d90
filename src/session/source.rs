//! Where data comes from, and where that is as seen from a folder.

use crate::format::segy::SegyOptions;
use crate::format::series::{Series, SeriesError};
use crate::format::{RawLayout, ReadOptions, SolutionFile};
use crate::mesh::Component;
use serde::{Deserialize, Serialize};
use std::path::{Component as Part, Path, PathBuf};

/// A mesh or volume by its file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Source {
    /// The file, or what stands for a series of them, as [`Series::open`] takes it; `None`: the bundled mesh.
    pub file: Option<PathBuf>,
    /// More files, if those of a series are named one by one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub more: Vec<PathBuf>,
    /// The step of a series, from 0; `None`: the first, of an OpenFOAM case the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<usize>,
    /// The solution of a PLOT3D grid, if it is not beside it.
    pub solution: Option<PathBuf>,
    /// How to read plain bytes, if the file is of these.
    pub raw: Option<RawLayout>,
    /// How to read SEG-Y, where the file does not say so itself.
    #[serde(skip_serializing_if = "SegyOptions::is_default")]
    pub segy: SegyOptions,
}

impl Source {
    /// A file that says itself what it is.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Source { file: Some(path.into()), ..Source::default() }
    }

    /// What the data is called: the file's stem, or the bundled mesh's.
    pub fn stem(&self) -> String {
        self.file.as_deref().and_then(Path::file_stem).map_or("wing".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// The steps, if it is a series.
    pub fn series(&self) -> Result<Option<Series>, SeriesError> {
        self.file.as_deref().map_or(Ok(None), |file| Series::open(file, &self.more))
    }

    /// The same for the file of one step.
    pub fn at(&self, file: &Path) -> Self {
        Source { file: Some(file.to_owned()), more: vec![], step: None, ..self.clone() }
    }

    /// How the file is read for a field within a budget of memory.
    pub fn options(&self, array: Option<String>, component: Component, memory_bytes: u64) -> ReadOptions {
        let component = match component {
            Component::Magnitude => None,
            Component::Index(index) => Some(index),
        };
        let solution = self.solution.clone().map_or(SolutionFile::Beside, SolutionFile::At);
        ReadOptions { array, component, raw: self.raw.clone(), memory_bytes, solution, segy: self.segy.clone(), ..Default::default() }
    }

    /// The same with other paths.
    pub fn map(self, to: impl Fn(PathBuf) -> PathBuf) -> Self {
        let more = self.more.into_iter().map(&to).collect();
        Source { file: self.file.map(&to), more, solution: self.solution.map(&to), ..self }
    }
}

/// A path as seen from a folder, if the two have more than the root in common; else the path in full.
pub fn relative_to(folder: &Path, path: &Path) -> PathBuf {
    // A pattern is no file, but its folder is one.
    let beside = |path: &Path| Some(path.parent()?.canonicalize().ok()?.join(path.file_name()?));
    let full = |path: &Path| path.canonicalize().ok().or_else(|| beside(path)).or_else(|| std::path::absolute(path).ok());
    let full = |path: &Path| full(path).unwrap_or_else(|| path.to_owned());
    let (folder, path) = (full(folder), full(path));
    let (from, to): (Vec<Part>, Vec<Part>) = (folder.components().collect(), path.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if !from[..common].iter().any(|part| matches!(part, Part::Normal(_))) {
        return path;
    }
    let up = from[common..].iter().map(|_| Part::ParentDir);
    up.chain(to[common..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_the_folder_to_the_file() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let (runs, data) = (root.path().join("runs/one"), root.path().join("data"));
        for folder in [&runs, &data] {
            std::fs::create_dir_all(folder).expect("a folder");
        }
        let file = data.join("flow.vtu");
        std::fs::write(&file, "").expect("written");
        assert_eq!(relative_to(&data, &file), Path::new("flow.vtu"));
        assert_eq!(relative_to(root.path(), &file), Path::new("data/flow.vtu"));
        assert_eq!(relative_to(&runs, &file), Path::new("../../data/flow.vtu"));
        assert_eq!(relative_to(&runs, &data.join("flow_*.vtu")), Path::new("../../data/flow_*.vtu"));
        assert_eq!(runs.join(relative_to(&runs, &file)).canonicalize().ok(), file.canonicalize().ok());
    }

    #[cfg(unix)]
    #[test]
    fn what_has_nothing_in_common_stays_in_full() {
        assert_eq!(relative_to(Path::new("/one/two"), Path::new("/three/four.vtu")), Path::new("/three/four.vtu"));
    }
}
