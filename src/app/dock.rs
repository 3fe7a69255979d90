//! Tools over the picture, and the panel under it: plots, one at a time.

use super::viewer::Viewer;
use super::wipe::WipeMode;
use egui::{Rect, Ui, vec2};

/// A plot under the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Docked {
    /// Values along the probe's line.
    Profile,
    /// What settings of the octree cost and give.
    Tuning,
}

impl Viewer {
    /// What can be turned on, over the picture while the pointer is there.
    pub(super) fn tools_over(&mut self, ui: &mut Ui, rect: Rect) {
        let is_near = ui.rect_contains_pointer(rect);
        if !is_near {
            return;
        }
        let place = Rect::from_min_size(rect.min + vec2(8.0, 8.0), vec2(260.0, 26.0));
        ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
            egui::Frame::popup(ui.style()).inner_margin(3).show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.toggle_value(&mut self.probe.is_on, "Probe").on_hover_text("Show what is under the pointer; a click pins it (P)");
                    let mut is_compared = self.wipe.mode != WipeMode::Off;
                    let tip = "Two pictures in one (W); which, and how, is chosen in the panel under Compare";
                    if ui.toggle_value(&mut is_compared, "A | B").on_hover_text(tip).clicked() {
                        self.flip_wipe();
                    }
                    ui.toggle_value(&mut self.tuning.is_open, "Tune").on_hover_text("A chart of what settings of the octree cost and give");
                });
            });
        });
    }

    /// The plots that there are.
    fn docked(&self) -> Vec<(Docked, &'static str, &'static str)> {
        let profile = (Docked::Profile, "Profile", "Values of the data and the octree along the probe's line");
        let tuning = (Docked::Tuning, "Tuning", "What settings of the octree cost and give");
        let profile = (self.probe.ends.len() == 2).then_some(profile);
        profile.into_iter().chain(self.tuning.is_open.then_some(tuning)).collect()
    }

    /// The panel, if there is something in it.
    pub(super) fn dock(&mut self, ui: &mut Ui) {
        let docked = self.docked();
        let is_new = |docked: &&(Docked, &str, &str)| !self.dock_before.contains(&docked.0);
        // What has just come is shown.
        if let Some(&(new, ..)) = docked.iter().find(is_new) {
            self.dock = new;
        }
        self.dock_before = docked.iter().map(|docked| docked.0).collect();
        let Some(&(first, ..)) = docked.first() else { return };
        if !self.dock_before.contains(&self.dock) {
            self.dock = first;
        }
        egui::Panel::bottom("plots").resizable(true).default_size(230.0).size_range(140.0..=600.0).show(ui, |ui| {
            ui.set_min_height(ui.available_height()); // what is in it is not to make it smaller
            ui.add_space(2.0);
            ui.horizontal(|ui| {
                for (tab, name, tip) in docked {
                    ui.selectable_value(&mut self.dock, tab, name).on_hover_text(tip);
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.small_button("Close").on_hover_text("Close this plot").clicked() {
                        match self.dock {
                            Docked::Profile => self.probe.clear_line(),
                            Docked::Tuning => self.tuning.is_open = false,
                        }
                    }
                });
            });
            match self.dock {
                Docked::Profile => self.profile(ui),
                Docked::Tuning => self.tuning_chart(ui),
            }
        });
    }
}
