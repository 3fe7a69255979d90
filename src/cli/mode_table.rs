//! `octetra bench --mode-table`: frames in every mode, and how far each picture is from the mesh's own.

use super::args::{MeshArgs, OctreeArgs, RawArgs, ViewArgs};
use super::long_work::with_bar;
use super::render::say_if_fallen_back;
use super::subject::{read_subject, regularized};
use crate::geometry::Placed;
use crate::image::psnr;
use crate::octree::{OctreeTexture, Subject};
use crate::render::{DeviceChoice, Renderer};
use crate::study::{Frames, orbit_frames};
use crate::view::{Isosurface, Isosurfaces, Mode, RenderSettings, RendererKind, Shading, View};
use anyhow::{Context, Result};
use std::io::Write;

/// Frames a second of the tool that the modes are known from, 256 x 256 x 225 voxels, 512 x 768 pixels, GeForce 8800 GTS: by mode, without
/// and with Phong's reflection (Ye et al., about 2010).
const PUBLISHED: [(Mode, Option<f64>, Option<f64>); 4] = [
    (Mode::Composite, Some(21.4), Some(9.8)),
    (Mode::Iso, Some(20.1), Some(19.4)),
    (Mode::Maximum, Some(30.3), None),
    (Mode::Mean, Some(30.3), None),
];

/// Measures and prints a row for each mode.
pub fn run(mesh: &MeshArgs, volume: &RawArgs, octree: &OctreeArgs, view: &ViewArgs, repeats: u32) -> Result<()> {
    let files = view.files()?;
    let subject = read_subject(mesh, volume)?;
    let seen = view.view(&subject, files);
    seen.transfer_function.check_range(subject.range()).with_context(|| mesh.shown_name())?;
    let renderer = Renderer::new(view.device.into())?;
    say_if_fallen_back(&renderer);
    let tree = regularized(mesh, &subject, &octree.params())?;
    let (scene, _) = renderer.octree_scene(&subject, OctreeTexture::encode(&tree)?, subject.surface(&tree))?;
    let scene = scene.with_mesh(subject.mesh().cloned());
    let truth = Renderer::new(DeviceChoice::Cpu)?;
    let exact = match &subject {
        Subject::Mesh(mesh, field) => Some(with_bar(|progress| truth.exact_scene(mesh, field, progress))?),
        Subject::Volume(_) => None,
    };
    let bounds = subject.bounds().translated(subject.center());
    let adapter = renderer.adapter().map_or("CPU".into(), |[name, backend, driver]| format!("{name} ({backend}, {driver})"));
    let mut out = std::io::stdout().lock();
    let [width, height] = view.size;
    writeln!(
        out,
        "{}: {} leaves; {adapter}; {width}x{height}, median over the 12 views of the orbit, frames as in the window",
        mesh.stem(),
        tree.leaf_count()
    )?;
    writeln!(out, "mode                    frame ms  worst  frames/s  by     dB against the mesh  published frames/s")?;
    for (name, settings) in rows(seen.settings, subject.range()) {
        let view = View { settings, ..seen.clone() };
        let in_window = View { settings: settings.stopping_at(RenderSettings::INTERACTIVE), ..seen.clone() };
        let frames = with_bar(|progress| orbit_frames(&renderer, &scene, bounds, &in_window, repeats, progress))?;
        let (by, seconds) = frames.gpu_s.as_ref().map_or(("clock", &frames.wall_s), |gpu_s| ("GPU", gpu_s));
        let (frame, worst) = Frames::median_and_worst(seconds);
        let decibels = match &exact {
            None => "-".to_owned(),
            Some(exact) => {
                let settings = RenderSettings { renderer: RendererKind::Exact, ..settings.stopping_at(0.0) };
                let of_mesh = with_bar(|progress| truth.render(exact, &View { settings, ..view.clone() }, progress))?.image;
                let of_octree = with_bar(|progress| renderer.render(&scene, &view, progress))?.image;
                format!("{:.1}", psnr(&of_mesh, &of_octree).1)
            }
        };
        let published =
            PUBLISHED.iter().find(|(mode, ..)| *mode == settings.mode && (*mode == Mode::Iso || settings.surfaces().is_empty()));
        let published = published.and_then(|&(_, plain, shaded)| if is_shaded(&settings) { shaded } else { plain });
        let published = published.map_or("-".into(), |f| f.to_string());
        let (ms, worst_ms) = (frame * 1e3, worst * 1e3);
        writeln!(out, "{name:<22}  {ms:>8.3}  {worst_ms:>5.2}  {:>8.0}  {by:<5}  {decibels:>19}  {published:>18}", 1.0 / frame)?;
        out.flush()?;
    }
    Ok(())
}

/// Whether what is drawn is shaded.
fn is_shaded(settings: &RenderSettings) -> bool {
    if settings.mode == Mode::Iso { settings.shading.surfaces } else { settings.is_volume_shaded() }
}

/// What is drawn in each row. Isosurfaces are those asked for, else one in the middle of the range.
fn rows(plain: RenderSettings, [lo, hi]: [f64; 2]) -> Vec<(&'static str, RenderSettings)> {
    let middle = Isosurfaces::new(&[Isosurface::at(0.5 * (lo + hi))]).unwrap_or_default();
    let isosurfaces = if plain.isosurfaces.is_empty() { middle } else { plain.isosurfaces };
    let plain = RenderSettings { mode: Mode::Composite, isosurfaces: Isosurfaces::NONE, ..plain };
    let [flat, phong] = [false, true].map(|is_shaded| Shading { volume: is_shaded, surfaces: is_shaded, ..plain.shading });
    let plain = RenderSettings { shading: flat, ..plain };
    vec![
        ("composite", plain),
        ("composite, phong", RenderSettings { shading: phong, ..plain }),
        ("iso", RenderSettings { mode: Mode::Iso, isosurfaces, ..plain }),
        ("iso, phong", RenderSettings { mode: Mode::Iso, isosurfaces, shading: phong, ..plain }),
        ("composite, iso, phong", RenderSettings { isosurfaces, shading: phong, ..plain }),
        ("mip", RenderSettings { mode: Mode::Maximum, ..plain }),
        ("minip", RenderSettings { mode: Mode::Minimum, ..plain }),
        ("xray", RenderSettings { mode: Mode::Mean, ..plain }),
        ("xray=integral", RenderSettings { mode: Mode::Integral, ..plain }),
    ]
}
