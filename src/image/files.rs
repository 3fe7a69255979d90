//! PNG and NPY files. Every file is written under a temporary name and renamed, so that an interrupted run leaves the old file whole.

use super::{Background, Image};
use image::codecs::png::{PngDecoder, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder};
use npyz::{NpyFile, WriterBuilder};
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, Read, Write};
use std::path::{Path, PathBuf};

/// Longest side of an image that is read, in pixels.
const MAX_SIDE: u64 = 1 << 16;

/// Most pixels of an image that is read: 2 GiB as [`Image`]. A header that asks for more is refused before anything is allocated.
const MAX_PIXELS: u64 = 1 << 27;

/// The arrays that hold an image.
const IMAGE_ARRAYS: &str = "float32 or float64 of shape (height, width, 4), (height, width, 3) or (height, width), in C order";

/// An image, and what its file could say about it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredImage {
    /// The image; opaque where the file has no alpha.
    pub image: Image,
    /// The file says what is transparent. A PNG whose alpha is opaque everywhere does not.
    pub has_alpha: bool,
    /// Its numbers are finer than 8 bits.
    pub is_deep: bool,
}

/// A number per pixel in data units, as `--value` and `--depth` write it, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelValues {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` values; NaN or infinite where there is none.
    pub values: Vec<f64>,
}

/// What [`read_image`] found.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageFile {
    /// Colours.
    Colors(StoredImage),
    /// Values.
    Values(PixelValues),
}

impl From<Image> for StoredImage {
    /// A renderer's image: floats with alpha.
    fn from(image: Image) -> Self {
        StoredImage { image, has_alpha: true, is_deep: true }
    }
}

/// Why an image file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The system said no.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The file holds something else.
    #[error("{}: {found}, expected {expected}", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// What it holds.
        found: String,
        /// What it should hold.
        expected: &'static str,
    },
    /// It is a folder.
    #[error("{}: is a folder, expected a PNG or NPY file", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// It is neither a PNG nor an NPY file.
    #[error("{}: neither a PNG nor an NPY file by its first bytes", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
    /// It has no pixels, or more than are read.
    #[error("{}: {width} x {height} pixels, expected 1 to 65536 a side and at most 134217728 in all", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// Width in pixels.
        width: u64,
        /// Height in pixels.
        height: u64,
    },
    /// Colours are NaN or infinite.
    #[error("{}: {count} of {pixels} pixels are NaN or infinite, expected finite colours", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// How many.
        count: usize,
        /// Of how many.
        pixels: usize,
    },
    /// It ends too early.
    #[error("{}: ends after {found} numbers, expected {expected}", path.display())]
    CutShort {
        /// The file.
        path: PathBuf,
        /// How many numbers it holds.
        found: u64,
        /// How many it should.
        expected: u64,
    },
    /// The PNG encoder or decoder failed.
    #[error("{}: {cause}", path.display())]
    Png {
        /// The file.
        path: PathBuf,
        /// What it said.
        cause: image::ImageError,
    },
}

/// Writes to a temporary file beside `path` and renames it when `write` is done. A link is followed; a device or a pipe is written to as it
/// is.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let followed = std::fs::canonicalize(path).ok();
    let path = followed.as_deref().unwrap_or(path);
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        let mut out = BufWriter::new(std::fs::OpenOptions::new().write(true).open(path)?);
        write(&mut out)?;
        return out.flush();
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666)); // the umask applies, as for any new file
    }
    let file = builder.prefix(".octetra-").tempfile_in(folder)?;
    let mut out = BufWriter::with_capacity(1 << 20, file);
    write(&mut out)?;
    let file = out.into_inner().map_err(|e| e.into_error())?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Writes an 8-bit PNG over a background, or with alpha.
