//! The probe over the picture, in the panel, and the profile of its line.

use super::model;
use super::picked::in_words;
use super::probe_tool::{Pin, ProbeKind};
use super::projector::Projector;
use super::viewer::Viewer;
use super::widgets::{choice, percent, position, rows, significant};
use crate::geometry::Placed;
use crate::study::probe::{LineSamples, Sample};
use egui::{Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, RichText, Stroke, StrokeKind, Ui, vec2};
use egui_plot::{Legend, Line, Plot, PlotPoints};
use glam::DVec3;

/// The colours of the data's values and of the octree's, apart for the colour-blind too.
const DATA: Color32 = Color32::from_rgb(230, 159, 0);
const OCTREE: Color32 = Color32::from_rgb(86, 180, 233);

/// What is written on, so that it reads over any picture.
const PAPER: Color32 = Color32::from_black_alpha(200);

const KINDS: [(ProbeKind, &str, &str); 2] = [
    (ProbeKind::Point, "point", "A click pins a label to what is seen there"),
    (ProbeKind::Line, "line", "Two clicks set the ends of a line along which values are plotted"),
];

impl Viewer {
    /// Marks and labels over the picture; a click pins what is under the pointer.
    pub(super) fn probe_over(&mut self, ui: &Ui, rect: Rect, picture: &egui::Response) {
        let projector = Projector::new(&self.settings.camera, self.document.data.center(), rect);
        let painter = ui.painter().with_clip_rect(rect);
        let own = self.own_name();
        self.line_over(&painter, &projector);
        for pin in &self.probe.pins {
            let Some(at) = projector.place(pin.at).filter(|at| rect.contains(*at)) else { continue };
            painter.circle(at, 3.5, Color32::WHITE, Stroke::new(1.5, Color32::BLACK));
            label(&painter, rect, at, &pin_in_short(pin, own));
        }
        if !self.probe.is_on {
            return;
        }
        let is_free = picture.contains_pointer() && ui.ctx().dragged_id().is_none();
        let Some(pointer) = ui.input(|input| input.pointer.hover_pos()).filter(|_| is_free) else { return };
        ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
        let Some(octree) = self.octree.model.clone() else { return };
        let pixel = self.pixel_at(rect, pointer);
        match self.probe.hover(pixel, &self.wanted(), &self.document.data, &octree) {
            Some((sample, what)) => {
                let what = in_words(what);
                let what = if what.is_empty() { what } else { what + "\n" };
                let text = what + &sample_text(&sample, own);
                picture.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("picture: {text}")));
                label(&painter, rect, pointer, &text);
                if picture.clicked() {
                    self.probe.click(sample.at);
                    ui.ctx().request_repaint();
                }
            }
            None if !self.probe.is_ready() => label(&painter, rect, pointer, "preparing ..."),
            None => label(&painter, rect, pointer, "nothing is seen here"),
        }
    }

    fn line_over(&self, painter: &Painter, projector: &Projector) {
        let places: Vec<Option<Pos2>> = self.probe.ends.iter().map(|&end| projector.place(end)).collect();
        if let [Some(a), Some(b)] = places[..] {
            painter.line_segment([a, b], Stroke::new(3.0, Color32::BLACK));
            painter.line_segment([a, b], Stroke::new(1.5, Color32::WHITE));
        }
        for (at, name) in places.iter().zip(["A", "B"]).filter_map(|(at, name)| Some(((*at)?, name))) {
            painter.circle(at, 3.5, Color32::WHITE, Stroke::new(1.5, Color32::BLACK));
            painter.text(at + vec2(6.0, -6.0), Align2::LEFT_BOTTOM, name, FontId::proportional(13.0), Color32::WHITE);
        }
    }

    /// What the data's own values are called.
    fn own_name(&self) -> &'static str {
        if self.document.data.mesh().is_some() { "mesh" } else { "volume" }
    }

    /// Pins and the line, in words.
    pub(super) fn probe_section(&mut self, ui: &mut Ui) {
        rows(ui, "probe", |ui| {
            let tip = "Show what is under the pointer: position, values, cell and leaf (P)";
            let label = ui.label("Probe").on_hover_text(tip);
            ui.checkbox(&mut self.probe.is_on, "under the pointer").labelled_by(label.id).on_hover_text(tip);
            ui.end_row();
            choice(ui, "Click sets", "What a click into the picture does while the probe is on", &mut self.probe.kind, &KINDS);
        });
        let own = self.own_name();
        let mut removed = None;
        for (i, pin) in self.probe.pins.iter().enumerate() {
            ui.horizontal(|ui| {
                if ui.small_button("x").on_hover_text(format!("Remove label {}", pin.number)).clicked() {
                    removed = Some(i);
                }
                let value = pin.sample.and_then(|s| s.own).map_or("-".into(), significant);
                let text = format!("{}  {value}  at {}", pin.number, position(pin.at));
                ui.add(egui::Label::new(RichText::new(text).small()).truncate()).on_hover_text(pin_text(pin, own));
            });
        }
        if let Some(i) = removed {
            self.probe.pins.remove(i);
        }
        if self.probe.pins.len() > 1 && ui.small_button("Remove all").on_hover_text("Remove all labels").clicked() {
            self.probe.pins.clear();
        }
        self.line_ends(ui);
    }

    /// The line's ends as numbers.
    fn line_ends(&mut self, ui: &mut Ui) {
        if self.probe.ends.is_empty() {
            if self.probe.kind == ProbeKind::Line
                && ui.small_button("Along x").on_hover_text("A line through the middle, to begin with").clicked()
            {
                let (center, half) = (self.document.data.center(), self.document.data.bounds().size().x / 2.0);
                self.probe.ends = vec![center - DVec3::X * half, center + DVec3::X * half];
            }
            return;
        }
        let speed = self.document.data.bounds().diagonal() / 500.0;
        egui::Grid::new("line").num_columns(4).spacing([4.0, 4.0]).show(ui, |ui| {
            for (end, name) in self.probe.ends.iter_mut().zip(["A", "B"]) {
                ui.label(name).on_hover_text("An end of the line, world coordinates");
                for (c, axis) in [&mut end.x, &mut end.y, &mut end.z].into_iter().zip(["x", "y", "z"]) {
                    let drag = egui::DragValue::new(c).speed(speed).max_decimals(6);
                    ui.add_sized([72.0, 18.0], drag).on_hover_text(format!("{axis} of end {name}"));
                }
                ui.end_row();
            }
        });
        if ui.small_button("Remove line").on_hover_text("Take the line and its plot away").clicked() {
            self.probe.clear_line();
        }
    }

    /// The values along the line.
    pub(super) fn profile(&mut self, ui: &mut Ui) {
        let Some(profile) = &self.probe.profile else { return drop(ui.weak("measured when the octree is built")) };
        let own = self.own_name();
        let mut export = false;
        ui.horizontal(|ui| {
            let [lo, hi] = self.octree.model.as_ref().map_or([0.0, 1.0], |model| model.value_range);
            let worst = profile.samples.iter().filter_map(Sample::difference).fold(0.0, |worst: f64, d| worst.max(d.abs()));
            let length = profile.arc_length.last().copied().unwrap_or(0.0);
            let off = if hi > lo { percent(worst / (hi - lo)) } else { "0 %".into() };
            ui.label(format!("{} over {}, largest difference {off} of the range", self.array_name(), significant(length)));
            export = ui.button("Export CSV").on_hover_text("Write the samples to a file in the current folder").clicked();
        });
        let lines: Vec<Line> = [(own, DATA, own_value as Value), ("octree", OCTREE, octree_value)]
            .into_iter()
            .flat_map(|(name, color, value)| runs(profile, value).into_iter().map(move |run| (name, color, run)))
            .map(|(name, color, run)| Line::new(name, PlotPoints::from(run)).color(color).width(1.5))
            .collect();
        let plot = Plot::new("profile").legend(Legend::default()).x_axis_label("distance from A").allow_scroll(false);
        plot.show(ui, |ui| lines.into_iter().for_each(|line| ui.line(line)));
        if export {
            let (folder, name, profile) = (self.folder().to_owned(), self.document.name.clone(), profile.clone());
            self.save(ui.ctx(), move |_| model::save_profile(&profile, &folder, &name));
        }
    }

    fn array_name(&self) -> String {
        self.settings.field.name.clone().unwrap_or_default()
    }
}

