//! Grids and solutions in every way that they are written, made here, and files made to do harm.

use super::*;
use crate::format::{Data, ReadOptions, read as read_file, read_mesh};
use crate::geometry;
use crate::mesh::TetMesh;
use std::fmt::Write;
use tempfile::TempDir;

/// How a file is written.
#[derive(Debug, Clone, Copy)]
struct Way {
    big: bool,
    double: bool,
    records: bool,
    multi: bool,
    blanks: bool,
    text: bool,
}

const PLAIN: Way = Way { big: true, double: false, records: false, multi: false, blanks: false, text: false };

/// A number of a file.
#[derive(Clone, Copy)]
enum N {
    Int(i32),
    Float(f64),
}

/// Records of numbers as a file.
fn written(way: Way, records: &[Vec<N>]) -> Vec<u8> {
    let mut out = Vec::new();
    for record in records {
        if way.text {
            let mut line = String::new();
            for n in record {
                match n {
                    N::Int(n) => write!(line, " {n}"),
                    // As Fortran writes them.
                    N::Float(f) => write!(line, "  {}", format!("{f:.9e}").replace('e', if way.double { "D" } else { "E" })),
                }
                .expect("a string takes all");
            }
            out.extend(line.bytes());
            out.push(b'\n');
            continue;
        }
        let ordered = |mut bytes: Vec<u8>| {
            if way.big {
                bytes.reverse();
            }
            bytes
        };
        let bytes: Vec<u8> = record
            .iter()
            .flat_map(|n| match *n {
                N::Int(n) => ordered(n.to_le_bytes().to_vec()),
                N::Float(f) if way.double => ordered(f.to_le_bytes().to_vec()),
                N::Float(f) => ordered((f as f32).to_le_bytes().to_vec()),
            })
            .collect();
        let mark = if way.records { ordered((bytes.len() as i32).to_le_bytes().to_vec()) } else { vec![] };
        out.extend([mark.clone(), bytes, mark].concat());
    }
    out
}

/// Two blocks; the second one is curved and left-handed.
const BLOCKS: [[usize; 3]; 2] = [[4, 3, 2], [3, 3, 4]];

fn dims(way: Way, more: &[i32]) -> Vec<Vec<N>> {
    let blocks = if way.multi { &BLOCKS[..] } else { &BLOCKS[..1] };
    let numbers = blocks.iter().flat_map(|dims| dims.iter().map(|&n| n as i32).chain(more.iter().copied())).map(N::Int).collect();
    if way.multi { vec![vec![N::Int(2)], numbers] } else { vec![numbers] }
}

fn place(block: usize, i: usize) -> DVec3 {
    let [nx, ny, _] = BLOCKS[block];
    let p = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
    if block == 0 { p } else { DVec3::new(10.0 - p.x, p.y, p.z + 0.125 * p.x * p.x) }
}

/// Points of a block that are blanked: one corner's.
fn iblank(i: usize) -> i32 {
    [0, 2, -5, 1][i.min(3)]
}

fn blocks(way: Way) -> impl Iterator<Item = (usize, usize)> {
    let all = if way.multi { 2 } else { 1 };
    (0..all).map(|b| (b, BLOCKS[b].iter().product()))
}

fn grid(way: Way) -> Vec<u8> {
    let block = |(b, n): (usize, usize)| {
        let along = |axis: usize| (0..n).map(move |i| N::Float(place(b, i)[axis]));
        let blanks = (0..if way.blanks { n } else { 0 }).map(|i| N::Int(iblank(i)));
        along(0).chain(along(1)).chain(along(2)).chain(blanks).collect::<Vec<_>>()
    };
    written(way, &[dims(way, &[]), blocks(way).map(block).collect()].concat())
}

/// Density, momentum and energy are linear in place, so that any point tells which is which.
fn q(array: usize, p: DVec3) -> f64 {
    let coefficients = [[1.0, 2.0, 4.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.5, 0.25]][array];
    DVec3::from_array(coefficients).dot(p) + array as f64
}

fn solution(way: Way) -> Vec<u8> {
    let block = |(b, n): (usize, usize)| {
        let all = (0..5).flat_map(|array| (0..n).map(move |i| N::Float(q(array, place(b, i))))).collect();
        [vec![N::Float(0.5), N::Float(1.0), N::Float(1e6), N::Float(0.0)], all]
    };
    written(way, &[dims(way, &[]), blocks(way).flat_map(block).collect()].concat())
}

