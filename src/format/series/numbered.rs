//! Steps by the numbers in their files' names.

use super::{Problem, Series, SeriesError, Step, repeated};
use std::path::{Path, PathBuf};

/// The files of a folder whose names are a pattern's with a number in place of its `*`.
pub fn matching(pattern: &Path) -> Result<Vec<Step>, Problem> {
    let name = pattern.file_name().and_then(|name| name.to_str()).ok_or(Problem::Pattern)?;
    let (before, after) = name.split_once('*').filter(|(_, after)| !after.contains('*')).ok_or(Problem::Pattern)?;
    let parent = pattern.parent().unwrap_or(Path::new(""));
    if parent.to_string_lossy().contains('*') {
        return Err(Problem::Pattern);
    }
    let mut steps = listed(parent, before, after)?;
    // Of names with the same number, as 1 and 01, the order is the alphabet's.
    steps.sort_by(|a, b| a.time.total_cmp(&b.time).then_with(|| a.path.cmp(&b.path)));
    if steps.is_empty() { Err(Problem::NoMatch) } else { Ok(steps) }
}

/// The files of a folder with a number between these texts.
fn listed(folder: &Path, before: &str, after: &str) -> Result<Vec<Step>, Problem> {
    let mut steps = Vec::new();
    for entry in std::fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })? {
        let name = entry?.file_name();
        let between = name.to_str().and_then(|name| name.strip_prefix(before)?.strip_suffix(after));
        if let Some(time) = between.and_then(number) {
            steps.push(Step { time, path: folder.join(&name) });
        }
    }
    Ok(steps)
}

/// A number as names have it: digits, perhaps with a point between them.
fn number(text: &str) -> Option<f64> {
    let is_number = text.starts_with(|c: char| c.is_ascii_digit()) && text.chars().all(|c| c.is_ascii_digit() || c == '.');
    text.parse::<f64>().ok().filter(|number| is_number && number.is_finite())
}

/// Where the last number of a file's name lies in it, its suffix aside.
fn last_number(path: &Path) -> Option<(String, String, String)> {
    let (stem, name) = (path.file_stem()?.to_str()?, path.file_name()?.to_str()?);
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let begin =
        |end: usize| stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |i| i + stem[i..].chars().next().map_or(1, char::len_utf8));
    let mut start = begin(end);
    // A point belongs to the number if what is before it is a number apart: of `flow_0.25`, not of `run1.10`.
    if let Some(head) = stem[..start].strip_suffix('.') {
        let whole = begin(head.len());
        if whole < head.len() && stem[..whole].chars().next_back().is_none_or(|c| matches!(c, '_' | '-' | '=')) {
            start = whole;
        }
    }
    Some((name[..start].to_owned(), name[start..end].to_owned(), name[end..].to_owned()))
}

/// Files named one by one.
pub fn files(first: &Path, more: &[PathBuf]) -> Result<Series, SeriesError> {
    let paths: Vec<PathBuf> = std::iter::once(first.to_owned()).chain(more.iter().cloned()).collect();
    if let Some(path) = repeated(&paths) {
        return Err(SeriesError { path: path.clone(), problem: Box::new(Problem::Twice) });
    }
    let numbers: Option<Vec<f64>> = paths.iter().map(|path| number(&last_number(path)?.1)).collect();
    let are_distinct = |numbers: &Vec<f64>| {
        let mut sorted = numbers.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.windows(2).all(|pair| pair[0] < pair[1])
    };
    let times = numbers.filter(are_distinct).unwrap_or_else(|| (0..paths.len()).map(|i| i as f64).collect());
    let steps = times.into_iter().zip(paths).map(|(time, path)| Step { time, path }).collect();
    Series::new(steps).map_err(|problem| SeriesError { path: first.to_owned(), problem: Box::new(problem) })
}

/// The pattern of the files that differ from this one in its last number only, itself among them, and how many they are; `None` if there
/// is no other.
pub fn siblings(path: &Path) -> Option<(PathBuf, usize)> {
    let (before, _, after) = last_number(path)?;
    if before.contains('*') || after.contains('*') || path.is_dir() {
        return None;
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let count = listed(folder, &before, &after).ok()?.len();
    (count > 1).then(|| (folder.join(format!("{before}*{after}")), count))
}
