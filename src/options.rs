//! The options of a render: one struct for the command line and the scene's `[render]` table, one for what they amount to.

use std::ffi::{OsStr, OsString};
use std::fmt::{self, Display};
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::PossibleValue;
use clap::{Args as _, FromArgMatches as _};

use crate::effects::{Effect, Selection};

/// The longest chain of interfaces that may be asked for.
pub const MOST_DEPTH: u32 = 1 << 16;

/// The most samples per pixel that may be asked for.
pub const MOST_SAMPLES: u32 = 1 << 24;

/// A light transport model: how far the light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Model {
    /// The original: rasterised, one interface, reflection and refraction see the environment only
    Single,
    /// Rasterised, front and back interface: bodies seen through, without rays
    Double,
    /// The whole tree of reflections and refractions, enumerated
    Tree,
    /// Monte Carlo path tracing, the reference
    Path,
}

impl Model {
    /// Every model, the simplest first.
    pub const ALL: [Self; 4] = [Self::Single, Self::Double, Self::Tree, Self::Path];

    /// The name on the command line and in the stats.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Double => "double",
            Self::Tree => "tree",
            Self::Path => "path",
        }
    }
}

/// What `--model` asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelChoice {
    /// This one.
    Only(Model),
    /// Whichever is the cheapest for what is asked of the picture: see [`crate::choice`].
    Auto,
}

impl ModelChoice {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Only(model) => model.name(),
            Self::Auto => "auto",
        }
    }
}

impl From<Model> for ModelChoice {
    fn from(model: Model) -> Self {
        Self::Only(model)
    }
}

impl clap::ValueEnum for ModelChoice {
    fn value_variants<'a>() -> &'a [Self] {
        const ALL: [ModelChoice; 5] = [
            ModelChoice::Only(Model::Single),
            ModelChoice::Only(Model::Double),
            ModelChoice::Only(Model::Tree),
            ModelChoice::Only(Model::Path),
            ModelChoice::Auto,
        ];
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Only(model) => model.to_possible_value(),
            Self::Auto => Some(PossibleValue::new("auto").help(
                "The one that keeps --tolerance at the least cost, or is best within --time-budget, by small pictures of each",
            )),
        }
    }
}

/// The curve from scene-linear radiance to display values, for PNG only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Tonemap {
    /// Clipped at 1
    None,
    /// Khronos PBR Neutral: hues kept, highlights rolled off
    #[default]
    Neutral,
    /// AgX: a filmic curve that desaturates highlights
    Agx,
}

impl Tonemap {
    /// The name on the command line and in image metadata.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Neutral => "neutral",
            Self::Agx => "agx",
        }
    }
}

/// How rays find surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Trace {
    /// Ray queries of the device
    Hardware,
    /// A traversal written in the shader
    Software,
}

impl Trace {
    /// The name on the command line and in stats.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hardware => "hardware",
            Self::Software => "software",
        }
    }
}

/// An extra layer of the EXR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Aov {
    /// Shading normal in world space
    Normal,
    /// Distance from the camera in metres, 0 where nothing is hit
    Depth,
    /// Base colour
    Albedo,
    /// Number of the object in the scene file, from 1; 0 where nothing is hit
    Object,
    /// Scattering events per pixel
    Interfaces,
    /// Throughput that `tree` or `path` cut off
    Discarded,
    /// Standard error of a Monte Carlo mean
    Stderr,
}

impl Aov {
    /// Whether it says what surface lies at the centre of a pixel, and not what a model made of it.
    pub fn is_of_surfaces(self) -> bool {
        matches!(self, Self::Normal | Self::Depth | Self::Albedo | Self::Object)
    }

    /// The name of the layer.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Albedo => "albedo",
            Self::Object => "object",
            Self::Interfaces => "interfaces",
            Self::Discarded => "discarded",
            Self::Stderr => "stderr",
        }
    }
}

/// Width and height in pixels, both from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Size {
    /// How many there are.
    pub fn pixels(self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }
}

impl TryFrom<[u32; 2]> for Size {
    type Error = String;

