//! The XML of a `.vtu` or `.vti` file: what pieces and arrays there are, and where in the file their numbers lie.
//!
//! Only the markup goes through quick-xml. The numbers between the tags are skipped and remembered by place, and what follows
//! `<AppendedData>` is not XML at all.

use super::VtuError;
use super::compress::Compressor;
use super::number::{ByteOrder, ScalarType};
use crate::format::source::Source;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use std::collections::HashMap;
use std::io::{self, BufRead, Read};
use std::ops::Range;

/// Bytes that one tag or comment may have.
const MARKUP_LIMIT: usize = 1 << 20;
/// Attributes that one tag may have.
const ATTRIBUTES_LIMIT: usize = 100;
/// Elements that may be open at once.
const DEPTH_LIMIT: usize = 50;
/// Pieces and arrays that one file may have.
const NODES_LIMIT: usize = 1 << 20;

/// The kinds of VTK's XML files that octetra reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::format) enum Kind {
    /// `.vtu`.
    UnstructuredGrid,
    /// `.vti`.
    ImageData,
    /// `.vts`.
    StructuredGrid,
    /// `.vtr`.
    RectilinearGrid,
    /// `.vtp`.
    PolyData,
    /// `.pvtu`, `.pvtp`, `.pvts`, `.pvtr`: names of files with the pieces.
    Parallel,
    /// `.pvd`.
    Collection,
}

impl Kind {
    /// The name of the root's type, and of the element with the pieces.
    fn name(self) -> &'static str {
        match self {
            Kind::UnstructuredGrid => "UnstructuredGrid",
            Kind::ImageData => "ImageData",
            Kind::StructuredGrid => "StructuredGrid",
            Kind::RectilinearGrid => "RectilinearGrid",
            Kind::PolyData => "PolyData",
            Kind::Parallel => "PUnstructuredGrid",
            Kind::Collection => "Collection",
        }
    }

    /// The error of a file of another kind.
    fn no(self, reason: String) -> VtuError {
        match self {
            Kind::UnstructuredGrid => VtuError::NotVtu(reason),
            Kind::ImageData => VtuError::NotVti(reason),
            Kind::StructuredGrid => VtuError::NotStructured { suffix: "vts", reason },
            Kind::RectilinearGrid => VtuError::NotStructured { suffix: "vtr", reason },
            Kind::PolyData => VtuError::NotStructured { suffix: "vtp", reason },
            Kind::Parallel => VtuError::NotStructured { suffix: "pvtu", reason },
            Kind::Collection => VtuError::NotStructured { suffix: "pvd", reason },
        }
    }
}

/// Where the points of an image lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::format) struct ImageFrame {
    /// First and last point of all pieces along x, y, z.
    pub extent: [i64; 6],
    /// Where point (0, 0, 0) lies, whether the extent has it or not.
    pub origin: [f64; 3],
    /// Distance between points.
    pub spacing: [f64; 3],
    /// A matrix of columns, the directions of the axes; row by row.
    pub direction: [f64; 9],
}

/// What stands before the numbers: how they are written, and the pieces.
#[derive(Debug)]
pub(in crate::format) struct Head {
    /// Of header words and data; little-endian where the file does not say.
    pub byte_order: ByteOrder,
    /// Bytes of a header word: 4 (also where the file does not say) or 8.
    pub header_size: usize,
    /// What binary arrays are compressed with.
    pub compressor: Option<Compressor>,
    /// Where an image lies; `None` in `.vtu` files.
    pub image: Option<ImageFrame>,
    /// The pieces, in order.
    pub pieces: Vec<Piece>,
    /// The data behind the XML, if any.
    pub appended: Option<Appended>,
}

/// Data behind the XML.
#[derive(Debug, Clone, Copy)]
pub(in crate::format) struct Appended {
    /// Where in the file they start: the byte after the underscore, which offsets count from.
    pub start: u64,
    /// Whether they are base64 text; else raw bytes.
    pub base64: bool,
}

