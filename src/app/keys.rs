//! The keys: one table, which the window obeys, the sheet of keys shows, and tooltips quote.

use crate::furniture::Part;
use egui::{Event, Key, Modifiers};

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Asks for a file and opens it.
    Open,
    /// Reads the open file again.
    Reload,
    /// Asks for a session and opens it.
    OpenSession,
    /// Asks for a file and writes the session.
    SaveSession,
    /// Writes the picture.
    Screenshot,
    /// Octree or exact.
    Flip,
    /// Shows what is under the pointer, or stops.
    Probe,
    /// Octree and exact side by side, or stops.
    Wipe,
    /// Shows or hides a piece of furniture.
    Show(Part),
    /// Light or dark.
    Theme,
    /// Shows or hides the sheet of keys.
    Help,
    /// Shows one step of a series after the other, or stops.
    Play,
    /// The step of a series before.
    PreviousStep,
    /// The step of a series after.
    NextStep,
    /// Settings as they were before the last change.
    UndoSettings,
    /// Takes that back.
    RedoSettings,
    /// The camera before its last move.
    UndoCamera,
    /// Takes that back.
    RedoCamera,
    /// All of the data, from this direction.
    Fit,
    /// The first view.
    Start,
    /// Looks along +x, -x, +y, -y, +z or -z, by number from 0.
    Face(usize),
    /// Looks at a corner, all axes equally short.
    Isometric,
    /// Parallel or perspective.
    Projection,
    /// Turns the picture to the right and up, degrees.
    Turn(f64, f64),
    /// Turns the picture about its middle, degrees counter-clockwise.
    Roll(f64),
    /// Makes it this many times as large.
    Zoom(f64),
    /// Moves the eye ahead, in parts of the bounds' diagonal.
    Advance(f64),
    /// The camera's JSON to the clipboard.
    CopyCamera,
    /// The camera from the clipboard.
    PasteCamera,
}

/// A key, and what is held down with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chord {
    /// The key.
    pub key: Key,
    /// With Ctrl, on a Mac with Cmd.
    pub ctrl: bool,
    /// With Shift.
    pub shift: bool,
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Binding {
    /// Any of these.
    pub chords: &'static [Chord],
    /// What it does.
    pub action: Action,
    /// The same in words.
    pub text: &'static str,
}

const fn key(key: Key) -> Chord {
    Chord { key, ctrl: false, shift: false }
}

const fn ctrl(key: Key) -> Chord {
    Chord { key, ctrl: true, shift: false }
}

const fn shift(key: Key) -> Chord {
    Chord { key, ctrl: false, shift: true }
}

const fn bind(chords: &'static [Chord], action: Action, text: &'static str) -> Binding {
    Binding { chords, action, text }
}

