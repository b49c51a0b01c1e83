//! A run of a suite on a device. In flow pictures, out flow their records, one after the other or several at a time.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use xxhash_rust::xxh3::Xxh3;

use super::judge::{self, Limits, Sampled, chance};
use super::pictures;
use super::record::{Device, Folder, Measured, Outcome, Record, Shard, files};
use super::reference::Reference;
use super::suite::{Picture, SCHEMA, Suite};
use crate::compare::compare;
use crate::gpu::{DeviceInfo, Gpu, Instance};
use crate::image::{FloatImage, OutputFile, Stored, encode_exr, make_folder};
use crate::options::{Model, RenderArgs};
use crate::passes::{self, Rendered, batches_of};
use crate::plan::Plan;
use crate::report::{float_image, metadata};
use crate::scene::{Overrides, Scene};
use crate::{Error, Result, shell};

/// Batches that standard errors have to be from to tell something.
const FEWEST_BATCHES: u32 = 8;

/// What is wanted of a run.
#[derive(Clone, Debug)]
pub struct Wishes {
    /// References are made, not compared with.
    pub blesses: bool,
    /// Parts of the names of pictures; of none all are meant.
    pub filter: Vec<String>,
    /// The part of the suite.
    pub shard: Option<Shard>,
    /// How many pictures are rendered at a time.
    pub jobs: usize,
    /// The seed of pictures that are sampled at random, in the place of their own.
    pub seed: Option<u64>,
}

/// A suite that is run.
pub struct Run<'a> {
    /// What is run.
    pub suite: &'a Suite,
    /// How.
    pub wishes: &'a Wishes,
    /// Where records and pictures go.
    pub folder: &'a Folder,
    /// Vulkan, and the device in it.
    pub instance: &'a Arc<Instance>,
    /// The device.
    pub device: &'a DeviceInfo,
}

/// A picture, ready to be rendered.
struct Ready {
    scene: Scene,
    plan: Plan,
    is_random: bool,
    limits: Limits,
    /// The options as a reference has them: paths start at the suite.
    options: String,
    reference: Result<Option<Reference>>,
    fingerprint: String,
}

/// A picture that was rendered.
struct Made {
    rendered: Rendered,
    image: FloatImage,
    stderr: Option<(Vec<[f32; 3]>, u32)>,
}