/// A part of the mesh with points and cells of its own.
#[derive(Debug, Default)]
pub(in crate::format) struct Piece {
    /// First and last point along x, y, z; of pieces of images only.
    pub extent: [i64; 6],
    /// Number of points, as the file states it.
    pub points: u64,
    /// Number of cells, as the file states it.
    pub cells: u64,
    /// The arrays in `<Points>`, one in a sound file.
    pub coordinates: Vec<Array>,
    /// The arrays in `<Cells>`: `connectivity`, `offsets`, `types`, and more for polyhedra.
    pub topology: Vec<Array>,
    /// The cells of a `.vtp` piece: vertices, lines, polygons, strips.
    pub groups: [Group; 4],
    /// Arrays over points.
    pub point_data: Section,
    /// Arrays over cells.
    pub cell_data: Section,
}

/// Cells of one kind in a `.vtp` piece.
#[derive(Debug, Default)]
pub(in crate::format) struct Group {
    /// How many, as the file states it.
    pub cells: u64,
    /// `connectivity` and `offsets`.
    pub topology: Vec<Array>,
}

/// `<PointData>` or `<CellData>`.
#[derive(Debug, Default)]
pub(in crate::format) struct Section {
    /// Its numeric arrays, in order.
    pub arrays: Vec<Array>,
    /// The array marked as the scalars.
    pub scalars: Option<String>,
}

impl Section {
    /// Its arrays by name. Of several with one name the first counts.
    pub fn by_name(&self) -> HashMap<&str, &Array> {
        self.arrays.iter().rev().map(|array| (array.name.as_str(), array)).collect()
    }
}

/// A `<DataArray>`.
#[derive(Debug)]
pub(in crate::format) struct Array {
    /// Its name; empty where it has none.
    pub name: String,
    /// The type of its numbers.
    pub scalar: ScalarType,
    /// Numbers a tuple, `None` where the file does not say.
    pub components: Option<u64>,
    /// Where its numbers lie.
    pub place: Place,
}

/// Where an array's numbers lie, and how they are written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::format) enum Place {
    /// As text between the tags, bytes of the file.
    Ascii(Range<u64>),
    /// As base64 between the tags, bytes of the file.
    Base64(Range<u64>),
    /// In the appended data, from this byte of them on.
    Appended(u64),
}

/// Reads everything up to the appended data, or to the end of the file if there are none.
pub(in crate::format) fn read_head(source: &Source<'_>, kind: Kind) -> Result<Head, VtuError> {
    let mut walker = Walker::new(source, kind)?;
    let root = walker.root()?;
    let mut head = Head {
        byte_order: root
            .one_of("byte_order", &[("LittleEndian", ByteOrder::Little), ("BigEndian", ByteOrder::Big)])?
            .unwrap_or(ByteOrder::Little),
        header_size: root.one_of("header_type", &[("UInt32", 4), ("UInt64", 8)])?.unwrap_or(4),
        compressor: root.one_of("compressor", &Compressor::NAMES)?,
        image: None,
        pieces: Vec::new(),
        appended: None,
    };
    let mut has_grid = false;
    loop {
        match walker.next()? {
            Node::Open(e) if e.name == kind.name() => {
                has_grid = true;
                head.image = if kind == Kind::ImageData { Some(e.image_frame()?) } else { None };
                walker.grid(&mut head.pieces)?;
            }
            Node::Open(e) if e.name == "AppendedData" => {
                let base64 = e.one_of("encoding", &[("raw", false), ("base64", true)])?.unwrap_or(true);
                head.appended = Some(Appended { start: walker.after_underscore()?, base64 });
                break;
            }
            Node::Open(_) => walker.skip()?,
            Node::Close => break,
            Node::Other => {}
        }
    }
    if has_grid { Ok(head) } else { Err(kind.no(format!("it has no element <{}>", kind.name()))) }
}

