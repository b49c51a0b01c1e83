//! `vitrum regress` from outside: what passes, what fails and how it says so, parts and interrupted runs, and our own suite on every
//! driver there is.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use common::{Validated, manifest};

const PROGRAM: &str = env!("CARGO_BIN_EXE_vitrum");

fn vitrum(folder: &Path, args: &str) -> Output {
    Command::new(PROGRAM).args(args.split_whitespace()).current_dir(folder).output().expect("it starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// It ends with this exit code.
fn ends(folder: &Path, args: &str, code: i32) -> Output {
    let output = vitrum(folder, args);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{args}: {}{}",
        said(&output),
        String::from_utf8_lossy(&output.stdout)
    );
    output
}

fn report(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("regress.json")).expect("a report");
    serde_json::from_str(&text).expect("JSON")
}

/// Names and outcomes.
fn outcomes(report: &Value) -> Vec<(String, String)> {
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    let pictures = report["pictures"].as_array().expect("pictures");
    pictures.iter().map(|picture| (text(&picture["name"]), text(&picture["outcome"]))).collect()
}

const BODY: &str = "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";

/// Brighter with the index: a body in the same light all over hides its own in what it reflects and transmits.
fn scene(ior: f64) -> String {
    let intensity = 0.6 * ior;
    format!(
        "[environment]\ncolor = [1, 0.8, 0.5]\nintensity = {intensity}\n[camera]\nposition = [0.3, 0.6, 5]\ntarget = [0, 0, 0]\n\
         [material.glass]\nkind = \"dielectric\"\nior = {ior}\nattenuation_color = [0.2, 0.9, 0.5]\nattenuation_distance = 1.0\n\
         [[object]]\nmesh = \"body.obj\"\nmaterial = \"glass\"\n"
    )
}

const SUITE: &str = r#"schema = 1
[render]
size = [24, 18]
[[picture]]
name = "tree"
scene = "scene.toml"
model = "tree"
options = { samples = 2 }
why = "a tree"
[[picture]]
name = "single"
scene = "scene.toml"
options = { samples = 2 }
why = "one interface"
[[picture]]
name = "path"
scene = "scene.toml"
model = "path"
options = { samples = 64 }
why = "by chance"
"#;

/// A suite of three pictures, which is blessed.
fn blessed() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    write("body.obj", BODY);
    write("scene.toml", &scene(1.5));
    write("regress.toml", SUITE);
    ends(folder.path(), "regress --bless -o report", 0);
    folder
}

