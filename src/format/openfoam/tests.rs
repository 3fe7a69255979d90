use super::*;
use crate::format::series::Series;
use crate::format::vtu::number::ByteOrder;
use crate::format::{Contents, FormatError, ReadOptions, read_contents};
use crate::mesh::CellType;
use glam::{DVec3, dvec3};
use std::collections::HashMap;
use std::io::Write;

/// How a case is written.
#[derive(Clone, Copy, PartialEq)]
enum Style {
    Text,
    /// Binary with so many bytes a label and a scalar, and whether the header says it.
    Binary(usize, usize, ByteOrder, bool),
}

const BINARY: Style = Style::Binary(4, 8, ByteOrder::Little, true);

/// A hexahedron, a wedge beside it, a pyramid on it, a tet on that, and below a pyramid with one side in three.
fn points() -> Vec<DVec3> {
    let mut points: Vec<DVec3> = (0..8).map(|i| dvec3(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
    points.extend([dvec3(2.0, 0.0, 0.0), dvec3(2.0, 0.0, 1.0), dvec3(0.5, 0.5, 2.0), dvec3(1.5, 0.5, 2.0)]);
    points.extend([dvec3(0.5, 0.5, -1.0), dvec3(0.5, 0.125, -0.25)]);
    points
}

const TYPES: [CellType; 5] = [CellType::HEXAHEDRON, CellType::WEDGE, CellType::PYRAMID, CellType::TETRA, CellType::POLYHEDRON];
#[rustfmt::skip]
const CELLS: [&[&[u32]]; 5] = [
    &[&[0, 1, 3, 2], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 3, 7, 6], &[0, 2, 6, 4], &[1, 3, 7, 5]],
    &[&[1, 3, 8], &[5, 7, 9], &[1, 3, 7, 5], &[1, 8, 9, 5], &[3, 8, 9, 7]],
    &[&[4, 5, 7, 6], &[4, 5, 10], &[5, 7, 10], &[7, 6, 10], &[6, 4, 10]],
    &[&[5, 7, 10], &[5, 7, 11], &[7, 10, 11], &[10, 5, 11]],
    &[&[0, 1, 3, 2], &[1, 3, 12], &[3, 2, 12], &[2, 0, 12], &[0, 1, 13], &[1, 12, 13], &[12, 0, 13]],
];

/// The bytes of a file: its class, whether there are only labels in it, and its lists.
struct Writer {
    style: Style,
    bytes: Vec<u8>,
}

impl Writer {
    fn new(style: Style, class: &str) -> Self {
        let format = if style == Style::Text { "ascii" } else { "binary" };
        let arch = match style {
            Style::Binary(label, scalar, order, true) => {
                let order = if order == ByteOrder::Big { "MSB" } else { "LSB" };
                format!("    arch \"{order};label={};scalar={}\";\n", label * 8, scalar * 8)
            }
            _ => String::new(),
        };
        let text = format!(
            "/*---- * / ----*\\\n FoamFile of a test \\*---*/\nFoamFile\n{{\n    version 2.0;\n    format {format};\n{arch}    class {class};\n    note \"a; }}\";\n}}\n// * * //\n\n"
        );
        Writer { style, bytes: text.into_bytes() }
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.bytes.extend_from_slice(text.as_bytes());
        self
    }

    fn labels(&mut self, labels: &[i64]) -> &mut Self {
        self.text(&format!("{}\n(", labels.len()));
        for label in labels {
            match self.style {
                Style::Text => _ = self.text(&format!("{label}\n")),
                Style::Binary(4, _, ByteOrder::Little, _) => self.bytes.extend((*label as i32).to_le_bytes()),
                Style::Binary(4, _, ByteOrder::Big, _) => self.bytes.extend((*label as i32).to_be_bytes()),
                Style::Binary(_, _, ByteOrder::Little, _) => self.bytes.extend(label.to_le_bytes()),
                Style::Binary(_, _, ByteOrder::Big, _) => self.bytes.extend(label.to_be_bytes()),
            }
        }
        self.text(")\n")
    }

    fn tuples(&mut self, components: usize, values: &[f64]) -> &mut Self {
        self.text(&format!("{}\n(", values.len() / components));
        for tuple in values.chunks(components) {
            let text: Vec<String> = tuple.iter().map(f64::to_string).collect();
            match self.style {
                Style::Text if components == 1 => _ = self.text(&format!("{}\n", text[0])),
                Style::Text => _ = self.text(&format!("({}) // of {components}\n", text.join(" "))),
                Style::Binary(_, 4, ByteOrder::Little, _) => tuple.iter().for_each(|&v| self.bytes.extend((v as f32).to_le_bytes())),
                Style::Binary(_, 4, ByteOrder::Big, _) => tuple.iter().for_each(|&v| self.bytes.extend((v as f32).to_be_bytes())),
                Style::Binary(_, _, ByteOrder::Little, _) => tuple.iter().for_each(|&v| self.bytes.extend(v.to_le_bytes())),
                Style::Binary(_, _, ByteOrder::Big, _) => tuple.iter().for_each(|&v| self.bytes.extend(v.to_be_bytes())),
            }
        }
        self.text(")\n")
    }

    fn field(style: Style, class: &str, (list, components): (&str, usize), values: &[f64]) -> Vec<u8> {
        let mut writer = Writer::new(style, class);
        writer.text(&format!("dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<{list}>\n")).tuples(components, values);
        writer.text(";\nboundaryField\n{\n    \"wall.*\" { type zeroGradient; }\n}\n").bytes.clone()
    }
}

fn put(path: PathBuf, bytes: &[u8]) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    std::fs::write(path, bytes).expect("written");
}

