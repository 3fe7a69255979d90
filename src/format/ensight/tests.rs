use super::*;
use crate::format::vtu::number::ByteOrder;
use crate::format::{Contents, FormatError, ReadOptions, read_contents};
use crate::mesh::CellType;
use std::path::Path;

/// A file in text or C binary.
struct Writer {
    order: Option<ByteOrder>,
    bytes: Vec<u8>,
}

impl Writer {
    fn new(order: Option<ByteOrder>) -> Self {
        Writer { order, bytes: vec![] }
    }

    fn line(&mut self, text: &str) -> &mut Self {
        let mut bytes = text.as_bytes().to_vec();
        if self.order.is_some() {
            bytes.resize(80, 0)
        } else {
            bytes.push(b'\n')
        }
        self.bytes.extend(bytes);
        self
    }

    fn integers(&mut self, numbers: &[i32]) -> &mut Self {
        for number in numbers {
            match self.order {
                None => self.bytes.extend(format!("{number:>10}\n").into_bytes()),
                Some(ByteOrder::Little) => self.bytes.extend(number.to_le_bytes()),
                Some(ByteOrder::Big) => self.bytes.extend(number.to_be_bytes()),
            }
        }
        self
    }

    fn reals(&mut self, numbers: &[f32]) -> &mut Self {
        for number in numbers {
            match self.order {
                None => self.bytes.extend(format!("{number:12.5e}\n").into_bytes()),
                Some(ByteOrder::Little) => self.bytes.extend(number.to_le_bytes()),
                Some(ByteOrder::Big) => self.bytes.extend(number.to_be_bytes()),
            }
        }
        self
    }
}

/// Two parts: a hexahedron with a wedge, and a tet as a polyhedron with one of its triangles, a ghost and ids in the file.
fn geometry(order: Option<ByteOrder>) -> Vec<u8> {
    let mut file = Writer::new(order);
    if order.is_some() {
        file.line("C Binary");
    }
    file.line("a test").line("").line("node id given").line("element id given").line("part").integers(&[1]).line("");
    file.line("coordinates").integers(&[10]).integers(&[90, 80, 70, 60, 50, 40, 30, 20, 10, 1]);
    file.reals(&[0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 2.0, 2.0]);
    file.reals(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0]);
    file.reals(&[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0]);
    file.line("hexa8").integers(&[1]).integers(&[77]).integers(&[1, 2, 3, 4, 5, 6, 7, 8]);
    file.line("penta6").integers(&[1]).integers(&[78]).integers(&[2, 9, 3, 6, 10, 7]);
    file.line("part").integers(&[256]).line("tet").line("coordinates").integers(&[4]).integers(&[1, 2, 3, 4]);
    file.reals(&[5.0, 6.0, 5.0, 5.0]).reals(&[0.0, 0.0, 1.0, 0.0]).reals(&[0.0, 0.0, 0.0, 1.0]);
    file.line("nfaced").integers(&[1]).integers(&[5]).integers(&[4]).integers(&[3, 3, 3, 3]);
    file.integers(&[1, 3, 2]).integers(&[1, 2, 4]).integers(&[2, 3, 4]).integers(&[3, 1, 4]);
    file.line("g_tria3").integers(&[1]).integers(&[6]).integers(&[1, 2, 3]);
    file.line("nsided").integers(&[1]).integers(&[6]).integers(&[3]).integers(&[1, 2, 3]);
    file.bytes
}

const CASE: &str = "# a test\nFORMAT\ntype:  ensight gold\n\nGEOMETRY\nmodel: 1 test.geo\nVARIABLE\nscalar per node: 1 p p.*** # pressure
vector per element: 1 v v.***\ntensor symm per element: t t.sym\nconstant per case: g 9.81\nTIME\ntime set: 1\nnumber of steps: 3
filename start number: 4\nfilename increment: 2\ntime values: 0.0 0.5\n1.5\n";

fn case(order: Option<ByteOrder>) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    let put = |name: &str, bytes: &[u8]| std::fs::write(root.path().join(name), bytes).expect("written");
    put("test.case", CASE.as_bytes());
    put("test.geo", &geometry(order));
    let mut p = Writer::new(order);
    p.line("p").line("part").integers(&[256]).line("coordinates undef").reals(&[-9.0, 1.0, -9.0, 3.0, 4.0]);
    p.line("part").integers(&[1]).line("coordinates partial").integers(&[2]).integers(&[2, 10]).reals(&[0.25, 0.5]);
    put("p.008", &p.bytes);
    let mut v = Writer::new(order);
    v.line("v").line("part").integers(&[1]).line("hexa8").reals(&[1.0, 2.0, 3.0]).line("penta6").reals(&[4.0, 5.0, 6.0]);
    v.line("part").integers(&[256]).line("nfaced").reals(&[7.0, 8.0, 9.0]).line("g_tria3").reals(&[0.0, 0.0, 0.0]);
    put("v.008", &v.bytes);
    let mut t = Writer::new(order);
    t.line("t").line("part").integers(&[1]).line("hexa8").reals(&[1.0, 2.0, 3.0, 12.0, 13.0, 23.0]);
    put("t.sym", &t.bytes);
    root
}

