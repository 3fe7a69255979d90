//! Flags that say what a pixel shows.

use super::args::parse_color;
use crate::view::{Faces, Isosurface, Isosurfaces, LightSource, Mode, NotAPlane, Phong, Plane, PlaneUse, Planes, RenderSettings, Shading};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use glam::DVec3;
use std::str::FromStr;

/// Mode, isosurfaces, planes, shading.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Mode")]
pub struct ModeArgs {
    /// What a pixel shows: composite (the volume, with the isosurfaces there are), iso (these only), mip or minip (the largest or smallest value on the
    /// ray), xray (the mean of the values on it)
    #[arg(long, value_name = "composite|iso|mip|minip|xray", default_value = "composite", value_parser = Mode::from_str)]
    pub mode: Mode,
    /// With --mode xray: the mean over the ray's length in the data, or the integral (data units x world units)
    #[arg(long, value_enum, value_name = "mean|integral")]
    pub xray: Option<XRayArg>,
    /// Values of isosurfaces, data units, up to 8
    #[arg(long, value_name = "V,V..", value_delimiter = ',', allow_negative_numbers = true, value_parser = parse_value)]
    pub iso: Vec<f64>,
    /// Their opacities, one for all or one for each [default: 1]
    #[arg(long, value_name = "A,A..", value_delimiter = ',', requires = "iso", value_parser = parse_opacity)]
    pub iso_opacity: Vec<f32>,
    /// Their colours, one for all or one for each, linear RGB in [0, 1] [default: the transfer function's]
    #[arg(long, value_name = "R,G,B:..", value_delimiter = ':', requires = "iso", value_parser = parse_color)]
    pub iso_color: Vec<[f32; 3]>,
    /// Draw only what lies on one side of a plane: x=C keeps what is at least C, -x=C the other side; or a point and the normal towards what is
    /// kept. Up to 6 planes clip and cut together
    #[arg(long, value_name = "x=C|X,Y,Z:NX,NY,NZ", allow_hyphen_values = true, value_parser = parse_clip)]
    pub clip: Vec<Plane>,
    /// Draw a plane inside the data, in the colours of the values on it
    #[arg(long, value_name = "x=C|X,Y,Z:NX,NY,NZ", allow_hyphen_values = true, value_parser = parse_cut)]
    pub cut: Vec<Plane>,
    /// The opacity of such planes
    #[arg(long, value_name = "A", default_value_t = 1.0, requires = "cut", value_parser = parse_opacity)]
    pub cut_opacity: f32,
    /// Draw the tets' edges on such planes
    #[arg(long, requires = "cut")]
    pub cut_edges: bool,
    /// Draw the boundary faces, in the colours of the values on them, in depth order with the volume; alone with --mode iso
    #[arg(long)]
    pub faces: bool,
    /// Their opacity
    #[arg(long, value_name = "A", default_value_t = 1.0, requires = "faces", value_parser = parse_opacity)]
    pub face_opacity: f32,
    /// Their colour, linear RGB in [0, 1] [default: the transfer function's]
    #[arg(long, value_name = "R,G,B", requires = "faces", value_parser = parse_color)]
    pub face_color: Option<[f32; 3]>,
    /// Draw the edges of the mesh's boundary faces
    #[arg(long, requires = "faces")]
    pub face_edges: bool,
    /// Shading by the field's gradient [default: phong for isosurfaces and boundary faces, none for the volume]
    #[arg(long, value_enum)]
    pub shade: Option<ShadeArg>,
    /// Where light comes from: the camera, or a direction in the world
    #[arg(long, value_name = "camera|X,Y,Z", default_value = "camera", allow_hyphen_values = true, value_parser = parse_light)]
    pub light: LightSource,
    /// Phong: light from everywhere
    #[arg(long, value_name = "K_A", default_value = "0.3", value_parser = parse_share)]
    pub ambient: f64,
    /// Phong: light scattered by what faces it
    #[arg(long, value_name = "K_D", default_value = "0.7", value_parser = parse_share)]
    pub diffuse: f64,
    /// Phong: highlight
    #[arg(long, value_name = "K_S", default_value = "0.2", value_parser = parse_share)]
    pub specular: f64,
    /// Phong: how small highlights are, from 1
    #[arg(long, value_name = "N", default_value = "20", value_parser = parse_shininess)]
    pub shininess: f64,
}

/// Values of `--xray`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum XRayArg {
    /// Mean.
    Mean,
    /// Integral.
    Integral,
}