impl Run<'_> {
    /// The pictures that are meant, each with its place in the suite.
    pub fn chosen(suite: &Suite, wishes: &Wishes) -> Result<Vec<usize>> {
        let parts = &wishes.filter;
        let is_meant = |picture: &Picture| parts.is_empty() || parts.iter().any(|part| picture.name.contains(part));
        let meant: Vec<usize> = (0..suite.pictures.len()).filter(|&number| is_meant(&suite.pictures[number])).collect();
        // A part that none has is a slip, whatever the others find.
        let is_found = |part: &&String| meant.iter().any(|&number| suite.pictures[number].name.contains(part.as_str()));
        if let Some(part) = parts.iter().find(|part| !is_found(part)) {
            let path = suite.path.display();
            return Err(Error::Check(format!("{path}: no picture has {part} in its name")));
        }
        Ok(meant.into_iter().filter(|&number| wishes.shard.is_none_or(|shard| shard.has(number))).collect())
    }

    /// Renders and compares; `progress` hears of each picture when it is done.
    pub fn run(&self, progress: &(dyn Fn(&Record) + Sync)) -> Result<Vec<Record>> {
        let chosen = Self::chosen(self.suite, self.wishes)?;
        if self.wishes.blesses {
            make_folder(&self.suite.references, "is a file; the suite's references are a folder: name one")?;
        }
        let program = program();
        let next = AtomicUsize::new(0);
        let done = Mutex::new(Ok(Vec::with_capacity(chosen.len())));
        let work = || {
            let mut gpu = None;
            while let Some(&number) = chosen.get(next.fetch_add(1, Ordering::Relaxed)) {
                let record = self.record(&mut gpu, number, program);
                if let Ok(record) = &record {
                    progress(record);
                }
                let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                match (record, &mut *done) {
                    (Ok(record), Ok(records)) => records.push(record),
                    (Err(error), Ok(_)) => *done = Err(error),
                    (_, Err(_)) => {}
                }
                if done.is_err() {
                    return;
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.wishes.jobs.min(chosen.len()) {
                scope.spawn(work);
            }
            work();
        });
        let mut records: Vec<Record> = done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        records.sort_by_key(|record| record.number);
        Ok(records)
    }

    /// Renders and judges one. What is wrong with a picture is in its record; an error ends the run.
    fn record(&self, gpu: &mut Option<Gpu>, number: usize, program: u128) -> Result<Record> {
        let start = Instant::now();
        let picture = &self.suite.pictures[number];
        let mut record = self.blank(number, picture);
        let ready = match self.ready(picture, program) {
            Ok(ready) => ready,
            Err(error) => {
                record.reasons.push(error.in_full());
                self.keep(&mut record, start)?;
                return Ok(record);
            }
        };
        let is_there = !self.wishes.blesses || self.suite.reference(picture).exists();
        if let Some(kept) = self.folder.kept(&picture.name, &ready.fingerprint).filter(|_| is_there) {
            return Ok(kept);
        }
        record.fingerprint.clone_from(&ready.fingerprint);
        let open = match &*gpu {
            Some(gpu) => gpu.clone(),
            None => gpu.insert(Gpu::open(self.instance, self.device.clone())?).clone(),
        };
        let rendered = passes::check(&open, &ready.plan)
            .map_err(Error::from)
            .and_then(|()| passes::render(&open, &ready.scene, &ready.plan, &mut |_| {}));
        match rendered {
            Ok(rendered) => {
                let made = Made::new(rendered, &ready);
                record.samples = made.rendered.samples;
                record.gpu_ms = made.rendered.gpu_ms();
                self.judge(picture, &ready, &made, &mut record)?;
            }
            Err(error) => {
                record.reasons.push(error.in_full());
                // A device that was lost is opened again for the next one.
                gpu.take();
            }
        }
        self.expect(picture, &mut record);
        self.keep(&mut record, start)?;
        Ok(record)
    }

    fn keep(&self, record: &mut Record, start: Instant) -> Result<()> {
        record.seconds = start.elapsed().as_secs_f64();
        self.folder.keep(record)
    }

    /// What is known of it before anything is done: that it came to nothing.
    fn blank(&self, number: usize, picture: &Picture) -> Record {
        let DeviceInfo { name, driver, api, .. } = self.device;
        let suite = self.suite.path.display().to_string();
        Record {
            fingerprint: String::new(),
            number,
            name: picture.name.clone(),
            why: picture.why.clone(),
            outcome: Outcome::Error,
            reasons: Vec::new(),
            measures: Vec::new(),
            samples: 0,
            seconds: 0.0,
            gpu_ms: None,
            device: Device { name: name.clone(), driver: driver.clone(), api: api.clone() },
            render: render_command(picture),
            regress: shell::line(["vitrum", "regress", &suite, "--filter", &picture.name]),
            reference: Vec::new(),
            has_result: false,
            has_reference: false,
        }
    }

    fn ready(&self, picture: &Picture, program: u128) -> Result<Ready> {
        let mut scene = Scene::load(picture.scene.as_deref(), &Overrides::of(&picture.options))?;
        let given = picture.options.clone().or(scene.render.clone());
        let mut plan = Plan::new(&scene, &given)?;
        scene.frame(f64::from(plan.size.width) / f64::from(plan.size.height));
        let is_random = plan.model == Model::Path;
        let env = given.env.clone().map(|path| self.in_suite(&path));
        let options = RenderArgs { env, ..plan.options.clone() }.to_string();
        if let (true, Some(seed)) = (is_random, self.wishes.seed) {
            plan = Plan::new(&scene, &RenderArgs { seed: Some(seed), ..given })?;
        }
        let driver = self.suite.driver(&self.device.name, &self.device.driver);
        let limits = self.suite.limits(picture, driver, is_random);
        let path = self.suite.reference(picture);
        let reference = if path.exists() { Reference::read(&path).map(Some) } else { Ok(None) };

        let mut hasher = Xxh3::new();
        hasher.update(&program.to_le_bytes());
        // What is blessed depends on no reference, and replaces it.
        for file in scene.files.iter().chain((!self.wishes.blesses).then_some(&path)) {
            hasher.update(&std::fs::read(file).unwrap_or_default());
        }
        let DeviceInfo { name, driver: of, api, .. } = self.device;
        let rest = (SCHEMA, &picture.name, &plan.options, &limits, self.wishes.blesses, name, of, api, driver);
        hasher.update(format!("{rest:?}").as_bytes());
        let fingerprint = format!("{:032x}", hasher.digest128());
        Ok(Ready { scene, plan, is_random, limits, options, reference, fingerprint })
    }

    /// A path as the suite has it, which is the same wherever that is run from.
    fn in_suite(&self, path: &Path) -> std::path::PathBuf {
        path.strip_prefix(self.suite.folder()).unwrap_or(path).into()
    }

    /// Compares what was made with its reference, or puts it in its place.
    fn judge(&self, picture: &Picture, ready: &Ready, made: &Made, record: &mut Record) -> Result<()> {
        let provenance = self.provenance(picture, ready, made);
        let written = |source| Error::file(self.folder.path(), "write", source);
        let [exr, png, reference_png, error_png] = files(&picture.name);
        let bytes = encode_exr(&float_image(&made.rendered, &ready.plan), &provenance).map_err(written)?;
        self.folder.write_picture(&exr, &bytes)?;
        record.has_result = true;

        let same_size = |reference: &&Reference| {
            let size = |image: &FloatImage| (image.width, image.height);
            size(&reference.image) == size(&made.image)
        };
        let reference = ready.reference.as_ref().ok().and_then(Option::as_ref);
        let comparable = reference.filter(same_size);
        let like = comparable.map_or(&made.image, |reference| &reference.image);
        let shown = pictures::shown(&made.image, like).map_err(written)?;
        self.folder.write_picture(&png, &shown)?;
        let mut broken = Vec::new();
        if let Some(reference) = comparable {
            record.has_reference = true;
            record.reference.clone_from(&reference.provenance);
            let shown = pictures::shown(&reference.image, like).map_err(written)?;
            self.folder.write_picture(&reference_png, &shown)?;
            let error = pictures::error(&made.image, &reference.image).map_err(written)?;
            self.folder.write_picture(&error_png, &error)?;
            broken = compared(made, reference, &ready.limits, record);
            broken.extend(made.unjudged(ready));
        }
        if self.wishes.blesses {
            return self.bless(picture, ready, made, provenance, record);
        }
        let unusable = match (&ready.reference, comparable) {
            (Err(error), _) => Some(error.in_full()),
            (Ok(None), _) => {
                let path = self.suite.reference(picture);
                Some(format!("there is no reference {}; make it with --bless", path.display()))
            }
            (Ok(Some(reference)), _) if reference.options != ready.options => {
                let (was, is) = differing(&reference.options, &ready.options);
                Some(format!("the reference was made with {was}, this with {is}; make it again with --bless"))
            }
            (Ok(Some(_)), None) => Some("the reference is of another size; make it again with --bless".into()),
            (Ok(Some(_)), Some(_)) => None,
        };
        (record.outcome, record.reasons) = match unusable {
            Some(why) => (Outcome::NoReference, vec![why]),
            None if broken.is_empty() => (Outcome::Passed, broken),
            None => (Outcome::Failed, broken),
        };
        Ok(())
    }

    /// Makes the reference, unless it is there as it would be made.
    fn bless(
        &self,
        picture: &Picture,
        ready: &Ready,
        made: &Made,
        provenance: Vec<(String, String)>,
        record: &mut Record,
    ) -> Result<()> {
        if let Some(why) = made.unjudged(ready) {
            record.reasons = vec![why];
            return Ok(());
        }
        let before = ready.reference.as_ref().ok().and_then(Option::as_ref);
        let is_same = before.is_some_and(|before| {
            before.image.pixels == made.image.pixels && before.stderr == made.stderr && before.options == ready.options
        });
        let is_there = self.suite.reference(picture).exists();
        if !is_same {
            let (image, stderr, options) = (made.image.clone(), made.stderr.clone(), ready.options.clone());
            let reference = Reference { image, stderr, options, provenance };
            let path = self.suite.reference(picture);
            let bytes = reference.encode().map_err(|source| Error::file(&path, "write", source))?;
            OutputFile::new(&path)?.write(&bytes)?;
        }
        record.outcome = match (is_same, is_there) {
            (true, _) => Outcome::Unchanged,
            (false, true) => Outcome::Changed,
            (false, false) => Outcome::New,
        };
        Ok(())
    }

    /// What the reference and the result say of their making.
    fn provenance(&self, picture: &Picture, ready: &Ready, made: &Made) -> Vec<(String, String)> {
        let mut texts = metadata(self.device, &ready.scene, &ready.plan, made.rendered.samples);
        let scene = picture.scene.as_ref().map(|scene| self.in_suite(scene).display().to_string());
        for (key, text) in &mut texts {
            match key.as_str() {
                "vitrum:scene" => *text = scene.clone().unwrap_or_else(|| "built-in".into()),
                "vitrum:options" => text.clone_from(&ready.options),
                _ => {}
            }
        }
        texts.push(("vitrum:picture".into(), picture.name.clone()));
        texts.push(("vitrum:samples".into(), made.rendered.samples.to_string()));
        texts.push(("vitrum:seed".into(), ready.plan.seed.to_string()));
        texts
    }

    /// What is known of the driver.
    fn expect(&self, picture: &Picture, record: &mut Record) {
        let driver = self.suite.driver(&self.device.name, &self.device.driver);
        let fault = driver.and_then(|driver| driver.faults.iter().find(|fault| fault.picture == picture.name));
        let Some(fault) = fault else { return };
        match record.outcome {
            Outcome::Failed | Outcome::Error => {
                record.outcome = Outcome::KnownFault;
                record.reasons.insert(0, fault.why.clone());
            }
            Outcome::Passed => {
                record.outcome = Outcome::FaultGone;
                record.reasons = vec![format!("the suite knows of a fault that is gone ({}); take it out", fault.why)];
            }
            _ => {}
        }
    }
}

