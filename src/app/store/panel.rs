//! The widgets beside and above the pictures, and the line under them.

use super::super::widgets::{choice, number, numbers, rows, section, significant};
use super::cut::{AXES, Cut};
use super::flat::Flat;
use super::play::Turn;
use super::space::{FlatView, Space};
use super::view::SPATIAL;
use super::window::StoreWindow;
use crate::view::Camera;
use egui::{Button, ComboBox, DragValue, Rect, Response, RichText, Slider, Ui, vec2};
use glam::DVec3;

impl StoreWindow {
    /// All of the panel.
    pub(super) fn panel(&mut self, ui: &mut Ui) {
        ui.add_space(6.0);
        ui.add(egui::Label::new(RichText::new(&self.name).strong()).truncate());
        section(ui, "Slices", |ui| self.slices(ui));
        section(ui, "Play", |ui| self.playing(ui));
        section(ui, "Colours", |ui| self.colors(ui));
        section(ui, "Detail", |ui| self.detail(ui));
        section(ui, "Shape", |ui| self.shape(ui));
        section(ui, "Volume", |ui| self.volume(ui));
        ui.add_space(8.0);
    }

    fn slices(&mut self, ui: &mut Ui) {
        let dims = self.source.frame().dims;
        let mut gone = None;
        for i in 0..self.cuts.len() {
            let title = self.title(i);
            ui.horizontal(|ui| {
                let cut = &mut self.cuts[i];
                let shown = ui.checkbox(&mut cut.is_shown, "");
                labelled(&shown, &format!("show {title}"));
                shown.on_hover_text("Draw this slice in space, and its line over the others");
                let name = Button::selectable(self.selected == i, RichText::new(&title).color(cut.color()).strong());
                if ui.add(name.min_size(vec2(56.0, 0.0))).on_hover_text("Select it: keys and Play move it").clicked() {
                    self.selected = i;
                }
                let [low, high] = cut.range(dims);
                let mut position = cut.position;
                let tip = match cut.axis() {
                    Some(axis) => format!("Index along {}, from 0", AXES[axis]),
                    None => "Distance from the middle of the volume along the normal, voxels".to_owned(),
                };
                ui.spacing_mut().slider_width = 84.0;
                let slider = ui.add(Slider::new(&mut position, low..=high).step_by(1.0).smart_aim(false).show_value(false));
                labelled(&slider, &format!("slice {title}"));
                let drag = DragValue::new(&mut position).range(low..=high).speed(0.25).update_while_editing(false);
                let drag = drag.custom_formatter(|position, _| short(position));
                let drag = ui.add_sized(vec2(52.0, ui.spacing().interact_size.y), drag);
                labelled(&drag, &format!("position of {title}"));
                let is_changed = slider.on_hover_text(&tip).changed() | drag.on_hover_text(&tip).changed();
                if is_changed && position != cut.position {
                    cut.position = position.clamp(low, high);
                    self.selected = i;
                }
                let remove = ui.add_enabled(self.cuts.len() > 1, Button::new("x").small());
                labelled(&remove, &format!("remove {title}"));
                if remove.on_hover_text("Remove this slice").clicked() {
                    gone = Some(i);
                }
            });
            if self.selected == i {
                self.normal_row(ui, i);
            }
        }
        if let Some(i) = gone {
            self.remove(i);
        }
        ui.horizontal(|ui| {
            ui.label("Add");
            for (axis, name) in AXES.into_iter().enumerate() {
                if ui.button(format!("+ {name}")).on_hover_text(format!("Another slice across {name}")).clicked() {
                    self.add(Cut::across(axis, (f64::from(dims[axis]) / 2.0).floor()));
                }
            }
            if ui.button("+ oblique").on_hover_text("A slice of any direction: turn it in space, or type its normal").clicked() {
                let normal = self.space().index_normal(DVec3::new(1.0, 1.0, 0.5));
                let flat = Cut::across(2, ((f64::from(dims[2]) - 1.0) / 2.0).floor());
                if let Some(cut) = flat.turned(normal, dims) {
                    self.add(Cut { position: 0.0, ..cut });
                }
            }
        });
    }

    fn add(&mut self, cut: Cut) {
        self.cuts.push(cut);
        self.selected = self.cuts.len() - 1;
    }

