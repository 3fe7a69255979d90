//! Flags that several subcommands share, and what they stand for.

use super::long_work::with_bar;
use super::mode::ModeArgs;
use super::segy::SegyArgs;
use super::session::SessionView;
use super::steps::StepArgs;
use super::transfer::TransferArgs;
use super::usage::usage;
use crate::format::{self, RawLayout, ReadOptions, SolutionFile};
use crate::furniture;
use crate::geometry::Placed;
use crate::mesh::{Component, FieldSelection, ScalarField, TetMesh, generate};
use crate::octree::{Boundary, OctreeParams, Preset, Reconstruction, Sampling, Subject};
use crate::progress::Progress;
use crate::render::DeviceChoice;
use crate::view::{Camera, Intervals, RenderSettings, RendererKind, Skip, Steps, TransferFunction, View};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A mesh or a volume, and one of its fields.
#[derive(Debug, Clone, Args)]
pub struct MeshArgs {
    /// The mesh or volume; without one, the bundled wing. A series: a .pvd or .series file, 'flow_*.vtu', or several files
    pub mesh: Option<PathBuf>,
    /// More files: the steps of a series, by the numbers in their names
    #[arg(value_name = "MORE")]
    pub more: Vec<PathBuf>,
    /// Point or cell array to show [default: the file's active scalars, else the first array]
    #[arg(long, value_name = "NAME")]
    pub array: Option<String>,
    /// What to take of a vector
    #[arg(long, value_name = "magnitude|x|y|z|N", default_value = "magnitude", value_parser = Component::from_str)]
    pub component: Component,
    /// The solution of a PLOT3D grid [default: beside it, NAME.q or NAME.f of NAME.x or NAME.xyz, NAMEq.bin of NAMExyz.bin or NAMEx.bin]
    #[arg(long, value_name = "FILE")]
    pub solution: Option<PathBuf>,
    /// Budget for the memory of mesh and octree, such as 8GiB [default: three quarters of the machine's]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub memory: Option<u64>,
    #[command(flatten)]
    pub steps: StepArgs,
}

impl MeshArgs {
    /// What the mesh is called: its file's stem, or the bundled mesh's.
    pub fn stem(&self) -> String {
        let stem = self.mesh.as_deref().and_then(Path::file_stem);
        stem.map_or("wing".into(), |s| s.to_string_lossy().into_owned())
    }

    /// The file's name as errors begin with it.
    pub fn shown_name(&self) -> String {
        self.mesh.as_deref().map_or("the bundled mesh".into(), |path| path.display().to_string())
    }

    /// Reads the mesh; a volume is refused.
    pub fn read(&self) -> Result<TetMesh> {
        let mesh = match &self.mesh {
            Some(path) => with_bar(|progress| format::read_mesh_with(path, &self.options(), progress))?,
            None => format::read_embedded("wing.vtu", generate::WING_VTU, &Progress::new())?,
        };
        Ok(mesh)
    }

    /// How the file is to be read, if it is no plain bytes.
    pub fn options(&self) -> ReadOptions {
        let component = match self.component {
            Component::Magnitude => None,
            Component::Index(index) => Some(index),
        };
        let solution = self.solution.clone().map_or(SolutionFile::Beside, SolutionFile::At);
        ReadOptions { array: self.array.clone(), component, memory_bytes: self.budget_bytes(), solution, ..Default::default() }
    }

    /// Picks the field.
    pub fn field(&self, mesh: &TetMesh) -> Result<ScalarField> {
        let selection = FieldSelection { name: self.array.clone(), component: self.component };
        ScalarField::select(mesh, &selection).with_context(|| self.shown_name())
    }

    /// What a subject's values are: the array's name, with component and unit.
    pub fn title(&self, subject: &Subject) -> String {
        let components = match subject {
            Subject::Mesh(mesh, field) => {
                mesh.point_data().iter().chain(mesh.cell_data()).find(|a| a.name == field.name).map_or(1, |a| a.components)
            }
            Subject::Volume(_) => 1,
        };
        let name = || match self.component {
            Component::Magnitude => "magnitude".to_owned(),
            Component::Index(i @ 0..3) if components <= 3 => ["x", "y", "z"][i].into(),
            Component::Index(i) => i.to_string(),
        };
        furniture::title(subject.array(), (components > 1).then(name).as_deref())
    }