/// The files with the pieces of a parallel file, as they are named there.
pub(in crate::format) fn read_parallel(source: &Source<'_>) -> Result<Vec<String>, VtuError> {
    let mut walker = Walker::new(source, Kind::Parallel)?;
    let root = walker.root()?;
    let name = root.get("type").unwrap_or_default().to_owned();
    let (mut files, mut has_grid) = (Vec::new(), false);
    loop {
        match walker.next()? {
            Node::Open(e) if e.name == name => has_grid = true,
            Node::Open(e) if e.name == "Piece" && walker.open.len() == 3 => {
                walker.count_node()?;
                files.push(e.get("Source").ok_or_else(|| e.bad("Source", "", "the name of a file".into()))?.to_owned());
                walker.skip()?;
            }
            Node::Open(_) => walker.skip()?,
            Node::Close if walker.open.is_empty() => break,
            Node::Close | Node::Other => {}
        }
    }
    if has_grid { Ok(files) } else { Err(Kind::Parallel.no(format!("it has no element <{name}>"))) }
}

/// A file that a collection lists, attributes as they are written.
#[derive(Debug)]
pub(in crate::format) struct DataSet {
    /// The time.
    pub timestep: Option<String>,
    /// The path, as seen from the collection.
    pub file: Option<String>,
}

/// Reads what a collection lists.
pub(in crate::format) fn read_collection(source: &Source<'_>) -> Result<Vec<DataSet>, VtuError> {
    let mut walker = Walker::new(source, Kind::Collection)?;
    walker.root()?;
    let (mut data_sets, mut has_collection) = (Vec::new(), false);
    loop {
        match walker.next()? {
            Node::Open(e) if e.name == "Collection" => has_collection = true,
            Node::Open(e) if e.name == "DataSet" && walker.open.len() == 3 => {
                walker.count_node()?;
                let text = |attribute| e.get(attribute).map(str::to_owned);
                data_sets.push(DataSet { timestep: text("timestep"), file: text("file") });
                walker.skip()?;
            }
            Node::Open(_) => walker.skip()?,
            Node::Close if walker.open.is_empty() => break,
            Node::Close | Node::Other => {}
        }
    }
    if has_collection { Ok(data_sets) } else { Err(Kind::Collection.no("it has no element <Collection>".into())) }
}

/// An opening tag.
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
}

