//! What the tracers meet, in software and by the device's ray queries: what 64-bit arithmetic says, and no ray slips
//! out of a closed body. `cargo test --release --test trace -- --ignored --nocapture` prints the table of many
//! millions of rays.

#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/closest.rs"]
mod closest;
mod common;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::path::Path;

use fastrand::Rng;
use glam::{DAffine3, DQuat, DVec3};

use closest::{Triangle, Triangles};
use common::Validated;
use shapes::{Part, bumpy, cuboid, icosphere, prism, scene};
use vitrum::gpu::Gpu;
use vitrum::options::Trace;
use vitrum::passes::{Hit, Leaks, Ray, TraceProbe};
use vitrum::scene::{Bounds, Mesh, Overrides, Scene};

/// The share of rays aimed exactly at corners and edges that slip through by a device's own test of triangles:
/// lavapipe's is not watertight there.
const HARDWARE_SLIPS: f64 = 1e-3;

/// The tracers that the device can run.
fn tracers(gpu: &Gpu) -> impl Iterator<Item = Trace> {
    [Some(Trace::Software), gpu.ray_query().then_some(Trace::Hardware)].into_iter().flatten()
}

fn hits(gpu: &Gpu, scene: &Scene, trace: Trace, rays: &[Ray]) -> Vec<Option<Hit>> {
    TraceProbe::new(gpu, scene, trace).and_then(|mut probe| probe.hits(rays)).expect("the probe runs")
}

/// A point of the cube around the origin.
fn point(random: &mut Rng, reach: f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| reach * (2.0 * random.f64() - 1.0)))
}