    /// The budget in bytes.
    pub fn budget_bytes(&self) -> u64 {
        self.memory.unwrap_or_else(|| {
            // A system that does not say how much memory it has sets no limit.
            let Ok(mut system) = sysinfo::System::new() else { return u64::MAX };
            system.refresh_memory();
            let total = system.cgroup_limits().map_or(system.total_memory(), |limits| limits.total_memory);
            total / 4 * 3
        })
    }

    /// `Err` if regularizing this mesh may take more than the budget.
    pub fn check_budget(&self, mesh: &TetMesh) -> Result<()> {
        self.check_bytes(&format!("{} tets", mesh.tets().len()), mesh.bytes() as u64 + crate::octree::working_bytes(mesh))
    }

    /// `Err` if regularizing what may take so many bytes would exceed the budget.
    pub fn check_bytes(&self, what: &str, need: u64) -> Result<()> {
        let limit = self.budget_bytes();
        if need > limit {
            let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
            bail!("regularizing {what} may take {:.2} MiB, the budget is {:.2} MiB; raise it with --memory", mib(need), mib(limit));
        }
        Ok(())
    }
}

/// What a header would say of a volume of plain bytes.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Raw volumes")]
pub struct RawArgs {
    /// The file is plain bytes: so many points along x (fastest), y and z
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_dims, requires = "voxel")]
    pub dims: Option<[u32; 3]>,
    /// Type of its numbers
    #[arg(long = "type", id = "voxel", value_name = "TYPE", requires = "dims", value_parser = clap::builder::PossibleValuesParser::new(RawLayout::TYPES))]
    pub voxel: Option<String>,
    /// Distance between its points, world units [default: 1,1,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_spacing, requires = "dims")]
    pub spacing: Option<[f64; 3]>,
    /// The most significant byte comes first
    #[arg(long, requires = "dims")]
    pub big_endian: bool,
    #[command(flatten)]
    pub segy: SegyArgs,
}

impl RawArgs {
    /// The flags that stand for a layout.
    pub fn of(layout: Option<&RawLayout>) -> Self {
        RawArgs {
            dims: layout.map(|layout| layout.dims),
            voxel: layout.map(|layout| layout.voxel.to_owned()),
            spacing: layout.map(|layout| layout.spacing),
            big_endian: layout.is_some_and(|layout| layout.is_big_endian),
            segy: SegyArgs::default(),
        }
    }

    /// The layout, if the file is one of plain bytes.
    pub fn layout(&self) -> Option<RawLayout> {
        let voxel = RawLayout::TYPES.into_iter().find(|name| Some(*name) == self.voxel.as_deref())?;
        Some(RawLayout { dims: self.dims?, voxel, spacing: self.spacing.unwrap_or([1.0; 3]), is_big_endian: self.big_endian })
    }

    /// The flags again.
    pub fn flags(&self) -> Vec<String> {
        fn joined<T: ToString>(numbers: [T; 3]) -> String {
            numbers.map(|n| n.to_string()).join(",")
        }
        let flags = [("--dims", self.dims.map(joined)), ("--type", self.voxel.clone()), ("--spacing", self.spacing.map(joined))];
        let with_values = flags.into_iter().filter_map(|(flag, value)| Some([flag.to_owned(), value?])).flatten();
        with_values.chain(self.big_endian.then(|| "--big-endian".to_owned())).chain(self.segy.flags()).collect()
    }
}

/// The subdivision thresholds.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Thresholds")]
pub struct OctreeArgs {
    /// Named settings, which single values override: paper (its own sampling), fast, balanced, fine
    #[arg(long, value_name = "NAME", default_value = "balanced", value_parser = parse_preset)]
    pub preset: Option<Preset>,
    /// Dmax: no cell is deeper than this
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u8).range(1..=i64::from(OctreeParams::DEPTH_LIMIT)))]
    pub max_depth: Option<u8>,
    /// V: a cell with fewer tets is a leaf
    #[arg(long, value_name = "V")]
    pub max_leaf_tets: Option<u32>,
    /// W: a cell whose vertices' values, in [0, 1], have a smaller variance is a leaf
    #[arg(long, value_name = "W", value_parser = parse_not_negative)]
    pub max_leaf_variance: Option<f64>,
    /// U: cells are divided uniformly down to the first depth d with tets / 8^d < U
    #[arg(long, value_name = "U", value_parser = parse_positive, conflicts_with = "initial_depth")]
    pub initial_cell_tets: Option<f64>,
    /// R: refine until the reconstruction is estimated to be within R of the field, in parts of its range, wherever Dmax allows
    #[arg(long, value_name = "R", value_parser = parse_not_negative)]
    pub tolerance: Option<f64>,
    /// The uniform depth itself
    #[arg(long, value_name = "D0", value_parser = clap::value_parser!(u8).range(1..=i64::from(OctreeParams::DEPTH_LIMIT)))]
    pub initial_depth: Option<u8>,
    /// What a sample is [default: the preset's]
    #[arg(long, value_enum)]
    pub sampling: Option<SamplingArg>,
    /// Where the volume ends, and what leaves are that the mesh's surface cuts [default: the preset's]
    #[arg(long, value_enum)]
    pub boundary: Option<BoundaryArg>,
    /// What the field is between samples [default: the preset's]
    #[arg(long, value_enum)]
    pub reconstruction: Option<ReconstructionArg>,
}

