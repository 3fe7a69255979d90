//! `octetra bricks`: a volume or a mesh as a store of bricks.

use super::args::{MeshArgs, OctreeArgs, RawArgs};
use super::long_work::with_bar;
use super::subject::{read_subject, regularized};
use crate::bricks::store::{BuildOptions, build};
use crate::format::segy::{SegyVolume, is_segy};
use crate::octree::{OctreeTexture, OctreeVolume, Subject};
use crate::volume::{Grid, GridFrame, Samples, VoxelSource, VoxelType};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, UNIX_EPOCH};

/// Memory that writing takes at most unless told.
const BUDGET: u64 = 1 << 30;

/// `octetra bricks`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  octetra bricks survey.sgy -o survey.zarr         a seismic survey, read trace by trace however large it is
  octetra bricks scan.raw --dims 4096,4096,2048 --type u16 -o scan.zarr
  octetra bricks flow.vtu --resolution 1024 -o flow.zarr
  octetra slice survey.zarr --voxel z=100 -o inline_100.png
  octetra view survey.zarr                         slices in a window

The store is a folder: Zarr v3 with OME-NGFF metadata, which zarr-python and ome-zarr open. It holds the volume in levels, each of half the
resolution of the one before, in bricks of 64^3 voxels, and of each brick its range and entropy. If writing is stopped, the same command
goes on with it. Writing takes at most --memory, here 1GiB unless told.")]
pub struct BricksCommand {
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    volume: RawArgs,
    #[command(flatten)]
    octree: OctreeArgs,
    /// Of a mesh: voxels along the longest edge of its bounds, sampled through its octree [default: as fine as the octree's smallest leaves]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65_536))]
    resolution: Option<u32>,
    /// The store to write, a folder
    #[arg(short, long, value_name = "STORE.zarr", help_heading = "Output")]
    output: PathBuf,
    /// Replace a store of octetra's that is there already; nothing else in its folder is touched
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
}

impl BricksCommand {
    /// Opens the source, writes, says what was written.
    pub fn run(mut self) -> Result<()> {
        self.mesh.choose_step()?;
        let (source, values) = self.source()?;
        let options = BuildOptions {
            budget_bytes: self.mesh.memory.unwrap_or(BUDGET),
            overwrite: self.overwrite,
            source: self.fingerprint(source.as_ref(), &values)?,
        };
        let start = Instant::now();
        let built = with_bar(|progress| build(source.as_ref(), &self.output, &options, progress))?;
        let seconds = start.elapsed().as_secs_f64();
        let info = &built.info;
        let bytes = source.frame().points() as f64 * source.voxel_type().bytes() as f64;
        let mut out = io::stdout().lock();
        let [x, y, z] = info.dims;
        writeln!(out, "volume        {x} x {y} x {z} {}, {}", info.voxel_type, info.name)?;
        if let Some([low, high]) = info.range {
            writeln!(out, "range         {low} to {high}")?;
        }
        let bricks: u64 = (0..info.pyramid().levels()).map(|level| info.pyramid().brick_count(level)).sum();
        writeln!(out, "levels        {}, {bricks} bricks", info.pyramid().levels())?;
        let kept = if built.kept > 0 { format!(", {} were there", built.kept) } else { String::new() };
        writeln!(out, "shards        {} written{kept}, of {} voxels a side", built.written, info.shard_edge())?;
        let mib = f64::from(1 << 20);
        writeln!(out, "bytes         {:.1} MiB for {:.1} MiB of voxels", built.bytes as f64 / mib, bytes / mib)?;
        writeln!(out, "time          {seconds:.2} s, {:.0} MB/s", bytes / 1e6 / seconds.max(1e-9))?;
        Ok(())
    }

    /// What the bricks are of.
    fn source(&self) -> Result<(Box<dyn VoxelSource>, Value)> {
        let inputs = self.mesh.mesh.iter().chain(&self.mesh.solution).chain(&self.mesh.more);
        for path in inputs {
            let lies_in = |output: PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(output));
            if self.output.canonicalize().is_ok_and(lies_in) {
                bail!("{}: is the source or lies in the store, which would overwrite it", path.display());
            }
        }
        if let Some(path) = self.mesh.mesh.as_deref().filter(|_| self.volume.layout().is_none())
            && path.is_file()
            && is_segy(path)?
        {
            let survey = with_bar(|progress| SegyVolume::open(path, &self.volume.segy.options(), progress))?;
            if let Some(name) = self.mesh.array.as_deref().filter(|name| *name != survey.name()) {
                bail!("{}: there is no array \"{name}\"; a survey has \"{}\"", path.display(), survey.name());
            }
            let mut out = io::stdout().lock();
            survey.notes().iter().try_for_each(|note| writeln!(out, "note          {note}"))?;
            return Ok((self.unless_resolution(survey)?, Value::Null));
        }
        let subject = read_subject(&self.mesh, &self.volume)?;
        match &subject {
            Subject::Volume(grid) => Ok((self.unless_resolution(Shared(grid.clone()))?, json!([grid.range(), grid.missing()]))),
            Subject::Mesh(mesh, _) => {
                let tree = regularized(&self.mesh, &subject, &self.octree.params())?;
                let texture = OctreeTexture::encode(&tree)?;
                let longest = self.resolution.unwrap_or_else(|| OctreeVolume::finest(&texture, &**mesh));
                let volume = OctreeVolume::new(texture, &**mesh, subject.array().to_owned(), longest);
                Ok((Box::new(volume), json!(subject.range())))
            }
        }
    }

    /// A volume, which has voxels of its own.
    fn unless_resolution(&self, source: impl VoxelSource + 'static) -> Result<Box<dyn VoxelSource>> {
        if self.resolution.is_some() {
            bail!("--resolution is for meshes; a volume has its own voxels");
        }
        Ok(Box::new(source))
    }

    /// What tells one source from another.
    fn fingerprint(&self, source: &dyn VoxelSource, values: &Value) -> Result<Value> {
        let path = self.mesh.mesh.as_deref();
        let file = path.map(|path| file_state(path).with_context(|| path.display().to_string())).transpose()?;
        let frame = source.frame();
        Ok(json!({
            "file": path.and_then(Path::file_name).map(|name| name.to_string_lossy()), "state": file, "name": source.name(),
            "dims": frame.dims, "origin": frame.origin.to_array(), "steps": frame.steps.to_cols_array(),
            "values": values, "octree": format!("{:?}", self.octree.params()), "layout": format!("{:?}", self.volume),
            "component": format!("{:?}", self.mesh.component), "solution": self.mesh.solution, "steps": format!("{:?}", self.mesh.steps),
        }))
    }
}

/// Size of a file, and when it was last changed, nanoseconds.
fn file_state(path: &Path) -> io::Result<Value> {
    let metadata = path.metadata()?;
    let changed = metadata.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(json!({ "bytes": metadata.len(), "changed": changed.as_nanos().to_string() }))
}

/// A volume in memory or in a mapped file.
struct Shared(Arc<Grid>);

impl VoxelSource for Shared {
    fn frame(&self) -> &GridFrame {
        self.0.frame()
    }
    fn name(&self) -> &str {
        self.0.name()
    }
    fn voxel_type(&self) -> VoxelType {
        self.0.voxel_type()
    }
    fn read(&self, region: &[Range<u32>; 3]) -> io::Result<Samples> {
        self.0.read(region)
    }
}
