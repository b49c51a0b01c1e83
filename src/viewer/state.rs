//! What the viewer looks at, and how. In flow files and edits, out flow pictures to be wanted and the command that repeats one.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;
use std::time::Instant;

use super::Options;
use super::meter::Meter;
use super::worker::{Picture, Shot, Wanted};
use crate::Result;
use crate::effects::{Caller, Effect, Selection};
use crate::options::{Model, ModelChoice, RenderArgs, Size};
use crate::scene::{Camera, Overrides, Scene};
use crate::shell;

/// What was changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Edits {
    /// What is rendered.
    pub(super) scene: bool,
    /// By which model, with how many samples: what models have to offer stays.
    pub(super) model: bool,
    /// What is beside.
    pub(super) beside: bool,
    /// How it is shown: exposure, tone curve, colours that stand for numbers.
    pub(super) look: bool,
}

impl Edits {
    pub(super) fn any(self) -> bool {
        self.scene || self.model || self.beside || self.look
    }

    pub(super) fn add(&mut self, other: Self) {
        self.scene |= other.scene;
        self.model |= other.model;
        self.beside |= other.beside;
        self.look |= other.look;
    }
}

/// What is shown of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Shows {
    /// Light, as a screen shows it.
    #[default]
    Light,
    /// Interfaces that scattered it.
    Interfaces,
    /// What `tree` and `path` cut off.
    Discarded,
    /// The standard error of `path` and `double`.
    Error,
}

impl Shows {
    pub(super) const ALL: [Self; 4] = [Self::Light, Self::Interfaces, Self::Discarded, Self::Error];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Interfaces => "interfaces",
            Self::Discarded => "discarded",
            Self::Error => "error",
        }
    }

    /// Whether `model` has it.
    pub(super) fn is_of(self, model: Model) -> bool {
        match self {
            Self::Light => true,
            Self::Interfaces => model != Model::Single,
            Self::Discarded => matches!(model, Model::Tree | Model::Path),
            Self::Error => matches!(model, Model::Path | Model::Double),
        }
    }
}

/// What the picture is held against, on the other side of the wipe.
pub(super) struct Beside {
    /// Materials and surroundings as they were; `None`: those of the picture.
    pub(super) scene: Option<Scene>,
    pub(super) args: RenderArgs,
    pub(super) name: String,
}

/// All of it.
pub(super) struct State {
    pub(super) path: Option<PathBuf>,
    pub(super) scene: Scene,
    /// As it was read.
    before: Scene,
    /// As the viewer was started.
    given: RenderArgs,
    pub(super) args: RenderArgs,
    /// Whether the size was given; else it is the window's.
    pub(super) sized: bool,
    /// What went wrong last, until something else is asked for.
    pub(super) error: Option<String>,
    /// What went well last, until something else is asked for.
    pub(super) notice: Option<String>,
    /// The share of the picture's samples that are done, where more than those that are shown are.
    pub(super) progress: Option<f64>,
    /// The picture, and what is beside it.
    pub(super) pictures: [Option<Picture>; 2],
    pub(super) beside: Option<Beside>,
    /// Where the wipe is, from 0 at the left to 1.
    pub(super) wipe: f32,
    pub(super) shows: Shows,
    /// Counts what is looked at: it grows with every change but those of the look.
    pub(super) revision: u64,
    /// The same without those of the model.
    pub(super) scene_revision: u64,
    /// Counts what is beside.
    pub(super) beside_revision: u64,
    pub(super) meter: Meter,
    /// Where a picture is saved to.
    pub(super) output: String,
}

impl State {
    pub(super) fn new(Options { scene: path, args }: Options) -> Result<Self> {
        let scene = Scene::load(path.as_deref(), &Overrides::of(&args))?;
        let given = args.clone();
        let (mut args, notice) = Self::of(args.or(scene.render.clone()));
        args.stats = given.stats.clone();
        Ok(Self {
            path,
            before: scene.clone(),
            scene,
            given,
            sized: args.size.is_some(),
            args,
            error: None,
            notice,
            progress: None,
            pictures: [None, None],
            beside: None,
            wipe: 0.5,
            shows: Shows::default(),
            revision: 0,
            scene_revision: 0,
            beside_revision: 0,
            meter: Meter::default(),
            output: "vitrum.png".into(),
        })
    }

