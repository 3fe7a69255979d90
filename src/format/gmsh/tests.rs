use super::super::parse::parsed;
use super::*;
use crate::mesh::{CellType, DataArray, Values};

/// A triangle of surface 4 and two tets of volume 1, their numbers scattered; values of three nodes, a vector of two elements, and values at
/// the nodes of an element.
fn mesh(version: Version, encoding: Encoding) -> Vec<u8> {
    let mut out = Out { bytes: Vec::new(), encoding };
    out.line(format!(
        "$MeshFormat\n{} {} 8",
        match version {
            Version::Two => "2.2",
            Version::FourZero => "4",
            Version::FourOne => "4.1",
        },
        u8::from(encoding != Encoding::Text)
    ));
    if encoding != Encoding::Text {
        out.int(1); // and no end of line, as fTetWild does
    }
    out.line("$EndMeshFormat\n$Comments\n$Nodes\n3\n$EndComments\n$PhysicalNames\n1\n3 8 \"the fluid\"\n$EndPhysicalNames".into());
    if version != Version::Two {
        out.line("$Entities".into());
        out.sizes(&[1, 0, 1, 1]);
        out.int(6);
        out.reals(if version == Version::FourOne { &[0.0; 3] } else { &[0.0; 6] });
        out.sizes(&[0]);
        for (entity, physical) in [(4, 2), (1, 8)] {
            out.int(entity);
            out.reals(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
            out.sizes(&[1]);
            out.int(physical);
            out.sizes(&[1]);
            out.int(4);
        }
        out.line("\n$EndEntities".into());
    }
    out.nodes(version);
    out.elements(version);
    out.line("\n$NodeData\n1\n\"a b\"\n1\n0.5\n4\n7\n1\n3\n0".into());
    for (node, value) in [(77, 1.5), (10, -2.5), (6, 0.1)] {
        out.int(node);
        out.reals(&[value]);
    }
    out.line("\n$EndNodeData\n$NodeData\n1\n\"a b\"\n1\n1.5\n3\n8\n1\n1".into());
    out.int(5);
    out.reals(&[9.0]);
    out.line("\n$EndNodeData\n$ElementData\n1\n\"v\"\n0\n3\n0\n3\n2".into());
    out.int(4);
    out.reals(&[1.0, 2.0, 3.0]);
    out.int(9);
    out.reals(&[4.0, 5.0, 6.0]);
    out.line("\n$EndElementData\n$ElementNodeData\n1\n\"e\"\n0\n3\n0\n1\n2".into());
    for (element, values) in [(12, [1.0, 2.0, 3.0, 4.0]), (4, [4.0, 5.0, 6.0, 7.0])] {
        out.int(element);
        out.int(4);
        out.reals(&values);
    }
    out.line("\n$EndElementNodeData".into());
    out.bytes
}

/// Elements of a dimension that are alike: their physical group, entity and type, then each one's number and nodes.
type Block = (i32, [i32; 3], &'static [(i32, &'static [i32])]);

/// Writes numbers as a version and an encoding have them.
struct Out {
    bytes: Vec<u8>,
    encoding: Encoding,
}

impl Out {
    fn line(&mut self, text: String) {
        self.bytes.extend(text.into_bytes());
        self.bytes.push(b'\n');
    }

    fn put(&mut self, text: String, mut little: Vec<u8>) {
        match self.encoding {
            Encoding::Text => self.bytes.extend(format!("{text} ").into_bytes()),
            Encoding::Binary { order, .. } => {
                if order == ByteOrder::Big {
                    little.reverse();
                }
                self.bytes.extend(little);
            }
        }
    }

    fn int(&mut self, n: i32) {
        self.put(n.to_string(), n.to_le_bytes().to_vec());
    }

    fn ints(&mut self, numbers: &[i32]) {
        numbers.iter().for_each(|&n| self.int(n));
    }

    fn sizes(&mut self, numbers: &[u64]) {
        numbers.iter().for_each(|n| self.put(n.to_string(), n.to_le_bytes().to_vec()));
    }

