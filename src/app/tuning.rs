//! The chart of settings: a sweep in the background, what it found as points to click.

use super::jobs::{Job, Polled};
use super::model::{self, Data};
use super::viewer::Viewer;
use super::widgets::{choices, duration, mebibytes, percent};
use super::wipe::in_short;
use crate::mesh::FieldSelection;
use crate::octree::OctreeParams;
use crate::study::tune::{Kind, Plan, Record, Row};
use crate::view::{RenderSettings, View};
use anyhow::Result;
use egui::{Color32, Pos2, Ui};
use egui_plot::{Corner, GridInput, GridMark, Legend, Line, MarkerShape, Plot, PlotPoint, PlotPoints, Points};

/// Pixels of the sweep's pictures along each side.
const SIZE: u32 = 256;

/// A click this near to a point, in points of the screen, takes it.
const REACH: f32 = 12.0;

/// What a setting costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cost {
    /// Bytes of the octree.
    #[default]
    Bytes,
    /// Seconds to build it.
    Build,
    /// Seconds of a frame.
    Frame,
}

/// How many settings are swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sweeping {
    /// About 10.
    #[default]
    Quick,
    /// About 30.
    Full,
}

/// The chart's state.
#[derive(Default)]
pub struct Tuning {
    /// Whether the chart is shown.
    pub is_open: bool,
    /// What its points are over.
    pub cost: Cost,
    /// How many settings are swept.
    pub sweeping: Sweeping,
    /// What was found.
    record: Option<Record>,
    /// What that is of.
    of: Option<FieldSelection>,
    job: Option<Job<Result<Record>>>,
    /// Where the points are in the window, by row.
    places: Vec<Pos2>,
}

impl Tuning {
    /// The chart of another document: nothing yet.
    pub fn emptied(&self) -> Self {
        Tuning { cost: self.cost, sweeping: self.sweeping, ..Self::default() }
    }

    /// The chart of other data of the same kind: it stays open.
    pub fn of_other_data(&self) -> Self {
        Tuning { is_open: self.is_open, ..self.emptied() }
    }

    /// The settings that were measured so far, in the order of their measurement.
    pub fn rows(&self) -> &[Row] {
        self.record.as_ref().map_or(&[], |record| &record.rows)
    }

    /// What is on its way.
    pub fn progress(&self) -> Option<(&'static str, Option<f32>)> {
        self.job.as_ref().map(Job::progress)
    }

    /// Whether settings are being measured.
    pub fn is_running(&self) -> bool {
        self.job.is_some()
    }
}

impl Cost {
    /// What it is for a setting.
    fn of(self, row: &Row) -> f64 {
        match self {
            Cost::Bytes => row.bytes as f64,
            Cost::Build => row.build_s,
            Cost::Frame => row.frame_s,
        }
    }

    fn in_words(self, cost: f64) -> String {
        match self {
            Cost::Bytes => mebibytes(cost as usize),
            Cost::Build | Cost::Frame => duration(cost),
        }
    }
}

impl Viewer {
    /// The settings that the window's sweep has measured, and where their points are in the window.
    pub fn tuning_points(&self) -> impl Iterator<Item = (&Row, Pos2)> {
        self.tuning.rows().iter().zip(self.tuning.places.iter().copied())
    }

    /// Whether the window's sweep is on its way.
    pub fn is_tuning(&self) -> bool {
        self.tuning.is_running()
    }

    /// Starts the sweep of settings, or goes on with what it has not measured yet.
    pub(super) fn start_tuning(&mut self, ctx: &egui::Context) {
        let plan = around(&self.settings.params, self.tuning.sweeping);
        let view = self.view_of_octree();
        let view = View { settings: RenderSettings { width: SIZE, height: SIZE, ..view.settings }, ..view };
        let (data, field, renderer): (Data, _, _) = (self.document.data.clone(), self.settings.field.clone(), self.renderer().clone());
        let (memory_bytes, record) = (self.memory_bytes(), self.tuning.record.clone().filter(|_| self.tuning.of.as_ref() == Some(&field)));
        self.tuning.of = Some(field.clone());
        self.tuning.job = Some(Job::start(ctx, move |progress, results| {
            let settings = plan.settings();
            let done = model::tune(&renderer, &data, &field, &view, &settings, memory_bytes, record, progress, |record| {
                results.give(Ok(record.clone()))
            });
            if let Err(error) = done {
                results.give(Err(error));
            }
        }));
    }

