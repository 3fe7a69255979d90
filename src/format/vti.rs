//! VTK's XML format for image data, `.vti`, in every encoding that [`super::vtu`] knows.
//!
//! The rules where the format leaves a choice: pieces are put where their extents say, later ones over earlier ones; arrays over cells become a
//! volume of the cells' centres. Text and bit arrays and field data are not read.

use super::GridFile;
use super::voxel_data::{VolumeError, dims, grid};
use super::vtu::data::ArrayReader;
use super::vtu::number::ScalarType;
use super::vtu::xml::{self, Array, Head, ImageFrame, Kind, Piece, Section};
use super::vtu::{ArrayError, VtuError};
use crate::progress::Progress;
use crate::volume::{Grid, GridFrame, Samples};
use glam::{DMat3, DVec3};

/// Whether a file starts as VTK's image data do.
pub(super) fn recognizes(start: &[u8]) -> bool {
    super::vtu::is_of_type(start, "ImageData")
}

/// What an array belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    Points,
    Cells,
}

impl Of {
    fn section(self, piece: &Piece) -> &Section {
        match self {
            Of::Points => &piece.point_data,
            Of::Cells => &piece.cell_data,
        }
    }

    /// First and last value along each axis.
    fn extent(self, [x0, x1, y0, y1, z0, z1]: [i64; 6]) -> [[i64; 2]; 3] {
        let less = i64::from(self == Of::Cells);
        [[x0, x1 - less], [y0, y1 - less], [z0, z1 - less]]
    }
}

/// Reads a file.
pub(super) fn read(file: &GridFile<'_>, progress: &Progress) -> Result<Grid, VolumeError> {
    let head = xml::read_head(file.source, Kind::ImageData)?;
    let image = head.image.ok_or_else(|| VtuError::NotVti("it has no extent".into()))?;
    let (of, array) = choose(&head, file.options.array.as_deref())?;
    let whole = of.extent(image.extent);
    let frame = frame(&image, of)?;
    frame.validate()?;
    let components = array.components.unwrap_or(1).max(1);
    let numbers = frame.points().checked_mul(components).filter(|&n| n < 1 << 56);
    let too_large = || array_error(of, array, ArrayError::TooLarge { items: frame.points(), numbers: components });
    let numbers = numbers.ok_or_else(too_large)?;
    file.check_memory(numbers * array.scalar.size() as u64, format!("{} voxels", frame.points()))?;
    progress.begin("reading", file.source.len());

    let reader = ArrayReader { source: file.source, head: &head, progress };
    let mut parts: Vec<([[i64; 2]; 3], Samples)> = Vec::new();
    for piece in &head.pieces {
        let extent = of.extent(piece.extent);
        let Some(count) = count(&extent) else { continue };
        if !(0..3).all(|a| whole[a][0] <= extent[a][0] && extent[a][1] <= whole[a][1]) {
            let text = format!("{:?}", piece.extent);
            return Err(VolumeError::key("Extent of a piece", &text, format!("an extent within WholeExtent, {:?}", image.extent)));
        }
        let found = of.section(piece).arrays.iter().find(|other| other.name == array.name && other.scalar == array.scalar);
        let found = found.filter(|other| other.components.unwrap_or(1).max(1) == components);
        let found =
            found.ok_or_else(|| VolumeError::NoArray(Some(format!(": a piece has no array \"{}\" like the others'", array.name))))?;
        let items = count.checked_mul(components).ok_or_else(too_large)?;
        parts.push((extent, read_array(&reader, found, items).map_err(|reason| array_error(of, array, reason))?));
    }
    let samples = match parts.len() {
        1 if parts[0].0 == whole => parts.remove(0).1,
        _ => assemble(&parts, &whole, array.scalar, components as usize)?,
    };
    grid(file, frame, &array.name, samples, 1, components as usize)
}

/// The array of a name; without one the active scalars, else the first with one component, else the first, points before cells.
fn choose<'h>(head: &'h Head, name: Option<&str>) -> Result<(Of, &'h Array), VolumeError> {
    let first = head.pieces.first().ok_or(VolumeError::NoArray(Some(", nor a piece".into())))?;
    let all: Vec<(Of, &Array)> =
        [Of::Points, Of::Cells].into_iter().flat_map(|of| of.section(first).arrays.iter().map(move |array| (of, array))).collect();
    let by_name = |name: &str| all.iter().find(|(_, array)| array.name == name).copied();
    let active = || [Of::Points, Of::Cells].into_iter().find_map(|of| by_name(of.section(first).scalars.as_deref()?));
    let scalar = || all.iter().find(|(_, array)| array.components.unwrap_or(1) == 1).copied();
    let found = match name {
        Some(name) => by_name(name),
        None => active().or_else(scalar).or_else(|| all.first().copied()),
    };
    found.ok_or_else(|| {
        let names = all.iter().map(|(_, array)| format!("\"{}\"", array.name)).collect::<Vec<_>>().join(", ");
        VolumeError::NoArray(
            name.map(|name| format!(" named \"{name}\"; the volume has {}", if names.is_empty() { "none" } else { &names })),
        )
    })
}

