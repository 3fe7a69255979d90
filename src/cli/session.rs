//! `--session FILE`: what a session says, unless a flag says otherwise.

use super::args::{MeshArgs, OctreeArgs, RawArgs, ViewArgs, threshold_flags};
use super::segy::{SEGY, SegyArgs};
use crate::session::Session;
use crate::view::{Camera, RenderSettings, Shading, TransferFunction};
use anyhow::{Context, Result};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, Parser};
use std::path::PathBuf;

/// `--session`, and which flags stand beside it. It has to come first in a command: who takes values takes their sources along.
#[derive(Debug, Clone, Default)]
pub struct SessionArgs {
    file: Option<PathBuf>,
    given: Given,
}

/// The names of the arguments that were typed.
#[derive(Debug, Clone, Default)]
pub struct Given(Vec<String>);

/// What a session says of the view, as far as no flag does.
#[derive(Debug, Clone)]
pub struct SessionView {
    /// From where; `None`: the orbit or what flags say.
    pub camera: Option<Camera>,
    /// Colours and opacity, if no flag names others.
    pub transfer_function: Option<TransferFunction>,
    settings: RenderSettings,
    given: Given,
}

const CAMERA: [&str; 3] = ["camera", "orbit", "zoom"];
const RAW: [&str; 4] = ["dims", "voxel", "spacing", "big_endian"];
const ISOSURFACES: [&str; 3] = ["iso", "iso_opacity", "iso_color"];
const PLANES: [&str; 4] = ["clip", "cut", "cut_opacity", "cut_edges"];
const FACES: [&str; 4] = ["faces", "face_opacity", "face_color", "face_edges"];
const PHONG: [&str; 5] = ["light", "ambient", "diffuse", "specular", "shininess"];
const THRESHOLDS: [&str; 10] = [
    "preset",
    "max_depth",
    "max_leaf_tets",
    "max_leaf_variance",
    "initial_cell_tets",
    "tolerance",
    "initial_depth",
    "sampling",
    "boundary",
    "reconstruction",
];

impl Given {
    /// Whether any of these arguments was typed.
    pub fn any(&self, names: &[&str]) -> bool {
        self.0.iter().any(|given| names.contains(&given.as_str()))
    }

    /// Settings of a session with what flags say otherwise.
    fn settings(&self, flags: RenderSettings, session: RenderSettings) -> RenderSettings {
        let mut settings = session;
        let mut take = |names: &[&str], set: fn(&mut RenderSettings, &RenderSettings)| {
            if self.any(names) {
                set(&mut settings, &flags);
            }
        };
        take(&["size"], |to, from| (to.width, to.height) = (from.width, from.height));
        take(&["renderer"], |to, from| to.renderer = from.renderer);
        take(&["steps"], |to, from| to.steps = from.steps);
        take(&["step"], |to, from| to.step_world = from.step_world);
        take(&["voxels"], |to, from| to.voxels = from.voxels);
        take(&["skip"], |to, from| to.skip = from.skip);
        take(&["intervals"], |to, from| to.intervals = from.intervals);
        take(&["mode"], |to, from| to.mode = from.mode);
        take(&ISOSURFACES, |to, from| to.isosurfaces = from.isosurfaces);
        take(&PLANES, |to, from| to.planes = from.planes);
        take(&FACES, |to, from| to.faces = from.faces);
        take(&["shade"], |to, from| to.shading = Shading { phong: to.shading.phong, ..from.shading });
        take(&PHONG, |to, from| to.shading.phong = from.shading.phong);
        settings
    }
}

impl SessionView {
    /// Settings with what flags say otherwise.
    pub fn settings(&self, flags: RenderSettings) -> RenderSettings {
        self.given.settings(flags, self.settings)
    }
}

impl SessionArgs {
    /// Reads the session, if there is one, and puts what it says where no flag says otherwise. Thresholds, the data's file, the camera,
    /// isosurfaces, planes, boundary faces and Phong's numbers are taken from flags or the session as a whole.
    pub fn apply(&self, mesh: &mut MeshArgs, raw: &mut RawArgs, octree: &mut OctreeArgs, view: &mut ViewArgs) -> Result<Option<Session>> {
        let Some(path) = &self.file else { return Ok(None) };
        let session = Session::read(path)?;
        let given = &self.given;
        if !given.any(&["mesh"]) {
            mesh.mesh = session.data.file.clone();
            mesh.more = session.data.more.clone();
            if !given.any(&["time", "time_step"]) {
                mesh.steps.time_step = session.data.step;
            }
            if !given.any(&["solution"]) {
                mesh.solution = session.data.solution.clone();
            }
            if !given.any(&RAW) {
                *raw = RawArgs { segy: raw.segy.clone(), ..RawArgs::of(session.data.raw.as_ref()) };
            }
            if !given.any(&SEGY) {
                raw.segy = SegyArgs::of(&session.data.segy);
            }
        }
        if !given.any(&["array"]) {
            mesh.array = session.array.clone();
        }
        if !given.any(&["component"]) {
            mesh.component = session.component;
        }
        if !given.any(&THRESHOLDS) {
            *octree = thresholds(&session)?;
        }
        view.session = Some(SessionView {
            camera: session.camera.filter(|_| !given.any(&CAMERA)),
            transfer_function: Some(session.transfer_function.clone()).filter(|_| !given.any(&["tf"])),
            settings: session.render,
            given: given.clone(),
        });
        Ok(Some(session))
    }

