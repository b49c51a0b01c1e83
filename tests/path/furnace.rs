//! Under white light everything is white.

use glam::{DAffine3, DVec3};

use vitrum::scene::{Dielectric, Dispersion, Opaque, Surface};

use crate::bodies::{self, in_white};
use crate::common::Validated;
use crate::device::{Shot, picture};
use crate::shapes::{Part, glass, icosphere, scene};

/// Smooth glass sends on whatever it meets: each path is worth 1, or 0 where it was too long.
#[test]
fn smooth_bodies_are_white_to_the_bit() {
    let Some(validated) = Validated::open() else { return };
    for (name, scene) in bodies::all() {
        let found = picture(&validated, &in_white(scene), Shot { samples: 32, depth: 256, ..Shot::default() });
        let above = found.radiance.iter().filter(|value| value.max_element() > 1.0 + 1e-6).count();
        let lost = 1.0 - found.mean().min_element();
        println!("{name}: {lost:.1e} is lost to the depth");
        assert_eq!(above, 0, "{name}: pixels above 1");
        assert!(lost < 0.01, "{name}: {lost}");
    }
    validated.verdict();
}

/// What a picture lacks for being white is what it says it cut off.
#[test]
fn what_is_cut_off_is_counted() {
    let Some(validated) = Validated::open() else { return };
    // From inside light is brighter, and what is cut off is, too.
    let mut inside = bodies::ball();
    inside.camera.position = DVec3::new(0.1, 0.2, 0.3);
    // Light of many wavelengths is white together, as far as the samples tell.
    let disperser = Dielectric { dispersion: Dispersion::Khr(1.0), ..glass(1.6) };
    let dispersing = scene([Part::of(icosphere(4), Surface::Dielectric(disperser))]);
    let others = [("inside a ball", inside), ("dispersing ball", dispersing)];
    for (name, scene) in bodies::all().into_iter().chain(others) {
        let scene = in_white(scene);
        let white = if name.starts_with("inside") { 2.25 } else { 1.0 };
        for depth in [0, 1, 4] {
            let found = picture(&validated, &scene, Shot { samples: 32, depth, ..Shot::default() });
            let lost = found.discarded.iter().sum::<f64>() / found.discarded.len() as f64;
            let pixels = found.radiance.iter().zip(&found.discarded);
            let worst = pixels.map(|(value, cut)| (*value + *cut - white).abs().max_element()).fold(0.0, f64::max);
            println!("{name}, depth {depth}: {lost:.1e} cut off, {worst:.1e} not accounted for");
            assert!(worst < 1e-5 || name.starts_with("dispersing"), "{name}, depth {depth}: {worst:e}");
            let mean = found.mean().element_sum() / 3.0 + lost;
            assert!((mean / white - 1.0).abs() < 2e-3, "{name}, depth {depth}: {mean} in the mean");
            // A pane is one interface.
            assert!(lost > 1e-3 || depth > 0 && name == "pane" || depth > 3, "{name}, depth {depth}: {lost:e}");
        }
    }
    validated.verdict();
}

/// Radiance in glass is that of the world times the square of its index.
#[test]
fn from_inside_of_glass_the_world_is_brighter() {
    let Some(validated) = Validated::open() else { return };
    let mut scene = in_white(scene([Part::glass(icosphere(5), 1.5)]));
    scene.camera.position = DVec3::new(0.1, 0.2, 0.3);
    let found = picture(&validated, &scene, Shot { samples: 32, depth: 256, ..Shot::default() });
    let worst = found.radiance.iter().map(|value| (*value - 2.25).abs().max_element()).fold(0.0, f64::max);
    assert!(worst < 1e-5, "{worst:e}");
    validated.verdict();
}