/// Values of `--sampling`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum SamplingArg {
    /// By inverse distance to the leaf's tets: the mesh's own value inside it
    Tets,
    /// By inverse distance to their vertices: the paper's
    Vertices,
    /// The mean over a leaf's box where that holds many tets, else as tets
    Average,
}

/// Values of `--boundary`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum BoundaryArg {
    /// Leaves are full if any tet overlaps them: the paper read literally
    Cells,
    /// Leaves are full if their centre lies in the mesh
    Centres,
    /// Rays enter and leave exactly at the mesh's surface
    Mesh,
}

/// Values of `--reconstruction`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ReconstructionArg {
    /// Trilinear between samples at the leaves' corners, without a jump anywhere
    Continuous,
    /// One sample a leaf: the paper's
    Leaf,
}

impl OctreeArgs {
    /// The parameters: the preset's, overridden one by one.
    pub fn params(&self) -> OctreeParams {
        let base = self.preset.unwrap_or(Preset::Balanced).params();
        // Who tunes V or W wants them to decide.
        let by_thresholds = self.max_leaf_tets.is_some() || self.max_leaf_variance.is_some();
        let base = if by_thresholds && self.tolerance.is_none() { base.by_thresholds() } else { base };
        OctreeParams {
            initial_cell_tets: self.initial_cell_tets.unwrap_or(base.initial_cell_tets),
            initial_depth: self.initial_depth.or(base.initial_depth),
            max_leaf_tets: self.max_leaf_tets.unwrap_or(base.max_leaf_tets),
            max_leaf_variance: self.max_leaf_variance.unwrap_or(base.max_leaf_variance),
            tolerance: self.tolerance.or(base.tolerance),
            max_depth: self.max_depth.unwrap_or(base.max_depth),
            sampling: self.sampling.map_or(base.sampling, |s| match s {
                SamplingArg::Tets => Sampling::Tets,
                SamplingArg::Vertices => Sampling::Vertices,
                SamplingArg::Average => Sampling::Average,
            }),
            boundary: self.boundary.map_or(base.boundary, |b| match b {
                BoundaryArg::Cells => Boundary::Cells,
                BoundaryArg::Centres => Boundary::Centres,
                BoundaryArg::Mesh => Boundary::Mesh,
            }),
            reconstruction: self.reconstruction.map_or(base.reconstruction, |r| match r {
                ReconstructionArg::Continuous => Reconstruction::Continuous,
                ReconstructionArg::Leaf => Reconstruction::Leaf,
            }),
        }
    }
}

/// Flags that [`OctreeArgs`] reads as these parameters: depth and tolerance, or V and W, and what else differs from the default; the name
/// of a preset that is not told by a tolerance.
pub fn threshold_flags(params: &OctreeParams) -> Vec<String> {
    let by_thresholds = params.tolerance.is_none();
    let preset = Preset::ALL.iter().find(|(_, preset)| by_thresholds && preset.params() == *params);
    if let Some((name, _)) = preset {
        return vec!["--preset".into(), (*name).into()];
    }
    // Naming V or W turns a default tolerance off.
    let base = if by_thresholds { OctreeParams::default().by_thresholds() } else { OctreeParams::default() };
    let name = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
    let flags = [
        ("--max-depth", Some(params.max_depth.to_string())),
        ("--tolerance", params.tolerance.map(|r| r.to_string())),
        ("--max-leaf-tets", (by_thresholds || params.max_leaf_tets != base.max_leaf_tets).then(|| params.max_leaf_tets.to_string())),
        (
            "--max-leaf-variance",
            (by_thresholds || params.max_leaf_variance != base.max_leaf_variance).then(|| params.max_leaf_variance.to_string()),
        ),
        (
            "--initial-cell-tets",
            (params.initial_depth.is_none() && params.initial_cell_tets != base.initial_cell_tets)
                .then(|| params.initial_cell_tets.to_string()),
        ),
        ("--initial-depth", params.initial_depth.map(|d| d.to_string())),
        ("--sampling", (params.sampling != base.sampling).then(|| name(&params.sampling))),
        ("--boundary", (params.boundary != base.boundary).then(|| name(&params.boundary))),
        ("--reconstruction", (params.reconstruction != base.reconstruction).then(|| name(&params.reconstruction))),
    ];
    flags.into_iter().filter_map(|(flag, value)| Some([flag.to_owned(), value?])).flatten().collect()
}