#[test]
fn what_stays_passes_and_what_changes_fails() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    assert!(outcomes(&report(&folder.join("report"))).iter().all(|(_, outcome)| outcome == "new"));
    let before = fs::read(folder.join("references/tree.exr")).expect("a reference");

    let output = ends(folder, "regress -o report --validation --jobs 2", 0);
    assert!(said(&output).contains("3 pictures") && said(&output).contains("3 passed"), "{}", said(&output));
    ends(folder, "regress -o report --seed 9", 0);
    ends(folder, "regress -o report --bless", 0);
    assert!(outcomes(&report(&folder.join("report"))).iter().all(|(_, outcome)| outcome == "unchanged"));

    // A hundredth of the index is seen in each.
    fs::write(folder.join("scene.toml"), scene(1.515)).expect("a scene");
    let output = ends(folder, "regress -o report", 1);
    assert!(said(&output).contains("3 of 3 pictures are not as they should be; tree: p99 is"), "{}", said(&output));
    let report_now = report(&folder.join("report"));
    assert!(outcomes(&report_now).iter().all(|(_, outcome)| outcome == "failed"), "{report_now}");
    for picture in report_now["pictures"].as_array().expect("pictures") {
        let name = picture["name"].as_str().expect("a name");
        for file in ["exr", "png", "reference.png", "error.png"] {
            assert!(folder.join(format!("report/pictures/{name}.{file}")).is_file(), "{name}.{file}");
        }
    }
    let [page, junit] =
        ["index.html", "junit.xml"].map(|name| fs::read_to_string(folder.join("report").join(name)).expect(name));
    assert!(page.contains("tree: FAILED") && page.contains("vitrum regress regress.toml --filter tree"), "{page}");
    assert!(junit.contains(r#"tests="3""#) && junit.contains(r#"failures="3""#), "{junit}");

    // What is blessed by name is no other.
    ends(folder, "regress -o report --bless=tree", 0);
    assert_eq!(outcomes(&report(&folder.join("report"))), [("tree".into(), "changed".into())]);
    assert_ne!(fs::read(folder.join("references/tree.exr")).expect("a reference"), before);
    ends(folder, "regress -o report --filter tree", 0);
    ends(folder, "regress -o report --filter path", 1);
}

#[test]
fn what_cannot_be_compared_fails() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    let fails = |args: &str, code: i32, wanted: &str| {
        let output = ends(folder, args, code);
        let all = said(&output) + &String::from_utf8_lossy(&output.stdout);
        assert!(all.contains(wanted), "{args}: {all}");
    };
    fails("regress --filter nothing", 1, "no picture has nothing in its name");
    let reference = folder.join("references/single.exr");
    let whole = fs::read(&reference).expect("a reference");
    fs::remove_file(&reference).expect("it is gone");
    fails("regress -o report", 1, "single: there is no reference references/single.exr; make it with --bless");
    fs::write(&reference, &whole[..whole.len() / 2]).expect("half of it");
    fails("regress -o report", 1, "is no reference");
    // A render is no reference.
    ends(folder, "render scene.toml -q --size 24x18 --samples 2 -o references/single.exr", 0);
    fails("regress -o report", 1, "does not say that it is a reference");
    fs::write(&reference, &whole).expect("a reference");
    ends(folder, "regress -o report", 0);
    fs::write(folder.join("regress.toml"), SUITE.replace("size = [24, 18]", "size = [24, 16]")).expect("a suite");
    fails(
        "regress -o report",
        1,
        "tree: the reference was made with --size=24x18, this with --size=24x16; make it again",
    );
    fs::write(folder.join("regress.toml"), SUITE.replace("samples = 64", "samples = 4")).expect("a suite");
    fails("regress -o report --bless=path", 1, "4 samples are too few to judge by their spread");
    // A scene that cannot be read is one picture's fault.
    fs::write(folder.join("regress.toml"), SUITE).expect("a suite");
    fs::write(folder.join("scene.toml"), "[environment]\ncolour = 1\n").expect("a scene");
    fails("regress -o report", 1, "scene.toml:2: unknown key \"colour\"");
    assert!(outcomes(&report(&folder.join("report"))).iter().all(|(_, outcome)| outcome == "error"));
}

#[test]
fn what_is_wrong_in_a_suite_is_said_with_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("body.obj"), BODY).expect("a mesh");
    let picture = "[[picture]]\nname = \"a\"\nwhy = \"b\"\n";
    for (text, wanted) in [
        (String::new(), "missing key \"schema\""),
        ("schema = 2\n".into(), "a.toml:1: schema: this program reads suites of schema 1"),
        ("schema = 1\n".into(), "missing key \"picture\""),
        ("schema = 1\npicture = []\n".into(), "holds no [[picture]]"),
        (format!("schema = 1\n{picture}{picture}"), "a.toml:5: two pictures have the name \"a\""),
        ("schema = 1\n[[picture]]\nname = \"a/b\"\nwhy = \"b\"\n".into(), "a.toml:3: name: \"a/b\" names files"),
        ("schema = 1\n[[picture]]\nname = \"a\"\n".into(), "missing key \"why\""),
        (format!("schema = 1\n{picture}scene = \"no.toml\"\n"), "a.toml:5: scene: \"no.toml\" does not exist"),
        (format!("schema = 1\n{picture}model = \"auto\"\n"), "model auto, which chooses by the speed"),
        (format!("schema = 1\n{picture}model = \"best\"\n"), "invalid value 'best'"),
        (format!("schema = 1\n{picture}options = {{ time_budget = 1 }}\n"), "a time budget"),
        (format!("schema = 1\n{picture}limits = {{ ssim = 1 }}\n"), "unknown key \"ssim\""),
        (format!("schema = 1\n{picture}limits = {{ p99 = -1 }}\n"), "p99: expected a number from 0"),
        (
            format!(
                "schema = 1\n{picture}[[driver]]\nname = \"x\"\nwhy = \"y\"\n[[driver.fault]]\npicture = \"c\"\nwhy = \"d\"\n"
            ),
            "a.toml:9: picture: no picture has the name \"c\"",
        ),
    ] {
        fs::write(folder.join("a.toml"), &text).expect("a suite");
        let output = ends(folder, "regress a.toml", 2);
        assert!(said(&output).contains(wanted), "{text}: {}", said(&output));
        assert!(!folder.join("regress-report").exists(), "{text}");
    }
    let output = ends(folder, "regress", 2);
    assert!(said(&output).contains("neither regress.toml nor tests/regress/suite.toml here"), "{}", said(&output));
    let output = ends(folder, "regress a.toml --shard 3/2", 2);
    assert!(said(&output).contains("i/n with 1 <= i <= n"), "{}", said(&output));
}