/// Where the values lie: at the points, or in the middle of the cells.
fn frame(image: &ImageFrame, of: Of) -> Result<GridFrame, VolumeError> {
    let whole = of.extent(image.extent);
    let dims = dims("WholeExtent", whole.map(|[first, last]| (last - first + 1).max(0) as u64))?;
    let steps = DMat3::from_cols_array(&image.direction).transpose() * DMat3::from_diagonal(DVec3::from_array(image.spacing));
    let first = DVec3::from_array(whole.map(|[first, _]| first as f64)) + if of == Of::Cells { 0.5 } else { 0.0 };
    Ok(GridFrame { dims, origin: DVec3::from_array(image.origin) + steps * first, steps })
}

/// How many values an extent has; `None` for none.
fn count(extent: &[[i64; 2]; 3]) -> Option<u64> {
    let along = extent.map(|[first, last]| u64::try_from(last - first + 1).unwrap_or(0));
    along.iter().try_fold(1u64, |product, &n| product.checked_mul(n)).filter(|&n| n > 0)
}

fn array_error(of: Of, array: &Array, reason: ArrayError) -> VolumeError {
    let of = if of == Of::Points { "point" } else { "cell" };
    VolumeError::Array { array: format!("{of} array \"{}\"", array.name), reason }
}

fn read_array(reader: &ArrayReader<'_>, array: &Array, items: u64) -> Result<Samples, ArrayError> {
    macro_rules! of {
        ($samples:ident) => {{
            let mut out = Vec::new();
            reader.append(array, items, &mut out)?;
            Samples::$samples(out.into())
        }};
    }
    Ok(match array.scalar {
        ScalarType::UInt8 => of!(U8),
        ScalarType::Int8 => of!(I8),
        ScalarType::UInt16 => of!(U16),
        ScalarType::Int16 => of!(I16),
        ScalarType::UInt32 => of!(U32),
        ScalarType::Int32 => of!(I32),
        ScalarType::Float32 => of!(F32),
        ScalarType::UInt64 | ScalarType::Int64 | ScalarType::Float64 => of!(F64),
    })
}

/// Puts pieces together. They must fill the whole, which bounds what is allocated by what was read.
fn assemble(parts: &[([[i64; 2]; 3], Samples)], whole: &[[i64; 2]; 3], scalar: ScalarType, width: usize) -> Result<Samples, VolumeError> {
    let size = whole.map(|[first, last]| (last - first + 1) as usize);
    let (points, read) = (size.iter().product::<usize>(), parts.iter().map(|(_, samples)| samples.len() / width).sum::<usize>());
    let holes = || VolumeError::key("Extent of the pieces", "leaving values out", "pieces that fill WholeExtent");
    if read < points {
        return Err(holes());
    }
    let mut filled = vec![false; points];
    macro_rules! of {
        ($samples:ident) => {{
            let mut out = vec![Default::default(); points * width];
            for (extent, samples) in parts {
                if let Samples::$samples(values) = samples {
                    place(&mut out, &mut filled, values, extent, whole, width);
                }
            }
            Samples::$samples(out.into())
        }};
    }
    let all = match scalar {
        ScalarType::UInt8 => of!(U8),
        ScalarType::Int8 => of!(I8),
        ScalarType::UInt16 => of!(U16),
        ScalarType::Int16 => of!(I16),
        ScalarType::UInt32 => of!(U32),
        ScalarType::Int32 => of!(I32),
        ScalarType::Float32 => of!(F32),
        ScalarType::UInt64 | ScalarType::Int64 | ScalarType::Float64 => of!(F64),
    };
    if filled.contains(&false) { Err(holes()) } else { Ok(all) }
}

/// Copies a piece to its place, row by row.
fn place<T: Copy>(out: &mut [T], filled: &mut [bool], values: &[T], extent: &[[i64; 2]; 3], whole: &[[i64; 2]; 3], width: usize) {
    let size = whole.map(|[first, last]| (last - first + 1) as usize);
    let along = extent.map(|[first, last]| (last - first + 1) as usize);
    let low: [usize; 3] = std::array::from_fn(|a| (extent[a][0] - whole[a][0]) as usize);
    for (row, values) in values.chunks_exact(along[0] * width).enumerate() {
        let at = low[0] + size[0] * (low[1] + row % along[1] + size[1] * (low[2] + row / along[1]));
        out[at * width..][..values.len()].copy_from_slice(values);
        filled[at..at + along[0]].fill(true);
    }
}
