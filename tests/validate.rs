//! `vitrum validate` from outside: what the layer is shown to notice, what it says of us on every driver there is, and what becomes of
//! a run whose driver crashes or hangs.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use common::Validated;
use vitrum::validate::{Check, Outcome, Record, Report};

const PROGRAM: &str = env!("CARGO_BIN_EXE_vitrum");

fn vitrum(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.arg("validate").args(args).current_dir(folder);
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

fn ends(mut command: Command, code: i32) -> String {
    let output = command.output().expect("it starts");
    assert_eq!(output.status.code(), Some(code), "{command:?}: {}", said(&output));
    said(&output)
}

fn report(folder: &Path) -> Report {
    let text = fs::read_to_string(folder.join("validate-report/validate.json")).expect("a report");
    serde_json::from_str(&text).expect("JSON")
}

fn check<'r>(report: &'r Report, name: &str) -> &'r Record {
    let found = report.checks().find(|(_, check)| check.name == name);
    found.unwrap_or_else(|| panic!("no check {name}")).1
}

/// The manifest of a driver that `ci/setup.sh` fetches, if it is here.
fn manifest(driver: &str) -> Option<PathBuf> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!(".native/drivers/{driver}.json"));
    if !manifest.is_file() {
        println!("{driver} is not here: ci/setup.sh fetches it");
    }
    manifest.is_file().then_some(manifest)
}

/// Drivers that keep nothing of what they compile do a part of the checks here, with `VITRUM_WHOLE_SUITE` all of them.
const PART: [&str; 9] = [
    "render/single",
    "render/double/all",
    "/plain",
    "display",
    "window",
    "lost/single",
    "memory/path",
    "without/timestamps",
    "numerics",
];

/// No message of ours, nothing left behind, every picture as it should be: the checks with one of `parts` in their names.
fn passes_on(driver: Option<&str>, parts: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = vitrum(folder.path(), &["-q"]);
    match driver.map(manifest) {
        Some(Some(manifest)) => drop(command.arg("--driver").arg(manifest).env_remove("VITRUM_DEVICE")),
        Some(None) => return,
        None => {}
    }
    let is_whole = std::env::var_os("VITRUM_WHOLE_SUITE").is_some();
    for part in parts.iter().filter(|_| !is_whole) {
        command.args(["--filter", part]);
    }
    ends(command, 0);
    let report = report(folder.path());
    assert_eq!(report.messages(), 0);
    let device = &report.devices[0];
    for fault in ["missing-barrier", "wrong-layout", "leaked-buffer", "use-after-free", "out-of-bounds-index"] {
        let check = check(&report, &format!("layer/{fault}"));
        assert_eq!(check.outcome, Outcome::Passed, "{check:?}");
        let names =
            |name: &str| check.said.iter().any(|said| said.message.is_error && said.message.text.contains(name));
        assert!(names("planted fault") || names("probe_bounds.comp"), "{check:?}");
    }
    for (_, check) in report.checks() {
        for picture in &check.pictures {
            let file = folder.path().join("validate-report").join(&device.folder).join(&picture.file);
            assert!(file.is_file(), "{}", file.display());
        }
    }
    let page = fs::read_to_string(folder.path().join("validate-report/index.html")).expect("a page");
    assert!(
        report.checks().all(|(_, check)| page.contains(&format!(">{}<", check.name))),
        "every check is on the page"
    );
    let wanted = report.checks().any(|(_, check)| check.name == "numerics");
    let numerics = folder.path().join("validate-report").join(&device.folder).join("numerics/index.html");
    assert_eq!(numerics.is_file(), wanted);
}

#[test]
fn our_device_passes() {
    if Validated::open().is_some() {
        passes_on(
            None,
            &[
                "render/single",
                "/plain",
                "/all",
                "tracers",
                "layers",
                "display",
                "checkpoint",
                "refine",
                "window",
                "lost",
                "memory",
                "without",
                "numerics",
            ],
        );
    }
}

#[test]
fn a_driver_without_ray_queries_passes() {
    passes_on(Some("lavapipe-of-release"), &PART);
}

#[test]
fn swiftshader_passes() {
    passes_on(Some("swiftshader"), &PART);
}

#[test]
fn pictures_have_the_same_hashes_again() {
    if Validated::open().is_none() {
        return;
    }
    let hashes = || {
        let folder = tempfile::tempdir().expect("a folder");
        ends(vitrum(folder.path(), &["-q", "--filter", "render/single/all", "--device", "0"]), 0);
        let report = report(folder.path());
        check(&report, "render/single/all").pictures.iter().map(|picture| picture.hash.clone()).collect::<Vec<_>>()
    };
    let first = hashes();
    assert!(first.len() == 1 && first[0].len() == 32 && first == hashes(), "{first:?}");
}

