//! Where data comes from, and where that is as seen from a folder.

use crate::format::{RawLayout, ReadOptions, SolutionFile};
use crate::mesh::Component;
use serde::{Deserialize, Serialize};
use std::path::{Component as Part, Path, PathBuf};

/// A mesh or volume by its file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Source {
    /// The file; `None`: the bundled mesh.
    pub file: Option<PathBuf>,
    /// The solution of a PLOT3D grid, if it is not beside it.
    pub solution: Option<PathBuf>,
    /// How to read plain bytes, if the file is of these.
    pub raw: Option<RawLayout>,
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

    /// How the file is read for a field within a budget of memory.
    pub fn options(&self, array: Option<String>, component: Component, memory_bytes: u64) -> ReadOptions {
        let component = match component {
            Component::Magnitude => None,
            Component::Index(index) => Some(index),
        };
        let solution = self.solution.clone().map_or(SolutionFile::Beside, SolutionFile::At);
        ReadOptions { array, component, raw: self.raw.clone(), memory_bytes, solution, ..Default::default() }
    }

    /// The same with other paths.
    pub fn map(self, to: impl Fn(PathBuf) -> PathBuf) -> Self {
        Source { file: self.file.map(&to), solution: self.solution.map(&to), raw: self.raw }
    }
}

/// A path as seen from a folder, if the two have more than the root in common; else the path in full.
pub fn relative_to(folder: &Path, path: &Path) -> PathBuf {
    let full = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned());
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
        assert_eq!(runs.join(relative_to(&runs, &file)).canonicalize().ok(), file.canonicalize().ok());
    }

    #[cfg(unix)]
    #[test]
    fn what_has_nothing_in_common_stays_in_full() {
        assert_eq!(relative_to(Path::new("/one/two"), Path::new("/three/four.vtu")), Path::new("/three/four.vtu"));
    }
}
