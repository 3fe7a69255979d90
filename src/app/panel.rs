//! The widgets beside the picture.

use super::navigate::AXES;
use super::settings::{Transfer, component_label};
use super::viewer::Viewer;
use crate::mesh::{Component, DataArray};
use crate::octree::{Boundary, Preset, Sampling};
use crate::view::{RendererKind, Steps, TransferFunction};
use egui::{Color32, ComboBox, Grid, Response, RichText, Slider, Ui, WidgetText, pos2, vec2};

/// Width of the column of names.
const NAMES: f32 = 96.0;

impl Viewer {
    /// All of the panel.
    pub(super) fn panel(&mut self, ui: &mut Ui) {
        ui.spacing_mut().slider_width = 110.0;
        ui.spacing_mut().combo_width = 172.0;
        ui.add_space(6.0);
        self.file_buttons(ui);
        section(ui, "Field", |ui| self.field(ui));
        section(ui, "Colours", |ui| self.colours(ui));
        section(ui, "Picture", |ui| self.picture_settings(ui));
        section(ui, "Octree", |ui| self.thresholds(ui));
        section(ui, "Camera", |ui| self.camera(ui));
        section(ui, "Mesh", |ui| self.mesh_numbers(ui));
        ui.add_space(8.0);
    }

    fn file_buttons(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            if ui.button("Open...").on_hover_text("Open another mesh (Ctrl+O), or drop a file on the window").clicked() {
                self.choose_file(&ui.ctx().clone());
            }
            if ui.button("Screenshot").on_hover_text("Write the picture to a PNG in the current folder (S)").clicked() {
                self.save_picture(&ui.ctx().clone());
            }
            ui.add(egui::Label::new(RichText::new(&self.document.name).strong()).truncate());
        });
    }

    fn field(&mut self, ui: &mut Ui) {
        let mesh = self.document.mesh.clone();
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
        let render = &mut self.settings.render;
        rows(ui, "picture", |ui| {
            choice(
                ui,
                "Renderer",
                &mut render.renderer,
                &[
                    (RendererKind::Octree, "octree", "The octree texture, marched on the GPU"),
                    (RendererKind::Exact, "exact", "The mesh itself, every ray through every tet: what the octree is to look like"),
                ],
            );
            choice(
                ui,
                "Steps",
                &mut render.steps,
                &[
                    (Steps::Leaf, "leaf", "From leaf to leaf: misses nothing"),
                    (Steps::Paper, "paper", "The paper's rule: the step of the depth, stepping back where the octree gets deeper"),
                ],
            );
        });
    }

    fn thresholds(&mut self, ui: &mut Ui) {
        let params = &mut self.settings.params;
        ui.horizontal(|ui| {
            for (name, preset) in Preset::ALL {
                if ui.selectable_label(*params == preset.params(), name).clicked() {
                    *params = preset.params();
                }
            }
        });
        rows(ui, "thresholds", |ui| {
            let depth = Slider::new(&mut params.max_depth, 1..=12).clamping(egui::SliderClamping::Edits);
            row(ui, "Max depth", "No cell is deeper", depth);
            let tets = Slider::new(&mut params.max_leaf_tets, 1..=1000).logarithmic(true).clamping(egui::SliderClamping::Edits);
            row(ui, "Max tets V", "A cell with fewer tets is a leaf", tets);
            let variance = Slider::new(&mut params.max_leaf_variance, 0.0..=0.1).logarithmic(true).smallest_positive(1e-7);
            let variance = variance.custom_formatter(|v, _| if v == 0.0 { "0".into() } else { format!("{v:.1e}") });
            row(ui, "Max variance W", "A cell whose values, in [0, 1], vary less is a leaf; 1e-4 is 1 % of the range", variance);
            let initial = Slider::new(&mut params.initial_cell_tets, 1.0..=10000.0).logarithmic(true).max_decimals(1);
            let initial = row(ui, "Initial tets U", "Cells are divided uniformly until they hold fewer tets than this on average", initial);
            if initial.changed() {
                params.initial_depth = None;
            }
            choice(
                ui,
                "Sampling",
                &mut params.sampling,
                &[
                    (Sampling::Tets, "tets", "A leaf's value by inverse distance to its tets: linear inside the mesh"),
                    (Sampling::Vertices, "vertices", "By inverse distance to their vertices: the paper's"),
                ],
            );
            choice(
                ui,
                "Boundary",
                &mut params.boundary,
                &[
                    (Boundary::Centres, "centres", "A leaf cut by the surface is full if its centre lies in the mesh"),
                    (Boundary::Cells, "cells", "It is full if any tet overlaps it: the paper read literally"),
                ],
            );
        });
        self.octree_numbers_grid(ui);
    }

    fn octree_numbers_grid(&self, ui: &mut Ui) {
        let Some(model) = &self.octree.model else { return };
        ui.add_space(4.0);
        let uniform = self.settings.params.uniform_depth(self.document.mesh.tets().len() - self.document.mesh.zero_volume_count());
        rows(ui, "octree numbers", |ui| {
            number(ui, "Nodes", thousands(model.nodes));
            number(ui, "Texture", mebibytes(model.bytes));
            number(ui, "Uniform to", format!("depth {uniform}"));
            number(ui, "Build, upload", format!("{:.0} ms, {:.1} ms", model.build_s * 1e3, model.upload_s * 1e3));
        });
        ui.add_space(4.0);
        ui.weak("Leaves by depth");
        leaves(ui, &model.leaves_by_depth);
    }

    fn camera(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding.x = 5.0;
            if ui.button("Fit").on_hover_text("Show all from this direction (R)").clicked() {
                self.fit();
            }
            if ui.button("Start").on_hover_text("The first view").clicked() {
                self.settings.camera = self.opening;
            }
            for (index, (name, _, forward, up)) in AXES.into_iter().enumerate() {
                if ui.button(name).on_hover_text(format!("Look along {name} ({})", index + 1)).clicked() {
                    self.face(forward, up);
                }
            }
        });
        ui.weak("Drag: left rotates, middle pans, right zooms. The wheel zooms to the pointer.");
    }

    fn mesh_numbers(&self, ui: &mut Ui) {
        let mesh = &self.document.mesh;
        rows(ui, "mesh", |ui| {
            number(ui, "Points", thousands(mesh.points().len()));
            number(ui, "Tets", thousands(mesh.tets().len()));
            number(ui, "Zero volume", thousands(mesh.zero_volume_count()));
            number(ui, "Inverted", thousands(mesh.inverted_count()));
            number(ui, "Memory", mebibytes(mesh.bytes()));
        });
    }
}

