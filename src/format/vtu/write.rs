//! Writing `.vtu`: appended raw data, little-endian, UInt64 headers, version 1.0 (what ParaView writes), optionally zlib in blocks.
//!
//! ```text
//! <VTKFile ..> .. <DataArray type=".." Name=".." format="appended" offset="N"/> .. <AppendedData encoding="raw">
//! _[bytes][data][bytes][data] ..                                                  uncompressed: N counts from behind the "_"
//! _[blocks][block bytes][last block bytes or 0][compressed bytes of each][block][block] ..                              zlib
//! </AppendedData></VTKFile>
//! ```
//!
//! Uncompressed, the size of every array is known before its data, so that a mesh of any size streams through the memory of one layer.

use crate::image::write_atomically;
use crate::mesh::{LayeredMesh, Precision, Values};
use crate::progress::{Cancelled, Progress};
use quick_xml::escape::escape;
use rayon::prelude::*;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// How a file's arrays are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// As they are. Streams: the memory needed is that of one layer.
    #[default]
    None,
    /// zlib blocks. The compressed file is gathered in memory before it is written, and one array at a time beside it.
    Zlib,
}

/// Why a mesh could not be written. The file that was there, if any, is as it was.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system said no.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Writes a mesh layer by layer; a [`TetMesh`](crate::mesh::TetMesh) is one too. Progress counts the uncompressed bytes.
pub fn write_mesh(path: &Path, mesh: &dyn LayeredMesh, compression: Compression, progress: &Progress) -> Result<(), WriteError> {
    let mut arrays = arrays(mesh);
    progress.begin("writing", arrays.iter().map(|a| a.bytes).sum());
    let written = match compression {
        Compression::None => write_atomically(path, |out| {
            place(&mut arrays, |array| 8 + array.bytes);
            out.write_all(head(mesh, &arrays, "").as_bytes())?;
            for array in &arrays {
                out.write_all(&array.bytes.to_le_bytes())?;
                array.for_each_chunk(mesh, progress, |chunk| out.write_all(chunk))?;
            }
            out.write_all(TAIL)
        }),
        Compression::Zlib => write_atomically(path, |out| {
            let blocks: Vec<Vec<u8>> = arrays.iter().map(|array| compress(array, mesh, progress)).collect::<io::Result<_>>()?;
            let mut sizes = blocks.iter().map(|b| b.len() as u64);
            place(&mut arrays, |_| sizes.next().unwrap_or(0));
            out.write_all(head(mesh, &arrays, " compressor=\"vtkZLibDataCompressor\"").as_bytes())?;
            blocks.iter().try_for_each(|b| out.write_all(b))?;
            out.write_all(TAIL)
        }),
    };
    finished(path, written)
}

/// The outcome of writing a file, with its name.
pub(in crate::format) fn finished(path: &Path, written: io::Result<()>) -> Result<(), WriteError> {
    written.map_err(|source| match source.downcast::<Cancelled>() {
        Ok(cancelled) => cancelled.into(),
        Err(cause) => WriteError::Io { path: path.into(), cause },
    })
}

/// What stands behind the data.
pub(super) const TAIL: &[u8] = b"\n  </AppendedData>\n</VTKFile>\n";

/// VTK's number of a linear tetrahedron.
const VTK_TETRA: u8 = 10;

/// Tets per chunk of the arrays that need no mesh to be filled.
const CHUNK_TETS: u64 = 1 << 16;

/// Bytes that are compressed together.
const BLOCK_BYTES: usize = 1 << 18;

/// What an array of the file is filled from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    PointArray(usize),
    CellArray(usize),
    Points,
    Connectivity(Integer),
    Offsets(Integer),
    Types,
}

/// The width of indices: 32 bits where all of them fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Integer {
    Int32,
    Int64,
}

impl Integer {
    fn name_and_bytes(self) -> (&'static str, u64) {
        match self {
            Integer::Int32 => ("Int32", 4),
            Integer::Int64 => ("Int64", 8),
        }
    }

    /// Appends numbers that fit, little-endian.
    fn extend(self, bytes: &mut Vec<u8>, numbers: impl Iterator<Item = u64>) {
        match self {
            Integer::Int32 => bytes.extend(numbers.flat_map(|n| (n as u32).to_le_bytes())),
            Integer::Int64 => bytes.extend(numbers.flat_map(u64::to_le_bytes)),
        }
    }
}

/// One array of the file.
#[derive(Debug)]
struct FileArray {
    content: Content,
    name: String,
    vtk_type: &'static str,
    components: usize,
    /// Size of its data, uncompressed and without header.
    bytes: u64,
    /// Where its header begins, counted from behind the underscore; set by [`place`].
    offset: u64,
}

