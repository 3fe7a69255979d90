//! `octetra compare` of two meshes, or of a mesh and a surface.

use super::super::args::{DeviceArg, OctreeArgs, check_outputs_beside, parse_not_negative, parse_size};
use super::super::long_work::with_bar;
use super::super::transfer::TransferArgs;
use super::document::{is_markdown, picture_file};
use super::images::{is_stdout, write_json};
use super::measured::{Field, Measured, Side};
use super::{pictures, tables};
use crate::format::vtu::write::{Compression, write_mesh};
use crate::format::write_ply;
use crate::mesh::{Association, Component, DataArray, FieldSelection, MeshParts, ScalarField, TetMesh, Values};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Flags for meshes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Meshes")]
pub struct MeshesArgs {
    /// Write the tables and pictures as one file: HTML, or Markdown with its pictures beside it
    #[arg(long, value_name = "OUT.html|OUT.md")]
    pub report: Option<PathBuf>,
    /// Write REFERENCE with its field, OTHER's field carried to it, and the difference, NaN where one has no value
    #[arg(long, value_name = "OUT.vtu")]
    pub difference: Option<PathBuf>,
    /// Write the surface of OTHER with the distance of each of its points from REFERENCE's surface
    #[arg(long, value_name = "OUT.ply")]
    pub distances: Option<PathBuf>,
    /// Compare the surfaces alone: no fields, no octrees, no pictures of them
    #[arg(long)]
    pub surface: bool,
    /// Point or cell array to compare [default: REFERENCE's active scalars, else its first array]
    #[arg(long, value_name = "NAME", conflicts_with = "surface")]
    pub array: Option<String>,
    /// Its name in OTHER [default: the same]
    #[arg(long, value_name = "NAME", conflicts_with = "surface")]
    pub other_array: Option<String>,
    /// What to take of a vector
    #[arg(long, value_name = "magnitude|x|y|z|N", default_value = "magnitude", value_parser = Component::from_str)]
    pub component: Component,
    /// Places outside a mesh that are within X of its surface take the value there, in parts of REFERENCE's diagonal; beyond, or with 0,
    /// there is no value
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = parse_not_negative)]
    pub snap: f64,
    /// Highest Hausdorff distance of the surfaces, in parts of REFERENCE's diagonal; exit status 1 when it is missed
    #[arg(long, value_name = "X", value_parser = parse_not_negative)]
    pub max_distance: Option<f64>,
    /// Say whether the mesh's surface keeps within E of the surface that it was made from, in parts of that one's diagonal (epsilon of
    /// fTetWild and pytetwild): of REFERENCE, or of the file that is a surface; exit status 1 if not
    #[arg(long, value_name = "E", value_parser = parse_not_negative)]
    pub envelope: Option<f64>,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "N|WxH", default_value = "512", value_parser = parse_size)]
    pub size: [u32; 2],
    /// View of the standard orbit about REFERENCE, 0 to 11
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..12))]
    pub orbit: u32,
    /// Where to draw: auto takes the best GPU, and the CPU where there is none or only a software adapter
    #[arg(long, value_enum, default_value = "auto")]
    pub device: DeviceArg,
    #[command(flatten)]
    pub octree: OctreeArgs,
    #[command(flatten)]
    pub transfer: TransferArgs,
}

impl MeshesArgs {
    /// A flag that only meshes have and that was given.
    pub fn named_output(&self) -> Option<&'static str> {
        let given = [
            ("report", self.report.is_some()),
            ("difference", self.difference.is_some()),
            ("distances", self.distances.is_some()),
            ("surface", self.surface),
            ("array", self.array.is_some()),
            ("other-array", self.other_array.is_some()),
            ("component", self.component != Component::Magnitude),
            ("snap", self.snap > 0.0),
            ("orbit", self.orbit != 0),
            ("size", self.size != [512, 512]),
            ("max-distance", self.max_distance.is_some()),
            ("envelope", self.envelope.is_some()),
        ];
        given.into_iter().find(|flag| flag.1).map(|flag| flag.0)
    }
}

