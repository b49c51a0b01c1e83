//! Rough glass in the model `single`: against visible normals counted in 64 bits, in white surroundings, and at its limits.

mod common;

use glam::{DVec2, DVec3};

use common::pictures::{BALL, largest_difference, picture, scene, sized};
use common::reference::Reference;
use vitrum::optics::microfacet::{masking_ggx, sample_visible_normal, sin_squared};
use vitrum::optics::rough::RoughInterface;
use vitrum::optics::{fresnel, original};
use vitrum::options::RenderArgs;
use vitrum::passes::Rendered;
use vitrum::scene::{Dielectric, Overrides, Panorama, PointLight, Scene, Surface, Surroundings};

fn ball(roughness: f64, ior: f64) -> Scene {
    scene(BALL, &Overrides { roughness: Some(roughness), ior: Some(ior), ..Overrides::default() })
}

fn white(mut scene: Scene) -> Scene {
    scene.environment.light = Surroundings::Color(DVec3::ONE);
    scene
}

fn effects(list: &str) -> RenderArgs {
    RenderArgs { effects: Some(list.parse().expect("a selection")), ..sized(96, 96) }
}

/// For each pixel that shows the ball, its value and the cosine between view and normal.
fn by_cosine(scene: &Scene, rendered: &Rendered, side: u32) -> Vec<(f64, f64)> {
    let reference = Reference::new(scene, vitrum::options::Size { width: side, height: side });
    let value = |(i, pixel): (usize, &[f32; 3])| {
        let (x, y) = (i as u32 % side, i as u32 / side);
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let at = |x: f64, y: f64| reference.hit(reference.ray(centre + DVec2::new(x, y)));
        let whole = [(0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)].iter().all(|&(x, y)| at(x, y).is_some());
        let hit = at(0.0, 0.0).filter(|_| whole)?;
        Some((f64::from(pixel[0]), hit.normal.dot(-reference.ray(centre))))
    };
    rendered.radiance.iter().enumerate().filter_map(value).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count)
}

#[test]
fn the_originals_default_is_smooth_to_the_last_bit() {
    let Some((_, smooth)) = picture(&ball(0.0, 1.5), sized(96, 96)) else { return };
    let Some((plan, default)) = picture(&ball(0.01, 1.5), sized(96, 96)) else { return };
    assert_eq!(plan.effects.names(), ["reflection", "transmission"]);
    assert_eq!(largest_difference(&smooth, &default), 0.0);
    // Taken away, and there without being called for.
    let Some((_, without)) = picture(&ball(0.5, 1.5), effects("auto,-roughness")) else { return };
    assert_eq!(largest_difference(&smooth, &without), 0.0);
    let Some((_, all)) = picture(&ball(0.01, 1.5), effects("all")) else { return };
    assert_eq!(largest_difference(&smooth, &all), 0.0);
}

/// Where a surface begins to count as rough nothing jumps.
#[test]
fn smooth_and_rough_join() {
    let args = || RenderArgs { samples: Some(16), ..sized(96, 96) };
    let Some((_, smooth)) = picture(&ball(0.01, 1.5), args()) else { return };
    let Some((plan, rough)) = picture(&ball(0.010001, 1.5), args()) else { return };
    assert!(plan.effects.names().contains(&"roughness"));
    let pairs = || smooth.radiance.iter().flatten().zip(rough.radiance.iter().flatten());
    let difference = mean(pairs().map(|(a, b)| f64::from((a - b).abs() / (a + 0.01))));
    let worst = pairs().map(|(a, b)| f64::from((a - b).abs() / (a + 0.01))).fold(0.0, f64::max);
    println!("at the threshold: mean difference {difference:.1e}, largest {worst:.1e}");
    assert!(difference < 5e-4, "{difference}");
    assert!(worst < 0.2, "{worst}");
}

#[test]
fn glass_of_index_one_is_invisible_however_rough() {
    let glass = ball(0.5, 1.0);
    let empty = Scene { objects: Vec::new(), ..glass.clone() };
    let Some((_, glass)) = picture(&glass, sized(96, 96)) else { return };
    let Some((_, empty)) = picture(&empty, sized(96, 96)) else { return };
    assert_eq!(largest_difference(&glass, &empty), 0.0);
}