/// All keys, in groups with a name each.
pub const GROUPS: [(&str, &[Binding]); 5] = [
    (
        "Picture",
        &[
            bind(&[ctrl(Key::O)], Action::Open, "open a mesh or volume"),
            bind(&[key(Key::F5)], Action::Reload, "read the file again"),
            bind(&[ctrl(Key::S)], Action::SaveSession, "save the session"),
            bind(&[Chord { key: Key::O, ctrl: true, shift: true }], Action::OpenSession, "open a session"),
            bind(&[key(Key::S)], Action::Screenshot, "write a screenshot"),
            bind(&[key(Key::E)], Action::Flip, "octree or exact"),
            bind(&[key(Key::P)], Action::Probe, "say what is under the pointer"),
            bind(&[key(Key::W)], Action::Wipe, "octree | exact side by side"),
            bind(&[key(Key::B)], Action::Show(Part::Bar), "scalar bar"),
            bind(&[key(Key::X)], Action::Show(Part::Axes), "orientation axes"),
            bind(&[key(Key::G)], Action::Show(Part::Bounds), "bounding box with ticks"),
            bind(&[key(Key::T)], Action::Show(Part::Time), "frame time"),
            bind(&[key(Key::L)], Action::Theme, "light or dark window"),
            bind(&[key(Key::Questionmark), key(Key::F1)], Action::Help, "these keys"),
        ],
    ),
    (
        "Undo",
        &[
            bind(&[ctrl(Key::Z)], Action::UndoSettings, "undo a setting"),
            bind(&[ctrl(Key::Y), Chord { key: Key::Z, ctrl: true, shift: true }], Action::RedoSettings, "redo it"),
            bind(&[ctrl(Key::B)], Action::UndoCamera, "undo a camera move"),
            bind(&[ctrl(Key::G)], Action::RedoCamera, "redo it"),
        ],
    ),
    (
        "Views",
        &[
            bind(&[key(Key::R)], Action::Fit, "show all from this direction"),
            bind(&[key(Key::Home)], Action::Start, "the first view"),
            bind(&[key(Key::Num1)], Action::Face(0), "look along +x"),
            bind(&[key(Key::Num2)], Action::Face(1), "look along -x"),
            bind(&[key(Key::Num3)], Action::Face(2), "look along +y"),
            bind(&[key(Key::Num4)], Action::Face(3), "look along -y"),
            bind(&[key(Key::Num5)], Action::Face(4), "look along +z"),
            bind(&[key(Key::Num6)], Action::Face(5), "look along -z"),
            bind(&[key(Key::Num7)], Action::Isometric, "isometric view"),
            bind(&[key(Key::O)], Action::Projection, "parallel or perspective"),
            bind(&[ctrl(Key::C)], Action::CopyCamera, "copy the camera as JSON"),
            bind(&[ctrl(Key::V)], Action::PasteCamera, "paste a camera"),
        ],
    ),
    (
        "Moves",
        &[
            bind(&[key(Key::ArrowLeft)], Action::Turn(-15.0, 0.0), "turn left by 15\u{b0}"),
            bind(&[key(Key::ArrowRight)], Action::Turn(15.0, 0.0), "turn right"),
            bind(&[key(Key::ArrowUp)], Action::Turn(0.0, 15.0), "turn up"),
            bind(&[key(Key::ArrowDown)], Action::Turn(0.0, -15.0), "turn down"),
            bind(&[shift(Key::ArrowLeft)], Action::Roll(15.0), "roll left by 15\u{b0}"),
            bind(&[shift(Key::ArrowRight)], Action::Roll(-15.0), "roll right"),
            bind(&[ctrl(Key::ArrowLeft)], Action::Roll(90.0), "roll left by 90\u{b0}"),
            bind(&[ctrl(Key::ArrowRight)], Action::Roll(-90.0), "roll right"),
            bind(&[key(Key::Plus), key(Key::Equals)], Action::Zoom(1.2), "zoom in"),
            bind(&[key(Key::Minus)], Action::Zoom(1.0 / 1.2), "zoom out"),
            bind(&[key(Key::PageUp)], Action::Advance(0.05), "move ahead, through the data"),
            bind(&[key(Key::PageDown)], Action::Advance(-0.05), "move back"),
        ],
    ),
    (
        "Time",
        &[
            bind(&[key(Key::Space)], Action::Play, "play or pause a series"),
            bind(&[key(Key::Comma)], Action::PreviousStep, "the step before"),
            bind(&[key(Key::Period)], Action::NextStep, "the step after"),
        ],
    ),
];

impl Chord {
    /// Its name on the sheet.
    pub fn name(self) -> String {
        let key = match self.key {
            Key::Questionmark => "?",
            Key::Plus => "+",
            Key::Equals => "=",
            Key::Minus => "-",
            Key::Comma => ",",
            Key::Period => ".",
            Key::PageUp => "Page Up",
            Key::PageDown => "Page Down",
            key => key.name(),
        };
        let held = [(self.ctrl, "Ctrl+"), (self.shift, "Shift+")];
        held.into_iter().filter(|held| held.0).map(|held| held.1).chain([key]).collect()
    }