pub fn write_png(path: &Path, image: &Image, background: Background) -> Result<(), ImageError> {
    let color = if background == Background::Transparent { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    encode_png(path, &image.to_bytes(background), [image.width, image.height], color)
}

/// Writes an 8-bit PNG of RGB bytes, row by row from the top. `size` is width and height.
pub fn write_bytes_png(path: &Path, rgb: &[u8], size: [u32; 2]) -> Result<(), ImageError> {
    encode_png(path, rgb, size, ExtendedColorType::Rgb8)
}

/// An 8-bit PNG of RGB bytes in memory, to be a part of the file at `path`, which errors name.
pub fn bytes_png(path: &Path, rgb: &[u8], size: [u32; 2]) -> Result<Vec<u8>, ImageError> {
    png(path, rgb, size, ExtendedColorType::Rgb8)
}

fn png(path: &Path, bytes: &[u8], [width, height]: [u32; 2], color: ExtendedColorType) -> Result<Vec<u8>, ImageError> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(bytes, width, height, color).map_err(|cause| ImageError::Png { path: path.into(), cause })?;
    Ok(png)
}

fn encode_png(path: &Path, bytes: &[u8], size: [u32; 2], color: ExtendedColorType) -> Result<(), ImageError> {
    let png = png(path, bytes, size, color)?;
    write_atomically(path, |out| out.write_all(&png)).map_err(|cause| ImageError::Io { path: path.into(), cause })
}

/// Writes the raw image: float32 of shape (height, width, 4).
pub fn write_npy(path: &Path, image: &Image) -> Result<(), ImageError> {
    let shape = [u64::from(image.height), u64::from(image.width), 4];
    write_values_npy(path, &shape, image.pixels.as_flattened()).map_err(|cause| ImageError::Io { path: path.into(), cause })
}

/// Writes numbers as a C-ordered NPY array of this shape.
pub fn write_values_npy<T: npyz::AutoSerialize + Copy>(path: &Path, shape: &[u64], values: &[T]) -> io::Result<()> {
    write_atomically(path, |out| {
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(out).begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()
    })
}

/// Reads a raw image: float32 of shape (height, width, 4).
pub fn read_npy(path: &Path) -> Result<Image, ImageError> {
    let expected = "float32 of shape (height, width, 4)";
    let array = Array::open(path, BufReader::new(open(path)?))?;
    if !matches!(array.shape[..], [_, _, 4]) || array.file.dtype().descr() != "'<f4'" {
        return Err(array.wrong(expected));
    }
    array.colors(expected)
}

/// Reads a PNG of any colour type, 1 to 16 bits, of which only the first frame. Alpha is multiplied in; palettes and grey become RGB.
pub fn read_png(path: &Path) -> Result<StoredImage, ImageError> {
    decode_png(path, open(path)?)
}

/// Reads a PNG, or an NPY array of float32 or float64: colours of shape (height, width, 3 or 4), premultiplied, or one value per pixel of
/// shape (height, width). The content tells which. `Err` for colours that are NaN or infinite; values may be.
pub fn read_image(path: &Path) -> Result<ImageFile, ImageError> {
    let mut file = BufReader::new(open(path)?);
    let start = file.fill_buf().map_err(|cause| ImageError::Io { path: path.into(), cause })?;
    if start.starts_with(b"\x89PNG") {
        return decode_png(path, file).map(ImageFile::Colors);
    }
    if !start.starts_with(b"\x93NUMPY") {
        return Err(ImageError::Unknown { path: path.into() });
    }
    let array = Array::open(path, file)?;
    if array.shape.len() == 2 {
        return array.values().map(ImageFile::Values);
    }
    let has_alpha = array.shape.last() == Some(&4);
    let image = array.colors(IMAGE_ARRAYS)?;
    let count = image.pixels.par_iter().filter(|pixel| pixel.iter().any(|v| !v.is_finite())).count();
    if count > 0 {
        return Err(ImageError::NotFinite { path: path.into(), count, pixels: image.pixels.len() });
    }
    Ok(ImageFile::Colors(StoredImage { image, has_alpha, is_deep: true }))
}

