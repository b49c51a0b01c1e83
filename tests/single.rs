//! The original model's pictures: against its equations, in limits that are known exactly, and the right way round.

mod common;

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use common::Validated;
use common::pictures::{BALL, largest_difference, picture, scene, sized};
use common::reference::{Hit, Reference};
use vitrum::options::{Aov, RenderArgs, Tonemap};
use vitrum::passes::{Rendered, pixel_offsets};
use vitrum::scene::{Dielectric, Overrides, PointLight, Scene, Surface, Surroundings};

/// How far from its true place, in pixels, the rasteriser may put an edge; 0 without a device.
fn snap() -> f64 {
    Validated::open().map_or(0.0, |validated| 0.5_f64.powi(validated.gpu.info().sub_pixel_bits as i32))
}

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name)
}

fn built_in(ior: f64) -> Scene {
    Scene::load(None, &Overrides { ior: Some(ior), ..Overrides::default() }).expect("the built-in scene")
}

/// The worst relative difference between device and reference over pixels that are clearly inside a face or a curved surface.
fn worst_difference(name: &str, scene: &Scene, args: RenderArgs) {
    let flipped = args.flipped_ratio == Some(true);
    let Some((plan, rendered)) = picture(scene, args) else { return };
    let reference = Reference::new(scene, plan.size);
    let snap = snap();
    let (mut worst, mut place, mut counted) = (0.0, (0, 0), 0);
    for y in 0..plan.size.height {
        for x in 0..plan.size.width {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let direction = reference.ray(centre);
            let Some(hit) = reference.hit(direction) else { continue };
            if hit.normal.dot(-direction) < 0.02 {
                continue;
            }
            let around = |distance: f64| {
                [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
                    .map(|(x, y)| reference.hit(reference.ray(centre + distance * DVec2::new(x, y))))
            };
            // Away from silhouettes, and where the rasteriser cannot take the next triangle for this one.
            let inside = |other: Option<Hit>| other.is_some_and(|other| other.normal.dot(hit.normal) > 0.9);
            let same = |other: Option<Hit>| other.is_some_and(|other| other.triangle == hit.triangle);
            if !around(0.25).into_iter().all(inside) || !around(snap).into_iter().all(same) {
                continue;
            }
            let expected = reference.shade(&hit, direction, flipped);
            let found = DVec3::from_array(rendered.radiance[(y * plan.size.width + x) as usize].map(f64::from));
            let difference = (found - expected).abs().max_element() / expected.max_element();
            counted += 1;
            assert!(difference.is_finite(), "{name}: {found} at {x}, {y}");
            if difference > worst {
                (worst, place) = (difference, (x, y));
            }
        }
    }
    println!("{name}: worst relative difference {worst:.2e} at {place:?}, {counted} pixels");
    assert!(counted > 2000, "{name}: only {counted} pixels");
    assert!(worst < 1e-3, "{name}: {worst} at {place:?}");
}

#[test]
fn a_ball_agrees_with_the_equations() {
    for ior in [1.0003, 1.5, 2.42] {
        let scene = scene(BALL, &Overrides { ior: Some(ior), ..Overrides::default() });
        worst_difference(&format!("ball {ior}"), &scene, sized(200, 150));
    }
}

#[test]
fn a_ball_with_the_flipped_ratio_agrees_with_the_equations() {
    let scene = scene(BALL, &Overrides::default());
    worst_difference("flipped ball", &scene, RenderArgs { flipped_ratio: Some(true), ..sized(200, 150) });
}

#[test]
fn a_lit_ball_agrees_with_the_equations() {
    let mut scene = scene(BALL, &Overrides { roughness: Some(0.3), ..Overrides::default() });
    scene.lights =
        [(DVec3::new(2.0, 3.0, 2.5), DVec3::new(40.0, 20.0, 10.0)), (DVec3::new(-3.0, 0.5, 3.0), DVec3::splat(9.0))]
            .map(|(position, intensity)| PointLight::new(position, intensity))
            .into();
    // In the original roughness is that of the highlight alone.
    let effects = Some("auto,-roughness".parse().expect("a selection"));
    worst_difference("lit ball", &scene, RenderArgs { effects, ..sized(200, 150) });
}

#[test]
fn a_prism_and_a_pane_agree_with_the_equations() {
    for (mesh, ior) in [("prism", 1.5168), ("slab", 1.5)] {
        let path = asset(&format!("meshes/{mesh}.obj"));
        let mut scene = Scene::load(Some(&path), &Overrides { ior: Some(ior), ..Overrides::default() }).expect(mesh);
        // The slab is a pane: from in front and a little aside.
        scene.camera.position = DVec3::new(0.9, 0.8, 3.0);
        scene.camera.target = DVec3::ZERO;
        worst_difference(mesh, &scene, sized(200, 150));
    }
}

#[test]
fn glass_of_index_one_is_invisible_to_the_last_bit() {
    let glass = built_in(1.0);
    let empty = Scene { objects: Vec::new(), ..glass.clone() };
    let args = RenderArgs { samples: Some(4), ..sized(320, 240) };
    let Some((_, glass)) = picture(&glass, args.clone()) else { return };
    let Some((_, empty)) = picture(&empty, args) else { return };
    assert_eq!(largest_difference(&glass, &empty), 0.0);
}

#[test]
fn glass_of_index_one_is_invisible_from_inside_too() {
    let mut ball = scene(BALL, &Overrides { ior: Some(1.0), ..Overrides::default() });
    ball.camera.position = DVec3::new(0.9, 0.1, 0.0);
    ball.camera.vertical_fov = 2.0;
    let empty = Scene { objects: Vec::new(), ..ball.clone() };
    let Some((_, ball)) = picture(&ball, sized(160, 120)) else { return };
    let Some((_, empty)) = picture(&empty, sized(160, 120)) else { return };
    assert_eq!(largest_difference(&ball, &empty), 0.0);
}

#[test]
fn in_a_furnace_glass_is_as_bright_as_its_surroundings() {
    for ior in [1.0, 1.000001, 1.0003, 1.33, 1.5, 2.0, 2.42] {
        let mut scene = built_in(ior);
        scene.environment.light = Surroundings::Color(DVec3::ONE);
        let Some((_, rendered)) = picture(&scene, RenderArgs { samples: Some(4), ..sized(320, 240) }) else { return };
        let worst = rendered.radiance.iter().flatten().map(|value| (value - 1.0).abs()).fold(0.0, f32::max);
        println!("furnace {ior}: largest difference from 1 is {worst:.1e}");
        assert!(rendered.radiance.iter().flatten().all(|value| (value - 1.0).abs() <= 1e-5), "index {ior}: {worst}");
    }
}

/// Where the original divides by zero: the camera inside, a face met at Brewster's angle, indices not swapped.
#[test]
fn seen_from_inside_values_stay_finite() {
    let mut scene = scene(BALL, &Overrides::default());
    // Close to the wall of the ball: angles of incidence reach 72 degrees, beyond Brewster's at every index.
    scene.camera.position = DVec3::new(0.95, 0.0, 0.0);
    scene.camera.target = DVec3::new(0.95, 0.1, -1.0);
    scene.camera.vertical_fov = 2.5;
    for ior in [1.0, 1.5, 2.42] {
        for material in &mut scene.materials {
            material.surface = Surface::Dielectric(Dielectric { ior, ..Dielectric::default() });
        }
        let Some((_, rendered)) = picture(&scene, sized(320, 240)) else { return };
        let good = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(rendered.radiance.iter().flatten().all(good), "index {ior}");
    }
}

/// Six colours for six sides, and no glass.
fn six_sides() -> Scene {
    let mut scene = built_in(1.5);
    scene.objects.clear();
    let (width, height) = (64_u32, 32_u32);
    let texel = |x: u32, y: u32| match (y * 4 / height, (x * 8 / width).div_ceil(2) % 4) {
        (0, _) => [0.0, 1.0, 1.0],
        (3, _) => [1.0, 0.0, 1.0],
        (_, 0) => [1.0, 0.0, 0.0],
        (_, 1) => [0.0, 1.0, 0.0],
        (_, 2) => [0.0, 0.0, 1.0],
        _ => [1.0, 1.0, 0.0],
    };
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    scene.environment.light = Surroundings::Image(vitrum::scene::Panorama::new(width, height, texels));
    scene.camera.position = DVec3::ZERO;
    scene
}

#[test]
fn the_environment_lies_where_it_should_and_turns_as_it_should() {
    let (front, right, back, left) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
    for (degrees, target, expected) in [
        (0.0_f64, DVec3::NEG_Z, front),
        (0.0, DVec3::X, right),
        (0.0, DVec3::Z, back),
        (0.0, DVec3::NEG_X, left),
        // Anticlockwise seen from above: what was at the right (+x) is now in front (-z).
        (90.0, DVec3::NEG_Z, right),
        (90.0, DVec3::X, back),
        (-90.0, DVec3::NEG_Z, left),
        (180.0, DVec3::NEG_Z, back),
    ] {
        let mut scene = six_sides();
        scene.camera.target = target;
        scene.environment.rotation = degrees.to_radians();
        let Some((_, rendered)) = picture(&scene, sized(9, 9)) else { return };
        assert_eq!(rendered.radiance[40], expected, "{degrees} degrees, towards {target}");
    }
}

#[test]
fn left_is_left_and_up_is_up() {
    let mut scene = six_sides();
    scene.camera.target = DVec3::NEG_Z;
    scene.camera.vertical_fov = 150_f64.to_radians();
    let Some((_, rendered)) = picture(&scene, sized(33, 33)) else { return };
    let pixel = |x: usize, y: usize| rendered.radiance[33 * y + x];
    assert_eq!(pixel(0, 16), [1.0, 1.0, 0.0], "left");
    assert_eq!(pixel(32, 16), [0.0, 1.0, 0.0], "right");
    assert_eq!(pixel(16, 0), [0.0, 1.0, 1.0], "top");
    assert_eq!(pixel(16, 32), [1.0, 0.0, 1.0], "bottom");
}

#[test]
fn layers_hold_normal_distance_and_object() {
    let text = BALL.to_owned()
        + r#"
[[object]]
mesh = "ball.obj"
material = "glass"
translate = [1.5, 0.5, -3.0]
scale = [0.5, 1.0, 2.0]
rotate = [10, 20, 30]
"#;
    let scene = scene(&text, &Overrides::default());
    let args = RenderArgs { aov: Some(vec![Aov::Normal, Aov::Depth, Aov::Object]), ..sized(160, 120) };
    let Some((plan, rendered)) = picture(&scene, args) else { return };
    let aovs = rendered.aovs.expect("layers");
    let reference = Reference::new(&scene, plan.size);
    let mut seen = [0; 3];
    for i in 0..aovs.depth.len() {
        let centre = DVec2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
        let corners = [(0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4), (0.0, 0.0)];
        let hits = corners.map(|(dx, dy)| reference.hit(reference.ray(centre + DVec2::new(dx, dy))));
        let Some(hit) = hits[4] else {
            if hits.iter().all(Option::is_none) {
                assert_eq!((aovs.normal[i], aovs.depth[i], aovs.object[i]), ([0.0; 3], 0.0, 0.0));
                seen[0] += 1;
            }
            continue;
        };
        if hits.iter().all(|other| other.is_some_and(|other| other.object == hit.object)) {
            assert_eq!(aovs.object[i], hit.object as f32 + 1.0, "pixel {i}");
            let depth = f64::from(aovs.depth[i]);
            // A triangle beside the one that the reference hits, seen at a slant, lies a little nearer or farther.
            assert!((depth / hit.distance - 1.0).abs() < 1e-4, "pixel {i}: {depth}, expected {}", hit.distance);
            let normal = DVec3::from_array(aovs.normal[i].map(f64::from));
            assert!((normal - hit.normal).length() < 2e-2, "pixel {i}: {normal}, expected {}", hit.normal);
            seen[hit.object + 1] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
}

/// The same scene a thousand kilometres away, a million times larger and smaller: the same picture.
#[test]
fn huge_tiny_and_far_scenes_look_alike() {
    let args = || RenderArgs { aov: Some(vec![Aov::Depth]), ..sized(96, 72) };
    let plain = scene(BALL, &Overrides::default());
    let Some((_, expected)) = picture(&plain, args()) else { return };
    for (factor, shift) in [(1e6, 0.0), (1e-6, 0.0), (1.0, 1e6)] {
        let shift = DVec3::splat(shift);
        let mut moved = plain.clone();
        for object in &mut moved.objects {
            object.transform = glam::DAffine3::from_translation(shift)
                * glam::DAffine3::from_scale(DVec3::splat(factor))
                * object.transform;
        }
        moved.camera.position = plain.camera.position * factor + shift;
        moved.camera.target = plain.camera.target * factor + shift;
        let Some((_, found)) = picture(&moved, args()) else { return };
        let differing = expected
            .radiance
            .iter()
            .zip(&found.radiance)
            .filter(|(a, b)| (0..3).any(|i| (a[i] - b[i]).abs() > 0.01 * (a[i] + 0.01)))
            .count();
        assert!(differing <= 5, "{factor} {shift}: {differing} pixels differ");
        let depth = |rendered: &Rendered| f64::from(rendered.aovs.as_ref().expect("layers").depth[96 * 36 + 48]);
        assert!((depth(&found) / (depth(&expected) * factor) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn debug_controls_do_what_the_report_says() {
    let mut scene = scene(BALL, &Overrides::default());
    scene.environment.light = Surroundings::Color(DVec3::splat(0.5));
    let centre = |args: RenderArgs| Some(picture(&scene, args)?.1.radiance[32 * 16 + 16]);
    let args = || sized(32, 32);
    // Fresnel reflectance at nearly normal incidence, from the picture itself.
    let Some(reflection) = centre(RenderArgs { transmission_intensity: Some(0.0), ..args() }) else { return };
    let fresnel = reflection[0] / 0.5;
    assert!((fresnel - 0.04).abs() < 1e-3);
    let near = |found: Option<[f32; 3]>, expected: [f32; 3]| {
        let found = found.expect("a picture");
        assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 1e-5), "{found:?}, expected {expected:?}");
    };
    near(centre(RenderArgs { reflection_intensity: Some(0.0), ..args() }), [0.5 * (1.0 - fresnel); 3]);
    near(centre(RenderArgs { reflection_red: Some(1.0), ..args() }), [0.5 + fresnel, 0.5, 0.5]);
    near(centre(RenderArgs { transmission_green: Some(1.0), ..args() }), [0.5, 1.5 - fresnel, 0.5]);
    let halved = RenderArgs { transmission_green: Some(1.0), transmission_intensity: Some(0.5), ..args() };
    let reflected = 0.5 * fresnel;
    let transmitted = 0.5 * (1.0 - fresnel);
    near(centre(halved), [0.5 * transmitted + reflected, 1.5 * transmitted + reflected, 0.5 * transmitted + reflected]);
    // Effects that are taken away are dark.
    let only = |list: &str| RenderArgs { effects: Some(list.parse().expect("a list")), ..args() };
    near(centre(only("auto,-transmission")), reflection);
    near(centre(only("transmission")), [transmitted; 3]);
}

/// When samples are jittered the rasteriser moves with the rays: a body is where the ray of the sample meets it.
#[test]
fn edges_move_with_the_rays_of_a_sample() {
    let mut scene = scene(BALL, &Overrides::default());
    scene.environment.light = Surroundings::Color(DVec3::ONE);
    for seed in [0, 1, 2, 3] {
        // A black body.
        let dark = Some(0.0);
        let args =
            RenderArgs { seed: Some(seed), transmission_intensity: dark, reflection_intensity: dark, ..sized(96, 72) };
        let Some((plan, rendered)) = picture(&scene, args) else { return };
        let offset = pixel_offsets(plan.budget, seed).next().expect("a sample");
        let reference = Reference::new(&scene, plan.size);
        let mut edges = 0;
        for (i, pixel) in rendered.radiance.iter().enumerate() {
            let centre = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            let is_hit = |x, y| reference.hit(reference.ray(centre + offset + DVec2::new(x, y))).is_some();
            let hit = is_hit(0.0, 0.0);
            let near = |distance: f64| {
                [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)]
                    .iter()
                    .any(|(x, y)| is_hit(x * distance, y * distance) != hit)
            };
            // The rasteriser may snap an edge to the other side of the ray.
            if !near(0.07) {
                assert_eq!(pixel[0] == 0.0, hit, "seed {seed}, pixel {i}, offset {offset}");
                edges += usize::from(near(0.5));
            }
        }
        assert!(edges > 50, "{edges}");
    }
}

/// Backs are left out of closed bodies alone.
#[test]
fn an_open_surface_is_seen_from_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("triangle.obj");
    std::fs::write(&path, "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 3 2\n").expect("a mesh");
    let scene = Scene::load(Some(&path), &Overrides::default()).expect("the triangle");
    let args = RenderArgs { aov: Some(vec![Aov::Object]), ..sized(17, 17) };
    let Some((_, rendered)) = picture(&scene, args) else { return };
    let objects = rendered.aovs.expect("layers").object;
    assert_eq!(objects[17 * 8 + 8], 1.0);
    assert_eq!(objects[0], 0.0);
}

#[test]
fn tone_curves_are_what_they_are_called() {
    let mut scene = built_in(1.5);
    scene.objects.clear();
    let mut display = |curve: Tonemap, color: DVec3| {
        scene.environment.light = Surroundings::Color(color);
        let args = RenderArgs { tonemap: Some(curve), exposure: Some(1.0), ..sized(1, 1) };
        picture(&scene, args).map(|(_, rendered)| rendered.display[0])
    };
    let encode = |x: f64| (255.0 * (1.055 * x.powf(1.0 / 2.4) - 0.055)).round() as u8;
    let mut before = [0; 3];
    for grey in [0.02, 0.1, 0.18, 0.25, 0.5, 1.0, 3.0, 100.0] {
        let all = [Tonemap::None, Tonemap::Neutral, Tonemap::Agx].map(|curve| display(curve, DVec3::splat(grey)));
        let [Some(none), Some(neutral), Some(agx)] = all else { return };
        // One stop brighter.
        let x = 2.0 * grey;
        assert_eq!(none[0], encode(x.min(1.0)));
        // Khronos PBR Neutral for greys: 4 % taken away, from 0.76 on rolled off.
        let y = if x < 0.08 { 6.25 * x * x } else { x - 0.04 };
        let y = if y < 0.76 { y } else { 1.0 - 0.24 * 0.24 / (y + 0.24 - 0.76) };
        assert!(neutral[0].abs_diff(encode(y)) <= 1, "{grey}: {neutral:?}, expected {}", encode(y));
        // AgX keeps greys grey and never turns back; middle grey lands in the middle.
        assert!(agx[0].abs_diff(agx[1]) <= 1 && agx[1].abs_diff(agx[2]) <= 1, "{grey}: {agx:?}");
        let now = [none[0], neutral[0], agx[0]];
        assert!((0..3).all(|i| now[i] >= before[i]), "{grey}: {now:?} after {before:?}");
        before = now;
        println!("{grey}: {now:?}");
    }
    // Bright colours lose their hue to white in both.
    let red = DVec3::new(1000.0, 10.0, 10.0);
    let [Some(neutral), Some(agx)] = [Tonemap::Neutral, Tonemap::Agx].map(|curve| display(curve, red)) else { return };
    assert!(neutral[1] > 200 && agx[1] > 100, "{neutral:?} {agx:?}");
}

/// A sum of many samples would lose a share of each to rounding.
#[test]
fn the_mean_of_many_samples_stays_exact() {
    let mut scene = built_in(1.5);
    scene.objects.clear();
    scene.environment.light = Surroundings::Color(DVec3::new(1.1, 0.3, 7.7));
    let Some((_, rendered)) = picture(&scene, RenderArgs { samples: Some(5000), ..sized(2, 2) }) else { return };
    for (found, expected) in rendered.radiance[3].into_iter().zip([1.1_f32, 0.3, 7.7]) {
        assert!((found / expected - 1.0).abs() < 2e-7, "{found}, expected {expected}");
    }
}

#[test]
fn more_samples_converge_to_the_same_picture_whatever_the_seed() {
    let scene = built_in(1.5);
    let args = |samples, seed| RenderArgs { samples: Some(samples), seed: Some(seed), ..sized(64, 48) };
    let Some((_, truth)) = picture(&scene, args(400, 0)) else { return };
    let error = |samples, seed| {
        let (_, found) = picture(&scene, args(samples, seed)).expect("a picture");
        let pairs = found.radiance.iter().flatten().zip(truth.radiance.iter().flatten());
        let sum: f32 = pairs.map(|(x, r)| (x - r).powi(2) / (r * r + 0.01)).sum();
        sum / (64.0 * 48.0 * 3.0)
    };
    for seed in [0, 1, 2] {
        let (few, many) = (error(4, seed), error(36, seed));
        assert!(many < few / 5.0, "seed {seed}: {few} with 4 samples, {many} with 36");
    }
}

/// Backs of closed bodies are not drawn; a body that is said to be open is drawn with them.
#[test]
fn leaving_out_the_backs_of_closed_bodies_changes_nothing() {
    let mut scene = built_in(1.5);
    // Mirrored bodies have their fronts the other way round.
    scene.objects[0].transform *= glam::DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let Some((_, fronts)) = picture(&scene, sized(512, 384)) else { return };
    for mesh in &mut scene.meshes {
        std::sync::Arc::make_mut(mesh).faults.open_edges = 1;
    }
    let Some((_, both)) = picture(&scene, sized(512, 384)) else { return };
    let differing = fronts.radiance.iter().zip(&both.radiance).filter(|(a, b)| a != b).count();
    println!("{differing} pixels differ");
    assert!(differing < 10);
}
