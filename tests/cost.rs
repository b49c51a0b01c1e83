//! `vitrum cost` from outside: what it writes, what it finds, what a second run has already.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use common::Validated;

fn cost(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vitrum")).arg("cost").args(args).current_dir(folder).output().expect("it starts")
}

fn report(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("report/cost.json")).expect("a report");
    serde_json::from_str(&text).expect("JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A tetrahedron of glass in white light with a stripe.
fn write_scene(folder: &Path, color: &str) {
    fs::write(
        folder.join("body.obj"),
        "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n",
    )
    .expect("a mesh");
    let scene = format!(
        "[environment]\ncolor = {color}\n[camera]\nposition = [0.3, 0.6, 5]\ntarget = [0, 0, 0]\n\
         [material.glass]\nkind = \"dielectric\"\nroughness = 0.0\nattenuation_color = [0.2, 0.9, 0.5]\n\
         attenuation_distance = 1.0\n[[object]]\nmesh = \"body.obj\"\nmaterial = \"glass\"\n"
    );
    fs::write(folder.join("scene.toml"), scene).expect("a scene");
}

const SMALL: [&str; 7] = ["scene.toml", "-o", "report", "--size", "32x24", "--reference-time", "1"];

#[test]
fn models_are_in_the_order_that_they_should_be_in() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write_scene(folder, "[1, 1, 1]");
    let output = cost(folder, &SMALL);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(table.contains("single, 1 sample") && table.contains("absorption"), "{table}");

    let first = report(folder);
    assert_eq!(first["schema"], 1);
    assert_eq!(first["size"], serde_json::json!([32, 24]));
    assert_eq!(first["reference"]["resumed"], 0);
    let error = |options: &str| {
        let entries = first["entries"].as_array().expect("entries");
        let entry = entries.iter().find(|entry| entry["options"] == options).unwrap_or_else(|| panic!("{options}"));
        for file in [&entry["image"], &entry["map"]] {
            assert!(folder.join("report").join(file.as_str().expect("a name")).is_file());
        }
        number(&entry["relmse"])
    };
    // One interface absorbs nothing; of flat walls in white light the tree is the truth.
    let (single, tree) = (error("--model single --samples 16"), error("--model tree --samples 16"));
    assert!(single > 1e-2, "{single}");
    assert!(tree < 0.1 * single, "{tree} {single}");
    assert!(first["entries"].as_array().expect("entries").iter().any(|entry| entry["pareto"] == true));
    assert_eq!(first["targets"].as_array().expect("targets").len(), 4);

    let absorption = first["effects"].as_array().expect("effects").iter().find(|row| row["effect"] == "absorption");
    let absorption = absorption.expect("absorption");
    assert!(number(&absorption["relmse_without"]) > 10.0 * number(&absorption["relmse_with"]), "{absorption}");
    let page = fs::read_to_string(folder.join("report/index.html")).expect("a page");
    assert!(page.contains("<svg") && !page.contains("src=\"http") && !page.contains("href="), "needs the network");

    // Every member is in the docs; those of the device with the stats.
    let docs = include_str!("../docs/cost.md").split_once("## cost.json").expect("a section").1;
    let mut members = first.as_object().expect("an object").clone();
    for list in ["entries", "left_out", "targets", "effects", "reference"] {
        let inner = if list == "reference" { &first[list] } else { &first[list][0] };
        members.extend(inner.as_object().cloned().unwrap_or_default());
    }
    for name in members.keys() {
        assert!(docs.contains(&format!("`{name}`")), "docs/cost.md lacks {name}");
    }

    // Another run goes on from the reference of the first; that of another scene is made anew.
    assert!(cost(folder, &SMALL).status.success());
    let second = report(folder);
    assert_eq!(second["reference"]["resumed"], first["reference"]["samples"]);
    write_scene(folder, "[0.5, 1, 1]");
    assert!(cost(folder, &SMALL).status.success());
    assert_eq!(report(folder)["reference"]["resumed"], 0);
}

#[test]
fn bad_usage_ends_with_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write_scene(folder, "[1, 1, 1]");
    fs::write(folder.join("file"), "").expect("a file");
    fs::create_dir(folder.join("site")).expect("a folder");
    fs::write(folder.join("site/index.html"), "mine").expect("a page");
    for (args, expected) in [
        (&["scene.toml"][..], "-o DIR"),
        (&["none.toml", "-o", "report"], "none.toml"),
        (&["scene.toml", "-o", "report", "--reference-time", "0"], "--reference-time"),
        (&["scene.toml", "-o", "report", "--effects", "magic"], "magic"),
        (&["scene.toml", "-o", "report", "--max-depth", "8"], "32 or more"),
        (&["scene.toml", "-o", "file"], "file"),
        (&["scene.toml", "-o", "site"], "site/index.html"),
    ] {
        let output = cost(folder, args);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.contains(expected) && !folder.join("report").exists(), "{args:?}: {message}");
    }
}