/// Camera, transfer function, march.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "View")]
pub struct ViewArgs {
    /// Image size in pixels
    #[arg(long, value_name = "N|WxH", default_value = "512", value_parser = parse_size)]
    pub size: [u32; 2],
    /// View of the standard orbit, 0 to 11
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..12))]
    pub orbit: u32,
    /// Come closer on the orbit by this factor
    #[arg(long, value_name = "Z", default_value_t = 1.0, value_parser = parse_positive)]
    pub zoom: f64,
    /// Camera file (JSON), instead of the orbit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["orbit", "zoom"])]
    pub camera: Option<PathBuf>,
    /// The octree texture, or the mesh itself
    #[arg(long, value_enum, default_value = "octree")]
    pub renderer: RendererArg,
    /// Where to draw: auto takes the best GPU, and the CPU where there is none or only a software adapter, which takes longer
    #[arg(long, value_enum, default_value = "auto")]
    pub device: DeviceArg,
    /// Where samples lie: leaf by leaf, by the paper's rule, or a fixed step apart
    #[arg(long, value_enum, default_value = "leaf")]
    pub steps: StepsArg,
    /// Initial step L_s at depth 1 in world units [default: half the octree's edge]; with --steps fixed the step itself [default: the
    /// finest cell's edge]
    #[arg(long, value_name = "L_S", value_parser = parse_positive)]
    pub step: Option<f64>,
    /// With --steps fixed on a GPU: sample a 3D texture of voxels, as fine as the octree's finest cells, in place of the octree
    #[arg(long)]
    pub voxels: bool,
    /// How to get past what is not seen: none, octree (from leaf to leaf of which something is), bounds (from the first of them to the
    /// last), encoding (a compact texture of them, with --steps fixed), half (bounds in each
    /// half of the volume), half=ray (in each half of a ray), k=N (in N parts of a ray) [default: octree; none with --steps paper]
    #[arg(long, value_name = "WAY", value_parser = Skip::from_str)]
    pub skip: Option<Skip>,
    /// Where bounds, half and k=N get first and last leaves from
    #[arg(long, value_enum, default_value = "compute")]
    pub intervals: IntervalsArg,
    #[command(flatten)]
    pub mode: ModeArgs,
    #[command(flatten)]
    pub transfer: TransferArgs,
    /// What a session says where no flag does.
    #[arg(skip)]
    pub session: Option<SessionView>,
}

/// Values of `--renderer`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RendererArg {
    /// The octree texture.
    Octree,
    /// The mesh itself.
    Exact,
}

/// Values of `--device`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum DeviceArg {
    /// GPU if there is one that is no software adapter, else CPU.
    Auto,
    /// GPU or an error.
    Gpu,
    /// CPU.
    Cpu,
}

/// Values of `--steps`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum StepsArg {
    /// Leaf by leaf.
    Leaf,
    /// The paper's rule.
    Paper,
    /// One step everywhere.
    Fixed,
}

/// Values of `--intervals`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum IntervalsArg {
    /// A compute pass that follows each ray.
    Compute,
    /// The boxes of active leaves, rasterised.
    Raster,
}

impl From<DeviceArg> for DeviceChoice {
    fn from(arg: DeviceArg) -> Self {
        match arg {
            DeviceArg::Auto => DeviceChoice::Auto,
            DeviceArg::Gpu => DeviceChoice::Gpu,
            DeviceArg::Cpu => DeviceChoice::Cpu,
        }
    }
}

