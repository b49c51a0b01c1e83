//! A render that can be interrupted: what it has found so far, in a file, and where it goes on. In flow images of the device and how far
//! they are, out flows a file that a later run of the same render reads.
//!
//! The file: a line of JSON, [`Head`], then the images of the model, texel after texel as the device has them.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use crate::gpu::{Commands, Gpu, Image, shaders};
use crate::image::OutputFile;
use crate::options::Trace;
use crate::plan::{Budget, Plan};
use crate::{Error, Result};

/// A version of the file.
const FORMAT: u32 = 1;

/// The longest first line that a checkpoint has.
const MOST_HEAD: u64 = 1 << 16;

/// How long a render works before what it found is saved, at least, and how many times as long as saving takes.
const LEAST_WORK: Duration = Duration::from_secs(1);
const WORK_PER_SAVE: u32 = 20;

/// What shapes a picture, by name: renders with the same values go through the same states.
type Key = Vec<(String, String)>;

/// What tells a render of the scene with such a fingerprint from others.
pub(super) fn key(gpu: &Gpu, plan: &Plan, trace: Option<Trace>, scene: Option<u128>) -> Key {
    let device = gpu.info();
    let samples = match plan.budget {
        Budget::Samples(samples) => samples.to_string(),
        Budget::Seconds { most, .. } => format!("as needed (at most {most})"),
    };
    let shader = match trace {
        Some(Trace::Hardware) => &shaders::PATH_HARDWARE_COMP,
        _ => &shaders::PATH_COMP,
    };
    let entries = [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("shaders", format!("{:016x}", xxh3_64(shader.spirv()))),
        ("device", format!("{}, {}", device.name, device.driver)),
        ("--trace", trace.map_or("none", Trace::name).to_owned()),
        ("--size", plan.size.to_string()),
        ("--samples", samples),
        ("--max-depth", plan.max_depth.unwrap_or(0).to_string()),
        ("--seed", plan.seed.to_string()),
        ("effects", plan.effects.names().join(",")),
        ("scene", scene.map(|hash| format!("{hash:032x}")).unwrap_or_default()),
    ];
    entries.map(|(name, value)| (name.to_owned(), value)).into()
}

/// Whether the file at `path` is a checkpoint, of whatever render.
pub fn is_checkpoint(path: &Path) -> bool {
    let mut line = Vec::new();
    let read = |file| BufReader::new(file).take(MOST_HEAD).read_until(b'\n', &mut line);
    File::open(path).and_then(read).is_ok() && serde_json::from_slice::<Head>(&line).is_ok()
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct Progress {
    /// Rounds that are done.
    pub(super) rounds: u32,
    /// Rows of the next one that are.
    pub(super) rows: u32,
}

impl Progress {
    /// After so many of `height` rows of a round, counted from 1.
    pub(super) fn within(round: u32, rows: u32, height: u32) -> Self {
        if rows < height { Self { rounds: round - 1, rows } } else { Self { rounds: round, rows: 0 } }
    }
}

/// The first line of a file.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    vitrum_checkpoint: u32,
    key: Key,
    #[serde(flatten)]
    progress: Progress,
    bytes: u64,
    xxh3: String,
}

impl Head {
    /// A checksum that has seen the head; the images follow.
    fn hash(&self) -> Xxh3 {
        let mut hash = Xxh3::new();
        for (name, value) in &self.key {
            hash.update(name.as_bytes());
            hash.update(&[0]);
            hash.update(value.as_bytes());
            hash.update(&[0]);
        }
        hash.update(&self.progress.rounds.to_le_bytes());
        hash.update(&self.progress.rows.to_le_bytes());
        hash
    }
}

/// Where a render is saved from time to time.
pub(super) struct Checkpoint {
    file: OutputFile,
    key: Key,
    last: Instant,
    pause: Duration,
    /// What the last attempt to save said, if it failed.
    pub(super) failure: Option<Error>,
}

impl Checkpoint {
    /// For the render that `key` tells from others.
    pub(super) fn new(path: &Path, key: Key) -> Result<Self> {
        let file = OutputFile::new(path)?;
        Ok(Self { file, key, last: Instant::now(), pause: LEAST_WORK, failure: None })
    }

