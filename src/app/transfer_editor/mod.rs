//! The editor of the transfer function: histogram and opacity, colours, range, scale, files.
//!
//! ```text
//! plot             the drawings and what is dragged on them
//! edits            what that does to knots
//! histogram_stage  how often values occur, counted in the background
//! threshold        the values that are shown at all
//! files            import and export
//! ```

mod edits;
mod files;
mod histogram_stage;
mod plot;
mod threshold;

use super::color_choice::color_button;
use super::jobs::Job;
use super::settings::Transfer;
use super::viewer::Viewer;
use super::widgets::{row, rows, significant};
use crate::format::transfer_file::NamedTransfer;
use crate::geometry::Placed;
use crate::view::{Mode, Scale, TransferFunction};
use anyhow::Result;
use egui::{ComboBox, DragValue, Response, Sense, Slider, Ui, vec2};
use files::{Done, Form};
use histogram_stage::HistogramStage;
pub(super) use plot::gradient;
use plot::set_range;

/// Colours that are offered for values below and above the range, ParaView's.
const BEYOND: [[f64; 3]; 2] = [[0.0; 3], [0.5; 3]];

/// The knot that is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Selected {
    Nothing,
    Opacity(usize),
    Color(usize),
}

/// The editor's state, the transfer function aside.
pub struct TransferEditor {
    selected: Selected,
    histogram: HistogramStage,
    presets: Vec<NamedTransfer>,
    imported: Vec<NamedTransfer>,
    file: Option<Job<Result<Option<Done>>>>,
}

impl TransferEditor {
    /// With nothing chosen and nothing counted.
    pub fn new() -> Self {
        let preset = |name: &&str| Some(NamedTransfer { name: (*name).to_owned(), function: TransferFunction::preset(name).ok()? });
        let presets = TransferFunction::PRESETS.iter().filter_map(preset).collect();
        TransferEditor { selected: Selected::Nothing, histogram: HistogramStage::default(), presets, imported: vec![], file: None }
    }

    /// Forgets what was counted: the data are others.
    pub fn forget_data(&mut self) {
        self.histogram = HistogramStage::default();
    }
}

impl TransferEditor {
    /// Counts anew; the old bars stay until that is done.
    pub fn recount(&mut self) {
        self.histogram.recount();
    }
}

impl Viewer {
    /// The transfer function chosen, as it is edited.
    pub fn transfer_function(&self) -> &TransferFunction {
        &self.settings.transfer.base
    }

    /// Colours and opacity.
    pub(super) fn colours(&mut self, ui: &mut Ui) {
        let is_integral = self.settings.render.mode == Mode::Integral;
        let value_range = self.octree.model.as_ref().map(|model| model.value_range);
        // What the colours span: of an integral not the values.
        let data_range = self.values().1;
        if is_integral {
            self.transfer_editor.forget_data(); // nobody counts integrals
        } else if let Some(model) = self.octree.model.clone() {
            let tf = &self.settings.transfer.base;
            let range = tf.range.unwrap_or(model.value_range);
            let counted =
                self.transfer_editor.histogram.run(ui.ctx(), &self.document.data, &model.field, range, tf.scale, model.value_range);
            if let Err(error) = counted {
                self.fail(error);
            }
        }
        let shown = self.document.data.bounds().diagonal();
        let diagonal = self.time.unit_diagonal(shown).unwrap_or(shown);
        let (editor, transfer) = (&mut self.transfer_editor, &mut self.settings.transfer);
        ui.spacing_mut().item_spacing.y = 4.0;
        maps(ui, editor, transfer);
        let before = transfer.base.color.clone();
        let tf = &mut transfer.base;
        editor.opacity_plot(ui, tf, data_range);
        editor.color_bar(ui, tf, data_range);
        editor.chosen_knot(ui, tf, data_range);
        if let Some(data) = data_range {
            editor.range_strip(ui, tf, data);
            range_numbers(ui, tf, data);
        }
        if let (Some(values), false) = (value_range, is_integral) {
            editor.threshold(ui, tf, values);
        }
        if transfer.base.color != before {
            transfer.rename(&editor.presets);
        }
        rows(ui, "transfer", |ui| {
            scale(ui, &mut transfer.base, data_range);
            let density = Slider::new(&mut transfer.density, 0.05..=20.0).logarithmic(true).max_decimals(2);
            row(ui, "Density", "How opaque everything is: what extinction is multiplied by", density);
            unit_distance(ui, &mut transfer.base, diagonal);
            steps(ui, &mut transfer.base);
        });
        beyond(ui, &mut transfer.base);
        if let Some(error) = data_range.and_then(|range| transfer.base.check_range(range).err()) {
            ui.colored_label(ui.visuals().warn_fg_color, format!("drawn linear: {error}"));
        }
        let function = transfer.function(diagonal);
        ui.horizontal(|ui| {
            let ctx = ui.ctx().clone();
            if ui.button("Import...").on_hover_text("Read a transfer function, or ParaView's colour maps (JSON)").clicked() {
                self.import_transfer(&ctx);
            }
            let menu = ui.menu_button("Export", |ui| {
                if ui.button("octetra's JSON...").on_hover_text("All of it, for --tf and Import").clicked() {
                    self.export_transfer(&ctx, function.clone(), Form::Own);
                }
                if ui
                    .button("ParaView's colour map...")
                    .on_hover_text("Colours, opacity, range and log scale, for ParaView's import")
                    .clicked()
                {
                    self.export_transfer(&ctx, function.clone(), Form::ParaView);
                }
            });
            menu.response.on_hover_text("Write the transfer function to a file");
        });
    }
}