    fn try_from([width, height]: [u32; 2]) -> Result<Self, String> {
        if width == 0 || height == 0 {
            return Err(format!("size {width}x{height} is empty; both sides must be at least 1"));
        }
        Ok(Self { width, height })
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT, as in 1024x768")?;
        let side = |side: &str| side.parse().map_err(|_| format!("{side:?} is not a number of pixels"));
        Self::try_from([side(width)?, side(height)?])
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Parsers of values with a range.
macro_rules! ranges {
    ($($name:ident: $type:ty, $ok:expr, $wanted:literal;)*) => {
        pub(crate) mod range {
            $(pub fn $name(text: &str) -> Result<$type, String> {
                let value: $type = text.trim().parse().map_err(|_| format!("expected {}", $wanted))?;
                let ok: fn($type) -> bool = $ok;
                if ok(value) { Ok(value) } else { Err(format!("expected {}", $wanted)) }
            })*
        }
    };
}

ranges! {
    samples: u32, |x| (1..=super::MOST_SAMPLES).contains(&x), "1 to 16777216 samples";
    max_depth: u32, |x| (1..=super::MOST_DEPTH).contains(&x), "a depth from 1 to 65536";
    positive: f64, |x| x > 0.0 && x.is_finite(), "a number above 0";
    unit: f64, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1";
    inputs: u64, |x| (1..=1 << 40).contains(&x), "1 to 1099511627776 inputs";
    seed: u64, |_| true, "a whole number from 0 to 18446744073709551615";
    ior: f64, |x| (1e-6..=1e6).contains(&x), "an index above 0, from 1e-6 to 1e6";
    angle: f64, |x| (0.0..=180.0).contains(&x), "an angle from 0 to 180 degrees";
    exposure: f64, |x| (-64.0..=64.0).contains(&x), "an exposure from -64 to 64 EV";
}

/// Options of `render` as given: on the command line, or in the scene's `[render]` table with `_` for `-`.
///
/// What is `None` was not given; [`RenderArgs::or`] joins two of them.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct RenderArgs {
    /// Light transport model [default: single]
    #[arg(long, value_name = "NAME")]
    pub model: Option<ModelChoice>,

    /// Size of the image in pixels [default: 1024x768]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Samples per pixel [default: 16; path: 256]
    #[arg(long, value_name = "N", value_parser = range::samples)]
    pub samples: Option<u32>,

    /// Longest chain of interfaces; model single sees one [default: 32; tree and path with --tolerance: 1024]
    #[arg(long, value_name = "N", value_parser = range::max_depth)]
    pub max_depth: Option<u32>,

    /// tree: no pixel discards more than X of the light, but for chains beyond --max-depth; path and double: samples until the mean relative error is below X, and that of 95 % of the pixels
    #[arg(long, value_name = "X", value_parser = range::positive)]
    pub tolerance: Option<f64>,

    /// The best image within that time, set-up included; writing the file comes on top. --samples caps it
    #[arg(long, value_name = "SECONDS", value_parser = range::positive)]
    pub time_budget: Option<f64>,

    /// path: save what is rendered to FILE from time to time, and go on from there if FILE is of the same render
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Seed of everything random [default: 0]
    #[arg(long, value_name = "N", value_parser = range::seed)]
    pub seed: Option<u64>,

    /// Effects simulated: auto (those that the scene calls for), all, or a list; -name takes one away [default: auto]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true, long_help = effects_help())]
    pub effects: Option<Selection>,

    /// Index of refraction of every dielectric
    #[arg(long, value_name = "X", value_parser = range::ior)]
    pub ior: Option<f64>,

    /// Roughness of every dielectric, 0 to 1
    #[arg(long, value_name = "X", value_parser = range::unit)]
    pub roughness: Option<f64>,

    /// Environment image in place of the scene's
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,

    /// Sets one value of the scene, as its file would: material.glass.ior=1.7, camera.vertical_fov=20, environment.rotation=90; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Option<Vec<String>>,

    /// Repairs meshes: welds vertices along cracks, drops duplicate faces, turns triangles to agree with their neighbours, and says so
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL")]
    pub repair: Option<bool>,

    /// Interpolates normals of meshes that have none, across edges of up to so many degrees, 0 to 180
    #[arg(long, value_name = "DEGREES", value_parser = range::angle)]
    pub smooth_angle: Option<f64>,

    /// Leaves the options aside that the scene's table 'render' has
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL")]
    pub no_render_table: Option<bool>,

    /// Exposure of a PNG in stops [default: 0]
    #[arg(long, value_name = "EV", allow_hyphen_values = true, value_parser = range::exposure)]
    pub exposure: Option<f64>,

    /// Tone curve of a PNG [default: neutral]
    #[arg(long, value_name = "NAME")]
    pub tonemap: Option<Tonemap>,

    /// Extra layers in the EXR; model single has normal, depth, object; tree and path also albedo, interfaces, discarded; path and double stderr, double albedo and interfaces
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub aov: Option<Vec<Aov>>,

    /// Vulkan device: part of its name, its index, or "list" [default: the best one]
    #[arg(long, value_name = "NAME|INDEX|list", env = "VITRUM_DEVICE")]
    pub device: Option<String>,

    /// How rays are traced [default: hardware on a GPU with ray queries, else software]
    #[arg(long, value_name = "HOW")]
    pub trace: Option<Trace>,

    /// Run under the validation layer; any message makes the run fail with 1
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL")]
    pub validation: Option<bool>,

    /// Write what the render took, as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Tints the transmission green (model single) [default: 0]
    #[arg(long, value_name = "X", value_parser = range::unit, help_heading = "Debug controls of the original model")]
    pub transmission_green: Option<f64>,

    /// Tints the reflection red (model single) [default: 0]
    #[arg(long, value_name = "X", value_parser = range::unit, help_heading = "Debug controls of the original model")]
    pub reflection_red: Option<f64>,

    /// Blends the transmission in, 0 to 1 (model single) [default: 1]
    #[arg(long, value_name = "X", value_parser = range::unit, help_heading = "Debug controls of the original model")]
    pub transmission_intensity: Option<f64>,

    /// Blends the reflection in, 0 to 1 (model single) [default: 1]
    #[arg(long, value_name = "X", value_parser = range::unit, help_heading = "Debug controls of the original model")]
    pub reflection_intensity: Option<f64>,

    /// Flips the ratio of the indices where the transmitted direction is computed (model single)
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", help_heading = "Debug controls of the original model")]
    pub flipped_ratio: Option<bool>,
}

impl RenderArgs {
    /// The names of all options that a scene's `[render]` table may have.
    pub fn names() -> Vec<String> {
        let command = Self::augment_args(clap::Command::new("render"));
        let names = command.get_arguments().filter_map(|argument| argument.get_long().map(str::to_owned));
        // These are about the file itself.
        names.filter(|name| name != "set" && name != "no-render-table").collect()
    }

