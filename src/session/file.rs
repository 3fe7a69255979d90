//! Session files: read and checked, written with paths that go along when the folder is moved.

use super::Session;
use super::source::relative_to;
use crate::image::write_atomically;
use serde_json::{Map, Value};
use std::io;
use std::path::{Path, PathBuf};

/// Why a session cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The file system's reason.
    #[error("{}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The reason.
        #[source]
        cause: io::Error,
    },
    /// Something in it that is not as expected.
    #[error("{}: not a session: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The key, and what was expected.
        what: String,
    },
}

impl Session {
    /// Reads a session and checks all of it. Its paths are as seen from where the program runs.
    pub fn read(path: &Path) -> Result<Session, SessionError> {
        let text = std::fs::read_to_string(path).map_err(|cause| SessionError::Io { path: path.into(), cause })?;
        let session = parsed(&text).map_err(|what| SessionError::Content { path: path.into(), what })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Ok(Session { data: session.data.clone().map(|file| folder.join(file)), ..session })
    }

    /// Writes a session; paths are as seen from the folder where it comes to lie, if that has a way to them.
    pub fn write(&self, path: &Path) -> Result<(), SessionError> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let session = Session { data: self.data.clone().map(|file| relative_to(folder, &file)), ..self.clone() };
        let failed = |cause| SessionError::Io { path: path.into(), cause };
        let text = serde_json::to_string_pretty(&session).map_err(|error| failed(error.into()))? + "\n";
        write_atomically(path, |out| out.write_all(text.as_bytes())).map_err(failed)
    }
}

/// The session that a text holds, checked, or what is wrong with it.
fn parsed(text: &str) -> Result<Session, String> {
    let keys: Map<String, Value> = serde_json::from_str(text).map_err(|error| error.to_string())?;
    match keys.get("octetra_session") {
        None => return Err(format!("there is no key \"octetra_session\", expected {}", Session::VERSION)),
        Some(version) if version.as_u64() != Some(Session::VERSION.into()) => {
            return Err(format!("octetra_session is {version}, expected {}", Session::VERSION));
        }
        Some(_) => {}
    }
    let session: Session = serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_str(text)).map_err(|error| {
        let (key, cause) = (error.path().to_string(), error.inner());
        if key == "." { cause.to_string() } else { format!("{key}: {cause}") }
    })?;
    session.check().map(|()| session)
}