fn functions(way: Way, count: i32) -> Vec<u8> {
    let block = |(b, n): (usize, usize)| {
        (0..count as usize).flat_map(|array| (0..n).map(move |i| N::Float(q(array, place(b, i))))).collect::<Vec<_>>()
    };
    written(way, &[dims(way, &[count]), blocks(way).map(block).collect()].concat())
}

fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).expect("written"));
    folder
}

fn opened(files: &[(&str, &[u8])], options: &ReadOptions) -> Result<TetMesh, String> {
    let folder = folder(files);
    match read_file(&folder.path().join(files[0].0), options, &Progress::new()) {
        Ok(Data::Mesh(mesh)) => Ok(mesh),
        Ok(Data::Grid(_)) => panic!("a volume"),
        Err(error) => {
            let text = error.to_string();
            assert!(!text.contains('\n'), "{text}");
            let start = format!("{}: ", folder.path().join(files[0].0).display());
            Err(text.strip_prefix(&start).unwrap_or_else(|| panic!("{text}")).to_owned())
        }
    }
}

fn mesh(files: &[(&str, &[u8])]) -> TetMesh {
    opened(files, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_refused(files: &[(&str, &[u8])], expected: &str) {
    let error = opened(files, &ReadOptions::default()).expect_err("broken");
    assert!(error.contains(expected), "\"{error}\" does not say \"{expected}\"");
}

fn volume(mesh: &TetMesh) -> f64 {
    (0..mesh.tets().len()).map(|tet| geometry::signed_volume(&mesh.corners(tet))).sum()
}

#[test]
fn every_way_of_writing_loads_alike() {
    let both = [false, true];
    let mut ways = Vec::new();
    for (double, multi, blanks) in both.iter().flat_map(|&d| both.iter().flat_map(move |&m| both.map(|b| (d, m, b)))) {
        ways.push(Way { text: true, double, multi, blanks, big: false, records: false });
        ways.extend(both.iter().flat_map(|&big| both.map(|records| Way { big, double, records, multi, blanks, text: false })));
    }
    assert_eq!(ways.len(), 40);
    for way in ways {
        let mesh = mesh(&[("a.x", &grid(way)), ("a.q", &solution(way))]);
        // A blanked corner takes its cell with it, and in a block of one layer the point above, which no other cell uses.
        let lost = match (way.blanks, way.multi) {
            (false, _) => [0, 0],
            (true, false) => [1, 2],
            (true, true) => [2, 3],
        };
        let (cells, points) = if way.multi { (6 + 12, 24 + 36) } else { (6, 24) };
        assert_eq!((mesh.tets().len(), mesh.points().len()), (5 * (cells - lost[0]), points - lost[1]), "{way:?}");
        assert_eq!((mesh.inverted_count(), mesh.zero_volume_count()), (0, 0), "{way:?}");
        if !way.multi && !way.blanks {
            assert!((volume(&mesh) - 6.0).abs() < 1e-9, "{way:?}");
        }
        let names: Vec<_> = mesh.point_data().iter().map(|a| (a.name.as_str(), a.components)).collect();
        assert_eq!(names, [("Density", 1), ("Momentum", 3), ("StagnationEnergy", 1)], "{way:?}");
        assert_eq!(mesh.active_scalars(), Some("Density"));
        for (i, &p) in mesh.points().iter().enumerate() {
            let p = p + mesh.center();
            let found =
                [mesh.point_data()[0].values.get(i), mesh.point_data()[1].values.get(3 * i + 1), mesh.point_data()[2].values.get(i)];
            let expected = [q(0, p), q(2, p), q(4, p)];
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-5), "{found:?} at {p}, expected {expected:?}: {way:?}");
        }
    }
}

