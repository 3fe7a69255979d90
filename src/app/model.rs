//! What the window shows, and the long work that makes it: library calls, each to be run by a [`super::jobs::Job`].

use crate::format::{self, Series};
use crate::geometry::{Aabb, Placed};
use crate::image::{Background, Image, write_png};
use crate::mesh::{BoundarySurface, FieldSelection, ScalarField, TetMesh, generate};
use crate::octree::{Boundary, ErrorBound, OctreeParams, OctreeTexture, Subject, Unmet};
use crate::progress::Progress;
use crate::render::{Picture, Renderer, Scene};
use crate::session::Source;
use crate::study::probe::{LineSamples, write_csv};
use crate::study::tune::{Effort, Record, Sweep};
use crate::study::{Bins, ErrorSampling, FieldError, Histogram};
use crate::view::View;
use crate::volume::Grid;
use anyhow::{Context, Result, bail};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// An open mesh or volume.
#[derive(Clone)]
pub struct Document {
    /// The file's stem: title and name of screenshots.
    pub name: String,
    /// Where it was read from.
    pub source: Source,
    /// What the file holds.
    pub data: Data,
    /// The field shown first.
    pub field: FieldSelection,
    /// The series that it is a step of, or could be.
    pub time: InTime,
}

/// How a document stands in time.
#[derive(Clone, Default)]
pub enum InTime {
    /// By itself.
    #[default]
    Single,
    /// By itself, with so many files, itself among them, whose names are this pattern's with another number.
    Numbered(PathBuf, usize),
    /// The step of a series, by its number from 0.
    Step(Arc<Series>, usize),
}

impl InTime {
    /// That of what a source names, and the source of the file to read.
    pub fn of(source: &Source) -> Result<(InTime, Source)> {
        let Some(series) = source.series()? else {
            let siblings = source.file.as_deref().filter(|_| source.solution.is_none()).and_then(format::series::siblings);
            return Ok((siblings.map_or(InTime::Single, |(pattern, count)| InTime::Numbered(pattern, count)), source.clone()));
        };
        let (step, count, [first, last]) = (source.step.unwrap_or(series.shown_first()), series.steps().len(), series.span());
        let Some(chosen) = series.steps().get(step) else {
            let path = source.file.as_ref().map_or(String::new(), |path| path.display().to_string());
            bail!("{path}: has {count} steps, times {first} to {last}; there is no step {step}");
        };
        let file = source.at(&chosen.path);
        Ok((InTime::Step(Arc::new(series), step), file))
    }
}

/// What an open file holds. Copies share it.
#[derive(Clone)]
pub enum Data {
    /// A mesh with all its arrays.
    Mesh(Arc<TetMesh>),
    /// A volume of one array.
    Volume(Arc<Grid>),
}

impl Data {
    /// What a subject is of.
    pub fn of(subject: &Subject) -> Self {
        match subject {
            Subject::Mesh(mesh, _) => Data::Mesh(mesh.clone()),
            Subject::Volume(grid) => Data::Volume(grid.clone()),
        }
    }

    /// The mesh, if it is one.
    pub fn mesh(&self) -> Option<&Arc<TetMesh>> {
        match self {
            Data::Mesh(mesh) => Some(mesh),
            Data::Volume(_) => None,
        }
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        match self {
            Data::Mesh(mesh) => mesh.bytes() as u64,
            Data::Volume(grid) => grid.bytes() as u64,
        }
    }

    /// Smallest and largest value of one of its fields, data units.
    pub fn range(&self, selection: &FieldSelection) -> Result<[f64; 2]> {
        Ok(self.subject(selection)?.range())
    }

    /// One of its fields; a volume has only its own.
    pub fn subject(&self, selection: &FieldSelection) -> Result<Subject> {
        Ok(match self {
            Data::Mesh(mesh) => Subject::Mesh(mesh.clone(), Arc::new(ScalarField::select(mesh, selection)?)),
            Data::Volume(grid) => Subject::Volume(grid.clone()),
        })
    }
}

