//! What the formats of volumes share: keys of a header, data files beside it, and numbers into [`Samples`].

use super::GridFile;
use super::segy::SegyError;
use super::source::Source;
use super::vtu::data::ArrayReader;
use super::vtu::number::{self, ByteOrder, Item, ScalarType};
use super::vtu::xml::{Array, Head, Place};
use super::vtu::{ArrayError, VtuError};
use crate::progress::{Cancelled, Progress};
use crate::volume::{Grid, GridError, GridFrame, Numbers, Samples, pick_component};
use flate2::bufread::{MultiGzDecoder, ZlibDecoder};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};

/// Bytes read at once; a multiple of 8 for the numbers' sake.
const CHUNK: usize = 4 << 20;

/// Deflate makes at most so many bytes of one (zlib's technical notes: 1032).
const DEFLATE_RATIO: u64 = 1032;

/// Bytes that a header may have.
const HEADER_LIMIT: u64 = 1 << 20;

/// Why a file is no volume that octetra can read. The texts continue the file's name and a colon.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Stopped on request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A key of the header is missing or makes no sense.
    #[error("{key} is {found}, expected {expected}")]
    Key {
        /// The key.
        key: String,
        /// Its value, or that it is missing.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// The file of the numbers cannot be opened.
    #[error("its data file {} cannot be read: {reason}", file.display())]
    DataFile {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: io::Error,
    },
    /// The numbers are too few or too many.
    #[error("{place} has {found} bytes of data, expected {expected}: {why}")]
    Length {
        /// The file or the part of it.
        place: String,
        /// How many there are, as text.
        found: String,
        /// How many there should be.
        expected: u64,
        /// What calls for them.
        why: String,
    },
    /// The compressed numbers are damaged.
    #[error("{place} cannot be inflated: {reason}")]
    Inflate {
        /// The file or the part of it.
        place: String,
        /// What the decoder says.
        reason: String,
    },
    /// The numbers as text, or an array of a `.vti` file, cannot be read.
    #[error("{array} {reason}")]
    Array {
        /// Which numbers.
        array: String,
        /// What is wrong with them.
        reason: ArrayError,
    },
    /// It would take more memory than it may.
    #[error("needs {need} bytes of memory for {what}, the budget is {limit} bytes; raise it with --memory")]
    Memory {
        /// Bytes that it would take.
        need: u64,
        /// For what.
        what: String,
        /// Bytes that there are.
        limit: u64,
    },
    /// No array to show.
    #[error("there is no array to show{}", .0.as_deref().unwrap_or(""))]
    NoArray(Option<String>),
    /// What it holds is no volume.
    #[error("the volume {0}")]
    Grid(#[from] GridError),
    /// It is no sound SEG-Y.
    #[error("{0}")]
    Segy(#[from] SegyError),
    /// The markup of a `.vti` file is broken.
    #[error("{0}")]
    Xml(#[from] VtuError),
}

impl VolumeError {
    /// A key that has the wrong value.
    pub(super) fn key(key: &str, found: &str, expected: impl Into<String>) -> Self {
        let clipped: String = found.trim().chars().take(60).collect();
        VolumeError::Key { key: key.to_owned(), found: format!("\"{clipped}\""), expected: expected.into() }
    }

    /// A key that is not there.
    pub(super) fn missing(key: &str, expected: impl Into<String>) -> Self {
        VolumeError::Key { key: key.to_owned(), found: "missing".into(), expected: expected.into() }
    }

    /// The request to stop, if that is why.
    pub(super) fn cancelled(&self) -> Option<Cancelled> {
        match self {
            VolumeError::Segy(SegyError::Cancelled(cancelled)) => Some(*cancelled),
            VolumeError::Cancelled(cancelled) | VolumeError::Xml(VtuError::Cancelled(cancelled)) => Some(*cancelled),
            VolumeError::Array { reason: ArrayError::Cancelled(cancelled), .. } => Some(*cancelled),
            _ => None,
        }
    }
}

/// `N` numbers between blanks.
pub(super) fn numbers<T: std::str::FromStr, const N: usize>(key: &str, text: &str, expected: &str) -> Result<[T; N], VolumeError> {
    let bad = || VolumeError::key(key, text, expected);
    let found: Vec<T> = text.split_ascii_whitespace().map(|n| n.parse().ok()).collect::<Option<_>>().ok_or_else(bad)?;
    found.try_into().map_err(|_| bad())
}

/// The number of points along three axes.
pub(super) fn dims(key: &str, found: [u64; 3]) -> Result<[u32; 3], VolumeError> {
    let fits = |n: u64| u32::try_from(n).ok().filter(|&n| n >= 2);
    match found.map(fits) {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ => {
            let [x, y, z] = found;
            Err(VolumeError::key(key, &format!("{x} {y} {z}"), "2 to 4294967295 points along each axis"))
        }
    }
}

/// The start of a file, as much as a header may have.
pub(super) fn head_of<'a>(source: &'a Source<'_>) -> Result<std::borrow::Cow<'a, [u8]>, VolumeError> {
    Ok(source.read(0, source.len().min(HEADER_LIMIT) as usize)?)
}

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Raw,
    /// Gzip members, one behind the other.
    Gzip,
    /// A zlib stream.
    Zlib,
    Text,
}

/// Numbers of a file: all of them, from a byte on to its end.
pub(super) struct Stored {
    pub scalar: ScalarType,
    pub order: ByteOrder,
    pub encoding: Encoding,
    /// How many.
    pub numbers: u64,
    /// What calls for that many, for error messages.
    pub why: String,
}

/// Where numbers lie: in the header's own file or beside it.
pub(super) enum DataFile<'a> {
    Own(&'a Source<'a>),
    Beside(PathBuf, File, u64),
}

impl<'a> DataFile<'a> {
    /// A file that a header names, which must lie in the header's folder or below.
    pub fn beside(file: &GridFile<'_>, key: &str, name: &str) -> Result<DataFile<'a>, VolumeError> {
        let relative = Path::new(name.trim());
        let is_below = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !is_below || name.trim().is_empty() {
            return Err(VolumeError::key(key, name, "a file beside the header, named without folders above it"));
        }
        let path = file.path.parent().unwrap_or(Path::new("")).join(relative);
        let failed = |reason| VolumeError::DataFile { file: relative.to_owned(), reason };
        let opened = File::open(&path).map_err(failed)?;
        let metadata = opened.metadata().map_err(failed)?;
        if !metadata.is_file() {
            return Err(failed(io::Error::other("not a regular file")));
        }
        Ok(DataFile::Beside(relative.to_owned(), opened, metadata.len()))
    }

    fn with_source<R>(&self, work: impl FnOnce(&Source<'_>) -> R) -> R {
        match self {
            DataFile::Own(source) => work(source),
            DataFile::Beside(_, file, len) => work(&Source::File(file, *len)),
        }
    }

    fn name(&self) -> String {
        match self {
            DataFile::Own(_) => "it".into(),
            DataFile::Beside(name, ..) => format!("its data file {}", name.display()),
        }
    }

    /// Length in bytes.
    pub fn len(&self) -> u64 {
        self.with_source(|source| source.len())
    }

    /// Where line `lines` (from 0) begins, counted from byte `at`.
    pub fn skip_lines(&self, mut at: u64, lines: u64, key: &str) -> Result<u64, VolumeError> {
        self.with_source(|source| {
            let mut left = lines;
            while left > 0 {
                let chunk = source.read(at, (source.len() - at).min(CHUNK as u64) as usize)?;
                if chunk.is_empty() {
                    return Err(VolumeError::key(key, &lines.to_string(), "no more lines than there are"));
                }
                match chunk.iter().position(|&b| b == b'\n') {
                    Some(end) => (at, left) = (at + end as u64 + 1, left - 1),
                    None => at += chunk.len() as u64,
                }
            }
            Ok(at)
        })
    }

    /// Reads numbers from byte `at` on.
    pub fn read(&self, at: u64, stored: &Stored, file: &GridFile<'_>, progress: &Progress) -> Result<Samples, VolumeError> {
        let size = stored.scalar.size() as u64;
        let bytes = stored.numbers.checked_mul(size).filter(|&bytes| bytes < 1 << 62);
        let bytes = bytes.ok_or_else(|| self.length(format!("at most {}", u64::MAX), u64::MAX, stored))?;
        self.with_source(|source| {
            let left = source.len().saturating_sub(at);
            self.check_length(left, bytes, stored)?;
            if let Some(mapped) = self.map(source, at, bytes, stored, file) {
                return Ok(mapped);
            }
            file.check_memory(bytes, format!("{} voxels", stored.numbers))?;
            progress.begin("reading", bytes);
            macro_rules! of {
                ($samples:ident) => {{
                    let mut out = Vec::new();
                    self.read_items(source, at, bytes, stored, progress, &mut out)?;
                    Samples::$samples(out.into())
                }};
            }
            Ok(match stored.scalar {
                ScalarType::UInt8 => of!(U8),
                ScalarType::Int8 => of!(I8),
                ScalarType::UInt16 => of!(U16),
                ScalarType::Int16 => of!(I16),
                ScalarType::UInt32 => of!(U32),
                ScalarType::Int32 => of!(I32),
                ScalarType::Float32 => of!(F32),
                ScalarType::UInt64 | ScalarType::Int64 | ScalarType::Float64 => of!(F64),
            })
        })
    }

    /// The numbers where they lie, if they are many, their bytes are what this machine has in memory, and the system can.
    fn map(&self, source: &Source<'_>, at: u64, bytes: u64, stored: &Stored, file: &GridFile<'_>) -> Option<Samples> {
        let options = file.options;
        let is_native = stored.scalar.size() == 1 || (stored.order == ByteOrder::Big) == cfg!(target_endian = "big");
        let is_large = bytes >= options.map_from_bytes || bytes > options.memory_bytes;
        let Source::File(on_disk, _) = source else { return None };
        if stored.encoding != Encoding::Raw || !is_native || !is_large {
            return None;
        }
        let count = usize::try_from(stored.numbers).ok()?;
        macro_rules! of {
            ($samples:ident) => {
                Numbers::map(on_disk, at, count).ok()?.map(Samples::$samples)
            };
        }
        match stored.scalar {
            ScalarType::UInt8 => of!(U8),
            ScalarType::Int8 => of!(I8),
            ScalarType::UInt16 => of!(U16),
            ScalarType::Int16 => of!(I16),
            ScalarType::UInt32 => of!(U32),
            ScalarType::Int32 => of!(I32),
            ScalarType::Float32 => of!(F32),
            ScalarType::Float64 => of!(F64),
            ScalarType::UInt64 | ScalarType::Int64 => None, // kept as floats
        }
    }

    fn length(&self, found: String, expected: u64, stored: &Stored) -> VolumeError {
        VolumeError::Length { place: self.name(), found, expected, why: stored.why.clone() }
    }

    /// What the length of the file says before anything is read.
    fn check_length(&self, left: u64, bytes: u64, stored: &Stored) -> Result<(), VolumeError> {
        let can_hold = match stored.encoding {
            Encoding::Raw if left != bytes => return Err(self.length(left.to_string(), bytes, stored)),
            Encoding::Raw => return Ok(()),
            Encoding::Gzip | Encoding::Zlib => bytes <= left.saturating_mul(DEFLATE_RATIO),
            Encoding::Text if stored.numbers > left.div_ceil(2) => {
                let (place, why) = (self.name(), format!("at the least, for so many numbers as text; {}", stored.why));
                let expected = stored.numbers.saturating_mul(2) - 1;
                return Err(VolumeError::Length { place, found: left.to_string(), expected, why });
            }
            Encoding::Text => true,
        };
        if can_hold { Ok(()) } else { Err(self.length(format!("{left} encoded"), bytes, stored)) }
    }

    fn read_items<I: Item>(
        &self,
        source: &Source<'_>,
        at: u64,
        bytes: u64,
        stored: &Stored,
        progress: &Progress,
        out: &mut Vec<I>,
    ) -> Result<(), VolumeError> {
        match stored.encoding {
            Encoding::Text => read_text(source, at, stored, progress, out),
            Encoding::Raw => self.read_stream(stream_at(source, at)?, bytes, stored, progress, out),
            Encoding::Gzip => self.read_stream(MultiGzDecoder::new(stream_at(source, at)?), bytes, stored, progress, out),
            Encoding::Zlib => self.read_stream(ZlibDecoder::new(stream_at(source, at)?), bytes, stored, progress, out),
        }
    }

    fn read_stream<I: Item>(
        &self,
        mut stream: impl Read,
        bytes: u64,
        stored: &Stored,
        progress: &Progress,
        out: &mut Vec<I>,
    ) -> Result<(), VolumeError> {
        let failed = |e: io::Error| match stored.encoding {
            Encoding::Raw => VolumeError::Io(e),
            _ => VolumeError::Inflate { place: self.name(), reason: e.to_string() },
        };
        let (size, mut chunk, mut done) = (stored.scalar.size(), Vec::new(), 0);
        while done < bytes {
            progress.check()?;
            chunk.clear();
            let wanted = (bytes - done).min(CHUNK as u64);
            let found = stream.by_ref().take(wanted).read_to_end(&mut chunk).map_err(failed)? as u64;
            done += found;
            if found < wanted {
                return Err(self.length(done.to_string(), bytes, stored));
            }
            // What is compressed gets room as it comes: a header is not to be believed.
            let count = chunk.len() / size;
            if out.capacity() - out.len() < count {
                let left = (bytes - done) as usize / size + count;
                let room = if stored.encoding == Encoding::Raw { left } else { left.min(count + 2 * out.len()) };
                let memory = |_| VolumeError::Io(io::Error::from(io::ErrorKind::OutOfMemory));
                out.try_reserve_exact(room).map_err(memory)?;
            }
            let misfit = |(_, number): (usize, number::Number)| self.length(format!("a {number}"), bytes, stored);
            number::append_binary(out, &chunk, stored.scalar, stored.order).map_err(misfit)?;
            progress.add(found);
        }
        let mut behind = [0];
        match stream.read(&mut behind).map_err(failed)? {
            0 => Ok(()),
            _ => Err(self.length(format!("more than {bytes}"), bytes, stored)),
        }
    }
}

fn stream_at<'a>(source: &'a Source<'_>, at: u64) -> io::Result<Box<dyn BufRead + 'a>> {
    Ok(match source {
        Source::Bytes(bytes) => Box::new(&bytes[usize::try_from(at).unwrap_or(usize::MAX).min(bytes.len())..]),
        Source::File(file, _) => {
            let mut file = *file;
            file.seek(SeekFrom::Start(at))?;
            Box::new(BufReader::with_capacity(1 << 18, file))
        }
    })
}

/// Numbers as text, as a `.vtu` file has them.
fn read_text<I: Item>(source: &Source<'_>, at: u64, stored: &Stored, progress: &Progress, out: &mut Vec<I>) -> Result<(), VolumeError> {
    let head = Head { byte_order: ByteOrder::Little, header_size: 4, compressor: None, image: None, pieces: vec![], appended: None };
    let array = Array { name: String::new(), scalar: stored.scalar, components: None, place: Place::Ascii(at..source.len()) };
    let reader = ArrayReader { source, head: &head, progress };
    reader.append(&array, stored.numbers, out).map_err(|reason| VolumeError::Array { array: "its text".into(), reason })
}

/// A grid from numbers that may be vectors; `inner` as for [`pick_component`].
pub(super) fn grid(
    file: &GridFile<'_>,
    frame: GridFrame,
    name: &str,
    samples: Samples,
    inner: usize,
    components: usize,
) -> Result<Grid, VolumeError> {
    // What is picked from the vectors of a mapped file comes into memory.
    if components > 1 && samples.is_mapped() {
        file.check_memory(frame.points() * (samples.bytes() / samples.len()).max(4) as u64, format!("{} voxels", frame.points()))?;
    }
    let picked = pick_component(samples, inner, components, file.options.component)?;
    Ok(Grid::new(frame, name.to_owned(), picked)?)
}

impl GridFile<'_> {
    /// An error if something needs more memory than there is.
    pub(super) fn check_memory(&self, need: u64, what: String) -> Result<(), VolumeError> {
        let limit = self.options.memory_bytes;
        if need > limit { Err(VolumeError::Memory { need, what, limit }) } else { Ok(()) }
    }

    /// What numbers are called that have no name in the file.
    pub(super) fn default_name(&self) -> Result<&'static str, VolumeError> {
        const NAME: &str = "values";
        match &self.options.array {
            Some(name) if name != NAME => Err(VolumeError::NoArray(Some(format!(" named \"{name}\"; the volume has \"{NAME}\"")))),
            _ => Ok(NAME),
        }
    }
}
