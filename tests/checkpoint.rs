//! Renders that are interrupted, and go on to the same bytes.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = r#"
[environment]
image = "sky.exr"
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
[material.frosted]
kind = "dielectric"
roughness = 0.4
[[object]]
mesh = "slab.obj"
material = "frosted"
rotate = [20, 30, 0]
[render]
model = "path"
size = [48, 36]
aov = "stderr,interfaces"
"#;

/// A folder with a scene of a frosted slab.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        let asset = |name| Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name);
        fs::copy(asset("meshes/slab.obj"), folder.path("slab.obj")).expect("a mesh");
        fs::copy(asset("environments/city.exr"), folder.path("sky.exr")).expect("an environment");
        fs::write(folder.path("scene.toml"), SCENE).expect("a scene");
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// `vitrum render` of the scene by `path`, with `words` beside.
    fn render(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vitrum"));
        command.current_dir(self.0.path()).args(["render", "scene.toml"]);
        command.args(words.split(' ')).stdout(Stdio::null());
        command
    }

    fn run(&self, words: &str) -> Output {
        self.render(words).output().expect("the program starts")
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }
}

fn succeeds(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The line of an error of exit code 2.
fn refusal(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    text.lines().find(|line| line.starts_with("error: ")).expect("an error").to_owned()
}

#[test]
fn ten_times_killed_a_render_ends_in_the_same_bytes() {
    if common::Validated::open().is_none() {
        return;
    }
    let folder = Folder::new();
    // Long enough that the render is under way at every kill, wherever this runs.
    let mut samples = 4096;
    loop {
        let start = Instant::now();
        succeeds(&folder.run(&format!("--samples {samples} -o whole.exr")));
        if start.elapsed() > Duration::from_secs(8) {
            break;
        }
        samples *= 4;
    }
    let words = format!("--samples {samples} -o parts.exr --checkpoint state");
    let mut states = Vec::new();
    for i in 0..10 {
        let mut child = folder.render(&words).stderr(Stdio::null()).spawn().expect("the program starts");
        // Long enough to save at least once.
        std::thread::sleep(Duration::from_millis(1300 + 100 * i));
        let ended = child.try_wait().expect("a state").is_some();
        child.kill().expect("SIGKILL");
        child.wait().expect("the end");
        states.push((ended, fs::read(folder.path("state")).ok()));
    }
    let distinct = states.windows(2).filter(|pair| pair[0].1 != pair[1].1).count();
    let ended = states.iter().filter(|(ended, _)| *ended).count();
    println!("{samples} samples: {distinct} of 10 kills met a new state, {ended} came too late");
    assert!(distinct > 0 && ended < 10, "nothing was saved, or nothing interrupted");
    succeeds(&folder.run(&words));
    assert_eq!(folder.bytes("parts.exr"), folder.bytes("whole.exr"));
    // Once more: nothing is left to do.
    succeeds(&folder.run(&format!("--samples {samples} -o again.exr --checkpoint state")));
    assert_eq!(folder.bytes("again.exr"), folder.bytes("whole.exr"));
}

#[test]
fn a_smaller_tolerance_goes_on_from_a_larger_one() {
    if common::Validated::open().is_none() {
        return;
    }
    let folder = Folder::new();
    succeeds(&folder.run("--tolerance 0.02 -o rough.exr --checkpoint state"));
    // Killed in between: pixels of one picture have different numbers of samples.
    for i in 0..3 {
        let mut child = folder.render("--tolerance 0.01 -o fine.exr --checkpoint state").spawn().expect("a start");
        std::thread::sleep(Duration::from_millis(1200 + 300 * i));
        child.kill().expect("SIGKILL");
        child.wait().expect("the end");
    }
    succeeds(&folder.run("--tolerance 0.01 -o fine.exr --checkpoint state"));
    succeeds(&folder.run("--tolerance 0.01 -o direct.exr"));
    assert_eq!(folder.bytes("fine.exr"), folder.bytes("direct.exr"));
    assert_ne!(folder.bytes("fine.exr"), folder.bytes("rough.exr"));
}

#[test]
fn what_is_not_of_this_render_is_refused_and_kept() {
    if common::Validated::open().is_none() {
        return;
    }
    let folder = Folder::new();
    let whole = "--samples 16 -o image.exr --checkpoint state";
    succeeds(&folder.run(whole));
    let state = folder.bytes("state");
    for (words, told) in [("--seed 1", "--seed 0"), ("--max-depth 5", "--max-depth 32"), ("--ior 1.4", "another scene")]
    {
        let line = refusal(&folder.run(&format!("{whole} {words}")));
        assert!(line.contains("state: holds a render ") && line.contains(told), "{line}");
    }
    assert_eq!(folder.bytes("state"), state);

    let mut flipped = state.clone();
    *flipped.last_mut().expect("bytes") ^= 1;
    let longer = [&state[..], b"more"].concat();
    let head = state.iter().position(|&byte| byte == b'\n').expect("a line");
    let moved = |rounds: &str| {
        let text = String::from_utf8_lossy(&state[..head]).replace("\"rounds\":16", &format!("\"rounds\":{rounds}"));
        [text.as_bytes(), &state[head..]].concat()
    };
    let (earlier, later) = (moved("15"), moved("17"));
    let damaged: [(&[u8], &str); 7] = [
        (&longer, "something follows its end"),
        (&earlier, "its checksum is another one"),
        (&later, "it is farther than the render can be"),
        (&state[..state.len() - 1], "its end is missing"),
        (&flipped, "its checksum is another one"),
        (b"a letter to a friend", "is no checkpoint"),
        (b"", "is no checkpoint"),
    ];
    for (bytes, told) in damaged {
        fs::write(folder.path("state"), bytes).expect("a file");
        let line = refusal(&folder.run(whole));
        assert!(line.contains(told), "{line}");
        assert_eq!(folder.bytes("state"), bytes);
    }

    for (words, told) in [
        ("--samples 1 -o image.exr --model tree --aov depth --checkpoint state", "--model path has"),
        ("--samples 1 -o image.exr --checkpoint image.exr", "is to hold both the image and the checkpoint"),
        ("--samples 1 -o image.exr --checkpoint scene.toml", "is read by this render"),
        ("--samples 1 -o image.exr --checkpoint no/state", "does not exist"),
    ] {
        let line = refusal(&folder.run(words));
        assert!(line.contains(told), "{line}");
    }
}