impl Placed for Data {
    fn center(&self) -> DVec3 {
        match self {
            Data::Mesh(mesh) => mesh.center(),
            Data::Volume(grid) => grid.center(),
        }
    }

    fn bounds(&self) -> Aabb {
        match self {
            Data::Mesh(mesh) => mesh.bounds(),
            Data::Volume(grid) => grid.bounds(),
        }
    }
}

/// A regularized field on the device, and its numbers.
pub struct OctreeModel {
    /// What the renderer draws.
    pub scene: Arc<Scene>,
    /// Of what.
    pub field: FieldSelection,
    /// How it was built.
    pub params: OctreeParams,
    /// Smallest and largest value of the field, data units.
    pub value_range: [f64; 2],
    /// Interior cells and full leaves.
    pub nodes: usize,
    /// Full leaves by depth, from depth 0.
    pub leaves_by_depth: Vec<usize>,
    /// Bytes of the texture.
    pub bytes: usize,
    /// The surface that rays are cut to, if they are.
    pub surface: Option<Arc<BoundarySurface>>,
    /// Where the tolerance is not met, if there is one.
    pub unmet: Option<Unmet>,
    /// Seconds from the mesh in memory to the encoded texture.
    pub build_s: f64,
    /// Seconds to copy it and the surface to the device.
    pub upload_s: f64,
}

/// How far an octree is from its field.
#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    /// As measured at random points.
    pub error: FieldError,
    /// What it exceeds nowhere; found after the rest. There is none for volumes that are turned against the world's axes.
    pub bound: Option<ErrorBound>,
    /// Whether nothing more will be found.
    pub is_complete: bool,
}

/// Steps of an exact picture, in the order in which they come.
pub enum ExactStep {
    /// The mesh is linked; this scene serves all views of the same field. If it lies on the device, no picture follows: it is marched.
    Linked(Arc<Scene>),
    /// A picture.
    Picture {
        /// What was drawn, perhaps smaller than asked for.
        picture: Picture,
        /// Whether it has the size asked for.
        complete: bool,
    },
}

/// Reads a mesh or a volume and checks that it carries the field to show within a budget of memory.
pub fn open(source: Source, field: &FieldSelection, memory_bytes: u64, progress: &Progress) -> Result<Document> {
    let (time, file) = InTime::of(&source)?;
    let (data, field) = read(&file, field, memory_bytes, progress)?;
    Ok(Document { name: file.stem(), source, data, field, time })
}

/// The same for a step of a series whose steps are known.
pub fn open_step(
    (series, step): (Arc<Series>, usize),
    source: &Source,
    field: &FieldSelection,
    memory_bytes: u64,
    progress: &Progress,
) -> Result<Document> {
    let file = source.at(&series.steps()[step].path);
    let (data, field) = read(&file, field, memory_bytes, progress)?;
    Ok(Document { name: file.stem(), source: Source { step: Some(step), ..source.clone() }, data, field, time: InTime::Step(series, step) })
}

/// The same for what is to be compared with a field of other data: its array of that name, or the file's first if it has none.
pub fn open_beside(source: Source, field: &FieldSelection, memory_bytes: u64, progress: &Progress) -> Result<Document> {
    let (time, file) = InTime::of(&source)?;
    let first = FieldSelection::default();
    // Volumes are read for one array only.
    let data = read_data(&file, field, memory_bytes, progress).or_else(|_| read_data(&file, &first, memory_bytes, progress))?;
    let field = if data.subject(field).is_ok() { field } else { &first };
    let field = check(&file, &data, field, memory_bytes)?;
    Ok(Document { name: file.stem(), source, data, field, time })
}

/// The data of one file, and the field to show.
fn read(source: &Source, field: &FieldSelection, memory_bytes: u64, progress: &Progress) -> Result<(Data, FieldSelection)> {
    let data = read_data(source, field, memory_bytes, progress)?;
    let field = check(source, &data, field, memory_bytes)?;
    Ok((data, field))
}

