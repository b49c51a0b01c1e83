//! Against the enumerated tree, which has no noise, and against itself.

use glam::DVec3;

use vitrum::options::Trace;
use vitrum::scene::{Dielectric, Dispersion, Scene, Surface};

use crate::bodies::{asset, ball, balls_in_water, diamond, hollow, in_the_city, made_prism, pane, slab};
use crate::common::Validated;
use crate::device::{Picture, Shot, picture, tree};
use crate::shapes::{Part, glass, icosphere, scene};

fn scenes() -> Vec<(&'static str, Scene)> {
    let tinted = Dielectric { attenuation_color: DVec3::new(0.2, 0.6, 0.9), attenuation_distance: 0.5, ..glass(1.5) };
    let disperser = Dielectric { dispersion: Dispersion::Khr(1.0), ..glass(1.6) };
    let prism = Part { smooth: false, ..Part::of(asset("prism.obj"), Surface::Dielectric(disperser.clone())) };
    vec![
        ("ball", ball()),
        ("hollow ball", hollow()),
        ("slab", slab()),
        ("prism", made_prism()),
        ("pane", pane()),
        ("balls in water", balls_in_water()),
        ("diamond", diamond()),
        ("tinted ball", scene([Part::of(icosphere(4), Surface::Dielectric(tinted))])),
        ("dispersing ball", scene([Part::of(icosphere(4), Surface::Dielectric(disperser))])),
        ("dispersing prism", scene([prism])),
    ]
}

/// How far a picture is from two others that have an error of their own, which their difference tells: the share of values that are
/// more than two standard errors off, and the mean difference relative to the mean.
fn distance(found: &Picture, expected: &[Vec<DVec3>; 2]) -> (f64, f64) {
    let pixels = found.radiance.len();
    let mut beyond = 0;
    let mut sum = DVec3::ZERO;
    let [one, other] = expected;
    for (((value, error), one), other) in found.radiance.iter().zip(&found.stderr).zip(one).zip(other) {
        let mean = (one + other) / 2.0;
        sum += mean;
        // Where nothing varies rounding is left.
        let variance = error.powf(2.0) + ((one - other) / 2.0).powf(2.0) + 1e-10;
        let z = (value - mean).powf(2.0) / variance;
        beyond += z.to_array().into_iter().filter(|&squared| squared > 4.0).count();
    }
    let mean = sum / pixels as f64;
    (beyond as f64 / (3 * pixels) as f64, ((found.mean() - mean) / mean).abs().max_element())
}

#[test]
fn paths_find_what_trees_enumerate() {
    let Some(validated) = Validated::open() else { return };
    for (name, scene) in scenes() {
        let scene = in_the_city(scene);
        let found = picture(&validated, &scene, Shot { samples: 512, depth: 128, ..Shot::default() });
        let expected = [1, 2].map(|seed| tree(&validated, &scene, seed, 256, 128));
        let (beyond, off) = distance(&found, &expected);
        let error = (found.error_of_mean() / found.mean()).max_element();
        println!("{name}: {:.1} % beyond two standard errors, means {off:.1e} +- {error:.1e} apart", 100.0 * beyond);
        assert!(off < 1e-3 + 4.0 * error && beyond < 0.15, "{name}: {beyond} {off} {error}");
    }
    validated.verdict();
}

#[test]
fn hardware_and_software_find_the_same() {
    let Some(validated) = Validated::open() else { return };
    if !validated.gpu.info().ray_query {
        return validated.verdict();
    }
    for (name, scene) in scenes().into_iter().take(3) {
        let scene = in_the_city(scene);
        let [hardware, software] = [Trace::Hardware, Trace::Software]
            .map(|trace| picture(&validated, &scene, Shot { samples: 32, trace: Some(trace), ..Shot::default() }));
        let differing =
            hardware.radiance.iter().zip(&software.radiance).filter(|(a, b)| a.distance(**b) > 1e-3).count();
        println!("{name}: {differing} pixels differ");
        assert!(differing < hardware.radiance.len() / 50, "{name}: {differing}");
    }
    validated.verdict();
}

/// What a standard error promises: the truth lies within two of them in 95 of 100 cases.
#[test]
fn standard_errors_are_honest() {
    let Some(validated) = Validated::open() else { return };
    let frosted = Dielectric { roughness: 0.4, ..glass(1.5) };
    let scene = in_the_city(scene([Part::of(icosphere(4), Surface::Dielectric(frosted))]));
    let pictures: Vec<_> =
        (1..=24).map(|seed| picture(&validated, &scene, Shot { samples: 256, seed, ..Shot::default() })).collect();
    let count = pictures.len() as f64;
    let (mut within, mut all) = (0, 0);
    for pixel in 0..pictures[0].radiance.len() {
        let mean = pictures.iter().map(|picture| picture.radiance[pixel]).sum::<DVec3>() / count;
        for picture in &pictures {
            // The mean holds the picture itself.
            let difference = (picture.radiance[pixel] - mean) / (1.0 - 1.0 / count).sqrt();
            for (difference, error) in difference.to_array().into_iter().zip(picture.stderr[pixel].to_array()) {
                within += usize::from(difference.abs() <= 2.0 * error);
                all += 1;
            }
        }
    }
    let share = within as f64 / all as f64;
    println!("{:.2} % within two standard errors", 100.0 * share);
    assert!((share - 0.95).abs() < 0.02, "{share}");
    validated.verdict();
}
