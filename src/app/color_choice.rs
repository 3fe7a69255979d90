//! Choosing a colour: a square of saturation and brightness, a strip of hues, numbers. egui's own needs a glyph that its fonts lack.

use egui::ecolor::HsvaGamma;
use egui::{Color32, DragValue, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

/// Edge of the square.
const EDGE: f32 = 170.0;

/// Cells of the square and of the strip, along an edge.
const CELLS: usize = 24;

/// A colour with numbers in [0, 1] on the screen, as the picture has it.
pub fn color32(color: [f64; 3]) -> Color32 {
    let [r, g, b] = color.map(|v| (v * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// A button of a colour that opens the choice of another; other widgets find it by its name.
pub fn color_button(ui: &mut Ui, color: &mut [f64; 3], name: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(24.0, 16.0), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, name));
    let stroke = if response.hovered() { ui.visuals().widgets.hovered.fg_stroke } else { ui.visuals().widgets.noninteractive.fg_stroke };
    ui.painter().rect(rect, 2.0, color32(*color), stroke, StrokeKind::Inside);
    let popup = egui::Popup::menu(&response).close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    popup.show(|ui| choose_color(ui, color));
    response.on_hover_text(name)
}

/// The choice itself; whether it changed the colour.
pub fn choose_color(ui: &mut Ui, color: &mut [f64; 3]) -> bool {
    let before = *color;
    // Greys have no hue: the one that was chosen is remembered.
    let memory = ui.scope_id().with("hue");
    let mut hsv = HsvaGamma::from(color32(*color));
    if hsv.s == 0.0 || hsv.v == 0.0 {
        hsv.h = ui.data(|data| data.get_temp(memory)).unwrap_or(hsv.h);
    }
    ui.set_max_width(EDGE);
    let of = |h: f32, s: f32, v: f32| Color32::from(HsvaGamma { h, s, v, a: 1.0 });
    let square = field(ui, vec2(EDGE, EDGE * 0.7), "saturation and brightness", |x, y| of(hsv.h, x, 1.0 - y), [hsv.s, 1.0 - hsv.v]);
    let strip = field(ui, vec2(EDGE, 16.0), "hue", |x, _| of(x, 1.0, 1.0), [hsv.h, 0.5]);
    if let Some([x, y]) = square {
        (hsv.s, hsv.v) = (x, 1.0 - y);
    }
    if let Some([x, _]) = strip {
        hsv.h = x.min(0.9999);
    }
    if square.is_some() || strip.is_some() {
        let [r, g, b, _] = Color32::from(hsv).to_array();
        *color = [r, g, b].map(|v| f64::from(v) / 255.0);
        ui.data_mut(|data| data.insert_temp(memory, hsv.h));
    }
    ui.horizontal(|ui| {
        for (value, name) in color.iter_mut().zip(["red ", "green ", "blue "]) {
            let drag = DragValue::new(value)
                .range(0.0..=1.0)
                .speed(0.005)
                .max_decimals(3)
                .prefix(name[..1].to_uppercase())
                .update_while_editing(false);
            ui.add(drag).on_hover_text(format!("{name}in [0, 1]"));
        }
    });
    *color != before
}

/// A field of colours over x and y in [0, 1], with a mark; the place where the pointer is held.
fn field(ui: &mut Ui, size: egui::Vec2, name: &str, color: impl Fn(f32, f32) -> Color32, mark: [f32; 2]) -> Option<[f32; 2]> {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, name));
    let mut mesh = egui::Mesh::default();
    let part = |k: usize| k as f32 / CELLS as f32;
    for (j, i) in (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (j, i))) {
        mesh.colored_vertex(inside(rect, [part(i), part(j)]), color(part(i), part(j)));
        if i < CELLS && j < CELLS {
            let corner = (j * (CELLS + 1) + i) as u32;
            let below = corner + CELLS as u32 + 1;
            mesh.add_triangle(corner, corner + 1, below);
            mesh.add_triangle(corner + 1, below, below + 1);
        }
    }
    ui.painter().add(mesh);
    let at = inside(rect, mark);
    ui.painter().circle_stroke(at, 5.0, Stroke::new(3.0, Color32::BLACK));
    ui.painter().circle_stroke(at, 5.0, Stroke::new(1.5, Color32::WHITE));
    let pointer = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on() || response.clicked());
    pointer.map(|at| [(at.x - rect.left()) / rect.width(), (at.y - rect.top()) / rect.height()].map(|v| v.clamp(0.0, 1.0)))
}

fn inside(rect: Rect, [x, y]: [f32; 2]) -> Pos2 {
    pos2(rect.left() + rect.width() * x, rect.top() + rect.height() * y)
}