/// Opens a file or a pipe.
fn open(path: &Path) -> Result<File, ImageError> {
    if path.is_dir() {
        return Err(ImageError::Folder { path: path.into() });
    }
    File::open(path).map_err(|cause| ImageError::Io { path: path.into(), cause })
}

/// The sides of an image that may be allocated.
fn checked_size(path: &Path, width: u64, height: u64) -> Result<(u32, u32), ImageError> {
    let fits = [width, height].iter().all(|side| (1..=MAX_SIDE).contains(side)) && width * height <= MAX_PIXELS;
    if fits { Ok((width as u32, height as u32)) } else { Err(ImageError::Size { path: path.into(), width, height }) }
}

fn decode_png(path: &Path, mut file: impl Read) -> Result<StoredImage, ImageError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|cause| ImageError::Io { path: path.into(), cause })?;
    let failed = |cause| ImageError::Png { path: path.into(), cause };
    let mut decoder = PngDecoder::new(Cursor::new(bytes)).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = checked_size(path, u64::from(width), u64::from(height))?;
    decoder.set_limits(image::Limits::no_limits()).map_err(failed)?; // the size was checked
    let picture = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let (color, has_alpha) = (picture.color(), picture.color().has_alpha());
    let is_deep = color.bytes_per_pixel() > color.channel_count();
    let pixels: Vec<[f32; 4]> = match (is_deep, has_alpha) {
        (true, _) => stored(picture.into_rgba16().as_raw().as_chunks::<4>().0, |&p| premultiplied(p.map(f32::from), 65535.0)),
        (false, true) => stored(picture.into_rgba8().as_raw().as_chunks::<4>().0, |&p| premultiplied(p.map(f32::from), 255.0)),
        (false, false) => {
            stored(picture.into_rgb8().as_raw().as_chunks::<3>().0, |&[r, g, b]| [r, g, b, 255].map(|v| f32::from(v) / 255.0))
        }
    };
    let has_alpha = has_alpha && pixels.par_iter().any(|p| p[3] < 1.0);
    Ok(StoredImage { image: Image { width, height, pixels }, has_alpha, is_deep })
}

fn stored<P: Sync>(pixels: &[P], convert: impl Fn(&P) -> [f32; 4] + Sync + Send) -> Vec<[f32; 4]> {
    pixels.par_iter().with_min_len(1 << 14).map(convert).collect()
}

/// Straight alpha in whole numbers up to `one`, as PNG has it.
fn premultiplied(p: [f32; 4], one: f32) -> [f32; 4] {
    let alpha = p[3] / one;
    [p[0] / one * alpha, p[1] / one * alpha, p[2] / one * alpha, alpha]
}

/// An NPY file whose header was read and found to have a shape that may be allocated.
struct Array<'a, R: Read> {
    path: &'a Path,
    file: NpyFile<R>,
    shape: Vec<u64>,
    size: (u32, u32),
}

impl<'a, R: Read> Array<'a, R> {
    fn open(path: &'a Path, file: R) -> Result<Self, ImageError> {
        let file = NpyFile::new(file).map_err(|cause| ImageError::Io { path: path.into(), cause })?;
        let shape = file.shape().to_vec();
        let size = match shape[..] {
            [height, width] | [height, width, _] => checked_size(path, width, height),
            _ => Ok((0, 0)),
        };
        let mut array = Array { path, file, shape, size: (0, 0) };
        let sound = matches!(array.shape[..], [_, _] | [_, _, 3 | 4]) && array.file.order() == npyz::Order::C;
        if !sound {
            return Err(array.wrong(IMAGE_ARRAYS));
        }
        array.size = size?;
        Ok(array)
    }

    /// The error that says what the file holds.
    fn wrong(&self, expected: &'static str) -> ImageError {
        let order = if self.file.order() == npyz::Order::C { "" } else { " in Fortran order" };
        let found = format!("{} of shape {:?}{order}", self.file.dtype().descr(), self.shape);
        ImageError::Shape { path: self.path.into(), found, expected }
    }

