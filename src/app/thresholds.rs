//! The octree's thresholds, its numbers, and how good it is.

use super::model::Accuracy;
use super::octree_stage::Measured;
use super::viewer::Viewer;
use super::widgets::{choice, duration, explained, mebibytes, number, numbers, percent, position, row, rows, thousands};
use crate::geometry::Placed;
use crate::octree::{Boundary, OctreeParams, Preset, Reconstruction, Sampling};

use egui::{Grid, RichText, Slider, SliderClamping, Ui, vec2};
use glam::DVec3;

const RECONSTRUCTIONS: [(Reconstruction, &str, &str); 2] = [
    (
        Reconstruction::Continuous,
        "continuous",
        "Values at the corners of leaves, blended between them: no blocks, exact where the field is linear",
    ),
    (Reconstruction::Leaf, "leaf", "One value a leaf, as in the paper: a third of the memory, visible blocks"),
];

const BOUNDARIES: [(Boundary, &str, &str); 3] = [
    (Boundary::Mesh, "mesh", "Rays enter and leave exactly at the mesh's surface, which takes up to 48 bytes a boundary face"),
    (Boundary::Centres, "centres", "A leaf is full if its centre lies in the mesh: no more memory, a boundary in steps"),
    (Boundary::Cells, "cells", "A leaf is full if any tet overlaps it: the paper read literally, a boundary that is too thick"),
];

const SAMPLINGS: [(Sampling, &str, &str); 3] = [
    (Sampling::Tets, "tets", "The mesh's own value wherever there is one, outside a smooth continuation"),
    (Sampling::Vertices, "vertices", "By inverse distance to the vertices of a leaf's tets: the paper's, which blurs"),
    (
        Sampling::Average,
        "average",
        "The mean over a leaf's box where it holds many tets: calmer where detail is lost anyway, slower to build",
    ),
];

impl Viewer {
    /// What decides the octree, and what it came to.
    pub(super) fn thresholds(&mut self, ui: &mut Ui) {
        let is_mesh = self.document.data.mesh().is_some(); // a volume's samples are its own values
        let params = &mut self.settings.params;
        ui.horizontal(|ui| {
            for (name, preset) in Preset::ALL {
                if ui.selectable_label(*params == preset.params(), name).on_hover_text(preset_tip(preset)).clicked() {
                    *params = preset.params();
                }
            }
        });
        self.octree.held = rows(ui, "thresholds", |ui| {
            let by_tolerance = rule(ui, params);
            let sliders = if by_tolerance { tolerance(ui, params) } else { paper_thresholds(ui, params) };
            let depth = Slider::new(&mut params.max_depth, 1..=12).clamping(SliderClamping::Edits);
            let depth = row(ui, "Max depth", "No cell is deeper; each depth more may take 8 times the memory and time", depth).dragged();
            choice(ui, "Reconstruction", "What the field is between samples", &mut params.reconstruction, &RECONSTRUCTIONS);
            choice(ui, "Boundary", "Where the volume ends", &mut params.boundary, &BOUNDARIES);
            if is_mesh {
                choice(ui, "Sampling", "What a sample is", &mut params.sampling, &SAMPLINGS);
            }
            sliders || depth
        });
    }

    /// What the octree takes.
    pub(super) fn size(&self, ui: &mut Ui) {
        let Some(model) = &self.octree.model else { return drop(ui.weak("no octree yet")) };
        let mesh = self.document.data.mesh();
        numbers(ui, "size", |ui| {
            number(ui, "Nodes", thousands(model.nodes));
            explained(ui, "Octree", mebibytes(model.bytes), "On the device: nodes, and bricks of samples where they are blended");
            let surface = model.surface.as_ref().map_or("not used".into(), |surface| mebibytes(surface.bytes()));
            explained(ui, "Surface", surface, "On the device beside it: the mesh's surface, that rays are cut to");
            if let Some(mesh) = mesh {
                let uniform = model.params.uniform_depth(mesh.tets().len() - mesh.zero_volume_count());
                explained(ui, "Uniform to", format!("depth {uniform}"), "Down to there all cells that hold tets are divided");
            }
            let times = format!("{}, {}", duration(model.build_s), duration(model.upload_s));
            explained(ui, "Build, upload", times, "From the mesh in memory to the octree, and on to the device with the surface");
        });
        ui.add_space(4.0);
        ui.weak("Leaves by depth");
        leaves(ui, &model.leaves_by_depth);
    }