/// Reads, measures, writes, judges.
pub fn compare_meshes(paths: [&PathBuf; 2], json: Option<&Path>, max_difference: Option<f64>, args: &MeshesArgs) -> Result<()> {
    check_outputs(paths, json, args)?;
    let transfer = args.transfer.read(None)?;
    let mut sides = [Side::read(paths[0])?, Side::read(paths[1])?];
    if sides[0].name == sides[1].name {
        sides.iter_mut().for_each(|side| side.name = side.path.display().to_string());
    }
    let (fields, why_not) = fields(&sides, args)?;
    if let (None, Some(flag)) = (&fields, needs_field(args, max_difference)) {
        bail!("--{flag} needs a field on both meshes, and {why_not}");
    }
    let [a, b] = sides;
    let b = b.relative_to(&a);
    let mut measured = Measured::new([a, b], fields, args.snap)?;
    measured.notes.extend(
        (!why_not.is_empty() && !args.surface).then(|| format!("fields, octrees and pictures of them are not compared: {why_not}")),
    );
    let drawn = pictures::draw(&mut measured, transfer, args)?;
    let verdicts = tables::judge(&measured, args.max_distance, max_difference, args.envelope);

    let document = tables::document(&measured, &verdicts, drawn);
    if let Some(path) = &args.difference {
        write_difference(path, &measured)?;
    }
    if let Some(path) = &args.distances {
        let Side { surface, .. } = &measured.sides[1];
        let points: Vec<_> = surface.points.iter().map(|&p| p + surface.origin).collect();
        let distances = &measured.distances.b_to_a.at_points;
        write_ply(path, &points, &surface.triangles, "distance", distances).with_context(|| path.display().to_string())?;
    }
    if let Some(path) = &args.report {
        document.write(path)?;
    }
    if let Some(path) = json {
        write_json(path, &tables::numbers(&measured, &verdicts))?;
    }
    if json.is_none_or(|path| !is_stdout(path)) {
        document.say(&mut io::stdout().lock())?;
    }
    let missed: Vec<&str> = verdicts.iter().filter(|verdict| !verdict.passed).map(|verdict| verdict.text.as_str()).collect();
    if !missed.is_empty() {
        bail!("{}: {}", paths[1].display(), missed.join("; "));
    }
    Ok(())
}

fn check_outputs([a, b]: [&PathBuf; 2], json: Option<&Path>, args: &MeshesArgs) -> Result<()> {
    let json = json.filter(|path| !is_stdout(path)).map(Path::to_path_buf);
    let beside: Vec<PathBuf> = match &args.report {
        Some(report) if is_markdown(report) => pictures::NAMES.iter().map(|name| picture_file(report, name)).collect(),
        _ => vec![],
    };
    let outputs = [args.report.as_ref(), args.difference.as_ref(), args.distances.as_ref(), json.as_ref()];
    let outputs: Vec<Option<&PathBuf>> = outputs.into_iter().chain(beside.iter().map(Some)).collect();
    let tf = Path::new(args.transfer.tf.as_str());
    let inputs = [(a.as_path(), "the reference"), (b.as_path(), "what is compared with it"), (tf, "the transfer function")];
    check_outputs_beside(&inputs[..if tf.is_file() { 3 } else { 2 }], &outputs)
}

/// A flag that was given and needs fields.
fn needs_field(args: &MeshesArgs, max_difference: Option<f64>) -> Option<&'static str> {
    let given = [
        ("difference", args.difference.is_some()),
        ("max-difference", max_difference.is_some()),
        ("array", args.array.is_some()),
        ("other-array", args.other_array.is_some()),
    ];
    given.into_iter().find(|flag| flag.1).map(|flag| flag.0)
}

/// The fields to compare, or why there are none.
fn fields(sides: &[Side; 2], args: &MeshesArgs) -> Result<(Option<[ScalarField; 2]>, String)> {
    if args.surface {
        return Ok((None, "--surface leaves fields out".into()));
    }
    let [Some(a), Some(b)] = sides.each_ref().map(|side| side.mesh.as_deref()) else {
        let surface = sides.iter().find(|side| side.mesh.is_none()).map(|side| side.name.as_str()).unwrap_or_default();
        return Ok((None, format!("{surface} is a surface")));
    };
    let select = |mesh: &TetMesh, name: Option<String>| ScalarField::select(mesh, &FieldSelection { name, component: args.component });
    let first = match select(a, args.array.clone()) {
        Ok(field) => field,
        Err(error) if args.array.is_some() || args.other_array.is_some() => {
            return Err(error).with_context(|| sides[0].path.display().to_string());
        }
        Err(error) => return Ok((None, format!("of {}, {error}", sides[0].name))),
    };
    let name = args.other_array.clone().unwrap_or_else(|| first.name.clone());
    match select(b, Some(name)) {
        Ok(second) => Ok((Some([first, second]), String::new())),
        Err(error) if args.array.is_some() || args.other_array.is_some() => Err(error).with_context(|| sides[1].path.display().to_string()),
        Err(error) => Ok((None, format!("of {}, {error}; --other-array names another", sides[1].name))),
    }
}

/// Writes the first mesh with both fields and their difference.
fn write_difference(path: &Path, measured: &Measured) -> Result<()> {
    let (Some(Field { fields: [a, b], difference }), Some(mesh)) = (&measured.field, &measured.sides[0].mesh) else { return Ok(()) };
    let array = |name: String, values: &[f64]| DataArray { name, components: 1, values: Values::F64(values.to_vec()) };
    let arrays = vec![
        array("difference".into(), &difference.on_a),
        array(format!("{} of reference", a.name), &a.values),
        array(format!("{} of other", b.name), &difference.b_on_a),
    ];
    let (point_data, cell_data) = if a.association == Association::Points { (arrays, vec![]) } else { (vec![], arrays) };
    let parts = MeshParts {
        points: mesh.points().iter().map(|&p| p + mesh.center()).collect(),
        tets: mesh.tets().to_vec(),
        point_data,
        cell_data,
        active_scalars: Some("difference".into()),
        ..MeshParts::default()
    };
    let mesh = TetMesh::new(parts)?;
    with_bar(|progress| write_mesh(path, &mesh, Compression::Zlib, progress))?;
    Ok(())
}