    /// Options as far as they are the viewer's, and what to say of the others.
    fn of(args: RenderArgs) -> (RenderArgs, Option<String>) {
        let is_auto = args.model == Some(ModelChoice::Auto);
        let model = args.model.filter(|_| !is_auto);
        let notice = is_auto.then(|| "model auto: Cost chooses, as soon as it is known what there is".into());
        let (tolerance, time_budget) = if is_auto { (None, None) } else { (args.tolerance, args.time_budget) };
        // Layers and checkpoints are for files.
        (RenderArgs { model, tolerance, time_budget, aov: None, checkpoint: None, ..args }, notice)
    }

    pub(super) fn model(&self) -> Model {
        model_of(&self.args)
    }

    /// Another scene in the place of this one; what cannot be read leaves it, and is said.
    pub(super) fn open(&mut self, path: PathBuf) -> bool {
        self.replace(Some(path), Vec::new())
    }

    /// The same files again, with what was changed here.
    pub(super) fn reload(&mut self) -> bool {
        self.replace(self.path.clone(), self.scene.settings_since(&self.before))
    }

    /// What was changed of the scene is forgotten.
    pub(super) fn revert(&mut self) {
        self.scene = self.before.clone();
    }

    fn replace(&mut self, path: Option<PathBuf>, changes: Vec<String>) -> bool {
        let again = path == self.path;
        let args = match again {
            true => {
                let env = self.given.env.clone().or(self.scene.render.env.clone());
                let dropped = self.args.env.clone().filter(|_| self.args.env != env);
                RenderArgs { env: dropped.or(self.given.env.clone()), ..self.given.clone() }
            }
            // What was said of the scene before does not hold for another.
            false => RenderArgs { ior: None, roughness: None, env: None, set: None, ..self.given.clone() },
        };
        match Self::new(Options { scene: path, args }) {
            Ok(mut new) => {
                // Where it says something else of itself than before, that counts, else what was chosen here.
                if again && new.scene.render == self.scene.render {
                    new.args = self.args.clone();
                } else if !new.sized {
                    new.args.size = self.args.size;
                }
                for change in changes {
                    // What a material was called that is gone has no place any more.
                    let _ = new.scene.set(&[change]);
                }
                *self = Self {
                    pictures: [self.pictures[0].take(), None],
                    meter: std::mem::take(&mut self.meter),
                    output: std::mem::take(&mut self.output),
                    revision: self.revision,
                    scene_revision: self.scene_revision,
                    beside_revision: self.beside_revision + 1,
                    shows: self.shows,
                    given: self.given.clone(),
                    wipe: self.wipe,
                    ..new
                };
                true
            }
            Err(error) => {
                self.error = Some(error.in_full());
                false
            }
        }
    }

    /// Another environment, if it can be read.
    pub(super) fn surround(&mut self, path: PathBuf) -> bool {
        let overrides = Overrides { environment: Some(path.clone()), ..Overrides::default() };
        match Scene::load(self.path.as_deref(), &overrides) {
            Ok(scene) => {
                self.before.environment.light = scene.environment.light.clone();
                self.scene.environment.light = scene.environment.light;
                self.scene.files.push(path.clone());
                self.args.env = Some(path);
                self.error = None;
                true
            }
            Err(error) => {
                self.error = Some(error.in_full());
                false
            }
        }
    }

    pub(super) fn size(&self) -> Size {
        self.args.size.unwrap_or(Size { width: 1, height: 1 })
    }

    pub(super) fn drag(&mut self, by: impl FnOnce(Camera) -> Camera) {
        let size = self.size();
        self.scene.frame(f64::from(size.width) / f64::from(size.height));
        let camera = by(self.scene.camera);
        // As far as scene files reach.
        let is_near = |point: glam::DVec3| point.abs().max_element() <= 1e9;
        if is_near(camera.position)
            && is_near(camera.target)
            && let Ok(camera) = Camera::new(camera.position, camera.target, camera.up, camera.vertical_fov)
        {
            (self.scene.camera, self.scene.framed) = (camera, false);
        }
    }