/// Writes the mesh of some of the cells, and returns the numbers of its points.
fn write_mesh(folder: &Path, style: Style, chosen: &[usize]) -> Vec<u32> {
    let all = points();
    let mut used: Vec<u32> = chosen.iter().flat_map(|&c| CELLS[c].iter().flat_map(|face| face.iter().copied())).collect();
    used.sort_unstable();
    used.dedup();
    let own = |point: u32| used.binary_search(&point).expect("used") as i64;
    let (mut faces, mut owner, mut neighbour, mut known) = (Vec::<Vec<i64>>::new(), Vec::new(), Vec::<i64>::new(), HashMap::new());
    for (number, &cell) in chosen.iter().enumerate() {
        let mut corners: Vec<u32> = CELLS[cell].concat();
        corners.sort_unstable();
        corners.dedup();
        let centre = corners.iter().map(|&c| all[c as usize]).sum::<DVec3>() / corners.len() as f64;
        for face in CELLS[cell] {
            let mut key = face.to_vec();
            key.sort_unstable();
            if let Some(&shared) = known.get(&key) {
                neighbour[shared] = number as i64;
                continue;
            }
            known.insert(key, faces.len());
            let [a, b, c] = [0, 1, 2].map(|i| all[face[i] as usize]);
            let leaves = (b - a).cross(c - a).dot(a - centre) > 0.0;
            let round: Vec<u32> = if leaves { face.to_vec() } else { face.iter().rev().copied().collect() };
            faces.push(round.into_iter().map(own).collect());
            owner.push(number as i64);
            neighbour.push(-1);
        }
    }
    let mesh = folder.join("constant/polyMesh");
    let coordinates: Vec<f64> = used.iter().flat_map(|&point| all[point as usize].to_array()).collect();
    put(mesh.join("points"), &Writer::new(style, "vectorField").tuples(3, &coordinates).bytes);
    let mut file = Writer::new(style, if style == Style::Text { "faceList" } else { "faceCompactList" });
    if style == Style::Text {
        file.text(&format!("{}\n(\n", faces.len()));
        for face in &faces {
            let numbers: Vec<String> = face.iter().map(i64::to_string).collect();
            file.text(&format!("{}({})\n", face.len(), numbers.join(" ")));
        }
        file.text(")\n");
    } else {
        let mut starts = vec![0];
        faces.iter().for_each(|face| starts.push(starts[starts.len() - 1] + face.len() as i64));
        file.labels(&starts).labels(&faces.concat());
    }
    put(mesh.join("faces"), &file.bytes);
    put(mesh.join("owner"), &Writer::new(style, "labelList").labels(&owner).bytes);
    put(mesh.join("neighbour"), &Writer::new(style, "labelList").labels(&neighbour).bytes);
    used
}

