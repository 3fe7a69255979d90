//! How well the cells of a mesh are shaped: a histogram, numbers, the worst cells, and one of them marked over the picture.

use super::jobs::{Job, Polled, outcome};
use super::projector::Projector;
use super::viewer::Viewer;
use super::widgets::{combo, explained, numbers, percent, position, rows, significant, thousands};
use crate::geometry::Aabb;
use crate::mesh::quality::{self, Bin, Metric, Rule, Summary, WorstCell};
use crate::mesh::{Component, TetMesh};
use crate::view::Isosurfaces;
use anyhow::Result;
use egui::{Color32, Rect, RichText, Stroke, Ui};
use egui_plot::{Bar, BarChart, Plot};
use glam::DVec3;
use std::sync::{Arc, Weak};

/// Bins of the histogram, and cells that are listed.
const BINS: usize = 30;
const WORST: usize = 12;

/// Half the edge of the box that is brought into view around a cell, in longest edges of the cell.
const AROUND: f64 = 1.2;

/// Bars of acceptable values, and of those that are not.
const GOOD: Color32 = Color32::from_rgb(86, 180, 233);
const BAD: Color32 = Color32::from_rgb(230, 120, 40);

/// What the edges of a marked cell are drawn with.
const MARK: Color32 = Color32::from_rgb(255, 230, 80);

/// Which metric is looked at, what is known of it, and what is on its way.
pub struct QualityTool {
    metric: Metric,
    found: Option<(Key, Summary)>,
    job: Option<(Key, Job<Result<Summary>>)>,
    /// A cell whose edges are drawn, and its mesh.
    marked: Option<(Weak<TetMesh>, WorstCell)>,
    /// Whether the section was unfolded in this frame.
    is_wanted: bool,
}

/// What decides a summary. A weak pointer keeps the address of a mesh that is gone from being another's.
#[derive(Clone)]
struct Key(Weak<TetMesh>, Metric);

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0) && self.1 == other.1
    }
}

impl Default for QualityTool {
    fn default() -> Self {
        QualityTool { metric: Metric::ScaledJacobian, found: None, job: None, marked: None, is_wanted: false }
    }
}

impl QualityTool {
    /// What is on its way.
    pub fn progress(&self) -> Option<(&'static str, Option<f32>)> {
        self.job.as_ref().map(|(_, job)| job.progress())
    }
}

impl Viewer {
    /// What the panel says of the metric, once it is known.
    pub fn quality_summary(&self) -> Option<&Summary> {
        self.quality.found.as_ref().map(|(_, summary)| summary)
    }

    /// The array that is shown.
    pub fn array(&self) -> Option<&str> {
        self.settings.field.name.as_deref()
    }

    /// The cell whose edges are drawn over the picture.
    pub fn marked_cell(&self) -> Option<WorstCell> {
        let (of, cell) = self.quality.marked.as_ref()?;
        self.document.data.mesh().filter(|mesh| of.ptr_eq(&Arc::downgrade(mesh))).map(|_| *cell)
    }

    /// Takes what was measured and measures what the panel shows.
    pub(super) fn run_quality(&mut self, ctx: &egui::Context) -> Result<()> {
        let ended = match self.quality.job.as_ref().map(|(_, job)| job.poll()) {
            None | Some(Polled::Pending) => None,
            Some(ended) => self.quality.job.take().map(|(key, _)| (key, ended)),
        };
        if let Some((key, ended)) = ended {
            self.quality.found = Some((key, outcome(ended)?));
        }
        let is_wanted = std::mem::take(&mut self.quality.is_wanted);
        let (Some(mesh), true) = (self.document.data.mesh().cloned(), is_wanted) else { return Ok(()) };
        let key = Key(Arc::downgrade(&mesh), self.quality.metric);
        let is_right = |of: &Key| *of == key;
        if self.quality.found.as_ref().is_some_and(|(of, _)| is_right(of)) || self.quality.job.as_ref().is_some_and(|(of, _)| is_right(of))
        {
            return Ok(());
        }
        let metric = key.1;
        let job = Job::start(ctx, move |progress, results| {
            let values = quality::values(&mesh, metric, Rule::Definition, progress);
            results.give(values.map(|values| Summary::new(&mesh, metric, &values, BINS, WORST)).map_err(Into::into));
        });
        self.quality.job = Some((key, job));
        Ok(())
    }

