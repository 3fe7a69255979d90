//! The widgets beside the picture.

use super::keys::{Action, tip};
use super::model::Data;
use super::settings::{Transfer, component_label};
use super::viewer::Viewer;
use super::widgets::{choice, combo, mebibytes, number, numbers, row, rows, section, significant, thousands};
use crate::mesh::{Component, DataArray, TetMesh};
use crate::view::{RendererKind, Skip, Steps, TransferFunction};
use crate::volume::Grid;
use egui::{Color32, RichText, Slider, Ui, pos2, vec2};

impl Viewer {
    /// All of the panel.
    pub(super) fn panel(&mut self, ui: &mut Ui) {
        ui.spacing_mut().slider_width = 100.0;
        ui.spacing_mut().combo_width = 172.0;
        self.octree.held = false; // the slider that is says so
        ui.add_space(6.0);
        self.file_buttons(ui);
        section(ui, "Field", |ui| self.field(ui));
        section(ui, "Colours", |ui| self.colours(ui));
        section(ui, "Mode", |ui| self.mode(ui));
        section(ui, "Picture", |ui| self.picture_settings(ui));
        section(ui, "Octree", |ui| self.thresholds(ui));
        section(ui, "Accuracy", |ui| self.accuracy(ui));
        section(ui, "Size", |ui| self.size(ui));
        section(ui, "Camera", |ui| self.camera_section(ui));
        section(ui, "Around the picture", |ui| self.look_section(ui));
        match self.document.data.clone() {
            Data::Mesh(mesh) => section(ui, "Mesh", |ui| mesh_numbers(ui, &mesh)),
            Data::Volume(grid) => section(ui, "Volume", |ui| volume_numbers(ui, &grid)),
        }
        ui.add_space(8.0);
    }

    fn file_buttons(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            if ui.button("Open...").on_hover_text(tip("Open another mesh or volume, or drop a file on the window", Action::Open)).clicked()
            {
                self.choose_file(&ui.ctx().clone());
            }
            self.recent_menu(ui);
            self.button(ui, "Reload", "Read the file again; camera, colours and thresholds stay", Action::Reload);
            ui.add(egui::Label::new(RichText::new(&self.document.name).strong()).truncate());
        });
        ui.horizontal(|ui| {
            self.button(ui, "Open session...", "Data, thresholds, camera, colours and all else from a file", Action::OpenSession);
            self.button(ui, "Save session...", "All that is chosen into a file; octetra render --session draws it", Action::SaveSession);
        });
        ui.horizontal(|ui| {
            self.screenshot_button(ui);
            self.turntable_button(ui);
            self.transparent_checkbox(ui);
        });
        self.picture_size_widgets(ui);
        ui.horizontal(|ui| {
            self.button(ui, "Undo", "Take the last change of a setting back; the camera has its own undo", Action::UndoSettings);
            self.button(ui, "Redo", "Change it again", Action::RedoSettings);
            self.button(ui, "Keys", "What keys and mouse do", Action::Help);
        });
    }

    fn field(&mut self, ui: &mut Ui) {
        let mesh = match self.document.data.clone() {
            Data::Mesh(mesh) => mesh,
            Data::Volume(grid) => return numbers(ui, "field", |ui| number(ui, "Array", grid.name().to_owned())),
        };
        let arrays = || mesh.point_data().iter().map(|a| (a, "points")).chain(mesh.cell_data().iter().map(|a| (a, "cells")));
        let field = &mut self.settings.field;
        rows(ui, "field", |ui| {
            let current = field.name.clone().unwrap_or_default();
            combo(ui, "Array", "The point or cell array that is shown", &current, |ui| {
                for (array, of) in arrays() {
                    let text = format!("{} ({of}{})", array.name, vector_label(array));
                    if ui.selectable_label(array.name == current, text).clicked() {
                        (field.name, field.component) = (Some(array.name.clone()), Component::Magnitude);
                    }
                }
            });
            let Some(components) = arrays().map(|(a, _)| a).find(|a| a.name == current).map(|a| a.components) else { return };
            if components > 1 {
                let all = std::iter::once(Component::Magnitude).chain((0..components).map(Component::Index));
                let chosen = component_label(field.component, components);
                combo(ui, "Component", "What is taken of the vector", &chosen, |ui| {
                    for component in all {
                        ui.selectable_value(&mut field.component, component, component_label(component, components));
                    }
                });
            }
        });
    }

    fn colours(&mut self, ui: &mut Ui) {
        let range = self.octree.model.as_ref().map(|model| model.value_range);
        let transfer = &mut self.settings.transfer;
        rows(ui, "colours", |ui| {
            combo(ui, "Colour map", "Preset transfer functions: colour and opacity over the value", &transfer.name.clone(), |ui| {
                for name in TransferFunction::PRESETS {
                    let chosen = ui.selectable_label(transfer.name == name, name).clicked();
                    if let Some(base) = TransferFunction::preset(name).ok().filter(|_| chosen) {
                        *transfer = Transfer { density: transfer.density, ..Transfer::new(base) };
                    }
                }
            });
            let density = Slider::new(&mut transfer.density, 0.05..=20.0).logarithmic(true).max_decimals(2);
            row(ui, "Density", "How opaque everything is: what extinction is multiplied by", density);
        });
        bar(ui, &transfer.base);
        if let Some([lo, hi]) = transfer.base.range.or(range) {
            ui.horizontal(|ui| {
                ui.weak(significant(lo));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.weak(significant(hi)));
            });
        }
    }

    fn picture_settings(&mut self, ui: &mut Ui) {
        let mut kind = self.settings.render.renderer;
        let render = &mut self.settings.render;
        rows(ui, "picture", |ui| {
            choice(
                ui,
                "Renderer",
                "What is drawn; E flips between the two",
                &mut kind,
                &[
                    (RendererKind::Octree, "octree", "The octree texture, marched on the GPU (E flips to exact)"),
                    (
                        RendererKind::Exact,
                        "exact",
                        "The mesh itself, every ray through every tet: what the octree is to look like (E flips to the octree)",
                    ),
                ],
            );
            choice(
                ui,
                "Steps",
                "Where the octree is looked up along a ray",
                &mut render.steps,
                &[
                    (Steps::Leaf, "leaf", "From leaf to leaf: misses nothing"),
                    (Steps::Paper, "paper", "The paper's rule: the step of the depth, stepping back where the octree gets deeper"),
                    (Steps::Fixed, "fixed", "One step everywhere, as through a regular volume"),
                ],
            );
            choice(
                ui,
                "Skip",
                "How to get past what the transfer function does not show; the picture stays the same, only its time changes (not with the \
                 paper's steps)",
                &mut render.skip,
                &[
                    (Skip::Octree, "active", "From one leaf of which something is seen to the next"),
                    (Skip::Half, "half", "Half-splitting: from the first such leaf to the last in each half of the volume"),
                    (Skip::Parts(8), "k = 8", "From the first to the last in each eighth of a ray"),
                    (Skip::None, "none", "Nothing is skipped"),
                ],
            );
        });
        if kind != self.settings.render.renderer {
            self.draw_with(kind);
        }
    }
}

