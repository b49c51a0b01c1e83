//! Against the enumerated tree, which has no noise, and against itself.

use glam::DVec3;

use vitrum::options::{Size, Trace};
use vitrum::scene::{Dielectric, Dispersion, Scene, Surface};

use crate::bodies::{asset, ball, balls_in_water, diamond, hollow, in_the_city, made_prism, pane, slab};
use crate::common::Validated;
use crate::device::{SIZE, Shot, picture, tree};
use crate::shapes::{Part, glass, icosphere, scene};
use crate::statistics::{Distance, Estimate, distance};

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

/// Pictures of one scene by seeds from `first` on.
fn pictures(validated: &Validated, scene: &Scene, first: u64, shot: Shot) -> Estimate {
    let seeds = first..first + 8;
    Estimate::of_paths(&seeds.map(|seed| picture(validated, scene, Shot { seed, ..shot })).collect::<Vec<_>>())
}

/// No value may be farther off than chance puts one of all in one of 100 cases, and the means agree within 0.1 %.
fn agree(name: &str, one: &Estimate, other: &Estimate) {
    let Distance { worst, level, beyond, means: (off, error) } = distance(one, other);
    let (percent, error) = (100.0 * off, 100.0 * error);
    println!(
        "{name}: p {worst:.1e}, {:.1} % beyond two errors, means {percent:.3} +- {error:.3} % apart",
        100.0 * beyond
    );
    assert!(worst > level, "{name}: p {worst:e} below {level:e}");
    assert!(percent < 0.1, "{name}: means {percent} % apart");
}

#[test]
fn paths_find_what_trees_enumerate() {
    let Some(validated) = Validated::open() else { return };
    for (name, scene) in scenes() {
        let scene = in_the_city(scene);
        // Wavelengths chosen at random make the most noise.
        let samples = if name.starts_with("dispersing") { 256 } else { 64 };
        let found = pictures(&validated, &scene, 1, Shot { samples, depth: 256, ..Shot::default() });
        let trees: Vec<_> = (1..=8).map(|seed| tree(&validated, &scene, seed, 64, 256)).collect();
        agree(name, &found, &Estimate::of_seeds(&trees));
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
        let shot = |trace| Shot { samples: 64, trace: Some(trace), ..Shot::default() };
        let [hardware, software] = [Trace::Hardware, Trace::Software];
        agree(
            name,
            &pictures(&validated, &scene, 1, shot(hardware)),
            &pictures(&validated, &scene, 101, shot(software)),
        );
        let [hardware, software] = [hardware, software].map(|trace| picture(&validated, &scene, shot(trace)));
        let differing =
            hardware.radiance.iter().zip(&software.radiance).filter(|(a, b)| a.distance(**b) > 1e-3).count();
        println!("{name}: {differing} pixels differ with the same seed");
        assert!(differing < hardware.radiance.len() / 50, "{name}: {differing}");
    }
    validated.verdict();
}

/// What a standard error promises: the truth lies within two of them in 95 of 100 cases.
#[test]
fn standard_errors_are_honest() {
    let Some(validated) = Validated::open() else { return };
    let frosted = Dielectric { roughness: 0.4, ..glass(1.5) };
    let frosted = scene([Part::of(icosphere(4), Surface::Dielectric(frosted))]);
    // Where a body covers a hundredth of a pixel, few samples see it: of a small picture many pixels are such.
    for (name, scene, seeds, size) in
        [("frosted ball", frosted, 25, SIZE), ("ball", ball(), 100, Size { width: 24, height: 18 })]
    {
        let scene = in_the_city(scene);
        let shot = |seed| Shot { seed, size, ..Shot::default() };
        let pictures: Vec<_> = (1..=seeds).map(|seed| picture(&validated, &scene, shot(seed))).collect();
        let count = pictures.len() as f64;
        let (mut within, mut all) = (0, 0);
        for pixel in 0..pictures[0].radiance.len() {
            let mean = pictures.iter().map(|picture| picture.radiance[pixel]).sum::<DVec3>() / count;
            for picture in &pictures {
                // The mean holds the picture itself.
                let difference = (picture.radiance[pixel] - mean) / (1.0 - 1.0 / count).sqrt();
                for channel in 0..3 {
                    all += 1;
                    within += usize::from(difference[channel].abs() <= 2.0 * picture.stderr[pixel][channel]);
                }
            }
        }
        let share = within as f64 / all as f64;
        println!("{name}: {:.2} % of errors within two standard errors", 100.0 * share);
        assert!((share - 0.95).abs() < 0.02, "{name}: {share}");
    }
    validated.verdict();
}