    /// One option, as it would be given on the command line. An error is one line.
    pub fn one(name: &str, value: &OsStr) -> Result<Self, String> {
        let mut word = OsString::from(format!("--{name}="));
        word.push(value);
        let matches =
            Self::augment_args(clap::Command::new("render").no_binary_name(true)).try_get_matches_from([word]);
        matches.and_then(|matches| Self::from_arg_matches(&matches)).map_err(|error| one_line(&error))
    }

    /// These options, and `fallback`'s where these are silent.
    #[must_use]
    pub fn or(self, fallback: Self) -> Self {
        Self {
            model: self.model.or(fallback.model),
            size: self.size.or(fallback.size),
            samples: self.samples.or(fallback.samples),
            max_depth: self.max_depth.or(fallback.max_depth),
            tolerance: self.tolerance.or(fallback.tolerance),
            time_budget: self.time_budget.or(fallback.time_budget),
            checkpoint: self.checkpoint.or(fallback.checkpoint),
            seed: self.seed.or(fallback.seed),
            effects: self.effects.or(fallback.effects),
            ior: self.ior.or(fallback.ior),
            roughness: self.roughness.or(fallback.roughness),
            env: self.env.or(fallback.env),
            set: self.set.or(fallback.set),
            repair: self.repair.or(fallback.repair),
            smooth_angle: self.smooth_angle.or(fallback.smooth_angle),
            no_render_table: self.no_render_table.or(fallback.no_render_table),
            exposure: self.exposure.or(fallback.exposure),
            tonemap: self.tonemap.or(fallback.tonemap),
            aov: self.aov.or(fallback.aov),
            device: self.device.or(fallback.device),
            trace: self.trace.or(fallback.trace),
            validation: self.validation.or(fallback.validation),
            stats: self.stats.or(fallback.stats),
            transmission_green: self.transmission_green.or(fallback.transmission_green),
            reflection_red: self.reflection_red.or(fallback.reflection_red),
            transmission_intensity: self.transmission_intensity.or(fallback.transmission_intensity),
            reflection_intensity: self.reflection_intensity.or(fallback.reflection_intensity),
            flipped_ratio: self.flipped_ratio.or(fallback.flipped_ratio),
        }
    }
}

/// As on a command line: every option that is given.
impl Display for RenderArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words().join(" "))
    }
}