    /// What must be held down.
    pub fn modifiers(self) -> Modifiers {
        Modifiers { command: self.ctrl, shift: self.shift, ..Modifiers::NONE }
    }

    fn is(self, key: Key, held: Modifiers) -> bool {
        // Keyboards differ in whether these are typed with Shift.
        let shift_counts = !matches!(key, Key::Questionmark | Key::Plus | Key::Equals);
        self.key == key && self.ctrl == held.command && !held.alt && (!shift_counts || self.shift == held.shift)
    }

    /// Whether widgets that have the keyboard's attention want this key for themselves.
    fn is_widgets(self) -> bool {
        use Key::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp, End, Home, Minus, PageDown, PageUp, Space};
        matches!(self.key, ArrowLeft | ArrowRight | ArrowUp | ArrowDown | Home | End | PageUp | PageDown | Minus | Space)
    }
}

impl Binding {
    /// The chords' names: "Ctrl+Y, Ctrl+Shift+Z".
    pub fn names(&self) -> String {
        self.chords.iter().map(|chord| chord.name()).collect::<Vec<_>>().join(", ")
    }
}

impl Action {
    /// Whether a key held down does it again and again.
    fn repeats(self) -> bool {
        use Action::{Advance, NextStep, PreviousStep, RedoCamera, RedoSettings, Roll, Turn, UndoCamera, UndoSettings, Zoom};
        let is_move = matches!(self, Turn(..) | Roll(_) | Zoom(_) | Advance(_) | PreviousStep | NextStep);
        is_move || matches!(self, UndoSettings | RedoSettings | UndoCamera | RedoCamera)
    }
}

/// All rows.
pub fn all() -> impl Iterator<Item = &'static Binding> {
    GROUPS.iter().flat_map(|(_, bindings)| bindings.iter())
}

/// A tooltip's text with the key that does the same.
pub fn tip(text: &str, action: Action) -> String {
    match all().find(|binding| binding.action == action) {
        Some(binding) => format!("{text} ({})", binding.names()),
        None => text.to_owned(),
    }
}

/// What the keys of this frame ask for, in their order. While a text is typed there is nothing; while another widget has the keyboard's
/// attention, the keys that move its value are its own.
pub fn pressed(ctx: &egui::Context) -> Vec<Action> {
    let events = ctx.input(|input| input.events.clone());
    let repeats: Vec<bool> = events.iter().map(|event| is_repeat(ctx, event)).collect();
    if ctx.text_edit_focused() {
        return Vec::new();
    }
    let is_taken = ctx.egui_wants_keyboard_input();
    let action = |(event, is_repeat): (&Event, bool)| match *event {
        // Systems have their own events for these, unless a text is marked for copying.
        Event::Copy if !ctx.plugin::<egui::text_selection::LabelSelectionState>().lock().has_selection() => Some(Action::CopyCamera),
        Event::Key { key, pressed: true, modifiers, .. } => {
            let is_meant = |chord: &&Chord| chord.is(key, modifiers) && !(is_taken && chord.is_widgets());
            let binding = all().find(|binding| binding.chords.iter().any(|chord| is_meant(&chord)))?;
            (!is_repeat || binding.action.repeats()).then_some(binding.action)
        }
        _ => None,
    };
    events.iter().zip(&repeats).filter_map(|(event, &is_repeat)| action((event, is_repeat))).collect()
}

/// Physical keys that are down.
#[derive(Clone, Default)]
struct Down(Vec<Key>);

/// Whether a press comes from a key that was down already. egui would say so forever of a `?` whose Shift was released first, for then it
/// is a `/` that goes up.
fn is_repeat(ctx: &egui::Context, event: &Event) -> bool {
    ctx.data_mut(|data| {
        let Down(down) = data.get_temp_mut_or_default::<Down>(egui::Id::unique("keys that are down"));
        match *event {
            Event::Key { physical_key: Some(key), pressed, .. } => {
                let was_down = down.contains(&key);
                down.retain(|other| *other != key);
                down.extend(pressed.then_some(key));
                pressed && was_down
            }
            Event::WindowFocused(false) => {
                down.clear();
                false
            }
            Event::Key { repeat, .. } => repeat,
            _ => false,
        }
    })
}

