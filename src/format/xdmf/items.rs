//! Elements `<DataItem>`: numbers in the XML, in HDF5 or in plain bytes.

use super::tree::{Id, Tree};
use crate::format::hdf::{Budget, Hdf, Numbers};
use crate::format::parse::{Binary, Words, beside};
use crate::format::vtu::number::ByteOrder;
use crate::format::{GridFile, ParseError, Source};
use crate::progress::Progress;
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::path::Path;
use std::rc::Rc;

/// Elements that may refer to each other in a row.
const REFERENCES_LIMIT: usize = 16;
/// Bytes of memory that a byte of the XML or of a plain file may claim.
const RATIO: u64 = 32;

/// Finds the numbers of data items.
pub(super) struct Items<'a> {
    /// The elements.
    pub tree: &'a Tree,
    file: &'a GridFile<'a>,
    progress: &'a Progress,
    budget: Budget,
    /// HDF5 files that were opened, by the names that the file has for them.
    opened: RefCell<Vec<(String, Rc<Hdf<'a>>)>>,
}

/// Numbers with their shape, which has as many.
#[derive(Debug)]
pub(super) struct Item {
    /// Lengths along the dimensions.
    pub shape: Vec<usize>,
    /// The numbers, row by row.
    pub numbers: Numbers,
}

/// What numbers an item has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Float,
    Int,
    Unsigned,
}

impl<'a> Items<'a> {
    /// Of a tree that was read from a file.
    pub fn new(tree: &'a Tree, file: &'a GridFile<'a>, progress: &'a Progress) -> Self {
        let budget = Budget::new((64 << 20) + file.source.len().saturating_mul(RATIO));
        Items { tree, file, progress, budget, opened: RefCell::default() }
    }

    /// Takes memory for so many numbers that are not in the file.
    pub fn take(&self, numbers: usize) -> Result<(), ParseError> {
        self.budget.take(&[numbers as u64], 8, "the arrays")
    }

    /// The element that one stands for: itself, or what its attribute `Reference` leads to.
    pub fn referred(&self, mut id: Id) -> Result<Id, ParseError> {
        for _ in 0..REFERENCES_LIMIT {
            let Some(reference) = self.tree.get(id, "Reference") else { return Ok(id) };
            let path = if reference.eq_ignore_ascii_case("XML") { self.tree.text(id) } else { reference };
            id = self.one(path, id)?;
        }
        Err(ParseError::invalid(self.tree.place(id), "references in a circle", "one that leads to numbers"))
    }

    /// The elements that a path in an element leads to.
    pub fn all(&self, path: &str, of: Id) -> Result<Vec<Id>, ParseError> {
        let found = self.tree.select(path).ok_or_else(|| {
            let found = format!("the path \"{}\"", path.chars().take(80).collect::<String>());
            ParseError::invalid(self.tree.place(of), found, "names, numbers and @attribute=\"value\" in brackets, self::name")
        })?;
        let missing = || ParseError::invalid(self.tree.place(of), format!("the path \"{path}\" to nothing"), "one to an element");
        if found.is_empty() { Err(missing()) } else { Ok(found) }
    }

    fn one(&self, path: &str, of: Id) -> Result<Id, ParseError> {
        Ok(self.all(path, of)?[0])
    }

    /// The numbers in the data items of an element, in order.
    pub fn in_element(&self, id: Id) -> Result<Vec<Item>, ParseError> {
        self.tree.children(id, "DataItem").map(|item| self.item(item, 0)).collect()
    }

    fn item(&self, id: Id, depth: usize) -> Result<Item, ParseError> {
        self.progress.check()?;
        let id = self.referred(id)?;
        let place = self.tree.place(id);
        match self.tree.get(id, "ItemType").unwrap_or("Uniform") {
            "Uniform" => self.uniform(id, &place),
            "HyperSlab" if depth < REFERENCES_LIMIT => {
                let children: Vec<Id> = self.tree.children(id, "DataItem").collect();
                let &[selection, source] = &children[..] else {
                    return Err(ParseError::invalid(place, format!("{} data items", children.len()), "a selection and a source"));
                };
                let selection = self.item(selection, depth + 1)?.numbers.counts(&place)?;
                hyperslab(self.item(source, depth + 1)?, &selection, &place, &self.budget)
            }
            other => Err(ParseError::Unsupported(format!("has a data item of type \"{other}\", octetra reads Uniform and HyperSlab"))),
        }
    }