    /// The normal of the selected slice.
    fn normal_row(&mut self, ui: &mut Ui, number: usize) {
        let dims = self.source.frame().dims;
        ui.horizontal(|ui| {
            ui.add_space(22.0);
            ui.weak("normal");
            let cut = self.cuts[number];
            // What was typed stays as it was typed, whatever its length.
            let is_as_typed = self.typed_normal.normalize_or_zero().distance(cut.normal) < 1e-9;
            let mut normal = if is_as_typed { self.typed_normal } else { cut.normal };
            let mut is_changed = false;
            for (axis, name) in AXES.into_iter().enumerate() {
                let drag = DragValue::new(&mut normal[axis]).speed(0.01).max_decimals(3).update_while_editing(false);
                let drag = ui.add_sized(vec2(46.0, ui.spacing().interact_size.y), drag);
                labelled(&drag, &format!("normal {name}"));
                is_changed |=
                    drag.on_hover_text(format!("Share of {name} of the normal, in voxels; its length counts for nothing")).changed();
            }
            if ui.small_button("view").on_hover_text("Turn it to face the eye").clicked() {
                normal = self.space().index_normal(self.camera.eye - self.camera.target);
                is_changed = true;
            }
            if let Some(turned) = is_changed.then(|| cut.turned(normal, dims)).flatten() {
                (self.cuts[number], self.typed_normal) = (turned, normal);
            }
        });
    }

    fn playing(&mut self, ui: &mut Ui) {
        let selected = self.selected;
        ui.horizontal(|ui| {
            if ui.button("-1").on_hover_text("The position before (Left)").clicked() {
                self.step(selected, -1.0);
            }
            let is_playing = self.play.playing.is_some();
            let text = if is_playing { "Stop".to_owned() } else { format!("Play {}", self.title(selected)) };
            if ui.add(Button::new(text).min_size(vec2(90.0, 0.0))).on_hover_text("Move the selected slice by itself (Space)").clicked() {
                let number = self.play.playing.unwrap_or(selected);
                self.play.flip(number);
            }
            if ui.button("+1").on_hover_text("The position after (Right)").clicked() {
                self.step(selected, 1.0);
            }
            let speed = ui.add(DragValue::new(&mut self.play.per_second).range(1.0..=120.0).speed(0.5).max_decimals(0).suffix(" / s"));
            labelled(&speed, "positions a second");
            speed.on_hover_text("Positions a second");
        });
        ui.horizontal(|ui| {
            let turn = &mut self.play.turn;
            ui.selectable_value(turn, Turn::BackAndForth, "back and forth").on_hover_text("At the end go back");
            ui.selectable_value(turn, Turn::Loop, "loop").on_hover_text("At the end begin anew");
        });
    }

    fn detail(&mut self, ui: &mut Ui) {
        rows(ui, "detail", |ui| {
            choice(
                ui,
                "Load",
                "Which level is loaded at rest",
                &mut self.is_whole,
                &[
                    (false, "as on screen", "The level whose voxels are as large as pixels: nothing finer could be seen"),
                    (true, "full", "The full resolution, as far as there is room; pictures smaller than the data flicker"),
                ],
            );
        });
        let mut is_left_out = self.stream.leaves_out_flat();
        let tip =
            "Do not refine bricks whose values all lie within 1/255 of the range: fewer bytes are read, and no colour changes by more";
        if ui.checkbox(&mut is_left_out, "Leave flat parts coarse").on_hover_text(tip).changed() {
            self.stream.leave_out_flat(is_left_out);
        }
    }

