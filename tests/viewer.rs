//! The viewer's real window, under Xvfb: real sliders moved by synthetic input, and what the screen shows afterwards.

mod common;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use common::Validated;
use common::desktop::{Desktop, Pixels};
use vitrum::image::{Stored, decode_stored};

const SIZE: [u16; 2] = [1280, 720];

/// Where the picture is not covered by panels.
const CLEAR: [std::ops::Range<usize>; 2] = [310..960, 20..600];

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
    desktop.drag([111, 331], [240, 331]);
    shows(&desktop, red, "Refl Red");
    desktop.drag([201, 331], [20, 331]);
    shows(&desktop, plain, "Refl Red taken back");
    desktop.drag([160, 80], [60, 80]);
    shows(&desktop, gone, "Refraction Index of 1");
    desktop.close();

    let Some(desktop) = Desktop::open(SIZE, &["--validation", "-v", "--samples", "2"]) else { return };
    shows(&desktop, plain, "the built-in scene");
    desktop.drag([128, 101], [300, 101]);
    shows(&desktop, rough, "Roughness");
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
