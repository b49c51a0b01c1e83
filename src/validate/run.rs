//! A validation run: devices are found and tested in processes of their own. In flow names of checks, out flow records, line by line.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::checks::Check;
use super::record::{Listed, Outcome, Record, Report, Tested};
use super::session::Place;
use crate::gpu::{GpuError, Instance, find_device};
use crate::image::make_folder;
use crate::{Error, Result};

/// What is said of an output that is a file.
const NO_FOLDER: &str = "is a file; the report is a folder: name one";

/// Bytes of what a process said last that are kept.
const LAST_WORDS: usize = 2000;

/// What is tested, and how.
pub struct Run<'a> {
    /// This program, which is started again for each device.
    pub program: PathBuf,
    /// Manifests of drivers; of none those that the loader finds.
    pub manifests: Vec<PathBuf>,
    /// Only the device of that index or name.
    pub device: Option<String>,
    /// What is tried on each.
    pub checks: &'a [Check],
    /// Where evidence goes.
    pub folder: &'a Path,
    /// What takes minutes is done, too.
    pub thorough: bool,
    /// How long a check may take.
    pub patience: Duration,
}

impl Run<'_> {
    /// The devices that are meant, by the drivers' manifests. Those that cannot be used are among them, unless one is asked for.
    pub fn devices(&self) -> Result<Vec<Tested>> {
        let mut all = Vec::new();
        let manifests: Vec<_> = match self.manifests.as_slice() {
            [] => vec![None],
            some => some.iter().map(|path| Some(path.as_path())).collect(),
        };
        for manifest in manifests {
            let listed = self.listed(manifest)?;
            let names: Vec<_> = listed.iter().map(|device| device.name.as_str()).collect();
            let wanted = self.device.as_deref().filter(|wanted| !wanted.is_empty());
            let wanted = wanted.map(|wanted| find_device(wanted, &names).ok_or(wanted));
            for device in &listed {
                if wanted.is_none_or(|wanted| wanted == Ok(device.index)) {
                    all.push((manifest.map(|path| path.display().to_string()), device.clone()));
                }
            }
            if let (Some(Err(wanted)), 0..=1) = (wanted, self.manifests.len()) {
                let found = listed.iter().map(|device| format!("{} ({})", device.index, device.name)).collect();
                return Err(GpuError::UnknownDevice { wanted: wanted.into(), found }.into());
            }
        }
        let usable = all.iter().filter(|(_, device)| device.missing.is_empty()).count();
        if usable == 0 {
            let lacking = |device: &Listed| format!("{:?} lacks {}", device.name, device.missing.join(", "));
            let lacking = all.iter().map(|(_, device)| lacking(device)).collect::<Vec<_>>();
            return Err(if all.is_empty() { GpuError::NoDevice } else { GpuError::NoUsableDevice(lacking) }.into());
        }
        let tested = |(number, (manifest, device))| Tested {
            device,
            manifest,
            folder: format!("device-{number}"),
            checks: Vec::new(),
        };
        Ok(all.into_iter().enumerate().map(tested).collect())
    }

    /// What `vitrum devices` lists, in a process of its own: a driver may crash at once.
    fn listed(&self, manifest: Option<&Path>) -> Result<Vec<Listed>> {
        let mut command = self.command(manifest)?;
        let output = command.args(["devices", "--json"]).output().map_err(|source| self.not_started(source))?;
        if output.status.success() {
            #[derive(serde::Deserialize)]
            struct List {
                devices: Vec<Listed>,
            }
            let list: List = serde_json::from_slice(&output.stdout)
                .map_err(|error| Error::Check(format!("the list of devices cannot be read: {error}")))?;
            return Ok(list.devices);
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        match (manifest, output.status.code()) {
            (Some(manifest), Some(_)) => Err(Error::input(manifest, 0, format!("drives no device: {said}"))),
            (None, Some(_)) => {
                Err(match Instance::new(/* validation: */ false).and_then(|instance| instance.devices()) {
                    Ok(_) => GpuError::NoDevice.into(),
                    Err(error) => error.into(),
                })
            }
            (_, None) => {
                let driver = manifest.map_or("a driver".into(), |path| path.display().to_string());
                Err(Error::Check(format!("{driver}: crashed while its devices were listed: {}", output.status)))
            }
        }
    }

    fn command(&self, manifest: Option<&Path>) -> Result<Command> {
        let mut command = Command::new(&self.program);
        if let Some(manifest) = manifest {
            let manifest = manifest.canonicalize().map_err(|source| Error::file(manifest, "read", source))?;
            // Loaders before 1.3.207 know the second name alone.
            command.env("VK_DRIVER_FILES", &manifest).env("VK_ICD_FILENAMES", &manifest);
            command.env_remove("VK_ADD_DRIVER_FILES");
        }
        Ok(command)
    }

    fn not_started(&self, source: std::io::Error) -> Error {
        Error::file(&self.program, "start", source)
    }

    /// Makes the folder ready. One that holds something else is refused.
    pub fn open_folder(&self) -> Result<()> {
        make_folder(self.folder, NO_FOLDER)?;
        let (json, page) = (self.folder.join(Report::FILE), self.folder.join("index.html"));
        if page.exists() && !json.exists() {
            let why = "is no report of this command and would be replaced; name another folder";
            return Err(Error::input(page, 0, why));
        }
        // What another run left there.
        for number in 0.. {
            let old = self.folder.join(format!("device-{number}"));
            if !old.is_dir() {
                break;
            }
            fs::remove_dir_all(&old).map_err(|source| Error::file(&old, "empty", source))?;
        }
        Ok(())
    }

    /// Tries everything on one device; `progress` hears of each check when it is done.
    pub fn test(&self, tested: &mut Tested, progress: &mut dyn FnMut(&Record)) -> Result<()> {
        let folder = self.folder.join(&tested.folder);
        make_folder(&folder, NO_FOLDER)?;
        let mut worker = None;
        for check in self.checks {
            let worker_now = match worker.take() {
                Some(worker) => worker,
                None => Worker::start(self, tested, &folder)?,
            };
            let (record, kept) = worker_now.ask(check, self.patience);
            worker = kept;
            progress(&record);
            tested.checks.push(record);
        }
        if let Some(worker) = worker {
            worker.end();
        }
        Ok(())
    }
}