    /// How far the octree is from the mesh.
    pub(super) fn accuracy(&self, ui: &mut Ui) {
        ui.spacing_mut().item_spacing.y = 2.0;
        let center = self.document.data.center();
        match &self.octree.accuracy {
            Measured::Done(accuracy) => figures(ui, accuracy, center, 1.0),
            Measured::Running(job, found) => {
                let done = job.progress().1.unwrap_or(0.0);
                match found {
                    Some(accuracy) => figures(ui, accuracy, center, done),
                    None => drop(ui.weak(format!("measuring ... {:.0} %", done * 100.0))),
                }
            }
            Measured::Waiting if self.octree.held => drop(ui.weak("measured when the slider rests")),
            Measured::Waiting => drop(ui.weak("measured when the octree is built")),
            Measured::Failed => drop(ui.weak("could not be measured")),
        }
        // What is built while a slider is held may be less deep than is asked for.
        let Some(model) = self.octree.model.as_ref().filter(|_| !self.octree.held) else { return };
        let (Some(unmet), Some(tolerance)) = (model.unmet, model.params.tolerance) else { return };
        let at = position(unmet.at + center);
        let tip = format!(
            "Leaves of the greatest depth, {}, that are estimated to be off by more than the tolerance, {}; the worst by {} at {at}. A greater \
             depth resolves them, in more memory.",
            model.params.max_depth,
            percent(tolerance),
            percent(f64::from(unmet.worst_rel)),
        );
        numbers(ui, "unmet", |ui| {
            let text = format!("{} leaves, worst {}", thousands(unmet.leaves), percent(f64::from(unmet.worst_rel)));
            explained(ui, "Not met in", text, &tip);
        });
    }
}

/// By what cells are divided; whether that is a tolerance.
fn rule(ui: &mut Ui, params: &mut OctreeParams) -> bool {
    const RULES: [(bool, &str, &str); 2] = [
        (true, "tolerance", "Divide until the octree is close enough to the field, wherever the depth allows: say how good, not how"),
        (false, "V and W", "The paper's: divide while a cell holds many tets whose values vary"),
    ];
    let mut by_tolerance = params.tolerance.is_some();
    choice(ui, "Refine by", "What decides whether a cell is divided", &mut by_tolerance, &RULES);
    if by_tolerance != params.tolerance.is_some() {
        let rest = params.clone();
        *params = if by_tolerance { rest.by_tolerance() } else { rest.by_thresholds() };
    }
    by_tolerance
}

/// The slider of R; whether it is held.
fn tolerance(ui: &mut Ui, params: &mut OctreeParams) -> bool {
    let Some(tolerance) = &mut params.tolerance else { return false };
    let slider = Slider::new(tolerance, 1e-4..=0.5).logarithmic(true).clamping(SliderClamping::Edits);
    let slider = slider.custom_formatter(|r, _| percent(r)).custom_parser(parse_percent);
    let tip = "R: how far the octree may be from the field, in percent of the field's range; half of it takes about 1.7 times the memory";
    row(ui, "Tolerance R", tip, slider).dragged()
}

/// The sliders of U, V and W; whether one is held.
fn paper_thresholds(ui: &mut Ui, params: &mut OctreeParams) -> bool {
    let tets = Slider::new(&mut params.max_leaf_tets, 0..=1000).logarithmic(true).smallest_positive(1.0).clamping(SliderClamping::Edits);
    let tets = row(ui, "Max tets V", "A cell with fewer tets is not divided", tets);
    let variance = Slider::new(&mut params.max_leaf_variance, 0.0..=0.1).logarithmic(true).smallest_positive(1e-7);
    let variance = variance.custom_formatter(|w, _| if w == 0.0 { "0".into() } else { format!("{w:.1e}") });
    let tip = "A cell whose values, in [0, 1], vary less is not divided; 1e-4 is a standard deviation of 1 % of the range";
    let variance = row(ui, "Max variance W", tip, variance);
    let initial = Slider::new(&mut params.initial_cell_tets, 1.0..=10000.0).logarithmic(true).max_decimals(1);
    let initial = row(ui, "Initial tets U", "First all cells are divided until they hold fewer tets than this on average", initial);
    if initial.changed() {
        params.initial_depth = None;
    }
    [tets, variance, initial].iter().any(|slider| slider.dragged())
}

