//! What finding the nearest surface costs: `cargo bench --bench trace` prints the tables of docs and README.
//!
//! The tracer in software, the device's ray queries and Embree on the same rays, taking turns; medians of the rounds.
//! The rays are those of a camera, and what becomes of them inside of a body: refracted once, then reflected from
//! wall to wall. Embree comes by way of the Python package `embreex`; `VITRUM_PYTHON` names an interpreter that has
//! it, if python3 has not.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/tree/shapes.rs"]
mod shapes;

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use glam::{DVec2, DVec3};

use shapes::{Part, bumpy, scene};
use vitrum::gpu::{Gpu, Instance};
use vitrum::options::{Model, RenderArgs, Size, Trace};
use vitrum::passes::{Hit, Ray, TraceProbe, render};
use vitrum::plan::Plan;
use vitrum::scene::Scene;

const ROUNDS: usize = 5;
const SIZE: Size = Size { width: 512, height: 384 };
const IOR: f64 = 1.5;

/// Reflections inside of the body that are traced.
const BOUNCES: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted = std::env::var("VITRUM_DEVICE").ok();
    let instance = Instance::new(/* validation: */ false)?;
    let gpu = Gpu::open(&instance, instance.choose(wanted.as_deref())?)?;
    let python = std::env::var("VITRUM_PYTHON").unwrap_or_else(|_| "python3".into());
    let embree = has_embree(&python);
    println!("{}, {}; medians of {ROUNDS} rounds\n", gpu.info().name, gpu.info().driver);
    if !embree {
        println!("Embree: not installed (pip install embreex)\n");
    }

    println!(
        "| closest hits, millions a second | rays | software | hardware | Embree | software over hardware \
         | Embree over software | distances off by 1e-5 |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for count in [10_000, 100_000, 1_000_000] {
        let scene = scene([Part::glass(bumpy(count), IOR)]);
        let mut software = TraceProbe::new(&gpu, &scene, Trace::Software)?;
        let mut hardware = gpu.ray_query().then(|| TraceProbe::new(&gpu, &scene, Trace::Hardware)).transpose()?;
        let camera = camera_rays(&scene);
        let secondary = secondary_rays(&mut software, &camera)?;
        let rows = [
            ("camera", &camera),
            ("secondary", &secondary),
            ("secondary, shuffled", &shuffled(&secondary)),
            ("secondary, sorted", &sorted(&secondary)),
        ];
        for (name, rays) in rows {
            let mut embree = if embree { Some(Embree::start(&python, &scene, rays)?) } else { None };
            let mut rates = [Vec::new(), Vec::new(), Vec::new()];
            let rate = |probe: &mut TraceProbe| -> Result<f64, Box<dyn Error>> {
                // The first round warms up.
                let times = probe.times(rays, 2)?;
                Ok(rays.len() as f64 / times.last().ok_or("the device has no clock")? * 1e-3)
            };
            for _ in 0..ROUNDS {
                rates[0].push(rate(&mut software)?);
                if let Some(hardware) = &mut hardware {
                    rates[1].push(rate(hardware)?);
                }
                if let Some(embree) = &mut embree {
                    rates[2].push(rays.len() as f64 / embree.seconds()? * 1e-6);
                }
            }
            let off = match embree {
                Some(embree) => percentage(off(&mut software, rays, &embree.distances()?)?),
                None => "-".into(),
            };
            let rates = rates.map(median);
            let [ours, theirs, embree] = rates.map(|rate| rate.map_or("-".into(), |rate| format!("{rate:.2}")));
            let over = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or("-".into(), |(a, b)| format!("{:.1}", a / b));
            let (wins, lags) = (over(rates[0], rates[1]), over(rates[2], rates[0]));
            let count = triangles(&scene);
            println!("| {count}, {name} | {} | {ours} | {theirs} | {embree} | {wins} | {lags} | {off} |", rays.len());
        }
    }

    println!("\n| `--model tree`, {SIZE}, 1 sample, triangles | rays | frame | millions a second |");
    println!("| --- | --- | --- | --- |");
    let scenes = [1_000, 10_000, 100_000, 1_000_000].map(|count| scene([Part::glass(bumpy(count), IOR)]));
    let mut times = [const { Vec::new() }; 4];
    let mut rays = [0; 4];
    for _ in 0..ROUNDS {
        for (i, scene) in scenes.iter().enumerate() {
            let args = RenderArgs {
                model: Some(Model::Tree.into()),
                trace: Some(Trace::Software),
                size: Some(SIZE),
                samples: Some(1),
                ..RenderArgs::default()
            };
            let rendered = render(&gpu, scene, &Plan::new(scene, &args)?, &mut |_| {})?;
            let pass = rendered.passes.iter().find(|pass| pass.name == "tree");
            times[i].push(pass.and_then(|pass| pass.gpu_ms).ok_or("the device has no clock")?);
            rays[i] = rendered.counts.and_then(|counts| counts.rays).unwrap_or(0);
        }
    }
    for ((scene, times), rays) in scenes.iter().zip(times).zip(rays) {
        let ms = median(times).unwrap_or(f64::NAN);
        println!("| {} | {rays} | {ms:.0} ms | {:.2} |", triangles(scene), rays as f64 / ms * 1e-3);
    }
    Ok(())
}

fn triangles(scene: &Scene) -> usize {
    scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum()
}

