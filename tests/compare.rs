//! `vitrum compare` from outside: exit codes, what it says, what it writes.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};
use tempfile::TempDir;

use vitrum::image::{FloatImage, decode_stored, encode_exr, encode_png};

fn vitrum(folder: &TempDir, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vitrum")).args(args).current_dir(folder).output().expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn exr(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 3]) -> Vec<u8> {
    let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
    encode_exr(&FloatImage { width, height, pixels, layers: Vec::new() }, &[]).expect("an EXR")
}

fn png(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let pixels: Vec<_> = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
    encode_png(width, height, &pixels, &[]).expect("a PNG")
}

/// A folder with images: float and 8 bits, good and bad.
fn images() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: Vec<u8>| fs::write(folder.path().join(name), bytes).expect("a fixture");
    let slope = |x: u32, y: u32| [x as f32 / 16.0, y as f32 / 12.0, 0.5];
    write("a.exr", exr(16, 12, |x, y| if (x, y) == (5, 3) { [1.5, 0.25, 0.5] } else { slope(x, y) }));
    write("b.exr", exr(16, 12, slope));
    write("nan.exr", exr(16, 12, |x, y| if (x, y) == (5, 3) { [0.5, f32::NAN, 0.5] } else { slope(x, y) }));
    write("a.png", png(16, 12, |x, y| [16 * x as u8, 20 * y as u8, 100]));
    write("b.png", png(16, 12, |x, y| [16 * x as u8, 20 * y as u8, 128]));
    write("wide.png", png(12, 16, |_, _| [0; 3]));
    write("cut.png", png(16, 12, |x, y| [x as u8, y as u8, 9])[..60].to_vec());
    write("text.exr", b"hello".to_vec());
    folder
}

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn bad_usage_and_bad_input_end_with_2_one_line_and_nothing_written() {
    let folder = images();
    fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    let before = files(folder.path());
    let cases: &[(&[&str], &[&str])] = &[
        (&["a.exr"], &["<B>"]),
        (&["a.exr", "none.exr"], &["none.exr: cannot read", "Caused by: "]),
        (&["none.exr", "a.exr"], &["none.exr: cannot read"]),
        (&["a.exr", "."], &[".: is a folder; name a file"]),
        (&["a.exr", "text.exr"], &["text.exr: cannot be read as OpenEXR"]),
        (&["cut.png", "a.png"], &["cut.png: cannot be read as PNG"]),
        (&["a.png", "wide.png"], &["a.png: is 16x12, not 12x16", "wide.png"]),
        (&["a.exr", "wide.png", "--map", "m.png"], &["16x12", "12x16"]),
        (&["a.exr", "b.exr", "--fail-above", "flip"], &["METRIC=VALUE", "relmse, mse, p99, max, flip"]),
        (&["a.exr", "b.exr", "--fail-above", "ssim=1"], &["ssim", "relmse, mse, p99, max, flip"]),
        (&["a.exr", "b.exr", "--fail-above", "mse=low"], &["low", "number"]),
        (&["a.exr", "b.exr", "--fail-above", "mse=nan"], &["nan", "number"]),
        (&["a.exr", "b.exr", "--fail-above", "psnr=40"], &["psnr", "mse"]),
        (&["a.exr", "b.exr", "--map", "m.exr"], &["m.exr", ".png"]),
        (&["a.exr", "b.exr", "--map", "no/m.png"], &["no", "does not exist"]),
        (&["a.exr", "b.exr", "--map", "folder.png"], &["folder.png", "is a folder"]),
        (&["a.png", "b.png", "--map", "a.png"], &["a.png", "replaced"]),
        (&["a.png", "b.png", "--map", "./b.png"], &["./b.png", "replaced"]),
    ];
    for (args, wanted) in cases {
        let output = vitrum(&folder, &[&["compare"], *args].concat());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        let mut lines = text.lines();
        assert!(lines.next().is_some_and(|line| line.starts_with("error: ")), "{args:?}: {text}");
        assert!(lines.all(|line| line.starts_with("Caused by: ")), "{args:?}: {text}");
        for part in *wanted {
            assert!(text.contains(part), "{args:?} does not name {part:?}: {text}");
        }
        assert_eq!(stdout(&output), "", "{args:?}");
        assert_eq!(files(folder.path()), before, "{args:?} left something behind");
    }
}

#[test]
fn the_table_names_metrics_and_kinds_of_flip() {
    let folder = images();
    let output = vitrum(&folder, &["compare", "a.exr", "b.exr"]);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let text = stdout(&output);
    let names: Vec<_> = text.lines().map(|line| line.split_whitespace().next().unwrap_or_default()).collect();
    assert_eq!(names, ["relmse", "mse", "psnr", "p99", "max", "flip"], "{text}");
    assert!(text.contains("1.1875e0  at 5,3") && text.contains("HDR-FLIP, 2 exposures from "), "{text}");
    let text = stdout(&vitrum(&folder, &["compare", "a.png", "b.png"]));
    assert!(text.contains("LDR-FLIP"), "{text}");
    let text = stdout(&vitrum(&folder, &["compare", "a.png", "b.exr"]));
    assert!(text.contains("HDR-FLIP"), "{text}");
    assert_eq!(stdout(&vitrum(&folder, &["compare", "-q", "a.png", "b.png"])), "");
}