impl RenderArgs {
    /// Every option that is given and shapes the picture, a word each.
    pub fn words(&self) -> Vec<String> {
        let text = |value: Option<&dyn Display>| value.map(|value| value.to_string());
        let given = [
            ("model", self.model.map(|model| model.name().to_owned())),
            ("size", text(self.size.as_ref().map(|x| x as _))),
            ("samples", text(self.samples.as_ref().map(|x| x as _))),
            ("max-depth", text(self.max_depth.as_ref().map(|x| x as _))),
            ("tolerance", text(self.tolerance.as_ref().map(|x| x as _))),
            ("time-budget", text(self.time_budget.as_ref().map(|x| x as _))),
            ("seed", text(self.seed.as_ref().map(|x| x as _))),
            ("effects", text(self.effects.as_ref().map(|x| x as _))),
            ("ior", text(self.ior.as_ref().map(|x| x as _))),
            ("roughness", text(self.roughness.as_ref().map(|x| x as _))),
            ("env", self.env.as_ref().map(|path| path.display().to_string())),
            ("repair", text(self.repair.as_ref().map(|x| x as _))),
            ("smooth-angle", text(self.smooth_angle.as_ref().map(|x| x as _))),
            ("exposure", text(self.exposure.as_ref().map(|x| x as _))),
            ("tonemap", self.tonemap.map(|curve| curve.name().to_owned())),
            ("aov", self.aov.as_ref().map(|aovs| aovs.iter().map(|aov| aov.name()).collect::<Vec<_>>().join(","))),
            ("trace", self.trace.map(|trace| trace.name().to_owned())),
            ("transmission-green", text(self.transmission_green.as_ref().map(|x| x as _))),
            ("reflection-red", text(self.reflection_red.as_ref().map(|x| x as _))),
            ("transmission-intensity", text(self.transmission_intensity.as_ref().map(|x| x as _))),
            ("reflection-intensity", text(self.reflection_intensity.as_ref().map(|x| x as _))),
            ("flipped-ratio", text(self.flipped_ratio.as_ref().map(|x| x as _))),
        ];
        let given = given.into_iter().filter_map(|(name, value)| value.map(|value| format!("--{name}={value}")));
        let settings = self.set.iter().flatten().map(|setting| format!("--set={setting}"));
        let alone = (self.no_render_table == Some(true)).then(|| "--no-render-table".to_owned());
        given.chain(settings).chain(alone).collect()
    }
}

fn effects_help() -> String {
    let names: Vec<_> = Effect::all().map(Effect::name).collect();
    format!(
        "Effects simulated: auto (those that the scene calls for), all, or a list; -name takes one away \
         [default: auto]\n\nEffects: {}",
        names.join(", ")
    )
}

/// What clap has to say, without its layout: the message, what is possible, and where to read on.
pub(crate) fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let told = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let told = told.take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"));
    let told: Vec<_> = told.map(|line| line.strip_prefix("error: ").unwrap_or(line)).collect();
    format!("{}; see --help", told.join("; "))
}

/// The debug controls of the original's user interface; they act in the model `single` alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DebugControls {
    /// Green added to the transmission.
    pub transmission_green: f32,
    /// Red added to the reflection.
    pub reflection_red: f32,
    /// Factor of the transmission.
    pub transmission_intensity: f32,
    /// Factor of the reflection.
    pub reflection_intensity: f32,
    /// The transmitted direction is built with the inverse ratio of the indices, as in the report's figure 3.
    pub flipped_ratio: bool,
}

impl Default for DebugControls {
    fn default() -> Self {
        Self {
            transmission_green: 0.0,
            reflection_red: 0.0,
            transmission_intensity: 1.0,
            reflection_intensity: 1.0,
            flipped_ratio: false,
        }
    }
}

impl DebugControls {
    /// What `args` amounts to.
    pub fn new(args: &RenderArgs) -> Self {
        let neutral = Self::default();
        let or = |given: Option<f64>, neutral: f32| given.map_or(neutral, |x| x as f32);
        Self {
            transmission_green: or(args.transmission_green, neutral.transmission_green),
            reflection_red: or(args.reflection_red, neutral.reflection_red),
            transmission_intensity: or(args.transmission_intensity, neutral.transmission_intensity),
            reflection_intensity: or(args.reflection_intensity, neutral.reflection_intensity),
            flipped_ratio: args.flipped_ratio.unwrap_or(neutral.flipped_ratio),
        }
    }
}
