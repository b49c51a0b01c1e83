//! The viewer's real window, under Xvfb: real sliders moved by synthetic input, and what the screen shows afterwards.

mod common;

use std::cell::Cell;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use common::Validated;
use common::desktop::{Desktop, Pixels};
use vitrum::image::{Stored, decode_stored};

const SIZE: [u16; 2] = [1280, 720];

/// Where the picture is not covered by panels.
const CLEAR: [std::ops::Range<usize>; 2] = [270..1010, 20..640];

/// The values of a PNG, as they are stored.
fn stored(file: &Path) -> Pixels {
    match decode_stored(file, &std::fs::read(file).expect("a picture")).expect("a picture") {
        Stored::Srgb { pixels, .. } => pixels,
        _ => panic!("{} holds 8 bits a channel", file.display()),
    }
}

/// Waits until the screen shows `file`, within a step of 8 bits, where no panel is.
fn shows(desktop: &Desktop, file: &Path, what: &str) {
    let wanted = stored(file);
    let start = Instant::now();
    loop {
        let shown = desktop.screenshot();
        let most = difference(&shown, &wanted);
        if most <= 1 {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(90), "{what}: off by {most} of 255");
        std::thread::sleep(Duration::from_millis(200));
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
    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    shows(&desktop, plain, "the built-in scene");
    // Ends of sliders are exact: what is dragged beyond them stays there.
    desktop.drag([109, 213], [240, 213]);
    shows(&desktop, red, "Refl Red");
    desktop.drag([183, 213], [20, 213]);
    shows(&desktop, plain, "Refl Red taken back");
    desktop.drag([151, 78], [60, 78]);
    shows(&desktop, gone, "Refraction Index of 1");
    desktop.close();

    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    shows(&desktop, plain, "the built-in scene");
    desktop.drag([127, 99], [300, 99]);
    shows(&desktop, rough, "Roughness");
    desktop.close();
}

/// The picture is what the command says that the window has to offer.
#[test]
fn the_copied_command_repeats_the_picture() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    let before = render(folder.path(), "before", "");
    shows(&desktop, &before, "the built-in scene");
    // The camera turns and comes closer, the glass changes, and so do the surroundings.
    desktop.drag([500, 500], [620, 470]);
    for _ in 0..2 {
        desktop.event(Desktop::DOWN, 4, [0, 0]);
        desktop.event(Desktop::UP, 4, [0, 0]);
    }
    desktop.drag([151, 78], [190, 78]);
    desktop.click([1034, 186]);
    // What unfolds takes its time.
    std::thread::sleep(Duration::from_millis(500));
    desktop.drag([1138, 207], [1160, 207]);
    // File, and its button.
    std::thread::sleep(Duration::from_millis(500));
    desktop.click([1036, 357]);
    std::thread::sleep(Duration::from_millis(500));
    desktop.click([1185, 440]);
    std::thread::sleep(Duration::from_millis(500));
    let command = desktop.clipboard();
    println!("{command}");
    for part in ["vitrum render ", "--samples=2", "camera={position=[", "material.glass.ior=", "environment.rotation="]
    {
        assert!(command.contains(part), "{part} is not in {command}");
    }
    let program = env!("CARGO_BIN_EXE_vitrum");
    let command = command.replacen("vitrum", program, 1);
    let status = Command::new("sh").args(["-c", &command]).current_dir(&folder).status().expect("a shell");
    assert!(status.success(), "{command}");
    shows(&desktop, &folder.path().join("vitrum.png"), &command);
    desktop.close();
}

