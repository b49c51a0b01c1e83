//! The program from outside: exit codes, what it says, what it writes.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::Validated;

fn vitrum(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vitrum")).args(args).current_dir(folder).output().expect("the program starts")
}

/// On a machine without a Vulkan driver.
fn without_driver(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vitrum"));
    command.args(args).current_dir(folder).env("VK_DRIVER_FILES", "/nowhere.json");
    command.env("VK_ICD_FILENAMES", "/nowhere.json").output().expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn has_device() -> bool {
    Validated::open().is_some()
}

#[test]
fn bad_usage_and_bad_input_end_with_2_one_line_and_nothing_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("a fixture");
    write("typo.toml", b"[environment]\ncolor = [1, 1, 1]\nvisibel = true\n");
    write("wrong.toml", b"[camera]\nposition = [0, 0, 1]\ntarget = \"there\"\n");
    write("range.toml", b"[material.glass]\nkind = \"dielectric\"\nroughness = 1.5\n");
    write("glass.toml", b"[material.glass]\nkind = \"dielectric\"\nior = \"bk9\"\n");
    write("open.toml", b"[environment\n");
    write("option.toml", b"[render]\nsamples = 0\n");
    write("typo2.toml", b"");
    write("model.toml", b"[render]\nmodel = \"double\"\naov = [\"discarded\"]\n");
    write("size.toml", b"[render]\nsize = [64, 48, 3]\n");
    write("missing.toml", b"[[object]]\nmesh = \"nowhere.obj\"\n");
    write("sky.toml", b"[environment]\nimage = \"broken.exr\"\n");
    write("broken.exr", b"\x76\x2f\x31\x01\x02\x00\x00\x00chan");
    write("nan.obj", b"v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    write("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    write("empty.obj", b"v 0 0 0\n");
    write("mesh.gltf", b"{}");
    fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    let before = files(folder.path());

    let cases: &[(&[&str], &[&str])] = &[
        (&["render"], &["-o OUT"]),
        (&["render", "-o", "a.jpg"], &["a.jpg", ".exr or .png"]),
        (&["render", "-o", "folder.png"], &["folder.png", "folder"]),
        (&["render", "-o", "no/a.png"], &["no", "does not exist"]),
        (&["render", "-o", "a.png", "--size", "0x10"], &["0x10", "at least 1"]),
        (&["render", "-o", "a.png", "--size", "big"], &["big", "WIDTHxHEIGHT"]),
        (&["render", "-o", "a.png", "--samples", "0"], &["1 to 16777216"]),
        (&["render", "-o", "a.png", "--ior", "-1"], &["-1", "above 0"]),
        (&["render", "-o", "a.png", "--roughness", "nan"], &["nan", "0 to 1"]),
        (&["render", "-o", "a.png", "--model", "magic"], &["magic", "single"]),
        (&["render", "-o", "a.exr", "--model", "double", "--aov", "discarded"], &["discarded", "interfaces, stderr"]),
        (&["render", "-o", "a.png", "--effects", "magic"], &["magic", "direct-light"]),
        (&["render", "-o", "a.png", "--seed", "-1"], &["-1", "whole number"]),
        (&["render", "-o", "sky.toml", "sky.toml"], &["sky.toml", ".exr or .png"]),
        (&["render", "-o", "a.png", "--stats", "a.png"], &["a.png", "two files"]),
        (&["render", "-o", "a.png", "typo2.toml", "--stats", "typo2.toml"], &["typo2.toml", "replaced"]),
        (&["render", "-o", "a.exr", "model.toml"], &["model.toml", "double"]),
        (&["render", "-o", "a.png", "size.toml"], &["size.toml:2", "width and height"]),
        (&["render", "-o", "a.png", "."], &["folder"]),
        (&["render", "-o", "a.png", "--aov", "depth"], &["--aov", ".exr"]),
        (&["render", "-o", "a.exr", "--aov", "stderr"], &["stderr", "normal, depth, object"]),
        (&["render", "-o", "a.png", "--tolerance", "0.1"], &["--tolerance", "--samples"]),
        (&["render", "-o", "a.png", "--bogus"], &["--bogus", "--help"]),
        (&["paint"], &["paint"]),
        (&["render", "-o", "a.png", "none.toml"], &["none.toml"]),
        (&["render", "-o", "a.png", "typo.toml"], &["typo.toml:3", "visibel", "visible"]),
        (&["render", "-o", "a.png", "wrong.toml"], &["wrong.toml:3"]),
        (&["render", "-o", "a.png", "range.toml"], &["range.toml:3", "1.5"]),
        (&["render", "-o", "a.png", "glass.toml"], &["glass.toml:3", "bk9", "bk7"]),
        (&["render", "-o", "a.png", "open.toml"], &["open.toml:1"]),
        (&["render", "-o", "a.png", "option.toml"], &["option.toml:2", "1 to 16777216"]),
        (&["render", "-o", "a.png", "missing.toml"], &["missing.toml:2", "nowhere.obj"]),
        (&["render", "-o", "a.png", "sky.toml"], &["broken.exr"]),
        (&["render", "-o", "a.png", "nan.obj"], &["nan.obj"]),
        (&["render", "-o", "a.png", "range.obj"], &["range.obj"]),
        (&["render", "-o", "a.png", "empty.obj"], &["empty.obj", "no triangles"]),
        (&["render", "-o", "a.png", "mesh.gltf"], &["mesh.gltf", "glTF"]),
        (&["render", "-o", "a.png", "--env", "broken.exr"], &["broken.exr"]),
    ];
    for (args, wanted) in cases {
        let output = vitrum(folder.path(), args);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        let mut lines = text.lines();
        assert!(lines.next().is_some_and(|line| line.starts_with("error: ")), "{args:?}: {text}");
        assert!(lines.all(|line| line.starts_with("Caused by: ")), "{args:?}: {text}");
        for part in *wanted {
            assert!(text.contains(part), "{args:?} does not name {part:?}: {text}");
        }
        assert_eq!(files(folder.path()), before, "{args:?} left something behind");
    }
}

#[test]
fn without_a_driver_it_ends_with_3() {
    let folder = tempfile::tempdir().expect("a folder");
    for args in [&["devices"][..], &["render", "-o", "a.png"]] {
        let output = without_driver(folder.path(), args);
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        assert!(stderr(&output).contains("ci/setup.sh"), "{}", stderr(&output));
        assert!(files(folder.path()).is_empty());
    }
}

#[test]
fn explain_needs_no_driver_and_tells_people_and_programs() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("typo.toml"), "[environment]\nvisibel = true\n").expect("a scene");
    fs::write(folder.path().join("own.toml"), "[render]\neffects = \"shadows\"\n").expect("a scene");
    let explain = |args: &[&str]| {
        let output = without_driver(folder.path(), &[&["explain"], args].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output))
    };
    let (code, text, errors) = explain(&[]);
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    assert!(text.starts_with("built-in: 4 objects, "), "{text}");
    assert!(include_str!("../docs/explain.md").contains(&text), "docs/explain.md shows this: {text}");

    let (code, text, errors) = explain(&["--json", "--roughness", "0.3", "--effects", "-nesting"]);
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&json["schema"], &json["scene"]["name"]), (&1.into(), &"built-in".into()));
    assert_eq!(json["models"][2]["leaves_out"], serde_json::json!(["roughness", "energy-compensation"]));

    let (code, text, _) = explain(&["own.toml"]);
    assert_eq!(code, Some(0));
    assert!(text.contains("wanted all the same\n  shadows "), "the scene's own options count: {text}");

    // A corner that is two: what ails it, and what is left of that once it is repaired.
    let cracked = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 7e-7\nf 1 3 5\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(folder.path().join("cracked.obj"), cracked).expect("a mesh");
    let (_, text, _) = explain(&["cracked.obj"]);
    assert!(text.contains("\nWhat ails objects\n  object 1, cracked.obj\n    4 open edges, the first at ("), "{text}");
    let (_, text, _) = explain(&["cracked.obj", "--repair"]);
    assert!(!text.contains("What ails") && text.contains("1 vertex welded; closed now"), "{text}");

    for (args, wanted) in [(["--json", "typo.toml"], "typo.toml:2"), (["--effects", "magic"], "magic")] {
        let (code, text, errors) = explain(&args);
        assert_eq!((code, text.as_str()), (Some(2), ""), "{errors}");
        assert!(errors.starts_with("error: ") && errors.contains(wanted), "{errors}");
    }
    assert_eq!(files(folder.path()), ["cracked.obj", "own.toml", "typo.toml"], "nothing is written");
}

