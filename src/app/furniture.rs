//! The furniture of the window: what is shown of it, and its painting by egui.

use super::color_choice::color_button;
use super::keys::{Action, tip};
use super::settings::component_label;
use super::viewer::Viewer;
use super::widgets::{choice, rows};
use crate::furniture::{Color, Drawing, Furniture, Part, Parts, Shape, title};
use crate::geometry::Placed;
use crate::mesh::TetMesh;
use crate::view::Mode;
use egui::{Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec2;

/// What lies behind the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backdrop {
    /// Black.
    Black,
    /// A dark grey.
    Grey,
    /// White.
    White,
    /// The user's own colour.
    Custom,
}

/// What is around and behind the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// What furniture is shown.
    pub parts: Parts,
    /// What lies behind.
    pub backdrop: Backdrop,
    /// The user's own colour.
    pub custom: [u8; 3],
    /// Whether screenshots have the furniture, the frame time aside.
    pub saves_furniture: bool,
}

impl Default for Look {
    fn default() -> Self {
        Look { parts: Parts::OPENING, backdrop: Backdrop::Black, custom: [24, 40, 72], saves_furniture: true }
    }
}

impl Look {
    /// The colour behind the picture.
    pub fn background(&self) -> [u8; 3] {
        match self.backdrop {
            Backdrop::Black => [0; 3],
            Backdrop::Grey => [84; 3],
            Backdrop::White => [255; 3],
            Backdrop::Custom => self.custom,
        }
    }

    /// The same in [0, 1].
    pub fn background_rgb(&self) -> [f32; 3] {
        self.background().map(|v| f32::from(v) / 255.0)
    }
}

impl Viewer {
    /// The furniture of a picture of `size` points that shows these parts.
    pub(super) fn furniture(&self, size: egui::Vec2, parts: Parts) -> Drawing {
        // Until an octree is there, the range is not known.
        let (title, range) = self.values();
        let furniture = Furniture {
            parts: parts.with(Part::Bar, parts.has(Part::Bar) && range.is_some()),
            title,
            value_range: range.unwrap_or([0.0, 1.0]),
            transfer_function: &self.settings.transfer.base,
            camera: &self.settings.camera,
            bounds: self.document.data.bounds().translated(self.document.data.center()),
            background: self.settings.look.background_rgb(),
            frame_time: Some(self.frame_label()),
        };
        furniture.drawing(DVec2::new(f64::from(size.x), f64::from(size.y)))
    }

    /// What the colours stand for: the name, and the range once it is known.
    pub(super) fn values(&self) -> (String, Option<[f64; 2]>) {
        let (title, range) = (self.values_title(), self.octree.model.as_ref().map(|model| model.value_range));
        if self.settings.render.mode != Mode::Integral {
            return (title, range);
        }
        (format!("integral of {title}"), range.map(|range| Mode::integral_range(range, self.document.data.bounds().diagonal())))
    }

    /// The array's name, with component and unit.
    fn values_title(&self) -> String {
        let field = &self.settings.field;
        let array = field.name.as_deref().unwrap_or_default();
        let components = self.document.data.mesh().map_or(1, |mesh| components(mesh, array));
        let component = (components > 1).then(|| component_label(field.component, components));
        title(array, component.as_deref())
    }

