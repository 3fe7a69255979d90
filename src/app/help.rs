//! The sheet of keys.

use super::keys::{self, Action};
use super::navigate::{DRAGS, MORE, button_name};
use super::viewer::Viewer;
use egui::{RichText, Ui};

/// Groups by column.
const COLUMNS: [&[usize]; 2] = [&[0, 1], &[2, 3, 4]];

impl Viewer {
    /// Shows the sheet if it is asked for.
    pub(super) fn help_sheet(&mut self, ctx: &egui::Context) {
        if !self.help_is_open {
            return;
        }
        let mut is_open = true;
        let sheet = egui::Window::new("Keys and mouse").open(&mut is_open).collapsible(false).resizable(false);
        // As high as the window allows, the rest is scrolled to.
        let height = (ctx.viewport_rect().height() - 90.0).max(120.0);
        let sheet = sheet.default_size([660.0, height]);
        sheet.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO).show(ctx, |ui| {
            egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
                ui.horizontal_top(|ui| {
                    for (i, groups) in COLUMNS.iter().enumerate() {
                        if i > 0 {
                            ui.add_space(18.0);
                        }
                        ui.vertical(|ui| {
                            for &group in *groups {
                                let (name, bindings) = keys::GROUPS[group];
                                table(ui, name, bindings.iter().map(|binding| (binding.names(), binding.text)));
                            }
                            if i == 0 {
                                let drags = DRAGS.iter().map(|drag| (format!("{}{}", drag.1.prefix(), button_name(drag.0)), drag.3));
                                table(ui, "Mouse, dragging", drags);
                                table(ui, "Mouse", MORE.iter().map(|(what, text)| ((*what).to_owned(), *text)));
                            }
                        });
                    }
                });
                ui.weak(format!("{} or Escape closes this sheet.", keys::tip("Keys", Action::Help)));
            });
        });
        let is_escape = ctx.input(|input| input.key_pressed(egui::Key::Escape));
        self.help_is_open &= is_open && !is_escape;
    }
}

fn table<'a>(ui: &mut Ui, name: &str, rows: impl Iterator<Item = (String, &'a str)>) {
    ui.add_space(4.0);
    ui.label(RichText::new(name).strong());
    egui::Grid::new(name).num_columns(2).min_col_width(104.0).min_row_height(15.0).spacing([10.0, 1.0]).show(ui, |ui| {
        for (keys, text) in rows {
            ui.monospace(keys);
            ui.label(text);
            ui.end_row();
        }
    });
}