/// The choice of colour maps, each with its colours, and the button that turns them around.
fn maps(ui: &mut Ui, editor: &mut TransferEditor, transfer: &mut Transfer) {
    let mut chosen = None;
    ui.horizontal(|ui| {
        let label = ui.label("Colour map").on_hover_text("Colours over the value; opacity comes with them until it is edited");
        let combo = ComboBox::from_id_salt("colour map").selected_text(transfer.name.clone()).width(118.0).truncate().height(320.0);
        let combo = combo.show_ui(ui, |ui| {
            for (i, map) in editor.presets.iter().chain(&editor.imported).enumerate() {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(60.0, 12.0), Sense::hover());
                    gradient(ui, rect, &map.function.color);
                    if ui.selectable_label(transfer.name == map.name, &map.name).clicked() {
                        chosen = Some(i);
                    }
                });
            }
        });
        combo.response.labelled_by(label.id).on_hover_text("Colours over the value; opacity comes with them until it is edited");
        if ui.button("Invert").on_hover_text("Turn the colours around; opacity stays").clicked() {
            transfer.base.color = edits::inverted(&transfer.base.color);
            transfer.rename(&editor.presets);
        }
    });
    let map = chosen.and_then(|i| editor.presets.iter().chain(&editor.imported).nth(i));
    if let Some(map) = map {
        editor.selected = Selected::Nothing;
        let known = editor.presets.iter().chain(&editor.imported);
        let is_own = !known.map(|map| &map.function.opacity).any(|opacity| *opacity == transfer.base.opacity);
        transfer.choose(map, is_own);
    }
}

impl TransferEditor {
    /// The chosen knot in numbers.
    fn chosen_knot(&mut self, ui: &mut Ui, tf: &mut TransferFunction, data_range: Option<[f64; 2]>) {
        let range = tf.range.or(data_range).unwrap_or([0.0, 1.0]);
        let value_of = |tf: &TransferFunction, x: f64| tf.value_at(x, range);
        ui.horizontal(|ui| match self.selected {
            Selected::Opacity(i) if i < tf.opacity.len() => {
                let mut value = value_of(tf, tf.opacity[i][0]);
                ui.weak("Knot");
                if data_value(ui, &mut value, range, "knot value", "Value of this knot, data units").changed() {
                    let x = tf.position(value, range);
                    edits::shift(&mut tf.opacity, i, x);
                }
                ui.weak("opacity");
                let opacity = ui.add(DragValue::new(&mut tf.opacity[i][1]).range(0.0..=1.0).speed(0.005).max_decimals(3));
                labelled(&opacity, "knot opacity");
                opacity.on_hover_text("Opacity at this knot, over the unit length");
            }
            Selected::Color(i) if i < tf.color.len() => {
                let mut value = value_of(tf, tf.color[i][0]);
                ui.weak("Knot");
                if data_value(ui, &mut value, range, "knot value", "Value of this knot, data units").changed() {
                    let x = tf.position(value, range);
                    edits::shift(&mut tf.color, i, x);
                }
                ui.weak("colour");
                let [_, r, g, b] = tf.color[i];
                let mut color = [r, g, b];
                color_button(ui, &mut color, "Colour of this knot");
                tf.color[i][1..].copy_from_slice(&color);
            }
            _ => drop(ui.weak("click adds a knot, right click removes it")),
        });
    }
}

/// A value in data units to drag or type.
fn data_value(ui: &mut Ui, value: &mut f64, [lo, hi]: [f64; 2], name: &str, tip: &str) -> Response {
    let speed = if hi > lo { (hi - lo) / 300.0 } else { 0.01 };
    let before = *value;
    let drag = DragValue::new(value).speed(speed).custom_formatter(|value, _| significant(value)).update_while_editing(false);
    let mut response = ui.add_sized(vec2(72.0, ui.spacing().interact_size.y), drag);
    labelled(&response, name);
    // Who only looked at the rounded number changes nothing.
    if response.changed() && !response.dragged() && significant(before) == significant(*value) {
        *value = before;
        response.flags.remove(egui::response::Flags::CHANGED);
    }
    response.on_hover_text(tip)
}

fn labelled(response: &Response, name: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
}

