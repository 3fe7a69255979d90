//! Values at places: the data's own beside the octree's, at points and along a line.

use crate::geometry::Placed;
use crate::image::write_atomically;
use crate::mesh::Locator;
use crate::octree::{Boundary, OctreeTexture, Subject};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// Samples that are looked at between two looks at the progress.
const CHUNK: usize = 256;

/// What values are read from: a field with what finds its cells, and an octree of it.
#[derive(Clone, Copy)]
pub struct Probe<'a> {
    /// A field on a mesh, or a volume.
    pub subject: &'a Subject,
    /// What finds the mesh's tets; of no use for a volume.
    pub locator: Option<&'a Locator>,
    /// The octree.
    pub texture: &'a OctreeTexture,
    /// Where the octree ends: with [`Boundary::Mesh`] it has no value where the data have none.
    pub boundary: Boundary,
}

/// What is at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The place, world coordinates.
    pub at: DVec3,
    /// The value of the mesh (linear in a tet) or of the volume (trilinear in a cell), data units; `None` outside and where values are missing.
    pub own: Option<f64>,
    /// The value of the octree's reconstructed field, data units; `None` where the octree is empty or cut off.
    pub octree: Option<f64>,
    /// The cell of the file that holds the place.
    pub cell: Option<Cell>,
    /// The leaf that holds it.
    pub leaf: Option<Leaf>,
}

/// A cell of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Its number in the file, from 0, see [`crate::mesh::FileCells`]; of a volume the number with x fastest.
    pub number: u64,
    /// What it is: "tetrahedron", "hexahedron", "voxel".
    pub shape: &'static str,
}

/// A leaf of the octree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leaf {
    /// Its depth, from 1.
    pub depth: u8,
    /// Its edge, world units.
    pub edge: f64,
}

/// Samples along a line.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSamples {
    /// Distance of each from the line's first end, world units.
    pub arc_length: Vec<f64>,
    /// What is there.
    pub samples: Vec<Sample>,
}

impl Sample {
    /// The octree's value less the data's own, where there are both.
    pub fn difference(&self) -> Option<f64> {
        Some(self.octree? - self.own?)
    }
}

impl Probe<'_> {
    /// What is at a place in world coordinates.
    pub fn at(&self, at: DVec3) -> Sample {
        let local = at - self.subject.center();
        let (cell, own) = match (self.subject, self.locator) {
            (Subject::Mesh(mesh, field), Some(locator)) => {
                let place = locator.find(mesh, local);
                let cells = mesh.file_cells();
                let cell = |tet: u32| Cell { number: cells.number(tet as usize) as u64, shape: cells.cell_type(tet as usize).name().0 };
                (place.map(|place| cell(place.tet)), place.and_then(|place| place.value(mesh, field)))
            }
            (Subject::Mesh(..), None) => (None, None),
            (Subject::Volume(grid), _) => {
                let found = grid.value_at(local);
                let [cx, cy, _] = grid.frame().dims.map(|n| u64::from(n) - 1);
                let number = |[i, j, k]: [u64; 3]| i + cx * (j + cy * k);
                let cell = |cell: [u32; 3]| Cell { number: number(cell.map(u64::from)), shape: "voxel" };
                (found.map(|found| cell(found.0)), found.and_then(|found| found.1))
            }
        };
        let (texture, edge) = (self.texture, self.texture.root_edge());
        let unit = (local - texture.root_min()) / edge;
        let leaf = texture.corners_at(unit).map(|(_, depth)| Leaf { depth, edge: edge * (-f64::from(depth)).exp2() });
        let is_cut = self.boundary == Boundary::Mesh && own.is_none();
        let [lo, hi] = texture.value_range();
        let octree = texture.value_at(unit).filter(|_| !is_cut).map(|value| lo + f64::from(value) * (hi - lo));
        Sample { at, own, octree, cell, leaf }
    }

    /// What is at `count` places (at least 2) evenly along a line, its ends included.
    pub fn along(&self, ends: [DVec3; 2], count: usize, progress: &Progress) -> Result<LineSamples, Cancelled> {
        let count = count.max(2);
        progress.begin("probing", count as u64);
        let length = ends[0].distance(ends[1]);
        let part = |i: usize| i as f64 / (count - 1) as f64;
        let chunk = |chunk: usize| {
            progress.check()?;
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
            progress.add(range.len() as u64);
            Ok(range.map(|i| self.at(ends[0] * (1.0 - part(i)) + ends[1] * part(i))).collect::<Vec<_>>())
        };
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().map(chunk).collect::<Result<Vec<_>, Cancelled>>()?;
        Ok(LineSamples { arc_length: (0..count).map(|i| part(i) * length).collect(), samples: chunks.concat() })
    }
}

