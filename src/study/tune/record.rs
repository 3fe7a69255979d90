//! What a sweep measured, of what and on what: a JSON file that a later sweep of the same continues.

use super::{Dropped, Effort, Pick, Row, front};
use crate::image::write_atomically;
use crate::mesh::{ScalarField, TetMesh};
use crate::octree::Subject;
use crate::render::Renderer;
use crate::view::View;
use crate::volume::{Grid, Voxel, with_voxels};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io;
use std::path::{Path, PathBuf};

/// Rows, and what they are of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// What was measured and on what.
    pub subject: RecordSubject,
    /// The settings measured, in the order of their measurement.
    pub rows: Vec<Row>,
    /// Settings that the last sweep did not measure.
    pub dropped: Vec<Dropped>,
}

/// All that must agree for two measurements to stand in one table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordSubject {
    /// octetra's version.
    pub version: String,
    /// The mesh by its numbers and a hash of points, tets and the field's values: `{points, tets, hash}`; a volume as `{dims, type, hash}`.
    pub mesh: Value,
    /// The field: `{array, range}`.
    pub field: Value,
    /// Cameras, size, transfer function and march.
    pub views: Value,
    /// Builds, frames and points of each setting.
    pub effort: Value,
    /// Processor, its threads that are used, operating system, and the adapter that draws.
    pub machine: Value,
}

/// Why a record could not be read, written or continued.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The system said no.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The file holds something else.
    #[error("{}: not a record that this version of octetra tune wrote ({cause}); name another file", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the parser said.
        cause: serde_json::Error,
    },
    /// The file is of another subject.
    #[error("{}: holds measurements of another {what} ({found}), expected {expected}; name another file to keep both", path.display())]
    Subject {
        /// The file.
        path: PathBuf,
        /// "mesh", "field", ...
        what: &'static str,
        /// What it holds.
        found: String,
        /// What it should hold.
        expected: String,
    },
}

impl RecordSubject {
    pub(super) fn new(of: &Subject, views: &[View], effort: &Effort, renderer: &Renderer) -> Self {
        let views: Vec<Value> = views
            .iter()
            .map(|view| {
                json!({
                    "camera": view.camera, "width": view.settings.width, "height": view.settings.height,
                    "transfer_function": view.transfer_function, "steps": format!("{:?}", view.settings.steps).to_lowercase(),
                    "step": view.settings.step_world, "min_transmittance": view.settings.min_transmittance, "mode": view.settings.mode.to_string(),
                    "isosurfaces": view.settings.isosurfaces, "planes": view.settings.planes, "faces": view.settings.faces, "shading": view.settings.shading,
                })
            })
            .collect();
        RecordSubject {
            version: env!("CARGO_PKG_VERSION").into(),
            mesh: match of {
                Subject::Mesh(mesh, field) => {
                    json!({ "points": mesh.points().len(), "tets": mesh.tets().len(), "hash": hash(mesh, field) })
                }
                Subject::Volume(grid) => {
                    json!({ "dims": grid.frame().dims, "type": grid.samples().type_name(), "hash": grid_hash(grid) })
                }
            },
            field: json!({ "array": of.array(), "range": of.range() }),
            views: views.into(),
            effort: json!({ "builds": effort.builds, "frames": effort.frames, "points": effort.error.points, "seed": effort.error.seed }),
            machine: json!({
                "processor": processor(), "threads": rayon::current_num_threads(), "os": std::env::consts::OS,
                "arch": std::env::consts::ARCH, "adapter": renderer.adapter(),
            }),
        }
    }