/// Built without debug assertions the viewer cannot be made to lose its device.
#[test]
fn a_lost_device_is_replaced_and_one_that_stays_lost_ends_it() {
    if Validated::open().is_none() || !cfg!(debug_assertions) {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let red = render(folder.path(), "red", "--reflection-red 1");
    let arguments = ["--validation", "-v", "--samples", "2"];
    let Some(desktop) = Desktop::open_with(SIZE, &arguments, &[("VITRUM_LOSE_DEVICE", "2x4")]) else { return };
    std::thread::sleep(Duration::from_secs(3));
    // What was set before stays, and the panels are where they were.
    desktop.drag([109, 213], [240, 213]);
    for step in 0..10 {
        desktop.event(Desktop::MOVE, 0, [400 + 10 * step, 400]);
    }
    shows(&desktop, &red, "after two losses");
    desktop.close();

    let Some(mut desktop) = Desktop::open_with(SIZE, &[], &[("VITRUM_LOSE_DEVICE", "9x1")]) else { return };
    let start = Instant::now();
    let status = loop {
        if let Some(status) = desktop.viewer.try_wait().expect("a state") {
            break status;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "it goes on");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(status.code(), Some(3));
}

/// A scene that is written anew is shown anew; one that is broken leaves the picture.
#[test]
fn a_file_that_changes_is_shown_anew() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    let mesh = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/prism.obj");
    let text = |ior: &str| {
        let [kind, mesh] = ["dielectric".to_owned(), mesh.display().to_string()].map(|text| format!("{text:?}"));
        format!("[material.glass]\nkind = {kind}\nior = {ior}\n[[object]]\nmesh = {mesh}\nmaterial = \"glass\"\n")
    };
    std::fs::write(&scene, text("1.5")).expect("a scene");
    let name = scene.display().to_string();
    let first = render(folder.path(), "first", &name);
    let second = render(folder.path(), "second", &format!("{name} --ior 1.8"));
    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2", &name]) else { return };
    shows(&desktop, &first, "the scene");
    std::fs::write(&scene, text("1.8")).expect("a scene");
    shows(&desktop, &second, "the scene as it is now");
    std::fs::write(&scene, text("a lot")).expect("a scene");
    std::thread::sleep(Duration::from_secs(1));
    shows(&desktop, &second, "a broken scene");
    std::fs::write(&scene, text("1.5")).expect("a scene");
    shows(&desktop, &first, "mended");
    // Dropped files do the same.
    desktop.drop_file(&folder.path().join("missing.toml"));
    std::thread::sleep(Duration::from_secs(1));
    shows(&desktop, &first, "a file that is not there");
    let diamond = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/diamond.obj");
    desktop.drop_file(&diamond);
    shows(&desktop, &render(folder.path(), "diamond", &diamond.display().to_string()), "a dropped mesh");
    desktop.close();
}

/// A picture that takes minutes is shown with another exposure at once.
#[test]
fn exposure_changes_what_is_not_done_yet() {
    if Validated::open().is_none() {
        return;
    }
    let args = ["--validation", "-v", "--model", "path", "--samples", "65536"];
    let Some(desktop) = Desktop::open(SIZE, &args) else { return };
    let brightness = || {
        let [columns, rows] = CLEAR;
        let shown = desktop.screenshot();
        let places = rows.flat_map(|row| columns.clone().map(move |column| row * usize::from(SIZE[0]) + column));
        places.map(|place| u64::from(shown[place][1])).sum::<u64>() / (CLEAR[0].len() * CLEAR[1].len()) as u64
    };
    let waits = |done: &dyn Fn(u64) -> bool, what: &str| {
        let start = Instant::now();
        while !done(brightness()) {
            assert!(start.elapsed() < Duration::from_secs(30), "{what}");
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    waits(&|brightness| brightness > 40, "there is a picture");
    // Some stand-ins later.
    std::thread::sleep(Duration::from_secs(4));
    let before = brightness();
    // A machine that is busy may see the button go down and up at once, which drags nothing: once more then.
    let dragged = Cell::new(None::<Instant>);
    let is_brighter = |now: u64| {
        if dragged.get().is_none_or(|at| at.elapsed() > Duration::from_secs(8)) {
            desktop.drag([1138, 144], [1160, 144]);
            dragged.set(Some(Instant::now()));
        }
        now > before + 40
    };
    waits(&is_brighter, "a brighter one");
    desktop.close();
}

/// A key with Ctrl is not that key.
#[test]
fn ctrl_q_closes_and_ctrl_w_does_not_fly() {
    if Validated::open().is_none() {
        return;
    }
    const CTRL: u8 = 37;
    const Q: u8 = 24;
    const W: u8 = 25;
    let folder = tempfile::tempdir().expect("a folder");
    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    let plain = render(folder.path(), "plain", "");
    shows(&desktop, &plain, "the built-in scene");
    desktop.focus();
    for key in [W, Q] {
        for (kind, key) in [(2, CTRL), (2, key), (3, key), (3, CTRL)] {
            desktop.event(kind, key, [0, 0]);
        }
        if key == W {
            std::thread::sleep(Duration::from_millis(500));
            shows(&desktop, &plain, "Ctrl+W");
        }
    }
    desktop.ends();
}

/// Whatever happens: no message, no crash, and no more memory. `VITRUM_EVENTS` says how many events there are.
#[test]
fn random_events_do_no_harm() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("a file");
        path
    };
    let files = [
        file("good.obj", include_bytes!("../assets/meshes/prism.obj")),
        file("broken.obj", b"v 0 0 0\nf 1 2 3\n"),
        file("broken.toml", b"[environment]\ncolour = 1\n"),
        file("text.txt", b"no scene"),
        file("broken.png", b"no picture"),
        folder.path().join("missing.toml"),
    ];
    let events: u32 = std::env::var("VITRUM_EVENTS").ok().and_then(|count| count.parse().ok()).unwrap_or(800);
    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    std::thread::sleep(Duration::from_secs(3));
    let mut random = fastrand::Rng::with_seed(11);
    // In the panels one time of two.
    let aim = |random: &mut fastrand::Rng| match random.u8(..4) {
        0 => [random.i16(10..260), random.i16(10..330)],
        1 => [random.i16(1020..1270), random.i16(10..500)],
        _ => [random.i16(0..1280), random.i16(0..720)],
    };
    let mut memory = Vec::new();
    for number in 0..events {
        match random.u32(..100) {
            0 => desktop.resize([random.u16(1..1400), random.u16(1..900)]),
            1 => desktop.resize(SIZE),
            2 => {
                desktop.show(false);
                std::thread::sleep(Duration::from_millis(30));
                desktop.show(true);
            }
            3 => desktop.drop_file(&files[random.usize(..files.len())]),
            4 => {
                desktop.focus();
                // W, S, F, Home and digits.
                let keys = [25, 39, 41, 110, 10, 11];
                let key = keys[random.usize(..keys.len())];
                desktop.quick_event(2, key, [0, 0]);
                desktop.quick_event(3, key, [0, 0]);
            }
            5..15 => desktop.quick_event(if random.bool() { Desktop::DOWN } else { Desktop::UP }, 4, [0, 0]),
            15..55 => {
                desktop.quick_event(Desktop::MOVE, 0, aim(&mut random));
                desktop.quick_event(Desktop::DOWN, 1, [0, 0]);
                desktop.quick_event(Desktop::UP, 1, [0, 0]);
            }
            55..80 => {
                desktop.quick_event(Desktop::MOVE, 0, aim(&mut random));
                desktop.quick_event(Desktop::DOWN, 1 + random.u8(..3), [0, 0]);
                desktop.quick_event(Desktop::MOVE, 0, aim(&mut random));
                for button in 1..4 {
                    desktop.quick_event(Desktop::UP, button, [0, 0]);
                }
            }
            _ => desktop.quick_event(Desktop::MOVE, 0, aim(&mut random)),
        }
        if number % 100 == 99 {
            memory.push(desktop.memory() >> 20);
        }
    }
    println!("MiB after each 100 events: {memory:?}");
    // After the first thousand.
    if memory.len() >= 30 {
        let median = |values: &[u64]| {
            let mut values = values.to_vec();
            values.sort_unstable();
            values[values.len() / 2]
        };
        let (before, after) = memory[10..].split_at((memory.len() - 10) / 2);
        assert!(median(after) <= median(before) + 16, "{memory:?}");
    }
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