/// The options that only one of two lists has, of each.
fn differing(a: &str, b: &str) -> (String, String) {
    let split = |text: &str| -> Vec<String> {
        text.split("--")
            .map(str::trim)
            .filter(|option| !option.is_empty())
            .map(|option| format!("--{option}"))
            .collect()
    };
    let (a, b) = (split(a), split(b));
    let only = |of: &[String], other: &[String]| {
        let only: Vec<_> = of.iter().filter(|option| !other.contains(option)).map(String::as_str).collect();
        if only.is_empty() { "fewer options".to_owned() } else { only.join(" ") }
    };
    (only(&a, &b), only(&b, &a))
}

impl Made {
    fn new(rendered: Rendered, ready: &Ready) -> Self {
        let size = ready.plan.size;
        let pixels = rendered.radiance.clone();
        let image = FloatImage { width: size.width, height: size.height, pixels, layers: Vec::new() };
        let batches = batches_of(&ready.plan, rendered.samples);
        let stderr = rendered.counts.as_ref().and_then(|counts| counts.stderr.clone()).filter(|_| ready.is_random);
        Self { image, stderr: stderr.map(|stderr| (stderr, batches)), rendered }
    }

    /// Why it cannot be judged as it should be, if so.
    fn unjudged(&self, ready: &Ready) -> Option<String> {
        if !ready.limits.needs_errors() {
            return None;
        }
        match &self.stderr {
            None => Some(format!("model {} has no standard errors to judge by", ready.plan.model.name())),
            Some((_, batches)) if *batches < FEWEST_BATCHES => {
                Some(format!("{} samples are too few to judge by their spread; give it 64", self.rendered.samples))
            }
            Some(_) => None,
        }
    }
}