impl ViewArgs {
    /// `Err` if flags contradict each other.
    fn check(&self) -> Result<()> {
        let settings = self.settings();
        self.mode.check(&settings)?;
        if self.skip == Some(Skip::Encoding) && settings.steps != Steps::Fixed {
            bail!("--skip encoding marches voxels by one step; add --steps fixed");
        }
        if settings.steps == Steps::Paper && !matches!(self.skip, None | Some(Skip::None)) {
            bail!("--steps paper chains samples from the ray's beginning, nothing can be skipped; --skip needs --steps leaf or fixed");
        }
        if self.voxels && settings.steps != Steps::Fixed {
            bail!("--voxels are marched by one step; add --steps fixed");
        }
        Ok(())
    }

    /// The camera file, if one was named.
    fn camera_file(&self) -> Result<Option<Camera>> {
        self.camera.as_deref().map(|path| read_json(path, "a camera")).transpose()
    }

    /// The files that a view is made from, read and checked before any long work.
    pub fn files(&self) -> Result<(TransferFunction, Option<Camera>)> {
        usage(self.check())?;
        let session = self.session.as_ref();
        let transfer_function = self.transfer.read(session.and_then(|session| session.transfer_function.as_ref()))?;
        Ok((transfer_function, self.camera_file()?.or(session.and_then(|session| session.camera))))
    }

    /// The view of a mesh or a volume.
    pub fn view(&self, data: &impl Placed, (transfer_function, camera): (TransferFunction, Option<Camera>)) -> View {
        let orbit = || Camera::orbit(data.bounds().translated(data.center()), self.orbit, self.zoom);
        let transfer_function = self.transfer.scaled(transfer_function, data.bounds().diagonal());
        View { camera: camera.unwrap_or_else(orbit), transfer_function, settings: self.settings() }
    }

    /// The settings: what flags say, and what a session says where they do not.
    pub fn settings(&self) -> RenderSettings {
        let flags = RenderSettings {
            renderer: match self.renderer {
                RendererArg::Octree => RendererKind::Octree,
                RendererArg::Exact => RendererKind::Exact,
            },
            steps: match self.steps {
                StepsArg::Leaf => Steps::Leaf,
                StepsArg::Paper => Steps::Paper,
                StepsArg::Fixed => Steps::Fixed,
            },
            step_world: self.step,
            voxels: self.voxels,
            skip: self.skip.unwrap_or_default(),
            intervals: match self.intervals {
                IntervalsArg::Compute => Intervals::Compute,
                IntervalsArg::Raster => Intervals::Raster,
            },
            ..self.mode.settings(RenderSettings::new(self.size[0], self.size[1]))
        };
        let Some(session) = &self.session else { return flags };
        let settings = session.settings(flags);
        RenderSettings { mode: self.mode.of_xray(settings.mode), ..settings }
    }
}

/// Reads a JSON file; errors name file, line and column.
pub fn read_json<T: serde::de::DeserializeOwned>(path: &Path, what: &str) -> Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| format!("{}: not {what}", path.display()))
}

/// Fails early if outputs cannot be written where they are to go, or if one would overwrite another or the mesh.
pub fn check_outputs(mesh: &MeshArgs, outputs: &[Option<&PathBuf>]) -> Result<()> {
    let named = [(mesh.mesh.as_deref(), "the mesh"), (mesh.solution.as_deref(), "its solution"), (mesh.list(), "the list of the steps")];
    let steps = mesh.series().into_iter().flat_map(|series| series.steps()).map(|step| (step.path.as_path(), "a step of the series"));
    let inputs: Vec<(&Path, &str)> = named.into_iter().filter_map(|(path, what)| Some((path?, what))).chain(steps).collect();
    check_outputs_beside(&inputs, outputs)
}

/// Fails early if outputs cannot be written where they are to go, or if one would overwrite another or an input, which is named as told.
pub fn check_outputs_beside(inputs: &[(&Path, &str)], outputs: &[Option<&PathBuf>]) -> Result<()> {
    let same = |a: &Path, b: &Path| a == b || b.canonicalize().ok().is_some_and(|b| a.canonicalize().ok() == Some(b));
    let outputs: Vec<&Path> = outputs.iter().flatten().map(|path| path.as_path()).collect();
    for (i, &path) in outputs.iter().enumerate() {
        if let Some((_, what)) = inputs.iter().find(|(input, _)| same(input, path)) {
            bail!("{}: is {what}, an output would overwrite it", path.display());
        }
        if outputs[..i].iter().any(|other| same(other, path)) {
            bail!("{}: two outputs would go to this one file", path.display());
        }
        check_writable(path)?;
    }
    Ok(())
}

