//! Two pictures in one: with a divider to drag, beside each other, mixed, or their difference.

use super::linked::Kept;
use super::slot::Slot;
use super::viewer::Viewer;
use super::viewport::Compared;
use super::widgets::{choice, choices, mebibytes, percent, row, rows};
use crate::octree::OctreeParams;
use egui::{Align2, Color32, CornerRadius, FontId, Painter, Rect, Sense, Slider, Stroke, Ui, pos2, vec2};

/// How two pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WipeMode {
    /// One picture only.
    #[default]
    Off,
    /// One left, the other right of a divider.
    Wipe,
    /// One left of the other, each whole.
    Beside,
    /// One over the other, partly transparent.
    Blend,
    /// Where they differ.
    Difference,
}

/// What the octree is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Against {
    /// The mesh itself.
    #[default]
    Exact,
    /// The octree that was kept.
    Kept,
}

/// What is compared, and how.
pub struct Wipe {
    /// How it is shown.
    pub mode: WipeMode,
    /// What with.
    pub against: Against,
    /// The octree kept as A.
    pub kept: Option<Kept>,
    /// Whether a file that is being read waits for the octree that it is to be compared with.
    pub awaits: bool,
    /// Where the divider is, in pictures from the left.
    pub divider: f32,
    /// What differences are multiplied by.
    pub gain: f32,
    /// How much of A a mixture has, in [0, 1].
    pub share: f32,
}

impl Default for Wipe {
    fn default() -> Self {
        Wipe { mode: WipeMode::Off, against: Against::Exact, kept: None, awaits: false, divider: 0.5, gain: 20.0, share: 0.5 }
    }
}

impl Wipe {
    /// The pictures that are compared, left and right; `None` if none are.
    pub fn slots(&self) -> Option<[Slot; 2]> {
        match (self.mode, self.against) {
            (WipeMode::Off, _) => None,
            (_, Against::Exact) => Some([Slot::Octree, Slot::Exact]),
            (_, Against::Kept) => self.kept.as_ref().map(|_| [Slot::Kept, Slot::Octree]),
        }
    }

    /// What is painted in one place; `None` if that is one picture.
    pub fn compared(&self) -> Option<Compared> {
        let slots = self.slots()?;
        match self.mode {
            WipeMode::Off | WipeMode::Beside => None,
            WipeMode::Wipe => Some(Compared::Wipe(slots, self.divider)),
            WipeMode::Blend => Some(Compared::Blend(slots, self.share)),
            WipeMode::Difference => Some(Compared::Difference(slots, self.gain)),
        }
    }
}

impl Viewer {
    /// What is painted in one place, if both pictures that are to be compared are there.
    pub(super) fn compared(&self) -> Option<Compared> {
        self.wipe.compared().filter(|_| self.has_both())
    }

    fn has_both(&self) -> bool {
        self.wipe.slots().is_some_and(|slots| slots.iter().all(|&slot| self.viewport.has(slot)))
    }

    /// The pictures beside each other, as far as they are there.
    pub(super) fn paint_beside(&self, painter: &Painter, places: [Rect; 2]) {
        for (slot, place) in self.wipe.slots().into_iter().flatten().zip(places) {
            self.viewport.paint_one(painter, place, self.size, slot);
        }
    }

    /// Opens a second file.
    pub(super) fn compare_button(&mut self, ui: &mut Ui, name: &str) {
        let tip = "Open a second file: what is shown is kept as A, the file becomes B, with the same camera, colours, range and thresholds";
        if ui.button(name).on_hover_text(tip).clicked() {
            self.choose_second(&ui.ctx().clone());
        }
    }

