//! The steps of a series: which is shown, which is read ahead, and what range their colours have.

use super::jobs::{Job, Polled, discard, outcome};
use super::model::{self, Document, InTime, OctreeModel};
use super::settings::Transfer;
use super::slot::Slot;
use super::title;
use super::viewer::Viewer;
use crate::format::Series;
use crate::geometry::Placed;
use crate::mesh::FieldSelection;
use crate::octree::OctreeParams;
use crate::study::over_time::{range_over, union};
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Bytes of files that are read for the range of all steps without being asked.
const SCANNED_UNASKED: u64 = 1 << 30;

/// What the colours span where the user names no range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RangeOver {
    /// The values of all steps: the same colour is the same value in each.
    #[default]
    AllSteps,
    /// Each step's own values.
    EachStep,
}

/// Steps that are shown and on their way.
pub struct TimeStage {
    /// The step to be shown.
    pub wanted: usize,
    /// Whether one step follows the other.
    pub playing: bool,
    /// Whether the first follows the last.
    pub loops: bool,
    /// At most so many steps a second.
    pub per_second: f64,
    /// What the colours span.
    pub range: RangeOver,
    /// The pattern of the files that are not to be offered as a series again.
    pub closed_offer: Option<PathBuf>,
    /// The length that opacity refers to where no other is named: the diagonal of the first step shown, world units.
    pub diagonal: f64,
    ahead: Option<Ahead>,
    /// The neighbour that is read ahead; none before the first step in time.
    direction: Option<Direction>,
    /// A step that could not be read ahead.
    refused: Option<usize>,
    shown_at: Instant,
    /// Whether the histogram is of another step.
    is_stale: bool,
    ranges: Ranges,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Back,
    On,
}

/// What an octree is built for: step, field, thresholds.
type Key = (usize, FieldSelection, OctreeParams);

/// A step that is not shown yet.
struct Ahead {
    key: Key,
    /// Whether it was to be shown when it was begun.
    is_wanted: bool,
    state: AheadState,
}

enum AheadState {
    Running(Job<Result<Ready>>),
    Ready(Box<Ready>),
}

/// A step that can be shown.
struct Ready {
    document: Document,
    model: OctreeModel,
}

/// The ranges of a field that are known, by step.
#[derive(Default)]
struct Ranges {
    of: Option<FieldSelection>,
    known: Vec<Option<[f64; 2]>>,
    scan: Scan,
}

/// Whether the files of all steps were read for their ranges.
#[derive(Default)]
enum Scan {
    #[default]
    NotYet,
    Running(Job<Result<Scanned>>),
    /// They are large, so many bytes; it waits to be asked.
    TooLarge(u64),
    /// To be read, however large.
    Asked,
    Done,
}

/// What came of it.
enum Scanned {
    Ranges(Vec<(usize, [f64; 2])>),
    TooLarge(u64),
}

impl TimeStage {
    /// That of a document whose bounds have this diagonal.
    pub fn new(time: &InTime, diagonal: f64) -> Self {
        TimeStage {
            wanted: if let InTime::Step(_, step) = time { *step } else { 0 },
            playing: false,
            loops: true,
            per_second: 10.0,
            range: RangeOver::default(),
            closed_offer: None,
            diagonal,
            ahead: None,
            direction: None,
            refused: None,
            shown_at: Instant::now(),
            is_stale: false,
            ranges: Ranges::default(),
        }
    }

    /// That of another document; how it plays stays.
    pub fn renewed(&self, document: &Document) -> Self {
        let TimeStage { loops, per_second, range, .. } = *self;
        let closed_offer = self.closed_offer.clone();
        TimeStage { loops, per_second, range, closed_offer, ..Self::new(&document.time, document.data.bounds().diagonal()) }
    }

    /// The step after or before another, if there is one.
    fn neighbour(&self, step: usize, direction: Direction, count: usize) -> Option<usize> {
        let next = match direction {
            Direction::On if step + 1 < count => Some(step + 1),
            Direction::On => self.loops.then_some(0),
            Direction::Back if step > 0 => Some(step - 1),
            Direction::Back => self.loops.then_some(count - 1),
        };
        next.filter(|next| *next != step)
    }

    /// How far the reading of all ranges is, in [0, 1], while it runs.
    pub fn scanning(&self) -> Option<f32> {
        if let Scan::Running(job) = &self.ranges.scan { Some(job.progress().1.unwrap_or(0.0)) } else { None }
    }

    /// The bytes that would have to be read for the range of all steps, if that waits to be asked.
    pub fn unscanned(&self) -> Option<u64> {
        if let Scan::TooLarge(bytes) = self.ranges.scan { Some(bytes) } else { None }
    }

    /// Reads them.
    pub fn scan(&mut self) {
        self.ranges.scan = Scan::Asked;
    }