    /// The metric, how its values are distributed, and the worst cells, in the panel.
    pub(super) fn quality_section(&mut self, ui: &mut Ui, mesh: &Arc<TetMesh>) {
        self.quality.is_wanted = true;
        let metric = &mut self.quality.metric;
        rows(ui, "quality", |ui| {
            let tip = format!("How the shape of cells is measured. {}: {}", metric.label(), metric.formula());
            let chosen = metric.label();
            combo(ui, "Metric", &tip, chosen, |ui| {
                for other in Metric::ALL {
                    ui.selectable_value(metric, other, other.label()).on_hover_text(other.formula());
                }
            });
        });
        let metric = *metric;
        ui.horizontal(|ui| {
            let name = quality::field_name(metric);
            let is_shown = self.settings.field.name.as_deref() == Some(&name);
            let button = egui::Button::new("Colour by this").selected(is_shown);
            if ui.add(button).on_hover_text("Show this metric in the picture, as the array of cells that it is").clicked() && !is_shown {
                (self.settings.field.name, self.settings.field.component) = (Some(name), Component::Magnitude);
                self.settings.transfer.forget_data();
                self.settings.render.isosurfaces = Isosurfaces::NONE;
            }
            let is_marked = self.marked_cell().is_some();
            if ui.add_enabled(is_marked, egui::Button::new("Unmark")).on_hover_text("Draw the marked cell's edges no more").clicked() {
                self.quality.marked = None;
            }
        });
        let key = Key(Arc::downgrade(mesh), metric);
        let Some(summary) = self.quality.found.as_ref().filter(|(of, _)| *of == key).map(|(_, summary)| summary.clone()) else {
            ui.weak("measuring ...");
            return;
        };
        distribution(ui, &summary);
        in_numbers(ui, mesh, &summary);
        self.worst_cells(ui, mesh, &summary);
    }

    /// The list; a click flies there.
    fn worst_cells(&mut self, ui: &mut Ui, mesh: &Arc<TetMesh>, summary: &Summary) {
        ui.add_space(2.0);
        ui.weak("Worst cells").on_hover_text("A click brings the camera to the cell and draws its edges; Ctrl+B brings it back");
        let marked = self.marked_cell().map(|cell| cell.tet);
        for cell in &summary.worst {
            let value = match cell.value {
                value if value.is_finite() => significant(value),
                value if value.is_nan() => "no value".into(),
                _ => "infinite".into(),
            };
            let text = RichText::new(format!("{value}   cell {}", cell.cell)).small();
            let (shape, _) = mesh.file_cells().cell_type(cell.tet).name();
            let tip = format!("{shape} {} of the file, tet {}\ncentre {}\nclick to fly there", cell.cell, cell.tet, position(cell.center));
            if ui.selectable_label(marked == Some(cell.tet), text).on_hover_text(tip).clicked() {
                self.fly_to(mesh, *cell);
            }
        }
    }

    /// Brings the camera to a cell, from where it looks now, and marks the cell.
    fn fly_to(&mut self, mesh: &Arc<TetMesh>, cell: WorstCell) {
        let corners = mesh.corners(cell.tet);
        let longest = corners.iter().flat_map(|a| corners.map(|b| a.distance(b))).fold(0.0, f64::max);
        // A cell without a size is seen from a thousandth of the mesh.
        let reach = AROUND * if longest > 0.0 { longest } else { self.extent() / 1000.0 };
        let around = Aabb::of_points([-1.0, 1.0].map(|side| cell.center + DVec3::splat(side * reach)));
        let aspect = f64::from(self.size[0].max(1)) / f64::from(self.size[1].max(1));
        self.settings.camera = self.settings.camera.fitted(around, aspect);
        self.quality.marked = Some((Arc::downgrade(mesh), cell));
    }

    /// The edges of the marked cell over the picture.
    pub(super) fn quality_over(&self, ui: &Ui, rect: Rect) {
        let (Some(cell), Some(mesh)) = (self.marked_cell(), self.document.data.mesh()) else { return };
        let projector = Projector::new(&self.settings.camera, mesh.center(), rect);
        let painter = ui.painter().with_clip_rect(rect);
        let places = mesh.corners(cell.tet).map(|corner| projector.place(corner + mesh.center()));
        let edges = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        let edges: Vec<_> = edges.into_iter().filter_map(|(a, b)| Some([places[a]?, places[b]?])).collect();
        for (width, color) in [(3.5, Color32::BLACK), (1.5, MARK)] {
            for edge in &edges {
                painter.line_segment(*edge, Stroke::new(width, color));
            }
        }
        for place in places.into_iter().flatten() {
            painter.circle(place, 2.5, MARK, Stroke::new(1.0, Color32::BLACK));
        }
    }
}