    /// Takes what the sweep has measured.
    pub(super) fn run_tuning(&mut self) -> Result<()> {
        if self.tuning.of.as_ref().is_some_and(|of| *of != self.settings.field) {
            self.tuning = self.tuning.of_other_data();
        }
        while let Some(polled) = self.tuning.job.as_ref().map(Job::poll) {
            match polled {
                Polled::Pending => break,
                Polled::Ended => self.tuning.job = None,
                Polled::Result(Ok(record)) => self.tuning.record = Some(record),
                Polled::Result(Err(error)) => {
                    self.tuning.job = None;
                    return Err(error);
                }
            }
        }
        Ok(())
    }

    /// The chart and what goes with it.
    pub(super) fn tuning_chart(&mut self, ui: &mut Ui) {
        const COSTS: [(Cost, &str, &str); 3] = [
            (Cost::Bytes, "size", "Bytes of the octree"),
            (Cost::Build, "build", "Seconds to build it"),
            (Cost::Frame, "frame", "Seconds of a frame of the present view, 256 x 256"),
        ];
        const SWEEPS: [(Sweeping, &str, &str); 2] =
            [(Sweeping::Quick, "quick", "About 10 settings"), (Sweeping::Full, "full", "About 30 settings")];
        ui.horizontal(|ui| {
            let is_running = self.tuning.is_running();
            let (text, tip) = if is_running {
                ("Stop", "Stop the sweep; what it has measured stays")
            } else {
                (
                    "Sweep",
                    "Build and measure settings around the present one in the background; goes on with those that are not measured yet",
                )
            };
            if ui.button(text).on_hover_text(tip).clicked() {
                if is_running { self.tuning.job = None } else { self.start_tuning(&ui.ctx().clone()) }
            }
            choices(ui, &mut self.tuning.sweeping, &SWEEPS);
            ui.separator();
            ui.weak("RMSE over");
            choices(ui, &mut self.tuning.cost, &COSTS);
            if self.tuning.is_running() {
                ui.weak(format!("{} measured", self.tuning.rows().len()));
            } else if self.tuning.rows().is_empty() {
                ui.weak("Sweep measures settings around the present one; click a point to take its setting");
            }
        });
        self.points(ui);
    }

