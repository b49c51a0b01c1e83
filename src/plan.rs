//! What one render does: scene and options, with every default filled in and every conflict refused.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use crate::effects::{Effect, Effects, SMOOTH};
use crate::options::{Aov, DebugControls, MOST_SAMPLES, Model, ModelChoice, RenderArgs, Size, Tonemap, Trace};
use crate::scene::{Scene, Surface, TextureMap};
use crate::{Error, Result};

/// A render, decided.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The light transport model.
    pub model: Model,
    /// Pixels.
    pub size: Size,
    /// Samples per pixel, or as many as the time allows.
    pub budget: Budget,
    /// Longest chain of interfaces; `None` in models that do not follow one.
    pub max_depth: Option<u32>,
    /// Throughput below which a branch is cut off.
    pub cutoff: f64,
    /// What a user tolerates: of `tree` the throughput that a pixel may lose so, of `path` and `double` the relative error of the
    /// picture, in the mean and of most pixels; infinite: anything.
    pub tolerance: f64,
    /// Whether environment and textures are averaged over a sample's share of its pixel, where rays are traced.
    pub footprints: bool,
    /// How `path` looks for the light of the environment and of surfaces that shine.
    pub estimator: Estimator,
    /// How rays are traced, where the user has a wish.
    pub trace: Option<Trace>,
    /// Seed of everything random.
    pub seed: u64,
    /// Effects that are simulated.
    pub effects: Effects,
    /// Effects that were selected and that the model cannot honour.
    pub unsupported: Effects,
    /// Stops, for display values.
    pub exposure: f64,
    /// Tone curve, for display values.
    pub tonemap: Tonemap,
    /// Extra layers.
    pub aovs: Vec<Aov>,
    /// Effects that the model simulates by something simpler.
    pub approximate: Effects,
    /// Light that is in the scene and that the model cannot find, in words.
    pub unseen: Vec<&'static str>,
    /// Where the render is saved from time to time, and goes on from.
    pub checkpoint: Option<PathBuf>,
    /// Controls of the original's user interface.
    pub debug: DebugControls,
    /// Every option that was given, and the defaults of those that shape each picture.
    pub options: RenderArgs,
}

/// How directions to lights are chosen at surfaces that spread light. All estimate the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Where it is bright, and where the surface sends light: multiple importance sampling.
    #[default]
    Both,
    /// Where it is bright.
    Lights,
    /// Where the surface sends light.
    Surfaces,
}

/// How much is spent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// That many samples per pixel.
    Samples(u32),
    /// Samples until that many seconds have passed, and at most so many.
    Seconds {
        /// The time.
        seconds: f64,
        /// The most samples.
        most: u32,
    },
}

impl Budget {
    /// What is left of it after some time.
    #[must_use]
    pub fn less(self, spent: Duration) -> Self {
        match self {
            Self::Samples(_) => self,
            Self::Seconds { seconds, most } => Self::Seconds { seconds: seconds - spent.as_secs_f64(), most },
        }
    }
}

/// Samples per pixel, where the user has no wish.
const SAMPLES: u32 = 16;
const SAMPLES_OF_PATH: u32 = 256;

/// Visible normals that all samples of a pixel should take of a rough surface.
const NORMALS: u32 = 256;

/// Visible normals that one sample takes, at least and at most.
const NORMALS_A_SAMPLE: RangeInclusive<u32> = 8..=16;

/// The longest chain of interfaces, where the user has no wish.
pub const DEPTH: u32 = 32;

/// The same where a tolerance is asked for: long enough that few pixels miss it, short enough to end.
pub const DEPTH_OF_TOLERANCE: u32 = 1024;

/// Throughput below which `tree` cuts a branch off, where no tolerance is asked for, and `double` ends a chain.
const CUTOFF: f64 = 0.005;

impl Model {
    /// Whether it follows rays from surface to surface.
    pub fn traces(self) -> bool {
        matches!(self, Self::Tree | Self::Path)
    }
}