/// Bars by the logarithm of their counts; those outside the acceptable range have another colour.
fn distribution(ui: &mut Ui, summary: &Summary) {
    let acceptable = summary.metric.acceptable().map(|acceptable| acceptable.range);
    let color = |bin: &Bin| {
        let middle = (bin.low + bin.high) / 2.0;
        let is_good = acceptable.is_none_or(|[low, high]| low <= middle && middle <= high);
        if is_good { GOOD } else { BAD }
    };
    // In parts of the range, since a plot's own coordinates cannot be as small or large as volumes are.
    let (low, high) = (summary.bins[0].low, summary.bins[summary.bins.len() - 1].high);
    let bins = summary.bins.len() as f64;
    let bar = |(i, bin): (usize, &Bin)| {
        Bar::new((i as f64 + 0.5) / bins, (bin.count as f64).ln_1p()).width(0.92 / bins).fill(color(bin)).stroke(Stroke::NONE)
    };
    let bars: Vec<Bar> = summary.bins.iter().enumerate().map(bar).collect();
    let plot = Plot::new("quality histogram")
        .height(110.0)
        .width(ui.available_width())
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .show_axes([false, false])
        .show_grid([false, false])
        .show_x(false)
        .show_y(false)
        .include_x(0.0)
        .include_x(1.0)
        .include_y(0.0)
        .set_margin_fraction(egui::vec2(0.02, 0.04))
        .label_formatter(|_| None);
    let shown = plot.show(ui, |ui| ui.bar_chart(BarChart::new("cells", bars).allow_hover(false)));
    let pointed = shown.response.hover_pos().map(|at| shown.transform.value_from_position(at).x * bins);
    let bin = pointed.filter(|at| (0.0..bins).contains(at)).map(|at| summary.bins[at as usize]);
    let text = match bin {
        Some(bin) => format!("{} cells from {} to {}", thousands(bin.count), significant(bin.low), significant(bin.high)),
        None => "How many cells have which value; the bars' heights are logarithms of counts".into(),
    };
    shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "histogram of the quality"));
    shown.response.on_hover_text_at_pointer(text);
    // An axis of the plot's own would clip the numbers at its ends.
    ui.columns(3, |columns| {
        let ends = [(egui::Align::LEFT, low), (egui::Align::Center, (low + high) / 2.0), (egui::Align::RIGHT, high)];
        for (column, (align, value)) in columns.iter_mut().zip(ends) {
            let text = RichText::new(significant_short(value)).small().weak();
            column.with_layout(egui::Layout::top_down(align), |ui| ui.label(text));
        }
    });
}

/// What is written at the axis: few digits.
fn significant_short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn in_numbers(ui: &mut Ui, mesh: &TetMesh, summary: &Summary) {
    let value = |v: f64| if v.is_finite() { significant(v) } else { "-".into() };
    numbers(ui, "quality numbers", |ui| {
        explained(ui, "Least", value(summary.min), "The smallest finite value");
        explained(
            ui,
            "Quartiles",
            [summary.q1, summary.median, summary.q3].map(value).join(", "),
            "A quarter, half and three quarters are below",
        );
        explained(ui, "Mean", format!("{} (std {})", value(summary.mean), value(summary.std)), "Mean and standard deviation");
        explained(ui, "Largest", value(summary.max), "The largest finite value");
        if let (Some(acceptable), Some(outside)) = (summary.metric.acceptable(), summary.outside) {
            let [low, high] = acceptable.range.map(significant_short);
            let range = if acceptable.range[1].is_finite() { format!("{low} to {high}") } else { format!("from {low}") };
            let text = format!("{} ({})", thousands(outside), percent(outside as f64 / summary.tets as f64));
            explained(ui, "Outside", text, &format!("Cells outside what is acceptable by {}: {range}", acceptable.source));
        }
        for (name, count, tip) in [
            ("Below", summary.below, "Cells with values below the histogram's"),
            ("Above", summary.above, "Cells with values above the histogram's"),
            ("Not finite", summary.infinite, "Cells without a finite value; the other numbers leave them out"),
            ("Inverted", mesh.inverted_count(), "Cells that the file lists in mirror order"),
            ("Zero volume", mesh.zero_volume_count(), "Cells without a volume"),
        ] {
            if count > 0 {
                explained(ui, name, thousands(count), tip);
            }
        }
        if let Some(how) = summary.metric.vtk_differs() {
            explained(ui, "VTK", "differs", &format!("{how}; octetra quality --as-vtk gives its values"));
        }
    });
}