    /// What differs first between two subjects, as (name, of the one, of the other).
    fn difference(&self, other: &RecordSubject) -> Option<(&'static str, String, String)> {
        let version = |subject: &RecordSubject| Value::from(subject.version.as_str());
        let all = [
            ("version of octetra", version(self), version(other)),
            ("mesh", self.mesh.clone(), other.mesh.clone()),
            ("field", self.field.clone(), other.field.clone()),
            ("set of views", self.views.clone(), other.views.clone()),
            ("effort", self.effort.clone(), other.effort.clone()),
            ("machine", self.machine.clone(), other.machine.clone()),
        ];
        let (name, a, b) = all.into_iter().find(|(_, a, b)| a != b)?;
        Some((name, in_short(&a, &b), in_short(&b, &a)))
    }
}

/// What of `value` differs from `other`, as text that fits a line.
fn in_short(value: &Value, other: &Value) -> String {
    match (value, other) {
        (Value::Object(a), Value::Object(b)) => {
            let differing = a.iter().filter(|(key, value)| b.get(*key) != Some(value));
            differing.map(|(key, value)| format!("{key} {}", in_short(value, &b[key]))).collect::<Vec<_>>().join(", ")
        }
        (Value::Array(a), Value::Array(b)) => match a.iter().zip(b).find(|(a, b)| a != b) {
            Some((a, b)) if a.is_object() => in_short(a, b),
            _ if a.first().is_some_and(Value::is_object) => format!("{} of them", a.len()),
            _ => value.to_string(),
        },
        _ => value.to_string(),
    }
}

impl Record {
    /// An empty record.
    pub fn new(subject: RecordSubject) -> Self {
        Record { subject, rows: Vec::new(), dropped: Vec::new() }
    }

    /// The record in a file, to be continued, which must be of this subject; an empty one if there is no such file or nothing in it.
    pub fn open(path: &Path, subject: RecordSubject) -> Result<Self, RecordError> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => String::new(),
            Err(cause) => return Err(RecordError::Io { path: path.into(), cause }),
        };
        if text.trim().is_empty() {
            return Ok(Self::new(subject));
        }
        let record: Record = serde_json::from_str(&text).map_err(|cause| RecordError::Format { path: path.into(), cause })?;
        match record.subject.difference(&subject) {
            Some((what, found, expected)) => Err(RecordError::Subject { path: path.into(), what, found, expected }),
            None => Ok(record),
        }
    }

    /// Writes the record, with the indices of the rows on the front and of the recommended ones.
    pub fn write(&self, path: &Path, picks: &[Pick]) -> Result<(), RecordError> {
        let recommended: Vec<Value> =
            picks.iter().map(|pick| json!({ "as": pick.name, "row": pick.row, "meets_goal": pick.meets_goal })).collect();
        let content = json!({
            "subject": self.subject, "rows": self.rows, "dropped": self.dropped, "front": front(&self.rows), "recommended": recommended,
        });
        write_atomically(path, |out| writeln!(out, "{content:#}")).map_err(|cause| RecordError::Io { path: path.into(), cause })
    }
}

/// The processor's name; empty where the system does not say.
fn processor() -> String {
    let Ok(mut system) = sysinfo::System::new() else { return String::new() };
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    system.cpus().first().map_or(String::new(), |cpu| cpu.brand().trim().to_owned())
}

/// A hash of the points, the tets and the field's values (FNV-1a over words of 64 bits), as hexadecimal text.
fn hash(mesh: &TetMesh, field: &ScalarField) -> String {
    let points = mesh.points().iter().flat_map(|p| p.to_array().map(f64::to_bits));
    let tets = mesh.tets().iter().flat_map(|t| t.map(u64::from));
    let values = field.values.iter().map(|v| v.to_bits());
    fnv(points.chain(tets).chain(values))
}

/// The same of a volume's place and numbers.
fn grid_hash(grid: &Grid) -> String {
    let frame = grid.frame();
    let place = frame.origin.to_array().into_iter().chain(frame.steps.to_cols_array()).map(f64::to_bits);
    with_voxels!(grid.samples(), values => fnv(place.chain(values.iter().map(|v| v.to_f64().to_bits()))))
}

fn fnv(words: impl Iterator<Item = u64>) -> String {
    let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", words.fold(0xcbf2_9ce4_8422_2325, mix))
}