#[test]
fn curved_blocks_have_the_volume_that_their_split_keeps() {
    // A quarter of a tube, radii 1 to 2, 1 high, of either hand: with n sectors of angle a each is (4 - 1) sin(a) / 2.
    let (nr, na) = (5, 9);
    for sense in [1.0, -1.0] {
        let at = |i: usize| {
            let (r, a) = (1.0 + (i % nr) as f64 / (nr - 1) as f64, (i / nr % na) as f64 / (na - 1) as f64 * std::f64::consts::FRAC_PI_2);
            DVec3::new(r * a.cos(), sense * r * a.sin(), (i / (nr * na)) as f64)
        };
        let n = nr * na * 2;
        let numbers = (0..3).flat_map(|axis| (0..n).map(move |i| N::Float(at(i)[axis]))).collect();
        let way = Way { double: true, ..PLAIN };
        let bytes = written(way, &[vec![N::Int(nr as i32), N::Int(na as i32), N::Int(2)], numbers]);
        let options = ReadOptions { solution: SolutionFile::IfBeside, ..Default::default() };
        let mesh = opened(&[("tube.xyz", &bytes)], &options).expect("sound");
        let angle = std::f64::consts::FRAC_PI_2 / (na - 1) as f64;
        assert!((volume(&mesh) / ((na - 1) as f64 * 1.5 * angle.sin()) - 1.0).abs() < 1e-12);
        assert_eq!((mesh.inverted_count(), mesh.point_data().len()), (0, 0));
    }
}

#[test]
fn the_two_files_find_each_other_by_name() {
    let (g, s, f) = (grid(PLAIN), solution(PLAIN), functions(PLAIN, 2));
    for (name, other) in [
        ("a.x", "a.q"),
        ("b.xyz", "b.q"),
        ("c.p3d", "c.q"),
        ("dxyz.bin", "dq.bin"),
        ("ex.bin", "eq.bin"),
        ("fgrid.bin", "fsol.bin"),
        ("g.bin", "g.q"),
        ("x.fmt", "q.fmt"),
    ] {
        assert_eq!(mesh(&[(name, &g), (other, &s)]).point_data().len(), 3, "{name} with {other}");
        assert_eq!(mesh(&[(other, &s), (name, &g)]).point_data().len(), 3, "{other} with {name}");
    }
    assert_eq!(mesh(&[("A.XYZ", &g), ("A.Q", &s)]).point_data().len(), 3, "in capitals");
    let names = |mesh: &TetMesh| mesh.point_data().iter().map(|a| a.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&mesh(&[("a.x", &g), ("a.f", &f)])), ["Function0", "Function1"]);
    assert_eq!(names(&mesh(&[("a.x", &g), ("a.f", &f), ("a.q", &s)]))[0], "Density", "the solution comes first");

    let folder = folder(&[("a.x", &g), ("elsewhere.dat", &s), ("fun.dat", &f)]);
    let at = |name: &str| ReadOptions { solution: SolutionFile::At(folder.path().join(name)), ..Default::default() };
    let read = |name: &str| match read_file(&folder.path().join("a.x"), &at(name), &Progress::new()) {
        Ok(Data::Mesh(mesh)) => Ok(names(&mesh)[0].clone()),
        Ok(_) => panic!("a volume"),
        Err(error) => Err(error.to_string()),
    };
    assert_eq!(read("elsewhere.dat"), Ok("Density".into()));
    assert_eq!(read("fun.dat"), Ok("Function0".into()));
    assert!(read("none.dat").is_err_and(|error| error.contains("its solution") && error.contains("none.dat cannot be read")));
    let error = read_mesh(&folder.path().join("a.x"), &Progress::new()).expect_err("nothing beside it").to_string();
    assert!(error.contains("looked for a.q, a.f); name its file with --solution"), "{error}");
    assert_refused(&[("alone.q", &s)], "without a grid beside it (looked for alone.xyz, alone.x");
}

#[test]
fn blocks_with_fewer_functions_miss_values() {
    let way = Way { multi: true, ..PLAIN };
    let numbers = |b: usize, count: usize| (0..count * BLOCKS[b].iter().product::<usize>()).map(|i| N::Float(i as f64)).collect::<Vec<_>>();
    let header = vec![4, 3, 2, 1, 3, 3, 4, 2].into_iter().map(N::Int).collect();
    let f = written(way, &[vec![N::Int(2)], header, numbers(0, 1), numbers(1, 2)]);
    let mesh = mesh(&[("a.x", &grid(way)), ("a.f", &f)]);
    let missing = |array: usize| (0..60).filter(|&i| mesh.point_data()[array].values.get(i).is_nan()).count();
    assert_eq!((mesh.point_data().len(), missing(0), missing(1)), (2, 0, 24));
}