    fn points(&mut self, ui: &mut Ui) {
        let cost = self.tuning.cost;
        let rows = self.tuning.rows().to_vec();
        let at = |row: &Row| [cost.of(row).max(1e-9).log10(), error_percent(row).log10()];
        let present = self.present(cost);
        let series: Vec<Points> = Kind::ALL
            .iter()
            .zip(COLORS)
            .filter_map(|(&(kind, name), color)| {
                let points: Vec<[f64; 2]> = rows.iter().filter(|row| Kind::of(&row.params) == kind).map(at).collect();
                (!points.is_empty()).then(|| Points::new(name, points).radius(4.0).color(color).allow_hover(false))
            })
            .collect();
        let front = error_front(&rows, cost).into_iter().map(|i| at(&rows[i])).collect::<Vec<_>>();
        let name = match cost {
            Cost::Bytes => "octree, MiB",
            Cost::Build => "build, s",
            Cost::Frame => "frame, ms",
        };
        let unit = match cost {
            Cost::Bytes => f64::from(1 << 20),
            Cost::Build => 1.0,
            Cost::Frame => 1e-3,
        };
        let shift = unit.log10();
        let plot = Plot::new(("tuning", cost as u8))
            .legend(Legend::default().position(Corner::LeftBottom))
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .x_axis_label(name)
            .y_axis_label("RMSE, %")
            .x_grid_spacer(move |input| decades(input, shift))
            .y_grid_spacer(|input| decades(input, 0.0))
            .x_axis_formatter(move |mark, _| in_digits(10f64.powf(mark.value - shift)))
            .y_axis_formatter(|mark, _| in_digits(10f64.powf(mark.value)))
            .label_formatter(|_| None);
        let response = plot.show(ui, move |ui| {
            ui.line(Line::new("best", PlotPoints::from(front)).color(Color32::GRAY).width(1.0).allow_hover(false));
            series.into_iter().for_each(|points| ui.points(points));
            if let Some(present) = present {
                let mark = Points::new("present", vec![present]).shape(MarkerShape::Circle).filled(false).radius(8.0).color(Color32::WHITE);
                ui.points(mark.allow_hover(false));
            }
        });
        self.tuning.places = rows.iter().map(at).map(|[x, y]| response.transform.position_from_point(&PlotPoint::new(x, y))).collect();
        let pointer = response.response.hover_pos();
        let Some(row) = pointer.and_then(|pointer| nearest(&self.tuning.places, pointer)).map(|i| &rows[i]) else { return };
        let text = format!(
            "{}\n{} {}, RMSE {}, largest {}, PSNR {:.1} dB\nbuild {}, frame {}\nclick to take it",
            in_short(&row.params),
            Cost::Bytes.in_words(row.bytes as f64),
            Kind::ALL.iter().find(|(kind, _)| *kind == Kind::of(&row.params)).map_or("", |(_, name)| name),
            percent(row.rmse_rel),
            percent(row.max_rel),
            row.psnr_db,
            duration(row.build_s),
            duration(row.frame_s),
        );
        if response.response.clicked() {
            self.settings.params = row.params.clone();
        }
        response.response.on_hover_text_at_pointer(text);
    }

    /// Where the octree that is shown is in the chart, once it is measured.
    fn present(&self, cost: Cost) -> Option<[f64; 2]> {
        let (model, accuracy) = (self.octree.model.as_ref()?, self.octree.accuracy.accuracy()?);
        let cost = match cost {
            Cost::Bytes => model.bytes as f64,
            Cost::Build => model.build_s,
            Cost::Frame => return None, // the window's frames have another size
        };
        let error = (100.0 * accuracy.error.by_volume.rmse_rel).max(LEAST_PERCENT);
        Some([cost.max(1e-9).log10(), error.log10()])
    }
}

/// The sweep around a setting: its depth and two less or more, tolerances or variances around its own.
fn around(params: &OctreeParams, sweeping: Sweeping) -> Plan {
    let depth = params.max_depth;
    let by_tolerance = params.clone().by_tolerance();
    let tolerance = by_tolerance.tolerance.filter(|tolerance| *tolerance > 0.0).unwrap_or(0.01);
    let (factors, depths, variances): (&[f64], _, _) = match sweeping {
        Sweeping::Quick => (&[4.0, 1.0], vec![depth.saturating_sub(2).max(1), depth], vec![1e-3]),
        Sweeping::Full => {
            let deepest = (depth + 1).min(OctreeParams::DEPTH_LIMIT);
            (&[4.0, 2.0, 1.0, 0.5, 0.25, 0.125], (depth.saturating_sub(2).max(1)..=deepest).collect(), vec![4e-3, 1e-3, 2.5e-4, 6e-5])
        }
    };
    Plan { tolerances: factors.iter().map(|factor| factor * tolerance).collect(), depths, variances, variance_depths: vec![depth] }
}

/// Colours that the colour-blind tell apart (Okabe & Ito 2008), as in the command's chart but lighter.
const COLORS: [Color32; 4] =
    [Color32::from_rgb(86, 180, 233), Color32::from_rgb(204, 121, 167), Color32::from_rgb(0, 190, 140), Color32::from_rgb(230, 120, 40)];

/// An error of 0 has no logarithm.
const LEAST_PERCENT: f64 = 1e-6;

fn error_percent(row: &Row) -> f64 {
    (100.0 * row.rmse_rel).max(LEAST_PERCENT)
}