    /// What is compared, in the panel.
    pub(super) fn wipe_section(&mut self, ui: &mut Ui) {
        const MODES: [(WipeMode, &str, &str); 5] = [
            (WipeMode::Off, "off", "One picture"),
            (WipeMode::Wipe, "wipe", "Two pictures with a divider between them: drag it (W)"),
            (WipeMode::Beside, "side by side", "A left and B right, each whole, seen with one camera"),
            (WipeMode::Blend, "blend", "A over B, partly transparent"),
            (WipeMode::Difference, "difference", "Where they differ: the absolute difference of each channel, multiplied"),
        ];
        const AGAINST: [(Against, &str, &str); 2] = [
            (Against::Exact, "exact", "The mesh itself: A is the octree, B the exact picture"),
            (
                Against::Kept,
                "kept A",
                "The octree that was kept: of another file, or of this one with other thresholds; B is the present one",
            ),
        ];
        let is_mesh = self.document.data.mesh().is_some();
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0; // all fit in one row
            choices(ui, &mut self.wipe.mode, &MODES);
        });
        rows(ui, "wipe", |ui| {
            if is_mesh {
                choice(ui, "With", "What the octree is compared with", &mut self.wipe.against, &AGAINST);
            }
            if self.wipe.mode == WipeMode::Difference {
                let gain = Slider::new(&mut self.wipe.gain, 1.0..=200.0).logarithmic(true).max_decimals(0);
                row(ui, "Gain", "What differences are multiplied by; what is white differs by 1 / gain or more", gain);
            }
            if self.wipe.mode == WipeMode::Blend {
                row(ui, "Share of A", "How much of A is seen over B", Slider::new(&mut self.wipe.share, 0.0..=1.0).max_decimals(2));
            }
        });
        if !is_mesh {
            self.wipe.against = Against::Kept;
        }
        ui.horizontal(|ui| {
            self.compare_button(ui, "Compare with...");
            let tip = "Keep the present octree as A, to compare with what other thresholds give";
            if ui.add_enabled(self.octree.model.is_some(), egui::Button::new("Keep as A")).on_hover_text(tip).clicked() {
                self.keep();
            }
        });
        let Some(kept) = &self.wipe.kept else { return drop(ui.weak("nothing is kept yet")) };
        let text = format!("A: {}, {}, {}", kept.document.name, in_short(&kept.model.params), mebibytes(kept.model.bytes));
        let at_rest = self.octree.is_of(&self.settings.field, &self.settings.params) && self.octree.model.is_some();
        ui.horizontal(|ui| {
            let tip = "A becomes B and B becomes A: the panel, the probe and screenshots are of B";
            if ui.add_enabled(at_rest, egui::Button::new("Swap").small()).on_hover_text(tip).clicked() {
                self.swap(&ui.ctx().clone());
            }
            if ui.small_button("x").on_hover_text("Forget A and free its memory").clicked() {
                self.forget();
            }
            ui.add(egui::Label::new(egui::RichText::new(&text).weak()).truncate()).on_hover_text(&text);
        });
    }

    /// Turns the comparison on as a wipe, or off.
    pub(super) fn flip_wipe(&mut self) {
        self.wipe.mode = if self.wipe.mode == WipeMode::Off { WipeMode::Wipe } else { WipeMode::Off };
        if self.document.data.mesh().is_none() {
            self.wipe.against = Against::Kept;
        }
        if self.wipe.mode != WipeMode::Off && self.wipe.against == Against::Kept && self.wipe.kept.is_none() {
            self.say("keep an octree as A first, then change the thresholds, or open a second file (Compare)");
        }
    }

    /// Keeps the octree that is shown as A and compares with it.
    fn keep(&mut self) {
        self.wipe.kept = self.to_keep();
        self.wipe.against = Against::Kept;
        if self.wipe.mode == WipeMode::Off {
            self.wipe.mode = WipeMode::Wipe;
        }
        self.show_anew(Slot::Kept);
    }

    /// Forgets the octree that was kept.
    fn forget(&mut self) {
        self.wipe.kept = None;
        self.wipe.against = Against::Exact;
        self.wipe.mode = WipeMode::Off;
        self.shown[Slot::Kept as usize] = None;
        self.viewport.empty(Slot::Kept);
    }

    /// The divider over the picture, what is on its two sides, or the scale of differences.
    pub(super) fn wipe_over(&mut self, ui: &mut Ui, rect: Rect) {
        let Some([left, right]) = self.wipe.slots() else { return };
        let painter = ui.painter().with_clip_rect(rect);
        let font = FontId::proportional(13.0);
        let names = [self.side_name("A", left), self.side_name("B", right)];
        match self.wipe.mode {
            WipeMode::Off => {}
            WipeMode::Wipe => {
                let x = rect.left() + self.wipe.divider * rect.width();
                let handle = Rect::from_min_max(pos2(x - 6.0, rect.top()), pos2(x + 6.0, rect.bottom()));
                let response =
                    ui.interact(handle, ui.scope_id().with("divider"), Sense::drag()).on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "divider"));
                if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
                    self.wipe.divider = ((pointer.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0);
                }
                let x = rect.left() + self.wipe.divider * rect.width();
                painter.vline(x, rect.y_range(), Stroke::new(3.0, Color32::BLACK));
                painter.vline(x, rect.y_range(), Stroke::new(1.0, Color32::WHITE));
                painter.circle(pos2(x, rect.center().y), 5.0, Color32::WHITE, Stroke::new(1.0, Color32::BLACK));
                for (name, at, align) in [(&names[0], x - 8.0, Align2::RIGHT_BOTTOM), (&names[1], x + 8.0, Align2::LEFT_BOTTOM)] {
                    tag(&painter, pos2(at, rect.bottom() - 8.0), align, name, font.clone());
                }
            }
            WipeMode::Beside => {
                let Some([left, right]) = self.places(rect) else { return };
                painter.vline(rect.center().x, rect.y_range(), Stroke::new(1.0, Color32::GRAY));
                for (name, place) in names.iter().zip([left, right]) {
                    let at = place.left_bottom() + vec2(8.0, -8.0);
                    tag(&painter.with_clip_rect(place), at, Align2::LEFT_BOTTOM, name, font.clone());
                }
            }
            WipeMode::Blend => {
                let text = format!("{:.0} % {} over {}", 100.0 * self.wipe.share, names[0], names[1]);
                tag(&painter, rect.left_bottom() + vec2(8.0, -8.0), Align2::LEFT_BOTTOM, &text, font);
            }
            WipeMode::Difference => {
                scale(&painter, rect, self.wipe.gain);
                tag(
                    &painter,
                    rect.left_bottom() + vec2(8.0, -8.0),
                    Align2::LEFT_BOTTOM,
                    &format!("|A - B|, {}, {}", names[0], names[1]),
                    font,
                );
            }
        }
        if !self.has_both() {
            tag(&painter, rect.center(), Align2::CENTER_CENTER, "the second picture is being made ...", FontId::proportional(13.0));
        }
    }
}