/// All arrays in the order of the file, not placed yet.
fn arrays(mesh: &dyn LayeredMesh) -> Vec<FileArray> {
    let (points, tets) = (mesh.point_count(), mesh.tet_count());
    let integer = if points.max(4 * tets) <= i32::MAX as u64 { Integer::Int32 } else { Integer::Int64 };
    let (integer_type, integer_bytes) = integer.name_and_bytes();
    let new = |content, name: &str, vtk_type, components: usize, bytes| FileArray {
        content,
        name: name.to_owned(),
        vtk_type,
        components,
        bytes,
        offset: 0,
    };
    let float = |content, name: &str, precision: Precision, components: usize, tuples: u64| {
        let vtk_type = if precision == Precision::F32 { "Float32" } else { "Float64" };
        new(content, name, vtk_type, components, tuples * components as u64 * precision.bytes())
    };
    let mut all = Vec::new();
    for (i, a) in mesh.point_arrays().into_iter().enumerate() {
        all.push(float(Content::PointArray(i), &a.name, a.precision, a.components, points));
    }
    for (i, a) in mesh.cell_arrays().into_iter().enumerate() {
        all.push(float(Content::CellArray(i), &a.name, a.precision, a.components, tets));
    }
    all.push(float(Content::Points, "Points", mesh.position_precision(), 3, points));
    all.push(new(Content::Connectivity(integer), "connectivity", integer_type, 1, 4 * tets * integer_bytes));
    all.push(new(Content::Offsets(integer), "offsets", integer_type, 1, tets * integer_bytes));
    all.push(new(Content::Types, "types", "UInt8", 1, tets));
    all
}

/// Sets every array's offset from the stored sizes, headers included.
fn place(arrays: &mut [FileArray], mut stored_bytes: impl FnMut(&FileArray) -> u64) {
    let mut end = 0;
    for array in arrays {
        array.offset = end;
        end += stored_bytes(array);
    }
}

/// The XML up to and with the underscore before the data.
fn head(mesh: &dyn LayeredMesh, arrays: &[FileArray], compressor: &str) -> String {
    let mut xml = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"\
         {compressor}>\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        mesh.point_count(),
        mesh.tet_count()
    );
    let mut element = |name: &str, contains: &dyn Fn(Content) -> bool| {
        let own: Vec<&FileArray> = arrays.iter().filter(|a| contains(a.content)).collect();
        let active = mesh.active_scalars().filter(|&active| name.ends_with("Data") && own.iter().any(|a| a.name == active));
        let scalars = active.map(|active| format!(" Scalars=\"{}\"", escape(active))).unwrap_or_default();
        let _ = writeln!(xml, "      <{name}{scalars}>");
        for a in own {
            let (vtk_type, array, components, offset) = (a.vtk_type, escape(&a.name), a.components, a.offset);
            let _ = writeln!(
                xml,
                "        <DataArray type=\"{vtk_type}\" Name=\"{array}\" NumberOfComponents=\"{components}\" format=\"appended\" \
                 offset=\"{offset}\"/>"
            );
        }
        let _ = writeln!(xml, "      </{name}>");
    };
    element("PointData", &|c| matches!(c, Content::PointArray(_)));
    element("CellData", &|c| matches!(c, Content::CellArray(_)));
    element("Points", &|c| c == Content::Points);
    element("Cells", &|c| matches!(c, Content::Connectivity(_) | Content::Offsets(_) | Content::Types));
    xml + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _"
}

impl FileArray {
    /// Hands the array's data on, chunk by chunk, `bytes` in all.
    fn for_each_chunk(&self, mesh: &dyn LayeredMesh, progress: &Progress, mut sink: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let chunks = match self.content {
            Content::Offsets(_) | Content::Types => mesh.tet_count().div_ceil(CHUNK_TETS) as usize,
            _ => mesh.layer_count(),
        };
        let mut sum = 0;
        let mut bytes = Vec::new();
        for chunk in 0..chunks {
            progress.check().map_err(io::Error::other)?;
            bytes.clear();
            self.fill_chunk(mesh, chunk, &mut bytes);
            sink(&bytes)?;
            progress.add(bytes.len() as u64);
            sum += bytes.len() as u64;
        }
        assert_eq!(sum, self.bytes, "the layers of array \"{}\" have as many numbers as the mesh said", self.name);
        Ok(())
    }