/// Fills the measures in; what is above its limit comes back.
fn compared(made: &Made, reference: &Reference, limits: &Limits, record: &mut Record) -> Vec<String> {
    let stored = |image: &FloatImage| Stored::Linear(image.clone());
    let Ok(comparison) = compare(stored(&made.image), stored(&reference.image)) else {
        // They are of one size.
        return Vec::new();
    };
    let mut values = judge::metrics(&comparison);
    if let (Some((own, batches)), Some((other, others))) = (&made.stderr, &reference.stderr) {
        let test = Sampled { mean: &made.image.pixels, stderr: own, batches: *batches };
        values.extend(chance(test, Sampled { mean: &reference.image.pixels, stderr: other, batches: *others }));
    }
    let measured = |&(measure, value): &(judge::Measure, f64)| Measured {
        name: measure.name().into(),
        value: value.is_finite().then_some(value),
        limit: limits.of(measure),
    };
    record.measures = values.iter().map(measured).collect();
    limits.broken(&values)
}

/// The command that renders it alone.
fn render_command(picture: &Picture) -> String {
    let words = ["vitrum".to_owned(), "render".to_owned()].into_iter().chain(picture.options.words());
    let words = words.chain([format!("-o={}.exr", picture.name)]);
    shell::line(words.chain(picture.scene.as_ref().map(|scene| scene.display().to_string())))
}

/// Tells this program from other builds of it.
fn program() -> u128 {
    let bytes = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
    xxhash_rust::xxh3::xxh3_128(&bytes)
}
