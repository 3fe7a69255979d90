//! Planes that clip the picture, and planes that are drawn in it.

use super::plane_handles::facing;
use super::viewer::Viewer;
use super::widgets::significant;
use crate::geometry::Aabb;
use crate::view::{Plane, PlaneUse, Planes};
use egui::{Button, DragValue, Slider, SliderClamping, Ui};
use glam::DVec3;

/// Normals to choose from, by name.
const AXES: [(&str, DVec3); 3] = [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)];

impl Viewer {
    /// The section of the panel.
    pub(super) fn planes_section(&mut self, ui: &mut Ui) {
        let bounds = self.world_bounds();
        let towards_eye = (self.settings.camera.eye - self.settings.camera.target).normalize_or(DVec3::Z);
        let before: Vec<Plane> = self.settings.render.planes.iter().collect();
        let mut planes = before.clone();
        let mut gone = None;
        self.plane_tool.hovered = None;
        for (i, plane) in planes.iter_mut().enumerate() {
            let rows = ui.push_id(("plane", i), |ui| {
                let mut is_selected = self.plane_tool.selected == Some(i);
                ui.vertical(|ui| {
                    if plane_rows(ui, i, plane, bounds, &mut is_selected) {
                        gone = Some(i);
                    }
                    if is_selected {
                        normal_rows(ui, i, plane, bounds, towards_eye);
                    }
                    cut_row(ui, plane);
                });
                is_selected
            });
            match (rows.inner, self.plane_tool.selected == Some(i)) {
                (true, false) => self.plane_tool.selected = Some(i),
                (false, true) => self.plane_tool.selected = None,
                _ => {}
            }
            if ui.rect_contains_pointer(rows.response.rect) {
                self.plane_tool.hovered = Some(i);
            }
        }
        if let Some(i) = gone {
            planes.remove(i);
            self.plane_tool.hovered = None;
            self.plane_tool.selected = self.plane_tool.selected.filter(|&selected| selected != i).map(|s| if s > i { s - 1 } else { s });
        }
        ui.horizontal(|ui| {
            let is_full = planes.len() == Planes::MOST;
            let button = |ui: &mut Ui, text: &str, tip: &str| ui.add_enabled(!is_full, Button::new(text)).on_hover_text(tip).clicked();
            // Clipped is what lies before the plane, so that one looks at where it cuts.
            let normal = -free_axis(towards_eye, bounds.center(), &planes);
            let clip = Plane { point: bounds.center(), normal, used: PlaneUse::Clip };
            let cut = Plane { normal: -normal, used: PlaneUse::Cut { opacity: 1.0, edges: true }, ..clip };
            let number = planes.len();
            if button(ui, "Add clip", "Draw only what lies on one side of a plane") {
                planes.push(clip);
            }
            if button(ui, "Add cut", "Draw a plane in the data, in the colours of the values on it") {
                planes.push(cut);
            }
            if planes.len() > number {
                self.plane_tool.selected = Some(number);
            }
            ui.checkbox(&mut self.plane_tool.is_shown, "handles").on_hover_text(
                "Outline and arrow of the plane that is selected, over the picture: drag the arrow to move the plane, its tip to turn it. They \
                 are not in saved pictures",
            );
        });
        if planes != before {
            self.settings.render.planes = Planes::new(&planes).unwrap_or(self.settings.render.planes);
        }
    }
}

/// The axis that goes most along a direction, to the same side; the next if a plane lies already across it through `middle`: of two planes in
/// one neither can be told from the other.
fn free_axis(direction: DVec3, middle: DVec3, planes: &[Plane]) -> DVec3 {
    let mut axes = AXES.map(|(_, axis)| axis * direction.dot(axis).signum());
    axes.sort_by(|a, b| b.dot(direction).total_cmp(&a.dot(direction)));
    let lies_across =
        |axis: DVec3| planes.iter().any(|plane| plane.normal.normalize().abs() == axis.abs() && (plane.point - middle).dot(axis) == 0.0);
    axes.into_iter().find(|&axis| !lies_across(axis)).unwrap_or(axes[0])
}