    fn fill_chunk(&self, mesh: &dyn LayeredMesh, chunk: usize, bytes: &mut Vec<u8>) {
        let tets_of_chunk = || (chunk as u64 * CHUNK_TETS)..((chunk as u64 + 1) * CHUNK_TETS).min(mesh.tet_count());
        match self.content {
            Content::PointArray(array) => extend_values(bytes, &mesh.point_values(array, chunk)),
            Content::CellArray(array) => extend_values(bytes, &mesh.cell_values(array, chunk)),
            Content::Points if mesh.position_precision() == Precision::F32 => {
                bytes.extend(mesh.points(chunk).iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes));
            }
            Content::Points => bytes.extend(mesh.points(chunk).iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes)),
            Content::Connectivity(integer) => integer.extend(bytes, mesh.tets(chunk).as_flattened().iter().map(|&i| u64::from(i))),
            Content::Offsets(integer) => integer.extend(bytes, tets_of_chunk().map(|tet| 4 * (tet + 1))),
            Content::Types => bytes.extend(tets_of_chunk().map(|_| VTK_TETRA)),
        }
    }
}

fn extend_values(bytes: &mut Vec<u8>, values: &Values) {
    match values {
        Values::F32(values) => bytes.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Values::F64(values) => bytes.extend(values.iter().flat_map(|v| v.to_le_bytes())),
    }
}

/// An array as it stands in the file: the table of blocks, then the blocks.
fn compress(array: &FileArray, mesh: &dyn LayeredMesh, progress: &Progress) -> io::Result<Vec<u8>> {
    let mut raw = Vec::with_capacity(array.bytes as usize);
    array.for_each_chunk(mesh, progress, |chunk| {
        raw.extend_from_slice(chunk);
        Ok(())
    })?;
    zlib_blocks(&raw)
}

