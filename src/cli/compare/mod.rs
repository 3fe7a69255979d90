//! `octetra compare`: how far a picture is from a reference, or a mesh from another.

mod document;
mod images;
mod measured;
mod meshes;
mod pictures;
mod tables;

use super::args::parse_not_negative;
use anyhow::{Result, bail};
use clap::Args;
use images::{ImageArgs, Images};
use meshes::{MeshesArgs, compare_meshes};
use std::path::{Path, PathBuf};

/// `octetra compare`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompareCommand {
    /// What is compared with: a picture (PNG, or NPY of float32 or float64), a mesh, or a surface (STL, PLY, OBJ, OFF)
    #[arg(value_name = "REFERENCE")]
    reference: PathBuf,
    /// What is judged: a picture of the same size, a mesh or a surface
    #[arg(value_name = "OTHER")]
    other: PathBuf,
    /// Write all numbers; - for stdout, instead of the table
    #[arg(long, value_name = "OUT.json", help_heading = "Output")]
    json: Option<PathBuf>,
    /// Limit, exit status 1 when it is missed: of pictures the highest difference of a channel or of alpha, peak 1 (of the floats where
    /// both files have more than 8 bits); of meshes that of the fields, in parts of REFERENCE's range
    #[arg(long, value_name = "X", value_parser = parse_not_negative)]
    max_difference: Option<f64>,
    #[command(flatten)]
    images: ImageArgs,
    #[command(flatten)]
    meshes: MeshesArgs,
}

const EXAMPLES: &str = "\
Examples:
  octetra compare exact.png octree.png
  octetra compare exact.npy octree.npy --map difference.png --json numbers.json
  octetra compare golden.png new.png --max-flip 0.03 --min-psnr 40    a test: exit status 1 if it fails
  octetra compare fine.vtu coarse.vtu                                 surfaces, fields, octrees, pictures
  octetra compare fine.vtu coarse.vtu --report report.html --difference difference.vtu
  octetra compare part.stl part.vtu --envelope 0.001                  does a mesh keep to its surface?

Pictures are compared as 8-bit RGB over black, two files of more than 8 bits as floats too. Covered
pixels are those where the reference's alpha exceeds 1/512, or, if it has none, those where it is not
black. NaN in an NPY of colours is an error. In an NPY of one value per pixel NaN means that there is
none, and differences are in parts of the reference's range.

Of meshes, distances are between their boundaries, exact but for 1e-6 of REFERENCE's diagonal. Fields are
carried from each mesh to the other, linear in a tet or constant for cell data; norms are weighted by volume.";

impl CompareCommand {
    /// Tells pictures from meshes by what the files are, and compares.
    pub fn run(self) -> Result<()> {
        let is_picture = [&self.reference, &self.other].map(|path| is_picture(path));
        match is_picture {
            [true, true] => {
                if let Some(flag) = self.meshes.named_output() {
                    bail!("--{flag} is of meshes; these are pictures");
                }
                let CompareCommand { reference, other, json, max_difference, images, .. } = &self;
                Images { reference, image: other, json: json.as_ref(), max_difference: *max_difference, args: images }.run()
            }
            [false, false] => {
                if let Some(flag) = self.images.named() {
                    bail!("--{flag} is of pictures; these are meshes");
                }
                compare_meshes([&self.reference, &self.other], self.json.as_deref(), self.max_difference, &self.meshes)
            }
            [first, _] => {
                let (mesh, picture) = if first { (&self.other, &self.reference) } else { (&self.reference, &self.other) };
                bail!(
                    "{}: a mesh, and {} is a picture; expected two pictures, PNG or NPY, or two meshes",
                    mesh.display(),
                    picture.display()
                );
            }
        }
    }
}

/// Whether a file is a picture: by its suffix, or by how it begins.
fn is_picture(path: &Path) -> bool {
    let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase()).unwrap_or_default();
    if suffix == "png" || suffix == "npy" {
        return true;
    }
    let mut start = [0u8; 6];
    let read = std::fs::File::open(path).and_then(|mut file| std::io::Read::read(&mut file, &mut start));
    read.is_ok() && (start.starts_with(b"\x89PNG") || start == *b"\x93NUMPY")
}