impl Element {
    fn new(tag: &BytesStart<'_>, at: u64) -> Result<Self, VtuError> {
        let xml = |e: String| VtuError::Xml { at, reason: e };
        let mut attributes = Vec::new();
        for attribute in tag.attributes().with_checks(false) {
            if attributes.len() == ATTRIBUTES_LIMIT {
                return Err(xml(format!("a tag has more than {ATTRIBUTES_LIMIT} attributes")));
            }
            let attribute = attribute.map_err(|e| xml(e.to_string()))?;
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| xml(e.to_string()))?;
            attributes.push((AsRef::<str>::as_ref(&attribute.key).to_owned(), value.into_owned()));
        }
        Ok(Element { name: AsRef::<str>::as_ref(&tag.name()).to_owned(), attributes })
    }

    /// The value of an attribute without the blanks around it, which some writers pad with; `None` if it is absent or empty.
    fn get(&self, attribute: &str) -> Option<&str> {
        let (_, value) = self.attributes.iter().find(|(name, _)| name == attribute)?;
        Some(value.trim()).filter(|value| !value.is_empty())
    }

    /// An attribute whose value must be one of several.
    fn one_of<T: Copy>(&self, attribute: &'static str, known: &[(&str, T)]) -> Result<Option<T>, VtuError> {
        let Some(value) = self.get(attribute) else { return Ok(None) };
        match known.iter().find(|(name, _)| *name == value) {
            Some((_, found)) => Ok(Some(*found)),
            None => {
                let expected = known.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
                Err(self.bad(attribute, value, format!("one of {expected}")))
            }
        }
    }

    /// An attribute that must be a number of things.
    fn count(&self, attribute: &'static str) -> Result<Option<u64>, VtuError> {
        let Some(value) = self.get(attribute) else { return Ok(None) };
        value.parse().map(Some).map_err(|_| self.bad(attribute, value, "an integer from 0".into()))
    }

    /// An attribute of `N` numbers between blanks.
    fn numbers<T: std::str::FromStr, const N: usize>(&self, attribute: &'static str) -> Result<Option<[T; N]>, VtuError> {
        let Some(value) = self.get(attribute) else { return Ok(None) };
        let numbers: Vec<T> = value.split_ascii_whitespace().map_while(|number| number.parse().ok()).collect();
        let all = value.split_ascii_whitespace().count() == N;
        let bad = |_| self.bad(attribute, value, format!("{N} numbers"));
        if all { numbers.try_into().map(Some).map_err(bad) } else { Err(bad(numbers)) }
    }

    /// First and last point along three axes.
    fn extent(&self, attribute: &'static str) -> Result<[i64; 6], VtuError> {
        const EXPECTED: &str = "first and last point along x, y, z";
        let extent = self.numbers::<i64, 6>(attribute)?.ok_or_else(|| self.bad(attribute, "", EXPECTED.into()))?;
        let is_sound = |&[first, last]: &[i64; 2]| first <= last && first > i64::MIN / 4 && last < i64::MAX / 4;
        let pairs = [[extent[0], extent[1]], [extent[2], extent[3]], [extent[4], extent[5]]];
        if pairs.iter().all(is_sound) { Ok(extent) } else { Err(self.bad(attribute, &format!("{extent:?}"), EXPECTED.into())) }
    }

    fn image_frame(&self) -> Result<ImageFrame, VtuError> {
        Ok(ImageFrame {
            extent: self.extent("WholeExtent")?,
            origin: self.numbers("Origin")?.unwrap_or([0.0; 3]),
            spacing: self.numbers("Spacing")?.unwrap_or([1.0; 3]),
            direction: self.numbers("Direction")?.unwrap_or([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        })
    }

    fn bad(&self, attribute: &'static str, value: &str, expected: String) -> VtuError {
        let of = self.get("Name").map_or_else(String::new, |name| format!(" of \"{name}\""));
        VtuError::Attribute { element: format!("<{}>{of}", self.name), attribute, found: value.chars().take(60).collect(), expected }
    }
}

/// A step through the markup.
enum Node {
    /// An element begins.
    Open(Element),
    /// The innermost open element ends.
    Close,
    /// A comment or the like.
    Other,
}

/// Steps through the markup of a file.
struct Walker<'a> {
    reader: Reader<Limited<'a>>,
    buffer: Vec<u8>,
    /// The names of the open elements.
    open: Vec<String>,
    /// Where the text before the last node lies, `None` if it was blank.
    text: Option<Range<u64>>,
    /// Pieces and arrays so far.
    nodes: usize,
    kind: Kind,
}

impl<'a> Walker<'a> {
    fn new(source: &'a Source<'_>, kind: Kind) -> Result<Self, VtuError> {
        let mut reader = Reader::from_reader(Limited { inner: source.stream()?, left: MARKUP_LIMIT });
        reader.config_mut().expand_empty_elements = true;
        Ok(Walker { reader, buffer: Vec::new(), open: Vec::new(), text: None, nodes: 0, kind })
    }

