//! Slices seen straight on: panned and magnified, stepped by the wheel, and the lines of the others dragged over them.

use super::cut::Cut;
use super::space::{FlatFrame, FlatView};
use super::window::StoreWindow;
use egui::{Color32, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2};
use glam::DVec2;

/// How near to a line it is caught, and the size of the knob at its end, points.
const CATCH: f32 = 5.0;
const KNOB: f32 = 13.0;

/// Powers of e that a point of scrolling magnifies by.
const SCROLL_ZOOM: f64 = 0.005;

/// Points of scrolling that step a slice: a notch of most wheels, or so.
const NOTCH: f32 = 40.0;

/// A flat picture's state.
pub struct Flat {
    /// The slice that it shows, by its number.
    pub cut: usize,
    /// How it is moved and magnified.
    pub view: FlatView,
    /// The slice whose line is dragged.
    dragged: Option<usize>,
    /// Scrolling that has not made a step.
    scrolled: f32,
}

impl Flat {
    /// Of a slice, all of it.
    pub fn new(cut: usize) -> Self {
        Flat { cut, view: FlatView::default(), dragged: None, scrolled: 0.0 }
    }
}

/// The lines of the other slices in a picture: number, ends.
fn lines(frame: &FlatFrame, cuts: &[Cut], own: usize) -> Vec<(usize, [Pos2; 2])> {
    let others = cuts.iter().enumerate().filter(|(i, cut)| *i != own && cut.is_shown);
    others.filter_map(|(i, cut)| Some((i, frame.line(cut)?))).collect()
}

/// Where the knob of a line is: at its upper or right end, within the picture.
fn knob(rect: Rect, ends: [Pos2; 2]) -> Pos2 {
    let inside = rect.shrink(KNOB / 2.0 + 1.0);
    let worth = |at: Pos2| at.x - at.y;
    let end = if worth(ends[0]) > worth(ends[1]) { ends[0] } else { ends[1] };
    pos2(end.x.clamp(inside.left(), inside.right()), end.y.clamp(inside.top(), inside.bottom()))
}

