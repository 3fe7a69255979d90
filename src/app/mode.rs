//! What a pixel shows: mode, isosurfaces, shading.

use super::color_choice::color_button;
use super::viewer::Viewer;
use super::widgets::{choice, combo, row, rows, significant};
use crate::view::{Faces, Isosurface, Isosurfaces, LightSource, Mode, Shading};
use egui::{DragValue, Slider, SliderClamping, Ui};

/// Modes by what they are called in the list.
const MODES: [(Mode, &str, &str); 6] = [
    (Mode::Composite, "composite", "Light through the volume, and the isosurfaces in it"),
    (Mode::Iso, "isosurfaces", "Surfaces of equal value, nothing else"),
    (Mode::Maximum, "largest (MIP)", "The largest value on each ray, in its colour"),
    (Mode::Minimum, "smallest (MinIP)", "The smallest value on each ray, in its colour"),
    (Mode::Mean, "X-ray: mean", "The mean of the value over each ray's length in the data"),
    (Mode::Integral, "X-ray: integral", "The integral of the value over that length, in data units times world units"),
];

impl Viewer {
    /// The section of the panel.
    pub(super) fn mode(&mut self, ui: &mut Ui) {
        let field = &self.settings.field;
        let range = self.octree.model.as_ref().filter(|model| model.field == *field).map(|model| model.value_range);
        let towards_eye = self.settings.camera.eye - self.settings.camera.target;
        let render = &mut self.settings.render;
        rows(ui, "mode", |ui| {
            let chosen = MODES.iter().find(|(mode, ..)| *mode == render.mode).map_or("", |(_, name, _)| *name);
            combo(ui, "Mode", "What a pixel shows", chosen, |ui| {
                for (mode, name, tip) in MODES {
                    ui.selectable_value(&mut render.mode, mode, name).on_hover_text(tip);
                }
            });
        });
        // Without a surface there would be nothing to see.
        let has_surfaces = render.with_surfaces() || render.drawn_faces().is_some();
        if let (Mode::Iso, Some(range), false) = (render.mode, range, has_surfaces) {
            render.isosurfaces = first_surface(range);
        }
        if render.mode.is_number() {
            return;
        }
        isosurfaces(ui, &mut render.isosurfaces, range);
        boundary_faces(ui, &mut render.faces);
        shading(ui, &mut render.shading, render.mode, towards_eye);
    }
}

/// One in the middle of the range.
fn first_surface([lo, hi]: [f64; 2]) -> Isosurfaces {
    Isosurfaces::new(&[Isosurface::at(0.5 * (lo + hi))]).unwrap_or_default()
}

/// A row for each surface, and a button for one more.
fn isosurfaces(ui: &mut Ui, surfaces: &mut Isosurfaces, range: Option<[f64; 2]>) {
    let [lo, hi] = range.unwrap_or([0.0, 1.0]);
    let mut list: Vec<Isosurface> = surfaces.iter().collect();
    let (mut gone, mut changed) = (None, false);
    for (i, surface) in list.iter_mut().enumerate() {
        ui.push_id(("isosurface", i), |ui| {
            ui.horizontal(|ui| {
                ui.spacing_mut().slider_width = 72.0;
                let value =
                    Slider::new(&mut surface.value, lo..=hi).clamping(SliderClamping::Never).custom_formatter(|v, _| significant(v));
                changed |= ui.add(value).on_hover_text("The value of the surface, data units").changed();
                let opacity = DragValue::new(&mut surface.opacity).range(0.0..=1.0).speed(0.01).max_decimals(2);
                changed |= ui.add(opacity).on_hover_text("Its opacity, 0 to 1").changed();
                changed |= own_color(ui, &mut surface.color);
                if ui.small_button("x").on_hover_text("Remove this surface").clicked() {
                    gone = Some(i);
                }
            });
        });
    }
    if let Some(i) = gone {
        list.remove(i);
    }
    let is_full = list.len() == Isosurfaces::MOST;
    let more = ui.add_enabled(!is_full, egui::Button::new("Add isosurface"));
    let added = more.on_hover_text("A surface on which the field has one value, drawn in the volume or alone").clicked();
    if added {
        // Where there is most room.
        let mut values: Vec<f64> = [lo, hi].into_iter().chain(list.iter().map(|surface| surface.value)).collect();
        values.sort_by(f64::total_cmp);
        let widest = values.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
        list.push(Isosurface::at(widest.map_or(lo, |pair| 0.5 * (pair[0] + pair[1]))));
    }
    if changed || gone.is_some() || added {
        *surfaces = Isosurfaces::new(&list).unwrap_or(*surfaces);
    }
}