fn read_data(source: &Source, field: &FieldSelection, memory_bytes: u64, progress: &Progress) -> Result<Data> {
    let options = source.options(field.name.clone(), field.component, memory_bytes);
    Ok(match &source.file {
        Some(path) => match format::read(path, &options, progress)? {
            format::Data::Mesh(mesh) => Data::Mesh(Arc::new(mesh)),
            format::Data::Grid(grid) => Data::Volume(Arc::new(grid)),
        },
        None => Data::Mesh(Arc::new(format::read_embedded("wing.vtu", generate::WING_VTU, progress)?)),
    })
}

/// The field by its name, if the data has it and it can be regularized within a budget of memory.
fn check(source: &Source, data: &Data, field: &FieldSelection, memory_bytes: u64) -> Result<FieldSelection> {
    let at = || source.file.as_ref().map_or("the bundled mesh".into(), |path| path.display().to_string());
    let subject = data.subject(field).with_context(at)?;
    let need = subject.working_bytes();
    if need > memory_bytes {
        let mib = |bytes: u64| bytes >> 20;
        bail!("{}: regularizing it may take {} MiB, the budget is {} MiB (--memory)", at(), mib(need), mib(memory_bytes));
    }
    Ok(FieldSelection { name: Some(subject.array().to_owned()), component: field.component })
}

/// Regularizes a field and copies the texture to the device. `surface` is the mesh's for this field, if an octree before was built with it.
pub fn build_octree(
    renderer: &Renderer,
    data: &Data,
    selection: &FieldSelection,
    params: &OctreeParams,
    surface: Option<Arc<BoundarySurface>>,
    progress: &Progress,
) -> Result<OctreeModel> {
    let start = Instant::now();
    let subject = data.subject(selection)?;
    let tree = subject.regularize(params, progress)?;
    let texture = OctreeTexture::encode(&tree)?;
    let build_s = start.elapsed().as_secs_f64();
    progress.check()?;
    let bytes = texture.bytes();
    // A volume's hangs on the root cube, which another depth may change.
    let lasts = params.boundary == Boundary::Mesh && data.mesh().is_some();
    let surface = surface.filter(|_| lasts).or_else(|| subject.surface(&tree));
    progress.check()?;
    let (scene, upload_s) = renderer.octree_scene(data, texture, surface.clone())?;
    Ok(OctreeModel {
        scene: Arc::new(scene.with_mesh(data.mesh().cloned())),
        field: selection.clone(),
        value_range: subject.range(),
        nodes: tree.node_count(),
        leaves_by_depth: tree.leaves_by_depth(),
        bytes,
        surface,
        unmet: tree.unmet,
        params: tree.params,
        build_s,
        upload_s,
    })
}

/// Measures how far an octree's texture is from its field, how often by more than its tolerance, and bounds it. Gives
/// what was measured at once, and again with the bound.
pub fn measure(
    data: &Data,
    octree: &OctreeModel,
    sampling: &ErrorSampling,
    progress: &Progress,
    mut give: impl FnMut(Accuracy),
) -> Result<()> {
    let subject = data.subject(&octree.field)?;
    let texture = octree.scene.texture().context("the scene is no octree's")?;
    let sampling = ErrorSampling { tolerance: octree.params.tolerance, ..*sampling };
    let error = FieldError::of(&subject, texture, &sampling, progress)?;
    give(Accuracy { error: error.clone(), bound: None, is_complete: false });
    let bound = subject.error_bound(texture, progress)?;
    give(Accuracy { error, bound, is_complete: true });
    Ok(())
}

