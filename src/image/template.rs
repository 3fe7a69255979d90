//! Names of the pictures of a sequence.

use std::path::{Path, PathBuf};

/// A path with `{i}` in its file name, which stands for a picture's number from 0, with as many digits as the last one has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Template {
    before: String,
    after: String,
    folder: PathBuf,
}

/// Why a path names no sequence.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: expected {{i}} in the file's name, once, for the pictures' numbers, as in frame_{{i}}.png", .0.display())]
pub struct NoNumber(PathBuf);

impl Template {
    /// Takes a path apart.
    pub fn new(path: &Path) -> Result<Self, NoNumber> {
        let no_number = || NoNumber(path.to_owned());
        let name = path.file_name().and_then(|name| name.to_str()).ok_or_else(no_number)?;
        let (before, after) = name.split_once("{i}").filter(|(_, after)| !after.contains("{i}")).ok_or_else(no_number)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Template { before: before.to_owned(), after: after.to_owned(), folder })
    }

    /// The paths of `count` pictures.
    pub fn paths(&self, count: u32) -> impl Iterator<Item = PathBuf> + '_ {
        let digits = count.saturating_sub(1).to_string().len();
        (0..count).map(move |n| self.folder.join(format!("{}{n:0digits$}{}", self.before, self.after)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_as_many_digits_as_the_last() {
        let names = |path: &str, count| Template::new(Path::new(path)).expect("a number").paths(count).collect::<Vec<_>>();
        assert_eq!(names("out/a_{i}.png", 2), ["out/a_0.png", "out/a_1.png"].map(PathBuf::from));
        let many = names("{i}.png", 101);
        assert_eq!((many[0].to_str(), many[100].to_str()), (Some("000.png"), Some("100.png")));
        for path in ["a.png", "{i}/a.png", "a{i}b{i}.png", ""] {
            assert_eq!(Template::new(Path::new(path)), Err(NoNumber(path.into())), "{path}");
        }
    }
}
