//! `--model auto` from outside: what it chooses, what it expects, what it says.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use common::Validated;
use vitrum::image::decode;

fn vitrum(folder: &Path, args: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vitrum"));
    command.args(args.split_whitespace()).current_dir(folder).output().expect("it starts")
}

/// The stats of a render of 48x36 pixels with `args`, which succeeds.
fn rendered(folder: &Path, args: &str) -> Value {
    let output = vitrum(folder, &format!("render {args} --model auto --size 48x36 --validation --stats stats.json"));
    assert!(output.status.success(), "{args}: {}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(folder.join("stats.json")).expect("stats");
    serde_json::from_str(&text).expect("JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is a number"))
}

fn pixels(path: &Path) -> Vec<[f32; 3]> {
    decode(path, &fs::read(path).expect("an image")).expect("an image").pixels
}

/// A tetrahedron of glass in a coloured cloud of light, which is cheap to sample.
fn write_scenes(folder: &Path) {
    let body = "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
    fs::write(folder.join("body.obj"), body).expect("a mesh");
    let scene = |roughness: f64, more: &str| {
        format!(
            "[environment]\ncolor = [1, 0.8, 0.5]\n[camera]\nposition = [0.3, 0.6, 5]\ntarget = [0, 0, 0]\n\
             [material.glass]\nkind = \"dielectric\"\nroughness = {roughness}\nattenuation_color = [0.2, 0.9, 0.5]\n\
             attenuation_distance = 1.0\n[[object]]\nmesh = \"body.obj\"\nmaterial = \"glass\"\n{more}"
        )
    };
    fs::write(folder.join("smooth.toml"), scene(0.0, "")).expect("a scene");
    fs::write(folder.join("rough.toml"), scene(0.4, "")).expect("a scene");
    let light = "[[light]]\nkind = \"point\"\nposition = [2, 2, 2]\nintensity = [9, 9, 9]\n";
    fs::write(folder.join("lit.toml"), scene(0.0, light)).expect("a scene");
}

#[test]
fn the_model_is_one_that_can_and_keeps_the_tolerance() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write_scenes(folder);
    for scene in ["smooth", "rough"] {
        let stats = rendered(folder, &format!("{scene}.toml -o {scene}.exr --tolerance 0.02"));
        let (auto, model) = (&stats["auto"], stats["model"].as_str().expect("a name"));
        assert!(number(&auto["expected"]["error"]) <= 0.02 && number(&auto["tolerance"]) == 0.02, "{auto}");
        assert!(auto["options"].as_str().is_some_and(|options| options.contains(model)), "{auto}");
        assert_eq!(auto["found"]["samples"], stats["samples"]);
        if scene == "rough" {
            assert_eq!(model, "path");
            assert!(number(&auto["found"]["error"]) <= 0.02, "{auto}");
        }
        // What else there was takes longer, or is further off.
        let mut others = auto["others"].as_array().expect("others").iter();
        assert!(others.all(|other| {
            number(&other["error"]) > 0.02 || number(&other["gpu_ms"]) >= number(&auto["expected"]["gpu_ms"])
        }));
        // Against the model that is without bias, another seed.
        let truth = format!("render {scene}.toml -o truth.exr --size 48x36 --model path --tolerance 0.01 --seed 5");
        assert!(vitrum(folder, &truth).status.success());
        let [found, truth] = [format!("{scene}.exr"), "truth.exr".into()].map(|name| pixels(&folder.join(name)));
        let pairs = found.iter().flatten().zip(truth.iter().flatten());
        let close = pairs.filter(|&(&x, &r)| (x - r).abs() < 0.02 * (r + 0.1) * 1.2).count();
        assert!(close as f64 >= 0.94 * 3.0 * found.len() as f64, "{scene}: {close} of {}", 3 * found.len());
    }
}

#[test]
fn options_that_belong_to_one_model_choose_it() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write_scenes(folder);
    for (args, model) in [
        ("smooth.toml -o a.exr --aov discarded,stderr --tolerance 0.2", "path"),
        ("smooth.toml -o a.exr --checkpoint state --tolerance 0.2", "path"),
        // There is no time to try: what simulates everything, and of those that do not the one that lacks least.
        ("smooth.toml -o a.exr --time-budget 0.5", "tree"),
        ("rough.toml -o a.exr --time-budget 0.5", "path"),
        // What paths cannot see is no truth.
        ("lit.toml -o a.exr --tolerance 0.2", "tree"),
    ] {
        let stats = rendered(folder, args);
        assert_eq!(stats["model"], model, "{args}: {}", stats["auto"]);
        assert_eq!(stats["auto"]["expected"].is_null(), args.contains("0.5"), "{args}");
    }
    // A scene may ask for it, too.
    let scene = fs::read_to_string(folder.join("smooth.toml")).expect("a scene") + "[render]\nmodel = \"auto\"\n";
    fs::write(folder.join("auto.toml"), scene).expect("a scene");
    let output = vitrum(folder, "render auto.toml -o c.png --size 48x36");
    assert!(String::from_utf8_lossy(&output.stderr).contains("--model auto"), "{output:?}");
}

#[test]
fn the_plan_is_explained() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write_scenes(folder);
    let output = vitrum(folder, "explain rough.toml --tolerance 0.05 --size 48x36");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("\nPlan for --tolerance 0.05, 48x36 on") && text.contains("\n* --model=path"), "{text}");
    let output = vitrum(folder, "explain rough.toml --time-budget 60 --size 48x36 --json");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&json["plan"]["time_budget"], &json["plan"]["size"][0]), (&60.0.into(), &48.into()));
    let output = vitrum(folder, "explain rough.toml --json");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(json["plan"].is_null());
}