fn direction(random: &mut Rng) -> DVec3 {
    loop {
        let v = point(random, 1.0);
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// The normal of a triangle, of any length.
fn outwards(scene: &Scene, triangle: &Triangle) -> DVec3 {
    triangle.area_vector() * scene.objects[triangle.object as usize].transform.matrix3.determinant().signum()
}

/// Points inside of closed bodies, half-way between where a ray comes in and where it gets out.
fn points_inside(scene: &Scene, triangles: &Triangles, random: &mut Rng, count: usize) -> Vec<DVec3> {
    let bounds = scene.bounds().expect("a scene of bodies");
    let reach = bounds.extent().length();
    let mut inside = Vec::new();
    for _ in 0..1000 * count {
        if inside.len() == count {
            break;
        }
        let towards = direction(random);
        let through = bounds.center() + point(random, 0.5) * bounds.extent();
        let origin = through - reach * towards;
        let Some(first) = triangles.closest(origin, towards, None) else { continue };
        let entry = origin + first.distance * towards;
        let Some(second) = triangles.closest(entry, towards, Some(first.triangle)) else { continue };
        let slope = |triangle: usize| outwards(scene, &triangles.all[triangle]).dot(towards);
        if slope(first.triangle) < 0.0 && slope(second.triangle) > 0.0 && second.distance > 1e-3 * reach {
            inside.push(entry + 0.5 * second.distance * towards);
        }
    }
    assert_eq!(inside.len(), count, "a body without an inside");
    inside
}

/// Mirrored, stretched, turned, small and large bodies side by side.
fn crowd() -> Scene {
    let turned = |scale: DVec3, to: DVec3| {
        DAffine3::from_scale_rotation_translation(scale, DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(0.3), to)
    };
    let part = |mesh: Mesh, transform| Part::glass(mesh, 1.5).placed(transform);
    scene([
        part(bumpy(2000), DAffine3::IDENTITY),
        part(bumpy(500), turned(DVec3::new(-1.0, 1.0, 1.0), DVec3::new(3.0, 0.0, 0.0))),
        part(bumpy(500), turned(DVec3::new(2.0, 0.2, 0.7), DVec3::new(0.0, 2.5, 0.0))),
        part(cuboid(DVec3::splat(-1.0), DVec3::ONE), turned(DVec3::new(0.5, 0.5, -0.05), DVec3::new(-3.0, 0.0, 0.0))),
        part(prism(0.8, 2.0), turned(DVec3::splat(0.7), DVec3::new(0.0, -2.5, 0.0))),
        part(icosphere(3), turned(DVec3::splat(0.02), DVec3::new(1.5, 1.5, 1.5))),
        part(icosphere(2), turned(DVec3::splat(0.8), DVec3::new(-2.0, -2.0, -3.0))),
    ])
}

#[test]
fn rays_meet_what_64_bit_arithmetic_says() {
    let Some(validated) = Validated::open() else { return };
    let scene = crowd();
    let triangles = Triangles::new(&scene);
    let mut random = Rng::with_seed(3);
    let rays: Vec<_> = (0..6000)
        .map(|i| {
            let object = &scene.objects[i % scene.objects.len()];
            let target = object.transform.transform_point3(point(&mut random, 1.1));
            let origin = point(&mut random, if i % 3 == 0 { 1.0 } else { 5.0 });
            Ray { origin, direction: (target - origin) * random.f64() }
        })
        .collect();
    // Where the ray meets it, and which object, from which side.
    let expected = |ray: &Ray| {
        let hit = triangles.closest_of_all(ray.origin, ray.direction.normalize(), None)?;
        let triangle = &triangles.all[hit.triangle];
        let object = &scene.objects[triangle.object as usize];
        Some((object.number, hit.distance, outwards(&scene, triangle).dot(ray.direction) > 0.0))
    };
    let agree = |hit: Option<Hit>, expected: Option<(usize, f64, bool)>, within: f64| match (hit, expected) {
        (None, None) => true,
        (Some(hit), Some((object, distance, behind))) => {
            (hit.object, hit.behind) == (object, behind) && (hit.distance - distance).abs() < within
        }
        _ => false,
    };
    for trace in tracers(&validated.gpu) {
        let hits = hits(&validated.gpu, &scene, trace, &rays);
        let mut doubtful = 0;
        for (ray, &hit) in rays.iter().zip(&hits) {
            if agree(hit, expected(ray), 1e-5) {
                continue;
            }
            // Then a ray next to it does: an edge is near, or the surface is seen at a slant.
            doubtful += 1;
            let mut beside = || {
                let origin = ray.origin + point(&mut random, 3e-6);
                let direction = ray.direction.normalize() + point(&mut random, 1e-6);
                expected(&Ray { origin, direction })
            };
            assert!((0..200).any(|_| agree(hit, beside(), 1e-4)), "{ray:?} met {hit:?}, not {:?}", expected(ray));
        }
        let met = hits.iter().flatten().count();
        assert!(doubtful < rays.len() / 100 && met > rays.len() / 3, "{doubtful} doubtful, {met} hits");
    }
    validated.verdict();
}

#[test]
fn rays_at_corners_and_edges_do_not_slip_through() {
    let Some(validated) = Validated::open() else { return };
    let stretched = DAffine3::from_scale(DVec3::new(-1.3, 0.4, 0.9));
    let bodies = [bumpy(2000), bumpy(20), cuboid(DVec3::splat(-1.0), DVec3::ONE), prism(0.02, 2.0)];
    let (mut all, mut through) = (0, 0);
    for (mesh, transform) in bodies.iter().flat_map(|mesh| [(mesh, DAffine3::IDENTITY), (mesh, stretched)]) {
        let scene = scene([Part::glass(mesh.clone(), 1.5).placed(transform)]);
        let triangles = Triangles::new(&scene);
        let mut random = Rng::with_seed(5);
        let centers = points_inside(&scene, &triangles, &mut random, 8);
        let targets = triangles.all.iter().flat_map(|triangle| {
            let [a, b, c] = triangle.corners;
            [a, b, c, a.midpoint(b), a.lerp(b, 0.25), b.lerp(c, 0.3), c.lerp(a, 0.9)]
        });
        let rays: Vec<_> = targets
            .flat_map(|target| centers.iter().map(move |&origin| Ray { origin, direction: target - origin }))
            .collect();
        for trace in tracers(&validated.gpu) {
            let hits = hits(&validated.gpu, &scene, trace, &rays);
            let slipped = hits.iter().filter(|hit| hit.is_none()).count();
            if trace == Trace::Hardware {
                (all, through) = (all + rays.len(), through + slipped);
            } else {
                assert_eq!(slipped, 0, "{} rays in {}", rays.len(), mesh.name);
            }
        }
    }
    assert!(through as f64 <= HARDWARE_SLIPS * all as f64, "{through} of {all} rays");
    validated.verdict();
}

#[test]
fn rays_along_the_axes_meet_what_is_there() {
    let Some(validated) = Validated::open() else { return };
    let scene = scene([Part::glass(cuboid(DVec3::new(-1.0, -0.5, -0.25), DVec3::new(0.5, 1.0, 0.75)), 1.5)]);
    let bounds = scene.bounds().expect("a box");
    let steps = |axis: usize| {
        let (min, max) = (bounds.min[axis], bounds.max[axis]);
        [min, max].into_iter().flat_map(|side| [-1e-4, 0.0, 1e-4].map(|away| side + away)).chain([min.midpoint(max)])
    };
    let mut rays = Vec::new();
    for axis in 0..3 {
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        for (u, v) in steps(others[0]).flat_map(|u| steps(others[1]).map(move |v| (u, v))) {
            for (along, sign) in [(-4.0, 1.0), (4.0, -1.0), (0.1, 1.0), (0.1, -1.0)] {
                let mut ray = Ray { origin: DVec3::ZERO, direction: DVec3::ZERO };
                ray.origin[others[0]] = u;
                ray.origin[others[1]] = v;
                ray.origin[axis] = along;
                ray.direction[axis] = sign;
                rays.push((ray, axis));
            }
        }
    }
    let only: Vec<_> = rays.iter().map(|&(ray, _)| ray).collect();
    for trace in tracers(&validated.gpu) {
        for (hit, (ray, axis)) in hits(&validated.gpu, &scene, trace, &only).into_iter().zip(&rays) {
            let beside = |room: f64| {
                let grown = Bounds { min: bounds.min - room, max: bounds.max + room };
                (0..3).all(|i| i == *axis || (grown.min[i]..=grown.max[i]).contains(&ray.origin[i]))
            };
            let inside = bounds.min[*axis] < ray.origin[*axis] && ray.origin[*axis] < bounds.max[*axis];
            let wall = if (ray.direction[*axis] > 0.0) == inside { bounds.max } else { bounds.min }[*axis];
            match hit {
                // On a side itself, either is right.
                None => assert!(!beside(-5e-5), "{ray:?} met nothing"),
                Some(hit) => {
                    assert!(beside(5e-5), "{ray:?} met {hit:?}");
                    assert_eq!(hit.behind, inside, "{ray:?} met {hit:?}");
                    assert!((hit.distance - (wall - ray.origin[*axis]).abs()).abs() < 1e-5, "{ray:?} met {hit:?}");
                }
            }
        }
    }
    validated.verdict();
}

#[test]
fn far_off_and_tiny_bodies_are_met() {
    let Some(validated) = Validated::open() else { return };
    let body = || Part::glass(bumpy(2000), 1.5);
    let tiny = DAffine3::from_scale_rotation_translation(
        DVec3::splat(1e-4),
        DQuat::from_rotation_y(0.3),
        DVec3::new(0.3, 1.5, 0.2),
    );
    let mut far = scene([body()]);
    far.camera.position = DVec3::new(300.0, -200.0, 1000.0);
    let scenes = [
        // The body is a thousandth of the way to its camera.
        ("far camera", far, 1.0),
        ("far rays", scene([body()]), 1.0),
        ("tiny", scene([body().placed(DAffine3::from_scale(DVec3::splat(1e-6)))]), 1e-6),
        ("tiny beside large", scene([body().placed(tiny), body()]), 1e-4),
    ];
    for (name, scene, radius) in scenes {
        let center = scene.objects[0].transform.translation;
        let mut random = Rng::with_seed(11);
        let rays: Vec<_> = (0..4000)
            .map(|_| {
                // Not through the large body.
                let from = direction(&mut random);
                let from = if name == "tiny beside large" { DVec3::new(from.x, from.y.abs(), from.z) } else { from };
                let reach = 10.0_f64.powf(random.f64() * 2.0 + 1.0);
                let origin = center + from * radius * if name == "tiny beside large" { 4.0 } else { reach };
                Ray { origin, direction: center + point(&mut random, 0.3 * radius) - origin }
            })
            .collect();
        for trace in tracers(&validated.gpu) {
            for (ray, hit) in rays.iter().zip(hits(&validated.gpu, &scene, trace, &rays)) {
                let hit = hit.unwrap_or_else(|| panic!("{name}, {}: {ray:?} met nothing", trace.name()));
                let apart = hit.position.distance(center) / radius;
                assert!(hit.object == 0 && !hit.behind, "{name}, {}: {ray:?} met {hit:?}", trace.name());
                assert!((0.6..1.4).contains(&apart), "{name}, {}: {ray:?} met {hit:?}", trace.name());
            }
        }
    }
    validated.verdict();
}

/// A closed body of a file.
fn from_file(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes").join(name);
    Scene::load(Some(&path), &Overrides::default()).expect("a mesh")
}

/// Closed bodies, and what to call them.
fn closed_bodies() -> Vec<(String, Scene)> {
    let of = |mesh: Mesh| scene([Part::glass(mesh, 1.5)]);
    let stretched = DAffine3::from_scale_rotation_translation(
        DVec3::new(-0.3, 1.7, 0.8),
        DQuat::from_rotation_x(1.0),
        DVec3::new(0.4, -0.3, 0.2),
    );
    let mut bodies = vec![
        ("cube".into(), of(cuboid(DVec3::splat(-1.0), DVec3::ONE))),
        ("prism of 1 degree".into(), of(prism(1.0_f64.to_radians(), 1.0))),
        ("bumpy, mirrored and stretched".into(), scene([Part::glass(bumpy(2000), 1.5).placed(stretched)])),
    ];
    bodies.extend(["diamond.obj", "teapot_body.obj", "cup_tea.obj"].map(|name| (name.into(), from_file(name))));
    bodies
}

/// Rays that were lost though 64-bit arithmetic sees them meet a surface from the inside. It does not where a body
/// cuts through itself, as the spout of the teapot does: there a ray may well come to an outside.
fn faults<'a>(scene: &Scene, triangles: &Triangles, leaks: &'a Leaks) -> Vec<&'a Ray> {
    let is_fault = |ray: &&Ray| {
        let hit = triangles.closest(ray.origin, ray.direction, None);
        hit.is_none_or(|hit| outwards(scene, &triangles.all[hit.triangle]).dot(ray.direction) > 0.0)
    };
    leaks.lost.iter().filter(is_fault).collect()
}

