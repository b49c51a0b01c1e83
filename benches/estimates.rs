//! What `--tolerance` promises, held against the true error on ten scenes: `cargo bench --bench estimates` prints the table of
//! docs/auto.md. Arguments choose tolerances, and scenes by their names or a part of them, as
//! `-- 0.1 0.01 ball`; without any it takes all of them, which is hours. One as `8x6` is the size of what `path` and `auto` render.
//!
//! What is counted are the pixels, each channel for itself, whose |x - r| / (r + 0.1) is below the tolerance. `tree` promises what it
//! cuts off: r is the same samples followed on and on. `path` promises what its samples scatter: r is another picture of it, and the
//! difference of two is larger by the square root of 2. What `auto` chooses is held against `tree` with many times the samples where
//! that simulates all there is (4 times at the finest), else against `path`, with a fifth of the tolerance where it is another model.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/tree/shapes.rs"]
mod shapes;

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use glam::{DAffine3, DVec3};

use shapes::{Part, glass, hollow_ball, icosphere, prism, rectangle, scene};
use vitrum::choice::choose;
use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::{DARK, Rendered, render};
use vitrum::plan::Plan;
use vitrum::scene::{Dielectric, Dispersion, Opaque, Overrides, Scene, Surface};

/// Samples of pictures of `tree` that hold each other's cut-offs.
const SAMPLES: u32 = 4;

