//! The viewer's real window, under Xvfb: real sliders moved by synthetic input, and what the screen shows afterwards.

mod common;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt as _, EventMask, ImageFormat};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

use common::Validated;
use vitrum::image::{Stored, decode_stored};

const SIZE: [u16; 2] = [1280, 720];

/// Where the picture is not covered by panels.
const CLEAR: [std::ops::Range<usize>; 2] = [310..960, 20..600];

/// An X server without a screen, and the viewer in it.
struct Desktop {
    server: Child,
    viewer: Child,
    x: RustConnection,
    root: u32,
}

type Pixels = Vec<[u8; 3]>;

impl Desktop {
    /// `None` where there is no Xvfb; `ci/setup.sh` installs it.
    fn open(args: &str) -> Option<Self> {
        let screen = format!("{}x{}x24", SIZE[0], SIZE[1]);
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
            .args(["view", "--validation", "-v"])
            .args(args.split_whitespace())
            .env("DISPLAY", &display)
            .env_remove("WAYLAND_DISPLAY")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer");
        let (x, screen) = RustConnection::connect(Some(&display)).expect("a connection");
        let root = x.setup().roots[screen].root;
        Some(Self { server, viewer, x, root })
    }

    fn screenshot(&self) -> Pixels {
        let [width, height] = SIZE;
        let image = self.x.get_image(ImageFormat::Z_PIXMAP, self.root, 0, 0, width, height, u32::MAX);
        let data = image.expect("a request").reply().expect("a screenshot").data;
        data.chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
    }

    /// 4: the pointer; 5 and 6: a button goes down and up; 2 and 3: a key does.
    fn event(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.x.xtest_fake_input(kind, detail, 0, self.root, x, y, 0).expect("a request").check().expect("an event");
        std::thread::sleep(Duration::from_millis(60));
    }

    const MOVE: u8 = 6;
    const DOWN: u8 = 4;
    const UP: u8 = 5;

    fn drag(&self, from: [i16; 2], to: [i16; 2]) {
        self.event(Self::MOVE, 0, from);
        self.event(Self::DOWN, 1, [0, 0]);
        for step in 1..=8 {
            self.event(Self::MOVE, 0, [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * step / 8));
        }
        self.event(Self::UP, 1, [0, 0]);
    }

    /// Waits until the screen shows `file`, within a step of 8 bits, where no panel is.
    fn shows(&self, file: &Path, what: &str) {
        let wanted = stored(file);
        let start = Instant::now();
        loop {
            let shown = self.screenshot();
            let most = difference(&shown, &wanted);
            if most <= 1 {
                return;
            }
            assert!(start.elapsed() < Duration::from_secs(90), "{what}: off by {most} of 255");
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    /// As a window manager does it: the viewer ends well, and the validation layer had nothing to say.
    fn close(mut self) {
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

/// The values of a PNG, as they are stored.
fn stored(file: &Path) -> Pixels {
    match decode_stored(file, &std::fs::read(file).expect("a picture")).expect("a picture") {
        Stored::Srgb { pixels, .. } => pixels,
        _ => panic!("{} holds 8 bits a channel", file.display()),
    }
}

fn difference(shown: &Pixels, wanted: &Pixels) -> u8 {
    let [columns, rows] = CLEAR;
    let places = rows.flat_map(|row| columns.clone().map(move |column| row * usize::from(SIZE[0]) + column));
    let off = places.flat_map(|place| (0..3).map(move |i| shown[place][i].abs_diff(wanted[place][i])));
    off.max().unwrap_or(u8::MAX)
}

fn render(folder: &Path, name: &str, args: &str) -> std::path::PathBuf {
    let file = folder.join(format!("{name}.png"));
    let status = Command::new(env!("CARGO_BIN_EXE_vitrum"))
        .args(["render", "-q", "--size", "1280x720", "--samples", "2", "-o"])
        .arg(&file)
        .args(args.split_whitespace())
        .status()
        .expect("it starts");
    assert!(status.success());
    file
}

#[test]
fn sliders_change_the_picture_as_the_options_do() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let pictures =
        [("plain", ""), ("red", "--reflection-red 1"), ("gone", "--ior 1"), ("rough", "--roughness 1 --ior 1.5")]
            .map(|(name, args)| render(folder.path(), name, args));
    let [plain, red, gone, rough] = &pictures;
    let reds = |file: &Path| stored(file).iter().map(|pixel| u64::from(pixel[0])).sum::<u64>();
    assert!(reds(red) > reds(plain), "reflections are red");
    let Some(desktop) = Desktop::open("--samples 2") else { return };
    desktop.shows(plain, "the built-in scene");
    // Ends of sliders are exact: what is dragged beyond them stays there.
    desktop.drag([111, 331], [240, 331]);
    desktop.shows(red, "Refl Red");
    desktop.drag([201, 331], [20, 331]);
    desktop.shows(plain, "Refl Red taken back");
    desktop.drag([160, 80], [60, 80]);
    desktop.shows(gone, "Refraction Index of 1");
    desktop.close();

    let Some(desktop) = Desktop::open("--samples 2") else { return };
    desktop.shows(plain, "the built-in scene");
    desktop.drag([128, 101], [300, 101]);
    desktop.shows(rough, "Roughness");
    desktop.close();
}

#[test]
fn without_a_window_system_it_says_so() {
    let output = Command::new(env!("CARGO_BIN_EXE_vitrum"))
        .arg("view")
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .expect("it starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.starts_with("error: no window") && !message.contains("panic"), "{message}");
}