    /// The section of the panel.
    pub(super) fn look_section(&mut self, ui: &mut Ui) {
        let look = &mut self.settings.look;
        ui.horizontal_wrapped(|ui| {
            for (part, name, text) in [
                (Part::Bar, "Scalar bar", "The colours with the array's name, its range and round values"),
                (Part::Axes, "Axes", "Which way x, y and z go"),
                (Part::Bounds, "Box", "The bounding box, with ticks in the data's units"),
                (Part::Time, "Frame time", "What the picture took"),
            ] {
                let mut shown = look.parts.has(part);
                if ui.checkbox(&mut shown, name).on_hover_text(tip(text, Action::Show(part))).changed() {
                    look.parts = look.parts.with(part, shown);
                }
            }
        });
        ui.checkbox(&mut look.saves_furniture, "Furniture in screenshots")
            .on_hover_text("Draw scalar bar, axes and box into screenshots, too, as far as they are shown");
        rows(ui, "look", |ui| {
            choice(
                ui,
                "Background",
                "What lies behind the picture, in the window and in screenshots",
                &mut look.backdrop,
                &[
                    (Backdrop::Black, "black", "Colours as the transfer function has them"),
                    (Backdrop::Grey, "grey", "Dark and bright parts both stand out"),
                    (Backdrop::White, "white", "For paper"),
                    (Backdrop::Custom, "own", "A colour of your own"),
                ],
            );
            if look.backdrop == Backdrop::Custom {
                ui.label("Its colour");
                let mut chosen = look.custom.map(|v| f64::from(v) / 255.0);
                color_button(ui, &mut chosen, "The background's colour");
                look.custom = chosen.map(|v| (v * 255.0).round() as u8);
                ui.end_row();
            }
            let mut theme = ui.ctx().options(|options| options.theme_preference);
            let before = theme;
            let text = tip("Colours of the window around the picture", Action::Theme);
            choice(
                ui,
                "Window",
                &text,
                &mut theme,
                &[
                    (egui::ThemePreference::Dark, "dark", "Light letters on dark"),
                    (egui::ThemePreference::Light, "light", "Dark letters on light"),
                    (egui::ThemePreference::System, "system", "As the desktop has it"),
                ],
            );
            if theme != before {
                ui.ctx().set_theme(theme);
            }
        });
    }
}

/// How many numbers a tuple of an array has.
fn components(mesh: &TetMesh, array: &str) -> usize {
    let mut arrays = mesh.point_data().iter().chain(mesh.cell_data());
    arrays.find(|a| a.name == array).map_or(1, |array| array.components)
}

/// Paints shapes over `rect`.
pub fn paint(painter: &Painter, rect: Rect, shapes: &[Shape], halo: Color) {
    let painter = painter.with_clip_rect(rect);
    let at = |p: DVec2| rect.min + vec2(p.x as f32, p.y as f32);
    for shape in shapes {
        match shape {
            Shape::Line { from, to, width, color } => {
                painter.line_segment([at(*from), at(*to)], Stroke::new(*width as f32, color32(*color)));
            }
            Shape::Fill { min, max, top, bottom } => {
                fill(&painter, Rect::from_min_max(at(*min), at(*max)), color32(*top), color32(*bottom))
            }
            Shape::Text { at: place, anchor, size, color, text } => {
                let galley = painter.layout_no_wrap(text.clone(), FontId::proportional(*size as f32), color32(*color));
                let place: Pos2 = at(*place);
                let corner = place - galley.size() * vec2(anchor.0 as f32, anchor.1 as f32);
                let around = color32([halo[0], halo[1], halo[2], 0.5 * halo[3]]);
                for i in 0..8 {
                    let by = egui::Vec2::angled(i as f32 * std::f32::consts::FRAC_PI_4);
                    painter.galley_with_override_text_color(corner + by, galley.clone(), around);
                }
                painter.galley(corner, galley, color32(*color));
            }
        }
    }
}

fn fill(painter: &Painter, rect: Rect, top: Color32, bottom: Color32) {
    let mut mesh = egui::Mesh::default();
    for (y, color) in [(rect.top(), top), (rect.bottom(), bottom)] {
        mesh.colored_vertex(pos2(rect.left(), y), color);
        mesh.colored_vertex(pos2(rect.right(), y), color);
    }
    mesh.add_triangle(0, 1, 2);
    mesh.add_triangle(1, 2, 3);
    painter.add(mesh);
}

fn color32(color: Color) -> Color32 {
    let [r, g, b, a] = color.map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgba_unmultiplied(r, g, b, a)
}