/// Writes fields of some of the cells: values follow from their numbers.
fn write_fields(folder: &Path, style: Style, chosen: &[usize], used: &[u32]) {
    let p: Vec<f64> = chosen.iter().map(|&c| c as f64 * 10.0).collect();
    let u: Vec<f64> = chosen.iter().flat_map(|&c| [c as f64, 0.5, -(c as f64)]).collect();
    let s: Vec<f64> = chosen.iter().flat_map(|&c| [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|k| k + c as f64)).collect();
    put(folder.join("p"), &Writer::field(style, "volScalarField", ("scalar", 1), &p));
    put(folder.join("U"), &Writer::field(style, "volVectorField", ("vector", 3), &u));
    put(folder.join("R"), &Writer::field(style, "volSymmTensorField", ("symmTensor", 6), &s));
    let d: Vec<f64> = used.iter().map(|&point| f64::from(point) + 0.25).collect();
    put(folder.join("d"), &Writer::field(style, "pointScalarField", ("scalar", 1), &d));
    put(folder.join("phi"), &Writer::field(style, "surfaceScalarField", ("scalar", 1), &p));
    let uniform = "internalField uniform (1 2 3);\nboundaryField {}\n";
    put(folder.join("W"), &Writer::new(style, "volVectorField").text(uniform).bytes);
}

fn case(style: Style) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    let all = [0, 1, 2, 3, 4];
    let used = write_mesh(root.path(), style, &all);
    write_fields(&root.path().join("0.5"), style, &all, &used);
    put(root.path().join("flow.foam"), b"");
    root
}

fn opened(path: &Path) -> Result<UnstructuredGrid, FormatError> {
    match read_contents(path, &ReadOptions::default(), &Progress::new())? {
        Contents::Cells(grid) => Ok(grid),
        other => panic!("{other:?}"),
    }
}

fn sound(path: &Path) -> UnstructuredGrid {
    opened(path).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(path: &Path) -> String {
    opened(path).expect_err("refused").to_string()
}

fn values(grid: &UnstructuredGrid, name: &str) -> Vec<f64> {
    let array = grid.cell_data.iter().chain(&grid.point_data).find(|array| array.name == name);
    let array = array.unwrap_or_else(|| panic!("{name}"));
    (0..array.values.len()).map(|i| array.values.get(i)).collect()
}

#[test]
fn faces_become_cells_in_vtks_order() {
    let grid = sound(case(Style::Text).path());
    let types: Vec<CellType> = grid.cells.iter().map(|(cell_type, _)| cell_type).collect();
    assert_eq!(types, TYPES);
    let corner = |cell: usize, [a, b, c, d]: [usize; 4]| {
        let corners = grid.cells.get(cell).1;
        let [a, b, c, d] = [a, b, c, d].map(|i| grid.points[corners[i] as usize]);
        (b - a).cross(c - a).dot(d - a)
    };
    for [i, o, j, k] in [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]] {
        assert_eq!(corner(0, [i, o, j, k]), 1.0, "the hexahedron at {i}");
    }
    assert_eq!([corner(1, [0, 1, 2, 3]), corner(1, [3, 5, 4, 0])], [1.0, 1.0]);
    assert_eq!([corner(2, [0, 1, 3, 4]), corner(2, [2, 3, 1, 4])], [1.0, 1.0]);
    assert_eq!(corner(3, [0, 1, 2, 3]), 1.0);
    // The polyhedron's faces look out of it: together they have its volume.
    let (mut rest, mut volume, mut faces) = (&grid.cells.get(4).1[1..], 0.0, 0);
    while let [count, face @ ..] = rest {
        let at = |i: usize| grid.points[face[i] as usize];
        volume += (1..*count as usize - 1).map(|i| at(0).dot(at(i).cross(at(i + 1))) / 6.0).sum::<f64>();
        (rest, faces) = (&face[*count as usize..], faces + 1);
    }
    // A pyramid of volume 1/3 without the tet that the point inside cuts off.
    let cut = (dvec3(1.0, 0.0, 0.0).cross(dvec3(0.5, 0.5, -1.0))).dot(dvec3(0.5, 0.125, -0.25)) / 6.0;
    assert!((volume - (1.0 / 3.0 - cut.abs())).abs() < 1e-12 && faces == 7, "{volume} {faces}");
}

#[test]
fn fields_lie_where_they_belong() {
    let grid = sound(&case(Style::Text).path().join("flow.foam"));
    assert_eq!(values(&grid, "p"), [0.0, 10.0, 20.0, 30.0, 40.0]);
    assert_eq!(values(&grid, "U")[3..9], [1.0, 0.5, -1.0, 2.0, 0.5, -2.0]);
    assert_eq!(values(&grid, "R")[..6], [0.0, 3.0, 5.0, 1.0, 4.0, 2.0]);
    assert_eq!(values(&grid, "W"), [1.0, 2.0, 3.0].repeat(5));
    assert_eq!(values(&grid, "d")[13], 13.25);
    assert_eq!((grid.point_data.len(), grid.cell_data.len()), (1, 4));
    assert_eq!(grid.notes, ["time 0.5", "phi is a field on faces (surfaceScalarField) and was left out"]);
}

