//! `octetra render`: a mesh or a volume into a picture.

mod over_time;

use super::args::{MeshArgs, OctreeArgs, RawArgs, ViewArgs, check_outputs, check_outputs_beside, parse_color};
use super::long_work::with_bar;
use super::report::Report;
use super::sequence::{Sequence, SequenceArgs};
use super::session::SessionArgs;
use super::subject::{read_subject, regularized};
use super::usage::usage;
use crate::furniture::{self, Furniture, Parts};
use crate::geometry::Placed;
use crate::gpu::OctreeVolume;
use crate::image::{Background, Image, write_npy, write_png, write_values_npy};
use crate::octree::{ErrorBound, OctreeTexture, Subject, Unmet};
use crate::render::{Renderer, Scene};
use crate::study::{ErrorSampling, FieldError};
use crate::view::{Camera, Mode, PlaneUse, RendererKind, Skip, TransferFunction, View};
use anyhow::{Context, Error, Result, anyhow, bail};
use clap::Args;
use glam::{DVec2, DVec3};
use over_time::RangeOver;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What a view is made from: colours and opacity, and the camera if a file says it.
type ViewFiles = (TransferFunction, Option<Camera>);

/// `octetra render`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderCommand {
    #[command(flatten)]
    session: SessionArgs,
    #[command(flatten)]
    mesh: MeshArgs,
    /// The picture [default: the mesh's name with .png, in the current folder]
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
    /// Colour behind the volume, linear RGB in [0, 1]
    #[arg(long, value_name = "R,G,B", default_value = "0,0,0", value_parser = parse_color)]
    background: [f32; 3],
    /// Keep the picture's alpha instead
    #[arg(long, conflicts_with = "background")]
    transparent: bool,
    /// Draw around the picture: bar (the scalar bar), axes (the orientation axes), box (the bounding box with ticks); several with commas
    /// between them, all or none. Not into --raw
    #[arg(long, value_name = "PARTS", default_value = "none")]
    furniture: Parts,
    /// Pixels a point of it, as a session has it.
    #[arg(skip)]
    furniture_scale: Option<f64>,
    #[command(flatten)]
    octree: OctreeArgs,
    #[command(flatten)]
    volume: RawArgs,
    #[command(flatten)]
    sequence: SequenceArgs,
    /// With a series: where no range is named, colours span the values of all steps, for which each is read (time), or each step's own
    /// (step) [default: time where every step is drawn, else step]
    #[arg(long, value_name = "time|step", value_enum, help_heading = "Time series")]
    range_over: Option<RangeOver>,
    /// Also write the float image: float32, height x width x 4, premultiplied RGBA
    #[arg(long, value_name = "OUT.npy", help_heading = "Output")]
    raw: Option<PathBuf>,
    /// Also write the number that --mode mip, minip or xray shows: float32, height x width, data units, NaN where rays miss
    #[arg(long, value_name = "OUT.npy", help_heading = "Output")]
    value: Option<PathBuf>,
    /// Also write the distance from the eye to the first isosurface: float32, height x width, world units, NaN where there is none
    #[arg(long, value_name = "OUT.npy", help_heading = "Output")]
    depth: Option<PathBuf>,
    /// Also write what was measured
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    stats: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  octetra render -o wing.png                               the bundled mesh
  octetra render flow.vtu --orbit 3 --array momentum --component x
  octetra render flow.vtu --renderer exact -o exact.png    the mesh itself, to compare with
  octetra render flow.vtu --iso 1.2,2.5 --iso-opacity 0.4,1        surfaces of equal value in the volume
  octetra render flow.vtu --clip y=0 --cut z=1 --cut-opacity 0.7   what lies at y >= 0, and a plane in the colours of the values
  octetra render flow.vtu --mode mip --value largest.npy           the largest value on each ray, and the numbers
  octetra render flow.vtu --preset fine --stats fine.json
  octetra render flow.vtu --furniture bar,axes,box --background 1,1,1
  octetra render --session flow.json --size 2560x1600      what the window showed, larger
  octetra render flow.pvd --time 0.5                       a step of a series; 'flow_*.vtu' is one, too
  octetra render flow.pvd -o flow_{i}.png                  every step: flow_000.png, ...
  octetra render flow.vtu --turntable 120 -o turn_{i}.png  a full turn, turn_000.png to turn_119.png
  octetra render scan.nhdr --tf bone.json                  a volume: .nrrd, .nhdr, .mhd, .mha, .vti, .vtk
  octetra render wing.xyz                                  a PLOT3D grid, its solution in wing.q
  octetra render scan.raw --dims 256,256,178 --type u8     plain bytes
  octetra render flow.vtu --max-depth 10 --max-leaf-tets 4 --max-leaf-variance 1e-4";