/// The names of a table's columns; of samples that lie on no line without the first.
const COLUMNS: [&str; 11] = ["arc_length", "x", "y", "z", "data", "octree", "difference", "cell", "cell_type", "leaf_depth", "leaf_edge"];

/// Writes samples as comma-separated values, one a row under a row of names: `arc_length` where they lie on a line, `x,y,z`, the values of
/// `data` and `octree` and their `difference` (NaN where there is none), the cell and the leaf (empty where there is none).
pub fn write_csv(path: &Path, samples: &[Sample], arc_length: Option<&[f64]>) -> io::Result<()> {
    write_atomically(path, |out| {
        writeln!(out, "{}", COLUMNS[usize::from(arc_length.is_none())..].join(","))?;
        for (i, sample) in samples.iter().enumerate() {
            if let Some(arc_length) = arc_length {
                write!(out, "{},", arc_length[i])?;
            }
            let [own, octree, difference] = [sample.own, sample.octree, sample.difference()].map(|v| v.unwrap_or(f64::NAN));
            write!(out, "{},{},{},{own},{octree},{difference},", sample.at.x, sample.at.y, sample.at.z)?;
            let (cell, shape) = sample.cell.map_or((String::new(), ""), |cell| (cell.number.to_string(), cell.shape));
            let (depth, edge) = sample.leaf.map_or_else(Default::default, |leaf| (leaf.depth.to_string(), leaf.edge.to_string()));
            writeln!(out, "{cell},{shape},{depth},{edge}")?;
        }
        Ok(())
    })
}