    /// The next tag; the text before it is left in `self.text`.
    fn next(&mut self) -> Result<Node, VtuError> {
        self.skip_text()?;
        self.buffer.clear();
        self.reader.get_mut().left = MARKUP_LIMIT;
        let at = self.reader.buffer_position();
        match self.reader.read_event_into(&mut self.buffer) {
            Ok(Event::Start(tag)) => {
                let element = Element::new(&tag, at)?;
                if self.open.len() == DEPTH_LIMIT {
                    return Err(VtuError::Xml { at, reason: format!("more than {DEPTH_LIMIT} elements are nested") });
                }
                self.open.push(element.name.clone());
                Ok(Node::Open(element))
            }
            Ok(Event::End(_)) => {
                self.open.pop();
                Ok(Node::Close)
            }
            Ok(Event::DocType(_)) => Err(VtuError::Doctype),
            Ok(Event::Eof) => {
                let within = self.open.last().map_or_else(|| "before its first element".into(), |name| format!("within <{name}>"));
                Err(VtuError::Xml { at, reason: format!("the file ends {within}") })
            }
            Ok(_) => Ok(Node::Other),
            Err(quick_xml::Error::Io(e)) if e.kind() != io::ErrorKind::FileTooLarge => {
                Err(VtuError::Io(io::Error::new(e.kind(), e.to_string())))
            }
            Err(e) => Err(VtuError::Xml { at, reason: e.to_string() }),
        }
    }

    /// Goes on to the next `<` (or the end of the file) without keeping what lies before it.
    fn skip_text(&mut self) -> Result<(), VtuError> {
        let start = self.reader.buffer_position();
        let mut blank = true;
        loop {
            self.reader.get_mut().left = MARKUP_LIMIT;
            let mut stream = self.reader.stream();
            let bytes = stream.fill_buf()?;
            let end = bytes.iter().position(|&b| b == b'<');
            let text = &bytes[..end.unwrap_or(bytes.len())];
            blank &= text.trim_ascii_start().is_empty();
            let (len, done) = (text.len(), end.is_some() || bytes.is_empty());
            stream.consume(len);
            if done {
                self.text = (!blank).then(|| start..self.reader.buffer_position());
                return Ok(());
            }
        }
    }

    /// Skips to the end of the element that was opened last.
    fn skip(&mut self) -> Result<(), VtuError> {
        let outside = self.open.len().saturating_sub(1);
        while self.open.len() > outside {
            self.next()?;
        }
        Ok(())
    }

    /// The root element, which must be that of the kind of file.
    fn root(&mut self) -> Result<Element, VtuError> {
        loop {
            match self.next() {
                Ok(Node::Open(e)) if e.name != "VTKFile" => {
                    return Err(self.kind.no(format!("its root element is <{}>, expected <VTKFile>", e.name)));
                }
                Ok(Node::Open(e)) => {
                    return match e.get("type") {
                        Some(found) if found == self.kind.name() => Ok(e),
                        Some("PPolyData" | "PStructuredGrid" | "PRectilinearGrid") if self.kind == Kind::Parallel => Ok(e),
                        other => {
                            let found = other.unwrap_or("");
                            Err(self.kind.no(format!("it is a VTK file of type \"{found}\", expected \"{}\"", self.kind.name())))
                        }
                    };
                }
                Ok(_) => {}
                Err(VtuError::Xml { reason, .. }) if self.open.is_empty() => return Err(self.kind.no(reason)),
                Err(e) => return Err(e),
            }
        }
    }

    /// The content of `<UnstructuredGrid>`, `<ImageData>` and the like. Field data are not read.
    fn grid(&mut self, pieces: &mut Vec<Piece>) -> Result<(), VtuError> {
        loop {
            match self.next()? {
                Node::Open(e) if e.name == "Piece" => {
                    let piece = self.piece(&e)?;
                    pieces.push(piece);
                }
                Node::Open(_) => self.skip()?,
                Node::Close => return Ok(()),
                Node::Other => {}
            }
        }
    }