/// Surroundings of radiance 1 show radiance 1: in the mean to 0.2 % from the middle to the rim, in each pixel but for noise.
#[test]
fn white_surroundings_stay_white() {
    for ior in [1.0003, 1.5, 2.42] {
        for roughness in [0.02, 0.1, 0.3, 0.6, 1.0] {
            let scene = white(ball(roughness, ior));
            let args = RenderArgs { samples: Some(64), ..sized(96, 96) };
            let Some((_, rendered)) = picture(&scene, args) else { return };
            let pixels = by_cosine(&scene, &rendered, 96);
            let mut rings = Vec::new();
            for (low, high) in [(0.0, 0.2), (0.2, 0.5), (0.5, 0.8), (0.8, 1.01)] {
                let inside = pixels.iter().filter(|(_, cosine)| (low..high).contains(cosine));
                rings.push(mean(inside.map(|&(value, _)| value)));
            }
            let worst = pixels.iter().map(|&(value, _)| (value - 1.0).abs()).fold(0.0, f64::max);
            println!("furnace {ior}, roughness {roughness}: rings {rings:.5?}, worst pixel off by {worst:.3}");
            assert!(rings.iter().all(|ring| (ring - 1.0).abs() < 2e-3), "{ior} {roughness}: {rings:?}");
            assert!(worst < 0.05, "{ior} {roughness}: {worst}");
        }
    }
}

/// The halves of an image, packed below it, are white where the image is, whatever its size.
#[test]
fn white_images_of_any_size_stay_white() {
    for (width, height) in [(1, 1), (2, 2), (13, 7), (1, 64), (64, 1), (7, 301), (301, 7), (1000, 499)] {
        let mut scene = ball(0.5, 1.5);
        let texels = vec![[1.0; 3]; (width * height) as usize];
        scene.environment.light = Surroundings::Image(Panorama::new(width, height, texels));
        let Some((_, image)) = picture(&scene, sized(48, 48)) else { return };
        let Some((_, color)) = picture(&white(scene), sized(48, 48)) else { return };
        let difference = largest_difference(&image, &color);
        assert!(difference < 1e-5, "{width}x{height}: {difference}");
    }
}

/// Without a number of samples that is known, cones shrink as they come.
#[test]
fn a_time_budget_stays_white_too() {
    let scene = white(ball(0.5, 1.5));
    let args = RenderArgs { time_budget: Some(60.0), samples: Some(20), ..sized(48, 48) };
    let Some((plan, rendered)) = picture(&scene, args) else { return };
    assert!(matches!(plan.budget, vitrum::plan::Budget::Seconds { .. }));
    let pixels = by_cosine(&scene, &rendered, 48);
    let mean = mean(pixels.iter().map(|&(value, _)| value));
    assert!((mean - 1.0).abs() < 2e-3, "{mean}");
}

/// What a single bounce loses is what the 64-bit albedo says it is.
#[test]
fn without_compensation_the_loss_shows() {
    for (roughness, ior) in [(0.3, 1.5), (0.7, 1.5), (1.0, 1.5), (1.0, 2.42)] {
        let scene = white(ball(roughness, ior));
        let args = RenderArgs { samples: Some(16), ..effects("auto,-energy-compensation") };
        let Some((_, rendered)) = picture(&scene, args) else { return };
        let interface = RoughInterface { alpha: roughness * roughness, eta_i: 1.0, eta_t: ior };
        let pixels = by_cosine(&scene, &rendered, 96);
        let ratio = mean(pixels.iter().step_by(7).map(|&(value, cosine)| {
            let (reflected, transmitted) = interface.albedo(cosine, 987);
            value / (reflected + transmitted)
        }));
        let darkest = pixels.iter().map(|&(value, _)| value).fold(1.0, f64::min);
        println!("roughness {roughness}, index {ior}: {ratio:.5} of the albedo, darkest {darkest:.3}");
        assert!((ratio - 1.0).abs() < 3e-3, "{roughness} {ior}: {ratio}");
        assert!(darkest < 0.99);
    }
}