impl Session {
    fn check(&self) -> Result<(), String> {
        self.thresholds.validate().map_err(|error| format!("thresholds: {error}"))?;
        self.transfer_function.validate().map_err(|error| format!("transfer_function: {error}"))?;
        self.render.validate().map_err(|error| format!("render.{error}"))?;
        if !self.background.iter().all(|v| (0.0..=1.0).contains(v)) {
            return Err(format!("background is {:?}, expected three numbers in [0, 1]", self.background));
        }
        match self.furniture_scale {
            Some(scale) if !(0.1..=100.0).contains(&scale) => Err(format!("furniture_scale is {scale}, expected 0.1 to 100 or null")),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Source;
    use super::*;
    use crate::format::RawLayout;
    use crate::format::segy::SegyOptions;
    use crate::furniture::Parts;
    use crate::mesh::Component;
    use crate::octree::Preset;
    use crate::view::{
        Camera, Faces, Intervals, Isosurface, Isosurfaces, LightSource, Mode, Output, Phong, Plane, PlaneUse, Planes, Projection,
        RenderSettings, RendererKind, Shading, Skip, Steps, TransferFunction,
    };
    use glam::DVec3;

    /// A session that has nothing as it is by default.
    fn odd(file: PathBuf) -> Session {
        let eye = DVec3::new(1.0, 0.1, 1e-17);
        Session {
            data: Source {
                solution: Some(file.with_extension("q")),
                more: vec![file.with_extension("more")],
                step: Some(3),
                file: Some(file),
                raw: Some(RawLayout { dims: [2, 3, 4], voxel: "i16", spacing: [0.1, 1.0, 2.0], is_big_endian: true }),
                segy: SegyOptions { iline_byte: Some(9), sample_step: Some(2.5), truncated: true, ..SegyOptions::default() },
            },
            array: Some("velocity".into()),
            component: Component::Index(5),
            thresholds: Preset::Paper.params(),
            camera: Some(Camera { eye, target: DVec3::ONE, up: DVec3::Y, projection: Projection::Parallel { view_height: 0.3 } }),
            transfer_function: TransferFunction {
                range: Some([0.1, 0.7]),
                threshold: Some([0.3, 0.4]),
                ..TransferFunction::preset("turbo").expect("a preset")
            },
            render: RenderSettings {
                width: 31,
                height: 17,
                renderer: RendererKind::Exact,
                mode: Mode::Integral,
                output: Output::Colors,
                isosurfaces: Isosurfaces::new(&[
                    Isosurface::at(0.1),
                    Isosurface { value: -1.5, color: Some([0.1, 0.2, 0.3]), opacity: 0.7 },
                ])
                .expect("valid"),
                planes: Planes::new(&[
                    Plane { point: DVec3::ONE, normal: DVec3::new(0.1, -2.0, 0.0), used: PlaneUse::Clip },
                    Plane { point: DVec3::X, normal: DVec3::Z, used: PlaneUse::Cut { opacity: 0.7, edges: true } },
                ])
                .expect("valid"),
                faces: Some(Faces { opacity: 0.3, color: Some([0.5, 0.25, 1.0]), edges: true }),
                shading: Shading {
                    volume: true,
                    surfaces: false,
                    phong: Phong { light: LightSource::From(DVec3::new(0.0, -3.0, 0.1)), shininess: 3.5, ..Phong::default() },
                },
                steps: Steps::Fixed,
                step_world: Some(0.01),
                voxels: true,
                skip: Skip::Parts(9),
                intervals: Intervals::Raster,
                min_transmittance: 0.25,
            },
            background: [0.1, 0.2, 0.3],
            transparent: true,
            furniture: "axes,box".parse::<Parts>().expect("parts"),
            furniture_in_pictures: false,
            furniture_scale: Some(1.25),
            ..Session::default()
        }
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit_and_paths_move_along() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let before = root.path().join("before");
        std::fs::create_dir(&before).expect("a folder");
        let session = odd(before.join("flow.raw"));
        session.write(&before.join("odd.json")).expect("written");
        let same = |a: Session, b: &Session| {
            assert_eq!(Session { data: Source::default(), ..a }, Session { data: Source::default(), ..b.clone() })
        };
        same(Session::read(&before.join("odd.json")).expect("read"), &session);
        let after = root.path().join("after");
        std::fs::rename(&before, &after).expect("moved");
        let read = Session::read(&after.join("odd.json")).expect("read");
        let more = vec![after.join("flow.more")];
        let expected = Source { file: Some(after.join("flow.raw")), more, solution: Some(after.join("flow.q")), ..session.data };
        assert_eq!(read.data, expected);
    }

    #[test]
    fn all_but_the_version_may_be_left_out() {
        assert_eq!(parsed(r#"{"octetra_session": 1}"#), Ok(Session::default()));
        let some =
            parsed(r#"{"octetra_session": 1, "thresholds": {"max_depth": 6}, "render": {"skip": "half", "isosurfaces": [{"value": 2}]}}"#);
        let some = some.expect("valid");
        assert_eq!((some.thresholds.max_depth, some.thresholds.tolerance), (6, Preset::Balanced.params().tolerance));
        assert_eq!((some.render.skip, some.render.width), (Skip::Half, 512));
        assert_eq!(some.render.isosurfaces.iter().collect::<Vec<_>>(), [Isosurface::at(2.0)]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (keys, expected) in [
            (r#""colour": 1"#, "colour"),
            (r#""render": {"bright": 1}"#, "render.bright"),
            (r#""render": {"steps": "tiny"}"#, "render.steps"),
            (r#""render": {"mode": "best"}"#, "render.mode: \"best\": expected composite"),
            (r#""render": {"width": 0}"#, "render.width is 0, expected 1 to 32768"),
            (r#""render": {"shading": {"phong": {"shininess": 0}}}"#, "shading.phong.shininess is 0"),
            (r#""render": {"shading": {"phong": {"light": {"from": [0, 0, 0]}}}}"#, "render.shading.phong.light"),
            (r#""render": {"isosurfaces": [{"value": 1, "opacity": 2}]}"#, "render.isosurfaces"),
            (r#""render": {"faces": {"opacity": 2}}"#, "faces.opacity"),
            (r#""render": {"faces": {"colour": 2}}"#, "colour"),
            (r#""render": {"min_transmittance": 1.0}"#, "render.min_transmittance is 1"),
            (r#""thresholds": {"max_depth": 26}"#, "thresholds: max_depth is 26"),
            (r#""thresholds": {"depth": 6}"#, "thresholds.depth"),
            (r#""camera": {"eye": [0, 0, 0], "target": [0, 0, 0], "up": [0, 0, 1]}"#, "camera"),
            (r#""transfer_function": {"color": [], "opacity": [[0, 0]]}"#, "transfer_function"),
            (r#""component": "w""#, "component: \"w\": expected magnitude"),
            (r#""furniture": "sofa""#, "furniture: \"sofa\": expected all"),
            (r#""background": [0, 0, 2]"#, "background"),
            (r#""data": {"raw": {"dims": [2, 2, 2], "type": "u7"}}"#, "data.raw"),
        ] {
            let said = parsed(&format!(r#"{{"octetra_session": 1, {keys}}}"#)).expect_err(keys);
            assert!(said.contains(expected), "{keys}: {said}");
        }
        assert!(parsed("{}").is_err_and(|said| said.contains("octetra_session")));
        assert!(parsed(r#"{"octetra_session": 2}"#).is_err_and(|said| said.contains("octetra_session is 2, expected 1")));
        assert!(parsed("[1]").is_err() && parsed("{").is_err());
        let missing = Session::read(Path::new("no-such-session.json")).expect_err("no file");
        assert!(missing.to_string().contains("no-such-session.json"));
    }
}