    fn piece(&mut self, element: &Element) -> Result<Piece, VtuError> {
        self.count_node()?;
        let count = |attribute| element.count(attribute)?.ok_or_else(|| element.bad(attribute, "", "an integer from 0".into()));
        let mut piece = match self.kind {
            Kind::UnstructuredGrid => Piece { points: count("NumberOfPoints")?, cells: count("NumberOfCells")?, ..Piece::default() },
            Kind::ImageData => Piece { extent: element.extent("Extent")?, ..Piece::default() },
            Kind::PolyData => {
                let mut piece = Piece { points: count("NumberOfPoints")?, ..Piece::default() };
                for (group, attribute) in piece.groups.iter_mut().zip(["NumberOfVerts", "NumberOfLines", "NumberOfPolys", "NumberOfStrips"])
                {
                    group.cells = element.count(attribute)?.unwrap_or(0);
                    piece.cells = piece.cells.saturating_add(group.cells);
                }
                piece
            }
            Kind::StructuredGrid | Kind::RectilinearGrid | Kind::Parallel | Kind::Collection => {
                let extent = element.extent("Extent")?;
                // No product of these wraps round: more than can be indexed is refused by its number.
                let along = |axis: usize| (extent[2 * axis + 1] - extent[2 * axis]) as u64;
                let product = |add: u64| (0..3).fold(1u64, |product, axis| product.saturating_mul(along(axis).saturating_add(add)));
                Piece { extent, points: product(1), cells: product(0), ..Piece::default() }
            }
        };
        loop {
            match self.next()? {
                Node::Open(e) => match e.name.as_str() {
                    "PointData" => piece.point_data = Section { scalars: e.get("Scalars").map(str::to_owned), arrays: self.arrays()? },
                    "CellData" => piece.cell_data = Section { scalars: e.get("Scalars").map(str::to_owned), arrays: self.arrays()? },
                    "Points" | "Coordinates" => piece.coordinates = self.arrays()?,
                    "Cells" => piece.topology = self.arrays()?,
                    "Verts" => piece.groups[0].topology = self.arrays()?,
                    "Lines" => piece.groups[1].topology = self.arrays()?,
                    "Polys" => piece.groups[2].topology = self.arrays()?,
                    "Strips" => piece.groups[3].topology = self.arrays()?,
                    _ => self.skip()?,
                },
                Node::Close => return Ok(piece),
                Node::Other => {}
            }
        }
    }

    /// The numeric arrays in the element that was opened last; text and bits are left out.
    fn arrays(&mut self) -> Result<Vec<Array>, VtuError> {
        let mut arrays = Vec::new();
        loop {
            match self.next()? {
                Node::Open(e) if e.name == "DataArray" && !matches!(e.get("type"), Some("String" | "Bit" | "Variant")) => {
                    arrays.push(self.array(&e)?);
                }
                Node::Open(_) => self.skip()?,
                Node::Close => return Ok(arrays),
                Node::Other => {}
            }
        }
    }

    fn array(&mut self, element: &Element) -> Result<Array, VtuError> {
        self.count_node()?;
        let name = element.get("Name").unwrap_or_default().to_owned();
        let scalar = element.one_of("type", &ScalarType::NAMES)?.ok_or_else(|| element.bad("type", "", "a numeric type".into()))?;
        let components = element.count("NumberOfComponents")?;
        let format = element.one_of("format", &[("ascii", 'a'), ("binary", 'b'), ("appended", 'o')])?.unwrap_or('a');

        // The numbers may stand before, between or behind child elements (information keys), but in one place only.
        let end = self.reader.buffer_position();
        let mut text = end..end;
        loop {
            let node = self.next()?;
            if let Some(found) = self.text.take() {
                if !text.is_empty() {
                    return Err(VtuError::Xml { at: found.start, reason: format!("the numbers of \"{name}\" stand in two places") });
                }
                text = found;
            }
            match node {
                Node::Open(_) => self.skip()?,
                Node::Close => break,
                Node::Other => {}
            }
        }
        let place = match format {
            'a' => Place::Ascii(text),
            'b' => Place::Base64(text),
            _ => Place::Appended(element.count("offset")?.ok_or_else(|| element.bad("offset", "", "an integer from 0".into()))?),
        };
        Ok(Array { name, scalar, components, place })
    }

    fn count_node(&mut self) -> Result<(), VtuError> {
        self.nodes += 1;
        let at = self.reader.buffer_position();
        let reason = || format!("there are more than {NODES_LIMIT} pieces and arrays");
        if self.nodes > NODES_LIMIT { Err(VtuError::Xml { at, reason: reason() }) } else { Ok(()) }
    }

