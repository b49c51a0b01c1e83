//! The viewer's real window under Xvfb, with synthetic input.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt as _, EventMask, ImageFormat};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// An X server without a screen, and the viewer in it.
pub struct Desktop {
    server: Child,
    pub viewer: Child,
    x: RustConnection,
    root: u32,
    size: [u16; 2],
}

/// How long the viewer has for an event.
const PAUSE: Duration = Duration::from_millis(60);

pub type Pixels = Vec<[u8; 3]>;

impl Desktop {
    /// `None` where there is no Xvfb; `ci/setup.sh` installs it.
    pub fn open(size: [u16; 2], args: &[&str]) -> Option<Self> {
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
        let viewer = Command::new(env!("CARGO_BIN_EXE_vitrum"))
            .arg("view")
            .args(args)
            .env("DISPLAY", &display)
            .env_remove("WAYLAND_DISPLAY")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer");
        let (x, screen) = RustConnection::connect(Some(&display)).expect("a connection");
        let root = x.setup().roots[screen].root;
        Some(Self { server, viewer, x, root, size })
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

    pub fn drag(&self, from: [i16; 2], to: [i16; 2]) {
        self.event(Self::MOVE, 0, from);
        self.event(Self::DOWN, 1, [0, 0]);
        for step in 1..=8 {
            self.event(Self::MOVE, 0, [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / 8));
        }
        self.event(Self::UP, 1, [0, 0]);
    }

    /// As a window manager does it: the viewer ends well, and the validation layer had nothing to say.
    pub fn close(mut self) {
        let atom = |name: &str| {
            let cookie = self.x.intern_atom(false, name.as_bytes()).expect("a request");
            cookie.reply().expect("an atom").atom
        };
        let (protocols, delete) = (atom("WM_PROTOCOLS"), atom("WM_DELETE_WINDOW"));
        let windows = self.x.query_tree(self.root).expect("a request").reply().expect("windows").children;
        for window in windows {
            let event = ClientMessageEvent::new(32, window, protocols, [delete, 0, 0, 0, 0]);
            self.x.send_event(false, window, EventMask::NO_EVENT, event).expect("a request");
        }
        self.x.flush().expect("an event");
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