/// Bytes in compressed blocks behind their table.
pub(super) fn zlib_blocks(raw: &[u8]) -> io::Result<Vec<u8>> {
    let deflate = |block: &[u8]| {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(block)?;
        encoder.finish()
    };
    let blocks: Vec<Vec<u8>> = raw.par_chunks(BLOCK_BYTES).map(deflate).collect::<io::Result<_>>()?;
    let table = [blocks.len(), BLOCK_BYTES, raw.len() % BLOCK_BYTES].into_iter().chain(blocks.iter().map(Vec::len));
    let mut stored: Vec<u8> = table.flat_map(|word| (word as u64).to_le_bytes()).collect();
    stored.extend(blocks.iter().flatten());
    Ok(stored)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{self, Shape};
    use crate::mesh::{DataArray, MeshParts, TetMesh, collect};
    use glam::DVec3;
    use std::io::Read;

    /// A tet with a point array in f64, a cell array in f32 that is active, and a name that XML must escape.
    fn one_tet() -> TetMesh {
        let points = vec![DVec3::new(1e6, 0.0, 0.0), DVec3::new(1e6 + 1.0, 0.0, 0.0), DVec3::Y * 1e-3, DVec3::Z];
        let array = |name: &str, components, values| DataArray { name: name.into(), components, values };
        let point_data = vec![array("a<b & \"c\"", 2, Values::F64((0..8).map(f64::from).collect()))];
        let cell_data = vec![array("c", 1, Values::F32(vec![7.5]))];
        let active_scalars = Some("c".into());
        TetMesh::new(MeshParts { points, tets: vec![[0, 1, 2, 3]], point_data, cell_data, active_scalars, ..Default::default() })
            .expect("valid")
    }

    fn written(mesh: &dyn LayeredMesh, compression: Compression) -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("mesh.vtu");
        write_mesh(&path, mesh, compression, &Progress::new()).expect("written");
        std::fs::read(&path).expect("read")
    }

    /// A file's head, and its arrays by name, decoded by the layout pictured on top.
    fn decoded(file: &[u8]) -> (String, Vec<(String, Vec<u8>)>) {
        let mark = b"<AppendedData encoding=\"raw\">\n   _";
        let data = file.windows(mark.len()).position(|w| w == mark).expect("appended data") + mark.len();
        let head = String::from_utf8(file[..data].to_vec()).expect("UTF-8");
        let word = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().expect("8 bytes")) as usize;
        let attribute = |line: &str, name: &str| {
            let value = line.split_once(&format!(" {name}=\"")).expect("the attribute").1;
            value.split_once('"').expect("its end").0.to_owned()
        };
        let array = |line: &str| {
            let at = data + attribute(line, "offset").parse::<usize>().expect("a number");
            let mut bytes = Vec::new();
            if head.contains("compressor") {
                let mut block = at + 8 * (3 + word(at));
                for i in 0..word(at) {
                    let size = word(at + 8 * (3 + i));
                    flate2::read::ZlibDecoder::new(&file[block..block + size]).read_to_end(&mut bytes).expect("zlib");
                    block += size;
                }
                let last = if word(at + 16) == 0 { word(at + 8) } else { word(at + 16) };
                assert_eq!(bytes.len(), (word(at) - 1) * word(at + 8) + last);
            } else {
                bytes.extend_from_slice(&file[at + 8..at + 8 + word(at)]);
            }
            (attribute(line, "Name"), bytes)
        };
        let arrays = head.lines().filter(|l| l.contains("<DataArray")).map(array).collect();
        (head, arrays)
    }

    #[test]
    fn every_array_lies_where_the_head_says() {
        let (head, arrays) = decoded(&written(&one_tet(), Compression::None));
        assert!(head.contains("<CellData Scalars=\"c\">") && head.contains("<PointData>"), "{head}");
        let f64s = |v: &[f64]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let i32s = |v: &[i32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let positions = [1e6, 0.0, 0.0, 1e6 + 1.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1.0];
        let mesh = one_tet();
        let expected = [
            ("a&lt;b &amp; &quot;c&quot;", f64s(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])),
            ("c", 7.5f32.to_le_bytes().to_vec()),
            ("Points", f64s(&positions)),
            ("connectivity", i32s(&mesh.tets()[0].map(|i| i as i32))),
            ("offsets", i32s(&[4])),
            ("types", vec![10]),
        ];
        for ((name, bytes), (expected_name, expected_bytes)) in arrays.iter().zip(&expected) {
            assert_eq!((name.as_str(), bytes), (*expected_name, expected_bytes));
        }
        assert_eq!(arrays.len(), expected.len());
    }

    #[test]
    fn compressed_or_not_streamed_or_not_the_arrays_are_the_same() {
        let layered = generate::plan(Shape::Ball, None).expect("the default size");
        let streamed = decoded(&written(&*layered, Compression::None)).1;
        assert_eq!(streamed, decoded(&written(&*layered, Compression::Zlib)).1);
        let mut in_memory = decoded(&written(&collect(&*layered).expect("valid"), Compression::Zlib)).1;
        let points = in_memory.iter_mut().find(|(name, _)| name == "Points").expect("points");
        points.1 = points.1.as_chunks().0.iter().flat_map(|&b| (f64::from_le_bytes(b) as f32).to_le_bytes()).collect();
        assert_eq!(streamed, in_memory);
    }

    #[test]
    fn the_bundled_meshes_are_what_their_recipes_make() {
        for shape in Shape::ALL {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(shape.name()).with_extension("vtu");
            let bundled = std::fs::read(&path).expect("a bundled mesh");
            assert!(bundled.len() < 3 << 20);
            let layered = generate::plan(shape, None).expect("the default size");
            let (found, made) = (decoded(&bundled).1, decoded(&written(&*layered, Compression::Zlib)).1);
            assert_eq!(found.len(), made.len());
            for ((name, found), (made_name, made)) in found.into_iter().zip(made) {
                assert_eq!((&name, found.len()), (&made_name, made.len()), "{shape:?}");
                if ["connectivity", "offsets", "types"].contains(&name.as_str()) {
                    assert!(found == made, "{shape:?} {name}");
                    continue;
                }
                // Mathematical libraries differ in the last digit.
                for (&a, &b) in found.as_chunks().0.iter().zip(made.as_chunks().0) {
                    let (a, b) = (f32::from_le_bytes(a), f32::from_le_bytes(b));
                    assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()), "{shape:?} {name}: {a} {b}");
                }
            }
        }
        let wing = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/wing.vtu")).expect("the wing");
        assert!(generate::WING_VTU == wing, "the one that is embedded");
    }

    #[test]
    fn cancelling_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("mesh.vtu");
        std::fs::write(&path, "old").expect("written");
        let progress = Progress::new();
        progress.cancel();
        for compression in [Compression::None, Compression::Zlib] {
            let result = write_mesh(&path, &one_tet(), compression, &progress);
            assert!(matches!(result, Err(WriteError::Cancelled(_))));
        }
        assert_eq!(std::fs::read(&path).expect("read"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
        let missing = folder.path().join("no/mesh.vtu");
        let error = write_mesh(&missing, &one_tet(), Compression::None, &Progress::new()).expect_err("no such folder");
        assert!(error.to_string().contains("mesh.vtu"), "{error}");
    }
}