    fn reals(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|n| self.put(n.to_string(), n.to_le_bytes().to_vec()));
    }

    fn nodes(&mut self, version: Version) {
        let nodes =
            [(10, [0.0, 0.0, 0.1]), (3, [1.0, 0.0, 0.0]), (77, [0.0, 1.0, 0.0]), (5, [0.0, 0.0, -1e-3]), (6, [1.0, 1.0, 1.0 / 3.0])];
        self.line("$Nodes".into());
        match version {
            Version::Two => {
                self.line("5".into());
                for (tag, point) in nodes {
                    self.int(tag);
                    self.reals(&point);
                }
            }
            Version::FourZero => {
                self.sizes(&[2, 5]);
                self.ints(&[4, 2, 1]);
                self.sizes(&[2]);
                for (i, (tag, point)) in nodes.into_iter().enumerate() {
                    if i == 2 {
                        self.ints(&[1, 3, 0]);
                        self.sizes(&[3]);
                    }
                    self.int(tag);
                    self.reals(&point);
                    if i < 2 {
                        self.reals(&[0.25, 0.75]);
                    }
                }
            }
            Version::FourOne => {
                self.sizes(&[2, 5, 3, 77]);
                for (block, nodes, dimension) in [([2, 4, 1], &nodes[..2], 2), ([3, 1, 0], &nodes[2..], 0)] {
                    self.ints(&block);
                    self.sizes(&[nodes.len() as u64]);
                    nodes.iter().for_each(|&(tag, _)| self.sizes(&[tag as u64]));
                    for (_, point) in nodes {
                        self.reals(point);
                        self.reals(&[0.25, 0.75][..dimension]);
                    }
                }
            }
        }
        self.line("\n$EndNodes".into());
    }

    fn elements(&mut self, version: Version) {
        let blocks: [Block; 2] = [(2, [2, 4, 2], &[(9, &[10, 3, 77])]), (3, [8, 1, 4], &[(12, &[10, 3, 77, 5]), (4, &[3, 77, 5, 6])])];
        self.line("$Elements".into());
        match version {
            Version::Two => self.line("3".into()),
            Version::FourZero => self.sizes(&[2, 3]),
            Version::FourOne => self.sizes(&[2, 3, 4, 12]),
        }
        for (dimension, [physical, entity, element_type], elements) in blocks {
            match version {
                Version::Two if self.encoding != Encoding::Text => self.ints(&[element_type, elements.len() as i32, 3]),
                Version::Two => {}
                Version::FourZero => self.ints(&[entity, dimension, element_type]),
                Version::FourOne => self.ints(&[dimension, entity, element_type]),
            }
            if version != Version::Two {
                self.sizes(&[elements.len() as u64]);
            }
            for &(tag, nodes) in elements {
                if version == Version::FourOne {
                    self.sizes(&[tag as u64]);
                    nodes.iter().for_each(|&node| self.sizes(&[node as u64]));
                    continue;
                }
                self.int(tag);
                if version == Version::Two && self.encoding == Encoding::Text {
                    self.ints(&[element_type, 3]);
                }
                if version == Version::Two {
                    self.ints(&[physical, entity, 1]);
                }
                self.ints(nodes);
            }
        }
        self.line("\n$EndElements\n$Periodic\n0\n$EndPeriodic".into());
    }
}

const VERSIONS: [Version; 3] = [Version::Two, Version::FourZero, Version::FourOne];

fn encodings() -> [Encoding; 3] {
    let binary = |order| Encoding::Binary { order, size_bytes: 8 };
    [Encoding::Text, binary(ByteOrder::Little), binary(ByteOrder::Big)]
}

/// Numbers with NaN told apart from none.
fn shown_values(array: &DataArray) -> String {
    format!("{} {} {:?}", array.name, array.components, array.values)
}