    fn shape(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.weak("stretch");
            let mut stretch = self.stretch;
            for (axis, name) in AXES.into_iter().enumerate() {
                let drag = DragValue::new(&mut stretch[axis]).speed(0.02).range(0.01..=1000.0).max_decimals(2).prefix(format!("{name} "));
                labelled(&ui.add(drag).on_hover_text(format!("How many times as long {name} is shown")), &format!("stretch {name}"));
            }
            if ui.add_enabled(stretch != DVec3::ONE, Button::new("true")).on_hover_text("The volume's true shape").clicked() {
                stretch = DVec3::ONE;
            }
            if stretch != self.stretch {
                self.stretch = stretch;
                self.fit();
            }
        });
    }

    fn volume(&mut self, ui: &mut Ui) {
        let pyramid = *self.source.pyramid();
        let [nx, ny, nz] = pyramid.dims(0);
        let bytes = pyramid.dims(0).iter().map(|&n| f64::from(n)).product::<f64>() * self.source.voxel_bytes() as f64;
        let [low, high] = self.source.range();
        numbers(ui, "volume", |ui| {
            number(ui, "Values", self.source.name().to_owned());
            number(ui, "Voxels", format!("{nx} x {ny} x {nz}"));
            number(ui, "Size", gibibytes(bytes));
            number(ui, "Levels", pyramid.levels().to_string());
            number(ui, "Range", format!("{} to {}", significant(low), significant(high)));
        });
    }

    /// What is above a picture.
    pub(super) fn header(&mut self, ui: &mut Ui, picture: usize, rect: Rect) {
        ui.painter().rect_filled(rect, 0.0, ui.visuals().panel_fill);
        ui.horizontal_centered(|ui| {
            ui.add_space(6.0);
            if picture == SPATIAL {
                ui.label(RichText::new("In space").strong());
            } else {
                self.choose_cut(ui, picture);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_space(4.0);
                let is_max = self.maximised == Some(picture);
                let text = if is_max { "All four" } else { "Enlarge" };
                let tip = if is_max { "Show all four pictures again (Escape)" } else { "Give this picture all the room" };
                let button = ui.small_button(text);
                labelled(&button, &format!("{} {}", text.to_lowercase(), if picture == SPATIAL { "space" } else { AXES[2 - picture] }));
                if button.on_hover_text(tip).clicked() {
                    self.maximised = if is_max { None } else { Some(picture) };
                }
                let fit = ui.small_button("Fit");
                if fit.on_hover_text("Show all of it").clicked() {
                    if picture == SPATIAL {
                        self.fit();
                    } else {
                        self.flats[picture].view = FlatView::default();
                    }
                }
            });
        });
    }

    fn choose_cut(&mut self, ui: &mut Ui, picture: usize) {
        let number = self.flats[picture].cut;
        let Some(cut) = self.cuts.get(number) else { return };
        let text = RichText::new(format!("{} = {}", self.title(number), short(cut.position))).color(cut.color()).strong();
        let combo = ComboBox::from_id_salt(("shown", picture)).selected_text(text).width(130.0);
        let response = combo.show_ui(ui, |ui| {
            for i in 0..self.cuts.len() {
                let text = RichText::new(self.title(i)).color(self.cuts[i].color());
                if ui.selectable_label(i == number, text).clicked() && i != number {
                    self.flats[picture] = Flat::new(i);
                }
            }
        });
        response.response.on_hover_text("Which slice this picture shows");
    }

    /// Shows all in space, from the same direction.
    fn fit(&mut self) {
        let bounds = Space::new(self.source.frame(), self.stretch).bounds();
        let camera = Camera { target: bounds.center(), eye: bounds.center() + (self.camera.eye - self.camera.target), ..self.camera };
        self.camera = camera.fitted(bounds, 1.2);
    }

    /// The line at the bottom; how many bricks it says are to come.
    pub(super) fn status_line(&self, ui: &mut Ui) -> usize {
        let progress = self.progress();
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let counters = &progress.counters;
            ui.add_space(4.0);
            ui.weak(format!("{:.0} ms", self.last_frame_ms())).on_hover_text("From one frame to the next while something moves");
            ui.separator();
            let asked = counters.hits + counters.misses;
            let hits = if asked > 0 { format!("hits {:.0} %", 100.0 * counters.hits as f64 / asked as f64) } else { "hits -".into() };
            ui.weak(hits).on_hover_text("Bricks that were in memory when a picture asked for them");
            ui.separator();
            let of = |[used, most]: [u64; 2]| format!("{} / {} MiB", used >> 20, most >> 20);
            ui.weak(format!("GPU {}", of(progress.device))).on_hover_text("Bricks on the GPU, and the most there may be");
            ui.separator();
            ui.weak(format!("memory {}", of(progress.memory))).on_hover_text("Bricks in memory, and the most there may be (--memory)");
            ui.separator();
            let state = match progress.left {
                0 if progress.is_cut => "coarser than the screen: no room".to_owned(),
                0 => "complete".to_owned(),
                1 => "1 brick to come".to_owned(),
                left => format!("{left} bricks to come"),
            };
            ui.label(state).on_hover_text("Whether the pictures show all that the screen can, or what they wait for");
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                let error = self.problem().map(str::to_owned).or(counters.last_error.clone());
                let (text, color) = match (error, self.probed()) {
                    (Some(error), _) => (error, ui.visuals().error_fg_color),
                    (None, Some(probed)) => (probed.text(), ui.visuals().text_color()),
                    (None, None) => ("point at a slice for its values".to_owned(), ui.visuals().weak_text_color()),
                };
                ui.add(egui::Label::new(RichText::new(&text).color(color)).truncate()).on_hover_text(text);
            });
        });
        progress.left
    }
}

fn short(position: f64) -> String {
    if position.fract() == 0.0 { format!("{position:.0}") } else { format!("{position:.2}") }
}

fn gibibytes(bytes: f64) -> String {
    let gib = bytes / f64::from(1 << 30);
    if gib >= 0.1 { format!("{gib:.2} GiB") } else { format!("{:.1} MiB", gib * 1024.0) }
}

/// Names a widget for those who do not see it.
fn labelled(response: &Response, name: &str) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_label(name));
}
