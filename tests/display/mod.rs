//! A display without a screen, the program on it, and a user's hands: Xvfb, and a client of it by x11rb.

use image::{Rgb, RgbImage};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, CreateWindowAux, EventMask, ImageFormat, InputFocus, MapState, Window,
    WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::{CURRENT_TIME, NONE};

/// So long a condition may take to come true: a software adapter compiles shaders, beside other tests.
const LIMIT: Duration = Duration::from_secs(240);

/// Keys by their names in X's keysymdef.h.
pub mod keys {
    pub const CONTROL: u32 = 0xffe3;
    pub const F1: u32 = 0xffbe;
    pub const fn letter(letter: char) -> u32 {
        letter as u32
    }
}

/// A program that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display, and a client of it with a window of its own that is never seen.
pub struct Display {
    client: RustConnection,
    root: Window,
    own: Window,
    number: u32,
    /// Ends after the client.
    _server: Running,
}

/// The program's window.
pub struct OpenWindow<'a> {
    display: &'a Display,
    id: Window,
    program: Running,
}

/// Goes on when `found` gives something, and fails with what `said` says if it never does.
pub fn wait<T>(mut found: impl FnMut() -> Option<T>, said: impl FnOnce() -> String) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        if start.elapsed() > LIMIT {
            panic!("{}", said());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

impl Display {
    /// Starts one with a screen of this size.
    pub fn start([width, height]: [u32; 2]) -> Self {
        let screen = format!("{width}x{height}x24");
        // It looks for a number that is free and says it.
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-noreset"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = Running(server.unwrap_or_else(|error| {
            panic!(
                "Xvfb, the display that this test needs, does not start ({error}). As root on Debian tests/run installs it; elsewhere: \
                 apt-get install xvfb, dnf install xorg-x11-server-Xvfb, pacman -S xorg-server-xvfb"
            )
        }));
        let mut said = String::new();
        let out = server.0.stdout.take().expect("its output");
        BufReader::new(out).read_line(&mut said).expect("its number");
        let number = said.trim().parse().unwrap_or_else(|_| panic!("Xvfb says no number but {said:?}"));
        let (client, screen) = RustConnection::connect(Some(&format!(":{number}"))).expect("a connection");
        let root = client.setup().roots[screen].root;
        let own = client.generate_id().expect("a number");
        client
            .create_window(0, own, root, 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &CreateWindowAux::new())
            .expect("a request")
            .check()
            .expect("a window");
        Display { client, root, own, number, _server: server }
    }

    /// Runs the program in a folder until its window, of this title, is there.
    pub fn open(&self, folder: &Path, args: &[&str], title: &str) -> OpenWindow<'_> {
        let program = Command::new(env!("CARGO_BIN_EXE_octetra"))
            .current_dir(folder)
            .args(args)
            .env("DISPLAY", format!(":{}", self.number))
            .env("XDG_CONFIG_HOME", folder.join("config"))
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .spawn();
        let mut program = Running(program.expect("the program starts"));
        let id = wait(
            || {
                let ended = program.0.try_wait().expect("its state");
                assert!(ended.is_none(), "octetra {args:?} ended: {ended:?}");
                self.window(title)
            },
            || format!("octetra {args:?} opens no window"),
        );
        // There is no window manager to do it.
        self.client.set_input_focus(InputFocus::POINTER_ROOT, id, CURRENT_TIME).expect("a request").check().expect("the focus");
        OpenWindow { display: self, id, program }
    }

    fn atom(&self, name: &str) -> u32 {
        self.client.intern_atom(false, name.as_bytes()).expect("a request").reply().expect("an atom").atom
    }

    fn text(&self, window: Window, property: u32) -> Option<String> {
        let property = self.client.get_property(false, window, property, AtomEnum::ANY, 0, 1 << 16).expect("a request").reply().ok()?;
        (!property.value.is_empty()).then(|| String::from_utf8_lossy(&property.value).into_owned())
    }

    /// A window that is seen, by its title.
    fn window(&self, title: &str) -> Option<Window> {
        let name = self.atom("_NET_WM_NAME");
        let children = self.client.query_tree(self.root).expect("a request").reply().expect("windows").children;
        let is_seen =
            |id: Window| self.client.get_window_attributes(id).is_ok_and(|a| a.reply().is_ok_and(|a| a.map_state == MapState::VIEWABLE));
        children.into_iter().find(|&id| is_seen(id) && self.text(id, name).as_deref() == Some(title))
    }

    /// All that is on the screen.
    pub fn screen(&self) -> RgbImage {
        let size = self.client.get_geometry(self.root).expect("a request").reply().expect("its size");
        let image = self.client.get_image(ImageFormat::Z_PIXMAP, self.root, 0, 0, size.width, size.height, !0);
        let bytes = image.expect("a request").reply().expect("an image").data;
        let pixel = |x: u32, y: u32| {
            let at = 4 * (y as usize * usize::from(size.width) + x as usize);
            Rgb([bytes[at + 2], bytes[at + 1], bytes[at]])
        };
        RgbImage::from_fn(size.width.into(), size.height.into(), pixel)
    }

    fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.client.xtest_fake_input(kind, detail, CURRENT_TIME, self.root, x, y, 0).expect("a request").check().expect("an event");
    }

    /// Moves the pointer.
    pub fn point(&self, at: [i16; 2]) {
        self.fake(6, 0, at);
    }

    /// Presses a mouse button, or lets it go.
    pub fn button(&self, number: u8, is_down: bool) {
        self.fake(if is_down { 4 } else { 5 }, number, [0, 0]);
    }

    /// Clicks with the left button.
    pub fn click(&self, at: [i16; 2]) {
        self.point(at);
        self.button(1, true);
        self.button(1, false);
    }

    /// Presses keys, the last with those before held.
    pub fn press(&self, keys: &[u32]) {
        let (first, last) = (self.client.setup().min_keycode, self.client.setup().max_keycode);
        let map = self.client.get_keyboard_mapping(first, last - first + 1).expect("a request").reply().expect("the keyboard");
        let code = |key: u32| {
            let mut codes = map.keysyms.chunks(map.keysyms_per_keycode.into());
            first + codes.position(|symbols| symbols.first() == Some(&key)).expect("a key of this name") as u8
        };
        keys.iter().for_each(|&key| self.fake(2, code(key), [0, 0]));
        keys.iter().rev().for_each(|&key| self.fake(3, code(key), [0, 0]));
    }

    /// The text in the clipboard, asked of whoever owns it.
    pub fn clipboard(&self) -> Option<String> {
        let (clipboard, property) = (self.atom("CLIPBOARD"), self.atom("TAKEN"));
        self.client
            .convert_selection(self.own, clipboard, self.atom("UTF8_STRING"), property, CURRENT_TIME)
            .expect("a request")
            .check()
            .expect("asked");
        let answer = wait(
            || match self.client.poll_for_event().expect("a connection") {
                Some(Event::SelectionNotify(answer)) => Some(answer),
                _ => None,
            },
            || "nobody answers for the clipboard".into(),
        );
        (answer.property != NONE).then(|| self.text(self.own, property)).flatten()
    }
}

impl OpenWindow<'_> {
    /// Makes it another size, as a window manager would.
    pub fn resize(&self, [width, height]: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.display.client.configure_window(self.id, &size).expect("a request").check().expect("another size");
    }

    /// Asks it to close, as a window manager does, and waits until the program has ended.
    pub fn close(mut self) -> ExitStatus {
        let (protocols, delete) = (self.display.atom("WM_PROTOCOLS"), self.display.atom("WM_DELETE_WINDOW"));
        let message = ClientMessageEvent::new(32, self.id, protocols, [delete, CURRENT_TIME, 0, 0, 0]);
        self.display.client.send_event(false, self.id, EventMask::NO_EVENT, message).expect("a request").check().expect("a message");
        wait(|| self.program.0.try_wait().expect("its state"), || "the window does not close".into())
    }
}