fn mesh_numbers(ui: &mut Ui, mesh: &TetMesh) {
    numbers(ui, "mesh", |ui| {
        number(ui, "Points", thousands(mesh.points().len()));
        number(ui, "Tets", thousands(mesh.tets().len()));
        number(ui, "Zero volume", thousands(mesh.zero_volume_count()));
        number(ui, "Inverted", thousands(mesh.inverted_count()));
        number(ui, "Memory", mebibytes(mesh.bytes()));
    });
}

fn volume_numbers(ui: &mut Ui, grid: &Grid) {
    let ([x, y, z], spacing) = (grid.frame().dims, grid.frame().spacing());
    numbers(ui, "volume", |ui| {
        number(ui, "Points", format!("{x} x {y} x {z} of {}", grid.samples().type_name()));
        number(ui, "Spacing", [spacing.x, spacing.y, spacing.z].map(significant).join(" x "));
        number(ui, "Missing", thousands(grid.missing()));
        let mapped = if grid.samples().is_mapped() { " (mapped)" } else { "" };
        number(ui, "Memory", mebibytes(grid.samples().bytes()) + mapped);
    });
}

/// Colours over the value, with opacity as a line.
fn bar(ui: &mut Ui, tf: &TransferFunction) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 36.0), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "colours and opacity over the value"));
    let x = |v: f64| rect.left() + rect.width() * v.clamp(0.0, 1.0) as f32;
    // Knots end the bar where they do not reach its ends: the first and last colours go on.
    let (first, last) = (tf.color.first().copied(), tf.color.last().copied());
    let ends = [first.map(|c| (0.0, c)), last.map(|c| (1.0, c))];
    let inner = tf.color.iter().map(|c| (c[0], *c));
    let mut mesh = egui::Mesh::default();
    for (at, [_, r, g, b]) in ends[0].into_iter().chain(inner).chain(ends[1]) {
        let [r, g, b] = [r, g, b].map(|v| (v * 255.0).round() as u8);
        let next = mesh.vertices.len() as u32;
        for y in [rect.top(), rect.bottom()] {
            mesh.colored_vertex(pos2(x(at), y), Color32::from_rgb(r, g, b));
        }
        if next > 0 {
            mesh.add_triangle(next - 2, next - 1, next);
            mesh.add_triangle(next - 1, next, next + 1);
        }
    }
    ui.painter().add(mesh);
    let y = |opacity: f64| rect.bottom() - 2.0 - (rect.height() - 4.0) * opacity as f32;
    let ends = [tf.opacity.first().map(|o| [0.0, o[1]]), tf.opacity.last().map(|o| [1.0, o[1]])];
    let line = ends[0].into_iter().chain(tf.opacity.iter().copied()).chain(ends[1]);
    let points: Vec<_> = line.map(|[at, opacity]| pos2(x(at), y(opacity))).collect();
    ui.painter().line(points.clone(), egui::Stroke::new(3.0, Color32::BLACK));
    ui.painter().line(points, egui::Stroke::new(1.5, Color32::WHITE));
}

fn vector_label(array: &DataArray) -> String {
    if array.components > 1 { format!(", {} numbers", array.components) } else { String::new() }
}
