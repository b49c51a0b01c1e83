//! What the original model costs: `cargo bench --bench single` prints the README's table.
//!
//! The built-in scene, the same with rough glass, and the same view without objects, the floor, take turns in one process;
//! medians of the rounds, device times, pipelines warm. Then whole runs of the program: from its start to the finished file.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{RenderArgs, Size};
use vitrum::passes::render;
use vitrum::plan::Plan;
use vitrum::scene::{Overrides, Scene, Surface};

const ROUNDS: usize = 9;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let gpu = Gpu::open(&instance, instance.choose(wanted.as_deref())?)?;
    let scene = Scene::load(None, &Overrides::default())?;
    let floor = Scene { objects: Vec::new(), ..scene.clone() };

    println!("{}, {}; medians of {ROUNDS} rounds\n", gpu.info().name, gpu.info().driver);
    let mut rough = scene.clone();
    for material in &mut rough.materials {
        if let Surface::Dielectric(dielectric) = &mut material.surface {
            dielectric.roughness = 0.3;
        }
    }
    let mut rows = [
        ("scene", &scene, vec![]),
        ("scene at roughness 0.3", &rough, vec![]),
        ("environment alone (floor)", &floor, vec![]),
    ];
    println!("| 1024x768, all passes | 1 sample | 16 samples |\n| --- | --- | --- |");
    for samples in [1, 16] {
        let mut times = [vec![], vec![], vec![]];
        for _ in 0..ROUNDS {
            for ((_, scene, _), times) in rows.iter().zip(&mut times) {
                times.push(gpu_ms(&gpu, scene, samples)?);
            }
        }
        for (row, times) in rows.iter_mut().zip(times) {
            row.2.push(median(times));
        }
    }
    for (name, _, times) in &rows {
        println!("| {name} | {:.1} ms | {:.1} ms |", times[0], times[1]);
    }
    let ratio = |a: usize, b: usize, column: usize| rows[a].2[column] / rows[b].2[column];
    println!("| scene over floor | {:.1} | {:.1} |", ratio(0, 2, 0), ratio(0, 2, 1));
    println!("| rough over smooth | {:.1} | {:.1} |\n", ratio(1, 0, 0), ratio(1, 0, 1));
    drop((gpu, instance));

    println!("| program start to finished PNG, 1 sample | time | peak memory |\n| --- | --- | --- |");
    for (name, cold) in [("shaders in the driver's cache", false), ("driver's cache off", true)] {
        let mut runs = Vec::new();
        for _ in 0..ROUNDS {
            runs.push(run(cold)?);
        }
        let time = median(runs.iter().map(|(time, _)| time.as_secs_f64() * 1e3).collect());
        let memory = runs.iter().map(|&(_, kib)| kib).max().unwrap_or(0);
        println!("| {name} | {time:.0} ms | {} MiB |", memory / 1024);
    }
    Ok(())
}

fn gpu_ms(gpu: &Gpu, scene: &Scene, samples: u32) -> Result<f64, Box<dyn std::error::Error>> {
    let size = Some(Size { width: 1024, height: 768 });
    let plan = Plan::new(scene, &RenderArgs { samples: Some(samples), size, ..RenderArgs::default() })?;
    let rendered = render(gpu, scene, &plan, &mut |_| {})?;
    rendered.passes.iter().map(|pass| pass.gpu_ms).sum::<Option<f64>>().ok_or_else(|| "the device has no clock".into())
}

/// One run of the program: how long it took, and the most memory that it held, in KiB (Linux; else 0).
fn run(cold: bool) -> std::io::Result<(Duration, u64)> {
    let output = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench.png");
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_vitrum"))
        .args(["render", "--quiet", "--samples", "1", "-o"])
        .arg(output)
        .env("MESA_SHADER_CACHE_DISABLE", if cold { "true" } else { "false" })
        .stderr(Stdio::inherit())
        .spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait()?.is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().strip_suffix(" kB")?.trim().parse().ok());
        peak = peak.max(kib.unwrap_or(0));
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok((start.elapsed(), peak))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