#[test]
fn parts_make_a_whole() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    fs::write(folder.join("scene.toml"), scene(1.515)).expect("a scene");
    for part in 1..=2 {
        ends(folder, &format!("regress -q --shard {part}/2 -o part{part}"), 1);
    }
    let output = ends(folder, "regress merge part1 -o whole", 2);
    assert!(said(&output).contains("the parts 2/2 are missing"), "{}", said(&output));
    let output = ends(folder, "regress merge part1 part2 part1 -o whole", 2);
    assert!(said(&output).contains("is of part 1/2, as part1 is"), "{}", said(&output));
    ends(folder, "regress merge part2 part1 -o whole", 1);
    ends(folder, "regress -o report", 1);
    let (merged, whole) = (report(&folder.join("whole")), report(&folder.join("report")));
    assert_eq!(outcomes(&merged), outcomes(&whole));
    let measures = |report: &Value| -> Vec<Value> {
        report["pictures"].as_array().expect("pictures").iter().map(|picture| picture["measures"].clone()).collect()
    };
    assert_eq!(measures(&merged), measures(&whole));
    assert!(folder.join("whole/pictures/path.error.png").is_file() && folder.join("whole/index.html").is_file());
    ends(folder, "regress -q -o report", 1);
    let output = ends(folder, "regress merge part1 report -o other", 2);
    assert!(said(&output).contains("was made without --shard"), "{}", said(&output));
}

/// Faults of a driver are known by its name, and missed when they are gone.
#[test]
fn known_faults_are_expected() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    let output = ends(folder, "regress -q -o report", 0);
    let name = report(&folder.join("report"))["pictures"][0]["device"]["name"].as_str().expect("a name").to_owned();
    drop(output);
    let driver = |name: &str, limits: &str| {
        format!(
            "{SUITE}[[driver]]\nname = '{name}'\nwhy = 'x'\n{limits}[[driver.fault]]\npicture = 'tree'\nwhy = 'its roots'\n"
        )
    };
    fs::write(folder.join("regress.toml"), driver(&name, "")).expect("a suite");
    let output = ends(folder, "regress -o report", 1);
    assert!(said(&output).contains("a fault that is gone (its roots); take it out"), "{}", said(&output));
    fs::write(folder.join("regress.toml"), driver("another", "")).expect("a suite");
    ends(folder, "regress -o report", 0);
    fs::write(folder.join("scene.toml"), scene(1.515)).expect("a scene");
    fs::write(folder.join("regress.toml"), driver(&name, "")).expect("a suite");
    ends(folder, "regress -o report --filter tree", 0);
    assert_eq!(outcomes(&report(&folder.join("report"))), [("tree".into(), "known-fault".into())]);
    ends(folder, "regress -o report --filter single", 1);
    // A driver may be further off.
    fs::write(folder.join("regress.toml"), driver(&name, "limits = { exact = { p99 = 0.1 } }\n")).expect("a suite");
    ends(folder, "regress -o report --filter single", 0);
}