    /// The place behind the underscore that `<AppendedData>` must begin with.
    fn after_underscore(&mut self) -> Result<u64, VtuError> {
        let at = self.reader.buffer_position();
        self.reader.get_mut().left = MARKUP_LIMIT;
        let mut byte = [0];
        let mut stream = self.reader.stream();
        while stream.read(&mut byte)? == 1 {
            match byte[0] {
                b'_' => return Ok(self.reader.buffer_position()),
                b if b.is_ascii_whitespace() => {}
                _ => break,
            }
        }
        Err(VtuError::Xml { at, reason: "the appended data do not start with an underscore".into() })
    }
}

/// A stream that ends in an error once it has given `left` bytes, so that one endless tag cannot fill the memory.
struct Limited<'a> {
    inner: Box<dyn BufRead + 'a>,
    left: usize,
}

impl Read for Limited<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let bytes = self.fill_buf()?;
        let len = bytes.len().min(out.len());
        out[..len].copy_from_slice(&bytes[..len]);
        self.consume(len);
        Ok(len)
    }
}

impl BufRead for Limited<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.left == 0 {
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("a tag or comment is longer than {MARKUP_LIMIT} bytes")));
        }
        let bytes = self.inner.fill_buf()?;
        Ok(&bytes[..bytes.len().min(self.left)])
    }

    fn consume(&mut self, len: usize) {
        self.inner.consume(len);
        self.left -= len;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Result<Head, VtuError> {
        read_head(&Source::Bytes(text.as_bytes()), Kind::UnstructuredGrid)
    }

    fn with_array(array: &str) -> String {
        format!(
            "<?xml version='1.0'?><!-- made by hand --><VTKFile type='UnstructuredGrid'><UnstructuredGrid><FieldData>\
             <DataArray type='Float64' NumberOfTuples='1' format='ascii'>3</DataArray></FieldData><Piece NumberOfPoints='4' \
             NumberOfCells=' 1 '><PointData Scalars='s'>{array}</PointData></Piece></UnstructuredGrid></VTKFile>"
        )
    }

    #[test]
    fn what_is_absent_has_its_default() {
        let head = head(&with_array("<DataArray type='Int8' Name='s' NumberOfComponents=''>1 2 3 4</DataArray>")).expect("sound");
        assert_eq!((head.byte_order, head.header_size, head.compressor), (ByteOrder::Little, 4, None));
        assert_eq!((head.pieces[0].points, head.pieces[0].cells), (4, 1));
        let array = &head.pieces[0].point_data.arrays[0];
        assert_eq!((array.name.as_str(), array.components), ("s", None));
        assert_eq!(head.pieces[0].point_data.scalars.as_deref(), Some("s"));
    }

    #[test]
    fn numbers_are_found_beside_information_keys_and_comments() {
        let key = "<InformationKey name='L2' location='vtk' length='2'><Value index='0'>9</Value></InformationKey>";
        for content in [format!("{key}1 2 3 4"), format!(" 1 2 3 4\n{key} "), format!("{key}<!-- these: -->1 2 3 4{key}")] {
            let text = with_array(&format!("<DataArray type='Int8' Name='s'>{content}</DataArray>"));
            let Place::Ascii(place) = head(&text).expect("sound").pieces[0].point_data.arrays[0].place.clone() else { panic!("not ascii") };
            assert_eq!(text[place.start as usize..place.end as usize].trim(), "1 2 3 4");
        }
        let twice = with_array(&format!("<DataArray type='Int8' Name='s'>1 2 {key} 3 4</DataArray>"));
        assert!(head(&twice).is_err_and(|e| e.to_string().contains("\"s\" stand in two places")));
    }

    #[test]
    fn text_arrays_are_left_out() {
        let arrays = "<Array type='String' Name='t' format='ascii'>65 0</Array><DataArray type='String' Name='u'/>\
                      <DataArray type='Float32' Name='s' format='appended' offset='16      '/>";
        let head = head(&with_array(arrays)).expect("sound");
        let found: Vec<_> = head.pieces[0].point_data.arrays.iter().map(|a| (a.name.as_str(), a.place.clone())).collect();
        assert_eq!(found, [("s", Place::Appended(16))]);
    }

    #[test]
    fn appended_data_start_behind_the_underscore_and_end_the_xml() {
        let text = "<VTKFile type='UnstructuredGrid'><UnstructuredGrid/><AppendedData encoding='raw'>\n  _<&\u{0}";
        let appended = head(text).expect("sound").appended.expect("present");
        assert_eq!((&text[appended.start as usize..], appended.base64), ("<&\u{0}", false));
        let text = "<VTKFile type='UnstructuredGrid'><UnstructuredGrid/><AppendedData encoding='raw'>\n  AAAA";
        assert!(head(text).is_err_and(|e| e.to_string().contains("underscore")));
    }

    #[test]
    fn hostile_markup_is_refused() {
        let entities = "<!DOCTYPE x [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;'>]><VTKFile type='UnstructuredGrid'/>";
        let deep = format!("<VTKFile type='UnstructuredGrid'>{}", "<a>".repeat(1000));
        let broad = format!("<VTKFile type='UnstructuredGrid' {}>", "a='' ".repeat(1000));
        let long = format!("<VTKFile type='UnstructuredGrid' a='{}'>", "a".repeat(MARKUP_LIMIT));
        let arrays = "<DataArray type='Int8'/>".repeat(NODES_LIMIT + 1);
        for (text, expected) in [
            (entities, "document type"),
            ("<VTKFile type='UnstructuredGrid' byte_order='&a;'/>", "unrecognized entity `a`"),
            ("<html><body/></html>", "root element is <html>"),
            ("", "the file ends before its first element"),
            ("\u{0}\u{1}binary", "the file ends before its first element"),
            ("<VTKFile type='PolyData'/>", "VTK file of type \"PolyData\", expected \"UnstructuredGrid\""),
            ("<VTKFile type='UnstructuredGrid'/>", "no element <UnstructuredGrid>"),
            ("<VTKFile type='UnstructuredGrid'><UnstructuredGrid>", "the file ends within <UnstructuredGrid>"),
            ("<VTKFile type='UnstructuredGrid'><UnstructuredGrid></VTKFile>", "not well-formed XML"),
            ("<VTKFile type='UnstructuredGrid' header_type='UInt16'/>", "header_type=\"UInt16\", expected one of \"UInt32\", \"UInt64\""),
            ("<VTKFile type='UnstructuredGrid' byte_order='Middle'/>", "byte_order=\"Middle\""),
            ("<VTKFile type='UnstructuredGrid' compressor='vtkZip'/>", "\"vtkZLibDataCompressor\", \"vtkLZ4DataCompressor\""),
            (&deep, "more than 50 elements are nested"),
            (&broad, "more than 100 attributes"),
            (&long, "longer than 1048576 bytes"),
            (&with_array(&arrays), "more than 1048576 pieces and arrays"),
            (&with_array("<DataArray type='Float16' Name='s'/>"), "<DataArray> of \"s\" has type=\"Float16\", expected one of \"Int8\""),
            (&with_array("<DataArray Name='s'/>"), "expected a numeric type"),
            (
                &with_array("<DataArray type='Int8' Name='s' NumberOfComponents='-3'/>"),
                "NumberOfComponents=\"-3\", expected an integer from 0",
            ),
            (&with_array("<DataArray type='Int8' Name='s' format='appended'/>"), "offset=\"\", expected an integer from 0"),
            (&with_array("").replace("'4'", "'99999999999999999999'"), "NumberOfPoints=\"99999999999999999999\""),
            (&with_array("").replace("NumberOfCells", "Cells"), "NumberOfCells=\"\""),
        ] {
            let error = head(text).expect_err(expected).to_string();
            assert!(error.contains(expected), "\"{error}\" does not say \"{expected}\"");
        }
    }
}
