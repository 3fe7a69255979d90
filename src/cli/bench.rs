//! `octetra bench`: the paper's build table, and frame times over the orbit.

use super::args::{MeshArgs, OctreeArgs, RawArgs, RendererArg, ViewArgs};
use super::long_work::with_bar;
use super::render::say_if_fallen_back;
use super::slice_bench::SliceBenchArgs;
use super::{mode_table, skip_table};
use crate::image::{Image, psnr};
use crate::mesh::{ScalarField, TetMesh};
use crate::octree::{OctreeParams, Preset};
use crate::render::{DeviceChoice, Renderer, Scene};
use crate::study::{Build, Frames, PaperTable, orbit_frames, thresholds_for};
use crate::view::{RendererKind, Steps, View};
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::io::Write;
use std::sync::Arc;

/// `octetra bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra bench blunt_fin.vtu                       the paper's table for the Blunt Fin, frame times over the orbit
  octetra bench flow.vtu --depths 7,8,9 --repeats 10
  octetra bench flow.vtu --nodes 100000 --depths 9  thresholds that give about this many nodes
  octetra bench scan.nhdr --tf bone.json --skip-table   half-splitting and other ways past empty space, the paper's figures beside
  octetra bench scan.nhdr --mode-table --size 512x768   frames a second of composite, isosurfaces, MIP and X-ray
  octetra bench --slices survey.zarr                which bricks caches keep while slices move: policies, stalls, what entropy saves
  octetra bench --synthetic 1536 --json caches.json the same through a volume that is not there, with the paper's scenario

Each depth is built by U, V and W. On the paper's two meshes W is chosen so that the node count is the paper's, unless --nodes says
otherwise. Then come the presets, by tolerance R; --presets leaves the depths out. PSNR is against the exact renderer's picture, 8 bits, over covered pixels.")]
pub struct BenchCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    octree: OctreeArgs,
    /// Maximum depths to build
    #[arg(long, value_name = "D,D,..", value_delimiter = ',', default_value = "8,9,10",
          value_parser = clap::value_parser!(u8).range(1..=i64::from(OctreeParams::DEPTH_LIMIT)))]
    depths: Vec<u8>,
    /// Choose W so that each depth has at most so many nodes, if the other thresholds allow; one number for all depths, or one each
    #[arg(long, value_name = "N,N,..", value_delimiter = ',')]
    nodes: Vec<usize>,
    /// Only the presets fast, balanced and fine
    #[arg(long, conflicts_with_all = ["depths", "nodes"])]
    presets: bool,
    /// Instead, ways to skip empty space against each other: the tables of Yu et al. 2016, for this mesh or volume
    #[arg(long, conflicts_with_all = ["depths", "nodes", "presets", "steps", "step", "voxels", "skip", "intervals"])]
    skip_table: bool,
    /// Instead, frame times in every mode, for this mesh or volume
    #[arg(long, conflicts_with_all = ["depths", "nodes", "presets", "skip_table", "mode", "xray", "shade"])]
    mode_table: bool,
    #[command(flatten)]
    slices: SliceBenchArgs,
    #[command(flatten)]
    volume: RawArgs,
    /// Builds of each row, and frames of each view
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
}

impl BenchCommand {
    /// Builds and draws at each depth and prints the tables.
    pub fn run(mut self) -> Result<()> {
        if self.slices.is_asked() {
            return self.slices.run();
        }
        self.slices.refuse_alone()?;
        self.mesh.choose_step()?;
        ensure!(self.view.renderer == RendererArg::Octree, "bench times the octree renderer; the exact one is what it compares with");
        if self.skip_table {
            return skip_table::run(&self.mesh, &self.volume, &self.octree, &self.view, u32::from(self.repeats));
        }
        if self.mode_table {
            return mode_table::run(&self.mesh, &self.volume, &self.octree, &self.view, u32::from(self.repeats));
        }
        ensure!(self.volume.dims.is_none(), "bench measures builds of meshes; with --skip-table or --mode-table it takes volumes");
        ensure!(self.octree.max_depth.is_none(), "bench builds the depths that --depths names, not --max-depth");
        let mesh = Arc::new(self.mesh.read()?);
        let field = self.mesh.field(&mesh)?;
        self.mesh.check_budget(&mesh)?;
        let view = self.view.view(&*mesh, self.view.files()?);
        view.transfer_function.check_range(field.range).with_context(|| self.mesh.shown_name())?;
        let renderer = Renderer::new(self.view.device.into())?;
        say_if_fallen_back(&renderer);
        // What all is compared with is the f64 renderer.
        let truth = Renderer::new(DeviceChoice::Cpu)?;
        let exact = with_bar(|progress| -> Result<Image> {
            let scene = truth.exact_scene(&mesh, &field, progress)?;
            let settings = crate::view::RenderSettings { renderer: RendererKind::Exact, min_transmittance: 0.0, ..view.settings };
            Ok(truth.render(&scene, &View { settings, ..view.clone() }, progress)?.image)
        })?;

        let paper = PaperTable::of(&mesh);
        let adapter = renderer.adapter().map_or("CPU".into(), |[name, backend, driver]| format!("{name} ({backend}, {driver})"));
        let mut out = std::io::stdout().lock();
        let name = paper.map_or(self.mesh.stem(), |p| p.name.to_owned());
        let size = self.view.size;
        writeln!(out, "{name}: {} tets, {} points, array {}", mesh.tets().len(), mesh.points().len(), field.name)?;
        writeln!(out, "{} threads; {adapter}; {}x{}, best of {} builds\n", rayon::current_num_threads(), size[0], size[1], self.repeats)?;
        writeln!(
            out,
            "setting      W or R  build s  median s    nodes     MiB  PSNR leaf  paper   frame ms  worst  by         paper's build, nodes"
        )?;
        let depths = if self.presets { &[][..] } else { &self.depths };
        for (i, &depth) in depths.iter().enumerate() {
            let mut params = OctreeParams { max_depth: depth, ..self.octree.params() }.by_thresholds();
            if let Some(nodes) = self.target(i, paper) {
                params = with_bar(|progress| thresholds_for(&mesh, &field, &params, nodes, progress))?;
            }
            let row = self.measure(&mesh, &field, &view, &renderer, &exact, &params)?;
            let published = paper.and_then(|p| p.rows.into_iter().find(|r| r.0 == depth));
            let beside = published.map_or("-".into(), |(_, seconds, nodes)| format!("{seconds:.2} s, {} k", nodes / 1000));
            writeln!(out, "{:<8}  {row}  {beside}", format!("depth {depth}"))?;
            out.flush()?;
        }
        for (name, preset) in Preset::ALL.into_iter().filter(|(_, preset)| preset.params().tolerance.is_some()) {
            let row = self.measure(&mesh, &field, &view, &renderer, &exact, &preset.params())?;
            writeln!(out, "{name:<8}  {row}")?;
            out.flush()?;
        }
        writeln!(out, "\n{}", self.exact_frames(&mesh, &field, &view, &renderer, &exact)?)?;
        Ok(())
    }

