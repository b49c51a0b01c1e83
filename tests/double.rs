//! The model `double`: against what is known exactly, against `tree` and `path`, and at the ends of its ranges.

mod common;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::path::Path;

use glam::{DAffine3, DVec3};

use common::pictures::{BALL, largest_difference, picture, scene, sized};
use vitrum::optics::fresnel::fresnel_dielectric;
use vitrum::options::{Aov, Model, RenderArgs};
use vitrum::passes::Rendered;
use vitrum::scene::{Dielectric, Overrides, PointLight, Scene, Surface, Surroundings};

fn with(model: Model, width: u32, height: u32) -> RenderArgs {
    RenderArgs { model: Some(model.into()), ..sized(width, height) }
}

fn double(width: u32, height: u32) -> RenderArgs {
    with(Model::Double, width, height)
}

fn ball(ior: f64) -> Scene {
    scene(BALL, &Overrides { ior: Some(ior), ..Overrides::default() })
}

fn white(mut scene: Scene) -> Scene {
    scene.environment.light = Surroundings::Color(DVec3::ONE);
    scene
}

/// All objects of that glass.
fn of_glass(mut scene: Scene, glass: Dielectric) -> Scene {
    for material in &mut scene.materials {
        material.surface = Surface::Dielectric(glass.clone());
    }
    scene
}

fn asset(name: &str, position: DVec3, target: DVec3) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes").join(name);
    let mut scene = Scene::load(Some(&path), &Overrides::default()).expect("a mesh");
    (scene.camera.position, scene.camera.target) = (position, target);
    scene.camera.vertical_fov = 35_f64.to_radians();
    scene
}

fn diamond() -> Scene {
    of_glass(
        asset("diamond.obj", DVec3::new(0.0, 2.0, 3.4), DVec3::new(0.0, -0.22, 0.0)),
        Dielectric { ior: 2.42, ..Dielectric::default() },
    )
}

fn slab() -> Scene {
    asset("slab.obj", DVec3::new(0.9, 0.8, 3.0), DVec3::ZERO)
}

fn built_in() -> Scene {
    Scene::load(None, &Overrides::default()).expect("the built-in scene")
}

fn hollow_ball() -> Scene {
    let mut scene = ball(1.5);
    scene.meshes[0] = shapes::hollow_ball(4, 0.1).into();
    scene
}

fn worst_from(rendered: &Rendered, expected: f32) -> f32 {
    let difference = |value: &f32| if value.is_finite() { (value - expected).abs() } else { f32::INFINITY };
    rendered.radiance.iter().flatten().map(difference).fold(0.0, f32::max)
}

fn rel_mse(found: &Rendered, truth: &Rendered) -> f64 {
    let pairs = found.radiance.iter().flatten().zip(truth.radiance.iter().flatten());
    let errors = pairs.map(|(&x, &r)| (f64::from(x) - f64::from(r)).powi(2) / (f64::from(r).powi(2) + 0.01));
    errors.sum::<f64>() / (3 * truth.radiance.len()) as f64
}

#[test]
fn in_a_furnace_smooth_glass_is_as_bright_as_its_surroundings() {
    let bodies: [(&str, Scene); 5] = [
        ("ball", ball(1.5)),
        ("diamond", diamond()),
        ("slab", slab()),
        ("hollow ball", hollow_ball()),
        ("teapot and cups", built_in()),
    ];
    for (name, scene) in bodies {
        for depth in [1, 2, 16] {
            let args = RenderArgs { max_depth: Some(depth), samples: Some(2), ..double(128, 96) };
            let Some((_, rendered)) = picture(&white(scene.clone()), args) else { return };
            let worst = worst_from(&rendered, 1.0);
            println!("furnace, {name}, depth {depth}: {worst:.1e}");
            assert!(worst <= 1e-5, "{name}, depth {depth}: {worst}");
        }
    }
}