    /// The pictures of what there is now.
    pub(super) fn wanted(&self, asked: Instant, moving: bool) -> Wanted {
        let size = self.size();
        let framed = |mut scene: Scene| {
            scene.frame(f64::from(size.width) / f64::from(size.height));
            scene
        };
        let scene = framed(self.scene.clone());
        let shows = |model| if self.shows.is_of(model) { self.shows } else { Shows::Light };
        let mut shots = vec![Shot {
            revision: [self.revision, 0],
            scene: scene.clone(),
            args: self.args.clone(),
            shows: shows(model_of(&self.args)),
        }];
        if let Some(beside) = &self.beside {
            let (camera, framed) = (scene.camera, scene.framed);
            // What is as it was is not made anew for what changes beside it, nor is another model's for those of this one.
            let (scene, revision) = match &beside.scene {
                Some(scene) => (Scene { camera, framed, ..scene.clone() }, fingerprint(&camera, size)),
                None => (scene, self.scene_revision),
            };
            let look = RenderArgs { exposure: self.args.exposure, tonemap: self.args.tonemap, ..beside.args.clone() };
            let args = RenderArgs { size: self.args.size, ..look };
            let shows = shows(model_of(&args));
            shots.push(Shot { revision: [revision, self.beside_revision + 1], scene, args, shows });
        }
        Wanted { shots, pixel: None, moving, asked }
    }

    /// Whether an effect is on, off, or as the scene calls for it (`None`).
    pub(super) fn wish(&self, effect: Effect) -> Option<bool> {
        self.args.effects.as_ref().and_then(|selection| selection.wish(effect))
    }

    pub(super) fn set_wish(&mut self, effect: Effect, wish: Option<bool>) {
        let wishes = Effect::all().map(|one| (one, if one == effect { wish } else { self.wish(one) }));
        let selection = Selection::of_wishes(wishes);
        self.args.effects = (selection != Selection::default()).then_some(selection);
    }

    /// What in the scene calls for an effect.
    pub(super) fn why(&self, effect: Effect) -> String {
        let named = |object: usize| &self.scene.meshes[self.scene.objects[object].mesh].name;
        match effect.callers(&self.scene).next() {
            None => effect.absent().into(),
            Some(Caller::Material { material, why }) => format!("{}: {why}", self.scene.materials[material].name),
            Some(Caller::Light(number)) => format!("point light {number}"),
            Some(Caller::Parts(object)) => format!("bodies in {} may overlap", named(object)),
            Some(Caller::Pair(one, other)) => format!("{} and {} may overlap", named(one), named(other)),
            Some(Caller::Camera(object)) => format!("the camera may be in {}", named(object)),
        }
    }

    /// Options of `vitrum render` that repeat the picture.
    pub(super) fn options(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut settings = self.args.set.clone().unwrap_or_default();
        settings.extend(self.scene.settings_since(&self.before));
        let set = (!settings.is_empty()).then_some(settings);
        // The scene's own options are among these, as far as they were not changed.
        let no_render_table =
            (self.scene.render != RenderArgs::default()).then_some(true).or(self.args.no_render_table);
        let args = RenderArgs { set, no_render_table, ..self.args.clone() };
        words.extend(args.words());
        words.extend(self.args.device.iter().map(|device| format!("--device={device}")));
        words
    }

    /// The scene as the command names it, last: its name may look like an option.
    pub(super) fn scene_word(&self) -> Vec<String> {
        let name = self.path.as_ref().map(|path| path.display().to_string());
        match name {
            Some(name) if name.starts_with('-') => vec!["--".into(), name],
            name => name.into_iter().collect(),
        }
    }

    /// The command that repeats the picture, for a shell.
    pub(super) fn command(&self) -> String {
        let words = ["vitrum".to_owned(), "render".to_owned()].into_iter().chain(self.options());
        let words = words.chain([format!("-o={}", self.output)]).chain(self.scene_word());
        shell::line(words)
    }
}

