//! The drawings of the editor and what can be dragged on them: opacity over the value, colours over the value, the range in the data.

use super::super::color_choice::{choose_color, color32};
use super::super::widgets::significant;
use super::edits;
use super::{Selected, TransferEditor};
use crate::view::TransferFunction;
use egui::{Color32, CornerRadius, Id, Key, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

/// Room at either side, so that knots at the ends are whole.
pub(super) const SIDE: f32 = 6.0;

/// Height of the plot of opacity.
const PLOT: f32 = 92.0;

/// Radius of a knot, and of what can be caught of it.
const KNOT: f32 = 3.5;
const CATCH: f32 = 6.0;

/// What of the data's width the ends of a range stay apart.
const LEAST_WIDTH: f64 = 1e-4;

/// Paints colours over [0, 1].
pub fn gradient(ui: &Ui, rect: Rect, color: &[[f64; 4]]) {
    let (Some(&first), Some(&last)) = (color.first(), color.last()) else { return };
    let mut mesh = egui::Mesh::default();
    // Colours go on where knots do not reach the ends.
    let ends = [(0.0, first), (1.0, last)];
    let inner = color.iter().map(|c| (c[0].clamp(0.0, 1.0), *c));
    for (at, [_, r, g, b]) in ends[..1].iter().copied().chain(inner).chain(ends[1..].iter().copied()) {
        let next = mesh.vertices.len() as u32;
        for y in [rect.top(), rect.bottom()] {
            mesh.colored_vertex(pos2(rect.left() + rect.width() * at as f32, y), color32([r, g, b]));
        }
        if next > 0 {
            mesh.add_triangle(next - 2, next - 1, next);
            mesh.add_triangle(next - 1, next, next + 1);
        }
    }
    ui.painter().add(mesh);
}

/// Bars of equal widths with these heights in [0, 1].
pub(super) fn bars(ui: &Ui, rect: Rect, heights: &[f32], color: Color32) {
    let width = rect.width() / heights.len().max(1) as f32;
    let mut mesh = egui::Mesh::default();
    for (i, height) in heights.iter().enumerate().filter(|(_, height)| **height > 0.0) {
        let left = rect.left() + width * i as f32;
        mesh.add_colored_rect(
            Rect::from_min_max(pos2(left, rect.bottom() - rect.height() * height), pos2(left + width, rect.bottom())),
            color,
        );
    }
    ui.painter().add(mesh);
}

pub(super) fn named(response: &Response, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, name));
}

/// A handle at a place that is clicked and dragged; other widgets find it by its name.
pub(super) fn handle(ui: &Ui, at: Pos2, size: f32, id: Id, name: &str) -> Response {
    let response = ui.interact(Rect::from_center_size(at, vec2(size, size)), id, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, name));
    response
}

fn is_deleted(ui: &Ui, response: &Response) -> bool {
    let key = response.has_focus() && ui.input(|input| input.key_pressed(Key::Delete) || input.key_pressed(Key::Backspace));
    key || response.clicked_by(PointerButton::Secondary)
}