/// Fails early if a file cannot be written where it is to go.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        bail!("{}: is a folder, expected a file to write", path.display());
    }
    if path.exists() && !path.is_file() {
        return Ok(()); // a device or a pipe is written to as it is
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match tempfile::Builder::new().prefix(".octetra-").tempfile_in(folder) {
        Ok(_) => Ok(()),
        Err(e) => bail!("{}: the folder cannot be written to ({})", path.display(), e.kind()),
    }
}

fn parse_preset(text: &str) -> Result<Preset, String> {
    let names = || Preset::ALL.map(|(name, _)| name).join(", ");
    Preset::ALL.iter().find(|(name, _)| *name == text).map(|&(_, p)| p).ok_or_else(|| format!("expected one of {}", names()))
}

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |t: &str| t.parse::<u32>().ok().filter(|n| (1..=32768).contains(n));
    let sides = match text.split_once('x') {
        Some((w, h)) => side(w).zip(side(h)),
        None => side(text).map(|n| (n, n)),
    };
    sides.map(|(w, h)| [w, h]).ok_or_else(|| "expected N or WxH with sides of 1 to 32768 pixels".into())
}

fn parse_dims(text: &str) -> Result<[u32; 3], String> {
    let parts: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok().filter(|&n| n >= 2)).collect();
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(|| "expected X,Y,Z, each an integer from 2".into())
}

fn parse_spacing(text: &str) -> Result<[f64; 3], String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|n| parse_positive(n.trim()).ok()).collect();
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(|| "expected X,Y,Z, each a number above 0".into())
}

/// A finite number that is valid, or an error that says what was expected.
pub fn parse_number(text: &str, valid: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|v| v.is_finite() && valid(*v)).ok_or_else(|| format!("expected {expected}"))
}

pub fn parse_positive(text: &str) -> Result<f64, String> {
    parse_number(text, |v| v > 0.0, "a number above 0")
}

/// A number from 0.
pub fn parse_not_negative(text: &str) -> Result<f64, String> {
    parse_number(text, |v| v >= 0.0, "a number from 0")
}

/// `R,G,B` with numbers in [0, 1].
pub fn parse_color(text: &str) -> Result<[f32; 3], String> {
    let parts: Vec<f32> = text.split(',').filter_map(|t| t.trim().parse().ok()).filter(|v| (0.0..=1.0).contains(v)).collect();
    <[f32; 3]>::try_from(parts).ok().filter(|_| text.matches(',').count() == 2).ok_or_else(|| "expected R,G,B, each in [0, 1]".into())
}

pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let (digits, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len()));
    let shift = match unit.trim() {
        "" | "B" => 0,
        "KiB" => 10,
        "MiB" => 20,
        "GiB" => 30,
        _ => return Err("expected a number with an optional suffix KiB, MiB or GiB".into()),
    };
    parse_positive(digits).map(|n| (n * f64::from(1u32 << shift)) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tune::Plan;
    use clap::Parser;

    #[derive(Parser)]
    struct Thresholds {
        #[command(flatten)]
        octree: OctreeArgs,
    }

    #[test]
    fn flags_stand_for_what_they_were_made_from() {
        let odd = OctreeParams { initial_depth: Some(3), sampling: Sampling::Average, boundary: Boundary::Cells, ..Default::default() };
        let both = OctreeParams { tolerance: Some(1e-7), max_leaf_tets: 5, initial_cell_tets: 7.5, ..Default::default() };
        for params in [Plan::full().settings(), vec![odd, both]].concat() {
            let flags = threshold_flags(&params);
            let back = Thresholds::parse_from(std::iter::once("x".to_owned()).chain(flags.clone())).octree.params();
            assert_eq!(back, params, "{flags:?}");
        }
    }

    #[test]
    fn values_are_read_as_people_write_them() {
        assert_eq!((parse_size("300"), parse_size("640x480")), (Ok([300, 300]), Ok([640, 480])));
        assert!(parse_size("0").is_err() && parse_size("10x").is_err() && parse_size("1x2x3").is_err());
        assert_eq!((parse_bytes("1.5GiB"), parse_bytes("4096")), (Ok(3 << 29), Ok(4096)));
        assert!(parse_bytes("5 parsecs").is_err() && parse_bytes("-1").is_err());
        assert_eq!(parse_color("0,0.5,1"), Ok([0.0, 0.5, 1.0]));
        assert!(parse_color("0,0.5").is_err() && parse_color("0,2,1").is_err() && parse_color("0,x,1").is_err());
        assert_eq!("z".parse(), Ok(Component::Index(2)));
    }
}
