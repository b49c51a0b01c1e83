//! What a second interface is worth and what it costs: `cargo bench --bench double` prints the table of docs/double.md.
//!
//! The errors are those of pictures of 16 samples against `tree` at depth 256, and of rough bodies against `path`. The two
//! models take turns in one process; medians of the rounds, device times, pipelines warm.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/tree/shapes.rs"]
mod shapes;

use std::error::Error;
use std::path::Path;

use glam::{DAffine3, DVec3};

use shapes::{Part, glass, hollow_ball, icosphere, scene};
use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::{Rendered, render};
use vitrum::plan::Plan;
use vitrum::scene::{Dielectric, Overrides, Scene, Surface};

const ROUNDS: usize = 5;
const SIZE: Size = Size { width: 256, height: 192 };

/// Samples of the pictures that the others are held against.
const SAMPLES_OF_TREE: u32 = 64;
const SAMPLES_OF_PATH: u32 = 1024;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let gpu = Gpu::open(&instance, instance.choose(wanted.as_deref())?)?;
    println!("{}, {}; 256x192, 16 samples, medians of {ROUNDS} rounds\n", gpu.info().name, gpu.info().driver);
    println!("| | relMSE of single | of double | ms a sample of single | of double | double over single |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for (name, scene) in bodies()? {
        let args = |model: Model, samples| RenderArgs {
            model: Some(model.into()),
            size: Some(SIZE),
            samples: Some(samples),
            ..RenderArgs::default()
        };
        let picture = |args: &RenderArgs| -> Result<Rendered, Box<dyn Error>> {
            Ok(render(&gpu, &scene, &Plan::new(&scene, args)?, &mut |_| {})?)
        };
        let is_rough = name.contains("rough");
        let truth = picture(&match is_rough {
            true => args(Model::Path, SAMPLES_OF_PATH),
            false => RenderArgs { max_depth: Some(256), ..args(Model::Tree, SAMPLES_OF_TREE) },
        })?;
        let (mut times, mut errors) = ([Vec::new(), Vec::new()], [0.0; 2]);
        for _ in 0..ROUNDS {
            for (i, model) in [Model::Single, Model::Double].into_iter().enumerate() {
                let rendered = picture(&args(model, 16))?;
                times[i].push(gpu_ms(&rendered)? / 16.0);
                errors[i] = rel_mse(&rendered, &truth);
            }
        }
        let [single, double] = times.map(median);
        let [of_single, of_double] = errors;
        println!("| {name} | {of_single:.1e} | {of_double:.1e} | {single:.1} | {double:.1} | {:.1} |", double / single);
    }
    Ok(())
}

fn bodies() -> Result<Vec<(&'static str, Scene)>, Box<dyn Error>> {
    let built_in = Scene::load(None, &Overrides::default())?;
    let asset = |name: &str| -> Result<vitrum::scene::Mesh, Box<dyn Error>> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes").join(name);
        Ok(Scene::load(Some(&path), &Overrides::default())?.meshes[0].as_ref().clone())
    };
    let ball = |glass: Dielectric| Part::of(icosphere(5), Surface::Dielectric(glass));
    let absorbing =
        Dielectric { attenuation_color: DVec3::new(0.4, 0.7, 0.9), attenuation_distance: 1.0, ..glass(1.5) };
    let in_street = |part: Part| Scene { environment: built_in.environment.clone(), ..scene([part]) };
    let seen = |scene: Scene, position: DVec3, target: DVec3| {
        let mut scene = scene;
        (scene.camera.position, scene.camera.target) = (position, target);
        scene
    };
    let turned = DAffine3::from_rotation_y(20_f64.to_radians());
    let aside = DVec3::new(0.9, 0.8, 3.0);
    let diamond = seen(
        in_street(Part::glass(asset("diamond.obj")?, 2.42)),
        DVec3::new(0.0, 2.0, 3.4),
        DVec3::new(0.0, -0.22, 0.0),
    );
    Ok(vec![
        ("ball", in_street(ball(glass(1.5)))),
        ("absorbing ball", in_street(ball(absorbing))),
        ("slab", seen(in_street(Part::glass(asset("slab.obj")?, 1.5)), aside, DVec3::ZERO)),
        ("prism", seen(in_street(Part::glass(asset("prism.obj")?, 1.5168).placed(turned)), aside, DVec3::ZERO)),
        ("diamond", diamond),
        ("rough ball, roughness 0.316", in_street(ball(Dielectric { roughness: 0.1_f64.sqrt(), ..glass(1.5) }))),
        ("hollow ball", in_street(Part::glass(hollow_ball(4, 0.1), 1.5))),
        ("teapot and cups", built_in),
    ])
}

fn gpu_ms(rendered: &Rendered) -> Result<f64, Box<dyn Error>> {
    rendered.passes.iter().map(|pass| pass.gpu_ms).sum::<Option<f64>>().ok_or_else(|| "the device has no clock".into())
}

/// The mean of (x - r)^2 / (r^2 + 0.01) over pixels and channels.
fn rel_mse(found: &Rendered, truth: &Rendered) -> f64 {
    let pairs = found.radiance.iter().flatten().zip(truth.radiance.iter().flatten());
    let errors = pairs.map(|(&x, &r)| (f64::from(x) - f64::from(r)).powi(2) / (f64::from(r).powi(2) + 0.01));
    errors.sum::<f64>() / (3 * truth.radiance.len()) as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