impl TransferEditor {
    /// Opacity over x with the histogram behind it.
    pub(super) fn opacity_plot(&mut self, ui: &mut Ui, tf: &mut TransferFunction, range: Option<[f64; 2]>) {
        let (outer, response) = ui.allocate_exact_size(vec2(ui.available_width(), PLOT), Sense::click());
        named(&response, "opacity over the value");
        let rect = outer.shrink2(vec2(SIDE, SIDE));
        let visuals = ui.visuals().clone();
        ui.painter().rect_filled(outer, CornerRadius::same(2), visuals.extreme_bg_color);
        bars(ui, rect, self.histogram.over_range(), visuals.weak_text_color().gamma_multiply(0.45));

        let place = |[x, opacity]: [f64; 2]| {
            pos2(rect.left() + rect.width() * x.clamp(0.0, 1.0) as f32, rect.bottom() - rect.height() * opacity as f32)
        };
        let knot_at = |at: Pos2| {
            let inside = |t: f32| f64::from(t.clamp(0.0, 1.0));
            [inside((at.x - rect.left()) / rect.width()), inside((rect.bottom() - at.y) / rect.height())]
        };
        let (first, last) = (tf.opacity[0], tf.opacity[tf.opacity.len() - 1]);
        let ends = [[0.0, first[1]], [1.0, last[1]]];
        let line = ends[..1].iter().chain(&tf.opacity).chain(&ends[1..]).map(|&knot| place(knot)).collect::<Vec<_>>();
        let accent = visuals.strong_text_color();
        ui.painter().add(Shape::line(line, Stroke::new(1.5, accent)));
        // What is not counted are no values.
        if let Some(range) = range.filter(|_| !self.histogram.over_range().is_empty()) {
            super::threshold::shade_hidden(ui, tf, range, outer, rect);
        }

        let mut removed = None;
        for i in 0..tf.opacity.len() {
            let id = response.id.with(("knot", i));
            let knot = handle(ui, place(tf.opacity[i]), 2.0 * CATCH, id, &format!("opacity knot {}", i + 1));
            if let Some(pointer) = knot.interact_pointer_pos().filter(|_| knot.dragged_by(PointerButton::Primary)) {
                let [x, opacity] = knot_at(pointer);
                edits::shift(&mut tf.opacity, i, x);
                tf.opacity[i][1] = opacity;
            }
            if knot.clicked() || knot.drag_started() {
                self.selected = Selected::Opacity(i);
                knot.request_focus();
            }
            if is_deleted(ui, &knot) {
                removed = Some(i);
            }
            let is_chosen = self.selected == Selected::Opacity(i);
            let fill = if is_chosen || knot.hovered() { visuals.selection.bg_fill } else { visuals.extreme_bg_color };
            let radius = if is_chosen { KNOT + 1.0 } else { KNOT };
            ui.painter().circle(place(tf.opacity[i]), radius, fill, Stroke::new(1.5, accent));
            let [x, opacity] = tf.opacity[i];
            let value = range.map_or(String::new(), |range| significant(tf.value_at(x, range)));
            knot.on_hover_text(format!("value {value}, opacity {opacity:.3}\nDrag moves it; right click or Delete removes it"));
        }
        if let Some(i) = removed {
            edits::remove(&mut tf.opacity, i);
            self.selected = Selected::Nothing;
        }
        if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked()) {
            self.selected = Selected::Opacity(edits::insert(&mut tf.opacity, knot_at(at)));
        }
        response.on_hover_text_at_pointer(
            "Opacity (up) over the value, and how often values occur (logarithm).\nA click adds a knot; drag a knot to move it; right click or Delete removes it.",
        );
    }

    /// Colours over x with their knots below.
    pub(super) fn color_bar(&mut self, ui: &mut Ui, tf: &mut TransferFunction, range: Option<[f64; 2]>) {
        let (outer, response) = ui.allocate_exact_size(vec2(ui.available_width(), 27.0), Sense::click());
        named(&response, "colours over the value");
        let rect = Rect::from_min_max(pos2(outer.left() + SIDE, outer.top()), pos2(outer.right() - SIDE, outer.top() + 16.0));
        gradient(ui, rect, &tf.stepped_color());
        for (color, is_left) in [(tf.below, true), (tf.above, false)] {
            let x = if is_left { outer.left()..=rect.left() } else { rect.right()..=outer.right() };
            if let Some(color) = color {
                ui.painter().rect_filled(Rect::from_x_y_ranges(x, rect.y_range()), CornerRadius::ZERO, color32(color));
            }
        }
        let visuals = ui.visuals().clone();
        let mut removed = None;
        for i in 0..tf.color.len() {
            let place = |x: f64| pos2(rect.left() + rect.width() * x.clamp(0.0, 1.0) as f32, rect.bottom() + 6.0);
            let id = response.id.with(("knot", i));
            let knot = handle(ui, place(tf.color[i][0]), 10.0, id, &format!("colour knot {}", i + 1));
            if let Some(pointer) = knot.interact_pointer_pos().filter(|_| knot.dragged_by(PointerButton::Primary)) {
                edits::shift(&mut tf.color, i, f64::from((pointer.x - rect.left()) / rect.width()));
            }
            if knot.clicked() || knot.drag_started() {
                self.selected = Selected::Color(i);
                knot.request_focus();
            }
            if is_deleted(ui, &knot) {
                removed = Some(i);
            }
            let is_chosen = self.selected == Selected::Color(i);
            let [x, r, g, b] = tf.color[i];
            let tip = place(x) - vec2(0.0, 5.0);
            let stroke = if is_chosen || knot.hovered() {
                Stroke::new(2.0, visuals.selection.bg_fill)
            } else {
                Stroke::new(1.0, visuals.text_color())
            };
            let triangle = vec![tip, tip + vec2(4.0, 8.0), tip + vec2(-4.0, 8.0)];
            ui.painter().add(Shape::convex_polygon(triangle, color32([r, g, b]), stroke));
            let open = knot.double_clicked().then_some(egui::SetOpenCommand::Bool(true));
            let popup = egui::Popup::from_response(&knot).id(id.with("picker")).open_memory(open);
            popup.close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
                let mut color = [r, g, b];
                if choose_color(ui, &mut color) {
                    tf.color[i][1..].copy_from_slice(&color);
                }
            });
            let value = range.map_or(String::new(), |range| significant(tf.value_at(x, range)));
            knot.on_hover_text(format!(
                "colour at {value}\nDrag moves it; a double click chooses the colour; right click or Delete removes it"
            ));
        }
        if let Some(i) = removed {
            edits::remove(&mut tf.color, i);
            self.selected = Selected::Nothing;
        }
        if let Some(at) = response.interact_pointer_pos().filter(|at| response.double_clicked() && rect.contains(*at)) {
            let color = edits::at(&tf.color, f64::from((at.x - rect.left()) / rect.width()));
            self.selected = Selected::Color(edits::insert(&mut tf.color, color));
        }
        response.on_hover_text_at_pointer(
            "Colours over the value. A double click adds a knot; knots below are dragged, a double click on one chooses its colour.",
        );
    }

    /// The range of the transfer function within the data's, whose ends are dragged.
    pub(super) fn range_strip(&self, ui: &mut Ui, tf: &mut TransferFunction, data: [f64; 2]) {
        let [mut lo, mut hi] = tf.range.unwrap_or(data);
        let all = [data[0].min(lo), data[1].max(hi)];
        let width = all[1] - all[0];
        if !(width > 0.0 && width.is_finite()) {
            return;
        }
        let (outer, response) = ui.allocate_exact_size(vec2(ui.available_width(), 18.0), Sense::hover());
        named(&response, "range in the data");
        let rect = outer.shrink2(vec2(SIDE, 1.0));
        let x = |value: f64| rect.left() + rect.width() * ((value - all[0]) / width) as f32;
        let visuals = ui.visuals().clone();
        ui.painter().rect_filled(rect, CornerRadius::same(2), visuals.extreme_bg_color);
        let of_data = Rect::from_x_y_ranges(x(data[0])..=x(data[1]), rect.y_range());
        bars(ui, of_data, self.histogram.over_all(), visuals.weak_text_color().gamma_multiply(0.45));

        let value = |pointer: Pos2| all[0] + width * f64::from(((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0));
        let least = width * LEAST_WIDTH;
        let window = Rect::from_x_y_ranges(x(lo)..=x(hi), rect.y_range());
        let middle = ui.interact(window, response.id.with("middle"), Sense::drag());
        named(&middle, "range");
        if middle.dragged() {
            let step = f64::from(middle.drag_delta().x / rect.width()) * width;
            let step = step.clamp(all[0] - lo, all[1] - hi);
            (lo, hi) = (lo + step, hi + step);
        }
        let grip = |at: f64, end: &str| {
            let response = handle(ui, pos2(x(at), rect.center().y), 12.0, response.id.with(end), &format!("range {end}"));
            let pointer = response.interact_pointer_pos().filter(|_| response.dragged());
            (response, pointer.map(value))
        };
        let (low, to_low) = grip(lo, "low");
        let (high, to_high) = grip(hi, "high");
        lo = to_low.map_or(lo, |to| to.min(hi - least));
        hi = to_high.map_or(hi, |to| to.max(lo + least));
        if (low.dragged() || high.dragged() || middle.dragged()) && lo < hi {
            set_range(tf, [lo, hi]);
        }
        let fill = visuals.selection.bg_fill;
        ui.painter().rect_filled(Rect::from_x_y_ranges(x(lo)..=x(hi), rect.y_range()), CornerRadius::ZERO, fill.gamma_multiply(0.25));
        for (grip, at) in [(&low, lo), (&high, hi)] {
            let half = if grip.hovered() || grip.dragged() { 3.0 } else { 2.0 };
            ui.painter().rect_filled(
                Rect::from_x_y_ranges(x(at) - half..=x(at) + half, outer.y_range()),
                CornerRadius::same(2),
                visuals.strong_text_color(),
            );
        }
        low.on_hover_text("Drag: the value at the left end of the colours");
        high.on_hover_text("Drag: the value at the right end of the colours");
        middle.on_hover_text("The part of all values that the colours span; drag moves it");
    }
}

/// Takes a range; where its scale has no place for its values, the largest part of it that the scale has.
pub fn set_range(tf: &mut TransferFunction, [lo, hi]: [f64; 2]) {
    let lo = if tf.scale == crate::view::Scale::Log && lo <= 0.0 && hi > 0.0 { hi * 1e-6 } else { lo };
    if lo < hi && tf.scale.fits([lo, hi]) {
        tf.range = Some([lo, hi]);
    }
}
