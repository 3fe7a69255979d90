//! Files that were open lately, kept in the platform's folder for settings.

use super::viewer::Viewer;
use crate::image::write_atomically;
use crate::session::Source;
use egui::Ui;
use std::path::{Path, PathBuf};

/// So many are kept.
const MOST: usize = 10;

/// Files, the last one first.
#[derive(Debug, Default)]
pub struct Recent {
    sources: Vec<Source>,
    /// Where they are kept; `None`: nowhere.
    file: Option<PathBuf>,
}

/// Where the list is kept on this platform, if it has such a place.
pub fn recent_file() -> Option<PathBuf> {
    use etcetera::BaseStrategy;
    let base = etcetera::choose_base_strategy().ok()?;
    Some(base.config_dir().join("octetra").join("recent.json"))
}

impl Recent {
    /// What a file keeps; a file that is missing or damaged keeps nothing.
    pub fn of(file: Option<PathBuf>) -> Self {
        let read = |path: &Path| serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok();
        let mut sources: Vec<Source> = file.as_deref().and_then(read).unwrap_or_default();
        sources.truncate(MOST);
        Recent { sources, file }
    }

    /// Puts a file first. That it could not be kept is no reason to stop.
    pub fn note(&mut self, source: &Source) {
        let full = |path: PathBuf| std::path::absolute(&path).unwrap_or(path);
        let source = source.clone().map(full);
        if source.file.is_none() {
            return;
        }
        // Another window may have added some.
        if self.file.as_ref().is_some_and(|file| file.exists()) {
            self.sources = Recent::of(self.file.clone()).sources;
        }
        self.sources.retain(|other| other.file != source.file);
        self.sources.insert(0, source);
        self.sources.truncate(MOST);
        if let Some(file) = &self.file {
            let text = serde_json::to_string_pretty(&self.sources).unwrap_or_default();
            let _ = file.parent().map(std::fs::create_dir_all);
            let _ = write_atomically(file, |out| out.write_all(text.as_bytes()));
        }
    }

    /// The last one first.
    pub fn sources(&self) -> &[Source] {
        &self.sources
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
                let is_there = path.exists() || crate::format::series::is_pattern(path);
                let text = if is_there { egui::RichText::new(name) } else { egui::RichText::new(format!("{name} (missing)")).weak() };
                if ui.button(text).on_hover_text(path.display().to_string()).clicked() {
                    chosen = Some(source.clone());
                    ui.close();
                }
            }
        });
        menu.response.on_hover_text("Files that were open lately");
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
        let mut recent = Recent::of(Some(file.clone()));
        let name = |n: usize| folder.path().join(format!("{n}.vtu"));
        (0..12).chain([5]).for_each(|n| recent.note(&Source::file(name(n))));
        recent.note(&Source::default());
        let expected: Vec<Source> = [5, 11, 10, 9, 8, 7, 6, 4, 3, 2].map(|n| Source::file(name(n))).into();
        assert_eq!(recent.sources(), expected);
        assert_eq!(Recent::of(Some(file.clone())).sources(), expected);
        let mut other = Recent::of(Some(file.clone()));
        recent.note(&Source::file(name(20)));
        other.note(&Source::file(name(21)));
        assert_eq!(other.sources()[..2], [21, 20].map(|n| Source::file(name(n))), "that of another window too");
        std::fs::write(&file, "no list").expect("written");
        assert!(Recent::of(Some(file)).sources().is_empty());
    }
}