/// A picture of many samples against a mean over visible normals in 64 bits that looks the environment up as it is.
#[test]
fn a_rough_ball_agrees_with_visible_normals_in_64_bits() {
    for (roughness, ior) in [(0.1, 1.5), (0.3, 2.42), (0.7, 1.33)] {
        let scene = ball(roughness, ior);
        let args = RenderArgs { samples: Some(512), ..effects("auto,-energy-compensation") };
        let Some((plan, rendered)) = picture(&scene, args) else { return };
        let reference = Reference::new(&scene, plan.size);
        let alpha = roughness * roughness;
        let (mut sum, mut count, mut worst) = (0.0, 0, 0.0_f64);
        for (x, y) in (0..96).step_by(9).flat_map(|x| (0..96).step_by(9).map(move |y| (x, y))) {
            let direction = reference.ray(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            let Some(hit) = reference.hit(direction).filter(|hit| hit.normal.dot(-direction) > 0.3) else { continue };
            let across = hit.normal.any_orthonormal_vector();
            let other = hit.normal.cross(across);
            let to_world = |w: DVec3| w.x * across + w.y * other + w.z * hit.normal;
            let view = -direction;
            let wi = DVec3::new(view.dot(across), view.dot(other), view.dot(hit.normal));
            let mut expected = DVec3::ZERO;
            let normals = 6765;
            for i in 0..normals {
                let golden = 0.618_033_988_749_894_9;
                let u = DVec2::new((f64::from(i) * golden).fract(), (f64::from(i) + 0.5) / f64::from(normals));
                let wm = sample_visible_normal(wi, alpha, u);
                let facet = fresnel::fresnel_dielectric(wi.dot(wm), 1.0, ior);
                let mirrored = original::reflection_dir(wi, wm);
                if mirrored.z > 0.0 {
                    let weight = facet.reflectance * masking_ggx(mirrored.z, sin_squared(mirrored), alpha);
                    expected += weight * reference.environment(to_world(mirrored));
                }
                if let Some(refracted) = fresnel::refract(wi, wm, 1.0, ior).filter(|wt| wt.z < 0.0) {
                    let weight = facet.transmittance * masking_ggx(-refracted.z, sin_squared(refracted), alpha);
                    expected += weight * reference.environment(to_world(refracted));
                }
            }
            expected /= f64::from(normals);
            let found = DVec3::from_array(rendered.radiance[y as usize * 96 + x as usize].map(f64::from));
            let error = (found - expected).abs().max_element() / expected.max_element();
            worst = worst.max(error);
            sum += error;
            count += 1;
        }
        println!(
            "rough ball {roughness}, {ior}: mean error {:.1e}, worst {worst:.1e}, {count} pixels",
            sum / f64::from(count)
        );
        assert!(count > 20, "{count}");
        // The picture is a mean over the pixel, the reference its centre; the former has 2048 normals.
        assert!(sum / f64::from(count) < 0.02 && worst < 0.1, "{roughness} {ior}: {sum} over {count}, worst {worst}");
    }
}

/// Point lights shine off rough glass and through it: one pixel after another against the BSDF in 64 bits.
#[test]
fn point_lights_shine_through_rough_glass_and_off_it() {
    let mut scene = ball(0.5, 1.5);
    scene.environment.light = Surroundings::Color(DVec3::ZERO);
    let light = |x: f64, y: f64, z: f64| PointLight::new(DVec3::new(x, y, z), DVec3::new(9.0, 5.0, 2.0));
    for (name, light) in [("off", light(2.0, 2.0, 3.0)), ("through", light(0.5, 0.5, -3.0))] {
        scene.lights = vec![light];
        let Some((plan, rendered)) = picture(&scene, effects("auto,-energy-compensation")) else { return };
        let reference = Reference::new(&scene, plan.size);
        let interface = RoughInterface { alpha: 0.25, eta_i: 1.0, eta_t: 1.5 };
        let (mut counted, mut worst) = (0, 0.0_f64);
        for (i, found) in rendered.radiance.iter().enumerate() {
            let direction = reference.ray(DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5));
            let Some(hit) = reference.hit(direction).filter(|hit| hit.normal.dot(-direction) > 0.1) else { continue };
            let to_light = light.position - (scene.camera.position + hit.distance * direction);
            let across = hit.normal.any_orthonormal_vector();
            let other = hit.normal.cross(across);
            let local = |w: DVec3| DVec3::new(w.dot(across), w.dot(other), w.dot(hit.normal));
            let (wi, wo) = (local(-direction), local(to_light.normalize()));
            // The original leaves the scale of transmitted radiance out.
            let scale = if wo.z < 0.0 { 2.25 } else { 1.0 };
            let expected = scale * interface.evaluate(wi, wo).value * light.intensity.x / to_light.length_squared();
            if expected < 1e-3 {
                continue;
            }
            worst = worst.max((f64::from(found[0]) / expected - 1.0).abs());
            counted += 1;
        }
        println!("light {name}: worst relative difference {worst:.1e} over {counted} pixels");
        assert!(counted > 500 && worst < 2e-3, "{name}: {worst}, {counted} pixels");
    }
}