/// Waits until `done`.
fn waits(done: impl Fn() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(120), "it never comes to that");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn started(folder: &Path, args: &str) -> Child {
    let mut command = Command::new(PROGRAM);
    command.args(args.split_whitespace()).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().expect("it starts")
}

#[test]
fn an_interrupted_run_goes_on() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    fs::remove_dir_all(folder.join("report")).expect("it is gone");
    let first = folder.join("report/results/tree.json");
    let mut child = started(folder, "regress -o report");
    waits(|| first.is_file());
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    let kept = fs::read_to_string(&first).expect("a record");
    let output = ends(folder, "regress -o report", 0);
    assert!(said(&output).contains("going on with an interrupted run"), "{}", said(&output));
    let seconds = |record: &Value| record["seconds"].clone();
    let kept: Value = serde_json::from_str(&kept).expect("JSON");
    assert_eq!(seconds(&report(&folder.join("report"))["pictures"][0]), seconds(&kept), "it was not rendered again");
    // A finished run is not gone on with, and one of another scene neither.
    let output = ends(folder, "regress -o report", 0);
    assert!(!said(&output).contains("going on"), "{}", said(&output));
    fs::write(folder.join("report/unfinished"), "").expect("a file");
    fs::write(folder.join("scene.toml"), scene(1.515)).expect("a scene");
    ends(folder, "regress -o report", 1);
}

/// The files in `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut files: Vec<_> =
        entries.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_file()).collect();
    files.sort();
    files
}

/// Killed whenever it may be: no file is half written, and the next run succeeds. `VITRUM_KILLS` says how often.
#[test]
fn whoever_is_killed_leaves_whole_files() {
    if Validated::open().is_none() {
        return;
    }
    let folder = blessed();
    let folder = folder.path();
    let kills: u32 = std::env::var("VITRUM_KILLS").ok().and_then(|count| count.parse().ok()).unwrap_or(12);
    let start = Instant::now();
    ends(folder, "regress -q --bless -o report", 0);
    let whole = start.elapsed();
    let mut random = fastrand::Rng::with_seed(3);
    for number in 0..kills {
        // Each time there is something else to write.
        fs::write(folder.join("scene.toml"), scene(1.3 + f64::from(number) * 1e-3)).expect("a scene");
        let args = match number % 2 {
            0 => "regress --bless -o report",
            _ => "render scene.toml -q --size 24x18 --samples 2 --stats stats.json -o picture.png",
        };
        let mut child = started(folder, args);
        std::thread::sleep(whole.mul_f64(random.f64()));
        child.kill().expect("it is killed");
        child.wait().expect("it ends");
        for file in files(&folder.join("references")) {
            let bytes = fs::read(&file).expect("a file");
            let is_part = file.extension().is_some_and(|extension| extension == "part");
            assert!(!is_part, "{}: left behind", file.display());
            assert!(vitrum::image::decode(&file, &bytes).is_ok(), "{}: half written", file.display());
        }
        if let Ok(bytes) = fs::read(folder.join("picture.png")) {
            assert!(vitrum::image::decode(Path::new("picture.png"), &bytes).is_ok(), "half a picture");
        }
        if let Ok(text) = fs::read_to_string(folder.join("stats.json")) {
            assert!(serde_json::from_str::<Value>(&text).is_ok(), "half of the stats");
        }
        if number % 10 == 9 || number + 1 == kills {
            ends(folder, "regress -q --bless -o report", 0);
            ends(folder, "regress -q -o report", 0);
            ends(folder, "render scene.toml -q --size 24x18 --samples 2 --stats stats.json -o picture.png", 0);
            for place in [folder, &folder.join("references"), &folder.join("report"), &folder.join("report/pictures")] {
                let parts = files(place).into_iter().filter(|file| file.extension().is_some_and(|it| it == "part"));
                assert_eq!(parts.count(), 0, "in {}", place.display());
            }
        }
    }
}