/// Values of `--shade`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShadeArg {
    /// Phong's reflection, isosurfaces and volume.
    Phong,
    /// Nothing is shaded.
    None,
}

impl ModeArgs {
    /// The mode, with `--xray` counted in.
    pub fn mode(&self) -> Mode {
        self.of_xray(self.mode)
    }

    /// A mode with `--xray` counted in.
    pub fn of_xray(&self, mode: Mode) -> Mode {
        match (mode, self.xray) {
            (Mode::Mean, Some(XRayArg::Integral)) => Mode::Integral,
            _ => mode,
        }
    }

    /// `Err` if flags contradict each other, or the settings that are drawn with: the flags' own, or a session's with the flags counted in.
    pub fn check(&self, used: &RenderSettings) -> Result<()> {
        let mode = used.mode;
        if self.xray.is_some() && !matches!(mode, Mode::Mean | Mode::Integral) {
            bail!("--xray says what --mode xray shows; the mode is {mode}");
        }
        if self.xray == Some(XRayArg::Mean) && mode == Mode::Integral {
            bail!("--mode {mode} and --xray mean contradict each other");
        }
        for (flag, given) in [("--iso-opacity", self.iso_opacity.len()), ("--iso-color", self.iso_color.len())] {
            if ![0, 1, self.iso.len()].contains(&given) {
                bail!("{flag} has {given} entries for {} isosurfaces, expected one or one for each", self.iso.len());
            }
        }
        Isosurfaces::new(&self.isosurfaces())?;
        Planes::new(&self.planes())?;
        if mode == Mode::Iso && !used.with_surfaces() && used.drawn_faces().is_none() {
            bail!("--mode iso draws surfaces of equal value; say which with --iso V (or planes with --cut, or --faces)");
        }
        for (flag, is_given) in [("--iso", !self.iso.is_empty()), ("--cut", !self.cut.is_empty()), ("--faces", self.faces)] {
            if mode.is_number() && is_given {
                bail!("{flag} is drawn with --mode composite or iso; the mode is {mode}");
            }
        }
        if mode.is_number() && self.shade == Some(ShadeArg::Phong) {
            bail!("--mode {mode} shows a number of each ray, which is not shaded; --shade phong is for composite and iso");
        }
        Ok(())
    }

    fn isosurfaces(&self) -> Vec<Isosurface> {
        fn of<T: Copy>(given: &[T], i: usize) -> Option<T> {
            given.get(i).or(given.first()).copied()
        }
        let surface = |(i, &value): (usize, &f64)| Isosurface {
            value,
            color: of(&self.iso_color, i),
            opacity: of(&self.iso_opacity, i).unwrap_or(1.0),
        };
        self.iso.iter().enumerate().map(surface).collect()
    }

    fn planes(&self) -> Vec<Plane> {
        let cut = |plane: &Plane| Plane { used: PlaneUse::Cut { opacity: self.cut_opacity, edges: self.cut_edges }, ..*plane };
        self.clip.iter().copied().chain(self.cut.iter().map(cut)).collect()
    }

    /// What the flags make of settings; they are valid.
    pub fn settings(&self, settings: RenderSettings) -> RenderSettings {
        let [ambient, diffuse, specular, shininess] = [self.ambient, self.diffuse, self.specular, self.shininess].map(|k| k as f32);
        let shading = Shading {
            volume: self.shade == Some(ShadeArg::Phong),
            surfaces: self.shade != Some(ShadeArg::None),
            phong: Phong { ambient, diffuse, specular, shininess, light: self.light },
        };
        let isosurfaces = Isosurfaces::new(&self.isosurfaces()).unwrap_or_default();
        let planes = Planes::new(&self.planes()).unwrap_or_default();
        let own = Faces { opacity: self.face_opacity, color: self.face_color, edges: self.face_edges };
        RenderSettings { mode: self.mode(), isosurfaces, planes, faces: self.faces.then_some(own), shading, ..settings }
    }
}

fn parse_value(text: &str) -> Result<f64, String> {
    super::args::parse_number(text, |_| true, "a number")
}

fn parse_clip(text: &str) -> Result<Plane, NotAPlane> {
    Plane::parse(text, PlaneUse::Clip)
}

fn parse_cut(text: &str) -> Result<Plane, NotAPlane> {
    Plane::parse(text, PlaneUse::Cut { opacity: 1.0, edges: false })
}

