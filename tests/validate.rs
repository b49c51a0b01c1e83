//! `vitrum validate` from outside: what the layer is shown to notice, what it says of us on every driver there is, and what becomes of
//! a run whose driver crashes or hangs.

mod common;

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use common::{Validated, manifest};
use vitrum::gpu::Fault;
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
        let planted = Fault::ALL.into_iter().find(|known| known.name() == fault).expect("a fault");
        assert!(check.said.iter().any(|said| planted.is_noticed_in(&said.message)), "{check:?}");
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

fn send(signal: &str, process: u32) {
    let status = Command::new("kill").args([signal, &process.to_string()]).status().expect("kill");
    assert!(status.success());
}

/// A run of `display` and `numerics`, when the first is done and the second, which takes seconds, is being done; and who does it.
fn in_numerics(folder: &Path, args: &[&str]) -> (Child, u32, BufReader<ChildStderr>) {
    let mut command = vitrum(folder, &["--filter", "display", "--filter", "numerics", "-v"]);
    let mut child = command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut said = BufReader::new(child.stderr.take().expect("its words"));
    let mut line = String::new();
    while !line.starts_with("passed   display") {
        line.clear();
        assert!(said.read_line(&mut line).expect("a line") > 0, "display does not pass");
    }
    let [worker] = workers(&child)[..] else { panic!("no worker") };
    (child, worker, said)
}

/// The numerics of a device get a signal while they are done.
#[cfg(target_os = "linux")]
fn signalled(signal: &str, args: &[&str]) -> (Report, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let (child, worker, mut rest) = in_numerics(folder.path(), args);
    send(signal, worker);
    let mut said = String::new();
    rest.read_to_string(&mut said).expect("its words");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1), "{said}");
    let report = report(folder.path());
    assert_eq!((report.count(Outcome::Passed), report.checks().count()), (6, 7), "{said}");
    (report, said)
}

#[test]
#[cfg(target_os = "linux")]
fn a_crash_fails_one_check() {
    if Validated::open().is_none() {
        return;
    }
    let (report, said) = signalled("-ABRT", &[]);
    let numerics = check(&report, "numerics");
    assert_eq!(numerics.outcome, Outcome::Crashed);
    assert!(numerics.reasons[0].contains("signal: 6"), "{numerics:?}");
    assert!(said.contains("1 of 7 checks failed; ") && said.contains("numerics: the process ended"), "{said}");
}

#[test]
#[cfg(target_os = "linux")]
fn what_hangs_is_ended() {
    if Validated::open().is_none() {
        return;
    }
    let (report, said) = signalled("-STOP", &["--time-limit", "20"]);
    assert_eq!(check(&report, "numerics").outcome, Outcome::Hung);
    assert!(said.contains("it was not done after 20 s"), "{said}");
}

/// What is killed leaves no process, and a report that says how far it went.
#[test]
#[cfg(target_os = "linux")]
fn a_run_that_is_killed_takes_its_worker_along_and_another_one_succeeds() {
    if Validated::open().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    ends(vitrum(folder.path(), &["-q", "--filter", "display"]), 0);
    assert!(report(folder.path()).finished);

    let (mut child, worker, _rest) = in_numerics(folder.path(), &[]);
    // One run at a time has the folder.
    let said = ends(vitrum(folder.path(), &["--filter", "display"]), 2);
    assert!(said.contains("another run writes its report there"), "{said}");
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    let start = Instant::now();
    while Path::new(&format!("/proc/{worker}")).exists() {
        let state = fs::read_to_string(format!("/proc/{worker}/stat")).unwrap_or_default();
        if state.contains(") Z ") {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(10), "the worker goes on");
        std::thread::sleep(Duration::from_millis(10));
    }
    let left = folder.path().join("validate-report/validate.json");
    assert!(!left.exists() || !report(folder.path()).finished, "the report of the run before is gone");
    ends(vitrum(folder.path(), &["-q", "--filter", "display"]), 0);
    assert!(report(folder.path()).finished);
}

/// A manifest that drives nothing costs its own line, and the run its success.
#[test]
fn a_broken_driver_costs_a_line() {
    let Some(driver) = manifest("swiftshader") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("broken.json"), "{}").expect("a file");
    let mut command = vitrum(folder.path(), &["--filter", "display", "--driver", "broken.json", "--driver"]);
    command.arg(driver).env_remove("VITRUM_DEVICE");
    let said = ends(command, 1);
    assert!(said.contains("1 of 7 checks failed; broken.json: devices: broken.json: drives no device"), "{said}");
    let report = report(folder.path());
    assert_eq!((report.count(Outcome::Passed), report.messages()), (6, 0));
    assert!(report.finished && report.devices.len() == 2);
}

#[test]
fn wrong_requests_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let said = ends(vitrum(folder, &["--filter", "abacus"]), 2);
    assert!(said.contains("no check has abacus in its name; see --list"), "{said}");
    fs::write(folder.join("text.json"), "{}").expect("a file");
    let said = ends(vitrum(folder, &["--driver", "text.json", "--driver", "none.json"]), 2);
    assert!(said.contains("none.json: cannot read"), "{said}");
    let said = ends(vitrum(folder, &["--driver", "text.json"]), 2);
    assert!(said.contains("text.json: drives no device"), "{said}");
    let said = ends(vitrum(folder, &["--filter", "display", "--filter", "abacus"]), 2);
    assert!(said.contains("no check has abacus in its name"), "{said}");
    let said = ends(vitrum(folder, &["--time-limit", "0"]), 2);
    assert!(said.contains("--time-limit"), "{said}");
    if Validated::open().is_some() {
        let said = ends(vitrum(folder, &["--device", "abacus"]), 2);
        assert!(said.contains("no Vulkan device \"abacus\"; found: 0"), "{said}");
        fs::create_dir(folder.join("site")).expect("a folder");
        fs::write(folder.join("site/index.html"), "mine").expect("a page");
        let said = ends(vitrum(folder, &["--filter", "display", "-o", "site"]), 2);
        assert!(said.contains("site/index.html: is of no report of this command"), "{said}");
        fs::create_dir_all(folder.join("mine/device-0")).expect("a folder");
        let said = ends(vitrum(folder, &["--filter", "display", "-o", "mine"]), 2);
        assert!(said.contains("mine/device-0: is of no report of this command"), "{said}");
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