/// Below this, pictures and references are small: samples grow with the square of what is asked.
const FINE: f64 = 5e-3;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn scenes() -> Result<Vec<(&'static str, Scene)>> {
    let built_in = Scene::load(None, &Overrides::default())?;
    let street = |part: Part| Scene { environment: built_in.environment.clone(), ..scene([part]) };
    let ball = |material| street(Part::of(icosphere(5), Surface::Dielectric(material)));
    let tinted = Dielectric { attenuation_color: DVec3::new(0.2, 0.8, 0.5), attenuation_distance: 1.0, ..glass(1.5) };
    let rough = |roughness| Dielectric { roughness, ..glass(1.5) };
    let mut diamond = Scene::load(
        Some(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/diamond.obj")),
        &Overrides { ior: Some(2.42), ..Overrides::default() },
    )?;
    diamond.environment = built_in.environment.clone();
    let dispersive = Dielectric { dispersion: Dispersion::Khr(0.5), ..glass(1.5) };
    let floor = Part::of(rectangle(6.0, 6.0), Surface::Opaque(Opaque::default()));
    let floor = floor.placed(DAffine3::from_translation(-DVec3::Y) * DAffine3::from_rotation_x(-FRAC_PI_2));
    let table = Scene {
        environment: built_in.environment.clone(),
        ..scene([Part::of(icosphere(5), Surface::Dielectric(glass(1.5))), floor])
    };
    Ok(vec![
        ("ball", ball(glass(1.5))),
        ("hollow ball", street(Part::glass(hollow_ball(5, 0.1), 1.5))),
        ("tinted ball", ball(tinted)),
        ("diamond", diamond),
        ("prism, dispersive", street(Part::of(prism(1.0, 2.0), Surface::Dielectric(dispersive)))),
        ("built-in", built_in.clone()),
        ("ball, roughness 0.1", ball(rough(0.1))),
        ("ball, roughness 0.3", ball(rough(0.3))),
        ("ball, roughness 0.6", ball(rough(0.6))),
        ("ball on a floor", table),
    ])
}

struct Bench {
    gpu: Gpu,
}

impl Bench {
    fn picture(&self, scene: &Scene, args: &RenderArgs) -> Result<Rendered> {
        Ok(render(&self.gpu, scene, &Plan::new(scene, args)?, &mut |_| {})?)
    }

    /// The share of `tree`'s pixels that lose less than the tolerance, and the share that it follows as far.
    fn tree(&self, scene: &Scene, tolerance: f64, size: Size) -> Result<Option<f64>> {
        let args = |tolerance| RenderArgs {
            model: Some(Model::Tree.into()),
            size: Some(size),
            samples: Some(SAMPLES),
            tolerance: Some(tolerance),
            ..RenderArgs::default()
        };
        if Plan::new(scene, &args(tolerance))?.lacks() > 0 {
            return Ok(None);
        }
        let found = self.picture(scene, &args(tolerance))?;
        let truth = self.picture(scene, &RenderArgs { max_depth: Some(4096), ..args(1e-3 * tolerance) })?;
        Ok(Some(within(&found, &truth, tolerance)))
    }

    fn path(&self, scene: &Scene, tolerance: f64, size: Size) -> Result<(f64, u32)> {
        let args = |seed| RenderArgs {
            model: Some(Model::Path.into()),
            size: Some(size),
            tolerance: Some(tolerance),
            seed: Some(seed),
            ..RenderArgs::default()
        };
        let (first, second) = (self.picture(scene, &args(1))?, self.picture(scene, &args(2))?);
        Ok((within(&first, &second, 2.0_f64.sqrt() * tolerance), first.samples))
    }

    /// The same of what `auto` chooses, and what that is.
    fn auto(&self, scene: &Scene, tolerance: f64, size: Size) -> Result<(f64, String)> {
        let args = RenderArgs { size: Some(size), tolerance: Some(tolerance), ..RenderArgs::default() };
        let choice = choose(&self.gpu, scene, &args)?;
        let best = choice.best;
        eprintln!("chosen: {}, {} samples", best.model.name(), best.samples);
        let found = self.picture(scene, &best.args)?;
        eprintln!(
            "rendered: {} samples, {:.0} s on the device",
            found.samples,
            1e-3 * found.gpu_ms().unwrap_or(f64::NAN)
        );
        let label = format!("{}, {}", best.model.name(), found.samples);
        if best.model == Model::Tree {
            let deep = RenderArgs {
                samples: Some(if tolerance < FINE { 4 } else { 16 } * best.samples.max(4)),
                tolerance: Some(0.03 * tolerance),
                max_depth: Some(1024),
                seed: Some(77),
                ..best.args
            };
            return Ok((within(&found, &self.picture(scene, &deep)?, tolerance), label));
        }
        let path = |tolerance| RenderArgs {
            model: Some(Model::Path.into()),
            samples: None,
            max_depth: None,
            tolerance: Some(tolerance),
            seed: Some(77),
            ..best.args.clone()
        };
        // Two pictures that are as far off differ by more than each does.
        let (scale, of_truth) = if best.model == Model::Path { (2.0_f64.sqrt(), 1.0) } else { (1.0, 0.2) };
        let truth = self.picture(scene, &path(of_truth * tolerance))?;
        Ok((within(&found, &truth, scale * tolerance), label))
    }
}

/// The share of the values of `found` that are within `bound` of `truth`.
fn within(found: &Rendered, truth: &Rendered, bound: f64) -> f64 {
    let pairs = found.radiance.iter().flatten().zip(truth.radiance.iter().flatten());
    let close = pairs.filter(|&(&x, &r)| f64::from((x - r).abs()) < bound * (f64::from(r.abs()) + DARK)).count();
    close as f64 / (3 * found.radiance.len()) as f64
}

fn main() -> Result<()> {
    let mut tolerances: Vec<f64> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    if tolerances.is_empty() {
        tolerances = vec![1e-1, 1e-2, 1e-3];
    }
    let asked = std::env::args().skip(1).find_map(|argument| argument.parse::<Size>().ok());
    let is_name = |argument: &String| {
        !argument.starts_with('-') && argument.parse::<f64>().is_err() && argument.parse::<Size>().is_err()
    };
    let names: Vec<_> = std::env::args().skip(1).filter(is_name).collect();
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let bench = Bench { gpu: Gpu::open(&instance, instance.choose(wanted.as_deref())?)? };
    println!("| scene | tolerance | `tree` | `path` (samples) | `auto` (chosen, samples) |");
    println!("| --- | --- | --- | --- | --- |");
    let scenes = scenes()?;
    let is_whole = |part: &String| scenes.iter().any(|(name, _)| name == part);
    let is_meant = |part: &String, name: &str| if is_whole(part) { name == part } else { name.contains(part) };
    for (name, scene) in &scenes {
        if !names.is_empty() && !names.iter().any(|part| is_meant(part, name)) {
            continue;
        }
        let mut scene = scene.clone();
        for &tolerance in &tolerances {
            let (width, height) = if tolerance < FINE { (16, 12) } else { (32, 24) };
            let size = asked.unwrap_or(Size { width, height });
            scene.frame(4.0 / 3.0);
            let tree = bench.tree(&scene, tolerance, Size { width: 64, height: 48 })?;
            let tree = tree.map_or("".into(), |share| format!("{:.2} %", 100.0 * share));
            eprintln!("{name}, {tolerance}: tree {tree}");
            let (auto, chosen) = bench.auto(&scene, tolerance, size)?;
            // At the finest one `path` would take days of scenes that it is not chosen for, and hours once more of those that it is.
            let is_fine = tolerance < FINE;
            let path = match chosen.strip_prefix("path, ") {
                Some(samples) if is_fine => format!("{:.1} % ({samples})", 100.0 * auto),
                None if is_fine => String::new(),
                _ => {
                    let (share, samples) = bench.path(&scene, tolerance, size)?;
                    format!("{:.1} % ({samples})", 100.0 * share)
                }
            };
            println!("| {name} | {tolerance} | {tree} | {path} | {:.1} % ({chosen}) |", 100.0 * auto);
        }
    }
    Ok(())
}
