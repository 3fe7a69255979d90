//! Files that were open lately, kept in the platform's folder for settings.

use super::jobs::{Job, Polled};
use super::viewer::Viewer;
use crate::image::write_atomically;
use crate::session::Source;
use egui::Ui;
use std::path::{Path, PathBuf};

/// So many are kept.
const MOST: usize = 10;

/// Files, the last one first. Disks and networks may be slow: whatever touches them is done in the background.
#[derive(Default)]
pub struct Recent {
    sources: Vec<Source>,
    /// Where they are kept; `None`: nowhere.
    file: Option<PathBuf>,
    /// What is put first next, and what puts others first.
    to_note: Vec<Source>,
    noting: Option<(Vec<Source>, Job<Vec<Source>>)>,
    /// Whether the menu is open, what looks for files that are missing since, and those.
    is_open: bool,
    looking: Option<Job<Vec<PathBuf>>>,
    missing: Vec<PathBuf>,
}

/// Where the list is kept on this platform, if it has such a place.
pub fn recent_file() -> Option<PathBuf> {
    use etcetera::BaseStrategy;
    let base = etcetera::choose_base_strategy().ok()?;
    Some(base.config_dir().join("octetra").join("recent.json"))
}

/// What a file keeps; a file that is missing or damaged keeps nothing.
fn kept(file: &Path) -> Vec<Source> {
    let read = |path: &Path| serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok();
    let mut sources: Vec<Source> = read(file).unwrap_or_default();
    sources.truncate(MOST);
    sources
}

/// Puts a file first.
fn put_first(sources: &mut Vec<Source>, source: &Source) {
    sources.retain(|other| other.file != source.file);
    sources.insert(0, source.clone());
    sources.truncate(MOST);
}

/// Puts files first in what a file keeps, the last one of them first of all; gives what it keeps then. That it could not be written is no
/// reason to stop.
fn note_in(file: &Path, noted: &[Source], mut sources: Vec<Source>) -> Vec<Source> {
    // Another window may have added some.
    if file.exists() {
        sources = kept(file);
    }
    noted.iter().for_each(|source| put_first(&mut sources, source));
    let text = serde_json::to_string_pretty(&sources).unwrap_or_default();
    let _ = file.parent().map(std::fs::create_dir_all);
    let _ = write_atomically(file, |out| out.write_all(text.as_bytes()));
    sources
}

impl Recent {
    /// What a file keeps.
    pub fn of(file: Option<PathBuf>) -> Self {
        let mut recent = Self::default();
        (recent.sources, recent.file) = (file.as_deref().map(kept).unwrap_or_default(), file);
        recent
    }

    /// Puts a file first.
    pub fn note(&mut self, source: &Source) {
        let full = |path: PathBuf| std::path::absolute(&path).unwrap_or(path);
        let source = source.clone().map(full);
        if source.file.is_some() {
            put_first(&mut self.sources, &source);
            self.to_note.push(source);
        }
    }

    /// Has written down what is new.
    pub fn run(&mut self, ctx: &egui::Context) {
        match self.noting.as_ref().map(|(_, job)| job.poll()) {
            Some(Polled::Pending) => return,
            Some(ended) => {
                self.noting = None;
                if let Polled::Result(mut sources) = ended {
                    self.to_note.iter().for_each(|source| put_first(&mut sources, source));
                    self.sources = sources;
                }
            }
            None => {}
        }
        if let (Some(file), false) = (self.file.clone(), self.to_note.is_empty()) {
            let (noted, sources) = (std::mem::take(&mut self.to_note), self.sources.clone());
            let of = noted.clone();
            self.noting = Some((noted, Job::start(ctx, move |_, results| results.give(note_in(&file, &of, sources)))));
        }
    }

    /// Whether something is being written down.
    pub fn is_noting(&self) -> bool {
        self.noting.is_some() || (self.file.is_some() && !self.to_note.is_empty())
    }

    /// The last one first.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Looks which files are missing, once each time the menu is opened.
    fn look(&mut self, ctx: &egui::Context, is_open: bool) {
        if let Some(Polled::Result(missing)) = self.looking.as_ref().map(Job::poll) {
            (self.looking, self.missing) = (None, missing);
        }
        if is_open && !self.is_open {
            let paths: Vec<PathBuf> = self.sources.iter().filter_map(|source| source.file.clone()).collect();
            self.looking = Some(Job::start(ctx, move |_, results| {
                let is_missing = |path: &PathBuf| !path.exists() && !crate::format::series::is_pattern(path);
                results.give(paths.into_iter().filter(is_missing).collect());
            }));
        }
        self.is_open = is_open;
    }
}

impl Drop for Recent {
    /// What is not written down when the window closes is now.
    fn drop(&mut self) {
        let mut noted = self.noting.take().map(|(noted, _)| noted).unwrap_or_default();
        noted.append(&mut self.to_note);
        if let (Some(file), false) = (&self.file, noted.is_empty()) {
            note_in(file, &noted, std::mem::take(&mut self.sources));
        }
    }
}

impl Viewer {
    /// The menu beside the button Open.
    pub(super) fn recent_menu(&mut self, ui: &mut Ui) {
        let mut chosen = None;
        let menu = ui.menu_button("Recent", |ui| {
            ui.set_max_width(420.0);
            if self.recent.sources().is_empty() {
                ui.weak("Nothing was open yet.");
            }
            for source in self.recent.sources() {
                let Some(path) = &source.file else { continue };
                let name = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
                let is_missing = self.recent.missing.contains(path);
                let text = if is_missing { egui::RichText::new(format!("{name} (missing)")).weak() } else { egui::RichText::new(name) };
                if ui.button(text).on_hover_text(path.display().to_string()).clicked() {
                    chosen = Some(source.clone());
                    ui.close();
                }
            }
        });
        let is_open = menu.inner.is_some();
        menu.response.on_hover_text("Files that were open lately");
        self.recent.look(ui.ctx(), is_open);
        if let Some(source) = chosen {
            self.open_source(&ui.ctx().clone(), source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ten_are_kept_without_doubles() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("octetra/recent.json");
        let name = |n: usize| folder.path().join(format!("{n}.vtu"));
        // What a window has noted is written down at the latest when it closes.
        let mut recent = Recent::of(Some(file.clone()));
        (0..12).chain([5]).for_each(|n| recent.note(&Source::file(name(n))));
        recent.note(&Source::default());
        let expected: Vec<Source> = [5, 11, 10, 9, 8, 7, 6, 4, 3, 2].map(|n| Source::file(name(n))).into();
        assert_eq!(recent.sources(), expected);
        assert!(!file.exists() && recent.is_noting());
        drop(recent);
        assert_eq!(Recent::of(Some(file.clone())).sources(), expected);

        let [mut one, mut other] = [0; 2].map(|_| Recent::of(Some(file.clone())));
        let ctx = egui::Context::default();
        let write = |recent: &mut Recent| {
            while recent.is_noting() {
                recent.run(&ctx);
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        };
        one.note(&Source::file(name(20)));
        write(&mut one);
        other.note(&Source::file(name(21)));
        write(&mut other);
        assert_eq!(other.sources()[..2], [21, 20].map(|n| Source::file(name(n))), "that of another window too");
        assert_eq!(other.sources(), kept(&file));
        std::fs::write(&file, "no list").expect("written");
        assert!(Recent::of(Some(file)).sources().is_empty());
    }
}