/// A line for a shell in a folder, with the program on the path.
fn shell(folder: &Path, line: &str, variables: &[(&str, String)]) -> Option<i32> {
    let programs = Path::new(PROGRAM).parent().expect("a folder").display().to_string();
    let path = format!("{programs}:{}", std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("sh");
    command.args(["-c", line]).current_dir(folder).env("PATH", path).envs(variables.iter().cloned());
    command.output().expect("it starts").status.code()
}

/// What docs/ci.md shows works as it stands there, with the variables that those systems set: what is blessed passes, what changed fails.
#[test]
fn the_jobs_of_the_docs_work() {
    if Validated::open().is_none() {
        return;
    }
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/ci.md")).expect("a page");
    let block = |title: &str| {
        let (_, section) = page.split_once(&format!("## {title}")).expect("a section");
        let (_, block) = section.split_once("```").expect("a block");
        let (block, _) = block.split_once("```").expect("its end");
        block.split_once('\n').expect("lines").1.to_owned()
    };
    let commands = |title: &str, lead: &str| -> Vec<String> {
        let block = block(title);
        let lines = block.lines().filter_map(|line| line.trim().strip_prefix(lead));
        lines.filter(|line| line.starts_with("vitrum")).map(str::to_owned).collect()
    };
    let folder = blessed();
    let folder = folder.path();
    fs::rename(folder.join("regress.toml"), folder.join("suite.toml")).expect("a suite");
    fs::write(folder.join("part.sh"), block("Slurm")).expect("a script");
    let wrapped = page.split_once("--wrap \"").and_then(|(_, rest)| rest.split_once('"')).expect("a command").0;
    for (ior, code) in [(1.5, 0), (1.515, 1)] {
        fs::write(folder.join("scene.toml"), scene(ior)).expect("a scene");
        for (title, lead) in [("GitHub Actions", "- run: "), ("GitLab CI", "- "), ("Slurm", "")] {
            for part in 1..=3 {
                let number = part.to_string();
                let variables = [
                    ("CI_NODE_INDEX", number.clone()),
                    ("CI_NODE_TOTAL", "3".into()),
                    ("SLURM_ARRAY_TASK_ID", number.clone()),
                    ("SLURM_ARRAY_TASK_COUNT", "3".into()),
                ];
                let line = match title {
                    "Slurm" => "bash part.sh".into(),
                    _ => commands(title, lead)[0].replace("${{ matrix.shard }}", &number),
                };
                assert_eq!(shell(folder, &line, &variables), Some(code), "{title}: {line}");
            }
            let line = if title == "Slurm" { wrapped.into() } else { commands(title, lead)[1].clone() };
            assert_eq!(shell(folder, &line, &[]), Some(code), "{title}: {line}");
            assert_eq!(report(&folder.join("report"))["pictures"].as_array().map(Vec::len), Some(3), "{title}");
            for part in ["part-1", "part-2", "part-3", "report"] {
                fs::remove_dir_all(folder.join(part)).expect("it is gone");
            }
        }
    }
}

/// Our own suite, or a part of it, on a driver.
fn passes_on(driver: Option<&str>, part: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(PROGRAM);
    command.args(["regress", "tests/regress/suite.toml", "-q", "--validation", "-o"]).current_dir(root);
    let report = tempfile::tempdir().expect("a folder");
    command.arg(report.path()).args(part);
    if let Some(driver) = driver {
        let Some(manifest) = manifest(driver) else { return };
        command.env("VK_DRIVER_FILES", manifest).env_remove("VITRUM_DEVICE");
    }
    let output = command.output().expect("it starts");
    assert!(output.status.success(), "{}{}", said(&output), String::from_utf8_lossy(&output.stdout));
}

#[test]
fn our_suite_passes() {
    if Validated::open().is_some() {
        passes_on(None, &[]);
    }
}

/// Other drivers keep nothing of what they compile: a part of the suite here, with `VITRUM_WHOLE_SUITE` all of it.
fn part() -> &'static [&'static str] {
    if std::env::var_os("VITRUM_WHOLE_SUITE").is_some() { &[] } else { &["--shard", "1/4"] }
}

#[test]
fn our_suite_passes_without_ray_queries() {
    passes_on(Some("lavapipe-of-release"), part());
}

#[test]
fn our_suite_passes_on_swiftshader() {
    passes_on(Some("swiftshader"), part());
}
