//! The bar under the picture of a series: its steps, playing, and what the colours span.

use super::keys::{Action, tip};
use super::model::InTime;
use super::time_stage::RangeOver;
use super::viewer::Viewer;
use super::widgets::choices;
use egui::{Button, DragValue, Response, RichText, Slider, Ui, vec2};
use std::path::PathBuf;

/// The window's width from which all fits into one row.
const ONE_ROW: f32 = 800.0;

/// Width of what follows the time in one row.
const PLAYING: f32 = 350.0;

/// Width of the time and of what is beside the slider: its name, its number, gaps.
const TIME: f32 = 130.0;
const NAMES: f32 = 112.0;

const RANGES: [(RangeOver, &str, &str); 2] = [
    (
        RangeOver::AllSteps,
        "all steps",
        "Where you choose no range, colours span the values of all steps: the same colour is the same value in each. Files of up to 1 GiB in \
         all are read for it at once, for more the steps seen so far count",
    ),
    (
        RangeOver::EachStep,
        "each step",
        "Where you choose no range, colours span each step's own values: all its detail, but not to be compared",
    ),
];

impl Viewer {
    /// The bar, if a series is open or could be.
    pub(super) fn time_bar(&mut self, ui: &mut Ui) {
        match self.document.time.clone() {
            InTime::Single => {}
            InTime::Numbered(pattern, count) if self.time.closed_offer.as_ref() != Some(&pattern) => {
                egui::Panel::bottom("series").exact_size(30.0).resizable(false).show(ui, |ui| self.offer(ui, pattern, count));
            }
            InTime::Numbered(..) => {}
            InTime::Step(..) => {
                let is_one_row = ui.available_width() >= ONE_ROW;
                let height = if is_one_row { 32.0 } else { 58.0 };
                egui::Panel::bottom("time").exact_size(height).resizable(false).show(ui, |ui| {
                    ui.add_space(4.0);
                    if is_one_row {
                        ui.horizontal(|ui| {
                            self.steps_row(ui, PLAYING);
                            self.playing_row(ui);
                        });
                    } else {
                        ui.horizontal(|ui| self.steps_row(ui, 0.0));
                        ui.horizontal(|ui| self.playing_row(ui));
                    }
                });
            }
        }
    }

    fn offer(&mut self, ui: &mut Ui, pattern: PathBuf, count: usize) {
        ui.horizontal_centered(|ui| {
            let text = format!("Every file like {}, by the numbers in their names; all that is chosen stays", pattern.display());
            if ui.button(format!("Open as series of {count} steps")).on_hover_text(text).clicked() {
                self.open_series(&ui.ctx().clone(), pattern.clone());
            }
            if ui.button("Close").on_hover_text("Do not offer it for this file").clicked() {
                self.time.closed_offer = Some(pattern);
            }
            ui.add(egui::Label::new(RichText::new("There are more files of this name with other numbers.").weak()).truncate());
        });
    }

    fn steps_row(&mut self, ui: &mut Ui, after: f32) {
        let InTime::Step(series, _) = self.document.time.clone() else { return };
        let last = series.steps().len() - 1;
        let (play, explained) = if self.time.playing {
            ("Pause", "Stay at this step")
        } else {
            ("Play", "Show one step after the other, each as soon as its octree is there")
        };
        for (shown, name, text, action, width) in [
            ("<", "Previous step", "The step before", Action::PreviousStep, 26.0),
            (play, play, explained, Action::Play, 50.0),
            (">", "Next step", "The step after", Action::NextStep, 26.0),
        ] {
            let button = ui.add(Button::new(shown).min_size(vec2(width, 0.0)));
            labelled(&button, name);
            if button.on_hover_text(tip(text, action)).clicked() {
                self.act(&ui.ctx().clone(), action);
            }
        }
        ui.spacing_mut().slider_width = (ui.available_width() - NAMES - TIME - after).max(40.0);
        let mut step = self.time.wanted;
        let label = ui.label("Step");
        let slider = ui.add_enabled(last > 0, Slider::new(&mut step, 0..=last.max(1))).labelled_by(label.id);
        let path = &series.steps()[self.time.wanted.min(last)].path;
        if slider.on_hover_text(format!("The step that is shown, from 0: {}", path.display())).changed() {
            self.go_to_step(step);
        }
        let time = series.steps()[self.time.wanted.min(last)].time;
        let label = egui::Label::new(format!("of {last}, time {}", in_short(time))).truncate();
        // As wide at every step, lest what follows move.
        let width = TIME.min(ui.available_width());
        ui.allocate_ui(vec2(width, ui.spacing().interact_size.y), |ui| {
            ui.set_min_width(width);
            ui.add(label).on_hover_text(format!("time {time}"));
        });
    }

    fn playing_row(&mut self, ui: &mut Ui) {
        ui.checkbox(&mut self.time.loops, "Loop").on_hover_text("Go on with the first step after the last");
        let speed = DragValue::new(&mut self.time.per_second).range(0.1..=60.0).speed(0.1).max_decimals(1).suffix(" / s");
        let speed = ui.add(speed).on_hover_text("At most so many steps a second; fewer where reading and building take longer");
        labelled(&speed, "Steps a second");
        ui.label("Range").on_hover_text("What the colours span where no range is chosen");
        ui.spacing_mut().item_spacing.x = 2.0;
        choices(ui, &mut self.time.range, &RANGES);
        if let Some(done) = self.time.scanning() {
            ui.weak(format!(" {:.0} %", 100.0 * done)).on_hover_text("All steps are being read for their range");
        } else if let Some(bytes) = self.time.unscanned() {
            let text = format!(
                "Read all files, {:.1} GiB, for the range of all steps; until then the steps seen so far count",
                bytes as f64 / f64::from(1 << 30)
            );
            if ui.small_button("Read").on_hover_text(text).clicked() {
                self.time.scan();
            }
        }
    }
}

/// Names a widget for those who do not see it.
fn labelled(response: &Response, name: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
}

/// A time in few digits, as far as that says the same.
fn in_short(time: f64) -> String {
    let rounded: f64 = format!("{time:.6e}").parse().unwrap_or(time);
    let short = rounded.to_string();
    if short.len() <= 12 { short } else { format!("{time:.4e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short() {
        assert_eq!([0.0, 0.25, 1200.0, 0.1 + 0.2, 1.0 / 3.0e9].map(in_short), ["0", "0.25", "1200", "0.3", "3.3333e-10"]);
    }
}
