//! The surroundings of one check: devices opened under the layer, and what the layer says until they are gone.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use xxhash_rust::xxh3::xxh3_128;

use super::known;
use super::record::{Outcome, Picture, Record, Said};
use crate::gpu::{Gpu, GpuError, Handicap, Instance, Message, Messages, Watch, Witness};
use crate::image::{FloatImage, OutputFile};
use crate::regress::shown;
use crate::{Error, Result};

/// Why a check did not pass.
#[derive(Debug)]
pub enum Trouble {
    /// What was to be seen was not.
    Failed(String),
    /// It cannot be done here.
    Skipped(String),
}

impl<E: Into<Error>> From<E> for Trouble {
    fn from(error: E) -> Self {
        Self::Failed(error.into().in_full())
    }
}

/// How the body of a check ends.
pub type Verdict = Result<(), Trouble>;

/// Fails with the reason, unless it holds.
pub fn hold(holds: bool, otherwise: impl FnOnce() -> String) -> Verdict {
    if holds { Ok(()) } else { Err(Trouble::Failed(otherwise())) }
}

/// Where and how checks are done.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The index of the device.
    pub device: usize,
    /// Where pictures go, and what else is written.
    pub folder: &'a Path,
    /// What takes minutes is done, too.
    pub thorough: bool,
}

/// One check on its way.
pub struct Session<'a> {
    /// Where it is done.
    pub place: Place<'a>,
    watch: Watch,
    opened: Vec<Arc<Messages>>,
    witnesses: Vec<Witness>,
    record: Record,
}

impl<'a> Session<'a> {
    /// Runs `body` and tells what came of it.
    pub fn run(
        (name, about, watch): (&str, &str, Watch),
        place: Place<'a>,
        body: impl FnOnce(&mut Self) -> Verdict,
    ) -> Record {
        let start = Instant::now();
        let record = Record::new(name, about);
        let mut session = Self { place, watch, opened: Vec::new(), witnesses: Vec::new(), record };
        let verdict = body(&mut session);
        let Self { opened, witnesses, mut record, .. } = session;
        match verdict {
            Ok(()) => {}
            Err(Trouble::Skipped(why)) => {
                record.outcome = Outcome::Skipped;
                record.reasons.push(why);
            }
            Err(Trouble::Failed(why)) => record.reasons.push(why),
        }
        for (holders, bytes) in witnesses.iter().filter_map(Witness::held) {
            record.reasons.push(format!("{holders} things still hold the device after the check, and {bytes} bytes"));
        }
        for message in opened.iter().flat_map(|messages| messages.all()) {
            hear(&mut record, message, None, watch);
        }
        let counting: Vec<_> = record.said.iter().filter(|said| said.allowed.is_none()).collect();
        if let Some(first) = counting.first() {
            let count: usize = counting.iter().map(|said| said.times).sum();
            let first = first.message.text.lines().next().unwrap_or_default();
            record.reasons.push(format!("the validation layer has {count} messages, the first: {first}"));
        }
        // One that was skipped has its reason alone.
        if record.reasons.len() > usize::from(record.outcome == Outcome::Skipped) {
            record.outcome = Outcome::Failed;
        } else if let Some(why) = record.said.iter().find_map(|said| known::unable(&said.message)) {
            (record.outcome, record.reasons) = (Outcome::Skipped, vec![why]);
        }
        record.seconds = start.elapsed().as_secs_f64();
        record
    }

    /// The device, opened under the layer of this check.
    pub fn open(&mut self) -> Result<Gpu> {
        self.open_with(Handicap::default())
    }

    /// The same with something missing.
    pub fn open_with(&mut self, handicap: Handicap) -> Result<Gpu> {
        let instance = Instance::watched(self.watch)?;
        self.open_in(&instance, handicap)
    }

    /// The same of an instance made for something special.
    pub fn open_in(&mut self, instance: &Arc<Instance>, handicap: Handicap) -> Result<Gpu> {
        self.listen(instance);
        let info = instance.devices()?.into_iter().nth(self.place.device).ok_or(GpuError::NoDevice)?;
        let gpu = Gpu::open(instance, info.with_handicap(handicap))?;
        self.witnesses.push(gpu.witness());
        Ok(gpu)
    }

    /// What is looked at.
    pub fn watch(&self) -> Watch {
        self.watch
    }

    /// Something worth knowing.
    pub fn fact(&mut self, fact: impl Into<String>) {
        self.record.facts.push(fact.into());
    }

    /// From now on what is said of `instance` is of this check.
    pub fn listen(&mut self, instance: &Instance) {
        let messages = instance.messages();
        if !self.opened.iter().any(|known| Arc::ptr_eq(known, &messages)) {
            messages.echo();
            self.opened.push(messages);
        }
    }

    /// Something that the layer said, and why it counts for nothing, if it does not.
    pub fn hear(&mut self, message: Message, allowed: Option<String>) {
        hear(&mut self.record, message, allowed, self.watch);
    }

    /// Keeps a picture as evidence.
    pub fn keep(&mut self, name: &str, image: &FloatImage) -> Result<()> {
        let file = format!("{}{name}.png", self.record.name.replace('/', "-"));
        let path = self.place.folder.join(&file);
        let bytes = shown(image, image).map_err(|source| Error::file(&path, "write", source))?;
        OutputFile::new(&path)?.write(&bytes)?;
        let hash = format!("{:032x}", xxh3_128(bytemuck::cast_slice(&image.pixels)));
        let size = [image.width, image.height];
        self.record.pictures.push(Picture { name: name.into(), size, hash, file });
        Ok(())
    }
}

