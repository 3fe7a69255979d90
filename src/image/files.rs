//! PNG and NPY files. Every file is written under a temporary name and renamed, so that an interrupted run leaves the old file whole.

use super::{Background, Image};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use npyz::WriterBuilder;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

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
    #[error("{}: {found}, expected float32 of shape (height, width, 4)", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// What it holds.
        found: String,
    },
    /// The PNG encoder failed.
    #[error("{}: {cause}", path.display())]
    Png {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
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
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&image.to_bytes(background), image.width, image.height, color)
        .map_err(|cause| ImageError::Png { path: path.into(), cause })?;
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
    let io = |cause| ImageError::Io { path: path.into(), cause };
    let file = io::BufReader::new(std::fs::File::open(path).map_err(io)?);
    let npy = npyz::NpyFile::new(file).map_err(io)?;
    let shape = npy.shape().to_vec();
    let found = format!("{} of shape {shape:?}", npy.dtype().descr());
    let wrong = || ImageError::Shape { path: path.into(), found };
    let (height, width) = match shape[..] {
        [h, w, 4] if npy.order() == npyz::Order::C && h <= 1 << 16 && w <= 1 << 16 => (h as u32, w as u32),
        _ => return Err(wrong()),
    };
    let values: Vec<f32> = match npy.data::<f32>() {
        Ok(data) => data.collect::<io::Result<_>>().map_err(io)?,
        Err(_) => return Err(wrong()),
    };
    Ok(Image { width, height, pixels: values.as_chunks::<4>().0.to_vec() })
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
