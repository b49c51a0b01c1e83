//! The list of checks: what each is called, what it is for, and what it does.

use super::hardship;
use super::known;
use super::numbers;
use super::pictures::{self, Shot};
use super::record::Record;
use super::session::{Place, Session, Trouble, Verdict};
use crate::effects::Effect;
use crate::gpu::{Fault, Handicap, Watch};
use crate::options::{Model, Trace};

/// Something that is tried on a device.
pub struct Check {
    /// Its name, in parts from the general to the special: `render/tree/software/-dispersion`.
    pub name: String,
    /// What for.
    pub about: String,
    watch: Watch,
    job: Job,
}

enum Job {
    Plant(Fault),
    Render(Shot),
    Tracers(Model),
    Layers(Model),
    Displays,
    Checkpoint,
    Refine,
    Window,
    Lost(Shot),
    Memory(Shot),
    Without(Handicap),
    Limits,
    Numerics,
}

impl Check {
    fn new(name: impl Into<String>, about: impl Into<String>, watch: Watch, job: Job) -> Self {
        Self { name: name.into(), about: about.into(), watch, job }
    }

    /// All of them, in the order in which they are run.
    pub fn all() -> Vec<Self> {
        use Watch::{BestPractices, GpuAssisted, Synchronization};
        let mut all = Vec::new();
        for fault in Fault::ALL {
            let name = format!("layer/{}", fault.name());
            all.push(Self::new(name, fault.about(), fault.watch(), Job::Plant(fault)));
        }
        for (model, trace, name) in ways() {
            let mut add = |variant: &str, about: String, shot: Shot| {
                let name = format!("render/{name}/{variant}");
                all.push(Self::new(name, about, Synchronization, Job::Render(shot)));
            };
            add("plain", "what clear glass calls for is compiled in".into(), Shot::plain(model, trace));
            add("all", "every effect is compiled in".into(), Shot::rich(model, trace));
            for effect in Effect::all().filter(|effect| effect.honoured_by(model)) {
                let shot = Shot { effects: format!("all,-{}", effect.name()), ..Shot::rich(model, trace) };
                add(&format!("-{}", effect.name()), format!("every effect but {}", effect.name()), shot);
            }
        }
        for model in [Model::Tree, Model::Path] {
            let about = "both ways of tracing give the same picture";
            all.push(Self::new(format!("tracers/{}", model.name()), about, Synchronization, Job::Tracers(model)));
        }
        for model in Model::ALL {
            let about = "every extra layer that the model has";
            all.push(Self::new(format!("layers/{}", model.name()), about, Synchronization, Job::Layers(model)));
        }
        let mut add = |name: &str, about: &str, job| all.push(Self::new(name, about, Synchronization, job));
        add("display", "every tone curve", Job::Displays);
        add("checkpoint", "a render that is taken up again comes to the same bits", Job::Checkpoint);
        add("refine", "pictures that grow, are paused, interrupted, and left for others", Job::Refine);
        add("window", "a window that changes its size, to none and back", Job::Window);
        for (model, trace, name) in ways() {
            let about = "the device is lost with one submission after the other";
            add(&format!("lost/{name}"), about, Job::Lost(Shot::plain(model, trace)));
        }
        for (model, trace, name) in ways() {
            add(&format!("memory/{name}"), "less and less memory", Job::Memory(Shot::plain(model, trace)));
        }
        let no_rays = Handicap { no_ray_query: true, ..Handicap::default() };
        add("without/ray-query", "a device without ray queries renders the same", Job::Without(no_rays));
        let no_clock = Handicap { no_timestamps: true, ..Handicap::default() };
        add("without/timestamps", "a device without a clock renders the same", Job::Without(no_clock));
        add("without/large-buffers", "limits as low as Vulkan allows, and lower ones", Job::Limits);
        for (watch, group) in [(GpuAssisted, "gpu-assisted"), (BestPractices, "best-practices")] {
            for (model, trace, name) in ways() {
                for (variant, shot) in [("plain", Shot::plain(model, trace)), ("all", Shot::rich(model, trace))] {
                    let about = match watch {
                        GpuAssisted => "what shaders do to memory, by instructions that the layer adds to them",
                        _ => "what is allowed and yet not advised",
                    };
                    all.push(Self::new(format!("{group}/{name}/{variant}"), about, watch, Job::Render(shot)));
                }
            }
        }
        let about = "the shaders' optics functions against 64-bit arithmetic";
        all.push(Self::new("numerics", about, Synchronization, Job::Numerics));
        all
    }

    /// Those with one of `parts` in their names; of none, all.
    pub fn matching(parts: &[String]) -> Vec<Self> {
        let is_meant = |check: &Self| parts.is_empty() || parts.iter().any(|part| check.name.contains(part.as_str()));
        Self::all().into_iter().filter(is_meant).collect()
    }

    /// Tries it.
    pub fn run(&self, place: Place<'_>) -> Record {
        Session::run((&self.name, &self.about, self.watch), place, |session| match &self.job {
            Job::Plant(fault) => plant(session, *fault),
            Job::Render(shot) => pictures::render(session, shot),
            Job::Tracers(model) => pictures::tracers(session, *model),
            Job::Layers(model) => pictures::layers(session, *model),
            Job::Displays => pictures::displays(session),
            Job::Checkpoint => pictures::checkpoint(session),
            Job::Refine => pictures::refine(session),
            Job::Window => hardship::window(session),
            Job::Lost(shot) => hardship::lost(session, shot),
            Job::Memory(shot) => hardship::memory(session, shot),
            Job::Without(handicap) => hardship::without(session, *handicap),
            Job::Limits => hardship::limits(session),
            Job::Numerics => numbers::numerics(session),
        })
    }
}

/// Every model, and each way of tracing of those that trace, with a name.
fn ways() -> impl Iterator<Item = (Model, Option<Trace>, String)> {
    Model::ALL.into_iter().flat_map(|model| {
        let traces: &[_] = if model.traces() { &[Some(Trace::Software), Some(Trace::Hardware)] } else { &[None] };
        traces.iter().map(move |&trace| {
            let name = trace.map_or(model.name().to_owned(), |trace| format!("{}/{}", model.name(), trace.name()));
            (model, trace, name)
        })
    })
}

/// The layer notices it, and names it.
fn plant(session: &mut Session<'_>, fault: Fault) -> Verdict {
    let (messages, ended) = fault.plant(session.place.device)?;
    let unable = messages.iter().find_map(known::unable);
    let is_seen = messages.iter().any(|message| fault.is_noticed_in(message));
    for message in messages {
        let wanted = fault.is_noticed_in(&message).then(|| "the fault was planted".to_owned());
        session.hear(message, wanted);
    }
    match (is_seen, unable) {
        // Drivers may give up where a fault reaches them.
        (true, _) => Ok(()),
        (false, Some(why)) => Err(Trouble::Skipped(why)),
        (false, None) => {
            ended?;
            let why = "the validation layer does not notice it: what it does not complain of is no proof";
            Err(Trouble::Failed(why.into()))
        }
    }
}