    /// The length that opacity refers to by default, if it is not that of the bounds shown.
    pub fn unit_diagonal(&self, shown: f64) -> Option<f64> {
        Some(self.diagonal).filter(|diagonal| *diagonal != shown)
    }
}

impl Viewer {
    /// The number of the step that is shown, from 0, and how many there are, if a series is open.
    pub fn step(&self) -> Option<(usize, usize)> {
        if let InTime::Step(series, step) = &self.document.time { Some((*step, series.steps().len())) } else { None }
    }

    /// Whether one step follows the other.
    pub fn is_playing(&self) -> bool {
        self.time.playing
    }

    /// Shows another step as soon as its octree is there.
    pub fn go_to_step(&mut self, step: usize) {
        let Some((shown, count)) = self.step() else { return };
        self.time.wanted = step.min(count - 1);
        self.time.direction = if self.time.wanted < shown { Some(Direction::Back) } else { Some(Direction::On) };
        self.time.playing = false;
    }

    /// The step before or after the one that is shown or on its way.
    pub(super) fn step_by(&mut self, direction: Direction) {
        let Some((_, count)) = self.step() else { return self.say("what is open is no series of steps in time") };
        if let Some(step) = self.time.neighbour(self.time.wanted, direction, count) {
            self.go_to_step(step);
        }
        self.time.direction = Some(direction);
    }

    /// Goes on from step to step, or stops.
    pub(super) fn flip_playing(&mut self) {
        let Some((shown, count)) = self.step() else { return self.say("what is open is no series of steps in time") };
        self.time.playing = !self.time.playing;
        if self.time.playing {
            self.time.direction = Some(Direction::On);
            if shown + 1 == count {
                self.time.wanted = 0; // from the beginning, also where it ends there
            }
        }
    }

    /// What a step that is to be shown is at.
    pub(super) fn time_progress(&self) -> Option<(&'static str, Option<f32>)> {
        let (shown, _) = self.step()?;
        let of = |ahead: &Ahead| if let AheadState::Running(job) = &ahead.state { job.progress() } else { ("", None) };
        (self.time.wanted != shown).then(|| self.time.ahead.as_ref().map_or(("", None), of))
    }

    /// Takes the step that is read and starts what is due.
    pub(super) fn run_time(&mut self, ctx: &egui::Context) {
        let InTime::Step(series, shown) = self.document.time.clone() else {
            self.octree.is_passing = false;
            return;
        };
        self.play(ctx, shown, series.steps().len());
        self.take_ahead(shown);
        self.show_ready(ctx, shown);
        let Some((shown, count)) = self.step() else { return };
        self.read_ahead(ctx, &series, shown);
        // Measuring a step that is soon another's would only hold that up.
        self.octree.is_passing = self.time.playing && count > 1 || self.time.wanted != shown;
        if self.time.is_stale && !self.octree.is_passing {
            self.time.is_stale = false;
            self.transfer_editor.recount();
        }
        self.run_ranges(ctx, &series, shown);
    }

    fn play(&mut self, ctx: &egui::Context, shown: usize, count: usize) {
        if !self.time.playing || self.time.wanted != shown {
            return;
        }
        let due = Duration::from_secs_f64(1.0 / self.time.per_second).saturating_sub(self.time.shown_at.elapsed());
        if !due.is_zero() {
            return ctx.request_repaint_after(due);
        }
        let is_seen = |slot: Slot| self.shown[slot as usize].is_some() || slot == Slot::Exact && self.exact.given;
        if self.slots().into_iter().all(is_seen) {
            match self.time.neighbour(shown, Direction::On, count) {
                Some(next) => self.time.wanted = next,
                None => self.time.playing = false,
            }
        }
    }

    fn take_ahead(&mut self, shown: usize) {
        let Some(Ahead { key: (step, ..), state: AheadState::Running(job), .. }) = &self.time.ahead else { return };
        let (step, polled) = (*step, job.poll());
        if matches!(polled, Polled::Pending) {
            return;
        }
        match outcome(polled) {
            Ok(ready) => {
                if let Some(ahead) = &mut self.time.ahead {
                    ahead.state = AheadState::Ready(Box::new(ready));
                }
            }
            Err(error) => {
                self.time.ahead = None;
                self.time.refused = Some(step);
                if step == self.time.wanted && step != shown {
                    (self.time.wanted, self.time.playing) = (shown, false);
                    self.fail(error);
                }
            }
        }
    }

    fn key(&self, step: usize) -> Key {
        (step, self.settings.field.clone(), self.settings.params.clone())
    }