/// What no path chosen at random meets: it would have to run into a point.
const POINT_THROUGH_GLASS: &str = "light of point lights through smooth glass, and their images in smooth surfaces";

fn unseen(scene: &Scene, model: Model, effects: Effects) -> Vec<&'static str> {
    // An image may be smooth in places.
    let least = |roughness: f64, map: Option<TextureMap>| {
        roughness * map.map_or(1.0, |map| scene.textures[map.texture].least_green())
    };
    let is_smooth = |surface: &Surface| match surface {
        Surface::Dielectric(glass) => {
            let is_rough = || least(glass.roughness, glass.metallic_roughness_texture) > SMOOTH;
            glass.ior != 1.0 && !(effects.contains(Effect::Roughness) && is_rough())
        }
        Surface::Opaque(opaque) => {
            let mirrors = || least(opaque.roughness, opaque.metallic_roughness_texture) <= SMOOTH;
            let mirrors = opaque.specular.max(opaque.metallic) > 0.0 && mirrors();
            mirrors && effects.contains(Effect::Opaque)
        }
    };
    let any_smooth = || scene.objects.iter().any(|object| is_smooth(&scene.materials[object.material].surface));
    let lit = effects.contains(Effect::DirectLight) && Effect::DirectLight.called_for_by(scene);
    if model == Model::Path && lit && any_smooth() { vec![POINT_THROUGH_GLASS] } else { Vec::new() }
}

impl Plan {
    /// The size of a picture, where the user has no wish.
    pub const SIZE: Size = Size { width: 1024, height: 768 };

    /// Visible normals of a rough surface that each sample of a pixel takes: half as many where a chain of interfaces follows.
    pub fn normals(&self) -> u32 {
        let share = if self.model == Model::Double { 2 } else { 1 };
        let (least, most) = (NORMALS_A_SAMPLE.start() / share, NORMALS_A_SAMPLE.end() / share);
        match self.budget {
            Budget::Samples(samples) => (NORMALS / share).div_ceil(samples).clamp(least, most),
            Budget::Seconds { .. } => most,
        }
    }

    /// How many effects, and kinds of light, the picture lacks or has by something simpler.
    pub fn lacks(&self) -> usize {
        self.unsupported.iter().count() + self.approximate.iter().count() + self.unseen.len()
    }