    fn uniform(&self, id: Id, place: &str) -> Result<Item, ParseError> {
        let get = |attribute: &str| self.tree.get(id, attribute);
        let number_type = get("NumberType").or(get("DataType")).unwrap_or("Float").to_ascii_lowercase();
        let kind = match number_type.as_str() {
            "float" | "double" => Kind::Float,
            "int" | "char" | "short" | "long" => Kind::Int,
            "uint" | "uchar" | "ushort" => Kind::Unsigned,
            other => return Err(ParseError::invalid(place, format!("numbers of type \"{other}\""), "Float, Int, UInt, Char or UChar")),
        };
        let usual = match number_type.as_str() {
            "char" | "uchar" => 1,
            "short" | "ushort" => 2,
            "double" | "long" => 8,
            _ => 4,
        };
        let precision: usize = get("Precision").map_or(Some(usual), |text| text.parse().ok()).unwrap_or(usual);
        let shape = get("Dimensions").map(|text| text.split_ascii_whitespace().map(str::parse).collect::<Result<Vec<usize>, _>>());
        let shape = shape.transpose().map_err(|_| ParseError::invalid(place, "Dimensions that are no counts", "numbers from 0"))?;
        let count = shape.as_ref().map(|shape| shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n)).unwrap_or(usize::MAX));
        let text = self.tree.text(id);
        let (numbers, own_shape) = match get("Format").unwrap_or("XML").to_ascii_uppercase().as_str() {
            "XML" => (self.numbers_in_text(text, kind, precision, place)?, None),
            "HDF" | "HDF5" | "H5" => self.numbers_in_hdf5(text, place).map(|(numbers, shape)| (numbers, Some(shape)))?,
            "BINARY" => {
                if let Some(compression) = get("Compression").filter(|name| !name.eq_ignore_ascii_case("Raw")) {
                    return Err(ParseError::Unsupported(format!("has binary numbers compressed by {compression}, octetra reads raw ones")));
                }
                let count = count.ok_or_else(|| ParseError::invalid(place, "no Dimensions", "how many numbers to read"))?;
                let order =
                    if get("Endian").is_some_and(|order| order.eq_ignore_ascii_case("Big")) { ByteOrder::Big } else { ByteOrder::Little };
                let seek = get("Seek").map_or(Some(0), |text| text.parse().ok());
                let seek = seek.ok_or_else(|| ParseError::invalid(place, "a Seek that is no count", "bytes from 0"))?;
                (self.numbers_in_bytes(text, seek, (kind, precision), count, order, place)?, None)
            }
            other => return Err(ParseError::invalid(place, format!("the format \"{other}\""), "XML, HDF or Binary")),
        };
        if count.is_some_and(|count| count != numbers.len()) {
            let expected = format!("as many as its Dimensions {:?} say", shape.unwrap_or_default());
            return Err(ParseError::invalid(place, format!("{} numbers", numbers.len()), expected));
        }
        let shape = shape.or(own_shape).unwrap_or_else(|| vec![numbers.len()]);
        Ok(Item { shape, numbers })
    }

    fn numbers_in_text(&self, text: &str, kind: Kind, precision: usize, place: &str) -> Result<Numbers, ParseError> {
        // A number takes at least a character and a blank.
        self.budget.take(&[text.len() as u64 / 2 + 1], 8, place)?;
        let mut words = Words::new(text.as_bytes());
        let wrong = |error: ParseError| match error {
            ParseError::Invalid { found, expected, .. } => ParseError::invalid(place, found, expected),
            error => error,
        };
        if kind == Kind::Float {
            let mut numbers = Vec::new();
            while words.peek().is_some() {
                numbers.push(words.real("a number").map_err(wrong)?);
            }
            return Ok(if precision == 8 {
                Numbers::F64(numbers)
            } else {
                Numbers::F32(numbers.iter().map(|&number| number as f32).collect())
            });
        }
        let mut numbers = Vec::new();
        while words.peek().is_some() {
            numbers.push(words.integer::<i64>("a whole number").map_err(wrong)?);
        }
        Ok(Numbers::Whole(numbers, precision <= 2))
    }

    fn numbers_in_hdf5(&self, text: &str, place: &str) -> Result<(Numbers, Vec<usize>), ParseError> {
        let split = text.split_once(":/").or_else(|| text.rsplit_once(':'));
        let (name, path) = split.ok_or_else(|| {
            ParseError::invalid(
                place,
                format!("\"{}\"", text.chars().take(80).collect::<String>()),
                "a file and a path in it, as in mesh.h5:/points",
            )
        })?;
        let known = self.opened.borrow().iter().find(|(known, _)| known == name).map(|(_, file)| Rc::clone(file));
        let of_file = |problem: ParseError| match problem {
            ParseError::Cancelled(_) => problem,
            problem => ParseError::Other { file: name.trim().into(), problem: Box::new(problem) },
        };
        let file = match known {
            Some(file) => file,
            None => {
                let (file, len) = open(&beside(self.file, name)?).map_err(of_file)?;
                let file = Rc::new(Hdf::open(&Source::File(&file, len), self.progress).map_err(of_file)?);
                self.opened.borrow_mut().push((name.to_owned(), Rc::clone(&file)));
                file
            }
        };
        let path = format!("/{}", path.trim().trim_start_matches('/'));
        let missing = || ParseError::invalid(place, format!("no data set \"{path}\" in \"{}\"", name.trim()), "one there");
        let shape = file.shape(&path).map_err(of_file)?.ok_or_else(missing)?;
        let rows = file.all(&path).map_err(of_file)?.ok_or_else(missing)?;
        Ok((rows.numbers, shape.into_iter().map(|n| n as usize).collect()))
    }

    fn numbers_in_bytes(
        &self,
        name: &str,
        seek: u64,
        (kind, precision): (Kind, usize),
        count: usize,
        order: ByteOrder,
        place: &str,
    ) -> Result<Numbers, ParseError> {
        let of_file = |problem: ParseError| ParseError::Other { file: name.into(), problem: Box::new(problem) };
        let (file, len) = open(&beside(self.file, name)?).map_err(of_file)?;
        let source = Source::File(&file, len);
        let wanted = count.saturating_mul(precision);
        if len.checked_sub(seek).is_none_or(|left| (wanted as u64) > left) {
            let expected = format!("{wanted} bytes from byte {seek} on");
            return Err(of_file(ParseError::invalid(place, format!("{len} bytes"), expected)));
        }
        self.budget.take(&[count as u64], 8, place)?;
        let bytes = source.read(seek, wanted)?;
        self.progress.add(wanted as u64);
        let mut bytes = Binary::new(&bytes, 0, order);
        Ok(match (kind, precision) {
            (Kind::Float, 4) => Numbers::F32(bytes.numbers(count, place)?),
            (Kind::Float, 8) => Numbers::F64(bytes.numbers(count, place)?),
            (Kind::Int, 1) => Numbers::small(bytes.numbers::<i8>(count, place)?),
            (Kind::Int, 2) => Numbers::small(bytes.numbers::<i16>(count, place)?),
            (Kind::Int, 4) => Numbers::whole(bytes.numbers::<i32>(count, place)?),
            (Kind::Int, 8) => Numbers::Whole(bytes.numbers(count, place)?, false),
            (Kind::Unsigned, 1) => Numbers::small(bytes.numbers::<u8>(count, place)?),
            (Kind::Unsigned, 2) => Numbers::small(bytes.numbers::<u16>(count, place)?),
            (Kind::Unsigned, 4) => Numbers::whole(bytes.numbers::<u32>(count, place)?),
            (Kind::Unsigned, 8) => Numbers::unsigned(bytes.numbers(count, place)?),
            _ => return Err(ParseError::invalid(place, format!("Precision {precision}"), "4 or 8, of whole numbers 1 and 2 too")),
        })
    }
}