fn distance(at: Pos2, [a, b]: [Pos2; 2]) -> f32 {
    let (along, to) = (b - a, at - a);
    let t = (to.dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    (to - along * t).length()
}

impl StoreWindow {
    /// Lets a flat picture be worked on; `None` if its slice is gone.
    pub(super) fn work_flat(&mut self, ui: &Ui, number: usize, rect: Rect) {
        let space = self.space();
        let own = self.flats[number].cut;
        let Some(&cut) = self.cuts.get(own) else { return };
        let picture = ui.interact(rect, ui.scope_id().with(("flat", number)), Sense::click_and_drag());
        picture.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, format!("slice {}", cut.name())));
        let frame = FlatFrame::new(&space, &cut, &self.flats[number].view, rect);
        let lines = lines(&frame, &self.cuts, own);

        // Knobs at the ends of the lines.
        let mut moved = None;
        for &(i, ends) in &lines {
            let at = knob(rect, ends);
            let id = picture.id.with(("knob", i));
            let response = ui.interact(Rect::from_center_size(at, Vec2::splat(KNOB)), id, Sense::drag());
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, format!("line {} in {}", self.title(i), cut.name())));
            if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged_by(PointerButton::Primary)) {
                moved = Some((i, pointer));
            }
            if response.hovered() || response.dragged() {
                ui.ctx().set_cursor_icon(cursor(ends));
            }
            response.on_hover_text(format!("Drag: moves slice {}", self.title(i)));
        }
        // The lines themselves; beside them the picture is panned.
        let nearest = |at: Pos2| {
            let near = lines.iter().map(|&(i, ends)| (distance(at, ends), i, ends)).filter(|line| line.0 <= CATCH);
            near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i, ends)| (i, ends))
        };
        let pressed = ui.input(|input| input.pointer.press_origin());
        if picture.drag_started_by(PointerButton::Primary) {
            self.flats[number].dragged = pressed.and_then(nearest).map(|(i, _)| i);
        }
        let flat = &mut self.flats[number];
        if let Some(pointer) = picture.interact_pointer_pos().filter(|_| picture.dragged()) {
            match flat.dragged.filter(|_| picture.dragged_by(PointerButton::Primary)) {
                Some(i) => moved = Some((i, pointer)),
                None => {
                    let by = picture.drag_delta();
                    flat.view.center -= DVec2::new(f64::from(by.x), -f64::from(by.y)) / frame.scale;
                }
            }
        }
        if picture.drag_stopped() {
            flat.dragged = None;
        }
        if let Some((_, ends)) = picture.hover_pos().and_then(nearest).filter(|_| !picture.dragged() || flat.dragged.is_some()) {
            ui.ctx().set_cursor_icon(cursor(ends));
        }
        if let Some((i, pointer)) = moved {
            let through = self.cuts[i].position_through(frame.index_at(pointer), space.dims);
            self.cuts[i] = self.cuts[i].at(through, space.dims);
            self.selected = i;
        }
        if let Some(at) = picture.interact_pointer_pos().filter(|_| picture.double_clicked()) {
            let point = frame.index_at(at);
            for (i, _) in lines {
                let through = self.cuts[i].position_through(point, space.dims);
                self.cuts[i] = self.cuts[i].at(through, space.dims);
            }
        } else if picture.clicked() {
            self.selected = own;
        }
        self.wheel(ui, number, &picture, &frame);
        if let Some(at) = picture.hover_pos() {
            self.pointed = Some(frame.index_at(at));
        }
    }

    fn wheel(&mut self, ui: &Ui, number: usize, picture: &Response, frame: &FlatFrame) {
        let Some(at) = ui.input(|input| input.pointer.hover_pos()).filter(|_| picture.contains_pointer()) else { return };
        let (scroll, zoom, is_zooming) =
            ui.input(|input| (input.smooth_scroll_delta().y, f64::from(input.zoom_delta()), input.modifiers.shift));
        let flat = &mut self.flats[number];
        let powers = zoom.ln() + if is_zooming { f64::from(scroll) * SCROLL_ZOOM } else { 0.0 };
        if powers != 0.0 && powers.is_finite() {
            // What is under the pointer stays there.
            let by = at - frame.rect.center();
            let from_middle = DVec2::new(f64::from(by.x), -f64::from(by.y)) / frame.scale;
            let zoomed = (flat.view.zoom + powers).clamp(-2.0, 12.0);
            flat.view.center += from_middle * (1.0 - (flat.view.zoom - zoomed).exp());
            flat.view.zoom = zoomed;
        } else if scroll != 0.0 && !is_zooming {
            flat.scrolled += scroll;
            let steps = (flat.scrolled / NOTCH).trunc();
            flat.scrolled -= steps * NOTCH;
            let own = flat.cut;
            if steps != 0.0 {
                self.step(own, f64::from(steps));
            }
        }
    }

    /// Paints the lines of the other slices over a flat picture.
    pub(super) fn paint_lines(&self, painter: &Painter, number: usize, rect: Rect) {
        let own = self.flats[number].cut;
        let Some(cut) = self.cuts.get(own) else { return };
        let frame = FlatFrame::new(&self.space(), cut, &self.flats[number].view, rect);
        let painter = painter.with_clip_rect(rect);
        for (i, ends) in lines(&frame, &self.cuts, own) {
            let color = self.cuts[i].color();
            let width = if i == self.selected { 1.6 } else { 1.0 };
            painter.line_segment(ends, Stroke::new(width + 1.5, Color32::from_black_alpha(110)));
            painter.line_segment(ends, Stroke::new(width, color));
            painter.circle(knob(rect, ends), KNOB / 2.0 - 2.0, color, Stroke::new(1.0, Color32::BLACK));
        }
    }
}

fn cursor([a, b]: [Pos2; 2]) -> CursorIcon {
    let along = b - a;
    match along.y.abs() / along.x.abs().max(1e-6) {
        steep if steep > 2.4 => CursorIcon::ResizeHorizontal,
        steep if steep < 0.41 => CursorIcon::ResizeVertical,
        _ if along.x * along.y > 0.0 => CursorIcon::ResizeNeSw,
        _ => CursorIcon::ResizeNwSe,
    }
}