fn opened(path: &Path) -> Result<UnstructuredGrid, FormatError> {
    match read_contents(path, &ReadOptions::default(), &Progress::new())? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

fn values(arrays: &[DataArray], name: &str) -> Vec<f64> {
    let array = arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("{name}"));
    (0..array.values.len()).map(|i| array.values.get(i)).collect()
}

#[test]
fn text_and_binary_in_both_orders_give_the_same() {
    for order in [None, Some(ByteOrder::Little), Some(ByteOrder::Big)] {
        let grid = opened(&case(order).path().join("test.case")).unwrap_or_else(|error| panic!("{error}"));
        let cells: Vec<_> = grid.cells.iter().collect();
        assert_eq!(cells[0], (CellType::HEXAHEDRON, &[0, 1, 2, 3, 4, 5, 6, 7][..]));
        assert_eq!(cells[1], (CellType::WEDGE, &[1, 8, 2, 5, 9, 6][..]));
        let tet = &[4, 3, 10, 12, 11, 3, 10, 11, 13, 3, 11, 12, 13, 3, 12, 10, 13][..];
        assert_eq!(cells[2..], [(CellType::POLYHEDRON, tet), (CellType::POLYGON, &[10, 11, 12][..])]);
        assert_eq!((grid.points.len(), grid.points[8].to_array(), grid.points[13].to_array()), (14, [2.0, 0.0, 0.0], [5.0, 0.0, 1.0]));
        let p = values(&grid.point_data, "p");
        assert_eq!([p[1], p[9], p[10], p[12], p[13]], [0.25, 0.5, 1.0, 3.0, 4.0]);
        assert!([0, 2, 8, 11].iter().all(|&i| p[i].is_nan()), "{p:?}");
        let v = values(&grid.cell_data, "v");
        assert!(v[..9] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0] && v[9].is_nan(), "{v:?}");
        assert_eq!(values(&grid.cell_data, "t")[..6], [1.0, 2.0, 3.0, 12.0, 23.0, 13.0]);
        assert_eq!(values(&grid.cell_data, "part"), [1.0, 1.0, 256.0, 256.0]);
        assert_eq!(grid.active_scalars.as_deref(), Some("p"));
        let notes = ["the last of 3 times is shown, 1.5", "constant per case g was left out", "1 ghost cells (g_tria3) were left out"];
        assert_eq!(grid.notes, [&notes[..], &["parts in the array part: 1 , 256 tet"]].concat());
    }
}

#[test]
fn what_is_wrong_is_said() {
    let root = case(None);
    let path = root.path().join("test.case");
    let refused = |name: &str, from: &str, to: &str| {
        let file = root.path().join(name);
        let text = std::fs::read_to_string(&file).expect("there");
        assert!(text.contains(from), "{from}");
        std::fs::write(&file, text.replacen(from, to, 1)).expect("written");
        let said = opened(&path).expect_err(to).to_string();
        std::fs::write(&file, text).expect("written");
        said
    };
    assert!(refused("test.case", "ensight gold", "ensight").contains("is of EnSight 5 or 6"));
    assert!(refused("test.case", "test.geo", "../test.geo").contains("in the same folder or below"));
    assert!(refused("test.case", "p.***", "q").contains("its file q: "));
    assert!(refused("test.geo", "hexa8", "octa7").contains("\"octa7\", expected part, coordinates or a kind"));
    assert!(refused("test.geo", "node id given", "node id none").contains("\"node id none\""));
    assert!(refused("test.geo", "        77\n         1\n", "        77\n        11\n").contains("\"11\", expected a node from 1 to 10"));
    assert!(refused("v.008", "penta6", "penta7").contains("elements or coordinates that the part has"));
    assert!(refused("p.008", "256", "255").contains("the number of a part of the geometry"));
}

#[test]
fn damaged_files_are_refused_or_read() {
    for order in [None, Some(ByteOrder::Little), Some(ByteOrder::Big)] {
        let root = case(order);
        for name in ["test.geo", "p.008", "v.008", "test.case"] {
            let path = root.path().join(name);
            let sound = std::fs::read(&path).expect("there");
            for i in (0..sound.len()).step_by(3) {
                let mut changed = sound.clone();
                changed[i] = [b'9', 0xff, b'*', 0x7f][i / 3 % 4];
                for bytes in [&sound[..i], &changed] {
                    std::fs::write(&path, bytes).expect("written");
                    if let Ok(Contents::Cells(grid)) =
                        read_contents(&root.path().join("test.case"), &ReadOptions::default(), &Progress::new())
                    {
                        assert!(grid.cells.len() <= 4, "{name} {i}");
                    }
                }
            }
            std::fs::write(&path, &sound).expect("written");
        }
    }
}