#[cfg(test)]
mod tests {
    use super::super::sweep::tests::row;
    use super::*;
    use crate::geometry::Placed;
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{FieldSelection, collect};
    use crate::progress::Progress;
    use crate::render::DeviceChoice;
    use crate::study::ErrorSampling;
    use crate::study::tune::{Plan, Sweep, TuneError};
    use crate::view::{Camera, RenderSettings, TransferFunction};
    use std::sync::Arc;

    const EFFORT: Effort =
        Effort { builds: 1, frames: 1, error: ErrorSampling { points: 10_000, seed: 1, tolerance: None }, memory_bytes: 1 << 30 };

    fn ball(tets: u64, change: f64) -> Subject {
        let mesh = collect(&*plan(Shape::Ball, Some(tets)).expect("a size that can be made")).expect("valid");
        let mut field = ScalarField::select(&mesh, &FieldSelection::default()).expect("a field");
        field.values[3] += change;
        Subject::Mesh(Arc::new(mesh), Arc::new(field))
    }

    fn views(mesh: &impl Placed, size: u32) -> Vec<View> {
        let camera = Camera::orbit(mesh.bounds().translated(mesh.center()), 0, 1.0);
        vec![View { camera, transfer_function: TransferFunction::standard(), settings: RenderSettings::new(size, size) }]
    }

    #[test]
    fn a_record_comes_back_and_only_its_own_subject_continues_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("tune.json");
        let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
        let mesh = ball(2000, 0.0);
        let subject = |mesh: &Subject, size| RecordSubject::new(mesh, &views(mesh, size), &EFFORT, &renderer);
        let mut record = Record::open(&path, subject(&mesh, 16)).expect("a new one");
        record.rows = vec![row(100, 40.123456789012345, 0.1 + 0.2, 1.0 / 3.0)];
        record.write(&path, &[]).expect("written");
        assert_eq!(Record::open(&path, subject(&mesh, 16)).expect("its own"), record, "every digit");