/// The measured error, and the bound or what share of the mesh is bounded.
fn figures(ui: &mut Ui, accuracy: &Accuracy, center: DVec3, bounded: f32) {
    let error = &accuracy.error.by_volume;
    if error.points == 0 {
        ui.weak("nothing to measure: the octree is empty");
        return;
    }
    let points = thousands(accuracy.error.sampling.points);
    numbers(ui, "accuracy", |ui| {
        let tip =
            format!("Root mean square difference of octree and mesh at {points} points spread over the volume, in percent of the range");
        explained(ui, "RMSE", percent(error.rmse_rel), &tip);
        let within = format!("99 % of the volume is within {}, 99.9 % within {}", percent(error.p99_rel), percent(error.p999_rel));
        let at = error.max_at.map_or(String::new(), |at| format!(" It is at {}.", position(at)));
        explained(ui, "Largest error", percent(error.max_rel), &format!("The largest difference that was met.{at} {within}."));
        let psnr = if error.psnr_db.is_finite() { format!("{:.1} dB", error.psnr_db) } else { "no error".into() };
        explained(ui, "PSNR", psnr, "The same as RMSE, in decibels of the range: 20 dB more is a tenth of the error");
        if error.uncovered > 0.0 {
            explained(
                ui,
                "Empty",
                percent(error.uncovered),
                "Volume of the mesh where the octree has nothing; `mesh` as boundary leaves none",
            );
        }
        let nowhere = "No error anywhere in the mesh is larger: computed, not measured.";
        match accuracy.bound {
            Some(bound) => {
                let tip = format!("{nowhere} So much is possible in the leaf around {}.", position(bound.at + center));
                explained(ui, "Bound", percent(bound.bound_rel), &tip);
            }
            None if accuracy.is_complete => explained(ui, "Bound", "none", "Volumes that are turned against the axes have none."),
            None => explained(ui, "Bound", format!("computing ... {:.0} %", bounded * 100.0), nowhere),
        }
    });
}

fn preset_tip(preset: Preset) -> String {
    let what = match preset {
        Preset::Paper => "As in the paper: V and W, one sample a leaf",
        Preset::Fast => "A first look",
        Preset::Balanced => "The default",
        Preset::Fine => "Where pictures are measured: several times the memory",
    };
    let OctreeParams { tolerance, max_depth, .. } = preset.params();
    let tolerance = tolerance.map_or(String::new(), |r| format!("tolerance {}, ", percent(r)));
    format!("{what} ({tolerance}depth {max_depth})")
}

/// The share that a percentage stands for, with its sign or without.
fn parse_percent(text: &str) -> Option<f64> {
    let percent: f64 = text.trim().trim_end_matches('%').trim_end().parse().ok()?;
    Some(percent / 100.0)
}

/// A bar for every depth from the first with leaves to the last.
fn leaves(ui: &mut Ui, leaves_by_depth: &[usize]) {
    let most = leaves_by_depth.iter().copied().max().unwrap_or(0).max(1);
    let first = leaves_by_depth.iter().position(|&n| n > 0).unwrap_or(0);
    Grid::new("leaves").num_columns(3).min_col_width(16.0).min_row_height(14.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for (depth, &count) in leaves_by_depth.iter().enumerate().skip(first) {
            ui.label(RichText::new(format!("{depth:>2}")).small().monospace());
            let (rect, _) = ui.allocate_exact_size(vec2(172.0, 10.0), egui::Sense::hover());
            let width = rect.width() * count as f32 / most as f32;
            let filled = egui::Rect::from_min_size(rect.min, vec2(width.max(if count > 0 { 1.0 } else { 0.0 }), rect.height()));
            ui.painter().rect_filled(filled, 1.0, ui.visuals().selection.bg_fill);
            ui.label(RichText::new(thousands(count)).small());
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_are_read_as_they_are_written() {
        assert_eq!(["2", "2 %", " 2%", "0.5 %", "x", ""].map(parse_percent), [Some(0.02), Some(0.02), Some(0.02), Some(0.005), None, None]);
    }
}
