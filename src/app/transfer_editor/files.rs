//! Transfer functions from files and into files, in the background.

use super::super::jobs::{Job, Polled, outcome};
use super::super::viewer::Viewer;
use crate::format::transfer_file::{self, NamedTransfer};
use crate::view::TransferFunction;
use anyhow::{Context, Result};
use std::path::PathBuf;

/// What was done with a file; `None`: no file was chosen.
pub enum Done {
    /// Read: all of its transfer functions.
    Imported(PathBuf, Vec<NamedTransfer>),
    /// Written.
    Exported(PathBuf),
}

/// How a transfer function is written.
#[derive(Clone, Copy, PartialEq)]
pub enum Form {
    /// octetra's JSON.
    Own,
    /// A colour map for ParaView.
    ParaView,
}

impl Viewer {
    /// Asks for a file of transfer functions and reads it.
    pub(super) fn import_transfer(&mut self, ctx: &egui::Context) {
        let dialog = rfd::AsyncFileDialog::new().add_filter("Transfer functions, ParaView's colour maps", &["json"]);
        let answer = dialog.pick_file();
        self.transfer_editor.file = Some(Job::start(ctx, move |_, results| {
            let read = |path: PathBuf| -> Result<Done> { Ok(Done::Imported(path.clone(), transfer_file::read(&path)?)) };
            results.give(pollster::block_on(answer).map(|file| read(file.path().to_owned())).transpose());
        }));
    }

    /// Reads a file of transfer functions in the background and shows the first.
    pub fn open_transfer(&mut self, ctx: &egui::Context, path: PathBuf) {
        self.transfer_editor.file = Some(Job::start(ctx, move |_, results| {
            let read = transfer_file::read(&path).map(|maps| Some(Done::Imported(path.clone(), maps)));
            results.give(read.map_err(Into::into));
        }));
    }

    /// Asks for a file and writes the transfer function as it is drawn.
    pub(super) fn export_transfer(&mut self, ctx: &egui::Context, function: TransferFunction, form: Form) {
        let name = self.settings.transfer.name.clone();
        let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let dialog = rfd::AsyncFileDialog::new().add_filter("JSON", &["json"]).set_file_name(format!("{plain}.json"));
        let answer = dialog.save_file();
        self.transfer_editor.file = Some(Job::start(ctx, move |_, results| {
            let write = |path: PathBuf| -> Result<Done> {
                match form {
                    Form::Own => transfer_file::write(&path, &function)?,
                    Form::ParaView => transfer_file::write_paraview(&path, &name, &function)?,
                }
                Ok(Done::Exported(path))
            };
            results.give(pollster::block_on(answer).map(|file| write(file.path().to_owned())).transpose());
        }));
    }

    /// Takes what was read or written.
    pub(in super::super) fn run_transfer_files(&mut self) {
        let ended = match self.transfer_editor.file.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => return,
            Some(ended) => ended,
        };
        self.transfer_editor.file = None;
        let done = outcome(ended).and_then(|done| match done {
            None => Ok(None),
            Some(Done::Exported(path)) => Ok(Some(format!("wrote {}", path.display()))),
            Some(Done::Imported(path, maps)) => {
                let count = maps.len();
                let first = maps.first().with_context(|| format!("{}: holds no transfer function", path.display()))?;
                self.settings.transfer.import(first);
                self.transfer_editor.imported = maps;
                Ok(Some(format!("read {count} transfer function{} from {}", if count == 1 { "" } else { "s" }, path.display())))
            }
        });
        match done {
            Ok(Some(text)) => self.say(text),
            Ok(None) => {}
            Err(error) => self.fail(error),
        }
    }
}