/// Against `tree`, which traces rays through the same triangles. In brackets in the assertions what was measured.
#[test]
fn convex_bodies_agree_with_rays_and_one_interface_does_not() {
    let prism = || {
        let mut scene = asset("prism.obj", DVec3::new(0.8, 0.9, 3.0), DVec3::ZERO);
        scene.objects[0].transform = DAffine3::from_rotation_y(20_f64.to_radians());
        of_glass(scene, Dielectric { ior: 1.5168, ..Dielectric::default() })
    };
    let absorbing = of_glass(
        ball(1.5),
        Dielectric { attenuation_color: DVec3::new(0.4, 0.7, 0.9), attenuation_distance: 1.0, ..Dielectric::default() },
    );
    for (name, scene, most, gain) in [
        ("ball", ball(1.5), 2e-3, 50.0),
        ("absorbing ball", absorbing, 1e-3, 100.0),
        ("slab", slab(), 2e-3, 20.0),
        ("prism", prism(), 8e-3, 4.0),
        ("diamond", diamond(), 6e-2, 1.2),
        ("hollow ball", hollow_ball(), 6e-2, 2.0),
    ] {
        let args = |model| RenderArgs { samples: Some(16), ..with(model, 192, 144) };
        let truth = RenderArgs { max_depth: Some(256), ..args(Model::Tree) };
        let Some((_, truth)) = picture(&scene, truth) else { return };
        let error = |model| picture(&scene, args(model)).map_or(f64::NAN, |(_, found)| rel_mse(&found, &truth));
        let (single, double) = (error(Model::Single), error(Model::Double));
        println!("{name}: relMSE {single:.1e} of single, {double:.1e} of double");
        assert!(double < most, "{name}: {double}");
        assert!(single > gain * double, "{name}: {single} and {double}");
    }
}

#[test]
fn glass_of_index_one_is_invisible() {
    for scene in
        [ball(1.0), Scene::load(None, &Overrides { ior: Some(1.0), ..Overrides::default() }).expect("built in")]
    {
        let empty = Scene { objects: Vec::new(), ..scene.clone() };
        let args = || RenderArgs { samples: Some(4), ..double(128, 96) };
        let Some((_, found)) = picture(&scene, args()) else { return };
        let Some((_, empty)) = picture(&empty, args()) else { return };
        let difference = largest_difference(&found, &empty);
        assert!(difference <= 1e-6, "{difference}");
    }
}

/// Seen head-on each way through a slab takes its share of the light: a sum in closed form.
#[test]
fn a_slab_absorbs_by_beer_and_lambert() {
    let scene = white(of_glass(
        asset("slab.obj", DVec3::new(0.0, 0.0, 50.0), DVec3::ZERO),
        Dielectric {
            attenuation_color: DVec3::new(0.5, 0.25, 1.0),
            attenuation_distance: 0.1,
            ..Dielectric::default()
        },
    ));
    let mut scene = scene;
    scene.camera.vertical_fov = 0.2_f64.to_radians();
    let bounds = scene.bounds().expect("a slab");
    let thickness = bounds.extent().z;
    let Some((_, rendered)) = picture(&scene, RenderArgs { max_depth: Some(64), ..double(9, 9) }) else { return };
    let found = rendered.radiance[40];
    let reflectance = fresnel_dielectric(1.0, 1.0, 1.5).reflectance;
    for (channel, color) in [0.5_f64, 0.25, 1.0].into_iter().enumerate() {
        let through = color.powf(thickness / 0.1);
        let transmitted = 1.0 - reflectance;
        // Mirrored in front, and what has gone to and fro inside once, twice and so on.
        let expected = reflectance + transmitted.powi(2) * through / (1.0 - reflectance * through);
        let difference = (f64::from(found[channel]) - expected).abs();
        println!("channel {channel}: {} for {expected}, thickness {thickness}", found[channel]);
        // Chains end at a throughput of 0.005, whose light is absorbed no more.
        assert!(difference < 2e-3, "channel {channel}: {} for {expected}", found[channel]);
    }
}

