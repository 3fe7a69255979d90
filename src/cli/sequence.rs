//! Flags for many pictures: turntables and ways of the camera.

use super::args::read_json;
use super::usage::usage;
use crate::image::Template;
use crate::view::{Camera, CameraPath};
use anyhow::{Context, Result};
use clap::Args;
use std::path::{Path, PathBuf};

/// One octree, many pictures.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Sequences")]
pub struct SequenceArgs {
    /// N pictures of a full turn about the camera's up axis; the output's name has {i} for their numbers [default: NAME_{i}.png]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub turntable: Option<u32>,
    /// Pictures along a way: a JSON list of cameras, as --camera reads one; between them it turns evenly and comes closer by even factors
    #[arg(long, value_name = "FILE", requires = "frames", conflicts_with_all = ["turntable", "camera", "orbit", "zoom"])]
    pub camera_path: Option<PathBuf>,
    /// How many pictures the way has
    #[arg(long, value_name = "N", requires = "camera_path", conflicts_with = "turntable", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: Option<u32>,
}

/// What is asked for, read and checked before any long work.
pub struct Sequence {
    count: u32,
    path: Option<CameraPath>,
    template: Template,
}

impl SequenceArgs {
    /// The sequence that is asked for, if one is, in files named by `output`.
    pub fn sequence(&self, output: Option<&Path>, stem: &str) -> Result<Option<Sequence>> {
        let Some(count) = self.turntable.or(self.frames) else { return Ok(None) };
        // A mesh's name may have braces of its own.
        let own = || PathBuf::from(format!("{}_{{i}}.png", stem.replace(['{', '}'], "_")));
        let template = usage(Template::new(&output.map_or_else(own, Path::to_owned)).context("-o"))?;
        let path = match &self.camera_path {
            Some(file) => {
                let keys: Vec<Camera> = read_json(file, "a list of cameras")?;
                Some(CameraPath::new(keys).with_context(|| file.display().to_string())?)
            }
            None => None,
        };
        Ok(Some(Sequence { count, path, template }))
    }
}

impl Sequence {
    /// Where the pictures go.
    pub fn files(&self) -> Vec<PathBuf> {
        self.template.paths(self.count).collect()
    }

    /// From where they are seen; a turntable starts at `camera`.
    pub fn cameras(&self, camera: Camera) -> Vec<Camera> {
        match &self.path {
            Some(path) => path.cameras(self.count),
            None => camera.turntable(self.count),
        }
    }
}