/// One of the values of a sample.
type Value = fn(&Sample) -> Option<f64>;

fn own_value(sample: &Sample) -> Option<f64> {
    sample.own
}

fn octree_value(sample: &Sample) -> Option<f64> {
    sample.octree
}

/// Samples as points of a plot, in runs without a gap.
fn runs(profile: &LineSamples, value: Value) -> Vec<Vec<[f64; 2]>> {
    let points: Vec<Option<[f64; 2]>> =
        profile.arc_length.iter().zip(&profile.samples).map(|(&s, sample)| Some([s, value(sample)?])).collect();
    points.split(Option::is_none).filter(|run| !run.is_empty()).map(|run| run.iter().flatten().copied().collect()).collect()
}

/// What is at a place, in three lines.
fn sample_text(sample: &Sample, own: &str) -> String {
    let number = |value: Option<f64>| value.map_or("-".into(), significant);
    let difference = sample.difference().map_or(String::new(), |d| format!("  ({d:+.1e})"));
    let cell = sample.cell.map_or("no cell".into(), |cell| format!("{} {}", cell.shape, cell.number));
    let leaf = sample.leaf.map_or("no leaf".into(), |leaf| format!("leaf depth {}, edge {}", leaf.depth, significant(leaf.edge)));
    format!("{}\n{own} {}  octree {}{difference}\n{cell}, {leaf}", position(sample.at), number(sample.own), number(sample.octree))
}

