//! What the panel is made of: rows of names and widgets, and numbers in words.

use egui::{ComboBox, Grid, Response, RichText, Ui, WidgetText};

/// Width of the column of names.
const NAMES: f32 = 96.0;

/// A part of the panel that folds.
pub fn section(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui)) {
    ui.add_space(6.0);
    egui::CollapsingHeader::new(RichText::new(name).strong()).default_open(true).show_unindented(ui, contents);
}

/// A part of the panel that is folded at first. `is_used` unfolds it when it becomes true.
pub fn folded(ui: &mut Ui, name: &str, is_used: bool, contents: impl FnOnce(&mut Ui)) {
    ui.add_space(6.0);
    let id = ui.scope_id().with((name, "was used"));
    let was_used = ui.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default::<bool>(id), is_used));
    let open = (is_used && !was_used).then_some(true);
    egui::CollapsingHeader::new(RichText::new(name).strong()).open(open).show_unindented(ui, contents);
}

/// Rows of a name and what belongs to it.
pub fn rows<R>(ui: &mut Ui, id: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    Grid::new(id).num_columns(2).min_col_width(NAMES).spacing([8.0, 4.0]).show(ui, contents).inner
}

/// Rows of numbers to read, closer together.
pub fn numbers<R>(ui: &mut Ui, id: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    let grid = Grid::new(id).num_columns(2).min_col_width(NAMES).min_row_height(15.0).spacing([8.0, 2.0]);
    grid.show(ui, contents).inner
}

/// A name and a widget.
pub fn row(ui: &mut Ui, name: &str, tip: &str, widget: impl egui::Widget) -> Response {
    let label = ui.label(name).on_hover_text(tip);
    let response = ui.add(widget).labelled_by(label.id).on_hover_text(tip);
    ui.end_row();
    response
}

/// A name and values to choose from in a list.
pub fn combo(ui: &mut Ui, name: &str, tip: &str, chosen: &str, choices: impl FnOnce(&mut Ui)) {
    let label = ui.label(name).on_hover_text(tip);
    let response = ComboBox::from_id_salt(name).selected_text(chosen).truncate().show_ui(ui, choices).response;
    response.labelled_by(label.id).on_hover_text(tip);
    ui.end_row();
}

/// A name and a few values to choose from, each with its own explanation.
pub fn choice<T: PartialEq + Copy>(ui: &mut Ui, name: &str, tip: &str, value: &mut T, choices: &[(T, &str, &str)]) {
    ui.label(name).on_hover_text(tip);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0; // four short words fit beside a name
        for &(choice, text, tip) in choices {
            ui.selectable_value(value, choice, text).on_hover_text(tip);
        }
    });
    ui.end_row();
}

/// A few values to choose from, without a name.
pub fn choices<T: PartialEq + Copy>(ui: &mut Ui, value: &mut T, choices: &[(T, &str, &str)]) {
    for &(choice, text, tip) in choices {
        ui.selectable_value(value, choice, text).on_hover_text(tip);
    }
}

/// A name and a value to read.
pub fn number(ui: &mut Ui, name: &str, value: impl Into<WidgetText>) {
    ui.weak(name);
    ui.label(value);
    ui.end_row();
}

/// A name and a value to read, with an explanation.
pub fn explained(ui: &mut Ui, name: &str, value: impl Into<WidgetText>, tip: &str) {
    ui.weak(name).on_hover_text(tip);
    ui.label(value).on_hover_text(tip);
    ui.end_row();
}

/// Digits in groups of three.
pub fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let starts_group = |i: usize| i > 0 && (digits.len() - i).is_multiple_of(3);
    digits.char_indices().flat_map(|(i, c)| starts_group(i).then_some(' ').into_iter().chain([c])).collect()
}

/// Bytes in MiB.
pub fn mebibytes(bytes: usize) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

/// Five significant digits.
pub fn significant(value: f64) -> String {
    let magnitude = value.abs();
    if value != 0.0 && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.4e}");
    }
    let before_point = if magnitude >= 1.0 { magnitude.log10().floor() as usize + 1 } else { 1 };
    format!("{value:.*}", 5usize.saturating_sub(before_point))
}

/// Seconds, in milliseconds where they are few.
pub fn duration(seconds: f64) -> String {
    match seconds * 1e3 {
        ms if ms < 10.0 => format!("{ms:.1} ms"),
        ms if ms < 1000.0 => format!("{ms:.0} ms"),
        _ => format!("{seconds:.1} s"),
    }
}

/// A share in percent, with two significant digits.
pub fn percent(share: f64) -> String {
    let percent = share * 100.0;
    let digits = if percent > 0.0 { (1.0 - percent.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{percent:.digits$} %")
}

/// A position in world coordinates.
pub fn position(at: glam::DVec3) -> String {
    format!("({}, {}, {})", significant(at.x), significant(at.y), significant(at.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_legible() {
        assert_eq!([0, 999, 1000, 1_234_567].map(thousands), ["0", "999", "1 000", "1 234 567"]);
        assert_eq!([0.0, 4.9775, -123.456, 1234567.0, 2.5e-7].map(significant), ["0.0000", "4.9775", "-123.46", "1.2346e6", "2.5000e-7"]);
        assert_eq!([0.0031, 0.0312, 1.25, 70.0].map(duration), ["3.1 ms", "31 ms", "1.2 s", "70.0 s"]);
        assert_eq!([0.0, 0.5, 0.031, 0.00124, 1.0].map(percent), ["0 %", "50 %", "3.1 %", "0.12 %", "100 %"]);
    }
}
