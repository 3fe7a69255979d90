//! Colours of the slices.

use super::super::color_choice::color_button;
use super::super::transfer_editor::gradient;
use super::super::widgets::significant;
use super::window::StoreWindow;
use crate::gpu::TINTS;
use crate::view::TransferFunction;
use egui::{ComboBox, DragValue, Sense, Ui, vec2};

/// The share of the values that is left out at either end of a range that suits most.
pub const CLIPPED: f64 = 0.01;

/// Colours that suit values over a range: two-sided ones where it has both signs.
pub fn suitable([low, high]: [f64; 2]) -> &'static str {
    if low < 0.0 && high > 0.0 && -low.max(-high) > 0.1 * high.max(-low) { "coolwarm" } else { "viridis" }
}

/// A range as it is taken for such colours: 0 in the middle of two-sided ones.
pub fn suited(name: &str, [low, high]: [f64; 2]) -> [f64; 2] {
    let (low, high) = if low < high { (low, high) } else { (low, low + low.abs().max(1e-30)) };
    let most = high.max(-low);
    if name == "coolwarm" && low < 0.0 && high > 0.0 { [-most, most] } else { [low, high] }
}

impl StoreWindow {
    /// The section of the panel.
    pub(super) fn colors(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let label = ui.label("Map").on_hover_text("Colours over the value");
            let combo = ComboBox::from_id_salt("colour map").selected_text(self.map.as_str()).width(150.0).truncate().height(320.0);
            let mut chosen = None;
            let combo = combo.show_ui(ui, |ui| {
                for name in TransferFunction::PRESETS {
                    let Ok(preset) = TransferFunction::preset(name) else { continue };
                    ui.horizontal(|ui| {
                        let (rect, _) = ui.allocate_exact_size(vec2(60.0, 12.0), Sense::hover());
                        gradient(ui, rect, &preset.color);
                        if ui.selectable_label(self.map == name, name).clicked() {
                            chosen = Some((name, preset.color));
                        }
                    });
                }
            });
            combo.response.labelled_by(label.id).on_hover_text("Colours over the value");
            if let Some((name, color)) = chosen {
                (self.map, self.style.transfer_function.color) = (name.to_owned(), color);
            }
            if ui.button("Invert").on_hover_text("Turn the colours around").clicked() {
                let color = &mut self.style.transfer_function.color;
                color.reverse();
                color.iter_mut().for_each(|knot| knot[0] = 1.0 - knot[0]);
            }
        });
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 14.0), Sense::hover());
        gradient(ui, rect, &self.style.transfer_function.color);
        response.on_hover_text("The colours from the lower to the upper end of the range");
        ui.horizontal(|ui| {
            let whole = self.style.value_range;
            let [mut low, mut high] = self.style.transfer_function.range.unwrap_or(whole);
            let speed = ((whole[1] - whole[0]) / 500.0).max(f64::MIN_POSITIVE);
            let number = |ui: &mut Ui, value: &mut f64, name: &str, tip: &str| {
                let drag = DragValue::new(value).speed(speed).custom_formatter(|value, _| significant(value)).update_while_editing(false);
                let response = ui.add_sized(vec2(76.0, ui.spacing().interact_size.y), drag);
                response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
                response.on_hover_text(tip).changed()
            };
            let is_moved = number(ui, &mut low, "range from", "Value at the left end of the colours");
            if ui.button("all").on_hover_text("From the smallest to the largest value of the volume").clicked() {
                [low, high] = suited(&self.map, whole);
            }
            let middle = ui.add_enabled(self.stream.is_ready(), egui::Button::new("98 %"));
            let middle = middle.on_hover_text("Without the smallest and the largest hundredth of the values, as a coarse level has them");
            if middle.clicked() {
                self.suit_range();
                [low, high] = self.style.transfer_function.range.unwrap_or(whole);
            }
            let is_moved = number(ui, &mut high, "range to", "Value at the right end of the colours") || is_moved;
            let range = Some([low, high]);
            if low < high && low.is_finite() && high.is_finite() && self.style.transfer_function.range != range {
                self.style.transfer_function.range = range;
                self.range_is_chosen |= is_moved;
            }
        });
        ui.horizontal(|ui| {
            let nan = &mut self.style.transfer_function.nan;
            let mut is_on = nan.is_some();
            const TIP: &str = "Colour of voxels without a value; otherwise they are transparent";
            ui.checkbox(&mut is_on, "Colour no data").on_hover_text(TIP);
            if is_on {
                let color = nan.get_or_insert([0.35, 0.0, 0.35]);
                color_button(ui, color, "Colour of voxels without a value");
            } else {
                *nan = None;
            }
        });
        ui.horizontal(|ui| {
            let smooth = &mut self.style.is_smooth;
            ui.selectable_value(smooth, true, "Smooth").on_hover_text("Trilinear between voxels");
            ui.selectable_value(smooth, false, "Voxels").on_hover_text("The value of the nearest voxel");
            ui.separator();
            let mut is_tinted = self.style.tint > 0.0;
            let tip = "Tint what is shown by the level that it is from: green is the full resolution";
            ui.checkbox(&mut is_tinted, "Tint levels").on_hover_text(tip);
            self.style.tint = if is_tinted { 0.45 } else { 0.0 };
        });
        if self.style.tint > 0.0 {
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 3.0;
                for level in 0..self.source.pyramid().levels() {
                    let [r, g, b] = TINTS[usize::from(level).min(TINTS.len() - 1)].map(|v| (v * 255.0).round() as u8);
                    let (rect, _) = ui.allocate_exact_size(vec2(11.0, 11.0), Sense::hover());
                    ui.painter().rect_filled(rect, 2.0, egui::Color32::from_rgb(r, g, b));
                    ui.label(level.to_string())
                        .on_hover_text(format!("Level {level}: {} voxels of the volume along each axis", 1u64 << level));
                    ui.add_space(4.0);
                }
            });
        }
    }

    /// Takes the range of most values, if they are known.
    pub(super) fn suit_range(&mut self) {
        if let Some(range) = self.stream.quantiles(CLIPPED) {
            self.style.transfer_function.range = Some(suited(&self.map, range));
            self.range_is_chosen = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_both_signs_have_two_sided_colours() {
        assert_eq!([[-5.0, 4.0], [0.0, 9.0], [-1.0, 1000.0], [-9.0, -1.0]].map(suitable), ["coolwarm", "viridis", "viridis", "viridis"]);
        assert_eq!(suited("coolwarm", [-5.0, 4.0]), [-5.0, 5.0]);
        assert_eq!(suited("viridis", [-5.0, 4.0]), [-5.0, 4.0]);
        let [low, high] = suited("viridis", [2.0, 2.0]);
        assert!(low < high, "one value has a range, too");
    }
}