impl RenderCommand {
    /// Reads, regularizes, draws, writes.
    pub fn run(mut self) -> Result<()> {
        self.take_session()?;
        self.mesh.choose_step()?;
        let sequence = self.sequence.sequence(self.output.as_deref(), &self.mesh.stem())?;
        let output = self.output.clone().unwrap_or_else(|| format!("{}.png", self.mesh.stem()).into());
        let numbers = [self.raw.as_ref(), self.value.as_ref(), self.depth.as_ref()];
        if sequence.is_some() && numbers.iter().any(Option::is_some) {
            return usage(Err(anyhow!("--raw, --value and --depth are of one picture; a sequence has many")));
        }
        let every_step = self.every_step()?;
        let pictures = every_step.clone().unwrap_or_else(|| sequence.as_ref().map_or_else(|| vec![output.clone()], Sequence::files));
        // All pictures of a sequence go to one folder under names of their own.
        let [first, last] = [pictures.first(), pictures.last().filter(|_| pictures.len() > 1)];
        let outputs: Vec<Option<&PathBuf>> = [first, last].into_iter().chain(numbers).chain([self.stats.as_ref()]).collect();
        check_outputs(&self.mesh, &outputs)?;
        let tf = Path::new(self.view.transfer.tf.as_str());
        let inputs = [
            (self.session.file().map(PathBuf::as_path), "the session"),
            (self.view.camera.as_deref(), "the camera"),
            (self.sequence.camera_path.as_deref(), "the camera's way"),
            (Some(tf).filter(|tf| tf.is_file()), "the transfer function"),
        ];
        let inputs: Vec<(&Path, &str)> = inputs.into_iter().filter_map(|(path, what)| Some((path?, what))).collect();
        check_outputs_beside(&inputs, &outputs)?;
        if let Some(stats) = self.stats.as_ref().filter(|stats| pictures[1..].contains(stats)) {
            bail!("{}: two outputs would go to this one file", stats.display());
        }
        usage(self.check_numbers())?;
        let files = self.view.files()?;
        if every_step.is_some() {
            return self.draw_steps(&pictures, files);
        }

        let start = Instant::now();
        let subject = read_subject(&self.mesh, &self.volume)?;
        let mut report = Report::new(&subject, start.elapsed().as_secs_f64());
        let mut view = self.view.view(&subject, files);
        self.fix_range(&mut view, &subject, RangeOver::Step)?;
        view.transfer_function.check_range(subject.range()).with_context(|| self.mesh.shown_name())?;
        say_what_is_not_seen(&view, &subject);
        report.params(&self.mesh, subject.array(), &self.octree, Some((&self.view, &view)))?;
        report.set("params", "background", if self.transparent { json!("transparent") } else { json!(self.background) });
        report.set("params", "furniture", self.furniture.to_string());

        let renderer = Renderer::new(self.view.device.into())?;
        say_if_fallen_back(&renderer);
        let scene = self.scene(&renderer, &subject, &mut report)?;
        let background = if self.transparent { Background::Transparent } else { Background::Color(self.background) };
        if let Some(sequence) = sequence {
            let views = sequence.cameras(view.camera).into_iter().map(|camera| View { camera, ..view.clone() });
            let pictures: Vec<(View, PathBuf)> = views.zip(pictures).collect();
            let finish = |image: &mut Image, camera: &Camera| {
                self.furnish(image, &subject, &View { camera: *camera, ..view.clone() });
                background
            };
            let start = Instant::now();
            with_bar(|progress| renderer.write_sequence(&scene, &pictures, finish, progress))?;
            report.set("time", "sequence", start.elapsed().as_secs_f64());
            report.set("params", "pictures", pictures.len());
            return self.stats.as_deref().map(|path| report.write(path)).transpose().map(|_| ());
        }
        let mut picture = with_bar(|progress| renderer.render(&scene, &view, progress))?;
        report.picture(&renderer, &scene, &picture);
        if self.stats.is_some() {
            let is_least = view.settings.skip() == Skip::Octree && !view.settings.is_through_voxels();
            let needed = if is_least { picture.samples } else { with_bar(|progress| renderer.samples_needed(&scene, &view, progress))? };
            report.set("samples", "needed", needed.filter(|_| scene.texture().is_some()));
            report.set("samples", "active_leaves", renderer.active_leaves(&scene, &view));
        }

        self.raw.as_deref().map(|path| write_npy(path, &picture.image)).transpose()?;
        self.write_numbers(&renderer, &scene, &view)?;
        self.furnish(&mut picture.image, &subject, &view);
        write_png(&output, &picture.image, background)?;
        self.stats.as_deref().map(|path| report.write(path)).transpose()?;
        Ok(())
    }

