//! The viewer's real window under Xvfb, with synthetic input.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt as _, CreateWindowAux, EventMask, ImageFormat,
    InputFocus, PropMode, SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// An X server without a screen, and the viewer in it.
pub struct Desktop {
    server: Child,
    pub viewer: Child,
    x: RustConnection,
    root: u32,
    size: [u16; 2],
    /// Where the viewer is at home.
    pub folder: tempfile::TempDir,
}

/// How long the viewer has for an event.
const PAUSE: Duration = Duration::from_millis(60);

pub type Pixels = Vec<[u8; 3]>;

impl Desktop {
    /// `None` where there is no Xvfb; `ci/setup.sh` installs it.
    pub fn open(size: [u16; 2], args: &[&str]) -> Option<Self> {
        Self::open_with(size, args, &[])
    }

    /// With variables of the environment.
    pub fn open_with(size: [u16; 2], args: &[&str], variables: &[(&str, &str)]) -> Option<Self> {
        let screen = format!("{}x{}x24", size[0], size[1]);
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0", &screen])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            assert!(std::env::var_os("CI").is_none(), "no Xvfb; run ci/setup.sh");
            eprintln!("skipped: no Xvfb; run ci/setup.sh");
            return None;
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take().expect("its output")).read_line(&mut number).expect("a display");
        let display = format!(":{}", number.trim());
        let folder = tempfile::tempdir().expect("a folder");
        let viewer = Command::new(env!("CARGO_BIN_EXE_vitrum"))
            .arg("view")
            .current_dir(folder.path())
            .args(args)
            .env("DISPLAY", &display)
            .env("XDG_CONFIG_HOME", folder.path())
            .env_remove("WAYLAND_DISPLAY")
            .envs(variables.iter().copied())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer");
        let (x, screen) = RustConnection::connect(Some(&display)).expect("a connection");
        let root = x.setup().roots[screen].root;
        Some(Self { server, viewer, x, root, size, folder })
    }

    pub fn screenshot(&self) -> Pixels {
        let [width, height] = self.size;
        let image = self.x.get_image(ImageFormat::Z_PIXMAP, self.root, 0, 0, width, height, u32::MAX);
        let data = image.expect("a request").reply().expect("a screenshot").data;
        data.chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
    }

    /// 4: the pointer; 5 and 6: a button goes down and up; 2 and 3: a key does.
    pub fn event(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.x.xtest_fake_input(kind, detail, 0, self.root, x, y, 0).expect("a request").check().expect("an event");
        std::thread::sleep(PAUSE);
    }

    /// The same, as quick as a mouse tells its place.
    pub fn quick_event(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.x.xtest_fake_input(kind, detail, 0, self.root, x, y, 0).expect("a request").check().expect("an event");
        std::thread::sleep(Duration::from_millis(8));
    }

    pub const MOVE: u8 = 6;
    pub const DOWN: u8 = 4;
    pub const UP: u8 = 5;

    pub fn click(&self, at: [i16; 2]) {
        self.event(Self::MOVE, 0, at);
        self.event(Self::DOWN, 1, [0, 0]);
        self.event(Self::UP, 1, [0, 0]);
    }

    pub fn drag(&self, from: [i16; 2], to: [i16; 2]) {
        self.event(Self::MOVE, 0, from);
        self.event(Self::DOWN, 1, [0, 0]);
        for step in 1..=8 {
            self.event(Self::MOVE, 0, [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / 8));
        }
        self.event(Self::UP, 1, [0, 0]);
    }

    /// The viewer's window.
    fn window(&self) -> u32 {
        let windows = self.x.query_tree(self.root).expect("a request").reply().expect("windows").children;
        let is_shown = |window: &u32| {
            let name = self.x.get_property(false, *window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64);
            name.ok().and_then(|cookie| cookie.reply().ok()).is_some_and(|reply| !reply.value.is_empty())
        };
        windows.into_iter().find(is_shown).expect("a window")
    }

    pub fn resize(&self, [width, height]: [u16; 2]) {
        let change = ConfigureWindowAux::new().width(u32::from(width)).height(u32::from(height));
        self.x.configure_window(self.window(), &change).expect("a request").check().expect("a size");
    }

    /// As a window manager does that minimises it, or not any more.
    pub fn show(&self, shown: bool) {
        let window = self.window();
        match shown {
            true => self.x.map_window(window).expect("a request").check().expect("a window"),
            false => self.x.unmap_window(window).expect("a request").check().expect("a window"),
        }
    }

    /// Keys go to the viewer.
    pub fn focus(&self) {
        let focus = self.x.set_input_focus(InputFocus::PARENT, self.window(), x11rb::CURRENT_TIME);
        focus.expect("a request").check().expect("the focus");
    }

    fn atom(&self, name: &str) -> u32 {
        self.x.intern_atom(false, name.as_bytes()).expect("a request").reply().expect("an atom").atom
    }

    /// A window of our own, to own selections with.
    fn helper(&self) -> u32 {
        let window = self.x.generate_id().expect("a number");
        let class = WindowClass::INPUT_OUTPUT;
        let made = self.x.create_window(0, window, self.root, -9, -9, 1, 1, 0, class, 0, &CreateWindowAux::new());
        made.expect("a request").check().expect("a window");
        window
    }

    /// What is on the clipboard, as text.
    pub fn clipboard(&self) -> String {
        let (helper, clipboard) = (self.helper(), self.atom("CLIPBOARD"));
        let (text, place) = (self.atom("UTF8_STRING"), self.atom("VITRUM_TEST"));
        let asked = self.x.convert_selection(helper, clipboard, text, place, x11rb::CURRENT_TIME);
        asked.expect("a request").check().expect("a request");
        let start = Instant::now();
        loop {
            if let Some(Event::SelectionNotify(event)) = self.x.poll_for_event().expect("events") {
                assert_eq!(event.property, place, "nothing on the clipboard");
                let value = self.x.get_property(true, helper, place, AtomEnum::ANY, 0, 1 << 16);
                return String::from_utf8(value.expect("a request").reply().expect("text").value).expect("UTF-8");
            }
            assert!(start.elapsed() < Duration::from_secs(10), "no answer");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Drops a file on the window: the protocol XDND, version 5, from the source's side.
    pub fn drop_file(&self, file: &Path) {
        let (window, source) = (self.window(), self.helper());
        let names = ["XdndSelection", "XdndEnter", "XdndPosition", "XdndDrop", "XdndActionCopy", "text/uri-list"];
        let [selection, enter, position, drop, copy, list] = names.map(|name| self.atom(name));
        self.x.set_selection_owner(source, selection, x11rb::CURRENT_TIME).expect("a request").check().expect("it");
        let send = |kind: u32, data: [u32; 4]| {
            let data = [source, data[0], data[1], data[2], data[3]];
            let event = ClientMessageEvent::new(32, window, kind, data);
            self.x.send_event(false, window, EventMask::NO_EVENT, event).expect("a request").check().expect("sent");
        };
        send(enter, [5 << 24, list, 0, 0]);
        send(position, [0, 200 << 16 | 400, x11rb::CURRENT_TIME, copy]);
        let uri = format!("file://{}\r\n", file.display());
        let finished = self.atom("XdndFinished");
        let start = Instant::now();
        let mut sent = false;
        while start.elapsed() < Duration::from_secs(5) {
            match self.x.poll_for_event().expect("events") {
                Some(Event::SelectionRequest(request)) => {
                    let place = PropMode::REPLACE;
                    let data = uri.as_bytes();
                    self.x.change_property8(place, request.requestor, request.property, request.target, data).ok();
                    let answer = SelectionNotifyEvent {
                        response_type: SELECTION_NOTIFY_EVENT,
                        sequence: 0,
                        time: request.time,
                        requestor: request.requestor,
                        selection: request.selection,
                        target: request.target,
                        property: request.property,
                    };
                    self.x.send_event(false, request.requestor, EventMask::NO_EVENT, answer).ok();
                    self.x.flush().expect("sent");
                }
                Some(Event::ClientMessage(event)) if event.type_ == finished => return,
                // The window says that it would take it.
                Some(Event::ClientMessage(_)) if !sent => {
                    send(drop, [0, x11rb::CURRENT_TIME, 0, 0]);
                    sent = true;
                }
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(2)),
            }
        }
    }

    /// Bytes of memory that the viewer holds.
    pub fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.viewer.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        kilobytes.expect("the viewer lives") << 10
    }

    /// As a window manager does it: the viewer ends well, and the validation layer had nothing to say.
    pub fn close(self) {
        let (protocols, delete) = (self.atom("WM_PROTOCOLS"), self.atom("WM_DELETE_WINDOW"));
        let windows = self.x.query_tree(self.root).expect("a request").reply().expect("windows").children;
        for window in windows {
            let event = ClientMessageEvent::new(32, window, protocols, [delete, 0, 0, 0, 0]);
            self.x.send_event(false, window, EventMask::NO_EVENT, event).expect("a request");
        }
        self.x.flush().expect("an event");
        self.ends();
    }

    /// The viewer ends well, after what was done to it.
    pub fn ends(mut self) {
        let start = Instant::now();
        while self.viewer.try_wait().expect("a state").is_none() {
            assert!(start.elapsed() < Duration::from_secs(30), "it does not close");
            std::thread::sleep(Duration::from_millis(50));
        }
        let status = self.viewer.wait().expect("a state");
        let said = self.viewer.stderr.take().map(BufReader::new);
        let said: Vec<_> = said.into_iter().flat_map(BufRead::lines).map_while(Result::ok).collect();
        assert!(status.success(), "{status}: {said:?}");
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        for child in [&mut self.viewer, &mut self.server] {
            // One that has ended already is no failure.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
