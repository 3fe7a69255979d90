//! The widgets beside the picture.

use super::keys::{Action, tip};
use super::leaves::LeafShow;
use super::model::Data;
use super::settings::component_label;
use super::viewer::Viewer;
use super::widgets::{choice, combo, folded, mebibytes, number, numbers, rows, section, significant, thousands};
use super::wipe::WipeMode;
use crate::mesh::{Component, DataArray, TetMesh};
use crate::view::{Isosurfaces, RendererKind, Skip, Steps};
use crate::volume::Grid;
use egui::{RichText, Ui};

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
        section(ui, "Planes", |ui| self.planes_section(ui));
        section(ui, "Picture", |ui| self.picture_settings(ui));
        section(ui, "Octree", |ui| self.thresholds(ui));
        section(ui, "Accuracy", |ui| self.accuracy(ui));
        section(ui, "Size", |ui| self.size(ui));
        let is_compared = self.wipe.mode != WipeMode::Off;
        folded(ui, "Compare", is_compared, |ui| self.wipe_section(ui));
        let (is_probed, has_leaves) = (self.probe.is_on || !self.probe.pins.is_empty(), self.leaves.show != LeafShow::Off);
        folded(ui, "Probe", is_probed, |ui| self.probe_section(ui));
        if let Data::Mesh(mesh) = self.document.data.clone() {
            folded(ui, "Quality", false, |ui| self.quality_section(ui, &mesh));
        }
        folded(ui, "Leaves", has_leaves, |ui| self.leaves_section(ui));
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
            self.compare_button(ui, "Compare");
        });
    }

    fn field(&mut self, ui: &mut Ui) {
        let mesh = match self.document.data.clone() {
            Data::Mesh(mesh) => mesh,
            Data::Volume(grid) => return numbers(ui, "field", |ui| number(ui, "Array", grid.name().to_owned())),
        };
        let arrays = || mesh.point_data().iter().map(|a| (a, "points")).chain(mesh.cell_data().iter().map(|a| (a, "cells")));
        let before = self.settings.field.clone();
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
        if self.settings.field != before {
            self.settings.transfer.forget_data();
            self.settings.render.isosurfaces = Isosurfaces::NONE;
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

fn vector_label(array: &DataArray) -> String {
    if array.components > 1 { format!(", {} numbers", array.components) } else { String::new() }
}