/// Whether the boundary faces are drawn, and how.
fn boundary_faces(ui: &mut Ui, faces: &mut Option<Faces>) {
    ui.horizontal(|ui| {
        let mut are_drawn = faces.is_some();
        let tip = "The faces that the data end at, in depth order with the volume";
        if ui.checkbox(&mut are_drawn, "Boundary faces").on_hover_text(tip).changed() {
            // So that what lies behind is seen from the first.
            *faces = are_drawn.then_some(Faces { opacity: 0.3, ..Faces::default() });
        }
        let Some(faces) = faces else { return };
        ui.push_id("faces", |ui| {
            ui.add(DragValue::new(&mut faces.opacity).range(0.0..=1.0).speed(0.01).max_decimals(2)).on_hover_text("Their opacity, 0 to 1");
            own_color(ui, &mut faces.color);
            ui.checkbox(&mut faces.edges, "edges").on_hover_text("The edges of the mesh on its boundary; a volume has none");
        });
    });
}

/// A colour of its own, or the transfer function's; whether it changed.
fn own_color(ui: &mut Ui, color: &mut Option<[f32; 3]>) -> bool {
    let mut is_own = color.is_some();
    let mut changed = ui.checkbox(&mut is_own, "").on_hover_text("A colour of its own; else the transfer function's").changed();
    if changed {
        *color = is_own.then_some([0.9, 0.9, 0.9]);
    }
    if let Some([r, g, b]) = color {
        let before = [*r, *g, *b].map(f64::from);
        let mut chosen = before;
        color_button(ui, &mut chosen, "The surface's colour");
        if chosen != before {
            [*r, *g, *b] = chosen.map(|v| v as f32);
            changed = true;
        }
    }
    changed
}

/// What is shaded, and how.
fn shading(ui: &mut Ui, shading: &mut Shading, mode: Mode, towards_eye: glam::DVec3) {
    ui.horizontal(|ui| {
        ui.label("Shade");
        if mode == Mode::Composite {
            ui.checkbox(&mut shading.volume, "volume").on_hover_text("Phong's reflection by the field's gradient, all along each ray");
        }
        ui.checkbox(&mut shading.surfaces, "isosurfaces")
            .on_hover_text("Phong's reflection, of boundary faces too; without it surfaces are flat patches of colour");
    });
    if !(shading.surfaces || (shading.volume && mode == Mode::Composite)) {
        return;
    }
    let phong = &mut shading.phong;
    rows(ui, "shading", |ui| {
        let mut stays = phong.light != LightSource::Camera;
        let from_here = "It stays where the camera is now";
        choice(
            ui,
            "Light",
            "Where light comes from",
            &mut stays,
            &[(false, "camera", "It follows the camera"), (true, "stays", from_here)],
        );
        match (stays, phong.light) {
            (true, LightSource::Camera) => phong.light = LightSource::From(towards_eye),
            (false, _) => phong.light = LightSource::Camera,
            (true, LightSource::From(_)) => {}
        }
        let share = |value| Slider::new(value, 0.0..=1.0).clamping(SliderClamping::Edits).custom_formatter(|v, _| format!("{v:.2}"));
        row(ui, "Ambient", "Light from everywhere", share(&mut phong.ambient));
        row(ui, "Diffuse", "Light scattered by what faces it", share(&mut phong.diffuse));
        row(ui, "Specular", "The highlight", share(&mut phong.specular));
        let shininess = Slider::new(&mut phong.shininess, 1.0..=200.0).logarithmic(true).clamping(SliderClamping::Edits);
        let shininess = shininess.custom_formatter(|v, _| format!("{v:.0}"));
        row(ui, "Shininess", "The larger, the smaller the highlight", shininess);
    });
}