fn parse_opacity(text: &str) -> Result<f32, String> {
    super::args::parse_number(text, |v| (0.0..=1.0).contains(&v), "a number in [0, 1]").map(|v| v as f32)
}

fn parse_share(text: &str) -> Result<f64, String> {
    super::args::parse_number(text, |v| (0.0..=100.0).contains(&v), "a number from 0 to 100")
}

fn parse_shininess(text: &str) -> Result<f64, String> {
    super::args::parse_number(text, |v| (1.0..=10_000.0).contains(&v), "a number from 1 to 10000")
}

fn parse_light(text: &str) -> Result<LightSource, String> {
    if text == "camera" {
        return Ok(LightSource::Camera);
    }
    let expected = || "expected camera, or a direction X,Y,Z that is not 0".to_owned();
    let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).collect();
    let [x, y, z] = numbers[..] else { return Err(expected()) };
    let direction = DVec3::new(x, y, z);
    if text.matches(',').count() == 2 && direction.try_normalize().is_some() { Ok(LightSource::From(direction)) } else { Err(expected()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        mode: ModeArgs,
    }

    fn settings(flags: &str) -> Result<RenderSettings> {
        let args = Flags::try_parse_from(std::iter::once("x").chain(flags.split_whitespace()))?.mode;
        let settings = args.settings(RenderSettings::new(1, 1));
        args.check(&settings)?;
        Ok(settings)
    }

    #[test]
    fn flags_say_what_is_shown() {
        let plain = settings("").expect("valid");
        assert_eq!((plain.mode, plain.isosurfaces, plain.shading.volume), (Mode::Composite, Isosurfaces::NONE, false));
        assert_eq!(plain.shading.phong, Phong::default(), "the defaults in the help are the library's");
        assert_eq!(settings("--mode xray --xray integral").expect("valid").mode, Mode::Integral);
        let two = settings("--mode iso --iso 2,-1 --iso-opacity 0.5,1 --iso-color 1,0,0:0,0,1 --light 0,0,-2").expect("valid");
        let surface = |value, color, opacity| Isosurface { value, color: Some(color), opacity };
        assert_eq!(two.isosurfaces.iter().collect::<Vec<_>>(), [surface(2.0, [1.0, 0.0, 0.0], 0.5), surface(-1.0, [0.0, 0.0, 1.0], 1.0)]);
        assert!(two.shading.surfaces && two.shading.phong.light == LightSource::From(DVec3::NEG_Z * 2.0));
        let planes = settings("--clip -x=1 --cut 0,0,2:0,0,1 --cut-opacity 0.5 --cut-edges").expect("valid").planes;
        let used: Vec<_> = planes.iter().map(|plane| (plane.normal, plane.used)).collect();
        assert_eq!(used, [(DVec3::NEG_X, PlaneUse::Clip), (DVec3::Z, PlaneUse::Cut { opacity: 0.5, edges: true })]);
        let faces = settings("--mode iso --faces --face-opacity 0.25 --face-color 1,0,0.5 --face-edges").expect("valid").faces;
        assert_eq!(faces, Some(Faces { opacity: 0.25, color: Some([1.0, 0.0, 0.5]), edges: true }));
        assert_eq!((settings("--faces").expect("valid").faces, plain.faces), (Some(Faces::default()), None));
        let phong = settings("--shade phong --specular 0 --shininess 3").expect("valid").shading;
        assert!(phong.volume && phong.phong.specular == 0.0 && phong.phong.shininess == 3.0);
    }

    #[test]
    fn contradictions_are_refused() {
        for flags in [
            "--mode iso",
            "--mode mip --iso 1",
            "--mode mip --shade phong",
            "--xray mean",
            "--mode best",
            "--iso 1,2,3 --iso-opacity 0.1,0.2",
            "--iso 1 --iso-opacity 2",
            "--iso x",
            "--iso 1,2,3,4,5,6,7,8,9",
            "--clip w=1",
            "--mode mip --cut x=0",
            "--mode mip --faces",
            "--face-edges",
            "--faces --face-opacity 2",
            "--faces --face-color 1,2,0",
            "--cut x=0 --cut-opacity 2",
            "--cut-edges",
            "--clip x=0 --clip y=0 --clip z=0 --cut x=1 --cut y=1 --cut z=1 --cut x=2",
            "--light 0,0,0",
            "--light 1e300,0,0",
            "--ambient 1e60",
            "--light 1,2",
            "--shininess 0.5",
            "--iso-opacity 1",
        ] {
            assert!(settings(flags).is_err(), "{flags}");
        }
    }
}