#[test]
fn unknown_devices_and_sizes_beyond_the_device_are_named() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for (option, value, wanted) in [("--device", "abacus", "abacus"), ("--size", "100000x100000", "100000x100000")] {
        let output = vitrum(folder.path(), &["render", "-q", "-o", "a.png", option, value]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(wanted), "{}", stderr(&output));
    }
    assert!(files(folder.path()).is_empty());
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.png", "a.exr"] {
        let args = ["render", "-q", "-o", name, "--size", "96x64", "--samples", "4", "--seed", "5"];
        let mut bytes = Vec::new();
        for _ in 0..2 {
            let output = vitrum(folder.path(), &args);
            assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
            assert!(output.stdout.is_empty() && output.stderr.is_empty(), "quiet is quiet: {}", stderr(&output));
            bytes.push(fs::read(folder.path().join(name)).expect("the image"));
        }
        assert!(bytes[0] == bytes[1], "{name} differs from run to run");
    }
}

#[test]
fn a_run_under_validation_is_clean_and_its_stats_are_complete() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["render", "-o", "a.exr", "--size", "64x48", "--samples", "3", "--aov", "normal,depth,object"];
    let output = vitrum(folder.path(), &[&args[..], &["--validation", "--stats", "a.json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("note: model single does not simulate"), "{}", stderr(&output));
    let text = fs::read_to_string(folder.path().join("a.json")).expect("stats");
    let stats: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for (member, expected) in [
        ("schema", serde_json::json!(1)),
        ("scene", serde_json::json!("built-in")),
        ("model", serde_json::json!("single")),
        ("size", serde_json::json!([64, 48])),
        ("samples", serde_json::json!(3)),
        ("max_depth", serde_json::json!(null)),
        ("effects", serde_json::json!(["reflection", "transmission"])),
        ("unsupported", serde_json::json!(["interior", "nesting"])),
        ("trace", serde_json::json!("none")),
        ("rays", serde_json::json!(null)),
        ("discarded", serde_json::json!(null)),
        ("stderr", serde_json::json!(null)),
        ("non_finite_pixels", serde_json::json!(0)),
        ("validation_messages", serde_json::json!(0)),
    ] {
        assert_eq!(stats.get(member), Some(&expected), "{member}");
    }
    let passes: Vec<_> = stats["passes"].as_array().expect("passes").iter().map(|pass| &pass["name"]).collect();
    assert_eq!(passes, ["single", "environment", "accumulate", "display", "aov"]);
    assert!(stats["wall_ms"].as_f64() > Some(0.0) && stats["peak_gpu_bytes"].as_u64() > Some(0));

    let bytes = fs::read(folder.path().join("a.exr")).expect("the image");
    let text = String::from_utf8_lossy(&bytes[..4096]);
    for part in ["normal.X", "depth.Z", "object.ID", "vitrum:device", "vitrum:options", "--samples=3"] {
        assert!(text.contains(part), "the EXR's header lacks {part}");
    }
}

/// Paths that neither EXR's text nor a terminal's line can hold as they are.
#[test]
fn unusual_names_are_no_reason_to_fail() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["模型.toml", "two\nlines.toml"] {
        fs::write(folder.path().join(name), "[render]\nsize = [8, 8]\naov = [\"depth\"]\nvalidation = true\n")
            .expect("a scene");
        let output = vitrum(folder.path(), &["render", name, "-o", "a.exr"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let output = vitrum(folder.path(), &["render", "no\nscene.toml", "-o", "a.exr"]);
    assert_eq!(stderr(&output).lines().count(), 2, "{}", stderr(&output));
}

#[test]
fn an_image_says_how_it_was_made() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let args =
        ["render", "-q", "-o", "a.exr", "--size", "8x8", "--ior", "1.33", "--roughness", "0.2", "--aov", "depth"];
    assert_eq!(vitrum(folder.path(), &args).status.code(), Some(0));
    let bytes = fs::read(folder.path().join("a.exr")).expect("the image");
    let text = String::from_utf8_lossy(&bytes);
    for part in ["--ior=1.33", "--roughness=0.2", "--aov=depth", "--size=8x8", "--samples=16", "--effects=auto"] {
        assert!(text.contains(part), "the header lacks {part}");
    }
}

/// The old file stays whole when a run fails after it began.
#[test]
fn a_failed_run_leaves_the_old_image() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.png"), b"old").expect("a file");
    for args in [["--size", "100000x100000"], ["--device", "abacus"], ["--env", "none.exr"]] {
        let output = vitrum(folder.path(), &[&["render", "-o", "a.png"][..], &args].concat());
        assert_ne!(output.status.code(), Some(0));
        assert_eq!(fs::read(folder.path().join("a.png")).expect("the file"), b"old");
        assert_eq!(files(folder.path()), ["a.png"]);
    }
}

#[test]
fn the_scenes_own_options_count_and_the_command_line_wins() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = "[environment]\ncolor = [0.5, 0.5, 0.5]\n[render]\nsize = [20, 10]\nsamples = 2\ntonemap = \"none\"\n";
    fs::write(folder.path().join("grey.toml"), scene).expect("a scene");
    let args = ["render", "-q", "grey.toml", "-o", "a.png", "--size", "30x15", "--stats", "a.json"];
    let output = vitrum(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let image = image::open(folder.path().join("a.png")).expect("an image").to_rgb8();
    assert_eq!(image.dimensions(), (30, 15));
    // 0.5 in sRGB.
    assert!(image.pixels().all(|pixel| pixel.0 == [188; 3]), "{:?}", image.get_pixel(0, 0));
    let stats = fs::read_to_string(folder.path().join("a.json")).expect("stats");
    assert!(stats.contains("\"samples\": 2"));
}

#[test]
fn devices_are_listed_for_people_and_for_programs() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let table = vitrum(folder.path(), &["devices"]);
    let listed = vitrum(folder.path(), &["render", "--device", "list"]);
    assert_eq!(table.status.code(), Some(0));
    assert!(table.stdout.starts_with(b"index") && table.stdout == listed.stdout);
    let json = vitrum(folder.path(), &["devices", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(json["schema"], 1);
    assert!(json["devices"].as_array().is_some_and(|devices| !devices.is_empty()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_stderr_is_no_reason_to_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
    for (args, code) in [(&["render"][..], 2), (&["render", "-o", "a.png", "--size", "8x8", "--samples", "1"], 0)] {
        if code == 0 && !has_device() {
            continue;
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_vitrum"));
        let status = command.args(args).current_dir(folder.path()).stderr(full()).status().expect("the program starts");
        assert_eq!(status.code(), Some(code));
    }
}
