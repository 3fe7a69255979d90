//! Two files in one window: what was open is kept as A, another is B, and both are seen with one camera, one transfer function and one range.

use super::actions::Histories;
use super::model::{Document, OctreeModel};
use super::octree_stage::Measured;
use super::settings::{Settings, Transfer};
use super::slot::Slot;
use super::title;
use super::viewer::Viewer;
use super::widgets::percent;
use super::wipe::{Against, Wipe, WipeMode, in_short};
use crate::geometry::Placed;
use crate::session::Source;
use crate::view::Mode;
use anyhow::anyhow;
use egui::{Rect, Ui, vec2};
use std::path::Path;
use std::sync::Arc;

/// Points between two pictures that stand beside each other.
const GAP: f32 = 2.0;

/// The octree that is kept as A.
#[derive(Clone)]
pub struct Kept {
    /// What is drawn.
    pub model: Arc<OctreeModel>,
    /// What it is of.
    pub document: Document,
}

impl Viewer {
    /// What is shown, if its octree is there.
    pub(super) fn to_keep(&self) -> Option<Kept> {
        Some(Kept { model: self.octree.model.clone()?, document: self.document.clone() })
    }

    /// Whether a second file waits for the octree that is to be A.
    pub(super) fn is_first_awaited(&self) -> bool {
        self.wipe.awaits && !self.octree.is_of(&self.settings.field, &self.settings.params)
    }

    /// Bytes of what is A, or will be.
    pub(super) fn first_bytes(&self) -> u64 {
        self.wipe.kept.as_ref().map_or(&self.document, |kept| &kept.document).data.bytes()
    }

    /// Shows a file that was read to compare with as B, and what is open as A, unless an A was kept before.
    pub(super) fn take_second(&mut self, ctx: &egui::Context, document: Document) {
        let Some(kept) = self.wipe.kept.clone().or_else(|| self.to_keep()) else {
            return self.fail(anyhow!("what is open has no octree to compare with"));
        };
        let (source, name, field) = (document.source.clone(), document.name.clone(), document.field.clone());
        let without = (field.name != kept.model.field.name).then(|| kept.model.field.name.clone()).flatten();
        let settings = Settings { field, transfer: self.transfer_of(&kept), ..self.settings.clone() };
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(title(&format!("{} | {name}", kept.document.name))));
        self.say(match without {
            Some(array) => format!("{name} has no array {array}, shown is its own; colours span A's range"),
            None => format!("A: {}, B: {name}", kept.document.name),
        });
        self.exchange(document, settings, kept);
        self.recent.note(&source);
    }

    /// Makes B of A and A of B.
    pub(super) fn swap(&mut self, ctx: &egui::Context) {
        let (Some(kept), Some(present)) = (self.wipe.kept.clone(), self.to_keep()) else { return };
        let (field, params) = (kept.model.field.clone(), kept.model.params.clone());
        let settings = Settings { field: field.clone(), params: params.clone(), ..self.settings.clone() };
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(title(&format!("{} | {}", present.document.name, kept.document.name))));
        self.exchange(kept.document, settings, present);
        self.octree.adopt(kept.model, (field, params));
    }

    /// Puts another document in the place of the one that is open, and has it compared with `kept`. Camera, marks and planes stay.
    fn exchange(&mut self, document: Document, settings: Settings, kept: Kept) {
        let (opening, selected) = (self.opening, self.plane_tool.selected);
        let (probe, wipe) = (std::mem::take(&mut self.probe), std::mem::take(&mut self.wipe));
        self.show_document(document);
        (self.settings, self.opening, self.plane_tool.selected) = (settings, opening, selected);
        self.probe = probe.of_new_data();
        let mode = if wipe.mode == WipeMode::Off { WipeMode::Wipe } else { wipe.mode };
        self.wipe = Wipe { mode, against: Against::Kept, kept: Some(kept), ..wipe };
        // The picture before is not this one's.
        [Slot::Octree, Slot::Exact].into_iter().for_each(|slot| self.viewport.empty(slot));
        self.settle_renderer();
        self.histories = Histories::new(&self.settings);
    }

    /// The transfer function with all that follows from A in numbers, so that it shows the same of other data.
    fn transfer_of(&self, kept: &Kept) -> Transfer {
        let mut transfer = Transfer { chosen_range: None, ..self.settings.transfer.clone() };
        let diagonal = kept.document.data.bounds().diagonal();
        let range = match self.settings.render.mode {
            Mode::Integral => Mode::integral_range(kept.model.value_range, diagonal),
            _ => kept.model.value_range,
        };
        let unit_distance = transfer.base.unit_distance_world(self.time.unit_diagonal(diagonal).unwrap_or(diagonal));
        let tf = &mut transfer.base;
        tf.range = tf.range.or(Some(range).filter(|range| tf.scale.fits(*range)));
        tf.unit_distance = tf.unit_distance.or(Some(unit_distance).filter(|distance| *distance > 0.0));
        transfer
    }

    /// Where the pictures are that are compared beside each other, A and B; `None` if they are not.
    pub(super) fn places(&self, rect: Rect) -> Option<[Rect; 2]> {
        let is_beside = self.wipe.mode == WipeMode::Beside && self.wipe.slots().is_some();
        is_beside.then(|| halves(rect, self.pixels_per_point as f32))
    }

    /// The picture of A beside that of B: the mouse moves the one camera.
    pub(super) fn picture_beside(&mut self, ui: &Ui, rect: Rect) {
        let picture = ui.interact(rect, ui.scope_id().with("picture beside"), egui::Sense::click_and_drag());
        picture.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "picture of A"));
        self.settings.camera = super::navigate::moved(self.settings.camera, &picture, ui, self.extent());
    }

    /// What a side shows: the file where there are two, the field where it is another, and the thresholds.
    pub(super) fn side_name(&self, letter: &str, slot: Slot) -> String {
        let kept = self.wipe.kept.as_ref();
        let files = kept.filter(|_| self.wipe.against == Against::Kept);
        let files = files.and_then(|kept| told_apart([&kept.document.source, &self.document.source]));
        let [first, second] = files.unwrap_or_default().map(|name| if name.is_empty() { name } else { name + ", " });
        let of = |model: &OctreeModel| in_short(&model.params);
        match slot {
            Slot::Exact => format!("{letter}: exact"),
            Slot::Kept => {
                let other = |kept: &&Kept| kept.model.field != self.settings.field;
                let field = kept.filter(other).and_then(|kept| kept.model.field.name.clone());
                let field = field.map_or(String::new(), |name| format!("{name}, "));
                format!("{letter}: {first}{field}{}", kept.map_or(String::new(), |kept| of(&kept.model)))
            }
            Slot::Octree => {
                let error = match &self.octree.accuracy {
                    Measured::Done(accuracy) => format!(", RMSE {}", percent(accuracy.error.by_volume.rmse_rel)),
                    _ => String::new(),
                };
                format!("{letter}: {second}{}{error}", self.octree.model.as_deref().map_or(String::new(), of))
            }
        }
    }
}

