//! Opening: meshes, volumes and sessions; what was open before stays until another is read whole.

use super::furniture::{Backdrop, Look};
use super::jobs::{Job, Polled, outcome};
use super::model::{self, Data, Document};
use super::settings::{Settings, Transfer};
use super::title;
use super::viewer::Viewer;
use crate::format::FORMATS;
use crate::format::series::SUFFIXES;
use crate::furniture::Part;
use crate::mesh::FieldSelection;
use crate::progress::Progress;
use crate::session::{Session, Source};
use crate::view::RenderSettings;
use anyhow::{Context, Error, Result};
use std::path::PathBuf;

/// What was read, and what becomes of the settings.
pub struct Opened {
    document: Document,
    fate: Fate,
}

/// What becomes of the settings when a file is open.
enum Fate {
    /// The view of the data's own; colours and thresholds stay.
    Fresh,
    /// Everything stays: marks, what is compared and what can be undone too.
    Reload,
    /// Everything stays, and what is open is a step of a series now.
    Series,
    /// All as the session has it, and where that was read.
    Session(Box<Session>, PathBuf),
    /// What was open is kept as A, and this is B.
    Beside,
}

/// What is read in the background.
pub type Loading = Job<Result<Opened>>;

/// A dialog of the system's that is open, and what it is for.
pub struct Dialog {
    purpose: Purpose,
    answer: Job<Result<Option<PathBuf>>>,
}

/// What becomes of the file that is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Purpose {
    Open,
    Compare,
    SaveSession,
}

/// A session that is being written, and where.
pub type SessionJob = Job<Result<PathBuf>>;

impl Viewer {
    /// Opens another mesh or volume, or a session (`.json`), in the background.
    pub fn open(&mut self, ctx: &egui::Context, path: PathBuf) {
        self.open_source(ctx, Source::file(path));
    }

    /// The same, for files that do not say themselves what they are.
    pub(super) fn open_source(&mut self, ctx: &egui::Context, source: Source) {
        let memory_bytes = self.memory_bytes();
        self.say(format!("opening {}", name(&source)));
        self.load(ctx, move |progress| open(source, memory_bytes, progress));
    }

    /// Reads the open file again; camera, colours and thresholds stay.
    pub fn reload(&mut self, ctx: &egui::Context) {
        let (source, field, memory_bytes) = (self.document.source.clone(), self.settings.field.clone(), self.memory_bytes());
        self.say(format!("reading {} again", name(&source)));
        self.load(ctx, move |progress| Ok(Opened { document: model::open(source, &field, memory_bytes, progress)?, fate: Fate::Reload }));
    }

    /// Opens the series that the open file is a step of, by its pattern; all that is chosen stays.
    pub(super) fn open_series(&mut self, ctx: &egui::Context, pattern: PathBuf) {
        let (source, field, memory_bytes) = (self.document.source.clone(), self.settings.field.clone(), self.memory_bytes());
        self.load(ctx, move |progress| {
            let series = Source { file: Some(pattern), ..source.clone() };
            let steps = series.series()?;
            let step = steps.and_then(|steps| steps.steps().iter().position(|step| Some(&step.path) == source.file.as_ref()));
            let document = model::open(Source { step, ..series }, &field, memory_bytes, progress)?;
            Ok(Opened { document, fate: Fate::Series })
        });
    }

    /// Asks for a file, then opens it.
    pub(super) fn choose_file(&mut self, ctx: &egui::Context) {
        let all: Vec<&str> = FORMATS.iter().flat_map(|format| format.suffixes).copied().chain(SUFFIXES).chain(["json"]).collect();
        self.choose(ctx, with_formats(rfd::AsyncFileDialog::new().add_filter("Meshes, volumes, sessions", &all)));
    }