#[test]
fn all_ways_to_write_give_the_same() {
    let text = sound(case(Style::Text).path());
    let mut styles = vec![Style::Binary(4, 8, ByteOrder::Little, false), Style::Binary(8, 8, ByteOrder::Little, false)];
    for (label, scalar) in [(4, 4), (4, 8), (8, 4), (8, 8)] {
        styles.extend([ByteOrder::Little, ByteOrder::Big].map(|order| Style::Binary(label, scalar, order, true)));
    }
    for style in styles {
        let grid = sound(case(style).path());
        assert_eq!((&grid.points, &grid.cells), (&text.points, &text.cells));
        for name in ["p", "U", "R", "W", "d"] {
            assert_eq!(values(&grid, name), values(&text, name), "{name}");
        }
    }
    let packed = case(BINARY);
    for name in ["constant/polyMesh/points", "constant/polyMesh/faces", "0.5/U"] {
        let path = packed.path().join(name);
        let file = std::fs::File::create(packed.path().join(format!("{name}.gz"))).expect("made");
        let mut gz = flate2::write::GzEncoder::new(file, flate2::Compression::default());
        gz.write_all(&std::fs::read(&path).expect("there")).and_then(|()| gz.finish().map(drop)).expect("written");
        std::fs::remove_file(path).expect("gone");
    }
    let grid = sound(packed.path());
    assert_eq!((&grid.points, values(&grid, "U")), (&text.points, values(&text, "U")));
}

#[test]
fn times_are_steps_and_the_mesh_moves() {
    let root = case(Style::Text);
    let at = |name: &str| root.path().join(name);
    assert!(Series::open(root.path(), &[]).expect("sound").is_none());
    put(at("0/p"), &Writer::new(Style::Text, "volScalarField").text("internalField uniform 7;").bytes);
    put(at("10/q"), &Writer::new(Style::Text, "volScalarField").text("internalField uniform $seven;").bytes);
    put(at("1e1/r"), b"");
    put(at("0.orig/p"), b"none");
    let moved: Vec<f64> = points().iter().flat_map(|point| (*point + 1.0).to_array()).collect();
    put(at("0.5/polyMesh/points"), &Writer::new(Style::Text, "vectorField").tuples(3, &moved).bytes);
    let series = Series::open(&at("flow.foam"), &[]).expect("sound").expect("a series");
    assert_eq!(series.steps().iter().map(|step| step.time).collect::<Vec<_>>(), [0.0, 0.5, 10.0]);
    assert_eq!((series.shown_first(), series.steps().iter().all(|step| step.exists())), (2, true));
    let [first, second, third] = [0, 1, 2].map(|i| sound(&series.steps()[i].path));
    assert_eq!((values(&first, "p"), first.points[0]), (vec![7.0; 5], DVec3::ZERO));
    assert_eq!((values(&second, "p")[1], second.points[0], third.points[0]), (10.0, DVec3::ONE, DVec3::ONE));
    assert_eq!(third.notes[1], "q was left out: its value is a macro, which is not computed");
    assert_eq!(sound(root.path()).notes, ["time 10 is shown, of 3 from 0 to 10", third.notes[1].as_str()]);
    assert!(refused(&at("0.75")).contains("no time 0.75"));
}

#[test]
fn processors_are_put_together() {
    let (root, whole) = (tempfile::tempdir().expect("a temporary folder"), sound(case(BINARY).path()));
    for (i, chosen) in [vec![3, 2, 4], vec![0, 1]].into_iter().enumerate() {
        let folder = root.path().join(format!("processor{i}"));
        let used = write_mesh(&folder, BINARY, &chosen);
        write_fields(&folder.join("0.5"), BINARY, &chosen, &used);
        let addresses: Vec<i64> = used.iter().map(|&point| i64::from(point) * 3).collect();
        let bytes = Writer::new(BINARY, "labelList").labels(&addresses).bytes.clone();
        put(folder.join("constant/polyMesh/pointProcAddressing"), &bytes);
    }
    std::fs::remove_file(root.path().join("processor1/0.5/W")).expect("gone");
    let grid = sound(root.path());
    assert_eq!((&grid.points, values(&grid, "d")), (&whole.points, values(&whole, "d")));
    assert_eq!(values(&grid, "p"), [30.0, 20.0, 40.0, 0.0, 10.0]);
    assert_eq!(values(&grid, "W").iter().map(|v| v.is_nan()).collect::<Vec<_>>(), [[false; 9].as_slice(), &[true; 6]].concat());
    for (cell, original) in [3, 2, 4, 0, 1].into_iter().enumerate() {
        let sorted = |grid: &UnstructuredGrid, cell: usize| {
            let (cell_type, points) = grid.cells.get(cell);
            let mut points = points.to_vec();
            points.sort_unstable();
            (cell_type, points)
        };
        assert_eq!(sorted(&grid, cell), sorted(&whole, original));
    }
    assert!(grid.notes.contains(&"the mesh is put together from 2 processors".to_owned()), "{:?}", grid.notes);
    std::fs::remove_file(root.path().join("processor0/constant/polyMesh/pointProcAddressing")).expect("gone");
    let apart = sound(&root.path().join("0.5"));
    assert_eq!((apart.points.len(), apart.notes.len()), (22, 4));
}