        let said = |subject| Record::open(&path, subject).expect_err("another subject").to_string();
        let of_mesh = said(subject(&ball(4000, 0.0), 16));
        assert!(of_mesh.contains("tune.json") && of_mesh.contains("another mesh") && of_mesh.contains("tets"), "{of_mesh}");
        let of_views = said(subject(&mesh, 17));
        assert!(of_views.contains("views (width 16, height 16), expected width 17"), "{of_views}");
        assert!(said(subject(&ball(2000, 1e-9), 16)).contains("hash"), "the same numbers of points and tets");
        std::fs::write(&path, "{\"rows\": []}").expect("written");
        assert!(said(subject(&mesh, 16)).contains("not a record"));
    }

    #[test]
    fn a_sweep_measures_what_the_record_lacks_and_keeps_what_it_has() {
        let mesh = ball(2000, 0.0);
        let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
        let progress = Progress::new();
        let views = views(&mesh, 24);
        let sweep = |memory_bytes| {
            let effort = Effort { memory_bytes, ..EFFORT };
            Sweep { of: &mesh, renderer: &renderer, views: &views, effort }
        };
        let plan = Plan { tolerances: vec![], depths: vec![], variances: vec![1e-2, 1e-4], variance_depths: vec![3, 4] };
        let settings = plan.settings();
        let mut record = Record::new(sweep(1 << 30).subject());
        // Stopped after three rows.
        let mut each = |record: &Record| if record.rows.len() < 3 { Ok(()) } else { Err(TuneError::from(crate::progress::Cancelled)) };
        sweep(1 << 30).run(&settings, &mut record, &progress, &mut each).expect_err("stopped");
        assert_eq!(record.rows.len(), 3);
        let mut measured = 0;
        let mut count = |_: &Record| -> Result<(), TuneError> {
            measured += 1;
            Ok(())
        };
        let before = record.rows.clone();
        sweep(1 << 30).run(&settings, &mut record, &progress, &mut count).expect("done");
        assert_eq!((record.rows.len(), measured), (settings.len(), settings.len() - 3));
        assert_eq!(record.rows[..3], before, "not measured again");
        assert!(record.rows.iter().all(|r| r.psnr_db > 15.0 && r.rmse_rel > 0.0 && r.rmse_rel < r.max_rel && r.build_s > 0.0));

        let mut small = Record::new(record.subject.clone());
        let nothing = TransferFunction { opacity: vec![[0.0, 0.0]], ..TransferFunction::standard() };
        let unseen = [View { transfer_function: nothing, ..views[0].clone() }];
        let found = Sweep { views: &unseen, ..sweep(1 << 30) }.run(&settings, &mut small, &progress, |_| Ok::<(), TuneError>(()));
        assert_eq!(found, Err(TuneError::Unseen { view: 0 }));
        assert!(small.dropped.is_empty() && small.rows.is_empty());
    }

    #[test]
    fn what_does_not_fit_is_dropped_and_so_is_what_is_finer() {
        let (mesh, renderer) = (ball(2000, 0.0), Renderer::new(DeviceChoice::Cpu).expect("the CPU"));
        let effort = Effort { memory_bytes: 1, ..EFFORT };
        let sweep = Sweep { of: &mesh, renderer: &renderer, views: &views(&mesh, 24), effort };
        let plan = Plan { tolerances: vec![], depths: vec![], variances: vec![1e-2, 1e-4], variance_depths: vec![3, 4] };
        let settings = plan.settings();
        let mut small = Record::new(sweep.subject());
        sweep.run(&settings, &mut small, &Progress::new(), |_| Ok::<(), TuneError>(())).expect("nothing fits, which is no error");
        assert_eq!((small.rows.len(), small.dropped.len()), (0, settings.len()));
        assert!(small.dropped.iter().any(|d| d.reason.contains("coarser")) && small.dropped.iter().all(|d| d.too_large));
    }

    #[test]
    fn a_volume_is_swept_by_its_field() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("tune.json");
        let renderer = Renderer::new(DeviceChoice::Cpu).expect("the CPU");
        let shell = |n| Subject::Volume(Arc::new(crate::volume::generate::shell(n).expect("valid")));
        let of = shell(24);
        let views = views(&of, 24);
        let sweep = Sweep { of: &of, renderer: &renderer, views: &views, effort: EFFORT };
        let plan = Plan { tolerances: vec![0.2, 0.02], depths: vec![3, 5], variances: vec![], variance_depths: vec![] };
        let mut record = Record::open(&path, sweep.subject()).expect("a new one");
        sweep.run(&plan.settings(), &mut record, &Progress::new(), |_| Ok::<(), TuneError>(())).expect("done");
        assert!(record.rows.len() > 3 && record.rows.iter().all(|row| row.psnr_db_by_view.is_empty() && row.frame_s > 0.0));
        for row in &record.rows {
            assert!((row.psnr_db + 20.0 * row.rmse_rel.log10()).abs() < 1e-9, "{row:?}");
        }
        let at =
            |tolerance, max_depth| record.rows.iter().find(|r| r.params.tolerance == Some(tolerance) && r.params.max_depth == max_depth);
        let (coarse, fine) = (at(0.2, 3).expect("measured"), at(0.02, 5).expect("measured"));
        assert!(fine.psnr_db > coarse.psnr_db + 6.0 && fine.bytes > coarse.bytes, "{coarse:?} {fine:?}");
        record.write(&path, &[]).expect("written");
        assert_eq!(Record::open(&path, sweep.subject()).expect("its own"), record);
        let other = shell(25);
        let error = Record::open(&path, Sweep { of: &other, ..sweep }.subject()).expect_err("another volume").to_string();
        assert!(error.contains("another mesh") && error.contains("dims"), "{error}");
    }
}