    /// What `args` amount to for `scene`; the scene's own `[render]` table is not looked at, see [`RenderArgs::or`].
    pub fn new(scene: &Scene, args: &RenderArgs) -> Result<Self> {
        let model = match args.model {
            Some(ModelChoice::Only(model)) => model,
            Some(ModelChoice::Auto) => return Err(Error::Usage("--model auto: this needs a model by name".into())),
            None => Model::Single,
        };
        let has: &[Aov] = match model {
            Model::Single => &[Aov::Normal, Aov::Depth, Aov::Object],
            Model::Tree => &[Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Object, Aov::Interfaces, Aov::Discarded],
            Model::Path => {
                &[Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Object, Aov::Interfaces, Aov::Discarded, Aov::Stderr]
            }
            Model::Double => &[Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Object, Aov::Interfaces, Aov::Stderr],
        };
        if args.tolerance.is_some() && model == Model::Single {
            let hint = "model single has no error estimate; use --samples or --time-budget";
            return Err(Error::Usage(format!("--tolerance: {hint}")));
        }
        if args.checkpoint.is_some() && model != Model::Path {
            let hint = format!("model {} has nothing to go on from; --model path has", model.name());
            return Err(Error::Usage(format!("--checkpoint: {hint}")));
        }
        let mut aovs = args.aov.clone().unwrap_or_default();
        aovs.sort();
        aovs.dedup();
        if let Some(aov) = aovs.iter().find(|aov| !has.contains(aov)) {
            let (name, model) = (aov.name(), model.name());
            let has: Vec<_> = has.iter().map(|aov| aov.name()).collect();
            let has = has.join(", ");
            return Err(Error::Usage(format!("--aov {name}: model {model} does not have it; it has: {has}")));
        }
        let size = args.size.unwrap_or(Self::SIZE);
        let most = args.samples.unwrap_or(MOST_SAMPLES);
        let budget = match args.time_budget {
            Some(seconds) => Budget::Seconds { seconds, most },
            None if matches!(model, Model::Path | Model::Double) && args.tolerance.is_some() => {
                Budget::Seconds { seconds: f64::INFINITY, most }
            }
            None => {
                Budget::Samples(args.samples.unwrap_or(if model == Model::Path { SAMPLES_OF_PATH } else { SAMPLES }))
            }
        };
        let depth = match model {
            Model::Tree | Model::Path if args.tolerance.is_some() => DEPTH_OF_TOLERANCE,
            _ => DEPTH,
        };
        let max_depth = (model != Model::Single).then(|| args.max_depth.unwrap_or(depth));
        let selection = args.effects.clone().unwrap_or_default();
        let selected = selection.resolve(scene);
        let share = |honoured: bool| -> Effects {
            selected.iter().filter(|effect: &Effect| effect.honoured_by(model) == honoured).collect()
        };
        // In `tree` lights shine on opaque surfaces alone.
        let lit = share(true).contains(Effect::Opaque);
        let simplifies = lit || model != Model::Tree;
        let approximate =
            share(true).iter().filter(|effect| simplifies && effect.approximated_by(model, scene)).collect();
        Ok(Self {
            model,
            size,
            budget,
            max_depth,
            cutoff: match args.tolerance {
                Some(tolerance) if model == Model::Tree => tolerance / 4.0,
                _ => CUTOFF,
            },
            tolerance: args.tolerance.unwrap_or(f64::INFINITY),
            footprints: model == Model::Tree,
            estimator: Estimator::default(),
            trace: args.trace,
            seed: args.seed.unwrap_or(0),
            effects: share(true),
            unsupported: share(false),
            exposure: args.exposure.unwrap_or(0.0),
            tonemap: args.tonemap.unwrap_or_default(),
            aovs,
            approximate,
            unseen: unseen(scene, model, share(true)),
            checkpoint: args.checkpoint.clone(),
            debug: DebugControls::new(args),
            options: args.clone().or(RenderArgs {
                model: Some(model.into()),
                size: Some(size),
                max_depth,
                seed: Some(0),
                effects: Some(selection),
                exposure: Some(0.0),
                tonemap: Some(Tonemap::default()),
                ..RenderArgs::default()
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Overrides, PointLight};

    #[test]
    fn what_paths_cannot_meet_is_said() {
        let unseen = |scene: &Scene, model: Model| {
            let args = RenderArgs { model: Some(model.into()), ..RenderArgs::default() };
            Plan::new(scene, &args).expect("a plan").unseen
        };
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        assert!(unseen(&scene, Model::Path).is_empty(), "no light");
        scene.lights.push(PointLight::new(DVec3::Y, DVec3::ONE));
        assert_eq!(unseen(&scene, Model::Path), [POINT_THROUGH_GLASS]);
        assert!(unseen(&scene, Model::Tree).is_empty(), "of another model nothing is said");
        scene.lights[0].intensity = DVec3::ZERO;
        assert!(unseen(&scene, Model::Path).is_empty(), "no light");
        scene.lights[0].intensity = DVec3::ONE;
        for material in &mut scene.materials {
            if let Surface::Dielectric(glass) = &mut material.surface {
                glass.roughness = 0.2;
            }
        }
        assert!(unseen(&scene, Model::Path).is_empty(), "rough glass spreads light");
        let effects = Some("auto,-roughness".parse().expect("a selection"));
        let args = RenderArgs { model: Some(Model::Path.into()), effects, ..RenderArgs::default() };
        assert_eq!(Plan::new(&scene, &args).expect("a plan").unseen, [POINT_THROUGH_GLASS], "as if it were smooth");
    }
}