/// What tells one setting from another, in a few words.
pub fn in_short(params: &OctreeParams) -> String {
    let rule = match params.tolerance {
        Some(tolerance) => format!("R {}", percent(tolerance)),
        None => format!("V {}, W {:.0e}", params.max_leaf_tets, params.max_leaf_variance),
    };
    format!("{rule}, depth {}", params.max_depth)
}

/// A text that reads over any picture.
fn tag(painter: &Painter, at: egui::Pos2, align: Align2, text: &str, font: FontId) {
    let text = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let place = align.anchor_size(at, text.size());
    painter.rect_filled(place.expand(3.0), CornerRadius::same(3), Color32::from_black_alpha(170));
    painter.galley(place.min, text, Color32::WHITE);
}

/// What is black and white in a difference, in levels of 255.
fn scale(painter: &Painter, rect: Rect, gain: f32) {
    let bar = Rect::from_min_size(rect.right_bottom() - vec2(168.0, 24.0), vec2(120.0, 12.0));
    let mut mesh = egui::Mesh::default();
    for (x, color) in [(bar.left(), Color32::BLACK), (bar.right(), Color32::WHITE)] {
        mesh.colored_vertex(pos2(x, bar.top()), color);
        mesh.colored_vertex(pos2(x, bar.bottom()), color);
    }
    mesh.add_triangle(0, 1, 2);
    mesh.add_triangle(1, 2, 3);
    painter.rect_filled(bar.expand2(vec2(44.0, 6.0)), CornerRadius::same(3), Color32::from_black_alpha(170));
    painter.add(mesh);
    painter.rect_stroke(bar, CornerRadius::ZERO, Stroke::new(1.0, Color32::GRAY), egui::StrokeKind::Outside);
    let font = FontId::proportional(11.0);
    painter.text(bar.left_center() - vec2(6.0, 0.0), Align2::RIGHT_CENTER, "0", font.clone(), Color32::WHITE);
    let levels = 255.0 / gain;
    let most = if levels < 10.0 { format!("{levels:.1}/255") } else { format!("{levels:.0}/255") };
    painter.text(bar.right_center() + vec2(3.0, 0.0), Align2::LEFT_CENTER, most, FontId::proportional(10.0), Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::Preset;

    #[test]
    fn settings_are_named_by_what_decides() {
        assert_eq!(in_short(&Preset::Balanced.params()), "R 3.0 %, depth 9");
        assert_eq!(in_short(&Preset::Paper.params()), "V 12, W 5e-4, depth 9");
    }

    #[test]
    fn nothing_is_compared_with_what_was_not_kept() {
        let mut wipe = Wipe::default();
        assert_eq!(wipe.compared(), None);
        wipe.mode = WipeMode::Wipe;
        assert_eq!(wipe.compared(), Some(Compared::Wipe([Slot::Octree, Slot::Exact], 0.5)));
        wipe.against = Against::Kept;
        assert_eq!(wipe.compared(), None);
    }
}
