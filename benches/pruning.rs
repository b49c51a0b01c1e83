//! What it is worth to compile out what a scene does not call for: `cargo bench --bench pruning` prints the table of
//! docs/explain.md.
//!
//! The two take turns in one process; medians of the rounds. Pipelines are compiled anew each time: the driver's cache is
//! off.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/tree/shapes.rs"]
mod shapes;

use std::error::Error;
use std::process::Command;

use glam::DVec3;

use shapes::{Part, glass, icosphere, scene};
use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::render;
use vitrum::plan::Plan;
use vitrum::scene::{Dielectric, Dispersion, Overrides, Scene, Surface};

const ROUNDS: usize = 3;
const SIZE: Size = Size { width: 256, height: 192 };
const CACHE_OFF: &str = "MESA_SHADER_CACHE_DISABLE";

fn main() -> Result<(), Box<dyn Error>> {
    if std::env::var_os(CACHE_OFF).is_none() {
        // Drivers look at it before anything here runs.
        let status = Command::new(std::env::current_exe()?).env(CACHE_OFF, "true").status()?;
        std::process::exit(status.code().unwrap_or(1));
    }
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let gpu = Gpu::open(&instance, instance.choose(wanted.as_deref())?)?;
    println!("{}, {}; medians of {ROUNDS} rounds, {SIZE}, 4 samples\n", gpu.info().name, gpu.info().driver);
    println!("| ball of glass | model | pipelines: auto | all | ratio | frame: auto | all | ratio |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let street = Scene::load(None, &Overrides::default())?.environment;
    for (name, material) in [
        ("smooth", glass(1.5)),
        ("rough (0.3)", Dielectric { roughness: 0.3, ..glass(1.5) }),
        (
            "absorbing",
            Dielectric { attenuation_color: DVec3::new(0.2, 0.8, 0.5), attenuation_distance: 1.0, ..glass(1.5) },
        ),
        ("dispersive", Dielectric { dispersion: Dispersion::Khr(0.5), ..glass(1.5) }),
    ] {
        let ball = Part::of(icosphere(5), Surface::Dielectric(material));
        let scene = Scene { environment: street.clone(), ..scene([ball]) };
        for model in Model::ALL {
            let mut times = [const { [const { Vec::new() }; 2] }; 2];
            for _ in 0..ROUNDS {
                for (effects, times) in ["auto", "all"].into_iter().zip(&mut times) {
                    let args = RenderArgs {
                        model: Some(model.into()),
                        size: Some(SIZE),
                        samples: Some(4),
                        effects: Some(effects.parse()?),
                        ..RenderArgs::default()
                    };
                    let rendered = render(&gpu, &scene, &Plan::new(&scene, &args)?, &mut |_| {})?;
                    times[0].push(rendered.pipelines.as_secs_f64());
                    let device: Option<f64> = rendered.passes.iter().map(|pass| pass.gpu_ms).sum();
                    times[1].push(device.ok_or("the device has no clock")?);
                }
            }
            let [auto, all] = times.map(|times| times.map(median));
            println!(
                "| {name} | {} | {:.2} s | {:.2} s | {:.1} | {:.1} ms | {:.1} ms | {:.2} |",
                model.name(),
                auto[0],
                all[0],
                all[0] / auto[0],
                auto[1],
                all[1],
                all[1] / auto[1]
            );
        }
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