#[test]
fn json_holds_the_numbers() {
    let folder = images();
    let found = json_of(&vitrum(&folder, &["compare", "--json", "-q", "a.exr", "b.exr"]));
    for (member, value) in [
        ("schema", json!(1)),
        ("vitrum", json!(env!("CARGO_PKG_VERSION"))),
        ("test", json!("a.exr")),
        ("reference", json!("b.exr")),
        ("size", json!([16, 12])),
        ("max_at", json!([5, 3])),
        ("flip_kind", json!("hdr")),
        ("non_finite", json!({ "test": 0, "reference": 0 })),
    ] {
        assert_eq!(found[member], value, "{member}");
    }
    let metric = |name: &str| found["metrics"][name].as_f64().expect(name);
    let square = 1.1875 * 1.1875;
    assert!((metric("mse") - square / 576.0).abs() < 1e-12, "{found}");
    assert!((metric("relmse") - square / (0.3125 * 0.3125 + 0.01) / 576.0).abs() < 1e-12, "{found}");
    assert!((metric("psnr") - 10.0 * (576.0f64 / square).log10()).abs() < 1e-9, "{found}");
    assert!(metric("max") == 1.1875 && metric("flip") > 0.0, "{found}");
    assert_eq!(found["exposures"]["count"], 2, "{found}");
    assert!(found["exposures"]["start"].as_f64() < found["exposures"]["stop"].as_f64(), "{found}");

    let found = json_of(&vitrum(&folder, &["compare", "--json", "a.png", "a.png"]));
    let none = json!({ "relmse": 0.0, "mse": 0.0, "psnr": null, "p99": 0.0, "max": 0.0, "flip": 0.0 });
    assert_eq!((&found["metrics"], &found["flip_kind"]), (&none, &json!("ldr")));
    assert_eq!(found["exposures"], Value::Null);
}

#[test]
fn limits_decide_the_exit_code() {
    let folder = images();
    let compare = |args: &[&str]| vitrum(&folder, &[&["compare", "a.exr", "b.exr"], args].concat());
    let good = compare(&["--fail-above", "max=1.1875", "--fail-above", "mse=0.1", "--fail-above=flip=1"]);
    assert_eq!((good.status.code(), stderr(&good).as_str()), (Some(0), ""));
    let bad = compare(&["--fail-above", "max=1", "--fail-above", "flip=1", "--fail-above", "mse=1e-3"]);
    assert_eq!(bad.status.code(), Some(1));
    assert_eq!(stderr(&bad), "error: a.exr: max is 1.1875e0, limit 1; mse is 2.4482e-3, limit 0.001\n");
    // What was found is told nevertheless.
    assert!(stdout(&bad).starts_with("relmse"), "{}", stdout(&bad));
    assert_eq!(compare(&["--fail-above", "relmse=0"]).status.code(), Some(1));
    assert_eq!(vitrum(&folder, &["compare", "b.exr", "b.exr", "--fail-above", "relmse=0"]).status.code(), Some(0));
}

#[test]
fn pixels_that_are_not_finite_pass_no_limit() {
    let folder = images();
    for (test, reference, counts) in [("nan.exr", "b.exr", [1, 0]), ("b.exr", "nan.exr", [0, 1])] {
        let found = json_of(&vitrum(&folder, &["compare", "--json", test, reference]));
        assert_eq!(found["non_finite"], json!({ "test": counts[0], "reference": counts[1] }));
        assert_eq!(found["max_at"], json!([5, 3]));
        for metric in ["relmse", "mse", "psnr", "p99", "max", "flip"] {
            assert_eq!(found["metrics"][metric], Value::Null, "{metric}");
        }
        for limit in ["relmse=1e9", "mse=1e9", "max=1e9", "flip=1e9"] {
            let output = vitrum(&folder, &["compare", test, reference, "--fail-above", limit]);
            assert_eq!(output.status.code(), Some(1), "{limit}");
            assert!(stderr(&output).contains("not finite"), "{}", stderr(&output));
            assert!(stdout(&output).contains("the first at 5,3"), "{}", stdout(&output));
        }
    }
}

#[test]
fn the_map_shows_where_the_error_is() {
    let folder = images();
    let path = folder.path().join("map.png");
    let map = || match decode_stored(&path, &fs::read(&path).expect("a map")).expect("a PNG") {
        vitrum::image::Stored::Srgb { width: 16, height: 12, pixels } => pixels,
        other => panic!("{other:?}"),
    };
    let output = vitrum(&folder, &["compare", "b.exr", "b.exr", "--map", "map.png"]);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), "map.png: FLIP per pixel\n"));
    assert!(map().iter().all(|pixel| *pixel == [0, 0, 4]), "magma begins so");
    // Also where a check fails: that is when it is looked at.
    let output = vitrum(&folder, &["compare", "-q", "a.exr", "b.exr", "--map", "map.png", "--fail-above", "flip=0"]);
    assert_eq!(output.status.code(), Some(1));
    let light = |pixel: &[u8; 3]| pixel.iter().map(|&code| u32::from(code)).sum::<u32>();
    let pixels = map();
    let brightest = pixels.iter().map(light).max();
    let at: Vec<_> = (0..pixels.len()).filter(|&i| Some(light(&pixels[i])) == brightest).collect();
    assert_eq!(at, [3 * 16 + 5]);
    vitrum(&folder, &["compare", "-q", "nan.exr", "b.exr", "--map", "map.png"]);
    assert_eq!(map()[3 * 16 + 5], [252, 253, 191], "magma ends so");
    assert!(!files(folder.path()).iter().any(|name| name.contains("vitrum")), "{:?}", files(folder.path()));
}

#[test]
fn help_says_which_is_the_reference() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = stdout(&vitrum(&folder, &["compare", "--help"]));
    for part in ["A", "under test", "reference", "--fail-above", "--map", "--json", "relmse", "psnr", "LDR-FLIP"] {
        assert!(text.contains(part), "{part} is missing: {text}");
    }
    assert!(stdout(&vitrum(&folder, &["--help"])).contains("compare"));
}