/// Light that enters the long side of a right-angled prism is totally reflected twice and comes back.
#[test]
fn a_prism_sends_light_back_by_total_reflection() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("prism.obj");
    // The long side at z = 0 faces the camera, the short ones meet at z = -1 behind it.
    let text = "v -1 -1 0\nv 1 -1 0\nv 0 -1 -1\nv -1 1 0\nv 1 1 0\nv 0 1 -1\n\
                f 1 2 5\nf 1 5 4\nf 2 3 6\nf 2 6 5\nf 3 1 4\nf 3 4 6\nf 1 3 2\nf 4 5 6\n";
    std::fs::write(&path, text).expect("a mesh");
    let mut scene = Scene::load(Some(&path), &Overrides::default()).expect("the prism");
    scene.camera.position = DVec3::new(0.0, 0.0, 30.0);
    scene.camera.target = DVec3::ZERO;
    scene.camera.vertical_fov = 3_f64.to_radians();
    // Light comes from behind the camera alone.
    let (width, height) = (64_u32, 32_u32);
    let texel = |x: u32| if (16..48).contains(&x) { [1.0; 3] } else { [0.0; 3] };
    let texels = (0..width * height).map(|i| texel(i % width)).collect();
    scene.environment.light = Surroundings::Image(vitrum::scene::Panorama::new(width, height, texels));
    let Some((_, rendered)) = picture(&scene, double(33, 33)) else { return };
    // Left and right of the middle, inside of the long side.
    for x in [11, 13, 19, 21] {
        let [value, ..] = rendered.radiance[33 * 16 + x];
        assert!(value > 0.99 && value < 1.0 + 1e-5, "column {x}: {value}");
    }
    let Some((_, rendered)) = picture(&scene, with(Model::Single, 33, 33)) else { return };
    assert!(rendered.radiance[33 * 16 + 12][0] < 0.1);
}

#[test]
fn a_pane_is_two_interfaces_and_bends_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pane.obj");
    std::fs::write(&path, "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n").expect("a mesh");
    let scene = Scene::load(Some(&path), &Overrides::default()).expect("the pane");
    let mut scene = of_glass(scene, Dielectric { thin_walled: true, ..Dielectric::default() });
    // White before the pane's mirror, black behind it: what is seen is what is mirrored.
    let (width, height) = (64_u32, 32_u32);
    let texel = |x: u32| if (16..48).contains(&x) { [1.0; 3] } else { [0.0; 3] };
    let texels = (0..width * height).map(|i| texel(i % width)).collect();
    scene.environment.light = Surroundings::Image(vitrum::scene::Panorama::new(width, height, texels));
    let once = fresnel_dielectric(1.0, 1.0, 1.5).reflectance;
    let expected = 2.0 * once / (1.0 + once);
    for (z, mirrored) in [(40.0, expected), (-40.0, 1.0 - expected)] {
        scene.camera.position = DVec3::new(0.0, 0.0, z);
        scene.camera.target = DVec3::ZERO;
        scene.camera.vertical_fov = 1_f64.to_radians();
        let Some((_, rendered)) = picture(&scene, double(9, 9)) else { return };
        let found = f64::from(rendered.radiance[40][0]);
        assert!((found - mirrored).abs() < 1e-4, "from {z}: {found}, expected {mirrored}");
    }
    let Some((_, rendered)) = picture(&white(scene), double(9, 9)) else { return };
    assert!(worst_from(&rendered, 1.0) <= 1e-6);
}