#[test]
fn all_versions_and_encodings_are_read_alike() {
    for version in VERSIONS {
        for encoding in encodings() {
            let grid = parsed(read, &mesh(version, encoding)).unwrap_or_else(|error| panic!("{version:?} {encoding:?}: {error}"));
            assert_eq!(grid.points[0], DVec3::new(0.0, 0.0, 0.1));
            assert_eq!((grid.points.len(), grid.points[4].z), (5, 1.0 / 3.0));
            let cells: Vec<_> = grid.cells.iter().collect();
            let expected: [(_, &[u32]); 3] =
                [(CellType::TRIANGLE, &[0, 1, 2]), (CellType::TETRA, &[0, 1, 2, 3]), (CellType::TETRA, &[1, 2, 3, 4])];
            assert_eq!(cells, expected);
            let points: Vec<String> = grid.point_data.iter().map(shown_values).collect();
            assert_eq!(points, ["a b 1 F64([-2.5, NaN, 1.5, NaN, 0.1])", "e 1 F64([1.0, 3.0, 4.0, 5.0, 7.0])"]);
            let cells: Vec<String> = grid.cell_data.iter().map(shown_values).collect();
            assert_eq!(
                cells,
                [
                    "v 3 F64([4.0, 5.0, 6.0, NaN, NaN, NaN, 1.0, 2.0, 3.0])",
                    "gmsh:physical 1 F32([2.0, 8.0, 8.0])",
                    "gmsh:geometrical 1 F32([4.0, 1.0, 1.0])"
                ]
            );
            assert_eq!(
                grid.notes,
                [
                    "the names of physical groups are not kept, only their numbers: volume 8 is \"the fluid\"",
                    "array \"a b\" has more steps: the first was taken, 1 left out",
                    "array \"e\" has values for each node of each element; here is their mean at each node"
                ]
            );
        }
    }
}

/// A small file in version 2.2 with these elements and what follows.
fn text(count: usize, elements: &str, rest: &str) -> String {
    let nodes: String = (1..=64).map(|i| format!("{i} {i} 0 0\n")).collect();
    format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n64\n{nodes}$EndNodes\n$Elements\n{count}\n{elements}$EndElements\n{rest}")
}

#[test]
fn nodes_of_higher_orders_are_reordered_or_left_out() {
    let all: String = (1..=64).map(|i| format!(" {i}")).collect();
    let tet: String = (1..=10).map(|i| format!(" {i}")).collect();
    let pyramid: String = (1..=14).map(|i| format!(" {i}")).collect();
    let grid = parsed(read, text(3, &format!("1 11 0{tet}\n2 92 0{all}\n3 14 0{pyramid}\n"), "").as_bytes()).expect("sound");
    assert_eq!(grid.cells.get(0), (CellType::QUADRATIC_TETRA, &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8][..]));
    let (hexahedron, nodes) = grid.cells.get(1);
    assert_eq!((hexahedron, nodes.len(), &nodes[8..14]), (CellType::LAGRANGE_HEXAHEDRON, 64, &[8, 9, 14, 15, 19, 18][..]));
    assert_eq!(grid.cells.get(2), (CellType::QUADRATIC_PYRAMID, &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12][..]));
    assert_eq!(grid.notes, ["1 elements of Gmsh's type 14 with 14 nodes are taken as quadratic pyramids of 13"]);
    assert!(grid.cell_data.is_empty(), "no tags, no arrays");
}