    /// Every number, float32 or float64, as `T`. Memory grows with what the file really holds.
    fn numbers<T: Send>(self, expected: &'static str, from_f32: fn(f32) -> T, from_f64: fn(f64) -> T) -> Result<Vec<T>, ImageError> {
        let (wrong, path) = (self.wrong(expected), self.path);
        let (kind, count) = (self.file.dtype().descr(), self.file.len());
        let width = if kind.ends_with("f8'") { 8 } else { 4 };
        let mut bytes = Vec::new();
        let read = self.file.into_inner().take(count * width).read_to_end(&mut bytes);
        read.map_err(|cause| ImageError::Io { path: path.into(), cause })?;
        let (singles, doubles) = (bytes.as_chunks::<4>().0.par_iter(), bytes.as_chunks::<8>().0.par_iter());
        let numbers: Vec<T> = match kind.as_str() {
            "'<f4'" => singles.map(|&b| from_f32(f32::from_le_bytes(b))).collect(),
            "'>f4'" => singles.map(|&b| from_f32(f32::from_be_bytes(b))).collect(),
            "'<f8'" => doubles.map(|&b| from_f64(f64::from_le_bytes(b))).collect(),
            "'>f8'" => doubles.map(|&b| from_f64(f64::from_be_bytes(b))).collect(),
            _ => return Err(wrong),
        };
        if (numbers.len() as u64) < count {
            return Err(ImageError::CutShort { path: path.into(), found: numbers.len() as u64, expected: count });
        }
        Ok(numbers)
    }

    fn colors(self, expected: &'static str) -> Result<Image, ImageError> {
        let ((width, height), opaque) = (self.size, self.shape[2] == 3);
        let numbers = self.numbers(expected, |v| v, |v| v as f32)?;
        let pixels =
            if opaque { stored(numbers.as_chunks::<3>().0, |&[r, g, b]| [r, g, b, 1.0]) } else { numbers.as_chunks::<4>().0.to_vec() };
        Ok(Image { width, height, pixels })
    }

    fn values(self) -> Result<PixelValues, ImageError> {
        let (width, height) = self.size;
        let values = self.numbers(IMAGE_ARRAYS, f64::from, |v| v)?;
        Ok(PixelValues { width, height, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn npy_comes_back_and_png_has_the_bytes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let image = Image { width: 2, height: 1, pixels: vec![[0.1, 0.2, 0.3, 0.4], [1.5, -1.0, 0.0, 1.0]] };
        let (npy, png) = (folder.path().join("a.npy"), folder.path().join("a.png"));
        write_npy(&npy, &image).expect("written");
        assert_eq!(read_npy(&npy).expect("read"), image);
        write_png(&png, &image, Background::Color([0.0; 3])).expect("written");
        let back = image::open(&png).expect("a PNG").into_rgb8();
        assert_eq!(back.as_raw()[..], image.to_bytes(Background::Color([0.0; 3]))[..]);
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 2, "no temporary file stays");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn links_are_followed_and_devices_stay_devices() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "old").expect("written");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        write_atomically(&link, |out| out.write_all(b"new")).expect("written");
        assert_eq!(std::fs::read_to_string(&file).expect("read"), "new");
        assert!(std::fs::symlink_metadata(&link).expect("a link").is_symlink());
        let device = folder.path().join("full");
        std::os::unix::fs::symlink("/dev/full", &device).expect("a link");
        assert!(write_atomically(&device, |out| out.write_all(b"new")).is_err(), "no space on that device");
        assert!(!std::fs::metadata("/dev/full").expect("the device").is_file());
    }

    #[test]
    fn a_wrong_npy_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("b.npy");
        write_values_npy(&path, &[2, 2], &[0f32; 4]).expect("written");
        let error = read_npy(&path).expect_err("a matrix is no image").to_string();
        assert!(error.contains("b.npy") && error.contains("[2, 2]"), "{error}");
    }
}