    /// Takes what a session says and no flag does.
    fn take_session(&mut self) -> Result<()> {
        let session = self.session.apply(&mut self.mesh, &mut self.volume, &mut self.octree, &mut self.view)?;
        let Some(session) = session else { return Ok(()) };
        if !self.session.gives(&["background", "transparent"]) {
            (self.background, self.transparent) = (session.background, session.transparent);
        }
        if !self.session.gives(&["furniture"]) {
            self.furniture = if session.furniture_in_pictures { session.furniture } else { Parts::NONE };
        }
        if !self.session.gives(&["size"]) {
            self.furniture_scale = session.furniture_scale;
        }
        Ok(())
    }

    /// `Err` if numbers are asked for that the mode has not.
    fn check_numbers(&self) -> Result<()> {
        let settings = self.view.settings();
        let mode = settings.mode;
        if self.value.is_some() && !mode.is_number() {
            bail!("--value writes the number that --mode mip, minip or xray shows of each ray; the mode is {mode}");
        }
        if self.depth.is_some() && settings.surfaces().is_empty() {
            bail!("--depth writes the distance to the first isosurface; say which with --iso V");
        }
        Ok(())
    }

    /// Writes what of the rays is no colour.
    fn write_numbers(&self, renderer: &Renderer, scene: &Scene, view: &View) -> Result<()> {
        if self.value.is_none() && self.depth.is_none() {
            return Ok(());
        }
        let numbers = with_bar(|progress| renderer.numbers(scene, view, progress))?;
        let shape = [numbers.height, numbers.width].map(u64::from);
        for (path, values) in [(&self.value, &numbers.values), (&self.depth, &numbers.depths)] {
            if let Some(path) = path {
                write_values_npy(path, &shape, values).with_context(|| path.display().to_string())?;
            }
        }
        Ok(())
    }

    /// Draws what is asked for around the picture. Letters grow with it.
    fn furnish(&self, image: &mut Image, subject: &Subject, view: &View) {
        let size = DVec2::new(f64::from(image.width), f64::from(image.height));
        let scale = self.furniture_scale.unwrap_or_else(|| (size.min_element() / 600.0).max(1.0));
        let is_integral = view.settings.mode == Mode::Integral;
        let title = self.mesh.title(subject);
        let range = subject.range();
        let drawing = Furniture {
            parts: self.furniture,
            title: if is_integral { format!("integral of {title}") } else { title },
            value_range: if is_integral { Mode::integral_range(range, subject.bounds().diagonal()) } else { range },
            transfer_function: &view.transfer_function,
            camera: &view.camera,
            bounds: subject.bounds().translated(subject.center()),
            background: self.background,
            frame_time: None,
        };
        furniture::paint(image, &drawing.drawing(size / scale), scale);
    }

