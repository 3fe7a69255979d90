//! Fields of a case: one file each.

use super::super::parse::ParseError;
use super::tokens::Tokens;
use crate::mesh::{Association, DataArray, Values};
use crate::progress::Progress;

/// How many components a kind of number has, by OpenFOAM's name; tensors are nine, row by row.
const KINDS: [(&str, usize); 5] = [("Scalar", 1), ("Vector", 3), ("SphericalTensor", 1), ("SymmTensor", 6), ("Tensor", 9)];

/// What a file holds by its class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// A field on cells or points, with so many components.
    Field(Association, usize),
    /// A field on faces.
    OnFaces,
    /// Something that is no field.
    None,
}

/// What a class is.
pub(super) fn kind(class: &str) -> Kind {
    let name = class.strip_suffix("::Internal").unwrap_or(class);
    if name.starts_with("surface") && name.ends_with("Field") {
        return Kind::OnFaces;
    }
    let components = |on: &str| {
        let middle = name.strip_prefix(on)?.strip_suffix("Field")?;
        KINDS.iter().find(|(kind, _)| *kind == middle).map(|&(_, components)| components)
    };
    match (components("vol"), components("point")) {
        (Some(components), _) => Kind::Field(Association::Cells, components),
        (_, Some(components)) => Kind::Field(Association::Points, components),
        _ => Kind::None,
    }
}

/// The values of a field inside: `tuples` of `components` numbers. What a macro (`$name`, `#calc`) says is not computed, which is
/// [`ParseError::Unsupported`].
pub(super) fn read(
    tokens: &mut Tokens<'_>,
    (components, tuples): (usize, usize),
    name: &str,
    progress: &Progress,
) -> Result<DataArray, ParseError> {
    let key: &[u8] = if tokens.header.class.ends_with("::Internal") { b"value" } else { b"internalField" };
    if !tokens.find(key)? {
        return Err(tokens.bad(b"", &format!("the entry {}", String::from_utf8_lossy(key))));
    }
    if matches!(tokens.peek(), b'$' | b'#') {
        return Err(ParseError::Unsupported("its values are a macro, which is not computed".into()));
    }
    let values = match tokens.word() {
        b"uniform" if matches!(tokens.peek(), b'$' | b'#') => {
            return Err(ParseError::Unsupported("its value is a macro, which is not computed".into()));
        }
        b"uniform" => tokens.uniform(components, tuples, "a value")?,
        b"nonuniform" => {
            if tokens.peek().is_ascii_alphabetic() {
                _ = tokens.word(); // List<vector>
            }
            tokens.scalars(components, tuples, "values", progress)?
        }
        word => return Err(tokens.bad(word, "uniform or nonuniform")),
    };
    let found = values.len() / components;
    if found != tuples {
        return Err(ParseError::invalid(tokens.place(), format!("{found} values inside"), format!("{tuples}")));
    }
    let values = if components == 6 { as_vtk(values) } else { values };
    Ok(DataArray { name: name.to_owned(), components, values })
}

/// Symmetric tensors from OpenFOAM's order xx xy xz yy yz zz to VTK's, xx yy zz xy yz xz.
fn as_vtk(values: Values) -> Values {
    fn reordered<T: Copy>(values: &[T]) -> Vec<T> {
        values.chunks_exact(6).flat_map(|t| [t[0], t[3], t[5], t[1], t[4], t[2]]).collect()
    }
    match values {
        Values::F32(values) => Values::F32(reordered(&values)),
        Values::F64(values) => Values::F64(reordered(&values)),
    }
}
