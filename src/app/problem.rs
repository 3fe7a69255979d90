//! What went wrong, to be read at leisure.

use super::viewer::Viewer;
use anyhow::Error;
use egui::{Align2, RichText};

/// An error with all that led to it, outermost first.
pub struct Problem(Vec<String>);

impl Problem {
    /// That of an error.
    pub fn of(error: &Error) -> Self {
        Problem(error.chain().map(|cause| cause.to_string()).collect())
    }
}

impl Viewer {
    /// Shows the problem over the picture, if there is one, until it is closed.
    pub(super) fn problem_panel(&mut self, ctx: &egui::Context) {
        let Some(Problem(chain)) = &self.problem else { return };
        let width = (ctx.content_rect().width() - 340.0).clamp(240.0, 560.0);
        let panel = egui::Window::new("This could not be opened").collapsible(false).resizable(false).auto_sized();
        // Over the picture, not over the panel beside it.
        let close = panel.anchor(Align2::CENTER_CENTER, [150.0, 0.0]).show(ctx, |ui| {
            ui.set_width(width);
            for (depth, cause) in chain.iter().enumerate() {
                let text = RichText::new(if depth == 0 { cause.clone() } else { format!("because: {cause}") });
                ui.add(egui::Label::new(if depth == 0 { text.color(ui.visuals().error_fg_color) } else { text }).wrap());
            }
            ui.weak(format!("{} is still open.", self.document.name));
            ui.horizontal(|ui| {
                if ui.button("Copy").on_hover_text("Copy the text").clicked() {
                    ui.ctx().copy_text(chain.join("\n"));
                }
                ui.button("Close").on_hover_text("Go on with what is open (Escape)").clicked()
            })
            .inner
        });
        let escaped = ctx.input(|input| input.key_pressed(egui::Key::Escape));
        if escaped || close.is_some_and(|panel| panel.inner == Some(true)) {
            self.problem = None;
        }
    }
}