/// The same message again is counted, not repeated.
fn hear(record: &mut Record, message: Message, allowed: Option<String>, watch: Watch) {
    let allowed = allowed.or_else(|| known::allowed(&message, watch).map(String::from));
    match record.said.iter_mut().find(|said| said.message.is_like(&message) && said.allowed == allowed) {
        Some(said) => said.times += 1,
        None => record.said.push(Said { message, times: 1, allowed }),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::gpu::{Buffer, BufferDesc, BufferUse, Commands};
    use crate::options::{Model, RenderArgs, Size, Trace};
    use crate::passes::Renderer;
    use crate::plan::Plan;
    use crate::scene::Scene;

    /// What comes of `body` on the first device; `None` where there is none.
    fn run(body: impl FnOnce(&mut Session<'_>) -> Verdict) -> Option<Record> {
        let has = Instance::watched(Watch::Synchronization).and_then(|instance| instance.choose(Some("0"))).is_ok();
        assert!(has || std::env::var_os("VITRUM_REQUIRE_DEVICE").is_none(), "no device");
        let folder = tempfile::tempdir().expect("a folder");
        has.then(|| {
            let place = Place { device: 0, folder: folder.path(), thorough: false };
            Session::run(("a check", "", Watch::Synchronization), place, body)
        })
    }

    fn buffer(gpu: &Gpu, name: &str, usage: BufferUse) -> Result<Buffer> {
        Ok(Buffer::new(gpu, &BufferDesc { name, size: 64, usage })?)
    }

    #[test]
    fn what_is_right_passes() {
        let Some(record) = run(|session| {
            buffer(&session.open()?, "right", BufferUse::Storage)?;
            Ok(())
        }) else {
            return;
        };
        assert_eq!((record.outcome, record.said.len()), (Outcome::Passed, 0), "{record:?}");
    }

    #[test]
    fn what_is_left_on_the_device_fails() {
        let Some(record) = run(|session| {
            std::mem::forget(buffer(&session.open()?, "left", BufferUse::Storage)?);
            Ok(())
        }) else {
            return;
        };
        assert_eq!(record.outcome, Outcome::Failed);
        assert!(record.reasons[0].contains("still hold the device"), "{record:?}");
    }

    #[test]
    fn what_the_layer_says_fails_and_is_counted_once() {
        let Some(record) = run(|session| {
            let gpu = session.open()?;
            let mut commands = Commands::new(&gpu)?;
            // Read from while it was made to be written to alone.
            let (from, to) = (buffer(&gpu, "wrong", BufferUse::Readback)?, buffer(&gpu, "to", BufferUse::Readback)?);
            for _ in 0..2 {
                commands.run(|cmd| cmd.timed("a pass", |cmd| cmd.copy_buffer(&from, &to)))?;
            }
            Ok(())
        }) else {
            return;
        };
        assert_eq!(record.outcome, Outcome::Failed);
        let said = record.said.iter().find(|said| said.message.names("wrong")).expect("it is named");
        assert_eq!((said.times, &said.message.passes[..]), (2, &["a pass".to_owned()][..]), "{record:?}");
        assert!(record.reasons[0].contains("the validation layer has"), "{record:?}");
    }

    #[test]
    fn what_cannot_be_done_is_skipped_unless_the_layer_complains() {
        let skip = |session: &mut Session<'_>, leaves: bool| {
            let left = buffer(&session.open()?, "left", BufferUse::Storage)?;
            if leaves {
                std::mem::forget(left);
            }
            Err(Trouble::Skipped("not here".into()))
        };
        let Some(record) = run(|session| skip(session, false)) else { return };
        assert_eq!((record.outcome, record.reasons), (Outcome::Skipped, vec!["not here".to_owned()]));
        let record = run(|session| skip(session, true)).expect("a device");
        assert_eq!(record.outcome, Outcome::Failed, "{record:?}");
    }

    /// The layer tells what is left when a device goes: everything, where it is taken from under a renderer.
    #[test]
    fn everything_on_a_device_has_a_name() {
        if run(|_| Ok(())).is_none() {
            return;
        }
        let instance = Instance::watched(Watch::Synchronization).expect("the layer");
        let device = instance.choose(Some("0")).expect("a device");
        let gpu = Gpu::open(&instance, device).expect("a device");
        let scene = Scene::of_every_effect().expect("a scene");
        let mut kinds = BTreeSet::new();
        for model in Model::ALL {
            let args = RenderArgs {
                model: Some(model.into()),
                size: Some(Size { width: 16, height: 12 }),
                samples: Some(2),
                trace: (model.traces() && gpu.ray_query()).then_some(Trace::Hardware),
                ..RenderArgs::default()
            };
            let plan = Plan::new(&scene, &args).expect("a plan");
            let renderer = Renderer::new(&gpu, &scene, &plan).expect("a renderer");
            std::mem::forget((renderer.begin(&plan).expect("a picture"), renderer));
        }
        gpu.abandon();
        let said = instance.messages().all();
        std::mem::forget(instance);
        for message in &said {
            assert!(message.rule.contains("vkDestroyDevice"), "{message}");
            for object in &message.objects {
                assert!(object.name.is_some(), "{object:?} of {message}");
                kinds.insert(object.kind.clone());
            }
        }
        println!("{} objects of {kinds:?}", said.len());
        for kind in
            ["BUFFER", "IMAGE", "IMAGE_VIEW", "PIPELINE", "PIPELINE_LAYOUT", "DESCRIPTOR_SET_LAYOUT", "DEVICE_MEMORY"]
        {
            assert!(kinds.contains(kind), "no {kind} among {kinds:?}");
        }
    }
}