/// The ends of the range in numbers.
fn range_numbers(ui: &mut Ui, tf: &mut TransferFunction, data: [f64; 2]) {
    let [mut lo, mut hi] = tf.range.unwrap_or(data);
    ui.horizontal(|ui| {
        let low = data_value(ui, &mut lo, data, "range from", "Value at the left end of the colours");
        let whole = ui.add_enabled(tf.range.is_some(), egui::Button::new("Whole range").min_size(vec2(116.0, 0.0)));
        if whole.on_hover_text("From the smallest to the largest value of the data").clicked() {
            tf.range = None;
            return;
        }
        let high = data_value(ui, &mut hi, data, "range to", "Value at the right end of the colours");
        if (low.changed() || high.changed()) && lo < hi {
            set_range(tf, [lo, hi]);
        }
    });
}

fn scale(ui: &mut Ui, tf: &mut TransferFunction, data: Option<[f64; 2]>) {
    ui.label("Scale").on_hover_text("How colours and opacity follow the value");
    ui.horizontal(|ui| {
        let range = tf.range.or(data);
        let fits = |scale: Scale| range.is_none_or(|range| range[0] == range[1] || scale.fits(range));
        let symlog = match tf.scale {
            Scale::Symlog(_) => tf.scale,
            _ => Scale::Symlog(None),
        };
        for (scale, name, tip) in [
            (Scale::Linear, "linear", "Evenly"),
            (Scale::Log, "log", "By the logarithm: every decade has the same room"),
            (symlog, "symlog", "By the logarithm on either side of 0, and evenly near it"),
        ] {
            let choice = ui.add_enabled(fits(scale), egui::Button::selectable(tf.scale == scale, name));
            let choice =
                choice.on_hover_text(tip).on_disabled_hover_text("Values from 0 down have no logarithm: narrow the range, or take symlog");
            if choice.clicked() && tf.scale != scale {
                *tf = TransferFunction { scale, ..if scale == Scale::Linear { tf.clone() } else { tf.over_unit_range() } };
            }
        }
    });
    ui.end_row();
    let range = tf.range.or(data).unwrap_or([0.0, 1.0]);
    if let Some(mut threshold) = tf.scale.threshold(range) {
        const TIP: &str = "Values up to this, of either sign, lie evenly; beyond it every decade has the same room (data units)";
        let speed = threshold / 50.0;
        let drag = DragValue::new(&mut threshold).speed(speed).range(f64::MIN_POSITIVE..=f64::MAX).update_while_editing(false);
        let before = tf.scale.threshold(range).map(significant);
        let changed = row(ui, "Linear up to", TIP, drag.custom_formatter(|value, _| significant(value))).changed();
        if changed && before != Some(significant(threshold)) {
            tf.scale = Scale::Symlog(Some(threshold));
        }
    }
}

fn unit_distance(ui: &mut Ui, tf: &mut TransferFunction, diagonal: f64) {
    const TIP: &str =
        "The length in the mesh's units over which a value absorbs by its opacity; by default the diagonal of the bounds / 50";
    let label = ui.label("Unit length").on_hover_text(TIP);
    ui.horizontal(|ui| {
        let mut unit = tf.unit_distance_world(diagonal);
        let before = unit;
        let drag = DragValue::new(&mut unit).speed(before / 100.0).range(diagonal * 1e-9..=f64::MAX).update_while_editing(false);
        let drag = ui.add(drag.custom_formatter(|value, _| significant(value))).labelled_by(label.id).on_hover_text(TIP);
        if drag.changed() && unit > 0.0 && significant(before) != significant(unit) {
            tf.unit_distance = Some(unit);
        }
        if ui
            .add_enabled(tf.unit_distance.is_some(), egui::Button::new("default"))
            .on_hover_text("The diagonal of the bounds / 50")
            .clicked()
        {
            tf.unit_distance = None;
        }
    });
    ui.end_row();
}

fn steps(ui: &mut Ui, tf: &mut TransferFunction) {
    const TIP: &str = "So many discrete colours in place of continuous ones; opacity stays as it is";
    let mut is_on = tf.steps.is_some();
    ui.checkbox(&mut is_on, "Discrete").on_hover_text(TIP);
    let mut steps = tf.steps.unwrap_or(8);
    let drag = ui.add_enabled(is_on, DragValue::new(&mut steps).range(1..=1024).speed(0.1));
    labelled(&drag, "number of steps");
    drag.on_hover_text(TIP);
    tf.steps = is_on.then_some(steps);
    ui.end_row();
}

fn beyond(ui: &mut Ui, tf: &mut TransferFunction) {
    ui.horizontal(|ui| {
        ui.label("Outside").on_hover_text("Colours of values outside the range; without, the first and the last colour go on");
        ui.add_space(10.0);
        for (color, name, default) in [(&mut tf.below, "below", BEYOND[0]), (&mut tf.above, "above", BEYOND[1])] {
            let mut is_on = color.is_some();
            if ui.checkbox(&mut is_on, name).on_hover_text(format!("A colour of their own for values {name} the range")).changed() {
                *color = is_on.then_some(default);
            }
            if let Some(color) = color {
                color_button(ui, color, &format!("Colour of values {name} the range"));
            }
        }
    });
}