#[test]
fn zones_are_an_array() {
    let root = case(Style::Text);
    let mut file = Writer::new(Style::Text, "regIOobject");
    file.text("2\n(\nrotor { type cellZone; cellLabels List<label> 2(1 4); }\nhole { type cellZone; cellLabels List<label> 1{0}; }\n)\n");
    put(root.path().join("constant/polyMesh/cellZones"), &file.bytes);
    let grid = sound(root.path());
    let zones = values(&grid, "cellZone");
    assert!(zones[..2] == [1.0, 0.0] && zones[2].is_nan() && zones[4] == 0.0, "{zones:?}");
    assert!(grid.notes.contains(&"zones in the array cellZone: 0 rotor, 1 hole".to_owned()), "{:?}", grid.notes);
    assert_eq!((grid.active_scalars.as_deref(), grid.cell_data.last().map(|array| array.name.as_str())), (Some("p"), Some("cellZone")));
    let all = Writer::new(Style::Text, "regIOobject").text("1(flow { type cellZone; cellLabels List<label> 5(0 1 2 3 4); })").bytes.clone();
    put(root.path().join("constant/polyMesh/cellZones"), &all);
    let grid = sound(root.path());
    assert!(grid.notes.contains(&"all cells are in the zone flow".to_owned()) && grid.cell_data.len() == 4, "{:?}", grid.notes);
}

#[test]
fn what_is_wrong_is_said() {
    let root = case(Style::Text);
    let at = |name: &str| root.path().join(name);
    put(at("0.5/p"), &Writer::field(Style::Text, "volScalarField", ("scalar", 1), &[1.0, 2.0]));
    let said = refused(root.path());
    assert!(said.ends_with("its file 0.5/p: line 17: 2 values inside, expected 5"), "{said}");
    put(at("constant/polyMesh/owner"), b"nothing");
    let said = refused(root.path());
    assert!(said.ends_with("its file constant/polyMesh/owner: line 1: \"nothing\", expected the header FoamFile { .. }"), "{said}");
    std::fs::remove_file(at("constant/polyMesh/owner")).expect("gone");
    assert!(refused(root.path()).contains("constant/polyMesh/owner"));
    let empty = tempfile::tempdir().expect("a temporary folder");
    put(empty.path().join("a.foam"), b"");
    assert!(refused(&empty.path().join("a.foam")).contains("no folder constant/polyMesh"));
    put(empty.path().join("constant/air/polyMesh/points"), b"");
    assert!(refused(&empty.path().join("a.foam")).contains("several regions (air)"));
}

#[test]
fn damaged_files_are_refused_or_read() {
    for style in [Style::Text, BINARY] {
        let root = case(style);
        for name in
            ["points", "faces", "owner", "neighbour"].map(|name| format!("constant/polyMesh/{name}")).into_iter().chain(["0.5/U".into()])
        {
            let path = root.path().join(&name);
            let sound = std::fs::read(&path).expect("there");
            for i in (0..sound.len()).step_by(3) {
                let mut changed = sound.clone();
                changed[i] = [b'9', b'(', 0xff, b'{'][i / 3 % 4];
                for bytes in [&sound[..i], &changed] {
                    std::fs::write(&path, bytes).expect("written");
                    if let Ok(grid) = opened(root.path()) {
                        assert!(grid.cells.len() <= 60 && grid.points.len() <= 14, "{name} {i}");
                    }
                }
            }
            std::fs::write(&path, &sound).expect("written");
        }
    }
}