/// Two places beside each other, of equal sizes in whole pixels.
fn halves(rect: Rect, pixels_per_point: f32) -> [Rect; 2] {
    let width = ((rect.width() - GAP) / 2.0 * pixels_per_point).floor().max(1.0) / pixels_per_point;
    let right = Rect::from_min_size(rect.right_top() - vec2(width, 0.0), vec2(width, rect.height()));
    [Rect::from_min_size(rect.min, right.size()), right]
}

/// The names of two files, with as many of their folders as tell them apart; `None` if they are the same.
fn told_apart(sources: [&Source; 2]) -> Option<[String; 2]> {
    if sources[0] == sources[1] {
        return None;
    }
    let last = |path: &Path, parts: usize| -> String {
        let all: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
        all[all.len().saturating_sub(parts)..].join("/")
    };
    let names = |parts: usize| sources.map(|source| source.file.as_deref().map_or("the bundled mesh".into(), |path| last(path, parts)));
    let most = sources.into_iter().filter_map(|source| Some(source.file.as_ref()?.iter().count())).max().unwrap_or(1);
    let differ = |names: &[String; 2]| names[0] != names[1];
    (1..=most).map(names).find(differ).or_else(|| Some(steps(sources, names(1))))
}

/// The names of two steps of one series, or of one file read in two ways.
fn steps(sources: [&Source; 2], names: [String; 2]) -> [String; 2] {
    let step = |source: &Source| source.step.map_or(String::new(), |step| format!(", step {step}"));
    let [a, b] = names;
    [a + &step(sources[0]), b + &step(sources[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn files_are_told_apart_in_as_few_words_as_it_takes() {
        let names = |a: &str, b: &str| told_apart([&Source::file(a), &Source::file(b)]);
        assert_eq!(names("/data/a.vtu", "/data/a.vtu"), None);
        assert_eq!(names("/data/a.vtu", "/data/a.msh"), Some(["a.vtu".into(), "a.msh".into()]));
        assert_eq!(names("/one/in/a.vtu", "/two/in/a.vtu"), Some(["one/in/a.vtu".into(), "two/in/a.vtu".into()]));
        assert_eq!(names("a.vtu", "two/a.vtu"), Some(["a.vtu".into(), "two/a.vtu".into()]));
        assert_eq!(told_apart([&Source::default(), &Source::file("a.vtu")]), Some(["the bundled mesh".into(), "a.vtu".into()]));
        let step = |step| Source { step: Some(step), ..Source::file("flow.pvd") };
        assert_eq!(told_apart([&step(3), &step(4)]), Some(["flow.pvd, step 3".into(), "flow.pvd, step 4".into()]));
    }

    #[test]
    fn halves_are_equal_and_lie_at_the_sides() {
        for (width, pixels_per_point) in [(980.0, 1.0), (341.0, 1.0), (341.0, 1.5), (977.0, 2.0)] {
            let rect = Rect::from_min_size(pos2(300.0, 0.0), vec2(width, 400.0));
            let [a, b] = halves(rect, pixels_per_point);
            assert!(a.left() == rect.left() && b.right() == rect.right() && a.height() == 400.0 && b.height() == 400.0);
            let pixels = a.width() * pixels_per_point;
            assert!((pixels - pixels.round()).abs() < 1e-3 && (a.width() - b.width()).abs() < 1e-3);
            let gap = (b.left() - a.right()) * pixels_per_point;
            assert!((GAP * pixels_per_point - 1e-3..GAP * pixels_per_point + 2.0).contains(&gap), "{width} {pixels_per_point}: {gap}");
        }
    }
}
