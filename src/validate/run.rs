//! A validation run: devices are found and tested in processes of their own. In flow names of checks, out flow records, line by line.

use std::fs;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::checks::Check;
use super::process::{all_of, end_with_parent, end_within, lines_of, output_within};
use super::record::{Listed, Outcome, Record, Report, Tested};
use super::session::Place;
use crate::gpu::{GpuError, Instance, find_device};
use crate::image::{FolderLock, LOCK, make_folder};
use crate::{Error, Result};

/// What is said of an output that is a file.
const NO_FOLDER: &str = "is a file; the report is a folder: name one";

/// Bytes of what a process said last that are kept.
const LAST_WORDS: usize = 4000;

/// What a process says on standard error before a check.
const BEGINS: &str = "vitrum validate begins ";

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
    /// The devices that are meant, by the drivers' manifests. Those that cannot be used are among them; of manifests also those
    /// that drive nothing, with a check that failed, if another drives something.
    pub fn devices(&self) -> Result<Vec<Tested>> {
        let mut all: Vec<Tested> = Vec::new();
        let mut found = Vec::new();
        let mut failures = Vec::new();
        let wanted = self.device.as_deref().filter(|wanted| !wanted.is_empty());
        for manifest in self.manifests() {
            // One that is not there is a slip, not a driver.
            self.command(manifest)?;
            let listed = match self.listed(manifest) {
                Ok(listed) => listed,
                Err((outcome, error)) => {
                    if let Some(manifest) = manifest {
                        all.push(unlisted(manifest, outcome, &error));
                    }
                    failures.push(error);
                    continue;
                }
            };
            let names: Vec<_> = listed.iter().map(|device| device.name.as_str()).collect();
            let meant = wanted.map(|wanted| find_device(wanted, &names));
            found.extend(listed.iter().map(|device| format!("{} ({})", device.index, device.name)));
            let is_meant = |device: &Listed| meant.is_none_or(|meant| meant == Some(device.index));
            for device in listed.iter().filter(|device| is_meant(device)) {
                let manifest = manifest.map(|path| path.display().to_string());
                all.push(Tested { device: device.clone(), manifest, folder: String::new(), checks: Vec::new() });
            }
        }
        let usable = |tested: &Tested| tested.device.missing.is_empty() && tested.checks.is_empty();
        if !all.iter().any(usable) {
            let lacking = all.iter().filter(|tested| tested.checks.is_empty()).map(|tested| &tested.device);
            let lacking = lacking.map(|device| format!("{:?} lacks {}", device.name, device.missing.join(", ")));
            let lacking: Vec<_> = lacking.collect();
            return Err(match (failures.into_iter().next(), wanted) {
                (Some(failure), _) => failure,
                (None, _) if !lacking.is_empty() => GpuError::NoUsableDevice(lacking).into(),
                (None, Some(wanted)) if !found.is_empty() => {
                    GpuError::UnknownDevice { wanted: wanted.into(), found }.into()
                }
                (None, _) => GpuError::NoDevice.into(),
            });
        }
        for (number, tested) in all.iter_mut().enumerate() {
            tested.folder = format!("device-{number}");
        }
        Ok(all)
    }

    fn manifests(&self) -> Vec<Option<&Path>> {
        match self.manifests.as_slice() {
            [] => vec![None],
            some => some.iter().map(|path| Some(path.as_path())).collect(),
        }
    }

    /// The table of devices, as `vitrum devices` prints it.
    pub fn table(&self) -> Result<String> {
        let mut table = String::new();
        for manifest in self.manifests() {
            let mut command = self.command(manifest)?;
            let output =
                output_within(command.arg("devices"), self.patience).map_err(|source| self.not_started(source))?;
            match output.filter(|output| output.status.success()) {
                Some(output) => table += &String::from_utf8_lossy(&output.stdout),
                None => self.listed(manifest).map(drop).map_err(|(_, error)| error)?,
            }
        }
        Ok(table)
    }

    /// What `vitrum devices` lists, in a process of its own: a driver may crash or hang at once.
    fn listed(&self, manifest: Option<&Path>) -> Result<Vec<Listed>, (Outcome, Error)> {
        let failed = |error: Error| (Outcome::Failed, error);
        let mut command = self.command(manifest).map_err(failed)?;
        let output = output_within(command.args(["devices", "--json"]), self.patience);
        let output = output.map_err(|source| failed(self.not_started(source)))?;
        let driver = manifest.map_or("a driver".into(), |path| path.display().to_string());
        let Some(output) = output else {
            let why = format!("{driver}: hangs while its devices are listed");
            return Err((Outcome::Hung, Error::Check(why)));
        };
        if output.status.success() {
            #[derive(serde::Deserialize)]
            struct List {
                devices: Vec<Listed>,
            }
            // Drivers may print there, too.
            let text = String::from_utf8_lossy(&output.stdout);
            let start = text.find("{\n").unwrap_or(0);
            let end = text.rfind('}').map_or(text.len(), |end| end + 1);
            let list: List = serde_json::from_str(text.get(start..end).unwrap_or_default())
                .map_err(|error| failed(Error::Check(format!("the list of devices cannot be read: {error}"))))?;
            return Ok(list.devices);
        }
        match (manifest, output.status.code()) {
            (_, None) => {
                let why = format!("{driver}: crashes while its devices are listed: {}", output.status);
                Err((Outcome::Crashed, Error::Check(why)))
            }
            (Some(manifest), Some(_)) => {
                let why =
                    "drives no device: the loader finds no driver in it, or cannot load or start the one that it names";
                Err(failed(Error::input(manifest, 0, why)))
            }
            (None, Some(_)) => {
                let devices = Instance::new(/* validation: */ false).and_then(|instance| instance.devices());
                Err(failed(devices.err().unwrap_or(GpuError::NoDevice).into()))
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

    /// Makes the folder ready, for this run alone. One that holds something else is refused.
    pub fn open_folder(&self) -> Result<FolderLock> {
        make_folder(self.folder, NO_FOLDER)?;
        let place = |name: &str| self.folder.join(name);
        let is_ours = place(Report::FILE).exists() || place(LOCK).exists();
        let foreign = ["index.html", "device-0"].map(place).into_iter().find(|path| !is_ours && path.exists());
        if let Some(foreign) = foreign {
            let why = "is of no report of this command and would be replaced; name another folder";
            return Err(Error::input(foreign, 0, why));
        }
        let lock = FolderLock::take(self.folder)?;
        // What another run left there, its report first: that is of pictures which go.
        for path in [Report::FILE, "index.html"].map(place).into_iter().filter(|path| path.exists()) {
            fs::remove_file(&path).map_err(|source| Error::file(&path, "remove", source))?;
        }
        for old in (0..).map(|number| place(&format!("device-{number}"))).take_while(|old| old.is_dir()) {
            fs::remove_dir_all(&old).map_err(|source| Error::file(&old, "empty", source))?;
        }
        Ok(lock)
    }

    /// Tries everything on one device; `progress` hears after each check.
    pub fn test(&self, tested: &mut Tested, progress: &mut dyn FnMut(&Tested) -> Result<()>) -> Result<()> {
        let folder = self.folder.join(&tested.folder);
        make_folder(&folder, NO_FOLDER)?;
        let mut worker: Option<Worker> = None;
        for check in self.checks {
            if let Some(mut idle) = worker.take() {
                match idle.child.try_wait() {
                    Ok(None) => worker = Some(idle),
                    ended => tested.died(ended.map(|status| status.map(told)), idle.last_words()),
                }
            }
            let now = match worker.take() {
                Some(worker) => worker,
                None => Worker::start(self, tested, &folder)?,
            };
            let (record, kept) = now.ask(check, self.patience);
            worker = kept;
            tested.checks.push(record);
            progress(tested)?;
        }
        if let Some(worker) = worker {
            worker.end(tested, self.patience);
            progress(tested)?;
        }
        Ok(())
    }
}

impl Tested {
    /// Of a process that did not end well after its last check: that one has not passed. `None`: it never ended.
    fn died(&mut self, ended: std::io::Result<Option<String>>, said: String) {
        let Some(last) = self.checks.last_mut() else { return };
        last.outcome = Outcome::Crashed;
        last.reasons.push(match ended {
            Ok(Some(status)) => format!("afterwards the process ended: {status}"),
            Ok(None) => "afterwards the process did not end".into(),
            Err(error) => format!("afterwards the process could not be waited for: {error}"),
        });
        last.reasons.extend((!said.is_empty()).then(|| format!("its last words: {said}")));
    }
}

fn told(status: ExitStatus) -> String {
    status.to_string()
}

/// A driver that lists no device.
fn unlisted(manifest: &Path, outcome: Outcome, error: &Error) -> Tested {
    let name = manifest.file_name().map_or("?".into(), |name| name.to_string_lossy().into_owned());
    let mut record = Record::new("devices", "the driver lists its devices");
    (record.outcome, record.reasons) = (outcome, vec![error.in_full()]);
    Tested {
        device: Listed { name, ..Listed::default() },
        manifest: Some(manifest.display().to_string()),
        folder: String::new(),
        checks: vec![record],
    }
}

/// A process that does one check after the other on a device.
struct Worker {
    child: Child,
    /// `None` once it is to end.
    input: Option<ChildStdin>,
    records: Receiver<Record>,
    said: JoinHandle<Vec<u8>>,
}

impl Worker {
    fn start(run: &Run<'_>, tested: &Tested, folder: &Path) -> Result<Self> {
        let mut command = run.command(tested.manifest.as_deref().map(Path::new))?;
        // As one word: a folder may start with a dash.
        let mut output = std::ffi::OsString::from("--output=");
        output.push(folder);
        command.arg("validate").arg(output).arg("--worker").arg(tested.device.index.to_string());
        command.args(run.thorough.then_some("--thorough"));
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().map_err(|source| run.not_started(source))?;
        let (Some(input), Some(output), Some(errors)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(run.not_started(std::io::ErrorKind::BrokenPipe.into()));
        };
        let (send, records) = channel();
        thread::spawn(move || {
            // Drivers may print there, too: what is no record is passed over.
            for record in lines_of(output).filter_map(|line| serde_json::from_str(&line).ok()) {
                if send.send(record).is_err() {
                    return;
                }
            }
        });
        Ok(Self { child, input: Some(input), records, said: all_of(errors) })
    }

    /// What came of a check, and the process where it is still there.
    fn ask(mut self, check: &Check, patience: Duration) -> (Record, Option<Self>) {
        let start = Instant::now();
        let asked = self.input.as_mut().map(|input| writeln!(input, "{}", check.name).and_then(|()| input.flush()));
        let answer = match asked {
            Some(Ok(())) => self.records.recv_timeout(patience),
            _ => Err(RecvTimeoutError::Disconnected),
        };
        let outcome = match answer {
            Ok(record) => return (record, Some(self)),
            Err(RecvTimeoutError::Timeout) => Outcome::Hung,
            Err(RecvTimeoutError::Disconnected) => Outcome::Crashed,
        };
        // What crashes is given the time to; what hangs is not.
        let grace = if outcome == Outcome::Crashed { Duration::from_secs(10) } else { Duration::ZERO };
        let status = end_within(&mut self.child, grace);
        let mut reasons = vec![match (outcome, status) {
            (Outcome::Hung, _) => format!("it was not done after {} s, and was ended", patience.as_secs_f64()),
            (_, Ok(Some(status))) => format!("the process ended: {status}"),
            (_, Ok(None)) => "the process closed its output, did not end, and was ended".into(),
            (_, Err(error)) => format!("the process could not be waited for: {error}"),
        }];
        let said = self.last_words();
        reasons.extend((!said.is_empty()).then(|| format!("its last words: {said}")));
        let seconds = start.elapsed().as_secs_f64();
        (Record { outcome, reasons, seconds, ..Record::new(&check.name, &check.about) }, None)
    }

    /// What an ended process said since its last check began, messages of the layer among it.
    fn last_words(self) -> String {
        let bytes = self.said.join().unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let text =
            text.rsplit_once(BEGINS).map_or(&*text, |(_, rest)| rest.split_once('\n').map_or("", |(_, rest)| rest));
        text.char_indices().rev().nth(LAST_WORDS).map_or(text, |(start, _)| &text[start..]).trim().to_owned()
    }

    /// Lets the process end by itself.
    fn end(mut self, tested: &mut Tested, patience: Duration) {
        // Its input ends, and so does its work.
        drop(self.input.take());
        let status = end_within(&mut self.child, patience);
        if !matches!(status, Ok(Some(status)) if status.success()) {
            tested.died(status.map(|status| status.map(told)), self.last_words());
        }
    }
}

/// The other side: does each check that `input` names, and tells `output` what came of it.
pub fn work(place: Place<'_>, input: impl BufRead, mut output: impl Write) -> Result<()> {
    end_with_parent();
    let checks = Check::all();
    for name in input.lines() {
        let name = name.map_err(|source| Error::file("standard input", "read", source))?;
        let Some(check) = checks.iter().find(|check| check.name == name) else {
            return Err(Error::Usage(format!("there is no check {name:?}")));
        };
        // Where standard error is closed nobody listens.
        let _ = writeln!(std::io::stderr(), "{BEGINS}{name}");
        let record = check.run(place);
        let line = serde_json::to_string(&record).unwrap_or_default();
        // A line of its own, whatever a driver printed before.
        write!(output, "\n{line}\n")
            .and_then(|()| output.flush())
            .map_err(|source| Error::file("standard output", "write", source))?;
    }
    Ok(())
}