    /// Asks for a file, then compares with it.
    pub(super) fn choose_second(&mut self, ctx: &egui::Context) {
        if self.may_ask() {
            let all: Vec<&str> = FORMATS.iter().flat_map(|format| format.suffixes).copied().chain(SUFFIXES).collect();
            let dialog = with_formats(rfd::AsyncFileDialog::new().set_title("Compare with").add_filter("Meshes, volumes", &all));
            self.ask(ctx, Purpose::Compare, chosen(dialog.pick_file()));
        }
    }

    /// Reads a second file in the background: what is shown is kept as A, if nothing is, and the file becomes B.
    pub fn compare_with(&mut self, ctx: &egui::Context, path: PathBuf) {
        let (source, field) = (Source::file(path), self.settings.field.clone());
        self.say(format!("opening {} to compare with", name(&source)));
        // Both are in memory then.
        let memory_bytes = self.memory_bytes().saturating_sub(self.first_bytes());
        self.load(ctx, move |progress| {
            Ok(Opened { document: model::open_beside(source, &field, memory_bytes, progress)?, fate: Fate::Beside })
        });
        self.wipe.awaits = self.wipe.kept.is_none();
    }

    /// Asks for a session, then opens it.
    pub(super) fn choose_session(&mut self, ctx: &egui::Context) {
        self.choose(ctx, rfd::AsyncFileDialog::new().add_filter("Sessions", &["json"]));
    }

    fn choose(&mut self, ctx: &egui::Context, dialog: rfd::AsyncFileDialog) {
        if self.may_ask() {
            self.open_chosen(ctx, chosen(dialog.pick_file()));
        }
    }

    /// Opens the file that is chosen once it is; `None`: nothing, and what is being read goes on.
    pub fn open_chosen(&mut self, ctx: &egui::Context, choice: impl Future<Output = Option<PathBuf>> + Send + 'static) {
        self.ask(ctx, Purpose::Open, choice);
    }

    /// Whether no dialog is open yet. Beside one that is, another would only hide it.
    fn may_ask(&mut self) -> bool {
        if self.dialog.is_some() {
            self.say("a file dialog is open already");
        }
        self.dialog.is_none()
    }

    /// Waits for a dialog's answer; what is being read meanwhile goes on.
    fn ask(&mut self, ctx: &egui::Context, purpose: Purpose, choice: impl Future<Output = Option<PathBuf>> + Send + 'static) {
        let answer = Job::start(ctx, move |_, results| results.give(Ok(pollster::block_on(choice))));
        self.dialog = Some(Dialog { purpose, answer });
    }

    /// Takes what a dialog has answered.
    fn run_dialog(&mut self, ctx: &egui::Context) {
        let (purpose, ended) = match self.dialog.as_ref().map(|dialog| (dialog.purpose, dialog.answer.poll())) {
            None | Some((_, Polled::Pending)) => return,
            Some(ended) => ended,
        };
        self.dialog = None;
        match (outcome(ended), purpose) {
            (Ok(Some(path)), Purpose::Open) => self.open(ctx, path),
            (Ok(Some(path)), Purpose::Compare) => self.compare_with(ctx, path),
            (Ok(Some(path)), Purpose::SaveSession) => self.save_session(ctx, path),
            (Ok(None), _) => {}
            (Err(error), _) => self.fail(error),
        }
    }

    fn load(&mut self, ctx: &egui::Context, work: impl FnOnce(&Progress) -> Result<Opened> + Send + 'static) {
        (self.problem, self.wipe.awaits) = (None, false);
        self.loading = Some(Job::start(ctx, move |progress, results| results.give(work(progress))));
    }

    /// Takes what was chosen, read and written.
    pub(super) fn run_files(&mut self, ctx: &egui::Context) {
        self.run_dialog(ctx);
        self.run_loading(ctx);
        self.run_session_job();
        self.recent.run(ctx);
    }

