//! Where the files of a case lie.

use super::super::parse::ParseError;
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A case, and the time that a path names, if it does.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub folder: PathBuf,
    /// As the time's folder is called.
    pub time: Option<String>,
}

/// A folder named by a time of a case.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Time {
    pub value: f64,
    pub name: String,
}

/// The case that a path stands for: the case's folder, a time's folder in it, or an empty file beside its folders.
pub(super) fn locate(path: &Path) -> Option<Place> {
    if is_case(path) {
        return Some(Place { folder: path.to_owned(), time: None });
    }
    let (parent, name) = (parent(path), path.file_name()?.to_str()?);
    if path.is_file() {
        let is_marker = path.extension().is_some_and(|suffix| super::SUFFIXES.iter().any(|known| suffix.eq_ignore_ascii_case(known)));
        return is_marker.then(|| Place { folder: parent.to_owned(), time: None });
    }
    time_of(name)?;
    // The times of a decomposed case are in the folders of its processors.
    is_case(parent).then(|| Place { folder: parent.to_owned(), time: Some(name.to_owned()) })
}

/// The folder of a file; that of a bare name is the current one.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether a folder is a case, whole or decomposed.
fn is_case(folder: &Path) -> bool {
    folder.join("constant/polyMesh").is_dir() || folder.join("processor0").is_dir() || !regions(folder).is_empty()
}

/// The regions of a case whose mesh is in several.
pub(super) fn regions(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder.join("constant")) else { return vec![] };
    let has_mesh = entries.flatten().filter(|entry| entry.path().join("polyMesh").is_dir());
    let mut names: Vec<String> = has_mesh.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The time that a folder's name says.
fn time_of(name: &str) -> Option<f64> {
    let is_number = name.trim_start_matches('-').starts_with(|c: char| c.is_ascii_digit());
    name.parse::<f64>().ok().filter(|time| is_number && time.is_finite())
}

/// The folders whose mesh makes up the case: its own, or those of its processors in order.
pub(super) fn pieces(folder: &Path) -> Result<Vec<PathBuf>, ParseError> {
    if folder.join("constant/polyMesh").is_dir() {
        return Ok(vec![folder.to_owned()]);
    }
    let processors = processors(folder);
    match regions(folder) {
        regions if regions.is_empty() || !processors.is_empty() => Ok(processors),
        regions => {
            let text = format!("its mesh is in several regions ({}), which octetra does not read", regions.join(", "));
            Err(ParseError::Unsupported(text))
        }
    }
}

/// The folders processor0, processor1 and so on.
pub(super) fn processors(folder: &Path) -> Vec<PathBuf> {
    (0..).map(|i| folder.join(format!("processor{i}"))).take_while(|folder| folder.is_dir()).collect()
}

/// The times of a folder, rising; of the same time in two spellings, the first by the alphabet.
pub(super) fn times(folder: &Path) -> io::Result<Vec<Time>> {
    let mut times = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if let (Some(name), true) = (entry.file_name().to_str(), entry.path().is_dir())
            && let Some(value) = time_of(name)
        {
            times.push(Time { value, name: name.to_owned() });
        }
    }
    times.sort_by(|a, b| a.value.total_cmp(&b.value).then_with(|| a.name.cmp(&b.name)));
    times.dedup_by(|a, b| a.value == b.value);
    Ok(times)
}

/// A file, or that file packed by gzip.
pub(super) fn find(path: &Path) -> Option<PathBuf> {
    let mut packed = path.as_os_str().to_owned();
    packed.push(".gz");
    [path.to_owned(), packed.into()].into_iter().find(|path| path.is_file())
}

/// The bytes of a file, unpacked, at most so many.
pub(super) fn content(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let mut bytes = Vec::new();
    if path.extension().is_some_and(|suffix| suffix == "gz") {
        MultiGzDecoder::new(file).take(most).read_to_end(&mut bytes)?;
    } else {
        bytes.try_reserve_exact(file.metadata()?.len().min(most) as usize)?;
        file.take(most).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}