#[test]
fn nothing_breaks_at_the_ends_of_the_ranges() {
    for ior in [1e-6, 0.4132, 1.0 - 1e-7, 1.0 + 1e-6, 1.0003, 2.42, 1e6] {
        for roughness in [0.0101, 0.5, 1.0] {
            let mut scene = ball(roughness, ior);
            scene.lights = vec![PointLight::new(DVec3::new(0.0, 2.0, -3.0), DVec3::splat(10.0))];
            let Some((_, rendered)) = picture(&scene, sized(48, 48)) else { return };
            let good = |value: &f32| value.is_finite() && *value >= 0.0;
            assert!(rendered.radiance.iter().flatten().all(good), "index {ior}, roughness {roughness}");
        }
    }
}

/// From inside facets mirror everything, as the smooth surface of the original does, and lose nothing.
#[test]
fn from_inside_rough_glass_is_a_blurred_mirror() {
    let mut scene = ball(0.4, 1.5);
    scene.environment.light = Surroundings::Color(DVec3::ONE);
    scene.camera.position = DVec3::new(0.5, 0.0, 0.0);
    scene.camera.target = DVec3::new(0.5, 0.1, -1.0);
    let Some((_, rendered)) = picture(&scene, sized(64, 64)) else { return };
    let worst = rendered.radiance.iter().flatten().map(|value| (value - 1.0).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{worst}");
    // A light in there shows no more than on the smooth surface: nothing.
    scene.environment.light = Surroundings::Color(DVec3::ZERO);
    scene.lights = vec![PointLight::new(DVec3::new(0.4, 0.3, 0.0), DVec3::ONE)];
    let Some((_, rendered)) = picture(&scene, sized(64, 64)) else { return };
    assert!(rendered.radiance.iter().flatten().all(|&value| value == 0.0));
}

/// With more samples cones shrink: a bright spot is less and less averaged, and the picture tends to that of many.
#[test]
fn more_samples_converge() {
    let mut scene = ball(0.3, 1.5);
    let texels = (0..64 * 32).map(|i| if i % 97 == 0 { [30.0, 10.0, 1.0] } else { [0.2; 3] }).collect();
    scene.environment.light = Surroundings::Image(Panorama::new(64, 32, texels));
    let args = |samples, seed| RenderArgs { samples: Some(samples), seed: Some(seed), ..sized(48, 48) };
    let Some((_, truth)) = picture(&scene, args(1024, 0)) else { return };
    let error = |samples, seed| {
        let (_, found) = picture(&scene, args(samples, seed)).expect("a picture");
        let pairs = found.radiance.iter().flatten().zip(truth.radiance.iter().flatten());
        mean(pairs.map(|(x, r)| f64::from((x - r).powi(2) / (r * r + 0.01))))
    };
    for seed in [1, 2] {
        let (few, many) = (error(4, seed), error(128, seed));
        println!("seed {seed}: {few:.1e} with 4 samples, {many:.1e} with 128");
        assert!(many < few / 5.0, "seed {seed}: {few}, {many}");
    }
}

/// A scene without rough materials has nothing of what they need: no tables, no averages of its environment.
#[test]
fn smooth_scenes_pay_nothing() {
    let peak = |roughness: f64, list: &str| {
        let scene = ball(roughness, 1.5);
        let validated = common::Validated::open()?;
        let args = RenderArgs { effects: Some(list.parse().expect("a selection")), ..sized(16, 16) };
        let plan = vitrum::plan::Plan::new(&scene, &args).expect("a plan");
        vitrum::passes::render(&validated.gpu, &scene, &plan, &mut |_| {}).expect("a picture");
        let bytes = validated.gpu.peak_bytes();
        validated.verdict();
        Some(bytes)
    };
    let (Some(smooth), Some(rough)) = (peak(0.01, "auto"), peak(0.5, "auto")) else { return };
    println!("{smooth} bytes smooth, {rough} rough");
    assert!(smooth < rough);
    assert_eq!(Some(smooth), peak(0.01, "all"));
    assert_eq!(Some(smooth), peak(0.5, "auto,-roughness"));
    let mut mixed = ball(0.01, 1.5);
    mixed.materials.push(vitrum::scene::Material::new(
        "worn by nothing".into(),
        Surface::Dielectric(Dielectric { roughness: 0.5, ..Dielectric::default() }),
    ));
    let plan = vitrum::plan::Plan::new(&mixed, &sized(16, 16)).expect("a plan");
    assert!(!plan.effects.names().contains(&"roughness"));
}