/// About `rays` rays inside the bodies of `scene`.
fn leaks(gpu: &Gpu, scene: &Scene, triangles: &Triangles, trace: Trace, rays: usize) -> Leaks {
    let mut random = Rng::with_seed(17);
    let chains = (rays / 256).clamp(64, 1 << 16);
    let inside = points_inside(scene, triangles, &mut random, chains.min(512));
    let starts: Vec<_> = inside
        .into_iter()
        .cycle()
        .take(chains)
        .map(|origin| Ray { origin, direction: direction(&mut random) })
        .collect();
    let mut probe = TraceProbe::new(gpu, scene, trace).expect("the probe runs");
    probe.leaks(&starts, rays.div_ceil(chains) as u32).expect("the probe runs")
}

#[test]
fn no_ray_leaves_a_closed_body() {
    let Some(validated) = Validated::open() else { return };
    let mut bodies = closed_bodies();
    bodies.extend([10_000, 100_000].map(|count| (format!("bumpy, {count}"), scene([Part::glass(bumpy(count), 1.5)]))));
    for (name, scene) in bodies {
        let triangles = Triangles::new(&scene);
        for trace in tracers(&validated.gpu) {
            let rays = if trace == Trace::Software { 1_000_000 } else { 200_000 };
            let leaks = leaks(&validated.gpu, &scene, &triangles, trace, rays);
            assert!(leaks.rays >= rays as u64, "{name}, {}: {leaks:?}", trace.name());
            let faults = faults(&scene, &triangles, &leaks);
            assert!(faults.is_empty(), "{name}, {}: {leaks:?}\nby {faults:?}", trace.name());
        }
    }
    validated.verdict();
}