    fn run_loading(&mut self, ctx: &egui::Context) {
        if self.is_first_awaited() {
            return; // the octree that is to be A is on its way
        }
        let ended = match self.loading.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => return,
            Some(ended) => ended,
        };
        (self.loading, self.wipe.awaits) = (None, false);
        match outcome(ended) {
            Ok(Opened { document, fate: Fate::Beside }) => self.take_second(ctx, document),
            Ok(Opened { document, fate }) => self.take(ctx, document, fate),
            Err(error) => self.fail_to_open(error),
        }
    }

    fn take(&mut self, ctx: &egui::Context, document: Document, fate: Fate) {
        let kept = Settings { field: document.field.clone(), ..self.settings.clone() };
        let (opening, name) = (self.opening, document.name.clone());
        let mut recent = Some(document.source.clone());
        let (is_reload, arrays_before) = (matches!(fate, Fate::Reload), arrays(&self.document.data));
        let wipe = matches!(fate, Fate::Reload | Fate::Series).then(|| std::mem::take(&mut self.wipe));
        let marks = is_reload.then(|| (std::mem::take(&mut self.probe), self.plane_tool.selected));
        let diagonal = self.time.diagonal;
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(title(&document.name)));
        self.show_document(document);
        if let Some((probe, selected)) = marks {
            (self.probe, self.plane_tool.selected) = (probe.of_new_data(), selected);
        }
        self.wipe = wipe.unwrap_or_default();
        match fate {
            Fate::Fresh | Fate::Beside => self.say(format!("opened {name}")),
            Fate::Reload => {
                (self.settings, self.opening) = (kept, opening);
                if self.step().is_some() {
                    self.time.diagonal = diagonal; // as opaque as before
                }
                self.say(format!("read {name} again"));
                recent = None;
            }
            Fate::Series => {
                (self.settings, self.opening) = (kept, opening);
                self.say(format!("opened a series of {} steps", self.step().map_or(1, |(_, count)| count)));
            }
            Fate::Session(session, path) => {
                self.take_session(&session);
                self.say(format!("opened {}", path.display()));
                recent = Some(Source::file(path));
            }
        }
        self.settle_renderer();
        // What was chosen before can be chosen again where the same arrays are.
        if !is_reload || arrays(&self.document.data) != arrays_before {
            self.histories = super::actions::Histories::new(&self.settings);
        }
        if let Some(source) = recent {
            self.recent.note(&source);
        }
    }

    /// Chooses all that a session has beside the data.
    pub(super) fn take_session(&mut self, session: &Session) {
        if let Some(camera) = session.camera {
            (self.settings.camera, self.opening) = (camera, camera);
        }
        self.settings.params = session.thresholds.clone();
        self.settings.transfer = Transfer::new(session.transfer_function.clone());
        let interactive = self.settings.render.min_transmittance;
        self.settings.render = RenderSettings { min_transmittance: interactive, ..session.render };
        self.take_look(session);
    }

    /// The same for what is around the picture.
    pub(super) fn take_look(&mut self, session: &Session) {
        let look = &mut self.settings.look;
        let custom = session.background.map(|v| (v * 255.0).round() as u8);
        let plain = [Backdrop::Black, Backdrop::Grey, Backdrop::White];
        let same = |backdrop: &Backdrop| Look { backdrop: *backdrop, ..*look }.background() == custom;
        let backdrop = plain.into_iter().find(same).unwrap_or(Backdrop::Custom);
        *look = Look {
            backdrop,
            custom: if backdrop == Backdrop::Custom { custom } else { look.custom },
            parts: session.furniture.with(Part::Time, look.parts.has(Part::Time)),
            saves_furniture: session.furniture_in_pictures,
        };
        self.pictures.take([session.render.width, session.render.height], session.transparent);
    }

    /// All that is chosen. `octetra render --session` draws of it what the button Screenshot writes.
    pub fn session(&self) -> Session {
        let view = self.picture_view();
        Session {
            data: self.document.source.clone(),
            array: self.settings.field.name.clone(),
            component: self.settings.field.component,
            thresholds: self.settings.params.clone(),
            camera: Some(view.camera),
            transfer_function: view.transfer_function,
            render: view.settings,
            background: self.settings.look.background_rgb(),
            transparent: self.pictures.transparent,
            furniture: self.settings.look.parts.with(Part::Time, false),
            furniture_in_pictures: self.settings.look.saves_furniture,
            furniture_scale: Some(self.furniture_scale()),
            ..Session::default()
        }
    }

    /// Writes the session to a file in the background.
    pub fn save_session(&mut self, ctx: &egui::Context, path: PathBuf) {
        let session = self.session();
        self.session_job = Some(Job::start(ctx, move |progress, results| {
            progress.begin("writing the session", 0);
            results.give(session.write(&path).map(|()| path).map_err(Into::into));
        }));
    }

    /// Asks where to write the session, then does.
    pub(super) fn ask_session_file(&mut self, ctx: &egui::Context) {
        if self.may_ask() {
            let name = format!("{}-session.json", self.document.name);
            let dialog = rfd::AsyncFileDialog::new().add_filter("Sessions", &["json"]).set_file_name(name);
            self.ask(ctx, Purpose::SaveSession, chosen(dialog.save_file()));
        }
    }

    /// Takes note of a session that is written.
    fn run_session_job(&mut self) {
        let ended = match self.session_job.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => return,
            Some(ended) => ended,
        };
        self.session_job = None;
        match outcome(ended) {
            Ok(path) => {
                self.say(format!("wrote {}", path.display()));
                self.recent.note(&Source::file(path));
            }
            Err(error) => self.fail(error),
        }
    }

    /// Opens a file that was dropped on the window, or several as a series.
    pub(super) fn take_dropped(&mut self, ctx: &egui::Context) {
        let dropped: Vec<PathBuf> = ctx.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect());
        if let Some((path, more)) = dropped.split_first() {
            self.open_source(ctx, Source { more: more.to_vec(), ..Source::file(path) });
        }
    }

    fn fail_to_open(&mut self, error: Error) {
        self.problem = Some(super::problem::Problem::of(&error));
        self.fail(error);
    }
}