/// What a plane is and where it lies; whether it is to go.
fn plane_rows(ui: &mut Ui, number: usize, plane: &mut Plane, bounds: Aabb, is_selected: &mut bool) -> bool {
    let row = ui.horizontal(|ui| {
        let name = if plane.used == PlaneUse::Clip { "clip" } else { "cut" };
        ui.toggle_value(is_selected, format!("{} {name}", number + 1))
            .on_hover_text("Select it: its handles are over the picture, and its normal is below");
        ui.spacing_mut().slider_width = 100.0;
        let normal = plane.normal.normalize();
        let [lo, hi] = bounds.extent_along(normal);
        let at = plane.point.dot(normal);
        // Along -x the position is the x of the plane all the same.
        let sign = if AXES.iter().any(|(_, axis)| normal == -*axis) { -1.0 } else { 1.0 };
        let mut shown = sign * at;
        let range = if sign > 0.0 { lo..=hi } else { -hi..=-lo };
        let slider = Slider::new(&mut shown, range).clamping(SliderClamping::Never).custom_formatter(|v, _| significant(v));
        let slider = ui.add(slider);
        slider.ctx.accesskit_node_builder(slider.id, |node| node.set_label(format!("plane {} at", number + 1)));
        if slider.on_hover_text("Where it lies along its normal, world units").changed() {
            plane.point += normal * (sign * shown - at);
        }
        ui.small_button("x").on_hover_text("Remove this plane").clicked()
    });
    row.inner
}

/// What a plane is perpendicular to.
fn normal_rows(ui: &mut Ui, number: usize, plane: &mut Plane, bounds: Aabb, towards_eye: DVec3) {
    let kept = if plane.used == PlaneUse::Clip { "; kept is what the normal points to" } else { "" };
    let labelled = |response: &egui::Response, name: &str| {
        let name = format!("plane {} {name}", number + 1);
        response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
    };
    ui.horizontal(|ui| {
        ui.add_space(12.0);
        let normal = plane.normal.normalize();
        for (name, axis) in AXES {
            let button = ui.add(Button::selectable(normal.abs() == axis, format!(" {name} ")));
            labelled(&button, &format!("along {name}"));
            if button.on_hover_text(format!("Perpendicular to {name}{kept}")).clicked() {
                *plane = facing(plane, axis, bounds);
            }
        }
        let view = ui.add(Button::selectable(normal == towards_eye, "view"));
        if view.on_hover_text(format!("Facing the eye where it is now{kept}")).clicked() {
            *plane = facing(plane, towards_eye, bounds);
        }
        if ui.button("flip").on_hover_text("Turn the normal around: the other side").clicked() {
            plane.normal = -plane.normal;
        }
    });
    ui.horizontal(|ui| {
        ui.add_space(12.0);
        ui.weak("normal");
        let DVec3 { x, y, z } = &mut plane.normal;
        for (value, axis) in [(x, "x"), (y, "y"), (z, "z")] {
            let before = *value;
            let drag = DragValue::new(value).speed(0.01).custom_formatter(|v, _| significant(v + 0.0)).update_while_editing(false);
            let drag = ui.add_sized([56.0, 18.0], drag);
            // Who only looked at the rounded number changes nothing.
            if !drag.dragged() && significant(before) == significant(*value) {
                *value = before;
            }
            labelled(&drag, &format!("normal {axis}"));
            drag.on_hover_text(format!("{axis} of the normal, which may have any length but 0{kept}"));
        }
    });
}

/// How a plane that is drawn looks.
fn cut_row(ui: &mut Ui, plane: &mut Plane) {
    let PlaneUse::Cut { opacity, edges } = &mut plane.used else { return };
    ui.horizontal(|ui| {
        ui.add_space(12.0);
        ui.weak("opacity");
        ui.add(DragValue::new(opacity).range(0.0..=1.0).speed(0.01).max_decimals(2)).on_hover_text("0 to 1");
        ui.checkbox(edges, "edges").on_hover_text("The tets' edges on the plane, exact in both pictures");
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_plane_faces_the_nearest_axis_where_there_is_none_yet() {
        let axis = |x, y, z, planes: &[Plane]| free_axis(DVec3::new(x, y, z), DVec3::ONE, planes);
        assert_eq!(axis(0.3, -0.8, 0.5, &[]), DVec3::NEG_Y);
        assert_eq!(axis(0.5, 0.5, 0.5, &[]), DVec3::X);
        let across = |point, normal| Plane { point, normal, used: PlaneUse::Clip };
        assert_eq!(axis(0.3, -0.8, 0.5, &[across(DVec3::ONE, DVec3::Y * 2.0)]), DVec3::Z);
        assert_eq!(axis(0.3, -0.8, 0.5, &[across(DVec3::ZERO, DVec3::Y)]), DVec3::NEG_Y, "beside it");
        assert_eq!(axis(0.3, -0.8, 0.5, &[DVec3::X, DVec3::Y, DVec3::Z].map(|normal| across(DVec3::ONE, normal))), DVec3::NEG_Y);
    }
}