/// A text that was pasted into no text field.
pub fn pasted(ctx: &egui::Context) -> Option<String> {
    let text = |event: &Event| if let Event::Paste(text) = event { Some(text.clone()) } else { None };
    ctx.input(|input| input.events.iter().find_map(text)).filter(|_| !ctx.text_edit_focused())
}

#[cfg(test)]
mod tests {
    use super::super::navigate::{DRAGS, MORE, button_name};
    use super::*;

    /// What the last of some frames asks for.
    fn actions(frames: Vec<Vec<Event>>) -> Vec<Action> {
        let ctx = egui::Context::default();
        let mut found = Vec::new();
        for events in frames {
            let output = ctx.run_ui(egui::RawInput { events, ..Default::default() }, |ui| found = pressed(ui.ctx()));
            output.drop_without_applying_deltas();
        }
        found
    }

    fn press(chord: Chord) -> Event {
        Event::Key { key: chord.key, physical_key: None, pressed: true, repeat: false, modifiers: chord.modifiers() }
    }

    #[test]
    fn every_chord_asks_for_its_own_action_and_no_two_are_the_same() {
        let mut names = Vec::new();
        for binding in all() {
            for &chord in binding.chords {
                assert_eq!(actions(vec![vec![press(chord)]]), [binding.action], "{}", chord.name());
                let again = actions(vec![vec![press(chord)], vec![press(chord)]]);
                assert_eq!(again.len(), usize::from(binding.action.repeats()), "{} held down", chord.name());
                names.push(chord.name());
            }
        }
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        let held = Modifiers { alt: true, ..Modifiers::NONE };
        let with_alt = Event::Key { key: Key::R, physical_key: None, pressed: true, repeat: false, modifiers: held };
        assert_eq!(actions(vec![vec![with_alt]]), []);
    }

    #[test]
    fn a_question_mark_whose_shift_goes_up_first_can_be_typed_again() {
        let ctx = egui::Context::default();
        let mut asked = 0;
        let event = |key, pressed| Event::Key { key, physical_key: Some(Key::Slash), pressed, repeat: false, modifiers: Modifiers::SHIFT };
        for (key, pressed) in [(Key::Questionmark, true), (Key::Slash, false), (Key::Questionmark, true), (Key::Questionmark, true)] {
            let input = egui::RawInput { events: vec![event(key, pressed)], ..Default::default() };
            ctx.run_ui(input, |ui| asked += pressed_help(ui.ctx())).drop_without_applying_deltas();
        }
        assert_eq!(asked, 2, "the last press is a repeat");
    }

    fn pressed_help(ctx: &egui::Context) -> usize {
        pressed(ctx).iter().filter(|action| **action == Action::Help).count()
    }

    #[test]
    fn the_readme_has_all_keys_and_the_mouse() {
        let readme = include_str!("../../README.md");
        let drags = DRAGS.iter().map(|drag| (format!("{}{}", drag.1.prefix(), button_name(drag.0)), drag.3));
        let rows = all().map(|binding| (binding.names(), binding.text)).chain(drags);
        for (keys, text) in rows.chain(MORE.iter().map(|(what, text)| ((*what).to_owned(), *text))) {
            assert!(readme.contains(&format!("`{keys}` {text}")), "`{keys}` {text}");
        }
    }

    #[test]
    fn copying_is_an_event_of_its_own_and_tips_quote_the_table() {
        assert_eq!(actions(vec![vec![Event::Copy]]), [Action::CopyCamera]);
        assert_eq!(tip("Redo", Action::RedoSettings), "Redo (Ctrl+Y, Ctrl+Shift+Z)");
    }
}