fn section(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui)) {
    ui.add_space(6.0);
    egui::CollapsingHeader::new(RichText::new(name).strong()).default_open(true).show_unindented(ui, contents);
}

fn rows(ui: &mut Ui, id: &str, contents: impl FnOnce(&mut Ui)) {
    Grid::new(id).num_columns(2).min_col_width(NAMES).spacing([8.0, 4.0]).show(ui, contents);
}

/// A name and a widget.
fn row(ui: &mut Ui, name: &str, tip: &str, widget: impl egui::Widget) -> Response {
    let label = ui.label(name).on_hover_text(tip);
    let response = ui.add(widget).labelled_by(label.id).on_hover_text(tip);
    ui.end_row();
    response
}

fn combo(ui: &mut Ui, name: &str, tip: &str, chosen: &str, choices: impl FnOnce(&mut Ui)) {
    let label = ui.label(name).on_hover_text(tip);
    let response = ComboBox::from_id_salt(name).selected_text(chosen).truncate().show_ui(ui, choices).response;
    response.labelled_by(label.id).on_hover_text(tip);
    ui.end_row();
}

/// A name and a few values to choose from, each with its own explanation.
fn choice<T: PartialEq + Copy>(ui: &mut Ui, name: &str, value: &mut T, choices: &[(T, &str, &str)]) {
    ui.label(name);
    ui.horizontal(|ui| {
        for &(choice, text, tip) in choices {
            ui.selectable_value(value, choice, text).on_hover_text(tip);
        }
    });
    ui.end_row();
}

fn number(ui: &mut Ui, name: &str, value: impl Into<WidgetText>) {
    ui.weak(name);
    ui.label(value);
    ui.end_row();
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

/// A bar for every depth from the first with leaves to the last.
fn leaves(ui: &mut Ui, leaves_by_depth: &[usize]) {
    let most = leaves_by_depth.iter().copied().max().unwrap_or(0).max(1);
    let first = leaves_by_depth.iter().position(|&n| n > 0).unwrap_or(0);
    Grid::new("leaves").num_columns(3).min_col_width(16.0).min_row_height(14.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for (depth, &count) in leaves_by_depth.iter().enumerate().skip(first) {
            ui.label(RichText::new(format!("{depth:>2}")).small().monospace());
            let (rect, _) = ui.allocate_exact_size(vec2(172.0, 10.0), egui::Sense::hover());
            let width = rect.width() * count as f32 / most as f32;
            let filled = egui::Rect::from_min_size(rect.min, vec2(width.max(if count > 0 { 1.0 } else { 0.0 }), rect.height()));
            ui.painter().rect_filled(filled, 1.0, ui.visuals().selection.bg_fill);
            ui.label(RichText::new(thousands(count)).small());
            ui.end_row();
        }
    });
}

fn vector_label(array: &DataArray) -> String {
    if array.components > 1 { format!(", {} numbers", array.components) } else { String::new() }
}

/// Digits in groups of three.
fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let starts_group = |i: usize| i > 0 && (digits.len() - i).is_multiple_of(3);
    digits.char_indices().flat_map(|(i, c)| starts_group(i).then_some(' ').into_iter().chain([c])).collect()
}

fn mebibytes(bytes: usize) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

/// Five significant digits.
fn significant(value: f64) -> String {
    let magnitude = value.abs();
    if value != 0.0 && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.4e}");
    }
    let before_point = if magnitude >= 1.0 { magnitude.log10().floor() as usize + 1 } else { 1 };
    format!("{value:.*}", 5usize.saturating_sub(before_point))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_legible() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1 000", "1 234 567"]);
        assert_eq!([0.0, 4.9775, -123.456, 1234567.0, 2.5e-7].map(significant), ["0.0000", "4.9775", "-123.46", "1.2346e6", "2.5000e-7"]);
    }
}