#[test]
fn values_for_nobody_are_counted_and_partitions_joined() {
    let data = |partition: u32, rows: &str| format!("$NodeData\n2\n\"p\"\n\"scheme\"\n1\n0\n4\n0\n1\n2\n{partition}\n{rows}$EndNodeData\n");
    let rest = data(1, "1 5\n2 6\n") + &data(2, "3 7\n99 8\n") + "$NodeData\n1\n\"q\"\n0\n3\n0\n1\n0\n$EndNodeData\n";
    let grid = parsed(read, text(0, "", &rest).as_bytes()).expect("sound");
    assert_eq!(grid.point_data.len(), 1);
    let Values::F64(values) = &grid.point_data[0].values else { panic!("not f64") };
    assert_eq!((&values[..3], values[3].is_nan()), (&[5.0, 6.0, 7.0][..], true));
    assert!(grid.notes.iter().any(|note| note == "1 rows of array \"p\" are of nodes or elements that are not there"), "{:?}", grid.notes);
    assert!(grid.notes.iter().any(|note| note == "array \"q\" has no values and was left out"), "{:?}", grid.notes);
    assert!(grid.notes.iter().any(|note| note.contains("by a scheme of its own")), "{:?}", grid.notes);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let error = |text: &str| parsed(read, text.as_bytes()).expect_err("not sound").to_string();
    let sound = text(1, "7 4 0 1 2 3 4\n", "");
    assert!(parsed(read, sound.as_bytes()).is_ok());
    for (found, expected) in [
        (error("$MeshFormat\n3 0 8\n"), "is Gmsh's format in version 3; octetra reads versions 2.0 to 2.3, 4.0 and 4.1"),
        (error("$NOD\n1\n"), "is Gmsh's format in version 1;"),
        (error("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"), "the file: no section $Nodes, expected one"),
        (error("$MeshFormat\n2.2 1 8\nabcd"), "byte 20: something else, expected 1 in 4 bytes, in either order"),
        (error(&sound.replace("7 4 0 1 2 3 4", "7 4 0 1 2 3 65")), "line 73, element 7: node 65, expected a node that is in the file"),
        (error(&sound.replace("7 4 0", "7 34 0")), "line 73: elements of type 34, expected a type of Gmsh's with a fixed count"),
        (error(&sound.replace("$Nodes\n64", "$Nodes\n63")), "line 69: \"64\", expected $EndNodes"),
        (error(&sound.replace("$Nodes\n64", "$Nodes\n640000")), "640000 nodes, expected no more than the file has room for"),
        (error(&sound.replace("$Elements\n1", "$Elements\n2")), "line 74: \"$EndElements\", expected the number of an element"),
        (error(&sound.replace("64 64 0 0", "64 64 x 0")), "line 69: \"x\", expected a coordinate of a node"),
        (error(&format!("{sound}$Nodes\n0\n$EndNodes\n")), "line 75: \"$Nodes\", expected one such section"),
        (error(&format!("{sound}$Extra\n1\n")), "expected $EndExtra"),
        (error(&format!("{sound}rubbish")), "line 75: \"rubbish\", expected a section, such as $Nodes"),
        (error(&sound.replace("$Nodes", "$NoNodes").replace("$EndNodes", "$EndNoNodes")), "expected the section $Nodes before it"),
        (error(&format!("{sound}$NodeData\n1\n\"p\"\n0\n3\n0\n999999999\n1\n")), "components 999999999, expected no more than"),
        (error(&format!("{sound}$NodeData\n1\n\"p\"\n0\n3\n0\n1\n1\n1 np.float64(0.5)\n")), "\"np.float64(0.5)\", expected a value"),
        (error(&format!("{sound}$NodeData\n1\n\"p\"\n0\n2\n0\n1\n")), "2 whole numbers, expected step, components and rows at least"),
    ] {
        assert!(found.contains(expected), "{found}\n{expected}");
    }
}

#[test]
fn every_truncation_is_an_error_and_no_panic() {
    for version in VERSIONS {
        for encoding in encodings() {
            let all = mesh(version, encoding);
            let end = all.len() - "$EndElementNodeData\n".len();
            for len in 0..end {
                let cut = parsed(read, &all[..len]);
                let text = String::from_utf8_lossy(&all[..len]);
                let is_whole = text.trim_end().rsplit('$').next().is_some_and(|last| last.starts_with("End")) && text.contains("$EndNodes");
                assert!(cut.is_err() || is_whole, "{version:?} {encoding:?} {len}");
            }
        }
    }
}

/// Sound files of all versions and encodings.
pub(in crate::format) fn sound_files() -> Vec<Vec<u8>> {
    VERSIONS.iter().flat_map(|&version| encodings().map(|encoding| mesh(version, encoding))).collect()
}