    /// The exact renderer on the same device: bytes, frame time over the orbit, distance from the truth.
    fn exact_frames(&self, mesh: &TetMesh, field: &ScalarField, view: &View, renderer: &Renderer, truth: &Image) -> Result<String> {
        let scene = with_bar(|progress| renderer.exact_scene(mesh, field, progress))?;
        let settings = crate::view::RenderSettings { renderer: RendererKind::Exact, ..view.settings };
        let view = View { settings, ..view.clone() };
        let picture = with_bar(|progress| renderer.render(&scene, &view, progress))?;
        let bounds = mesh.bounds().translated(mesh.center());
        let repeats = if scene.is_on_device() { u32::from(self.repeats) } else { 1 };
        let frames = with_bar(|progress| orbit_frames(renderer, &scene, bounds, &view, repeats, progress))?;
        let (by, seconds) = frames.gpu_s.as_ref().map_or(("clock", &frames.wall_s), |gpu_s| ("GPU", gpu_s));
        let (frame, worst) = Frames::median_and_worst(seconds);
        let bytes = scene.exact_bytes().unwrap_or(0) as f64 / mesh.tets().len() as f64;
        let (frame, worst, decibels) = (frame * 1e3, worst * 1e3, psnr(truth, &picture.image).1);
        Ok(format!("exact: {bytes:.1} bytes a tet, frame {frame:.3} ms, worst {worst:.2} ms (by {by}), {decibels:.1} dB against f64"))
    }

    /// How many nodes a depth should have: what was asked for, else the paper's.
    fn target(&self, i: usize, paper: Option<PaperTable>) -> Option<usize> {
        let published = paper.and_then(|p| p.rows.into_iter().find(|r| r.0 == self.depths[i])).map(|(.., nodes)| nodes);
        self.nodes.get(i).or(self.nodes.last()).copied().or(published)
    }

    /// One row of the table as text.
    fn measure(
        &self,
        mesh: &Arc<TetMesh>,
        field: &ScalarField,
        view: &View,
        renderer: &Renderer,
        exact: &Image,
        params: &OctreeParams,
    ) -> Result<String> {
        let repeats = usize::from(self.repeats);
        let build = with_bar(|progress| Build::measure(mesh, field, params, repeats, progress))?;
        let (best, median, count, bytes) = (build.best_s(), build.median_s(), build.tree.node_count(), build.texture.bytes());
        let (scene, _) = renderer.octree_scene(&**mesh, build.texture, params.surface(mesh, field))?;
        let scene = scene.with_mesh(Some(mesh.clone()));
        let quality = |steps| -> Result<f64> { Ok(psnr(exact, &self.picture(renderer, &scene, view, steps)?).1) };
        let (leaf, paper) = (quality(Steps::Leaf)?, quality(Steps::Paper)?);
        let bounds = mesh.bounds().translated(mesh.center());
        let frames = with_bar(|progress| orbit_frames(renderer, &scene, bounds, view, u32::from(self.repeats), progress))?;
        let (by, seconds) = frames.gpu_s.as_ref().map_or(("clock", &frames.wall_s), |gpu_s| ("GPU", gpu_s));
        let (frame, worst) = Frames::median_and_worst(seconds);
        let mut by = by.to_owned();
        if frames.gpu_s.is_some() {
            by += &format!(" ({:.2})", Frames::median_and_worst(&frames.wall_s).0 * 1e3);
        }
        let (threshold, mib) = (params.tolerance.unwrap_or(params.max_leaf_variance), bytes as f64 / f64::from(1 << 20));
        Ok(format!(
            "{threshold:>8.1e}  {best:>6.3}  {median:>8.3}  {count:>8}  {mib:>6.2}  {leaf:>9.2}  {paper:>5.2}  {:>9.3}  {:>5.2}  {by:<9}",
            frame * 1e3,
            worst * 1e3
        ))
    }

    fn picture(&self, renderer: &Renderer, scene: &Scene, view: &View, steps: Steps) -> Result<Image> {
        let settings = crate::view::RenderSettings { steps, ..view.settings };
        with_bar(|progress| renderer.render(scene, &View { settings, ..view.clone() }, progress)).map(|picture| picture.image)
    }
}