/// Writes samples as JSON: a list of objects with the names of [`write_csv`]'s columns, null where there is nothing.
pub fn write_json(path: &Path, samples: &[Sample], arc_length: Option<&[f64]>) -> io::Result<()> {
    let object = |(i, sample): (usize, &Sample)| {
        let mut object = json!({
            "at": sample.at.to_array(), "data": sample.own, "octree": sample.octree, "difference": sample.difference(),
            "cell": sample.cell.map(|cell| cell.number), "cell_type": sample.cell.map(|cell| cell.shape),
            "leaf_depth": sample.leaf.map(|leaf| leaf.depth), "leaf_edge": sample.leaf.map(|leaf| leaf.edge),
        });
        if let Some(arc_length) = arc_length {
            object["arc_length"] = arc_length[i].into();
        }
        object
    };
    let all = Value::Array(samples.iter().enumerate().map(object).collect());
    write_atomically(path, |out| writeln!(out, "{all:#}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{FieldSelection, ScalarField, collect};
    use crate::octree::OctreeParams;
    use crate::volume::{Grid, GridFrame, Samples};
    use std::sync::Arc;

    /// The unit cube with a linear field in it, and its octree.
    fn cube() -> (Subject, Locator, OctreeTexture) {
        let mesh = collect(&*plan(Shape::Cube, Some(6000)).expect("a size that can be made")).expect("valid");
        let field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a field");
        let locator = Locator::new(&mesh, &Progress::new()).expect("nobody cancels");
        let subject = Subject::Mesh(Arc::new(mesh), Arc::new(field));
        let params = OctreeParams { max_depth: 4, ..OctreeParams::default() };
        let tree = subject.regularize(&params, &Progress::new()).expect("room");
        (subject, locator, OctreeTexture::encode(&tree).expect("fits"))
    }

    #[test]
    fn a_linear_field_is_the_same_in_mesh_and_octree_along_a_line() {
        let (subject, locator, texture) = cube();
        let probe = Probe { subject: &subject, locator: Some(&locator), texture: &texture, boundary: Boundary::Mesh };
        let (a, b) = (DVec3::new(-0.5, 0.1, 0.2), DVec3::new(1.5, 0.7, 0.9));
        let line = probe.along([a, b], 701, &Progress::new()).expect("nobody cancels");
        assert_eq!((line.samples.len(), line.arc_length[0], line.samples[700].at), (701, 0.0, b));
        assert!((line.arc_length[700] - a.distance(b)).abs() < 1e-12);
        // The field at the ends of the part inside, and linear between.
        let inside: Vec<usize> = (0..701).filter(|&i| line.samples[i].own.is_some()).collect();
        assert_eq!((inside[0], inside[inside.len() - 1]), (175, 525), "x from 0 to 1");
        let value = |i: usize| line.samples[i].own.expect("inside");
        let [lo, hi] = subject.range();
        for &i in &inside {
            let part = (i - 175) as f64 / 350.0;
            let expected = value(175) + part * (value(525) - value(175));
            assert!((value(i) - expected).abs() < 1e-6 * (hi - lo), "sample {i}"); // values are stored in f32
            let difference = line.samples[i].difference().expect("both inside");
            assert!(difference.abs() < 2e-5 * (hi - lo), "{difference} at sample {i}");
            let leaf = line.samples[i].leaf.expect("a leaf");
            assert!((leaf.edge * f64::from(1 << leaf.depth) / texture.root_edge() - 1.0).abs() < 1e-12);
        }
        let outside = &line.samples[174];
        assert_eq!((outside.own, outside.octree, outside.cell), (None, None, None));
    }

    #[test]
    fn cells_are_those_of_the_file() {
        let (subject, locator, texture) = cube();
        let probe = Probe { subject: &subject, locator: Some(&locator), texture: &texture, boundary: Boundary::Mesh };
        let Subject::Mesh(mesh, _) = &subject else { panic!("a mesh") };
        for tet in [0, 17, mesh.tets().len() - 1] {
            let middle = mesh.corners(tet).iter().sum::<DVec3>() / 4.0 + mesh.center();
            assert_eq!(probe.at(middle).cell, Some(Cell { number: tet as u64, shape: "tetrahedron" }));
        }
    }

    #[test]
    fn a_volume_is_read_by_its_own_interpolation_and_tables_hold_every_digit() {
        let frame = GridFrame::along_axes([5, 4, 3], DVec3::new(2.0, 0.0, 0.0), DVec3::ONE);
        let values: Vec<f32> = (0..60).map(|i| (i % 5) as f32).collect();
        let subject = Subject::Volume(Arc::new(Grid::new(frame, "x".into(), Samples::F32(values.into())).expect("valid")));
        let tree = subject.regularize(&OctreeParams::default(), &Progress::new()).expect("room");
        let texture = OctreeTexture::encode(&tree).expect("fits");
        let probe = Probe { subject: &subject, locator: None, texture: &texture, boundary: Boundary::Mesh };
        let inside = probe.at(DVec3::new(5.3, 1.5, 1.0));
        assert!((inside.own.expect("inside") - 3.3).abs() < 1e-12 && inside.difference().expect("both").abs() < 1e-4, "{inside:?}");
        assert_eq!(inside.cell, Some(Cell { number: 3 + 4 * (1 + 3), shape: "voxel" }));
        let outside = probe.at(DVec3::ZERO);
        assert_eq!((outside.own, outside.octree, outside.cell), (None, None, None));

        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("points.csv");
        write_csv(&path, &[inside, outside], None).expect("written");
        let text = std::fs::read_to_string(&path).expect("a file");
        let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(rows[0], &COLUMNS[1..]);
        assert_eq!((rows[1][3].parse(), rows[1][6], rows[1][7]), (Ok(inside.own.expect("inside")), "19", "voxel"));
        assert_eq!(rows[2][3..8], ["NaN", "NaN", "NaN", "", ""]);
        write_json(&path, &[inside, outside], Some(&[0.0, 1.5])).expect("written");
        let read: Value = serde_json::from_str(&std::fs::read_to_string(&path).expect("a file")).expect("JSON");
        assert_eq!((read[0]["data"].as_f64(), read[1]["arc_length"].as_f64(), &read[1]["data"]), (inside.own, Some(1.5), &Value::Null));
    }
}