fn open(path: &Path) -> Result<(File, u64), ParseError> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_file() { Ok((file, metadata.len())) } else { Err(ParseError::Io(io::Error::other("not a regular file"))) }
}

/// What a selection (starts, strides and counts along the dimensions) takes of an item.
fn hyperslab(item: Item, selection: &[usize], place: &str, budget: &Budget) -> Result<Item, ParseError> {
    let dimensions = item.shape.len();
    let wrong = || {
        ParseError::invalid(place, format!("the selection {selection:?}"), format!("starts, strides and counts within {:?}", item.shape))
    };
    if selection.len() != 3 * dimensions || dimensions == 0 {
        return Err(wrong());
    }
    let (starts, rest) = selection.split_at(dimensions);
    let (strides, counts) = rest.split_at(dimensions);
    let mut indices = vec![0usize];
    for axis in 0..dimensions {
        let last = counts[axis].checked_sub(1).map(|last| last.checked_mul(strides[axis]).and_then(|last| last.checked_add(starts[axis])));
        if last.is_some_and(|last| last.is_none_or(|last| last >= item.shape[axis])) {
            return Err(wrong());
        }
        budget.take(&[indices.len() as u64, counts[axis] as u64], 8, place)?;
        let (length, start, stride) = (item.shape[axis], starts[axis], strides[axis]);
        indices = indices.iter().flat_map(|&index| (0..counts[axis]).map(move |i| index * length + start + i * stride)).collect();
    }
    fn taken<T: Copy>(numbers: &[T], indices: &[usize]) -> Vec<T> {
        indices.iter().map(|&index| numbers[index]).collect()
    }
    let numbers = match &item.numbers {
        Numbers::F32(numbers) => Numbers::F32(taken(numbers, &indices)),
        Numbers::F64(numbers) => Numbers::F64(taken(numbers, &indices)),
        Numbers::Whole(numbers, small) => Numbers::Whole(taken(numbers, &indices), *small),
    };
    Ok(Item { shape: counts.to_vec(), numbers })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hyperslabs_take_rows_and_columns() {
        let item = || Item { shape: vec![3, 4], numbers: Numbers::F32((0..12).map(|i| i as f32).collect()) };
        let take = |selection: &[usize]| hyperslab(item(), selection, "here", &Budget::new(1 << 20)).map(|item| (item.shape, item.numbers));
        assert_eq!(take(&[1, 0, 1, 2, 2, 2]).ok(), Some((vec![2, 2], Numbers::F32(vec![4.0, 6.0, 8.0, 10.0]))));
        assert_eq!(take(&[9, 0, 1, 1, 0, 4]).ok(), Some((vec![0, 4], Numbers::F32(vec![]))));
        for bad in [&[2, 0, 1, 1, 2, 4][..], &[0, 0, 1], &[0, 0, usize::MAX, 1, 3, 4], &[0, 4, 1, 1, 1, 1]] {
            let error = take(bad).expect_err("outside").to_string();
            assert!(error.contains("expected starts, strides and counts within [3, 4]"), "{error}");
        }
    }
}
