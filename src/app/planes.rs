//! Planes that clip the picture, and planes that are drawn in it.

use super::viewer::Viewer;
use super::widgets::significant;
use crate::geometry::{Aabb, Placed};
use crate::view::{Plane, PlaneUse, Planes};
use egui::{ComboBox, DragValue, Slider, SliderClamping, Ui};
use glam::DVec3;

/// Normals to choose from, by name.
const NORMALS: [(&str, DVec3); 6] =
    [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z), ("-x", DVec3::NEG_X), ("-y", DVec3::NEG_Y), ("-z", DVec3::NEG_Z)];

impl Viewer {
    /// The section of the panel.
    pub(super) fn planes_section(&mut self, ui: &mut Ui) {
        let bounds = self.document.data.bounds().translated(self.document.data.center());
        let towards_eye = (self.settings.camera.eye - self.settings.camera.target).normalize_or(DVec3::Z);
        let before: Vec<Plane> = self.settings.render.planes.iter().collect();
        let mut planes = before.clone();
        let mut gone = None;
        for (i, plane) in planes.iter_mut().enumerate() {
            ui.push_id(("plane", i), |ui| {
                if plane_rows(ui, i, plane, bounds, towards_eye) {
                    gone = Some(i);
                }
            });
        }
        if let Some(i) = gone {
            planes.remove(i);
        }
        ui.horizontal(|ui| {
            let is_full = planes.len() == Planes::MOST;
            let button =
                |ui: &mut Ui, text: &str, tip: &str| ui.add_enabled(!is_full, egui::Button::new(text)).on_hover_text(tip).clicked();
            let middle = Plane { point: bounds.center(), normal: DVec3::X, used: PlaneUse::Clip };
            if button(ui, "Add clip", "Draw only what lies on one side of a plane") {
                planes.push(middle);
            }
            if button(ui, "Add cut", "Draw a plane in the data, in the colours of the values on it") {
                planes.push(Plane { used: PlaneUse::Cut { opacity: 1.0, edges: true }, ..middle });
            }
        });
        if planes != before {
            self.settings.render.planes = Planes::new(&planes).unwrap_or(self.settings.render.planes);
        }
    }
}

/// What a plane is and where it lies; whether it is to go.
fn plane_rows(ui: &mut Ui, number: usize, plane: &mut Plane, bounds: Aabb, towards_eye: DVec3) -> bool {
    let mut is_gone = false;
    let along = |normal: DVec3| {
        let corners = (0..8).map(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            DVec3::new(pick(0), pick(1), pick(2)).dot(normal)
        });
        corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], at| [lo.min(at), hi.max(at)])
    };
    ui.horizontal(|ui| {
        let (is_clip, name) = (plane.used == PlaneUse::Clip, if plane.used == PlaneUse::Clip { "clip" } else { "cut" });
        ui.label(format!("{} {name}", number + 1));
        let chosen = NORMALS.iter().find(|(_, normal)| *normal == plane.normal).map_or("view", |(name, _)| name);
        let tip =
            if is_clip { "Towards what is kept; `view` is the direction to the eye as it is now" } else { "What it is perpendicular to" };
        let combo = ComboBox::from_id_salt("normal").width(48.0).selected_text(chosen).show_ui(ui, |ui| {
            let view = ("view", towards_eye);
            for (name, normal) in NORMALS.into_iter().chain([view]) {
                if ui.selectable_label(name == chosen, name).clicked() {
                    // Through the middle, lest the plane lies beside the data.
                    *plane = Plane { normal, point: bounds.center(), ..*plane };
                }
            }
        });
        combo.response.on_hover_text(tip);
        ui.spacing_mut().slider_width = 64.0;
        let normal = plane.normal.normalize();
        let [lo, hi] = along(normal);
        let at = plane.point.dot(normal);
        // Along -x the position is the x of the plane all the same.
        let sign = if normal.min_element() < 0.0 && NORMALS.iter().any(|(_, n)| *n == normal) { -1.0 } else { 1.0 };
        let mut shown = sign * at;
        let range = if sign > 0.0 { lo..=hi } else { -hi..=-lo };
        let slider = Slider::new(&mut shown, range).clamping(SliderClamping::Never).custom_formatter(|v, _| significant(v));
        if ui.add(slider).on_hover_text("Where it lies, world units").changed() {
            plane.point += normal * (sign * shown - at);
        }
        if ui.small_button("x").on_hover_text("Remove this plane").clicked() {
            is_gone = true;
        }
    });
    if let PlaneUse::Cut { opacity, edges } = &mut plane.used {
        ui.horizontal(|ui| {
            ui.label("   opacity");
            ui.add(DragValue::new(opacity).range(0.0..=1.0).speed(0.01).max_decimals(2)).on_hover_text("0 to 1");
            ui.checkbox(edges, "edges").on_hover_text("The tets' edges on the plane, exact in both pictures");
        });
    }
    is_gone
}