/// Through the centre of each pixel, row after row.
fn camera_rays(scene: &Scene) -> Vec<Ray> {
    let camera = &scene.camera;
    let ahead = (camera.target - camera.position).normalize();
    let right = ahead.cross(camera.up).normalize();
    let up = right.cross(ahead);
    let size = DVec2::new(SIZE.width.into(), SIZE.height.into());
    let pixel = 2.0 * (camera.vertical_fov / 2.0).tan() / size.y;
    let ray = |x: u32, y: u32| {
        let at = (DVec2::new(x.into(), y.into()) + 0.5 - size / 2.0) * pixel;
        Ray { origin: camera.position, direction: ahead + at.x * right - at.y * up }
    };
    (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| ray(x, y))).collect()
}

/// What becomes of `camera` inside of the body.
fn secondary_rays(probe: &mut TraceProbe, camera: &[Ray]) -> Result<Vec<Ray>, Box<dyn Error>> {
    // Far enough from the wall for every tracer.
    const AWAY: f64 = 1e-4;
    let refracted = |ray: &Ray, normal: DVec3| ray.direction.normalize().refract(normal, 1.0 / IOR);
    let mut rays: Vec<_> = camera
        .iter()
        .zip(probe.hits(camera)?)
        .filter_map(|(ray, hit)| hit.filter(|hit| !hit.behind).map(|hit| (ray, hit)))
        .map(|(ray, hit)| Ray { origin: hit.position - AWAY * hit.normal, direction: refracted(ray, hit.normal) })
        .collect();
    let mut all = rays.clone();
    for _ in 0..BOUNCES {
        rays = rays
            .iter()
            .zip(probe.hits(&rays)?)
            .filter_map(|(ray, hit)| hit.filter(|hit| hit.behind).map(|hit| (ray, hit)))
            .map(|(ray, hit)| Ray {
                origin: hit.position - AWAY * hit.normal,
                direction: ray.direction.reflect(hit.normal),
            })
            .collect();
        all.extend(&rays);
    }
    Ok(all)
}

/// In an order without any.
fn shuffled(rays: &[Ray]) -> Vec<Ray> {
    let mut rays = rays.to_vec();
    fastrand::Rng::with_seed(1).shuffle(&mut rays);
    rays
}

/// Those beside each other that start close to each other in similar directions: what sorting rays could win, were it free.
fn sorted(rays: &[Ray]) -> Vec<Ray> {
    // Of a number from -2 to 2 the first ten binary digits, two places free between them.
    let spread = |x: f64| (0..10).fold(0_u64, |bits, i| bits | ((((x + 2.0) * 256.0) as u64 >> i) & 1) << (3 * i));
    let morton = |v: DVec3| spread(v.x) | spread(v.y) << 1 | spread(v.z) << 2;
    let mut rays = rays.to_vec();
    rays.sort_by_key(|ray| {
        let direction = morton(ray.direction) >> 21;
        direction << 30 | morton(ray.origin)
    });
    rays
}

fn has_embree(python: &str) -> bool {
    let mut import = Command::new(python);
    import.args(["-c", "import embreex, numpy"]).stdout(Stdio::null()).stderr(Stdio::null());
    import.status().is_ok_and(|status| status.success())
}

/// `embree.py` at work: a line goes in, the rays are traced once, the seconds come out.
struct Embree {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    distances: PathBuf,
}

impl Embree {
    fn start(python: &str, scene: &Scene, rays: &[Ray]) -> Result<Self, Box<dyn Error>> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let file = |name: &str| folder.join(format!("embree-{name}.bin"));
        let mesh = &scene.meshes[0];
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let ends: Vec<_> = rays.iter().map(|ray| [narrow(ray.origin), narrow(ray.direction.normalize())]).collect();
        std::fs::write(file("vertices"), bytemuck::cast_slice(&mesh.positions))?;
        std::fs::write(file("triangles"), bytemuck::cast_slice(&mesh.triangles))?;
        std::fs::write(file("rays"), bytemuck::cast_slice(&ends))?;
        let mut process = Command::new(python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/embree.py"))
            .args(["vertices", "triangles", "rays", "distances"].map(file))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let input = process.stdin.take().ok_or("no pipe")?;
        let output = BufReader::new(process.stdout.take().ok_or("no pipe")?);
        let mut embree = Self { process, input, output, distances: file("distances") };
        // The first round warms up.
        embree.seconds()?;
        Ok(embree)
    }

    fn seconds(&mut self) -> Result<f64, Box<dyn Error>> {
        writeln!(self.input)?;
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line.trim().parse().map_err(|_| format!("embree.py said {line:?}"))?)
    }

    /// What each ray met how far away; infinite where it met nothing.
    fn distances(mut self) -> Result<Vec<f32>, Box<dyn Error>> {
        drop(self.input);
        self.process.wait()?;
        Ok(bytemuck::allocation::pod_collect_to_vec(&std::fs::read(self.distances)?))
    }
}

/// The share of rays that meet something else than Embree says.
fn off(probe: &mut TraceProbe, rays: &[Ray], embree: &[f32]) -> Result<f64, Box<dyn Error>> {
    let hits = probe.hits(rays)?;
    let differ = |(hit, distance): &(Option<Hit>, &f32)| match hit {
        Some(hit) => (hit.distance - f64::from(**distance)).abs() > 1e-5 * hit.distance.max(1.0),
        None => distance.is_finite(),
    };
    Ok(hits.into_iter().zip(embree).filter(differ).count() as f64 / rays.len() as f64)
}

fn percentage(share: f64) -> String {
    format!("{:.3} %", share * 100.0)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