/// A pin's values in one line.
fn pin_in_short(pin: &Pin, own: &str) -> String {
    let number = |value: Option<f64>| value.map_or("-".into(), significant);
    let values = pin.sample.map(|sample| format!("{own} {}  octree {}", number(sample.own), number(sample.octree)));
    format!("{}: {}", pin.number, values.unwrap_or_default())
}

fn pin_text(pin: &Pin, own: &str) -> String {
    let what = pin.sample.map_or_else(|| position(pin.at), |sample| sample_text(&sample, own));
    format!("{}: {what}", pin.number)
}

/// A text beside a place, moved so that it stays inside.
fn label(painter: &Painter, inside: Rect, at: Pos2, text: &str) {
    let text = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), Color32::WHITE);
    let size = text.size() + vec2(10.0, 6.0);
    let mut min = at + vec2(12.0, 12.0);
    if min.x + size.x > inside.right() {
        min.x = at.x - 12.0 - size.x;
    }
    if min.y + size.y > inside.bottom() {
        min.y = at.y - 12.0 - size.y;
    }
    let paper = Rect::from_min_size(min.max(inside.min), size);
    painter.rect(paper, CornerRadius::same(3), PAPER, Stroke::new(1.0, Color32::from_gray(110)), StrokeKind::Inside);
    painter.galley(paper.min + vec2(5.0, 3.0), text, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_the_data_is_plotted_in_runs() {
        let sample = |own: Option<f64>| Sample { at: DVec3::ZERO, own, octree: None, cell: None, leaf: None };
        let values = [None, Some(1.0), Some(2.0), None, None, Some(3.0), None];
        let profile = LineSamples { arc_length: (0..7).map(f64::from).collect(), samples: values.map(sample).to_vec() };
        assert_eq!(runs(&profile, own_value), [vec![[1.0, 1.0], [2.0, 2.0]], vec![[5.0, 3.0]]]);
        assert!(runs(&profile, octree_value).is_empty());
        assert_eq!(sample_text(&profile.samples[1], "mesh"), "(0.0000, 0.0000, 0.0000)\nmesh 1.0000  octree -\nno cell, no leaf");
    }
}