    /// Puts what the file holds into `images`, and says how far it is: at the start where there is no file. Of a render of `most` rounds
    /// and so many rows.
    ///
    /// # Errors
    ///
    /// If the file is no checkpoint, is damaged, or is that of another render.
    pub(super) fn resume(
        &self,
        commands: &mut Commands,
        images: &[&Image],
        most: Progress,
        height: u32,
    ) -> Result<Progress> {
        let path = self.file.path();
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Progress::default()),
            Err(error) => return Err(Error::file(path, "read", error)),
        };
        let mut reader = BufReader::new(file);
        let mut line = Vec::new();
        let read = |source| Error::file(path, "read", source);
        reader.by_ref().take(MOST_HEAD).read_until(b'\n', &mut line).map_err(read)?;
        let head: Head = serde_json::from_slice(&line)
            .map_err(|_| Error::input(path, 0, "is no checkpoint of this program; name another file"))?;
        if head.vitrum_checkpoint != FORMAT {
            let message = format!("is of version {}, this program reads {FORMAT}; delete it", head.vitrum_checkpoint);
            return Err(Error::input(path, 0, message));
        }
        for (held, wanted) in head.key.iter().zip(&self.key) {
            if held != wanted {
                let (name, held, wanted) = (&held.0, &held.1, &wanted.1);
                let message = match name.as_str() {
                    "scene" => "holds a render of another scene, or with other --ior, --roughness or --env".into(),
                    "shaders" => "holds a render by another build of this program".into(),
                    _ => format!("holds a render with {name} {held}, this one has {wanted}"),
                };
                let advice = "go on with that one, or name another file";
                return Err(Error::input(path, 0, format!("{message}; {advice}")));
            }
        }
        let damaged = |what: &str| Error::input(path, 0, format!("is damaged: {what}; delete it to start over"));
        let sizes: Vec<u64> = images.iter().map(|image| image.bytes()).collect();
        if head.key.len() != self.key.len() || head.bytes != sizes.iter().sum::<u64>() {
            return Err(damaged("its head is not that of its images"));
        }
        if head.progress > most || head.progress.rows >= height {
            return Err(damaged("it is farther than the render can be"));
        }
        let mut hash = head.hash();
        for (image, size) in images.iter().zip(sizes) {
            let mut texels = Vec::new();
            reader.by_ref().take(size).read_to_end(&mut texels).map_err(read)?;
            if texels.len() as u64 != size {
                return Err(damaged("its end is missing"));
            }
            hash.update(&texels);
            commands.write_image(image, &texels)?;
        }
        if format!("{:032x}", hash.digest128()) != head.xxh3 {
            return Err(damaged("its checksum is another one"));
        }
        match reader.read(&mut [0]).map_err(read)? {
            0 => Ok(head.progress),
            _ => Err(damaged("something follows its end")),
        }
    }

    /// Whether it is time to save.
    pub(super) fn is_due(&self) -> bool {
        self.last.elapsed() >= self.pause
    }

    /// Saves `images`. That a disk is full is no reason to stop: the file before stays, and `failure` tells.
    pub(super) fn save(&mut self, commands: &mut Commands, images: &[&Image], progress: Progress) {
        let start = Instant::now();
        self.failure = self.write(commands, images, progress).err();
        self.last = Instant::now();
        self.pause = LEAST_WORK.max(start.elapsed() * WORK_PER_SAVE);
    }

    fn write(&self, commands: &mut Commands, images: &[&Image], progress: Progress) -> Result<()> {
        let bytes = images.iter().map(|image| image.bytes()).sum();
        let mut head = Head { vitrum_checkpoint: FORMAT, key: self.key.clone(), progress, bytes, xxh3: String::new() };
        let mut hash = head.hash();
        let mut all = Vec::new();
        for image in images {
            let texels = commands.read_image(image)?;
            hash.update(&texels);
            all.push(texels);
        }
        head.xxh3 = format!("{:032x}", hash.digest128());
        self.file.write_with(|file| {
            serde_json::to_writer(&mut *file, &head)?;
            file.write_all(b"\n")?;
            all.iter().try_for_each(|texels| file.write_all(texels))
        })
    }
}
