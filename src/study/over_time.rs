//! The range of a field over the steps of a series.

use crate::format::{self, Data, FormatError, ReadOptions};
use crate::mesh::{FieldError, FieldSelection, ScalarField};
use crate::progress::{Cancelled, Progress};
use std::path::{Path, PathBuf};

/// Why a step has no range.
#[derive(Debug, thiserror::Error)]
pub enum RangeError {
    /// Its file cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// It has no such field.
    #[error("{}: {cause}", path.display())]
    Field {
        /// Its file.
        path: PathBuf,
        /// What it has instead.
        cause: FieldError,
    },
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Smallest and largest value of a field in some files, data units; each is read, one at a time, and `give` is told its number and range.
/// Without a file: `[inf, -inf]`.
pub fn range_over(
    files: &[&Path],
    options: &ReadOptions,
    field: &FieldSelection,
    progress: &Progress,
    mut give: impl FnMut(usize, [f64; 2]),
) -> Result<[f64; 2], RangeError> {
    progress.begin("ranges of all steps", files.len() as u64);
    let mut all = [f64::INFINITY, f64::NEG_INFINITY];
    for (i, path) in files.iter().enumerate() {
        progress.check()?;
        let range = match format::read(path, options, &progress.part())? {
            Data::Grid(grid) => grid.range(),
            Data::Mesh(mesh) => {
                let field = ScalarField::select(&mesh, field);
                field.map_err(|cause| RangeError::Field { path: path.to_path_buf(), cause })?.range
            }
        };
        all = union(all, range);
        give(i, range);
        progress.add(1);
    }
    Ok(all)
}

/// The smallest range that holds both.
pub fn union(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::vtu::write::{Compression, write_mesh};
    use crate::mesh::generate::{Shape, plan};

    #[test]
    fn the_range_is_that_of_all_files() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let paths = ["ball.vtu", "cube.vtu"].map(|name| folder.path().join(name));
        let mut single = Vec::new();
        for (path, shape) in paths.iter().zip([Shape::Ball, Shape::Cube]) {
            write_mesh(path, &*plan(shape, Some(600)).expect("a size"), Compression::None, &Progress::new()).expect("written");
            let mesh = format::read_mesh(path, &Progress::new()).expect("read");
            single.push(ScalarField::select(&mesh, &FieldSelection::default()).expect("a field").range);
        }
        assert!(single[0][0] < single[1][0] || single[0][1] > single[1][1], "the last has not all values: {single:?}");
        let files = [paths[0].as_path(), paths[1].as_path()];
        let mut given = Vec::new();
        let (options, field) = (ReadOptions::default(), FieldSelection::default());
        let all = range_over(&files, &options, &field, &Progress::new(), |i, range| given.push((i, range))).expect("both are read");
        assert_eq!(given, [(0, single[0]), (1, single[1])]);
        assert_eq!(all, [single[0][0].min(single[1][0]), single[0][1].max(single[1][1])]);

        let other = FieldSelection { name: Some("heat".into()), ..FieldSelection::default() };
        let said = range_over(&files, &options, &other, &Progress::new(), |_, _| {}).expect_err("no such array").to_string();
        assert!(said.contains("ball.vtu: there is no array \"heat\""), "{said}");
        let stopped = Progress::new();
        stopped.cancel();
        assert!(matches!(range_over(&files, &options, &field, &stopped, |_, _| {}), Err(RangeError::Cancelled(_))));
    }
}