    /// What is drawn: the octree texture, built here, or the mesh itself.
    fn scene(&self, renderer: &Renderer, subject: &Subject, report: &mut Report) -> Result<Scene> {
        if self.view.settings().renderer == RendererKind::Exact {
            let Subject::Mesh(mesh, field) = subject else {
                return Err(no_exact_volume(&self.mesh));
            };
            let scene = with_bar(|progress| renderer.exact_scene(mesh, field, progress))?;
            if let Some(reason) = scene.fell_back() {
                note(&format!("{}; drawing on the CPU", one_line(&reason.to_string())));
            }
            report.set("exact", "bytes", scene.exact_bytes());
            return Ok(scene);
        }
        let start = Instant::now();
        let tree = regularized(&self.mesh, subject, &self.octree.params())?;
        if tree.leaf_count() == 0 {
            note("no leaf's centre lies in the mesh, the picture is empty; --boundary mesh draws it");
        }
        let texture = OctreeTexture::encode(&tree)?;
        report.set("time", "regularize", start.elapsed().as_secs_f64());
        report.octree(&tree, &texture, subject.center());
        if let (Some(unmet), Some(_)) = (&tree.unmet, self.octree.tolerance) {
            note(&unmet_in_words(unmet, subject.center()));
        }
        if self.stats.is_some() {
            measure_error(subject, &texture, tree.params.tolerance, report)?;
        }
        let start = Instant::now();
        let surface = subject.surface(&tree);
        if let Some(surface) = &surface {
            report.set("boundary", "bytes", surface.bytes());
            report.set("boundary", "faces", surface.faces().len());
            report.set("time", "boundary", start.elapsed().as_secs_f64());
        } else if self.view.settings().drawn_faces().is_some() {
            note("--faces draws the surface that rays are cut to, and there is none here; --boundary mesh has one");
        }
        let (scene, upload_s) = renderer.octree_scene(subject, texture, surface)?;
        report.set("time", "upload", upload_s);
        report.set("octree", "activity_bytes", scene.volume().map(OctreeVolume::activity_bytes));
        Ok(scene.with_mesh(subject.mesh().cloned()))
    }
}

/// Why a volume is not drawn exactly.
pub fn no_exact_volume(args: &MeshArgs) -> Error {
    anyhow!("{}: --renderer exact draws tetrahedral meshes; this is a volume, which --renderer octree draws", args.shown_name())
}

/// Measures how far the octree is from the field, and bounds it where that can be; reports both.
pub fn measure_error(
    subject: &Subject,
    texture: &OctreeTexture,
    tolerance: Option<f64>,
    report: &mut Report,
) -> Result<(FieldError, Option<ErrorBound>)> {
    let start = Instant::now();
    let sampling = ErrorSampling { tolerance, ..Default::default() };
    let error = with_bar(|progress| FieldError::of(subject, texture, &sampling, progress))?;
    let measured = Instant::now();
    let bound = with_bar(|progress| subject.error_bound(texture, progress))?;
    report.error(&error, (measured - start).as_secs_f64());
    if let Some(bound) = bound {
        report.set("error", "bound_rel", bound.bound_rel);
        report.set("error", "bound_at", (bound.at + subject.center()).to_array().to_vec());
        report.set("time", "bound", measured.elapsed().as_secs_f64());
    }
    Ok((error, bound))
}

/// Where a tolerance is not met.
pub fn unmet_in_words(unmet: &Unmet, center: DVec3) -> String {
    let at = unmet.at + center;
    let (percent, leaves) = (f64::from(unmet.worst_rel) * 100.0, unmet.leaves);
    format!(
        "the tolerance is not met in {leaves} leaves of the greatest depth; the worst, at ({:.4}, {:.4}, {:.4}), may be off by {percent:.2} % of the range",
        at.x, at.y, at.z
    )
}

/// Says once that the CPU draws because no GPU can.
pub fn say_if_fallen_back(renderer: &Renderer) {
    if let Some(reason) = renderer.fell_back() {
        note(&format!("{}; drawing on the CPU", one_line(&reason.to_string())));
    }
}

/// Says what was asked for and cannot be seen.
fn say_what_is_not_seen(view: &View, subject: &Subject) {
    let ([lo, hi], settings) = (subject.range(), &view.settings);
    for surface in settings.surfaces().iter().filter(|surface| !(lo..=hi).contains(&surface.value)) {
        note(&format!("there is no isosurface {}: the values of {} go from {lo} to {hi}", surface.value, subject.array()));
    }
    let has_edges = settings.planes.iter().any(|plane| matches!(plane.used, PlaneUse::Cut { edges: true, .. }));
    let has_face_edges = settings.drawn_faces().is_some_and(|faces| faces.edges);
    if (has_edges || has_face_edges) && subject.mesh().is_none() {
        note("a volume has no tets, and so no edges to draw");
    }
}

/// Says something on stderr that is no error. A closed stderr is no reason to draw nothing.
pub(super) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "octetra: {text}");
}

/// A text of several lines as one.
pub fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}