    /// Shows a step that is ready, if it is wanted, or was when it was begun: a slider that moves on is followed.
    fn show_ready(&mut self, ctx: &egui::Context, shown: usize) {
        let Some(mut ahead) = self.time.ahead.take() else { return };
        ahead.is_wanted &= self.time.wanted != shown; // given up since
        let is_due = self.time.wanted != shown && (ahead.key.0 == self.time.wanted || ahead.is_wanted);
        match ahead {
            Ahead { key, state: AheadState::Ready(ready), .. } if is_due && key == self.key(key.0) => {
                let Ready { document, model } = *ready;
                self.show_step(ctx, document, model, key);
            }
            ahead => self.time.ahead = Some(ahead),
        }
    }

    /// Puts a step of the same series in the place of the one that is shown. All that is chosen stays.
    fn show_step(&mut self, ctx: &egui::Context, document: Document, model: OctreeModel, (_, field, params): Key) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(title(&document.name)));
        discard(std::mem::replace(&mut self.document, document));
        self.octree.adopt(Arc::new(model), (field, params));
        discard(std::mem::take(&mut self.exact));
        self.probe.read_anew();
        self.tuning = self.tuning.of_other_data();
        (self.time.shown_at, self.time.refused, self.time.is_stale) = (Instant::now(), None, true);
        self.settle_renderer();
        [Slot::Octree, Slot::Exact].into_iter().for_each(|slot| self.show_anew(slot));
    }

    /// Has the step read that is wanted; once it is shown, its neighbour.
    fn read_ahead(&mut self, ctx: &egui::Context, series: &Arc<Series>, shown: usize) {
        let is_wanted = self.time.wanted != shown;
        let step = if is_wanted {
            self.time.wanted
        } else {
            let is_at_rest = !self.octree.held && self.octree.is_of(&self.settings.field, &self.settings.params);
            let next = self.time.direction.and_then(|direction| self.time.neighbour(shown, direction, series.steps().len()));
            let Some(next) = next.filter(|next| is_at_rest && self.time.refused != Some(*next)) else { return };
            next
        };
        let key = self.key(step);
        if let Some(ahead) = &mut self.time.ahead {
            if ahead.key == key {
                ahead.is_wanted |= is_wanted;
                return;
            }
            let goes_on = ahead.is_wanted
                && matches!(ahead.state, AheadState::Running(_))
                && ahead.key == (ahead.key.0, key.1.clone(), key.2.clone());
            if is_wanted && goes_on {
                return;
            }
        }
        // What was read for other thresholds needs not be read again.
        let read = match self.time.ahead.take() {
            Some(Ahead { key: (of, ..), state: AheadState::Ready(ready), .. }) if of == step => Some(ready.document),
            _ => None,
        };
        // Beside the one that is shown there may be less room.
        let taken = if is_wanted { 0 } else { self.document.data.bytes() };
        let memory_bytes = self.memory_bytes().saturating_sub(taken);
        let (renderer, series, source) = (self.renderer.clone(), series.clone(), self.document.source.clone());
        let (_, field, params) = key.clone();
        let job = Job::start(ctx, move |progress, results| {
            let work = || {
                let document = match read {
                    Some(document) => document,
                    None => model::open_step((series, step), &source, &field, memory_bytes, progress)?,
                };
                let model = model::build_octree(&renderer, &document.data, &field, &params, None, progress)?;
                Ok(Ready { document, model })
            };
            results.give(work());
        });
        self.time.ahead = Some(Ahead { key, is_wanted, state: AheadState::Running(job) });
    }

    /// Finds the range of all steps and has the colours span it.
    fn run_ranges(&mut self, ctx: &egui::Context, series: &Arc<Series>, shown: usize) {
        let field = &self.settings.field;
        if self.time.ranges.of.as_ref() != Some(field) {
            let (of, known) = (Some(field.clone()), vec![None; series.steps().len()]);
            self.time.ranges = Ranges { of, known, scan: Scan::NotYet };
        }
        let of_field = self.octree.model.as_ref().filter(|model| model.field == *field);
        if let (Some(model), Some(known)) = (of_field, self.time.ranges.known.get_mut(shown)) {
            *known = Some(model.value_range);
        }
        self.take_scan();
        let range = self.settings.transfer.base.range;
        let is_ours = range.is_none() || range == self.settings.transfer.chosen_range;
        if is_ours && self.time.range == RangeOver::AllSteps && of_field_is_known(&self.time.ranges, shown) {
            self.start_scan(ctx, series);
        }
        let before = self.settings.clone();
        self.time.ranges.choose(self.time.range, &mut self.settings.transfer);
        if before != self.settings {
            self.histories.amend(&before, &self.settings);
        }
    }

    fn start_scan(&mut self, ctx: &egui::Context, series: &Arc<Series>) {
        let limit = match self.time.ranges.scan {
            Scan::NotYet => SCANNED_UNASKED,
            Scan::Asked => u64::MAX,
            Scan::Running(_) | Scan::TooLarge(_) | Scan::Done => return,
        };
        let missing: Vec<usize> = (0..series.steps().len()).filter(|step| self.time.ranges.known[*step].is_none()).collect();
        if missing.is_empty() {
            self.time.ranges.scan = Scan::Done;
            return;
        }
        let (field, series) = (self.settings.field.clone(), series.clone());
        let options = self.document.source.options(field.name.clone(), field.component, self.memory_bytes());
        self.time.ranges.scan = Scan::Running(Job::start(ctx, move |progress, results| {
            let files: Vec<&Path> = missing.iter().map(|step| series.steps()[*step].path.as_path()).collect();
            let bytes = files.iter().filter_map(|path| Some(path.metadata().ok()?.len())).sum();
            if bytes > limit {
                return results.give(Ok(Scanned::TooLarge(bytes)));
            }
            let mut ranges = Vec::with_capacity(files.len());
            let read = range_over(&files, &options, &field, progress, |i, range| ranges.push((missing[i], range)));
            results.give(read.map(|_| Scanned::Ranges(ranges)).map_err(Into::into));
        }));
    }

    fn take_scan(&mut self) {
        let Scan::Running(job) = &self.time.ranges.scan else { return };
        let polled = job.poll();
        if matches!(polled, Polled::Pending) {
            return;
        }
        match outcome(polled) {
            Ok(Scanned::TooLarge(bytes)) => self.time.ranges.scan = Scan::TooLarge(bytes),
            Ok(Scanned::Ranges(found)) => {
                for (step, range) in found {
                    self.time.ranges.known[step] = Some(range);
                }
                self.time.ranges.scan = Scan::Done;
            }
            Err(error) => {
                self.time.ranges.scan = Scan::Done; // the same would only fail again
                self.fail(error.context("the range of all steps is not known"));
            }
        }
    }
}

