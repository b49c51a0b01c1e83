//! Directions chosen by the environment, by the surface and by both find the same light.

use glam::DVec3;

use vitrum::plan::Estimator;
use vitrum::scene::{Dielectric, Environment, Opaque, Panorama, Scene, Surface, Surroundings};

use crate::common::Validated;
use crate::device::{Shot, picture};
use crate::shapes::{Part, glass, icosphere, rectangle, scene};

/// Dim surroundings with a lamp of so many texels a side.
fn lamp(side: u32) -> Environment {
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
        bodies.push((format!("glass {roughness}"), Surface::Dielectric(frosted)));
    }
    bodies
}

#[test]
fn estimators_agree_and_both_together_are_as_good_as_the_better_one() {
    let Some(validated) = Validated::open() else { return };
    for side in [1, 6] {
        for (name, surface) in bodies() {
            let floor = Part::of(rectangle(6.0, 6.0), Surface::Opaque(Opaque::default()))
                .placed(glam::DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.5)));
            let scene = Scene { environment: lamp(side), ..scene([Part::of(icosphere(4), surface), floor]) };
            let [both, lights, surfaces] = [Estimator::Both, Estimator::Lights, Estimator::Surfaces].map(|estimator| {
                let seed = estimator as u64 + 1;
                picture(&validated, &scene, Shot { samples: 512, depth: 8, seed, estimator, ..Shot::default() })
            });
            for (other, found) in [("lights", &lights), ("surfaces", &surfaces)] {
                let error = (both.error_of_mean().powf(2.0) + found.error_of_mean().powf(2.0)).powf(0.5);
                let z = ((both.mean() - found.mean()) / error).abs().max_element();
                println!("lamp {side}, {name}, {other}: z {z:.2}");
                assert!(z < 4.0, "lamp {side}, {name}: both {} {other} {}", both.mean(), found.mean());
            }
            let ratio = both.variance() / lights.variance().min(surfaces.variance());
            println!("lamp {side}, {name}: variance {ratio:.2} of the better one");
            assert!(ratio < 1.3, "lamp {side}, {name}: {ratio}");
        }
    }
    validated.verdict();
}
