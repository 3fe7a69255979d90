//! The values that are shown at all: a range in the data, beside the opacity of the transfer function.

use super::super::widgets::significant;
use super::plot::{SIDE, bars, handle, named};
use super::{TransferEditor, data_value};
use crate::view::TransferFunction;
use egui::{CornerRadius, Rect, Sense, Ui, pos2, vec2};

const TIP: &str = "Hide values outside a range, whatever their opacity is: of the volume's light, in the octree's and the exact picture. The \
                   transfer function itself stays as it is";

/// What of the range's width its parts are at first: what is hidden is seen at once.
const FIRST: [f64; 2] = [0.25, 1.0];

impl TransferEditor {
    /// The switch, and while it is on the range with its ends to drag and to type. `data` is the field's range.
    pub(super) fn threshold(&self, ui: &mut Ui, tf: &mut TransferFunction, data: [f64; 2]) {
        let [lo, hi] = data;
        let mut is_on = tf.threshold.is_some();
        ui.horizontal(|ui| {
            if ui.checkbox(&mut is_on, "Show values").on_hover_text(TIP).changed() {
                tf.threshold = is_on.then(|| FIRST.map(|part| lo * (1.0 - part) + hi * part));
            }
            let Some([mut from, mut to]) = tf.threshold else { return };
            let low = data_value(ui, &mut from, data, "show from", "The smallest value that is shown, data units");
            ui.label("to");
            let high = data_value(ui, &mut to, data, "show to", "The largest value that is shown, data units");
            if low.changed() && from.is_finite() {
                tf.threshold = Some([from.min(to), to]);
            }
            if high.changed() && to.is_finite() {
                tf.threshold = Some([from, to.max(from)]);
            }
        });
        self.threshold_strip(ui, tf, data);
    }

    /// What is shown of all values, whose ends are dragged.
    fn threshold_strip(&self, ui: &mut Ui, tf: &mut TransferFunction, [lo, hi]: [f64; 2]) {
        let Some([from, to]) = tf.threshold.filter(|_| hi > lo && (hi - lo).is_finite()) else { return };
        let (outer, response) = ui.allocate_exact_size(vec2(ui.available_width(), 18.0), Sense::hover());
        named(&response, "values shown");
        let rect = outer.shrink2(vec2(SIDE, 1.0));
        let x = |value: f64| rect.left() + rect.width() * (((value - lo) / (hi - lo)) as f32).clamp(0.0, 1.0);
        let visuals = ui.visuals().clone();
        ui.painter().rect_filled(rect, CornerRadius::same(2), visuals.extreme_bg_color);
        bars(ui, rect, self.histogram.over_all(), visuals.weak_text_color().gamma_multiply(0.45));
        for hidden in [rect.left()..=x(from), x(to)..=rect.right()] {
            ui.painter().rect_filled(Rect::from_x_y_ranges(hidden, rect.y_range()), CornerRadius::ZERO, hiding(ui));
        }
        let grip = |at: f64, end: &str| {
            let response = handle(ui, pos2(x(at), rect.center().y), 12.0, response.id.with(end), &format!("show {end}"));
            let pointer = response.interact_pointer_pos().filter(|_| response.dragged());
            let part = pointer.map(|pointer| f64::from(((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0)));
            (response, part.map(|part| lo * (1.0 - part) + hi * part))
        };
        // On top is the one that can still move, should both lie at one end.
        let is_low_on_top = from > 0.5 * (lo + hi);
        let below = if is_low_on_top { grip(to, "high") } else { grip(from, "low") };
        let above = if is_low_on_top { grip(from, "low") } else { grip(to, "high") };
        let ((low, to_low), (high, to_high)) = if is_low_on_top { (above, below) } else { (below, above) };
        if let Some(value) = to_low {
            tf.threshold = Some([value.min(to), to]);
        }
        if let Some(value) = to_high {
            tf.threshold = Some([from, value.max(from)]);
        }
        for (grip, at, tip) in [(low, from, "smallest"), (high, to, "largest")] {
            let half = if grip.hovered() || grip.dragged() { 3.0 } else { 2.0 };
            let bar = Rect::from_x_y_ranges(x(at) - half..=x(at) + half, outer.y_range());
            ui.painter().rect_filled(bar, CornerRadius::same(2), visuals.strong_text_color());
            grip.on_hover_text(format!("{}: drag changes the {tip} value that is shown", significant(at)));
        }
    }
}

/// What lies over hidden values.
fn hiding(ui: &Ui) -> egui::Color32 {
    ui.visuals().panel_fill.gamma_multiply(0.75)
}

/// Pales what a threshold hides of the plot of opacity: `rect` is where x goes from 0 to 1 in `outer`.
pub fn shade_hidden(ui: &Ui, tf: &TransferFunction, data: [f64; 2], outer: Rect, rect: Rect) {
    let Some([from, to]) = tf.threshold else { return };
    let x = |value: f64| rect.left() + rect.width() * (tf.position(value, data) as f32).clamp(0.0, 1.0);
    let [low, high] = [if from > data[0] { x(from) } else { outer.left() }, if to < data[1] { x(to) } else { outer.right() }];
    for hidden in [outer.left()..=low, high..=outer.right()] {
        ui.painter().rect_filled(Rect::from_x_y_ranges(hidden, outer.y_range()), CornerRadius::same(2), hiding(ui));
    }
}