/// How often the values of a field occur, over several bins.
pub fn histograms<const N: usize>(data: &Data, field: &FieldSelection, bins: [Bins; N], progress: &Progress) -> Result<[Histogram; N]> {
    let subject = data.subject(field)?;
    let counted = bins.map(|bins| Histogram::of(&subject, bins, progress));
    // Each by itself, since arrays of results do not collect.
    let mut all = Vec::new();
    for histogram in counted {
        all.push(histogram?);
    }
    all.try_into().map_err(|_| anyhow::anyhow!("as many histograms as bins"))
}

/// Links the mesh, if there is no scene of it, and draws it, coarsely first, unless the device can.
pub fn draw_exact(
    renderer: &Renderer,
    mesh: &TetMesh,
    selection: &FieldSelection,
    scene: Option<Arc<Scene>>,
    view: &View,
    progress: &Progress,
    mut give: impl FnMut(ExactStep),
) -> Result<()> {
    let scene = match scene {
        Some(scene) => scene,
        None => {
            let field = ScalarField::select(mesh, selection)?;
            let scene = Arc::new(renderer.exact_scene(mesh, &field, progress)?);
            give(ExactStep::Linked(scene.clone()));
            scene
        }
    };
    if scene.is_on_device() {
        return Ok(());
    }
    for divisor in [8, 3, 1] {
        let mut view = view.clone();
        [view.settings.width, view.settings.height] = super::pace::divided([view.settings.width, view.settings.height], divisor);
        let picture = renderer.render(&scene, &view, progress)?;
        give(ExactStep::Picture { picture, complete: divisor == 1 });
    }
    Ok(())
}

/// Draws a scene as `octetra render` would and writes it to the first free `NAME_00.png`, `NAME_01.png`, ... of a folder. `finish` paints
/// what belongs over the picture and says what lies behind it.
pub fn save_picture(
    renderer: &Renderer,
    scene: &Scene,
    view: &View,
    finish: impl FnOnce(&mut Image) -> Background,
    (folder, name): (&Path, &str),
    progress: &Progress,
) -> Result<PathBuf> {
    let mut image: Image = renderer.render(scene, view, progress)?.image;
    let background = finish(&mut image);
    let path = free_path(folder, name, "png");
    write_png(&path, &image, background)?;
    Ok(path)
}

/// Writes the samples of a line to the first free `NAME_line_00.csv`, `NAME_line_01.csv`, ... of a folder.
pub fn save_profile(profile: &LineSamples, folder: &Path, name: &str) -> Result<PathBuf> {
    let path = free_path(folder, &format!("{name}_line"), "csv");
    write_csv(&path, &profile.samples, Some(&profile.arc_length)).with_context(|| path.display().to_string())?;
    Ok(path)
}

/// The first of `NAME_00.SUFFIX`, `NAME_01.SUFFIX`, ... in a folder that there is not.
fn free_path(folder: &Path, name: &str, suffix: &str) -> PathBuf {
    (0..).map(|n| folder.join(format!("{name}_{n:02}.{suffix}"))).find(|path| !path.exists()).expect("numbers do not end")
}

/// Measures settings that a record does not hold yet, giving the record after each. One of other views is begun anew.
pub fn tune(
    renderer: &Renderer,
    data: &Data,
    selection: &FieldSelection,
    view: &View,
    settings: &[OctreeParams],
    memory_bytes: u64,
    record: Option<Record>,
    progress: &Progress,
    mut give: impl FnMut(&Record),
) -> Result<()> {
    let subject = data.subject(selection)?;
    let error = ErrorSampling { points: TUNE_POINTS, ..ErrorSampling::default() };
    let effort = Effort { builds: 1, frames: 3, error, memory_bytes };
    let views = std::slice::from_ref(view);
    let sweep = Sweep { of: &subject, renderer, views, effort };
    let of = sweep.subject();
    let mut record = record.filter(|record| record.subject == of).unwrap_or_else(|| Record::new(of));
    sweep.run(settings, &mut record, progress, |record| {
        give(record);
        Ok::<(), anyhow::Error>(())
    })
}

/// Points at which a sweep measures the error of each setting.
const TUNE_POINTS: usize = 1 << 17;