/// Whether the range of the step shown is known: before, the field may be one that there is not.
fn of_field_is_known(ranges: &Ranges, shown: usize) -> bool {
    ranges.known.get(shown).is_some_and(Option::is_some)
}

impl Ranges {
    /// Chooses the range of a transfer function, unless the user has.
    fn choose(&self, over: RangeOver, transfer: &mut Transfer) {
        let tf = &mut transfer.base;
        if tf.range.is_some() && tf.range != transfer.chosen_range {
            return; // the user's own
        }
        let all = self.known.iter().flatten().copied().reduce(union).filter(|[lo, hi]| lo < hi && tf.scale.fits([*lo, *hi]));
        tf.range = if over == RangeOver::AllSteps { all } else { None };
        transfer.chosen_range = tf.range;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Scale, TransferFunction};

    #[test]
    fn steps_go_round_if_they_loop() {
        let mut stage = TimeStage::new(&InTime::Single, 1.0);
        let neighbours = |stage: &TimeStage| [Direction::Back, Direction::On].map(|to| [0, 1, 2].map(|step| stage.neighbour(step, to, 3)));
        assert_eq!(neighbours(&stage), [[Some(2), Some(0), Some(1)], [Some(1), Some(2), Some(0)]]);
        assert_eq!(stage.neighbour(0, Direction::On, 1), None, "a single step is not its own neighbour");
        stage.loops = false;
        assert_eq!(neighbours(&stage), [[None, Some(0), Some(1)], [Some(1), Some(2), None]]);
    }

    #[test]
    fn the_range_of_all_steps_grows_and_the_users_own_stays() {
        let mut transfer = Transfer::new(TransferFunction::standard());
        let mut ranges = Ranges { known: vec![Some([0.0, 2.0]), None, None], ..Ranges::default() };
        ranges.choose(RangeOver::AllSteps, &mut transfer);
        assert_eq!(transfer.base.range, Some([0.0, 2.0]));
        ranges.known[2] = Some([-1.0, 1.0]);
        ranges.choose(RangeOver::AllSteps, &mut transfer);
        assert_eq!(transfer.base.range, Some([-1.0, 2.0]));
        ranges.choose(RangeOver::EachStep, &mut transfer);
        assert_eq!(transfer.base.range, None, "a step's own");
        transfer.base.range = Some([0.5, 1.0]);
        for over in [RangeOver::AllSteps, RangeOver::EachStep] {
            ranges.choose(over, &mut transfer);
            assert_eq!(transfer.base.range, Some([0.5, 1.0]));
        }
        // An earlier choice that is undone is no choice of the user's.
        (transfer.base.range, transfer.chosen_range) = (Some([0.0, 2.0]), Some([0.0, 2.0]));
        ranges.choose(RangeOver::AllSteps, &mut transfer);
        assert_eq!(transfer.base.range, Some([-1.0, 2.0]));
        // Zero has no logarithm.
        transfer.base = TransferFunction { range: None, scale: Scale::Log, ..transfer.base };
        ranges.choose(RangeOver::AllSteps, &mut transfer);
        assert_eq!(transfer.base.range, None);
    }
}