/// Minutes: prints a table.
#[test]
#[ignore = "takes minutes; run it in a release build and read its table"]
fn no_ray_of_a_hundred_million_leaves_a_closed_body() {
    let Some(validated) = Validated::open() else { return };
    println!("| body | tracer | rays | misses | wrong sides | of these wrong in 64 bits |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let counts = [10_000, 100_000, 1_000_000];
    let mut bodies = counts.map(|count| (format!("bumpy, {count}"), scene([Part::glass(bumpy(count), 1.5)]))).to_vec();
    bodies.extend(closed_bodies());
    let mut sum = 0;
    for (name, scene) in bodies {
        let triangles = Triangles::new(&scene);
        for trace in tracers(&validated.gpu) {
            let rays = if trace == Trace::Software { 100_000_000 } else { 10_000_000 };
            let leaks = leaks(&validated.gpu, &scene, &triangles, trace, rays);
            let faults = faults(&scene, &triangles, &leaks);
            let Leaks { rays, misses, wrong_sides, lost } = &leaks;
            let (trace, real) = (trace.name(), lost.len() - faults.len());
            println!("| {name} | {trace} | {rays} | {misses} | {wrong_sides} | {real} of {} |", lost.len());
            for fault in &faults {
                eprintln!("{name}, {trace}: {fault:?}");
            }
            sum += faults.len();
        }
    }
    assert_eq!(sum, 0, "rays leaked");
    validated.verdict();
}