/// The processes that test devices for this one.
fn workers(of: &Child) -> Vec<u32> {
    let is_worker = |pid: &u32| {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        status.lines().any(|line| line == format!("PPid:\t{}", of.id()))
    };
    let all = fs::read_dir("/proc").expect("processes").flatten();
    all.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).filter(is_worker).collect()
}

/// Sends the first worker a signal while it renders.
fn signalled(signal: &str, args: &[&str]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = vitrum(folder.path(), &["--filter", "render/path/software/all", "--filter", "display", "-v"]);
    let child = command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let start = Instant::now();
    // The planted faults leave no pictures: once their folder is there and some time has passed, one of the checks is at work.
    let worker = loop {
        match workers(&child)[..] {
            [pid] if folder.path().join("validate-report/device-0").is_dir() => break pid,
            _ => assert!(start.elapsed() < Duration::from_secs(60), "no worker"),
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let status = Command::new("kill").args([signal, &worker.to_string()]).status().expect("kill");
    assert!(status.success());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    (folder, said(&output))
}

#[test]
#[cfg(target_os = "linux")]
fn a_crash_fails_one_check_and_the_rest_goes_on() {
    if Validated::open().is_none() {
        return;
    }
    let (folder, said) = signalled("-ABRT", &[]);
    let report = report(folder.path());
    assert_eq!((report.count(Outcome::Crashed), report.count(Outcome::Failed)), (1, 0), "{said}");
    let crashed = report.checks().find(|(_, check)| check.outcome == Outcome::Crashed).expect("one").1;
    assert!(crashed.reasons[0].contains("signal: 6"), "{crashed:?}");
    assert_eq!(report.checks().count(), report.count(Outcome::Passed) + 1);
    assert!(
        said.contains("1 of 7 checks failed") && said.contains(&format!("{}: the process ended", crashed.name)),
        "{said}"
    );
}

#[test]
#[cfg(target_os = "linux")]
fn what_hangs_is_ended_and_the_rest_goes_on() {
    if Validated::open().is_none() {
        return;
    }
    let (folder, said) = signalled("-STOP", &["--time-limit", "20"]);
    let report = report(folder.path());
    assert_eq!((report.count(Outcome::Hung), report.count(Outcome::Passed)), (1, 6), "{said}");
    assert!(said.contains("it was not done after 20 s"), "{said}");
}

#[test]
fn wrong_requests_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let said = ends(vitrum(folder, &["--filter", "abacus"]), 2);
    assert!(said.contains("no check has abacus in its name; see --list"), "{said}");
    let said = ends(vitrum(folder, &["--driver", "none.json"]), 2);
    assert!(said.contains("none.json: cannot read"), "{said}");
    fs::write(folder.join("text.json"), "{}").expect("a file");
    let said = ends(vitrum(folder, &["--driver", "text.json"]), 2);
    assert!(said.contains("text.json: drives no device"), "{said}");
    let said = ends(vitrum(folder, &["--time-limit", "0"]), 2);
    assert!(said.contains("--time-limit"), "{said}");
    if Validated::open().is_some() {
        let said = ends(vitrum(folder, &["--device", "abacus"]), 2);
        assert!(said.contains("no Vulkan device \"abacus\"; found: 0"), "{said}");
        fs::create_dir(folder.join("site")).expect("a folder");
        fs::write(folder.join("site/index.html"), "mine").expect("a page");
        let said = ends(vitrum(folder, &["--filter", "display", "-o", "site"]), 2);
        assert!(said.contains("site/index.html: is no report of this command"), "{said}");
        assert_eq!(fs::read_to_string(folder.join("site/index.html")).expect("it is there"), "mine");
    }
    let mut command = vitrum(folder, &["--filter", "display"]);
    command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    let said = ends(command, 3);
    assert!(said.contains("no Vulkan device on this machine"), "{said}");
    assert!(!folder.join("validate-report").exists(), "nothing is written");
}

#[test]
fn checks_have_names_of_their_own_and_are_told() {
    let all = Check::all();
    let names: std::collections::BTreeSet<_> = all.iter().map(|check| &check.name).collect();
    assert_eq!(names.len(), all.len());
    let folder = tempfile::tempdir().expect("a folder");
    let list = ends(vitrum(folder.path(), &["--list"]), 0);
    assert_eq!(list.lines().count(), all.len());
    // Every group is in the manual.
    let manual = include_str!("../docs/validate.md");
    for check in &all {
        let group = check.name.split('/').next().expect("a group");
        let row = if check.name.contains('/') { format!("| `{group}/…` |") } else { format!("| `{group}` |") };
        assert!(manual.contains(&row), "{row}");
    }
}

#[test]
fn the_manual_has_every_member() {
    let record = Record::new("", "");
    let Value::Object(members) = serde_json::to_value(record).expect("JSON") else { panic!("no object") };
    let manual = include_str!("../docs/validate.md");
    for member in members.keys() {
        assert!(manual.contains(&format!("`{member}`")), "{member}");
    }
}