/// A dialog that offers each format by itself too.
fn with_formats(dialog: rfd::AsyncFileDialog) -> rfd::AsyncFileDialog {
    FORMATS.iter().fold(dialog, |dialog, format| dialog.add_filter(format.name, format.suffixes))
}

/// The path that a dialog answers with.
async fn chosen(answer: impl Future<Output = Option<rfd::FileHandle>> + Send) -> Option<PathBuf> {
    answer.await.map(|file| file.path().to_owned())
}

/// Reads a mesh, a volume, or a session and what it names.
fn open(source: Source, memory_bytes: u64, progress: &Progress) -> Result<Opened> {
    let path = source.file.clone().filter(|path| source.raw.is_none() && path.extension().is_some_and(|suffix| suffix == "json"));
    let Some(path) = path else {
        let document = model::open(source, &FieldSelection::default(), memory_bytes, progress)?;
        return Ok(Opened { document, fate: Fate::Fresh });
    };
    let session = Session::read(&path)?;
    let field = FieldSelection { name: session.array.clone(), component: session.component };
    let document = model::open(session.data.clone(), &field, memory_bytes, progress).with_context(|| path.display().to_string())?;
    let range = document.data.range(&document.field)?;
    session.transfer_function.check_range(range).with_context(|| format!("{}: transfer_function", path.display()))?;
    Ok(Opened { document, fate: Fate::Session(Box::new(session), path) })
}

/// The names of the data's arrays, and of how many numbers they are.
fn arrays(data: &Data) -> Vec<(String, usize)> {
    match data {
        Data::Mesh(mesh) => mesh.point_data().iter().chain(mesh.cell_data()).map(|a| (a.name.clone(), a.components)).collect(),
        Data::Volume(grid) => vec![(grid.name().to_owned(), 1)],
    }
}

fn name(source: &Source) -> String {
    source.file.as_ref().map_or("the bundled mesh".into(), |path| path.display().to_string())
}