/// What facets lose is given back: 1 within a per cent, whatever roughness and index.
#[test]
fn rough_bodies_are_white() {
    let Some(validated) = Validated::open() else { return };
    for ior in [1.1, 1.5, 2.42] {
        for roughness in [0.1_f64, 0.3, 0.6, 1.0] {
            let frosted = Dielectric { roughness, ..glass(ior) };
            let scene = in_white(scene([Part::of(icosphere(5), Surface::Dielectric(frosted))]));
            let found = picture(&validated, &scene, Shot { depth: 1024, samples: 64, ..Shot::default() });
            let body: Vec<usize> = (0..found.radiance.len()).filter(|&i| found.interfaces[i] > 0.5).collect();
            let count = body.len() as f64;
            let mean = body.iter().map(|&i| found.radiance[i].x).sum::<f64>() / count;
            let error = body.iter().map(|&i| found.stderr[i].x.powi(2)).sum::<f64>().sqrt() / count;
            println!("index {ior}, roughness {roughness}: {mean:.4} +- {error:.4}");
            // Tables are within 1 %, of each interface.
            assert!((mean - 1.0).abs() < 0.01 + 4.0 * error, "index {ior}, roughness {roughness}: {mean} {error}");
        }
    }
    validated.verdict();
}

/// A rough surface of index 1 loses light too where another medium surrounds it.
#[test]
fn a_rough_bubble_in_water_is_white() {
    let Some(validated) = Validated::open() else { return };
    let bubble = Dielectric { roughness: 0.4, priority: 1, ..glass(1.0) };
    let bubble = Part::of(icosphere(4), Surface::Dielectric(bubble)).placed(DAffine3::from_scale(DVec3::splat(0.5)));
    let scene = in_white(scene([Part::glass(icosphere(4), 1.33), bubble]));
    let found = picture(&validated, &scene, Shot { depth: 1024, samples: 64, ..Shot::default() });
    let error = found.error_of_mean().x;
    println!("{:.4} +- {error:.4}", found.mean().x);
    assert!((found.mean() - 1.0).abs().max_element() < 3e-3 + 4.0 * error, "{}", found.mean());
    validated.verdict();
}

/// The same of rough panes, which have no inside.
#[test]
fn rough_panes_are_white() {
    let Some(validated) = Validated::open() else { return };
    for roughness in [0.1_f64, 0.5, 1.0] {
        let pane = Dielectric { roughness, thin_walled: true, ..glass(1.5) };
        let scene = in_white(scene([Part::of(icosphere(5), Surface::Dielectric(pane))]));
        let found = picture(&validated, &scene, Shot { depth: 1024, samples: 64, ..Shot::default() });
        let error = found.error_of_mean().x;
        println!("roughness {roughness}: {:.4} +- {error:.4}", found.mean().x);
        assert!((found.mean() - 1.0).abs().max_element() < 2e-3 + 4.0 * error, "{roughness}: {}", found.mean());
    }
    validated.verdict();
}

/// A Lambertian body reflects its share; a white one of any roughness never more than there is.
#[test]
fn opaque_bodies_reflect_their_share() {
    let Some(validated) = Validated::open() else { return };
    let color = DVec3::new(0.8, 0.5, 0.2);
    let matte = Opaque { base_color: color, specular: 0.0, ..Opaque::default() };
    let ball = |surface| in_white(scene([Part::of(icosphere(5), Surface::Opaque(surface))]));
    let found = picture(&validated, &ball(matte), Shot { samples: 64, ..Shot::default() });
    let centre = found.radiance[found.radiance.len() / 2 + 24];
    assert!((centre - color).abs().max_element() < 1e-5, "{centre}");
    for roughness in [0.0, 0.3, 1.0] {
        let metal = Opaque { base_color: DVec3::ONE, metallic: 1.0, roughness, ..Opaque::default() };
        let found = picture(&validated, &ball(metal), Shot { samples: 64, ..Shot::default() });
        assert!(found.mean().max_element() < 1.001, "{roughness}: {}", found.mean());
    }
    validated.verdict();
}