pub(super) fn model_of(args: &RenderArgs) -> Model {
    match args.model {
        Some(ModelChoice::Only(model)) => model,
        _ => Model::Single,
    }
}

/// Tells a view from others.
fn fingerprint(camera: &Camera, size: Size) -> u64 {
    let mut hasher = DefaultHasher::new();
    let numbers = [camera.position, camera.target, camera.up].map(|vector| vector.to_array().map(f64::to_bits));
    (numbers, camera.vertical_fov.to_bits(), size.width, size.height).hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_has_what_was_changed() {
        let mut state = State::new(Options { scene: None, args: RenderArgs::default() }).expect("the built-in scene");
        assert_eq!(state.command(), "vitrum render -o=vitrum.png");
        state.args.size = Some(Size { width: 640, height: 360 });
        state.args.model = Some(Model::Tree.into());
        state.set_wish(Effect::Nesting, Some(false));
        state.set_wish(Effect::Opaque, Some(true));
        assert_eq!(
            state.command(),
            "vitrum render --model=tree --size=640x360 --effects=auto,opaque,-nesting -o=vitrum.png"
        );
        assert_eq!((state.wish(Effect::Nesting), state.wish(Effect::Opaque)), (Some(false), Some(true)));
        assert_eq!(state.wish(Effect::Shadows), None);
        state.set_wish(Effect::Nesting, None);
        state.set_wish(Effect::Opaque, None);
        state.drag(|camera| Camera { position: camera.position + glam::DVec3::X, ..camera });
        assert!(state.command().contains(" '--set=camera={position=["), "{}", state.command());
        assert!(!state.command().contains("effects"), "{}", state.command());
    }

    #[test]
    fn the_command_holds_where_a_scene_has_options_of_its_own() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.toml");
        let write = |options: &str| std::fs::write(&path, format!("[render]\n{options}\n")).expect("a scene");
        write(
            "model = \"tree\"\nmax_depth = 8\ntolerance = 0.01\nroughness = 0.5\naov = [\"discarded\"]\nstats = \"s.json\"",
        );
        let options = Options { scene: Some(path.clone()), args: RenderArgs::default() };
        let mut state = State::new(options).expect("a scene");
        assert_eq!(state.args.stats, None, "those are of a render");
        state.args = RenderArgs { tolerance: None, max_depth: None, ..state.args.clone() };
        state.args.model = Some(Model::Single.into());
        let name = path.display();
        let wanted = format!("vitrum render --model=single --roughness=0.5 --no-render-table -o=vitrum.png {name}");
        assert_eq!(state.command(), wanted);
        let again = RenderArgs { no_render_table: Some(true), ..RenderArgs::default() };
        let scene = Scene::load(Some(&path), &Overrides::of(&again)).expect("a scene");
        assert_eq!(scene.render, RenderArgs::default());
        // What was chosen here stays while the file says the same of itself.
        assert!(state.reload(), "{:?}", state.error);
        assert_eq!((state.args.model, state.args.tolerance), (Some(Model::Single.into()), None));
        state.scene.environment.intensity = 2.0;
        // What it says counts where it changes.
        write("samples = 3\nmodel = \"auto\"");
        assert!(state.reload(), "{:?}", state.error);
        assert_eq!((state.args.samples, state.args.model, state.args.roughness), (Some(3), None, None));
        assert_eq!(state.scene.environment.intensity, 2.0, "what was changed stays");
        // Another scene has its own.
        assert!(state.open(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/prism.obj")));
        assert_eq!(state.args.samples, None);
        assert!(state.command().starts_with("vitrum render -o=vitrum.png "), "{}", state.command());
    }

    #[test]
    fn what_cannot_be_opened_leaves_what_there_is() {
        let mut state = State::new(Options { scene: None, args: RenderArgs::default() }).expect("the built-in scene");
        assert!(!state.open("no/such.toml".into()));
        assert!(state.error.as_ref().is_some_and(|error| error.contains("no/such.toml")), "{:?}", state.error);
        assert_eq!(state.scene.name, "built-in");
        assert!(!state.surround("no/such.exr".into()));
        assert!(state.args.env.is_none());
    }
}