#[test]
fn a_solution_may_be_written_in_another_way_and_have_bytes_behind_it() {
    let g = grid(PLAIN);
    for way in [Way { big: false, ..PLAIN }, Way { double: true, ..PLAIN }, Way { records: true, ..PLAIN }, Way { text: true, ..PLAIN }] {
        assert_eq!(mesh(&[("a.x", &g), ("a.q", &solution(way))]).point_data().len(), 3, "{way:?}");
    }
    let long = |more: usize| [solution(PLAIN), vec![7; more]].concat();
    assert_eq!(mesh(&[("a.x", &g), ("a.q", &long(95))]).point_data().len(), 3);
    assert_refused(&[("a.x", &g), ("a.q", &long(96))], "its solution a.q has 604 bytes, expected 508 as f32 or");
}

#[test]
fn wrong_lengths_say_what_was_expected() {
    let (g, s) = (grid(PLAIN), solution(PLAIN));
    assert_refused(
        &[("a.x", &g[..g.len() - 1]), ("a.q", &s)],
        "it has 299 bytes, expected 300 as f32, 396 as f32 with iblank, 588 as f64 or 684 as f64 with iblank for 4 x 3 x 2 points, big-endian",
    );
    assert_refused(&[("a.x", &g), ("a.q", &s[..s.len() - 4])], "its solution a.q has 504 bytes, expected 508 as f32");
    let double = solution(Way { double: true, ..PLAIN });
    assert_refused(&[("a.x", &g), ("a.q", &double[..double.len() - 8])], "its solution a.q has");
    let text = grid(Way { text: true, ..PLAIN });
    assert_refused(&[("a.x", &text[..text.len() - 20]), ("a.q", &s)], "numbers, expected 75 or 99 with iblank for 4 x 3 x 2 points");
    let records = grid(Way { records: true, ..PLAIN });
    assert_refused(&[("a.x", &records[..records.len() - 4]), ("a.q", &s)], "in Fortran records");

    let mut marks = records;
    let last = marks.len() - 4;
    marks[last..].copy_from_slice(&[0, 0, 1, 0]);
    assert_refused(&[("a.x", &marks), ("a.q", &s)], "it has a Fortran record mark of 256 at byte 312, expected 288");
    let mut other = s.clone();
    other[3] = 3;
    other[7] = 4;
    assert_refused(&[("a.x", &g), ("a.q", &other)], "its solution a.q has 3 x 4 x 2 points, expected the grid's 4 x 3 x 2 points");
}

#[test]
fn what_is_no_grid_is_refused() {
    let huge = [0x7fu8, 0xff, 0xff, 0xff].repeat(3);
    let count = [0x7f, 0xff, 0xff, 0xff, 0, 0, 0, 4].to_vec();
    for bytes in [vec![], vec![0; 4], vec![0; 400], huge, count, b"GARBAGE and more of it, as long as a header".to_vec()] {
        assert_refused(&[("a.x", &bytes)], "it does not begin as PLOT3D does");
    }
    assert_refused(&[("a.xyz", b"3\nwater\nO 0 0 0\nH 1 0 0\nH 0 1 0\n")], "it does not begin as PLOT3D does");
    let large = [[0u8, 0, 16, 0]; 3].concat(); // 4096 cubed
    assert_refused(&[("a.x", &large)], "it has 12 bytes, expected 824633720844 as f32");
    assert_refused(&[("a.x", b"2 2 2 0.5 x")], "it does not begin");
    assert_refused(
        &[("a.x", &[b"2 2 2 ".to_vec(), b"0.5 ".repeat(200), b"1.2.3".to_vec()].concat())],
        "it has \"1.2.3\" among its numbers, at byte 806",
    );
    let sheet = written(PLAIN, &[vec![N::Int(5), N::Int(5), N::Int(1)], vec![N::Float(0.0); 75]]);
    assert_refused(&[("a.x", &sheet), ("a.q", &[])], "holds 5 x 5 x 1 points, expected a block with at least 2 points along each axis");
    assert_refused(&[("a.x", b"1 1 1 1 0 0 0")], "can be read in several ways, expected one: 1 x 1 x 1 points (7 with iblank); ");
    let bomb = b"2 2 2 999999999*0".to_vec();
    let options = ReadOptions { memory_bytes: 1 << 20, ..Default::default() };
    assert!(opened(&[("a.x", &bomb)], &options).is_err_and(|error| error.contains("budget of 1048576 bytes")));
    assert_refused(&[("a.x", b"3*2 12*0.25 2*0.5 4*0.25 6*1"), ("b.q", b"")], "without a solution");
}