/// The rows with a smaller error than every row that costs no more, by rising cost.
fn error_front(rows: &[Row], cost: Cost) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| cost.of(&rows[a]).total_cmp(&cost.of(&rows[b])).then(rows[a].rmse_rel.total_cmp(&rows[b].rmse_rel)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let is_better = rows[i].rmse_rel < least;
        least = least.min(rows[i].rmse_rel);
        is_better
    });
    order
}

/// The place nearest to the pointer, if one is near.
fn nearest(places: &[Pos2], pointer: Pos2) -> Option<usize> {
    let distances = places.iter().map(|place| place.distance(pointer)).enumerate();
    distances.filter(|(_, distance)| *distance < REACH).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// Marks at 1, 2 and 5 in each decade of a logarithmic axis whose unit lies at `shift`.
fn decades(input: GridInput, shift: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let decades = (low - shift).floor() as i32..=(high - shift).ceil() as i32;
    let marks = decades.filter(|_| high - low < 30.0).flat_map(|decade| [1.0f64, 2.0, 5.0].map(|digit| (f64::from(decade), digit)));
    marks
        .map(|(decade, digit)| GridMark { value: decade + digit.log10() + shift, step_size: if digit == 1.0 { 1.0 } else { 0.35 } })
        .filter(|mark| (low..=high).contains(&mark.value))
        .collect()
}

/// A round number without needless zeros.
fn in_digits(value: f64) -> String {
    let digits = (-value.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn the_sweep_is_around_what_is_chosen() {
        let params = OctreeParams { max_depth: 5, tolerance: Some(0.02), ..OctreeParams::default() };
        for (sweeping, count, deepest) in [(Sweeping::Quick, 6, 5), (Sweeping::Full, 4 * 6 + 8, 6)] {
            let settings = around(&params, sweeping).settings();
            assert!(settings.contains(&params) && settings.iter().all(|s| s.validate().is_ok()));
            assert_eq!((settings.len(), settings.iter().map(|s| s.max_depth).max()), (count, Some(deepest)));
        }
        let shallow = OctreeParams { max_depth: 1, tolerance: Some(0.0), ..OctreeParams::default() };
        assert!(around(&shallow, Sweeping::Full).settings().iter().all(|s| s.validate().is_ok() && s.tolerance != Some(0.0)));
    }

    #[test]
    fn the_line_joins_what_no_cheaper_setting_beats() {
        let row = |bytes: u64, rmse_rel: f64, build_s: f64| Row {
            params: OctreeParams::default(),
            depth: 5,
            nodes: 10,
            leaves: 8,
            bytes,
            build_s,
            rmse_rel,
            max_rel: 0.5,
            uncovered: 0.0,
            psnr_db: 40.0,
            psnr_db_by_view: vec![],
            frame_s: 0.01,
            frame_by: crate::study::tune::Clock::Wall,
        };
        let rows = [row(300, 0.01, 1.0), row(100, 0.04, 3.0), row(200, 0.05, 0.5), row(200, 0.02, 2.0), row(400, 0.01, 9.0)];
        assert_eq!(error_front(&rows, Cost::Bytes), [1, 3, 0]);
        assert_eq!(error_front(&rows, Cost::Build), [2, 0]);
    }

    #[test]
    fn axes_have_round_numbers_and_clicks_take_the_nearest() {
        let marks = decades(GridInput { bounds: (5.7, 7.2), base_step_size: 0.1 }, f64::from(1 << 20).log10());
        let said: Vec<String> = marks.iter().map(|m| in_digits(10f64.powf(m.value) / f64::from(1 << 20))).collect();
        assert!(["0.5", "1", "2", "5", "10"].iter().all(|n| said.iter().any(|s| s == n)), "{said:?}");
        let places = [pos2(10.0, 10.0), pos2(30.0, 10.0)];
        assert_eq!(nearest(&places, pos2(24.0, 12.0)), Some(1));
        assert_eq!(nearest(&places, pos2(30.0, 40.0)), None);
    }
}
