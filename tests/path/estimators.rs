//! Directions chosen by the environment, by the surface and by both find the same light.

use glam::{DAffine3, DVec3};

use vitrum::plan::Estimator;
use vitrum::scene::{Dielectric, Environment, Opaque, Panorama, Scene, Surface, Surroundings};

use crate::common::Validated;
use crate::device::{Picture, Shot, picture};
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

/// Pictures by both, by lights alone and by surfaces alone, whose means agree.
fn agreeing(validated: &Validated, scene: &Scene, name: &str) -> [Picture; 3] {
    let pictures = [Estimator::Both, Estimator::Lights, Estimator::Surfaces].map(|estimator| {
        let seed = estimator as u64 + 1;
        picture(validated, scene, Shot { samples: 128, depth: 8, seed, estimator, ..Shot::default() })
    });
    let [both, lights, surfaces] = &pictures;
    for (other, found) in [("lights", lights), ("surfaces", surfaces)] {
        let error = (both.error_of_mean().powf(2.0) + found.error_of_mean().powf(2.0)).powf(0.5);
        let z = ((both.mean() - found.mean()) / error).abs().max_element();
        println!("{name}, {other}: z {z:.2}");
        assert!(z < 4.0, "{name}: both {} {other} {}", both.mean(), found.mean());
    }
    pictures
}

#[test]
fn estimators_agree_and_both_together_are_as_good_as_the_better_one() {
    let Some(validated) = Validated::open() else { return };
    for lamp in [Lamp::Texels(1), Lamp::Texels(6), Lamp::Surface(0.2), Lamp::Surface(1.0)] {
        for (name, surface) in bodies() {
            let name = format!("{lamp:?}, {name}");
            let [both, lights, surfaces] = agreeing(&validated, &lit(lamp, surface), &name);
            let ratio = both.variance() / lights.variance().min(surfaces.variance());
            println!("{name}: variance {ratio:.2} of the better one");
            assert!(ratio < 1.3, "{name}: {ratio}");
        }
    }
    validated.verdict();
}

/// The environment is not looked for from inside of glass, for what comes from there is bent, but through a hole it is seen.
#[test]
fn light_that_enters_by_a_hole_is_found() {
    let Some(validated) = Validated::open() else { return };
    let mut shell = icosphere(4);
    shell.triangles.retain(|triangle| triangle.iter().any(|&vertex| shell.positions[vertex as usize][1] < 0.3));
    let frosted = Dielectric { roughness: 0.6, ..glass(1.5) };
    let open = Part::of(shell, Surface::Dielectric(frosted.clone()));
    // A bubble of air: from its wall the sky is looked for, and hidden.
    let bubble = Part::of(icosphere(4), Surface::Dielectric(Dielectric { priority: 1, ..glass(1.0) }))
        .placed(DAffine3::from_scale(DVec3::splat(0.5)));
    let body = Part::of(icosphere(4), Surface::Dielectric(frosted));
    for (name, scene) in [("open ball", scene([open])), ("ball with a bubble", scene([body, bubble]))] {
        agreeing(&validated, &Scene { environment: surroundings(6), ..scene }, name);
    }
    validated.verdict();
}
