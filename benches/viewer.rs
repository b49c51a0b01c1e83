//! What a moment of the viewer costs: `cargo bench --bench viewer` moves the camera and prints, of each model, how long the scene, the
//! targets, a sample and the display take on the host, and how much of that the passes are. Then it drags in the viewer's window, under
//! Xvfb at 1280x720, and prints how often pictures come and how long after the events. Names of models choose.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/common/desktop.rs"]
mod desktop;

use std::error::Error;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};

use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::Renderer;
use vitrum::plan::Plan;
use vitrum::scene::{Overrides, Scene};

const MOVES: usize = 15;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    let names: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let gpu = Gpu::open(&instance, instance.choose(wanted.as_deref())?)?;
    println!("{}, {}; medians of {MOVES} moves, milliseconds\n", gpu.info().name, gpu.info().driver);
    println!("| model | size | scene | targets | sample | display | all | passes |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let scene = Scene::load(None, &Overrides::default())?;
    for model in Model::ALL.into_iter().filter(|model| names.is_empty() || names.iter().any(|n| n == model.name())) {
        for (width, height) in [(1280, 720), (320, 180), (160, 90)] {
            if model.traces() && width > 320 {
                continue;
            }
            let size = Size { width, height };
            let args =
                RenderArgs { model: Some(model.into()), size: Some(size), samples: Some(1), ..RenderArgs::default() };
            let plan = Plan::new(&scene, &args)?;
            let mut renderer = Renderer::new(&gpu, &scene, &plan)?;
            let mut times = [const { Vec::new() }; 5];
            let mut passes = Vec::new();
            for step in 0..MOVES {
                let mut scene = scene.clone();
                let turn = DQuat::from_axis_angle(DVec3::Y, 0.02 * step as f64);
                scene.camera.position = scene.camera.target + turn * (scene.camera.position - scene.camera.target);
                let marks = &mut vec![Instant::now()];
                renderer.change(&scene, &plan)?;
                marks.push(Instant::now());
                let mut picture = renderer.begin(&plan)?;
                marks.push(Instant::now());
                renderer.advance(&mut picture, &mut || true)?;
                marks.push(Instant::now());
                renderer.display(&mut picture)?;
                marks.push(Instant::now());
                let ms = |i: usize, j: usize| marks[j].duration_since(marks[i]).as_secs_f64() * 1e3;
                for (times, (i, j)) in times.iter_mut().zip([(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]) {
                    times.push(ms(i, j));
                }
                passes = picture.passes().iter().map(|pass| (pass.name, pass.gpu_ms.unwrap_or(0.0))).collect();
            }
            let [scene, targets, sample, display, all] = times.map(median);
            let passes: Vec<_> = passes.iter().map(|(name, ms)| format!("{name} {ms:.1}")).collect();
            println!(
                "| {} | {size} | {scene:.1} | {targets:.1} | {sample:.1} | {display:.1} | {all:.1} | {} |",
                model.name(),
                passes.join(", ")
            );
        }
    }
    let models: Vec<_> =
        Model::ALL.into_iter().filter(|m| names.is_empty() || names.iter().any(|n| n == m.name())).collect();
    println!("\n| model | pictures a second: median | worst of 95 % | ms after an event: median | 95 % | stand-ins |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for model in models {
        let folder = tempfile::tempdir()?;
        let stats = folder.path().join("stats.json");
        let arguments = ["--model", model.name(), "--stats", &stats.display().to_string()];
        let Some(window) = desktop::Desktop::open([1280, 720], &arguments) else { return Ok(()) };
        std::thread::sleep(Duration::from_secs(8));
        let middle = [640, 360];
        window.event(desktop::Desktop::MOVE, 0, middle);
        window.event(desktop::Desktop::DOWN, 1, [0, 0]);
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(6) {
            let angle = start.elapsed().as_secs_f64();
            let place = [640.0 + 150.0 * angle.sin(), 360.0 + 60.0 * (0.7 * angle).sin()];
            window.quick_event(desktop::Desktop::MOVE, 0, place.map(|x| x as i16));
        }
        window.event(desktop::Desktop::UP, 1, [0, 0]);
        std::thread::sleep(Duration::from_secs(1));
        window.close();
        let report: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&stats)?)?;
        let number = |spread: &str, member: &str| report[spread][member].as_f64().unwrap_or(f64::NAN);
        println!(
            "| {} | {:.1} | {:.1} | {:.0} | {:.0} | {} of {} |",
            model.name(),
            1e3 / number("interval_ms", "median"),
            1e3 / number("interval_ms", "p95"),
            number("latency_ms", "median"),
            number("latency_ms", "p95"),
            report["stand_ins"],
            report["pictures"]
        );
        println!("{report}");
    }
    Ok(())
}