/// A process that does one check after the other on a device.
struct Worker {
    child: Child,
    input: ChildStdin,
    records: Receiver<Record>,
    said: JoinHandle<String>,
}

impl Worker {
    fn start(run: &Run<'_>, tested: &Tested, folder: &Path) -> Result<Self> {
        let mut command = run.command(tested.manifest.as_deref().map(Path::new))?;
        command.arg("validate").arg("--output").arg(folder).arg("--worker").arg(tested.device.index.to_string());
        command.args(run.thorough.then_some("--thorough"));
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().map_err(|source| run.not_started(source))?;
        let (Some(input), Some(output), Some(mut errors)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(run.not_started(std::io::ErrorKind::BrokenPipe.into()));
        };
        let (send, records) = channel();
        thread::spawn(move || {
            // Drivers may print there, too: what is no record is passed over.
            let lines = BufReader::new(output).lines().map_while(std::result::Result::ok);
            for record in lines.filter_map(|line| serde_json::from_str(&line).ok()) {
                if send.send(record).is_err() {
                    return;
                }
            }
        });
        let said = thread::spawn(move || {
            let mut bytes = Vec::new();
            // What was read before an error is what there is.
            let _ = errors.read_to_end(&mut bytes);
            let text = String::from_utf8_lossy(&bytes);
            text.char_indices().rev().nth(LAST_WORDS).map_or(&*text, |(start, _)| &text[start..]).trim().to_owned()
        });
        Ok(Self { child, input, records, said })
    }

    /// What came of a check, and the process where it is still there.
    fn ask(mut self, check: &Check, patience: Duration) -> (Record, Option<Self>) {
        let start = Instant::now();
        let is_asked = writeln!(self.input, "{}", check.name).and_then(|()| self.input.flush());
        let answer = match is_asked {
            Ok(()) => self.records.recv_timeout(patience),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        };
        let outcome = match answer {
            Ok(record) => return (record, Some(self)),
            Err(RecvTimeoutError::Timeout) => Outcome::Hung,
            Err(RecvTimeoutError::Disconnected) => Outcome::Crashed,
        };
        // One that has ended cannot be killed, and need not be.
        let _ = self.child.kill();
        let status = self.child.wait();
        let said = self.said.join().unwrap_or_default();
        let mut reasons = vec![match outcome {
            Outcome::Hung => format!("it was not done after {} s, and was ended", patience.as_secs()),
            _ => format!("the process ended: {}", status.map_or_else(|error| error.to_string(), |s| s.to_string())),
        }];
        reasons.extend((!said.is_empty()).then(|| format!("its last words: {said}")));
        let seconds = start.elapsed().as_secs_f64();
        (Record { outcome, reasons, seconds, ..Record::new(&check.name, &check.about) }, None)
    }

    fn end(mut self) {
        drop(self.input);
        // Whatever it says now is of no check.
        let _ = self.child.wait();
        let _ = self.said.join();
    }
}

/// The other side: does each check that `input` names, and tells `output` what came of it.
pub fn work(place: Place<'_>, input: impl BufRead, mut output: impl Write) -> Result<()> {
    let checks = Check::all();
    for name in input.lines() {
        let name = name.map_err(|source| Error::file("standard input", "read", source))?;
        let Some(check) = checks.iter().find(|check| check.name == name) else {
            return Err(Error::Usage(format!("there is no check {name:?}")));
        };
        let record = check.run(place);
        let line = serde_json::to_string(&record).unwrap_or_default();
        writeln!(output, "{line}")
            .and_then(|()| output.flush())
            .map_err(|source| Error::file("standard output", "write", source))?;
    }
    Ok(())
}