/// From inside radiance is scaled by the square of the index, as in the other models.
#[test]
fn seen_from_inside_a_body_is_its_last_interface() {
    let mut scene = ball(1.5);
    scene.camera.position = DVec3::new(0.8, 0.0, 0.0);
    scene.camera.target = DVec3::new(0.8, 0.1, -1.0);
    let Some((_, city)) = picture(&scene, double(64, 48)) else { return };
    assert!(city.radiance.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
    let Some((_, rendered)) = picture(&white(scene), double(64, 48)) else { return };
    assert!(worst_from(&rendered, 2.25) <= 2e-5, "{}", worst_from(&rendered, 2.25));
    // An open surface, seen from behind, is no darker than its surroundings either.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("triangle.obj");
    std::fs::write(&path, "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 3 2\n").expect("a mesh");
    let open = white(Scene::load(Some(&path), &Overrides::default()).expect("the triangle"));
    let Some((_, rendered)) = picture(&open, double(17, 17)) else { return };
    assert!(worst_from(&rendered, 1.0) <= 1e-5);
}

#[test]
fn rough_glass_in_white_surroundings_stays_white() {
    for roughness in [0.02, 0.3162, 0.6] {
        let scene = white(scene(BALL, &Overrides { roughness: Some(roughness), ..Overrides::default() }));
        let args = RenderArgs { samples: Some(16), ..double(48, 48) };
        let Some((plan, rendered)) = picture(&scene, args.clone()) else { return };
        assert!(plan.unsupported.names().is_empty());
        let inside = |r: &Rendered| {
            let pixels: Vec<_> = (0..48 * 48)
                .filter(|i| {
                    let (x, y) = ((i % 48) as f64 - 23.5, (i / 48) as f64 - 23.5);
                    x.hypot(y) < 15.0
                })
                .map(|i| f64::from(r.radiance[i][0]))
                .collect();
            pixels.iter().sum::<f64>() / pixels.len() as f64
        };
        let mean = inside(&rendered);
        let lossy = RenderArgs { effects: Some("auto,-energy-compensation".parse().expect("effects")), ..args };
        let Some((_, rendered)) = picture(&scene, lossy) else { return };
        println!("roughness {roughness}: mean {mean:.4}, without compensation {:.4}", inside(&rendered));
        assert!((mean - 1.0).abs() < 0.01, "{roughness}: {mean}");
        assert!(inside(&rendered) < mean, "{roughness}");
    }
}

/// Where a surface begins to count as rough nothing jumps.
#[test]
fn smooth_and_rough_join() {
    let glass = |roughness| scene(BALL, &Overrides { roughness: Some(roughness), ..Overrides::default() });
    let args = || RenderArgs { samples: Some(4), ..double(96, 72) };
    let Some((_, smooth)) = picture(&glass(0.01), args()) else { return };
    let Some((plan, rough)) = picture(&glass(0.010001), args()) else { return };
    assert!(plan.effects.names().contains(&"roughness"));
    let error = rel_mse(&rough, &smooth);
    println!("at the threshold: relMSE {error:.1e}");
    assert!(error < 2e-3, "{error}");
}

#[test]
fn rough_glass_agrees_with_paths() {
    let scene = scene(BALL, &Overrides { roughness: Some(0.3162), ..Overrides::default() });
    let args = |model, samples| RenderArgs { samples: Some(samples), ..with(model, 64, 48) };
    let Some((_, truth)) = picture(&scene, args(Model::Path, 512)) else { return };
    let error = |model, samples| picture(&scene, args(model, samples)).map_or(f64::NAN, |(_, x)| rel_mse(&x, &truth));
    let (single, double) = (error(Model::Single, 16), error(Model::Double, 16));
    println!("rough ball: relMSE {single:.1e} of single, {double:.1e} of double");
    assert!(double < 1e-2 && single > 5.0 * double, "{single} {double}");
}

#[test]
fn the_same_options_make_the_same_bytes() {
    let args = || RenderArgs { samples: Some(3), seed: Some(7), ..double(96, 72) };
    let Some((_, first)) = picture(&built_in(), args()) else { return };
    let Some((_, second)) = picture(&built_in(), args()) else { return };
    assert_eq!(largest_difference(&first, &second), 0.0);
}

#[test]
fn layers_hold_interfaces_and_standard_errors() {
    let aov = Some(vec![Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Object, Aov::Interfaces, Aov::Stderr]);
    let args =
        |samples, seed| RenderArgs { aov: aov.clone(), samples: Some(samples), seed: Some(seed), ..double(64, 48) };
    let scene = ball(1.5);
    let Some((plan, one)) = picture(&scene, args(1, 0)) else { return };
    assert_eq!(plan.effects.names(), ["reflection", "transmission", "interior"]);
    let counts = one.counts.expect("counts");
    assert!(counts.stderr.expect("errors").iter().flatten().all(|&error| error == f32::INFINITY));
    assert_eq!(counts.rays, None);
    let objects = one.aovs.expect("layers").object;
    for (i, (&object, &interfaces)) in objects.iter().zip(&counts.interfaces).enumerate() {
        match object {
            0.0 => assert_eq!(interfaces, 0.0, "pixel {i}"),
            _ => assert!((2.0..=16.0).contains(&interfaces), "pixel {i}: {interfaces}"),
        }
    }
    // Depth 1: one interface wherever there is one.
    let short = RenderArgs { max_depth: Some(1), ..args(1, 0) };
    let counts = picture(&scene, short).expect("a picture").1.counts.expect("counts");
    assert!(counts.interfaces.iter().zip(&objects).all(|(&n, &object)| n == object.min(1.0)));

    // Two standard errors hold the truth in nearly all pixels: samples are spread evenly, so they are upper estimates.
    let (_, truth) = picture(&scene, args(1024, 3)).expect("a picture");
    let (_, few) = picture(&scene, args(16, 0)).expect("a picture");
    let counts = few.counts.expect("counts");
    // The mean over the samples: where a pixel shows the rim, some of them miss the body.
    let rim = counts.interfaces.iter().filter(|n| n.fract() != 0.0).count();
    assert!(rim > 50, "{rim} pixels with a mean that is no whole number");
    let stderr = counts.stderr.expect("errors");
    let values = few.radiance.iter().zip(&truth.radiance).zip(&stderr);
    let held = values.filter(|((a, b), e)| (0..3).all(|i| (a[i] - b[i]).abs() <= 2.0 * e[i] + 1e-4)).count();
    println!("{held} of {} pixels within two standard errors", stderr.len());
    assert!(held as f64 > 0.95 * stderr.len() as f64, "{held}");
}

#[test]
fn samples_end_when_the_tolerance_is_met() {
    let scene = ball(1.5);
    let args = |tolerance| RenderArgs { tolerance: Some(tolerance), samples: None, ..double(64, 48) };
    let Some((_, coarse)) = picture(&scene, args(0.02)) else { return };
    let Some((_, fine)) = picture(&scene, args(0.004)) else { return };
    assert!(coarse.samples >= 32 && fine.samples > coarse.samples, "{} and {}", coarse.samples, fine.samples);
}

#[test]
fn of_two_bodies_the_nearest_is_seen() {
    let glass = |x: f64, z: f64, ior: f64| {
        format!(
            "[material.m{ior_name}]\nkind = \"dielectric\"\nior = {ior}\n[[object]]\nmesh = \"ball.obj\"\n\
             material = \"m{ior_name}\"\ntranslate = [{x}, 0.1, {z}]\n",
            ior_name = (100.0 * ior) as u32
        )
    };
    let camera = "[camera]\nposition = [0, 0.6, 6]\ntarget = [0, 0, 0]\nvertical_fov = 35\n";
    let load = |text: &str| scene(&format!("{camera}{text}"), &Overrides::default());
    let (near, far) = (glass(0.2, 1.2, 1.5), glass(1.3, -1.2, 2.0));
    let Some((_, near_alone)) = picture(&load(&near), double(96, 72)) else { return };
    let args = || RenderArgs { aov: Some(vec![Aov::Object]), ..double(96, 72) };
    for (text, nearest) in [(format!("{near}{far}"), 1.0), (format!("{far}{near}"), 2.0)] {
        let Some((_, both)) = picture(&load(&text), args()) else { return };
        let objects = both.aovs.as_ref().expect("layers").object.clone();
        let (mut seen, mut different) = ([0; 3], 0);
        for (i, &object) in objects.iter().enumerate() {
            seen[object as usize] += 1;
            if object == nearest {
                let (a, b) = (both.radiance[i], near_alone.radiance[i]);
                // Lengths are scaled by the farthest corner of the scene, and so rounded otherwise.
                different += u32::from((0..3).any(|k| (a[k] - b[k]).abs() > 1e-2 * (b[k] + 0.01)));
            }
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
        assert!(different <= seen[nearest as usize] / 100, "{different} of {seen:?}");
    }
}

#[test]
fn huge_tiny_and_mirrored_scenes_look_alike() {
    let plain = ball(1.5);
    let Some((_, expected)) = picture(&plain, double(96, 72)) else { return };
    for factor in [1e6, 1e-6] {
        let mut moved = plain.clone();
        for object in &mut moved.objects {
            object.transform = DAffine3::from_scale(DVec3::splat(factor)) * object.transform;
        }
        moved.camera.position *= factor;
        moved.camera.target *= factor;
        let Some((_, found)) = picture(&moved, double(96, 72)) else { return };
        let error = rel_mse(&found, &expected);
        assert!(error < 1e-5, "{factor}: {error}");
    }
    // A ball in a mirror is a ball.
    let mut mirrored = plain.clone();
    mirrored.objects[0].transform *= DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let Some((_, found)) = picture(&mirrored, double(96, 72)) else { return };
    let error = rel_mse(&found, &expected);
    assert!(error < 1e-2, "mirrored: {error}");
}

/// The highlight of a point light is that of `single`.
#[test]
fn point_lights_shine_off_the_front() {
    for roughness in [0.01, 0.4] {
        let mut scene = scene(BALL, &Overrides { roughness: Some(roughness), ..Overrides::default() });
        scene.environment.light = Surroundings::Color(DVec3::ZERO);
        scene.lights = vec![PointLight::new(DVec3::new(2.0, 3.0, 3.0), DVec3::splat(30.0))];
        let Some((plan, found)) = picture(&scene, double(128, 96)) else { return };
        assert_eq!(plan.unsupported.names(), ["shadows"]);
        let Some((_, single)) = picture(&scene, with(Model::Single, 128, 96)) else { return };
        let difference = largest_difference(&found, &single);
        let brightest = single.radiance.iter().flatten().copied().fold(0.0, f32::max);
        assert!(brightest > 0.0 && difference <= 1e-4 * brightest, "{roughness}: {difference} of {brightest}");
    }
}

/// Nothing breaks where no exit can be found: odd sizes, bodies that fill the picture, indices at the ends of the range.
#[test]
fn values_are_finite_whatever_is_asked_for() {
    let good = |rendered: &Rendered| rendered.radiance.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
    for ior in [1e-6, 0.5, 1.0 + 1e-6, 1e6] {
        for roughness in [0.0, 0.5] {
            let scene = scene(BALL, &Overrides { ior: Some(ior), roughness: Some(roughness), ..Overrides::default() });
            let Some((_, rendered)) = picture(&scene, double(33, 31)) else { return };
            assert!(good(&rendered), "index {ior}, roughness {roughness}");
        }
    }
    let mut near = ball(1.5);
    near.camera.position = DVec3::new(0.0, 0.0, 1.01);
    for (width, height) in [(1, 1), (3, 1), (64, 48)] {
        let Some((_, rendered)) = picture(&white(near.clone()), double(width, height)) else { return };
        assert!(worst_from(&rendered, 1.0) <= 1e-5);
    }
}
