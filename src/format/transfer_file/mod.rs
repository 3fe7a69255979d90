//! Files of transfer functions: octetra's JSON, and ParaView's JSON of colour maps. Which it is the content tells.

mod paraview;
#[cfg(test)]
mod tests;

use crate::image::write_atomically;
use crate::view::{TransferFunction, TransferFunctionError};
pub use paraview::to_paraview;
use serde_json::Value;
use std::io;
use std::path::{Path, PathBuf};

/// Files of more bytes are no transfer functions.
const MOST_BYTES: u64 = 64 << 20;

/// What is wrong with a file of transfer functions, or why none can be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", .path.display())]
pub struct TransferFileError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: TransferFileProblem,
}

/// What is wrong with a file of transfer functions, its name aside.
#[derive(Debug, thiserror::Error)]
pub enum TransferFileProblem {
    /// It cannot be read or written.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is far too large.
    #[error("is {0} bytes long, expected a transfer function or colour maps, which take a few MiB at most")]
    TooLarge(u64),
    /// It is no JSON, or a transfer function with wrong keys.
    #[error("not a transfer function: {0}")]
    Json(#[from] serde_json::Error),
    /// It is JSON of something else.
    #[error(
        "not a transfer function: expected octetra's, an object with \"color\" and \"opacity\", or colour maps as ParaView exports them, with \"RGBPoints\" or \"IndexedColors\""
    )]
    Unknown,
    /// Its numbers make no transfer function.
    #[error("{0}")]
    Function(#[from] TransferFunctionError),
    /// A colour map is not as ParaView has them.
    #[error("colour map \"{name}\": {what}")]
    Map {
        /// Its name.
        name: String,
        /// What is wrong with it, and what was expected.
        what: String,
    },
    /// There are several colour maps, and none was named.
    #[error("holds {} colour maps, name one as FILE.json:NAME: {}", .names.len(), .names.join(", "))]
    Several {
        /// Their names.
        names: Vec<String>,
    },
    /// There is none of that name.
    #[error("holds no colour map \"{name}\", it has {}", .names.join(", "))]
    NoSuchMap {
        /// The name asked for.
        name: String,
        /// The names there are.
        names: Vec<String>,
    },
    /// ParaView has no such scale.
    #[error("a symlog scale can be written for ParaView with a range only, over which it is tabulated")]
    NoRange,
}

/// A transfer function and what it is called.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedTransfer {
    /// The colour map's name, or the file's stem.
    pub name: String,
    /// It, valid.
    pub function: TransferFunction,
}

/// Reads all transfer functions of a file: one of octetra's, or ParaView's colour maps, in their order. A colour map without opacity gets a
/// ramp from 0 to 0.5.
pub fn read(path: &Path) -> Result<Vec<NamedTransfer>, TransferFileError> {
    let stem = path.file_stem().map_or("colour map".into(), |stem| stem.to_string_lossy().into_owned());
    let parsed = text_of(path).and_then(|text| parse(&text, &stem));
    parsed.map_err(|problem| TransferFileError { path: path.to_owned(), problem })
}

/// Reads the one transfer function that `FILE`, or `FILE:NAME` of a file of several colour maps, stands for.
pub fn read_one(file: &str) -> Result<NamedTransfer, TransferFileError> {
    // A name may hold colons, and a path may.
    let parts = || file.match_indices(':').map(|(i, _)| (&file[..i], &file[i + 1..]));
    let named = if Path::new(file).exists() { None } else { parts().find(|(path, _)| Path::new(path).is_file()) };
    let (path, name) = named.map_or((file, None), |(path, name)| (path, Some(name)));
    let mut all = read(Path::new(path))?;
    let names = || all.iter().map(|map| map.name.clone()).collect();
    let found = match name {
        None if all.len() == 1 => Ok(0),
        None => Err(TransferFileProblem::Several { names: names() }),
        Some(name) => {
            let exact = all.iter().position(|map| map.name == name);
            let found = exact.or_else(|| all.iter().position(|map| map.name.eq_ignore_ascii_case(name)));
            found.ok_or_else(|| TransferFileProblem::NoSuchMap { name: name.to_owned(), names: names() })
        }
    };
    let found = found.map_err(|problem| TransferFileError { path: path.into(), problem })?;
    Ok(all.swap_remove(found))
}

/// Writes a transfer function as octetra's JSON.
pub fn write(path: &Path, function: &TransferFunction) -> Result<(), TransferFileError> {
    let text = serde_json::to_string_pretty(function).map_err(TransferFileProblem::from);
    text.and_then(|text| write_text(path, &text)).map_err(|problem| TransferFileError { path: path.to_owned(), problem })
}

/// Writes a transfer function as a file of one colour map for ParaView: [`to_paraview`].
pub fn write_paraview(path: &Path, name: &str, function: &TransferFunction) -> Result<(), TransferFileError> {
    let text = to_paraview(name, function).and_then(|map| Ok(serde_json::to_string_pretty(&map)?));
    text.and_then(|text| write_text(path, &text)).map_err(|problem| TransferFileError { path: path.to_owned(), problem })
}

fn write_text(path: &Path, text: &str) -> Result<(), TransferFileProblem> {
    Ok(write_atomically(path, |out| writeln!(out, "{text}"))?)
}

fn text_of(path: &Path) -> Result<String, TransferFileProblem> {
    let bytes = std::fs::metadata(path)?.len();
    if bytes > MOST_BYTES {
        return Err(TransferFileProblem::TooLarge(bytes));
    }
    Ok(std::fs::read_to_string(path)?)
}

/// The transfer functions of a text; `stem` is what one without a name is called.
fn parse(text: &str, stem: &str) -> Result<Vec<NamedTransfer>, TransferFileProblem> {
    let text = without_trailing_commas(text);
    let maps = match serde_json::from_str(&text)? {
        Value::Object(object) if object.contains_key("color") => {
            // Read anew, since errors then name line and column.
            let function: TransferFunction = serde_json::from_str(&text)?;
            function.validate()?;
            return Ok(vec![NamedTransfer { name: stem.to_owned(), function }]);
        }
        map @ Value::Object(_) => vec![map],
        Value::Array(maps) => maps,
        _ => return Err(TransferFileProblem::Unknown),
    };
    if maps.is_empty() || !maps.iter().all(paraview::is_map) {
        return Err(TransferFileProblem::Unknown);
    }
    let unnamed = |i: usize| if maps.len() == 1 { stem.to_owned() } else { format!("{stem} {}", i + 1) };
    maps.iter().enumerate().map(|(i, map)| paraview::from_paraview(map, &unnamed(i))).collect()
}

/// The text with blanks for commas that nothing follows, of which ParaView's own file has some. Everything stays in its place.
fn without_trailing_commas(text: &str) -> String {
    let mut bytes = text.to_owned().into_bytes();
    let (mut in_string, mut escaped) = (false, false);
    // The comma that may be too many, and the last byte that is no blank.
    let (mut comma, mut last) = (None, b'[');
    for i in 0..bytes.len() {
        let byte = bytes[i];
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_string => escaped = true,
            b'"' => (in_string, comma) = (!in_string, None),
            _ if in_string => {}
            b',' => comma = (!matches!(last, b'[' | b'{' | b',' | b':')).then_some(i),
            b']' | b'}' => {
                if let Some(at) = comma.take() {
                    bytes[at] = b' ';
                }
            }
            _ if byte.is_ascii_whitespace() => continue,
            _ => comma = None,
        }
        last = byte;
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}
