//! Directions chosen by the environment, by the surface and by both find the same light.

use glam::{DAffine3, DVec3};

use vitrum::plan::Estimator;
use vitrum::scene::{Dielectric, Environment, Opaque, Panorama, Scene, Surface, Surroundings};

use crate::common::Validated;
use crate::device::{Shot, picture};
use crate::shapes::{Part, glass, icosphere, rectangle, scene};

/// What lights a scene.
#[derive(Clone, Copy, Debug)]
enum Lamp {
    /// So many texels a side of the surroundings.
    Texels(u32),
    /// A surface that shines, of such a side.
    Surface(f64),
}

/// Dim surroundings, with a lamp of so many texels a side.
fn surroundings(side: u32) -> Environment {
    let (width, height) = (64, 32);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let inside = (8..8 + side).contains(&y) && (36..36 + side).contains(&x);
        if inside { [400.0 / (side * side) as f32; 3] } else { [0.1, 0.2, 0.3] }
    };
    let light = Surroundings::Image(Panorama::new(width, height, (0..width * height).map(texel).collect()));
    Environment { light, intensity: 1.0, rotation: 0.4, visible: true }
}

fn bodies() -> Vec<(String, Surface)> {
    let mut bodies = vec![("matte".to_owned(), Surface::Opaque(Opaque::default()))];
    for roughness in [0.2, 0.5, 1.0] {
        let metal = Opaque { metallic: 1.0, roughness, ..Opaque::default() };
        bodies.push((format!("metal {roughness}"), Surface::Opaque(metal)));
        let frosted = Dielectric { roughness, ..glass(1.5) };
        bodies.push((format!("glass {roughness}"), Surface::Dielectric(frosted.clone())));
        let pane = Dielectric { thin_walled: true, ..frosted };
        bodies.push((format!("pane {roughness}"), Surface::Dielectric(pane)));
    }
    bodies
}

fn lit(lamp: Lamp, surface: Surface) -> Scene {
    let floor = Part::of(rectangle(6.0, 6.0), Surface::Opaque(Opaque::default()))
        .placed(DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.5)));
    let body = Part::of(icosphere(4), surface);
    match lamp {
        Lamp::Texels(side) => Scene { environment: surroundings(side), ..scene([body, floor]) },
        Lamp::Surface(side) => {
            let emission = DVec3::new(3.0, 2.0, 1.0) / (side * side);
            let shining = Part::emitter(rectangle(side, side), emission)
                .placed(DAffine3::from_translation(DVec3::new(1.5, 1.5, 1.0)) * DAffine3::from_rotation_x(0.8));
            Scene { environment: surroundings(0), ..scene([body, floor, shining]) }
        }
    }
}

#[test]
fn estimators_agree_and_both_together_are_as_good_as_the_better_one() {
    let Some(validated) = Validated::open() else { return };
    for lamp in [Lamp::Texels(1), Lamp::Texels(6), Lamp::Surface(0.2), Lamp::Surface(1.0)] {
        for (name, surface) in bodies() {
            let scene = lit(lamp, surface);
            let [both, lights, surfaces] = [Estimator::Both, Estimator::Lights, Estimator::Surfaces].map(|estimator| {
                let seed = estimator as u64 + 1;
                picture(&validated, &scene, Shot { samples: 128, depth: 8, seed, estimator, ..Shot::default() })
            });
            for (other, found) in [("lights", &lights), ("surfaces", &surfaces)] {
                let error = (both.error_of_mean().powf(2.0) + found.error_of_mean().powf(2.0)).powf(0.5);
                let z = ((both.mean() - found.mean()) / error).abs().max_element();
                println!("{lamp:?}, {name}, {other}: z {z:.2}");
                assert!(z < 4.0, "{lamp:?}, {name}: both {} {other} {}", both.mean(), found.mean());
            }
            let ratio = both.variance() / lights.variance().min(surfaces.variance());
            println!("{lamp:?}, {name}: variance {ratio:.2} of the better one");
            assert!(ratio < 1.3, "{lamp:?}, {name}: {ratio}");
        }
    }
    validated.verdict();
}