    /// Whether any of these arguments was typed.
    pub fn gives(&self, names: &[&str]) -> bool {
        self.given.any(names)
    }

    /// The session's file.
    pub fn file(&self) -> Option<&PathBuf> {
        self.file.as_ref()
    }
}

/// A session's thresholds as flags have them.
fn thresholds(session: &Session) -> Result<OctreeArgs> {
    #[derive(Parser)]
    struct Thresholds {
        #[command(flatten)]
        octree: OctreeArgs,
    }
    let flags = std::iter::once("thresholds".to_owned()).chain(threshold_flags(&session.thresholds));
    Ok(Thresholds::try_parse_from(flags).context("thresholds")?.octree)
}

impl FromArgMatches for SessionArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = |id: &&clap::Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
        let given = matches.ids().filter(typed).map(|id| id.as_str().to_owned()).collect();
        Ok(SessionArgs { file: matches.get_one::<PathBuf>("session").cloned(), given: Given(given) })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for SessionArgs {
    fn augment_args(command: Command) -> Command {
        let help = "Session file (JSON), as the window saves it: data, thresholds, camera, colours, mode; flags go before what it says, those of one kind as a whole: thresholds, the camera, isosurfaces, planes, faces, Phong";
        command.arg(Arg::new("session").long("session").value_name("FILE").value_parser(clap::value_parser!(PathBuf)).help(help))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Mode, Phong, Skip, Steps};

    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        session: SessionArgs,
        #[command(flatten)]
        mesh: MeshArgs,
        #[command(flatten)]
        view: ViewArgs,
        #[command(flatten)]
        octree: OctreeArgs,
        #[command(flatten)]
        raw: RawArgs,
    }

    fn applied(session: &Session, flags: &str) -> Flags {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("session.json");
        session.write(&path).expect("written");
        let path = path.to_string_lossy().into_owned();
        let mut parsed = Flags::parse_from(["x", "--session", &path].into_iter().chain(flags.split_whitespace()));
        parsed.session.apply(&mut parsed.mesh, &mut parsed.raw, &mut parsed.octree, &mut parsed.view).expect("applied");
        parsed
    }

    fn session() -> Session {
        let phong = Phong { ambient: 0.1, ..Phong::default() };
        Session {
            array: Some("speed".into()),
            thresholds: crate::octree::Preset::Paper.params(),
            render: RenderSettings {
                mode: Mode::Minimum,
                steps: Steps::Fixed,
                step_world: Some(0.25),
                skip: Skip::Half,
                shading: Shading { volume: true, surfaces: false, phong },
                ..RenderSettings::new(70, 50)
            },
            ..Session::default()
        }
    }

    #[test]
    fn a_session_says_everything_where_no_flag_does() {
        let flags = applied(&session(), "");
        assert_eq!(flags.view.settings(), session().render);
        assert_eq!(flags.octree.params(), session().thresholds);
        assert_eq!(flags.mesh.array.as_deref(), Some("speed"));
    }

    #[test]
    fn flags_go_before_it() {
        let flags = applied(&session(), "--size 9x8 --mode mip --max-depth 4 --array p --ambient 0.5 --tf turbo --orbit 2 flow.vtu");
        let phong = Phong { ambient: 0.5, ..Phong::default() };
        let shading = Shading { phong, ..session().render.shading };
        let expected = RenderSettings { width: 9, height: 8, mode: Mode::Maximum, shading, ..session().render };
        assert_eq!(flags.view.settings(), expected);
        assert_eq!(flags.octree.params().max_depth, 4);
        assert_eq!((flags.mesh.array.as_deref(), flags.mesh.stem().as_str()), (Some("p"), "flow"));
        let (transfer_function, camera) = flags.view.files().expect("no files");
        assert_eq!((transfer_function, camera), (TransferFunction::preset("turbo").expect("a preset"), None));
    }

    /// Every flag of a view is one that a session yields to, or says nothing of what is drawn.
    #[test]
    fn no_flag_is_overlooked() {
        #[derive(Parser)]
        struct ViewFlags {
            #[command(flatten)]
            view: ViewArgs,
        }
        use clap::CommandFactory;
        let others = ["tf", "size", "renderer", "device", "steps", "step", "voxels", "skip", "intervals", "mode", "xray", "shade", "help"];
        // Changes of the session's own transfer function.
        let changes = ["range", "threshold", "scale", "unit_distance", "discrete", "opacity_scale"];
        let known = [&CAMERA[..], &ISOSURFACES, &PLANES, &FACES, &PHONG, &others, &changes].concat();
        for arg in ViewFlags::command().get_arguments() {
            assert!(known.contains(&arg.get_id().as_str()), "--{} beside --session", arg.get_id());
        }
    }
}
